//! Restores the bounds of edge lengths, equations (1) and (2) and figure 1 (Lachaud & Montanvert), by splits, flips and
//! collapses.

use super::{Resolver, Sampling, TopologyGuide};
use crate::math::Vec3;
use crate::math::order::sort_by_rank;
use crate::mesh::{EditError, Mesh, OppositeVertices, VertexId};
use crate::pauses::Pauses;

/// The longest edge that a collapse may produce, as a factor of the upper bound of edges, unless the edge was as long
/// before. While all edges are within bounds, none exceeds 1.4; in a surface much finer than δ and too crowded for
/// splits, repeated collapses would produce needles.
const LENGTHENED: f32 = 1.6;

/// The largest number of edits around one vertex in a call of the resolver. The vertex is then skipped for the rest of
/// the call, and not left pending for the next. Edits of edges with different bounds may undo each other; on a head
/// scan they used up the work of a whole call, 20 s.
const MAX_EDITS: u8 = 40;

/// The valence above which an edit takes long.
const WIDE: usize = 128;

/// Number of nearby vertices that are visited in a unit of work.
const VISITED_PER_UNIT: u64 = 16;

impl Resolver {
    /// Brings the lengths of edges around queued vertices within bounds where possible, until the queue is empty or the
    /// work limit of the resolver's call is reached.
    pub(super) async fn restore_edges(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        pauses: &Pauses,
    ) {
        while self.embedding.effort() < self.max_effort {
            let Some(u) = self.pop() else { return };
            pauses.after(1).await;
            if !mesh.is_live(u) || !self.may_edit(u) {
                continue;
            }
            let mut next = Some(0);
            while let Some(k) = next {
                let (tested, visited) = (self.embedding.tested_around(), self.embedding.effort());
                next = self.restore_vertex(mesh, sampling, guide, u, k);
                let visited = (self.embedding.effort() - visited) / VISITED_PER_UNIT;
                pauses.after(self.embedding.units_around_since(tested) + visited as usize).await;
            }
        }
    }

    /// Makes a split, flip or collapse at the vertex `at`, and rolls it back if triangles would intersect. Outside the
    /// cells of [`Self::set_tested_cells`], only pairs of triangles with a common corner are tested.
    fn edit<T>(
        &mut self,
        mesh: &mut Mesh,
        at: VertexId,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        if self.tested_cells.as_ref().is_none_or(|cells| cells.contains(mesh.position(at))) {
            self.embedding.attempt(mesh, edit)
        } else {
            self.embedding.attempt_in_one_rings(mesh, edit)
        }
    }

    /// Returns whether edges around `u` may still be edited in the current call of the resolver, by the limit
    /// [`MAX_EDITS`].
    fn may_edit(&self, u: VertexId) -> bool {
        self.edits.get(u.index()).is_none_or(|&edits| edits < MAX_EDITS)
    }

    fn count_edit(&mut self, u: VertexId) {
        if u.index() >= self.edits.len() {
            self.edits.resize(u.index() + 1, 0);
        }
        self.edits[u.index()] += 1;
    }

    /// Edits the first edge around `u` whose length is out of bounds, to bring it within them; if an edit is rejected,
    /// tries the next such edge. Begins with the neighbour of index `first`; if edits of a vertex of very many neighbours
    /// are rejected, which takes long, returns now and then the index to go on from.
    fn restore_vertex(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        u: VertexId,
        first: usize,
    ) -> Option<usize> {
        let from = mesh.position(u);
        let valence = mesh.ring(u).valence();
        for k in first..valence {
            let v = mesh.ring(u).as_slice()[k];
            let length = from.distance_squared(mesh.position(v));
            let bounds = sampling.between(mesh, u, v);
            let edited = if length > square(bounds.longest()) {
                self.shorten(mesh, sampling, u, v)
            } else if length < square(bounds.shortest()) {
                self.remove_short(mesh, sampling, guide, [u, v])
            } else {
                Ok(false)
            };
            match edited {
                Ok(true) => {
                    self.count_edit(u);
                    return None;
                }
                Ok(false) => {}
                Err(_) if valence > WIDE => return Some(k + 1),
                Err(_) => {}
            }
        }
        None
    }

