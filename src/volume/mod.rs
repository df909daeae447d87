//! Volumes: regular grids of intensities, and the operations on them (sampling, slices, histograms, pyramids,
//! iso-surfaces).
//!
//! A [`Volume`] holds typed voxels as stored in a file, an affine map from voxel index to world, and one or more
//! frames. A [`Grid`] is one frame as `f32` intensities, for loops that sample millions of times. Index coordinates put
//! voxel centres at integers, so the first voxel covers [-1/2, 1/2].
//!
//! ```
//! use vesicle::math::{DAffine3, DVec3};
//! use vesicle::volume::{Space, Volume, VolumeInit, Voxels};
//!
//! let volume = Volume::new(VolumeInit {
//!     voxels: Voxels::U8(vec![0, 10, 20, 30, 40, 50, 60, 70]),
//!     dims: [2, 2, 2, 1],
//!     affine: DAffine3::from_scale(DVec3::splat(0.5)),
//!     slope: 1.0,
//!     intercept: 0.0,
//!     frame_seconds: 0.0,
//!     space: Space::Ras,
//! })?;
//! assert_eq!(volume.sample(DVec3::new(0.25, 0.0, 0.0), 0)?, 5.0);
//! # Ok::<(), vesicle::volume::VolumeError>(())
//! ```

mod binning;
mod bricks;
mod contour;
mod coverage;
mod crop;
pub(crate) mod cube_cases;
mod derived;
mod dice;
mod enrich;
mod error;
mod fill_value;
mod flow;
mod frame_grid;
mod grid;
mod inside;
mod labels;
mod near_iso;
mod pyramid;
mod region;
mod resample;
mod row_sweep;
mod same_grid;
mod sampling;
mod sequence;
mod slices;
mod sparse;
mod subdivided;
mod surface_extractor;
mod threshold;
mod unscaled;
mod voxels;
mod write;

pub use bricks::BRICK;
pub(crate) use bricks::{BrickGrid, BrickId};
pub(crate) use contour::{Slices, marching_cubes_in_slices};
pub use contour::{marching_cubes, marching_cubes_bounded, marching_cubes_world};
pub use coverage::coverage;
pub use enrich::Enrichment;
pub use error::VolumeError;
pub(crate) use error::filled;
pub(crate) use frame_grid::FrameGrid;
pub use grid::{CellCache, Grid, Padding, VectorGrid};
pub use inside::{FillRule, visit_inside, voxels_inside, voxels_inside_in_slices};
pub use labels::LabelCount;
pub(crate) use labels::listed;
pub(crate) use near_iso::NotFinite;
pub use region::Region;
pub use resample::{Interpolation, ResampleGrid};
pub(crate) use sampling::trilinear;
pub(crate) use sparse::merged;
pub use sparse::{BrickBox, SparseInit, SparseLevel, SparseVolume};
pub(crate) use subdivided::Subdivided;
pub use surface_extractor::{Lattice, MAX_NODES, SurfaceExtractor};
pub use voxels::Voxels;
pub(crate) use voxels::{VoxelNumber, map_each};

use crate::math::{DAffine3, DVec3, box_corners};
use crate::warning::Warning;
use derived::Derivation;
use error::reserve;
use std::ops::Range;
use std::sync::Arc;

/// Orientation of the world axes relative to the patient.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Space {
    /// x points right, y anterior, z superior (NIfTI).
    #[default]
    Ras,
    /// x points left, y posterior, z superior (DICOM, ITK).
    Lps,
}

/// Length of one unit of world coordinates, if the file states it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LengthUnit {
    /// The file does not state the length of a world unit.
    #[default]
    Unknown,
    /// World coordinates are in metres.
    Metre,
    /// World coordinates are in millimetres.
    Millimetre,
    /// World coordinates are in micrometres.
    Micrometre,
}

