//! The loop of figure 9: edges, then contact, until every bound holds.

use super::specks::SmallParts;
use super::{Changes, Embedding, Sampling};
use crate::math::{Bounds, DAffine3, Vec3};
use crate::mesh::{Mesh, MeshError, VertexId};
use crate::spatial::CellSet;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Rounds of edges and contact in one call. A round mends what the round before it broke; hard scenes never
/// needed more than five, and what is left waits for the next call.
const PASSES: usize = 8;

/// Near vertices that a call may look at for each vertex of the mesh, and for any mesh, before the rest is left for the
/// next call. An edit looks at some 60, and ordinary iterations take less than one edit for ten vertices. A cycle of edits
/// that undo each other, or edges that cannot be mended in a crowd, as on a needle that was pulled out of the surface,
/// would take any number.
const EFFORT_PER_VERTEX: u64 = 400;
const LEAST_EFFORT: u64 = 100_000;

/// Keeps the bounds of a [`Sampling`] on a mesh that moves, and keeps it from crossing itself.
#[derive(Clone, Debug)]
pub struct Resolver {
    most_vertices: usize,
    contact: Contact,
    /// Where splits, flips and collapses are tested for all self-intersections, if not everywhere.
    pub(super) tested: Option<CellSet>,
    full: bool,
    /// [`Embedding::effort`] at which this call ends.
    pub(super) most_effort: u64,
    queue: VecDeque<VertexId>,
    queued: Vec<bool>,
    /// By vertex, the edits around it in this call.
    pub(super) edits: Vec<u8>,
    /// Vertices that were moved or made since contact was last looked for.
    stirred: Vec<VertexId>,
    is_stirred: Vec<bool>,
    /// Vertices that the last move could not move at all.
    pub(super) stuck: Vec<VertexId>,
    /// Components that may vanish.
    pub(super) small: SmallParts,
    /// Vertices made or displaced by the last call.
    pub(super) edited: Vec<VertexId>,
    pub(super) embedding: Embedding,
    pub(super) changes: Changes,
}

/// What becomes of vertices in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contact {
    /// A tube is made between them.
    #[default]
    Join,
    /// They press against each other.
    Leave,
}

/// Decides which of the topology changes that the sampling calls for are made.
pub trait TopologyGuide {
    /// Whether two vertices in contact may be joined by a tube (axial change).
    fn may_join(&self, mesh: &Mesh, pair: [VertexId; 2]) -> bool;

    /// Whether the mesh may be cut along a ring of three edges (annular change).
    fn may_cut(&self, mesh: &Mesh, ring: [VertexId; 3]) -> bool;

    /// Whether a short edge may be drawn together.
    fn may_collapse(&self, mesh: &Mesh, edge: [VertexId; 2]) -> bool;

    /// Whether there is matter inside a small solid component, or background inside a small hollow. Without, a solid that is pressed
    /// on itself is removed, and so is a hollow, which would grow in matter.
    fn has_content(&self, mesh: &Mesh, members: &[VertexId], is_solid: bool) -> bool;
}

/// Makes every topology change that the sampling calls for, as in the paper.
#[derive(Clone, Copy, Debug)]
pub struct Unguided;

impl TopologyGuide for Unguided {
    fn may_join(&self, _: &Mesh, _: [VertexId; 2]) -> bool {
        true
    }

    fn may_cut(&self, _: &Mesh, _: [VertexId; 3]) -> bool {
        true
    }

    fn may_collapse(&self, _: &Mesh, _: [VertexId; 2]) -> bool {
        true
    }

    fn has_content(&self, _: &Mesh, _: &[VertexId], _: bool) -> bool {
        false
    }
}

/// Vertices that the last call left over, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Waiting {
    /// Whose edges are to be looked at.
    pub queue: Vec<VertexId>,
    /// Whose contacts are to be looked at.
    pub stirred: Vec<VertexId>,
}

impl Waiting {
    /// The same vertices after a renumbering; those that are gone are left out.
    pub fn renamed(&self, names: &[Option<VertexId>]) -> Self {
        let rename = |list: &[VertexId]| list.iter().filter_map(|v| *names.get(v.index())?).collect();
        Self { queue: rename(&self.queue), stirred: rename(&self.stirred) }
    }
}

