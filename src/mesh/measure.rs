//! Geometric and topological measures of a triangle list, summed in `f64` in the order of the triangles.

use super::TriangleMesh;
use super::disjoint_sets::DisjointSets;
use super::edge_table::{HalfEdge, by_edge, sorted_half_edges};
use crate::math::symmetric::outer;
use crate::math::{DMat3, DVec3};

/// Geometric and topological measures of a mesh, in the length unit of its positions; the result of [`measure`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// The number of vertices used by triangles.
    pub vertices: usize,
    /// The number of triangles, including degenerate ones.
    pub triangles: usize,
    /// The number of connected components. Components are connected through edges: two that share only a vertex count
    /// as two.
    pub components: usize,
    /// The Euler characteristic χ = V − E + F.
    pub euler: i64,
    /// The sum of the genera of the components, from χ = 2 components − 2 genus; valid for closed, oriented manifolds.
    pub genus: i64,
    /// The total area of the triangles, in squared units of the mesh.
    pub area: f64,
    /// The signed enclosed volume, in cubed units of the mesh, positive if triangles are counter-clockwise seen from
    /// outside. If the mesh is not closed, the sum of the signed volumes of the tetrahedra from its triangles to the
    /// centre of its bounding box.
    pub volume: f64,
    /// The centroid of the enclosed solid; the centroid of the surface if the volume is negligible (|volume| ≤ 1e-9
    /// area^1.5).
    pub centroid: DVec3,
    /// The second moments of the enclosed solid about `centroid`: ∫ (x − c)(x − c)ᵀ dV at density 1, row-major, in the
    /// fifth power of the length unit, with the sign of the volume. (The inertia tensor is tr(M) I − M for this matrix
    /// M.)
    pub inertia: [f64; 9],
    /// The length of the shortest edge, in units of the mesh.
    pub edge_min: f64,
    /// The mean length of the edges, in units of the mesh.
    pub edge_mean: f64,
    /// The length of the longest edge, in units of the mesh.
    pub edge_max: f64,
    /// The smallest angle of all triangles, in degrees; 0 if two corners coincide.
    pub min_angle_degrees: f64,
    /// The largest angle of all triangles, in degrees.
    pub max_angle_degrees: f64,
    /// The lowest and the highest corner of the bounding box of the vertices used by triangles.
    pub bounds: [DVec3; 2],
}

/// Measures `mesh`: counts, area, volume, moments, edge lengths and angles.
///
/// All measures of a mesh without triangles are zero. Triangles with an invalid index are ignored.
pub fn measure(mesh: &TriangleMesh) -> Measures {
    let valid = mesh.triangles.iter().filter(|t| t.iter().all(|&v| (v as usize) < mesh.positions.len()));
    let triangles: Vec<[u32; 3]> = valid.copied().collect();
    let uses = sorted_half_edges(&triangles);
    let used = used_vertices(mesh.positions.len(), &triangles);
    let corners = || triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize].as_dvec3()));

    let bounds = bounds(used.iter().map(|&v| mesh.positions[v as usize].as_dvec3()));
    let solid = solid(corners(), 0.5 * (bounds[0] + bounds[1]));
    let edges = edges(&uses, |v| mesh.positions[v as usize].as_dvec3());
    let [min_angle_degrees, max_angle_degrees] = angles(corners());
    let components = components(&uses, triangles.len());
    let euler = used.len() as i64 - edges.count as i64 + triangles.len() as i64;
    Measures {
        vertices: used.len(),
        triangles: triangles.len(),
        components,
        euler,
        genus: (2 * components as i64 - euler).div_euclid(2),
        area: solid.area,
        volume: solid.volume,
        centroid: solid.centroid + mesh.origin,
        inertia: solid.moments.to_cols_array(),
        edge_min: edges.min,
        edge_mean: edges.mean,
        edge_max: edges.max,
        min_angle_degrees,
        max_angle_degrees,
        bounds: bounds.map(|corner| corner + mesh.origin),
    }
}

/// Returns the volume that [`measure`] finds, alone.
pub(crate) fn enclosed_volume(mesh: &TriangleMesh) -> f64 {
    let used = used_vertices(mesh.positions.len(), &mesh.triangles);
    let bounds = bounds(used.iter().map(|&v| mesh.positions[v as usize].as_dvec3()));
    let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize].as_dvec3()));
    solid(corners, 0.5 * (bounds[0] + bounds[1])).volume
}

fn used_vertices(count: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut used = vec![false; count];
    triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    (0..).zip(used).filter_map(|(v, is_used)| is_used.then_some(v)).collect()
}

fn bounds(mut points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    let Some(first) = points.next() else { return [DVec3::ZERO; 2] };
    points.fold([first; 2], |[low, high], p| [low.min(p), high.max(p)])
}

fn components(uses: &[HalfEdge], triangles: usize) -> usize {
    let mut groups = DisjointSets::new(triangles);
    groups.join_across_edges(uses);
    groups.count()
}

struct Solid {
    area: f64,
    volume: f64,
    centroid: DVec3,
    moments: DMat3,
}

