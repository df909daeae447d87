//! Bindings of the writer of animated GLB files.

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::write_options;
use super::error::Failure;
use super::mesh::RawMesh;
use vesicle::io::AnimationWriter;

/// The raw handle with which `animationGlb` builds an animated GLB file, one frame at a time.
#[wasm_bindgen]
pub struct RawAnimation(AnimationWriter);

#[wasm_bindgen]
impl RawAnimation {
    /// Creates an animation without frames, with notes for the reader of the file: lines `code: text`. `space` is that of
    /// the meshes, `written_as` that in the file, and `unit` the unit of positions, each empty if it is not to be stated.
    #[wasm_bindgen(constructor)]
    pub fn new(notes: &str, space: &str, written_as: &str, unit: &str) -> RawAnimation {
        RawAnimation(AnimationWriter::new(&write_options(notes, [space, written_as, unit])))
    }

    /// Appends a frame that shows a mesh in its current state.
    pub fn add(&mut self, mesh: &RawMesh) -> Result<(), JsValue> {
        Ok(self.0.add(&mesh.triangles()).map_err(Failure::from)?)
    }

    /// Returns the bytes of the GLB file, in which each frame lasts `frame_seconds`; the animation cannot be used
    /// afterwards.
    pub fn finish(self, frame_seconds: f64) -> Result<Vec<u8>, JsValue> {
        Ok(self.0.finish(frame_seconds).map_err(Failure::from)?)
    }
}
