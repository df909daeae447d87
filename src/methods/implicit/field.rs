//! The implicit function f and its gradient, summed directly over all terms.

use super::kernel::KernelTable;
use super::solve::Solution;
use crate::math::{DVec3, Vec3};

/// The implicit function f(x) = Σ wᵢ φ(|x − cᵢ|) + p(x) (paper, equation 2), in units of the normalised box. Every
/// evaluation sums all terms; see `fast` for many points.
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

    /// Returns f at `p`, which is in box units.
    pub fn value(&self, p: DVec3) -> f64 {
        self.terms.iter().map(|term| self.term(term, p)).sum::<f64>() + self.polynomial(p)
    }

    /// Returns f and its gradient ∇f at `p`, in box units.
    pub fn value_and_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let (mut sum, mut gradient) = (self.polynomial(p), self.slopes());
        for term in &self.terms {
            let (value, slope) = self.term_and_gradient(term, p);
            sum += value;
            gradient += slope;
        }
        (sum, gradient)
    }

    /// Returns the terms of the sum, as pairs of centre cᵢ and weight wᵢ.
    pub fn terms(&self) -> &[(DVec3, f64)] {
        &self.terms
    }

    /// Returns the tabulated kernel φ.
    pub fn table(&self) -> &KernelTable {
        &self.table
    }

    /// Returns the value of one term, wᵢ φ(|p − cᵢ|).
    #[inline]
    pub fn term(&self, (centre, weight): &(DVec3, f64), p: DVec3) -> f64 {
        weight * self.table.value(p.distance_squared(*centre))
    }

    /// Returns the value and the gradient of one term, wᵢ φ(|p − cᵢ|), at `p`.
    #[inline]
    pub fn term_and_gradient(&self, (centre, weight): &(DVec3, f64), p: DVec3) -> (f64, DVec3) {
        let away = p - *centre;
        let [value, slope] = self.table.value_and_slope(away.length_squared());
        (weight * value, away * (2.0 * weight * slope))
    }

    /// Returns the polynomial part of f at `p`.
    pub fn polynomial(&self, p: DVec3) -> f64 {
        self.coefficients[0] + self.slopes().dot(p)
    }

    /// Returns the gradient of the polynomial part of f, a constant: 0, or with a thin plate its linear coefficients.
    pub fn slopes(&self) -> DVec3 {
        if let [_, x, y, z] = self.coefficients[..] { DVec3::new(x, y, z) } else { DVec3::ZERO }
    }
}
