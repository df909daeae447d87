//! Grids with elongated voxels, divided along their long sides by linear interpolation, without storing the result.

use super::error::{VolumeError, reserve};
use super::sampling::locate;
use super::{FrameGrid, Grid, Region, Slices};
use crate::math::Vec3;
use std::borrow::Cow;

/// A grid with each voxel divided into equal parts along each axis, whose values are those of trilinear interpolation; the
/// border is replicated. The numbers of parts are odd, so that one part has the centre of its voxel, and trilinear
/// interpolation of the parts is that of the voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Subdivided<'a> {
    grid: &'a FrameGrid,
    parts: [usize; 3],
}

impl<'a> Subdivided<'a> {
    /// Creates the division of the voxels of a grid into `parts` along each axis, odd numbers.
    pub(crate) fn new(grid: &'a FrameGrid, parts: [usize; 3]) -> Self {
        Self { grid, parts }
    }

    /// Creates the grid itself, without dividing its voxels.
    pub(crate) fn whole(grid: &'a FrameGrid) -> Self {
        Self::new(grid, [1; 3])
    }

    /// Returns the number of parts of all voxels along each axis.
    pub(crate) fn dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.grid.dims()[axis] * self.parts[axis])
    }

    /// Returns the value of a part, given by its index in a grid of [`Self::dims`].
    pub(crate) fn value(&self, part: usize) -> f32 {
        if self.parts == [1; 3] {
            return self.grid.value(part);
        }
        let [nx, ny, _] = self.dims();
        let p = Vec3::from(self.coordinates([part % nx, part / nx % ny, part / nx / ny]));
        self.grid.sample(p)
    }

    /// Returns the parts in a region, given in their indices.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn region(&self, region: Region) -> Result<Grid, VolumeError> {
        if self.parts == [1; 3] {
            return self.grid.part(region);
        }
        let mut values = reserve(region.len())?;
        region.rows(self.dims(), 0).for_each(|row| values.extend(row.map(|part| self.value(part))));
        Ok(Grid { dims: region.dims, values })
    }

    /// Returns the values of all parts with the index `z`, row by row.
    pub(crate) fn slice(&self, z: usize) -> Cow<'a, [f32]> {
        let (low, share) = locate(self.coordinate(2, z), self.grid.dims()[2]);
        let between: Cow<[f32]> = if share > 0.0 {
            Cow::Owned(mixed(&self.grid.slice(low), &self.grid.slice(low + 1), share))
        } else {
            self.grid.slice(low)
        };
        if self.parts[0] == 1 && self.parts[1] == 1 { between } else { Cow::Owned(self.divided(&between)) }
    }

    /// Divides the voxels of one slice along x and y.
    fn divided(&self, slice: &[f32]) -> Vec<f32> {
        let ([nx, ny, _], [fine_x, fine_y, _]) = (self.grid.dims(), self.dims());
        let columns: Vec<(usize, f32)> = (0..fine_x).map(|x| locate(self.coordinate(0, x), nx)).collect();
        let mut values = Vec::with_capacity(fine_x * fine_y);
        for y in 0..fine_y {
            let (low, share) = locate(self.coordinate(1, y), ny);
            let row = |y: usize| &slice[y * nx..(y + 1) * nx];
            let row =
                if share > 0.0 { Cow::Owned(mixed(row(low), row(low + 1), share)) } else { row(low).into() };
            values.extend(columns.iter().map(|&(x, share)| {
                if share > 0.0 { row[x] + (row[x + 1] - row[x]) * share } else { row[x] }
            }));
        }
        values
    }

    /// Returns the index of a part in voxels of the grid.
    fn coordinates(&self, part: [usize; 3]) -> [f32; 3] {
        [0, 1, 2].map(|axis| self.coordinate(axis, part[axis]))
    }

    fn coordinate(&self, axis: usize, part: usize) -> f32 {
        (part as f32 + 0.5) / self.parts[axis] as f32 - 0.5
    }
}

impl Slices for Subdivided<'_> {
    fn dims(&self) -> [usize; 3] {
        self.dims()
    }

    fn slice(&self, z: usize) -> Result<Cow<'_, [f32]>, VolumeError> {
        Ok(self.slice(z))
    }

    fn region(&self, region: Region) -> Result<Grid, VolumeError> {
        self.region(region)
    }
}

fn mixed(a: &[f32], b: &[f32], share: f32) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn parts_have_the_interpolated_values_however_they_are_read() {
        let mut random = Random::new(1);
        for parts in [[1, 1, 5], [3, 1, 1], [1, 7, 3], [1, 1, 1], [3, 3, 3]] {
            let dims = [5, 4, 3];
            let grid = Grid { dims, values: (0..60).map(|_| random.unit() as f32).collect() };
            let shared = FrameGrid::from(grid.clone());
            let divided = Subdivided::new(&shared, parts);
            let [nx, ny, nz] = divided.dims();
            let region = Region { min: [1, 2, 0], dims: [nx - 1, ny - 3, nz] };
            let part = divided.region(region).unwrap();
            let mut in_region = part.values.iter();
            for z in 0..nz {
                let slice = divided.slice(z);
                for (k, &value) in slice.iter().enumerate() {
                    let at = [k % nx, k / nx, z];
                    let p = Vec3::from([0, 1, 2].map(|a| (at[a] as f32 + 0.5) / parts[a] as f32 - 0.5));
                    assert!((value - grid.sample(p)).abs() < 1e-6);
                    assert!((value - divided.value(k + nx * ny * z)).abs() < 1e-6);
                    if at[0] >= 1 && (2..ny - 1).contains(&at[1]) {
                        assert!((value - in_region.next().unwrap()).abs() < 1e-6);
                    }
                    if (0..3).all(|a| at[a] % parts[a] == parts[a] / 2) {
                        let [x, y, z] = [0, 1, 2].map(|a| at[a] / parts[a]);
                        assert_eq!(value, grid.values[x + 5 * (y + 4 * z)]);
                    }
                }
            }
            assert!(in_region.next().is_none());
        }
    }
}
