//! A set of grid cells around given points, by which tests are limited to the region near these points.

use crate::math::Vec3;
use std::collections::BTreeSet;

/// A set of cells of a regular grid: those that contain an added point, and all cells adjacent to them. Quickly rejects
/// positions that are not near the points, so that the tests of edits for self-intersections and the search for missing
/// parts are limited to a region.
#[derive(Clone, Debug)]
pub struct CellSet {
    side: f32,
    cells: BTreeSet<[i32; 3]>,
}

impl CellSet {
    /// Creates an empty set, for a grid of cubic cells with edges of length `side`, in units of the points.
    pub fn new(side: f32) -> Self {
        Self { side, cells: BTreeSet::new() }
    }

    /// Adds the cell that contains `p` and its 26 adjacent cells to the set.
    pub fn insert_around(&mut self, p: Vec3) {
        let at: [i32; 3] = self.cell(p);
        for k in 0..27 {
            let shift = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            self.cells.insert([0, 1, 2].map(|axis| at[axis].saturating_add(shift[axis])));
        }
    }

    /// Returns whether `p` is in a cell of the set; always true if an added point is within the edge length of a cell.
    pub fn contains(&self, p: Vec3) -> bool {
        self.cells.contains(&self.cell(p))
    }

    fn cell(&self, p: Vec3) -> [i32; 3] {
        (p / self.side).floor().as_ivec3().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn points_within_a_side_are_contained() {
        let mut random = Random::new(1);
        let mut any = |size: f32| Vec3::from([(); 3].map(|()| (random.unit() as f32 - 0.5) * size));
        let points: Vec<Vec3> = (0..20).map(|_| any(60.0)).collect();
        let mut cells = CellSet::new(2.5);
        points.iter().for_each(|&p| cells.insert_around(p));
        let mut beyond = 0;
        for _ in 0..5000 {
            let p = any(70.0);
            let distance = points.iter().fold(f32::INFINITY, |least, q| least.min(p.distance(*q)));
            assert!(cells.contains(p) || distance > 2.5, "{p}");
            beyond += u32::from(!cells.contains(p));
        }
        assert!(beyond > 1000, "{beyond} points are in no cell");
    }
}
