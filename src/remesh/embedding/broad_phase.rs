//! Broad phase: finds pairs of non-adjacent vertices that are so near each other that their triangles may intersect
//! soon.

use super::motion_bound::Check;
use super::{Embedding, NEAREST_CORNER, Nearby, PIERCING, SEARCH_SKIN};
use crate::math::order::{combined_rank, sort_ranks};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, MeshError, VertexId, sort_distinct};
use crate::pauses::Pauses;
use crate::spatial::{Proximity, VertexBall, near_pairs};

/// The whole mesh is swept for near vertices if at least one vertex in this many has a pending search for its
/// neighbours; otherwise the grid is queried around these vertices only. Tuned by timing.
const MANY: usize = 8;

/// The number of pairs of vertices whose tests are a unit of work.
const TESTS_PER_UNIT: usize = 256;

/// The largest number of pairs of near vertices that a sweep stores, for each vertex and at least; each takes about 40
/// bytes. Usual meshes have two or three a vertex; those with edges of very different lengths, or that intersect themselves
/// everywhere, have hundreds.
const MOST_PAIRS: [usize; 2] = [16, 1 << 23];

fn most_pairs(mesh: &Mesh) -> usize {
    MOST_PAIRS[1].max(MOST_PAIRS[0].saturating_mul(mesh.vertex_count()))
}

impl Embedding {
    /// Measures the longest edge at each of the `dirty` vertices; for those with a pending search for non-adjacent
    /// vertices near them, updates the position in the grid and finds the pairs anew.
    pub(super) async fn update_pairs(&mut self, mesh: &Mesh, dirty: &[VertexId], pauses: &Pauses) {
        let is_entered = self.entered == Some(mesh.geometry_version());
        let count = dirty.iter().filter(|&&v| self.is_searched_around(v)).count();
        let many = MANY * count >= mesh.vertex_count();
        if many {
            self.grid.unlink_cells();
        } else if count > 0 {
            self.grid.link_cells();
        }
        for &v in dirty {
            if !is_entered {
                self.measure(mesh, v);
            }
            if self.is_searched_around(v) {
                if let Some(near) = &mut self.nearby[v.index()] {
                    near.clear();
                }
                self.may_touch[v.index()] = false;
                self.motion_bounds[v.index()].set(Check::Search, SEARCH_SKIN * self.ordinary_edge);
                if !is_entered {
                    self.enter(mesh, v);
                }
            }
        }
        if many {
            self.sweep(mesh, pauses).await;
        } else if count > 0 {
            self.search(mesh, dirty, pauses).await;
        }
    }

    fn is_searched_around(&self, v: VertexId) -> bool {
        self.pending[v.index()].has(Check::Search)
    }

    /// Finds pairs of non-adjacent vertices near each other by a sweep over the part of the mesh that is searched, and
    /// stores those of which at least one has a pending search.
    pub(super) async fn sweep(&mut self, mesh: &Mesh, pauses: &Pauses) {
        let proximity = self.proximity();
        let (mut searched, mut longest) = (Bounds::EMPTY, 0.0f32);
        for ball in mesh.vertices().map(|v| self.grid.ball(v)) {
            longest = if ball.radius > longest { ball.radius } else { longest };
            if self.is_searched_around(ball.vertex) {
                searched = searched.union(&Bounds::from_points(&[ball.position]));
            }
        }
        // Others are too far from all that are searched around, up to rounding.
        let reach = Vec3::splat(2.0 * proximity.distance_for(longest, longest));
        let wide = Bounds { min: searched.min - reach, max: searched.max + reach };
        let is_near = |v: &VertexId| wide.contains(self.grid.position(*v));
        let mut balls = Vec::with_capacity(mesh.vertices().filter(is_near).count());
        balls.extend(mesh.vertices().filter(is_near).map(|v| self.grid.ball(v)));
        pauses.now().await;
        let most = if self.limits_pairs { most_pairs(mesh) } else { usize::MAX };
        self.swept = 0;
        let add = |a: &VertexBall, b: &VertexBall| {
            if self.is_searched_around(a.vertex) || self.is_searched_around(b.vertex) {
                self.add_pair(mesh, a, b, proximity);
                self.swept += 1;
            }
            self.swept < most
        };
        near_pairs(balls, proximity, add, pauses).await;
        self.is_crowded |= self.swept >= most;
    }

    /// Sets whether sweeps end at the number of pairs of near vertices for which there is memory. If they do, the caller has
    /// to ask [`Self::check_pairs`] after checks and moves.
    pub fn set_limits_pairs(&mut self, limits_pairs: bool) {
        self.limits_pairs = limits_pairs;
    }

    /// Returns an error if a sweep has found more pairs of near vertices than there is memory for; the results of checks and
    /// moves since then are void.
    ///
    /// # Errors
    /// [`MeshError::TooCrowded`].
    pub fn check_pairs(&self, mesh: &Mesh) -> Result<(), MeshError> {
        if self.is_crowded { Err(MeshError::TooCrowded { pairs: most_pairs(mesh) }) } else { Ok(()) }
    }

