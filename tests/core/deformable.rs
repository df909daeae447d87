//! The deformable model on shapes with known surfaces, and its guarantees: a valid mesh at every iteration,
//! reproducible bits, clear errors.

use super::common::euler_of_parts;
use super::common::scenes;
use std::task::Poll;
use vesicle::math::{DAffine3, DMat3, DVec3, Random, Vec3};
use vesicle::mesh::{Measures, Mesh, MeshError, TriangleMesh, count_self_intersections, measure};
use vesicle::methods::deformable::{
    Attractor, DeformableModel, DeformableOptions, DeformableParams, Integrator, RestLength, Seeding, Start,
    Topology,
};
use vesicle::methods::{MethodError, StepReport};
use vesicle::pauses::advance;
use vesicle::volume::{Volume, VolumeError, VolumeInit, Voxels};
use vesicle::warning::WarningCode;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Steps until done or for `most` iterations; asserts after each that the mesh is valid and free of self-intersections.
fn run(model: &mut DeformableModel, most: u32) -> StepReport {
    loop {
        let report = model.step().unwrap();
        assert_eq!(model.mesh().check(), Ok(()), "iteration {}", report.iteration);
        assert_eq!(report.euler as i64, model.mesh().euler());
        assert!((0.0..=1.0).contains(&report.progress) && (report.progress == 1.0 || !report.done));
        let self_intersections = count_self_intersections(&model.mesh().to_triangles());
        assert_eq!(self_intersections, 0, "iteration {}", report.iteration);
        if report.done || report.iteration >= most {
            return report;
        }
    }
}

fn enclosing() -> DeformableOptions {
    DeformableOptions { start: Start::Enclosing, ..Default::default() }
}

fn params(volume: &Volume, iso: f64, rigidity: f64, stiffness: f64) -> DeformableParams {
    DeformableParams { iso, rigidity, stiffness, ..DeformableParams::for_volume(volume) }
}

/// Target edge length of the chain scene; its gap of seven voxels is then four δ wide.
const CHAIN_EDGE: f64 = 3.15;

fn the_chain_is_two_rings(most: u32, options: DeformableOptions) {
    let mut model = DeformableModel::new(&scenes::chain(), options).unwrap();
    let run = run(&mut model, 200);
    assert!(run.done && run.iteration <= most, "done after {}", run.iteration);
    assert_eq!(euler_of_parts(&model.surface()), [0, 0]);
}

