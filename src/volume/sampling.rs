//! Trilinear interpolation on a grid with a replicated border.

use crate::math::{DVec3, Vec3};
use std::ops::{Add, Mul, Sub};

/// The eight voxels around a point, for trilinear interpolation: the index of the voxel with the lowest coordinates,
/// the index step to the next one along each axis (0 at the last voxel), and the fractional position along each axis.
pub(super) struct Cell {
    base: usize,
    step: [usize; 3],
    fraction: [f32; 3],
}

impl Cell {
    /// Returns the cell around `p`, in continuous voxel indices, clamped to the border if `p` is outside (and to the
    /// first voxel if it is NaN).
    #[inline]
    pub(super) fn at(dims: [usize; 3], p: Vec3) -> Self {
        let (x, fx) = locate(p.x, dims[0]);
        let (y, fy) = locate(p.y, dims[1]);
        let (z, fz) = locate(p.z, dims[2]);
        let [row, plane] = [dims[0], dims[0] * dims[1]];
        Self {
            base: x + y * row + z * plane,
            step: [
                if x + 1 < dims[0] { 1 } else { 0 },
                if y + 1 < dims[1] { row } else { 0 },
                if z + 1 < dims[2] { plane } else { 0 },
            ],
            fraction: [fx, fy, fz],
        }
    }

    /// Returns the index of the voxel with the lowest coordinates, which identifies the cell.
    #[inline]
    pub(super) fn base(&self) -> usize {
        self.base
    }

    /// Evaluates `value` at the indices of the cell's eight voxels, x fastest.
    #[inline]
    pub(super) fn corners<T>(&self, value: impl Fn(usize) -> T) -> [T; 8] {
        let [sx, sy, sz] = self.step;
        let [a, b] = [self.base, self.base + sz];
        [a, a + sx, a + sy, a + sx + sy, b, b + sx, b + sy, b + sx + sy].map(value)
    }

    /// Interpolates at the cell's point between the eight values returned by [`Self::corners`].
    #[inline]
    pub(super) fn blend<T>(&self, corners: &[T; 8]) -> T
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
    {
        blend(self.fraction, corners)
    }
}

/// Interpolates between the eight values of a cell, x fastest, at a fractional position along each axis.
#[inline]
pub(super) fn blend<T>([fx, fy, fz]: [f32; 3], corners: &[T; 8]) -> T
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
{
    let along_x = |k: usize| mix(corners[k], corners[k + 1], fx);
    mix(mix(along_x(0), along_x(2), fy), mix(along_x(4), along_x(6), fy), fz)
}

#[inline]
fn mix<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>>(a: T, b: T, fraction: f32) -> T {
    a + (b - a) * fraction
}

/// Returns the index of the voxel at or below coordinate `x` on an axis of `n` voxels and the fractional position from
/// it to the next one, with `x` clamped to [0, n-1]. Written with comparisons: `f32::clamp` with variable bounds
/// becomes two function calls in wasm.
#[inline]
pub(super) fn locate(x: f32, n: usize) -> (usize, f32) {
    let last = (n - 1) as f32;
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < last { x } else { last };
    let index = x as usize;
    (index, x - index as f32)
}

/// Returns the value trilinearly interpolated at `p`, in continuous voxel indices, in `f64`; `value` returns the value
/// of a voxel by its index in the frame. Outside the grid the border is replicated.
#[inline]
pub(crate) fn trilinear(dims: [usize; 3], p: DVec3, value: impl Fn(usize) -> f64) -> f64 {
    let [row, plane] = [dims[0], dims[0] * dims[1]];
    let (x, fx) = locate_f64(p.x, dims[0]);
    let (y, fy) = locate_f64(p.y, dims[1]);
    let (z, fz) = locate_f64(p.z, dims[2]);
    let mix = |a: f64, b: f64, fraction: f64| a + (b - a) * fraction;
    let along_x = |start: usize| mix(value(start + x[0]), value(start + x[1]), fx);
    let along_xy = |start: usize| mix(along_x(start + y[0] * row), along_x(start + y[1] * row), fy);
    mix(along_xy(z[0] * plane), along_xy(z[1] * plane), fz)
}

/// Returns the indices of the two voxels around coordinate `x` on an axis of `n` voxels and the fractional position
/// between them, with `x` clamped to [0, n-1].
#[inline]
pub(super) fn locate_f64(x: f64, n: usize) -> ([usize; 2], f64) {
    let last = (n - 1) as f64;
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < last { x } else { last };
    let index = x as usize;
    let next = if index + 1 < n { index + 1 } else { index };
    ([index, next], x - index as f64)
}
