//! The cells through which surfaces pass, in a sparse table: in blocks, which are allocated where there are any.
//!
//! A cell is a cube between the centres of eight voxels; cell (x, y, z) lies between the voxels (x − 1, y − 1, z − 1)
//! and (x, y, z). It is stored if its corners have different labels.

use super::cube_loops::{cube_loops, face};
use super::label_grid::{BACKGROUND, LabelGrid};
use crate::math::Vec3;
use crate::volume::VolumeError;
use crate::volume::cube_cases::{EDGES, corner};

/// Number of cells along each side of a block.
pub const BLOCK_SIDE: u32 = 8;
const PER_BLOCK: usize = (BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE) as usize;
const NONE: u32 = u32::MAX;
/// Least distance along an edge between the vertices of the labels at its ends, as a share of the gap between labels
/// twice over.
const LEAST_GAP: f32 = 0.1;

/// A cell through which surfaces pass.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Index of the cell along x, y and z.
    pub at: [u32; 3],
    /// Numbers of the labels at the corners, numbered as in marching cubes. All equal in a free slot.
    pub corners: [u16; 8],
    /// Position of the cell's vertices, relative to the centre of the cell, in voxels.
    pub offset: Vec3,
    /// Number of surfaces that pass through the cell, if each does so once and they are one or two, else 0.
    pub simple: u8,
    /// Whether no label has more than one vertex in the cell.
    pub is_single: bool,
    /// Whether two labels meet in the cell like in a saddle: at some edge between them, their vertices do not move apart
    /// along the edge, since they do so the other way at another edge.
    pub is_saddle: bool,
    /// Whether a label, not the background, has two diagonally opposite corners of a face, and no other of that face.
    pub has_diagonal: bool,
}

impl Cell {
    /// Creates a cell with its vertices in the middle.
    pub fn new(at: [u32; 3], corners: [u16; 8]) -> Self {
        let mut cell = Self {
            at,
            corners,
            offset: Vec3::ZERO,
            simple: 0,
            is_single: true,
            is_saddle: false,
            has_diagonal: false,
        };
        cell.set_corners(corners);
        cell
    }

    fn set_corners(&mut self, corners: [u16; 8]) {
        self.corners = corners;
        let counts = self.numbers().map(|number| self.vertices_of(number));
        let (surfaces, most) = counts.fold((0, 0), |(surfaces, most), count| (surfaces + 1, count.max(most)));
        self.simple = if surfaces <= 2 && most == 1 { surfaces } else { 0 };
        self.is_single = most <= 1;
        self.is_saddle = surfaces >= 2 && self.has_edge_without_gap();
        self.has_diagonal =
            (0..3).any(|axis| [false, true].iter().any(|&far| self.has_diagonal_on(axis, far)));
    }

    fn has_diagonal_on(&self, axis: usize, far: bool) -> bool {
        let [a, b, c, d] = face(axis, far).map(|corner| self.corners[corner]);
        let is_one_label = a == c && a != BACKGROUND || b == d && b != BACKGROUND;
        is_one_label && a != b && b != c && c != d && d != a
    }

    fn has_edge_without_gap(&self) -> bool {
        EDGES.iter().enumerate().any(|(edge, &(axis, offset))| {
            let mut far = offset;
            far[axis] += 1;
            let [low, high] = [offset, far].map(|at| self.corners[corner(at)]);
            let clear = |number: u16| {
                let loops = &cube_loops()[self.case(number)];
                loops.clear[usize::from(loops.of_edge[edge])][axis]
            };
            low != high && low != BACKGROUND && high != BACKGROUND && clear(high) - clear(low) < LEAST_GAP
        })
    }

