//! Sweep and prune: all pairs of vertex balls near each other, for the broad phase over a whole mesh.
//!
//! Balls are grouped into classes by size. Each class is tested against itself, then against the smaller balls around
//! it, so that the many tiny balls beside a huge one are not all compared with each other. For each class, the xy-plane
//! is divided into columns as wide as the search distance of the class. Balls are sorted by column and height (z), and
//! each is compared with those of adjacent columns at its height. All data is in flat arrays, and each pair is visited
//! once.

use super::vertex_grid::{Proximity, VertexBall};
use crate::math::make_room;
use crate::math::order::{combined_rank, median, rank_f32, sort_by_rank, sort_ranks};
use crate::pauses::Pauses;
use std::cell::Cell;

/// The radius bound of the first size class of balls, as a multiple of the median radius. If smaller, the few long
/// edges of an ordinary mesh need a class of their own; if larger, they make all columns of the first class wide.
const FIRST_CLASS_BOUND: f32 = 1.6;

/// The number of balls, spread over all, of which the median radius is computed: fewer may not represent them.
const MEDIAN_SAMPLE: usize = 1 << 16;

/// The ratio of the radius bounds of consecutive size classes. If smaller, there are more classes; if larger, more
/// pairs are tested and rejected.
const FACTOR: f32 = 4.0;

/// The width of columns, the square cells of the xy-plane, as a multiple of the search distance of their size class;
/// above 1, so that balls in non-adjacent columns are out of reach in spite of rounding.
const COLUMN_MARGIN: f64 = 1.001;

/// The bound to which column indices are clamped in absolute value, so that adjacent indices do not overflow. At this
/// distance from the origin, columns are narrower than the spacing of single-precision numbers.
const MAX_COLUMN: f64 = 1_073_741_824.0;

/// The largest number of columns per ball, empty ones included, in the bounding rectangle of the balls, for which balls
/// are sorted by a counting sort; with more, its array of counts would be too large.
const MAX_COLUMNS_PER_BALL: usize = 8;

/// The number of bits of the [`Filter`] per column that it contains; with fewer, more balls of smaller classes pass it
/// needlessly.
const FILTER_BITS: usize = 8;

/// The number of pairs of balls whose tests are a unit of work.
const TESTS_PER_UNIT: usize = 256;

/// The number of tests after which a sweep counts its work: columns have few.
const TESTS: usize = 16 * TESTS_PER_UNIT;

/// The largest number of balls of a column that are compared between two counts; columns of most meshes have fewer.
const CHUNK: usize = 32;

/// Calls `found` once with every pair of `balls` whose centres are no farther apart than [`Proximity::distance_for`]
/// returns for their radii, and pauses meanwhile. The order is unspecified but deterministic. Ends soon after `found` has
/// returned false.
pub async fn near_pairs(
    balls: Vec<VertexBall>,
    near: Proximity,
    mut found: impl FnMut(&VertexBall, &VertexBall) -> bool,
    pauses: &Pauses,
) {
    let mut bound = FIRST_CLASS_BOUND * median_radius(&balls);
    let (mut smaller, mut left) = (Vec::new(), balls);
    while !left.is_empty() {
        // Nearly all balls of most meshes are in the first class, so that the others are copied.
        let is_larger = |ball: &&VertexBall| ball.radius > bound;
        let mut larger = Vec::with_capacity(left.iter().filter(is_larger).count());
        larger.extend(left.iter().filter(is_larger).copied());
        let mut class = std::mem::replace(&mut left, larger);
        class.retain(|ball| ball.radius <= bound);
        class.shrink_to_fit();
        // Longest edges are infinite if their squares overflow.
        bound = if bound < f32::MAX / FACTOR { bound * FACTOR } else { f32::INFINITY };
        if !class.is_empty() {
            let Some(class) = sweep_class(class, &smaller, near, &mut found, pauses).await else { return };
            if smaller.is_empty() {
                smaller = class;
            } else if !left.is_empty() {
                let count = smaller.len() + class.len();
                make_room(&mut smaller, count);
                smaller.extend(class);
            }
        }
    }
}

