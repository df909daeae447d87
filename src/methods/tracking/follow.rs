//! From one frame to the next (section 4): prediction, projection, what has no boundary any more, and connectivity.

use super::TrackingParams;
use super::project::{Moment, Onto};
use super::region::Region;
use crate::math::Vec3;
use crate::mesh::{Mesh, TriangleMesh, VertexId, curvature, measure};
use crate::remesh::{Changes, EdgeBounds, Embedding, restructure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How often predictions and bends are smoothed over the mesh: raw, they are worse than none.
const SMOOTHINGS: usize = 5;

/// What a bend takes away is given back up to this, in the shortest side of a voxel: where it is more, it is a corner.
const MOST_UNBENT: f64 = 0.3;

/// How often the first frame is settled: its mesh comes from a grid, not from a frame before.
const FIRST_SETTLINGS: usize = 3;

/// A vertex with less of a step in intensity along its normal than this share of τ is on no boundary.
const LEAST_STEP: f64 = 0.3;

/// By how much of the way to the middle of their neighbours vertices are spaced along the surface in a frame.
const SPACING: f32 = 0.5;

/// What happened in a frame, and what came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameFacts {
    /// What the surface encloses, cubed world units.
    pub volume: f64,
    /// Its area, squared world units.
    pub area: f64,
    /// Its triangles.
    pub triangles: usize,
    /// Those that face away from their three neighbours.
    pub folded: usize,
    /// Projections that led nowhere, or too far.
    pub rejected: usize,
    /// Moves that were held back, so that nothing crosses.
    pub held: usize,
    /// Vertices that had no boundary any more and were drawn together with their neighbours.
    pub retracted: usize,
    /// Steps of the projections, in the mean.
    pub steps: f64,
    /// How far the last projection moved the vertices, in the mean, world units.
    pub correction: f64,
}

/// Into which frame it goes, and by what.
pub(super) struct Going<'a> {
    pub region: &'a Region,
    pub params: &'a TrackingParams,
    pub frame: usize,
    /// What is around that frame.
    pub into: &'a Moment,
}

impl Going<'_> {
    /// Whether the image is brighter one voxel inside than one outside, or the box cuts what is bright.
    pub fn is_boundary(&self, at: Vec3, normal: Vec3) -> bool {
        let region = self.region;
        let way = region.from_world.transform_vector3(normal.as_dvec3()).normalize_or_zero()
            * region.spacing.min_element();
        let place = region.place(at);
        if let Some(voxel) = region.nearest_inside(place + way) {
            return self.into.cut.binary_search(&voxel).is_ok();
        }
        let [inside, outside] = [place - way, place + way].map(|place| region.sample(self.frame, place));
        inside - outside >= LEAST_STEP * region.threshold
    }
}

/// Takes one mesh, in the world, through the frames.
#[derive(Clone, Debug)]
pub(super) struct Follower {
    pub(super) guard: Embedding,
    /// The mean edge of the first frame's mesh.
    pub edge: f64,
    pub(super) bounds: EdgeBounds,
}

impl Follower {
    pub fn new(edge: f64) -> Self {
        Self { guard: Embedding::default(), edge, bounds: EdgeBounds { min: 0.0, max: 0.0 } }
    }

    /// Into the next frame, from what is around the one before where there is one.
    pub fn go(&mut self, mesh: &mut Mesh, from: Option<&Moment>, going: &Going) -> (Changes, FrameFacts) {
        let mut facts = FrameFacts::default();
        let bound = |share: f64| (share * self.edge) as f32;
        self.bounds = EdgeBounds { min: bound(going.params.edge_min), max: bound(going.params.edge_max) };
        if let (Some(from), true) = (from, going.params.prediction) {
            self.predict(mesh, going.region, from, &mut facts);
        }
        let mut changes = Changes::default();
        for _ in 0..if from.is_some() { 1 } else { FIRST_SETTLINGS } {
            changes += self.settle(mesh, going, &mut facts);
        }
        self.unbend(mesh, going, &mut facts);
        let triangles = mesh.to_triangles();
        let measured = measure(&triangles);
        (facts.volume, facts.area, facts.triangles) = (measured.volume, measured.area, measured.triangles);
        facts.folded = folded(&triangles);
        (changes, facts)
    }

    /// On to where the surface is going to be in the next frame, by how it passes through `moment`.
    fn predict(&mut self, mesh: &mut Mesh, region: &Region, moment: &Moment, facts: &mut FrameFacts) {
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        for v in mesh.vertices() {
            let at = region.place(mesh.position(v));
            let way = moment.prediction(at).map_or(Vec3::ZERO, |way| region.direction(way));
            ways[v.index()] = way;
        }
        for _ in 0..SMOOTHINGS {
            ways = means(mesh, &ways);
        }
        facts.held += self.carry(mesh, ways);
    }

