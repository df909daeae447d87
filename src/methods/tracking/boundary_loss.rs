//! Handles parts of the tracked surface that have lost their boundary (step in intensity) in the image, or have none
//! yet. Where two walls have met, inside and outside have the same intensity: the surface between them would remain as
//! a sheet without volume, which causes folds, so it is collapsed. Where a gap opens, the bright region advances faster
//! than boundary points can attract the surface, so the surface grows into it.

use super::frame_tracker::{FrameContext, FrameStatistics, FrameTracker, Support};
use super::project::Onto;
use crate::math::Vec3;
use crate::math::order::{combined_rank, rank_f32, sort_by_rank};
use crate::mesh::{Mesh, VertexId};
use crate::pauses::Pauses;
use crate::remesh::{Changes, restructure_in_slices};
use crate::spatial::PointGrid;
use std::collections::BTreeSet;

/// Maximum number of rounds in a frame that search for vertices at which the image shows no boundary, and collapse,
/// grow or smooth the surface there.
const ROUNDS: usize = 10;
/// Minimum number of rounds in a frame that treat vertices at which the image shows no boundary, as long as there are
/// such vertices.
const MIN_ROUNDS: usize = 2;

/// Rounds that treat vertices at which the image shows no boundary end, after [`MIN_ROUNDS`], when at least this share
/// of these vertices is left from one round to the next.
const LITTLE_PROGRESS: f64 = 0.9;

/// Number of times that the vertices at which the image shows no boundary are moved in each round that treats them.
const MOVES: usize = 2;

/// Largest distance between the two walls of a sheet, which is what remains of the surface between two regions that
/// have met; in units of the shortest side of a voxel.
const THICKNESS: f64 = 1.5;

/// Largest cosine between the normals of the two walls of a sheet, which face away from each other; a sheet is what
/// remains of the surface between two regions that have met.
const OPPOSITE: f32 = -0.3;

/// Share of the displacement to the mean of its neighbours that is added to the outward displacement of a vertex where
/// the surface grows into a bright region, to keep the surface smooth.
const SMOOTHING: f32 = 0.5;

impl FrameTracker {
    /// Treats the vertices at which the image shows no boundary: collapses sheets between walls that have met, grows
    /// the surface into bright regions, and smooths the rest. Counts these vertices in `statistics`, and returns the
    /// numbers of edits of the mesh.
    pub async fn resolve_boundary_loss(
        &mut self,
        mesh: &mut Mesh,
        context: &FrameContext<'_>,
        statistics: &mut FrameStatistics,
    ) -> Changes {
        let mut changes = Changes::default();
        let mut grown = BTreeSet::new();
        let mut before = usize::MAX;
        for round in 0..ROUNDS {
            let without_boundary = without_boundary(mesh, context);
            context.pauses.after(mesh.slots()).await;
            if round == 0 {
                statistics.without_boundary = without_boundary.len();
            }
            let progresses = (without_boundary.len() as f64) < LITTLE_PROGRESS * before as f64;
            if without_boundary.is_empty() || round >= MIN_ROUNDS && !progresses {
                break;
            }
            before = without_boundary.len();
            let sheets = on_sheets(mesh, &without_boundary, context);
            context.pauses.after(without_boundary.len()).await;
            let collapsed = self.collapse_sheets(mesh, &sheets, context.pauses).await;
            if collapsed > 0 {
                changes.deletions += collapsed;
                changes += restructure_in_slices(mesh, self.bounds, &mut self.guard, context.pauses).await;
            }
            for _ in 0..MOVES {
                grown.extend(self.move_without_boundary(mesh, context).await);
                context.pauses.after(mesh.slots()).await;
            }
        }
        // Growing has brought these vertices near points of the boundary.
        let grown: Vec<VertexId> = grown.into_iter().filter(|&v| mesh.is_live(v)).collect();
        if !grown.is_empty() {
            let no_offsets = vec![Vec3::ZERO; mesh.slots()];
            self.project(mesh, &grown, &no_offsets, context, Onto::Frame, statistics).await;
        }
        changes
    }

