//! A closed, oriented, 2-manifold triangle mesh that is edited in place, and triangle lists without these guarantees.
//!
//! Each vertex of [`Mesh`] stores its position and its oriented one-ring (Lachaud & Montanvert, section 3.1). Edges and
//! triangles are not stored; they are derived from the one-rings. An edit validates its preconditions before it changes
//! anything, so the mesh is unmodified when it returns an error.
//!
//! # Invariants
//! Every live vertex `u` has at least three distinct neighbours. For consecutive neighbours `a`, `b` of `u`, `b` is
//! followed by `u` in the ring of `a`, and `u` by `a` in the ring of `b`. So the rings of its three corners agree on
//! the triangle `(u, a, b)`, every edge has two triangles of opposite direction, and the link of every vertex is one
//! cycle. [`Mesh::check`] tests these invariants.

mod attributes;
mod build;
mod check;
mod closed;
mod component_volumes;
mod components;
mod connectivity;
mod curvature;
mod disjoint_sets;
mod edge_table;
mod edits;
mod error;
mod geodesic;
mod ids;
mod journal;
mod measure;
mod origin;
mod patch;
mod refine;
mod renumber;
mod report;
mod ring;
mod self_intersections;
#[cfg(test)]
pub(crate) mod shapes;
mod size;
mod surgery;
mod texture;
mod transform;
mod triangles;
mod tube;
mod weld;

pub use attributes::{ScalarKey, VectorKey};
pub use check::InvariantViolation;
pub use connectivity::Connectivity;
pub use curvature::{Curvature, curvature};
pub(crate) use disjoint_sets::DisjointSets;
pub use edits::OppositeVertices;
pub use error::{EditError, MeshError};
pub use geodesic::{geodesic_distances, geodesic_distances_from};
pub use ids::VertexId;
pub(crate) use ids::sort_distinct;
pub use journal::TriangleCorners;
pub(crate) use measure::enclosed_volume;
pub use measure::{Measures, measure};
pub use origin::{WorldPositions, grid_origin, world_origin};
pub use patch::{Patch, PatchCorner};
pub use report::{MeshReport, report, report_in_slices};
pub use ring::Ring;
pub(crate) use self_intersections::{
    CountInTime, count_in_time, count_self_intersections_in_slices, intersect_anywhere, intersecting_parts,
};
pub use self_intersections::{Facet, count_self_intersections, facets_intersect, intersecting_pairs};
pub use size::MAX_VERTICES;
pub use surgery::{Cut, TubeRims};
pub use texture::{ImageKind, Texture};
pub use transform::invertible_map;
pub use triangles::TriangleMesh;

use crate::math::{DVec3, Vec3, make_room};
use attributes::Attributes;
use journal::Journal;
use serde::{Deserialize, Serialize};

/// A closed, oriented triangle mesh with dynamic connectivity, stored as one oriented one-ring per vertex.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    rings: Vec<Ring>,
    positions: Vec<Vec3>,
    attributes: Attributes,
    free: Vec<VertexId>,
    half_edges: usize,
    euler: i64,
    #[serde(skip)]
    origin: DVec3,
    #[serde(skip)]
    journal: Journal,
    #[serde(skip)]
    topology_version: u32,
    #[serde(skip)]
    geometry_version: u32,
}

impl Mesh {
    /// Returns the number of live vertices, which have not been deleted.
    #[inline]
    pub fn vertex_count(&self) -> usize {
        self.rings.len() - self.free.len()
    }

    /// Returns the number of triangles.
    #[inline]
    pub fn triangle_count(&self) -> usize {
        self.half_edges / 3
    }

    /// Returns the number of undirected edges.
    #[inline]
    pub fn edge_count(&self) -> usize {
        self.half_edges / 2
    }

    /// Returns the number of vertex slots, including free ones; this is the length of per-vertex arrays.
    #[inline]
    pub fn slots(&self) -> usize {
        self.rings.len()
    }

    /// Returns the number of slots that the memory of the mesh suffices for; other lists by slot that have as much grow no
    /// sooner than the mesh.
    #[inline]
    pub fn room(&self) -> usize {
        self.rings.capacity()
    }

    /// Returns the Euler characteristic χ = V − E + F, updated incrementally by edits; [`Mesh::check`] compares it with
    /// a full count.
    #[inline]
    pub fn euler(&self) -> i64 {
        self.euler
    }

    /// Returns a counter that increases whenever connectivity changes, so that caches can be invalidated.
    #[inline]
    pub fn topology_version(&self) -> u32 {
        self.topology_version
    }

    /// Returns a counter that increases whenever positions or connectivity change, so that caches can be invalidated.
    #[inline]
    pub fn geometry_version(&self) -> u32 {
        self.geometry_version
    }

