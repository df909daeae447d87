//! The vertices of a mesh that moves, found by where their triangles may be.

use crate::math::{Bounds, Vec3};
use crate::mesh::VertexId;

/// Levels of cells, a factor of four apart. All stars up to the size the grid was made for are on the first; one that is
/// larger than those of the last is kept there, where it is found by looking further.
const LEVELS: usize = 10;
const FACTOR: f32 = 4.0;

/// Side of a cell in the longest edge of the stars it holds: twice the usual radius of a search, which so meets eight
/// cells.
const CELL: f32 = 1.5;

/// Vertices in a bucket for which there is room, in the mean.
const LOAD: usize = 2;

/// The level of a vertex that is not in the grid.
const ABSENT: u32 = u32::MAX;

/// No vertex.
const NONE: u32 = u32::MAX;

/// Vertices in a hashed grid, each on a level of cells as coarse as its star: the longest edge at the vertex.
///
/// A vertex is entered, moved and removed one at a time, so that the grid follows a mesh of which little changes. It may
/// also lag behind: searches find what they should as long as no vertex is further than `blur` from where it was entered.
/// What they find comes in an order that depends on what happened before; nobody may rely on it.
///
/// Where the whole mesh changes, cells are emptied first and filled when something is searched for, if ever.
#[derive(Clone, Debug, Default)]
pub struct StarGrid {
    blur: f32,
    /// Bound of the longest edges on each level, and the longest one that has been there.
    bound: [f32; LEVELS],
    reach: [f32; LEVELS],
    inverse_cell: [f32; LEVELS],
    /// How many vertices are on each level.
    population: [u32; LEVELS],
    mask: u32,
    /// By bucket, the vertex entered last.
    heads: Vec<u32>,
    /// Whether vertices are in their buckets.
    filled: bool,
    /// By vertex slot.
    places: Vec<Place>,
}

/// A vertex as it was entered.
#[derive(Clone, Copy, Debug)]
pub struct Star {
    /// Where it was.
    pub position: Vec3,
    /// Its longest edge.
    pub longest: f32,
    /// Its name.
    pub vertex: VertexId,
}

/// The cell of a vertex: its level and the hash of its coordinates, of which the last bits name the bucket.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    level: u32,
    key: u32,
    position: Vec3,
    longest: f32,
    /// The vertex entered before it into the same bucket.
    next: u32,
}

/// How near two stars are that are said to be near each other.
#[derive(Clone, Copy, Debug)]
pub struct Nearness {
    /// At least so far apart, …
    pub least: f32,
    /// … and so far beyond …
    pub margin: f32,
    /// … this share of the longest edge of both.
    pub share: f32,
}

impl Nearness {
    /// The distance below which two stars with these longest edges are near each other.
    #[inline]
    pub fn between(self, longest: f32, other: f32) -> f32 {
        let reach = self.margin + self.share * if other > longest { other } else { longest };
        if reach > self.least { reach } else { self.least }
    }
}

const NOWHERE: Place = Place { level: ABSENT, key: 0, position: Vec3::ZERO, longest: 0.0, next: NONE };

impl StarGrid {
    /// An empty grid, fastest for stars whose longest edge is somewhat below `edge` (positive), with room for
    /// `vertices`; more may come.
    pub fn new(edge: f32, blur: f32, vertices: usize) -> Self {
        let mut grid = Self { blur, ..Self::default() };
        let mut bound = edge;
        for level in 0..LEVELS {
            grid.bound[level] = bound;
            grid.inverse_cell[level] = 1.0 / (CELL * bound);
            bound *= FACTOR;
        }
        grid.places = vec![NOWHERE; vertices];
        grid
    }

