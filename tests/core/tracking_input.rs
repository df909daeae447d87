//! Tracking of sequences as they come: far from the origin, in any unit, without an object in some frames, with values
//! that are not numbers, too thin, or of uneven brightness. The result is right, or refused, or carries a warning.

use super::common::{Named, Random, assert_at_least, seeds};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use vesicle::math::{DAffine3, DVec3, Vec3};
use vesicle::mesh::{Mesh, TriangleMesh, count_self_intersections, measure};
use vesicle::methods::MethodError;
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, Query, SurfaceTracker, TrackingLimits, TrackingOptions, TrackingParams,
};
use vesicle::volume::{Enrichment, Volume, VolumeError, VolumeInit, Voxels};
use vesicle::warning::{Place, WarningCode};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Side of the cubic volumes, in voxels.
const SIDE: usize = 20;

/// A ball, with its centre in voxels.
#[derive(Clone, Copy)]
struct Ball {
    center: DVec3,
    radius: f64,
}

const BALL: Ball = Ball { center: DVec3::splat(9.5), radius: 6.0 };

/// Returns the volume of a sequence of `frames`, whose voxels are `value` of the index of the frame and the position.
fn sequence(
    dims: [usize; 3],
    frames: usize,
    affine: DAffine3,
    value: impl FnMut(usize, DVec3) -> f32,
) -> Volume {
    try_sequence(dims, frames, affine, value).unwrap()
}

/// Returns a sequence as [`sequence`] does, or the error that refuses it.
fn try_sequence(
    dims: [usize; 3],
    frames: usize,
    affine: DAffine3,
    mut value: impl FnMut(usize, DVec3) -> f32,
) -> Result<Volume, VolumeError> {
    let [nx, ny, nz] = dims;
    let at = |i: usize| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64);
    let voxels = (0..frames).flat_map(|t| (0..nx * ny * nz).map(move |i| (t, i)));
    let values = voxels.map(|(t, i)| value(t, at(i))).collect();
    Volume::new(VolumeInit { affine, ..VolumeInit::new(Voxels::F32(values), [nx, ny, nz, frames]) })
}

/// Returns the brightness, up to 1, of a voxel in balls that are blurred by a voxel.
fn brightness(balls: &[Ball], p: DVec3) -> f32 {
    let depth = |ball: &Ball| (ball.radius + 0.5 - p.distance(ball.center)).clamp(0.0, 1.0);
    balls.iter().map(depth).fold(0.0, f64::max) as f32
}

/// Returns a sequence with the given balls in each frame, and noise.
fn balls(frames: &[Vec<Ball>], noise: f64) -> Volume {
    let mut random = Random(1);
    sequence([SIDE; 3], frames.len(), DAffine3::IDENTITY, |t, p| {
        30.0 + 200.0 * brightness(&frames[t], p) + random.within(0.0, noise) as f32
    })
}

fn options(volume: Volume) -> TrackingOptions {
    let params = TrackingParams::default();
    TrackingOptions {
        volume,
        bounds: None,
        component: Component::Largest,
        start: None,
        cavity: Cavity::Open,
        limits: TrackingLimits::default(),
        params,
    }
}

fn tracked(options: TrackingOptions) -> Result<SurfaceTracker, MethodError> {
    let mut tracker = SurfaceTracker::new(options)?;
    while !tracker.is_done() {
        tracker.step()?;
    }
    Ok(tracker)
}

/// Returns the kinds of warnings and their frames, in order.
fn told(tracker: &SurfaceTracker) -> Vec<(WarningCode, u32)> {
    let frame = |place| if let Some(Place::Frame(frame)) = place { frame } else { panic!("no frame") };
    tracker.warnings().into_iter().map(|warning| (warning.code, frame(warning.place))).collect()
}

/// Asserts that the volumes are within 2.5 % of the expected ones, 9 % for small objects, and 0 where 0 is
/// expected, in meshes and statistics.
fn assert_volumes(tracker: &SurfaceTracker, expected: &[f64]) {
    println!("{:.1?} instead of {expected:.1?}: {:?}", tracker.volumes(), told(tracker));
    assert_eq!(tracker.volumes().len(), expected.len());
    for (frame, (found, expected)) in tracker.volumes().into_iter().zip(expected).enumerate() {
        // Triangles lie below a curved surface, by more the smaller it is.
        let allowed = if expected > &600.0 { 0.025 } else { 0.09 };
        assert!((found - expected).abs() <= allowed * expected, "{frame}: {found} {expected}");
        assert_eq!(tracker.meshes()[frame].triangles.is_empty(), *expected == 0.0, "{frame}");
        assert_eq!(tracker.statistics()[frame].triangles, tracker.meshes()[frame].triangles.len());
    }
}

fn size(ball: Ball) -> f64 {
    4.0 / 3.0 * PI * ball.radius * ball.radius * ball.radius
}

