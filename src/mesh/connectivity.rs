//! Compact copies of the connectivity of a mesh, to which it can be set back.

use super::{Mesh, Ring, VertexId};
use crate::math::Vec3;

/// The least valence that takes more than a byte.
const LARGE: u8 = u8::MAX;

/// The one-rings of all slots of a mesh, one after the other: half of the memory that they take in a [`Mesh`].
#[derive(Clone, Debug)]
pub struct Connectivity {
    /// The valence of each slot, or [`LARGE`] if it is in `large`.
    valences: Vec<u8>,
    /// The valences of [`LARGE`] or more, in the order of slots.
    large: Vec<usize>,
    neighbours: Vec<VertexId>,
    free: Vec<VertexId>,
    euler: i64,
}

impl Mesh {
    /// Returns a copy of the one-rings and of the list of free slots, for [`Self::set_back`].
    pub fn connectivity(&self) -> Connectivity {
        let mut neighbours = Vec::with_capacity(self.half_edges);
        self.rings.iter().for_each(|ring| neighbours.extend_from_slice(ring.as_slice()));
        let valences = self.rings.iter().map(Ring::valence);
        Connectivity {
            large: valences.clone().filter(|&valence| valence >= LARGE.into()).collect(),
            valences: valences.map(|valence| u8::try_from(valence).unwrap_or(LARGE)).collect(),
            neighbours,
            free: self.free.clone(),
            euler: self.euler,
        }
    }

    /// Sets the mesh back to the connectivity and the positions, by slot, that it had before; the attributes of all
    /// slots are unspecified afterwards. The version counters increase.
    pub fn set_back(&mut self, before: &Connectivity, positions: &[Vec3]) {
        let slots = before.valences.len();
        self.rings.resize(slots, Ring::default());
        let (mut left, mut large) = (&before.neighbours[..], before.large.iter());
        for (ring, &valence) in self.rings.iter_mut().zip(&before.valences) {
            let valence = if valence == LARGE { large.next().copied() } else { Some(valence.into()) };
            let (own, others) = left.split_at(valence.unwrap_or(0));
            *ring = Ring::new(own.iter().copied());
            left = others;
        }
        self.positions.clear();
        self.positions.extend_from_slice(positions);
        self.attributes.truncate(slots);
        self.attributes.grow(slots);
        self.free.clone_from(&before.free);
        (self.half_edges, self.euler) = (before.neighbours.len(), before.euler);
        self.topology_changed();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Slots become free, are used again, and are added.
    #[test]
    fn a_mesh_is_set_back_to_what_it_was() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 4.0, 1.0).unwrap();
        let edge = |mesh: &Mesh, k: usize| mesh.edges().nth(k).unwrap();
        for k in [3, 40, 90] {
            let (u, v) = edge(&mesh, k);
            mesh.collapse(u, v, mesh.position(u)).unwrap();
        }
        let before = mesh.clone();
        let connectivity = mesh.connectivity();
        for refines in [false, true] {
            for k in 0..20 {
                let (u, v) = edge(&mesh, 7 * k);
                mesh.split(u, v, (mesh.position(u) + mesh.position(v)) * 0.5).unwrap();
            }
            if refines {
                mesh.reorder();
                mesh.refine().unwrap();
            }
            let changed = mesh.versions();
            mesh.set_back(&connectivity, before.positions());
            assert!(mesh.versions().iter().zip(changed).all(|(now, then)| *now > then));
            mesh.set_versions(before.versions());
            assert_eq!(mesh, before);
        }
    }

    /// The tips of a double pyramid have more neighbours than fit into a byte, its other vertices few.
    #[test]
    fn large_valences_are_set_back() {
        for count in [254u32, 255, 256, 700] {
            let positions = [Vec3::Z, -Vec3::Z].into_iter().chain((0..count).map(|k| {
                let angle = f64::from(k) / f64::from(count) * std::f64::consts::TAU;
                Vec3::new(libm::cos(angle) as f32, libm::sin(angle) as f32, 0.0)
            }));
            let sides = (0..count).map(|k| [k + 2, (k + 1) % count + 2]);
            let triangles = sides.flat_map(|[a, b]| [[0, a, b], [1, b, a]]).collect();
            let list = TriangleMesh { positions: positions.collect(), triangles, ..TriangleMesh::default() };
            let mut mesh = Mesh::from_triangles(&list).unwrap();
            let (before, connectivity) = (mesh.clone(), mesh.connectivity());
            mesh.flip(VertexId(0), VertexId(2)).unwrap();
            mesh.set_back(&connectivity, before.positions());
            mesh.set_versions(before.versions());
            assert_eq!(mesh, before);
        }
    }
}