    /// Enters `v` or moves it: it is at `position`, its longest edge `longest`.
    pub fn set(&mut self, v: VertexId, position: Vec3, longest: f32) {
        if v.index() >= self.places.len() {
            self.places.resize(v.index() + 1, NOWHERE);
            // Chains got long: they are made anew when next needed.
            self.filled &= self.places.len() <= 2 * LOAD * self.heads.len();
        }
        let level = self.level_of(longest);
        let old = self.places[v.index()];
        let mut place = Place { level: level as u32, position, longest, ..old };
        if self.filled {
            if longest > self.reach[level] {
                self.reach[level] = longest;
            }
            place.key = self.key(self.cell(position, level), level);
            if (old.level, old.key) != (place.level, place.key) {
                self.leave(v, old);
                self.population[level] += 1;
                let head = self.head_mut(place.key);
                place.next = std::mem::replace(head, v.0);
            }
        }
        self.places[v.index()] = place;
    }

    /// Takes all vertices out of their cells, until [`Self::fill_cells`]. So long they are entered and moved in no time, and
    /// searches look at all of them.
    pub fn empty_cells(&mut self) {
        self.filled = false;
    }

    /// Puts all vertices into their cells, if they are not there.
    pub fn fill_cells(&mut self) {
        if self.filled {
            return;
        }
        let count = (self.places.len() / LOAD).max(64).next_power_of_two();
        self.mask = count as u32 - 1;
        self.heads.clear();
        self.heads.resize(count, NONE);
        (self.population, self.reach) = ([0; LEVELS], [0.0; LEVELS]);
        // Backwards, so that chains go on in the order of memory.
        for i in (0..self.places.len()).rev() {
            let Place { level, position, longest, .. } = self.places[i];
            if level == ABSENT {
                continue;
            }
            let level = level as usize;
            self.population[level] += 1;
            if longest > self.reach[level] {
                self.reach[level] = longest;
            }
            let key = self.key(self.cell(position, level), level);
            let next = std::mem::replace(self.head_mut(key), i as u32);
            self.places[i] = Place { key, next, ..self.places[i] };
        }
        self.filled = true;
    }

    /// Tells that `v`, which is in the grid, has an edge as long as `edge`.
    pub fn stretch(&mut self, v: VertexId, edge: f32) {
        let Place { position, longest, .. } = self.places[v.index()];
        if edge > longest {
            self.set(v, position, edge);
        }
    }

    /// Where `v`, which is in the grid, was entered.
    #[inline]
    pub fn position(&self, v: VertexId) -> Vec3 {
        self.places[v.index()].position
    }

    /// The longest edge that `v`, which is in the grid, was entered with.
    #[inline]
    pub fn longest(&self, v: VertexId) -> f32 {
        self.places[v.index()].longest
    }

    /// `v`, which is in the grid, as it was entered.
    #[inline]
    pub fn star(&self, v: VertexId) -> Star {
        let Place { position, longest, .. } = self.places[v.index()];
        Star { position, longest, vertex: v }
    }

    /// Takes `v` out, if it is in.
    pub fn remove(&mut self, v: VertexId) {
        if let Some(place) = self.places.get_mut(v.index()) {
            let old = std::mem::replace(place, NOWHERE);
            self.leave(v, old);
        }
    }

    /// Takes `v` out of the bucket of `old`, its place there.
    fn leave(&mut self, v: VertexId, old: Place) {
        if old.level == ABSENT || !self.filled {
            return;
        }
        self.population[old.level as usize] -= 1;
        let mut at = *self.head_mut(old.key);
        if at == v.0 {
            *self.head_mut(old.key) = old.next;
            return;
        }
        while at != NONE {
            let entry = &mut self.places[at as usize];
            if entry.next == v.0 {
                entry.next = old.next;
                return;
            }
            at = entry.next;
        }
    }

    /// Calls `found` with every vertex that is within `share` × its longest edge of the box, axis by axis, and some that
    /// are a little further away.
    ///
    /// Every triangle that meets the box has a corner among those found for 1/√3, the largest distance from a point of a
    /// triangle to its nearest corner in its longest edge.
    pub fn near_box(&self, bounds: &Bounds, share: f32, mut found: impl FnMut(VertexId)) {
        let radius = |reach| share * (reach + 2.0 * self.blur);
        self.search(bounds, radius, &mut |entry: &Star| found(entry.vertex));
    }

