//! Saves a tracking run and restores it bit for bit. The saved state holds the boundary votes and the surfaces; the
//! image comes from the same volume, and the weights of boundary points around the newest frame are computed again.

use super::cavity::{Filled, MAX_FILLED};
use super::frame_tracker::{FrameStatistics, FrameTracker};
use super::vote::{Faces, TIME};
use super::working_space::WorkingSpace;
use super::{Cavity, Component, SurfaceTracker, TrackingParams};
use crate::math::Vec3;
use crate::mesh::{Mesh, TriangleMesh};
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Magic, can_be_checked, decode, encode};
use crate::pauses::{Pauses, finished};
use serde::{Deserialize, Serialize};

const MAGIC: Magic = *b"VSCLTRK\x01";

/// That of states which also list the frames in which one surface ended and another began. States without such frames
/// keep the first layout.
const MAGIC_WITH_LOST: Magic = *b"VSCLTRK\x02";

/// That of states of closed cavities, which also list the frames as above, and the voxels filled in each frame.
const MAGIC_CLOSED: Magic = *b"VSCLTRK\x03";

/// The saved state of a [`SurfaceTracker`]: everything of a run but its input and what is computed again.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: TrackingParams,
    faces: Vec<Faces>,
    mesh: Mesh,
    /// Mean edge length, in world units, of the first frame's mesh, `None` before there is one.
    edge: Option<f64>,
    /// Positions and triangles of the surface in each frame tracked so far.
    meshes: Vec<(Vec<Vec3>, Vec<[u32; 3]>)>,
    statistics: Vec<FrameStatistics>,
    cycle_closure_error: Option<f64>,
    steps: u32,
}

impl SurfaceTracker {
    /// Returns the run as bytes for [`Self::restore`], without its input: the image, the box, the component and the
    /// start.
    pub fn save(&self) -> Vec<u8> {
        let plain = |mesh: &TriangleMesh| (mesh.positions.clone(), mesh.triangles.clone());
        let state = State {
            fingerprint: self.fingerprint,
            params: self.params.clone(),
            faces: self.faces.clone(),
            mesh: self.mesh.clone(),
            edge: self.frame_tracker.as_ref().map(|tracker| tracker.edge / self.region.space.scale),
            meshes: self.meshes.iter().map(plain).collect(),
            statistics: self.statistics.clone(),
            cycle_closure_error: self.cycle_closure_error,
            steps: self.steps,
        };
        if self.cavity == Cavity::Closed {
            encode(&MAGIC_CLOSED, &(state, &self.lost, &self.filled))
        } else if self.lost.is_empty() {
            encode(&MAGIC, &state)
        } else {
            encode(&MAGIC_WITH_LOST, &(state, &self.lost))
        }
    }

