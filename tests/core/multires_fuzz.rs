//! Surfaces over random ellipsoids with random motion and parameters: closed, and free of self-intersections after
//! every frame.
//!
//! `FUZZ_SEEDS=<first>..<last>` runs other seeds; a failing seed is printed.

use crate::common::skins::assert_sound;
use crate::common::{Named, Random, seeds};
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::Mesh;
use vesicle::methods::MethodError;
use vesicle::methods::multires::{
    ControlEllipsoid, Energy, MultiresOptions, MultiresParams, MultiresolutionModel, Topology,
};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn direction(random: &mut Random) -> DVec3 {
    let mut number = || random.within(-1.0, 1.0);
    DVec3::new(number(), number(), number()).try_normalize().unwrap_or(DVec3::X)
}

fn random_ellipsoid(random: &mut Random, spread: f64) -> ControlEllipsoid {
    let x = direction(random);
    let y = direction(random).cross(x).try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
    let mut length = || random.within(0.3, 1.0);
    let axes = [x * length(), y * length(), x.cross(y) * length()];
    let center = direction(random) * random.within(0.0, spread);
    ControlEllipsoid { center: center.to_array(), axes: axes.map(|axis| axis.to_array()) }
}

fn random_params(random: &mut Random) -> MultiresParams {
    let edge = random.within(0.14, 0.3);
    MultiresParams {
        edge_min: 0.65 * edge,
        edge_max: random.within(1.4, 2.0) * edge,
        levels: random.below(4) as u32,
        refine_factor: random.within(0.3, 0.9),
        smoothing: 1 + random.below(12) as u32,
        distribute: random.below(5) as u32,
        supersample: random.below(3) as u32,
        energy: [Energy::Membrane, Energy::ThinPlate][random.below(2)],
        topology: [Topology::Never, Topology::Split, Topology::SplitAndJoin][random.below(3)],
    }
}

/// Returns a ball with random bumps, some of them high.
fn random_detail(random: &mut Random) -> vesicle::mesh::TriangleMesh {
    let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.2, 0.15).unwrap().to_triangles();
    let (waves, height) = (direction(random) * random.within(1.0, 6.0), random.within(0.0, 0.35));
    for p in &mut mesh.positions {
        let bump =
            1.0 + height * libm::sin(waves.dot(p.as_dvec3())) * libm::cos(3.0 * waves.y * f64::from(p.z));
        *p = (p.as_dvec3() * bump).as_vec3();
    }
    mesh.normals = None;
    mesh
}

fn begun(random: &mut Random) -> Option<(MultiresolutionModel, usize)> {
    let count = 1 + random.below(4);
    let ellipsoids: Vec<_> = (0..count).map(|_| random_ellipsoid(random, 1.0)).collect();
    let detail = (random.below(2) == 0).then(|| random_detail(random));
    let options = MultiresOptions { detail, ellipsoids, params: random_params(random), base: None };
    match MultiresolutionModel::new(options) {
        Ok(model) => Some((model, count)),
        // Some ellipsoids are outside the bumps, or no base can be computed.
        Err(MethodError::InvalidArgument { parameter: "ellipsoids" | "detail", .. }) => None,
        Err(error) => panic!("{error}"),
    }
}

fn run(seed: u64) {
    let random = &mut Random(seed);
    let Some((mut model, mut count)) = begun(random) else { return };
    for _ in 0..10 {
        match random.below(6) {
            0 => count = 1 + random.below(5),
            1 => _ = model.set_params(random_params(random)),
            _ => {}
        }
        let goals: Vec<_> = (0..count).map(|_| random_ellipsoid(random, 1.8)).collect();
        // Refused if a tip is too sharp for the edge lengths.
        _ = model.set_ellipsoids(&goals);
        for _ in 0..1 + random.below(3) {
            let report = model.step().unwrap();
            assert_sound(&model, &report);
            assert!(report.vertices > 0, "the skin has slipped off");
        }
    }
}

#[test]
fn random_surfaces_stay_valid() {
    for seed in seeds(12) {
        let _named = Named::new(seed);
        run(seed);
    }
}

/// Regression: the first surface was solved for without a test for self-intersections; an ellipsoid that grew outside
/// pushed the surface off all others.
#[test]
fn seeds_that_failed_once() {
    for seed in [118, 1282] {
        let _named = Named::new(seed);
        run(seed);
    }
}
