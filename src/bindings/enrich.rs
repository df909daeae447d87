//! Bindings of the interpolation of slices.

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::error::Failure;
use super::volume::RawVolume;
use vesicle::volume::Enrichment;

#[wasm_bindgen]
impl RawVolume {
    /// Returns the volume with `factor` − 1 slices inserted between neighbouring ones along the axis of the largest
    /// spacing, interpolated by optical flow if `flow`, else linearly. Without `factor`, it is chosen so that voxels
    /// become nearly cubes.
    #[wasm_bindgen(js_name = enrichSlices)]
    pub fn enrich_slices(&self, factor: Option<usize>, flow: bool) -> Result<RawVolume, JsValue> {
        let method = if flow { Enrichment::Flow } else { Enrichment::Linear };
        Ok(RawVolume(self.0.enrich_slices(factor, method).map_err(Failure::from)?))
    }
}
