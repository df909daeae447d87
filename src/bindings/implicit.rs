//! Bindings of the implicit surface and its cameras.

use std::cell::{RefCell, RefMut};
use std::rc::Rc;
use std::task::Poll;

use js_sys::{Float32Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{bytes, floats, in_world, located, points, relative, to_js, with_overrides};
use super::error::Failure;
use super::mesh::{RawMesh, triangle_list};
use super::method::{method_bindings, shared};
use super::volume::RawVolume;
use vesicle::math::Vec3;
use vesicle::methods::MethodError;
use vesicle::methods::implicit::{
    Camera, Choice, Cloud, ImplicitOptions, ImplicitParams, ImplicitSurface, PointEdits, VertexColors,
};
use vesicle::pauses::{Computation, advance};
use vesicle::volume::Volume;

/// The raw handle of a list of cameras, whose images colour an implicit surface.
#[wasm_bindgen]
#[derive(Default)]
pub struct RawCameras(Vec<Camera>);

#[wasm_bindgen]
impl RawCameras {
    /// Creates an empty list of cameras.
    #[wasm_bindgen(constructor)]
    pub fn new() -> RawCameras {
        Self::default()
    }

    /// Appends a camera: the 3 × 4 matrix that projects world space to pixels, row by row, the image size in pixels,
    /// and the image as four bytes per pixel (red, green, blue, alpha) if there is one.
    pub fn push(
        &mut self,
        projection: &[f64],
        width: u32,
        height: u32,
        image: Option<Uint8Array>,
    ) -> Result<(), JsValue> {
        let projection: [f64; 12] =
            projection.try_into().map_err(|_| Failure::invalid("projection", "must be 12 numbers"))?;
        let image = image.as_ref().map(bytes).transpose()?;
        self.0.push(Camera::new(projection, width, height, image).map_err(Failure::from)?);
        Ok(())
    }
}

/// The raw handle of the TypeScript class `ImplicitSurface`, which shares the model with the live mesh of its surface.
#[wasm_bindgen]
pub struct RawImplicit(Rc<RefCell<ImplicitSurface>>);

impl RawImplicit {
    fn ready(&self) -> RefMut<'_, ImplicitSurface> {
        self.0.borrow_mut()
    }
}

method_bindings!(RawImplicit, ImplicitSurface, implicitParamSpecs);

