//! The deformable model.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::{Float32Array, Float64Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, doubles, merged, now, points, to_js};
use super::error::Failure;
use super::mesh::{Body, RawMesh};
use super::volume::RawVolume;
use crate::math::DVec3;
use crate::methods::deformable::{
    Attractor, Coverage, CoverageSurvey, DeformableModel, DeformableOptions, DeformableParams, Missing,
    Start, param_specs,
};

/// The first surface of a model.
#[wasm_bindgen]
pub struct RawStart(Start);

#[wasm_bindgen]
impl RawStart {
    /// The iso-surface of the coarsest level.
    pub fn contour() -> RawStart {
        RawStart(Start::Contour)
    }

    /// Around all that the object takes up.
    pub fn enclosing() -> RawStart {
        RawStart(Start::Enclosing)
    }

    /// A grid of `count` by `count` by `count` bubbles.
    pub fn bubbles(count: u32) -> RawStart {
        RawStart(Start::Bubbles(count))
    }

    /// Spheres at packed world points.
    pub fn seeds(seeds: &Float32Array, radius: f64) -> Result<RawStart, JsValue> {
        let points = points(seeds)?.into_iter().map(|seed| seed.as_dvec3()).collect();
        Ok(RawStart(Start::Seeds { points, radius }))
    }

    /// The iso-surface of the volume.
    #[wasm_bindgen(js_name = marchingCubes)]
    pub fn marching_cubes(iso: f64) -> RawStart {
        RawStart(Start::MarchingCubes(iso))
    }

    /// A mesh of the caller's.
    pub fn mesh(mesh: &RawMesh) -> RawStart {
        RawStart(Start::Mesh(Rc::unwrap_or_clone(mesh.triangles())))
    }
}

/// A deformable model, shared with its live mesh.
#[wasm_bindgen]
pub struct RawDeformable(Rc<RefCell<DeformableModel>>);

#[wasm_bindgen]
impl RawDeformable {
    /// A model of one frame of a volume; parameters are written over the defaults for that volume.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        frame: usize,
        start: RawStart,
        levels: usize,
        edge: Option<f64>,
        params: &JsValue,
    ) -> Result<RawDeformable, JsValue> {
        let params = merged(&DeformableParams::for_volume(&volume.0), params)?;
        let options = DeformableOptions { frame, start: start.0, levels, edge, params: Some(params) };
        let mut model = DeformableModel::new(&volume.0, options).map_err(Failure::from)?;
        model.set_clock(now);
        Ok(RawDeformable(Rc::new(RefCell::new(model))))
    }

    /// The surface as a mesh that follows the model.
    pub fn mesh(&self) -> RawMesh {
        RawMesh(Body::Live(Rc::<RefCell<DeformableModel>>::clone(&self.0)))
    }

    /// Iterations until the end or `iterations` of them; the report of the last, with the events of all.
    pub fn step(&self, iterations: u32) -> Result<JsValue, JsValue> {
        let mut model = self.0.borrow_mut();
        let mut report = model.step().map_err(Failure::from)?;
        let mut events = report.events;
        for _ in 1..iterations {
            if report.done {
                break;
            }
            report = model.step().map_err(Failure::from)?;
            events += report.events;
        }
        report.events = events;
        Ok(to_js(&report)?)
    }

    /// Adds what this level shows and the surface leaves out.
    pub fn seed(&self) -> Result<JsValue, JsValue> {
        let report = self.0.borrow_mut().seed().map_err(Failure::from)?;
        Ok(to_js(&report)?)
    }

    /// Begins to measure how much of the iso-surface is covered.
    #[wasm_bindgen(js_name = surveyCoverage)]
    pub fn survey_coverage(&self) -> Result<RawCoverageSurvey, JsValue> {
        let survey = self.0.borrow().survey_coverage().map_err(Failure::from)?;
        Ok(RawCoverageSurvey(Some(survey)))
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

    /// Attractors, five numbers each: x, y, z, strength, radius.
    #[wasm_bindgen(js_name = setAttractors)]
    pub fn set_attractors(&self, packed: &Float64Array) -> Result<(), JsValue> {
        let numbers = doubles(packed)?;
        let (fives, _) = numbers.as_chunks::<5>();
        let list = fives.iter().map(|&[x, y, z, strength, radius]| Attractor {
            point: DVec3::new(x, y, z),
            strength,
            radius,
        });
        self.0.borrow_mut().set_attractors(list.collect()).map_err(Failure::from)?;
        Ok(())
    }

    /// Pyramid level, 0 = the volume itself.
    pub fn level(&self) -> usize {
        self.0.borrow().level()
    }

    /// Edge length the sampling is built on, world units.
    pub fn delta(&self) -> f64 {
        self.0.borrow().delta()
    }

    /// Speed of each vertex along its normal, in the order of the mesh's arrays.
    pub fn speeds(&self) -> Vec<f32> {
        self.0.borrow().speeds()
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

/// A measurement of coverage under way, of the surface as it was when it began.
#[wasm_bindgen]
pub struct RawCoverageSurvey(Option<CoverageSurvey>);

#[wasm_bindgen]
impl RawCoverageSurvey {
    /// Tests so many further triangles; the share of all that have been tested.
    pub fn advance(&mut self, triangles: usize) -> f64 {
        self.0.as_mut().map_or(1.0, |survey| survey.advance(triangles))
    }

    /// The result, once all triangles have been tested.
    pub fn finish(&mut self) -> Result<JsValue, JsValue> {
        let survey = self.0.take().ok_or_else(|| Failure::invalid("coverage", "has been measured"))?;
        Ok(to_js(&Measured::from(survey.finish()))?)
    }
}

/// [`Coverage`] as JavaScript has it.
#[derive(Serialize)]
struct Measured {
    recall: f64,
    precision: f64,
    uncovered: Vec<Part>,
}

#[derive(Serialize)]
struct Part {
    position: [f64; 3],
    area: f64,
    kind: &'static str,
}

impl From<Coverage> for Measured {
    fn from(Coverage { recall, precision, uncovered }: Coverage) -> Self {
        let parts = uncovered.into_iter().map(|part| Part {
            position: part.position.to_array(),
            area: part.area,
            kind: match part.kind {
                Missing::Matter => "matter",
                Missing::Hollow => "hollow",
            },
        });
        Self { recall, precision, uncovered: parts.collect() }
    }
}

/// What the model's parameters are, for building controls.
#[wasm_bindgen(js_name = deformableParamSpecs)]
pub fn deformable_param_specs() -> Result<JsValue, JsValue> {
    Ok(to_js(&param_specs())?)
}
