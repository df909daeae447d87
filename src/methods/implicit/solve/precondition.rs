//! A sparse approximate inverse of Φ + Λ: each centre is predicted from the nearest ones before it, in an order from
//! coarse to fine (Vecchia's approximation; Schäfer, Katzfuss & Owhadi, *Sparse Cholesky factorization by Kullback–Leibler
//! minimization*, 2021).

use crate::math::{DVec3, Vec3};
use crate::methods::implicit::kernel::KernelTable;
use crate::spatial::PointGrid;

/// Earlier centres that each is predicted from. 16 double the iterations; 64 cost eight times as much to make.
const NEIGHBOURS: usize = 32;

/// (Φ + Λ)⁻¹ ≈ Σ gᵢ gᵢᵀ with a sparse gᵢ for each centre.
#[derive(Clone, Debug)]
pub struct SparseInverse {
    /// In which order centres are predicted, and from which earlier ones.
    plan: Vec<(u32, Vec<u32>)>,
    /// For each place in the plan that was made so far, the weights of gᵢ: of the centre itself, then of its neighbours.
    weights: Vec<Vec<f64>>,
}

impl SparseInverse {
    /// The plan for `centres`, of which those from `first_exterior` on come last; nothing is made yet.
    pub fn new(centres: &[Vec3], interior: &[u32], exterior: &[u32]) -> Self {
        let mut planner = Planner::default();
        planner.add(centres, interior);
        planner.add(centres, exterior);
        Self { plan: planner.plan, weights: Vec::new() }
    }

    /// Makes up to `count` more rows. Returns whether all are made.
    ///
    /// Where a local system is singular to rounding, its diagonal is raised: that costs iterations, never accuracy.
    pub fn build(&mut self, centres: &[DVec3], lambda: &[f64], table: &KernelTable, count: usize) -> bool {
        let from = self.weights.len();
        for (centre, neighbours) in self.plan.iter().skip(from).take(count) {
            self.weights.push(row(*centre as usize, neighbours, centres, lambda, table));
        }
        self.weights.len() == self.plan.len()
    }

    /// The share of rows made.
    pub fn progress(&self) -> f64 {
        self.weights.len() as f64 / self.plan.len() as f64
    }

    /// The approximate inverse times `x`.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        for ((centre, neighbours), weights) in self.plan.iter().zip(&self.weights) {
            let others = neighbours.iter().zip(&weights[1..]);
            let mut sum = weights[0] * x[*centre as usize];
            others.clone().for_each(|(&j, w)| sum += w * x[j as usize]);
            out[*centre as usize] += weights[0] * sum;
            others.for_each(|(&j, w)| out[j as usize] += w * sum);
        }
        out
    }
}

/// The row of one centre: with A its neighbours' system and b its own entries there, c = A⁻¹b, the row is
/// (1, −c)/√(φ(0) + λ − bᵀc).
fn row(
    centre: usize,
    neighbours: &[u32],
    centres: &[DVec3],
    lambda: &[f64],
    table: &KernelTable,
) -> Vec<f64> {
    let n = neighbours.len();
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
    std::iter::once(scale).chain(b.iter().map(|x| -x * scale)).collect()
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

/// Puts centres in an order from coarse to fine: each is as far from those before it as those that follow let it, within a
/// factor of √2.
#[derive(Default)]
struct Planner {
    plan: Vec<(u32, Vec<u32>)>,
}

/// Distance between the first centres, in units of the box.
const FIRST_SPACING: f32 = 2.0;
/// Ratio of one round's distance to the one before.
const RATIO: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Distance below which centres are taken as they come.
const LEAST_SPACING: f32 = 1e-6;

impl Planner {
    fn add(&mut self, centres: &[Vec3], indices: &[u32]) {
        let mut left = indices.to_vec();
        let mut spacing = FIRST_SPACING;
        while !left.is_empty() {
            left = self.round(centres, &left, if spacing > LEAST_SPACING { spacing } else { 0.0 });
            spacing *= RATIO;
        }
    }

    /// Takes the centres that are farther than `spacing` from all that are taken. Returns the others.
    fn round(&mut self, centres: &[Vec3], indices: &[u32], spacing: f32) -> Vec<u32> {
        let expected = self.plan.len() + indices.len();
        let mut grid = PointGrid::new((2.5 * spacing).max(LEAST_SPACING), expected);
        self.plan.iter().for_each(|(i, _)| grid.insert(centres[*i as usize]));
        let mut others = Vec::new();
        for &i in indices {
            let p = centres[i as usize];
            if spacing > 0.0 && grid.has_within(p, spacing) {
                others.push(i);
                continue;
            }
            let near = grid.nearest(p, NEIGHBOURS, 5.0 * spacing);
            let neighbours = near.into_iter().map(|(_, at)| self.plan[at as usize].0).collect();
            self.plan.push((i, neighbours));
            grid.insert(p);
        }
        others
    }
}
