//! Finding what is near: points by points, triangles by points, rays and planes, surfaces by surfaces.

mod distance;
mod grid;
mod section;
mod tree;

pub use distance::{SurfaceDistance, surface_distance};
pub use grid::PointGrid;
pub use section::cross_section;
pub use tree::{SurfacePoint, TriangleTree};
