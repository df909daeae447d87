//! Non-uniform sampling: edge lengths by the curvature of the image's contour.
//!
//! The midpoint of an edge of length l with its ends on a contour of curvature κ is at the distance κ l²/8 from the
//! contour; this is the sagitta, which bounds the length of an edge that stays near the contour. It is measured in the
//! image, also where the ends have not settled: their own offsets from the contour are subtracted. Where a wall or a
//! gap is thin, edges are no longer than with uniform δ, since sheets whose edges are longer than their distance are
//! cut. They need not be shorter, since [`super::image_guide`] keeps the sheets apart. The paper has uniform δ and
//! names this as future work.

use super::DeformableModel;
use super::contour::{ObjectIs, SMALL_PART};
use crate::math::Vec3;
use crate::mesh::VertexId;
use crate::pauses::Pauses;
use crate::remesh::Sampling;
use crate::volume::CellCache;

/// The distance of an edge's midpoint from the contour, the sagitta, in voxels of the finest level, above which edges
/// are made shorter. With 0.1 the surface of a rough image has as many vertices as marching cubes; with 0.5, small
/// features are sampled no better than without sizes.
const MAX_SAGITTA: f32 = 0.25;

/// The distance of an edge's midpoint from the contour, the sagitta, in voxels of the finest level, below which edges
/// are made longer. The surface is inside its contour by two thirds of this distance: with 0.25, a ball of 7 voxels has
/// 7 % less volume.
const MIN_SAGITTA: f32 = 0.05;

/// The smallest size of a vertex, a local factor on δ, if the parameter `adaptivity` is 1.
const SMALLEST: f32 = 0.7;
/// The largest size of a vertex, a local factor on δ, if the parameter `adaptivity` is 1.
pub(super) const LARGEST: f32 = 1.6;

/// The size of a vertex of a part of one voxel's volume, if parts of a few voxels count; that of others grows with the
/// cube root of their volume. With more, the contour of a single voxel, an octahedron, has edges below their lower
/// bound and is removed; with less, it has hundreds of vertices.
const SIZE_OF_VOXEL: f64 = 0.4;

/// The least size of a vertex: that on a part of a fiftieth of a voxel. With less, the needle around a voxel that is barely
/// object, fifty times as long as wide, got tens of thousands of vertices; with more, faint single voxels are lost.
const LEAST_SIZE: f64 = 0.1;

/// The largest number of vertices of a part of a few voxels; the search for them stops there.
const MOST_IN_SMALL_PART: usize = 512;

/// The largest difference of size, a local factor on δ, between the ends of an edge of length [`MEAN_EDGE`] δ, and in
/// proportion for shorter and longer edges; with this, sampling remains isotropic.
const GRADATION: f32 = 0.3;

/// The step of the search along a vertex's normal for the opposite side of a wall or a gap, in voxels of the finest
/// level.
const STRIDE: f32 = 0.5;

/// The number of passes over the mesh that bound the difference of size, a local factor on δ, between neighbouring
/// vertices; each reaches one edge further.
const PASSES: usize = 3;

/// The number of edges or vertices whose sizes are a unit of work.
const EDGES_PER_UNIT: usize = 16;

/// The mean edge length, in δ, where vertices have size 1.
const MEAN_EDGE: f32 = super::MEAN_EDGE as f32;

/// The largest offset of a vertex or an edge's midpoint from the contour that is measured, in voxels of the finest
/// level; larger ones are clamped.
const MAX_OFFSET: f32 = 0.5;

impl DeformableModel {
    /// Sets the size of every vertex, a local factor on δ, by the curvature of the contour, and returns whether it did:
    /// not if sizes were set on this level before, or if the model does not adapt to the image. Seeds added later are
    /// given sizes separately.
    pub(super) async fn set_sizes(&mut self, pauses: &Pauses) -> bool {
        if self.convergence.sized || self.params.adaptivity == 0.0 || self.params.iso_force == 0.0 {
            return false;
        }
        self.convergence.sized = true;
        let all = self.followed_vertices();
        self.set_sizes_of(&all, pauses).await;
        true
    }