#[wasm_bindgen]
impl RawImplicit {
    /// Creates an implicit surface of points, with a normal, a confidence and a colour of each if given, and points
    /// known to be outside (`exterior`); the images of `cameras` colour it. At most `max_points` become surface
    /// constraints; only the `keep_components` largest clusters of nearby points are used, all if it is not given. The surface
    /// may have about `max_vertices`. Properties of `params` replace the defaults.
    #[wasm_bindgen(constructor)]
    #[expect(
        clippy::too_many_arguments,
        reason = "the TypeScript class names them; an object would have to be unpacked here"
    )]
    pub fn new(
        positions: &JsValue,
        normals: Option<Float32Array>,
        confidence: Option<Float32Array>,
        colors: Option<Float32Array>,
        exterior: &JsValue,
        cameras: RawCameras,
        max_points: Option<usize>,
        keep_components: Option<usize>,
        max_vertices: Option<usize>,
        params: &JsValue,
    ) -> Result<RawImplicit, JsValue> {
        let (positions, origin) = located(positions)?;
        let cloud = Cloud {
            points: positions,
            origin,
            normals: normals.as_ref().map(points).transpose()?,
            confidence: confidence.as_ref().map(floats).transpose()?,
            colors: colors.as_ref().map(points).transpose()?,
        };
        let defaults = ImplicitOptions::default();
        let options = ImplicitOptions {
            exterior: (!exterior.is_undefined()).then(|| relative(exterior, origin)).transpose()?,
            cameras: cameras.0,
            max_points: max_points.unwrap_or(defaults.max_points),
            keep_components,
            max_vertices,
            params: with_overrides(&ImplicitParams::default(), params)?,
        };
        Ok(RawImplicit(shared(ImplicitSurface::new(cloud, options))?))
    }

    /// Returns the surface as a live mesh, which changes with the model.
    pub fn mesh(&self) -> RawMesh {
        RawMesh::live(&self.0)
    }

    /// Returns a copy of the surface while it is made: the part extracted so far, or all of it while it is being
    /// coloured; empty in other phases.
    pub fn preview(&self) -> Result<RawMesh, JsValue> {
        let mesh = self.0.borrow().preview().map_err(Failure::from)?;
        Ok(RawMesh(triangle_list(mesh)))
    }

    /// Replaces all manual edits of the input points: the positions of added points and of exterior points (known to be
    /// outside), x, y and z of each in turn, and the indices of the input points to leave out.
    #[wasm_bindgen(js_name = setEdits)]
    pub fn set_edits(&self, added: &JsValue, removed: Vec<u32>, exterior: &JsValue) -> Result<(), JsValue> {
        let [added, exterior] = [self.relative(added)?, self.relative(exterior)?];
        let edits = PointEdits { added, removed, exterior };
        self.0.borrow_mut().set_edits(edits).map_err(Failure::from)?;
        Ok(())
    }

    /// Returns the points that were added manually, as packed xyz.
    pub fn added(&self) -> JsValue {
        self.in_world(&self.0.borrow().edits().added)
    }

    /// Returns the indices of the input points that were removed manually.
    pub fn removed(&self) -> Vec<u32> {
        self.0.borrow().edits().removed.clone()
    }

    /// Returns the exterior points (known to be outside) that were set manually, as packed xyz.
    pub fn exterior(&self) -> JsValue {
        self.in_world(&self.0.borrow().edits().exterior)
    }

    /// Returns the values of the implicit function f minus its iso-value at packed points in world space: positive
    /// inside, 0 on the surface, negative outside.
    pub fn evaluate(&self, at: &JsValue) -> Result<Vec<f32>, JsValue> {
        let values = self.0.borrow().evaluate(&self.relative(at)?).map_err(Failure::from)?;
        Ok(values.into_iter().map(|value| value as f32).collect())
    }

    /// Returns the gradients of the implicit function, ∇f, at packed points, x, y and z of each in turn, per world
    /// unit; on the surface they point inwards.
    pub fn gradient(&self, at: &JsValue) -> Result<Vec<f32>, JsValue> {
        let gradients = self.0.borrow().gradient(&self.relative(at)?).map_err(Failure::from)?;
        Ok(gradients.into_iter().flat_map(|g| g.as_vec3().to_array()).collect())
    }

    /// Returns the positions of the constraints of the implicit function: the surface constraints (`which` 0), the
    /// exterior constraints (1) or those inside (2), as packed xyz in world space.
    pub fn constraints(&self, which: usize) -> JsValue {
        self.0.borrow().constraints().get(which).map_or(JsValue::UNDEFINED, |some| self.in_world(some))
    }

    /// Returns how well the surface fits the input points, as edited manually, as a `Fitness` object: their distances
    /// from the surface, and its mean curvature.
    pub fn fitness(&self) -> Result<JsValue, JsValue> {
        let fitness = self.0.borrow().fitness().map_err(Failure::from)?;
        Ok(to_js(&fitness)?)
    }

    /// Returns the implicit function f minus its iso-value as a volume of `dims` voxels that covers the points and the
    /// surface: positive inside, negative outside.
    #[wasm_bindgen(js_name = toVolume)]
    pub fn to_volume(&self, dims: &[u32]) -> Result<RawVolume, JsValue> {
        let dims: [u32; 3] = dims.try_into().map_err(|_| Failure::invalid("dims", "must be 3 integers"))?;
        let volume = self.0.borrow().to_volume(dims.map(|n| n as usize)).map_err(Failure::from)?;
        Ok(RawVolume(volume))
    }

    /// Begins what `toVolume` does, in slices of work; the surface may change meanwhile.
    #[wasm_bindgen(js_name = toVolumeInSlices)]
    pub fn to_volume_in_slices(&self, dims: &[u32]) -> Result<RawSampling, JsValue> {
        let dims: [u32; 3] = dims.try_into().map_err(|_| Failure::invalid("dims", "must be 3 integers"))?;
        let begun = self.0.borrow().to_volume_in_slices(dims.map(|n| n as usize)).map_err(Failure::from)?;
        Ok(RawSampling(Box::pin(begun)))
    }

    /// Colours the vertices of the surface from the images of `cameras`.
    pub fn colorize(&self, cameras: RawCameras) -> Result<(), JsValue> {
        self.0.borrow_mut().colorize(&cameras.0).map_err(Failure::from)?;
        Ok(())
    }

    /// Begins what `colorize` does, in slices of work; the surface must not change meanwhile.
    #[wasm_bindgen(js_name = colorizeInSlices)]
    pub fn colorize_in_slices(&self, cameras: RawCameras) -> Result<RawColoring, JsValue> {
        let begun = self.0.borrow().begin_coloring(&cameras.0).map_err(Failure::from)?;
        Ok(RawColoring(Box::pin(begun)))
    }

    /// Returns further results: the edge of an extraction cell in world units, the mean spacing of the surface
    /// constraints in units of the normalised box, the numbers of duplicate points, outliers and spurious components, what
    /// was chosen from the points, and a warning about the parameters if there is one.
    pub fn statistics(&self) -> Result<JsValue, JsValue> {
        let surface = self.0.borrow();
        Ok(to_js(&Statistics {
            cell: surface.cell(),
            spacing: surface.spacing(),
            duplicates: surface.duplicates(),
            outliers: surface.outliers(),
            spurious_components: surface.spurious_components(),
            choice: surface.choice(),
            warning: surface.params().warning(),
        })?)
    }
}

impl RawImplicit {
    fn relative(&self, positions: &JsValue) -> Result<Vec<Vec3>, Failure> {
        relative(positions, self.0.borrow().origin())
    }

    fn in_world(&self, positions: &[Vec3]) -> JsValue {
        in_world(positions, self.0.borrow().origin())
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Statistics {
    cell: f64,
    spacing: f64,
    duplicates: usize,
    outliers: usize,
    spurious_components: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    choice: Option<Choice>,
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<&'static str>,
}

/// Colours of a surface that are being computed.
#[wasm_bindgen]
pub struct RawColoring(Computation<VertexColors>);

#[wasm_bindgen]
impl RawColoring {
    /// Does a slice of the work; at the end, colours `surface`, with which it was begun, and returns true, after which this
    /// must not be called any more.
    pub fn advance(&mut self, surface: &RawImplicit) -> Result<bool, JsValue> {
        let Poll::Ready(colors) = advance(&mut self.0) else { return Ok(false) };
        surface.0.borrow_mut().take_colors(colors).map_err(Failure::from)?;
        Ok(true)
    }
}

/// A volume that is being sampled.
#[wasm_bindgen]
pub struct RawSampling(Computation<Result<Volume, MethodError>>);

#[wasm_bindgen]
impl RawSampling {
    /// Does a slice of the work; returns the volume at the end, after which this must not be called any more.
    pub fn advance(&mut self) -> Result<Option<RawVolume>, JsValue> {
        match advance(&mut self.0) {
            Poll::Pending => Ok(None),
            Poll::Ready(volume) => Ok(Some(RawVolume(volume.map_err(Failure::from)?))),
        }
    }
}
