//! Eulerian edits of the dynamic mesh: split (creation), collapse (deletion) and flip (inversion) of an edge (Lachaud &
//! Montanvert, section 3.3), and removal of connected components.

use super::{EditError, Mesh, Ring, VertexId};
use crate::math::Vec3;

/// The two vertices opposite an edge: the third corners of its two triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OppositeVertices {
    /// The third corner of the triangle to the left of the edge in its given direction, seen from outside.
    pub left: VertexId,
    /// The third corner of the triangle to the right of the edge in its given direction, seen from outside.
    pub right: VertexId,
}

impl Mesh {
    /// Returns the third corners of the two triangles at the edge from `u` to `v`.
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`] if `u` and `v` are not adjacent.
    pub fn opposite_vertices(&self, u: VertexId, v: VertexId) -> Result<OppositeVertices, EditError> {
        let ring = self.rings.get(u.index()).ok_or(EditError::NotAnEdge(u, v))?;
        match (ring.after(v), ring.before(v)) {
            (Some(left), Some(right)) => Ok(OppositeVertices { left, right }),
            _ => Err(EditError::NotAnEdge(u, v)),
        }
    }

    /// Splits the edge `uv` by a new vertex at `position`, with the mean attributes of `u` and `v`, and returns the
    /// vertex (creation in Lachaud & Montanvert).
    ///
    /// ```text
    ///      a                a
    ///     / \             / | \
    ///    u---v    ->     u--w--v      a left, b right of u -> v
    ///     \ /             \ | /
    ///      b                b
    /// ```
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`] if `u` and `v` are not adjacent; [`EditError::Full`] if no vertex ids are left.
    pub fn split(&mut self, u: VertexId, v: VertexId, position: Vec3) -> Result<VertexId, EditError> {
        let OppositeVertices { left: a, right: b } = self.opposite_vertices(u, v)?;
        if !self.has_ids_for(1) {
            return Err(EditError::Full);
        }
        let w = self.allocate(position);
        self.attributes.blend(w, u, v, 0.5);
        *self.ring_mut(w) = Ring::new([v, a, u, b]);
        self.ring_mut(u).replace(v, w);
        self.ring_mut(v).replace(u, w);
        self.ring_mut(a).insert_after(u, w);
        self.ring_mut(b).insert_after(v, w);
        self.half_edges += 6;
        self.topology_changed();
        Ok(w)
    }

    /// Flips the edge `uv`: replaces it by the edge between its two opposite vertices (inversion in Lachaud &
    /// Montanvert).
    ///
    /// ```text
    ///      a              a
    ///     / \            /|\
    ///    u---v    ->    u | v
    ///     \ /            \|/
    ///      b              b
    /// ```
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`] if `u` and `v` are not adjacent; [`EditError::Adjacent`] if the new edge exists
    /// already; [`EditError::ValenceTooLow`] if `u` or `v` has three neighbours only.
    pub fn flip(&mut self, u: VertexId, v: VertexId) -> Result<(), EditError> {
        let OppositeVertices { left: a, right: b } = self.opposite_vertices(u, v)?;
        if self.ring(a).contains(b) {
            return Err(EditError::Adjacent(a, b));
        }
        for end in [u, v] {
            if self.ring(end).valence() <= 3 {
                return Err(EditError::ValenceTooLow(end));
            }
        }
        self.ring_mut(u).remove(v);
        self.ring_mut(v).remove(u);
        self.ring_mut(a).insert_after(u, b);
        self.ring_mut(b).insert_after(v, a);
        self.topology_changed();
        Ok(())
    }

    /// Tests whether [`Mesh::collapse`] of the edge `uv` is possible, by the link condition and the valences of the
    /// opposite vertices, and returns the two vertices opposite the edge if it is.
    ///
    /// # Errors
    /// As [`Mesh::collapse`].
    pub fn can_collapse(&self, u: VertexId, v: VertexId) -> Result<OppositeVertices, EditError> {
        let opposite = self.opposite_vertices(u, v)?;
        let common = self.common_neighbours(u, v);
        if let Some(&o) = common.iter().find(|&&w| w != opposite.left && w != opposite.right) {
            return Err(EditError::LinkCondition(o));
        }
        for end in [opposite.left, opposite.right] {
            if self.ring(end).valence() <= 3 {
                return Err(EditError::ValenceTooLow(end));
            }
        }
        Ok(opposite)
    }

    /// Collapses the edge `uv`: deletes `v` and moves `u` to `position`, with the mean attributes of both (deletion in
    /// Lachaud & Montanvert).
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`] if `u` and `v` are not adjacent; [`EditError::LinkCondition`] if `u` and `v` have more
    /// than two common neighbours; [`EditError::ValenceTooLow`] if a vertex opposite the edge has three neighbours
    /// only, as on a tetrahedron.
    pub fn collapse(&mut self, u: VertexId, v: VertexId, position: Vec3) -> Result<(), EditError> {
        let OppositeVertices { left: a, right: b } = self.can_collapse(u, v)?;
        self.touch(u);
        self.attributes.blend(u, u, v, 0.5);
        self.positions[u.index()] = position;
        // The ring of v is u, b, outer neighbours, a: the outer neighbours replace v between b and a in the ring of u.
        let outer = self.ring(v).between(b, a);
        for &w in &outer {
            self.ring_mut(w).replace(v, u);
        }
        self.ring_mut(u).splice(v, &outer);
        self.ring_mut(a).remove(v);
        self.ring_mut(b).remove(v);
        self.release(v);
        self.half_edges -= 6;
        self.topology_changed();
        Ok(())
    }

    /// Returns whether `v` is a corner of an isolated tetrahedron, a connected component of four vertices.
    pub fn is_tetrahedron(&self, v: VertexId) -> bool {
        let ring = self.ring(v).as_slice();
        ring.len() == 3 && ring.iter().all(|&w| self.ring(w).valence() == 3)
    }

    /// Deletes the isolated tetrahedron that has `v` as a corner.
    ///
    /// # Errors
    /// [`EditError::NotATetrahedron`] if `v` is not live or its connected component has more than four vertices.
    pub fn remove_tetrahedron(&mut self, v: VertexId) -> Result<(), EditError> {
        if !self.is_live(v) || !self.is_tetrahedron(v) {
            return Err(EditError::NotATetrahedron(v));
        }
        self.remove_component(v);
        Ok(())
    }

    /// Deletes the connected component of `v`, whatever its genus, and returns its number of vertices, 0 if `v` is not
    /// live.
    pub fn remove_component(&mut self, v: VertexId) -> usize {
        let members = self.component_of(v, usize::MAX);
        if members.is_empty() {
            return 0;
        }
        let half_edges: usize = members.iter().map(|&w| self.ring(w).valence()).sum();
        self.euler -= members.len() as i64 + half_edges as i64 / 3 - half_edges as i64 / 2;
        self.half_edges -= half_edges;
        // In reverse, so that the slots are reused in breadth-first order.
        for &w in members.iter().rev() {
            self.release(w);
        }
        self.topology_changed();
        members.len()
    }
}
