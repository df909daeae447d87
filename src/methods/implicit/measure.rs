//! How well a surface fits its points (paper, section VI-C), and their colours on it.

use super::cloud::BoxMap;
use crate::math::Vec3;
use crate::mesh::{TriangleMesh, curvature};
use crate::methods::MethodError;
use crate::spatial::{PointGrid, TriangleTree};
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

/// Points whose colours a vertex takes.
const BLENDED: usize = 4;

/// The colour of each vertex: that of the nearest points, which count by the inverse of their squared distance.
pub fn colors_of_points(
    points: &[Vec3],
    colors: &[Vec3],
    spacing: f64,
    mesh: &TriangleMesh,
    map: &BoxMap,
) -> Vec<Vec3> {
    let reach = 2.0 * spacing as f32;
    let grid = PointGrid::of(points, reach);
    let color = |p: &Vec3| {
        let near = grid.nearest(map.in_box(*p), BLENDED, reach);
        // Half a spacing beside the distance: else each point makes a spot.
        let least = 0.25 * (spacing * spacing) as f32;
        let weights = near.iter().map(|(squared, i)| (1.0 / (squared + least), colors[*i as usize]));
        let (sum, total) = weights.fold((Vec3::ZERO, 0.0), |(sum, total), (w, c)| (sum + c * w, total + w));
        sum / total
    };
    mesh.positions.iter().map(color).collect()
}
