//! Construction of meshes from triangle lists and simple shapes, and conversion back to triangle lists.

use super::attributes::Attributes;
use super::{MAX_VERTICES, Mesh, MeshError, Ring, TriangleMesh, VertexId};
use crate::math::Vec3;
use crate::math::order::sort_by_rank;

/// The largest valence accepted by [`Mesh::from_triangles`]; rings are searched linearly, so that edits around a vertex
/// of larger valence would be slow.
const LARGEST_VALENCE: usize = 4096;

/// The largest number of links around a vertex that are not sorted to find one.
const SEARCHED_LINEARLY: usize = 32;

impl Mesh {
    /// Creates a dynamic mesh from the positions and triangles of a closed, oriented, manifold triangle list. Unused
    /// positions are dropped.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] for an invalid index, a position that is not finite or an empty list;
    /// [`MeshError::NotClosed`] for a boundary, an edge with more than two triangles, inconsistent orientation, a
    /// triangle with two equal corners, surfaces that touch at a vertex, or a vertex with fewer than 3 or more than
    /// 4096 triangles.
    pub fn from_triangles(mesh: &TriangleMesh) -> Result<Self, MeshError> {
        check_indices(mesh)?;
        let links = mesh.opposite_edges();
        let mut rings = Vec::with_capacity(mesh.positions.len());
        let mut new_ids = vec![VertexId(u32::MAX); mesh.positions.len()];
        let mut positions = Vec::with_capacity(mesh.positions.len());
        for (v, &position) in mesh.positions.iter().enumerate() {
            if !links.of(v).is_empty() {
                new_ids[v] = VertexId::from_index(rings.len());
                rings.push(ring_from_links(v, links.of(v))?);
                positions.push(position);
            }
        }
        rings.iter_mut().for_each(|ring| ring.renumber(|v| new_ids[v.index()]));
        Ok(Self { origin: mesh.origin, ..Self::from_rings(rings, positions) })
    }

    fn from_rings(rings: Vec<Ring>, positions: Vec<Vec3>) -> Self {
        let half_edges: usize = rings.iter().map(Ring::valence).sum();
        let euler = rings.len() as i64 - half_edges as i64 / 2 + half_edges as i64 / 3;
        Self { rings, positions, half_edges, euler, attributes: Attributes::default(), ..Self::default() }
    }

    /// Creates the mesh of an icosahedron with all vertices at distance `radius` from `center`; triangles are
    /// counter-clockwise seen from outside.
    pub fn icosahedron(center: Vec3, radius: f32) -> Self {
        let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
        let scale = radius / (1.0 + golden * golden).sqrt();
        let corner = |p: &[f32; 3]| {
            let unit = p.map(|c| if c.abs() > 1.0 { golden.copysign(c) } else { c });
            center + Vec3::from(unit) * scale
        };
        let positions = ICOSAHEDRON_CORNERS.iter().map(corner).collect();
        let rings = ICOSAHEDRON_RINGS.iter().map(|ring| Ring::new(ring.iter().map(|&v| VertexId(v))));
        Self::from_rings(rings.collect(), positions)
    }

    /// Creates a sphere by √3 subdivision of an icosahedron until no edge is longer than `max_edge`; all vertices are
    /// at distance `radius` from `center`.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] unless the centre is finite and radius and edge are positive and finite;
    /// [`MeshError::TooManyVertices`] if more than [`MAX_VERTICES`] would be needed.
    pub fn icosphere(center: Vec3, radius: f32, max_edge: f32) -> Result<Self, MeshError> {
        positive("radius", radius)?;
        positive("maxEdge", max_edge)?;
        if !center.is_finite() {
            let problem = format!("must be finite, got ({}, {}, {})", center.x, center.y, center.z);
            return Err(MeshError::InvalidArgument { parameter: "center", problem });
        }
        let mut mesh = Self::icosahedron(Vec3::ZERO, 1.0);
        let limit = max_edge / radius;
        let square = f64::from(limit) * f64::from(limit);
        // Saturates beyond the range.
        let least = (SPHERE_VERTICES / square) as u64;
        if least > MAX_VERTICES as u64 {
            return Err(MeshError::TooManyVertices { vertices: least });
        }
        while mesh.longest_edge() > limit {
            mesh.refine()?;
            mesh.positions.iter_mut().for_each(|p| *p = p.normalize_or(Vec3::X));
        }
        mesh.positions.iter_mut().for_each(|p| *p = center + *p * radius);
        Ok(mesh)
    }

    /// Returns the length of the longest edge, 0 for the empty mesh.
    pub fn longest_edge(&self) -> f32 {
        let square = |(u, v)| self.position(u).distance_squared(self.position(v));
        self.edges().map(square).fold(0.0, |longest, d| if d > longest { d } else { longest }).sqrt()
    }

    /// Converts the mesh to a triangle list with area-weighted unit normals, vertices in slot order.
    pub fn to_triangles(&self) -> TriangleMesh {
        let mut new_ids = vec![u32::MAX; self.slots()];
        let mut positions = Vec::with_capacity(self.vertex_count());
        let mut normals = Vec::with_capacity(self.vertex_count());
        for v in self.vertices() {
            new_ids[v.index()] = positions.len() as u32;
            positions.push(self.position(v));
            normals.push(self.unit_normal(v));
        }
        let triangles = self.triangles().map(|corners| corners.map(|v| new_ids[v.index()])).collect();
        let origin = self.origin;
        TriangleMesh { positions, origin, triangles, normals: Some(normals), ..TriangleMesh::default() }
    }