    /// Onto the surface of a frame, with edges in bounds.
    fn settle(&mut self, mesh: &mut Mesh, going: &Going, facts: &mut FrameFacts) -> Changes {
        let mut changes = Changes::default();
        self.project(mesh, going, Onto::SpaceTime, facts);
        changes += restructure(mesh, self.bounds, &mut self.guard);
        self.space(mesh);
        self.project(mesh, going, Onto::Frame, facts);
        changes += self.retract(mesh, going, facts);
        changes
    }

    /// The plane through the points of a bent surface lies on its inner side: by the spread of the points along it, R²/8 for
    /// θ = exp(−4r²/R²), times the mean curvature. Vertices go back by as much.
    fn unbend(&mut self, mesh: &mut Mesh, going: &Going, facts: &mut FrameFacts) {
        let spread = (going.params.radius * going.params.radius / 8.0) as f32;
        let most = (MOST_UNBENT * going.region.spacing.min_element()) as f32;
        let bends = curvature(&mesh.to_triangles()).mean;
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        for (v, bend) in mesh.vertices().zip(bends) {
            ways[v.index()] = mesh.area_normal(v).normalize_or_zero() * (spread * bend as f32);
        }
        for _ in 0..SMOOTHINGS {
            ways = means(mesh, &ways);
        }
        ways.iter_mut().for_each(|way| *way = way.clamp_length_max(most));
        facts.held += self.carry(mesh, ways);
    }

    fn project(&mut self, mesh: &mut Mesh, going: &Going, onto: Onto, facts: &mut FrameFacts) {
        let Going { region, into, .. } = going;
        let mut ways: Vec<Option<Vec3>> = vec![None; mesh.slots()];
        let (mut steps, mut sum) = (0, 0.0);
        for v in mesh.vertices() {
            if let Some((place, count)) = into.project(region.place(mesh.position(v)), onto) {
                let way = region.world(place) - mesh.position(v);
                ways[v.index()] = Some(way);
                steps += count;
                sum += f64::from(way.length());
            }
        }
        let count = mesh.vertex_count().max(1) as f64;
        let found = mesh.vertices().filter(|v| ways[v.index()].is_some()).count();
        facts.rejected += mesh.vertex_count() - found;
        (facts.steps, facts.correction) = (steps as f64 / count, sum / count);
        let filled = filled(mesh, &ways);
        facts.held += self.carry(mesh, filled);
    }

    /// Vertices along the surface towards the middle of their neighbours.
    fn space(&mut self, mesh: &mut Mesh) {
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        for v in mesh.vertices() {
            let normal = mesh.area_normal(v).normalize_or_zero();
            let way = middle(mesh, v) - mesh.position(v);
            ways[v.index()] = (way - normal * normal.dot(way)) * SPACING;
        }
        self.carry(mesh, ways);
    }

    /// How many were held back.
    pub(super) fn carry(&mut self, mesh: &mut Mesh, mut ways: Vec<Vec3>) -> usize {
        self.guard.follow_with(mesh, self.bounds.max);
        self.guard.carry(mesh, &mut ways).len()
    }
}

pub(super) fn middle(mesh: &Mesh, v: VertexId) -> Vec3 {
    let ring = mesh.ring(v).as_slice();
    ring.iter().fold(Vec3::ZERO, |sum, &w| sum + mesh.position(w)) * (1.0 / ring.len() as f32)
}

/// Each the mean of those of the neighbours.
fn means(mesh: &Mesh, ways: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; ways.len()];
    for v in mesh.vertices() {
        let ring = mesh.ring(v).as_slice();
        out[v.index()] =
            ring.iter().fold(Vec3::ZERO, |sum, w| sum + ways[w.index()]) * (1.0 / ring.len() as f32);
    }
    out
}

/// With the mean of their neighbours where there are none.
fn filled(mesh: &Mesh, ways: &[Option<Vec3>]) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; ways.len()];
    for v in mesh.vertices() {
        out[v.index()] = ways[v.index()].unwrap_or_else(|| {
            let known = mesh.ring(v).as_slice().iter().filter_map(|w| ways[w.index()]);
            let (sum, count) = known.fold((Vec3::ZERO, 0.0), |(sum, count), way| (sum + way, count + 1.0));
            if count > 0.0 { sum * (1.0 / count) } else { Vec3::ZERO }
        });
    }
    out
}

/// Triangles that face away from the sum of their three neighbours.
fn folded(mesh: &TriangleMesh) -> usize {
    let normals: Vec<Vec3> = mesh.corners().map(|[a, b, c]| (b - a).cross(c - a)).collect();
    // The triangle to the left of each edge, from end to end.
    let left: BTreeMap<[u32; 2], usize> = (mesh.triangles.iter().enumerate())
        .flat_map(|(t, &[a, b, c])| [([a, b], t), ([b, c], t), ([c, a], t)])
        .collect();
    let faces_away = |t: usize| {
        let [a, b, c] = mesh.triangles[t];
        let across = [[b, a], [c, b], [a, c]].map(|edge| left.get(&edge).map_or(Vec3::ZERO, |&t| normals[t]));
        across.into_iter().fold(Vec3::ZERO, |sum, normal| sum + normal).dot(normals[t]) < 0.0
    };
    (0..normals.len()).filter(|&t| faces_away(t)).count()
}
