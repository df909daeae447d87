//! Connected components of a triangle list, connected through vertices, and the volumes they enclose.

use super::TriangleMesh;
use super::disjoint_sets::DisjointSets;
use crate::math::DVec3;

impl TriangleMesh {
    /// Returns the mesh without the connected components that enclose a volume below `volume`, in the cubed length unit
    /// of the mesh, whether their triangles face outwards or inwards.
    ///
    /// Components are connected through vertices. Cavities are not subtracted from the surface around them, so a small
    /// shell is removed together with its cavity, and a small cavity in a larger solid is filled. Only positions and
    /// triangles are kept.
    pub fn without_components_below(&self, volume: f64) -> Self {
        let component_of = self.component_of_each_vertex();
        let enclosed = self.enclosed_volumes(&component_of);
        self.components_where(|v| enclosed[component_of[v as usize] as usize].abs() >= volume)
    }

    /// Appends the positions and triangles of another mesh, as separate components; normals, colours and texture of it
    /// are ignored.
    pub(crate) fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|v| v + first)));
    }

    /// Returns the triangles whose first vertex satisfies `keeps`, with the vertices they use: whole connected
    /// components if `keeps` has the same value for all vertices of one. Only positions and triangles are kept.
    pub(crate) fn components_where(&self, mut keeps: impl FnMut(u32) -> bool) -> Self {
        let mut slots = vec![u32::MAX; self.positions.len()];
        let mut kept = Self::default();
        // As large as what they come from, without growing past it.
        kept.positions.reserve_exact(self.positions.len());
        kept.triangles.reserve_exact(self.triangles.len());
        for triangle in self.triangles.iter().filter(|t| keeps(t[0])) {
            kept.triangles.push(triangle.map(|v| {
                let slot = &mut slots[v as usize];
                if *slot == u32::MAX {
                    *slot = kept.positions.len() as u32;
                    kept.positions.push(self.positions[v as usize]);
                }
                *slot
            }));
        }
        kept
    }

    /// Returns for each vertex the lowest vertex index of its connected component, which identifies the component.
    pub(crate) fn component_of_each_vertex(&self) -> Vec<u32> {
        let mut groups = DisjointSets::new(self.positions.len());
        for [a, b, c] in &self.triangles {
            groups.union(*a as usize, *b as usize);
            groups.union(*b as usize, *c as usize);
        }
        (0..self.positions.len()).map(|v| groups.find(v) as u32).collect()
    }

    /// Returns the signed volume of each connected component, positive if its triangles face outwards, at the lowest
    /// vertex index of the component, and 0 at other indices. `component_of` is that index by vertex.
    pub(crate) fn enclosed_volumes(&self, component_of: &[u32]) -> Vec<f64> {
        let mut volumes = vec![0.0; self.positions.len()];
        for triangle in &self.triangles {
            let component = component_of[triangle[0] as usize] as usize;
            let origin = self.positions[component].as_dvec3();
            let [a, b, c]: [DVec3; 3] = triangle.map(|v| self.positions[v as usize].as_dvec3() - origin);
            volumes[component] += a.dot(b.cross(c)) / 6.0;
        }
        volumes
    }
}

#[cfg(test)]
mod tests {
    use crate::math::Vec3;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::joined;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn small_components_are_removed_whatever_their_orientation() {
        let ball = |at: Vec3, radius: f32| Mesh::icosphere(at, radius, 0.5).unwrap().to_triangles();
        let mut hollow = ball(Vec3::ZERO, 0.9);
        hollow.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let all = joined(&[ball(Vec3::ZERO, 3.0), hollow, ball(Vec3::X * 9.0, 1.1)]);
        assert_eq!(all.without_components_below(1.0).components().len(), 3);
        let kept = all.without_components_below(3.5);
        assert_eq!(kept.components().len(), 2);
        assert!(kept.positions.iter().all(|p| p.length() > 2.9 || p.x > 5.0));
        assert!(all.without_components_below(1000.0).triangles.is_empty());
    }
}
