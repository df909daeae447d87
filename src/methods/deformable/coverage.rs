//! How much of the iso-surface the model has found, and where it has not.

use super::DeformableModel;
use super::contour::{ObjectIs, contour};
use crate::math::{DAffine3, DVec3, Vec3, triangle};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::spatial::TriangleTree;

/// Two surfaces cover each other where they are at most this far apart, in voxels of the finest level.
const REACH: f64 = 1.0;

/// Longest side of the pieces that triangles are tested by, in voxels.
const PIECE: f32 = 1.0;

/// The direction of rays that tell inside from outside; along no grid line, so that they rarely meet an edge.
const RAY: Vec3 = Vec3::new(0.846_3, 0.311_7, 0.432_1);

/// How well the model's surface and the iso-surface of the volume itself agree.
///
/// The iso-surface is that of the finest level by marching cubes, closed at the border, less the closed parts below
/// [`super::DeformableParams::smallest_part`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// Share of the iso-surface's area within a voxel of the model; 1 where there is no iso-surface.
    pub recall: f64,
    /// Share of the model's area within a voxel of the iso-surface; 1 where the model is empty.
    pub precision: f64,
    /// Connected parts of the iso-surface that are further away, largest first.
    pub uncovered: Vec<Uncovered>,
}

/// A connected part of the iso-surface that the model does not cover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncovered {
    /// A point of it near its middle, in world space.
    pub position: DVec3,
    /// Its area in square world units.
    pub area: f64,
    /// What the model leaves out there.
    pub kind: Missing,
}

/// What a model can leave out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// Part of the object is outside the surface.
    Matter,
    /// Background is inside the surface.
    Hollow,
}

/// A measurement of [`Coverage`] under way; it belongs to the surface as it was when it began.
#[derive(Clone, Debug)]
pub struct CoverageSurvey {
    to_world: DAffine3,
    iso_surface: TriangleMesh,
    iso_tree: TriangleTree,
    model: TriangleMesh,
    model_tree: TriangleTree,
    /// Triangles of the iso-surface, then of the model, that have been tested.
    tested: usize,
    /// Whether each triangle of the iso-surface is covered.
    is_covered: Vec<bool>,
    /// Area covered, and area in all, of the iso-surface and of the model.
    areas: [[f64; 2]; 2],
}

impl DeformableModel {
    /// Begins to measure [`Coverage`]; [`CoverageSurvey::advance`] does the work in slices.
    ///
    /// # Errors
    /// Where the iso-surface does not fit memory.
    pub fn survey_coverage(&self) -> Result<CoverageSurvey, MethodError> {
        let iso = self.pyramid.normalised(self.params.iso);
        let object = ObjectIs::by(&self.params);
        let iso_surface = contour(&self.pyramid.levels[0], iso, object, self.params.smallest_part)?;
        let model = self.mesh.to_triangles();
        Ok(CoverageSurvey {
            to_world: self.to_world,
            iso_tree: TriangleTree::new(&iso_surface)?,
            model_tree: TriangleTree::new(&model)?,
            is_covered: Vec::with_capacity(iso_surface.triangles.len()),
            iso_surface,
            model,
            tested: 0,
            areas: [[0.0; 2]; 2],
        })
    }

    /// Measures [`Coverage`] at once.
    ///
    /// # Errors
    /// As [`Self::survey_coverage`].
    pub fn coverage(&self) -> Result<Coverage, MethodError> {
        let mut survey = self.survey_coverage()?;
        survey.advance(usize::MAX);
        Ok(survey.finish())
    }
}

impl CoverageSurvey {
    /// Tests up to so many further triangles and returns the share of all that have been tested.
    pub fn advance(&mut self, triangles: usize) -> f64 {
        let [of_iso, of_model] = [&self.iso_surface, &self.model].map(|mesh| mesh.triangles.len());
        let all = of_iso + of_model;
        let end = self.tested.saturating_add(triangles).min(all);
        for t in self.tested..end {
            if t < of_iso {
                let covered = self.test(0, t);
                self.is_covered.push(covered);
            } else {
                self.test(1, t - of_iso);
            }
        }
        self.tested = end;
        if all == 0 { 1.0 } else { end as f64 / all as f64 }
    }

