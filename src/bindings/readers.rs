//! Reading of volume, mesh and point files from the bytes that JavaScript passes.

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, in_world, packed, to_js};
use super::error::Failure;
use super::texture::RawTexture;
use std::borrow::Cow;
use vesicle::io::{
    FileSet, FormatError, MeshFile, MeshOptions, PointCloud, VolumeOptions, parse_points, parse_volume_with,
};
use vesicle::volume::{Space, Volume};

/// Reads a volume from the bytes of a file. If the header is in a file of its own, `data` is the content of the data
/// file, or `names` and `contents` are those of the files beside it. `space`, `RAS` or `LPS`, is that of files that name
/// none.
pub(super) fn read_volume(
    file: &Uint8Array,
    data: Option<&Uint8Array>,
    names: Option<Vec<String>>,
    contents: Vec<Uint8Array>,
    space: Option<&str>,
) -> Result<Volume, Failure> {
    let payload = data.map(bytes).transpose()?;
    let files = names.map(|names| FilesOfPage { names, contents });
    let options = VolumeOptions {
        detached: payload.as_deref(),
        files: files.as_ref().map(|files| files as &dyn FileSet),
        space: space.map(|name| if name == "LPS" { Space::Lps } else { Space::Ras }),
    };
    Ok(parse_volume_with(&bytes(file)?, &options)?)
}

/// Files in the memory of JavaScript, of which those that are read are copied, one after the other.
struct FilesOfPage {
    names: Vec<String>,
    contents: Vec<Uint8Array>,
}

impl FileSet for FilesOfPage {
    fn names(&self) -> Vec<&str> {
        self.names.iter().map(String::as_str).collect()
    }

    fn read(&self, index: usize) -> Result<Cow<'_, [u8]>, FormatError> {
        let Some(content) = self.contents.get(index) else { return Ok(Cow::Borrowed(&[])) };
        bytes(content).map(Cow::Owned).map_err(|_| FormatError::TooLarge {
            format: "volume file",
            field: "data file".to_owned(),
            needed: content.length().into(),
        })
    }
}

/// Reads a mesh from the bytes of a file in any supported format, with a texture from a separate image if one is given,
/// and the files beside it.
pub(super) fn read_mesh(
    file: &Uint8Array,
    texture: Option<RawTexture>,
    files: Vec<NamedFile>,
) -> Result<MeshFile, Failure> {
    let files: Vec<(&str, &[u8])> = files.iter().map(|file| (file.name.as_str(), &file.bytes[..])).collect();
    let options = MeshOptions { texture: texture.map(|texture| texture.0), files: &files };
    Ok(vesicle::io::read_mesh(&bytes(file)?, options)?)
}

/// A file beside another one, copied.
#[wasm_bindgen]
pub struct NamedFile {
    name: String,
    bytes: Vec<u8>,
}

#[wasm_bindgen]
impl NamedFile {
    /// Copies the name and the bytes of a file.
    #[wasm_bindgen(constructor)]
    pub fn new(name: String, file: &Uint8Array) -> Result<NamedFile, JsValue> {
        Ok(NamedFile { name, bytes: bytes(file)? })
    }
}

/// The raw handle of a point cloud that was read from a file.
#[wasm_bindgen]
pub struct RawPoints(PointCloud);

#[wasm_bindgen]
impl RawPoints {
    /// Reads a point cloud from the bytes of a PLY, OBJ or text file.
    pub fn parse(file: &Uint8Array) -> Result<RawPoints, JsValue> {
        Ok(RawPoints(parse_points(&bytes(file)?).map_err(Failure::from)?))
    }

    /// Returns the positions of the points as packed xyz, in double precision if they are far away for their extent.
    pub fn points(&self) -> JsValue {
        in_world(&self.0.points, self.0.origin)
    }

    /// Returns the normals as packed xyz, if the file has them.
    pub fn normals(&self) -> Option<Vec<f32>> {
        self.0.normals.as_deref().map(packed)
    }

    /// Returns the colours as red, green and blue of each point in turn, in 0..1, if the file has them.
    pub fn colors(&self) -> Option<Vec<f32>> {
        self.0.colors.as_deref().map(packed)
    }

    /// Returns what a user should know about the points, as an array of `Warning`.
    pub fn warnings(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(&self.0.warnings)?)
    }
}
