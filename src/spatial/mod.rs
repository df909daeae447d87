//! Finding what is near: points by points, triangles by points, rays and planes.

mod grid;
mod section;
mod tree;

pub use grid::PointGrid;
pub use section::cross_section;
pub use tree::{SurfacePoint, TriangleTree};
