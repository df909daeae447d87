//! Keeps a mesh from crossing itself: moves are held back, edits taken back, before anything crosses.
//!
//! The mesh did not cross itself before; so there is always a way back to a mesh that does not. What is near is found
//! through a grid that follows the mesh ([`StarGrid`]); whether it crosses is decided exactly.
//!
//! Two triangles cross in one of three ways, each looked for where it can be:
//! - they have a corner in common: around each vertex (`star`);
//! - a corner of one is a neighbour of a corner of the other: around each edge (`star`);
//! - else two corners that are no neighbours are near each other: the end P of an edge of length `a` that meets a
//!   triangle with edges up to `b` and that corner A of the triangle which is nearest to the meeting point have
//!   |PA|² ≤ a²/4 + b²/3 for one of the two ends (`look`).

mod clearance;
mod look;
mod motion;
mod near;
mod output;
mod patch;
mod refine;
mod room;
mod star;

use crate::math::{Bounds, DAffine3, Vec3};
use crate::mesh::{EditError, Mesh, VertexId};
use crate::spatial::StarGrid;
use output::OutputSpace;
use room::{Concerns, Room};
use smallvec::SmallVec;
use star::{higher, longest_edge};

/// 1/√3, rounded up: the distance of a point of a triangle from its nearest corner, in the triangle's longest edge.
const NEAREST_CORNER: f32 = 0.577_351;

/// √(1/4 + 1/3), rounded up: the distance between corners of two triangles that cross, in the longest edge of both.
const PIERCING: f32 = 0.763_763;

/// How far a star may move before its vertex looks again for what is near, in the ordinary edge. With more, more is near;
/// with less, they look more often. Few vertices of an ordinary mesh have anything near.
const SEARCH_ROOM: f32 = 0.04;

/// Squares of lengths below this are rounded to few digits, or to 0: an edge counts as that long at least, a way as that
/// far, and less room than that is none.
const FINEST: f32 = 1e-17;

/// Keeps one mesh embedded.
///
/// A vertex that was looked at has some room: it is not looked at again before the vertices of its star have used it up.
/// How much room is found has no influence on what is found to cross.
#[derive(Clone, Debug, Default)]
pub struct Embedding {
    grid: StarGrid,
    /// An edge that is longer than most of the mesh.
    edge: f32,
    /// By vertex, its longest edge when it was looked at.
    longest: Vec<f32>,
    /// By vertex, the others that were near when it or they searched for them.
    near: Vec<SmallVec<[VertexId; 4]>>,
    /// By vertex, whether one that is no neighbour may be within the contact distance.
    close: Vec<bool>,
    /// By vertex, how far its star may still go before it is looked at again.
    room: Vec<Room>,
    /// By vertex, the longest way in its star, while the mesh moves, and the vertices where it is not 0.
    gone: Vec<f32>,
    touched: Vec<VertexId>,
    /// Vertices that edits made or changed since the last move: those near them do not know yet.
    fresh: Vec<VertexId>,
    /// By vertex, what it is to be looked at for now, and the vertices that have any.
    doubts: Vec<Concerns>,
    doubtful: Vec<VertexId>,
    /// The version of the mesh's geometry that is known here.
    version: Option<u32>,
    /// The version at which all of it was entered in the grid.
    entered: Option<u32>,
    /// A vertex is marked where its entry is the newest mark.
    marks: Vec<u32>,
    newest: u32,
    found: Vec<VertexId>,
    /// Where vertices were before they moved.
    from: Vec<Vec3>,
    /// Since all of the mesh was looked at, something crossed at a vertex that did not move, or not any more.
    stuck: bool,
    effort: u64,
    /// Where triangles must not cross, either.
    output: Option<OutputSpace>,
}

impl Embedding {
    /// From now on the mesh, which stays within `bounds`, is also kept from crossing itself where `map` leads, as its positions come
    /// out rounded to single precision. Not where that is coarser than a hundredth of a unit of the mesh.
    pub fn watch_output(&mut self, map: DAffine3, bounds: &Bounds) {
        self.output = OutputSpace::new(map, bounds);
        self.version = None;
    }

    /// Clearance up to which triangles are tested exactly.
    fn finest(&self) -> f32 {
        self.output.map_or(FINEST, |space| higher(FINEST, space.rounding()))
    }

    /// As [`Self::follow`]. `edge` is longer than most of its edges. It makes a difference to speed, and bounds what
    /// [`Self::company`] can be asked for; not to what is found to cross.
    pub fn follow_with(&mut self, mesh: &Mesh, edge: f32) {
        let edge = higher(FINEST, edge);
        if self.edge != edge {
            self.edge = edge;
            self.version = None;
        }
        self.know(mesh);
    }

    /// Follows `mesh`, whatever was done to it since the last time.
    pub fn follow(&mut self, mesh: &Mesh) {
        self.know(mesh);
        self.grid.fill_cells();
    }

