//! Stored voxel values, in the numeric type of the file or the caller.

use super::error::{VolumeError, filled, reserve};
use std::ops::Range;

/// Array of voxel values as stored: x fastest, then y, z and time.
#[derive(Clone, Debug, PartialEq)]
pub enum Voxels {
    /// Unsigned 8-bit integers.
    U8(Vec<u8>),
    /// Signed 8-bit integers.
    I8(Vec<i8>),
    /// Unsigned 16-bit integers.
    U16(Vec<u16>),
    /// Signed 16-bit integers.
    I16(Vec<i16>),
    /// Unsigned 32-bit integers.
    U32(Vec<u32>),
    /// Signed 32-bit integers.
    I32(Vec<i32>),
    /// 32-bit floating point.
    F32(Vec<f32>),
    /// 64-bit floating point.
    F64(Vec<f64>),
}

/// Evaluates an expression with `$values` bound to the typed vector inside `$voxels`, whatever its numeric type.
macro_rules! each {
    ($voxels:expr, $values:ident => $body:expr) => {
        match $voxels {
            Voxels::U8($values) => $body,
            Voxels::I8($values) => $body,
            Voxels::U16($values) => $body,
            Voxels::I16($values) => $body,
            Voxels::U32($values) => $body,
            Voxels::I32($values) => $body,
            Voxels::F32($values) => $body,
            Voxels::F64($values) => $body,
        }
    };
}
pub(crate) use each;

/// Evaluates an expression to a vector of numbers of the type of the vector inside `$voxels`, bound to `$values`, and
/// returns it as [`Voxels`] of that type.
macro_rules! map_each {
    ($voxels:expr, $values:ident => $body:expr) => {
        match $voxels {
            Voxels::U8($values) => Voxels::U8($body),
            Voxels::I8($values) => Voxels::I8($body),
            Voxels::U16($values) => Voxels::U16($body),
            Voxels::I16($values) => Voxels::I16($body),
            Voxels::U32($values) => Voxels::U32($body),
            Voxels::I32($values) => Voxels::I32($body),
            Voxels::F32($values) => Voxels::F32($body),
            Voxels::F64($values) => Voxels::F64($body),
        }
    };
}
pub(crate) use map_each;

/// Evaluates an expression with `$a` and `$b` bound to the typed vectors inside a pair of [`Voxels`] of one type, or
/// `$otherwise` if their types differ.
macro_rules! each_pair {
    ($pair:expr, ($a:ident, $b:ident) => $body:expr, $otherwise:expr) => {
        match $pair {
            (Voxels::U8($a), Voxels::U8($b)) => $body,
            (Voxels::I8($a), Voxels::I8($b)) => $body,
            (Voxels::U16($a), Voxels::U16($b)) => $body,
            (Voxels::I16($a), Voxels::I16($b)) => $body,
            (Voxels::U32($a), Voxels::U32($b)) => $body,
            (Voxels::I32($a), Voxels::I32($b)) => $body,
            (Voxels::F32($a), Voxels::F32($b)) => $body,
            (Voxels::F64($a), Voxels::F64($b)) => $body,
            _ => $otherwise,
        }
    };
}

/// The number of voxels that are converted at a time: they stay in the fastest cache, and the choice of the type takes no
/// time.
const PART: usize = 1024;

fn extend<T: Copy + Into<f64>>(out: &mut Vec<f64>, values: &[T]) {
    out.extend(values.iter().map(|&value| value.into()));
}

/// A number type in which voxels are stored.
pub(crate) trait VoxelNumber: Copy + PartialOrd + Into<f64> {
    /// Returns the number of this type nearest to `value`: integer types round ties away from zero, clamp to their
    /// range, and give 0 for NaN.
    fn nearest(value: f64) -> Self;
}

macro_rules! integer_voxels {
    ($($number:ty),+) => { $(
        impl VoxelNumber for $number {
            fn nearest(value: f64) -> Self {
                // `as` saturates at the ends of the type's range.
                value.round() as $number
            }
        }
    )+ };
}
integer_voxels!(u8, i8, u16, i16, u32, i32);

