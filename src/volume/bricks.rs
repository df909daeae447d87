//! Part of a large grid: the bricks of one level of a [`SparseVolume`](super::SparseVolume) that are loaded.
//!
//! A missing brick is a question, never a value: reads of it are recorded, and whoever reads has to discard the result.

use super::error::{VolumeError, filled, reserve};
use super::grid::{CellCache, Padding, share_of_padded, share_of_values};
use super::sampling::{blend, locate};
use super::voxels::{VoxelNumber, Voxels, each, map_each};
use super::{Grid, Normalisation, Region};
use crate::math::Vec3;
use crate::math::order::sort_ranks;
use std::sync::{Mutex, PoisonError};

/// The number of voxels along each side of a brick. With 16 there are 1.5 times as many voxels around a surface, with 32
/// 2.4 times; with 8, a third of the reads between voxels cross from one brick to the next, which takes no longer in all.
pub const BRICK: usize = 8;

/// The number of bricks along each side of a page of the table, of which those without bricks take no memory.
const PAGE: usize = 16;

/// The largest number of voxels of a grid along an axis. Beyond it, single precision places a vertex no better than
/// within 1/128 of a voxel.
pub(super) const MAX_SIDE: usize = 1 << 16;

/// The largest number of pages of the tables of all levels of a volume.
pub(super) const MAX_PAGES: u64 = 25_000_000;

/// Returns the number of pages of the table of a grid.
pub(super) fn page_count(dims: [usize; 3]) -> u64 {
    dims.iter().fold(1, |product, n| product.saturating_mul(n.div_ceil(BRICK * PAGE) as u64))
}

/// Returns an error unless all dimensions of a grid are from 1 to [`MAX_SIDE`].
pub(super) fn check_sides(dims: [usize; 3]) -> Result<(), VolumeError> {
    if dims.iter().all(|n| (1..=MAX_SIDE).contains(n)) {
        return Ok(());
    }
    let problem = format!("must be from 1 to {MAX_SIDE} voxels along each axis, got {dims:?}");
    Err(VolumeError::invalid("dims", problem))
}

/// Returns an error if the number of voxels of a box does not fit into memory.
pub(super) fn check_size(region: Region) -> Result<(), VolumeError> {
    let count = region.dims.iter().fold(1u64, |product, &n| product.saturating_mul(n as u64));
    if count <= isize::MAX as u64 / size_of::<f64>() as u64 {
        return Ok(());
    }
    Err(VolumeError::TooLarge { bytes: count })
}

/// No brick, in the table.
const NONE: u32 = u32::MAX;

/// A page of the table: for each of its bricks, the index in the list of loaded ones, or [`NONE`].
type Page = Box<[u32; PAGE * PAGE * PAGE]>;

/// A scalar field of which only some bricks are known, cubes of [`BRICK`] voxels. Positions are continuous voxel
/// indices, voxel centres at integers.
#[derive(Debug, Default)]
pub struct BrickGrid {
    dims: [usize; 3],
    normalisation: Normalisation,
    /// The numbers of pages along the axes.
    pages: [usize; 3],
    table: Vec<Option<Page>>,
    loaded: Vec<Brick>,
    /// The bricks that were missing when they were read, since [`Self::take_missed`].
    missed: Mutex<Vec<u64>>,
}

/// A loaded brick. One at the border of the grid has as many voxels as all others.
#[derive(Clone, Debug)]
struct Brick {
    at: BrickId,
    voxels: Voxels,
}

/// The indices of a brick along the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickId(pub [usize; 3]);

impl Clone for BrickGrid {
    fn clone(&self) -> Self {
        Self {
            dims: self.dims,
            normalisation: self.normalisation,
            pages: self.pages,
            table: self.table.clone(),
            loaded: self.loaded.clone(),
            missed: Mutex::default(),
        }
    }
}

