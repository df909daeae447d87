//! Indexed triangle lists, as in files and GPU buffers.

use super::disjoint_sets::DisjointSets;
use super::edge_table::sorted_half_edges;
use super::{MeshError, Texture};
use crate::math::order::sort_triples;
use crate::math::{DAffine3, DVec3, Groups, Vec2, Vec3, triangle};
use crate::pauses::Pauses;
use std::sync::Arc;

/// Number of triangles between two pauses, and of those that count as one unit of work.
const CHUNK: usize = 1 << 16;
const TRIANGLES_PER_UNIT: usize = 32;

/// An indexed triangle list with optional normals, texture coordinates and colours. It need not be closed or manifold.
///
/// Triangles index `positions` and are counter-clockwise seen from outside. Each optional array has one entry per
/// position, except `corner_uvs`, which has one per triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// The positions of the vertices, relative to `origin`.
    pub positions: Vec<Vec3>,
    /// The origin in world space: a vertex is at its position plus this. It is 0 unless the mesh is far from the world's
    /// origin for its size, where positions in single precision would be too coarse.
    pub origin: DVec3,
    /// The indices of the corners of each triangle, into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals per vertex.
    pub normals: Option<Vec<Vec3>>,
    /// Texture coordinates per vertex.
    pub uvs: Option<Vec<Vec2>>,
    /// Texture coordinates per corner of each triangle; used instead of `uvs` if vertices on seams have several.
    pub corner_uvs: Option<Vec<[Vec2; 3]>>,
    /// Colours per vertex, RGB in 0..1.
    pub colors: Option<Vec<Vec3>>,
    /// The image to which `uvs` or `corner_uvs` refer; shared by the meshes derived from this one.
    pub texture: Option<Arc<Texture>>,
}

