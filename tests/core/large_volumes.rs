//! The deformable model on volumes of which only bricks are loaded.

use super::common::stores::{Store, branching};
use super::common::{Named, Random, euler_of_parts, fingerprint};
use vesicle::math::{DAffine3, DVec3};
use vesicle::mesh::count_self_intersections;
use vesicle::methods::deformable::{
    DeformableModel, DeformableParams, Integrator, Seeding, SparseOptions, WorldBox,
};
use vesicle::methods::{MethodError, StepReport};
use vesicle::volume::{BRICK, BrickBox, Region, SparseInit, SparseLevel, SparseVolume, VolumeError, Voxels};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// A store with bricks on three levels.
fn store() -> Store {
    Store::new(144, 3, branching(144))
}

fn options() -> SparseOptions {
    let within = WorldBox { min: DVec3::new(10.0, 20.0, 20.0), max: DVec3::new(104.0, 110.0, 100.0) };
    SparseOptions { within: Some(within), whole: Some(1), ..SparseOptions::default() }
}

/// Runs a model to its end, and calls `provide` for the boxes it needs. Returns the fingerprints of the mesh after each
/// step, and the model.
fn run(
    volume: &SparseVolume,
    options: SparseOptions,
    mut provide: impl FnMut(&[BrickBox]),
) -> (Vec<u64>, DeformableModel) {
    let mut model = DeformableModel::on_sparse(volume, options).unwrap();
    let mut prints = Vec::new();
    loop {
        let before = fingerprint(&model.surface().positions);
        match model.step() {
            Ok(report) => {
                assert_eq!(model.mesh().check(), Ok(()));
                assert_eq!(i64::from(report.euler), model.mesh().euler());
                prints.push(fingerprint(&model.surface().positions));
                if report.done {
                    return (prints, model);
                }
                assert!(report.iteration < 300, "{report:?}");
            }
            Err(MethodError::NeedsData { needs }) => {
                assert_eq!(
                    fingerprint(&model.surface().positions),
                    before,
                    "a step without data has changed the surface"
                );
                assert!(!needs.is_empty());
                provide(&needs);
            }
            Err(error) => panic!("{error}"),
        }
    }
}

/// Inserts all bricks of all levels.
fn load_all(store: &Store, volume: &SparseVolume) {
    (0..store.levels.len()).for_each(|level| store.load(volume, &volume.missing(level).unwrap()));
}

/// Returns the bricks of some boxes one by one.
fn single_bricks(boxes: &[BrickBox]) -> Vec<BrickBox> {
    let split = |at: &BrickBox| {
        let BrickBox { level, region } = *at;
        let count = region.dims[0].div_ceil(BRICK);
        (0..count).map(move |k| {
            let mut brick = region;
            brick.min[0] += k * BRICK;
            brick.dims[0] = BRICK.min(region.dims[0] - k * BRICK);
            BrickBox { level, region: brick }
        })
    };
    boxes.iter().flat_map(split).collect()
}

/// Delivers a random part of the boxes asked for, in random order and with repetitions, among others that were not asked
/// for.
fn deliver(store: &Store, volume: &SparseVolume, needs: &[BrickBox], random: &mut Random) {
    let mut bricks = single_bricks(needs);
    let share = 1 + random.below(bricks.len());
    for k in 0..share {
        let other = k + random.below(bricks.len() - k);
        bricks.swap(k, other);
    }
    store.load(volume, &bricks[..share]);
    let again = bricks[random.below(share)];
    store.load(volume, &[again]);
    let spare = volume.missing(random.below(store.levels.len())).unwrap();
    if random.below(4) == 0 && !spare.is_empty() {
        store.load(volume, &spare[..1]);
    }
}

#[test]
#[ignore = "long: npm run test:all"]
fn the_surface_does_not_depend_on_the_order_in_which_bricks_arrive() {
    let store = store();
    for options in [options(), SparseOptions { finest: 1, ..SparseOptions::default() }] {
        let volume = store.volume();
        load_all(&store, &volume);
        let (expected, model) = run(&volume, options.clone(), |_| panic!("everything was loaded"));
        assert_eq!(count_self_intersections(&model.surface()), 0);
        assert_eq!(euler_of_parts(&model.surface()), [2, 2]);
        for seed in 0..20 {
            let _named = Named::new(seed);
            let mut random = Random(seed);
            let volume = store.volume();
            let mut asked = 0;
            let (found, _) = run(&volume, options.clone(), |needs| {
                asked += 1;
                deliver(&store, &volume, needs, &mut random);
            });
            assert!(asked > 1);
            assert!(found == expected, "seed {seed}");
        }
    }
}