    /// Sets the sizes, local factors on δ, of some vertices by the curvature of the contour, with bounded differences
    /// between neighbours, and scaled by the parameter `adaptivity`, which must not be 0.
    pub(super) async fn set_sizes_of(&mut self, members: &[VertexId], pauses: &Pauses) {
        let mut sizes = self.sizes_by_curvature(members, pauses).await;
        let share = self.params.adaptivity as f32;
        // Other vertices keep their sizes, and bound those of their neighbours.
        let of = self.mesh.scalar(self.keys.size);
        let is_member = self.marked(members);
        for v in self.edges_at(members, &is_member).flat_map(|(u, v)| [u, v]) {
            if !is_member[v.index()] {
                sizes[v.index()] = 1.0 + of[v.index()] / share;
            }
        }
        for _ in 0..PASSES {
            self.bound_gradation(self.edges_at(members, &is_member), &mut sizes);
            pauses.after(members.len() / EDGES_PER_UNIT).await;
        }
        let size = self.mesh.scalar_mut(self.keys.size);
        members.iter().map(|v| v.index()).for_each(|v| size[v] = share * (sizes[v] - 1.0));
        self.set_sizes_of_small_parts(members, pauses).await;
    }

    /// Sets the sizes, local factors on δ, of those of some vertices that are on parts of a few voxels, by the volume of
    /// the part, if parts so small count; with other sizes they would have too few vertices to be closed.
    pub(super) async fn set_sizes_of_small_parts(&mut self, members: &[VertexId], pauses: &Pauses) {
        if self.params.smallest_part > SMALL_PART || !self.params.adapts_to_image() {
            return;
        }
        let mut is_seen = vec![false; self.mesh.slots()];
        for &v in members {
            let part = self.mesh.unseen_component_of(v, &mut is_seen);
            pauses.after(part.len().div_ceil(EDGES_PER_UNIT)).await;
            if part.is_empty() || part.len() > MOST_IN_SMALL_PART {
                continue;
            }
            let (volume, area) = self.volume_and_area(&part);
            // A part that is nearly flat would get more vertices than fit into memory.
            let least = (area / MOST_IN_SMALL_PART as f64).sqrt();
            let size = (SIZE_OF_VOXEL * libm::cbrt(volume)).max(least).max(LEAST_SIZE);
            if size < f64::from(SMALLEST) {
                let sizes = self.mesh.scalar_mut(self.keys.size);
                part.iter().for_each(|w| sizes[w.index()] = size as f32 - 1.0);
            }
        }
    }

    /// Returns the volume that a component with the given vertices encloses, and its area, in model units.
    fn volume_and_area(&self, component: &[VertexId]) -> (f64, f64) {
        let Some(&first) = component.first() else { return (0.0, 0.0) };
        let origin = self.mesh.position(first);
        let corner = |v: VertexId| (self.mesh.position(v) - origin).as_dvec3();
        let (mut six, mut area) = (0.0, 0.0);
        for [a, b, c] in self.mesh.triangles_at(component).into_iter().map(|corners| corners.map(corner)) {
            six += a.cross(b).dot(c);
            area += 0.5 * (b - a).cross(c - a).length();
        }
        (six.abs() / 6.0, area)
    }

    /// Returns for each vertex in `members`, by slot, the smallest of the sizes, local factors on δ, that the curvature
    /// of the contour gives its edges. At thin walls and gaps, sizes above 1 are bounded by the thickness, but not
    /// below 1.
    async fn sizes_by_curvature(&self, members: &[VertexId], pauses: &Pauses) -> Vec<f32> {
        let mut sizes = vec![LARGEST; self.mesh.slots()];
        let is_member = self.marked(members);
        let offsets = self.offsets_from_contour(self.edges_at(members, &is_member), pauses).await;
        for (k, (u, v)) in self.edges_at(members, &is_member).enumerate() {
            pauses.after(usize::from(k % EDGES_PER_UNIT == 0)).await;
            let size = self.size_of_edge([u, v], [u, v].map(|w| offsets[w.index()]));
            for w in [u, v].map(|w| w.index()) {
                sizes[w] = if size < sizes[w] { size } else { sizes[w] };
            }
        }
        for (k, &v) in members.iter().enumerate() {
            pauses.after(usize::from(k % EDGES_PER_UNIT == 0)).await;
            let size = &mut sizes[v.index()];
            if *size > 1.0 {
                *size = size.min(self.size_by_thickness(v).max(1.0));
            }
            *size = size.max(SMALLEST);
        }
        sizes
    }

