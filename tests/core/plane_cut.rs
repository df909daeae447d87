//! Cuts by planes: what is left is closed, keeps its side, and nothing intersects.

use super::common::shapes::{all, joined};
use super::common::{Named, Random, assert_at_least, seeds, torus_around};
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{Mesh, MeshError, TriangleMesh, count_self_intersections, measure, report};
use vesicle::remesh::{Plane, cut_by_plane};
use vesicle::spatial::cross_section;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn ball(radius: f32) -> TriangleMesh {
    Mesh::icosphere(Vec3::ZERO, radius, 0.2).unwrap().to_triangles()
}

fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    mesh
}

fn cut(mesh: &TriangleMesh, plane: Plane) -> Result<TriangleMesh, MeshError> {
    let mut cut = Mesh::from_triangles(mesh).unwrap();
    let before = cut.clone();
    let result = cut_by_plane(&mut cut, plane);
    assert_eq!(cut.check(), Ok(()));
    if let Err(error) = result {
        assert_eq!(cut, before);
        return Err(error);
    }
    Ok(cut.to_triangles())
}

/// Cuts the mesh, and checks all that is guaranteed.
fn checked_cut(mesh: &TriangleMesh, plane: Plane) -> Result<TriangleMesh, MeshError> {
    let part = cut(mesh, plane)?;
    assert!(report(&part).unwrap().is_healthy(), "{:?}", report(&part));
    let normal = plane.normal.normalize();
    let height = |p: Vec3| normal.dot(p.as_dvec3() - plane.origin);
    let largest = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let tolerance = 1e-4 * f64::from(largest);
    assert!(part.positions.iter().all(|&p| height(p) < tolerance));
    // Both parts together are the whole.
    if let Ok(other) = cut(mesh, Plane { normal: -plane.normal, ..plane }) {
        let whole = measure(mesh);
        let sum = measure(&part).volume + measure(&other).volume;
        let slack = tolerance * whole.area;
        assert!(part.triangles.len() == mesh.triangles.len() || (sum - whole.volume).abs() < slack, "{sum}");
    }
    Ok(part)
}

fn plane(origin: [f64; 3], normal: [f64; 3]) -> Plane {
    Plane { origin: origin.into(), normal: normal.into() }
}

fn euler(mesh: &TriangleMesh) -> i64 {
    measure(mesh).euler
}

