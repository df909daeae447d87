//! Validates the input of a new model, and prepares its decomposition into surfaces and its parameters.

use super::base::{check_embedded, decomposition, edge_for, membrane_around};
use super::correspondence::{BasePoint, UNSET};
use super::detail::Band;
use super::ellipsoid::{Ellipsoid, check_tips};
use super::{MAX_VERTICES, MultiresParams};
use crate::math::{DVec3, Vec3};
use crate::mesh::{Mesh, TriangleMesh, measure};
use crate::methods::MethodError;
use crate::methods::caller_mesh::check_edges;
use crate::pauses::Pauses;
use crate::spatial::SurfaceWalker;
use std::rc::Rc;

/// Number of triangles of the base if the caller gives no edge bounds: the "moderately complex models" of Kobbelt,
/// Bareuther & Seidel.
const DEFAULT_TRIANGLES: f64 = 10_000.0;

/// Validates the input of a new model. Returns the surfaces of its decomposition from coarse to fine, and the
/// parameters with edge bounds of 0 replaced by defaults.
///
/// # Errors
/// [`MethodError::Mesh`] and [`MethodError::InvalidArgument`] for surfaces, ellipsoids or parameters that are not
/// accepted; [`MethodError::TooManyVertices`] for edge bounds that are too short.
pub(super) async fn set_up(
    detail: Option<TriangleMesh>,
    base: Option<TriangleMesh>,
    ellipsoids: &[Ellipsoid],
    params: MultiresParams,
    pauses: &Pauses,
) -> Result<(Vec<Rc<Band>>, MultiresParams), MethodError> {
    let sized = |area: f64| {
        let params = params.clone().with_target(edge_for(area, DEFAULT_TRIANGLES));
        params.validate()?;
        check_tips(ellipsoids, params.edge_max)?;
        check_size(area, &params).map(|()| params)
    };
    let bands = match (detail, base) {
        (detail, Some(base)) => {
            let base = validate_closed("base", base, pauses).await?;
            pauses.now().await;
            check_embedded(&base)?;
            pauses.now().await;
            let params = sized(measure(&base).area)?;
            let mut bands = vec![Band::of(base)?];
            if let Some(detail) = detail {
                bands.push(Band::of(validate_closed("detail", detail, pauses).await?)?);
            }
            (bands, params)
        }
        (Some(detail), None) => {
            let detail = validate_closed("detail", detail, pauses).await?;
            let params = sized(measure(&detail).area)?;
            pauses.now().await;
            (decomposition(detail, ellipsoids, &params, pauses).await?, params)
        }
        (None, None) => {
            let ball = |e: &Ellipsoid| 4.0 * std::f64::consts::PI * e.lengths.length_squared() / 3.0;
            let params = sized(ellipsoids.iter().map(ball).sum())?;
            (vec![Band::of(membrane_around(ellipsoids, &params, pauses).await?)?], params)
        }
    };
    check_touching(ellipsoids, &bands.0[0].walker, bands.1.target())?;
    Ok(bands)
}

/// Validates a surface that is to hold itself, and pauses meanwhile. Returns it, and the parameters with edge bounds of 0 replaced by defaults.
///
/// # Errors
/// As [`set_up`].
pub(super) async fn set_up_surface(
    detail: TriangleMesh,
    params: MultiresParams,
    pauses: &Pauses,
) -> Result<(Rc<Band>, MultiresParams), MethodError> {
    // As it is, with the order of its vertices, unless vertices have to be merged first.
    let is_closed =
        Mesh::from_triangles(&detail).is_ok_and(|mesh| mesh.vertex_count() == detail.positions.len());
    let detail = if is_closed { detail } else { validate_closed("detail", detail, pauses).await? };
    pauses.now().await;
    check_edges("detail", &detail)?;
    let area = measure(&detail).area;
    let params = params.with_target(edge_for(area, DEFAULT_TRIANGLES));
    params.validate()?;
    check_size(area, &params)?;
    pauses.now().await;
    let band = Band::of(detail)?;
    pauses.now().await;
    band.walker.build_tree(pauses).await;
    Ok((band, params))
}

/// The error for a surface that is to hold itself, but is given with a base, or not at all.
pub(super) fn cannot_hold_itself(has_base: bool) -> MethodError {
    let problem =
        if has_base { "\"surface\" needs no base, got one" } else { "\"surface\" needs a detail, got none" };
    MethodError::invalid("support", problem)
}

/// The error for a surface in which no ball fits that could be proposed.
pub(super) fn has_no_inside(surface: &Band) -> MethodError {
    let problem = if measure(surface.walker.mesh()).volume < 0.0 {
        "is inside out: its triangles are clockwise as seen from outside; exchange two corners of each"
    } else {
        "no ball that could be proposed fits inside: give ellipsoids"
    };
    MethodError::invalid("detail", problem)
}

/// Returns a mesh with vertices at the same position merged, see [`TriangleMesh::welded`], after checking that it is
/// closed and manifold, and its edges not too short.
///
/// # Errors
/// [`MethodError::Mesh`] if it is invalid, open or not manifold; [`MethodError::InvalidArgument`] naming `parameter` if
/// its edges are too short.
async fn validate_closed(
    parameter: &'static str,
    mesh: TriangleMesh,
    pauses: &Pauses,
) -> Result<TriangleMesh, MethodError> {
    mesh.validate()?;
    pauses.now().await;
    let mesh = mesh.welded();
    pauses.now().await;
    Mesh::from_triangles(&mesh)?;
    pauses.now().await;
    check_edges(parameter, &mesh)?;
    Ok(mesh)
}

/// Checks that at least one ellipsoid contains a vertex of the base, or is within a target edge length of one:
/// otherwise nothing would hold the membrane.
///
/// # Errors
/// [`MethodError::InvalidArgument`] naming `ellipsoids`.
fn check_touching(ellipsoids: &[Ellipsoid], base: &SurfaceWalker, target: f64) -> Result<(), MethodError> {
    let near = |p: &Vec3| {
        let p: DVec3 = p.as_dvec3();
        ellipsoids.iter().any(|e| e.unit(p).length_squared() <= 1.0 || e.nearest(p).distance(p) <= target)
    };
    if base.mesh().positions.iter().any(near) {
        return Ok(());
    }
    Err(MethodError::invalid("ellipsoids", "at least one must touch the base"))
}

/// Checks that a surface of the given area, in squared units of the mesh, has at most [`MAX_VERTICES`] vertices at the
/// target edge length.
///
/// # Errors
/// [`MethodError::TooManyVertices`] otherwise.
pub(super) fn check_size(area: f64, params: &MultiresParams) -> Result<(), MethodError> {
    let triangle = 0.25 * 3.0_f64.sqrt() * params.target() * params.target();
    if area / triangle <= 2.0 * MAX_VERTICES as f64 {
        return Ok(());
    }
    Err(MethodError::TooManyVertices { most: MAX_VERTICES })
}

/// Returns the identity map from the base M₀ to itself, from which the initial map T is projected: the base point of
/// each vertex is the vertex.
pub(super) fn identity(walker: &SurfaceWalker) -> Vec<BasePoint> {
    let mut correspondence = vec![UNSET; walker.mesh().positions.len()];
    for (t, corners) in walker.mesh().triangles.iter().enumerate() {
        for (k, &v) in corners.iter().enumerate() {
            let mut weights = Vec3::ZERO;
            weights[k] = 1.0;
            correspondence[v as usize] =
                BasePoint { triangle: t as u32, weights, point: walker.mesh().positions[v as usize] };
        }
    }
    correspondence
}
