//! Contours: closed iso-surfaces of a pyramid level without small parts. They are a start surface, the source of parts
//! that the mesh lacks, and the reference for coverage.

use super::DeformableParams;
use super::image::LevelImage;
use crate::math::order::sort_by_rank;
use crate::math::{Bounds, Vec3};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::pauses::{Pauses, finished};
use crate::remesh::clustered;
use crate::volume::{
    Grid, Padding, Region, Slices, Subdivided, VolumeError, marching_cubes_in_slices, voxels_inside,
};
use std::borrow::Cow;

/// The least δ, in voxels of the pyramid level, for which a contour is simplified by merging clusters of vertices; for
/// finer meshes, clusters as large as a voxel are too coarse.
const MIN_SIDE: f32 = 0.7;

/// The largest distance along its normal, in voxels of the pyramid level, between a vertex of a contour and the mean of
/// its cluster; when a contour is simplified, clusters with a vertex further away are not merged. Without this bound, a
/// tube of radius 1.2 became a square prism.
const FLATNESS: f32 = 0.15;

/// The side of the iso value, above or below, on which the intensities of the object are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ObjectIs {
    /// The object is brighter than the iso value: α_I, the strength of the image force, is negative or 0.
    Brighter,
    /// The object is darker than the iso value: α_I, the strength of the image force, is positive.
    Darker,
}

impl ObjectIs {
    /// Returns the side of the iso value on which the object is, by the sign of α_I, the strength of the image force;
    /// without an image force the object is brighter.
    pub(super) fn by(params: &DeformableParams) -> Self {
        if params.iso_force > 0.0 { Self::Darker } else { Self::Brighter }
    }

    /// Returns the difference between an intensity and `iso`, with its sign such that it is at least 0 in the object
    /// and negative in the background.
    #[inline]
    pub(super) fn depth(self, intensity: f32, iso: f32) -> f32 {
        match self {
            Self::Brighter => intensity - iso,
            Self::Darker => iso - intensity,
        }
    }

    /// Returns whether the object is above the iso value.
    pub(super) fn is_above(self) -> bool {
        self == Self::Brighter
    }

    /// Returns the normalised intensity of the background far from any object: 0 or 1, or beyond the iso value if that is
    /// there or further out.
    pub(super) fn background(self, iso: f32) -> f32 {
        match self {
            Self::Brighter if iso > 0.0 => 0.0,
            Self::Brighter => iso - 1.0,
            Self::Darker if iso < 1.0 => 1.0,
            Self::Darker => iso + 1.0,
        }
    }

    /// Returns what is assumed outside the image, so that every object ends at the border.
    pub(super) fn outside(self, iso: f32) -> Padding {
        Padding { background: self.background(iso), iso }
    }
}

/// The number of voxels up to which parts are measured by the voxels in them, not by the volume that they enclose: corners
/// and edges of voxels are outside of a contour, most of a single voxel. A mesh follows parts up to this size
/// if those of that size count; larger limits of the size would change which parts of other images are noise.
pub(super) const SMALL_PART: f64 = 8.0;

/// Conditions on the contour that is extracted from a pyramid level.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContourRule {
    pub(super) iso: f32,
    pub(super) object: ObjectIs,
    /// The least volume of a closed part, of the object or around a cavity, in model units; smaller ones are left out.
    pub(super) smallest_part: f64,
    /// The largest number of triangles.
    pub(super) most: usize,
}

/// Extracts the iso-surface of a pyramid level in model space, closed and facing away from the object; the mesh is empty
/// if no part remains.
///
/// # Errors
/// [`VolumeError::TooManyTriangles`]; if memory does not suffice.
pub(super) async fn contour(
    image: &LevelImage,
    rule: ContourRule,
    pauses: &Pauses,
) -> Result<TriangleMesh, MethodError> {
    let smallest_part = rule.smallest_part;
    let (grid, position) = image.part_grid();
    let surface = contour_in_slices(&grid, rule, pauses).await?;
    pauses.now().await;
    if smallest_part > SMALL_PART {
        return Ok(placed(surface, position).without_components_below(smallest_part));
    }
    let component = surface.component_of_each_vertex();
    pauses.now().await;
    let part = 1.0 / image.part_scale().as_dvec3().element_product();
    let sizes = sizes_of_parts(&surface, &component, smallest_part / part);
    pauses.now().await;
    let kept = surface.components_where(|v| sizes[component[v as usize] as usize] >= smallest_part / part);
    Ok(placed(kept, position))
}

