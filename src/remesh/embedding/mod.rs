//! Collision handling: keeps a mesh free of self-intersections by rejecting edits and shortening displacements.
//!
//! The previous state of the mesh has no self-intersections but those [`tolerated`], so it can always be restored.
//! Detection has three parts:
//! - [`broad_phase`]: pairs of non-adjacent vertices whose triangles may intersect, from a grid that is updated with
//!   the mesh ([`VertexGrid`]);
//! - [`narrow_phase`]: conservative filters (`one_ring`, `clearance`), then exact predicates on pairs of triangles;
//! - [`motion_bound`]: each filter returns a displacement bound below which its pair cannot intersect; the pair is not
//!   tested again before the displacements of its vertices add up to that bound ([`certificates`]).
//!
//! Two triangles intersect in one of three configurations, each tested where it can occur:
//! - they share a corner: in the one-ring of a vertex;
//! - a corner of one is adjacent to a corner of the other: across an edge;
//! - otherwise two non-adjacent corners are near each other. If an edge of length `a` with end P meets a triangle with
//!   edges up to `b`, and A is the corner nearest to the intersection, then |PA|² ≤ a²/4 + b²/3 for one of the two
//!   ends.

mod broad_phase;
mod certificates;
mod clearance;
mod motion;
mod motion_bound;
mod narrow_phase;
mod one_ring;
mod output;
mod patch;
mod refine;
mod replace;
mod separate;
mod tolerated;

use crate::math::{Bounds, DAffine3, higher, resize, resize_within, triangle};
use crate::mesh::{EditError, Mesh, MeshError, VertexId};
use crate::pauses::Pauses;
use crate::spatial::VertexGrid;
use certificates::Certificates;
use motion_bound::{Checks, MotionBounds};
use one_ring::longest_edge;
use output::OutputSpace;
use smallvec::SmallVec;
pub use tolerated::PairsOfParts;
use tolerated::Tolerated;

/// 1/√3, rounded up: the largest distance of a point of a triangle from its nearest corner, relative to the longest
/// edge of the triangle.
const NEAREST_CORNER: f32 = 0.577_351;

/// √(1/4 + 1/3), rounded up: the largest distance between the nearest corners of two intersecting triangles, relative
/// to the longest edge of both.
const PIERCING: f32 = 0.763_763;

/// The skin of the broad phase: the displacement of a one-ring after which the vertices near its centre are searched
/// for again, relative to the ordinary edge (that of [`Embedding::sync_with_edge`]). A wider skin gives more pairs, a
/// narrower one more searches. Few vertices of an ordinary mesh have any pair.
const SEARCH_SKIN: f32 = 0.04;

/// The smallest length that is distinguished, in units of the mesh: squares of shorter lengths lose their digits to
/// rounding. Edges and displacements count as at least this long, and a smaller clearance as none.
const MIN_LENGTH: f32 = 1e-17;

/// Number of triangles around vertices that are tested after edits in a unit of work.
const TESTED_PER_UNIT: usize = 32;

/// The vertices found near one vertex. Few vertices have any, so that a list takes one pointer where there is none.
type NearbyList = Option<Box<SmallVec<[Nearby; 4]>>>;

/// A non-adjacent vertex found near another by the broad phase, and the sum of both odometers (see [`Certificates`]) up
/// to which their triangles are certified not to intersect.
#[derive(Clone, Copy, Debug)]
struct Nearby {
    vertex: VertexId,
    until: f32,
}

