//! Refreshing the model after part of its volume has changed, as by a stroke of a brush.
//!
//! Only what depends on the changed voxels is updated: the image in a box around them, and the surface there. On
//! the finest level the surface in the box is replaced by the contour (`patch`), so that parts appear, vanish, join and
//! split at once, and moves only by fractions of a voxel afterwards. If that fails, or on coarse levels, the vertices
//! there wake, and forces and seeding do the same in more iterations.

use super::awake::ITERATIONS_TO_SLEEP;
use super::image::Pyramid;
use super::patch::{PatchBox, Replacement, replacement};
use super::{DeformableModel, Topology};
use crate::math::{Bounds, Vec3};
use crate::mesh::VertexId;
use crate::methods::{MethodError, Times};
use crate::pauses::{Pauses, finished};
use crate::volume::{Grid, Region, Volume};

/// The distance, in voxels of the current level, from changed voxels within which vertices wake: beyond it, no sample of
/// the image at a vertex or in its triangles changes.
const REACH: f32 = 4.0;

/// The numbers of voxels by which the box is enlarged whose surface is replaced by the contour, tried in this order:
/// where the surface is far from the contour beside the smallest box, it may be near it beside a larger one.
const MARGINS: [usize; 3] = [0, 2, 5];

impl DeformableModel {
    /// Adapts the model to its volume after the voxels in `region` of the model's frame have changed. A finished run
    /// continues, on the finest level and near the changed voxels only; if none has changed, nothing happens.
    ///
    /// The next step reports the topology changes. The volume must be the one that the model was made of, apart from
    /// voxels in `region` and their effect on [`Volume::range`].
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the volume has other dimensions or another affine transform, or the model's
    /// volume is sparse;
    /// [`MethodError::Volume`] if the region is empty or not within the volume, in which cases nothing has changed, or if
    /// memory does not suffice; [`MethodError::TooManyVertices`].
    pub fn refresh(&mut self, volume: &Volume, region: Region) -> Result<(), MethodError> {
        self.checkpoint = None;
        self.check_is_whole()?;
        let is_in_place = self.pyramid.to_world(&volume.affine()) == self.to_world;
        if volume.dims() != self.pyramid.voxel_dims() || !is_in_place {
            let problem = "must have the dimensions and the affine transform of the model's volume";
            return Err(MethodError::invalid("volume", problem));
        }
        let new = volume.normalised_region(region, self.frame)?;
        let is_local = self.pyramid.is_as_normalised() && volume.is_finite_in(region, self.frame)?;
        if !is_local || !self.pyramid.has_range_of(volume) {
            return self.refresh_range(volume, region);
        }
        self.pyramid.set_source(volume, self.frame);
        let Some((changed, new)) = self.pyramid.changes(region, &new)? else { return Ok(()) };
        self.refresh_changed(changed, &new)
    }

    /// Adapts the model to a volume whose range has changed, by which all intensities are normalised, or in which
    /// voxels depend on others than themselves.
    fn refresh_range(&mut self, volume: &Volume, region: Region) -> Result<(), MethodError> {
        let levels = self.pyramid.levels.len() - 1;
        let new = Pyramid::new(volume, self.frame, levels, &self.params)?;
        let before = std::mem::replace(&mut self.pyramid, new);
        if let Err(error) = finished(self.prepare_level(&Pauses::default())) {
            self.pyramid = before;
            return Err(error);
        }
        self.wake_all();
        self.replace_by_contour(region)?;
        Ok(())
    }

    fn refresh_changed(&mut self, changed: Region, new: &Grid) -> Result<(), MethodError> {
        self.pyramid.update(changed, new)?;
        self.motion.forces.forget_image();
        let was_done = self.is_done();
        let was_settled = was_done || self.convergence.refreshed > 0;
        if was_done {
            self.put_to_sleep();
        }
        let added = self.replace_by_contour(changed)?;
        let woken = self.wake_near(changed);
        if was_done && added.is_some() && woken == 0 {
            return Ok(());
        }
        let count = if was_settled { added.map(|added| added.max(woken)) } else { None };
        self.convergence = self.convergence.continued(count);
        Ok(())
    }

