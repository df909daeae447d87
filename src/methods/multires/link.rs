//! The map T from the deformed surface S to the base M₀: projected from frame to frame by the operator P, and evened
//! out by the operator D (sections 3 and 6).

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{SurfacePoint, SurfaceWalker};

/// A point on the base M₀, as a triangle and barycentric coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Linked {
    /// The triangle of the base.
    pub triangle: u32,
    /// Barycentric coordinates in it.
    pub weights: Vec3,
    /// The position.
    pub point: Vec3,
}

impl From<SurfacePoint> for Linked {
    fn from(found: SurfacePoint) -> Self {
        Self { triangle: found.triangle, weights: found.barycentric, point: found.point }
    }
}

impl Linked {
    /// Creates the point of `base` with these barycentric coordinates. Its position has the same bits whenever it is
    /// computed.
    pub fn at(base: &SurfaceWalker, triangle: u32, weights: Vec3) -> Self {
        let [a, b, c] = base.corners(triangle);
        Self { triangle, weights, point: a * weights.x + b * weights.y + c * weights.z }
    }
}

/// Converts a closest point on the base to its stored form.
fn linked(base: &SurfaceWalker, found: &SurfacePoint) -> Linked {
    Linked::at(base, found.triangle, found.barycentric)
}

/// The map T: the point on the base for every vertex of S, by slot.
pub(super) type Link = Vec<Linked>;

pub(super) const NOWHERE: Linked = Linked { triangle: 0, weights: Vec3::ZERO, point: Vec3::ZERO };

/// The surface that the next one is projected onto, with its map T: S_current, moved along with the ellipsoids.
pub(super) struct Before<'a> {
    pub walker: &'a SurfaceWalker,
    /// The image of each vertex under T, in the order of the vertices of the surface.
    pub link: &'a [Linked],
}

/// Operator P: maps each vertex of `mesh` to the closest point of S_current, then by the same barycentric coordinates
/// to a point near the base, then to the closest point on the base. Returns the map T of `mesh`.
///
/// A closest point farther away than `farthest` is wrong, and is searched again in a tree.
pub(super) fn project(mesh: &Mesh, before: &Before, base: &SurfaceWalker, farthest: f64) -> Link {
    let mut link = vec![NOWHERE; mesh.slots()];
    traverse(mesh, |v, start| {
        let found = nearest(mesh, before.walker, v, start, farthest);
        link[v.index()] = onto_base(before, base, &found);
        found.triangle
    });
    link
}

/// Returns the closest point on S_current to a vertex of the next surface, by a walk from the triangle `start`. If the
/// result is farther away than `farthest` or faces the other way, it is searched again in a tree.
fn nearest(
    mesh: &Mesh,
    walker: &SurfaceWalker,
    v: VertexId,
    start: Option<u32>,
    farthest: f64,
) -> SurfacePoint {
    let p = mesh.position(v);
    let normal = mesh.area_normal(v);
    let faces_alike = |found: &SurfacePoint| {
        let [a, b, c] = walker.corners(found.triangle);
        (b - a).cross(c - a).dot(normal) >= 0.0
    };
    let marched = start.map(|start| walker.walk(start, p));
    match marched.filter(|found| found.distance <= farthest && faces_alike(found)) {
        Some(found) => found,
        // Positions are finite, so a closest point exists.
        None => {
            let found = if start.is_some() { walker.closest(p) } else { walker.closest_brute_force(p) };
            found.unwrap_or_else(|| walker.walk(0, p))
        }
    }
}

