//! Makes a base where none is given: the detailed surface is smoothed towards the ellipsoids as long as it remains a
//! graph over the result (end of section 2); without detail, a membrane is built around the ellipsoids.

use super::REST;
use super::detail::{Band, MOST_BANDS, reach};
use super::ellipsoid::Ellipsoid;
use super::link::{Linked, normal_at};
use super::membrane::{settle, unrest};
use super::params::MultiresParams;
use crate::math::{DVec3, Vec3};
use crate::mesh::{Mesh, MeshError, TriangleMesh};
use crate::methods::MethodError;
use crate::remesh::{Embedding, Unchecked, restructure};
use crate::spatial::SurfacePoint;
use crate::volume::{Lattice, SurfaceExtractor};
use std::rc::Rc;

/// Maximum number of smoothing rounds of a decomposition; a bust settles in twelve.
const ROUNDS: usize = 40;

/// Largest share of normals of a coarser surface that may miss the finer one or hit it from its back: undercuts of ears
/// and nostrils account for some.
const MOST_STRAY: f64 = 0.02;

/// Decomposes `detail` into surfaces from coarse to fine, the base first and `detail` last. Each is a graph over the
/// one before, except for up to [`MOST_STRAY`] of its normals.
///
/// # Errors
/// [`MethodError::InvalidArgument`] if no smoother surface has `detail` as a graph over it; [`MethodError::Mesh`].
pub(super) fn decomposition(
    detail: TriangleMesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
) -> Result<Vec<Rc<Band>>, MethodError> {
    let mut mesh = Mesh::from_triangles(&detail)?;
    let mut bands = vec![Band::of(detail)?];
    restructure(&mut mesh, params.bounds(), &mut Unchecked);
    let mut last_good = None;
    for round in 0..ROUNDS {
        let softly = MultiresParams { smoothing: 1 + round as u32 / 2, ..params.clone() };
        settle(&mut mesh, ellipsoids, &softly, params.levels.min(round as u32 / 4));
        let candidate = Band::of(mesh.to_triangles())?;
        let is_graph = is_embedded(&mesh) && strays(&candidate, &bands) <= MOST_STRAY;
        if is_graph {
            let settled = unrest(&mesh, ellipsoids, params.energy) <= REST * params.target();
            last_good = Some((candidate, mesh.clone()));
            if settled {
                break;
            }
            continue;
        }
        // The last surface with a graph over it becomes a band of its own, and smoothing continues from it.
        match last_good.take() {
            Some((band, before)) if bands.len() < MOST_BANDS => {
                bands.push(band);
                mesh = before;
            }
            _ => break,
        }
    }
    match last_good {
        Some((band, _)) => bands.push(band),
        None if bands.len() == 1 => return Err(no_base()),
        None => {}
    }
    bands.reverse();
    Ok(bands)
}

fn no_base() -> MethodError {
    MethodError::invalid(
        "detail",
        "no smoother surface could be made of it that its own normals lead back from: give a `base`, or shorter edges",
    )
}

fn is_embedded(mesh: &Mesh) -> bool {
    let mut guard = Embedding::default();
    guard.sync_with_edge(mesh, super::usual_edge(mesh));
    guard.is_embedded(mesh)
}

/// Returns the share of triangles of `coarse` whose normal at the centroid misses the last of `bands` or hits it from
/// its back.
fn strays(coarse: &Rc<Band>, bands: &[Rc<Band>]) -> f64 {
    let Some(fine) = bands.last() else { return 0.0 };
    let reach = reach(coarse, fine);
    let count = coarse.walker.mesh().positions.len();
    let stray = (0..coarse.walker.mesh().triangles.len()).filter(|&t| {
        let third = Vec3::splat(1.0 / 3.0);
        let [a, b, c] = coarse.walker.corners(t as u32);
        let at = Linked { triangle: t as u32, weights: third, point: (a + b + c) * third };
        let outward = normal_at(&coarse.walker, &coarse.normals, &at);
        let met = fine.walker.tree().line_hit(at.point, outward, reach);
        let faces_back = |found: SurfacePoint| {
            normal_at(&fine.walker, &fine.normals, &found.into()).dot((b - a).cross(c - a)) <= 0.0
        };
        met.is_none_or(faces_back)
    });
    stray.count() as f64 / (2 * count).max(1) as f64
}

