//! The meaning of voxels: outside the image and NaN are never object, infinite voxels are on their side of every iso value, and
//! neither fill values nor large offsets take the precision of the others; for marching cubes, the model and thresholds.

use super::common::{euler_of_parts, scenes};
use vesicle::math::{Bounds, Vec3};
use vesicle::mesh::{TriangleMesh, measure};
use vesicle::methods::deformable::{DeformableModel, DeformableOptions, DeformableParams};
use vesicle::volume::{Region, Volume, VolumeInit, Voxels, marching_cubes_world};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn cube(n: usize, voxels: Voxels) -> Volume {
    Volume::new(VolumeInit::new(voxels, [n, n, n, 1])).unwrap()
}

fn values(n: usize, value: impl Fn(Vec3) -> f64) -> Vec<f64> {
    let at = |k: usize| Vec3::new((k % n) as f32, (k / n % n) as f32, (k / n / n) as f32);
    (0..n * n * n).map(|k| value(at(k))).collect()
}

fn doubles(n: usize, value: impl Fn(Vec3) -> f64) -> Volume {
    cube(n, Voxels::F64(values(n, value)))
}

fn floats(n: usize, value: impl Fn(Vec3) -> f64) -> Volume {
    cube(n, Voxels::F32(values(n, value).into_iter().map(|value| value as f32).collect()))
}

/// Returns the distance to the surface of a ball in the middle of a cube of `n` voxels, positive inside.
fn ball(n: usize, radius: f32) -> impl Fn(Vec3) -> f64 {
    move |p| f64::from(radius - p.distance(Vec3::splat(0.5 * (n as f32 - 1.0))))
}

fn volume_of(surface: &TriangleMesh) -> f64 {
    measure(surface).volume
}

