//! Topology changes decided by the image.
//!
//! The paper joins all non-adjacent vertices nearer to each other than 2.5/√3 δ (3), and cuts every neck whose edges
//! are shorter than δ. Each wall, gap, strand and tunnel thinner than that is lost. Here the image is sampled first: a
//! wall or a strand is kept if there is object in it, a gap or a tunnel if there is background in it.

use super::DeformableParams;
use super::contour::ObjectIs;
use super::image::{LevelImage, is_any_sparse};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{TopologyGuide, Unguided};
use crate::volume::CellCache;

/// The positions of the image samples between two vertices in contact, as shares of their distance; the samples decide
/// whether the vertices may be joined.
const SAMPLES: [f32; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// The cosine above which two vertices face each other across a wall or a gap: for joins, between the normal of each
/// and the direction to or from the other; for collapses, between one normal and the reverse of the other.
const FACING: f32 = 0.3;

/// The largest distance of a settled surface from its contour, in voxels of the finest level. The image decides on
/// joins, cuts and collapses only by intensities that differ from the iso value by more than the image varies over this
/// distance.
const MAX_OFFSET: f32 = 0.15;

/// The distance from the vertices of a small component, towards its enclosed side, at which the image is sampled to
/// decide whether the component is kept, in voxels of the finest level.
const SAMPLE_DEPTH: f32 = 0.35;

/// A topology guide that allows only changes that agree with the image. Sheets are joined across a gap if all between
/// them is object, across a wall if all is background; a strand is cut if its middle is background, a tunnel if its
/// middle is object. Edges are not collapsed across walls and gaps that the image shows, nor are small components
/// removed that it shows.
#[derive(Clone, Copy)]
pub(super) struct ImageGuide<'a> {
    pub(super) image: &'a LevelImage,
    pub(super) iso: f32,
    pub(super) object: ObjectIs,
    /// The box outside of which nothing is changed, since the image is not loaded there.
    within: Option<Bounds>,
}

impl<'a> ImageGuide<'a> {
    pub(super) fn new(image: &'a LevelImage, iso: f32, params: &DeformableParams) -> Self {
        Self { image, iso, object: ObjectIs::by(params), within: None }
    }

    /// Returns whether the image is followed at all of some vertices.
    fn follows(&self, mesh: &Mesh, vertices: &[VertexId]) -> bool {
        !is_any_sparse()
            || self.within.is_none_or(|bounds| vertices.iter().all(|&v| bounds.contains(mesh.position(v))))
    }

    fn depth(&self, p: Vec3) -> f32 {
        let intensity = self.image.intensity(p, self.object.outside(self.iso), &mut CellCache::default());
        self.object.depth(intensity, self.iso)
    }

    /// Returns whether all points, in model space, are in the object if `is_object`, else in the background, with
    /// intensities that differ from the iso value by at least `tolerance`.
    fn are_all(&self, is_object: bool, points: &[Vec3], tolerance: f32) -> bool {
        points.iter().all(|&p| {
            let depth = self.depth(p);
            if is_object { depth >= tolerance } else { depth < -tolerance }
        })
    }

    /// Returns the tolerance with which intensities near some vertices are compared with the iso value to decide on a
    /// topology change: the largest difference of intensity over [`MAX_OFFSET`] along the normals of the vertices. It
    /// is 0 in uniform object or background; at the contour it makes up for vertices that have settled off it.
    fn tolerance(&self, mesh: &Mesh, vertices: &[VertexId]) -> f32 {
        vertices.iter().fold(0.0, |most, &v| {
            let (p, half) = (mesh.position(v), mesh.unit_normal(v) * 0.5);
            let [inside, here, outside] = [p - half, p, p + half].map(|p| self.depth(p));
            // In a slit or a thin wall both sides have like intensities, and their difference tells nothing: each half
            // counts separately.
            let tolerance = 2.0 * MAX_OFFSET * (outside - here).abs().max((here - inside).abs());
            if tolerance > most { tolerance } else { most }
        })
    }
}

