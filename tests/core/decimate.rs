//! Decimation: the target is reached, the topology is preserved, nothing intersects, and the shape changes little.

use super::common::scenes;
use super::common::shapes::{HOSTILE_SCALES, cuboid};
use super::common::{Random, euler_of_parts, torus_around};
use vesicle::math::{Vec3, triangle};
use vesicle::mesh::{Mesh, TriangleMesh, count_self_intersections, measure, report};
use vesicle::remesh::{decimate, decimate_within};
use vesicle::spatial::surface_distance;
use vesicle::volume::{Volume, marching_cubes_world};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Returns the mesh decimated to at most `target` triangles if possible, after checking all guarantees.
fn decimated(mesh: &TriangleMesh, target: usize) -> TriangleMesh {
    assert_eq!(count_self_intersections(mesh), 0, "the test mesh intersects itself");
    let mut dynamic = Mesh::from_triangles(mesh).unwrap();
    let collapses = decimate(&mut dynamic, target);
    assert_eq!(dynamic.check(), Ok(()));
    assert_eq!(dynamic.occupancy(), 1.0);
    let coarse = dynamic.to_triangles();
    assert!(report(&coarse).unwrap().is_healthy(), "{:?}", report(&coarse));
    assert_eq!(mesh.triangles.len() - 2 * collapses, coarse.triangles.len());
    assert_eq!(euler_of_parts(&coarse), euler_of_parts(mesh));
    coarse
}

/// Asserts that decimation reaches the target and changes the volume by less than the fraction `share`.
fn keeps_volume(mesh: &TriangleMesh, target: usize, share: f64) {
    let coarse = decimated(mesh, target);
    let count = coarse.triangles.len();
    assert!(count == target || count + 1 == target, "{count} for {target}");
    let ratio = measure(&coarse).volume / measure(mesh).volume;
    assert!((ratio - 1.0).abs() < share, "volume {ratio} with {target}");
}

fn ball(edge: f32) -> TriangleMesh {
    Mesh::icosphere(Vec3::ZERO, 1.0, edge).unwrap().to_triangles()
}

fn surface(volume: &Volume, iso: f64) -> TriangleMesh {
    marching_cubes_world(volume, iso, 0).unwrap()
}

#[test]
fn a_ball_keeps_its_volume() {
    for (target, share) in [(1000, 0.005), (301, 0.02), (100, 0.06)] {
        keeps_volume(&ball(0.06), target, share);
    }
}

#[test]
fn a_torus_keeps_its_volume() {
    let torus = torus_around(Vec3::ZERO, [120, 40], [3.0, 1.0]);
    for (target, share) in [(2000, 0.005), (500, 0.02), (100, 0.1)] {
        keeps_volume(&torus, target, share);
    }
}

#[test]
fn linked_rings_stay_linked() {
    let chain = surface(&scenes::chain(), 0.5);
    for (target, share) in [(chain.triangles.len() / 10, 0.01), (400, 0.05)] {
        keeps_volume(&chain, target, share);
    }
    // As coarse as possible, until the rings obstruct each other.
    let coarse = decimated(&chain, 1);
    assert!(coarse.triangles.len() < 100, "{} triangles", coarse.triangles.len());
}

/// A ball with noise so strong that small components float around it and holes go through it.
#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_noisy_surface_keeps_its_topology() {
    // A function of position, so that the order of voxels does not matter.
    let noise = |p: Vec3| Random((p.x + 32.0 * (p.y + 32.0 * p.z)) as u64).unit();
    let centre = Vec3::splat(15.5);
    let noisy = scenes::volume([32; 3], |p| scenes::potential(p.distance(centre), 10.0) + 0.5 * noise(p));
    let mesh = surface(&noisy, 0.75);
    let parts = euler_of_parts(&mesh);
    assert!(parts.len() > 20 && parts[0] < -20, "{parts:?}");
    let coarse = decimated(&mesh, mesh.triangles.len() / 4);
    assert!(coarse.triangles.len() <= mesh.triangles.len() / 4);
    let ratio = measure(&coarse).volume / measure(&mesh).volume;
    assert!((ratio - 1.0).abs() < 0.03, "volume {ratio}");
    decimated(&mesh, 1);
    // In voxels.
    let near = [0.05, 0.5].map(|distance| decimated_within(&mesh, 1, distance).triangles.len());
    assert!(near[1] < near[0] && near[0] < mesh.triangles.len(), "{near:?} of {}", mesh.triangles.len());
}

