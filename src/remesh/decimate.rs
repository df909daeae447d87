//! Decimation: edges are collapsed in the order of their quadric error (Garland & Heckbert, *Surface simplification
//! using quadric error metrics*, 1997).
//!
//! Guarantees: a closed, oriented manifold stays one, with the same components and χ; no triangle turns over; no
//! self-intersections are added, and no component changes sides of another (from inside to outside or back). All of
//! this is tested before each collapse, intersections exactly. [`decimate_within`] bounds the distance between the mesh
//! before and after, too.

use super::collapse_queue::{CollapseQueue, Ranked};
use super::deviation::Deviation;
use super::obstacles::Obstacles;
use crate::math::predicates::collinear;
use crate::math::{DVec3, Quadric, Vec3, triangle};
use crate::mesh::{Facet, Mesh, MeshError, VertexId};
use crate::pauses::{Pauses, finished};
use smallvec::SmallVec;

/// The weight of the squared distance from the original vertices, relative to that from the planes of the triangles. It
/// regularises flat regions, where the position of least error is undetermined and needles would develop; with 0.01,
/// detail is rounded off.
const POINT_WEIGHT: f64 = 1e-4;

/// The highest valence of the vertex that remains after a collapse: vertices of higher valence are surrounded by
/// needles, and the intersection test is quadratic in it.
pub(super) const MAX_NEIGHBOURS: usize = 24;

/// The cosine of the largest angle by which one collapse may turn a triangle, 78°.
const MIN_COSINE: f64 = 0.2;

/// The largest number of passes in which all edges are queued for collapse. A rejected edge may become possible once
/// its neighbours are gone; passes that free one edge each would make the work quadratic.
const ROUNDS: usize = 4;

/// The work limit of the intersection tests, in boxes visited and pairs of triangles tested: this much per triangle of
/// the mesh, plus [`WORK_AT_LEAST`]. 200 to 600 per triangle are common. With five times as much, 42,000 triangles
/// whose boxes all overlap took 48 s.
const WORK_PER_TRIANGLE: u64 = 2_000;
/// The constant part of the work limit, in the units of [`WORK_PER_TRIANGLE`], for small meshes.
const WORK_AT_LEAST: u64 = 10_000_000;

/// The number of boxes and triangles tested, or points of the mesh before, that are a unit of work.
const TESTS_PER_UNIT: usize = 64;

/// The number of edges that are queued between two counts of the work, and their units of work.
const QUEUED: [usize; 2] = [64, 8];

/// The units of work of an attempt to collapse an edge, besides its tests.
const ATTEMPT: usize = 4;

/// Decimates a mesh: collapses edges in the order of their quadric error until at most `target_triangles` are left, no
/// safe collapse is found (rejected edges are tried again, in up to four passes in all), or the work limit is reached,
/// as among thousands of needles that block each other. Returns the number of collapses, each of which removes two
/// triangles. Vertices are renumbered unless the target is met from the start.
///
/// A component keeps at least four triangles. Intersecting triangles are kept unless a collapse resolves the
/// intersection. The vertex that remains after a collapse has the mean attributes of both ends.
pub fn decimate(mesh: &mut Mesh, target_triangles: usize) -> usize {
    finished(decimate_in_slices(mesh, target_triangles, &Pauses::default()))
}

/// Does what [`decimate`] does, and pauses meanwhile. The mesh is valid in each pause.
pub async fn decimate_in_slices(mesh: &mut Mesh, target_triangles: usize, pauses: &Pauses) -> usize {
    if mesh.triangle_count() <= target_triangles {
        return 0;
    }
    run(mesh, target_triangles, Box::new(Unconditional), pauses).await
}

/// Decimates a mesh as [`decimate`], and rejects collapses after which the distance from the mesh before would be
/// larger than `max_distance`, in the length unit of the mesh: each vertex of the mesh before is within it of the
/// surface after, and each vertex after is within it of the surface before.
///
/// # Errors
/// [`MeshError::InvalidArgument`] if `max_distance` is negative or not a number; errors of [`TriangleTree::new`].
///
/// [`TriangleTree::new`]: crate::spatial::TriangleTree::new
pub fn decimate_within(
    mesh: &mut Mesh,
    target_triangles: usize,
    max_distance: f64,
) -> Result<usize, MeshError> {
    finished(decimate_within_in_slices(mesh, target_triangles, max_distance, &Pauses::default()))
}

