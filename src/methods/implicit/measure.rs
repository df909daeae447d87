//! How well a surface fits its points (paper, section VI-C).

use crate::math::Vec3;
use crate::mesh::{TriangleMesh, curvature};
use crate::methods::MethodError;
use crate::spatial::TriangleTree;
use serde::Serialize;

/// Distances of points from a surface, in their units, and how curved it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Fitness {
    /// The mean distance.
    pub mean: f64,
    /// The root of the mean squared distance.
    pub rms: f64,
    /// The largest distance.
    pub max: f64,
    /// The mean of |H| over the vertices, per unit.
    pub mean_curvature: f64,
}

impl Fitness {
    /// Of `points` to `surface`.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] where the surface is empty.
    pub fn of(points: &[Vec3], surface: &TriangleMesh) -> Result<Self, MethodError> {
        let tree = TriangleTree::new(surface)?;
        let distances: Vec<f64> =
            points.iter().filter_map(|&p| tree.closest(p)).map(|hit| hit.distance).collect();
        if distances.is_empty() {
            return Err(MethodError::invalid("fitness", "there is no surface yet: step to the end first"));
        }
        let count = distances.len() as f64;
        let curvatures = curvature(surface).mean;
        Ok(Self {
            mean: distances.iter().sum::<f64>() / count,
            rms: (distances.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
            max: distances.iter().copied().fold(0.0, f64::max),
            mean_curvature: curvatures.iter().map(|h| h.abs()).sum::<f64>() / curvatures.len() as f64,
        })
    }
}
