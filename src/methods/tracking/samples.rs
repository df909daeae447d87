//! The points of the boundary as a field: weights on the faces between voxels, ready for sums over what is near.
//!
//! All places of one frame see the others at the same distances in time, and θ is a product over the axes. So the frames are
//! summed up once, and what is left are sums along rows of voxels.

use super::region::Region;
use super::vote::{Faces, TIME, X, Y, Z};
use crate::math::DVec3;

/// How weights fall with distance: θ(r) = exp(−r²/h²), with r in space-time, and 0 beyond 2h in space or in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Falloff {
    /// Where it ends: 2h.
    pub radius: f64,
    /// World units that one frame counts as: c.
    pub time_scale: f64,
}

impl Falloff {
    fn theta(&self, distance: f64) -> f64 {
        libm::exp(-4.0 * distance * distance / (self.radius * self.radius))
    }

    /// Frames whose faces may be near, from a frame on.
    /// No more of them than `most` to either side.
    pub fn offsets(&self, most: usize) -> std::ops::RangeInclusive<i64> {
        let reach = (self.radius / self.time_scale).min(most as f64) as i64 + 1;
        let reach = reach.min(most as i64);
        -reach..=reach
    }
}

/// Most faces within the radius along one axis.
pub(super) const MOST: usize = 32;

/// Usually there are no more than this.
const FEW: usize = 8;

/// What is near in time to one frame.
#[derive(Clone, Debug)]
pub(super) struct Field {
    dims: [usize; 3],
    spacing: DVec3,
    falloff: Falloff,
    /// From one row to the next, and zeroes before the first voxel of a row.
    row: usize,
    room: usize,
    /// By direction of the faces; those along time lie in the middle of voxels.
    sites: [Sites; 4],
}

/// Weights times θ of the time, on the faces of one direction: as they are, times the time, and times its square.
#[derive(Clone, Debug, Default)]
struct Sites {
    weights: [Vec<f32>; 3],
    /// By row, from the first to after the last voxel with a weight.
    extents: Vec<[u32; 2]>,
}

impl Field {
    /// Without points.
    pub fn new(region: &Region, falloff: Falloff) -> Self {
        let room = (2.0 * falloff.radius / region.spacing.x) as usize + 2 + FEW;
        let row = region.dims[0] + 2 * room;
        Self { dims: region.dims, spacing: region.spacing, falloff, row, room, sites: Default::default() }
    }

    /// The points of a single frame, without those along time.
    pub fn still(region: &Region, falloff: Falloff, faces: &Faces) -> Self {
        let mut field = Self::new(region, falloff);
        for direction in [X, Y, Z] {
            field.add_direction(direction, faces, 0.0);
        }
        field
    }

    /// Adds the points of the frame that is `offset` frames later.
    pub fn add(&mut self, faces: &Faces, offset: i64) {
        for direction in [X, Y, Z, TIME] {
            // Faces along time lie half a frame later than their own.
            let frames = offset as f64 + if direction == TIME { 0.5 } else { 0.0 };
            let time = frames * self.falloff.time_scale;
            if time.abs() < self.falloff.radius {
                self.add_direction(direction, faces, time);
            }
        }
    }

    fn add_direction(&mut self, direction: usize, faces: &Faces, time: f64) {
        let [nx, ny, nz] = self.dims;
        let theta = self.falloff.theta(time);
        let factors = [theta, theta * time, theta * time * time].map(|factor| factor as f32);
        let Sites { weights, extents } = &mut self.sites[direction];
        if extents.is_empty() {
            extents.resize(ny * nz, [u32::MAX, 0]);
            weights.iter_mut().for_each(|list| list.resize(self.row * ny * nz, 0.0));
        }
        for face in &faces[direction] {
            let (line, x) = (face.voxel as usize / nx, face.voxel as usize % nx);
            for (list, factor) in weights.iter_mut().zip(factors) {
                list[line * self.row + self.room + x] += factor * face.weight;
            }
            let [first, end] = &mut extents[line];
            (*first, *end) = ((*first).min(x as u32), (*end).max(x as u32 + 1));
        }
    }

    /// Sums over all points around a place of the frame.
    pub fn sums(&self, at: DVec3) -> Sums {
        let mut sums = Sums::default();
        let axis =
            |k: usize| [0.0, 0.5].map(|offset| Axis::new(at[k], self.spacing[k], offset, &self.falloff));
        let axes = [axis(0), axis(1), axis(2)];
        for direction in [X, Y, Z, TIME] {
            let [x, y, z] = [X, Y, Z].map(|k| &axes[k][usize::from(direction == k)]);
            // Off the grid there are none.
            let room = self.room as i64;
            let outside = x.first < -room || x.end() > self.dims[0] as i64 + room;
            if outside || self.sites[direction].extents.is_empty() {
                continue;
            }
            if x.count <= FEW {
                self.gather::<FEW>(&self.sites[direction], [x, y, z], &mut sums);
            } else {
                self.gather::<MOST>(&self.sites[direction], [x, y, z], &mut sums);
            }
        }
        sums
    }

