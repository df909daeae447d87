//! A batch of points at which the surface extractor needs values of its function next, evaluated in parts so that each
//! slice of work keeps to its budget.

use crate::math::DVec3;

/// Points at which the surface extractor's function is to be evaluated, and the values at the first of them, evaluated
/// so far.
#[derive(Default)]
pub(super) struct Batch {
    points: Vec<DVec3>,
    values: Vec<f64>,
}

impl Batch {
    pub fn clear(&mut self) {
        self.points.clear();
        self.values.clear();
    }

    /// Appends points, in an order in which points near each other in space follow each other.
    pub fn extend(&mut self, points: impl IntoIterator<Item = DVec3>) {
        self.points.extend(points);
    }

    /// Evaluates `f` at the next points of the batch, at most `most` of them; returns how many were evaluated.
    pub fn evaluate(&mut self, most: usize, f: &mut dyn FnMut(&[DVec3], &mut [f64])) -> usize {
        let done = self.values.len();
        let count = most.min(self.points.len() - done);
        if count > 0 {
            // A value that the function does not write is NaN, hence outside.
            self.values.resize(done + count, f64::NAN);
            f(&self.points[done..done + count], &mut self.values[done..]);
        }
        count
    }

    /// Returns the share of the points of the batch that are evaluated; 0 if it is empty.
    pub fn progress(&self) -> f64 {
        if self.points.is_empty() { 0.0 } else { self.values.len() as f64 / self.points.len() as f64 }
    }

    /// Returns the values, in the order of the points, or `None` while some are missing.
    pub fn values(&self) -> Option<&[f64]> {
        (self.values.len() == self.points.len()).then_some(&self.values)
    }
}
