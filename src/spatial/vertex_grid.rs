//! A hashed grid of the vertices of a moving mesh, for the broad phase of collision handling. Each vertex has a ball
//! that contains its triangles.

use crate::math::{Bounds, Vec3, resize, resize_within};
use crate::mesh::VertexId;

/// The number of levels of the grid, whose cell sizes differ by [`FACTOR`]. Vertices whose longest edge is at most the
/// length given to [`VertexGrid::new`] are on the first level. Those whose longest edge is too long for the last level
/// are stored there, and queries extend their search radius for them.
const LEVELS: usize = 10;

/// The ratio of the cell sizes of consecutive levels of the grid.
const FACTOR: f32 = 4.0;

/// The side of a cell, as a multiple of the largest ball radius on its level: twice the usual query radius, so that
/// such a query visits at most eight cells.
const CELL: f32 = 1.5;

/// The largest mean number of vertices per hash bucket when [`VertexGrid::link_cells`] creates the buckets.
const LOAD: usize = 2;

/// The radius stored for a vertex that is not in the grid.
const ABSENT: f32 = -1.0;

/// Marks the end of a linked list of vertices, of which each hash bucket has one.
const NONE: u32 = u32::MAX;

/// A hierarchical hashed grid of the vertices of a moving mesh, in which collision handling finds vertices near each
/// other; the longest edge at a vertex determines its level.
///
/// Vertices are inserted, moved and removed one by one, so that the grid can follow a mesh with few changes. Queries
/// find all vertices as long as none has moved further than `max_displacement` from the position last set. The order of
/// results depends on earlier changes and must not be relied upon.
///
/// If most of the mesh changes, first unlink the cells by [`Self::unlink_cells`], and relink them by
/// [`Self::link_cells`] before the next queries.
#[derive(Clone, Debug, Default)]
pub struct VertexGrid {
    /// The largest distance by which a vertex may have moved since its position was set in the grid; queries are
    /// extended by it.
    max_displacement: f32,
    /// For each level, the largest ball radius (longest edge at a vertex) that belongs on it; the last level also
    /// contains larger balls.
    max_radius: [f32; LEVELS],
    /// For each level, an upper bound of the ball radii (longest edges) on it, from which queries derive their search
    /// radius.
    largest_radius: [f32; LEVELS],
    /// For each level, the inverse of the side of its cells.
    inverse_cell: [f32; LEVELS],
    /// For each level, the number of vertices linked into its cells, so that queries skip empty levels.
    counts: [u32; LEVELS],
    /// The number of hash buckets, a power of two, minus 1: the bits of a hash that select the bucket.
    mask: u32,
    /// For each hash bucket, the vertex linked last, where its linked list begins; [`NONE`] if it is empty.
    heads: Vec<u32>,
    /// Whether vertices are linked into the buckets of their cells; if not, queries visit all vertices.
    linked: bool,
    /// The grid level, cell and position of each vertex, by slot of the mesh.
    entries: Vec<Entry>,
}

/// A bounding ball of the one-ring of a vertex, as stored in a [`VertexGrid`].
#[derive(Clone, Copy, Debug)]
pub struct VertexBall {
    /// The position of the vertex, the centre of the ball.
    pub position: Vec3,
    /// The length of the longest edge at the vertex, the radius of the ball, in units of the mesh.
    pub radius: f32,
    /// The id of the vertex in the mesh.
    pub vertex: VertexId,
}

/// A vertex in the grid: the hash `key` of its cell, whose low bits are the index of the bucket, its position and its
/// longest edge `radius`, which determines its level.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    key: u32,
    position: Vec3,
    radius: f32,
    /// The next vertex in the linked list of the bucket, or [`NONE`].
    next: u32,
}

/// The distance up to which two vertices are paired by the broad phase, as a function of their longest edges:
/// max(`least`, `margin` + `share` × longer edge).
#[derive(Clone, Copy, Debug)]
pub struct Proximity {
    /// The lower bound of the distance up to which two vertices are paired, in units of the mesh.
    pub least: f32,
    /// The part of the distance up to which two vertices are paired that does not depend on their edges, in units of
    /// the mesh.
    pub margin: f32,
    /// The factor with which the longest edge at the two vertices contributes to the distance up to which they are
    /// paired; a number without unit.
    pub share: f32,
}

