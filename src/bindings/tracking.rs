//! Bindings of the surface tracker.

use std::cell::RefCell;
use std::future::Future;
use std::rc::Rc;
use std::task::Poll;

use js_sys::{Float64Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, doubles, to_js, with_overrides, write_options};
use super::error::Failure;
use super::mesh::{RawMesh, TriangleCopy, triangle_list};
use super::method;
use super::stepping::{LiveStepping, Stepping, sliced_bindings};
use super::volume::RawVolume;
use vesicle::io::AnimationWriter;
use vesicle::math::DVec3;
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, FrameStatistics, Proposal, Query, SurfaceTracker, TrackingLimits,
    TrackingOptions, TrackingParams,
};
use vesicle::methods::{Method, MethodError};
use vesicle::pauses::{Computation, advance};

/// Options of a tracker that are being proposed in slices.
#[wasm_bindgen]
pub struct RawProposal(Computation<Result<Proposal, MethodError>>);

#[wasm_bindgen]
impl RawProposal {
    /// Begins to propose options, from a `point` of an object in a frame, or else from two opposite `corners` of a box with
    /// one, both in world space, or from nothing.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        point: Option<Float64Array>,
        frame: usize,
        corners: Option<Float64Array>,
    ) -> Result<RawProposal, JsValue> {
        let query = match (point, corners) {
            (Some(point), _) => Query::Point { at: DVec3::from_slice(&doubles(&point)?), frame },
            (None, Some(corners)) => {
                let n = doubles(&corners)?;
                Query::Box([DVec3::from_slice(&n), DVec3::from_slice(&n[3..])])
            }
            (None, None) => Query::Moving,
        };
        Ok(RawProposal(Box::pin(SurfaceTracker::propose_in_slices(volume.0.clone(), query))))
    }

    /// Does a slice of the work; returns the `TrackingProposal` at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<JsValue, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(JsValue::UNDEFINED),
            Poll::Ready(proposal) => Ok(to_js(&ProposalCopy::from(proposal.map_err(Failure::from)?))?),
        }
    }
}

/// A proposal as JavaScript has it.
#[derive(Serialize)]
struct ProposalCopy {
    options: ProposedOptions,
    frame: usize,
}

#[derive(Serialize)]
struct ProposedOptions {
    voxels: VoxelEnds,
    component: [f64; 3],
    cavity: &'static str,
    params: ProposedParams,
}

#[derive(Serialize)]
struct VoxelEnds {
    min: [usize; 3],
    max: [usize; 3],
}

#[derive(Serialize)]
struct ProposedParams {
    threshold: f64,
}

impl From<Proposal> for ProposalCopy {
    fn from(proposal: Proposal) -> Self {
        let [min, max] = proposal.bounds;
        let options = ProposedOptions {
            voxels: VoxelEnds { min, max },
            component: proposal.component.to_array(),
            cavity: "closed",
            params: ProposedParams { threshold: proposal.threshold },
        };
        Self { options, frame: proposal.frame }
    }
}

/// Options of a tracker.
#[wasm_bindgen]
pub struct RawTrackingOptions(TrackingOptions);

