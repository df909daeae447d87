//! Tests of the core against known results, natively and in wasm, through its public interface. `src/lib.rs` includes them.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says its figures"
)]

#[path = "../common/mod.rs"]
pub(crate) mod common;

mod agreement;
mod anisotropic;
mod anywhere;
// Reads the source files.
#[cfg(not(target_arch = "wasm32"))]
mod architecture;
mod decimate;
mod deformable;
mod deformable_fuzz;
mod embedding;
// Reads seeds from files.
#[cfg(not(target_arch = "wasm32"))]
mod fuzz_corpus;
mod implicit;
// Takes minutes in wasm.
#[cfg(not(target_arch = "wasm32"))]
mod implicit_accuracy;
mod implicit_automatic;
mod implicit_fuzz;
mod large_volumes;
mod merge_and_split;
mod mesh_edits;
mod mesh_files;
mod mesh_oddities;
mod mesh_spaces;
mod multires;
mod multires_fuzz;
mod multires_held;
mod plane_cut;
mod refresh;
mod remesh;
mod scenes;
mod textured_meshes;
mod thin_structures;
mod tool_scales;
mod tracking;
mod tracking_fuzz;
mod tracking_input;
mod tracking_proposed;
mod volume_files;
mod volumes_as_found;
mod voxel_meaning;
