//! Interpretation of the axes of an NRRD: which are spatial and which one counts frames, their directions in world
//! space, and the time between frames.
//!
//! If axes have directions, the axis without one counts frames. Otherwise the frame axis is the one whose kind says so,
//! or that has a unit of time, or whose spacing alone is unknown; of four axes that nothing distinguishes it is the
//! last.

use super::FORMAT;
use super::axis::{Axis, AxisKind, KINDS, axes, words};
use super::fields::Fields;
use super::world::World;
use crate::io::FormatError;
use crate::io::text::Field;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::volume::{LengthUnit, Space};

/// The axes of an NRRD, in the order of the file, with the transform to world space.
pub(super) struct Axes {
    axes: Vec<Axis>,
    /// Index of the axis that counts frames; `None` if no axis does.
    frames: Option<usize>,
    world: World,
    affine: DAffine3,
    space_units: Vec<String>,
}

impl Axes {
    /// Reads the axes of an NRRD from its header and determines which one counts frames.
    pub(super) fn read(fields: &Fields) -> Result<Self, FormatError> {
        let world = World::read(fields)?;
        let axes = axes(fields, &world)?;
        let directions = fields.get("spacedirections");
        let frames = match &directions {
            Some(field) => frame_axis_by_direction(field, &axes)?,
            None => frame_axis_by_kind(&axes)?,
        };
        let in_space: Vec<&Axis> = in_space(&axes, frames).collect();
        let columns = match directions {
            Some(_) => columns_from_directions(&in_space),
            None => columns_from_spacings(fields, &in_space)?,
        };
        let affine = affine_of(fields, &world, columns)?;
        Ok(Self { axes, frames, world, affine, space_units: words(fields, "spaceunits") })
    }

    /// Returns the number of voxels along x, y and z, and the number of frames.
    pub(super) fn dims(&self) -> [usize; 4] {
        let mut dims = [1; 4];
        for (size, axis) in dims.iter_mut().zip(in_space(&self.axes, self.frames)) {
            *size = axis.size;
        }
        dims[3] = self.frame_axis().map_or(1, |axis| axis.size);
        dims
    }

    /// Returns the number of consecutive numbers in the file that belong to the same frame, for reordering the voxels
    /// frame by frame.
    pub(super) fn run(&self) -> usize {
        let faster = self.frames.unwrap_or(self.axes.len());
        self.axes[..faster].iter().map(|axis| axis.size).fold(1, usize::saturating_mul)
    }

    /// Returns the transform from voxel indices to world space.
    pub(super) fn affine(&self) -> DAffine3 {
        self.affine
    }

    pub(super) fn space(&self) -> Space {
        self.world.space
    }

    /// Returns the unit of length that all spatial axes share; unknown if they differ, or if it is not metres,
    /// millimetres or micrometres.
    pub(super) fn unit(&self) -> LengthUnit {
        let axes = in_space(&self.axes, self.frames);
        let units: Vec<&str> = match self.space_units[..] {
            [] => axes.map(|axis| axis.unit.as_str()).collect(),
            _ => axes.zip(&self.space_units).map(|(_, unit)| unit.as_str()).collect(),
        };
        let all = |unit: &str| units.iter().all(|&u| u == unit);
        match () {
            () if all("mm") => LengthUnit::Millimetre,
            () if all("um") || all("\u{b5}m") || all("\u{3bc}m") => LengthUnit::Micrometre,
            () if all("m") => LengthUnit::Metre,
            () => LengthUnit::Unknown,
        }
    }

    /// Returns the seconds between frames; 0 if there is only one frame, or the file does not give a positive time.
    pub(super) fn frame_seconds(&self) -> f64 {
        let Some(axis) = self.frame_axis().filter(|axis| axis.size > 1) else { return 0.0 };
        let step = axis.direction.map_or(axis.spacing, |direction| direction.time);
        let unit = if axis.unit.is_empty() { self.space_units.get(3) } else { Some(&axis.unit) };
        let second = match unit.map_or("", String::as_str) {
            // Without a unit, only an axis that is declared as time is in seconds.
            "" => f64::from(u8::from(axis.kind == AxisKind::Time || self.world.has_time)),
            unit => seconds(unit).unwrap_or(0.0),
        };
        let apart = step * second;
        if apart > 0.0 && apart.is_finite() { apart } else { 0.0 }
    }

    /// Returns the axis that counts frames, if there is one.
    fn frame_axis(&self) -> Option<&Axis> {
        self.axes.get(self.frames?)
    }
}

/// Returns the spatial axes in the order of the file: all but the one with index `frames`, which counts frames.
fn in_space(axes: &[Axis], frames: Option<usize>) -> impl Iterator<Item = &Axis> {
    axes.iter().enumerate().filter(move |&(i, _)| Some(i) != frames).map(|(_, axis)| axis)
}

