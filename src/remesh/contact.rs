//! Contact between non-adjacent vertices, and its resolution by flips and joins: equation (3) and the axial change of
//! figures 3 and 4 (Lachaud & Montanvert).

use super::{Resolver, Sampling, TopologyGuide};
use crate::math::order::{combined_rank, rank_f32, sort_by_rank};
use crate::mesh::{Mesh, VertexId};
use crate::pauses::Pauses;

/// Fractions of the edges around a joined vertex, measured from that vertex, at which the rim of the new tube lies;
/// tried in turn until one causes no self-intersection. Below the first, the tube is so thin that it is cut again at
/// once; above it, the strip around the tube is thinner than δ and collapses.
const JOINT_REACHES: [f32; 4] = [0.7, 0.5, 0.35, 0.85];

/// Two vertices in contact, the lower id first, with their squared distance.
#[derive(Clone, Copy)]
struct ContactPair {
    square: f32,
    u: VertexId,
    v: VertexId,
}

impl Resolver {
    /// Resolves the contacts of the vertices marked for a contact query, by flips and joins; returns whether the mesh
    /// was changed.
    pub(super) async fn join_contacts(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        pauses: &Pauses,
    ) -> bool {
        let contacts = self.find_contacts(mesh, sampling, pauses).await;
        let mut changed = false;
        // Contacts next to a new tube stay pending until its edges are within bounds: joined at once, neighbouring
        // pairs of two facing sheets would create a handle each.
        let mut busy = vec![false; mesh.slots()];
        for ContactPair { square, u, v } in contacts {
            pauses.after(1).await;
            if !free(mesh, &busy, u) || !free(mesh, &busy, v) || mesh.ring(u).contains(v) {
                self.touch_live(mesh, u);
                continue;
            }
            let reached: Vec<VertexId> =
                [u, v].iter().flat_map(|&w| mesh.ring(w).as_slice()).copied().collect();
            let Some(done) = self.resolve_contact(mesh, square, [u, v], guide) else { continue };
            changed |= done;
            busy.resize(mesh.slots(), true);
            for w in reached.into_iter().chain([u, v]) {
                busy[w.index()] = true;
                self.touch_live(mesh, w);
            }
        }
        changed
    }

    fn touch_live(&mut self, mesh: &Mesh, v: VertexId) {
        if mesh.is_live(v) {
            self.touch(v);
        }
    }

    /// Returns the pairs of vertices in contact, nearest first, of which at least one is marked for the contact query,
    /// and clears these marks.
    async fn find_contacts(&mut self, mesh: &Mesh, sampling: Sampling, pauses: &Pauses) -> Vec<ContactPair> {
        let mut dirty = self.take_dirty();
        dirty.retain(|&v| mesh.is_live(v));
        let mut contacts = Vec::new();
        if dirty.is_empty() {
            return contacts;
        }
        self.embedding.sync(mesh);
        let mut is_dirty = vec![false; mesh.slots()];
        dirty.iter().for_each(|v| is_dirty[v.index()] = true);
        for &u in &dirty {
            pauses.after(1).await;
            self.embedding.for_each_contact(mesh, u, sampling.contact(), |v, square| {
                let contact = sampling.between(mesh, u, v).contact();
                if square >= contact * contact {
                    return;
                }
                let counted_from_v = v < u && is_dirty[v.index()] && self.embedding.may_have_contacts(v);
                if !counted_from_v {
                    contacts.push(ContactPair { square, u: u.min(v), v: u.max(v) });
                }
            });
        }
        sort_by_rank(&mut contacts, |contact| combined_rank(contact.u.0, contact.v.0));
        sort_by_rank(&mut contacts, |contact| rank_f32(contact.square).into());
        contacts
    }

    /// Resolves one contact: by a flip if the two vertices are opposite each other across an edge longer than their
    /// distance, whose square is `square`; by a tube if they are opposite across no edge and `guide` allows it. Returns
    /// `Some(true)` if the mesh was changed, else `None`.
    fn resolve_contact(
        &mut self,
        mesh: &mut Mesh,
        square: f32,
        [u, v]: [VertexId; 2],
        guide: &dyn TopologyGuide,
    ) -> Option<bool> {
        if let Some(across) = longest_edge_between(mesh, u, v) {
            let (a, b, length) = across;
            // A fold at a short edge is no contact: that edge is collapsed before its two triangles can touch.
            if length <= square || self.embedding.attempt(mesh, |mesh| mesh.flip(a, b)).is_err() {
                return None;
            }
            self.changes.inversions += 1;
            return Some(true);
        }
        if !guide.may_join(mesh, [u, v]) {
            return None;
        }
        let mut join = |reach: f32| self.embedding.attempt(mesh, |mesh| mesh.join(u, v, reach)).ok();
        let joint = JOINT_REACHES.into_iter().find_map(&mut join)?;
        self.changes.axial += 1;
        joint.first.iter().chain(&joint.second).for_each(|&w| self.touch_edited(w));
        Some(true)
    }
}

fn free(mesh: &Mesh, busy: &[bool], v: VertexId) -> bool {
    mesh.is_live(v) && busy.get(v.index()) == Some(&false)
}

/// Returns the ends of the longest edge across which `u` and `v` are opposite each other, and its squared length;
/// `None` if there is no such edge.
fn longest_edge_between(mesh: &Mesh, u: VertexId, v: VertexId) -> Option<(VertexId, VertexId, f32)> {
    let across = mesh.ring(u).pairs().filter(|&(a, b)| mesh.ring(a).before(b) == Some(v));
    across
        .map(|(a, b)| (a, b, mesh.position(a).distance_squared(mesh.position(b))))
        .max_by(|x, y| x.2.total_cmp(&y.2))
}
