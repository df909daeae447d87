//! Validation of meshes passed in by the caller, shared by the methods that accept one.

use super::MethodError;
use crate::mesh::{
    CountInTime, Mesh, MeshError, TriangleMesh, count_in_time, count_self_intersections_in_slices, measure,
};
use crate::pauses::Pauses;

/// The smallest mean edge length accepted of a caller's mesh, in the units of its coordinates. With shorter edges,
/// areas in single precision are rounded to few digits, or to 0. The message of [`check_edges`] names it.
const MIN_MEAN_EDGE: f64 = 1e-12;

/// Converts a caller's mesh to a [`Mesh`] after checking that it has triangles, is a closed manifold, passes
/// [`check_edges`], faces outwards and does not intersect itself. `parameter` is the name used in errors.
pub(super) async fn checked_mesh(
    parameter: &'static str,
    mesh: &TriangleMesh,
    pauses: &Pauses,
) -> Result<Mesh, MethodError> {
    if mesh.triangles.is_empty() {
        return Err(MethodError::invalid(parameter, "the mesh is empty; it must be a closed surface"));
    }
    let surface = Mesh::from_triangles(mesh)?;
    pauses.now().await;
    check_edges(parameter, mesh)?;
    if measure(mesh).volume <= 0.0 {
        let problem = "the triangles face inwards; they must be counter-clockwise seen from outside";
        return Err(MethodError::invalid(parameter, problem));
    }
    pauses.now().await;
    match count_in_time(mesh, pauses).await {
        CountInTime { found: 0, is_complete: true } => Ok(surface),
        // Not all pairs were tested.
        CountInTime { found: 0, is_complete: false } => {
            match count_self_intersections_in_slices(mesh, pauses).await {
                0 => Ok(surface),
                pairs => Err(MeshError::SelfIntersecting { pairs }.into()),
            }
        }
        CountInTime { found: pairs, .. } => Err(MeshError::SelfIntersecting { pairs }.into()),
    }
}

/// Checks that the mean edge length of a caller's mesh is at least [`MIN_MEAN_EDGE`], long enough for computations in
/// single precision. `parameter` is the name used in errors.
pub(super) fn check_edges(parameter: &'static str, mesh: &TriangleMesh) -> Result<(), MethodError> {
    let edge = measure(mesh).edge_mean;
    if edge < MIN_MEAN_EDGE {
        let problem = "the mean edge length must be ≥ 1e-12: use a smaller unit of length";
        return Err(MethodError::invalid(parameter, problem));
    }
    Ok(())
}
