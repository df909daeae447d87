//! Removal of small components: those without volume, crushed ones and inverted ones.

use super::{Resolver, Sampling, TopologyGuide};
use crate::math::triangle::solid_angle;
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, VertexId, sort_distinct};
use crate::pauses::Pauses;

/// The largest number of vertices of a small component. Larger ones are never removed: a volume below the thresholds
/// alone does not show that a component is small, since the volume of a cavity is negative.
const MAX_VERTICES: usize = 32;

/// The volume of an icosahedron with edges of length δ, in δ³: the smallest sphere that can be sampled, to which the
/// volume of small components is compared.
const SMALLEST_SPHERE: f32 = 2.18;

/// The small components of a mesh, of at most [`MAX_VERTICES`] vertices, which are removed when they lose their volume.
#[derive(Clone, Debug, Default)]
pub(super) struct SmallComponents {
    /// The vertex of lowest id of each small component, in ascending order, so that a recomputed list is the same, and
    /// whether the component is solid, that is of positive volume; the others are cavities.
    components: Vec<(VertexId, bool)>,
    /// The topology version of the mesh for which `components` is up to date.
    topology_version: Option<u32>,
}

impl SmallComponents {
    /// Finds the small components of the mesh, unless the list is up to date.
    pub(super) fn find(&mut self, mesh: &Mesh) {
        if self.topology_version != Some(mesh.topology_version()) {
            self.find_among(mesh, mesh.vertices());
        }
    }

    /// Updates the list of small components after edits that created or displaced the vertices `edited`.
    pub(super) fn find_again(&mut self, mesh: &Mesh, edited: &[VertexId]) {
        let known = std::mem::take(&mut self.components);
        let members = known.into_iter().map(|(v, _)| v).chain(edited.iter().copied());
        self.find_among(mesh, members.filter(|&v| mesh.is_live(v)));
    }

    fn find_among(&mut self, mesh: &Mesh, vertices: impl Iterator<Item = VertexId>) {
        self.components.clear();
        let mut first = Vec::new();
        let mut seen = vec![false; mesh.slots()];
        for v in vertices {
            if seen[v.index()] {
                continue;
            }
            // A search that stops early is within a large component.
            let found = mesh.component_of(v, MAX_VERTICES + 1);
            found.iter().for_each(|w| seen[w.index()] = true);
            if found.len() <= MAX_VERTICES {
                first.extend(found.into_iter().min());
            }
        }
        sort_distinct(&mut first);
        let is_solid = |v: VertexId| volume(mesh, &mesh.component_of(v, MAX_VERTICES)) > 0.0;
        self.components.extend(first.into_iter().map(|v| (v, is_solid(v))));
        self.topology_version = Some(mesh.topology_version());
    }
}

impl Resolver {
    /// Removes the component of `v` if it is negligibly small; returns whether it no longer exists, since it may have
    /// been removed before the call (the two sides of a cut handle are one component).
    ///
    /// A negligible component has at most 32 vertices and a signed volume less than δ³, and is not a cavity of at least
    /// δ³ in which `guide` finds background. Other components of negative volume would grow in empty space.
    pub(super) fn remove_if_negligible(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        v: VertexId,
    ) -> bool {
        if !mesh.is_live(v) {
            return true;
        }
        let members = mesh.component_of(v, MAX_VERTICES + 1);
        if members.len() > MAX_VERTICES {
            return false;
        }
        let (volume, least) = (volume(mesh, &members), sampling.smallest_volume_at(mesh, v));
        if volume >= least || volume <= -least && guide.has_content(mesh, &members, false) {
            return false;
        }
        self.remove_component(mesh, v);
        true
    }

    /// Removes small components that were crushed or inverted by a move.
    ///
    /// When two sides press against each other, vertices are held, no edge becomes short, and a component would persist
    /// for ever. So a component with held vertices is removed if it is smaller than the smallest sphere (as a cavity
    /// without background always is), if none of its vertices could move, or if it is solid, more than half of them
    /// could not, and `guide` finds it empty. A component this small can also be inverted between two states without
    /// self-intersections, as when the apex of a tetrahedron passes through its base.
    ///
    /// Pauses meanwhile.
    pub(super) async fn remove_crushed(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        stuck: &[VertexId],
        pauses: &Pauses,
    ) {
        self.small.find(mesh);
        let is_stuck = |v: &VertexId| stuck.binary_search(v).is_ok();
        for (v, was_solid) in std::mem::take(&mut self.small.components) {
            // It may have been inside a component that was removed.
            if !mesh.is_live(v) {
                continue;
            }
            pauses.after(1).await;
            let members = mesh.component_of(v, MAX_VERTICES + 1);
            let volume = volume(mesh, &members);
            let stuck = members.iter().filter(|v| is_stuck(v)).count();
            let is_crushed = stuck > 0 && is_crushed(mesh, &members, stuck, volume, sampling, guide);
            if is_crushed || (volume > 0.0) != was_solid {
                self.remove_component(mesh, v);
            } else {
                self.small.components.push((v, was_solid));
            }
        }
    }

