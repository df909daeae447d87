//! A sparse approximate inverse of Φ + Λ: each centre is predicted from the nearest ones before it, in an order from
//! coarse to fine (Vecchia's approximation; Schäfer, Katzfuss & Owhadi, *Sparse Cholesky factorization by Kullback–Leibler
//! minimization*, 2021).

use crate::math::order::rank_f64;
use crate::math::{DVec3, Vec3};
use crate::methods::implicit::kernel::KernelTable;
use crate::spatial::PointGrid;

/// Earlier centres that each is predicted from. 16 take half as many iterations again; 32 take twice as long to make.
const NEIGHBOURS: usize = 24;

/// (Φ + Λ)⁻¹ ≈ Σ gᵢ gᵢᵀ with a sparse gᵢ for each centre.
#[derive(Clone, Debug)]
pub struct SparseInverse {
    /// In which order centres are predicted, and from which earlier ones.
    rows: Rows,
    /// What is still to be planned.
    plan: Plan,
    /// Rows that are made.
    made: usize,
    /// Of each row made, one after the other, the weights of gᵢ: of the centre itself, then of its neighbours.
    weights: Vec<f64>,
}

/// Centres in order, each with some of those before it.
#[derive(Clone, Debug, Default)]
struct Rows {
    centres: Vec<u32>,
    /// Their neighbours, one row after the other, and where each row ends.
    neighbours: Vec<u32>,
    ends: Vec<usize>,
}

impl Rows {
    fn push(&mut self, centre: u32, neighbours: impl IntoIterator<Item = u32>) {
        self.centres.push(centre);
        self.neighbours.extend(neighbours);
        self.ends.push(self.neighbours.len());
    }

    fn iter(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let starts = std::iter::once(&0).chain(&self.ends);
        let ranges = starts.zip(&self.ends).map(|(&from, &to)| &self.neighbours[from..to]);
        self.centres.iter().copied().zip(ranges)
    }
}

impl SparseInverse {
    /// The inverse for `centres`, all of which are named once in `first` and `last`, which come in that order; nothing is
    /// made yet.
    pub fn new(centres: &[Vec3], first: Vec<u32>, last: Vec<u32>) -> Self {
        let plan = Plan::new(centres, first, last);
        Self { rows: Rows::default(), plan, made: 0, weights: Vec::new() }
    }

    /// Plans or makes up to `count` more rows. Returns whether all are made.
    ///
    /// Where a local system is singular to rounding, its diagonal is raised: that costs iterations, never accuracy.
    pub fn build(&mut self, centres: &[DVec3], lambda: &[f64], table: &KernelTable, count: usize) -> bool {
        if self.plan.extend(count, &mut self.rows) {
            for (centre, near) in self.rows.iter().skip(self.made).take(count) {
                row(centre, near, centres, lambda, table, &mut self.weights);
                self.made += 1;
            }
        }
        self.made == centres.len()
    }

    /// The share of rows planned and made.
    pub fn progress(&self) -> f64 {
        0.5 * (self.rows.centres.len() + self.made) as f64 / self.plan.centres.len() as f64
    }

    /// The inverse, once made, without the centres that are `gone` and with those that follow its own in `centres`, each
    /// predicted from the nearest ones of all others.
    pub fn revised(&self, gone: &[bool], centres: &[DVec3], lambda: &[f64], table: &KernelTable) -> Self {
        let mut revised = Self { rows: Rows::default(), plan: Plan::default(), made: 0, weights: Vec::new() };
        let mut rest = &self.weights[..];
        let is_gone = |i: &u32| gone[*i as usize];
        for (centre, near) in self.rows.iter() {
            let (weights, after) = rest.split_at(near.len() + 1);
            rest = after;
            if is_gone(&centre) {
                continue;
            }
            if near.iter().any(is_gone) {
                let near: Vec<u32> = near.iter().copied().filter(|i| !is_gone(i)).collect();
                revised.add(centre, &near, centres, lambda, table);
            } else {
                revised.rows.push(centre, near.iter().copied());
                revised.weights.extend_from_slice(weights);
            }
        }
        for added in gone.len()..centres.len() {
            let near = nearest(&centres[..added], centres[added], |i| i >= gone.len() || !gone[i]);
            revised.add(added as u32, &near, centres, lambda, table);
        }
        revised.made = revised.rows.centres.len();
        revised
    }

