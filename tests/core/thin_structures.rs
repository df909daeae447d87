//! Walls, gaps, strands and cavities that a uniform δ would lose, at the default settings: right components and Euler
//! characteristics, and a mean error of at most 0.15 voxels.

use super::common::{Random, euler_of_parts, scenes};
use std::task::Poll;
use vesicle::math::{DAffine3, DMat3, DVec3, Vec3};
use vesicle::mesh::{TriangleMesh, count_self_intersections, measure};
use vesicle::methods::deformable::{
    Coverage, DeformableModel, DeformableOptions, DeformableParams, Missing, Seeding, Start,
};
use vesicle::volume::{Volume, Voxels, marching_cubes_world};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Largest accepted mean error, in voxels.
const MEAN_ERROR: f64 = 0.15;

/// Returns the image of an object with a signed distance function, negative inside. Each voxel is the fraction of it
/// that is inside, as a scanner would measure it.
fn image(dims: [usize; 3], distance: impl Fn(Vec3) -> f32) -> Volume {
    scenes::volume(dims, |p| {
        let mut inside = 0;
        for k in 0..64 {
            let at = [k % 4, k / 4 % 4, k / 16].map(|i| (i as f32 - 1.5) * 0.25);
            inside += i32::from(distance(p + Vec3::from(at)) < 0.0);
        }
        inside as f32 / 64.0
    })
}

/// Runs the model at the default settings; asserts after every iteration that the mesh is valid and free of
/// self-intersections.
fn run(volume: &Volume, options: DeformableOptions) -> (TriangleMesh, Coverage) {
    let mut model = DeformableModel::new(volume, options).unwrap();
    for iteration in 0..1000 {
        let report = model.step().unwrap();
        assert_eq!(model.mesh().check(), Ok(()), "iteration {iteration}");
        assert_eq!(i64::from(report.euler), model.mesh().euler(), "iteration {iteration}");
        assert_eq!(count_self_intersections(&model.mesh().to_triangles()), 0, "iteration {iteration}");
        if report.done {
            return (model.surface(), model.coverage().unwrap());
        }
    }
    panic!("not at rest after 1000 iterations");
}

/// Objects below the sampling limit: voxels can be less than half full where an object is thinner than their diagonal,
/// so the contour of the image itself has holes.
const BELOW_SAMPLING: [&str; 2] = ["shell 1", "ring of radius 0.8"];

/// Asserts that the object's components are found, direct and coarse to fine, with the given Euler characteristics, and
/// that the mean error is at most 0.15 voxels or that of the image's contour.
fn is_found(what: &str, dims: [usize; 3], euler: &[i64], distance: impl Fn(Vec3) -> f32) {
    let volume = image(dims, &distance);
    let error = |surface: &TriangleMesh| {
        let sum: f64 = surface.positions.iter().map(|&p| f64::from(distance(p).abs())).sum();
        sum / surface.positions.len() as f64
    };
    let contour = marching_cubes_world(&volume, 0.5, 0).unwrap();
    let can_be_found = euler_of_parts(&contour) == euler;
    assert_eq!(can_be_found, !BELOW_SAMPLING.contains(&what), "{what}: {:?}", euler_of_parts(&contour));
    let params = DeformableParams { iso: 0.5, smallest_part: 8.0, ..DeformableParams::for_volume(&volume) };
    for levels in [0, 1, 2] {
        let options = DeformableOptions { levels, params: Some(params.clone()), ..Default::default() };
        let (surface, coverage) = run(&volume, options);
        let (found, error, of_contour) = (euler_of_parts(&surface), error(&surface), error(&contour));
        let what = format!("{what}, {levels} levels");
        println!(
            "{what}: χ {found:?}, mean error {error:.3} ({of_contour:.3}), recall {:.4}",
            coverage.recall
        );
        assert!(!can_be_found || found == euler, "{what}: {found:?}");
        let is_near = error < MEAN_ERROR.max(of_contour + 0.02);
        assert!(is_near || !can_be_found, "{what}: {error}, {of_contour}");
        assert!(coverage.recall > 0.99 && coverage.precision > 0.99, "{what}: {coverage:?}");
    }
}

