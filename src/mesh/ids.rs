//! The handle of a vertex.

use serde::{Deserialize, Serialize};

/// Names one vertex of one [`Mesh`](super::Mesh).
///
/// An id stays with its vertex until the vertex is deleted or the mesh is compacted; freed ids are used again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct VertexId(pub u32);

impl VertexId {
    /// The slot of this vertex in per-vertex arrays.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The vertex in slot `index`.
    ///
    /// Meshes hold at most `u32::MAX` vertices, which [`Mesh`](super::Mesh) makes sure of where it is built.
    #[inline]
    pub fn from_index(index: usize) -> Self {
        Self(index as u32)
    }
}
