//! The surface tracker.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::{Float64Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, doubles, merged, now, to_js};
use super::error::Failure;
use super::mesh::{Body, Live, RawMesh, TrianglesOf};
use super::volume::RawVolume;
use crate::io::write_animation;
use crate::math::DVec3;
use crate::mesh::TriangleMesh;
use crate::methods::tracking::{
    Bounds, Component, FrameFacts, SurfaceTracker, TrackingOptions, TrackingParams, param_specs,
};

/// A surface tracker, shared with its live mesh.
#[wasm_bindgen]
pub struct RawTracker(Rc<RefCell<SurfaceTracker>>);

/// The surface of the newest frame.
struct Newest(Rc<RefCell<SurfaceTracker>>);

impl Live for Newest {
    fn surface(&self) -> TriangleMesh {
        self.0.borrow().mesh().to_triangles()
    }

    fn counts(&self) -> [usize; 2] {
        let tracker = self.0.borrow();
        [tracker.mesh().vertex_count(), tracker.mesh().triangle_count()]
    }

    fn versions(&self) -> [u32; 2] {
        let tracker = self.0.borrow();
        [tracker.mesh().topology_version(), tracker.mesh().geometry_version()]
    }
}

#[wasm_bindgen]
impl RawTracker {
    /// A tracker of a volume. `corners`: six numbers, of the box in the world; `voxels`: six, the first and the last voxel;
    /// `nearest`: a point, for the surface around it or nearest to it.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        corners: Option<Float64Array>,
        voxels: Option<Vec<u32>>,
        nearest: Option<Float64Array>,
        start: Option<TrianglesOf>,
        params: &JsValue,
    ) -> Result<RawTracker, JsValue> {
        let numbers = |array: Option<Float64Array>| array.as_ref().map(doubles).transpose();
        let world = |n: Vec<f64>| Bounds::World([DVec3::from_slice(&n), DVec3::from_slice(&n[3..])]);
        let within = |n: Vec<u32>| Bounds::Voxels([0, 3].map(|k| [k, k + 1, k + 2].map(|i| n[i] as usize)));
        let options = TrackingOptions {
            volume: volume.0.clone(),
            bounds: numbers(corners)?.map(world).or(voxels.map(within)),
            component: numbers(nearest)?
                .map_or(Component::Largest, |n| Component::Nearest(DVec3::from_slice(&n))),
            start: start.map(|mesh| mesh.0),
            params: merged(&TrackingParams::default(), params)?,
        };
        let mut tracker = SurfaceTracker::new(options).map_err(Failure::from)?;
        tracker.set_clock(now);
        Ok(RawTracker(Rc::new(RefCell::new(tracker))))
    }

    /// A mesh that follows the newest frame.
    pub fn mesh(&self) -> RawMesh {
        RawMesh(Body::Live(Rc::new(RefCell::new(Newest(Rc::clone(&self.0))))))
    }

    /// The surface of a frame that is done; nothing for the others.
    #[wasm_bindgen(js_name = meshAt)]
    pub fn mesh_at(&self, frame: usize) -> Option<RawMesh> {
        let tracker = self.0.borrow();
        tracker.meshes().get(frame).map(|mesh| RawMesh(Body::Triangles(Rc::new(mesh.clone()))))
    }

    /// So many frames, or to the end; the report of the last.
    pub fn step(&self, iterations: u32) -> Result<JsValue, JsValue> {
        let mut tracker = self.0.borrow_mut();
        let mut report = tracker.step().map_err(Failure::from)?;
        for _ in 1..iterations {
            if report.done {
                break;
            }
            let events = report.events;
            report = tracker.step().map_err(Failure::from)?;
            report.events += events;
        }
        Ok(to_js(&report)?)
    }

    /// The frame that the mesh is of.
    pub fn frame(&self) -> usize {
        self.0.borrow().frame()
    }

    /// Frames of the volume, those with a boundary, those with a surface.
    pub fn counts(&self) -> Vec<u32> {
        let tracker = self.0.borrow();
        [tracker.frames(), tracker.bounded(), tracker.meshes().len()].map(|n| n as u32).to_vec()
    }

    /// Points of the boundary, five numbers each: x, y, z, t, w.
    pub fn boundary(&self, frame: usize) -> Vec<f32> {
        self.0.borrow().boundary(frame).into_iter().flatten().collect()
    }

    /// The volumes of the frames that are done.
    pub fn volumes(&self) -> Vec<f64> {
        self.0.borrow().volumes()
    }

    /// What there is to tell of the frames, the noise, and how a cycle closes.
    pub fn facts(&self) -> Result<JsValue, JsValue> {
        let tracker = self.0.borrow();
        let facts = Facts { noise: tracker.noise(), closing: tracker.closing(), frames: tracker.facts() };
        Ok(to_js(&facts)?)
    }

    /// The frames that are done, as an animated GLB.
    #[wasm_bindgen(js_name = toGlb)]
    pub fn to_glb(&self, frame_seconds: f64) -> Result<Vec<u8>, JsValue> {
        let tracker = self.0.borrow();
        Ok(write_animation(tracker.meshes(), frame_seconds).map_err(Failure::from)?)
    }

    /// All parameters.
    pub fn params(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(self.0.borrow().params())?)
    }

    /// Some parameters, checked together with the others before any is taken.
    #[wasm_bindgen(js_name = setParams)]
    pub fn set_params(&self, params: &JsValue) -> Result<(), JsValue> {
        let mut tracker = self.0.borrow_mut();
        let params = merged(tracker.params(), params)?;
        tracker.set_params(params).map_err(Failure::from)?;
        Ok(())
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
struct Facts<'a> {
    noise: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    closing: Option<f64>,
    frames: &'a [FrameFacts],
}

/// What the tracker's parameters are, for building controls.
#[wasm_bindgen(js_name = trackingParamSpecs)]
pub fn tracking_param_specs() -> Result<JsValue, JsValue> {
    Ok(to_js(&param_specs())?)
}
