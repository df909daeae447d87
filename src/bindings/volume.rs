//! Bindings of volumes.

use js_sys::{
    Float32Array, Float64Array, Int8Array, Int16Array, Int32Array, Uint8Array, Uint16Array, Uint32Array,
};
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{columns, copy_array, point, space_name, to_js, unit_name, unit_named};
use super::error::Failure;
use vesicle::io::write_nifti;
use vesicle::math::DAffine3;
use vesicle::volume::{Space, Volume, VolumeInit, Voxels};
use vesicle::warning::{Place, Warning, WarningCode};

/// The raw handle of the TypeScript class `Volume`: a 3D or 4D volume.
#[wasm_bindgen]
pub struct RawVolume(pub(super) Volume);

#[wasm_bindgen]
impl RawVolume {
    /// Creates a volume from a typed array of stored values, x fastest. `dims` are the numbers of voxels along x, y and
    /// z and of frames; `affine` is the 4 × 4 matrix from voxel indices to world space, column by column; an intensity
    /// is `slope` × value + `intercept`; `frame_seconds` is the time between frames, 0 if it is not known. Any `space`
    /// but `LPS` means RAS.
    #[wasm_bindgen(constructor)]
    pub fn new(
        data: &JsValue,
        dims: &[u32],
        affine: &[f64],
        slope: f64,
        intercept: f64,
        frame_seconds: f64,
        space: &str,
    ) -> Result<RawVolume, JsValue> {
        let init = VolumeInit {
            voxels: voxels(data)?,
            dims: four(dims)?,
            affine: world(affine)?,
            slope,
            intercept,
            frame_seconds,
            space: if space == "LPS" { Space::Lps } else { Space::Ras },
        };
        Ok(RawVolume(Volume::new(init).map_err(Failure::from)?))
    }

    /// Returns the volume with the length of a world unit set to `m`, `mm` or `um`; anything else means unknown.
    #[wasm_bindgen(js_name = withUnit)]
    pub fn with_unit(self, unit: &str) -> RawVolume {
        RawVolume(self.0.with_unit(unit_named(unit)))
    }

    /// Returns the volume with a warning added: the name of its code, its text, and its place: the number of a `frame` or
    /// `label`, the coordinates of a `point`, or none for any other `kind`.
    #[wasm_bindgen(js_name = withWarning)]
    pub fn with_warning(
        self,
        code: &str,
        text: String,
        kind: &str,
        place: &[f64],
    ) -> Result<RawVolume, JsValue> {
        let place = match (kind, place) {
            ("frame", &[frame]) => Some(Place::Frame(frame as u32)),
            ("label", &[label]) => Some(Place::Label(label)),
            ("point", &[x, y, z]) => Some(Place::Point([x, y, z])),
            _ => None,
        };
        let code = WarningCode::named(code).ok_or_else(|| Failure::invalid("warnings", "unknown code"))?;
        Ok(RawVolume(self.0.with_warning(Warning { code, text, place })))
    }

    /// Returns the volume as a NIfTI file: NIfTI-1, or NIfTI-2 if that cannot represent the volume.
    #[wasm_bindgen(js_name = toNifti)]
    pub fn to_nifti(&self) -> Result<Vec<u8>, JsValue> {
        Ok(write_nifti(&self.0).map_err(Failure::from)?)
    }

    /// Returns the numbers of voxels of the volume along x, y and z.
    pub fn dims(&self) -> Vec<f64> {
        self.0.dims().map(|n| n as f64).to_vec()
    }

    /// Returns the number of frames of the volume; 1 if it is 3D.
    pub fn frames(&self) -> usize {
        self.0.frames()
    }

    /// Returns the voxel size along x, y and z, in world units.
    pub fn spacing(&self) -> Vec<f64> {
        self.0.spacing().to_vec()
    }

    /// Returns the transform from voxel indices to world space: the sixteen numbers of a 4 × 4 matrix, column by
    /// column.
    pub fn affine(&self) -> Vec<f64> {
        columns(self.0.affine())
    }

    /// Returns which anatomical directions the axes of world space have: `RAS` (right, anterior, superior) or `LPS`
    /// (left, posterior, superior).
    pub fn space(&self) -> String {
        space_name(self.0.space()).to_owned()
    }

    /// Returns the length of a world unit: `m`, `mm` or `um`, or an empty string if it is not known.
    pub fn unit(&self) -> String {
        unit_name(self.0.unit()).to_owned()
    }

