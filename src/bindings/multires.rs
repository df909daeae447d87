//! Bindings of the multiresolution model.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::{Float64Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, doubles, now, to_js, with_overrides};
use super::error::Failure;
use super::mesh::{LiveSurface, MeshKind, RawMesh, TriangleCopy};
use crate::mesh::TriangleMesh;
use crate::methods::Parameters;
use crate::methods::multires::{
    ControlEllipsoid, MultiresOptions, MultiresParams, MultiresolutionModel,
};

/// The raw handle of the TypeScript class `MultiresolutionModel`, which shares the model with the live meshes of its
/// surfaces.
#[wasm_bindgen]
pub struct RawMultires(Rc<RefCell<MultiresolutionModel>>);

/// One of the three surfaces of a multiresolution model, as the content of a live mesh.
struct LiveView {
    model: Rc<RefCell<MultiresolutionModel>>,
    surface: Surface,
}

/// The surfaces of a model that have a live mesh: the detailed surface, the deformed base, and the link mesh, which has
/// the triangles of the deformed base with each vertex at its position on the undeformed base (the map T).
#[derive(Clone, Copy)]
enum Surface {
    Detailed,
    Base,
    Link,
}

impl LiveSurface for LiveView {
    fn surface(&self) -> TriangleMesh {
        let model = self.model.borrow();
        match self.surface {
            Surface::Detailed => model.surface(),
            Surface::Base => model.base_mesh().to_triangles(),
            Surface::Link => model.link_mesh(),
        }
    }

    fn counts(&self) -> [usize; 2] {
        let model = self.model.borrow();
        let mesh = if let Surface::Detailed = self.surface { model.mesh() } else { model.base_mesh() };
        [mesh.vertex_count(), mesh.triangle_count()]
    }

    fn versions(&self) -> [u32; 2] {
        let model = self.model.borrow();
        let mesh = if let Surface::Detailed = self.surface { model.mesh() } else { model.base_mesh() };
        [mesh.topology_version(), mesh.geometry_version()]
    }
}

#[wasm_bindgen]
impl RawMultires {
    /// Creates a multiresolution model. `detail` is the surface with detail; without it the model has none. `base` is
    /// the smooth surface M₀, derived if not given. `ellipsoids` are the control ellipsoids, twelve numbers each: the
    /// centre and three semi-axis vectors. Properties of `params` replace the default parameters.
    #[wasm_bindgen(constructor)]
    pub fn new(
        detail: Option<TriangleCopy>,
        base: Option<TriangleCopy>,
        ellipsoids: &Float64Array,
        params: &JsValue,
    ) -> Result<RawMultires, JsValue> {
        let options = MultiresOptions {
            detail: detail.map(|mesh| mesh.0),
            base: base.map(|mesh| mesh.0),
            ellipsoids: unpacked(ellipsoids)?,
            params: with_overrides(&MultiresParams::default(), params)?,
        };
        let mut model = MultiresolutionModel::new(options).map_err(Failure::from)?;
        model.set_clock(now);
        Ok(RawMultires(Rc::new(RefCell::new(model))))
    }

    /// Returns a live mesh of the model: the detailed surface (0), the deformed base (1) or the link mesh (2).
    pub fn mesh(&self, which: u32) -> RawMesh {
        let surface = match which {
            0 => Surface::Detailed,
            1 => Surface::Base,
            _ => Surface::Link,
        };
        RawMesh(MeshKind::Live(Rc::new(RefCell::new(LiveView { model: Rc::clone(&self.0), surface }))))
    }

    /// Returns the membrane as solved for the current ellipsoids on each level of the multi-level solver, one mesh
    /// each, from coarse to fine.
    #[wasm_bindgen(js_name = levelMeshes)]
    pub fn level_meshes(&self) -> Vec<RawMesh> {
        let levels = self.0.borrow().levels();
        levels.into_iter().map(|mesh| RawMesh(MeshKind::Triangles(Rc::new(mesh)))).collect()
    }

    /// Makes `iterations` steps, or fewer if the model is done before; returns the `StepReport` of the last step, with
    /// the events of all these steps.
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