#[test]
fn chain_from_an_enclosing_icosahedron_in_ninety_iterations() {
    let params = Some(params(&scenes::chain(), 0.5, 0.1, 0.1));
    let options =
        DeformableOptions { start: Start::Enclosing, edge: Some(CHAIN_EDGE), params, ..Default::default() };
    the_chain_is_two_rings(90, options);
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn chain_from_bubbles() {
    let params = Some(params(&scenes::chain(), 0.5, 0.0, 0.0));
    let options =
        DeformableOptions { start: Start::Bubbles(11), edge: Some(1.65), params, ..Default::default() };
    the_chain_is_two_rings(160, options);
}

#[test]
#[ignore = "long: npm run test:all"]
fn menger_sponge_of_depth_two() {
    let volume = scenes::menger(2);
    let params = Some(params(&volume, 0.4, 0.05, 0.001));
    let mut model = DeformableModel::new(
        &volume,
        DeformableOptions { start: Start::Enclosing, levels: 3, params, ..Default::default() },
    )
    .unwrap();
    let run = run(&mut model, 1000);
    assert!(run.done);
    assert_eq!(euler_of_parts(&model.surface()), [-160]);
}

fn ball(dims: [usize; 3], radius: f32) -> Volume {
    let centre = Vec3::from(dims.map(|n| 0.5 * (n as f32 - 1.0)));
    scenes::volume(dims, |p| scenes::potential(p.distance(centre), radius))
}

fn surface_of(volume: &Volume, options: DeformableOptions) -> (DeformableModel, Measures) {
    let mut model = DeformableModel::new(volume, options).unwrap();
    let run = run(&mut model, 600);
    assert!(run.done, "not at rest after {} iterations: {:?}", run.iteration, run);
    let measures = measure(&model.surface());
    (model, measures)
}

/// Returns the radius of the ball of equal volume.
fn radius_of(found: &Measures) -> f64 {
    libm::cbrt(found.volume * 3.0 / (4.0 * std::f64::consts::PI))
}

fn close(what: &str, value: f64, expected: f64, tolerance: f64) {
    let off = (value - expected).abs() / expected;
    assert!(off < tolerance, "{what}: {value} for {expected}, off by {off:.4}");
}

#[test]
fn a_ball_is_found_from_every_start() {
    let volume = ball([40, 40, 40], 11.0);
    let centre = DVec3::splat(19.5);
    let seeds = Start::Seeds { points: vec![centre, centre + DVec3::X * 9.0], radius: 2.5 };
    let given = Mesh::icosphere(Vec3::splat(19.5), 6.0, 1.5).unwrap().to_triangles();
    let starts = [Start::Enclosing, Start::Bubbles(3), seeds, Start::MarchingCubes(0.6), Start::Mesh(given)];
    for start in starts {
        let params = Some(params(&volume, 0.5, 0.1, 0.0));
        let (_, found) =
            surface_of(&volume, DeformableOptions { start: start.clone(), params, ..Default::default() });
        assert_eq!((found.components, found.euler), (1, 2), "{start:?}");
        close("radius", radius_of(&found), 11.0, 0.01);
        close("area", found.area, 4.0 * std::f64::consts::PI * 121.0, 0.02);
    }
}

#[test]
fn the_mean_edge_is_the_target_edge() {
    let volume = ball([40, 40, 40], 13.0);
    for edge in [1.2, 2.0, 3.0] {
        let params = Some(DeformableParams { adaptivity: 0.0, ..DeformableParams::for_volume(&volume) });
        let options = DeformableOptions { edge: Some(edge), levels: 1, params, ..enclosing() };
        let (_, found) = surface_of(&volume, options);

        close("mean edge", found.edge_mean, edge, 0.15);
    }
}

#[test]
fn coarse_to_fine_and_direct_agree() {
    let volume = ball([40, 40, 40], 13.0);
    let of = |levels| {
        surface_of(&volume, DeformableOptions { start: Start::Enclosing, levels, ..Default::default() }).1
    };
    let direct = of(0);
    for levels in [1, 2] {
        let found = of(levels);
        close("area", found.area, direct.area, 0.01);
        close("volume", found.volume, direct.volume, 0.003);
    }
}

#[test]
fn the_darker_object_is_found_with_the_opposite_sign() {
    let volume = scenes::volume([32, 32, 32], |p| {
        10.0 * (1.0 - scenes::potential(p.distance(Vec3::splat(15.5)), 8.0))
    });
    let start = Start::Seeds { points: vec![DVec3::splat(15.5)], radius: 3.0 };
    let params = Some(DeformableParams { iso_force: 1.0, ..params(&volume, 5.0, 0.1, 0.0) });
    let (_, found) = surface_of(&volume, DeformableOptions { start, params, ..Default::default() });
    close("radius", radius_of(&found), 8.0, 0.015);
}

/// Voxels of 1 × 2 × 4 in a sheared, mirrored world: the model evolves in a space of cubic voxels and returns world
/// positions.
#[test]
fn anisotropic_mirrored_volumes_come_out_right_in_world_space() {
    let linear =
        DMat3::from_cols(DVec3::new(-1.0, 0.2, 0.0), DVec3::new(0.0, 2.0, 0.3), DVec3::new(0.5, 0.0, 4.0));
    let affine = DAffine3 { matrix3: linear, translation: DVec3::new(100.0, -50.0, 7.0) };
    let dims = [80, 40, 24];
    let centre = affine.transform_point3(DVec3::new(39.5, 19.5, 11.5));
    let at = |i: usize| {
        let index = DVec3::new((i % 80) as f64, (i / 80 % 40) as f64, (i / 3200) as f64);
        scenes::potential(affine.transform_point3(index).distance(centre) as f32, 22.0)
    };
    let volume = scenes::placed(Voxels::F32((0..80 * 40 * 24).map(at).collect()), dims, affine);
    let params = Some(params(&volume, 0.5, 0.05, 0.0));
    let (_, found) = surface_of(
        &volume,
        DeformableOptions { start: Start::Enclosing, levels: 1, params, ..Default::default() },
    );
    assert_eq!((found.components, found.euler), (1, 2));
    close(
        "volume, positive in spite of the mirror",
        found.volume,
        4.0 / 3.0 * std::f64::consts::PI * 22.0 * 22.0 * 22.0,
        0.03,
    );
    assert!(found.centroid.distance(centre) < 0.2, "centroid {} for {centre}", found.centroid);
}

#[test]
fn a_ridge_is_found_by_the_gradient_force_and_runge_kutta() {
    let shell = |p: Vec3| (1.0 - 0.2 * (p.distance(Vec3::splat(19.5)) - 11.0).abs()).max(0.0);
    let volume = scenes::volume([40, 40, 40], shell);
    let params = DeformableParams {
        iso_force: 0.0,
        gradient_normal: 1.0,
        rigidity: 0.5,
        integrator: Integrator::RungeKutta,
        ..DeformableParams::for_volume(&volume)
    };
    let start = Start::Seeds { points: vec![DVec3::splat(19.5)], radius: 8.0 };
    let mut model = DeformableModel::new(
        &volume,
        DeformableOptions { start, params: Some(params), ..Default::default() },
    )
    .unwrap();
    run(&mut model, 400);
    let found = measure(&model.surface());
    close("radius", radius_of(&found), 11.0, 0.5 / 11.0);
}

#[test]
fn fixed_topology_moves_vertices_and_keeps_every_edge() {
    let volume = ball([32, 32, 32], 9.0);
    let start = Start::Seeds { points: vec![DVec3::splat(15.5)], radius: 7.0 };
    let params = DeformableParams { topology: Topology::Fixed, ..params(&volume, 0.5, 0.1, 0.0) };
    let mut model = DeformableModel::new(
        &volume,
        DeformableOptions { start, params: Some(params), ..Default::default() },
    )
    .unwrap();
    let before = model.surface();
    run(&mut model, 300);
    let after = model.surface();
    assert_eq!(before.triangles, after.triangles);
    assert!(measure(&after).volume > 1.5 * measure(&before).volume);
}

#[test]
fn speeds_are_displacements_along_the_normal_per_time() {
    let volume = ball([24, 24, 24], 6.0);
    let params = DeformableParams {
        topology: Topology::Fixed,
        time_step: 0.5,
        ..DeformableParams::for_volume(&volume)
    };
    let mut model = DeformableModel::new(
        &volume,
        DeformableOptions { start: Start::Enclosing, params: Some(params), ..Default::default() },
    )
    .unwrap();
    assert!(model.speeds().iter().all(|&speed| speed == 0.0));
    for _ in 0..8 {
        model.step().unwrap();
    }
    let before = model.surface().positions;
    model.step().unwrap();
    let after = model.surface();
    let speeds = model.speeds();
    assert_eq!(speeds.len(), after.positions.len());
    for (i, normal) in after.normals.as_ref().unwrap().iter().enumerate() {
        let way = (after.positions[i] - before[i]).dot(*normal) / 0.5;
        assert!((speeds[i] - way).abs() < 1e-4, "vertex {i}: {} for {way}", speeds[i]);
    }
    // The enclosing surface moves inwards.
    assert!(speeds.iter().all(|&speed| speed < 0.0));
}

#[test]
fn stiffness_and_rest_lengths_even_out_edges() {
    let volume = ball([32, 32, 32], 9.0);
    let spread = |stiffness, rest_length| {
        let uniform = DeformableParams { adaptivity: 0.0, ..params(&volume, 0.5, 0.1, stiffness) };
        let params = Some(DeformableParams { rest_length, ..uniform });
        let (_, found) =
            surface_of(&volume, DeformableOptions { start: Start::Enclosing, params, ..Default::default() });
        found.edge_max / found.edge_min
    };
    let loose = spread(0.0, RestLength::Zero);
    assert!(spread(0.05, RestLength::Mean) < loose);
    assert!(spread(0.05, RestLength::Given(1.4)) < loose);
}

#[test]
fn an_attractor_pulls_the_surface_until_it_is_removed() {
    let volume = ball([40, 40, 40], 9.0);
    let (mut model, before) = surface_of(&volume, enclosing());
    let point = DVec3::new(34.0, 19.5, 19.5);
    model.set_attractors(vec![Attractor { point, strength: 0.1, radius: 12.0 }]).unwrap();
    let gentle = run(&mut model, 300);
    assert!(gentle.done, "a gentle pull comes to rest: {gentle:?}");
    model.set_attractors(vec![Attractor { point, strength: 0.3, radius: 12.0 }]).unwrap();
    run(&mut model, 500);
    let pulled = measure(&model.surface());
    assert!(pulled.bounds[1].x > before.bounds[1].x + 1.0);
    model.set_attractors(vec![]).unwrap();
    run(&mut model, 1100);
    close("volume", measure(&model.surface()).volume, before.volume, 0.01);
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    let volume = scenes::chain();
    let options = || DeformableOptions {
        start: Start::Bubbles(9),
        edge: Some(1.9),
        params: Some(params(&volume, 0.5, 0.1, 0.05)),
        ..Default::default()
    };
    let mut model = DeformableModel::new(&volume, options()).unwrap();
    for _ in 0..6 {
        model.step().unwrap();
    }
    let state = model.save();
    let mut other = DeformableModel::new(&volume, options()).unwrap();
    other.restore(&state).unwrap();
    assert!(other.save() == state);
    for _ in 0..20 {
        assert_eq!(model.step().unwrap(), other.step().unwrap());
        // Not assert_eq, which would print both.
        assert!(model.save() == other.save());
    }
    assert!(model.save() == other.save());
}

#[test]
fn a_run_restored_at_any_iteration_continues_bit_for_bit() {
    let volume = scenes::chain();
    let new =
        || DeformableModel::new(&volume, DeformableOptions { levels: 1, ..Default::default() }).unwrap();
    let (mut model, mut other) = (new(), new());
    loop {
        other.restore(&model.save()).unwrap();
        let report = model.step().unwrap();
        assert_eq!(other.step().unwrap(), report);
        assert!(model.save() == other.save(), "iteration {}", report.iteration);
        if report.done {
            break;
        }
    }
}

#[test]
fn damaged_states_are_refused_and_change_nothing() {
    let volume = ball([24, 24, 24], 6.0);
    let mut model = DeformableModel::new(&volume, enclosing()).unwrap();
    for _ in 0..5 {
        model.step().unwrap();
    }
    let state = model.save();
    let mut random = super::common::Random(1);
    for length in [0, 4, 8, 9, 100, state.len() - 1] {
        assert!(matches!(model.restore(&state[..length]), Err(MethodError::BadState { .. })));
    }
    for _ in 0..500 {
        let mut bytes = state.clone();
        let at = random.below(bytes.len());
        bytes[at] ^= 1 << random.below(8);
        assert!(
            matches!(model.restore(&bytes), Err(MethodError::BadState { .. })),
            "bit flipped in byte {at}"
        );
        assert!(model.save() == state);
    }
    let other = ball([24, 24, 24], 7.0);
    let mut stranger = DeformableModel::new(&other, enclosing()).unwrap();
    assert!(stranger.restore(&state).unwrap_err().to_string().contains("another volume"));
}

#[test]
fn parameters_are_set_together_or_not_at_all() {
    let volume = ball([24, 24, 24], 6.0);
    let (mut model, small) = surface_of(&volume, enclosing());
    let bad = DeformableParams { damping: -1.0, iso: 0.9, ..model.params().clone() };
    let refusal = model.set_params(bad).unwrap_err().to_string();
    assert!(refusal.contains("damping") && refusal.contains("0.01 to 2"), "{refusal}");
    assert_eq!(model.params().iso, 0.5);
    model.set_params(DeformableParams { iso: 0.3, ..model.params().clone() }).unwrap();
    let run = run(&mut model, 400);
    assert!(run.done && measure(&model.surface()).volume > 1.2 * small.volume);
}

#[test]
fn errors_name_the_option_and_what_is_accepted() {
    let volume = ball([24, 24, 24], 6.0);
    let refusal = |options| DeformableModel::new(&volume, options).unwrap_err().to_string();
    let of = |start| refusal(DeformableOptions { start, ..Default::default() });
    assert!(
        refusal(DeformableOptions { start: Start::Enclosing, levels: 40, ..Default::default() })
            .contains("levels: must be from 0 to")
    );
    assert!(
        refusal(DeformableOptions { start: Start::Enclosing, edge: Some(1e-9), ..Default::default() })
            .starts_with("edge")
    );
    assert!(
        refusal(DeformableOptions { start: Start::Enclosing, edge: Some(f64::NAN), ..Default::default() })
            .starts_with("edge")
    );
    assert!(
        refusal(DeformableOptions { start: Start::Enclosing, frame: 3, ..Default::default() })
            .contains("frame")
    );
    assert!(of(Start::Bubbles(0)).contains("start.bubbles"));
    assert!(of(Start::Bubbles(500)).contains("1 to"));
    assert!(of(Start::MarchingCubes(1e9)).contains("no surface"));
    let near = vec![DVec3::splat(12.0), DVec3::splat(13.0)];
    assert!(of(Start::Seeds { points: near, radius: 3.0 }).contains("too close"));
    assert!(of(Start::Seeds { points: vec![], radius: 3.0 }).contains("got 0"));
    assert!(
        of(Start::Seeds { points: vec![DVec3::NAN], radius: 3.0 }).contains("outside the image's domain")
    );
    assert!(of(Start::Seeds { points: vec![DVec3::ONE], radius: 0.1 }).contains("must be from"));

    let open = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    let error =
        DeformableModel::new(&volume, DeformableOptions { start: Start::Mesh(open), ..Default::default() });
    assert!(matches!(error, Err(MethodError::Mesh(MeshError::NotClosed { .. }))));
    let mut two = Mesh::icosphere(Vec3::splat(12.0), 4.0, 1.0).unwrap();
    two.append(&Mesh::icosphere(Vec3::splat(14.0), 4.0, 1.0).unwrap()).unwrap();
    let start = Start::Mesh(two.to_triangles());
    let error = DeformableModel::new(&volume, DeformableOptions { start, ..Default::default() });
    assert!(matches!(error, Err(MethodError::Mesh(MeshError::SelfIntersecting { .. }))));
}

/// Regression: the error was that of too many vertices, with the advice to use longer edges, or the surface had half of
/// its volume without a word.
#[test]
fn edges_too_long_for_the_image_or_the_object_are_refused() {
    for (n, edge) in [(24, 6.0), (24, 7.0), (24, 10.0), (24, 30.0), (48, 10.0), (48, 12.0), (48, 20.0)] {
        let radius = n as f32 / 3.0;
        let volume = ball([n, n, n], radius);
        let options = DeformableOptions { edge: Some(edge), ..Default::default() };
        let result = DeformableModel::new(&volume, options).and_then(|mut model| {
            while !model.step()?.done {}
            Ok(measure(&model.surface()).volume / (4.189 * f64::from(radius * radius * radius)))
        });
        match result {
            Ok(part) => assert!(edge < 0.28 * n as f64 && part > 0.75, "{n}, {edge}: {part}"),
            Err(MethodError::InvalidArgument { parameter, problem }) => {
                assert!(parameter == "edge" && edge > 0.24 * n as f64, "{n}, {edge}: {problem}");
                let expected =
                    if edge > 0.28 * n as f64 { "must be from 0.340 to" } else { "must be < 12.000" };
                assert!(problem.starts_with(expected), "{problem}");
            }
            Err(error) => panic!("{n}, {edge}: {error}"),
        }
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn flat_and_tiny_volumes_have_an_enclosing_start() {
    for dims in [[64, 64, 6], [5, 5, 5], [2, 2, 2], [1, 1, 1], [100, 3, 3], [90, 40, 1], [3, 30, 70]] {
        let volume = scenes::volume(dims, |p| p.x);
        let longest = 0.279 * (1 + dims.into_iter().max().unwrap_or(0)) as f64;
        for edge in [0.5, 0.8, 1.1, 1.5, 2.2, 3.0, 5.0].into_iter().filter(|&edge| edge < longest.max(3.06)) {
            let options =
                DeformableOptions { start: Start::Enclosing, edge: Some(edge), ..Default::default() };
            let model = DeformableModel::new(&volume, options).unwrap();
            assert_eq!((model.mesh().check(), model.mesh().euler()), (Ok(()), 2), "{dims:?} {edge}");
            assert_eq!(count_self_intersections(&model.mesh().to_triangles()), 0, "{dims:?} {edge}");
        }
    }
}

/// The enclosing start surrounds the bright object, not the whole image, with a margin, wherever the object is.
#[test]
fn the_enclosing_start_is_around_the_object() {
    for (dims, centres, radius) in [
        ([60, 50, 40], vec![Vec3::new(14.0, 36.0, 12.0)], 6.0),
        ([60, 50, 40], vec![Vec3::new(10.0, 10.0, 10.0), Vec3::new(50.0, 40.0, 30.0)], 4.0),
        ([90, 20, 12], vec![Vec3::new(8.0, 9.0, 5.0), Vec3::new(80.0, 9.0, 6.0)], 3.0),
    ] {
        let to_balls =
            |p: Vec3| centres.iter().map(|c| p.distance(*c) - radius).fold(f32::INFINITY, f32::min);
        let volume = scenes::volume(dims, |p| (0.5 - 0.25 * to_balls(p)).clamp(0.0, 1.0));
        let params = Some(params(&volume, 0.5, 0.1, 0.0));
        let model = DeformableModel::new(
            &volume,
            DeformableOptions { start: Start::Enclosing, params, ..Default::default() },
        )
        .unwrap();
        let start = model.surface();
        assert!(start.positions.iter().all(|&p| to_balls(p) > 0.5), "{dims:?}");
        let winding = |p: Vec3| {
            let solid_angle = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| (start.positions[v as usize] - p).as_dvec3().normalize());
                2.0 * libm::atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
            };
            start.triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
        };
        for c in &centres {
            for way in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
                assert!(winding(*c + way * radius) > 0.99, "{dims:?}");
            }
        }
        let image = dims.iter().product::<usize>() as f64;
        let volume = measure(&start).volume;
        assert!(centres.len() > 1 || volume < 0.1 * image, "{volume} of {image}");
    }
}