    /// Returns the origin of the mesh in world space: that of a vertex is its position plus this. See
    /// [`TriangleMesh::origin`]. Methods compute in spaces of their own, where it is 0; it is no part of a saved state.
    #[inline]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Sets the origin, which moves the mesh in world space; positions are unchanged.
    pub fn set_origin(&mut self, origin: DVec3) {
        self.origin = origin;
        self.geometry_version = self.geometry_version.wrapping_add(1);
    }

    /// Returns the numbers of vertices and triangles.
    pub fn counts(&self) -> [usize; 2] {
        [self.vertex_count(), self.triangle_count()]
    }

    /// Returns the topology version and the geometry version, by which caches tell whether they are out of date.
    pub fn versions(&self) -> [u32; 2] {
        [self.topology_version, self.geometry_version]
    }

    /// Sets the topology version and the geometry version, for a mesh that replaces a triangle list with these.
    pub fn set_versions(&mut self, [topology, geometry]: [u32; 2]) {
        (self.topology_version, self.geometry_version) = (topology, geometry);
    }

    /// Advances both version counters beyond those of `replaced`, the mesh that this one replaces, so that caches built
    /// for `replaced` are invalidated.
    pub fn advance_versions_past(&mut self, replaced: &Self) {
        self.topology_version = replaced.topology_version.wrapping_add(1);
        self.geometry_version = replaced.geometry_version.wrapping_add(1);
    }

    /// Returns whether `v` is a vertex of the mesh: its slot exists and is not free.
    #[inline]
    pub fn is_live(&self, v: VertexId) -> bool {
        self.rings.get(v.index()).is_some_and(|ring| !ring.is_empty())
    }

