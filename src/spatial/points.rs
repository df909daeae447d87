//! A hashed grid of points for neighbour queries; points can be inserted between queries.

use crate::math::Vec3;
use crate::math::order::{select_least, sort_pairs};

/// Marks the end of a linked list of points, of which each hash bucket has one.
const NONE: u32 = u32::MAX;

/// A hashed grid of points, for fixed-radius and nearest-neighbour queries. Cells are hashed into buckets, so that
/// empty space needs no memory.
#[derive(Clone, Debug)]
pub struct PointGrid {
    cell: f32,
    points: Vec<Vec3>,
    /// For each hash bucket, the index of the point inserted last, where its linked list begins; [`NONE`] if it is
    /// empty.
    heads: Vec<u32>,
    /// For each point, the index of the next point in the list of its bucket, or [`NONE`].
    next: Vec<u32>,
}

impl Default for PointGrid {
    /// Creates an empty grid with cubic cells of side 1, in units of the points, and with buckets for a few points.
    fn default() -> Self {
        Self::new(1.0, 0)
    }
}

impl PointGrid {
    /// Creates an empty grid with cubic cells of side `cell`, in units of the points, and with buckets for about
    /// `expected` points; queries get slower if it contains many more.
    pub fn new(cell: f32, expected: usize) -> Self {
        let buckets = (2 * expected).next_power_of_two().max(16);
        Self { cell, points: Vec::new(), heads: vec![NONE; buckets], next: Vec::new() }
    }

    /// Creates a grid with cubic cells of side `cell` that contains `points`; queries return the indices of `points`.
    pub fn of(points: &[Vec3], cell: f32) -> Self {
        let mut grid = Self::new(cell, points.len());
        points.iter().for_each(|&p| grid.insert(p));
        grid
    }

    /// Inserts a finite point; its index is the number of points inserted before.
    pub fn insert(&mut self, p: Vec3) {
        let bucket = self.bucket(self.cell_of(p));
        self.next.push(self.heads[bucket]);
        self.heads[bucket] = self.points.len() as u32;
        self.points.push(p);
    }