    /// Moves the vertices at which the image shows no boundary: outwards if the image is bright on both sides of them
    /// and they are on no sheet between walls that have met, else to the mean of their neighbours. Returns the vertices
    /// chosen to move outwards.
    async fn move_without_boundary(&mut self, mesh: &mut Mesh, context: &FrameContext<'_>) -> Vec<VertexId> {
        let without_boundary = without_boundary(mesh, context);
        context.pauses.after(mesh.slots()).await;
        let sheets = on_sheets(mesh, &without_boundary, context);
        context.pauses.after(without_boundary.len()).await;
        let voxel = context.region.spacing.min_element() as f32;
        let mut displacements = vec![Vec3::ZERO; mesh.slots()];
        let mut grown = Vec::new();
        for &(v, support) in &without_boundary {
            let to_mean = mesh.ring(v).mean(mesh.positions()) - mesh.position(v);
            let grows = support == Support::Bright && sheets.binary_search(&v).is_err();
            displacements[v.index()] = to_mean;
            if grows {
                displacements[v.index()] = mesh.unit_normal(v) * voxel + to_mean * SMOOTHING;
                grown.push(v);
            }
        }
        self.move_vertices(mesh, displacements, context.pauses).await;
        grown
    }

    /// Collapses the vertices `sheets`, which are on sheets between walls that have met, into their neighbours, from
    /// the innermost vertices to the rim; returns the number of collapses.
    async fn collapse_sheets(&mut self, mesh: &mut Mesh, sheets: &[VertexId], pauses: &Pauses) -> u32 {
        self.guard.sync_with_edge(mesh, self.bounds.max);
        let depth = depths(mesh, sheets);
        let mut order = sheets.to_vec();
        sort_by_rank(&mut order, |v| combined_rank(!depth[v.index()], v.0));
        let mut collapsed = 0;
        for v in order {
            let from = mesh.position(v);
            let ring = mesh.ring(v).as_slice().iter().copied();
            let mut outer: Vec<VertexId> = ring.filter(|w| depth[w.index()] < depth[v.index()]).collect();
            sort_by_rank(&mut outer, |&w| rank_f32(mesh.position(w).distance_squared(from)).into());
            let drawn = outer.into_iter().any(|w| {
                let position = mesh.position(w);
                self.guard.attempt(mesh, |mesh| mesh.collapse(w, v, position)).is_ok()
            });
            collapsed += u32::from(drawn);
            pauses.after(1).await;
        }
        collapsed
    }
}

/// Returns the vertices at which the image shows no boundary, each with what it shows instead (its [`Support`]).
fn without_boundary(mesh: &Mesh, context: &FrameContext) -> Vec<(VertexId, Support)> {
    let support = |v: VertexId| (v, context.classify(mesh.position(v), mesh.area_normal(v)));
    mesh.vertices().map(support).filter(|(_, support)| *support != Support::Boundary).collect()
}

/// Returns the vertices among `without_boundary`, in ascending order, that are on a sheet between walls that have met:
/// another vertex of `without_boundary` within [`THICKNESS`] faces the opposite way.
fn on_sheets(mesh: &Mesh, without_boundary: &[(VertexId, Support)], context: &FrameContext) -> Vec<VertexId> {
    let thickness = (THICKNESS * context.region.spacing.min_element()) as f32;
    let positions: Vec<Vec3> = without_boundary.iter().map(|&(v, _)| mesh.position(v)).collect();
    let normals: Vec<Vec3> = without_boundary.iter().map(|&(v, _)| mesh.unit_normal(v)).collect();
    let grid = PointGrid::of(&positions, thickness);
    let has_opposite = |i: usize| {
        let mut found = false;
        grid.within(positions[i], thickness, |j, _| {
            found = normals[i].dot(normals[j as usize]) < OPPOSITE;
            !found
        });
        found
    };
    (0..without_boundary.len()).filter(|&i| has_opposite(i)).map(|i| without_boundary[i].0).collect()
}

/// Returns for each vertex of `sheets` the number of edges to the nearest vertex that is not in `sheets`, indexed by
/// vertex slot, as the order of collapses: `u32::MAX` if there is none, 0 for vertices that are not in `sheets`.
fn depths(mesh: &Mesh, sheets: &[VertexId]) -> Vec<u32> {
    let mut depth = vec![0; mesh.slots()];
    sheets.iter().for_each(|v| depth[v.index()] = u32::MAX);
    let is_rim = |v: &&VertexId| mesh.ring(**v).as_slice().iter().any(|w| depth[w.index()] == 0);
    let mut front: Vec<VertexId> = sheets.iter().filter(is_rim).copied().collect();
    front.iter().for_each(|v| depth[v.index()] = 1);
    while let Some(&first) = front.first() {
        let next_depth = depth[first.index()] + 1;
        let mut next = Vec::new();
        for v in front {
            for &w in mesh.ring(v).as_slice() {
                if depth[w.index()] == u32::MAX {
                    depth[w.index()] = next_depth;
                    next.push(w);
                }
            }
        }
        front = next;
    }
    depth
}
