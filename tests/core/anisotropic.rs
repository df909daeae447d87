//! Random shapes in elongated voxels, from 1 × 1 × 1 to 1 × 1 × 20 in all orders of the axes: the model has the components,
//! the topology and the volume of the linearly upsampled image.
//!
//! The expected figures are counted on voxels of that image, half as long as the shortest side, without the crate: χ of
//! the surface is twice that of its object. A shape is ambiguous, and left out before the model runs, if these figures
//! depend on the connectivity of voxels (6 or 26), or on the iso value within [`TOLERANCE`], or if a part is about as
//! large as the smallest part. A failing seed is printed; `FUZZ_SEEDS=<first>..<last>` runs other seeds.

use super::common::{Named, Random, assert_at_least, seeds};
use std::f32::consts::TAU;
use vesicle::math::{DAffine3, DMat3, DVec3, Mat3, Vec3};
use vesicle::mesh::{count_self_intersections, measure};
use vesicle::methods::MethodError;
use vesicle::methods::deformable::{
    DeformableModel, DeformableOptions, DeformableParams, Seeding, SparseOptions, Start,
};
use vesicle::volume::{
    BrickBox, Grid, Region, SparseInit, SparseLevel, SparseVolume, Volume, VolumeInit, Voxels, marching_cubes,
};
use vesicle::warning::WarningCode;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// The change of the iso value that must not change the topology, in shortest sides of a voxel: surfaces are exact to
/// about 0.15 voxels, and a neck or a gap that vanishes within that may go either way.
const TOLERANCE: f32 = 0.25;

/// The default of the parameter `smallest_part`, in voxels, and the factor around it within which a part is ambiguous.
const SMALLEST_PART: f64 = 64.0;
const AROUND_SMALLEST: f64 = 1.5;

/// Largest accepted difference of the volume from that of the iso-surface of the linearly upsampled image; and the largest
/// mean offset of the surface, in shortest sides of a voxel, with which the volume may differ by more: shapes of four
/// sides across lose 2 % by an offset of 0.02, as in voxels that are cubes.
const VOLUME: f64 = 0.01;
const OFFSET: f64 = 0.05;

/// The number of steps by which the shortest side of a voxel is divided to count.
const FINER: usize = 2;

/// A shape by its depth, approximately the distance from its surface, positive inside.
enum Shape {
    /// Inside the unit ball in coordinates mapped by the matrix; the length is the mean half axis.
    Ellipsoid(Vec3, Mat3, f32),
    /// Ring radius and tube radius around an axis.
    Torus(Vec3, Vec3, [f32; 2]),
    /// A tube around a polygon.
    Tube(Vec<Vec3>, f32),
    Union(Vec<Shape>),
    /// The first shape without the others.
    Without(Box<Shape>, Vec<Shape>),
}

impl Shape {
    fn depth(&self, p: Vec3) -> f32 {
        match self {
            Self::Ellipsoid(centre, to_unit, size) => size * (1.0 - (*to_unit * (p - *centre)).length()),
            Self::Torus(centre, axis, [ring, tube]) => {
                let along = (p - *centre).dot(*axis);
                let across = (p - *centre - *axis * along).length() - ring;
                tube - (along * along + across * across).sqrt()
            }
            Self::Tube(points, radius) => {
                radius - points.windows(2).map(|ends| to_segment(p, ends)).fold(f32::INFINITY, f32::min)
            }
            Self::Union(parts) => parts.iter().map(|part| part.depth(p)).fold(f32::NEG_INFINITY, f32::max),
            Self::Without(whole, holes) => {
                holes.iter().map(|hole| -hole.depth(p)).fold(whole.depth(p), f32::min)
            }
        }
    }
}

fn to_segment(p: Vec3, ends: &[Vec3]) -> f32 {
    let (a, b) = (ends[0], ends[1]);
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a + (b - a) * t)
}

fn between(random: &mut Random, low: f32, high: f32) -> f32 {
    low + (high - low) * random.unit()
}

fn random_vector(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0
}

fn rotation(random: &mut Random) -> Mat3 {
    let axis = (random_vector(random) + Vec3::splat(1e-3)).normalize();
    Mat3::from_axis_angle(axis, random.unit() * TAU)
}