impl VoxelNumber for f32 {
    fn nearest(value: f64) -> Self {
        value as f32
    }
}

impl VoxelNumber for f64 {
    fn nearest(value: f64) -> Self {
        value
    }
}

const fn element_size<T>(_: &[T]) -> usize {
    size_of::<T>()
}

impl Voxels {
    /// Returns the number of voxels.
    pub fn len(&self) -> usize {
        each!(self, values => values.len())
    }

    /// Returns the number of bytes of a voxel.
    pub(super) fn voxel_bytes(&self) -> usize {
        each!(self, values => element_size(values))
    }

    /// Returns whether there are no voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the stored value at `index` as `f64`, or `None` past the end.
    pub fn get(&self, index: usize) -> Option<f64> {
        each!(self, values => number_at(values, index))
    }

    /// Replaces `out` by the stored values with the given indices, as `f64`.
    pub(crate) fn read(&self, indices: Range<usize>, out: &mut Vec<f64>) {
        out.clear();
        each!(self, values => extend(out, &values[indices]));
    }

    /// Calls `visit` with the stored values of the given indices as `f64`, in order, [`PART`] at a time. So a loop over
    /// voxels is compiled once, not for each type.
    pub(crate) fn for_each_part(&self, indices: Range<usize>, mut visit: impl FnMut(&[f64])) {
        let mut part = Vec::with_capacity(PART);
        for start in indices.clone().step_by(PART) {
            self.read(start..indices.end.min(start + PART), &mut part);
            visit(&part);
        }
    }

    /// Returns the size of a stored value in bytes.
    pub(crate) fn number_size(&self) -> usize {
        match self {
            Voxels::U8(_) | Voxels::I8(_) => 1,
            Voxels::U16(_) | Voxels::I16(_) => 2,
            Voxels::U32(_) | Voxels::I32(_) | Voxels::F32(_) => 4,
            Voxels::F64(_) => 8,
        }
    }