/// Bricks that arrive long before they are asked for, or are dropped and asked for again, change nothing; a model shares
/// its bricks with another one that drops them.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn two_models_share_a_volume() {
    let store = store();
    let alone = store.volume();
    let (expected, _) = run(&alone, options(), |needs| store.load(&alone, needs));
    let volume = store.volume();
    let mut models = [(); 2].map(|()| DeformableModel::on_sparse(&volume, options()).unwrap());
    let mut prints = [Vec::new(), Vec::new()];
    while models.iter().zip(&prints).any(|(_, prints)| prints.len() < expected.len()) {
        for (k, model) in models.iter_mut().enumerate() {
            // The second one runs ahead.
            for _ in 0..=k {
                match model.step() {
                    Ok(_) if prints[k].len() < expected.len() => {
                        prints[k].push(fingerprint(&model.surface().positions));
                    }
                    Ok(report) => assert!(report.done),
                    Err(MethodError::NeedsData { needs }) => store.load(&volume, &needs),
                    Err(error) => panic!("{error}"),
                }
            }
        }
    }
    assert!(prints.iter().all(|prints| *prints == expected));
}

/// Makes one iteration, with all bricks that it asks for.
fn advance(store: &Store, volume: &SparseVolume, model: &mut DeformableModel) -> StepReport {
    loop {
        match model.step() {
            Err(MethodError::NeedsData { needs }) => store.load(volume, &needs),
            result => return result.unwrap(),
        }
    }
}

/// Each step is repeated by a model restored from the state before it, whose volume has other bricks.
#[test]
fn a_restored_run_has_the_same_bits() {
    let store = store();
    let make = || {
        let volume = store.volume();
        let model = DeformableModel::on_sparse(&volume, options()).unwrap();
        (volume, model)
    };
    let (volume, mut model) = make();
    let (mut other, mut restored) = make();
    for step in 0.. {
        if step % 7 == 0 {
            (other, restored) = make();
        }
        let saved = model.save();
        restored.restore(&saved).unwrap();
        assert!(restored.save() == saved);
        let report = advance(&store, &volume, &mut model);
        advance(&store, &other, &mut restored);
        assert!(restored.save() == model.save(), "iteration {}", report.iteration);
        if report.done {
            assert!(step > 20);
            break;
        }
    }
}

#[test]
fn outside_the_box_the_surface_stays_as_it_was() {
    let store = store();
    let volume = store.volume();
    let within = options().within.unwrap();
    let is_outside = |p: DVec3| !(p.cmpge(within.min - 4.0).all() && p.cmple(within.max + 4.0).all());
    let whole = SparseOptions { finest: 1, ..SparseOptions::default() };
    let (_, coarse) = run(&volume, whole, |needs| store.load(&volume, needs));
    let (_, fine) = run(&volume, options(), |needs| store.load(&volume, needs));
    let outside = |model: &DeformableModel| {
        let all = model.surface().positions;
        all.into_iter().filter(|p| is_outside(p.as_dvec3())).count()
    };
    let [few, inside] = [outside(&coarse), fine.mesh().vertex_count() - outside(&fine)];
    assert!(few > 50 && outside(&fine) < 3 * few, "{few} and {}", outside(&fine));
    assert!(inside > 1000);
    let off = |p: &vesicle::math::Vec3| (store.distance)(*p).abs();
    let worst =
        fine.surface().positions.iter().filter(|p| !is_outside(p.as_dvec3())).map(off).fold(0.0, f32::max);
    assert!(worst < 3.0, "{worst}");
    println!("{few} vertices outside, {} with the box; {inside} inside, at most {worst} off", outside(&fine));
}

