//! Versions of the surfaces, by which copies are recognised as out of date.

/// Topology and geometry version: of all surfaces together, and of each label's, which has those of all when it last
/// changed.
#[derive(Clone, Debug, Default)]
pub struct Versions {
    all: [u32; 2],
    /// Those of the label with number 1 come first.
    of_labels: Vec<[u32; 2]>,
}

impl Versions {
    /// Returns the versions of all surfaces together.
    pub fn all(&self) -> [u32; 2] {
        self.all
    }

    /// Returns the versions of the surface of the label that `number` stands for.
    pub fn of(&self, number: u16) -> [u32; 2] {
        self.of_labels.get(usize::from(number).wrapping_sub(1)).copied().unwrap_or_default()
    }

    /// Records which labels, by number, have vertices that moved, and which have other triangles.
    pub fn record(&mut self, moved: &[bool], reconnected: &[bool]) {
        let any = |labels: &[bool]| labels.iter().skip(1).any(|&is_changed| is_changed);
        if any(reconnected) {
            self.all[0] = self.all[0].wrapping_add(1);
        }
        if any(moved) || any(reconnected) {
            self.all[1] = self.all[1].wrapping_add(1);
        }
        let count = moved.len().max(reconnected.len()).saturating_sub(1);
        if self.of_labels.len() < count {
            self.of_labels.resize(count, [0; 2]);
        }
        let is = |labels: &[bool], i: usize| labels.get(i + 1).is_some_and(|&is_changed| is_changed);
        for (i, versions) in self.of_labels.iter_mut().enumerate() {
            if is(reconnected, i) {
                *versions = self.all;
            } else if is(moved, i) {
                versions[1] = self.all[1];
            }
        }
    }

    /// Records that the surfaces of all labels, of which there are `count`, may have changed, and their numbers, too.
    pub fn record_all(&mut self, count: usize) {
        self.all = self.all.map(|version| version.wrapping_add(1));
        self.of_labels = vec![self.all; count];
    }
}