    /// Removes an edge that is too long: flips it if a vertex at its midpoint would be too near an opposite one and the
    /// flip makes it shorter; otherwise, or if the flip is rejected, splits it. Returns `Ok(true)` if the mesh was
    /// changed, `Ok(false)` if it has the largest number of vertices.
    fn shorten(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        u: VertexId,
        v: VertexId,
    ) -> Result<bool, EditError> {
        let OppositeVertices { left, right } = mesh.opposite_vertices(u, v)?;
        let middle = (mesh.position(u) + mesh.position(v)) * 0.5;
        let (a, b) = (mesh.position(left), mesh.position(right));
        let shortest = sampling.between(mesh, u, v).shortest();
        let crowded = [a, b].iter().any(|p| p.distance_squared(middle) < square(shortest));
        let flat = a.distance_squared(b) < mesh.position(u).distance_squared(mesh.position(v));
        if crowded && flat && self.edit(mesh, u, |mesh| mesh.flip(u, v)).is_ok() {
            self.changes.inversions += 1;
        } else if !self.may_add_vertex(mesh) {
            return Ok(false);
        } else {
            let w = self.edit(mesh, u, |mesh| mesh.split(u, v, middle))?;
            self.changes.creations += 1;
            self.touch_edited(w);
        }
        [u, v, left, right].into_iter().for_each(|w| self.touch(w));
        Ok(true)
    }

    /// Removes an edge that is too short: collapses it if `guide` allows it, cuts the neck that blocks the collapse, or
    /// removes an isolated tetrahedron. Returns `Ok(true)` if the mesh was changed, `Ok(false)` if `guide` forbids it.
    fn remove_short(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        [u, v]: [VertexId; 2],
    ) -> Result<bool, EditError> {
        match mesh.can_collapse(u, v) {
            Ok(_) if !guide.may_collapse(mesh, [u, v]) => Ok(false),
            Ok(_) => self.collapse(mesh, sampling, u, v),
            Err(EditError::LinkCondition(_)) => self.cut_neck(mesh, sampling, guide, [u, v]),
            Err(EditError::ValenceTooLow(_)) if mesh.is_tetrahedron(u) => {
                self.remove_component(mesh, u);
                Ok(true)
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Collapses the edge `uv` into the first of [`collapse_positions`] that makes no edge too long and causes no
    /// self-intersection; returns `Ok(true)` if there is one.
    fn collapse(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        u: VertexId,
        v: VertexId,
    ) -> Result<bool, EditError> {
        let longest = LENGTHENED * sampling.between(mesh, u, v).longest();
        for position in collapse_positions(mesh, u, v) {
            if lengthens(mesh, [u, v], position, longest) {
                continue;
            }
            match self.edit(mesh, u, |mesh| mesh.collapse(u, v, position)) {
                Ok(()) => {
                    self.changes.deletions += 1;
                    // Appended to the queue: if it were processed at once, its valence would grow.
                    self.touch_edited(u);
                    return Ok(true);
                }
                Err(EditError::WouldSelfIntersect) => {}
                Err(refusal) => return Err(refusal),
            }
        }
        Err(EditError::WouldSelfIntersect)
    }
}

/// Returns the candidate positions for the vertex that remains after a collapse of the edge `uv`: the midpoint of the
/// edge and its ends, in this order, but positions at which a triangle turns over last.
fn collapse_positions(mesh: &Mesh, u: VertexId, v: VertexId) -> [Vec3; 3] {
    let (p, q) = (mesh.position(u), mesh.position(v));
    let mut positions = [(p + q) * 0.5, p, q];
    sort_by_rank(&mut positions, |&at| u64::from(turns_over(mesh, u, v, at) || turns_over(mesh, v, u, at)));
    positions
}

/// Returns whether collapsing the edge between `ends` into the position `at` makes another edge longer than both `most`
/// and its present length.
fn lengthens(mesh: &Mesh, ends: [VertexId; 2], at: Vec3, most: f32) -> bool {
    ends.into_iter().any(|end| {
        let from = mesh.position(end);
        mesh.ring(end).as_slice().iter().any(|&w| {
            let (p, new) = (mesh.position(w), at.distance_squared(mesh.position(w)));
            new > square(most) && new > from.distance_squared(p)
        })
    })
}

/// Returns whether moving `u` to `to` turns over a triangle around it that does not contain `v`.
fn turns_over(mesh: &Mesh, u: VertexId, v: VertexId, to: Vec3) -> bool {
    let from = mesh.position(u);
    mesh.ring(u).pairs().filter(|&(a, b)| a != v && b != v).any(|(a, b)| {
        let (a, b) = (mesh.position(a), mesh.position(b));
        (a - from).cross(b - from).dot((a - to).cross(b - to)) <= 0.0
    })
}

fn square(x: f32) -> f32 {
    x * x
}
