//! Options proposed from one point or from nothing, closed cavities, steps in slices, and warnings about the result.

use super::common::Random;
use std::f64::consts::{PI, TAU};
use vesicle::math::{DAffine3, DVec3};
use vesicle::mesh::{count_self_intersections, measure};
use vesicle::methods::MethodError;
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, Proposal, Query, SurfaceTracker, TrackingLimits, TrackingOptions,
    TrackingParams,
};
use vesicle::pauses::{advance, finished};
use vesicle::volume::{Enrichment, Volume, VolumeInit, Voxels};
use vesicle::warning::{Place, Warning, WarningCode};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const DIMS: [usize; 3] = [62, 54, 14];
const SPACING: DVec3 = DVec3::new(1.0, 1.0, 4.0);
const FRAMES: usize = 6;

/// Intensities of the ball, of what is around it, and of a wall that does not move.
const BALL: f64 = 170.0;
const AROUND: f64 = 60.0;
const WALL: f64 = 240.0;

/// A ball that breathes, with a dark pillar through it, beside a bright wall, in noise; in voxels of 1 × 1 × 4.
struct Scene {
    affine: DAffine3,
    radii: [f64; FRAMES],
    pillar: f64,
    noise: f64,
    /// Intensity of a wall around the ball, seven units thick.
    muscle: f64,
}

impl Scene {
    fn new() -> Self {
        let turn = DAffine3::from_rotation_z(0.7) * DAffine3::from_rotation_x(-1.1);
        Self {
            affine: DAffine3::from_translation(DVec3::new(30.0, -80.0, 12.0))
                * turn
                * DAffine3::from_scale(SPACING),
            radii: std::array::from_fn(|t| 17.5 + 2.5 * libm::cos(TAU * t as f64 / FRAMES as f64)),
            pillar: 4.0,
            noise: 8.0,
            muscle: AROUND,
        }
    }

    /// Returns the centre of the ball in a frame, from the first voxel on.
    fn center(t: usize) -> DVec3 {
        DVec3::new(34.0 + 0.5 * t as f64, 26.3, 26.0)
    }

    /// Returns the intensity at a point from the first voxel on.
    fn value(&self, t: usize, p: DVec3) -> f64 {
        let from_axis = libm::hypot(p.x - Self::center(t).x - 6.0, p.y - Self::center(t).y - 3.0);
        match () {
            () if p.x < 4.0 => WALL,
            () if p.distance(Self::center(t)) < self.radii[t] && from_axis > self.pillar => BALL,
            () if p.distance(Self::center(t)) < self.radii[t] + 7.0 => self.muscle,
            () => AROUND,
        }
    }

    fn volume(&self) -> Volume {
        let mut random = Random(11);
        let [nx, ny, nz] = DIMS;
        let mut values = Vec::new();
        for t in 0..FRAMES {
            for i in 0..nx * ny * nz {
                let at = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64);
                let parts = (0..16).map(|k| {
                    let part = DVec3::new(
                        f64::from(k % 2) * 0.5,
                        f64::from(k / 2 % 2) * 0.5,
                        f64::from(k / 4) / 4.0,
                    );
                    let offset = part - DVec3::new(0.25, 0.25, 0.375);
                    self.value(t, (at + offset) * SPACING)
                });
                // Noise that is nearly normal.
                let noise: f64 = (0..6).map(|_| random.within(-1.4, 1.4)).sum::<f64>() * 0.5;
                values.push((parts.sum::<f64>() / 16.0 + self.noise * noise) as f32);
            }
        }
        let init = VolumeInit::new(Voxels::F32(values), [nx, ny, nz, FRAMES]);
        Volume::new(VolumeInit { affine: self.affine, ..init }).unwrap()
    }

    /// Returns a point in world space, given from the first voxel on.
    fn world(&self, p: DVec3) -> DVec3 {
        self.affine.transform_point3(p / SPACING)
    }

    fn truth(&self, t: usize) -> f64 {
        let radius = self.radii[t];
        4.0 / 3.0 * PI * radius * radius * radius
    }

    /// Asserts that the box of a proposal holds the ball in all frames, with a margin, but not the wall.
    fn assert_fits(&self, proposal: &Proposal) {
        let [low, high] = proposal.bounds.map(|at| DVec3::from(at.map(|i| i as f64)) * SPACING);
        for t in 0..FRAMES {
            let reach = DVec3::splat(self.radii[t] + 2.0);
            let [least, most] = [Self::center(t) - reach, Self::center(t) + reach];
            let last = DVec3::from(DIMS.map(|n| (n - 1) as f64)) * SPACING;
            assert!(low.cmple(least.max(DVec3::ZERO)).all(), "{t} {low} {least}");
            assert!(high.cmpge(most.min(last)).all(), "{t} {high} {most}");
        }
        assert!(low.x >= 4.0, "{low}");
        let step = BALL - AROUND;
        assert!((0.3 * step..0.7 * step).contains(&proposal.threshold), "{}", proposal.threshold);
        let p = self.affine.inverse().transform_point3(proposal.component) * SPACING;
        assert!(p.distance(Self::center(proposal.frame)) < self.radii[proposal.frame], "{p}");
    }
}

