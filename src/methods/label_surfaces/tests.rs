use super::*;
#[cfg(not(target_arch = "wasm32"))]
use crate::core_tests::common::seeds;
use crate::math::{DAffine3, DVec3, Random, Vec3};
use crate::mesh::{measure, report};
use crate::pauses::advance;
use crate::spatial::TriangleTree;
use crate::volume::{VolumeInit, Voxels, voxels_inside};
use crate::warning::Place;
use nets::NetVertex;
use std::task::Poll;
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
    let counts = LiveSurface::counts(surfaces);
    assert_eq!([all.positions.len(), all.triangles.len()], counts, "{what}");
    assert_eq!(
        (measures.components, measures.euler),
        (surfaces.components.count(), surfaces.counts.euler()),
        "{what}"
    );
}

fn settle(surfaces: &mut LabelSurfaces) {
    while !surfaces.step().unwrap().done {}
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn noise_of_labels_gives_closed_surfaces_that_do_not_intersect() {
    for seed in 0..8 {
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

/// Returns a label map of balls at random places that touch, each voxel in the ball of the nearest centre.
fn balls(n: usize, seed: u64, count: usize) -> Volume {
    let mut random = Random::new(seed);
    let mut coordinate = || n as f64 * (0.2 + 0.6 * random.unit());
    let centres: Vec<DVec3> =
        (0..count).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
    let label = |p: DVec3| {
        let squared = |k: &usize| centres[*k].distance_squared(p);
        let nearest = (0..count).min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap();
        if squared(&nearest).sqrt() < n as f64 * 0.22 { nearest as u8 + 1 } else { 0 }
    };
    volume([n, n, n], (0..n * n * n).map(|i| label(centre_of(i, n))).collect())
}

fn centre_of(i: usize, n: usize) -> DVec3 {
    DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64)
}

fn settled(volume: &Volume) -> LabelSurfaces {
    let mut surfaces = LabelSurfaces::new(volume, None, LabelParams::default()).unwrap();
    settle(&mut surfaces);
    surfaces
}

/// Asserts that each voxel is inside of the surface of its label, and of no other.
fn assert_voxels_are_inside(surfaces: &LabelSurfaces, volume: &Volume) {
    let dims = volume.dims();
    let mut found = vec![0; dims.iter().product()];
    for label in surfaces.labels() {
        let inside = voxels_inside(&surfaces.mesh(label).unwrap(), dims);
        for i in inside.ones() {
            assert_eq!(found[i], 0, "voxel {i} is in two labels");
            found[i] = label as u8;
        }
    }
    assert!(&Voxels::U8(found) == volume.voxels());
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn surfaces_have_the_volume_and_the_voxels_of_their_labels() {
    for (n, seed) in [(40, 1), (52, 2)] {
        let volume = balls(n, seed, 12);
        let surfaces = settled(&volume);
        check(&surfaces, "balls");
        assert_voxels_are_inside(&surfaces, &volume);
        for label in volume.labels(0).unwrap() {
            let error = measure(&surfaces.mesh(label.value).unwrap()).volume / label.voxels as f64 - 1.0;
            assert!(label.voxels < 500 || error.abs() < 0.005, "label {}: {error}", label.value);
        }
    }
}

/// Returns a label map of layers across a direction: label 2 is as thick as given, between the labels `below` and `above`.
fn layers(n: usize, across: DVec3, thickness: f64, [below, above]: [u8; 2]) -> Volume {
    let middle = DVec3::splat(n as f64 / 2.0);
    let label = |p: DVec3| {
        let height = (p - middle).dot(across.normalize()) - 0.01;
        if height < -thickness / 2.0 {
            below
        } else if height < thickness / 2.0 {
            2
        } else {
            above
        }
    };
    volume([n; 3], (0..n * n * n).map(|i| label(centre_of(i, n))).collect())
}

/// Asserts that the volume of each label's surface is that of its voxels, to 1 %, or that there is a warning which names the
/// label and the difference, and that there is none otherwise; returns the number of warnings.
fn check_volumes(surfaces: &mut LabelSurfaces, volume: &Volume, what: &str) -> usize {
    let warnings = surfaces.step().unwrap().warnings;
    let voxel = volume.affine().matrix3.determinant().abs();
    for label in volume.labels(0).unwrap() {
        let off = measure(&surfaces.mesh(label.value).unwrap()).volume / (label.voxels as f64 * voxel) - 1.0;
        let warning = warnings.iter().find(|warning| warning.place == Some(Place::Label(label.value)));
        let (off, is_warned) = (off * 100.0, warning.is_some());
        assert!((off.abs() > 0.999) <= is_warned, "{what}: label {} is {off} % off", label.value);
        let text = warning.map_or("", |warning| &warning.text);
        // Rounding may go either way.
        let names = |off: f64| text.contains(&format!("{off:.1} %"));
        assert!(!is_warned || [-0.01, 0.01].iter().any(|by| names(off.abs() + by)), "{what}: {off} {text}");
    }
    warnings.len()
}

/// Between two others, labels share most of their cells with both, and volume can only be given to the other cells.
#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn slanted_layers_of_two_voxels_have_their_volume() {
    for across in
        [DVec3::ONE, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 2.0, 3.0), DVec3::new(5.0, 2.0, 1.0)]
    {
        for others in [[1, 3], [0, 0], [1, 0]] {
            // Two voxels along the axis nearest to the direction.
            let thickness = 2.0 * across.max_element() / across.length();
            let what = format!("{across}, between {others:?}");
            let volume = layers(24, across, thickness, others);
            let mut surfaces = settled(&volume);
            check(&surfaces, &what);
            assert_voxels_are_inside(&surfaces, &volume);
            let warnings = check_volumes(&mut surfaces, &volume, &what);
            println!("{what}: {warnings} warnings");
            assert_eq!(warnings, 0, "{what}");
        }
    }
}

/// Returns a random label map of layers, threads, single voxels, balls, slices and noise, with voxels of random shape.
fn random_thin(seed: u64) -> Volume {
    let mut random = Random::new(seed);
    let n = 10 + random.below(8) as usize;
    let dims = match random.below(6) {
        0 => [n, n, 1],
        1 => [n, n, 2],
        _ => [n, n, n],
    };
    let mut signed = || 2.0 * random.unit() - 1.0;
    let across = DVec3::new(signed(), signed(), signed()).normalize();
    let (middle, shift) = (DVec3::from(dims.map(|n| n as f64 / 2.0)), signed());
    let thickness = 0.6 + 2.0 * random.unit();
    let others = [[1, 3], [0, 0], [1, 0], [4, 4]][random.below(4) as usize];
    let kind = random.below(5);
    let label = |p: DVec3, random: &mut Random| {
        let p = p - middle;
        let (height, beside) = (p.dot(across) + shift, p.reject_from(across).length());
        let is_inside = match kind {
            0 => height.abs() < thickness / 2.0,
            1 => beside < thickness / 2.0 + 0.3,
            2 => (p.length() - 4.0).abs() < thickness / 2.0,
            3 => random.below(30) == 0,
            _ => (p.length() - 1.0).abs() < thickness,
        };
        if is_inside { 2 } else { others[usize::from(height > 0.0)] }
    };
    let mut voxels = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                voxels.push(label(DVec3::from([x, y, z].map(|n| n as f64)), &mut random));
            }
        }
    }
    // Some label is needed.
    voxels[0] = 5;
    let spacing =
        [DVec3::ONE, DVec3::new(1.0, 1.0, 8.0), DVec3::new(0.3, 0.5, 2.0)][random.below(3) as usize];
    let [x, y, z] = dims;
    let init = VolumeInit::new(Voxels::U8(voxels), [x, y, z, 1]);
    Volume::new(VolumeInit { affine: DAffine3::from_scale(spacing), ..init }).unwrap()
}

