//! Every edit and every refusal, and long seeded runs of random edits with all invariants checked after each.

use super::common::{Random, torus_around};
use std::collections::BTreeSet;
use vesicle::math::Vec3;
use vesicle::mesh::{EditError, Mesh, TriangleMesh, VectorKey, VertexId};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn tetrahedron() -> Mesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    Mesh::from_triangles(&TriangleMesh { positions, triangles, ..Default::default() }).unwrap()
}

/// Returns a torus of `n` × `m` vertices; 3 as `n` or `m` gives rings of three edges that can be cut.
fn torus(n: u32, m: u32) -> Mesh {
    Mesh::from_triangles(&torus_around(Vec3::ZERO, [n, m], [3.0, 1.0])).unwrap()
}

fn sphere() -> Mesh {
    Mesh::icosphere(Vec3::ZERO, 1.0, 0.6).unwrap()
}

fn v(i: u32) -> VertexId {
    VertexId(i)
}

#[test]
fn initial_meshes_are_valid() {
    for (mesh, euler) in
        [(tetrahedron(), 2), (torus(7, 5), 0), (sphere(), 2), (Mesh::icosahedron(Vec3::ONE, 2.0), 2)]
    {
        assert_eq!(mesh.check(), Ok(()));
        assert_eq!(mesh.euler(), euler);
        assert_eq!(mesh.triangles().count(), mesh.triangle_count());
        assert_eq!(mesh.edges().count(), mesh.edge_count());
    }
}

#[test]
fn normals_of_a_sphere_point_outwards() {
    let mesh = sphere();
    assert!(mesh.vertices().all(|v| mesh.area_normal(v).normalize().dot(mesh.position(v)) > 0.99));
}

#[test]
fn split_then_collapse_restores_the_mesh() {
    let mut mesh = sphere();
    let (vertices, ring) = (mesh.vertex_count(), mesh.ring(v(0)).clone());
    let other = ring.as_slice()[0];
    let w = mesh.split(v(0), other, Vec3::ZERO).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.ring(w).valence()), (vertices + 1, 4));
    assert_eq!(mesh.check(), Ok(()));
    mesh.collapse(other, w, mesh.position(other)).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.ring(v(0))), (vertices, &ring));
    assert_eq!(mesh.check(), Ok(()));
}

#[test]
fn flip_twice_restores_the_edges() {
    let mut mesh = sphere();
    let before: Vec<_> = mesh.edges().collect();
    let (a, b) = before[10];
    let across = mesh.opposite_vertices(a, b).unwrap();
    mesh.flip(a, b).unwrap();
    assert!(!mesh.ring(a).contains(b) && mesh.ring(across.left).contains(across.right));
    assert_eq!(mesh.check(), Ok(()));
    mesh.flip(across.left, across.right).unwrap();
    let mut after: Vec<_> = mesh.edges().collect();
    after.sort();
    assert_eq!(after, {
        let mut sorted = before;
        sorted.sort();
        sorted
    });
}

#[test]
fn refused_edits_leave_the_mesh_unchanged() {
    let mut mesh = tetrahedron();
    let before = mesh.clone();
    assert_eq!(mesh.flip(v(0), v(1)), Err(EditError::Adjacent(v(3), v(2))));
    assert_eq!(mesh.split(v(0), v(0), Vec3::ZERO), Err(EditError::NotAnEdge(v(0), v(0))));
    assert_eq!(mesh.split(v(0), v(9), Vec3::ZERO), Err(EditError::NotAnEdge(v(0), v(9))));
    assert!(matches!(mesh.collapse(v(0), v(1), Vec3::ZERO), Err(EditError::ValenceTooLow(_))));
    assert_eq!(mesh.cut(v(0), v(1), v(2)), Err(EditError::IsTriangle));
    assert_eq!(mesh.join(v(0), v(1), 0.7), Err(EditError::Adjacent(v(0), v(1))));
    assert_eq!(mesh.join(v(0), v(0), 0.7), Err(EditError::Adjacent(v(0), v(0))));
    assert_eq!(mesh, before);

    let mut ring = torus(3, 8);
    let before = ring.clone();
    assert!(matches!(ring.collapse(v(0), v(8), Vec3::ZERO), Err(EditError::LinkCondition(o)) if o == v(16)));
    assert_eq!(ring.remove_tetrahedron(v(0)), Err(EditError::NotATetrahedron(v(0))));
    assert_eq!(ring, before);
}

