//! The dynamic mesh: closed, oriented, 2-manifold, edited in place.

mod crossing;
mod edge_table;
mod error;
mod groups;
mod measure;
mod report;
#[cfg(test)]
mod shapes;
mod triangles;
mod weld;

pub use crossing::{count_crossings, crossing_pairs};
pub use error::MeshError;
pub use measure::{Measures, measure};
pub use report::{MeshReport, report};
pub use triangles::TriangleMesh;
