//! Marching cubes, the model and the label surfaces of a threshold agree on random fields with a count of voxels that is
//! made independently of them: in components, Euler characteristic and volume.
//!
//! The count is made on the image upsampled threefold by linear interpolation. Voxels of the object are connected through
//! faces, those of the background through faces, edges and corners, as in marching cubes. All features of the
//! fields are four voxels or more across, but where a border or a mask cuts them.

use super::common::{Named, Random, assert_at_least, seeds};
use std::collections::BTreeMap;
use vesicle::math::{DAffine3, Vec3};
use vesicle::mesh::{TriangleMesh, measure};
use vesicle::methods::deformable::{DeformableModel, DeformableOptions, DeformableParams};
use vesicle::methods::label_surfaces::{LabelParams, LabelSurfaces};
use vesicle::volume::{Volume, VolumeInit, Voxels, marching_cubes_world};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// The number of samples in the length of a unit, to which the image is upsampled along each axis.
const UPSAMPLED: f32 = 3.0;

/// The number of parts, along each axis, into which upsampled voxels at a surface are divided to measure volumes: counts of
/// whole ones are 1 % off for the smallest objects.
const PARTS: usize = 4;

/// The largest relative difference of volumes that agree.
const TOLERANCE: f64 = 0.01;

/// The figures of a surface, or of a count of voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Figures {
    /// The number of closed surfaces: parts of the object and cavities.
    parts: i64,
    euler: i64,
    volume: f64,
}

impl Figures {
    fn of(surface: &TriangleMesh) -> Self {
        let Measured { parts, euler, volume } = measured(surface);
        Self { parts, euler, volume }
    }

    fn has_topology_of(self, other: Self) -> bool {
        (self.parts, self.euler) == (other.parts, other.euler)
    }
}

struct Measured {
    parts: i64,
    euler: i64,
    volume: f64,
}

fn measured(surface: &TriangleMesh) -> Measured {
    let all = measure(surface);
    Measured { parts: surface.components().len() as i64, euler: all.euler, volume: all.volume }
}

/// The kinds of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// Distances to the surface, as a number of any type, around any value.
    Smooth,
    /// Two values, or the share of each voxel that is inside.
    Stepped,
    /// NaN beyond a plane or a ball, or everywhere outside of the object.
    Masked,
    /// The border of the image cuts objects.
    Border,
    /// Any of these, with objects or gaps of less than three voxels where a mask or the border cuts them.
    Thin,
}

const KINDS: [Kind; 4] = [Kind::Smooth, Kind::Stepped, Kind::Masked, Kind::Border];

/// A random field: the image, and the iso value at which it is compared.
struct Field {
    dims: [usize; 3],
    values: Vec<f64>,
    iso: f64,
    /// The difference from the iso value of what is outside, where no object is beside it.
    far: f64,
    /// The spacing along each axis.
    voxel: Vec3,
}

type Distance = Box<dyn Fn(Vec3) -> f32>;

/// Returns the signed distance, positive inside, of a random shape around the origin, and a radius that it is within.
fn shape(random: &mut Random) -> (Distance, f32) {
    let mut axis =
        || Vec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize_or(Vec3::X);
    let (u, w) = (axis(), axis());
    let radius = 4.0 + 3.0 * random.unit();
    match random.below(5) {
        0 => (Box::new(move |p| radius - p.length()), radius),
        1 => {
            // A rod.
            let half = 3.0 + 5.0 * random.unit();
            let radius = radius.min(5.0);
            (Box::new(move |p| radius - (p - u * p.dot(u).clamp(-half, half)).length()), radius + half)
        }
        2 => {
            // A ring with a hole of four voxels.
            let (tube, ring) = (2.5 + 1.5 * random.unit(), 6.5 + 2.5 * random.unit());
            let ring = ring.max(tube + 2.5);
            let to_ring = move |p: Vec3| {
                let along = p.dot(u);
                let across = (p - u * along).length() - ring;
                tube - (across * across + along * along).sqrt()
            };
            (Box::new(to_ring), ring + tube)
        }
        3 => {
            // A shell.
            let inner = 2.5 + 2.0 * random.unit();
            let outer = inner + 4.0 + random.unit();
            (Box::new(move |p| (outer - p.length()).min(p.length() - inner)), outer)
        }
        _ => {
            // Two balls that overlap.
            let (other, between) = (3.5 + 2.0 * random.unit(), 3.0 + random.unit());
            let of = move |p: Vec3| (radius - p.length()).max(other - (p - w * between).length());
            (Box::new(of), radius.max(between + other))
        }
    }
}