impl TriangleMesh {
    /// Checks that all triangle indices are below the number of positions, all positions are finite, all optional
    /// arrays have the right length, and a texture comes with texture coordinates.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`], which names the array, and its first invalid entry or its wrong length.
    pub fn validate(&self) -> Result<(), MeshError> {
        let invalid = |parameter, problem| Err(MeshError::InvalidArgument { parameter, problem });
        let (vertices, triangles) = (self.positions.len(), self.triangles.len());
        if let Some(v) = self.positions.iter().position(|p| !p.is_finite()) {
            return invalid("positions", format!("vertex {v} must be finite, got {}", self.positions[v]));
        }
        let outside = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= vertices);
        if let Some(t) = self.triangles.iter().position(outside) {
            let named = self.triangles[t];
            return invalid(
                "indices",
                format!("triangle {t} has an index that is not below {vertices}: {named:?}"),
            );
        }
        for (name, found, expected) in [
            ("normals", self.normals.as_ref().map(Vec::len), vertices),
            ("uvs", self.uvs.as_ref().map(Vec::len), vertices),
            ("corner_uvs", self.corner_uvs.as_ref().map(Vec::len), triangles),
            ("colors", self.colors.as_ref().map(Vec::len), vertices),
        ] {
            if let Some(found) = found.filter(|&found| found != expected) {
                return invalid(name, format!("must have {expected} entries, got {found}"));
            }
        }
        if self.texture.is_some() && !self.has_uvs() {
            return invalid("texture", "a texture needs texture coordinates (uvs)".into());
        }
        Ok(())
    }

    /// Returns whether the mesh has texture coordinates, per vertex or per corner.
    pub fn has_uvs(&self) -> bool {
        self.uvs.is_some() || self.corner_uvs.is_some()
    }

    /// Replaces each texture coordinate v by 1 − v, rounded to single precision: converts between file formats whose
    /// images start at the lower edge and those whose images start at the upper edge.
    pub(crate) fn flip_v(&mut self) {
        let turn = |uv: &mut Vec2| uv.y = 1.0 - uv.y;
        self.uvs.iter_mut().flatten().for_each(turn);
        self.corner_uvs.iter_mut().flatten().flatten().for_each(turn);
    }

    /// Iterates over the triangles, each as the positions of its corners. Indices must be valid, see
    /// [`TriangleMesh::validate`].
    pub fn corners(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|v| self.positions[v as usize]))
    }

    /// Returns the mesh transformed by `map` from world space to another one, in which its origin is 0. Normals are
    /// transformed by the cofactor matrix, and a reflection reverses the triangles, so that they still face outwards.
    pub fn transformed(&self, map: &DAffine3) -> Self {
        let mut moved = Self { origin: DVec3::ZERO, ..self.clone() };
        let mapped = |p: Vec3| map.transform_point3(p.as_dvec3() + self.origin).as_vec3();
        moved.positions.iter_mut().for_each(|p| *p = mapped(*p));
        let mirrors = map.matrix3.determinant() < 0.0;
        if mirrors {
            moved.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            moved.corner_uvs.iter_mut().flatten().for_each(|corners| corners.swap(1, 2));
        }
        // Cofactors instead of the inverse transpose: they are correct for singular maps, too.
        let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
        let side = if mirrors { -1.0 } else { 1.0 };
        for normal in moved.normals.iter_mut().flatten() {
            let n = normal.as_dvec3() * side;
            *normal = (y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z).normalize_or_zero().as_vec3();
        }
        moved
    }

    /// Returns the connected components as separate meshes, in the order of their first triangles.
    ///
    /// Components are connected through edges; a vertex where two of them touch is copied to both. Unused vertices are
    /// dropped.
    pub fn components(&self) -> Vec<Self> {
        let mut slots = vec![u32::MAX; self.positions.len()];
        let members = self.component_triangles();
        members.iter().map(|component| self.triangle_subset(component, &mut slots)).collect()
    }

    /// Returns what [`Self::components`] does, of a mesh whose components touch at no vertex, with less memory, and pauses
    /// meanwhile.
    pub(crate) async fn separate_components(&self, pauses: &Pauses) -> Vec<Self> {
        let component = self.component_of_each_vertex();
        pauses.now().await;
        let mut numbers = vec![u32::MAX; self.positions.len()];
        let mut members: Vec<Vec<usize>> = Vec::new();
        for (i, triangles) in self.triangles.chunks(CHUNK).enumerate() {
            for (t, corners) in (i * CHUNK..).zip(triangles) {
                let number = &mut numbers[component[corners[0] as usize] as usize];
                if *number == u32::MAX {
                    *number = members.len() as u32;
                    members.push(Vec::new());
                }
                members[*number as usize].push(t);
            }
            pauses.after(triangles.len() / TRIANGLES_PER_UNIT).await;
        }
        let mut slots = vec![u32::MAX; self.positions.len()];
        let mut components = Vec::with_capacity(members.len());
        for triangles in members {
            components.push(self.triangle_subset(&triangles, &mut slots));
            pauses.after(1 + triangles.len() / TRIANGLES_PER_UNIT).await;
        }
        components
    }

    /// Returns the mesh with the connected components of the given indices alone, as numbered by [`Self::components`].
    /// Triangles keep their order; unused vertices are dropped.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] for an index that no component has.
    pub fn with_components(&self, indices: &[u32]) -> Result<Self, MeshError> {
        let members = self.component_triangles();
        let mut kept = Vec::new();
        for &index in indices {
            let Some(component) = members.get(index as usize) else {
                let problem = format!("there is no component {index}; there are {}", members.len());
                return Err(MeshError::InvalidArgument { parameter: "indices", problem });
            };
            kept.extend_from_slice(component);
        }
        kept.sort_unstable();
        kept.dedup();
        Ok(self.triangle_subset(&kept, &mut vec![u32::MAX; self.positions.len()]))
    }

    /// Returns the triangles of each connected component, in the order of their first ones.
    fn component_triangles(&self) -> Vec<Vec<usize>> {
        let mut groups = DisjointSets::new(self.triangles.len());
        groups.join_across_edges(&sorted_half_edges(&self.triangles));
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); self.triangles.len()];
        (0..self.triangles.len()).for_each(|t| members[groups.find(t)].push(t));
        members.retain(|component| !component.is_empty());
        members
    }

    /// Returns the triangles with the given indices as a mesh, its vertices numbered in order of first use. `slots` is
    /// scratch space with one entry per vertex, all `u32::MAX` before and after.
    fn triangle_subset(&self, triangles: &[usize], slots: &mut [u32]) -> Self {
        let mut used = Vec::new();
        let renumbered = |t: &usize| {
            self.triangles[*t].map(|v| {
                let slot = &mut slots[v as usize];
                if *slot == u32::MAX {
                    *slot = used.len() as u32;
                    used.push(v as usize);
                }
                *slot
            })
        };
        let renumbered = triangles.iter().map(renumbered).collect();
        used.iter().for_each(|&v| slots[v] = u32::MAX);
        let component = self.vertex_subset(&used);
        let corner_uvs = self.corner_uvs.as_ref().map(|uvs| triangles.iter().map(|&t| uvs[t]).collect());
        Self { triangles: renumbered, corner_uvs, ..component }
    }

    /// Returns a mesh of the vertices with the given indices, without triangles, with their normals, texture
    /// coordinates per vertex and colours, and with the texture.
    pub(super) fn vertex_subset(&self, vertices: &[usize]) -> Self {
        Self {
            positions: gather(&self.positions, vertices),
            origin: self.origin,
            triangles: Vec::new(),
            normals: self.normals.as_ref().map(|all| gather(all, vertices)),
            uvs: self.uvs.as_ref().map(|all| gather(all, vertices)),
            corner_uvs: None,
            colors: self.colors.as_ref().map(|all| gather(all, vertices)),
            texture: self.texture.clone(),
        }
    }

    /// Returns a unit normal per vertex: the area-weighted mean of the normals of the triangles around it. Zero if the
    /// vertex is unused or the normals cancel.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for (triangle, corners) in self.triangles.iter().zip(self.corners()) {
            let normal = triangle::area_vector(corners);
            triangle.iter().for_each(|&v| sums[v as usize] += normal);
        }
        sums.into_iter().map(|sum| sum.normalize_or_zero().as_vec3()).collect()
    }

    /// Returns texture coordinates per vertex, for formats without seams, or `None` if the mesh has none: at a seam
    /// those of one side are used, which distorts the texture on the triangles of the other sides.
    /// [`Self::split_at_seams`] avoids this with more vertices.
    pub fn uvs_ignoring_seams(&self) -> Option<Vec<Vec2>> {
        let Some(corner_uvs) = &self.corner_uvs else { return self.uvs.clone() };
        let mut uvs = vec![Vec2::ZERO; self.positions.len()];
        for (&v, &uv) in self.triangles.as_flattened().iter().zip(corner_uvs.as_flattened()) {
            uvs[v as usize] = uv;
        }
        Some(uvs)
    }

    /// Returns for each vertex the edges opposite it in its triangles, in the order of the triangles; each is directed
    /// as in its triangle.
    pub(crate) fn opposite_edges(&self) -> Groups<[u32; 2]> {
        let around = |&[a, b, c]: &[u32; 3]| [(a, [b, c]), (b, [c, a]), (c, [a, b])];
        Groups::new(self.positions.len(), self.triangles.iter().flat_map(around))
    }

    /// Returns the mesh with vertices on texture seams duplicated, one per distinct texture coordinate, so that `uvs`
    /// replaces `corner_uvs`. Unused vertices are dropped. Returns a copy if there are no `corner_uvs`.
    pub fn split_at_seams(&self) -> Self {
        let Some(corner_uvs) = &self.corner_uvs else { return self.clone() };
        let mut corners: Vec<([u32; 3], u32)> = Vec::with_capacity(3 * corner_uvs.len());
        for ((&v, uv), at) in self.triangles.as_flattened().iter().zip(corner_uvs.as_flattened()).zip(0..) {
            corners.push(([v, uv.x.to_bits(), uv.y.to_bits()], at));
        }
        sort_triples(&mut corners);
        let (mut vertices, mut uvs) = (Vec::new(), Vec::new());
        let mut triangles = vec![[0; 3]; self.triangles.len()];
        for same in corners.chunk_by(|a, b| a.0 == b.0) {
            let [v, x, y] = same[0].0;
            let corners = same.iter().map(|&(_, at)| at as usize);
            corners.for_each(|at| triangles[at / 3][at % 3] = vertices.len() as u32);
            vertices.push(v as usize);
            uvs.push(Vec2::new(f32::from_bits(x), f32::from_bits(y)));
        }
        Self { triangles, uvs: Some(uvs), ..self.vertex_subset(&vertices) }
    }
}