    /// Calls `found` with every vertex within `radius` of the point, and some that are a little further away.
    pub fn near_point(&self, p: Vec3, radius: f32, mut found: impl FnMut(VertexId)) {
        let point = Bounds { min: p, max: p };
        self.search(&point, |_| radius, &mut |star: &Star| found(star.vertex));
    }

    /// Puts into `found` every vertex within [`Nearness::between`] some star of the box that has edges up to `longest`,
    /// axis by axis, and some that are a little further away.
    pub fn near_stars(&self, bounds: &Bounds, longest: f32, near: Nearness, found: &mut Vec<Star>) {
        found.clear();
        let radius = |other: f32| near.between(longest, other + 2.0 * self.blur) + self.blur;
        self.search(bounds, radius, &mut |star: &Star| found.push(*star));
    }

    /// Names the cell of `v`, which is in the grid with its cells filled; others may have the same name.
    #[inline]
    pub fn cell_name(&self, v: VertexId) -> u32 {
        self.places[v.index()].key
    }

    /// Calls `found` with every vertex that may be within `radius(longest edge of its level)` of the box, axis by axis.
    #[inline]
    fn search(&self, bounds: &Bounds, radius: impl Fn(f32) -> f32, found: &mut impl FnMut(&Star)) {
        if !self.filled {
            return self.search_unfilled(bounds, radius, found);
        }
        for level in (0..LEVELS).filter(|&level| self.population[level] > 0) {
            let around = Vec3::splat(radius(self.reach[level]) + self.blur);
            let wide = Bounds { min: bounds.min - around, max: bounds.max + around };
            self.search_level(level, &wide, found);
        }
    }

    fn search_unfilled(&self, bounds: &Bounds, radius: impl Fn(f32) -> f32, found: &mut impl FnMut(&Star)) {
        for (i, place) in self.places.iter().enumerate().filter(|(_, place)| place.level != ABSENT) {
            let around = Vec3::splat(radius(place.longest) + self.blur);
            let wide = Bounds { min: bounds.min - around, max: bounds.max + around };
            if wide.contains(place.position) {
                found(&self.star(VertexId::from_index(i)));
            }
        }
    }

