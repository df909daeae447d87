//! Tracks the surface mesh from one frame to the next (section 4 of the paper that `tracking` follows): prediction,
//! projection, parts without a boundary in the image, folded triangles, and edge bounds.

use super::TrackingParams;
use super::project::{Onto, SpaceTimeSamples};
use super::region::Region;
use super::vote::BoundaryVoting;
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId, curvature, measure};
use crate::pauses::Pauses;
use crate::remesh::{Changes, EdgeBounds, Embedding, restructure_in_slices};
use serde::{Deserialize, Serialize};

/// Number of times that predicted displacements and curvature corrections of the vertices are averaged over neighbours:
/// unsmoothed, either does more harm than good.
const SMOOTHINGS: usize = 5;

/// Largest displacement of a vertex that corrects the inward bias of planes fitted to curved surfaces, in units of the
/// shortest side of a voxel; larger corrections occur at sharp corners.
const MAX_CURVATURE_CORRECTION: f64 = 0.3;

/// Maximum number of passes over the mesh that smooth folded triangles in a frame.
const UNFOLDINGS: usize = 3;

/// Number of times that the mesh is projected onto the boundary in the first frame: it comes from a grid, not from a
/// tracked frame.
pub(super) const FIRST_FRAME_PASSES: usize = 3;

/// A vertex is on a boundary of the image if intensity falls by at least this share of the edge threshold τ from one
/// voxel inside to one voxel outside.
const MIN_STEP: f64 = 0.3;

/// Share of the tangential displacement to the mean of its neighbours by which each vertex is moved in each frame, to
/// space vertices evenly.
const SPACING: f32 = 0.5;

/// Measurements of the tracked surface in one frame, and counts of what tracking did there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct FrameStatistics {
    /// Volume enclosed by the surface, in cubed world units.
    pub volume: f64,
    /// Area of the surface, in squared world units.
    pub area: f64,
    /// Number of triangles of the surface.
    pub triangles: usize,
    /// Number of triangles that are still folded at the end: they face away from the sum of the normals of the three
    /// triangles beside them.
    pub folded: usize,
    /// Number of projections of vertices onto the boundary that failed: there were too few boundary points around the
    /// vertex, the fitted space-time hyperplane was nearly parallel to the frame, or the vertex moved too far.
    pub rejected: usize,
    /// Number of displacements of vertices in projections and curvature corrections that were shortened to avoid
    /// self-intersections.
    pub held_moves: usize,
    /// Number of vertices at which the image shows no boundary: collapsed between walls that have met, grown into gaps
    /// that open, else smoothed.
    pub without_boundary: usize,
    /// Mean number of projection steps per vertex, summed over the projections of all vertices onto the extremal
    /// surface in space-time and in the frame.
    pub steps: f64,
    /// Mean displacement of a vertex by the last projection of all vertices in this frame, in world units.
    pub mean_final_correction: f64,
}

/// The frame that the mesh is tracked into, with its image and parameters.
pub(super) struct FrameContext<'a> {
    pub region: &'a Region,
    pub params: &'a TrackingParams,
    pub frame: usize,
    /// The boundary points around `frame` in time.
    pub samples: &'a SpaceTimeSamples,
    /// The boundary votes, with the level between bright and dark in each window of `frame`.
    pub voting: &'a BoundaryVoting,
    pub pauses: &'a Pauses,
}

/// How the image classifies a point of the surface: on a boundary, or if there is none, whether both sides are bright.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// Intensity falls from inside to outside, or the point is at a side of the processed box that cuts a bright
    /// region.
    Boundary,
    /// No boundary, and both sides are brighter than the level between bright and dark in the window around it; the
    /// surface grows there.
    Bright,
    /// No boundary, and not bright on both sides; also outside the processed box, unless the box cuts a bright region
    /// there.
    Dark,
}

