//! Narrow phase: tests the triangles at dirty vertices for intersections, and computes new motion bounds.

use super::clearance::{fan_clearance, triangle_clearance};
use super::motion_bound::{Check, Checks};
use super::one_ring::{
    corner_plane_clearance, flat_clearance, intersections_around, intersections_between, mid_plane_clearance,
    plane_clearance, sheet_clearance, spread_clearance,
};
use super::{Embedding, Nearby};
use crate::math::higher;
use crate::mesh::{Mesh, VertexId, sort_distinct};
use crate::pauses::{Pauses, finished};
use std::ops::Range;

/// The clearance of a pair, relative to the ordinary edge, above which no further filter is tried.
const AMPLE: f32 = 0.03;

/// The number of vertices that are checked between two counts of the work, if they have few pairs.
const CHUNK: usize = 32;
/// The number of pairs after which the work is counted: where a mesh intersects itself everywhere, each vertex has
/// thousands.
const MANY_PAIRS: usize = 32 * PAIRS_PER_UNIT;

/// The number of pairs of one-rings whose tests are a unit of work.
const PAIRS_PER_UNIT: usize = 16;

/// Number of pairs of triangles whose comparison takes as long as the test of a pair of vertices.
const COMPARED_PER_PAIR: usize = 32;

/// The largest number of vertices near one that are looked through for another: where a mesh intersects itself
/// everywhere, time would be cubic.
const MOST_CERTIFIED: usize = 256;

/// The valence above which a ring is tested in parts, of about the square of it in pairs of triangles.
const WIDE: usize = 128;

/// The number of corners found, for each vertex of the mesh, among which many have been found before.
const REPEATED: usize = 16;

/// The checks that test pairs of triangles.
const PAIRS: [Check; 2] = [Check::OneRing, Check::Nearby];

impl Embedding {
    /// Runs all collision checks at every vertex, as [`Self::check_dirty`] does but regardless of certificates; returns
    /// the corners of all triangles that intersect another, sorted by id.
    pub(super) fn check_all(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        finished(self.check_all_in_slices(mesh, &Pauses::default()))
    }

    /// Does what [`Self::check_all`] does, and pauses meanwhile.
    pub(super) async fn check_all_in_slices(&mut self, mesh: &Mesh, pauses: &Pauses) -> Vec<VertexId> {
        self.sync_without_cells(mesh);
        self.resize_for_checks(mesh);
        mesh.vertices().for_each(|v| self.mark_dirty(v, Checks::ALL));
        pauses.now().await;
        self.check(mesh, true, pauses).await
    }

    /// Runs the pending collision checks of all vertices that have any, and stores the clearances found as motion
    /// bounds and certificates. Returns the corners of all triangles that intersect another, sorted by id.
    pub(super) fn check_dirty(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        finished(self.check_dirty_in_slices(mesh, &Pauses::default()))
    }

    /// Does what [`Self::check_dirty`] does, and pauses meanwhile.
    pub(super) async fn check_dirty_in_slices(&mut self, mesh: &Mesh, pauses: &Pauses) -> Vec<VertexId> {
        self.check(mesh, false, pauses).await
    }

    async fn check(&mut self, mesh: &Mesh, anew: bool, pauses: &Pauses) -> Vec<VertexId> {
        let dirty = std::mem::take(&mut self.dirty);
        self.update_pairs(mesh, &dirty, pauses).await;
        if self.is_crowded {
            // Whatever is found is void.
            dirty.iter().for_each(|v| self.pending[v.index()] = Checks::default());
            return Vec::new();
        }
        for (&v, check) in dirty.iter().flat_map(|v| PAIRS.map(|check| (v, check))) {
            if self.pending[v.index()].has(check) {
                self.motion_bounds[v.index()].set(check, f32::INFINITY);
            }
        }
        for &v in dirty.iter().filter(|v| self.pending[v.index()].has(Check::OneRing)) {
            self.certificates.prepare(v, mesh.ring(v).valence(), anew);
        }
        let mut intersecting = Vec::new();
        let mut left = dirty.iter();
        while !left.as_slice().is_empty() {
            let mut pairs = 0;
            for &v in left.by_ref().take(CHUNK) {
                pairs += if mesh.ring(v).valence() > WIDE {
                    self.check_wide_ring(mesh, v, &mut intersecting, pauses).await
                } else {
                    self.check_vertex(mesh, v, &mut intersecting)
                        + std::mem::take(&mut self.compared) / COMPARED_PER_PAIR
                };
                if pairs >= MANY_PAIRS {
                    break;
                }
            }
            pauses.after(pairs / PAIRS_PER_UNIT).await;
            keep_few(&mut intersecting, mesh);
        }
        dirty.iter().for_each(|v| self.pending[v.index()] = Checks::default());
        self.tolerated.remove_from(&mut intersecting);
        sort_distinct(&mut intersecting);
        intersecting
    }

