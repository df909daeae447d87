//! The function and its gradient, summed term by term.

use super::kernel::KernelTable;
use super::solve::Solution;
use crate::math::{DVec3, Vec3};

/// f(x) = Σ wᵢ φ(|x − cᵢ|) + p(x), in units of the box.
#[derive(Clone, Debug)]
pub struct Field {
    table: KernelTable,
    terms: Vec<(DVec3, f64)>,
    coefficients: Vec<f64>,
}

impl Field {
    /// The function of a solution over its centres.
    pub fn new(table: KernelTable, centres: &[Vec3], solution: &Solution) -> Self {
        let terms = centres.iter().zip(&solution.weights).map(|(c, &w)| (c.as_dvec3(), w)).collect();
        Self { table, terms, coefficients: solution.coefficients.clone() }
    }

    /// f at `p`.
    pub fn value(&self, p: DVec3) -> f64 {
        self.terms.iter().map(|term| self.term(term, p)).sum::<f64>() + self.polynomial(p)
    }

    /// f and ∇f at `p`.
    pub fn value_and_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let (mut sum, mut gradient) = (self.polynomial(p), self.slopes());
        for term in &self.terms {
            let (value, slope) = self.term_and_gradient(term, p);
            sum += value;
            gradient += slope;
        }
        (sum, gradient)
    }

    /// The centres and their weights.
    pub fn terms(&self) -> &[(DVec3, f64)] {
        &self.terms
    }

    /// The kernel.
    pub fn table(&self) -> &KernelTable {
        &self.table
    }

    /// One term at `p`.
    #[inline]
    pub fn term(&self, (centre, weight): &(DVec3, f64), p: DVec3) -> f64 {
        weight * self.table.value(p.distance_squared(*centre))
    }

    /// One term and its gradient at `p`.
    #[inline]
    pub fn term_and_gradient(&self, (centre, weight): &(DVec3, f64), p: DVec3) -> (f64, DVec3) {
        let away = p - *centre;
        let [value, slope] = self.table.value_and_slope(away.length_squared());
        (weight * value, away * (2.0 * weight * slope))
    }

    /// The polynomial at `p`.
    pub fn polynomial(&self, p: DVec3) -> f64 {
        self.coefficients[0] + self.slopes().dot(p)
    }

    /// The gradient of the polynomial.
    pub fn slopes(&self) -> DVec3 {
        if let [_, x, y, z] = self.coefficients[..] { DVec3::new(x, y, z) } else { DVec3::ZERO }
    }
}
