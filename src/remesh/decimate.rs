//! Fewer triangles for the same surface: edges are drawn together in the order of the error that this makes (Garland &
//! Heckbert, *Surface simplification using quadric error metrics*, 1997).
//!
//! Guarantees: closed, oriented and manifold stays so, with the same components and χ; no triangle turns over; where
//! the surface did not cross itself, it never does, and no component comes to lie on the other side of another. Each
//! edge is tested for all of this before it is drawn together, exactly as far as crossing goes. Not guaranteed: a bound
//! on the error.

use super::obstacles::{Obstacles, facet};
use crate::math::predicates::collinear;
use crate::math::{DVec3, Quadric, Vec3, triangle};
use crate::mesh::{Facet, Mesh, VertexId};
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What the squared distance from a vertex's old places counts beside that from the planes. It decides where planes
/// do not, on flat parts: with none, needles grow there and the minimiser is anywhere; with a hundredth, detail is
/// rounded off.
const POINT_WEIGHT: f64 = 1e-4;

/// A vertex may not end up with more neighbours: needles would meet in it, and the test for crossing is quadratic in them.
const MOST_NEIGHBOURS: usize = 24;

/// The least cosine between the normals of a triangle before and after: it may turn by 78°.
const LEAST_COSINE: f64 = 0.2;

/// How often edges that were refused are tried again after the others are done. A refused edge may be free once its
/// neighbours are gone; the third round hardly finds any.
const ROUNDS: usize = 4;

/// Pairs of a triangle and a box that are looked at for each triangle of the mesh. A few hundred are common; without a
/// bound, triangles that are all in each other's boxes would take forever.
const WORK_PER_TRIANGLE: u64 = 10_000;

/// Draws edges together until at most `target_triangles` are left, or no edge can be drawn together safely; returns how
/// many were. Ids then mean nothing any more, as the vertices are numbered anew.
///
/// Each takes two triangles. A component has four at least. What crosses already keeps its triangles, as far as drawing
/// them together would leave it crossing. Attributes of the vertex that stays are the mean of both.
pub fn decimate(mesh: &mut Mesh, target_triangles: usize) -> usize {
    if mesh.triangle_count() <= target_triangles {
        return 0;
    }
    let before = mesh.vertex_count();
    let mut decimation = Decimation::new(mesh, target_triangles);
    for _ in 0..ROUNDS {
        let vertices = decimation.mesh.vertex_count();
        decimation.queue_all();
        decimation.run();
        if decimation.is_done() || decimation.mesh.vertex_count() == vertices {
            break;
        }
    }
    mesh.reorder();
    before - mesh.vertex_count()
}

struct Decimation<'a> {
    mesh: &'a mut Mesh,
    target: usize,
    /// The error of a place, about `origin`, by vertex slot.
    quadrics: Vec<Quadric>,
    /// Where coordinates of quadrics are counted from: far from it they would lose digits.
    origin: DVec3,
    /// How often each vertex was drawn together with another, by slot.
    stamps: Vec<u32>,
    queue: BinaryHeap<Reverse<Candidate>>,
    obstacles: Obstacles,
}

/// An edge that may be drawn together. The order is that of the error; ties go to the lower ids.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// Its bits, which for numbers that are not negative are in the order of the numbers.
    error: u64,
    ends: [VertexId; 2],
    /// Which of the places for the vertex, from the one with the least error on.
    choice: u8,
    /// The sum of the stamps of the ends: another than now, and the candidate is out of date.
    stamp: u32,
}

/// A place for the vertex that stays, and its error.
type Place = (f64, Vec3);

impl<'a> Decimation<'a> {
    fn new(mesh: &'a mut Mesh, target: usize) -> Self {
        let origin = mesh.vertices().next().map_or(DVec3::ZERO, |v| mesh.position(v).as_dvec3());
        let work = WORK_PER_TRIANGLE * mesh.triangle_count() as u64;
        Self {
            target,
            quadrics: quadrics(mesh, origin),
            origin,
            stamps: vec![0; mesh.slots()],
            queue: BinaryHeap::new(),
            obstacles: Obstacles::new(mesh, work),
            mesh,
        }
    }

    fn is_done(&self) -> bool {
        self.mesh.triangle_count() <= self.target || self.obstacles.is_exhausted()
    }

    fn queue_all(&mut self) {
        let edges: Vec<_> = self.mesh.edges().collect();
        edges.into_iter().for_each(|(u, v)| self.offer(u, v, 0));
    }

    fn run(&mut self) {
        while !self.is_done() {
            let Some(Reverse(candidate)) = self.queue.pop() else { return };
            let [u, v] = candidate.ends;
            if candidate.stamp == self.stamp(u, v) {
                self.attempt(u, v, candidate.choice);
            }
        }
    }