#[test]
fn cutting_a_torus_gives_a_sphere() {
    let mut mesh = torus(8, 3);
    assert_eq!(mesh.euler(), 0);
    let cut = mesh.cut(v(0), v(1), v(2)).unwrap();
    assert_eq!((mesh.check(), mesh.euler()), (Ok(()), 2));
    assert_eq!(mesh.component_of(v(0), usize::MAX).len(), 8 * 3 + 3);
    for (kept, copy) in cut.kept.into_iter().zip(cut.copies) {
        assert_eq!(mesh.position(kept), mesh.position(copy));
        assert!(!mesh.ring(kept).contains(copy));
    }
}

#[test]
fn cutting_a_neck_splits_a_sphere() {
    let mut mesh = torus(8, 3);
    mesh.cut(v(0), v(1), v(2)).unwrap();
    mesh.cut(v(12), v(13), v(14)).unwrap();
    assert_eq!((mesh.check(), mesh.euler()), (Ok(()), 4));
    assert!(mesh.component_of(v(0), usize::MAX).len() < mesh.vertex_count());
}

#[test]
fn joining_components_subtracts_two_from_the_euler_characteristic() {
    for (a, b) in [(sphere(), sphere()), (tetrahedron(), sphere()), (tetrahedron(), tetrahedron())] {
        let mut mesh = a;
        let other = VertexId::from_index(mesh.slots());
        mesh.append(&b).unwrap();
        assert_eq!(mesh.euler(), 4);
        let joint = mesh.join(v(0), other, 0.7).unwrap();
        assert_eq!((mesh.check(), mesh.euler()), (Ok(()), 2));
        assert!(!mesh.is_live(v(0)) || joint.first.contains(&v(0)) || joint.second.contains(&v(0)));
        assert_eq!(mesh.component_of(joint.first[0], usize::MAX).len(), mesh.vertex_count());
    }
}

/// Regression: the squares of such positions overflow `f32`, so no tube was the shortest, and both discs stayed open.
#[test]
fn components_far_from_the_origin_are_joined_alike() {
    let scaled = |scale: f32| {
        let mut mesh = sphere();
        let other = VertexId::from_index(mesh.slots());
        mesh.append(&Mesh::icosphere(Vec3::X * 3.0, 1.0, 0.6).unwrap()).unwrap();
        mesh.positions_mut().iter_mut().for_each(|p| *p *= scale);
        mesh.join(v(0), other, 0.7).unwrap();
        assert_eq!((mesh.check(), mesh.euler()), (Ok(()), 2), "{scale}");
        mesh.triangles().collect::<Vec<_>>()
    };
    assert_eq!(scaled(1.0), scaled((1u128 << 120) as f32));
}

#[test]
fn joining_vertices_with_common_neighbours_stays_simplicial() {
    // The two tips of a double pyramid have all neighbours in common.
    let mut mesh = torus(8, 3);
    let ring = mesh.ring(v(0)).as_slice().to_vec();
    let far = *mesh.ring(ring[0]).as_slice().iter().find(|&&w| w != v(0) && !ring.contains(&w)).unwrap();
    mesh.join(v(0), far, 0.66).unwrap();
    assert_eq!((mesh.check(), mesh.euler()), (Ok(()), -2));
}

#[test]
fn refinement_triples_the_triangles_and_keeps_the_euler_characteristic() {
    for mut mesh in [tetrahedron(), torus(7, 5), sphere()] {
        let (triangles, edge, euler) = (mesh.triangle_count(), mesh.longest_edge(), mesh.euler());
        mesh.refine().unwrap();
        assert_eq!((mesh.check(), mesh.euler()), (Ok(()), euler));
        assert_eq!(mesh.triangle_count(), 3 * triangles);
        assert!(mesh.longest_edge() < edge);
    }
}