/// Returns the signed distance to a box with the given centre and half of its size.
fn to_box(p: Vec3, middle: Vec3, half: Vec3) -> f32 {
    let q = (p - middle).abs() - half;
    q.max(Vec3::ZERO).length() + q.max_element().min(0.0)
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn plates_of_one_voxel_and_more() {
    let middle = Vec3::new(15.7, 15.3, 9.3);
    for thickness in [1.0, 1.5, 2.0, 3.0] {
        let half = Vec3::new(11.0, 11.0, 0.5 * thickness);
        is_found(&format!("plate {thickness}"), [32, 31, 19], &[2], |p| to_box(p, middle, half));
    }
}

#[ignore = "long: npm run test:all"]
#[test]
fn curved_plates_of_one_voxel_and_more() {
    let middle = Vec3::new(15.4, 15.2, 15.3);
    for thickness in [1.0, 1.5, 2.0, 3.0] {
        // A closed shell: an outer and an inner surface.
        let shell = |p: Vec3| (p.distance(middle) - 11.0).abs() - 0.5 * thickness;
        is_found(&format!("shell {thickness}"), [31; 3], &[2, 2], shell);
    }
}

#[test]
fn tubes_of_radius_eight_tenths_and_more() {
    for radius in [0.8, 1.2, 2.0, 3.0] {
        let middle = Vec3::new(15.3, 15.2, 6.4);
        is_found(&format!("ring of radius {radius}"), [32, 31, 14], &[0], |p| {
            scenes::to_circle(p - middle, 10.0) - radius
        });
    }
}

#[test]
fn straight_tubes_of_one_voxel_radius_and_more() {
    let [from, to] = [Vec3::new(6.2, 9.0, 8.0), Vec3::new(28.3, 9.0, 8.0)];
    for radius in [1.0, 1.2, 2.0, 3.0] {
        is_found(&format!("tube of radius {radius}"), [35, 19, 17], &[2], |p| {
            scenes::to_segment(p, from, to) - radius
        });
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn three_nested_hollow_spheres() {
    let middle = Vec3::new(19.4, 19.2, 19.3);
    is_found("nested spheres", [39; 3], &[2; 6], |p| {
        let r = p.distance(middle);
        [6.0, 11.0, 16.0].into_iter().map(|radius| (r - radius).abs() - 1.0).fold(f32::INFINITY, f32::min)
    });
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn two_sheets_side_by_side() {
    for gap in [1.0, 2.0, 3.0] {
        let half = Vec3::new(10.0, 10.0, 1.5);
        let shift = Vec3::Z * (1.5 + 0.5 * gap);
        let middle = Vec3::new(14.6, 14.3, 9.2);
        is_found(&format!("sheets {gap} apart"), [30, 29, 19], &[2, 2], |p| {
            to_box(p, middle + shift, half).min(to_box(p, middle - shift, half))
        });
    }
}

/// Coverage reports the parts that the paper's method leaves out, and their positions.
#[test]
fn coverage_reports_missing_parts() {
    let middle = Vec3::splat(15.3);
    let apart = Vec3::new(28.0, 15.0, 15.0);
    let distance = |p: Vec3| (p.distance(middle) - 7.0).abs() - 2.0;
    let volume = image([36, 31, 31], |p| distance(p).min(p.distance(apart) - 3.0));
    let params = DeformableParams { iso: 0.5, ..DeformableParams::for_volume(&volume) };
    let start = Start::Seeds { points: vec![(middle + Vec3::X * 7.0).as_dvec3()], radius: 1.8 };
    let off = DeformableOptions { start, params: Some(params.clone()), ..Default::default() };
    let mut model = DeformableModel::new(&volume, off).unwrap();
    while !model.step().unwrap().done {}
    let before = model.coverage().unwrap();
    let kinds: Vec<Missing> = before.uncovered.iter().map(|part| part.kind).collect();
    assert_eq!(kinds, [Missing::Matter], "{before:?}");
    assert!(before.uncovered[0].position.as_vec3().distance(apart) < 4.0, "{before:?}");
    // They are seeded on demand.
    assert_eq!(model.seed().unwrap().events.seeds, 1);
    while !model.step().unwrap().done {}
    assert!(model.coverage().unwrap().recall > 0.99);

    let enclosing =
        DeformableOptions { start: Start::Enclosing, params: Some(params.clone()), ..Default::default() };
    let mut model = DeformableModel::new(&volume, enclosing).unwrap();
    while !model.step().unwrap().done {}
    let kinds: Vec<Missing> = model.coverage().unwrap().uncovered.iter().map(|part| part.kind).collect();
    assert_eq!(kinds, [Missing::Cavity]);
    model.set_params(DeformableParams { seeding: Seeding::On, ..params }).unwrap();
    while !model.step().unwrap().done {}
    let coverage = model.coverage().unwrap();
    assert!(coverage.recall > 0.99 && coverage.precision > 0.99, "{coverage:?}");
}

/// Measuring coverage in slices gives the same result as at once.
#[test]
fn coverage_in_slices_is_the_same() {
    let volume = image([24; 3], |p| p.distance(Vec3::splat(11.4)) - 7.0);
    let model = DeformableModel::new(&volume, DeformableOptions::default()).unwrap();
    let mut survey = model.survey_coverage().unwrap();
    let mut shares = vec![0.0];
    let coverage = loop {
        match survey.advance() {
            Poll::Ready(coverage) => break coverage.unwrap(),
            Poll::Pending => shares.push(survey.share()),
        }
    };
    assert!(shares.len() > 5 && shares.is_sorted() && survey.share() == 1.0);
    assert_eq!(coverage, model.coverage().unwrap());
}

/// Components that enclose fewer voxels than `smallest_part` are left out, larger ones are not.
#[test]
fn parts_that_are_too_small_are_left_out() {
    let balls = [
        (Vec3::new(10.3, 10.1, 10.2), 6.0),
        (Vec3::new(24.0, 10.0, 10.0), 2.2),
        (Vec3::new(24.0, 19.0, 10.0), 3.0),
    ];
    let volume = image([32, 25, 21], |p| {
        balls.iter().map(|&(middle, radius)| p.distance(middle) - radius).fold(f32::INFINITY, f32::min)
    });
    let parts = |smallest_part| {
        let params = DeformableParams { iso: 0.5, smallest_part, ..DeformableParams::for_volume(&volume) };
        let options = DeformableOptions { params: Some(params), ..Default::default() };
        euler_of_parts(&run(&volume, options).0).len()
    };
    assert_eq!([20.0, 64.0, 300.0].map(parts), [3, 2, 1]);
}

/// Positions are returned in world space in single precision. Regression: sheets nearer than rounding intersected
/// there.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn nothing_intersects_in_world_space() {
    let dims = [18, 17, 16];
    let mut random = Random(9);
    let noise: Vec<f32> = (0..dims.iter().product()).map(|_| random.unit()).collect();
    let affine = DAffine3::from_mat3_translation(
        DMat3::from_cols(DVec3::new(1.58, 0.1, 0.0), DVec3::new(-0.1, -0.99, 0.02), DVec3::Z * 1.01),
        DVec3::new(-930.0, 1240.0, 385.0),
    );
    let volume = scenes::placed(Voxels::F32(noise), dims, affine);
    let params = DeformableParams { smallest_part: 8.0, ..DeformableParams::for_volume(&volume) };
    let options = DeformableOptions { params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options).unwrap();
    for iteration in 0..25 {
        let report = model.step().unwrap();
        assert_eq!(count_self_intersections(&model.surface()), 0, "iteration {iteration}");
        assert!(report.vertices > 800);
    }
}

/// A voxel a thousand times as bright as the object does not move its surface, although it dominates the range.
#[test]
fn one_bright_voxel_does_not_move_the_surface() {
    let ball = |bright: f32| {
        let volume = scenes::volume([32; 3], |p| {
            if p == Vec3::new(2.0, 2.0, 2.0) {
                bright
            } else {
                (100.0 - 50.0 * (p.distance(Vec3::splat(15.4)) - 9.0)).clamp(0.0, 200.0)
            }
        });
        let params = DeformableParams { iso: 100.0, ..DeformableParams::for_volume(&volume) };
        run(&volume, DeformableOptions { params: Some(params), ..Default::default() }).0
    };
    let exact = 4.0 / 3.0 * std::f64::consts::PI * (9.0 * 9.0 * 9.0);
    for bright in [0.0, 200_000.0] {
        let volume = measure(&ball(bright)).volume / exact;
        assert!((volume - 1.0).abs() < 0.02, "{bright}: {volume}");
    }
}

/// A slit a tenth of a voxel wide inside a block, slightly below the iso value: both of its sides are found.
#[test]
fn slits_much_thinner_than_a_voxel_are_kept() {
    let middle = Vec3::new(14.3, 14.2, 10.0);
    let volume = scenes::volume([30, 30, 21], |p| {
        let in_slit = (p.z - middle.z).abs() < 0.5 && (p - middle).truncate().abs().max_element() < 8.0;
        let inside = -to_box(p, middle, Vec3::new(11.5, 11.5, 6.5));
        if in_slit { 0.47 } else { (0.5 + 0.5 * inside).clamp(0.0, 1.0) }
    });
    let params = DeformableParams { iso: 0.5, smallest_part: 8.0, ..DeformableParams::for_volume(&volume) };
    let (surface, coverage) = run(&volume, DeformableOptions { params: Some(params), ..Default::default() });
    assert_eq!(euler_of_parts(&surface), [2, 2]);
    assert!(coverage.recall > 0.995, "{coverage:?}");
}

/// On a level change, a component that the coarse level has only in part is seeded again; one that it has completely is
/// kept and refined.
#[test]
fn components_incomplete_on_a_coarse_level_are_seeded_again() {
    let (plate, ball) = (Vec3::new(16.3, 15.8, 8.2), Vec3::new(16.0, 16.0, 29.0));
    let volume = image([34, 33, 42], |p| {
        // A thin plate on a thick rod, and a ball that is complete on every level.
        let rod = scenes::to_segment(p, plate - Vec3::X * 9.0, plate + Vec3::X * 9.0) - 3.5;
        to_box(p, plate, Vec3::new(12.0, 12.0, 0.6)).min(rod).min(p.distance(ball) - 8.0)
    });
    let params = DeformableParams { iso: 0.5, ..DeformableParams::for_volume(&volume) };
    let options = DeformableOptions { levels: 2, params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options.clone()).unwrap();
    let mut seeds = 0;
    loop {
        let report = model.step().unwrap();
        seeds += report.events.seeds;
        if report.done {
            break;
        }
    }
    // The plate, on at most each of two levels; never the ball.
    assert!((1..=2).contains(&seeds), "{seeds}");
    let (surface, coverage) = run(&volume, options);
    assert_eq!(euler_of_parts(&surface), [2, 2]);
    assert!(coverage.recall > 0.99 && coverage.precision > 0.99, "{coverage:?}");
}
