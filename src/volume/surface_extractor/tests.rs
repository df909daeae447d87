//! Tests of the surface extractor: surfaces compared with known properties and with marching cubes over all nodes.

use super::super::{Grid, marching_cubes};
use super::*;
use crate::math::Random;
use crate::mesh::{Measures, measure, report};
use std::collections::BTreeSet;
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn unit(n: usize) -> Lattice {
    Lattice { origin: DVec3::ZERO, edge: 1.0, dims: [n; 3] }
}

fn batched(f: impl Fn(DVec3) -> f64) -> impl FnMut(&[DVec3], &mut [f64]) {
    move |points, values| values.iter_mut().zip(points).for_each(|(value, &p)| *value = f(p))
}

fn run(extractor: &mut SurfaceExtractor, budget: usize, f: impl Fn(DVec3) -> f64) {
    let mut f = batched(f);
    while !extractor.advance(budget, &mut f).unwrap() {}
}

/// Returns an extractor that has extracted the zero set of `f` from `seeds` and, if `stride` is above 0, by a scan.
fn extracted(lattice: Lattice, seeds: &[DVec3], stride: usize, f: impl Fn(DVec3) -> f64) -> SurfaceExtractor {
    let mut extractor = SurfaceExtractor::new(lattice).unwrap();
    seeds.iter().for_each(|&p| assert!(extractor.seed(p)));
    if stride > 0 {
        extractor.scan(stride).unwrap();
    }
    run(&mut extractor, usize::MAX, f);
    extractor
}

/// Returns the measures of a mesh, after asserting that it is closed, oriented, manifold, free of
/// self-intersections and degenerate triangles, and uses all its vertices.
fn healthy(mesh: &TriangleMesh) -> Measures {
    let report = report(mesh).unwrap();
    assert!(report.is_healthy(), "{report:?}");
    let measures = measure(mesh);
    assert_eq!(measures.vertices, mesh.positions.len());
    measures
}

fn dense(n: usize, f: impl Fn(DVec3) -> f64) -> TriangleMesh {
    let node = |i: usize| DVec3::new((i % n) as f64, (i / n % n) as f64, (i / (n * n)) as f64);
    let values = (0..n * n * n).map(|i| f(node(i)) as f32).collect();
    marching_cubes(&Grid::new([n; 3], values).unwrap(), 0.0).unwrap()
}

/// Returns the triangles of a mesh as a set, for comparison of meshes: float bits of the corner positions, each
/// triangle rotated to start at its lowest corner.
fn triangle_set(mesh: &TriangleMesh) -> BTreeSet<[[u32; 3]; 3]> {
    let triangles = mesh.corners().map(|corners| {
        let mut bits = corners.map(|p| p.to_array().map(f32::to_bits));
        let lowest = (0..3).min_by_key(|&k| bits[k]).unwrap();
        bits.rotate_left(lowest);
        bits
    });
    let set: BTreeSet<_> = triangles.collect();
    assert_eq!(set.len(), mesh.triangles.len());
    set
}

