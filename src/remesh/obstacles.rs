//! What new triangles may not touch: the rest of the surface, found through a tree of boxes that follows the edits.

use crate::math::{Bounds, Vec3};
use crate::mesh::{Facet, Mesh, VertexId, facets_cross};

/// The stars of all vertices by where they are: a balanced tree of boxes over the vertices in the order of a space-filling
/// curve.
///
/// The box of a vertex holds all triangles around it. The tree keeps its form while vertices go, so an edit costs
/// O(log n); it is meant for passes that make a mesh coarser.
pub(super) struct Obstacles {
    /// A heap: the children of node i are 2i and 2i + 1, the leaves are the last half.
    nodes: Vec<Bounds>,
    /// The leaf of each vertex slot, counted from the first leaf.
    leaves: Vec<u32>,
    /// The vertex of each leaf.
    vertices: Vec<VertexId>,
    /// Pairs of a box and a triangle that may still be compared; see [`Self::is_exhausted`].
    work_left: u64,
    stack: Vec<u32>,
}

impl Obstacles {
    /// The stars of `mesh`, for looking at `work` pairs.
    pub fn new(mesh: &Mesh, work: u64) -> Self {
        let vertices = along_a_curve(mesh);
        let first_leaf = vertices.len().next_power_of_two();
        let mut leaves = vec![0; mesh.slots()];
        let mut nodes = vec![Bounds::EMPTY; 2 * first_leaf];
        for (leaf, &v) in vertices.iter().enumerate() {
            leaves[v.index()] = leaf as u32;
            nodes[first_leaf + leaf] = star(mesh, v);
        }
        for i in (1..first_leaf).rev() {
            nodes[i] = nodes[2 * i].joined(&nodes[2 * i + 1]);
        }
        Self { nodes, leaves, vertices, work_left: work, stack: Vec::new() }
    }

    /// Whether the triangles `fresh` share more than common corners and edges with each other, or with those triangles
    /// of `mesh` that have no corner in `replaced`; exact, touching included.
    ///
    /// `mesh` is still as it was before the edit, and the vertices in `replaced` are those whose stars `fresh` would stand
    /// in for.
    pub fn crosses(&mut self, mesh: &Mesh, fresh: &[Facet], replaced: &[VertexId]) -> bool {
        let boxes: Vec<Bounds> = fresh.iter().map(|facet| Bounds::of(&facet.points)).collect();
        if cross_each_other(fresh, &boxes) {
            return true;
        }
        let around = boxes.iter().fold(Bounds::EMPTY, |all, one| all.joined(one));
        self.stack.clear();
        self.stack.push(1);
        while let Some(i) = self.stack.pop() {
            self.work_left = self.work_left.saturating_sub(1);
            if !self.nodes[i as usize].meets(&around) {
                continue;
            }
            match (i as usize).checked_sub(self.nodes.len() / 2) {
                None => self.stack.extend([2 * i, 2 * i + 1]),
                Some(leaf) => {
                    let v = self.vertices[leaf];
                    if !replaced.contains(&v)
                        && self.star_crosses(mesh, v, replaced, (fresh, &boxes, &around))
                    {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Whether one of the triangles of which `v` is the lowest corner, none of them in `replaced`, crosses a fresh one.
    fn star_crosses(
        &mut self,
        mesh: &Mesh,
        v: VertexId,
        replaced: &[VertexId],
        (fresh, boxes, around): (&[Facet], &[Bounds], &Bounds),
    ) -> bool {
        for (a, b) in mesh.ring(v).pairs().filter(|&(a, b)| v < a && v < b) {
            let other = facet(mesh, [v, a, b]);
            let bounds = Bounds::of(&other.points);
            if !bounds.meets(around) || replaced.contains(&a) || replaced.contains(&b) {
                continue;
            }
            self.work_left = self.work_left.saturating_sub(fresh.len() as u64);
            if fresh.iter().zip(boxes).any(|(f, near)| near.meets(&bounds) && facets_cross(f, &other)) {
                return true;
            }
        }
        false
    }

    /// Whether more was looked at than was allowed. Triangles whose boxes all meet make work quadratic in their number.
    pub fn is_exhausted(&self) -> bool {
        self.work_left == 0
    }

    /// Takes over that `gone` is gone and that the triangles around `centre` are new.
    pub fn follow(&mut self, mesh: &Mesh, centre: VertexId, gone: VertexId) {
        self.set(gone, Bounds::EMPTY);
        self.set(centre, star(mesh, centre));
        for &v in mesh.ring(centre).as_slice() {
            self.set(v, star(mesh, v));
        }
    }

    fn set(&mut self, v: VertexId, bounds: Bounds) {
        let mut i = self.nodes.len() / 2 + self.leaves[v.index()] as usize;
        self.nodes[i] = bounds;
        while i > 1 {
            i /= 2;
            let joined = self.nodes[2 * i].joined(&self.nodes[2 * i + 1]);
            if self.nodes[i] == joined {
                return;
            }
            self.nodes[i] = joined;
        }
    }
}

/// The triangle of `corners` as it is now.
pub(super) fn facet(mesh: &Mesh, corners: [VertexId; 3]) -> Facet {
    Facet { corners: corners.map(|v| v.0), points: corners.map(|v| mesh.position(v)) }
}

fn cross_each_other(fresh: &[Facet], boxes: &[Bounds]) -> bool {
    (0..fresh.len()).any(|i| (0..i).any(|j| boxes[i].meets(&boxes[j]) && facets_cross(&fresh[i], &fresh[j])))
}

/// The box around all triangles at `v`.
fn star(mesh: &Mesh, v: VertexId) -> Bounds {
    let point = |p: Vec3| Bounds { min: p, max: p };
    let ring = mesh.ring(v).as_slice().iter();
    ring.fold(point(mesh.position(v)), |all, &w| all.joined(&point(mesh.position(w))))
}

/// The vertices in the order of a Z-curve through their box: those near each other in it are mostly near in space.
fn along_a_curve(mesh: &Mesh) -> Vec<VertexId> {
    let bounds = mesh
        .vertices()
        .fold(Bounds::EMPTY, |all, v| all.joined(&Bounds { min: mesh.position(v), max: mesh.position(v) }));
    // In f64, where no size of finite coordinates overflows.
    let (low, size) = (bounds.min.as_dvec3(), (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element());
    let mut keyed: Vec<(u64, VertexId)> = mesh
        .vertices()
        .map(|v| {
            let cell = (mesh.position(v).as_dvec3() - low) / size * f64::from((1_u32 << CURVE_BITS) - 1);
            // A size of 0 gives NaN, and NaN the cell 0.
            (spread(cell.x as u32) | spread(cell.y as u32) << 1 | spread(cell.z as u32) << 2, v)
        })
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, v)| v).collect()
}

/// Cells of the curve along an axis are 2 to this power: more than enough to part the vertices of a mesh.
const CURVE_BITS: u32 = 16;

/// The bits of a number below 2^16 with two zeros after each.
fn spread(cell: u32) -> u64 {
    let mut bits = u64::from(cell);
    let steps = [(16, 0xff00_00ff), (8, 0x00f0_0f00_f00f), (4, 0x0c30_c30c_30c3), (2, 0x2492_4924_9249)];
    for (shift, mask) in steps {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn bits_are_spread() {
        for cell in [0, 1, 0x8000, 0xffff, 0x1234, 0xa5c3] {
            let expected = (0..16).fold(0, |all, k| all | u64::from(cell >> k & 1) << (3 * k));
            assert_eq!(spread(cell), expected, "{cell:x}");
        }
    }
}
