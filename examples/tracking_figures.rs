//! Figures of slice enrichment and tracking.
//!
//! - `<files>`: errors of enrichment on slices left out, of the 4D volumes named and of a synthetic heart.
//! - `CENTER=x,y,z,mm <files>`: tracks the surface nearest to a voxel, in a box that extends `mm` world units from it
//!   on all sides. `LARGEST=1` tracks the largest surface in the box instead; `OUT=<folder>` writes the meshes as PLY.
//! - `PROPOSE=x,y,z <files>`: proposes the options from a voxel of the first frame, or with `PROPOSE=moving` from nothing,
//!   and tracks with them; `CAVITY=open` leaves muscles in cavities out.
//! - `TRACK=<beats>`: tracks a synthetic heart of the paper's size and compares it with its truth; `TRACK=small` one of
//!   a few voxels.
//!
//! Parameters of the tracker are `TH`, `RADIUS` and `SCALE` (these two in pixels for `TRACK`) and, for `TRACK`,
//! `FRAMES` and `PREDICTION=0` (none); `PLAIN=1` skips enrichment for `TRACK`. For files, `BOX=<first and last voxel>`
//! gives the box, and `BIN=<n>` first averages blocks of n × n voxels in each slice.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::cine::Cine;
use std::time::Instant;
use vesicle::io::parse_volume;
use vesicle::math::{DAffine3, DVec3};
use vesicle::mesh::{count_self_intersections, measure};
use vesicle::methods::tracking::{
    Bounds, Cavity, Component, Query, SurfaceTracker, TrackingLimits, TrackingOptions, TrackingParams,
};
use vesicle::spatial::surface_distance;
use vesicle::volume::{Enrichment, Space, Volume, VolumeInit, Voxels};

/// Returns the volume with every other slice, so that the rest are the ground truth.
fn every_other(volume: &Volume) -> Volume {
    let [nx, ny, nz] = volume.dims();
    let mut values = Vec::new();
    for frame in 0..volume.frames() {
        for z in (0..nz).step_by(2) {
            values.extend(volume.slice(2, z, frame).unwrap());
        }
    }
    Volume::new(VolumeInit {
        voxels: Voxels::F32(values),
        dims: [nx, ny, nz.div_ceil(2), volume.frames()],
        affine: volume.affine() * DAffine3::from_scale(DVec3::new(1.0, 1.0, 2.0)),
        slope: 1.0,
        intercept: 0.0,
        frame_seconds: 0.0,
        space: Space::Ras,
    })
    .unwrap()
}

/// Returns the root mean square error on the slices that were left out.
fn left_out_error(given: &Volume, volume: &Volume, method: Enrichment) -> f64 {
    let made = every_other(given).enrich_slices(Some(2), method).unwrap();
    let [mut sum, mut count] = [0.0, 0.0];
    for frame in 0..volume.frames() {
        for z in (1..made.dims()[2]).step_by(2) {
            let (a, b) = (made.slice(2, z, frame).unwrap(), volume.slice(2, z, frame).unwrap());
            sum += a.iter().zip(&b).map(|(a, b)| f64::from(a - b) * f64::from(a - b)).sum::<f64>();
            count += a.len() as f64;
        }
    }
    (sum / count).sqrt()
}

/// Prints the errors of enrichment by optical flow and by linear interpolation.
fn print_enrichment(given: &Volume, truth: &Volume) {
    let began = Instant::now();
    let flow = left_out_error(given, truth, Enrichment::Flow);
    let took = began.elapsed().as_secs_f64();
    let linear = left_out_error(given, truth, Enrichment::Linear);
    println!("  left out: flow {flow:.3}, linear {linear:.3}, ratio {:.3}; {took:.2} s", flow / linear);
}

