//! Bindings of the multiresolution model.

use std::cell::{RefCell, RefMut};
use std::future::Future;
use std::rc::Rc;
use std::task::Poll;

use js_sys::Float64Array;
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{doubles, to_js, with_overrides};
use super::error::Failure;
use super::mesh::{RawMesh, TriangleCopy, triangle_list};
use super::method::method_bindings;
use super::stepping::{LiveStepping, Stepping, sliced_bindings};
use vesicle::math::DVec3;
use vesicle::mesh::TriangleMesh;
use vesicle::methods::multires::{
    ControlEllipsoid, MultiresOptions, MultiresParams, MultiresolutionModel, Support,
};
use vesicle::methods::{LiveSurface, MethodError};
use vesicle::pauses::{Computation, advance};

/// Returns the options of a model; properties of `params` replace the default parameters.
fn options(
    detail: Option<TriangleCopy>,
    base: Option<TriangleCopy>,
    ellipsoids: &Float64Array,
    params: &JsValue,
    holds_itself: bool,
) -> Result<MultiresOptions, Failure> {
    Ok(MultiresOptions {
        detail: detail.map(|mesh| mesh.0),
        base: base.map(|mesh| mesh.0),
        ellipsoids: unpacked(ellipsoids)?,
        params: with_overrides(&MultiresParams::default(), params)?,
        support: if holds_itself { Support::Surface } else { Support::Membrane },
    })
}

/// A model that is being created in slices.
#[wasm_bindgen]
pub struct RawMultiresCreation(Computation<Result<MultiresolutionModel, MethodError>>);

#[wasm_bindgen]
impl RawMultiresCreation {
    /// Begins to create the model that the constructor of `RawMultires` creates.
    #[wasm_bindgen(constructor)]
    pub fn new(
        detail: Option<TriangleCopy>,
        base: Option<TriangleCopy>,
        ellipsoids: &Float64Array,
        params: &JsValue,
        holds_itself: bool,
    ) -> Result<RawMultiresCreation, JsValue> {
        let options = options(detail, base, ellipsoids, params, holds_itself)?;
        Ok(RawMultiresCreation(Box::pin(MultiresolutionModel::begin(options))))
    }

    /// Does a slice of the work; returns the model at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<Option<RawMultires>, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(None),
            Poll::Ready(model) => Ok(Some(RawMultires(Stepping::new(model.map_err(Failure::from)?)))),
        }
    }
}

/// The raw handle of the TypeScript class `MultiresolutionModel`, which shares the model with the live meshes of its
/// surfaces.
#[wasm_bindgen]
pub struct RawMultires(Rc<Stepping<MultiresolutionModel>>);

impl RawMultires {
    fn ready(&self) -> RefMut<'_, MultiresolutionModel> {
        self.0.ready()
    }
}

sliced_bindings!(RawMultires, MultiresolutionModel);
method_bindings!(RawMultires, MultiresolutionModel, multiresParamSpecs);

/// A surface of a multiresolution model besides the detailed one, as the content of a live mesh: the deformed base, or the
/// link mesh, which has the triangles of the deformed base with each vertex at its position on the undeformed base (the
/// map T).
struct BaseView {
    model: Rc<Stepping<MultiresolutionModel>>,
    is_link: bool,
}

impl LiveSurface for BaseView {
    fn surface(&self) -> TriangleMesh {
        let model = self.model.ready();
        if self.is_link { model.link_mesh() } else { model.base_surface() }
    }

    fn origin(&self) -> DVec3 {
        self.model.ready().origin()
    }

    fn counts(&self) -> [usize; 2] {
        self.model.ready().base_mesh().counts()
    }

    fn versions(&self) -> [u32; 2] {
        self.model.ready().base_mesh().versions()
    }
}

#[wasm_bindgen]
impl RawMultires {
    /// Creates a multiresolution model. `detail` is the surface with detail; without it the model has none. `base` is
    /// the smooth surface M₀, derived if not given. `ellipsoids` are the control ellipsoids, twelve numbers each: the
    /// centre and three semi-axis vectors; if there are none, they are proposed for a surface that `holds_itself`. Properties of
    /// `params` replace the default parameters.
    #[wasm_bindgen(constructor)]
    pub fn new(
        detail: Option<TriangleCopy>,
        base: Option<TriangleCopy>,
        ellipsoids: &Float64Array,
        params: &JsValue,
        holds_itself: bool,
    ) -> Result<RawMultires, JsValue> {
        let options = options(detail, base, ellipsoids, params, holds_itself)?;
        Ok(RawMultires(Stepping::new(MultiresolutionModel::new(options).map_err(Failure::from)?)))
    }

    /// Returns a live mesh of the model: the detailed surface (0), the deformed base (1) or the link mesh (2).
    pub fn mesh(&self, which: u32) -> RawMesh {
        if which == 0 {
            return RawMesh::live(&Rc::new(RefCell::new(LiveStepping(Rc::clone(&self.0)))));
        }
        RawMesh::live(&Rc::new(RefCell::new(BaseView { model: Rc::clone(&self.0), is_link: which > 1 })))
    }

    /// Returns the membrane as solved for the current ellipsoids on each level of the multi-level solver, one mesh
    /// each, from coarse to fine.
    #[wasm_bindgen(js_name = levelMeshes)]
    pub fn level_meshes(&self) -> Vec<RawMesh> {
        let levels = self.ready().levels();
        levels.into_iter().map(|mesh| RawMesh(triangle_list(mesh))).collect()
    }

    /// Sets the target ellipsoids, towards which the model moves its current ellipsoids: twelve numbers each, the
    /// centre and three semi-axis vectors.
    #[wasm_bindgen(js_name = setEllipsoids)]
    pub fn set_ellipsoids(&self, ellipsoids: &Float64Array) -> Result<(), JsValue> {
        self.ready().set_ellipsoids(&unpacked(ellipsoids)?).map_err(Failure::from)?;
        Ok(())
    }

    /// Returns the current ellipsoids, including those that are being removed: twelve numbers each, the centre and
    /// three semi-axis vectors.
    pub fn ellipsoids(&self) -> Vec<f64> {
        packed(&self.ready().ellipsoids())
    }

    /// Returns the target ellipsoids, without those that are being removed: twelve numbers each, the centre and three
    /// semi-axis vectors.
    pub fn targets(&self) -> Vec<f64> {
        packed(&self.ready().targets())
    }

    /// Returns for each vertex of the deformed base how much the map T to the undeformed base distorts areas (`which`
    /// 0: the area on the undeformed base divided by that on the deformed one) or angles (any other: the ratio of the
    /// largest to the smallest stretch); 1 without distortion.
    pub fn distortion(&self, which: u32) -> Vec<f32> {
        let found = self.ready().distortion();
        let values = if which == 0 { found.area } else { found.angle };
        values.into_iter().map(|value| value as f32).collect()
    }

    /// Returns further counts about the model: surfaces in the decomposition, including the base; folded triangles of
    /// the map T; and, in the last reconstruction of detail, vertices whose normal missed the finer surface, and
    /// vertices held back to avoid self-intersections.
    pub fn counts(&self) -> Result<JsValue, JsValue> {
        let model = self.ready();
        let [unmatched_vertices, held_vertices] = model.detail_counts();
        Ok(to_js(&Counts {
            band_count: model.band_count(),
            folded: model.folded(),
            unmatched_vertices,
            held_vertices,
        })?)
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
