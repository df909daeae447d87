//! Texture coordinates of the deformed surface, taken from the corresponding points of the finest surface of the
//! decomposition; seams are respected (Kobbelt, Bareuther & Seidel, section 7).

use super::correspondence::{BasePoint, Correspondence};
use crate::math::{Vec2, Vec3};
use crate::mesh::{Mesh, TriangleMesh, VertexId};
use crate::spatial::SurfaceWalker;

/// A triangle of the deformed surface is taken to cross a texture seam if its texture coordinates are farther apart
/// than this multiple of the distance that its size implies. With a smaller value, stretched texture is mistaken for a
/// seam; with a much larger one, narrow strips of the whole texture appear along it.
const SEAM_RATIO: f32 = 6.0;

/// Returns texture coordinates for the corners of each triangle of the deformed surface, in the order of
/// [`Mesh::triangles`]; `None` if the finest surface of the decomposition has none. `points` are the corresponding
/// points on the finest surface, by slot.
pub(super) fn corner_uvs(
    mesh: &Mesh,
    points: &Correspondence,
    finest: &SurfaceWalker,
) -> Option<Vec<[Vec2; 3]>> {
    let source = finest.mesh();
    if source.uvs.is_none() && source.corner_uvs.is_none() {
        return None;
    }
    Some(mesh.triangles().map(|corners| triangle_corner_uvs(corners, points, finest)).collect())
}

fn triangle_corner_uvs(corners: [VertexId; 3], points: &Correspondence, finest: &SurfaceWalker) -> [Vec2; 3] {
    let at = corners.map(|v| points[v.index()]);
    let own = at.map(|at| uv_at(finest.mesh(), &at));
    let [a, b, c] = own;
    let spread = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let [p, q, r] = at.map(|at| at.point);
    let size = p.distance(q).max(q.distance(r)).max(r.distance(p));
    if spread <= SEAM_RATIO * size * density(finest, at[0].triangle) {
        return own;
    }
    // All three from one side of the seam, that of the centroid.
    let middle: BasePoint = finest.walk(at[0].triangle, (p + q + r) * (1.0 / 3.0)).into();
    at.map(|at| extrapolated_uv(finest, middle.triangle, at.point))
}

fn triangle_uvs(mesh: &TriangleMesh, triangle: u32) -> [Vec2; 3] {
    match (&mesh.corner_uvs, &mesh.uvs) {
        (Some(corners), _) => corners[triangle as usize],
        (None, Some(uvs)) => mesh.triangles[triangle as usize].map(|v| uvs[v as usize]),
        (None, None) => [Vec2::ZERO; 3],
    }
}

fn blend([a, b, c]: [Vec2; 3], weights: Vec3) -> Vec2 {
    a * weights.x + b * weights.y + c * weights.z
}

fn uv_at(mesh: &TriangleMesh, at: &BasePoint) -> Vec2 {
    blend(triangle_uvs(mesh, at.triangle), at.weights)
}

/// Returns the scale of the texture on a triangle of the finest surface: its longest edge in texture coordinates,
/// divided by its longest edge in space.
fn density(finest: &SurfaceWalker, triangle: u32) -> f32 {
    let [a, b, c] = triangle_uvs(finest.mesh(), triangle);
    let [p, q, r] = finest.corners(triangle);
    let in_texture = a.distance(b).max(b.distance(c)).max(c.distance(a));
    in_texture / p.distance(q).max(q.distance(r)).max(r.distance(p)).max(f32::MIN_POSITIVE)
}

/// Extrapolates the texture coordinates of a triangle of the finest surface to a point beside it, projected onto its
/// plane.
fn extrapolated_uv(finest: &SurfaceWalker, triangle: u32, p: Vec3) -> Vec2 {
    let [a, b, c] = finest.corners(triangle);
    let normal = (b - a).cross(c - a);
    let size = normal.length_squared();
    if size == 0.0 {
        return triangle_uvs(finest.mesh(), triangle)[0];
    }
    let v = normal.dot((p - a).cross(c - a)) / size;
    let w = normal.dot((b - a).cross(p - a)) / size;
    blend(triangle_uvs(finest.mesh(), triangle), Vec3::new(1.0 - v - w, v, w))
}