impl Resolver {
    /// A resolver that splits no edge of a mesh with so many vertices.
    pub fn with_room_for(most_vertices: usize) -> Self {
        Self {
            most_vertices,
            contact: Contact::Join,
            tested: None,
            full: false,
            most_effort: 0,
            queue: VecDeque::new(),
            queued: Vec::new(),
            edits: Vec::new(),
            stirred: Vec::new(),
            is_stirred: Vec::new(),
            stuck: Vec::new(),
            small: SmallParts::default(),
            edited: Vec::new(),
            embedding: Embedding::default(),
            changes: Changes::default(),
        }
    }

    /// What becomes of vertices in contact from now on.
    pub fn set_contact(&mut self, contact: Contact) {
        self.contact = contact;
    }

    /// From now on splits, flips and collapses are tested for all self-intersections only in `cells`, elsewhere as by
    /// [`Embedding::attempt_in_one_rings`]. That takes half the time, and the mesh has to be tested as a whole afterwards.
    pub fn test_only_in(&mut self, cells: CellSet) {
        self.tested = Some(cells);
    }

    /// What keeps the mesh from crossing itself, for edits beside these.
    pub fn guard(&mut self, mesh: &Mesh, sampling: Sampling) -> &mut Embedding {
        self.embedding.follow_with(mesh, sampling.longest());
        &mut self.embedding
    }

    /// As [`Embedding::watch_output`].
    pub fn watch_output(&mut self, map: DAffine3, bounds: &Bounds) {
        self.embedding.watch_output(map, bounds);
    }

    /// The number of vertices from which on no edge is split.
    pub fn most_vertices(&self) -> usize {
        self.most_vertices
    }

    /// That number, where the last call left an edge too long because of it; told once.
    pub fn take_overflow(&mut self) -> Option<usize> {
        std::mem::take(&mut self.full).then_some(self.most_vertices)
    }

    /// Whether a vertex may be added; if not, [`Self::take_overflow`] will tell.
    pub(super) fn has_room(&mut self, mesh: &Mesh) -> bool {
        self.full |= mesh.vertex_count() >= self.most_vertices;
        !self.full
    }

    /// Restores the bounds around the `active` vertices and returns what was done.
    ///
    /// Vertices that are not named are looked at only where an edit or a contact reaches them.
    pub fn resolve(&mut self, mesh: &mut Mesh, sampling: Sampling, active: &[VertexId]) -> Changes {
        self.resolve_guided(mesh, sampling, active, &Unguided)
    }

    /// [`Self::resolve`], changing the topology only where `guide` allows it.
    pub fn resolve_guided(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        active: &[VertexId],
        guide: &dyn TopologyGuide,
    ) -> Changes {
        self.embedding.follow_with(mesh, sampling.longest());
        self.changes = Changes::default();
        self.full = false;
        let effort = LEAST_EFFORT + EFFORT_PER_VERTEX * mesh.vertex_count() as u64;
        self.most_effort = self.embedding.effort() + effort;
        self.edited.clear();
        self.edits.clear();
        let stuck = std::mem::take(&mut self.stuck);
        self.remove_crushed(mesh, sampling, guide, &stuck);
        self.cut_crushed(mesh, sampling, guide, &stuck);
        for &v in active {
            self.touch(v);
        }
        for _ in 0..PASSES {
            self.settle_edges(mesh, sampling, guide);
            // Between edges out of bounds nearly every pair of vertices is in contact, and joins make it worse.
            if self.is_waiting()
                || self.contact == Contact::Leave
                || !self.join_contacts(mesh, sampling, guide)
            {
                break;
            }
        }
        if self.contact == Contact::Leave {
            self.take_stirred();
        }
        self.note_small_parts(mesh, sampling, guide);
        self.changes
    }

    /// Moves the vertices as [`Embedding::carry`] does.
    pub fn carry(&mut self, mesh: &mut Mesh, sampling: Sampling, ways: &mut [Vec3]) -> Vec<(VertexId, f32)> {
        let all: Vec<VertexId> = mesh.vertices().collect();
        self.carry_some(mesh, sampling, &all, ways)
    }

    /// Moves some of the vertices as [`Embedding::carry_some`] does.
    pub fn carry_some(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        moving: &[VertexId],
        ways: &mut [Vec3],
    ) -> Vec<(VertexId, f32)> {
        self.small.find(mesh);
        self.embedding.follow_with(mesh, sampling.longest());
        let held = self.embedding.carry_some(mesh, moving, ways);
        self.stuck.clear();
        self.stuck.extend(held.iter().filter(|(_, share)| *share == 0.0).map(|(v, _)| *v));
        held
    }