    /// Does what [`Self::check_vertex`] does, with pauses between parts of the ring: each triangle is tested with all others,
    /// and there may be thousands.
    async fn check_wide_ring(
        &mut self,
        mesh: &Mesh,
        v: VertexId,
        intersecting: &mut Vec<VertexId>,
        pauses: &Pauses,
    ) -> usize {
        let valence = mesh.ring(v).valence();
        // Of each triangle with all others, and of the four or more at a neighbour with all.
        let work = |part: Range<usize>| part.len() * valence / PAIRS_PER_UNIT;
        let step = (WIDE * WIDE / valence).max(1);
        let parts = |count: usize| (0..count).step_by(step).map(move |first| first..count.min(first + step));
        if self.pending[v.index()].has(Check::OneRing) {
            if self.lacks_clearance_around(mesh, v) {
                pauses.after(valence).await;
                for part in parts(valence) {
                    intersections_around(mesh, v, part.clone(), self.output.as_ref(), intersecting);
                    keep_few(intersecting, mesh);
                    pauses.after(work(part)).await;
                }
            }
            for part in parts(valence) {
                self.check_along_edges(mesh, v, part.clone(), intersecting);
                keep_few(intersecting, mesh);
                pauses.after(work(part)).await;
            }
        }
        if !self.pending[v.index()].has(Check::Nearby) {
            return 0;
        }
        for part in parts(self.near(v).len()) {
            self.check_nearby(mesh, v, part.clone(), intersecting);
            keep_few(intersecting, mesh);
            pauses.after(work(part)).await;
        }
        self.near(v).len()
    }

    /// Runs the pending collision checks of a vertex; returns about how many pairs were tested.
    fn check_vertex(&mut self, mesh: &Mesh, v: VertexId, intersecting: &mut Vec<VertexId>) -> usize {
        let pending = self.pending[v.index()];
        let mut pairs = 0;
        if pending.has(Check::OneRing) {
            let valence = mesh.ring(v).valence();
            if self.lacks_clearance_around(mesh, v) {
                intersections_around(mesh, v, 0..valence, self.output.as_ref(), intersecting);
            }
            self.check_along_edges(mesh, v, 0..valence, intersecting);
            pairs += valence;
        }
        if pending.has(Check::Nearby) {
            let near = self.near(v).len();
            self.check_nearby(mesh, v, 0..near, intersecting);
            pairs += near;
        }
        pairs
    }

    /// Lowers the motion bounds of a vertex to the clearance between the triangles at it; returns whether there is none,
    /// so that they have to be tested.
    fn lacks_clearance_around(&mut self, mesh: &Mesh, v: VertexId) -> bool {
        if let Some(left) = self.certificates.left_of_own(v) {
            self.lower_bounds(Check::OneRing, [v, v], left);
            return false;
        }
        let longest = self.longest[v.index()];
        let mut clearance = flat_clearance(mesh, v, longest);
        if !self.is_ample(clearance) {
            clearance = higher(clearance, fan_clearance(mesh, v, longest));
        }
        let clearance = self.or_zero(clearance);
        self.lower_bounds(Check::OneRing, [v, v], clearance);
        self.certificates.set_own(v, clearance);
        clearance == 0.0
    }

