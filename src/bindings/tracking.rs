//! Bindings of the surface tracker.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::Float64Array;
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{doubles, to_js, with_overrides, write_options};
use super::error::Failure;
use super::mesh::{RawMesh, TriangleCopy, triangle_list};
use super::method::{method_bindings, shared};
use super::volume::RawVolume;
use vesicle::io::AnimationWriter;
use vesicle::math::DVec3;
use vesicle::methods::tracking::{
    Bounds, Component, FrameStatistics, SurfaceTracker, TrackingOptions, TrackingParams,
};

/// The raw handle of the TypeScript class `SurfaceTracker`, which shares the tracker with the live mesh of its surface.
#[wasm_bindgen]
pub struct RawTracker(Rc<RefCell<SurfaceTracker>>);

method_bindings!(RawTracker, SurfaceTracker, trackingParamSpecs);

#[wasm_bindgen]
impl RawTracker {
    /// Creates a tracker of a surface through the frames of a 4D volume. The region processed is a box given by two
    /// opposite `corners` in world space, else by its first and last voxel, `voxels` (six numbers each), else the whole
    /// volume. The surface tracked is the component that contains the point `nearest`, in world space, or has the
    /// vertex nearest to it; without that point, the one that encloses the largest volume. `start` is the surface in
    /// the first frame, by default extracted from the image. Properties of `params` replace the default parameters.
    #[wasm_bindgen(constructor)]
    pub fn new(
        volume: &RawVolume,
        corners: Option<Float64Array>,
        voxels: Option<Vec<u32>>,
        nearest: Option<Float64Array>,
        start: Option<TriangleCopy>,
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
            params: with_overrides(&TrackingParams::default(), params)?,
        };
        Ok(RawTracker(shared(SurfaceTracker::new(options))?))
    }

    /// Returns a live mesh of the surface in the newest finished frame; before the first one is finished, of the start
    /// surface if there is one, else empty.
    pub fn mesh(&self) -> RawMesh {
        RawMesh::live(&self.0)
    }

    /// Returns the surface of a finished frame; undefined for other frames.
    #[wasm_bindgen(js_name = meshAt)]
    pub fn mesh_at(&self, frame: usize) -> Option<RawMesh> {
        let tracker = self.0.borrow();
        tracker.meshes().get(frame).map(|mesh| RawMesh(triangle_list(mesh.clone())))
    }

    /// Returns the index of the frame that the live mesh shows, the newest finished one; 0 before the first one is
    /// finished.
    pub fn frame(&self) -> usize {
        self.0.borrow().frame()
    }

    /// Returns the origin in world space of the surfaces and boundary points, three numbers.
    pub fn origin(&self) -> Vec<f64> {
        self.0.borrow().origin().to_array().to_vec()
    }

    /// Returns three numbers of frames: all in the volume, those in which the image boundary has been found, and those
    /// with a tracked surface.
    pub fn counts(&self) -> Vec<u32> {
        let tracker = self.0.borrow();
        [tracker.frames(), tracker.frames_with_boundary(), tracker.meshes().len()].map(|n| n as u32).to_vec()
    }

    /// Returns the boundary points of the image found in a frame, five numbers each: x, y, z relative to the
    /// origin, t in frames, and the weight by boundary votes. Empty until the boundary of the frame is found.
    pub fn boundary(&self, frame: usize) -> Vec<f32> {
        self.0.borrow().boundary(frame).into_iter().flatten().collect()
    }

    /// Returns the volume that the surface encloses in each finished frame, in cubed world units.
    pub fn volumes(&self) -> Vec<f64> {
        self.0.borrow().volumes()
    }

    /// Returns further results of tracking: the standard deviation of the image noise, in intensity; for a cyclic
    /// sequence, once it is known, the cycle closure error in world units; and the statistics of each finished frame.
    pub fn statistics(&self) -> Result<JsValue, JsValue> {
        let tracker = self.0.borrow();
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
        let tracker = self.0.borrow();
        tracker.meshes().iter().try_for_each(|mesh| animation.add(mesh)).map_err(Failure::from)?;
        Ok(animation.finish(frame_seconds).map_err(Failure::from)?)
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Statistics<'a> {
    noise: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    cycle_closure_error: Option<f64>,
    frames: &'a [FrameStatistics],
}
