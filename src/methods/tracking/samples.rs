//! Boundary points as arrays of weights on the faces between voxels, for fast weighted sums over the points around a
//! position.
//!
//! All positions in a frame have the same distances in time to the points of other frames, and the weight θ is
//! separable over the axes. So the frames are summed once, and each query sums along rows of voxels only.

use super::region::Region;
use super::shifts::Shifts;
use super::vote::{Face, Faces, TIME, X, Y, Z};
use crate::math::DVec3;
use crate::pauses::Pauses;
use wide::f32x8;

/// Weights of boundary points in plane fits, by distance: θ(r) = exp(−r²/h²), with r in space-time.
///
/// Weights are cut off at a cylinder rather than at the ball r < 2h: |x| ≤ 2h, y² + z² < 4h², c|t| < 2h. Its axis is
/// along x, its radius is 2h and its length 4h, so it contains the ball. Each row of voxels along x within it has the
/// same ends, and is summed as whole SIMD vectors without a test per voxel; frames are summed before any query. Points
/// of the cylinder outside the ball weigh less than θ(2h) = e⁻⁴ ≈ 0.018, where a point at the position itself weighs 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Falloff {
    /// Distance at which weights are cut off, in world units: 2h.
    pub radius: f64,
    /// Time scale c: the distance in space, in world units, that a difference of one frame counts as in plane fits.
    pub time_scale: f64,
}

impl Falloff {
    fn theta(&self, distance: f64) -> f64 {
        libm::exp(-4.0 * distance * distance / (self.radius * self.radius))
    }

    /// Returns the ratio of the weight θ at `distance + step` to θ at `distance`, by which weights are computed from
    /// voxel to voxel.
    fn ratio(&self, distance: f64, step: f64) -> f64 {
        libm::exp(-4.0 * step * (2.0 * distance + step) / (self.radius * self.radius))
    }

    /// Returns the offsets, in frames, from a frame to those with boundary points that may be within the cut-off radius
    /// of positions in it, at most `most` to either side.
    pub fn offsets(&self, most: usize) -> std::ops::RangeInclusive<i64> {
        let frames = ((self.radius / self.time_scale + 1.0) as i64).min(most as i64);
        -frames..=frames
    }
}

/// Number of faces along x that one SIMD vector holds; usually no more are within the cut-off radius of a position.
const LANES: usize = 8;

/// Maximum number of SIMD vectors for the faces along x within the cut-off radius of a position.
const MAX_VECTORS: usize = 4;

/// Maximum number of faces along one axis within the cut-off radius of a position; the parameter `radius` is limited by
/// it.
pub(super) const MAX_FACES: usize = MAX_VECTORS * LANES;

/// Number of boundary points between two pauses, and of those that count as one unit of work.
const POINTS_PER_CHUNK: usize = 1 << 16;
const POINTS_PER_UNIT: usize = 256;

/// The boundary points around one frame, as weights on the faces between voxels; answers queries for [`Sums`], to which
/// planes are fitted.
#[derive(Clone, Debug)]
pub(super) struct SampleField {
    dims: [usize; 3],
    spacing: DVec3,
    falloff: Falloff,
    /// Number of zeros at either end of a row of weights along x, for queries near its ends.
    padding: usize,
    /// By axis, the constant factor by which the ratio of the weight θ between neighbouring voxels changes from voxel
    /// to voxel; it saves exponentials.
    changes: DVec3,
    /// Whether the points are those of a single frame, each shifted along the direction of its face.
    is_shifted: bool,
    /// Boundary points by the direction of their faces; faces along time are at voxel centres.
    sites: [FaceWeights; 4],
}

/// Weights of the boundary points on the faces of one direction, by face, summed over the frames: times θ(t), t θ(t) and
/// t² θ(t), where t is the distance in time in world units. Of a single frame, t is instead the distance from the face to the
/// boundary point, along the direction of the face, and θ is 1.
#[derive(Clone, Debug, Default)]
struct FaceWeights {
    weights: [Vec<f32>; 3],
    /// For each row along x, the first voxel with a weight and the one after the last: queries skip empty rows, and
    /// there are no weights elsewhere, since most rows of most images have few.
    extents: Vec<[u32; 2]>,
    /// For each row along x, the index of its first weight, which is one of its padding.
    starts: Vec<u32>,
}