    /// Returns the size, a factor on δ, at which the contact distance equals the thickness of the wall or gap at a
    /// vertex; infinite if none is found.
    fn size_by_thickness(&self, v: VertexId) -> f32 {
        let normal = self.mesh.unit_normal(v);
        let contact = Sampling::new(self.model_delta()).contact();
        let is_opposite = |k: i32| {
            let distance = f32::from(k as i16) * STRIDE;
            let p = self.mesh.position(v);
            self.depth(p + normal * distance) > 0.0 || self.depth(p - normal * distance) < 0.0
        };
        let strides = (LARGEST * contact / STRIDE) as i32;
        let thickness = (2..=strides).find(|&k| is_opposite(k)).map_or(f32::INFINITY, |k| k as f32 * STRIDE);
        thickness / contact
    }

    /// Returns the difference between the intensity at a point in model space and the iso value, positive in the
    /// object.
    fn depth(&self, p: Vec3) -> f32 {
        let (image, object) = (&self.pyramid.levels[self.level], ObjectIs::by(&self.params));
        let outside = object.outside(self.level_iso);
        object.depth(image.intensity(p, outside, &mut CellCache::default()), self.level_iso)
    }

    /// Returns for each slot whether its vertex is in `members`.
    fn marked(&self, members: &[VertexId]) -> Vec<bool> {
        let mut is_member = vec![false; self.mesh.slots()];
        members.iter().for_each(|v| is_member[v.index()] = true);
        is_member
    }