    /// `LANES`: no less than the faces along x.
    fn gather<const LANES: usize>(&self, sites: &Sites, [x, y, z]: [&Axis; 3], sums: &mut Sums) {
        let square = self.falloff.radius * self.falloff.radius;
        let near = [x.first, x.end()];
        for k in z.range(self.dims[2]) {
            let dz = z.distance(k);
            let mut plane = Plane::<LANES>::default();
            for j in y.range(self.dims[1]) {
                let line = k as usize * self.dims[1] + j as usize;
                let dy = y.distance(j);
                let [first, end] = sites.extents[line].map(i64::from);
                if dy * dy + dz * dz >= square || first >= near[1] || end <= near[0] {
                    continue;
                }
                let from = ((line * self.row + self.room) as i64 + x.first) as usize;
                let rows = [0, 1, 2].map(|power| &sites.weights[power][from..from + x.count]);
                plane.add(rows, dy as f32, y.weight(j));
            }
            if plane.used {
                plane.add_to(sums, x, dz, f64::from(z.weight(k)));
            }
        }
    }
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

impl Axis {
    fn new(at: f64, spacing: f64, offset: f64, falloff: &Falloff) -> Self {
        let first = libm::ceil((at - falloff.radius) / spacing - offset) as i64;
        let last = libm::floor((at + falloff.radius) / spacing - offset) as i64;
        let count = usize::try_from(last.saturating_sub(first) + 1).unwrap_or(0).min(MOST);
        let start = (first as f64 + offset) * spacing - at;
        let mut weights = [0.0; MOST];
        for (i, weight) in weights.iter_mut().take(count).enumerate() {
            *weight = falloff.theta(start + i as f64 * spacing) as f32;
        }
        Self { first, start, spacing, weights, count }
    }

    /// After the last.
    fn end(&self) -> i64 {
        // Places may be as far off as numbers go.
        self.first.saturating_add(self.count as i64)
    }

    /// Those on the grid.
    fn range(&self, n: usize) -> std::ops::Range<i64> {
        self.first.max(0)..self.end().min(n as i64)
    }

    fn distance(&self, i: i64) -> f64 {
        self.start + (i - self.first) as f64 * self.spacing
    }

    fn weight(&self, i: i64) -> f32 {
        self.weights[(i - self.first) as usize]
    }
}

/// Sums over y in one plane, still apart by x: of the weights times 1, y and y², of those with time times 1 and y, and of
/// those with its square.
struct Plane<const LANES: usize> {
    plain: [[f32; LANES]; 3],
    timed: [[f32; LANES]; 2],
    squared: [f32; LANES],
    used: bool,
}

impl<const LANES: usize> Default for Plane<LANES> {
    fn default() -> Self {
        let none = [0.0; LANES];
        Self { plain: [none; 3], timed: [none; 2], squared: none, used: false }
    }
}

impl<const LANES: usize> Plane<LANES> {
    #[inline]
    fn add(&mut self, [plain, timed, squared]: [&[f32]; 3], dy: f32, theta: f32) {
        let (first, second) = (theta * dy, theta * dy * dy);
        for (i, ((&w, &t), &s)) in plain.iter().zip(timed).zip(squared).enumerate().take(LANES) {
            self.plain[0][i] += theta * w;
            self.plain[1][i] += first * w;
            self.plain[2][i] += second * w;
            self.timed[0][i] += theta * t;
            self.timed[1][i] += first * t;
            self.squared[i] += theta * s;
        }
        self.used = true;
    }

    fn add_to(&self, sums: &mut Sums, x: &Axis, dz: f64, weight: f64) {
        let mut s = [0.0f64; 10];
        for i in 0..x.count {
            let (theta, dx) = (f64::from(x.weights[i]), x.start + i as f64 * x.spacing);
            let [a, b, c] = self.plain.each_ref().map(|lanes| theta * f64::from(lanes[i]));
            let [t, ty] = self.timed.each_ref().map(|lanes| theta * f64::from(lanes[i]));
            let terms =
                [a, a * dx, a * dx * dx, b, b * dx, c, t, t * dx, ty, theta * f64::from(self.squared[i])];
            s.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        let [one, x, xx, y, xy, yy, t, xt, yt, tt] = s.map(|sum| weight * sum);
        sums.weight += one;
        let first = [x, y, dz * one, t];
        let second = [xx, xy, dz * x, xt, yy, dz * y, yt, dz * dz * one, dz * t, tt];
        sums.first.iter_mut().zip(first).for_each(|(sum, term)| *sum += term);
        sums.second.iter_mut().zip(second).for_each(|(sum, term)| *sum += term);
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
