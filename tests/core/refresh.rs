//! The deformable model after strokes of a brush on its volume: topology, coverage and validity after each.

use super::common::scenes;
use super::common::strokes::{ISO, Scene, Stroke, StrokeKind};
use super::common::{Named, Random, assert_at_least, euler_of_parts, seeds};
use std::sync::OnceLock;
use vesicle::math::{DAffine3, DVec3, Vec3};
use vesicle::mesh::count_self_intersections;
use vesicle::methods::deformable::{DeformableModel, DeformableOptions, DeformableParams, Topology};
use vesicle::methods::{MethodError, StepReport};
use vesicle::volume::{Region, Volume, VolumeInit, Voxels, marching_cubes};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Voxels along each side of the volume, and the radius of the brush in voxels.
const SIDE: usize = 80;
const BRUSH: f32 = 3.0;

fn options(volume: &Volume) -> DeformableOptions {
    let params = DeformableParams { iso: ISO, ..DeformableParams::for_volume(volume) };
    DeformableOptions { params: Some(params), ..Default::default() }
}

fn settled(volume: &Volume) -> DeformableModel {
    let mut model = DeformableModel::new(volume, options(volume)).unwrap();
    while !model.step().unwrap().done {}
    model
}

/// Returns the scene without strokes and the model settled on it, which several tests begin with.
fn settled_scene(is_smooth: bool) -> (Scene, DeformableModel) {
    static SCENES: [OnceLock<(Scene, DeformableModel)>; 2] = [OnceLock::new(), OnceLock::new()];
    let make = || {
        let scene = Scene::new(SIDE, BRUSH, is_smooth);
        let model = settled(&scene.volume);
        (scene, model)
    };
    SCENES[usize::from(is_smooth)].get_or_init(make).clone()
}

fn check(model: &DeformableModel) {
    assert_eq!(model.mesh().check(), Ok(()));
    assert_eq!(count_self_intersections(&model.mesh().to_triangles()), 0);
}

/// Steps until done, and asserts after each step that the mesh is valid and free of self-intersections.
fn settle(model: &mut DeformableModel, most: u32) -> StepReport {
    check(model);
    for _ in 0..most {
        let report = model.step().unwrap();
        check(model);
        assert_eq!(report.components as usize, model.mesh().component_count());
        if report.done {
            return report;
        }
    }
    panic!("not done after {most} iterations");
}

/// Returns χ of each part of the iso-surface of a volume, without parts below 64 voxels, sorted.
fn expected_parts(volume: &Volume) -> Vec<i64> {
    let contour = marching_cubes(&volume.grid(0).unwrap(), ISO as f32).unwrap();
    let mut parts = euler_of_parts(&contour.without_components_below(64.0));
    parts.sort_unstable();
    parts
}

fn parts(model: &DeformableModel) -> Vec<i64> {
    let mut parts = euler_of_parts(&model.surface());
    parts.sort_unstable();
    parts
}

fn assert_covered(model: &DeformableModel) {
    let coverage = model.coverage().unwrap();
    assert!(coverage.recall >= 0.99 && coverage.precision >= 0.99, "{coverage:?}");
}

/// Makes one stroke of a kind on a settled model, lets it settle, and returns χ and the number of parts before and after.
fn stroke(kind: StrokeKind, is_smooth: bool) -> [(i64, usize); 2] {
    let (mut scene, mut model) = settled_scene(is_smooth);
    let mut random = Random(5);
    if kind == StrokeKind::EraseIsland {
        let island = scene.stroke(StrokeKind::Island, &mut random).unwrap();
        scene.paint(island);
        model = settled(&scene.volume);
    }
    let counts = |model: &DeformableModel| (model.mesh().euler(), model.mesh().component_count());
    let before = counts(&model);
    let stroke = scene.stroke(kind, &mut random).unwrap();
    let region = scene.paint(stroke);
    let unchanged = model.mesh().positions().to_vec();
    model.refresh(&scene.volume, region).unwrap();
    settle(&mut model, 12);
    assert_eq!(parts(&model), expected_parts(&scene.volume), "{kind:?}");
    assert_covered(&model);
    // Far from the stroke nothing moves.
    let middle = (stroke.ends[0] + stroke.ends[1]) * 0.5;
    let far = |p: Vec3| p.distance(middle) > 6.0 * BRUSH;
    for v in model.mesh().vertices().filter(|&v| far(model.mesh().position(v))) {
        assert_eq!(unchanged.get(v.index()), Some(&model.mesh().position(v)));
    }
    [before, counts(&model)]
}

