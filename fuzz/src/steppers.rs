//! Fuzz targets of the methods on small random scenes, with parameters that change during the run: valid after every
//! step.

use super::bytes::Choices;
use vesicle::math::{DAffine3, DVec3, Vec3};
use vesicle::mesh::{Mesh, TriangleMesh, count_self_intersections, measure, report};
use vesicle::methods::deformable::{
    Attractor, DeformableModel, DeformableOptions, DeformableParams, Integrator, RestLength, Seeding, Start,
};
use vesicle::methods::implicit::{
    Camera, Cloud, ImplicitOptions, ImplicitParams, ImplicitSurface, IsoValue, KernelKind, PointEdits, Sides,
};
use vesicle::methods::multires::{
    ControlEllipsoid, Energy, MultiresOptions, MultiresParams, MultiresolutionModel, Topology,
};
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, SurfaceTracker, TrackingLimits, TrackingOptions, TrackingParams,
};
use vesicle::methods::{Auto, MethodError, deformable};
use vesicle::volume::{Volume, VolumeError, VolumeInit, Voxels};

/// Asserts that a mesh is closed, oriented and manifold, has the predicted Euler characteristic, and has no
/// self-intersections.
fn assert_sound(mesh: &Mesh) {
    assert_eq!(mesh.check(), Ok(()));
    assert_eq!(count_self_intersections(&mesh.to_triangles()), 0, "triangles cross");
}

/// Returns a volume of blobs in noise, on a rotated grid with anisotropic voxels; some voxels may be NaN.
fn volume(bytes: &mut Choices, dims: [usize; 4]) -> Volume {
    let [nx, ny, nz, frames] = dims;
    let blobs: Vec<[DVec3; 2]> = (0..1 + bytes.below(3))
        .map(|_| {
            let mut corner = || {
                DVec3::new(
                    bytes.within(0.0, nx as f64),
                    bytes.within(0.0, ny as f64),
                    bytes.within(0.0, nz as f64),
                )
            };
            [corner(), corner()]
        })
        .collect();
    let (radius, noise, holes) = (bytes.within(0.5, 6.0), bytes.within(0.0, 1.0), bytes.chance(8));
    let spacing = DVec3::new(bytes.within(0.5, 2.0), bytes.within(0.5, 2.0), bytes.within(0.5, 2.0));
    let unit = bytes.one_of(&[1.0, 1.0, 100.0, 1e-6, 1e9]);
    let value = |i: usize| {
        let (at, t) = (i % (nx * ny * nz), (i / (nx * ny * nz)) as f64 / frames as f64);
        let p = DVec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64);
        let nearest =
            blobs.iter().map(|[from, to]| p.distance(*from + (*to - *from) * t)).fold(f64::MAX, f64::min);
        let bright = (0.5 + 0.25 * (radius - nearest)).clamp(0.0, 1.0);
        let value = if holes && bytes.chance(40) { f64::NAN } else { bright + noise * bytes.unit() };
        (unit * value) as f32
    };
    let values = (0..nx * ny * nz * frames).map(value).collect();
    let affine = DAffine3::from_rotation_z(bytes.within(-3.0, 3.0)) * DAffine3::from_scale(spacing);
    let init = VolumeInit { affine, ..VolumeInit::new(Voxels::F32(values), dims) };
    Volume::new(init).unwrap_or_else(|_| flat())
}

/// Returns a constant volume, used if the random one is rejected, as without finite voxels.
fn flat() -> Volume {
    let voxels = Voxels::U8(vec![1; 27]);
    let affine = DAffine3::IDENTITY;
    let init = VolumeInit { affine, ..VolumeInit::new(voxels, [3, 3, 3, 1]) };
    Volume::new(init).unwrap()
}

