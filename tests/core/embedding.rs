//! Meshes that are moved and edited at random never intersect themselves.

use super::common::{Random, seeds, torus_around};
use vesicle::math::Vec3;
use vesicle::mesh::{EditError, Mesh, TriangleMesh, VertexId, count_self_intersections};
use vesicle::remesh::{Embedding, Resolver, Sampling};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Longer than most edges of the meshes below.
const EDGE: f32 = 2.5;

fn embedded(mesh: &Mesh) -> bool {
    count_self_intersections(&mesh.to_triangles()) == 0
}

/// Returns two spheres and two tori, side by side with little space between them.
fn crowd() -> Mesh {
    let mut mesh = Mesh::icosphere(Vec3::ZERO, 4.0, 1.8).unwrap();
    mesh.append(&Mesh::icosphere(Vec3::X * 8.5, 4.0, 2.4).unwrap()).unwrap();
    for (x, size) in [(4.0, [24, 8]), (20.5, [40, 12])] {
        let torus: TriangleMesh = torus_around(Vec3::new(x, 12.5, 0.0), size, [6.0, 1.8]);
        mesh.append(&Mesh::from_triangles(&torus).unwrap()).unwrap();
    }
    mesh
}

/// Returns a random displacement for every vertex: a smooth part, common to each region, and an individual part.
fn random_ways(mesh: &Mesh, random: &mut Random, size: f32) -> Vec<Vec3> {
    let mut any = || Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
    let (drift, place) = (any(), any());
    let regional = |p: Vec3| drift * libm::sinf(p.dot(place));
    mesh.positions().iter().map(|&p| (regional(p) + any() * 0.3) * size).collect()
}

/// The result must not depend on which vertices are checked: an embedding that has followed the mesh from the start and
/// a new one apply the same displacements.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_mesh_moved_at_random_never_intersects_itself() {
    for seed in seeds(3) {
        let mut random = Random(seed);
        let mut mesh = crowd();
        let mut follower = Embedding::default();
        let mut held = 0;
        for step in 0..60 {
            let what = format!("seed {seed}, step {step}");
            let size = [0.5, 0.1, 0.02, 0.004][random.below(4)];
            let mut ways = random_ways(&mesh, &mut random, size);
            let (mut other, mut other_ways) = (mesh.clone(), ways.clone());
            let before = mesh.positions().to_vec();

            follower.sync_with_edge(&mesh, EDGE);
            let shares = follower.move_all(&mut mesh, &mut ways);
            let mut stranger = Embedding::default();
            stranger.sync_with_edge(&other, EDGE);
            assert_eq!(stranger.move_all(&mut other, &mut other_ways), shares, "{what}");

            assert!(mesh.positions() == other.positions(), "{what}");
            assert!(embedded(&mesh), "{what}");
            for (i, &p) in mesh.positions().iter().enumerate() {
                assert_eq!(p, before[i] + ways[i], "{what}");
            }
            assert!(shares.iter().all(|&(_, share)| (0.0..1.0).contains(&share)), "{what}");
            held += shares.len();
        }
        assert!(held > 0, "seed {seed}: nothing was ever held back");
    }
}

/// Two spheres pushed against each other flatten where they touch; the rest of them moves on.
#[test]
fn spheres_pushed_together_flatten() {
    let mut mesh = Mesh::icosphere(-Vec3::X * 4.5, 4.0, 1.5).unwrap();
    mesh.append(&Mesh::icosphere(Vec3::X * 4.5, 4.0, 1.5).unwrap()).unwrap();
    let far = |mesh: &Mesh| mesh.positions().iter().fold(0.0f32, |far, p| far.max(p.x));
    let began = far(&mesh);
    let mut embedding = Embedding::default();
    for _ in 0..20 {
        let mut ways: Vec<Vec3> = mesh.positions().iter().map(|p| Vec3::X * 0.1 * -p.x.signum()).collect();
        embedding.sync_with_edge(&mesh, EDGE);
        embedding.move_all(&mut mesh, &mut ways);
        assert!(embedded(&mesh));
    }
    let gone = began - far(&mesh);
    assert!((gone - 2.0).abs() < 1e-3, "the far side went {gone}");
}

/// Large triangles beside small ones, all vertices with large displacements: contacts are found at all sizes.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn large_and_small_triangles_do_not_intersect() {
    let mut mesh = Mesh::icosahedron(Vec3::ZERO, 40.0);
    for k in 0..6 {
        let turn = std::f32::consts::TAU * k as f32 / 6.0;
        let centre = Vec3::new(libm::cosf(turn), libm::sinf(turn), 0.0) * 25.0;
        mesh.append(&Mesh::icosphere(centre, 2.0, 1.0).unwrap()).unwrap();
    }
    assert!(embedded(&mesh));
    let mut embedding = Embedding::default();
    for _ in 0..30 {
        // The small spheres move outwards; the large one shrinks.
        let mut ways: Vec<Vec3> = mesh.positions().iter().map(|p| *p * 0.02).collect();
        ways[..12].iter_mut().for_each(|way| *way *= -0.5);
        embedding.sync_with_edge(&mesh, EDGE);
        embedding.move_all(&mut mesh, &mut ways);
        assert!(embedded(&mesh));
    }
}

