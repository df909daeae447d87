//! Distortion of area and angles by the map T from the deformed base to the base M₀, which the operator D keeps low
//! (Kobbelt, Bareuther & Seidel, section 3).

use super::correspondence::Correspondence;
use crate::math::{DVec3, triangle};
use crate::mesh::{Mesh, VertexId};

/// Distortion of the map T from the deformed base to the base M₀: one value for each live vertex of the deformed base,
/// in slot order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Area of the adjacent triangles on the base M₀, divided by their area on the deformed base; 1 where area is
    /// preserved.
    pub area: Vec<f64>,
    /// Ratio of the largest to the smallest stretch of a triangle under T, at most 1000, as an area-weighted mean over
    /// the adjacent triangles; 1 where angles are preserved.
    pub angle: Vec<f64>,
}

pub(super) fn distortion(mesh: &Mesh, correspondence: &Correspondence) -> Distortion {
    let slots = mesh.slots();
    let (mut before, mut after, mut stretch) = (vec![0.0; slots], vec![0.0; slots], vec![0.0; slots]);
    for corners in mesh.triangles() {
        let deformed = mesh.facet(corners).points;
        let original = corners.map(|v| correspondence[v.index()].point);
        let area = triangle::area(deformed);
        let ratio = anisotropy(deformed.map(|p| p.as_dvec3()), original.map(|p| p.as_dvec3()));
        for v in corners {
            before[v.index()] += triangle::area(original);
            after[v.index()] += area;
            stretch[v.index()] += area * ratio;
        }
    }
    let per_vertex = |values: &[f64]| {
        mesh.vertices()
            .map(|v: VertexId| values[v.index()] / after[v.index()].max(f64::MIN_POSITIVE))
            .collect()
    };
    Distortion { area: per_vertex(&before), angle: per_vertex(&stretch) }
}

/// Returns the ratio of the larger to the smaller singular value of the affine map from one triangle to another, at
/// most [`MAX_ANISOTROPY`]; 1 for a similarity. It measures the distortion of angles.
fn anisotropy(from: [DVec3; 3], to: [DVec3; 3]) -> f64 {
    // In the plane of the first triangle, with one edge along x, the linear part is a 3 × 2 matrix with columns p and
    // q.
    let (edge, other) = (from[1] - from[0], from[2] - from[0]);
    let length = edge.length();
    let along = other.dot(edge) / length;
    let height = edge.cross(other).length() / length;
    let p = (to[1] - to[0]) / length;
    let q = (to[2] - to[0] - p * along) / height;
    let (mean, half) = (0.5 * (p.dot(p) + q.dot(q)), 0.5 * (p.dot(p) - q.dot(q)));
    let root = (half * half + p.dot(q) * p.dot(q)).sqrt();
    let ratio = ((mean + root) / (mean - root)).sqrt();
    // For a triangle without area the ratio is infinite or NaN.
    if ratio < MAX_ANISOTROPY { ratio } else { MAX_ANISOTROPY }
}

const MAX_ANISOTROPY: f64 = 1e3;

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn anisotropy_of_turned_stretched_and_flat_triangles() {
        let [o, x, y] = [DVec3::ZERO, DVec3::X, DVec3::new(0.3, 2.0, 0.0)];
        let turn = |p: DVec3| DVec3::new(0.0, p.x, p.y) * 3.0 + DVec3::ONE;
        assert!((anisotropy([o, x, y], [turn(o), turn(x), turn(y)]) - 1.0).abs() < 1e-9);
        let stretch = |p: DVec3| DVec3::new(p.x, 5.0 * p.y, 0.0);
        assert!((anisotropy([o, x, y], [stretch(o), stretch(x), stretch(y)]) - 5.0).abs() < 1e-9);
        assert_eq!(anisotropy([o, x, y], [o, x, x * 2.0]), MAX_ANISOTROPY);
        assert_eq!(anisotropy([o, x, x * 2.0], [o, x, y]), MAX_ANISOTROPY);
    }
}