impl Proximity {
    /// Returns the distance up to which two vertices are paired whose longest edges have the lengths `radius` and
    /// `other`.
    #[inline]
    pub fn distance_for(self, radius: f32, other: f32) -> f32 {
        let reach = self.margin + self.share * if other > radius { other } else { radius };
        if reach > self.least { reach } else { self.least }
    }
}

const ABSENT_ENTRY: Entry = Entry { key: 0, position: Vec3::ZERO, radius: ABSENT, next: NONE };

impl Entry {
    fn is_absent(&self) -> bool {
        self.radius == ABSENT
    }
}

impl VertexGrid {
    /// Creates an empty grid for about `vertices` vertices that may move by `max_displacement` after insertion. It is
    /// fastest if the longest edge of most vertices is slightly shorter than `edge`, which must be positive.
    pub fn new(edge: f32, max_displacement: f32, vertices: usize) -> Self {
        let mut grid = Self { max_displacement, ..Self::default() };
        let mut bound = edge;
        for level in 0..LEVELS {
            grid.max_radius[level] = bound;
            grid.inverse_cell[level] = 1.0 / (CELL * bound);
            bound *= FACTOR;
        }
        grid.entries = vec![ABSENT_ENTRY; vertices];
        grid
    }

    /// Makes entries for `vertices` vertices, with memory for `room` if that is more.
    pub fn resize(&mut self, vertices: usize, room: usize) {
        resize_within(&mut self.entries, vertices, ABSENT_ENTRY, room);
    }

    /// Inserts `v`, or updates its position and the length `radius` of its longest edge.
    pub fn set(&mut self, v: VertexId, position: Vec3, radius: f32) {
        if v.index() >= self.entries.len() {
            resize(&mut self.entries, v.index() + 1, ABSENT_ENTRY);
            // The lists are too long: cells are unlinked, so that the next `link_cells` builds more buckets.
            self.linked &= self.entries.len() <= 2 * LOAD * self.heads.len();
        }
        let level = self.level_of(radius);
        let old = self.entries[v.index()];
        let mut entry = Entry { position, radius, ..old };
        if self.linked {
            if radius > self.largest_radius[level] {
                self.largest_radius[level] = radius;
            }
            entry.key = self.key(self.cell(position, level), level);
            if old.is_absent() || (self.level_of(old.radius), old.key) != (level, entry.key) {
                self.unlink(v, old);
                self.counts[level] += 1;
                let head = self.head_mut(entry.key);
                entry.next = std::mem::replace(head, v.0);
            }
        }
        self.entries[v.index()] = entry;
    }

    /// Unlinks all vertices from their cells until [`Self::link_cells`] is called. Meanwhile updates are cheap, and
    /// queries visit all vertices.
    pub fn unlink_cells(&mut self) {
        self.linked = false;
    }

    /// Links all vertices into the hash buckets of their cells, unless they are linked already, so that queries visit
    /// only vertices in nearby cells.
    pub fn link_cells(&mut self) {
        if self.linked {
            return;
        }
        let count = (self.entries.len() / LOAD).max(64).next_power_of_two();
        self.mask = count as u32 - 1;
        self.heads.clear();
        self.heads.resize(count, NONE);
        (self.counts, self.largest_radius) = ([0; LEVELS], [0.0; LEVELS]);
        // In reverse, so that lists are in memory order.
        for i in (0..self.entries.len()).rev() {
            let Entry { position, radius, .. } = self.entries[i];
            if self.entries[i].is_absent() {
                continue;
            }
            let level = self.level_of(radius);
            self.counts[level] += 1;
            if radius > self.largest_radius[level] {
                self.largest_radius[level] = radius;
            }
            let key = self.key(self.cell(position, level), level);
            let next = std::mem::replace(self.head_mut(key), i as u32);
            self.entries[i] = Entry { key, next, ..self.entries[i] };
        }
        self.linked = true;
    }

    /// Increases the longest edge stored for `v`, which must be in the grid, to `edge` if that is longer.
    pub fn raise_radius(&mut self, v: VertexId, edge: f32) {
        let Entry { position, radius, .. } = self.entries[v.index()];
        if edge > radius {
            self.set(v, position, edge);
        }
    }

