//! Helpers that several test files use.
#![allow(dead_code, reason = "each test file uses a part of it")]
#![allow(clippy::panic, clippy::print_stdout, reason = "the lints spare tests, but not their helpers")]

pub mod cine;
pub mod files;
pub mod points;
pub mod random;
pub mod scenes;
pub mod shapes;
pub mod skins;
pub mod stores;
pub mod strokes;

pub use random::Random;

use std::f32::consts::TAU;
use std::f64::consts::PI;
use std::ops::Range;
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{TriangleMesh, measure};

/// Returns the seeds of a test: `0..usual`, `FUZZ_TIMES` times as many if that environment variable is set, or those of
/// `FUZZ_SEEDS=<first>..<last>`.
pub fn seeds(usual: u64) -> Range<u64> {
    let Ok(named) = std::env::var("FUZZ_SEEDS") else { return 0..usual * times() };
    let ends =
        named.split_once("..").and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    let Some((first, last)) = ends else { panic!("FUZZ_SEEDS is {named}; <first>..<last> is needed") };
    first..last
}

/// How many times as many seeds as usual run; `npm run test:all` sets it.
fn times() -> u64 {
    let Ok(named) = std::env::var("FUZZ_TIMES") else { return 1 };
    named.parse().unwrap_or_else(|_| panic!("FUZZ_TIMES is {named}; a whole number is needed"))
}

/// Asserts that a test with random input has done at least `least` of something, so that it fails if, for example, all
/// its input is rejected. Other seeds than the usual ones may be few, and are not counted.
pub fn assert_at_least(least: usize, done: usize, what: &str) {
    println!("{done} {what}");
    assert!(done >= least || std::env::var_os("FUZZ_SEEDS").is_some(), "only {done} {what}, not {least}");
}

/// Prints the seed of a test run that panics. In wasm a panic ends the program, so each seed is printed beforehand.
pub struct Named(pub u64);

impl Named {
    pub fn new(seed: u64) -> Self {
        #[cfg(target_arch = "wasm32")]
        wasm_bindgen_test::console_log!("seed {seed}");
        Self(seed)
    }
}

impl Drop for Named {
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("failing seed: {}", self.0);
        }
    }
}

/// Returns a torus of `n` × `m` vertices around the z axis through `centre`, with the given ring and tube radii.
pub fn torus_around(centre: Vec3, [n, m]: [u32; 2], [ring, tube]: [f32; 2]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..n {
        for j in 0..m {
            let (a, b) = (TAU * i as f32 / n as f32, TAU * j as f32 / m as f32);
            let r = ring + tube * libm::cosf(b);
            mesh.positions
                .push(centre + Vec3::new(r * libm::cosf(a), r * libm::sinf(a), tube * libm::sinf(b)));
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

/// Returns the Euler characteristic of each component, in ascending order.
pub fn euler_of_parts(surface: &TriangleMesh) -> Vec<i64> {
    let mut euler: Vec<i64> = surface.components().iter().map(|part| measure(part).euler).collect();
    euler.sort_unstable();
    euler
}

/// Describes the components of a surface that are misplaced: solids inside other components, and cavities that are not
/// inside exactly one.
pub fn misplaced_parts(surface: &TriangleMesh) -> Vec<String> {
    let parts = surface.components();
    let windings = |k: usize| {
        let others = (0..parts.len()).filter(|&other| other != k).map(|other| &parts[other]);
        (others.map(|other| solid_angle(other, parts[k].positions[0])).sum::<f64>() / (4.0 * PI)).round()
    };
    let misplaced = |k: usize| {
        let (volume, windings) = (measure(&parts[k]).volume, windings(k));
        (windings != if volume > 0.0 { 0.0 } else { 1.0 }).then(|| {
            format!("{} vertices with volume {volume} within {windings} others", parts[k].positions.len())
        })
    };
    (0..parts.len()).filter_map(misplaced).collect()
}

/// Returns the solid angle that a closed surface subtends at `p`: 4π if `p` is inside.
fn solid_angle(surface: &TriangleMesh, p: Vec3) -> f64 {
    let seen = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|i| DVec3::from(surface.positions[i as usize]) - DVec3::from(p));
        let [x, y, z] = [a, b, c].map(DVec3::length);
        2.0 * libm::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
    };
    surface.triangles.iter().map(seen).sum()
}

/// Returns the FNV-1a hash of the bits of all positions.
pub fn fingerprint(positions: &[Vec3]) -> u64 {
    let bytes = positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}