/// Arguments of [`Volume::new`].
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeInit {
    /// Stored values, x fastest, then y, z, t.
    pub voxels: Voxels,
    /// Number of voxels along x, y and z, and number of frames.
    pub dims: [usize; 4],
    /// Map from voxel index to world coordinates.
    pub affine: DAffine3,
    /// Slope of the map to intensities: intensity = stored value × slope + intercept.
    pub slope: f64,
    /// Intercept of the map to intensities: intensity = stored value × slope + intercept.
    pub intercept: f64,
    /// Time from one frame to the next, in seconds; 0 if the frames have no time step.
    pub frame_seconds: f64,
    /// Orientation of the world axes relative to the patient.
    pub space: Space,
}

impl VolumeInit {
    /// Returns the arguments of a volume whose stored values are its intensities, with voxels of size 1 from the origin
    /// on, in RAS, and without a time between frames.
    pub fn new(voxels: Voxels, dims: [usize; 4]) -> Self {
        let affine = DAffine3::IDENTITY;
        Self { voxels, dims, affine, slope: 1.0, intercept: 0.0, frame_seconds: 0.0, space: Space::Ras }
    }
}

/// A 3D image, or a sequence of 3D images, with its position in world space. Cheap to clone: the voxels are shared.
///
/// Intensities are stored value × slope + intercept. NaN and infinite voxels are excluded from ranges and histograms.
/// When intensities are sampled, +∞ becomes the upper end of [`range`](Self::range), and −∞ and NaN become the lower end,
/// so every sampled intensity is finite; only [`intensities`](Self::intensities) keeps NaN.
#[derive(Clone, Debug)]
pub struct Volume {
    voxels: Arc<Voxels>,
    dims: [usize; 4],
    affine: DAffine3,
    inverse: DAffine3,
    slope: f64,
    intercept: f64,
    frame_seconds: f64,
    space: Space,
    unit: LengthUnit,
    range: [f64; 2],
    warnings: Vec<Warning>,
}

impl Volume {
    /// Creates a volume after validating all fields of `init`.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] when a dimension is 0 or above 16,777,216, the number of voxels is not the product of the
    /// dimensions, the affine is not finite, not invertible, has a voxel axis whose length in world units is not within
    /// 1e-12 to 1e12, or maps a corner beyond the range of `f32`, the slope is 0 or not finite, the intercept is not
    /// finite, the frame time is negative or not finite, no voxel is a finite number, or an intensity exceeds the range
    /// of `f32`.
    pub fn new(init: VolumeInit) -> Result<Volume, VolumeError> {
        check_dims(init.dims, init.voxels.len())?;
        check_scale(init.slope, init.intercept)?;
        check_frame_seconds(init.frame_seconds)?;
        let inverse = invert(init.affine)?;
        check_corners(init.affine, init.dims)?;
        let range = intensity_range(&init.voxels, init.slope, init.intercept)?;
        Ok(Volume {
            voxels: Arc::new(init.voxels),
            dims: init.dims,
            affine: init.affine,
            inverse,
            slope: init.slope,
            intercept: init.intercept,
            frame_seconds: init.frame_seconds,
            space: init.space,
            unit: LengthUnit::Unknown,
            range,
            warnings: Vec::new(),
        })
    }

    /// Returns a volume on the grid of this one, with the same dimensions, affine, space and length unit, but one
    /// frame, whose intensities are `voxels`.
    ///
    /// # Errors
    /// As [`Volume::new`].
    pub fn with_voxels(&self, voxels: Voxels) -> Result<Volume, VolumeError> {
        let [nx, ny, nz] = self.dims();
        let Self { affine, space, .. } = *self;
        let volume = Volume::new(VolumeInit { affine, space, ..VolumeInit::new(voxels, [nx, ny, nz, 1]) })?;
        Ok(volume.derived(self, Derivation::Grid))
    }

    /// Returns the volume with the length unit of its world coordinates set to `unit`.
    pub fn with_unit(mut self, unit: LengthUnit) -> Volume {
        self.unit = unit;
        self
    }

    /// Returns the volume with `warning` added to its warnings.
    #[must_use]
    pub fn with_warning(mut self, warning: Warning) -> Volume {
        self.warnings.push(warning);
        self
    }

