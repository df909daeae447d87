//! Saving and restoring a run of the deformable model; a restored run continues bit for bit.

use super::domain::Domain;
use super::motion::{Motion, SpeedSummary};
use super::schedule::Convergence;
use super::{Attractor, DeformableModel, DeformableParams, coarse, image};
use crate::mesh::{Mesh, VertexId};
use crate::methods::MethodError;
use crate::methods::saved::{Hash, MAX_VALENCE, Magic, can_be_checked, decode, encode};
use crate::remesh::{Changes, Pending, Resolver};
use serde::{Deserialize, Serialize};

const MAGIC: Magic = *b"VSCLDEF\x07";
/// The magic bytes of states of before, without the iteration in which the run began again.
const MAGIC_BEFORE: Magic = *b"VSCLDEF\x06";
/// The magic bytes of states of sparse volumes, which have one more field: whether the factor on the image force is still
/// to be measured.
const SPARSE_MAGIC: Magic = *b"VSCLDES\x01";

/// The largest number of edits of each kind, made by refreshes since the last step, that is accepted in a saved state, so
/// that their sums do not overflow.
const MAX_EDITS: u32 = 1 << 28;

/// The saved part of a run of the deformable model: everything but the volume and what is computed from it.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: DeformableParams,
    attractors: Vec<Attractor>,
    from_contour: bool,
    finest_delta: f64,
    level: usize,
    /// Level iso value and factor on the image force. They depend on the image at the beginning of the level, which may
    /// have been refreshed since.
    level_iso: f32,
    image_force_factor: f32,
    mesh: Mesh,
    waiting: Pending,
    iteration: u32,
    convergence: Convergence,
    energy: f64,
    fastest: f32,
    refreshed: Changes,
}

impl DeformableModel {
    /// Returns the state of the run as bytes, without the volume, for [`Self::restore`].
    pub fn save(&self) -> Vec<u8> {
        let state = State {
            fingerprint: self.fingerprint(),
            params: self.params.clone(),
            attractors: self.attractors.clone(),
            from_contour: self.from_contour,
            finest_delta: self.finest_delta,
            level: self.level,
            level_iso: self.level_iso,
            image_force_factor: self.image_force_factor,
            mesh: self.mesh.clone(),
            waiting: self.resolver.pending(),
            iteration: self.iteration,
            convergence: self.convergence,
            energy: self.speed.energy,
            fastest: self.speed.fastest,
            refreshed: self.refreshed,
        };
        if self.pyramid.is_sparse() {
            return encode(&SPARSE_MAGIC, &(self.needs_factor, state));
        }
        encode(&MAGIC, &(self.began, state))
    }