    /// Whether no two triangles cross, exactly.
    pub fn is_embedded(&mut self, mesh: &Mesh) -> bool {
        self.embedding.is_embedded(mesh)
    }

    /// Refines the mesh as [`Embedding::refine`] does; `sampling` is that of the mesh as it is.
    ///
    /// # Errors
    /// As [`Mesh::refine`].
    pub fn refine(&mut self, mesh: &mut Mesh, sampling: Sampling) -> Result<bool, MeshError> {
        self.embedding.follow_with(mesh, sampling.longest());
        self.embedding.refine(mesh)
    }

    /// The vertices that edits of the last call made or displaced; some may be gone again.
    pub fn edited(&self) -> &[VertexId] {
        &self.edited
    }

    /// Whether something waits for the next call.
    pub fn is_waiting(&self) -> bool {
        !self.queue.is_empty()
    }

    /// What waits for the next call.
    pub fn waiting(&self) -> Waiting {
        Waiting { queue: self.queue.iter().copied().collect(), stirred: self.stirred.clone() }
    }

    /// Lets `waiting` wait in place of what waits now.
    pub fn set_waiting(&mut self, waiting: Waiting) {
        self.queued.clear();
        self.is_stirred.clear();
        waiting.queue.iter().for_each(|&v| _ = mark(&mut self.queued, v));
        waiting.stirred.iter().for_each(|&v| _ = mark(&mut self.is_stirred, v));
        self.queue = waiting.queue.into();
        self.stirred = waiting.stirred;
    }

    /// Puts `v` at the end of the queue, and marks it for the next search for contact.
    pub(super) fn touch(&mut self, v: VertexId) {
        if mark(&mut self.queued, v) {
            self.queue.push_back(v);
        }
        if mark(&mut self.is_stirred, v) {
            self.stirred.push(v);
        }
    }

    /// [`Self::touch`] for a vertex that an edit made or displaced.
    pub(super) fn touch_edited(&mut self, v: VertexId) {
        self.edited.push(v);
        self.touch(v);
    }

    pub(super) fn pop(&mut self) -> Option<VertexId> {
        let v = self.queue.pop_front()?;
        self.queued[v.index()] = false;
        Some(v)
    }

    /// The stirred vertices in the order they were touched; none are left.
    pub(super) fn take_stirred(&mut self) -> Vec<VertexId> {
        let stirred = std::mem::take(&mut self.stirred);
        for v in &stirred {
            self.is_stirred[v.index()] = false;
        }
        stirred
    }
}

/// Sets a flag and says whether it was clear.
fn mark(flags: &mut Vec<bool>, v: VertexId) -> bool {
    if v.index() >= flags.len() {
        flags.resize(v.index() + 1, false);
    }
    !std::mem::replace(&mut flags[v.index()], true)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// A vertex pulled far out of a sphere: edits on its needle undo each other or would cross something, and contact is
    /// everywhere along it. Once a single call never came back.
    #[test]
    fn a_needle_is_resolved_in_calls_of_bounded_work() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 5.0, 1.5).unwrap();
        let x = |v: VertexId| mesh.position(v).x;
        let tip = mesh.vertices().min_by(|&a, &b| x(a).total_cmp(&x(b))).unwrap();
        mesh.set_position(tip, Vec3::new(-40.0, 3.0, 1.0));
        let mut resolver = Resolver::with_room_for(500);
        let mut active: Vec<VertexId> = mesh.vertices().collect();
        let mut effort = 0;
        for _ in 0..12 {
            resolver.resolve(&mut mesh, Sampling::new(0.9), &active);
            assert_eq!(mesh.check(), Ok(()));
            assert!(resolver.is_embedded(&mesh));
            active.clear();
            // An edit more than is allowed, which may look at all and change all of the triangles, in some variants.
            let most = LEAST_EFFORT + (EFFORT_PER_VERTEX + 200) * 500;
            assert!(resolver.embedding.effort() - effort < most);
            effort = resolver.embedding.effort();
        }
        // Joints add a few where no edge is split any more.
        assert!(mesh.vertex_count() <= 520);
    }
}
