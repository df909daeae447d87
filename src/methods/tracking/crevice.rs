//! What has no boundary any more, or not yet. Where two walls of a crevice have met, inside and outside look alike, and the
//! surface would stay between them as a sheet without volume, from which folds come. Where a crevice opens, what is bright goes
//! on before the surface, too far for points of the boundary to pull it there.

use super::follow::{Follower, FrameFacts, Going, Ground, middle};
use super::project::Onto;
use crate::math::Vec3;
use crate::math::order::{by_both, rank, sort_by_rank};
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{Changes, restructure};
use crate::spatial::PointGrid;
use std::collections::BTreeSet;

/// How often what is left without a boundary is looked for at most, and at least where there is any.
const ROUNDS: usize = 10;
const LEAST_ROUNDS: usize = 2;

/// Rounds end where this share is left of what was left before.
const LITTLE_PROGRESS: f64 = 0.9;

/// In each round, moves of what has no boundary.
const MOVES: usize = 2;

/// Walls of a sheet are no further apart, in the shortest side of a voxel.
const THICKNESS: f64 = 1.5;

/// Walls of a sheet face away from each other: the greatest cosine of their normals.
const OPPOSITE: f32 = -0.3;

/// The share of the way to the middle of its neighbours that a vertex goes besides, where it goes on into what is bright.
const SMOOTHING: f32 = 0.5;

impl Follower {
    /// Draws in the sheets in crevices that have closed, grows into those that open, and smooths what else has no boundary.
    pub fn retract(&mut self, mesh: &mut Mesh, going: &Going, facts: &mut FrameFacts) -> Changes {
        let mut changes = Changes::default();
        let mut grown = BTreeSet::new();
        let mut before = usize::MAX;
        for round in 0..ROUNDS {
            let lost = lost(mesh, going);
            if round == 0 {
                facts.retracted = lost.len();
            }
            let progresses = (lost.len() as f64) < LITTLE_PROGRESS * before as f64;
            if lost.is_empty() || round >= LEAST_ROUNDS && !progresses {
                break;
            }
            before = lost.len();
            let gone = self.draw_in(mesh, &sheets(mesh, &lost, going));
            if gone > 0 {
                changes.deletions += gone;
                changes += restructure(mesh, self.bounds, &mut self.guard);
            }
            for _ in 0..MOVES {
                grown.extend(self.move_lost(mesh, going));
            }
        }
        // They have come near points of the boundary.
        let grown: Vec<VertexId> = grown.into_iter().filter(|&v| mesh.is_live(v)).collect();
        if !grown.is_empty() {
            let still = vec![Vec3::ZERO; mesh.slots()];
            self.project(mesh, &grown, &still, going, Onto::Frame, facts);
        }
        changes
    }

    /// Moves vertices without a boundary: into what is bright, if they are in the midst of it and on no sheet; else to the
    /// middle of their neighbours. Returns those that grow.
    fn move_lost(&mut self, mesh: &mut Mesh, going: &Going) -> Vec<VertexId> {
        let lost = lost(mesh, going);
        let sheets = sheets(mesh, &lost, going);
        let far = going.region.spacing.min_element() as f32;
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        let mut grown = Vec::new();
        for &(v, ground) in &lost {
            let way = middle(mesh, v) - mesh.position(v);
            let grows = ground == Ground::Bright && sheets.binary_search(&v).is_err();
            ways[v.index()] = way;
            if grows {
                ways[v.index()] = mesh.area_normal(v).normalize_or_zero() * far + way * SMOOTHING;
                grown.push(v);
            }
        }
        self.carry(mesh, ways);
        grown
    }

    /// Draws vertices together into their neighbours, from the innermost to the rim; returns how many are gone.
    fn draw_in(&mut self, mesh: &mut Mesh, sheets: &[VertexId]) -> u32 {
        self.guard.follow_with(mesh, self.bounds.max);
        let depth = depths(mesh, sheets);
        let mut order = sheets.to_vec();
        sort_by_rank(&mut order, |v| by_both(!depth[v.index()], v.0));
        let mut gone = 0;
        for v in order {
            let from = mesh.position(v);
            let ring = mesh.ring(v).as_slice().iter().copied();
            let mut outer: Vec<VertexId> = ring.filter(|w| depth[w.index()] < depth[v.index()]).collect();
            sort_by_rank(&mut outer, |&w| rank(mesh.position(w).distance_squared(from)).into());
            let drawn = outer.into_iter().any(|w| {
                let place = mesh.position(w);
                self.guard.attempt(mesh, |mesh| mesh.collapse(w, v, place)).is_ok()
            });
            gone += u32::from(drawn);
        }
        gone
    }
}

/// Vertices without a boundary, and what they are in.
fn lost(mesh: &Mesh, going: &Going) -> Vec<(VertexId, Ground)> {
    let ground = |v: VertexId| (v, going.ground(mesh.position(v), mesh.area_normal(v)));
    mesh.vertices().map(ground).filter(|(_, ground)| *ground != Ground::Boundary).collect()
}

/// Those among `lost` that have another one close by that faces the other way, in order.
fn sheets(mesh: &Mesh, lost: &[(VertexId, Ground)], going: &Going) -> Vec<VertexId> {
    let thickness = (THICKNESS * going.region.spacing.min_element()) as f32;
    let positions: Vec<Vec3> = lost.iter().map(|&(v, _)| mesh.position(v)).collect();
    let normals: Vec<Vec3> = lost.iter().map(|&(v, _)| mesh.area_normal(v).normalize_or_zero()).collect();
    let grid = PointGrid::of(&positions, thickness);
    let has_opposite = |i: usize| {
        let mut found = false;
        grid.within(positions[i], thickness, |j, _| {
            found = normals[i].dot(normals[j as usize]) < OPPOSITE;
            !found
        });
        found
    };
    (0..lost.len()).filter(|&i| has_opposite(i)).map(|i| lost[i].0).collect()
}

/// By slot, the edges from a vertex of the sheets to the nearest one of no sheet; 0 for those.
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
