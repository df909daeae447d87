//! The multiresolution model.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::{Float64Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, doubles, merged, now, to_js};
use super::error::Failure;
use super::mesh::{Body, Live, RawMesh, TrianglesOf};
use crate::mesh::TriangleMesh;
use crate::methods::multires::{
    ControlEllipsoid, MultiresOptions, MultiresParams, MultiresolutionModel, param_specs,
};

/// A multiresolution model, shared with its live meshes.
#[wasm_bindgen]
pub struct RawMultires(Rc<RefCell<MultiresolutionModel>>);

/// One of the surfaces of a model.
struct View {
    model: Rc<RefCell<MultiresolutionModel>>,
    which: Which,
}

#[derive(Clone, Copy)]
enum Which {
    Detailed,
    Base,
    Link,
}

impl Live for View {
    fn surface(&self) -> TriangleMesh {
        let model = self.model.borrow();
        match self.which {
            Which::Detailed => model.surface(),
            Which::Base => model.base_mesh().to_triangles(),
            Which::Link => model.link_mesh(),
        }
    }

    fn counts(&self) -> [usize; 2] {
        let model = self.model.borrow();
        let mesh = if let Which::Detailed = self.which { model.mesh() } else { model.base_mesh() };
        [mesh.vertex_count(), mesh.triangle_count()]
    }

    fn versions(&self) -> [u32; 2] {
        let model = self.model.borrow();
        let mesh = if let Which::Detailed = self.which { model.mesh() } else { model.base_mesh() };
        [mesh.topology_version(), mesh.geometry_version()]
    }
}

#[wasm_bindgen]
impl RawMultires {
    /// A model of meshes, which are copied, and packed ellipsoids; parameters are written over the defaults.
    #[wasm_bindgen(constructor)]
    pub fn new(
        detail: Option<TrianglesOf>,
        base: Option<TrianglesOf>,
        ellipsoids: &Float64Array,
        params: &JsValue,
    ) -> Result<RawMultires, JsValue> {
        let options = MultiresOptions {
            detail: detail.map(|mesh| mesh.0),
            base: base.map(|mesh| mesh.0),
            ellipsoids: unpacked(ellipsoids)?,
            params: merged(&MultiresParams::default(), params)?,
        };
        let mut model = MultiresolutionModel::new(options).map_err(Failure::from)?;
        model.set_clock(now);
        Ok(RawMultires(Rc::new(RefCell::new(model))))
    }

    /// A mesh that follows: the detailed surface (0), the deformed base (1), the link mesh (2).
    pub fn mesh(&self, which: u32) -> RawMesh {
        let which = match which {
            0 => Which::Detailed,
            1 => Which::Base,
            _ => Which::Link,
        };
        RawMesh(Body::Live(Rc::new(RefCell::new(View { model: Rc::clone(&self.0), which }))))
    }

    /// The meshes of the solver's levels, coarse to fine.
    #[wasm_bindgen(js_name = levelMeshes)]
    pub fn level_meshes(&self) -> Vec<RawMesh> {
        let levels = self.0.borrow().levels();
        levels.into_iter().map(|mesh| RawMesh(Body::Triangles(Rc::new(mesh)))).collect()
    }

    /// So many frames, or to the end; the report of the last.
    pub fn step(&self, iterations: u32) -> Result<JsValue, JsValue> {
        let mut model = self.0.borrow_mut();
        let mut report = model.step().map_err(Failure::from)?;
        for _ in 1..iterations {
            if report.done {
                break;
            }
            let events = report.events;
            report = model.step().map_err(Failure::from)?;
            report.events += events;
        }
        Ok(to_js(&report)?)
    }

    /// Where the ellipsoids are to be, packed.
    #[wasm_bindgen(js_name = setEllipsoids)]
    pub fn set_ellipsoids(&self, ellipsoids: &Float64Array) -> Result<(), JsValue> {
        self.0.borrow_mut().set_ellipsoids(&unpacked(ellipsoids)?).map_err(Failure::from)?;
        Ok(())
    }

    /// Where they are now, packed.
    pub fn ellipsoids(&self) -> Vec<f64> {
        packed(&self.0.borrow().ellipsoids())
    }

    /// Where they are to be, packed.
    pub fn goals(&self) -> Vec<f64> {
        packed(&self.0.borrow().goals())
    }

    /// Ratios of areas (0) or directions (1) by vertex.
    pub fn distortion(&self, which: u32) -> Vec<f32> {
        let found = self.0.borrow().distortion();
        let values = if which == 0 { found.area } else { found.angle };
        values.into_iter().map(|value| value as f32).collect()
    }

    /// All parameters.
    pub fn params(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.borrow().params())?)
    }

    /// Some parameters, checked together with the others before any is taken.
    #[wasm_bindgen(js_name = setParams)]
    pub fn set_params(&self, params: &JsValue) -> Result<(), JsValue> {
        let mut model = self.0.borrow_mut();
        let params = merged(model.params(), params)?;
        model.set_params(params).map_err(Failure::from)?;
        Ok(())
    }

    /// What else there is to tell.
    pub fn facts(&self) -> Result<JsValue, JsValue> {
        let model = self.0.borrow();
        let [missed, held] = model.misses();
        Ok(to_js(&Facts { bands: model.bands(), folded: model.folded(), missed, held })?)
    }

    /// The whole state.
    pub fn save(&self) -> Vec<u8> {
        self.0.borrow().save()
    }

    /// Back to a saved state.
    pub fn restore(&self, state: &Uint8Array) -> Result<(), JsValue> {
        self.0.borrow_mut().restore(&bytes(state)?).map_err(Failure::from)?;
        Ok(())
    }
}

#[derive(Serialize)]
struct Facts {
    bands: usize,
    folded: usize,
    missed: usize,
    held: usize,
}

/// Ellipsoids packed in twelves: the middle, and the three semi-axes.
fn unpacked(packed: &Float64Array) -> Result<Vec<ControlEllipsoid>, Failure> {
    let numbers = doubles(packed)?;
    let (all, _) = numbers.as_chunks::<12>();
    let vector = |e: &[f64; 12], k: usize| [e[k], e[k + 1], e[k + 2]];
    Ok(all
        .iter()
        .map(|e| ControlEllipsoid { center: vector(e, 0), axes: [vector(e, 3), vector(e, 6), vector(e, 9)] })
        .collect())
}

fn packed(all: &[ControlEllipsoid]) -> Vec<f64> {
    all.iter().flat_map(|e| e.center.into_iter().chain(e.axes.into_iter().flatten())).collect()
}

/// What the model's parameters are, for building controls.
#[wasm_bindgen(js_name = multiresParamSpecs)]
pub fn multires_param_specs() -> Result<JsValue, JsValue> {
    Ok(to_js(&param_specs())?)
}
