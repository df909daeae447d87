//! Disjoint groups, for finding connected parts.

use super::edge_table::{EdgeUse, by_edge};

/// Disjoint groups of the numbers below a limit.
pub(crate) struct Groups {
    parents: Vec<usize>,
    count: usize,
}

impl Groups {
    /// Each number a group of its own.
    pub fn new(limit: usize) -> Self {
        Self { parents: (0..limit).collect(), count: limit }
    }

    /// The lowest number of the group of `i`.
    pub fn find(&mut self, mut i: usize) -> usize {
        while self.parents[i] != i {
            self.parents[i] = self.parents[self.parents[i]];
            i = self.parents[i];
        }
        i
    }

    /// Makes one group of those of `i` and `j`.
    pub fn join(&mut self, i: usize, j: usize) {
        let (i, j) = (self.find(i), self.find(j));
        self.parents[i.max(j)] = i.min(j);
        self.count -= usize::from(i != j);
    }

    /// Makes one group of the triangles at each edge.
    pub(super) fn join_across_edges(&mut self, uses: &[EdgeUse]) {
        for pair in by_edge(uses).flat_map(|edge| edge.windows(2)) {
            self.join(pair[0].triangle as usize, pair[1].triangle as usize);
        }
    }

    /// The number of groups.
    pub fn count(&self) -> usize {
        self.count
    }
}