impl BrickId {
    /// Returns the brick with the voxel at an index.
    fn of_voxel(voxel: [usize; 3]) -> Self {
        Self(voxel.map(|k| k / BRICK))
    }

    /// Returns the number by which bricks are sorted, by z, then y, then x.
    pub fn rank(self) -> u64 {
        let [x, y, z] = self.0.map(|k| k as u64);
        x | y << 21 | z << 42
    }

    /// Returns the brick of a [`Self::rank`].
    pub fn ranked(rank: u64) -> Self {
        Self([0, 21, 42].map(|shift| (rank >> shift) as usize & ((1 << 21) - 1)))
    }
}

impl BrickGrid {
    /// Creates a grid of `dims` voxels without any brick.
    ///
    /// # Errors
    /// A dimension of 0 or above [`MAX_SIDE`]; [`VolumeError::TooLarge`].
    pub(super) fn new(dims: [usize; 3], normalisation: Normalisation) -> Result<Self, VolumeError> {
        let pages = dims.map(|n| n.div_ceil(BRICK * PAGE));
        check_sides(dims)?;
        let table = filled(page_count(dims) as usize, None)?;
        Ok(Self { dims, normalisation, pages, table, ..Self::default() })
    }

    /// Returns a grid like this one without any brick.
    pub fn emptied(&self) -> Self {
        let table = vec![None; self.table.len()];
        Self {
            dims: self.dims,
            normalisation: self.normalisation,
            pages: self.pages,
            table,
            ..Self::default()
        }
    }

    /// Returns the number of voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Returns the number of loaded bricks.
    pub fn len(&self) -> usize {
        self.loaded.len()
    }

    /// Returns the memory of the loaded bricks in bytes.
    pub fn bytes(&self) -> usize {
        let voxel =
            self.loaded.first().map_or(0, |brick| each!(&brick.voxels, values => size_of_val(&values[0])));
        self.loaded.len() * BRICK * BRICK * BRICK * voxel
    }

    /// Returns whether a brick is loaded.
    pub fn has(&self, brick: BrickId) -> bool {
        self.slot(brick) != NONE
    }

    /// Returns the voxels of the grid in a brick.
    pub fn region(&self, brick: BrickId) -> Region {
        let min = brick.0.map(|k| k * BRICK);
        Region { min, dims: [0, 1, 2].map(|axis| BRICK.min(self.dims[axis] - min[axis])) }
    }

    /// Calls `visit` with the ranks of the bricks that contain the box from `low` to `high`, in voxel indices, within
    /// the grid.
    pub fn for_each_around(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(u64)) {
        let [first, last] =
            [low, high].map(|p| BrickId::of_voxel([0, 1, 2].map(|axis| locate(p[axis], self.dims[axis]).0)));
        for z in first.0[2]..=last.0[2] {
            for y in first.0[1]..=last.0[1] {
                (first.0[0]..=last.0[0]).for_each(|x| visit(BrickId([x, y, z]).rank()));
            }
        }
    }

    /// Adds the bricks of a box of whole bricks, which ends at a brick or at the border of the grid; `data` are its
    /// voxels, x fastest. Loaded bricks are unchanged.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if the box is not of whole bricks or not within the grid, or `data` has another
    /// length; [`VolumeError::TooLarge`]; nothing has changed then.
    pub(super) fn insert(&mut self, region: Region, data: &Voxels) -> Result<(), VolumeError> {
        self.check_whole_bricks(region)?;
        check_size(region)?;
        if data.len() != region.len() {
            let problem =
                format!("must have {} voxels for dims {:?}, got {}", region.len(), region.dims, data.len());
            return Err(VolumeError::invalid("data", problem));
        }
        let mut new = Vec::new();
        let [first, end] = [region.min, [0, 1, 2].map(|axis| region.min[axis] + region.dims[axis] - 1)]
            .map(|voxel| BrickId::of_voxel(voxel).0);
        for z in first[2]..=end[2] {
            for y in first[1]..=end[1] {
                for at in (first[0]..=end[0]).map(|x| BrickId([x, y, z])).filter(|&at| !self.has(at)) {
                    new.push(Brick { at, voxels: self.brick_of(region, data, at)? });
                }
            }
        }
        new.into_iter().for_each(|brick| self.add(brick));
        Ok(())
    }