/// An ellipsoid with half axes from `low` to `high` times those of the box, sheared and rotated a little.
fn ellipsoid(random: &mut Random, centre: Vec3, half: Vec3, [low, high]: [f32; 2]) -> Shape {
    let axes = Vec3::from([0, 1, 2].map(|k| half[k] * between(random, low, high)));
    let mut shear = Mat3::IDENTITY;
    for (i, j) in [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)] {
        shear.col_mut(i)[j] = between(random, -0.4, 0.4);
    }
    let from_unit = Mat3::from_diagonal(half) * shear * Mat3::from_diagonal(axes / half);
    Shape::Ellipsoid(centre, from_unit.inverse(), libm::cbrtf(axes.element_product()))
}

/// A random shape in a box around the origin.
fn shape(random: &mut Random, half: Vec3) -> (&'static str, Shape) {
    let centre = random_vector(random) * 0.08 * half;
    let least = half.min_element();
    match random.below(8) {
        0 => ("ellipsoid", ellipsoid(random, centre, half, [0.35, 0.7])),
        1 => {
            let size = between(random, 0.35, 0.6) * least;
            let turned = rotation(random) * Mat3::from_diagonal(Vec3::new(1.4, 1.0, 0.6) * size);
            ("oblique ellipsoid", Shape::Ellipsoid(centre, turned.inverse(), size))
        }
        2 => {
            let ring = between(random, 0.45, 0.6) * least;
            let tube = between(random, 0.3, 0.5) * ring;
            ("torus", Shape::Torus(centre, rotation(random) * Vec3::Z, [ring, tube]))
        }
        3 => {
            let shift = random_vector(random) * 0.3 * half;
            let parts = [centre + shift, centre - shift].map(|at| ellipsoid(random, at, half, [0.25, 0.5]));
            ("union", Shape::Union(parts.into()))
        }
        4 => {
            // Parts whose gap is a few shortest sides wide.
            let axis = random.below(3);
            let side = Vec3::AXES[axis] * half[axis];
            let parts =
                [-0.42, 0.42].map(|share| ellipsoid(random, centre + side * share, half, [0.25, 0.45]));
            ("two near parts", Shape::Union(parts.into()))
        }
        5 => {
            let mut at = -half * 0.6;
            let mut points = vec![at];
            for k in 1..4 {
                at = half * (0.4 * k as f32 - 0.6) + random_vector(random) * 0.25 * half;
                points.push(at);
            }
            ("tube", Shape::Tube(points, between(random, 0.2, 0.35) * least))
        }
        6 => {
            let whole = ellipsoid(random, centre, half, [0.6, 0.75]);
            let hole = ellipsoid(random, centre, half, [0.25, 0.35]);
            ("shell", Shape::Without(Box::new(whole), vec![hole]))
        }
        _ => {
            let whole = ellipsoid(random, centre, half, [0.55, 0.75]);
            let through = random_vector(random).normalize() * half * 1.5;
            let hole =
                Shape::Tube(vec![centre - through, centre + through], between(random, 0.15, 0.25) * least);
            ("pierced", Shape::Without(Box::new(whole), vec![hole]))
        }
    }
}

/// How the intensities of voxels follow from the depth.
#[derive(Clone, Copy, Debug)]
enum Profile {
    /// The depth, however far.
    Distance,
    /// The depth at the centre, up to two shortest sides.
    Edge,
    /// The mean over the voxel of what is inside, as a scanner measures it.
    Partial,
    /// 1 or 0 by the centre, as a mask.
    Mask,
}

