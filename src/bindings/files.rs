//! Bindings of a module that only reads files: their contents, as arrays.

use js_sys::{
    Float32Array, Float64Array, Int8Array, Int16Array, Int32Array, Uint8Array, Uint16Array, Uint32Array,
};
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{columns, flat, in_world, packed, space_name, to_js, unit_name};
use super::readers::{NamedFile, read_mesh, read_volume};
use super::texture::RawTexture;
use vesicle::io;
use vesicle::volume::{Volume, Voxels};

/// The content of a volume file.
#[wasm_bindgen]
pub struct VolumeFile(Volume);

#[wasm_bindgen]
impl VolumeFile {
    /// Reads a volume from the bytes of a file. If the header is in a file of its own, `data` is the content of the data
    /// file, or `names` and `contents` are those of the files beside it. `space`, `RAS` or `LPS`, is that of files that
    /// name none.
    pub fn parse(
        file: &Uint8Array,
        data: Option<Uint8Array>,
        names: Option<Vec<String>>,
        contents: Vec<Uint8Array>,
        space: Option<String>,
    ) -> Result<VolumeFile, JsValue> {
        Ok(VolumeFile(read_volume(file, data.as_ref(), names, contents, space.as_deref())?))
    }

    /// Returns the stored values as a typed array of their type, x fastest, then y, z and frames.
    pub fn voxels(&self) -> JsValue {
        match self.0.voxels() {
            Voxels::U8(values) => Uint8Array::from(&values[..]).into(),
            Voxels::I8(values) => Int8Array::from(&values[..]).into(),
            Voxels::U16(values) => Uint16Array::from(&values[..]).into(),
            Voxels::I16(values) => Int16Array::from(&values[..]).into(),
            Voxels::U32(values) => Uint32Array::from(&values[..]).into(),
            Voxels::I32(values) => Int32Array::from(&values[..]).into(),
            Voxels::F32(values) => Float32Array::from(&values[..]).into(),
            Voxels::F64(values) => Float64Array::from(&values[..]).into(),
        }
    }

    /// Returns the numbers of voxels along x, y and z.
    pub fn dims(&self) -> Vec<f64> {
        self.0.dims().map(|n| n as f64).to_vec()
    }

    /// Returns the number of frames; 1 if the volume is 3D.
    pub fn frames(&self) -> usize {
        self.0.frames()
    }

    /// Returns the transform from voxel indices to world space: the sixteen numbers of a 4 × 4 matrix, column by
    /// column.
    pub fn affine(&self) -> Vec<f64> {
        columns(self.0.affine())
    }

    /// Returns the factor from stored values to intensities.
    pub fn slope(&self) -> f64 {
        self.0.slope()
    }

    /// Returns the intensity of the stored value 0.
    pub fn intercept(&self) -> f64 {
        self.0.intercept()
    }

    /// Returns the seconds between frames; 0 if they are not known.
    #[wasm_bindgen(js_name = frameSeconds)]
    pub fn frame_seconds(&self) -> f64 {
        self.0.frame_seconds()
    }

    /// Returns which anatomical directions the axes of world space have: `RAS` or `LPS`.
    pub fn space(&self) -> String {
        space_name(self.0.space()).to_owned()
    }

    /// Returns what a user should know about the volume, as an array of `Warning`.
    pub fn warnings(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.warnings())?)
    }

    /// Returns the length of a world unit: `m`, `mm` or `um`, or an empty string if the file does not state it.
    pub fn unit(&self) -> String {
        unit_name(self.0.unit()).to_owned()
    }
}

/// The content of a mesh file.
#[wasm_bindgen]
pub struct MeshFile(io::MeshFile);

#[wasm_bindgen]
impl MeshFile {
    /// Reads a mesh from the bytes of a file in any supported format, with a texture from a separate image if one is
    /// given, and the files beside it.
    pub fn parse(
        file: &Uint8Array,
        texture: Option<RawTexture>,
        files: Vec<NamedFile>,
    ) -> Result<MeshFile, JsValue> {
        Ok(MeshFile(read_mesh(file, texture, files)?))
    }

    /// Returns the positions of the vertices as packed xyz, in double precision if the mesh is far away for its size.
    pub fn positions(&self) -> JsValue {
        in_world(&self.0.mesh.positions, self.0.mesh.origin)
    }

    /// Returns the triangles as three vertex indices each.
    pub fn indices(&self) -> Vec<u32> {
        self.0.mesh.triangles.as_flattened().to_vec()
    }

    /// Returns the normals of the vertices as packed xyz, if the file has them.
    pub fn normals(&self) -> Option<Vec<f32>> {
        self.0.mesh.normals.as_deref().map(packed)
    }

    /// Returns the texture coordinates as u and v of each vertex, if the file has them and no vertex has several.
    pub fn uvs(&self) -> Option<Vec<f32>> {
        self.0.mesh.uvs.as_deref().map(flat)
    }

    /// Returns the texture coordinates as u and v of the three corners of each triangle, if vertices have several.
    #[wasm_bindgen(js_name = cornerUvs)]
    pub fn corner_uvs(&self) -> Option<Vec<f32>> {
        self.0.mesh.corner_uvs.as_deref().map(|corners| flat(corners.as_flattened()))
    }

    /// Returns the colours as red, green and blue of each vertex, in 0..1, if the file has them.
    pub fn colors(&self) -> Option<Vec<f32>> {
        self.0.mesh.colors.as_deref().map(packed)
    }

    /// Returns the texture, if the mesh has one.
    pub fn texture(&self) -> Option<RawTexture> {
        self.0.mesh.texture.clone().map(RawTexture)
    }
    /// Returns the space that the file states, `RAS` or `LPS`, or an empty string if it states none.
    pub fn space(&self) -> String {
        self.0.space.map_or("", space_name).to_owned()
    }

    /// Returns the length of a unit: `m`, `mm` or `um`, or an empty string if the file does not state it.
    pub fn unit(&self) -> String {
        unit_name(self.0.unit).to_owned()
    }

    /// Returns what a user should know about the mesh, as an array of `Warning`.
    pub fn warnings(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(&self.0.warnings)?)
    }
}
