//! Distances of all points of a lattice from a surface.

use crate::math::{Bounds, BoxTree, DAffine3, DVec3, Vec3, triangle};
use crate::mesh::{MeshError, TriangleMesh};

/// Writes to `out` the unsigned distance of each point of a lattice from the surface of a mesh, in the length unit of
/// the mesh, x fastest: `map` leads from lattice indices to the space of the mesh, `dims` are the numbers of points.
/// Points beyond `out` are ignored.
///
/// Exact but for rounding. Each search begins with the distance of the triangle that is closest to the point before.
///
/// # Errors
/// [`MeshError::InvalidArgument`] (parameter `mesh`) if the mesh has no triangle; as [`TriangleMesh::validate`].
pub fn lattice_distances(
    mesh: &TriangleMesh,
    map: &DAffine3,
    dims: [usize; 3],
    out: &mut [f32],
) -> Result<(), MeshError> {
    if mesh.triangles.is_empty() {
        let problem = "must have triangles for distances, got none".to_owned();
        return Err(MeshError::InvalidArgument { parameter: "mesh", problem });
    }
    let tree = CylinderTree::new(mesh)?;
    let mut first = 0;
    for (row, distances) in out.chunks_mut(dims[0]).enumerate() {
        let (y, z) = (row % dims[1], row / dims[1]);
        let mut closest = first;
        for (x, out) in distances.iter_mut().enumerate() {
            let p = map.transform_point3(DVec3::new(x as f64, y as f64, z as f64));
            let squared;
            (closest, squared) = tree.closest(p, closest);
            *out = (squared.sqrt() as f32).min(f32::MAX);
            if x == 0 {
                first = closest;
            }
        }
    }
    Ok(())
}

/// A bounding volume hierarchy of triangles in which each node has a flat cylinder besides its box, along the mean
/// normal of its triangles.
///
/// Boxes alone do not tell which of many triangles at nearly the same distance is the closest, as in the middle of a
/// ball, where searches would visit hundreds of triangles. Cylinders around flat pieces of a surface are thin.
struct CylinderTree {
    boxes: BoxTree,
    cylinders: Vec<Cylinder>,
    corners: Vec<[Vec3; 3]>,
}

/// A solid cylinder.
#[derive(Clone, Copy)]
struct Cylinder {
    centre: DVec3,
    /// Unit vector along the axis.
    axis: DVec3,
    radius: f64,
    /// Half of the length along the axis.
    half_height: f64,
}

impl Cylinder {
    /// Returns a cylinder along the mean normal of triangles that contains these; `bounds` is their bounding box.
    fn around(bounds: &Bounds, triangles: impl Iterator<Item = [Vec3; 3]> + Clone) -> Self {
        let sum = triangles.clone().fold(DVec3::ZERO, |sum, corners| sum + triangle::area_vector(corners));
        // Without a mean normal any direction will do.
        let axis = sum.try_normalize().unwrap_or(DVec3::X);
        let middle = 0.5 * (bounds.min.as_dvec3() + bounds.max.as_dvec3());
        let (mut low, mut high, mut radius) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for q in triangles.flatten().map(|p| p.as_dvec3() - middle) {
            let along = axis.dot(q);
            let across = (q - axis * along).length();
            low = if along < low { along } else { low };
            high = if along > high { along } else { high };
            radius = if across > radius { across } else { radius };
        }
        Self { centre: middle + axis * (0.5 * (low + high)), axis, radius, half_height: 0.5 * (high - low) }
    }

    /// Returns the squared distance from `p` to the cylinder, zero inside.
    #[inline]
    fn distance_squared(&self, p: DVec3) -> f64 {
        let q = p - self.centre;
        let along = self.axis.dot(q);
        let beyond = along.abs() - self.half_height;
        let mut squared = if beyond > 0.0 { beyond * beyond } else { 0.0 };
        let across = q.length_squared() - along * along;
        if across > self.radius * self.radius {
            let beyond = across.sqrt() - self.radius;
            squared += beyond * beyond;
        }
        squared
    }
}

