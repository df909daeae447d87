//! Saving a run and going on with it, bit for bit. A state holds the deformed base and its link; the decomposition is made
//! again from the same options, and the detail put back.

use super::link::{Link, Linked};
use super::motion::Movers;
use super::{MultiresParams, MultiresolutionModel};
use crate::math::Vec3;
use crate::mesh::Mesh;
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Mark, can_be_checked, opened, sealed};
use serde::{Deserialize, Serialize};

const MARK: Mark = *b"VSCLMRS\x02";

/// Everything a run has beside its decomposition.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: MultiresParams,
    movers: Movers,
    surface: Mesh,
    /// Triangle and weights of each slot.
    link: Vec<(u32, Vec3)>,
    iteration: u32,
    passing: u32,
    components: u32,
    residual: f64,
}

impl MultiresolutionModel {
    /// The run as bytes, without the surfaces it was made of.
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

    /// Goes on from bytes that [`Self::save`] gave, for a model of the same surfaces and first ellipsoids.
    ///
    /// # Errors
    /// [`MethodError::BadState`] where the bytes are none of those; the run is then as it was.
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
        self.surface.count_on_from(&replaced);
        (self.iteration, self.passing) = (state.iteration, state.passing);
        (self.components, self.residual) = (state.components, state.residual);
        self.show();
        Ok(())
    }

    /// Places on the base; nothing where one has no such triangle.
    fn linked(&self, places: &[(u32, Vec3)]) -> Option<Link> {
        let base = &self.bands.base().walker;
        let count = base.mesh().triangles.len();
        let place = |&(triangle, weights): &(u32, Vec3)| {
            let fits = (triangle as usize) < count && weights.is_finite();
            fits.then(|| Linked::at(base, triangle, weights))
        };
        places.iter().map(place).collect()
    }

    /// A number that tells decompositions apart.
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