/// Returns the signed distance of random shapes, at least four voxels apart, and the dimensions of an image of them.
fn scene(random: &mut Random, kind: Kind) -> ([usize; 3], Distance) {
    let dims = [0; 3].map(|_| 28 + random.below(9));
    let mut placed: Vec<(Distance, Vec3, f32)> = Vec::new();
    for _ in 0..12 {
        if placed.len() == 3 {
            break;
        }
        let (distance, radius) = shape(random);
        let mut centre = Vec3::ZERO;
        let mut fits = true;
        for axis in 0..3 {
            let last = (dims[axis] - 1) as f32;
            let room = last - 2.0 * (radius + 2.0);
            fits &= room >= 0.0;
            centre[axis] = radius + 2.0 + room.max(0.0) * random.unit();
        }
        if kind == Kind::Border {
            // Cut at a depth of at least half of the radius, on one to three sides.
            let first = random.below(3);
            for axis in (first..first + 1 + random.below(2)).map(|axis| axis % 3) {
                let depth = 0.4 * radius * (random.unit() - 0.5);
                centre[axis] = if random.below(2) == 0 { depth } else { (dims[axis] - 1) as f32 - depth };
            }
            fits = true;
        }
        let is_apart =
            |(_, other, reach): &(Distance, Vec3, f32)| centre.distance(*other) > radius + reach + 4.0;
        if fits && placed.iter().all(is_apart) {
            placed.push((distance, centre, radius));
        }
    }
    let all = move |p: Vec3| placed.iter().fold(-9.0f32, |most, (of, centre, _)| most.max(of(p - *centre)));
    (dims, Box::new(all))
}

fn for_each_voxel(dims: [usize; 3], mut value: impl FnMut(Vec3) -> f64) -> Vec<f64> {
    let at = |k: usize| {
        Vec3::new((k % dims[0]) as f32, (k / dims[0] % dims[1]) as f32, (k / dims[0] / dims[1]) as f32)
    };
    (0..dims.iter().product()).map(|k| value(at(k))).collect()
}

/// Makes the random field of a seed, with voxels of `voxel` times the size of a cube along each axis.
fn field(seed: u64, voxel: Vec3) -> (Kind, Field) {
    let mut random = Random(seed);
    let kind = KINDS[(seed % 4) as usize];
    let (dims, distance) = scene(&mut random, kind);
    let dims = [0, 1, 2].map(|axis| ((dims[axis] as f32 / voxel[axis]).ceil() as usize).max(2));
    let distance = move |p: Vec3| distance(p * voxel);
    let (scale, offset) = (random.within(1.0, 100.0), random.within(-1000.0, 1000.0));
    let shift = random.within(-0.6, 0.6);
    let mut iso = offset + scale * shift;
    let mut values = match kind {
        Kind::Stepped => {
            iso = offset + scale * 0.5;
            let is_binary = random.below(2) == 0;
            for_each_voxel(dims, |p| {
                let shares = if is_binary { 1 } else { 4 };
                let step = |i: usize| ((i as f32 + 0.5) / shares as f32) - 0.5;
                let mut inside = 0;
                for k in 0..shares * shares * shares {
                    let by =
                        Vec3::new(step(k % shares), step(k / shares % shares), step(k / shares / shares));
                    inside += i32::from(distance(p + by) > 0.0);
                }
                offset + scale * f64::from(inside) / f64::from((shares * shares * shares) as u32)
            })
        }
        _ => for_each_voxel(dims, |p| offset + scale * f64::from(distance(p).clamp(-6.0, 6.0))),
    };
    if kind == Kind::Masked {
        mask(&mut random, dims, voxel, [iso, scale], &mut values);
    }
    // Numbers of other sizes and types.
    match random.below(5) {
        0 => values.iter_mut().for_each(|value| *value = value.round()),
        1 => {
            values.iter_mut().for_each(|value| *value += 4e9);
            iso += 4e9;
        }
        2 => {
            let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
            if lowest <= offset - 4.0 * scale {
                values
                    .iter_mut()
                    .filter(|value| **value == lowest)
                    .step_by(2)
                    .for_each(|value| *value = -1e10);
            }
        }
        _ => (),
    }
    let far = iso - values.iter().copied().filter(|value| value.is_finite()).fold(iso + 1.0, f64::max);
    let field = Field { dims, values, iso, far, voxel };
    (if field.is_thin() { Kind::Thin } else { kind }, field)
}

