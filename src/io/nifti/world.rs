//! The transforms from voxel indices to world space in a NIfTI header.

use super::fields::Fields;
use super::{FORMAT, warning};
use crate::io::FormatError;
use crate::io::units::thickness_warning;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::volume::is_placement;
use crate::warning::Warning;

/// Tolerance by which the squared length of the stored part (b, c, d) of a unit quaternion may exceed 1 through
/// rounding in `f32`; longer ones are rejected.
const QUATERNION_TOLERANCE: f64 = 1e-5;

impl Fields {
    /// Returns whether the header states how the volume lies in a body.
    pub(super) fn has_transform(&self) -> bool {
        self.sform_code > 0 || self.qform_code > 0
    }

    /// Returns the transform from voxel indices to world space: the sform if the file has one, else the qform, else a
    /// scaling by the voxel sizes. An sform without an inverse gives way to the qform, with a warning.
    pub(super) fn affine(&self, warnings: &mut Vec<Warning>) -> Result<DAffine3, FormatError> {
        if self.sform_code > 0 {
            let sform = self.sform();
            return if sform.as_ref().is_ok_and(|&affine| is_placement(affine)) || self.qform_code <= 0 {
                sform
            } else {
                self.qform_instead(sform, warnings)
            };
        }
        let affine = if self.qform_code > 0 {
            self.qform()?
        } else {
            DAffine3::from_scale(DVec3::from(self.voxel_sizes()?))
        };
        warnings.extend(self.thickness_warning());
        Ok(affine)
    }

    /// Returns the qform for a file whose sform cannot be used, or the sform if the qform cannot either.
    fn qform_instead(
        &self,
        sform: Result<DAffine3, FormatError>,
        warnings: &mut Vec<Warning>,
    ) -> Result<DAffine3, FormatError> {
        let Some(qform) = self.qform().ok().filter(|&affine| is_placement(affine)) else { return sform };
        warnings.push(warning(
            "The matrix of the header (sform) has no inverse, although its code says that it is valid. The position was taken \
             from the quaternion (qform).",
        ));
        warnings.extend(self.thickness_warning());
        Ok(qform)
    }

    /// Returns the affine that the file stores as a matrix (sform).
    fn sform(&self) -> Result<DAffine3, FormatError> {
        for (row, name) in self.srow.iter().zip(["srow_x", "srow_y", "srow_z"]) {
            if row.iter().any(|v| !v.is_finite()) {
                return Err(FormatError::invalid(FORMAT, name, format!("must be finite, got {row:?}")));
            }
        }
        let column = |i: usize| DVec3::new(self.srow[0][i], self.srow[1][i], self.srow[2][i]);
        let matrix = DMat3::from_cols(column(0), column(1), column(2));
        Ok(DAffine3::from_mat3_translation(matrix, column(3)))
    }

    /// Returns the affine that the file stores as a quaternion (qform): scaling by the voxel sizes, rotation by the
    /// quaternion (a, b, c, d) with a ≥ 0, then translation. A negative `pixdim[0]` flips z.
    fn qform(&self) -> Result<DAffine3, FormatError> {
        let finite = |field: &str, values: [f64; 3]| {
            if values.iter().all(|v| v.is_finite()) {
                return Ok(values);
            }
            Err(FormatError::invalid(FORMAT, field, format!("must be finite, got {values:?}")))
        };
        let [b, c, d] = finite("quatern_b, c, d", self.quaternion)?;
        let origin = finite("qoffset_x, y, z", self.qoffset)?;
        let rest = 1.0 - (b * b + c * c + d * d);
        if rest < -QUATERNION_TOLERANCE {
            let problem = format!("{:?} is longer than 1", self.quaternion);
            return Err(FormatError::invalid(FORMAT, "quatern_b, c, d", problem));
        }
        let a = if rest > 0.0 { rest.sqrt() } else { 0.0 };
        let rotation = DMat3::from_quat(glam::DQuat::from_xyzw(b, c, d, a).normalize());
        let mut sizes = self.voxel_sizes()?;
        if self.pixdim[0] < 0.0 {
            sizes[2] = -sizes[2];
        }
        Ok(DAffine3::from_mat3_translation(rotation * DMat3::from_diagonal(sizes.into()), origin.into()))
    }

    /// Returns the absolute voxel sizes along x, y and z; 1 along axes that the file does not have, and along those with a
    /// single slice of no thickness.
    pub(super) fn voxel_sizes(&self) -> Result<[f64; 3], FormatError> {
        let mut sizes = [1.0; 3];
        for (axis, size) in sizes.iter_mut().enumerate().filter(|(axis, _)| (*axis as i64) < self.dim[0]) {
            if self.is_thin(axis) {
                continue;
            }
            *size = self.pixdim[axis + 1].abs();
            if !(*size > 0.0 && size.is_finite()) {
                let problem = format!("must be finite and not 0, got {}", self.pixdim[axis + 1]);
                return Err(FormatError::invalid(FORMAT, format!("pixdim[{}]", axis + 1), problem));
            }
        }
        Ok(sizes)
    }

    /// Returns whether the file has a single slice along an axis, and gives it no thickness.
    fn is_thin(&self, axis: usize) -> bool {
        let size = self.pixdim[axis + 1].abs();
        self.dim[axis + 1] == 1 && !(size > 0.0 && size.is_finite())
    }

    /// Returns a warning if the thickness of a single slice had to be assumed.
    pub(super) fn thickness_warning(&self) -> Option<Warning> {
        (0..3).find(|&axis| (axis as i64) < self.dim[0] && self.is_thin(axis)).map(thickness_warning)
    }
}