fn model(volume: &Volume, params: DeformableParams) -> DeformableModel {
    let options = DeformableOptions { params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(volume, options).unwrap();
    run(&mut model);
    model
}

fn run(model: &mut DeformableModel) {
    for _ in 0..1000 {
        if model.step().unwrap().done {
            return;
        }
    }
    panic!("not done after 1000 iterations");
}

fn at(iso: f64) -> DeformableParams {
    DeformableParams { iso, ..DeformableParams::default() }
}

fn darker_than(iso: f64) -> DeformableParams {
    DeformableParams { iso_force: -DeformableParams::default().iso_force, ..at(iso) }
}

/// Returns the number of voxels of which [`Volume::threshold`] says that they are object.
fn voxels_above(volume: &Volume, iso: f64) -> usize {
    volume.threshold(iso, f64::INFINITY).unwrap().labels(0).unwrap().iter().map(|label| label.voxels).sum()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, tolerance: f64, what: &str) {
    println!("{what}: {found:.1} for {expected:.1}");
    assert!((found / expected - 1.0).abs() <= tolerance, "{what}: {found} for {expected}");
}

/// Asserts that marching cubes and the model find one part without holes of this volume.
#[track_caller]
fn assert_found(volume: &Volume, iso: f64, expected: [f64; 2], tolerance: f64) -> [f64; 2] {
    let contour = marching_cubes_world(volume, iso, 0).unwrap();
    assert_eq!(euler_of_parts(&contour), [2]);
    assert_near(volume_of(&contour), expected[0], tolerance, "marching cubes");
    let model = model(volume, at(iso));
    let surface = model.surface();
    assert_eq!(euler_of_parts(&surface), [2]);
    assert_near(volume_of(&surface), expected[1], tolerance, "model");
    let coverage = model.coverage().unwrap();
    assert!(coverage.recall > 0.999 && coverage.precision > 0.999, "{coverage:?}");
    [volume_of(&contour), volume_of(&surface)]
}

#[test]
fn the_object_ends_at_the_border_whatever_the_iso_value() {
    let n = 24;
    let volume = floats(n, |p| f64::from(150.0 + (p.x * 7.0 + p.y * 3.0 + p.z) % 100.0));
    let full = (n * n * n) as f64;
    for iso in [150.0, 149.0, 100.0, -1e6, -1e300] {
        assert_found(&volume, iso, [full; 2], 0.01);
        assert_eq!(voxels_above(&volume, iso), n * n * n);
    }
    let darker = model(&volume, darker_than(300.0));
    assert_near(volume_of(&darker.surface()), full, 0.01, "darker");
    let bounds = Bounds::from_points(&darker.surface().positions);
    assert!(bounds.min.min_element() > -0.6 && bounds.max.max_element() < n as f32 - 0.4, "{bounds:?}");
    for (iso, params) in [(300.0, at(300.0)), (1e300, at(1e300)), (100.0, darker_than(100.0))] {
        assert_eq!(model(&volume, params).mesh().vertex_count(), 0, "{iso}");
    }
    assert!(marching_cubes_world(&volume, 300.0, 0).unwrap().triangles.is_empty());
}

#[test]
fn nan_is_outside_whatever_the_iso_value() {
    let (n, inside) = (24, ball(24, 7.2));
    let [count, tolerance] = [1555.0, 0.01];
    let masked = floats(n, |p| if inside(p) < 0.0 { f64::NAN } else { 100.0 + inside(p) });
    for iso in [99.0, 50.0, -1e9] {
        assert_found(&masked, iso, [count; 2], tolerance);
        assert_eq!(voxels_above(&masked, iso), 1568);
    }
    let darker = model(&masked, darker_than(200.0));
    assert_near(volume_of(&darker.surface()), count, 0.02, "darker");
    // Half of the object is masked; the border is there, as if the image ended.
    let half = floats(n, |p| if p.z > 11.0 { f64::NAN } else { inside(p) });
    let cropped = Volume::new(VolumeInit::new(
        Voxels::F32(values(n, &inside).into_iter().take(n * n * 12).map(|value| value as f32).collect()),
        [n, n, 12, 1],
    ))
    .unwrap();
    let [contour, surface] = [
        volume_of(&marching_cubes_world(&cropped, 0.0, 0).unwrap()),
        volume_of(&model(&cropped, at(0.0)).surface()),
    ];
    let found = assert_found(&half, 0.0, [contour, surface], 0.005);
    assert_near(found[1], found[0], 0.01, "model and marching cubes");
}

#[test]
fn infinite_voxels_are_on_their_side() {
    let (n, inside) = (16, ball(16, 5.0));
    let high = floats(n, |p| if inside(p) > 0.0 { f64::INFINITY } else { inside(p) - 0.5 });
    let low = floats(n, |p| if inside(p) < 0.0 { f64::NEG_INFINITY } else { inside(p) + 0.5 });
    for volume in [high, low] {
        assert_found(&volume, 0.0, [539.0; 2], 0.03);
    }
}

/// Fill values far beyond all others neither hide the object nor move its surface.
#[test]
fn fill_values_do_not_take_the_precision() {
    let (n, inside) = (24, ball(24, 7.2));
    let of = |fill: f64| floats(n, |p| if p.x < 2.0 { fill } else { 10.0 * inside(p) });
    let ordinary = assert_found(&of(-72.0), 0.0, [1545.0; 2], 0.005);
    for fill in [-9999.0, -1e6, -1e10, -3.402_823_5e38, 3.402_823_5e38] {
        let volume = of(fill);
        let contour = marching_cubes_world(&volume, 0.0, 0).unwrap();
        let surface = model(&volume, at(0.0)).surface();
        println!("{fill}: {} {}", volume_of(&contour), volume_of(&surface));
        if fill < 0.0 {
            assert_found(&volume, 0.0, ordinary, 0.01);
        } else {
            assert_eq!(euler_of_parts(&surface), [2, 2]);
            assert_near(volume_of(&surface), volume_of(&contour), 0.015, "model");
        }
    }
}

/// A change of the iso value takes the image from the volume again where its window is too narrow.
#[test]
fn the_iso_value_may_change_beside_fill_values() {
    let (n, inside) = (24, ball(24, 7.2));
    let volume = floats(n, |p| if p.x < 2.0 { -1e10 } else { 10.0 * inside(p) });
    let mut model = model(&volume, at(-5e9));
    model.set_params(at(0.0)).unwrap();
    run(&mut model);
    assert_near(volume_of(&model.surface()), 1545.0, 0.01, "model");
    let state = model.save();
    let options = DeformableOptions { params: Some(at(-5e9)), ..Default::default() };
    let mut restored = DeformableModel::new(&volume, options).unwrap();
    restored.restore(&state).unwrap();
    for model in [&mut model, &mut restored] {
        model.set_params(at(20.0)).unwrap();
        run(model);
    }
    assert_eq!(model.save(), restored.save());
    assert_near(volume_of(&model.surface()), 589.0, 0.03, "model");
}

#[test]
fn small_differences_of_large_intensities_count() {
    let (n, inside) = (24, ball(24, 7.2));
    let is_inside = |p: Vec3| inside(p) > 0.0;
    let small = cube(
        n,
        Voxels::U32(values(n, |p| if is_inside(p) { 7.0 } else { 0.0 }).iter().map(|&v| v as u32).collect()),
    );
    let expected = assert_found(&small, 3.0, [1568.0; 2], 0.015);
    for offset in [4e9, 4e12, -4e9] {
        let value = |p: Vec3| offset + if is_inside(p) { 7.0 } else { 0.0 };
        let volume = doubles(n, value);
        assert_found(&volume, offset + 3.0, expected, 1e-3);
        assert_eq!(voxels_above(&volume, offset + 3.0), 1568);
        if offset == 4e9 {
            let integers = cube(n, Voxels::U32(values(n, value).iter().map(|&v| v as u32).collect()));
            assert_found(&integers, offset + 3.0, expected, 1e-3);
            // All of it is below.
            assert!(marching_cubes_world(&integers, offset + 8.0, 0).unwrap().triangles.is_empty());
        }
    }
}

#[test]
fn coarse_levels_keep_small_differences_of_large_intensities() {
    let inside = ball(24, 7.2);
    let above = |base: f64| doubles(24, |p| base + inside(p).clamp(-3.0, 3.0));
    let [near, far] = [0.0, 4e9].map(|base| above(base).pyramid(3, 1.5).unwrap());
    for (near, far) in near.iter().zip(&far).skip(1) {
        let [a, b] = [(near, 0.0), (far, 4e9)]
            .map(|(level, iso)| volume_of(&marching_cubes_world(level, iso, 0).unwrap()));
        assert_near(b, a, 1e-5, "level");
        assert_near(far.range()[1] - 4e9, near.range()[1], 1e-5, "largest");
    }
}

/// Objects that the border cuts end half a voxel beyond the outermost voxel centres, also in a single slice.
#[test]
fn the_model_closes_objects_at_the_border_as_marching_cubes_does() {
    let corner = floats(24, |p| f64::from(9.0 - p.distance(Vec3::splat(2.0))));
    let contour = volume_of(&marching_cubes_world(&corner, 0.0, 0).unwrap());
    assert_near(volume_of(&model(&corner, at(0.0)).surface()), contour, 0.01, "a ball in a corner");
    for depth in [1, 2, 4] {
        let disc = |p: Vec3| 6.2 - Vec3::new(p.x - 9.5, p.y - 9.5, 0.0).length();
        let volume = scenes::volume([20, 20, depth], disc);
        let contour = volume_of(&marching_cubes_world(&volume, 0.0, 0).unwrap());
        let surface = volume_of(&model(&volume, at(0.0)).surface());
        assert_near(surface, contour, 0.01, "a disc");
    }
}

/// Returns an image of objects of 1 to 8 voxels each, several of each size, and the number of objects.
fn specks(object: u8, background: u8) -> (Volume, Vec<u8>) {
    let (n, mut values) = (40, vec![background; 40 * 40 * 40]);
    let mut counts = Vec::new();
    for k in 0..64 {
        let corner = [2 + 9 * (k % 4), 2 + 9 * (k / 4 % 4), 2 + 9 * (k / 16)];
        let count = 1 + k % 8;
        // Voxels of a block, in an order such that each has a neighbour before it.
        for i in [0, 1, 3, 2, 6, 4, 5, 7].into_iter().take(count) {
            let at = [0, 1, 2].map(|axis| corner[axis] + (i >> axis & 1));
            values[at[0] + n * (at[1] + n * at[2])] = object;
        }
        counts.push(count as u8);
    }
    (cube(n, Voxels::U8(values)), counts)
}

/// Objects of a few voxels are found if the smallest part is one voxel, and those that are smaller than it are not.
#[test]
fn objects_of_a_few_voxels_are_found() {
    for (object, background, iso, params) in [
        (200, 0, 100.0, at(100.0)),
        (200, 0, 40.0, at(40.0)),
        (200, 0, 150.0, at(150.0)),
        (0, 200, 100.0, darker_than(100.0)),
    ] {
        let (volume, counts) = specks(object, background);
        // At other iso values than the middle, the volumes are not those of the voxels.
        for smallest in if iso == 100.0 { vec![1, 4, 8] } else { vec![1] } {
            let params = DeformableParams { smallest_part: f64::from(smallest), ..params.clone() };
            let expected = counts.iter().filter(|&&count| count >= smallest).count();
            let surface = model(&volume, params).surface();
            assert_eq!(euler_of_parts(&surface), vec![2; expected], "{iso}, {smallest}");
            if smallest == 1 && object > background {
                let contour = volume_of(&marching_cubes_world(&volume, iso, 0).unwrap());
                assert_near(volume_of(&surface), contour, 0.1, "objects of a few voxels");
            }
        }
    }
}

/// Voxels that become NaN, or finite, are taken up by a refresh.
#[test]
fn a_refresh_takes_up_nan() {
    let (n, inside) = (24, ball(24, 7.2));
    let mut volume = floats(n, &inside);
    let mut model = model(&volume, at(0.0));
    let region = Region { min: [0, 0, 12], dims: [n, n, 12] };
    volume.write(region, &Voxels::F32(vec![f32::NAN; region.len()]), 0).unwrap();
    model.refresh(&volume, region).unwrap();
    run(&mut model);
    let options = DeformableOptions { params: Some(at(0.0)), ..Default::default() };
    let mut anew = DeformableModel::new(&volume, options).unwrap();
    run(&mut anew);
    assert_near(volume_of(&model.surface()), volume_of(&anew.surface()), 0.02, "half a ball");
}

/// Regression: the contour of a voxel that is barely object, beside one without a value, is a needle; it got ever more
/// vertices where small parts count.
#[test]
fn a_voxel_that_is_barely_object_beside_nan_gets_few_vertices() {
    let volume = super::common::scenes::volume([16; 3], |p| {
        if p == Vec3::splat(3.0) {
            0.01
        } else if p == Vec3::new(3.0, 4.0, 3.0) {
            f32::NAN
        } else {
            (4.0 - p.distance(Vec3::splat(9.5))).max(-1.5)
        }
    });
    let params = DeformableParams { iso: 0.0, smallest_part: 1.0, ..DeformableParams::for_volume(&volume) };
    let options = DeformableOptions { params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options).unwrap();
    let mut report = model.step().unwrap();
    while !report.done {
        assert!(report.vertices < 1500, "{}", report.vertices);
        report = model.step().unwrap();
    }
    assert!(report.vertices < 1500, "{}", report.vertices);
}