struct Case {
    name: String,
    volume: Volume,
    sides: [f32; 3],
    iso: f32,
    /// The change of intensity over the shortest side of a voxel across the surface.
    per_side: f32,
    options: (&'static str, DeformableOptions),
}

fn case(seed: u64) -> Case {
    let random = &mut Random(seed);
    let long = |random: &mut Random| libm::powf(20.0, random.unit());
    let longest = long(random);
    let mut sides = match random.below(6) {
        0 => [1.0, longest, longest],
        1 => [1.0, between(random, 1.0, 2.0), longest],
        2 => [1.0, long(random), longest],
        _ => [1.0, 1.0, longest],
    };
    for k in [2, 1] {
        sides.swap(k, random.below(k + 1));
    }
    let dims = sides.map(|side| if side < 2.5 { 40 } else { (70.0 / side) as usize }).map(|n| n.max(7));
    let half = Vec3::from([0, 1, 2].map(|k| 0.5 * (dims[k] - 2) as f32 * sides[k]));
    let (kind, shape) = shape(random, half);
    let profile = [Profile::Distance, Profile::Edge, Profile::Partial, Profile::Mask][random.below(4)];
    let value = |p: Vec3| match profile {
        Profile::Distance => shape.depth(p),
        Profile::Edge => shape.depth(p).clamp(-2.0, 2.0),
        Profile::Mask => f32::from(u8::from(shape.depth(p) > 0.0)),
        Profile::Partial => {
            let mut sum = 0.0;
            for k in 0..27 {
                let at = [k % 3, k / 3 % 3, k / 9].map(|i| (i as f32 - 1.0) / 3.0);
                let depth = shape.depth(p + Vec3::from(at) * Vec3::from(sides));
                sum += (depth + 0.5).clamp(0.0, 1.0);
            }
            sum / 27.0
        }
    };
    let mut values = Vec::new();
    for k in 0..dims.iter().product::<usize>() {
        let index = [k % dims[0], k / dims[0] % dims[1], k / dims[0] / dims[1]];
        let at = Vec3::from([0, 1, 2].map(|a| (index[a] as f32 - 0.5 * (dims[a] - 1) as f32) * sides[a]));
        values.push(value(at));
    }
    let (iso, per_side) = match profile {
        Profile::Distance | Profile::Edge => (0.0, 1.0),
        Profile::Partial | Profile::Mask => (0.5, 0.3),
    };
    let mut affine = DAffine3::from_scale(DVec3::from(sides.map(f64::from)));
    if random.below(2) == 0 {
        let turn = rotation(random).as_dmat3();
        let flip = DMat3::from_diagonal(DVec3::new(if random.below(2) == 0 { -1.0 } else { 1.0 }, 1.0, 1.0));
        affine = DAffine3::from_mat3_translation(turn * flip * affine.matrix3, DVec3::new(30.0, -70.0, 12.0));
    }
    let [x, y, z] = dims;
    let volume =
        Volume::new(VolumeInit { affine, ..VolumeInit::new(Voxels::F32(values), [x, y, z, 1]) }).unwrap();
    let params = DeformableParams { iso: iso.into(), ..DeformableParams::for_volume(&volume) };
    let plain = DeformableOptions { params: Some(params.clone()), ..Default::default() };
    let options = match random.below(4) {
        0 => ("default", plain),
        1 if seed.is_multiple_of(2) => ("levels 1", DeformableOptions { levels: 1, ..plain }),
        1 => ("levels 2", DeformableOptions { levels: 2, ..plain }),
        2 => {
            // Other starts than the contour do not search for cavities by default.
            let seeding = if kind == "shell" { Seeding::On } else { Seeding::Auto };
            let params = Some(DeformableParams { seeding, ..params });
            ("enclosing", DeformableOptions { start: Start::Enclosing, params, ..plain })
        }
        _ => {
            let params = Some(DeformableParams { adaptivity: 0.5, ..params });
            ("adaptivity 0.5", DeformableOptions { params, ..plain })
        }
    };
    let shown = sides.map(|side| format!("{side:.1}")).join(" × ");
    let name = format!("seed {seed}: {kind}, {profile:?}, {shown}, {dims:?}, {}", options.0);
    Case { name, volume, sides, iso, per_side, options }
}

/// The linearly upsampled image: intensities at steps of about 1/[`FINER`] of the shortest side, between the centres of
/// the outermost voxels, within one layer of background.
struct Upsampled {
    grid: Grid,
    voxel: f64,
}

fn upsampled(case: &Case) -> Option<Upsampled> {
    let grid = case.volume.grid(0).unwrap();
    let steps = case.sides.map(|side| ((side * FINER as f32).round() as usize).max(1));
    // Only the box of the voxels that may be inside, and their neighbours.
    let (mut low, mut high) = (grid.dims, [0; 3]);
    for (k, _) in grid.values.iter().enumerate().filter(|(_, value)| **value >= case.iso - case.per_side) {
        let at = [k % grid.dims[0], k / grid.dims[0] % grid.dims[1], k / grid.dims[0] / grid.dims[1]];
        for axis in 0..3 {
            low[axis] = low[axis].min(at[axis].saturating_sub(1));
            high[axis] = high[axis].max((at[axis] + 1).min(grid.dims[axis] - 1));
        }
    }
    if low == grid.dims {
        return None;
    }
    let dims = [0, 1, 2].map(|k| (high[k] - low[k]) * steps[k] + 3);
    let mut values = vec![f32::MIN; dims.iter().product()];
    for z in 1..dims[2] - 1 {
        for y in 1..dims[1] - 1 {
            for x in 1..dims[0] - 1 {
                let at = [x, y, z].map(|k| k - 1);
                let p = Vec3::from([0, 1, 2].map(|k| low[k] as f32 + at[k] as f32 / steps[k] as f32));
                values[x + dims[0] * (y + dims[1] * z)] = grid.sample(p);
            }
        }
    }
    let voxel = (0..3).map(|k| f64::from(case.sides[k]) / steps[k] as f64).product();
    Some(Upsampled { grid: Grid { dims, values }, voxel })
}

/// Components, cavities included, and the Euler characteristic of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Topology {
    components: usize,
    euler: i64,
}

