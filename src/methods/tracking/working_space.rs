//! The space that the tracker computes in: world coordinates relative to an origin near the volume, with voxels of about
//! one unit, where single precision is fine enough and products of lengths neither overflow nor underflow.

use super::{FrameStatistics, TrackingParams};
use crate::math::{DVec3, Vec3};
use crate::mesh::{Mesh, grid_origin};
use crate::volume::Volume;

/// Sides of voxels, as powers of two in world units, for which the working space has the scale of the world, so that
/// results there keep their bits. Restructuring needs the eighth power of edge lengths in single precision, which is
/// lost below 2⁻¹⁵ and above 2¹⁶.
const ORDINARY_EXPONENTS: std::ops::RangeInclusive<i32> = -9..=10;

/// Maps world coordinates to those of the working space: (world − origin) · scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WorkingSpace {
    /// The origin of the working space in the world, that of all meshes of the tracker: 0 unless the volume is far from
    /// the world's origin for its size.
    pub origin: DVec3,
    /// Length of a world unit in the working space: a power of two, so that scaling is exact; 1 unless voxels are tiny
    /// or huge in world units.
    pub scale: f64,
}

impl Default for WorkingSpace {
    fn default() -> Self {
        Self { origin: DVec3::ZERO, scale: 1.0 }
    }
}

impl WorkingSpace {
    /// Returns the working space for a volume.
    pub fn of(volume: &Volume) -> Self {
        let side = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let (_, exponent) = libm::frexp(side);
        let power = if ORDINARY_EXPONENTS.contains(&exponent) { 0 } else { -exponent };
        Self { origin: grid_origin(&volume.affine(), volume.dims()), scale: libm::ldexp(1.0, power) }
    }

    /// Returns a point of the world in the working space.
    pub fn point(&self, world: DVec3) -> DVec3 {
        (world - self.origin) * self.scale
    }

    /// Returns the position relative to the origin, in world units, of a position in the working space.
    pub fn relative(&self, p: Vec3) -> Vec3 {
        p * (1.0 / self.scale) as f32
    }

    /// Returns a mesh without triangles, relative to the origin of this space.
    pub fn empty_mesh(&self) -> Mesh {
        let mut mesh = Mesh::default();
        if self.origin != DVec3::ZERO {
            mesh.set_origin(self.origin);
        }
        mesh
    }

    /// Scales a mesh from world units to those of the working space.
    pub fn enter(&self, mesh: &mut Mesh) {
        scale(mesh, self.scale);
    }

    /// Scales a mesh of the working space to world units, and sets its origin.
    pub fn leave(&self, mesh: &mut Mesh) {
        scale(mesh, 1.0 / self.scale);
        if mesh.origin() != self.origin {
            mesh.set_origin(self.origin);
        }
    }

    /// Returns the parameters with lengths in units of the working space.
    pub fn params(&self, params: &TrackingParams) -> TrackingParams {
        TrackingParams {
            radius: params.radius * self.scale,
            time_scale: params.time_scale * self.scale,
            ..params.clone()
        }
    }

    /// Returns statistics of the working space in world units.
    pub fn statistics(&self, found: FrameStatistics) -> FrameStatistics {
        let unit = 1.0 / self.scale;
        FrameStatistics {
            volume: found.volume * unit * unit * unit,
            area: found.area * unit * unit,
            mean_final_correction: found.mean_final_correction * unit,
            ..found
        }
    }
}

fn scale(mesh: &mut Mesh, factor: f64) {
    if factor != 1.0 {
        mesh.positions_mut().iter_mut().for_each(|p| *p *= factor as f32);
    }
}
