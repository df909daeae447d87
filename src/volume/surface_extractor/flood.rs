//! The flood of the surface extractor: a breadth-first traversal from the cells of the seeds through all cells that the
//! surface crosses.
//!
//! It proceeds in waves. The corners of all queued cells are evaluated; each cell that the surface crosses is stored,
//! and its neighbours across the crossed faces are queued. When the queue is empty, the 26 neighbours of seed cells are
//! queued if the surface crosses neither the seed cell nor a visited neighbour.

use super::super::error::VolumeError;
use super::Lattice;
use super::batch::Batch;
use super::blocks::{ABSENT, Blocks, Node};
use crate::math::order::sort_distinct;

/// The six faces of a cell: axis, whether it is the far face along it, and the face's corners as a mask of the bits of
/// a marching cubes case.
const FACES: [(usize, bool, u8); 6] =
    [(0, false, 0x0F), (0, true, 0xF0), (1, false, 0x55), (1, true, 0xAA), (2, false, 0x33), (2, true, 0xCC)];

/// A cell of the lattice that the surface crosses, with its marching cubes case.
#[derive(Clone, Copy)]
pub(super) struct CrossedCell {
    pub slot: u32,
    /// Marching cubes case: one bit per corner, set if it is inside.
    pub case: u8,
}

/// State of the flood, which follows the surface from cell to cell: the crossed cells found so far and the cells to
/// visit next. Cells are processed in waves, so that the function is evaluated for many at a time.
#[derive(Default)]
pub(super) struct Flood {
    /// Cells of seeds that have not been queued yet.
    seeds: Vec<Node>,
    /// Queued cells of seeds. If the queue runs empty before a surface is found in or next to one, its neighbours are
    /// queued, too.
    unresolved_seeds: Vec<u32>,
    /// Slots of the cells to visit in the next wave.
    queue: Vec<u32>,
    /// Slots of the cells of the current wave that have not been processed yet.
    wave: Vec<u32>,
    /// Slots of the nodes that are evaluated for the current wave: the corners of its cells without a value.
    requested: Vec<u32>,
    /// All crossed cells found so far, in the order of discovery.
    pub crossed: Vec<CrossedCell>,
}

impl Flood {
    /// Adds the cell of a seed, in which the flood starts; its neighbours are visited, too, if no surface is found in
    /// or next to it.
    pub fn seed(&mut self, cell: Node) {
        self.seeds.push(cell);
    }

    /// Queues a cell unless the flood visited or queued it before; returns whether it was queued.
    pub fn visit(&mut self, cell: Node, blocks: &mut Blocks) -> Result<bool, VolumeError> {
        let slot = blocks.open(cell)?;
        let is_new = blocks.mark_visited(slot);
        if is_new {
            self.queue.push(slot);
        }
        Ok(is_new)
    }

    /// Starts the next wave and fills `batch` with the corners of its cells that are not evaluated yet, which may be
    /// none; returns false if no cell is left to visit.
    pub fn request(
        &mut self,
        blocks: &mut Blocks,
        lattice: &Lattice,
        batch: &mut Batch,
    ) -> Result<bool, VolumeError> {
        self.queue_seeds(blocks)?;
        if self.queue.is_empty() {
            self.queue_seed_neighbours(blocks)?;
        }
        for &cell in &self.queue {
            blocks.open_corners(cell)?;
        }
        // Nothing below can fail: after an error above, the queue is unchanged.
        self.wave = std::mem::take(&mut self.queue);
        let corners = self.wave.iter().flat_map(|&cell| blocks.corners(cell));
        self.requested.clear();
        self.requested.extend(corners.filter(|&slot| blocks.is_unknown(slot)));
        // Sorted by block and node, so that neighbouring points are adjacent.
        sort_distinct(&mut self.requested);
        batch.extend(self.requested.iter().map(|&slot| lattice.position(blocks.node(slot))));
        Ok(!self.wave.is_empty())
    }

