//! The mesh to begin with: the caller's, or that of the first frame (section 4.1).

use super::first::bright_surface;
use super::{Component, SurfaceTracker};
use crate::mesh::{Mesh, MeshError, TriangleMesh, VertexId, count_crossings, measure};
use crate::methods::MethodError;
use crate::remesh::{EdgeBounds, remesh};

/// Edges of the first frame's mesh, in the shortest side of a voxel.
const EDGE: f64 = 1.2;

/// Their bounds, in that length.
const EDGE_SPREAD: f32 = 1.5;

/// A mesh of the caller's, as it is.
pub(super) fn checked(start: &TriangleMesh) -> Result<Mesh, MethodError> {
    if start.triangles.is_empty() {
        return Err(MethodError::invalid("start", "the mesh is empty; a closed surface is needed"));
    }
    let mesh = Mesh::from_triangles(start)?;
    if measure(start).volume <= 0.0 {
        let problem = "the triangles face inwards; counter-clockwise seen from outside is needed";
        return Err(MethodError::invalid("start", problem));
    }
    match count_crossings(start) {
        0 => Ok(mesh),
        pairs => Err(MeshError::SelfIntersecting { pairs }.into()),
    }
}

impl SurfaceTracker {
    /// The mesh to begin with, in the world, where none was given.
    pub(super) fn find_first_mesh(&mut self) -> Result<(), MethodError> {
        if self.mesh.vertex_count() > 0 {
            return Ok(());
        }
        if self.faces.iter().flatten().all(Vec::is_empty) {
            let largest = self.voting.largest_refused * self.region.step;
            let problem = format!(
                "{} given, no boundary found: the largest step in the box is {largest:.4}; less than that is needed",
                self.params.threshold
            );
            return Err(MethodError::invalid("threshold", problem));
        }
        let levels = self.voting.levels(&self.region, 0);
        let surface = bright_surface(&self.region, &self.faces[0], &levels, self.falloff())?;
        if surface.triangles.is_empty() {
            let problem = "no surface is in the first frame; choose a larger box, or a lower threshold";
            return Err(MethodError::invalid("box", problem));
        }
        let mut mesh = Mesh::from_triangles(&surface)?;
        self.keep_component(&mut mesh);
        let edge = (EDGE * self.region.spacing.min_element()) as f32;
        remesh(&mut mesh, EdgeBounds { min: edge / EDGE_SPREAD, max: edge * EDGE_SPREAD })?;
        self.mesh = mesh;
        Ok(())
    }

    /// Removes all components but the one that is followed.
    fn keep_component(&self, mesh: &mut Mesh) {
        let mut left: Vec<VertexId> = mesh.vertices().collect();
        let mut parts: Vec<(VertexId, f64)> = Vec::new();
        while let Some(&first) = left.first() {
            let members = mesh.component_of(first, usize::MAX);
            let score = match self.component {
                Component::Largest => -(members.len() as f64),
                Component::Nearest(p) => {
                    let away = |v: &VertexId| mesh.position(*v).as_dvec3().distance(p);
                    members.iter().map(away).fold(f64::INFINITY, f64::min)
                }
            };
            parts.push((first, score));
            let mut is_member = vec![false; mesh.slots()];
            members.iter().for_each(|v| is_member[v.index()] = true);
            left.retain(|v| !is_member[v.index()]);
        }
        let best = parts.iter().map(|part| part.1).fold(f64::INFINITY, f64::min);
        let kept = parts.iter().position(|part| part.1 == best);
        for (k, (v, _)) in parts.iter().enumerate() {
            if Some(k) != kept {
                mesh.remove_component(*v);
            }
        }
    }
}