/// The absolute volume, as a multiple of area^1.5 (0.094 for a ball), up to which [`solid`] treats it as rounding
/// error; dividing by it would give an arbitrary centroid.
const FLAT: f64 = 1e-9;

/// Sums area, volume and moments over the tetrahedra from each triangle to the point `reference`, whose choice affects
/// only rounding if the mesh is closed, and computes the centroid.
fn solid(triangles: impl Iterator<Item = [DVec3; 3]>, reference: DVec3) -> Solid {
    let (mut area, mut surface_first) = (0.0, DVec3::ZERO);
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for corners in triangles {
        let [a, b, c] = corners.map(|p| p - reference);
        let sum = a + b + c;
        let part = 0.5 * (b - a).cross(c - a).length();
        area += part;
        surface_first += sum * (part / 3.0);
        let six_volume = a.dot(b.cross(c));
        volume += six_volume / 6.0;
        first += sum * (six_volume / 24.0);
        second += (outer(sum) + outer(a) + outer(b) + outer(c)) * (six_volume / 120.0);
    }
    let flat = volume.abs() <= FLAT * area * area.sqrt();
    let (weight, moment) = if flat { (area, surface_first) } else { (volume, first) };
    let centre = if weight == 0.0 { DVec3::ZERO } else { moment / weight };
    // ∫ (x−c)(x−c)ᵀ = ∫ xxᵀ − fcᵀ − cfᵀ + V ccᵀ, with f = ∫ x.
    let cross = DMat3::from_cols(first * centre.x, first * centre.y, first * centre.z);
    let moments = second - cross - cross.transpose() + outer(centre) * volume;
    Solid { area, volume, centroid: reference + centre, moments }
}

struct Edges {
    count: usize,
    min: f64,
    mean: f64,
    max: f64,
}

fn edges(uses: &[HalfEdge], position: impl Fn(u32) -> DVec3) -> Edges {
    let lengths = by_edge(uses).map(|edge| {
        let [u, v] = edge[0].ends();
        position(u).distance(position(v))
    });
    let (mut count, mut sum, mut min, mut max) = (0_usize, 0.0, f64::INFINITY, 0.0_f64);
    for length in lengths {
        count += 1;
        sum += length;
        min = min.min(length);
        max = max.max(length);
    }
    if count == 0 {
        return Edges { count, min: 0.0, mean: 0.0, max: 0.0 };
    }
    Edges { count, min, mean: sum / count as f64, max }
}

/// Returns the smallest and the largest angle of all triangles, in degrees.
fn angles(triangles: impl Iterator<Item = [DVec3; 3]>) -> [f64; 2] {
    let mut range: Option<[Angle; 2]> = None;
    for [a, b, c] in triangles {
        for angle in [Angle::at(a, b, c), Angle::at(b, c, a), Angle::at(c, a, b)] {
            let [min, max] = range.get_or_insert([angle; 2]);
            if angle.is_less_than(min) {
                *min = angle;
            }
            if max.is_less_than(&angle) {
                *max = angle;
            }
        }
    }
    range.map_or([0.0; 2], |ends| ends.map(|angle| angle.degrees()))
}

/// An angle from 0 to 180°, as its sine and cosine times a common positive factor, so that angles are compared without
/// trigonometric functions.
#[derive(Clone, Copy)]
struct Angle {
    sine: f64,
    cosine: f64,
}

impl Angle {
    fn at(apex: DVec3, p: DVec3, q: DVec3) -> Self {
        let (u, v) = (p - apex, q - apex);
        let (sine, cosine) = (u.cross(v).length(), u.dot(v));
        // Two coincident corners leave the angle undefined; it counts as 0.
        if sine == 0.0 && cosine == 0.0 { Self { sine: 0.0, cosine: 1.0 } } else { Self { sine, cosine } }
    }

    /// Returns whether this angle is smaller than `other`: if sin(other − self) > 0, or, where that is 0, if this angle
    /// is 0 and the other one 180°.
    fn is_less_than(&self, other: &Self) -> bool {
        let turn = self.cosine * other.sine - self.sine * other.cosine;
        turn > 0.0 || (turn == 0.0 && self.cosine > 0.0 && other.cosine < 0.0)
    }