/// Two sheets much nearer to each other than the resulting edges are long.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_thin_shell_does_not_intersect_itself() {
    let inner = ball(0.1);
    let mut shell = TriangleMesh { normals: None, ..inner.clone() };
    let first = shell.positions.len() as u32;
    shell.positions.extend(inner.positions.iter().map(|&p| p * 0.99));
    shell.triangles.extend(inner.triangles.iter().map(|&[a, b, c]| [a + first, c + first, b + first]));
    for target in [2000, 500, 1] {
        let coarse = decimated(&shell, target);
        assert!(measure(&coarse).volume > 0.0);
    }
}

/// Tiny components just below the surface, where triangles of a coarser ball would pass beneath them.
#[test]
fn small_components_inside_a_ball_stay_inside() {
    let mut mesh = Mesh::from_triangles(&ball(0.05)).unwrap();
    let ball_vertices = mesh.vertex_count();
    let mut random = Random(3);
    for _ in 0..60 {
        let direction = Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5;
        mesh.append(&Mesh::icosahedron(direction.normalize() * 0.996, 0.001)).unwrap();
    }
    assert_eq!(mesh.vertex_count(), ball_vertices + 60 * 12);
    let coarse = decimated(&mesh.to_triangles(), 600);
    let mut parts = coarse.components();
    parts.sort_by(|a, b| measure(b).volume.total_cmp(&measure(a).volume));
    for speck in &parts[1..] {
        let seen: f64 = parts[0].corners().map(|t| triangle::solid_angle(t, speck.positions[0])).sum();
        assert!((seen - 4.0 * std::f64::consts::PI).abs() < 1e-9, "outside: {seen}");
    }
}

#[test]
fn a_box_keeps_its_corners() {
    // A box of 2 × 3 × 4, sampled with voxels of a tenth.
    let mesh = surface(
        &scenes::volume([30, 40, 50], |p| {
            let inside = |c: f32, n: f32| (c - 4.5).min(n - 5.5 - c);
            inside(p.x, 30.0).min(inside(p.y, 40.0)).min(inside(p.z, 50.0)).clamp(-1.0, 1.0)
        }),
        0.0,
    );
    let coarse = decimated(&mesh, 200);
    assert_eq!(coarse.triangles.len(), 200);
    let (before, after) = (measure(&mesh), measure(&coarse));
    assert!((after.volume / before.volume - 1.0).abs() < 0.002, "{}", after.volume / before.volume);
    assert!((after.bounds[1] - before.bounds[1]).length() < 0.5);
    assert!(after.min_angle_degrees > 1.0, "{}", after.min_angle_degrees);
}

#[test]
fn a_ball_is_reduced_to_a_tetrahedron_at_most() {
    assert_eq!(decimated(&ball(0.2), 1).triangles.len(), 4);
    assert_eq!(decimated(&ball(0.2), 4).triangles.len(), 4);
}

#[test]
fn a_target_above_the_triangle_count_changes_nothing() {
    let before = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
    let mut mesh = before.clone();
    for target in [mesh.triangle_count(), mesh.triangle_count() + 1, usize::MAX] {
        assert_eq!(decimate(&mut mesh, target), 0);
        assert_eq!(mesh, before);
        assert_eq!(mesh.topology_version(), before.topology_version());
    }
    let mut empty = Mesh::default();
    assert_eq!((decimate(&mut empty, 0), empty.check()), (0, Ok(())));
}

#[test]
fn self_intersecting_meshes_keep_their_topology() {
    let mut mesh = Mesh::from_triangles(&ball(0.1)).unwrap();
    let shifted = Mesh::icosphere(Vec3::X * 0.7, 1.0, 0.1).unwrap();
    mesh.append(&shifted).unwrap();
    let before = mesh.triangle_count();
    decimate(&mut mesh, before / 4);
    assert_eq!((mesh.check(), mesh.euler(), mesh.component_members().len()), (Ok(()), 4, 2));
    assert!(mesh.triangle_count() < before / 2);
}

