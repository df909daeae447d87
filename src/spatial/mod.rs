//! Finding what is near: points by points, triangles by points, rays and planes, surfaces by surfaces.

mod distance;
mod points;
mod section;
mod stars;
mod tree;

pub use distance::{SurfaceDistance, surface_distance};
pub use points::PointGrid;
pub use section::cross_section;
pub use stars::{Nearness, Star, StarGrid};
pub use tree::{SurfacePoint, TriangleTree};
