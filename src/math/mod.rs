//! Geometry and numerics shared by all layers: vector types, bounding boxes, triangles, exact predicates, quadric
//! errors, eigenvectors of symmetric matrices, sorting and random numbers.

mod bounds;
mod min_max;
pub mod order;
pub mod predicates;
mod quadric;
mod random;
pub mod symmetric;
pub mod triangle;

pub use bounds::{Bounds, BoxTree, Ray};
pub use glam::{DAffine3, DMat3, DVec2, DVec3, IVec3, Mat3, Vec2, Vec3, Vec3Swizzles};
pub use min_max::{higher, lower};
pub use quadric::Quadric;
pub use random::Random;
