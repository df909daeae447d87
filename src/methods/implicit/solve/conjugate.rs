//! Projected conjugate gradients for the linear system [Φ+Λ B; Bᵀ 0] [w; p] = [y; 0] of the implicit function's weights
//! w and polynomial coefficients p (Φ: kernel, Λ: regularisation, B: polynomials at the centres, y: prescribed values).
//! Iterations stay within the weights that are orthogonal to B (Gould, Hribar & Nocedal, *On the solution of equality
//! constrained quadratic programming problems*, 2001, algorithm 2.1). M is the preconditioner, an approximate inverse
//! of Φ+Λ.

use super::precondition::SparseInverse;
use crate::math::ConjugateGradients;
use crate::math::vectors::{add, dot};

/// The matrix B of the polynomials at the centres and its product MB with the preconditioner, both by columns; used to
/// project weights onto those orthogonal to the polynomials.
#[derive(Clone, Debug)]
pub struct Polynomials {
    columns: Vec<Vec<f64>>,
    preconditioned: Vec<Vec<f64>>,
    /// Inverse of BᵀMB, row by row, where B is the matrix of polynomials and M the preconditioner; used to project
    /// weights.
    inverse: Vec<f64>,
}

impl Polynomials {
    /// Prepares the projection of weights for the columns of B, with the preconditioner `inverse`; `None` if these
    /// columns are linearly dependent.
    pub fn new(columns: Vec<Vec<f64>>, inverse: &SparseInverse) -> Option<Self> {
        let preconditioned: Vec<Vec<f64>> = columns.iter().map(|column| inverse.product(column)).collect();
        let gram = columns.iter().flat_map(|a| preconditioned.iter().map(|b| dot(a, b))).collect();
        let inverse = inverted(gram, columns.len())?;
        Some(Self { columns, preconditioned, inverse })
    }

    /// Returns the projection of `weights` onto those orthogonal to the polynomials: the nearest ones in the norm of
    /// M⁻¹, where M is the preconditioner.
    pub fn project(&self, mut weights: Vec<f64>) -> Vec<f64> {
        let moments: Vec<f64> = self.columns.iter().map(|column| dot(column, &weights)).collect();
        for (row, preconditioned) in self.inverse.chunks_exact(moments.len()).zip(&self.preconditioned) {
            add(-dot(row, &moments), preconditioned, &mut weights);
        }
        weights
    }

    /// Returns the value of the polynomial with the given `coefficients` at the centre with the index `centre`.
    pub fn value(&self, centre: usize, coefficients: &[f64]) -> f64 {
        self.columns.iter().zip(coefficients).map(|(column, c)| c * column[centre]).sum()
    }

    /// Returns the polynomial coefficients c for which r − Bc is least in the norm of the preconditioner M;
    /// `preconditioned` is Mr, for the residual r.
    fn coefficients(&self, preconditioned: &[f64]) -> Vec<f64> {
        let moments: Vec<f64> = self.columns.iter().map(|column| dot(column, preconditioned)).collect();
        self.inverse.chunks_exact(moments.len()).map(|row| dot(row, &moments)).collect()
    }

    /// Changes the polynomials' `coefficients` such that the `residual` r is least in the norm of the preconditioner M,
    /// given by its factor `inverse`. Returns Mr, which is then orthogonal to the polynomials.
    fn project_residual(
        &self,
        residual: &mut [f64],
        coefficients: &mut [f64],
        inverse: &SparseInverse,
    ) -> Vec<f64> {
        let mut preconditioned = inverse.product(residual);
        let more = self.coefficients(&preconditioned);
        let columns = self.columns.iter().zip(&self.preconditioned);
        for ((c, &extra), (column, column_image)) in coefficients.iter_mut().zip(&more).zip(columns) {
            *c += extra;
            add(-extra, column, residual);
            add(-extra, column_image, &mut preconditioned);
        }
        preconditioned
    }
}

/// The state of the conjugate gradient iteration for the weights and polynomial coefficients of an implicit function.
#[derive(Clone, Debug)]
pub struct ProjectedGradients {
    gradients: ConjugateGradients,
    /// The polynomial coefficients p found so far, one per polynomial.
    pub coefficients: Vec<f64>,
}

impl ProjectedGradients {
    /// Starts the iteration from `weights`, which must be orthogonal to the polynomials; `residual` is y − (Φ+Λ)w for
    /// these weights.
    pub fn new(
        weights: Vec<f64>,
        residual: Vec<f64>,
        polynomials: &Polynomials,
        inverse: &SparseInverse,
    ) -> Self {
        let mut coefficients = vec![0.0; polynomials.columns.len()];
        let gradients = ConjugateGradients::new(weights, residual, |residual| {
            polynomials.project_residual(residual, &mut coefficients, inverse)
        });
        Self { gradients, coefficients }
    }

    /// Returns the weights w found so far, one per row of the linear system.
    pub fn weights(&self) -> &[f64] {
        self.gradients.solution()
    }

    /// Returns the weights w found so far, and ends the iteration.
    pub fn into_weights(self) -> Vec<f64> {
        self.gradients.into_solution()
    }

    /// Returns the residual y − (Φ+Λ)w − Bp of the linear system, one entry per row.
    pub fn residual(&self) -> &[f64] {
        self.gradients.residual()
    }

    /// Does one iteration, which improves weights and coefficients; `product` multiplies a vector by Φ+Λ. Returns false
    /// if rounding prevents further progress, else true.
    pub fn iterate(
        &mut self,
        product: impl Fn(&[f64]) -> Vec<f64>,
        polynomials: &Polynomials,
        inverse: &SparseInverse,
    ) -> bool {
        let Self { gradients, coefficients } = self;
        gradients.iterate(product, |residual| polynomials.project_residual(residual, coefficients, inverse))
    }
}

/// Returns the inverse of a symmetric positive definite `n` by `n` matrix by Gauss–Jordan elimination; `None` if it is
/// singular.
fn inverted(mut a: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    let mut out: Vec<f64> = (0..n * n).map(|k| if k / n == k % n { 1.0 } else { 0.0 }).collect();
    let largest = (0..n).map(|i| a[i * n + i]).fold(0.0, f64::max);
    for k in 0..n {
        let pivot = a[k * n + k];
        if pivot.is_nan() || pivot <= 1e-14 * largest {
            return None;
        }
        for j in 0..n {
            a[k * n + j] /= pivot;
            out[k * n + j] /= pivot;
        }
        for i in (0..n).filter(|&i| i != k) {
            let factor = a[i * n + k];
            for j in 0..n {
                a[i * n + j] -= factor * a[k * n + j];
                out[i * n + j] -= factor * out[k * n + j];
            }
        }
    }
    Some(out)
}
