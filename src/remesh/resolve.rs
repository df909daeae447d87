//! The loop of figure 9 (Lachaud & Montanvert): restores edge bounds, then resolves contacts, until all bounds hold.

use super::small_components::SmallComponents;
use super::{Changes, Embedding, Sampling};
use crate::math::{Bounds, DAffine3, Vec3};
use crate::mesh::{EditError, Mesh, MeshError, Patch, VertexId};
use crate::pauses::{Pauses, finished};
use crate::spatial::CellSet;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The largest number of rounds of edge and contact processing in one call of [`Resolver::resolve`]. Each repairs
/// bounds that the one before violated. Hard scenes never needed more than five; the rest stays pending for the next
/// call.
const PASSES: usize = 8;

/// The work limit of a call of [`Resolver::resolve`], in nearby vertices visited: this much per vertex of the mesh,
/// plus [`MIN_EFFORT`]; the rest stays pending for the next call. An edit visits about 60, and ordinary iterations make
/// less than one edit per ten vertices. Without this limit a call might never return: edits can undo each other, and on
/// a needle pulled out of the surface edges cannot be brought within bounds.
const EFFORT_PER_VERTEX: u64 = 400;
/// The constant part of the work limit of a call of [`Resolver::resolve`], in nearby vertices visited, for small
/// meshes.
const MIN_EFFORT: u64 = 100_000;

/// Keeps a moving mesh within the bounds of a [`Sampling`] and free of self-intersections; the deformable model runs it
/// after moves.
#[derive(Clone, Debug)]
pub struct Resolver {
    max_vertices: usize,
    contact_policy: ContactPolicy,
    /// The cells in which splits, flips and collapses are tested in full for self-intersections; everywhere if `None`.
    pub(super) tested_cells: Option<CellSet>,
    overflowed: bool,
    /// The value of [`Embedding::effort`] at which the current call of [`Self::resolve`] ends.
    pub(super) max_effort: u64,
    queue: VecDeque<VertexId>,
    queued: Vec<bool>,
    /// Number of edits made around each vertex in the current call of [`Self::resolve`], by slot.
    pub(super) edits: Vec<u8>,
    /// Vertices marked for the next contact query.
    dirty: Vec<VertexId>,
    is_dirty: Vec<bool>,
    /// Vertices that could not move at all in the last move, sorted by id; the next call of [`Self::resolve`] cuts the
    /// necks at them.
    pub(super) stuck: Vec<VertexId>,
    /// The components with so few vertices that they may be removed.
    pub(super) small: SmallComponents,
    /// Vertices that edits of the last call of [`Self::resolve`] created or displaced.
    pub(super) edited: Vec<VertexId>,
    pub(super) embedding: Embedding,
    pub(super) changes: Changes,
}

/// Response of the [`Resolver`] to a contact between two non-adjacent vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactPolicy {
    /// Two vertices in contact are joined by a tube (axial change).
    #[default]
    Join,
    /// The topology is kept: sides in contact stay so, and the collision handling prevents that they intersect.
    Leave,
}

/// Decides which of the topology changes required by the sampling are made; the deformable model implements it from the
/// image.
pub trait TopologyGuide {
    /// Returns whether two vertices in contact may be joined by a tube (axial change).
    fn may_join(&self, mesh: &Mesh, pair: [VertexId; 2]) -> bool;

    /// Returns whether the mesh may be cut along a cycle of three edges between the vertices `ring` (annular change).
    fn may_cut(&self, mesh: &Mesh, ring: [VertexId; 3]) -> bool;

    /// Returns whether a short edge may be collapsed; not if it spans a thin wall or gap, whose two sides the collapse
    /// would merge.
    fn may_collapse(&self, mesh: &Mesh, edge: [VertexId; 2]) -> bool;

