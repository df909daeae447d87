//! Closest points on a closed surface, found by walking from a nearby triangle (Kobbelt, Bareuther & Seidel,
//! *Multiresolution shape deformations for meshes with dynamic vertex connectivity*, section 8).

use super::{SurfacePoint, TriangleTree};
use crate::math::{DVec3, Groups, Vec3, triangle};
use crate::mesh::{MeshError, TriangleMesh};
use crate::pauses::Pauses;
use std::cell::OnceCell;

/// A static closed surface onto which many points are projected, each by a walk from the triangle of a nearby
/// projection; the multiresolution model carries points along its base with it.
///
/// A walk proceeds to adjacent triangles as long as they are closer, so it ends at a local minimum of the distance. If
/// this may not be the global minimum, use [`Self::closest`], which queries a tree that is built on first use.
#[derive(Clone, Debug)]
pub struct SurfaceWalker {
    mesh: TriangleMesh,
    /// For each triangle, the indices of its three adjacent triangles, each across the edge opposite the corner of the
    /// same number.
    across: Vec<[u32; 3]>,
    tree: OnceCell<TriangleTree>,
}

impl SurfaceWalker {
    /// Creates a walker on a closed, oriented manifold mesh.
    ///
    /// # Errors
    /// As [`TriangleMesh::validate`]; [`MeshError::NotClosed`] if an edge has a triangle on one side only, or two of
    /// inconsistent orientation.
    pub fn new(mesh: TriangleMesh) -> Result<Self, MeshError> {
        mesh.validate()?;
        let across = neighbours(&mesh)?;
        Ok(Self { mesh, across, tree: OnceCell::new() })
    }

    /// Builds the tree of [`Self::tree`], and pauses meanwhile.
    pub async fn build_tree(&self, pauses: &Pauses) {
        if let Ok(tree) = TriangleTree::in_slices(&self.mesh, pauses).await {
            self.tree.get_or_init(|| tree);
        }
    }

    /// Returns the mesh that is walked over, as passed to [`Self::new`].
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Returns the corner positions of the triangle with the index `triangle`.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|v| self.mesh.positions[v as usize])
    }

    /// Interpolates values given per vertex at a point of the surface, by its barycentric coordinates.
    #[inline]
    pub fn blend(&self, values: &[Vec3], at: &SurfacePoint) -> Vec3 {
        let [a, b, c] = self.mesh.triangles[at.triangle as usize].map(|v| values[v as usize]);
        a * at.barycentric.x + b * at.barycentric.y + c * at.barycentric.z
    }

    /// Returns the closest point to `p` on the whole surface, by a tree query; `None` if `p` is not finite or there are
    /// no triangles.
    pub fn closest(&self, p: Vec3) -> Option<SurfacePoint> {
        self.tree().closest(p)
    }

    /// Returns the bounding volume hierarchy of the triangles, built on first use.
    pub fn tree(&self) -> &TriangleTree {
        // This cannot fail: `new` has validated the mesh.
        self.tree.get_or_init(|| TriangleTree::new(&self.mesh).unwrap_or_else(|_| TriangleTree::empty()))
    }

    /// Returns the closest point to `p` by testing every triangle, for a single query without building the tree; `None`
    /// if `p` is not finite or there are no triangles.
    pub fn closest_brute_force(&self, p: Vec3) -> Option<SurfacePoint> {
        let found = |t: u32| self.nearest_on(t, p);
        (0..self.mesh.triangles.len() as u32)
            .map(found)
            .min_by(|a, b| a.square.total_cmp(&b.square))
            .filter(|found| found.square.is_finite())
            .map(|found| self.point(&found))
    }

    /// Returns the point of the surface at which a walk from the triangle with the index `start` towards `p` ends: a
    /// local minimum of the distance to `p`, usually the closest point.
    pub fn walk(&self, start: u32, p: Vec3) -> SurfacePoint {
        let mut here = self.nearest_on(start, p);
        while let Some(next) = self.step(&here, p) {
            here = next;
        }
        self.point(&here)
    }

    /// Makes one step of a walk: returns the closest point to `p` on the triangles that share the edge or corner on
    /// which `here` lies; `None` if it is not strictly closer than `here`, or if `here` lies inside a triangle.
    fn step(&self, here: &TrianglePoint, p: Vec3) -> Option<TrianglePoint> {
        let weights = here.barycentric.to_array();
        let zeros = weights.iter().filter(|&&weight| weight == 0.0).count();
        let best = match zeros {
            0 => return None,
            1 => {
                let k = weights.iter().position(|&weight| weight == 0.0)?;
                self.nearest_on(self.across[here.triangle as usize][k], p)
            }
            _ => self.nearest_around(here.triangle, weights.iter().position(|&weight| weight > 0.0)?, p),
        };
        // Strictly closer, so that the walk terminates.
        (best.square < here.square).then_some(best)
    }

    /// Returns the closest point to `p` on all triangles around one corner (0 to 2) of the triangle with the index
    /// `start`.
    fn nearest_around(&self, start: u32, corner: usize, p: Vec3) -> TrianglePoint {
        let hub = self.mesh.triangles[start as usize][corner];
        let mut best = self.nearest_on(start, p);
        let (mut t, mut k) = (start, corner);
        // Bounded, in case the mesh is not a manifold.
        for _ in 0..self.across.len() {
            // Cross the edge from the centre to the next corner.
            t = self.across[t as usize][(k + 2) % 3];
            if t == start {
                break;
            }
            k = self.mesh.triangles[t as usize].iter().position(|&v| v == hub).unwrap_or(0);
            let found = self.nearest_on(t, p);
            if found.square < best.square {
                best = found;
            }
        }
        best
    }

    #[inline]
    fn nearest_on(&self, triangle: u32, p: Vec3) -> TrianglePoint {
        let corners = self.corners(triangle);
        let barycentric = triangle::closest_barycentric(corners, p);
        let square = triangle::point_at(corners, barycentric).distance_squared(p.as_dvec3());
        TrianglePoint { triangle, barycentric, square }
    }

    fn point(&self, found: &TrianglePoint) -> SurfacePoint {
        SurfacePoint {
            triangle: found.triangle,
            barycentric: found.barycentric.as_vec3(),
            point: triangle::point_at(self.corners(found.triangle), found.barycentric).as_vec3(),
            distance: found.square.sqrt(),
        }
    }
}

