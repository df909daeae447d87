//! Whether the triangles that an edit made cross anything.

use super::output::{OutputSpace, bounds, cross};
use super::star::{ROUNDING, crossings_around, flatness, longest_edge, unit};
use super::{Embedding, NEAREST_CORNER};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Facet, Mesh, VertexId};

/// Triangles that an edit changes, at the most where no vertex has very many neighbours.
const ORDINARY_PATCH: usize = 24;

/// What an edit counts for whose neighbourhood is not searched.
const ORDINARY_EFFORT: u64 = 30;

/// A changed triangle, the box around it, and its plane.
struct Changed {
    facet: Facet,
    bounds: Bounds,
    /// 0 where it has no area.
    normal: Vec3,
    /// What is further than this from the plane, all on one side, does not touch the triangle, rounded or not.
    margin: f32,
}

impl Changed {
    fn new(facet: Facet, output: Option<&OutputSpace>, finest: f32) -> Self {
        let bounds = bounds(&facet, output);
        let [a, b, c] = facet.points;
        let size = (bounds.max - bounds.min).element_sum();
        Self { facet, bounds, normal: unit((b - a).cross(c - a)), margin: 2.0 * finest + ROUNDING * size }
    }

    /// Whether another triangle, whose box meets this one's, is all on one side of the plane.
    #[inline]
    fn is_passed_by(&self, points: &[Vec3; 3]) -> bool {
        let origin = self.facet.points[0];
        let [a, b, c] = points.map(|p| (p - origin).dot(self.normal));
        let margin = self.margin;
        (a > margin && b > margin && c > margin) || (a < -margin && b < -margin && c < -margin)
    }

    /// Whether another triangle, that has no corner in common, crosses this one.
    fn crosses(&self, other: &Facet, output: Option<&OutputSpace>) -> bool {
        !self.is_passed_by(&other.points) && cross(&self.facet, other, output)
    }
}

impl Embedding {
    /// Whether the triangles changed since [`Mesh::begin`], by their corners, cross each other or any other. The grid still
    /// holds the mesh as it was.
    pub(super) fn changes_cross(&mut self, mesh: &Mesh, names: &[[VertexId; 3]]) -> bool {
        let output = self.output;
        let output = output.as_ref();
        let finest = self.finest();
        let fresh: Vec<Changed> =
            names.iter().map(|&names| Changed::new(mesh.facet(names), output, finest)).collect();
        // Refusals for what is close at hand are cheap, but not free.
        self.effort += 1;
        let hubs = corners(names);
        self.stars_cross(mesh, &hubs)
            || cross_each_other(&fresh, output)
            || self.cross_others(mesh, &fresh, &hubs, output)
    }

    /// Whether two triangles with a corner in common cross, at the corners of the changed ones.
    pub(super) fn one_rings_cross(&mut self, mesh: &Mesh, names: &[[VertexId; 3]]) -> bool {
        self.effort += ORDINARY_EFFORT;
        self.stars_cross(mesh, &corners(names))
    }

    /// Whether two triangles with a corner in common cross, at the corners of the changed ones.
    fn stars_cross(&self, mesh: &Mesh, hubs: &[VertexId]) -> bool {
        let mut crossing = Vec::new();
        hubs.iter().any(|&hub| {
            if flatness(mesh, hub, longest_edge(mesh, hub)) <= self.finest() {
                crossings_around(mesh, hub, self.output.as_ref(), &mut crossing);
            }
            !crossing.is_empty()
        })
    }

    /// Whether a changed triangle crosses one that is not and has no corner in common with it. `hubs` are the corners of the changed
    /// ones.
    fn cross_others(
        &mut self,
        mesh: &Mesh,
        fresh: &[Changed],
        hubs: &[VertexId],
        output: Option<&OutputSpace>,
    ) -> bool {
        let whole = fresh.iter().fold(Bounds::EMPTY, |whole, changed| whole.joined(&changed.bounds));
        let mut near = std::mem::take(&mut self.found);
        near.clear();
        self.grid.near_box(&whole, NEAREST_CORNER, |v| near.push(v));
        self.effort += (near.len() * (1 + fresh.len() / ORDINARY_PATCH)) as u64;
        self.new_marks(mesh);
        let crosses = near.iter().any(|&v| {
            self.mark(v);
            let is_hub = hubs.contains(&v);
            let p = mesh.position(v);
            // Triangles of marked vertices have been looked at.
            mesh.ring(v).pairs().filter(|&(a, b)| !self.is_marked(a) && !self.is_marked(b)).any(|(a, b)| {
                let points = [p, mesh.position(a), mesh.position(b)];
                let around = Bounds::of(&points);
                if !around.meets(&whole) {
                    return false;
                }
                let other = Facet { corners: [v.0, a.0, b.0], points };
                let touches = is_hub || hubs.contains(&a) || hubs.contains(&b);
                if touches {
                    touching_crosses(&other, &around, fresh, output)
                } else {
                    fresh
                        .iter()
                        .any(|changed| changed.bounds.meets(&around) && changed.crosses(&other, output))
                }
            })
        });
        self.found = near;
        crosses
    }
}

/// The corners of some triangles, each once.
fn corners(names: &[[VertexId; 3]]) -> Vec<VertexId> {
    let mut corners: Vec<VertexId> = names.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// Whether a triangle with a corner among those of the changed ones is none of them and crosses one that it has no corner in common
/// with.
fn touching_crosses(other: &Facet, around: &Bounds, fresh: &[Changed], output: Option<&OutputSpace>) -> bool {
    let same = |changed: &Changed| other.corners.iter().all(|v| changed.facet.corners.contains(v));
    !fresh.iter().any(same)
        && fresh.iter().any(|changed| {
            changed.bounds.meets(around) && are_apart(&changed.facet, other) && changed.crosses(other, output)
        })
}

fn cross_each_other(fresh: &[Changed], output: Option<&OutputSpace>) -> bool {
    fresh.iter().enumerate().any(|(k, s)| {
        fresh[..k].iter().any(|t| {
            s.bounds.meets(&t.bounds) && are_apart(&s.facet, &t.facet) && s.crosses(&t.facet, output)
        })
    })
}

/// Whether two triangles have no corner in common.
fn are_apart(s: &Facet, t: &Facet) -> bool {
    s.corners.iter().all(|v| !t.corners.contains(v))
}
