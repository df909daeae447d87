//! The implicit function f and its gradient, evaluated by summing all kernel terms directly.

use super::kernel::KernelTable;
use super::solve::Solution;
use crate::math::{DVec3, Vec3};

/// The implicit function f(x) = Σ wᵢ φ(|x − cᵢ|) + p(x) (Dinh, Turk & Slabaugh, equation 2), with a kernel φ and a
/// polynomial p, in units of the normalised box. Every evaluation sums all terms; the module `fast` is faster at many
/// points.
#[derive(Clone, Debug)]
pub struct Field {
    table: KernelTable,
    terms: Vec<(DVec3, f64)>,
    coefficients: Vec<f64>,
}

impl Field {
    /// Creates the implicit function from its kernel φ, centres cᵢ, and the weights and polynomial of `solution`.
    pub fn new(table: KernelTable, centres: &[Vec3], solution: &Solution) -> Self {
        let terms = centres.iter().zip(&solution.weights).map(|(c, &w)| (c.as_dvec3(), w)).collect();
        Self { table, terms, coefficients: solution.coefficients.clone() }
    }

    /// Returns the implicit function f at `p`, a point in coordinates of the normalised box.
    pub fn value(&self, p: DVec3) -> f64 {
        self.terms.iter().map(|term| self.term(term, p)).sum::<f64>() + self.polynomial(p)
    }

    /// Returns the implicit function f and its gradient ∇f at `p`, in units of the normalised box.
    pub fn value_and_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let (mut sum, mut gradient) = (self.polynomial(p), self.slopes());
        for term in &self.terms {
            let (value, slope) = self.term_and_gradient(term, p);
            sum += value;
            gradient += slope;
        }
        (sum, gradient)
    }

    /// Returns the terms wᵢ φ(|x − cᵢ|) of the implicit function, as pairs of centre cᵢ and weight wᵢ.
    pub fn terms(&self) -> &[(DVec3, f64)] {
        &self.terms
    }

    /// Returns the table of the kernel φ from which the terms of the function are computed.
    pub fn table(&self) -> &KernelTable {
        &self.table
    }

    /// Returns the value at `p` of one term of the implicit function, wᵢ φ(|p − cᵢ|), given as centre cᵢ and weight wᵢ.
    #[inline]
    pub fn term(&self, (centre, weight): &(DVec3, f64), p: DVec3) -> f64 {
        weight * self.table.value(p.distance_squared(*centre))
    }

    /// Returns the value and the gradient at `p` of one term of the implicit function, wᵢ φ(|p − cᵢ|), given as centre
    /// cᵢ and weight wᵢ.
    #[inline]
    pub fn term_and_gradient(&self, (centre, weight): &(DVec3, f64), p: DVec3) -> (f64, DVec3) {
        let away = p - *centre;
        let [value, slope] = self.table.value_and_slope(away.length_squared());
        (weight * value, away * (2.0 * weight * slope))
    }

    /// Returns the polynomial part of the implicit function f at `p`: a constant, plus a linear function with the
    /// thin-plate kernel.
    pub fn polynomial(&self, p: DVec3) -> f64 {
        self.coefficients[0] + self.slopes().dot(p)
    }

    /// Returns the gradient of the polynomial part of the implicit function f, which is constant: 0, or with the
    /// thin-plate kernel the linear coefficients.
    pub fn slopes(&self) -> DVec3 {
        if let [_, x, y, z] = self.coefficients[..] { DVec3::new(x, y, z) } else { DVec3::ZERO }
    }
}
