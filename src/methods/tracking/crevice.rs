//! What has no boundary any more. Where two walls of a crevice have met, inside and outside look alike, and the surface would
//! stay between them as a sheet without volume, from which folds come.

use super::follow::{Follower, FrameFacts, Going, middle};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{Changes, restructure};
use crate::spatial::PointGrid;
use std::cmp::Reverse;

/// How often what is left without a boundary is looked for.
const ROUNDS: usize = 3;

/// In each round, moves of what has no boundary towards the middle of its neighbours.
const MOVES: usize = 2;

/// Walls of a sheet are no further apart, in the shortest side of a voxel.
const THICKNESS: f64 = 1.5;

/// Walls of a sheet face away from each other: the greatest cosine of their normals.
const OPPOSITE: f32 = -0.3;

impl Follower {
    /// Draws in the sheets in crevices that have closed, and smooths what else has no boundary.
    pub fn retract(&mut self, mesh: &mut Mesh, going: &Going, facts: &mut FrameFacts) -> Changes {
        let mut changes = Changes::default();
        for round in 0..ROUNDS {
            let lost = lost(mesh, going);
            if round == 0 {
                facts.retracted = lost.len();
            }
            if lost.is_empty() {
                break;
            }
            let sheets = sheets(mesh, &lost, THICKNESS * going.region.spacing.min_element());
            changes.deletions += self.draw_in(mesh, &sheets);
            changes += restructure(mesh, self.bounds, &mut self.guard);
            for _ in 0..MOVES {
                let mut ways = vec![Vec3::ZERO; mesh.slots()];
                for v in self::lost(mesh, going) {
                    ways[v.index()] = middle(mesh, v) - mesh.position(v);
                }
                self.carry(mesh, ways);
            }
        }
        changes
    }

    /// Draws vertices together into their neighbours, from the innermost to the rim; returns how many are gone.
    fn draw_in(&mut self, mesh: &mut Mesh, sheets: &[VertexId]) -> u32 {
        self.guard.follow_with(mesh, self.bounds.max);
        let depth = depths(mesh, sheets);
        let mut order = sheets.to_vec();
        order.sort_by_key(|v| (Reverse(depth[v.index()]), v.index()));
        let mut gone = 0;
        for v in order {
            let from = mesh.position(v);
            let ring = mesh.ring(v).as_slice().iter().copied();
            let mut outer: Vec<VertexId> = ring.filter(|w| depth[w.index()] < depth[v.index()]).collect();
            outer.sort_by(|&a, &b| {
                let away = |w: VertexId| mesh.position(w).distance_squared(from);
                away(a).total_cmp(&away(b))
            });
            let drawn = outer.into_iter().any(|w| {
                let place = mesh.position(w);
                self.guard.attempt(mesh, |mesh| mesh.collapse(w, v, place)).is_ok()
            });
            gone += u32::from(drawn);
        }
        gone
    }
}

/// Vertices without a boundary.
fn lost(mesh: &Mesh, going: &Going) -> Vec<VertexId> {
    mesh.vertices().filter(|&v| !going.is_boundary(mesh.position(v), mesh.area_normal(v))).collect()
}

/// Those among `lost` that have another one close by that faces the other way.
fn sheets(mesh: &Mesh, lost: &[VertexId], thickness: f64) -> Vec<VertexId> {
    let positions: Vec<Vec3> = lost.iter().map(|&v| mesh.position(v)).collect();
    let normals: Vec<Vec3> = lost.iter().map(|&v| mesh.area_normal(v).normalize_or_zero()).collect();
    let grid = PointGrid::of(&positions, thickness as f32);
    let has_opposite = |i: usize| {
        let mut found = false;
        grid.within(positions[i], thickness as f32, |j, _| {
            found = normals[i].dot(normals[j as usize]) < OPPOSITE;
            !found
        });
        found
    };
    (0..lost.len()).filter(|&i| has_opposite(i)).map(|i| lost[i]).collect()
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
