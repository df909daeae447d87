//! What is fuzzed: one plain function a target, called with bytes by the fuzzer and by `tests/fuzz_corpus.rs`.
#![allow(dead_code, reason = "the fuzzer and the test each use a part of it")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a finding is a panic")]

pub mod bytes;
pub mod edits;
pub mod memory;
pub mod meshes;
pub mod states;
pub mod steppers;
pub mod volumes;

/// One thing that is fuzzed.
pub struct Target {
    /// Also the name of its program and of its folder of seeds.
    pub name: &'static str,
    /// Panics where something is wrong.
    pub body: fn(&[u8]),
    /// Memory that it may take at a time, whatever the bytes claim.
    pub most_memory: usize,
    /// Changed seeds that the ordinary test runs: as many as take a second or so.
    pub changes: usize,
}

const fn reader(name: &'static str, body: fn(&[u8])) -> Target {
    Target { name, body, most_memory: 16 << 20, changes: 20_000 }
}

/// States and scenes: slower, and a solver needs memory.
const fn method(name: &'static str, body: fn(&[u8]), changes: usize) -> Target {
    Target { name, body, most_memory: 256 << 20, changes }
}

/// All of them.
pub static TARGETS: [Target; 21] = [
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

/// The target of that name.
pub fn target(name: &str) -> &'static Target {
    TARGETS.iter().find(|target| target.name == name).unwrap_or_else(|| panic!("no target is called {name}"))
}

/// Runs a target on bytes.
pub fn run(name: &str, data: &[u8]) {
    let target = target(name);
    let peak = memory::peak_of(|| (target.body)(data));
    assert!(peak <= target.most_memory, "{peak} bytes of memory for an input of {}", data.len());
}
