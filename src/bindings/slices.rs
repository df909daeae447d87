//! Bindings of long operations on meshes in slices of work.

use std::rc::Rc;
use std::task::Poll;

use js_sys::{Array, Uint8Array};
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{point, to_js, world_points};
use super::error::Failure;
use super::mesh::{MeshKind, RawMesh, Report, distances, edge_bounds, editable_copy, passes_of, read_only};
use super::volume::RawVolume;
use super::voxelise::kind_of;
use vesicle::mesh::{Mesh, report_in_slices};
use vesicle::pauses::{Computation, Pauses, advance};
use vesicle::remesh::{
    Plane, Smoothing, cut_by_plane_in_slices, decimate_in_slices, decimate_within_in_slices,
    passes_in_slices, remesh_in_slices, smooth_in_slices,
};
use vesicle::spatial::{contains_in_slices, outer_components_in_slices, surface_distance_in_slices};
use vesicle::voxelise::voxelise_in_slices;

/// The results of an operation: the changed mesh, if it is changed, and the value that is returned.
struct Done {
    mesh: Option<MeshKind>,
    value: JsValue,
}

/// An operation on a mesh that is under way, on a copy.
#[wasm_bindgen]
pub struct RawMeshWork(Computation<Result<Done, Failure>>);

#[wasm_bindgen]
impl RawMeshWork {
    /// Does a slice of the work; at the end, changes `mesh`, with which it was begun, and returns an array with the value of
    /// the operation, after which this must not be called any more.
    pub fn advance(&mut self, mesh: &mut RawMesh) -> Result<Option<Array>, JsValue> {
        let Poll::Ready(done) = advance(&mut self.0) else { return Ok(None) };
        let Done { mesh: changed, value } = done?;
        if let Some(changed) = changed {
            mesh.0 = changed;
        }
        Ok(Some(Array::of(&[value])))
    }
}

impl RawMesh {
    /// Begins to change the mesh by `edit`, which returns the value of the operation.
    fn change(
        &self,
        edit: impl AsyncFnOnce(&mut Mesh, &Pauses) -> Result<JsValue, Failure> + 'static,
    ) -> Result<RawMeshWork, JsValue> {
        let copy = self.copy_to_edit()?;
        Ok(RawMeshWork(Box::pin(async move {
            let (mut mesh, pauses) = (copy.into_mesh()?, Pauses::default());
            pauses.now().await;
            let value = edit(&mut mesh, &pauses).await?;
            Ok(Done { mesh: Some(MeshKind::Surface(mesh)), value })
        })))
    }

    fn copy_to_edit(&self) -> Result<Copy, Failure> {
        match &self.0 {
            MeshKind::Surface(mesh) => Ok(Copy::Surface(mesh.clone())),
            MeshKind::Triangles(mesh, versions) => Ok(Copy::Triangles(Rc::clone(mesh), *versions)),
            MeshKind::Live(_) => Err(read_only()),
        }
    }

    /// Begins to decimate the mesh by `edit`, unless it is as small as that already.
    fn decimate_by(
        &self,
        target_triangles: f64,
        edit: impl AsyncFnOnce(&mut Mesh, usize, &Pauses) -> Result<(), Failure> + 'static,
    ) -> Result<RawMeshWork, JsValue> {
        // As by `larger_than`.
        let target = target_triangles as usize;
        if let MeshKind::Triangles(mesh, _) = &self.0
            && mesh.triangles.len() <= target
        {
            Mesh::from_triangles(mesh).map_err(Failure::from)?;
            return Ok(RawMeshWork(Box::pin(async { Ok(Done { mesh: None, value: JsValue::UNDEFINED }) })));
        }
        self.change(async move |mesh, pauses| {
            edit(mesh, target, pauses).await?;
            Ok(JsValue::UNDEFINED)
        })
    }
}

/// A copy of a mesh, which becomes an editable one.
enum Copy {
    Surface(Box<Mesh>),
    Triangles(Rc<vesicle::mesh::TriangleMesh>, [u32; 2]),
}

