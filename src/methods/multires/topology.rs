//! Moves the membrane with displacements shortened to avoid self-intersections, and cuts necks and joins contacts where
//! it comes near itself.
//!
//! The module `membrane` is faster: it makes a new mesh in every frame, which is used if it has no self-intersections.
//! Otherwise the mesh of the frame before is moved here, and annular and axial changes cut and join it.

use super::ellipsoid::Ellipsoid;
use super::membrane::{pushed_positions, relaxed};
use super::params::{MultiresParams, Topology};
use crate::math::Vec3;
use crate::mesh::{EditError, Mesh, VertexId};
use crate::remesh::{Changes, ContactPolicy, EdgeBounds, Resolver, Sampling, restructure};

/// Rounds of motion and remeshing in one call of [`move_guarded`]. With one, edges out of bounds remain.
const ROUNDS: usize = 2;

/// Moves `mesh`, the membrane of the frame before, to the `predicted` positions, by slot, and on towards the membrane's
/// energy minimum, and remeshes it. Displacements are shortened to avoid self-intersections. Returns the edits made.
pub(super) fn move_guarded(
    mesh: &mut Mesh,
    predicted: &[Vec3],
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    resolver: &mut Resolver,
) -> Changes {
    let sampling = sampling(params.bounds());
    let mut changes = Changes::default();
    move_to(mesh, predicted, resolver, sampling);
    for _ in 0..ROUNDS {
        let positions = relaxed(mesh, ellipsoids, params, 0.0);
        move_to(mesh, &positions, resolver, sampling);
        changes += remesh_and_resolve(mesh, params, resolver);
    }
    // Pushes edge midpoints that remeshing added out of the ellipsoids.
    let positions = pushed_positions(mesh, ellipsoids);
    move_to(mesh, &positions, resolver, sampling);
    changes
}

/// Restores the edge bounds of the membrane after a motion, and makes the topology changes at necks and contacts that
/// the parameters allow. Returns the edits made.
fn remesh_and_resolve(mesh: &mut Mesh, params: &MultiresParams, resolver: &mut Resolver) -> Changes {
    let bounds = params.bounds();
    let mut changes = restructure(mesh, bounds, resolver.embedding(mesh, sampling(bounds)));
    let active: Vec<VertexId> = match params.topology {
        Topology::Never => return changes,
        Topology::Split => pinched(mesh, bounds),
        Topology::SplitAndJoin => mesh.vertices().collect(),
    };
    changes += resolve(mesh, params, resolver, &active);
    changes
}

/// Cuts thin necks of the membrane `mesh`, which must not intersect itself, unless the parameters forbid topology
/// changes; joins contacts around them if the parameters allow it. Edges are split only up to `most_vertices` vertices
/// in all. Returns the edits made.
pub(super) fn cut_threads(mesh: &mut Mesh, params: &MultiresParams, most_vertices: usize) -> Changes {
    let active = pinched(mesh, params.bounds());
    if params.topology == Topology::Never || active.is_empty() {
        return Changes::default();
    }
    resolve(mesh, params, &mut Resolver::with_max_vertices(most_vertices), &active)
}

fn resolve(
    mesh: &mut Mesh,
    params: &MultiresParams,
    resolver: &mut Resolver,
    active: &[VertexId],
) -> Changes {
    let joins = params.topology == Topology::SplitAndJoin;
    resolver.set_contact_policy(if joins { ContactPolicy::Join } else { ContactPolicy::Leave });
    resolver.resolve(mesh, sampling(params.bounds()), active)
}

/// Returns the edge lengths that the resolver restores around topology changes: from ε_min to 2.5 ε_min, slightly more
/// than the default ε_max, 2.23 ε_min; with a higher ε_max up to that, since finer parts would be refined until they are
/// in contact everywhere.
fn sampling(bounds: EdgeBounds) -> Sampling {
    let usual = Sampling::new(bounds.min);
    if bounds.max > usual.longest() { Sampling::up_to(bounds.max) } else { usual }
}

/// Returns the vertices of edges that are shorter than ε_min and cannot be collapsed, because they are on a neck or on
/// an isolated tetrahedron. Topology changes are tried around them.
fn pinched(mesh: &Mesh, bounds: EdgeBounds) -> Vec<VertexId> {
    let shortest = bounds.min * bounds.min;
    let is_pinched = |u: VertexId, v: VertexId| {
        mesh.position(u).distance_squared(mesh.position(v)) < shortest
            && (mesh.is_tetrahedron(u) || matches!(mesh.can_collapse(u, v), Err(EditError::LinkCondition(_))))
    };
    mesh.vertices().filter(|&u| mesh.ring(u).as_slice().iter().any(|&v| is_pinched(u, v))).collect()
}

fn move_to(mesh: &mut Mesh, positions: &[Vec3], resolver: &mut Resolver, sampling: Sampling) {
    let mut displacements = displacements_to(mesh, positions);
    resolver.move_all(mesh, sampling, &mut displacements);
}

/// Returns the displacement of each vertex of `mesh` to its position in `positions`, both by slot; zero for free slots.
pub(super) fn displacements_to(mesh: &Mesh, positions: &[Vec3]) -> Vec<Vec3> {
    let mut displacements = vec![Vec3::ZERO; mesh.slots()];
    // Free slots have no position.
    mesh.vertices().for_each(|v| displacements[v.index()] = positions[v.index()] - mesh.position(v));
    displacements
}
