//! Bindings of the textures of meshes.

use std::sync::Arc;

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::bytes;
use super::error::Failure;
use vesicle::mesh::Texture;

/// The texture of a mesh: an image file in memory.
#[wasm_bindgen]
pub struct RawTexture(pub(super) Arc<Texture>);

#[wasm_bindgen]
impl RawTexture {
    /// Creates a texture from the bytes of an image file; a failure if their media type is not `kind`.
    #[wasm_bindgen(constructor)]
    pub fn new(kind: &str, file: &Uint8Array) -> Result<RawTexture, JsValue> {
        let texture = Texture::new(bytes(file)?).map_err(Failure::from)?;
        let found = texture.kind().media_type();
        if found != kind {
            let problem = format!("declared as {kind}, but the bytes are {found}");
            return Err(Failure::invalid("texture", &problem).into());
        }
        Ok(RawTexture(Arc::new(texture)))
    }

    /// Returns the media type of the image, such as `image/png`.
    pub fn kind(&self) -> String {
        self.0.kind().media_type().to_owned()
    }

    /// Returns the bytes of the image file.
    pub fn bytes(&self) -> Vec<u8> {
        self.0.bytes().to_vec()
    }
}