#[wasm_bindgen]
impl RawTrackingOptions {
    /// Creates options for a 4D volume. The region processed is a box given by two opposite `corners` in world space, else by
    /// its first and last voxel, `voxels` (six numbers each), else the whole volume. The surface tracked is the component
    /// that contains the point `nearest`, in world space, or has the vertex nearest to it; without that point, the one that
    /// encloses the largest volume. `start` is the surface in the first frame, by default extracted from the image. With
    /// `is_closed`, muscles within a cavity count as blood. Properties of `params` replace the default parameters.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        corners: Option<Float64Array>,
        voxels: Option<Vec<u32>>,
        nearest: Option<Float64Array>,
        start: Option<TriangleCopy>,
        is_closed: bool,
        params: &JsValue,
    ) -> Result<RawTrackingOptions, JsValue> {
        let numbers = |array: Option<Float64Array>| array.as_ref().map(doubles).transpose();
        let world = |n: Vec<f64>| Bounds::World([DVec3::from_slice(&n), DVec3::from_slice(&n[3..])]);
        let within = |n: Vec<u32>| Bounds::Voxels([0, 3].map(|k| [k, k + 1, k + 2].map(|i| n[i] as usize)));
        Ok(RawTrackingOptions(TrackingOptions {
            volume: volume.0.clone(),
            bounds: numbers(corners)?.map(world).or(voxels.map(within)),
            component: numbers(nearest)?
                .map_or(Component::Largest, |n| Component::Nearest(DVec3::from_slice(&n))),
            start: start.map(|mesh| mesh.0),
            cavity: if is_closed { Cavity::Closed } else { Cavity::Open },
            limits: TrackingLimits::default(),
            params: with_overrides(&TrackingParams::default(), params)?,
        }))
    }

    /// Sets the largest numbers of vertices and of voxels.
    #[wasm_bindgen(js_name = setLimits)]
    pub fn set_limits(&mut self, max_vertices: Option<usize>, max_voxels: Option<usize>) {
        self.0.limits = TrackingLimits { max_vertices, max_voxels };
    }
}

/// A tracker that is being created in slices.
#[wasm_bindgen]
pub struct RawTrackerCreation(Computation<Result<SurfaceTracker, MethodError>>);

#[wasm_bindgen]
impl RawTrackerCreation {
    /// Begins to create the tracker that the constructor of `RawTracker` creates.
    #[wasm_bindgen(constructor)]
    pub fn new(options: RawTrackingOptions) -> RawTrackerCreation {
        RawTrackerCreation(Box::pin(SurfaceTracker::new_in_slices(options.0)))
    }

    /// Does a slice of the work; returns the tracker at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<Option<RawTracker>, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(None),
            Poll::Ready(tracker) => Ok(Some(RawTracker::of(tracker.map_err(Failure::from)?))),
        }
    }
}

/// The raw handle of the TypeScript class `SurfaceTracker`, which shares the tracker with the live mesh of its surface.
#[wasm_bindgen]
pub struct RawTracker(Rc<Stepping<SurfaceTracker>>);

sliced_bindings!(RawTracker, SurfaceTracker);

#[wasm_bindgen]
impl RawTracker {
    /// Creates a tracker of a surface through the frames of a 4D volume.
    #[wasm_bindgen(constructor)]
    pub fn new(options: RawTrackingOptions) -> Result<RawTracker, JsValue> {
        let tracker = SurfaceTracker::new(options.0).map_err(Failure::from)?;
        Ok(RawTracker::of(tracker))
    }

    /// Makes `iterations` steps, or fewer if the tracker is done before; returns the `StepReport` of the last step, with the
    /// events of all these steps.
    pub fn step(&self, iterations: u32) -> Result<JsValue, JsValue> {
        let report = self.0.ready().steps(iterations).map_err(Failure::from)?;
        Ok(to_js(&report)?)
    }

