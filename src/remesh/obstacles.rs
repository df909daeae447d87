//! Intersection tests for decimation: new triangles against the rest of the surface, by a bounding volume hierarchy
//! that is updated with the edits.

use crate::math::order::sort_pairs;
use crate::math::{Bounds, Vec3, triangle};
use crate::mesh::{Facet, Mesh, VertexId, facets_intersect};
use crate::pauses::Pauses;

/// A bounding volume hierarchy over the one-rings of all vertices, with which decimation tests for intersections: a
/// balanced tree of boxes in the order of a space-filling curve.
///
/// The tree structure is fixed while vertices are removed, so an update costs O(log n).
pub(super) struct Obstacles {
    /// Nodes in heap order: node i has the children 2i and 2i + 1, and the leaves are the last half.
    nodes: Vec<Bounds>,
    /// The leaf of each vertex, by slot, counted from the first leaf.
    leaves: Vec<u32>,
    /// The vertex whose one-ring each leaf bounds.
    vertices: Vec<VertexId>,
    /// The number of the connected component of each vertex, by slot of the mesh; vertices of other components must not
    /// change sides of the surface.
    components: Vec<u32>,
    /// The remaining work budget of decimation, in boxes visited and pairs of triangles tested; see
    /// [`Self::is_exhausted`].
    work_left: u64,
    work: u64,
    stack: Vec<u32>,
}

impl Obstacles {
    /// Builds the tree of `mesh`, with a work budget of `work` visited boxes and tested pairs of triangles; pauses
    /// meanwhile.
    pub async fn in_slices(mesh: &Mesh, work: u64, pauses: &Pauses) -> Self {
        let vertices = in_curve_order(mesh);
        pauses.now().await;
        let first_leaf = vertices.len().next_power_of_two();
        let mut leaves = vec![0; mesh.slots()];
        let mut nodes = vec![Bounds::EMPTY; 2 * first_leaf];
        for (leaf, &v) in vertices.iter().enumerate() {
            leaves[v.index()] = leaf as u32;
            nodes[first_leaf + leaf] = one_ring_bounds(mesh, v);
        }
        for i in (1..first_leaf).rev() {
            nodes[i] = nodes[2 * i].union(&nodes[2 * i + 1]);
        }
        pauses.now().await;
        let components = components(mesh);
        Self { nodes, leaves, vertices, components, work_left: work, work, stack: Vec::new() }
    }

    /// Returns the number of boxes visited and pairs of triangles tested so far.
    pub fn tests(&self) -> u64 {
        self.work - self.work_left
    }

    /// Returns whether the triangles `fresh` may not replace the one-rings of `replaced`: they have more than common
    /// corners and edges in common with each other or with other triangles of `mesh` (exact, touching included), or
    /// another component would change from inside to outside or back.
    ///
    /// `mesh` is the mesh before the edit; the first of `replaced` is in the edited component.
    pub fn blocks(&mut self, mesh: &Mesh, fresh: &[Facet], replaced: &[VertexId]) -> bool {
        let boxes: Vec<Bounds> = fresh.iter().map(|facet| Bounds::from_points(&facet.points)).collect();
        if intersect_each_other(fresh, &boxes) {
            return true;
        }
        let edit = Edit { fresh, boxes: &boxes, replaced, around: around(mesh, &boxes, replaced) };
        self.stack.clear();
        self.stack.push(1);
        while let Some(i) = self.stack.pop() {
            self.work_left = self.work_left.saturating_sub(1);
            if !self.nodes[i as usize].overlaps(&edit.around) {
                continue;
            }
            let blocked = match (i as usize).checked_sub(self.nodes.len() / 2) {
                None => {
                    self.stack.extend([2 * i, 2 * i + 1]);
                    false
                }
                Some(leaf) => self.one_ring_blocks(mesh, self.vertices[leaf], &edit),
            };
            if blocked {
                return true;
            }
        }
        false
    }

    fn one_ring_blocks(&mut self, mesh: &Mesh, v: VertexId, edit: &Edit) -> bool {
        if edit.replaced.contains(&v) {
            return false;
        }
        let component = |w: VertexId| self.components[w.index()];
        let is_apart = edit.replaced.first().is_some_and(|&u| component(u) != component(v));
        self.one_ring_intersects(mesh, v, edit) || is_apart && changes_sides(mesh, mesh.position(v), edit)
    }

