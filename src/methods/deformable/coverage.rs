//! Coverage: recall and precision of the model's surface against the iso-surface of the volume, and the parts that the
//! model lacks.

use super::DeformableModel;
use super::contour::{ObjectIs, contour};
use super::image::LevelImage;
use crate::math::order::{rank_f64, sort_by_rank};
use crate::math::{DAffine3, DVec3, Vec3, triangle};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::pauses::{Computation, Pauses, advance, finished};
use crate::spatial::TriangleTree;
use std::cell::Cell;
use std::rc::Rc;
use std::task::Poll;

/// The distance to the other surface, of model and iso-surface, up to which a point is covered, in voxels of the finest
/// level, or in the parts into which elongated ones are divided.
const COVERED_DISTANCE: f64 = 1.0;

/// The largest side of the pieces into which triangles are divided to measure coverage, in voxels of the finest level:
/// the covered share of a triangle is that of its pieces whose centroids are covered.
const PIECE: f32 = 1.0;

/// The direction of rays that classify points as inside or outside the model's surface; along no grid line, so that
/// they rarely hit an edge.
const RAY: Vec3 = Vec3::new(0.846_3, 0.311_7, 0.432_1);

/// The agreement between the model's surface and the iso-surface of the volume.
///
/// The iso-surface is extracted from the finest level by marching cubes, closed at the border, without closed parts
/// below [`super::DeformableParams::smallest_part`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// The share of the iso-surface's area within one voxel of the model; 1 if there is no iso-surface.
    pub recall: f64,
    /// The share of the model's area within one voxel of the iso-surface; 1 if the model is empty.
    pub precision: f64,
    /// The connected parts of the iso-surface formed by its triangles that are not entirely within one voxel of the
    /// model, the largest area first.
    pub uncovered: Vec<UncoveredRegion>,
}

/// A connected part of the iso-surface whose triangles are not entirely within one voxel of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncoveredRegion {
    /// A point on the region near its centroid, in world space, for marking the region in a view.
    pub position: DVec3,
    /// The area of the region in square world units.
    pub area: f64,
    /// Whether the model lacks a part of the object or a cavity at the region.
    pub kind: Missing,
}

/// The kind of part that a model lacks compared with the iso-surface of its volume; for reports of coverage and for
/// seeding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// Part of the object is missing from the model: it lies outside the surface.
    Matter,
    /// A cavity is missing from the model: part of the background lies inside the surface.
    Cavity,
}

/// A measurement of [`Coverage`] in slices of work, so that it does not block the caller; it refers to the surface at the
/// time it began.
pub struct CoverageSurvey {
    measurement: Computation<Result<Coverage, MethodError>>,
    /// The share of all triangles tested so far.
    share: Rc<Cell<f64>>,
}

impl CoverageSurvey {
    /// Does a slice of the work; returns the coverage at the end, after which this must not be called any more.
    ///
    /// # Errors
    /// If the iso-surface or its search tree does not fit into memory.
    pub fn advance(&mut self) -> Poll<Result<Coverage, MethodError>> {
        advance(&mut self.measurement)
    }

    /// Returns the progress from 0 to 1.
    pub fn share(&self) -> f64 {
        self.share.get()
    }
}

/// The surface whose coverage is measured, and the image whose iso-surface it is compared with.
struct Measured {
    image: LevelImage,
    iso: f32,
    object: ObjectIs,
    smallest_part: f64,
    model: TriangleMesh,
    to_world: DAffine3,
}

/// The two surfaces, and what has been found of them.
struct Comparison {
    to_world: DAffine3,
    iso_surface: TriangleMesh,
    iso_tree: TriangleTree,
    model: TriangleMesh,
    model_tree: TriangleTree,
    /// By triangle of the iso-surface, for those tested so far: whether all of it is within one voxel of the model.
    is_covered: Vec<bool>,
    /// Covered area and total area of the triangles tested so far, in square world units, of the iso-surface and of the
    /// model.
    areas: [[f64; 2]; 2],
}

impl DeformableModel {
    /// Begins to measure [`Coverage`]; [`CoverageSurvey::advance`] does the work in slices.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] on a sparse volume.
    pub fn survey_coverage(&self) -> Result<CoverageSurvey, MethodError> {
        let (measured, share) = (self.measured()?, Rc::new(Cell::new(0.0)));
        let shown = share.clone();
        let measurement = async move { measured.coverage(&shown, &Pauses::default()).await };
        Ok(CoverageSurvey { measurement: Box::pin(measurement), share })
    }

