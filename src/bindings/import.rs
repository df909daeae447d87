//! Bindings of the readers of volume and mesh files, as constructors of the classes.

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::mesh::{RawMesh, triangle_list};
use super::readers::{read_mesh, read_volume};
use super::texture::RawTexture;
use super::volume::RawVolume;

#[wasm_bindgen]
impl RawVolume {
    /// Reads a volume from the bytes of a file. If the header is in a file of its own, `data` is the content of the data
    /// file, or `names` and `contents` are those of the files beside it. `space`, `RAS` or `LPS`, is that of files that
    /// name none.
    pub fn parse(
        file: &Uint8Array,
        data: Option<Uint8Array>,
        names: Option<Vec<String>>,
        contents: Vec<Uint8Array>,
        space: Option<String>,
    ) -> Result<RawVolume, JsValue> {
        Ok(RawVolume(read_volume(file, data.as_ref(), names, contents, space.as_deref())?))
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Reads a mesh from the bytes of a file in any supported format, with a texture from a separate image if one is
    /// given.
    pub fn parse(file: &Uint8Array, texture: Option<RawTexture>) -> Result<RawMesh, JsValue> {
        Ok(RawMesh(triangle_list(read_mesh(file, texture)?)))
    }
}
