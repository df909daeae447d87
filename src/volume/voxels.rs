//! Stored voxel values, in the numeric type of the file or the caller.

use super::error::{VolumeError, reserve};

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

impl Voxels {
    /// Returns the number of voxels.
    pub fn len(&self) -> usize {
        each!(self, values => values.len())
    }

    /// Returns whether there are no voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the stored value at `index` as `f64`, or `None` past the end.
    pub fn get(&self, index: usize) -> Option<f64> {
        each!(self, values => number_at(values, index))
    }

    /// Returns the smallest and largest finite stored value, or `None` if no value is finite.
    pub(crate) fn finite_range(&self) -> Option<[f64; 2]> {
        each!(self, values => finite_range(values))
    }

    /// Converts `values` to the voxel type of `self`; for integer types, values are rounded and clamped to the range of
    /// the type, and NaN becomes 0.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn like(&self, values: &[f64]) -> Result<Voxels, VolumeError> {
        // `as` saturates at the ends of the type's range.
        macro_rules! whole {
            ($kind:ident, $number:ty) => {{
                let mut out = reserve(values.len())?;
                out.extend(values.iter().map(|v| v.round() as $number));
                Voxels::$kind(out)
            }};
        }
        Ok(match self {
            Voxels::U8(_) => whole!(U8, u8),
            Voxels::I8(_) => whole!(I8, i8),
            Voxels::U16(_) => whole!(U16, u16),
            Voxels::I16(_) => whole!(I16, i16),
            Voxels::U32(_) => whole!(U32, u32),
            Voxels::I32(_) => whole!(I32, i32),
            Voxels::F32(_) => {
                let mut out = reserve(values.len())?;
                out.extend(values.iter().map(|&v| v as f32));
                Voxels::F32(out)
            }
            Voxels::F64(_) => {
                let mut out = reserve(values.len())?;
                out.extend_from_slice(values);
                Voxels::F64(out)
            }
        })
    }

    /// Appends voxels of the same type; returns `false`, and changes nothing, if the types differ.
    fn append(&mut self, other: &Voxels) -> bool {
        match (self, other) {
            (Voxels::U8(to), Voxels::U8(from)) => to.extend_from_slice(from),
            (Voxels::I8(to), Voxels::I8(from)) => to.extend_from_slice(from),
            (Voxels::U16(to), Voxels::U16(from)) => to.extend_from_slice(from),
            (Voxels::I16(to), Voxels::I16(from)) => to.extend_from_slice(from),
            (Voxels::U32(to), Voxels::U32(from)) => to.extend_from_slice(from),
            (Voxels::I32(to), Voxels::I32(from)) => to.extend_from_slice(from),
            (Voxels::F32(to), Voxels::F32(from)) => to.extend_from_slice(from),
            (Voxels::F64(to), Voxels::F64(from)) => to.extend_from_slice(from),
            _ => return false,
        }
        true
    }

    /// Returns an empty array of the same type with capacity for `count` voxels.
    fn empty_like(&self, count: usize) -> Result<Voxels, VolumeError> {
        Ok(match self {
            Voxels::U8(_) => Voxels::U8(reserve(count)?),
            Voxels::I8(_) => Voxels::I8(reserve(count)?),
            Voxels::U16(_) => Voxels::U16(reserve(count)?),
            Voxels::I16(_) => Voxels::I16(reserve(count)?),
            Voxels::U32(_) => Voxels::U32(reserve(count)?),
            Voxels::I32(_) => Voxels::I32(reserve(count)?),
            Voxels::F32(_) => Voxels::F32(reserve(count)?),
            Voxels::F64(_) => Voxels::F64(reserve(count)?),
        })
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

fn finite_range<T: Copy + PartialOrd + Into<f64>>(values: &[T]) -> Option<[f64; 2]> {
    let mut finite = values.iter().copied().filter(|&v| v.into().is_finite());
    let first = finite.next()?;
    let (mut low, mut high) = (first, first);
    for v in finite {
        if v < low {
            low = v;
        }
        if v > high {
            high = v;
        }
    }
    Some([low.into(), high.into()])
}
