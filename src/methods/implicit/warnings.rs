//! Checks of a finished surface against its points, for warnings: points that it is far from, two sheets of points that it lies between,
//! and outliers that it follows.

use crate::math::order::median;
use crate::math::{IVec3, Vec3};
use crate::mesh::TriangleMesh;
use crate::spatial::PointGrid;
use std::collections::BTreeMap;

/// Distance of a point from the surface, in the distance between points and three times their noise, at which the surface does
/// not follow it. Of the two furthest points near each other it is .5 at most on twelve shapes with 60 to 3,000 points and noise
/// of 0 to .02 whose topology is right, and .8 to 2.5 where parts of two points and more are lost.
const FAR: f64 = 0.7;
/// Side of the cells, in the distance between points, whose points are searched for two sheets.
const SIDE: f32 = 12.0;
/// Number of points of which the surface's distances say whether they are of two sheets.
const ENOUGH: usize = 60;
/// Kurtosis of distances below which they are of two sheets. It is 1 for two values that are equally frequent, 1.5 if each of these
/// is scattered by .4 of their distance from the middle, 1.8 for uniform noise, of which one in ten of 60 distances is below 1.65,
/// and one in 150 of 200; 3 for normal noise. On 99 clouds of one sheet, with 100 to 1,200 points and noise of either kind, none
/// is below 1.8.
const TWO_VALUED: f64 = 1.65;
/// Inverse of the share of cells with two sheets from which there is a warning.
const SHARE: usize = 16;
/// Least standard deviation of the distances of two sheets, in the distance between points: that of exact points is less, and has
/// the pattern of the cells of extraction.
const LEAST_DEVIATION: f64 = 0.2;
/// Largest number of points whose distances are evaluated, and of those from which the median spacing is estimated.
const MOST: usize = 10_000;
const SPACING_SAMPLE: usize = 1_000;
/// Distance of a point from the second nearest, in its median or the noise, from which it is scattered. Where points are 16 times
/// as dense on one half of a ball as on the other it is 6 at most.
const SCATTERED: f32 = 8.0;

/// A finished surface and its points, in world units.
pub struct Fit<'a> {
    pub mesh: &'a TriangleMesh,
    pub points: &'a [Vec3],
    /// Distance between points, as of a square grid with their density on the surface.
    pub apart: f64,
    /// Standard deviation of the points from the surface.
    pub noise: f64,
    /// Edge length of the cells of the surface.
    pub cell: f64,
}

/// Points that the surface follows though they are far from all others: their number, and one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    pub count: usize,
    pub point: Vec3,
}

/// Findings about a surface, for warnings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Findings {
    /// One of several points that the surface is far from.
    pub unreached: Option<Vec3>,
    /// A point where the surface lies between two sheets of points.
    pub between_sheets: Option<Vec3>,
    pub scattered: Option<Scattered>,
}

