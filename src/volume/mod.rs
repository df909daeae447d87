//! Regular grids of intensities, and what is read from them.
//!
//! A [`Volume`] is what a file or a caller gives: typed voxels, an affine map from voxel index to world, one or
//! more frames. A [`Grid`] is one frame as `f32` intensities, for loops that sample millions of times.
//! Index coordinates put voxel centres at integers, so the first voxel covers [-1/2, 1/2].
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

mod contour;
mod cube_cases;
mod error;
mod grid;
mod pyramid;
mod sampling;
mod sequence;
mod slices;
mod voxels;

pub use contour::{marching_cubes, marching_cubes_world};
pub use error::VolumeError;
pub use grid::{Grid, VectorGrid};
pub use voxels::Voxels;

use crate::math::{DAffine3, DVec3};
use error::reserve;
use std::sync::Arc;
use voxels::each;

/// Which way the world axes of a patient volume point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Space {
    /// x to the right, y to the front, z to the head (NIfTI).
    #[default]
    Ras,
    /// x to the left, y to the back, z to the head (DICOM, ITK).
    Lps,
}

/// What one world unit is, where the file says so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LengthUnit {
    /// Not stated.
    #[default]
    Unknown,
    /// Metre.
    Metre,
    /// Millimetre.
    Millimetre,
    /// Micrometre.
    Micrometre,
}

/// Everything a [`Volume`] is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeInit {
    /// Stored numbers, x fastest, then y, z, t.
    pub voxels: Voxels,
    /// Number of voxels along x, y, z, and of frames.
    pub dims: [usize; 4],
    /// Voxel index to world.
    pub affine: DAffine3,
    /// Intensity = stored number × slope + intercept.
    pub slope: f64,
    /// See `slope`.
    pub intercept: f64,
    /// Seconds from one frame to the next; 0 where there is no such time.
    pub frame_seconds: f64,
    /// Meaning of the world axes.
    pub space: Space,
}

/// A 3D image, or a sequence of them, with its place in the world. Cheap to clone: the voxels are shared.
///
/// Intensities are stored number × slope + intercept. A voxel that is not a number (or is infinite) counts
/// nowhere in the statistics and reads as the end of [`range`](Self::range) nearest to it, NaN as the smallest
/// intensity, so that no later stage meets one.
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
}

impl Volume {
    /// A volume, checked.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] naming the field when a dimension is 0, the number of voxels is not the
    /// product of the dimensions, the affine is not finite or not invertible, the slope is 0 or not finite, the
    /// frame time is negative, no voxel is a finite number, or an intensity exceeds what `f32` holds.
    pub fn new(init: VolumeInit) -> Result<Volume, VolumeError> {
        check_dims(init.dims, init.voxels.len())?;
        check_scale(init.slope, init.intercept)?;
        check_frame_seconds(init.frame_seconds)?;
        let inverse = invert(init.affine)?;
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
        })
    }

    /// The same volume with its length unit stated.
    pub fn with_unit(mut self, unit: LengthUnit) -> Volume {
        self.unit = unit;
        self
    }

    /// Number of voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        [self.dims[0], self.dims[1], self.dims[2]]
    }

    /// Number of frames, 1 for a still image.
    pub fn frames(&self) -> usize {
        self.dims[3]
    }

    /// World length of one voxel step along x, y and z.
    pub fn spacing(&self) -> [f64; 3] {
        let axes = self.affine.matrix3;
        [axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()]
    }

    /// Voxel index to world.
    pub fn affine(&self) -> DAffine3 {
        self.affine
    }

    /// World to voxel index.
    pub fn inverse_affine(&self) -> DAffine3 {
        self.inverse
    }

    /// Meaning of the world axes.
    pub fn space(&self) -> Space {
        self.space
    }

    /// What one world unit is.
    pub fn unit(&self) -> LengthUnit {
        self.unit
    }

    /// Seconds from one frame to the next; 0 where there is no such time.
    pub fn frame_seconds(&self) -> f64 {
        self.frame_seconds
    }

    /// Intensity = stored number × this + [`intercept`](Self::intercept).
    pub fn slope(&self) -> f64 {
        self.slope
    }

    /// See [`slope`](Self::slope).
    pub fn intercept(&self) -> f64 {
        self.intercept
    }

    /// The stored numbers of all frames, x fastest, then y, z, t.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// Smallest and largest intensity over all frames.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// All intensities of one frame, x fastest, then y, z.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub fn intensities(&self, frame: usize) -> Result<Vec<f32>, VolumeError> {
        let start = self.frame_start(frame)?;
        let end = start + self.frame_len();
        each!(self.voxels.as_ref(), values => self.convert(&values[start..end]))
    }

    /// One frame as a grid of `f32` intensities in index coordinates.
    ///
    /// # Errors
    /// `frame` out of range; [`VolumeError::TooLarge`].
    pub fn grid(&self, frame: usize) -> Result<Grid, VolumeError> {
        Ok(Grid { dims: self.dims(), values: self.intensities(frame)? })
    }

    /// Trilinear intensity at a world point; outside the volume the border is replicated.
    ///
    /// # Errors
    /// `world` not finite, `frame` out of range.
    pub fn sample(&self, world: DVec3, frame: usize) -> Result<f64, VolumeError> {
        let start = self.frame_start(frame)?;
        if !world.is_finite() {
            return Err(VolumeError::invalid(
                "world",
                format!("{world} is not a point; three finite numbers are needed"),
            ));
        }
        let p = self.inverse.transform_point3(world);
        Ok(sampling::trilinear(self.dims(), p, |index| self.intensity_at(start + index)))
    }

    /// Voxels in one frame.
    fn frame_len(&self) -> usize {
        self.dims[0] * self.dims[1] * self.dims[2]
    }

    /// Index of a frame's first voxel.
    fn frame_start(&self, frame: usize) -> Result<usize, VolumeError> {
        if frame < self.dims[3] {
            return Ok(frame * self.frame_len());
        }
        Err(VolumeError::invalid(
            "frame",
            format!("{frame} is out of range; there are {} frames, the first is 0", self.dims[3]),
        ))
    }

    /// The intensity of one voxel, made finite.
    fn intensity_at(&self, index: usize) -> f64 {
        let stored = self.voxels.get(index).unwrap_or(f64::NAN);
        self.finite(stored * self.slope + self.intercept)
    }

    /// The end of the range nearest to a value that is not finite; any other value as it is.
    fn finite(&self, value: f64) -> f64 {
        if value.is_finite() {
            value
        } else if value == f64::INFINITY {
            self.range[1]
        } else {
            self.range[0]
        }
    }

    fn convert<T: Copy + Into<f64>>(&self, stored: &[T]) -> Result<Vec<f32>, VolumeError> {
        let mut out = reserve(stored.len())?;
        let (slope, intercept) = (self.slope, self.intercept);
        out.extend(stored.iter().map(|&v| self.finite(v.into() * slope + intercept) as f32));
        Ok(out)
    }
}

