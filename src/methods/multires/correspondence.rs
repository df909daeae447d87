//! The map T from the deformed surface S to the base M₀: projected from frame to frame by the operator P, and evened
//! out by the operator D (Kobbelt, Bareuther & Seidel, sections 3 and 6).

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{SurfacePoint, SurfaceWalker};

/// A point on a surface of the decomposition, usually the base M₀, as a triangle and barycentric coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BasePoint {
    /// The index of a triangle that contains the point.
    pub triangle: u32,
    /// The barycentric coordinates of the point in its triangle.
    pub weights: Vec3,
    /// The position of the point.
    pub point: Vec3,
}

impl From<SurfacePoint> for BasePoint {
    fn from(found: SurfacePoint) -> Self {
        Self { triangle: found.triangle, weights: found.barycentric, point: found.point }
    }
}

impl BasePoint {
    /// Creates the point of `base` with these barycentric coordinates. Its position has the same bits whenever it is
    /// computed, so that saved runs are restored exactly.
    pub fn at(base: &SurfaceWalker, triangle: u32, weights: Vec3) -> Self {
        let [a, b, c] = base.corners(triangle);
        Self { triangle, weights, point: a * weights.x + b * weights.y + c * weights.z }
    }
}

/// Converts a closest point on the base to a [`BasePoint`], with its position computed as in [`BasePoint::at`].
fn to_base_point(base: &SurfaceWalker, found: &SurfacePoint) -> BasePoint {
    BasePoint::at(base, found.triangle, found.barycentric)
}

/// A point for every vertex, by slot: the map T from the deformed base S to the base M₀, or the points of the finest
/// surface from which texture coordinates are taken.
pub(super) type Correspondence = Vec<BasePoint>;

pub(super) const UNSET: BasePoint = BasePoint { triangle: 0, weights: Vec3::ZERO, point: Vec3::ZERO };

/// S_current with its map T: the deformed base of the frame before, moved along with the ellipsoids. The next deformed
/// base is projected onto it.
pub(super) struct Current<'a> {
    pub walker: &'a SurfaceWalker,
    /// The image of each vertex under T, in the order of the vertices of the surface.
    pub correspondence: &'a [BasePoint],
}

/// Operator P: maps each vertex of `mesh` to the closest point of S_current, then by its barycentric coordinates to the
/// point between the images of the triangle's corners under T, then to the closest point on the base. Returns the map T
/// of `mesh`.
///
/// A closest point on S_current found by a walk is searched again in a tree if it is farther away than `farthest`, in
/// units of the mesh, or if its triangle faces the other way.
pub(super) fn project(mesh: &Mesh, current: &Current, base: &SurfaceWalker, farthest: f64) -> Correspondence {
    let mut correspondence = vec![UNSET; mesh.slots()];
    traverse(mesh, |v, start| {
        let found = nearest(mesh, current.walker, v, start, farthest);
        correspondence[v.index()] = carry_over(current, base, &found);
        found.triangle
    });
    correspondence
}

/// Returns the closest point on S_current to a vertex of the next surface, by a walk from the triangle `start`. If the
/// result is farther away than `farthest`, or its triangle faces away from the normal of the vertex, it is searched
/// again in a tree. Without `start`, all triangles are tested.
fn nearest(
    mesh: &Mesh,
    walker: &SurfaceWalker,
    v: VertexId,
    start: Option<u32>,
    farthest: f64,
) -> SurfacePoint {
    let p = mesh.position(v);
    let normal = mesh.area_normal(v);
    let faces_same_way = |found: &SurfacePoint| {
        let [a, b, c] = walker.corners(found.triangle);
        (b - a).cross(c - a).dot(normal) >= 0.0
    };
    let walked = start.map(|start| walker.walk(start, p));
    match walked.filter(|found| found.distance <= farthest && faces_same_way(found)) {
        Some(found) => found,
        // Positions are finite, so a closest point exists.
        None => {
            let found = if start.is_some() { walker.closest(p) } else { walker.closest_brute_force(p) };
            found.unwrap_or_else(|| walker.walk(0, p))
        }
    }
}

/// Maps a point of S_current to the base, by the images of its triangle's corners under T.
fn carry_over(current: &Current, base: &SurfaceWalker, at: &SurfacePoint) -> BasePoint {
    let corners =
        current.walker.mesh().triangles[at.triangle as usize].map(|v| current.correspondence[v as usize]);
    let weights = at.barycentric;
    let point = corners[0].point * weights.x + corners[1].point * weights.y + corners[2].point * weights.z;
    let heaviest = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    to_base_point(base, &base.walk(corners[heaviest].triangle, point))
}

/// Visits every vertex, starting each component at any vertex and continuing with neighbours. `visit` is passed its
/// result for a neighbour, from which to start the search, or `None` for the first vertex of a component.
fn traverse(mesh: &Mesh, mut visit: impl FnMut(VertexId, Option<u32>) -> u32) {
    let mut seen = vec![false; mesh.slots()];
    let mut queue: Vec<(VertexId, u32)> = Vec::new();
    for root in mesh.vertices() {
        if std::mem::replace(&mut seen[root.index()], true) {
            continue;
        }
        queue.clear();
        queue.push((root, visit(root, None)));
        let mut next = 0;
        while let Some(&(v, found)) = queue.get(next) {
            next += 1;
            for &w in mesh.ring(v).as_slice() {
                if !std::mem::replace(&mut seen[w.index()], true) {
                    queue.push((w, visit(w, Some(found))));
                }
            }
        }
    }
}

