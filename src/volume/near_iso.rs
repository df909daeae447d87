//! Intensities near an iso value: how finely single precision shows them, and what voxels without a finite value count as.
//!
//! Neither the outside of a volume nor NaN is ever part of an object, whatever the iso value. An infinite voxel is
//! on its side of every iso value. A surface ends halfway between a voxel of the object and one that is outside or NaN.

use super::error::VolumeError;
use super::voxels::Voxels;
use super::{Grid, Normalisation, Region, Volume};
use crate::math::order::{rank_f64, sort_by_rank};
use fixedbitset::FixedBitSet;
use std::ops::Range;

/// The least difference between neighbouring voxels on opposite sides of an iso value, as a share of the largest number
/// that is rounded to `f32`, at which rounding does not matter: a surface is then off by 1/256 of a voxel at most. With
/// more, intensities that `f32` shows well are shifted, and the last bits of surfaces change; with less, surfaces have
/// steps.
const RESOLVED: f64 = 1.0 / 65536.0;

/// The width of the window of intensities around an iso value, in differences between neighbouring voxels across it. If
/// it were narrower, the surface beside voxels that are clamped would be off by more than 1/512 of a voxel; if it were
/// wider, the image would be fainter.
const WINDOW: f64 = 1024.0;

/// The share of the differences across an iso value that are smaller than the one that stands for all: most may be those
/// to voxels with a fill value, which are much larger than those within the image.
const LOW_SHARE: f64 = 0.1;

/// The number of voxels that are read first to measure the differences across an iso value.
const FIRST_READ: usize = 1 << 18;

/// The number of differences among those voxels that is enough; if there are fewer, all voxels are read.
const ENOUGH: usize = 64;

/// The largest number of differences that is collected.
const MOST: usize = 1 << 21;

/// The largest absolute difference from an iso value that is kept: differences of two such numbers are finite.
const LARGEST: f64 = f32::MAX as f64 / 4.0;

/// The voxels of a grid that are not finite numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NotFinite {
    nan: FixedBitSet,
    /// The voxels that are +∞.
    high: FixedBitSet,
    /// The voxels that are −∞.
    low: FixedBitSet,
}

impl NotFinite {
    /// Returns the voxels of `values` that are not finite; `None` if all are.
    fn of(voxels: &Voxels, indices: Range<usize>) -> Option<Self> {
        let mut is_finite = true;
        voxels.for_each_part(indices.clone(), |part| is_finite &= part.iter().all(|value| value.is_finite()));
        if is_finite {
            return None;
        }
        let [mut nan, mut high, mut low] = [(); 3].map(|()| FixedBitSet::with_capacity(indices.len()));
        let mut k = 0;
        voxels.for_each_part(indices, |part| {
            for &value in part {
                nan.set(k, value.is_nan());
                high.set(k, value == f64::INFINITY);
                low.set(k, value == f64::NEG_INFINITY);
                k += 1;
            }
        });
        Some(Self { nan, high, low })
    }

    /// Gives the voxels of `grid` that are not finite a finite value: NaN outside of the object, which is above `iso` if
    /// `is_above`, and infinite ones on their side of `iso`. It is as far from `iso` as the mean of those of the six
    /// neighbours that are on the other side, so that the surface is about halfway; if there are none, it is the value
    /// in `far` for its side, below or above `iso`.
    pub(crate) fn replace(&self, grid: &mut Grid, iso: f32, is_above: bool, far: [f32; 2]) {
        let mut found = Vec::new();
        for (voxels, becomes_high) in [(&self.low, false), (&self.high, true), (&self.nan, !is_above)] {
            let is_opposite = |value: f32| {
                if is_above { (value < iso) == becomes_high } else { (value > iso) != becomes_high }
            };
            for voxel in voxels.ones() {
                let (mut sum, mut count) = (0.0f64, 0u32);
                for other in face_neighbours(grid.dims, voxel).filter(|&other| !self.contains(other)) {
                    let value = grid.values[other];
                    if is_opposite(value) {
                        sum += f64::from((value - iso).abs());
                        count += 1;
                    }
                }
                let mean = if count > 0 { (sum / f64::from(count)) as f32 } else { 0.0 };
                let value = if becomes_high { iso + mean } else { iso - mean };
                let is_beyond = if becomes_high { value > iso } else { value < iso };
                found.push((voxel, if is_beyond { value } else { far[usize::from(becomes_high)] }));
            }
        }
        found.into_iter().for_each(|(voxel, value)| grid.values[voxel] = value);
    }

    fn contains(&self, voxel: usize) -> bool {
        self.nan.contains(voxel) || self.high.contains(voxel) || self.low.contains(voxel)
    }
}

