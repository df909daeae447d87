//! Readers and writers of file formats for volumes, meshes and point clouds.

mod animation;
mod base64;
mod beside;
mod colour;
mod deflate;
mod detect;
mod error;
mod faces;
mod frame;
mod glb;
mod glb_writer;
mod gltf;
mod gltf_accessor;
mod gltf_buffer;
mod gltf_material;
mod gltf_scene;
mod gltf_skin;
mod gzip;
mod mesh_file;
mod metaimage;
mod metaimage_writer;
mod mz3;
mod nifti;
mod nifti_writer;
mod notes;
mod nrrd;
mod obj;
mod ply;
mod point_text;
mod points;
mod raw;
mod source;
mod stl;
mod text;
mod units;
mod volume_file;
mod vtp;

pub use animation::{AnimationWriter, write_animation};
pub use beside::FileSet;
pub use detect::{parse_volume, parse_volume_with};
pub use error::FormatError;
pub use frame::WriteOptions;
pub use mesh_file::{
    MeshFile, MeshFormat, MeshOptions, parse_mesh, parse_textured_mesh, read_mesh, write_mesh,
    write_mesh_with,
};
pub use nifti_writer::write_nifti;
pub use points::{PointCloud, parse_points};
pub use source::VolumeOptions;
pub use volume_file::{Compression, VolumeFormat, write_volume};