    /// Returns the position last set for `v`, which must be in the grid.
    #[inline]
    pub fn position(&self, v: VertexId) -> Vec3 {
        self.entries[v.index()].position
    }

    /// Returns the length of the longest edge last set for `v`, which must be in the grid.
    #[inline]
    pub fn radius(&self, v: VertexId) -> f32 {
        self.entries[v.index()].radius
    }

    /// Returns the bounding ball last set for `v`, which must be in the grid.
    #[inline]
    pub fn ball(&self, v: VertexId) -> VertexBall {
        let Entry { position, radius, .. } = self.entries[v.index()];
        VertexBall { position, radius, vertex: v }
    }

    /// Removes `v` if it is in the grid.
    pub fn remove(&mut self, v: VertexId) {
        if let Some(entry) = self.entries.get_mut(v.index()) {
            let old = std::mem::replace(entry, ABSENT_ENTRY);
            self.unlink(v, old);
        }
    }

    /// Removes `v` from the linked list of its hash bucket; `old` is its entry.
    fn unlink(&mut self, v: VertexId, old: Entry) {
        if old.is_absent() || !self.linked {
            return;
        }
        let level = self.level_of(old.radius);
        self.counts[level] -= 1;
        let mut at = *self.head_mut(old.key);
        if at == v.0 {
            *self.head_mut(old.key) = old.next;
            return;
        }
        while at != NONE {
            let entry = &mut self.entries[at as usize];
            if entry.next == v.0 {
                entry.next = old.next;
                return;
            }
            at = entry.next;
        }
    }

    /// Calls `found` with every vertex whose distance from the box `bounds`, in each axis, is at most `share` times its
    /// longest edge, and with some vertices further away.
    ///
    /// With a share of 1/√3, these include a corner of every triangle that intersects the box: no point of a triangle
    /// is further from its nearest corner, relative to the longest edge.
    pub fn near_box(&self, bounds: &Bounds, share: f32, mut found: impl FnMut(VertexId)) {
        let radius = |reach| share * (reach + 2.0 * self.max_displacement);
        self.search(bounds, radius, &mut |ball: &VertexBall| found(ball.vertex));
    }

    /// Calls `found` with every vertex within `radius` of `p`, and with some vertices further away.
    pub fn near_point(&self, p: Vec3, radius: f32, mut found: impl FnMut(VertexId)) {
        let point = Bounds { min: p, max: p };
        self.search(&point, |_| radius, &mut |ball: &VertexBall| found(ball.vertex));
    }

    /// Sets `found` to all balls that may be paired with vertices in the box `bounds` whose longest edges are at most
    /// `own_radius`: those whose centre is within [`Proximity::distance_for`] of the box in each axis, and some further
    /// away.
    pub fn near_balls(&self, bounds: &Bounds, own_radius: f32, near: Proximity, found: &mut Vec<VertexBall>) {
        found.clear();
        let radius = |other: f32| {
            near.distance_for(own_radius, other + 2.0 * self.max_displacement) + self.max_displacement
        };
        self.search(bounds, radius, &mut |ball: &VertexBall| found.push(*ball));
    }

    /// Returns the hash of the cell of `v`, which must be in the grid with its cells linked; used to group queries by
    /// cell.
    #[inline]
    pub fn cell_key(&self, v: VertexId) -> u32 {
        self.entries[v.index()].key
    }

    /// Calls `found` with every vertex whose distance from the box `bounds`, in each axis, may be at most `radius`, a
    /// function of its longest edge; if cells are linked, this function is evaluated only for the largest ball of each
    /// level.
    #[inline]
    fn search(&self, bounds: &Bounds, radius: impl Fn(f32) -> f32, found: &mut impl FnMut(&VertexBall)) {
        if !self.linked {
            return self.search_unlinked(bounds, radius, found);
        }
        for level in (0..LEVELS).filter(|&level| self.counts[level] > 0) {
            let around = Vec3::splat(radius(self.largest_radius[level]) + self.max_displacement);
            let wide = Bounds { min: bounds.min - around, max: bounds.max + around };
            self.search_level(level, &wide, found);
        }
    }

