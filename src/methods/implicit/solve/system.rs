//! The matrix of the linear system and its preconditioner, and their revision for a few changed constraints.

use super::clusters::ClusterTree;
use super::constraints::Constraints;
use super::hierarchical::HierarchicalMatrix;
use super::precondition::SparseInverse;
use crate::math::vectors::{add, dot};
use crate::math::{DVec3, PositionIndex, Random, Vec3};
use crate::methods::implicit::kernel::{Kernel, KernelTable};

/// Amount of work that the solver does in one slice, in evaluations of the kernel or their equivalent: about ten
/// milliseconds.
pub const WORK: usize = 2_000_000;
/// Cost of computing a row of the sparse inverse, in evaluations of the kernel, which limits the rows in a slice of
/// work.
const ROW_WORK: usize = 4_000;
/// Relative error of the low-rank blocks of the hierarchical matrix, as a share of the solver's tolerance: with it, the
/// final residual is seldom above the tolerance.
const FAR_ERROR: f64 = 0.1;
/// Number of constraints above which low-rank blocks of the matrix are made more accurate, in proportion to the number:
/// errors add up, and a residual that is too large has to be recomputed from all pairs of constraints.
const USUAL_CONSTRAINTS: f64 = 25_000.0;
/// Relative error of the low-rank blocks of the hierarchical matrix for kernels that are only conditionally positive
/// definite, whose large values cancel.
const CONDITIONAL_ERROR: f64 = 1e-11;
/// Maximum number of constraints whose matrix is stored in double precision; with more, memory matters more. Kernels
/// that are only conditionally positive definite always use double precision.
const DOUBLE_BELOW: usize = 6000;
/// Maximum number of constraints added, and of constraints removed, for which the linear system is revised and not
/// rebuilt. Each added constraint costs a row of the full matrix.
const MAX_CHANGES: usize = 256;
/// Marks a row whose constraint was removed, in place of the constraint's index.
const REMOVED: u32 = u32::MAX;

/// The linear system of some constraints, [Φ+Λ B; Bᵀ 0] [w; p] = [y; 0]: Φ holds the kernel between centres, Λ the
/// regularisation and B the polynomials at the centres, y the prescribed values; weights w and coefficients p are
/// sought.
///
/// Each constraint has a row, which is also its index in all vectors: first those for which the matrix was computed, in
/// the order of its cluster tree, then those added since. Rows of removed constraints are kept, and are 0 in all
/// vectors.
#[derive(Clone, Debug)]
pub struct System {
    table: KernelTable,
    centres: Vec<DVec3>,
    values: Vec<f64>,
    lambda: Vec<f64>,
    /// For each row, the index of its constraint, or [`REMOVED`].
    constraint_of_row: Vec<u32>,
    matrix: Matrix,
    inverse: SparseInverse,
    revision: Option<Revision>,
}

/// Changes of the constraints since the matrix was computed, which allow it to be reused.
#[derive(Clone, Debug)]
struct Revision {
    /// For each row of the matrix, whether its constraint was removed.
    removed: Vec<bool>,
    /// For each added row, its entries of the kernel matrix Φ, up to the diagonal.
    rows: Vec<Vec<f64>>,
    inverse: SparseInverse,
}

#[derive(Clone, Debug)]
enum Matrix {
    Single(HierarchicalMatrix<f32>),
    Double(HierarchicalMatrix<f64>),
}

impl System {
    /// Creates the linear system of `constraints`; nothing is computed yet. Low-rank blocks of the matrix will be as
    /// accurate as a residual of `tolerance` requires.
    pub fn new(constraints: &Constraints, kernel: Kernel, tolerance: f64, seed: u64) -> Self {
        let tree = ClusterTree::new(&constraints.centres);
        let constraint_of_row = tree.order.clone();
        let positions: Vec<Vec3> =
            constraint_of_row.iter().map(|&i| constraints.centres[i as usize]).collect();
        let centres: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
        let values = gather_rows(&constraint_of_row, &constraints.values);
        let shuffled = Random::new(seed).permutation(positions.len());
        let (surface, outside): (Vec<u32>, Vec<u32>) =
            shuffled.iter().partition(|&&i| values[i as usize] == 0.0);
        Self {
            table: KernelTable::new(kernel),
            matrix: Matrix::new(tree, &centres, kernel, tolerance),
            inverse: SparseInverse::new(&positions, surface, outside),
            centres,
            values,
            lambda: gather_rows(&constraint_of_row, &constraints.lambda),
            constraint_of_row,
            revision: None,
        }
    }

