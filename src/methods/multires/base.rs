//! Makes the base M₀ of a model that is created without one: the detailed surface is smoothed towards the ellipsoids as
//! long as it can be described by distances along the normals of the result (Kobbelt, Bareuther & Seidel, end of
//! section 2); without a detailed surface, a membrane is built around the ellipsoids.

use super::TOLERANCE;
use super::correspondence::{BasePoint, normal_at};
use super::detail::{Band, MAX_BANDS, search_distance};
use super::ellipsoid::Ellipsoid;
use super::membrane::{residual, solve};
use super::params::MultiresParams;
use crate::math::{DVec3, Vec3};
use crate::mesh::{Mesh, MeshError, TriangleMesh};
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::remesh::{Embedding, Unchecked, restructure_in_slices};
use crate::spatial::SurfacePoint;
use crate::volume::{Lattice, SurfaceExtractor};
use std::rc::Rc;

/// Maximum number of smoothing rounds in [`decomposition`]; a bust converges in twelve.
const ROUNDS: usize = 40;

/// Largest share of the normals of a coarser surface that may miss the next finer one or hit its back, for
/// [`decomposition`] to accept the coarser one: undercuts of ears and nostrils account for some.
const MAX_MISSED: f64 = 0.02;

/// Decomposes `detail`, the detailed surface of a model without a given base, into surfaces from coarse to fine, the
/// base first and `detail` last, by smoothing it over the ellipsoids. Each surface but the base is a graph over the
/// next coarser one: the normals of the coarser one hit it from its inside, except for a share of up to [`MAX_MISSED`]
/// of them.
///
/// # Errors
/// [`MethodError::InvalidArgument`] if no smoother surface has `detail` as a graph over it; [`MethodError::Mesh`] if
/// `detail` is not a closed manifold.
pub(super) async fn decomposition(
    detail: TriangleMesh,
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    pauses: &Pauses,
) -> Result<Vec<Rc<Band>>, MethodError> {
    let mut mesh = Mesh::from_triangles(&detail)?;
    pauses.now().await;
    let mut bands = vec![Band::of(detail)?];
    pauses.now().await;
    restructure_in_slices(&mut mesh, params.bounds(), &mut Unchecked, pauses).await;
    let mut last_good = None;
    for round in 0..ROUNDS {
        let round_params = MultiresParams { smoothing: 1 + round as u32 / 2, ..params.clone() };
        pauses.now().await;
        solve(&mut mesh, ellipsoids, &round_params, params.levels.min(round as u32 / 4));
        pauses.now().await;
        let candidate = Band::of(mesh.to_triangles())?;
        let is_graph =
            is_embedded(&mesh, pauses).await && missed_share(&candidate, &bands, pauses).await <= MAX_MISSED;
        if is_graph {
            let has_converged = residual(&mesh, ellipsoids, params.energy) <= TOLERANCE * params.target();
            last_good = Some((candidate, mesh.clone()));
            if has_converged {
                break;
            }
            continue;
        }
        // The last surface with a graph over it becomes a band of its own, and smoothing continues from it.
        match last_good.take() {
            Some((band, before)) if bands.len() < MAX_BANDS => {
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
        "no smooth base found with the detail as a graph over it: give a `base`, or use shorter edges",
    )
}

async fn is_embedded(mesh: &Mesh, pauses: &Pauses) -> bool {
    let mut guard = Embedding::default();
    guard.sync_with_edge(mesh, super::typical_edge(mesh));
    guard.intersecting_vertices_in_slices(mesh, pauses).await.is_empty()
}

/// Returns the share of the triangles of `coarse` whose normal at the centroid misses the next finer surface, the last
/// of `bands`, or hits its back: above [`MAX_MISSED`], `coarse` is too smooth.
async fn missed_share(coarse: &Rc<Band>, bands: &[Rc<Band>], pauses: &Pauses) -> f64 {
    let Some(fine) = bands.last() else { return 0.0 };
    let search_distance = search_distance(coarse, fine, pauses).await;
    let count = coarse.walker.mesh().positions.len();
    let is_missed = |t: usize| {
        let third = Vec3::splat(1.0 / 3.0);
        let [a, b, c] = coarse.walker.corners(t as u32);
        let at = BasePoint { triangle: t as u32, weights: third, point: (a + b + c) * third };
        let outward = normal_at(&coarse.walker, &coarse.normals, &at);
        let hit = fine.walker.tree().line_hit(at.point, outward, search_distance);
        let faces_back = |found: SurfacePoint| {
            normal_at(&fine.walker, &fine.normals, &found.into()).dot((b - a).cross(c - a)) <= 0.0
        };
        hit.is_none_or(faces_back)
    };
    let mut missed = 0;
    for t in 0..coarse.walker.mesh().triangles.len() {
        missed += usize::from(is_missed(t));
        pauses.after(1).await;
    }
    missed as f64 / (2 * count).max(1) as f64
}

/// Builds the base of a model without detail: the surface of the union of the ellipsoids, tightened to a membrane
/// unless that would intersect itself.
///
/// # Errors
/// [`MethodError::InvalidArgument`] if the lattice of [`union_of`] would have more than [`MAX_NODES`] nodes along an
/// axis.
pub(super) async fn membrane_around(
    ellipsoids: &[Ellipsoid],
    params: &MultiresParams,
    pauses: &Pauses,
) -> Result<TriangleMesh, MethodError> {
    let tight = union_of(ellipsoids, params.target())?;
    pauses.now().await;
    let mut mesh = Mesh::from_triangles(&tight)?;
    solve(&mut mesh, ellipsoids, params, params.levels);
    pauses.now().await;
    Ok(if is_embedded(&mesh, pauses).await { mesh.to_triangles() } else { tight })
}

/// Returns the surface of the union of the ellipsoids, from which [`membrane_around`] starts, with edges of about
/// `edge`, in units of the mesh, shorter for thin ellipsoids.
fn union_of(ellipsoids: &[Ellipsoid], edge: f64) -> Result<TriangleMesh, MethodError> {
    let centre = ellipsoids.iter().map(|e| e.center).sum::<DVec3>() / ellipsoids.len() as f64;
    let shortest_axis = ellipsoids.iter().map(Ellipsoid::shortest_axis).fold(f64::MAX, f64::min);
    let cell = edge.min(CELL * shortest_axis);
    let extent = |e: &Ellipsoid| e.center.distance(centre) + e.lengths.max_element();
    let radius = ellipsoids.iter().map(extent).fold(0.0, f64::max) + 2.0 * cell;
    let nodes = (2.0 * radius / cell).ceil() + 1.0;
    if nodes > MAX_NODES {
        let problem = format!(
            "they span {} with a shortest axis of {shortest_axis}: at most {MAX_NODES} edges across are supported; increase edgeMax or the shortest axis",
            2.0 * radius
        );
        return Err(MethodError::invalid("ellipsoids", problem));
    }
    let lattice = Lattice { origin: DVec3::splat(-radius), edge: cell, dims: [nodes as usize; 3] };
    let mut extractor = SurfaceExtractor::new(lattice)?;
    for e in ellipsoids {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            extractor.seed(e.at_unit(axis) - centre);
            extractor.seed(e.at_unit(-axis) - centre);
        }
    }
    let inside = |p: &DVec3| {
        let depth = |e: &Ellipsoid| (1.0 - e.unit(*p + centre).length()) * e.shortest_axis();
        ellipsoids.iter().map(depth).fold(f64::MIN, f64::max)
    };
    let mut values = |points: &[DVec3], values: &mut [f64]| {
        values.iter_mut().zip(points).for_each(|(value, p)| *value = inside(p));
    };
    extractor.refine(2);
    while !extractor.advance(usize::MAX, &mut values)? {}
    let mut mesh = extractor.mesh()?;
    mesh.positions.iter_mut().for_each(|p| *p = (p.as_dvec3() + centre).as_vec3());
    Ok(mesh)
}

/// Longest edge of a lattice cell in [`union_of`], as a share of the shortest semi-axis of all ellipsoids, so that the
/// lattice resolves the thinnest.
const CELL: f64 = 0.4;

/// Maximum number of lattice nodes along an axis in [`union_of`]: a surface across the whole lattice then has some ten
/// million triangles.
const MAX_NODES: f64 = 1024.0;

/// Returns the edge length of equilateral triangles of which `triangles` have the total area `area`; default edge
/// bounds are derived from it.
pub(super) fn edge_for(area: f64, triangles: f64) -> f64 {
    (area / triangles * 4.0 / 3.0_f64.sqrt()).sqrt()
}

/// Checks that a mesh, such as a base passed by the caller, has no self-intersections.
///
/// # Errors
/// [`MeshError::SelfIntersecting`] with the number of crossing pairs of triangles.
pub(super) fn check_embedded(mesh: &TriangleMesh) -> Result<(), MeshError> {
    match crate::mesh::count_self_intersections(mesh) {
        0 => Ok(()),
        pairs => Err(MeshError::SelfIntersecting { pairs }),
    }
}