    /// Returns what a user should know about the volume before relying on it.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Returns the number of voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        [self.dims[0], self.dims[1], self.dims[2]]
    }

    /// Returns the number of frames, 1 for a still image.
    pub fn frames(&self) -> usize {
        self.dims[3]
    }

    /// Returns the voxel size along x, y and z, in world units.
    pub fn spacing(&self) -> [f64; 3] {
        let axes = self.affine.matrix3;
        [axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()]
    }

    /// Returns the map from voxel index to world coordinates.
    pub fn affine(&self) -> DAffine3 {
        self.affine
    }

    /// Returns the map from voxel index to world coordinates in the given space: RAS and LPS differ in the signs of x
    /// and y.
    pub fn affine_in(&self, space: Space) -> DAffine3 {
        let sign = if space == self.space { 1.0 } else { -1.0 };
        DAffine3::from_scale(DVec3::new(sign, sign, 1.0)) * self.affine
    }

    /// Returns the map from world coordinates to voxel index.
    pub fn inverse_affine(&self) -> DAffine3 {
        self.inverse
    }

    /// Returns the orientation of the world axes relative to the patient.
    pub fn space(&self) -> Space {
        self.space
    }

    /// Returns the length unit of the world coordinates.
    pub fn unit(&self) -> LengthUnit {
        self.unit
    }

    /// Returns the time from one frame to the next, in seconds; 0 if the frames have no time step.
    pub fn frame_seconds(&self) -> f64 {
        self.frame_seconds
    }

    /// Returns the slope of the map to intensities: intensity = stored value × slope + [`intercept`](Self::intercept).
    pub fn slope(&self) -> f64 {
        self.slope
    }

    /// Returns the intercept of the map to intensities; see [`slope`](Self::slope).
    pub fn intercept(&self) -> f64 {
        self.intercept
    }

    /// Returns the stored values of all frames, x fastest, then y, z, t.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// Returns the smallest and largest finite intensity over all frames.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the largest minus the smallest finite intensity over all frames, or 1 if they are equal, so that it is
    /// safe to divide by.
    pub fn span(&self) -> f64 {
        span(self.range)
    }

    /// Returns all intensities of one frame, x fastest, then y, z. NaN stays NaN.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub fn intensities(&self, frame: usize) -> Result<Vec<f32>, VolumeError> {
        let start = self.frame_start(frame)?;
        let end = start + self.frame_len();
        let kept = |v: f64| if v.is_nan() { v } else { self.finite(v) };
        converted(&self.voxels, start..end, |v| kept(v * self.slope + self.intercept))
    }

    /// Returns the intensities of the voxels with the given indices, less `base`, which is subtracted in `f64`, with those that
    /// are not finite replaced by [`Self::finite`].
    fn intensities_above(&self, base: f64, indices: Range<usize>) -> Result<Vec<f32>, VolumeError> {
        converted(&self.voxels, indices, |v| self.finite(v * self.slope + self.intercept) - base)
    }

    /// Returns one frame as a grid of `f32` intensities in index coordinates; NaN becomes the lower end of the range.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub fn grid(&self, frame: usize) -> Result<Grid, VolumeError> {
        let start = self.frame_start(frame)?;
        let values = self.intensities_above(0.0, start..start + self.frame_len())?;
        Ok(Grid { dims: self.dims(), values })
    }

    /// Returns one frame as a grid with intensities scaled from [`Self::range`] to [0, 1]; NaN and −∞ become 0, +∞
    /// becomes 1.
    ///
    /// Values are scaled before they are rounded to `f32`, so small differences between large values are kept.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub fn normalised_grid(&self, frame: usize) -> Result<Grid, VolumeError> {
        let start = self.frame_start(frame)?;
        let end = start + self.frame_len();
        let normalised = self.normalisation();
        let values = converted(&self.voxels, start..end, normalised)?;
        Ok(Grid { dims: self.dims(), values })
    }

    /// Returns the part of [`Self::normalised_grid`] in a region, with the same values.
    ///
    /// # Errors
    /// The region is empty or not within the volume; `frame` out of range; [`VolumeError::TooLarge`].
    pub fn normalised_region(&self, region: Region, frame: usize) -> Result<Grid, VolumeError> {
        let start = self.frame_start(frame)?;
        region.check("region", self.dims())?;
        let voxels = self.voxels.gathered(region.len(), region.rows(self.dims(), start))?;
        let normalised = self.normalisation();
        let values = converted(&voxels, 0..voxels.len(), normalised)?;
        Ok(Grid { dims: region.dims, values })
    }

    /// Returns the map from stored values to intensities scaled from [`Self::range`] to [0, 1].
    fn normalisation(&self) -> impl Fn(f64) -> f64 + use<> {
        let normalisation = Normalisation::new([self.slope, self.intercept], self.range);
        move |stored| normalisation.of(stored)
    }

    /// Returns the trilinearly interpolated intensity at a world point; outside the volume the border is replicated.
    ///
    /// # Errors
    /// `world` not finite, `frame` out of range.
    pub fn sample(&self, world: DVec3, frame: usize) -> Result<f64, VolumeError> {
        let start = self.frame_start(frame)?;
        if !world.is_finite() {
            return Err(VolumeError::invalid("world", format!("must be three finite numbers, got {world}")));
        }
        let p = self.inverse.transform_point3(world);
        Ok(trilinear(self.dims(), p, |index| self.intensity_at(start + index)))
    }

    /// Returns the arguments of [`Volume::new`] for a volume with other voxels and everything else as in this one.
    fn init_with(&self, voxels: Voxels) -> VolumeInit {
        VolumeInit {
            voxels,
            dims: self.dims,
            affine: self.affine,
            slope: self.slope,
            intercept: self.intercept,
            frame_seconds: self.frame_seconds,
            space: self.space,
        }
    }

    /// Returns the volume of the 0/1 mask `values`, one per voxel of all frames, on the grid of this volume.
    fn mask(&self, values: Vec<u8>) -> Result<Volume, VolumeError> {
        let init = VolumeInit { slope: 1.0, intercept: 0.0, ..self.init_with(Voxels::U8(values)) };
        Ok(Volume::new(init)?.derived(self, Derivation::Same))
    }

    /// Returns the number of voxels in one frame.
    fn frame_len(&self) -> usize {
        self.dims[0] * self.dims[1] * self.dims[2]
    }

    /// Returns the index of a frame's first voxel in the stored values.
    fn frame_start(&self, frame: usize) -> Result<usize, VolumeError> {
        if frame < self.dims[3] {
            return Ok(frame * self.frame_len());
        }
        Err(VolumeError::invalid(
            "frame",
            format!("{frame} is out of range; there are {} frames, the first is 0", self.dims[3]),
        ))
    }

    /// Returns the intensity of one voxel, given by its index in the stored values, made finite by [`Self::finite`].
    fn intensity_at(&self, index: usize) -> f64 {
        let stored = self.voxels.get(index).unwrap_or(f64::NAN);
        self.finite(stored * self.slope + self.intercept)
    }

    /// Returns an intensity as it is if finite; +∞ becomes the upper end of the volume's intensity range, and −∞ and
    /// NaN become the lower end.
    fn finite(&self, value: f64) -> f64 {
        if value.is_finite() {
            value
        } else if value == f64::INFINITY {
            self.range[1]
        } else {
            self.range[0]
        }
    }
}

