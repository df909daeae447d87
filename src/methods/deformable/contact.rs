//! Topology changes that the image agrees with.
//!
//! The paper joins whatever is nearer than 2.5/√3 δ (3), and cuts every neck whose edges are shorter than δ. So each wall, gap,
//! strand and tunnel thinner than that is lost. Here the image is asked first: a wall or a strand that has matter in it stays, and
//! so does a gap or a tunnel that has background in it.

use super::DeformableParams;
use super::contour::ObjectIs;
use super::image::LevelImage;
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{TopologyGuide, Unguided};
use crate::volume::KnownCell;

/// Where between two vertices in contact the image is sampled, as shares of the way.
const SAMPLES: [f32; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// The cosine from which on a vertex in contact faces the other one.
const FACING: f32 = 0.3;

/// How far off the contour, in voxels, a surface at rest may be: what is no further beside it is no reason to join or cut.
const BLUR: f32 = 0.15;

/// How far within a small component, from its vertices, the image is sampled, in voxels.
const WITHIN: f32 = 0.35;

/// Allows the topology changes that separate or unite what the image does.
#[derive(Clone, Copy)]
pub(super) struct ImageGuide<'a> {
    pub(super) image: &'a LevelImage,
    pub(super) iso: f32,
    pub(super) object: ObjectIs,
}

impl<'a> ImageGuide<'a> {
    pub(super) fn new(image: &'a LevelImage, iso: f32, params: &DeformableParams) -> Self {
        Self { image, iso, object: ObjectIs::by(params) }
    }

    fn depth(&self, p: Vec3) -> f32 {
        let intensity = self.image.intensity(p, self.object.background(), &mut KnownCell::default());
        self.object.depth(intensity, self.iso)
    }

    /// Whether all points are object, or all are background, by more than what the surface may be off the contour at rest.
    fn are_all(&self, is_object: bool, points: &[Vec3], tolerance: f32) -> bool {
        points.iter().all(|&p| {
            let depth = self.depth(p);
            if is_object { depth >= tolerance } else { depth < -tolerance }
        })
    }

    /// By how much intensities change over [`BLUR`] along the normals of some vertices, at most. In the midst of matter or
    /// background that is nothing; on the contour it tells what is beside it.
    fn tolerance(&self, mesh: &Mesh, vertices: &[VertexId]) -> f32 {
        vertices.iter().fold(0.0, |most, &v| {
            let (p, half) = (mesh.position(v), mesh.area_normal(v).normalize_or_zero() * 0.5);
            let [inside, here, outside] = [p - half, p, p + half].map(|p| self.depth(p));
            // In a slit or a thin wall both sides are alike: each counts by itself.
            let tolerance = 2.0 * BLUR * (outside - here).abs().max((here - inside).abs());
            if tolerance > most { tolerance } else { most }
        })
    }
}

/// What decides on topology changes with those parameters.
pub(super) fn guide<'a>(
    image: &'a LevelImage,
    iso: f32,
    params: &DeformableParams,
) -> Box<dyn TopologyGuide + 'a> {
    if params.yields_to_image() { Box::new(ImageGuide::new(image, iso, params)) } else { Box::new(Unguided) }
}

impl TopologyGuide for ImageGuide<'_> {
    /// Across a gap, where their outward sides face each other, if all between the two is object; across a wall, where their inward
    /// sides do, if none of it is. Two that do not face each other are on one sheet.
    fn may_join(&self, mesh: &Mesh, [u, v]: [VertexId; 2]) -> bool {
        let (p, way) = (mesh.position(u), mesh.position(v) - mesh.position(u));
        let [m, n] = [u, v].map(|w| way.normalize_or_zero().dot(mesh.area_normal(w).normalize_or_zero()));
        let is_gap = match (m, n) {
            (m, n) if m > FACING && n < -FACING => true,
            (m, n) if m < -FACING && n > FACING => false,
            _ => return false,
        };
        self.are_all(is_gap, &SAMPLES.map(|share| p + way * share), self.tolerance(mesh, &[u, v]))
    }

    /// A strand if its middle is background, a tunnel if its middle is object.
    fn may_cut(&self, mesh: &Mesh, ring: [VertexId; 3]) -> bool {
        let corners = ring.map(|w| mesh.position(w));
        let middle = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
        let outwards: f32 =
            (0..3).map(|k| mesh.area_normal(ring[k]).normalize_or_zero().dot(corners[k] - middle)).sum();
        let is_strand = outwards > 0.0;
        self.are_all(!is_strand, &[middle], self.tolerance(mesh, &ring))
    }

    /// Not if the edge leads through a wall or across a gap, between sides that face away from each other or each other: the two would
    /// become one, and at a rim so would the next.
    fn may_collapse(&self, mesh: &Mesh, [u, v]: [VertexId; 2]) -> bool {
        let [m, n] = [u, v].map(|w| mesh.area_normal(w).normalize_or_zero());
        if m.dot(n) >= -FACING {
            return true;
        }
        let (p, q) = (mesh.position(u), mesh.position(v));
        let is_wall = (q - p).dot(n - m) > 0.0;
        !self.are_all(is_wall, &[(p + q) * 0.5], self.tolerance(mesh, &[u, v]))
    }

    fn has_content(&self, mesh: &Mesh, members: &[VertexId], is_solid: bool) -> bool {
        let side = if is_solid { -WITHIN } else { WITHIN };
        let within = |&w: &VertexId| mesh.position(w) + mesh.area_normal(w).normalize_or_zero() * side;
        let depth: f32 = members.iter().map(|w| self.depth(within(w))).sum();
        if is_solid { depth > 0.0 } else { depth < 0.0 }
    }
}
