//! The half-edges of a triangle list sorted by edge, for computing its measures, report and connected components.

use crate::math::order::sort_by_rank;

/// A half-edge of a triangle list: the use of an edge by one triangle, with a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HalfEdge {
    /// The vertex indices of the ends as a sort key, the lower one in the high half.
    key: u64,
    /// The index of the triangle that uses the edge.
    pub triangle: u32,
    /// Whether the triangle traverses the edge from the lower vertex index to the higher one.
    pub forward: bool,
}

impl HalfEdge {
    /// Returns the vertex indices of the ends of the edge, the lower one first.
    pub fn ends(&self) -> [u32; 2] {
        [(self.key >> 32) as u32, self.key as u32]
    }
}

/// Returns the half-edges of all triangles with three different corners, sorted by edge, then by triangle.
pub(super) fn sorted_half_edges(triangles: &[[u32; 3]]) -> Vec<HalfEdge> {
    let mut half_edges = Vec::with_capacity(3 * triangles.len());
    for (&[a, b, c], triangle) in triangles.iter().zip(0..) {
        if a == b || b == c || c == a {
            continue;
        }
        half_edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| HalfEdge {
            key: u64::from(from.min(to)) << 32 | u64::from(from.max(to)),
            triangle,
            forward: from < to,
        }));
    }
    sort_by_rank(&mut half_edges, |u| u.key);
    half_edges
}

/// Iterates over the edges of `half_edges`, which must be sorted by edge: yields for each edge the slice of its
/// half-edges.
pub(super) fn by_edge(half_edges: &[HalfEdge]) -> impl Iterator<Item = &[HalfEdge]> {
    half_edges.chunk_by(|a, b| a.key == b.key)
}
