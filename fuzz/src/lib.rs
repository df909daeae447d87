//! The fuzz targets: one plain function each, called with bytes by the fuzzer and by `tests/core/fuzz_corpus.rs`.
#![allow(dead_code, reason = "the fuzzer and the test each use a part of it")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a finding is a panic")]

pub mod bytes;
pub mod edits;
pub mod memory;
pub mod meshes;
pub mod parts;
// The test of the targets has this file a second time, with its own helpers.
#[allow(clippy::duplicate_mod, reason = "two programs share one file")]
#[path = "../../tests/common/random.rs"]
mod random;
pub mod states;
pub mod steppers;
pub mod volumes;

/// A fuzz target: a function that the fuzzer and `tests/core/fuzz_corpus.rs` call with bytes, and its limits.
pub struct Target {
    /// Name of the target, of its program and of its folder of seeds.
    pub name: &'static str,
    /// Runs the target on an input; panics if it finds a bug.
    pub run: fn(&[u8]),
    /// Limit of the memory in use at any time, in bytes, whatever sizes the input claims.
    pub memory_limit: usize,
    /// Number of mutated seeds on which `tests/core/fuzz_corpus.rs` runs the target, which takes a second or so.
    pub mutations: usize,
}

/// Returns the fuzz target of a file reader, which may use 16 MiB.
const fn reader(name: &'static str, run: fn(&[u8])) -> Target {
    Target { name, run, memory_limit: 16 << 20, mutations: 20_000 }
}

/// Returns the fuzz target of a saved state, a method or mesh edits, which is slower and may use 256 MiB.
const fn method(name: &'static str, run: fn(&[u8]), mutations: usize) -> Target {
    Target { name, run, memory_limit: 256 << 20, mutations }
}

/// All fuzz targets.
pub static TARGETS: [Target; 22] = [
    reader("nifti", volumes::nifti),
    reader("nrrd", volumes::nrrd),
    reader("metaimage", volumes::metaimage),
    reader("volume_pair", volumes::pair),
    reader("gzip", volumes::gzip),
    reader("ply", meshes::ply),
    reader("stl", meshes::stl),
    reader("obj", meshes::obj),
    reader("glb", meshes::glb),
    reader("gltf", meshes::gltf),
    method("glb_parts", parts::glb_parts, 3000),
    reader("points", meshes::points),
    method("state_deformable", states::deformable, 300),
    method("state_implicit", states::implicit, 300),
    method("state_multires", states::multires, 300),
    method("state_tracking", states::tracking, 300),
    method("deformable", steppers::deformable, 100),
    method("implicit", steppers::implicit, 100),
    method("multires", steppers::multires, 30),
    method("tracking", steppers::tracking, 30),
    method("edits", edits::edits, 300),
    method("remeshing", edits::remeshing, 100),
];

/// Returns the target with a name.
pub fn target(name: &str) -> &'static Target {
    TARGETS.iter().find(|target| target.name == name).unwrap_or_else(|| panic!("no target is called {name}"))
}

/// Runs a target on an input; panics if it finds a bug or exceeds its memory limit.
pub fn run(name: &str, data: &[u8]) {
    let target = target(name);
    let peak = memory::peak_of(|| (target.run)(data));
    assert!(peak <= target.memory_limit, "{peak} bytes of memory for an input of {}", data.len());
}
