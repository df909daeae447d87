//! Bindings of voxelisation, inside tests, smoothing, bounded decimation and transforms of meshes.

use std::rc::Rc;

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::world_points;
use super::error::Failure;
use super::mesh::{MeshKind, RawMesh, read_only};
use super::volume::RawVolume;
use vesicle::mesh::invertible_map;
use vesicle::remesh::{Smoothing, decimate_within, smooth};
use vesicle::spatial::contains;
use vesicle::voxelise::{VoxelKind, voxelise};

pub(super) fn kind_of(name: &str, value: u32) -> Result<VoxelKind, Failure> {
    match name {
        "mask" => Ok(VoxelKind::Mask { value }),
        "coverage" => Ok(VoxelKind::Coverage),
        "distance" => Ok(VoxelKind::Distance),
        _ => Err(Failure::invalid("kind", "must be one of mask, coverage, distance")),
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Returns a volume on the grid of `like`: `kind` is mask (of intensity `value` inside), coverage or distance; see
    /// [`voxelise`].
    #[wasm_bindgen(js_name = toVolume)]
    pub fn to_volume(&self, like: &RawVolume, kind: &str, value: u32) -> Result<RawVolume, JsValue> {
        let kind = kind_of(kind, value)?;
        Ok(RawVolume(voxelise(&self.triangles(), &like.0, kind).map_err(Failure::from)?))
    }

    /// Returns 1 for each point inside the mesh, and 0 for each outside; the points are x, y and z in turn.
    pub fn contains(&self, at: &JsValue) -> Result<Vec<u8>, JsValue> {
        let mesh = self.triangles();
        let points = world_points(at)?.into_iter().map(|p| p - mesh.origin);
        let inside = contains(&mesh, points).map_err(Failure::from)?;
        Ok(inside.into_iter().map(u8::from).collect())
    }

    /// Smooths the mesh; see [`smooth`].
    pub fn smooth(&mut self, iterations: usize, keep_volume: bool) -> Result<(), JsValue> {
        let smoothing = Smoothing { iterations, keeps_volume: keep_volume };
        Ok(smooth(self.editable()?, smoothing).map_err(Failure::from)?)
    }

    /// Decimates the mesh as `decimate`, as far as its surface stays within `max_distance` of what it was; see
    /// [`decimate_within`].
    #[wasm_bindgen(js_name = decimateWithin)]
    pub fn decimate_within(&mut self, target_triangles: f64, max_distance: f64) -> Result<(), JsValue> {
        if let Some((mesh, target)) = self.larger_than(target_triangles)? {
            decimate_within(mesh, target, max_distance).map_err(Failure::from)?;
        }
        Ok(())
    }

    /// Transforms the mesh by a 4 × 4 matrix, column by column.
    pub fn transform(&mut self, matrix: &[f64]) -> Result<(), JsValue> {
        let matrix = matrix.try_into().map_err(|_| Failure::invalid("matrix", "must be 16 numbers"))?;
        let map = invertible_map(matrix).map_err(Failure::from)?;
        match &mut self.0 {
            MeshKind::Surface(mesh) => mesh.transform(&map).map_err(Failure::from)?,
            MeshKind::Triangles(mesh, versions) => {
                *mesh = Rc::new(mesh.checked_transformed(&map).map_err(Failure::from)?);
                let reflects = map.matrix3.determinant() < 0.0;
                versions[0] = versions[0].wrapping_add(u32::from(reflects));
                versions[1] = versions[1].wrapping_add(1);
            }
            MeshKind::Live(_) => return Err(read_only().into()),
        }
        Ok(())
    }
}
