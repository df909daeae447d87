//! Giving back volume at the end of a run.
//!
//! A surface of long edges settles a little inside a convex contour, by some hundredths of a voxel: rigidity evens it out,
//! it rounds off edges, and a run converges before the last of the way. Of a large object that is nothing, but a ball
//! of seven voxels' radius lacks 1.5 % of its volume. So small components are compared with the contour around them, and
//! where the volumes differ, they move by the same distance everywhere; what rigidity has evened out stays so.

use super::DeformableModel;
use super::contour::{contour_of_grid, placed};
use crate::math::{Bounds, Vec3};
use crate::mesh::{TriangleMesh, VertexId, measure, sort_distinct};
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::volume::{Region, Subdivided};

/// The least share of its volume that a component lacks, or has in excess, at which it is moved. The contour itself lacks
/// up to a percent of linear interpolation; with more, components lack more than that; with less, more surfaces
/// change, which are right.
const LEAST_SHARE: f64 = 0.002;

/// The largest volume of a component that is compared, in voxels of the finest level. A ball of this size lacks half a
/// percent; with more, the contour of large objects is extracted once more.
const LARGEST_VOLUME: f64 = 30_000.0;

/// The largest displacement, in voxels of the finest level: a surface that is further from its contour is held there by
/// something else.
const LARGEST_DISPLACEMENT: f64 = 0.15;

/// The largest distance, in voxels of the finest level, between the sides of the bounding boxes of a component and of its
/// contour.
const NEAR: f32 = 1.0;

/// The distance, in voxels, between a component and the sides of the box in which its contour is extracted: the
/// contour does not reach them.
const MARGIN: f32 = 3.0;

impl DeformableModel {
    /// Moves small components of the mesh whose volume differs from that of their contour along their normals, such
    /// that it does no longer; the surface must have settled on the finest level.
    ///
    /// # Errors
    /// If memory does not suffice for the contour of a component.
    pub(super) async fn balance_volumes(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        if !self.params.adapts_to_image() || self.pyramid.is_sparse() {
            return Ok(());
        }
        let mut displacements = vec![Vec3::ZERO; self.mesh.slots()];
        let mut moving: Vec<VertexId> = Vec::new();
        for component in self.mesh.component_members() {
            pauses.after(1 + component.len()).await;
            let distance = self.distance_to_volume(&component)?;
            if distance == 0.0 {
                continue;
            }
            for &v in &component {
                displacements[v.index()] = self.mesh.unit_normal(v) * distance;
            }
            moving.extend(component);
        }
        if !moving.is_empty() {
            sort_distinct(&mut moving);
            let sampling = self.sampling();
            let Self { mesh, resolver, .. } = self;
            resolver.move_some_in_slices(mesh, sampling, &moving, &mut displacements, pauses).await;
        }
        Ok(())
    }

    /// Returns the distance by which a component has to move outwards to enclose the volume of its contour; 0 if it
    /// does so almost, is large, or does not correspond to one part of the contour.
    fn distance_to_volume(&self, component: &[VertexId]) -> Result<f32, MethodError> {
        // A vertex has about a square voxel of the surface.
        if component.len() as f64 > LARGEST_VOLUME {
            return Ok(0.0);
        }
        let surface = self.surface_of(component);
        let found = measure(&surface);
        if found.volume.abs() > LARGEST_VOLUME || found.area == 0.0 {
            return Ok(0.0);
        }
        let bounds = Bounds::from_points(&surface.positions);
        let mut missing = None;
        for part in self.contour_around(&bounds)?.components() {
            let other = Bounds::from_points(&part.positions);
            let is_near = (other.min - bounds.min).abs().max_element() <= NEAR
                && (other.max - bounds.max).abs().max_element() <= NEAR;
            let expected = measure(&part);
            if is_near && expected.euler == found.euler && expected.volume * found.volume > 0.0 {
                if missing.is_some() {
                    return Ok(0.0);
                }
                missing = Some(expected.volume - found.volume);
            }
        }
        let Some(missing) = missing.filter(|missing| missing.abs() >= LEAST_SHARE * found.volume.abs())
        else {
            return Ok(0.0);
        };
        Ok((missing / found.area).clamp(-LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT) as f32)
    }

    /// Returns a component as a mesh of its own, in model space.
    fn surface_of(&self, component: &[VertexId]) -> TriangleMesh {
        let corners: Vec<[VertexId; 3]> = self.mesh.triangles_at(component).into_iter().collect();
        let mut vertices = component.to_vec();
        sort_distinct(&mut vertices);
        let index = |v: VertexId| vertices.binary_search(&v).unwrap_or_default() as u32;
        TriangleMesh {
            positions: vertices.iter().map(|&v| self.mesh.position(v)).collect(),
            triangles: corners.into_iter().map(|corners| corners.map(index)).collect(),
            ..TriangleMesh::default()
        }
    }

    /// Returns the contour of the image in a box around `bounds`, all in model space; what reaches beyond is cut off.
    fn contour_around(&self, bounds: &Bounds) -> Result<TriangleMesh, MethodError> {
        let image = &self.pyramid.levels[self.level];
        let (grid, position) = image.part_grid();
        let dims = grid.dims();
        let [low, high] = [image.part_index(bounds.min) - MARGIN, image.part_index(bounds.max) + MARGIN];
        let min = [0, 1, 2].map(|axis| (low[axis].max(0.0) as usize).min(dims[axis] - 1));
        let end = [0, 1, 2].map(|axis| (high[axis].max(0.0) as usize + 1).clamp(min[axis] + 1, dims[axis]));
        let region = Region { min, dims: [0, 1, 2].map(|axis| end[axis] - min[axis]) };
        let offset = Vec3::from(min.map(|k| k as f32));
        let part = grid.region(region)?.into();
        let surface = contour_of_grid(&Subdivided::whole(&part), self.contour_rule(self.level_iso))?;
        Ok(placed(surface, |p| position(p + offset)))
    }
}
