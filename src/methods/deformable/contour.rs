//! Contours: closed iso-surfaces of a pyramid level without small parts. A contour start begins with one, seeding adds
//! parts of one, and coverage is measured against one.

use super::DeformableParams;
use super::image::LevelImage;
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::remesh::clustered;
use crate::volume::{Grid, marching_cubes};

/// The least δ, in voxels of the level, for which a contour is simplified by merging the vertices of each cluster; for
/// finer meshes, clusters as large as a voxel are too coarse.
const MIN_SIDE: f32 = 0.7;

/// The largest distance along its normal, in voxels of the level, between a vertex and the mean of its cluster;
/// clusters with a vertex further away are not merged. Without this bound, a tube of radius 1.2 became a square prism.
const FLATNESS: f32 = 0.15;

/// The side of the iso value on which the object is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ObjectIs {
    /// The object is brighter than the iso value, α_I < 0.
    Brighter,
    /// The object is darker than the iso value, α_I > 0.
    Darker,
}

impl ObjectIs {
    /// Returns the side given by the sign of α_I; without an image force the object is brighter.
    pub(super) fn by(params: &DeformableParams) -> Self {
        if params.iso_force > 0.0 { Self::Darker } else { Self::Brighter }
    }

    /// Returns the difference between an intensity and `iso`, at least 0 in the object and negative in the background.
    #[inline]
    pub(super) fn depth(self, intensity: f32, iso: f32) -> f32 {
        match self {
            Self::Brighter => intensity - iso,
            Self::Darker => iso - intensity,
        }
    }

    /// Returns the normalised intensity assumed outside the image, so that every object ends at the border.
    pub(super) fn background(self) -> f32 {
        match self {
            Self::Brighter => 0.0,
            Self::Darker => 1.0,
        }
    }
}

/// Extracts the iso-surface of a level in model space, closed and facing away from the object. Closed parts, of the
/// object or around cavities, that enclose less than `smallest_part` voxels of the finest level are left out. Empty if
/// no such part remains.
pub(super) fn contour(
    image: &LevelImage,
    iso: f32,
    object: ObjectIs,
    smallest_part: f64,
) -> Result<TriangleMesh, MethodError> {
    let (grid, position) = image.grid();
    let surface = match object {
        ObjectIs::Brighter => marching_cubes(grid, iso)?,
        ObjectIs::Darker => {
            let values = grid.values.iter().map(|value| -value).collect();
            marching_cubes(&Grid { dims: grid.dims, values }, -iso)?
        }
    };
    Ok(placed(surface, position).without_components_below(smallest_part))
}

/// Simplifies a contour by clustering: connected vertices in a voxel, or in a cube of side δ if that is larger, are
/// merged where the surface is flat, see [`FLATNESS`]. This saves more than half of the edits that bring edges within
/// bounds. Unchanged if δ is below [`MIN_SIDE`].
pub(super) fn simplified(contour: TriangleMesh, image: &LevelImage, delta: f32) -> TriangleMesh {
    let side = delta * image.voxels_per_unit();
    if side < MIN_SIDE {
        return contour;
    }
    let side = if side > 1.0 { side } else { 1.0 };
    clustered(&contour, FLATNESS / image.voxels_per_unit(), |p| (image.index(p) / side).round().as_ivec3())
}

/// Maps the positions of a surface, given in voxel indices, by `position`.
pub(super) fn placed(mut surface: TriangleMesh, position: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    surface.positions.iter_mut().for_each(|p| *p = position(*p));
    surface
}
