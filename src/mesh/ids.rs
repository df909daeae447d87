//! Handles of the vertices of a dynamic mesh.

use crate::math::order;
use serde::{Deserialize, Serialize};

/// A handle of a vertex of a [`Mesh`](super::Mesh).
///
/// It stays valid until the vertex is deleted or the mesh is renumbered ([`Mesh::reorder`](super::Mesh::reorder)). Ids
/// of deleted vertices are reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct VertexId(pub u32);

impl VertexId {
    /// Returns the slot of this vertex, its index into per-vertex arrays.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// Returns the id of the vertex in slot `index`, which must fit into `u32`: [`Mesh`](super::Mesh) ensures when it
    /// is built that it has at most `u32::MAX` vertices.
    #[inline]
    pub fn from_index(index: usize) -> Self {
        Self(index as u32)
    }
}

/// Sorts vertices by id and removes duplicates.
pub fn sort_distinct(vertices: &mut Vec<VertexId>) {
    // As numbers, which other sorts use too; both conversions reuse the memory.
    let mut ids: Vec<u32> = std::mem::take(vertices).into_iter().map(|v| v.0).collect();
    order::sort_distinct(&mut ids);
    *vertices = ids.into_iter().map(VertexId).collect();
}
