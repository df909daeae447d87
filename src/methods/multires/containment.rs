//! Tests which control ellipsoids have their centre inside a closed surface, such as the membrane.

use super::ellipsoid::Ellipsoid;
use crate::math::triangle::Line;
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;

/// Returns for each ellipsoid whether its centre is inside the closed mesh, by the parity of the hits of a ray from it.
/// Used to detect a membrane that has slipped off an ellipsoid, and to decide where a new ellipsoid starts.
pub(super) fn contains_centres(mesh: &Mesh, ellipsoids: &[Ellipsoid]) -> Vec<bool> {
    let centres: Vec<[f32; 2]> = ellipsoids.iter().map(|e| project_along_ray(e.center.as_vec3())).collect();
    let projected: Vec<[f32; 2]> = mesh.positions().iter().map(|&p| project_along_ray(p)).collect();
    let rays: Vec<Line> = ellipsoids.iter().map(|e| Line::new(e.center, RAY)).collect();
    let mut inside = vec![false; ellipsoids.len()];
    for corners in mesh.triangles() {
        let projected_corners = corners.map(|v| projected[v.index()]);
        for (k, centre) in centres.iter().enumerate() {
            if may_cover(&projected_corners, centre) {
                inside[k] ^= rays[k].hit(mesh.facet(corners).points).is_some_and(|hit| hit.distance >= 0.0);
            }
        }
    }
    inside
}

/// The direction of the rays in [`contains_centres`], not normalised. A ray along it seldom hits an edge of a regular
/// mesh, which would count as two hits.
const RAY: DVec3 = DVec3::new(0.5772, 0.6929, 0.4318);

/// Two directions perpendicular to [`RAY`], along which [`project_along_ray`] gives coordinates.
const ACROSS: [Vec3; 2] = [Vec3::new(-0.6929, 0.5772, 0.0), Vec3::new(-0.2492, -0.2992, 0.8132)];

/// Projects a point along [`RAY`] to two coordinates, for the quick test of [`may_cover`].
fn project_along_ray(p: Vec3) -> [f32; 2] {
    ACROSS.map(|axis| axis.dot(p))
}

/// Returns whether the bounding box of a projected triangle contains a projected point, up to rounding; if not, the ray
/// from the point misses the triangle.
fn may_cover(corners: &[[f32; 2]; 3], point: &[f32; 2]) -> bool {
    (0..2).all(|k| {
        let [a, b, c] = corners.map(|corner| corner[k]);
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        let rounding = ROUNDING * (least.abs() + most.abs() + point[k].abs());
        least - rounding <= point[k] && point[k] <= most + rounding
    })
}

const ROUNDING: f32 = 1e-5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::methods::multires::ControlEllipsoid;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn centres_in_a_ball_are_contained() {
        let mesh = Mesh::icosphere(Vec3::new(50.0, 0.0, 0.0), 1.0, 0.1).unwrap();
        let mut random = Random::new(3);
        let centres: Vec<[f64; 3]> =
            (0..400).map(|_| [50.0 + 4.0 * random.unit() - 2.0, 4.0 * random.unit() - 2.0, 0.0]).collect();
        let tiny = |&center: &[f64; 3]| ControlEllipsoid {
            center,
            axes: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]],
        };
        let ellipsoids: Vec<Ellipsoid> = centres.iter().map(|at| Ellipsoid::new(&tiny(at))).collect();
        let far = |e: &Ellipsoid| (e.center.distance(DVec3::new(50.0, 0.0, 0.0)) - 1.0).abs() > 0.01;
        for (e, is_contained) in
            ellipsoids.iter().zip(contains_centres(&mesh, &ellipsoids)).filter(|(e, _)| far(e))
        {
            assert_eq!(is_contained, e.center.distance(DVec3::new(50.0, 0.0, 0.0)) < 1.0, "{}", e.center);
        }
    }

    #[test]
    fn the_directions_are_across_the_ray() {
        assert!(ACROSS.iter().all(|axis| axis.as_dvec3().dot(RAY).abs() < 1e-4));
        assert!(ACROSS[0].dot(ACROSS[1]).abs() < 1e-3);
    }
}