/// Returns the approximate median radius of the balls, the unit of the bounds of the size classes; at least the smallest
/// positive normal number, and 1 if there are no balls.
fn median_radius(balls: &[VertexBall]) -> f32 {
    let step = balls.len() / MEDIAN_SAMPLE + 1;
    let middle = median(balls.iter().step_by(step).map(|ball| ball.radius)).unwrap_or(1.0);
    if middle > f32::MIN_POSITIVE { middle } else { f32::MIN_POSITIVE }
}

/// Calls `found` with the pairs of balls that are no farther apart than `near` allows: those within the size class
/// `class`, and those of one ball of `class` and one of `smaller`, the balls of smaller classes. Returns the balls of
/// `class`, in another order.
async fn sweep_class(
    class: Vec<VertexBall>,
    smaller: &[VertexBall],
    near: Proximity,
    found: &mut impl FnMut(&VertexBall, &VertexBall) -> bool,
    pauses: &Pauses,
) -> Option<Vec<VertexBall>> {
    let largest = class.iter().fold(0.0, |most, ball| if ball.radius > most { ball.radius } else { most });
    let reach = near.distance_for(largest, largest);
    let width = Width(1.0 / (COLUMN_MARGIN * f64::from(reach)));
    let tests = Tests { count: Cell::new(0), is_over: Cell::new(false), pauses };
    let mut test = |a: &VertexBall, b: &VertexBall| {
        tests.count.set(tests.count.get() + 1);
        let reach = near.distance_for(a.radius, b.radius);
        if a.position.distance_squared(b.position) <= reach * reach && !found(a, b) {
            tests.is_over.set(true);
        }
    };
    let large = Columns::new(width, class);
    pauses.now().await;
    let mut row = 0;
    for k in 0..large.count() {
        large.pairs_at(k, &mut row, reach, &mut test, &tests).await;
        if tests.is_over.get() {
            return None;
        }
    }
    if !smaller.is_empty() {
        let filter = Filter::around(&large);
        let around = smaller.iter().filter(|ball| filter.may_contain(width.column(ball))).copied();
        let around = Columns::new(width, around.collect());
        let mut rows = [0; 3];
        for k in 0..large.count() {
            large.pairs_at_with(k, &around, &mut rows, reach, &mut test, &tests).await;
            if tests.is_over.get() {
                return None;
            }
        }
    }
    Some(large.balls)
}

/// The tests of a sweep that are not yet counted as work.
struct Tests<'a> {
    count: Cell<usize>,
    /// Whether no more pairs are asked for.
    is_over: Cell<bool>,
    pauses: &'a Pauses,
}

impl Tests<'_> {
    /// Counts the tests as work once there are many.
    async fn counted(&self) {
        if self.count.get() >= TESTS {
            self.pauses.after(self.count.replace(0) / TESTS_PER_UNIT).await;
        }
    }
}

/// The width of the columns into which the xy-plane is divided, stored as its inverse.
#[derive(Clone, Copy)]
struct Width(f64);

impl Width {
    #[inline]
    fn column(self, ball: &VertexBall) -> [i32; 2] {
        [ball.position.x, ball.position.y].map(|x| {
            let scaled = f64::from(x) * self.0;
            let clamped = if scaled > MAX_COLUMN { MAX_COLUMN } else { scaled };
            floor(if clamped < -MAX_COLUMN { -MAX_COLUMN } else { clamped })
        })
    }
}

/// Returns the largest integer not above `x`; faster than `f64::floor` when compiled for an older instruction set.
#[inline]
fn floor(x: f64) -> i32 {
    let whole = x as i32;
    whole - i32::from(f64::from(whole) > x)
}

