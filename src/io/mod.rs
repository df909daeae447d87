//! Readers and writers of file formats for volumes, meshes and point clouds.

mod animation;
mod base64;
mod detect;
mod error;
mod glb;
mod glb_writer;
mod gltf;
mod gltf_material;
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

pub use animation::{AnimationWriter, write_animation};
pub use detect::parse_volume;
pub use error::FormatError;
pub use mesh_file::{MeshFormat, parse_mesh, parse_textured_mesh, write_mesh};
pub use nifti::write_nifti;
pub use points::{PointCloud, parse_points};