/// The map from stored values to intensities scaled from a range to [0, 1].
#[derive(Clone, Copy, Debug, Default)]
struct Normalisation {
    slope: f64,
    intercept: f64,
}

impl Normalisation {
    /// Creates the map for values whose intensity is slope × value + intercept.
    fn new([slope, intercept]: [f64; 2], range: [f64; 2]) -> Self {
        let factor = 1.0 / span(range);
        Self { slope: slope * factor, intercept: (intercept - range[0]) * factor }
    }

    /// Returns the scaled intensity of a stored value, from 0 to 1.
    #[inline]
    fn of(&self, stored: f64) -> f64 {
        let value = stored * self.slope + self.intercept;
        // NaN fails the comparison and becomes 0.
        if value > 0.0 { if value < 1.0 { value } else { 1.0 } } else { 0.0 }
    }
}

/// Returns the length of a range of intensities, or 1 if its ends are equal, so that it is safe to divide by.
fn span([low, high]: [f64; 2]) -> f64 {
    if high > low { high - low } else { 1.0 }
}

fn converted(
    stored: &Voxels,
    indices: Range<usize>,
    intensity: impl Fn(f64) -> f64,
) -> Result<Vec<f32>, VolumeError> {
    let mut out = reserve(indices.len())?;
    stored.for_each_part(indices, |part| out.extend(part.iter().map(|&value| intensity(value) as f32)));
    Ok(out)
}

