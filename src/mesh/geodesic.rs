//! Geodesic distance from a vertex to all others, by propagation across unfolded triangles.
//!
//! Distances propagate from the nearest vertex outwards, as in Dijkstra's algorithm, but also across triangles. In the
//! plane of a triangle, a virtual source has the known distances from two of its corners. The distance of the third
//! corner is its straight distance from this source, if the line between them passes through the edge between the two
//! known corners (Novotni & Klein, *Computing geodesic distances on triangular meshes*, 2002). On planes, and across
//! their folds, this is exact.
//!
//! A vertex whose distance decreases later propagates it again. Obtuse triangles, through which a shorter path may be
//! found late, thus need no special treatment.

use super::{MeshError, TriangleMesh};
use crate::math::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The maximum number of times that [`Front::propagate`] is called for a vertex. Usually it is one, and at most three
/// on ordinary surfaces; among needle triangles, two vertices could reduce each other's distance by ever smaller
/// amounts almost endlessly.
const MAX_PROPAGATIONS: u8 = 30;

/// The relative decrease of a vertex's tentative distance below which it counts as rounding error and is ignored.
const MIN_RELATIVE_DECREASE: f64 = 1e-12;

/// Returns the geodesic distance from vertex `from` to every vertex, in the length unit of the mesh; infinite for
/// vertices that are not connected with `from`.
///
/// Exact up to rounding on flat regions, and across folds if the shortest path is unique. On curved surfaces, and where
/// shortest paths from two sides meet, a distance may be up to half an edge too short: on a ball of radius 1 with edges
/// of 0.1, 0.03 at the far end and 0.003 on average. Never shorter than the straight line, nor longer than the shortest
/// path along edges. O(n log n). Indices must be valid, see [`TriangleMesh::validate`].
///
/// # Errors
/// [`MeshError::InvalidArgument`] if there is no vertex `from`.
pub fn geodesic_distances(mesh: &TriangleMesh, from: u32) -> Result<Vec<f64>, MeshError> {
    let vertices = mesh.positions.len();
    if from as usize >= vertices {
        let problem = format!("must be below the number of vertices ({vertices}), got {from}");
        return Err(MeshError::InvalidArgument { parameter: "fromVertex", problem });
    }
    let mut front = Front::new(mesh, &[(from, 0.0)]);
    front.origin = Some(mesh.positions[from as usize].as_dvec3());
    Ok(front.spread(mesh))
}

/// Returns the geodesic distance to every vertex from the nearest of several `sources`: vertices, each with the distance
/// that it has already. Otherwise as [`geodesic_distances`]; the vertices must exist.
pub fn geodesic_distances_from(mesh: &TriangleMesh, sources: &[(u32, f64)]) -> Vec<f64> {
    Front::new(mesh, sources).spread(mesh)
}

/// The state of the propagation in [`geodesic_distances`]: tentative distances from the sources, and a queue of vertices
/// whose distance is to be propagated.
struct Front<'a> {
    positions: &'a [Vec3],
    /// The only source, than whose straight distance no other is shorter.
    origin: Option<DVec3>,
    distances: Vec<f64>,
    /// By vertex, how often its distance has been propagated.
    propagations: Vec<u8>,
    /// The vertices to propagate, nearest first: the distance as bits, which are ordered like the non-negative numbers
    /// they represent, and the vertex index, the lower one first at equal distances. An entry is out of date once the
    /// distance of its vertex has decreased.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

impl<'a> Front<'a> {
    fn new(mesh: &'a TriangleMesh, sources: &[(u32, f64)]) -> Self {
        let positions = mesh.positions.as_slice();
        let mut front = Self {
            positions,
            origin: None,
            distances: vec![f64::INFINITY; positions.len()],
            propagations: vec![0; positions.len()],
            queue: BinaryHeap::new(),
        };
        sources.iter().for_each(|&(v, distance)| front.relax(v as usize, distance));
        front
    }

    /// Propagates all distances, and returns them.
    fn spread(mut self, mesh: &TriangleMesh) -> Vec<f64> {
        let opposite_edges = mesh.opposite_edges();
        while let Some(v) = self.pop() {
            self.propagate(v, opposite_edges.of(v));
        }
        self.distances
    }

    /// Removes the nearest vertex from the queue and returns its index; `None` if the queue is empty. Skips entries
    /// that are out of date, and vertices that have been propagated [`MAX_PROPAGATIONS`] times.
    fn pop(&mut self) -> Option<usize> {
        while let Some(Reverse((bits, v))) = self.queue.pop() {
            let v = v as usize;
            let is_current = self.distances[v].to_bits() == bits;
            if is_current && self.propagations[v] < MAX_PROPAGATIONS {
                self.propagations[v] += 1;
                return Some(v);
            }
        }
        None
    }

