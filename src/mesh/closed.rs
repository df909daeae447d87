//! The condition for a triangle list to have winding numbers.

use super::{MeshError, TriangleMesh};
use crate::math::Groups;
use crate::math::order::sort_ranks;

impl TriangleMesh {
    /// Checks that the mesh is valid and closed: that equally many triangles traverse each edge in both directions, so
    /// that every point that is not on the surface has a winding number. Surfaces may intersect and touch themselves,
    /// also along edges and at vertices; a mesh without triangles is closed.
    ///
    /// # Errors
    /// [`MeshError::NotClosed`], which names an edge; as [`Self::validate`].
    pub fn check_closed(&self) -> Result<(), MeshError> {
        self.validate()?;
        let edges = self.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        // The higher end, and in the lowest bit whether the triangle traverses the edge towards it.
        let half_edges = edges.map(|(from, to)| {
            let (low, high) = if from < to { (from, to) } else { (to, from) };
            (low, u64::from(high) << 1 | u64::from(from < to))
        });
        let by_lower_end = Groups::new(self.positions.len(), half_edges);
        let mut at_vertex = Vec::new();
        for v in 0..self.positions.len() {
            at_vertex.clear();
            at_vertex.extend_from_slice(by_lower_end.of(v));
            check_balance(v, &mut at_vertex)?;
        }
        Ok(())
    }
}

/// Checks that the half-edges at vertex `v`, each the other end and a bit for the direction, come in equal numbers of
/// both directions.
fn check_balance(v: usize, half_edges: &mut [u64]) -> Result<(), MeshError> {
    sort_ranks(half_edges);
    for edge in half_edges.chunk_by(|a, b| a >> 1 == b >> 1) {
        let (other, forward) = ((edge[0] >> 1) as usize, edge.iter().filter(|half| *half & 1 == 1).count());
        // A triangle with two equal corners has an edge from a vertex to itself.
        if 2 * forward != edge.len() && other != v {
            let problem = format!(
                "a boundary, or inconsistent orientation, at the edge between vertices {v} and {other}"
            );
            return Err(MeshError::NotClosed { problem });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{cuboid, icosahedron, joined, torus};
    use super::*;
    use crate::math::Vec3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn surfaces_that_touch_or_intersect_are_closed() {
        let mut doubled = joined(&[icosahedron(), cuboid(Vec3::ONE)]);
        doubled.triangles.extend(doubled.triangles.clone());
        doubled.triangles.extend([[0, 0, 5], [3, 4, 3], [7, 7, 7]]);
        for mesh in [doubled, torus(3.0, 1.0, 5, 4), TriangleMesh::default()] {
            mesh.check_closed().unwrap();
        }
    }

    #[test]
    fn holes_and_flipped_triangles_are_found() {
        let problem = |mesh: &TriangleMesh| match mesh.check_closed() {
            Err(MeshError::NotClosed { problem }) => problem,
            other => panic!("{other:?}"),
        };
        for t in 0..12 {
            let mut open = cuboid(Vec3::ONE);
            let [a, b, c] = open.triangles.remove(t);
            let found = problem(&open);
            assert!([a, b, c].iter().any(|v| found.contains(&format!(" {v}"))), "{found}");
            let mut flipped = cuboid(Vec3::ONE);
            flipped.triangles[t].swap(0, 1);
            problem(&flipped);
        }
        // A triangle for which the numbers of both directions agree in sum, but at no edge.
        problem(&TriangleMesh { triangles: vec![[0, 1, 2]], ..cuboid(Vec3::ONE) });
        let invalid = TriangleMesh { triangles: vec![[0, 1, 8]], ..cuboid(Vec3::ONE) };
        assert!(matches!(
            invalid.check_closed(),
            Err(MeshError::InvalidArgument { parameter: "indices", .. })
        ));
    }
}
