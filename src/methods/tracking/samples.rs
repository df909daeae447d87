//! The points of the boundary as a field: weights on the faces between voxels, ready for sums over what is near.

use super::region::Region;
use super::vote::{Faces, TIME, X, Y, Z};
use crate::math::DVec3;

/// Sums run over so many neighbours along x at once.
pub(super) const LANES: usize = 4;

/// How weights fall with distance: θ(r) = exp(−r²/h²), 0 beyond 2h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Falloff {
    /// Where it ends: 2h.
    pub radius: f64,
    /// World units that one frame counts as: c.
    pub time_scale: f64,
}

/// The faces of one frame, each direction in an array over the voxels, rows with room at both ends.
#[derive(Clone, Debug)]
pub(super) struct FrameField {
    weights: [Vec<f32>; 4],
}

/// Where the rows of such an array begin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    dims: [usize; 3],
    row: usize,
    /// Zeroes before the first voxel of a row.
    room: usize,
    spacing: DVec3,
}

impl Layout {
    pub fn new(region: &Region, radius: f64) -> Self {
        let room = (2.0 * radius / region.spacing.x) as usize + 2 + LANES;
        Self { dims: region.dims, row: region.dims[0] + 2 * room, room, spacing: region.spacing }
    }

    pub fn field(&self, faces: &Faces) -> FrameField {
        let [nx, ny, nz] = self.dims;
        let weights = [X, Y, Z, TIME].map(|direction| {
            let list = &faces[direction];
            let mut weights = if list.is_empty() { Vec::new() } else { vec![0.0; self.row * ny * nz] };
            for face in list {
                let voxel = face.voxel as usize;
                weights[(voxel / nx) * self.row + self.room + voxel % nx] = face.weight;
            }
            weights
        });
        FrameField { weights }
    }

    /// What of the field is near a place.
    pub fn near(&self, at: DVec3, falloff: &Falloff) -> Near<'_> {
        let axis =
            |k: usize| [0.0, 0.5].map(|offset| Axis::new(at[k], self.spacing[k], offset, falloff.radius));
        Near { layout: self, falloff: *falloff, axes: [axis(0), axis(1), axis(2)] }
    }
}

/// The faces near one place.
pub(super) struct Near<'a> {
    layout: &'a Layout,
    falloff: Falloff,
    /// Along x, y and z: of faces in planes of voxel centres, and of those half a voxel further.
    axes: [[Axis; 2]; 3],
}

impl Near<'_> {
    /// Sums over the faces of one frame at the same time, without those along time.
    pub fn still(&self, field: &FrameField) -> Sums {
        let mut sums = Sums::default();
        for direction in [X, Y, Z] {
            self.gather(&field.weights[direction], direction, 0.0, &mut sums);
        }
        sums
    }

    /// Adds the faces of one frame at a distance `time` from the place; those along time are half a frame later.
    pub fn add(&self, field: &FrameField, time: f64, sums: &mut Sums) {
        let half = 0.5 * self.falloff.time_scale;
        for direction in [X, Y, Z, TIME] {
            let time = if direction == TIME { time + half } else { time };
            self.gather(&field.weights[direction], direction, time, sums);
        }
    }

    fn gather(&self, weights: &[f32], direction: usize, time: f64, sums: &mut Sums) {
        let Layout { dims, row, room, .. } = *self.layout;
        let radius = self.falloff.radius;
        let [x, y, z] = [X, Y, Z].map(|k| &self.axes[k][usize::from(direction == k)]);
        // Off the grid there are none.
        let outside = x.first < -(room as i64) || x.first + x.padded() as i64 > (dims[0] + room) as i64;
        if weights.is_empty() || outside || time.abs() >= radius {
            return;
        }
        let here = gauss(time, radius);
        for k in z.range(dims[2]) {
            let dz = z.distance(k);
            let left = radius * radius - time * time - dz * dz;
            if left <= 0.0 {
                continue;
            }
            let mut plane = Plane::default();
            for j in y.range(dims[1]) {
                let dy = y.distance(j);
                if dy * dy >= left {
                    continue;
                }
                let start = (k as usize * dims[1] + j as usize) * row + room;
                let from = (start as i64 + x.first) as usize;
                plane.add(&weights[from..from + x.padded()], dy as f32, y.weight(j) as f32);
            }
            plane.add_to(sums, x, [dz, time], here * z.weight(k));
        }
    }
}

