use super::*;
use crate::math::{DAffine3, DVec3, Random};
use crate::mesh::{measure, report};
use crate::volume::{VolumeInit, Voxels};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn volume(dims: [usize; 3], voxels: Vec<u8>) -> Volume {
    let [x, y, z] = dims;
    Volume::new(VolumeInit::new(Voxels::U8(voxels), [x, y, z, 1])).unwrap()
}

fn noise(dims: [usize; 3], labels: u32, seed: u64) -> Volume {
    let mut random = Random::new(seed);
    volume(dims, (0..dims.iter().product()).map(|_| random.below(labels + 1) as u8).collect())
}

/// Asserts that the surfaces are closed, 2-manifold and free of intersections, within and between labels.
fn check(surfaces: &LabelSurfaces, what: &str) {
    let all = surfaces.surface();
    let found = report(&all).unwrap();
    assert!(found.closed && found.oriented, "{what}: {found:?}");
    assert_eq!(
        (found.non_manifold_edges, found.non_manifold_vertices, found.self_intersections),
        (0, 0, 0),
        "{what}: {found:?}"
    );
    let measures = measure(&all);
    let counts = surfaces.counts;
    assert_eq!([all.positions.len(), all.triangles.len()], [counts.vertices, counts.triangles], "{what}");
    assert_eq!((measures.components, measures.euler), (surfaces.components, counts.euler()), "{what}");
}

fn settle(surfaces: &mut LabelSurfaces) {
    while !surfaces.step().unwrap().done {}
}

#[test]
fn noise_of_labels_gives_closed_surfaces_that_do_not_intersect() {
    for seed in 0..20 {
        for labels in [1, 2, 5] {
            let volume = noise([6, 5, 7], labels, seed);
            let mut surfaces = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
            check(&surfaces, &format!("seed {seed}, {labels} labels, at first"));
            while !surfaces.step().unwrap().done {
                check(&surfaces, &format!("seed {seed}, {labels} labels"));
            }
            check(&surfaces, &format!("seed {seed}, {labels} labels, at last"));
        }
    }
}

fn balls(n: usize, seed: u64, count: usize) -> Volume {
    let mut random = Random::new(seed);
    let centres: Vec<DVec3> = (0..count)
        .map(|_| {
            DVec3::new(random.unit(), random.unit(), random.unit()) * (n as f64 * 0.6)
                + DVec3::splat(n as f64 * 0.2)
        })
        .collect();
    let mut voxels = vec![0; n * n * n];
    for (i, voxel) in voxels.iter_mut().enumerate() {
        let p = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
        let (label, squared) = (centres.iter().enumerate())
            .map(|(label, c)| (label, c.distance_squared(p)))
            .fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best });
        if squared < (n as f64 * 0.22).powi(2) {
            *voxel = label as u8 + 1;
        }
    }
    volume([n, n, n], voxels)
}

#[test]
fn volumes_are_those_of_the_voxels() {
    for (n, seed) in [(40, 1), (60, 2)] {
        let volume = balls(n, seed, 12);
        let mut surfaces = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
        settle(&mut surfaces);
        check(&surfaces, "balls");
        for label in volume.labels(0).unwrap() {
            let measured = measure(&surfaces.mesh(label.value).unwrap()).volume;
            let error = measured / label.voxels as f64 - 1.0;
            println!("{n} {} {} {measured:.1} {:.2} %", label.value, label.voxels, error * 100.0);
            assert!(label.voxels < 500 || error.abs() < 0.01, "{error}");
        }
    }
}

#[test]
fn normals_are_near_those_of_a_ball_and_of_a_slope() {
    let n = 48;
    let centre = DVec3::new(23.3, 24.1, 23.7);
    for radius in [6.0, 12.0, 20.0] {
        let voxels = (0..n * n * n).map(|i| {
            let p = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
            u8::from(p.distance(centre) < radius)
        });
        let volume = volume([n, n, n], voxels.collect());
        for smoothing in [20] {
            let mut surfaces = LabelSurfaces::new(&volume, None, LabelParams { smoothing }).unwrap();
            settle(&mut surfaces);
            let mesh = surfaces.mesh(1.0).unwrap();
            let (mut sum, mut total, mut far) = (0.0, 0.0, 0.0f64);
            for [a, b, c] in mesh.corners() {
                let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
                let area = (b - a).cross(c - a);
                let out = ((a + b + c) / 3.0 - centre).normalize();
                let angle = area.normalize().dot(out).clamp(-1.0, 1.0).acos();
                sum += area.length() * angle * angle;
                total += area.length();
                far = far.max((a.distance(centre) - radius).abs());
            }
            let volume = measure(&mesh).volume / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
            println!(
                "r {radius} smoothing {smoothing}: rms {:.2}°, furthest {far:.3}, volume {volume:.4}",
                (sum / total).sqrt().to_degrees()
            );
        }
    }
}

#[test]
fn debug_small() {
    for dims in [[2, 2, 1], [2, 2, 2], [3, 2, 2], [3, 3, 2], [3, 3, 3]] {
        let mut bad = 0;
        for seed in 0..300 {
            for labels in [1, 2, 3] {
                let volume = noise(dims, labels, seed);
                let surfaces = LabelSurfaces::new(&volume, None, LabelParams { smoothing: 0 }).unwrap();
                let all = surfaces.surface();
                let pairs = crate::mesh::intersecting_pairs(&all);
                if !pairs.is_empty() {
                    bad += 1;
                    if bad < 3 {
                        println!("{dims:?} {labels} {seed}: {:?}", volume.voxels());
                        for [s, t] in pairs.iter().take(3) {
                            println!(
                                "  {:?}\n  {:?}",
                                all.triangles[*s as usize].map(|v| (v, all.positions[v as usize])),
                                all.triangles[*t as usize].map(|v| (v, all.positions[v as usize]))
                            );
                        }
                    }
                }
            }
        }
        println!("{dims:?}: {bad} of 900");
    }
}
