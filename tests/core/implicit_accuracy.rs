//! The implicit surface, without normals, compared with screened Poisson surface reconstruction, given the true
//! normals: topology and mean distance on known shapes, at the default parameters and at parameters tuned to the noise.
//!
//! Poisson's figures were recorded with pymeshlab 2025.7.post1 (MeshLab's library, which contains M. Kazhdan's code) by
//!
//! ```sh
//! cargo test --release --test core implicit_accuracy -- --ignored  # writes the points of the tests, with normals
//! python scripts/poisson_reference.py target/tmp/accuracy      # prints the table
//! ```
//!
//! that is `generate_surface_reconstruction_screened_poisson(depth=<depth>, threads=1)` on each, with defaults
//! otherwise. Noise is the standard deviation along each axis. The ball, the torus and the pair fill a box of side 2;
//! the blend's box is 1.8 wide, so that the same noise is relatively a tenth more.

use super::common::points::{Shape, blend, distance, noisy, pair, sphere, surface_points, torus};
use super::common::{Random, euler_of_parts};
use std::fmt::Write;
use std::path::Path;
use vesicle::mesh::{TriangleMesh, report};
use vesicle::methods::Auto;
use vesicle::methods::implicit::{Cloud, ImplicitOptions, ImplicitParams, ImplicitSurface, IsoValue};

const POINTS: usize = 3000;
const SEEDS: [u64; 3] = [1, 2, 3];
/// Target of the error, relative to screened Poisson's error at the best depth of each case. Parameters found by
/// experiment reach it; the defaults do not.
const BAR: f64 = 1.1;

/// A known shape and screened Poisson's errors on it.
struct Known {
    name: &'static str,
    shape: Shape,
    /// Euler characteristic of each component.
    euler: &'static [i64],
    /// Mean error of screened Poisson, averaged over the seeds, for each noise: at depth 8, and at the best depth of 5
    /// to 9.
    poisson: [[f64; 2]; 3],
    /// Largest accepted error at the default parameters for each noise, relative to screened Poisson's at the best depth;
    /// `None` if spurious components appear at the defaults.
    at_defaults: [Option<f64>; 3],
}

const NOISES: [f64; 3] = [0.0, 0.01, 0.02];

#[rustfmt::skip]
const ALL: [Known; 4] = [
    // depth 8, best                                             no noise              0.01                  0.02
    Known { name: "sphere", shape: sphere, euler: &[2], poisson: [[0.000610, 0.000610], [0.002972, 0.002495], [0.005456, 0.004586]], at_defaults: [Some(1.60), Some(1.70), Some(1.75)] },
    Known { name: "torus", shape: torus, euler: &[0], poisson:   [[0.000592, 0.000592], [0.002951, 0.002580], [0.005332, 0.003944]], at_defaults: [Some(1.45), Some(1.50), Some(1.95)] },
    Known { name: "blend", shape: blend, euler: &[0], poisson:   [[0.000621, 0.000621], [0.002893, 0.002857], [0.005121, 0.003795]], at_defaults: [Some(1.25), Some(1.30), None] },
    Known { name: "pair", shape: pair, euler: &[2, 2], poisson:  [[0.000505, 0.000504], [0.002715, 0.002601], [0.004916, 0.003252]], at_defaults: [Some(1.15), Some(1.30), None] },
];

/// Returns one setting for noise up to 0.01, found by experiment: less first-order and more third-order smoothness than
/// the defaults suit shapes without edges. With λ 0.001 the noise of the ball shows (1.13 of Poisson's error), with
/// 0.002 the blend without noise is rounded off (1.19). The default δ, τ and λ with the mean level have 0.8 without
/// noise and 1.6 with it, at most. The mean level compensates the shrinkage by λ. The cell saves time: with that of the
/// default, which is finer, the errors without noise are up to a third less, and those with noise the same.
fn usual() -> ImplicitParams {
    ImplicitParams {
        delta: Auto::Given(2.0),
        tau: 0.1,
        lambda_surface: Auto::Given(0.0015),
        level: IsoValue::Mean,
        cell: 0.02,
        ..ImplicitParams::paper()
    }
}

/// Returns the setting for noise of 0.02, for which the one above gives the pair a third component. Without noise this
/// one rounds off the blend.
fn smoother() -> ImplicitParams {
    ImplicitParams { tau: 0.2, lambda_surface: Auto::Given(0.003), cell: 0.03, ..usual() }
}