    /// Finds pairs of non-adjacent vertices near each other, of which at least one is `dirty` and has a pending search,
    /// by grid queries, one for all those in the same cell.
    pub(super) async fn search(&mut self, mesh: &Mesh, dirty: &[VertexId], pauses: &Pauses) {
        let proximity = self.proximity();
        let searched = dirty.iter().filter(|&&v| self.is_searched_around(v));
        let mut searched: Vec<u64> = searched.map(|&v| combined_rank(self.grid.cell_key(v), v.0)).collect();
        sort_ranks(&mut searched);
        let vertex = |&rank: &u64| VertexId(rank as u32);
        let mut near = Vec::new();
        for cell in searched.chunk_by(|a, b| a >> 32 == b >> 32) {
            let mut bounds = Bounds::EMPTY;
            let mut longest = 0.0f32;
            for ball in cell.iter().map(|rank| self.grid.ball(vertex(rank))) {
                bounds = bounds.union(&Bounds::from_points(&[ball.position]));
                longest = if ball.radius > longest { ball.radius } else { longest };
            }
            self.grid.near_balls(&bounds, longest, proximity, &mut near);
            for v in cell.iter().map(vertex) {
                self.add_pairs_of(mesh, &self.grid.ball(v), &near, proximity);
            }
            pauses.after(1 + cell.len() * near.len() / TESTS_PER_UNIT).await;
        }
    }

    fn add_pairs_of(&mut self, mesh: &Mesh, own: &VertexBall, near: &[VertexBall], proximity: Proximity) {
        for ball in near {
            let reach = proximity.distance_for(own.radius, ball.radius);
            let square = ball.position.distance_squared(own.position);
            if square <= reach * reach && !self.is_checked_from(ball.vertex, own.vertex, Check::Search) {
                self.add_pair(mesh, own, ball, proximity);
            }
        }
    }

    /// Stores two vertices near each other in the lists of both, unless they are identical or adjacent, and marks both
    /// if they may come within contact distance.
    fn add_pair(&mut self, mesh: &Mesh, a: &VertexBall, b: &VertexBall, proximity: Proximity) {
        if a.vertex == b.vertex || mesh.ring(a.vertex).contains(b.vertex) {
            return;
        }
        let is_close = a.position.distance_squared(b.position) < proximity.least * proximity.least;
        for (v, w) in [(a.vertex, b.vertex), (b.vertex, a.vertex)] {
            // A list that was cleared cannot have it yet, since each pair is found once.
            if self.is_searched_around(v) || self.position_of(v, w).is_none() {
                // The other vertex may still have a certificate of the pair.
                let known = if self.is_searched_around(w) { None } else { self.position_of(w, v) };
                let until = known.map_or(0.0, |k| self.near(w)[k].until);
                self.nearby[v.index()].get_or_insert_default().push(Nearby { vertex: w, until });
            }
            if is_close {
                self.may_touch[v.index()] = true;
            }
        }
    }

    /// Returns the index of `w` in the list of vertices that the broad phase found near `v`; `None` if `w` is not in
    /// this list.
    pub(super) fn position_of(&self, v: VertexId, w: VertexId) -> Option<usize> {
        self.near(v).iter().position(|near| near.vertex == w)
    }

    /// Returns the vertices that the broad phase found near `v`.
    pub(super) fn near(&self, v: VertexId) -> &[Nearby] {
        self.nearby[v.index()].as_ref().map_or(&[], |near| near.as_slice())
    }

    /// Stores for the pair of `v` and a vertex near it, at `position` in its list, the sum of odometers `until` which it is
    /// certified.
    pub(super) fn certify_nearby(&mut self, v: VertexId, position: usize, until: f32) {
        if let Some(near) = &mut self.nearby[v.index()] {
            near[position].until = until;
        }
    }

    /// Returns the distance up to which two vertices have to be paired: below it their triangles may intersect, or they
    /// may come within contact distance, before the next search around either.
    fn proximity(&self) -> Proximity {
        // Distance and edges change by twice the skin at most.
        let change = 2.0 * (SEARCH_SKIN * self.ordinary_edge + self.exact_below());
        Proximity {
            least: NEAREST_CORNER * self.ordinary_edge + change,
            margin: change * (1.0 + PIERCING),
            share: PIERCING,
        }
    }

    /// Returns the vertices inside a box, sorted by id.
    pub fn vertices_in(&mut self, mesh: &Mesh, bounds: &Bounds) -> Vec<VertexId> {
        self.sync(mesh);
        let mut found = Vec::new();
        self.grid.near_box(bounds, 0.0, |v| found.push(v));
        found.retain(|&v| bounds.contains(mesh.position(v)));
        sort_distinct(&mut found);
        found
    }

    /// Returns whether [`Self::for_each_contact`] may find any contact of `v`.
    pub fn may_have_contacts(&self, v: VertexId) -> bool {
        self.may_touch.get(v.index()).is_none_or(|&may_touch| may_touch)
    }

    /// Calls `found` with every vertex that is not adjacent to `v` and nearer than `distance`, and the squared
    /// distance; to be called after [`Self::sync`]. `distance` must be at most 1/√3 of the ordinary edge: the contact
    /// distance of a sampling whose longest edge is the ordinary edge.
    pub fn for_each_contact(
        &self,
        mesh: &Mesh,
        v: VertexId,
        distance: f32,
        mut found: impl FnMut(VertexId, f32),
    ) {
        if !self.may_have_contacts(v) {
            return;
        }
        let (p, ring) = (mesh.position(v), mesh.ring(v));
        self.grid.near_point(p, distance, |w| {
            let square = mesh.position(w).distance_squared(p);
            if square < distance * distance && w != v && !ring.contains(w) {
                found(w, square);
            }
        });
    }
}
