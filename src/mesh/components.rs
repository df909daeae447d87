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
        let mut found = self.flood(v, &mut vec![false; self.slots()]);
        found.truncate(limit);
        found
    }

    /// Returns the vertices of each connected component, components in the order of their lowest slot.
    pub fn component_members(&self) -> Vec<Vec<VertexId>> {
        self.components().collect()
    }

    /// Returns the number of connected components.
    pub fn component_count(&self) -> usize {
        self.components().count()
    }

    fn components(&self) -> impl Iterator<Item = Vec<VertexId>> + '_ {
        let mut seen = vec![false; self.slots()];
        self.vertices()
            .filter_map(move |v| if seen[v.index()] { None } else { Some(self.flood(v, &mut seen)) })
    }

    /// Marks the vertices connected with `v` in `seen`, by slot, and returns them in breadth-first order.
    fn flood(&self, v: VertexId, seen: &mut [bool]) -> Vec<VertexId> {
        let mut found = vec![v];
        seen[v.index()] = true;
        let mut next = 0;
        while next < found.len() {
            for &w in self.ring(found[next]).as_slice() {
                if !std::mem::replace(&mut seen[w.index()], true) {
                    found.push(w);
                }
            }
            next += 1;
        }
        found
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
