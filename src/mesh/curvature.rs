//! Discrete mean and Gaussian curvature per vertex (Meyer, Desbrun, Schröder & Barr, *Discrete differential-geometry
//! operators for triangulated 2-manifolds*, 2003), summed in `f64` in the order of the triangles.

use super::TriangleMesh;
use super::edge_table::{by_edge, sorted_half_edges};
use crate::math::DVec3;

/// Mean and Gaussian curvature per vertex, and the area over which each is averaged.
#[derive(Clone, Debug, PartialEq)]
pub struct Curvature {
    /// The mean curvature H = (κ₁ + κ₂) / 2 per vertex, an inverse length: positive where the surface is convex, 1/r on
    /// a ball of radius r, negative on the wall of a cavity and in a furrow.
    pub mean: Vec<f64>,
    /// The Gaussian curvature K = κ₁ κ₂ per vertex, an inverse area: 1/r² on a ball of radius r, negative on a saddle.
    pub gaussian: Vec<f64>,
    /// The mixed Voronoi area around each vertex; their sum is the area of the mesh. K times this area is the angle
    /// deficit from 2π, except on the boundary of an open mesh; the deficits of a closed mesh sum to 2πχ.
    pub areas: Vec<f64>,
}

/// Computes the curvature of `mesh` at its vertices: K from the angle deficit, H from the cotangent Laplacian, both per
/// mixed Voronoi area.
///
/// H is the component of the Laplacian along the vertex normal, so that it has a sign and changes it continuously. All
/// values are finite. H and K are 0 at unused vertices, on the boundary of an open mesh, and where all triangles around
/// a vertex have area 0; such triangles contribute their angles to K and nothing to H. Indices must be valid, see
/// [`TriangleMesh::validate`].
pub fn curvature(mesh: &TriangleMesh) -> Curvature {
    let mut sums = vec![Sums::default(); mesh.positions.len()];
    for triangle in &mesh.triangles {
        add(&mut sums, triangle.map(|v| v as usize), triangle.map(|v| mesh.positions[v as usize].as_dvec3()));
    }
    for edge in by_edge(&sorted_half_edges(&mesh.triangles)).filter(|edge| edge.len() == 1) {
        edge[0].ends().into_iter().for_each(|v| sums[v as usize].on_rim = true);
    }
    Curvature {
        mean: sums.iter().map(Sums::mean).collect(),
        gaussian: sums.iter().map(Sums::gaussian).collect(),
        areas: sums.iter().map(|s| s.area).collect(),
    }
}

/// The sums over the triangles around a vertex from which the curvature at the vertex is computed.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// The sum of the angles of the triangles at the vertex, in radians.
    angle: f64,
    /// The mixed Voronoi area around the vertex, which the curvature is averaged over.
    area: f64,
    /// ½ Σ (cot α + cot β)(x − y) over the neighbours y of the vertex x, with the angles α and β opposite the edge
    /// between them; this is 2 H n times the mixed Voronoi area, with the mean curvature H and the unit normal n.
    laplacian: DVec3,
    /// The sum of the cross products of the triangles, an outward normal; its length is twice their area if they are
    /// coplanar.
    normal: DVec3,
    on_rim: bool,
}

impl Sums {
    fn mean(&self) -> f64 {
        self.per_area(0.5 * self.laplacian.dot(self.normal.normalize_or_zero()))
    }

    fn gaussian(&self) -> f64 {
        self.per_area(std::f64::consts::TAU - self.angle)
    }

    /// Returns a curvature: its `integral` over the mixed Voronoi area, divided by that area; 0 on a boundary or if the
    /// area is 0. The result is limited to the range of `f32`: a tiny area can give any number.
    fn per_area(&self, integral: f64) -> f64 {
        let value = integral / self.area;
        if self.on_rim || self.area == 0.0 || value.is_nan() {
            return 0.0;
        }
        value.clamp(f64::from(f32::MIN), f64::from(f32::MAX))
    }
}

/// Adds the contributions of a triangle to the sums, by vertex, of its three corners.
fn add(sums: &mut [Sums], corners: [usize; 3], points: [DVec3; 3]) {
    let angles = angles(points);
    let normal = (points[1] - points[0]).cross(points[2] - points[0]);
    let doubled_area = normal.length();
    for k in 0..3 {
        sums[corners[k]].angle += angles[k];
    }
    if doubled_area == 0.0 {
        return;
    }
    // By corner; the cotangent at a corner is a weight of the opposite edge.
    let cotangents = [0, 1, 2].map(|k| {
        let [p, q, r] = [points[k], points[(k + 1) % 3], points[(k + 2) % 3]];
        (q - p).dot(r - p) / doubled_area
    });
    let areas = mixed_areas(points, cotangents, 0.5 * doubled_area);
    for k in 0..3 {
        let [next, previous] = [(k + 1) % 3, (k + 2) % 3];
        let sum = &mut sums[corners[k]];
        sum.area += areas[k];
        sum.normal += normal;
        sum.laplacian += 0.5
            * (cotangents[previous] * (points[k] - points[next])
                + cotangents[next] * (points[k] - points[previous]));
    }
}

