//! The number of connected components of all surfaces together.
//!
//! Each block of cells has its own components, and lists those that pass through its faces. After a change this is
//! done again for the blocks around it only, and the lists of all blocks are joined.

use super::cells::{BLOCK_SIDE, Cell, CellBox, Cells};
use super::cube_loops::{cube_loops, edges_across, face};
use super::label_grid::BACKGROUND;
use crate::mesh::DisjointSets;
use crate::pauses::Pauses;

/// Work that a block counts as.
const BLOCK_WORK: usize = 50;

/// The components of all surfaces together.
#[derive(Clone, Debug, Default)]
pub struct Components {
    /// Those in each block, in the order of the blocks of the cells.
    blocks: Vec<BlockComponents>,
    count: usize,
}

/// The components of the surfaces within a block.
#[derive(Clone, Debug, Default)]
struct BlockComponents {
    /// Index of the block along x, y and z.
    at: [u32; 3],
    count: usize,
    /// For the near and the far face along each axis, the component of each polygon edge that passes through the face. The
    /// block beyond the face lists the same polygon edges, in the same order.
    passing: [[Vec<u16>; 2]; 3],
}

impl Components {
    /// Returns their number.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Follows changes of the cells in a box.
    pub async fn update(&mut self, cells: &Cells, area: &CellBox, pauses: &Pauses) {
        for (index, at) in cells.blocks_within(area) {
            pauses.after(BLOCK_WORK).await;
            if index >= self.blocks.len() {
                self.blocks.resize_with(index + 1, BlockComponents::default);
            }
            self.blocks[index] = BlockComponents::new(cells, index, at);
            pauses.after(cells.in_block(index).flatten().count()).await;
        }
        self.count = self.joined(cells);
    }

    /// Joins the components of all blocks; returns the number that is left.
    fn joined(&self, cells: &Cells) -> usize {
        let mut total = 0;
        let mut first = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            first.push(total);
            total += block.count;
        }
        let mut sets = DisjointSets::new(total);
        for (block, start) in self.blocks.iter().zip(&first) {
            for (axis, [_, passing]) in block.passing.iter().enumerate() {
                let mut next = block.at;
                next[axis] += 1;
                let Some(next) = cells.block(next) else { continue };
                let beyond = &self.blocks[next].passing[axis][0];
                debug_assert_eq!(passing.len(), beyond.len());
                for (&own, &other) in passing.iter().zip(beyond) {
                    sets.union(start + usize::from(own), first[next] + usize::from(other));
                }
            }
        }
        sets.count()
    }
}

impl BlockComponents {
    fn new(cells: &Cells, index: usize, at: [u32; 3]) -> Self {
        let in_block: Vec<Option<&Cell>> =
            cells.in_block(index).map(|slot| slot.map(|slot| cells.get(slot))).collect();
        let mut total = 0;
        let mut first = vec![0; in_block.len()];
        for (first, cell) in first.iter_mut().zip(&in_block) {
            *first = total;
            total += cell.map_or(0, vertices_in);
        }
        let mut sets = DisjointSets::new(total);
        let side = BLOCK_SIDE as usize;
        let mut on_faces: [[Vec<usize>; 2]; 3] = Default::default();
        for (i, cell) in in_block.iter().enumerate() {
            let Some(cell) = cell else { continue };
            for (axis, [near_face, far_face]) in on_faces.iter_mut().enumerate() {
                let stride = side.pow(axis as u32);
                let place = i / stride % side;
                let vertices = |far| passing_face(cell, axis, far).map(|vertex| first[i] + vertex);
                if place == 0 {
                    near_face.extend(vertices(false));
                }
                if place == side - 1 {
                    far_face.extend(vertices(true));
                } else if let Some(next) = in_block[i + stride] {
                    let others = passing_face(next, axis, false).map(|vertex| first[i + stride] + vertex);
                    vertices(true).zip(others).for_each(|(own, other)| sets.union(own, other));
                }
            }
        }
        let mut numbers = vec![u16::MAX; total];
        let mut count = 0;
        let mut number_of = |vertex| {
            let number = &mut numbers[sets.find(vertex)];
            if *number == u16::MAX {
                *number = count;
                count += 1;
            }
            *number
        };
        let passing =
            on_faces.map(|ends| ends.map(|vertices| vertices.into_iter().map(&mut number_of).collect()));
        Self { at, count: sets.count(), passing }
    }
}

/// Returns the number of vertices in a cell.
fn vertices_in(cell: &Cell) -> usize {
    if cell.is_single {
        return cell.numbers().count();
    }
    cell.numbers().map(|number| cell.vertices_of(number)).sum()
}

/// Returns, of the vertices in a cell, numbered from 0 label by label, that of each polygon edge that passes through a
/// face. The cell beyond the face has the same polygon edges in the same order.
fn passing_face(cell: &Cell, axis: usize, far: bool) -> impl Iterator<Item = usize> + '_ {
    let labels = face(axis, far).map(|corner| cell.corners[corner]);
    let edges = edges_across(axis, far);
    (0..4).flat_map(move |i| {
        let ends = [labels[i], labels[(i + 1) % 4]];
        let is_crossed = ends[0] != ends[1];
        let with_surface = ends.into_iter().filter(move |&number| is_crossed && number != BACKGROUND);
        with_surface.map(move |number| vertex_of(cell, number, edges[i]))
    })
}

/// Returns which of the vertices in a cell is that of a label at an edge that is crossed.
fn vertex_of(cell: &Cell, number: u16, edge: usize) -> usize {
    if cell.is_single {
        return cell.numbers().take_while(|&other| other != number).count();
    }
    let before = cell.numbers().take_while(|&other| other != number);
    before.map(|other| cell.vertices_of(other)).sum::<usize>()
        + usize::from(cube_loops()[cell.case(number)].of_edge[edge])
}