impl FaceWeights {
    /// Creates lists for the points of `sources`, in `lines` rows of `nx` voxels.
    async fn new(
        sources: &[(&[Face], f64)],
        [nx, lines]: [usize; 2],
        padding: usize,
        pauses: &Pauses,
    ) -> Self {
        let mut extents = vec![[u32::MAX, 0]; lines];
        for faces in sources.iter().flat_map(|(faces, _)| faces.chunks(POINTS_PER_CHUNK)) {
            for face in faces {
                let [first, end] = &mut extents[face.voxel as usize / nx];
                let x = (face.voxel as usize % nx) as u32;
                (*first, *end) = ((*first).min(x), (*end).max(x + 1));
            }
            pauses.after(faces.len() / POINTS_PER_UNIT).await;
        }
        let mut len = 0;
        let mut starts = Vec::with_capacity(lines);
        for [first, end] in &extents {
            starts.push(len as u32);
            len += end.checked_sub(*first).map_or(0, |count| count as usize + 2 * padding);
        }
        let mut weights: [Vec<f32>; 3] = Default::default();
        for list in &mut weights {
            *list = vec![0.0; len];
            pauses.after(len / POINTS_PER_UNIT / 8).await;
        }
        Self { weights, extents, starts }
    }

    /// Returns the index of the weight of the face after a voxel, in rows of `nx` voxels.
    fn index(&self, voxel: usize, nx: usize, padding: usize) -> usize {
        let (line, x) = (voxel / nx, voxel % nx);
        self.starts[line] as usize + padding + x - self.extents[line][0] as usize
    }
}

impl SampleField {
    /// Creates a field without boundary points.
    fn new(region: &Region, falloff: Falloff) -> Self {
        let most = (2.0 * falloff.radius / region.spacing.x) as usize + 1;
        let padding = if most <= LANES { LANES } else { MAX_FACES };
        let change = |k: usize| falloff.ratio(region.spacing[k] / 2.0, region.spacing[k]);
        Self {
            dims: region.dims,
            spacing: region.spacing,
            falloff,
            padding,
            changes: DVec3::new(change(0), change(1), change(2)),
            is_shifted: false,
            sites: Default::default(),
        }
    }

    /// Creates a field with the points of several frames, each with the number of frames by which it is after that of the
    /// field; those beyond the radius in time are left out.
    pub async fn of(region: &Region, falloff: Falloff, frames: &[(i64, &Faces)], pauses: &Pauses) -> Self {
        let mut field = Self::new(region, falloff);
        for direction in [X, Y, Z, TIME] {
            // Faces along time are half a frame after their frame.
            let later = if direction == TIME { 0.5 } else { 0.0 };
            let timed = frames.iter().map(|&(offset, faces)| {
                (&faces[direction][..], (offset as f64 + later) * falloff.time_scale)
            });
            let near: Vec<_> = timed.filter(|(_, time)| time.abs() < falloff.radius).collect();
            field.set_direction(direction, &near, pauses).await;
        }
        field
    }

    /// Creates a field with the points of a single frame, without points on faces along time. Each is shifted from its
    /// face by `shifts`, listed by direction and face; with empty lists, all are on their faces.
    pub async fn single_frame(
        region: &Region,
        falloff: Falloff,
        faces: &Faces,
        shifts: &Shifts,
        pauses: &Pauses,
    ) -> Self {
        let mut field = Self { is_shifted: true, ..Self::new(region, falloff) };
        let of_direction = faces.iter().zip(shifts).zip(region.spacing.to_array());
        for (direction, ((faces, shifts), side)) in of_direction.enumerate() {
            field.set_direction(direction, &[(faces, 0.0)], pauses).await;
            let site = &mut field.sites[direction];
            for (face, shift) in faces.iter().zip(shifts) {
                let at = site.index(face.voxel as usize, region.dims[0], field.padding);
                let away = side as f32 * shift;
                site.weights[1][at] = face.weight * away;
                site.weights[2][at] = face.weight * away * away;
            }
            pauses.after(faces.len() / POINTS_PER_UNIT).await;
        }
        field
    }

