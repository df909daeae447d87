//! Values in numbered groups, stored in two arrays.

/// Values in numbered groups, such as the triangles at each vertex of a mesh, one group after the other in memory.
#[derive(Clone, Debug)]
pub struct Groups<T> {
    /// The index of the first value of each group; one more entry is the number of values.
    starts: Vec<u32>,
    values: Vec<T>,
}

impl<T: Copy + Default> Groups<T> {
    /// Sorts values into `count` groups, by a counting sort; values of the same group keep their order. `pairs` yields
    /// the number of the group of each value, below `count`, and the value; it is iterated twice. At most 2³² values.
    pub fn new(count: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut starts = vec![0; count + 1];
        pairs.clone().for_each(|(group, _)| starts[group as usize + 1] += 1);
        (0..count).for_each(|group| starts[group + 1] += starts[group]);
        let mut next = starts.clone();
        let mut values = vec![T::default(); starts[count] as usize];
        for (group, value) in pairs {
            let slot = &mut next[group as usize];
            values[*slot as usize] = value;
            *slot += 1;
        }
        Self { starts, values }
    }

    /// Returns the values of a group.
    #[inline]
    pub fn of(&self, group: usize) -> &[T] {
        let [start, end] = [self.starts[group], self.starts[group + 1]];
        &self.values[start as usize..end as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn values_of_a_group_keep_their_order() {
        let groups = Groups::new(5, [(3, 'a'), (0, 'b'), (3, 'c'), (4, 'd'), (3, 'e')].into_iter());
        let found: Vec<String> = (0..5).map(|group| groups.of(group).iter().collect()).collect();
        assert_eq!(found, ["b", "", "", "ace", "d"]);
        assert!(Groups::<u32>::new(1, std::iter::empty()).of(0).is_empty());
    }
}
