//! Searching in space: points near a point, triangles near a triangle.

mod grid;

pub use grid::PointGrid;