    /// Returns whether the image shows foreground inside a small solid component with the vertices `members`, or
    /// background inside a small cavity. Components for which it does not are removed sooner when they are crushed or
    /// lose their volume; such a cavity would otherwise grow inside the foreground.
    fn has_content(&self, mesh: &Mesh, members: &[VertexId], is_solid: bool) -> bool;
}

/// A [`TopologyGuide`] that allows every topology change, as in the paper of Lachaud & Montanvert, and finds content in
/// no small component.
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

/// The vertices left pending by the last call of [`Resolver::resolve`], in the order of processing; part of a saved
/// run.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pending {
    /// Vertices whose edge lengths are still to be checked.
    pub queue: Vec<VertexId>,
    /// Vertices whose contacts are still to be queried.
    pub dirty: Vec<VertexId>,
}

impl Pending {
    /// Returns the pending vertices after the mesh was renumbered, without deleted ones; `new_ids` contains the new id
    /// of each old one.
    pub fn renumbered(&self, new_ids: &[Option<VertexId>]) -> Self {
        let rename = |list: &[VertexId]| list.iter().filter_map(|v| *new_ids.get(v.index())?).collect();
        Self { queue: rename(&self.queue), dirty: rename(&self.dirty) }
    }
}

impl Resolver {
    /// Creates a resolver that stops splitting edges once the mesh has `max_vertices`.
    pub fn with_max_vertices(max_vertices: usize) -> Self {
        Self {
            max_vertices,
            contact_policy: ContactPolicy::Join,
            tested_cells: None,
            overflowed: false,
            max_effort: 0,
            queue: VecDeque::new(),
            queued: Vec::new(),
            edits: Vec::new(),
            dirty: Vec::new(),
            is_dirty: Vec::new(),
            stuck: Vec::new(),
            small: SmallComponents::default(),
            edited: Vec::new(),
            embedding: Embedding::default(),
            changes: Changes::default(),
        }
    }

    /// Sets the response to contacts between non-adjacent vertices: to join the two by a tube, or to leave both
    /// unchanged.
    pub fn set_contact_policy(&mut self, contact: ContactPolicy) {
        self.contact_policy = contact;
    }

    /// Restricts the full tests for self-intersections of splits, flips and collapses to `cells`; elsewhere these are
    /// tested as by [`Embedding::attempt_in_one_rings`]. With `None` all are tested in full. The restriction halves the
    /// time of [`Self::resolve`]; the caller has to test the whole mesh afterwards.
    pub fn set_tested_cells(&mut self, cells: Option<CellSet>) {
        self.tested_cells = cells;
    }

    /// Returns the collision handling of the resolver, synchronised with `mesh`, for edits made by the caller.
    pub fn embedding(&mut self, mesh: &Mesh, sampling: Sampling) -> &mut Embedding {
        self.embedding.sync_with_edge(mesh, sampling.longest());
        &mut self.embedding
    }

    /// From now on also prevents self-intersections that the mesh, which stays within `bounds`, would have after
    /// mapping by `map` and rounding to single precision, as [`Embedding::watch_output`] does.
    pub fn watch_output(&mut self, map: DAffine3, bounds: &Bounds) {
        self.embedding.watch_output(map, bounds);
    }

    /// Returns the number of vertices of the mesh at which the resolver stops splitting edges.
    pub fn max_vertices(&self) -> usize {
        self.max_vertices
    }

    /// Sets the number of vertices at which edges are no longer split.
    pub fn set_max_vertices(&mut self, most: usize) {
        self.max_vertices = most;
    }

    /// Returns the limit [`Self::max_vertices`] if the last call of [`Self::resolve`] left an edge too long because of
    /// it; `None` otherwise, or if asked again.
    pub fn take_overflow(&mut self) -> Option<usize> {
        std::mem::take(&mut self.overflowed).then_some(self.max_vertices)
    }