    fn search_unlinked(
        &self,
        bounds: &Bounds,
        radius: impl Fn(f32) -> f32,
        found: &mut impl FnMut(&VertexBall),
    ) {
        for (i, entry) in self.entries.iter().enumerate().filter(|(_, entry)| !entry.is_absent()) {
            let around = Vec3::splat(radius(entry.radius) + self.max_displacement);
            let wide = Bounds { min: bounds.min - around, max: bounds.max + around };
            if wide.contains(entry.position) {
                found(&self.ball(VertexId::from_index(i)));
            }
        }
    }

    #[inline]
    fn search_level(&self, level: usize, wide: &Bounds, found: &mut impl FnMut(&VertexBall)) {
        let (low, high) = (self.cell(wide.min, level), self.cell(wide.max, level));
        let counts = [0, 1, 2].map(|k| i64::from(high[k]) - i64::from(low[k]) + 1);
        let cells = counts[0] as f64 * counts[1] as f64 * counts[2] as f64;
        if cells > 64.0 + f64::from(self.counts[level]) {
            return self.search_all(level, wide, found);
        }
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    self.search_cell(self.key([x, y, z], level), wide, found);
                }
            }
        }
    }

    /// Calls `found` with the vertices in the box `wide` whose cell has the hash `key`; other vertices in the same
    /// bucket are skipped.
    #[inline]
    fn search_cell(&self, key: u32, wide: &Bounds, found: &mut impl FnMut(&VertexBall)) {
        let mut at = self.heads[(key & self.mask) as usize];
        while at != NONE {
            let &Entry { position, radius, next, .. } = &self.entries[at as usize];
            if self.entries[at as usize].key == key && wide.contains(position) {
                found(&VertexBall { position, radius, vertex: VertexId(at) });
            }
            at = next;
        }
    }

    fn search_all(&self, level: usize, wide: &Bounds, found: &mut impl FnMut(&VertexBall)) {
        for (i, entry) in self.entries.iter().enumerate() {
            if !entry.is_absent() && self.level_of(entry.radius) == level && wide.contains(entry.position) {
                found(&self.ball(VertexId::from_index(i)));
            }
        }
    }

    fn level_of(&self, radius: f32) -> usize {
        (0..LEVELS).find(|&level| radius <= self.max_radius[level]).unwrap_or(LEVELS - 1)
    }

    #[inline]
    fn cell(&self, p: Vec3, level: usize) -> [i32; 3] {
        let scaled = p * self.inverse_cell[level];
        [floor(scaled.x), floor(scaled.y), floor(scaled.z)]
    }

    /// Returns the hash of a cell: consecutive along z, so that adjacent cells use adjacent buckets, and scattered over
    /// columns and levels. Two cells of a level with the same hash are at least 1,195 cells apart along an axis, so no
    /// query of an ordinary size visits both. With ^ in place of the first +, the columns (x, y) and (−x, −y) would have
    /// the same hash if x and y are odd.
    #[inline]
    fn key(&self, [x, y, z]: [i32; 3], level: usize) -> u32 {
        let column = (x as u32).wrapping_mul(73_856_093).wrapping_add((y as u32).wrapping_mul(19_349_663));
        column.wrapping_add(z as u32).wrapping_add((level as u32).wrapping_mul(83_492_791))
    }

    #[inline]
    fn head_mut(&mut self, key: u32) -> &mut u32 {
        &mut self.heads[(key & self.mask) as usize]
    }
}