/// Steps a deformable model with random volume, start and parameters, and checks its mesh after each step.
pub fn deformable(data: &[u8]) {
    let bytes = &mut Choices::new(data);
    let dims = [2 + bytes.below(11), 2 + bytes.below(11), 1 + bytes.below(11), 1 + bytes.below(2)];
    let volume = volume(bytes, dims);
    let options = DeformableOptions {
        frame: bytes.below(2),
        start: start(bytes, &volume),
        levels: bytes.below(3),
        edge: bytes.chance(2).then(|| bytes.within(0.8, 4.0)),
        params: Some(deformable_params(bytes, &volume)),
        max_vertices: bytes.chance(4).then(|| 20 + bytes.below(1000)),
    };
    let Ok(mut model) = DeformableModel::new(&volume, options) else { return };
    for _ in 0..8 {
        match model.step() {
            Ok(report) => assert_eq!(i64::from(report.euler), model.mesh().euler()),
            Err(
                MethodError::TooManyVertices { .. }
                | MethodError::Volume(VolumeError::TooManyTriangles { .. }),
            ) => {}
            Err(error) => panic!("{error}"),
        }
        assert_sound(model.mesh());
        assert_eq!(count_self_intersections(&model.surface()), 0, "triangles cross in world space");
        match bytes.below(16) {
            3 => assert_covers(&model),
            4 => _ = model.seed(),
            0 => _ = model.set_params(deformable_params(bytes, &volume)),
            1 => _ = model.set_attractors(vec![attractor(bytes)]),
            2 => restored(&mut model),
            _ => {}
        }
    }
}

/// Asserts that recall and precision of the coverage are fractions, and that uncovered regions have a finite position
/// and a positive area.
fn assert_covers(model: &DeformableModel) {
    let Ok(coverage) = model.coverage() else { return };
    assert!([coverage.recall, coverage.precision].iter().all(|share| (0.0..=1.0 + 1e-9).contains(share)));
    assert!(coverage.uncovered.iter().all(|part| part.position.is_finite() && part.area > 0.0));
}

/// Restores the model from its own saved state, and asserts that saving it again gives the same bytes.
fn restored(model: &mut DeformableModel) {
    let saved = model.save();
    model.restore(&saved).unwrap_or_else(|error| panic!("its own state: {error}"));
    assert!(model.save() == saved, "another state comes out");
}

/// Returns a random start surface.
fn start(bytes: &mut Choices, volume: &Volume) -> Start {
    match bytes.below(9) {
        6.. => Start::Contour,
        0 => Start::Bubbles(1 + bytes.below(4) as u32),
        1 => Start::MarchingCubes(bytes.within(volume.range()[0], volume.range()[1])),
        2 => Start::Seeds {
            points: (0..1 + bytes.below(3)).map(|_| bytes.point(12.0)).collect(),
            radius: bytes.within(0.3, 9.0),
        },
        3 => Start::Mesh(shape(bytes)),
        _ => Start::Enclosing,
    }
}

fn attractor(bytes: &mut Choices) -> Attractor {
    Attractor { point: bytes.point(15.0), strength: bytes.within(-2.0, 2.0), radius: bytes.within(0.1, 20.0) }
}

fn deformable_params(bytes: &mut Choices, volume: &Volume) -> DeformableParams {
    let [low, high] = volume.range();
    let mut rarely = |low: f64, high: f64| if bytes.chance(3) { bytes.within(low, high) } else { 0.0 };
    let [gradient_normal, gradient_tangent, stiffness] =
        [rarely(-2.0, 2.0), rarely(-2.0, 2.0), rarely(0.0, 0.3)];
    DeformableParams {
        iso: bytes.within(low, high),
        iso_force: if bytes.chance(3) { bytes.within(-10.0, 10.0) } else { -1.0 },
        gradient_normal,
        gradient_tangent,
        rigidity: bytes.within(0.0, 0.4),
        stiffness,
        rest_length: bytes.one_of(&[RestLength::Zero, RestLength::Mean, RestLength::Given(1.0)]),
        damping: bytes.within(0.1, 1.0),
        max_move: bytes.within(0.05, 0.5),
        integrator: bytes.one_of(&[Integrator::Implicit, Integrator::Euler, Integrator::RungeKutta]),
        adaptivity: bytes.one_of(&[0.0, 0.5, 1.0, 1.0]),
        seeding: bytes.one_of(&[Seeding::Auto, Seeding::On, Seeding::Off]),
        smallest_part: bytes.one_of(&[0.0, 1.0, 8.0, 64.0]),
        topology: bytes.one_of(&[
            deformable::Topology::Adaptive,
            deformable::Topology::Adaptive,
            deformable::Topology::Fixed,
        ]),
        ..DeformableParams::default()
    }
}

