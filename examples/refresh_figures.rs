//! Figures of strokes of a brush: the time from a change of the volume until the surface of a deformable model has
//! settled on it, as shares of the time of marching cubes on the whole volume in the same run, printed as JSON.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]
#![allow(clippy::disallowed_methods, reason = "it measures time")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Random, strokes};
use std::sync::OnceLock;
use std::time::Instant;
use strokes::{ISO, Scene, StrokeKind};
use vesicle::mesh::count_self_intersections;
use vesicle::methods::deformable::{DeformableModel, DeformableOptions, DeformableParams};
use vesicle::volume::marching_cubes_world;

/// Voxels along each side of the volume.
const SIDE: usize = 256;

/// Radius of the brush in voxels, and number of strokes.
const BRUSH: f32 = 6.0;
const STROKES: usize = 60;

/// Returns the milliseconds since the first call, as clock of the model.
fn milliseconds() -> f64 {
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    BEGAN.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e3
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}

/// Figures of one stroke, in milliseconds.
struct Row {
    kind: StrokeKind,
    refresh: f64,
    steps: f64,
    iterations: u32,
    parts: Vec<(&'static str, f64)>,
}

/// Runs the strokes, and returns the figures of each, the median time of marching cubes, and the final model.
fn run(is_smooth: bool) -> (Vec<Row>, f64, DeformableModel) {
    let mut scene = Scene::new(SIDE, BRUSH, is_smooth);
    let params = DeformableParams { iso: ISO, ..DeformableParams::for_volume(&scene.volume) };
    let options = DeformableOptions { params: Some(params), ..Default::default() };
    let mut model = DeformableModel::new(&scene.volume, options).unwrap();
    model.set_clock(milliseconds);
    while !model.step().unwrap().done {}
    let mut random = Random(7);
    let (mut rows, mut extractions) = (Vec::new(), Vec::new());
    for k in 0..STROKES {
        let kind = StrokeKind::ALL[k % StrokeKind::ALL.len()];
        let Some(stroke) = scene.stroke(kind, &mut random) else { continue };
        let region = scene.paint(stroke);
        let began = milliseconds();
        model.refresh(&scene.volume, region).unwrap();
        let refreshed = milliseconds();
        let mut row = Row { kind, refresh: refreshed - began, steps: 0.0, iterations: 0, parts: Vec::new() };
        loop {
            let report = model.step().unwrap();
            row.iterations += 1;
            for &(part, time) in &report.times.0 {
                match row.parts.iter_mut().find(|(name, _)| *name == part) {
                    Some((_, sum)) => *sum += time,
                    None => row.parts.push((part, time)),
                }
            }
            if report.done {
                break;
            }
        }
        row.steps = milliseconds() - refreshed;
        if std::env::var_os("EACH").is_some() {
            let all = model.mesh().to_triangles();
            eprintln!(
                "{kind:?} refresh {:.1} steps {:.1} ({}) {:.1?} crossings {} check {:?}",
                row.refresh,
                row.steps,
                row.iterations,
                row.parts,
                count_self_intersections(&all),
                model.mesh().check()
            );
        }
        rows.push(row);
        let began = milliseconds();
        marching_cubes_world(&scene.volume, ISO, 0).unwrap();
        extractions.push(milliseconds() - began);
    }
    (rows, median(extractions), model)
}

fn main() {
    for is_smooth in [false, true] {
        let (rows, extraction, model) = run(is_smooth);
        let times = |of: &dyn Fn(&Row) -> f64| median(rows.iter().map(of).collect());
        let coverage = model.coverage().unwrap();
        let iterations = times(&|row| f64::from(row.iterations));
        println!(
            "{{ \"voxels\": \"{}\", \"vertices\": {}, \"extraction\": {extraction:.1}, \"stroke\": {:.4}, \"refresh\": {:.4}, \
             \"iterations\": {iterations}, \"longest\": {:.4}, \"recall\": {:.5}, \"precision\": {:.5} }}",
            if is_smooth { "smooth" } else { "binary" },
            model.mesh().vertex_count(),
            times(&|row| row.refresh + row.steps) / extraction,
            times(&|row| row.refresh) / extraction,
            rows.iter().map(|row| row.refresh + row.steps).fold(0.0, f64::max) / extraction,
            coverage.recall,
            coverage.precision,
        );
        for kind in StrokeKind::ALL {
            let of_kind = rows.iter().filter(|row| row.kind == kind);
            let time = median(of_kind.map(|row| row.refresh + row.steps).collect());
            println!("  {{ \"kind\": \"{kind:?}\", \"stroke\": {:.4} }}", time / extraction);
        }
    }
}
