//! Fitness of a reconstructed surface: distances of the points from it, and its curvature (Dinh, Turk & Slabaugh,
//! section VI-C).

use crate::math::Vec3;
use crate::mesh::{TriangleMesh, curvature};
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::spatial::TriangleTree;
use serde::Serialize;

/// Units of work of a search for the closest point, which takes a millisecond in a surface of noise.
const QUERY: usize = 20;

/// How well a surface fits points: their distances from it, in the units of the points, and how curved the surface is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Fitness {
    /// Mean distance of the points from the surface, in their units.
    pub mean: f64,
    /// Root mean square distance of the points from the surface, in their units.
    pub rms: f64,
    /// Largest distance of a point from the surface, in the points' units.
    pub max: f64,
    /// Mean over the vertices of |H|, the absolute mean curvature of the surface, in inverse units of the points'
    /// coordinates.
    pub mean_curvature: f64,
}

/// Returns the root mean square distance of `points` from `surface`, infinite without a surface or points, and pauses
/// meanwhile.
pub async fn rms_distance(points: Vec<Vec3>, surface: TriangleMesh, pauses: Pauses) -> f64 {
    let Ok(tree) = TriangleTree::in_slices(&surface, &pauses).await else { return f64::INFINITY };
    let (mut sum, mut count) = (0.0, 0);
    for &p in &points {
        if let Some(hit) = tree.closest(p) {
            (sum, count) = (sum + hit.distance * hit.distance, count + 1);
        }
        pauses.after(QUERY).await;
    }
    if count > 0 { (sum / f64::from(count)).sqrt() } else { f64::INFINITY }
}

impl Fitness {
    /// Measures the distances of `points` from `surface`, and the mean curvature of `surface`.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the surface is empty or there are no points; an error of
    /// [`TriangleMesh::validate`] for an invalid surface.
    pub fn of(points: &[Vec3], surface: &TriangleMesh) -> Result<Self, MethodError> {
        let tree = TriangleTree::new(surface)?;
        let distances: Vec<f64> =
            points.iter().filter_map(|&p| tree.closest(p)).map(|hit| hit.distance).collect();
        if distances.is_empty() {
            return Err(MethodError::invalid(
                "fitness",
                "there is no surface yet; step until the run is done",
            ));
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