#[test]
fn in_an_empty_image_the_surface_vanishes() {
    let volume = scenes::volume([12, 12, 12], |_| 0.0);
    let params = Some(params(&volume, 0.5, 0.1, 0.0));
    let mut model = DeformableModel::new(
        &volume,
        DeformableOptions { start: Start::Enclosing, levels: 1, params, ..Default::default() },
    )
    .unwrap();
    let run = run(&mut model, 400);
    assert!(run.done && run.vertices == 0 && run.euler == 0 && run.components == 0);
    assert!(model.surface().triangles.is_empty());
}

/// Only the domain limits an inflating force; only the bound on vertices limits an absurdly fine sampling.
#[test]
fn an_inflating_surface_stays_in_its_domain() {
    let volume = ball([16, 16, 16], 4.0);
    let inflating = DeformableParams { iso_force: 1.0, iso: 1.0, ..params(&volume, 1.0, 0.0, 0.0) };
    let options =
        DeformableOptions { start: Start::Enclosing, params: Some(inflating), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options).unwrap();
    let report = run(&mut model, 150);
    let size = measure(&model.surface());
    assert!(size.bounds[1].max_element() < 40.0 && size.bounds[0].min_element() > -25.0, "{:?}", size.bounds);
    assert!(report.vertices < 20_000);
}

