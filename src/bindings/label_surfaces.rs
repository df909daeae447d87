//! Bindings of the surfaces of a label map.

use std::cell::RefCell;
use std::rc::Rc;
use std::task::Poll;

use js_sys::Uint8Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, now, to_js, with_overrides};
use super::error::Failure;
use super::labels::region;
use super::mesh::RawMesh;
use super::method;
use super::volume::RawVolume;
use vesicle::math::DVec3;
use vesicle::mesh::TriangleMesh;
use vesicle::methods::label_surfaces::{LabelParams, LabelSurfaces};
use vesicle::methods::{LiveSurface, Method, MethodError, StepReport};
use vesicle::pauses::{Computation, advance, finished};
type Stepped = (LabelSurfaces, Result<StepReport, MethodError>);

/// Surfaces, of which a step may be under way: whatever is asked of them then ends it first, so that a step changes all or
/// nothing for those who look.
enum Surfaces {
    Ready(Box<LabelSurfaces>),
    Stepping(Computation<Stepped>),
    /// While they are moved from one state to another.
    Moved,
}

impl Surfaces {
    fn new(mut surfaces: LabelSurfaces) -> Self {
        surfaces.set_clock(now);
        Self::Ready(Box::new(surfaces))
    }

    /// Returns the surfaces, after the step that is under way.
    fn ready(&mut self) -> &mut LabelSurfaces {
        *self = match std::mem::replace(self, Self::Moved) {
            Self::Stepping(step) => Self::Ready(Box::new(finished(step).0)),
            ready => ready,
        };
        match self {
            Self::Ready(surfaces) => surfaces,
            _ => unreachable!("surfaces are moved back at once"),
        }
    }

    /// Does a slice of the step that is under way, or begins one; returns its report at its end.
    fn advance(&mut self) -> Option<Result<StepReport, MethodError>> {
        let mut step = match std::mem::replace(self, Self::Moved) {
            Self::Stepping(step) => step,
            Self::Ready(surfaces) => Box::pin(stepped(*surfaces)),
            Self::Moved => unreachable!("surfaces are moved back at once"),
        };
        match advance(&mut step) {
            Poll::Pending => {
                *self = Self::Stepping(step);
                None
            }
            Poll::Ready((surfaces, report)) => {
                *self = Self::Ready(Box::new(surfaces));
                Some(report)
            }
        }
    }
}

async fn stepped(mut surfaces: LabelSurfaces) -> Stepped {
    let report = surfaces.step_in_slices().await;
    (surfaces, report)
}

/// Surfaces of a label map that are being created in slices.
#[wasm_bindgen]
pub struct RawLabelCreation(Computation<Result<LabelSurfaces, MethodError>>);

#[wasm_bindgen]
impl RawLabelCreation {
    /// Begins to create the surfaces that the constructor of `RawLabelSurfaces` creates.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        labels: Option<Vec<f64>>,
        params: &JsValue,
        max_vertices: Option<usize>,
    ) -> Result<RawLabelCreation, JsValue> {
        let params = with_overrides(&LabelParams::default(), params)?;
        let creation =
            LabelSurfaces::begin(&volume.0, labels, params, max_vertices).map_err(Failure::from)?;
        Ok(RawLabelCreation(Box::pin(creation)))
    }

    /// Does a slice of the work; returns the surfaces at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<Option<RawLabelSurfaces>, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(None),
            Poll::Ready(surfaces) => Ok(Some(RawLabelSurfaces::of(surfaces.map_err(Failure::from)?))),
        }
    }
}

/// The raw handle of the TypeScript class `LabelSurfaces`, which shares the surfaces with their live meshes.
#[wasm_bindgen]
pub struct RawLabelSurfaces(Rc<RefCell<Surfaces>>);

impl RawLabelSurfaces {
    fn of(surfaces: LabelSurfaces) -> Self {
        Self(Rc::new(RefCell::new(Surfaces::new(surfaces))))
    }
}