/// Tracks a synthetic heart and prints the errors of each frame against the truth.
fn track(cine: &Cine) {
    let began = Instant::now();
    let mut volume = cine.volume();
    println!("made in {:.1} s", began.elapsed().as_secs_f64());
    if std::env::var("PLAIN").is_err() {
        let began = Instant::now();
        volume = volume.enrich_slices(None, Enrichment::Flow).unwrap();
        println!("enriched in {:.1} s", began.elapsed().as_secs_f64());
    }
    let began = Instant::now();
    let number = |name: &str| std::env::var(name).ok().and_then(|v| v.parse().ok());
    let pixel = volume.spacing()[0];
    let usual = TrackingParams::default();
    let params = TrackingParams {
        threshold: number("TH").unwrap_or(70.0),
        radius: number("RADIUS").unwrap_or(0.0) * pixel,
        time_scale: number("SCALE").unwrap_or(0.0) * pixel,
        window_frames: number("FRAMES").map_or(usual.window_frames, |n| n as u32),
        prediction: number("PREDICTION") != Some(0.0),
        cyclic: true,
        ..usual
    };
    let options = TrackingOptions {
        volume,
        bounds: Some(Bounds::World(cine.cavity_box())),
        component: Component::Largest,
        start: None,
        cavity: Cavity::Open,
        limits: TrackingLimits::default(),
        params,
    };
    let mut tracker = SurfaceTracker::new(options).unwrap();
    println!("noise {:.2}, {:?}", tracker.noise(), tracker.params());
    let mut all = ErrorSummary::default();
    while !tracker.is_done() {
        let began = Instant::now();
        tracker.step().unwrap();
        let took = began.elapsed().as_secs_f64();
        if tracker.meshes().is_empty() {
            all.votes += took;
        }
        let (Some(mesh), None) = (tracker.meshes().last(), tracker.cycle_closure_error()) else { continue };
        let (frame, statistics) = (tracker.frame(), tracker.statistics()[tracker.frame()]);
        let truth = cine.truth(frame as f64, 0.8);
        let (a, b) = (measure(mesh), measure(&truth));
        let off = surface_distance(mesh, &truth).unwrap();
        let self_intersections = count_self_intersections(mesh);
        let folds = 100.0 * statistics.folded as f64 / statistics.triangles as f64;
        println!(
            "{frame} {:.0} ms {:?}\n   volume {:.2} of {:.2} ({:+.1} %), area {:+.1} %, mean {:.2}, p95 {:.2}, max {:.1}, folds {:.2} %, chi {}, self-intersections {}",
            took * 1e3,
            statistics,
            a.volume / 1000.0,
            b.volume / 1000.0,
            100.0 * (a.volume / b.volume - 1.0),
            100.0 * (a.area / b.area - 1.0),
            off.mean,
            off.p95,
            off.hausdorff,
            folds,
            a.euler,
            self_intersections
        );
        all.mean = all.mean.max(off.mean);
        all.p95 = all.p95.max(off.p95);
        all.folds = all.folds.max(folds);
        all.areas.push(100.0 * (a.area / b.area - 1.0));
        all.self_intersections += self_intersections;
        all.steps += statistics.steps / tracker.frames() as f64;
        all.volumes.push([a.volume, b.volume]);
        all.times.push(took);
    }
    all.print();
    println!("closes with {:.3} mm", tracker.cycle_closure_error().unwrap_or(f64::NAN));
    println!("tracked in {:.1} s", began.elapsed().as_secs_f64());
}

/// The largest errors of all frames.
#[derive(Default)]
struct ErrorSummary {
    mean: f64,
    p95: f64,
    folds: f64,
    areas: Vec<f64>,
    self_intersections: usize,
    /// Mean number of steps per frame.
    steps: f64,
    /// Measured and true volume of each frame.
    volumes: Vec<[f64; 2]>,
    times: Vec<f64>,
    votes: f64,
}

