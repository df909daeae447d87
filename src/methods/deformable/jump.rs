//! Beginning again from the contour where the iso value jumps.
//!
//! The same settings give the same surface, however they were reached. A front that has to crawl through the image to
//! another iso-surface may end at a third one, after hundreds of iterations. So where the value moves further than a front
//! safely follows, a run that began on the contour begins again on that of the new value.

use super::contour::ObjectIs;
use super::schedule::Convergence;
use super::start::contour_mesh;
use super::{DeformableModel, DeformableParams, Keys, Motion, SpeedSummary, StartContext};
use crate::math::Vec3;
use crate::mesh::VertexId;
use crate::methods::MethodError;
use crate::pauses::{Pauses, finished};
use crate::remesh::{Changes, Resolver};
use crate::volume::CellCache;

/// Distance, in voxels of the current level, from which on the new surface is far from a vertex.
const FAR: f32 = 4.0;

/// Number of intensities that are compared with the iso value on each side of a vertex, along its normal.
const SAMPLES: i32 = 4;

/// Share of the vertices, one of ten, from which the surface jumps if the new one is far from them.
const MOST_FAR: usize = 10;

impl DeformableModel {
    /// Returns whether the surface for other parameters is far from the present one because of their iso value, and can be
    /// had from the contour.
    pub(super) fn jumps_with(&self, params: &DeformableParams) -> bool {
        let [before, iso] = [&self.params, params].map(|params| self.pyramid.iso(params));
        if !self.from_contour || self.pyramid.is_sparse() || before == iso {
            return false;
        }
        let far = self.mesh.vertices().filter(|&v| self.is_far(v, iso, ObjectIs::by(params))).count();
        far * MOST_FAR > self.mesh.vertex_count()
    }

    /// Returns whether no intensity along the normal of a vertex is on the other side of the iso value.
    fn is_far(&self, v: VertexId, iso: f32, object: ObjectIs) -> bool {
        let image = &self.pyramid.levels[self.level];
        let step = self.mesh.unit_normal(v) * (FAR / (SAMPLES as f32 * image.voxels_per_unit()));
        let known = &mut CellCache::default();
        let mut depth = |k: i32| {
            let p: Vec3 = self.mesh.position(v) + step * k as f32;
            object.depth(image.intensity(p, object.outside(iso), known), iso)
        };
        let is_inside = depth(0) >= 0.0;
        (-SAMPLES..=SAMPLES).all(|k| (depth(k) >= 0.0) == is_inside)
    }

    /// Sets parameters and begins again from the contour, on the coarsest level; where there is none, the run goes on.
    ///
    /// # Errors
    /// As [`Self::set_params`], and those of a start on the contour; nothing has changed then.
    pub(super) fn begin_again(&mut self, params: DeformableParams) -> Result<(), MethodError> {
        let before = self.save();
        let begun = self.try_to_begin_again(params);
        if begun.is_err() {
            self.restore(&before)?;
        }
        begun
    }

    fn try_to_begin_again(&mut self, params: DeformableParams) -> Result<(), MethodError> {
        if let Some(adapted) = self.pyramid.adapted(&params)? {
            self.pyramid = adapted;
        }
        self.params = params;
        let level = self.pyramid.levels.len() - 1;
        let delta = self.pyramid.delta_at(self.finest_delta, level);
        let context = StartContext::of(&self.pyramid, &self.params, self.domain, delta, &self.to_world);
        let Some(mut mesh) = finished(contour_mesh(&context, &Pauses::default()))? else {
            finished(self.prepare_level(&Pauses::default()))?;
            self.wake_all();
            return Ok(());
        };
        self.keys = Keys::added_to(&mut mesh);
        mesh.advance_versions_past(&self.mesh);
        self.mesh = mesh;
        self.level = level;
        self.resolver = Resolver::with_max_vertices(self.resolver.max_vertices());
        self.motion = Motion::default();
        self.convergence = Convergence::default();
        self.convergence.began = self.iteration;
        self.began = self.iteration;
        self.speed = SpeedSummary::default();
        self.refreshed = Changes::default();
        finished(self.begin_on(true, &Pauses::default()))?;
        self.components = self.mesh.component_count() as u32;
        Ok(())
    }
}