    /// Propagates the distance of `v` to the other corners of the triangles around it, the ends of its
    /// `opposite_edges`, and queues those whose distance decreases.
    fn propagate(&mut self, v: usize, opposite_edges: &[[u32; 2]]) {
        for edge in opposite_edges {
            let [a, b] = edge.map(|w| w as usize);
            self.relax(a, self.path_length(v, b, a));
            self.relax(b, self.path_length(v, a, b));
        }
    }

    /// Returns the distance from the sources to vertex `c` by paths along the edges of the triangle `a b c` or through
    /// it, given the distances of `a` and `b`; at least the straight distance from a single source.
    fn path_length(&self, a: usize, b: usize, c: usize) -> f64 {
        let [p, q, r] = [a, b, c].map(|v| self.positions[v].as_dvec3());
        let (to_a, to_b) = (self.distances[a], self.distances[b]);
        let along_edges = (to_a + p.distance(r)).min(to_b + q.distance(r));
        let through = through_edge([to_a, to_b], q - p, r - p);
        // Unfolding a curved surface can underestimate the distance.
        let shortest = self.origin.map_or(0.0, |origin| r.distance(origin));
        through.map_or(along_edges, |d| d.min(along_edges)).max(shortest)
    }

    fn relax(&mut self, v: usize, distance: f64) {
        let old = self.distances[v];
        if distance < old && (old == f64::INFINITY || old - distance > MIN_RELATIVE_DECREASE * old) {
            self.distances[v] = distance;
            self.queue.push(Reverse((distance.to_bits(), v as u32)));
        }
    }
}

