//! Tests whether the triangles changed by an edit intersect any others.

use super::clearance::are_apart_in_plane;
use super::one_ring::{changes_intersect_around, flat_clearance, longest_edge};
use super::output::{OutputSpace, bounds, exact_below, intersect};
use super::{Embedding, NEAREST_CORNER};
use crate::math::Bounds;
use crate::mesh::{Facet, Mesh, VertexId, sort_distinct};

/// Number of changed triangles per which the work of an edit is counted once more: with n of them, the nearby vertices
/// visited count 1 + ⌊n / this⌋ times. Most edits change fewer than this.
const ORDINARY_PATCH: usize = 24;

/// The work counted for an edit that is tested in one-rings only, in units of nearby vertices visited.
const UNSEARCHED: u64 = 30;

/// A triangle changed by an edit, or another one tested against the changed ones, and its bounding box.
type Changed = (Facet, Bounds);

fn changed(facet: Facet, output: Option<&OutputSpace>) -> Changed {
    (facet, bounds(&facet, output))
}

impl Embedding {
    /// Returns whether the triangles changed since [`Mesh::begin`], given by their corners, intersect each other or any
    /// other triangles of the mesh. The grid still contains the positions before the edit.
    pub(super) fn changes_intersect(&mut self, mesh: &Mesh, triangles: &[[VertexId; 3]]) -> bool {
        let edited: Vec<Changed> =
            triangles.iter().map(|&corners| changed(mesh.facet(corners), self.output.as_ref())).collect();
        // Counted even if the cheap tests below reject the edit.
        self.effort += 1;
        self.any_one_ring_intersects(mesh, triangles)
            || intersect_each_other(&edited, self.output.as_ref())
            || self.intersect_others(mesh, &edited)
    }

    /// Returns whether a triangle changed since [`Mesh::begin`] intersects another one with which it has a common
    /// corner; `triangles` are the changed ones, by their corners.
    pub(super) fn one_rings_intersect(&mut self, mesh: &Mesh, triangles: &[[VertexId; 3]]) -> bool {
        self.effort += UNSEARCHED;
        self.any_one_ring_intersects(mesh, triangles)
    }

    /// Returns whether one of the triangles `changed` by an edit, given by their corners, intersects another one with
    /// which it has a common corner.
    fn any_one_ring_intersects(&mut self, mesh: &Mesh, changed: &[[VertexId; 3]]) -> bool {
        let mut hubs: Vec<VertexId> = changed.iter().flatten().copied().collect();
        sort_distinct(&mut hubs);
        hubs.into_iter().any(|hub| {
            self.tested_around += mesh.ring(hub).valence() as u64;
            let longest = longest_edge(mesh, hub);
            flat_clearance(mesh, hub, longest) <= self.exact_below()
                && changes_intersect_around(mesh, hub, longest, changed, self.output.as_ref())
        })
    }

    /// Returns whether one of the triangles changed by an edit, `edited`, intersects an unchanged one with which it has
    /// no common corner.
    fn intersect_others(&mut self, mesh: &Mesh, edited: &[Changed]) -> bool {
        let whole = edited.iter().fold(Bounds::EMPTY, |whole, (_, bounds)| whole.union(bounds));
        let mut near = std::mem::take(&mut self.found);
        near.clear();
        self.grid.near_box(&whole, NEAREST_CORNER, |v| near.push(v));
        self.effort += (near.len() * (1 + edited.len() / ORDINARY_PATCH)) as u64;
        self.new_marks(mesh);
        let output = self.output;
        let output = output.as_ref();
        let intersects = near.iter().any(|&v| {
            self.mark(v);
            // Triangles of marked vertices have been visited.
            let is_new = |&(a, b): &(VertexId, VertexId)| !self.is_marked(a) && !self.is_marked(b);
            let others = mesh.ring(v).pairs().filter(is_new).map(|(a, b)| mesh.facet([v, a, b]));
            others
                .filter(|other| !is_outside_box(other, &whole))
                .any(|other| intersects_one(&changed(other, output), edited, output))
        });
        self.found = near;
        intersects
    }
}

/// Returns whether all corners of a triangle are beyond the same face of the box, so that the triangle does not
/// intersect it.
#[inline]
fn is_outside_box(facet: &Facet, bounds: &Bounds) -> bool {
    let [a, b, c] = facet.points;
    let below = a.cmplt(bounds.min) & b.cmplt(bounds.min) & c.cmplt(bounds.min);
    let above = a.cmpgt(bounds.max) & b.cmpgt(bounds.max) & c.cmpgt(bounds.max);
    below.any() || above.any()
}

fn intersect_each_other(edited: &[Changed], output: Option<&OutputSpace>) -> bool {
    edited.iter().enumerate().any(|(k, s)| edited[..k].iter().any(|t| intersect_apart(s, t, output)))
}

/// Returns whether the triangle `other` is not one of those changed by an edit, `edited`, and intersects one of them
/// without having a common corner with it.
fn intersects_one(other: &Changed, edited: &[Changed], output: Option<&OutputSpace>) -> bool {
    let same = |(facet, _): &Changed| other.0.corners.iter().all(|v| facet.corners.contains(v));
    !edited.iter().any(same) && edited.iter().any(|changed| intersect_apart(other, changed, output))
}

/// Returns whether two triangles intersect and have no common corner.
fn intersect_apart(s: &Changed, t: &Changed, output: Option<&OutputSpace>) -> bool {
    s.1.overlaps(&t.1)
        && s.0.corners.iter().all(|v| !t.0.corners.contains(v))
        && !are_apart(s, t, output)
        && intersect(&s.0, &t.0, output)
}

/// Returns whether two triangles are known to be disjoint, also in the output space if there is one; a filter before
/// exact tests.
fn are_apart((s, around_s): &Changed, (t, around_t): &Changed, output: Option<&OutputSpace>) -> bool {
    let whole = around_s.union(around_t);
    let reach = (whole.max - whole.min).max_element();
    are_apart_in_plane(&s.points, &t.points, reach, 2.0 * exact_below(output))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Edits around the same vertices again and again, as on a level whose edges are too long, list each vertex once.
    #[test]
    fn vertices_that_are_edited_often_are_listed_once() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 4.0, 1.0).unwrap();
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 1.3);
        let mut displacements = vec![Vec3::X * 0.01; mesh.slots()];
        embedding.move_all(&mut mesh, &mut displacements);
        let v = mesh.vertices().next().unwrap();
        for k in 0..10 {
            let up = Vec3::Z * if k % 2 == 0 { 0.01 } else { -0.01 };
            let edit = |mesh: &mut Mesh| {
                mesh.set_position(v, mesh.position(v) + up);
                Ok(())
            };
            embedding.attempt(&mut mesh, edit).unwrap();
        }
        let mut listed = embedding.edited.clone();
        sort_distinct(&mut listed);
        assert_eq!(listed.len(), embedding.edited.len());
        assert_eq!(listed.len(), 1 + mesh.ring(v).valence());
        let held = embedding.move_all(&mut mesh, &mut displacements);
        assert!(held.is_empty() && embedding.edited.is_empty());
    }
}