/// Counts on voxels at or above `iso`, without parts and cavities of less than `smallest` of them; `None` if one has
/// about as many, or if one has fewer and the run does not leave it out (only contours do).
fn topology(grid: &Grid, iso: f32, is_26: bool, smallest: f64, leaves_out: bool) -> Option<Topology> {
    let mut inside: Vec<bool> = grid.values.iter().map(|&value| value >= iso).collect();
    for phase in [true, false] {
        let connects_corners = is_26 == phase;
        // The first part of the background is around the object.
        for part in parts(&inside, phase, grid.dims, connects_corners).split_off(usize::from(!phase)) {
            let share = part.len() as f64 / smallest;
            let is_near = share > 1.0 / AROUND_SMALLEST && share < AROUND_SMALLEST;
            if is_near || (share < 1.0 && !leaves_out) {
                return None;
            }
            if share < 1.0 {
                part.iter().for_each(|&k| inside[k] = !phase);
            }
        }
    }
    let count = |phase| parts(&inside, phase, grid.dims, is_26 == phase).len();
    let (solids, backgrounds) = (count(true), count(false));
    let euler = if is_26 { euler_26(&inside, grid.dims) } else { euler_6(&inside, grid.dims) };
    Some(Topology { components: solids + backgrounds - 1, euler: 2 * euler })
}

/// Returns the connected parts of one phase; the outermost layer is background, and belongs to its first part.
fn parts(inside: &[bool], phase: bool, dims: [usize; 3], connects_corners: bool) -> Vec<Vec<usize>> {
    let [nx, ny, nz] = dims;
    let mut seen: Vec<bool> = inside.iter().map(|&value| value != phase).collect();
    let is_outermost = |k: usize| {
        let (x, y, z) = (k % nx, k / nx % ny, k / nx / ny);
        x == 0 || y == 0 || z == 0 || x + 1 == nx || y + 1 == ny || z + 1 == nz
    };
    let outermost: Vec<bool> = (0..inside.len()).map(is_outermost).collect();
    let mut found = Vec::new();
    let mut starts = Vec::new();
    if !phase {
        let layer: Vec<usize> = (0..inside.len()).filter(|&k| outermost[k]).collect();
        layer.iter().for_each(|&k| seen[k] = true);
        starts.push(layer);
    }
    let shifts: Vec<isize> = (0..27isize)
        .map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
        .filter(|shift| {
            let moved = shift.iter().filter(|&&k| k != 0).count();
            moved == 1 || (connects_corners && moved > 1)
        })
        .map(|[x, y, z]| x + nx as isize * (y + ny as isize * z))
        .collect();
    for first in 0..=inside.len() {
        let mut part = match starts.pop() {
            Some(layer) => layer,
            None if first == 0 || std::mem::replace(&mut seen[first - 1], true) => continue,
            None => vec![first - 1],
        };
        let mut next = 0;
        while next < part.len() {
            let k = part[next];
            next += 1;
            let end = inside.len();
            for shift in &shifts {
                let other = k.wrapping_add_signed(*shift);
                // Steps from the outermost layer may wrap around, but only to that layer, which was seen.
                if other < end && !seen[other] && (!outermost[k] || is_beside(k, other, dims)) {
                    seen[other] = true;
                    part.push(other);
                }
            }
        }
        found.push(part);
    }
    found
}