/// The point of one triangle that is closest to a query point.
#[derive(Clone, Copy, Debug)]
struct TrianglePoint {
    triangle: u32,
    barycentric: DVec3,
    /// The squared distance from the query point.
    square: f64,
}

/// Returns for each triangle the indices of its three adjacent triangles, each across the edge opposite the corner of
/// the same number.
///
/// # Errors
/// [`MeshError::NotClosed`] if there is no triangle across an edge.
fn neighbours(mesh: &TriangleMesh) -> Result<Vec<[u32; 3]>, MeshError> {
    let sides = |(&[a, b, c], t): (&[u32; 3], u32)| [(a, (b, t)), (b, (c, t)), (c, (a, t))];
    let half_edges = Groups::new(mesh.positions.len(), mesh.triangles.iter().zip(0..).flat_map(sides));
    let across =
        |from: u32, to: u32| half_edges.of(from as usize).iter().find(|side| side.0 == to).map(|side| side.1);
    let all = mesh.triangles.iter().map(|&[a, b, c]| {
        let beyond = [across(c, b), across(a, c), across(b, a)];
        let [Some(x), Some(y), Some(z)] = beyond else {
            let problem = format!("triangle {:?} has a boundary edge", [a, b, c]);
            return Err(MeshError::NotClosed { problem });
        };
        Ok([x, y, z])
    });
    all.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::mesh::Mesh;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn ball() -> SurfaceWalker {
        SurfaceWalker::new(Mesh::icosphere(Vec3::new(1.0, 2.0, 3.0), 2.0, 0.2).unwrap().to_triangles())
            .unwrap()
    }

    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn walks_on_a_ball_end_at_the_closest_point() {
        let walker = ball();
        let mut random = Random::new(5);
        for start in (0..walker.mesh().triangles.len() as u32).step_by(3) {
            let direction = Vec3::from_array(std::array::from_fn(|_| random.unit() as f32 - 0.5));
            let p = Vec3::new(1.0, 2.0, 3.0) + direction.normalize() * 2.5;
            let (found, expected) = (walker.walk(start, p), walker.closest(p).unwrap());
            assert!((found.distance - expected.distance).abs() < 1e-6, "{start}");
            assert_eq!(walker.closest_brute_force(p), Some(expected));
            let again = walker.blend(&walker.mesh().positions, &found);
            assert!(again.distance(found.point) < 1e-5);
        }
    }

    #[test]
    fn it_ends_on_edges_and_at_corners() {
        let cube = crate::mesh::Mesh::icosahedron(Vec3::ZERO, 1.0).to_triangles();
        let walker = SurfaceWalker::new(cube.clone()).unwrap();
        for start in 0..20 {
            for &corner in &cube.positions {
                assert!(walker.walk(start, corner * 3.0).point.distance(corner) < 1e-6);
            }
            let [a, b, _] = walker.corners(7);
            let middle = (a + b) * 0.5;
            assert!(walker.walk(start, middle * 3.0).point.distance(middle) < 1e-6);
        }
    }

    #[test]
    fn an_open_surface_is_refused() {
        let mut open = Mesh::icosahedron(Vec3::ZERO, 1.0).to_triangles();
        open.triangles.pop();
        assert!(matches!(SurfaceWalker::new(open), Err(MeshError::NotClosed { .. })));
    }
}