fn mask(random: &mut Random, dims: [usize; 3], voxel: Vec3, [iso, scale]: [f64; 2], values: &mut [f64]) {
    let middle = Vec3::from(dims.map(|n| 0.5 * (n - 1) as f32)) * voxel;
    let normal =
        Vec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize_or(Vec3::X);
    let (kind, depth) = (random.below(3), 6.0 * (random.unit() - 0.5));
    let mut k = 0;
    _ = for_each_voxel(dims, |p| {
        let is_masked = match kind {
            0 => (p * voxel - middle).dot(normal) > depth,
            1 => (p * voxel - middle).length() > 11.0 + depth,
            _ => values[k] < iso,
        };
        if is_masked {
            values[k] = f64::NAN;
        } else if kind == 2 {
            // All that is not NaN is clearly object.
            values[k] += 6.0 * scale;
        }
        k += 1;
        0.0
    });
}

impl Field {
    fn at(&self, [x, y, z]: [usize; 3]) -> f64 {
        self.values[x + self.dims[0] * (y + self.dims[1] * z)]
    }

    /// Returns the difference of a voxel of the padded image from the iso value: beyond the border and at NaN
    /// that of the object beside, with the other sign.
    fn depth(&self, padded: [usize; 3]) -> f64 {
        let voxel = padded.map(|k| k.wrapping_sub(1));
        let is_within = |voxel: [usize; 3]| (0..3).all(|axis| voxel[axis] < self.dims[axis]);
        if is_within(voxel) && !self.at(voxel).is_nan() {
            return self.at(voxel) - self.iso;
        }
        let mut beside = Vec::new();
        if is_within(voxel) {
            for axis in 0..3 {
                for step in [1, usize::MAX] {
                    let mut other = voxel;
                    other[axis] = other[axis].wrapping_add(step);
                    if is_within(other) && self.at(other) >= self.iso {
                        beside.push(self.at(other) - self.iso);
                    }
                }
            }
        } else {
            let nearest = [0, 1, 2].map(|axis| padded[axis].clamp(1, self.dims[axis]) - 1);
            let value = self.at(nearest);
            beside.extend((value >= self.iso).then_some(value - self.iso));
        }
        if beside.is_empty() { self.far } else { -beside.iter().sum::<f64>() / beside.len() as f64 }
    }

    /// Returns whether the object or the background has parts or connections of less than three voxels: whether its
    /// components or their Euler characteristics are others if a layer of voxels is taken from it or added to it.
    fn is_thin(&self) -> bool {
        let padded = self.dims.map(|n| n + 4);
        let is_object: Vec<bool> = (0..padded.iter().product())
            .map(|k| {
                let at = [k % padded[0], k / padded[0] % padded[1], k / padded[0] / padded[1]];
                let voxel = at.map(|k: usize| k.wrapping_sub(2));
                (0..3).all(|axis| voxel[axis] < self.dims[axis]) && self.at(voxel) >= self.iso
            })
            .collect();
        let topology = |is_object: &[bool]| {
            let Figures { parts, euler, .. } = counted(padded, [1; 3], is_object);
            (parts, euler)
        };
        let expected = topology(&is_object);
        [false, true].into_iter().any(|grown| topology(&changed(padded, &is_object, grown)) != expected)
    }

