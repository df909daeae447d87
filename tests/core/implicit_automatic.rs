//! The implicit surface with parameters that it chooses from its points.

use super::common::Random;
use super::common::euler_of_parts;
use super::common::points::{Shape, direction, noisy, normal, pair, sphere, torus};
use std::f64::consts::PI;
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{measure, report};
use vesicle::methods::Auto;
use vesicle::methods::implicit::{
    Cloud, ImplicitOptions, ImplicitParams, ImplicitSurface, PointEdits, Sides,
};
use vesicle::warning::{Place, Warning, WarningCode};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn begun(cloud: Cloud) -> ImplicitSurface {
    ImplicitSurface::new(cloud, ImplicitOptions::default()).unwrap()
}

/// Begins with the settings of the paper.
fn begun_on_paper(cloud: Cloud) -> ImplicitSurface {
    let options = ImplicitOptions { params: ImplicitParams::paper(), ..ImplicitOptions::default() };
    ImplicitSurface::new(cloud, options).unwrap()
}

fn finish(surface: &mut ImplicitSurface) {
    while !surface.step().unwrap().done {}
    assert!(report(surface.surface()).unwrap().is_healthy());
}

fn finished(points: Vec<Vec3>) -> ImplicitSurface {
    let mut surface = begun(Cloud { points, ..Cloud::default() });
    finish(&mut surface);
    surface
}

fn volume(surface: &ImplicitSurface) -> f64 {
    measure(surface.surface()).volume
}

const BALL: f64 = 4.0 / 3.0 * PI;

#[test]
fn noise_is_measured_and_lambda_grows_with_it() {
    let choices = [0.0, 0.01, 0.02].map(|noise| {
        let mut surface = begun(Cloud { points: noisy(torus, 3000, noise, 1), ..Cloud::default() });
        assert!(surface.choice().is_none());
        while surface.choice().is_none() {
            surface.step().unwrap();
        }
        let choice = surface.choice().unwrap();
        assert!((choice.noise - noise).abs() < 0.3 * noise + 1e-3, "{noise}: {choice:?}");
        choice
    });
    assert!(choices[0].lambda_surface < choices[1].lambda_surface);
    assert!(choices[1].lambda_surface < choices[2].lambda_surface);
}

/// Points that leave gaps larger than parts of the surface, where points outside alone give nothing.
#[test]
fn a_few_points_on_a_sphere_give_a_ball() {
    for count in [20, 50, 100] {
        let found = volume(&finished(noisy(sphere, count, 0.0, 7)));
        assert!((found / BALL - 1.0).abs() < 0.2, "{count} points: {found} for {BALL}");
    }
}

