//! Volumes that are larger than memory: the levels of a pyramid, of each of which some bricks are loaded.

use super::bricks::{BRICK, BrickGrid, BrickId, MAX_PAGES, check_sides, check_size, page_count};
use super::error::VolumeError;
use super::voxels::Voxels;
use super::{Grid, Normalisation, Region, check_corners, invert, span};
use crate::math::DAffine3;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The largest number of levels.
const MAX_LEVELS: usize = 32;

/// The largest number of bricks of a level whose missing ones are listed.
const MAX_LISTED: u64 = 1 << 24;

/// The largest number of voxels of the coarsest level, which is loaded whole.
const MAX_COARSEST: usize = 1 << 28;

/// One level of the pyramid of a [`SparseVolume`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseLevel {
    /// Number of voxels along x, y and z.
    pub dims: [usize; 3],
    /// Map from the voxel indices of this level to world coordinates.
    pub affine: DAffine3,
}

/// Arguments of [`SparseVolume::new`].
#[derive(Clone, Debug, PartialEq)]
pub struct SparseInit {
    /// The levels, finest first. Their axes are parallel; factors between their voxel sizes are arbitrary.
    pub levels: Vec<SparseLevel>,
    /// The range of intensities that is scaled to [0, 1]; values beyond it count as its ends.
    pub range: [f64; 2],
    /// One voxel, of the type of all voxels: the value of bricks that the file leaves out.
    pub fill: Voxels,
}

/// A box of whole bricks of one level, as far as they lie within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickBox {
    /// Index of the level, 0 for the finest.
    pub level: usize,
    /// The voxels of the box.
    pub region: Region,
}

/// A multiscale volume of which only parts are in memory: the coarsest level, and bricks of 8³ voxels of the others. A
/// missing brick has no value. Cheap to clone: clones share their bricks.
#[derive(Clone, Debug)]
pub struct SparseVolume {
    levels: Arc<[SparseLevel]>,
    fill: Arc<Voxels>,
    range: [f64; 2],
    bricks: Arc<Mutex<Vec<BrickGrid>>>,
}

impl SparseVolume {
    /// Creates a volume without any brick, after validating all fields of `init`.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if there is no level, or more than 32; a level has a dimension of 0 or above
    /// 65536, or more voxels than the next finer one along an axis, or a map that is not finite, not invertible, or not
    /// parallel to that of the finest level; the levels have more than 25 million blocks of 128³ voxels; the coarsest level has
    /// more than 2²⁸ voxels; the range is not finite or not ascending; `fill` is not one voxel.
    pub fn new(init: SparseInit) -> Result<Self, VolumeError> {
        check_levels(&init.levels)?;
        let [low, high] = init.range;
        let largest = f64::from(f32::MAX);
        if !(low.abs() <= largest && high.abs() <= largest && low <= high) {
            let problem = format!("must be two finite numbers in ascending order, got {low} and {high}");
            return Err(VolumeError::invalid("range", problem));
        }
        if init.fill.len() != 1 {
            return Err(VolumeError::invalid("fill", format!("must be one voxel, got {}", init.fill.len())));
        }
        init.levels.iter().try_for_each(|level| check_sides(level.dims))?;
        let pages = init.levels.iter().map(|level| page_count(level.dims));
        if pages.fold(0u64, u64::saturating_add) > MAX_PAGES {
            let problem = format!("must have at most {MAX_PAGES} blocks of 128³ voxels in all");
            return Err(VolumeError::invalid("levels", problem));
        }
        let normalisation = Normalisation::new([1.0, 0.0], init.range);
        let bricks = init.levels.iter().map(|level| BrickGrid::new(level.dims, normalisation));
        Ok(Self {
            bricks: Arc::new(Mutex::new(bricks.collect::<Result<_, _>>()?)),
            levels: init.levels.into(),
            fill: Arc::new(init.fill),
            range: init.range,
        })
    }

    /// Returns the levels, finest first.
    pub fn levels(&self) -> &[SparseLevel] {
        &self.levels
    }

    /// Returns the range of intensities that is scaled to [0, 1].
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the length of the range, or 1 if its ends are equal.
    pub(crate) fn span(&self) -> f64 {
        span(self.range)
    }

    /// Adds the voxels of a box of whole bricks, which ends at a brick or at the border of the level, x fastest. Loaded
    /// bricks are unchanged.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if there is no such level, the box is not of whole bricks or not within the
    /// level, or `data` has another type or length; [`VolumeError::TooLarge`]; nothing has changed then.
    pub fn insert(&self, at: BrickBox, data: &Voxels) -> Result<(), VolumeError> {
        self.check_level(at.level)?;
        let (mine, given) = (self.fill.type_name(), data.type_name());
        if mine != given {
            return Err(VolumeError::invalid("data", format!("must be {mine}, got {given}")));
        }
        self.bricks()[at.level].insert(at.region, data)
    }

    /// Adds bricks that the file leaves out, whose voxels all have the value `fill`.
    ///
    /// # Errors
    /// As [`Self::insert`].
    pub fn insert_fill(&self, at: BrickBox) -> Result<(), VolumeError> {
        self.check_level(at.level)?;
        at.region.check("dims", self.levels[at.level].dims)?;
        check_size(at.region)?;
        let data = self.fill.gathered(at.region.len(), std::iter::repeat_n(0..1, at.region.len()))?;
        self.insert(at, &data)
    }

