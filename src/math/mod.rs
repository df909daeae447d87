//! Geometry and numerics shared by all layers: vector types, bounding boxes, triangles, exact predicates, polygons,
//! quadric errors, eigenvectors of symmetric matrices, linear systems, sorting, grouping and random numbers.

mod bounds;
pub mod cholesky;
mod conjugate_gradients;
pub mod crossing;
mod directions;
mod groups;
mod growth;
mod min_max;
pub mod order;
mod polygon;
mod position_index;
pub mod predicates;
mod quadric;
mod random;
pub mod symmetric;
pub mod triangle;
pub mod vectors;

pub use bounds::{Bounds, BoxTree, BoxTreeBuilder, OverlappingPairs, Ray, box_corners};
pub use conjugate_gradients::ConjugateGradients;
pub use directions::spread_directions;
pub use glam::{DAffine3, DMat3, DVec2, DVec3, IVec3, Mat3, Vec2, Vec3, Vec3Swizzles, Vec4};
pub use groups::Groups;
pub use growth::{make_room, resize, resize_within};
pub use min_max::{higher, lower};
pub use polygon::{triangulate, triangulate_face};
pub use position_index::PositionIndex;
pub use quadric::Quadric;
pub use random::Random;