/// Collision guard of one mesh: tests edits and moves, and prevents those that would cause self-intersections.
///
/// Motion bounds decide when a pair is tested, never the result of a test. What only checks need has entries for the
/// slots at the last check (`resize_for_checks`): where the mesh has grown since, or everything was discarded, edits need
/// none of it.
#[derive(Clone, Debug, Default)]
pub struct Embedding {
    grid: VertexGrid,
    /// The ordinary edge: a length that most edges of the mesh do not exceed.
    ordinary_edge: f32,
    /// The longest edge at each vertex, as last measured, by slot.
    longest: Vec<f32>,
    /// The non-adjacent vertices that the broad phase found near each vertex, by slot.
    nearby: Vec<NearbyList>,
    /// Whether any non-adjacent vertex may be within the contact distance of each vertex, by slot.
    may_touch: Vec<bool>,
    /// The remaining motion bounds of each vertex, by slot: the displacements of its one-ring up to its next tests.
    motion_bounds: Vec<MotionBounds>,
    certificates: Certificates,
    /// The largest displacement in the one-ring of each vertex during a move, by slot.
    ring_displacement: Vec<f32>,
    /// Vertices that edits created or changed since the last move, each once; lists of near vertices do not contain them
    /// yet.
    edited: Vec<VertexId>,
    /// Whether each vertex is in `edited`, by slot.
    is_edited: Vec<bool>,
    /// The pending collision checks of each vertex, by slot.
    pending: Vec<Checks>,
    /// The vertices with pending collision checks.
    dirty: Vec<VertexId>,
    /// The geometry version of the mesh for which grid, motion bounds and certificates are up to date.
    version: Option<u32>,
    /// The geometry version at which all vertices of the mesh were set in the grid; as long as the mesh has it, none
    /// has to be set again.
    entered: Option<u32>,
    /// Visited marks of vertices, by slot: a vertex is marked if its entry equals `newest`.
    marks: Vec<u32>,
    newest: u32,
    found: Vec<VertexId>,
    /// Whether, in a move since everything was last rebuilt, an intersecting triangle had a corner without
    /// displacement: then shortening displacements may not have resolved the intersection.
    stuck: bool,
    effort: u64,
    /// Number of triangles around vertices that were tested after edits, the work besides [`Self::effort`].
    tested_around: u64,
    /// Number of pairs of triangles at two vertices that were compared, since it was last taken.
    compared: usize,
    /// The output space (world space in single precision), in which triangles must not intersect either, if it is
    /// watched.
    output: Option<OutputSpace>,
    /// The parts of the mesh that may intersect in moves.
    tolerated: Tolerated,
    /// Whether sweeps end at the number of pairs for which there is memory ([`Self::check_pairs`]).
    limits_pairs: bool,
    /// The number of pairs that the current sweep has found.
    swept: usize,
    /// Whether a sweep has found more pairs than there is memory for, so that intersections may not be found.
    is_crowded: bool,
}

impl Embedding {
    /// Also keeps the mesh, which stays within `bounds`, free of self-intersections after mapping by `map` and rounding
    /// to single precision. Has no effect if that rounding is coarser than a hundredth of a unit of the mesh.
    pub fn watch_output(&mut self, map: DAffine3, bounds: &Bounds) {
        self.output = OutputSpace::new(map, bounds);
        self.version = None;
    }

    /// Returns the clearance below which triangles are tested by exact predicates.
    fn exact_below(&self) -> f32 {
        output::exact_below(self.output.as_ref())
    }

    /// Brings grid, motion bounds and certificates up to date with `mesh` after any changes, and sets the ordinary
    /// edge: a length that most edges do not exceed. It affects speed and the largest distance of
    /// [`Self::for_each_contact`], not which intersections are found. Unlike [`Self::sync`], it does not fill the cells
    /// of the grid.
    pub fn sync_with_edge(&mut self, mesh: &Mesh, edge: f32) {
        let edge = higher(MIN_LENGTH, edge);
        if self.ordinary_edge != edge {
            self.ordinary_edge = edge;
            self.version = None;
        }
        self.sync_without_cells(mesh);
    }

    /// Brings grid, motion bounds and certificates up to date with `mesh` after any changes, and fills the cells of the
    /// grid, which edits and contact queries need.
    pub fn sync(&mut self, mesh: &Mesh) {
        self.sync_without_cells(mesh);
        self.grid.link_cells();
    }

    /// Synchronises as [`Self::sync`] does, but without filling the cells of the grid: a check of the whole mesh does
    /// not need them.
    fn sync_without_cells(&mut self, mesh: &Mesh) {
        if self.version == Some(mesh.geometry_version()) && !self.certificates.are_worn() {
            return;
        }
        self.free();
        self.grid = VertexGrid::new(self.ordinary_edge, SEARCH_SKIN * self.ordinary_edge, 0);
        self.grid.resize(mesh.slots(), mesh.room());
        self.stuck = false;
        resize_within(&mut self.longest, mesh.slots(), 0.0, mesh.room());
        for v in mesh.vertices() {
            self.measure(mesh, v);
            self.enter(mesh, v);
        }
        self.version = Some(mesh.geometry_version());
        self.entered = self.version;
    }

