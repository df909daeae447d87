//! Where between the centres of two voxels a boundary is. The votes find the faces between voxels that it crosses; the
//! intensities of the row of voxels across a face tell how far from the face it is.

use super::region::Region;
use super::vote::{Faces, Histogram, X, Y, Z};
use crate::pauses::Pauses;

/// Distances of boundary points from their faces, along x, y and z by face, in sides of a voxel, at most half of one.
pub(super) type Shifts = [Vec<f32>; 3];

/// Smallest difference between bright and dark around a face, as a share of the edge threshold, at which its point is
/// shifted: the votes of windows over several frames may be those of other frames.
const MIN_CONTRAST: f64 = 0.5;

/// Largest distance of a boundary point from its face, in sides of a voxel.
const MAX_SHIFT: f64 = 0.5;

/// Change of brightness away from a boundary, in units of its step, above which there is another one.
const OTHER_WALL: f64 = 0.25;

/// Smallest change of brightness within four voxels, in units of the step of a boundary, that is all of it.
const SHARP: f64 = 0.9;

/// Number of voxels that count as one unit of work between pauses.
const VOXELS_PER_UNIT: usize = 256;

impl Region {
    /// Returns the distances of the boundary points of a frame from their faces. `half_width` is that of the windows.
    pub async fn shifts(&self, frame: usize, faces: &Faces, half_width: usize, pauses: &Pauses) -> Shifts {
        let mut shifts = Shifts::default();
        let units = (2 * half_width + 1).pow(3) / VOXELS_PER_UNIT + 1;
        for direction in [X, Y, Z] {
            shifts[direction].reserve_exact(faces[direction].len());
            for face in &faces[direction] {
                shifts[direction].push(self.shift(frame, direction, face.voxel, half_width));
                pauses.after(units).await;
            }
        }
        shifts
    }

    /// Returns the distance of the boundary from the face after a voxel, in the row of voxels across it. 0 in the sides of the
    /// box, beside missing voxels, without contrast, and as [`crossing`] says.
    fn shift(&self, frame: usize, direction: usize, voxel: u32, half_width: usize) -> f32 {
        if self.outward_at_box_side(direction, voxel).is_some() {
            return 0.0;
        }
        let [here, there] = self.voxels_at_face(direction, voxel);
        if [here, there].into_iter().any(|at| self.is_missing(frame, self.index(at))) {
            return 0.0;
        }
        let Some([dark, bright]) = self.levels_around(frame, direction, here, half_width) else { return 0.0 };
        let share = |at: [usize; 3]| {
            let value = f64::from(self.frames[frame][self.index(at)]);
            ((value - dark) / (bright - dark)).clamp(-0.5, 1.5)
        };
        let ends = [self.beyond(there, here, direction), self.beyond(here, there, direction)]
            .map(|end| end.filter(|&at| !self.is_missing(frame, self.index(at))));
        let [first, last] = [ends[0].unwrap_or(here), ends[1].unwrap_or(there)].map(share);
        let [a, b] = [here, there].map(share);
        crossing([first, a, b, last])
    }

    /// Returns the levels of dark and of bright voxels around the face after a voxel; `None` without contrast.
    fn levels_around(
        &self,
        frame: usize,
        direction: usize,
        voxel: [usize; 3],
        half_width: usize,
    ) -> Option<[f64; 2]> {
        // Sixths, as boundaries cut most of the voxels of a thin object: in a blurred image, those of two thirds of a plate three
        // voxels thick.
        let range = |k: usize| {
            let after = half_width + 1 + usize::from(k == direction);
            voxel[k].saturating_sub(half_width)..(voxel[k] + after).min(self.dims[k])
        };
        let mut histogram = Histogram::default();
        for z in range(2) {
            for y in range(1) {
                let row = range(0).map(|x| self.index([x, y, z])).filter(|&i| !self.is_missing(frame, i));
                row.for_each(|i| histogram.count(self.frames[frame][i]));
            }
        }
        let (low, high) = histogram.two_means(0.0)?;
        let has_contrast = high.mean() - low.mean() >= MIN_CONTRAST * self.threshold;
        let dark = histogram.at_rank(low.count / 6);
        let bright = histogram.at_rank(low.count + 5 * high.count / 6);
        has_contrast.then_some([dark, bright])
    }

    /// Returns whether a voxel has no value, and the objects have none around them.
    fn is_missing(&self, frame: usize, voxel: usize) -> bool {
        self.has_background && self.frames[frame][voxel] == 0
    }

    /// Returns the voxel beyond `to` as seen from `from`, its neighbour along a direction; `None` outside of the region.
    fn beyond(&self, from: [usize; 3], to: [usize; 3], direction: usize) -> Option<[usize; 3]> {
        let mut next = to;
        next[direction] = (2 * to[direction]).checked_sub(from[direction])?;
        (next[direction] < self.dims[direction]).then_some(next)
    }
}

/// Returns where a row of four voxels changes from bright to dark, as the distance from the face in its middle: as far as
/// voxels, two on either side, are bright beyond it. The row is given by the brightness of its voxels, from 0 for dark to 1 for
/// bright. 0 without a change at the face, and into what is a single voxel thick: both of its walls would be in its middle.
fn crossing([first, a, b, last]: [f64; 4]) -> f32 {
    if a == b {
        return 0.0;
    }
    let toward = if a > b { 1.0 } else { -1.0 };
    // A voxel of another wall counts as the one before it.
    let in_wall =
        |near: f64, end: f64, toward: f64| if (end - near) * toward > OTHER_WALL { near } else { end };
    let ends = [in_wall(a, first, -toward), in_wall(b, last, toward)];
    // Along an oblique row, or in a blurred image, brightness changes further than to its ends, but evenly.
    let shift = if (ends[0] - ends[1]).abs() < SHARP {
        (a - 0.5) / (a - b) - 0.5
    } else {
        toward * (ends[0] + a + b + ends[1] - 2.0)
    };
    let [before, within] = if shift > 0.0 { [a, last] } else { [b, first] };
    let is_thin = (before > 0.5) == (within > 0.5);
    if is_thin { 0.0 } else { shift.clamp(-MAX_SHIFT, MAX_SHIFT) as f32 }
}
