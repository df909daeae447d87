//! The plane that fits the points around a place best (section 3): weighted least squares, in space or in space-time.

use super::samples::Sums;
use crate::math::{DVec3, symmetric};

/// A plane through the points around a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    /// Of length 1 in space and, with the next, in space-time. Which of the two sides it points to means nothing.
    pub normal: DVec3,
    /// Along time, in c frames.
    pub along_time: f64,
    /// From the place to the plane, along the normal.
    pub distance: f64,
    /// The weight of the points, all together.
    pub weight: f64,
}

/// Points that weigh less than this, all together, are none.
const LEAST_WEIGHT: f64 = 1e-3;

/// Points spread over time by less than this share of what they do in space are of one moment.
const LEAST_DURATION: f64 = 1e-6;

/// In space: n is the direction in which the points spread least.
pub(super) fn plane(sums: &Sums) -> Option<Fit> {
    let [mean, covariance] = moments(sums)?;
    let [xx, xy, xz, _, yy, yz, _, zz, ..] = covariance;
    let normal = DVec3::from(symmetric::least([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]));
    let distance = normal.dot(DVec3::new(mean[0], mean[1], mean[2]));
    Some(Fit { normal, along_time: 0.0, distance, weight: sums.weight })
}

/// In space-time.
pub(super) fn hyperplane(sums: &Sums) -> Option<Fit> {
    let [mean, c] = moments(sums)?;
    // Of a single moment: in space-time all planes of that moment would fit, in space there is one.
    if c[9] <= LEAST_DURATION * (c[0] + c[4] + c[7]) {
        return plane(sums);
    }
    let matrix = [
        [c[0], c[1], c[2], c[3]],
        [c[1], c[4], c[5], c[6]],
        [c[2], c[5], c[7], c[8]],
        [c[3], c[6], c[8], c[9]],
    ];
    let n = symmetric::least(matrix);
    let distance = (0..4).map(|k| n[k] * mean[k]).sum();
    Some(Fit { normal: DVec3::new(n[0], n[1], n[2]), along_time: n[3], distance, weight: sums.weight })
}

/// Mean and covariance; those of mean products in the order of the sums. Where there are points.
fn moments(sums: &Sums) -> Option<[[f64; 10]; 2]> {
    if sums.weight < LEAST_WEIGHT {
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
