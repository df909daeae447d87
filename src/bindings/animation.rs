//! Bindings of the writer of animated GLB files.

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::error::Failure;
use super::mesh::RawMesh;
use vesicle::io::AnimationWriter;

/// The raw handle with which `animationGlb` builds an animated GLB file, one frame at a time.
#[wasm_bindgen]
#[derive(Default)]
pub struct RawAnimation(AnimationWriter);

#[wasm_bindgen]
impl RawAnimation {
    /// Creates an animation without frames.
    #[wasm_bindgen(constructor)]
    pub fn new() -> RawAnimation {
        RawAnimation::default()
    }

    /// Sets notes for the reader of the file: lines `code: text`.
    pub fn note(&mut self, notes: &str) {
        self.0.note(notes);
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
