//! The deformable model with random images, starts and parameters: the mesh is valid after every step.
//!
//! A failing seed is printed. `FUZZ_SEEDS=<first>..<last>` runs other seeds.

use super::common::scenes;
use super::common::{Named, Random, assert_at_least, misplaced_parts, seeds};
use std::collections::BTreeMap;
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::count_self_intersections;
use vesicle::methods::MethodError;
use vesicle::methods::deformable::{
    Attractor, DeformableModel, DeformableOptions, DeformableParams, Integrator, Seeding, Start,
};
use vesicle::volume::Volume;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const STEPS: usize = 40;

const SEEDS: u64 = 25;

fn dims(random: &mut Random) -> [usize; 3] {
    [8 + random.below(30), 8 + random.below(30), 4 + random.below(30)]
}

/// Returns an image of noise, a noisy lattice with holes, or a ball.
fn image(random: &mut Random, dims: [usize; 3]) -> Volume {
    let noise: Vec<f32> = (0..dims[0] * dims[1] * dims[2]).map(|_| random.unit()).collect();
    let (kind, frequency) = (random.below(3), 0.2 + random.unit());
    let middle = Vec3::from(dims.map(|n| n as f32)) * 0.5;
    scenes::volume(dims, |p| {
        let noise = noise[p.x as usize + dims[0] * (p.y as usize + dims[1] * p.z as usize)];
        let wave = |x: f32| 0.2 * libm::sinf(x * frequency);
        match kind {
            0 => noise,
            1 => 0.5 + wave(p.x) + wave(p.y) + wave(p.z) + 0.2 * noise,
            _ => scenes::potential(p.distance(middle), 3.0 + 4.0 * frequency),
        }
    })
}

fn start(random: &mut Random, dims: [usize; 3]) -> Start {
    match random.below(7) {
        5.. => Start::Contour,
        0 => Start::Bubbles(1 + random.below(4) as u32),
        1 => Start::MarchingCubes(random.within(0.3, 0.7)),
        2 => {
            let middle = DVec3::from(dims.map(|n| n as f64)) * 0.5;
            Start::Seeds { points: vec![middle], radius: random.within(1.0, 7.0) }
        }
        _ => Start::Enclosing,
    }
}

fn params(random: &mut Random, volume: &Volume) -> DeformableParams {
    DeformableParams {
        iso: random.within(0.2, 0.8),
        iso_force: if random.below(3) == 0 { random.within(-4.0, 4.0) } else { -1.0 },
        rigidity: random.within(0.0, 0.4),
        stiffness: if random.below(2) == 0 { 0.0 } else { random.within(0.0, 0.2) },
        gradient_normal: if random.below(3) == 0 { random.within(0.0, 1.0) } else { 0.0 },
        damping: random.within(0.2, 0.8),
        max_move: random.within(0.1, 0.5),
        integrator: [Integrator::Implicit, Integrator::Implicit, Integrator::Euler, Integrator::RungeKutta]
            [random.below(4)],
        adaptivity: [0.0, 1.0, 1.0, random.within(0.0, 1.0)][random.below(4)],
        seeding: [Seeding::On, Seeding::Auto, Seeding::Off][random.below(3)],
        smallest_part: random.within(0.0, 80.0),
        ..DeformableParams::for_volume(volume)
    }
}

/// Counts over all runs.
#[derive(Debug, Default)]
struct Tally {
    /// Accepted starts by kind.
    starts: BTreeMap<&'static str, usize>,
    steps: usize,
    /// Merges and splits.
    topology_changes: usize,
    new_params: usize,
    attractors: usize,
}

/// Runs the model once, with parameter changes and attractors in between; a start that does not fit is refused.
fn run(seed: u64, tally: &mut Tally) {
    let mut random = Random(seed);
    let dims = dims(&mut random);
    let volume = image(&mut random, dims);
    let options = DeformableOptions {
        start: start(&mut random, dims),
        levels: random.below(3),
        edge: Some(random.within(1.0, 3.0)),
        params: Some(params(&mut random, &volume)),
        ..Default::default()
    };
    let kind = match options.start {
        Start::Enclosing => "enclosing surfaces",
        Start::Bubbles(_) => "bubbles",
        Start::MarchingCubes(_) => "marching cubes",
        Start::Seeds { .. } => "seeds",
        _ => "contours",
    };
    let mut model = match DeformableModel::new(&volume, options) {
        Ok(model) => model,
        Err(MethodError::InvalidArgument { .. }) => return,
        Err(error) => panic!("seed {seed}: {error}"),
    };
    *tally.starts.entry(kind).or_default() += 1;
    for step in 0..STEPS {
        let report = model.step().unwrap_or_else(|error| panic!("seed {seed}, step {step}: {error}"));
        assert_eq!(model.mesh().check(), Ok(()), "seed {seed}, step {step}");
        assert_eq!(i64::from(report.euler), model.mesh().euler(), "seed {seed}, step {step}");
        let self_intersections = count_self_intersections(&model.mesh().to_triangles());
        assert_eq!(self_intersections, 0, "seed {seed}, step {step}: {report:?}");
        tally.steps += 1;
        tally.topology_changes += (report.events.axial + report.events.annular) as usize;
        match random.below(40) {
            0 => {
                model.set_params(params(&mut random, &volume)).unwrap();
                tally.new_params += 1;
            }
            1 => {
                let point = DVec3::from(dims.map(|n| random.within(0.0, n as f64)));
                let pull = Attractor { point, strength: random.within(-0.5, 0.5), radius: 8.0 };
                model.set_attractors(vec![pull]).unwrap();
                tally.attractors += 1;
            }
            _ => {}
        }
    }
    let misplaced = misplaced_parts(&model.mesh().to_triangles());
    assert!(misplaced.is_empty(), "seed {seed}: {misplaced:?}");
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn every_run_keeps_the_mesh_valid() {
    let seeds = seeds(SEEDS);
    let mut tally = Tally::default();
    let count = (seeds.end - seeds.start) as usize;
    for seed in seeds {
        let named = Named::new(seed);
        run(named.0, &mut tally);
    }
    println!("{tally:?}");
    assert_at_least(5, tally.starts.len(), "kinds of starts accepted");
    for (kind, &accepted) in &tally.starts {
        assert_at_least(count / 25, accepted, kind);
    }
    assert_at_least(25 * count, tally.steps, "steps");
    assert_at_least(20 * count, tally.topology_changes, "merges and splits");
    assert_at_least(count / 2, tally.new_params, "changes of parameters");
    assert_at_least(count / 2, tally.attractors, "attractors");
}

/// Regression: marching cubes of noise, resolved with edges much longer than voxels. Collapses drew needles through all
/// of the mesh, and a step took half a minute.
#[test]
fn a_start_much_finer_than_its_edges_creates_no_needles() {
    let mut random = Random(201_797);
    let dims = dims(&mut random);
    let volume = image(&mut random, dims);
    let options = DeformableOptions {
        start: Start::MarchingCubes(0.417),
        edge: Some(2.814),
        params: Some(DeformableParams { iso: 0.426, ..DeformableParams::for_volume(&volume) }),
        ..Default::default()
    };
    let model = DeformableModel::new(&volume, options).unwrap();
    let longest = model.mesh().longest_edge();
    assert!(longest < 6.0, "{longest}");
}