    /// Checks the pairs of a vertex and its neighbours with the given numbers in its ring.
    fn check_along_edges(
        &mut self,
        mesh: &Mesh,
        v: VertexId,
        neighbours: Range<usize>,
        intersecting: &mut Vec<VertexId>,
    ) {
        let ring = mesh.ring(v).as_slice();
        let mut right = ring[if neighbours.start == 0 { ring.len() } else { neighbours.start } - 1];
        for k in neighbours {
            let (w, left) = (ring[k], ring[if k + 1 == ring.len() { 0 } else { k + 1 }]);
            if let Some(remaining) = self.certificates.left_along([v, w], k) {
                self.lower_bounds(Check::OneRing, [v, w], remaining);
            } else if !self.is_checked_from(w, v, Check::OneRing) {
                let clearance = self.clearance_along_edge(mesh, [v, w], [left, right]);
                let until = self.record_clearance(mesh, [v, w], Check::OneRing, clearance, intersecting);
                self.certificates.set_along(v, k, until);
                if let Some(position) = mesh.ring(w).position(v) {
                    self.certificates.set_along(w, position, until);
                }
            }
            right = w;
        }
    }

    fn clearance_along_edge(&mut self, mesh: &Mesh, pair: [VertexId; 2], opposite: [VertexId; 2]) -> f32 {
        let longest = self.longest_of(pair[0], pair[1]);
        let mut clearance = plane_clearance(mesh, pair, opposite, longest);
        if !self.is_ample(clearance) {
            clearance = higher(clearance, spread_clearance(mesh, pair, opposite, longest));
        }
        self.or_triangle_clearance(mesh, pair, clearance)
    }

    /// Checks the pairs of a vertex and those near it with the given numbers in its list.
    fn check_nearby(
        &mut self,
        mesh: &Mesh,
        v: VertexId,
        near: Range<usize>,
        intersecting: &mut Vec<VertexId>,
    ) {
        for k in near {
            let Nearby { vertex: w, until } = self.near(v)[k];
            // Edits may have changed either vertex since the pair was found.
            if !mesh.is_live(w) || w == v || mesh.ring(v).contains(w) {
                continue;
            }
            if let Some(left) = self.certificates.left([v, w], until) {
                self.lower_bounds(Check::Nearby, [v, w], left);
            } else if !self.is_checked_from(w, v, Check::Nearby) {
                let clearance = self.nearby_clearance(mesh, [v, w]);
                let clearance = self.or_triangle_clearance(mesh, [v, w], clearance);
                let until = self.record_clearance(mesh, [v, w], Check::Nearby, clearance, intersecting);
                self.certify_nearby(v, k, until);
                // Without it, the pair is tested once more at worst.
                if self.near(w).len() <= MOST_CERTIFIED
                    && let Some(position) = self.position_of(w, v)
                {
                    self.certify_nearby(w, position, until);
                }
            }
        }
    }

    /// Lowers the motion bounds of a pair of vertices to the clearance of their one-rings, or runs exact tests if there
    /// is none; returns the sum of odometer readings up to which the pair is certified not to intersect.
    fn record_clearance(
        &mut self,
        mesh: &Mesh,
        pair: [VertexId; 2],
        check: Check,
        clearance: f32,
        intersecting: &mut Vec<VertexId>,
    ) -> f32 {
        let clearance = self.or_zero(clearance);
        self.lower_bounds(check, pair, clearance);
        if clearance == 0.0 {
            intersections_between(mesh, pair, self.output.as_ref(), intersecting);
        }
        self.certificates.until(pair, clearance)
    }

    /// Returns the clearance between the one-rings of two non-adjacent vertices, how far all vertices may move before
    /// they can intersect, by separating planes; not positive if the planes tried do not separate them.
    fn nearby_clearance(&self, mesh: &Mesh, [v, w]: [VertexId; 2]) -> f32 {
        let longest = self.longest_of(v, w);
        if let Some(edge) = common_edge(mesh, v, w) {
            return plane_clearance(mesh, [v, w], edge, longest);
        }
        match *mesh.common_neighbours(v, w) {
            [] => {
                let clearance = mid_plane_clearance(mesh, [v, w], longest);
                if self.is_ample(clearance) {
                    clearance
                } else {
                    higher(clearance, sheet_clearance(mesh, [v, w], longest))
                }
            }
            [c] => corner_plane_clearance(mesh, [v, w], c, longest),
            [c, d] => plane_clearance(mesh, [v, w], [c, d], longest),
            _ => 0.0,
        }
    }

