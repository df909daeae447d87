//! Preconditioner of the conjugate gradients: a sparse approximate inverse Cholesky factor of Φ + Λ. Each centre is
//! predicted from its nearest predecessors, in an order from coarse to fine (Vecchia's approximation; Schäfer, Katzfuss
//! & Owhadi, *Sparse Cholesky factorization by Kullback–Leibler minimization*, 2021).

use crate::math::order::{rank_f64, select_least, sort_pairs};
use crate::math::{DVec3, Vec3, cholesky};
use crate::methods::implicit::kernel::KernelTable;
use crate::spatial::PointGrid;

/// Maximum number of predecessors of a centre in its row of the sparse inverse. With 16, half as many iterations again
/// are needed; with 32, the inverse takes twice as long to compute.
const NEIGHBOURS: usize = 24;

/// A sparse approximate inverse of the linear system's matrix: (Φ + Λ)⁻¹ ≈ Σ gᵢ gᵢᵀ, with a sparse gᵢ for each centre.
/// It preconditions conjugate gradients.
#[derive(Clone, Debug)]
pub struct SparseInverse {
    /// The order of the centres, with those predecessors of each that its row of the inverse refers to.
    rows: Rows,
    /// The part of the ordering of centres that is still to be done.
    ordering: MaximinOrdering,
    computed: usize,
    /// Entries of the vectors gᵢ of the sparse inverse Σ gᵢ gᵢᵀ for each row computed, one row after the other: for the
    /// centre itself, then for its neighbours.
    weights: Vec<f64>,
}

/// The centres in their order, from coarse to fine, each with some of its nearest predecessors, called its neighbours,
/// to which its row of the inverse is limited.
#[derive(Clone, Debug, Default)]
struct Rows {
    centres: Vec<u32>,
    /// Neighbours of all centres, one row after the other; `ends` holds the end of each row in this list.
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
    /// Starts the inverse for `centres`. Those with indices in `first` come before those in `last` in the order of its
    /// rows; together these lists hold the index of each centre once. Nothing is computed yet.
    pub fn new(centres: &[Vec3], first: Vec<u32>, last: Vec<u32>) -> Self {
        let ordering = MaximinOrdering::new(centres, first, last);
        Self { rows: Rows::default(), ordering, computed: 0, weights: Vec::new() }
    }

    /// Continues the inverse: tests up to `count` more centres for the ordering; once that is complete, computes up to
    /// `count` more rows. Returns whether all rows are computed.
    ///
    /// If a local system is singular to rounding, its diagonal is raised: that costs iterations, never accuracy.
    pub fn build(&mut self, centres: &[DVec3], lambda: &[f64], table: &KernelTable, count: usize) -> bool {
        if self.ordering.extend(count, &mut self.rows) {
            for (centre, near) in self.rows.iter().skip(self.computed).take(count) {
                row(centre, near, centres, lambda, table, &mut self.weights);
                self.computed += 1;
            }
        }
        self.computed == centres.len()
    }

    /// Returns the share of the inverse that is done, 0 to 1, by numbers of rows ordered and of rows computed.
    pub fn progress(&self) -> f64 {
        0.5 * (self.rows.centres.len() + self.computed) as f64 / self.ordering.centres.len() as f64
    }

    /// Returns a complete inverse for other centres, derived from this one, which must be complete: those flagged in
    /// `removed` are left out. Those that `centres` has beyond the length of `removed` are added at the end, each with
    /// its nearest remaining or added predecessors as neighbours.
    pub fn revised(&self, removed: &[bool], centres: &[DVec3], lambda: &[f64], table: &KernelTable) -> Self {
        let mut revised = Self {
            rows: Rows::default(),
            ordering: MaximinOrdering::default(),
            computed: 0,
            weights: Vec::new(),
        };
        let mut rest = &self.weights[..];
        let is_removed = |i: &u32| removed[*i as usize];
        for (centre, near) in self.rows.iter() {
            let (weights, after) = rest.split_at(near.len() + 1);
            rest = after;
            if is_removed(&centre) {
                continue;
            }
            if near.iter().any(is_removed) {
                let near: Vec<u32> = near.iter().copied().filter(|i| !is_removed(i)).collect();
                revised.add(centre, &near, centres, lambda, table);
            } else {
                revised.rows.push(centre, near.iter().copied());
                revised.weights.extend_from_slice(weights);
            }
        }
        for added in removed.len()..centres.len() {
            let near = nearest(&centres[..added], centres[added], |i| i >= removed.len() || !removed[i]);
            revised.add(added as u32, &near, centres, lambda, table);
        }
        revised.computed = revised.rows.centres.len();
        revised
    }

    fn add(&mut self, centre: u32, near: &[u32], centres: &[DVec3], lambda: &[f64], table: &KernelTable) {
        self.rows.push(centre, near.iter().copied());
        row(centre, near, centres, lambda, table, &mut self.weights);
    }