    /// Returns the numbers of the different labels at the corners, but for the background, in the order of the corners.
    pub fn numbers(&self) -> impl Iterator<Item = u16> + '_ {
        let corners = &self.corners;
        let is_new = |&i: &usize| corners[i] != BACKGROUND && !corners[..i].contains(&corners[i]);
        (0..8).filter(is_new).map(|i| corners[i])
    }

    /// Returns the number of vertices of the label `number` in the cell.
    pub fn vertices_of(&self, number: u16) -> usize {
        cube_loops()[self.case(number)].count.into()
    }

    /// Returns the corners that have the label `number`, as bits.
    #[inline]
    pub fn case(&self, number: u16) -> usize {
        (0..8).fold(0, |case, corner| case | usize::from(self.corners[corner] == number) << corner)
    }

    /// Returns whether surfaces pass through the cell.
    #[inline]
    pub fn is_live(&self) -> bool {
        self.corners.iter().any(|&number| number != self.corners[0])
    }
}

/// A box of cells: from `low` to `high`, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellBox {
    /// The first cell along x, y and z.
    pub low: [u32; 3],
    /// The last cell along x, y and z.
    pub high: [u32; 3],
}

impl CellBox {
    /// Returns the box with `by` more cells on each side, within a volume of `dims` voxels.
    pub fn grown(&self, by: u32, dims: [usize; 3]) -> Self {
        let mut grown = *self;
        grown.low.iter_mut().for_each(|low| *low = low.saturating_sub(by));
        for (high, size) in grown.high.iter_mut().zip(dims) {
            *high = (*high + by).min(size as u32);
        }
        grown
    }

    /// Returns the smallest box that contains both.
    pub fn union(&self, other: &Self) -> Self {
        let mut union = *self;
        for axis in 0..3 {
            union.low[axis] = union.low[axis].min(other.low[axis]);
            union.high[axis] = union.high[axis].max(other.high[axis]);
        }
        union
    }

    /// Returns the rows of the box along x, in the order of z and y.
    pub fn rows(&self) -> impl Iterator<Item = Self> + use<> {
        let Self { low, high } = *self;
        let row = move |y, z| Self { low: [low[0], y, z], high: [high[0], y, z] };
        (low[2]..=high[2]).flat_map(move |z| (low[1]..=high[1]).map(move |y| row(y, z)))
    }

    /// Returns whether the box contains a cell.
    pub fn contains(&self, at: [u32; 3]) -> bool {
        (0..3).all(|axis| self.low[axis] <= at[axis] && at[axis] <= self.high[axis])
    }
}

/// A row of cells along x, as the four rows of voxels around it.
struct RowOfCells<'a>([&'a [u16]; 4]);

impl<'a> RowOfCells<'a> {
    fn new(grid: &'a LabelGrid, row: &CellBox) -> Self {
        let width = grid.dims()[0] + 2;
        let layer = width * (grid.dims()[1] + 2);
        let [first, y, z] = row.low.map(|n| n as usize);
        let (start, size) = (first + width * y + layer * z, row.high[0] as usize - first + 2);
        Self([0, width, layer, width + layer].map(|offset| &grid.numbers()[start + offset..][..size]))
    }

    /// Returns whether all voxels have one label: most rows of most label maps have nothing in them.
    fn is_uniform(&self) -> bool {
        let Self(rows) = self;
        rows.iter().all(|row| row.iter().all(|&number| number == rows[0][0]))
    }

    /// Returns, for each cell, whether its corners have different labels.
    fn crossed(&self) -> impl Iterator<Item = bool> + '_ {
        let Self([a, b, c, d]) = *self;
        let is_uniform = move |i: usize| a[i] == b[i] && a[i] == c[i] && a[i] == d[i];
        let mut before = is_uniform(0);
        (1..a.len()).map(move |i| {
            let here = is_uniform(i);
            let last = std::mem::replace(&mut before, here);
            !(here && last && a[i] == a[i - 1])
        })
    }
}

/// Returns the number of cells of a box that surfaces of `grid` pass through.
pub fn count_cells(grid: &LabelGrid, area: &CellBox) -> usize {
    let rows = area.rows().map(|row| RowOfCells::new(grid, &row));
    rows.filter(|row| !row.is_uniform())
        .map(|row| row.crossed().filter(|&is_crossed| is_crossed).count())
        .sum()
}