    /// Sets the boundary points on the faces of one direction, in lists each with its time.
    async fn set_direction(&mut self, direction: usize, sources: &[(&[Face], f64)], pauses: &Pauses) {
        if sources.is_empty() {
            return;
        }
        let [nx, ny, nz] = self.dims;
        let mut site = FaceWeights::new(sources, [nx, ny * nz], self.padding, pauses).await;
        for &(faces, time) in sources {
            let theta = self.falloff.theta(time);
            let factors = [theta, theta * time, theta * time * time].map(|factor| factor as f32);
            for faces in faces.chunks(POINTS_PER_CHUNK) {
                for face in faces {
                    let at = site.index(face.voxel as usize, nx, self.padding);
                    for (list, factor) in site.weights.iter_mut().zip(factors) {
                        list[at] += factor * face.weight;
                    }
                }
                pauses.after(faces.len() / POINTS_PER_UNIT).await;
            }
        }
        self.sites[direction] = site;
    }

    /// Returns weighted sums over all boundary points around a position in the frame, from which a plane is fitted.
    pub fn sums(&self, at: DVec3) -> Sums {
        let mut sums = Sums::default();
        let axis = |k: usize, offset: f64| {
            AxisWeights::new(at[k], self.spacing[k], offset, &self.falloff, self.changes[k])
        };
        let axes = [[axis(0, 0.0), axis(0, 0.5)], [axis(1, 0.0), axis(1, 0.5)], [axis(2, 0.0), axis(2, 0.5)]];
        for direction in [X, Y, Z, TIME] {
            let [x, y, z] = [X, Y, Z].map(|k| &axes[k][usize::from(direction == k)]);
            let sites = &self.sites[direction];
            if sites.extents.is_empty() {
                continue;
            }
            let mut of_direction = Sums::default();
            if x.count <= LANES {
                self.gather::<1>(sites, [x, y, z], &mut of_direction);
            } else {
                self.gather::<MAX_VECTORS>(sites, [x, y, z], &mut of_direction);
            }
            sums += if self.is_shifted { of_direction.shifted(direction) } else { of_direction };
        }
        sums
    }

    /// Sums over the boundary points on the faces of one direction within the cut-off radius of a position, and adds
    /// the results to `sums`. `N` vectors of lanes along x hold them all.
    fn gather<const N: usize>(&self, sites: &FaceWeights, [x, y, z]: [&AxisWeights; 3], sums: &mut Sums) {
        let square = self.falloff.radius * self.falloff.radius;
        let near = [x.first, x.end()];
        let mut planes = PlaneSums::<N>::default();
        for k in z.range(self.dims[2]) {
            let dz = z.distance(k);
            let mut rows = RowSums::<N>::default();
            for j in y.range(self.dims[1]) {
                let line = k as usize * self.dims[1] + j as usize;
                let dy = y.distance(j);
                let [first, end] = sites.extents[line].map(i64::from);
                if dy * dy + dz * dz >= square || first >= near[1] || end <= near[0] {
                    continue;
                }
                let from = (i64::from(sites.starts[line]) + self.padding as i64 + x.first - first) as usize;
                let row = |power: usize| lanes(&sites.weights[power][from..from + N * LANES]);
                rows.add([row(0), row(1), row(2)], dy as f32, y.weight(j));
            }
            if rows.used {
                planes.add(&rows, dz as f32, z.weight(k));
            }
        }
        if planes.rows.used {
            planes.add_to(sums, x);
        }
    }
}