    /// Returns whether a vertex may be added to the mesh. If not, [`Self::take_overflow`] will report it, and no vertex
    /// may be added until the next call of [`Self::resolve`].
    pub(super) fn may_add_vertex(&mut self, mesh: &Mesh) -> bool {
        self.overflowed |= mesh.vertex_count() >= self.max_vertices;
        !self.overflowed
    }

    /// Restores the edge bounds and resolves contacts around the vertices `active`, which have moved, and those left
    /// pending by the last call; returns the changes made.
    ///
    /// Other vertices are processed only if an edit or a contact reaches them. First, small components that the last
    /// move crushed are removed, and necks whose vertices it could not move are cut. What is left after eight rounds or
    /// at the work limit stays pending.
    pub fn resolve(&mut self, mesh: &mut Mesh, sampling: Sampling, active: &[VertexId]) -> Changes {
        self.resolve_guided(mesh, sampling, active, &Unguided)
    }

    /// Restores the edge bounds and resolves contacts as [`Self::resolve`] does, but joins, cuts and collapses only if
    /// `guide` allows it, and removes small components depending on [`TopologyGuide::has_content`].
    pub fn resolve_guided(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        active: &[VertexId],
        guide: &dyn TopologyGuide,
    ) -> Changes {
        finished(self.resolve_in_slices(mesh, sampling, active, guide, &Pauses::default()))
    }

    /// Does what [`Self::resolve_guided`] does, and pauses meanwhile. The mesh is valid in each pause.
    pub async fn resolve_in_slices(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        active: &[VertexId],
        guide: &dyn TopologyGuide,
        pauses: &Pauses,
    ) -> Changes {
        self.embedding.sync_with_edge(mesh, sampling.longest());
        self.changes = Changes::default();
        self.overflowed = false;
        let effort = MIN_EFFORT + EFFORT_PER_VERTEX * mesh.vertex_count() as u64;
        self.max_effort = self.embedding.effort() + effort;
        self.edited.clear();
        self.edits.clear();
        let stuck = std::mem::take(&mut self.stuck);
        pauses.now().await;
        self.remove_crushed(mesh, sampling, guide, &stuck, pauses).await;
        self.cut_stuck_necks(mesh, sampling, guide, &stuck);
        pauses.now().await;
        for &v in active {
            self.touch(v);
        }
        for _ in 0..PASSES {
            self.restore_edges(mesh, sampling, guide, pauses).await;
            // While edges are out of bounds, nearly all pairs of vertices are in contact, and joins add more.
            if self.has_pending_edges()
                || self.contact_policy == ContactPolicy::Leave
                || !self.join_contacts(mesh, sampling, guide, pauses).await
            {
                break;
            }
        }
        if self.contact_policy == ContactPolicy::Leave {
            self.take_dirty();
        }
        self.update_small_components(mesh, sampling, guide, pauses).await;
        self.changes
    }

    /// Moves all vertices by `displacements`, given by slot and scaled down to prevent self-intersections, as
    /// [`Embedding::move_all`] does; returns the vertices held back, with the share of its displacement by which each
    /// moved.
    pub fn move_all(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        displacements: &mut [Vec3],
    ) -> Vec<(VertexId, f32)> {
        let all: Vec<VertexId> = mesh.vertices().collect();
        self.move_some(mesh, sampling, &all, displacements)
    }

    /// Moves the vertices `moving` by `displacements`, given by slot, as [`Embedding::move_some`] does, and records
    /// those that could not move, for the next call of [`Self::resolve`]; returns the vertices held back, with the
    /// share of its displacement by which each moved.
    pub fn move_some(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        moving: &[VertexId],
        displacements: &mut [Vec3],
    ) -> Vec<(VertexId, f32)> {
        finished(self.move_some_in_slices(mesh, sampling, moving, displacements, &Pauses::default()))
    }