fn check_random_thin(seeds: std::ops::Range<u64>) {
    let (mut warned, mut labels) = (0, 0);
    for seed in seeds {
        let what = format!("seed {seed}");
        let volume = random_thin(seed);
        let params = LabelParams { edge: [1.0, 1.0, 1.0, 2.0][seed as usize % 4], ..LabelParams::default() };
        let mut surfaces = LabelSurfaces::new(&volume, None, params).unwrap();
        settle(&mut surfaces);
        check(&surfaces, &what);
        let mut other = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
        other.restore(&surfaces.save()).unwrap();
        assert_eq!(other.step().unwrap().warnings, surfaces.step().unwrap().warnings, "{what}");
        warned += check_volumes(&mut surfaces, &volume, &what);
        labels += surfaces.labels().len();
    }
    println!("{warned} of {labels} labels are warned about");
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn random_thin_labels_have_their_volume_or_a_warning() {
    check_random_thin(0..40);
}

#[test]
#[ignore = "long: npm run test:all"]
fn many_random_thin_labels_have_their_volume_or_a_warning() {
    check_random_thin(40..240);
}

#[test]
fn thin_parts_are_kept() {
    let n = 30;
    let is_thin = |i: usize| {
        let [x, y, z] = [i % n, i / n % n, i / n / n];
        let in_wire = y == 5 && z == 5 && (3..27).contains(&x);
        let in_sheet = z == 15 && (4..26).contains(&x) && (4..26).contains(&y);
        in_wire || in_sheet || [x, y, z] == [15, 15, 25]
    };
    let volume = volume([n, n, n], (0..n * n * n).map(|i| u8::from(is_thin(i))).collect());
    let surfaces = settled(&volume);
    check(&surfaces, "thin parts");
    assert_voxels_are_inside(&surfaces, &volume);
    let mesh = surfaces.mesh(1.0).unwrap();
    let volumes: Vec<f64> = mesh.components().iter().map(|part| measure(part).volume).collect();
    // A wire of one voxel by one, a sheet of one voxel, and a voxel; the order is that of the voxels.
    for (volume, voxels) in volumes.iter().zip([24.0, 484.0, 1.0]) {
        assert!((volume / voxels - 1.0).abs() < 0.15, "{volumes:?}");
    }
    assert_eq!(mesh.components().len(), 3);
}

#[test]
fn normals_are_near_those_of_a_ball() {
    let n = 36;
    let centre = DVec3::new(17.3, 18.1, 17.7);
    for radius in [6.0, 15.0] {
        let volume = volume(
            [n, n, n],
            (0..n * n * n).map(|i| u8::from(centre_of(i, n).distance(centre) < radius)).collect(),
        );
        let mesh = settled(&volume).mesh(1.0).unwrap();
        let (mut sum, mut total) = (0.0, 0.0);
        for corners in mesh.corners() {
            let [a, b, c] = corners.map(|p| p.as_dvec3());
            let area = (b - a).cross(c - a);
            let out = ((a + b + c) / 3.0 - centre).normalize();
            let angle = area.angle_between(out);
            sum += area.length() * angle * angle;
            total += area.length();
        }
        let angle = (sum / total).sqrt().to_degrees();
        assert!(angle < 6.0, "radius {radius}: {angle}°");
        for p in &mesh.positions {
            assert!((p.as_dvec3().distance(centre) - radius).abs() < 0.7);
        }
    }
}

/// A brush that paints random strokes on a label map.
struct Brush {
    random: Random,
    labels: u32,
}

impl Brush {
    /// Paints a ball or a box of a random label, or of the background, and returns the region.
    fn paint(&mut self, volume: &mut Volume) -> Region {
        let dims = volume.dims();
        let mut min = [0; 3];
        let mut size = [0; 3];
        for axis in 0..3 {
            size[axis] = 1 + self.random.below((dims[axis] as u32 / 2).max(1)) as usize;
            min[axis] = self.random.below((dims[axis] - size[axis] + 1) as u32) as usize;
        }
        let region = Region { min, dims: size };
        let label = self.random.below(self.labels + 1) as u8;
        let is_ball = self.random.below(2) == 0;
        let mut data = Vec::new();
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let squared: f64 = [(x, size[0]), (y, size[1]), (z, size[2])]
                        .map(|(i, n)| (2 * i + 1) as f64 / n as f64 - 1.0)
                        .map(|x| x * x)
                        .iter()
                        .sum();
                    let index = min[0] + x + dims[0] * (min[1] + y + dims[1] * (min[2] + z));
                    let old = volume.voxels().get(index).unwrap() as u8;
                    data.push(if !is_ball || squared <= 1.0 { label } else { old });
                }
            }
        }
        volume.write(region, &Voxels::U8(data), 0).unwrap();
        region
    }
}

