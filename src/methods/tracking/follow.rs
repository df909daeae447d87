//! Tracks the mesh from one frame to the next (section 4): prediction, projection, parts without a boundary, folds, and
//! connectivity.

use super::TrackingParams;
use super::project::{Moment, Onto};
use super::region::Region;
use super::vote::Voting;
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId, curvature, measure};
use crate::remesh::{Changes, EdgeBounds, Embedding, restructure};
use serde::{Deserialize, Serialize};

/// Smoothing passes over the mesh for predictions and curvature corrections: raw, either is worse than none.
const SMOOTHINGS: usize = 5;

/// Largest curvature correction of a vertex, in the shortest side of a voxel; larger ones occur at sharp corners.
const MOST_UNBENT: f64 = 0.3;

/// Maximum number of passes that smooth folds in a frame.
const UNFOLDINGS: usize = 3;

/// Number of times that the mesh is projected in the first frame: it comes from a grid, not from a tracked frame.
const FIRST_SETTLINGS: usize = 3;

/// A vertex is on a boundary if intensity falls along its normal by at least this share of τ.
const LEAST_STEP: f64 = 0.3;

/// Share of the tangential displacement to the mean of the neighbours by which vertices are spaced in each frame.
const SPACING: f32 = 0.5;

/// Measurements of the surface in one frame, and counts of what tracking did there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameFacts {
    /// Volume enclosed by the surface, in cubed world units.
    pub volume: f64,
    /// Area of the surface, in squared world units.
    pub area: f64,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of folded triangles, which face away from the sum of their three neighbours.
    pub folded: usize,
    /// Number of projections that found no points or moved too far.
    pub rejected: usize,
    /// Number of vertex moves in projections and curvature corrections that were shortened to avoid self-intersections.
    pub held: usize,
    /// Number of vertices without a boundary: collapsed between walls that have met, grown into gaps that open, else
    /// smoothed.
    pub retracted: usize,
    /// Mean number of projection steps per vertex, over the projections onto space-time and onto the frame together.
    pub steps: f64,
    /// Mean displacement of the vertices by the last projection, in world units.
    pub correction: f64,
}

/// The frame that the mesh is tracked into, with its image and parameters.
pub(super) struct Going<'a> {
    pub region: &'a Region,
    pub params: &'a TrackingParams,
    pub frame: usize,
    /// The boundary points around that frame in time.
    pub into: &'a Moment,
    /// The levels between bright and dark; those of that frame are known.
    pub voting: &'a Voting,
}

/// The image around a point of the surface: whether there is a boundary, and if not, its intensity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ground {
    /// Inside is brighter than outside, or the box cuts a bright region.
    Boundary,
    /// Both sides are bright.
    Bright,
    /// Neither of these.
    Dark,
}

impl Going<'_> {
    /// Classifies a point of the surface by the intensities one voxel inside and one voxel outside, in the shortest
    /// side of a voxel.
    pub fn ground(&self, at: Vec3, normal: Vec3) -> Ground {
        let region = self.region;
        let way = region.from_world.transform_vector3(normal.as_dvec3()).normalize_or_zero()
            * region.spacing.min_element();
        let place = region.place(at);
        if let Some(voxel) = region.nearest_inside(place + way) {
            let is_cut = self.into.cut.binary_search(&voxel).is_ok();
            return if is_cut { Ground::Boundary } else { Ground::Dark };
        }
        let [inside, outside] = [place - way, place + way].map(|place| region.sample(self.frame, place));
        if inside - outside >= LEAST_STEP * region.threshold {
            return Ground::Boundary;
        }
        let level = self.voting.level_at(region, self.frame, region.nearest(place + way));
        let is_bright = level.is_some_and(|level| inside.min(outside) > f64::from(level));
        if is_bright { Ground::Bright } else { Ground::Dark }
    }
}

/// Tracks one mesh, in world coordinates, through the frames.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    pub(super) guard: Embedding,
    /// Mean edge length of the mesh in the first frame; the edge bounds are multiples of it.
    pub edge: f64,
    pub(super) bounds: EdgeBounds,
}

