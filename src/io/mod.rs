//! Readers and writers of the file formats people have.

mod detect;
mod error;
mod gzip;
mod metaimage;
mod nifti;
mod nrrd;
mod raw;
mod text;

pub use detect::parse_volume;
pub use error::FormatError;
pub use nifti::write_nifti;
