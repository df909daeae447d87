//! Finding what is near: points by points, triangles by points, rays and planes, surfaces by surfaces.

mod cells;
mod distance;
mod march;
mod points;
mod section;
mod sweep;
mod tree;
mod vertex_grid;

pub use cells::CellSet;
pub use distance::{SurfaceDistance, surface_distance};
pub use march::Terrain;
pub use points::PointGrid;
pub use section::cross_section;
pub use sweep::near_pairs;
pub use tree::{FirstHit, SurfacePoint, TriangleTree};
pub use vertex_grid::{Proximity, VertexBall, VertexGrid};
