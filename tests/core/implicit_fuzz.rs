//! The implicit surface with random points, options and parameters: a valid mesh or a clear error.
//!
//! A failing seed is printed. `FUZZ_SEEDS=<first>..<last>` runs other seeds.

use super::common::points::{direction, normal};
use super::common::{Named, Random, assert_at_least, seeds};
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{measure, report};
use vesicle::methods::implicit::{
    Camera, Cloud, ImplicitOptions, ImplicitParams, ImplicitSurface, IsoValue, KernelKind, PointEdits, Sides,
};
use vesicle::methods::{Auto, MethodError};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Number of seeds.
const SEEDS: u64 = 20;

/// Upper bound of a run's slices.
const MOST_STEPS: usize = 20_000;

/// Returns points on one of several shapes, in a box of side 2 or so.
fn body(random: &mut Random, count: usize) -> Vec<DVec3> {
    let kind = random.below(9);
    let jitter = [0.0, 1e-6, 1e-3, 0.02, 0.2][random.below(5)];
    let clumps: Vec<DVec3> = (0..1 + random.below(5)).map(|_| direction(random)).collect();
    let size = [1e-7, 1e-5, 1e-3, 0.1][random.below(4)];
    let mut place = |i: usize| {
        let at = |random: &mut Random| random.within(-1.0, 1.0);
        match kind {
            0 => direction(random),
            1 => DVec3::new(at(random), at(random), at(random)),
            2 => clumps[i % clumps.len()] + direction(random) * size,
            3 => DVec3::new(at(random), at(random), 0.0),
            4 => DVec3::new(at(random), 0.0, 0.0),
            5 => direction(random) * [1.0, 0.5][i % 2],
            // A ball sampled by longitude and latitude, with many points at its poles.
            6 => {
                let (turn, height) = ((i % 12) as f32 / 12.0, (i / 12 % 9) as f32 / 8.0);
                let [around, up] = [turn * std::f32::consts::TAU, height * std::f32::consts::PI];
                let flat = libm::sinf(up);
                Vec3::new(flat * libm::cosf(around), flat * libm::sinf(around), libm::cosf(up)).as_dvec3()
            }
            7 => DVec3::from([0; 3].map(|_| (random.below(5) as f64) * 0.5 - 1.0)),
            _ => direction(random) * DVec3::new(1.0, 1.0, 0.02),
        }
    };
    let exact: Vec<DVec3> = (0..count).map(&mut place).collect();
    exact
        .into_iter()
        .map(|p| p + DVec3::new(normal(random), normal(random), normal(random)) * jitter)
        .collect()
}

fn cloud(random: &mut Random) -> Cloud {
    let count = if random.below(4) == 0 { 4 + random.below(8) } else { 4 + random.below(297) };
    let (scale, away) = match random.below(8) {
        0 => (1e-6, 0.0),
        1 => (1e6, 0.0),
        2 => (1.0, 10.0),
        3 => (300.0, 3000.0),
        4 => (1e-20, 0.0),
        5 => (1e20, 0.0),
        _ => (1.0, 0.0),
    };
    let shift = direction(random) * away;
    let body = body(random, count);
    let normals = (random.below(4) == 0)
        .then(|| body.iter().map(|p| if random.below(5) == 0 { Vec3::ZERO } else { p.as_vec3() }).collect());
    let mut points: Vec<Vec3> = body.iter().map(|&p| (p * scale + shift).as_vec3()).collect();
    for _ in 0..random.below(4) {
        let (from, to) = (random.below(count), random.below(count));
        points[to] = points[from];
    }
    Cloud {
        normals,
        confidence: (random.below(4) == 0).then(|| {
            (0..count)
                .map(|_| if random.below(9) == 0 { 1e-30 } else { random.within(0.01, 1.0) as f32 })
                .collect()
        }),
        colors: (random.below(4) == 0).then(|| vec![Vec3::ONE * 0.5; count]),
        points,
        ..Cloud::default()
    }
}

/// Returns a camera at a random position in the plane y = −5 that looks along y.
fn camera(random: &mut Random) -> Camera {
    let (x, z) = (random.within(-2.0, 2.0), random.within(-2.0, 2.0));
    let rows = [100.0, 32.0, 0.0, 100.0 * x + 160.0, 0.0, 32.0, 100.0, 100.0 * z + 160.0, 0.0, 1.0, 0.0, 5.0];
    let image = (random.below(2) == 0).then(|| vec![200; 64 * 64 * 4]);
    Camera::new(rows, 64, 64, image).unwrap()
}