/// θ, with h half the radius.
fn gauss(distance: f64, radius: f64) -> f64 {
    libm::exp(-4.0 * distance * distance / (radius * radius))
}

/// Faces within the radius along one axis, by the number of the voxel before them.
struct Axis {
    first: i64,
    /// From the place to the first of them, and from each to the next.
    start: f64,
    spacing: f64,
    weights: [f32; MOST],
    count: usize,
}

/// Most faces within the radius along one axis.
pub(super) const MOST: usize = 32;

impl Axis {
    fn new(at: f64, spacing: f64, offset: f64, radius: f64) -> Self {
        let first = ((at - radius) / spacing - offset).ceil() as i64;
        let last = ((at + radius) / spacing - offset).floor() as i64;
        let count = usize::try_from(last - first + 1).unwrap_or(0).min(MOST);
        let start = (first as f64 + offset) * spacing - at;
        let mut weights = [0.0; MOST];
        for (i, weight) in weights.iter_mut().take(count).enumerate() {
            *weight = gauss(start + i as f64 * spacing, radius) as f32;
        }
        Self { first, start, spacing, weights, count }
    }

    /// Those on the grid.
    fn range(&self, n: usize) -> std::ops::Range<i64> {
        self.first.max(0)..(self.first + self.count as i64).min(n as i64)
    }

    fn distance(&self, i: i64) -> f64 {
        self.start + (i - self.first) as f64 * self.spacing
    }

    fn weight(&self, i: i64) -> f64 {
        f64::from(self.weights[(i - self.first) as usize])
    }

    /// Their number, rounded up to whole lanes.
    fn padded(&self) -> usize {
        self.count.next_multiple_of(LANES)
    }
}

/// Sums over y in one plane, still apart by x.
struct Plane([[f32; MOST]; 3], bool);

impl Default for Plane {
    fn default() -> Self {
        Self([[0.0; MOST]; 3], false)
    }
}

impl Plane {
    #[inline]
    fn add(&mut self, row: &[f32], dy: f32, weight: f32) {
        let (first, second) = (weight * dy, weight * dy * dy);
        let [a, b, c] = &mut self.0;
        for (i, chunk) in row.chunks_exact(LANES).enumerate() {
            for lane in 0..LANES {
                let w = chunk[lane];
                a[i * LANES + lane] += weight * w;
                b[i * LANES + lane] += first * w;
                c[i * LANES + lane] += second * w;
            }
        }
        self.1 = true;
    }

    fn add_to(&self, sums: &mut Sums, x: &Axis, [dz, time]: [f64; 2], weight: f64) {
        if !self.1 {
            return;
        }
        let [mut s, mut sx, mut sxx, mut sy, mut sxy, mut syy] = [0.0f64; 6];
        for i in 0..x.count {
            let (g, dx) = (f64::from(x.weights[i]), x.start + i as f64 * x.spacing);
            let [a, b, c] = [0, 1, 2].map(|k| g * f64::from(self.0[k][i]));
            s += a;
            sx += a * dx;
            sxx += a * dx * dx;
            sy += b;
            sxy += b * dx;
            syy += c;
        }
        let add = |sum: &mut f64, value: f64| *sum += weight * value;
        add(&mut sums.weight, s);
        for (k, value) in [sx, sy, dz * s, time * s].into_iter().enumerate() {
            add(&mut sums.first[k], value);
        }
        let products = [
            sxx,
            sxy,
            dz * sx,
            time * sx,
            syy,
            dz * sy,
            time * sy,
            dz * dz * s,
            time * dz * s,
            time * time * s,
        ];
        for (k, value) in products.into_iter().enumerate() {
            add(&mut sums.second[k], value);
        }
    }
}

/// Weighted sums of the points around a place: of 1, of x, y, z, ct from the place on, and of the products of those.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub weight: f64,
    pub first: [f64; 4],
    /// xx xy xz xt yy yz yt zz zt tt.
    pub second: [f64; 10],
}