    /// Updates the list of small components after the edits of a call of the resolver, and removes cavities smaller
    /// than the smallest sphere, except for those of at least δ³ in which `guide` finds background: an edit may have
    /// inverted a solid, which would grow in empty space. Pauses meanwhile.
    pub(super) async fn update_small_components(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        pauses: &Pauses,
    ) {
        self.small.find_again(mesh, &self.edited);
        pauses.now().await;
        for (v, is_solid) in std::mem::take(&mut self.small.components) {
            if !mesh.is_live(v) {
                continue;
            }
            pauses.after(1).await;
            let is_left = || {
                let members = mesh.component_of(v, MAX_VERTICES);
                let volume = volume(mesh, &members);
                let least = sampling.smallest_volume_at(mesh, v);
                volume <= -SMALLEST_SPHERE * least || kept_volume(mesh, &members, volume, guide) >= least
            };
            if !is_solid && !is_left() {
                self.remove_component(mesh, v);
            } else {
                self.small.components.push((v, is_solid));
            }
        }
        self.small.topology_version = Some(mesh.topology_version());
    }

    /// Removes the component of `v` and, if it is small, the components inside it, which would otherwise be on the
    /// wrong side of the surface that remains around them.
    pub(super) fn remove_component(&mut self, mesh: &mut Mesh, v: VertexId) {
        let members = mesh.component_of(v, MAX_VERTICES + 1);
        let within =
            if members.len() <= MAX_VERTICES { self.vertices_within(mesh, &members) } else { Vec::new() };
        for component in [v].into_iter().chain(within) {
            if mesh.is_live(component) {
                self.embedding.remove_component(mesh, component);
                self.changes.vanished += 1;
            }
        }
    }

    /// Returns the vertices of other components that lie inside the component with the vertices `members`.
    fn vertices_within(&mut self, mesh: &Mesh, members: &[VertexId]) -> Vec<VertexId> {
        let positions: Vec<Vec3> = members.iter().map(|&v| mesh.position(v)).collect();
        let mut found = self.embedding.vertices_in(mesh, &Bounds::from_points(&positions));
        found.retain(|v| !members.contains(v) && is_within(mesh, members, mesh.position(*v)));
        found
    }

    /// Removes all negligible components, of at most 32 vertices and less than δ³, except for cavities of at least δ³
    /// in which `guide` finds background; returns the number of components removed. Pauses meanwhile.
    pub async fn remove_negligible(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        pauses: &Pauses,
    ) -> u32 {
        let before = self.changes.vanished;
        for members in mesh.component_members() {
            pauses.after(1).await;
            self.remove_if_negligible(mesh, sampling, guide, members[0]);
        }
        self.changes.vanished - before
    }
}

/// Returns whether a small component is crushed and has to be removed; `stuck` of its vertices `members` could not
/// move. It is crushed if it is smaller than the smallest sphere, if all its vertices are stuck, or if it is solid,
/// more than half of them are stuck and `guide` finds it empty.
fn is_crushed(
    mesh: &Mesh,
    members: &[VertexId],
    stuck: usize,
    volume: f32,
    sampling: Sampling,
    guide: &dyn TopologyGuide,
) -> bool {
    let least = sampling.smallest_volume_at(mesh, members[0]);
    let is_flat = kept_volume(mesh, members, volume, guide) < SMALLEST_SPHERE * least;
    let is_empty = || volume > 0.0 && !guide.has_content(mesh, members, true);
    is_flat || stuck == members.len() || 2 * stuck > members.len() && is_empty()
}

/// Returns the volume of a component that is compared with the thresholds of removal: the absolute value of that of a
/// cavity if `guide` finds background in it, otherwise the signed volume.
fn kept_volume(mesh: &Mesh, members: &[VertexId], volume: f32, guide: &dyn TopologyGuide) -> f32 {
    if volume < 0.0 && guide.has_content(mesh, members, false) { -volume } else { volume }
}