    fn add(&mut self, centre: u32, near: &[u32], centres: &[DVec3], lambda: &[f64], table: &KernelTable) {
        self.rows.push(centre, near.iter().copied());
        row(centre, near, centres, lambda, table, &mut self.weights);
    }

    /// The approximate inverse times `x`.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        let mut rest = &self.weights[..];
        for (centre, neighbours) in self.rows.iter().take(self.made) {
            let (weights, after) = rest.split_at(neighbours.len() + 1);
            rest = after;
            let others = neighbours.iter().zip(&weights[1..]);
            let mut sum = weights[0] * x[centre as usize];
            others.clone().for_each(|(&j, w)| sum += w * x[j as usize]);
            out[centre as usize] += weights[0] * sum;
            others.for_each(|(&j, w)| out[j as usize] += w * sum);
        }
        out
    }
}

/// The [`NEIGHBOURS`] of the points `among` that are nearest to `p`, nearest first.
fn nearest(points: &[DVec3], p: DVec3, among: impl Fn(usize) -> bool) -> Vec<u32> {
    let with_distance = |i: usize| (rank_f64(points[i].distance_squared(p)), i as u32);
    let mut found: Vec<(u64, u32)> = (0..points.len()).filter(|&i| among(i)).map(with_distance).collect();
    if found.len() > NEIGHBOURS {
        found.select_nth_unstable(NEIGHBOURS);
        found.truncate(NEIGHBOURS);
    }
    found.sort_unstable();
    found.into_iter().map(|(_, i)| i).collect()
}

/// The row of one centre: with A its neighbours' system and b its own entries there, c = A⁻¹b, the row is
/// (1, −c)/√(φ(0) + λ − bᵀc), added to `out`.
fn row(
    centre: u32,
    neighbours: &[u32],
    centres: &[DVec3],
    lambda: &[f64],
    table: &KernelTable,
    out: &mut Vec<f64>,
) {
    let (centre, n) = (centre as usize, neighbours.len());
    let entry = |i: usize, j: usize| table.value(centres[i].distance_squared(centres[j]));
    let mut b: Vec<f64> = neighbours.iter().map(|&j| entry(centre, j as usize)).collect();
    let own = table.value(0.0);
    let mut factor = vec![0.0; n * n];
    for (i, &p) in neighbours.iter().enumerate() {
        for (j, &q) in neighbours[..i].iter().enumerate() {
            factor[i * n + j] = entry(p as usize, q as usize);
        }
        factor[i * n + i] = own + lambda[p as usize];
    }
    cholesky(&mut factor, n);
    // b becomes L⁻¹b, whose squares sum to bᵀA⁻¹b, and then A⁻¹b.
    forward(&factor, &mut b);
    let diagonal = own + lambda[centre];
    let variance = diagonal - b.iter().map(|x| x * x).sum::<f64>();
    backward(&factor, &mut b);
    let scale = 1.0 / larger(variance, LEAST_PIVOT * diagonal).sqrt();
    out.push(scale);
    out.extend(b.iter().map(|x| -x * scale));
}

/// A pivot below this share of its diagonal is rounding.
const LEAST_PIVOT: f64 = 1e-12;

/// The lower triangle of a positive definite matrix becomes its Cholesky factor.
fn cholesky(a: &mut [f64], n: usize) {
    for i in 0..n {
        let (done, rest) = a.split_at_mut(i * n);
        let row = &mut rest[..=i];
        for j in 0..i {
            let other = &done[j * n..j * n + j + 1];
            let sum: f64 = row[..j].iter().zip(other).map(|(x, y)| x * y).sum();
            row[j] = (row[j] - sum) / other[j];
        }
        let squares: f64 = row[..i].iter().map(|x| x * x).sum();
        row[i] = larger(row[i] - squares, LEAST_PIVOT * row[i]).sqrt();
    }
}