/// Flat, collapsed, tiny and huge meshes: decimation terminates, and the invariants hold.
#[test]
fn degenerate_meshes_stay_valid() {
    for size in HOSTILE_SCALES {
        let mut mesh = Mesh::from_triangles(&ball(0.3)).unwrap();
        mesh.positions_mut().iter_mut().for_each(|p| *p *= size);
        decimate(&mut mesh, 50);
        assert_eq!((mesh.check(), mesh.euler()), (Ok(()), 2), "{size}");
    }
    let mut needle = torus_around(Vec3::ZERO, [300, 3], [3.0, 1.0]);
    needle.positions.iter_mut().for_each(|p| *p *= Vec3::new(1e4, 1e-4, 1.0));
    decimated(&needle, 1);
}

/// Returns the mesh decimated as far as vertices of both surfaces stay within `tolerance` of the other one.
fn decimated_within(mesh: &TriangleMesh, target: usize, tolerance: f64) -> TriangleMesh {
    let mut dynamic = Mesh::from_triangles(mesh).unwrap();
    let collapses = decimate_within(&mut dynamic, target, tolerance).unwrap();
    assert_eq!(dynamic.check(), Ok(()));
    let coarse = dynamic.to_triangles();
    assert!(report(&coarse).unwrap().is_healthy(), "{:?}", report(&coarse));
    assert_eq!(mesh.triangles.len() - 2 * collapses, coarse.triangles.len());
    assert_eq!(euler_of_parts(&coarse), euler_of_parts(mesh));
    let found = surface_distance(mesh, &coarse).unwrap().hausdorff;
    assert!(found <= tolerance * (1.0 + 1e-6) + 1e-12, "{found}, more than {tolerance}");
    coarse
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn the_distance_from_the_surface_before_is_bounded() {
    let shell = torus_around(Vec3::ZERO, [120, 40], [3.0, 1.0]);
    for mesh in [ball(0.06), shell, surface(&scenes::chain(), 0.5)] {
        let [low, high] = measure(&mesh).bounds;
        let size = high.x - low.x;
        let mut before = mesh.triangles.len();
        for share in [1e-3, 3e-3, 1e-2] {
            let count = decimated_within(&mesh, 1, share * size).triangles.len();
            assert!(count < before, "{count} triangles within {share} of the size, {before} before");
            before = count;
        }
        assert!(before < mesh.triangles.len() / 8, "{before} of {}", mesh.triangles.len());
        // The target is reached first.
        let target = mesh.triangles.len() / 2;
        assert_eq!(decimated_within(&mesh, target, size).triangles.len(), target);
    }
}

#[test]
fn within_no_distance_only_what_is_flat_is_coarsened() {
    let fine = cuboid([8, 12, 16], Vec3::new(2.0, 3.0, 4.0));
    let coarse = decimated_within(&fine, 1, 0.0);
    assert!(coarse.triangles.len() < fine.triangles.len() / 4, "{}", coarse.triangles.len());
    assert!((measure(&coarse).volume / measure(&fine).volume - 1.0).abs() < 1e-9);
    let curved = ball(0.2);
    assert_eq!(decimated_within(&curved, 1, 0.0).triangles.len(), curved.triangles.len());
}

#[test]
fn a_distance_that_is_no_distance_is_refused() {
    let before = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
    for tolerance in [-1.0, f64::NAN, f64::NEG_INFINITY] {
        let mut mesh = before.clone();
        let error = decimate_within(&mut mesh, 1, tolerance).unwrap_err();
        assert!(error.to_string().contains("max_distance"), "{error}");
        assert_eq!(mesh, before);
    }
}

#[test]
fn decimation_is_deterministic() {
    let run = || {
        let mut mesh = Mesh::from_triangles(&surface(&scenes::chain(), 0.5)).unwrap();
        decimate(&mut mesh, 1500);
        mesh
    };
    assert_eq!(run(), run());
}
