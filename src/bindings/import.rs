//! Bindings of the readers of volume and mesh files.

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::bytes;
use super::error::Failure;
use super::mesh::{RawMesh, triangle_list};
use super::texture::RawTexture;
use super::volume::RawVolume;
use crate::io::{parse_mesh, parse_textured_mesh, parse_volume};

#[wasm_bindgen]
impl RawVolume {
    /// Reads a volume from the bytes of a file; `data` is the content of the data file, if the header is in a file of
    /// its own.
    pub fn parse(file: &Uint8Array, data: Option<Uint8Array>) -> Result<RawVolume, JsValue> {
        let payload = data.as_ref().map(bytes).transpose()?;
        Ok(RawVolume(parse_volume(&bytes(file)?, payload.as_deref()).map_err(Failure::from)?))
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Reads a mesh from the bytes of a file in any supported format, with a texture from a separate image if one is
    /// given.
    pub fn parse(file: &Uint8Array, texture: Option<RawTexture>) -> Result<RawMesh, JsValue> {
        let file = bytes(file)?;
        let mesh = match texture {
            Some(texture) => parse_textured_mesh(&file, texture.0),
            None => parse_mesh(&file),
        };
        Ok(RawMesh(triangle_list(mesh.map_err(Failure::from)?)))
    }
}
