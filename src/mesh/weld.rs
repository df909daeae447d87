//! Vertex welding: merges vertices at the same position, which files often repeat per triangle or along texture seams.

use super::TriangleMesh;
use crate::math::{PositionIndex, Vec2, Vec3};

impl TriangleMesh {
    /// Returns the mesh with vertices at exactly the same position merged (−0 equals 0), numbered in the order of their
    /// first use by a triangle.
    ///
    /// Triangles with two equal corners and unused vertices are dropped. Normals and colours of merged vertices are
    /// averaged; if their texture coordinates differ, they become `corner_uvs`. Indices must be valid, see
    /// [`TriangleMesh::validate`].
    pub fn welded(&self) -> Self {
        let representatives = self.representatives();
        let mut slots = vec![u32::MAX; self.positions.len()];
        let (mut vertices, mut triangles, mut kept) = (Vec::new(), Vec::new(), Vec::new());
        for (at, triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|v| representatives[v as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            kept.push(at);
            triangles.push([a, b, c].map(|v| slot(&mut slots, &mut vertices, v)));
        }
        let mut welded = Self { triangles, ..self.vertex_subset(&vertices) };
        let targets: Vec<u32> = representatives.iter().map(|&v| slots[v]).collect();
        welded.normals = self.normals.as_ref().map(|n| normalized(means(n, &targets, vertices.len())));
        welded.colors = self.colors.as_ref().map(|c| means(c, &targets, vertices.len()));
        self.weld_uvs(&kept, &mut welded);
        welded
    }

    /// Returns for each vertex the lowest index of a vertex at exactly the same position.
    fn representatives(&self) -> Vec<usize> {
        let mut representatives = vec![0; self.positions.len()];
        for equal in PositionIndex::new(&self.positions).distinct() {
            let lowest = equal.clone().next().map_or(0, |v| v as usize);
            equal.for_each(|v| representatives[v as usize] = lowest);
        }
        representatives
    }

    /// Sets the texture coordinates of `welded`, whose triangles are the triangles `kept` of `self`: per vertex if each
    /// vertex has only one, else per corner.
    fn weld_uvs(&self, kept: &[usize], welded: &mut Self) {
        let corner_uvs: Vec<[Vec2; 3]> = match (&self.corner_uvs, &self.uvs) {
            (Some(corners), _) => kept.iter().map(|&t| corners[t]).collect(),
            (None, Some(uvs)) => kept.iter().map(|&t| self.triangles[t].map(|v| uvs[v as usize])).collect(),
            (None, None) => return,
        };
        let mut uvs = vec![Vec2::ZERO; welded.positions.len()];
        let corners = || welded.triangles.as_flattened().iter().zip(corner_uvs.as_flattened());
        corners().for_each(|(&v, &uv)| uvs[v as usize] = uv);
        let seamless = corners().all(|(&v, &uv)| uvs[v as usize] == uv);
        welded.uvs = seamless.then_some(uvs);
        welded.corner_uvs = (!seamless).then_some(corner_uvs);
    }
}

/// Returns the index of vertex `v` in the welded mesh, assigned on first use: `slots` is that index by vertex, or
/// `u32::MAX`, and `vertices` are the vertices with an index, in order.
fn slot(slots: &mut [u32], vertices: &mut Vec<usize>, v: usize) -> u32 {
    if slots[v] == u32::MAX {
        slots[v] = vertices.len() as u32;
        vertices.push(v);
    }
    slots[v]
}

/// Returns the mean of the values of the vertices that are merged into each of `count` new ones; `targets` is the new
/// vertex of each old one, or `u32::MAX` for none.
fn means(values: &[Vec3], targets: &[u32], count: usize) -> Vec<Vec3> {
    let mut sums = vec![(Vec3::ZERO, 0.0_f32); count];
    for (&value, &target) in values.iter().zip(targets) {
        if let Some((sum, weight)) = sums.get_mut(target as usize) {
            *sum += value;
            *weight += 1.0;
        }
    }
    sums.into_iter().map(|(sum, weight)| sum / weight).collect()
}

fn normalized(normals: Vec<Vec3>) -> Vec<Vec3> {
    normals.into_iter().map(|n| n.normalize_or_zero()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{report, shapes};
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the mesh with three separate vertices for each triangle, for tests of welding.
    fn soup(mesh: &TriangleMesh) -> TriangleMesh {
        let positions: Vec<Vec3> = mesh.corners().flatten().collect();
        let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh { positions, triangles, ..Default::default() }
    }

    #[test]
    fn a_soup_closes() {
        let torus = shapes::torus(2.0, 0.5, 9, 7);
        let mut apart = soup(&torus);
        apart.positions.push(Vec3::ONE);
        apart.triangles.push([0, 0, 5]);
        assert!(!report(&apart).unwrap().closed);
        let welded = apart.welded();
        assert_eq!((welded.positions.len(), welded.triangles.len()), (63, 126));
        assert!(report(&welded).unwrap().is_healthy());
        assert_eq!(welded.welded(), welded);
    }

    #[test]
    fn zeros_of_both_signs_are_one_place() {
        let mut apart = soup(&shapes::cuboid(Vec3::ONE));
        apart.positions.iter_mut().step_by(2).for_each(|p| *p = *p * 1.0 + Vec3::splat(-0.0));
        apart.positions.iter_mut().skip(1).step_by(2).for_each(|p| *p = -(-*p - Vec3::ZERO));
        assert_eq!(apart.welded().positions.len(), 8);
    }

    #[test]
    fn seams_go_to_the_corners_and_back() {
        let mut apart = soup(&shapes::cuboid(Vec3::ONE));
        apart.uvs = Some((0..36).map(|i| Vec2::new(i as f32, 0.5)).collect());
        let welded = apart.welded();
        welded.validate().unwrap();
        assert_eq!((welded.positions.len(), &welded.uvs), (8, &None));
        assert_eq!(welded.corner_uvs.as_ref().unwrap()[1][2], Vec2::new(5.0, 0.5));
        let split = welded.split_at_seams();
        split.validate().unwrap();
        assert_eq!((split.positions.len(), split.uvs.as_ref().unwrap().len()), (36, 36));
        assert_eq!(split.welded(), welded);
    }

    #[test]
    fn seamless_uvs_stay_per_vertex_and_means_are_taken() {
        let mut apart = soup(&shapes::cuboid(Vec3::ONE));
        apart.uvs = Some(apart.positions.iter().map(|p| Vec2::new(p.x, p.y)).collect());
        apart.normals = Some(apart.corners().flat_map(|[a, b, c]| [(b - a).cross(c - a); 3]).collect());
        apart.colors = Some((0..36).map(|i| Vec3::splat((i % 2) as f32)).collect());
        let welded = apart.welded();
        assert_eq!(welded.corner_uvs, None);
        for (uv, p) in welded.uvs.unwrap().iter().zip(&welded.positions) {
            assert_eq!(*uv, Vec2::new(p.x, p.y));
        }
        for (n, p) in welded.normals.unwrap().iter().zip(&welded.positions) {
            assert!(n.is_normalized() && n.dot(*p - 0.5) > 0.7);
        }
        assert!(welded.colors.unwrap().iter().all(|c| c.x >= 0.0 && c.x <= 1.0));
    }
}
