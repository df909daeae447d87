//! Sparse storage of function values at the nodes of the surface extractor's lattice, in blocks of 8 × 8 × 8 that are
//! allocated on demand.
//!
//! The lattice is padded by one layer of outside nodes, so node (i, j, k) of the lattice is node (i + 1, j + 1, k + 1)
//! in this module. A cell is identified by its corner of lowest coordinates. A slot is the index of a node, or of the
//! cell that starts there, in the allocated blocks.

use super::super::cube_cases::corner;
use super::super::error::{VolumeError, reserve};

/// The indices along x, y and z of a node of the padded lattice.
pub(super) type Node = [usize; 3];

/// Number of nodes along the side of a block of the sparse lattice storage. If it is smaller, the table of blocks
/// grows; if larger, more of each block lies off the surface.
const SIDE: usize = 8;
const BLOCK: usize = SIDE * SIDE * SIDE;
/// Largest number of allocated blocks: up to it, three vertices per node (one per edge) have distinct `u32` indices.
const MAX_BLOCKS: usize = u32::MAX as usize / (3 * BLOCK);

/// Slot number of a node whose block is not allocated; also marks such a block in the table of blocks.
pub(super) const ABSENT: u32 = u32::MAX;

/// Stored value of a node at which the function has not been evaluated.
const UNKNOWN: f64 = f64::NAN;
/// Stored value of a node in the padding, and of one at which the function is NaN: both are outside the surface.
const OUTSIDE: f64 = f64::NEG_INFINITY;

/// Returns whether a node with this function value is inside the surface, which values of 0 and above are.
pub(super) fn is_inside(value: f64) -> bool {
    value >= 0.0
}

/// Replaces NaN by [`OUTSIDE`], since NaN marks unknown values in the storage.
pub(super) fn nan_to_outside(value: f64) -> f64 {
    if value.is_nan() { OUTSIDE } else { value }
}

/// Returns the node after `node` along an axis.
pub(super) fn next(mut node: Node, axis: usize) -> Node {
    node[axis] += 1;
    node
}

/// Returns the offset of a cell's corner from the cell's first node; the inverse of [`corner`].
fn corner_offset(number: usize) -> [usize; 3] {
    [number >> 2 & 1, number & 1, number >> 1 & 1]
}

/// Returns the index of a node within its block.
fn local(node: Node) -> usize {
    let [x, y, z] = node.map(|k| k % SIDE);
    (z * SIDE + y) * SIDE + x
}

/// Sparse block storage of function values at lattice nodes, and of marks for the cells that the flood has visited.
pub(super) struct Blocks {
    /// Number of nodes of the padded lattice along each axis.
    nodes: [usize; 3],
    /// Number of blocks that cover the padded lattice, along each axis.
    dims: [usize; 3],
    /// Index of the allocated block at each block position, x fastest, then y, z; [`ABSENT`] where none is allocated.
    table: Vec<u32>,
    /// Node of lowest coordinates of each allocated block.
    origins: Vec<[u16; 3]>,
    values: Vec<f64>,
    /// One bit per cell: whether the flood has visited or queued it.
    visited: Vec<u64>,
}

impl Blocks {
    /// Creates empty storage for a lattice of `dims` nodes and one layer of padding around it.
    pub fn new(dims: [usize; 3]) -> Result<Self, VolumeError> {
        let nodes = dims.map(|n| n + 2);
        let dims = nodes.map(|n| n.div_ceil(SIDE));
        let positions = dims.iter().product();
        let mut table = reserve(positions)?;
        table.resize(positions, ABSENT);
        Ok(Self { nodes, dims, table, origins: Vec::new(), values: Vec::new(), visited: Vec::new() })
    }