    /// Draws the edge together if that is safe; else offers it again with the next choice of place.
    fn attempt(&mut self, u: VertexId, v: VertexId, choice: u8) {
        if self.mesh.can_collapse(u, v).is_err() {
            return;
        }
        let Some(&(_, place)) = self.places(u, v).get(choice as usize) else { return };
        if !self.is_safe(u, v, place) {
            self.offer(u, v, choice + 1);
            return;
        }
        let quadric = self.quadrics[u.index()] + self.quadrics[v.index()];
        if self.mesh.collapse(u, v, place).is_err() {
            return;
        }
        self.quadrics[u.index()] = quadric;
        for end in [u, v] {
            self.stamps[end.index()] += 1;
        }
        self.obstacles.follow(self.mesh, u, v);
        let ring = self.mesh.ring(u).clone();
        ring.as_slice().iter().for_each(|&w| self.offer(u.min(w), u.max(w), 0));
    }

    /// Queues the edge with the error of the given choice of place, if there is that choice.
    fn offer(&mut self, u: VertexId, v: VertexId, choice: u8) {
        if let Some(&(error, _)) = self.places(u, v).get(choice as usize) {
            let stamp = self.stamp(u, v);
            self.queue.push(Reverse(Candidate { error: error.to_bits(), ends: [u, v], choice, stamp }));
        }
    }

    fn stamp(&self, u: VertexId, v: VertexId) -> u32 {
        self.stamps[u.index()] + self.stamps[v.index()]
    }

    /// Where the vertex that stays may go, least error first: the place where that is least, the middle, either end.
    fn places(&self, u: VertexId, v: VertexId) -> SmallVec<[Place; 4]> {
        let quadric = self.quadrics[u.index()] + self.quadrics[v.index()];
        let (p, q) = (self.mesh.position(u).as_dvec3(), self.mesh.position(v).as_dvec3());
        let least = quadric.least().map(|place| place + self.origin);
        let places = least.into_iter().chain([0.5 * (p + q), p, q]).map(DVec3::as_vec3);
        let rated = places.map(|place| (quadric.at(place.as_dvec3() - self.origin), place));
        // Only the place of least error can be out of range.
        let mut places: SmallVec<[Place; 4]> =
            rated.filter(|(error, place)| error.is_finite() && place.is_finite()).collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        places
    }

    /// Whether nothing turns over, loses its area or crosses where the edge is drawn together into `place`.
    fn is_safe(&mut self, u: VertexId, v: VertexId, place: Vec3) -> bool {
        // The two triangles at the edge go: each end loses the other, and the two opposite are neighbours of both.
        let neighbours = self.mesh.ring(u).valence() + self.mesh.ring(v).valence() - 4;
        if neighbours > MOST_NEIGHBOURS {
            return false;
        }
        let mut fresh = SmallVec::<[Facet; MOST_NEIGHBOURS]>::new();
        for (kept, gone) in [(u, v), (v, u)] {
            for (a, b) in self.mesh.ring(kept).pairs().filter(|&(a, b)| a != gone && b != gone) {
                let old = facet(self.mesh, [kept, a, b]);
                let new = Facet { corners: [u.0, a.0, b.0], points: [place, old.points[1], old.points[2]] };
                if !may_become(&old, &new) {
                    return false;
                }
                fresh.push(new);
            }
        }
        !self.obstacles.block(self.mesh, &fresh, &[u, v])
    }
}

/// Whether a triangle keeps an area and does not turn over. One without area has no side to turn from.
fn may_become(old: &Facet, new: &Facet) -> bool {
    let (before, after) = (triangle::area_vector(old.points), triangle::area_vector(new.points));
    let turns = before.dot(after) < LEAST_COSINE * before.length() * after.length();
    !turns && !collinear(new.points)
}

/// For each vertex the planes of the triangles around it, and a little of its own place, by a third of their area.
fn quadrics(mesh: &Mesh, origin: DVec3) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); mesh.slots()];
    for corners in mesh.triangles() {
        let points = facet(mesh, corners).points;
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
            assert_eq!(may_become(&old, &with_tip(tip)), expected, "{tip}");
        }
        let flat = with_tip(Vec3::X * 2.0);
        assert!(
            may_become(&flat, &old) && may_become(&flat, &with_tip(-Vec3::Y)) && !may_become(&flat, &flat)
        );
    }

    #[test]
    fn the_best_place_comes_first() {
        let mut mesh = Mesh::icosphere(Vec3::splat(100.0), 1.0, 0.3).unwrap();
        let decimation = Decimation::new(&mut mesh, 4);
        for (u, v) in decimation.mesh.edges() {
            let places = decimation.places(u, v);
            assert_eq!(places.len(), 4);
            assert!(places.is_sorted_by(|a, b| a.0 <= b.0));
            // The planes around an edge of a ball meet above it.
            let ends = [u, v].map(|w| decimation.mesh.position(w));
            let height = places[0].1.distance(Vec3::splat(100.0));
            let sagitta = ends[0].distance_squared(ends[1]) / 8.0;
            assert!(height > 1.0 - sagitta && height < 1.0 + 2.0 * sagitta, "{height}");
        }
    }
}
