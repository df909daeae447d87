//! Meshes one after the other, as an animated GLB.
//!
//! Meshes of different connectivity cannot be morphed into one another, so each is a node of its own that has its size
//! in its own time and the size 0 before and after. Where animations are not played the first one is seen.

use super::glb_writer::{Parts, table};
use crate::math::Vec3;
use crate::mesh::{MeshError, TriangleMesh};
use std::borrow::Borrow;

/// The shortest time of a frame, seconds: no screen shows less, and after hours times that are nearer are one in single
/// precision.
const SHORTEST: f64 = 1e-3;

/// The longest time of a frame, seconds: beyond it a player seems to stand still.
const LONGEST: f64 = 1e3;

/// A GLB that shows meshes one after the other, `frame_seconds` (0.001 to 1000) each; every mesh as
/// [`write_mesh`](super::write_mesh) writes it, with its texture, normals, texture coordinates and colours.
///
/// Frames that are equal to the one before are not stored again, nor are equal textures.
///
/// # Errors
/// [`MeshError::InvalidArgument`] without frames, for a mesh that is not valid or has no triangles, and for a time out
/// of range; [`MeshError::TooLarge`] where the file would pass 4 GiB, or there is no memory for it.
pub fn write_animation<M: Borrow<TriangleMesh>>(
    frames: impl IntoIterator<Item = M>,
    frame_seconds: f64,
) -> Result<Vec<u8>, MeshError> {
    let mut writer = AnimationWriter::default();
    frames.into_iter().try_for_each(|frame| writer.add(frame.borrow()))?;
    writer.finish(frame_seconds)
}

/// An animated GLB that grows frame by frame, so that not all meshes have to be there at a time; see
/// [`write_animation`].
#[derive(Default)]
pub struct AnimationWriter {
    parts: Parts,
    /// For each mesh in the file, the number of the frame it is seen from.
    starts: Vec<usize>,
    frames: usize,
    last: Option<TriangleMesh>,
}

impl AnimationWriter {
    /// Adds a frame at the end.
    ///
    /// # Errors
    /// As [`write_animation`]; the frame is not added then.
    pub fn add(&mut self, mesh: &TriangleMesh) -> Result<(), MeshError> {
        mesh.validate()?;
        if mesh.triangles.is_empty() {
            return Err(refused("frames", format!("number {} has no triangles", self.frames)));
        }
        if self.last.as_ref() != Some(mesh) {
            self.parts.mesh(mesh)?;
            self.starts.push(self.frames);
            self.last = Some(mesh.clone());
        }
        self.frames += 1;
        Ok(())
    }

    /// The file.
    ///
    /// # Errors
    /// As [`write_animation`].
    pub fn finish(mut self, frame_seconds: f64) -> Result<Vec<u8>, MeshError> {
        if self.frames == 0 {
            return Err(refused("frames", "there are none; at least one is needed".into()));
        }
        if !(SHORTEST..=LONGEST).contains(&frame_seconds) {
            let problem = format!("{frame_seconds}; {SHORTEST} to {LONGEST} seconds are accepted");
            return Err(refused("frameSeconds", problem));
        }
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for mesh in 0..self.starts.len() {
            let (times, sizes) = self.track(mesh, frame_seconds);
            let input = self.parts.times(&times);
            let output = self.parts.vectors(sizes.iter().map(|&size| Vec3::splat(size)), None, "");
            samplers.push(format!(r#"{{"input":{input},"output":{output},"interpolation":"STEP"}}"#));
            channels.push(format!(r#"{{"sampler":{mesh},"target":{{"node":{mesh},"path":"scale"}}}}"#));
            self.parts.nodes.push(node(mesh));
        }
        let tracks = [table("samplers", &samplers), table("channels", &channels)].concat();
        let animation = [format!("{{{}}}", tracks.trim_start_matches(','))];
        self.parts.finish(&table("animations", &animation))
    }

    /// When mesh number `mesh` changes its size, in seconds, and to what. The last one keeps it up to the end: without
    /// a time there the animation would end as its last frame begins.
    fn track(&self, mesh: usize, frame_seconds: f64) -> (Vec<f32>, Vec<f32>) {
        let seconds = |frame: usize| (frame as f64 * frame_seconds) as f32;
        let next = self.starts.get(mesh + 1);
        let mut track = vec![(seconds(self.starts[mesh]), 1.0)];
        track.push(next.map_or((seconds(self.frames), 1.0), |&next| (seconds(next), 0.0)));
        if mesh > 0 {
            track.insert(0, (0.0, 0.0));
        }
        track.into_iter().unzip()
    }
}

/// At rest all but the first have no size: the place of those that play no animation.
fn node(mesh: usize) -> String {
    let scale = if mesh == 0 { "" } else { r#","scale":[0,0,0]"# };
    format!(r#"{{"mesh":{mesh}{scale}}}"#)
}

fn refused(parameter: &'static str, problem: String) -> MeshError {
    MeshError::InvalidArgument { parameter, problem }
}