fn options(volume: Volume, proposal: &Proposal, cavity: Cavity) -> TrackingOptions {
    TrackingOptions {
        volume,
        bounds: Some(Bounds::Voxels(proposal.bounds)),
        component: Component::Nearest(proposal.component),
        start: None,
        cavity,
        limits: TrackingLimits::default(),
        params: TrackingParams { threshold: proposal.threshold, cyclic: true, ..TrackingParams::default() },
    }
}

fn tracked(options: TrackingOptions) -> SurfaceTracker {
    let mut tracker = SurfaceTracker::new(options).unwrap();
    while !tracker.is_done() {
        tracker.step().unwrap();
    }
    tracker
}

fn ejected(volumes: &[f64]) -> f64 {
    let [low, high] = volumes.iter().fold([f64::MAX, 0.0], |[low, high], &v| [low.min(v), high.max(v)]);
    1.0 - low / high
}

fn codes(tracker: &SurfaceTracker) -> Vec<WarningCode> {
    tracker.warnings().into_iter().map(|warning| warning.code).collect()
}

#[test]
fn a_point_a_box_or_nothing_is_enough_for_a_proposal() {
    let scene = Scene::new();
    let volume = scene.volume();
    for frame in [0, 3] {
        // Off the middle, on the other side of the pillar.
        let at = scene.world(Scene::center(frame) - DVec3::new(3.0, 2.0, 3.0));
        scene.assert_fits(&SurfaceTracker::propose(&volume, Query::Point { at, frame }).unwrap());
    }
    scene.assert_fits(&SurfaceTracker::propose(&volume, Query::Moving).unwrap());
    let reach = 40.0;
    let center = scene.world(Scene::center(0));
    let corners = [center - reach, center + reach];
    scene.assert_fits(&SurfaceTracker::propose(&volume, Query::Box(corners)).unwrap());
}

/// As around the blood of a heart: the step from muscle to lung is nearly as high as that from blood to muscle.
#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn the_edge_of_what_is_around_an_object_is_not_its_own() {
    let radii = [15.0, 14.0, 12.0, 11.0, 12.0, 14.0];
    let scene = Scene { muscle: 105.0, radii, pillar: 0.0, ..Scene::new() };
    let volume = scene.volume().enrich_slices(None, Enrichment::Flow).unwrap();
    let query = Query::Point { at: scene.world(Scene::center(0)), frame: 0 };
    let proposal = SurfaceTracker::propose(&volume, query).unwrap();
    let tracker = tracked(options(volume, &proposal, Cavity::Closed));
    let truths: Vec<f64> = (0..FRAMES).map(|t| scene.truth(t)).collect();
    println!("{} {:.0?} {truths:.0?}", proposal.threshold, tracker.volumes());
    for (t, found) in tracker.volumes().iter().enumerate() {
        assert!((found / truths[t] - 1.0).abs() < 0.1, "{t} {found} {}", truths[t]);
    }
}