#[test]
fn a_start_mesh_far_from_the_image_is_refused() {
    let volume = ball([16, 16, 16], 4.0);
    let far = Mesh::icosphere(Vec3::splat(1e6), 6.0, 1.5).unwrap().to_triangles();
    let options = DeformableOptions { start: Start::Mesh(far), ..Default::default() };
    let refusal = DeformableModel::new(&volume, options).unwrap_err().to_string();
    assert!(
        refusal.starts_with("start.mesh: vertex 0") && refusal.contains("outside the image's domain"),
        "{refusal}"
    );
}

#[test]
fn a_start_mesh_turned_inside_out_is_refused() {
    let volume = ball([16, 16, 16], 4.0);
    let mut turned = Mesh::icosphere(Vec3::splat(7.5), 6.0, 1.5).unwrap().to_triangles();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let options = DeformableOptions { start: Start::Mesh(turned), ..Default::default() };
    let refusal = DeformableModel::new(&volume, options).unwrap_err().to_string();
    assert!(refusal.contains("face inwards"), "{refusal}");
}

/// Both sides of a cut handle are the same component. Regression: it was removed twice, and two vertices later shared a
/// slot.
#[test]
fn a_cut_handle_is_removed_once() {
    let volume = ball([24, 24, 24], 7.0);
    let torus = super::common::torus_around(Vec3::splat(4.0), [8, 3], [1.3, 0.25]);
    let mut start = Mesh::from_triangles(&torus).unwrap();
    start.append(&Mesh::icosphere(Vec3::splat(14.0), 5.0, 1.5).unwrap()).unwrap();
    let options = DeformableOptions { start: Start::Mesh(start.to_triangles()), ..Default::default() };
    let (model, _) = surface_of(&volume, options);
    assert_eq!(euler_of_parts(&model.surface()), [2]);
}