    /// Does what [`Self::move_some`] does, and pauses meanwhile.
    pub async fn move_some_in_slices(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        moving: &[VertexId],
        displacements: &mut [Vec3],
        pauses: &Pauses,
    ) -> Vec<(VertexId, f32)> {
        self.small.find(mesh);
        // After a call for the whole mesh they have memory for as many vertices.
        self.queue.shrink_to_fit();
        self.dirty.shrink_to_fit();
        self.edited = Vec::new();
        self.embedding.sync_with_edge(mesh, sampling.longest());
        pauses.now().await;
        let held = self.embedding.move_some_in_slices(mesh, moving, displacements, pauses).await;
        self.stuck.clear();
        self.stuck.extend(held.iter().filter(|(_, share)| *share == 0.0).map(|(v, _)| *v));
        held
    }

    /// Replaces triangles of the mesh as [`Embedding::replace`] does; returns the new vertices.
    ///
    /// # Errors
    /// As [`Embedding::replace`]; the mesh is unchanged on error.
    pub fn replace(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        removed: &[VertexId],
        patch: &Patch,
    ) -> Result<Vec<VertexId>, EditError> {
        self.small.find(mesh);
        self.embedding.sync_with_edge(mesh, sampling.longest());
        let added = self.embedding.replace(mesh, removed, patch)?;
        let touched: Vec<VertexId> = mesh.touched_vertices().filter(|&v| mesh.is_live(v)).collect();
        self.small.find_again(mesh, &touched);
        Ok(added)
    }

    /// Returns whether the mesh is free of self-intersections; exact.
    pub fn is_embedded(&mut self, mesh: &Mesh) -> bool {
        self.embedding.is_embedded(mesh)
    }

    /// Refines the mesh as [`Embedding::refine`] does, and returns whether it was refined; `sampling` is that of the
    /// mesh before the refinement. Pauses meanwhile.
    ///
    /// # Errors
    /// As [`Mesh::refine`].
    pub async fn refine_in_slices(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        pauses: &Pauses,
    ) -> Result<bool, MeshError> {
        self.embedding.sync_with_edge(mesh, sampling.longest());
        pauses.now().await;
        self.embedding.refine_in_slices(mesh, pauses).await
    }

    /// Renumbers the vertices of the mesh as [`Mesh::reorder`] does, also those that the last call of [`Self::resolve`] left
    /// to the next one, with memory for at least `room` slots.
    pub fn reorder(&mut self, mesh: &mut Mesh, room: usize) {
        self.embedding.free();
        let names = mesh.reorder_with_room(room);
        self.set_pending(self.pending().renumbered(&names));
    }

    /// Returns the vertices that edits of the last call of [`Self::resolve`] created or displaced; some may have been
    /// deleted since.
    pub fn edited(&self) -> &[VertexId] {
        &self.edited
    }