fn params(random: &mut Random) -> ImplicitParams {
    let mut one_of = |values: &[f64]| values[random.below(values.len())];
    let auto = |number: f64| if number.is_nan() { Auto::Auto } else { Auto::Given(number) };
    let usual = ImplicitParams::paper();
    ImplicitParams {
        delta: auto(one_of(&[0.1, 1.0, 5.0, 5.0, 5.0, 20.0, 40.0, 100.0, f64::NAN])),
        tau: one_of(&[0.001, 0.01, 0.025, 0.025, 0.1, 1.0]),
        sigma: one_of(&[0.005, 0.07, 0.07, 0.3, 1.0]),
        lambda_surface: auto(one_of(&[0.0, 0.0, 0.001, 0.001, 0.01, 10.0, f64::NAN])),
        lambda_exterior: auto(one_of(&[0.0, 2.0, 2.0, 1000.0, f64::NAN])),
        tolerance: one_of(&[1e-2, 1e-5, 1e-5, 1e-8, 1e-12]),
        cell: 0.0,
        level: if random.below(4) == 0 { IsoValue::Mean } else { IsoValue::Zero },
        kernel: match random.below(8) {
            0 => KernelKind::ThinPlate,
            1 => KernelKind::Biharmonic,
            2 => KernelKind::Gaussian,
            _ => usual.kernel,
        },
        sides: [Sides::Auto, Sides::Both, Sides::Outside, Sides::Outside][random.below(4)],
    }
}

fn options(random: &mut Random, cloud: &Cloud) -> ImplicitOptions {
    let middle = cloud.points[0].as_dvec3();
    let size = cloud.points.iter().map(|p| p.as_dvec3().distance(middle)).fold(0.0, f64::max);
    let exterior = |random: &mut Random| {
        let far = size * [0.0, 0.5, 1.5, 1e3, 1e18][random.below(5)];
        (0..random.below(20))
            .map(|_| {
                (middle + direction(random) * far).clamp(DVec3::splat(-3e38), DVec3::splat(3e38)).as_vec3()
            })
            .collect()
    };
    ImplicitOptions {
        exterior: (random.below(5) == 0).then(|| exterior(random)),
        cameras: if random.below(4) == 0 {
            (0..1 + random.below(3)).map(|_| camera(random)).collect()
        } else {
            Vec::new()
        },
        max_points: if random.below(3) == 0 { 4 + random.below(200) } else { 20_000 },
        keep_components: (random.below(4) == 0).then(|| 1 + random.below(3)),
        max_vertices: None,
        params: params(random),
    }
}

/// Counts of outcomes over all runs.
#[derive(Debug, Default)]
struct Tally {
    accepted: usize,
    steps: usize,
    surfaces: usize,
    /// Surfaces that are not empty.
    nonempty: usize,
    refused: usize,
    singular: usize,
    edits: usize,
    new_params: usize,
}

fn check(surface: &ImplicitSurface, report_euler: i32, seed: u64) {
    let mesh = surface.surface();
    let found = report(mesh).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
    assert!(mesh.triangles.is_empty() || found.is_healthy(), "seed {seed}: {found:?}");
    let measures = measure(mesh);
    assert_eq!(measures.euler, i64::from(report_euler), "seed {seed}");
    let normals = mesh.normals.as_deref().unwrap_or_default();
    assert_eq!(normals.len(), mesh.positions.len(), "seed {seed}");
    assert!(normals.iter().all(|n| n.is_finite()), "seed {seed}");
    let colors = mesh.colors.as_deref().unwrap_or_default();
    assert!(colors.iter().all(|c| c.is_finite()), "seed {seed}");
}

