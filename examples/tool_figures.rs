//! Timings of the surfaces of a label map and of tools for meshes, printed as JSON; `bench/tools.mjs` does the same work
//! through the npm package, and `npm run bench -- tools` compares the two.
//!
//! Arguments: the files of a mesh, of a label map and of one of noise, with a byte per voxel; the voxels per side of the
//! two; repeats; iterations of smoothing; the share of triangles that decimation keeps; the distance that bounds it; and
//! the voxels per side of the image that the mesh is from, and of the distances.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]
#![allow(clippy::disallowed_methods, reason = "it measures time")]

use std::fs::read;
use std::str::FromStr;
use std::time::Instant;
use vesicle::io::parse_mesh;
use vesicle::math::{DAffine3, DVec3};
use vesicle::mesh::{Mesh, TriangleMesh};
use vesicle::methods::label_surfaces::{LabelParams, LabelSurfaces};
use vesicle::remesh::{Smoothing, decimate, decimate_within, smooth};
use vesicle::volume::{Volume, VolumeInit, Voxels};
use vesicle::voxelise::{VoxelKind, voxelise};

/// Returns argument `k`.
fn argument<T: FromStr>(k: usize) -> T {
    std::env::args().nth(k).and_then(|text| text.parse().ok()).unwrap()
}

/// Returns the shortest time of `work` in milliseconds.
fn best<R>(work: impl Fn() -> R) -> f64 {
    let run = |_| {
        let began = Instant::now();
        let result = work();
        let spent = began.elapsed().as_secs_f64() * 1e3;
        drop(result);
        spent
    };
    (0..argument::<usize>(6)).map(run).fold(f64::INFINITY, f64::min)
}

/// Returns the shortest time of a tool, which begins by linking the triangles, as in the package.
fn best_of_tool<R>(triangles: &TriangleMesh, work: impl Fn(&mut Mesh) -> R) -> f64 {
    best(|| {
        let mut mesh = Mesh::from_triangles(triangles).unwrap();
        work(&mut mesh);
        mesh
    })
}

fn surfaces_of(map: &Volume) -> LabelSurfaces {
    let mut surfaces = LabelSurfaces::new(map, None, LabelParams::default()).unwrap();
    while !surfaces.step().unwrap().done {}
    surfaces
}

/// Returns a cube of `side` voxels per side, of edge `spacing`.
fn cube(voxels: Vec<u8>, side: usize, spacing: f64) -> Volume {
    let affine = DAffine3::from_scale(DVec3::splat(spacing));
    Volume::new(VolumeInit { affine, ..VolumeInit::new(Voxels::U8(voxels), [side, side, side, 1]) }).unwrap()
}

fn triangles_of(file: &str) -> TriangleMesh {
    let read = parse_mesh(&read(file).unwrap()).unwrap();
    TriangleMesh { positions: read.positions, triangles: read.triangles, ..Default::default() }
}

fn main() {
    let triangles = triangles_of(&argument::<String>(1));
    let [map, noise] = [2, 3].map(|k| cube(read(argument::<String>(k)).unwrap(), argument(k + 2), 1.0));
    let smoothing = Smoothing { iterations: argument(7), keeps_volume: true };
    let kept = (argument::<f64>(8) * triangles.triangles.len() as f64).round() as usize;
    let within: f64 = argument(9);
    let [image, distances]: [usize; 2] = [argument(10), argument(11)];
    let grid = cube(vec![0; distances.pow(3)], distances, image as f64 / distances as f64);

    let tasks = [
        ("labels", best(|| surfaces_of(&map))),
        ("noise", best(|| surfaces_of(&noise))),
        ("smooth", best_of_tool(&triangles, |mesh| smooth(mesh, smoothing).unwrap())),
        ("distance", best(|| voxelise(&triangles, &grid, VoxelKind::Distance).unwrap())),
        ("decimate", best_of_tool(&triangles, |mesh| decimate(mesh, kept))),
        ("decimate within", best_of_tool(&triangles, |mesh| decimate_within(mesh, 0, within).unwrap())),
    ];
    let fields = tasks.map(|(task, milliseconds)| format!("\"{task}\": {milliseconds:.1}"));
    println!("{{{}}}", fields.join(", "));
}