    fn check_whole_bricks(&self, region: Region) -> Result<(), VolumeError> {
        region.check("dims", self.dims)?;
        let is_whole = |axis: usize| {
            let end = region.min[axis] + region.dims[axis];
            region.min[axis].is_multiple_of(BRICK) && (end.is_multiple_of(BRICK) || end == self.dims[axis])
        };
        if (0..3).all(is_whole) {
            return Ok(());
        }
        let problem = format!(
            "must be a box of whole bricks of {BRICK} voxels, or end at the border, got {:?} voxels from {:?}",
            region.dims, region.min
        );
        Err(VolumeError::invalid("min", problem))
    }

    /// Returns the voxels of a brick in a box.
    fn brick_of(&self, region: Region, data: &Voxels, at: BrickId) -> Result<Voxels, VolumeError> {
        let part = self.region(at);
        let inner = Region { min: [0, 1, 2].map(|axis| part.min[axis] - region.min[axis]), ..part };
        Ok(map_each!(data, values => padded(values, inner, region.dims)?))
    }

    fn add(&mut self, brick: Brick) {
        let (page, entry) = self.location(brick.at);
        let slot = self.loaded.len() as u32;
        let page = self.table[page].get_or_insert_with(|| Box::new([NONE; PAGE * PAGE * PAGE]));
        page[entry] = slot;
        self.loaded.push(brick);
    }

    /// Drops all bricks but those for which `keeps` returns true.
    pub fn retain(&mut self, keeps: impl Fn(BrickId) -> bool) {
        let all = std::mem::take(&mut self.loaded);
        self.table.fill(None);
        all.into_iter().filter(|brick| keeps(brick.at)).for_each(|brick| self.add(brick));
    }

    /// Returns the page of a brick in the table, and its entry there.
    #[inline]
    fn location(&self, BrickId([x, y, z]): BrickId) -> (usize, usize) {
        let page = x / PAGE + self.pages[0] * (y / PAGE + self.pages[1] * (z / PAGE));
        (page, x % PAGE + PAGE * (y % PAGE + PAGE * (z % PAGE)))
    }

    #[inline]
    fn slot(&self, brick: BrickId) -> u32 {
        let (page, entry) = self.location(brick);
        self.table.get(page).and_then(Option::as_ref).map_or(NONE, |page| page[entry])
    }

    /// Returns the loaded brick with a voxel; if it is missing, that is recorded.
    #[inline]
    fn brick_with(&self, voxel: [usize; 3]) -> Option<&Brick> {
        let at = BrickId::of_voxel(voxel);
        let found = self.loaded.get(self.slot(at) as usize);
        if found.is_none() {
            self.miss(at);
        }
        found
    }

    #[cold]
    fn miss(&self, at: BrickId) {
        let mut missed = self.missed.lock().unwrap_or_else(PoisonError::into_inner);
        if missed.last() != Some(&at.rank()) {
            missed.push(at.rank());
        }
    }

    /// Returns the ranks of the bricks that were missing when they were read since the last call, in ascending order.
    pub fn take_missed(&self) -> Vec<u64> {
        let mut missed = std::mem::take(&mut *self.missed.lock().unwrap_or_else(PoisonError::into_inner));
        sort_ranks(&mut missed);
        missed.dedup();
        missed
    }

    /// Returns the trilinearly interpolated value at `p` as [`Grid::sample_padded`] does, with the same bits; background
    /// if a brick that it needs is missing, which is recorded.
    #[inline]
    pub fn sample_padded(&self, p: Vec3, padding: Padding, cache: &mut CellCache) -> f32 {
        self.sample_padded_by((self.dims, p), p, padding, cache)
    }