/// Regression: in slices more than 12.5 pixels apart the error was about a radius that nobody had given.
#[test]
fn slices_too_far_apart_are_refused_with_the_advice_to_insert_some() {
    for (apart, is_fine) in [(12.0, true), (13.0, false), (18.0, false)] {
        let affine = DAffine3::from_scale(DVec3::new(1.0, 1.0, apart));
        let ball = Ball { center: DVec3::new(9.5, 9.5, 3.5), radius: 3.0 };
        let volume = sequence([SIDE, SIDE, 8], 2, affine, |_, p| 200.0 * brightness(&[ball], p));
        match SurfaceTracker::new(options(volume)).err() {
            None => assert!(is_fine, "{apart}"),
            Some(MethodError::InvalidArgument { parameter, problem }) => {
                assert!(!is_fine && parameter == "volume" && problem.contains("enrichSlices"), "{problem}");
            }
            Some(error) => panic!("{apart}: {error}"),
        }
    }
}

/// Wherever a ball is between voxels, it has its volume.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn volumes_of_small_balls_are_right_on_average() {
    let centers = [
        [13.5; 3],
        [13.0; 3],
        [13.4, 13.7, 13.5],
        [13.2, 13.9, 14.1],
        [13.25, 13.5, 13.75],
        [13.1, 13.45, 13.8],
    ];
    for radius in [6.0, 8.0, 11.0] {
        let ratio = |center: [f64; 3]| {
            let ball = Ball { center: DVec3::from(center), radius };
            let volume = sequence([28; 3], 2, DAffine3::IDENTITY, |_, p| 200.0 * brightness(&[ball], p));
            let tracker = tracked(options(volume)).unwrap();
            [0, 1].map(|frame| tracker.volumes()[frame] / size(ball))
        };
        let found = centers.map(ratio);
        println!("{radius}: {found:.4?}");
        for frame in 0..2 {
            let mean = found.iter().map(|ratios| ratios[frame]).sum::<f64>() / found.len() as f64;
            assert!((mean - 1.0).abs() < 0.005, "{radius}: {mean}");
        }
        let allowed = if radius < 8.0 { 0.008 } else { 0.004 };
        assert!(
            found.as_flattened().iter().all(|ratio| (ratio - 1.0).abs() < allowed),
            "{radius}: {found:?}"
        );
    }
}

/// Returns a sequence of two frames of a box at rest, given by its centre and half its sides; voxels are as bright as the share
/// of them that is in it.
fn resting_box(center: [f64; 3], half: [f64; 3]) -> Volume {
    let share = |x: f64, center: f64, half: f64| {
        ((x + 0.5).min(center + half) - (x - 0.5).max(center - half)).clamp(0.0, 1.0)
    };
    sequence([30; 3], 2, DAffine3::IDENTITY, |_, p| {
        let shares = [0, 1, 2].map(|k| share(p[k], center[k], half[k]));
        (20.0 + 150.0 * shares[0] * shares[1] * shares[2]) as f32
    })
}

/// All faces between voxels at such a side are to the same side of it, so that their positions do not even out.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn flat_sides_between_voxels_are_where_the_image_has_them() {
    for (center, half) in [
        ([14.5, 14.5, 14.5], [6.2, 6.2, 6.2]),
        ([14.9, 14.2, 14.6], [6.6, 6.6, 6.6]),
        ([14.0, 14.3, 14.8], [7.4, 7.5, 7.6]),
        ([14.5, 14.5, 14.5], [10.0, 10.0, 1.8]),
        ([14.3, 14.7, 14.4], [10.0, 10.0, 2.3]),
        ([14.5, 14.5, 14.2], [10.0, 10.0, 2.5]),
    ] {
        let tracker = tracked(options(resting_box(center, half))).unwrap();
        let expected = 8.0 * half[0] * half[1] * half[2];
        let ratios = [0, 1].map(|frame| tracker.volumes()[frame] / expected);
        println!("{half:?}: {ratios:.4?} {:?}", told(&tracker));
        // Edges and corners are rounded.
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{half:?}: {ratios:?}");
    }
}

#[test]
fn objects_thinner_than_plane_fits_are_told() {
    for half in [1.2, 1.8] {
        let tracker = tracked(options(resting_box([14.5; 3], [10.0, 10.0, half]))).unwrap();
        println!("{half}: {:?} {:?}", tracker.volumes(), told(&tracker));
        let expected: &[_] = if half < 1.5 { &[(SmallObject, 0), (SmallObject, 1)] } else { &[] };
        assert_eq!(told(&tracker), expected);
    }
}

/// The level of its windows is between that of the frame and those of the others, and is not where the surface is.
#[test]
fn a_frame_dimmed_by_less_than_a_third_has_its_volume() {
    let volume = sequence([SIDE; 3], 5, DAffine3::IDENTITY, |t, p| {
        (20.0 + 130.0 * brightness(&[BALL], p)) * if t == 2 { 0.7 } else { 1.0 }
    });
    let tracker = tracked(options(volume)).unwrap();
    let ratios: Vec<f64> = tracker.volumes().iter().map(|volume| volume / size(BALL)).collect();
    assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.04), "{ratios:?}");
    assert_eq!(told(&tracker), []);
}

