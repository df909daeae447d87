//! The membrane over the ellipsoids: umbrella iterations and pushes out of the ellipsoids, from coarse to fine
//! (Kobbelt, Bareuther & Seidel, section 5).

use super::ellipsoid::{Ellipsoid, pushed_out};
use super::params::{Energy, MultiresParams};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{Changes, EdgeBounds, Unchecked, restructure};

/// Longest edge of a coarse level of the solver, as a share of the shortest semi-axis of all ellipsoids: a much coarser
/// mesh would slip off the thinnest.
const MAX_EDGE_PER_AXIS: f64 = 0.8;

/// Tolerance of a refresh, and of each level of the solver finer than the coarsest, as a share of the level's target
/// edge: iterations end when the root mean square of their displacements is at most this. From there on vertices slide
/// along the surface, and a tenth of that motion is normal to it.
const LEVEL_TOLERANCE: f64 = 0.025;

/// Minimum number of vertices of a coarse level of the solver: fewer do not represent the shape.
const MIN_VERTICES: f64 = 60.0;

/// Solves the membrane over the ellipsoids on meshes from coarse to fine, with up to `levels` coarse levels before the
/// target resolution, which `mesh` has in the end. Returns the edits made.
///
/// Edits are made without collision tests; the caller checks the result for self-intersections.
pub(super) fn solve(
    mesh: &mut Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    levels: u32,
) -> Changes {
    solve_with(mesh, ellipsoids, params, levels, |_| {})
}

/// Solves the membrane as [`solve`] does, and calls `visit` with the mesh of each level when it is solved, to show it.
pub(super) fn solve_with(
    mesh: &mut Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    levels: u32,
    mut visit: impl FnMut(&Mesh),
) -> Changes {
    let mut changes = Changes::default();
    let bounds = params.bounds();
    let coarsest = coarsest(mesh, ellipsoids, params, levels);
    for level in (0..=coarsest).rev() {
        let coarser = libm::pow(params.refine_factor, -f64::from(level));
        // The coarsest level finds the shape; the finer ones only refine it.
        let tolerance = if level == coarsest { 0.0 } else { LEVEL_TOLERANCE * coarser * params.target() };
        changes += solve_level(mesh, ellipsoids, params, bounds.scaled(coarser as f32), tolerance);
        visit(mesh);
    }
    changes += finish(mesh, ellipsoids, bounds);
    changes
}

/// Refreshes a membrane that has nearly converged, on the target resolution only: restructures its edges and reduces
/// the small residual. Returns the edits made.
pub(super) fn refresh(mesh: &mut Mesh, ellipsoids: &[Ellipsoid], params: &MultiresParams) -> Changes {
    let bounds = params.bounds();
    let mut changes = solve_level(mesh, ellipsoids, params, bounds, LEVEL_TOLERANCE * params.target());
    changes += finish(mesh, ellipsoids, bounds);
    changes
}

/// Solves the membrane on one level: restructures the edges to `bounds`, and moves the vertices as [`relaxed`] does
/// with `tolerance`. Returns the edits made.
fn solve_level(
    mesh: &mut Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    bounds: EdgeBounds,
    tolerance: f64,
) -> Changes {
    let changes = restructure(mesh, bounds, &mut Unchecked);
    let positions = relaxed(mesh, ellipsoids, params, tolerance);
    mesh.positions_mut().copy_from_slice(&positions);
    changes
}

/// Restructures the edges after the last level, which leaves some too short or too long, and pushes new edge midpoints
/// out of the ellipsoids. Returns the edits made.
fn finish(mesh: &mut Mesh, ellipsoids: &[Ellipsoid], bounds: EdgeBounds) -> Changes {
    let changes = restructure(mesh, bounds, &mut Unchecked);
    let positions = pushed_positions(mesh, ellipsoids);
    mesh.positions_mut().copy_from_slice(&positions);
    changes
}

/// Returns the coarsest usable level of the solver, at most `levels`: its edges are short enough for the thinnest
/// ellipsoid, and it has at least about [`MIN_VERTICES`] vertices. Level 0 is the target resolution.
fn coarsest(mesh: &Mesh, ellipsoids: &[Ellipsoid], params: &MultiresParams, levels: u32) -> u32 {
    let thinnest = ellipsoids.iter().map(Ellipsoid::shortest_axis).fold(f64::MAX, f64::min);
    let fits = |level: u32| {
        let coarser = libm::pow(params.refine_factor, -f64::from(level));
        let vertices = mesh.vertex_count() as f64 / (coarser * coarser);
        params.edge_max * coarser <= MAX_EDGE_PER_AXIS * thinnest && vertices >= MIN_VERTICES
    };
    (0..=levels).rev().find(|&level| level == 0 || fits(level)).unwrap_or(0)
}

