//! Bindings of the readers of volume and mesh files, as constructors of the classes.

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{space_name, to_js, unit_name};
use super::mesh::{RawMesh, triangle_list};
use super::readers::{NamedFile, read_mesh, read_volume};
use super::texture::RawTexture;
use super::volume::RawVolume;
use vesicle::io::MeshFile;

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
    /// Returns the mesh of a file.
    #[wasm_bindgen(js_name = fromFile)]
    pub fn from_file(file: RawMeshFile) -> RawMesh {
        RawMesh(triangle_list(file.0.mesh))
    }
}

/// The raw content of a mesh file.
#[wasm_bindgen]
pub struct RawMeshFile(MeshFile);

#[wasm_bindgen]
impl RawMeshFile {
    /// Reads a mesh from the bytes of a file in any supported format, with a texture from a separate image if one is
    /// given, and the files beside it.
    pub fn parse(
        file: &Uint8Array,
        texture: Option<RawTexture>,
        files: Vec<NamedFile>,
    ) -> Result<RawMeshFile, JsValue> {
        Ok(RawMeshFile(read_mesh(file, texture, files)?))
    }

    /// Returns what a user should know about the mesh, as an array of `Warning`.
    pub fn warnings(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(&self.0.warnings)?)
    }

    /// Returns the space that the file states, `RAS` or `LPS`, or an empty string if it states none.
    pub fn space(&self) -> String {
        self.0.space.map_or("", space_name).to_owned()
    }

    /// Returns the length of a unit: `m`, `mm` or `um`, or an empty string if the file does not state it.
    pub fn unit(&self) -> String {
        unit_name(self.0.unit).to_owned()
    }
}
