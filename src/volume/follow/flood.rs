//! The flood: from cells at the seeds through all cells that the surface crosses.
//!
//! It goes in waves. The corners of all cells in the queue are evaluated; each cell that the surface crosses is kept,
//! and queues its neighbours beyond the faces it crosses. When no cell is left, seeds with no surface in their own
//! cell or those around are looked at, and their 26 neighbours queued.

use super::super::error::VolumeError;
use super::Lattice;
use super::batch::Batch;
use super::blocks::{ABSENT, Blocks, Node};

/// Axis, whether it is the far one, and corners (as bits of a case) of each face of a cell.
const FACES: [(usize, bool, u8); 6] =
    [(0, false, 0x0F), (0, true, 0xF0), (1, false, 0x55), (1, true, 0xAA), (2, false, 0x33), (2, true, 0xCC)];

/// A cell that the surface crosses.
#[derive(Clone, Copy)]
pub(super) struct CutCell {
    pub slot: u32,
    /// A bit a corner inside.
    pub case: u8,
}

/// What has been followed, and where it goes on.
#[derive(Default)]
pub(super) struct Flood {
    /// Cells of seeds that came since the last wave.
    seeds: Vec<Node>,
    /// Cells of seeds that may yet turn out to have no surface near.
    waiting: Vec<u32>,
    /// Cells of the next wave.
    queue: Vec<u32>,
    /// Cells of this wave that are not yet dealt with.
    wave: Vec<u32>,
    /// Nodes evaluated for this wave.
    wanted: Vec<u32>,
    /// All crossed cells so far, in the order they were found.
    pub cut: Vec<CutCell>,
}

impl Flood {
    /// Starts at a cell, and in the cells around it should the surface cross none of them.
    pub fn seed(&mut self, cell: Node) {
        self.seeds.push(cell);
    }

    /// Queues a cell, unless it was seen before: then false.
    pub fn look_at(&mut self, cell: Node, blocks: &mut Blocks) -> Result<bool, VolumeError> {
        let slot = blocks.open(cell)?;
        let is_new = blocks.see(slot);
        if is_new {
            self.queue.push(slot);
        }
        Ok(is_new)
    }

    /// Fills `batch` with what the next wave needs, which may be nothing; false where no cell is left.
    pub fn ask(
        &mut self,
        blocks: &mut Blocks,
        lattice: &Lattice,
        batch: &mut Batch,
    ) -> Result<bool, VolumeError> {
        self.sow(blocks)?;
        if self.queue.is_empty() {
            self.widen(blocks)?;
        }
        for &cell in &self.queue {
            blocks.open_corners(cell)?;
        }
        // From here on nothing can fail: after an error above, the queue is as it was.
        self.wave = std::mem::take(&mut self.queue);
        let corners = self.wave.iter().flat_map(|&cell| blocks.corners(cell));
        self.wanted.clear();
        self.wanted.extend(corners.filter(|&slot| blocks.is_unknown(slot)));
        // By block and node: near ones stay together.
        self.wanted.sort_unstable();
        self.wanted.dedup();
        batch.extend(self.wanted.iter().map(|&slot| lattice.position(blocks.node(slot))));
        Ok(!self.wave.is_empty())
    }

    /// Takes the values of the wave, and queues the next one. After an error it can be called again.
    pub fn take(&mut self, values: &[f64], blocks: &mut Blocks) -> Result<(), VolumeError> {
        for (&slot, &value) in self.wanted.iter().zip(values) {
            blocks.set(slot, value);
        }
        while let Some(&slot) = self.wave.last() {
            let case = blocks.case(slot);
            if case != 0 && case != 255 {
                self.cut.try_reserve(1).map_err(|_| too_large(&self.cut))?;
                self.cross_faces(slot, case, blocks)?;
                self.cut.push(CutCell { slot, case });
            }
            self.wave.pop();
        }
        Ok(())
    }

    /// Queues the cells beyond the faces that the surface crosses. There is one beyond each: the lattice ends in nodes
    /// that are outside.
    fn cross_faces(&mut self, slot: u32, case: u8, blocks: &mut Blocks) -> Result<(), VolumeError> {
        let cell = blocks.node(slot);
        for (axis, is_far, mask) in FACES {
            let inside = case & mask;
            if inside != 0 && inside != mask {
                let mut beyond = cell;
                beyond[axis] = if is_far { cell[axis] + 1 } else { cell[axis] - 1 };
                self.look_at(beyond, blocks)?;
            }
        }
        Ok(())
    }

    /// Queues the cells of new seeds.
    fn sow(&mut self, blocks: &mut Blocks) -> Result<(), VolumeError> {
        while let Some(&cell) = self.seeds.last() {
            self.look_at(cell, blocks)?;
            self.waiting.push(blocks.slot(cell));
            self.seeds.pop();
        }
        Ok(())
    }

    /// Queues the cells around those seeds near which nothing was found.
    fn widen(&mut self, blocks: &mut Blocks) -> Result<(), VolumeError> {
        self.waiting.sort_unstable();
        self.waiting.dedup();
        self.waiting.retain(|&cell| !around(cell, blocks).iter().any(|&near| is_followed(near, blocks)));
        while let Some(&cell) = self.waiting.last() {
            around(cell, blocks).into_iter().try_for_each(|near| self.look_at(near, blocks).map(drop))?;
            self.waiting.pop();
        }
        Ok(())
    }
}

/// Whether a cell was looked at and the surface crosses it.
fn is_followed(cell: Node, blocks: &Blocks) -> bool {
    let slot = blocks.slot(cell);
    slot != ABSENT && blocks.is_seen(slot) && !matches!(blocks.case(slot), 0 | 255)
}

/// A cell and those around it, within the padded lattice.
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