/// Returns the angles of a triangle, in radians; they sum to π, even if its area is 0.
fn angles(points: [DVec3; 3]) -> [f64; 3] {
    let mut angles = [0, 1, 2].map(|k| {
        let (u, v) = (points[(k + 1) % 3] - points[k], points[(k + 2) % 3] - points[k]);
        libm::atan2(u.cross(v).length(), u.dot(v))
    });
    // Coincident corners share the rest of π equally.
    let together = [0, 1, 2].map(|k| points[k] == points[(k + 1) % 3] || points[k] == points[(k + 2) % 3]);
    let count = together.iter().filter(|&&t| t).count();
    for k in (0..3).filter(|&k| together[k]) {
        angles[k] = std::f64::consts::PI / count as f64;
    }
    angles
}

/// Returns the part of the area of a triangle that belongs to each corner: its Voronoi region, or, if an angle is
/// obtuse, half of the area at that corner and a quarter at the others (figure 4 of Meyer et al.).
fn mixed_areas(points: [DVec3; 3], cotangents: [f64; 3], area: f64) -> [f64; 3] {
    if cotangents.iter().any(|&c| c < 0.0) {
        return cotangents.map(|c| if c < 0.0 { 0.5 * area } else { 0.25 * area });
    }
    [0, 1, 2].map(|k| {
        let [next, previous] = [(k + 1) % 3, (k + 2) % 3];
        0.125
            * (cotangents[previous] * points[k].distance_squared(points[next])
                + cotangents[next] * points[k].distance_squared(points[previous]))
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, measure, shapes};
    use super::*;
    use crate::math::{Random, Vec3};
    use std::f64::consts::{PI, TAU};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn sphere(radius: f32, edge: f32) -> TriangleMesh {
        Mesh::icosphere(Vec3::new(1.0, -2.0, 3.0), radius, edge).unwrap().to_triangles()
    }

    /// Returns a sphere with vertices shifted on it at random, by up to 0.15 of an edge in each direction, so that
    /// triangles have all shapes.
    fn uneven_sphere(radius: f32, edge: f32) -> TriangleMesh {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, radius, edge).unwrap().to_triangles();
        // With this seed one triangle has an angle below 15°, which few others give.
        let mut random = Random::new(58);
        let mut next = || 2.0 * random.unit() as f32 - 1.0;
        for p in &mut mesh.positions {
            *p = (*p + Vec3::new(next(), next(), next()) * 0.15 * edge).normalize() * radius;
        }
        mesh
    }

    fn mean_of(values: impl Iterator<Item = f64>, weights: &[f64]) -> f64 {
        values.zip(weights).map(|(v, w)| v * w).sum::<f64>() / weights.iter().sum::<f64>()
    }

    /// Returns the largest and the area-weighted mean relative error of `values`, by vertex, against `expected`.
    fn off(values: &[f64], areas: &[f64], expected: f64) -> [f64; 2] {
        let off = |v: &f64| (v / expected - 1.0).abs();
        [values.iter().map(off).fold(0.0, f64::max), mean_of(values.iter().map(off), areas)]
    }

    #[test]
    fn ball_has_one_over_r() {
        for radius in [0.5_f32, 20.0] {
            let found = curvature(&sphere(radius, radius * 0.1));
            let r = f64::from(radius);
            let [largest, _] = off(&found.mean, &found.areas, 1.0 / r);
            assert!(largest < 0.002, "H off by {largest}");
            let [largest, mean] = off(&found.gaussian, &found.areas, 1.0 / (r * r));
            assert!(largest < 0.1 && mean < 0.005, "K off by {largest}, {mean}");
        }
    }

    #[test]
    fn uneven_ball_has_one_over_r() {
        let mesh = uneven_sphere(2.0, 0.2);
        // Few vertices have large errors.
        assert!(measure(&mesh).min_angle_degrees < 15.0);
        let found = curvature(&mesh);
        let [largest, mean] = off(&found.mean, &found.areas, 0.5);
        assert!(largest < 0.5 && mean < 0.005, "H off by {largest}, {mean}");
        let [largest, mean] = off(&found.gaussian, &found.areas, 0.25);
        assert!(largest < 0.5 && mean < 0.005, "K off by {largest}, {mean}");
        assert!((mean_of(found.mean.iter().copied(), &found.areas) - 0.5).abs() < 1e-3);
        assert!((mean_of(found.gaussian.iter().copied(), &found.areas) - 0.25).abs() < 1e-3);
    }

    #[test]
    fn inside_out_the_mean_turns_negative() {
        let mut mesh = sphere(2.0, 0.4);
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let found = curvature(&mesh);
        assert!(found.mean.iter().all(|h| (h + 0.5).abs() < 0.01));
        assert!(found.gaussian.iter().all(|&k| k > 0.0));
    }

    #[test]
    fn torus_has_the_signs_and_values_of_its_formula() {
        let (major, minor) = (3.0, 1.0);
        let mesh = shapes::torus(major, minor, 240, 80);
        let found = curvature(&mesh);
        for (v, p) in mesh.positions.iter().enumerate() {
            let p = p.as_dvec3();
            let ring = (p.x * p.x + p.y * p.y).sqrt();
            let along = (ring - major) / minor;
            let (mean, gaussian) =
                ((major + 2.0 * minor * along) / (2.0 * minor * ring), along / (minor * ring));
            assert!((found.mean[v] - mean).abs() < 0.003, "{} for {mean} at {p}", found.mean[v]);
            assert!(
                (found.gaussian[v] - gaussian).abs() < 0.01,
                "{} for {gaussian} at {p}",
                found.gaussian[v]
            );
        }
    }

    /// Returns Σ K A and Σ A over the vertices, with their Gaussian curvature K and mixed Voronoi area A, and the area
    /// of the mesh, to test the Gauss–Bonnet theorem.
    fn integrals(mesh: &TriangleMesh) -> [f64; 3] {
        let found = curvature(mesh);
        let total = found.gaussian.iter().zip(&found.areas).map(|(k, a)| k * a).sum();
        [total, found.areas.iter().sum(), measure(mesh).area]
    }

    #[test]
    fn gauss_bonnet_and_the_areas_hold_to_rounding() {
        let two = shapes::joined(&[shapes::torus(3.0, 1.0, 24, 9), shapes::cuboid(Vec3::ONE)]);
        for (mesh, euler) in [
            (sphere(2.0, 0.2), 2.0),
            (uneven_sphere(1.0, 0.05), 2.0),
            (shapes::torus(3.0, 1.0, 60, 20), 0.0),
            (shapes::cuboid(Vec3::new(1.0, 5.0, 0.1)), 2.0),
            (two, 2.0),
        ] {
            let [total, areas, area] = integrals(&mesh);
            assert!((total - TAU * euler).abs() < 1e-10, "{total} for χ = {euler}");
            assert!((areas - area).abs() < 1e-12 * area, "{areas} of {area}");
        }
    }

    #[test]
    fn an_obtuse_corner_has_half_the_area() {
        let [o, x] = [DVec3::ZERO, DVec3::X];
        let areas_of = |tip: DVec3| lone_areas([tip, o, x]);
        assert_eq!(areas_of(DVec3::new(0.5, 0.125, 0.0)), [0.03125, 0.015625, 0.015625]);
        // At a right angle both rules agree. In an acute triangle each corner gets its Voronoi region.
        assert_eq!(areas_of(DVec3::Y), [0.125, 0.25, 0.125]);
        assert_eq!(areas_of(DVec3::new(0.5, 1.0, 0.0)), [0.15625, 0.171875, 0.171875]);
    }

    /// Returns the mixed Voronoi areas of the corners of a single triangle, for tests.
    fn lone_areas(points: [DVec3; 3]) -> [f64; 3] {
        let mut sums = [Sums::default(); 3];
        add(&mut sums, [0, 1, 2], points);
        sums.map(|s| s.area)
    }

    #[test]
    fn angles_of_flat_triangles_sum_to_a_half_turn() {
        let [o, x] = [DVec3::ZERO, DVec3::X];
        for points in [[o, x, 3.0 * x], [o, o, x], [o, x, o], [x, o, o], [o, o, o]] {
            let sum: f64 = angles(points).iter().sum();
            assert!((sum - PI).abs() < 1e-15, "{points:?}: {sum}");
        }
    }

    #[test]
    fn every_number_is_finite_whatever_the_triangles() {
        for scale in [1e-30, 1.0, 1e30] {
            for seed in 0..40 {
                let mut mesh = shapes::soup(seed, 30, 3);
                mesh.positions.iter_mut().for_each(|p| *p *= scale);
                let found = curvature(&mesh);
                let mut all = found.mean.iter().chain(&found.gaussian);
                assert!(all.all(|&x| (x as f32).is_finite()), "{seed}");
                assert!(found.areas.iter().all(|a| a.is_finite()), "{seed}");
            }
        }
        let tiny = curvature(&shapes::cuboid(Vec3::splat(1e-30)));
        assert!(tiny.gaussian.iter().all(|&k| k == f64::from(f32::MAX)));
        let flat = curvature(&shapes::cuboid(Vec3::new(1.0, 0.0, 0.0)));
        assert!(flat.mean.iter().chain(&flat.gaussian).all(|&x| x == 0.0));
    }

    #[test]
    fn the_rim_and_unused_vertices_are_zero() {
        let mut open = shapes::cuboid(Vec3::ONE);
        open.triangles.truncate(10);
        open.positions.push(Vec3::splat(9.0));
        let found = curvature(&open);
        let rim = [1, 3, 5, 7, 8];
        for v in 0..9 {
            let expected = if rim.contains(&v) { 0.0 } else { PI / 2.0 };
            assert!((found.gaussian[v] * found.areas[v] - expected).abs() < 1e-12, "{v}");
            assert_eq!(found.mean[v] == 0.0, rim.contains(&v), "{v}");
        }
    }
}
