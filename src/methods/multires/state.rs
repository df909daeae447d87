//! Saves a run and restores it bit for bit. A state holds the deformed base and its map T; the decomposition is made
//! again from the same options, and the detail reconstructed.

use super::link::{Link, Linked};
use super::motion::Movers;
use super::{MultiresParams, MultiresolutionModel};
use crate::math::Vec3;
use crate::mesh::Mesh;
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Mark, can_be_checked, opened, sealed};
use serde::{Deserialize, Serialize};

const MARK: Mark = *b"VSCLMRS\x02";

/// The saved state: everything of a run but its decomposition.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: MultiresParams,
    movers: Movers,
    surface: Mesh,
    /// Triangle and barycentric coordinates of the map T, by slot.
    link: Vec<(u32, Vec3)>,
    iteration: u32,
    passing: u32,
    components: u32,
    residual: f64,
}

impl MultiresolutionModel {
    /// Serialises the run, without the surfaces that it was made from.
    pub fn save(&self) -> Vec<u8> {
        sealed(
            &MARK,
            &State {
                fingerprint: self.fingerprint(),
                params: self.params.clone(),
                movers: self.movers.clone(),
                surface: self.surface.clone(),
                link: self.link.iter().map(|at| (at.triangle, at.weights)).collect(),
                iteration: self.iteration,
                passing: self.passing,
                components: self.components,
                residual: self.residual,
            },
        )
    }

    /// Restores a run from the bytes of [`Self::save`], for a model of the same surfaces and initial ellipsoids.
    ///
    /// # Errors
    /// [`MethodError::BadState`] for any other bytes; the run is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let state: State = opened(&MARK, bytes)?;
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        if state.fingerprint != self.fingerprint() {
            return bad("surfaces", "the state belongs to another detail, base or start");
        }
        if state.params.validate().is_err() || !state.movers.are_sound() {
            return bad("parameters", "they are out of range");
        }
        let is_sound = can_be_checked(&state.surface) && state.surface.check().is_ok();
        let is_like_this = state.surface.attribute_counts() == self.surface.attribute_counts();
        if !is_sound || !is_like_this || state.link.len() != state.surface.slots() {
            return bad("surface", "its parts do not fit each other");
        }
        let Some(link) = self.linked(&state.link) else { return bad("link", "it leads nowhere") };
        (self.params, self.movers, self.link) = (state.params, state.movers, link);
        let replaced = std::mem::replace(&mut self.surface, state.surface);
        self.surface.advance_versions_past(&replaced);
        (self.iteration, self.passing) = (state.iteration, state.passing);
        (self.components, self.residual) = (state.components, state.residual);
        self.show();
        Ok(())
    }

    /// Restores the points of the map T; `None` if one refers to a triangle that does not exist.
    fn linked(&self, places: &[(u32, Vec3)]) -> Option<Link> {
        let base = &self.bands.base().walker;
        let count = base.mesh().triangles.len();
        let place = |&(triangle, weights): &(u32, Vec3)| {
            let fits = (triangle as usize) < count && weights.is_finite();
            fits.then(|| Linked::at(base, triangle, weights))
        };
        places.iter().map(place).collect()
    }

    /// Returns a hash of all surfaces, which identifies the decomposition.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        for band in &self.bands.all {
            let mesh = band.walker.mesh();
            hash.mix(mesh.positions.len() as u64);
            mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| hash.mix(u64::from(x.to_bits())));
            mesh.triangles.iter().flatten().for_each(|&v| hash.mix(u64::from(v)));
        }
        hash.value()
    }
}
