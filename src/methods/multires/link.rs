//! The map T from the deformed surface to the base: projected from step to step, and spread out evenly (sections 3 and 6,
//! operators P and D).

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{SurfacePoint, SurfaceWalker};

/// Where a vertex lies on the base; nowhere, for free slots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Linked {
    /// The triangle of the base.
    pub triangle: u32,
    /// Weights of its corners.
    pub weights: Vec3,
    /// The point itself.
    pub point: Vec3,
}

impl From<SurfacePoint> for Linked {
    fn from(found: SurfacePoint) -> Self {
        Self { triangle: found.triangle, weights: found.barycentric, point: found.point }
    }
}

impl Linked {
    /// The place on `base` of a triangle and weights, with the same bits whenever it is worked out.
    pub fn at(base: &SurfaceWalker, triangle: u32, weights: Vec3) -> Self {
        let [a, b, c] = base.corners(triangle);
        Self { triangle, weights, point: a * weights.x + b * weights.y + c * weights.z }
    }
}

/// A place on the base as it is kept.
fn linked(base: &SurfaceWalker, found: &SurfacePoint) -> Linked {
    Linked::at(base, found.triangle, found.barycentric)
}

/// The link of every vertex, by slot.
pub(super) type Link = Vec<Linked>;

pub(super) const NOWHERE: Linked = Linked { triangle: 0, weights: Vec3::ZERO, point: Vec3::ZERO };

/// The surface before a step, and the link of its vertices.
pub(super) struct Before<'a> {
    pub walker: &'a SurfaceWalker,
    /// In the order of the vertices of the surface.
    pub link: &'a [Linked],
}

/// Operator P: each vertex of `mesh` goes to the nearest point of the surface before, and by the same weights of the same
/// triangle to a place near the base; then onto the base.
///
/// `farthest` is how far it can be: a place beyond was found wrongly, and is looked for in a tree.
pub(super) fn project(mesh: &Mesh, before: &Before, base: &SurfaceWalker, farthest: f64) -> Link {
    let mut link = vec![NOWHERE; mesh.slots()];
    traverse(mesh, |v, start| {
        let found = nearest(mesh, before.walker, v, start, farthest);
        link[v.index()] = onto_base(before, base, &found);
        found.triangle
    });
    link
}

/// The nearest point of the surface before, on the same side of it.
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
    let marched = start.map(|start| walker.march(start, p));
    match marched.filter(|found| found.distance <= farthest && faces_alike(found)) {
        Some(found) => found,
        // Positions are finite, so there is one.
        None => {
            let found = if start.is_some() { walker.closest(p) } else { walker.closest_of_all(p) };
            found.unwrap_or_else(|| walker.march(0, p))
        }
    }
}

/// The place on the base that belongs to a point of the surface before.
fn onto_base(before: &Before, base: &SurfaceWalker, at: &SurfacePoint) -> Linked {
    let corners = before.walker.mesh().triangles[at.triangle as usize].map(|v| before.link[v as usize]);
    let weights = at.barycentric;
    let point = corners[0].point * weights.x + corners[1].point * weights.y + corners[2].point * weights.z;
    let heaviest = (0..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    linked(base, &base.march(corners[heaviest].triangle, point))
}

/// Visits every vertex after a neighbour of it, and gives `visit` what it gave back for that one: none for the first of a
/// component.
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

/// Operator D, equation 1: q ← Σ dⱼ qⱼ / Σ dⱼ, where dⱼ is the mean length of the edges at qⱼ; then onto the base again.
pub(super) fn distribute(mesh: &Mesh, base: &SurfaceWalker, link: &mut Link) {
    let densities: Vec<f32> =
        (0..mesh.slots()).map(|i| density(mesh, link, VertexId::from_index(i))).collect();
    for v in mesh.vertices() {
        link[v.index()] = spread(mesh, base, link, v, |w| densities[w.index()]);
    }
}

/// dⱼ: the mean length of the edges at a vertex.
fn density(mesh: &Mesh, link: &Link, v: VertexId) -> f32 {
    let (ring, here) = (mesh.ring(v).as_slice(), link[v.index()].point);
    let sum: f32 = ring.iter().map(|w| here.distance(link[w.index()].point)).sum();
    if ring.is_empty() { 0.0 } else { sum / ring.len() as f32 }
}

/// Where D takes one vertex.
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
    if total > 0.0 { linked(base, &base.march(here.triangle, sum * (1.0 / total))) } else { here }
}

/// Whether the image of a triangle on the base is turned over, or has no area.
fn is_folded(corners: [VertexId; 3], base: &SurfaceWalker, normals: &[Vec3], link: &Link) -> bool {
    let [a, b, c] = corners.map(|v| link[v.index()]);
    let outward = [a, b, c].map(|at| normal_at(base, normals, &at)).into_iter().sum::<Vec3>();
    (b.point - a.point).cross(c.point - a.point).dot(outward) <= 0.0
}

/// Triangles of the surface whose image on the base is turned over, or has no area.
pub(super) fn folded(mesh: &Mesh, base: &SurfaceWalker, normals: &[Vec3], link: &Link) -> usize {
    mesh.triangles().filter(|&corners| is_folded(corners, base, normals, link)).count()
}

/// Applies D to the corners of folded triangles alone, and to those around them, until none is left or it does not help.
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

/// Rounds of that: a fold that is still there after so many is one of topology, as where a neck was cut.
const UNFOLDINGS: usize = 12;

/// The normal of the base at a place, of length 1: the vertices' normals, interpolated.
pub(super) fn normal_at(base: &SurfaceWalker, normals: &[Vec3], at: &Linked) -> Vec3 {
    let [a, b, c] = base.mesh().triangles[at.triangle as usize].map(|v| normals[v as usize]);
    (a * at.weights.x + b * at.weights.y + c * at.weights.z).normalize_or_zero()
}