#[test]
fn an_edit_that_would_intersect_is_rolled_back() {
    // Two spheres near each other: collapsing an edge of one to a position inside the other would pierce it.
    let mut mesh = Mesh::icosphere(Vec3::ZERO, 4.0, 1.5).unwrap();
    mesh.append(&Mesh::icosphere(Vec3::X * 8.2, 4.0, 1.5).unwrap()).unwrap();
    let nearest = |mesh: &Mesh| {
        let distance = |v: &VertexId| mesh.position(*v).distance(Vec3::X * 4.0);
        mesh.vertices().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    };
    let u = nearest(&mesh);
    let v = mesh.ring(u).as_slice()[0];
    let before = mesh.to_triangles();
    let mut embedding = Embedding::default();
    embedding.sync_with_edge(&mesh, EDGE);
    let piercing = Vec3::X * 5.0;
    let refused = embedding.attempt(&mut mesh, |mesh| mesh.collapse(u, v, piercing));
    assert_eq!(refused, Err(EditError::WouldSelfIntersect));
    assert!(mesh.to_triangles() == before);
    let beside = mesh.position(u);
    assert_eq!(embedding.attempt(&mut mesh, |mesh| mesh.collapse(u, v, beside)), Ok(()));
    assert!(embedded(&mesh) && mesh.check() == Ok(()));
}

/// Moves alternate with remeshing, while components join and split; the mesh is valid after each.
#[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
#[test]
fn a_mesh_resolved_after_every_move_never_intersects_itself() {
    let sampling = Sampling::new(1.0);
    for seed in 0..10 {
        let mut random = Random(seed);
        let mut mesh = crowd();
        let mut resolver = Resolver::with_max_vertices(100_000);
        let everything: Vec<VertexId> = mesh.vertices().collect();
        resolver.resolve(&mut mesh, sampling, &everything);
        let mut changes = resolver.resolve(&mut mesh, sampling, &[]);
        for step in 0..30 {
            let size = [0.5, 0.3, 0.1][random.below(3)];
            let mut ways = random_ways(&mesh, &mut random, size);
            resolver.move_all(&mut mesh, sampling, &mut ways);
            let everything: Vec<VertexId> = mesh.vertices().collect();
            changes += resolver.resolve(&mut mesh, sampling, &everything);
            assert_eq!(mesh.check(), Ok(()), "seed {seed}, step {step}");
            assert!(embedded(&mesh), "seed {seed}, step {step}");
            if mesh.vertex_count() == 0 {
                break;
            }
        }
        assert!(changes.axial > 0 && changes.annular > 0, "seed {seed}: {changes:?}");
    }
}

/// Returns both meshes as one, with `inner` scaled about the origin, by at most `most`, until it nearly touches
/// `outer`.
fn nearly_touching(outer: &Mesh, inner: &Mesh, most: f32) -> Mesh {
    let within = |factor: f32| {
        let mut both = inner.clone();
        both.positions_mut().iter_mut().for_each(|p| *p *= factor);
        both.append(outer).unwrap();
        both
    };
    let (mut low, mut high) = (0.1, most);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if embedded(&within(middle)) { low = middle } else { high = middle }
    }
    within(low)
}

#[test]
fn refinement_of_facing_sheets_does_not_intersect() {
    let mut intersecting = 0;
    for seed in 0..6 {
        let mut random = Random(seed);
        let mut ball = |edge: f32| {
            let mut ball = Mesh::icosphere(Vec3::ZERO, 4.0, edge).unwrap();
            let shift = |random: &mut Random| Vec3::new(random.unit(), random.unit(), random.unit()) * 0.4;
            ball.positions_mut().iter_mut().for_each(|p| *p += shift(&mut random));
            ball
        };
        let mut mesh = nearly_touching(&ball(2.0), &ball(2.6), 1.2);
        let mut unguarded = mesh.clone();
        unguarded.refine().unwrap();
        intersecting += usize::from(!embedded(&unguarded));

        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, EDGE);
        assert!(embedding.is_embedded(&mesh));
        assert!(embedding.refine(&mut mesh).unwrap());
        assert!(embedded(&mesh) && embedding.is_embedded(&mesh), "seed {seed}");
        assert_eq!(mesh.check(), Ok(()), "seed {seed}");
        assert_eq!(mesh.vertex_count(), unguarded.vertex_count(), "seed {seed}");
    }
    assert!(intersecting > 2, "only {intersecting} intersect themselves when refined without a guard");
}
