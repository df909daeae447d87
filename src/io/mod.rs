//! Readers and writers of the file formats people have.

mod detect;
mod error;
mod glb;
mod gltf;
mod gzip;
mod mesh_file;
mod metaimage;
mod mz3;
mod nifti;
mod nrrd;
mod obj;
mod ply;
mod point_text;
mod points;
mod raw;
mod stl;
mod text;
mod vtp;

pub use detect::parse_volume;
pub use error::FormatError;
pub use mesh_file::{MeshFormat, parse_mesh, write_mesh};
pub use nifti::write_nifti;
pub use points::{PointCloud, parse_points};