/// Does what [`decimate_within`] does, and pauses meanwhile. The mesh is valid in each pause.
///
/// # Errors
/// As [`decimate_within`].
pub async fn decimate_within_in_slices(
    mesh: &mut Mesh,
    target_triangles: usize,
    max_distance: f64,
    pauses: &Pauses,
) -> Result<usize, MeshError> {
    if max_distance.is_nan() || max_distance < 0.0 {
        let problem = format!("must be at least 0, got {max_distance}");
        return Err(MeshError::InvalidArgument { parameter: "max_distance", problem });
    }
    if mesh.triangle_count() <= target_triangles {
        return Ok(0);
    }
    let deviation = Deviation::new(mesh, max_distance, pauses).await?;
    pauses.now().await;
    Ok(run(mesh, target_triangles, Box::new(deviation), pauses).await)
}

async fn run(
    mesh: &mut Mesh,
    target_triangles: usize,
    condition: Box<dyn Condition>,
    pauses: &Pauses,
) -> usize {
    let before = mesh.vertex_count();
    let mut decimation = Decimation::new(mesh, target_triangles, condition, pauses).await;
    for _ in 0..ROUNDS {
        pauses.now().await;
        let vertices = decimation.mesh.vertex_count();
        decimation.queue_all(pauses).await;
        decimation.run(pauses).await;
        if decimation.is_done() || decimation.mesh.vertex_count() == vertices {
            break;
        }
    }
    pauses.now().await;
    mesh.reorder();
    before - mesh.vertex_count()
}

/// A condition of collapses beside safety. Called through a table, so that modules without [`decimate_within`] have no
/// code of [`Deviation`].
pub(super) trait Condition {
    /// Returns whether the edge `uv` may be collapsed into `position`, which replaces the triangles around it by `fresh`.
    fn allows(&mut self, mesh: &Mesh, edge: [VertexId; 2], position: Vec3, fresh: &[Facet]) -> bool;

    /// Adopts the collapse of the edge that was allowed last, before it is made.
    fn adopt(&mut self, mesh: &Mesh, edge: [VertexId; 2]);

    /// Returns the number of tests so far, of points of the mesh before.
    fn tests(&self) -> u64;
}

/// Allows all collapses.
struct Unconditional;

impl Condition for Unconditional {
    fn allows(&mut self, _: &Mesh, _: [VertexId; 2], _: Vec3, _: &[Facet]) -> bool {
        true
    }

    fn adopt(&mut self, _: &Mesh, _: [VertexId; 2]) {}

    fn tests(&self) -> u64 {
        0
    }
}

struct Decimation<'a> {
    mesh: &'a mut Mesh,
    target: usize,
    /// The quadric error of each vertex, by slot, as a function of a position relative to `origin`.
    quadrics: Vec<Quadric>,
    /// The origin of the positions at which quadrics are evaluated, near the mesh, so that they do not lose precision.
    origin: DVec3,
    /// The number of collapses at each vertex, by slot, by which outdated candidates in the queue are recognised.
    stamps: Vec<u32>,
    queue: CollapseQueue<Candidate>,
    obstacles: Obstacles,
    /// A further condition of collapses.
    condition: Box<dyn Condition>,
}

/// An edge to be collapsed, in the priority queue of decimation, ordered by error, then by vertex ids.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// The bits of the quadric error; for non-negative numbers they are ordered like the numbers.
    error: u64,
    ends: [VertexId; 2],
    /// The index of the position to which the edge is to be collapsed, in [`Decimation::positions`].
    choice: u8,
    /// The number of collapses at both ends (the sum of their `stamps`) when the edge was queued; the candidate is
    /// outdated if it has increased.
    stamp: u32,
}

impl Ranked for Candidate {
    fn rank(&self) -> u64 {
        self.error
    }
}

/// A candidate position for the vertex that remains after a collapse, preceded by its quadric error.
type RatedPosition = (f64, Vec3);

impl<'a> Decimation<'a> {
    async fn new(mesh: &'a mut Mesh, target: usize, condition: Box<dyn Condition>, pauses: &Pauses) -> Self {
        let origin = mesh.vertices().next().map_or(DVec3::ZERO, |v| mesh.position(v).as_dvec3());
        let work = WORK_AT_LEAST + WORK_PER_TRIANGLE * mesh.triangle_count() as u64;
        let quadrics = quadrics(mesh, origin);
        pauses.now().await;
        Self {
            target,
            quadrics,
            origin,
            stamps: vec![0; mesh.slots()],
            queue: CollapseQueue::new(),
            obstacles: Obstacles::in_slices(mesh, work, pauses).await,
            condition,
            mesh,
        }
    }

