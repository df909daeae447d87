//! Whether the triangles that an edit made cross anything.

use super::clearance::are_beside;
use super::output::{OutputSpace, bounds, cross};
use super::star::{crossings_around, flatness, higher, longest_edge};
use super::{Embedding, FINEST, NEAREST_CORNER};
use crate::math::Bounds;
use crate::mesh::{Facet, Mesh, VertexId};

/// Triangles that an edit changes, at the most where no vertex has very many neighbours.
const ORDINARY_PATCH: usize = 24;

/// The effort of an edit whose neighbourhood is not searched.
const UNSEARCHED: u64 = 30;

/// A changed triangle and the box around it.
type Changed = (Facet, Bounds);

fn changed(facet: Facet, output: Option<&OutputSpace>) -> Changed {
    (facet, bounds(&facet, output))
}

impl Embedding {
    /// Whether the triangles changed since [`Mesh::begin`], by their corners, cross each other or any other. The grid still
    /// holds the mesh as it was.
    pub(super) fn changes_cross(&mut self, mesh: &Mesh, names: &[[VertexId; 3]]) -> bool {
        let fresh: Vec<Changed> =
            names.iter().map(|&names| changed(mesh.facet(names), self.output.as_ref())).collect();
        // Refusals for what is close at hand are cheap, but not free.
        self.effort += 1;
        self.stars_cross(mesh, names)
            || cross_each_other(&fresh, self.output.as_ref())
            || self.cross_others(mesh, &fresh)
    }

    /// As [`Self::changes_cross`], with two triangles that have a corner in common only.
    pub(super) fn one_rings_cross(&mut self, mesh: &Mesh, names: &[[VertexId; 3]]) -> bool {
        self.effort += UNSEARCHED;
        self.stars_cross(mesh, names)
    }

    /// Whether two triangles with a corner in common cross, at the corners of the changed ones.
    fn stars_cross(&self, mesh: &Mesh, changed: &[[VertexId; 3]]) -> bool {
        let mut hubs: Vec<VertexId> = changed.iter().flatten().copied().collect();
        hubs.sort_unstable();
        hubs.dedup();
        let mut crossing = Vec::new();
        hubs.into_iter().any(|hub| {
            if flatness(mesh, hub, longest_edge(mesh, hub)) <= self.finest() {
                crossings_around(mesh, hub, self.output.as_ref(), &mut crossing);
            }
            !crossing.is_empty()
        })
    }

    /// Whether a changed triangle crosses one that is not and has no corner in common with it.
    fn cross_others(&mut self, mesh: &Mesh, fresh: &[Changed]) -> bool {
        let whole = fresh.iter().fold(Bounds::EMPTY, |whole, (_, bounds)| whole.joined(bounds));
        let mut near = std::mem::take(&mut self.found);
        near.clear();
        self.grid.near_box(&whole, NEAREST_CORNER, |v| near.push(v));
        self.effort += (near.len() * (1 + fresh.len() / ORDINARY_PATCH)) as u64;
        self.new_marks(mesh);
        let output = self.output;
        let output = output.as_ref();
        let crosses = near.iter().any(|&v| {
            self.mark(v);
            // Triangles of marked vertices have been looked at.
            let is_new = |&(a, b): &(VertexId, VertexId)| !self.is_marked(a) && !self.is_marked(b);
            let others = mesh.ring(v).pairs().filter(is_new).map(|(a, b)| mesh.facet([v, a, b]));
            others
                .filter(|other| !is_beside(other, &whole))
                .any(|other| crosses_one(&changed(other, output), fresh, output))
        });
        self.found = near;
        crosses
    }
}

/// Whether all corners are beyond one side of the box.
#[inline]
fn is_beside(facet: &Facet, bounds: &Bounds) -> bool {
    let [a, b, c] = facet.points;
    let below = a.cmplt(bounds.min) & b.cmplt(bounds.min) & c.cmplt(bounds.min);
    let above = a.cmpgt(bounds.max) & b.cmpgt(bounds.max) & c.cmpgt(bounds.max);
    below.any() || above.any()
}

fn cross_each_other(fresh: &[Changed], output: Option<&OutputSpace>) -> bool {
    fresh.iter().enumerate().any(|(k, s)| fresh[..k].iter().any(|t| apart_but_cross(s, t, output)))
}

/// Whether a triangle that is none of the changed ones crosses one of them.
fn crosses_one(other: &Changed, fresh: &[Changed], output: Option<&OutputSpace>) -> bool {
    let same = |(facet, _): &Changed| other.0.corners.iter().all(|v| facet.corners.contains(v));
    !fresh.iter().any(same) && fresh.iter().any(|changed| apart_but_cross(other, changed, output))
}

/// Whether two triangles with no corner in common cross.
fn apart_but_cross(s: &Changed, t: &Changed, output: Option<&OutputSpace>) -> bool {
    s.1.meets(&t.1)
        && s.0.corners.iter().all(|v| !t.0.corners.contains(v))
        && !are_beside_each_other(s, t, output)
        && cross(&s.0, &t.0, output)
}

/// Whether two triangles are known to be apart, also where positions come out rounded.
fn are_beside_each_other(
    (s, around_s): &Changed,
    (t, around_t): &Changed,
    output: Option<&OutputSpace>,
) -> bool {
    let whole = around_s.joined(around_t);
    let reach = (whole.max - whole.min).max_element();
    let margin = 2.0 * output.map_or(FINEST, |space| higher(FINEST, space.rounding()));
    are_beside(&s.points, &t.points, reach, margin)
}