    #[inline]
    fn search_level(&self, level: usize, wide: &Bounds, found: &mut impl FnMut(&Star)) {
        let (low, high) = (self.cell(wide.min, level), self.cell(wide.max, level));
        let counts = [0, 1, 2].map(|k| i64::from(high[k]) - i64::from(low[k]) + 1);
        let cells = counts[0] as f64 * counts[1] as f64 * counts[2] as f64;
        if cells > 64.0 + f64::from(self.population[level]) {
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

    /// Vertices of other cells in the same bucket are passed over, so that none is found twice.
    #[inline]
    fn search_cell(&self, key: u32, wide: &Bounds, found: &mut impl FnMut(&Star)) {
        let mut at = self.heads[(key & self.mask) as usize];
        while at != NONE {
            let &Place { position, longest, next, .. } = &self.places[at as usize];
            if self.places[at as usize].key == key && wide.contains(position) {
                found(&Star { position, longest, vertex: VertexId(at) });
            }
            at = next;
        }
    }

    fn search_all(&self, level: usize, wide: &Bounds, found: &mut impl FnMut(&Star)) {
        for (i, place) in self.places.iter().enumerate() {
            if place.level as usize == level && wide.contains(place.position) {
                found(&self.star(VertexId::from_index(i)));
            }
        }
    }

    fn level_of(&self, longest: f32) -> usize {
        (0..LEVELS).find(|&level| longest <= self.bound[level]).unwrap_or(LEVELS - 1)
    }

    #[inline]
    fn cell(&self, p: Vec3, level: usize) -> [i32; 3] {
        let scaled = p * self.inverse_cell[level];
        [floor(scaled.x), floor(scaled.y), floor(scaled.z)]
    }

    /// Hash of a cell; those above each other lie side by side, columns and levels far apart.
    #[inline]
    fn key(&self, [x, y, z]: [i32; 3], level: usize) -> u32 {
        let column = (x as u32).wrapping_mul(73_856_093) ^ (y as u32).wrapping_mul(19_349_663);
        column.wrapping_add(z as u32).wrapping_add((level as u32).wrapping_mul(83_492_791))
    }

    #[inline]
    fn head_mut(&mut self, key: u32) -> &mut u32 {
        &mut self.heads[(key & self.mask) as usize]
    }
}

/// The next integer below; a call of `f32::floor` is slow on processors taken for older than they are.
#[inline]
fn floor(x: f32) -> i32 {
    let whole = x as i32;
    whole.saturating_sub(i32::from(whole as f32 > x))
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn numbers(mut state: u32) -> impl FnMut() -> f32 {
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        }
    }

    /// Where vertices are now, with their longest edges; `None` for those taken out.
    type Known = Vec<Option<(Vec3, f32)>>;

    /// Enters, moves and takes out vertices at random, with cells filled and empty; most stars are ordinary, some tiny, some
    /// huge.
    fn shuffled(grid: &mut StarGrid, next: &mut impl FnMut() -> f32) -> Known {
        let mut known: Known = vec![None; 600];
        for _ in 0..3000 {
            let v = (next() * 600.0) as usize;
            match next() {
                x if x < 0.002 => grid.empty_cells(),
                x if x < 0.01 => grid.fill_cells(),
                _ => {}
            }
            if next() < 0.2 {
                grid.remove(VertexId::from_index(v));
                known[v] = None;
                continue;
            }
            let longest = [0.001, 0.5, 0.9, 1.0, 1.4, 7.0, 1e9][(next() * next() * 7.0) as usize] * next();
            let position = Vec3::new(next(), next(), next()) * 20.0 - 10.0;
            grid.set(VertexId::from_index(v), position, longest);
            known[v] = Some((position, longest));
        }
        known
    }

    fn expected(known: &Known, near: impl Fn(Vec3, f32) -> bool) -> Vec<usize> {
        (0..known.len()).filter(|&v| known[v].is_some_and(|(p, longest)| near(p, longest))).collect()
    }

    /// `found` holds each vertex once, and all that are `expected`.
    fn assert_complete(mut found: Vec<usize>, expected: &[usize]) {
        found.sort_unstable();
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "a vertex is found twice");
        assert!(expected.iter().all(|v| found.binary_search(v).is_ok()), "{expected:?} in {found:?}");
    }

    #[test]
    fn searches_find_what_brute_force_finds() {
        let mut next = numbers(3);
        for edge in [0.01, 1.0, 30.0] {
            let mut grid = StarGrid::new(edge, 0.0, 10);
            let known = shuffled(&mut grid, &mut next);
            for turn in 0..100 {
                if turn == 20 {
                    grid.fill_cells();
                }
                let p = Vec3::new(next(), next(), next()) * 24.0 - 12.0;
                let mut found = Vec::new();
                grid.near_point(p, 1.5, |v| found.push(v.index()));
                assert_complete(found, &expected(&known, |q, _| q.distance(p) < 1.5));

                let bounds = Bounds { min: p, max: p + Vec3::new(next(), next(), next()) };
                let mut found = Vec::new();
                grid.near_box(&bounds, 0.5, |v| found.push(v.index()));
                let in_box = |q, longest| bounds.distance_squared(q).sqrt() < 0.5 * f64::from(longest);
                assert_complete(found, &expected(&known, in_box));

                let near = Nearness { least: 0.7, margin: 0.1, share: 0.8 };
                let mut found = Vec::new();
                grid.near_stars(&bounds, 1.1, near, &mut found);
                let in_reach =
                    |q, longest| bounds.distance_squared(q).sqrt() < f64::from(near.between(1.1, longest));
                let found = found.into_iter().map(|star| star.vertex.index()).collect();
                assert_complete(found, &expected(&known, in_reach));
            }
        }
    }

    #[test]
    fn searches_allow_for_positions_that_are_a_blur_old() {
        let mut next = numbers(4);
        let mut grid = StarGrid::new(1.0, 0.25, 10);
        let mut known = shuffled(&mut grid, &mut next);
        grid.fill_cells();
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
