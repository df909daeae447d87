//! Topology changes of the dynamic mesh: cutting along a cycle of three edges and capping both sides (annular change),
//! and joining two discs by a tube (axial change).

use super::tube::shortest_tube;
use super::{EditError, Mesh, Ring, VertexId};
use crate::math::Vec3;

/// The two triangles that cap the surface after [`Mesh::cut`] along a cycle of three edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// The vertices of the cycle, in the order passed to [`Mesh::cut`]: the corners of the triangle that caps the
    /// surface to the left of the cycle.
    pub kept: [VertexId; 3],
    /// The copies of the vertices of the cycle, in the same order as `kept`: the corners of the triangle that caps the
    /// surface to the right of the cycle.
    pub copies: [VertexId; 3],
}

/// The two rims, cycles of new vertices, that [`Mesh::join`] connected by a tube.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TubeRims {
    /// The vertices of the rim around the first of the two joined vertices, in the order of that vertex's ring.
    pub first: Vec<VertexId>,
    /// The vertices of the rim around the second of the two joined vertices, in the order of that vertex's ring.
    pub second: Vec<VertexId>,
}

impl Mesh {
    /// Cuts the surface along the cycle of edges `u v`, `v o`, `o u` and caps both sides with a triangle (annular
    /// change; Lachaud & Montanvert, section 3.3, figure 5). χ increases by 2.
    ///
    /// The three vertices are kept on one side and copied on the other. The copies have the positions of their
    /// originals; the caller moves the two sides apart.
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`] if two of the vertices are not adjacent; [`EditError::IsTriangle`] if the cycle bounds
    /// a triangle of the surface; [`EditError::Full`] if no vertex ids are left.
    pub fn cut(&mut self, u: VertexId, v: VertexId, o: VertexId) -> Result<Cut, EditError> {
        for (a, b) in [(u, v), (v, o), (o, u)] {
            let opposite = self.opposite_vertices(a, b)?;
            if [u, v, o].contains(&opposite.left) || [u, v, o].contains(&opposite.right) {
                return Err(EditError::IsTriangle);
            }
        }
        if !self.has_ids_for(3) {
            return Err(EditError::Full);
        }
        let kept = [u, v, o];
        let copies = kept.map(|w| {
            let copy = self.allocate(self.position(w));
            self.attributes.blend(copy, w, w, 0.0);
            copy
        });
        for k in 0..3 {
            self.split_ring(kept, copies, k);
        }
        self.half_edges += 6;
        self.euler += 2;
        self.topology_changed();
        Ok(Cut { kept, copies })
    }

    /// Splits the ring of vertex `k` of the cycle of a cut: the original keeps the half to the left of the cycle, the
    /// copy gets the right half.
    fn split_ring(&mut self, kept: [VertexId; 3], copies: [VertexId; 3], k: usize) {
        let (next, previous) = ((k + 1) % 3, (k + 2) % 3);
        let ring = self.ring(kept[k]);
        let left = ring.between(kept[next], kept[previous]);
        let right = ring.between(kept[previous], kept[next]);
        for &w in &right {
            self.ring_mut(w).replace(kept[k], copies[k]);
        }
        let close = |from, inner: &[VertexId], to| {
            Ring::new(std::iter::once(from).chain(inner.iter().copied()).chain([to]))
        };
        *self.ring_mut(kept[k]) = close(kept[next], &left, kept[previous]);
        *self.ring_mut(copies[k]) = close(copies[previous], &right, copies[next]);
    }

    /// Replaces the discs around `u` and `v` by a tube between them (axial change; Lachaud & Montanvert, section 3.3,
    /// figure 4). χ decreases by 2.
    ///
    /// The rims of the tube are new vertices on the edges around `u` and `v`, at the fraction `reach` of each edge from
    /// `u` or `v` (0 < reach < 1). As they are new, the result is simplicial even if `u` and `v` have common
    /// neighbours.
    ///
    /// # Errors
    /// [`EditError::Adjacent`] if `u` and `v` are adjacent or the same; [`EditError::NotAnEdge`] if either is not live;
    /// [`EditError::Full`] if no vertex ids are left.
    pub fn join(&mut self, u: VertexId, v: VertexId, reach: f32) -> Result<TubeRims, EditError> {
        for w in [u, v] {
            if !self.is_live(w) {
                return Err(EditError::NotAnEdge(u, v));
            }
        }
        if u == v || self.ring(u).contains(v) {
            return Err(EditError::Adjacent(u, v));
        }
        let corners = self.ring(u).valence() + self.ring(v).valence();
        if !self.has_ids_for(corners) {
            return Err(EditError::Full);
        }
        let first = self.open_hole(u, reach);
        let second = self.open_hole(v, reach);
        self.connect_rims(&first, &second);
        self.half_edges += 6 * corners;
        self.euler -= 2;
        self.topology_changed();
        Ok(TubeRims { first, second })
    }

    /// Opens a hole around `centre`, for one end of a tube: inserts a rim of new vertices on the edges at `centre`,
    /// each at the fraction `reach` from it, deletes `centre`, and returns the rim in the order of the ring of
    /// `centre`.
    ///
    /// ```text
    ///   n1-----n0             n1-----n0
    ///     \    /                \ \ / \
    ///      \  /       ->        r1---r0       rim vertex ri is joined to ni and n(i+1)
    ///     centre                  hole
    /// ```
    fn open_hole(&mut self, centre: VertexId, reach: f32) -> Vec<VertexId> {
        let spokes: Vec<VertexId> = self.ring(centre).as_slice().to_vec();
        let from = self.position(centre);
        let rim: Vec<VertexId> = spokes.iter().map(|&w| self.rim_vertex(centre, from, w, reach)).collect();
        let n = rim.len();
        for i in 0..n {
            let (next, previous) = ((i + 1) % n, (i + n - 1) % n);
            self.ring_mut(spokes[i]).splice(centre, &[rim[i], rim[previous]]);
            *self.ring_mut(rim[i]) = Ring::new([spokes[i], spokes[next], rim[next], rim[previous]]);
        }
        self.release(centre);
        rim
    }

    fn rim_vertex(&mut self, centre: VertexId, from: Vec3, w: VertexId, reach: f32) -> VertexId {
        let point = self.allocate(from + (self.position(w) - from) * reach);
        self.attributes.blend(point, centre, w, reach);
        point
    }

    /// Connects the rims of two holes by the tube of least total squared edge length.
    fn connect_rims(&mut self, first: &[VertexId], second: &[VertexId]) {
        let at = |rim: &[VertexId]| rim.iter().map(|&w| self.position(w)).collect::<Vec<_>>();
        let tube = shortest_tube(&at(first), &at(second));
        for i in 0..first.len() {
            // `connected_to_first` yields decreasing j; each is inserted right after `next`, which reverses them into
            // ring order.
            let met: Vec<VertexId> = tube.connected_to_first(i).map(|j| second[j]).collect();
            for &s in &met {
                let next = first[(i + 1) % first.len()];
                self.ring_mut(first[i]).insert_after(next, s);
            }
        }
        for j in 0..second.len() {
            let met: Vec<VertexId> = tube.connected_to_second(j).map(|i| first[i]).collect();
            for &r in met.iter().rev() {
                let next = second[(j + 1) % second.len()];
                self.ring_mut(second[j]).insert_after(next, r);
            }
        }
    }
}