/// The largest number of voxels along an axis: with more, not every voxel index is a number in single precision.
const LONGEST_SIDE: usize = 1 << 24;

fn check_dims(dims: [usize; 4], len: usize) -> Result<(), VolumeError> {
    if dims.contains(&0) {
        return Err(VolumeError::invalid("dims", format!("must all be at least 1, got {dims:?}")));
    }
    if dims[..3].iter().any(|&n| n > LONGEST_SIDE) {
        let problem = format!("must be at most {LONGEST_SIDE} along an axis, got {dims:?}");
        return Err(VolumeError::invalid("dims", problem));
    }
    let count = dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
    if count == Some(len) {
        return Ok(());
    }
    let needed = count.map_or_else(|| "too many".to_owned(), |n| n.to_string());
    Err(VolumeError::invalid("data", format!("must have {needed} voxels for dims {dims:?}, got {len}")))
}

fn check_scale(slope: f64, intercept: f64) -> Result<(), VolumeError> {
    if !slope.is_finite() || slope == 0.0 {
        return Err(VolumeError::invalid("slope", format!("must be finite and not 0, got {slope}")));
    }
    if !intercept.is_finite() {
        return Err(VolumeError::invalid("intercept", format!("must be finite, got {intercept}")));
    }
    Ok(())
}

fn check_frame_seconds(seconds: f64) -> Result<(), VolumeError> {
    if seconds.is_finite() && seconds >= 0.0 {
        return Ok(());
    }
    Err(VolumeError::invalid(
        "frameSeconds",
        format!("must be finite and >= 0 (0: no frame time), got {seconds}"),
    ))
}

/// Returns whether a map from voxel index to world can be that of a volume: it is finite and can be inverted accurately.
pub(crate) fn is_placement(affine: DAffine3) -> bool {
    invert(affine).is_ok()
}

/// Returns the inverse of a volume's affine map from voxel index to world; an error if the map is singular or too
/// ill-conditioned to be inverted accurately.
fn invert(affine: DAffine3) -> Result<DAffine3, VolumeError> {
    let error = |problem: &str| Err(VolumeError::invalid("affine", problem));
    if !affine.is_finite() {
        return error("has an entry that is not a finite number");
    }
    let axes = affine.matrix3;
    let lengths = [axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()];
    if lengths.iter().any(|&l| !(l > MIN_SPACING && l < MAX_SPACING)) {
        return error("has a voxel axis shorter than 1e-12 or longer than 1e12");
    }
    let volume = axes.determinant().abs() / (lengths[0] * lengths[1] * lengths[2]);
    if volume < MIN_AXIS_VOLUME || volume.is_nan() {
        return error("is not invertible: its three voxel axes lie in a plane");
    }
    let inverse = affine.inverse();
    if inverse.is_finite() { Ok(inverse) } else { error("is not invertible") }
}