impl FrameContext<'_> {
    /// Classifies a point of the surface, by the intensities at two points on its normal: inside
    /// and outside, at a distance of the shortest side of a voxel.
    pub fn classify(&self, at: Vec3, normal: Vec3) -> Support {
        let region = self.region;
        let displacement = region.from_space.transform_vector3(normal.as_dvec3()).normalize_or_zero()
            * region.spacing.min_element();
        let position = region.to_local(at);
        if let Some(voxel) = region.clamp_into_box(position + displacement) {
            let is_box_side = self.samples.box_side_voxels.binary_search(&voxel).is_ok();
            return if is_box_side { Support::Boundary } else { Support::Dark };
        }
        let [inside, outside] = [position - displacement, position + displacement]
            .map(|position| region.sample(self.frame, position));
        if inside - outside >= MIN_STEP * region.threshold {
            return Support::Boundary;
        }
        let level = self.voting.level_at(region, self.frame, region.nearest(position + displacement));
        let is_bright = level.is_some_and(|level| inside.min(outside) > f64::from(level));
        if is_bright { Support::Bright } else { Support::Dark }
    }
}

/// Tracks one mesh, in the working space, through the frames of a 4D image.
#[derive(Clone, Debug)]
pub(super) struct FrameTracker {
    pub(super) guard: Embedding,
    /// Mean edge length of the mesh in the first frame, in the working space; the edge bounds are multiples of it.
    pub edge: f64,
    pub(super) bounds: EdgeBounds,
}

impl FrameTracker {
    pub fn new(edge: f64) -> Self {
        Self { guard: Embedding::default(), edge, bounds: EdgeBounds { min: 0.0, max: 0.0 } }
    }

    /// Moves the mesh into the frame of `context`. If the parameters say so, it starts from the displacements predicted
    /// from `from`, the boundary points around the frame before, `None` in the first frame. Returns the edits of the
    /// mesh and the statistics of the frame.
    pub async fn track_frame(
        &mut self,
        mesh: &mut Mesh,
        from: Option<&SpaceTimeSamples>,
        context: &FrameContext<'_>,
    ) -> (Changes, FrameStatistics) {
        let mut statistics = FrameStatistics::default();
        let bound = |share: f64| (share * self.edge) as f32;
        self.bounds = EdgeBounds { min: bound(context.params.edge_min), max: bound(context.params.edge_max) };
        let mut changes = Changes::default();
        let mut predicted = match from {
            Some(from) if context.params.prediction => prediction(mesh, context, from).await,
            _ => vec![Vec3::ZERO; mesh.slots()],
        };
        for _ in 0..if from.is_some() { 1 } else { FIRST_FRAME_PASSES } {
            changes += self.project_and_restructure(mesh, predicted, context, &mut statistics).await;
            predicted = vec![Vec3::ZERO; mesh.slots()];
        }
        self.correct_curvature_bias(mesh, context, &mut statistics).await;
        context.pauses.after(mesh.slots()).await;
        statistics.folded = self.unfold(mesh, context.pauses).await;
        context.pauses.after(mesh.slots()).await;
        let measured = measure(&mesh.to_triangles());
        (statistics.volume, statistics.area, statistics.triangles) =
            (measured.volume, measured.area, measured.triangles);
        (changes, statistics)
    }

    /// Projects the mesh, displaced by `offsets` (indexed by vertex slot), onto the extremal surface of the boundary
    /// points of a frame, restores its edge bounds, and treats the vertices at which the image shows no boundary.
    /// Returns the edits of the mesh.
    async fn project_and_restructure(
        &mut self,
        mesh: &mut Mesh,
        offsets: Vec<Vec3>,
        context: &FrameContext<'_>,
        statistics: &mut FrameStatistics,
    ) -> Changes {
        let mut changes = Changes::default();
        self.project_all(mesh, &offsets, context, Onto::SpaceTime, statistics).await;
        changes += restructure_in_slices(mesh, self.bounds, &mut self.guard, context.pauses).await;
        context.pauses.after(mesh.slots()).await;
        self.project_all(mesh, &tangential_displacements(mesh), context, Onto::Frame, statistics).await;
        changes += self.resolve_boundary_loss(mesh, context, statistics).await;
        changes
    }