    /// Counts the upsampled voxels that are object.
    fn counted(&self) -> Figures {
        let upsampled = self.voxel.to_array().map(|side| (side * UPSAMPLED).round() as usize);
        let padded = self.dims.map(|n| n + 2);
        let mut depths = Vec::new();
        for z in 0..padded[2] {
            for y in 0..padded[1] {
                depths.extend((0..padded[0]).map(|x| self.depth([x, y, z])));
            }
        }
        let fine = [0, 1, 2].map(|axis| (padded[axis] - 1) * upsampled[axis] + 1);
        let mut is_object = Vec::with_capacity(fine.iter().product());
        let split = |k: usize, axis: usize| {
            let low = (k / upsampled[axis]).min(padded[axis] - 2);
            (low, (k - low * upsampled[axis]) as f64 / upsampled[axis] as f64)
        };
        let row = |y: usize, z: usize| padded[0] * (y + padded[1] * z);
        for z in 0..fine[2] {
            let (z, c) = split(z, 2);
            for y in 0..fine[1] {
                let (y, b) = split(y, 1);
                let weights = [
                    (row(y, z), (1.0 - b) * (1.0 - c)),
                    (row(y + 1, z), b * (1.0 - c)),
                    (row(y, z + 1), (1.0 - b) * c),
                    (row(y + 1, z + 1), b * c),
                ];
                let line: Vec<f64> = (0..padded[0])
                    .map(|x| weights.iter().map(|&(row, weight)| weight * depths[row + x]).sum())
                    .collect();
                is_object.extend((0..fine[0]).map(|x| {
                    let (x, a) = split(x, 0);
                    line[x] * (1.0 - a) + line[x + 1] * a >= 0.0
                }));
            }
        }
        let interpolated = |at: [f64; 3]| {
            let located = [0, 1, 2].map(|axis| {
                let low = (at[axis].max(0.0) as usize).min(padded[axis] - 2);
                (low, (at[axis] - low as f64).clamp(0.0, 1.0))
            });
            let corner = |k: usize| {
                let [(x, a), (y, b), (z, c)] = located;
                let weight = |bit: usize, share: f64| if k >> bit & 1 == 1 { share } else { 1.0 - share };
                let value = depths[row(y + (k >> 1 & 1), z + (k >> 2)) + x + (k & 1)];
                weight(0, a) * weight(1, b) * weight(2, c) * value
            };
            (0..8).map(corner).sum::<f64>()
        };
        let volume = volume_of(fine, upsampled, &is_object, &interpolated);
        Figures { volume, ..counted(fine, upsampled, &is_object) }
    }

    fn volume(&self, sign: f64) -> Volume {
        let values: Vec<f64> = self.values.iter().map(|value| sign * value).collect();
        let is_exact = values.iter().all(|&value| f64::from(value as f32) == value);
        let is_integer = |low: f64, high: f64| {
            values.iter().all(|&value| value.round() == value && value >= low && value <= high)
        };
        let voxels = if is_integer(-32768.0, 32767.0) {
            Voxels::I16(values.iter().map(|&value| value as i16).collect())
        } else if is_integer(0.0, f64::from(u32::MAX)) {
            Voxels::U32(values.iter().map(|&value| value as u32).collect())
        } else if is_exact || self.iso.abs() < 1e6 {
            Voxels::F32(values.iter().map(|&value| value as f32).collect())
        } else {
            Voxels::F64(values)
        };
        let [nx, ny, nz] = self.dims;
        let affine = DAffine3::from_scale(self.voxel.as_dvec3());
        Volume::new(VolumeInit { affine, ..VolumeInit::new(voxels, [nx, ny, nz, 1]) }).unwrap()
    }
}