#[test]
fn what_a_sparse_volume_cannot_do_is_refused() {
    let store = store();
    let volume = store.volume();
    let refused = |options: SparseOptions| match DeformableModel::on_sparse(&volume, options).unwrap_err() {
        MethodError::InvalidArgument { parameter, .. } => parameter,
        other => panic!("{other}"),
    };
    let base = SparseOptions::default;
    let params = |change: fn(&mut DeformableParams)| {
        let mut params = DeformableParams::for_range(volume.range());
        change(&mut params);
        SparseOptions { params: Some(params), ..base() }
    };
    assert_eq!(refused(SparseOptions { finest: 3, ..base() }), "finest");
    assert_eq!(refused(SparseOptions { finest: 1, whole: Some(0), ..base() }), "whole");
    assert_eq!(refused(SparseOptions { whole: Some(3), ..base() }), "whole");
    for (min, max) in [(DVec3::NAN, DVec3::ONE), (DVec3::ONE, DVec3::ZERO), (DVec3::ZERO, DVec3::INFINITY)] {
        assert_eq!(refused(SparseOptions { within: Some(WorldBox { min, max }), ..base() }), "box");
    }
    assert_eq!(refused(SparseOptions { edge: Some(1e9), ..base() }), "edge");
    assert_eq!(refused(params(|params| params.gradient_normal = 0.1)), "gradientNormal");
    assert_eq!(refused(params(|params| params.gradient_tangent = 0.1)), "gradientTangent");
    assert_eq!(refused(params(|params| params.seeding = Seeding::On)), "seeding");
    let mut model = DeformableModel::on_sparse(&volume, base()).unwrap();
    let before = fingerprint(&model.surface().positions);
    assert!(matches!(model.seed(), Err(MethodError::InvalidArgument { parameter: "volume", .. })));
    assert!(matches!(model.coverage(), Err(MethodError::InvalidArgument { parameter: "volume", .. })));
    let other = SparseOptions { within: options().within, ..base() };
    let saved = DeformableModel::on_sparse(&volume, other).unwrap().save();
    assert!(matches!(model.restore(&saved), Err(MethodError::BadState { field: "volume", .. })));
    let params = DeformableParams { gradient_normal: 1.0, ..model.params().clone() };
    assert!(model.set_params(params).is_err());
    assert_eq!(fingerprint(&model.surface().positions), before);
}

#[test]
fn a_model_needs_the_coarsest_level() {
    let store = store();
    let volume = SparseVolume::new(SparseInit {
        levels: store.levels.clone(),
        range: [0.0, 1000.0],
        fill: Voxels::U16(vec![7]),
    })
    .unwrap();
    let missing = DeformableModel::on_sparse(&volume, SparseOptions::default()).unwrap_err();
    let MethodError::NeedsData { needs } = missing else { panic!("{missing}") };
    let voxels: usize = needs.iter().map(|at| at.region.dims.iter().product::<usize>()).sum();
    assert_eq!(voxels, 36 * 36 * 36);
    store.load(&volume, &needs);
    assert!(DeformableModel::on_sparse(&volume, SparseOptions::default()).is_ok());
}

/// Parameters set while bricks are missing count from the next step on, with all integrators.
#[test]
fn parameters_may_change_between_steps() {
    let store = store();
    for integrator in [Integrator::Euler, Integrator::RungeKutta, Integrator::Implicit] {
        // Each begins without bricks.
        let volume = store.volume();
        let options = SparseOptions { finest: 1, ..SparseOptions::default() };
        let mut model = DeformableModel::on_sparse(&volume, options).unwrap();
        let (mut iterations, mut steps) = (0, 0);
        while iterations < 5 {
            match model.step() {
                Ok(_) => iterations += u32::from(model.level() == 0),
                Err(MethodError::NeedsData { needs }) => {
                    let params = DeformableParams { integrator, ..model.params().clone() };
                    model.set_params(params).unwrap();
                    store.load(&volume, &needs);
                }
                Err(error) => panic!("{error}"),
            }
            steps += 1;
            assert!(steps < 2000);
        }
        assert_eq!(model.params().integrator, integrator);
        assert_eq!((model.mesh().check(), model.mesh().euler()), (Ok(()), 4));
    }
}

