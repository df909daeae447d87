//! Connected components of a dynamic mesh.

use super::{Mesh, VertexId};

/// The largest `limit` for which [`Mesh::component_of`] searches the vertices found so far linearly, instead of marking
/// them in an array over the whole mesh, which is slower for few vertices.
const LINEAR_SEARCH_LIMIT: usize = 64;

impl Mesh {
    /// Returns the vertices of the connected component of `v` in breadth-first order, at most `limit` of them, but at
    /// least `v`; none if `v` is not live.
    pub fn component_of(&self, v: VertexId, limit: usize) -> Vec<VertexId> {
        if !self.is_live(v) {
            return Vec::new();
        }
        if limit <= LINEAR_SEARCH_LIMIT {
            return self.small_component_of(v, limit);
        }
        let mut found = Vec::new();
        self.flood(v, &mut vec![false; self.slots()], &mut found);
        found.truncate(limit);
        found
    }

    /// Returns the vertices of the component of `v`, and marks them in `seen`, by slot; none if `v` is marked. For several
    /// components, which takes time in proportion to these alone.
    pub(crate) fn unseen_component_of(&self, v: VertexId, seen: &mut [bool]) -> Vec<VertexId> {
        let mut found = Vec::new();
        self.flood(v, seen, &mut found);
        found
    }

    /// Returns the vertices of each connected component, components in the order of their lowest slot.
    pub fn component_members(&self) -> Vec<Vec<VertexId>> {
        let mut seen = vec![false; self.slots()];
        let members = |v: VertexId| {
            let mut found = Vec::new();
            self.flood(v, &mut seen, &mut found);
            (!found.is_empty()).then_some(found)
        };
        self.vertices().filter_map(members).collect()
    }

    /// Returns the vertices of [`Self::component_members`] one after the other.
    pub(super) fn in_component_order(&self) -> Vec<VertexId> {
        let mut seen = vec![false; self.slots()];
        let mut order = Vec::with_capacity(self.vertex_count());
        self.vertices().for_each(|v| self.flood(v, &mut seen, &mut order));
        order
    }

    /// Returns the number of connected components.
    pub fn component_count(&self) -> usize {
        let mut seen = vec![false; self.slots()];
        let (mut front, mut next) = (Vec::new(), Vec::new());
        let mut count = 0;
        for v in self.vertices() {
            if std::mem::replace(&mut seen[v.index()], true) {
                continue;
            }
            count += 1;
            front.push(v);
            // Unlike `flood`, this keeps only the vertices whose neighbours have not been visited.
            while !front.is_empty() {
                for u in front.drain(..) {
                    for &w in self.ring(u).as_slice() {
                        if !std::mem::replace(&mut seen[w.index()], true) {
                            next.push(w);
                        }
                    }
                }
                std::mem::swap(&mut front, &mut next);
            }
        }
        count
    }

    /// Marks the vertices connected with `v` in `seen`, by slot, and appends them to `found` in breadth-first order, unless
    /// `v` is marked already.
    fn flood(&self, v: VertexId, seen: &mut [bool], found: &mut Vec<VertexId>) {
        if std::mem::replace(&mut seen[v.index()], true) {
            return;
        }
        let mut next = found.len();
        found.push(v);
        while next < found.len() {
            for &w in self.ring(found[next]).as_slice() {
                if !std::mem::replace(&mut seen[w.index()], true) {
                    found.push(w);
                }
            }
            next += 1;
        }
    }

    fn small_component_of(&self, v: VertexId, limit: usize) -> Vec<VertexId> {
        let mut found = vec![v];
        let mut next = 0;
        while next < found.len() {
            for &w in self.ring(found[next]).as_slice() {
                if found.len() >= limit {
                    return found;
                }
                if !found.contains(&w) {
                    found.push(w);
                }
            }
            next += 1;
        }
        found
    }
}