    /// Iterates over the live vertices in slot order.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + Clone + '_ {
        let live = |(i, ring): (usize, &Ring)| (!ring.is_empty()).then(|| VertexId::from_index(i));
        self.rings.iter().enumerate().filter_map(live)
    }

    /// Iterates over all triangles, each starting at its corner of lowest id.
    pub fn triangles(&self) -> impl Iterator<Item = [VertexId; 3]> + '_ {
        self.vertices().flat_map(|u| {
            self.ring(u).pairs().filter(move |&(a, b)| u < a && u < b).map(move |(a, b)| [u, a, b])
        })
    }

    /// Returns the triangle with the given corners as a [`Facet`], with their current positions, for intersection
    /// tests.
    #[inline]
    pub fn facet(&self, corners: [VertexId; 3]) -> Facet {
        Facet { corners: corners.map(|v| v.0), points: corners.map(|v| self.position(v)) }
    }

    /// Iterates over all edges, each once as (lower id, higher id).
    pub fn edges(&self) -> impl Iterator<Item = (VertexId, VertexId)> + '_ {
        self.edges_from(self.vertices())
    }

    /// Iterates over the edges whose end with the lower id is in `vertices`, each as (lower id, higher id).
    pub fn edges_from<'a>(
        &'a self,
        vertices: impl Iterator<Item = VertexId> + 'a,
    ) -> impl Iterator<Item = (VertexId, VertexId)> + 'a {
        vertices.flat_map(|u| self.ring(u).as_slice().iter().filter(move |&&v| u < v).map(move |&v| (u, v)))
    }

    /// Returns the oriented one-ring of `v`, empty if its slot is free.
    #[inline]
    pub fn ring(&self, v: VertexId) -> &Ring {
        &self.rings[v.index()]
    }

    /// Adds to `vertices` their neighbours; afterwards they are sorted by id, each once.
    pub fn add_neighbours(&self, vertices: &mut Vec<VertexId>) {
        for k in 0..vertices.len() {
            vertices.extend_from_slice(self.ring(vertices[k]).as_slice());
        }
        sort_distinct(vertices);
    }

    /// Returns the one-rings of all slots, indexed by slot, for loops over the whole mesh.
    #[inline]
    pub fn rings(&self) -> &[Ring] {
        &self.rings
    }

    /// Returns the position of `v`.
    #[inline]
    pub fn position(&self, v: VertexId) -> Vec3 {
        self.positions[v.index()]
    }

    /// Returns the positions of all slots, indexed by slot; those of free slots are unspecified.
    #[inline]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Returns the positions of all slots, indexed by slot, for modification. Changes are not recorded for
    /// [`Mesh::roll_back`].
    #[inline]
    pub fn positions_mut(&mut self) -> &mut [Vec3] {
        self.geometry_version = self.geometry_version.wrapping_add(1);
        &mut self.positions
    }

    /// Moves `v` to `position`; [`Mesh::roll_back`] undoes it if edits are being recorded.
    #[inline]
    pub fn set_position(&mut self, v: VertexId, position: Vec3) {
        self.touch(v);
        self.geometry_version = self.geometry_version.wrapping_add(1);
        self.positions[v.index()] = position;
    }

    /// Adds a vector attribute per vertex, initially zero and interpolated by later edits; returns its key.
    pub fn add_vector(&mut self) -> VectorKey {
        self.attributes.add_vector(self.slots())
    }

    /// Adds a scalar attribute per vertex, initially zero and interpolated by later edits; returns its key.
    pub fn add_scalar(&mut self) -> ScalarKey {
        self.attributes.add_scalar(self.slots())
    }

    /// Returns the numbers of vector and scalar attributes per vertex, to check that a restored mesh has the expected
    /// ones.
    pub fn attribute_counts(&self) -> [usize; 2] {
        self.attributes.counts()
    }

    /// Returns the values of a vector attribute, indexed by slot.
    #[inline]
    pub fn vector(&self, key: VectorKey) -> &[Vec3] {
        self.attributes.vector(key)
    }

    /// Returns the values of a vector attribute, indexed by slot, for modification.
    #[inline]
    pub fn vector_mut(&mut self, key: VectorKey) -> &mut [Vec3] {
        self.attributes.vector_mut(key)
    }

    /// Returns the values of a scalar attribute, indexed by slot.
    #[inline]
    pub fn scalar(&self, key: ScalarKey) -> &[f32] {
        self.attributes.scalar(key)
    }

    /// Returns the values of a scalar attribute, indexed by slot, for modification.
    #[inline]
    pub fn scalar_mut(&mut self, key: ScalarKey) -> &mut [f32] {
        self.attributes.scalar_mut(key)
    }

    /// Borrows the positions and, mutably, a vector attribute, both indexed by slot, so that one loop can read the
    /// former and write the latter.
    pub fn positions_and_vector_mut(&mut self, key: VectorKey) -> (&[Vec3], &mut [Vec3]) {
        (&self.positions, self.attributes.vector_mut(key))
    }

    /// Mutably borrows a vector and a scalar attribute at once, both indexed by slot, so that one loop can write both.
    pub fn vector_and_scalar_mut(
        &mut self,
        vector: VectorKey,
        scalar: ScalarKey,
    ) -> (&mut [Vec3], &mut [f32]) {
        self.attributes.vector_and_scalar_mut(vector, scalar)
    }

    /// Borrows the one-rings and, mutably, a scalar attribute, both indexed by slot, so that one loop can read the
    /// former and write the latter.
    pub fn rings_and_scalar_mut(&mut self, key: ScalarKey) -> (&[Ring], &mut [f32]) {
        (&self.rings, self.attributes.scalar_mut(key))
    }

    /// Returns the area-weighted outward normal at `v`, not normalised: the sum of the cross products of the triangles
    /// around `v`, twice their area vectors. Zero if the slot of `v` is free.
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

    /// Returns the area-weighted outward unit normal at `v`; zero if the triangles around it have no area in sum, or if
    /// its slot is free.
    #[inline]
    pub fn unit_normal(&self, v: VertexId) -> Vec3 {
        self.area_normal(v).normalize_or_zero()
    }

    /// Returns the unit normals of all vertices, see [`Self::unit_normal`], by slot.
    pub fn unit_normals(&self) -> Vec<Vec3> {
        (0..self.slots()).map(|slot| self.unit_normal(VertexId::from_index(slot))).collect()
    }

    /// Returns the vertices adjacent to both `u` and `v`, in the order of the ring of `u`.
    pub fn common_neighbours(&self, u: VertexId, v: VertexId) -> smallvec::SmallVec<[VertexId; 4]> {
        let other = self.ring(v);
        self.ring(u).as_slice().iter().copied().filter(|&w| other.contains(w)).collect()
    }

    /// Takes a free vertex slot, or appends one, sets its position, and returns its id; the caller must set its ring.
    fn allocate(&mut self, position: Vec3) -> VertexId {
        self.geometry_version = self.geometry_version.wrapping_add(1);
        if let Some(v) = self.free.pop() {
            self.slot_taken(v);
            self.positions[v.index()] = position;
            return v;
        }
        self.push_slot(position);
        VertexId::from_index(self.rings.len() - 1)
    }

    fn push_slot(&mut self, position: Vec3) {
        let slots = self.slots() + 1;
        make_room(&mut self.rings, slots);
        make_room(&mut self.positions, slots);
        self.rings.push(Ring::default());
        self.positions.push(position);
        self.attributes.grow(slots);
    }

    fn has_ids_for(&self, vertices: usize) -> bool {
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
