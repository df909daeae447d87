//! Extraction of an iso-surface of the implicit function by marching cubes, only in lattice cells that the surface
//! crosses, starting from the cells at the points (Dinh, Turk & Slabaugh, section VII; Lorensen & Cline, *Marching
//! cubes*, 1987).

use super::cloud::BoxMap;
use super::edits::MAX_ADDED_DISTANCE;
use super::fast::FastField;
use super::field::Field;
use crate::math::order::median;
use crate::math::{Bounds, DVec3, Vec3};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::spatial::PointGrid;
use crate::volume::{Lattice, MAX_NODES, SurfaceExtractor};

/// Minimum and maximum default number of extraction cells along the longest side of the points' bounding box; far from
/// the origin there may be fewer, as single precision is coarser there.
const CELLS: [f64; 2] = [64.0, 160.0];
/// Default edge length of an extraction cell, in mean spacings of the points, if [`CELLS`] allows it: finer detail
/// comes from the kernel alone, not from the points.
const CELL: f64 = 0.5;
/// Least number of cells along the longest side of the points: larger ones may miss the surface.
const LEAST_CELLS: f64 = 4.0;
/// Margin of the extraction lattice around the points, as a share of the longest side of their bounding box: the
/// surface may bulge beyond them.
const MARGIN: f64 = 0.3;
/// Number of extraction cells between the lattice lines that are scanned for connected components of the surface that
/// no point is near.
const SCAN: usize = 6;
/// Number of evaluations of the implicit function f by which each vertex of the extracted surface is refined: after one
/// parabolic step, the error is less than that of the fast multipole sums of f.
const STEPS: usize = 1;
/// Number of evaluations of the implicit function f in one call of [`Extraction::advance`], which then takes about ten
/// milliseconds.
const SLICE: usize = 3000;

/// Extraction of an iso-surface of the implicit function, in slices of about ten milliseconds of work.
pub struct Extraction {
    field: FastField,
    map: BoxMap,
    level: f64,
    points: Vec<Vec3>,
    extractor: SurfaceExtractor,
    /// Length of the gradient at each vertex, as far as it is computed.
    slopes: Vec<f32>,
    /// Largest number of cells that the surface may cross.
    most_cells: usize,
    stage: Stage,
}

enum Stage {
    Extract,
    /// Computing the normals; holds the finished mesh, and the normals of its vertices computed so far.
    Normals(TriangleMesh, Vec<Vec3>),
}

/// Length of the gradient, relative to the median over the surface, below which inside and outside are hardly separated. On two
/// balls it is .02 to .07 where they are joined or nearly so, .25 where the gap is as wide as the points are apart on average;
/// on twenty shapes with noise of 0 and .01 it is .1 or less only at the links of a thin chain and on a star with wrong
/// blades. Where points are missing it is .2 and more.
const UNCLEAR: f32 = 0.1;

fn too_large(most: usize) -> MethodError {
    let problem = format!(
        "the surface would have more than {most} vertices: use a larger cell, or allow more with maxVertices"
    );
    MethodError::TooLarge { problem }
}

/// Returns the default edge length of an extraction cell, in world units, for points whose mean distance to the nearest
/// neighbour is `spacing`, in units of the normalised box. Far from the origin it is larger, as single precision is
/// coarser there.
pub fn default_cell(map: &BoxMap, spacing: f64) -> f64 {
    let cell = (CELL * spacing).clamp(2.0 / CELLS[1], 2.0 / CELLS[0]) / map.scale();
    let around = (f64::from(MAX_ADDED_DISTANCE) + 2.0 * MARGIN) / map.scale();
    let least = (map.max_coordinate() + around) / MAX_DISTANCE_IN_EDGES;
    if cell > least { cell } else { least }
}

/// Maximum distance of the extraction lattice from the world's origin along an axis, in edges of the default cell: a
/// little less than [`Lattice`] allows.
const MAX_DISTANCE_IN_EDGES: f64 = 8100.0;

