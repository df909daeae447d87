//! Vertex colours interpolated from coloured points near the surface, for surfaces that no camera sees.

use super::cloud::{BoxMap, Cloud};
use super::color::Coloring;
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::spatial::PointGrid;

/// Maximum number of nearest points from whose colours the colour of a vertex is blended.
const BLENDED: usize = 4;
/// Search radius for coloured points around a vertex, in mean spacings of the sampled points.
const SEARCH_RADIUS: f32 = 2.0;
/// Lower bound of the constant c in the weight 1/(d² + c) of a point at a distance d from a vertex, in squared units of
/// the normalised box: it keeps weights finite where points nearly coincide.
const MIN_SQUARED_DISTANCE: f32 = 1e-20;
/// Number of vertices coloured in one call of [`PointColors::advance`], which then takes about ten milliseconds.
const SLICE: usize = 10_000;

/// Interpolation of point colours at the vertices of a surface, in slices of about ten milliseconds of work. Used when
/// no camera sees the surface.
pub struct PointColors {
    grid: PointGrid,
    colors: Vec<Vec3>,
    spacing: f32,
    next: usize,
}

impl PointColors {
    /// Prepares the interpolation from `cloud`, which is in the normalised box, where `spacing` is the mean spacing of
    /// the sampled points; `None` if the cloud has no colours.
    pub fn new(cloud: Cloud, spacing: f64) -> Option<Self> {
        let spacing = spacing as f32;
        let grid = PointGrid::of(&cloud.points, SEARCH_RADIUS * spacing);
        Some(Self { grid, colors: cloud.colors?, spacing, next: 0 })
    }

    /// Adds the colours of the nearest points to the next slice of vertices in `coloring`, each with the weight
    /// `1/(d²+c)`, where d is the distance of the point from the vertex and c a quarter of the squared mean spacing;
    /// vertices with no point near get no colour. Returns whether all vertices are done.
    pub fn advance(&mut self, mesh: &TriangleMesh, map: &BoxMap, coloring: &mut Coloring) -> bool {
        // Half a spacing in quadrature with the distance; without it, each point leaves a spot.
        let least = (0.25 * self.spacing * self.spacing).clamp(MIN_SQUARED_DISTANCE, 1.0);
        let vertices = mesh.positions.iter().enumerate().skip(self.next).take(SLICE);
        for (vertex, &p) in vertices {
            let mut near: Vec<(f32, u32)> = Vec::new();
            self.grid.within(map.in_box(p), SEARCH_RADIUS * self.spacing, |i, squared| {
                let at = near.partition_point(|&found| found < (squared, i));
                near.insert(at, (squared, i));
                near.truncate(BLENDED);
                true
            });
            for (squared, i) in near {
                coloring.add_color(vertex, self.colors[i as usize], 1.0 / (squared + least));
            }
        }
        self.next += SLICE;
        self.next >= mesh.positions.len()
    }
}