/// Returns the volume where an interpolated image is not negative: that of upsampled voxels of the object, of those at its
/// surface that of their parts.
fn volume_of(
    [nx, ny, nz]: [usize; 3],
    upsampled: [usize; 3],
    is_object: &[bool],
    interpolated: &dyn Fn([f64; 3]) -> f64,
) -> f64 {
    let mut count = 0;
    for (k, &own) in is_object.iter().enumerate() {
        let at = [k % nx, k / nx % ny, k / nx / ny];
        let is_same = |axis: usize, other: usize| {
            let mut place = at;
            place[axis] = other.min([nx, ny, nz][axis] - 1);
            is_object[place[0] + nx * (place[1] + ny * place[2])] == own
        };
        if (0..3).all(|axis| is_same(axis, at[axis].saturating_sub(1)) && is_same(axis, at[axis] + 1)) {
            count += if own { PARTS.pow(3) } else { 0 };
            continue;
        }
        for part in 0..PARTS.pow(3) {
            let offset = [part % PARTS, part / PARTS % PARTS, part / PARTS / PARTS]
                .map(|i| (i as f64 + 0.5) / PARTS as f64 - 0.5);
            let place = [0, 1, 2].map(|axis| (at[axis] as f64 + offset[axis]) / upsampled[axis] as f64);
            count += usize::from(interpolated(place) >= 0.0);
        }
    }
    count as f64 / (PARTS.pow(3) * upsampled.iter().product::<usize>()) as f64
}

/// Counts the voxels of an image, its parts, connected through faces, and its cavities, and the Euler characteristic of
/// its surface.
fn counted([nx, ny, nz]: [usize; 3], upsampled: [usize; 3], is_object: &[bool]) -> Figures {
    let at = |x: usize, y: usize, z: usize| x < nx && y < ny && z < nz && is_object[x + nx * (y + ny * z)];
    let (mut euler, mut count) = (0i64, 0i64);
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                if !at(x, y, z) {
                    continue;
                }
                count += 1;
                // Cells of the dual complex: a voxel, pairs, squares and cubes of voxels.
                let [a, b, c] = [at(x + 1, y, z), at(x, y + 1, z), at(x, y, z + 1)];
                let [ab, bc, ca] = [at(x + 1, y + 1, z), at(x, y + 1, z + 1), at(x + 1, y, z + 1)];
                let pairs = i64::from(a) + i64::from(b) + i64::from(c);
                let squares = i64::from(a && b && ab) + i64::from(b && c && bc) + i64::from(c && a && ca);
                let cube = i64::from(a && b && c && ab && bc && ca && at(x + 1, y + 1, z + 1));
                euler += 1 - pairs + squares - cube;
            }
        }
    }
    let parts = parts_of([nx, ny, nz], is_object, true) + parts_of([nx, ny, nz], is_object, false) - 1;
    Figures { parts, euler: 2 * euler, volume: count as f64 / upsampled.iter().product::<usize>() as f64 }
}

/// Returns an object without its outermost layer of voxels, or with one more.
fn changed(dims: [usize; 3], is_object: &[bool], grown: bool) -> Vec<bool> {
    let mut now = is_object.to_vec();
    let mut step = 1;
    for n in dims {
        let before = now.clone();
        for k in 0..now.len() {
            let at = k / step % n;
            let beside = [(at > 0).then(|| before[k - step]), (at + 1 < n).then(|| before[k + step])];
            if beside.into_iter().flatten().any(|other| other == grown) {
                now[k] = grown;
            }
        }
        step *= n;
    }
    now
}

/// Returns the number of connected parts of the object, connected through faces, or of the background, also through edges
/// and corners.
fn parts_of([nx, ny, nz]: [usize; 3], is_object: &[bool], of_object: bool) -> i64 {
    // The neighbours that come before a voxel.
    let mut before = Vec::new();
    for shift in 0..13usize {
        let by = [shift % 3, shift / 3 % 3, shift / 9].map(|step| step as isize - 1);
        if !of_object || by.iter().filter(|&&step| step != 0).count() == 1 {
            before.push(by);
        }
    }
    let mut groups: Vec<u32> = (0..is_object.len() as u32).collect();
    fn find(groups: &mut [u32], mut k: u32) -> u32 {
        while groups[k as usize] != k {
            groups[k as usize] = groups[groups[k as usize] as usize];
            k = groups[k as usize];
        }
        k
    }
    let mut parts = 0;
    for k in 0..is_object.len() {
        if is_object[k] != of_object {
            continue;
        }
        parts += 1;
        let at = [k % nx, k / nx % ny, k / nx / ny];
        for by in &before {
            let [x, y, z] = [0, 1, 2].map(|axis| at[axis].wrapping_add_signed(by[axis]));
            let other = x.wrapping_add(nx.wrapping_mul(y.wrapping_add(ny.wrapping_mul(z))));
            if x < nx && y < ny && z < nz && is_object[other] == of_object {
                let [a, b] = [k, other].map(|k| find(&mut groups, k as u32));
                if a != b {
                    groups[a as usize] = b;
                    parts -= 1;
                }
            }
        }
    }
    parts
}