/// Returns the rule that decides which topology changes are made: by the image, if the parameters adapt the surface to
/// it; else, as in the paper, all are allowed.
pub(super) fn guide<'a>(
    image: &'a LevelImage,
    iso: f32,
    params: &DeformableParams,
) -> Box<dyn TopologyGuide + 'a> {
    guide_within(image, iso, params, None)
}

/// Returns the rule of [`guide`] for a surface that follows the image only in a box.
pub(super) fn guide_within<'a>(
    image: &'a LevelImage,
    iso: f32,
    params: &DeformableParams,
    within: Option<Bounds>,
) -> Box<dyn TopologyGuide + 'a> {
    if !params.adapts_to_image() {
        return Box::new(Unguided);
    }
    Box::new(ImageGuide { within, ..ImageGuide::new(image, iso, params) })
}

impl TopologyGuide for ImageGuide<'_> {
    /// Allows a join of two vertices by a tube across a gap, where the outward sides of the vertices face each other,
    /// if all samples in between are object; and across a wall, where their inward sides do, if all are background. Two
    /// vertices that do not face each other are on one sheet and are not joined.
    fn may_join(&self, mesh: &Mesh, [u, v]: [VertexId; 2]) -> bool {
        if !self.follows(mesh, &[u, v]) {
            return false;
        }
        let (p, offset) = (mesh.position(u), mesh.position(v) - mesh.position(u));
        let [m, n] = [u, v].map(|w| offset.normalize_or_zero().dot(mesh.unit_normal(w)));
        let is_gap = match (m, n) {
            (m, n) if m > FACING && n < -FACING => true,
            (m, n) if m < -FACING && n > FACING => false,
            _ => return false,
        };
        self.are_all(is_gap, &SAMPLES.map(|share| p + offset * share), self.tolerance(mesh, &[u, v]))
    }

    /// Allows a cut along the cycle of edges `ring` through a strand if its middle is background, and through a tunnel
    /// if its middle is object.
    fn may_cut(&self, mesh: &Mesh, ring: [VertexId; 3]) -> bool {
        if !self.follows(mesh, &ring) {
            return false;
        }
        let corners = ring.map(|w| mesh.position(w));
        let middle = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
        let outwards: f32 = (0..3).map(|k| mesh.unit_normal(ring[k]).dot(corners[k] - middle)).sum();
        let is_strand = outwards > 0.0;
        self.are_all(!is_strand, &[middle], self.tolerance(mesh, &ring))
    }

    /// Forbids collapsing an edge through a wall or across a gap if the image confirms the wall or the gap: the two
    /// sheets would merge there, and at a rim the next pair of vertices would follow.
    fn may_collapse(&self, mesh: &Mesh, [u, v]: [VertexId; 2]) -> bool {
        if !self.follows(mesh, &[u, v]) {
            return false;
        }
        let [m, n] = [u, v].map(|w| mesh.unit_normal(w));
        if m.dot(n) >= -FACING {
            return true;
        }
        let (p, q) = (mesh.position(u), mesh.position(v));
        let is_wall = (q - p).dot(n - m) > 0.0;
        !self.are_all(is_wall, &[(p + q) * 0.5], self.tolerance(mesh, &[u, v]))
    }

    fn has_content(&self, mesh: &Mesh, members: &[VertexId], is_solid: bool) -> bool {
        if !self.follows(mesh, members) {
            return true;
        }
        let side = if is_solid { -SAMPLE_DEPTH } else { SAMPLE_DEPTH };
        let sample_point = |&w: &VertexId| mesh.position(w) + mesh.unit_normal(w) * side;
        let depth: f32 = members.iter().map(|w| self.depth(sample_point(w))).sum();
        if is_solid { depth > 0.0 } else { depth < 0.0 }
    }
}