/// All cells through which surfaces pass, each in a slot that it keeps as long as it is stored.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Number of blocks along each axis.
    blocks: [u32; 3],
    /// Index into `slots` of each block; [`NONE`] if it has not been allocated.
    table: Vec<u32>,
    /// Slot of each cell of an allocated block; [`NONE`] for cells that are not stored.
    slots: Vec<[u32; PER_BLOCK]>,
    list: Vec<Cell>,
    /// Slots of the neighbours of each cell along −x, −y and −z; [`NONE`] for those that are not stored.
    before: Vec<[u32; 3]>,
    free: Vec<u32>,
}

impl Cells {
    /// Creates an empty table for a volume of `dims` voxels.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn new(dims: [usize; 3]) -> Result<Self, VolumeError> {
        let blocks = dims.map(|n| n as u32 / BLOCK_SIDE + 1);
        let size = blocks.iter().map(|&n| n as usize).product();
        let mut table = Vec::new();
        table.try_reserve_exact(size).map_err(|_| VolumeError::TooLarge { bytes: 4 * size as u64 })?;
        table.resize(size, NONE);
        Ok(Self { blocks, table, slots: Vec::new(), list: Vec::new(), before: Vec::new(), free: Vec::new() })
    }

    /// Creates the table of cells that are in given slots; `None` if two are the same, or the free slots are not those in
    /// `free`.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn restored(dims: [usize; 3], list: Vec<Cell>, free: Vec<u32>) -> Result<Option<Self>, VolumeError> {
        let mut cells = Self::new(dims)?;
        for cell in list.iter().filter(|cell| cell.is_live()) {
            if cells.find(cell.at).is_some() {
                return Ok(None);
            }
            cells.store(cell.at, cell.corners)?;
        }
        let mut is_free: Vec<bool> = list.iter().map(|cell| !cell.is_live()).collect();
        for &slot in &free {
            match is_free.get_mut(slot as usize) {
                Some(expected) if *expected => *expected = false,
                _ => return Ok(None),
            }
        }
        if is_free.contains(&true) {
            return Ok(None);
        }
        for (slot, cell) in (0..).zip(&list).filter(|(_, cell)| cell.is_live()) {
            if let Some((block, index)) = cells.place(cell.at) {
                cells.slots[cells.table[block] as usize][index] = slot;
            }
        }
        cells.before.clear();
        cells
            .before
            .try_reserve_exact(list.len())
            .map_err(|_| VolumeError::TooLarge { bytes: 12 * list.len() as u64 })?;
        cells.before.resize(list.len(), [NONE; 3]);
        (cells.list, cells.free) = (list, free);
        for slot in 0..cells.list.len() as u32 {
            if cells.get(slot).is_live() {
                cells.link(slot);
            }
        }
        Ok(Some(cells))
    }

    /// Returns all slots, including free ones.
    pub fn slots(&self) -> &[Cell] {
        &self.list
    }

    /// Returns the free slots, the one that is used next last.
    pub fn free(&self) -> &[u32] {
        &self.free
    }

    /// Returns the cell in a slot, which may be free.
    #[inline]
    pub fn get(&self, slot: u32) -> &Cell {
        &self.list[slot as usize]
    }

    /// Returns the position of the vertices of the cell in a slot, relative to its centre, to change it.
    #[inline]
    pub fn offset_mut(&mut self, slot: u32) -> &mut Vec3 {
        &mut self.list[slot as usize].offset
    }

    /// Returns the slot of a cell, if it is stored.
    #[inline]
    pub fn find(&self, at: [u32; 3]) -> Option<u32> {
        let (block, index) = self.place(at)?;
        let slot = self.slots.get(self.table[block] as usize)?[index];
        (slot != NONE).then_some(slot)
    }

    /// Returns the slots of the cells around the edge that begins at the first corner of the cell in a slot, along an axis:
    /// before it along both other axes, after it along the first, along both, and along the second of these; `None` unless
    /// all are stored.
    #[inline]
    pub fn around(&self, slot: u32, axis: usize) -> Option<[u32; 4]> {
        let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
        let before = self.before[slot as usize];
        let [first, second, fourth] =
            [self.before.get(before[next] as usize)?[last], before[last], before[next]];
        (first != NONE && second != NONE).then_some([first, second, slot, fourth])
    }

    /// Returns the slots of the neighbours of the cell in a slot along −x, −y and −z; [`u32::MAX`] for those that are not
    /// stored.
    #[inline]
    pub fn before(&self, slot: u32) -> [u32; 3] {
        self.before[slot as usize]
    }

    /// Links a stored cell with its neighbours.
    fn link(&mut self, slot: u32) {
        let at = self.get(slot).at;
        for axis in 0..3 {
            let [mut before, mut after] = [at; 2];
            before[axis] = before[axis].wrapping_sub(1);
            after[axis] += 1;
            self.before[slot as usize][axis] = self.find(before).unwrap_or(NONE);
            if let Some(after) = self.find(after) {
                self.before[after as usize][axis] = slot;
            }
        }
    }

    /// Returns the slots of the cells of a box, in the order of z, y and x.
    pub fn within(&self, area: &CellBox) -> Vec<u32> {
        let mut found = Vec::new();
        for z in area.low[2]..=area.high[2] {
            for y in area.low[1]..=area.high[1] {
                let mut x = area.low[0];
                while x <= area.high[0] {
                    let end = (x / BLOCK_SIDE * BLOCK_SIDE + BLOCK_SIDE - 1).min(area.high[0]);
                    if let Some((block, index)) = self.place([x, y, z])
                        && let Some(slots) = self.slots.get(self.table[block] as usize)
                    {
                        let row = &slots[index..=index + (end - x) as usize];
                        found.extend(row.iter().copied().filter(|&slot| slot != NONE));
                    }
                    x = end + 1;
                }
            }
        }
        found
    }

    /// Returns the index of a block, if it is allocated, from its index along x, y and z.
    pub fn block(&self, at: [u32; 3]) -> Option<usize> {
        let index = self.table[self.table_index(at)?];
        (index != NONE).then_some(index as usize)
    }

    /// Returns the allocated blocks that have cells of a box: the index of each, and that along x, y and z.
    pub fn blocks_within(&self, area: &CellBox) -> Vec<(usize, [u32; 3])> {
        let ranges = [0, 1, 2].map(|axis| area.low[axis] / BLOCK_SIDE..=area.high[axis] / BLOCK_SIDE);
        let [xs, ys, zs] = &ranges;
        let all = zs.clone().flat_map(|z| ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z])));
        all.filter_map(|at| Some((self.block(at)?, at))).collect()
    }

    /// Returns the slots of the cells of a block, x fastest, with `None` for those that are not stored.
    pub fn in_block(&self, block: usize) -> impl Iterator<Item = Option<u32>> + '_ {
        self.slots[block].iter().map(|&slot| (slot != NONE).then_some(slot))
    }

    /// Reserves memory for a number of cells.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn reserve(&mut self, cells: usize) -> Result<(), VolumeError> {
        let bytes = (cells * (size_of::<Cell>() + size_of::<[u32; 3]>())) as u64;
        self.list.try_reserve_exact(cells).map_err(|_| VolumeError::TooLarge { bytes })?;
        self.before.try_reserve_exact(cells).map_err(|_| VolumeError::TooLarge { bytes })
    }

    /// Stores, changes or frees the cells of a box so that they are those through which the surfaces of `grid` pass; sets
    /// the flag in `changed` of each label, by number, that is in a cell that has changed, or was.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn update(
        &mut self,
        grid: &LabelGrid,
        area: CellBox,
        changed: &mut [bool],
    ) -> Result<(), VolumeError> {
        for row in area.rows() {
            let around = RowOfCells::new(grid, &row);
            if !around.is_uniform() || !self.within(&row).is_empty() {
                self.update_row(grid, row.low, &around, changed)?;
            }
        }
        Ok(())
    }

    /// Updates a row of cells from `at` on, between the voxels `around` it.
    fn update_row(
        &mut self,
        grid: &LabelGrid,
        at: [u32; 3],
        around: &RowOfCells<'_>,
        changed: &mut [bool],
    ) -> Result<(), VolumeError> {
        for (x, is_crossed) in (at[0]..).zip(around.crossed()) {
            let cell = [x, at[1], at[2]];
            let known = self.find(cell);
            let corners = if is_crossed { grid.corners(cell) } else { [BACKGROUND; 8] };
            let before = known.map_or([BACKGROUND; 8], |slot| self.get(slot).corners);
            if corners != before {
                before.iter().chain(&corners).for_each(|&number| changed[usize::from(number)] = true);
            }
            if is_crossed {
                self.store(cell, corners)?;
            } else if let Some(slot) = known {
                self.remove(cell, slot);
            }
        }
        Ok(())
    }

    fn store(&mut self, at: [u32; 3], corners: [u16; 8]) -> Result<(), VolumeError> {
        let Some((block, index)) = self.place(at) else { return Ok(()) };
        if self.table[block] == NONE {
            self.table[block] = self.slots.len() as u32;
            grow(&mut self.slots)?;
            self.slots.push([NONE; PER_BLOCK]);
        }
        let slot = &mut self.slots[self.table[block] as usize][index];
        if *slot != NONE {
            self.list[*slot as usize].set_corners(corners);
            return Ok(());
        }
        let cell = Cell::new(at, corners);
        if let Some(free) = self.free.pop() {
            (*slot, self.list[free as usize]) = (free, cell);
            self.link(free);
            return Ok(());
        }
        grow(&mut self.list)?;
        grow(&mut self.before)?;
        let fresh = self.list.len() as u32;
        *slot = fresh;
        self.list.push(cell);
        self.before.push([NONE; 3]);
        self.link(fresh);
        Ok(())
    }

    fn remove(&mut self, at: [u32; 3], slot: u32) {
        let Some((block, index)) = self.place(at) else { return };
        self.slots[self.table[block] as usize][index] = NONE;
        self.list[slot as usize].corners = [0; 8];
        self.free.push(slot);
        for axis in 0..3 {
            let mut after = at;
            after[axis] += 1;
            if let Some(after) = self.find(after) {
                self.before[after as usize][axis] = NONE;
            }
        }
    }

    /// Returns the block of a cell, as an index into `table`, and the cell's index in it.
    #[inline]
    fn place(&self, at: [u32; 3]) -> Option<(usize, usize)> {
        let block = self.table_index(at.map(|n| n / BLOCK_SIDE))?;
        let [x, y, z] = at.map(|n| (n % BLOCK_SIDE) as usize);
        let side = BLOCK_SIDE as usize;
        Some((block, x + side * (y + side * z)))
    }

    /// Returns the index into `table` of a block, from that along x, y and z; `None` outside of the volume.
    #[inline]
    fn table_index(&self, block: [u32; 3]) -> Option<usize> {
        if (0..3).any(|axis| block[axis] >= self.blocks[axis]) {
            return None;
        }
        let [nx, ny, _] = self.blocks.map(|n| n as usize);
        Some(block[0] as usize + nx * (block[1] as usize + ny * block[2] as usize))
    }
}

fn grow<T>(list: &mut Vec<T>) -> Result<(), VolumeError> {
    if list.len() < list.capacity() {
        return Ok(());
    }
    let more = list.len() / 2 + 64;
    let bytes = ((list.len() + more) * size_of::<T>()) as u64;
    list.try_reserve_exact(more).map_err(|_| VolumeError::TooLarge { bytes })
}
