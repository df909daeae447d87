//! The choice of the sides of the surface that have constraints, where inside and outside are ambiguous: the surface is made
//! coarsely in both ways, and that to which the points are nearer is taken.
//!
//! On walls and gaps about as thin as the spacing of the points, pairs of points on both sides can be wrong in whole regions,
//! and the surface leaves the points there. Constraints outside alone are fewer, and yield.

use super::cloud::BoxMap;
use super::edits::PointEdits;
use super::exterior::Exterior;
use super::extract::{Extraction, default_cell};
use super::kernel::Kernel;
use super::measure::rms_distance;
use super::params::{ImplicitParams, Sides};
use super::sampling::Samples;
use super::solve::{Constraints, Solver};
use super::{SEED, Solved};
use crate::pauses::{Computation, Pauses, advance};
use std::task::Poll;

/// Root mean square distance of the points from the surface with constraints outside only, relative to that with both sides,
/// below which the former is taken.
const BETTER: f64 = 0.9;
/// Tolerance of the solver in a trial: errors are far below differences between the surfaces.
const TOLERANCE: f64 = 1e-3;
/// Edge length of an extraction cell in a trial, in default ones.
const COARSER: f64 = 2.0;
/// Largest number of points whose distances are measured.
const MEASURED: usize = 4000;

/// A trial of constraints on both sides, and then of those outside only, with default parameters and without edits, so that
/// the choice depends on the points alone.
pub struct SidesTrial {
    map: BoxMap,
    both: Exterior,
    outside: Exterior,
    /// Distance of the points from the surface with both sides, once it is known.
    distance: Option<f64>,
    attempt: Attempt,
}

/// A surface that is being made.
enum Attempt {
    Solve(Box<Solver>, Constraints),
    Extract(Box<Extraction>),
    /// Measures its distance from the points.
    Measure(Computation<f64>),
    /// Its distance from the points; infinite without a surface.
    Done(f64),
}

impl SidesTrial {
    /// Starts for `samples`, in the normalised box of `map`, with the points off the surface of both ways.
    pub fn new(samples: &Samples, map: BoxMap, both: Exterior, outside: Exterior) -> Self {
        let attempt = Attempt::new(samples, &both, &map);
        Self { map, both, outside, distance: None, attempt }
    }

    /// Continues by a slice of about ten milliseconds; returns the choice once it is made, with its points off the surface.
    pub fn advance(&mut self, samples: &Samples) -> Option<(Sides, Exterior)> {
        let attempt = std::mem::replace(&mut self.attempt, Attempt::Done(f64::INFINITY));
        self.attempt = attempt.advanced(samples, &self.map);
        let Attempt::Done(distance) = self.attempt else { return None };
        let Some(with_both) = self.distance else {
            self.distance = Some(distance);
            self.attempt = Attempt::new(samples, &self.outside, &self.map);
            return None;
        };
        Some(if distance < BETTER * with_both {
            (Sides::Outside, self.outside.clone())
        } else {
            (Sides::Both, self.both.clone())
        })
    }

    /// Returns the share that is done.
    pub fn progress(&self) -> f64 {
        0.5 * (f64::from(u8::from(self.distance.is_some())) + self.attempt.progress())
    }
}

impl Attempt {
    fn new(samples: &Samples, exterior: &Exterior, map: &BoxMap) -> Self {
        let Ok(mut constraints) = PointEdits::default().constraints(samples, exterior, &[], map) else {
            return Self::Done(f64::INFINITY);
        };
        let choice = &samples.choice;
        constraints.regularize(choice.lambda_surface, choice.lambda_exterior);
        let kernel = Kernel::new(&ImplicitParams::default(), choice.delta, constraints.radius());
        Self::Solve(Box::new(Solver::new(&constraints, kernel, TOLERANCE, SEED)), constraints)
    }

    fn advanced(self, samples: &Samples, map: &BoxMap) -> Self {
        let next = match self {
            Self::Solve(mut solver, constraints) => match solver.advance() {
                Ok(true) => Self::extraction(&solver, &constraints, samples, map),
                Ok(false) => Some(Self::Solve(solver, constraints)),
                Err(_) => None,
            },
            Self::Extract(mut extraction) => match extraction.advance() {
                Ok(None) => Some(Self::Extract(extraction)),
                Ok(Some(mesh)) => {
                    let step = samples.cloud.len().div_ceil(MEASURED);
                    let points = map.all_in_world(samples.cloud.points.iter().step_by(step));
                    Some(Self::Measure(Box::pin(rms_distance(points, mesh, Pauses::default()))))
                }
                Err(_) => None,
            },
            Self::Measure(mut distance) => match advance(&mut distance) {
                Poll::Ready(distance) => Some(Self::Done(distance)),
                Poll::Pending => Some(Self::Measure(distance)),
            },
            done @ Self::Done(_) => Some(done),
        };
        next.unwrap_or(Self::Done(f64::INFINITY))
    }

    fn extraction(
        solver: &Solver,
        constraints: &Constraints,
        samples: &Samples,
        map: &BoxMap,
    ) -> Option<Self> {
        let solved = Solved::new(solver.kernel(), constraints.centres.clone(), solver.solution()?, 0.0);
        let points = map.all_in_world(&samples.cloud.points);
        let cell = COARSER * default_cell(map, samples.spacing);
        let extraction = Extraction::new(&solved.field, *map, 0.0, &points, cell, false, usize::MAX).ok()?;
        Some(Self::Extract(Box::new(extraction)))
    }

    fn progress(&self) -> f64 {
        match self {
            Self::Solve(..) => 0.0,
            Self::Extract(extraction) => 0.5 + 0.5 * extraction.progress(),
            Self::Measure(_) | Self::Done(_) => 1.0,
        }
    }
}