/// Runs an implicit surface of random points to the end, with random edits and parameters, and checks its mesh.
pub fn implicit(data: &[u8]) {
    let bytes = &mut Choices::new(data);
    let cloud = cloud(bytes);
    let (count, size) = (cloud.points.len(), size(&cloud.points));
    let options = implicit_options(bytes, size);
    let Ok(mut surface) = ImplicitSurface::new(cloud, options) else { return };
    let mut changes = bytes.below(4);
    for _ in 0..5000 {
        let done = match surface.step() {
            Ok(report) => report.done,
            Err(MethodError::Singular { .. } | MethodError::InvalidArgument { .. }) => true,
            Err(error) => panic!("{error}"),
        };
        if done {
            assert_healthy(surface.surface());
            if changes == 0 || implicit_change(&mut surface, bytes, count, size).is_err() {
                return;
            }
            changes -= 1;
        }
    }
    panic!("no end");
}

/// Asserts that a mesh is empty or valid, with finite normals.
fn assert_healthy(mesh: &TriangleMesh) {
    assert!(mesh.triangles.is_empty() || report(mesh).unwrap().is_healthy());
    assert!(mesh.normals.iter().flatten().all(|n| n.is_finite()));
}

/// Makes one random change of an implicit surface: of its parameters, of its points, or a restoration of its own saved
/// state.
fn implicit_change(
    surface: &mut ImplicitSurface,
    bytes: &mut Choices,
    count: usize,
    size: f64,
) -> Result<(), MethodError> {
    match bytes.below(3) {
        0 => surface.set_params(implicit_params(bytes, size)),
        1 => {
            let saved = surface.save();
            surface.restore(&saved).unwrap_or_else(|error| panic!("its own state: {error}"));
            assert!(surface.save() == saved, "another state comes out");
            Ok(())
        }
        _ => {
            let mut places = |most| (0..bytes.below(most)).map(|_| bytes.point(2.0).as_vec3()).collect();
            let (added, exterior) = (places(6), places(3));
            let removed = (0..bytes.below(4)).map(|_| bytes.below(count + 1) as u32).collect();
            surface.set_edits(PointEdits { added, removed, exterior })
        }
    }
}

/// Returns the largest distance of a point from the first one, by which cells are scaled.
fn size(points: &[Vec3]) -> f64 {
    points.iter().map(|p| p.as_dvec3().distance(points[0].as_dvec3())).fold(0.0, f64::max)
}

/// Returns points on a sphere, in a plane, on a line or anywhere; some coincide, and their scale may be large, small or
/// far from the origin.
fn cloud(bytes: &mut Choices) -> Cloud {
    let (count, kind) = (1 + bytes.below(24), bytes.below(5));
    let (scale, away) = bytes.one_of(&[(1.0, 0.0), (1.0, 0.0), (300.0, 3000.0), (1e-20, 0.0), (1e20, 0.0)]);
    let point = |_| {
        let p = match kind {
            0 | 1 => bytes.direction(),
            2 => bytes.point(1.0),
            3 => bytes.point(1.0) * DVec3::new(1.0, 1.0, 0.0),
            _ => bytes.point(1.0) * DVec3::X,
        };
        (p * scale + away).as_vec3()
    };
    let points: Vec<Vec3> = (0..count).map(point).collect();
    let normals = bytes.chance(3).then(|| points.iter().map(|p| p.normalize_or_zero()).collect());
    let confidence = bytes.chance(4).then(|| (0..count).map(|_| bytes.within(-0.1, 1.1) as f32).collect());
    let colors = bytes.chance(4).then(|| vec![Vec3::splat(0.5); count]);
    Cloud { points, normals, confidence, colors, ..Cloud::default() }
}

fn camera(bytes: &mut Choices) -> Option<Camera> {
    let rows: [f64; 12] = std::array::from_fn(|i| {
        [100.0, 32.0, 0.0, 160.0, 0.0, 32.0, 100.0, 160.0, 0.0, 1.0, 0.0, 5.0][i] + bytes.within(-3.0, 3.0)
    });
    let image = bytes.chance(2).then(|| vec![200; 16 * 16 * 4]);
    Camera::new(rows, 16, 16, image).ok()
}

