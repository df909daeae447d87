//! Distance along the surface from a vertex.
//!
//! Distances spread from vertex to vertex, nearest first, as in Dijkstra's algorithm, but also through triangles: from
//! two corners to the third, by unfolding. In the triangle's plane there is a point as far from both corners as they
//! are from the start; the third corner is as far as the straight line to it from that point, if that line enters
//! through the edge between the two (Novotni & Klein, *Computing geodesic distances on triangular meshes*, 2002).
//! In a plane, and across its folds, that is exact.
//!
//! A vertex whose distance is lowered later on spreads it again. So obtuse triangles, through which a shorter way may
//! come late, need no care of their own.

use super::{MeshError, TriangleMesh};
use crate::math::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How often a vertex spreads its distance. Once is the rule and three times the most on ordinary surfaces; among needles
/// two vertices may lower each other by ever less, and without a bound that would go on and on.
const MOST_SPREADS: u8 = 30;

/// A distance is lowered only by more than this share of it: less is rounding, and would be passed around for long.
const LEAST_GAIN: f64 = 1e-12;

/// The distance along the surface from vertex `from` to every vertex, in the mesh's units; infinite where no triangles
/// lead there.
///
/// Exact to rounding on flat parts, and across folds where the shortest way is the only one. On curved surfaces, and
/// where ways from two sides meet, a distance may be up to half an edge short: on a ball of radius 1 with edges of 0.1,
/// 0.03 at the far end and 0.003 in the mean. Never shorter than the straight line, nor longer than along edges.
/// O(n log n). Indices must exist, as [`TriangleMesh::validate`] makes sure.
///
/// # Errors
/// [`MeshError::InvalidArgument`] where there is no vertex `from`.
pub fn geodesic(mesh: &TriangleMesh, from: u32) -> Result<Vec<f64>, MeshError> {
    let vertices = mesh.positions.len();
    if from as usize >= vertices {
        let problem = format!("{from}; there are {vertices} vertices, from 0 on");
        return Err(MeshError::InvalidArgument { parameter: "fromVertex", problem });
    }
    let mut front = Front::new(mesh, from as usize);
    while let Some(v) = front.pop() {
        front.spread(v);
    }
    Ok(front.distances)
}

/// The distances so far, and the vertices that have yet to spread theirs.
struct Front<'a> {
    positions: &'a [Vec3],
    fans: Fans,
    origin: DVec3,
    distances: Vec<f64>,
    spreads: Vec<u8>,
    /// Bits of a distance, which for positive numbers are in the order of the numbers; ties go to the lower index.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

impl<'a> Front<'a> {
    fn new(mesh: &'a TriangleMesh, from: usize) -> Self {
        let positions = mesh.positions.as_slice();
        let mut distances = vec![f64::INFINITY; positions.len()];
        distances[from] = 0.0;
        Self {
            positions,
            fans: Fans::new(mesh),
            origin: positions[from].as_dvec3(),
            distances,
            spreads: vec![0; positions.len()],
            queue: BinaryHeap::from([Reverse((0, from as u32))]),
        }
    }

    /// The nearest vertex that has a distance to spread.
    fn pop(&mut self) -> Option<usize> {
        while let Some(Reverse((bits, v))) = self.queue.pop() {
            let v = v as usize;
            let is_current = self.distances[v].to_bits() == bits;
            if is_current && self.spreads[v] < MOST_SPREADS {
                self.spreads[v] += 1;
                return Some(v);
            }
        }
        None
    }

    /// Offers the other corners of all triangles around `v` a way through them.
    fn spread(&mut self, v: usize) {
        for k in self.fans.range(v) {
            let [a, b] = self.fans.edges[k].map(|w| w as usize);
            self.offer(a, self.way(v, b, a));
            self.offer(b, self.way(v, a, b));
        }
    }

    /// The distance to `c` through the triangle `a b c`, from the distances to `a` and `b`.
    fn way(&self, a: usize, b: usize, c: usize) -> f64 {
        let [p, q, r] = [a, b, c].map(|v| self.positions[v].as_dvec3());
        let (to_a, to_b) = (self.distances[a], self.distances[b]);
        let along_edges = (to_a + p.distance(r)).min(to_b + q.distance(r));
        let through = through_edge([to_a, to_b], q - p, r - p);
        // A curved surface taken as flat can make a way too short.
        through.map_or(along_edges, |d| d.min(along_edges)).max(r.distance(self.origin))
    }

    fn offer(&mut self, v: usize, distance: f64) {
        let old = self.distances[v];
        if distance < old && (old == f64::INFINITY || old - distance > LEAST_GAIN * old) {
            self.distances[v] = distance;
            self.queue.push(Reverse((distance.to_bits(), v as u32)));
        }
    }
}

