//! Saves a run and restores it bit for bit. A state holds the boundary votes and the surfaces; the image comes from the
//! same volume, and sums around the newest frame are computed again.

use super::follow::{Follower, FrameFacts};
use super::vote::{Faces, TIME};
use super::{Component, SurfaceTracker, TrackingParams};
use crate::math::Vec3;
use crate::mesh::{Mesh, TriangleMesh};
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Mark, can_be_checked, opened, sealed};
use serde::{Deserialize, Serialize};

const MARK: Mark = *b"VSCLTRK\x01";

/// The saved state: everything of a run but its image.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: TrackingParams,
    faces: Vec<Faces>,
    mesh: Mesh,
    /// Mean edge of the first frame's mesh, once there is one.
    edge: Option<f64>,
    /// Positions and triangles by frame.
    meshes: Vec<(Vec<Vec3>, Vec<[u32; 3]>)>,
    facts: Vec<FrameFacts>,
    closing: Option<f64>,
    steps: u32,
}

impl SurfaceTracker {
    /// Serialises the run, without the image.
    pub fn save(&self) -> Vec<u8> {
        let plain = |mesh: &TriangleMesh| (mesh.positions.clone(), mesh.triangles.clone());
        sealed(
            &MARK,
            &State {
                fingerprint: self.fingerprint(),
                params: self.params.clone(),
                faces: self.faces.clone(),
                mesh: self.mesh.clone(),
                edge: self.follower.as_ref().map(|follower| follower.edge),
                meshes: self.meshes.iter().map(plain).collect(),
                facts: self.facts.clone(),
                closing: self.closing,
                steps: self.steps,
            },
        )
    }

    /// Restores a run from the bytes of [`Self::save`], for a tracker of the same volume, box, component and start.
    ///
    /// # Errors
    /// [`MethodError::BadState`] for any other bytes; the run is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let state: State = opened(&MARK, bytes)?;
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        if state.fingerprint != self.fingerprint() {
            return bad("volume", "the state belongs to another volume, box, component or start");
        }
        let Ok(params) = self.completed(state.params) else {
            return bad("parameters", "they are out of range");
        };
        if state.faces.len() > self.frames() || !state.faces.iter().all(|faces| self.are_sound(faces)) {
            return bad("boundary", "it is not in the box");
        }
        let meshes: Vec<TriangleMesh> = (state.meshes.into_iter())
            .map(|(positions, triangles)| TriangleMesh { positions, triangles, ..TriangleMesh::default() })
            .collect();
        let frames_fit = meshes.len() <= self.frames() && meshes.len() == state.facts.len();
        let boundary_fits = meshes.is_empty() || state.faces.len() == self.frames();
        let pixel = self.image.pixel;
        let edge_fits = state.edge.is_none_or(|edge| (1e-3 * pixel..1e3 * pixel).contains(&edge));
        let closing_fits = state.closing.is_none() || params.cyclic && meshes.len() == self.frames();
        let begins_well = !meshes.is_empty() || state.mesh.to_triangles() == self.start.to_triangles();
        if !edge_fits || !closing_fits || !begins_well {
            return bad("frames", "they are none of this tracker's");
        }
        if !frames_fit || !boundary_fits || state.edge.is_some() == meshes.is_empty() {
            return bad("frames", "their parts do not fit each other");
        }
        if !can_be_checked(&state.mesh)
            || state.mesh.attribute_counts() != self.start.attribute_counts()
            || state.mesh.check().is_err()
            || meshes.iter().any(|mesh| mesh.validate().is_err())
        {
            return bad("surface", "its parts do not fit each other");
        }
        self.params = params;
        self.begin();
        let replaced = std::mem::replace(&mut self.mesh, state.mesh);
        self.mesh.advance_versions_past(&replaced);
        self.faces = state.faces;
        (self.meshes, self.facts) = (meshes, state.facts);
        (self.closing, self.steps) = (state.closing, state.steps);
        self.follower = state.edge.map(Follower::new);
        self.moment = self.newest_moment();
        Ok(())
    }

    fn are_sound(&self, faces: &Faces) -> bool {
        let dims = self.region.dims;
        let is_sound = |direction: usize, voxel: u32, weight: f32| {
            let inside = (voxel as usize) < dims.iter().product()
                && (direction == TIME || self.region.voxel(voxel)[direction] + 1 < dims[direction]);
            inside && weight > 0.0 && weight <= 1.0
        };
        (faces.iter().enumerate())
            .all(|(direction, list)| list.iter().all(|face| is_sound(direction, face.voxel, face.weight)))
    }

    /// Returns a hash of the image, the box, the component and the start, which identifies the input of a run.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        let mut mix = |values: &[f64]| values.iter().for_each(|value| hash.mix(value.to_bits()));
        mix(&self.region.to_world.to_cols_array());
        mix(&self.region.spacing.to_array());
        mix(&[self.region.step]);
        if let Component::Nearest(p) = self.component {
            mix(&p.to_array());
        }
        self.region.dims.iter().for_each(|&n| hash.mix(n as u64));
        for frame in &self.region.frames {
            let (words, rest) = frame.as_chunks::<8>();
            words.iter().for_each(|&word| hash.mix(u64::from_le_bytes(word)));
            rest.iter().for_each(|&level| hash.mix(u64::from(level)));
        }
        let start = self.start.to_triangles();
        start.positions.iter().flat_map(|p| p.to_array()).for_each(|x| hash.mix(u64::from(x.to_bits())));
        start.triangles.iter().flatten().for_each(|&v| hash.mix(u64::from(v)));
        hash.value()
    }
}