    /// Replaces the surface around changed voxels by the contour, on the finest level and if the topology is adaptive.
    /// Returns the number of vertices added; `None` if the surface was not replaced.
    fn replace_by_contour(&mut self, changed: Region) -> Result<Option<usize>, MethodError> {
        if self.level > 0 || self.params.iso_force == 0.0 || self.params.topology == Topology::Fixed {
            return Ok(None);
        }
        for margin in MARGINS {
            let at = PatchBox::around(self.pyramid.parts_around(changed), margin, self.pyramid.dims());
            if let Some(added) = self.try_to_patch(at)? {
                return Ok(Some(added));
            }
        }
        Ok(None)
    }

    /// Replaces the surface in a box by the contour, and restores edge bounds and contacts there. Returns the number of
    /// vertices added; `None` if that would make the surface intersect itself, or rims do not correspond.
    fn try_to_patch(&mut self, at: PatchBox) -> Result<Option<usize>, MethodError> {
        let sampling = self.sampling();
        let near = self.resolver.embedding(&self.mesh, sampling).vertices_in(&self.mesh, &at.outer);
        let rule = self.contour_rule(self.level_iso);
        let Some(Replacement { removed, patch, components }) =
            replacement(&self.pyramid.levels[0], &self.mesh, &near, at, rule)?
        else {
            return Ok(None);
        };
        if removed.is_empty() && patch.triangles.is_empty() {
            return Ok(Some(0));
        }
        if self.mesh.vertex_count() + patch.positions.len() > self.resolver.max_vertices() {
            return Ok(None);
        }
        let Ok(added) = self.resolver.replace(&mut self.mesh, sampling, &removed, &patch) else {
            return Ok(None);
        };
        self.update_components(components);
        self.initialise_attributes(&added);
        if self.convergence.sized {
            finished(self.set_sizes_of(&added, &Pauses::default()));
        }
        let mut active = added.clone();
        self.mesh.add_neighbours(&mut active);
        let pauses = Pauses::default();
        let changes = finished(self.restore_bounds(&active, &mut Times::default(), &pauses));
        self.count_components(changes);
        self.refreshed += changes;
        Ok(Some(added.len()))
    }

    /// Updates the number of components, which has changed by `change`, or by an unknown number if that is `None`. Whole
    /// components that appeared or vanished are reported by the next step.
    fn update_components(&mut self, change: Option<i32>) {
        let Some(change) = change else {
            self.components = self.mesh.component_count() as u32;
            return;
        };
        self.components = self.components.saturating_add_signed(change);
        let count = if change > 0 { &mut self.refreshed.seeds } else { &mut self.refreshed.vanished };
        *count += change.unsigned_abs();
    }

    /// Puts all vertices to sleep. In a finished run some still creep, and would do so whenever a part is refreshed.
    fn put_to_sleep(&mut self) {
        self.mesh.scalar_mut(self.keys.still_iterations).fill(ITERATIONS_TO_SLEEP);
        self.mesh.vector_mut(self.keys.velocity).fill(Vec3::ZERO);
    }

    /// Wakes the vertices near changed voxels, and returns their number.
    fn wake_near(&mut self, changed: Region) -> usize {
        let image = &self.pyramid.levels[self.level];
        let reach = Vec3::splat(REACH / image.voxels_per_unit());
        let changed = self.pyramid.parts_around(changed);
        let (first, last) = (
            Vec3::from(changed.min.map(|k| k as f32)),
            Vec3::from([0, 1, 2].map(|axis| (changed.min[axis] + changed.dims[axis] - 1) as f32)),
        );
        let bounds = Bounds { min: first - reach, max: last + reach };
        let near: Vec<VertexId> =
            self.mesh.vertices().filter(|&v| bounds.contains(self.mesh.position(v))).collect();
        let keys = self.keys;
        for v in near.iter().map(|v| v.index()) {
            self.mesh.scalar_mut(keys.still_iterations)[v] = 0.0;
            self.mesh.scalar_mut(keys.reversals)[v] = 0.0;
        }
        near.len()
    }
}
