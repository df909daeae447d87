//! A skin over the ellipsoids: umbrella iterations and pushes, from coarse to fine (section 5).

use super::ellipsoid::{Ellipsoid, pushed_out};
use super::params::{Energy, MultiresParams};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{Changes, EdgeBounds, Unchecked, restructure};

/// The longest edges of a level in the thinnest of the ellipsoids: a mesh much coarser would slip off it.
const COARSEST: f64 = 0.8;

/// Iterations of a finer level end where one moves vertices by no more than this share of its edges in the mean square:
/// from there on they slide along the surface, with a tenth of it across.
const STILL: f64 = 0.025;

/// The least number of vertices that a coarse level is to have: fewer say nothing about the shape.
const LEAST_VERTICES: f64 = 60.0;

/// Solves for the skin on meshes from coarse to fine, `levels` of them above the target; the last one is left in `mesh`.
///
/// Edits are made whatever they cross; the caller looks at the outcome.
pub(super) fn settle(
    mesh: &mut Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    levels: u32,
) -> Changes {
    settle_seen(mesh, ellipsoids, params, levels, |_| {})
}

/// As [`settle`]; each level is shown when it is solved.
pub(super) fn settle_seen(
    mesh: &mut Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    levels: u32,
    mut see: impl FnMut(&Mesh),
) -> Changes {
    let mut changes = Changes::default();
    let bounds = params.bounds();
    let coarsest = coarsest(mesh, ellipsoids, params, levels);
    for level in (0..=coarsest).rev() {
        let coarser = libm::pow(params.refine_factor, -f64::from(level));
        // The shape is found on the coarsest; the others only have to follow.
        let still = if level == coarsest { 0.0 } else { STILL * coarser * params.target() };
        changes += solve_level(mesh, ellipsoids, params, bounds.scaled(coarser as f32), still);
        see(mesh);
    }
    changes += finish(mesh, ellipsoids, bounds);
    changes
}

/// Takes a skin that is nearly at rest along: only its edges, and what little it is off, on one level.
pub(super) fn freshen(mesh: &mut Mesh, ellipsoids: &[Ellipsoid], params: &MultiresParams) -> Changes {
    let bounds = params.bounds();
    let mut changes = solve_level(mesh, ellipsoids, params, bounds, STILL * params.target());
    changes += finish(mesh, ellipsoids, bounds);
    changes
}

/// The iterations with edges within `bounds`; `still` as in [`relaxed`].
fn solve_level(
    mesh: &mut Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    bounds: EdgeBounds,
    still: f64,
) -> Changes {
    let changes = restructure(mesh, bounds, &mut Unchecked);
    let places = relaxed(mesh, ellipsoids, params, still);
    mesh.positions_mut().copy_from_slice(&places);
    changes
}

/// The last level left edges that are too short or too long, and what is made in the middle of an edge lies inside.
fn finish(mesh: &mut Mesh, ellipsoids: &[Ellipsoid], bounds: EdgeBounds) -> Changes {
    let changes = restructure(mesh, bounds, &mut Unchecked);
    let places = hold(mesh, ellipsoids);
    mesh.positions_mut().copy_from_slice(&places);
    changes
}

/// The coarsest level that is of use.
fn coarsest(mesh: &Mesh, ellipsoids: &[Ellipsoid], params: &MultiresParams, levels: u32) -> u32 {
    let thinnest = ellipsoids.iter().map(Ellipsoid::thinnest).fold(f64::MAX, f64::min);
    let fits = |level: u32| {
        let coarser = libm::pow(params.refine_factor, -f64::from(level));
        let vertices = mesh.vertex_count() as f64 / (coarser * coarser);
        params.edge_max * coarser <= COARSEST * thinnest && vertices >= LEAST_VERTICES
    };
    (0..=levels).rev().find(|&level| level == 0 || fits(level)).unwrap_or(0)
}

/// Every vertex in turn goes to where the energy is least while all others stay, and out of the ellipsoids. How far they
/// went, in the root of the mean square.
fn sweep(mesh: &Mesh, places: &mut [Vec3], ellipsoids: &[Ellipsoid], energy: Energy) -> f64 {
    let mut sum = 0.0;
    for v in mesh.vertices() {
        let place = pushed(ellipsoids, best(mesh, places, energy, v));
        sum += f64::from(place.distance_squared(places[v.index()]));
        places[v.index()] = place;
    }
    (sum / mesh.vertex_count().max(1) as f64).sqrt()
}

/// Where the energy is least for one vertex.
fn best(mesh: &Mesh, places: &[Vec3], energy: Energy, v: VertexId) -> Vec3 {
    match energy {
        Energy::Membrane => middle(mesh, places, v),
        Energy::ThinPlate => flattest(mesh, places, v),
    }
}

/// Equation 2: p ← Σ pᵢ / n.
#[inline]
fn middle(mesh: &Mesh, places: &[Vec3], v: VertexId) -> Vec3 {
    let ring = mesh.ring(v).as_slice();
    ring.iter().fold(Vec3::ZERO, |sum, w| sum + places[w.index()]) * (1.0 / ring.len() as f32)
}

/// p ← p − U²(p) / ν, with U(p) = Σ pᵢ / n − p, U² of U, and ν = 1 + Σ 1/nᵢ / n (Kobbelt et al., *Interactive
/// multi-resolution modeling on arbitrary meshes*, 1998).
fn flattest(mesh: &Mesh, places: &[Vec3], v: VertexId) -> Vec3 {
    let umbrella = |w: VertexId| middle(mesh, places, w) - places[w.index()];
    let ring = mesh.ring(v).as_slice();
    let share = 1.0 / ring.len() as f32;
    let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
    for &w in ring {
        sum += umbrella(w);
        weight += 1.0 / mesh.ring(w).valence() as f32;
    }
    let second = sum * share - umbrella(v);
    places[v.index()] - second * (1.0 / (1.0 + weight * share))
}

#[inline]
fn pushed(ellipsoids: &[Ellipsoid], p: Vec3) -> Vec3 {
    pushed_out(ellipsoids, p.as_dvec3()).as_vec3()
}

/// How far one more iteration would move the surface along its normals: the root of the mean square.
pub(super) fn unrest(mesh: &Mesh, ellipsoids: &[Ellipsoid], energy: Energy) -> f64 {
    let places = mesh.positions();
    let mut sum = 0.0;
    for v in mesh.vertices() {
        let way = pushed(ellipsoids, best(mesh, places, energy, v)) - mesh.position(v);
        let along = f64::from(way.dot(mesh.area_normal(v).normalize_or_zero()));
        sum += along * along;
    }
    (sum / mesh.vertex_count().max(1) as f64).sqrt()
}

/// Where the iterations of one level would take each vertex, by slot, without a change of connectivity. They end early where
/// one goes no further than `still`.
pub(super) fn relaxed(
    mesh: &Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    still: f64,
) -> Vec<Vec3> {
    let mut places = mesh.positions().to_vec();
    for _ in 0..params.smoothing {
        if sweep(mesh, &mut places, ellipsoids, params.energy) <= still {
            break;
        }
    }
    places
}

/// The place of each vertex, by slot, out of the ellipsoids.
pub(super) fn hold(mesh: &Mesh, ellipsoids: &[Ellipsoid]) -> Vec<Vec3> {
    mesh.positions().iter().map(|&p| pushed(ellipsoids, p)).collect()
}
