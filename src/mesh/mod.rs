//! The dynamic mesh: closed, oriented, 2-manifold, edited in place.
//!
//! A vertex holds its position and the oriented ring of its neighbours (Lachaud & Montanvert, section 3.1); edges and
//! triangles are read off the rings and exist nowhere else. An edit checks first and changes after: an error means
//! the mesh is as it was.
//!
//! # Invariants
//! Every live vertex `u` has at least three neighbours, none of them twice, and for each consecutive pair `a`, `b` of
//! its ring, `b` is followed by `u` in the ring of `a`, and `u` by `a` in the ring of `b`. So the triangle `(u, a, b)`
//! is seen the same by its three corners, every edge has two triangles of opposite direction, and the link of every
//! vertex is one cycle. [`Mesh::check`] tests all of it.

mod attributes;
mod build;
mod check;
mod compact;
mod components;
mod crossing;
mod curvature;
mod edge_table;
mod edits;
mod error;
mod geodesic;
mod groups;
mod ids;
mod journal;
mod measure;
mod parts;
mod refine;
mod report;
mod ring;
#[cfg(test)]
pub(crate) mod shapes;
mod surgery;
mod texture;
mod triangles;
mod tube;
mod weld;

pub use attributes::{ScalarKey, VectorKey};
pub use check::Flaw;
pub use crossing::{Facet, count_crossings, crossing_pairs, facets_cross};
pub use curvature::{Curvature, curvature};
pub use edits::Opposite;
pub use error::{EditError, MeshError};
pub use geodesic::geodesic;
pub(crate) use groups::Groups;
pub use ids::VertexId;
pub use journal::Triangles;
pub use measure::{Measures, measure};
pub use report::{MeshReport, report};
pub use ring::Ring;
pub use surgery::{Cut, Joint};
pub use texture::{ImageKind, Texture};
pub use triangles::TriangleMesh;

use crate::math::Vec3;
use attributes::Attributes;
use journal::Journal;
use serde::{Deserialize, Serialize};

/// A closed oriented triangle mesh with dynamic connectivity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    rings: Vec<Ring>,
    positions: Vec<Vec3>,
    attributes: Attributes,
    free: Vec<VertexId>,
    half_edges: usize,
    euler: i64,
    #[serde(skip)]
    journal: Journal,
    #[serde(skip)]
    topology_version: u32,
    #[serde(skip)]
    geometry_version: u32,
}

impl Mesh {
    /// The number of vertices.
    #[inline]
    pub fn vertex_count(&self) -> usize {
        self.rings.len() - self.free.len()
    }

    /// The number of triangles.
    #[inline]
    pub fn triangle_count(&self) -> usize {
        self.half_edges / 3
    }

    /// The number of edges.
    #[inline]
    pub fn edge_count(&self) -> usize {
        self.half_edges / 2
    }

    /// The number of vertex slots, free ones included: the length of per-vertex arrays.
    #[inline]
    pub fn slots(&self) -> usize {
        self.rings.len()
    }

    /// χ = V − E + F as the edits predict it; [`Mesh::check`] compares it with a count.
    #[inline]
    pub fn euler(&self) -> i64 {
        self.euler
    }

    /// Counts up when connectivity changes.
    #[inline]
    pub fn topology_version(&self) -> u32 {
        self.topology_version
    }

    /// Counts up when any vertex moves.
    #[inline]
    pub fn geometry_version(&self) -> u32 {
        self.geometry_version
    }

    /// Takes versions above those of a mesh that this one replaces, so that nobody takes it for the old one.
    pub fn count_on_from(&mut self, replaced: &Self) {
        self.topology_version = replaced.topology_version.wrapping_add(1);
        self.geometry_version = replaced.geometry_version.wrapping_add(1);
    }

    /// Whether `v` names a vertex now.
    #[inline]
    pub fn is_live(&self, v: VertexId) -> bool {
        self.rings.get(v.index()).is_some_and(|ring| !ring.is_empty())
    }

