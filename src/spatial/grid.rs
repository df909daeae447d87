//! Points near a point, for points that move a little all the time.

use crate::math::Vec3;
use crate::mesh::VertexId;

/// A hashed uniform grid over points, rebuilt as a whole by one counting sort.
///
/// Cells are twice the search radius wide, so a search meets at most 2 × 2 columns of cells, and the two cells it
/// needs of a column lie side by side in memory.
#[derive(Clone, Debug, Default)]
pub struct PointGrid {
    radius: f32,
    inverse_cell: f32,
    mask: u32,
    starts: Vec<u32>,
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    position: Vec3,
    vertex: VertexId,
}

impl PointGrid {
    /// Holds `points` from now on, to be searched within `radius` (positive).
    pub fn rebuild(
        &mut self,
        points: impl Iterator<Item = (VertexId, Vec3)> + Clone,
        count: usize,
        radius: f32,
    ) {
        self.radius = radius;
        self.inverse_cell = 0.5 / radius;
        let buckets = count.max(1).next_power_of_two();
        self.mask = buckets as u32 - 1;
        self.starts.clear();
        self.starts.resize(buckets + 1, 0);
        for (_, position) in points.clone() {
            let bucket = self.bucket_of(position);
            self.starts[bucket + 1] += 1;
        }
        for b in 0..buckets {
            self.starts[b + 1] += self.starts[b];
        }
        let blank = Entry { position: Vec3::ZERO, vertex: VertexId(0) };
        self.entries.clear();
        self.entries.resize(count, blank);
        // Filled from the back of each bucket; `starts` ends as the true starts.
        let mut ends: Vec<u32> = self.starts[1..].to_vec();
        for (vertex, position) in points {
            let end = &mut ends[self.bucket_of(position)];
            *end -= 1;
            self.entries[*end as usize] = Entry { position, vertex };
        }
    }

    fn cell(&self, x: f32) -> i32 {
        (x * self.inverse_cell).floor() as i32
    }

    fn column(x: i32, y: i32) -> u32 {
        (x as u32).wrapping_mul(73_856_093) ^ (y as u32).wrapping_mul(19_349_663)
    }

    fn bucket(&self, column: u32, z: i32) -> usize {
        (column.wrapping_add(z as u32) & self.mask) as usize
    }

    fn bucket_of(&self, p: Vec3) -> usize {
        self.bucket(Self::column(self.cell(p.x), self.cell(p.y)), self.cell(p.z))
    }

    /// Calls `found` with every point nearer to `p` than the radius, and its squared distance.
    ///
    /// The order depends only on the points and the order they were given in.
    pub fn near(&self, p: Vec3, mut found: impl FnMut(VertexId, f32)) {
        let r = self.radius;
        let (x0, x1) = (self.cell(p.x - r), self.cell(p.x + r));
        let (y0, y1) = (self.cell(p.y - r), self.cell(p.y + r));
        let (z0, z1) = (self.cell(p.z - r), self.cell(p.z + r));
        for x in x0..=x1 {
            for y in y0..=y1 {
                for z in z0..=z1 {
                    self.search_cell(p, [x, y, z], &mut found);
                }
            }
        }
    }

    /// Points of other cells that share the bucket are passed over, so that no point is found twice.
    fn search_cell(&self, p: Vec3, cell: [i32; 3], found: &mut impl FnMut(VertexId, f32)) {
        let bucket = self.bucket(Self::column(cell[0], cell[1]), cell[2]);
        let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
        for entry in &self.entries[range] {
            let square = entry.position.distance_squared(p);
            let q = entry.position;
            if square < self.radius * self.radius && [self.cell(q.x), self.cell(q.y), self.cell(q.z)] == cell
            {
                found(entry.vertex, square);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn finds_each_near_point_once() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 * 20.0 - 10.0
        };
        let points: Vec<Vec3> = (0..900).map(|_| Vec3::new(next(), next(), next())).collect();
        let named = points.iter().enumerate().map(|(i, &p)| (VertexId(i as u32), p));
        let mut grid = PointGrid::default();
        for radius in [0.3, 1.0, 4.0, 50.0] {
            grid.rebuild(named.clone(), points.len(), radius);
            for &p in points.iter().step_by(31) {
                let mut found = Vec::new();
                grid.near(p, |v, _| found.push(v));
                found.sort();
                let expected = named.clone().filter(|(_, q)| q.distance_squared(p) < radius * radius);
                assert_eq!(found, expected.map(|(v, _)| v).collect::<Vec<_>>());
            }
        }
    }
}