/// Returns an error unless all corners of the volume lie within the range of `f32`, in which surface positions are
/// stored.
fn check_corners(affine: DAffine3, dims: [usize; 4]) -> Result<(), VolumeError> {
    let far = DVec3::new(dims[0] as f64, dims[1] as f64, dims[2] as f64);
    let corners = box_corners(DVec3::ZERO, far).into_iter();
    let furthest = corners.map(|p| affine.transform_point3(p).abs().max_element()).fold(0.0, f64::max);
    if furthest <= f64::from(f32::MAX) {
        return Ok(());
    }
    let problem = format!("maps a corner of the volume to {furthest}, beyond the range of f32 (3.4e38)");
    Err(VolumeError::invalid("affine", problem))
}

/// Smallest accepted voxel spacing, in world units. Spacings below it or above [`MAX_SPACING`] come from broken headers
/// only; the product of three accepted spacings is far from overflow.
const MIN_SPACING: f64 = 1e-12;
/// Largest accepted voxel spacing, in world units: larger ones come from broken headers only.
const MAX_SPACING: f64 = 1e12;
/// Smallest accepted volume of the parallelepiped spanned by the normalised voxel axes. Sheared gantry scans stay above
/// 0.5; below this, inversion loses half of the digits of `f64` or more.
const MIN_AXIS_VOLUME: f64 = 1e-8;

fn intensity_range(voxels: &Voxels, slope: f64, intercept: f64) -> Result<[f64; 2], VolumeError> {
    let Some(stored) = voxels.finite_range() else {
        return Err(VolumeError::invalid("data", "at least one voxel must be finite"));
    };
    scaled_range(stored, slope, intercept)
}