    /// Follows `mesh`, without the cells of the grid, which a look at all of it does not need.
    fn know(&mut self, mesh: &Mesh) {
        if self.version == Some(mesh.geometry_version()) {
            return;
        }
        self.grid = StarGrid::new(self.edge, SEARCH_ROOM * self.edge, mesh.slots());
        self.stuck = false;
        self.room.clear();
        self.near.clear();
        self.close.clear();
        self.make_room(mesh.slots());
        self.fresh.clear();
        for v in mesh.vertices() {
            self.see(mesh, v);
            self.enter(mesh, v);
        }
        self.version = Some(mesh.geometry_version());
        self.entered = self.version;
    }

    /// Makes an edit, or several as one, and takes it back where triangles would cross.
    ///
    /// # Errors
    /// That of the edit; [`EditError::WouldCross`]. The mesh is then as it was.
    pub fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        self.attempt_with(mesh, edit, Self::changes_cross)
    }

    /// As [`Self::attempt`], but tests only pairs of triangles with a common corner. [`Self::crossing`] finds what else intersects.
    ///
    /// # Errors
    /// As [`Self::attempt`].
    pub fn attempt_in_one_rings<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        self.attempt_with(mesh, edit, Self::one_rings_cross)
    }

    fn attempt_with<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
        crosses: fn(&mut Self, &Mesh, &[[VertexId; 3]]) -> bool,
    ) -> Result<T, EditError> {
        self.follow(mesh);
        mesh.begin();
        let done = edit(mesh).and_then(|done| self.accept_changes(mesh, crosses).map(|()| done));
        if done.is_ok() {
            mesh.commit();
        } else {
            mesh.roll_back();
        }
        self.version = Some(mesh.geometry_version());
        done
    }

    /// Follows the changes since [`Mesh::begin`], unless they make triangles cross.
    fn accept_changes(
        &mut self,
        mesh: &Mesh,
        crosses: fn(&mut Self, &Mesh, &[[VertexId; 3]]) -> bool,
    ) -> Result<(), EditError> {
        let changed = mesh.changed_triangles();
        if crosses(self, mesh, &changed) {
            return Err(EditError::WouldCross);
        }
        self.follow_changes(mesh, &changed);
        Ok(())
    }

    /// Whether no two triangles share more than their common corners and edges.
    pub fn is_embedded(&mut self, mesh: &Mesh) -> bool {
        self.look_everywhere(mesh).is_empty()
    }

    /// The corners of all triangles that cross another, in order.
    pub fn crossing(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        self.look_everywhere(mesh)
    }

    /// The number of near vertices that were looked at for edits, over all time.
    pub fn effort(&self) -> u64 {
        self.effort
    }

    /// Deletes the component of `v` and returns how many vertices it had.
    pub fn remove_component(&mut self, mesh: &mut Mesh, v: VertexId) -> usize {
        self.follow(mesh);
        let members = mesh.component_of(v, usize::MAX);
        members.iter().for_each(|&w| self.grid.remove(w));
        let count = mesh.remove_component(v);
        self.version = Some(mesh.geometry_version());
        count
    }

    /// Has room for what is known of so many vertices; of new ones nothing is.
    fn make_room(&mut self, slots: usize) {
        self.longest.resize(slots, 0.0);
        self.near.resize(slots, SmallVec::new());
        self.close.resize(slots, true);
        self.room.resize(slots, Room::NONE);
    }

    /// Notes the longest edge at `v`.
    fn see(&mut self, mesh: &Mesh, v: VertexId) {
        self.longest[v.index()] = longest_edge(mesh, v);
    }

    /// Enters `v` in the grid as it is, and as it was seen.
    fn enter(&mut self, mesh: &Mesh, v: VertexId) {
        self.grid.set(v, mesh.position(v), self.longest[v.index()]);
    }

    /// Takes the changes since [`Mesh::begin`] into the grid.
    fn follow_changes(&mut self, mesh: &Mesh, changed: &[[VertexId; 3]]) {
        self.make_room(mesh.slots());
        for v in mesh.touched() {
            self.fresh.push(v);
            self.forget(v);
            if mesh.is_live(v) {
                self.see(mesh, v);
                self.enter(mesh, v);
            } else {
                self.grid.remove(v);
            }
        }
        // Neighbours of what moved have longer edges, too.
        for names in changed {
            let [a, b, c] = names.map(|v| mesh.position(v));
            let square = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
            let edge = square.sqrt();
            for &v in names {
                self.forget(v);
                let longest = &mut self.longest[v.index()];
                *longest = if edge > *longest { edge } else { *longest };
                self.grid.stretch(v, edge);
            }
        }
    }

    /// Nothing is known any more of `v`, which an edit made or changed.
    fn forget(&mut self, v: VertexId) {
        self.close[v.index()] = true;
        if std::mem::replace(&mut self.room[v.index()], Room::NONE) != Room::NONE {
            self.fresh.push(v);
        }
    }

    /// Takes all marks away.
    fn new_marks(&mut self, mesh: &Mesh) {
        self.marks.resize(mesh.slots(), 0);
        self.newest = self.newest.wrapping_add(1);
        if self.newest == 0 {
            self.marks.fill(0);
            self.newest = 1;
        }
    }

    /// Marks `v` and says whether it was not.
    fn mark(&mut self, v: VertexId) -> bool {
        std::mem::replace(&mut self.marks[v.index()], self.newest) != self.newest
    }

    fn is_marked(&self, v: VertexId) -> bool {
        self.marks[v.index()] == self.newest
    }
}