#[test]
fn reordering_keeps_shape_and_attributes() {
    let mut mesh = sphere();
    let copy = mesh.add_vector();
    for w in mesh.vertices().collect::<Vec<_>>() {
        mesh.vector_mut(copy)[w.index()] = mesh.position(w);
    }
    for (a, b) in mesh.edges().step_by(7).collect::<Vec<_>>() {
        let middle = (mesh.position(a) + mesh.position(b)) * 0.5;
        let _ = mesh.collapse(a, b, middle);
    }
    assert!(mesh.occupancy() < 1.0);
    mesh.reorder();
    assert_eq!((mesh.check(), mesh.occupancy()), (Ok(()), 1.0));
    assert!(mesh.vertices().all(|w| mesh.vector(copy)[w.index()].distance(mesh.position(w)) < 1e-6));
}

#[test]
fn open_and_invalid_triangle_lists_are_refused_with_a_reason() {
    let four = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let refusal = |positions: &Vec<Vec3>, triangles: Vec<[u32; 3]>| {
        let mesh = TriangleMesh { positions: positions.clone(), triangles, ..Default::default() };
        Mesh::from_triangles(&mesh).unwrap_err().to_string()
    };
    assert!(refusal(&four, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]]).contains("boundary"));
    assert!(refusal(&four, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 2, 3]]).contains("orientation"));
    assert!(refusal(&four, vec![[0, 1, 9]]).contains("index 9"));
    assert!(refusal(&four, vec![]).contains("no triangle"));
    assert!(refusal(&four, vec![[0, 0, 1]]).contains("two equal corners"));
    assert!(refusal(&four, vec![[0, 1, 2], [0, 2, 1]]).contains("fewer than three"));
    let bad = vec![Vec3::NAN, Vec3::X, Vec3::Y, Vec3::Z];
    assert!(refusal(&bad, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]).contains("finite"));
}

/// The ring of a vertex with many triangles is found by another search.
#[test]
fn the_same_is_wrong_with_few_and_with_many_triangles_around_a_vertex() {
    for n in [5, 500, 4095] {
        let around = (0..n).map(|k| Vec3::new(k as f32, (k * k) as f32, 0.0));
        let positions: Vec<Vec3> = [Vec3::Z, -Vec3::Z].into_iter().chain(around).collect();
        let sides = |k: u32| (2 + k, 2 + (k + 1) % n as u32);
        let bipyramid: Vec<[u32; 3]> =
            (0..n as u32).flat_map(|k| [[0, sides(k).0, sides(k).1], [1, sides(k).1, sides(k).0]]).collect();
        let built = |triangles: Vec<[u32; 3]>| {
            Mesh::from_triangles(&TriangleMesh {
                positions: positions.clone(),
                triangles,
                ..Default::default()
            })
        };
        let mesh = built(bipyramid.clone()).unwrap();
        assert_eq!((mesh.check(), mesh.triangle_count()), (Ok(()), 2 * n));
        let refusal = |change: &dyn Fn(&mut Vec<[u32; 3]>)| {
            let mut triangles = bipyramid.clone();
            change(&mut triangles);
            built(triangles).unwrap_err().to_string()
        };
        assert!(refusal(&|all| all.truncate(2 * n - 2)).contains("a boundary"));
        assert!(refusal(&|all| all[4].swap(1, 2)).contains("orientation"));
        // Joins the ring with itself, away from where it begins.
        assert!(refusal(&|all| all[6] = [0, 5, 3]).contains("more than two triangles"));
        assert!(refusal(&|all| all.push([0, 3, 5])).contains("duplicate"));
    }
}

/// Regression: the slots of a component that was removed twice were free twice, and two vertices later shared one.
#[test]
fn a_component_is_removed_once() {
    let mut mesh = tetrahedron();
    mesh.append(&sphere()).unwrap();
    let v = mesh.vertices().next().unwrap();
    assert_eq!(mesh.remove_component(v), 4);
    let without = mesh.clone();
    assert_eq!((mesh.component_of(v, usize::MAX), mesh.remove_component(v)), (vec![], 0));
    assert!(mesh == without && mesh.check() == Ok(()));
}

