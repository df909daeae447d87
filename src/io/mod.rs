//! Readers and writers of the file formats people have.

mod error;

pub use error::FormatError;
