//! Saves a run of a model and restores it bit for bit. The saved state holds the deformed base and its map T; the
//! decomposition is made again from the same options, and the detail is reconstructed.

use super::correspondence::{BasePoint, Correspondence};
use super::held::SavedHandles;
use super::motion::MovingEllipsoids;
use super::{MultiresParams, MultiresolutionModel};
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Magic, can_be_checked, decode, encode};
use serde::{Deserialize, Serialize};

const MAGIC: Magic = *b"VSCLMRS\x03";
/// That of a surface that holds itself, whose handles follow.
const HELD: Magic = *b"VSCLMRH\x02";

/// The saved state: everything of a run but the decomposition of its input surfaces.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: MultiresParams,
    moving: MovingEllipsoids,
    surface: Mesh,
    /// The point of the base that the map T assigns to each vertex, as a triangle and barycentric coordinates, by slot.
    correspondence: Vec<(u32, Vec3)>,
    iteration: u32,
    passing: u32,
    at_rest: u32,
    components: u32,
    residual: f64,
}

impl MultiresolutionModel {
    /// Serialises the run for [`Self::restore`], without the surfaces that the model was made from.
    pub fn save(&self) -> Vec<u8> {
        let state = State {
            fingerprint: self.fingerprint(),
            params: self.model_params.clone(),
            moving: self.ellipsoids.clone(),
            surface: self.surface.clone(),
            correspondence: self.correspondence.iter().map(|at| (at.triangle, at.weights)).collect(),
            iteration: self.iteration,
            passing: self.refreshed_frames,
            at_rest: self.frames_at_rest,
            components: self.components,
            residual: self.residual,
        };
        match &self.held {
            Some(held) => encode(&HELD, &(state, held.save())),
            None => encode(&MAGIC, &state),
        }
    }

    /// Restores a run from the bytes of [`Self::save`]. This model must have the same surfaces as the saved one;
    /// surfaces that were derived instead of given depend on the initial ellipsoids and parameters.
    ///
    /// # Errors
    /// [`MethodError::BadState`] for any other bytes; the run is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        let (state, handles): (State, Option<SavedHandles>) = match self.held {
            Some(_) if bytes.starts_with(&MAGIC) => return bad("support", "saved with \"membrane\""),
            None if bytes.starts_with(&HELD) => return bad("support", "saved with \"surface\""),
            Some(_) => decode(&HELD, bytes).map(|(state, handles)| (state, Some(handles)))?,
            None => (decode(&MAGIC, bytes)?, None),
        };
        if state.fingerprint != self.fingerprint() {
            return bad("surfaces", "the state belongs to another detail, base or start");
        }
        if state.params.validate().is_err() || !state.moving.are_valid() {
            return bad("parameters", "out of range");
        }
        let is_valid = can_be_checked(&state.surface) && state.surface.check().is_ok();
        let has_same_attributes = state.surface.attribute_counts() == self.surface.attribute_counts();
        if !is_valid || !has_same_attributes || state.correspondence.len() != state.surface.slots() {
            return bad("surface", "inconsistent");
        }
        let Some(correspondence) = self.correspondence_of(&state.correspondence) else {
            return bad("link", "refers to a missing triangle");
        };
        if let (Some(held), Some(handles)) = (&self.held, handles) {
            let restored = held.restored(handles, state.surface.slots());
            let Some(restored) = restored.filter(|held| state.moving.now().len() == held.handles.len())
            else {
                return bad("handles", "inconsistent");
            };
            self.held = Some(restored);
        }
        (self.model_params, self.ellipsoids, self.correspondence) =
            (state.params, state.moving, correspondence);
        self.params = self.space.params_in_world(&self.model_params);
        let replaced = std::mem::replace(&mut self.surface, state.surface);
        self.surface.advance_versions_past(&replaced);
        (self.iteration, self.refreshed_frames) = (state.iteration, state.passing);
        self.frames_at_rest = state.at_rest;
        (self.components, self.residual) = (state.components, state.residual);
        self.reconstruct_detail();
        Ok(())
    }

    /// Restores the points of the map T from their saved form; `None` if one refers to a triangle that does not exist,
    /// or its coordinates are not finite.
    fn correspondence_of(&self, points: &[(u32, Vec3)]) -> Option<Correspondence> {
        let base = &self.bands.base().walker;
        let count = base.mesh().triangles.len();
        let point = |&(triangle, weights): &(u32, Vec3)| {
            let fits = (triangle as usize) < count && weights.is_finite();
            fits.then(|| BasePoint::at(base, triangle, weights))
        };
        points.iter().map(point).collect()
    }

    /// Returns a hash of the positions and triangles of all surfaces of the decomposition, so that a saved state is
    /// restored only with the same surfaces.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        if self.space.origin != DVec3::ZERO {
            self.space.origin.to_array().iter().for_each(|x| hash.mix(x.to_bits()));
        }
        if self.space.unit != 1.0 {
            hash.mix(self.space.unit.to_bits());
        }
        for band in &self.bands.all {
            let mesh = band.walker.mesh();
            hash.mix(mesh.positions.len() as u64);
            mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| hash.mix(u64::from(x.to_bits())));
            mesh.triangles.iter().flatten().for_each(|&v| hash.mix(u64::from(v)));
        }
        hash.value()
    }
}