    fn is_done(&self) -> bool {
        self.mesh.triangle_count() <= self.target || self.obstacles.is_exhausted()
    }

    async fn queue_all(&mut self, pauses: &Pauses) {
        let edges: Vec<_> = self.mesh.edges().collect();
        let [at_once, work] = QUEUED;
        for some in edges.chunks(at_once) {
            some.iter().for_each(|&(u, v)| self.enqueue(u, v, 0));
            pauses.after(work).await;
        }
    }

    async fn run(&mut self, pauses: &Pauses) {
        let mut before = self.tests();
        while !self.is_done() {
            let stamps = &self.stamps;
            let is_current = |c: &Candidate| c.stamp == c.ends.iter().map(|v| stamps[v.index()]).sum::<u32>();
            let Some(candidate) = self.queue.pop(is_current) else { return };
            let [u, v] = candidate.ends;
            if is_current(&candidate) {
                self.attempt(u, v, candidate.choice);
                let tests = self.tests();
                pauses.after(ATTEMPT + (tests - before) as usize / TESTS_PER_UNIT).await;
                before = tests;
            }
        }
    }

    fn tests(&self) -> u64 {
        self.obstacles.tests() + self.condition.tests()
    }

    /// Collapses the edge `uv` into its candidate position number `choice` if that is safe; otherwise queues the edge
    /// with the next candidate position, if there is one.
    fn attempt(&mut self, u: VertexId, v: VertexId, choice: u8) {
        if self.mesh.can_collapse(u, v).is_err() {
            return;
        }
        let positions = self.positions(u, v);
        let Some(&(_, position)) = positions.get(choice as usize) else { return };
        if !self.is_safe(u, v, position) {
            self.enqueue_at(&positions, u, v, choice + 1);
            return;
        }
        let quadric = self.quadrics[u.index()] + self.quadrics[v.index()];
        // Nothing else can be wrong with it: `can_collapse` has been asked.
        self.condition.adopt(self.mesh, [u, v]);
        if self.mesh.collapse(u, v, position).is_err() {
            return;
        }
        self.quadrics[u.index()] = quadric;
        for end in [u, v] {
            self.stamps[end.index()] += 1;
        }
        self.obstacles.update(self.mesh, u, v);
        let ring = self.mesh.ring(u).clone();
        ring.as_slice().iter().for_each(|&w| self.enqueue(u.min(w), u.max(w), 0));
    }

    /// Queues the edge `uv` with the error of its candidate position number `choice`, if there is one.
    fn enqueue(&mut self, u: VertexId, v: VertexId, choice: u8) {
        self.enqueue_at(&self.positions(u, v), u, v, choice);
    }

    /// Does what [`Self::enqueue`] does, given the candidate positions.
    fn enqueue_at(&mut self, positions: &[RatedPosition], u: VertexId, v: VertexId, choice: u8) {
        if let Some(&(error, _)) = positions.get(choice as usize) {
            let stamp = self.stamp(u, v);
            self.queue.push(Candidate { error: error.to_bits(), ends: [u, v], choice, stamp });
        }
    }

    fn stamp(&self, u: VertexId, v: VertexId) -> u32 {
        self.stamps[u.index()] + self.stamps[v.index()]
    }

    /// Returns the candidate positions, by increasing error, for the vertex that remains after a collapse of the edge
    /// `uv`: the position of least error, if it is determined and finite, the midpoint of the edge and both ends.
    fn positions(&self, u: VertexId, v: VertexId) -> SmallVec<[RatedPosition; 4]> {
        let quadric = self.quadrics[u.index()] + self.quadrics[v.index()];
        let (p, q) = (self.mesh.position(u).as_dvec3(), self.mesh.position(v).as_dvec3());
        let least = quadric.minimizer().map(|position| position + self.origin);
        let positions = least.into_iter().chain([0.5 * (p + q), p, q]).map(DVec3::as_vec3);
        let mut rated: SmallVec<[RatedPosition; 4]> = SmallVec::new();
        for position in positions {
            let error = quadric.evaluate(position.as_dvec3() - self.origin);
            // Only the minimiser can be out of range.
            if error.is_finite() && position.is_finite() {
                let larger = rated.iter().position(|other| other.0.total_cmp(&error).is_gt());
                rated.insert(larger.unwrap_or(rated.len()), (error, position));
            }
        }
        rated
    }

