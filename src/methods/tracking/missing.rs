//! Voxels without a value: what tracking takes them for.

use crate::methods::MethodError;
use crate::volume::{Grid, Region, Volume, Voxels};

/// Share of the range of intensities up to which those next to voxels without a value are among the darkest: noise in a
/// background reaches a tenth, and the values of an object without one are above it on average.
const DARKEST: f64 = 0.25;

/// Share of the mean intensity, above the least, from which those next to voxels without a value are typical of an object:
/// the blurred rim of one, beyond which values are missing, is at a half.
const TYPICAL: f64 = 0.7;

/// The meaning of voxels without a value. None of them is in an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Missing {
    /// The background of the objects: those next to them are as bright as others, and the step to them is a boundary.
    Background,
    /// Voxels of the background of the image that were masked, as dark as this intensity: the step to them counts for
    /// nothing beside dark voxels.
    Masked(f64),
}

impl Missing {
    /// Returns the intensity that stands for them, and the lower end of the range of intensities with it, given that without it.
    pub fn intensity(self, [from, to]: [f64; 2]) -> [f64; 2] {
        match self {
            // The step from the background to the darkest voxels is as large as all others together.
            Self::Background => [f64::NEG_INFINITY, from - if to > from { to - from } else { 1.0 }],
            Self::Masked(dark) => [dark, from],
        }
    }
}

/// Returns a part of a frame with intensities in 0..1, the range of the volume, and NaN for voxels without a value.
///
/// # Errors
/// [`MethodError::Volume`] if memory does not suffice.
pub(super) fn read(volume: &Volume, part: Region, frame: usize) -> Result<Grid, MethodError> {
    let is_all = part.dims == volume.dims();
    let mut grid =
        if is_all { volume.normalised_grid(frame) } else { volume.normalised_region(part, frame) }?;
    if !matches!(volume.voxels(), Voxels::F32(_) | Voxels::F64(_)) {
        return Ok(grid);
    }
    let start = frame * volume.dims().iter().product::<usize>();
    for (value, voxel) in grid.values.iter_mut().zip(part.rows(volume.dims(), start).flatten()) {
        if lacks_value(volume, voxel) {
            *value = f32::NAN;
        }
    }
    Ok(grid)
}

/// Returns whether a voxel has no value: NaN, or negative infinity.
fn lacks_value(volume: &Volume, index: usize) -> bool {
    let stored = volume.voxels().get(index).unwrap_or(f64::NAN);
    let value = stored * volume.slope() + volume.intercept();
    value.is_nan() || value == f64::NEG_INFINITY
}

/// The intensities of the voxels beside those without a value, which tell what these are.
pub(super) struct Beside {
    /// The quantiles of all intensities.
    range: [f64; 2],
    beside: Mean,
    /// Those beside that are among the darkest.
    dark: Mean,
    all: Mean,
}

impl Beside {
    pub fn new(range: [f64; 2]) -> Self {
        let [beside, dark, all] = [Mean::default(); 3];
        Self { range, beside, dark, all }
    }

    /// Adds the voxels of a frame.
    pub fn add(&mut self, values: &[f32], dims: [usize; 3]) {
        if !values.iter().any(|value| value.is_nan()) {
            return;
        }
        let [from, to] = self.range;
        for (i, &value) in values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            let value = f64::from(value);
            self.all.add(value);
            if is_beside_missing(values, dims, i) {
                self.beside.add(value);
                if value - from < DARKEST * (to - from) {
                    self.dark.add(value);
                }
            }
        }
    }

    /// Returns what the voxels without a value are.
    pub fn missing(&self) -> Missing {
        let [from, to] = self.range;
        let (Some(typical), Some(mean)) = (self.beside.get(), self.all.get()) else {
            return Missing::Masked(from);
        };
        let [typical, mean] = [typical, mean].map(|mean| mean - from);
        if to <= from || typical > DARKEST * (to - from) && typical > TYPICAL * mean {
            return Missing::Background;
        }
        // Otherwise they are the blurred rims of objects.
        let are_dark = 2.0 * self.dark.count >= self.beside.count;
        Missing::Masked(self.dark.get().filter(|_| are_dark).unwrap_or(from))
    }
}

fn is_beside_missing(values: &[f32], [nx, ny, nz]: [usize; 3], index: usize) -> bool {
    let at = [index % nx, index / nx % ny, index / (nx * ny)];
    (0..3).any(|k| {
        let step = [1, nx, nx * ny][k];
        at[k] > 0 && values[index - step].is_nan()
            || at[k] + 1 < [nx, ny, nz][k] && values[index + step].is_nan()
    })
}

/// A mean of numbers that are added one by one.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1.0;
    }

    /// Returns the mean; `None` without numbers.
    fn get(self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }
}
