//! A surface that holds itself, and the ellipsoids that move it as handles.

use super::common::skins::{assert_sound, ball, turned};
use super::common::{Named, Random, assert_at_least, seeds};
use vesicle::math::{DVec3, Vec2, Vec3};
use vesicle::mesh::{Mesh, TriangleMesh, intersecting_pairs, measure, shapes};
use vesicle::methods::multires::{
    ControlEllipsoid, MultiresOptions, MultiresParams, MultiresolutionModel, Support,
};
use vesicle::methods::{MethodError, StepReport};
use vesicle::spatial::{SurfaceWalker, surface_distance};
use vesicle::warning::WarningCode;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn bumpy(center: Vec3, edge: f32) -> TriangleMesh {
    let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, edge).unwrap().to_triangles();
    for p in &mut mesh.positions {
        let bump = libm::sinf(9.0 * p.x) * libm::sinf(8.0 * p.y + 1.0) * libm::sinf(7.0 * p.z);
        *p = *p * (1.0 + 0.1 * bump) + center;
    }
    mesh.normals = None;
    mesh
}

fn moved(mut mesh: TriangleMesh, to: Vec3) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p += to);
    mesh
}

/// Surfaces over which no smooth base is a graph: of other genus, of several parts, thin, with sharp edges, with triangles
/// far larger than the target.
fn others() -> Vec<TriangleMesh> {
    let ring = shapes::torus(1.0, 0.25, 60, 24);
    let linked = moved(
        TriangleMesh {
            positions: ring.positions.iter().map(|p| Vec3::new(p.x, p.z, -p.y)).collect(),
            ..ring.clone()
        },
        Vec3::X,
    );
    vec![
        bumpy(Vec3::ZERO, 0.12),
        ring.clone(),
        shapes::joined(&[ring, linked]),
        shapes::joined(&[bumpy(Vec3::ZERO, 0.2), bumpy(Vec3::X * 3.0, 0.3)]),
        shapes::cuboid(Vec3::new(2.0, 2.0, 0.02)),
        shapes::cuboid(Vec3::new(10.0, 0.2, 0.2)),
    ]
}

fn begun(detail: TriangleMesh) -> MultiresolutionModel {
    begun_with(detail, &[])
}

fn begun_with(detail: TriangleMesh, start: &[ControlEllipsoid]) -> MultiresolutionModel {
    MultiresolutionModel::new(MultiresOptions {
        detail: Some(detail),
        ellipsoids: start.to_vec(),
        support: Support::Surface,
        ..MultiresOptions::default()
    })
    .unwrap()
}

fn codes(report: &StepReport) -> Vec<WarningCode> {
    report.warnings.iter().map(|warning| warning.code).collect()
}

fn finish(model: &mut MultiresolutionModel) {
    for _ in 0..300 {
        let report = model.step().unwrap();
        assert_sound(model, &report);
        if report.done {
            return;
        }
    }
    panic!("the run does not end");
}

fn shifted(ellipsoids: &[ControlEllipsoid], k: usize, by: DVec3) -> Vec<ControlEllipsoid> {
    let mut all = ellipsoids.to_vec();
    all[k].center = (DVec3::from(all[k].center) + by).to_array();
    all
}

fn diagonal(mesh: &TriangleMesh) -> f64 {
    let least = mesh.positions.iter().copied().reduce(Vec3::min).unwrap();
    let most = mesh.positions.iter().copied().reduce(Vec3::max).unwrap();
    f64::from(most.distance(least))
}

