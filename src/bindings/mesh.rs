//! Bindings of meshes: editable closed meshes, plain triangle lists, and the live surfaces of models.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::{Float32Array, Reflect, Uint32Array};
use serde::Serialize;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::convert::{
    coordinates, corner_coordinates, flat, packed, point, points, to_js, triangles, world_points,
    write_options,
};
use super::error::Failure;
use super::texture::RawTexture;
use super::volume::RawVolume;
use vesicle::io::{MeshFormat, write_mesh_with};
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{
    Measures, Mesh, MeshReport, TriangleMesh, WorldPositions, curvature, geodesic_distances, measure, report,
    world_origin,
};
use vesicle::methods::LiveSurface;
use vesicle::remesh::{EdgeBounds, RestructurePass, decimate, remesh, restructure_in_passes};
use vesicle::spatial::{SurfaceDistance, SurfacePoint, TriangleTree, cross_section, surface_distance};
use vesicle::volume::marching_cubes_bounded;

/// The content of a JavaScript `Mesh`.
pub(super) enum MeshKind {
    /// A closed mesh that can be edited.
    Surface(Box<Mesh>),
    /// A list of triangles as given, which may be open or intersect itself, and its topology and geometry version.
    Triangles(Rc<TriangleMesh>, [u32; 2]),
    /// The live surface of a model.
    Live(Rc<RefCell<dyn LiveSurface>>),
}

/// The raw handle of the TypeScript class `Mesh`: an editable mesh, a list of triangles, or the live surface of a
/// model.
#[wasm_bindgen]
pub struct RawMesh(pub(super) MeshKind);

/// Arrays and texture of a mesh, besides positions and triangles.
#[wasm_bindgen]
pub struct RawExtra(TriangleMesh);

#[wasm_bindgen]
impl RawExtra {
    /// Copies what is given: normal, texture coordinates and colour of each vertex, texture coordinates of the three
    /// corners of each triangle, and a texture.
    #[wasm_bindgen(constructor)]
    pub fn new(
        normals: Option<Float32Array>,
        uvs: Option<Float32Array>,
        corner_uvs: Option<Float32Array>,
        colors: Option<Float32Array>,
        texture: Option<RawTexture>,
    ) -> Result<RawExtra, JsValue> {
        Ok(RawExtra(TriangleMesh {
            normals: normals.as_ref().map(points).transpose()?,
            uvs: uvs.as_ref().map(coordinates).transpose()?,
            corner_uvs: corner_uvs.as_ref().map(corner_coordinates).transpose()?,
            colors: colors.as_ref().map(points).transpose()?,
            texture: texture.map(|texture| texture.0),
            ..TriangleMesh::default()
        }))
    }
}

/// A snapshot of a mesh's arrays, from which each can be copied to JavaScript.
#[wasm_bindgen]
pub struct RawArrays(Rc<TriangleMesh>);