/// Returns the size of each closed part of a contour in voxel indices, in voxels, at the index of its lowest vertex; the
/// volume that it encloses, but the number of voxels in it if it encloses less than `smallest`, and that is at
/// most [`SMALL_PART`].
pub(super) fn sizes_of_parts(surface: &TriangleMesh, component: &[u32], smallest: f64) -> Vec<f64> {
    let mut sizes = surface.enclosed_volumes(component);
    sizes.iter_mut().for_each(|volume| *volume = volume.abs());
    if smallest > SMALL_PART {
        return sizes;
    }
    let part = |triangle: &[u32; 3]| component[triangle[0] as usize];
    let mut small: Vec<[u32; 3]> = surface.triangles.clone();
    small.retain(|triangle| sizes[part(triangle) as usize] < smallest);
    sort_by_rank(&mut small, |triangle| u64::from(part(triangle)));
    for triangles in small.chunk_by(|a, b| part(a) == part(b)) {
        sizes[part(&triangles[0]) as usize] = voxels_in(surface, triangles) as f64;
    }
    sizes
}

/// Returns the number of voxels inside a part of a contour in voxel indices, given by its triangles.
fn voxels_in(surface: &TriangleMesh, triangles: &[[u32; 3]]) -> usize {
    let corners: Vec<Vec3> = triangles.iter().flatten().map(|&v| surface.positions[v as usize]).collect();
    let bounds = Bounds::from_points(&corners);
    let first = bounds.min.floor();
    let part = TriangleMesh {
        positions: corners.iter().map(|&p| p - first).collect(),
        triangles: (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        ..TriangleMesh::default()
    };
    let dims = (bounds.max - first).ceil().to_array().map(|n| n as usize + 1);
    voxels_inside(&part, dims).count_ones(..)
}

/// Extracts the iso-surface of a grid in indices of the parts of its voxels, closed and facing away from the object, with
/// all of its parts.
pub(super) fn contour_of_grid(grid: &Subdivided, rule: ContourRule) -> Result<TriangleMesh, MethodError> {
    finished(contour_in_slices(grid, rule, &Pauses::default()))
}

/// Does what [`contour_of_grid`] does, and pauses meanwhile.
pub(super) async fn contour_in_slices(
    grid: &Subdivided<'_>,
    ContourRule { iso, object, most, .. }: ContourRule,
    pauses: &Pauses,
) -> Result<TriangleMesh, MethodError> {
    Ok(match object {
        ObjectIs::Brighter => marching_cubes_in_slices(grid, iso, most, pauses).await?,
        ObjectIs::Darker => marching_cubes_in_slices(&Negated(grid), -iso, most, pauses).await?,
    })
}

/// A grid with all intensities negated.
struct Negated<'a>(&'a Subdivided<'a>);

impl Slices for Negated<'_> {
    fn dims(&self) -> [usize; 3] {
        self.0.dims()
    }

    fn slice(&self, z: usize) -> Result<Cow<'_, [f32]>, VolumeError> {
        Ok(self.0.slice(z).iter().map(|value| -value).collect())
    }

    fn region(&self, region: Region) -> Result<Grid, VolumeError> {
        let mut part = self.0.region(region)?;
        part.values.iter_mut().for_each(|value| *value = -*value);
        Ok(part)
    }
}

/// Simplifies a contour by clustering, which saves more than half of the edits that bring its edges within bounds:
/// connected vertices in a voxel of the level, or in a cube of side δ if that is larger, are merged where the surface
/// is flat, see [`FLATNESS`]. Returns the contour unchanged if δ is below [`MIN_SIDE`].
pub(super) async fn simplified(
    contour: TriangleMesh,
    image: &LevelImage,
    delta: f32,
    pauses: &Pauses,
) -> TriangleMesh {
    let side = delta * image.voxels_per_unit();
    if side < MIN_SIDE {
        return contour;
    }
    let side = if side > 1.0 { side } else { 1.0 };
    let cell = |p| (image.part_index(p) / side).round().as_ivec3();
    clustered(&contour, FLATNESS / image.voxels_per_unit(), cell, pauses).await
}

/// Returns a surface with its positions mapped by `position`, for conversions between voxel indices of a level and
/// model space.
pub(super) fn placed(mut surface: TriangleMesh, position: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    surface.positions.iter_mut().for_each(|p| *p = position(*p));
    surface
}
