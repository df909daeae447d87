//! Projected conjugate gradients for the linear system [Φ+Λ B; Bᵀ 0] [w; p] = [y; 0] of the implicit function's weights
//! w and polynomial coefficients p (Φ: kernel, Λ: regularisation, B: polynomials at the centres, y: prescribed values).
//! Iterations stay within the weights that are orthogonal to B (Gould, Hribar & Nocedal, *On the solution of equality
//! constrained quadratic programming problems*, 2001, algorithm 2.1). M is the preconditioner, an approximate inverse
//! of Φ+Λ.

use super::precondition::SparseInverse;
use crate::methods::implicit::vectors::{add, dot};

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
}

/// The state of the conjugate gradient iteration for the weights and polynomial coefficients of an implicit function.
#[derive(Clone, Debug)]
pub struct ConjugateGradients {
    /// The weights w found so far, one per row of the linear system.
    pub weights: Vec<f64>,
    /// The polynomial coefficients p found so far, one per polynomial.
    pub coefficients: Vec<f64>,
    /// The residual y − (Φ+Λ)w − Bp of the linear system, one entry per row.
    pub residual: Vec<f64>,
    direction: Vec<f64>,
    /// Squared norm of the residual r in the norm of the preconditioner M: rᵀMr.
    energy: f64,
}

impl ConjugateGradients {
    /// Starts the iteration from `weights`, which must be orthogonal to the polynomials; `residual` is y − (Φ+Λ)w for
    /// these weights.
    pub fn new(
        weights: Vec<f64>,
        residual: Vec<f64>,
        polynomials: &Polynomials,
        inverse: &SparseInverse,
    ) -> Self {
        let coefficients = vec![0.0; polynomials.columns.len()];
        let mut start = Self { weights, coefficients, residual, direction: Vec::new(), energy: 0.0 };
        let preconditioned = start.project_residual(polynomials, inverse);
        start.energy = dot(&start.residual, &preconditioned);
        start.direction = preconditioned;
        start
    }

    /// Does one iteration, which improves weights and coefficients; `product` multiplies a vector by Φ+Λ. Returns false
    /// if rounding prevents further progress, else true.
    pub fn iterate(
        &mut self,
        product: impl Fn(&[f64]) -> Vec<f64>,
        polynomials: &Polynomials,
        inverse: &SparseInverse,
    ) -> bool {
        let preconditioned = product(&self.direction);
        let curvature = dot(&self.direction, &preconditioned);
        if curvature <= 0.0 || self.energy <= 0.0 {
            return false;
        }
        let step = self.energy / curvature;
        add(step, &self.direction, &mut self.weights);
        add(-step, &preconditioned, &mut self.residual);
        let preconditioned = self.project_residual(polynomials, inverse);
        let energy = dot(&self.residual, &preconditioned);
        let ratio = energy / self.energy;
        self.energy = energy;
        self.direction.iter_mut().zip(&preconditioned).for_each(|(d, z)| *d = z + ratio * *d);
        true
    }

    /// Changes the polynomials' coefficients such that the residual r is least in the norm of the preconditioner M.
    /// Returns Mr, which is then orthogonal to the polynomials.
    fn project_residual(&mut self, polynomials: &Polynomials, inverse: &SparseInverse) -> Vec<f64> {
        let mut preconditioned = inverse.product(&self.residual);
        let more = polynomials.coefficients(&preconditioned);
        let columns = polynomials.columns.iter().zip(&polynomials.preconditioned);
        for ((c, &extra), (column, column_image)) in self.coefficients.iter_mut().zip(&more).zip(columns) {
            *c += extra;
            add(-extra, column, &mut self.residual);
            add(-extra, column_image, &mut preconditioned);
        }
        preconditioned
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