    /// Returns what a user should know about the volume, as an array of `Warning`.
    pub fn warnings(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.warnings())?)
    }

    /// Returns the smallest and the largest finite intensity of all frames.
    pub fn range(&self) -> Vec<f64> {
        self.0.range().to_vec()
    }

    /// Returns the histogram of a frame: the number of voxels in each of `bins` equal parts of the intensity range of
    /// all frames.
    pub fn histogram(&self, bins: usize, frame: usize) -> Result<Vec<u32>, JsValue> {
        Ok(self.0.histogram(bins, frame).map_err(Failure::from)?)
    }

    /// Returns the intensity at a world point, by trilinear interpolation; outside the volume the border is replicated.
    pub fn sample(&self, world: &[f64], frame: usize) -> Result<f64, JsValue> {
        Ok(self.0.sample(point(world)?, frame).map_err(Failure::from)?)
    }

    /// Returns the intensities of the slice of one frame at `index` along `axis` (0, 1, 2 for x, y, z), row by row; the
    /// rows run along the lower one of the two other axes.
    pub fn slice(&self, axis: usize, index: usize, frame: usize) -> Result<Vec<f32>, JsValue> {
        Ok(self.0.slice(axis, index, frame).map_err(Failure::from)?)
    }

    /// Returns all intensities of one frame, in the order of the voxels, x fastest; NaN stays NaN.
    pub fn intensities(&self, frame: usize) -> Result<Vec<f32>, JsValue> {
        Ok(self.0.intensities(frame).map_err(Failure::from)?)
    }

    /// Returns the volumes of an image pyramid, one per level: the first is this volume, and each other one has the
    /// dimensions of the one before divided by `factor`.
    pub fn pyramid(&self, levels: usize, factor: f64) -> Result<Vec<RawVolume>, JsValue> {
        let levels = self.0.pyramid(levels, factor).map_err(Failure::from)?;
        Ok(levels.into_iter().map(RawVolume).collect())
    }

    /// Returns the seconds between frames; 0 if they are not known.
    #[wasm_bindgen(js_name = frameSeconds)]
    pub fn frame_seconds(&self) -> f64 {
        self.0.frame_seconds()
    }

    /// Returns the volume downsampled by blocks of `factors` voxels along x, y and z: each new voxel is the mean of the
    /// finite voxels of a block, and incomplete blocks are dropped.
    pub fn binned(&self, factors: &[u32]) -> Result<RawVolume, JsValue> {
        let factors = [0, 1, 2].map(|axis| factors.get(axis).map_or(1, |&n| n as usize));
        Ok(RawVolume(self.0.binned(factors).map_err(Failure::from)?))
    }
}

/// Copies a typed array of any element type that volumes support, without converting its values.
pub(super) fn voxels(data: &JsValue) -> Result<Voxels, Failure> {
    macro_rules! of {
        ($($array:ty => $voxels:ident),*) => {
            $(if let Some(array) = data.dyn_ref::<$array>() {
                return Ok(Voxels::$voxels(copy_array(array.length(), |out| array.copy_to(out))?));
            })*
        };
    }
    of!(Uint8Array => U8, Int8Array => I8, Uint16Array => U16, Int16Array => I16);
    of!(Uint32Array => U32, Int32Array => I32, Float32Array => F32, Float64Array => F64);
    Err(Failure::invalid("data", "must be a typed array of numbers of at most 32 bits, or of 64-bit floats"))
}

/// Converts an array of the numbers of voxels along x, y and z and of frames; a failure if it does not have four
/// elements.
fn four(dims: &[u32]) -> Result<[usize; 4], Failure> {
    let dims: [u32; 4] = dims.try_into().map_err(|_| Failure::invalid("dims", "must be 3 or 4 integers"))?;
    Ok(dims.map(|n| n as usize))
}

/// Converts the sixteen numbers of a 4 × 4 matrix, column by column, to an affine transform; an error if the last row
/// is not 0, 0, 0, 1.
pub(super) fn world(affine: &[f64]) -> Result<DAffine3, Failure> {
    let (columns, _) = affine.as_chunks::<4>();
    let last_row: Vec<f64> = columns.iter().map(|column| column[3]).collect();
    if last_row != [0.0, 0.0, 0.0, 1.0] {
        let problem = "must be 16 numbers, column-major, with last row 0, 0, 0, 1";
        return Err(Failure::invalid("affine", problem));
    }
    let columns: Vec<f64> = columns.iter().flat_map(|&[x, y, z, _]| [x, y, z]).collect();
    Ok(DAffine3::from_cols_slice(&columns))
}