    /// Sets the target ellipsoids, towards which the model moves its current ellipsoids: twelve numbers each, the
    /// centre and three semi-axis vectors.
    #[wasm_bindgen(js_name = setEllipsoids)]
    pub fn set_ellipsoids(&self, ellipsoids: &Float64Array) -> Result<(), JsValue> {
        self.0.borrow_mut().set_ellipsoids(&unpacked(ellipsoids)?).map_err(Failure::from)?;
        Ok(())
    }

    /// Returns the current ellipsoids, including those that are being removed: twelve numbers each, the centre and
    /// three semi-axis vectors.
    pub fn ellipsoids(&self) -> Vec<f64> {
        packed(&self.0.borrow().ellipsoids())
    }

    /// Returns the target ellipsoids, without those that are being removed: twelve numbers each, the centre and three
    /// semi-axis vectors.
    pub fn targets(&self) -> Vec<f64> {
        packed(&self.0.borrow().targets())
    }

    /// Returns for each vertex of the deformed base how much the map T to the undeformed base distorts areas (`which`
    /// 0: the area on the undeformed base divided by that on the deformed one) or angles (any other: the ratio of the
    /// largest to the smallest stretch); 1 without distortion.
    pub fn distortion(&self, which: u32) -> Vec<f32> {
        let found = self.0.borrow().distortion();
        let values = if which == 0 { found.area } else { found.angle };
        values.into_iter().map(|value| value as f32).collect()
    }

    /// Returns the current values of all parameters of the model, as a plain object.
    pub fn params(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.borrow().params())?)
    }

    /// Sets the parameters that are properties of the plain object `params`, and keeps the others; all are validated
    /// together before any is changed.
    #[wasm_bindgen(js_name = setParams)]
    pub fn set_params(&self, params: &JsValue) -> Result<(), JsValue> {
        let mut model = self.0.borrow_mut();
        let params = with_overrides(model.params(), params)?;
        model.set_params(params).map_err(Failure::from)?;
        Ok(())
    }

    /// Returns further counts about the model: surfaces in the decomposition, including the base; folded triangles of
    /// the map T; and, in the last reconstruction of detail, vertices whose normal missed the finer surface, and
    /// vertices held back to avoid self-intersections.
    pub fn counts(&self) -> Result<JsValue, JsValue> {
        let model = self.0.borrow();
        let [unmatched_vertices, held_vertices] = model.detail_counts();
        Ok(to_js(&Counts {
            band_count: model.band_count(),
            folded: model.folded(),
            unmatched_vertices,
            held_vertices,
        })?)
    }

    /// Returns the state of the run as bytes, without the surfaces that the model was made of, from which `restore`
    /// continues it.
    pub fn save(&self) -> Vec<u8> {
        self.0.borrow().save()
    }

    /// Replaces the run by one that `save` returned, if this model has the same surfaces, given or derived, else fails;
    /// the run then continues with the same results, bit for bit.
    pub fn restore(&self, state: &Uint8Array) -> Result<(), JsValue> {
        self.0.borrow_mut().restore(&bytes(state)?).map_err(Failure::from)?;
        Ok(())
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Counts {
    band_count: usize,
    folded: usize,
    unmatched_vertices: usize,
    held_vertices: usize,
}

/// Converts an array of twelve numbers per ellipsoid, the centre and three semi-axis vectors, to ellipsoids; an
/// incomplete last one is dropped.
fn unpacked(packed: &Float64Array) -> Result<Vec<ControlEllipsoid>, Failure> {
    let numbers = doubles(packed)?;
    let (all, _) = numbers.as_chunks::<12>();
    let vector = |e: &[f64; 12], k: usize| [e[k], e[k + 1], e[k + 2]];
    Ok(all
        .iter()
        .map(|e| ControlEllipsoid { center: vector(e, 0), axes: [vector(e, 3), vector(e, 6), vector(e, 9)] })
        .collect())
}

/// Converts ellipsoids to an array of twelve numbers each: the centre and three semi-axis vectors.
fn packed(all: &[ControlEllipsoid]) -> Vec<f64> {
    all.iter().flat_map(|e| e.center.into_iter().chain(e.axes.into_iter().flatten())).collect()
}

/// Returns the specifications of the model's parameters, from which user interfaces build their controls.
#[wasm_bindgen(js_name = multiresParamSpecs)]
pub fn multires_param_specs() -> Result<JsValue, JsValue> {
    Ok(to_js(&MultiresParams::specs())?)
}
