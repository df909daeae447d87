//! Figures of remeshing: for each mesh file named, at three target edge lengths.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::shapes;
use std::time::Instant;
use vesicle::io::{MeshFormat, parse_mesh, write_mesh};
use vesicle::math::Vec3;
use vesicle::mesh::{Mesh, TriangleMesh, count_self_intersections, measure};
use vesicle::remesh::{EdgeBounds, remesh};
use vesicle::spatial::surface_distance;

/// Returns the mesh with each triangle split into four, `times` times.
fn finer(mesh: &TriangleMesh, times: usize) -> TriangleMesh {
    let mut out = mesh.clone();
    out.normals = None;
    for _ in 0..times {
        let mut seen = std::collections::BTreeMap::new();
        let mut next = Vec::new();
        for t in out.triangles.clone() {
            let m = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| {
                *seen.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    out.positions.push((out.positions[a as usize] + out.positions[b as usize]) * 0.5);
                    out.positions.len() as u32 - 1
                })
            });
            next.extend([[t[0], m[0], m[2]], [t[1], m[1], m[0]], [t[2], m[2], m[1]], m]);
        }
        out.triangles = next;
    }
    out
}

fn main() {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let mut inputs: Vec<(String, TriangleMesh)> = files
        .iter()
        .map(|file| {
            let mesh = parse_mesh(&std::fs::read(file).unwrap()).unwrap();
            (
                file.rsplit('/').next().unwrap().to_string(),
                TriangleMesh { positions: mesh.positions, triangles: mesh.triangles, ..Default::default() },
            )
        })
        .collect();
    inputs.extend(
        shapes::all()
            .into_iter()
            .map(|(name, mesh)| (name.to_string(), TriangleMesh { normals: None, ..mesh })),
    );
    let only = std::env::var("ONLY").ok();
    println!(
        "{:28} {:>5} {:>7} {:>7} {:>6} {:>5} {:>5} {:>6} {:>6} {:>6} {:>5} {:>5} {:>6} {:>6}",
        "mesh",
        "aim",
        "in",
        "out",
        "us/tri",
        "cross",
        "was",
        "angle",
        "<30",
        "haus/a",
        "hd-in",
        "short",
        "long",
        "chi"
    );
    let mut all_angles = Vec::new();
    for (name, input) in inputs {
        if only.as_ref().is_some_and(|only| !name.contains(only.as_str())) {
            continue;
        }
        let start = match Mesh::from_triangles(&input) {
            Ok(m) => m,
            Err(e) => {
                println!("{name}: {e}");
                continue;
            }
        };
        let was = count_self_intersections(&input);
        let before = measure(&input);
        if let Ok(folder) = std::env::var("INPUTS") {
            std::fs::write(format!("{folder}/{name}.ply"), write_mesh(&input, MeshFormat::Ply).unwrap())
                .unwrap();
        }
        for factor in [0.5, 1.0, 3.0] {
            let aim = before.edge_mean as f32 * factor;
            let bounds = EdgeBounds { min: aim / 1.5, max: aim * 1.5 };
            let mut best = f64::INFINITY;
            let mut mesh = start.clone();
            for _ in 0..3 {
                mesh = start.clone();
                let t = Instant::now();
                if let Err(e) = remesh(&mut mesh, bounds) {
                    println!("{name} {e}");
                }
                best = best.min(t.elapsed().as_secs_f64());
            }
            let ok = mesh.check();
            let out = mesh.to_triangles();
            let after = measure(&out);
            let self_intersections = count_self_intersections(&out);
            let distance = surface_distance(&out, &input).unwrap().hausdorff;
            let dense = surface_distance(&finer(&out, 2), &finer(&input, 1)).unwrap().hausdorff;
            let sharp = out.corners().filter(|&c| smallest(c) < 30.0).count();
            let lengths: Vec<f32> =
                mesh.edges().map(|(u, v)| mesh.position(u).distance(mesh.position(v))).collect();
            let short = lengths.iter().filter(|&&l| l < bounds.min).count();
            let long = lengths.iter().filter(|&&l| l > bounds.max).count();
            all_angles.push(after.min_angle_degrees);
            println!(
                "{name:28} {factor:5.2} {:7} {:7} {:6.2} {self_intersections:5} {was:5} {:6.1} {sharp:6} {:6.3} {:6.3} {short:5} {long:5} {:6} {}",
                before.triangles,
                after.triangles,
                best * 1e6 / after.triangles as f64,
                after.min_angle_degrees,
                distance / aim as f64,
                dense / aim as f64,
                after.euler - before.euler + 1000 * (after.components as i64 - before.components as i64),
                if ok.is_ok() { "" } else { "BROKEN" }
            );
        }
    }
    all_angles.sort_by(f64::total_cmp);
    println!("median smallest angle {:?}", all_angles.get(all_angles.len() / 2));
}

/// Returns the smallest angle of a triangle in degrees.
fn smallest([a, b, c]: [Vec3; 3]) -> f32 {
    [(a, b, c), (b, c, a), (c, a, b)]
        .into_iter()
        .map(|(a, b, c)| (b - a).angle_between(c - a).to_degrees())
        .fold(180.0, f32::min)
}