/// Numbers that overflow when they are scaled: the surface neither vanishes nor stops.
#[test]
fn huge_numbers_move_the_surface_or_are_refused() {
    let volume = ball([24, 24, 24], 7.0);
    let mut model = DeformableModel::new(&volume, enclosing()).unwrap();
    let before = measure(&model.surface()).volume;
    model.set_params(DeformableParams { iso: 1e300, ..model.params().clone() }).unwrap();
    for _ in 0..5 {
        model.step().unwrap();
    }
    let shrunk = measure(&model.surface()).volume;
    assert!(shrunk < 0.95 * before && shrunk > 0.0, "{shrunk} of {before}");
    let point = DVec3::splat(12.0);
    for (strength, radius) in [(1e39, 5.0), (f64::NAN, 5.0), (1.0, 1e300), (1.0, 0.0)] {
        let refusal = model.set_attractors(vec![Attractor { point, strength, radius }]).unwrap_err();
        assert!(refusal.to_string().contains("attractor 0"), "{refusal}");
    }
}

/// A surface that has just begun to move is slow as well, but has not converged. (The implicit integrator takes longer
/// steps and has converged after 600 of them.)
#[test]
fn small_time_steps_are_not_taken_for_convergence() {
    let volume = ball([24, 24, 24], 7.0);
    for (time_step, mass, iso) in [(0.02, 1.0, 0.5), (0.01, 100.0, 0.2)] {
        let integrator = Integrator::Euler;
        let params = DeformableParams { time_step, mass, integrator, ..params(&volume, iso, 0.1, 0.0) };
        let options =
            DeformableOptions { start: Start::Enclosing, params: Some(params), ..Default::default() };
        let mut model = DeformableModel::new(&volume, options).unwrap();
        assert!((0..600).all(|_| !model.step().unwrap().done), "time step {time_step}, mass {mass}");
    }
}