fn check_dims(dims: [usize; 4], len: usize) -> Result<(), VolumeError> {
    if dims.contains(&0) {
        return Err(VolumeError::invalid("dims", format!("{dims:?} has a 0; every one must be at least 1")));
    }
    let count = dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
    if count == Some(len) {
        return Ok(());
    }
    let needed = count.map_or_else(|| "more than can be counted".to_owned(), |n| n.to_string());
    Err(VolumeError::invalid("data", format!("{len} voxels given, dims {dims:?} need {needed}")))
}

fn check_scale(slope: f64, intercept: f64) -> Result<(), VolumeError> {
    if !slope.is_finite() || slope == 0.0 {
        return Err(VolumeError::invalid(
            "slope",
            format!("{slope} given; a finite number other than 0 is needed"),
        ));
    }
    if !intercept.is_finite() {
        return Err(VolumeError::invalid(
            "intercept",
            format!("{intercept} given; a finite number is needed"),
        ));
    }
    Ok(())
}

fn check_frame_seconds(seconds: f64) -> Result<(), VolumeError> {
    if seconds.is_finite() && seconds >= 0.0 {
        return Ok(());
    }
    Err(VolumeError::invalid(
        "frameSeconds",
        format!("{seconds} given; a finite number of seconds, or 0 for none, is needed"),
    ))
}

/// The inverse map, provided that it undoes the map to within rounding.
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

/// Spacings outside these ends come from broken headers only; products of three stay far from overflow.
const MIN_SPACING: f64 = 1e-12;
/// See [`MIN_SPACING`].
const MAX_SPACING: f64 = 1e12;
/// Volume of the box of unit voxel axes. Sheared gantry scans stay above 0.5; below this, inverting loses half of
/// the digits of `f64` and more.
const MIN_AXIS_VOLUME: f64 = 1e-8;

fn intensity_range(voxels: &Voxels, slope: f64, intercept: f64) -> Result<[f64; 2], VolumeError> {
    let Some(stored) = voxels.finite_range() else {
        return Err(VolumeError::invalid("data", "no voxel is a finite number; at least one must be"));
    };
    let ends = stored.map(|v| v * slope + intercept);
    let range = if ends[0] <= ends[1] { ends } else { [ends[1], ends[0]] };
    if range.iter().all(|v| v.abs() <= f64::from(f32::MAX)) {
        return Ok(range);
    }
    Err(VolumeError::invalid(
        "data",
        format!("intensities reach {range:?}; at most 3.4e38 (f32) is accepted"),
    ))
}