/// The surface and the versions of each label.
struct Copies(Vec<(f64, TriangleMesh, [u32; 2])>);

impl Copies {
    fn of(surfaces: &LabelSurfaces) -> Self {
        let values = surfaces.nets.grid.values().iter();
        let copy = |&label: &f64| {
            let mesh = surfaces.mesh(label).unwrap();
            let counts = [mesh.positions.len(), mesh.triangles.len()];
            assert_eq!(counts, surfaces.mesh_counts(label).unwrap(), "label {label}");
            (label, mesh, surfaces.mesh_versions(label).unwrap())
        };
        Self(values.map(copy).collect())
    }

    /// Takes new copies, asserts that versions have increased where surfaces have changed, and returns the labels whose
    /// version has increased and whose surface has not changed.
    fn update(&mut self, surfaces: &LabelSurfaces, what: &str) -> Vec<f64> {
        let before = std::mem::replace(self, Self::of(surfaces));
        let mut needless = Vec::new();
        for (label, mesh, [topology, geometry]) in before.0 {
            let (_, now, versions) = self.0.iter().find(|copy| copy.0 == label).unwrap();
            let what = format!("{what}, label {label}");
            assert!(versions[0] > topology || now.triangles == mesh.triangles, "{what}: triangles");
            assert!(versions[1] > geometry || now.positions == mesh.positions, "{what}: positions");
            assert!(versions[0] == topology || versions[1] > geometry, "{what}: {versions:?}");
            if versions[1] > geometry && *now == mesh {
                needless.push(label);
            }
        }
        needless
    }
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn versions_increase_only_for_surfaces_that_change() {
    let n = 60;
    let label = |i: usize| {
        let [x, y, z] = [i % n, i / n % n, i / n / n].map(|i| i / 10);
        if (x + y + z).is_multiple_of(2) { (1 + x + 6 * y + 36 * z) as u8 } else { 0 }
    };
    let mut volume = volume([n, n, n], (0..n * n * n).map(label).collect());
    let mut surfaces = settled(&volume);
    let mut copies = Copies::of(&surfaces);
    let versions = |surfaces: &LabelSurfaces| -> Vec<[u32; 2]> {
        surfaces.labels().iter().map(|&label| surfaces.mesh_versions(label).unwrap()).collect()
    };
    let before = versions(&surfaces);
    let region = Region { min: [24, 26, 23], dims: [3, 3, 3] };
    volume.write(region, &Voxels::U8(vec![1; 27]), 0).unwrap();
    surfaces.refresh(&volume, region).unwrap();
    assert_eq!(copies.update(&surfaces, "refreshed"), [0.0; 0]);
    // One label loses voxels, and one gets some.
    let changed = |now: &[[u32; 2]]| now.iter().zip(&before).filter(|(now, before)| now != before).count();
    assert_eq!(changed(&versions(&surfaces)), 2);
    settle(&mut surfaces);
    // Of labels at the end of the zone, some move by less than rounding shows.
    assert!(copies.update(&surfaces, "settled").len() < 4);
    assert!((2..20).contains(&changed(&versions(&surfaces))) && before.len() == 108);
    // Nothing moves any more.
    let before = (surfaces.versions(), versions(&surfaces));
    surfaces.step().unwrap();
    assert_eq!((surfaces.versions(), versions(&surfaces)), before);
}

/// Asserts that the surfaces are coarsened as they would be from the beginning.
fn assert_coarse_anew(surfaces: &LabelSurfaces, what: &str) {
    let mut anew = surfaces.nets.clone();
    anew.coarse = super::coarsen::Coarsening::default();
    let edge = surfaces.params.edge;
    finished(anew.coarsen(edge, &anew.everywhere(), false, &mut [], &Pauses::default()));
    if let Some(pending) = surfaces.nets.coarse.pending {
        finished(anew.coarsen(edge, &pending, true, &mut [], &Pauses::default()));
    }
    for slot in surfaces.nets.cells.within(&anew.everywhere()) {
        let found = [&surfaces.nets, &anew].map(|nets| (nets.coarse.target(slot), nets.coarse.shift(slot)));
        assert_eq!(found[0], found[1], "{what}, slot {slot}");
    }
}

/// Paints strokes, and compares the surfaces after each with those of the label map as it is then.
fn fuzz_strokes(seed: u64, strokes: usize) {
    let mut random = Random::new(seed);
    let dims = [5, 6, 7].map(|n| n + random.below(6) as usize);
    let labels = 1 + random.below(5);
    let mut volume = noise(dims, if random.below(2) == 0 { 0 } else { labels }, seed);
    let mut brush = Brush { random, labels };
    let params = LabelParams { edge: [1.0, 1.5, 2.0, 4.0][seed as usize % 4], ..LabelParams::default() };
    let mut surfaces = LabelSurfaces::new(&volume, None, params.clone()).unwrap();
    let mut copies = Copies::of(&surfaces);
    for stroke in 0..strokes {
        let what = format!("seed {seed}, stroke {stroke}");
        let region = brush.paint(&mut volume);
        surfaces.refresh(&volume, region).unwrap();
        check(&surfaces, &what);
        assert_coarse_anew(&surfaces, &what);
        copies.update(&surfaces, &what);
        // Some strokes follow before the surfaces are settled.
        if brush.random.below(3) > 0 {
            settle(&mut surfaces);
            check(&surfaces, &what);
            copies.update(&surfaces, &what);
        }
        let anew = LabelSurfaces::new(&volume, None, params.clone()).unwrap();
        assert_eq!(
            (surfaces.labels(), surfaces.counts, surfaces.components.count()),
            (anew.labels(), anew.counts, anew.components.count()),
            "{what}"
        );
    }
    settle(&mut surfaces);
    assert_voxels_are_inside(&surfaces, &volume);
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn surfaces_follow_random_strokes() {
    (0..4).for_each(|seed| fuzz_strokes(seed, 6));
    // Polygons touched with all vertices in the middle of their cells.
    fuzz_strokes(709, 10);
}

#[test]
#[cfg(not(target_arch = "wasm32"))]
#[ignore = "1,500 strokes take minutes: npm run test:all"]
fn fuzz_surfaces_follow_many_random_strokes() {
    seeds(150).for_each(|seed| fuzz_strokes(100 + seed, 10));
}

#[test]
fn only_surfaces_near_a_stroke_change() {
    let mut volume = balls(48, 4, 8);
    let mut surfaces = settled(&volume);
    let before = surfaces.surface();
    let region = Region { min: [22, 23, 24], dims: [3, 3, 3] };
    volume.write(region, &Voxels::U8(vec![0; 27]), 0).unwrap();
    surfaces.refresh(&volume, region).unwrap();
    assert!(surfaces.step().unwrap().done);
    let is_far = |p: &&Vec3| (p.as_dvec3() - DVec3::splat(24.0)).abs().max_element() > f64::from(HALO + 4);
    let far = |mesh: &TriangleMesh| {
        let mut far: Vec<[u32; 3]> =
            mesh.positions.iter().filter(is_far).map(|p| p.to_array().map(f32::to_bits)).collect();
        far.sort_unstable();
        far
    };
    assert!(far(&before).len() > 1000);
    assert!(far(&before) == far(&surfaces.surface()));
    // The same voxels once more change nothing but what is smoothed.
    let counts = surfaces.counts;
    surfaces.refresh(&volume, region).unwrap();
    assert_eq!(surfaces.counts, counts);
}

#[test]
fn a_saved_run_continues_with_the_same_bits() {
    let mut volume = balls(40, 5, 6);
    let mut surfaces =
        LabelSurfaces::new(&volume, None, LabelParams { smoothing: 25, ..LabelParams::default() }).unwrap();
    let mut brush = Brush { random: Random::new(1), labels: 6 };
    for _ in 0..4 {
        surfaces.step().unwrap();
        let region = brush.paint(&mut volume);
        surfaces.refresh(&volume, region).unwrap();
    }
    let state = surfaces.save();
    let mut other = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
    let mut copies = Copies::of(&other);
    other.restore(&state).unwrap();
    assert!(other.save() == state);
    copies.update(&other, "restored");
    assert_eq!(other.counts, surfaces.counts);
    let region = brush.paint(&mut volume);
    for surfaces in [&mut surfaces, &mut other] {
        surfaces.step().unwrap();
        surfaces.refresh(&volume, region).unwrap();
        settle(surfaces);
    }
    assert!(other.surface() == surfaces.surface());
    check(&other, "restored");
    // The label map has changed since.
    assert!(other.restore(&state).unwrap_err().to_string().contains("another label map"));
    for length in [0, 7, 20, state.len() - 1] {
        assert!(other.restore(&state[..length]).is_err());
    }
}

#[test]
fn only_labels_asked_for_have_surfaces() {
    let mut volume = volume([6, 3, 3], (0..54).map(|i| [1, 1, 2, 2, 3, 3][i % 6]).collect());
    let mut surfaces = LabelSurfaces::new(&volume, Some(vec![3.0, 1.0]), LabelParams::default()).unwrap();
    assert_eq!(surfaces.labels(), [1.0, 3.0]);
    assert!(surfaces.mesh(2.0).unwrap_err().to_string().starts_with("label: "));
    let region = Region { min: [0; 3], dims: [6, 3, 3] };
    volume.write(region, &Voxels::U8((0..54).map(|i| [4, 2, 2, 2, 3, 3][i % 6]).collect()), 0).unwrap();
    surfaces.refresh(&volume, region).unwrap();
    settle(&mut surfaces);
    assert_eq!(surfaces.labels(), [3.0]);
    assert!(surfaces.mesh(1.0).unwrap().triangles.is_empty());
    assert!(surfaces.mesh(4.0).is_err());
    assert_eq!(surfaces.components.count(), 1);
}

#[test]
fn bad_input_is_named_and_changes_nothing() {
    let good = balls(20, 6, 3);
    let refusal = |result: Result<LabelSurfaces, MethodError>| result.err().unwrap().to_string();
    for (labels, smoothing, start) in [
        (Some(vec![]), 20, "labels: must be at least one"),
        (Some(vec![1.0, 77.0]), 20, "labels: must be labels of the volume, got 77"),
        (None, 201, "smoothing: must be"),
    ] {
        let found =
            refusal(LabelSurfaces::new(&good, labels, LabelParams { smoothing, ..LabelParams::default() }));
        assert!(found.starts_with(start), "{found}");
    }
    let floats = Volume::new(VolumeInit::new(Voxels::F32(vec![1.0; 8]), [2, 2, 2, 1])).unwrap();
    assert!(refusal(LabelSurfaces::new(&floats, None, LabelParams::default())).contains("integer type"));
    let far = VolumeInit {
        affine: DAffine3::from_translation(DVec3::splat(1e6)),
        ..VolumeInit::new(Voxels::U8(vec![1; 10_001]), [10_001, 1, 1, 1])
    };
    let found = refusal(LabelSurfaces::new(&Volume::new(far).unwrap(), None, LabelParams::default()));
    assert!(found.starts_with("volume: ") && found.contains("10000"), "{found}");

    let mut surfaces = settled(&good);
    let before = surfaces.save();
    let region = Region { min: [0; 3], dims: [2; 3] };
    let halves =
        Volume::new(VolumeInit { slope: 0.5, ..VolumeInit::new(Voxels::U8(vec![1; 8000]), [20, 20, 20, 1]) });
    for (volume, region, start) in [
        (&good, Region { min: [19, 0, 0], dims: [2; 3] }, "region: must"),
        (&good, Region { min: [0; 3], dims: [0, 1, 1] }, "region: must"),
        (&balls(21, 6, 3), region, "volume: must have the grid"),
        (&halves.unwrap(), region, "volume: must have integer"),
    ] {
        let found = surfaces.refresh(volume, region).unwrap_err().to_string();
        assert!(found.starts_with(start), "{found}");
        assert!(surfaces.save() == before);
    }
    check(&surfaces, "after bad input");
}

const WIDE: [usize; 3] = [256, 257, 1];

/// Returns a slice of as many voxels as there may be labels, and some more, with the label of each.
fn slice(label: impl Fn(u32) -> u32) -> Volume {
    let voxels = Voxels::U32((0..256 * 257).map(label).collect());
    Volume::new(VolumeInit::new(voxels, [256, 257, 1, 1])).unwrap()
}

#[test]
#[ignore = "long: npm run test:all"]
fn the_most_labels_are_accepted() {
    let all = slice(|i| i.min(65_536));
    let some = (0..65_535).map(|i| f64::from(i + 1)).collect();
    let mut most =
        LabelSurfaces::new(&all, Some(some), LabelParams { smoothing: 0, ..LabelParams::default() }).unwrap();
    assert_eq!((most.labels().len(), most.components.count()), (65_535, 65_535));
    most.refresh(&all, Region { min: [0; 3], dims: WIDE }).unwrap();
    most.restore(&most.save()).unwrap();
    assert_eq!(most.mesh(65_535.0).unwrap().components().len(), 1);
}

#[test]
fn too_many_labels_are_refused_and_change_nothing() {
    let few = slice(|_| 7);
    let many = slice(|i| i.min(65_536));
    let refused = LabelSurfaces::new(&many, None, LabelParams::default()).err().unwrap().to_string();
    assert!(refused.contains("at most 65535 labels"), "{refused}");
    let mut surfaces =
        LabelSurfaces::new(&few, None, LabelParams { smoothing: 0, ..LabelParams::default() }).unwrap();
    let before = surfaces.save();
    let refused = surfaces.refresh(&many, Region { min: [0; 3], dims: WIDE }).unwrap_err().to_string();
    assert!(refused.contains("at most 65535 labels"), "{refused}");
    assert!(surfaces.save() == before);
    assert_eq!((surfaces.labels(), surfaces.nets.grid.number(9.0)), (vec![7.0], None));
}

/// Returns the mean edge length of a mesh.
fn mean_edge(mesh: &TriangleMesh) -> f64 {
    let sum: f64 =
        mesh.corners().map(|[a, b, c]| f64::from(a.distance(b) + b.distance(c) + c.distance(a))).sum();
    sum / (3.0 * mesh.triangles.len() as f64)
}

/// Returns the largest distance, where labels touch, of the centres of triangles from the surface of the other label: these
/// triangles come from polygons around edges of the grid between the two.
fn largest_gap(surfaces: &LabelSurfaces) -> f64 {
    let nets = &surfaces.nets;
    let trees: Vec<_> = (1..=9).map(|number| TriangleTree::new(&nets.mesh(number)).unwrap()).collect();
    let mut largest = 0.0_f64;
    for slot in nets.cells.within(&nets.everywhere()) {
        for crossing in nets.crossings(slot).filter(|crossing| !crossing.ends.contains(&0)) {
            for (far, other) in [(false, crossing.ends[1]), (true, crossing.ends[0])] {
                let number = crossing.ends[usize::from(far)];
                for triangle in nets.patch(&crossing, far).triangles() {
                    let position = |vertex: &NetVertex| {
                        let vertex = nets.coarse.follow(*vertex);
                        let NetVertex::Cell { slot, .. } = vertex else {
                            return nets.world_position(number, vertex);
                        };
                        nets.shifted_position(number, vertex, nets.coarse.shift(slot))
                    };
                    let centre = triangle.iter().map(position).sum::<Vec3>() / 3.0;
                    let distance = trees[usize::from(other) - 1].closest(centre).unwrap().distance;
                    largest = largest.max(distance);
                }
            }
        }
    }
    largest
}

#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn longer_edges_keep_voxels_gaps_and_topology() {
    let volume = balls(44, 4, 9);
    let mut surfaces = settled(&volume);
    let (fine, before) = (surfaces.surface(), surfaces.versions());
    let mut triangles = fine.triangles.len();
    for edge in [1.5, 2.0, 3.0] {
        let what = format!("edge {edge}");
        surfaces.set_params(LabelParams { edge, ..LabelParams::default() }).unwrap();
        assert!(surfaces.step().unwrap().done, "nothing is smoothed again");
        check(&surfaces, &what);
        assert_voxels_are_inside(&surfaces, &volume);
        let mesh = surfaces.surface();
        let mean = mean_edge(&mesh);
        assert!((0.8 * edge..1.1 * edge).contains(&mean), "{what}: {mean}");
        assert!(f64::from(mesh.triangles.len() as u32) < 0.7 * f64::from(triangles as u32), "{what}");
        triangles = mesh.triangles.len();
        let gap = largest_gap(&surfaces);
        assert!(gap < 0.05, "{what}: {gap}");
        for label in volume.labels(0).unwrap().iter().filter(|label| label.voxels >= 500) {
            let error = measure(&surfaces.mesh(label.value).unwrap()).volume / label.voxels as f64 - 1.0;
            assert!(error.abs() < 0.015, "{what}, label {}: {error}", label.value);
        }
    }
    assert!(surfaces.versions()[0] > before[0]);
    surfaces.set_params(LabelParams::default()).unwrap();
    assert!(surfaces.surface() == fine);
}

#[test]
#[ignore = "long: npm run test:all"]
fn coarse_surfaces_follow_strokes_as_if_made_anew() {
    let mut volume = balls(44, 4, 9);
    let params = LabelParams { edge: 1.5, ..LabelParams::default() };
    let mut surfaces = LabelSurfaces::new(&volume, None, params).unwrap();
    settle(&mut surfaces);
    let mut copies = Copies::of(&surfaces);
    let mut random = Random::new(7);
    for stroke in 0..6 {
        let what = format!("stroke {stroke}");
        let min = [0; 3].map(|_| 8 + random.below(22) as usize);
        let region = Region { min, dims: [5, 6, 4] };
        volume.write(region, &Voxels::U8(vec![random.below(10) as u8; 120]), 0).unwrap();
        surfaces.refresh(&volume, region).unwrap();
        for what in [format!("{what}, refreshed"), what] {
            check(&surfaces, &what);
            assert_coarse_anew(&surfaces, &what);
            copies.update(&surfaces, &what);
            settle(&mut surfaces);
        }
    }
    assert_voxels_are_inside(&surfaces, &volume);
    let state = surfaces.save();
    let mut other = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
    other.restore(&state).unwrap();
    assert!(other.surface() == surfaces.surface());
}

/// Single voxels, each with a surface in all cells around it.
fn dust(side: usize) -> Volume {
    let is_grain = |i: usize| [i % side, i / side % side, i / side / side].iter().all(|at| at % 2 == 1);
    volume([side; 3], (0..side.pow(3)).map(|i| u8::from(is_grain(i))).collect())
}

#[test]
fn creation_pauses_in_each_of_its_parts() {
    let volume = dust(40);
    let mut creation = Box::pin(LabelSurfaces::begin(&volume, None, LabelParams::default(), None).unwrap());
    let mut pauses = 0;
    while advance(&mut creation).is_pending() {
        pauses += 1;
    }
    // For each cell, nine units of work: to find, list and count it, to join components, to link it with its neighbours, ...
    let cells = 40_usize.pow(3);
    assert!(pauses > 9 * cells / 500, "{pauses}");
}

#[test]
fn longer_edges_are_made_by_a_step_that_pauses_within_a_tile() {
    let mut surfaces = settled(&dust(28));
    let fine = surfaces.surface();
    // A tile is larger than the volume.
    surfaces.set_params(LabelParams { edge: 4.0, ..LabelParams::default() }).unwrap();
    assert!(surfaces.surface() == fine);
    let mut copy = LabelSurfaces::new(&dust(28), None, LabelParams::default()).unwrap();
    copy.restore(&surfaces.save()).unwrap();
    let mut step = Box::pin(surfaces.step_in_slices());
    let mut pauses = 0;
    while advance(&mut step).is_pending() {
        pauses += 1;
    }
    drop(step);
    // A unit for each of the cells in each round, and some for each of the many merges that are tried.
    assert!(pauses > 2 * 28_usize.pow(3) / 500, "{pauses}");
    check(&surfaces, "coarse");
    assert!(surfaces.surface().triangles.len() < fine.triangles.len());
    assert!(copy.step().unwrap().done);
    assert!(copy.surface() == surfaces.surface());
}

#[test]
fn surfaces_everywhere_in_a_large_volume_are_refused() {
    let refusal = LabelSurfaces::new(&dust(205), None, LabelParams::default()).err().unwrap().to_string();
    assert!(refusal.starts_with("volume: ") && refusal.contains("8000000 cells"), "{refusal}");
}

#[test]
fn surfaces_made_in_slices_are_the_same() {
    let volume = noise([12, 11, 10], 3, 5);
    let mut whole = LabelSurfaces::new(&volume, None, LabelParams::default()).unwrap();
    let mut creation = Box::pin(LabelSurfaces::begin(&volume, None, LabelParams::default(), None).unwrap());
    let (mut slices, mut created) = (1, None);
    while created.is_none() {
        match advance(&mut creation) {
            Poll::Pending => slices += 1,
            Poll::Ready(surfaces) => created = Some(surfaces.unwrap()),
        }
    }
    let mut sliced = created.unwrap();
    assert_eq!(sliced.save(), whole.save());
    // Work is in many slices, so that none takes long.
    assert!(slices > 10, "{slices}");
    loop {
        let report = whole.step().unwrap();
        let (mut step, mut found) = (Box::pin(sliced.step_in_slices()), None);
        slices = 1;
        while found.is_none() {
            match advance(&mut step) {
                Poll::Pending => slices += 1,
                Poll::Ready(report) => found = Some(report.unwrap()),
            }
        }
        drop(step);
        assert_eq!((found.as_ref().map(|found| found.done), slices > 10), (Some(report.done), true));
        assert_eq!(sliced.save(), whole.save());
        if report.done {
            break;
        }
    }
    check(&sliced, "in slices");
}
