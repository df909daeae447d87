//! The mesh to begin with: the caller's, or that of the first frame (section 4.1).

use super::first::bright_surface;
use super::region::Region;
use super::{Component, SurfaceTracker};
use crate::math::{Vec3, triangle};
use crate::mesh::{Mesh, TriangleMesh, measure};
use crate::methods::MethodError;
use crate::methods::given::surface;
use crate::remesh::{EdgeBounds, remesh};

/// Edges of the first frame's mesh, in the shortest side of a voxel.
const EDGE: f64 = 1.2;

/// Their bounds, in that length.
const EDGE_SPREAD: f32 = 1.5;

/// The mean edge of a mesh of the caller's, in that length, at least: edges stay as long as they are, and with shorter ones
/// a surface as large as the image has more triangles than there is memory for.
const FINEST: f64 = 0.1;

/// A mesh of the caller's, as it is.
pub(super) fn checked(start: &TriangleMesh, region: &Region) -> Result<Mesh, MethodError> {
    let mesh = surface("start", start)?;
    let (edge, least) = (measure(start).edge_mean, FINEST * region.spacing.min_element());
    if edge < least {
        let problem = format!(
            "its edges are {edge:.1e} long in the mean; a tenth of a voxel, {least:.1e}, or more is accepted"
        );
        return Err(MethodError::invalid("start", problem));
    }
    if start.positions.iter().all(|&p| region.nearest_inside(region.place(p)).is_some()) {
        let problem =
            "no vertex of the mesh is in the box; a surface of the first frame, in the world, is needed";
        return Err(MethodError::invalid("start", problem));
    }
    Ok(mesh)
}

impl SurfaceTracker {
    /// The mesh to begin with, in the world, where none was given.
    pub(super) fn find_first_mesh(&mut self) -> Result<(), MethodError> {
        if self.faces.iter().flatten().all(Vec::is_empty) {
            let largest = self.voting.largest_step(&self.region) * self.region.step;
            let problem = format!(
                "{} given, no boundary found: the largest step in the box is {largest:.4}; less than that is needed",
                self.params.threshold
            );
            return Err(MethodError::invalid("threshold", problem));
        }
        if self.mesh.vertex_count() > 0 {
            return Ok(());
        }
        let surface = bright_surface(&self.region, &self.faces[0], self.falloff())?;
        let Some(part) = self.chosen(surface.components()) else {
            let problem =
                "no closed surface is in the first frame; choose a larger box, or a lower threshold";
            return Err(MethodError::invalid("box", problem));
        };
        let mut mesh = Mesh::from_triangles(&part)?;
        let edge = (EDGE * self.region.spacing.min_element()) as f32;
        remesh(&mut mesh, EdgeBounds { min: edge / EDGE_SPREAD, max: edge * EDGE_SPREAD })?;
        self.mesh = mesh;
        Ok(())
    }

    /// The part that is followed. Holes in others are none.
    fn chosen(&self, parts: Vec<TriangleMesh>) -> Option<TriangleMesh> {
        let with_volume = parts.into_iter().map(|part| (measure(&part).volume, part));
        let solids = with_volume.filter(|(volume, _)| *volume > 0.0);
        let scored = solids.map(|(volume, part)| match self.component {
            Component::Largest => (-volume, part),
            Component::Nearest(p) => (distance(&part, p.as_vec3()), part),
        });
        scored.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, part)| part)
    }
}

/// Of a point from a solid: 0 inside, else that from its nearest vertex.
fn distance(part: &TriangleMesh, p: Vec3) -> f64 {
    let angle: f64 = part.corners().map(|corners| triangle::solid_angle(corners, p)).sum();
    if angle.abs() > std::f64::consts::TAU {
        return 0.0;
    }
    part.positions.iter().map(|q| f64::from(q.distance(p))).fold(f64::INFINITY, f64::min)
}
