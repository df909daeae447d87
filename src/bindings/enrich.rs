//! Bindings of the interpolation of slices.

use std::task::Poll;

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::error::Failure;
use super::volume::RawVolume;
use vesicle::pauses::{Computation, Pauses, advance, finished};
use vesicle::volume::{Enrichment, Volume, VolumeError};

#[wasm_bindgen]
impl RawVolume {
    /// Returns the volume with `factor` − 1 slices inserted between neighbouring ones along the axis of the largest
    /// spacing, interpolated by optical flow if `flow`, else linearly. Without `factor`, it is chosen so that voxels
    /// become nearly cubes. More than `most` bytes, if they are given, are too large.
    #[wasm_bindgen(js_name = enrichSlices)]
    pub fn enrich_slices(
        &self,
        factor: Option<usize>,
        flow: bool,
        most: Option<u32>,
    ) -> Result<RawVolume, JsValue> {
        let pauses = Pauses::default();
        let made = self.0.enrich_in_slices(factor, method(flow), most.map(u64::from), &pauses);
        Ok(RawVolume(finished(made).map_err(Failure::from)?))
    }

    /// Begins to do the same in slices of work.
    #[wasm_bindgen(js_name = enrichInSlices)]
    pub fn enrich_in_slices(&self, factor: Option<usize>, flow: bool, most: Option<u32>) -> RawEnrichment {
        let volume = self.0.clone();
        RawEnrichment(Box::pin(async move {
            volume.enrich_in_slices(factor, method(flow), most.map(u64::from), &Pauses::default()).await
        }))
    }
}

/// A volume in which slices are being interpolated.
#[wasm_bindgen]
pub struct RawEnrichment(Computation<Result<Volume, VolumeError>>);

#[wasm_bindgen]
impl RawEnrichment {
    /// Does a slice of the work; returns the volume at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<Option<RawVolume>, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(None),
            Poll::Ready(volume) => Ok(Some(RawVolume(volume.map_err(Failure::from)?))),
        }
    }
}

fn method(flow: bool) -> Enrichment {
    if flow { Enrichment::Flow } else { Enrichment::Linear }
}