impl Follower {
    pub fn new(edge: f64) -> Self {
        Self { guard: Embedding::default(), edge, bounds: EdgeBounds { min: 0.0, max: 0.0 } }
    }

    /// Moves the mesh into the next frame, with a prediction from the samples of the frame before, if any.
    pub fn go(&mut self, mesh: &mut Mesh, from: Option<&Moment>, going: &Going) -> (Changes, FrameFacts) {
        let mut facts = FrameFacts::default();
        let bound = |share: f64| (share * self.edge) as f32;
        self.bounds = EdgeBounds { min: bound(going.params.edge_min), max: bound(going.params.edge_max) };
        let mut changes = Changes::default();
        let mut predicted = match from {
            Some(from) if going.params.prediction => prediction(mesh, going.region, from),
            _ => vec![Vec3::ZERO; mesh.slots()],
        };
        for _ in 0..if from.is_some() { 1 } else { FIRST_SETTLINGS } {
            changes += self.settle(mesh, predicted, going, &mut facts);
            predicted = vec![Vec3::ZERO; mesh.slots()];
        }
        self.unbend(mesh, going, &mut facts);
        facts.folded = self.unfold(mesh);
        let measured = measure(&mesh.to_triangles());
        (facts.volume, facts.area, facts.triangles) = (measured.volume, measured.area, measured.triangles);
        (changes, facts)
    }

    /// Projects the mesh, displaced by `ahead`, onto the surface of a frame, and restores its edge bounds.
    fn settle(
        &mut self,
        mesh: &mut Mesh,
        ahead: Vec<Vec3>,
        going: &Going,
        facts: &mut FrameFacts,
    ) -> Changes {
        let mut changes = Changes::default();
        self.project_all(mesh, &ahead, going, Onto::SpaceTime, facts);
        changes += restructure(mesh, self.bounds, &mut self.guard);
        self.project_all(mesh, &spacing(mesh), going, Onto::Frame, facts);
        changes += self.retract(mesh, going, facts);
        changes
    }

    /// Corrects the bias of the fitted planes on curved surfaces: a plane lies on the inner side by the variance of the
    /// points along it, R²/8 for θ = exp(−4r²/R²), times the mean curvature. Vertices move along their normals by as
    /// much, outwards where the surface is convex.
    fn unbend(&mut self, mesh: &mut Mesh, going: &Going, facts: &mut FrameFacts) {
        let spread = (going.params.radius * going.params.radius / 8.0) as f32;
        let most = (MOST_UNBENT * going.region.spacing.min_element()) as f32;
        let bends = curvature(&mesh.to_triangles()).mean;
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        for (v, bend) in mesh.vertices().zip(bends) {
            ways[v.index()] = mesh.area_normal(v).normalize_or_zero() * (spread * bend as f32);
        }
        ways = (0..SMOOTHINGS).fold(ways, |ways, _| means(mesh, &ways));
        ways.iter_mut().for_each(|way| *way = way.clamp_length_max(most));
        facts.held += self.carry(mesh, ways);
    }

    /// Moves the vertices of folded triangles to the mean of their neighbours. Returns the number of triangles that
    /// stay folded.
    fn unfold(&mut self, mesh: &mut Mesh) -> usize {
        let mut folds = folded(mesh);
        for _ in 0..UNFOLDINGS {
            if folds.is_empty() {
                break;
            }
            let mut ways = vec![Vec3::ZERO; mesh.slots()];
            for v in folds.into_iter().flatten() {
                ways[v.index()] = middle(mesh, v) - mesh.position(v);
            }
            self.carry(mesh, ways);
            folds = folded(mesh);
        }
        folds.len()
    }

    /// Projects all vertices, and adds the mean number of steps and the mean displacement to `facts`.
    fn project_all(
        &mut self,
        mesh: &mut Mesh,
        ahead: &[Vec3],
        going: &Going,
        onto: Onto,
        facts: &mut FrameFacts,
    ) {
        let all: Vec<VertexId> = mesh.vertices().collect();
        let (steps, way) = self.project(mesh, &all, ahead, going, onto, facts);
        let count = all.len().max(1) as f64;
        facts.steps += steps as f64 / count;
        facts.correction = way / count;
    }

