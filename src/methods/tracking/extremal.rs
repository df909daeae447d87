//! The weighted least-squares plane through the boundary points around a position (section 3 of the paper that
//! `tracking` follows), in space or in space-time.

use super::samples::Sums;
use crate::math::{DVec3, symmetric};

/// A least-squares plane through the boundary points around a position, in space or in space-time; a surface point is
/// projected onto it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaneFit {
    /// The spatial part of the normal of the fitted plane, of unit length together with `along_time`; its sign is
    /// arbitrary.
    pub normal: DVec3,
    /// The temporal component of the normal of the fitted plane, with time measured as a length, c·t; 0 for a plane in
    /// space.
    pub along_time: f64,
    /// Signed distance from the position around which it was fitted to the plane, in world units, positive if the plane
    /// is on the side that the normal points to.
    pub distance: f64,
    /// Total weight of the points to which the plane was fitted.
    pub weight: f64,
}

/// Smallest total weight of points that a plane is fitted to; with less, there is no fit.
const MIN_WEIGHT: f64 = 1e-3;

/// Largest ratio of the points' variance in time to their variance in space at which a plane is fitted in space only,
/// as they are of a single frame.
const MIN_TIME_SPREAD: f64 = 1e-6;

/// Fits a plane in space to the boundary points summed in `sums`: its normal is the direction of least variance. `None`
/// if there are too few points.
pub(super) fn plane(sums: &Sums) -> Option<PlaneFit> {
    let [mean, covariance] = mean_and_covariance(sums)?;
    let [xx, xy, xz, _, yy, yz, _, zz, ..] = covariance;
    let normal = DVec3::from(symmetric::least_eigenvector([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]));
    let distance = normal.dot(DVec3::new(mean[0], mean[1], mean[2]));
    Some(PlaneFit { normal, along_time: 0.0, distance, weight: sums.weight })
}

/// Fits a hyperplane in space-time to the boundary points summed in `sums`, or a plane in space if all points are of a
/// single time. `None` if there are too few points.
pub(super) fn hyperplane(sums: &Sums) -> Option<PlaneFit> {
    let [mean, c] = mean_and_covariance(sums)?;
    // All points are of a single moment: in space-time every hyperplane through their plane would fit.
    if c[9] <= MIN_TIME_SPREAD * (c[0] + c[4] + c[7]) {
        return plane(sums);
    }
    let matrix = [
        [c[0], c[1], c[2], c[3]],
        [c[1], c[4], c[5], c[6]],
        [c[2], c[5], c[7], c[8]],
        [c[3], c[6], c[8], c[9]],
    ];
    let n = symmetric::least_eigenvector(matrix);
    let distance = (0..4).map(|k| n[k] * mean[k]).sum();
    Some(PlaneFit { normal: DVec3::new(n[0], n[1], n[2]), along_time: n[3], distance, weight: sums.weight })
}

/// Returns the mean of the points summed in `sums`, in the first four numbers, and their covariance, with products in
/// the order of [`Sums::second`]; `None` if there are too few points.
fn mean_and_covariance(sums: &Sums) -> Option<[[f64; 10]; 2]> {
    if sums.weight < MIN_WEIGHT {
        return None;
    }
    let mut mean = [0.0; 10];
    for (k, first) in sums.first.iter().enumerate() {
        mean[k] = first / sums.weight;
    }
    let mut covariance = [0.0; 10];
    let mut pairs = (0..4).flat_map(|i| (i..4).map(move |j| (i, j)));
    for (k, second) in sums.second.iter().enumerate() {
        let (i, j) = pairs.next()?;
        covariance[k] = second / sums.weight - mean[i] * mean[j];
    }
    Some([mean, covariance])
}
