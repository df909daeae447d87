//! √3 subdivision of a whole mesh.

use super::{Mesh, MeshError, Ring, VertexId};
use crate::math::make_room;

impl Mesh {
    /// Subdivides all triangles: inserts a vertex at the centroid of each and replaces each old edge by the edge
    /// between the new vertices on its two sides (√3 subdivision; Lachaud & Montanvert, section 3.4, figure 6). Old
    /// vertices do not move. Edge lengths are divided by about √3, and the number of vertices is about tripled.
    ///
    /// # Errors
    /// [`MeshError::TooManyVertices`] if the result would have more than [`MAX_VERTICES`](super::MAX_VERTICES).
    pub fn refine(&mut self) -> Result<(), MeshError> {
        self.check_room(self.triangle_count())?;
        let old = self.slots();
        // New vertices are appended, so that the old rings stay readable while the new ones are built.
        let before = std::mem::take(&mut self.rings);
        let mut points = FacePoints::new(&before);
        let mut rings = vec![Ring::default(); old];
        for (u, ring) in before.iter().enumerate() {
            let u = VertexId::from_index(u);
            rings[u.index()] = Ring::new(ring.pairs().map(|(a, b)| points.id(&before, [u, a, b])));
        }
        self.place_face_points(&points.corners);
        make_room(&mut rings, self.positions.len());
        for (k, &[a, b, c]) in points.corners.iter().enumerate() {
            let beyond = |from: VertexId, to: VertexId| points.across(&before, from, to);
            debug_assert_eq!(rings.len(), old + k, "face points are numbered in order");
            rings.push(Ring::new([a, beyond(a, b), b, beyond(b, c), c, beyond(c, a)]));
        }
        self.rings = rings;
        self.half_edges *= 3;
        self.topology_changed();
        Ok(())
    }

    fn place_face_points(&mut self, corners: &[[VertexId; 3]]) {
        let slots = self.positions.len() + corners.len();
        make_room(&mut self.positions, slots);
        self.attributes.grow(slots);
        for &[a, b, c] in corners {
            let centre = (self.position(a) + self.position(b) + self.position(c)) * (1.0 / 3.0);
            self.positions.push(centre);
            let point = VertexId::from_index(self.positions.len() - 1);
            self.attributes.blend(point, a, b, 0.5);
            self.attributes.blend(point, point, c, 1.0 / 3.0);
        }
    }
}

/// The face point of each triangle, its new vertex in [`Mesh::refine`], looked up by half-edge.
struct FacePoints {
    /// For each vertex slot, where the face points around it start in `ids`.
    starts: Vec<usize>,
    /// For each vertex slot, the ids of the face points of the triangles around it, in the order of [`Ring::pairs`].
    ids: Vec<VertexId>,
    /// The corners of each triangle, in the order of the ids of their face points.
    corners: Vec<[VertexId; 3]>,
}

impl FacePoints {
    fn new(rings: &[Ring]) -> Self {
        let mut starts = Vec::with_capacity(rings.len());
        let mut total = 0;
        for ring in rings {
            starts.push(total);
            total += ring.valence();
        }
        let unset = VertexId(u32::MAX);
        let mut points = Self { starts, ids: vec![unset; total], corners: Vec::with_capacity(total / 3) };
        for (u, ring) in rings.iter().enumerate() {
            let u = VertexId::from_index(u);
            for (a, b) in ring.pairs().filter(|&(a, b)| u < a && u < b) {
                let point = VertexId::from_index(rings.len() + points.corners.len());
                points.corners.push([u, a, b]);
                for [p, q] in [[u, a], [a, b], [b, u]] {
                    points.set(rings, p, q, point);
                }
            }
        }
        points
    }

    /// Sets the face point of the triangle to the left of the half-edge from `p` to `q`.
    fn set(&mut self, rings: &[Ring], p: VertexId, q: VertexId, point: VertexId) {
        if let Some(at) = rings[p.index()].position(q) {
            self.ids[self.starts[p.index()] + at] = point;
        }
    }

    fn left_of(&self, rings: &[Ring], p: VertexId, q: VertexId) -> VertexId {
        rings[p.index()].position(q).map_or(VertexId(u32::MAX), |at| self.ids[self.starts[p.index()] + at])
    }

    fn id(&mut self, rings: &[Ring], [u, a, _]: [VertexId; 3]) -> VertexId {
        self.left_of(rings, u, a)
    }

    /// Returns the face point of the triangle to the right of the half-edge from `from` to `to`.
    fn across(&self, rings: &[Ring], from: VertexId, to: VertexId) -> VertexId {
        self.left_of(rings, to, from)
    }
}