    /// Returns whether collapsing the edge `uv` into `position` turns no triangle by more than 78°, degenerates none
    /// and makes none intersect another, moves no component to the other side of the surface, leaves a valence of at
    /// most 24, and meets the further condition.
    fn is_safe(&mut self, u: VertexId, v: VertexId, position: Vec3) -> bool {
        // Two triangles are removed: each end loses the other, and the two opposite vertices are counted twice.
        let neighbours = self.mesh.ring(u).valence() + self.mesh.ring(v).valence() - 4;
        if neighbours > MAX_NEIGHBOURS {
            return false;
        }
        let mut fresh = SmallVec::<[Facet; MAX_NEIGHBOURS]>::new();
        for (kept, removed) in [(u, v), (v, u)] {
            for (a, b) in self.mesh.ring(kept).pairs().filter(|&(a, b)| a != removed && b != removed) {
                let old = self.mesh.facet([kept, a, b]);
                let new =
                    Facet { corners: [u.0, a.0, b.0], points: [position, old.points[1], old.points[2]] };
                if !may_replace(&old, &new) {
                    return false;
                }
                fresh.push(new);
            }
        }
        self.condition.allows(self.mesh, [u, v], position, &fresh)
            && !self.obstacles.blocks(self.mesh, &fresh, &[u, v])
    }
}

/// Returns whether a collapse may replace the triangle `old` by `new`: it turns by at most 78° and has a nonzero area.
/// A degenerate triangle has no orientation to keep.
fn may_replace(old: &Facet, new: &Facet) -> bool {
    let (before, after) = (triangle::area_vector(old.points), triangle::area_vector(new.points));
    let flips = before.dot(after) < MIN_COSINE * before.length() * after.length();
    !flips && !collinear(new.points)
}

/// Returns the initial quadric of each vertex, by slot: that of the planes of its triangles and, with a small weight,
/// of its position; each triangle is weighted by a third of its area.
fn quadrics(mesh: &Mesh, origin: DVec3) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); mesh.slots()];
    for corners in mesh.triangles() {
        let points = mesh.facet(corners).points;
        let normal = triangle::area_vector(points);
        let share = normal.length() / 6.0;
        let plane = Quadric::of_plane(points[0].as_dvec3() - origin, normal.normalize_or_zero(), share);
        for (v, point) in corners.into_iter().zip(points) {
            quadrics[v.index()] += plane + Quadric::of_point(point.as_dvec3() - origin, POINT_WEIGHT * share);
        }
    }
    quadrics
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn triangles_do_not_turn_over_nor_lose_their_area() {
        let with_tip = |tip: Vec3| Facet { corners: [0, 1, 2], points: [tip, Vec3::ZERO, Vec3::X] };
        let old = with_tip(Vec3::Y);
        for (tip, expected) in [
            (Vec3::new(5.0, 0.1, 0.0), true),
            (Vec3::new(0.0, 1.0, 3.0), true),
            (Vec3::new(0.0, 0.1, 3.0), false),
            (-Vec3::Y, false),
            (Vec3::X * 2.0, false),
        ] {
            assert_eq!(may_replace(&old, &with_tip(tip)), expected, "{tip}");
        }
        let flat = with_tip(Vec3::X * 2.0);
        assert!(
            may_replace(&flat, &old) && may_replace(&flat, &with_tip(-Vec3::Y)) && !may_replace(&flat, &flat)
        );
    }

    #[test]
    fn the_best_place_comes_first() {
        let mut mesh = Mesh::icosphere(Vec3::splat(100.0), 1.0, 0.3).unwrap();
        let decimation = finished(Decimation::new(&mut mesh, 4, Box::new(Unconditional), &Pauses::default()));
        for (u, v) in decimation.mesh.edges() {
            let positions = decimation.positions(u, v);
            assert_eq!(positions.len(), 4);
            assert!(positions.is_sorted_by(|a, b| a.0 <= b.0));
            // The planes around an edge of a sphere meet above it.
            let ends = [u, v].map(|w| decimation.mesh.position(w));
            let height = positions[0].1.distance(Vec3::splat(100.0));
            let sagitta = ends[0].distance_squared(ends[1]) / 8.0;
            assert!(height > 1.0 - sagitta && height < 1.0 + 2.0 * sagitta, "{height}");
        }
    }
}