impl Copy {
    fn into_mesh(self) -> Result<Box<Mesh>, Failure> {
        match self {
            Self::Surface(mesh) => Ok(mesh),
            Self::Triangles(mesh, versions) => Ok(Box::new(editable_copy(&mesh, versions)?)),
        }
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Begins what `remesh` does.
    #[wasm_bindgen(js_name = remeshInSlices)]
    pub fn remesh_in_slices(&self, min: f64, max: f64) -> Result<RawMeshWork, JsValue> {
        let bounds = edge_bounds(min, max);
        self.change(async move |mesh, pauses| {
            remesh_in_slices(mesh, bounds, pauses).await?;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Begins what `restructure` does; the value is the number of edits.
    #[wasm_bindgen(js_name = restructureInSlices)]
    pub fn restructure_in_slices(&self, min: f64, max: f64, passes: &[u8]) -> Result<RawMeshWork, JsValue> {
        let (bounds, passes) = (edge_bounds(min, max), passes_of(passes));
        self.change(async move |mesh, pauses| {
            let changes = passes_in_slices(mesh, bounds, &passes, pauses).await?;
            Ok((changes.creations + changes.deletions + changes.inversions).into())
        })
    }

    /// Begins what `decimate` does.
    #[wasm_bindgen(js_name = decimateInSlices)]
    pub fn decimate_in_slices(&self, target_triangles: f64) -> Result<RawMeshWork, JsValue> {
        self.decimate_by(target_triangles, async |mesh, target, pauses| {
            decimate_in_slices(mesh, target, pauses).await;
            Ok(())
        })
    }

    /// Begins what `decimateWithin` does.
    #[wasm_bindgen(js_name = decimateWithinInSlices)]
    pub fn decimate_within_in_slices(
        &self,
        target_triangles: f64,
        max_distance: f64,
    ) -> Result<RawMeshWork, JsValue> {
        self.decimate_by(target_triangles, async move |mesh, target, pauses| {
            decimate_within_in_slices(mesh, target, max_distance, pauses).await?;
            Ok(())
        })
    }

    /// Begins what `smooth` does.
    #[wasm_bindgen(js_name = smoothInSlices)]
    pub fn smooth_in_slices(&self, iterations: usize, keep_volume: bool) -> Result<RawMeshWork, JsValue> {
        let smoothing = Smoothing { iterations, keeps_volume: keep_volume };
        self.change(async move |mesh, pauses| {
            smooth_in_slices(mesh, smoothing, pauses).await?;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Begins what `cut` does.
    #[wasm_bindgen(js_name = cutInSlices)]
    pub fn cut_in_slices(&self, origin: &[f64], normal: &[f64]) -> Result<RawMeshWork, JsValue> {
        let (origin, normal) = (point(origin)?, point(normal)?);
        self.change(async move |mesh, pauses| {
            let plane = Plane { origin: origin - mesh.origin(), normal };
            cut_by_plane_in_slices(mesh, plane, pauses).await?;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Begins what `removeCavities` does.
    #[wasm_bindgen(js_name = removeCavitiesInSlices)]
    pub fn remove_cavities_in_slices(&self) -> Result<RawMeshWork, JsValue> {
        let (mesh, versions) = self.to_be_replaced()?;
        Ok(RawMeshWork(Box::pin(async move {
            let outer = outer_components_in_slices(&mesh, &Pauses::default()).await?;
            let kept = Rc::new(mesh.with_components(&outer)?);
            Ok(Done { mesh: Some(MeshKind::Triangles(kept, versions)), value: JsValue::UNDEFINED })
        })))
    }

    /// Begins what `contains` does, of the present surface.
    #[wasm_bindgen(js_name = containsInSlices)]
    pub fn contains_in_slices(&self, at: &JsValue) -> Result<RawMeshWork, JsValue> {
        let (mesh, points) = (self.triangles(), world_points(at)?);
        Ok(RawMeshWork(Box::pin(async move {
            let points = points.into_iter().map(|p| p - mesh.origin);
            let inside = contains_in_slices(&mesh, points, &Pauses::default()).await?;
            let inside: Vec<u8> = inside.into_iter().map(u8::from).collect();
            Ok(Done { mesh: None, value: Uint8Array::from(&inside[..]).into() })
        })))
    }

    /// Begins what `toVolume` does, of the present surface; the value is the `RawVolume`.
    #[wasm_bindgen(js_name = toVolumeInSlices)]
    pub fn to_volume_in_slices(
        &self,
        like: &RawVolume,
        kind: &str,
        value: u32,
    ) -> Result<RawMeshWork, JsValue> {
        let (mesh, like, kind) = (self.triangles(), like.0.clone(), kind_of(kind, value)?);
        Ok(RawMeshWork(Box::pin(async move {
            let volume = voxelise_in_slices(&mesh, &like, kind, &Pauses::default()).await?;
            Ok(Done { mesh: None, value: RawVolume(volume).into() })
        })))
    }

    /// Begins what `check` does, of the present surface; the value is a `MeshReport`.
    #[wasm_bindgen(js_name = checkInSlices)]
    pub fn check_in_slices(&self) -> RawMeshWork {
        let mesh = self.triangles();
        RawMeshWork(Box::pin(async move {
            let report = report_in_slices(&mesh, &Pauses::default()).await?;
            Ok(Done { mesh: None, value: to_js(&Report::from(report))? })
        }))
    }

    /// Begins what `distanceTo` does, between the two surfaces as they are now; the value is a `SurfaceDistance`.
    #[wasm_bindgen(js_name = distanceToInSlices)]
    pub fn distance_to_in_slices(&self, other: &RawMesh) -> RawMeshWork {
        let (mesh, other) = (self.triangles(), other.triangles());
        RawMeshWork(Box::pin(async move {
            let found = surface_distance_in_slices(&mesh, &other, &Pauses::default()).await?;
            Ok(Done { mesh: None, value: distances(&found)? })
        }))
    }
}