fn implicit_options(bytes: &mut Choices, size: f64) -> ImplicitOptions {
    ImplicitOptions {
        exterior: bytes.chance(4).then(|| (0..bytes.below(8)).map(|_| bytes.point(3.0).as_vec3()).collect()),
        cameras: (0..bytes.one_of(&[0, 0, 0, 1, 2])).filter_map(|_| camera(bytes)).collect(),
        max_points: bytes.one_of(&[20_000, 20_000, 4, 10]),
        keep_components: bytes.chance(4).then(|| 1 + bytes.below(3)),
        max_vertices: None,
        params: implicit_params(bytes, size),
    }
}

/// Returns random parameters with coarse cells, so that a run takes milliseconds.
fn implicit_params(bytes: &mut Choices, size: f64) -> ImplicitParams {
    ImplicitParams {
        delta: bytes.one_of(&[
            Auto::Given(0.1),
            Auto::Given(1.0),
            Auto::Given(5.0),
            Auto::Given(20.0),
            Auto::Given(100.0),
            Auto::Auto,
        ]),
        tau: bytes.one_of(&[0.001, 0.01, 0.025, 0.1, 1.0]),
        sigma: bytes.one_of(&[0.005, 0.07, 0.3, 1.0]),
        lambda_surface: bytes.one_of(&[
            Auto::Given(0.0),
            Auto::Given(0.001),
            Auto::Given(0.01),
            Auto::Given(10.0),
            Auto::Auto,
        ]),
        lambda_exterior: bytes.one_of(&[Auto::Given(0.0), Auto::Given(2.0), Auto::Given(1000.0), Auto::Auto]),
        tolerance: bytes.one_of(&[1e-2, 1e-5, 1e-8, 1e-12]),
        cell: if bytes.chance(16) { 0.0 } else { size * bytes.within(0.1, 0.4) },
        level: bytes.one_of(&[IsoValue::Zero, IsoValue::Mean]),
        kernel: if bytes.chance(2) {
            bytes.one_of(&[KernelKind::ThinPlate, KernelKind::Biharmonic, KernelKind::Gaussian])
        } else {
            ImplicitParams::default().kernel
        },
        sides: bytes.one_of(&[Sides::Both, Sides::Outside]),
    }
}

/// Steps a multiresolution model with random meshes and ellipsoids, and checks its meshes after each step.
pub fn multires(data: &[u8]) {
    let bytes = &mut Choices::new(data);
    let detail = bytes.chance(2).then(|| shape(bytes));
    let base = bytes.chance(6).then(|| shape(bytes));
    let ellipsoids = ellipsoids(bytes, 1.0);
    let params = multires_params(bytes);
    let options = MultiresOptions { detail, base, ellipsoids, params, ..MultiresOptions::default() };
    let Ok(mut model) = MultiresolutionModel::new(options) else { return };
    for _ in 0..3 {
        match bytes.below(6) {
            0 => _ = model.set_params(multires_params(bytes)),
            1 => {
                let saved = model.save();
                model.restore(&saved).unwrap_or_else(|error| panic!("its own state: {error}"));
                assert!(model.save() == saved, "another state comes out");
            }
            _ => {}
        }
        _ = model.set_ellipsoids(&ellipsoids_near(bytes));
        let stepped = model.step();
        if !matches!(stepped, Ok(_) | Err(MethodError::TooManyVertices { .. })) {
            panic!("{stepped:?}");
        }
        assert_sound(model.base_mesh());
        assert_sound(model.mesh());
    }
}

fn ellipsoids_near(bytes: &mut Choices) -> Vec<ControlEllipsoid> {
    ellipsoids(bytes, 1.8)
}

fn ellipsoids(bytes: &mut Choices, spread: f64) -> Vec<ControlEllipsoid> {
    (0..1 + bytes.below(3)).map(|_| ellipsoid(bytes, spread)).collect()
}