    /// Returns `clearance`, which planes between two one-rings have given, if it is above [`AMPLE`]; otherwise the
    /// clearance between their individual triangles, if that is larger.
    fn or_triangle_clearance(&mut self, mesh: &Mesh, [v, w]: [VertexId; 2], clearance: f32) -> f32 {
        if self.is_ample(clearance) {
            return clearance;
        }
        self.compared += mesh.ring(v).valence() * mesh.ring(w).valence();
        higher(clearance, triangle_clearance(mesh, [v, w], self.longest_of(v, w), AMPLE * self.ordinary_edge))
    }

    /// Returns `clearance`, or 0 if it is so small that exact tests have to decide whether triangles intersect.
    fn or_zero(&self, clearance: f32) -> f32 {
        if clearance > self.exact_below() { clearance } else { 0.0 }
    }

    fn lower_bounds(&mut self, check: Check, ends: [VertexId; 2], clearance: f32) {
        ends.into_iter().for_each(|v| self.motion_bounds[v.index()].lower(check, clearance));
    }

    fn is_ample(&self, clearance: f32) -> bool {
        clearance > AMPLE * self.ordinary_edge
    }

    /// Returns whether the pair `w`, `v` is tested when the check is run at `w`, so that `v` can skip it.
    pub(super) fn is_checked_from(&self, w: VertexId, v: VertexId, check: Check) -> bool {
        w < v && self.pending[w.index()].has(check)
    }

    fn longest_of(&self, v: VertexId, w: VertexId) -> f32 {
        let (a, b) = (self.longest[v.index()], self.longest[w.index()]);
        if a > b { a } else { b }
    }
}

/// Removes what is found several times from the corners of intersecting triangles, if they are many: where a mesh
/// intersects itself everywhere, each is found thousands of times.
fn keep_few(intersecting: &mut Vec<VertexId>, mesh: &Mesh) {
    if intersecting.len() > REPEATED * mesh.vertex_count() {
        sort_distinct(intersecting);
    }
}

