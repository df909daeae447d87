//! Readers and writers of the file formats people have.

mod error;
mod glb;
mod gltf;
mod mesh_file;
mod mz3;
mod obj;
mod ply;
mod stl;
mod vtp;

pub use error::FormatError;
pub use mesh_file::{MeshFormat, parse_mesh, write_mesh};
