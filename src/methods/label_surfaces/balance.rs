//! Volumes: smoothing takes away from what is convex and thin, and this gives it back.
//!
//! With all positions in the middle of their cells, each label has exactly the volume of its voxels. The difference that
//! the positions make is measured around each cell, averaged over cells nearby, and removed by a displacement along the
//! normal. The average is wide enough for the steps of slanted surfaces, whose differences cancel out, to stay smooth.

use super::zone::{Polygon, Zone, within_reach};
use crate::math::Vec3;
use crate::pauses::Pauses;
use std::ops::{Add, Div, Sub};
use wide::f32x4;

/// Number of times that differences are averaged over neighbouring cells; the width of the average, a standard
/// deviation, is about the root of half of it, in voxels.
const AVERAGES: usize = 24;
/// Share of the difference to each neighbour that a cell adopts in one average; below one sixth, which keeps it stable.
const SHARE: f32 = 1.0 / 7.0;
/// Share of each cell of a polygon in which two labels meet, by their number.
const SHARES: [f32; 5] = [1.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0];
/// Number of cells whose part in one average counts as a unit of work.
const CELLS_AVERAGED: usize = 64;
/// Number of polygons that are measured between two pauses.
pub const POLYGONS: usize = 1024;
/// Largest displacement at once, in voxels.
pub const MOST: f32 = 0.25;

/// The surface around a cell in which two labels meet.
#[derive(Clone, Copy, Debug, Default)]
struct Around {
    /// Volume that the label of the lower number has gained, in voxels, and the amount of surface that it is spread
    /// over, in square voxels.
    gain: [f32; 2],
    /// Sum of the areas of the polygons, normal to them, away from the label of the lower number.
    area: Vec3,
}

impl Zone {
    /// Moves the cells so that volumes are nearer those of the voxels.
    pub async fn balance(&mut self, pauses: &Pauses) {
        let around = self.measure_around(pauses).await;
        let mut gains: Vec<[f32; 2]> = around.iter().map(|around| around.gain).collect();
        let mut next = gains.clone();
        for _ in 0..AVERAGES {
            average(&gains, &mut next, &self.alike);
            std::mem::swap(&mut gains, &mut next);
            pauses.after(gains.len() / CELLS_AVERAGED).await;
        }
        for (i, (around, [gain, size])) in around.iter().zip(gains).enumerate() {
            if size > 0.0 {
                let shift = around.area.normalize_or_zero() * (gain / size).clamp(-MOST, MOST);
                self.offsets[i] = within_reach(self.offsets[i] - shift);
            }
        }
        pauses.after(around.len() / CELLS_AVERAGED).await;
    }

    /// Shares the gain and the area of each polygon among those of its cells in which two labels meet.
    async fn measure_around(&self, pauses: &Pauses) -> Vec<Around> {
        let mut around = vec![Around::default(); self.moving()];
        for polygons in self.polygons.chunks(POLYGONS) {
            for four in polygons.chunks(4) {
                let measures = measure_four(four.iter().map(|polygon| self.corners(polygon)));
                for (polygon, (gain, area, size)) in four.iter().zip(measures) {
                    polygon.share(gain, area, size, &mut around);
                }
            }
            pauses.after(POLYGONS / CELLS_AVERAGED).await;
        }
        around
    }
}

/// Returns for each of up to four polygons the volume that it has swept since its corners, given with their displacements,
/// were in the middle of their cells, its area, normal to it, and the size of that.
#[inline]
pub fn measure_four(polygons: impl Iterator<Item = [(Vec3, Vec3); 4]>) -> [(f32, Vec3, f32); 4] {
    let [mut middles, mut offsets] = [[[[0.0; 4]; 3]; 4]; 2];
    for (lane, corners) in polygons.take(4).enumerate() {
        for (k, (middle, offset)) in corners.into_iter().enumerate() {
            for axis in 0..3 {
                middles[k][axis][lane] = middle[axis];
                offsets[k][axis][lane] = offset[axis];
            }
        }
    }
    let (middles, offsets) = (middles.map(Four::new), offsets.map(Four::new));
    let points = [0, 1, 2, 3].map(|k| middles[k] + offsets[k]);
    let across = [points[1] - points[3], points[0] - points[2]].map(|way| way.dot(way));
    let is_other = across[0].simd_lt(across[1]);
    // The halves, as `halves` divides a quadrilateral.
    let swept = |k: [usize; 3], other: [usize; 3]| {
        let select = |corners: &[Four; 4], i: usize| corners[other[i]].or(corners[k[i]], is_other);
        let [a, b, c] = [0, 1, 2].map(|i| select(&middles, i));
        let [da, db, dc] = [0, 1, 2].map(|i| select(&offsets, i));
        let [p, q, r] = [0, 1, 2].map(|i| select(&points, i));
        let (u, v, du, dv) = (b - a, c - a, db - da, dc - da);
        let normal = [u.cross(v), u.cross(dv) + du.cross(v), du.cross(dv)];
        let mean = (da + db + dc) / 6.0;
        let volume = mean.dot(normal[0] + normal[1] / 2.0 + normal[2] / 3.0);
        (volume, (q - p).cross(r - p) / 2.0)
    };
    let [one, two] = [swept([0, 1, 2], [0, 1, 3]), swept([0, 2, 3], [1, 2, 3])];
    let (gain, area) = (one.0 + two.0, one.1 + two.1);
    let (gain, size) = (gain.to_array(), area.dot(area).sqrt().to_array());
    let area = area.0.map(f32x4::to_array);
    [0, 1, 2, 3].map(|lane| (gain[lane], Vec3::from(area.map(|lanes| lanes[lane])), size[lane]))
}