/// Maps a point of S_current to the base, by the images of its triangle's corners under T.
fn onto_base(before: &Before, base: &SurfaceWalker, at: &SurfacePoint) -> Linked {
    let corners = before.walker.mesh().triangles[at.triangle as usize].map(|v| before.link[v as usize]);
    let weights = at.barycentric;
    let point = corners[0].point * weights.x + corners[1].point * weights.y + corners[2].point * weights.z;
    let heaviest = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    linked(base, &base.walk(corners[heaviest].triangle, point))
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

/// Operator D, equation 1: q ← Σ dⱼ qⱼ / Σ dⱼ with the mean length dⱼ of the edges at qⱼ, then back onto the base.
/// Evens out the map T.
pub(super) fn distribute(mesh: &Mesh, base: &SurfaceWalker, link: &mut Link) {
    let densities: Vec<f32> =
        (0..mesh.slots()).map(|i| density(mesh, link, VertexId::from_index(i))).collect();
    for v in mesh.vertices() {
        link[v.index()] = spread(mesh, base, link, v, |w| densities[w.index()]);
    }
}

/// Returns dⱼ: the mean length of the edges at a vertex, on the base.
fn density(mesh: &Mesh, link: &Link, v: VertexId) -> f32 {
    let (ring, here) = (mesh.ring(v).as_slice(), link[v.index()].point);
    let sum: f32 = ring.iter().map(|w| here.distance(link[w.index()].point)).sum();
    if ring.is_empty() { 0.0 } else { sum / ring.len() as f32 }
}

/// Returns the point to which D moves one vertex.
fn spread(
    mesh: &Mesh,
    base: &SurfaceWalker,
    link: &Link,
    v: VertexId,
    density: impl Fn(VertexId) -> f32,
) -> Linked {
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for &w in mesh.ring(v).as_slice() {
        sum += link[w.index()].point * density(w);
        total += density(w);
    }
    let here = link[v.index()];
    if total > 0.0 { linked(base, &base.walk(here.triangle, sum * (1.0 / total))) } else { here }
}

/// Whether the image of a triangle on the base is flipped or has no area.
fn is_folded(corners: [VertexId; 3], base: &SurfaceWalker, normals: &[Vec3], link: &Link) -> bool {
    let [a, b, c] = corners.map(|v| link[v.index()]);
    let outward = [a, b, c].map(|at| normal_at(base, normals, &at)).into_iter().sum::<Vec3>();
    (b.point - a.point).cross(c.point - a.point).dot(outward) <= 0.0
}

/// Counts the triangles of the surface whose image on the base is flipped or has no area.
pub(super) fn folded(mesh: &Mesh, base: &SurfaceWalker, normals: &[Vec3], link: &Link) -> usize {
    mesh.triangles().filter(|&corners| is_folded(corners, base, normals, link)).count()
}

/// Applies D to the corners of folded triangles and their neighbours only, until no triangle is folded, at most
/// [`UNFOLDINGS`] times.
pub(super) fn unfold(mesh: &Mesh, base: &SurfaceWalker, normals: &[Vec3], link: &mut Link) {
    for _ in 0..UNFOLDINGS {
        let folded = mesh.triangles().filter(|&corners| is_folded(corners, base, normals, link));
        let mut around: Vec<VertexId> = folded.flatten().collect();
        around.extend(around.clone().iter().flat_map(|&v| mesh.ring(v).as_slice()));
        around.sort_unstable();
        around.dedup();
        if around.is_empty() {
            return;
        }
        let densities: Vec<f32> = around.iter().map(|&v| density(mesh, link, v)).collect();
        let known =
            |w: VertexId| around.binary_search(&w).map_or_else(|_| density(mesh, link, w), |k| densities[k]);
        let moved: Vec<Linked> = around.iter().map(|&v| spread(mesh, base, link, v, known)).collect();
        around.iter().zip(moved).for_each(|(v, at)| link[v.index()] = at);
    }
}

/// Maximum number of passes that remove folds of T: a fold that remains has a topological cause, such as a cut neck.
const UNFOLDINGS: usize = 12;

/// Returns the unit normal of the base at a point, interpolated from the vertex normals.
pub(super) fn normal_at(base: &SurfaceWalker, normals: &[Vec3], at: &Linked) -> Vec3 {
    let [a, b, c] = base.mesh().triangles[at.triangle as usize].map(|v| normals[v as usize]);
    (a * at.weights.x + b * at.weights.y + c * at.weights.z).normalize_or_zero()
}
