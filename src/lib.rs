//! **Vesicle** fits closed triangle meshes to 3D data: a mesh that splits, merges and refines itself while it is fitted
//! to a volume.
//!
//! Modules form one-way layers, enforced by `tests/core/architecture.rs`: `math < mesh < {spatial, volume} < remesh <
//! methods < bindings`; `io` uses only math, mesh and volume, `voxelise` also spatial. All may use `warning`, and
//! all but `io` `pauses`.
//!
//! The JavaScript bindings are a crate of their own, `src/bindings`, with a Cargo feature for each method, so that a
//! WebAssembly module can have one of them.

pub mod io;
pub mod math;
pub mod mesh;
pub mod methods;
pub mod pauses;
pub mod remesh;
pub mod spatial;
pub mod volume;
pub mod voxelise;
pub mod warning;

// The tests in `tests/core` use the library by its name, as others do, but are of one program with those beside the code:
// two would be compiled with the library twice.
#[cfg(test)]
extern crate self as vesicle;
#[cfg(test)]
#[path = "../tests/core/main.rs"]
mod core_tests;
