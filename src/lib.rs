//! **Vesicle** fits closed triangle meshes to 3D data: a mesh that splits, merges and refines itself while it is fitted
//! to a volume.
//!
//! Modules form one-way layers, enforced by `tests/core/architecture.rs`: `math < mesh < {spatial, volume} < remesh <
//! methods < bindings`; `io` uses only math, mesh and volume.

pub mod io;
pub mod math;
pub mod mesh;
pub mod methods;
pub mod remesh;
pub mod spatial;
pub mod volume;

#[cfg(target_arch = "wasm32")]
pub mod bindings;