    /// Returns whether a triangle that has `v` as its lowest vertex, and no vertex among the replaced ones, intersects
    /// a new triangle of `edit`.
    fn one_ring_intersects(&mut self, mesh: &Mesh, v: VertexId, edit: &Edit) -> bool {
        for (a, b) in mesh.ring(v).pairs().filter(|&(a, b)| v < a && v < b) {
            self.work_left = self.work_left.saturating_sub(1);
            let other = mesh.facet([v, a, b]);
            let bounds = Bounds::from_points(&other.points);
            if !bounds.overlaps(&edit.around) || edit.replaced.contains(&a) || edit.replaced.contains(&b) {
                continue;
            }
            self.work_left = self.work_left.saturating_sub(edit.fresh.len() as u64);
            let mut near = edit.fresh.iter().zip(edit.boxes).filter(|(_, near)| near.overlaps(&bounds));
            if near.any(|(fresh, _)| facets_intersect(fresh, &other)) {
                return true;
            }
        }
        false
    }

    /// Returns whether the work budget is used up, so that decimation has to end. The work of testing triangles whose
    /// boxes all overlap is quadratic in their number.
    pub fn is_exhausted(&self) -> bool {
        self.work_left == 0
    }

    /// Updates the tree after a collapse that deleted the vertex `removed` and changed the triangles around `centre`.
    pub fn update(&mut self, mesh: &Mesh, centre: VertexId, removed: VertexId) {
        self.set(removed, Bounds::EMPTY);
        self.set(centre, one_ring_bounds(mesh, centre));
        for &v in mesh.ring(centre).as_slice() {
            self.set(v, one_ring_bounds(mesh, v));
        }
    }

    fn set(&mut self, v: VertexId, bounds: Bounds) {
        let mut i = self.nodes.len() / 2 + self.leaves[v.index()] as usize;
        self.nodes[i] = bounds;
        while i > 1 {
            i /= 2;
            let joined = self.nodes[2 * i].union(&self.nodes[2 * i + 1]);
            if self.nodes[i] == joined {
                return;
            }
            self.nodes[i] = joined;
        }
    }
}

/// A collapse to be tested: the new triangles, and the vertices whose one-rings they replace.
struct Edit<'a> {
    fresh: &'a [Facet],
    boxes: &'a [Bounds],
    replaced: &'a [VertexId],
    /// The bounding box of the old and the new triangles.
    around: Bounds,
}

fn around(mesh: &Mesh, boxes: &[Bounds], replaced: &[VertexId]) -> Bounds {
    let before = replaced.iter().map(|&v| one_ring_bounds(mesh, v));
    boxes.iter().copied().chain(before).fold(Bounds::EMPTY, |all, one| all.union(&one))
}

/// Returns whether `p`, a vertex of another component, is enclosed between the old and the new triangles of `edit`, so
/// that it would change from inside to outside of the surface or back.
fn changes_sides(mesh: &Mesh, p: Vec3, edit: &Edit) -> bool {
    if !edit.around.contains(p) {
        return false;
    }
    let fresh: f64 = edit.fresh.iter().map(|facet| triangle::solid_angle(facet.points, p)).sum();
    let old = edit.replaced.iter().enumerate().flat_map(|(k, &v)| {
        // A triangle at several of the vertices is counted at the first.
        let counted = move |&(a, b): &(VertexId, VertexId)| {
            !edit.replaced[..k].contains(&a) && !edit.replaced[..k].contains(&b)
        };
        mesh.ring(v).pairs().filter(counted).map(move |(a, b)| [v, a, b])
    });
    let old: f64 = old.map(|corners| triangle::solid_angle(mesh.facet(corners).points, p)).sum();
    // The difference of solid angles is 4π between them, 0 elsewhere.
    (fresh - old).abs() > std::f64::consts::TAU
}

/// Returns the number of the connected component of each vertex, by slot; 0 for free slots.
fn components(mesh: &Mesh) -> Vec<u32> {
    let mut components = vec![0; mesh.slots()];
    for (number, members) in (0..).zip(mesh.component_members()) {
        members.into_iter().for_each(|v| components[v.index()] = number);
    }
    components
}

fn intersect_each_other(fresh: &[Facet], boxes: &[Bounds]) -> bool {
    (0..fresh.len())
        .any(|i| (0..i).any(|j| boxes[i].overlaps(&boxes[j]) && facets_intersect(&fresh[i], &fresh[j])))
}

/// Returns the bounding box of the one-ring of `v`.
fn one_ring_bounds(mesh: &Mesh, v: VertexId) -> Bounds {
    let point = |p: Vec3| Bounds { min: p, max: p };
    let ring = mesh.ring(v).as_slice().iter();
    ring.fold(point(mesh.position(v)), |all, &w| all.union(&point(mesh.position(w))))
}

