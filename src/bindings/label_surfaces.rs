//! Bindings of the surfaces of a label map.

use std::cell::RefCell;
use std::rc::Rc;

use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::with_overrides;
use super::error::Failure;
use super::labels::region;
use super::mesh::RawMesh;
use super::method::{method_bindings, shared};
use super::volume::RawVolume;
use vesicle::math::DVec3;
use vesicle::mesh::TriangleMesh;
use vesicle::methods::LiveSurface;
use vesicle::methods::label_surfaces::{LabelParams, LabelSurfaces};

/// The raw handle of the TypeScript class `LabelSurfaces`, which shares the surfaces with their live meshes.
#[wasm_bindgen]
pub struct RawLabelSurfaces(Rc<RefCell<LabelSurfaces>>);

method_bindings!(RawLabelSurfaces, LabelSurfaces, labelParamSpecs);

#[wasm_bindgen]
impl RawLabelSurfaces {
    /// Creates the surfaces of the first frame of a label map, of all labels or those of `labels`. Properties of `params`
    /// replace the default parameters.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        labels: Option<Vec<f64>>,
        params: &JsValue,
    ) -> Result<RawLabelSurfaces, JsValue> {
        let params = with_overrides(&LabelParams::default(), params)?;
        Ok(RawLabelSurfaces(shared(LabelSurfaces::new(&volume.0, labels, params))?))
    }

    /// Returns the labels that have voxels and a surface, in ascending order.
    pub fn labels(&self) -> Vec<f64> {
        self.0.borrow().labels()
    }

    /// Returns the surface of a label as a live mesh, which changes with the surfaces.
    pub fn mesh(&self, label: f64) -> Result<RawMesh, JsValue> {
        self.0.borrow().number_of(label).map_err(Failure::from)?;
        let mesh = LabelMesh { surfaces: Rc::clone(&self.0), label };
        Ok(RawMesh::live(&Rc::new(RefCell::new(mesh))))
    }

    /// Adopts the voxels of `volume` in the region of `dims` voxels from index `min`, where they have changed.
    pub fn refresh(&self, volume: &RawVolume, min: &[u32], dims: &[u32]) -> Result<(), JsValue> {
        Ok(self.0.borrow_mut().refresh(&volume.0, region(min, dims)?).map_err(Failure::from)?)
    }
}

/// The live surface of one label.
struct LabelMesh {
    surfaces: Rc<RefCell<LabelSurfaces>>,
    label: f64,
}

impl LiveSurface for LabelMesh {
    fn surface(&self) -> TriangleMesh {
        // A label never loses its surface, which is empty while the label has no voxels.
        self.surfaces.borrow().mesh(self.label).unwrap_or_default()
    }

    fn origin(&self) -> DVec3 {
        self.surfaces.borrow().origin()
    }

    fn counts(&self) -> [usize; 2] {
        self.surfaces.borrow().mesh_counts(self.label).unwrap_or_default()
    }

    fn versions(&self) -> [u32; 2] {
        let surfaces = self.surfaces.borrow();
        // A restored state may not know labels that had lost all voxels.
        surfaces.mesh_versions(self.label).unwrap_or_else(|_| surfaces.versions())
    }
}