/// Small differences added to an intensity so large that f32 cannot resolve them.
#[test]
fn intensities_far_from_zero_keep_their_contrast() {
    let near = ball([24, 24, 24], 7.0).intensities(0).unwrap();
    let values = near.into_iter().map(|v| 1e9 + f64::from(v)).collect();
    let volume = scenes::placed(Voxels::F64(values), [24, 24, 24], DAffine3::IDENTITY);
    let (_, found) = surface_of(&volume, enclosing());
    close("radius", radius_of(&found), 7.0, 0.02);
}

/// Seeds and attractors are spheres in world space, whatever the voxel sizes.
#[test]
fn seeds_and_attractors_are_spheres_in_world_space() {
    let tall = DAffine3::from_scale(DVec3::new(1.0, 1.0, 4.0));
    let volume = scenes::placed(Voxels::F32(vec![0.0; 32 * 32 * 8]), [32, 32, 8], tall);
    let middle = DVec3::splat(15.0);
    let start = Start::Seeds { points: vec![middle], radius: 9.0 };
    let still = DeformableParams { iso_force: 0.0, rigidity: 0.0, ..DeformableParams::for_volume(&volume) };
    let options = DeformableOptions { start, edge: Some(1.6), params: Some(still), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options).unwrap();
    let before = model.surface();
    let size = measure(&before).bounds;
    for diameter in (size[1] - size[0]).to_array() {
        close("diameter", diameter, 18.0, 0.06);
    }
    let mut moved_by = |point: DVec3| {
        let before = measure(&model.surface()).bounds[1];
        model.set_attractors(vec![Attractor { point, strength: 0.5, radius: 4.0 }]).unwrap();
        model.step().unwrap();
        measure(&model.surface()).bounds[1] - before
    };
    assert!(moved_by(middle + DVec3::Z * 14.0).length() < 1e-3, "not felt 5 above the top");
    assert!(moved_by(middle + DVec3::X * 12.0).x > 0.05, "felt 3 beside it");
    assert!(moved_by(middle + DVec3::Z * 11.0).z > 0.1, "felt 2 above the top");
}

/// A restored state includes its edge length and the bounds derived from it.
#[test]
fn a_state_with_another_edge_length_continues() {
    let volume = ball([32, 32, 32], 10.0);
    let options =
        |edge| DeformableOptions { start: Start::Enclosing, edge: Some(edge), ..Default::default() };
    let mut fine = DeformableModel::new(&volume, options(0.8)).unwrap();
    fine.step().unwrap();
    let mut coarse = DeformableModel::new(&volume, options(9.0)).unwrap();
    coarse.restore(&fine.save()).unwrap();
    assert!(fine.step().unwrap() == coarse.step().unwrap() && fine.save() == coarse.save());
}

#[test]
fn a_volume_too_long_for_single_precision_is_refused_at_once() {
    for dims in [[200_000, 1, 1], [1, 1, 200_000], [2, 140_000, 2]] {
        let values = Voxels::U8((0..dims.iter().product::<usize>()).map(|k| (k / 7 % 2) as u8).collect());
        let volume = Volume::new(VolumeInit::new(values, [dims[0], dims[1], dims[2], 1])).unwrap();
        let refusal = DeformableModel::new(&volume, DeformableOptions::default()).unwrap_err();
        assert!(matches!(refusal, MethodError::InvalidArgument { parameter: "volume", .. }), "{refusal}");
    }
}

#[test]
fn a_volume_whose_mesh_exceeds_memory_is_refused_at_once() {
    let volume = scenes::volume([20_000, 1, 1], |p| p.x);
    let refusal = DeformableModel::new(&volume, enclosing()).unwrap_err();
    assert!(matches!(refusal, MethodError::TooManyVertices { .. }), "{refusal}");
}