    /// Returns the size of the stored values, marks and tables in bytes, without spare capacity.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.table[..])
            + size_of_val(&self.origins[..])
            + size_of_val(&self.values[..])
            + size_of_val(&self.visited[..])
    }

    /// Returns the number of slots, one per node of the allocated blocks: 512 for each block.
    pub fn slots(&self) -> usize {
        self.values.len()
    }

    /// Returns the number of cells of the padded lattice along each axis.
    pub fn cells(&self) -> [usize; 3] {
        self.nodes.map(|n| n - 1)
    }

    /// Returns whether a node belongs to the padding, the layer of outside nodes around the lattice.
    pub fn is_padding(&self, node: Node) -> bool {
        (0..3).any(|k| node[k] == 0 || node[k] + 1 >= self.nodes[k])
    }

    fn block_position(&self, node: Node) -> usize {
        let [x, y, z] = node.map(|k| k / SIDE);
        (z * self.dims[1] + y) * self.dims[0] + x
    }

    /// Returns the slot of a node, its index in the allocated blocks; [`ABSENT`] if its block is not allocated.
    pub fn slot(&self, node: Node) -> u32 {
        match self.table[self.block_position(node)] {
            ABSENT => ABSENT,
            block => block * BLOCK as u32 + local(node) as u32,
        }
    }

    /// Returns the node of a slot; the inverse of [`Self::slot`].
    pub fn node(&self, slot: u32) -> Node {
        let (block, local) = (slot as usize / BLOCK, slot as usize % BLOCK);
        let [x, y, z] = self.origins[block].map(usize::from);
        [x + local % SIDE, y + local / SIDE % SIDE, z + local / (SIDE * SIDE)]
    }

    /// Returns a sort key that orders slots (indices of nodes in the storage) by block position, then node, so that
    /// results do not depend on the order of allocation.
    pub fn rank(&self, slot: u32) -> u64 {
        let position = self.block_position(self.node(slot)) as u64;
        position * BLOCK as u64 + u64::from(slot) % BLOCK as u64
    }

    /// Returns the slot of a node (its index in the storage), allocating its block if necessary.
    pub fn open(&mut self, node: Node) -> Result<u32, VolumeError> {
        if self.slot(node) == ABSENT {
            self.make_block(node)?;
        }
        Ok(self.slot(node))
    }

    /// Allocates the blocks that contain the corners of a cell, given by the slot of its first node.
    pub fn open_corners(&mut self, cell: u32) -> Result<(), VolumeError> {
        let node = self.node(cell);
        if node.iter().any(|k| k % SIDE == SIDE - 1) {
            for number in 1..8 {
                self.open(at_corner(node, number))?;
            }
        }
        Ok(())
    }

    fn make_block(&mut self, node: Node) -> Result<(), VolumeError> {
        let bytes = (self.bytes() + BLOCK * size_of::<f64>()) as u64;
        let too_large = VolumeError::TooLarge { bytes };
        if self.origins.len() >= MAX_BLOCKS {
            return Err(too_large);
        }
        let reserved = self.values.try_reserve(BLOCK).and_then(|()| self.visited.try_reserve(BLOCK / 64));
        reserved.and_then(|()| self.origins.try_reserve(1)).map_err(|_| too_large)?;
        let position = self.block_position(node);
        self.table[position] = self.origins.len() as u32;
        self.origins.push(node.map(|k| (k / SIDE * SIDE) as u16));
        self.visited.resize(self.visited.len() + BLOCK / 64, 0);
        for slot in self.slots()..self.slots() + BLOCK {
            let value = if self.is_padding(self.node(slot as u32)) { OUTSIDE } else { UNKNOWN };
            self.values.push(value);
        }
        Ok(())
    }

    /// Returns the slots of a cell's eight corners, numbered as in [`corner`]; [`ABSENT`] for a corner whose block is
    /// not allocated.
    pub fn corners(&self, cell: u32) -> [u32; 8] {
        let first = cell as usize % BLOCK;
        let at_border = [first % SIDE, first / SIDE % SIDE, first / (SIDE * SIDE)].contains(&(SIDE - 1));
        if at_border {
            let node = self.node(cell);
            return std::array::from_fn(|number| self.slot(at_corner(node, number)));
        }
        std::array::from_fn(|number| cell + local(corner_offset(number)) as u32)
    }

    /// Returns the function value at the node with this slot; NaN if it has not been evaluated.
    pub fn value(&self, slot: u32) -> f64 {
        self.values.get(slot as usize).copied().unwrap_or(UNKNOWN)
    }

    /// Returns whether the function has not been evaluated at the node with this slot.
    pub fn is_unknown(&self, slot: u32) -> bool {
        self.value(slot).is_nan()
    }

    /// Stores the function value at the node with this slot; NaN is stored as [`OUTSIDE`].
    pub fn set(&mut self, slot: u32, value: f64) {
        self.values[slot as usize] = nan_to_outside(value);
    }

    /// Returns the marching cubes case of a cell, one bit per inside corner. Corners that have not been evaluated count
    /// as outside.
    pub fn case(&self, cell: u32) -> u8 {
        let corners = self.corners(cell).into_iter().enumerate();
        corners.fold(0, |case, (number, slot)| case | u8::from(is_inside(self.value(slot))) << number)
    }

    /// Marks a cell as visited by the flood; returns false if it was marked already.
    pub fn mark_visited(&mut self, cell: u32) -> bool {
        let (word, bit) = (&mut self.visited[cell as usize / 64], 1 << (cell % 64));
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    /// Returns whether a cell is marked as visited by the flood.
    pub fn is_visited(&self, cell: u32) -> bool {
        self.visited.get(cell as usize / 64).is_some_and(|word| word >> (cell % 64) & 1 == 1)
    }

    /// Returns whether the surface found so far crosses a straight lattice line an odd number of times, from which the
    /// scan infers missing components; valid when the flood's queue is empty. The line runs from node `from` along
    /// `axis` up to coordinate `to`.
    ///
    /// The four cells around a cut edge are connected through the faces at that edge, so the flood visits all of them
    /// or none, and it suffices to test the one that starts where the edge starts.
    pub fn crosses_oddly(&self, from: Node, axis: usize, to: usize) -> bool {
        let mut odd = false;
        let mut node = from;
        while node[axis] < to {
            let slot = self.slot(node);
            if slot == ABSENT {
                node[axis] = (node[axis] / SIDE + 1) * SIDE;
                continue;
            }
            let after = next(node, axis);
            if self.is_visited(slot) {
                odd ^= is_inside(self.value(slot)) != is_inside(self.value(self.slot(after)));
            }
            node = after;
        }
        odd
    }
}

