//! Small geometry: the vector types every layer shares, quadric errors, and exact predicates on triangles.

mod bounds;
mod extremes;
pub mod order;
pub mod predicates;
mod quadric;
mod random;
pub mod symmetric;
pub mod triangle;

pub use bounds::{Bounds, BoxTree, Ray};
pub use extremes::{higher, lower};
pub use glam::{DAffine3, DMat3, DVec2, DVec3, IVec3, Mat3, Vec2, Vec3, Vec3Swizzles};
pub use quadric::Quadric;
pub use random::Random;
