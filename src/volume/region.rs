//! Boxes of voxels.

use super::error::VolumeError;
use std::ops::Range;

/// A box of voxels in the index space of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Index of the first voxel along x, y and z.
    pub min: [usize; 3],
    /// Number of voxels along x, y and z.
    pub dims: [usize; 3],
}

impl Region {
    /// Returns the number of voxels in the region.
    pub(super) fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Returns an error about the argument `parameter` unless the region has a voxel and lies within a volume of `dims`
    /// voxels.
    pub(super) fn check(&self, parameter: &'static str, dims: [usize; 3]) -> Result<(), VolumeError> {
        let Self { min, dims: size } = *self;
        let fits =
            |axis: usize| size[axis] >= 1 && size[axis] <= dims[axis] && min[axis] <= dims[axis] - size[axis];
        if (0..3).all(fits) {
            return Ok(());
        }
        let problem = format!(
            "must have at least 1 voxel along each axis and lie within the {dims:?} voxels of the volume, \
             got {size:?} voxels from {min:?}"
        );
        Err(VolumeError::invalid(parameter, problem))
    }

    /// Returns the ranges of indices of the region's rows along x, ordered by y, then z, in an array in which the frame
    /// of `dims` voxels starts at index `start`. The region must lie within the frame.
    pub(super) fn rows(self, dims: [usize; 3], start: usize) -> impl Iterator<Item = Range<usize>> + Clone {
        let Self { min, dims: [width, height, depth] } = self;
        (0..depth).flat_map(move |z| {
            (0..height).map(move |y| {
                let first = start + min[0] + dims[0] * (min[1] + y + dims[1] * (min[2] + z));
                first..first + width
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn rows_are_the_voxels_of_the_box_in_order() {
        let region = Region { min: [1, 0, 2], dims: [2, 3, 2] };
        let [nx, ny, nz] = [4, 3, 5];
        region.check("region", [nx, ny, nz]).unwrap();
        let inside = |i: &usize| {
            let at = [i % nx, i / nx % ny, i / nx / ny];
            (0..3).all(|axis| (region.min[axis]..region.min[axis] + region.dims[axis]).contains(&at[axis]))
        };
        let expected: Vec<usize> = (0..nx * ny * nz).filter(inside).map(|i| i + 7).collect();
        assert_eq!(region.rows([nx, ny, nz], 7).flatten().collect::<Vec<_>>(), expected);
        assert_eq!(region.len(), expected.len());
    }

    #[test]
    fn regions_outside_are_refused_whatever_the_numbers() {
        for (min, dims) in [
            ([0, 0, 0], [0, 1, 1]),
            ([3, 0, 0], [2, 1, 1]),
            ([0, 3, 0], [1, 1, 1]),
            ([0, 0, 0], [1, 1, 6]),
            ([usize::MAX, 0, 0], [2, 1, 1]),
            ([0, 0, 1], [1, 1, usize::MAX]),
        ] {
            let refused = Region { min, dims }.check("region", [4, 3, 5]).unwrap_err().to_string();
            assert!(refused.starts_with("region: must") && refused.contains("[4, 3, 5]"), "{refused}");
        }
    }
}