#[wasm_bindgen]
impl RawLabelSurfaces {
    /// Creates the surfaces of the first frame of a label map, of all labels or those of `labels`. Properties of `params`
    /// replace the default parameters. There are at most `max_vertices` vertices, by default those of the core.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        labels: Option<Vec<f64>>,
        params: &JsValue,
        max_vertices: Option<usize>,
    ) -> Result<RawLabelSurfaces, JsValue> {
        let params = with_overrides(&LabelParams::default(), params)?;
        let creation =
            LabelSurfaces::begin(&volume.0, labels, params, max_vertices).map_err(Failure::from)?;
        Ok(Self::of(finished(creation).map_err(Failure::from)?))
    }

    /// Returns the labels that have voxels and a surface, in ascending order.
    pub fn labels(&self) -> Vec<f64> {
        self.0.borrow_mut().ready().labels()
    }

    /// Returns the surface of a label as a live mesh, which changes with the surfaces.
    pub fn mesh(&self, label: f64) -> Result<RawMesh, JsValue> {
        self.0.borrow_mut().ready().number_of(label).map_err(Failure::from)?;
        let mesh = LabelMesh { surfaces: Rc::clone(&self.0), label };
        Ok(RawMesh::live(&Rc::new(RefCell::new(mesh))))
    }

    /// Adopts the voxels of `volume` in the region of `dims` voxels from index `min`, where they have changed.
    pub fn refresh(&self, volume: &RawVolume, min: &[u32], dims: &[u32]) -> Result<(), JsValue> {
        let region = region(min, dims)?;
        Ok(self.0.borrow_mut().ready().refresh(&volume.0, region).map_err(Failure::from)?)
    }

    /// Makes `iterations` steps, or fewer if the surfaces are settled before; returns the `StepReport` of the last one.
    pub fn step(&self, iterations: u32) -> Result<JsValue, JsValue> {
        let report = self.0.borrow_mut().ready().steps(iterations).map_err(Failure::from)?;
        Ok(to_js(&report)?)
    }

    /// Does a slice of a step; returns its `StepReport` at its end, else undefined.
    pub fn advance(&self) -> Result<JsValue, JsValue> {
        let report = self.0.borrow_mut().advance().transpose().map_err(Failure::from)?;
        report.map_or(Ok(JsValue::UNDEFINED), |report| Ok(to_js(&report)?))
    }

    /// Returns the current values of all parameters, as a plain object.
    pub fn params(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.borrow_mut().ready().params())?)
    }

    /// Sets the parameters that are properties of the plain object `params`, and keeps the others; all are validated
    /// together before any is changed.
    #[wasm_bindgen(js_name = setParams)]
    pub fn set_params(&self, params: &JsValue) -> Result<(), JsValue> {
        let mut surfaces = self.0.borrow_mut();
        let surfaces = surfaces.ready();
        let params = with_overrides(surfaces.params(), params)?;
        Ok(surfaces.set_params(params).map_err(Failure::from)?)
    }

    /// Returns the state as bytes, without the label map.
    pub fn save(&self) -> Vec<u8> {
        self.0.borrow_mut().ready().save()
    }

    /// Restores a state that `save` returned, if it is of the same label map.
    pub fn restore(&self, state: &Uint8Array) -> Result<(), JsValue> {
        let state = bytes(state)?;
        Ok(self.0.borrow_mut().ready().restore(&state).map_err(Failure::from)?)
    }
}

/// Returns the descriptions of the parameters, from which user interfaces build their controls.
#[wasm_bindgen(js_name = labelParamSpecs)]
pub fn label_param_specs() -> Result<JsValue, JsValue> {
    Ok(method::param_specs::<LabelSurfaces>()?)
}

/// The live surface of one label.
struct LabelMesh {
    surfaces: Rc<RefCell<Surfaces>>,
    label: f64,
}

impl LiveSurface for LabelMesh {
    fn surface(&self) -> TriangleMesh {
        // A label never loses its surface, which is empty while the label has no voxels.
        self.surfaces.borrow_mut().ready().mesh(self.label).unwrap_or_default()
    }

    fn origin(&self) -> DVec3 {
        self.surfaces.borrow_mut().ready().origin()
    }

    fn counts(&self) -> [usize; 2] {
        self.surfaces.borrow_mut().ready().mesh_counts(self.label).unwrap_or_default()
    }

    fn versions(&self) -> [u32; 2] {
        let mut surfaces = self.surfaces.borrow_mut();
        let surfaces = surfaces.ready();
        // A restored state may not know labels that had lost all voxels.
        surfaces.mesh_versions(self.label).unwrap_or_else(|_| surfaces.versions())
    }
}