    /// Corrects the bias of the fitted planes on curved surfaces: a plane lies on the inner side by the variance of the
    /// points along it, R²/8 for points weighted by θ = exp(−4r²/R²) with the radius R of the parameters, times the
    /// mean curvature; that of the triangles between vertices on the surface, which lie on its inner side by e²/8 times
    /// the mean curvature on average, with their edge length e; and that of the points, which lie on the inner side by a²/12
    /// times the mean curvature, as voxels hold the mean intensity over their side a. Vertices move along their normals by as
    /// much, outwards where the surface is convex, but at most by [`MAX_CURVATURE_CORRECTION`].
    async fn correct_curvature_bias(
        &mut self,
        mesh: &mut Mesh,
        context: &FrameContext<'_>,
        statistics: &mut FrameStatistics,
    ) {
        let (radius, side) = (context.params.radius, context.region.spacing.min_element());
        let spread = ((radius * radius + self.edge * self.edge) / 8.0 + side * side / 12.0) as f32;
        let limit = (MAX_CURVATURE_CORRECTION * side) as f32;
        let bends = curvature(&mesh.to_triangles()).mean;
        context.pauses.after(mesh.slots()).await;
        let mut displacements = vec![Vec3::ZERO; mesh.slots()];
        for (v, bend) in mesh.vertices().zip(bends) {
            displacements[v.index()] = mesh.unit_normal(v) * (spread * bend as f32);
        }
        displacements =
            (0..SMOOTHINGS).fold(displacements, |displacements, _| neighbour_means(mesh, &displacements));
        displacements
            .iter_mut()
            .for_each(|displacement| *displacement = displacement.clamp_length_max(limit));
        context.pauses.after(mesh.slots()).await;
        statistics.held_moves += self.move_vertices(mesh, displacements, context.pauses).await;
    }

    /// Moves the vertices of folded triangles, which face away from those around them, to the mean of their neighbours.
    /// Returns the number of triangles that stay folded.
    async fn unfold(&mut self, mesh: &mut Mesh, pauses: &Pauses) -> usize {
        let mut folds = folded(mesh);
        for _ in 0..UNFOLDINGS {
            if folds.is_empty() {
                break;
            }
            let mut displacements = vec![Vec3::ZERO; mesh.slots()];
            for v in folds.into_iter().flatten() {
                displacements[v.index()] = mesh.ring(v).mean(mesh.positions()) - mesh.position(v);
            }
            self.move_vertices(mesh, displacements, pauses).await;
            folds = folded(mesh);
        }
        folds.len()
    }

    /// Projects all vertices, each displaced by `offsets` (by vertex slot) first, onto the extremal surface of the
    /// boundary points. Adds the mean number of steps per vertex to `statistics.steps`, and sets
    /// `statistics.mean_final_correction`.
    async fn project_all(
        &mut self,
        mesh: &mut Mesh,
        offsets: &[Vec3],
        context: &FrameContext<'_>,
        onto: Onto,
        statistics: &mut FrameStatistics,
    ) {
        let all: Vec<VertexId> = mesh.vertices().collect();
        let (steps, total) = self.project(mesh, &all, offsets, context, onto, statistics).await;
        let count = all.len().max(1) as f64;
        statistics.steps += steps as f64 / count;
        statistics.mean_final_correction = total / count;
    }

    /// Projects `vertices`, each displaced by `offsets` (by vertex slot) first, onto the extremal surface of the
    /// boundary points of a frame. A vertex whose projection fails moves by the mean of its neighbours' displacements.
    /// All vertices move at once, with one collision test. Returns the total number of projection steps, and the total
    /// displacement by the projections.
    pub(super) async fn project(
        &mut self,
        mesh: &mut Mesh,
        vertices: &[VertexId],
        offsets: &[Vec3],
        context: &FrameContext<'_>,
        onto: Onto,
        statistics: &mut FrameStatistics,
    ) -> (usize, f64) {
        let mut displacements: Vec<Option<Vec3>> = vec![None; mesh.slots()];
        let mut rejected = Vec::new();
        let (mut steps, mut sum) = (0, 0.0);
        for &v in vertices {
            let from = mesh.position(v) + offsets[v.index()];
            let Some((position, count)) = context.samples.project(context.region.to_local(from), onto) else {
                rejected.push(v);
                continue;
            };
            let to = context.region.to_space(position);
            displacements[v.index()] = Some(to - mesh.position(v));
            steps += count;
            sum += f64::from(to.distance(from));
            context.pauses.after(count).await;
        }
        statistics.rejected += rejected.len();
        let filled_displacements = fill_rejected(mesh, &displacements, &rejected);
        statistics.held_moves += self.move_vertices(mesh, filled_displacements, context.pauses).await;
        context.pauses.after(mesh.slots()).await;
        (steps, sum)
    }