#[test]
fn whatever_is_closed_stays_as_it_is() {
    for given in others() {
        let mut model = begun(given.clone());
        assert_eq!(model.support(), Support::Surface);
        let rest = model.ellipsoids();
        let topology = |model: &MultiresolutionModel| {
            let measures = measure(&model.surface());
            (measures.components, measures.euler)
        };
        let before = topology(&model);
        assert!(!rest.is_empty());
        for _ in 0..2 {
            assert!(model.surface().positions == given.positions);
            assert_eq!(model.surface().triangles.len(), given.triangles.len());
            assert!(model.step().unwrap().done);
        }
        // A motion of a millionth of the size is one, but hardly more.
        let size = diagonal(&given);
        model.set_ellipsoids(&shifted(&rest, 0, DVec3::new(0.0, 0.0, 1e-6 * size))).unwrap();
        finish(&mut model);
        let distance = surface_distance(&model.surface(), &given).unwrap();
        assert!(
            distance.mean < 1e-5 * size && distance.hausdorff < 1e-5 * size,
            "{}",
            distance.hausdorff / size
        );
        assert_eq!(topology(&model), before);
        model.set_ellipsoids(&rest).unwrap();
        finish(&mut model);
        assert!(model.surface().positions == given.positions);
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn what_an_ellipsoid_does_fades_with_the_distance() {
    for given in others().into_iter().take(5) {
        let size = diagonal(&given);
        let mut model = begun(given.clone());
        let rest = model.ellipsoids();
        let center = DVec3::from(rest[0].center);
        let start = model.base_surface();
        for by in [DVec3::Z, -DVec3::Y] {
            model.set_ellipsoids(&shifted(&rest, 0, by * 0.2 * size)).unwrap();
            while !model.step().unwrap().done {}
            let report = model.step().unwrap();
            assert_sound(&model, &report);
            let went = DVec3::from(model.ellipsoids()[0].center) - center;
            assert!(went.length() > 0.005 * size, "{}", went.length() / size);
            let now = SurfaceWalker::new(model.surface()).unwrap();
            let mut away: Vec<(f64, Vec3)> =
                start.positions.iter().map(|&p| (p.as_dvec3().distance(center), p)).collect();
            away.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (half, nearest) = (away.len() / 2, away[0].1);
            for &(_, p) in &away[half + half / 5..] {
                let off = now.closest(p).unwrap().distance;
                assert!(off < 1e-3 * size, "{}", off / size);
            }
            assert!(now.closest((nearest.as_dvec3() + went).as_vec3()).unwrap().distance < 0.02 * size);
        }
    }
}

#[test]
fn ellipsoids_that_are_added_or_removed_leave_the_surface_at_rest() {
    let given = bumpy(Vec3::ZERO, 0.12);
    let mut model = begun(given.clone());
    let rest = model.ellipsoids();
    let more = [rest.clone(), vec![ball(0.0, 0.0, 0.9, 0.05)]].concat();
    model.set_ellipsoids(&more).unwrap();
    assert_eq!(model.ellipsoids().len(), more.len());
    finish(&mut model);
    assert!(model.surface().positions == given.positions);
    model.set_ellipsoids(&shifted(&more, rest.len(), DVec3::Z * 0.2)).unwrap();
    finish(&mut model);
    let top =
        |model: &MultiresolutionModel| model.surface().positions.iter().map(|p| p.z).fold(f32::MIN, f32::max);
    let before = given.positions.iter().map(|p| p.z).fold(f32::MIN, f32::max);
    assert!((top(&model) - before - 0.2).abs() < 0.05, "{} {before}", top(&model));
    // Added where the surface has moved, it leaves that where it is.
    let bent = model.surface();
    let third = [model.targets(), vec![ball(0.0, 0.0, 1.1, 0.04)]].concat();
    model.set_ellipsoids(&third).unwrap();
    finish(&mut model);
    let distance = surface_distance(&model.surface(), &bent).unwrap();
    assert!(distance.hausdorff < 0.05, "{}", distance.hausdorff);
    model.set_ellipsoids(&rest).unwrap();
    finish(&mut model);
    assert!(model.surface().positions == given.positions);
}

#[test]
fn a_saved_run_goes_on_at_the_same_bits() {
    let given = shapes::torus(1.0, 0.3, 60, 24);
    let mut model = begun(given.clone());
    let rest = model.ellipsoids();
    model.set_ellipsoids(&[turned(&rest[0], 1.0), ball(0.0, 1.0, 0.2, 0.1)]).unwrap();
    for _ in 0..3 {
        model.step().unwrap();
    }
    let saved = model.save();
    let mut other = begun(given.clone());
    other.restore(&saved).unwrap();
    assert!(other.save() == saved);
    for model in [&mut model, &mut other] {
        model.set_ellipsoids(&[rest[0], ball(0.0, 1.0, 0.4, 0.1)]).unwrap();
        finish(model);
    }
    assert!(other.surface().positions == model.surface().positions);
    // Damaged bytes are refused, and leave the run unchanged.
    let before = other.save();
    for k in (8..saved.len()).step_by(saved.len() / 300) {
        let mut damaged = saved.clone();
        damaged[k] ^= 0x55;
        if other.restore(&damaged).is_err() {
            assert!(other.save() == before);
        } else {
            other.step().unwrap();
            other.restore(&before).unwrap();
        }
    }
    let membrane = MultiresOptions {
        base: Some(Mesh::icosphere(Vec3::ZERO, 1.0, 0.2).unwrap().to_triangles()),
        ellipsoids: vec![ball(0.0, 0.0, 0.0, 0.99)],
        ..MultiresOptions::default()
    };
    assert!(MultiresolutionModel::new(membrane).unwrap().restore(&saved).is_err());
}

#[test]
fn textures_move_with_the_surface() {
    let mut given = bumpy(Vec3::ZERO, 0.15);
    given.uvs = Some(given.positions.iter().map(|p| Vec2::new(p.x, p.y)).collect());
    let mut model = begun(given.clone());
    let rest = model.ellipsoids();
    let corners = model.surface().corner_uvs.unwrap();
    for (uvs, triangle) in corners.iter().zip(&model.surface().triangles) {
        for (uv, &v) in uvs.iter().zip(triangle) {
            assert!(uv.distance(given.uvs.as_ref().unwrap()[v as usize]) < 1e-6);
        }
    }
    model.set_ellipsoids(&shifted(&rest, 0, DVec3::Z * 0.3)).unwrap();
    finish(&mut model);
    let surface = model.surface();
    let highest = (0..surface.triangles.len())
        .max_by(|&a, &b| {
            let top =
                |t: usize| surface.triangles[t].map(|v| surface.positions[v as usize].z).iter().sum::<f32>();
            top(a).total_cmp(&top(b))
        })
        .unwrap();
    let uv = surface.corner_uvs.unwrap()[highest][0];
    let p = surface.positions[surface.triangles[highest][0] as usize];
    assert!(uv.distance(Vec2::new(p.x, p.y)) < 0.05, "{uv} at {p}");
}

#[test]
fn what_cannot_hold_itself_is_refused() {
    let refusal = |options| MultiresolutionModel::new(options).err().unwrap().to_string();
    let surface = Support::Surface;
    let none = refusal(MultiresOptions { support: surface, ..MultiresOptions::default() });
    assert!(none.starts_with("support") && none.contains("detail"), "{none}");
    let mesh = || Some(bumpy(Vec3::ZERO, 0.3));
    let both =
        refusal(MultiresOptions { detail: mesh(), base: mesh(), support: surface, ..Default::default() });
    assert!(both.starts_with("support") && both.contains("base"), "{both}");
    let mut open = bumpy(Vec3::ZERO, 0.3);
    open.triangles.pop();
    let open = MultiresolutionModel::new(MultiresOptions {
        detail: Some(open),
        support: surface,
        ..Default::default()
    });
    assert!(matches!(open, Err(MethodError::Mesh(_))));
    let far = vec![ball(f64::NAN, 0.0, 0.0, 1.0)];
    let far =
        refusal(MultiresOptions { detail: mesh(), ellipsoids: far, support: surface, ..Default::default() });
    assert!(far.starts_with("ellipsoids"), "{far}");
}

/// Two balls intersect as given, a third one does not: it stays apart from them.
#[test]
fn parts_that_intersect_as_given_go_on_to_with_a_warning() {
    let parts = [Vec3::ZERO, Vec3::X * 1.5, Vec3::X * 3.9].map(|centre| bumpy(centre, 0.3));
    let start = vec![ball(0.0, 0.0, 0.0, 0.6), ball(1.5, 0.0, 0.0, 0.6), ball(3.9, 0.0, 0.0, 0.6)];
    let mut model = begun_with(shapes::joined(&parts), &start);
    let report = settle(&mut model);
    assert_eq!(codes(&report), [WarningCode::SelfIntersecting]);
    // The second through the first: they may.
    let mut moved = start.clone();
    moved[1].center[0] = 1.2;
    model.set_ellipsoids(&moved).unwrap();
    assert_eq!(codes(&settle(&mut model)), [WarningCode::SelfIntersecting]);
    assert!((model.ellipsoids()[1].center[0] - 1.2).abs() < 1e-9);
    // And into the third: it stops in time.
    moved[1].center[0] = 2.4;
    model.set_ellipsoids(&moved).unwrap();
    assert_eq!(codes(&settle(&mut model)), [WarningCode::SelfIntersecting, WarningCode::HandleStopped]);
    let surface = model.surface();
    let part = surface.component_of_each_vertex();
    let third = part[parts[0].positions.len() + parts[1].positions.len()];
    let is_third = |t: u32| part[surface.triangles[t as usize][0] as usize] == third;
    let pairs = intersecting_pairs(&surface);
    assert!(pairs.iter().all(|&[s, t]| is_third(s) == is_third(t)), "the third is intersected");
    assert_eq!(codes(&back_to(&mut model, &start)), [WarningCode::SelfIntersecting]);
    assert!(model.surface().positions == shapes::joined(&parts).positions);
}

/// Two boxes that touch: what is added on the face of one is not taken for a part of the other.
#[test]
fn parts_that_touch_as_given_can_be_parted() {
    let parts =
        [shapes::cuboid(Vec3::splat(2.0)), moved(shapes::cuboid(Vec3::new(2.0, 1.0, 1.0)), Vec3::X * 2.0)];
    let start = vec![ball(0.0, 0.0, 0.0, 0.8), ball(2.0, 0.0, 0.0, 0.4)];
    let mut model = begun_with(shapes::joined(&parts), &start);
    let mut moved = start.clone();
    moved[0].center[0] = -0.4;
    model.set_ellipsoids(&moved).unwrap();
    assert_eq!(codes(&settle(&mut model)), [WarningCode::SelfIntersecting]);
    assert!((model.ellipsoids()[0].center[0] + 0.4).abs() < 1e-9);
    back_to(&mut model, &start);
    assert!(model.surface().positions == shapes::joined(&parts).positions);
}

/// Steps until the model is done, of a surface that intersects itself.
fn settle(model: &mut MultiresolutionModel) -> StepReport {
    for _ in 0..300 {
        let report = model.step().unwrap();
        if report.done {
            return report;
        }
    }
    panic!("the run does not end");
}

fn back_to(model: &mut MultiresolutionModel, start: &[ControlEllipsoid]) -> StepReport {
    model.set_ellipsoids(start).unwrap();
    settle(model)
}

fn random_pose(random: &mut Random, rest: &[ControlEllipsoid], size: f64) -> Vec<ControlEllipsoid> {
    let mut number = || random.within(-1.0, 1.0);
    rest.iter()
        .map(|e| {
            let by = DVec3::new(number(), number(), number()) * 0.2 * size;
            let grown = libm::exp(0.5 * number());
            let mut pose = turned(e, 2.0 * number());
            pose.center = (DVec3::from(e.center) + by).to_array();
            pose.axes.as_flattened_mut().iter_mut().for_each(|x| *x *= grown);
            pose
        })
        .collect()
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn random_poses_leave_the_surface_valid() {
    let (mut steps, mut halved) = (0, 0);
    for seed in seeds(3) {
        let _named = Named::new(seed);
        let random = &mut Random(seed);
        let given = others().swap_remove(random.below(5));
        let size = diagonal(&given);
        let mut model = begun(given.clone());
        let rest = model.ellipsoids();
        for _ in 0..3 {
            let params = MultiresParams { edge_min: 0.0, edge_max: 0.0, ..MultiresParams::default() };
            let edge = size * random.within(0.006, 0.02);
            model.set_params(params.with_target(edge)).unwrap();
            model.set_ellipsoids(&random_pose(random, &rest, size)).unwrap();
            for _ in 0..1 + random.below(8) {
                let report = model.step().unwrap();
                assert_sound(&model, &report);
                halved += report.events.creations;
                steps += 1;
            }
        }
        model.set_ellipsoids(&rest).unwrap();
        finish(&mut model);
        assert!(model.surface().positions == given.positions);
    }
    assert_at_least(15, steps, "steps");
    assert_at_least(20, halved as usize, "halved edges");
}

/// It goes as far as a near target, also where the surface folds up on the way to a far one.
#[test]
fn a_far_target_moves_a_handle_as_far_as_a_near_one() {
    let dumbbell = shapes::joined(&[bumpy(Vec3::ZERO, 0.15), bumpy(Vec3::X * 2.4, 0.15)]);
    let start = vec![ball(0.0, 0.0, 0.0, 0.7), ball(2.4, 0.0, 0.0, 0.7)];
    let moved = |by: f64| {
        let mut model = begun_with(dumbbell.clone(), &start);
        let mut target = start.clone();
        target[1].center[0] -= by;
        model.set_ellipsoids(&target).unwrap();
        assert_eq!(model.detail_counts()[1], 0);
        settle(&mut model);
        let by = start[1].center[0] - model.ellipsoids()[1].center[0];
        let held = model.detail_counts()[1];
        back_to(&mut model, &start);
        assert_eq!(model.detail_counts()[1], 0);
        // Those that would have intersected others were held back: a few.
        assert!(20 * held < dumbbell.positions.len() && (held > 0 || by < 0.07), "{by}: {held}");
        by
    };
    let near = [0.03, 0.06, 0.1].map(&moved);
    let far = [0.2, 0.4, 0.8, 1.6].map(moved);
    println!("{near:?} {far:?}");
    let most = near.into_iter().chain(far).fold(0.0, f64::max);
    assert!(near[0] > 0.029 && far.iter().all(|by| *by > most - 0.02), "{near:?} {far:?}");
}

#[test]
fn each_of_several_bodies_has_a_proposed_ball() {
    let round = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap().to_triangles();
    for (count, apart) in [(2, 2.1), (3, 2.1), (2, 6.0)] {
        let centres: Vec<Vec3> = (0..count).map(|i| Vec3::X * apart * i as f32).collect();
        let bodies: Vec<_> = centres.iter().map(|&centre| moved(round.clone(), centre)).collect();
        let found = begun(shapes::joined(&bodies)).ellipsoids();
        let is_in =
            |centre: &Vec3| found.iter().any(|e| DVec3::from(e.center).distance(centre.as_dvec3()) < 1.0);
        assert!(centres.iter().all(is_in), "{count} {apart}: {found:?}");
    }
}

#[test]
fn a_surface_that_is_inside_out_is_refused_in_words() {
    let mut mesh = bumpy(Vec3::ZERO, 0.3);
    mesh.triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
    let options = MultiresOptions { detail: Some(mesh), support: Support::Surface, ..Default::default() };
    let problem = MultiresolutionModel::new(options).err().unwrap().to_string();
    assert!(problem.starts_with("detail") && problem.contains("inside out"), "{problem}");
}

/// Over the balls proposed for a ring, a membrane comes apart.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_membrane_that_comes_apart_is_told() {
    let ring = shapes::torus(1.0, 0.25, 60, 24);
    let ellipsoids = begun(ring.clone()).ellipsoids();
    let options =
        MultiresOptions { detail: Some(ring), ellipsoids, support: Support::Membrane, ..Default::default() };
    let mut model = MultiresolutionModel::new(options).unwrap();
    let report = settle(&mut model);
    assert!(report.components > 1);
    assert_eq!(codes(&report), [WarningCode::Parts]);
}
