//! Eulerian edits: split (creation), collapse (deletion), flip (inversion), and the end of a lone tetrahedron.

use super::{EditError, Mesh, Ring, VertexId};
use crate::math::Vec3;

/// The two vertices that an edge's triangles add to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Opposite {
    /// The third corner of the triangle to the left, going from the first end to the second, seen from outside.
    pub left: VertexId,
    /// The third corner of the triangle to the right.
    pub right: VertexId,
}

impl Mesh {
    /// The vertices opposite the edge `uv`.
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`] where `u` and `v` are not neighbours.
    pub fn opposite(&self, u: VertexId, v: VertexId) -> Result<Opposite, EditError> {
        let ring = self.rings.get(u.index()).ok_or(EditError::NotAnEdge(u, v))?;
        match (ring.after(v), ring.before(v)) {
            (Some(left), Some(right)) => Ok(Opposite { left, right }),
            _ => Err(EditError::NotAnEdge(u, v)),
        }
    }

    /// Creates a vertex on the edge `uv` at `position` and returns it (the paper's creation).
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
    /// [`EditError::NotAnEdge`], [`EditError::Full`].
    pub fn split(&mut self, u: VertexId, v: VertexId, position: Vec3) -> Result<VertexId, EditError> {
        let Opposite { left: a, right: b } = self.opposite(u, v)?;
        if !self.has_room_for(1) {
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

    /// Replaces the edge `uv` by the edge between the two vertices opposite it (the paper's inversion).
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
    /// [`EditError::NotAnEdge`]; [`EditError::Adjacent`] where the new edge is there already;
    /// [`EditError::ValenceTooLow`].
    pub fn flip(&mut self, u: VertexId, v: VertexId) -> Result<(), EditError> {
        let Opposite { left: a, right: b } = self.opposite(u, v)?;
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

    /// Whether [`Mesh::collapse`] of `uv` is possible (the link condition).
    ///
    /// # Errors
    /// As [`Mesh::collapse`].
    pub fn can_collapse(&self, u: VertexId, v: VertexId) -> Result<Opposite, EditError> {
        let opposite = self.opposite(u, v)?;
        let common = self.common_neighbours(u, v);
        if let Some(&o) = common.iter().find(|&&w| w != opposite.left && w != opposite.right) {
            return Err(EditError::NeckInTheWay(o));
        }
        for end in [opposite.left, opposite.right] {
            if self.ring(end).valence() <= 3 {
                return Err(EditError::ValenceTooLow(end));
            }
        }
        Ok(opposite)
    }

    /// Deletes `v` by drawing the edge `uv` together into `u`, which moves to `position` (the paper's deletion).
    ///
    /// # Errors
    /// [`EditError::NotAnEdge`]; [`EditError::NeckInTheWay`] where `u` and `v` have more than two neighbours in
    /// common; [`EditError::ValenceTooLow`] at a vertex opposite, as on a tetrahedron.
    pub fn collapse(&mut self, u: VertexId, v: VertexId, position: Vec3) -> Result<(), EditError> {
        let Opposite { left: a, right: b } = self.can_collapse(u, v)?;
        self.touch(u);
        self.attributes.blend(u, u, v, 0.5);
        self.positions[u.index()] = position;
        // Seen from v the order is u, b, outer neighbours, a; they take the place of v between b and a around u.
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

    /// Whether `v` is a corner of a component of four vertices.
    pub fn is_tetrahedron(&self, v: VertexId) -> bool {
        let ring = self.ring(v).as_slice();
        ring.len() == 3 && ring.iter().all(|&w| self.ring(w).valence() == 3)
    }

    /// Deletes the tetrahedron that has `v` as a corner.
    ///
    /// # Errors
    /// [`EditError::NotATetrahedron`] where the component of `v` has more than four vertices.
    pub fn remove_tetrahedron(&mut self, v: VertexId) -> Result<(), EditError> {
        if !self.is_live(v) || !self.is_tetrahedron(v) {
            return Err(EditError::NotATetrahedron(v));
        }
        self.remove_component(v);
        Ok(())
    }

    /// Deletes the whole component of `v`, whatever its genus, and returns how many vertices it had; none where `v` is not
    /// live.
    pub fn remove_component(&mut self, v: VertexId) -> usize {
        let members = self.component_of(v, usize::MAX);
        if members.is_empty() {
            return 0;
        }
        let half_edges: usize = members.iter().map(|&w| self.ring(w).valence()).sum();
        self.euler -= members.len() as i64 + half_edges as i64 / 3 - half_edges as i64 / 2;
        self.half_edges -= half_edges;
        // From the last to the first, so that ids are handed out again in the order they were found.
        for &w in members.iter().rev() {
            self.release(w);
        }
        self.topology_changed();
        members.len()
    }
}
