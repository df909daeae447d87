//! Volumes: smoothing takes away from what is convex and thin, and this gives it back.
//!
//! With all positions in the middle of their cells, each label has exactly the volume of its voxels. The difference that
//! the positions make is measured around each cell, averaged over cells nearby, and removed by a displacement along the
//! normal. The average is wide enough for the steps of slanted surfaces, whose differences cancel out, to stay smooth.

use super::cells::CellBox;
use super::nets::{Crossing, Nets};
use super::smooth::{Stencil, within_reach};
use crate::math::Vec3;

/// Number of times that differences are averaged over neighbouring cells; the width of the average, a standard
/// deviation, is about the root of half of it, in voxels.
const AVERAGES: usize = 24;
/// Largest displacement at once, in voxels.
const MOST: f32 = 0.25;

/// What is known of the surfaces around a cell in which two labels meet.
#[derive(Clone, Copy, Debug, Default)]
struct Around {
    /// Volume that the label of the lower number has gained, in voxels.
    gain: f32,
    /// Sum of the areas of the polygons, normal to them, away from the label of the lower number, in square voxels.
    area: Vec3,
    /// Amount of surface that the difference is spread over, in square voxels.
    size: f32,
}

impl Nets {
    /// Moves the cells of `stencils`, which are those of a box, so that volumes are nearer those of the voxels.
    pub fn balance(&mut self, area: CellBox, stencils: &[Stencil]) {
        let mut index = vec![u32::MAX; self.cells.slots().len()];
        (0..).zip(stencils).for_each(|(i, stencil)| index[stencil.slot as usize] = i);
        let around = self.measure_around(area, stencils, &index);
        let averaged = self.averaged(stencils, &index, &around);
        for ((stencil, around), [gain, size]) in stencils.iter().zip(&around).zip(averaged) {
            let normal = around.area.normalize_or_zero();
            if size > 0.0 {
                let offset = self.cells.offset_mut(stencil.slot);
                *offset = within_reach(*offset - normal * (gain / size).clamp(-MOST, MOST));
            }
        }
    }

    /// Shares the gain and the area of each polygon among those of its cells in which two labels meet.
    fn measure_around(&self, area: CellBox, stencils: &[Stencil], index: &[u32]) -> Vec<Around> {
        let mut around = vec![Around::default(); stencils.len()];
        for (slot, cell) in (0..).zip(self.cells.slots()) {
            if !cell.is_live() || !area.grown(1, self.grid.dims()).contains(cell.at) {
                continue;
            }
            for crossing in self.crossings(slot) {
                let (gain, normal) = self.gain(&crossing);
                let shared = crossing.slots.map(|slot| self.pair(slot).is_some());
                let share = 1.0 / shared.iter().filter(|&&shared| shared).count().max(1) as f32;
                for (&slot, _) in crossing.slots.iter().zip(shared).filter(|&(_, shared)| shared) {
                    if let Some(found) = around.get_mut(index[slot as usize] as usize) {
                        found.gain += gain * share;
                        found.area += normal * share;
                        found.size += normal.length() * share;
                    }
                }
            }
        }
        around
    }

    /// Returns the volume that the label of lower number has gained at a polygon, and the polygon's area, normal to it
    /// and away from that label.
    fn gain(&self, crossing: &Crossing) -> (f32, Vec3) {
        let origin = self.cells.get(crossing.slots[0]);
        let corners = crossing.slots.map(|slot| {
            let cell = self.cells.get(slot);
            let middle = Vec3::from([0, 1, 2].map(|axis| cell.at[axis] as f32 - origin.at[axis] as f32));
            (middle, cell.offset)
        });
        let halves = self.halves(crossing.slots).map(|half| half.map(|i| corners[i]));
        let side = if crossing.ends[0] < crossing.ends[1] { 1.0 } else { -1.0 };
        let gain: f32 = halves.iter().map(swept).sum();
        let area: Vec3 = halves.iter().map(|half| area_of(half.map(|(p, d)| p + d))).sum();
        (gain * side, area * side)
    }

    /// Returns the two labels that meet in a cell, if there are not more.
    fn pair(&self, slot: u32) -> Option<[u16; 2]> {
        let corners = self.cells.get(slot).corners;
        let first = corners[0];
        let second = corners.iter().copied().find(|&other| other != first)?;
        let only = corners.iter().all(|&other| other == first || other == second);
        only.then(|| [first.min(second), first.max(second)])
    }

    /// Returns the gain and the size around each cell, averaged over its neighbours where the same two labels meet, again
    /// and again. What one cell gives, another one gets, so that sums are kept.
    fn averaged(&self, stencils: &[Stencil], index: &[u32], around: &[Around]) -> Vec<[f32; 2]> {
        let pairs: Vec<_> = stencils.iter().map(|stencil| self.pair(stencil.slot)).collect();
        let partners: Vec<Vec<u32>> = (stencils.iter().zip(&pairs))
            .map(|(stencil, pair)| {
                let near = stencil.neighbours().map(|slot| index[slot as usize]);
                near.filter(|&i| pair.is_some() && pairs.get(i as usize) == Some(pair)).collect()
            })
            .collect();
        let mut now: Vec<[f32; 2]> = around.iter().map(|around| [around.gain, around.size]).collect();
        for _ in 0..AVERAGES {
            let next = partners.iter().enumerate().map(|(i, partners)| {
                let mut sum = now[i];
                for &j in partners {
                    let [gain, size] = now[j as usize];
                    sum[0] += (gain - now[i][0]) / 7.0;
                    sum[1] += (size - now[i][1]) / 7.0;
                }
                sum
            });
            now = next.collect();
        }
        now
    }
}

/// Returns the volume that a triangle sweeps while its corners move straight from the first to the second position
/// (by the second vector), positive along its normal.
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
