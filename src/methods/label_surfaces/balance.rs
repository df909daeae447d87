//! Volumes: smoothing takes away from what is convex and thin, and this gives it back.
//!
//! With all positions in the middle of their cells, each label has exactly the volume of its voxels. The difference that
//! the positions make is measured around each cell, averaged over cells nearby, and removed by a displacement along the
//! normal. The average is wide enough for the steps of slanted surfaces, whose differences cancel out, to stay smooth.

use super::nets::halves;
use super::zone::{Polygon, Zone, within_reach};
use crate::math::Vec3;

/// Number of times that differences are averaged over neighbouring cells; the width of the average, a standard
/// deviation, is about the root of half of it, in voxels.
const AVERAGES: usize = 24;
/// Share of the difference to each neighbour that a cell adopts in one average; below one sixth, which keeps it stable.
const SHARE: f32 = 1.0 / 7.0;
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
    pub fn balance(&mut self) {
        let around = self.measure_around();
        let links = self.links.iter().map(|links| &links.alike);
        let gains = averaged(around.iter().map(|around| around.gain).collect(), links);
        for (i, (around, [gain, size])) in around.iter().zip(gains).enumerate() {
            if size > 0.0 {
                let shift = around.area.normalize_or_zero() * (gain / size).clamp(-MOST, MOST);
                self.offsets[i] = within_reach(self.offsets[i] - shift);
            }
        }
    }

    /// Shares the gain and the area of each polygon among those of its cells in which two labels meet.
    fn measure_around(&self) -> Vec<Around> {
        let mut around = vec![Around::default(); self.moving()];
        for polygon in &self.polygons {
            let (gain, area) = self.gain(polygon);
            let share = 1.0 / polygon.pairs.iter().filter(|&&is_pair| is_pair).count().max(1) as f32;
            for (&i, _) in polygon.cells.iter().zip(polygon.pairs).filter(|&(_, is_pair)| is_pair) {
                if let Some(found) = around.get_mut(i as usize) {
                    found.gain[0] += gain * share;
                    found.gain[1] += area.length() * share;
                    found.area += area * share;
                }
            }
        }
        around
    }

    /// Returns the volume that the label of lower number has gained at a polygon, and the polygon's area, normal to it
    /// and away from that label.
    pub fn gain(&self, polygon: &Polygon) -> (f32, Vec3) {
        gain_of(self.corners(polygon))
    }
}

/// Returns the volume that a polygon has swept since its corners, given with their displacements, were in the middle of
/// their cells, and its area, normal to it.
pub fn gain_of(corners: [(Vec3, Vec3); 4]) -> (f32, Vec3) {
    let halves = halves(corners.map(|(middle, offset)| middle + offset)).map(|half| half.map(|i| corners[i]));
    let area = halves.iter().map(|half| area_of(half.map(|(middle, offset)| middle + offset))).sum();
    (halves.iter().map(swept).sum(), area)
}

/// Returns gains averaged with those of neighbours, which `links` name for each, again and again. What one gives, another
/// one gets, so that sums are kept.
pub fn averaged<'a>(
    mut gains: Vec<[f32; 2]>,
    links: impl Iterator<Item = &'a [u32; 6]> + Clone,
) -> Vec<[f32; 2]> {
    for _ in 0..AVERAGES {
        let next = gains.iter().zip(links.clone()).map(|(&own, links)| {
            let others = links.map(|j| gains[j as usize]);
            [0, 1].map(|k| others.iter().fold(own[k], |sum, other| sum + (other[k] - own[k]) * SHARE))
        });
        gains = next.collect();
    }
    gains
}

/// Returns the volume that a triangle sweeps while its corners, given with their displacements, move straight, positive
/// along its normal.
fn swept(corners: &[(Vec3, Vec3); 3]) -> f32 {
    let [(a, da), (b, db), (c, dc)] = *corners;
    let (u, v, du, dv) = (b - a, c - a, db - da, dc - da);
    let normal = [u.cross(v), u.cross(dv) + du.cross(v), du.cross(dv)];
    let mean = (da + db + dc) / 6.0;
    mean.dot(normal[0] + normal[1] / 2.0 + normal[2] / 3.0)
}

/// Returns the area of a triangle as a vector normal to it.
fn area_of([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a) / 2.0
}
