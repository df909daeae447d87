//! Fields on a regular grid, ready to be sampled in hot loops.

use super::error::{VolumeError, reserve};
use super::sampling::Cell;
use crate::math::Vec3;

/// A scalar per voxel, x fastest, then y, z. Positions are continuous voxel indices, voxel centres at integers.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Number of voxels along x, y and z, each at least 1.
    pub dims: [usize; 3],
    /// One value per voxel.
    pub values: Vec<f32>,
}

/// A vector per voxel, laid out as in [`Grid`].
#[derive(Clone, Debug, PartialEq)]
pub struct VectorGrid {
    /// Number of voxels along x, y and z, each at least 1.
    pub dims: [usize; 3],
    /// One vector per voxel.
    pub values: Vec<Vec3>,
}

impl Grid {
    /// A grid, checked.
    ///
    /// # Errors
    /// A dimension of 0, or another number of values than the dimensions' product.
    pub fn new(dims: [usize; 3], values: Vec<f32>) -> Result<Grid, VolumeError> {
        let grid = Grid { dims, values };
        grid.check()?;
        Ok(grid)
    }

    /// An error unless the number of values is the product of the dimensions and not 0.
    pub(super) fn check(&self) -> Result<(), VolumeError> {
        let count = self.dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        if count == Some(self.values.len()) && !self.values.is_empty() {
            return Ok(());
        }
        let problem = format!(
            "{} values given for dims {:?}; their product, not 0, is needed",
            self.values.len(),
            self.dims
        );
        Err(VolumeError::invalid("values", problem))
    }

    /// Trilinear value at `p`; outside the grid the border is replicated.
    #[inline]
    pub fn sample(&self, p: Vec3) -> f32 {
        let cell = Cell::at(self.dims, p);
        cell.blend(|index| self.values[index])
    }

    /// Like [`sample`](Self::sample), but `outside` where `p` is not in the box [-1/2, n-1/2] that the voxels fill.
    #[inline]
    pub fn sample_zero(&self, p: Vec3, outside: f32) -> f32 {
        if self.contains(p) { self.sample(p) } else { outside }
    }

    /// Whether `p` lies in the box that the voxels fill, half a voxel beyond the outermost centres.
    #[inline]
    pub fn contains(&self, p: Vec3) -> bool {
        let inside = |x: f32, n: usize| x >= -0.5 && x <= n as f32 - 0.5;
        inside(p.x, self.dims[0]) && inside(p.y, self.dims[1]) && inside(p.z, self.dims[2])
    }

    /// Sobel gradient in intensity per voxel: differences over two voxels, smoothed by [1 2 1] across, divided by
    /// 32, so that a linear ramp gives its slope. Border replicated.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn sobel(&self) -> Result<VectorGrid, VolumeError> {
        let [nx, ny, nz] = self.dims;
        let mut values = reserve(self.values.len())?;
        let mut columns = vec![Columns::default(); nx];
        for z in 0..nz {
            for y in 0..ny {
                self.fill_columns(&mut columns, y, z);
                push_gradients(&columns, &mut values);
            }
        }
        Ok(VectorGrid { dims: self.dims, values })
    }

    /// The sums over the 3 × 3 voxels across x, for every x of one row.
    fn fill_columns(&self, columns: &mut [Columns], y: usize, z: usize) {
        let [_, ny, nz] = self.dims;
        let [y0, y2] = [y.saturating_sub(1), if y + 1 < ny { y + 1 } else { y }];
        let [z0, z2] = [z.saturating_sub(1), if z + 1 < nz { z + 1 } else { z }];
        let rows = [z0, z, z2].map(|z| [y0, y, y2].map(|y| self.row(y, z)));
        for (x, column) in columns.iter_mut().enumerate() {
            let at = rows.map(|plane| plane.map(|row| row[x]));
            *column = Columns::of(at);
        }
    }

    /// The voxels (0.., y, z).
    #[inline]
    pub(super) fn row(&self, y: usize, z: usize) -> &[f32] {
        let start = (z * self.dims[1] + y) * self.dims[0];
        &self.values[start..start + self.dims[0]]
    }
}

impl VectorGrid {
    /// Trilinear vector at `p`; outside the grid the border is replicated.
    #[inline]
    pub fn sample(&self, p: Vec3) -> Vec3 {
        let cell = Cell::at(self.dims, p);
        cell.blend(|index| self.values[index])
    }
}

/// 3 × 3 sums across x: smoothed both ways, and differenced along y or z while smoothed along the other.
#[derive(Clone, Copy, Default)]
struct Columns {
    smooth: f32,
    along_y: f32,
    along_z: f32,
}

impl Columns {
    /// From values at [z][y].
    #[inline]
    fn of(at: [[f32; 3]; 3]) -> Self {
        let smooth_y = at.map(|[a, b, c]| a + 2.0 * b + c);
        let differ_y = at.map(|[a, _, c]| c - a);
        Self {
            smooth: smooth_y[0] + 2.0 * smooth_y[1] + smooth_y[2],
            along_y: differ_y[0] + 2.0 * differ_y[1] + differ_y[2],
            along_z: smooth_y[2] - smooth_y[0],
        }
    }
}

fn push_gradients(columns: &[Columns], out: &mut Vec<Vec3>) {
    for (x, &here) in columns.iter().enumerate() {
        let before = columns[x.saturating_sub(1)];
        let after = columns.get(x + 1).copied().unwrap_or(here);
        let gradient = Vec3::new(
            after.smooth - before.smooth,
            before.along_y + 2.0 * here.along_y + after.along_y,
            before.along_z + 2.0 * here.along_z + after.along_z,
        );
        out.push(gradient * (1.0 / 32.0));
    }
}