/// Returns the vertices in the order of a Z-curve through their bounding box, so that consecutive ones are near each
/// other.
fn in_curve_order(mesh: &Mesh) -> Vec<VertexId> {
    let bounds = mesh
        .vertices()
        .fold(Bounds::EMPTY, |all, v| all.union(&Bounds { min: mesh.position(v), max: mesh.position(v) }));
    // In `f64`, where the size of a box of finite coordinates cannot overflow.
    let (low, size) = (bounds.min.as_dvec3(), (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element());
    let mut keyed: Vec<(u64, u32)> = mesh
        .vertices()
        .map(|v| {
            let cell = (mesh.position(v).as_dvec3() - low) / size * f64::from((1_u32 << CURVE_BITS) - 1);
            // A size of 0 gives NaN, which is cast to cell 0.
            (spread(cell.x as u32) | spread(cell.y as u32) << 1 | spread(cell.z as u32) << 2, v.0)
        })
        .collect();
    sort_pairs(&mut keyed);
    keyed.into_iter().map(|(_, v)| VertexId(v)).collect()
}

/// The binary logarithm of the number of cells along an axis of the Z-curve by which vertices are ordered: more than
/// enough to separate the vertices of a mesh.
const CURVE_BITS: u32 = 16;

/// Returns the bits of a number below 2^16, each followed by two zeros, for interleaving those of three coordinates.
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
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn obstacles(mesh: &Mesh, work: u64) -> Obstacles {
        finished(Obstacles::in_slices(mesh, work, &Pauses::default()))
    }

    /// Returns two adjacent spheres, a vertex `v` of the first, and the triangles around it after a move to `position`.
    fn moved(position: Vec3) -> (Mesh, VertexId, Vec<Facet>) {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
        mesh.append(&Mesh::icosphere(Vec3::X * 2.2, 1.0, 0.3).unwrap()).unwrap();
        let nearest = mesh.vertices().max_by(|&a, &b| f32::total_cmp(&first_x(&mesh, a), &first_x(&mesh, b)));
        let v = nearest.unwrap();
        let fan = mesh.ring(v).pairs().map(|(a, b)| {
            let mut facet = mesh.facet([v, a, b]);
            facet.points[0] = position;
            facet
        });
        let fan = fan.collect();
        (mesh, v, fan)
    }

    /// Returns the x of a vertex of the first sphere, and `f32::MIN` for one of the second, by which the vertex of the
    /// first nearest to the second is found.
    fn first_x(mesh: &Mesh, v: VertexId) -> f32 {
        let x = mesh.position(v).x;
        if x < 1.1 { x } else { f32::MIN }
    }

    #[test]
    fn what_is_touched_blocks() {
        for (x, expected) in
            [(1.0, false), (1.05, false), (1.3, true), (5.0, true), (-0.5, false), (-1.3, true)]
        {
            let (mesh, v, fan) = moved(Vec3::X * x);
            assert_eq!(obstacles(&mesh, u64::MAX).blocks(&mesh, &fan, &[v]), expected, "{x}");
        }
    }

    #[test]
    fn what_would_change_sides_blocks() {
        for (x, expected) in [(1.01, false), (1.5, true), (0.95, false), (3.0, true)] {
            let (mut mesh, v, fan) = moved(Vec3::X * x);
            let other = mesh.vertices().find(|&w| mesh.position(w).x > 1.1).unwrap();
            mesh.remove_component(other);
            mesh.append(&Mesh::icosahedron(Vec3::X * 1.1, 0.01)).unwrap();
            assert_eq!(obstacles(&mesh, u64::MAX).blocks(&mesh, &fan, &[v]), expected, "{x}");
        }
    }

    #[test]
    fn an_updated_tree_equals_a_new_one() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.2).unwrap();
        let mut updated = obstacles(&mesh, u64::MAX);
        let mut collapses = 0;
        for i in 0..300 {
            let (u, v) = mesh.edges().nth(i * 7 % mesh.edge_count()).unwrap();
            let position = mesh.position(v);
            if mesh.collapse(u, v, position).is_ok() {
                updated.update(&mesh, u, v);
                collapses += 1;
            }
        }
        assert!(collapses > 100, "{collapses}");
        let leaf = |v: VertexId| updated.nodes[updated.nodes.len() / 2 + updated.leaves[v.index()] as usize];
        assert!(mesh.vertices().all(|v| leaf(v) == one_ring_bounds(&mesh, v)));
        let root = mesh.vertices().fold(Bounds::EMPTY, |all, v| all.union(&one_ring_bounds(&mesh, v)));
        assert_eq!(updated.nodes[1], root);
    }

    #[test]
    fn work_ends() {
        let (mesh, v, fan) = moved(Vec3::X);
        let mut tree = obstacles(&mesh, 1000);
        let visited = (0..1000).take_while(|_| !tree.blocks(&mesh, &fan, &[v]) && !tree.is_exhausted());
        assert!((2..50).contains(&visited.count()));
    }

    #[test]
    fn bits_are_spread() {
        for cell in [0, 1, 0x8000, 0xffff, 0x1234, 0xa5c3] {
            let expected = (0..16).fold(0, |all, k| all | u64::from(cell >> k & 1) << (3 * k));
            assert_eq!(spread(cell), expected, "{cell:x}");
        }
    }
}