/// Returns the largest integer not above `x`; faster than `f32::floor` when compiled for an older instruction set.
#[inline]
fn floor(x: f32) -> i32 {
    let whole = x as i32;
    whole.saturating_sub(i32::from(whole as f32 > x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a seeded generator of numbers in 0..1.
    fn numbers(seed: u64) -> impl FnMut() -> f32 {
        let mut random = Random::new(seed);
        move || (random.next_u32() >> 8) as f32 / (1 << 24) as f32
    }

    /// The position and longest edge of each vertex, `None` for removed vertices.
    type Known = Vec<Option<(Vec3, f32)>>;

    /// Inserts, moves and removes vertices of `grid` at random, with cells linked and unlinked; most edges are
    /// ordinary, some tiny or huge. Returns the expected contents of the grid.
    fn shuffled(grid: &mut VertexGrid, next: &mut impl FnMut() -> f32) -> Known {
        let mut known: Known = vec![None; 600];
        for _ in 0..3000 {
            let v = (next() * 600.0) as usize;
            match next() {
                x if x < 0.002 => grid.unlink_cells(),
                x if x < 0.01 => grid.link_cells(),
                _ => {}
            }
            if next() < 0.2 {
                grid.remove(VertexId::from_index(v));
                known[v] = None;
                continue;
            }
            let radius = [0.001, 0.5, 0.9, 1.0, 1.4, 7.0, 1e9][(next() * next() * 7.0) as usize] * next();
            let position = Vec3::new(next(), next(), next()) * 20.0 - 10.0;
            grid.set(VertexId::from_index(v), position, radius);
            known[v] = Some((position, radius));
        }
        known
    }

    fn expected(known: &Known, near: impl Fn(Vec3, f32) -> bool) -> Vec<usize> {
        (0..known.len()).filter(|&v| known[v].is_some_and(|(p, radius)| near(p, radius))).collect()
    }

    /// Asserts that `found` has no duplicates and contains all `expected` vertices, both given by index.
    fn assert_complete(mut found: Vec<usize>, expected: &[usize]) {
        found.sort_unstable();
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "a vertex is found twice");
        assert!(expected.iter().all(|v| found.binary_search(v).is_ok()), "{expected:?} in {found:?}");
    }

    #[test]
    fn searches_find_what_brute_force_finds() {
        let mut next = numbers(3);
        for edge in [0.01, 1.0, 30.0] {
            let mut grid = VertexGrid::new(edge, 0.0, 10);
            let known = shuffled(&mut grid, &mut next);
            for turn in 0..100 {
                if turn == 20 {
                    grid.link_cells();
                }
                let p = Vec3::new(next(), next(), next()) * 24.0 - 12.0;
                for (p, radius) in [(p, 1.5), (p * 0.05, 3.5)] {
                    let mut found = Vec::new();
                    grid.near_point(p, radius, |v| found.push(v.index()));
                    assert_complete(found, &expected(&known, |q, _| q.distance(p) < radius));
                }

                let bounds = Bounds { min: p, max: p + Vec3::new(next(), next(), next()) };
                let mut found = Vec::new();
                grid.near_box(&bounds, 0.5, |v| found.push(v.index()));
                let in_box = |q, radius| bounds.distance_squared(q).sqrt() < 0.5 * f64::from(radius);
                assert_complete(found, &expected(&known, in_box));

                let near = Proximity { least: 0.7, margin: 0.1, share: 0.8 };
                let mut found = Vec::new();
                grid.near_balls(&bounds, 1.1, near, &mut found);
                let in_reach =
                    |q, radius| bounds.distance_squared(q).sqrt() < f64::from(near.distance_for(1.1, radius));
                let found = found.into_iter().map(|ball| ball.vertex.index()).collect();
                assert_complete(found, &expected(&known, in_reach));
            }
        }
    }

    #[test]
    fn cells_near_each_other_have_different_hashes() {
        let grid = VertexGrid::new(1.0, 0.0, 0);
        let side = |k: i32| [k % 41 - 20, k / 41 % 41 - 20, k / 1681 - 20];
        let keys: std::collections::BTreeSet<u32> = (0..41 * 1681).map(|k| grid.key(side(k), 3)).collect();
        assert_eq!(keys.len(), 41 * 1681);
    }

    #[test]
    fn queries_allow_for_displacements_since_the_update() {
        let mut next = numbers(4);
        let mut grid = VertexGrid::new(1.0, 0.25, 10);
        let mut known = shuffled(&mut grid, &mut next);
        grid.link_cells();
        for entry in known.iter_mut().flatten() {
            let shift = Vec3::new(next(), next(), next()) - 0.5;
            entry.0 += shift * (0.25 / shift.length());
        }
        for _ in 0..200 {
            let p = Vec3::new(next(), next(), next()) * 24.0 - 12.0;
            let mut found = Vec::new();
            grid.near_point(p, 1.5, |v| found.push(v.index()));
            assert_complete(found, &expected(&known, |q, _| q.distance(p) < 1.5));
        }
    }
}