    /// Stores the function values requested for the current wave, records its crossed cells and queues their neighbours
    /// for the next wave. Can be called again after an error.
    pub fn store_values(&mut self, values: &[f64], blocks: &mut Blocks) -> Result<(), VolumeError> {
        for (&slot, &value) in self.requested.iter().zip(values) {
            blocks.set(slot, value);
        }
        while let Some(&slot) = self.wave.last() {
            let case = blocks.case(slot);
            if case != 0 && case != 255 {
                self.crossed.try_reserve(1).map_err(|_| too_large(&self.crossed))?;
                self.cross_faces(slot, case, blocks)?;
                self.crossed.push(CrossedCell { slot, case });
            }
            self.wave.pop();
        }
        Ok(())
    }

    /// Queues the neighbours of a cell across the faces that the surface crosses. These neighbours always exist: the
    /// outermost nodes of the padded lattice are outside.
    fn cross_faces(&mut self, slot: u32, case: u8, blocks: &mut Blocks) -> Result<(), VolumeError> {
        let cell = blocks.node(slot);
        for (axis, is_far, mask) in FACES {
            let inside = case & mask;
            if inside != 0 && inside != mask {
                let mut beyond = cell;
                beyond[axis] = if is_far { cell[axis] + 1 } else { cell[axis] - 1 };
                self.visit(beyond, blocks)?;
            }
        }
        Ok(())
    }

    fn queue_seeds(&mut self, blocks: &mut Blocks) -> Result<(), VolumeError> {
        while let Some(&cell) = self.seeds.last() {
            self.visit(cell, blocks)?;
            self.unresolved_seeds.push(blocks.slot(cell));
            self.seeds.pop();
        }
        Ok(())
    }

    /// Queues the neighbours of those seed cells in or next to which no surface was found.
    fn queue_seed_neighbours(&mut self, blocks: &mut Blocks) -> Result<(), VolumeError> {
        sort_distinct(&mut self.unresolved_seeds);
        self.unresolved_seeds
            .retain(|&cell| !around(cell, blocks).iter().any(|&near| is_crossed(near, blocks)));
        while let Some(&cell) = self.unresolved_seeds.last() {
            around(cell, blocks).into_iter().try_for_each(|near| self.visit(near, blocks).map(drop))?;
            self.unresolved_seeds.pop();
        }
        Ok(())
    }
}

/// Returns whether a cell was visited and the surface crosses it.
fn is_crossed(cell: Node, blocks: &Blocks) -> bool {
    let slot = blocks.slot(cell);
    slot != ABSENT && blocks.is_visited(slot) && !matches!(blocks.case(slot), 0 | 255)
}

/// Returns a cell and its neighbours across faces, edges and corners within the padded lattice, up to 27 cells.
fn around(cell: u32, blocks: &Blocks) -> Vec<Node> {
    let (cell, cells) = (blocks.node(cell), blocks.cells());
    let step = |k: usize, by: usize| (cell[k] + by).checked_sub(1).filter(|&at| at < cells[k]);
    let near = |i: usize| Some([step(0, i % 3)?, step(1, i / 3 % 3)?, step(2, i / 9)?]);
    (0..27).filter_map(near).collect()
}

fn too_large<T>(held: &[T]) -> VolumeError {
    VolumeError::TooLarge { bytes: 2 * size_of_val(held) as u64 }
}

#[cfg(test)]
mod tests {
    use super::super::super::cube_cases::corner;
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn faces_have_the_corners_of_the_table_of_cases() {
        for (axis, is_far, mask) in FACES {
            for i in 0..8 {
                let offset = [i & 1, i >> 1 & 1, i >> 2];
                assert_eq!(mask >> corner(offset) & 1 == 1, offset[axis] == usize::from(is_far));
            }
        }
    }

    #[test]
    fn a_cell_and_those_around_it_are_27_and_fewer_at_the_border() {
        let mut blocks = Blocks::new([5; 3]).unwrap();
        let mut count = |cell: Node| {
            let slot = blocks.open(cell).unwrap();
            let near = around(slot, &blocks);
            assert!(near.iter().all(|n| (0..3).all(|k| n[k] <= 5 && n[k].abs_diff(cell[k]) <= 1)));
            near.len()
        };
        assert_eq!([count([3; 3]), count([0; 3]), count([5, 3, 0])], [27, 8, 12]);
    }
}
