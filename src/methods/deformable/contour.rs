//! Contours: closed iso-surfaces of a pyramid level without small parts. They are a start surface, the source of parts
//! that the mesh lacks, and the reference for coverage.

use super::DeformableParams;
use super::image::LevelImage;
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::remesh::clustered;
use crate::volume::{Subdivided, marching_cubes_of_slices};
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

    /// Returns the normalised intensity of the background, which is assumed outside the image so that every object ends
    /// at the border.
    pub(super) fn background(self) -> f32 {
        match self {
            Self::Brighter => 0.0,
            Self::Darker => 1.0,
        }
    }
}

/// Extracts the iso-surface of a pyramid level in model space, closed and facing away from the object. Closed parts, of
/// the object or around cavities, that enclose less than `smallest_part`, in model units, are left out; if
/// none remains, the mesh is empty.
pub(super) fn contour(
    image: &LevelImage,
    iso: f32,
    object: ObjectIs,
    smallest_part: f64,
) -> Result<TriangleMesh, MethodError> {
    let (grid, position) = image.part_grid();
    Ok(placed(contour_of_grid(&grid, iso, object)?, position).without_components_below(smallest_part))
}

/// Extracts the iso-surface of a grid in indices of the parts of its voxels, closed and facing away from the object.
pub(super) fn contour_of_grid(
    grid: &Subdivided,
    iso: f32,
    object: ObjectIs,
) -> Result<TriangleMesh, MethodError> {
    let negated = |z: usize| Cow::Owned(grid.slice(z).iter().map(|value| -value).collect());
    Ok(match object {
        ObjectIs::Brighter => marching_cubes_of_slices(grid.dims(), iso, &|z| grid.slice(z))?,
        ObjectIs::Darker => marching_cubes_of_slices(grid.dims(), -iso, &negated)?,
    })
}

/// Simplifies a contour by clustering, which saves more than half of the edits that bring its edges within bounds:
/// connected vertices in a voxel of the level, or in a cube of side δ if that is larger, are merged where the surface
/// is flat, see [`FLATNESS`]. Returns the contour unchanged if δ is below [`MIN_SIDE`].
pub(super) fn simplified(contour: TriangleMesh, image: &LevelImage, delta: f32) -> TriangleMesh {
    let side = delta * image.voxels_per_unit();
    if side < MIN_SIDE {
        return contour;
    }
    let side = if side > 1.0 { side } else { 1.0 };
    clustered(&contour, FLATNESS / image.voxels_per_unit(), |p| {
        (image.part_index(p) / side).round().as_ivec3()
    })
}

/// Returns a surface with its positions mapped by `position`, for conversions between voxel indices of a level and
/// model space.
pub(super) fn placed(mut surface: TriangleMesh, position: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    surface.positions.iter_mut().for_each(|p| *p = position(*p));
    surface
}
