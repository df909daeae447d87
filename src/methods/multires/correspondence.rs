//! The map T from the deformed base S to the undeformed base M₀: carried over from frame to frame by the operator P,
//! and evened out by the operator D (Kobbelt, Bareuther & Seidel, sections 3 and 6).

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{SurfacePoint, SurfaceWalker};

/// A point on one of the surfaces into which the model's input is decomposed, usually the base M₀, as a triangle and
/// barycentric coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BasePoint {
    /// The triangle that contains the point, as an index into the triangles of the surface.
    pub triangle: u32,
    /// The barycentric coordinates of the point in `triangle`.
    pub weights: Vec3,
    /// The position of the point in space, in units of the mesh.
    pub point: Vec3,
}

impl From<SurfacePoint> for BasePoint {
    fn from(found: SurfacePoint) -> Self {
        Self { triangle: found.triangle, weights: found.barycentric, point: found.point }
    }
}

impl BasePoint {
    /// Creates the point of `base` with the barycentric coordinates `weights` in `triangle`. Its position has the same
    /// bits whenever it is computed, so that saved runs are restored exactly.
    pub fn at(base: &SurfaceWalker, triangle: u32, weights: Vec3) -> Self {
        let [a, b, c] = base.corners(triangle);
        Self { triangle, weights, point: a * weights.x + b * weights.y + c * weights.z }
    }
}

/// Converts a closest point on the base to a [`BasePoint`], with its position computed by [`BasePoint::at`], so that it
/// has the same bits after a saved run is restored.
pub(super) fn to_base_point(base: &SurfaceWalker, found: &SurfacePoint) -> BasePoint {
    BasePoint::at(base, found.triangle, found.barycentric)
}

/// A surface point for every vertex of a mesh, by slot: the map T from the deformed base S to the base M₀, or the
/// points of the finest surface from which texture coordinates are taken.
pub(super) type Correspondence = Vec<BasePoint>;

pub(super) const UNSET: BasePoint = BasePoint { triangle: 0, weights: Vec3::ZERO, point: Vec3::ZERO };

/// S_current with its map T: the deformed base of the frame before, moved along with the ellipsoids. [`project`]
/// carries T over from it to the next deformed base.
pub(super) struct Current<'a> {
    pub walker: &'a SurfaceWalker,
    /// The image of each vertex of S_current under T, in the order of the vertices of `walker`.
    pub correspondence: &'a [BasePoint],
}

/// Operator P: returns the map T of `mesh`, the next deformed base. Maps each vertex of `mesh` to the closest point of
/// S_current, then by its barycentric coordinates to the point between the images of the triangle's corners under T,
/// then to the closest point on the base M₀.
///
/// A closest point on S_current found by a walk is searched for again in a tree if it is farther away than `farthest`,
/// in units of the mesh, or if its triangle faces the other way.
pub(super) fn project(mesh: &Mesh, current: &Current, base: &SurfaceWalker, farthest: f64) -> Correspondence {
    let mut correspondence = vec![UNSET; mesh.slots()];
    traverse(mesh, |v, start| {
        let found = nearest(mesh, current.walker, v, start, farthest);
        correspondence[v.index()] = carry_over(current, base, &found);
        found.triangle
    });
    correspondence
}

/// Returns the closest point on S_current to vertex `v` of `mesh`, the next deformed base: by a walk from the triangle
/// `start`, or among all triangles if `start` is `None`. A tree is searched instead if the walk ends farther away than
/// `farthest`, in units of the mesh, or on a triangle that faces away from the normal of `v`.
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

/// Maps a point of S_current to the base M₀, for the operator P: by its barycentric coordinates to the point between
/// the images of its triangle's corners under T, then to the closest point on the base.
fn carry_over(current: &Current, base: &SurfaceWalker, at: &SurfacePoint) -> BasePoint {
    let corners =
        current.walker.mesh().triangles[at.triangle as usize].map(|v| current.correspondence[v as usize]);
    let weights = at.barycentric;
    let point = corners[0].point * weights.x + corners[1].point * weights.y + corners[2].point * weights.z;
    let heaviest = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    to_base_point(base, &base.walk(corners[heaviest].triangle, point))
}

/// Calls `visit` for every vertex, breadth-first in each connected component, with the triangle that it returned for a
/// neighbour, so that a walk can start there; with `None` for the first vertex of a component.
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

/// Applies the operator D once, which evens out the map T (Kobbelt, Bareuther & Seidel, equation 1): moves the image q
/// of each vertex under T to Σ dⱼ qⱼ / Σ dⱼ over the images qⱼ of its neighbours, with the mean length dⱼ of the edges
/// at qⱼ, then back onto the base.
pub(super) fn distribute(mesh: &Mesh, base: &SurfaceWalker, correspondence: &mut Correspondence) {
    let densities: Vec<f32> =
        (0..mesh.slots()).map(|i| density(mesh, correspondence, VertexId::from_index(i))).collect();
    for v in mesh.vertices() {
        correspondence[v.index()] = distributed(mesh, base, correspondence, v, |w| densities[w.index()]);
    }
}

/// Returns dⱼ of the operator D for vertex `v`: the mean distance from its image on the base under T to the images of
/// its neighbours; 0 for a free slot.
fn density(mesh: &Mesh, correspondence: &Correspondence, v: VertexId) -> f32 {
    let (ring, here) = (mesh.ring(v).as_slice(), correspondence[v.index()].point);
    let sum: f32 = ring.iter().map(|w| here.distance(correspondence[w.index()].point)).sum();
    if ring.is_empty() { 0.0 } else { sum / ring.len() as f32 }
}

/// Returns the point of the base M₀ to which the operator D moves the image of vertex `v` under T; `density` returns dⱼ
/// of a neighbour.
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

/// Returns whether the map T folds a triangle of the deformed base: whether its image on the base M₀ is flipped or has
/// no area.
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

/// Counts the triangles of the deformed base `mesh` whose image under T on the base M₀ is flipped or has no area.
pub(super) fn folded(
    mesh: &Mesh,
    base: &SurfaceWalker,
    normals: &[Vec3],
    correspondence: &Correspondence,
) -> usize {
    mesh.triangles().filter(|&corners| is_folded(corners, base, normals, correspondence)).count()
}

/// Applies the operator D to the corners of folded triangles, whose image under the map T is flipped or has no area,
/// and to the neighbours of these corners, until no triangle is folded, at most [`UNFOLDINGS`] times.
pub(super) fn unfold(
    mesh: &Mesh,
    base: &SurfaceWalker,
    normals: &[Vec3],
    correspondence: &mut Correspondence,
) {
    for _ in 0..UNFOLDINGS {
        let folded = mesh.triangles().filter(|&corners| is_folded(corners, base, normals, correspondence));
        let mut neighbourhood: Vec<VertexId> = folded.flatten().collect();
        mesh.add_neighbours(&mut neighbourhood);
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

/// Maximum number of passes of [`unfold`], which removes folds of the map T: a fold that remains has a topological
/// cause, such as a cut neck.
const UNFOLDINGS: usize = 12;

/// Returns the unit normal at a point of a surface of the decomposition, interpolated from `normals`, the vertex
/// normals of that surface; zero if they cancel.
pub(super) fn normal_at(base: &SurfaceWalker, normals: &[Vec3], at: &BasePoint) -> Vec3 {
    let [a, b, c] = base.mesh().triangles[at.triangle as usize].map(|v| normals[v as usize]);
    (a * at.weights.x + b * at.weights.y + c * at.weights.z).normalize_or_zero()
}