impl ErrorSummary {
    fn print(mut self) {
        let ends = |list: &[f64]| list.iter().fold([f64::MAX, f64::MIN], |[a, b], &x| [a.min(x), b.max(x)]);
        let [small, large] = ends(&self.areas);
        let ejected = |k: usize| {
            let [small, large] = ends(&self.volumes.iter().map(|pair| pair[k]).collect::<Vec<_>>());
            100.0 * (1.0 - small / large)
        };
        self.times.sort_by(f64::total_cmp);
        println!(
            "worst: mean {:.2}, p95 {:.2}, folds {:.2} %, area {small:+.1} to {large:+.1} %, self-intersections {}; ejected {:.1} of {:.1} %; steps {:.1}; votes {:.2} s, frames {:.0} ms in the middle, {:.0} at most",
            self.mean,
            self.p95,
            self.folds,
            self.self_intersections,
            ejected(0),
            ejected(1),
            self.steps,
            self.votes,
            1e3 * self.times[self.times.len() / 2],
            1e3 * self.times[self.times.len() - 1],
        );
    }
}

/// Tracks the surface nearest to a voxel, in a box that extends `reach` world units from it on all sides.
fn track_file(volume: &Volume, voxel: DVec3, reach: f64) {
    let affine = volume.affine();
    let center = affine.transform_point3(voxel);
    let number = |name: &str| std::env::var(name).ok().and_then(|v| v.parse().ok());
    let bin = number("BIN").map_or(1, |n: f64| n as usize);
    let volume = volume.binned([bin, bin, 1]).unwrap().enrich_slices(None, Enrichment::Flow).unwrap();
    println!("{:?} x {}, {:?}", volume.dims(), volume.frames(), volume.spacing());
    let params = TrackingParams {
        threshold: number("TH").unwrap_or(0.0),
        radius: number("RADIUS").unwrap_or(0.0),
        time_scale: number("SCALE").unwrap_or(0.0),
        cyclic: true,
        ..TrackingParams::default()
    };
    let component =
        if std::env::var("LARGEST").is_ok() { Component::Largest } else { Component::Nearest(center) };
    let corners = [center - reach, center + reach];
    // `BOX` is in voxels of the file; binning and enrichment change their number.
    let voxels = |box_: String| {
        let n: Vec<f64> = box_.split(',').map(|x| x.parse().unwrap()).collect();
        let now = |k: usize| {
            volume.inverse_affine().transform_point3(affine.transform_point3(DVec3::from_slice(&n[k..])))
        };
        Bounds::Voxels([0, 3].map(|k| now(k).round().max(DVec3::ZERO).to_array().map(|x| x as usize)))
    };
    let bounds = Some(std::env::var("BOX").map_or(Bounds::World(corners), voxels));
    let mut tracker = SurfaceTracker::new(TrackingOptions {
        volume,
        bounds,
        component,
        start: None,
        cavity: Cavity::Open,
        limits: TrackingLimits::default(),
        params,
    })
    .unwrap();
    println!("noise {:.2}, {:?}", tracker.noise(), tracker.params());
    while !tracker.is_done() {
        let began = Instant::now();
        tracker.step().unwrap();
        let (Some(mesh), None) = (tracker.meshes().last(), tracker.cycle_closure_error()) else { continue };
        let (m, statistics) = (measure(mesh), tracker.statistics()[tracker.frame()]);
        println!(
            "{} {:.0} ms, {} triangles, volume {:.2}, area {:.1}, chi {}, self-intersections {}, folds {:.2} %, {:?}",
            tracker.frame(),
            began.elapsed().as_secs_f64() * 1e3,
            m.triangles,
            m.volume / 1000.0,
            m.area / 100.0,
            m.euler,
            count_self_intersections(mesh),
            100.0 * statistics.folded as f64 / statistics.triangles as f64,
            statistics
        );
        if let Ok(folder) = std::env::var("OUT") {
            let bytes = vesicle::io::write_mesh(mesh, vesicle::io::MeshFormat::Ply).unwrap();
            std::fs::write(format!("{folder}/frame{}.ply", tracker.frame()), bytes).unwrap();
        }
    }
    println!("closes with {:.3}", tracker.cycle_closure_error().unwrap_or(f64::NAN));
}