/// Builds a membrane around the ellipsoids, for a model without detail: solved if the result has no self-intersections,
/// otherwise the union of the ellipsoids.
pub(super) fn skin(ellipsoids: &[Ellipsoid], params: &MultiresParams) -> Result<TriangleMesh, MethodError> {
    let tight = union_of(ellipsoids, params.target())?;
    let mut mesh = Mesh::from_triangles(&tight)?;
    settle(&mut mesh, ellipsoids, params, params.levels);
    Ok(if is_embedded(&mesh) { mesh.to_triangles() } else { tight })
}

/// Returns the surface of the union of the ellipsoids, with edges of about `edge`, shorter for thin ellipsoids.
fn union_of(ellipsoids: &[Ellipsoid], edge: f64) -> Result<TriangleMesh, MethodError> {
    let middle = ellipsoids.iter().map(|e| e.center).sum::<DVec3>() / ellipsoids.len() as f64;
    let thinnest = ellipsoids.iter().map(Ellipsoid::thinnest).fold(f64::MAX, f64::min);
    let cell = edge.min(CELL * thinnest);
    let reach = |e: &Ellipsoid| e.center.distance(middle) + e.lengths.max_element();
    let radius = ellipsoids.iter().map(reach).fold(0.0, f64::max) + 2.0 * cell;
    let nodes = (2.0 * radius / cell).ceil() + 1.0;
    if nodes > MOST_NODES {
        let problem = format!(
            "they span {} and are {thinnest} thin: {MOST_NODES} edges across are accepted; make edgeMax longer or the thinnest thicker",
            2.0 * radius
        );
        return Err(MethodError::invalid("ellipsoids", problem));
    }
    let lattice = Lattice { origin: DVec3::splat(-radius), edge: cell, dims: [nodes as usize; 3] };
    let mut follower = SurfaceExtractor::new(lattice)?;
    for e in ellipsoids {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            follower.seed(e.at_unit(axis) - middle);
            follower.seed(e.at_unit(-axis) - middle);
        }
    }
    let inside = |p: &DVec3| {
        let depth = |e: &Ellipsoid| (1.0 - e.unit(*p + middle).length()) * e.thinnest();
        ellipsoids.iter().map(depth).fold(f64::MIN, f64::max)
    };
    let mut values = |points: &[DVec3], values: &mut [f64]| {
        values.iter_mut().zip(points).for_each(|(value, p)| *value = inside(p));
    };
    follower.refine(2);
    while !follower.advance(usize::MAX, &mut values)? {}
    let mut mesh = follower.mesh()?;
    mesh.positions.iter_mut().for_each(|p| *p = (p.as_dvec3() + middle).as_vec3());
    Ok(mesh)
}

/// Longest edge of a lattice cell, as a share of the shortest semi-axis of all ellipsoids.
const CELL: f64 = 0.4;

/// Maximum number of lattice nodes along an axis: a surface across the whole lattice then has some ten million
/// triangles.
const MOST_NODES: f64 = 1024.0;

/// Returns the edge length of equilateral triangles of which `triangles` have the total area `area`.
pub(super) fn edge_for(area: f64, triangles: f64) -> f64 {
    (area / triangles * 4.0 / 3.0_f64.sqrt()).sqrt()
}

/// Checks that a mesh has no self-intersections.
///
/// # Errors
/// [`MeshError::SelfIntersecting`] with the number of crossing pairs of triangles.
pub(super) fn check_embedded(mesh: &TriangleMesh) -> Result<(), MeshError> {
    match crate::mesh::count_self_intersections(mesh) {
        0 => Ok(()),
        pairs => Err(MeshError::SelfIntersecting { pairs }),
    }
}
