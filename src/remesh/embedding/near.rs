//! Which vertices are near each other and no neighbours: their triangles may cross soon.

use super::room::Concern;
use super::{Embedding, NEAREST_CORNER, PIERCING, SEARCH_ROOM};
use crate::math::Bounds;
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{Nearness, Star, near_pairs};

/// Where at least one vertex of so many searches, the whole mesh is swept. With more, sweeps over what nobody asked for take
/// longer than the search around those that do; with less, that search does.
const MANY: usize = 8;

impl Embedding {
    /// Notes where doubtful vertices are now, and finds what is near those that search.
    pub(super) fn find_near(&mut self, mesh: &Mesh, doubtful: &[VertexId]) {
        let is_entered = self.entered == Some(mesh.geometry_version());
        let count = doubtful.iter().filter(|&&v| self.searches(v)).count();
        let many = MANY * count >= mesh.vertex_count();
        if many {
            self.grid.empty_cells();
        } else if count > 0 {
            self.grid.fill_cells();
        }
        for &v in doubtful {
            if !is_entered {
                self.see(mesh, v);
            }
            if self.searches(v) {
                self.near[v.index()].clear();
                self.close[v.index()] = false;
                self.room[v.index()].set(Concern::Search, SEARCH_ROOM * self.edge);
                if !is_entered {
                    self.enter(mesh, v);
                }
            }
        }
        if many {
            self.sweep(mesh);
        } else if count > 0 {
            self.search(mesh, doubtful);
        }
    }

    fn searches(&self, v: VertexId) -> bool {
        self.doubts[v.index()].has(Concern::Search)
    }

    /// Finds what is near, in one sweep over the mesh.
    pub(super) fn sweep(&mut self, mesh: &Mesh) {
        let nearness = self.nearness();
        let stars = mesh.vertices().map(|v| self.grid.star(v)).collect();
        near_pairs(stars, nearness, |a, b| {
            if self.searches(a.vertex) || self.searches(b.vertex) {
                self.note_near(mesh, a, b, nearness);
            }
        });
    }

    /// Finds what is near, around those that search, those of a cell together.
    pub(super) fn search(&mut self, mesh: &Mesh, doubtful: &[VertexId]) {
        let nearness = self.nearness();
        let searching = doubtful.iter().filter(|&&v| self.searches(v));
        let mut searching: Vec<(u32, VertexId)> = searching.map(|&v| (self.grid.cell_name(v), v)).collect();
        searching.sort_unstable();
        let mut near = Vec::new();
        for cell in searching.chunk_by(|a, b| a.0 == b.0) {
            let mut bounds = Bounds::EMPTY;
            let mut longest = 0.0f32;
            for star in cell.iter().map(|&(_, v)| self.grid.star(v)) {
                bounds = bounds.joined(&Bounds::of(&[star.position]));
                longest = if star.longest > longest { star.longest } else { longest };
            }
            self.grid.near_stars(&bounds, longest, nearness, &mut near);
            for &(_, v) in cell {
                self.note_near_of(mesh, &self.grid.star(v), &near, nearness);
            }
        }
    }

    fn note_near_of(&mut self, mesh: &Mesh, own: &Star, near: &[Star], nearness: Nearness) {
        for star in near {
            let reach = nearness.between(own.longest, star.longest);
            let square = star.position.distance_squared(own.position);
            if square <= reach * reach && !self.is_left_to(star.vertex, own.vertex, Concern::Search) {
                self.note_near(mesh, own, star, nearness);
            }
        }
    }

    /// Notes that two vertices are near each other, if they are no neighbours.
    fn note_near(&mut self, mesh: &Mesh, a: &Star, b: &Star, nearness: Nearness) {
        if a.vertex == b.vertex || mesh.ring(a.vertex).contains(b.vertex) {
            return;
        }
        let is_close = a.position.distance_squared(b.position) < nearness.least * nearness.least;
        for (v, w) in [(a.vertex, b.vertex), (b.vertex, a.vertex)] {
            if !self.near[v.index()].contains(&w) {
                self.near[v.index()].push(w);
            }
            if is_close {
                self.close[v.index()] = true;
            }
        }
    }

    /// Where a pair can be that crosses or is in contact before one of both searches again.
    fn nearness(&self) -> Nearness {
        // Two vertices come nearer, and their edges get longer, by twice the room at most.
        let change = 2.0 * (SEARCH_ROOM * self.edge + self.finest());
        Nearness {
            least: NEAREST_CORNER * self.edge + change,
            margin: change * (1.0 + PIERCING),
            share: PIERCING,
        }
    }

    /// The vertices in a box, in order.
    pub fn vertices_in(&mut self, mesh: &Mesh, bounds: &Bounds) -> Vec<VertexId> {
        self.follow(mesh);
        let mut found = Vec::new();
        self.grid.near_box(bounds, 0.0, |v| found.push(v));
        found.retain(|&v| bounds.contains(mesh.position(v)));
        found.sort_unstable();
        found
    }

    /// Whether [`Self::company`] of `v` may find any.
    pub fn may_have_company(&self, v: VertexId) -> bool {
        self.close[v.index()]
    }

    /// Calls `found` with every vertex that is no neighbour of `v` and nearer than `distance`, which is at most the contact
    /// distance of the sampling with this ordinary edge; and with its squared distance.
    pub fn company(&self, mesh: &Mesh, v: VertexId, distance: f32, mut found: impl FnMut(VertexId, f32)) {
        if !self.may_have_company(v) {
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
