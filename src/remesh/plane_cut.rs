//! Cutting a closed mesh by a plane. The cross-section is triangulated and closes the part that is kept.

use crate::math::predicates::{collinear, in_circle};
use crate::math::{Bounds, DVec2, DVec3, Vec3, triangulate};
use crate::mesh::{Mesh, MeshError, OppositeVertices, TriangleMesh, VertexId, intersect_anywhere};
use crate::pauses::{Pauses, finished};
use crate::spatial::lone_corner;
use std::collections::BTreeMap;

/// The number of positions of the plane at which no vertex is: all, and those that are tried at least in large meshes; the
/// most triangles that are cut in all attempts beyond these; and the number of other positions that are tried.
const ATTEMPTS: usize = 24;
const LEAST_ATTEMPTS: usize = 2;
const TRIANGLES_CUT: usize = 500_000;
const OTHER_ATTEMPTS: usize = 2;

/// The least distance of vertices from the plane, relative to the largest coordinate: 16 units in the last place.
/// Triangles cut nearer to a corner than some of these may degenerate when positions are rounded; with more, few
/// positions of the plane are far enough from all vertices of a large mesh.
const MARGIN: f64 = 16.0 * f32::EPSILON as f64;

/// A plane: all points `p` with `normal · (p − origin) = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point on the plane.
    pub origin: DVec3,
    /// Normal of the plane, of any length above 0.
    pub normal: DVec3,
}

/// Cuts the mesh by a plane and closes it along the plane. The part on the side away from the normal is kept, and the
/// new triangles face along the normal.
///
/// The mesh stays closed and oriented, and no self-intersections are added, which is tested exactly. The triangles on
/// the plane are a constrained Delaunay triangulation of the cross-section. To keep vertices off the plane, it is moved
/// by less than 10⁻⁴ of the largest coordinate. Nothing changes if all of the mesh is on the side that is kept.
/// Vertices are renumbered, and attributes are removed.
///
/// # Errors
/// [`MeshError::InvalidArgument`] if the plane is not finite or its normal is 0, or nothing would be left;
/// [`MeshError::CannotCut`] if the mesh intersects itself at the plane, sheets are too near each other there, or a component is
/// inside another that faces the same way. The
/// mesh is then unchanged.
pub fn cut_by_plane(mesh: &mut Mesh, plane: Plane) -> Result<(), MeshError> {
    finished(cut_by_plane_in_slices(mesh, plane, &Pauses::default()))
}

/// Cuts a mesh as [`cut_by_plane`] does, with pauses. If it is dropped at one of them, the mesh is unchanged.
///
/// # Errors
/// As [`cut_by_plane`].
pub async fn cut_by_plane_in_slices(mesh: &mut Mesh, plane: Plane, pauses: &Pauses) -> Result<(), MeshError> {
    let heights = plane.heights(mesh)?;
    let present = || mesh.vertices().map(|v| heights[v.index()]);
    if present().all(|height| height <= 0.0) {
        return Ok(());
    }
    if present().all(|height| height >= 0.0) {
        let problem = "the plane leaves nothing of the mesh, which is on the side of the normal".to_owned();
        return Err(MeshError::InvalidArgument { parameter: "plane", problem });
    }
    let largest = mesh.vertices().map(|v| mesh.position(v).abs().max_element()).fold(0.0, f32::max);
    let margin = MARGIN * f64::from(largest);
    let is_clear = |offset: &f64| present().all(|height| (height - offset).abs() >= margin);
    let (clear, others): (Vec<f64>, Vec<f64>) = offsets(margin).partition(is_clear);
    pauses.now().await;
    // Most cuts of large meshes that fail do so since these intersect themselves.
    let attempts = (TRIANGLES_CUT / mesh.triangle_count().max(1)).clamp(LEAST_ATTEMPTS, ATTEMPTS);
    // In a very fine mesh no position is clear; then those near the given one may do as well.
    let others = others.into_iter().take(OTHER_ATTEMPTS);
    for offset in clear.into_iter().take(attempts).chain(others) {
        let heights: Vec<f64> = heights.iter().map(|height| height - offset).collect();
        if let Some(cut) = cut_at(mesh, &heights, plane.normal, pauses).await {
            let replaced = std::mem::replace(mesh, cut);
            mesh.advance_versions_past(&replaced);
            return Ok(());
        }
    }
    Err(MeshError::CannotCut)
}