impl RawMesh {
    /// Returns the live surface of a model.
    pub(super) fn live(model: &Rc<RefCell<impl LiveSurface + 'static>>) -> Self {
        let model: Rc<RefCell<dyn LiveSurface>> = Rc::clone(model) as _;
        Self(MeshKind::Live(model))
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Creates a sphere of nearly equilateral triangles with edges of at most `max_edge`, in world units.
    pub fn icosphere(center: &[f64], radius: f64, max_edge: f64) -> Result<RawMesh, JsValue> {
        let center = point(center)?;
        let origin = world_origin(center - radius, center + radius);
        let mesh = Mesh::icosphere((center - origin).as_vec3(), radius as f32, max_edge as f32);
        Ok(RawMesh(MeshKind::Surface(Box::new(mesh.map_err(Failure::from)?.with_origin(origin)))))
    }

    /// Creates a triangle list from copies of arrays: x, y and z of each vertex in turn, in single or double precision, three
    /// vertex indices per triangle, and what else is given.
    #[wasm_bindgen(js_name = fromArrays)]
    pub fn from_arrays(
        positions: &JsValue,
        indices: &Uint32Array,
        extra: RawExtra,
    ) -> Result<RawMesh, JsValue> {
        let triangles = triangles(indices)?;
        let world = world_points(positions)?.into_iter().collect::<WorldPositions>();
        let (positions, origin) = world.relative_in(&triangles).map_err(Failure::from)?;
        let mesh = TriangleMesh { positions, origin, triangles, ..extra.0 };
        Ok(RawMesh(triangle_list(mesh)))
    }

    /// Returns the iso-surface of one frame of a volume at intensity `iso`, in world space, as a list of triangles: about
    /// `most` at most.
    #[wasm_bindgen(js_name = marchingCubes)]
    pub fn marching_cubes(
        volume: &RawVolume,
        iso: f64,
        frame: usize,
        most: Option<usize>,
    ) -> Result<RawMesh, JsValue> {
        let most = most.unwrap_or(usize::MAX);
        let mesh = marching_cubes_bounded(&volume.0, iso, frame, most).map_err(Failure::from)?;
        Ok(RawMesh(triangle_list(mesh)))
    }

    /// Returns the number of vertices of the mesh.
    #[wasm_bindgen(js_name = vertexCount)]
    pub fn vertex_count(&self) -> usize {
        match &self.0 {
            MeshKind::Surface(mesh) => mesh.vertex_count(),
            MeshKind::Triangles(mesh, _) => mesh.positions.len(),
            MeshKind::Live(model) => model.borrow().counts()[0],
        }
    }

    /// Returns the number of triangles of the mesh.
    #[wasm_bindgen(js_name = triangleCount)]
    pub fn triangle_count(&self) -> usize {
        match &self.0 {
            MeshKind::Surface(mesh) => mesh.triangle_count(),
            MeshKind::Triangles(mesh, _) => mesh.triangles.len(),
            MeshKind::Live(model) => model.borrow().counts()[1],
        }
    }

    /// Returns a counter that increases when connectivity changes, so that copies can be recognised as out of date.
    #[wasm_bindgen(js_name = topologyVersion)]
    pub fn topology_version(&self) -> u32 {
        match &self.0 {
            MeshKind::Surface(mesh) => mesh.topology_version(),
            MeshKind::Triangles(_, versions) => versions[0],
            MeshKind::Live(model) => model.borrow().versions()[0],
        }
    }

    /// Returns a counter that increases when any vertex moves or connectivity changes, so that copies can be recognised
    /// as out of date.
    #[wasm_bindgen(js_name = geometryVersion)]
    pub fn geometry_version(&self) -> u32 {
        match &self.0 {
            MeshKind::Surface(mesh) => mesh.geometry_version(),
            MeshKind::Triangles(_, versions) => versions[1],
            MeshKind::Live(model) => model.borrow().versions()[1],
        }
    }

    /// Returns the origin in world space that the positions of the mesh are relative to.
    pub fn origin(&self) -> Vec<f64> {
        let origin = match &self.0 {
            MeshKind::Surface(mesh) => mesh.origin(),
            MeshKind::Triangles(mesh, _) => mesh.origin,
            MeshKind::Live(model) => model.borrow().origin(),
        };
        origin.to_array().to_vec()
    }

    /// Returns a snapshot of positions, relative to the origin of the mesh or in world space, triangles, vertex normals and
    /// other attributes of the mesh. A vertex on a texture seam, which has several texture coordinates, has only one of
    /// them.
    pub fn arrays(&self, is_relative: bool) -> Result<RawArrays, JsValue> {
        let mut mesh = self.with_normals();
        if mesh.corner_uvs.is_some() {
            let uvs = mesh.uvs_ignoring_seams();
            Rc::make_mut(&mut mesh).uvs = uvs;
        }
        if !is_relative && mesh.origin != DVec3::ZERO {
            let positions = mesh.world_positions().map_err(Failure::from)?;
            let mesh = Rc::make_mut(&mut mesh);
            (mesh.positions, mesh.origin) = (positions, DVec3::ZERO);
        }
        Ok(RawArrays(mesh))
    }

    /// Returns the measures of the mesh, such as area, enclosed volume and edge lengths, as a `MeshInfo`.
    pub fn info(&self) -> Result<JsValue, JsValue> {
        Ok(to_js(&Info::from(measure(&self.triangles())))?)
    }

    /// Checks the triangles of the mesh, independently of the code that edits it: whether it is closed and oriented,
    /// and the numbers of defects and self-intersections, as a `MeshReport`.
    pub fn check(&self) -> Result<JsValue, JsValue> {
        let report = report(&self.triangles()).map_err(Failure::from)?;
        Ok(to_js(&Report::from(report))?)
    }

    /// Returns the texture, if the mesh has one; an editable mesh has none.
    pub fn texture(&self) -> Option<RawTexture> {
        let texture = match &self.0 {
            // Editable meshes have no texture.
            MeshKind::Surface(_) => None,
            MeshKind::Triangles(..) | MeshKind::Live(_) => self.triangles().texture.clone(),
        };
        texture.map(RawTexture)
    }

    /// Returns the mesh with vertices duplicated along the seams of the texture; see [`TriangleMesh::split_at_seams`].
    #[wasm_bindgen(js_name = splitAtSeams)]
    pub fn split_at_seams(&self) -> RawMesh {
        RawMesh(triangle_list(self.triangles().split_at_seams()))
    }

    /// Returns one mesh per connected component.
    pub fn components(&self) -> Vec<RawMesh> {
        self.triangles().components().into_iter().map(|part| RawMesh(triangle_list(part))).collect()
    }

    /// Refines the mesh by one √3-subdivision pass, which replaces each triangle by three.
    pub fn refine(&mut self) -> Result<(), JsValue> {
        self.editable()?.refine().map_err(Failure::from)?;
        Ok(())
    }

    /// Runs passes of restructuring in the given order: collapses of edges shorter than `min` (0), splits of edges
    /// longer than `max` (1), flips (2); both bounds are in world units. Returns the number of edits; see
    /// [`restructure_in_passes`].
    pub fn restructure(&mut self, min: f64, max: f64, passes: &[u8]) -> Result<u32, JsValue> {
        let (bounds, passes) = (edge_bounds(min, max), passes_of(passes));
        let changes = restructure_in_passes(self.editable()?, bounds, &passes).map_err(Failure::from)?;
        Ok(changes.creations + changes.deletions + changes.inversions)
    }

    /// Decimates the mesh by quadric error to at most `target_triangles`, or more if too few edges can be collapsed
    /// safely; see [`decimate`].
    pub fn decimate(&mut self, target_triangles: f64) -> Result<(), JsValue> {
        if let Some((mesh, target)) = self.larger_than(target_triangles)? {
            decimate(mesh, target);
        }
        Ok(())
    }

    /// Remeshes to edge lengths in `min..=max`, in world units; see [`remesh`].
    pub fn remesh(&mut self, min: f64, max: f64) -> Result<(), JsValue> {
        remesh(self.editable()?, edge_bounds(min, max)).map_err(Failure::from)?;
        Ok(())
    }

    /// Returns the mean curvature at each vertex, an inverse length; positive where the surface is convex.
    #[wasm_bindgen(js_name = meanCurvature)]
    pub fn mean_curvature(&self) -> Vec<f32> {
        to_f32(&curvature(&self.triangles()).mean)
    }

    /// Returns the Gaussian curvature at each vertex, an inverse area: positive on a ball, negative on a saddle.
    #[wasm_bindgen(js_name = gaussianCurvature)]
    pub fn gaussian_curvature(&self) -> Vec<f32> {
        to_f32(&curvature(&self.triangles()).gaussian)
    }

    /// Returns the geodesic distance, measured along the surface, of each vertex from vertex `from_vertex`, in world
    /// units; infinite for vertices that are not connected to it.
    pub fn geodesic(&self, from_vertex: u32) -> Result<Vec<f32>, JsValue> {
        Ok(to_f32(&geodesic_distances(&self.triangles(), from_vertex).map_err(Failure::from)?))
    }

    /// Returns the distances between this mesh and the surface `other`, per vertex and in summary, as a
    /// `SurfaceDistance`.
    #[wasm_bindgen(js_name = distanceTo)]
    pub fn distance_to(&self, other: &RawMesh) -> Result<JsValue, JsValue> {
        let found = surface_distance(&self.triangles(), &other.triangles()).map_err(Failure::from)?;
        Ok(distances(&found)?)
    }

    /// Returns the first intersection of a ray with the mesh as a `MeshHit`; undefined if there is none.
    pub fn pick(&self, origin: &[f64], direction: &[f64]) -> Result<JsValue, JsValue> {
        let mesh = self.triangles();
        let tree = TriangleTree::new(&mesh).map_err(Failure::from)?;
        let hit = tree.ray_hit((point(origin)? - mesh.origin).as_vec3(), direction_of(direction)?);
        Ok(to_js(&hit.map(|hit| Hit::new(hit, mesh.origin)))?)
    }

    /// Returns the line segments in which the plane through `origin` with the given normal cuts the surface: six
    /// numbers each, x, y and z of both ends, relative to the origin of the mesh or in world space.
    #[wasm_bindgen(js_name = crossSection)]
    pub fn cross_section(
        &self,
        origin: &[f64],
        normal: &[f64],
        is_relative: bool,
    ) -> Result<Vec<f32>, JsValue> {
        let mesh = self.triangles();
        if !is_relative {
            mesh.world_positions().map_err(Failure::from)?;
        }
        let (start, normal) = ((point(origin)? - mesh.origin).as_vec3(), direction_of(normal)?);
        let mut segments = cross_section(&mesh, start, normal);
        if !is_relative && mesh.origin != DVec3::ZERO {
            let in_world = |p: &mut Vec3| *p = (p.as_dvec3() + mesh.origin).as_vec3();
            segments.as_flattened_mut().iter_mut().for_each(in_world);
        }
        Ok(packed(segments.as_flattened()))
    }

    /// Returns the mesh as the bytes of a file; `format` is glb, ply, stl, obj, vtp or mz3. If it `is_recentred`, positions
    /// are those relative to the origin of the mesh. Each line of `notes` for the reader of the file is `code: text`.
    /// `space` is that of the mesh, `written_as` that in the file, and `unit` the unit of positions, each empty if it is not
    /// to be stated.
    #[wasm_bindgen(js_name = toBytes)]
    pub fn to_bytes(
        &self,
        format: &str,
        is_recentred: bool,
        notes: &str,
        space: &str,
        written_as: &str,
        unit: &str,
    ) -> Result<Vec<u8>, JsValue> {
        let format = MeshFormat::from_extension(format)
            .ok_or_else(|| Failure::invalid("format", "must be one of glb, ply, stl, obj, vtp, mz3"))?;
        let mut mesh = self.with_normals();
        if is_recentred && mesh.origin != DVec3::ZERO {
            Rc::make_mut(&mut mesh).origin = DVec3::ZERO;
        }
        Ok(write_mesh_with(&mesh, format, &write_options(notes, [space, written_as, unit]))
            .map_err(Failure::from)?)
    }

    /// Returns an independent copy; that of a live mesh no longer changes with its model.
    #[wasm_bindgen(js_name = clone)]
    pub fn duplicate(&self) -> RawMesh {
        match &self.0 {
            MeshKind::Surface(mesh) => RawMesh(MeshKind::Surface(mesh.clone())),
            MeshKind::Triangles(mesh, versions) => RawMesh(MeshKind::Triangles(Rc::clone(mesh), *versions)),
            MeshKind::Live(_) => RawMesh(MeshKind::Triangles(self.triangles(), [0, 0])),
        }
    }

    /// Returns the triangles with vertex normals, which are computed if there are none.
    fn with_normals(&self) -> Rc<TriangleMesh> {
        let mut mesh = self.triangles();
        if mesh.normals.is_none() {
            let normals = mesh.vertex_normals();
            Rc::make_mut(&mut mesh).normals = Some(normals);
        }
        mesh
    }

    /// Returns the triangles of the mesh in its present state.
    pub(super) fn triangles(&self) -> Rc<TriangleMesh> {
        match &self.0 {
            MeshKind::Surface(mesh) => Rc::new(mesh.to_triangles()),
            MeshKind::Triangles(mesh, _) => Rc::clone(mesh),
            MeshKind::Live(model) => Rc::new(model.borrow().surface()),
        }
    }

    /// Returns the mesh, to be decimated, and the target as a whole number; `None` if the mesh has no more triangles than
    /// that: then nothing changes, but an open mesh is still rejected.
    pub(super) fn larger_than(
        &mut self,
        target_triangles: f64,
    ) -> Result<Option<(&mut Mesh, usize)>, Failure> {
        // Truncates a fraction, and saturates a count that no mesh can have.
        let target = target_triangles as usize;
        if let MeshKind::Triangles(mesh, _) = &self.0
            && mesh.triangles.len() <= target
        {
            Mesh::from_triangles(mesh)?;
            return Ok(None);
        }
        Ok(Some((self.editable()?, target)))
    }

    /// Returns the mesh for editing; a triangle list is replaced by an editable mesh first. An error if the list is not
    /// a closed, oriented, manifold mesh, or if the mesh is the live one of a model.
    pub(super) fn editable(&mut self) -> Result<&mut Mesh, Failure> {
        if let MeshKind::Triangles(triangles, versions) = &self.0 {
            self.0 = MeshKind::Surface(Box::new(editable_copy(triangles, *versions)?));
        }
        match &mut self.0 {
            MeshKind::Surface(mesh) => Ok(mesh),
            _ => Err(read_only()),
        }
    }
}

#[wasm_bindgen]
impl RawArrays {
    /// Returns the number of vertices of the snapshot.
    pub fn vertices(&self) -> usize {
        self.0.positions.len()
    }

