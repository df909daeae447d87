//! Parts of a mesh that intersected from the beginning, and need not be kept apart.

use super::Embedding;
use crate::mesh::VertexId;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Pairs of parts, the lower number first; `None` for all.
pub type PairsOfParts = Option<Arc<BTreeSet<[u32; 2]>>>;

/// The parts of a mesh that may intersect.
#[derive(Clone, Debug, Default)]
pub(super) struct Tolerated {
    /// The part of each vertex, by slot; empty if nothing may intersect.
    part_of: Vec<u32>,
    pairs: PairsOfParts,
}

impl Embedding {
    /// Lets some parts of the mesh intersect each other, or themselves, in the next moves; `part_of` is the part of each
    /// vertex, by slot. Edits that would make them intersect are still refused.
    pub fn tolerate(&mut self, part_of: Vec<u32>, pairs: PairsOfParts) {
        self.tolerated = Tolerated { part_of, pairs };
    }
}

impl Tolerated {
    /// Removes the pairs of triangles that may intersect from a list of all corners of each pair.
    pub fn remove_from(&self, intersecting: &mut Vec<VertexId>) {
        if self.part_of.is_empty() {
            return;
        }
        let (pairs, _) = intersecting.as_chunks::<6>();
        *intersecting =
            pairs.iter().filter(|pair| !self.may_intersect(pair[0], pair[3])).flatten().copied().collect();
    }

    fn may_intersect(&self, u: VertexId, v: VertexId) -> bool {
        let [one, other] = [u, v].map(|v| self.part_of.get(v.index()).copied().unwrap_or(u32::MAX));
        self.pairs.as_ref().is_none_or(|pairs| pairs.contains(&[one.min(other), one.max(other)]))
    }
}
