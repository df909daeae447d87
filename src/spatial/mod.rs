//! Finding what is near: triangles by points, rays and planes.

mod section;
mod tree;

pub use section::cross_section;
pub use tree::{SurfacePoint, TriangleTree};