/// As in CT, where lung is much darker than muscle: a threshold above that step would lose the object.
#[test]
fn steps_around_an_object_that_are_higher_than_its_own_do_not_raise_the_threshold() {
    let scene =
        Scene { muscle: 130.0, pillar: 0.0, radii: [15.0, 14.0, 12.0, 11.0, 12.0, 14.0], ..Scene::new() };
    let query = Query::Point { at: scene.world(Scene::center(0)), frame: 0 };
    let proposal = SurfaceTracker::propose(&scene.volume(), query).unwrap();
    let step = BALL - scene.muscle;
    assert!((0.3 * step..0.62 * step).contains(&proposal.threshold), "{}", proposal.threshold);
}

#[test]
fn a_proposed_box_lies_within_a_given_one() {
    let scene = Scene { affine: DAffine3::from_scale(SPACING), ..Scene::new() };
    let corners = [DVec3::new(8.0, 3.0, 8.0), DVec3::new(60.0, 52.0, 26.0)];
    let proposal = SurfaceTracker::propose(&scene.volume(), Query::Box(corners)).unwrap();
    let [low, high] = proposal.bounds;
    assert!(low[0] >= 8 && low[2] >= 2 && high[1] <= 52 && high[2] == 6, "{low:?} {high:?}");
}

#[test]
fn where_nothing_can_be_proposed_the_error_says_why() {
    let scene = Scene::new();
    let volume = scene.volume();
    let refusal = |volume: &Volume, query: Query| match SurfaceTracker::propose(volume, query) {
        Err(MethodError::InvalidArgument { parameter, problem }) => (parameter, problem),
        other => panic!("{other:?}"),
    };
    let point = |p: DVec3, frame: usize| Query::Point { at: scene.world(p), frame };
    let dark = refusal(&volume, point(DVec3::new(12.0, 46.0, 24.0), 0));
    assert!(dark.0 == "point" && dark.1.contains("not in a bright object"), "{dark:?}");
    let outside = refusal(&volume, point(DVec3::new(-9.0, 20.0, 24.0), 0));
    assert!(outside.0 == "point" && outside.1.contains("outside"), "{outside:?}");
    assert_eq!(refusal(&volume, Query::Point { at: DVec3::NAN, frame: 0 }).0, "point");
    assert_eq!(refusal(&volume, point(Scene::center(0), FRAMES)).0, "frame");
    let far = DVec3::splat(1e4);
    assert_eq!(refusal(&volume, Query::Box([far, far + 5.0])).0, "box");
    let still = Scene { radii: [16.0; FRAMES], pillar: 0.0, ..Scene::new() };
    let frame = still.volume().frame(0).unwrap();
    assert_eq!(refusal(&frame, Query::Moving).0, "volume");
    let two = Volume::from_frames(&[frame.clone(), frame], None).unwrap();
    let unmoved = refusal(&two, Query::Moving);
    assert!(unmoved.0 == "volume" && unmoved.1.contains("moves"), "{unmoved:?}");
}