/// Returns the displacements of the plane that are tried, on both sides by turns.
fn offsets(margin: f64) -> impl Iterator<Item = f64> {
    (0..ATTEMPTS).map(move |k| {
        let distance = 2.5 * margin * k.div_ceil(2) as f64;
        if k % 2 == 0 { distance } else { -distance }
    })
}

impl Plane {
    /// Returns the signed distance of each vertex from the plane, by slot, positive on the side of the normal.
    fn heights(&self, mesh: &Mesh) -> Result<Vec<f64>, MeshError> {
        let normal = self.normal.normalize_or_zero();
        if !self.origin.is_finite() || normal == DVec3::ZERO {
            let problem = "must have a finite origin and a finite normal other than 0".to_owned();
            return Err(MeshError::InvalidArgument { parameter: "plane", problem });
        }
        Ok(mesh.positions().iter().map(|p| normal.dot(p.as_dvec3() - self.origin)).collect())
    }
}

/// Returns the part of the mesh below a plane, closed, from the heights of all vertices above it, by slot. `None` if that
/// part would intersect itself. Pauses meanwhile.
async fn cut_at(mesh: &Mesh, heights: &[f64], normal: DVec3, pauses: &Pauses) -> Option<Mesh> {
    let mut part = OpenPart::new(mesh, heights);
    let points: Vec<DVec2> =
        part.surface.positions[part.rim_start as usize..].iter().map(|&p| projected(p, normal)).collect();
    pauses.now().await;
    let rims = part.rims()?;
    pauses.now().await;
    let cap = triangulate(&points, &rims, pauses).await?;
    pauses.now().await;
    part.surface.triangles.extend(cap.into_iter().map(|corners| corners.map(|k| part.rim_start + k)));
    let mut closed = Mesh::from_triangles(&part.surface).ok()?;
    pauses.now().await;
    make_delaunay(&mut closed, part.rim_start, &points, pauses).await;
    is_sound(&closed, part.rim_start, pauses).await.then_some(closed)
}

/// Projects a point along the axis nearest to the normal. Exact, and counter-clockwise is as seen against the normal.
fn projected(p: Vec3, normal: DVec3) -> DVec2 {
    let size = normal.abs();
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let [u, v] = [p[(axis + 1) % 3], p[(axis + 2) % 3]].map(f64::from);
    if normal[axis] > 0.0 { DVec2::new(u, v) } else { DVec2::new(v, u) }
}

/// The part of a mesh below a plane, open along it.
struct OpenPart {
    surface: TriangleMesh,
    /// The index of the first vertex on the plane; those before are of the mesh.
    rim_start: u32,
    /// By vertex on the plane, the next one along its rim, from `rim_start` on. The cross-section is on its left.
    next: Vec<u32>,
}

impl OpenPart {
    fn new(mesh: &Mesh, heights: &[f64]) -> Self {
        let is_kept = |v: VertexId| heights[v.index()] < 0.0;
        let mut index = vec![u32::MAX; mesh.slots()];
        let mut surface = TriangleMesh { origin: mesh.origin(), ..TriangleMesh::default() };
        for v in mesh.vertices().filter(|&v| is_kept(v)) {
            index[v.index()] = surface.positions.len() as u32;
            surface.positions.push(mesh.position(v));
        }
        let rim_start = surface.positions.len() as u32;
        let mut part = Self { surface, rim_start, next: Vec::new() };
        let mut ends = BTreeMap::new();
        for corners in mesh.triangles() {
            let kept = corners.map(is_kept);
            let Some(lone) = lone_corner(kept) else {
                if kept[0] {
                    part.surface.triangles.push(corners.map(|v| index[v.index()]));
                }
                continue;
            };
            let [a, b, c] = [0, 1, 2].map(|k| corners[(lone + k) % 3]);
            let mut end = |v: VertexId| {
                *ends.entry((a.min(v), a.max(v))).or_insert_with(|| part.add_end(mesh, heights, [a, v]))
            };
            let [on_ab, on_ac] = [end(b), end(c)];
            let [a, b, c] = [a, b, c].map(|v| index[v.index()]);
            if kept[lone] {
                part.surface.triangles.push([a, on_ab, on_ac]);
                part.next[(on_ac - rim_start) as usize] = on_ab - rim_start;
            } else {
                part.keep_quad([on_ab, b, c, on_ac]);
                part.next[(on_ab - rim_start) as usize] = on_ac - rim_start;
            }
        }
        part
    }