/// Returns the indices that sort balls by column; `columns` contains the column of each ball. A counting sort, several
/// times as fast, is used if the columns are as densely occupied as those of a mesh.
fn column_order(columns: &[[i32; 2]]) -> Vec<u32> {
    let extent = |axis: usize| {
        let of_axis = || columns.iter().map(|column| i64::from(column[axis]));
        let (low, high) = (of_axis().min().unwrap_or(0), of_axis().max().unwrap_or(0));
        (low, high - low + 1)
    };
    let ([x, wide], [y, deep]) = (extent(0).into(), extent(1).into());
    if wide * deep > 64 + (MAX_COLUMNS_PER_BALL * columns.len()) as i64 {
        let mut order: Vec<u32> = (0..columns.len() as u32).collect();
        let from_least = |x: i32| x as u32 ^ 1 << 31;
        sort_by_rank(&mut order, |&i| {
            combined_rank(from_least(columns[i as usize][0]), from_least(columns[i as usize][1]))
        });
        return order;
    }
    let number = |column: &[i32; 2]| ((i64::from(column[0]) - x) * deep + i64::from(column[1]) - y) as usize;
    let mut ends = vec![0u32; (wide * deep) as usize];
    columns.iter().for_each(|column| ends[number(column)] += 1);
    let mut end = 0;
    for count in &mut ends {
        end += *count;
        *count = end;
    }
    let mut order = vec![0; columns.len()];
    for (i, column) in columns.iter().enumerate().rev() {
        let slot = &mut ends[number(column)];
        *slot -= 1;
        order[*slot as usize] = i as u32;
    }
    order
}

/// Moves the ball `order[i]` to position `i`, cycle by cycle, so that no second list of balls takes memory.
fn put_in_order(balls: &mut [VertexBall], mut order: Vec<u32>) {
    for start in 0..balls.len() {
        let (first, mut to) = (balls[start], start);
        loop {
            let from = std::mem::replace(&mut order[to], to as u32) as usize;
            if from == start {
                break;
            }
            balls[to] = balls[from];
            to = from;
        }
        balls[to] = first;
    }
}

/// Balls sorted by column, a square cell of the xy-plane, then by height (z), so that balls near each other are found
/// without testing all pairs.
struct Columns {
    balls: Vec<VertexBall>,
    /// The occupied columns in order, each with the index of its first ball in `balls`, and a sentinel at the end.
    columns: Vec<([i32; 2], usize)>,
}

impl Columns {
    fn new(width: Width, mut balls: Vec<VertexBall>) -> Self {
        let column_of: Vec<[i32; 2]> = balls.iter().map(|ball| width.column(ball)).collect();
        let mut order = column_order(&column_of);
        let mut by_height = Vec::new();
        for column in order.chunk_by_mut(|&a, &b| column_of[a as usize] == column_of[b as usize]) {
            by_height.clear();
            by_height
                .extend(column.iter().map(|&i| combined_rank(rank_f32(balls[i as usize].position.z), i)));
            sort_ranks(&mut by_height);
            column.iter_mut().zip(&by_height).for_each(|(i, &ranked)| *i = ranked as u32);
        }
        let mut columns: Vec<([i32; 2], usize)> = Vec::new();
        let mut before = None;
        for (k, &i) in order.iter().enumerate() {
            let column = column_of[i as usize];
            if before.replace(column) != Some(column) {
                columns.push((column, k));
            }
        }
        columns.push(([i32::MAX; 2], order.len()));
        drop(column_of);
        put_in_order(&mut balls, order);
        Self { balls, columns }
    }

    fn count(&self) -> usize {
        self.columns.len() - 1
    }

    #[inline]
    fn column(&self, k: usize) -> [i32; 2] {
        self.columns[k].0
    }

    #[inline]
    fn balls(&self, k: usize) -> &[VertexBall] {
        &self.balls[self.columns[k].1..self.columns[k + 1].1]
    }

    /// Calls `test` with the pairs of a ball in column `k` and one in it or in an adjacent column after it, whose heights
    /// differ by at most `reach`. To be called for all columns in order, with the same `row`, which is 0 at first.
    async fn pairs_at(
        &self,
        k: usize,
        row: &mut usize,
        reach: f32,
        test: &mut impl FnMut(&VertexBall, &VertexBall),
        tests: &Tests<'_>,
    ) {
        let [x, y] = self.column(k);
        let own = self.balls(k);
        let chunk = chunk_for(own);
        for start in (0..own.len()).step_by(chunk) {
            let end = own.len().min(start + chunk);
            for (i, a) in (start + 1..).zip(&own[start..end]) {
                let top = a.position.z + reach;
                own[i..].iter().take_while(|b| b.position.z <= top).for_each(|b| test(a, b));
            }
            tests.counted().await;
            if tests.is_over.get() {
                return;
            }
        }
        if self.column(k + 1) == [x, y + 1] {
            visit_column_pairs(own, self.balls(k + 1), reach, test, tests).await;
        }
        self.visit_row_pairs(own, [x + 1, y], row, reach, test, tests).await;
    }

