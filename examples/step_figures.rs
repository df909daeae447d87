//! Timings of a step of the deformable model while every vertex moves, at several mesh sizes, printed as JSON with a
//! row for each.
//!
//! `bench/steps.mjs` does the same work through the npm package; `npm run bench -- steps` compares the two.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]
#![allow(clippy::disallowed_methods, reason = "it measures time")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::scenes;
use std::sync::OnceLock;
use std::time::Instant;
use vesicle::math::{DVec3, Vec3};
use vesicle::methods::deformable::{DeformableModel, DeformableOptions, DeformableParams, Start};
use vesicle::volume::Volume;

/// Voxels along each side of the volume, and, in voxels, the radius of the ball at its centre and of the sphere that
/// shrinks onto it.
const SIDE: usize = 256;
const BALL: f32 = 96.0;
const SPHERE: f64 = 112.0;

/// Mean edge lengths in voxels. The spheres have 7,000, 66,000 and 1.7 million vertices: edges shrink in steps of about
/// three.
const EDGES: [f64; 3] = [4.6, 1.6, 0.46];

/// Number of steps that are not timed, while the sphere accelerates, and of steps that are.
const WARM_UP_STEPS: usize = 4;
const TIMED_STEPS: usize = 6;

/// Number of runs for each size.
const RUNS: [usize; 3] = [6, 3, 1];

/// Timings of one size.
struct Row {
    vertices: u32,
    /// Shortest time of a step in nanoseconds per vertex.
    step: f64,
    /// Shortest time of a step's topology in milliseconds.
    topology: f64,
}

/// Returns the milliseconds since the first call, as clock of the model.
fn milliseconds() -> f64 {
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    BEGAN.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e3
}

/// Returns a volume with a ball at its centre.
fn ball() -> Volume {
    let middle = Vec3::splat(0.5 * (SIDE as f32 - 1.0));
    scenes::volume([SIDE; 3], |p| (128.0 - 32.0 * (p.distance(middle) - BALL)).clamp(0.0, 255.0).floor())
}

/// Returns the shortest times of all timed steps of one run.
fn row(volume: &Volume, edge: f64) -> Row {
    let params =
        DeformableParams { iso: 128.0, iso_force: -1.0, rigidity: 0.2, ..DeformableParams::default() };
    let start = Start::Seeds { points: vec![DVec3::splat(0.5 * (SIDE as f64 - 1.0))], radius: SPHERE };
    let options = DeformableOptions { start, edge: Some(edge), params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(volume, options).unwrap();
    model.set_clock(milliseconds);
    let mut row = Row { vertices: 0, step: f64::INFINITY, topology: f64::INFINITY };
    for step in 0..WARM_UP_STEPS + TIMED_STEPS {
        let began = milliseconds();
        let report = model.step().unwrap();
        let spent = milliseconds() - began;
        if step < WARM_UP_STEPS {
            continue;
        }
        let topology = report.times.0.iter().find(|(part, _)| *part == "topology").map_or(0.0, |p| p.1);
        row = Row {
            vertices: report.vertices,
            step: row.step.min(1e6 * spent / f64::from(report.vertices)),
            topology: row.topology.min(topology),
        };
    }
    row
}

/// Returns the shortest times of several runs as JSON.
fn best(volume: &Volume, edge: f64, runs: usize) -> String {
    let rows: Vec<Row> = (0..runs).map(|_| row(volume, edge)).collect();
    let least = |of: fn(&Row) -> f64| rows.iter().map(of).fold(f64::INFINITY, f64::min);
    let (vertices, step, topology) = (rows[0].vertices, least(|row| row.step), least(|row| row.topology));
    format!(
        "{{\"edge\": {edge}, \"vertices\": {vertices}, \"step\": {step:.1}, \"topology\": {topology:.3}}}"
    )
}

fn main() {
    let volume = ball();
    // Warm-up, as in the package, where code is compiled while it runs.
    row(&volume, EDGES[1]);
    let rows: Vec<String> = EDGES.iter().zip(RUNS).map(|(&edge, runs)| best(&volume, edge, runs)).collect();
    println!("[{}]", rows.join(", "));
}