fn hash(seed: u64, p: DVec3) -> u64 {
    let mut state = seed;
    for k in p.to_array() {
        state = (state ^ k.to_bits()).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        state = (state ^ state >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        state ^= state >> 32;
    }
    state
}

/// Returns a noise function whose zeros by linear interpolation between two nodes are identical in `f32` and `f64`, for
/// comparison with marching cubes; on average, `share` of 16 nodes are inside.
fn noise(seed: u64, share: u64) -> impl Fn(DVec3) -> f64 + Copy {
    move |p| {
        let hash = hash(seed, p);
        let size = [0.0, 1.0, 1.0, 3.0][(hash >> 8) as usize % 4];
        if hash % 16 < share { size } else { -size.max(1.0) }
    }
}

fn ball(centre: DVec3, radius: f64) -> impl Fn(DVec3) -> f64 + Copy {
    move |p| radius - p.distance(centre)
}

fn shell(p: DVec3) -> f64 {
    1.5 - (11.5 - p.distance(DVec3::splat(16.1))).abs()
}

fn gyroid(p: DVec3) -> f64 {
    let [(sx, cx), (sy, cy), (sz, cz)] = (p * 0.45).to_array().map(libm::sincos);
    0.2 + sx * cy + sy * cz + sz * cx
}

const CENTRE: DVec3 = DVec3::new(63.2, 63.7, 64.1);

#[test]
fn a_sphere_takes_four_percent_of_the_nodes() {
    let f = ball(CENTRE, 45.0);
    let extractor = extracted(unit(128), &[CENTRE + DVec3::X * 45.0], 0, f);
    let share = extractor.evaluations() as f64 / (128.0 * 128.0 * 128.0);
    assert!(share < 0.04, "{share}");
    let measures = measure(&extractor.mesh().unwrap());
    assert_eq!((measures.components, measures.genus), (1, 0));
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 45.0 * 45.0 * 45.0;
    assert!((measures.volume / exact - 1.0).abs() < 0.001, "{}", measures.volume);
}

#[test]
fn only_corners_of_crossed_cells_are_evaluated() {
    let n = 30;
    let f = ball(DVec3::new(14.3, 14.6, 14.9), 11.0);
    let extractor = extracted(unit(n), &[DVec3::new(25.2, 14.6, 14.9)], 0, f);
    let inside = |i: usize, j: usize, k: usize| f(DVec3::new(i as f64, j as f64, k as f64)) >= 0.0;
    let mut corners = BTreeSet::new();
    for cell in 0..(n - 1) * (n - 1) * (n - 1) {
        let (i, j, k) = (cell % (n - 1), cell / (n - 1) % (n - 1), cell / ((n - 1) * (n - 1)));
        let nodes = [0, 1, 2, 3, 4, 5, 6, 7].map(|c| (i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
        let count = nodes.iter().filter(|&&(i, j, k)| inside(i, j, k)).count();
        if (1..8).contains(&count) {
            corners.extend(nodes);
        }
    }
    assert_eq!(extractor.evaluations(), corners.len());
}

#[test]
fn refined_vertices_lie_on_the_sphere() {
    let centre = DVec3::new(31.3, 31.6, 31.9);
    let square = |p: DVec3| 25.0 * 25.0 - p.distance_squared(centre);
    for f in [&ball(centre, 25.0) as &dyn Fn(DVec3) -> f64, &square] {
        let mut extractor = extracted(unit(64), &[centre + DVec3::X * 25.0], 0, f);
        let largest = |extractor: &SurfaceExtractor| {
            let at_margin = |p: &DVec3| {
                let off = (*p - p.round()).abs().max_element();
                (off - 1.0 / 256.0).abs() < 1e-9
            };
            let vertices = extractor.vertices().unwrap();
            let free: Vec<_> = vertices.iter().filter(|p| !at_margin(p)).collect();
            assert!(free.len() * 50 > vertices.len() * 49);
            free.iter().map(|p| (p.distance(centre) - 25.0).abs()).fold(0.0, f64::max)
        };
        let (before, evaluations) = (largest(&extractor), extractor.evaluations());
        assert!(before > 1e-3, "{before}");
        extractor.refine(3);
        run(&mut extractor, usize::MAX, f);
        assert!(largest(&extractor) < 1e-9, "{}", largest(&extractor));
        let mesh = extractor.mesh().unwrap();
        let steps = (extractor.evaluations() - evaluations) as f64 / mesh.positions.len() as f64;
        assert!(steps < 2.5, "{steps} steps a vertex");
        assert_eq!(healthy(&mesh).genus, 0);
    }
}

#[test]
fn a_torus_has_a_hole() {
    let torus = |p: DVec3| {
        let d = p - DVec3::new(0.1, -0.2, 0.3);
        let from_ring = (d.x * d.x + d.y * d.y).sqrt() - 1.0;
        0.3 - (from_ring * from_ring + d.z * d.z).sqrt()
    };
    let lattice = Lattice { origin: DVec3::new(-1.5, -2.0, -0.5), edge: 0.05, dims: [70, 70, 34] };
    let mut extractor = extracted(lattice, &[DVec3::new(1.4, -0.2, 0.3)], 4, torus);
    extractor.refine(3);
    run(&mut extractor, 1000, torus);
    let measures = healthy(&extractor.mesh().unwrap());
    assert_eq!((measures.components, measures.genus, extractor.components_found_by_scan()), (1, 1, 0));
    let exact = 2.0 * std::f64::consts::PI * std::f64::consts::PI * 0.09;
    assert!((measures.volume / exact - 1.0).abs() < 0.01, "{}", measures.volume);
}

#[test]
fn the_scan_finds_and_counts_what_no_seed_led_to() {
    let (a, b) = (ball(DVec3::splat(9.3), 6.0), ball(DVec3::splat(22.4), 5.0));
    let both = |p: DVec3| a(p).max(b(p));
    let seeds = [DVec3::new(15.3, 9.3, 9.3)];
    let one = extracted(unit(32), &seeds, 0, both);
    assert_eq!(healthy(&one.mesh().unwrap()).components, 1);
    for stride in [1, 3, 8] {
        let two = extracted(unit(32), &seeds, stride, both);
        assert_eq!(two.components_found_by_scan(), 1, "stride {stride}");
        let measures = healthy(&two.mesh().unwrap());
        assert_eq!((measures.components, measures.genus), (2, 0));
        let none = extracted(unit(32), &[], stride, both);
        assert_eq!((none.components_found_by_scan(), none.mesh().unwrap()), (2, two.mesh().unwrap()));
    }
}

#[test]
fn the_scan_finds_the_inner_side_of_a_shell_between_its_nodes() {
    let outer = [DVec3::new(16.1 + 13.0, 16.1, 16.1)];
    let one = extracted(unit(33), &outer, 0, shell);
    assert_eq!(healthy(&one.mesh().unwrap()).components, 1);
    // Every node of this scan is outside, on one side of the shell or the other.
    let mut nodes = (0..27).map(|i| DVec3::new((i % 3) as f64, (i / 3 % 3) as f64, (i / 9) as f64) * 16.0);
    assert!(nodes.all(|p| shell(p) < 0.0));
    let two = extracted(unit(33), &outer, 16, shell);
    assert_eq!((two.components_found_by_scan(), healthy(&two.mesh().unwrap()).components), (1, 2));
}

#[test]
fn metaballs_grow_together() {
    let centres = [DVec3::new(9.2, 12.1, 12.3), DVec3::new(17.3, 12.6, 12.2), DVec3::new(12.8, 19.1, 12.7)];
    let f = |p: DVec3| centres.iter().map(|c| 16.0 / p.distance_squared(*c).max(1e-9)).sum::<f64>() - 1.0;
    let mut extractor = extracted(unit(32), &centres.map(|c| c - DVec3::Z * 5.0), 4, f);
    extractor.refine(3);
    run(&mut extractor, usize::MAX, f);
    let measures = healthy(&extractor.mesh().unwrap());
    assert_eq!((measures.components, measures.genus, extractor.components_found_by_scan()), (1, 0, 0));
}

#[test]
fn a_gyroid_is_closed_at_the_border_as_by_marching_cubes() {
    let extractor = extracted(unit(33), &[], 2, gyroid);
    let (mesh, dense) = (extractor.mesh().unwrap(), dense(33, gyroid));
    let (found, expected) = (healthy(&mesh), measure(&dense));
    assert!(found.genus > 10);
    assert_eq!(
        (found.vertices, found.triangles, found.genus, found.bounds),
        (expected.vertices, expected.triangles, expected.genus, expected.bounds)
    );
    assert!((found.volume / expected.volume - 1.0).abs() < 1e-6);
}

#[test]
fn a_full_lattice_is_its_box_and_an_empty_one_nothing() {
    let full = extracted(unit(5), &[], 1, |_| 1.0);
    assert_eq!(triangle_set(&full.mesh().unwrap()), triangle_set(&dense(5, |_| 1.0)));
    assert_eq!(full.components_found_by_scan(), 1);
    let empty = extracted(unit(5), &[DVec3::splat(2.5)], 1, |_| -1.0);
    assert_eq!((empty.mesh().unwrap(), empty.evaluations()), (TriangleMesh::default(), 64 + 61));
    let one = Lattice { dims: [1; 3], ..unit(1) };
    assert_eq!(extracted(one, &[DVec3::ZERO], 0, |_| 0.0).mesh().unwrap().triangles.len(), 8);
}

#[test]
fn flood_and_finest_scan_find_all_of_marching_cubes() {
    let n = 12;
    for seed in 0..24 {
        let f = noise(seed, seed % 15 + 1);
        let expected = triangle_set(&dense(n, f));
        let found = extracted(unit(n), &[], 1, f);
        healthy(&found.mesh().unwrap());
        assert_eq!(triangle_set(&found.mesh().unwrap()), expected, "noise {seed}");
        assert!(found.components_found_by_scan() <= found.mesh().unwrap().components().len());
    }
}

#[test]
fn a_flood_finds_whole_components_of_marching_cubes() {
    let n = 12;
    let mut partial = 0;
    for seed in 0..24 {
        let f = noise(seed, seed % 5 + 1);
        let found = extracted(unit(n), &[DVec3::splat(5.5)], 0, f).mesh().unwrap();
        healthy(&found);
        let found = triangle_set(&found);
        let mut count = 0;
        for component in dense(n, f).components() {
            let component = triangle_set(&component);
            assert!(component.is_subset(&found) || component.is_disjoint(&found), "noise {seed}");
            count += component.intersection(&found).count();
            partial += usize::from(component.is_disjoint(&found));
        }
        assert_eq!(count, found.len());
    }
    assert!(partial > 50, "{partial}");
}

#[test]
fn where_every_face_is_ambiguous_each_node_has_its_own_part() {
    let checkers = |p: DVec3| if p.element_sum() % 2.0 == 0.0 { 1.0 } else { -1.0 };
    let found = extracted(unit(9), &[DVec3::splat(4.5)], 0, checkers).mesh().unwrap();
    assert_eq!(triangle_set(&found), triangle_set(&dense(9, checkers)));
    assert_eq!(healthy(&found).components, 365);
}

#[test]
fn refined_noise_has_no_self_intersections() {
    for seed in 0..12 {
        let mut extractor = extracted(unit(12), &[], 1, noise(seed, 3 + seed % 10));
        extractor.refine(4);
        // Between the nodes the noise is independent: zeros anywhere on the edges.
        run(&mut extractor, usize::MAX, noise(seed, 3 + seed % 10));
        healthy(&extractor.mesh().unwrap());
    }
}

#[test]
fn slices_make_no_difference() {
    let (a, b) = (ball(DVec3::splat(6.3), 4.0), ball(DVec3::new(15.2, 14.9, 15.4), 3.0));
    let f = move |p: DVec3| a(p).max(b(p));
    for f in [&f as &dyn Fn(DVec3) -> f64, &gyroid, &noise(3, 6)] {
        let results = [usize::MAX, 1, 100, 7].map(|budget| {
            let mut extractor = SurfaceExtractor::new(unit(20)).unwrap();
            extractor.seed(DVec3::new(10.3, 6.3, 6.3));
            extractor.scan(3).unwrap();
            extractor.refine(2);
            run(&mut extractor, budget, f);
            (extractor.mesh().unwrap(), extractor.evaluations(), extractor.components_found_by_scan())
        });
        assert!(!results[0].0.triangles.is_empty());
        assert!(results.iter().all(|result| *result == results[0]));
    }
}

#[test]
fn a_slice_keeps_to_its_budget() {
    let f = ball(DVec3::splat(10.3), 8.0);
    let mut extractor = SurfaceExtractor::new(unit(21)).unwrap();
    extractor.scan(5).unwrap();
    extractor.refine(2);
    for budget in [0, 1, 30, 1000, 0, 17].into_iter().cycle() {
        let (before, mut most) = (extractor.evaluations(), 0);
        let mut f = batched(f);
        let done = extractor.advance(budget, &mut |points, values| {
            most += points.len();
            f(points, values);
        });
        assert_eq!(extractor.evaluations() - before, most);
        if done.unwrap() {
            assert!(most <= budget.max(1));
            break;
        }
        assert_eq!(most, budget.max(1));
    }
}

#[test]
fn seeds_and_their_order_make_no_difference() {
    let centre = DVec3::new(15.3, 15.1, 14.8);
    let f = ball(centre, 10.0);
    let expected = extracted(unit(31), &[centre + DVec3::X * 10.0], 0, f).mesh().unwrap();
    assert_eq!(healthy(&expected).components, 1);
    // One on the surface, one a cell off it, several, and one twice.
    let on = [DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X].map(|d| centre + d * 10.0);
    let off = centre + DVec3::new(0.0, 11.2, 0.0);
    assert!(off.floor() != (centre + DVec3::Y * 10.0).floor());
    for seeds in [&on[..1], &[off], &on, &[on[2], off, on[2], on[1]]] {
        assert_eq!(extracted(unit(31), seeds, 0, f).mesh().unwrap(), expected);
    }
    // Nothing is found from a seed at the centre, far off the surface.
    let far = extracted(unit(31), &[centre], 0, f);
    assert_eq!((far.mesh().unwrap(), far.evaluations()), (TriangleMesh::default(), 64));
}

#[test]
fn seeds_beside_the_extracted_surface_cost_nothing() {
    let centre = DVec3::new(15.3, 15.1, 14.8);
    let f = ball(centre, 10.0);
    let on = centre + DVec3::X * 10.0;
    let alone = extracted(unit(31), &[on], 0, f).evaluations();
    let beside = extracted(unit(31), &[on, on + DVec3::X], 0, f).evaluations();
    assert!(beside <= alone + 8, "{beside} against {alone}");
}

#[test]
fn seeds_outside_the_lattice_are_passed_over() {
    let mut extractor = SurfaceExtractor::new(unit(8)).unwrap();
    for p in [DVec3::splat(-1.1), DVec3::new(3.0, 8.0, 3.0), DVec3::NAN, DVec3::INFINITY] {
        assert!(!extractor.seed(p), "{p}");
    }
    run(&mut extractor, 10, |_| 1.0);
    assert_eq!(extractor.evaluations(), 0);
    // The surface of a full lattice lies half an edge beyond it.
    assert!(extractor.seed(DVec3::new(-0.5, 3.0, 3.0)));
    run(&mut extractor, 10, |_| 1.0);
    assert_eq!(triangle_set(&extractor.mesh().unwrap()), triangle_set(&dense(8, |_| 1.0)));
}

#[test]
fn more_seeds_may_come_when_all_was_done() {
    let (a, b) = (ball(DVec3::splat(9.3), 6.0), ball(DVec3::splat(22.4), 5.0));
    let both = |p: DVec3| a(p).max(b(p));
    let seeds = [DVec3::new(15.3, 9.3, 9.3), DVec3::new(27.4, 22.4, 22.4)];
    let extracted = |together: bool| {
        let mut extractor = SurfaceExtractor::new(unit(32)).unwrap();
        extractor.refine(3);
        for p in seeds {
            extractor.seed(p);
            if !together {
                run(&mut extractor, 500, both);
            }
        }
        run(&mut extractor, 500, both);
        extractor.mesh().unwrap()
    };
    assert_eq!(healthy(&extracted(true)).components, 2);
    assert_eq!(extracted(true), extracted(false));
}

#[test]
fn what_there_is_so_far_is_a_part_of_the_whole() {
    let f = ball(DVec3::splat(12.3), 9.0);
    let mut extractor = extracted(unit(25), &[DVec3::new(12.3, 12.3, 21.3)], 0, f);
    let whole = triangle_set(&extractor.mesh().unwrap());
    extractor = SurfaceExtractor::new(unit(25)).unwrap();
    extractor.seed(DVec3::new(12.3, 12.3, 21.3));
    let mut sizes = vec![0];
    while !extractor.advance(200, &mut batched(f)).unwrap() {
        let mesh = extractor.mesh().unwrap();
        mesh.validate().unwrap();
        assert!(triangle_set(&mesh).is_subset(&whole));
        sizes.push(mesh.triangles.len());
    }
    assert!(sizes.len() > 10 && sizes.is_sorted());
    assert_eq!(triangle_set(&extractor.mesh().unwrap()), whole);
}

#[test]
fn what_is_not_a_number_is_outside() {
    let f = |p: DVec3| if p.x > 10.3 { f64::NAN } else { 8.0 - p.distance(DVec3::splat(9.8)) };
    let mut extractor = extracted(unit(20), &[DVec3::new(1.8, 9.8, 9.8)], 0, f);
    extractor.refine(8);
    run(&mut extractor, usize::MAX, f);
    let measures = healthy(&extractor.mesh().unwrap());
    assert_eq!((measures.components, measures.genus), (1, 0));
    assert!((measures.bounds[1].x - 10.3).abs() < 0.01, "{}", measures.bounds[1].x);
    assert_eq!(extracted(unit(6), &[DVec3::splat(2.5)], 1, |_| f64::NAN).crossed_cells(), 0);
    // A value that the function does not write is outside, too.
    let mut silent = SurfaceExtractor::new(unit(6)).unwrap();
    silent.scan(1).unwrap();
    assert!(silent.advance(usize::MAX, &mut |_, _| {}).unwrap());
    assert_eq!(silent.crossed_cells(), 0);
}

#[test]
fn infinite_and_huge_values_leave_a_healthy_mesh() {
    for seed in 0..6 {
        let sizes =
            [0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 1e-320, -1e-320, f64::NAN];
        let f = |p: DVec3| sizes[hash(seed, p) as usize % sizes.len()];
        let mut extractor = extracted(unit(9), &[], 1, f);
        healthy(&extractor.mesh().unwrap());
        extractor.refine(3);
        run(&mut extractor, usize::MAX, f);
        healthy(&extractor.mesh().unwrap());
    }
}

#[test]
fn a_function_that_changes_its_mind_comes_to_an_end() {
    for stride in [1, 3] {
        let mut random = Random::new(5);
        let mut extractor = SurfaceExtractor::new(unit(12)).unwrap();
        extractor.scan(stride).unwrap();
        extractor.refine(3);
        let mut slices = 0;
        while !extractor
            .advance(100, &mut |_, values| {
                values.fill_with(|| random.unit() - 0.5);
            })
            .unwrap()
        {
            slices += 1;
            assert!(slices < 1000);
        }
        healthy(&extractor.mesh().unwrap());
    }
}

#[test]
fn memory_grows_with_the_surface_and_not_with_the_lattice() {
    let centre = DVec3::new(700.3, 300.2, 500.4);
    let extractor = extracted(unit(1024), &[centre + DVec3::X * 12.0], 0, ball(centre, 12.0));
    let table = 4 * 129 * 129 * 129;
    assert!(extractor.bytes() < table + 700_000, "{} beside the table", extractor.bytes() - table);
    assert_eq!(healthy(&extractor.mesh().unwrap()).components, 1);
}

#[test]
fn the_farthest_lattice_has_no_self_intersections() {
    let edge = 0.03;
    let origin = DVec3::new(8180.0, -8190.0, 8170.0) * edge;
    let lattice = Lattice { origin, edge, dims: [10; 3] };
    let nodes = |f: fn(f64) -> f64| move |p: DVec3| ((p - origin) / edge).map(f);
    for seed in 0..12 {
        let f = |p: DVec3| noise(seed, 7)(nodes(f64::round)(p));
        let mesh = extracted(lattice, &[], 1, f).mesh().unwrap();
        assert_eq!(mesh.triangles.len(), dense(10, noise(seed, 7)).triangles.len());
        healthy(&mesh);
    }
}

#[test]
fn bad_arguments_are_named() {
    let named = |lattice: Lattice| match SurfaceExtractor::new(lattice) {
        Err(VolumeError::InvalidArgument { parameter, .. }) => parameter,
        other => panic!("{:?}", other.map(|f| f.lattice)),
    };
    let good = unit(8);
    assert_eq!(named(Lattice { dims: [8, 0, 8], ..good }), "dims");
    assert_eq!(named(Lattice { dims: [8, 8, 2049], ..good }), "dims");
    for edge in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-31] {
        assert_eq!(named(Lattice { edge, ..good }), "edge");
    }
    for origin in [DVec3::NAN, DVec3::INFINITY, DVec3::splat(8186.0), DVec3::new(0.0, -8193.0, 0.0)] {
        assert_eq!(named(Lattice { origin, ..good }), "origin");
    }
    assert_eq!(named(Lattice { edge: 1e38, ..good }), "origin");
    let refused = SurfaceExtractor::new(good).unwrap().scan(0).unwrap_err();
    assert!(matches!(refused, VolumeError::InvalidArgument { parameter: "stride", .. }));
}
