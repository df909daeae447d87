//! Bindings of the deformable model.

use std::cell::{RefCell, RefMut};
use std::future::Future;
use std::rc::Rc;
use std::task::Poll;

use js_sys::Float64Array;
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{doubles, to_js, with_overrides, world_points};
use super::error::Failure;
use super::mesh::RawMesh;
use super::method::method_bindings;
use super::stepping::{LiveStepping, Stepping, sliced_bindings};
use super::volume::RawVolume;
use vesicle::math::DVec3;
use vesicle::methods::MethodError;
use vesicle::methods::deformable::{
    Attractor, Coverage, CoverageSurvey, DeformableModel, DeformableOptions, DeformableParams, Missing, Start,
};
use vesicle::pauses::{Computation, advance};

/// The raw handle of a start surface, from which a deformable model begins.
#[wasm_bindgen]
pub struct RawStart(pub(super) Start);

#[wasm_bindgen]
impl RawStart {
    /// Returns the start `contour`: the iso-surface at π_I (the parameter `iso`) of the coarsest pyramid level, without
    /// its smallest parts; see [`Start::Contour`].
    pub fn contour() -> RawStart {
        RawStart(Start::Contour)
    }

    /// Returns the start `enclosing`: a rounded box around the voxels of the coarsest pyramid level that are brighter
    /// than π_I (the parameter `iso`), or around the whole image; see [`Start::Enclosing`].
    pub fn enclosing() -> RawStart {
        RawStart(Start::Enclosing)
    }

    /// Returns a start of `count` × `count` × `count` small spheres, in a grid that fills the image.
    pub fn bubbles(count: u32) -> RawStart {
        RawStart(Start::Bubbles(count))
    }

    /// Returns a start of spheres of `radius`, in world units, around the points `seeds`, x, y and z of each in turn in
    /// world space.
    pub fn seeds(seeds: &JsValue, radius: f64) -> Result<RawStart, JsValue> {
        Ok(RawStart(Start::Seeds { points: world_points(seeds)?, radius }))
    }

    /// Returns a start from marching cubes: the iso-surface of the coarsest pyramid level at intensity `iso`.
    #[wasm_bindgen(js_name = marchingCubes)]
    pub fn marching_cubes(iso: f64) -> RawStart {
        RawStart(Start::MarchingCubes(iso))
    }

    /// Returns a start from a copy of a mesh in world space, which must be closed and free of self-intersections.
    pub fn mesh(mesh: &RawMesh) -> RawStart {
        RawStart(Start::Mesh(Rc::unwrap_or_clone(mesh.triangles())))
    }
}

/// The raw handle of the TypeScript class `DeformableModel`, which shares the model with the live mesh of its surface.
#[wasm_bindgen]
pub struct RawDeformable(pub(super) Rc<Stepping<DeformableModel>>);

impl RawDeformable {
    pub(super) fn ready(&self) -> RefMut<'_, DeformableModel> {
        self.0.ready()
    }
}

/// The options of a model of a volume, and of its creation.
#[wasm_bindgen]
pub struct RawDeformableOptions(DeformableOptions);

#[wasm_bindgen]
impl RawDeformableOptions {
    /// Creates options by default; properties of `params` replace the default parameters for `volume`.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        start: RawStart,
        params: &JsValue,
    ) -> Result<RawDeformableOptions, JsValue> {
        let params = Some(with_overrides(&DeformableParams::for_volume(&volume.0), params)?);
        Ok(RawDeformableOptions(DeformableOptions { start: start.0, params, ..Default::default() }))
    }

    /// Sets the frame, and the number of pyramid levels.
    #[wasm_bindgen(js_name = setFrame)]
    pub fn set_frame(&mut self, frame: usize, levels: usize) {
        (self.0.frame, self.0.levels) = (frame, levels);
    }

    /// Sets the target edge length on the finest level, in world units, derived from the volume if not given, and the
    /// largest number of vertices.
    #[wasm_bindgen(js_name = setSize)]
    pub fn set_size(&mut self, edge: Option<f64>, max_vertices: Option<usize>) {
        (self.0.edge, self.0.max_vertices) = (edge, max_vertices);
    }
}

/// A model that is being created in slices.
#[wasm_bindgen]
pub struct RawDeformableCreation(pub(super) Computation<Result<DeformableModel, MethodError>>);

#[wasm_bindgen]
impl RawDeformableCreation {
    /// Begins to create the model that the constructor of `RawDeformable` creates.
    #[wasm_bindgen(constructor)]
    pub fn new(volume: &RawVolume, options: RawDeformableOptions) -> Result<RawDeformableCreation, JsValue> {
        let creation = DeformableModel::begin(&volume.0, options.0).map_err(Failure::from)?;
        Ok(RawDeformableCreation(Box::pin(creation)))
    }

    /// Does a slice of the work; returns the model at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<Option<RawDeformable>, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(None),
            Poll::Ready(model) => Ok(Some(RawDeformable(Stepping::new(model.map_err(Failure::from)?)))),
        }
    }
}

