//! The tools for static meshes on random shapes at random scales, from 10⁻¹² to 10¹²: each ends, and gives what it gives at
//! scale 1, or refuses with the reason.

use super::common::shapes::{cuboid, ellipsoid, joined};
use super::common::{Named, Random, assert_at_least, seeds, torus_around};
use std::collections::BTreeMap;
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{Mesh, MeshError, TriangleMesh, measure};
use vesicle::remesh::{
    EdgeBounds, Plane, Smoothing, Unchecked, cut_by_plane, decimate, decimate_within, remesh, restructure,
    smooth,
};
use vesicle::spatial::outer_components;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// A tool, with lengths relative to a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Tool {
    Remesh,
    Restructure,
    Smooth,
    Decimate,
    DecimateWithin,
    Cut,
    KeepComponents,
    FillCavities,
    Refine,
}

const TOOLS: [Tool; 9] = [
    Tool::Remesh,
    Tool::Restructure,
    Tool::Smooth,
    Tool::Decimate,
    Tool::DecimateWithin,
    Tool::Cut,
    Tool::KeepComponents,
    Tool::FillCavities,
    Tool::Refine,
];

/// Random numbers that a tool's arguments are made of.
struct Choice {
    part: f64,
    normal: DVec3,
}

/// Returns a random closed mesh of about unit size, sometimes of two parts or with a cavity.
fn shape(random: &mut Random) -> TriangleMesh {
    let edge = random.within(0.15, 0.4) as f32;
    let ball =
        |centre: Vec3, radius: f32| Mesh::icosphere(centre, radius, edge * radius).unwrap().to_triangles();
    let stretch = Vec3::from([(); 3].map(|()| random.within(0.3, 1.5) as f32));
    let mut mesh = match random.below(6) {
        0 => ball(Vec3::ZERO, 1.0),
        1 => torus_around(Vec3::ZERO, [24, 10], [1.0, random.within(0.1, 0.5) as f32]),
        2 => cuboid([6, 5, 4], stretch),
        3 => ellipsoid(edge, stretch),
        4 => joined(&[ball(Vec3::ZERO, 1.0), ball(Vec3::X * 2.5, random.within(0.2, 1.2) as f32)]),
        _ => {
            let mut cavity = ball(Vec3::ZERO, 0.5);
            cavity.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
            joined(&[ball(Vec3::ZERO, 1.0), cavity])
        }
    };
    mesh.normals = None;
    // Symmetric shapes have edges of equal error, whose order depends on rounding.
    mesh.positions.iter_mut().for_each(|p| *p += Vec3::from([(); 3].map(|()| 2e-3 * edge * random.unit())));
    mesh
}

/// Returns what a tool makes of a mesh of size `scale`.
fn apply(tool: Tool, surface: &TriangleMesh, scale: f64, choice: &Choice) -> Result<TriangleMesh, MeshError> {
    let mut mesh = Mesh::from_triangles(surface)?;
    let target = surface.triangles.len() / 3;
    let aim = (choice.part * scale) as f32;
    let edges = EdgeBounds { min: aim / 1.5, max: aim * 1.5 };
    match tool {
        Tool::Remesh => drop(remesh(&mut mesh, edges)?),
        Tool::Restructure => {
            edges.check_for(&mesh)?;
            restructure(&mut mesh, edges, &mut Unchecked);
        }
        Tool::Smooth => smooth(&mut mesh, Smoothing { iterations: 20, keeps_volume: true })?,
        Tool::Decimate => drop(decimate(&mut mesh, target)),
        Tool::DecimateWithin => drop(decimate_within(&mut mesh, target, 0.05 * scale)?),
        Tool::Cut => {
            cut_by_plane(&mut mesh, Plane { origin: choice.normal * 0.1 * scale, normal: choice.normal })?
        }
        Tool::KeepComponents => {
            return Ok(surface.without_components_below(scale * scale * scale));
        }
        Tool::FillCavities => {
            let (outer, parts) = (outer_components(surface)?, surface.components());
            return Ok(joined(&outer.iter().map(|&k| parts[k as usize].clone()).collect::<Vec<_>>()));
        }
        Tool::Refine => mesh.refine()?,
    }
    mesh.check().unwrap();
    Ok(mesh.to_triangles())
}

/// Returns the largest relative difference of volume, area and extents, of which the second mesh has `scale` times those
/// of the first.
fn difference(a: &TriangleMesh, b: &TriangleMesh, scale: f64) -> f64 {
    let [a, b] = [a, b].map(measure);
    if a.triangles == 0 || b.triangles == 0 {
        return if a.triangles == b.triangles { 0.0 } else { 1.0 };
    }
    let off = |x: f64, y: f64| (y / x - 1.0).abs();
    let size = |bounds: [DVec3; 2]| (bounds[1] - bounds[0]).max_element();
    off(a.volume, b.volume / (scale * scale * scale))
        .max(off(a.area, b.area / (scale * scale)))
        .max(off(size(a.bounds), size(b.bounds) / scale))
}

/// Returns how many results of a tool are right, differ, and are refused, by cause.
fn sweep(tool: Tool, seeds: std::ops::Range<u64>) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for seed in seeds {
        let _named = Named::new(seed);
        let random = &mut Random(seed + 1);
        let surface = shape(random);
        let scale = libm::pow(10.0, random.within(-12.0, 12.0));
        let direction = DVec3::from([(); 3].map(|()| random.within(-1.0, 1.0)));
        let choice = Choice { part: random.within(0.15, 0.5), normal: direction.normalize() };
        let mut scaled = surface.clone();
        scaled.positions.iter_mut().for_each(|p| *p = (p.as_dvec3() * scale).as_vec3());
        let pair = (apply(tool, &surface, 1.0, &choice), apply(tool, &scaled, scale, &choice));
        let outcome = match pair {
            (Ok(a), Ok(b)) => {
                let off = difference(&a, &b, scale);
                if off < 1e-3 {
                    "right".to_owned()
                } else {
                    println!("{tool:?}, seed {seed}: {off:.1e} off at {scale:e}");
                    "differs".to_owned()
                }
            }
            (Err(_), Ok(_)) => "accepted only when scaled".to_owned(),
            (_, Err(error)) => format!("refused: {error:?}").chars().take(40).collect(),
        };
        *counts.entry(outcome).or_insert(0) += 1;
    }
    counts
}

fn check(tool: Tool, count: u64) {
    let seeds = seeds(count);
    let all = (seeds.end - seeds.start) as usize;
    let counts = sweep(tool, seeds);
    println!("{tool:?}: {counts:?}");
    let right = counts.get("right").copied().unwrap_or(0);
    assert_at_least(all * 99 / 100, right, &format!("results of {tool:?} right of {all}"));
}

#[test]
fn tools_give_the_same_at_any_scale() {
    TOOLS.into_iter().for_each(|tool| check(tool, 12));
}

#[test]
#[ignore = "long: npm run test:all"]
fn tools_give_the_same_at_any_scale_ten_thousand_times() {
    TOOLS.into_iter().for_each(|tool| check(tool, 10_000));
}
