//! Bindings of cuts by planes, and of the selection of connected components.

use std::rc::Rc;

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::point;
use super::error::Failure;
use super::mesh::{MeshKind, RawMesh, read_only};
use vesicle::mesh::TriangleMesh;
use vesicle::remesh::{Plane, cut_by_plane};
use vesicle::spatial::outer_components;

#[wasm_bindgen]
impl RawMesh {
    /// Cuts the mesh by a plane, and closes it; see [`cut_by_plane`].
    pub fn cut(&mut self, origin: &[f64], normal: &[f64]) -> Result<(), JsValue> {
        let mesh = self.editable()?;
        let plane = Plane { origin: point(origin)? - mesh.origin(), normal: point(normal)? };
        Ok(cut_by_plane(mesh, plane).map_err(Failure::from)?)
    }

    /// Removes all connected components but those of the given indices.
    #[wasm_bindgen(js_name = keepComponents)]
    pub fn keep_components(&mut self, indices: &[u32]) -> Result<(), JsValue> {
        let (mesh, versions) = self.to_be_replaced()?;
        let kept = mesh.with_components(indices).map_err(Failure::from)?;
        self.0 = MeshKind::Triangles(Rc::new(kept), versions);
        Ok(())
    }

    /// Removes the connected components that others enclose.
    #[wasm_bindgen(js_name = removeCavities)]
    pub fn remove_cavities(&mut self) -> Result<(), JsValue> {
        let outer = outer_components(&self.triangles()).map_err(Failure::from)?;
        self.keep_components(&outer)
    }
}

impl RawMesh {
    /// Returns the triangles of a mesh that may be changed, and the versions of a list of triangles that takes its place.
    pub(super) fn to_be_replaced(&self) -> Result<(Rc<TriangleMesh>, [u32; 2]), Failure> {
        if matches!(self.0, MeshKind::Live(_)) {
            return Err(read_only());
        }
        let versions = [self.topology_version(), self.geometry_version()];
        Ok((self.triangles(), versions.map(|version| version.wrapping_add(1))))
    }
}