    /// Frees nearly all of the memory, before a change of the whole mesh after which everything has to be recomputed.
    pub fn free(&mut self) {
        self.grid = VertexGrid::default();
        self.motion_bounds = Vec::new();
        self.nearby = Vec::new();
        self.may_touch = Vec::new();
        self.certificates.begin(self.ordinary_edge);
        self.edited = Vec::new();
        self.is_edited = Vec::new();
        self.ring_displacement = Vec::new();
        self.version = None;
    }

    /// Performs one or more edits as a transaction, and rolls it back if triangles would intersect.
    ///
    /// # Errors
    /// That of the edit; [`EditError::WouldSelfIntersect`]. The mesh is unchanged on error.
    pub fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        self.attempt_with(mesh, edit, Self::changes_intersect)
    }

    /// Performs edits as [`Self::attempt`] does, but tests only pairs of triangles that share a corner, which is
    /// faster. Afterwards, [`Self::intersecting_vertices`] finds the other intersections.
    ///
    /// # Errors
    /// As [`Self::attempt`].
    pub fn attempt_in_one_rings<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        self.attempt_with(mesh, edit, Self::one_rings_intersect)
    }

    fn attempt_with<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
        intersects: impl FnOnce(&mut Self, &Mesh, &[[VertexId; 3]]) -> bool,
    ) -> Result<T, EditError> {
        self.sync(mesh);
        mesh.begin();
        let done = edit(mesh).and_then(|done| self.accept_changes(mesh, intersects).map(|()| done));
        if done.is_ok() {
            mesh.commit();
        } else {
            mesh.roll_back();
        }
        self.version = Some(mesh.geometry_version());
        done
    }

    /// Updates grid, motion bounds and certificates with the edits since [`Mesh::begin`]; an error if `intersects`
    /// finds that they make triangles intersect.
    fn accept_changes(
        &mut self,
        mesh: &Mesh,
        intersects: impl FnOnce(&mut Self, &Mesh, &[[VertexId; 3]]) -> bool,
    ) -> Result<(), EditError> {
        let changed = mesh.changed_triangles();
        if intersects(self, mesh, &changed) {
            return Err(EditError::WouldSelfIntersect);
        }
        self.sync_changes(mesh, &changed);
        Ok(())
    }

    /// Returns whether the mesh is free of self-intersections: no two triangles have more than their common corners and
    /// edges in common, also after the map of [`Self::watch_output`]; exact.
    pub fn is_embedded(&mut self, mesh: &Mesh) -> bool {
        self.check_all(mesh).is_empty()
    }

    /// Returns the corners of all triangles that intersect another, sorted by id; exact.
    pub fn intersecting_vertices(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        self.check_all(mesh)
    }

    /// Does what [`Self::intersecting_vertices`] does, and pauses meanwhile.
    pub async fn intersecting_vertices_in_slices(&mut self, mesh: &Mesh, pauses: &Pauses) -> Vec<VertexId> {
        self.check_all_in_slices(mesh, pauses).await
    }

    /// Returns the total work of all edits so far, counted mainly in nearby vertices visited, by which
    /// [`Resolver`](super::Resolver) limits a call.
    pub fn effort(&self) -> u64 {
        self.effort
    }

    /// Returns the number of triangles around vertices that were tested after edits so far: thousands for each edit beside
    /// a hub of as many.
    pub(crate) fn tested_around(&self) -> u64 {
        self.tested_around
    }

    /// Returns the units of work of these tests since [`Self::tested_around`] was `tested`.
    pub(crate) fn units_around_since(&self, tested: u64) -> usize {
        (self.tested_around - tested) as usize / TESTED_PER_UNIT
    }

    /// Appends the components of another mesh; returns the new vertices, and the corners of all triangles that
    /// intersect one of those components, sorted by id.
    ///
    /// # Errors
    /// As [`Mesh::append`].
    pub fn append(
        &mut self,
        mesh: &mut Mesh,
        components: &Mesh,
    ) -> Result<(Vec<VertexId>, Vec<VertexId>), MeshError> {
        self.sync(mesh);
        let added = mesh.append(components)?;
        self.resize_for_checks(mesh);
        for &v in &added {
            // Its slot may be one of a deleted vertex.
            self.forget(v);
            self.measure(mesh, v);
            self.enter(mesh, v);
            self.mark_dirty(v, Checks::ALL);
        }
        self.mark_edited_dirty(mesh);
        let intersecting = self.check_dirty(mesh);
        self.version = Some(mesh.geometry_version());
        Ok((added, intersecting))
    }

    /// Deletes the component of `v` from the mesh and the grid, and returns its number of vertices.
    pub fn remove_component(&mut self, mesh: &mut Mesh, v: VertexId) -> usize {
        self.sync(mesh);
        let members = mesh.component_of(v, usize::MAX);
        members.iter().for_each(|&w| self.grid.remove(w));
        let count = mesh.remove_component(v);
        self.version = Some(mesh.geometry_version());
        count
    }

    /// Resizes all arrays indexed by vertex slot to that of the mesh, before collision checks; those of new vertices are due.
    fn resize_for_checks(&mut self, mesh: &Mesh) {
        let (slots, room) = (mesh.slots(), mesh.room());
        resize_within(&mut self.longest, slots, 0.0, room);
        resize_within(&mut self.nearby, slots, None, room);
        resize_within(&mut self.may_touch, slots, true, room);
        resize_within(&mut self.pending, slots, Checks::default(), room);
        resize_within(&mut self.motion_bounds, slots, MotionBounds::NONE, room);
        self.certificates.resize(slots, room);
    }

    /// Measures and stores the longest edge at `v`.
    fn measure(&mut self, mesh: &Mesh, v: VertexId) {
        self.longest[v.index()] = longest_edge(mesh, v);
    }

    /// Sets the position of `v` and its longest edge, as last measured, in the grid.
    fn enter(&mut self, mesh: &Mesh, v: VertexId) {
        self.grid.set(v, mesh.position(v), self.longest[v.index()]);
    }

    /// Updates the grid and the motion bounds with the edits since [`Mesh::begin`]; `changed` are the triangles that
    /// these created or moved, by their corners.
    fn sync_changes(&mut self, mesh: &Mesh, changed: &[[VertexId; 3]]) {
        resize_within(&mut self.longest, mesh.slots(), 0.0, mesh.room());
        for v in mesh.touched_vertices() {
            self.forget(v);
            self.list_as_edited(v);
            if mesh.is_live(v) {
                self.measure(mesh, v);
                self.enter(mesh, v);
            } else {
                self.grid.remove(v);
            }
        }
        // Edges of the neighbours of moved vertices may have become longer.
        for corners in changed {
            let edge = triangle::longest_edge_squared(corners.map(|v| mesh.position(v))).sqrt();
            for &v in corners {
                self.forget(v);
                let longest = &mut self.longest[v.index()];
                *longest = if edge > *longest { edge } else { *longest };
                self.grid.raise_radius(v, edge);
            }
        }
    }

    /// Discards the motion bounds and certificates of `v`, which an edit created, moved or gave other triangles. Never
    /// inlined, for the size of its callers.
    #[inline(never)]
    fn forget(&mut self, v: VertexId) {
        if let Some(may_touch) = self.may_touch.get_mut(v.index()) {
            *may_touch = true;
        }
        self.certificates.revoke(v);
        if let Some(bounds) = self.motion_bounds.get_mut(v.index())
            && std::mem::replace(bounds, MotionBounds::NONE) != MotionBounds::NONE
        {
            self.list_as_edited(v);
        }
    }

    fn list_as_edited(&mut self, v: VertexId) {
        if v.index() >= self.is_edited.len() {
            resize(&mut self.is_edited, v.index() + 1, false);
        }
        if !std::mem::replace(&mut self.is_edited[v.index()], true) {
            self.edited.push(v);
        }
    }

    /// Clears the visited marks of all vertices.
    fn new_marks(&mut self, mesh: &Mesh) {
        resize_within(&mut self.marks, mesh.slots(), 0, mesh.room());
        self.newest = self.newest.wrapping_add(1);
        if self.newest == 0 {
            self.marks.fill(0);
            self.newest = 1;
        }
    }

    /// Marks `v` as visited; returns whether it was unmarked.
    fn mark(&mut self, v: VertexId) -> bool {
        std::mem::replace(&mut self.marks[v.index()], self.newest) != self.newest
    }

    fn is_marked(&self, v: VertexId) -> bool {
        self.marks[v.index()] == self.newest
    }
}