fn forward(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let row = &factor[i * n..i * n + i + 1];
        let sum: f64 = row[..i].iter().zip(&b[..i]).map(|(x, y)| x * y).sum();
        b[i] = (b[i] - sum) / row[i];
    }
}

fn backward(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in (0..n).rev() {
        let row = &factor[i * n..i * n + i + 1];
        b[i] /= row[i];
        let value = b[i];
        b[..i].iter_mut().zip(row).for_each(|(x, y)| *x -= value * y);
    }
}

/// The larger one; a comparison, as the platform's function is a call in wasm.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Distance between the first centres, in units of the box.
const FIRST_SPACING: f32 = 2.0;
/// Ratio of one round's distance to the one before.
const RATIO: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Distance below which centres are taken as they come.
const LEAST_SPACING: f32 = 1e-6;
/// Cells of the grid, and where neighbours are looked for first, in distances of the round.
const CELL: f32 = 3.6;
const REACH: f32 = 3.6;

/// An order from coarse to fine, each centre with its nearest ones before it: each is as far from those before it as those
/// that follow let it, within a factor of √2. In rounds: each takes the centres that are farther than some distance from
/// all taken.
#[derive(Clone, Debug, Default)]
struct Plan {
    centres: Vec<Vec3>,
    /// What was taken, in order.
    grid: PointGrid,
    spacing: f32,
    /// Centres to be looked at in this round, the next one last, and those left for the next round.
    waiting: Vec<u32>,
    others: Vec<u32>,
    /// Centres whose rounds come after those of all others.
    last: Vec<u32>,
}

impl Plan {
    fn new(centres: &[Vec3], mut first: Vec<u32>, last: Vec<u32>) -> Self {
        first.reverse();
        Self {
            centres: centres.to_vec(),
            grid: PointGrid::new(CELL * FIRST_SPACING, centres.len()),
            spacing: FIRST_SPACING,
            waiting: first,
            others: Vec::new(),
            last,
        }
    }

    /// Looks at up to `count` centres. Returns whether all are taken.
    fn extend(&mut self, count: usize, rows: &mut Rows) -> bool {
        for _ in 0..count {
            while self.waiting.is_empty() {
                if self.others.is_empty() && self.last.is_empty() {
                    return true;
                }
                self.begin_round(rows);
            }
            if let Some(i) = self.waiting.pop() {
                self.look_at(i, rows);
            }
        }
        rows.centres.len() == self.centres.len()
    }

    fn begin_round(&mut self, rows: &Rows) {
        let of_others = !self.others.is_empty();
        self.waiting = std::mem::take(if of_others { &mut self.others } else { &mut self.last });
        self.waiting.reverse();
        self.spacing = if of_others { self.spacing * RATIO } else { FIRST_SPACING };
        let cell = if self.spacing > LEAST_SPACING { self.spacing } else { LEAST_SPACING };
        let taken = rows.centres.iter().map(|&i| self.centres[i as usize]);
        let mut grid = PointGrid::new(CELL * cell, self.centres.len());
        taken.for_each(|p| grid.insert(p));
        self.grid = grid;
    }

    fn look_at(&mut self, i: u32, rows: &mut Rows) {
        let p = self.centres[i as usize];
        if self.spacing > LEAST_SPACING && self.grid.has_within(p, self.spacing) {
            self.others.push(i);
            return;
        }
        let near = self.grid.nearest(p, NEIGHBOURS, REACH * self.spacing);
        let near: Vec<u32> = near.into_iter().map(|(_, at)| rows.centres[at as usize]).collect();
        rows.push(i, near);
        self.grid.insert(p);
    }
}