    /// Iterates over the edges with an end in `members`, which `is_member` marks, each once as (lower id, higher id).
    fn edges_at<'a>(
        &'a self,
        members: &'a [VertexId],
        is_member: &'a [bool],
    ) -> impl Iterator<Item = (VertexId, VertexId)> + 'a {
        let edges_of = |&u: &VertexId| self.mesh.ring(u).as_slice().iter().map(move |&v| (u, v));
        let edges = members.iter().flat_map(edges_of);
        let once = edges.filter(|&(u, v)| u < v || !is_member[v.index()]);
        once.map(|(u, v)| if u < v { (u, v) } else { (v, u) })
    }

    fn bound_gradation(&self, edges: impl Iterator<Item = (VertexId, VertexId)>, sizes: &mut [f32]) {
        let before = sizes.to_vec();
        let per_length = GRADATION / (MEAN_EDGE * self.model_delta());
        for (u, v) in edges {
            let growth = per_length * self.mesh.position(u).distance(self.mesh.position(v));
            for (a, b) in [(u.index(), v.index()), (v.index(), u.index())] {
                let most = before[b] + growth;
                sizes[a] = if most < sizes[a] { most } else { sizes[a] };
            }
        }
    }

    /// Returns the offset of each end of `edges` from the contour along its normal, by slot, in voxels of the finest
    /// level; positive inside the contour.
    async fn offsets_from_contour(
        &self,
        edges: impl Iterator<Item = (VertexId, VertexId)>,
        pauses: &Pauses,
    ) -> Vec<f32> {
        let mut offsets = vec![f32::NAN; self.mesh.slots()];
        for (k, v) in edges.flat_map(|(u, v)| [u, v]).enumerate() {
            pauses.after(usize::from(k % EDGES_PER_UNIT == 0)).await;
            if !offsets[v.index()].is_nan() {
                continue;
            }
            let normal = self.mesh.unit_normal(v);
            offsets[v.index()] = self.offset_from_contour(self.mesh.position(v), normal);
        }
        offsets
    }

    /// Returns the size of an edge, a factor on δ, by its sagitta, the distance of its midpoint from the contour: the
    /// size at which the sagitta would be [`MAX_SAGITTA`] if this size is below 1, or [`MIN_SAGITTA`] if this size is
    /// above 1, else 1; infinite if the edge is straight. `offsets` are those of its ends from the contour, in voxels.
    fn size_of_edge(&self, ends: [VertexId; 2], offsets: [f32; 2]) -> f32 {
        let [p, q] = ends.map(|w| self.mesh.position(w));
        let [m, n] = ends.map(|w| self.mesh.unit_normal(w));
        let middle = self.offset_from_contour((p + q) * 0.5, (m + n).normalize_or_zero());
        let sagitta = (middle - (offsets[0] + offsets[1]) * 0.5).abs();
        let length = p.distance(q) / (MEAN_EDGE * self.model_delta());
        let [shortened, lengthened] =
            [MAX_SAGITTA, MIN_SAGITTA].map(|within| length * (within / sagitta).sqrt());
        // The sagitta of a straight edge is 0, and its size infinite; the caller clamps it to the largest size.
        if shortened < 1.0 {
            shortened
        } else if lengthened > 1.0 {
            lengthened
        } else {
            1.0
        }
    }

    /// Returns the approximate depth of a point inside the contour along a direction, in voxels of the finest level,
    /// clamped to ±[`MAX_OFFSET`]; negative outside.
    fn offset_from_contour(&self, p: Vec3, direction: Vec3) -> f32 {
        let [here, ahead, behind] = [p, p + direction * 0.5, p - direction * 0.5].map(|p| self.depth(p));
        let slope = (ahead - behind).abs();
        if here.abs() < MAX_OFFSET * slope { here / slope } else { MAX_OFFSET.copysign(here) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::methods::deformable::{DeformableOptions, DeformableParams};
    use crate::pauses::finished;
    use crate::volume::{Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Makes a model of the intersection of two balls of different radius, whose surface varies in curvature.
    fn model() -> DeformableModel {
        let n = 24;
        let at = |k: usize| Vec3::new((k % n) as f32, (k / n % n) as f32, (k / n / n) as f32) - 11.5;
        let distance = |p: Vec3| (p.length() - 9.0).max((p - Vec3::Z * 14.0).length() - 12.0);
        let voxels = (0..n * n * n).map(|k| (0.5 - 0.25 * distance(at(k))).clamp(0.0, 1.0)).collect();
        let volume = Volume::new(VolumeInit::new(Voxels::F32(voxels), [n, n, n, 1])).unwrap();
        let params = DeformableParams { iso: 0.5, ..DeformableParams::for_volume(&volume) };
        let options = DeformableOptions { levels: 0, params: Some(params), ..Default::default() };
        DeformableModel::new(&volume, options).unwrap()
    }

    /// Regression: with sizes by the offset of the midpoint alone, edges of a surface 0.3 voxels off its contour were a
    /// quarter shorter.
    #[test]
    fn sizes_do_not_depend_on_the_offset_from_the_contour() {
        let mut model = model();
        let mean = |model: &DeformableModel| {
            let all: Vec<VertexId> = model.mesh.vertices().collect();
            let sizes = finished(model.sizes_by_curvature(&all, &Pauses::default()));
            model.mesh.vertices().map(|v| sizes[v.index()]).sum::<f32>() / model.mesh.vertex_count() as f32
        };
        let on_contour = mean(&model);
        let moved: Vec<(VertexId, Vec3)> = model
            .mesh
            .vertices()
            .map(|v| (v, model.mesh.position(v) + model.mesh.unit_normal(v) * 0.3))
            .collect();
        moved.into_iter().for_each(|(v, p)| model.mesh.set_position(v, p));
        let off_contour = mean(&model);
        assert!((off_contour / on_contour - 1.0).abs() < 0.1, "{on_contour} and {off_contour}");
    }
}