/// Bright tissue all around, with dark columns in it.
#[test]
fn what_goes_on_through_the_image_is_refused() {
    let dims = [48_usize, 48, 20];
    let value = |i: usize| {
        let [x, y] = [i % dims[0], i / dims[0] % dims[1]].map(|n| (n % 16) as f64 - 8.0);
        if libm::hypot(x, y) < 4.5 { 20.0 } else { 200.0 }
    };
    let frame: Vec<f32> = (0..dims.iter().product()).map(|i| value(i) as f32).collect();
    let init = VolumeInit::new(Voxels::F32([frame.clone(), frame].concat()), [48, 48, 20, 2]);
    let volume = Volume::new(init).unwrap();
    let query = Query::Point { at: DVec3::new(16.0, 16.0, 10.0), frame: 0 };
    let refusal = SurfaceTracker::propose(&volume, query).unwrap_err();
    let MethodError::InvalidArgument { parameter, problem } = refusal else { panic!("{refusal:?}") };
    assert!(parameter == "point" && problem.contains("most of the image"), "{problem}");
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_closed_cavity_has_the_volume_of_the_ball_and_an_open_one_a_hole() {
    let scene = Scene::new();
    // Slices four pixels apart are as they should be given to the tracker.
    let volume = scene.volume().enrich_slices(None, Enrichment::Flow).unwrap();
    let at = scene.world(Scene::center(0) - DVec3::new(3.0, 2.0, 0.0));
    let proposal = SurfaceTracker::propose(&volume, Query::Point { at, frame: 0 }).unwrap();
    let closed = tracked(options(volume.clone(), &proposal, Cavity::Closed));
    let open = through_all_frames(options(volume, &proposal, Cavity::Open));
    let truths: Vec<f64> = (0..FRAMES).map(|t| scene.truth(t)).collect();
    println!("{:.0?} closed, {:.0?} open, {truths:.0?}", closed.volumes(), open.volumes());
    for (t, mesh) in closed.meshes().iter().enumerate() {
        let found = measure(mesh);
        assert_eq!((found.euler, found.components, count_self_intersections(mesh)), (2, 1, 0), "{t}");
        assert!((found.volume / truths[t] - 1.0).abs() < 0.05, "{t} {} {}", found.volume, truths[t]);
        // The pillar, of which windows of five voxels see a part.
        let pillar = PI * scene.pillar * scene.pillar * 2.0 * scene.radii[t];
        let missing = found.volume - open.volumes()[t];
        assert!((0.3 * pillar..1.3 * pillar).contains(&missing), "{t} {missing} {pillar}");
    }
    let off = ejected(&closed.volumes()) - ejected(&truths);
    // Volumes of a contracted ball in slices a quarter of its radius thick are 4 % too small, closed or open.
    assert!(off.abs() < 0.03, "{off}");
    assert!(codes(&open).contains(&WarningCode::Handles), "{:?}", codes(&open));
    assert_eq!(codes(&closed), []);
}

/// Returns a tracker that has been through all frames once, without the fits to space-time, which take longest.
fn through_all_frames(options: TrackingOptions) -> SurfaceTracker {
    let mut tracker = SurfaceTracker::new(options).unwrap();
    while tracker.volumes().len() < FRAMES {
        tracker.step().unwrap();
    }
    tracker
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn an_object_without_furrows_is_the_same_closed_and_open() {
    let scene = Scene { pillar: 0.0, ..Scene::new() };
    let volume = scene.volume();
    let proposal = SurfaceTracker::propose(&volume, Query::Moving).unwrap();
    let [closed, open] = [Cavity::Closed, Cavity::Open]
        .map(|cavity| through_all_frames(options(volume.clone(), &proposal, cavity)).volumes());
    for (a, b) in closed.iter().zip(&open) {
        assert!((a / b - 1.0).abs() < 0.01, "{closed:?} {open:?}");
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn states_of_closed_cavities_continue_and_those_of_open_ones_are_others() {
    let scene = Scene::new();
    let volume = scene.volume();
    let proposal = SurfaceTracker::propose(&volume, Query::Moving).unwrap();
    let new = |cavity| SurfaceTracker::new(options(volume.clone(), &proposal, cavity)).unwrap();
    let mut whole = new(Cavity::Closed);
    for _ in 0..FRAMES + 3 {
        whole.step().unwrap();
    }
    for steps in [1, FRAMES + 1] {
        let mut first = new(Cavity::Closed);
        (0..steps).for_each(|_| drop(first.step().unwrap()));
        let state = first.save();
        assert!(matches!(new(Cavity::Open).restore(&state), Err(MethodError::BadState { .. })));
        let mut second = new(Cavity::Closed);
        // A run that has begun has filled voxels already.
        second.step().unwrap();
        second.restore(&state).unwrap();
        (steps..FRAMES + 3).for_each(|_| drop(second.step().unwrap()));
        assert!(second.save() == whole.save(), "{steps}");
        let mut open = new(Cavity::Open);
        open.step().unwrap();
        assert!(matches!(second.restore(&open.save()), Err(MethodError::BadState { .. })));
    }
    // Other parameters of the boundary find the cavity again, in the image as it was.
    let mut again = new(Cavity::Closed);
    again.step().unwrap();
    again.set_params(TrackingParams { window: 1, ..again.params().clone() }).unwrap();
    again.set_params(TrackingParams { window: 2, ..again.params().clone() }).unwrap();
    (0..FRAMES + 3).for_each(|_| drop(again.step().unwrap()));
    assert!(again.meshes() == whole.meshes());
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn steps_in_slices_pause_often_and_can_be_discarded() {
    let scene = Scene::new();
    let volume = scene.volume();
    let proposal = SurfaceTracker::propose(&volume, Query::Moving).unwrap();
    let mut whole = SurfaceTracker::new(options(volume, &proposal, Cavity::Closed)).unwrap();
    let mut sliced = whole.clone();
    while !whole.is_done() {
        let before = sliced.save();
        for pauses in [1, 5] {
            let mut step = Box::pin(sliced.step_in_slices());
            for _ in 0..pauses {
                assert!(advance(&mut step).is_pending(), "the step ended after fewer than {pauses} pauses");
            }
            drop(step);
            sliced.discard_step();
        }
        if !sliced.meshes().is_empty() {
            assert!(sliced.save() == before);
        }
        let report = finished(sliced.step_in_slices()).unwrap();
        assert_eq!(report.phase, whole.step().unwrap().phase);
        assert!(sliced.save() == whole.save());
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_box_that_cuts_the_object_and_a_volume_that_jumps_are_told() {
    let mut scene = Scene { pillar: 0.0, ..Scene::new() };
    let volume = scene.volume();
    let proposal = SurfaceTracker::propose(&volume, Query::Moving).unwrap();
    let mut cut = options(volume, &proposal, Cavity::Open);
    let [low, mut high] = proposal.bounds;
    high[0] = 37;
    cut.bounds = Some(Bounds::Voxels([low, high]));
    let tracker = through_all_frames(cut);
    let warning = tracker.warnings().into_iter().find(|warning| warning.code == WarningCode::TouchesBox);
    assert_eq!(warning.map(|warning| warning.place), Some(Some(Place::Frame(0))));
    for frame in 0..tracker.frames() {
        let here = tracker.warnings_in(frame);
        let is_told = |warning: &Warning| warning.code == WarningCode::TouchesBox;
        assert!(here.iter().any(is_told), "{frame}: {here:?}");
        assert!(here.iter().all(|warning| warning.place == Some(Place::Frame(frame as u32))), "{here:?}");
    }
    scene.radii = [18.0, 18.0, 18.0, 13.5, 18.0, 18.0];
    let volume = scene.volume();
    let tracker = through_all_frames(options(volume, &proposal, Cavity::Open));
    println!("{:.0?}", tracker.volumes());
    let jumps = tracker.warnings().into_iter().filter(|warning| warning.code == WarningCode::VolumeJump);
    assert_eq!(jumps.map(|warning| warning.place).collect::<Vec<_>>(), [Some(Place::Frame(3))]);
}

/// Returns a sequence of bright balls, given by frame as centres and radii.
fn balls(dims: [usize; 3], frames: &[Vec<(DVec3, f64)>]) -> Volume {
    let mut random = Random(5);
    let mut values = Vec::new();
    for balls in frames {
        for i in 0..dims.iter().product() {
            let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let p = DVec3::from(at.map(|k| k as f64));
            let inside =
                balls.iter().map(|(centre, radius)| radius - p.distance(*centre)).fold(f64::MIN, f64::max);
            let noise: f64 = (0..6).map(|_| random.within(-1.0, 1.0)).sum::<f64>() * 4.0;
            values.push((40.0 + 110.0 * (inside + 0.5).clamp(0.0, 1.0) + noise) as f32);
        }
    }
    Volume::new(VolumeInit::new(Voxels::F32(values), [dims[0], dims[1], dims[2], frames.len()])).unwrap()
}

/// Tracks the ball at x through six frames of balls.
fn followed(dims: [usize; 3], x: f64, frame: impl Fn(f64) -> Vec<(DVec3, f64)>) -> SurfaceTracker {
    let frames: Vec<_> = (0..6).map(|t| frame(f64::from(t))).collect();
    tracked(TrackingOptions {
        volume: balls(dims, &frames),
        bounds: None,
        component: Component::Nearest(DVec3::new(x, 16.0, 14.0)),
        start: None,
        cavity: Cavity::Open,
        limits: TrackingLimits::default(),
        params: TrackingParams::default(),
    })
}

/// Both halves are tracked, and joined by a thread.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn an_object_that_divides_within_its_surface_is_told() {
    let cells = |apart: &dyn Fn(f64) -> f64| {
        let pair = |t: f64| [-1.0, 1.0].map(|side| (DVec3::new(24.0 + side * apart(t), 16.0, 14.0), 7.0));
        followed([48, 32, 28], 20.0, |t| pair(t).to_vec())
    };
    let dividing = cells(&|t| 2.0 + 2.2 * t);
    let warnings = dividing.warnings();
    let told = warnings.iter().find(|one| one.code == WarningCode::Parts).unwrap();
    // The gap is .4 voxels wide in the third frame, and 4.8 in the fourth.
    assert!(matches!(told.place, Some(Place::Frame(2..=4))), "{told:?}");
    assert_eq!(measure(dividing.meshes().last().unwrap()).components, 1);
    // Two that stay together are one.
    assert!(!codes(&cells(&|t| 4.0 + 0.3 * t)).contains(&WarningCode::Parts));
}

/// The surface takes in a part of the other ball, and nothing else shows it: its volume grows by a fiftieth.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn an_object_that_another_touches_is_told() {
    let beside = |x: f64| {
        move |t: f64| vec![(DVec3::new(14.0 + 0.8 * t, 16.0, 14.0), 9.0), (DVec3::new(x, 16.0, 14.0), 5.0)]
    };
    let touched = followed([48, 32, 28], 14.0, beside(31.0));
    println!("{:.0?}", touched.volumes());
    let warnings = touched.warnings();
    // The gap is a voxel wide in the third frame, and closed in the fifth.
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert_eq!(warnings[0].code, WarningCode::Parts);
    assert!(matches!(warnings[0].place, Some(Place::Frame(2..=4))), "{warnings:?}");
    // One that comes in a leap of its radius and overlaps it, most of which has left its place.
    let leaping = |t: f64| {
        let x = if t < 2.0 { 34.0 - 4.0 * t } else { 25.0 };
        vec![(DVec3::new(14.0, 16.0, 14.0), 8.0), (DVec3::new(x, 16.0, 14.0), 5.0)]
    };
    assert!(codes(&followed([48, 32, 28], 14.0, leaping)).contains(&WarningCode::Parts));
    // One that it only comes near is none, nor one that goes ahead of it at the same speed.
    assert_eq!(codes(&followed([48, 32, 28], 14.0, beside(34.0))), []);
    let ahead = |t: f64| {
        vec![(DVec3::new(10.0 + 2.0 * t, 16.0, 14.0), 7.0), (DVec3::new(28.0 + 2.0 * t, 16.0, 14.0), 7.0)]
    };
    assert_eq!(codes(&followed([56, 32, 28], 10.0, ahead)), []);
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_proposed_box_holds_an_object_that_moves_far() {
    for speed in [2.0, 3.0] {
        let at = |t: usize| DVec3::new(36.0 + speed * (t as f64 - 4.5), 16.0, 14.0);
        let frames: Vec<_> = (0..10).map(|t| vec![(at(t), 6.0)]).collect();
        let volume = balls([72, 32, 28], &frames);
        for query in
            [Query::Moving, Query::Point { at: at(0), frame: 0 }, Query::Point { at: at(5), frame: 5 }]
        {
            let [low, high] = SurfaceTracker::propose(&volume, query).unwrap().bounds;
            assert!(
                low[0] as f64 <= at(0).x - 9.0 && high[0] as f64 >= at(9).x + 9.0,
                "{query:?} {low:?} {high:?}"
            );
        }
    }
}

#[test]
fn a_state_of_another_cavity_is_refused_in_words() {
    let volume = balls([24, 24, 24], &[vec![(DVec3::splat(12.0), 6.0)], vec![(DVec3::splat(12.0), 6.5)]]);
    let [open, closed] = [Cavity::Open, Cavity::Closed].map(|cavity| {
        SurfaceTracker::new(TrackingOptions {
            volume: volume.clone(),
            bounds: None,
            component: Component::Largest,
            start: None,
            cavity,
            limits: TrackingLimits::default(),
            params: TrackingParams::default(),
        })
        .unwrap()
    });
    for (mut one, other) in [(open.clone(), closed.clone()), (closed, open)] {
        let failure = one.restore(&other.save());
        assert!(matches!(failure, Err(MethodError::BadState { field: "cavity", .. })), "{failure:?}");
    }
}