    /// Computes a slice, about ten milliseconds of work, of the preconditioner and then the matrix. Returns whether
    /// both are complete.
    pub fn build(&mut self) -> bool {
        if self.revision.is_some() || self.matrix.progress() == 1.0 {
            return true;
        }
        if self.inverse.progress() < 1.0 {
            self.inverse.build(&self.centres, &self.lambda, &self.table, WORK / ROW_WORK);
            return false;
        }
        self.matrix.build(&self.table)
    }

    /// Returns the share of [`Self::build`] that is done, 0 to 1.
    pub fn progress(&self) -> f64 {
        if self.revision.is_some() {
            1.0
        } else {
            0.4 * self.inverse.progress() + 0.6 * self.matrix.progress()
        }
    }

    /// Returns whether [`Self::revise`] is worthwhile: at most `MAX_CHANGES` of the constraints for which the matrix
    /// was computed are missing in `constraints`, and at most `MAX_CHANGES` are new.
    pub fn can_revise(&self, constraints: &Constraints) -> bool {
        let known = PositionIndex::new(&constraints.centres);
        let own = self.base_centres();
        let kept = own.iter().filter(|c| known.find(c.as_vec3()).is_some()).count();
        own.len() - kept <= MAX_CHANGES && constraints.centres.len() - kept <= MAX_CHANGES
    }

    /// Revises the system to other constraints, reusing the matrix, which must be complete, and the preconditioner.
    pub fn revise(&mut self, constraints: &Constraints) {
        let own = self.base_centres().len();
        self.centres.truncate(own);
        let known = PositionIndex::new(&constraints.centres);
        let mut is_new = vec![true; constraints.centres.len()];
        let mut find = |centre: &DVec3| {
            let found = known.find(centre.as_vec3())?;
            is_new[found] = false;
            Some(found as u32)
        };
        self.constraint_of_row = self.centres.iter().map(|centre| find(centre).unwrap_or(REMOVED)).collect();
        let removed: Vec<bool> = self.constraint_of_row.iter().map(|&i| i == REMOVED).collect();
        for i in (0..is_new.len()).filter(|&i| is_new[i]) {
            self.constraint_of_row.push(i as u32);
            self.centres.push(constraints.centres[i].as_dvec3());
        }
        self.values = gather_rows(&self.constraint_of_row, &constraints.values);
        self.lambda = gather_rows(&self.constraint_of_row, &constraints.lambda);
        let rows = (own..self.centres.len()).map(|i| self.row(i, i + 1).collect()).collect();
        let inverse = self.inverse.revised(&removed, &self.centres, &self.lambda, &self.table);
        self.revision = Some(Revision { removed, rows, inverse });
    }

    /// Returns the centres for which the matrix was computed, without those added by a revision.
    fn base_centres(&self) -> &[DVec3] {
        &self.centres[..self.revision.as_ref().map_or(self.centres.len(), |revision| revision.removed.len())]
    }

    /// Returns the entries of the kernel matrix Φ between row `i` and the first `count` rows.
    fn row(&self, i: usize, count: usize) -> impl Iterator<Item = f64> {
        self.centres[..count].iter().map(move |c| self.table.value(self.centres[i].distance_squared(*c)))
    }

    /// Returns the kernel φ, whose values between centres are the matrix Φ.
    pub fn kernel(&self) -> Kernel {
        self.table.kernel()
    }

    /// Returns the number of rows of the linear system, including those of removed constraints.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Returns the size of the stored kernel matrix, in bytes.
    pub fn matrix_bytes(&self) -> usize {
        match &self.matrix {
            Matrix::Single(matrix) => matrix.bytes(),
            Matrix::Double(matrix) => matrix.bytes(),
        }
    }

    /// Returns the right-hand side y of the system, the prescribed value of f for each row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the approximate inverse of Φ + Λ, the preconditioner.
    pub fn inverse(&self) -> &SparseInverse {
        self.revision.as_ref().map_or(&self.inverse, |revision| &revision.inverse)
    }