    /// The live vertices in the order of their slots.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + Clone + '_ {
        let live = |(i, ring): (usize, &Ring)| (!ring.is_empty()).then(|| VertexId::from_index(i));
        self.rings.iter().enumerate().filter_map(live)
    }

    /// Every triangle once, by the corner with the lowest id.
    pub fn triangles(&self) -> impl Iterator<Item = [VertexId; 3]> + '_ {
        self.vertices().flat_map(|u| {
            self.ring(u).pairs().filter(move |&(a, b)| u < a && u < b).map(move |(a, b)| [u, a, b])
        })
    }

    /// The triangle with these corners, as it is now.
    #[inline]
    pub fn facet(&self, corners: [VertexId; 3]) -> Facet {
        Facet { corners: corners.map(|v| v.0), points: corners.map(|v| self.position(v)) }
    }

    /// Every edge once, from the lower id to the higher.
    pub fn edges(&self) -> impl Iterator<Item = (VertexId, VertexId)> + '_ {
        self.edges_from(self.vertices())
    }

    /// The edges that have one of `vertices` as their lower end, from the lower id to the higher.
    pub fn edges_from<'a>(
        &'a self,
        vertices: impl Iterator<Item = VertexId> + 'a,
    ) -> impl Iterator<Item = (VertexId, VertexId)> + 'a {
        vertices.flat_map(|u| self.ring(u).as_slice().iter().filter(move |&&v| u < v).map(move |&v| (u, v)))
    }

    /// The oriented neighbours of `v`; empty where `v` is not live.
    #[inline]
    pub fn ring(&self, v: VertexId) -> &Ring {
        &self.rings[v.index()]
    }

    /// All rings by slot, for loops over the whole mesh.
    #[inline]
    pub fn rings(&self) -> &[Ring] {
        &self.rings
    }

    /// Where `v` is.
    #[inline]
    pub fn position(&self, v: VertexId) -> Vec3 {
        self.positions[v.index()]
    }

    /// All positions by slot; those of free slots mean nothing.
    #[inline]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// All positions by slot, to be moved.
    #[inline]
    pub fn positions_mut(&mut self) -> &mut [Vec3] {
        self.geometry_version = self.geometry_version.wrapping_add(1);
        &mut self.positions
    }

    /// Puts `v` at `position`.
    #[inline]
    pub fn set_position(&mut self, v: VertexId, position: Vec3) {
        self.touch(v);
        self.geometry_version = self.geometry_version.wrapping_add(1);
        self.positions[v.index()] = position;
    }

    /// Adds a vector per vertex, zero at first, which follows every edit from now on.
    pub fn add_vector(&mut self) -> VectorKey {
        self.attributes.add_vector(self.slots())
    }

    /// Adds a number per vertex, zero at first, which follows every edit from now on.
    pub fn add_scalar(&mut self) -> ScalarKey {
        self.attributes.add_scalar(self.slots())
    }

    /// How many vector and scalar attributes a vertex has.
    pub fn attribute_counts(&self) -> [usize; 2] {
        self.attributes.counts()
    }

    /// A vector attribute by slot.
    #[inline]
    pub fn vector(&self, key: VectorKey) -> &[Vec3] {
        self.attributes.vector(key)
    }

    /// A vector attribute by slot, to be written.
    #[inline]
    pub fn vector_mut(&mut self, key: VectorKey) -> &mut [Vec3] {
        self.attributes.vector_mut(key)
    }

    /// A scalar attribute by slot.
    #[inline]
    pub fn scalar(&self, key: ScalarKey) -> &[f32] {
        self.attributes.scalar(key)
    }

    /// A scalar attribute by slot, to be written.
    #[inline]
    pub fn scalar_mut(&mut self, key: ScalarKey) -> &mut [f32] {
        self.attributes.scalar_mut(key)
    }

    /// The positions, and a vector attribute to be written with them.
    pub fn positions_and_vector_mut(&mut self, key: VectorKey) -> (&[Vec3], &mut [Vec3]) {
        (&self.positions, self.attributes.vector_mut(key))
    }

    /// A vector and a scalar attribute to be written together.
    pub fn vector_and_scalar_mut(
        &mut self,
        vector: VectorKey,
        scalar: ScalarKey,
    ) -> (&mut [Vec3], &mut [f32]) {
        self.attributes.vector_and_scalar_mut(vector, scalar)
    }

    /// The rings, and a scalar attribute to be written with them.
    pub fn rings_and_scalar_mut(&mut self, key: ScalarKey) -> (&[Ring], &mut [f32]) {
        (&self.rings, self.attributes.scalar_mut(key))
    }

    /// The sum of the cross products of the triangles around `v`: twice their area, along the outward normal.
    #[inline]
    pub fn area_normal(&self, v: VertexId) -> Vec3 {
        let ring = self.ring(v).as_slice();
        let Some(&last) = ring.last() else { return Vec3::ZERO };
        let centre = self.position(v);
        let mut previous = self.position(last) - centre;
        let mut sum = Vec3::ZERO;
        for &w in ring {
            let spoke = self.position(w) - centre;
            sum += previous.cross(spoke);
            previous = spoke;
        }
        sum
    }

    /// Neighbours of both `u` and `v`, in the order of the ring of `u`.
    pub fn common_neighbours(&self, u: VertexId, v: VertexId) -> smallvec::SmallVec<[VertexId; 4]> {
        let other = self.ring(v);
        self.ring(u).as_slice().iter().copied().filter(|&w| other.contains(w)).collect()
    }

    /// Takes a free slot, or makes one; the ring is set by the caller.
    fn allocate(&mut self, position: Vec3) -> VertexId {
        self.geometry_version = self.geometry_version.wrapping_add(1);
        if let Some(v) = self.free.pop() {
            self.slot_taken(v);
            self.positions[v.index()] = position;
            return v;
        }
        self.rings.push(Ring::default());
        self.positions.push(position);
        self.attributes.grow();
        VertexId::from_index(self.rings.len() - 1)
    }

    fn has_room_for(&self, vertices: usize) -> bool {
        self.slots().saturating_add(vertices) < u32::MAX as usize
    }

    fn release(&mut self, v: VertexId) {
        *self.ring_mut(v) = Ring::default();
        self.free.push(v);
        self.slot_freed();
    }

    fn topology_changed(&mut self) {
        self.topology_version = self.topology_version.wrapping_add(1);
        self.geometry_version = self.geometry_version.wrapping_add(1);
    }
}
