//! What is asked of a mesh of the caller's, whatever a method does with it.

use super::MethodError;
use crate::mesh::{Mesh, MeshError, TriangleMesh, count_crossings, measure};

/// With shorter edges in the mean, what is reckoned of areas is rounded to few digits in single precision, or to 0.
const SHORTEST: f64 = 1e-12;

/// The mesh as a surface to begin with: closed, its front outside, and not crossing itself.
pub(super) fn surface(parameter: &'static str, mesh: &TriangleMesh) -> Result<Mesh, MethodError> {
    if mesh.triangles.is_empty() {
        return Err(MethodError::invalid(parameter, "the mesh is empty; a closed surface is needed"));
    }
    let surface = Mesh::from_triangles(mesh)?;
    check_edges(parameter, mesh)?;
    if measure(mesh).volume <= 0.0 {
        let problem = "the triangles face inwards; counter-clockwise seen from outside is needed";
        return Err(MethodError::invalid(parameter, problem));
    }
    match count_crossings(mesh) {
        0 => Ok(surface),
        pairs => Err(MeshError::SelfIntersecting { pairs }.into()),
    }
}

/// Tests that edges are long enough to reckon with.
pub(super) fn check_edges(parameter: &'static str, mesh: &TriangleMesh) -> Result<(), MethodError> {
    let edge = measure(mesh).edge_mean;
    if edge < SHORTEST {
        let problem =
            format!("its edges are {edge:.1e} long in the mean; {SHORTEST:e} and more are accepted");
        return Err(MethodError::invalid(parameter, problem));
    }
    Ok(())
}
