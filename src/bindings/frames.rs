//! Bindings of the frames of sequences.

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::error::Failure;
use super::volume::RawVolume;
use vesicle::volume::Volume;

/// The raw handle of a list of volumes to be joined into one 4D volume.
#[wasm_bindgen]
#[derive(Default)]
pub struct RawFrames(Vec<Volume>);

#[wasm_bindgen]
impl RawFrames {
    /// Creates an empty list of volumes.
    #[wasm_bindgen(constructor)]
    pub fn new() -> RawFrames {
        Self::default()
    }

    /// Appends a volume, which contributes all its frames. Its voxels are not copied.
    pub fn push(&mut self, volume: &RawVolume) {
        self.0.push(volume.0.clone());
    }

    /// Returns the 4D volume of all frames; the list cannot be used afterwards. Without `frame_seconds`, the time
    /// between frames is that of the first volume.
    pub fn join(self, frame_seconds: Option<f64>) -> Result<RawVolume, JsValue> {
        Ok(RawVolume(Volume::from_frames(&self.0, frame_seconds).map_err(Failure::from)?))
    }
}