    /// Adds a copy of `other`, which must not touch this mesh, as further connected components, and returns the ids of
    /// the added vertices in the slot order of `other`. `other` must have no attributes; those of the added vertices
    /// are unspecified, and the caller sets them.
    ///
    /// # Errors
    /// [`MeshError::TooManyVertices`] if both have more than [`MAX_VERTICES`] together.
    pub fn append(&mut self, other: &Self) -> Result<Vec<VertexId>, MeshError> {
        self.check_room(other.vertex_count())?;
        let mut new_ids = vec![NO_ID; other.slots()];
        for v in other.vertices() {
            new_ids[v.index()] = self.allocate(other.position(v));
            self.rings[new_ids[v.index()].index()] = other.ring(v).clone();
        }
        for v in other.vertices() {
            self.rings[new_ids[v.index()].index()].renumber(|w| new_ids[w.index()]);
        }
        self.half_edges += other.half_edges;
        self.euler += other.euler;
        self.topology_changed();
        new_ids.retain(|&v| v != NO_ID);
        Ok(new_ids)
    }
}

/// Placeholder in [`Mesh::append`] for the new id of a free slot, as only live vertices are copied.
const NO_ID: VertexId = VertexId(u32::MAX);

/// The number of vertices of a sphere of radius 1 with equilateral triangles, times their squared edge length: 8 π / √3.
const SPHERE_VERTICES: f64 = 14.51;

fn positive(parameter: &'static str, value: f32) -> Result<(), MeshError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(MeshError::InvalidArgument {
        parameter,
        problem: format!("must be positive and finite, got {value}"),
    })
}

fn check_indices(mesh: &TriangleMesh) -> Result<(), MeshError> {
    let fail = |parameter, problem| Err(MeshError::InvalidArgument { parameter, problem });
    if mesh.triangles.is_empty() {
        return fail("indices", "no triangles; a closed surface needs at least four".into());
    }
    let count = mesh.positions.len();
    if let Some(&bad) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= count) {
        return fail("indices", format!("index {bad} is out of range; there are {count} positions"));
    }
    if let Some(bad) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return fail("positions", format!("position {bad} must be finite"));
    }
    Ok(())
}

/// Orders the links of vertex `v`, the edges opposite it in its triangles, into its one-ring, or reports why they are
/// not a single cycle of 3 to [`LARGEST_VALENCE`] edges.
pub(super) fn ring_from_links(v: usize, links: &[[u32; 2]]) -> Result<Ring, MeshError> {
    let fail = |what: &str| Err(MeshError::NotClosed { problem: format!("{what} at vertex {v}") });
    if links.len() > LARGEST_VALENCE {
        return fail(&format!("more than {LARGEST_VALENCE} triangles meet"));
    }
    if links.iter().any(|&[a, b]| a == b || a as usize == v || b as usize == v) {
        return fail("a triangle has two equal corners");
    }
    let mut ring = Vec::with_capacity(links.len());
    let [first, mut here] = links[0];
    ring.push(VertexId(first));
    let mut sorted = Vec::new();
    if links.len() > SEARCHED_LINEARLY {
        sorted.extend_from_slice(links);
        // Of several links from a vertex, the first is found.
        sort_by_rank(&mut sorted, |&[a, _]| u64::from(a));
    }
    while here != first {
        // Round and round, but not through the first.
        if ring.len() > links.len() {
            return fail("an edge with more than two triangles, or inconsistent orientation,");
        }
        ring.push(VertexId(here));
        let link = if sorted.is_empty() {
            links.iter().find(|&&[a, _]| a == here)
        } else {
            sorted.get(sorted.partition_point(|&[a, _]| a < here)).filter(|&&[a, _]| a == here)
        };
        match link {
            Some(&[_, next]) => here = next,
            None => return fail("a boundary, or inconsistent orientation,"),
        }
    }
    if ring.len() != links.len() {
        return fail("non-manifold vertex or duplicate triangles");
    }
    if ring.len() < 3 {
        return fail("fewer than three triangles meet");
    }
    Ok(Ring::new(ring))
}

/// The vertices of an icosahedron around the origin, before scaling; ±2 stands for ± the golden ratio.
const ICOSAHEDRON_CORNERS: [[f32; 3]; 12] = [
    [-1.0, 2.0, 0.0],
    [1.0, 2.0, 0.0],
    [-1.0, -2.0, 0.0],
    [1.0, -2.0, 0.0],
    [0.0, -1.0, 2.0],
    [0.0, 1.0, 2.0],
    [0.0, -1.0, -2.0],
    [0.0, 1.0, -2.0],
    [2.0, 0.0, -1.0],
    [2.0, 0.0, 1.0],
    [-2.0, 0.0, -1.0],
    [-2.0, 0.0, 1.0],
];

/// The one-rings of the vertices of an icosahedron, by vertex index, counter-clockwise seen from outside.
const ICOSAHEDRON_RINGS: [[u32; 5]; 12] = [
    [11, 5, 1, 7, 10],
    [5, 9, 8, 7, 0],
    [11, 10, 6, 3, 4],
    [9, 4, 2, 6, 8],
    [5, 11, 2, 3, 9],
    [11, 4, 9, 1, 0],
    [10, 7, 8, 3, 2],
    [1, 8, 6, 10, 0],
    [1, 9, 3, 6, 7],
    [5, 4, 3, 8, 1],
    [0, 7, 6, 2, 11],
    [0, 10, 2, 4, 5],
];
