//! The initial mesh of tracking: the caller's, or the surface extracted from the first frame (section 4.1 of the paper
//! that `tracking` follows).

use super::first::extract_bright_surface;
use super::region::Region;
use super::{Component, SurfaceTracker};
use crate::math::{Vec3, triangle};
use crate::mesh::{Mesh, TriangleMesh, enclosed_volume, measure};
use crate::methods::MethodError;
use crate::methods::caller_mesh::checked_mesh;
use crate::pauses::Pauses;
use crate::remesh::{EdgeBounds, remesh_in_slices};

/// Target edge length of the mesh extracted from the first frame, in units of the shortest side of a voxel.
const EDGE: f64 = 1.2;

/// Ratio of the longest accepted edge of the mesh extracted from the first frame to the target edge length, and of that
/// to the shortest.
const EDGE_BOUND_RATIO: f32 = 1.5;

/// Vertices of an extracted surface for each one that is left at least, once its edges are of even lengths: about two.
const MOST_REMOVED: usize = 2;

/// Number of triangles that count as one unit of work between pauses.
const TRIANGLES_PER_UNIT: usize = 32;

/// Returns the work that visiting all triangles of a part is.
fn part_work(part: &TriangleMesh) -> usize {
    1 + part.triangles.len() / TRIANGLES_PER_UNIT
}

/// Smallest mean edge of a caller's mesh, in units of the shortest side of a voxel. The resolution of that mesh is
/// kept: with shorter edges, a surface as large as the image would have more triangles than fit into memory.
const MIN_EDGE: f64 = 0.1;

/// Validates the caller's mesh for the first frame, and converts it to a [`Mesh`] with the same vertices, relative to
/// the origin of the working space.
///
/// # Errors
/// [`MethodError::InvalidArgument`] if its edges are too short, or none of its vertices is in the box; the errors of
/// [`checked_mesh`].
pub(super) async fn validate_start(
    start: &TriangleMesh,
    region: &Region,
    pauses: &Pauses,
) -> Result<Mesh, MethodError> {
    let rebased = start.relative_to(region.space.origin);
    let mesh = checked_mesh("start", &rebased, pauses).await?;
    pauses.now().await;
    let (edge, least) = (measure(&rebased).edge_mean, MIN_EDGE * region.shortest_side());
    if edge < least {
        let problem =
            format!("the mean edge length must be ≥ {least:.1e} (a tenth of a voxel), got {edge:.1e}");
        return Err(MethodError::invalid("start", problem));
    }
    pauses.now().await;
    let mut surface = mesh.clone();
    region.space.enter(&mut surface);
    if surface.vertices().all(|v| region.clamp_into_box(region.to_local(surface.position(v))).is_some()) {
        let problem =
            "no vertex of the mesh is inside the box; give a surface of the first frame in world coordinates";
        return Err(MethodError::invalid("start", problem));
    }
    Ok(mesh)
}

impl SurfaceTracker {
    /// Checks that the image has a boundary in some frame, and without the caller's mesh a closed surface in some frame.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if it has none.
    pub(super) async fn check_boundary(&self, pauses: &Pauses) -> Result<(), MethodError> {
        if self.faces.iter().flatten().all(Vec::is_empty) {
            let largest = self.voting.largest_step(&self.region, pauses).await * self.region.quantum;
            let largest = if largest < 0.01 { format!("{largest:.2e}") } else { format!("{largest:.4}") };
            let problem = format!(
                "must be below {largest}, the largest step in the box, got {}: no boundary was found",
                self.params.threshold
            );
            return Err(MethodError::invalid("threshold", problem));
        }
        if self.mesh.vertex_count() > 0 {
            return Ok(());
        }
        for frame in 0..self.frames() {
            if !self.surfaces_in(frame, pauses).await?.is_empty() {
                return Ok(());
            }
        }
        let problem = "no closed surface in any frame; use a larger box or a lower threshold";
        Err(MethodError::invalid("box", problem))
    }

    /// Returns the closed surfaces around the bright regions of a frame, in the working space, without those of cavities,
    /// which have negative volumes.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory does not suffice.
    pub(super) async fn surfaces_in(
        &self,
        frame: usize,
        pauses: &Pauses,
    ) -> Result<Vec<TriangleMesh>, MethodError> {
        let faces = &self.faces[frame];
        let (falloff, most) = (self.falloff(), self.limits.triangles());
        let surface = extract_bright_surface(&self.region, frame, faces, falloff, most, pauses).await?;
        let mut outer = Vec::new();
        for part in surface.separate_components(pauses).await {
            pauses.after(part_work(&part)).await;
            if enclosed_volume(&part) > 0.0 {
                outer.push(part);
            }
        }
        Ok(outer)
    }

    /// Returns the component to be tracked, selected by the option `component`, from closed surfaces in a frame; `None` if
    /// there are none.
    pub(super) async fn tracked_component(
        &self,
        parts: Vec<TriangleMesh>,
        pauses: &Pauses,
    ) -> Option<TriangleMesh> {
        let mut best: Option<(f64, TriangleMesh)> = None;
        for part in parts {
            let score = match self.component {
                Component::Largest => -enclosed_volume(&part),
                Component::Nearest(p) => distance(&part, self.region.space.point(p).as_vec3(), pauses).await,
            };
            pauses.after(part_work(&part)).await;
            if best.as_ref().is_none_or(|(least, _)| score.total_cmp(least).is_lt()) {
                best = Some((score, part));
            }
        }
        best.map(|(_, part)| part)
    }

    /// Returns an extracted surface as a mesh with edges of even lengths, in the working space.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`] if it has far more vertices than allowed; [`MethodError::Mesh`] if memory does not suffice.
    pub(super) async fn remeshed(&self, part: &TriangleMesh, pauses: &Pauses) -> Result<Mesh, MethodError> {
        self.limits.check_vertices(part.positions.len() / MOST_REMOVED)?;
        let mut mesh = Mesh::from_triangles(part)?;
        pauses.now().await;
        let edge = (EDGE * self.region.spacing.min_element()) as f32;
        let bounds = EdgeBounds { min: edge / EDGE_BOUND_RATIO, max: edge * EDGE_BOUND_RATIO };
        remesh_in_slices(&mut mesh, bounds, pauses).await?;
        self.limits.check_vertices(mesh.vertex_count())?;
        Ok(mesh)
    }
}

/// Returns the distance of a point from the nearest vertex of a closed surface; 0 if the point is
/// inside. It selects the tracked component.
async fn distance(part: &TriangleMesh, p: Vec3, pauses: &Pauses) -> f64 {
    let mut angle = 0.0;
    for (i, corners) in part.corners().enumerate() {
        angle += triangle::solid_angle(corners, p);
        if i % TRIANGLES_PER_UNIT == 0 {
            pauses.after(1).await;
        }
    }
    if angle.abs() > std::f64::consts::TAU {
        return 0.0;
    }
    part.positions.iter().map(|q| f64::from(q.distance(p))).fold(f64::INFINITY, f64::min)
}
