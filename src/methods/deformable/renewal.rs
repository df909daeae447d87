//! Renewal: on the way down, components that leave something out are taken anew from the contour of the finer level.
//!
//! A coarse level shows no thin walls, and its surface has to be opened, split and filled in hundreds of places before it fits the
//! finer image. Where a component of the contour has points that no component of the mesh is near, it and all that it touches are
//! replaced by the contour, brought into edge bounds like a start; components that leave nothing out are refined and go on.

use super::contour::{ObjectIs, contour, simplified};
use super::{DeformableModel, Topology};
use crate::mesh::{Groups, Mesh, TriangleMesh, VertexId};
use crate::methods::MethodError;
use crate::spatial::TriangleTree;

/// A point of the contour is left out where the mesh is further away than this, in voxels of the finer level.
const REACH: f32 = 1.0;

/// What changes on the way to a level.
#[derive(Default)]
pub(super) struct Renewal {
    /// A vertex of each component that goes.
    pub(super) stale: Vec<VertexId>,
    /// What comes instead: parts of the contour.
    pub(super) fresh: Mesh,
}

impl DeformableModel {
    /// What has to be renewed to fit the next finer level.
    ///
    /// # Errors
    /// Where the contour does not fit memory.
    pub(super) fn renewal(&self) -> Result<Renewal, MethodError> {
        if self.params.iso_force == 0.0 || self.params.topology == Topology::Fixed {
            return Ok(Renewal::default());
        }
        let (level, object) = (self.level - 1, ObjectIs::by(&self.params));
        let image = &self.pyramid.levels[level];
        let iso = self.pyramid.normalised(self.params.iso);
        let contour = contour(image, iso, object, self.params.smallest_part)?;
        let (stale, fresh) = self.incomplete(&contour, REACH / image.voxels_per_unit())?;
        if fresh.triangles.is_empty() {
            return Ok(Renewal::default());
        }
        let fresh = simplified(fresh, image, super::delta_at(self.finest_delta, level));
        Ok(Renewal { stale, fresh: Mesh::from_triangles(&fresh)? })
    }

    /// A vertex of each component of the mesh that goes, and the components of the contour that replace them: all that are joined,
    /// one near the other, to a component of the contour with a point further than `reach` from the mesh.
    fn incomplete(
        &self,
        contour: &TriangleMesh,
        reach: f32,
    ) -> Result<(Vec<VertexId>, TriangleMesh), MethodError> {
        let surface = self.mesh.to_triangles();
        let tree = TriangleTree::new(&surface)?;
        let (part_of_contour, part_of_surface) =
            (contour.part_of_each_vertex(), surface.part_of_each_vertex());
        let first = contour.positions.len();
        let mut groups = Groups::new(first + surface.positions.len());
        let mut is_left_out = vec![false; first];
        let mut near = Vec::new();
        let label = |t: u32| part_of_surface[surface.triangles[t as usize][0] as usize];
        for (&p, &part) in contour.positions.iter().zip(&part_of_contour) {
            tree.labels_within(p, f64::from(reach), label, &mut near);
            is_left_out[part as usize] |= near.is_empty();
            near.iter().for_each(|&other| groups.join(part as usize, first + other as usize));
        }
        let mut is_renewed = vec![false; first + surface.positions.len()];
        let mut has_contour = is_renewed.clone();
        for &part in &part_of_contour {
            let group = groups.find(part as usize);
            has_contour[group] = true;
            is_renewed[group] |= is_left_out[part as usize];
        }
        let fresh = contour.parts_where(|v| is_renewed[groups.find(part_of_contour[v as usize] as usize)]);
        // What is near no contour would be inside of what comes, or around it.
        let mut is_stale = |v: usize| {
            let group = groups.find(first + v);
            part_of_surface[v] as usize == v && (is_renewed[group] || !has_contour[group])
        };
        let vertices = self.mesh.vertices().enumerate();
        let stale = vertices.filter(|&(v, _)| is_stale(v)).map(|(_, name)| name).collect();
        Ok((stale, fresh))
    }
}