    /// Projects vertices onto the surface of a frame, each displaced by `ahead` first. All move at once, with one
    /// collision test. Returns the total number of steps, and the total displacement by the projection.
    pub(super) fn project(
        &mut self,
        mesh: &mut Mesh,
        vertices: &[VertexId],
        ahead: &[Vec3],
        going: &Going,
        onto: Onto,
        facts: &mut FrameFacts,
    ) -> (usize, f64) {
        let mut ways: Vec<Option<Vec3>> = vec![None; mesh.slots()];
        let mut rejected = Vec::new();
        let (mut steps, mut sum) = (0, 0.0);
        for &v in vertices {
            let from = mesh.position(v) + ahead[v.index()];
            let Some((place, count)) = going.into.project(going.region.place(from), onto) else {
                rejected.push(v);
                continue;
            };
            let to = going.region.world(place);
            ways[v.index()] = Some(to - mesh.position(v));
            steps += count;
            sum += f64::from(to.distance(from));
        }
        facts.rejected += rejected.len();
        let filled = filled(mesh, &ways, &rejected);
        facts.held += self.carry(mesh, filled);
        (steps, sum)
    }

    /// Moves the vertices by `ways` under the collision guard. Returns the number held back.
    pub(super) fn carry(&mut self, mesh: &mut Mesh, mut ways: Vec<Vec3>) -> usize {
        self.guard.sync_with_edge(mesh, self.bounds.max);
        self.guard.move_all(mesh, &mut ways).len()
    }
}

/// Predicts the displacement of each vertex to the next frame, by slot, from the slope of the space-time surface;
/// smoothed over the mesh.
fn prediction(mesh: &Mesh, region: &Region, moment: &Moment) -> Vec<Vec3> {
    let mut ways = vec![Vec3::ZERO; mesh.slots()];
    for v in mesh.vertices() {
        let at = region.place(mesh.position(v));
        ways[v.index()] = moment.prediction(at).map_or(Vec3::ZERO, |way| region.direction(way));
    }
    (0..SMOOTHINGS).fold(ways, |ways, _| means(mesh, &ways))
}

/// Returns tangential displacements towards the mean of the neighbours, by slot, which even out the vertices.
fn spacing(mesh: &Mesh) -> Vec<Vec3> {
    let mut ways = vec![Vec3::ZERO; mesh.slots()];
    for v in mesh.vertices() {
        let normal = mesh.area_normal(v).normalize_or_zero();
        let way = middle(mesh, v) - mesh.position(v);
        ways[v.index()] = (way - normal * normal.dot(way)) * SPACING;
    }
    ways
}

pub(super) fn middle(mesh: &Mesh, v: VertexId) -> Vec3 {
    let ring = mesh.ring(v).as_slice();
    ring.iter().fold(Vec3::ZERO, |sum, &w| sum + mesh.position(w)) * (1.0 / ring.len() as f32)
}

/// Returns for each vertex the mean of its neighbours' displacements.
fn means(mesh: &Mesh, ways: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; ways.len()];
    for v in mesh.vertices() {
        let ring = mesh.ring(v).as_slice();
        out[v.index()] =
            ring.iter().fold(Vec3::ZERO, |sum, w| sum + ways[w.index()]) * (1.0 / ring.len() as f32);
    }
    out
}

/// Fills in each `rejected` vertex with the mean displacement of its neighbours.
fn filled(mesh: &Mesh, ways: &[Option<Vec3>], rejected: &[VertexId]) -> Vec<Vec3> {
    let mut out: Vec<Vec3> = ways.iter().map(|way| way.unwrap_or(Vec3::ZERO)).collect();
    for &v in rejected {
        let known = mesh.ring(v).as_slice().iter().filter_map(|w| ways[w.index()]);
        let (sum, count) = known.fold((Vec3::ZERO, 0.0f32), |(sum, count), way| (sum + way, count + 1.0));
        out[v.index()] = sum * (1.0 / count.max(1.0));
    }
    out
}

/// Returns the triangles that face away from the sum of their three neighbours.
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