/// Returns the intensities at the ends of a range of stored values, the lower one first; an error if `f32` cannot
/// represent them.
fn scaled_range(stored: [f64; 2], slope: f64, intercept: f64) -> Result<[f64; 2], VolumeError> {
    let ends = stored.map(|v| v * slope + intercept);
    let [low, high] = if ends[0] <= ends[1] { ends } else { [ends[1], ends[0]] };
    if [low, high].iter().all(|v| v.abs() <= f64::from(f32::MAX)) {
        return Ok([low, high]);
    }
    Err(VolumeError::invalid(
        "data",
        format!("intensities from {low} to {high} exceed the range of f32 (3.4e38)"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn init(voxels: Voxels, dims: [usize; 4]) -> VolumeInit {
        let affine = DAffine3::from_scale(DVec3::new(2.0, -1.0, 0.5));
        VolumeInit {
            voxels,
            dims,
            affine,
            slope: 2.0,
            intercept: -1.0,
            frame_seconds: 0.1,
            space: Space::Ras,
        }
    }

    fn refused(init: VolumeInit) -> &'static str {
        match Volume::new(init) {
            Err(VolumeError::InvalidArgument { parameter, .. }) => parameter,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn intensities_are_scaled_and_keep_their_order() {
        let v = Volume::new(init(Voxels::I8((-4..8).collect()), [3, 2, 2, 1])).unwrap();
        assert_eq!(v.range(), [-9.0, 13.0]);
        assert_eq!(v.intensities(0).unwrap(), (-4..8).map(|i| (2 * i - 1) as f32).collect::<Vec<_>>());
        assert_eq!((v.dims(), v.frames(), v.spacing()), ([3, 2, 2], 1, [2.0, 1.0, 0.5]));
        assert!(v.intensities(1).is_err());
    }

    #[test]
    fn a_normalised_region_is_part_of_the_normalised_grid() {
        let values = (0..48).map(|i| if i == 40 { f32::NAN } else { i as f32 }).collect();
        let v = Volume::new(init(Voxels::F32(values), [3, 4, 2, 2])).unwrap();
        let region = Region { min: [1, 2, 0], dims: [2, 2, 2] };
        for frame in 0..2 {
            let whole = v.normalised_grid(frame).unwrap();
            assert_eq!(v.normalised_region(region, frame), whole.part(region));
        }
        assert!(v.normalised_region(region, 2).is_err());
        let refused = v.normalised_region(Region { dims: [3, 1, 1], ..region }, 0).unwrap_err().to_string();
        assert!(refused.starts_with("region: must have"), "{refused}");
    }

    #[test]
    fn a_negative_slope_turns_the_range_round() {
        let turned = VolumeInit { slope: -1.0, intercept: 0.0, ..init(Voxels::U8(vec![1, 5]), [2, 1, 1, 1]) };
        assert_eq!(Volume::new(turned).unwrap().range(), [-5.0, -1.0]);
    }

    #[test]
    fn world_points_are_sampled_through_the_affine() {
        let v = Volume::new(init(Voxels::U8((0..12).collect()), [3, 2, 2, 1])).unwrap();
        let at = |x: f64, y: f64, z: f64| v.sample(DVec3::new(x, y, z), 0).unwrap();
        assert_eq!(at(0.0, 0.0, 0.0), -1.0);
        assert_eq!(at(3.0, -0.5, 0.25), 2.0 * (1.5 + 1.5 + 3.0) - 1.0);
        assert_eq!(at(-50.0, 0.0, 0.0), -1.0);
        assert!(v.sample(DVec3::NAN, 0).is_err());
        assert!(v.sample(DVec3::ZERO, 1).is_err());
    }

    #[test]
    fn what_is_not_a_finite_number_is_sampled_as_an_end_of_the_range() {
        let voxels = vec![f32::NAN, 1.0, f32::INFINITY, 3.0, f32::NEG_INFINITY, 2.0];
        let plain = VolumeInit { slope: 1.0, intercept: 0.0, ..init(Voxels::F32(voxels), [6, 1, 1, 1]) };
        let v = Volume::new(plain).unwrap();
        assert_eq!(v.range(), [1.0, 3.0]);
        let finite = [1.0, 1.0, 3.0, 3.0, 1.0, 2.0];
        assert_eq!(v.grid(0).unwrap().values, finite);
        assert_eq!(v.histogram(2, 0).unwrap(), [1, 2]);
        assert_eq!(v.slice(2, 0, 0).unwrap(), finite);
        let kept = v.intensities(0).unwrap();
        assert!(kept[0].is_nan());
        assert_eq!(kept[1..], finite[1..]);
    }

    #[test]
    fn wrong_arguments_are_named() {
        let good = || init(Voxels::U8(vec![1; 8]), [2, 2, 2, 1]);
        let affine = |m: [f64; 9]| {
            DAffine3::from_cols_array(&[m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], 0., 0., 0.])
        };
        assert_eq!(refused(VolumeInit { dims: [2, 2, 3, 1], ..good() }), "data");
        assert_eq!(refused(VolumeInit { dims: [2, 0, 2, 1], ..good() }), "dims");
        assert_eq!(refused(VolumeInit { dims: [usize::MAX, 2, 2, 1], ..good() }), "dims");
        assert_eq!(refused(VolumeInit { dims: [2, 2, 2, usize::MAX], ..good() }), "data");
        assert_eq!(refused(VolumeInit { slope: 0.0, ..good() }), "slope");
        assert_eq!(refused(VolumeInit { slope: f64::NAN, ..good() }), "slope");
        assert_eq!(refused(VolumeInit { intercept: f64::INFINITY, ..good() }), "intercept");
        assert_eq!(refused(VolumeInit { frame_seconds: -1.0, ..good() }), "frameSeconds");
        assert_eq!(
            refused(VolumeInit { affine: affine([1., 0., 0., 0., 1., 0., 1., 1., 0.]), ..good() }),
            "affine"
        );
        assert_eq!(
            refused(VolumeInit { affine: affine([1., 0., 0., 0., f64::NAN, 0., 0., 0., 1.]), ..good() }),
            "affine"
        );
        let far_away =
            affine([1., 0., 0., 0., 1., 0., 0., 0., 1.]) * DAffine3::from_translation(DVec3::Y * 4e38);
        assert_eq!(refused(VolumeInit { affine: far_away, ..good() }), "affine");
        assert_eq!(refused(VolumeInit { voxels: Voxels::F64(vec![f64::NAN; 8]), ..good() }), "data");
        assert_eq!(refused(VolumeInit { voxels: Voxels::F64(vec![1e300; 8]), ..good() }), "data");
    }
}
