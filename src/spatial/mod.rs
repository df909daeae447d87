//! Finding what is near: points by points, triangles by points, rays and planes.

mod section;
mod stars;
mod tree;

pub use section::cross_section;
pub use stars::{Nearness, Star, StarGrid};
pub use tree::{SurfacePoint, TriangleTree};