fn is_beside(k: usize, other: usize, [nx, ny, _]: [usize; 3]) -> bool {
    let at = |k: usize| [k % nx, k / nx % ny, k / nx / ny];
    let (a, b) = (at(k), at(other));
    (0..3).all(|axis| a[axis].abs_diff(b[axis]) <= 1)
}

/// The Euler characteristic of the union of closed voxels: each vertex, edge, face and voxel once.
fn euler_26(inside: &[bool], dims: [usize; 3]) -> i64 {
    -sum_over_cells(inside, dims, |of_cell, back| (0..8).any(|k| k & !back == 0 && of_cell >> k & 1 == 1))
}

/// The Euler characteristic of the voxels as vertices, with an edge, a square and a cube for each two, four and eight
/// that are all inside.
fn euler_6(inside: &[bool], dims: [usize; 3]) -> i64 {
    sum_over_cells(inside, dims, |of_cell, back| (0..8).all(|k| k & !back != 0 || of_cell >> k & 1 == 1))
}

/// Returns the sum over all cells that `counts`: 1 if the set `back` of axes (bits) has an even number, else −1. A cell is
/// given by the voxels at its first corner and before it along the axes, as bits, and by the axes along which it has two.
fn sum_over_cells(inside: &[bool], dims: [usize; 3], counts: impl Fn(u8, u8) -> bool) -> i64 {
    let [nx, ny, _] = dims;
    let steps: Vec<usize> = (0..8).map(|k| (k & 1) + nx * (k >> 1 & 1) + nx * ny * (k >> 2 & 1)).collect();
    let mut table = [0i64; 256];
    for (of_cell, sum) in table.iter_mut().enumerate() {
        for back in 0..8u8 {
            let sign = if back.count_ones() % 2 == 0 { 1 } else { -1 };
            *sum += if counts(of_cell as u8, back) { sign } else { 0 };
        }
    }
    let mut euler = 0;
    for k in (1 + nx + nx * ny)..inside.len() {
        let of_cell =
            steps.iter().enumerate().fold(0, |bits, (bit, step)| bits | usize::from(inside[k - step]) << bit);
        euler += table[of_cell];
    }
    euler
}

/// Returns the topology and the volume of the iso-surface of the linearly upsampled image; `None` if ambiguous.
fn expected(case: &Case) -> Option<(Topology, f64)> {
    let Upsampled { grid, voxel } = upsampled(case)?;
    let voxel_of_image: f64 = case.sides.map(f64::from).iter().product();
    let smallest = SMALLEST_PART * voxel_of_image / voxel;
    let change = TOLERANCE * case.per_side;
    let mut counts =
        [-change, 0.0, change].into_iter().flat_map(|offset| [false, true].map(|is_26| (offset, is_26)));
    let leaves_out = case.options.0 != "enclosing";
    let (offset, is_26) = counts.next()?;
    let first = topology(&grid, case.iso + offset, is_26, smallest, leaves_out)?;
    for (offset, is_26) in counts {
        if topology(&grid, case.iso + offset, is_26, smallest, leaves_out)? != first {
            return None;
        }
    }
    let contour = marching_cubes(&grid, case.iso).unwrap().without_components_below(smallest);
    (first.components > 0).then(|| (first, measure(&contour).volume * voxel))
}

/// The figures of a sweep.
#[derive(Default, Debug)]
struct Figures {
    ambiguous: usize,
    right: usize,
    divided: usize,
    wrong: Vec<String>,
    /// Of shapes in voxels more than twice as long as wide: the largest error of the volume, and the number above 1 %.
    largest_error: f64,
    above: usize,
}