/// How far the third corner of a triangle is, in its plane, from the point beyond the edge that is `to_a` and `to_b`
/// away from the edge's ends. Nothing where there is no such point, or where the straight line from it does not enter
/// through the edge.
///
/// `edge` and `spoke` go from the first end of the edge to the second and to the third corner.
fn through_edge([to_a, to_b]: [f64; 2], edge: DVec3, spoke: DVec3) -> Option<f64> {
    let base = edge.length();
    let source_x = 0.5 * (base + (to_a - to_b) * ((to_a + to_b) / base));
    let square = (to_a - source_x) * (to_a + source_x);
    // NaN where a distance is infinite or the edge has no length.
    if square.is_nan() || square < 0.0 {
        return None;
    }
    let (source_depth, x, height) =
        (square.sqrt(), spoke.dot(edge) / base, edge.cross(spoke).length() / base);
    let depth = source_depth + height;
    let crossing = source_x * height + x * source_depth;
    let enters = crossing >= 0.0 && crossing <= base * depth;
    enters.then(|| ((x - source_x) * (x - source_x) + depth * depth).sqrt())
}

/// For each vertex the edges opposite it in its triangles.
struct Fans {
    starts: Vec<u32>,
    edges: Vec<[u32; 2]>,
}

impl Fans {
    fn new(mesh: &TriangleMesh) -> Self {
        let mut starts = vec![0; mesh.positions.len() + 1];
        for &v in mesh.triangles.as_flattened() {
            starts[v as usize + 1] += 1;
        }
        (1..starts.len()).for_each(|v| starts[v] += starts[v - 1]);
        let mut next = starts.clone();
        let mut edges = vec![[0; 2]; 3 * mesh.triangles.len()];
        for &[a, b, c] in &mesh.triangles {
            for (corner, edge) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                let slot = &mut next[corner as usize];
                edges[*slot as usize] = edge;
                *slot += 1;
            }
        }
        Self { starts, edges }
    }

    fn range(&self, v: usize) -> std::ops::Range<usize> {
        self.starts[v] as usize..self.starts[v + 1] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mesh, shapes};
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// The largest and the mean departure of `found` from `expected`.
    fn off(found: &[f64], expected: impl Iterator<Item = f64>) -> [f64; 2] {
        let off: Vec<f64> = found.iter().zip(expected).map(|(d, e)| (d - e).abs()).collect();
        [off.iter().copied().fold(0.0, f64::max), off.iter().sum::<f64>() / off.len() as f64]
    }

    /// The same for a ball of radius 1, against arcs of great circles.
    fn off_on_ball(mesh: &TriangleMesh, from: u32) -> [f64; 2] {
        let start = mesh.positions[from as usize].as_dvec3();
        let arc = |p: &Vec3| libm::atan2(start.cross(p.as_dvec3()).length(), start.dot(p.as_dvec3()));
        off(&geodesic(mesh, from).unwrap(), mesh.positions.iter().map(arc))
    }

    #[test]
    fn great_circles_of_a_ball() {
        for edge in [0.4, 0.2, 0.1, 0.05] {
            let mesh = Mesh::icosphere(Vec3::ZERO, 1.0, edge).unwrap().to_triangles();
            for from in [0, 17, 200] {
                let [largest, mean] = off_on_ball(&mesh, from);
                let edge = f64::from(edge);
                assert!(largest < 0.6 * edge && mean < 0.1 * edge, "edge {edge}: {largest}, {mean}");
            }
        }
    }

    /// Triangles of all shapes, many of them obtuse.
    #[test]
    fn great_circles_of_an_uneven_ball() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.1).unwrap().to_triangles();
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            *p = (*p + shift(i as u32) * 0.02).normalize();
        }
        let [largest, mean] = off_on_ball(&mesh, 5);
        assert!(largest < 0.06 && mean < 0.006, "{largest}, {mean}");
    }

    /// A vector of coordinates from −1 to 1 that looks random.
    fn shift(seed: u32) -> Vec3 {
        let mut state = seed.wrapping_mul(2_654_435_761) ^ 99;
        Vec3::from_array([(); 3].map(|()| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        }))
    }

    /// A closed box from the origin, its faces in `cells` pieces each way, the inner vertices shifted within the
    /// faces by `shake` of a cell.
    fn plate(size: Vec3, cells: u32, shake: f32) -> TriangleMesh {
        let mut soup = TriangleMesh::default();
        for [p, q, r, s] in shapes::cuboid_faces(size) {
            let place = |i: u32, j: u32| {
                let is_inner = |k: u32| k > 0 && k < cells;
                let wobble =
                    if is_inner(i) && is_inner(j) { shift(i * 1000 + j) * shake } else { Vec3::ZERO };
                let [x, y] = [i as f32 + wobble.x, j as f32 + wobble.y].map(|c| c / cells as f32);
                p + (q - p) * x + (s - p) * y + (r - q + p - s) * (x * y)
            };
            for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                let corners = [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)];
                let first = soup.positions.len() as u32;
                soup.positions.extend(corners);
                soup.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| v + first)));
            }
        }
        soup.welded()
    }

    fn vertex_at(mesh: &TriangleMesh, place: Vec3) -> u32 {
        mesh.positions.iter().position(|&p| p.distance(place) < 1e-5).unwrap() as u32
    }

    #[test]
    fn exact_on_the_faces_of_a_plate() {
        for shake in [0.0, 0.2, 0.35] {
            let mesh = plate(Vec3::new(4.0, 4.0, 0.5), 12, shake);
            let found = geodesic(&mesh, vertex_at(&mesh, Vec3::ZERO)).unwrap();
            for (p, d) in mesh.positions.iter().zip(&found) {
                // From a corner: straight on three faces; over one edge or the other to the far one.
                let [x, y, z] = p.as_dvec3().to_array();
                let over = |x: f64, y: f64| (x * x + (y + 0.5) * (y + 0.5)).sqrt();
                let short = match [x, y, z] {
                    [_, _, 0.0] | [_, 0.0, _] | [0.0, _, _] => (x * x + y * y + z * z).sqrt() - d,
                    [x, y, 0.5] => over(x, y).min(over(y, x)) - d,
                    _ => continue,
                };
                // Half an edge where the two ways meet, a little beyond, nothing before.
                let allowed = match (z == 0.5, (x - y).abs() < 1.0) {
                    (false, _) => 1e-5,
                    (true, false) => 0.01,
                    (true, true) => 0.5 / 3.0,
                };
                assert!(short > -1e-5 && short < allowed, "{d}, short of {short} at {p}, shake {shake}");
            }
        }
    }

    #[test]
    fn torus_along_its_circles() {
        let (major, minor) = (3.0, 1.0);
        let mesh = shapes::torus(major, minor, 240, 80);
        // From the outermost circle: round the tube, and along the inner and outer circles where they are shortest.
        let found = geodesic(&mesh, 0).unwrap();
        for j in 0..80_u32 {
            let expected = std::f64::consts::TAU * minor * f64::from(j.min(80 - j)) / 80.0;
            assert!((found[j as usize] - expected).abs() < 0.005, "{} for {expected}", found[j as usize]);
        }
        let inner = geodesic(&mesh, 40).unwrap();
        for i in 0..60_u32 {
            let expected = std::f64::consts::TAU * (major - minor) * f64::from(i) / 240.0;
            let found = inner[(i * 80 + 40) as usize];
            assert!((found - expected).abs() < 0.005, "{found} for {expected}");
        }
    }

    /// Never nearer than the straight line, nor further than along edges.
    fn is_between_bounds(mesh: &TriangleMesh, from: u32, found: &[f64]) -> bool {
        let at = |v: u32| mesh.positions[v as usize].as_dvec3();
        let straight = |v: usize| at(v as u32).distance(at(from));
        let apart = |[u, v]: [u32; 2]| {
            let step = at(u).distance(at(v));
            found[u as usize] <= (found[v as usize] + step) * (1.0 + 1e-9)
        };
        let edges =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]]);
        (0..found.len()).all(|v| found[v] >= straight(v)) && edges.into_iter().all(apart)
    }

    #[test]
    fn bounds_hold_on_anything() {
        for seed in 0..60 {
            let mut mesh = shapes::soup(seed, 80, 4);
            mesh.positions.iter_mut().for_each(|p| *p *= [1e-20, 1.0, 1e18][seed as usize % 3]);
            let found = geodesic(&mesh, 3).unwrap();
            assert!(found.iter().all(|d| !d.is_nan()) && found[3] == 0.0);
            assert!(is_between_bounds(&mesh, 3, &found), "{seed}");
        }
        for mesh in [shapes::torus(3.0, 1.0, 50, 20), plate(Vec3::new(5.0, 1.0, 0.01), 9, 0.35)] {
            assert!(is_between_bounds(&mesh, 7, &geodesic(&mesh, 7).unwrap()));
        }
    }

    #[test]
    fn needles_end_in_bounded_work() {
        let mut mesh = shapes::torus(1.0, 0.5, 120, 60);
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            *p = Vec3::new(p.x * 1e3, p.y, p.z * 1e-2) + shift(i as u32) * 0.04;
        }
        let found = geodesic(&mesh, 0).unwrap();
        assert!(is_between_bounds(&mesh, 0, &found));
    }

    #[test]
    fn other_components_are_infinitely_far() {
        let mesh = shapes::joined(&[shapes::icosahedron(), shapes::cuboid(Vec3::splat(9.0))]);
        let found = geodesic(&mesh, 13).unwrap();
        assert!(found[..12].iter().all(|&d| d == f64::INFINITY));
        assert!(found[12..].iter().all(|&d| d < 30.0));
    }

    #[test]
    fn no_such_vertex() {
        for (mesh, from) in [(shapes::icosahedron(), 12), (TriangleMesh::default(), 0)] {
            let refusal = geodesic(&mesh, from).unwrap_err();
            assert!(matches!(refusal, MeshError::InvalidArgument { parameter: "fromVertex", .. }));
        }
    }
}
