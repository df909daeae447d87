//! Edges out of bounds: equations (1) and (2), figure 1.

use super::{Resolver, Sampling, TopologyGuide};
use crate::math::Vec3;
use crate::math::order::sort_by_rank;
use crate::mesh::{EditError, Mesh, Opposite, VertexId};

/// The longest edge that a collapse may make, in the upper bound of edges. Where all are within bounds it makes none longer
/// than 1.4; in a surface much finer than δ and too crowded for splits, one collapse after the other would draw needles
/// through all of it.
const LENGTHENED: f32 = 1.6;

/// Edits around one vertex in a call, after which it is left as it is until it is touched again. Where splits, flips and collapses of
/// edges with different bounds undo each other, they went on until the effort of the whole call was spent, 20 s on a head.
const MOST_EDITS: u8 = 40;

impl Resolver {
    /// Works through the queue until every edge around its vertices is within bounds.
    pub(super) fn settle_edges(&mut self, mesh: &mut Mesh, sampling: Sampling, guide: &dyn TopologyGuide) {
        while self.embedding.effort() < self.most_effort {
            let Some(u) = self.pop() else { return };
            if mesh.is_live(u) && self.may_edit(u) {
                self.settle_vertex(mesh, sampling, guide, u);
            }
        }
    }

    /// Makes an edit at a vertex that changes the sampling and not the topology, unless the mesh would intersect itself.
    fn edit<T>(
        &mut self,
        mesh: &mut Mesh,
        at: VertexId,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        if self.tested.as_ref().is_none_or(|cells| cells.contains(mesh.position(at))) {
            self.embedding.attempt(mesh, edit)
        } else {
            self.embedding.attempt_in_one_rings(mesh, edit)
        }
    }

    /// Whether edges around `u` are mended in this call.
    fn may_edit(&self, u: VertexId) -> bool {
        self.edits.get(u.index()).is_none_or(|&edits| edits < MOST_EDITS)
    }

    fn count_edit(&mut self, u: VertexId) {
        if u.index() >= self.edits.len() {
            self.edits.resize(u.index() + 1, 0);
        }
        self.edits[u.index()] += 1;
    }

    /// Mends the first edge around `u` that is out of bounds and can be mended.
    fn settle_vertex(&mut self, mesh: &mut Mesh, sampling: Sampling, guide: &dyn TopologyGuide, u: VertexId) {
        let from = mesh.position(u);
        for k in 0..mesh.ring(u).valence() {
            let v = mesh.ring(u).as_slice()[k];
            let length = from.distance_squared(mesh.position(v));
            let bounds = sampling.between(mesh, u, v);
            let mended = if length > square(bounds.longest()) {
                self.shorten(mesh, sampling, u, v)
            } else if length < square(bounds.shortest()) {
                self.remove_short(mesh, sampling, guide, [u, v])
            } else {
                Ok(false)
            };
            if mended == Ok(true) {
                self.count_edit(u);
                return;
            }
        }
    }

    /// Flips an edge that is too long where a new vertex on it would come too near its opposite ones; else splits it.
    fn shorten(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        u: VertexId,
        v: VertexId,
    ) -> Result<bool, EditError> {
        let Opposite { left, right } = mesh.opposite(u, v)?;
        let middle = (mesh.position(u) + mesh.position(v)) * 0.5;
        let (a, b) = (mesh.position(left), mesh.position(right));
        let shortest = sampling.between(mesh, u, v).shortest();
        let crowded = [a, b].iter().any(|p| p.distance_squared(middle) < square(shortest));
        let flat = a.distance_squared(b) < mesh.position(u).distance_squared(mesh.position(v));
        if crowded && flat && self.edit(mesh, u, |mesh| mesh.flip(u, v)).is_ok() {
            self.changes.inversions += 1;
        } else if !self.has_room(mesh) {
            return Ok(false);
        } else {
            let w = self.edit(mesh, u, |mesh| mesh.split(u, v, middle))?;
            self.changes.creations += 1;
            self.touch_edited(w);
        }
        [u, v, left, right].into_iter().for_each(|w| self.touch(w));
        Ok(true)
    }

    /// Collapses an edge that is too short; where a neck is in the way, cuts it; a lone tetrahedron is removed.
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
            Err(EditError::NeckInTheWay(_)) => self.cut_neck(mesh, sampling, guide, [u, v]),
            Err(EditError::ValenceTooLow(_)) if mesh.is_tetrahedron(u) => {
                self.remove_part(mesh, u);
                Ok(true)
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Draws the edge together at the best of the places where nothing crosses.
    fn collapse(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        u: VertexId,
        v: VertexId,
    ) -> Result<bool, EditError> {
        let longest = LENGTHENED * sampling.between(mesh, u, v).longest();
        for place in collapse_places(mesh, u, v) {
            if lengthens(mesh, [u, v], place, longest) {
                continue;
            }
            match self.edit(mesh, u, |mesh| mesh.collapse(u, v, place)) {
                Ok(()) => {
                    self.changes.deletions += 1;
                    // At the end of the queue: trying the survivor again at once piles up valence.
                    self.touch_edited(u);
                    return Ok(true);
                }
                Err(EditError::WouldCross) => {}
                Err(refusal) => return Err(refusal),
            }
        }
        Err(EditError::WouldCross)
    }
}

/// The middle of the edge and its ends, in this order, those first at which no triangle turns over.
fn collapse_places(mesh: &Mesh, u: VertexId, v: VertexId) -> [Vec3; 3] {
    let (p, q) = (mesh.position(u), mesh.position(v));
    let mut places = [(p + q) * 0.5, p, q];
    sort_by_rank(&mut places, |&at| u64::from(turns_over(mesh, u, v, at) || turns_over(mesh, v, u, at)));
    places
}

/// Whether `u` and `v` drawn together `at` a place makes an edge longer than `most`, and than it was.
fn lengthens(mesh: &Mesh, ends: [VertexId; 2], at: Vec3, most: f32) -> bool {
    ends.into_iter().any(|end| {
        let from = mesh.position(end);
        mesh.ring(end).as_slice().iter().any(|&w| {
            let (p, new) = (mesh.position(w), at.distance_squared(mesh.position(w)));
            new > square(most) && new > from.distance_squared(p)
        })
    })
}

/// Whether moving `u` to `to` turns over a triangle around it that does not have `v` as a corner.
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