impl Fit<'_> {
    /// Returns a point that the surface is far from, if another such point is near it: far beside their distance from each other
    /// and their noise.
    pub fn unreached(&self) -> Option<Vec3> {
        let far = (FAR * (self.apart + 3.0 * self.noise)).max(self.cell) as f32;
        if self.mesh.positions.is_empty() || !far.is_finite() {
            return None;
        }
        let surface = PointGrid::of(&self.mesh.positions, far);
        let points: Vec<Vec3> =
            self.points.iter().copied().filter(|&p| !surface.has_within(p, far)).collect();
        let near = 2.0 * self.apart as f32;
        let unreached = PointGrid::of(&points, near);
        points.iter().copied().find(|&p| has_neighbours(&unreached, p, near, 1))
    }

    /// Returns a point where the surface lies between two sheets of points, or on one of them with the other beside it: its
    /// distances from the points there have two values, as noise has not.
    pub fn between_sheets(&self) -> Option<Vec3> {
        let normals = self.mesh.normals.as_ref()?;
        let reach = 2.0 * self.apart as f32;
        if self.mesh.positions.is_empty() || !(reach.is_finite() && reach > 0.0) {
            return None;
        }
        let surface = PointGrid::of(&self.mesh.positions, reach);
        let step = self.points.len().div_ceil(MOST).max(1);
        let mut cells: BTreeMap<[i32; 3], Vec<(f64, Vec3)>> = BTreeMap::new();
        for &p in self.points.iter().step_by(step) {
            let Some(nearest) = nearest_within(&surface, p, reach) else { continue };
            let offset = p.as_dvec3() - self.mesh.positions[nearest as usize].as_dvec3();
            let distance = offset.dot(normals[nearest as usize].as_dvec3());
            let cell: IVec3 = (p / (SIDE * self.apart as f32 * (step as f32).sqrt())).floor().as_ivec3();
            cells.entry(cell.to_array()).or_default().push((distance, p));
        }
        if cells.values().all(|cell| cell.len() < ENOUGH) {
            let all = std::mem::take(&mut cells).into_values().flatten().collect();
            cells.insert([0; 3], all);
        }
        let cells: Vec<_> = cells.into_values().filter(|cell| cell.len() >= ENOUGH).collect();
        let least = LEAST_DEVIATION * self.apart;
        let mut with_two = cells.iter().filter(|cell| are_two_valued(cell, least)).peekable();
        let (_, first) = *with_two.peek()?.first()?;
        (SHARE * with_two.count() >= cells.len()).then_some(first)
    }

    /// Returns the points that the surface follows though they are far from all but one other, if there are any: outliers.
    pub fn scattered(&self) -> Option<Scattered> {
        let usual = self.median_spacing()?;
        let noise = self.noise as f32;
        let far = SCATTERED * if usual > noise { usual } else { noise };
        if self.mesh.positions.is_empty() || !(far.is_finite() && far > 0.0) {
            return None;
        }
        let points = PointGrid::of(self.points, far);
        // Finer than its radius: it has many more vertices.
        let surface = PointGrid::of(&self.mesh.positions, far / 4.0);
        let (others, mut followed): (Vec<Vec3>, Vec<Vec3>) =
            self.points.iter().partition(|&&p| has_neighbours(&points, p, far, 2));
        // Where points get sparser by and by, those beside them are about as far from each other.
        let others = PointGrid::of(&others, far);
        if !followed.iter().any(|&p| stands_out(p, &others)) {
            return None;
        }
        followed.retain(|&p| surface.has_within(p, far / 2.0));
        Some(Scattered { count: followed.len(), point: *followed.first()? })
    }

    /// Returns the median distance of a point from the second nearest one.
    fn median_spacing(&self) -> Option<f32> {
        let grid = PointGrid::of(self.points, self.apart as f32);
        let step = self.points.len().div_ceil(SPACING_SAMPLE).max(1);
        let second = |&p: &Vec3| grid.nearest(p, 3, self.apart as f32).get(2).map(|found| found.0.sqrt());
        median(self.points.iter().step_by(step).filter_map(second))
    }
}

/// Tests whether a point of the grid has `count` others within a radius.
fn has_neighbours(grid: &PointGrid, p: Vec3, radius: f32, count: usize) -> bool {
    let mut found = 0;
    grid.within(p, radius, |_, _| {
        found += 1;
        found <= count
    });
    found > count
}

/// Returns the index of the nearest point to `p` within a radius, of several the first.
fn nearest_within(grid: &PointGrid, p: Vec3, radius: f32) -> Option<u32> {
    let mut nearest: Option<(f32, u32)> = None;
    grid.within(p, radius, |i, squared| {
        if nearest.is_none_or(|least| (squared, i) < least) {
            nearest = Some((squared, i));
        }
        true
    });
    nearest.map(|(_, i)| i)
}

/// Tests whether the nearest of the other points to `p` has two more at less than a quarter of the distance.
fn stands_out(p: Vec3, others: &PointGrid) -> bool {
    let nearest = others.nearest(p, 1, others.cell());
    let Some(&(squared, i)) = nearest.first() else { return false };
    // Not the points within that distance, which is as large as the outlier is far: they are in any number of cells.
    let about = others.nearest(others.points()[i as usize], 3, others.cell());
    about.get(2).is_some_and(|&(third, _)| 16.0 * third < squared)
}

/// Tests whether distances are of two values, and their standard deviation is at least `least`.
fn are_two_valued(cell: &[(f64, Vec3)], least: f64) -> bool {
    let count = cell.len() as f64;
    let mean = cell.iter().map(|(distance, _)| distance).sum::<f64>() / count;
    let squares = || cell.iter().map(|(distance, _)| (distance - mean) * (distance - mean));
    let variance = squares().sum::<f64>() / count;
    let fourth = squares().map(|square| square * square).sum::<f64>() / count;
    variance > least * least && fourth < TWO_VALUED * variance * variance
}