fn changes(kind: StrokeKind) -> (i64, i64) {
    let [before, after] = stroke(kind, true);
    assert_eq!(stroke(kind, false).map(|(_, parts)| parts), [before.1, after.1]);
    (after.0 - before.0, after.1 as i64 - before.1 as i64)
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn added_matter_is_a_bump() {
    assert_eq!(changes(StrokeKind::Add), (0, 0));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn erased_matter_is_a_dent() {
    assert_eq!(changes(StrokeKind::Erase), (0, 0));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_bridge_is_a_handle() {
    assert_eq!(changes(StrokeKind::Bridge), (-2, 0));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_cut_bar_is_no_handle() {
    assert_eq!(changes(StrokeKind::Cut), (2, 0));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_hole_through_the_wall_joins_its_two_sides() {
    assert_eq!(changes(StrokeKind::Drill), (-2, -1));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn an_island_is_a_component() {
    assert_eq!(changes(StrokeKind::Island), (2, 1));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn an_erased_island_vanishes() {
    assert_eq!(changes(StrokeKind::EraseIsland), (-2, -1));
}

/// Returns a stroke anywhere in the volume, also beyond its border.
fn any_stroke(random: &mut Random) -> Stroke {
    let mut point = || Vec3::from([(); 3].map(|()| random.within(-3.0, SIDE as f64 + 2.0) as f32));
    let (a, b) = (point(), point());
    let ends = if random.below(2) == 0 { [a, a] } else { [a, a + (b - a).clamp_length_max(25.0)] };
    Stroke { ends, radius: random.within(1.0, 6.0) as f32, adds: random.below(2) == 0 }
}

/// Makes random strokes, and between them steps until done or only a few times. Returns the numbers of strokes and steps.
fn run(seed: u64) -> [usize; 2] {
    let _named = Named::new(seed);
    let mut random = Random(seed);
    let mut scene = Scene::new(SIDE, BRUSH, random.below(2) == 0);
    let mut options = options(&scene.volume);
    options.levels = random.below(2);
    let mut model = DeformableModel::new(&scene.volume, options).unwrap();
    let (mut strokes, mut steps) = (0, 0);
    let mut step = |model: &mut DeformableModel, most: usize| {
        for _ in 0..most {
            let report = model.step().unwrap();
            check(model);
            steps += 1;
            assert_eq!(report.euler as i64, model.mesh().euler());
            assert_eq!(report.components as usize, model.mesh().component_count());
            if report.done {
                return true;
            }
        }
        false
    };
    step(&mut model, if random.below(4) == 0 { 3 } else { 200 });
    for _ in 0..12 {
        let kind = StrokeKind::ALL[random.below(StrokeKind::ALL.len())];
        let stroke = match random.below(2) {
            0 => scene.stroke(kind, &mut random),
            _ => Some(any_stroke(&mut random)),
        };
        let Some(stroke) = stroke else { continue };
        let region = scene.paint(stroke);
        model.refresh(&scene.volume, region).unwrap();
        check(&model);
        strokes += 1;
        step(&mut model, [0, 1, 3, 200][random.below(4)]);
    }
    assert!(step(&mut model, 300), "not done");
    assert_covered(&model);
    [strokes, steps]
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn random_strokes_keep_the_mesh_valid_and_on_the_object() {
    let seeds = seeds(1);
    let mut sums = [0; 2];
    let few = seeds.end - seeds.start;
    for seed in seeds {
        run(seed).into_iter().zip(&mut sums).for_each(|(count, sum)| *sum += count);
    }
    assert_at_least(few as usize * 8, sums[0], "strokes");
    assert_at_least(few as usize * 20, sums[1], "steps");
}

/// Makes a model of a ball in 8-bit voxels, settled, with the volume.
fn ball(levels: usize) -> (Volume, DeformableModel) {
    let value =
        |p: Vec3| (FULL * (0.5 + 0.5 * (9.0 - p.distance(Vec3::splat(15.5)))).clamp(0.0, 1.0)).floor();
    let volume = bytes(scenes::volume([32; 3], value));
    let mut model = DeformableModel::new(&volume, DeformableOptions { levels, ..options(&volume) }).unwrap();
    while !model.step().unwrap().done {}
    (volume, model)
}

const FULL: f32 = 200.0;

fn bytes(volume: Volume) -> Volume {
    let values = volume.intensities(0).unwrap().into_iter().map(|value| value as u8).collect();
    scenes::placed(Voxels::U8(values), volume.dims(), volume.affine())
}

/// Sets all voxels of a region of the ball's volume.
fn fill(volume: &mut Volume, region: Region, value: u8) {
    let data = vec![value; region.dims.iter().product()];
    volume.write(region, &Voxels::U8(data), 0).unwrap();
}

/// A voxel so far from the surface of the ball that no force depends on it.
const DEEP: Region = Region { min: [15; 3], dims: [1; 3] };

const BUMP: Region = Region { min: [22, 12, 12], dims: [6, 7, 7] };

#[test]
fn voxels_that_have_not_changed_leave_the_surface_as_it_is() {
    for levels in [0, 1] {
        let (mut volume, mut model) = ball(levels);
        let before = model.mesh().clone();
        model.refresh(&volume, Region { min: [0; 3], dims: [32; 3] }).unwrap();
        assert!(model.step().unwrap().done);
        // Deep inside, the image changes, but not the surface.
        fill(&mut volume, DEEP, 201);
        fill(&mut volume, DEEP, 200);
        model.refresh(&volume, DEEP).unwrap();
        assert!(model.step().unwrap().done);
        fill(&mut volume, DEEP, 190);
        model.refresh(&volume, DEEP).unwrap();
        let report = model.step().unwrap();
        assert!(report.done && model.mesh().positions() == before.positions());
    }
}

#[test]
fn components_that_appear_and_vanish_are_reported_as_such() {
    let (mut volume, mut model) = ball(0);
    let island = Region { min: [1; 3], dims: [5; 3] };
    for (value, expected) in [(200, (1, 0)), (0, (0, 1))] {
        fill(&mut volume, island, value);
        model.refresh(&volume, island).unwrap();
        let events = model.step().unwrap().events;
        assert_eq!((events.seeds, events.vanished), expected);
        settle(&mut model, 30);
    }
}

#[test]
fn a_refreshed_run_is_restored_bit_for_bit_with_the_present_volume_only() {
    for levels in [0, 1] {
        let (mut volume, mut model) = ball(levels);
        let old = model.save();
        fill(&mut volume, BUMP, 200);
        model.refresh(&volume, BUMP).unwrap();
        let mut states = vec![model.save()];
        while !model.step().unwrap().done {
            states.push(model.save());
        }
        assert!(matches!(model.restore(&old), Err(MethodError::BadState { field: "volume", .. })));
        for state in states {
            let mut other =
                DeformableModel::new(&volume, DeformableOptions { levels, ..options(&volume) }).unwrap();
            other.restore(&state).unwrap();
            while !other.step().unwrap().done {}
            assert_eq!(other.save(), model.save());
        }
        // With the voxels as they were, the state before fits again.
        let original = ball(levels).0;
        model.refresh(&original, BUMP).unwrap();
        model.restore(&old).unwrap();
        assert_eq!(model.save(), old);
    }
}

/// The range of intensities, by which they are normalised, changes with the first stroke in an empty volume.
#[test]
fn the_first_stroke_in_an_empty_volume_makes_a_surface() {
    let mut volume = scenes::placed(Voxels::U8(vec![0; 32 * 32 * 32]), [32; 3], DAffine3::IDENTITY);
    let mut model = DeformableModel::new(&volume, options(&volume)).unwrap();
    assert!(model.surface().triangles.is_empty());
    fill(&mut volume, BUMP, 200);
    model.refresh(&volume, BUMP).unwrap();
    settle(&mut model, 60);
    assert_eq!(parts(&model), [2]);
    assert_covered(&model);
    fill(&mut volume, BUMP, 0);
    model.refresh(&volume, BUMP).unwrap();
    settle(&mut model, 60);
    assert!(model.surface().triangles.is_empty());
}

#[test]
fn a_fixed_topology_only_moves() {
    let (mut volume, mut model) = ball(0);
    model.set_params(DeformableParams { topology: Topology::Fixed, ..model.params().clone() }).unwrap();
    while !model.step().unwrap().done {}
    let version = model.mesh().topology_version();
    let rim = Region { min: [24, 14, 14], dims: [2, 3, 3] };
    fill(&mut volume, rim, 200);
    model.refresh(&volume, rim).unwrap();
    let highest = |model: &DeformableModel| model.mesh().positions().iter().map(|p| p.x).fold(0.0, f32::max);
    let before = highest(&model);
    settle(&mut model, 100);
    assert_eq!(model.mesh().topology_version(), version);
    assert!(highest(&model) > before + 0.3, "{before} to {}", highest(&model));
}

#[test]
fn what_is_refused_changes_nothing() {
    let (mut volume, mut model) = ball(0);
    let before = model.save();
    for (min, dims) in [([0; 3], [0, 1, 1]), ([30, 0, 0], [3, 1, 1]), ([usize::MAX, 0, 0], [2, 1, 1])] {
        let refused = model.refresh(&volume, Region { min, dims }).unwrap_err().to_string();
        assert!(refused.starts_with("region: must have"), "{refused}");
    }
    let moved = Volume::new(VolumeInit {
        affine: DAffine3::from_translation(DVec3::X),
        ..VolumeInit::new(volume.voxels().clone(), [32, 32, 32, 1])
    });
    let other = scenes::placed(Voxels::U8(vec![0; 64]), [4; 3], DAffine3::IDENTITY);
    fill(&mut volume, BUMP, 200);
    for other in [moved.unwrap(), other] {
        let refused = model.refresh(&other, BUMP);
        assert!(
            matches!(refused, Err(MethodError::InvalidArgument { parameter: "volume", .. })),
            "{refused:?}"
        );
    }
    assert_eq!(model.save(), before);
}