    /// Returns stored values in single precision.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn as_f32(&self, indices: Range<usize>) -> Result<Vec<f32>, VolumeError> {
        let mut out = reserve(indices.len())?;
        each!(self, values => extend_by_f32(&mut out, &values[indices]));
        Ok(out)
    }

    /// Returns the smallest and largest finite stored value, or `None` if no value is finite.
    pub(crate) fn finite_range(&self) -> Option<[f64; 2]> {
        each!(self, values => finite_range(values))
    }

    /// Returns the number of finite stored values.
    pub(crate) fn finite_count(&self) -> usize {
        each!(self, values => finite_count(values))
    }

    /// Returns whether any stored value equals `value`, which must be one that this type can store.
    pub(crate) fn contains(&self, value: f64) -> bool {
        each!(self, values => contains(values, value))
    }

    /// Converts `values` to the voxel type of `self`; for integer types, values are rounded and clamped to the range of
    /// the type, and NaN becomes 0.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn like(&self, values: &[f64]) -> Result<Voxels, VolumeError> {
        Ok(map_each!(self, stored => converted_like(stored, values)?))
    }

    /// Returns the voxels in the ranges of indices `runs`, one range after another; `count` is their number in all.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn gathered(
        &self,
        count: usize,
        runs: impl Iterator<Item = Range<usize>>,
    ) -> Result<Voxels, VolumeError> {
        Ok(map_each!(self, values => {
            let mut out = reserve(count)?;
            runs.for_each(|run| out.extend_from_slice(&values[run]));
            out
        }))
    }

    /// Copies voxels of the same type, in order, to the ranges of indices `runs`, as many as there are; returns `false`,
    /// and changes nothing, if the types differ.
    pub(crate) fn overwrite(&mut self, runs: impl Iterator<Item = Range<usize>>, data: &Voxels) -> bool {
        each_pair!((self, data), (to, from) => {
            let mut rest = from.as_slice();
            for run in runs {
                let (row, after) = rest.split_at(run.len());
                to[run].copy_from_slice(row);
                rest = after;
            }
            true
        }, false)
    }

    /// Returns a copy.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn try_clone(&self) -> Result<Voxels, VolumeError> {
        self.gathered(self.len(), std::iter::once(0..self.len()))
    }

    /// Returns the name of the number type, for error messages.
    pub(crate) fn type_name(&self) -> &'static str {
        match self {
            Voxels::U8(_) => "unsigned 8-bit integers",
            Voxels::I8(_) => "signed 8-bit integers",
            Voxels::U16(_) => "unsigned 16-bit integers",
            Voxels::I16(_) => "signed 16-bit integers",
            Voxels::U32(_) => "unsigned 32-bit integers",
            Voxels::I32(_) => "signed 32-bit integers",
            Voxels::F32(_) => "32-bit floats",
            Voxels::F64(_) => "64-bit floats",
        }
    }

    /// Appends voxels of the same type; returns `false`, and changes nothing, if the types differ.
    fn append(&mut self, other: &Voxels) -> bool {
        each_pair!((self, other), (to, from) => {
            to.extend_from_slice(from);
            true
        }, false)
    }

    /// Returns an empty array of the same type with capacity for `count` voxels.
    fn empty_like(&self, count: usize) -> Result<Voxels, VolumeError> {
        self.gathered(count, std::iter::empty())
    }

    /// Returns an array of the same type with `count` voxels of the value 0.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn zeros_like(&self, count: usize) -> Result<Voxels, VolumeError> {
        Ok(map_each!(self, stored => zeros(stored, count)?))
    }

    /// Concatenates arrays of voxels of one type (the frames of a sequence); `None` if their types differ or `parts` is
    /// empty.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn concatenate(parts: &[&Voxels]) -> Result<Option<Voxels>, VolumeError> {
        let Some(first) = parts.first() else { return Ok(None) };
        let count = parts.iter().map(|part| part.len()).fold(0usize, usize::saturating_add);
        let mut all = first.empty_like(count)?;
        Ok(parts.iter().all(|part| all.append(part)).then_some(all))
    }
}

fn number_at<T: Copy + Into<f64>>(values: &[T], index: usize) -> Option<f64> {
    values.get(index).map(|&v| v.into())
}

fn finite_count<T: VoxelNumber>(values: &[T]) -> usize {
    values.iter().filter(|&&v| v.into().is_finite()).count()
}

fn contains<T: VoxelNumber>(values: &[T], value: f64) -> bool {
    values.contains(&T::nearest(value))
}

/// Returns `count` zeros of the number type of `_stored`.
fn zeros<T: VoxelNumber>(_stored: &[T], count: usize) -> Result<Vec<T>, VolumeError> {
    filled(count, T::nearest(0.0))
}

/// Converts `values` to the number type of `_stored`.
fn converted_like<T: VoxelNumber>(_stored: &[T], values: &[f64]) -> Result<Vec<T>, VolumeError> {
    let mut out = reserve(values.len())?;
    out.extend(values.iter().map(|&value| T::nearest(value)));
    Ok(out)
}

fn extend_by_f32<T: Copy + Into<f64>>(out: &mut Vec<f32>, values: &[T]) {
    out.extend(values.iter().map(|&value| value.into() as f32));
}

fn finite_range<T: VoxelNumber>(values: &[T]) -> Option<[f64; 2]> {
    let is_finite = |v: T| v.into().is_finite();
    let first = values.iter().copied().find(|&v| is_finite(v))?;
    let (mut low, mut high) = (first, first);
    // Without branches, which keeps the loop vectorisable.
    for &v in values {
        low = if is_finite(v) && v < low { v } else { low };
        high = if is_finite(v) && v > high { v } else { high };
    }
    Some([low.into(), high.into()])
}
