//! Replacing part of a dynamic mesh by another surface with the same boundary.

use super::build::ring_from_links;
use super::{EditError, Mesh, Ring, VertexId};
use crate::math::Vec3;
use std::collections::BTreeMap;

/// A surface to be inserted by [`Mesh::replace`], with the same boundary as the part of the mesh that it replaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// The positions of the new vertices.
    pub positions: Vec<Vec3>,
    /// The triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[PatchCorner; 3]>,
}

/// A corner of a triangle of a [`Patch`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatchCorner {
    /// A vertex of the mesh that is not removed.
    Kept(VertexId),
    /// A new vertex, by its index in [`Patch::positions`].
    New(u32),
}

impl Mesh {
    /// Removes some vertices and all triangles at them, inserts the triangles of `patch` instead, and returns its new
    /// vertices, in order. χ changes by the numbers of vertices, edges and triangles.
    ///
    /// The attributes of the new vertices are unspecified, and the caller sets them.
    ///
    /// # Errors
    /// [`EditError::OpenPatch`] if the result would not be a closed surface; [`EditError::Full`] if no vertex ids are
    /// left.
    pub fn replace(&mut self, removed: &[VertexId], patch: &Patch) -> Result<Vec<VertexId>, EditError> {
        if !self.has_ids_for(patch.positions.len()) {
            return Err(EditError::Full);
        }
        let triangles_before = self.triangles_at(removed).len();
        let added = self.ids_for_patch(removed, patch.positions.len());
        let rings = self.rings_of_patch(removed, &added, patch)?;
        self.place(removed, &added, &patch.positions);
        for (v, ring) in rings {
            self.rings[v.index()] = ring;
        }
        let triangles = patch.triangles.len() as i64 - triangles_before as i64;
        self.half_edges = self.half_edges.saturating_add_signed(3 * triangles as isize);
        self.euler += added.len() as i64 - removed.len() as i64 - triangles / 2;
        self.topology_changed();
        Ok(added)
    }

    /// Returns the ids of `count` new vertices: first those of the removed ones, then free ones, then further ones.
    fn ids_for_patch(&self, removed: &[VertexId], count: usize) -> Vec<VertexId> {
        let further = (self.slots()..).map(VertexId::from_index);
        removed.iter().copied().chain(self.free.iter().rev().copied()).chain(further).take(count).collect()
    }

    /// Returns the rings that the vertices of the patch and the neighbours of removed vertices will have.
    fn rings_of_patch(
        &self,
        removed: &[VertexId],
        added: &[VertexId],
        patch: &Patch,
    ) -> Result<BTreeMap<VertexId, Ring>, EditError> {
        let mut links: BTreeMap<VertexId, Vec<[u32; 2]>> = BTreeMap::new();
        let is_removed = |v: VertexId| removed.binary_search(&v).is_ok();
        let mut rim = removed.to_vec();
        self.add_neighbours(&mut rim);
        for v in rim.into_iter().filter(|&v| !is_removed(v)) {
            let kept = self.ring(v).pairs().filter(|&(a, b)| !is_removed(a) && !is_removed(b));
            links.insert(v, kept.map(|(a, b)| [a.0, b.0]).collect());
        }
        for &v in added {
            links.insert(v, Vec::new());
        }
        for corners in &patch.triangles {
            let ids = corners.map(|corner| match corner {
                PatchCorner::Kept(v) => v,
                PatchCorner::New(k) => added.get(k as usize).copied().unwrap_or(VertexId(u32::MAX)),
            });
            for k in 0..3 {
                let (v, link) = (ids[k], [ids[(k + 1) % 3].0, ids[(k + 2) % 3].0]);
                links.get_mut(&v).ok_or(EditError::OpenPatch(v))?.push(link);
            }
        }
        links.into_iter().map(|(v, links)| Ok((v, ring_of(v, &links)?))).collect()
    }

    /// Frees the slots of removed vertices, or gives them, and further ones, to the new vertices.
    fn place(&mut self, removed: &[VertexId], added: &[VertexId], positions: &[Vec3]) {
        let (reused, taken) = added.split_at(added.len().min(removed.len()));
        let (from_free, pushed) = taken.split_at(taken.len().min(self.free.len()));
        let rest = &removed[reused.len()..];
        let mut changed = removed.to_vec();
        self.add_neighbours(&mut changed);
        changed.extend_from_slice(from_free);
        self.touch_distinct(&changed);
        for &v in from_free {
            self.free.pop();
            self.slot_taken_recorded(v);
        }
        for &v in rest {
            self.rings[v.index()] = Ring::default();
            self.free.push(v);
            self.slot_freed();
        }
        for _ in pushed {
            self.rings.push(Ring::default());
            self.positions.push(Vec3::ZERO);
            self.attributes.grow();
        }
        added.iter().zip(positions).for_each(|(v, &p)| self.positions[v.index()] = p);
    }
}

fn ring_of(v: VertexId, links: &[[u32; 2]]) -> Result<Ring, EditError> {
    if links.is_empty() {
        return Err(EditError::OpenPatch(v));
    }
    ring_from_links(v.index(), links).map_err(|_| EditError::OpenPatch(v))
}
