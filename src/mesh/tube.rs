//! The triangulation of a tube between two closed polygons.

use crate::math::Vec3;

/// A closed walk over pairs (corner `i` of the first polygon, corner `j` of the second): each pair is an edge of the
/// tube, each step a triangle. `i` grows and `j` falls, because the two rims are oriented alike as holes of one
/// oriented surface.
pub(super) struct Tube {
    pairs: Vec<(usize, usize)>,
}

impl Tube {
    /// The second polygon's corners joined to corner `i` of the first, in the order of the walk.
    pub(super) fn met_by_first(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.run(move |&(a, _)| a == i).map(|(_, j)| j)
    }

    /// The first polygon's corners joined to corner `j` of the second, in the order of the walk.
    pub(super) fn met_by_second(&self, j: usize) -> impl Iterator<Item = usize> + '_ {
        self.run(move |&(_, b)| b == j).map(|(i, _)| i)
    }

    /// The one cyclic run of pairs that satisfy `holds`, from its beginning.
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

/// How many changes of polygon a walk must make. With fewer, one polygon is walked all round while the other stands
/// at one corner, and the edge at the beginning of that round is there twice.
const TURNS: usize = 4;

/// Squares of coordinates beyond this, and sums of them, may not fit `f32`; there places are made smaller, by a power of
/// two, which rounds nothing.
const FAR: f32 = (1u64 << 55) as f32;
/// See [`FAR`].
const SHRINK: f32 = 1.0 / (1u128 << 80) as f32;

/// The walk with the least sum of squared edge lengths, over every offset between the polygons.
///
/// Dynamic programming over (i, j, polygon of the last step, turns so far); each polygon has at least three corners.
pub(super) fn shortest_tube(first: &[Vec3], second: &[Vec3]) -> Tube {
    if first.iter().chain(second).any(|p| p.abs().max_element() > FAR) {
        let nearer = |rim: &[Vec3]| rim.iter().map(|&p| p * SHRINK).collect::<Vec<_>>();
        return shortest_tube(&nearer(first), &nearer(second));
    }
    let cost = |i: usize, j: usize| {
        first[i % first.len()].distance_squared(second[(second.len() - j % second.len()) % second.len()])
    };
    let mut best: Option<(f32, Vec<(usize, usize)>)> = None;
    for offset in 0..second.len() {
        for step in [Step::First, Step::Second] {
            let walk = Walks::fill(first.len(), second.len(), step, |i, j| cost(i, j + offset));
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

#[derive(Clone, Copy, PartialEq, Eq)]
enum Step {
    First = 0,
    Second = 1,
}

/// The cheapest ways to each state of a walk with one offset and one first step.
struct Walks {
    rows: usize,
    columns: usize,
    first_step: Step,
    /// Cost and predecessor's (step, turns), by state.
    states: Vec<(f32, u8, u8)>,
}

impl Walks {
    fn index(&self, i: usize, j: usize, step: usize, turns: usize) -> usize {
        ((i * (self.columns + 1) + j) * 2 + step) * (TURNS + 1) + turns
    }

    fn fill(rows: usize, columns: usize, first_step: Step, cost: impl Fn(usize, usize) -> f32) -> Self {
        let states = vec![(f32::INFINITY, 0, 0); (rows + 1) * (columns + 1) * 2 * (TURNS + 1)];
        let mut walks = Self { rows, columns, first_step, states };
        let begin = walks.index(0, 0, first_step as usize, 0);
        walks.states[begin].0 = cost(0, 0);
        for i in 0..=rows {
            for j in 0..=columns {
                walks.extend(i, j, &cost);
            }
        }
        walks
    }

    /// Offers every way that ends at (i, j) to the two pairs after it.
    fn extend(&mut self, i: usize, j: usize, cost: &impl Fn(usize, usize) -> f32) {
        for last in 0..2 {
            for turns in 0..=TURNS {
                let so_far = self.states[self.index(i, j, last, turns)].0;
                if so_far == f32::INFINITY {
                    continue;
                }
                for step in 0..2 {
                    let (to_i, to_j) = if step == 0 { (i + 1, j) } else { (i, j + 1) };
                    // The walk begins with its first step; else a start counted as a turn would be none.
                    let wrong_start = i == 0 && j == 0 && step != self.first_step as usize;
                    if to_i > self.rows || to_j > self.columns || wrong_start {
                        continue;
                    }
                    let now = if step == last || turns == TURNS { turns } else { turns + 1 };
                    let closes = to_i == self.rows && to_j == self.columns;
                    // The last pair is the first one again and is not paid for twice.
                    let total = so_far + if closes { 0.0 } else { cost(to_i, to_j) };
                    let state = self.index(to_i, to_j, step, now);
                    if total < self.states[state].0 {
                        self.states[state] = (total, last as u8, turns as u8);
                    }
                }
            }
        }
    }

    /// The step and turns of the cheapest closed walk that turns often enough.
    fn best_end(&self) -> Option<(usize, usize)> {
        let other = 1 - self.first_step as usize;
        let ends = [(self.first_step as usize, TURNS), (other, TURNS - 1), (other, TURNS)];
        let total =
            |&(step, turns): &(usize, usize)| self.states[self.index(self.rows, self.columns, step, turns)].0;
        ends.into_iter().filter(|end| total(end) < f32::INFINITY).min_by(|a, b| total(a).total_cmp(&total(b)))
    }

    fn best_total(&self) -> Option<f32> {
        self.best_end().map(|(step, turns)| self.states[self.index(self.rows, self.columns, step, turns)].0)
    }

    /// The pairs of the cheapest walk from its beginning; the closing pair, equal to the first, is left out.
    fn trace(&self) -> Vec<(usize, usize)> {
        let Some((mut step, mut turns)) = self.best_end() else { return Vec::new() };
        let (mut i, mut j) = (self.rows, self.columns);
        let mut pairs = Vec::with_capacity(i + j);
        while i + j > 0 {
            let (_, last, before) = self.states[self.index(i, j, step, turns)];
            if step == 0 {
                i -= 1
            } else {
                j -= 1
            }
            pairs.push((i, j));
            (step, turns) = (last as usize, before as usize);
        }
        pairs.reverse();
        pairs
    }
}