    /// As [`Self::sample_padded`], with padding as wide as parts of voxels; see [`Grid::sample_padded_by`].
    #[inline]
    pub(crate) fn sample_padded_by(
        &self,
        (dims, part): ([usize; 3], Vec3),
        p: Vec3,
        padding: Padding,
        cache: &mut CellCache,
    ) -> f32 {
        let share = share_of_values(dims, part);
        if share <= 0.0 && share_of_padded(dims, part) <= 0.0 {
            return padding.background;
        }
        let located = [0, 1, 2].map(|axis| locate(p[axis], self.dims[axis]));
        let voxel = located.map(|(index, _)| index);
        if !cache.is_at(voxel_key(voxel)) {
            match self.corners(voxel) {
                Some(corners) => *cache = CellCache::new(voxel_key(voxel), corners),
                None => return padding.background,
            }
        }
        let fraction = located.map(|(_, fraction)| fraction);
        if share < 1.0 {
            return padding.beyond(dims, part, share, cache.corners(), |values| blend(fraction, values));
        }
        padding.background + share * (blend(fraction, cache.corners()) - padding.background)
    }

    /// Returns the values of the cell whose lowest voxel is given, x fastest; `None` if one is missing.
    fn corners(&self, voxel: [usize; 3]) -> Option<[f32; 8]> {
        let next = [0, 1, 2].map(|axis| usize::from(voxel[axis] + 1 < self.dims[axis]));
        let local = voxel.map(|k| k % BRICK);
        if (0..3).all(|axis| local[axis] + next[axis] < BRICK) {
            let brick = self.brick_with(voxel)?;
            let base = index_in_brick(local);
            let step = [next[0], next[1] * BRICK, next[2] * BRICK * BRICK];
            let corners =
                CORNERS.map(|corner| base + corner[0] * step[0] + corner[1] * step[1] + corner[2] * step[2]);
            return Some(each!(&brick.voxels, values => {
                corners.map(|index| self.normalised(values[index]))
            }));
        }
        // All eight are read even if one is missing, so that all missing bricks are recorded.
        let values =
            CORNERS.map(|corner| self.value([0, 1, 2].map(|axis| voxel[axis] + corner[axis] * next[axis])));
        let mut corners = [0.0; 8];
        for (corner, value) in corners.iter_mut().zip(values) {
            *corner = value?;
        }
        Some(corners)
    }

    /// Returns the value of a voxel; `None` if it is missing.
    fn value(&self, voxel: [usize; 3]) -> Option<f32> {
        let brick = self.brick_with(voxel)?;
        let index = index_in_brick(voxel.map(|k| k % BRICK));
        Some(each!(&brick.voxels, values => self.normalised(values[index])))
    }

    #[inline]
    fn normalised<T: VoxelNumber>(&self, stored: T) -> f32 {
        self.normalisation.of(stored.into()) as f32
    }

    /// Returns the values of a region within the grid; `None` if some are missing.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn part(&self, region: Region) -> Result<Option<Grid>, VolumeError> {
        let mut values = reserve(region.len())?;
        let mut is_whole = true;
        let [width, height, depth] = region.dims;
        for (z, y) in (0..depth).flat_map(|z| (0..height).map(move |y| (z, y))) {
            let row = [region.min[0], region.min[1] + y, region.min[2] + z];
            is_whole &= self.append_row(row, width, &mut values);
        }
        Ok(is_whole.then_some(Grid { dims: region.dims, values }))
    }

    /// Appends the values of `count` voxels along x to `values`, brick by brick; returns whether all of them are there.
    fn append_row(&self, [first, y, z]: [usize; 3], count: usize, values: &mut Vec<f32>) -> bool {
        let (mut x, end, mut is_whole) = (first, first + count, true);
        while x < end {
            let in_brick = (BRICK - x % BRICK).min(end - x);
            let start = index_in_brick([x, y, z].map(|k| k % BRICK));
            match self.brick_with([x, y, z]) {
                Some(brick) => each!(&brick.voxels, stored => {
                    values.extend(stored[start..start + in_brick].iter().map(|&value| self.normalised(value)));
                }),
                None => is_whole = false,
            }
            x += in_brick;
        }
        is_whole
    }
}