fn ellipsoid(bytes: &mut Choices, spread: f64) -> ControlEllipsoid {
    let x = bytes.direction();
    let y = bytes.direction().cross(x).try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
    let axes = [x, y, x.cross(y)].map(|axis| (axis * bytes.within(0.3, 1.0)).to_array());
    ControlEllipsoid { center: bytes.point(spread).to_array(), axes }
}

fn multires_params(bytes: &mut Choices) -> MultiresParams {
    let edge = bytes.within(0.35, 0.8);
    MultiresParams {
        edge_min: 0.65 * edge,
        edge_max: bytes.within(1.4, 2.0) * edge,
        levels: bytes.below(4) as u32,
        refine_factor: bytes.within(0.3, 0.9),
        smoothing: 1 + bytes.below(6) as u32,
        distribute: bytes.below(5) as u32,
        supersample: bytes.below(2) as u32,
        energy: bytes.one_of(&[Energy::Membrane, Energy::ThinPlate]),
        topology: bytes.one_of(&[Topology::Never, Topology::Split, Topology::SplitAndJoin]),
    }
}

/// Runs a tracker on a random 4D volume, and checks its meshes after each step.
pub fn tracking(data: &[u8]) {
    let bytes = &mut Choices::new(data);
    let dims = [2 + bytes.below(7), 2 + bytes.below(7), 1 + bytes.below(5), 2 + bytes.below(2)];
    let volume = volume(bytes, dims);
    let last = volume.dims().map(|n| n - 1);
    let bounds = bytes.chance(4).then(|| {
        let low = last.map(|n| bytes.below(n / 2 + 1));
        Bounds::Voxels([low, [0, 1, 2].map(|k| low[k] + bytes.below(last[k] - low[k] + 1))])
    });
    let component = if bytes.chance(2) { Component::Nearest(bytes.point(12.0)) } else { Component::Largest };
    let start = bytes.chance(5).then(|| shape(bytes));
    let parts = start.as_ref().map_or(1, |mesh| measure(mesh).components);
    let cavity = if bytes.chance(2) { Cavity::Closed } else { Cavity::Open };
    let options = TrackingOptions {
        volume,
        bounds,
        component,
        start,
        cavity,
        limits: TrackingLimits::default(),
        params: tracking_params(bytes),
    };
    let Ok(mut tracker) = SurfaceTracker::new(options) else { return };
    for _ in 0..200 {
        if tracker.is_done() || tracker.step().is_err() {
            return;
        }
        assert_eq!(tracker.mesh().check(), Ok(()));
        if let Some(mesh) = tracker.meshes().last() {
            let found = measure(mesh);
            // None in a frame without an object, and one where another begins.
            assert!(found.components <= parts && count_self_intersections(mesh) == 0);
        }
        if bytes.chance(8) {
            let saved = tracker.save();
            tracker.restore(&saved).unwrap_or_else(|error| panic!("its own state: {error}"));
            assert!(tracker.save() == saved, "another state comes out");
        }
    }
    panic!("no end");
}

fn tracking_params(bytes: &mut Choices) -> TrackingParams {
    let mut or_zero = |low: f64, high: f64| if bytes.chance(2) { bytes.within(low, high) } else { 0.0 };
    let [radius, time_scale] = [or_zero(1.0, 8.0), or_zero(0.1, 10.0)];
    let edge_min = bytes.within(0.2, 0.5);
    TrackingParams {
        threshold: if bytes.chance(2) { bytes.within(0.01, 0.6) } else { 0.0 },
        window: 1 + bytes.below(4) as u32,
        window_frames: bytes.below(5) as u32,
        radius,
        time_scale,
        damping: bytes.within(0.5, 1.0),
        edge_min,
        edge_max: edge_min * bytes.within(2.1, 5.0) + 0.9,
        prediction: bytes.chance(2),
        cyclic: bytes.chance(2),
    }
}

