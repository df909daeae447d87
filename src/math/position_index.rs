//! Points sorted by position, to find equal ones.

use super::Vec3;
use super::order::sort_triples;

/// Points sorted by position, to find those that are equal to each other or to a given point; −0 equals 0.
#[derive(Clone, Debug)]
pub struct PositionIndex(Vec<(Key, u32)>);

/// The bits of the coordinates of a point, by which points are sorted; equal for equal points.
type Key = [u32; 3];

impl PositionIndex {
    /// Sorts `points`, at most 2³²; the results of queries are their indices.
    pub fn new(points: &[Vec3]) -> Self {
        let mut all: Vec<(Key, u32)> = points.iter().map(|&p| key(p)).zip(0..).collect();
        sort_triples(&mut all);
        Self(all)
    }

    /// Returns the index of the first point that equals `p`; `None` if there is none.
    pub fn find(&self, p: Vec3) -> Option<usize> {
        let at = self.0.partition_point(|(position, _)| *position < key(p));
        self.0.get(at).filter(|(position, _)| *position == key(p)).map(|&(_, i)| i as usize)
    }

    /// Iterates over the distinct positions, in an unspecified but deterministic order: yields for each the indices of
    /// its points in ascending order.
    pub fn distinct(&self) -> impl Iterator<Item = impl ExactSizeIterator<Item = u32> + Clone + '_> {
        self.0.chunk_by(|a, b| a.0 == b.0).map(|equal| equal.iter().map(|&(_, i)| i))
    }
}

fn key(p: Vec3) -> Key {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn equal_points_are_together_and_the_first_is_found() {
        let points = [Vec3::X, Vec3::ZERO, -Vec3::X, Vec3::ZERO * -1.0, Vec3::X, Vec3::ZERO];
        let index = PositionIndex::new(&points);
        let mut groups: Vec<Vec<u32>> = index.distinct().map(Iterator::collect).collect();
        groups.sort();
        assert_eq!(groups, [vec![0, 4], vec![1, 3, 5], vec![2]]);
        assert_eq!([Vec3::X, Vec3::ZERO, Vec3::Y].map(|p| index.find(p)), [Some(0), Some(1), None]);
    }
}
