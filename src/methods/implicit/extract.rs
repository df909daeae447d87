//! The surface where the function passes the level, followed from the points (paper, section VII; Lorensen & Cline,
//! *Marching cubes*, 1987).

use super::cloud::BoxMap;
use super::edits::REACH;
use super::fast::FastField;
use super::field::Field;
use crate::math::{Bounds, DVec3, Vec3};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::volume::{Follower, Lattice};

/// Cells along the longest side of the points where none is asked for: not fewer, nor more.
const CELLS: [f64; 2] = [64.0, 160.0];
/// A cell in mean spacings of the points: detail between them is the kernel's.
const CELL: f64 = 0.5;
/// Room around the points for the surface to bulge into, of their longest side.
const MARGIN: f64 = 0.3;
/// Cells between the lines on which pieces are looked for that no point is near.
const SCAN: usize = 6;
/// Evaluations a vertex is placed with: one parabola leaves less than the fast sums do.
const STEPS: usize = 1;
/// Values of the function in a slice: some ten milliseconds.
const SLICE: usize = 3000;

/// A surface on its way.
pub struct Extraction {
    field: FastField,
    map: BoxMap,
    level: f64,
    follower: Follower,
    stage: Stage,
}

enum Stage {
    Follow,
    /// Normals of the vertices so far.
    Normals(TriangleMesh, Vec<Vec3>),
}

/// The edge of a cell in the points' units that suits points of mean distance `spacing`, in units of the box. Far from the
/// origin it is coarser, as single precision is.
pub fn default_cell(map: &BoxMap, spacing: f64) -> f64 {
    let cell = (CELL * spacing).clamp(2.0 / CELLS[1], 2.0 / CELLS[0]) / map.scale();
    let around = (f64::from(REACH) + 2.0 * MARGIN) / map.scale();
    let least = (map.reach() + around) / MOST_EDGES_AWAY;
    if cell > least { cell } else { least }
}

/// Edges that a lattice may reach from the origin, with room for one more than needed.
const MOST_EDGES_AWAY: f64 = 8100.0;

impl Extraction {
    /// The surface where `field` is `level`, around `points`, with cells of edge `cell`; points and cell in their own units.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] where the cell is too small or too large for the points.
    pub fn new(
        field: &Field,
        map: BoxMap,
        level: f64,
        points: &[Vec3],
        cell: f64,
    ) -> Result<Self, MethodError> {
        let bounds = Bounds::of(points);
        let margin = DVec3::splat(MARGIN * 2.0 / map.scale());
        let low = bounds.min.as_dvec3() - margin;
        let high = bounds.max.as_dvec3() + margin;
        let dims = ((high - low) / cell).to_array().map(|nodes| (nodes.ceil() as usize).saturating_add(1));
        let mut follower = Follower::new(Lattice { origin: low, edge: cell, dims })
            .map_err(|error| MethodError::invalid("cell", error.to_string()))?;
        points.iter().for_each(|p| {
            follower.seed(p.as_dvec3());
        });
        follower.scan(SCAN)?;
        follower.refine(STEPS);
        let field = FastField::new(field.clone(), map.in_box_exactly(low), map.in_box_exactly(high));
        Ok(Self { field, map, level, follower, stage: Stage::Follow })
    }

    /// A slice of work. Returns the surface with its normals, once it is there.
    ///
    /// # Errors
    /// [`MethodError::Volume`] where memory ends.
    pub fn advance(&mut self) -> Result<Option<TriangleMesh>, MethodError> {
        match &mut self.stage {
            Stage::Follow => {
                let (field, map, level) = (&mut self.field, &self.map, self.level);
                let mut places = Vec::new();
                let done = self.follower.advance(SLICE, &mut |points: &[DVec3], values: &mut [f64]| {
                    places.clear();
                    places.extend(points.iter().map(|&p| map.in_box_exactly(p)));
                    field.values(&places, values);
                    values.iter_mut().for_each(|value| *value -= level);
                })?;
                if done {
                    self.stage = Stage::Normals(self.follower.mesh()?, Vec::new());
                }
                Ok(None)
            }
            Stage::Normals(mesh, normals) => {
                for p in mesh.positions.iter().skip(normals.len()).take(SLICE) {
                    let (_, gradient) = self.field.value_and_gradient(self.map.in_box_exactly(p.as_dvec3()));
                    normals.push((-gradient).normalize_or_zero().as_vec3());
                }
                if normals.len() < mesh.positions.len() {
                    return Ok(None);
                }
                let mesh = std::mem::take(mesh);
                Ok(Some(TriangleMesh { normals: Some(std::mem::take(normals)), ..mesh }))
            }
        }
    }

    /// About how much is done.
    pub fn progress(&self) -> f64 {
        match &self.stage {
            Stage::Follow => 0.8 * self.follower.progress(),
            Stage::Normals(mesh, normals) => {
                0.8 + 0.2 * normals.len() as f64 / (mesh.positions.len() + 1) as f64
            }
        }
    }

    /// The surface as far as it was followed: open where it goes on.
    ///
    /// # Errors
    /// [`MethodError::Volume`] where memory ends.
    pub fn preview(&self) -> Result<TriangleMesh, MethodError> {
        match &self.stage {
            Stage::Follow => Ok(self.follower.mesh()?),
            Stage::Normals(mesh, _) => Ok(mesh.clone()),
        }
    }

    /// Pieces of the surface that no point is near.
    pub fn strays(&self) -> usize {
        self.follower.found_by_scan()
    }
}