fn model_of(field: &Field, sign: f64) -> Result<(Figures, bool), String> {
    let volume = field.volume(sign);
    let defaults = DeformableParams::default();
    let params = DeformableParams {
        iso: sign * field.iso,
        iso_force: sign * defaults.iso_force,
        smallest_part: 1.0,
        ..defaults
    };
    let options = DeformableOptions { params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options).map_err(|error| error.to_string())?;
    for _ in 0..600 {
        let report = model.step().map_err(|error| error.to_string())?;
        if report.done {
            return Ok((Figures::of(&model.surface()), !report.warnings.is_empty()));
        }
    }
    Err("not done".into())
}

fn labels_of(field: &Field) -> Result<(Figures, f64), String> {
    let mask = field.volume(1.0).threshold(field.iso, f64::INFINITY).unwrap();
    let labels = mask.labels(0).unwrap();
    let count = labels.iter().map(|label| label.voxels).sum::<usize>() as f64;
    if labels.is_empty() {
        return Ok((Figures::default(), count));
    }
    let mut surfaces =
        LabelSurfaces::new(&mask, None, LabelParams::default()).map_err(|error| error.to_string())?;
    while !surfaces.step().map_err(|error| error.to_string())?.done {}
    Ok((Figures::of(&surfaces.mesh(1.0).map_err(|error| error.to_string())?), count))
}

/// How a surface compares with the count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    Agrees,
    Refused,
    Warned,
    OtherVolume,
    OtherTopology,
}

fn outcome(found: &Result<(Figures, bool), String>, expected: Figures) -> Outcome {
    match found {
        Err(_) => Outcome::Refused,
        Ok((_, true)) => Outcome::Warned,
        Ok((found, _)) if !found.has_topology_of(expected) => Outcome::OtherTopology,
        Ok((found, _)) if (found.volume - expected.volume).abs() > TOLERANCE * expected.volume => {
            Outcome::OtherVolume
        }
        Ok(_) => Outcome::Agrees,
    }
}