    /// Adds the pieces of a triangle to the areas, and says whether all of them are covered.
    fn test(&mut self, which: usize, t: usize) -> bool {
        let (mesh, other) = [(&self.iso_surface, &self.model_tree), (&self.model, &self.iso_tree)][which];
        let corners = mesh.triangles[t].map(|v| mesh.positions[v as usize]);
        let (mut covered, mut count) = (0u32, 0u32);
        for_each_piece(corners, |middle| {
            count += 1;
            covered += u32::from(other.is_within(middle, REACH));
        });
        let in_world = corners.map(|p| self.to_world.transform_vector3(p.as_dvec3()));
        let area = 0.5 * (in_world[1] - in_world[0]).cross(in_world[2] - in_world[0]).length();
        let [covered_area, whole_area] = &mut self.areas[which];
        *covered_area += area * f64::from(covered) / f64::from(count);
        *whole_area += area;
        covered == count
    }

    /// The result, after all triangles have been tested.
    pub fn finish(self) -> Coverage {
        let share = |[covered, whole]: [f64; 2]| if whole > 0.0 { covered / whole } else { 1.0 };
        Coverage {
            recall: share(self.areas[0]),
            precision: share(self.areas[1]),
            uncovered: self.uncovered_parts(),
        }
    }

    fn uncovered_parts(&self) -> Vec<Uncovered> {
        let uncovered =
            self.iso_surface.triangles.iter().zip(&self.is_covered).filter(|(_, covered)| !**covered);
        let rest = TriangleMesh {
            positions: self.iso_surface.positions.clone(),
            triangles: uncovered.map(|(triangle, _)| *triangle).collect(),
            ..TriangleMesh::default()
        };
        let part_of = rest.part_of_each_vertex();
        let mut sums = vec![(DVec3::ZERO, 0.0); rest.positions.len()];
        let area_and_middle = |corners: [Vec3; 3]| {
            let [a, b, c] = corners.map(|p| self.to_world.transform_point3(p.as_dvec3()));
            (0.5 * (b - a).cross(c - a).length(), (a + b + c) / 3.0)
        };
        for (t, corners) in rest.corners().enumerate() {
            let (area, middle) = area_and_middle(corners);
            let (sum, total) = &mut sums[part_of[rest.triangles[t][0] as usize] as usize];
            *sum += middle * area;
            *total += area;
        }
        let mut nearest: Vec<Option<(f64, Vec3, DVec3)>> = vec![None; sums.len()];
        for (t, corners) in rest.corners().enumerate() {
            let part = part_of[rest.triangles[t][0] as usize] as usize;
            let (sum, total) = sums[part];
            let (_, middle) = area_and_middle(corners);
            let distance = middle.distance_squared(sum / total);
            if nearest[part].is_none_or(|(least, ..)| distance < least) {
                let [a, b, c] = corners;
                nearest[part] = Some((distance, (a + b + c) / 3.0, middle));
            }
        }
        let found = nearest.into_iter().zip(&sums).filter_map(|(nearest, (_, area))| {
            let (_, local, position) = nearest?;
            let kind = if self.is_inside_model(local) { Missing::Hollow } else { Missing::Matter };
            Some(Uncovered { position, area: *area, kind })
        });
        let mut parts: Vec<Uncovered> = found.collect();
        parts.sort_by(|a, b| b.area.total_cmp(&a.area));
        parts
    }

    fn is_inside_model(&self, p: Vec3) -> bool {
        self.model_tree.ray_hit(p, RAY).is_some_and(|hit| {
            let corners =
                self.model.triangles[hit.triangle as usize].map(|v| self.model.positions[v as usize]);
            triangle::area_vector(corners).dot(RAY.as_dvec3()) > 0.0
        })
    }
}

/// The middles of the equal pieces that a triangle is cut into so that none is longer than [`PIECE`].
fn for_each_piece([a, b, c]: [Vec3; 3], mut visit: impl FnMut(Vec3)) {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = (longest / PIECE).ceil().clamp(1.0, 64.0) as u32;
    let (u, v) = ((b - a) / n as f32, (c - a) / n as f32);
    for i in 0..n {
        for j in 0..n - i {
            let corner = a + u * i as f32 + v * j as f32;
            visit(corner + (u + v) * (1.0 / 3.0));
            if i + j + 1 < n {
                visit(corner + (u + v) * (2.0 / 3.0));
            }
        }
    }
}
