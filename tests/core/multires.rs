//! The multiresolution model on known cases: spheres, rigid motion, necks, contacts, and invalid input.

use super::common::fingerprint;
use super::common::skins::{assert_held, assert_sound, ball, ellipsoid, settle, turned};
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{Mesh, MeshError, TriangleMesh, measure};
use vesicle::methods::MethodError;
use vesicle::methods::multires::{
    ControlEllipsoid, Energy, MultiresOptions, MultiresParams, MultiresolutionModel, Topology,
};
use vesicle::spatial::surface_distance;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Returns parameters of a coarse surface, which is fast enough to check every frame.
fn coarse(edge: f64) -> MultiresParams {
    MultiresParams { edge_min: 0.65 * edge, edge_max: 1.45 * edge, ..Default::default() }
}

fn lamp(ellipsoids: &[ControlEllipsoid], params: MultiresParams) -> MultiresolutionModel {
    let options = MultiresOptions { ellipsoids: ellipsoids.to_vec(), params, ..Default::default() };
    MultiresolutionModel::new(options).unwrap()
}

/// Returns a ball with bumps all over.
fn bumpy(edge: f32) -> TriangleMesh {
    let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, edge).unwrap().to_triangles();
    for p in &mut mesh.positions {
        let q = p.as_dvec3();
        let bump = libm::sin(7.0 * q.x) * libm::sin(6.0 * q.y + 1.0) * libm::sin(5.0 * q.z + 2.0);
        *p = (q * (1.05 + 0.06 * bump)).as_vec3();
    }
    mesh.normals = None;
    mesh
}

fn bumpy_model(params: MultiresParams) -> MultiresolutionModel {
    let options = MultiresOptions {
        detail: Some(bumpy(0.06)),
        base: Some(Mesh::icosphere(Vec3::ZERO, 1.0, 0.1).unwrap().to_triangles()),
        ellipsoids: vec![ball(0.0, 0.0, 0.0, 0.995), ball(0.2, 0.0, 0.0, 0.5)],
        params,
        ..Default::default()
    };
    MultiresolutionModel::new(options).unwrap()
}

#[test]
fn the_surface_over_one_ball_is_that_ball() {
    for energy in [Energy::Membrane, Energy::ThinPlate] {
        let mut model = lamp(&[ball(1.0, 2.0, 3.0, 2.0)], MultiresParams { energy, ..coarse(0.3) });
        settle(&mut model, 20);
        assert_held(&model);
        for v in model.base_mesh().vertices() {
            let radius = model.base_mesh().position(v).distance(Vec3::new(1.0, 2.0, 3.0));
            // A thin plate follows the ball less closely than a membrane.
            assert!((radius - 2.0).abs() < if energy == Energy::Membrane { 0.01 } else { 0.05 }, "{radius}");
        }
    }
}

/// The membrane between two balls is thinner in the middle than the balls, and nowhere inside them.
#[test]
fn the_surface_over_two_balls_has_a_neck() {
    let mut model = lamp(&[ball(-1.0, 0.0, 0.0, 1.0), ball(1.0, 0.0, 0.0, 1.0)], coarse(0.12));
    let report = settle(&mut model, 20);
    assert_held(&model);
    assert_eq!((report.components, report.euler), (1, 2));
    let waist = model.base_mesh().positions().iter().filter(|p| p.x.abs() < 0.05);
    let radii: Vec<f32> = waist.map(|p| (p.y * p.y + p.z * p.z).sqrt()).collect();
    assert!(radii.iter().all(|r| *r > 0.3 && *r < 0.9), "{radii:?}");
}

#[test]
fn edges_are_in_bounds_after_every_frame() {
    let mut model = lamp(&[ball(-0.5, 0.0, 0.0, 1.0), ball(0.5, 0.0, 0.0, 0.8)], coarse(0.12));
    for k in 0..6 {
        model
            .set_ellipsoids(&[ball(-0.5, 0.0, 0.0, 1.0), ball(0.5 + 0.12 * f64::from(k), 0.0, 0.0, 0.8)])
            .unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
        let mesh = model.base_mesh();
        let length = |(u, v)| f64::from(mesh.position(u).distance(mesh.position(v)));
        let outside = mesh.edges().map(length).filter(|l| *l < 0.65 * 0.12 || *l > 1.45 * 0.12).count();
        assert!(outside * 50 < mesh.edge_count(), "{outside} of {}", mesh.edge_count());
    }
}

