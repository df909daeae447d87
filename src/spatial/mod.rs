//! Spatial queries: neighbours of points, pairs of vertices near each other, closest points and ray intersections of
//! surfaces, inside tests, cross-sections, and distances from and between surfaces.

mod cavities;
mod cells;
mod contains;
mod cylinder_tree;
mod distance;
mod four_triangles;
mod lattice_distance;
mod points;
mod section;
mod surface_walker;
mod sweep;
mod tree;
mod vertex_grid;

pub use cavities::{outer_components, outer_components_in_slices};
pub use cells::CellSet;
pub use contains::{contains, contains_in_slices};
pub use distance::{SurfaceDistance, surface_distance, surface_distance_in_slices};
pub use lattice_distance::lattice_distances;
pub use points::PointGrid;
pub use section::cross_section;
pub(crate) use section::lone_corner;
pub use surface_walker::SurfaceWalker;
pub use sweep::near_pairs;
pub use tree::{NearestHit, SurfacePoint, TriangleTree};
pub use vertex_grid::{Proximity, VertexBall, VertexGrid};
