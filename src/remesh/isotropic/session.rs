//! What is known of each vertex while a mesh is remeshed, and what edits may take from the shape.

use super::fan::Fan;
use super::surface::{Foot, foot};
use crate::math::Vec3;
use crate::mesh::{EditError, Mesh, VertexId};
use crate::remesh::Edits;

/// How far the surface may move in collapses and moves, all in all, and in one flip, in the aim. With more, thin parts get short and
/// sharp edges blunt; with less, edges on rough surfaces stay out of bounds.
const MOST_LOST: f32 = 0.25;
const FLIP_DEPTH: f32 = 0.15;

/// A mesh on its way from the surface as it was.
pub(super) struct Session<'a, E> {
    /// The mesh as it was.
    pub surface: &'a Mesh,
    /// By slot of the surface as it was, its normals.
    normals: Vec<Vec3>,
    /// By slot, a vertex of the surface as it was that is near.
    homes: Vec<VertexId>,
    /// By slot of the surface as it was, whether anything but splits may be done there.
    free: Vec<bool>,
    /// By slot, how far collapses have moved the surface here, at most.
    lost: Vec<f32>,
    /// What the collapse that was asked about last would make of it.
    would_lose: f32,
    aim: f32,
    edits: E,
}

impl<'a, E: Edits> Session<'a, E> {
    /// For a copy of `surface`, with edges of about `aim` to come.
    pub fn new(surface: &'a Mesh, aim: f32, free: Vec<bool>, edits: E) -> Self {
        let slots = surface.slots();
        let homes = (0..slots).map(VertexId::from_index).collect();
        let normals = homes_normals(surface);
        Self { surface, normals, free, homes, lost: vec![0.0; slots], would_lose: 0.0, aim, edits }
    }

    /// The same with edits made in another way.
    pub fn with<F>(self, free: Vec<bool>, edits: F) -> Session<'a, F> {
        let Self { surface, normals, homes, lost, would_lose, aim, .. } = self;
        Session { surface, normals, free, homes, lost, would_lose, aim, edits }
    }

    /// A vertex of the surface as it was that is near.
    pub fn home(&self, v: VertexId) -> VertexId {
        self.homes[v.index()]
    }

    /// Whether `v` may be moved and its edges collapsed and flipped.
    pub fn is_free(&self, v: VertexId) -> bool {
        self.free[self.homes[v.index()].index()]
    }

    /// The length of the edges to come.
    pub fn aim(&self) -> f32 {
        self.aim
    }

    /// The point of the surface as it was that is nearest to `p`, as seen from `v`.
    pub fn foot(&self, v: VertexId, p: Vec3) -> Foot {
        foot(self.surface, self.homes[v.index()], p)
    }

    /// Whether a triangle with these corners and this normal looks out of the surface as it was.
    pub fn looks_out(&self, corners: [VertexId; 3], normal: Vec3) -> bool {
        let [u, v, w] = corners.map(|corner| self.normals[self.homes[corner.index()].index()]);
        normal.dot(u) > 0.0 || normal.dot(v) > 0.0 || normal.dot(w) > 0.0
    }

    /// Puts `v` at a point of the surface as it was, if nothing is in the way.
    pub fn place(&mut self, mesh: &mut Mesh, v: VertexId, foot: Foot, lost: f32) -> bool {
        let moved = self.edits.attempt(mesh, |mesh| {
            mesh.set_position(v, foot.point);
            Ok(())
        });
        if moved.is_ok() {
            self.homes[v.index()] = foot.home;
            self.lost[v.index()] = lost;
        }
        moved.is_ok()
    }

    /// How far the surface around `gone` would be from it without it; `None` where a triangle would not look out.
    fn drop(&self, mesh: &Mesh, kept: VertexId, gone: VertexId) -> Option<f32> {
        let mut fan = Fan::new(mesh.position(gone), mesh.position(kept));
        for (a, b) in mesh.ring(gone).pairs().filter(|&(a, b)| a != kept && b != kept) {
            if !self.looks_out([kept, a, b], fan.push(mesh.position(a), mesh.position(b))) {
                return None;
            }
        }
        Some(fan.gap())
    }

    /// What `v` has lost if it loses `gap` more; `None` where that is too much.
    pub fn after_losing(&self, v: VertexId, gap: f32) -> Option<f32> {
        let lost = self.lost[v.index()] + gap;
        (lost <= MOST_LOST * self.aim).then_some(lost)
    }

    /// Brings the mesh into the order of memory.
    pub fn reorder(&mut self, mesh: &mut Mesh) {
        let names = mesh.reorder();
        let (mut homes, mut lost) = (vec![VertexId(0); mesh.slots()], vec![0.0; mesh.slots()]);
        for (old, new) in names.iter().enumerate() {
            if let Some(new) = new {
                homes[new.index()] = self.homes[old];
                lost[new.index()] = self.lost[old];
            }
        }
        (self.homes, self.lost) = (homes, lost);
    }
}

impl<E: Edits> Edits for Session<'_, E> {
    fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        self.edits.attempt(mesh, edit)
    }

    fn may_collapse(&mut self, mesh: &Mesh, kept: VertexId, gone: VertexId) -> bool {
        if !self.is_free(kept) || !self.is_free(gone) {
            return false;
        }
        let Some(drop) = self.drop(mesh, kept, gone) else { return false };
        let Some(lost) = self.after_losing(gone, drop) else { return false };
        self.would_lose = lost.max(self.lost[kept.index()]);
        true
    }

    fn may_flip(&mut self, mesh: &Mesh, ends: [VertexId; 2], across: [VertexId; 2]) -> bool {
        let [[p, q], [a, b]] = [ends, across].map(|pair| pair.map(|v| mesh.position(v)));
        let between = (q - p).cross(b - a);
        let depth = between.dot(a - p);
        let most = FLIP_DEPTH * self.aim;
        [ends, across].as_flattened().iter().all(|&v| self.is_free(v))
            && depth * depth <= most * most * between.length_squared()
            && self.looks_out([ends[0], across[1], across[0]], (b - p).cross(a - p))
            && self.looks_out([ends[1], across[0], across[1]], (a - q).cross(b - q))
    }

    fn collapsed(&mut self, kept: VertexId) {
        self.lost[kept.index()] = self.would_lose;
    }

    fn was_split(&mut self, fresh: VertexId, u: VertexId) {
        if fresh.index() >= self.homes.len() {
            self.homes.resize(fresh.index() + 1, VertexId(0));
            self.lost.resize(fresh.index() + 1, 0.0);
        }
        self.homes[fresh.index()] = self.homes[u.index()];
        self.lost[fresh.index()] = self.lost[u.index()];
    }
}

/// The unit normals by slot; zero where there is no area.
fn homes_normals(surface: &Mesh) -> Vec<Vec3> {
    (0..surface.slots())
        .map(|slot| surface.area_normal(VertexId::from_index(slot)).normalize_or_zero())
        .collect()
}
