//! Small geometry: the vector types every layer shares, and exact predicates on triangles.

pub use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