    /// Calls `test` with the pairs of a ball in column `k` and one of `other` in the same or an adjacent column, whose
    /// heights differ by at most `reach`. To be called for all columns in order, with the same `rows`, which are 0 at first.
    async fn pairs_at_with(
        &self,
        k: usize,
        other: &Self,
        rows: &mut [usize; 3],
        reach: f32,
        test: &mut impl FnMut(&VertexBall, &VertexBall),
        tests: &Tests<'_>,
    ) {
        let [x, y] = self.column(k);
        for (row, x) in rows.iter_mut().zip(x - 1..=x + 1) {
            other.visit_row_pairs(self.balls(k), [x, y], row, reach, test, tests).await;
        }
    }

    /// Calls `test` with the pairs of `balls` and the balls of the columns `[x, y − 1]` to `[x, y + 1]` whose heights
    /// differ by at most `reach`. `row` is an index at or before the first of these columns and is advanced to it, so
    /// successive calls must be in the order of columns.
    async fn visit_row_pairs(
        &self,
        balls: &[VertexBall],
        [x, y]: [i32; 2],
        row: &mut usize,
        reach: f32,
        test: &mut impl FnMut(&VertexBall, &VertexBall),
        tests: &Tests<'_>,
    ) {
        while self.column(*row) < [x, y - 1] {
            *row += 1;
        }
        let mut k = *row;
        while self.column(k) <= [x, y + 1] {
            visit_column_pairs(balls, self.balls(k), reach, test, tests).await;
            k += 1;
        }
    }
}

/// Returns how many balls are compared with those of a column between two counts: fewer if it has many.
fn chunk_for(column: &[VertexBall]) -> usize {
    (CHUNK * TESTS / column.len().max(1)).clamp(1, CHUNK)
}

/// Calls `test` with the pairs of balls of two columns whose heights differ by at most `reach`; both columns are sorted
/// by height.
async fn visit_column_pairs(
    balls: &[VertexBall],
    others: &[VertexBall],
    reach: f32,
    test: &mut impl FnMut(&VertexBall, &VertexBall),
    tests: &Tests<'_>,
) {
    let mut low = 0;
    for chunk in balls.chunks(chunk_for(others)) {
        visit_chunk_pairs(chunk, others, &mut low, reach, test);
        tests.counted().await;
        if tests.is_over.get() {
            return;
        }
    }
}

/// Calls `test` with the pairs of balls of a chunk of a column and of another one; `low` is the index of the first of
/// the others that may be high enough, 0 for the first chunk.
#[inline]
fn visit_chunk_pairs(
    balls: &[VertexBall],
    others: &[VertexBall],
    low: &mut usize,
    reach: f32,
    test: &mut impl FnMut(&VertexBall, &VertexBall),
) {
    for a in balls {
        let (bottom, top) = (a.position.z - reach, a.position.z + reach);
        while *low < others.len() && others[*low].position.z < bottom {
            *low += 1;
        }
        others[*low..].iter().take_while(|b| b.position.z <= top).for_each(|b| test(a, b));
    }
}

/// A Bloom filter of the columns in or adjacent to those of a size class; it rejects most smaller balls that are not
/// near that class.
struct Filter {
    bits: Vec<u64>,
    mask: u32,
}

impl Filter {
    fn around(columns: &Columns) -> Self {
        let count = (9 * FILTER_BITS * columns.count()).next_power_of_two().max(64);
        let mut filter = Self { bits: vec![0; count / 64], mask: count as u32 - 1 };
        for k in 0..columns.count() {
            let [x, y] = columns.column(k);
            for x in x - 1..=x + 1 {
                for y in y - 1..=y + 1 {
                    let bit = filter.bit([x, y]);
                    filter.bits[bit / 64] |= 1 << (bit % 64);
                }
            }
        }
        filter
    }

    fn may_contain(&self, column: [i32; 2]) -> bool {
        let bit = self.bit(column);
        self.bits[bit / 64] >> (bit % 64) & 1 == 1
    }