    /// Restores a run from the bytes of [`Self::save`], for a tracker of the same volume, box, component and start.
    ///
    /// # Errors
    /// [`MethodError::BadState`] for any other bytes; the run is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        let is_closed = bytes.starts_with(&MAGIC_CLOSED);
        let is_open = bytes.starts_with(&MAGIC) || bytes.starts_with(&MAGIC_WITH_LOST);
        match self.cavity {
            Cavity::Closed if is_open => return bad("cavity", "saved with \"open\""),
            Cavity::Open if is_closed => return bad("cavity", "saved with \"closed\""),
            _ => {}
        }
        let (mut state, lost, filled): (State, Vec<u32>, Vec<Vec<Filled>>) = match self.cavity {
            Cavity::Closed => decode(&MAGIC_CLOSED, bytes)?,
            Cavity::Open if bytes.starts_with(&MAGIC_WITH_LOST) => {
                let (state, lost) = decode(&MAGIC_WITH_LOST, bytes)?;
                (state, lost, Vec::new())
            }
            Cavity::Open => (decode(&MAGIC, bytes)?, Vec::new(), Vec::new()),
        };
        if state.fingerprint != self.fingerprint {
            return bad("volume", "the state belongs to another volume, box, component, cavity or start");
        }
        let Ok(params) = self.with_defaults(state.params) else {
            return bad("parameters", "out of range");
        };
        if state.faces.len() > self.frames() || !state.faces.iter().all(|faces| self.are_valid(faces)) {
            return bad("boundary", "boundary votes outside the box");
        }
        if !self.are_valid_fillings(&filled, !state.faces.is_empty()) {
            return bad("cavity", "inconsistent with this tracker");
        }
        let origin = self.region.space.origin;
        state.mesh.set_origin(origin);
        let meshes: Vec<TriangleMesh> = (state.meshes.into_iter())
            .map(|(positions, triangles)| TriangleMesh {
                positions,
                origin,
                triangles,
                ..TriangleMesh::default()
            })
            .collect();
        let frames_fit = meshes.len() <= self.frames() && meshes.len() == state.statistics.len();
        let boundary_fits = meshes.is_empty() || state.faces.len() == self.frames();
        let pixel = self.image.shortest_side;
        let edge_fits = state.edge.is_none_or(|edge| (1e-3 * pixel..1e3 * pixel).contains(&edge));
        let closure_fits =
            state.cycle_closure_error.is_none() || params.cyclic && meshes.len() == self.frames();
        let start_fits = !meshes.is_empty() || state.mesh.to_triangles() == self.start.to_triangles();
        if !edge_fits || !closure_fits || !start_fits {
            return bad("frames", "inconsistent with this tracker");
        }
        let had_surface = meshes.iter().any(|mesh| !mesh.triangles.is_empty());
        let edge_is_known = state.edge.is_some() || !had_surface;
        let lost_fit = lost.iter().all(|&frame| (frame as usize) < meshes.len());
        let is_newest = meshes.last().is_none_or(|last| last.triangles.len() == state.mesh.triangle_count());
        if !frames_fit || !boundary_fits || !edge_is_known || !lost_fit || !is_newest {
            return bad("frames", "inconsistent");
        }
        if !can_be_checked(&state.mesh)
            || state.mesh.attribute_counts() != self.start.attribute_counts()
            || state.mesh.check().is_err()
            || meshes.iter().any(|mesh| mesh.validate().is_err())
        {
            return bad("surface", "inconsistent");
        }
        let points: usize = state.faces.iter().flatten().map(Vec::len).sum();
        let is_allowed = points <= self.limits.points()
            && meshes.iter().all(|mesh| mesh.positions.len() <= self.limits.vertices());
        if !is_allowed || state.faces.iter().any(|faces| self.limits.check_faces(faces).is_err()) {
            return bad("surface", "larger than this tracker allows");
        }
        self.params = params;
        self.restart();
        self.filled = filled;
        self.region.fill(&self.filled);
        let replaced = std::mem::replace(&mut self.mesh, state.mesh);
        self.mesh.advance_versions_past(&replaced);
        self.faces = state.faces;
        (self.meshes, self.statistics) = (meshes, state.statistics);
        self.intensities_at_surface = self
            .meshes
            .iter()
            .enumerate()
            .map(|(frame, mesh)| self.measured_intensities(frame, mesh))
            .collect();
        let measured = self.meshes.iter().zip(&self.intensities_at_surface).enumerate();
        let facts = measured.map(|(frame, (mesh, intensities))| {
            finished(self.measured_facts(frame, mesh, *intensities, &Pauses::default()))
        });
        self.facts = facts.collect();
        (self.cycle_closure_error, self.steps, self.lost) = (state.cycle_closure_error, state.steps, lost);
        self.frame_tracker = state.edge.map(|edge| FrameTracker::new(edge * self.region.space.scale));
        self.samples = self.newest_samples();
        Ok(())
    }

    fn are_valid(&self, faces: &Faces) -> bool {
        let dims = self.region.dims;
        let is_sound = |direction: usize, voxel: u32, weight: f32| {
            let inside = (voxel as usize) < dims.iter().product()
                && (direction == TIME || self.region.voxel(voxel)[direction] + 1 < dims[direction]);
            inside && weight > 0.0 && weight <= 1.0
        };
        (faces.iter().enumerate())
            .all(|(direction, list)| list.iter().all(|face| is_sound(direction, face.voxel, face.weight)))
    }

    /// Returns whether filled voxels are in the region, and were as dark as the image is; `is_begun` tells whether the boundary
    /// of a frame has been found.
    fn are_valid_fillings(&self, filled: &[Vec<Filled>], is_begun: bool) -> bool {
        let original = |frame: usize, voxel: u32| {
            let now = self.filled.get(frame).and_then(|list| {
                let at = list.binary_search_by_key(&voxel, |one| one.voxel).ok()?;
                list.get(at)
            });
            now.map_or_else(|| self.region.frames[frame].get(voxel as usize).copied(), |one| Some(one.before))
        };
        let is_sound = |(frame, list): (usize, &Vec<Filled>)| {
            list.is_sorted_by(|a, b| a.voxel < b.voxel)
                && list
                    .iter()
                    .all(|one| original(frame, one.voxel) == Some(one.before) && one.level <= MAX_FILLED)
        };
        let has_all = filled.len() == self.frames() && self.cavity == Cavity::Closed;
        let may_lack = !is_begun || self.cavity == Cavity::Open;
        (has_all || filled.is_empty() && may_lack) && filled.iter().enumerate().all(is_sound)
    }

    /// Returns a hash of the image, the box, the component and the start, by which [`Self::restore`] recognises whether
    /// a saved run has the same input.
    pub(super) fn input_hash(&self) -> u64 {
        let mut hash = Hash::new();
        let mut mix = |values: &[f64]| values.iter().for_each(|value| hash.mix(value.to_bits()));
        mix(&self.region.to_space.to_cols_array());
        if self.region.space != WorkingSpace::default() {
            mix(&self.region.space.origin.to_array());
            mix(&[self.region.space.scale]);
        }
        mix(&self.region.spacing.to_array());
        mix(&[self.region.quantum]);
        if self.cavity == Cavity::Closed {
            mix(&[1.0]);
        }
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