fn sweep(seeds: std::ops::Range<u64>) -> Figures {
    let mut figures = Figures::default();
    for seed in seeds {
        let _named = Named::new(seed);
        let case = case(seed);
        let Some((topology, volume)) = expected(&case) else {
            figures.ambiguous += 1;
            continue;
        };
        let mut model = DeformableModel::new(&case.volume, case.options.1.clone()).unwrap();
        let mut iterations = 0;
        loop {
            let report = model.step().unwrap();
            iterations += 1;
            if report.done || iterations == 2000 {
                break;
            }
        }
        let surface = model.surface();
        let figures_of_surface = measure(&surface);
        let found = Topology { components: surface.components().len(), euler: figures_of_surface.euler };
        let difference = figures_of_surface.volume - volume;
        let error = difference.abs() / volume;
        let is_divided = case.sides.iter().any(|&side| side > 2.0);
        let is_valid =
            count_self_intersections(&model.mesh().to_triangles()) == 0 && model.mesh().check().is_ok();
        let has_volume =
            !is_divided || error <= VOLUME || difference.abs() <= OFFSET * figures_of_surface.area;
        let coverage = model.coverage().unwrap();
        let is_covered = coverage.recall > 0.99 && coverage.precision > 0.99;
        let is_right = found == topology && has_volume && is_valid && is_covered && iterations < 2000;
        println!(
            "{} {}: expected {topology:?}, found {found:?}, volume {:+.2} %, {iterations} iterations, {} vertices",
            if is_right { "right" } else { "WRONG" },
            case.name,
            100.0 * difference / volume,
            surface.positions.len(),
        );
        figures.right += usize::from(is_right);
        if !is_right {
            figures.wrong.push(format!("{}: {found:?} {difference:+.1}, {coverage:?}", case.name));
        }
        if is_divided {
            figures.divided += 1;
            figures.largest_error = figures.largest_error.max(error);
            figures.above += usize::from(error > VOLUME);
        }
    }
    println!(
        "{} right, {} of them in divided voxels, {} wrong, {} ambiguous; volumes in divided voxels: largest error {:.2} %, {} \
         above 1 %",
        figures.right,
        figures.divided,
        figures.wrong.len(),
        figures.ambiguous,
        100.0 * figures.largest_error,
        figures.above
    );
    figures
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn elongated_voxels_have_the_topology_of_the_upsampled_image() {
    let figures = sweep(seeds(6));
    assert_eq!(figures.wrong, Vec::<String>::new());
    assert_at_least(4, figures.right, "shapes");
}

#[test]
#[ignore = "long: npm run test:all"]
fn many_shapes_in_elongated_voxels_have_the_topology_of_the_upsampled_image() {
    let figures = sweep(seeds(400));
    assert_eq!(figures.wrong, Vec::<String>::new());
    assert_at_least(200, figures.divided, "shapes in divided voxels");
}

/// Returns an image of `value`, by position, in voxels with the given sides.
fn image(dims: [usize; 3], sides: [f32; 3], value: impl Fn(Vec3) -> f32) -> Volume {
    let mut values = Vec::new();
    for k in 0..dims.iter().product::<usize>() {
        let index = [k % dims[0], k / dims[0] % dims[1], k / dims[0] / dims[1]];
        values.push(value(Vec3::from([0, 1, 2].map(|a| index[a] as f32 * sides[a]))));
    }
    let affine = DAffine3::from_scale(DVec3::from(sides.map(f64::from)));
    let [x, y, z] = dims;
    Volume::new(VolumeInit { affine, ..VolumeInit::new(Voxels::F32(values), [x, y, z, 1]) }).unwrap()
}

fn options(iso: f64) -> DeformableOptions {
    let params = DeformableParams { iso, ..DeformableParams::default() };
    DeformableOptions { params: Some(params), ..Default::default() }
}

fn settle(model: &mut DeformableModel) {
    for _ in 0..1000 {
        if model.step().unwrap().done {
            assert_eq!(count_self_intersections(&model.mesh().to_triangles()), 0);
            return;
        }
    }
    panic!("not done after 1000 iterations");
}

fn settled(volume: &Volume, options: DeformableOptions) -> DeformableModel {
    let mut model = DeformableModel::new(volume, options).unwrap();
    settle(&mut model);
    model
}

/// The example of a report: cine MR with slices of 8 mm, in which an oblique ellipsoid had genus 16.
#[test]
fn an_oblique_ellipsoid_in_thick_slices_has_no_handles() {
    let volume = image([40, 40, 7], [1.0, 1.0, 8.0], |p| {
        let p = p - Vec3::new(19.5, 19.5, 24.0);
        let (u, w) = (0.98 * p.x + 0.199 * p.z, 0.98 * p.z - 0.199 * p.x);
        12.0 - Vec3::new(u / 1.3, p.y, w / 0.45).length()
    });
    let model = settled(&volume, options(0.0));
    let found = measure(&model.surface());
    assert_eq!((found.euler, model.mesh().component_count()), (2, 1));
    assert!((found.volume / 2794.0 - 1.0).abs() < VOLUME, "{}", found.volume);
}

/// Returns the depth in a dumb-bell whose bar is there or not, in voxels of 1 × 1 × 8.
fn dumb_bell(has_bar: bool, faintest: f32) -> Volume {
    image([48, 32, 9], [1.0, 1.0, 8.0], |p| {
        let q = (p - Vec3::new(23.5, 15.5, 32.0)).abs();
        let ball = 10.0 - (q - Vec3::new(12.0, 0.0, 14.0)).length();
        let bar = if has_bar {
            5.0 - to_segment(p, &[Vec3::new(11.0, 15.5, 18.0), Vec3::new(36.0, 15.5, 18.0)])
        } else {
            -9.0
        };
        ball.max(bar).clamp(faintest, 3.0)
    })
}

/// Strokes in all of the volume, in part of it, and with another range of intensities.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn elongated_voxels_follow_a_brush() {
    for (faintest, region) in [
        (-3.0, Region { min: [10, 8, 1], dims: [28, 16, 3] }),
        (-3.0, Region { min: [0; 3], dims: [48, 32, 9] }),
        (-4.0, Region { min: [0; 3], dims: [48, 32, 9] }),
    ] {
        let (before, after) = (dumb_bell(false, -3.0), dumb_bell(true, faintest));
        let mut model = settled(&before, options(0.0));
        assert_eq!((model.mesh().euler(), model.mesh().component_count()), (8, 4));
        model.refresh(&after, region).unwrap();
        settle(&mut model);
        let (found, expected) =
            (measure(&model.surface()), measure(&settled(&after, options(0.0)).surface()));
        assert_eq!((found.euler, model.mesh().component_count()), (6, 3));
        assert!(
            (found.volume / expected.volume - 1.0).abs() < VOLUME,
            "{} {}",
            found.volume,
            expected.volume
        );
        let coverage = model.coverage().unwrap();
        assert!(coverage.recall > 0.99 && coverage.precision > 0.99, "{coverage:?}");
        model.refresh(&before, region).unwrap();
        settle(&mut model);
        assert_eq!((model.mesh().euler(), model.mesh().component_count()), (8, 4));
    }
}