/// Factors of the weight θ along one axis, for the positions on the axis that are within the cut-off radius of a query
/// position: the faces across the axis, or the voxel centres for faces that lie across another one. Index i stands for
/// the centre of voxel i, or the face after it.
struct AxisWeights {
    first: i64,
    /// Signed distance from the position to the first face or voxel centre within the cut-off radius, in world units.
    start: f64,
    spacing: f64,
    weights: [f32; MAX_FACES],
    count: usize,
}

impl AxisWeights {
    fn new(at: f64, spacing: f64, offset: f64, falloff: &Falloff, change: f64) -> Self {
        let first = ((at - falloff.radius) / spacing - offset).ceil() as i64;
        let last = ((at + falloff.radius) / spacing - offset).floor() as i64;
        let count = usize::try_from(last.saturating_sub(first) + 1).unwrap_or(0).min(MAX_FACES);
        let start = (first as f64 + offset) * spacing - at;
        let mut weights = [0.0; MAX_FACES];
        let (mut theta, mut ratio) = (falloff.theta(start), falloff.ratio(start, spacing));
        for weight in weights.iter_mut().take(count) {
            *weight = theta as f32;
            theta *= ratio;
            ratio *= change;
        }
        Self { first, start, spacing, weights, count }
    }

    /// Returns the index after the last face or centre within the cut-off radius of the query position.
    fn end(&self) -> i64 {
        // Positions may be arbitrarily far away.
        self.first.saturating_add(self.count as i64)
    }

    /// Returns the indices of the faces or centres within the cut-off radius of the query position, on a grid of `n`
    /// voxels along the axis.
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

/// SIMD vectors with one partial sum for each face along x.
type Lanes<const N: usize> = [f32x8; N];

fn lanes<const N: usize>(values: &[f32]) -> Lanes<N> {
    let mut lanes = [f32x8::ZERO; N];
    for (lane, values) in lanes.iter_mut().zip(values.chunks_exact(LANES)) {
        *lane = f32x8::from(values);
    }
    lanes
}

fn add<const N: usize>(to: &mut Lanes<N>, lanes: &Lanes<N>, factor: f32) {
    to.iter_mut().zip(lanes).for_each(|(to, lane)| *to += *lane * factor);
}

/// Sums over the rows of faces in one plane of constant z, by face along x: of the weights times 1, y and y², of the
/// weights times t, times 1 and y, and of the weights times t².
struct RowSums<const N: usize> {
    plain: [Lanes<N>; 3],
    timed: [Lanes<N>; 2],
    squared: Lanes<N>,
    used: bool,
}

impl<const N: usize> Default for RowSums<N> {
    fn default() -> Self {
        let none = [f32x8::ZERO; N];
        Self { plain: [none; 3], timed: [none; 2], squared: none, used: false }
    }
}

impl<const N: usize> RowSums<N> {
    #[inline]
    fn add(&mut self, [weights, timed, squared]: [Lanes<N>; 3], dy: f32, theta: f32) {
        let powers = [theta, theta * dy, theta * dy * dy];
        self.plain.iter_mut().zip(powers).for_each(|(to, power)| add(to, &weights, power));
        self.timed.iter_mut().zip(powers).for_each(|(to, power)| add(to, &timed, power));
        add(&mut self.squared, &squared, theta);
        self.used = true;
    }
}

/// Sums over the planes of constant z, by face along x: those of [`RowSums`], and those with a factor z or z² that
/// [`Sums`] needs.
struct PlaneSums<const N: usize> {
    rows: RowSums<N>,
    /// Sums of the weights times z, yz and zt.
    z_sums: [Lanes<N>; 3],
    /// Sums of the weights times z².
    zz_sums: Lanes<N>,
}

impl<const N: usize> Default for PlaneSums<N> {
    fn default() -> Self {
        let none = [f32x8::ZERO; N];
        Self { rows: RowSums::default(), z_sums: [none; 3], zz_sums: none }
    }
}

impl<const N: usize> PlaneSums<N> {
    #[inline]
    fn add(&mut self, rows: &RowSums<N>, dz: f32, theta: f32) {
        let [one, y, _] = &rows.plain;
        self.rows.plain.iter_mut().zip(&rows.plain).for_each(|(to, lanes)| add(to, lanes, theta));
        self.rows.timed.iter_mut().zip(&rows.timed).for_each(|(to, lanes)| add(to, lanes, theta));
        add(&mut self.rows.squared, &rows.squared, theta);
        let by_z = [one, y, &rows.timed[0]];
        self.z_sums.iter_mut().zip(by_z).for_each(|(to, lanes)| add(to, lanes, theta * dz));
        add(&mut self.zz_sums, one, theta * dz * dz);
        self.rows.used = true;
    }