#[test]
fn a_ball_through_its_vertices() {
    let half = checked_cut(&ball(1.0), plane([0.0; 3], [0.0, 0.0, 2.0])).unwrap();
    assert_eq!(euler(&half), 2);
    let measures = measure(&half);
    assert!((measures.volume / (2.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.02, "{measures:?}");
    assert!(measures.bounds[1].z.abs() < 1e-4 && measures.bounds[0].z < -0.99);
}

#[test]
fn a_torus_becomes_a_bow_or_two_rings() {
    let torus = torus_around(Vec3::ZERO, [60, 20], [3.0, 1.0]);
    assert_eq!(euler(&checked_cut(&torus, plane([0.0; 3], [1.0, 0.0, 0.0])).unwrap()), 2);
    // The cross-section is a disk with a hole.
    assert_eq!(euler(&checked_cut(&torus, plane([0.0; 3], [0.0, 0.0, 1.0])).unwrap()), 0);
}

#[test]
fn cavities_are_holes_of_the_section() {
    let shell = joined(&[ball(2.0), inside_out(ball(1.5)), ball(1.0), inside_out(ball(0.5))]);
    let half = checked_cut(&shell, plane([0.0; 3], [0.1, 0.2, 1.0])).unwrap();
    assert_eq!(measure(&half).components, 2);
    assert_eq!(euler(&half), 4);
    let ratio = measure(&half).volume / measure(&shell).volume;
    assert!((ratio - 0.5).abs() < 0.01, "{ratio}");
    assert!(cross_section(&half, Vec3::ZERO, Vec3::Z).len() > 100);
}

#[test]
fn a_plane_beside_the_mesh() {
    let ball = ball(1.0);
    let whole = cut(&ball, plane([0.0, 0.0, 1.5], [0.0, 0.0, 1.0])).unwrap();
    assert_eq!(whole.positions, ball.positions);
    let lowest = ball.positions.iter().map(|p| f64::from(p.z)).fold(f64::MAX, f64::min);
    for wrong in [
        plane([0.0, 0.0, -1.5], [0.0, 0.0, 1.0]),
        // Touched by one vertex.
        plane([0.0, 0.0, lowest], [0.0, 0.0, 1.0]),
        plane([0.0; 3], [0.0; 3]),
        plane([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0]),
        plane([0.0; 3], [f64::INFINITY, 0.0, 0.0]),
    ] {
        let error = cut(&ball, wrong).unwrap_err();
        assert!(matches!(error, MeshError::InvalidArgument { parameter: "plane", .. }), "{error}");
    }
}

#[test]
fn self_intersections_at_the_plane_are_refused() {
    let mut shifted = ball(1.0);
    shifted.positions.iter_mut().for_each(|p| p.x += 0.7);
    let two = joined(&[ball(1.0), shifted]);
    assert_eq!(cut(&two, plane([0.0; 3], [0.0, 0.0, 1.0])), Err(MeshError::CannotCut));
    // Where it does not intersect itself, it can be cut, and the rest is unchanged.
    let rest = cut(&two, plane([1.4, 0.0, 0.0], [1.0, 0.0, 0.0])).unwrap();
    assert_eq!(count_self_intersections(&rest), count_self_intersections(&two));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn random_planes_through_difficult_shapes() {
    let shapes = all();
    let (mut cuts, mut refusals) = (0, 0);
    for seed in seeds(52) {
        let _named = Named::new(seed);
        let mut random = Random(seed);
        let (name, mesh) = &shapes[seed as usize % shapes.len()];
        let at = mesh.positions[random.below(mesh.positions.len())].as_dvec3();
        let normal = match random.below(3) {
            0 => DVec3::AXES[random.below(3)],
            1 => -DVec3::AXES[random.below(3)],
            _ => DVec3::from([(); 3].map(|()| random.within(-1.0, 1.0))),
        };
        let middle = 0.5 * (measure(mesh).bounds[0] + measure(mesh).bounds[1]);
        let origin = if random.below(2) == 0 { at } else { at.lerp(middle, random.within(0.0, 1.0)) };
        match checked_cut(mesh, Plane { origin, normal }) {
            Ok(part) => {
                assert!(part.triangles.len() > 3, "{name}");
                cuts += 1;
            }
            Err(MeshError::InvalidArgument { .. }) => {}
            Err(error) => {
                println!("{name}: {error}");
                refusals += 1;
            }
        }
    }
    assert_at_least(45, cuts, "cuts");
    assert!(refusals <= 3, "{refusals} refusals");
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn again_and_again() {
    for seed in seeds(6) {
        let _named = Named::new(seed);
        let mut random = Random(seed);
        let mut mesh = ball(1.0);
        let mut cuts = 0;
        for _ in 0..40 {
            let normal = DVec3::from([(); 3].map(|()| random.within(-1.0, 1.0)));
            let origin = normal.normalize() * random.within(0.2, 0.9);
            let part = cut(&mesh, Plane { origin, normal }).unwrap();
            cuts += usize::from(part.positions != mesh.positions);
            mesh = part;
        }
        assert!(report(&mesh).unwrap().is_healthy());
        assert_eq!(euler(&mesh), 2);
        assert_at_least(10, cuts, "cuts that changed the mesh");
    }
}

#[test]
fn cuts_repeat_bit_for_bit() {
    let torus = torus_around(Vec3::ZERO, [60, 20], [3.0, 1.0]);
    let oblique = plane([0.1, 0.2, 0.3], [1.0, 2.0, 3.0]);
    assert_eq!(cut(&torus, oblique), cut(&torus, oblique));
}