/// The outcomes of some fields, by kind and method.
#[derive(Default)]
struct Tally {
    counts: BTreeMap<(Kind, &'static str, Outcome), usize>,
    /// The sum of relative differences of volume, of those of the right topology, and the largest.
    differences: BTreeMap<(Kind, &'static str), (f64, f64, usize)>,
}

impl Tally {
    fn add(
        &mut self,
        seed: u64,
        kind: Kind,
        method: &'static str,
        found: &Result<(Figures, bool), String>,
        expected: Figures,
    ) {
        let outcome = outcome(found, expected);
        *self.counts.entry((kind, method, outcome)).or_default() += 1;
        if let Ok((found, _)) = found
            && found.has_topology_of(expected)
            && expected.volume > 0.0
        {
            let difference = found.volume / expected.volume - 1.0;
            let (sum, most, count) = self.differences.entry((kind, method)).or_default();
            (*sum, *count) = (*sum + difference, *count + 1);
            *most = if difference.abs() > most.abs() { difference } else { *most };
        }
        if outcome != Outcome::Agrees {
            println!("seed {seed} {kind:?} {method} {outcome:?}: {found:?} for {expected:?}");
        }
    }

    fn print(&self) {
        for ((kind, method, outcome), count) in &self.counts {
            println!("{kind:?} {method} {outcome:?}: {count}");
        }
        for ((kind, method), (sum, most, count)) in &self.differences {
            println!(
                "{kind:?} {method} volume: mean {:+.2} %, largest {:+.2} %",
                100.0 * sum / *count as f64,
                100.0 * most
            );
        }
    }

    fn count(&self, method: &str, outcome: Outcome) -> usize {
        self.counts
            .iter()
            .filter(|((_, of, is), _)| *of == method && *is == outcome)
            .map(|(_, count)| count)
            .sum()
    }
}

fn compare(seeds: std::ops::Range<u64>, voxel: impl Fn(&mut Random) -> Vec3) -> Tally {
    let mut tally = Tally::default();
    let mut count = 0;
    for seed in seeds {
        let _named = Named::new(seed);
        let voxel = voxel(&mut Random(!seed));
        let (kind, field) = field(seed, voxel);
        if !field.values.iter().any(|value| value.is_finite()) {
            continue;
        }
        count += 1;
        // In world units.
        let voxel = f64::from(voxel.element_product());
        let in_world = |figures: Figures| Figures { volume: figures.volume * voxel, ..figures };
        let counted = in_world(field.counted());
        let contour = marching_cubes_world(&field.volume(1.0), field.iso, 0).unwrap();
        tally.add(seed, kind, "marching cubes", &Ok((Figures::of(&contour), false)), counted);
        let sign = if seed % 5 == 0 { -1.0 } else { 1.0 };
        tally.add(seed, kind, "model", &model_of(&field, sign), counted);
        let labels = labels_of(&field);
        let expected = labels.as_ref().map_or(0.0, |(_, count)| *count * voxel);
        let labels = labels.map(|(figures, _)| (figures, false));
        tally.add(seed, kind, "labels", &labels, Figures { volume: expected, ..counted });
    }
    println!("{count} fields");
    tally.print();
    tally
}

/// Returns the size of voxels up to twenty times as long along one axis as along the others.
fn anisotropic(random: &mut Random) -> Vec3 {
    let mut voxel = Vec3::ONE;
    voxel[random.below(3)] = random.within(1.0, 20.0) as f32;
    voxel
}

/// Asserts that on fields without thin features no method was refused or has another topology, and that nearly all volumes
/// agree: the contour of a stepped or a small object lacks up to three percent of linear interpolation.
fn assert_agreement(tally: &Tally) {
    let (mut agree, mut differ) = (0, 0);
    for (&(kind, method, outcome), count) in tally.counts.iter().filter(|((kind, ..), _)| *kind != Kind::Thin)
    {
        match outcome {
            Outcome::Agrees | Outcome::Warned => agree += count,
            Outcome::OtherVolume => differ += count,
            Outcome::Refused | Outcome::OtherTopology => panic!("{count} {kind:?} {method}: {outcome:?}"),
        }
    }
    assert!(differ * 25 <= agree + differ, "{differ} volumes differ, {agree} agree");
    for (&(kind, method), &(_, most, _)) in
        tally.differences.iter().filter(|((kind, _), _)| *kind != Kind::Thin)
    {
        assert!(most.abs() < 0.04, "{kind:?} {method}: {most}");
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn random_fields_are_seen_alike() {
    let tally = compare(seeds(4), |_| Vec3::ONE);
    assert_agreement(&tally);
    assert_at_least(3, tally.count("model", Outcome::Agrees), "fields that the model agrees on");
}

#[test]
#[ignore = "long: npm run test:all"]
fn a_thousand_random_fields_are_seen_alike() {
    let tally = compare(seeds(1000), |_| Vec3::ONE);
    assert_agreement(&tally);
    assert_at_least(900, tally.count("model", Outcome::Agrees), "fields that the model agrees on");
}

/// Prints how voxels up to 1 × 1 × 20 are seen; the shape between slices is that of linear interpolation.
#[test]
#[ignore = "long: npm run test:all"]
fn two_hundred_anisotropic_fields_are_compared() {
    let tally = compare(seeds(200), anisotropic);
    assert_at_least(
        80,
        tally.count("marching cubes", Outcome::Agrees),
        "fields that marching cubes agrees on",
    );
}
