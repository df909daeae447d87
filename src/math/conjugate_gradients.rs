//! Preconditioned conjugate gradients for sparse and structured linear systems.

use super::vectors::{add, dot};
use crate::pauses::{Pauses, finished};

/// The number of numbers in a vector that count as one unit of work between pauses.
const NUMBERS_PER_UNIT: usize = 2048;

/// The state of the conjugate gradient iteration for a linear system A x = b with a symmetric positive definite or
/// semidefinite matrix A, which is only needed as a function that multiplies by it.
#[derive(Clone, Debug)]
pub struct ConjugateGradients {
    solution: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    energy: f64,
}

impl ConjugateGradients {
    /// Starts the iteration from the given `solution` x with the `residual` b − A x. `precondition` multiplies a
    /// residual r by the preconditioner M, an approximate inverse of A; without one, it returns r. It may project r
    /// onto a subspace in which the iteration is to stay.
    pub fn new(
        solution: Vec<f64>,
        mut residual: Vec<f64>,
        precondition: impl FnOnce(&mut [f64]) -> Vec<f64>,
    ) -> Self {
        let direction = precondition(&mut residual);
        let energy = dot(&residual, &direction);
        Self { solution, residual, direction, energy }
    }

    /// Does one iteration, which improves the solution; `product` multiplies a vector by A, and `precondition` is that
    /// of [`Self::new`]. Returns false, without an improvement, if rounding prevents further progress.
    pub fn iterate(
        &mut self,
        product: impl FnOnce(&[f64]) -> Vec<f64>,
        precondition: impl FnOnce(&mut [f64]) -> Vec<f64>,
    ) -> bool {
        let image = product(&self.direction);
        finished(self.iterate_in_slices(image, precondition, &Pauses::default()))
    }

    /// Does one iteration as [`Self::iterate`] does, given the product of A and [`Self::direction`], and pauses meanwhile.
    pub async fn iterate_in_slices(
        &mut self,
        image: Vec<f64>,
        precondition: impl FnOnce(&mut [f64]) -> Vec<f64>,
        pauses: &Pauses,
    ) -> bool {
        let work = image.len() / NUMBERS_PER_UNIT;
        let curvature = dot(&self.direction, &image);
        if curvature <= 0.0 || self.energy <= 0.0 {
            return false;
        }
        let step = self.energy / curvature;
        pauses.after(work).await;
        add(step, &self.direction, &mut self.solution);
        pauses.after(work).await;
        add(-step, &image, &mut self.residual);
        drop(image);
        pauses.after(work).await;
        let preconditioned = precondition(&mut self.residual);
        pauses.after(work).await;
        let energy = dot(&self.residual, &preconditioned);
        pauses.after(work).await;
        let ratio = energy / self.energy;
        self.energy = energy;
        self.direction.iter_mut().zip(&preconditioned).for_each(|(d, z)| *d = z + ratio * *d);
        true
    }

    /// Returns the solution x found so far.
    pub fn solution(&self) -> &[f64] {
        &self.solution
    }

    /// Returns the direction in which the next iteration goes.
    pub fn direction(&self) -> &[f64] {
        &self.direction
    }

    /// Returns the solution x found so far, and ends the iteration.
    pub fn into_solution(self) -> Vec<f64> {
        self.solution
    }

    /// Returns the residual b − A x of the solution found so far, as updated by the iterations.
    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Returns the squared norm of the residual r in the norm of the preconditioner M: rᵀMr.
    pub fn energy(&self) -> f64 {
        self.energy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// A 1D Poisson equation with different weights along the diagonal.
    fn product(x: &[f64]) -> Vec<f64> {
        let at = |i: usize, k: usize| if i + k == 0 { 0.0 } else { x.get(i + k - 1).copied().unwrap_or(0.0) };
        (0..x.len()).map(|i| (2.0 + i as f64) * x[i] - at(i, 0) - at(i, 2)).collect()
    }

    #[test]
    fn a_system_of_n_rows_is_solved_in_n_iterations_and_sooner_with_a_preconditioner() {
        let expected: Vec<f64> = (0..30).map(|i| f64::from(i * 7 % 11) - 5.0).collect();
        let diagonal = |r: &mut [f64]| r.iter().enumerate().map(|(i, r)| r / (2.0 + i as f64)).collect();
        let none = |r: &mut [f64]| r.to_vec();
        let iterations = |precondition: &dyn Fn(&mut [f64]) -> Vec<f64>| {
            let mut gradients = ConjugateGradients::new(vec![0.0; 30], product(&expected), precondition);
            let enough = 1e-20 * gradients.energy();
            let count =
                (0..).take_while(|_| gradients.energy() > enough && gradients.iterate(product, precondition));
            let count = count.count();
            let off = gradients.solution().iter().zip(&expected).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-8);
            count
        };
        let (with, without) = (iterations(&diagonal), iterations(&none));
        assert!(with < without && without <= 31, "{with}, {without}");
    }

    #[test]
    fn a_solved_system_is_left_alone() {
        let mut gradients = ConjugateGradients::new(vec![1.0; 4], vec![0.0; 4], |r| r.to_vec());
        assert!(!gradients.iterate(product, |r| r.to_vec()));
        assert_eq!(gradients.into_solution(), [1.0; 4]);
    }
}
