//! The numbers of vertices, triangles and components of all surfaces together.

use super::cube_loops::cube_loops;
use super::label_grid::BACKGROUND;
use super::nets::{NetVertex, Nets};
use crate::mesh::DisjointSets;
use std::collections::BTreeSet;

/// The size and the topology of all surfaces together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of connected components.
    pub components: usize,
}

impl Counts {
    /// Returns the Euler characteristic, V − E + F; each edge has two triangles.
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - self.triangles as i64 / 2
    }
}

impl Nets {
    /// Counts vertices, triangles and components.
    pub fn counts(&self) -> Counts {
        let first = self.first_vertices();
        let in_cells = first.last().copied().unwrap_or(0);
        let mut sets = DisjointSets::new(in_cells as usize);
        let mut counts = Counts { vertices: in_cells as usize, ..Counts::default() };
        let mut on_faces = BTreeSet::new();
        for (slot, cell) in (0..).zip(self.cells.slots()) {
            if !cell.is_live() {
                continue;
            }
            for crossing in self.crossings(slot) {
                for far in [false, true] {
                    let number = crossing.ends[usize::from(far)];
                    if number == BACKGROUND {
                        continue;
                    }
                    let patch = self.patch(&crossing, far);
                    counts.triangles += patch.triangles().len();
                    // Divided around a vertex of its own.
                    counts.vertices += usize::from(patch.triangles().len() > 2);
                    let mut before = None;
                    for &vertex in patch.triangles().iter().flatten() {
                        match vertex {
                            NetVertex::Cell { slot, on } => {
                                let index = self.index_in(&first, slot, number) + usize::from(on);
                                sets.union(before.unwrap_or(index), index);
                                before = Some(index);
                            }
                            NetVertex::Face { .. } => {
                                on_faces.insert(vertex);
                            }
                            NetVertex::Edge { .. } => {}
                        }
                    }
                }
            }
        }
        counts.vertices += on_faces.len();
        counts.components = sets.count();
        counts
    }

    /// Returns the number of vertices in the cells of lower slots, for each slot, and the number of all.
    fn first_vertices(&self) -> Vec<u32> {
        let mut sum = 0;
        let mut first = vec![0];
        first.extend(self.cells.slots().iter().map(|cell| {
            let numbers = (0..8).filter(|&i| is_first(&cell.corners, i));
            sum += numbers.map(|i| loops_of(cell, cell.corners[i])).sum::<u32>();
            sum
        }));
        first
    }

    /// Returns the index of the first vertex of a label in a cell among those of all cells.
    fn index_in(&self, first: &[u32], slot: u32, number: u16) -> usize {
        let cell = self.cells.get(slot);
        let before =
            (0..8).take_while(|&i| cell.corners[i] != number).filter(|&i| is_first(&cell.corners, i));
        let skipped: u32 = before.map(|i| loops_of(cell, cell.corners[i])).sum();
        (first[slot as usize] + skipped) as usize
    }
}

/// Returns whether corner `i` is the first one with its label, which is not the background.
fn is_first(corners: &[u16; 8], i: usize) -> bool {
    corners[i] != BACKGROUND && !corners[..i].contains(&corners[i])
}

fn loops_of(cell: &super::cells::Cell, number: u16) -> u32 {
    cube_loops()[cell.case(number)].count.into()
}