    #[inline]
    fn bit(&self, [x, y]: [i32; 2]) -> usize {
        let hash = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
        ((hash ^ hash >> 15) & self.mask) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3};
    use crate::mesh::VertexId;
    use crate::pauses::{advance, finished};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Where all balls are in one column, as those of a mesh that intersects itself everywhere.
    #[test]
    fn a_column_of_many_balls_has_pauses() {
        let ball = |k| VertexBall { vertex: VertexId(k), position: Vec3::Z * 1e-5 * k as f32, radius: 1.0 };
        let (balls, pairs, mut most) = ((0..6000).map(ball).collect(), Cell::new(0), 0);
        let near = Proximity { least: 0.0, margin: 0.0, share: 1.0 };
        let pauses = Pauses::default();
        let count = |_: &VertexBall, _: &VertexBall| {
            pairs.set(pairs.get() + 1);
            true
        };
        let mut sweep = Box::pin(near_pairs(balls, near, count, &pauses));
        let mut before = 0;
        while advance(&mut sweep).is_pending() {
            most = most.max(pairs.get() - before);
            before = pairs.get();
        }
        assert_eq!(pairs.get(), 6000 * 5999 / 2);
        assert!(most < 400_000, "{most}");
    }

    #[test]
    fn a_sweep_ends_when_no_more_pairs_are_asked_for() {
        let ball = |k| VertexBall { vertex: VertexId(k), position: Vec3::Z * 1e-5 * k as f32, radius: 1.0 };
        for radii in [[1.0, 1.0], [1.0, 20.0]] {
            let balls = (0..6000).map(|k| VertexBall { radius: radii[k as usize % 2], ..ball(k) }).collect();
            let mut pairs = 0;
            let near = Proximity { least: 0.0, margin: 0.0, share: 1.0 };
            let found = |_: &VertexBall, _: &VertexBall| {
                pairs += 1;
                pairs < 5_000_000
            };
            finished(near_pairs(balls, near, found, &Pauses::default()));
            assert!((5_000_000..6_000_000).contains(&pairs), "{pairs}");
        }
    }

    /// Returns random balls in a box or on a plane, some outliers, some coincident, of ordinary, tiny and huge size.
    fn balls(random: &mut Random) -> Vec<VertexBall> {
        let middle = Vec3::splat([0.0, 5.0, 3e3, -2e6][random.below(4) as usize]);
        let flat = [Vec3::ONE, Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)][random.below(3) as usize];
        let sizes: &[f32] =
            [&[1.0][..], &[1.0, 1.5], &[1e-3, 1.0, 8.0], &[0.0, 1e-30, 1.0, 1e9], &[f32::INFINITY, 1.0]]
                [random.below(5) as usize];
        let spread = [0.0, 3.0, 10.0][random.below(3) as usize];
        let count = random.below(120);
        let mut ball = |i| {
            let mut unit = || random.unit() as f32;
            let mut position = middle + Vec3::new(unit(), unit(), unit()) * flat * spread;
            let longest = sizes[(unit() * sizes.len() as f32) as usize] * (1.0 - 0.4 * unit());
            if unit() < 0.02 {
                position *= 1e12;
            }
            VertexBall { position, radius: longest, vertex: VertexId(i) }
        };
        (0..count).map(&mut ball).collect()
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        let mut pairs = 0;
        for seed in 0..2000 {
            let random = &mut Random::new(seed);
            let balls = balls(random);
            let near = Proximity {
                least: [0.0, 0.7][random.below(2) as usize],
                margin: [0.0, 0.1][random.below(2) as usize],
                share: 0.8,
            };
            let mut found = Vec::new();
            let pair = |a: &VertexBall, b: &VertexBall| {
                found.push([a.vertex.min(b.vertex).0, a.vertex.max(b.vertex).0]);
                true
            };
            finished(near_pairs(balls.clone(), near, pair, &Pauses::default()));
            found.sort_unstable();
            let is_near = |a: &VertexBall, b: &VertexBall| {
                let reach = near.distance_for(a.radius, b.radius);
                a.position.distance_squared(b.position) <= reach * reach
            };
            let mut expected = Vec::new();
            for (i, a) in balls.iter().enumerate() {
                expected.extend(
                    balls[i + 1..].iter().filter(|b| is_near(a, b)).map(|b| [a.vertex.0, b.vertex.0]),
                );
            }
            expected.sort_unstable();
            assert_eq!(found, expected, "seed {seed}");
            pairs += found.len();
        }
        assert!(pairs > 100_000, "only {pairs} pairs");
    }
}
