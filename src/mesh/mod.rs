//! The dynamic mesh: closed, oriented, 2-manifold, edited in place.

mod triangles;

pub use triangles::TriangleMesh;