fn gather<T: Copy>(all: &[T], which: &[usize]) -> Vec<T> {
    which.iter().map(|&i| all[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{measure, shapes};
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn transformed_keeps_outside_outside() {
        let cube = shapes::cuboid(Vec3::ONE);
        let mesh = TriangleMesh { normals: Some(cube.vertex_normals()), ..cube };
        let map = DAffine3::from_scale(DVec3::new(-2.0, 3.0, 1.0));
        let moved = mesh.transformed(&map);
        assert_eq!(measure(&moved).volume, 6.0);
        let outward = |m: &TriangleMesh| {
            let centre = m.positions.iter().sum::<Vec3>() / 8.0;
            let normals = m.normals.as_ref().unwrap();
            m.positions.iter().zip(normals).all(|(p, n)| (*p - centre).dot(*n) > 0.0)
        };
        assert!(outward(&mesh) && outward(&moved));
    }

    #[test]
    fn components_that_touch_nowhere_come_apart_alike_by_edges_and_by_vertices() {
        let parts = [
            shapes::torus(3.0, 1.0, 8, 5),
            shapes::cuboid(Vec3::ONE),
            shapes::icosahedron(),
            shapes::cuboid(Vec3::splat(2.0)),
        ];
        let mut mesh = shapes::joined(&parts);
        // The triangles of a part need not follow each other.
        let half = mesh.triangles.len() / 2;
        mesh.triangles = (0..half).flat_map(|t| [t, t + half]).map(|t| mesh.triangles[t]).collect();
        let found = crate::pauses::finished(mesh.separate_components(&Pauses::default()));
        assert!(found.len() > 3, "{}", found.len());
        assert_eq!(found, mesh.components());
    }

    #[test]
    fn components_come_apart() {
        let parts = [shapes::torus(3.0, 1.0, 8, 5), shapes::cuboid(Vec3::ONE), shapes::icosahedron()];
        let mut all = shapes::joined(&parts);
        all.colors = Some(all.positions.clone());
        let found = all.components();
        assert_eq!(found.len(), 3);
        for (component, expected) in found.iter().zip(&parts) {
            component.validate().unwrap();
            assert_eq!(component.colors.as_ref(), Some(&component.positions));
            assert_eq!(measure(component), measure(expected));
        }
    }

    #[test]
    fn vertex_normals_of_a_ball() {
        let ball = shapes::icosahedron();
        for (p, n) in ball.positions.iter().zip(ball.vertex_normals()) {
            assert!((p.normalize() - n).length() < 1e-6);
        }
    }

    #[test]
    fn validate_names_the_extra() {
        let mesh = TriangleMesh { uvs: Some(vec![Vec2::ZERO; 3]), ..shapes::icosahedron() };
        let MeshError::InvalidArgument { parameter, problem } = mesh.validate().unwrap_err() else {
            panic!()
        };
        assert_eq!((parameter, problem.as_str()), ("uvs", "must have 12 entries, got 3"));
    }
}