impl Extraction {
    /// Starts extracting the surface on which `field`, in the normalised box of `map`, equals `level`, from the cells
    /// around `points` and, if it `scans`, those that a coarse scan of the lattice finds; `points` and the edge length of a
    /// cell, `cell`, are in world units. The surface may cross `most_cells`; it has about as many vertices.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the cell is too small or too large for the points; [`MethodError::Volume`]
    /// if memory cannot be allocated.
    pub fn new(
        field: &Field,
        map: BoxMap,
        level: f64,
        points: &[Vec3],
        cell: f64,
        scans: bool,
        most_cells: usize,
    ) -> Result<Self, MethodError> {
        let bounds = Bounds::from_points(points);
        let margin = DVec3::splat(MARGIN * 2.0 / map.scale());
        let low = bounds.min.as_dvec3() - margin;
        let high = bounds.max.as_dvec3() + margin;
        let [least, most] = [
            (high - low).max_element() / (MAX_NODES - 1) as f64,
            (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element() / LEAST_CELLS,
        ];
        let invalid = |problem: String| {
            let accepted = format!("must be 0, or from {least:.3e} to {most:.3e} for these points");
            MethodError::invalid("cell", format!("{accepted}, {problem}"))
        };
        if !(least..=most).contains(&cell) {
            return Err(invalid(format!("got {cell}")));
        }
        let dims = ((high - low) / cell).to_array().map(|nodes| (nodes.ceil() as usize).saturating_add(1));
        let mut extractor = SurfaceExtractor::new(Lattice { origin: low, edge: cell, dims })
            .map_err(|error| invalid(error.to_string()))?;
        points.iter().for_each(|p| {
            extractor.seed(p.as_dvec3());
        });
        if scans {
            extractor.scan(SCAN)?;
        }
        extractor.refine(STEPS);
        let field = FastField::new(field.clone(), map.in_box_exactly(low), map.in_box_exactly(high));
        let (points, slopes) = (points.to_vec(), Vec::new());
        Ok(Self { field, map, level, points, extractor, slopes, most_cells, stage: Stage::Extract })
    }

    /// Does a slice of the extraction, about ten milliseconds of work. Returns the surface, in world units, with its
    /// outward normals once it is finished, `None` before.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory cannot be allocated; [`MethodError::TooLarge`].
    pub fn advance(&mut self) -> Result<Option<TriangleMesh>, MethodError> {
        match &mut self.stage {
            Stage::Extract => {
                let (field, map, level) = (&mut self.field, &self.map, self.level);
                let mut in_box = Vec::new();
                let done = self.extractor.advance(SLICE, &mut |points: &[DVec3], values: &mut [f64]| {
                    in_box.clear();
                    in_box.extend(points.iter().map(|&p| map.in_box_exactly(p)));
                    field.values(&in_box, values);
                    values.iter_mut().for_each(|value| *value -= level);
                })?;
                if self.extractor.crossed_cells() > self.most_cells {
                    return Err(too_large(self.most_cells));
                }
                if done {
                    self.stage = Stage::Normals(self.extractor.mesh()?, Vec::new());
                }
                Ok(None)
            }
            Stage::Normals(mesh, normals) => {
                for p in mesh.positions.iter().skip(normals.len()).take(SLICE) {
                    let (_, gradient) = self.field.value_and_gradient(self.map.in_box_exactly(p.as_dvec3()));
                    normals.push((-gradient).normalize_or_zero().as_vec3());
                    self.slopes.push(gradient.length() as f32);
                }
                if normals.len() < mesh.positions.len() {
                    return Ok(None);
                }
                let mesh = std::mem::take(mesh);
                Ok(Some(TriangleMesh { normals: Some(std::mem::take(normals)), ..mesh }))
            }
        }
    }

    /// Returns the vertex of the finished surface `mesh` with the least gradient, if that is below [`UNCLEAR`] and a point is
    /// within `reach`: inside and outside are hardly distinguished there, so that two sheets may be joined wrongly. Far from
    /// all points, the function may be flat.
    pub fn unclear(&self, mesh: &TriangleMesh, reach: f32) -> Option<Vec3> {
        let least = UNCLEAR * median(self.slopes.iter().copied())?;
        let flat = mesh.positions.iter().zip(&self.slopes).filter(|(_, slope)| **slope < least);
        let grid = PointGrid::of(&self.points, reach);
        flat.filter(|(p, _)| grid.has_within(**p, reach)).min_by(|a, b| a.1.total_cmp(b.1)).map(|(p, _)| *p)
    }

    /// Returns the approximate share of the extraction that is done, 0 to 1, for progress bars.
    pub fn progress(&self) -> f64 {
        match &self.stage {
            Stage::Extract => 0.8 * self.extractor.progress(),
            Stage::Normals(mesh, normals) => {
                0.8 + 0.2 * normals.len() as f64 / (mesh.positions.len() + 1) as f64
            }
        }
    }

    /// Returns the surface extracted so far, in world units, with open boundaries where it continues; for display
    /// meanwhile.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory cannot be allocated.
    pub fn preview(&self) -> Result<TriangleMesh, MethodError> {
        match &self.stage {
            Stage::Extract => Ok(self.extractor.mesh()?),
            Stage::Normals(mesh, _) => Ok(mesh.clone()),
        }
    }

    /// Returns the number of connected components of the surface found so far that none of the points given to
    /// [`Self::new`] is near; a coarse scan of the lattice finds them.
    pub fn spurious_components(&self) -> usize {
        self.extractor.components_found_by_scan()
    }
}