/// Performs one Gauss–Seidel iteration on `positions`, by slot: moves every vertex to its energy minimum with all
/// others fixed, then out of the ellipsoids. Returns the root mean square of the displacements, in units of the mesh.
fn sweep(mesh: &Mesh, positions: &mut [Vec3], ellipsoids: &[Ellipsoid], energy: Energy) -> f64 {
    let mut sum = 0.0;
    for v in mesh.vertices() {
        let position = pushed(ellipsoids, minimiser(mesh, positions, energy, v));
        sum += f64::from(position.distance_squared(positions[v.index()]));
        positions[v.index()] = position;
    }
    (sum / mesh.vertex_count().max(1) as f64).sqrt()
}

/// Returns the position of vertex `v` with the least energy, with all other vertices fixed at `positions`: for
/// [`Energy::Membrane`] the mean of its neighbours, by the umbrella operator p ← Σ pᵢ / n (Kobbelt, Bareuther & Seidel,
/// equation 2).
fn minimiser(mesh: &Mesh, positions: &[Vec3], energy: Energy, v: VertexId) -> Vec3 {
    match energy {
        Energy::Membrane => mesh.ring(v).mean(positions),
        Energy::ThinPlate => min_bending_position(mesh, positions, v),
    }
}

/// Returns the position of `v` with the least bending energy, all others fixed, for [`Energy::ThinPlate`]: p ← p −
/// U²(p) / ν, with U(p) = Σ pᵢ / n − p, U²(p) = Σ U(pᵢ) / n − U(p), and ν = 1 + (Σ 1/nᵢ) / n, where n is the number of
/// neighbours pᵢ of p, and nᵢ that of pᵢ (Kobbelt et al., *Interactive multi-resolution modeling on arbitrary meshes*,
/// 1998).
fn min_bending_position(mesh: &Mesh, positions: &[Vec3], v: VertexId) -> Vec3 {
    let umbrella = |w: VertexId| mesh.ring(w).mean(positions) - positions[w.index()];
    let ring = mesh.ring(v).as_slice();
    let share = 1.0 / ring.len() as f32;
    let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
    for &w in ring {
        sum += umbrella(w);
        weight += 1.0 / mesh.ring(w).valence() as f32;
    }
    let second = sum * share - umbrella(v);
    positions[v.index()] - second * (1.0 / (1.0 + weight * share))
}

#[inline]
fn pushed(ellipsoids: &[Ellipsoid], p: Vec3) -> Vec3 {
    pushed_out(ellipsoids, p.as_dvec3()).as_vec3()
}

/// Returns the residual of a membrane, in units of the mesh: the root mean square of the displacements along the
/// normals that one more iteration would make, each with all other vertices fixed.
pub(super) fn residual(mesh: &Mesh, ellipsoids: &[Ellipsoid], energy: Energy) -> f64 {
    let positions = mesh.positions();
    let mut sum = 0.0;
    for v in mesh.vertices() {
        let displacement = pushed(ellipsoids, minimiser(mesh, positions, energy, v)) - mesh.position(v);
        let along = f64::from(displacement.dot(mesh.unit_normal(v)));
        sum += along * along;
    }
    (sum / mesh.vertex_count().max(1) as f64).sqrt()
}

/// Returns the positions, by slot, after the iterations on one level of the solver, without changes of connectivity:
/// [`MultiresParams::smoothing`] iterations, or fewer if the root mean square of the displacements of one is at most
/// `tolerance`, in units of the mesh.
pub(super) fn relaxed(
    mesh: &Mesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    tolerance: f64,
) -> Vec<Vec3> {
    let mut positions = mesh.positions().to_vec();
    for _ in 0..params.smoothing {
        if sweep(mesh, &mut positions, ellipsoids, params.energy) <= tolerance {
            break;
        }
    }
    positions
}

/// Returns the positions of all vertices, by slot, with those inside an ellipsoid moved out of all ellipsoids.
pub(super) fn pushed_positions(mesh: &Mesh, ellipsoids: &[Ellipsoid]) -> Vec<Vec3> {
    mesh.positions().iter().map(|&p| pushed(ellipsoids, p)).collect()
}
