//! Counts of the edits made to a mesh.

use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Numbers of edits made to a mesh in one call, named as in the paper of Lachaud & Montanvert.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Changes {
    /// Number of edges split.
    pub creations: u32,
    /// Number of edges collapsed.
    pub deletions: u32,
    /// Number of edges flipped.
    pub inversions: u32,
    /// Number of axial changes: contacts of two vertices joined by a tube.
    pub axial: u32,
    /// Number of annular changes: necks cut.
    pub annular: u32,
    /// Number of components added for regions of the image that the mesh does not cover.
    pub seeds: u32,
    /// Number of components removed.
    pub vanished: u32,
}

impl Changes {
    /// Returns the largest of the numbers.
    pub fn most(self) -> u32 {
        let Self { creations, deletions, inversions, axial, annular, seeds, vanished } = self;
        [creations, deletions, inversions, axial, annular, seeds, vanished].into_iter().fold(0, u32::max)
    }

    /// Returns whether any edit changed the topology of the mesh, not only its sampling.
    pub fn changed_topology(self) -> bool {
        self.axial + self.annular + self.seeds + self.vanished > 0
    }
}

impl AddAssign for Changes {
    fn add_assign(&mut self, other: Self) {
        self.creations += other.creations;
        self.deletions += other.deletions;
        self.inversions += other.inversions;
        self.axial += other.axial;
        self.annular += other.annular;
        self.seeds += other.seeds;
        self.vanished += other.vanished;
    }
}
