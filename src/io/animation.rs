//! Writer of animated GLB files: a sequence of meshes, each shown for one frame or more.
//!
//! Meshes of different connectivity cannot be morphed into one another. Each mesh is therefore a node of its own, whose
//! scale is 1 during its frames and 0 before and after. A viewer that plays no animations shows the first mesh.

use super::WriteOptions;
use super::frame::half_turn;
use super::glb_writer::{DocumentBuilder, json_array_member, translation};
use crate::math::{DVec3, Vec3};
use crate::mesh::{MeshError, TriangleMesh};
use std::borrow::Borrow;

/// Shortest accepted duration of an animation frame, in seconds. Screens show no shorter frames, and after hours of
/// animation, times closer together than this are equal in single precision.
const MIN_FRAME_SECONDS: f64 = 1e-3;

/// Longest accepted duration of an animation frame, in seconds: with longer ones a player seems to stand still.
const MAX_FRAME_SECONDS: f64 = 1e3;

/// Returns the bytes of an animated GLB that shows the meshes in order, `frame_seconds` (0.001 to 1000) each. Every
/// mesh is stored as by [`write_mesh`](super::write_mesh), with its texture, normals, texture coordinates and colours.
///
/// A mesh equal to the previous frame's is not stored again; nor is a texture equal to an earlier one. Nothing is shown
/// in a frame whose mesh has no triangles, such as one in which a tracked surface has ended.
///
/// # Errors
/// [`MeshError::InvalidArgument`] if no frame has triangles, if a mesh is not valid, or if the time is out of range; [`MeshError::TooLarge`] if the file would exceed 4 GiB or there is not enough memory for it.
pub fn write_animation<M: Borrow<TriangleMesh>>(
    frames: impl IntoIterator<Item = M>,
    frame_seconds: f64,
) -> Result<Vec<u8>, MeshError> {
    let mut writer = AnimationWriter::default();
    frames.into_iter().try_for_each(|frame| writer.add(frame.borrow()))?;
    writer.finish(frame_seconds)
}

/// Builder of an animated GLB that takes one frame at a time, so that not all meshes have to be in memory at once; see
/// [`write_animation`].
#[derive(Default)]
pub struct AnimationWriter {
    parts: DocumentBuilder,
    /// Whether meshes are rotated by 180° about z.
    turns: bool,
    /// For each mesh stored in the file, the index of the first animation frame that shows it, and of the first after
    /// that which does not.
    shown: Vec<[usize; 2]>,
    /// The origin of each mesh stored in the file.
    origins: Vec<DVec3>,
    frames: usize,
    last: Option<TriangleMesh>,
}

impl AnimationWriter {
    /// Creates an animation without frames, with what is to be stated in it as
    /// [`write_mesh_with`](super::write_mesh_with) does.
    pub fn new(options: &WriteOptions) -> Self {
        Self { parts: DocumentBuilder::new(options), turns: options.turns(), ..Self::default() }
    }

    /// Appends a frame that shows `mesh`.
    ///
    /// # Errors
    /// As [`write_animation`]; after an error the frame is not added.
    pub fn add(&mut self, mesh: &TriangleMesh) -> Result<(), MeshError> {
        mesh.validate()?;
        let frame = self.frames;
        if mesh.triangles.is_empty() {
            self.last = None;
        } else if self.last.as_ref() == Some(mesh) {
            self.shown.iter_mut().last().into_iter().for_each(|[_, end]| *end = frame + 1);
        } else {
            let turned = self.turns.then(|| half_turn(mesh.clone()));
            let stored = turned.as_ref().unwrap_or(mesh);
            self.parts.mesh(stored)?;
            self.shown.push([frame, frame + 1]);
            self.origins.push(stored.origin);
            self.last = Some(mesh.clone());
        }
        self.frames += 1;
        Ok(())
    }

    /// Returns the bytes of the GLB file, in which each frame lasts `frame_seconds`.
    ///
    /// # Errors
    /// As [`write_animation`].
    pub fn finish(mut self, frame_seconds: f64) -> Result<Vec<u8>, MeshError> {
        if self.shown.is_empty() {
            return Err(invalid_argument("frames", "must contain at least one frame with triangles".into()));
        }
        if !(MIN_FRAME_SECONDS..=MAX_FRAME_SECONDS).contains(&frame_seconds) {
            let problem =
                format!("must be {MIN_FRAME_SECONDS} to {MAX_FRAME_SECONDS} seconds, got {frame_seconds}");
            return Err(invalid_argument("frameSeconds", problem));
        }
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for mesh in 0..self.shown.len() {
            let (times, sizes) = self.track(mesh, frame_seconds);
            let input = self.parts.times(&times);
            let output = self.parts.vectors(sizes.iter().map(|&size| Vec3::splat(size)), None, "");
            samplers.push(format!(r#"{{"input":{input},"output":{output},"interpolation":"STEP"}}"#));
            channels.push(format!(r#"{{"sampler":{mesh},"target":{{"node":{mesh},"path":"scale"}}}}"#));
            self.parts.nodes.push(node(mesh, self.origins[mesh]));
        }
        let tracks =
            [json_array_member("samplers", &samplers), json_array_member("channels", &channels)].concat();
        let animation = [format!("{{{}}}", tracks.trim_start_matches(','))];
        self.parts.finish(&json_array_member("animations", &animation))
    }

    /// Returns the animation track that shows and hides mesh number `mesh`: the times in seconds at which its scale
    /// changes, and the scales (1 shown, 0 hidden). The last mesh has a key at the end in any case: without it the
    /// animation would end when its last change of scale begins.
    fn track(&self, mesh: usize, frame_seconds: f64) -> (Vec<f32>, Vec<f32>) {
        let seconds = |frame: usize| (frame as f64 * frame_seconds) as f32;
        let [start, end] = self.shown[mesh];
        let mut track = vec![(seconds(start), 1.0)];
        if start > 0 {
            track.insert(0, (0.0, 0.0));
        }
        if end < self.frames {
            track.push((seconds(end), 0.0));
        }
        if mesh + 1 == self.shown.len() {
            track.push((seconds(self.frames), if end < self.frames { 0.0 } else { 1.0 }));
        }
        track.into_iter().unzip()
    }
}

/// Returns the JSON of the glTF node of mesh number `mesh`. Without animation, all nodes but the first have scale 0, so
/// that a viewer that plays no animations shows only the first mesh.
fn node(mesh: usize, origin: DVec3) -> String {
    let scale = if mesh == 0 { "" } else { r#","scale":[0,0,0]"# };
    format!(r#"{{"mesh":{mesh}{scale}{}}}"#, translation(origin))
}

fn invalid_argument(parameter: &'static str, problem: String) -> MeshError {
    MeshError::InvalidArgument { parameter, problem }
}
