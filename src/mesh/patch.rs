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
        // The slot of a removed vertex may be that of a new one.
        let id = |corner| match corner {
            PatchCorner::Kept(v) => (!is_removed(v)).then_some(v).ok_or(EditError::OpenPatch(v)),
            PatchCorner::New(k) => added.get(k as usize).copied().ok_or(EditError::OpenPatch(VertexId(k))),
        };
        for &[a, b, c] in &patch.triangles {
            let ids = [id(a)?, id(b)?, id(c)?];
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
            self.push_slot(Vec3::ZERO);
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

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use PatchCorner::{Kept, New};

    /// Returns a fan of triangles around new vertex 0 over the ring of a vertex.
    fn fan(mesh: &Mesh, v: VertexId, tip: Vec3) -> Patch {
        let triangles = mesh.ring(v).pairs().map(|(a, b)| [New(0), Kept(a), Kept(b)]).collect();
        Patch { positions: vec![tip], triangles }
    }

    /// Returns two icosahedra side by side, and a vertex of each.
    fn pair() -> (Mesh, [VertexId; 2]) {
        let mut mesh = Mesh::icosahedron(Vec3::ZERO, 1.0);
        let other = mesh.append(&Mesh::icosahedron(Vec3::X * 3.0, 1.0)).unwrap();
        (mesh, [VertexId(0), other[0]])
    }

    /// Returns a tube between the rings of two vertices, with a ring of new vertices in the middle.
    fn tube(mesh: &Mesh, ends: [VertexId; 2]) -> Patch {
        let [first, mut second] = ends.map(|v| mesh.ring(v).as_slice().to_vec());
        second.reverse();
        let mut patch = Patch::default();
        for k in 0..5 {
            let next = (k + 1) % 5;
            let (a, b) = (New(k as u32), New(next as u32));
            patch.positions.push(mesh.position(first[k]).midpoint(mesh.position(second[k])));
            let [c, d] = [Kept(first[k]), Kept(first[next])];
            let [e, f] = [Kept(second[k]), Kept(second[next])];
            patch.triangles.extend([[c, d, b], [c, b, a], [e, b, f], [e, a, b]]);
        }
        patch
    }

    #[test]
    fn a_fan_replaces_a_vertex_in_its_slot() {
        let (mut mesh, [v, _]) = pair();
        let patch = fan(&mesh, v, Vec3::splat(2.0));
        let before = mesh.to_triangles();
        assert_eq!(mesh.replace(&[v], &patch), Ok(vec![v]));
        assert_eq!((mesh.check(), mesh.euler(), mesh.position(v)), (Ok(()), 4, Vec3::splat(2.0)));
        assert_eq!(mesh.to_triangles().triangles, before.triangles);
    }

    #[test]
    fn a_tube_joins_two_components_and_caps_part_them_again() {
        let (mut mesh, ends) = pair();
        let caps = ends.map(|v| mesh.position(v));
        let patch = tube(&mesh, ends);
        let added = mesh.replace(&ends, &patch).unwrap();
        assert_eq!((mesh.check(), mesh.euler(), mesh.component_count()), (Ok(()), 2, 1));
        assert_eq!((added.len(), mesh.slots()), (5, 27));
        let mut removed = added;
        removed.sort_unstable();
        let rim = |inner: VertexId| {
            let ring = mesh.ring(inner).as_slice();
            ring.iter().copied().filter(|w| removed.binary_search(w).is_err()).collect::<Vec<_>>()
        };
        assert!(removed.iter().all(|&v| rim(v).len() >= 2));
        // The rims of the tube are the rings of the vertices that it replaced.
        let (whole, _) = pair();
        let mut caps_patch = Patch { positions: caps.to_vec(), triangles: Vec::new() };
        for (k, &v) in ends.iter().enumerate() {
            let fan = whole.ring(v).pairs().map(|(a, b)| [New(k as u32), Kept(a), Kept(b)]);
            caps_patch.triangles.extend(fan);
        }
        mesh.replace(&removed, &caps_patch).unwrap();
        assert_eq!((mesh.check(), mesh.euler(), mesh.component_count()), (Ok(()), 4, 2));
        assert_eq!(mesh.vertex_count(), whole.vertex_count());
    }

    #[test]
    fn components_are_removed_and_added() {
        let (mut mesh, _) = pair();
        let mut members = mesh.component_of(VertexId(0), usize::MAX);
        members.sort_unstable();
        mesh.replace(&members, &Patch::default()).unwrap();
        assert_eq!((mesh.check(), mesh.euler(), mesh.vertex_count()), (Ok(()), 2, 12));
        let corners = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        let patch = Patch {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: corners.map(|triangle| triangle.map(New)).to_vec(),
        };
        let added = mesh.replace(&[], &patch).unwrap();
        assert_eq!((mesh.check(), mesh.euler(), mesh.slots(), added.len()), (Ok(()), 4, 24, 4));
    }

    #[test]
    fn a_patch_that_leaves_the_surface_open_changes_nothing() {
        let (mesh, ends) = pair();
        let [v, _] = ends;
        let whole = fan(&mesh, v, Vec3::ZERO);
        let mut missing = whole.clone();
        missing.triangles.pop();
        let mut turned = whole.clone();
        turned.triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
        let mut twice = whole.clone();
        twice.triangles.push(whole.triangles[0]);
        let mut unknown = whole.clone();
        unknown.triangles[0][0] = New(7);
        let mut removed = whole.clone();
        removed.triangles[0][0] = Kept(v);
        let mut unused = whole.clone();
        unused.positions.push(Vec3::ONE);
        for patch in [missing, turned, twice, unknown, removed, unused, tube(&mesh, ends)] {
            let mut same = mesh.clone();
            assert!(matches!(same.replace(&[v], &patch), Err(EditError::OpenPatch(_))), "{patch:?}");
            assert_eq!(same, mesh);
        }
    }

    #[test]
    fn a_replacement_is_rolled_back_with_its_slots() {
        let (mut mesh, ends) = pair();
        mesh.remove_component(ends[1]);
        let (before, slots) = (mesh.to_triangles(), mesh.slots());
        let ring = mesh.ring(ends[0]).as_slice().to_vec();
        // A tower of six more rings than there are free slots.
        let mut patch = Patch::default();
        let mut lower: Vec<PatchCorner> = ring.iter().map(|&w| Kept(w)).collect();
        for floor in 0..4u32 {
            let upper: Vec<PatchCorner> = (0..5).map(|k| New(5 * floor + k)).collect();
            for k in 0..5 {
                let next = (k + 1) % 5;
                patch.positions.push(mesh.position(ring[k]) * (2.0 + floor as f32));
                patch
                    .triangles
                    .extend([[lower[k], lower[next], upper[k]], [lower[next], upper[next], upper[k]]]);
            }
            lower = upper;
        }
        patch.positions.push(mesh.position(ends[0]) * 9.0);
        patch.triangles.extend((0..5).map(|k| [New(20), lower[k], lower[(k + 1) % 5]]));
        mesh.begin();
        let added = mesh.replace(&[ends[0]], &patch).unwrap();
        assert_eq!((mesh.check(), mesh.euler(), added.len()), (Ok(()), 2, 21));
        assert!(mesh.slots() > slots);
        mesh.roll_back();
        assert_eq!((mesh.check(), mesh.slots(), mesh.vertex_count()), (Ok(()), slots, 12));
        assert_eq!(mesh.to_triangles(), before);
        assert_eq!(mesh.replace(&[ends[0]], &patch), Ok(added));
        assert_eq!(mesh.check(), Ok(()));
    }
}
