//! Bindings of volumes that are larger than memory, and of the deformable model on them.

use js_sys::{Array, Float64Array, Reflect};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{doubles, point, to_js, with_overrides};
use super::deformable::{RawDeformable, RawDeformableCreation, RawStart};
use super::error::Failure;
use super::stepping::Stepping;
use super::volume::{voxels, world};
use vesicle::methods::deformable::{DeformableModel, DeformableParams, SparseOptions, WorldBox};
use vesicle::volume::{BRICK, BrickBox, Region, SparseInit, SparseLevel, SparseVolume, Voxels};

/// The raw handle of a multiscale volume of which only parts are loaded.
#[wasm_bindgen]
pub struct RawSparseVolume(SparseVolume);

/// A box of whole bricks, as it is passed to JavaScript.
#[derive(Serialize)]
pub struct Box {
    level: usize,
    min: [usize; 3],
    dims: [usize; 3],
}

impl From<&BrickBox> for Box {
    fn from(&BrickBox { level, region }: &BrickBox) -> Self {
        Self { level, min: region.min, dims: region.dims }
    }
}

/// Returns the boxes that a step needs, `{ needs }`.
pub fn needs(boxes: &[BrickBox]) -> Result<JsValue, Failure> {
    #[derive(Serialize)]
    struct Needs {
        needs: Vec<Box>,
    }
    to_js(&Needs { needs: boxes.iter().map(Box::from).collect() })
}

#[derive(Serialize)]
struct Loaded {
    bricks: usize,
    bytes: usize,
}

#[wasm_bindgen]
impl RawSparseVolume {
    /// Creates a volume without voxels from a description: `levels`, finest first, each with `dims`, three numbers of
    /// voxels, and `matrix`, the 4 × 4 matrix from voxel indices to world space, column by column; `type`, that of the
    /// voxels, such as `u16`; `range`, the intensities that are scaled to 0 and 1; `fill`, the value of voxels that the
    /// file leaves out.
    #[wasm_bindgen(constructor)]
    pub fn new(description: &JsValue) -> Result<RawSparseVolume, JsValue> {
        let of = |name: &str| property(description, name);
        let kind = of("type").as_string().unwrap_or_default();
        let fill = of("fill").as_f64().ok_or_else(|| Failure::invalid("fill", "must be a number"))?;
        let init = SparseInit {
            levels: items(&of("levels")).iter().map(level).collect::<Result<_, Failure>>()?,
            range: numbers(&of("range"), "range")?,
            fill: typed(&kind, fill)?,
        };
        Ok(RawSparseVolume(SparseVolume::new(init).map_err(Failure::from)?))
    }

    /// Returns the number of voxels along each side of a brick.
    pub fn brick() -> usize {
        BRICK
    }

    /// Adds the voxels of a box of whole bricks of a level, which begins at a multiple of the brick and ends at one or at
    /// the border: a typed array of the voxels' type, x fastest; voxels that the file leaves out if it is not given.
    /// Loaded bricks are unchanged.
    pub fn insert(&self, level: usize, min: &[u32], dims: &[u32], data: &JsValue) -> Result<(), JsValue> {
        let region = Region { min: three(min, "min")?, dims: three(dims, "dims")? };
        let at = BrickBox { level, region };
        let done =
            if data.is_undefined() { self.0.insert_fill(at) } else { self.0.insert(at, &voxels(data)?) };
        Ok(done.map_err(Failure::from)?)
    }

    /// Returns the bricks and bytes that are loaded of each level, as an array of `{ bricks, bytes }`.
    pub fn loaded(&self) -> Result<JsValue, JsValue> {
        let levels: Vec<Loaded> =
            self.0.loaded().into_iter().map(|[bricks, bytes]| Loaded { bricks, bytes }).collect();
        Ok(to_js(&levels)?)
    }

    /// Returns the boxes of bricks of a level that are not loaded, as an array of `{ level, min, dims }`.
    pub fn missing(&self, level: usize) -> Result<JsValue, JsValue> {
        let boxes = self.0.missing(level).map_err(Failure::from)?;
        Ok(to_js(&boxes.iter().map(Box::from).collect::<Vec<_>>())?)
    }
}

/// The options of a model of a sparse volume, and of its creation.
#[wasm_bindgen]
pub struct RawSparseOptions(SparseOptions);