/// Returns spheres and tori beside or inside each other; bumps may make them intersect themselves. Some are scaled to
/// the limits of single precision.
pub fn shape(bytes: &mut Choices) -> TriangleMesh {
    let mut whole = TriangleMesh::default();
    for _ in 0..bytes.one_of(&[1, 1, 1, 2, 3]) {
        let part = if bytes.chance(2) { ring(bytes) } else { ball(bytes) };
        let (away, first) = (bytes.point(2.0).as_vec3(), whole.positions.len() as u32);
        whole.positions.extend(part.positions.iter().map(|p| *p + away));
        whole.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    if bytes.chance(4) {
        let size = bytes.within(0.0, 0.4);
        whole.positions.iter_mut().for_each(|p| *p += (bytes.direction() * size).as_vec3());
    }
    let scale = if bytes.chance(5) { bytes.one_of(&[1e-42, 1e-25, 1e-6, 1e12, 1e20, 1e37]) } else { 1.0 };
    whole.positions.iter_mut().for_each(|p| *p *= scale);
    whole
}

/// Returns a sphere of random size, which may be flattened.
fn ball(bytes: &mut Choices) -> TriangleMesh {
    let (radius, edge) = (bytes.within(0.4, 2.0) as f32, bytes.within(0.35, 0.9) as f32);
    let mesh = Mesh::icosphere(Vec3::ZERO, radius, edge * radius);
    let flat = Vec3::new(1.0, 1.0, bytes.one_of(&[1.0, 1.0, 0.3, 0.01]));
    let mut mesh = mesh.unwrap_or_else(|_| Mesh::icosahedron(Vec3::ZERO, radius)).to_triangles();
    mesh.positions.iter_mut().for_each(|p| *p *= flat);
    TriangleMesh { positions: mesh.positions, triangles: mesh.triangles, ..TriangleMesh::default() }
}

/// Returns a torus of random size and resolution.
fn ring(bytes: &mut Choices) -> TriangleMesh {
    let (n, m) = (3 + bytes.below(12) as u32, 3 + bytes.below(6) as u32);
    let (wide, thin) = (bytes.within(0.8, 2.0), bytes.within(0.05, 0.7));
    let mut mesh = TriangleMesh::default();
    for k in 0..n * m {
        let (i, j) = (k / m, k % m);
        let [a, b] = [f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)]
            .map(|turn| turn * std::f64::consts::TAU);
        let r = wide + thin * libm::cos(b);
        mesh.positions.push(DVec3::new(r * libm::cos(a), r * libm::sin(a), thin * libm::sin(b)).as_vec3());
        let at = |i: u32, j: u32| (i % n) * m + j % m;
        mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    mesh
}

/// Returns a fixed deformable model of few vertices, for the target of its saved states.
pub fn small_deformable() -> DeformableModel {
    let volume = volume(&mut Choices::new(&[0; 24]), [6, 6, 6, 1]);
    let options = DeformableOptions { edge: Some(1.5), levels: 1, ..DeformableOptions::default() };
    DeformableModel::new(&volume, options).unwrap()
}

/// Returns a fixed implicit surface of six points, for the target of its saved states.
pub fn small_implicit() -> ImplicitSurface {
    let points = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let params = ImplicitParams { cell: 0.5, ..ImplicitParams::paper() };
    let options = ImplicitOptions { params, ..ImplicitOptions::default() };
    ImplicitSurface::new(Cloud { points, ..Cloud::default() }, options).unwrap()
}

/// Returns a fixed multiresolution model of few vertices, for the target of its saved states.
pub fn small_multires() -> MultiresolutionModel {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let ellipsoids = vec![ControlEllipsoid { center: [0.0; 3], axes }];
    let params = MultiresParams { edge_min: 0.6, edge_max: 1.4, ..MultiresParams::default() };
    MultiresolutionModel::new(MultiresOptions { ellipsoids, params, ..MultiresOptions::default() }).unwrap()
}

/// Returns a fixed tracker of few voxels, for the target of its saved states.
pub fn small_tracking() -> SurfaceTracker {
    let volume = volume(&mut Choices::new(&[0; 24]), [6, 6, 4, 3]);
    let options = TrackingOptions {
        volume,
        bounds: None,
        component: Component::Largest,
        start: None,
        cavity: Cavity::Open,
        limits: TrackingLimits::default(),
        params: TrackingParams::default(),
    };
    SurfaceTracker::new(options).unwrap()
}