    /// Reorders a vector with an entry per constraint into one with an entry per row of the system; removed rows are 0.
    pub fn to_rows(&self, of_constraints: &[f64]) -> Vec<f64> {
        gather_rows(&self.constraint_of_row, of_constraints)
    }

    /// Reorders a vector with an entry per row of the system into one with an entry per constraint, without removed
    /// rows.
    pub fn to_constraints(&self, of_rows: &[f64]) -> Vec<f64> {
        let present = || self.constraint_of_row.iter().zip(of_rows).filter(|(i, _)| **i != REMOVED);
        let mut all = vec![0.0; present().count()];
        present().for_each(|(&i, &x)| all[i as usize] = x);
        all
    }

    /// Returns the columns of the matrix B of polynomials at the centres, by row: 1, and with a thin plate x, y and z;
    /// 0 in removed rows.
    pub fn polynomials(&self) -> Vec<Vec<f64>> {
        let column = |power: usize| {
            let entry = |(centre, &i): (&DVec3, &u32)| match power {
                _ if i == REMOVED => 0.0,
                0 => 1.0,
                axis => centre[axis - 1],
            };
            self.centres.iter().zip(&self.constraint_of_row).map(entry).collect()
        };
        (0..self.kernel().polynomials()).map(column).collect()
    }

    /// Returns the product (Φ+Λ)x of the system's matrix and a vector, with Φ approximated as a hierarchical matrix.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let own = self.base_centres().len();
        let mut out = match &self.matrix {
            Matrix::Single(matrix) => matrix.product(&x[..own]),
            Matrix::Double(matrix) => matrix.product(&x[..own]),
        };
        out.resize(x.len(), 0.0);
        if let Some(Revision { removed, rows, .. }) = &self.revision {
            for (at, row) in (own..).zip(rows) {
                out[at] += dot(row, &x[..=at]);
                add(x[at], &row[..at], &mut out[..at]);
            }
            out.iter_mut().zip(removed).filter(|(_, removed)| **removed).for_each(|(y, _)| *y = 0.0);
        }
        out.iter_mut().zip(&self.lambda).zip(x).for_each(|((y, l), x)| *y += l * x);
        out
    }

    /// Returns the residual of row `i` without the polynomial part, yᵢ − ((Φ+Λ)w)ᵢ, with Φ from the tabulated kernel,
    /// not from the approximated matrix; 0 for a removed row.
    pub fn row_residual(&self, i: usize, weights: &[f64]) -> f64 {
        if self.constraint_of_row[i] == REMOVED {
            return 0.0;
        }
        let sum: f64 = self.row(i, self.len()).zip(weights).map(|(phi, w)| phi * w).sum();
        self.values[i] - sum - self.lambda[i] * weights[i]
    }
}

fn gather_rows(constraint_of_row: &[u32], all: &[f64]) -> Vec<f64> {
    constraint_of_row.iter().map(|&i| if i == REMOVED { 0.0 } else { all[i as usize] }).collect()
}

impl Matrix {
    fn new(tree: ClusterTree, centres: &[DVec3], kernel: Kernel, tolerance: f64) -> Self {
        let conditional = kernel.is_conditional();
        let crowd = centres.len() as f64 / USUAL_CONSTRAINTS;
        let far = FAR_ERROR * tolerance / if crowd > 1.0 { crowd } else { 1.0 };
        let error = if conditional { CONDITIONAL_ERROR } else { far };
        if conditional || centres.len() <= DOUBLE_BELOW {
            Self::Double(HierarchicalMatrix::new(tree, centres.to_vec(), error))
        } else {
            Self::Single(HierarchicalMatrix::new(tree, centres.to_vec(), error))
        }
    }

    fn build(&mut self, table: &KernelTable) -> bool {
        let share = match self {
            Self::Single(matrix) => matrix.build(table, WORK),
            Self::Double(matrix) => matrix.build(table, WORK),
        };
        share == 1.0
    }

    fn progress(&self) -> f64 {
        match self {
            Self::Single(matrix) => matrix.progress(),
            Self::Double(matrix) => matrix.progress(),
        }
    }
}