/// Proposes the options of a tracker from a voxel, or from nothing, and tracks with them.
fn track_proposed(volume: &Volume, voxel: Option<DVec3>) {
    let affine = volume.affine();
    let volume = volume.enrich_slices(None, Enrichment::Flow).unwrap();
    let began = Instant::now();
    let query =
        voxel.map_or(Query::Moving, |voxel| Query::Point { at: affine.transform_point3(voxel), frame: 0 });
    let proposal = SurfaceTracker::propose(&volume, query).unwrap();
    let took = began.elapsed().as_secs_f64();
    println!("{:?} x {}: proposed in {took:.2} s {proposal:?}", volume.dims(), volume.frames());
    let began = Instant::now();
    let threshold = std::env::var("TH").map_or(proposal.threshold, |th| th.parse().unwrap());
    let options = TrackingOptions {
        volume,
        bounds: Some(Bounds::Voxels(proposal.bounds)),
        component: Component::Nearest(proposal.component),
        start: None,
        cavity: if std::env::var("CAVITY").is_ok_and(|cavity| cavity == "open") {
            Cavity::Open
        } else {
            Cavity::Closed
        },
        limits: TrackingLimits::default(),
        params: TrackingParams { threshold, cyclic: true, ..TrackingParams::default() },
    };
    let mut tracker = SurfaceTracker::new(options).unwrap();
    let mut slowest = 0.0f64;
    while !tracker.is_done() {
        let began = Instant::now();
        tracker.step().unwrap();
        slowest = slowest.max(began.elapsed().as_secs_f64());
    }
    let volumes = tracker.volumes();
    for (frame, mesh) in tracker.meshes().iter().enumerate() {
        let m = measure(mesh);
        println!(
            "{frame}: {:.2} ml, genus {}, {} components",
            m.volume / 1e3,
            (2 * m.components as i64 - m.euler as i64) / 2,
            m.components
        );
        if let Ok(folder) = std::env::var("OUT") {
            let bytes = vesicle::io::write_mesh(mesh, vesicle::io::MeshFormat::Ply).unwrap();
            std::fs::write(format!("{folder}/frame{frame}.ply"), bytes).unwrap();
        }
    }
    for warning in tracker.warnings() {
        println!("{warning:?}");
    }
    let [low, high] = volumes.iter().fold([f64::MAX, 0.0], |[low, high], &v| [low.min(v), high.max(v)]);
    println!(
        "ejected {:.1} %; tracked in {:.1} s, slowest step {slowest:.2} s, closes with {:.3}",
        100.0 * (1.0 - low / high),
        began.elapsed().as_secs_f64(),
        tracker.cycle_closure_error().unwrap_or(f64::NAN)
    );
}

fn main() {
    if let Ok(point) = std::env::var("PROPOSE") {
        let voxel = (point != "moving")
            .then(|| DVec3::from_slice(&point.split(',').map(|x| x.parse().unwrap()).collect::<Vec<_>>()));
        for file in std::env::args().skip(1) {
            track_proposed(&parse_volume(&std::fs::read(&file).unwrap(), None).unwrap(), voxel);
        }
        return;
    }
    if let Ok(name) = std::env::var("TRACK") {
        let cine = match name.as_str() {
            "small" => Cine::small(),
            _ => Cine { beats: name.parse().unwrap_or(1.0), ..Cine::full() },
        };
        return track(&cine);
    }
    if let Ok(center) = std::env::var("CENTER") {
        let numbers: Vec<f64> = center.split(',').map(|x| x.parse().unwrap()).collect();
        for file in std::env::args().skip(1) {
            let volume = parse_volume(&std::fs::read(&file).unwrap(), None).unwrap();
            track_file(&volume, DVec3::from_slice(&numbers), numbers[3]);
        }
        return;
    }
    let full = Cine { frames: 4, ..Cine::full() };
    let (noisy, clean) = (full.volume(), Cine { noise: 0.0, ..full }.volume());
    print_enrichment(&noisy, &noisy);
    print_enrichment(&noisy, &clean);
    print_enrichment(&clean, &clean);
    for file in std::env::args().skip(1) {
        let volume = parse_volume(&std::fs::read(&file).unwrap(), None).unwrap();
        println!("{file}: {:?} x {}, {:?}", volume.dims(), volume.frames(), volume.spacing());
        print_enrichment(&volume, &volume);
    }
}