    /// Measures [`Coverage`] in one call.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] on a sparse volume; if the iso-surface or its search tree does not fit into memory.
    pub fn coverage(&self) -> Result<Coverage, MethodError> {
        finished(self.measured()?.coverage(&Cell::default(), &Pauses::default()))
    }

    fn measured(&self) -> Result<Measured, MethodError> {
        self.check_is_whole()?;
        Ok(Measured {
            image: self.pyramid.levels[0].clone(),
            iso: self.pyramid.iso(&self.params),
            object: ObjectIs::by(&self.params),
            smallest_part: self.smallest_part(),
            model: self.mesh.to_triangles(),
            to_world: self.to_world,
        })
    }
}

impl Measured {
    async fn coverage(self, share: &Cell<f64>, pauses: &Pauses) -> Result<Coverage, MethodError> {
        let Self { image, iso, object, smallest_part, model, to_world } = self;
        let iso_surface = contour(&image, iso, object, smallest_part, pauses).await?;
        drop(image);
        pauses.now().await;
        let mut comparison = Comparison {
            to_world,
            iso_tree: TriangleTree::in_slices(&iso_surface, pauses).await?,
            model_tree: TriangleTree::in_slices(&model, pauses).await?,
            is_covered: Vec::with_capacity(iso_surface.triangles.len()),
            iso_surface,
            model,
            areas: [[0.0; 2]; 2],
        };
        comparison.test_all(share, pauses).await;
        let share_of = |[covered, whole]: [f64; 2]| if whole > 0.0 { covered / whole } else { 1.0 };
        let [recall, precision] = comparison.areas.map(share_of);
        Ok(Coverage { recall, precision, uncovered: comparison.uncovered_regions(pauses).await })
    }
}

impl Comparison {
    async fn test_all(&mut self, share: &Cell<f64>, pauses: &Pauses) {
        let [of_iso, of_model] = [&self.iso_surface, &self.model].map(|mesh| mesh.triangles.len());
        for t in 0..of_iso + of_model {
            if t < of_iso {
                let covered = self.test(0, t);
                self.is_covered.push(covered);
            } else {
                self.test(1, t - of_iso);
            }
            share.set((t + 1) as f64 / (of_iso + of_model) as f64);
            pauses.after(1).await;
        }
        share.set(1.0);
    }

    /// Tests triangle `t` of the iso-surface (`which` 0) or of the model (1) piece by piece, adds its covered and total
    /// area to the sums, and returns whether all of its pieces are within one voxel of the other surface.
    fn test(&mut self, which: usize, t: usize) -> bool {
        let (mesh, other) = [(&self.iso_surface, &self.model_tree), (&self.model, &self.iso_tree)][which];
        let corners = mesh.triangles[t].map(|v| mesh.positions[v as usize]);
        let (mut covered, mut count) = (0u32, 0u32);
        for_each_piece(corners, |middle| {
            count += 1;
            covered += u32::from(other.is_within(middle, COVERED_DISTANCE));
        });
        let in_world = corners.map(|p| self.to_world.transform_vector3(p.as_dvec3()));
        let area = 0.5 * (in_world[1] - in_world[0]).cross(in_world[2] - in_world[0]).length();
        let [covered_area, whole_area] = &mut self.areas[which];
        *covered_area += area * f64::from(covered) / f64::from(count);
        *whole_area += area;
        covered == count
    }

    async fn uncovered_regions(&self, pauses: &Pauses) -> Vec<UncoveredRegion> {
        let uncovered =
            self.iso_surface.triangles.iter().zip(&self.is_covered).filter(|(_, covered)| !**covered);
        let rest = TriangleMesh {
            positions: self.iso_surface.positions.clone(),
            triangles: uncovered.map(|(triangle, _)| *triangle).collect(),
            ..TriangleMesh::default()
        };
        pauses.now().await;
        let part_of = rest.component_of_each_vertex();
        pauses.now().await;
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
        pauses.now().await;
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
        pauses.now().await;
        let mut parts = Vec::new();
        for (nearest, (_, area)) in nearest.into_iter().zip(&sums) {
            let Some((_, local, position)) = nearest else { continue };
            let kind = if self.is_inside_model(local) { Missing::Cavity } else { Missing::Matter };
            parts.push(UncoveredRegion { position, area: *area, kind });
            pauses.after(1).await;
        }
        sort_by_rank(&mut parts, |part: &UncoveredRegion| !rank_f64(part.area));
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

/// Calls `visit` with the centroids of equal pieces of a triangle, from which its covered share is estimated. Sides of
/// pieces are no longer than [`PIECE`] unless that takes more than 64 pieces along a side of the triangle.
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
