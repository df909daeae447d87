//! Interpretation of the axes of an NRRD: which are spatial, which one counts frames and which holds colours, their
//! directions in world space, and the time between frames.
//!
//! If axes have directions, the axis without one counts frames. Otherwise the frame axis is the one whose kind says so,
//! or that has a unit of time, or whose spacing alone is unknown; of four axes that nothing distinguishes it is the
//! first, if that has a single entry and the last has several, else the last.

use super::FORMAT;
use super::axis::{Axis, AxisKind, KINDS, axes, words};
use super::fields::Fields;
use super::world::World;
use crate::io::FormatError;
use crate::io::colour::Colours;
use crate::io::text::Field;
use crate::io::units::{metres, thickness_warning, unit_of};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::volume::{LengthUnit, Space};
use crate::warning::Warning;

/// The axes of an NRRD, in the order of the file, with the transform to world space.
pub(super) struct Axes {
    /// Sizes of all axes.
    sizes: Vec<usize>,
    /// The axes other than that of colours.
    axes: Vec<Axis>,
    colours: Option<Colours>,
    /// Index of the axis that counts frames; `None` if no axis does.
    frames: Option<usize>,
    world: World,
    affine: DAffine3,
    unit: LengthUnit,
    /// Index among the spatial axes of one with a single slice to which the file gives no thickness.
    thin: Option<usize>,
    space_units: Vec<String>,
}

impl Axes {
    /// Reads the axes of an NRRD from its header and determines which one counts frames; `space` is that of files that
    /// name none.
    pub(super) fn read(fields: &Fields, space: Option<Space>) -> Result<Self, FormatError> {
        let world = World::read(fields, space)?;
        let mut axes = axes(fields, &world)?;
        let sizes: Vec<usize> = axes.iter().map(|axis| axis.size).collect();
        let directions = fields.get("spacedirections");
        let colours = take_colours(&mut axes, directions.as_ref())?;
        let frames = match &directions {
            Some(field) => frame_axis_by_direction(field, &axes)?,
            None => frame_axis_by_kind(&axes)?,
        };
        let in_space: Vec<&Axis> = in_space(&axes, frames).collect();
        let space_units = words(fields, "spaceunits");
        let (unit, factors) = lengths(&in_space, &space_units, directions.is_some());
        let placement = match directions {
            Some(_) => {
                let [x, y, z] = columns_from_directions(&in_space);
                DAffine3::from_mat3(DMat3::from_cols(x, y, z))
            }
            None => placement_from_spacings(fields, &in_space)?,
        };
        let affine = DAffine3::from_scale(factors) * affine_of(fields, &world, placement)?;
        let thin = in_space.iter().position(|axis| axis.is_thin());
        Ok(Self { sizes, colours, frames, world, affine, unit, thin, space_units, axes })
    }

    /// Returns the sizes of all axes, in the order of the file.
    pub(super) fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Returns how the colours of the voxels lie in the file, if it has any.
    pub(super) fn colours(&self) -> Option<Colours> {
        self.colours
    }

    /// Returns what a user should know about the axes.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        let thin = self.thin.map(thickness_warning);
        self.world.warning().into_iter().chain(self.colours.map(Colours::warning)).chain(thin).collect()
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