#[wasm_bindgen]
impl RawSparseOptions {
    /// Creates options by default; properties of `params` replace the default parameters for the range of `volume`.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawSparseVolume,
        start: RawStart,
        params: &JsValue,
    ) -> Result<RawSparseOptions, JsValue> {
        let params = Some(with_overrides(&DeformableParams::for_range(volume.0.range()), params)?);
        Ok(RawSparseOptions(SparseOptions { start: start.0, params, ..Default::default() }))
    }

    /// Sets the level at which the run ends. With `within`, the two corners of a box in world space, levels finer than
    /// `whole` are followed only inside of it.
    #[wasm_bindgen(js_name = setLevels)]
    pub fn set_levels(
        &mut self,
        finest: usize,
        whole: Option<usize>,
        within: Option<Float64Array>,
    ) -> Result<(), JsValue> {
        self.0.within = within.map(|corners| world_box(&corners)).transpose()?;
        (self.0.finest, self.0.whole) = (finest, whole);
        Ok(())
    }

    /// Sets what `setSize` sets for volumes in memory; the finest level is that at which the run ends.
    #[wasm_bindgen(js_name = setSize)]
    pub fn set_size(&mut self, edge: Option<f64>, max_vertices: Option<usize>) {
        (self.0.edge, self.0.max_vertices) = (edge, max_vertices);
    }
}

#[wasm_bindgen]
impl RawDeformable {
    /// Creates a deformable model of a sparse volume, whose coarsest level must be loaded, else the failure is
    /// `needs-data`.
    ///
    /// A step of it either makes an iteration, or changes nothing and returns `{ needs }`: an array of `{ level, min,
    /// dims }`, the boxes to insert into the volume before the next call.
    #[wasm_bindgen(js_name = newSparse)]
    pub fn new_sparse(volume: &RawSparseVolume, options: RawSparseOptions) -> Result<RawDeformable, JsValue> {
        let model = DeformableModel::on_sparse(&volume.0, options.0).map_err(Failure::from)?;
        Ok(RawDeformable(Stepping::new(model)))
    }
}

#[wasm_bindgen]
impl RawDeformableCreation {
    /// Begins to create the model that `newSparse` of `RawDeformable` creates.
    #[wasm_bindgen(js_name = newSparse)]
    pub fn new_sparse(
        volume: &RawSparseVolume,
        options: RawSparseOptions,
    ) -> Result<RawDeformableCreation, JsValue> {
        let creation = DeformableModel::begin_on_sparse(&volume.0, options.0).map_err(Failure::from)?;
        Ok(RawDeformableCreation(std::boxed::Box::pin(creation)))
    }
}

fn world_box(corners: &Float64Array) -> Result<WorldBox, Failure> {
    let numbers = doubles(corners)?;
    let (min, max) = numbers.split_at(numbers.len() / 2);
    Ok(WorldBox { min: point(min)?, max: point(max)? })
}

fn property(object: &JsValue, name: &str) -> JsValue {
    Reflect::get(object, &name.into()).unwrap_or(JsValue::UNDEFINED)
}

/// Returns the items of an array; none of anything else.
fn items(array: &JsValue) -> Vec<JsValue> {
    if array.is_object() { Array::from(array).to_vec() } else { Vec::new() }
}

/// Converts an array of `N` numbers.
fn numbers<const N: usize>(array: &JsValue, name: &str) -> Result<[f64; N], Failure> {
    let list: Vec<f64> = items(array).iter().filter_map(JsValue::as_f64).collect();
    list.try_into().map_err(|_| Failure::invalid(name, &format!("must be {N} numbers")))
}

fn level(level: &JsValue) -> Result<SparseLevel, Failure> {
    let dims: [f64; 3] = numbers(&property(level, "dims"), "dims")?;
    if dims.iter().any(|&n| !(n >= 1.0 && n <= f64::from(u32::MAX) && n.trunc() == n)) {
        return Err(Failure::invalid("dims", "must be three integers of at least 1"));
    }
    let matrix: [f64; 16] = numbers(&property(level, "matrix"), "matrix")?;
    Ok(SparseLevel { dims: dims.map(|n| n as usize), affine: world(&matrix)? })
}

fn three(numbers: &[u32], name: &str) -> Result<[usize; 3], Failure> {
    let numbers: [u32; 3] =
        numbers.try_into().map_err(|_| Failure::invalid(name, "must be three integers"))?;
    Ok(numbers.map(|n| n as usize))
}

/// Returns one voxel of a type given by its name; a number that the type cannot store becomes one that it can.
fn typed(kind: &str, value: f64) -> Result<Voxels, Failure> {
    Ok(match kind {
        "u8" => Voxels::U8(vec![value as u8]),
        "i8" => Voxels::I8(vec![value as i8]),
        "u16" => Voxels::U16(vec![value as u16]),
        "i16" => Voxels::I16(vec![value as i16]),
        "u32" => Voxels::U32(vec![value as u32]),
        "i32" => Voxels::I32(vec![value as i32]),
        "f32" => Voxels::F32(vec![value as f32]),
        _ => {
            return Err(Failure::invalid(
                "type",
                &format!("must be u8, i8, u16, i16, u32, i32 or f32, got {kind}"),
            ));
        }
    })
}
