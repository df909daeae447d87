//! The numbers of vertices, triangles and components of all surfaces together.

use super::cells::{Cell, CellBox};
use super::cube_loops::{cube_loops, edge_at, face};
use super::label_grid::BACKGROUND;
use super::nets::{NetVertex, Nets};
use crate::mesh::DisjointSets;
use std::collections::BTreeSet;

/// The numbers of vertices and triangles of all surfaces together, or of a part of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
}

impl Counts {
    /// Returns the Euler characteristic, V − E + F; each edge has two triangles.
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - self.triangles as i64 / 2
    }

    /// Returns the numbers of vertices and triangles after collapses of `edges` edges.
    pub fn without(&self, edges: usize) -> [usize; 2] {
        [self.vertices - edges, self.triangles - 2 * edges]
    }

    /// Adds those of a part.
    pub fn add(&mut self, part: Self) {
        self.vertices += part.vertices;
        self.triangles += part.triangles;
    }

    /// Subtracts those of a part.
    pub fn remove(&mut self, part: Self) {
        self.vertices -= part.vertices;
        self.triangles -= part.triangles;
    }
}

impl Nets {
    /// Counts the vertices in and the polygons that begin at the cells of a box: calls `add` with parts of the counts of
    /// each label, by number.
    pub fn count(&self, area: &CellBox, mut add: impl FnMut(u16, Counts)) {
        let mut on_faces = BTreeSet::new();
        for slot in self.cells.within(area) {
            let cell = self.cells.get(slot);
            cell.numbers()
                .for_each(|number| add(number, Counts { vertices: loops_of(cell, number), triangles: 0 }));
            for crossing in self.crossings(slot) {
                let is_divided = self.has_face_vertices(&crossing);
                for far in [false, true] {
                    let number = crossing.ends[usize::from(far)];
                    if number == BACKGROUND {
                        continue;
                    }
                    if !is_divided {
                        add(number, Counts { vertices: 0, triangles: 2 });
                        continue;
                    }
                    let patch = self.patch(&crossing, far);
                    // Divided around a vertex of its own.
                    add(number, Counts { vertices: 1, triangles: patch.triangles().len() });
                    let faces = patch.triangles().iter().flatten();
                    on_faces.extend(faces.filter(|vertex| matches!(vertex, NetVertex::Face { .. })));
                }
            }
        }
        for vertex in on_faces {
            let NetVertex::Face { slot, corner, .. } = vertex else { continue };
            let cell = self.cells.get(slot);
            if area.contains(cell.at) {
                add(cell.corners[usize::from(corner)], Counts { vertices: 1, triangles: 0 });
            }
        }
    }

    /// Counts the connected components of all surfaces.
    pub fn components(&self) -> usize {
        let first = self.first_vertices();
        let mut sets = DisjointSets::new(first.last().map_or(0, |&count| count as usize));
        for (slot, cell) in (0..).zip(self.cells.slots()) {
            if !cell.is_live() {
                continue;
            }
            for axis in 0..3 {
                let mut next = cell.at;
                next[axis] += 1;
                if let Some(next) = self.cells.find(next) {
                    self.join_across(axis, slot, next, &first, &mut sets);
                }
            }
        }
        sets.count()
    }

    /// Joins the vertices in a cell with those in the next one along an axis that share a polygon edge with them.
    fn join_across(&self, axis: usize, slot: u32, next: u32, first: &[u32], sets: &mut DisjointSets) {
        let [cell, other] = [slot, next].map(|slot| self.cells.get(slot));
        let labels = face(axis, true).map(|corner| cell.corners[corner]);
        for (i, &number) in labels.iter().enumerate() {
            if number == BACKGROUND || labels[..i].contains(&number) || labels.iter().all(|&l| l == number) {
                continue;
            }
            if cell.simple > 0 && other.simple > 0 {
                sets.union(self.index_in(first, slot, number), self.index_in(first, next, number));
                continue;
            }
            let [case, other_case] = [cell, other].map(|cell| &cube_loops()[cell.case(number)]);
            for (j, (edge, other_edge)) in edges_towards(axis).into_iter().enumerate() {
                if (labels[j] == number) != (labels[(j + 1) % 4] == number) {
                    let index = self.index_in(first, slot, number) + usize::from(case.of_edge[edge]);
                    let other =
                        self.index_in(first, next, number) + usize::from(other_case.of_edge[other_edge]);
                    sets.union(index, other);
                }
            }
        }
    }

    /// Returns the number of vertices in the cells of lower slots, for each slot, and the number of all.
    fn first_vertices(&self) -> Vec<u32> {
        let mut sum = 0;
        let mut first = Vec::with_capacity(self.cells.slots().len() + 1);
        first.push(0);
        first.extend(self.cells.slots().iter().map(|cell| {
            sum += match cell.simple {
                _ if !cell.is_live() => 0,
                0 => cell.numbers().map(|number| loops_of(cell, number)).sum::<usize>() as u32,
                surfaces => surfaces.into(),
            };
            sum
        }));
        first
    }

    /// Returns the index of the first vertex of a label in a cell among those of all cells.
    fn index_in(&self, first: &[u32], slot: u32, number: u16) -> usize {
        let cell = self.cells.get(slot);
        let first = first[slot as usize] as usize;
        match cell.simple {
            1 => first,
            2 => first + usize::from(cell.numbers().next() != Some(number)),
            _ => {
                let before = cell.numbers().take_while(|&other| other != number);
                first + before.map(|number| loops_of(cell, number)).sum::<usize>()
            }
        }
    }
}

/// Returns the edges of the far face of a cell along an axis, between each of its corners and the next, as edges of the
/// cell and of the next one.
fn edges_towards(axis: usize) -> [(usize, usize); 4] {
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    // The other two coordinates of an edge along the next axis are the last one and `axis`, and so on.
    let along_next = |c: usize| (edge_at(next, c, 1), edge_at(next, c, 0));
    let along_last = |b: usize| (edge_at(last, 1, b), edge_at(last, 0, b));
    [along_next(0), along_last(1), along_next(1), along_last(0)]
}

fn loops_of(cell: &Cell, number: u16) -> usize {
    cube_loops()[cell.case(number)].count.into()
}