#[test]
fn a_surface_has_at_most_as_many_vertices_as_allowed_and_goes_on_once_more_are() {
    let volume = ball([64, 64, 64], 22.0);
    let most = 1000;
    let options = DeformableOptions {
        levels: 2,
        params: Some(DeformableParams {
            iso: 0.5,
            seeding: Seeding::Off,
            ..DeformableParams::for_volume(&volume)
        }),
        max_vertices: Some(most),
        ..Default::default()
    };
    let mut model = DeformableModel::new(&volume, options).unwrap();
    let refusal = (0..2000).find_map(|_| model.step().err());
    assert!(
        matches!(
            refusal,
            Some(
                MethodError::TooManyVertices { .. }
                    | MethodError::Volume(VolumeError::TooManyTriangles { .. })
            )
        ),
        "{refusal:?}"
    );
    assert!(model.mesh().vertex_count() <= most);
    assert_eq!(model.mesh().check(), Ok(()));
    model.set_max_vertices(None);
    assert!(run(&mut model, 2000).done && model.mesh().vertex_count() > most);
}

/// Regression: edits remove most of the vertices of a contour, but if more than allowed were left, the model began with them.
#[test]
fn a_contour_has_at_most_as_many_vertices_as_allowed() {
    // Edges along straight faces are within bounds from the beginning, and too many vertices are left by no split.
    let volume = scenes::volume([48; 3], |p| {
        let is_inside = (p - 23.5).abs().max_element() < 14.0;
        if is_inside { 100.0 } else { 0.0 }
    });
    let params = DeformableParams { adaptivity: 0.0, ..DeformableParams::for_volume(&volume) };
    let options = DeformableOptions { levels: 0, params: Some(params), ..Default::default() };
    let count = DeformableModel::new(&volume, options.clone()).unwrap().mesh().vertex_count();
    for (most, fits) in [(2 * count, true), (count - 1, false)] {
        let options = DeformableOptions { max_vertices: Some(most), ..options.clone() };
        match DeformableModel::new(&volume, options) {
            Ok(model) => assert!(fits && model.mesh().vertex_count() <= most),
            Err(error) => assert!(!fits && matches!(error, MethodError::TooManyVertices { .. }), "{error}"),
        }
    }
}

/// Regression: on a coarse level, some vertices of this tooth are where the image is so steep that they oscillated
/// forever under the forces of coarse levels. They are at the border of the image, which is less steep since objects end
/// half a voxel beyond it.
#[cfg(not(target_arch = "wasm32"))]
#[test]
fn oscillations_on_a_coarse_level_converge() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/www/public/data/tooth.nrrd");
    let volume = vesicle::io::parse_volume(&std::fs::read(path).unwrap(), None).unwrap();
    let mut model = DeformableModel::new(
        &volume,
        DeformableOptions {
            start: Start::Enclosing,
            levels: 2,
            params: Some(DeformableParams::as_published(&volume)),
            ..Default::default()
        },
    )
    .unwrap();
    let mut report = model.step().unwrap();
    while !report.done {
        assert!(report.iteration < 2000, "{} on level {}", report.iteration, model.level());
        report = model.step().unwrap();
    }
}

/// Regression: with a strong image force, vertices oscillated across intensity steps of noisy images; this took 1,399
/// iterations.
#[cfg(not(target_arch = "wasm32"))]
#[test]
#[ignore = "long: npm run test:all"]
fn oscillations_in_a_noisy_image_converge() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/www/public/data/visible-human-head.nii.gz");
    let volume = vesicle::io::parse_volume(&std::fs::read(path).unwrap(), None).unwrap();
    let params = |iso| DeformableParams { iso, iso_force: -10.0, ..params(&volume, iso, 0.05, 0.001) };
    let options = DeformableOptions { params: Some(params(95.0)), ..Default::default() };
    let mut model = DeformableModel::new(&volume, options).unwrap();
    while !model.step().unwrap().done {}
    let before = model.step().unwrap().iteration;
    model.set_params(params(127.0)).unwrap();
    while !model.step().unwrap().done {}
    let iterations = model.step().unwrap().iteration - before;
    assert!(iterations <= 150, "done after {iterations}");
    assert_eq!(count_self_intersections(&model.mesh().to_triangles()), 0);
}

/// Returns what a computation gives, and in how many slices.
fn in_slices<T>(computation: impl Future<Output = T>) -> (T, usize) {
    let mut computation = Box::pin(computation);
    let mut slices = 1;
    loop {
        match advance(&mut computation) {
            Poll::Pending => slices += 1,
            Poll::Ready(result) => return (result, slices),
        }
    }
}

#[test]
fn an_image_of_one_intensity_is_told() {
    let codes = |values: Vec<f32>| {
        let volume = Volume::new(VolumeInit::new(Voxels::F32(values), [6, 6, 6, 2])).unwrap();
        [0, 1].map(|frame| {
            let params = Some(DeformableParams { iso: 8.0, ..Default::default() });
            let options = DeformableOptions { frame, params, ..Default::default() };
            let report = DeformableModel::new(&volume, options).unwrap().step().unwrap();
            report.warnings.into_iter().map(|warning| warning.code).collect::<Vec<_>>()
        })
    };
    let flat = vec![WarningCode::NoBoundary];
    assert_eq!(codes(vec![0.0; 432]), [flat.clone(), flat.clone()]);
    let mut values = vec![7.0; 432];
    values[86] = 9.0;
    assert_eq!(codes(values), [vec![], flat]);
}