/// Kinds of random edits, and how the Euler characteristic changes by each.
const EDITS: [(&str, i64); 6] =
    [("splits", 0), ("flips", 0), ("collapses", 0), ("joins", -2), ("removed tetrahedra", -2), ("cuts", 2)];

/// Tries one random edit at a random vertex; returns the index of its kind in [`EDITS`], or the refusal.
fn random_edit(mesh: &mut Mesh, random: &mut Random, live: &[VertexId]) -> Result<usize, EditError> {
    let u = live[random.below(live.len())];
    let ring = mesh.ring(u).as_slice().to_vec();
    let w = ring[random.below(ring.len())];
    let middle = (mesh.position(u) + mesh.position(w)) * 0.5;
    match random.below(32) {
        0..6 => mesh.split(u, w, middle).map(|_| 0),
        6..14 => mesh.flip(u, w).map(|()| 1),
        14..25 => mesh.collapse(u, w, middle).map(|()| 2),
        25 => mesh.join(u, live[random.below(live.len())], 0.5 + 0.4 * random.unit()).map(|_| 3),
        26..28 => mesh.remove_tetrahedron(u).map(|()| 4),
        _ => {
            let opposite = mesh.opposite_vertices(u, w)?;
            let third = |o: &VertexId| *o != opposite.left && *o != opposite.right;
            let common = mesh.common_neighbours(u, w);
            let o = *common.iter().find(|o| third(o)).ok_or(EditError::IsTriangle)?;
            mesh.cut(u, w, o).map(|_| 5)
        }
    }
}

/// Tries random edits until `most` have succeeded. Returns how many of each kind did, and how many were refused. The
/// attribute, a copy of the positions, must follow all edits.
fn run_random_edits(start: fn() -> Mesh, seed: u64, most: usize) -> ([usize; EDITS.len()], usize) {
    let mut random = Random(seed);
    let (mut mesh, mut key) = followed(start());
    let (mut edits, mut refused) = ([0; EDITS.len()], 0);
    for turn in 0..10 * most {
        if edits.iter().sum::<usize>() == most {
            break;
        }
        let live: Vec<_> = mesh.vertices().collect();
        if live.is_empty() || live.len() > 200 {
            (mesh, key) = followed(start());
            continue;
        }
        let (before, euler) = (mesh.clone(), mesh.euler());
        match random_edit(&mut mesh, &mut random, &live) {
            Ok(kind) => {
                edits[kind] += 1;
                assert_eq!(mesh.euler(), euler + EDITS[kind].1, "seed {seed}, turn {turn}");
            }
            Err(_) => {
                refused += 1;
                assert_eq!(mesh, before, "a refusal changed the mesh: seed {seed}, turn {turn}");
            }
        }
        assert_eq!(mesh.check(), Ok(()), "seed {seed}, turn {turn}");
        let follows = mesh.vertices().all(|v| mesh.vector(key)[v.index()].distance(mesh.position(v)) < 1e-3);
        assert!(follows, "an attribute fell behind: seed {seed}, turn {turn}");
    }
    (edits, refused)
}

/// Returns the mesh with a copy of its positions as an attribute.
fn followed(mut mesh: Mesh) -> (Mesh, VectorKey) {
    let key = mesh.add_vector();
    let positions = mesh.positions().to_vec();
    mesh.vector_mut(key).copy_from_slice(&positions);
    (mesh, key)
}