/// Returns a sequence of a ball in slices that are six pixels apart and as thick, its radius given in slices, and the ball.
fn ball_in_slices(slices: f64) -> (Volume, Ball) {
    let thick = 6.0;
    let radius = thick * slices;
    let side = 2.0 * radius + 12.0;
    let dims = [side as usize, side as usize, 2 * slices as usize + 5];
    let ball = Ball { center: DVec3::new(0.5 * side, 0.5 * side, thick * (slices + 2.2)), radius };
    let volume = sequence(dims, 2, DAffine3::from_scale(DVec3::new(1.0, 1.0, thick)), |_, p| {
        let parts = [-0.375, -0.125, 0.125, 0.375];
        let at = |part: f64| DVec3::new(p.x, p.y, thick * (p.z + part));
        parts.map(|part| brightness(&[ball], at(part))).iter().sum::<f32>() * 50.0
    });
    (volume, ball)
}

/// A ball of two slices' radius is too small in them, and told; one of four has its volume.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn objects_that_extend_over_few_thick_slices_are_told() {
    for slices in [2.0, 4.0] {
        let (volume, ball) = ball_in_slices(slices);
        let tracker = tracked(options(volume)).unwrap();
        let ratios = [0, 1].map(|frame| tracker.volumes()[frame] / size(ball));
        println!("{slices}: {ratios:.3?} {:?}", told(&tracker));
        let (expected, allowed): (&[_], _) =
            if slices < 3.0 { (&[(SmallObject, 0)], 0.12) } else { (&[], 0.03) };
        assert_eq!(told(&tracker), expected);
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < allowed), "{ratios:?}");
    }
}

/// As many slices as make voxels cubes would make the ball too large.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn slices_inserted_by_default_bring_a_small_ball_near_to_its_volume() {
    let (volume, ball) = ball_in_slices(2.0);
    let tracker = tracked(options(volume.enrich_slices(None, Enrichment::Flow).unwrap())).unwrap();
    let ratios = [0, 1].map(|frame| tracker.volumes()[frame] / size(ball));
    assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.02), "{ratios:?}");
}

/// An ellipsoid that beats smoothly is tracked through all frames, although many projections fail where it is smallest.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_smooth_beat_in_slices_is_not_taken_for_another_object() {
    let (thick, frames) = (6.0, 8);
    let center = DVec3::new(23.5, 23.5, 33.0);
    for (contraction, phase) in [(0.25, 0.0), (0.35, 0.0), (0.35, 0.4)] {
        let semi_axes = |t: usize| {
            let beat = 0.5 - 0.5 * libm::cos(2.0 * PI * (t as f64 + phase) / frames as f64);
            DVec3::new(14.0, 12.0, 24.0) * (1.0 - contraction * beat)
        };
        let affine = DAffine3::from_scale(DVec3::new(1.0, 1.0, thick));
        let volume = sequence([48, 48, 12], frames, affine, |t, p| {
            let parts = [-0.417, -0.25, -0.083, 0.083, 0.25, 0.417];
            let depth = |part: f64| {
                let at = (DVec3::new(p.x, p.y, thick * (p.z + part)) - center) / semi_axes(t);
                (0.5 - (at.length() - 1.0) * 13.0).clamp(0.0, 1.0)
            };
            40.0 + 100.0 / 6.0 * parts.map(depth).iter().sum::<f64>() as f32
        });
        let enriched = volume.enrich_slices(None, Enrichment::Flow).unwrap();
        let tracker = tracked(options(enriched)).unwrap();
        let size = |t: usize| 4.0 / 3.0 * PI * semi_axes(t).element_product();
        let errors: Vec<f64> = (0..frames).map(|t| tracker.volumes()[t] / size(t) - 1.0).collect();
        println!("{contraction} {phase}: {errors:.3?} {:?}", told(&tracker));
        assert_eq!(told(&tracker), [], "{contraction} {phase}");
        assert!(errors.iter().all(|error| error.abs() < 0.05), "{errors:?}");
    }
}

/// A frame that is off by much is told of, also if it differs little from those beside it.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_sequence_that_fades_is_told() {
    let radius = |t: usize| 7.0 * (1.0 - 0.12 * libm::sin(0.25 * PI * t as f64));
    let volume = sequence([24; 3], 7, DAffine3::IDENTITY, |t, p| {
        let depth = (radius(t) + 1.25 - p.distance(DVec3::splat(11.6))).clamp(0.0, 2.5);
        (100.0 + 160.0 * depth as f32) * (0..t).map(|_| 0.88f32).product::<f32>()
    });
    let tracker = tracked(options(volume)).unwrap();
    let error = |t: usize| tracker.volumes()[t] / size(Ball { radius: radius(t), ..BALL }) - 1.0;
    let errors: Vec<f64> = (0..7).map(error).collect();
    println!("{errors:.3?} {:?}", told(&tracker));
    assert_eq!(told(&tracker), [(UnevenBrightness, 4)]);
    assert!(errors.iter().all(|error| error.abs() < 0.1));
}