/// The offsets of the eight voxels of a cell, x fastest.
const CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];

fn index_in_brick([x, y, z]: [usize; 3]) -> usize {
    x + BRICK * (y + BRICK * z)
}

/// Returns a number that no other voxel has, by which a cell is cached.
fn voxel_key([x, y, z]: [usize; 3]) -> u64 {
    x as u64 | (y as u64) << 21 | (z as u64) << 42
}

/// Returns the values of a region of a box of `dims` voxels as those of a brick, which has zeros after them.
fn padded<T: VoxelNumber>(values: &[T], region: Region, dims: [usize; 3]) -> Result<Vec<T>, VolumeError> {
    let mut brick = filled(BRICK * BRICK * BRICK, T::nearest(0.0))?;
    for (k, row) in region.rows(dims, 0).enumerate() {
        let [y, z] = [k % region.dims[1], k / region.dims[1]];
        let start = index_in_brick([0, y, z]);
        brick[start..start + row.len()].copy_from_slice(&values[row]);
    }
    Ok(brick)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PADDING: Padding = Padding { background: 0.25, iso: 0.4 };

    use crate::math::Random;
    use crate::volume::{Volume, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const DIMS: [usize; 3] = [37, 32, 19];
    /// The number of bricks along each axis.
    const BRICKS: [usize; 3] = [DIMS[0].div_ceil(BRICK), DIMS[1].div_ceil(BRICK), DIMS[2].div_ceil(BRICK)];

    /// Returns random voxels of all types.
    fn all_types(random: &mut Random) -> Vec<Voxels> {
        let stored: Vec<f64> = (0..DIMS.iter().product()).map(|_| 250.0 * random.unit() - 100.0).collect();
        let empty = [
            Voxels::U8(vec![]),
            Voxels::I8(vec![]),
            Voxels::U16(vec![]),
            Voxels::I16(vec![]),
            Voxels::U32(vec![]),
            Voxels::I32(vec![]),
            Voxels::F32(vec![]),
            Voxels::F64(vec![]),
        ];
        empty.iter().map(|empty| empty.like(&stored).unwrap()).collect()
    }

    /// Returns the grid of a volume and the bricks of it for which `is_loaded` is true.
    fn both(voxels: Voxels, is_loaded: impl Fn(BrickId) -> bool) -> (Grid, BrickGrid) {
        let volume = Volume::new(VolumeInit::new(voxels, [DIMS[0], DIMS[1], DIMS[2], 1])).unwrap();
        let normalisation = Normalisation::new([1.0, 0.0], volume.range());
        let mut bricks = BrickGrid::new(DIMS, normalisation).unwrap();
        for k in 0..BRICKS.iter().product() {
            let at = BrickId([k % BRICKS[0], k / BRICKS[0] % BRICKS[1], k / (BRICKS[0] * BRICKS[1])]);
            let region = bricks.region(at);
            if is_loaded(at) {
                let data = volume.voxels().gathered(region.len(), region.rows(DIMS, 0)).unwrap();
                bricks.insert(region, &data).unwrap();
            }
        }
        (volume.normalised_grid(0).unwrap(), bricks)
    }

    fn random_point(random: &mut Random) -> Vec3 {
        Vec3::from(DIMS.map(|n| ((n as f64 + 4.0) * random.unit() - 2.5) as f32))
    }

    #[test]
    fn samples_have_the_bits_of_a_grid() {
        let mut random = Random::new(1);
        for voxels in all_types(&mut random) {
            let (grid, bricks) = both(voxels, |_| true);
            let [mut cache, mut other] = [CellCache::default(); 2];
            for _ in 0..4000 {
                let p = random_point(&mut random);
                let nearby = p + Vec3::splat(0.01);
                for p in [p, nearby] {
                    let expected = grid.sample_padded(p, PADDING, &mut cache);
                    assert_eq!(
                        bricks.sample_padded(p, PADDING, &mut other).to_bits(),
                        expected.to_bits(),
                        "at {p}"
                    );
                }
            }
            assert!(bricks.take_missed().is_empty());
            let region = Region { min: [3, 10, 9], dims: [30, 12, 10] };
            assert_eq!(bricks.part(region).unwrap(), Some(grid.part(region).unwrap()));
        }
    }

    /// A sample is either that of the grid, or names a brick that is missing.
    #[test]
    fn missing_bricks_are_recorded_and_never_read() {
        let mut random = Random::new(2);
        let voxels = all_types(&mut random).swap_remove(2);
        let is_loaded = |at: BrickId| !(at.0[0] + at.0[1] + at.0[2]).is_multiple_of(2);
        let (grid, bricks) = both(voxels, is_loaded);
        let [mut found, mut missed] = [0, 0];
        let mut cache = CellCache::default();
        for _ in 0..4000 {
            let p = random_point(&mut random);
            let sample = bricks.sample_padded(p, PADDING, &mut cache);
            let absent = bricks.take_missed();
            if absent.is_empty() {
                found += 1;
                assert_eq!(
                    sample.to_bits(),
                    grid.sample_padded(p, PADDING, &mut CellCache::default()).to_bits()
                );
            } else {
                missed += 1;
                assert!(absent.iter().all(|&rank| !is_loaded(BrickId::ranked(rank))));
            }
        }
        assert!(found > 500 && missed > 500, "{found} and {missed}");
    }

    #[test]
    fn dropped_bricks_are_missing_until_they_are_inserted_again() {
        let mut random = Random::new(3);
        let (_, mut bricks) = both(all_types(&mut random).swap_remove(0), |_| true);
        let count = bricks.len();
        bricks.retain(|at| at.0[0] == 1);
        let layer = BRICKS[1] * BRICKS[2];
        assert_eq!((bricks.len(), bricks.bytes()), (layer, layer * BRICK * BRICK * BRICK));
        assert!(bricks.has(BrickId([1, 1, 1])) && !bricks.has(BrickId([0, 1, 1])));
        let region = Region { min: [0; 3], dims: DIMS };
        let again = Voxels::U8(vec![9; region.len()]);
        let inside = [BRICK + 4, 5, 5];
        let kept = bricks.value(inside);
        bricks.insert(region, &again).unwrap();
        assert_eq!(bricks.len(), count);
        assert_eq!(bricks.value(inside), kept, "a brick was replaced");
        assert_eq!(bricks.value([3, 5, 5]), Some(bricks.normalisation.of(9.0) as f32));
    }

    #[test]
    fn ranks_are_those_of_bricks_around_a_box() {
        let (_, bricks) = both(all_types(&mut Random::new(4)).swap_remove(0), |_| false);
        let mut found = Vec::new();
        let side = BRICK as f32;
        bricks.for_each_around(Vec3::new(-9.0, side - 0.5, 3.0), Vec3::new(side, side + 0.5, 99.0), |rank| {
            found.push(rank)
        });
        let columns = [[0, 0], [1, 0], [0, 1], [1, 1]];
        let expected: Vec<_> = (0..BRICKS[2]).flat_map(|z| columns.map(|[x, y]| [x, y, z])).collect();
        assert_eq!(found, expected.iter().map(|&at| BrickId(at).rank()).collect::<Vec<_>>());
        assert_eq!(found.iter().map(|&rank| BrickId::ranked(rank).0).collect::<Vec<_>>(), expected);
    }
}