    /// Adds up the sums over x, the last of the three axes, with the factors of θ and the powers of x, and adds the
    /// results to `sums`.
    fn add_to(&self, sums: &mut Sums, x: &AxisWeights) {
        let theta = lanes::<N>(&x.weights);
        let mut away = [f32x8::ZERO; N];
        for (k, lane) in away.iter_mut().enumerate() {
            *lane =
                f32x8::new(std::array::from_fn(|i| (x.start + (k * LANES + i) as f64 * x.spacing) as f32));
        }
        let times = |a: &Lanes<N>, b: &Lanes<N>| -> Lanes<N> { std::array::from_fn(|k| a[k] * b[k]) };
        let powers = [theta, times(&theta, &away), times(&times(&theta, &away), &away)];
        // In the same order on every machine.
        let sum = |lanes: &Lanes<N>, power: usize| -> f64 {
            let lane = lanes.iter().zip(&powers[power]).fold(f32x8::ZERO, |sum, (a, b)| sum + *a * *b);
            let [a, b, c, d, e, f, g, h] = lane.to_array();
            f64::from(((a + e) + (b + f)) + ((c + g) + (d + h)))
        };
        let ([one, y, yy], [t, yt]) = (&self.rows.plain, &self.rows.timed);
        let [z, yz, zt] = &self.z_sums;
        sums.weight += sum(one, 0);
        let first = [sum(one, 1), sum(y, 0), sum(z, 0), sum(t, 0)];
        let along_x = [sum(one, 2), sum(y, 1), sum(z, 1), sum(t, 1)];
        let across = [yy, yz, yt, &self.zz_sums, zt, &self.rows.squared].map(|lanes| sum(lanes, 0));
        sums.first.iter_mut().zip(first).for_each(|(sum, term)| *sum += term);
        sums.second.iter_mut().zip(along_x.into_iter().chain(across)).for_each(|(sum, term)| *sum += term);
    }
}

/// Weighted sums over the boundary points around a position: of 1, of their coordinates x, y, z, ct relative to the
/// position, and of the products of two coordinates. Planes are fitted to them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub weight: f64,
    pub first: [f64; 4],
    /// Weighted sums of the products of two coordinates, in the order xx xy xz xt yy yz yt zz zt tt; t stands for ct.
    pub second: [f64; 10],
}

impl Sums {
    /// Returns sums over points on faces of one direction as those over points at the distance t from their faces, along
    /// that direction; t then is no coordinate.
    fn shifted(self, direction: usize) -> Self {
        let [t, tt] = [self.first[TIME], self.second[index(TIME, TIME)]];
        let mut sums = self;
        sums.first[direction] += t;
        for k in [X, Y, Z] {
            sums.second[index(direction, k)] += self.second[index(k, TIME)];
            sums.second[index(k, TIME)] = 0.0;
        }
        sums.second[index(direction, direction)] += self.second[index(direction, TIME)] + tt;
        (sums.first[TIME], sums.second[index(TIME, TIME)]) = (0.0, 0.0);
        sums
    }
}

impl std::ops::AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.weight += other.weight;
        self.first.iter_mut().zip(other.first).for_each(|(sum, term)| *sum += term);
        self.second.iter_mut().zip(other.second).for_each(|(sum, term)| *sum += term);
    }
}

/// Returns the index in [`Sums::second`] of the product of two coordinates.
fn index(i: usize, j: usize) -> usize {
    let [i, j] = [i.min(j), i.max(j)];
    i * (7 - i) / 2 + j
}