sliced_bindings!(RawDeformable, DeformableModel);
method_bindings!(RawDeformable, DeformableModel, deformableParamSpecs);

#[wasm_bindgen]
impl RawDeformable {
    /// Creates a deformable model of one frame of a volume.
    #[wasm_bindgen(constructor)]
    pub fn new(volume: &RawVolume, options: RawDeformableOptions) -> Result<RawDeformable, JsValue> {
        let model = DeformableModel::new(&volume.0, options.0).map_err(Failure::from)?;
        Ok(RawDeformable(Stepping::new(model)))
    }

    /// Sets the largest number of vertices.
    #[wasm_bindgen(js_name = setMaxVertices)]
    pub fn set_max_vertices(&self, most: Option<usize>) {
        self.ready().set_max_vertices(most);
    }

    /// Returns the largest number of pyramid levels above a volume.
    #[wasm_bindgen(js_name = maxLevels)]
    pub fn max_levels(volume: &RawVolume) -> usize {
        DeformableModel::max_levels(&volume.0)
    }

    /// Returns the surface as a live mesh, which changes with the model.
    pub fn mesh(&self) -> RawMesh {
        RawMesh::live(&Rc::new(RefCell::new(LiveStepping(Rc::clone(&self.0)))))
    }

    /// Adds the parts of the iso-surface at π_I of the current pyramid level that the model's surface lacks, unless its
    /// topology is fixed; returns a `StepReport` that counts them as `seeds`.
    pub fn seed(&self) -> Result<JsValue, JsValue> {
        let report = self.ready().seed().map_err(Failure::from)?;
        Ok(to_js(&report)?)
    }

    /// Starts a measurement of which fractions of the model's surface and of the volume's iso-surface lie near each
    /// other; see [`Coverage`].
    #[wasm_bindgen(js_name = surveyCoverage)]
    pub fn survey_coverage(&self) -> Result<RawCoverageSurvey, JsValue> {
        let survey = self.ready().survey_coverage().map_err(Failure::from)?;
        Ok(RawCoverageSurvey(survey))
    }

    /// Replaces the attractors, points that pull the surface: five numbers each, which are x, y and z in world space,
    /// the strength (negative to repel) and the radius, in world units, beyond which there is no force.
    #[wasm_bindgen(js_name = setAttractors)]
    pub fn set_attractors(&self, packed: &Float64Array) -> Result<(), JsValue> {
        let numbers = doubles(packed)?;
        let (fives, _) = numbers.as_chunks::<5>();
        let list = fives.iter().map(|&[x, y, z, strength, radius]| Attractor {
            point: DVec3::new(x, y, z),
            strength,
            radius,
        });
        self.ready().set_attractors(list.collect()).map_err(Failure::from)?;
        Ok(())
    }

    /// Returns the index of the current pyramid level; 0 is the volume itself, higher ones are coarser.
    pub fn level(&self) -> usize {
        self.ready().level()
    }

    /// Returns the lower bound of edge lengths on the current pyramid level, δ, in world units, averaged over
    /// directions if voxels are not cubes.
    pub fn delta(&self) -> f64 {
        self.ready().delta()
    }

    /// Returns the speed of each vertex along its outward normal, negative inwards, in world units per unit of time and
    /// in the order of the mesh's arrays.
    pub fn speeds(&self) -> Vec<f32> {
        self.ready().speeds()
    }
}

/// A measurement in progress of how far the surface of a model, as it was at the start of the measurement, and the
/// iso-surface of the volume cover each other.
#[wasm_bindgen]
pub struct RawCoverageSurvey(CoverageSurvey);

#[wasm_bindgen]
impl RawCoverageSurvey {
    /// Does a slice of the work; returns the coverage at the end, recall, precision and uncovered regions, after which this
    /// must not be called any more.
    pub fn advance(&mut self) -> Result<Option<JsValue>, JsValue> {
        match self.0.advance() {
            Poll::Pending => Ok(None),
            Poll::Ready(coverage) => {
                Ok(Some(to_js(&CoverageResult::from(coverage.map_err(Failure::from)?))?))
            }
        }
    }

    /// Returns the fraction of all triangles tested so far.
    pub fn share(&self) -> f64 {
        self.0.share()
    }
}

/// [`Coverage`] as it is passed to JavaScript.
#[derive(Serialize)]
struct CoverageResult {
    recall: f64,
    precision: f64,
    uncovered: Vec<UncoveredRegion>,
}

#[derive(Serialize)]
struct UncoveredRegion {
    position: [f64; 3],
    area: f64,
    kind: &'static str,
}

impl From<Coverage> for CoverageResult {
    fn from(Coverage { recall, precision, uncovered }: Coverage) -> Self {
        let parts = uncovered.into_iter().map(|part| UncoveredRegion {
            position: part.position.to_array(),
            area: part.area,
            kind: match part.kind {
                Missing::Matter => "matter",
                Missing::Cavity => "cavity",
            },
        });
        Self { recall, precision, uncovered: parts.collect() }
    }
}