    /// Returns the current values of all parameters, as a plain object.
    pub fn params(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.ready().params())?)
    }

    /// Sets the parameters that are properties of the plain object `params`, and keeps the others; all are validated
    /// together before any is changed.
    #[wasm_bindgen(js_name = setParams)]
    pub fn set_params(&self, params: &JsValue) -> Result<(), JsValue> {
        let mut tracker = self.0.ready();
        let params = with_overrides(tracker.params(), params)?;
        Ok(tracker.set_params(params).map_err(Failure::from)?)
    }

    /// Returns the state of the run as bytes, without the input that the tracker was made of, from which `restore` continues
    /// it.
    pub fn save(&self) -> Vec<u8> {
        self.0.ready().save()
    }

    /// Replaces the run by one that `save` returned, if this tracker was made of the same input, else fails; the run then
    /// continues with the same results, bit for bit.
    pub fn restore(&self, state: &Uint8Array) -> Result<(), JsValue> {
        let state = bytes(state)?;
        Ok(self.0.ready().restore(&state).map_err(Failure::from)?)
    }

    /// Returns a live mesh of the surface in the newest finished frame; before the first one is finished, of the start
    /// surface if there is one, else empty.
    pub fn mesh(&self) -> RawMesh {
        RawMesh::live(&Rc::new(RefCell::new(LiveStepping(Rc::clone(&self.0)))))
    }

    /// Returns the surface of a finished frame; undefined for other frames.
    #[wasm_bindgen(js_name = meshAt)]
    pub fn mesh_at(&self, frame: usize) -> Option<RawMesh> {
        let tracker = self.0.ready();
        tracker.meshes().get(frame).map(|mesh| RawMesh(triangle_list(mesh.clone())))
    }

    /// Returns the index of the frame that the live mesh shows, the newest finished one; 0 before the first one is
    /// finished.
    pub fn frame(&self) -> usize {
        self.0.ready().frame()
    }

    /// Returns the origin in world space of the surfaces and boundary points, three numbers.
    pub fn origin(&self) -> Vec<f64> {
        self.0.ready().origin().to_array().to_vec()
    }

    /// Returns three numbers of frames: all in the volume, those in which the image boundary has been found, and those
    /// with a tracked surface.
    pub fn counts(&self) -> Vec<u32> {
        let tracker = self.0.ready();
        [tracker.frames(), tracker.frames_with_boundary(), tracker.meshes().len()].map(|n| n as u32).to_vec()
    }

    /// Returns the boundary points of the image found in a frame, five numbers each: x, y, z relative to the
    /// origin, t in frames, and the weight by boundary votes. Empty until the boundary of the frame is found.
    pub fn boundary(&self, frame: usize) -> Vec<f32> {
        self.0.ready().boundary(frame).into_iter().flatten().collect()
    }

    /// Returns the warnings about a frame.
    #[wasm_bindgen(js_name = warningsAt)]
    pub fn warnings_at(&self, frame: usize) -> Result<JsValue, JsValue> {
        Ok(to_js(&self.0.ready().warnings_in(frame))?)
    }

    /// Returns the volume that the surface encloses in each finished frame, in cubed world units.
    pub fn volumes(&self) -> Vec<f64> {
        self.0.ready().volumes()
    }

    /// Returns further results of tracking: the standard deviation of the image noise, in intensity; for a cyclic
    /// sequence, once it is known, the cycle closure error in world units; and the statistics of each finished frame.
    pub fn statistics(&self) -> Result<JsValue, JsValue> {
        let tracker = self.0.ready();
        let statistics = Statistics {
            noise: tracker.noise(),
            cycle_closure_error: tracker.cycle_closure_error(),
            frames: tracker.statistics(),
        };
        Ok(to_js(&statistics)?)
    }

    /// Returns the surfaces of the finished frames as the bytes of an animated GLB in which each lasts `frame_seconds`. Each
    /// line of `notes` for the reader of the file is `code: text`. `space` is that of the surfaces, `written_as` that in the
    /// file, and `unit` the unit of positions, each empty if it is not to be stated.
    #[wasm_bindgen(js_name = toGlb)]
    pub fn to_glb(
        &self,
        frame_seconds: f64,
        notes: &str,
        space: &str,
        written_as: &str,
        unit: &str,
    ) -> Result<Vec<u8>, JsValue> {
        let mut animation = AnimationWriter::new(&write_options(notes, [space, written_as, unit]));
        let tracker = self.0.ready();
        tracker.meshes().iter().try_for_each(|mesh| animation.add(mesh)).map_err(Failure::from)?;
        Ok(animation.finish(frame_seconds).map_err(Failure::from)?)
    }
}

impl RawTracker {
    fn of(tracker: SurfaceTracker) -> Self {
        Self(Stepping::new(tracker))
    }
}

/// Returns the descriptions of the parameters, from which user interfaces build their controls.
#[wasm_bindgen(js_name = trackingParamSpecs)]
pub fn tracking_param_specs() -> Result<JsValue, JsValue> {
    Ok(method::param_specs::<SurfaceTracker>()?)
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Statistics<'a> {
    noise: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    cycle_closure_error: Option<f64>,
    frames: &'a [FrameStatistics],
}