impl Polygon {
    /// Adds a polygon's share to each of those of its cells in which two labels meet.
    #[inline]
    fn share(&self, gain: f32, area: Vec3, size: f32, around: &mut [Around]) {
        let share = SHARES[self.pairs.count_ones() as usize];
        for (k, &i) in self.cells.iter().enumerate() {
            if self.pairs >> k & 1 == 1
                && let Some(found) = around.get_mut(i as usize)
            {
                found.gain[0] += gain * share;
                found.gain[1] += size * share;
                found.area += area * share;
            }
        }
    }
}

/// Vectors of four polygons. Operations have the order of those of `Vec3`, so that they give the same bits.
#[derive(Clone, Copy)]
struct Four([f32x4; 3]);

impl Four {
    #[inline]
    fn new(axes: [[f32; 4]; 3]) -> Self {
        Self(axes.map(f32x4::from))
    }

    #[inline]
    fn dot(self, other: Self) -> f32x4 {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        x * a + y * b + z * c
    }

    #[inline]
    fn cross(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([y * c - b * z, z * a - c * x, x * b - a * y])
    }

    /// Returns `self` where `is_self` is set, `other` elsewhere.
    #[inline]
    fn or(self, other: Self, is_self: f32x4) -> Self {
        Self([0, 1, 2].map(|axis| is_self.select(self.0[axis], other.0[axis])))
    }
}

impl Add for Four {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self([0, 1, 2].map(|axis| self.0[axis] + other.0[axis]))
    }
}

impl Sub for Four {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self([0, 1, 2].map(|axis| self.0[axis] - other.0[axis]))
    }
}

impl Div<f32> for Four {
    type Output = Self;

    #[inline]
    fn div(self, by: f32) -> Self {
        Self(self.0.map(|lanes| lanes / f32x4::splat(by)))
    }
}

/// Returns gains averaged with those of neighbours, which `links` name for each, again and again. What one gives, another
/// one gets, so that sums are kept.
pub fn averaged(mut gains: Vec<[f32; 2]>, links: &[[u32; 6]]) -> Vec<[f32; 2]> {
    let mut next = gains.clone();
    for _ in 0..AVERAGES {
        average(&gains, &mut next, links);
        std::mem::swap(&mut gains, &mut next);
    }
    gains
}

/// Averages gains with those of neighbours once.
fn average(gains: &[[f32; 2]], next: &mut [[f32; 2]], links: &[[u32; 6]]) {
    let average = |links: [&[u32; 6]; 2], own: [[f32; 2]; 2]| {
        let pair = |[[a, b], [c, d]]: [[f32; 2]; 2]| f32x4::from([a, b, c, d]);
        let own = pair(own);
        let mut sum = own;
        for k in 0..6 {
            let other = pair(links.map(|links| gains[links[k] as usize]));
            sum += (other - own) * f32x4::splat(SHARE);
        }
        let [a, b, c, d] = sum.to_array();
        [[a, b], [c, d]]
    };
    // Two at once.
    let (pairs, last) = next.as_chunks_mut::<2>();
    let whole = pairs.len() * 2;
    for ((next, own), links) in pairs.iter_mut().zip(gains.chunks_exact(2)).zip(links.chunks_exact(2)) {
        *next = average([&links[0], &links[1]], [own[0], own[1]]);
    }
    if let ([next], [own], [links]) = (last, &gains[whole..], &links[whole..]) {
        [*next, _] = average([links; 2], [*own; 2]);
    }
}