/// Runs the surface once, with parameter changes in between. Failures are those that the types allow, and keep the
/// surface.
fn run(seed: u64, tally: &mut Tally) {
    let mut random = Random(seed);
    let cloud = cloud(&mut random);
    let options = options(&mut random, &cloud);
    let count = cloud.points.len();
    let mut surface = match ImplicitSurface::new(cloud, options) {
        Ok(surface) => surface,
        Err(MethodError::InvalidArgument { .. }) => {
            tally.refused += 1;
            return;
        }
        Err(error) => panic!("seed {seed}: {error}"),
    };
    tally.accepted += 1;
    let mut changes = random.below(4);
    for step in 0..MOST_STEPS {
        let before = (surface.version(), surface.surface().clone());
        match surface.step() {
            Ok(report) => {
                tally.steps += 1;
                let same = surface.version() == before.0;
                assert!(!same || before.1 == *surface.surface(), "seed {seed}, step {step}");
                if !report.done {
                    if random.below(30) == 0 && changes > 0 {
                        changes -= 1;
                        // Refused if an edit names a point that is not there.
                        let _ = change(&mut surface, count, &mut random, tally);
                    }
                    continue;
                }
                tally.surfaces += 1;
                tally.nonempty += usize::from(!surface.surface().triangles.is_empty());
                check(&surface, report.euler, seed);
            }
            Err(error) => {
                match error {
                    MethodError::Singular { .. } => tally.singular += 1,
                    MethodError::InvalidArgument { .. } => tally.refused += 1,
                    error => panic!("seed {seed}, step {step}: {error}"),
                }
                assert!(before.1 == *surface.surface(), "seed {seed}, step {step}");
            }
        }
        if changes == 0 {
            return;
        }
        changes -= 1;
        if change(&mut surface, count, &mut random, tally).is_err() {
            return;
        }
    }
    panic!("seed {seed}: no end");
}

/// Returns random edits: points added near others or, seldom, too far away, and some of the first removed, seldom with
/// an index that is out of range; or no edits.
fn edits(surface: &ImplicitSurface, count: usize, random: &mut Random) -> PointEdits {
    let [known, _, _] = surface.constraints();
    let size = known.iter().map(|p| p.as_dvec3().distance(known[0].as_dvec3())).fold(0.0, f64::max);
    let mut places = |most: usize| -> Vec<Vec3> {
        let reach = size * [0.0, 1e-6, 0.01, 0.1, 0.3, 9.0][random.below(6)];
        let near = |random: &mut Random| match known.get(random.below(known.len().max(1))) {
            Some(p) => (p.as_dvec3() + direction(random) * reach).as_vec3(),
            None => direction(random).as_vec3(),
        };
        (0..random.below(most)).map(|_| near(random)).collect()
    };
    if places(5).is_empty() {
        return PointEdits::default();
    }
    let (added, exterior) = (places(300), places(4));
    let end = count + usize::from(random.below(8) == 0);
    let removed = (0..random.below(40)).map(|_| random.below(end) as u32).collect();
    PointEdits { added, removed, exterior }
}

fn change(
    surface: &mut ImplicitSurface,
    count: usize,
    random: &mut Random,
    tally: &mut Tally,
) -> Result<(), MethodError> {
    if random.below(2) == 0 {
        let edits = edits(surface, count, random);
        surface.set_edits(edits)?;
        tally.edits += 1;
        return Ok(());
    }
    let now = surface.params().clone();
    let next = match random.below(3) {
        0 => ImplicitParams {
            level: if now.level == IsoValue::Zero { IsoValue::Mean } else { IsoValue::Zero },
            ..now.clone()
        },
        1 => ImplicitParams { cell: surface.cell() * random.within(0.7, 3.0), ..now.clone() },
        _ => ImplicitParams { cell: now.cell, ..params(random) },
    };
    surface.set_params(next)?;
    tally.new_params += 1;
    Ok(())
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn every_run_gives_a_valid_surface_or_an_error() {
    let mut tally = Tally::default();
    for seed in seeds(SEEDS) {
        let named = Named::new(seed);
        run(named.0, &mut tally);
    }
    println!("{tally:?}");
    let seeds = SEEDS as usize;
    assert_at_least(seeds / 2, tally.accepted, "starts accepted");
    assert_at_least(20 * seeds, tally.steps, "steps");
    assert_at_least(seeds / 2, tally.surfaces, "surfaces");
    assert_at_least(seeds / 3, tally.nonempty, "surfaces with triangles");
    assert_at_least(seeds / 5, tally.edits, "sets of edits accepted");
    assert_at_least(seeds / 5, tally.new_params, "sets of parameters accepted");
}
