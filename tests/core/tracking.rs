//! A surface tracked through a beating heart with known geometry.

use super::common::cine::Cine;
use vesicle::math::{DAffine3, DVec3, Vec3};
use vesicle::mesh::{Measures, MeshError, TriangleMesh, count_self_intersections, measure};
use vesicle::methods::MethodError;
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, SurfaceTracker, TrackingLimits, TrackingOptions, TrackingParams,
};
use vesicle::spatial::surface_distance;
use vesicle::volume::{Enrichment, Volume, VolumeInit, Voxels};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Edge threshold, between the step from blood to muscle and that from muscle to lung.
const THRESHOLD: f64 = 70.0;

fn options(cine: &Cine, volume: Volume) -> TrackingOptions {
    TrackingOptions {
        volume,
        bounds: Some(Bounds::World(cine.cavity_box())),
        component: Component::Largest,
        start: None,
        cavity: Cavity::Open,
        limits: TrackingLimits::default(),
        params: TrackingParams { threshold: THRESHOLD, cyclic: true, ..TrackingParams::default() },
    }
}

/// Returns options for a part of a beat, which is not cyclic.
fn open_ended(cine: &Cine) -> TrackingOptions {
    let mut options = options(cine, cine.volume());
    options.params.cyclic = false;
    options
}

fn tracked(options: TrackingOptions) -> SurfaceTracker {
    let mut tracker = SurfaceTracker::new(options).unwrap();
    while !tracker.is_done() {
        tracker.step().unwrap();
        assert!(tracker.mesh().check().is_ok());
    }
    tracker
}

/// Returns the mean distance from the truth in every frame.
fn errors(cine: &Cine, meshes: &[TriangleMesh]) -> Vec<f64> {
    let one = |(frame, mesh): (usize, &TriangleMesh)| {
        surface_distance(mesh, &cine.truth(frame as f64, 0.8)).unwrap().mean
    };
    meshes.iter().enumerate().map(one).collect()
}

