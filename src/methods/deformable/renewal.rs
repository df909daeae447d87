//! Renewal: when a run descends to a finer pyramid level, components of the mesh that lack part of the finer contour
//! are replaced by it.
//!
//! A coarse level shows no thin walls, and its surface would have to be opened, split and filled in hundreds of places
//! before it fits the finer image. If a component of the contour has points far from the mesh, it replaces all
//! components of the mesh that it touches, and is brought within edge bounds like a start; other components are refined
//! and kept.

use super::contour::{contour, simplified};
use super::{DeformableModel, Topology};
use crate::mesh::{DisjointSets, Mesh, TriangleMesh, VertexId};
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::spatial::TriangleTree;

/// The distance from the mesh, in voxels of the finer level, above which the mesh lacks a point of the finer level's
/// contour, so that components near it are replaced.
const COVERED_DISTANCE: f32 = 1.0;

/// The components of the mesh to replace by parts of the finer level's contour when a run descends one pyramid level.
#[derive(Default)]
pub(super) struct Renewal {
    /// One vertex of each component to remove from the mesh, which identifies the component.
    pub(super) removed: Vec<VertexId>,
    /// The parts of the finer contour to add in place of the removed components.
    pub(super) added: Mesh,
}

impl DeformableModel {
    /// Returns the components of the mesh to replace by parts of the next finer level's contour; empty if the mesh
    /// lacks no point of it, the image force is 0, or the topology is fixed.
    ///
    /// # Errors
    /// If the contour does not fit into memory.
    pub(super) async fn renewal(&self, pauses: &Pauses) -> Result<Renewal, MethodError> {
        if self.params.iso_force == 0.0 || self.params.topology == Topology::Fixed {
            return Ok(Renewal::default());
        }
        let level = self.level - 1;
        let image = &self.pyramid.levels[level];
        let iso = self.pyramid.iso(&self.params);
        let contour = contour(image, self.contour_rule(iso), pauses).await?;
        pauses.now().await;
        let covered = COVERED_DISTANCE / image.voxels_per_unit();
        let (removed, added) = self.components_to_replace(&contour, covered, pauses).await?;
        if added.triangles.is_empty() {
            return Ok(Renewal::default());
        }
        pauses.now().await;
        let delta = self.pyramid.delta_at(self.finest_delta, level);
        let added = simplified(added, image, delta, pauses).await;
        pauses.now().await;
        Ok(Renewal { removed, added: Mesh::from_triangles(&added)? })
    }

    /// Returns a vertex of each component of the mesh to remove, and the components of the contour that replace them.
    ///
    /// Components of mesh and contour within `covered_distance` of each other form groups. Groups with a point of the
    /// contour further than `covered_distance` from the mesh are replaced; components of the mesh near no contour are
    /// removed, too.
    async fn components_to_replace(
        &self,
        contour: &TriangleMesh,
        covered_distance: f32,
        pauses: &Pauses,
    ) -> Result<(Vec<VertexId>, TriangleMesh), MethodError> {
        let surface = self.mesh.to_triangles();
        let tree = TriangleTree::in_slices(&surface, pauses).await?;
        let (part_of_contour, part_of_surface) =
            (contour.component_of_each_vertex(), surface.component_of_each_vertex());
        let first = contour.positions.len();
        let mut groups = DisjointSets::new(first + surface.positions.len());
        let mut is_left_out = vec![false; first];
        let mut near = Vec::new();
        let label = |t: u32| part_of_surface[surface.triangles[t as usize][0] as usize];
        for (&p, &part) in contour.positions.iter().zip(&part_of_contour) {
            pauses.after(1).await;
            tree.labels_within(p, f64::from(covered_distance), label, &mut near);
            is_left_out[part as usize] |= near.is_empty();
            near.iter().for_each(|&other| groups.union(part as usize, first + other as usize));
        }
        let mut is_renewed = vec![false; first + surface.positions.len()];
        let mut has_contour = is_renewed.clone();
        for &part in &part_of_contour {
            let group = groups.find(part as usize);
            has_contour[group] = true;
            is_renewed[group] |= is_left_out[part as usize];
        }
        let added =
            contour.components_where(|v| is_renewed[groups.find(part_of_contour[v as usize] as usize)]);
        // A component near no contour would be inside of a new component, or around it.
        let mut is_removed = |v: usize| {
            let group = groups.find(first + v);
            part_of_surface[v] as usize == v && (is_renewed[group] || !has_contour[group])
        };
        let vertices = self.mesh.vertices().enumerate();
        let removed = vertices.filter(|&(v, _)| is_removed(v)).map(|(_, name)| name).collect();
        Ok((removed, added))
    }
}