/// Operator D (Kobbelt, Bareuther & Seidel, equation 1): moves the image q of each vertex under T to Σ dⱼ qⱼ / Σ dⱼ
/// over its neighbours, with the mean length dⱼ of the edges at qⱼ, then back onto the base. Evens out the map T.
pub(super) fn distribute(mesh: &Mesh, base: &SurfaceWalker, correspondence: &mut Correspondence) {
    let densities: Vec<f32> =
        (0..mesh.slots()).map(|i| density(mesh, correspondence, VertexId::from_index(i))).collect();
    for v in mesh.vertices() {
        correspondence[v.index()] = distributed(mesh, base, correspondence, v, |w| densities[w.index()]);
    }
}

/// Returns dⱼ of the operator D: the mean distance on the base from the image of a vertex under T to the images of its
/// neighbours.
fn density(mesh: &Mesh, correspondence: &Correspondence, v: VertexId) -> f32 {
    let (ring, here) = (mesh.ring(v).as_slice(), correspondence[v.index()].point);
    let sum: f32 = ring.iter().map(|w| here.distance(correspondence[w.index()].point)).sum();
    if ring.is_empty() { 0.0 } else { sum / ring.len() as f32 }
}

/// Returns the point of the base to which the operator D moves the image of one vertex.
fn distributed(
    mesh: &Mesh,
    base: &SurfaceWalker,
    correspondence: &Correspondence,
    v: VertexId,
    density: impl Fn(VertexId) -> f32,
) -> BasePoint {
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for &w in mesh.ring(v).as_slice() {
        sum += correspondence[w.index()].point * density(w);
        total += density(w);
    }
    let here = correspondence[v.index()];
    if total > 0.0 { to_base_point(base, &base.walk(here.triangle, sum * (1.0 / total))) } else { here }
}

/// Whether the image of a triangle on the base is flipped or has no area.
fn is_folded(
    corners: [VertexId; 3],
    base: &SurfaceWalker,
    normals: &[Vec3],
    correspondence: &Correspondence,
) -> bool {
    let [a, b, c] = corners.map(|v| correspondence[v.index()]);
    let outward = [a, b, c].map(|at| normal_at(base, normals, &at)).into_iter().sum::<Vec3>();
    (b.point - a.point).cross(c.point - a.point).dot(outward) <= 0.0
}

/// Counts the triangles of the surface whose image on the base is flipped or has no area.
pub(super) fn folded(
    mesh: &Mesh,
    base: &SurfaceWalker,
    normals: &[Vec3],
    correspondence: &Correspondence,
) -> usize {
    mesh.triangles().filter(|&corners| is_folded(corners, base, normals, correspondence)).count()
}

/// Applies the operator D only to the corners of folded triangles and their neighbours, at most [`UNFOLDINGS`] times,
/// until no triangle is folded: flipped or without area on the base.
pub(super) fn unfold(
    mesh: &Mesh,
    base: &SurfaceWalker,
    normals: &[Vec3],
    correspondence: &mut Correspondence,
) {
    for _ in 0..UNFOLDINGS {
        let folded = mesh.triangles().filter(|&corners| is_folded(corners, base, normals, correspondence));
        let mut neighbourhood: Vec<VertexId> = folded.flatten().collect();
        neighbourhood.extend(neighbourhood.clone().iter().flat_map(|&v| mesh.ring(v).as_slice()));
        neighbourhood.sort_unstable();
        neighbourhood.dedup();
        if neighbourhood.is_empty() {
            return;
        }
        let densities: Vec<f32> = neighbourhood.iter().map(|&v| density(mesh, correspondence, v)).collect();
        let known = |w: VertexId| {
            neighbourhood
                .binary_search(&w)
                .map_or_else(|_| density(mesh, correspondence, w), |k| densities[k])
        };
        let moved: Vec<BasePoint> =
            neighbourhood.iter().map(|&v| distributed(mesh, base, correspondence, v, known)).collect();
        neighbourhood.iter().zip(moved).for_each(|(v, at)| correspondence[v.index()] = at);
    }
}

/// Maximum number of passes that remove folds of T: a fold that remains has a topological cause, such as a cut neck.
const UNFOLDINGS: usize = 12;

/// Returns the unit normal of a surface of the decomposition at a point, interpolated from `normals`, its vertex
/// normals.
pub(super) fn normal_at(base: &SurfaceWalker, normals: &[Vec3], at: &BasePoint) -> Vec3 {
    let [a, b, c] = base.mesh().triangles[at.triangle as usize].map(|v| normals[v as usize]);
    (a * at.weights.x + b * at.weights.y + c * at.weights.z).normalize_or_zero()
}