    /// Returns the number of triangles of the snapshot.
    pub fn triangles(&self) -> usize {
        self.0.triangles.len()
    }

    /// Copies the positions of the vertices to the start of `out`, as packed xyz.
    pub fn positions(&self, out: &Float32Array) {
        copy_into(out, &packed(&self.0.positions));
    }

    /// Copies the normals of the vertices to the start of `out`, as packed xyz.
    pub fn normals(&self, out: &Float32Array) {
        copy_into(out, &packed(self.0.normals.as_deref().unwrap_or_default()));
    }

    /// Copies the triangles to the start of `out`, as three vertex indices each.
    pub fn indices(&self, out: &Uint32Array) {
        let indices = self.0.triangles.as_flattened();
        out.subarray(0, indices.len() as u32).copy_from(indices);
    }

    /// Returns the texture coordinates as u and v of each vertex in turn, if the mesh has any.
    pub fn uvs(&self) -> Option<Vec<f32>> {
        self.0.uvs.as_deref().map(flat)
    }

    /// Returns the colours as red, green and blue of each vertex in turn, in 0..1, if the mesh has any.
    pub fn colors(&self) -> Option<Vec<f32>> {
        self.0.colors.as_deref().map(packed)
    }
}

fn copy_into(out: &Float32Array, values: &[f32]) {
    out.subarray(0, values.len() as u32).copy_from(values);
}

pub(super) fn triangle_list(mesh: TriangleMesh) -> MeshKind {
    MeshKind::Triangles(Rc::new(mesh), [0, 0])
}

/// Returns an editable mesh with the triangles and versions of a list. An error if the list is not a closed, oriented,
/// manifold mesh.
pub(super) fn editable_copy(triangles: &TriangleMesh, versions: [u32; 2]) -> Result<Mesh, Failure> {
    let mut mesh = Mesh::from_triangles(triangles)?;
    mesh.set_versions(versions);
    Ok(mesh)
}

/// Returns bounds of edge lengths in single precision.
pub(super) fn edge_bounds(min: f64, max: f64) -> EdgeBounds {
    EdgeBounds { min: min as f32, max: max as f32 }
}

/// Returns the passes of restructuring for their codes: collapses (0), splits (1), flips (2).
pub(super) fn passes_of(codes: &[u8]) -> Vec<RestructurePass> {
    let pass = |code: &u8| match code {
        0 => RestructurePass::Collapse,
        1 => RestructurePass::Split,
        _ => RestructurePass::Flip,
    };
    codes.iter().map(pass).collect()
}

/// Returns distances as a `SurfaceDistance`.
pub(super) fn distances(found: &SurfaceDistance) -> Result<JsValue, Failure> {
    let summaries = to_js(&Summaries::from(found))?;
    let per_vertex = Float32Array::from(to_f32(&found.per_vertex).as_slice());
    // Setting a property of a new plain object cannot fail.
    Reflect::set(&summaries, &"perVertex".into(), &per_vertex).ok();
    Ok(summaries)
}

/// Returns the failure of an edit of a model's live mesh.
pub(super) fn read_only() -> Failure {
    Failure::invalid("mesh", "belongs to a model and is read-only: clone() it first")
}

fn to_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&value| value as f32).collect()
}

