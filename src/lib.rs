//! **Vesicle** fits closed triangle meshes to 3D data: a mesh that splits, merges and refines itself while it is fitted
//! to a volume.
//!
//! Modules form one-way layers, enforced by `tests/core/architecture.rs`: `math < mesh < {spatial, volume} < remesh <
//! methods < bindings`; `io` uses only math, mesh and volume, `voxelise` also spatial.
//!
//! Each method is a Cargo feature, so that a WebAssembly module can have one of them; `import` adds the readers of
//! files to the bindings, `enrich` the interpolation of slices, `labels` label maps, the writers of volume files,
//! voxelisation, and smoothing and transforms of meshes, `sparse` volumes larger than memory. All are on by default.

#![cfg_attr(
    not(all(
        feature = "deformable",
        feature = "implicit",
        feature = "tracking",
        feature = "multires",
        feature = "import",
        feature = "enrich",
        feature = "labels",
        feature = "sparse"
    )),
    allow(
        dead_code,
        unused_macros,
        unused_imports,
        reason = "what some methods share is unused without them"
    )
)]

pub mod io;
pub mod math;
pub mod mesh;
pub mod methods;
pub mod remesh;
pub mod spatial;
pub mod volume;
pub mod voxelise;

#[cfg(target_arch = "wasm32")]
pub mod bindings;
