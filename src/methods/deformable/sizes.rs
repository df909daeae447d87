//! Non-uniform sampling: how long edges are where, by the curvature that the image shows.
//!
//! The middle of an edge of length l on a contour of curvature κ is κ l²/8 away from it. So where the surface has settled, the image
//! tells for each edge how long it may be to stay near. Where a wall or a gap is thin, edges are no longer than with one δ everywhere:
//! sheets with longer ones than their distance are cut. They need not be shorter, since [`super::contact`] keeps them. The paper has
//! one δ everywhere and names this as future work.

use super::DeformableModel;
use super::contour::ObjectIs;
use crate::math::Vec3;
use crate::mesh::VertexId;
use crate::remesh::Sampling;
use crate::volume::KnownCell;

/// How far the middle of an edge is from the contour, in voxels, where edges are made shorter. With 0.1 the surface of a rough image has
/// as many vertices as marching cubes; with 0.5, small features are sampled no better than without sizes.
const COARSE: f32 = 0.25;

/// How far it may be where edges are made longer. The surface is inside its contour by two thirds of it: with 0.25, a ball of 7 voxels
/// has 7 % less volume.
const FINE: f32 = 0.05;

/// The smallest and the largest size, in δ, with full adaptivity.
const SMALLEST: f32 = 0.7;
const LARGEST: f32 = 1.6;

/// By how much the size may grow along an edge, as a share of its length: sampling then stays isotropic.
const GRADATION: f32 = 0.3;

/// Step of the search for the opposite side of a wall or a gap, in voxels.
const STRIDE: f32 = 0.5;

/// Passes over the mesh that bound the gradation; each reaches one edge further.
const PASSES: usize = 3;

/// The length of an edge of size 1, in δ.
const ORDINARY: f32 = super::MEAN_EDGE as f32;

/// The contour is not looked for further away than this, in voxels.
const FURTHEST: f32 = 0.5;

impl DeformableModel {
    /// Sets the size of every vertex, at least `least` of the ordinary one; says whether there are sizes.
    fn set_sizes_from(&mut self, least: f32) -> bool {
        if self.params.adaptivity == 0.0 || self.params.iso_force == 0.0 {
            return false;
        }
        let mut sizes = self.sizes_by_curvature(least);
        for _ in 0..PASSES {
            self.bound_gradation(&mut sizes);
        }
        let share = self.params.adaptivity as f32;
        let of = self.mesh.scalar_mut(self.keys.size);
        of.iter_mut().zip(&sizes).for_each(|(of, size)| *of = share * (size - 1.0));
        true
    }

    /// Lets edges grow where the surface has just been made: an edge that has not settled yet shows more misfit than it will have.
    pub(super) fn set_first_sizes(&mut self) -> bool {
        self.set_sizes_from(1.0)
    }

    /// Sets the size of every vertex, unless that was done since the last seeds; says whether it did.
    pub(super) fn set_sizes(&mut self) -> bool {
        !std::mem::replace(&mut self.rest.sized, true) && self.set_sizes_from(SMALLEST)
    }

    /// For each vertex, the smallest size that one of its edges asks for.
    fn sizes_by_curvature(&self, least: f32) -> Vec<f32> {
        let mut sizes = vec![LARGEST; self.mesh.slots()];
        for (u, v) in self.mesh.edges() {
            let size = self.size_of_edge(u, v);
            for w in [u, v].map(|w| w.index()) {
                sizes[w] = if size < sizes[w] { size } else { sizes[w] };
            }
        }
        for v in self.mesh.vertices() {
            let size = &mut sizes[v.index()];
            if *size > 1.0 {
                *size = size.min(self.size_by_thickness(v).max(1.0));
            }
            *size = size.max(least);
        }
        sizes
    }

    /// The size at which sheets are further apart than contact reaches.
    fn size_by_thickness(&self, v: VertexId) -> f32 {
        let normal = self.mesh.area_normal(v).normalize_or_zero();
        let contact = Sampling::new(self.model_delta()).contact();
        let is_opposite = |k: i32| {
            let way = f32::from(k as i16) * STRIDE;
            let p = self.mesh.position(v);
            self.depth(p + normal * way) > 0.0 || self.depth(p - normal * way) < 0.0
        };
        let strides = (LARGEST * contact / STRIDE) as i32;
        let thickness = (2..=strides).find(|&k| is_opposite(k)).map_or(f32::INFINITY, |k| k as f32 * STRIDE);
        thickness / contact
    }

    /// How far the intensity at a point is on the object's side of the iso value.
    fn depth(&self, p: Vec3) -> f32 {
        let (image, object) = (&self.pyramid.levels[self.level], ObjectIs::by(&self.params));
        object.depth(image.intensity(p, object.background(), &mut KnownCell::default()), self.level_iso)
    }

    fn bound_gradation(&self, sizes: &mut [f32]) {
        let before = sizes.to_vec();
        let per_length = GRADATION / (ORDINARY * self.model_delta());
        for (u, v) in self.mesh.edges() {
            let growth = per_length * self.mesh.position(u).distance(self.mesh.position(v));
            for (a, b) in [(u.index(), v.index()), (v.index(), u.index())] {
                let most = before[b] + growth;
                sizes[a] = if most < sizes[a] { most } else { sizes[a] };
            }
        }
    }

    /// The size at which an edge here would be as far from the contour as it may be.
    fn size_of_edge(&self, u: VertexId, v: VertexId) -> f32 {
        let [p, q] = [u, v].map(|w| self.mesh.position(w));
        let [m, n] = [u, v].map(|w| self.mesh.area_normal(w).normalize_or_zero());
        let misfit = self.distance_to_contour((p + q) * 0.5, (m + n).normalize_or_zero());
        let length = p.distance(q) / (ORDINARY * self.model_delta());
        let [shortened, lengthened] = [COARSE, FINE].map(|within| length * (within / misfit).sqrt());
        // A straight edge gives infinity, which is the largest size.
        if shortened < 1.0 {
            shortened
        } else if lengthened > 1.0 {
            lengthened
        } else {
            1.0
        }
    }

    /// About how far the contour is from a point, along a direction and back, in voxels.
    fn distance_to_contour(&self, p: Vec3, direction: Vec3) -> f32 {
        let [here, ahead, behind] = [p, p + direction * 0.5, p - direction * 0.5].map(|p| self.depth(p));
        let (miss, slope) = (here.abs(), (ahead - behind).abs());
        if miss < FURTHEST * slope { miss / slope } else { FURTHEST }
    }
}