/// Returns the distance of the third corner of a triangle from the virtual source: the point in the plane of the
/// triangle, beyond the edge between the two other corners, at the distances `to_a` and `to_b` from the ends of the
/// edge. `None` if there is no such point, or if the straight line from it to the third corner misses the edge.
///
/// `edge` and `spoke` are the vectors from the first end of the edge to its second end and to the third corner.
fn through_edge([to_a, to_b]: [f64; 2], edge: DVec3, spoke: DVec3) -> Option<f64> {
    let base = edge.length();
    let source_x = 0.5 * (base + (to_a - to_b) * ((to_a + to_b) / base));
    let square = (to_a - source_x) * (to_a + source_x);
    // NaN if a distance is infinite or the edge has length 0.
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

#[cfg(test)]
mod tests {
    use super::super::{Mesh, shapes};
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the largest and the mean absolute error of the distances `found` against those `expected`.
    fn off(found: &[f64], expected: impl Iterator<Item = f64>) -> [f64; 2] {
        let off: Vec<f64> = found.iter().zip(expected).map(|(d, e)| (d - e).abs()).collect();
        [off.iter().copied().fold(0.0, f64::max), off.iter().sum::<f64>() / off.len() as f64]
    }

    /// Returns the largest and the mean absolute error of geodesic distances on a ball of radius 1, where they are arcs
    /// of great circles.
    fn off_on_ball(mesh: &TriangleMesh, from: u32) -> [f64; 2] {
        let start = mesh.positions[from as usize].as_dvec3();
        let arc = |p: &Vec3| libm::atan2(start.cross(p.as_dvec3()).length(), start.dot(p.as_dvec3()));
        off(&geodesic_distances(mesh, from).unwrap(), mesh.positions.iter().map(arc))
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

    /// Tests geodesic distances on a ball with triangles of all shapes, many of them obtuse.
    #[test]
    fn great_circles_of_an_uneven_ball() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.1).unwrap().to_triangles();
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            *p = (*p + shift(i as u32) * 0.02).normalize();
        }
        let [largest, mean] = off_on_ball(&mesh, 5);
        assert!(largest < 0.06 && mean < 0.006, "{largest}, {mean}");
    }

    /// Returns a pseudorandom vector with coordinates from −1 to 1, determined by `seed`.
    fn shift(seed: u32) -> Vec3 {
        // Of 16 such series of seeds, two give plates with larger errors if strongly shaken: 0.001 within a face, and
        // 0.013 on the opposite face away from where paths meet.
        let mut random = Random::new(1_000_000 + u64::from(seed));
        Vec3::from_array([(); 3].map(|()| 2.0 * random.unit() as f32 - 1.0))
    }

    /// Returns a closed box from the origin to `size`, each face a grid of `cells` × `cells` squares, inner vertices
    /// shifted within the face by up to `shake` of a cell.
    fn plate(size: Vec3, cells: u32, shake: f32) -> TriangleMesh {
        let mut soup = TriangleMesh::default();
        for [p, q, r, s] in shapes::cuboid_faces(size) {
            let position = |i: u32, j: u32| {
                let is_inner = |k: u32| k > 0 && k < cells;
                let wobble =
                    if is_inner(i) && is_inner(j) { shift(i * 1000 + j) * shake } else { Vec3::ZERO };
                let [x, y] = [i as f32 + wobble.x, j as f32 + wobble.y].map(|c| c / cells as f32);
                p + (q - p) * x + (s - p) * y + (r - q + p - s) * (x * y)
            };
            for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                let corners =
                    [position(i, j), position(i + 1, j), position(i + 1, j + 1), position(i, j + 1)];
                let first = soup.positions.len() as u32;
                soup.positions.extend(corners);
                soup.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| v + first)));
            }
        }
        soup.welded()
    }

    fn vertex_at(mesh: &TriangleMesh, position: Vec3) -> u32 {
        mesh.positions.iter().position(|&p| p.distance(position) < 1e-5).unwrap() as u32
    }

    #[test]
    fn exact_on_the_faces_of_a_plate() {
        for shake in [0.0, 0.2, 0.35] {
            let mesh = plate(Vec3::new(4.0, 4.0, 0.5), 12, shake);
            let found = geodesic_distances(&mesh, vertex_at(&mesh, Vec3::ZERO)).unwrap();
            for (p, d) in mesh.positions.iter().zip(&found) {
                // From a corner, shortest paths are straight on three faces; to the opposite face they cross one of two
                // edges.
                let [x, y, z] = p.as_dvec3().to_array();
                let over = |x: f64, y: f64| (x * x + (y + 0.5) * (y + 0.5)).sqrt();
                let short = match [x, y, z] {
                    [_, _, 0.0] | [_, 0.0, _] | [0.0, _, _] => (x * x + y * y + z * z).sqrt() - d,
                    [x, y, 0.5] => over(x, y).min(over(y, x)) - d,
                    _ => continue,
                };
                // Errors up to half an edge where the two paths meet, small ones around it, none elsewhere.
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
        // Around the tube from the outer equator, and along the inner equator as far as it is the shortest path.
        let found = geodesic_distances(&mesh, 0).unwrap();
        for j in 0..80_u32 {
            let expected = std::f64::consts::TAU * minor * f64::from(j.min(80 - j)) / 80.0;
            assert!((found[j as usize] - expected).abs() < 0.005, "{} for {expected}", found[j as usize]);
        }
        let inner = geodesic_distances(&mesh, 40).unwrap();
        for i in 0..60_u32 {
            let expected = std::f64::consts::TAU * (major - minor) * f64::from(i) / 240.0;
            let found = inner[(i * 80 + 40) as usize];
            assert!((found - expected).abs() < 0.005, "{found} for {expected}");
        }
    }

    /// Returns whether every distance in `found` is at least the straight distance from vertex `from`, and at most the
    /// distance of each neighbour plus the length of the edge between them.
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
            let found = geodesic_distances(&mesh, 3).unwrap();
            assert!(found.iter().all(|d| !d.is_nan()) && found[3] == 0.0);
            assert!(is_between_bounds(&mesh, 3, &found), "{seed}");
        }
        for mesh in [shapes::torus(3.0, 1.0, 50, 20), plate(Vec3::new(5.0, 1.0, 0.01), 9, 0.35)] {
            assert!(is_between_bounds(&mesh, 7, &geodesic_distances(&mesh, 7).unwrap()));
        }
    }

    #[test]
    fn needles_end_in_bounded_work() {
        let mut mesh = shapes::torus(1.0, 0.5, 120, 60);
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            *p = Vec3::new(p.x * 1e3, p.y, p.z * 1e-2) + shift(i as u32) * 0.04;
        }
        let found = geodesic_distances(&mesh, 0).unwrap();
        assert!(is_between_bounds(&mesh, 0, &found));
    }

    #[test]
    fn other_components_are_infinitely_far() {
        let mesh = shapes::joined(&[shapes::icosahedron(), shapes::cuboid(Vec3::splat(9.0))]);
        let found = geodesic_distances(&mesh, 13).unwrap();
        assert!(found[..12].iter().all(|&d| d == f64::INFINITY));
        assert!(found[12..].iter().all(|&d| d < 30.0));
    }

    #[test]
    fn no_such_vertex() {
        for (mesh, from) in [(shapes::icosahedron(), 12), (TriangleMesh::default(), 0)] {
            let refusal = geodesic_distances(&mesh, from).unwrap_err();
            assert!(matches!(refusal, MeshError::InvalidArgument { parameter: "fromVertex", .. }));
        }
    }
}