/// Asserts that the area of every frame is within 5 % of the truth (10 % in the frames `hard`), and the ejection
/// fraction, from the largest to the smallest volume, within 2 percentage points.
fn assert_area_and_ejection(cine: &Cine, tracker: &SurfaceTracker, hard: &[usize]) {
    let truths: Vec<Measures> =
        (0..cine.frames).map(|frame| measure(&cine.truth(frame as f64, 0.7))).collect();
    let ratios = tracker.meshes().iter().zip(&truths).map(|(mesh, truth)| measure(mesh).area / truth.area);
    let ratios: Vec<f64> = ratios.collect();
    let ejected = |volumes: Vec<f64>| {
        let [low, high] = volumes.iter().fold([f64::MAX, 0.0], |[low, high], &v| [low.min(v), high.max(v)]);
        1.0 - low / high
    };
    let found = ejected(tracker.meshes().iter().map(|mesh| measure(mesh).volume).collect());
    let truth = ejected(truths.iter().map(|truth| truth.volume).collect());
    println!("areas {ratios:.3?} of the truth, ejection fraction {found:.4} instead of {truth:.4}");
    assert_eq!(ratios.len(), cine.frames);
    for (frame, ratio) in ratios.iter().enumerate() {
        let allowed = if hard.contains(&frame) { 0.1 } else { 0.05 };
        assert!((ratio - 1.0).abs() <= allowed, "{frame} {ratio}");
    }
    assert!((found - truth).abs() <= 0.02, "{found} {truth}");
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_beating_ball_is_tracked_through_all_frames_without_self_intersections() {
    let cine = Cine::small();
    let tracker = tracked(options(&cine, cine.volume()));
    assert_eq!(tracker.meshes().len(), cine.frames);
    for (frame, mesh) in tracker.meshes().iter().enumerate() {
        let found = measure(mesh);
        assert_eq!((found.euler, found.components, count_self_intersections(mesh)), (2, 1, 0), "{frame}");
        let truth = measure(&cine.truth(frame as f64, 0.8));
        assert!(
            // The wall around the cavity is so thin that the lungs count for the brightness outside.
            (found.volume / truth.volume - 1.0).abs() < 0.055,
            "{frame} {} {}",
            found.volume,
            truth.volume
        );
    }
    assert_area_and_ejection(&cine, &tracker, &[]);
    let errors = errors(&cine, tracker.meshes());
    assert!(errors.iter().all(|error| *error < 0.3 * cine.spacing.x), "{errors:?}");
    assert_eq!(tracker.volumes().len(), cine.frames);
}

/// Hash of the surfaces of all frames, natively and in wasm.
const BITS: &str = "fdc7a785968eab81";

#[test]
fn bits_are_the_same_on_every_platform() {
    let cine = Cine::small().first(3);
    let tracker = tracked(open_ended(&cine));
    let positions: Vec<Vec3> = tracker.meshes().iter().flat_map(|mesh| mesh.positions.clone()).collect();
    assert_eq!(format!("{:016x}", super::common::fingerprint(&positions)), BITS);
}

#[test]
fn boundary_points_lie_on_the_boundary_in_world_space_and_between_frames() {
    let cine = Cine { noise: 0.0, ..Cine::small() };
    let mut tracker = SurfaceTracker::new(options(&cine, cine.volume())).unwrap();
    tracker.step().unwrap();
    let points = tracker.boundary(0);
    assert!(tracker.boundary(1).is_empty() && points.len() > 1000);
    let truth = cine.truth(0.0, 0.8);
    let (heavy, all) = points.iter().filter(|p| p[3] == 0.0).fold((0.0, 0.0), |(heavy, all), p| {
        let away = truth.positions.iter().map(|q| q.distance(Vec3::new(p[0], p[1], p[2])));
        let near = away.fold(f32::INFINITY, f32::min) < 2.0;
        (heavy + if near { p[4] } else { 0.0 }, all + p[4])
    });
    assert!(heavy > 0.9 * all, "{heavy} {all}");
    assert!(points.iter().any(|p| p[3] == 0.5) && points.iter().all(|p| p[4] > 0.0 && p[4] <= 1.0));
}

#[test]
fn a_given_mesh_is_tracked_and_the_component_is_chosen() {
    let cine = Cine::small().first(3);
    let start = cine.truth(0.0, 2.0);
    let given = tracked(TrackingOptions { start: Some(start), ..open_ended(&cine) });
    assert!(errors(&cine, given.meshes()).iter().all(|error| *error < 0.3 * cine.spacing.x));
    let [low, high] = cine.cavity_box();
    let nearest = Component::Nearest((low + high) / 2.0);
    let chosen = tracked(TrackingOptions { component: nearest, ..open_ended(&cine) });
    assert!(measure(&chosen.meshes()[2]).volume > 0.5 * measure(&given.meshes()[2]).volume);
}

#[test]
#[ignore = "long: npm run test:all"]
fn gaps_behind_papillary_muscles_close_and_open_without_folds() {
    let fine = DVec3::splat(1.4);
    let cine =
        Cine { papillary: true, dims: [52; 3], spacing: fine, frames: 12, size: 30.0, ..Cine::small() };
    let tracker = tracked(options(&cine, cine.volume()));
    let mut retracted = 0;
    for (frame, (mesh, statistics)) in tracker.meshes().iter().zip(tracker.statistics()).enumerate() {
        let (found, truth) = (measure(mesh), measure(&cine.truth(frame as f64, 0.7)));
        assert_eq!((found.components, count_self_intersections(mesh)), (1, 0), "{frame}");
        let volume = found.volume / truth.volume;
        assert!((volume - 1.0).abs() < 0.05, "{frame} {volume}");
        assert!(statistics.folded * 100 < statistics.triangles, "{frame} {statistics:?}");
        retracted += statistics.without_boundary;
    }
    assert!(retracted > 100, "{retracted}");
    // The gaps are two voxels wide at first, and in these frames a fifth of a voxel or closed; the surface still enters
    // them, and has an area of 1.08 times the truth.
    assert_area_and_ejection(&cine, &tracker, &[3, 4]);
}

#[test]
#[ignore = "long: npm run test:all"]
fn gaps_that_open_faster_than_the_boundary_attracts_are_filled() {
    // Thick slices, and a beat in eight frames: gaps close and open by several voxels from one frame to the next.
    let cine = Cine { dims: [48, 48, 23], beats: 3.0, ..Cine::full() }.first(6);
    let volume = cine.volume().enrich_slices(None, Enrichment::Flow).unwrap();
    let tracker = tracked(TrackingOptions { volume, ..open_ended(&cine) });
    for (frame, mesh) in tracker.meshes().iter().enumerate() {
        let off = surface_distance(mesh, &cine.truth(frame as f64, 0.8)).unwrap();
        // Where gaps open, the depth that is reached in them depends on details: with 2.8 to 3.1 beats, the mean is from 0.24
        // to 0.38, and the 95th percentile of frames 2 and 3 from 1.2 to 2.6.
        let worst = if frame == 2 || frame == 3 { 2.6 } else { 1.8 };
        assert!(off.mean < 0.4 && off.p95 < worst, "{frame} {} {}", off.mean, off.p95);
    }
}

/// A sequence of the paper's size: 25 frames of 156 × 192 × 25 voxels of 1.67 × 1.67 × 5 mm.
#[test]
#[ignore = "takes a minute: npm run scenes"]
fn a_sequence_of_the_papers_size_is_tracked_within_tolerances() {
    let cine = Cine::full();
    let volume = cine.volume().enrich_slices(None, Enrichment::Flow).unwrap();
    let tracker = tracked(options(&cine, volume));
    for (frame, (mesh, statistics)) in tracker.meshes().iter().zip(tracker.statistics()).enumerate() {
        let off = surface_distance(mesh, &cine.truth(frame as f64, 0.8)).unwrap();
        println!("frame {frame}: {:.3} mm in the mean, 95 % within {:.3} mm", off.mean, off.p95);
        assert!(off.mean < 0.5 && off.p95 < 1.8, "{frame} {} {}", off.mean, off.p95);
        assert_eq!((measure(mesh).components, count_self_intersections(mesh)), (1, 0), "{frame}");
        assert!(statistics.folded * 100 < statistics.triangles, "{frame} {statistics:?}");
    }
    assert_area_and_ejection(&cine, &tracker, &[]);
}

/// Returns a pulsating tube along the third axis through the whole volume, whose signal falls to a third along it.
fn tube(mirrored: bool) -> Volume {
    let mut random = super::common::Random(5);
    let mut values = Vec::new();
    for frame in 0..6 {
        let radius = 7.0 + libm::cos(f64::from(frame) * std::f64::consts::TAU / 6.0);
        for i in 0..28 * 28 * 30 {
            let [x, y, z] = [i % 28, i / 28 % 28, i / 784].map(f64::from);
            let inside = (radius - libm::hypot(x - 13.5, y - 13.5) + 0.5).clamp(0.0, 1.0);
            let clean = (30.0 + 150.0 * inside) * (1.0 - z / 45.0);
            values.push((clean + 6.0 * (f64::from(random.unit()) - 0.5)) as u8);
        }
    }
    let side = if mirrored { -1.5 } else { 1.5 };
    Volume::new(VolumeInit {
        affine: DAffine3::from_scale(DVec3::new(side, 1.5, 1.5)),
        frame_seconds: 0.1,
        ..VolumeInit::new(Voxels::U8(values), [28, 28, 30, 6])
    })
    .unwrap()
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn the_box_closes_surfaces_that_continue_beyond_it_also_in_mirrored_volumes() {
    for mirrored in [false, true] {
        for bounds in [None, Some(Bounds::Voxels([[1, 1, 6], [26, 26, 25]]))] {
            let params = TrackingParams { threshold: 30.0, cyclic: true, ..TrackingParams::default() };
            let tracker = tracked(TrackingOptions {
                volume: tube(mirrored),
                bounds,
                component: Component::Largest,
                start: None,
                cavity: Cavity::Open,
                limits: TrackingLimits::default(),
                params,
            });
            // Up to the outer faces of the voxels at the ends.
            let ends = if bounds.is_some() { [5.5, 25.5] } else { [-0.5, 29.5] };
            for (frame, mesh) in tracker.meshes().iter().enumerate() {
                let found = measure(mesh);
                assert_eq!(
                    (found.euler, found.components, count_self_intersections(mesh)),
                    (2, 1, 0),
                    "{frame}"
                );
                let radius = 7.0 + libm::cos(frame as f64 * std::f64::consts::TAU / 6.0);
                let truth = std::f64::consts::PI * radius * radius * (ends[1] - ends[0]) * 3.375;
                assert!((found.volume / truth - 1.0).abs() < 0.06, "{frame} {} {truth}", found.volume);
                let z = mesh.positions.iter().map(|p| f64::from(p.z) / 1.5);
                let reach = z.fold([f64::MAX, f64::MIN], |[low, high], z| [low.min(z), high.max(z)]);
                assert!((0..2).all(|k| (reach[k] - ends[k]).abs() < 0.6), "{frame} {reach:?}");
            }
        }
    }
}

#[test]
fn a_side_of_the_box_inside_the_cavity_closes_the_surface() {
    let cine = Cine::small().first(3);
    let volume = cine.volume();
    // Half of the cavity, cut where it is widest, and narrower than it.
    let bounds = Some(Bounds::Voxels([[18, 14, 10], [35, 21, 20]]));
    let tracker = tracked(TrackingOptions { bounds, volume, ..open_ended(&cine) });
    for (frame, (mesh, statistics)) in tracker.meshes().iter().zip(tracker.statistics()).enumerate() {
        let found = measure(mesh);
        assert_eq!((found.euler, found.components, count_self_intersections(mesh)), (2, 1, 0), "{frame}");
        let x = mesh.positions.iter().map(|p| p.x).fold(f32::MAX, f32::min);
        assert!((x - 35.0).abs() < 1.2, "{frame} {x}");
        assert!(statistics.without_boundary < statistics.triangles / 20, "{frame} {statistics:?}");
    }
}

#[ignore = "long: npm run test:all"]
#[test]
fn extreme_time_scales_and_short_cycles_are_tracked() {
    for (frames, time_scale, window_frames) in [(2, 1e-9, 2), (3, 1e-9, 2), (3, 1e9, 0), (5, 0.0, 4)] {
        let cine = Cine::small().first(frames);
        for cyclic in [false, true] {
            let mut options = options(&cine, cine.volume());
            options.params = TrackingParams { time_scale, window_frames, cyclic, ..options.params };
            let tracker = tracked(options);
            let errors = errors(&cine, tracker.meshes());
            assert!(
                errors.iter().all(|error| *error < 0.5 * cine.spacing.x),
                "{frames} {time_scale} {cyclic} {errors:?}"
            );
        }
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_cycle_closes_and_every_frame_has_its_volume() {
    let cine = Cine::small();
    let mut tracker = SurfaceTracker::new(options(&cine, cine.volume())).unwrap();
    let mut progress = 0.0;
    while !tracker.is_done() {
        assert!(tracker.cycle_closure_error().is_none());
        let report = tracker.step().unwrap();
        assert!(report.progress > progress, "{} {progress}", report.progress);
        progress = report.progress;
    }
    assert!((progress - 1.0).abs() < 1e-12);
    let closing = tracker.cycle_closure_error().unwrap();
    assert!(closing > 0.0 && closing < 0.3 * cine.spacing.x, "{closing}");
    for (statistics, mesh) in tracker.statistics().iter().zip(tracker.meshes()) {
        let found = measure(mesh);
        assert_eq!(
            (statistics.volume, statistics.area, statistics.triangles),
            (found.volume, found.area, found.triangles)
        );
    }
    assert_eq!(tracker.frame(), cine.frames - 1);
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_restored_run_continues_bit_for_bit() {
    let cine = Cine::small().first(4);
    let volume = cine.volume();
    let new = || {
        let mut options = open_ended(&cine);
        options.volume = volume.clone();
        SurfaceTracker::new(options).unwrap()
    };
    let mut whole = new();
    let mut steps = 0;
    while !whole.is_done() {
        whole.step().unwrap();
        steps += 1;
    }
    for before in [0, 2, 4, 5, 7, steps] {
        let mut first = new();
        (0..before).for_each(|_| drop(first.step().unwrap()));
        let saved = first.save();
        let mut second = new();
        second.step().unwrap();
        second.restore(&saved).unwrap();
        assert!(second.save() == saved, "{before}");
        while !second.is_done() {
            second.step().unwrap();
        }
        assert_eq!(second.statistics(), whole.statistics(), "{before}");
        assert!(second.meshes() == whole.meshes(), "{before}");
    }
    let saved = whole.save();
    let mut tracker = new();
    let other = Cine { noise: 1.0, ..cine };
    let mut stranger = SurfaceTracker::new(open_ended(&other)).unwrap();
    assert!(matches!(stranger.restore(&saved), Err(MethodError::BadState { .. })));
    for cut in [0, 7, 30, saved.len() / 2, saved.len() - 1] {
        assert!(matches!(tracker.restore(&saved[..cut]), Err(MethodError::BadState { .. })));
    }
    assert!(tracker.meshes().is_empty() && tracker.step().is_ok());
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn boundary_parameters_restart_tracking_and_others_do_not() {
    let cine = Cine::small().first(3);
    let mut tracker = SurfaceTracker::new(open_ended(&cine)).unwrap();
    (0..4).for_each(|_| drop(tracker.step().unwrap()));
    let params = TrackingParams { damping: 0.8, radius: 5.5, ..tracker.params().clone() };
    tracker.set_params(params).unwrap();
    assert_eq!(tracker.meshes().len(), 1);
    // Like the run itself, a state does not keep the former parameters.
    let mut resumed = tracker.clone();
    resumed.restore(&tracker.save()).unwrap();
    resumed.step().unwrap();
    tracker.step().unwrap();
    assert!(resumed.meshes() == tracker.meshes());
    assert_eq!(tracker.meshes().len(), 2);
    let refused = tracker.set_params(TrackingParams { threshold: -1.0, ..tracker.params().clone() });
    assert!(refused.is_err() && tracker.meshes().len() == 2);
    tracker.set_params(TrackingParams { threshold: 60.0, ..tracker.params().clone() }).unwrap();
    assert!(
        tracker.meshes().is_empty()
            && tracker.mesh().vertex_count() == 0
            && tracker.frames_with_boundary() == 0
    );
    while !tracker.is_done() {
        tracker.step().unwrap();
    }
    assert!(errors(&cine, tracker.meshes()).iter().all(|error| *error < 0.3 * cine.spacing.x));
}

#[test]
fn invalid_input_is_refused_by_name() {
    let cine = Cine::small().first(2);
    let volume = cine.volume();
    let good = || options(&cine, volume.clone());
    let refused = |options: TrackingOptions| match SurfaceTracker::new(options) {
        Err(MethodError::InvalidArgument { parameter, problem }) => (parameter, problem),
        Err(other) => panic!("{other:?}"),
        Ok(mut tracker) => loop {
            match tracker.step() {
                Err(MethodError::InvalidArgument { parameter, problem }) => break (parameter, problem),
                Err(other) => panic!("{other:?}"),
                Ok(report) => assert!(!report.done),
            }
        },
    };
    let one = cine.first(1).volume();
    assert_eq!(refused(TrackingOptions { volume: one, ..good() }).0, "volume");
    let away = Some(Bounds::World([DVec3::splat(1000.0), DVec3::splat(1001.0)]));
    let (parameter, problem) = refused(TrackingOptions { bounds: away, ..good() });
    assert!(parameter == "box" && problem.contains("reaches from"), "{problem}");
    for bounds in [[DVec3::ONE, DVec3::ZERO], [DVec3::NAN, DVec3::ONE]] {
        assert_eq!(refused(TrackingOptions { bounds: Some(Bounds::World(bounds)), ..good() }).0, "box");
    }
    let huge = Volume::new(VolumeInit::new(Voxels::U8(vec![0; 280 * 280 * 280 * 2]), [280, 280, 280, 2]));
    let (parameter, problem) = refused(TrackingOptions { volume: huge.unwrap(), bounds: None, ..good() });
    assert!(parameter == "box" && problem.contains("a smaller box"), "{problem}");
    for voxels in [[[0; 3], [36; 3]], [[9; 3], [8; 3]], [[0; 3], [3, 3, 30]]] {
        assert_eq!(refused(TrackingOptions { bounds: Some(Bounds::Voxels(voxels)), ..good() }).0, "voxels");
    }
    // A given start does not help if no step reaches the threshold.
    let mut without = good();
    (without.start, without.params.threshold) = (Some(cine.truth(0.0, 2.0)), 240.0);
    assert_eq!(refused(without).0, "threshold");
    let with = |change: fn(&mut TrackingParams)| {
        let mut options = good();
        change(&mut options.params);
        options
    };
    let (parameter, problem) = refused(with(|params| params.threshold = 240.0));
    assert!(parameter == "threshold" && problem.contains("the largest step in the box"), "{problem}");
    assert_eq!(refused(with(|params| params.threshold = -1.0)).0, "threshold");
    assert_eq!(refused(with(|params| params.window = 5)).0, "window");
    assert_eq!(refused(with(|params| params.radius = 0.5)).0, "radius");
    assert_eq!(refused(with(|params| params.radius = 1e6)).0, "radius");
    assert_eq!(refused(with(|params| params.time_scale = f64::NAN)).0, "timeScale");
    assert_eq!(refused(with(|params| params.damping = 0.0)).0, "damping");
    assert_eq!(refused(with(|params| params.edge_max = 0.5)).0, "edgeMax");
    let open = TriangleMesh {
        triangles: vec![[0, 1, 2]],
        positions: vec![Vec3::ZERO; 3],
        ..TriangleMesh::default()
    };
    let refusal = SurfaceTracker::new(TrackingOptions { start: Some(open), ..good() });
    assert!(matches!(refusal, Err(MethodError::Mesh(_))));
    assert_eq!(refused(TrackingOptions { start: Some(TriangleMesh::default()), ..good() }).0, "start");
    let far = super::common::torus_around(Vec3::splat(-500.0), [24, 12], [3.0, 1.0]);
    let (parameter, problem) = refused(TrackingOptions { start: Some(far), ..good() });
    assert!(parameter == "start" && problem.contains("inside the box"), "{problem}");
    let mut turned = super::common::torus_around(Vec3::ZERO, [24, 12], [3.0, 1.0]);
    turned.triangles.iter_mut().for_each(|corners| corners.reverse());
    let (parameter, problem) = refused(TrackingOptions { start: Some(turned), ..good() });
    assert!(parameter == "start" && problem.contains("face inwards"), "{problem}");
    let mut speck = super::common::torus_around(Vec3::ZERO, [24, 12], [3.0, 1.0]);
    speck.positions.iter_mut().for_each(|p| *p *= 1e-42);
    let (parameter, problem) = refused(TrackingOptions { start: Some(speck), ..good() });
    assert!(parameter == "start" && problem.contains("≥ 1e-12"), "{problem}");
    let mut fine = super::common::torus_around(Vec3::ZERO, [24, 12], [3.0, 1.0]);
    fine.positions.iter_mut().for_each(|p| *p *= 1e-6);
    let (parameter, problem) = refused(TrackingOptions { start: Some(fine), ..good() });
    assert!(parameter == "start" && problem.contains("a tenth of a voxel"), "{problem}");
    // Two interlocked rings.
    let middle = Vec3::splat(35.0);
    let mut crossing = super::common::torus_around(middle, [24, 12], [3.0, 1.0]);
    let other = super::common::torus_around(middle + Vec3::X, [24, 12], [3.0, 1.0]);
    let first = crossing.positions.len() as u32;
    crossing.triangles.extend(other.triangles.iter().map(|corners| corners.map(|v| v + first)));
    crossing.positions.extend(other.positions);
    let refusal = SurfaceTracker::new(TrackingOptions { start: Some(crossing), ..good() });
    assert!(matches!(refusal, Err(MethodError::Mesh(MeshError::SelfIntersecting { .. }))));
}
