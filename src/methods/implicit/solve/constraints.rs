//! Constraints on the implicit function: centres, prescribed values and regularisation λ.

use super::Solution;
use crate::math::{Bounds, PositionIndex, Vec3};
use crate::methods::implicit::cloud::Cloud;

/// The constraints on the implicit function: its values at some centres, and how much each value may be missed.
#[derive(Clone, Debug, Default)]
pub struct Constraints {
    /// Positions of the constraints, in units of the normalised box, all distinct; those of surface constraints come
    /// first.
    pub centres: Vec<Vec3>,
    /// Prescribed value of the implicit function f at each centre: 0 on the surface, −1 outside, 1 inside.
    pub values: Vec<f64>,
    /// Regularisation λ of each constraint, at least 0: f differs from the prescribed value by λ times the weight of
    /// the kernel at this centre.
    pub lambda: Vec<f64>,
    /// Number of surface constraints, which come before the exterior ones in all lists.
    pub surface: usize,
    /// Confidence of each surface constraint, in (0, 1], by which its λ is divided; `None` means 1 for all.
    pub confidence: Option<Vec<f32>>,
}

impl Constraints {
    /// Creates constraints of value 0 at the points of `surface`, −1 at those `outside` and 1 at those `inside`; λ is 0
    /// until [`Self::regularize`].
    pub fn new(surface: &Cloud, outside: &[Vec3], inside: &[Vec3]) -> Self {
        let parts = [(&surface.points[..], 0.0), (outside, -1.0), (inside, 1.0)];
        let centres: Vec<Vec3> = parts.iter().flat_map(|(points, _)| points.iter().copied()).collect();
        Self {
            values: parts
                .iter()
                .flat_map(|&(points, value)| std::iter::repeat_n(value, points.len()))
                .collect(),
            lambda: vec![0.0; centres.len()],
            centres,
            surface: surface.len(),
            confidence: surface.confidence.clone(),
        }
    }

    /// Sets the regularisation λ: `surface` times [`crowding`] divided by the confidence for surface constraints,
    /// `off_surface` for all others.
    pub fn regularize(&mut self, surface: f64, off_surface: f64) {
        let surface = surface * crowding(self.surface);
        for (i, lambda) in self.lambda.iter_mut().enumerate() {
            let sure = self.confidence.as_ref().and_then(|all| all.get(i)).map_or(1.0, |&c| f64::from(c));
            *lambda = if i < self.surface { surface / sure } else { off_surface };
        }
    }

    /// Returns a centre that two constraints share, or `None` if all centres are distinct, as the linear system
    /// requires.
    pub fn shared_centre(&self) -> Option<Vec3> {
        let index = PositionIndex::new(&self.centres);
        let shared = index.distinct().find(|constraints| constraints.len() > 1);
        shared.and_then(|mut constraints| constraints.next()).map(|i| self.centres[i as usize])
    }

    /// Returns the radius of a ball that contains all centres, in units of the normalised box; some kernels depend on
    /// it.
    pub fn radius(&self) -> f64 {
        let bounds = Bounds::from_points(&self.centres);
        0.5 * f64::from(bounds.max.distance(bounds.min))
    }

    /// Returns the mean of the implicit function f over the surface constraints, one of the choices for the iso-value.
    /// At a constraint, f is the prescribed value minus λ times the weight.
    pub fn mean_on_surface(&self, solution: &Solution) -> f64 {
        let terms = self.lambda.iter().zip(&solution.weights).take(self.surface);
        -terms.map(|(lambda, w)| lambda * w).sum::<f64>() / self.surface as f64
    }
}

/// Returns the factor of the λ of `count` surface constraints: from 3,000 on, λ grows in proportion to their number, so that
/// more points give a better surface and not a rougher one.
pub fn crowding(count: usize) -> f64 {
    let crowd = count as f64 / USUAL_POINTS;
    if crowd > 1.0 { crowd } else { 1.0 }
}

/// Number of surface constraints for which the usual values of λ are meant (Dinh, Turk & Slabaugh, section VI-B); with
/// more constraints, λ is increased.
const USUAL_POINTS: f64 = 3000.0;