/// The ellipsoids overlap, are nested, intersect, separate, rotate and change size; none leaves the surface or is
/// penetrated by it.
#[test]
fn every_ellipsoid_stays_covered_and_is_never_penetrated() {
    let thin = ellipsoid([0.0, 0.0, 0.0], [1.2, 0.4, 0.6]);
    for topology in [Topology::Never, Topology::Split, Topology::SplitAndJoin] {
        let start = [ball(-0.6, 0.0, 0.0, 0.8), thin, ball(-0.6, 0.1, 0.0, 0.4)];
        let mut model = lamp(&start, MultiresParams { topology, ..coarse(0.14) });
        for k in 0..12 {
            let t = f64::from(k) / 11.0;
            let crossing =
                turned(&ControlEllipsoid { center: [1.4 * t - 0.2, 0.3 * t, 0.0], ..thin }, 2.5 * t);
            // Moves from the inside of the first ellipsoid through the second and out beyond it.
            let nested = ball(-0.6 + 2.0 * t, 0.1, 0.2 * t, 0.4 + 0.1 * t);
            model.set_ellipsoids(&[ball(-0.6, 0.0, 0.0, 0.8 - 0.2 * t), crossing, nested]).unwrap();
            let report = model.step().unwrap();
            assert_sound(&model, &report);
            assert_held(&model);
        }
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_neck_splits_and_the_components_join_again() {
    let apart = |gap: f64| [ball(-0.8 - gap, 0.0, 0.0, 0.8), ball(0.8 + gap, 0.0, 0.0, 0.8)];
    let mut model = lamp(&apart(-0.2), MultiresParams { topology: Topology::SplitAndJoin, ..coarse(0.14) });
    let mut components = vec![];
    for k in 0..10 {
        model.set_ellipsoids(&apart(-0.2 + 0.1 * f64::from(k))).unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
        components.push(report.components);
    }
    settle(&mut model, 20);
    assert_held(&model);
    assert_eq!((components[0], model.step().unwrap().components), (1, 2), "{components:?}");
    for k in 0..14 {
        model.set_ellipsoids(&apart(0.7 - 0.08 * f64::from(k))).unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
    }
    let report = settle(&mut model, 20);
    assert_eq!((report.components, report.euler), (1, 2));
}

#[test]
fn components_that_must_not_join_press_on_each_other() {
    let apart = |gap: f64| [ball(-0.8 - gap, 0.0, 0.0, 0.8), ball(0.8 + gap, 0.0, 0.0, 0.8)];
    let mut model = lamp(&apart(0.3), coarse(0.16));
    settle(&mut model, 10);
    for k in 0..8 {
        model.set_ellipsoids(&apart(0.3 - 0.06 * f64::from(k))).unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
        assert_eq!(report.components, 2);
    }
}

/// Two components that must not join cannot pass through each other.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_run_that_does_not_converge_ends() {
    let at = |x: f64| [ball(x, 0.0, 0.0, 0.8), ball(-x, 0.0, 0.0, 0.8)];
    let mut model = lamp(&at(0.6), coarse(0.2));
    settle(&mut model, 20);
    model.set_ellipsoids(&at(1.2)).unwrap();
    assert_eq!(settle(&mut model, 50).components, 2);
    model.set_params(MultiresParams { topology: Topology::Never, ..model.params().clone() }).unwrap();
    model.set_ellipsoids(&at(-0.5)).unwrap();
    let report = settle(&mut model, 200);
    assert!(report.residual > report.tolerance, "{}", report.residual);
    assert_eq!(model.step().unwrap().iteration, report.iteration);
    // A saved state tells that it is over, and another target begins again.
    let saved = model.save();
    model.set_ellipsoids(&at(-0.6)).unwrap();
    assert!(!model.step().unwrap().done);
    model.restore(&saved).unwrap();
    assert!(model.step().unwrap().done);
}

/// Regression: with an upper edge bound far above the lower one, contacts were refined to the lower one, and came into
/// contact again, until the mesh had a hundred times as many vertices.
#[test]
fn components_join_under_wide_edge_bounds() {
    let topology = Topology::SplitAndJoin;
    let start = MultiresParams { edge_min: 0.164, edge_max: 0.395, topology, ..Default::default() };
    let still = ellipsoid([-0.685, 0.032, 0.032], [0.612, 0.553, 0.519]);
    let moving = ellipsoid([0.803, -0.015, 0.028], [0.738, 0.465, 0.528]);
    let mut model = lamp(&[still, moving], start.clone());
    assert_eq!(settle(&mut model, 20).components, 2);
    model.set_params(MultiresParams { edge_min: 0.044, ..start }).unwrap();
    model.set_ellipsoids(&[still, ellipsoid([-0.151, 0.057, 0.26], [0.552, 0.668, 0.964])]).unwrap();
    let report = settle(&mut model, 30);
    assert_eq!(report.components, 1);
    assert!(report.vertices < 2000, "{} vertices", report.vertices);
}

#[test]
fn without_topology_changes_a_thread_remains() {
    let apart = |gap: f64| [ball(-0.8 - gap, 0.0, 0.0, 0.8), ball(0.8 + gap, 0.0, 0.0, 0.8)];
    let mut model = lamp(&apart(-0.2), MultiresParams { topology: Topology::Never, ..coarse(0.16) });
    for k in 0..9 {
        model.set_ellipsoids(&apart(-0.2 + 0.1 * f64::from(k))).unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
        assert_eq!((report.components, report.euler), (1, 2));
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn the_detail_follows_a_rigid_motion_exactly() {
    let mut model = bumpy_model(coarse(0.12));
    settle(&mut model, 20);
    let before = model.mesh().to_triangles();
    let at = |k: f64, e: ControlEllipsoid| {
        let turned = turned(&ControlEllipsoid { center: [0.0; 3], ..e }, 0.2 * k);
        let (sine, cosine) = (0.2 * k).sin_cos();
        let [x, y, z] = e.center;
        let center = [cosine * x - sine * y + 0.3 * k, sine * x + cosine * y, z];
        ControlEllipsoid { center, axes: turned.axes }
    };
    let start = model.ellipsoids();
    for k in 1..=10 {
        model.set_ellipsoids(&start.iter().map(|e| at(f64::from(k), *e)).collect::<Vec<_>>()).unwrap();
        settle(&mut model, 10);
    }
    let turn = vesicle::math::DAffine3::from_mat3_translation(
        vesicle::math::DMat3::from_rotation_z(2.0),
        DVec3::new(3.0, 0.0, 0.0),
    );
    let distance = surface_distance(&model.mesh().to_triangles(), &before.transformed(&turn)).unwrap();
    assert!(distance.hausdorff < 1e-3 * 2.0, "{}", distance.hausdorff);
}

#[test]
fn the_detail_reproduces_the_surface_and_keeps_it_under_deformation() {
    let mut model = bumpy_model(MultiresParams { supersample: 1, ..coarse(0.1) });
    let detail = bumpy(0.06);
    let report = model.step().unwrap();
    assert_sound(&model, &report);
    let distance = surface_distance(&model.mesh().to_triangles(), &detail).unwrap();
    // The sagitta of the longest edge over bumps of curvature 4.
    assert!(distance.mean < 0.5 * 4.0 * 0.145 * 0.145 / 8.0, "{}", distance.mean);
    for k in 1..=6 {
        model
            .set_ellipsoids(&[ball(0.0, 0.0, 0.0, 0.995), ball(0.2 + 0.2 * f64::from(k), 0.0, 0.0, 0.5)])
            .unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
        assert_eq!((report.components, model.folded()), (1, 0));
    }
    // The far side has not moved.
    let far = |p: &&Vec3| p.x < -0.4;
    let tree = vesicle::spatial::TriangleTree::new(&detail).unwrap();
    let moved = model.mesh().to_triangles();
    let distances: Vec<f64> =
        moved.positions.iter().filter(far).map(|p| tree.closest(*p).unwrap().distance).collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    assert!(distances.len() > 50 && mean < 0.02, "{mean}");
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn the_base_correspondence_keeps_areas_and_does_not_fold() {
    let globe = Mesh::icosphere(Vec3::ZERO, 1.0, 0.1).unwrap().to_triangles();
    let mut model = MultiresolutionModel::new(MultiresOptions {
        base: Some(globe),
        ellipsoids: vec![ball(0.0, 0.0, 0.0, 0.999), ball(0.3, 0.0, 0.0, 0.6)],
        params: coarse(0.1),
        ..Default::default()
    })
    .unwrap();
    for k in 0..16 {
        let x = 0.3 + 1.1 * f64::from(k) / 15.0;
        model.set_ellipsoids(&[ball(0.0, 0.0, 0.0, 0.999), ball(x, 0.0, 0.0, 0.6)]).unwrap();
        let report = model.step().unwrap();
        assert_sound(&model, &report);
        assert_eq!(model.folded(), 0, "at {x}");
        let mut areas = model.distortion().area;
        areas.sort_by(f64::total_cmp);
        let [low, high] = [areas[areas.len() / 20], areas[areas.len() - 1 - areas.len() / 20]];
        assert!(low > 0.4 && high < 2.2, "{low} {high} at {x}");
        // Corresponding points lie on the base.
        let on_base = |p: &Vec3| (f64::from(p.length()) - 1.0).abs() < 0.01;
        assert!(model.link_mesh().positions.iter().all(on_base));
    }
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    let params = MultiresParams { topology: Topology::SplitAndJoin, ..coarse(0.14) };
    let mut model = bumpy_model(params.clone());
    let goal = [ball(0.0, 0.0, 0.0, 0.995), ball(1.6, 0.4, 0.0, 0.6)];
    model.set_ellipsoids(&goal).unwrap();
    for _ in 0..3 {
        model.step().unwrap();
    }
    let state = model.save();
    let mut other = bumpy_model(params);
    other.restore(&state).unwrap();
    assert_eq!(other.surface(), model.surface());
    for _ in 0..4 {
        let (a, b) = (model.step().unwrap(), other.step().unwrap());
        assert_eq!((a.iteration, a.done, a.residual, a.events), (b.iteration, b.done, b.residual, b.events));
        assert_eq!(other.mesh().positions(), model.mesh().positions());
        assert_eq!(other.save(), model.save());
    }
    let mut damaged = state.clone();
    damaged[40] ^= 1;
    assert!(matches!(other.restore(&damaged), Err(MethodError::BadState { .. })));
    let mut another = lamp(&goal, coarse(0.2));
    assert!(matches!(another.restore(&state), Err(MethodError::BadState { .. })));
}

#[test]
fn ellipsoids_are_added_and_removed() {
    let mut model = lamp(&[ball(0.0, 0.0, 0.0, 1.0)], coarse(0.16));
    let volume = |model: &MultiresolutionModel| measure(&model.base_mesh().to_triangles()).volume;
    let before = volume(&model);
    model.set_ellipsoids(&[ball(0.0, 0.0, 0.0, 1.0), ball(0.9, 0.0, 0.0, 0.5)]).unwrap();
    settle(&mut model, 40);
    assert_held(&model);
    assert!(volume(&model) > 1.03 * before);
    model.set_ellipsoids(&[ball(0.0, 0.0, 0.0, 1.0)]).unwrap();
    settle(&mut model, 40);
    assert_eq!(model.ellipsoids().len(), 1);
    assert!((volume(&model) / before - 1.0).abs() < 0.02);
}

/// An ellipsoid that grew outside the surface would push it away and tear its base correspondence.
#[test]
fn a_new_ellipsoid_outside_grows_out_of_its_neighbour() {
    let old = [ball(0.0, 0.0, 0.0, 1.0), ball(-0.8, 0.0, 0.0, 0.7)];
    let mut model = lamp(&old, coarse(0.16));
    settle(&mut model, 20);
    let before = measure(&model.base_mesh().to_triangles()).volume;
    let fresh = ellipsoid([1.6, 0.3, 0.0], [0.5, 0.6, 0.4]);
    model.set_ellipsoids(&[old[0], old[1], fresh]).unwrap();
    settle(&mut model, 60);
    assert_held(&model);
    assert_eq!(model.folded(), 0);
    assert!(measure(&model.base_mesh().to_triangles()).volume > before + 0.5);
}

/// Frames in between may only relax the surface; the final one is solved for.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn many_small_moves_end_like_one_large_move() {
    let at = |way: f64| [ball(-0.7, 0.0, 0.0, 0.8), ball(0.5 + way, 0.2 * way, 0.0, 0.7)];
    let mut dragged = lamp(&at(0.0), coarse(0.1));
    settle(&mut dragged, 20);
    for k in 1..=30 {
        dragged.set_ellipsoids(&at(0.008 * f64::from(k))).unwrap();
        let report = dragged.step().unwrap();
        assert_sound(&dragged, &report);
    }
    settle(&mut dragged, 20);
    assert_held(&dragged);
    let mut placed = lamp(&at(0.24), coarse(0.1));
    settle(&mut placed, 20);
    let [dragged, placed] = [dragged, placed].map(|model| model.base_mesh().to_triangles());
    let apart = surface_distance(&dragged, &placed).unwrap().hausdorff;
    // When converged, each is within an edge length of the exact solution.
    assert!(apart < 0.15, "{apart}");
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn edges_grow_to_forty_times_their_length_within_a_few_frames() {
    let mut model = lamp(&[ball(0.0, 0.0, 0.0, 20.0)], coarse(0.5));
    model.set_params(coarse(20.0)).unwrap();
    for _ in 0..8 {
        let report = model.step().unwrap();
        assert_sound(&model, &report);
    }
    assert!(model.base_mesh().vertex_count() < 100);
}

/// Edges are within the bounds already, far from the mean edge that these correspond to.
#[test]
fn a_higher_bound_alone_is_met_at_once() {
    let mut model = lamp(&[ball(-0.5, 0.0, 0.0, 1.0), ball(0.5, 0.0, 0.0, 0.8)], coarse(0.2));
    settle(&mut model, 20);
    let edge_max = 4.0 * model.params().edge_max;
    model.set_params(MultiresParams { edge_max, ..model.params().clone() }).unwrap();
    settle(&mut model, 20);
    assert_held(&model);
}

#[test]
fn parameters_apply_to_the_running_model() {
    let mut model = lamp(&[ball(-0.5, 0.0, 0.0, 1.0), ball(0.5, 0.0, 0.0, 0.8)], coarse(0.2));
    settle(&mut model, 20);
    let vertices = model.base_mesh().vertex_count();
    model.set_params(MultiresParams { levels: 3, ..coarse(0.1) }).unwrap();
    settle(&mut model, 20);
    let finer = model.base_mesh().vertex_count();
    assert!(finer > 3 * vertices && finer < 6 * vertices, "{vertices} {finer}");
    assert!(model.set_params(coarse(1e-4)).is_err());
    assert_eq!(model.params().levels, 3);
}

#[test]
fn supersampling_applies_at_once_and_moves_nothing() {
    let mut model = bumpy_model(coarse(0.12));
    settle(&mut model, 20);
    let (base, vertices) = (model.base_mesh().clone(), model.mesh().vertex_count());
    model.set_params(MultiresParams { supersample: 2, ..coarse(0.12) }).unwrap();
    assert!(model.mesh().vertex_count() > vertices);
    let report = model.step().unwrap();
    assert_sound(&model, &report);
    assert!(report.done && model.base_mesh().positions() == base.positions());
}

#[test]
fn levels_go_from_coarse_to_fine() {
    let model = lamp(&[ball(-0.5, 0.0, 0.0, 1.0), ball(0.5, 0.0, 0.0, 0.8)], coarse(0.08));
    let levels = model.levels();
    assert_eq!(levels.len(), 3);
    assert!(levels.windows(2).all(|pair| pair[1].triangles.len() > 2 * pair[0].triangles.len()));
}

/// The base is computed from the detail; base and detail together reproduce the given surface.
#[test]
fn a_missing_base_is_computed_from_the_detail() {
    let detail = bumpy(0.06);
    let model = MultiresolutionModel::new(MultiresOptions {
        detail: Some(detail.clone()),
        ellipsoids: vec![ball(0.0, 0.0, 0.0, 0.9)],
        params: MultiresParams { supersample: 1, ..coarse(0.1) },
        ..Default::default()
    })
    .unwrap();
    let distance = surface_distance(&model.mesh().to_triangles(), &detail).unwrap();
    assert!(distance.mean < 0.01, "{}", distance.mean);
    // The base has lost the bumps.
    let base = model.base_mesh().to_triangles();
    let radii: Vec<f32> = base.positions.iter().map(|p| p.length()).collect();
    let [low, high] = [f32::min, f32::max].map(|pick| radii.iter().copied().reduce(pick).unwrap());
    assert!(high - low < 0.02, "{low} {high}");
}

fn refusal(options: MultiresOptions) -> MethodError {
    MultiresolutionModel::new(options).err().unwrap()
}

#[test]
fn invalid_input_is_refused_by_name() {
    let good = || MultiresOptions {
        detail: Some(bumpy(0.2)),
        ellipsoids: vec![ball(0.0, 0.0, 0.0, 0.9)],
        ..Default::default()
    };
    let message = |options: MultiresOptions| refusal(options).to_string();
    assert!(
        message(MultiresOptions { ellipsoids: vec![], ..good() })
            .starts_with("ellipsoids: must have at least one")
    );
    assert!(
        message(MultiresOptions { ellipsoids: vec![ball(9.0, 0.0, 0.0, 0.5)], ..good() })
            .contains("at least one must touch the base")
    );
    assert!(
        message(MultiresOptions { ellipsoids: vec![ball(0.0, 0.0, 0.0, 0.0)], ..good() })
            .contains("semi-axes must be")
    );
    assert!(
        message(MultiresOptions { ellipsoids: vec![ball(f64::NAN, 0.0, 0.0, 1.0)], ..good() })
            .contains("center must be finite")
    );
    let sharp = ellipsoid([0.0; 3], [1.0, 0.2, 0.2]);
    assert!(
        message(MultiresOptions { ellipsoids: vec![sharp], ..good() })
            .contains("number 0 has tips of radius 0.040")
    );
    let narrow = MultiresParams { edge_min: 0.1, edge_max: 0.2, ..Default::default() };
    assert!(
        message(MultiresOptions { params: narrow, ..good() })
            .starts_with("edgeMax: must be > 2 × edgeMin (0.1), got 0.2")
    );
    let mut open = bumpy(0.2);
    open.triangles.pop();
    let not_closed = |error| matches!(error, MethodError::Mesh(MeshError::NotClosed { .. }));
    assert!(not_closed(refusal(MultiresOptions { detail: Some(open.clone()), ..good() })));
    assert!(not_closed(refusal(MultiresOptions { base: Some(open), ..good() })));
    let mut speck = bumpy(0.2);
    speck.positions.iter_mut().for_each(|p| *p *= 1e-42);
    let detail = message(MultiresOptions { detail: Some(speck.clone()), ..good() });
    assert!(detail.starts_with("detail: the mean edge length"), "{detail}");
    let base = message(MultiresOptions { base: Some(speck), ..good() });
    assert!(base.starts_with("base: the mean edge length"), "{base}");
    let mut crossing = bumpy(0.2);
    crossing.positions[0] *= -3.0;
    let error = refusal(MultiresOptions { base: Some(crossing), ..good() });
    assert!(matches!(error, MethodError::Mesh(MeshError::SelfIntersecting { .. })), "{error}");
    let error = refusal(MultiresOptions { params: coarse(1e-5), ..good() });
    assert!(matches!(error, MethodError::TooManyVertices { .. }), "{error}");
}

/// Scaled a million times with the same edge lengths, the surface would need more vertices than fit into memory.
#[test]
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
fn a_surface_that_gets_too_large_is_refused_and_kept() {
    let mut model = lamp(&[ball(0.0, 0.0, 0.0, 1.0)], coarse(0.2));
    model.set_ellipsoids(&[ball(0.0, 0.0, 0.0, 1e5)]).unwrap();
    let mut frames = 0;
    let error = loop {
        match model.step() {
            Ok(_) => frames += 1,
            Err(error) => break error,
        }
        assert!(frames < 30);
    };
    assert!(matches!(error, MethodError::TooManyVertices { .. }));
    assert_eq!(model.base_mesh().check(), Ok(()));
    model.set_ellipsoids(&[ball(0.0, 0.0, 0.0, 1.0)]).unwrap();
    model.step().unwrap();
    assert_eq!(model.base_mesh().check(), Ok(()));
}

/// The same as `tests/js/lamp.ts` computes in Node and in the browser.
#[test]
fn bits_are_the_same_on_every_platform() {
    let params = MultiresParams {
        edge_min: 0.125,
        edge_max: 0.28125,
        topology: Topology::SplitAndJoin,
        ..Default::default()
    };
    let mut model = lamp(&[ball(-0.75, 0.0, 0.0, 0.75), ball(0.5, 0.0, 0.0, 0.75)], params);
    for frame in 1..=16 {
        let shift = 0.125 * f64::from(if frame <= 10 { frame } else { 20 - frame });
        model.set_ellipsoids(&[ball(-0.75, 0.0, 0.0, 0.75), ball(0.5 + shift, 0.0, 0.0, 0.75)]).unwrap();
        model.step().unwrap();
    }
    assert_eq!(format!("{:016x}", fingerprint(&model.surface().positions)), LAMP_BITS);
}

/// After an intended change of the core, copy the value that the test finds here and to `tests/js/lamp.ts`.
const LAMP_BITS: &str = "82280a25d547c21c";
