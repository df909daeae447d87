//! Choices of an implicit surface from its points: λ and δ by their density and noise, where the parameters are `auto`,
//! and constraints on both sides of the surface.
//!
//! Points outside alone, as in the paper, hold f near −1 on one side and leave it flat on the other: where noise needs a
//! large λ, the surface recedes. Pairs of points on both sides give f a slope.

mod off_surface;
mod quadric_fit;
mod winding;

pub use off_surface::{OffSurface, OffSurfaceSearch};

use super::params::Sides;
use super::solve::crowding;
use crate::math::order::median;
use crate::math::{Vec3, lower};
use quadric_fit::{NEIGHBOURS, QuadricFit, fitting_grid};
use serde::Serialize;
use std::f64::consts::PI;

/// Largest number of points at which quadrics are fitted to measure noise and density.
const TRIALS: usize = 300;
/// Number of points below which noise looks like shape.
const FEW_POINTS: usize = 100;
/// Number of points below which λ is that of surfaces with large gaps, [`SPARSE_LENGTH`].
const SPARSE_POINTS: usize = 200;
/// Length that λ damps for few points, in units of the normalised box.
const SPARSE_LENGTH: f64 = 0.1;
/// Length that λ damps, in distances between points, and in addition in units of the noise. Exact points would be interpolated
/// with a length of 0, but noise is not measured that exactly.
const LENGTH: [f64; 2] = [0.25, 0.95];
/// Deviation of fits to many points, relative to that of fits to few, from which the former reach across walls, and the least
/// difference of the two in distances between points: beside edges it is less.
const ACROSS_WALLS: f64 = 1.5;
const LEAST_ACROSS: f64 = 0.2;
/// Factors of the length and of δ then: with more, both sides of a wall are pulled into it.
const LENGTH_OF_WALLS: f64 = 0.9;
const SMOOTHNESS_OF_WALLS: f64 = 0.5;
/// λ of constraints off the surface, relative to that of those on it, and the largest. They are soft, so that wrong ones
/// yield.
const SOFTNESS: [f64; 2] = [300.0, 2.0];
/// δ for each point along a unit of length, and the largest: with more, gaps between few points are not closed.
const SMOOTHNESS: [f64; 2] = [0.3, 5.0];

/// Measures of the points of an implicit surface, and the values chosen by them for parameters that are `auto`; in units of
/// the normalised box, in which the longest side of the points' bounding box is 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Choice {
    /// Estimated noise of the points: their standard deviation from the surface along its normal; 0 for fewer than a hundred
    /// points.
    pub noise: f64,
    /// Number of points on a unit of area.
    pub density: f64,
    /// λ of constraints on the surface, as it would be given: it is multiplied for more than 3,000 points.
    pub lambda_surface: f64,
    /// λ of constraints off it.
    pub lambda_exterior: f64,
    /// First-order smoothness δ.
    pub delta: f64,
    /// The sides of the surface that have constraints; `None` until they are chosen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sides: Option<Sides>,
}

impl Choice {
    /// Measures points whose mean distance to the nearest neighbour is `spacing`, and chooses.
    pub fn of(points: &[Vec3], spacing: f64) -> Self {
        let grid = fitting_grid(points, spacing);
        let step = points.len().div_ceil(TRIALS);
        let [wide, narrow] = NEIGHBOURS.map(|count| {
            let some = points.iter().step_by(step);
            some.filter_map(|&p| QuadricFit::around(&grid, p, count)).collect::<Vec<_>>()
        });
        let deviation = |fits: &[QuadricFit]| median(fits.iter().map(|fit| fit.deviation)).unwrap_or(0.0);
        // With few points, quadrics follow details; with more, the estimate is more exact.
        let noise = if points.len() < FEW_POINTS { 0.0 } else { lower(deviation(&wide), deviation(&narrow)) };
        let reach = f64::from(median(wide.iter().map(|fit| fit.radius)).unwrap_or(2.0));
        let within = NEIGHBOURS[0].min(points.len()) as f64;
        let density = within / (PI * reach * reach);
        let [many, few] = [&wide, &narrow].map(|fits| f64::from(deviation(fits)));
        let has_walls = many > ACROSS_WALLS * few && (many - few) * density.sqrt() > LEAST_ACROSS;
        Self::from_measures(points.len(), density, f64::from(noise), has_walls)
    }

    /// Chooses for a number of points with a density and noise; `has_walls` says whether walls are about as thin as the points
    /// are apart.
    ///
    /// A wave of wave number k on the surface is damped by 1 / (1 + 4 k³ λ / density): λ is such that this is ½ for a
    /// wave number that is the inverse of a length.
    fn from_measures(count: usize, density: f64, noise: f64, has_walls: bool) -> Self {
        let [shorter, less] = if has_walls { [LENGTH_OF_WALLS, SMOOTHNESS_OF_WALLS] } else { [1.0; 2] };
        let length = if count < SPARSE_POINTS {
            SPARSE_LENGTH
        } else {
            shorter * (LENGTH[0] / density.sqrt() + LENGTH[1] * noise)
        };
        let lambda_surface = length * length * length * density / 4.0;
        let bounded = |value: f64, most: f64| if value < most { value } else { most };
        Self {
            noise,
            density,
            lambda_surface: lambda_surface / crowding(count),
            lambda_exterior: bounded(SOFTNESS[0] * lambda_surface, SOFTNESS[1]),
            delta: less * bounded(SMOOTHNESS[0] * density.sqrt(), SMOOTHNESS[1]),
            sides: None,
        }
    }
}
