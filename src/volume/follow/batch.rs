//! Points whose values are needed next, evaluated piece by piece.

use crate::math::DVec3;

/// Points, and the values of the first of them.
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

    /// Adds points, in an order that keeps near ones together.
    pub fn extend(&mut self, points: impl IntoIterator<Item = DVec3>) {
        self.points.extend(points);
    }

    /// Evaluates the next `most` points at most; gives back how many.
    pub fn evaluate(&mut self, most: usize, f: &mut dyn FnMut(&[DVec3], &mut [f64])) -> usize {
        let done = self.values.len();
        let count = most.min(self.points.len() - done);
        if count > 0 {
            // A value that the function leaves out is not a number, and so outside.
            self.values.resize(done + count, f64::NAN);
            f(&self.points[done..done + count], &mut self.values[done..]);
        }
        count
    }

    /// The share of the points that is evaluated.
    pub fn progress(&self) -> f64 {
        if self.points.is_empty() { 0.0 } else { self.values.len() as f64 / self.points.len() as f64 }
    }

    /// The values, in the order of the points, once all are there.
    pub fn values(&self) -> Option<&[f64]> {
        (self.values.len() == self.points.len()).then_some(&self.values)
    }
}
