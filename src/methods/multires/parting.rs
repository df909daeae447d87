//! The skin followed with care: where it comes near itself, necks part and parts meet, and nothing crosses on the way.
//!
//! The fast way (`membrane`) makes a new mesh in every frame and is taken where that does not cross itself. Here the mesh of the
//! frame before moves instead, guarded, and the kernel's annular and axial changes do what is due.

use super::ellipsoid::Ellipsoid;
use super::membrane::{hold, relaxed};
use super::params::{MultiresParams, Topology};
use crate::math::Vec3;
use crate::mesh::{EditError, Mesh, VertexId};
use crate::remesh::{Changes, Contact, EdgeBounds, Resolver, Sampling, restructure};

/// Moves, each with what it brings about. With one, a frame leaves edges out of bounds behind.
const ROUNDS: usize = 2;

/// Takes `mesh` to the `predicted` places, one for each slot, and on to where the skin wants to be.
pub(super) fn follow(
    mesh: &mut Mesh,
    predicted: &[Vec3],
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    resolver: &mut Resolver,
) -> Changes {
    let sampling = sampling(params.bounds());
    let mut changes = Changes::default();
    carry(mesh, predicted, resolver, sampling);
    for _ in 0..ROUNDS {
        let places = relaxed(mesh, ellipsoids, params, 0.0);
        carry(mesh, &places, resolver, sampling);
        changes += mend(mesh, params, resolver);
    }
    // What was made in the middle of edges goes out of the ellipsoids.
    let places = hold(mesh, ellipsoids);
    carry(mesh, &places, resolver, sampling);
    changes
}

/// Edges into bounds, and what is to become of necks and contacts.
fn mend(mesh: &mut Mesh, params: &MultiresParams, resolver: &mut Resolver) -> Changes {
    let bounds = params.bounds();
    let mut changes = restructure(mesh, bounds, resolver.guard(mesh, sampling(bounds)));
    let active: Vec<VertexId> = match params.topology {
        Topology::Never => return changes,
        Topology::Split => pinched(mesh, bounds),
        Topology::SplitAndJoin => mesh.vertices().collect(),
    };
    changes += resolve(mesh, params, resolver, &active);
    changes
}

/// Cuts what has become a thread. `mesh` does not cross itself.
pub(super) fn cut_threads(mesh: &mut Mesh, params: &MultiresParams, most_vertices: usize) -> Changes {
    let active = pinched(mesh, params.bounds());
    if params.topology == Topology::Never || active.is_empty() {
        return Changes::default();
    }
    resolve(mesh, params, &mut Resolver::with_room_for(most_vertices), &active)
}

fn resolve(
    mesh: &mut Mesh,
    params: &MultiresParams,
    resolver: &mut Resolver,
    active: &[VertexId],
) -> Changes {
    let joins = params.topology == Topology::SplitAndJoin;
    resolver.set_contact(if joins { Contact::Join } else { Contact::Leave });
    resolver.resolve(mesh, sampling(params.bounds()), active)
}

/// The bounds of the kernel's topology changes: its shortest edge is that of the mesh, its longest a little longer.
fn sampling(bounds: EdgeBounds) -> Sampling {
    Sampling::new(bounds.min)
}

/// Vertices with an edge that is too short and cannot be drawn together, as a neck is in the way or nothing else is left.
fn pinched(mesh: &Mesh, bounds: EdgeBounds) -> Vec<VertexId> {
    let shortest = bounds.min * bounds.min;
    let is_pinched = |u: VertexId, v: VertexId| {
        mesh.position(u).distance_squared(mesh.position(v)) < shortest
            && (mesh.is_tetrahedron(u) || matches!(mesh.can_collapse(u, v), Err(EditError::NeckInTheWay(_))))
    };
    mesh.vertices().filter(|&u| mesh.ring(u).as_slice().iter().any(|&v| is_pinched(u, v))).collect()
}

fn carry(mesh: &mut Mesh, places: &[Vec3], resolver: &mut Resolver, sampling: Sampling) {
    let mut ways = ways_to(mesh, places);
    resolver.carry(mesh, sampling, &mut ways);
}

/// The way of each vertex to its place, by slot.
pub(super) fn ways_to(mesh: &Mesh, places: &[Vec3]) -> Vec<Vec3> {
    let mut ways = vec![Vec3::ZERO; mesh.slots()];
    // Free slots have no place.
    mesh.vertices().for_each(|v| ways[v.index()] = places[v.index()] - mesh.position(v));
    ways
}