use WarningCode::{BeginsInFrame, EndsInFrame, SmallObject, UnevenBrightness};

/// The balls in each frame, the volumes expected, and the warnings.
type Case<'a> = (&'a [&'a Vec<Ball>], &'a [f64], &'a [(WarningCode, u32)]);

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn frames_without_the_object_have_an_empty_surface_and_are_told() {
    let (ball, none) = (vec![BALL], Vec::new());
    let v = size(BALL);
    let cases: [Case; 5] = [
        (&[&ball, &ball, &none, &none], &[v, v, 0.0, 0.0], &[(EndsInFrame, 2)]),
        (&[&none, &none, &ball, &ball], &[0.0, 0.0, v, v], &[(BeginsInFrame, 2)]),
        (&[&ball, &none, &ball], &[v, 0.0, v], &[(EndsInFrame, 1), (BeginsInFrame, 2)]),
        (&[&none, &ball, &none], &[0.0, v, 0.0], &[(BeginsInFrame, 1), (EndsInFrame, 2)]),
        (&[&ball, &ball], &[v, v], &[]),
    ];
    for (frames, volumes, expected) in cases {
        let frames: Vec<Vec<Ball>> = frames.iter().map(|&frame| frame.clone()).collect();
        for noise in [0.0, 30.0] {
            for window_frames in [0, 2] {
                let mut options = options(balls(&frames, noise));
                options.params.window_frames = window_frames;
                let tracker = tracked(options).unwrap();
                assert_volumes(&tracker, volumes);
                assert_eq!(told(&tracker), expected);
                assert_eq!(tracker.mesh().vertex_count() == 0, volumes.last() == Some(&0.0));
            }
        }
    }
}

#[test]
fn a_cycle_may_have_frames_without_the_object() {
    let (ball, none, v) = (vec![BALL], Vec::new(), size(BALL));
    for (frames, volumes, expected) in [
        (vec![ball.clone(), ball.clone(), none.clone()], [v, v, 0.0], [(EndsInFrame, 2), (BeginsInFrame, 0)]),
        (vec![none.clone(), ball.clone(), ball.clone()], [0.0, v, v], [(BeginsInFrame, 1), (EndsInFrame, 0)]),
        (vec![ball.clone(), none, ball], [v, 0.0, v], [(EndsInFrame, 1), (BeginsInFrame, 2)]),
    ] {
        let mut options = options(balls(&frames, 10.0));
        options.params.cyclic = true;
        let tracker = tracked(options).unwrap();
        assert_volumes(&tracker, &volumes);
        assert_eq!(told(&tracker), expected);
        let closes = volumes[0] > 0.0 && volumes[2] > 0.0;
        assert_eq!(tracker.cycle_closure_error().is_some(), closes);
    }
}

#[test]
fn of_two_objects_one_is_tracked_until_it_ends() {
    let large = Ball { center: DVec3::new(6.5, 9.5, 9.5), radius: 4.5 };
    let small = Ball { center: DVec3::new(15.0, 9.5, 9.5), radius: 3.2 };
    let both = vec![large, small];
    let (v, none) = (size(large), 0.0);
    for (frames, volumes, expected) in [
        (vec![both.clone(), both.clone(), vec![large]], [v, v, v], vec![]),
        (vec![vec![large], both.clone(), both.clone()], [v, v, v], vec![]),
        // The one that was there all the time does not begin.
        (vec![both.clone(), both.clone(), vec![small]], [v, v, none], vec![(EndsInFrame, 2)]),
        (
            vec![both.clone(), vec![small], both.clone()],
            [v, none, v],
            vec![(EndsInFrame, 1), (BeginsInFrame, 2)],
        ),
    ] {
        let tracker = tracked(options(balls(&frames, 10.0))).unwrap();
        assert_volumes(&tracker, &volumes);
        assert_eq!(told(&tracker), expected);
    }
}

#[test]
fn an_object_that_shrinks_to_nothing_or_leaves_the_box_ends() {
    let shrinking = [6.0, 5.0, 4.0, 2.0, 0.9].map(|radius| vec![Ball { radius, ..BALL }]);
    let tracker = tracked(options(balls(&[&shrinking[..], &[vec![], vec![]]].concat(), 10.0))).unwrap();
    let volumes = tracker.volumes();
    println!("{volumes:?} {:?}", told(&tracker));
    assert!(volumes.windows(2).all(|pair| pair[1] < pair[0] || pair[0] == 0.0) && volumes[3] > 10.0);
    assert_eq!(volumes[5..], [0.0; 2]);
    assert!(told(&tracker).contains(&(SmallObject, 3)));
    assert_eq!(told(&tracker).iter().filter(|(code, _)| *code == EndsInFrame).count(), 1);
    // It loses 3 voxels a frame, and is cut by the side of the box.
    let leaving: Vec<Vec<Ball>> = (0..7)
        .map(|t| vec![Ball { center: DVec3::new(9.5 + 3.0 * f64::from(t), 9.5, 9.5), radius: 5.0 }])
        .collect();
    let tracker = tracked(options(balls(&leaving, 10.0))).unwrap();
    println!("{:?} {:?}", tracker.volumes(), told(&tracker));
    let cap = |t: usize| {
        let height = (19.5 - (9.5 + 3.0 * t as f64) + 5.0).clamp(0.0, 10.0);
        PI * height * height * (15.0 - height) / 3.0
    };
    for (t, volume) in tracker.volumes().into_iter().enumerate().take(4) {
        assert!((volume - cap(t)).abs() < 0.08 * cap(t), "{t} {volume} {}", cap(t));
    }
    assert_eq!(tracker.volumes()[6], 0.0);
    assert_eq!(told(&tracker).iter().filter(|(code, _)| *code == EndsInFrame).count(), 1);
}

#[test]
fn an_object_that_is_dim_in_one_frame_stays_and_one_that_jumps_is_found_again() {
    let frames = |dim: f32| {
        sequence([SIDE; 3], 5, DAffine3::IDENTITY, move |t, p| {
            20.0 + if t == 2 { dim } else { 200.0 } * brightness(&[BALL], p)
        })
    };
    let v = size(BALL);
    let tracker = tracked(options(frames(45.0))).unwrap();
    assert_volumes(&tracker, &[v; 5]);
    assert!(told(&tracker).contains(&(UnevenBrightness, 2)));
    // The level between bright and dark is that of brighter frames.
    assert!(told(&tracked(options(frames(100.0))).unwrap()).contains(&(UnevenBrightness, 2)));
    assert_eq!(told(&tracked(options(frames(170.0))).unwrap()), []);
    let far = |x: f64| vec![Ball { center: DVec3::new(x, 9.5, 9.5), radius: 4.0 }];
    let tracker = tracked(options(balls(&[far(5.0), far(5.0), far(14.5), far(14.5)], 10.0))).unwrap();
    assert_volumes(&tracker, &[size(far(5.0)[0]); 4]);
    assert_eq!(told(&tracker), [(EndsInFrame, 2), (BeginsInFrame, 2)]);
    // The state keeps both.
    let mut again =
        SurfaceTracker::new(options(balls(&[far(5.0), far(5.0), far(14.5), far(14.5)], 10.0))).unwrap();
    again.restore(&tracker.save()).unwrap();
    assert_eq!((again.warnings(), again.save()), (tracker.warnings(), tracker.save()));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_restored_run_with_frames_without_the_object_continues_bit_for_bit() {
    let frames = [vec![], vec![BALL], vec![], vec![], vec![BALL]];
    let new = || SurfaceTracker::new(options(balls(&frames, 20.0))).unwrap();
    let whole = tracked(options(balls(&frames, 20.0))).unwrap();
    for before in 5..10 {
        let mut first = new();
        (0..before).for_each(|_| drop(first.step().unwrap()));
        let mut second = new();
        second.restore(&first.save()).unwrap();
        while !second.is_done() {
            second.step().unwrap();
        }
        assert!(second.meshes() == whole.meshes() && second.warnings() == whole.warnings(), "{before}");
        assert!(second.save() == whole.save(), "{before}");
    }
}

#[test]
fn a_start_without_an_object_ends_and_nothing_else_takes_its_place() {
    let start = Mesh::icosphere(Vec3::splat(4.0), 2.0, 1.0).unwrap().to_triangles();
    let other = Ball { center: DVec3::splat(14.0), radius: 4.0 };
    let volume = balls(&[vec![other], vec![other]], 10.0);
    let tracker = tracked(TrackingOptions { start: Some(start), ..options(volume) }).unwrap();
    assert_volumes(&tracker, &[0.0, 0.0]);
    assert_eq!(told(&tracker), [(EndsInFrame, 0)]);
}

/// Returns whether a volume with voxels of the given values in a ball, and others around it, gives the ball's volume.
fn assert_ball(name: &str, inside: f32, outside: f32) {
    let volume = sequence([SIDE; 3], 3, DAffine3::IDENTITY, |_, p| {
        if p.distance(BALL.center) < BALL.radius { inside } else { outside }
    });
    let tracker = tracked(options(volume)).unwrap();
    println!("{name}");
    assert_volumes(&tracker, &[size(BALL); 3]);
    assert_eq!(told(&tracker), []);
}

#[test]
fn voxels_that_are_not_numbers_are_outside() {
    assert_ball("NaN around it", 100.0, f32::NAN);
    assert_ball("negative infinity around it", 100.0, f32::NEG_INFINITY);
    assert_ball("infinity inside", f32::INFINITY, 5.0);
    let mut random = Random(3);
    let v = size(BALL);
    // Noise inside, and NaN around it; a blurred ball with NaN beyond its rim; NaN far from it in a dark background.
    for reach in [0.0, 0.5, 2.0] {
        let volume = sequence([SIDE; 3], 3, DAffine3::IDENTITY, |_, p| {
            let depth = BALL.radius - p.distance(BALL.center);
            let value = 200.0 * if reach > 0.0 { brightness(&[BALL], p) } else { 1.0 };
            if depth > -reach { value + random.within(0.0, 8.0) as f32 } else { f32::NAN }
        });
        let tracker = tracked(options(volume)).unwrap();
        if reach == 0.5 {
            // There are no voxels that show how dark it is outside.
            assert_eq!(tracker.volumes().len(), 3);
            assert!(
                tracker.volumes().iter().all(|found| (found / v - 1.0).abs() < 0.04),
                "{:?}",
                tracker.volumes()
            );
        } else {
            assert_volumes(&tracker, &[v; 3]);
        }
    }
    // A frame without values, or of one value, has no object, and leaves the others as they are.
    for blank in [f32::NAN, 0.0, 90.0, 300.0] {
        let volume = sequence([SIDE; 3], 4, DAffine3::IDENTITY, |t, p| {
            if t == 1 {
                blank
            } else {
                60.0 + 200.0 * brightness(&[BALL], p) + random.within(0.0, 20.0) as f32
            }
        });
        let tracker = tracked(options(volume)).unwrap();
        assert_volumes(&tracker, &[v, 0.0, v, v]);
        assert_eq!(told(&tracker), [(EndsInFrame, 1), (BeginsInFrame, 2)]);
    }
}

#[test]
fn a_field_of_view_beyond_which_there_are_no_values_is_no_boundary() {
    let mut random = Random(8);
    for fill in [f32::NAN, -2000.0, -32768.0, -1.0e10, 1.0e20] {
        let volume = sequence([SIDE; 3], 3, DAffine3::IDENTITY, |_, p| {
            let value = 20.0 + 130.0 * brightness(&[BALL], p) + random.within(0.0, 10.0) as f32;
            if p.distance(BALL.center) > 9.0 { fill } else { value }
        });
        println!("{fill}");
        let query = Query::Point { at: BALL.center, frame: 1 };
        let proposal = SurfaceTracker::propose(&volume, query).unwrap();
        assert!((50.0..120.0).contains(&proposal.threshold), "{}", proposal.threshold);
        let tracker = tracked(options(volume)).unwrap();
        assert_volumes(&tracker, &[size(BALL); 3]);
        assert_eq!(told(&tracker), []);
    }
}

#[test]
fn a_volume_too_thin_for_a_surface_is_refused_along_every_axis() {
    let slab = |axis: usize, count: usize, side: f64| {
        let mut dims = [24; 3];
        dims[axis] = count;
        let mut spacing = DVec3::ONE;
        spacing[axis] = side;
        sequence(dims, 2, DAffine3::from_scale(spacing), |_, p| {
            let mut at = p - 11.5;
            at[axis] = 0.0;
            200.0 * (8.5 - at.length()).clamp(0.0, 1.0) as f32
        })
    };
    for axis in 0..3 {
        for (count, side) in [(1, 1.0), (1, 4.0), (2, 1.0), (2, 1.4)] {
            let refused = SurfaceTracker::new(options(slab(axis, count, side)));
            let Err(MethodError::InvalidArgument { parameter, problem }) = refused else {
                panic!("{axis} {count}")
            };
            assert!(
                parameter == "volume" && problem.contains("at least 5 voxels along two axes"),
                "{problem}"
            );
            // A part of a thicker one, too.
            let mut ends = [[0; 3], slab(axis, 12, side).dims().map(|n| n - 1)];
            (ends[0][axis], ends[1][axis]) = (5, 4 + count);
            let bounds = Some(Bounds::Voxels(ends));
            let refused = SurfaceTracker::new(TrackingOptions { bounds, ..options(slab(axis, 12, side)) });
            let Err(MethodError::InvalidArgument { parameter: "voxels", .. }) = refused else { panic!() };
        }
        for (count, side) in [(2, 3.0), (3, 1.0), (5, 1.0)] {
            let tracker = tracked(options(slab(axis, count, side))).unwrap();
            let expected = PI * 64.0 * count as f64 * side;
            let found = tracker.volumes();
            println!("{axis} {count} of {side}: {found:?} instead of {expected}");
            assert!(found.iter().all(|v| (v - expected).abs() < 0.04 * expected), "{axis} {count} {found:?}");
        }
    }
}

/// A sequence of random ellipsoids that is tracked at any scale and offset.
struct Scene {
    dims: [usize; 3],
    frames: usize,
    spacing: DVec3,
    turn: DAffine3,
    center: DVec3,
    radii: DVec3,
    speed: DVec3,
    noise: f64,
    seed: u64,
    has_box: bool,
    names_point: bool,
    has_start: bool,
    params: TrackingParams,
}

impl Scene {
    fn new(random: &mut Random) -> Self {
        let dims = [0; 3].map(|_| 12 + random.below(4));
        let middle = DVec3::from(dims.map(|n| n as f64)) / 2.0 - 0.5;
        let mut any = |low: f64, high: f64| DVec3::from([0; 3].map(|_| random.within(low, high)));
        let (radii, center) = (any(3.8, 4.6), middle + any(-0.4, 0.4));
        let (speed, spacing) = (any(-0.4, 0.4), any(0.8, 1.25));
        let turn = DAffine3::from_rotation_z(random.within(-3.0, 3.0))
            * DAffine3::from_rotation_x(random.within(-3.0, 3.0));
        let params = TrackingParams {
            radius: if random.below(3) == 0 { random.within(2.2, 3.0) } else { 0.0 },
            time_scale: if random.below(3) == 0 { random.within(1.0, 4.0) } else { 0.0 },
            window_frames: random.below(3) as u32,
            cyclic: random.below(2) == 0,
            ..TrackingParams::default()
        };
        Self {
            dims,
            frames: 2 + random.below(2),
            spacing,
            turn: if random.below(2) == 0 { turn } else { DAffine3::IDENTITY },
            center,
            radii,
            speed,
            noise: random.within(0.0, 20.0),
            seed: random.next(),
            has_box: random.below(3) == 0,
            names_point: random.below(3) == 0,
            has_start: random.below(4) == 0,
            params,
        }
    }

    /// Tracks the scene at a scale and an offset, and returns the volumes in units of the scene; `start` is a surface of
    /// the first frame in its space.
    fn volumes(
        &self,
        scale: f64,
        offset: DVec3,
        start: Option<&TriangleMesh>,
    ) -> Result<Vec<f64>, MethodError> {
        let map = self.turn * DAffine3::from_scale(self.spacing);
        let placed = DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(scale));
        let mut random = Random(self.seed);
        let volume = try_sequence(self.dims, self.frames, placed * map, |t, p| {
            let away = (p - self.center - self.speed * t as f64) / self.radii;
            let depth = (1.0 - away.length()) * self.radii.min_element();
            (40.0 + 150.0 * (depth + 0.5).clamp(0.0, 1.0) + random.within(0.0, self.noise)) as f32
        })?;
        let point = placed.transform_point3(map.transform_point3(self.center));
        let half = DVec3::splat(scale * 9.3);
        let mut params = self.params.clone();
        (params.radius, params.time_scale) = (params.radius * scale, params.time_scale * scale);
        let start = start.map(|mesh| {
            let positions = mesh.positions.iter().map(|p| (p.as_dvec3() * scale).as_vec3()).collect();
            TriangleMesh { positions, origin: offset, ..mesh.clone() }
        });
        let tracker = tracked(TrackingOptions {
            volume,
            bounds: self.has_box.then_some(Bounds::World([point - half, point + half])),
            component: if self.names_point { Component::Nearest(point) } else { Component::Largest },
            start,
            cavity: Cavity::Open,
            limits: TrackingLimits::default(),
            params,
        })?;
        for mesh in tracker.meshes() {
            assert_eq!((measure(mesh).components, count_self_intersections(mesh)), (1, 0));
            let center =
                mesh.positions.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / mesh.positions.len() as f64;
            let off = (center + (mesh.origin - point)).length() / scale;
            assert!(off < 3.0, "{off} from where it is");
        }
        // A state can be restored in any unit.
        let mut again = tracker.clone();
        again.restore(&tracker.save()).unwrap();
        assert_eq!(again.volumes(), tracker.volumes());
        let again = again.set_params(tracker.params().clone());
        assert!(again.is_ok(), "{again:?}");
        Ok(tracker.volumes().into_iter().map(|v| v / scale / scale / scale).collect())
    }

    fn start(&self) -> Option<TriangleMesh> {
        let map = self.turn * DAffine3::from_scale(self.spacing);
        let ball = Mesh::icosphere(Vec3::ZERO, 1.0, 0.35).unwrap().to_triangles();
        let to_scene =
            map * DAffine3::from_translation(self.center) * DAffine3::from_scale(self.radii * 0.95);
        self.has_start.then(|| ball.transformed(&to_scene))
    }
}

/// Tracks random scenes at random scales and offsets, and counts which are right, and why others are refused. Coordinates
/// are rounded otherwise than near the origin, so that now and then another edge is flipped or collapsed, by which
/// a volume differs by some thousandths.
fn track_anywhere(count: u64) {
    let (mut right, mut near, mut refused, mut all) = (0, 0, BTreeMap::<String, usize>::new(), 0);
    for seed in seeds(count) {
        let named = Named::new(seed);
        let random = &mut Random(seed);
        let scene = Scene::new(random);
        let start = scene.start();
        let scale = libm::pow(10.0, random.within(-12.0, 12.0));
        let far = libm::pow(10.0, random.within(-1.0, 8.0)) * 10.0 * scale;
        let offset = DVec3::from([0; 3].map(|_| random.within(-1.0, 1.0))) * far;
        let expected = scene.volumes(1.0, DVec3::ZERO, start.as_ref()).unwrap();
        all += 1;
        match scene.volumes(scale, offset, start.as_ref()) {
            Ok(found) => {
                let off = found.iter().zip(&expected).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
                right += usize::from(off < 1e-3);
                near += usize::from((1e-3..1e-2).contains(&off));
                if off >= 1e-3 {
                    println!("seed {seed}: {found:?} instead of {expected:?} at {scale:.1e}, {offset}");
                }
            }
            Err(error) => *refused.entry(error.to_string()).or_default() += 1,
        }
        drop(named);
    }
    println!("{right} of {all} right, {near} within 1 %; refused: {refused:?}");
    let others = refused.values().sum::<usize>();
    assert!(right + near + others == all, "{right} right, {near} near and {others} refused of {all}");
    assert_at_least(count as usize * 99 / 100, right, "right");
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn sequences_are_tracked_alike_in_any_unit_and_anywhere() {
    track_anywhere(6);
}

#[test]
#[ignore = "long: npm run test:all"]
fn a_thousand_sequences_are_tracked_alike_in_any_unit_and_anywhere() {
    track_anywhere(1000);
}

#[test]
fn a_sequence_far_from_the_origin_is_tracked_relative_to_it() {
    let offset = DVec3::new(2e6, 2e6, 0.0);
    let placed = |offset: DVec3| {
        let affine = DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(0.1));
        tracked(options(sequence([SIDE; 3], 3, affine, |_, p| 200.0 * brightness(&[BALL], p)))).unwrap()
    };
    let (near, far) = (placed(DVec3::ZERO), placed(offset));
    assert_eq!(near.origin(), DVec3::ZERO);
    for (a, b) in near.volumes().into_iter().zip(far.volumes()) {
        assert!((a / b - 1.0).abs() < 1e-4 && (a - 0.905).abs() < 0.009, "{a} {b}");
    }
    for mesh in far.meshes() {
        let center = mesh.origin + measure(&TriangleMesh { origin: DVec3::ZERO, ..mesh.clone() }).centroid;
        assert!(center.distance(offset + 0.95) < 0.01, "{center}");
    }
    assert!(far.mesh().origin() == far.origin() && far.meshes()[0].origin == far.origin());
    let [x, y, z, ..] = far.boundary(0)[0];
    assert!(DVec3::new(x.into(), y.into(), z.into()).distance(offset + 0.95 - far.origin()) < 1.0);
}

/// Windows reach five voxels. Beyond, a ball dragged a tail behind it, or crumpled to ever more triangles: a frame took
/// minutes.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn what_moves_further_than_windows_reach_is_found_again_and_told() {
    for (step, is_told) in [(3, false), (5, true), (8, true)] {
        let at = |t: usize| Ball { center: DVec3::new(12.0 + (step * t) as f64, 13.5, 13.5), radius: 8.0 };
        let value = |t: usize, p: DVec3| 200.0 * brightness(&[at(t)], p);
        let volume = sequence([26 + 2 * step, 28, 28], 3, DAffine3::IDENTITY, value);
        assert_sizes(volume, &[size(at(0)); 3], is_told);
    }
    for (change, is_told) in [(-4.0, true), (-3.0, false), (4.0, true)] {
        let radius =
            |t: usize| if change > 0.0 { 6.0 + change * t as f64 } else { 6.0 - change * (2 - t) as f64 };
        let ball = |t: usize| Ball { center: DVec3::splat(18.5), radius: radius(t) };
        let value = |t: usize, p: DVec3| 200.0 * brightness(&[ball(t)], p);
        let volume = sequence([38; 3], 3, DAffine3::IDENTITY, value);
        assert_sizes(volume, &[0, 1, 2].map(|t| size(ball(t))), is_told);
    }
}

/// Asserts that a sequence has an object of the `expected` sizes, and that warnings tell of it in each frame after the
/// first, or in none.
fn assert_sizes(volume: Volume, expected: &[f64], is_told: bool) {
    let tracker = tracked(options(volume)).unwrap();
    let ratios: Vec<f64> = tracker.volumes().iter().zip(expected).map(|(found, size)| found / size).collect();
    println!("{ratios:.3?} {:?}", told(&tracker));
    assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.025), "{ratios:?}");
    let all = (1..expected.len() as u32).flat_map(|t| [(EndsInFrame, t), (BeginsInFrame, t)]);
    assert_eq!(told(&tracker), if is_told { all.collect() } else { vec![] });
}
