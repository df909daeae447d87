//! Triangulation of the tube between two closed polygons, the rims joined by an axial change
//! ([`Mesh::join`](super::Mesh::join)).

use crate::math::Vec3;

/// A triangulated tube between two closed polygons, as a cyclic sequence of the edges between them.
///
/// Each edge is a pair (corner `i` of the first polygon, corner `j` of the second); consecutive edges span a triangle.
/// `i` increases and `j` decreases, because both polygons are oriented as holes of one oriented surface.
pub(super) struct Tube {
    pairs: Vec<(usize, usize)>,
}

impl Tube {
    /// Returns the corners of the second polygon that tube edges connect to corner `i` of the first, in the order of
    /// the edges along the tube.
    pub(super) fn connected_to_first(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.run(move |&(a, _)| a == i).map(|(_, j)| j)
    }

    /// Returns the corners of the first polygon that tube edges connect to corner `j` of the second, in the order of
    /// the edges along the tube.
    pub(super) fn connected_to_second(&self, j: usize) -> impl Iterator<Item = usize> + '_ {
        self.run(move |&(_, b)| b == j).map(|(i, _)| i)
    }

    /// Iterates, in order, over the tube edges that satisfy `holds`, which must be consecutive in the cyclic sequence.
    fn run<'a>(
        &'a self,
        holds: impl Fn(&(usize, usize)) -> bool + Copy + 'a,
    ) -> impl Iterator<Item = (usize, usize)> + 'a {
        let n = self.pairs.len();
        let starts = |&k: &usize| holds(&self.pairs[k]) && !holds(&self.pairs[(k + n - 1) % n]);
        let start = (0..n).find(starts).unwrap_or(0);
        (0..n).map(move |k| self.pairs[(start + k) % n]).take_while(holds)
    }
}

/// The minimum number of times that a walk around the tube, from edge to edge, changes the polygon along which it
/// advances. With fewer, a whole polygon is connected to a single corner of the other, and the first and last edge of
/// that fan coincide.
const MIN_SWITCHES: usize = 4;

/// The largest coordinate, in absolute value, for which squared distances, and sums of them, are sure to fit into
/// `f32`. Polygons beyond it are scaled by [`OVERFLOW_SCALE`] first.
const MAX_COORDINATE: f32 = (1u64 << 55) as f32;
/// The factor by which polygons with coordinates beyond [`MAX_COORDINATE`] are scaled; a power of two, so that scaling
/// is exact.
const OVERFLOW_SCALE: f32 = 1.0 / (1u128 << 80) as f32;

/// Returns the tube between two closed polygons with the least sum of squared edge lengths, over all choices of the
/// first edge.
///
/// Dynamic programming over (i, j, polygon of the last step, number of switches); each polygon has at least three
/// corners.
pub(super) fn shortest_tube(first: &[Vec3], second: &[Vec3]) -> Tube {
    if first.iter().chain(second).any(|p| p.abs().max_element() > MAX_COORDINATE) {
        let nearer = |rim: &[Vec3]| rim.iter().map(|&p| p * OVERFLOW_SCALE).collect::<Vec<_>>();
        return shortest_tube(&nearer(first), &nearer(second));
    }
    let cost = |i: usize, j: usize| {
        first[i % first.len()].distance_squared(second[(second.len() - j % second.len()) % second.len()])
    };
    let mut best: Option<(f32, Vec<(usize, usize)>)> = None;
    for offset in 0..second.len() {
        for step in [Step::First, Step::Second] {
            let walk = WalkTable::fill(first.len(), second.len(), step, |i, j| cost(i, j + offset));
            if let Some(total) = walk.best_total()
                && best.as_ref().is_none_or(|(least, _)| total < *least)
            {
                let pairs = walk.trace().into_iter().map(|(i, j)| {
                    let fallen = (j + offset) % second.len();
                    (i % first.len(), (second.len() - fallen) % second.len())
                });
                best = Some((total, pairs.collect()));
            }
        }
    }
    Tube { pairs: best.map(|(_, pairs)| pairs).unwrap_or_default() }
}

/// One of the two polygons that a tube joins: the one on which a walk around the tube advances by a corner, from one
/// tube edge to the next. Used by the dynamic programming in [`shortest_tube`].
#[derive(Clone, Copy, PartialEq, Eq)]
enum Step {
    First = 0,
    Second = 1,
}