    /// Returns whether the last call of [`Self::resolve`] has left vertices whose edge lengths the next call has to
    /// check.
    pub fn has_pending_edges(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Returns the vertices that the last call of [`Self::resolve`] left to the next one, to be saved with a run.
    pub fn pending(&self) -> Pending {
        Pending { queue: self.queue.iter().copied().collect(), dirty: self.dirty.clone() }
    }

    /// Replaces the pending vertices, when a saved run is restored.
    pub fn set_pending(&mut self, pending: Pending) {
        self.queued.clear();
        self.is_dirty.clear();
        pending.queue.iter().for_each(|&v| _ = mark(&mut self.queued, v));
        pending.dirty.iter().for_each(|&v| _ = mark(&mut self.is_dirty, v));
        self.queue = pending.queue.into();
        self.dirty = pending.dirty;
    }

    /// Marks `v` as dirty: appends it to the queue of vertices whose edges are to be checked, and marks it for the next
    /// contact query.
    pub(super) fn touch(&mut self, v: VertexId) {
        if mark(&mut self.queued, v) {
            self.queue.push_back(v);
        }
        if mark(&mut self.is_dirty, v) {
            self.dirty.push(v);
        }
    }

    /// Records a vertex that an edit created or displaced, and marks it as [`Self::touch`] does.
    pub(super) fn touch_edited(&mut self, v: VertexId) {
        self.edited.push(v);
        self.touch(v);
    }

    pub(super) fn pop(&mut self) -> Option<VertexId> {
        let v = self.queue.pop_front()?;
        self.queued[v.index()] = false;
        Some(v)
    }

    /// Removes and returns the vertices marked for a contact query, in the order they were marked.
    pub(super) fn take_dirty(&mut self) -> Vec<VertexId> {
        let dirty = std::mem::take(&mut self.dirty);
        for v in &dirty {
            self.is_dirty[v.index()] = false;
        }
        dirty
    }
}

/// Sets the flag of the vertex `v` in an array by slot; returns whether it was clear.
fn mark(flags: &mut Vec<bool>, v: VertexId) -> bool {
    if v.index() >= flags.len() {
        flags.resize(v.index() + 1, false);
    }
    !std::mem::replace(&mut flags[v.index()], true)
}

#[cfg(test)]
mod tests {
    use super::super::Unguided;
    use super::*;
    use crate::mesh::TriangleMesh;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Regression: on a needle pulled out of a sphere, edits undo each other or are rejected, and contacts are
    /// everywhere; a single call of `resolve` never returned.
    #[test]
    #[ignore = "long: npm run test:all"]
    fn a_needle_is_resolved_in_calls_of_bounded_work() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 5.0, 1.5).unwrap();
        let x = |v: VertexId| mesh.position(v).x;
        let tip = mesh.vertices().min_by(|&a, &b| x(a).total_cmp(&x(b))).unwrap();
        mesh.set_position(tip, Vec3::new(-40.0, 3.0, 1.0));
        let mut resolver = Resolver::with_max_vertices(500);
        let mut active: Vec<VertexId> = mesh.vertices().collect();
        let mut effort = 0;
        for _ in 0..12 {
            resolver.resolve(&mut mesh, Sampling::new(0.9), &active);
            assert_eq!(mesh.check(), Ok(()));
            assert!(resolver.is_embedded(&mesh));
            active.clear();
            // The last edit may exceed the budget: in all its variants it may visit and change all triangles.
            let most = MIN_EFFORT + (EFFORT_PER_VERTEX + 200) * 500;
            assert!(resolver.embedding.effort() - effort < most);
            effort = resolver.embedding.effort();
        }
        // Joins add a few vertices even after splitting has stopped.
        assert!(mesh.vertex_count() <= 520);
    }

    /// Regression: edits beside two hubs of 4,000 neighbours, each of which tested all of these, took 3 s between pauses.
    #[test]
    fn edits_beside_hubs_pause() {
        const RIM: u32 = 300;
        let at = |k: u32| {
            let angle = f64::from(k) / f64::from(RIM) * std::f64::consts::TAU;
            Vec3::new(libm::cos(angle) as f32, libm::sin(angle) as f32, 0.0)
        };
        let mut cone = TriangleMesh { positions: vec![Vec3::Z, -Vec3::Z], ..TriangleMesh::default() };
        cone.positions.extend((0..RIM).map(at));
        for (u, v) in (0..RIM).map(|k| (2 + k, 2 + (k + 1) % RIM)) {
            cone.triangles.extend([[0, u, v], [1, v, u]]);
        }
        let mut mesh = Mesh::from_triangles(&cone).unwrap();
        let all: Vec<VertexId> = mesh.vertices().collect();
        let mut resolver = Resolver::with_max_vertices(2000);
        let pauses = Pauses::default();
        finished(resolver.resolve_in_slices(&mut mesh, Sampling::new(0.2), &all, &Unguided, &pauses));
        assert_eq!(mesh.check(), Ok(()));
        assert!(resolver.is_embedded(&mesh));
        assert!(pauses.work() > 20 * u64::from(RIM), "{}", pauses.work());
    }
}