    /// Returns the side of a cell.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Returns all points, ordered by index.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Calls `visit` with the index and squared distance of every point within `radius` of `p`, until it returns false.
    /// The order is unspecified but deterministic.
    pub fn within(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32) -> bool) {
        let [low, high] = [-radius, radius].map(|reach| self.cell_of(p + Vec3::splat(reach)));
        if self.is_faster_to_visit_all(low, high) {
            self.visit_all(p, radius * radius, &mut visit);
            return;
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    if !self.visit_cell([x, y, z], p, radius * radius, &mut visit) {
                        return;
                    }
                }
            }
        }
    }

    /// Returns whether any point is within `radius` of `p`.
    pub fn has_within(&self, p: Vec3, radius: f32) -> bool {
        let mut found = false;
        self.within(p, radius, |_, _| {
            found = true;
            false
        });
        found
    }

    /// Returns the `count` nearest points to `p`, or all if there are fewer, as pairs of squared distance and index,
    /// sorted by distance, then index. `radius` is the initial search radius, which is increased as needed.
    pub fn nearest(&self, p: Vec3, count: usize, radius: f32) -> Vec<(f32, u32)> {
        let mut found = Vec::new();
        // A radius of 0 could not be increased by a factor.
        let mut reach = if radius > 0.0 { radius } else { self.cell };
        loop {
            // With too many cells it is faster to visit all points. With a cell side of 0 their number is not finite.
            let across = 2.0 * reach / self.cell;
            let few = across * across * across <= 8.0 * self.points.len() as f32;
            found.clear();
            if !few {
                found = self.points.iter().map(|q| q.distance_squared(p)).zip(0..).collect();
                break;
            }
            self.within(p, reach, |i, squared| {
                found.push((squared, i));
                true
            });
            if found.len() >= count || found.len() == self.points.len() {
                break;
            }
            reach *= 1.5;
        }
        // Bits of non-negative numbers are ordered like the numbers.
        let mut ranked: Vec<(u64, u32)> =
            found.iter().map(|&(squared, i)| (squared.to_bits().into(), i)).collect();
        if ranked.len() > count {
            select_least(&mut ranked, count);
            ranked.truncate(count);
        }
        sort_pairs(&mut ranked);
        ranked.into_iter().map(|(squared, i)| (f32::from_bits(squared as u32), i)).collect()
    }

    /// Whether a box has many more cells than there are points.
    fn is_faster_to_visit_all(&self, low: [i32; 3], high: [i32; 3]) -> bool {
        let across = |axis: usize| f64::from(high[axis]) - f64::from(low[axis]) + 1.0;
        across(0) * across(1) * across(2) > 8.0 * (self.points.len() + 27) as f64
    }

    fn visit_all(&self, p: Vec3, most: f32, visit: &mut impl FnMut(u32, f32) -> bool) {
        for (q, i) in self.points.iter().zip(0..) {
            let squared = q.distance_squared(p);
            if squared <= most && !visit(i, squared) {
                return;
            }
        }
    }

    fn visit_cell(
        &self,
        cell: [i32; 3],
        p: Vec3,
        most: f32,
        visit: &mut impl FnMut(u32, f32) -> bool,
    ) -> bool {
        let mut at = self.heads[self.bucket(cell)];
        while at != NONE {
            let q = self.points[at as usize];
            let squared = q.distance_squared(p);
            // Skips points of other cells in the same bucket.
            if squared <= most && self.cell_of(q) == cell && !visit(at, squared) {
                return false;
            }
            at = self.next[at as usize];
        }
        true
    }

    fn cell_of(&self, p: Vec3) -> [i32; 3] {
        (p / self.cell).floor().to_array().map(|x| x as i32)
    }

    fn bucket(&self, [x, y, z]: [i32; 3]) -> usize {
        let mixed = (x as u32).wrapping_mul(0x9E37_79B1)
            ^ (y as u32).wrapping_mul(0x85EB_CA77)
            ^ (z as u32).wrapping_mul(0xC2B2_AE3D);
        (mixed ^ mixed >> 15) as usize & (self.heads.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn points(count: usize) -> Vec<Vec3> {
        let mut random = Random::new(4);
        let mut unit = || random.next_u32() as f32 / 4_294_967_296.0;
        // Uniformly distributed points, a distant cluster, and duplicates.
        let mut all: Vec<Vec3> = (0..count).map(|_| Vec3::new(unit(), unit(), unit()) * 2.0 - 1.0).collect();
        all.extend((0..count / 4).map(|_| Vec3::new(9.0 + 1e-4 * unit(), -3.0, 1e-4 * unit())));
        all.extend_from_within(..3);
        all
    }

    #[test]
    fn within_a_radius_are_all_and_no_others() {
        let all = points(300);
        for cell in [0.05, 0.3, 5.0] {
            let grid = PointGrid::of(&all, cell);
            assert_eq!(grid.points(), all);
            for &p in all.iter().step_by(7) {
                // The last ones are in more cells than could be visited.
                for radius in [0.0, 1e-5, 0.1, 0.6, 1e4, 1e30] {
                    let mut found = Vec::new();
                    grid.within(p, radius, |i, squared| {
                        assert_eq!(squared, all[i as usize].distance_squared(p));
                        found.push(i);
                        true
                    });
                    found.sort_unstable();
                    let expected: Vec<u32> = (0..all.len() as u32)
                        .filter(|&i| all[i as usize].distance_squared(p) <= radius * radius)
                        .collect();
                    assert_eq!(found, expected, "cell {cell}, radius {radius}");
                    assert!(grid.has_within(p, radius));
                }
            }
            assert!(!grid.has_within(Vec3::splat(4.0), 1.0));
        }
    }

    #[test]
    fn the_nearest_are_those_of_all_pairs() {
        let all = points(200);
        for (cell, radius) in [(0.05, 0.1), (0.3, 0.01), (2.0, 9.0), (1e-6, 0.0), (1e-6, 1e-6)] {
            let grid = PointGrid::of(&all, cell);
            for &p in all.iter().step_by(5).chain(&[Vec3::splat(1000.0), Vec3::splat(-3.0)]) {
                for count in [1, 5, 32, 1000] {
                    let mut expected: Vec<(f32, u32)> =
                        all.iter().map(|q| q.distance_squared(p)).zip(0..).collect();
                    expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    expected.truncate(count);
                    assert_eq!(
                        grid.nearest(p, count, radius),
                        expected,
                        "cell {cell}, {count} from {radius}"
                    );
                }
            }
        }
        assert!(PointGrid::new(0.1, 0).nearest(Vec3::ZERO, 3, 0.1).is_empty());
    }

    #[test]
    fn a_visit_can_be_ended() {
        let grid = PointGrid::of(&points(100), 0.5);
        let mut seen = 0;
        grid.within(Vec3::ZERO, 2.0, |_, _| {
            seen += 1;
            seen < 3
        });
        assert_eq!(seen, 3);
    }

    #[test]
    fn cells_and_radii_of_0_lead_to_all_points() {
        let points = points(20);
        for (cell, radius) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1e-38, 1e-38)] {
            let found = PointGrid::of(&points, cell).nearest(points[3], 3, radius);
            assert_eq!((found.len(), found[0].0), (3, 0.0), "{cell}, {radius}");
        }
    }
}