/// Returns whether the point `p` is inside the component with the vertices `members`, by the solid angle of its
/// triangles.
fn is_within(mesh: &Mesh, members: &[VertexId], p: Vec3) -> bool {
    // The total is 4π for points inside, 0 for points outside.
    let angle: f64 = triangles(mesh, members).map(|corners| solid_angle(corners, p)).sum();
    angle.abs() > std::f64::consts::TAU
}

/// Returns the corner positions of the triangles of the component with the vertices `members`, each triangle once.
fn triangles(mesh: &Mesh, members: &[VertexId]) -> impl Iterator<Item = [Vec3; 3]> {
    members.iter().flat_map(move |&u| {
        let counted_here = mesh.ring(u).pairs().filter(move |&(a, b)| u < a && u < b);
        counted_here.map(move |(a, b)| [u, a, b].map(|w| mesh.position(w)))
    })
}

/// Returns the signed volume of the component with the vertices `members`; positive if its triangles face outwards.
fn volume(mesh: &Mesh, members: &[VertexId]) -> f32 {
    let origin = mesh.position(members[0]);
    let below = |corners: [Vec3; 3]| {
        let [p, q, r] = corners.map(|corner| corner - origin);
        p.dot(q.cross(r)) / 6.0
    };
    triangles(mesh, members).map(below).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::pauses::finished;
    use crate::remesh::{Changes, Unguided};
    use std::f32::consts::TAU;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let positions = positions.iter().map(|&p| Vec3::from(p)).collect();
        Mesh::from_triangles(&TriangleMesh { positions, triangles: triangles.to_vec(), ..Default::default() })
            .unwrap()
    }

    fn step(mesh: &mut Mesh, sampling: Sampling, mut displacements: Vec<Vec3>) -> Changes {
        let mut resolver = Resolver::with_max_vertices(1000);
        resolver.move_all(mesh, sampling, &mut displacements);
        let all: Vec<VertexId> = mesh.vertices().collect();
        resolver.resolve(mesh, sampling, &all)
    }

    /// The component, a lens, intersects itself neither before nor after its inversion. Regression: an inverted
    /// component grew until it filled the image (test `merge_and_split`, seed 297).
    #[test]
    fn an_inverted_component_is_removed() {
        let rim = |k: u32| {
            let angle = TAU * k as f32 / 6.0;
            [libm::cosf(angle), libm::sinf(angle), 0.0]
        };
        let mut positions: Vec<[f32; 3]> = (0..6).map(rim).collect();
        positions.extend([[0.0, 0.0, 0.45], [0.0, 0.0, -0.45]]);
        let sides = (0..6).flat_map(|k| [[k, (k + 1) % 6, 6], [(k + 1) % 6, k, 7]]);
        let lens = mesh(&positions, &sides.collect::<Vec<_>>());
        let mut displacements = vec![Vec3::ZERO; 8];
        assert_eq!(step(&mut lens.clone(), Sampling::new(0.6), displacements.clone()), Changes::default());
        (displacements[6], displacements[7]) = (Vec3::Z * -0.95, Vec3::Z * 0.95);
        let mut passing = lens;
        assert_eq!(step(&mut passing, Sampling::new(0.6), displacements).vanished, 1);
        assert_eq!(passing.vertex_count(), 0);
    }

    /// All edges of the component are within bounds, and any move inwards is rejected (test `merge_and_split`, seed
    /// 404).
    #[test]
    fn a_component_that_cannot_shrink_is_removed() {
        let component = mesh(
            &[
                [22.015448, 21.224213, 21.005508],
                [21.30414, 23.457825, 21.515993],
                [19.880173, 21.749306, 21.090736],
                [18.910048, 20.52349, 21.04583],
                [19.413857, 21.692667, 19.572815],
                [22.018099, 22.400068, 19.543438],
                [19.792208, 23.546644, 19.620173],
                [18.065186, 19.906729, 19.959562],
                [22.888927, 23.65509, 19.344536],
                [21.199392, 23.79402, 19.419054],
            ],
            &[
                [0, 1, 2],
                [0, 2, 3],
                [0, 3, 4],
                [0, 4, 5],
                [0, 5, 1],
                [2, 1, 6],
                [2, 6, 4],
                [2, 4, 7],
                [2, 7, 3],
                [3, 7, 4],
                [8, 6, 1],
                [8, 1, 5],
                [8, 5, 9],
                [8, 9, 6],
                [5, 4, 9],
                [6, 9, 4],
            ],
        );
        assert_shrinks_away(component, Sampling::new(1.4), 0.3);
    }

    /// More than half of the component's vertices are held, though it is larger than the smallest sphere (test
    /// `merge_and_split`, seed 10529).
    #[test]
    fn a_crumpled_component_is_removed() {
        let component = mesh(
            &[
                [30.879736, 22.268867, 22.252005],
                [30.429016, 20.206413, 21.476469],
                [30.530571, 21.64207, 20.33488],
                [30.883303, 21.424736, 23.669962],
                [30.533237, 20.08431, 24.180342],
                [28.321115, 20.20514, 20.53849],
                [30.634886, 19.893284, 19.654705],
                [27.517422, 21.187292, 21.147432],
                [29.380932, 20.855356, 22.083912],
                [29.200743, 19.398195, 19.878986],
                [28.139534, 22.066616, 23.512575],
                [30.304714, 22.374613, 23.882977],
                [29.245834, 19.686317, 23.77984],
                [29.109978, 23.35765, 24.055906],
                [28.26234, 20.225344, 23.041227],
            ],
            &[
                [0, 1, 8],
                [0, 3, 4],
                [0, 4, 1],
                [0, 8, 10],
                [0, 10, 11],
                [0, 11, 3],
                [1, 2, 8],
                [1, 4, 14],
                [1, 5, 6],
                [1, 6, 2],
                [1, 14, 5],
                [2, 6, 9],
                [2, 7, 8],
                [2, 9, 7],
                [3, 10, 12],
                [3, 11, 13],
                [3, 12, 4],
                [3, 13, 10],
                [4, 12, 14],
                [5, 7, 9],
                [5, 9, 6],
                [5, 14, 7],
                [7, 14, 8],
                [8, 14, 10],
                [10, 13, 11],
                [10, 14, 12],
            ],
        );
        assert_shrinks_away(component, Sampling::new(1.324), 0.02);
    }

    /// Regression: a solid inside a small cavity was left in the foreground after the cavity was removed (deformable
    /// fuzz, seed 21981).
    #[test]
    fn components_inside_a_removed_one_are_removed() {
        let (mut both, hollow) = nested();
        let mut resolver = Resolver::with_max_vertices(1000);
        resolver.remove_component(&mut both, hollow[0]);
        assert_eq!(both.vertex_count(), 12);
        assert!(both.vertices().all(|v| both.position(v).x > 1.0));
    }

    /// A component inside a removed cavity is removed with it, although it is listed after it.
    #[test]
    fn removed_components_are_not_visited_again() {
        let (mut both, hollow) = nested();
        let mut resolver = Resolver::with_max_vertices(1000);
        let (sampling, pauses) = (Sampling::new(0.2), Pauses::default());
        finished(resolver.remove_crushed(&mut both, sampling, &Unguided, &hollow, &pauses));
        assert_eq!(both.vertex_count(), 12);
        finished(resolver.update_small_components(&mut both, sampling, &Unguided, &pauses));
        assert_eq!(both.vertex_count(), 12);
    }

    /// Returns three icosahedra: a cavity, a solid inside it and another solid beside it, and the vertices of the
    /// cavity.
    fn nested() -> (Mesh, Vec<VertexId>) {
        let mut hollow = Mesh::icosahedron(Vec3::ZERO, 1.0).to_triangles();
        hollow.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let mut both = Mesh::from_triangles(&hollow).unwrap();
        let members = both.vertices().collect();
        both.append(&Mesh::icosahedron(Vec3::ZERO, 0.5)).unwrap();
        both.append(&Mesh::icosahedron(Vec3::X * 1.5, 0.3)).unwrap();
        (both, members)
    }

    /// Asserts that a component that is moved inwards, in steps of `share` times δ, is removed in the end.
    fn assert_shrinks_away(mut component: Mesh, sampling: Sampling, share: f32) {
        for _ in 0..20 {
            let normals = component.to_triangles().vertex_normals();
            let displacements = normals.iter().map(|n| *n * (-share * sampling.shortest())).collect();
            step(&mut component, sampling, displacements);
            if component.vertex_count() == 0 {
                return;
            }
            component = Mesh::from_triangles(&component.to_triangles()).unwrap();
        }
        panic!("{} vertices are left", component.vertex_count());
    }
}