/// Returns the index of the axis without a direction in space, which counts frames; `None` if all axes are spatial.
fn frame_axis_by_direction(field: &Field<'_>, axes: &[Axis]) -> Result<Option<usize>, FormatError> {
    let mut frames = Vec::new();
    for (i, axis) in axes.iter().enumerate() {
        match axis.direction {
            Some(v) if v.time == 0.0 && axis.kind.counts_frames() => {
                let found = format!("list or time for axis {i}, which has a direction in space,");
                return Err(FormatError::unsupported(FORMAT, "kinds", found, KINDS));
            }
            Some(v) if v.time == 0.0 => {}
            Some(v) if v.space != DVec3::ZERO => {
                return Err(field.invalid("an axis is either in space or in time"));
            }
            _ => frames.push(i),
        }
    }
    match frames[..] {
        [] if axes.len() <= 3 => Ok(None),
        [one] if axes.len() >= 2 => Ok(Some(one)),
        _ => Err(field.invalid("must have one to three spatial axes and at most one frame axis")),
    }
}

/// Returns the index of the axis that counts frames according to kinds, units and spacings, `None` if all axes are
/// spatial; used if the file has no directions.
fn frame_axis_by_kind(axes: &[Axis]) -> Result<Option<usize>, FormatError> {
    let signs = |axis: &Axis| (axis.kind, seconds(&axis.unit).is_some(), axis.spacing.is_nan());
    let Some(most) = axes.iter().map(signs).max() else { return Ok(None) };
    if axes.len() < 4 && !most.0.counts_frames() && !most.1 {
        return Ok(None);
    }
    let alike: Vec<usize> = (0..axes.len()).filter(|&i| signs(&axes[i]) == most).collect();
    match alike[..] {
        [one] if axes.len() >= 2 => Ok(Some(one)),
        [.., last] if last >= 1 && last == axes.len() - 1 => Ok(Some(last)),
        _ => {
            let problem = "ambiguous frame axis; mark it as 'list' or 'time'";
            Err(FormatError::invalid(FORMAT, "kinds", problem))
        }
    }
}

/// Returns the number of seconds in a unit of time; `None` if `unit` is no known unit of time.
fn seconds(unit: &str) -> Option<f64> {
    match unit {
        "s" | "sec" | "second" | "seconds" => Some(1.0),
        "ms" | "msec" | "millisecond" | "milliseconds" => Some(1e-3),
        "us" | "usec" | "\u{b5}s" | "\u{3bc}s" | "microsecond" | "microseconds" => Some(1e-6),
        _ => None,
    }
}

/// Returns the columns of the affine map from voxel index to world, from the directions of one to three spatial axes;
/// missing axes get unit vectors perpendicular to the others.
fn columns_from_directions(axes: &[&Axis]) -> [DVec3; 3] {
    let directions: Vec<DVec3> = axes.iter().filter_map(|axis| axis.direction).map(|v| v.space).collect();
    match directions[..] {
        [x, y, z] => [x, y, z],
        [x, y] => [x, y, x.cross(y).normalize_or_zero()],
        [x] => {
            let (y, z) = x.normalize_or_zero().any_orthonormal_pair();
            [x, y, z]
        }
        _ => [DVec3::ZERO; 3],
    }
}

/// Returns the columns of the affine map from voxel index to world for a file without directions: along the world axes,
/// with the lengths in `spacings`, or 1 if those are missing or NaN. An error if the file gives the ends of axes
/// instead.
fn columns_from_spacings(fields: &Fields, axes: &[&Axis]) -> Result<[DVec3; 3], FormatError> {
    let Some(field) = fields.get("spacings") else {
        return match fields.get("axismaxs") {
            None => Ok([DVec3::X, DVec3::Y, DVec3::Z]),
            Some(field) => {
                let accepted = "spacings or space directions";
                Err(FormatError::unsupported(FORMAT, field.name, "positions by axis ends", accepted))
            }
        };
    };
    let mut lengths = DVec3::ONE.to_array();
    for (length, axis) in lengths.iter_mut().zip(axes).filter(|(_, axis)| !axis.spacing.is_nan()) {
        *length = axis.spacing;
    }
    if lengths.iter().any(|&l| l == 0.0 || !l.is_finite()) {
        return Err(field.invalid("must be finite and not 0"));
    }
    Ok([DVec3::X * lengths[0], DVec3::Y * lengths[1], DVec3::Z * lengths[2]])
}

/// Returns the affine map from voxel index to world with the given columns and the file's origin, 0 if the file has
/// none; x is flipped if that converts the file's space to RAS or LPS.
fn affine_of(fields: &Fields, world: &World, [x, y, z]: [DVec3; 3]) -> Result<DAffine3, FormatError> {
    let origin = fields.get("spaceorigin").map(|field| world.vector(&field, field.text)).transpose()?;
    let origin = origin.flatten().map(|v| v.space).filter(|v| !v.is_nan()).unwrap_or(DVec3::ZERO);
    let affine = DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), origin);
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    Ok(if world.flip_x { mirror * affine } else { affine })
}
