//! Renumbering of vertices for memory locality.

use super::{Mesh, VertexId};

impl Mesh {
    /// Returns the fraction of slots that hold a vertex, 1 for the empty mesh; where it is low, [`Mesh::reorder`] saves
    /// memory and time.
    pub fn occupancy(&self) -> f32 {
        if self.slots() == 0 { 1.0 } else { self.vertex_count() as f32 / self.slots() as f32 }
    }

    /// Renumbers the vertices breadth-first along the surface and removes free slots, so that loops over rings read
    /// memory nearly in order; on a shuffled mesh they take 3–6 times as long.
    ///
    /// Returns the new id of each old slot, `None` for a free one; previously stored ids are invalid afterwards.
    pub fn reorder(&mut self) -> Vec<Option<VertexId>> {
        let order = self.component_members().concat();
        self.apply_order(&order)
    }

    /// Moves vertex `order[i]` to slot `i`; `order` contains every live vertex once. Returns the new id of each old
    /// slot, `None` for a free one.
    fn apply_order(&mut self, order: &[VertexId]) -> Vec<Option<VertexId>> {
        let mut new_ids = vec![None; self.slots()];
        for (i, &v) in order.iter().enumerate() {
            new_ids[v.index()] = Some(VertexId::from_index(i));
        }
        self.positions = order.iter().map(|v| self.positions[v.index()]).collect();
        self.attributes.reorder(order);
        let mut rings: Vec<_> = order.iter().map(|v| std::mem::take(&mut self.rings[v.index()])).collect();
        rings.iter_mut().for_each(|ring| ring.renumber(|v| new_ids[v.index()].unwrap_or(v)));
        self.rings = rings;
        self.free.clear();
        self.topology_changed();
        new_ids
    }
}
