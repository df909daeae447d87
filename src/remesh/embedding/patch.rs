//! Whether the triangles that an edit made cross anything.

use super::star::{Corners, corners, crossings_around, flatness, longest_edge};
use super::{Embedding, NEAREST_CORNER};
use crate::math::Bounds;
use crate::mesh::{Mesh, VertexId, triangles_meet};

impl Embedding {
    /// Whether the triangles changed since [`Mesh::begin`] cross each other or any other. The grid still holds the mesh as
    /// it was.
    pub(super) fn changes_cross(&mut self, mesh: &Mesh) -> bool {
        let names = mesh.changed_triangles();
        let changed: Vec<(Corners, Bounds)> = names
            .iter()
            .map(|&names| corners(mesh, names))
            .map(|triangle| (triangle, Bounds::of(&triangle.1)))
            .collect();
        stars_cross(mesh, &changed) || cross_each_other(&changed) || self.cross_others(mesh, &changed)
    }

    /// Whether a changed triangle crosses one that is not and has no corner in common with it.
    fn cross_others(&mut self, mesh: &Mesh, changed: &[(Corners, Bounds)]) -> bool {
        let whole = changed.iter().fold(Bounds::EMPTY, |whole, (_, bounds)| whole.joined(bounds));
        let mut near = std::mem::take(&mut self.found);
        near.clear();
        self.grid.near_box(&whole, NEAREST_CORNER, |v| near.push(v));
        self.new_marks(mesh);
        let crosses = near.iter().any(|&v| {
            self.mark(v);
            mesh.is_live(v)
                && mesh.ring(v).pairs().any(|(a, b)| {
                    // Those of marked vertices have been looked at.
                    !self.is_marked(a) && !self.is_marked(b) && one_crosses(mesh, [v, a, b], &whole, changed)
                })
        });
        self.found = near;
        crosses
    }
}

/// Whether two triangles with a corner in common cross, at the corners of the changed ones.
fn stars_cross(mesh: &Mesh, changed: &[(Corners, Bounds)]) -> bool {
    let mut hubs: Vec<VertexId> = changed.iter().flat_map(|((names, _), _)| *names).collect();
    hubs.sort_unstable();
    hubs.dedup();
    hubs.into_iter().any(|hub| {
        let mut crosses = false;
        if flatness(mesh, hub, longest_edge(mesh, hub)) <= 0.0 {
            crossings_around(mesh, hub, |_, _| crosses = true);
        }
        crosses
    })
}

fn cross_each_other(changed: &[(Corners, Bounds)]) -> bool {
    let pairs = changed.iter().enumerate().flat_map(|(k, s)| changed[..k].iter().map(move |t| (s, t)));
    pairs.into_iter().any(|(s, t)| apart_but_cross(s, t))
}

fn one_crosses(mesh: &Mesh, names: [VertexId; 3], whole: &Bounds, changed: &[(Corners, Bounds)]) -> bool {
    let triangle = corners(mesh, names);
    let bounds = Bounds::of(&triangle.1);
    bounds.meets(whole)
        && changed.iter().all(|((others, _), _)| !names.iter().all(|v| others.contains(v)))
        && changed.iter().any(|other| apart_but_cross(&(triangle, bounds), other))
}

/// Whether two triangles with no corner in common cross.
fn apart_but_cross((s, around_s): &(Corners, Bounds), (t, around_t): &(Corners, Bounds)) -> bool {
    around_s.meets(around_t) && s.0.iter().all(|v| !t.0.contains(v)) && triangles_meet(*s, *t)
}
