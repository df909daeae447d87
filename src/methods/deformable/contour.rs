//! Closed iso-surfaces of a pyramid level: what a contour start begins from, and what coverage is measured against.

use super::DeformableParams;
use super::image::LevelImage;
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::remesh::clustered;
use crate::volume::{Grid, marching_cubes};

/// δ, in voxels, below which clusters the size of a voxel would be too coarse.
const LEAST_SIDE: f32 = 0.7;

/// The largest distance along its normal, in voxels, between a vertex and the mean of its cluster. Without this bound, a tube of radius 1.2
/// became a square prism.
const FLATNESS: f32 = 0.15;

/// Which side of the iso value the object is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ObjectIs {
    /// α_I < 0.
    Brighter,
    /// α_I > 0.
    Darker,
}

impl ObjectIs {
    /// What the sign of α_I says; without an iso force the object is what is brighter.
    pub(super) fn by(params: &DeformableParams) -> Self {
        if params.iso_force > 0.0 { Self::Darker } else { Self::Brighter }
    }

    /// A field that is at least 0 in the object: how far an intensity is on its side of `iso`.
    #[inline]
    pub(super) fn depth(self, intensity: f32, iso: f32) -> f32 {
        match self {
            Self::Brighter => intensity - iso,
            Self::Darker => iso - intensity,
        }
    }

    /// The intensity taken for granted beyond the image, so that every object ends at its border.
    pub(super) fn background(self) -> f32 {
        match self {
            Self::Brighter => 0.0,
            Self::Darker => 1.0,
        }
    }
}

/// The iso-surface of a level, in the space of the model: closed, its front outside the object, less the closed parts (matter or
/// hollow) that enclose less than `smallest_part` voxels of the finest level. Empty where the image never passes `iso`.
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
    Ok(placed(surface, position).without_parts_below(smallest_part))
}

/// A contour simplified by clustering: connected vertices in a voxel, or in a cube of side δ if that is larger, are merged. This saves more than
/// half of the edits that bring edges within bounds.
pub(super) fn simplified(contour: TriangleMesh, image: &LevelImage, delta: f32) -> TriangleMesh {
    let side = delta * image.voxels_per_unit();
    if side < LEAST_SIDE {
        return contour;
    }
    let side = if side > 1.0 { side } else { 1.0 };
    clustered(&contour, FLATNESS / image.voxels_per_unit(), |p| (image.index(p) / side).round().as_ivec3())
}

/// The surface with its positions in the space of the model.
pub(super) fn placed(mut surface: TriangleMesh, position: impl Fn(Vec3) -> Vec3) -> TriangleMesh {
    surface.positions.iter_mut().for_each(|p| *p = position(*p));
    surface
}