    /// Adds the intersection of an edge with the plane, and returns its index.
    fn add_end(&mut self, mesh: &Mesh, heights: &[f64], edge: [VertexId; 2]) -> u32 {
        let [p, q] = edge.map(|v| mesh.position(v).as_dvec3());
        let [from, to] = edge.map(|v| heights[v.index()]);
        self.surface.positions.push(p.lerp(q, from / (from - to)).as_vec3());
        self.next.push(0);
        self.surface.positions.len() as u32 - 1
    }

    /// Adds a quadrilateral as two triangles, divided along its shorter diagonal.
    fn keep_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let at = |k: u32| self.surface.positions[k as usize];
        let is_ac = at(a).distance_squared(at(c)) < at(b).distance_squared(at(d));
        self.surface.triangles.extend(if is_ac { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
    }

    /// Returns the rims as loops of vertices, counted from `rim_start`. `None` if there is none.
    fn rims(&self) -> Option<Vec<Vec<u32>>> {
        let mut is_found = vec![false; self.next.len()];
        let mut rims = Vec::new();
        for first in 0..self.next.len() {
            let mut rim = Vec::new();
            let mut at = first;
            while !std::mem::replace(&mut is_found[at], true) {
                rim.push(at as u32);
                at = self.next[at] as usize;
            }
            if !rim.is_empty() {
                rims.push(rim);
            }
        }
        (!rims.is_empty()).then_some(rims)
    }
}

/// Flips edges between triangles on the plane until these are a constrained Delaunay triangulation. Vertices from
/// `rim_start` on are on the plane, at `points`. Pauses meanwhile.
async fn make_delaunay(mesh: &mut Mesh, rim_start: u32, points: &[DVec2], pauses: &Pauses) {
    let is_rim = |v: VertexId| v.0 >= rim_start;
    let mut queue: Vec<_> = mesh.edges().filter(|&(u, v)| is_rim(u) && is_rim(v)).collect();
    while let Some((u, v)) = queue.pop() {
        pauses.after(1).await;
        let Ok(OppositeVertices { left, right }) = mesh.opposite_vertices(u, v) else { continue };
        if !is_rim(left) || !is_rim(right) {
            continue;
        }
        let [a, b, c, d] = [u, v, left, right].map(|v| points[(v.0 - rim_start) as usize]);
        if in_circle([a, b, c], d) > 0.0 && mesh.flip(u, v) == Ok(()) {
            queue.extend([(u, left), (left, v), (v, right), (right, u)]);
        }
    }
}

/// Returns whether no triangle with a vertex on the plane, from `rim_start` on, is degenerate or intersects another. Pauses
/// meanwhile.
async fn is_sound(mesh: &Mesh, rim_start: u32, pauses: &Pauses) -> bool {
    let is_new = |corners: &[u32; 3]| corners.iter().any(|&v| v >= rim_start);
    let positions = mesh.positions().to_vec();
    let points_of = |corners: &[u32; 3]| corners.map(|v| positions[v as usize]);
    let mut triangles: Vec<[u32; 3]> = mesh.triangles().map(|corners| corners.map(|v| v.0)).collect();
    let new = || triangles.iter().filter(|corners| is_new(corners));
    let near = Bounds::from_points(&new().flat_map(points_of).collect::<Vec<_>>());
    if new().any(|corners| collinear(points_of(corners))) {
        return false;
    }
    triangles.retain(|corners| Bounds::from_points(&points_of(corners)).overlaps(&near));
    let surface = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
    let is_of_new = |t: u32| is_new(&surface.triangles[t as usize]);
    !intersect_anywhere(&surface, |pair| pair.into_iter().any(is_of_new), pauses).await
}
