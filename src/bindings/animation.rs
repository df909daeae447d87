//! Meshes one after the other, as the bytes of an animated GLB.

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::error::Failure;
use super::mesh::RawMesh;
use crate::io::AnimationWriter;

/// An animation that grows frame by frame.
#[wasm_bindgen]
#[derive(Default)]
pub struct RawAnimation(AnimationWriter);

#[wasm_bindgen]
impl RawAnimation {
    /// Without frames.
    #[wasm_bindgen(constructor)]
    pub fn new() -> RawAnimation {
        RawAnimation::default()
    }

    /// Adds a mesh as it is now.
    pub fn add(&mut self, mesh: &RawMesh) -> Result<(), JsValue> {
        Ok(self.0.add(&mesh.triangles()).map_err(Failure::from)?)
    }

    /// The bytes of the file; nothing is left of the animation.
    pub fn finish(self, frame_seconds: f64) -> Result<Vec<u8>, JsValue> {
        Ok(self.0.finish(frame_seconds).map_err(Failure::from)?)
    }
}
