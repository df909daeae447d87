//! Remeshing: even triangles, the same topology and shape, and no self-intersections.

use super::common::shapes;
use super::common::shapes::HOSTILE_SCALES;
use super::common::{Named, Random, euler_of_parts, seeds, torus_around};
use vesicle::math::{DVec3, Vec3, triangle};
use vesicle::mesh::{Mesh, MeshError, TriangleMesh, count_self_intersections, measure, report};
use vesicle::remesh::{EdgeBounds, Unchecked, remesh, restructure};
use vesicle::spatial::surface_distance;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Returns bounds around a target length, whose ratio is a little more than the minimum of 2.
fn about(aim: f32) -> EdgeBounds {
    EdgeBounds { min: aim / 1.5, max: aim * 1.5 }
}

/// Returns the remeshed mesh, after checking all guarantees.
fn remeshed(mesh: &TriangleMesh, bounds: EdgeBounds) -> TriangleMesh {
    assert_eq!(count_self_intersections(mesh), 0, "a crossing in the test's own mesh");
    let mut dynamic = Mesh::from_triangles(mesh).unwrap();
    remesh(&mut dynamic, bounds).unwrap();
    assert_eq!(dynamic.check(), Ok(()));
    assert_eq!(dynamic.occupancy(), 1.0);
    let result = dynamic.to_triangles();
    assert!(report(&result).unwrap().is_healthy(), "{:?}", report(&result));
    assert_eq!(euler_of_parts(&result), euler_of_parts(mesh));
    result
}

/// Returns the fraction of edges out of bounds.
fn outside(mesh: &TriangleMesh, bounds: EdgeBounds) -> f64 {
    let at = |v: u32| mesh.positions[v as usize];
    let edges = || mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let is_out = |&(u, v): &(u32, u32)| !(bounds.min..=bounds.max).contains(&at(u).distance(at(v)));
    edges().filter(is_out).count() as f64 / edges().count() as f64
}

/// Returns the smallest angle of each triangle, in degrees, in ascending order.
fn sharpest_angles(mesh: &TriangleMesh) -> Vec<f64> {
    let angle = |[a, b, c]: [Vec3; 3]| {
        let [a, b, c] = [a, b, c].map(DVec3::from);
        let at = |p: DVec3, q: DVec3, r: DVec3| {
            libm::atan2((q - p).cross(r - p).length(), (q - p).dot(r - p)).to_degrees()
        };
        at(a, b, c).min(at(b, c, a)).min(at(c, a, b))
    };
    let mut angles: Vec<f64> = mesh.corners().map(angle).collect();
    angles.sort_unstable_by(f64::total_cmp);
    angles
}

/// Returns the Hausdorff distance of two meshes, relative to the target edge length.
fn distance(a: &TriangleMesh, b: &TriangleMesh, aim: f32) -> f64 {
    surface_distance(a, b).unwrap().hausdorff / f64::from(aim)
}

#[test]
#[ignore = "long: npm run test:all"]
fn assorted_shapes_at_three_sizes() {
    let mut sharpest = Vec::new();
    for (name, mesh) in shapes::all() {
        let mean = measure(&mesh).edge_mean as f32;
        for factor in [0.7, 1.0, 3.0] {
            let bounds = about(mean * factor);
            let result = remeshed(&mesh, bounds);
            let far = distance(&result, &mesh, mean * factor);
            // The corners of a slab much thinner than the edges may be lost, and the tips of a rough surface.
            let is_hard = ["thin slab", "noisy ball"].contains(&name);
            assert!(far < if is_hard { 0.8 } else { 0.5 }, "{name}, {factor}: {far}");
            sharpest.push(sharpest_angles(&result)[0]);
        }
    }
    sharpest.sort_unstable_by(f64::total_cmp);
    let median = sharpest[sharpest.len() / 2];
    assert!(median > 30.0, "{median}");
}

#[test]
fn a_torus_gets_even_triangles() {
    // Its triangles are six times as long as wide.
    let torus = torus_around(Vec3::ZERO, [300, 12], [3.0, 1.0]);
    for aim in [0.1, 0.2, 0.5] {
        let result = remeshed(&torus, about(aim));
        assert!(outside(&result, about(aim)) < 0.01, "{aim}: {}", outside(&result, about(aim)));
        assert!(sharpest_angles(&result)[0] > 30.0, "{aim}: {}", sharpest_angles(&result)[0]);
        let mean = measure(&result).edge_mean as f32 / aim;
        assert!((0.8..1.25).contains(&mean), "{aim}: {mean}");
    }
}

