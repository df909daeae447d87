//! Tracking of random sequences with random parameters and boxes: after every frame the surface is closed, connected
//! and free of self-intersections, or the input is refused by name.
//!
//! `FUZZ_SEEDS=<first>..<last>` runs other seeds; a failing seed is printed.

use super::common::{Named, Random, assert_at_least, seeds};
use vesicle::math::{DAffine3, DVec3};
use vesicle::mesh::{count_self_intersections, measure};
use vesicle::methods::MethodError;
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, SurfaceTracker, TrackingLimits, TrackingOptions, TrackingParams,
};
use vesicle::volume::{Volume, VolumeInit, Voxels};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Returns blobs that move, grow and vanish, in noise; some have voxels that are not numbers.
fn random_volume(random: &mut Random) -> Volume {
    let mut size = || 4 + random.below(10);
    let [nx, ny] = [size(), size()];
    let (nz, nt) = (3 + random.below(7), 2 + random.below(4));
    let count = nx * ny * nz;
    let blobs: Vec<[DVec3; 2]> = (0..1 + random.below(3))
        .map(|_| {
            let mut place = || DVec3::new(random.within(0.0, nx as f64), random.within(0.0, ny as f64), 0.0);
            let (from, mut way) = (place(), place());
            way = (way - from) / 3.0;
            [DVec3 { z: random.within(0.0, nz as f64), ..from }, way]
        })
        .collect();
    let radius = random.within(1.0, 6.0);
    let (noise, holes) = (random.within(0.0, 40.0), if random.below(4) == 0 { 40 } else { usize::MAX });
    let mut values = Vec::with_capacity(count * nt);
    for i in 0..count * nt {
        let (t, at) = ((i / count) as f64, i % count);
        let p = DVec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64);
        let is_bright = blobs.iter().any(|[from, way]| p.distance(*from + *way * t) < radius + 0.5 * t);
        let value = if is_bright { 150.0 } else { 40.0 } + random.within(-1.0, 1.0) * noise;
        values.push(if random.below(holes) == 0 { f32::NAN } else { value as f32 });
    }
    let mut length = || random.within(0.8, 2.5);
    let spacing = DVec3::new(length(), length(), length());
    let turned = DAffine3::from_rotation_z(random.within(-3.0, 3.0));
    Volume::new(VolumeInit {
        affine: turned * DAffine3::from_scale(spacing),
        ..VolumeInit::new(Voxels::F32(values), [nx, ny, nz, nt])
    })
    .unwrap()
}

fn random_params(random: &mut Random) -> TrackingParams {
    let mut or_zero = |low: f64, high: f64| if random.below(2) == 0 { 0.0 } else { random.within(low, high) };
    let (threshold, radius, time_scale) = (or_zero(10.0, 90.0), or_zero(1.0, 12.0), or_zero(0.1, 10.0));
    let edge_min = random.within(0.05, 0.5);
    TrackingParams {
        threshold,
        window: 1 + random.below(4) as u32,
        window_frames: random.below(5) as u32,
        radius,
        time_scale,
        damping: random.within(0.5, 1.0),
        edge_min,
        edge_max: edge_min * random.within(2.1, 5.0) + 0.9,
        prediction: random.below(2) == 0,
        cyclic: random.below(2) == 0,
    }
}

fn random_options(random: &mut Random) -> TrackingOptions {
    let volume = random_volume(random);
    let last = volume.dims().map(|n| n - 1);
    let bounds = (random.below(3) == 0).then(|| {
        let low = last.map(|n| random.below(n / 2 + 1));
        Bounds::Voxels([low, [0, 1, 2].map(|k| low[k] + random.below(last[k] - low[k] + 1))])
    });
    let component = match random.below(2) {
        0 => Component::Largest,
        _ => Component::Nearest(DVec3::splat(random.within(-10.0, 20.0))),
    };
    let params = random_params(random);
    let cavity = if random.below(2) == 0 { Cavity::Open } else { Cavity::Closed };
    TrackingOptions {
        volume,
        bounds,
        component,
        start: None,
        cavity,
        limits: TrackingLimits::default(),
        params,
    }
}

/// Tracks a sequence and returns the number of frames, or the error that refuses it.
fn track(options: TrackingOptions) -> Result<usize, MethodError> {
    let mut tracker = SurfaceTracker::new(options)?;
    while !tracker.is_done() {
        let frames = tracker.meshes().len();
        tracker.step()?;
        assert!(tracker.mesh().check().is_ok());
        if let Some(mesh) = tracker.meshes().get(frames) {
            let found = measure(mesh);
            // None in a frame without an object.
            assert_eq!(
                (found.components, count_self_intersections(mesh)),
                (usize::from(found.triangles > 0), 0)
            );
            assert!(mesh.positions.iter().all(|p| p.is_finite()));
        }
    }
    Ok(tracker.meshes().len())
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn every_tracked_frame_is_one_closed_surface() {
    let (mut tracked, mut all_frames) = (0, 0);
    for seed in seeds(20) {
        let named = Named::new(seed);
        match track(random_options(&mut Random(seed))) {
            Ok(frames) => {
                tracked += usize::from(frames > 1);
                all_frames += frames;
            }
            Err(MethodError::InvalidArgument { .. }) => {}
            Err(other) => panic!("{other}"),
        }
        std::mem::drop(named);
    }
    assert_at_least(8, tracked, "sequences of several frames tracked");
    assert_at_least(25, all_frames, "frames");
}
