//! Where an ellipsoid holds the surface around it, and how far from there the rest of the surface is.

use super::ellipsoid::Ellipsoid;
use crate::math::{DVec3, spread_directions};
use crate::spatial::{SurfacePoint, SurfaceWalker};

/// Number of directions in which the surface around an ellipsoid is searched for.
const DIRECTIONS: usize = 256;

/// Returns the vertices of a surface around an ellipsoid, each with a bound of its distance from the ellipsoid.
///
/// Rays from the centre, and on from the ellipsoid along its normals, find the wall around it, not a part behind. From
/// outside, where none hits, that is the closest point.
pub(super) fn gripped(ellipsoid: &Ellipsoid, surface: &SurfaceWalker) -> Vec<(u32, f64)> {
    let mut hits: Vec<(SurfacePoint, f64)> =
        spread_directions(DIRECTIONS).filter_map(|unit| first_hit(ellipsoid, surface, unit)).collect();
    if hits.is_empty() {
        let closest = surface.closest(ellipsoid.center.as_vec3());
        hits.extend(closest.map(|at| (at, ellipsoid.ray_distance(at.point.as_dvec3()))));
    }
    let corners = |(hit, away): &(SurfacePoint, f64)| {
        let (ids, points) = (surface.mesh().triangles[hit.triangle as usize], surface.corners(hit.triangle));
        let (point, away) = (hit.point, *away);
        [0, 1, 2].map(|k| (ids[k], away + f64::from(points[k].distance(point))))
    };
    hits.iter().flat_map(corners).collect()
}

/// Returns where a ray from the centre through the point `unit` of the ellipsoid, given in the frame in which it is the
/// unit ball, hits the surface, and how far from the ellipsoid; beyond it, the ray goes on along its normal.
fn first_hit(ellipsoid: &Ellipsoid, surface: &SurfaceWalker, unit: DVec3) -> Option<(SurfacePoint, f64)> {
    let (centre, on) = (ellipsoid.center, ellipsoid.at_unit(unit));
    let inner = surface.tree().ray_hit(centre.as_vec3(), (on - centre).as_vec3());
    if let Some(hit) = inner.filter(|hit| hit.distance <= on.distance(centre)) {
        return Some((hit, 0.0));
    }
    let normal = ellipsoid.rotation * (unit / ellipsoid.lengths);
    let outer = surface.tree().ray_hit(on.as_vec3(), normal.normalize_or_zero().as_vec3())?;
    Some((outer, outer.distance))
}