#[test]
fn the_edges_of_a_cube_are_kept() {
    for (n, aim) in [(1, 0.1), (1, 0.3), (16, 0.05), (16, 0.2)] {
        let cube = shapes::cuboid([n; 3], Vec3::ONE);
        let result = remeshed(&cube, about(aim));
        assert!(distance(&result, &cube, aim) < 0.5, "{n}, {aim}: {}", distance(&result, &cube, aim));
        let volume = measure(&result).volume;
        assert!(volume <= 1.0 + 1e-6 && volume > 1.0 - 0.3 * f64::from(aim), "{n}, {aim}: {volume}");
        assert!(outside(&result, about(aim)) < 0.02, "{n}, {aim}");
    }
}

#[test]
fn edges_within_wide_bounds_are_kept() {
    let ball = shapes::ellipsoid(0.1, Vec3::ONE);
    let mean = measure(&ball).edge_mean;
    let result = remeshed(&ball, EdgeBounds { min: 0.01, max: 1.0 });
    assert_eq!(result.triangles.len(), ball.triangles.len());
    assert!((measure(&result).edge_mean / mean - 1.0).abs() < 0.1);
}

/// Random tori, ellipsoids and boxes, two of each with a tiny gap between them, and random bounds.
#[test]
fn random_shapes_and_bounds_give_valid_meshes() {
    for seed in seeds(12) {
        let named = Named::new(seed);
        let mut random = Random(seed);
        let stretch = Vec3::from([(); 3].map(|()| random.within(0.05, 1.0) as f32));
        let one = match random.below(3) {
            0 => torus_around(Vec3::ZERO, [60, 20], [0.7, 0.29]),
            1 => shapes::ellipsoid(0.15, Vec3::ONE),
            _ => shapes::cuboid([8, 9, 10], Vec3::ONE),
        };
        let one = TriangleMesh { positions: one.positions.iter().map(|&p| p * stretch).collect(), ..one };
        let width = measure(&one).bounds[1].x - measure(&one).bounds[0].x;
        let gap = width + random.within(0.0001, 0.01);
        let mut other = one.clone();
        other.positions.iter_mut().for_each(|p| p.x += gap as f32);
        let mesh = shapes::joined(&[one, other]);
        let min = (measure(&mesh).edge_mean * random.within(0.5, 3.0)) as f32;
        let bounds = EdgeBounds { min, max: min * random.within(2.001, 4.0) as f32 };
        let result = remeshed(&mesh, bounds);
        let far = distance(&result, &mesh, (bounds.min * bounds.max).sqrt());
        assert!(far < 1.0, "{far} with {bounds:?}");
        drop(named);
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn self_intersecting_meshes_are_remeshed() {
    let ball = shapes::ellipsoid(0.1, Vec3::ONE);
    let mut other = ball.clone();
    other.positions.iter_mut().for_each(|p| p.x += 0.7);
    let mut mesh = Mesh::from_triangles(&shapes::joined(&[ball, other])).unwrap();
    let before = mesh.triangle_count();
    remesh(&mut mesh, about(0.25)).unwrap();
    assert_eq!((mesh.check(), mesh.euler(), mesh.component_members().len()), (Ok(()), 4, 2));
    assert!(mesh.triangle_count() < before / 2);
}

/// Flat, tiny, huge and elongated meshes: remeshing terminates, and the invariants hold.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn degenerate_meshes_stay_valid() {
    for size in HOSTILE_SCALES {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
        mesh.positions_mut().iter_mut().for_each(|p| *p *= size);
        let largest = size.max_element();
        for aim in [0.2, 0.6] {
            remesh(&mut mesh, about(aim * if largest > 0.0 { largest } else { 1.0 })).unwrap();
            assert_eq!((mesh.check(), mesh.euler()), (Ok(()), 2), "{size}");
        }
    }
    let mut nothing = Mesh::default();
    remesh(&mut nothing, about(1.0)).unwrap();
    assert_eq!((nothing.vertex_count(), nothing.check()), (0, Ok(())));
}

/// The unit of length does not matter; for powers of two not even to the last bit.
#[test]
fn the_result_is_the_same_in_other_units() {
    let torus = torus_around(Vec3::ZERO, [60, 20], [3.0, 1.0]);
    let run = |unit: f32| {
        let mut mesh = Mesh::from_triangles(&torus).unwrap();
        mesh.positions_mut().iter_mut().for_each(|p| *p *= unit);
        remesh(&mut mesh, about(0.3).scaled(unit)).unwrap();
        mesh.positions_mut().iter_mut().for_each(|p| *p /= unit);
        mesh.to_triangles()
    };
    let (plain, small) = (run(1.0), run(1.0 / (1_u64 << 40) as f32));
    assert_eq!((plain.positions, plain.triangles), (small.positions, small.triangles));
}

#[test]
fn invalid_bounds_are_refused() {
    let before = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
    for (min, max) in [
        (0.0, 1.0),
        (-1.0, 1.0),
        (0.5, 1.0),
        (1.0, 0.5),
        (f32::NAN, 1.0),
        (0.1, f32::NAN),
        (0.1, f32::INFINITY),
        (f32::INFINITY, f32::INFINITY),
    ] {
        let mut mesh = before.clone();
        let error = remesh(&mut mesh, EdgeBounds { min, max }).unwrap_err();
        let MeshError::InvalidArgument { parameter, problem } = &error else { panic!("{error}") };
        assert_eq!(*parameter, "edge");
        assert!(problem.contains(&min.to_string()) && problem.contains(&max.to_string()), "{problem}");
        assert_eq!(mesh, before);
    }
}

#[test]
fn a_result_that_exceeds_memory_is_refused_in_advance() {
    let mut needle = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
    needle.positions_mut().iter_mut().for_each(|p| *p *= Vec3::new(1.0, 0.0, 0.0));
    for before in [Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap(), needle] {
        for max in [1e-6, 1e-30] {
            let mut mesh = before.clone();
            let error = remesh(&mut mesh, EdgeBounds { min: max / 3.0, max }).unwrap_err();
            assert!(
                matches!(error, MeshError::TooManyVertices { vertices } if vertices > 4_000_000),
                "{error}"
            );
            assert_eq!(mesh, before);
        }
    }
}

#[test]
fn remeshing_is_deterministic() {
    let run = || {
        let mut mesh = Mesh::from_triangles(&shapes::noisy_ball()).unwrap();
        remesh(&mut mesh, about(2.0)).unwrap();
        mesh
    };
    assert_eq!(run(), run());
}

/// Vertices lie on the original surface.
#[test]
fn vertices_stay_on_the_surface() {
    let cube = shapes::cuboid([4; 3], Vec3::ONE);
    let result = remeshed(&cube, about(0.2));
    for &p in &result.positions {
        let off = (p - 0.5).abs().max_element() - 0.5;
        assert!(off.abs() < 1e-6, "{p}");
    }
    assert!(cube.corners().map(triangle::area).sum::<f64>() > 5.9);
}

/// Edges below the spacing of single-precision coordinates cannot be made: remeshing and restructuring would split for
/// ever.
#[test]
fn edges_finer_than_coordinates_are_refused() {
    for (at, radius, edge) in [(5.4e6, 5.0, 0.3), (1e-6, 1e-12, 1e-13), (1e12, 1e7, 1e6), (-1e20, 1e14, 1e12)]
    {
        let mesh = Mesh::icosphere(Vec3::ZERO, radius, radius * 0.3).unwrap();
        let mut far = mesh.to_triangles();
        far.positions.iter_mut().for_each(|p| *p += Vec3::X * at);
        let mut far = Mesh::from_triangles(&far).unwrap();
        let before = far.clone();
        let refused = remesh(&mut far, about(edge));
        let is_known =
            matches!(refused, Err(MeshError::Precision { .. } | MeshError::TooManyVertices { .. }));
        assert!(is_known, "{at}: {refused:?}");
        assert!(far == before);
        restructure(&mut far, about(edge), &mut Unchecked);
        far.check().unwrap();
        println!("{at}: {} vertices", far.vertex_count());
        assert!(far.vertex_count() < 50_000, "{at}: {}", far.vertex_count());
    }
    let near = Mesh::icosphere(Vec3::X * 1e4, 5.0, 1.0).unwrap();
    assert_eq!(about(0.3).check_for(&near), Ok(()));
}
