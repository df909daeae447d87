//! Headers of Analyze 7.5, which have the sizes of NIfTI-1 at the same offsets, but no orientation.
//!
//! By convention, as in nibabel and FSL, x runs from right to left, y to anterior and z to superior, with the middle of
//! the volume at the origin. SPM stores another voxel for the origin, and slope and intercept.

use super::fields::{Bytes, Fields};
use super::warning;
use crate::io::FormatError;
use crate::io::units::{metres, unit_of};
use crate::math::{DAffine3, DVec3};
use crate::volume::{LengthUnit, Space};
use crate::warning::Warning;

impl Fields {
    /// Returns the fields of an Analyze header: those that NIfTI-1 has at other offsets are read anew, or empty.
    pub(super) fn of_analyze(mut self, bytes: &Bytes<'_>) -> Self {
        let name = String::from_utf8_lossy(&bytes.bytes[56..60]).trim_matches(['\0', ' ']).to_owned();
        self.units = match metres(&name).map(unit_of) {
            Some(LengthUnit::Metre) => 1,
            Some(LengthUnit::Millimetre) => 2,
            Some(LengthUnit::Micrometre) => 3,
            _ => 0,
        };
        self.originator = [253, 255, 257].map(|at| bytes.i16(at));
        let known = |value: f64| if value.is_finite() { value } else { 0.0 };
        (self.slope, self.intercept) = (known(self.slope), known(self.intercept));
        (self.qform_code, self.sform_code) = (0, 0);
        self
    }

    /// Returns the transform from voxel indices to the axes of `space`, or, by default, to RAS by convention, with a
    /// warning.
    pub(super) fn analyze_affine(
        &self,
        dims: [usize; 4],
        space: Option<Space>,
        warnings: &mut Vec<Warning>,
    ) -> Result<DAffine3, FormatError> {
        let [dx, dy, dz] = self.voxel_sizes()?;
        let sizes = DVec3::new(if space.is_none() { -dx } else { dx }, dy, dz);
        if space.is_none() {
            warnings.push(warning(format!(
                "The file is in the format Analyze 7.5, which states no orientation. x was taken to run from right to left, y to \
                 anterior and z to superior, as is common, so that left and right may be exchanged.{}",
                self.scale_remark()
            )));
        }
        warnings.extend(self.thickness_warning());
        Ok(DAffine3::from_scale(sizes) * DAffine3::from_translation(-self.middle(dims)))
    }

    /// Returns a sentence about slope and intercept, which only SPM stores in such files; empty if there are none.
    fn scale_remark(&self) -> String {
        match self.scaling() {
            Ok((slope, intercept)) if (slope, intercept) != (1.0, 0.0) => {
                format!(" Slope ({slope}) and intercept ({intercept}) were applied, as SPM stores them.")
            }
            _ => String::new(),
        }
    }

    /// Returns the index of the point at the origin: that which SPM stores, if it is plausible, else the middle.
    fn middle(&self, dims: [usize; 4]) -> DVec3 {
        let dims = [dims[0], dims[1], dims[2]].map(|n| n as i64);
        let plausible = self.originator.iter().zip(dims).all(|(&at, n)| -n < at && at < 2 * n);
        if plausible && self.originator != [0; 3] {
            return DVec3::from(self.originator.map(|at| at as f64 - 1.0));
        }
        DVec3::from(dims.map(|n| (n as f64 - 1.0) / 2.0))
    }
}
