//! Properties that hold for every surface over ellipsoids, checked by the tests of the multiresolution model.
#![allow(clippy::panic, reason = "the lints spare tests, but not their helpers")]

use vesicle::math::{DVec3, Vec3, triangle};
use vesicle::mesh::{Mesh, count_self_intersections, measure};
use vesicle::methods::StepReport;
use vesicle::methods::multires::{ControlEllipsoid, MultiresolutionModel};

/// Returns a ball as a control ellipsoid.
pub fn ball(x: f64, y: f64, z: f64, radius: f64) -> ControlEllipsoid {
    ellipsoid([x, y, z], [radius; 3])
}

/// Returns an axis-aligned ellipsoid.
pub fn ellipsoid(center: [f64; 3], [a, b, c]: [f64; 3]) -> ControlEllipsoid {
    ControlEllipsoid { center, axes: [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]] }
}

/// Returns the ellipsoid rotated about the z axis through its centre by an angle in radians.
pub fn turned(e: &ControlEllipsoid, angle: f64) -> ControlEllipsoid {
    let (sine, cosine) = angle.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [cosine * x - sine * y, sine * x + cosine * y, z];
    ControlEllipsoid { center: e.center, axes: e.axes.map(turn) }
}

/// Returns the length of the shortest semi-axis.
pub fn thinnest(e: &ControlEllipsoid) -> f64 {
    e.axes.iter().map(|axis| DVec3::from(*axis).length()).fold(f64::MAX, f64::min)
}

/// Returns the distance from the centre, scaled so that it is 1 on the surface.
pub fn unit_distance(e: &ControlEllipsoid, p: DVec3) -> f64 {
    let way = p - DVec3::from(e.center);
    let along = e.axes.map(|axis| {
        let axis = DVec3::from(axis);
        way.dot(axis) / axis.length_squared()
    });
    DVec3::from(along).length()
}

/// Returns approximately how deep the deepest vertex is inside an ellipsoid, relative to its shortest semi-axis.
pub fn penetration(mesh: &Mesh, e: &ControlEllipsoid) -> f64 {
    let depth = |v| 1.0 - unit_distance(e, mesh.position(v).as_dvec3());
    mesh.vertices().map(depth).fold(0.0, f64::max)
}

/// Returns the winding number of the surface around a point: 1 inside.
pub fn winding(mesh: &Mesh, p: Vec3) -> f64 {
    let angles = mesh.triangles().map(|corners| triangle::solid_angle(mesh.facet(corners).points, p));
    angles.sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Returns whether the centre and the end points of the axes, shortened by the fraction `share`, are inside the mesh.
pub fn covers(mesh: &Mesh, e: &ControlEllipsoid, share: f64) -> bool {
    let center = DVec3::from(e.center);
    let ends = e
        .axes
        .iter()
        .flat_map(|axis| [1.0, -1.0].map(|sign| center + DVec3::from(*axis) * sign * (1.0 - share)));
    ends.chain([center]).all(|p| (winding(mesh, p.as_vec3()) - 1.0).abs() < 0.1)
}

/// Asserts that both surfaces are closed, oriented, manifold and free of self-intersections, and that the topology is
/// as reported.
pub fn assert_sound(model: &MultiresolutionModel, report: &StepReport) {
    for mesh in [model.base_mesh(), model.mesh()] {
        assert_eq!(mesh.check(), Ok(()));
        assert_eq!(count_self_intersections(&mesh.to_triangles()), 0, "frame {}", report.iteration);
    }
    let measures = measure(&model.base_mesh().to_triangles());
    assert_eq!(measures.components as u32, report.components);
    assert_eq!(measures.euler, i64::from(report.euler));
    assert_eq!(measure(&model.mesh().to_triangles()).euler, measures.euler);
}

/// Returns an upper bound, with a margin, of how deep a triangle with vertices on an ellipsoid cuts into it, relative
/// to its shortest semi-axis.
pub fn chord(model: &MultiresolutionModel, e: &ControlEllipsoid) -> f64 {
    let longest = e.axes.iter().map(|axis| DVec3::from(*axis).length()).fold(0.0, f64::max);
    let roundest = thinnest(e) * thinnest(e) / longest;
    let edge = model.params().edge_max;
    0.5 * edge * edge / roundest / thinnest(e)
}

/// Asserts that no vertex is inside an ellipsoid and that the surface encloses every ellipsoid.
pub fn assert_held(model: &MultiresolutionModel) {
    let mesh = model.base_mesh();
    for e in model.ellipsoids() {
        let depth = penetration(mesh, &e);
        assert!(depth < 1e-3, "{depth} inside of {e:?}");
        assert!(covers(mesh, &e, chord(model, &e).min(0.9)), "{e:?} is not covered");
    }
}

/// Steps until done and asserts after each frame that the model is sound; panics after `most` frames.
pub fn settle(model: &mut MultiresolutionModel, most: usize) -> StepReport {
    for _ in 0..most {
        let report = model.step().unwrap_or_else(|error| panic!("{error}"));
        assert_sound(model, &report);
        if report.done {
            return report;
        }
    }
    panic!("not at rest after {most} frames");
}