/// Returns the node at corner `number` of the cell that starts at `node`.
fn at_corner(node: Node, number: usize) -> Node {
    let offset = corner_offset(number);
    debug_assert_eq!(corner(offset), number);
    std::array::from_fn(|k| node[k] + offset[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn slots_and_nodes_are_told_apart_across_blocks() {
        let mut blocks = Blocks::new([20, 9, 30]).unwrap();
        let mut slots = Vec::new();
        for node in [[21, 10, 31], [0, 0, 0], [7, 8, 15], [8, 7, 16]] {
            let slot = blocks.open(node).unwrap();
            assert_eq!((blocks.node(slot), blocks.slot(node)), (node, slot));
            slots.push(slot);
        }
        slots.sort_unstable_by_key(|&slot| blocks.rank(slot));
        let ordered: Vec<Node> = slots.iter().map(|&slot| blocks.node(slot)).collect();
        assert_eq!(ordered, [[0, 0, 0], [7, 8, 15], [8, 7, 16], [21, 10, 31]]);
        assert_eq!(blocks.slot([8, 8, 8]), ABSENT);
    }

    #[test]
    fn corners_are_numbered_as_in_the_table_of_cases() {
        let mut blocks = Blocks::new([14; 3]).unwrap();
        for cell in [[2, 3, 4], [7, 3, 7]] {
            let slot = blocks.open(cell).unwrap();
            blocks.open_corners(slot).unwrap();
            for (number, slot) in blocks.corners(slot).into_iter().enumerate() {
                let node = blocks.node(slot);
                assert_eq!(corner([0, 1, 2].map(|k| node[k] - cell[k])), number);
            }
        }
    }

    #[test]
    fn only_padding_is_known_from_the_start() {
        let mut blocks = Blocks::new([6; 3]).unwrap();
        blocks.open([0; 3]).unwrap();
        let unknown = (0..512).filter(|&slot| blocks.is_unknown(slot)).count();
        assert_eq!(unknown, 6 * 6 * 6);
        assert!(!blocks.is_padding([6; 3]) && blocks.is_padding([6, 7, 6]) && blocks.is_padding([1, 0, 1]));
    }

    #[test]
    fn a_line_counts_only_visited_cells() {
        let mut blocks = Blocks::new([30; 3]).unwrap();
        for x in 9..16 {
            let slot = blocks.open([x, 1, 1]).unwrap();
            blocks.set(slot, if x == 12 { 1.0 } else { -1.0 });
        }
        assert!(!blocks.crosses_oddly([1; 3], 0, 30));
        let seen = blocks.slot([12, 1, 1]);
        assert!(blocks.mark_visited(seen) && !blocks.mark_visited(seen) && blocks.is_visited(seen));
        assert!(blocks.crosses_oddly([1; 3], 0, 30));
        assert!(!blocks.crosses_oddly([1; 3], 0, 12) && blocks.crosses_oddly([12, 1, 1], 0, 13));
        assert!(blocks.mark_visited(seen - 1));
        assert!(!blocks.crosses_oddly([1; 3], 0, 30));
    }
}