/// Returns the ends of an edge across which `v` and `w` are opposite each other, `None` if there is none.
fn common_edge(mesh: &Mesh, v: VertexId, w: VertexId) -> Option<[VertexId; 2]> {
    let opposite = |(a, b): (VertexId, VertexId)| {
        // Of the two rings that tell, the shorter one: the other may have thousands.
        let (of_a, of_b) = (mesh.ring(a), mesh.ring(b));
        if of_a.valence() <= of_b.valence() { of_a.before(b) } else { of_b.after(a) }
    };
    mesh.ring(v).pairs().find(|&pair| opposite(pair) == Some(w)).map(|(a, b)| [a, b])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core_tests::common::{assert_at_least, seeds};
    use crate::math::{Random, Vec3};
    use crate::mesh::{TriangleMesh, intersecting_pairs, shapes};
    use crate::pauses::advance;
    use std::task::Poll;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn any(random: &mut Random) -> Vec3 {
        Vec3::new(random.unit() as f32, random.unit() as f32, random.unit() as f32) * 2.0 - 1.0
    }

    fn one_of<const N: usize>(random: &mut Random, values: [f32; N]) -> f32 {
        values[random.below(N as u32) as usize]
    }

    /// Returns a random closed component: smooth, rough or crumpled, possibly flat, with a needle or with coincident
    /// vertices.
    fn part(random: &mut Random) -> Mesh {
        let mut mesh = match random.below(8) {
            0 => Mesh::icosphere(Vec3::ZERO, 1.0, 1.0).unwrap(),
            1..4 => Mesh::from_triangles(&shapes::torus(0.7, 0.3, 5, 4)).unwrap(),
            _ => Mesh::icosahedron(Vec3::ZERO, 1.0),
        };
        let rough = one_of(random, [0.0, 1e-6, 0.05, 0.2, 1.0]);
        let squash = Vec3::new(1.0, 1.0, one_of(random, [1.0, 1.0, 1.0, 0.5, 1e-3, 1e-9, 0.0]));
        let size = one_of(random, [1.0, 1.0, 1.0, 0.1, 1e-4, 50.0]);
        let offset = any(random) * one_of(random, [0.0, 1.0, 3.0]);
        for p in mesh.positions_mut() {
            *p = (*p + any(random) * rough) * squash * size + offset;
        }
        let count = mesh.slots() as u32;
        let [v, w] = [(); 2].map(|()| VertexId(random.below(count)));
        match random.below(6) {
            0 => mesh.set_position(v, mesh.position(w)),
            1 => mesh.set_position(v, any(random) * 5.0),
            2 => mesh.set_position(v, any(random) * 1e4),
            _ => {}
        }
        mesh
    }

    fn crumpled(random: &mut Random) -> Mesh {
        let mut mesh = part(random);
        for _ in 0..random.below(3) {
            mesh.append(&part(random)).unwrap();
        }
        let offset = any(random) * one_of(random, [0.0, 0.0, 10.0, 1e4, 1e7]);
        mesh.positions_mut().iter_mut().for_each(|p| *p += offset);
        mesh
    }

    /// Returns the corners of the triangles that intersect another, found by testing all pairs.
    fn expected(mesh: &Mesh) -> Vec<VertexId> {
        let triangles = mesh.to_triangles();
        let vertices: Vec<VertexId> = mesh.vertices().collect();
        let corners = |t: u32| triangles.triangles[t as usize].map(|v| vertices[v as usize]);
        let mut intersecting: Vec<VertexId> =
            intersecting_pairs(&triangles).into_iter().flatten().flat_map(corners).collect();
        intersecting.sort_unstable();
        intersecting.dedup();
        intersecting
    }

    /// Returns a double cone around a star polygon of `n` corners, each side of which crosses most others.
    fn star(n: usize) -> Mesh {
        let corner = |j: usize| {
            let angle = (j * (n / 2 - 1)) as f64 / n as f64 * std::f64::consts::TAU;
            Vec3::new(libm::cos(angle) as f32, libm::sin(angle) as f32, (j % 7) as f32 * 0.01)
        };
        let positions = (0..n).map(corner).chain([Vec3::Z, -Vec3::Z]).collect();
        let [top, bottom] = [n as u32, n as u32 + 1];
        let sides = (0..n as u32).map(|j| (j, (j + 1) % n as u32));
        let triangles = sides.flat_map(|(j, k)| [[j, k, top], [k, j, bottom]]).collect();
        Mesh::from_triangles(&TriangleMesh { positions, triangles, ..TriangleMesh::default() }).unwrap()
    }

    /// Regression: thousands of triangles at a vertex were tested at once, and each intersection was stored.
    #[test]
    fn wide_rings_are_tested_in_parts_with_the_same_result() {
        let mesh = star(3 * WIDE);
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 1.0);
        let pauses = Pauses::default();
        let mut check = Box::pin(embedding.check_all_in_slices(&mesh, &pauses));
        let (mut slices, mut longest, mut before) = (0, 0, 0);
        let found = loop {
            let state = advance(&mut check);
            longest = longest.max(pauses.work() - before);
            (slices, before) = (slices + 1, pauses.work());
            if let Poll::Ready(found) = state {
                break found;
            }
        };
        assert_eq!(found, expected(&mesh));
        // A unit takes some microseconds, and a slice has 500.
        assert!(slices > 20 && longest < 3000, "{slices} slices of up to {longest}");
    }

    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    #[test]
    fn intersections_of_random_meshes_are_those_of_all_pairs() {
        let (mut separate, mut intersecting) = (0, 0);
        let seeds = seeds(200);
        let least = seeds.end as usize / 10;
        for seed in seeds {
            let random = &mut Random::new(seed);
            let mesh = crumpled(random);
            let mut embedding = Embedding::default();
            embedding.sync_with_edge(&mesh, one_of(random, [1.0, 0.3, 5.0, 1e-3]));
            let found = embedding.check_all(&mesh);
            assert_eq!(found, expected(&mesh), "seed {seed}");
            if found.is_empty() { separate += 1 } else { intersecting += 1 }
        }
        assert_at_least(least, separate, "meshes without self-intersections");
        assert_at_least(least, intersecting, "meshes with self-intersections");
    }

    #[test]
    fn a_sweep_and_a_search_around_each_vertex_find_the_same() {
        for seed in 0..1000 {
            let random = &mut Random::new(seed);
            let mesh = crumpled(random);
            let mut embedding = Embedding::default();
            embedding.sync_with_edge(&mesh, one_of(random, [1.0, 0.3, 5.0]));
            let dirty: Vec<VertexId> = mesh.vertices().filter(|_| random.below(3) > 0).collect();
            embedding.resize_for_checks(&mesh);
            dirty.iter().for_each(|&v| embedding.mark_dirty(v, Checks::ALL));
            embedding.may_touch.fill(false);
            let (mut swept, mut searched) = (embedding.clone(), embedding);
            finished(swept.sweep(&mesh, &Pauses::default()));
            searched.grid.link_cells();
            finished(searched.search(&mesh, &dirty, &Pauses::default()));
            for v in mesh.vertices() {
                let [swept, searched] = [&swept, &searched].map(|embedding| {
                    let mut near: Vec<VertexId> = embedding.near(v).iter().map(|near| near.vertex).collect();
                    near.sort_unstable();
                    near
                });
                assert_eq!(swept, searched, "seed {seed}");
            }
            assert_eq!(swept.may_touch, searched.may_touch, "seed {seed}");
        }
    }

    #[test]
    fn appended_components_are_tested_against_everything() {
        let (mut separate, mut intersecting) = (0, 0);
        for seed in 0..300 {
            let random = &mut Random::new(seed);
            let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.5).unwrap();
            let mut embedding = Embedding::default();
            embedding.sync_with_edge(&mesh, 0.6);
            let mut displacements = vec![Vec3::X * 0.01; mesh.slots()];
            embedding.move_all(&mut mesh, &mut displacements);
            let parts = Mesh::icosphere(any(random) * 1.6, 0.4, 0.3).unwrap();
            let (added, found) = embedding.append(&mut mesh, &parts).unwrap();
            assert_eq!(added.len(), parts.vertex_count());
            assert_eq!(found, expected(&mesh), "seed {seed}");
            *if found.is_empty() { &mut separate } else { &mut intersecting } += 1;
            // Motion bounds remain valid for old vertices, and new ones move like all others.
            let mut displacements = vec![Vec3::X * 0.02; mesh.slots()];
            embedding.move_all(&mut mesh, &mut displacements);
            assert_eq!(embedding.check_all(&mesh), expected(&mesh), "seed {seed}");
        }
        assert!(separate > 50 && intersecting > 50, "{separate} sound, {intersecting} intersecting");
    }

    /// A new component reuses the slots of a removed one, and must not inherit its motion bounds.
    #[test]
    fn components_in_slots_of_removed_ones_are_tested() {
        let mut intersecting = 0;
        for seed in 0..300 {
            let random = &mut Random::new(seed);
            let mut mesh = Mesh::icosahedron(Vec3::ZERO, 1.0);
            let first = mesh.slots();
            mesh.append(&Mesh::icosahedron(Vec3::X * 1.6, 0.8)).unwrap();
            let mut embedding = Embedding::default();
            embedding.sync_with_edge(&mesh, 1.2);
            assert!(embedding.check_all(&mesh).is_empty());
            // Slots are reused in the order in which vertices are found.
            let members = mesh.component_of(VertexId::from_index(first), usize::MAX);
            let position = |v: VertexId| members.iter().position(|&w| w == v).unwrap() as u32;
            let closer = any(random) * 0.03 - Vec3::X * 0.08;
            let mut component = TriangleMesh {
                positions: members.iter().map(|&v| mesh.position(v) + closer).collect(),
                ..TriangleMesh::default()
            };
            let of_component = mesh.triangles().filter(|corners| corners[0].index() >= first);
            component.triangles.extend(of_component.map(|corners| corners.map(position)));
            let component = Mesh::from_triangles(&component).unwrap();
            embedding.remove_component(&mut mesh, members[0]);
            let (added, found) = embedding.append(&mut mesh, &component).unwrap();
            assert_eq!(added, members);
            assert_eq!(found, expected(&mesh), "seed {seed}");
            intersecting += u32::from(!found.is_empty());
        }
        assert!(intersecting > 100, "{intersecting} intersecting");
    }
}
