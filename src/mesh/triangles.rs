//! A plain indexed triangle list, as files and graphics cards hold it.

use crate::math::{Vec2, Vec3};

/// Positions and triangles with optional per-vertex extras; promises nothing about closedness.
///
/// Triangles index `positions` and are counter-clockwise seen from outside. Each extra, where there is one,
/// has one entry per position.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Indices of each triangle's corners.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals per vertex.
    pub normals: Option<Vec<Vec3>>,
    /// Texture coordinates per vertex.
    pub uvs: Option<Vec<Vec2>>,
    /// Colours per vertex, rgb in 0..1.
    pub colors: Option<Vec<Vec3>>,
}
