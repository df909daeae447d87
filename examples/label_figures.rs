//! Figures of label surfaces: times of a start, of strokes of a brush, and of a full extraction of the same volume.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]

use std::time::Instant;
use vesicle::math::{DVec3, Random};
use vesicle::mesh::{count_self_intersections, measure};
use vesicle::methods::label_surfaces::{LabelParams, LabelSurfaces};
use vesicle::volume::{Region, Volume, VolumeInit, Voxels, marching_cubes_world};

const SIDE: usize = 256;
/// Radius of the brush, in voxels.
const BRUSH: f64 = 6.0;
const STROKES: usize = 60;

/// Returns the voxels of balls that touch, with a label each.
fn balls(labels: usize, radius: f64) -> Vec<u8> {
    let mut random = Random::new(3);
    let mut coordinate = || SIDE as f64 * 0.2 + f64::from(random.below(SIDE as u32 * 6 / 10));
    let centres: Vec<DVec3> =
        (0..labels).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
    let mut voxels = vec![0; SIDE * SIDE * SIDE];
    for (i, voxel) in voxels.iter_mut().enumerate() {
        let p = DVec3::new((i % SIDE) as f64, (i / SIDE % SIDE) as f64, (i / SIDE / SIDE) as f64);
        let squared = |k: &usize| centres[*k].distance_squared(p);
        let nearest = (0..labels).min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap();
        if squared(&nearest) < radius * radius {
            *voxel = nearest as u8 + 1;
        }
    }
    voxels
}

/// Paints a ball of one label, or the background, on the volume; returns the region.
fn paint(volume: &mut Volume, voxels: &mut [u8], centre: [i64; 3], label: u8) -> Region {
    let reach = BRUSH as i64;
    let low = centre.map(|c| (c - reach).clamp(0, SIDE as i64 - 1) as usize);
    let high = centre.map(|c| (c + reach).clamp(0, SIDE as i64 - 1) as usize);
    let mut data = Vec::new();
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let d = [x, y, z].map(|n| n as f64);
                let squared: f64 = (0..3).map(|i| (d[i] - centre[i] as f64).powi(2)).sum();
                let voxel = &mut voxels[x + SIDE * (y + SIDE * z)];
                if squared <= BRUSH * BRUSH {
                    *voxel = label;
                }
                data.push(*voxel);
            }
        }
    }
    let region = Region { min: low, dims: [0, 1, 2].map(|i| high[i] - low[i] + 1) };
    volume.write(region, &Voxels::U8(data), 0).unwrap();
    region
}

fn main() {
    let (labels, radius) = (9, 27.0);
    let mut voxels = balls(labels, radius);
    let mut volume = Volume::new(VolumeInit::new(Voxels::U8(voxels.clone()), [SIDE, SIDE, SIDE, 1])).unwrap();
    let started = Instant::now();
    let clock = || {
        static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e3
    };
    let mut surfaces = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
    surfaces.set_clock(clock);
    println!("new: {:.0} ms", started.elapsed().as_secs_f64() * 1e3);
    loop {
        let report = surfaces.step().unwrap();
        println!("{} vertices, {} components, {:?}", report.vertices, report.components, report.times.0);
        if report.done {
            break;
        }
    }
    println!("start: {:.0} ms", started.elapsed().as_secs_f64() * 1e3);
    let mut random = Random::new(5);
    let mut times = Vec::new();
    let mut parts = std::collections::BTreeMap::<&str, f64>::new();
    for _ in 0..STROKES {
        let mesh = surfaces.mesh(f64::from(1 + random.below(labels as u32))).unwrap();
        let at = mesh.positions[random.below(mesh.positions.len() as u32) as usize];
        let centre = at.to_array().map(|x| x.round() as i64);
        let region = paint(&mut volume, &mut voxels, centre, random.below(labels as u32 + 1) as u8);
        let started = Instant::now();
        surfaces.refresh(&volume, region).unwrap();
        *parts.entry("refresh").or_default() += started.elapsed().as_secs_f64() * 1e3 / STROKES as f64;
        loop {
            let report = surfaces.step().unwrap();
            report
                .times
                .0
                .iter()
                .for_each(|(part, ms)| *parts.entry(part).or_default() += ms / STROKES as f64);
            if report.done {
                break;
            }
        }
        times.push(started.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    println!(
        "stroke: median {:.1} ms, longest {:.1} ms; mean parts {parts:.1?}",
        times[STROKES / 2],
        times[STROKES - 1]
    );
    let started = Instant::now();
    let full = marching_cubes_world(&volume, 0.5, 0).unwrap();
    println!(
        "marching cubes of all labels as one: {:.1} ms, {} vertices",
        started.elapsed().as_secs_f64() * 1e3,
        full.positions.len()
    );
    let started = Instant::now();
    let all = vesicle::methods::LiveSurface::surface(&surfaces);
    println!("meshes: {:.1} ms", started.elapsed().as_secs_f64() * 1e3);
    println!("{} self-intersections, {:?}", count_self_intersections(&all), measure(&all).components);
}
