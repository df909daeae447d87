//! Bricks, memory and time of a surface in a computed volume of a terabyte.
//!
//! Arguments: voxels along a side, number of levels, level to end at, side of the box (0: none), finest level outside it.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program for the terminal")]
#![allow(clippy::disallowed_methods, reason = "it measures time")]

#[path = "../tests/common/stores.rs"]
mod stores;

use std::collections::BTreeSet;
use std::time::Instant;
use stores::{Store, branching};
use vesicle::math::{DVec3, Vec3};
use vesicle::methods::MethodError;
use vesicle::methods::deformable::{DeformableModel, SparseOptions, WorldBox};
use vesicle::volume::BRICK;

fn main() {
    let arg = |k: usize, default: usize| std::env::args().nth(k).map_or(default, |x| x.parse().unwrap());
    let (side, levels, finest, boxed) = (arg(1, 1024), arg(2, 4), arg(3, 0), arg(4, 0));
    let whole = arg(5, levels - 1);
    let store = Store::new(side, levels as u32, branching(side));
    let volume = store.volume();
    let unit = side as f64;
    let within = (boxed > 0).then(|| {
        let min = DVec3::new(0.6, 0.4, 0.35) * unit;
        WorldBox { min, max: min + boxed as f64 }
    });
    let options = SparseOptions { finest, within, whole: Some(whole), ..SparseOptions::default() };
    let mut model = DeformableModel::on_sparse(&volume, options).unwrap();
    let (mut in_store, mut asked, mut asks, mut most) = (0.0, vec![0; levels], 0, 0);
    let began = Instant::now();
    loop {
        let here = Instant::now();
        match model.step() {
            Ok(report) => {
                println!(
                    "{:4} {} {:8} vertices, {} parts, χ {}, residual {:.2e}, {:.0} ms",
                    report.iteration,
                    report.phase,
                    report.vertices,
                    report.components,
                    report.euler,
                    report.residual,
                    here.elapsed().as_secs_f64() * 1e3
                );
                if report.done {
                    break;
                }
            }
            Err(MethodError::NeedsData { needs }) => {
                asks += 1;
                let before = volume.loaded();
                let here = Instant::now();
                store.load(&volume, &needs);
                in_store += here.elapsed().as_secs_f64();
                let after = volume.loaded();
                let bytes: usize = after.iter().map(|level| level[1]).sum();
                most = most.max(bytes);
                for k in 0..levels {
                    asked[k] += after[k][0] - before[k][0];
                }
                println!("asks for {} boxes of level {}", needs.len(), needs[0].level);
            }
            Err(error) => return println!("{error}"),
        }
    }
    println!(
        "{:.1} s in all, {in_store:.1} s in the store; {asks} asks; bricks by level {asked:?}; at most {} MB of bricks",
        began.elapsed().as_secs_f64(),
        most >> 20
    );
    println!("check {:?}, {} bricks at the surface", model.mesh().check(), bricks_at(&model, finest, within));
}

/// Returns the number of bricks of the finest level that triangles in the box pass through.
fn bricks_at(model: &DeformableModel, finest: usize, within: Option<WorldBox>) -> usize {
    let surface = model.mesh().to_triangles();
    let voxel = f64::from(1 << finest);
    let mut bricks = BTreeSet::new();
    for corners in surface.corners() {
        let is_in = |p: &Vec3| {
            let p = (p.as_dvec3() + 0.5) * voxel - 0.5;
            within.is_none_or(|within| p.cmpge(within.min).all() && p.cmple(within.max).all())
        };
        if corners.iter().all(is_in) {
            let brick = |p: Vec3| (p / BRICK as f32).floor().as_ivec3().to_array();
            bricks.extend(corners.map(brick));
        }
    }
    bricks.len()
}