    /// Returns the number of loaded bricks and of their bytes, by level.
    pub fn loaded(&self) -> Vec<[usize; 2]> {
        self.bricks().iter().map(|level| [level.len(), level.bytes()]).collect()
    }

    /// Returns the bricks of a level that are not loaded, merged along x.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if there is no such level; [`VolumeError::TooLarge`] if it has more than 2²⁴
    /// bricks.
    pub fn missing(&self, level: usize) -> Result<Vec<BrickBox>, VolumeError> {
        self.check_level(level)?;
        let bricks = self.bricks();
        let dims = bricks[level].dims();
        let count = dims.iter().fold(1u64, |product, n| product.saturating_mul(n.div_ceil(BRICK) as u64));
        if count > MAX_LISTED {
            return Err(VolumeError::TooLarge { bytes: count.saturating_mul(size_of::<BrickBox>() as u64) });
        }
        let missing = all_bricks(dims).filter(|&at| !bricks[level].has(at)).map(BrickId::rank);
        Ok(merged(&bricks[level], level, &missing.collect::<Vec<u64>>()))
    }

    /// Returns a level that is loaded whole, scaled to [0, 1]; `None` if a brick is missing.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn whole(&self, level: usize) -> Result<Option<Grid>, VolumeError> {
        let bricks = self.bricks();
        if !all_bricks(bricks[level].dims()).all(|at| bricks[level].has(at)) {
            return Ok(None);
        }
        let grid = bricks[level].part(Region { min: [0; 3], dims: self.levels[level].dims })?;
        Ok(grid)
    }

    /// Locks the bricks of all levels. A model exchanges them with its own while it computes, and reads them without
    /// locking. Others wait, or, between slices of a step, use those that were the model's: whatever they are, a missing brick is
    /// asked for.
    pub(crate) fn bricks(&self) -> MutexGuard<'_, Vec<BrickGrid>> {
        // No code that holds the lock leaves bricks in part.
        self.bricks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn check_level(&self, level: usize) -> Result<(), VolumeError> {
        if level < self.levels.len() {
            return Ok(());
        }
        let problem = format!("must be below {}, got {level}", self.levels.len());
        Err(VolumeError::invalid("level", problem))
    }
}

/// Returns all bricks of a level of `dims` voxels, in the order of their ranks.
fn all_bricks(dims: [usize; 3]) -> impl Iterator<Item = BrickId> {
    let [nx, ny, nz] = dims.map(|n| n.div_ceil(BRICK));
    let rows = (0..nz).flat_map(move |z| (0..ny).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| (0..nx).map(move |x| BrickId([x, y, z])))
}

/// Returns the boxes of bricks given by ascending ranks, those next to each other along x merged.
pub(crate) fn merged(grid: &BrickGrid, level: usize, ranks: &[u64]) -> Vec<BrickBox> {
    let mut boxes: Vec<BrickBox> = Vec::new();
    for (k, &rank) in ranks.iter().enumerate() {
        let region = grid.region(BrickId::ranked(rank));
        match boxes.last_mut() {
            Some(last) if ranks[k - 1] + 1 == rank => last.region.dims[0] += region.dims[0],
            _ => boxes.push(BrickBox { level, region }),
        }
    }
    boxes
}

fn check_levels(levels: &[SparseLevel]) -> Result<(), VolumeError> {
    let (Some(first), Some(last)) = (levels.first(), levels.last()) else {
        return Err(VolumeError::invalid("levels", "must have at least one level"));
    };
    if levels.len() > MAX_LEVELS {
        return Err(VolumeError::invalid(
            "levels",
            format!("must be at most {MAX_LEVELS}, got {}", levels.len()),
        ));
    }
    let to_finest = invert(first.affine)?;
    let mut finer = first;
    for level in levels {
        let [nx, ny, nz] = level.dims;
        invert(level.affine)?;
        check_corners(level.affine, [nx, ny, nz, 1])?;
        check_parallel(to_finest * level.affine)?;
        if (0..3).any(|axis| level.dims[axis] > finer.dims[axis]) {
            let problem = format!("must be finest first: {:?} voxels after {:?}", level.dims, finer.dims);
            return Err(VolumeError::invalid("levels", problem));
        }
        finer = level;
    }
    let count = last.dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
    if count.is_none_or(|count| count > MAX_COARSEST) {
        let problem = format!("the coarsest must have at most {MAX_COARSEST} voxels, got {:?}", last.dims);
        return Err(VolumeError::invalid("levels", problem));
    }
    Ok(())
}

/// Returns an error unless a map between the voxel indices of two levels only scales and translates.
fn check_parallel(map: DAffine3) -> Result<(), VolumeError> {
    let axes = map.matrix3.to_cols_array_2d();
    let is_scale = (0..3)
        .all(|k| axes[k][k] > 0.0 && (0..3).all(|j| j == k || axes[k][j].abs() <= MAX_SHEAR * axes[k][k]));
    if is_scale {
        Ok(())
    } else {
        Err(VolumeError::invalid("affine", "must be parallel to that of the finest level"))
    }
}

/// The largest ratio, of the entries beside the diagonal to those on it, of a map that counts as one that only scales:
/// errors of rounding are smaller.
const MAX_SHEAR: f64 = 1e-6;
