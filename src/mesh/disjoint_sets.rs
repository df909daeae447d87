//! A union-find structure, for connected components.

use super::edge_table::{HalfEdge, by_edge};

/// A partition of the numbers below a limit, such as vertex indices, into disjoint sets, such as connected components
/// (union-find).
pub(crate) struct DisjointSets {
    parents: Vec<usize>,
    count: usize,
}

impl DisjointSets {
    /// Creates a partition in which each number below `limit` is a set by itself.
    pub fn new(limit: usize) -> Self {
        Self { parents: (0..limit).collect(), count: limit }
    }

    /// Returns the lowest number in the set that contains `i`, as the representative of the set.
    pub fn find(&mut self, mut i: usize) -> usize {
        while self.parents[i] != i {
            self.parents[i] = self.parents[self.parents[i]];
            i = self.parents[i];
        }
        i
    }

    /// Merges the set that contains `i` with the one that contains `j`.
    pub fn union(&mut self, i: usize, j: usize) {
        let (i, j) = (self.find(i), self.find(j));
        self.parents[i.max(j)] = i.min(j);
        self.count -= usize::from(i != j);
    }

    /// Merges the sets of triangles that share an edge, so that each set becomes a connected component. The numbers in
    /// the sets are triangle indices; `uses` are the half-edges of the triangles, sorted by edge.
    pub(super) fn join_across_edges(&mut self, uses: &[HalfEdge]) {
        for pair in by_edge(uses).flat_map(|edge| edge.windows(2)) {
            self.union(pair[0].triangle as usize, pair[1].triangle as usize);
        }
    }

    /// Returns the number of disjoint sets, such as connected components.
    pub fn count(&self) -> usize {
        self.count
    }
}
