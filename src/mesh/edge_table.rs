//! Every use of every edge by a triangle, sorted: what the measures and the report read.

use crate::math::order::sort_by_rank;

/// One side of one triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EdgeUse {
    /// Both ends, the lower index in the high half.
    key: u64,
    pub triangle: u32,
    /// Whether the triangle runs from the lower index to the higher.
    pub forward: bool,
}

impl EdgeUse {
    /// The lower and the higher vertex.
    pub fn ends(&self) -> [u32; 2] {
        [(self.key >> 32) as u32, self.key as u32]
    }
}

/// The uses by all triangles of three different corners, ordered by edge, then by triangle.
pub(super) fn edge_uses(triangles: &[[u32; 3]]) -> Vec<EdgeUse> {
    let mut uses = Vec::with_capacity(3 * triangles.len());
    for (&[a, b, c], triangle) in triangles.iter().zip(0..) {
        if a == b || b == c || c == a {
            continue;
        }
        uses.extend([(a, b), (b, c), (c, a)].map(|(from, to)| EdgeUse {
            key: u64::from(from.min(to)) << 32 | u64::from(from.max(to)),
            triangle,
            forward: from < to,
        }));
    }
    sort_by_rank(&mut uses, |u| u.key);
    uses
}

/// The uses grouped by edge.
pub(super) fn by_edge(uses: &[EdgeUse]) -> impl Iterator<Item = &[EdgeUse]> {
    uses.chunk_by(|a, b| a.key == b.key)
}
