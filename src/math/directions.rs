//! Directions spread evenly.

use super::DVec3;
use std::f64::consts::PI;

/// Returns `count` unit vectors spread evenly along a spiral on a sphere.
pub fn spread_directions(count: usize) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (across, angle) = ((1.0 - z * z).sqrt(), golden * i as f64);
        DVec3::new(across * libm::cos(angle), across * libm::sin(angle), z)
    })
}