impl CylinderTree {
    fn new(mesh: &TriangleMesh) -> Result<Self, MeshError> {
        mesh.validate()?;
        let corners: Vec<_> = mesh.corners().collect();
        let bounds: Vec<_> = corners.iter().map(|c| Bounds::from_points(c)).collect();
        let boxes = BoxTree::new(&bounds);
        let cylinder = |node| {
            Cylinder::around(
                boxes.node_bounds(node),
                boxes.node_items(node).iter().map(|(_, t)| corners[*t as usize]),
            )
        };
        let cylinders = (0..boxes.node_count()).map(cylinder).collect();
        Ok(Self { boxes, cylinders, corners })
    }

    /// Returns a lower bound of the squared distance from `p` to the triangles of a node; `None` if it is above
    /// `bound`.
    #[inline]
    fn node_distance(&self, node: usize, p: DVec3, bound: f64) -> Option<f64> {
        let from_cylinder = self.cylinders[node].distance_squared(p);
        if from_cylinder > bound {
            return None;
        }
        let from_box = self.boxes.node_bounds(node).distance_squared_f64(p);
        Some(if from_cylinder > from_box { from_cylinder } else { from_box })
    }

    /// Returns the closest triangle to `p` and its squared distance, `guess` if no other triangle is closer.
    fn closest(&self, p: DVec3, guess: usize) -> (usize, f64) {
        let mut best = (guess, triangle::distance_squared(self.corners[guess], p));
        self.boxes.nearest_by_node(
            best.1,
            |node, bound| self.node_distance(node, p, bound),
            |t| {
                let squared = triangle::distance_squared(self.corners[t as usize], p);
                if squared < best.1 {
                    best = (t as usize, squared);
                }
                best.1
            },
        );
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, joined, soup, torus};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn distances_are_those_of_brute_force() {
        let mut random = Random::new(6);
        let mut unit = || 2.0 * random.unit() - 1.0;
        let ball = Mesh::icosphere(Vec3::splat(1.0), 3.0, 1.0).unwrap().to_triangles();
        // Flat, with triangles that have no area and with two layers.
        let flat = joined(&[cuboid(Vec3::new(2.0, 3.0, 0.0)), cuboid(Vec3::ZERO), cuboid(Vec3::X)]);
        for mesh in [ball, torus(3.0, 1.0, 14, 8), soup(4, 60, 5), flat] {
            for scale in [1.0, 0.3, 3.0] {
                let columns = [(); 3].map(|()| DVec3::new(unit(), unit(), unit()) * scale);
                let dims = [7, 6, 5];
                let mut map =
                    DAffine3::from_mat3(crate::math::DMat3::from_cols(columns[0], columns[1], columns[2]));
                map.translation =
                    DVec3::new(unit(), unit(), unit()) - map.transform_vector3(DVec3::splat(3.0));
                let mut found = vec![0.0; 7 * 6 * 5];
                lattice_distances(&mesh, &map, dims, &mut found).unwrap();
                for (i, &found) in found.iter().enumerate() {
                    let p =
                        map.transform_point3(DVec3::new((i % 7) as f64, (i / 7 % 6) as f64, (i / 42) as f64));
                    let all = mesh.corners().map(|corners| triangle::distance_squared(corners, p));
                    let expected = all.fold(f64::INFINITY, f64::min).sqrt();
                    assert!(
                        (f64::from(found) - expected).abs() <= 1e-6 * (1.0 + expected),
                        "voxel {i}: {found}, not {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_middle_of_a_ball_needs_few_triangles() {
        let ball = Mesh::icosphere(Vec3::ZERO, 1.0, 0.04).unwrap().to_triangles();
        let tree = CylinderTree::new(&ball).unwrap();
        let p = DVec3::new(0.05, 0.02, -0.03);
        let (guess, _) = tree.closest(p * 1.1, 0);
        let visited = std::cell::Cell::new(0);
        let mut best = triangle::distance_squared(tree.corners[guess], p);
        tree.boxes.nearest_by_node(
            best,
            |node, bound| {
                visited.set(visited.get() + 1);
                tree.node_distance(node, p, bound)
            },
            |t| {
                best = best.min(triangle::distance_squared(tree.corners[t as usize], p));
                best
            },
        );
        assert!(visited.get() < tree.cylinders.len() / 20, "{} of {}", visited.get(), tree.cylinders.len());
    }

    #[test]
    fn a_mesh_without_triangles_is_refused() {
        let found = lattice_distances(&TriangleMesh::default(), &DAffine3::IDENTITY, [1; 3], &mut [0.0]);
        assert!(matches!(found, Err(MeshError::InvalidArgument { parameter: "mesh", .. })));
    }
}