/// Returns the indices of the voxels that share a face with another.
fn face_neighbours([nx, ny, nz]: [usize; 3], voxel: usize) -> impl Iterator<Item = usize> {
    let axes = [(1, nx, voxel % nx), (nx, ny, voxel / nx % ny), (nx * ny, nz, voxel / nx / ny)];
    axes.into_iter().flat_map(move |(step, n, at)| {
        [(at > 0).then(|| voxel - step), (at + 1 < n).then(|| voxel + step)].into_iter().flatten()
    })
}

impl Volume {
    /// Returns one frame for marching cubes, and the iso value in the units of the grid: intensities as they are if `f32`
    /// shows them well enough near `iso`, otherwise their differences from `iso`. NaN and infinite voxels are kept.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub(super) fn grid_at(&self, iso: f64, frame: usize) -> Result<(Grid, f32), VolumeError> {
        let start = self.frame_start(frame)?;
        let largest = iso.abs();
        // If there are no differences across, the surface is the same with both.
        let is_resolved = self.has_steps_above(RESOLVED * largest)
            || self.contrast_at(iso, frame)?.is_some_and(|contrast| contrast >= RESOLVED * largest);
        let (shift, iso) = if is_resolved { (0.0, iso as f32) } else { (iso, 0.0) };
        let values = self.shifted(start..start + self.frame_len(), shift)?;
        Ok((Grid { dims: self.dims(), values }, iso))
    }

    /// Returns the intensities of stored values less `shift`, in `f32`; a shift is subtracted in `f64`.
    fn shifted(&self, indices: Range<usize>, shift: f64) -> Result<Vec<f32>, VolumeError> {
        let intensity = |v: f64| v * self.slope + self.intercept;
        if shift == 0.0 && self.slope == 1.0 && self.intercept == 0.0 && !self.may_lack_values() {
            return self.voxels.as_f32(indices);
        }
        if shift == 0.0 {
            return super::converted(&self.voxels, indices, intensity);
        }
        super::converted(&self.voxels, indices, |v| {
            let difference = intensity(v) - shift;
            // Infinite values stay infinite.
            if difference.is_finite() { difference.clamp(-LARGEST, LARGEST) } else { difference }
        })
    }

    /// Returns whether voxels may be NaN or infinite, by the type in which they are stored.
    pub(super) fn may_lack_values(&self) -> bool {
        matches!(self.voxels.as_ref(), Voxels::F32(_) | Voxels::F64(_))
    }

    /// Returns the voxels of a frame that are not finite numbers; `None` if all are.
    ///
    /// # Errors
    /// `frame` out of range.
    pub(crate) fn not_finite(&self, frame: usize) -> Result<Option<NotFinite>, VolumeError> {
        let start = self.frame_start(frame)?;
        if !self.may_lack_values() {
            return Ok(None);
        }
        let found = NotFinite::of(&self.voxels, start..start + self.frame_len());
        Ok(found.map(|found| if self.slope > 0.0 { found } else { found.turned() }))
    }

    /// Returns whether all voxels in a region are finite numbers.
    ///
    /// # Errors
    /// The region is empty or not within the volume; `frame` out of range; [`VolumeError::TooLarge`].
    pub(crate) fn is_finite_in(&self, region: Region, frame: usize) -> Result<bool, VolumeError> {
        let start = self.frame_start(frame)?;
        region.check("region", self.dims())?;
        if !self.may_lack_values() {
            return Ok(true);
        }
        let voxels = self.voxels.gathered(region.len(), region.rows(self.dims(), start))?;
        Ok(voxels.finite_count() == voxels.len())
    }

    /// Returns the range of intensities that has to be scaled to [0, 1] so that `f32` shows the image near `iso`:
    /// a window around `iso` if [`Self::range`] is too wide for that, else `None`.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub(crate) fn window_at(&self, iso: f64, frame: usize) -> Result<Option<[f64; 2]>, VolumeError> {
        let least = RESOLVED * self.span();
        if self.has_steps_above(least) {
            return Ok(None);
        }
        let contrast = match self.contrast_at(iso, frame)? {
            Some(contrast) => contrast,
            // No voxel may be rounded up to the iso value.
            None if iso > self.range[0] => self.nearest_to(iso, frame)?,
            None => return Ok(None),
        };
        if contrast >= least {
            return Ok(None);
        }
        let half = 0.5 * WINDOW * contrast;
        Ok(Some([iso - half, iso + half]))
    }

    /// Returns the least difference of a finite voxel from `iso`, infinite if it is 0 or there is none.
    fn nearest_to(&self, iso: f64, frame: usize) -> Result<f64, VolumeError> {
        let start = self.frame_start(frame)?;
        let mut nearest = f64::INFINITY;
        self.voxels.for_each_part(start..start + self.frame_len(), |part| {
            let differences = part.iter().map(|v| (v * self.slope + self.intercept - iso).abs());
            nearest = differences.filter(|&difference| difference > 0.0).fold(nearest, f64::min);
        });
        Ok(nearest)
    }

    /// Returns one frame as a grid with intensities scaled from `range` to [0, 1]; those beyond it become its ends, as
    /// do +∞ and −∞, and NaN becomes 0.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub(crate) fn grid_in(&self, range: [f64; 2], frame: usize) -> Result<Grid, VolumeError> {
        let start = self.frame_start(frame)?;
        let scale = Normalisation::new([self.slope, self.intercept], range);
        let frame = start..start + self.frame_len();
        let values = super::converted(&self.voxels, frame, |stored| scale.of(stored))?;
        Ok(Grid { dims: self.dims(), values })
    }

    /// Returns whether intensities that differ do so by `least` at least, by the type in which voxels are stored.
    fn has_steps_above(&self, least: f64) -> bool {
        // Integers differ by one.
        !self.may_lack_values() && self.slope.abs() >= least
    }

    /// Returns whether the differences between neighbouring voxels are so small a part of the range that [`Self::window_at`]
    /// may depend on the iso value: there are a few voxels, or another frame, far beyond all others.
    ///
    /// # Errors
    /// `frame` out of range.
    pub(crate) fn is_wide(&self, frame: usize) -> Result<bool, VolumeError> {
        let least = RESOLVED * self.span();
        if self.has_steps_above(least) {
            return Ok(false);
        }
        let median = self.difference_where(frame, 0.5, |a, b| a != b)?;
        Ok(median.is_some_and(|median| median < least))
    }

    /// Returns a small difference, see [`LOW_SHARE`], among those between neighbouring finite voxels on opposite sides of
    /// `iso`; `None` if there are none.
    ///
    /// # Errors
    /// `frame` out of range.
    fn contrast_at(&self, iso: f64, frame: usize) -> Result<Option<f64>, VolumeError> {
        let [low, high] = self.range;
        if iso <= low || iso > high {
            return Ok(None);
        }
        self.difference_where(frame, LOW_SHARE, |a, b| (a < iso) != (b < iso))
    }

    /// Returns the difference between neighbouring finite voxels below which a share of those are that `counts` tells, by
    /// the two intensities; `None` if there are none. A sample of the voxels is read if it has enough of them.
    ///
    /// # Errors
    /// `frame` out of range.
    fn difference_where(
        &self,
        frame: usize,
        share: f64,
        counts: impl Fn(f64, f64) -> bool,
    ) -> Result<Option<f64>, VolumeError> {
        let start = self.frame_start(frame)?;
        let sparse = (self.frame_len() / FIRST_READ).max(1);
        let mut found = Vec::new();
        for stride in [sparse, 1] {
            found = self.differences(start, stride, &counts);
            if found.len() >= ENOUGH || sparse == 1 {
                break;
            }
        }
        sort_by_rank(&mut found, |&difference| rank_f64(difference));
        Ok(found.get((found.len() as f64 * share) as usize).copied())
    }

    /// Returns the absolute differences between those neighbouring finite voxels that `counts` tells, by their
    /// intensities; of the rows along x, only each `stride`-th is compared with its neighbours.
    fn differences(&self, start: usize, stride: usize, counts: &dyn Fn(f64, f64) -> bool) -> Vec<f64> {
        let [nx, ny, nz] = self.dims();
        let mut found = Vec::new();
        let mut compare = |a: &[f64], b: &[f64]| {
            for (&a, &b) in a.iter().zip(b) {
                if counts(a, b) && (a - b).is_finite() {
                    found.push((a - b).abs());
                }
            }
            found.len() < MOST
        };
        let read = |k: usize, row: &mut Vec<f64>| {
            self.voxels.read(start + k * nx..start + (k + 1) * nx, row);
            row.iter_mut().for_each(|v| *v = *v * self.slope + self.intercept);
        };
        let [mut row, mut other] = [(); 2].map(|()| Vec::with_capacity(nx));
        for k in (0..ny * nz).step_by(stride) {
            read(k, &mut row);
            let mut goes_on = compare(&row[1..], &row);
            for (step, is_there) in [(1, k % ny + 1 < ny), (ny, k / ny + 1 < nz)] {
                if goes_on && is_there {
                    read(k + step, &mut other);
                    goes_on = compare(&other, &row);
                }
            }
            if !goes_on {
                break;
            }
        }
        found
    }
}

impl NotFinite {
    /// Returns the same voxels with their signs changed, as by a negative slope.
    fn turned(self) -> Self {
        Self { nan: self.nan, high: self.low, low: self.high }
    }
}
