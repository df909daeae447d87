//! Coverage: recall and precision of the model's surface against the iso-surface of the volume, and the parts that the
//! model lacks.

use super::DeformableModel;
use super::contour::{ContourRule, contour};
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

/// The surface whose coverage is measured, and the image with whose iso-surface it is compared.
struct Measured {
    image: LevelImage,
    rule: ContourRule,
    model: TriangleMesh,
    to_world: DAffine3,
}

/// The tests of the triangles of both surfaces, with their progress.
struct Tests<'a> {
    to_world: DAffine3,
    count: usize,
    done: usize,
    share: &'a Cell<f64>,
}

/// Results of the tests of the triangles of a surface.
struct Covered {
    /// By triangle: whether all of it is within one voxel of the other surface.
    triangles: Vec<bool>,
    /// The share of the area that is.
    share: f64,
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
            rule: self.contour_rule(self.pyramid.iso(&self.params)),
            model: self.mesh.to_triangles(),
            to_world: self.to_world,
        })
    }
}

impl Measured {
    async fn coverage(self, share: &Cell<f64>, pauses: &Pauses) -> Result<Coverage, MethodError> {
        let Self { image, rule, model, to_world } = self;
        let iso_surface = contour(&image, rule, pauses).await?;
        drop(image);
        pauses.now().await;
        let count = model.triangles.len() + iso_surface.triangles.len();
        let mut tests = Tests { to_world, count, done: 0, share };
        let precision = {
            // One tree at a time: each takes as much memory as both surfaces.
            let iso_tree = TriangleTree::in_slices(&iso_surface, pauses).await?;
            tests.test(&model, &iso_tree, pauses).await.share
        };
        let model_tree = TriangleTree::in_slices(&model, pauses).await?;
        let covered = tests.test(&iso_surface, &model_tree, pauses).await;
        share.set(1.0);
        let is_inside = |p| is_inside(&model, &model_tree, p);
        let uncovered =
            uncovered_regions(iso_surface, &covered.triangles, &to_world, is_inside, pauses).await;
        Ok(Coverage { recall: covered.share, precision, uncovered })
    }
}

impl Tests<'_> {
    /// Tests the triangles of `surface` piece by piece; `other` is the tree of the other surface.
    async fn test(&mut self, surface: &TriangleMesh, other: &TriangleTree, pauses: &Pauses) -> Covered {
        let mut triangles = Vec::with_capacity(surface.triangles.len());
        let [mut covered_area, mut whole_area] = [0.0; 2];
        for corners in surface.corners() {
            let (mut covered, mut count) = (0u32, 0u32);
            for_each_piece(corners, |middle| {
                count += 1;
                covered += u32::from(other.is_within(middle, COVERED_DISTANCE));
            });
            let in_world = corners.map(|p| self.to_world.transform_vector3(p.as_dvec3()));
            let area = 0.5 * (in_world[1] - in_world[0]).cross(in_world[2] - in_world[0]).length();
            covered_area += area * f64::from(covered) / f64::from(count);
            whole_area += area;
            triangles.push(covered == count);
            self.done += 1;
            self.share.set(self.done as f64 / self.count as f64);
            pauses.after(1).await;
        }
        let share = if whole_area > 0.0 { covered_area / whole_area } else { 1.0 };
        Covered { triangles, share }
    }
}

/// Returns the connected parts of the iso-surface that consist of its triangles that are not covered.
async fn uncovered_regions(
    mut surface: TriangleMesh,
    is_covered: &[bool],
    to_world: &DAffine3,
    is_inside: impl Fn(Vec3) -> bool,
    pauses: &Pauses,
) -> Vec<UncoveredRegion> {
    let mut covered = is_covered.iter();
    surface.triangles.retain(|_| covered.next() == Some(&false));
    pauses.now().await;
    let component = surface.component_of_each_vertex();
    let mut components: Vec<u32> = surface.triangles.iter().map(|t| component[t[0] as usize]).collect();
    components.sort_unstable();
    components.dedup();
    pauses.now().await;
    let part = |t: usize| components.partition_point(|&c| c < component[surface.triangles[t][0] as usize]);
    let area_and_middle = |corners: [Vec3; 3]| {
        let [a, b, c] = corners.map(|p| to_world.transform_point3(p.as_dvec3()));
        (0.5 * (b - a).cross(c - a).length(), (a + b + c) / 3.0)
    };
    let mut sums = vec![(DVec3::ZERO, 0.0); components.len()];
    for (t, corners) in surface.corners().enumerate() {
        let (area, middle) = area_and_middle(corners);
        let (sum, total) = &mut sums[part(t)];
        *sum += middle * area;
        *total += area;
        pauses.after(1).await;
    }
    let mut nearest = vec![(f64::INFINITY, Vec3::ZERO, DVec3::ZERO); components.len()];
    for (t, corners) in surface.corners().enumerate() {
        let (sum, total) = sums[part(t)];
        let (_, middle) = area_and_middle(corners);
        let distance = middle.distance_squared(sum / total);
        if distance < nearest[part(t)].0 {
            let [a, b, c] = corners;
            nearest[part(t)] = (distance, (a + b + c) / 3.0, middle);
        }
        pauses.after(1).await;
    }
    let mut regions = Vec::new();
    for ((_, local, position), (_, area)) in nearest.into_iter().zip(sums) {
        let kind = if is_inside(local) { Missing::Cavity } else { Missing::Matter };
        regions.push(UncoveredRegion { position, area, kind });
        pauses.after(1).await;
    }
    sort_by_rank(&mut regions, |region: &UncoveredRegion| !rank_f64(region.area));
    regions
}

/// Returns whether a point is inside the model's surface.
fn is_inside(model: &TriangleMesh, tree: &TriangleTree, p: Vec3) -> bool {
    tree.ray_hit(p, RAY).is_some_and(|hit| {
        let corners = model.triangles[hit.triangle as usize].map(|v| model.positions[v as usize]);
        triangle::area_vector(corners).dot(RAY.as_dvec3()) > 0.0
    })
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