#[test]
fn an_iso_value_that_no_surface_has_is_told() {
    let volume =
        Volume::new(VolumeInit::new(Voxels::U8((0..216).map(|i| 7 + (i % 5) as u8).collect()), [6, 6, 6, 1]));
    let volume = volume.unwrap();
    let warnings = |params| {
        let options = DeformableOptions { params: Some(params), ..Default::default() };
        DeformableModel::new(&volume, options).unwrap().step().unwrap().warnings
    };
    let with = |iso, iso_force| DeformableParams { iso, iso_force, ..Default::default() };
    for iso in [7.0, 9.5, 11.0] {
        assert_eq!(warnings(with(iso, -1.0)), []);
    }
    for iso in [6.9, 11.1] {
        let [warning] = &warnings(with(iso, -1.0))[..] else { panic!("{iso}") };
        assert_eq!(warning.code, WarningCode::NoBoundary);
        assert!(
            warning.text.contains(&format!("{iso}: ")) && warning.text.contains("7 to 11"),
            "{warning:?}"
        );
        assert_eq!(warnings(with(iso, 0.0)), [], "it has no effect");
    }
}

#[test]
fn a_model_made_in_slices_is_the_same() {
    let mut random = Random::new(3);
    let noise = (0..24 * 24 * 24).map(|_| random.unit() as f32).collect();
    let volume = Volume::new(VolumeInit::new(Voxels::F32(noise), [24, 24, 24, 1])).unwrap();
    let options = DeformableOptions { levels: 1, ..Default::default() };
    let mut whole = DeformableModel::new(&volume, options.clone()).unwrap();
    let (sliced, slices) = in_slices(DeformableModel::begin(&volume, options).unwrap());
    let mut sliced = sliced.unwrap();
    assert!(sliced.save() == whole.save());
    assert!(slices > 5, "{slices}");
    for _ in 0..8 {
        assert_eq!(sliced.step().unwrap().done, whole.step().unwrap().done);
        assert!(sliced.save() == whole.save());
    }
}

/// Reading a large image takes longer than all else at the beginning.
#[test]
fn the_pyramid_of_a_large_image_is_made_in_slices() {
    let side = 128;
    let voxels = Voxels::U8((0..side * side * side).map(|k| u8::from(k > side * side * side / 2)).collect());
    let volume = Volume::new(VolumeInit::new(voxels, [side, side, side, 1])).unwrap();
    let start = Start::Seeds { points: vec![DVec3::splat(64.0)], radius: 12.0 };
    let options = DeformableOptions { levels: 3, start, ..Default::default() };
    let (model, slices) = in_slices(DeformableModel::begin(&volume, options).unwrap());
    assert!(model.is_ok());
    assert!(slices > 30, "{slices}");
}

/// Two bright balls in a dim one.
fn nested() -> Volume {
    let value = |p: Vec3| {
        let inside = |centre: f32, radius: f32| {
            let away = Vec3::new(p.x - centre, p.y - 19.5, p.z - 19.5).length();
            (0.5 + 0.5 * (radius - away)).clamp(0.0, 1.0)
        };
        0.3 * inside(19.5, 16.0) + 0.7 * inside(12.5, 4.0).max(inside(26.5, 4.0))
    };
    let at = |i: usize| Vec3::new((i % 40) as f32, (i / 40 % 40) as f32, (i / 1600) as f32);
    Volume::new(VolumeInit::new(
        Voxels::F32((0..40 * 40 * 40).map(|i| value(at(i))).collect()),
        [40, 40, 40, 1],
    ))
    .unwrap()
}

#[test]
fn an_iso_value_far_from_the_last_gives_the_surface_that_it_has() {
    let volume = nested();
    let options = |iso: f64| DeformableOptions {
        params: Some(DeformableParams { iso, ..DeformableParams::for_volume(&volume) }),
        levels: 1,
        ..Default::default()
    };
    let finished = |iso: f64| surface_of(&volume, options(iso)).0;
    let (dim, bright) = (finished(0.15), finished(0.65));
    let mut model = finished(0.15);
    for (iso, expected) in [(0.65, &bright), (0.15, &dim)] {
        let before = model.step().unwrap().iteration;
        model.set_params(DeformableParams { iso, ..model.params().clone() }).unwrap();
        let report = run(&mut model, 400);
        assert!(report.done && report.iteration - before < 100, "{report:?}");
        assert_eq!(report.components, expected.mesh().component_count() as u32);
        assert!(model.surface() == expected.surface(), "{iso}");
    }
    // A near one is reached by moving.
    let surface = model.surface();
    model.set_params(DeformableParams { iso: 0.17, ..model.params().clone() }).unwrap();
    assert!(model.surface().positions == surface.positions);
    // One without a surface, too; and what is refused changes nothing.
    let state = model.save();
    assert!(
        model.set_params(DeformableParams { iso: 0.65, damping: -1.0, ..model.params().clone() }).is_err()
    );
    assert!(model.save() == state);
    model.set_params(DeformableParams { iso: 5.0, ..model.params().clone() }).unwrap();
    assert!(run(&mut model, 400).done);
}