    fn degrees(&self) -> f64 {
        libm::atan2(self.sine, self.cosine).to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;
    use crate::math::{DAffine3, Vec3};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance * expected.abs().max(1e-12), "{found}, not {expected}");
    }

    #[test]
    fn box_in_closed_form() {
        let (a, b, c) = (2.0, 3.0, 5.0);
        let m = measure(&shapes::cuboid(Vec3::new(2.0, 3.0, 5.0)));
        assert_eq!((m.vertices, m.triangles, m.components, m.euler, m.genus), (8, 12, 1, 2, 0));
        near(m.area, 62.0, 1e-15);
        near(m.volume, 30.0, 1e-15);
        assert_eq!(m.centroid, DVec3::new(1.0, 1.5, 2.5));
        let expected = [a * a, 0.0, 0.0, 0.0, b * b, 0.0, 0.0, 0.0, c * c].map(|s: f64| 30.0 * s / 12.0);
        for (found, expected) in m.inertia.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{:?}", m.inertia);
        }
        assert_eq!((m.edge_min, m.edge_max), (2.0, libm::sqrt(34.0)));
        let diagonals = libm::sqrt(13.0) + libm::sqrt(29.0) + libm::sqrt(34.0);
        near(m.edge_mean, (4.0 * (a + b + c) + 2.0 * diagonals) / 18.0, 1e-15);
        near(m.max_angle_degrees, 90.0, 1e-15);
        near(m.min_angle_degrees, libm::atan2(2.0, 5.0).to_degrees(), 1e-14);
        assert_eq!(m.bounds, [DVec3::ZERO, DVec3::new(2.0, 3.0, 5.0)]);
    }

    #[test]
    fn tetrahedron_in_closed_form() {
        let mesh = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            ..Default::default()
        };
        let m = measure(&mesh);
        near(m.volume, 1.0 / 6.0, 1e-15);
        near(m.area, 1.5 + 0.75_f64.sqrt(), 1e-15);
        assert!((m.centroid - DVec3::splat(0.25)).length() < 1e-15);
        for (i, found) in m.inertia.into_iter().enumerate() {
            near(found, if i % 4 == 0 { 1.0 / 160.0 } else { -1.0 / 480.0 }, 1e-13);
        }
    }

    #[test]
    fn icosahedron_in_closed_form() {
        let edge = 2.0_f64;
        let m = measure(&shapes::icosahedron());
        let five = 5.0_f64.sqrt();
        near(m.volume, 5.0 * (3.0 + five) / 12.0 * edge * edge * edge, 1e-6);
        near(m.area, 5.0 * 3.0_f64.sqrt() * edge * edge, 1e-6);
        near(m.min_angle_degrees, 60.0, 1e-5);
        near(m.max_angle_degrees, 60.0, 1e-5);
        let golden = (1.0 + five) / 2.0;
        // The tensor is isotropic: its diagonal entries are a third of ∫ |x|², which is 20 times the integral over one
        // pyramid.
        near(m.inertia[0], m.inertia[8], 1e-6);
        let inradius = golden * golden / (3.0_f64.sqrt()) * edge / 2.0;
        let pyramid = m.volume / 20.0 * 3.0 / 5.0 * (inradius * inradius + edge * edge / 12.0);
        near(3.0 * m.inertia[0], 20.0 * pyramid, 1e-6);
    }

    #[test]
    fn torus_nears_closed_form() {
        let (major, minor, pi) = (3.0, 1.0, std::f64::consts::PI);
        let m = measure(&shapes::torus(major, minor, 400, 200));
        assert_eq!((m.components, m.euler, m.genus), (1, 0, 1));
        near(m.volume, 2.0 * pi * pi * major * minor * minor, 1e-3);
        near(m.area, 4.0 * pi * pi * major * minor, 1e-3);
        near(m.inertia[8], m.volume * minor * minor / 4.0, 1e-3);
        near(m.inertia[0], m.volume * (major * major / 2.0 + 3.0 / 8.0 * minor * minor), 1e-3);
    }

    #[test]
    fn far_away_and_turned_over() {
        let far = DAffine3::from_translation(DVec3::new(1e4, -2e4, 3e4));
        let m = measure(&shapes::cuboid(Vec3::ONE).transformed(&far));
        near(m.volume, 1.0, 1e-14);
        near(m.inertia[0], 1.0 / 12.0, 1e-13);
        let mirror = DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0));
        near(measure(&shapes::cuboid(Vec3::ONE).transformed(&mirror)).volume, 2.0, 1e-15);
        let mut inside_out = shapes::cuboid(Vec3::ONE);
        inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(measure(&inside_out).volume, -1.0);
    }

    #[test]
    fn components_unused_vertices_and_empty_mesh() {
        let two = shapes::joined(&[shapes::torus(3.0, 1.0, 12, 8), shapes::cuboid(Vec3::ONE)]);
        let m = measure(&two);
        assert_eq!((m.components, m.euler, m.genus), (2, 2, 1));
        let mut unused = shapes::cuboid(Vec3::ONE);
        unused.positions.push(Vec3::splat(99.0));
        assert_eq!(measure(&unused), measure(&shapes::cuboid(Vec3::ONE)));
        let nothing = measure(&TriangleMesh::default());
        assert_eq!(
            (nothing.vertices, nothing.area, nothing.edge_min, nothing.min_angle_degrees),
            (0, 0.0, 0.0, 0.0)
        );
    }

    #[test]
    fn flat_mesh_has_the_centroid_of_its_surface() {
        let mut flat = shapes::cuboid(Vec3::new(2.0, 2.0, 0.0));
        flat.positions.iter_mut().for_each(|p| *p += Vec3::new(0.1, 0.2, 0.3));
        let m = measure(&flat);
        assert!((m.centroid - DVec3::new(1.1, 1.2, 0.3)).length() < 1e-7, "{}", m.centroid);
        assert_eq!(m.min_angle_degrees, 0.0);
    }
}
