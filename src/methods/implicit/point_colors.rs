//! Colours of points on the surface that they lie near.

use super::cloud::{BoxMap, Cloud};
use super::color::Coloring;
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::spatial::PointGrid;

/// Points whose colours a vertex takes.
const BLENDED: usize = 4;
/// How far away they are looked for, in mean spacings of those that take part.
const REACH: f32 = 2.0;
/// Keeps weights finite where points are all but equal.
const LEAST_SQUARE: f32 = 1e-20;
/// Vertices in a slice: some ten milliseconds.
const SLICE: usize = 10_000;

/// Coloured points, and how many vertices have theirs.
pub struct PointColors {
    grid: PointGrid,
    colors: Vec<Vec3>,
    spacing: f32,
    next: usize,
}

impl PointColors {
    /// Of points in the box; `None` where they have no colours.
    pub fn new(cloud: Cloud, spacing: f64) -> Option<Self> {
        let spacing = spacing as f32;
        let grid = PointGrid::of(&cloud.points, REACH * spacing);
        Some(Self { grid, colors: cloud.colors?, spacing, next: 0 })
    }

    /// Adds the colours of the nearest points, which count by the inverse of their squared distance, to some more
    /// vertices; nothing to those with no point near. Returns whether all had their turn.
    pub fn advance(&mut self, mesh: &TriangleMesh, map: &BoxMap, coloring: &mut Coloring) -> bool {
        // Half a spacing beside the distance: else each point makes a spot.
        let least = (0.25 * self.spacing * self.spacing).clamp(LEAST_SQUARE, 1.0);
        let vertices = mesh.positions.iter().enumerate().skip(self.next).take(SLICE);
        for (vertex, &p) in vertices {
            let mut near: Vec<(f32, u32)> = Vec::new();
            self.grid.within(map.in_box(p), REACH * self.spacing, |i, squared| {
                let at = near.partition_point(|&found| found < (squared, i));
                near.insert(at, (squared, i));
                near.truncate(BLENDED);
                true
            });
            for (squared, i) in near {
                coloring.gather(vertex, self.colors[i as usize], 1.0 / (squared + least));
            }
        }
        self.next += SLICE;
        self.next >= mesh.positions.len()
    }
}