#[test]
fn a_saved_run_in_elongated_voxels_continues_bit_for_bit() {
    let volume = dumb_bell(true, -3.0);
    let with_levels = || DeformableOptions { levels: 1, ..options(0.0) };
    let mut model = DeformableModel::new(&volume, with_levels()).unwrap();
    (0..5).for_each(|_| _ = model.step().unwrap());
    let mut restored = DeformableModel::new(&volume, with_levels()).unwrap();
    restored.restore(&model.save()).unwrap();
    settle(&mut model);
    settle(&mut restored);
    assert_eq!(model.mesh().positions(), restored.mesh().positions());
    assert_eq!(model.mesh().euler(), 6);
}

/// Gradients and dark objects: the surface is the same in voxels of 1 × 1 × 8 as in those of the upsampled image.
#[test]
fn forces_in_elongated_voxels_are_those_of_the_upsampled_image() {
    let value = |p: Vec3| (9.0 - (p - Vec3::new(15.5, 15.5, 20.0)).length()).clamp(-3.0, 3.0);
    let volume = image([32, 32, 6], [1.0, 1.0, 8.0], |p| -value(p));
    let grid = volume.grid(0).unwrap();
    let upsampled = image([32, 32, 41], [1.0; 3], |p| grid.sample(Vec3::new(p.x, p.y, p.z / 8.0)));
    for (levels, gradient_normal) in [(0, 0.0), (1, 0.0), (0, 0.3)] {
        let params = DeformableParams { iso: 0.0, iso_force: 1.0, gradient_normal, ..Default::default() };
        let options = DeformableOptions { levels, params: Some(params), ..Default::default() };
        let [found, expected] =
            [&volume, &upsampled].map(|volume| measure(&settled(volume, options.clone()).surface()));
        assert_eq!((found.euler, expected.euler), (2, 2));
        let ratio = found.volume / expected.volume;
        assert!((ratio - 1.0).abs() < 0.005, "{levels} levels, gradient {gradient_normal}: {ratio}");
    }
}