    /// Returns the product of the approximate inverse and the vector `x`, which preconditions it.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        let mut rest = &self.weights[..];
        for (centre, neighbours) in self.rows.iter().take(self.computed) {
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

/// Returns the indices of up to [`NEIGHBOURS`] points nearest to `p` among those that `among` accepts, nearest first.
fn nearest(points: &[DVec3], p: DVec3, among: impl Fn(usize) -> bool) -> Vec<u32> {
    let with_distance = |i: usize| (rank_f64(points[i].distance_squared(p)), i as u32);
    let mut found: Vec<(u64, u32)> = (0..points.len()).filter(|&i| among(i)).map(with_distance).collect();
    if found.len() > NEIGHBOURS {
        select_least(&mut found, NEIGHBOURS);
        found.truncate(NEIGHBOURS);
    }
    sort_pairs(&mut found);
    found.into_iter().map(|(_, i)| i).collect()
}

/// Appends one row of the inverse, the entries of gᵢ for one centre, to `out`: (1, −c)/√(φ(0) + λ − bᵀc) with c = A⁻¹b,
/// where A is the matrix Φ+Λ of its neighbours, and b holds the entries of Φ between the centre and them.
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
    cholesky::factorise(&mut factor, n);
    // b becomes L⁻¹b, whose squares sum to bᵀA⁻¹b, and then A⁻¹b.
    cholesky::forward(&factor, &mut b);
    let diagonal = own + lambda[centre];
    let variance = diagonal - b.iter().map(|x| x * x).sum::<f64>();
    cholesky::backward(&factor, &mut b);
    let scale = 1.0 / cholesky::max(variance, cholesky::MIN_PIVOT * diagonal).sqrt();
    out.push(scale);
    out.extend(b.iter().map(|x| -x * scale));
}

/// Minimum distance between the centres taken in the first round of the ordering of centres from coarse to fine, in
/// units of the normalised box (longest side 2).
const FIRST_SPACING: f32 = 2.0;
/// Ratio of the minimum distance between the centres taken in one round of the ordering to that in the round before.
const RATIO: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Minimum distance between centres in a round of the ordering, in units of the normalised box (longest side 2), at or
/// below which all remaining centres are taken in their given order.
const MIN_SPACING: f32 = 1e-6;
/// Edge length of the cells of the grid that holds the centres taken so far by the ordering, in minimum distances of
/// its current round.
const CELL: f32 = 3.6;
/// Initial search radius for the nearest predecessors of a centre in the ordering, in minimum distances of the current
/// round.
const SEARCH_RADIUS: f32 = 3.6;

/// An ordering of centres from coarse to fine (approximately maximin), in progress, each with its nearest predecessors:
/// first the centres of surface constraints, then those of exterior ones. In each part, a centre is as far from its
/// predecessors as any of its successors is, within a factor of √2: every round takes the centres that are farther than
/// some distance from all taken before, and the distance falls from round to round.
#[derive(Clone, Debug, Default)]
struct MaximinOrdering {
    centres: Vec<Vec3>,
    /// Positions of the centres ordered so far, in their order, among which the nearest are searched for.
    grid: PointGrid,
    spacing: f32,
    /// Centres to be tested in the current round, the next one last.
    pending: Vec<u32>,
    /// Centres too near to those taken, left for the next round.
    deferred: Vec<u32>,
    /// Centres that are ordered after all others: those of exterior constraints.
    last: Vec<u32>,
}

impl MaximinOrdering {
    fn new(centres: &[Vec3], mut first: Vec<u32>, last: Vec<u32>) -> Self {
        first.reverse();
        Self {
            centres: centres.to_vec(),
            grid: PointGrid::new(CELL * FIRST_SPACING, centres.len()),
            spacing: FIRST_SPACING,
            pending: first,
            deferred: Vec::new(),
            last,
        }
    }

    /// Continues the ordering: tests up to `count` centres and appends those taken to `rows`. Returns whether all
    /// centres are ordered.
    fn extend(&mut self, count: usize, rows: &mut Rows) -> bool {
        for _ in 0..count {
            while self.pending.is_empty() {
                if self.deferred.is_empty() && self.last.is_empty() {
                    return true;
                }
                self.begin_round(rows);
            }
            if let Some(i) = self.pending.pop() {
                self.visit(i, rows);
            }
        }
        rows.centres.len() == self.centres.len()
    }

    fn begin_round(&mut self, rows: &Rows) {
        let of_others = !self.deferred.is_empty();
        self.pending = std::mem::take(if of_others { &mut self.deferred } else { &mut self.last });
        self.pending.reverse();
        self.spacing = if of_others { self.spacing * RATIO } else { FIRST_SPACING };
        let cell = if self.spacing > MIN_SPACING { self.spacing } else { MIN_SPACING };
        let taken = rows.centres.iter().map(|&i| self.centres[i as usize]);
        let mut grid = PointGrid::new(CELL * cell, self.centres.len());
        taken.for_each(|p| grid.insert(p));
        self.grid = grid;
    }

    fn visit(&mut self, i: u32, rows: &mut Rows) {
        let p = self.centres[i as usize];
        if self.spacing > MIN_SPACING && self.grid.has_within(p, self.spacing) {
            self.deferred.push(i);
            return;
        }
        let near = self.grid.nearest(p, NEIGHBOURS, SEARCH_RADIUS * self.spacing);
        let near: Vec<u32> = near.into_iter().map(|(_, at)| rows.centres[at as usize]).collect();
        rows.push(i, near);
        self.grid.insert(p);
    }
}