/// The table of the dynamic programming in [`shortest_tube`], for one first tube edge and one first step: the cheapest
/// walk to each state (i, j, last step, number of switches), where i and j count the steps along the two polygons.
struct WalkTable {
    rows: usize,
    columns: usize,
    first_step: Step,
    /// By state, the cost of the cheapest walk to it, and the last step and the number of switches of the state before
    /// it.
    states: Vec<(f32, u8, u8)>,
}

impl WalkTable {
    fn index(&self, i: usize, j: usize, step: usize, switches: usize) -> usize {
        ((i * (self.columns + 1) + j) * 2 + step) * (MIN_SWITCHES + 1) + switches
    }

    fn fill(rows: usize, columns: usize, first_step: Step, cost: impl Fn(usize, usize) -> f32) -> Self {
        let states = vec![(f32::INFINITY, 0, 0); (rows + 1) * (columns + 1) * 2 * (MIN_SWITCHES + 1)];
        let mut walks = Self { rows, columns, first_step, states };
        let begin = walks.index(0, 0, first_step as usize, 0);
        walks.states[begin].0 = cost(0, 0);
        for i in 0..=rows {
            for j in 0..=columns {
                walks.relax(i, j, &cost);
            }
        }
        walks
    }

    /// Updates the costs of the states that follow the states at (i, j), by one step along either polygon; `cost` is
    /// the squared length of a tube edge.
    fn relax(&mut self, i: usize, j: usize, cost: &impl Fn(usize, usize) -> f32) {
        for last in 0..2 {
            for switches in 0..=MIN_SWITCHES {
                let so_far = self.states[self.index(i, j, last, switches)].0;
                if so_far == f32::INFINITY {
                    continue;
                }
                for step in 0..2 {
                    let (to_i, to_j) = if step == 0 { (i + 1, j) } else { (i, j + 1) };
                    // The first step is fixed; otherwise a first step on the other polygon would be counted as a
                    // switch.
                    let wrong_start = i == 0 && j == 0 && step != self.first_step as usize;
                    if to_i > self.rows || to_j > self.columns || wrong_start {
                        continue;
                    }
                    let now = if step == last || switches == MIN_SWITCHES { switches } else { switches + 1 };
                    let closes = to_i == self.rows && to_j == self.columns;
                    // The last pair is the first pair again; it is not counted twice.
                    let total = so_far + if closes { 0.0 } else { cost(to_i, to_j) };
                    let state = self.index(to_i, to_j, step, now);
                    if total < self.states[state].0 {
                        self.states[state] = (total, last as u8, switches as u8);
                    }
                }
            }
        }
    }

    /// Returns the last step and the number of switches of the cheapest closed walk with at least [`MIN_SWITCHES`]
    /// switches between polygons; a switch between the last and the first step counts, but is not in the returned
    /// number. `None` if there is no such walk.
    fn best_end(&self) -> Option<(usize, usize)> {
        let other = 1 - self.first_step as usize;
        let ends =
            [(self.first_step as usize, MIN_SWITCHES), (other, MIN_SWITCHES - 1), (other, MIN_SWITCHES)];
        let total = |&(step, switches): &(usize, usize)| {
            self.states[self.index(self.rows, self.columns, step, switches)].0
        };
        ends.into_iter().filter(|end| total(end) < f32::INFINITY).min_by(|a, b| total(a).total_cmp(&total(b)))
    }

    fn best_total(&self) -> Option<f32> {
        self.best_end()
            .map(|(step, switches)| self.states[self.index(self.rows, self.columns, step, switches)].0)
    }

    /// Returns the tube edges (i, j) of the cheapest closed walk in order, without the last one, which equals the
    /// first.
    fn trace(&self) -> Vec<(usize, usize)> {
        let Some((mut step, mut switches)) = self.best_end() else { return Vec::new() };
        let (mut i, mut j) = (self.rows, self.columns);
        let mut pairs = Vec::with_capacity(i + j);
        while i + j > 0 {
            let (_, last, before) = self.states[self.index(i, j, step, switches)];
            if step == 0 {
                i -= 1
            } else {
                j -= 1
            }
            pairs.push((i, j));
            (step, switches) = (last as usize, before as usize);
        }
        pairs.reverse();
        pairs
    }
}