/// Voxels so long that the parts into which they are divided remain elongated carry a warning; others do not.
#[test]
fn only_voxels_that_remain_elongated_carry_a_warning() {
    for (length, is_warned) in [(1.0, false), (2.0, false), (20.0, false), (60.0, false), (100.0, true)] {
        let volume = image([24, 24, 5], [1.0, 1.0, length], |p| {
            let p = (p - Vec3::new(11.5, 11.5, 2.0 * length)) / Vec3::new(1.0, 1.0, length / 4.0);
            (8.0 - p.length()).clamp(-2.0, 2.0)
        });
        let report = DeformableModel::new(&volume, options(0.0)).unwrap().step().unwrap();
        let codes: Vec<WarningCode> = report.warnings.iter().map(|warning| warning.code).collect();
        assert_eq!(codes, vec![WarningCode::Anisotropic; usize::from(is_warned)], "{length}");
    }
}

/// The model of a volume larger than memory, whose coarser level has cubes, is near that of the volume in memory.
#[test]
fn elongated_voxels_of_a_sparse_volume_are_divided_too() {
    let value = |p: Vec3| {
        let q = p - Vec3::new(31.5, 31.5, 32.0);
        let ring = (q.x * q.x + q.z * q.z).sqrt() - 18.0;
        (7.0 - (ring * ring + q.y * q.y).sqrt()).clamp(-3.0, 3.0)
    };
    let level = |dims, sides: [f64; 3], shift: [f64; 3]| SparseLevel {
        dims,
        affine: DAffine3 { translation: DVec3::from(shift), ..DAffine3::from_scale(DVec3::from(sides)) },
    };
    let levels = vec![
        level([64, 64, 13], [1.0, 1.0, 5.0], [0.0; 3]),
        level([32, 32, 13], [2.0, 2.0, 5.0], [0.5, 0.5, 0.0]),
    ];
    let init = SparseInit { levels: levels.clone(), range: [-3.0, 3.0], fill: Voxels::F32(vec![-3.0]) };
    let volume = SparseVolume::new(init).unwrap();
    let load = |needs: &[BrickBox]| {
        for at in needs {
            let [nx, ny, _] = at.region.dims;
            let voxel = |k: usize| {
                let offset = [k % nx, k / nx % ny, k / nx / ny];
                let index = [0, 1, 2].map(|axis| (at.region.min[axis] + offset[axis]) as f64);
                value(levels[at.level].affine.transform_point3(DVec3::from(index)).as_vec3())
            };
            volume.insert(*at, &Voxels::F32((0..at.region.len()).map(voxel).collect())).unwrap();
        }
    };
    load(&volume.missing(1).unwrap());
    let params = DeformableParams { iso: 0.0, ..Default::default() };
    let of_sparse = SparseOptions { params: Some(params), ..Default::default() };
    let mut model = DeformableModel::on_sparse(&volume, of_sparse).unwrap();
    loop {
        match model.step() {
            Ok(report) if report.done => break,
            Ok(_) => {}
            Err(MethodError::NeedsData { needs }) => load(&needs),
            Err(error) => panic!("{error}"),
        }
    }
    let in_memory = settled(&image([64, 64, 13], [1.0, 1.0, 5.0], value), options(0.0));
    let [found, expected] = [&model, &in_memory].map(|model| measure(&model.surface()));
    assert_eq!((found.euler, expected.euler), (0, 0));
    assert!((found.volume / expected.volume - 1.0).abs() < VOLUME, "{} {}", found.volume, expected.volume);
}
