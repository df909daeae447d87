//! Conjugate gradients for [Φ+Λ B; Bᵀ 0] [w; p] = [y; 0], within the weights that are orthogonal to the polynomials B (Gould,
//! Hribar & Nocedal, *On the solution of equality constrained quadratic programming problems*, 2001, algorithm 2.1).

use super::precondition::SparseInverse;
use crate::methods::implicit::vectors::{add, dot};

/// The polynomials at the centres, column by column, and the approximate inverse times each.
#[derive(Clone, Debug)]
pub struct Polynomials {
    columns: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
    /// Inverse of BᵀMB, row by row.
    inverse: Vec<f64>,
}

impl Polynomials {
    /// `None` where the columns depend on each other.
    pub fn new(columns: Vec<Vec<f64>>, inverse: &SparseInverse) -> Option<Self> {
        let images: Vec<Vec<f64>> = columns.iter().map(|column| inverse.product(column)).collect();
        let gram = columns.iter().flat_map(|a| images.iter().map(|b| dot(a, b))).collect();
        let inverse = inverted(gram, columns.len())?;
        Some(Self { columns, images, inverse })
    }

    /// `weights` with as little taken away, as the inverse measures it, as makes them orthogonal to the polynomials.
    pub fn orthogonal(&self, mut weights: Vec<f64>) -> Vec<f64> {
        let moments: Vec<f64> = self.columns.iter().map(|column| dot(column, &weights)).collect();
        for (row, image) in self.inverse.chunks_exact(moments.len()).zip(&self.images) {
            add(-dot(row, &moments), image, &mut weights);
        }
        weights
    }

    /// The polynomial of these coefficients at a centre.
    pub fn value(&self, centre: usize, coefficients: &[f64]) -> f64 {
        self.columns.iter().zip(coefficients).map(|(column, c)| c * column[centre]).sum()
    }

    /// The coefficients c for which r − Bc is least as the approximate inverse measures it; `image` is that inverse times r.
    fn coefficients(&self, image: &[f64]) -> Vec<f64> {
        let moments: Vec<f64> = self.columns.iter().map(|column| dot(column, image)).collect();
        self.inverse.chunks_exact(moments.len()).map(|row| dot(row, &moments)).collect()
    }
}

/// A solution on its way.
#[derive(Clone, Debug)]
pub struct ConjugateGradients {
    /// w, one weight a centre.
    pub weights: Vec<f64>,
    /// p, one coefficient a polynomial.
    pub coefficients: Vec<f64>,
    /// y − (Φ+Λ)w − Bp.
    pub residual: Vec<f64>,
    direction: Vec<f64>,
    /// The residual as the approximate inverse measures it, squared.
    energy: f64,
}

impl ConjugateGradients {
    /// Starts from `weights`, orthogonal to the polynomials, for which `residual` is y − (Φ+Λ)w.
    pub fn new(
        weights: Vec<f64>,
        residual: Vec<f64>,
        polynomials: &Polynomials,
        inverse: &SparseInverse,
    ) -> Self {
        let coefficients = vec![0.0; polynomials.columns.len()];
        let mut start = Self { weights, coefficients, residual, direction: Vec::new(), energy: 0.0 };
        let image = start.take_out_polynomials(polynomials, inverse);
        start.energy = dot(&start.residual, &image);
        start.direction = image;
        start
    }

    /// One iteration; `product` multiplies by Φ+Λ. False where rounding lets it go no further.
    pub fn iterate(
        &mut self,
        product: impl Fn(&[f64]) -> Vec<f64>,
        polynomials: &Polynomials,
        inverse: &SparseInverse,
    ) -> bool {
        let image = product(&self.direction);
        let curvature = dot(&self.direction, &image);
        if curvature <= 0.0 || self.energy <= 0.0 {
            return false;
        }
        let step = self.energy / curvature;
        add(step, &self.direction, &mut self.weights);
        add(-step, &image, &mut self.residual);
        let image = self.take_out_polynomials(polynomials, inverse);
        let energy = dot(&self.residual, &image);
        let ratio = energy / self.energy;
        self.energy = energy;
        self.direction.iter_mut().zip(&image).for_each(|(d, z)| *d = z + ratio * *d);
        true
    }

    /// Moves what polynomials can explain of the residual to their coefficients. Returns the approximate inverse times what
    /// is left, which is orthogonal to them.
    fn take_out_polynomials(&mut self, polynomials: &Polynomials, inverse: &SparseInverse) -> Vec<f64> {
        let mut image = inverse.product(&self.residual);
        let more = polynomials.coefficients(&image);
        let columns = polynomials.columns.iter().zip(&polynomials.images);
        for ((c, &extra), (column, column_image)) in self.coefficients.iter_mut().zip(&more).zip(columns) {
            *c += extra;
            add(-extra, column, &mut self.residual);
            add(-extra, column_image, &mut image);
        }
        image
    }
}

/// The inverse of a symmetric positive definite `n` by `n` matrix by Gauss–Jordan elimination; `None` where it has none.
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
