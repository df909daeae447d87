//! Bindings of label maps and masks: labels, thresholds, overlap, and parts of volumes and their voxels.

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::point;
#[cfg(feature = "deformable")]
use super::deformable::RawDeformable;
use super::error::Failure;
use super::volume::{RawVolume, voxels};
use vesicle::io::{Compression, VolumeFormat, write_volume};
use vesicle::volume::{Interpolation, Region, ResampleGrid, VolumeError};

#[wasm_bindgen]
impl RawVolume {
    /// Returns the labels of one frame in ascending order: the value and the number of voxels of each in turn.
    pub fn labels(&self, frame: usize) -> Result<Vec<f64>, JsValue> {
        let labels = self.0.labels(frame).map_err(Failure::from)?;
        Ok(labels.iter().flat_map(|label| [label.value, label.voxels as f64]).collect())
    }

    /// Returns the 0/1 mask of the voxels that have one of the labels `values`.
    pub fn label(&self, values: &[f64]) -> Result<RawVolume, JsValue> {
        Ok(RawVolume(self.0.label(values).map_err(Failure::from)?))
    }

    /// Returns the 0/1 mask of the voxels whose intensity is from `low` to `high`, both included.
    pub fn threshold(&self, low: f64, high: f64) -> Result<RawVolume, JsValue> {
        Ok(RawVolume(self.0.threshold(low, high).map_err(Failure::from)?))
    }

    /// Returns the Dice coefficient of the voxels with a label, or without one of those that are not 0.
    pub fn dice(&self, other: &RawVolume, label: Option<f64>) -> Result<f64, JsValue> {
        Ok(self.0.dice(&other.0, label).map_err(Failure::from)?)
    }

    /// Returns the voxels with indices from `min` (included) to `max` (excluded) along x, y and z.
    pub fn crop(&self, min: &[u32], max: &[u32]) -> Result<RawVolume, JsValue> {
        Ok(RawVolume(self.0.crop(three("min", min)?, three("max", max)?).map_err(Failure::from)?))
    }

    /// Returns one frame as a 3D volume.
    pub fn frame(&self, index: usize) -> Result<RawVolume, JsValue> {
        Ok(RawVolume(self.0.frame(index).map_err(Failure::from)?))
    }

    /// Returns the volume resampled to `dims` voxels in the same field of view, by nearest voxels if `nearest`, else
    /// linearly.
    #[wasm_bindgen(js_name = resampleToDims)]
    pub fn resample_to_dims(
        &self,
        dims: &[u32],
        nearest: bool,
        most: Option<u32>,
    ) -> Result<RawVolume, JsValue> {
        self.resampled(ResampleGrid::Dims(three("dims", dims)?), nearest, most)
    }

    /// Returns the volume resampled to voxels of about the size `spacing` in the same field of view.
    #[wasm_bindgen(js_name = resampleToSpacing)]
    pub fn resample_to_spacing(
        &self,
        spacing: &[f64],
        nearest: bool,
        most: Option<u32>,
    ) -> Result<RawVolume, JsValue> {
        self.resampled(ResampleGrid::Spacing(point(spacing)?.to_array()), nearest, most)
    }

    /// Returns the volume resampled to the grid of another one; voxels outside this one have intensity 0.
    #[wasm_bindgen(js_name = resampleLike)]
    pub fn resample_like(
        &self,
        like: &RawVolume,
        nearest: bool,
        most: Option<u32>,
    ) -> Result<RawVolume, JsValue> {
        self.resampled(ResampleGrid::Like(&like.0), nearest, most)
    }

    /// Changes the voxels of one frame in the region of `dims` voxels from index `min` to those of the typed array
    /// `data`, x fastest.
    pub fn write(&mut self, min: &[u32], dims: &[u32], data: &JsValue, frame: usize) -> Result<(), JsValue> {
        Ok(self.0.write(region(min, dims)?, &voxels(data)?, frame).map_err(Failure::from)?)
    }

    /// Returns the volume as a file; `format` is nifti, nrrd or mha. Compressed if `gzip`. Refused if intensities of more than
    /// `most` bytes would be stored in place of the voxels.
    #[wasm_bindgen(js_name = toBytes)]
    pub fn to_bytes(&self, format: &str, gzip: bool, most: Option<u32>) -> Result<Vec<u8>, JsValue> {
        let format = VolumeFormat::from_name(format)
            .ok_or_else(|| Failure::invalid("format", "must be one of nifti, nrrd, mha"))?;
        let bytes = if format == VolumeFormat::Nifti { 0 } else { self.0.unscaled_bytes() };
        if most.is_some_and(|most| bytes > u64::from(most)) {
            return Err(Failure::from(VolumeError::TooLarge { bytes }).into());
        }
        let compression = if gzip { Compression::Deflate } else { Compression::None };
        Ok(write_volume(&self.0, format, compression).map_err(Failure::from)?)
    }
}

#[cfg(feature = "deformable")]
#[wasm_bindgen]
impl RawDeformable {
    /// Adapts the model to its volume after voxels in the region of `dims` voxels from index `min` have changed.
    pub fn refresh(&self, volume: &RawVolume, min: &[u32], dims: &[u32]) -> Result<(), JsValue> {
        Ok(self.ready().refresh(&volume.0, region(min, dims)?).map_err(Failure::from)?)
    }
}

impl RawVolume {
    fn resampled(
        &self,
        grid: ResampleGrid<'_>,
        nearest: bool,
        most: Option<u32>,
    ) -> Result<RawVolume, JsValue> {
        let how = if nearest { Interpolation::Nearest } else { Interpolation::Linear };
        let most = most.map_or(usize::MAX, |most| most as usize);
        Ok(RawVolume(self.0.resample_within(grid, how, most).map_err(Failure::from)?))
    }
}

/// Converts an array of one integer for each of x, y and z; a failure about `parameter` if it does not have three.
/// Returns the region of `dims` voxels from index `min`.
pub(super) fn region(min: &[u32], dims: &[u32]) -> Result<Region, Failure> {
    Ok(Region { min: three("region.min", min)?, dims: three("region.dims", dims)? })
}

fn three(parameter: &str, values: &[u32]) -> Result<[usize; 3], Failure> {
    let values: [u32; 3] =
        values.try_into().map_err(|_| Failure::invalid(parameter, "must be 3 integers"))?;
    Ok(values.map(|n| n as usize))
}
