//! Bindings of the reader of point files.

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, packed};
use super::error::Failure;
use crate::io::{PointCloud, parse_points};

/// The raw handle of a point cloud that was read from a file.
#[wasm_bindgen]
pub struct RawPoints(PointCloud);

#[wasm_bindgen]
impl RawPoints {
    /// Reads a point cloud from the bytes of a PLY, OBJ or text file.
    pub fn parse(file: &Uint8Array) -> Result<RawPoints, JsValue> {
        Ok(RawPoints(parse_points(&bytes(file)?).map_err(Failure::from)?))
    }

    /// Returns the positions of the points as packed xyz.
    pub fn points(&self) -> Vec<f32> {
        packed(&self.0.points)
    }

    /// Returns the normals as packed xyz, if the file has them.
    pub fn normals(&self) -> Option<Vec<f32>> {
        self.0.normals.as_deref().map(packed)
    }

    /// Returns the colours as red, green and blue of each point in turn, in 0..1, if the file has them.
    pub fn colors(&self) -> Option<Vec<f32>> {
        self.0.colors.as_deref().map(packed)
    }
}