/// Asserts the topology of a surface reconstructed from points of a known shape, and returns its mean error.
fn error_of(known: &Known, noise: usize, seed: u64, params: &ImplicitParams) -> f64 {
    let mesh = reconstructed(known, NOISES[noise], seed, params.clone());
    let found = report(&mesh).unwrap();
    assert!(found.is_healthy(), "{}, seed {seed}: {found:?}", known.name);
    assert_eq!(euler_of_parts(&mesh), known.euler, "{}, seed {seed}", known.name);
    mean_error(known.shape, &mesh)
}

fn reconstructed(known: &Known, noise: f64, seed: u64, params: ImplicitParams) -> TriangleMesh {
    let cloud = Cloud { points: noisy(known.shape, POINTS, noise, seed), ..Cloud::default() };
    let options = ImplicitOptions { params, ..ImplicitOptions::default() };
    let mut surface = ImplicitSurface::new(cloud, options).unwrap();
    while !surface.step().unwrap().done {}
    surface.surface().clone()
}

/// Returns the mean distance to the shape: that of each triangle's centre, weighted by area.
fn mean_error(shape: Shape, mesh: &TriangleMesh) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        let area = (b - a).cross(c - a).length();
        sum += area * distance(shape, (a + b + c) / 3.0).abs();
        total += area;
    }
    sum / total
}

fn as_good_as_poisson(noise: usize, params: &ImplicitParams) {
    let missed = ALL.iter().filter(|known| {
        let errors = SEEDS.map(|seed| error_of(known, noise, seed, params));
        let mean = errors.iter().sum::<f64>() / SEEDS.len() as f64;
        let [usual, best] = known.poisson[noise].map(|poisson| mean / poisson);
        println!(
            "{}, noise {}: {mean:.6}, of Poisson's {usual:.2} (depth 8), {best:.2} (best depth); seeds {errors:.6?}",
            known.name, NOISES[noise]
        );
        best > BAR
    });
    let missed: Vec<_> = missed.map(|known| known.name).collect();
    assert!(missed.is_empty(), "{missed:?}");
}

/// At the defaults the error is 1.1 to 1.6 times that of Poisson without noise, and 1.2 to 1.7 times with noise of 0.01:
/// [`BAR`] is not reached. With noise of 0.02 it is 1.7 and 1.9 times on the sphere and the torus, and the other two
/// shapes get up to five spurious components. Only one seed of three is run; the errors of the others differ by at most
/// 7 %.
#[ignore = "long: npm run test:all"]
#[test]
fn the_accuracy_at_the_defaults_is_as_recorded() {
    let mut cases = 0;
    for (noise, known) in (0..3).flat_map(|noise| ALL.iter().map(move |known| (noise, known))) {
        let Some(bound) = known.at_defaults[noise] else { continue };
        let error = error_of(known, noise, SEEDS[0], &ImplicitParams::paper());
        let [usual, best] = known.poisson[noise].map(|poisson| error / poisson);
        println!(
            "{}, noise {}, defaults: {error:.6}, of Poisson's {usual:.2} (depth 8), {best:.2} (best depth)",
            known.name, NOISES[noise]
        );
        assert!(best <= bound, "{}, noise {}: {best}, not {bound}", known.name, NOISES[noise]);
        cases += 1;
    }
    assert_eq!(cases, 10);
}

#[test]
#[ignore = "long: npm run test:all"]
fn without_noise_tuned_parameters_are_as_accurate_as_poisson() {
    as_good_as_poisson(0, &usual());
}

#[test]
#[ignore = "long: npm run test:all"]
fn with_noise_tuned_parameters_are_as_accurate_as_poisson() {
    as_good_as_poisson(1, &usual());
}

#[test]
#[ignore = "long: npm run test:all"]
fn with_twice_the_noise_tuned_parameters_are_as_accurate_as_poisson() {
    as_good_as_poisson(2, &smoother());
}

#[test]
#[ignore = "writes files: what scripts/poisson_reference.py reads"]
fn write_points() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/tmp/accuracy");
    std::fs::create_dir_all(&folder).unwrap();
    for (known, noise, seed) in ALL.iter().flat_map(|known| {
        NOISES.iter().flat_map(move |noise| SEEDS.iter().map(move |seed| (known, noise, seed)))
    }) {
        let places = noisy(known.shape, POINTS, *noise, *seed);
        let (_, normals) = surface_points(known.shape, POINTS, &mut Random(*seed));
        let mut text = String::new();
        for (p, n) in places.iter().zip(normals) {
            writeln!(text, "{} {} {} {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
        }
        std::fs::write(folder.join(format!("{}-{noise}-{seed}.xyz", known.name)), text).unwrap();
    }
    println!("{}", folder.display());
}