    /// Moves the vertices by `displacements` (by vertex slot), shortened where the surface would intersect itself.
    /// Returns the number of vertices whose displacements were shortened.
    pub(super) async fn move_vertices(
        &mut self,
        mesh: &mut Mesh,
        mut displacements: Vec<Vec3>,
        pauses: &Pauses,
    ) -> usize {
        self.guard.sync_with_edge(mesh, self.bounds.max);
        pauses.after(mesh.slots()).await;
        let all: Vec<VertexId> = mesh.vertices().collect();
        self.guard.move_some_in_slices(mesh, &all, &mut displacements, pauses).await.len()
    }
}

/// Predicts the displacement of each vertex to the next frame, indexed by vertex slot, from the slope of the extremal
/// surface in space-time; it is smoothed over the mesh.
async fn prediction(mesh: &Mesh, context: &FrameContext<'_>, samples: &SpaceTimeSamples) -> Vec<Vec3> {
    let region = context.region;
    let mut displacements = vec![Vec3::ZERO; mesh.slots()];
    for v in mesh.vertices() {
        let at = region.to_local(mesh.position(v));
        displacements[v.index()] =
            samples.prediction(at).map_or(Vec3::ZERO, |displacement| region.direction_to_space(displacement));
        context.pauses.after(1).await;
    }
    (0..SMOOTHINGS).fold(displacements, |displacements, _| neighbour_means(mesh, &displacements))
}

/// Returns for each vertex a tangential displacement towards the mean of its neighbours, indexed by vertex slot, to
/// space vertices evenly.
fn tangential_displacements(mesh: &Mesh) -> Vec<Vec3> {
    let mut displacements = vec![Vec3::ZERO; mesh.slots()];
    for v in mesh.vertices() {
        let normal = mesh.unit_normal(v);
        let displacement = mesh.ring(v).mean(mesh.positions()) - mesh.position(v);
        displacements[v.index()] = (displacement - normal * normal.dot(displacement)) * SPACING;
    }
    displacements
}

/// Returns for each vertex the mean of its neighbours' displacements, indexed by vertex slot, to smooth displacements
/// over the mesh.
fn neighbour_means(mesh: &Mesh, displacements: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; displacements.len()];
    for v in mesh.vertices() {
        out[v.index()] = mesh.ring(v).mean(displacements);
    }
    out
}

/// Returns `displacements`, indexed by vertex slot, where each vertex in `rejected`, whose projection failed, gets the
/// mean of its neighbours' known displacements; 0 without any.
fn fill_rejected(mesh: &Mesh, displacements: &[Option<Vec3>], rejected: &[VertexId]) -> Vec<Vec3> {
    let mut out: Vec<Vec3> =
        displacements.iter().map(|displacement| displacement.unwrap_or(Vec3::ZERO)).collect();
    for &v in rejected {
        let known = mesh.ring(v).as_slice().iter().filter_map(|w| displacements[w.index()]);
        let (sum, count) =
            known.fold((Vec3::ZERO, 0.0f32), |(sum, count), displacement| (sum + displacement, count + 1.0));
        out[v.index()] = sum * (1.0 / count.max(1.0));
    }
    out
}

/// Returns the folded triangles, those that face away from the sum of the normals of the three triangles beside them.
fn folded(mesh: &Mesh) -> Vec<[VertexId; 3]> {
    let normal = |[a, b, c]: [VertexId; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.position(v));
        (b - a).cross(c - a)
    };
    let across =
        |a: VertexId, b: VertexId| mesh.ring(a).before(b).map_or(Vec3::ZERO, |tip| normal([b, a, tip]));
    let mut folded = Vec::new();
    for v in mesh.vertices() {
        // Each triangle once, from its lowest corner.
        for (a, b) in mesh.ring(v).pairs().filter(|&(a, b)| v < a && v < b) {
            if (across(v, a) + across(a, b) + across(b, v)).dot(normal([v, a, b])) < 0.0 {
                folded.push([v, a, b]);
            }
        }
    }
    folded
}
