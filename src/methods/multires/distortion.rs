//! How much the map T distorts: what the operator D is to keep low (section 3).

use super::link::Link;
use crate::math::{DVec3, triangle};
use crate::mesh::{Mesh, VertexId};

/// Distortion by vertex of the deformed base, in the order of its live slots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Area on the undeformed base over area on the deformed one, of the triangles around: 1 where it is kept.
    pub area: Vec<f64>,
    /// Longest over shortest stretch of directions, mean of the triangles around by their area: 1 where angles are kept.
    pub angle: Vec<f64>,
}

pub(super) fn distortion(mesh: &Mesh, link: &Link) -> Distortion {
    let slots = mesh.slots();
    let (mut before, mut after, mut stretch) = (vec![0.0; slots], vec![0.0; slots], vec![0.0; slots]);
    for corners in mesh.triangles() {
        let deformed = mesh.facet(corners).points;
        let original = corners.map(|v| link[v.index()].point);
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

/// The largest over the smallest singular value of the affine map from one triangle to another; at most [`MOST`].
fn anisotropy(from: [DVec3; 3], to: [DVec3; 3]) -> f64 {
    // In the plane of the first: one edge along x, so that the map of directions is a 3 × 2 matrix of columns p, q.
    let (edge, other) = (from[1] - from[0], from[2] - from[0]);
    let length = edge.length();
    let along = other.dot(edge) / length;
    let height = edge.cross(other).length() / length;
    let p = (to[1] - to[0]) / length;
    let q = (to[2] - to[0] - p * along) / height;
    let (mean, half) = (0.5 * (p.dot(p) + q.dot(q)), 0.5 * (p.dot(p) - q.dot(q)));
    let root = (half * half + p.dot(q) * p.dot(q)).sqrt();
    let ratio = ((mean + root) / (mean - root)).sqrt();
    // Of a triangle without area it is infinite, or no number.
    if ratio < MOST { ratio } else { MOST }
}

const MOST: f64 = 1e3;

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
        assert_eq!(anisotropy([o, x, y], [o, x, x * 2.0]), MOST);
        assert_eq!(anisotropy([o, x, x * 2.0], [o, x, y]), MOST);
    }
}