#[derive(Serialize)]
struct Summaries {
    mean: f64,
    rms: f64,
    p95: f64,
    hausdorff: f64,
}

impl From<&SurfaceDistance> for Summaries {
    fn from(found: &SurfaceDistance) -> Self {
        Self { mean: found.mean, rms: found.rms, p95: found.p95, hausdorff: found.hausdorff }
    }
}

#[derive(Serialize)]
struct Hit {
    triangle: u32,
    barycentric: [f32; 3],
    point: [f64; 3],
    distance: f64,
}

impl Hit {
    /// Converts a point on a mesh with the given origin.
    fn new(hit: SurfacePoint, origin: DVec3) -> Self {
        Self {
            triangle: hit.triangle,
            barycentric: hit.barycentric.to_array(),
            point: (hit.point.as_dvec3() + origin).to_array(),
            distance: hit.distance,
        }
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Report {
    closed: bool,
    oriented: bool,
    non_manifold_edges: usize,
    non_manifold_vertices: usize,
    degenerate_triangles: usize,
    self_intersections: usize,
    #[serde(skip_serializing_if = "is_false")]
    has_more: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

impl From<MeshReport> for Report {
    fn from(report: MeshReport) -> Self {
        Self {
            closed: report.closed,
            oriented: report.oriented,
            non_manifold_edges: report.non_manifold_edges,
            non_manifold_vertices: report.non_manifold_vertices,
            degenerate_triangles: report.degenerate_triangles,
            self_intersections: report.self_intersections,
            has_more: report.has_more,
        }
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Info {
    vertices: usize,
    triangles: usize,
    components: usize,
    euler: f64,
    genus: f64,
    area: f64,
    volume: f64,
    centroid: [f64; 3],
    inertia: [f64; 9],
    edge: EdgeLengths,
    min_angle_degrees: f64,
    bounds: Bounds,
}

#[derive(Serialize)]
struct EdgeLengths {
    min: f64,
    mean: f64,
    max: f64,
}

#[derive(Serialize)]
struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
}

impl From<Measures> for Info {
    fn from(measures: Measures) -> Self {
        let [min, max] = measures.bounds.map(|corner: DVec3| corner.to_array());
        Self {
            vertices: measures.vertices,
            triangles: measures.triangles,
            components: measures.components,
            euler: measures.euler as f64,
            genus: measures.genus as f64,
            area: measures.area,
            volume: measures.volume,
            centroid: measures.centroid.to_array(),
            inertia: measures.inertia,
            edge: EdgeLengths { min: measures.edge_min, mean: measures.edge_mean, max: measures.edge_max },
            min_angle_degrees: measures.min_angle_degrees,
            bounds: Bounds { min, max },
        }
    }
}

/// Returns the unit vector along a vector of any length, given as three numbers; 0 for a zero vector.
fn direction_of(values: &[f64]) -> Result<Vec3, Failure> {
    let given = point(values)?;
    let largest = given.abs().max_element();
    // Scaled first: squares of very long and very short vectors would overflow or underflow.
    Ok((given / largest).normalize_or_zero().as_vec3())
}

/// A copy of the triangles of a mesh, passed to the constructor of a model.
#[wasm_bindgen]
pub struct TriangleCopy(pub(super) TriangleMesh);

#[wasm_bindgen]
impl TriangleCopy {
    /// Copies the current triangles of `mesh`.
    #[wasm_bindgen(constructor)]
    pub fn new(mesh: &RawMesh) -> TriangleCopy {
        TriangleCopy((*mesh.triangles()).clone())
    }
}