    /// Restores a run from bytes made by [`Self::save`]; this model must have the same volume, frame and levels, and on a
    /// sparse volume the same box. Bricks are not saved: the next step asks for those that are missing.
    ///
    /// # Errors
    /// [`MethodError::BadState`] if the bytes are not such a state, [`MethodError::InvalidArgument`] if a parameter or
    /// attractor in it is invalid, [`MethodError::Volume`] if the gradient image does not fit into memory; the model is
    /// unchanged then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        self.checkpoint = None;
        let (mut needs_factor, mut began) = (false, 0);
        let state: State;
        if self.pyramid.is_sparse() {
            (needs_factor, state) = decode(&SPARSE_MAGIC, bytes)?;
        } else if bytes.starts_with(&MAGIC_BEFORE) {
            state = decode(&MAGIC_BEFORE, bytes)?;
        } else {
            (began, state) = decode(&MAGIC, bytes)?;
        }
        if state.fingerprint != self.fingerprint() {
            let problem =
                "the state belongs to another volume, frame or number of levels, or to a version that did \
                           not divide elongated voxels"
                    .into();
            return Err(MethodError::BadState { field: "volume", problem });
        }
        self.check_state(&state)?;
        if began > state.iteration {
            let problem = "the run began again after its last iteration".into();
            return Err(MethodError::BadState { field: "iteration", problem });
        }
        self.take_state(state)?;
        self.needs_factor = needs_factor;
        self.began = began;
        Ok(())
    }

    fn check_state(&self, state: &State) -> Result<(), MethodError> {
        let bad = |field, problem: String| Err(MethodError::BadState { field, problem });
        self.check_params(&state.params)?;
        self.check_attractors(&state.attractors)?;
        if !can_be_checked(&state.mesh) {
            return bad("mesh", format!("a vertex has more than {MAX_VALENCE} neighbours"));
        }
        if let Err(flaw) = state.mesh.check() {
            return bad("mesh", flaw.to_string());
        }
        if state.mesh.attribute_counts() != self.mesh.attribute_counts() {
            return bad("mesh", "the vertex attributes are not those of this method".into());
        }
        if state.level >= self.pyramid.levels.len() || !super::DELTA_RANGE.contains(&state.finest_delta) {
            return bad("level", "level or edge is out of range".into());
        }
        let is_in_range = state.level_iso.abs() <= image::MAX_NORMALISED as f32
            && (1.0..=coarse::MAX_FACTOR).contains(&state.image_force_factor);
        if !is_in_range {
            return bad("level", "iso value or factor on the image force is out of range".into());
        }
        if state.refreshed.most() > MAX_EDITS {
            return bad("refreshed", format!("more than {MAX_EDITS} edits of a kind"));
        }
        let domain = self.domain_for(state.finest_delta);
        let lost = |v: &VertexId| !domain.bounds.contains(state.mesh.position(*v));
        if let Some(v) = state.mesh.vertices().find(lost) {
            return bad("mesh", format!("{v:?} is outside the image's domain"));
        }
        let named = state.waiting.queue.iter().chain(&state.waiting.dirty);
        if let Some(v) = named.into_iter().find(|v| v.index() >= state.mesh.slots()) {
            return bad("queue", format!("{v:?} does not exist"));
        }
        Ok(())
    }

    /// Returns a hash of the frame of the volume, its dimensions, affine transform and range, and the number of pyramid
    /// levels, by which a saved state is matched to its model.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        let [frame, levels] = [self.frame, self.pyramid.levels.len() - 1];
        self.pyramid.dims().into_iter().chain([frame, levels]).for_each(|n| hash.mix(n as u64));
        self.to_world.to_cols_array().into_iter().for_each(|x| hash.mix(x.to_bits()));
        self.pyramid.volume_range().into_iter().for_each(|x| hash.mix(x.to_bits()));
        hash.mix(self.pyramid.hash());
        self.mix_box_into(&mut hash);
        hash.value()
    }

    fn domain_for(&self, finest_delta: f64) -> Domain {
        let coarsest = self.pyramid.delta_at(finest_delta, self.pyramid.levels.len() - 1);
        Domain::new(self.pyramid.dims(), coarsest).with_at_most(Some(self.domain.max_vertices))
    }

    fn take_state(&mut self, state: State) -> Result<(), MethodError> {
        let mut adapted = self.pyramid.adapted(&state.params)?;
        adapted.as_mut().unwrap_or(&mut self.pyramid).levels[state.level]
            .prepare_gradient_for(&state.params)?;
        if let Some(adapted) = adapted {
            self.pyramid = adapted;
        }
        self.level = state.level;
        self.params = state.params;
        self.attractors = state.attractors;
        self.from_contour = state.from_contour;
        self.finest_delta = state.finest_delta;
        self.domain = self.domain_for(state.finest_delta);
        let replaced = std::mem::replace(&mut self.mesh, state.mesh);
        self.mesh.advance_versions_past(&replaced);
        let finest = self.pyramid.delta_at(state.finest_delta, 0);
        self.resolver = Resolver::with_max_vertices(self.domain.most_vertices(finest));
        self.watch_output();
        self.resolver.set_pending(state.waiting);
        self.motion = Motion::default();
        self.iteration = state.iteration;
        self.convergence = state.convergence;
        self.speed = SpeedSummary { energy: state.energy, fastest: state.fastest };
        self.components = self.mesh.component_count() as u32;
        self.refreshed = state.refreshed;
        self.level_iso = state.level_iso;
        self.image_force_factor = state.image_force_factor;
        Ok(())
    }
}