/// 100,000 edits in all natively, a quarter of them in wasm; a failing seed is named.
#[test]
fn random_edits_keep_every_invariant() {
    let starts: [fn() -> Mesh; 5] =
        [tetrahedron, sphere, || torus(3, 7), || torus(9, 3), || Mesh::icosahedron(Vec3::ZERO, 1.0)];
    let (mut edits, mut refused) = ([0; EDITS.len()], 0);
    let seeds = if cfg!(target_arch = "wasm32") { 5 } else { 20 };
    for seed in 0..seeds {
        let (made, not_made) = run_random_edits(starts[seed % starts.len()], seed as u64, 5_000);
        edits.iter_mut().zip(made).for_each(|(sum, made)| *sum += made);
        refused += not_made;
    }
    assert_eq!(edits.iter().sum::<usize>(), seeds * 5_000);
    println!("{edits:?} of {EDITS:?}; {refused} refused");
    for ((name, _), (made, least)) in
        EDITS.iter().zip(edits.into_iter().zip([1_000, 1_000, 1_500, 150, 25, 150]))
    {
        assert!(made >= seeds * least, "only {made} {name}");
    }
    assert!(refused >= seeds * 500, "only {refused} edits were refused: refusals are not tested");
}

/// Returns the serialised mesh, which leaves out its versions.
fn contents(mesh: &Mesh) -> Vec<u8> {
    postcard::to_allocvec(mesh).unwrap()
}

type Placed = [(VertexId, [u32; 3]); 3];

/// Returns the triangles of a mesh as ids and positions of their vertices.
fn placed_triangles(mesh: &Mesh) -> BTreeSet<Placed> {
    let corner = |v: VertexId| (v, mesh.position(v).to_array().map(f32::to_bits));
    mesh.triangles().map(|names| names.map(corner)).collect()
}

/// Records several random edits and moves, then commits them or rolls them back. Adds the number of successful edits to
/// `edits`, and returns whether they were rolled back.
fn run_recorded_edits(mesh: &mut Mesh, random: &mut Random, edits: &mut usize, what: &str) -> bool {
    let before = mesh.clone();
    mesh.begin();
    for _ in 0..1 + random.below(4) {
        let live: Vec<_> = mesh.vertices().collect();
        if live.is_empty() {
            break;
        }
        let moved = live[random.below(live.len())];
        mesh.set_position(moved, mesh.position(moved) + Vec3::splat(random.unit()));
        *edits += usize::from(random_edit(mesh, random, &live).is_ok());
    }
    let (old, new) = (placed_triangles(&before), placed_triangles(mesh));
    let changed: BTreeSet<[VertexId; 3]> = mesh.changed_triangles().into_iter().collect();
    let expected = new.difference(&old).map(|corners| corners.map(|(v, _)| v)).collect();
    assert_eq!(changed, expected, "{what}");
    let touched: BTreeSet<VertexId> = mesh.touched_vertices().collect();
    let is_known = |v: VertexId| v.index() < before.slots() && before.is_live(v);
    let same = |v: VertexId| before.ring(v) == mesh.ring(v) && before.position(v) == mesh.position(v);
    let untouched = mesh.vertices().filter(|v| !touched.contains(v));
    assert!(untouched.into_iter().all(|v| is_known(v) && same(v)), "{what}");

    let back = random.below(2) == 0;
    if back {
        mesh.roll_back();
        assert!(contents(mesh) == contents(&before), "{what}: taken back, and not as it was");
        assert_ne!(mesh.geometry_version(), before.geometry_version(), "{what}");
    } else {
        mesh.commit();
    }
    back
}

#[test]
fn recorded_edits_are_reported_and_can_be_rolled_back() {
    let starts: [fn() -> Mesh; 4] = [tetrahedron, sphere, || torus(3, 7), || torus(9, 3)];
    for seed in 0..8 {
        let mut random = Random(seed);
        let start = starts[seed as usize % starts.len()];
        let (mut mesh, _) = followed(start());
        let (mut taken_back, mut edits) = (0, 0);
        for round in 0..500 {
            if mesh.vertex_count() == 0 || mesh.vertex_count() > 200 {
                (mesh, _) = followed(start());
            }
            let what = format!("seed {seed}, round {round}");
            taken_back += usize::from(run_recorded_edits(&mut mesh, &mut random, &mut edits, &what));
            assert_eq!(mesh.check(), Ok(()), "{what}");
        }
        assert!(taken_back > 100, "only {taken_back} were taken back");
        assert!(edits > 500, "only {edits} edits were made");
    }
}