#[test]
fn bad_descriptions_and_boxes_are_refused() {
    let level = |n: usize, scale: f64| SparseLevel {
        dims: [n; 3],
        affine: DAffine3::from_scale(DVec3::splat(scale)),
    };
    let make = |levels: Vec<SparseLevel>, range: [f64; 2], fill: Voxels| match SparseVolume::new(SparseInit {
        levels,
        range,
        fill,
    }) {
        Err(VolumeError::InvalidArgument { parameter, .. }) => parameter,
        other => panic!("{other:?}"),
    };
    let one = || Voxels::U8(vec![0]);
    let good = || vec![level(40, 1.0), level(20, 2.0)];
    assert_eq!(make(vec![], [0.0, 1.0], one()), "levels");
    assert_eq!(make(vec![level(20, 2.0), level(40, 1.0)], [0.0, 1.0], one()), "levels");
    assert_eq!(make(vec![level(1000, 1.0)], [0.0, 1.0], one()), "levels");
    assert_eq!(make(vec![level(1 << 17, 1.0), level(9, 9.0)], [0.0, 1.0], one()), "dims");
    assert_eq!(make(vec![level(9, 1.0), level(0, 9.0)], [0.0, 1.0], one()), "dims");
    // Each alone is not too large.
    let large = vec![level(1 << 15, 1.0), level(1 << 15, 1.0), level(9, 1.0)];
    assert_eq!(make(large, [0.0, 1.0], one()), "levels");
    for scale in [f64::NAN, 0.0, f64::INFINITY, -2.0] {
        assert_eq!(make(vec![level(9, 1.0), level(4, scale)], [0.0, 1.0], one()), "affine", "{scale}");
    }
    let turned = SparseLevel { affine: DAffine3::from_rotation_z(0.1), ..level(4, 1.0) };
    assert_eq!(make(vec![level(9, 1.0), turned], [0.0, 1.0], one()), "affine");
    for range in [[1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        assert_eq!(make(good(), range, one()), "range");
    }
    assert_eq!(make(good(), [0.0, 1.0], Voxels::U8(vec![])), "fill");

    let init = SparseInit { levels: good(), range: [0.0, 1.0], fill: one() };
    let volume = SparseVolume::new(init).unwrap();
    let insert = |level: usize, min: [usize; 3], dims: [usize; 3], data: Voxels| match volume
        .insert(BrickBox { level, region: Region { min, dims } }, &data)
    {
        Err(VolumeError::InvalidArgument { parameter, .. }) => parameter,
        other => panic!("{other:?}"),
    };
    let zeros = |n: usize| Voxels::U8(vec![0; n]);
    assert_eq!(insert(2, [0; 3], [16; 3], zeros(4096)), "level");
    assert_eq!(insert(0, [0; 3], [16; 3], zeros(4095)), "data");
    assert_eq!(insert(0, [0; 3], [16; 3], Voxels::U16(vec![0; 4096])), "data");
    assert_eq!(insert(0, [4, 0, 0], [4, 16, 16], zeros(1024)), "min");
    assert_eq!(insert(0, [0; 3], [15, 16, 16], zeros(3840)), "min");
    assert_eq!(insert(0, [48, 0, 0], [16; 3], zeros(4096)), "dims");
    assert_eq!(insert(0, [32, 0, 0], [16; 3], zeros(4096)), "dims");
    assert_eq!(insert(0, [usize::MAX, 0, 0], [16; 3], zeros(4096)), "dims");
    assert_eq!(insert(0, [0; 3], [0; 3], zeros(0)), "dims");
    assert_eq!(volume.loaded(), [[0, 0], [0, 0]]);
    let border = BrickBox { level: 0, region: Region { min: [32, 0, 16], dims: [8, 32, 24] } };
    volume.insert_fill(border).unwrap();
    assert_eq!(volume.loaded()[0], [12, 12 * BRICK * BRICK * BRICK]);
    assert_eq!(
        volume.missing(0).unwrap().iter().map(|at| at.region.dims.iter().product::<usize>()).sum::<usize>(),
        40 * 40 * 40 - 8 * 32 * 24
    );
}

/// On wasm32 the number of voxels of such a box, 2⁴⁵, does not fit into a `usize`.
#[test]
fn a_box_larger_than_memory_is_refused() {
    let level = |n: usize, scale: f64| SparseLevel {
        dims: [n; 3],
        affine: DAffine3::from_scale(DVec3::splat(scale)),
    };
    let levels = vec![level(1 << 15, 1.0), level(1 << 7, 256.0)];
    let volume =
        SparseVolume::new(SparseInit { levels, range: [0.0, 1.0], fill: Voxels::U8(vec![0]) }).unwrap();
    let all = BrickBox { level: 0, region: Region { min: [0; 3], dims: [1 << 15; 3] } };
    assert!(volume.insert(all, &Voxels::U8(vec![])).is_err());
    assert!(matches!(volume.missing(0), Err(VolumeError::TooLarge { .. })));
    assert_eq!(volume.loaded(), [[0, 0], [0, 0]]);
}

/// A second thread that steps a model of the same volume waits, and finds the bricks where they belong.
#[cfg(not(target_arch = "wasm32"))]
#[test]
fn models_of_a_volume_may_step_in_two_threads() {
    let store = store();
    let volume = store.volume();
    let options = || SparseOptions { finest: 1, ..SparseOptions::default() };
    let own = store.volume();
    let (_, alone) = run(&own, options(), |needs| store.load(&own, needs));
    let expected = fingerprint(&alone.surface().positions);
    std::thread::scope(|scope| {
        let threads = [0, 1].map(|_| {
            scope.spawn(|| {
                let (_, model) = run(&volume, options(), |needs| store.load(&volume, needs));
                fingerprint(&model.surface().positions)
            })
        });
        for thread in threads {
            assert_eq!(thread.join().unwrap(), expected);
        }
    });
}