    /// Returns the unit of length of the world; unknown if the file does not tell, or if it is not metres, millimetres or
    /// micrometres.
    pub(super) fn unit(&self) -> LengthUnit {
        self.unit
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

/// Takes the axis of colours out of the axes, if there is one, and returns how the colours lie.
fn take_colours(
    axes: &mut Vec<Axis>,
    directions: Option<&Field<'_>>,
) -> Result<Option<Colours>, FormatError> {
    let Some(at) = axes.iter().position(|axis| axis.kind == AxisKind::Colour) else { return Ok(None) };
    let run = axes[..at].iter().map(|axis| axis.size).fold(1, usize::saturating_mul);
    let axis = axes.remove(at);
    match directions {
        Some(field) if axis.direction.is_some() => Err(field.invalid("an axis of colours has no direction")),
        _ if axes.is_empty() => Err(FormatError::invalid(FORMAT, "kinds", "must have an axis in space")),
        _ => Ok(Some(Colours { channels: axis.size, run })),
    }
}

/// Returns the unit of length of the world, and the factors by which lengths along its axes are converted to it: 1, unless
/// the axes have different units, which become millimetres.
fn lengths(axes: &[&Axis], space_units: &[String], has_directions: bool) -> (LengthUnit, DVec3) {
    let names: Vec<&str> = match space_units {
        [] => axes.iter().map(|axis| axis.unit.as_str()).collect(),
        _ => axes.iter().zip(space_units).map(|(_, unit)| unit.as_str()).collect(),
    };
    let known: Option<Vec<f64>> = names.iter().map(|name| metres(name)).collect();
    let Some(known) = known.filter(|known| !known.is_empty()) else {
        return (LengthUnit::Unknown, DVec3::ONE);
    };
    if known.iter().all(|&length| length == known[0]) {
        return (unit_of(known[0]), DVec3::ONE);
    }
    // Directions are in units of the world, so that those of axes say nothing about them.
    if has_directions && space_units.is_empty() {
        return (LengthUnit::Unknown, DVec3::ONE);
    }
    let mut factors = [known[0] * 1e3; 3];
    for (factor, length) in factors.iter_mut().zip(&known) {
        *factor = length * 1e3;
    }
    (LengthUnit::Millimetre, factors.into())
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
        // A channel, of which there is one, before those of a volume.
        [0, .., last] if last == 3 && axes[0].size == 1 && axes[last].size > 1 => Ok(Some(0)),
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
/// missing axes, and those with a single slice of no thickness, get unit vectors perpendicular to the others.
fn columns_from_directions(axes: &[&Axis]) -> [DVec3; 3] {
    let direction = |axis: usize| axes.get(axis).filter(|axis| !axis.is_thin())?.direction.map(|v| v.space);
    let columns = [direction(0), direction(1), direction(2)];
    let normal = |a: DVec3, b: DVec3| a.cross(b).normalize_or_zero();
    match columns {
        [Some(x), Some(y), Some(z)] => [x, y, z],
        [Some(x), Some(y), None] => [x, y, normal(x, y)],
        [Some(x), None, Some(z)] => [x, normal(z, x), z],
        [None, Some(y), Some(z)] => [normal(y, z), y, z],
        [Some(x), None, None] => {
            let (y, z) = x.normalize_or_zero().any_orthonormal_pair();
            [x, y, z]
        }
        _ => [DVec3::ZERO; 3],
    }
}

/// Returns the affine map from voxel index to world for a file without directions: along the world axes, with the lengths
/// in `spacings`, or 1 if those are missing or NaN, from `axis mins` on, or from 0.
fn placement_from_spacings(fields: &Fields, axes: &[&Axis]) -> Result<DAffine3, FormatError> {
    let (mut lengths, mut origin) = ([1.0; 3], [0.0; 3]);
    for ((length, start), axis) in lengths.iter_mut().zip(&mut origin).zip(axes) {
        *length = length_of(fields, axis)?;
        let [min, _] = axis.ends;
        if !min.is_nan() {
            // Unless the file says that the first sample is there, a cell begins there, as in teem and ITK.
            *start = if axis.is_node == Some(true) { min } else { min + 0.5 * *length };
        }
    }
    let field = fields.get("spacings").or_else(|| fields.get("axismins"));
    match field {
        Some(field) if lengths.iter().any(|&l| l == 0.0 || !l.is_finite()) => {
            Err(field.invalid("must be finite and not 0"))
        }
        Some(field) if origin.iter().any(|v| !v.is_finite()) => Err(field.invalid("must be finite")),
        _ => Ok(DAffine3::from_translation(origin.into()) * DAffine3::from_scale(lengths.into())),
    }
}

/// Returns the distance between samples of an axis: that of `spacings`, or that which the ends of the axis give, or 1.
fn length_of(fields: &Fields, axis: &Axis) -> Result<f64, FormatError> {
    let ([min, max], size) = (axis.ends, axis.size as f64);
    if !axis.spacing.is_nan() {
        return Ok(if axis.is_thin() { 1.0 } else { axis.spacing });
    }
    match (fields.get("axismaxs"), axis.is_node) {
        (Some(_), _) if max.is_nan() => Ok(1.0),
        (Some(_), Some(true)) if size == 1.0 => Ok(1.0),
        (Some(_), Some(true)) if !min.is_nan() => Ok((max - min) / (size - 1.0)),
        (Some(_), Some(false)) if !min.is_nan() => Ok((max - min) / size),
        (Some(field), _) => {
            let accepted = "spacings, space directions, or axis mins and axis maxs with centers";
            Err(FormatError::unsupported(FORMAT, field.name, "positions by axis ends", accepted))
        }
        (None, _) => Ok(1.0),
    }
}

/// Returns the affine map from voxel index to world with the given placement, moved to the file's origin if it has one; x is
/// flipped if that converts the file's space to RAS or LPS.
fn affine_of(fields: &Fields, world: &World, placement: DAffine3) -> Result<DAffine3, FormatError> {
    let origin = fields.get("spaceorigin").map(|field| world.vector(&field, field.text)).transpose()?;
    let origin = origin.flatten().map(|v| v.space).filter(|v| !v.is_nan()).unwrap_or(placement.translation);
    let affine = DAffine3 { translation: origin, ..placement };
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    Ok(if world.flip_x { mirror * affine } else { affine })
}