/// Normals that are given show how far a surface bulges between few points.
#[test]
fn a_few_points_with_normals_on_a_sphere_give_a_round_ball() {
    let golden = PI * (3.0 - libm::sqrt(5.0));
    for (count, tolerance) in [(8, 0.03), (12, 0.02), (20, 0.02), (50, 0.02)] {
        let points: Vec<Vec3> = (0..count)
            .map(|i| {
                let (z, turn) = (1.0 - (2 * i + 1) as f64 / f64::from(count), golden * f64::from(i));
                let radius = libm::sqrt(1.0 - z * z);
                DVec3::new(radius * libm::cos(turn), radius * libm::sin(turn), z).as_vec3()
            })
            .collect();
        let mut surface = begun(Cloud { normals: Some(points.clone()), points, ..Cloud::default() });
        while !surface.step().unwrap().done {}
        let found = volume(&surface);
        assert!((found / BALL - 1.0).abs() < tolerance, "{count} points: {found} for {BALL}");
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn noise_neither_shrinks_shapes_nor_changes_their_topology() {
    let shapes: [(Shape, &[i64], f64); 3] =
        [(sphere, &[2], BALL), (torus, &[0], 2.0 * PI * PI * 0.7 * 0.09), (pair, &[2, 2], BALL * 0.167_875)];
    for (shape, euler, expected) in shapes {
        let surface = finished(noisy(shape, 3000, 0.02, 1));
        assert_eq!(euler_of_parts(surface.surface()), euler);
        let share = volume(&surface) / expected;
        assert!((share - 1.0).abs() < 0.03, "{share}");
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn two_balls_with_a_small_gap_stay_apart() {
    for gap in [0.1, 0.3] {
        let ball = |seed: u64, side: f32| {
            let ball = noisy(sphere, 1500, 0.0, seed);
            ball.into_iter().map(move |p| p + Vec3::X * side * (1.0 + gap / 2.0)).collect::<Vec<_>>()
        };
        let surface = finished([ball(1, -1.0), ball(2, 1.0)].concat());
        assert_eq!(euler_of_parts(surface.surface()), [2, 2], "gap {gap}");
        assert!((volume(&surface) / (2.0 * BALL) - 1.0).abs() < 0.01);
    }
}

/// Where the gap is narrower than the points are apart, it is bridged: the warning names a point there.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_gap_narrower_than_the_spacing_of_the_points_gives_a_warning() {
    for (gap, is_clear) in [(0.04, false), (0.3, true)] {
        let ball = |seed: u64, side: f32| {
            let ball = noisy(sphere, 750, 0.0, seed);
            ball.into_iter().map(move |p| p + Vec3::X * side * (1.0 + gap / 2.0)).collect::<Vec<_>>()
        };
        let mut surface = finished([ball(1, -1.0), ball(2, 1.0)].concat());
        assert_eq!(euler_of_parts(surface.surface()).len(), if is_clear { 2 } else { 1 });
        let warnings = surface.step().unwrap().warnings;
        let mut restored =
            begun(Cloud { points: [ball(1, -1.0), ball(2, 1.0)].concat(), ..Cloud::default() });
        restored.restore(&surface.save()).unwrap();
        assert_eq!(restored.step().unwrap().warnings, warnings);
        let is_there = |place: &Option<Place>| matches!(place, Some(Place::Point(p)) if p[0].abs() < 0.3);
        let found = warnings.iter().filter(|one| one.code == WarningCode::ThinParts && is_there(&one.place));
        assert_eq!((found.count(), warnings.len()), if is_clear { (0, 0) } else { (1, 1) }, "{warnings:?}");
    }
}

/// A small ball beside a larger one, of so few points that the surface leaves it out: the warning names a point on it.
#[test]
fn parts_of_too_few_points_for_a_surface_give_a_warning() {
    let middle = Vec3::X * 2.0;
    let mut lost = 0;
    for count in 2..10 {
        let part = noisy(sphere, count, 0.0, 2).into_iter().map(|p| middle + 0.15 * p);
        let mut surface = finished(noisy(sphere, 100, 0.0, 1).into_iter().chain(part).collect());
        let warnings = surface.step().unwrap().warnings;
        println!("{count}: {:?} {warnings:?}", euler_of_parts(surface.surface()));
        if euler_of_parts(surface.surface()).len() == 1 {
            let [Warning { code: WarningCode::ThinParts, place: Some(Place::Point(p)), .. }] = warnings[..]
            else {
                panic!("{count}: {warnings:?}")
            };
            assert!(DVec3::from(p).distance(middle.as_dvec3()) < 0.2, "{p:?}");
            lost += 1;
        }
    }
    assert!(lost > 0);
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_cavity_stays_hollow() {
    let shell: Vec<Vec3> = noisy(sphere, 2000, 0.0, 1)
        .into_iter()
        .chain(noisy(sphere, 800, 0.0, 2).iter().map(|p| p * 0.6))
        .collect();
    let surface = finished(shell);
    assert_eq!(euler_of_parts(surface.surface()), [2, 2]);
    let expected = BALL * (1.0 - 0.216);
    assert!((volume(&surface) / expected - 1.0).abs() < 0.02, "{} for {expected}", volume(&surface));
}

/// A wall as thin as the points are apart looks like one sheet with noise, but its distances from the surface have two values.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_surface_between_two_sheets_gives_a_warning() {
    for (inner, count) in [(0.9, 2000), (0.85, 1000)] {
        let points = noisy(sphere, count, 0.0, 1).into_iter().enumerate();
        let shell = points.map(|(i, p)| if i % 2 == 0 { p } else { p * inner }).collect();
        let mut surface = finished(shell);
        // The cavity is lost.
        assert_eq!(euler_of_parts(surface.surface()), [2]);
        let warnings = surface.step().unwrap().warnings;
        let [Warning { code: WarningCode::ThinParts, place: Some(Place::Point(p)), .. }] = warnings[..]
        else {
            panic!("{inner}: {warnings:?}")
        };
        assert!((DVec3::from(p).length() - 1.0).abs() < 0.2, "{p:?}");
    }
    // Noise is of one sheet, also where it is as likely anywhere within its bounds.
    let mut random = Random(3);
    let uniform =
        noisy(sphere, 1500, 0.0, 1).into_iter().map(|p| p * (1.0 + random.within(-0.1, 0.1) as f32));
    for points in [uniform.collect(), noisy(sphere, 1500, 0.05, 1)] {
        assert_eq!(finished(points).step().unwrap().warnings, []);
    }
}

/// Points scattered around an object get parts of their own, which a warning says. Where points are sparser there is none.
#[test]
fn scattered_points_that_the_surface_follows_give_a_warning() {
    for seed in 1..=6 {
        let mut random = Random(seed);
        let scattered = (0..30).map(|_| Vec3::from([0; 3].map(|_| random.within(-4.0, 4.0) as f32)));
        let points: Vec<Vec3> = noisy(sphere, 800, 0.0, seed).into_iter().chain(scattered).collect();
        let mut surface = finished(points.clone());
        assert!(euler_of_parts(surface.surface()).len() > 1);
        let found =
            surface.step().unwrap().warnings.into_iter().find(|one| one.code == WarningCode::Outliers);
        let Some(Warning { place: Some(Place::Point(p)), .. }) = found else { panic!("{seed}: {found:?}") };
        assert!((DVec3::from(p).length() - 1.0).abs() > 0.2, "{p:?}");
        if seed > 1 {
            continue;
        }
        let mut cleaned = ImplicitSurface::new(
            Cloud { points, ..Cloud::default() },
            ImplicitOptions { keep_components: Some(1), ..ImplicitOptions::default() },
        );
        let cleaned = cleaned.as_mut().unwrap();
        while !cleaned.step().unwrap().done {}
        assert!(cleaned.step().unwrap().warnings.iter().all(|one| one.code != WarningCode::Outliers));
    }
    // Every tenth point of a half.
    let uneven = noisy(sphere, 1500, 0.0, 1).into_iter().enumerate();
    let uneven = uneven.filter(|(i, p)| p.z > 0.0 || i % 10 == 0).map(|(_, p)| p).collect();
    let warnings = finished(uneven).step().unwrap().warnings;
    assert!(warnings.iter().all(|one| one.code != WarningCode::Outliers), "{warnings:?}");
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn parts_as_thin_as_the_noise_give_a_warning() {
    let codes = |points: Vec<Vec3>, normals: Option<Vec<Vec3>>| {
        let mut surface = begun(Cloud { points, normals, ..Cloud::default() });
        loop {
            let report = surface.step().unwrap();
            if report.done {
                return report.warnings.iter().map(|warning| warning.code).collect::<Vec<_>>();
            }
        }
    };
    let [clean, noisy] = [0.0, 0.02].map(|noise| noisy(sphere, 2000, noise, 3));
    let flattened = |height: f32| {
        let points = clean.iter().zip(&noisy);
        points.map(|(p, q)| Vec3::new(p.x, p.y, p.z * height) + (q - p)).collect::<Vec<_>>()
    };
    assert_eq!(codes(flattened(1.0), None), []);
    assert_eq!(codes(flattened(0.03), None), [WarningCode::ThinParts]);
    // Where normals are given, they are consistent, but no point inside is found.
    let normals = clean.iter().map(|p| Vec3::new(p.x, p.y, p.z / 0.03).normalize()).collect();
    assert_eq!(codes(flattened(0.03), Some(normals)), [WarningCode::ThinParts]);
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn normals_that_are_given_decide_the_side() {
    let points = noisy(sphere, 1500, 0.0, 3);
    let inwards: Vec<Vec3> = points.iter().map(|p| -p.normalize()).collect();
    let outwards = inwards.iter().map(|n| -n).collect();
    let mut right = begun(Cloud { points: points.clone(), normals: Some(outwards), ..Cloud::default() });
    assert_eq!(right.step().unwrap().warnings, []);
    let mut surface = begun(Cloud { points, normals: Some(inwards), ..Cloud::default() });
    while !surface.step().unwrap().done {}
    // Inside and outside are exchanged, and there is a warning.
    assert!(surface.evaluate(&[Vec3::ZERO]).unwrap()[0] < 0.0);
    assert_eq!(surface.step().unwrap().warnings[0].code, WarningCode::InwardNormals);
}

#[test]
fn points_rounded_by_much_of_their_spacing_give_a_warning() {
    let codes = |away: f64, rounds: bool| {
        let ball = noisy(sphere, 1000, 0.0, 3);
        let origin = DVec3::splat(away);
        let rounded = |p: &Vec3| {
            let p = p.as_dvec3() * 5.0 + origin;
            (if rounds { p.as_vec3().as_dvec3() } else { p } - origin).as_vec3()
        };
        let mut surface =
            begun(Cloud { points: ball.iter().map(rounded).collect(), origin, ..Cloud::default() });
        while surface.step().unwrap().phase == "subsample" {}
        surface.step().unwrap().warnings.iter().map(|one| one.code).collect::<Vec<_>>()
    };
    assert_eq!(codes(5e6, true), [WarningCode::Precision]);
    for (away, rounds) in [(5e6, false), (5e3, true), (0.0, true)] {
        assert_eq!(codes(away, rounds), [], "{away} {rounds}");
    }
}

#[test]
fn a_cell_that_does_not_suit_the_points_is_refused_in_words() {
    for cell in [1e-6, 100.0] {
        let params = ImplicitParams { cell, ..ImplicitParams::default() };
        let options = ImplicitOptions { params, ..ImplicitOptions::default() };
        let cloud = Cloud { points: noisy(sphere, 300, 0.0, 3), ..Cloud::default() };
        let mut surface = ImplicitSurface::new(cloud, options).unwrap();
        let failure = loop {
            match surface.step() {
                Ok(report) => assert!(!report.done, "{cell} is accepted"),
                Err(failure) => break failure.to_string(),
            }
        };
        assert!(failure.contains("must be 0, or from "), "{failure}");
    }
}

/// Before or after other edits, in a restored run, and beyond the number of edits for which the system is revised.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn edits_give_the_same_bits_whenever_they_are_made() {
    let cloud = || Cloud { points: noisy(torus, 1200, 0.01, 5), ..Cloud::default() };
    let removed = |count: u32| PointEdits { removed: (0..count).collect(), ..PointEdits::default() };
    let added = PointEdits { added: vec![Vec3::new(0.0, 0.0, 0.1)], ..PointEdits::default() };
    let all = [removed(40), added, removed(700), PointEdits::default(), removed(20)];
    let direct = |edits: &PointEdits| {
        let mut surface = begun(cloud());
        surface.set_edits(edits.clone()).unwrap();
        finish(&mut surface);
        surface
    };
    let mut other = begun(cloud());
    finish(&mut other);
    for edits in &all {
        let expected = direct(edits);
        other.set_edits(removed(10)).unwrap();
        for _ in 0..7 {
            other.step().unwrap();
        }
        other.set_edits(edits.clone()).unwrap();
        for _ in 0..5 {
            other.step().unwrap();
        }
        let mut resumed = begun(cloud());
        resumed.restore(&other.save()).unwrap();
        assert_eq!(resumed.save(), other.save());
        finish(&mut resumed);
        assert!(resumed.surface() == expected.surface(), "resumed: {edits:?}");
        finish(&mut other);
        assert!(other.surface() == expected.surface(), "{edits:?}");
        other.restore(&resumed.save()).unwrap();
    }
}

/// Returns points far from a torus, on the outside.
fn around_torus(side: f32) -> Vec<Vec3> {
    let shell = |p: &Vec3| {
        let ring = Vec3::new(p.x, p.y, 0.0).normalize() * 0.7;
        ring + (p - ring) * side
    };
    noisy(torus, 300, 0.0, 9).iter().map(shell).collect()
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn points_known_to_be_outside_do_not_let_noise_shrink_the_surface() {
    let known = |exterior: Vec<Vec3>| {
        let cloud = Cloud { points: noisy(torus, 3000, 0.02, 1), ..Cloud::default() };
        let options = ImplicitOptions { exterior: Some(exterior), ..ImplicitOptions::default() };
        let mut surface = ImplicitSurface::new(cloud, options).unwrap();
        loop {
            let report = surface.step().unwrap();
            if report.done {
                return (surface, !report.warnings.is_empty());
            }
        }
    };
    let (surface, has_warning) = known(around_torus(1.5));
    assert_eq!(euler_of_parts(surface.surface()), [0]);
    let share = volume(&surface) / (2.0 * PI * PI * 0.7 * 0.09);
    assert!((share - 1.0).abs() < 0.015 && !has_warning, "{share}");
    // Inside and outside are exchanged where the points say so.
    let (surface, has_warning) = known(around_torus(0.5));
    assert!(surface.evaluate(&[Vec3::X * 0.7]).unwrap()[0] < 0.0 && !has_warning);
    let inside = surface.constraints()[2].clone();
    let from_ring = |p: &Vec3| p.distance(Vec3::new(p.x, p.y, 0.0).normalize() * 0.7);
    assert!(!inside.is_empty() && inside.iter().all(|p| from_ring(p) > 0.3));
    // If they contradict each other, there is a warning, and no point inside.
    let (surface, has_warning) = known([around_torus(1.5), around_torus(0.5)].concat());
    assert!(surface.constraints()[2].is_empty() && has_warning);
}

#[test]
fn a_point_marked_as_outside_overrules_those_inside() {
    let mut surface = finished(noisy(sphere, 600, 0.0, 3));
    let inside = surface.constraints()[2].clone();
    surface.set_edits(PointEdits { exterior: vec![inside[0] * 0.99], ..PointEdits::default() }).unwrap();
    finish(&mut surface);
    let left = surface.constraints()[2].clone();
    assert!(!left.contains(&inside[0]) && left.len() > inside.len() / 2);
}

#[test]
fn lambda_that_is_chosen_may_be_given_for_many_points() {
    let choice = |params: ImplicitParams| {
        let cloud = Cloud { points: noisy(sphere, 6000, 0.01, 3), ..Cloud::default() };
        let options = ImplicitOptions { params, ..ImplicitOptions::default() };
        let mut surface = ImplicitSurface::new(cloud, options).unwrap();
        while surface.constraints()[0].is_empty() {
            surface.step().unwrap();
        }
        while surface.step().unwrap().phase != "extract" {}
        (surface.choice().unwrap(), surface.evaluate(&[Vec3::ZERO, Vec3::X * 1.1]).unwrap())
    };
    let (chosen, values) = choice(ImplicitParams::default());
    let length = 0.25 / chosen.density.sqrt() + 0.95 * chosen.noise;
    // Half as much, as it is doubled for twice the usual number of points.
    let expected = length * length * length * chosen.density / 4.0 / 2.0;
    assert!((chosen.lambda_surface / expected - 1.0).abs() < 1e-9);
    let lambda_surface = Auto::Given(chosen.lambda_surface);
    assert_eq!(choice(ImplicitParams { lambda_surface, ..ImplicitParams::default() }), (chosen, values));
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn the_same_settings_give_the_same_bits_however_they_are_reached() {
    let points = noisy(torus, 1200, 0.01, 5);
    let edits = PointEdits { removed: (0..40).collect(), ..PointEdits::default() };
    let direct = finished(points.clone());
    let mut other = begun_on_paper(Cloud { points: points.clone(), ..Cloud::default() });
    let choice = direct.choice().unwrap();
    let [delta, lambda_surface, lambda_exterior] =
        [choice.delta, choice.lambda_surface, choice.lambda_exterior].map(Auto::Given);
    other
        .set_params(ImplicitParams { delta, lambda_surface, lambda_exterior, ..ImplicitParams::default() })
        .unwrap();
    finish(&mut other);
    assert!(other.surface() == direct.surface(), "given");
    other.set_params(ImplicitParams::paper()).unwrap();
    for early in [false, true] {
        for _ in 0..if early { 5 } else { 100_000 } {
            if other.step().unwrap().done {
                break;
            }
        }
        other.set_params(ImplicitParams::default()).unwrap();
        finish(&mut other);
        assert!(other.surface() == direct.surface(), "set early: {early}");
        other
            .set_params(ImplicitParams { lambda_surface: Auto::Given(0.1), ..ImplicitParams::default() })
            .unwrap();
        finish(&mut other);
        assert!(other.surface() != direct.surface());
        other.set_edits(edits.clone()).unwrap();
        other.set_params(ImplicitParams::paper()).unwrap();
        other.set_edits(PointEdits::default()).unwrap();
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_saved_run_continues_with_the_same_bits() {
    let cloud = Cloud { points: noisy(pair, 900, 0.01, 5), ..Cloud::default() };
    let whole = finished(cloud.points.clone());
    let mut running = begun(cloud.clone());
    for steps in 0.. {
        let done = running.step().unwrap().done;
        if done || steps % 7 == 0 {
            let mut resumed = begun(cloud.clone());
            resumed.restore(&running.save()).unwrap();
            assert_eq!(resumed.save(), running.save());
            finish(&mut resumed);
            assert!(resumed.surface() == whole.surface(), "after {steps} steps");
        }
        if done {
            break;
        }
    }
}

#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn settings_may_change_while_constraints_are_made() {
    let points = noisy(torus, 900, 0.01, 5);
    let cloud = || Cloud { points: points.clone(), ..Cloud::default() };
    let edits = PointEdits { removed: (0..40).collect(), ..PointEdits::default() };
    let params = ImplicitParams { delta: Auto::Given(3.0), ..ImplicitParams::default() };
    let mut direct = begun(cloud());
    direct.set_params(params.clone()).unwrap();
    direct.set_edits(edits.clone()).unwrap();
    finish(&mut direct);
    for has_surface in [false, true] {
        let mut other = begun_on_paper(cloud());
        if has_surface {
            finish(&mut other);
        }
        other.set_params(ImplicitParams::default()).unwrap();
        while other.step().unwrap().phase != "constraints" {}
        assert_eq!(other.step().unwrap().phase, "constraints");
        other.set_edits(edits.clone()).unwrap();
        other.set_params(params.clone()).unwrap();
        finish(&mut other);
        assert!(other.surface() == direct.surface(), "with a surface before: {has_surface}");
    }
}

/// Points on both sides of a bowl whose wall is five times as thick as their noise.
fn bowl(count: usize) -> Cloud {
    let mut random = Random(7);
    let mut point = |i: usize| {
        let on_sphere = direction(&mut random);
        let below = DVec3 { z: -on_sphere.z.abs(), ..on_sphere };
        let noise = [0; 3].map(|_| 0.02 * normal(&mut random));
        (below * [1.0, 0.9][i % 2] + DVec3::from(noise)).as_vec3()
    };
    Cloud { points: (0..count).map(&mut point).collect(), ..Cloud::default() }
}

/// Where the sides are confused, constraints on both fill the bowl.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn where_sides_are_ambiguous_the_surface_that_the_points_are_nearer_to_is_taken() {
    let [auto, both] = [Sides::Auto, Sides::Both].map(|sides| {
        let params = ImplicitParams { sides, ..ImplicitParams::default() };
        let options = ImplicitOptions { params, ..ImplicitOptions::default() };
        let mut surface = ImplicitSurface::new(bowl(5000), options).unwrap();
        finish(&mut surface);
        assert!(surface.step().unwrap().warnings.iter().any(|one| one.code == WarningCode::ThinParts));
        surface
    });
    assert_eq!(
        [&auto, &both].map(|one| one.choice().unwrap().sides),
        [Some(Sides::Outside), Some(Sides::Both)]
    );
    assert!(auto.fitness().unwrap().rms < 0.9 * both.fitness().unwrap().rms);
    let truth = BALL / 2.0 * (1.0 - 0.9 * 0.9 * 0.9);
    let off = [&auto, &both].map(|one| (volume(one) / truth - 1.0).abs());
    assert!(off[0] < 0.15 && off[1] > 0.5, "{off:?}");
}

/// The choice does not depend on edits and other parameters, nor on where the run was saved.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn the_choice_of_sides_is_the_same_however_settings_are_reached() {
    let cloud = bowl(2000);
    let edits = PointEdits { removed: (0..40).collect(), ..PointEdits::default() };
    let params = ImplicitParams { tau: 0.04, ..ImplicitParams::default() };
    let mut direct = begun(cloud.clone());
    direct.set_params(params.clone()).unwrap();
    direct.set_edits(edits.clone()).unwrap();
    finish(&mut direct);
    let mut other = begun(cloud.clone());
    let mut slices = 0;
    loop {
        let phase = other.step().unwrap().phase;
        slices += usize::from(phase == "constraints");
        if phase == "solve" {
            break;
        }
        if phase == "constraints" && slices % 60 == 59 {
            let mut resumed = begun(cloud.clone());
            resumed.restore(&other.save()).unwrap();
            assert_eq!(resumed.save(), other.save(), "after {slices} slices");
            other = resumed;
        }
    }
    assert!(slices > 100, "{slices}");
    other.set_edits(edits).unwrap();
    other.set_params(params).unwrap();
    finish(&mut other);
    assert_eq!(other.choice(), direct.choice());
    assert!(other.surface() == direct.surface());
    let last = other.save();
    let mut resumed = begun(cloud);
    resumed.restore(&last).unwrap();
    assert_eq!(resumed.save(), last);
}
