//! Scalar and vector fields on a regular grid, for sampling in hot loops.

use super::Region;
use super::error::{VolumeError, reserve};
use super::sampling::Cell;
use crate::math::Vec3;

/// A scalar field: one value per voxel, x fastest, then y, z. Positions are continuous voxel indices, voxel centres at
/// integers.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Number of voxels along x, y and z, each at least 1.
    pub dims: [usize; 3],
    /// One value per voxel, x fastest, then y, z.
    pub values: Vec<f32>,
}

/// Cache of the eight voxel values around the last sampled point, for [`Grid::sample_padded`]: reading a large grid
/// from memory is slow.
#[derive(Clone, Copy, Debug)]
pub struct CellCache {
    key: u64,
    corners: [f32; 8],
}

impl CellCache {
    /// Creates a cache of the values of a cell, given a number that no other cell has.
    #[inline]
    pub(super) fn new(key: u64, corners: [f32; 8]) -> Self {
        Self { key, corners }
    }

    #[inline]
    pub(super) fn is_at(&self, key: u64) -> bool {
        self.key == key
    }

    #[inline]
    pub(super) fn corners(&self) -> &[f32; 8] {
        &self.corners
    }
}

impl Default for CellCache {
    /// Returns an empty cache, which matches no cell.
    fn default() -> Self {
        Self { key: u64::MAX, corners: [0.0; 8] }
    }
}

/// The surroundings of a grid where it is sampled beyond its border: background, so that every object ends there.
///
/// One layer of voxels around the grid continues its outermost voxels. Beside a voxel of the object its value is as far
/// from the iso value as that voxel, on the other side, so that the object ends half a voxel beyond its outermost
/// voxel centres, as in [`marching_cubes`](super::marching_cubes); beside others, and beyond, it is `background`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Padding {
    /// The value far outside; the object is on the other side of `iso`.
    pub background: f32,
    /// The iso value at which the object ends.
    pub iso: f32,
}

impl Padding {
    /// Returns the value beside a voxel of the outermost layer of a grid.
    #[inline]
    fn beside(&self, value: f32) -> f32 {
        let is_object = if self.background < self.iso { value >= self.iso } else { value <= self.iso };
        if is_object { 2.0 * self.iso - value } else { self.background }
    }

    /// Returns the value at a point, in voxel indices, of which `share`, below 1, is [`share_of_values`]; `corners` are the
    /// values of the cell at the border next to it, between which `blend` interpolates.
    pub(super) fn beyond(
        &self,
        dims: [usize; 3],
        p: Vec3,
        share: f32,
        corners: &[f32; 8],
        blend: impl Fn(&[f32; 8]) -> f32,
    ) -> f32 {
        let beside = corners.map(|value| self.beside(value));
        if beside.iter().all(|&value| value == self.background) {
            return self.background + share * (blend(corners) - self.background);
        }
        if share > 0.0 {
            let values = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| beside[k] + share * (corners[k] - beside[k]));
            return blend(&values);
        }
        self.background + share_of_padded(dims, p) * (blend(&beside) - self.background)
    }
}

/// A vector field, such as the gradient of an image: one vector per voxel, x fastest, then y, z. Positions are
/// continuous voxel indices, voxel centres at integers.
#[derive(Clone, Debug, PartialEq)]
pub struct VectorGrid {
    /// Number of voxels along x, y and z, each at least 1.
    pub dims: [usize; 3],
    /// One vector per voxel, x fastest, then y, z.
    pub values: Vec<Vec3>,
}

impl Grid {
    /// Creates a grid after checking that `values` has one value per voxel.
    ///
    /// # Errors
    /// A dimension of 0, or a number of values other than the product of the dimensions.
    pub fn new(dims: [usize; 3], values: Vec<f32>) -> Result<Grid, VolumeError> {
        let grid = Grid { dims, values };
        grid.check()?;
        Ok(grid)
    }

    /// Returns the part of the grid in a region, which must lie within it.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn part(&self, region: Region) -> Result<Grid, VolumeError> {
        let mut values = reserve(region.len())?;
        region.rows(self.dims, 0).for_each(|row| values.extend_from_slice(&self.values[row]));
        Ok(Grid { dims: region.dims, values })
    }

    /// Replaces the values in a region, which must lie within the grid, by those of `part`, of the region's dimensions.
    pub fn overwrite(&mut self, region: Region, part: &Grid) {
        let from = part.values.chunks_exact(region.dims[0]);
        region.rows(self.dims, 0).zip(from).for_each(|(row, from)| self.values[row].copy_from_slice(from));
    }

    /// Returns an error unless the grid has one value per voxel, and at least one; marching cubes calls it, too, since
    /// the fields of a grid are public.
    pub(super) fn check(&self) -> Result<(), VolumeError> {
        let count = self.dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        if count == Some(self.values.len()) && !self.values.is_empty() {
            return Ok(());
        }
        let problem = format!("must have one value per voxel ({:?}), got {}", self.dims, self.values.len());
        Err(VolumeError::invalid("values", problem))
    }

    /// Returns the trilinearly interpolated value at `p`, in continuous voxel indices; outside the grid the border is
    /// replicated.
    #[inline]
    pub fn sample(&self, p: Vec3) -> f32 {
        let cell = Cell::at(self.dims, p);
        cell.blend(&cell.corners(|index| self.values[index]))
    }

    /// Returns the trilinearly interpolated value at `p`, in continuous voxel indices, in the grid with `padding` on all
    /// sides. Faster if `p` is in the same cell as in the previous call with this `cache`, which must only be used with one
    /// grid.
    ///
    /// The padded field is continuous, so a surface that moves towards an iso value converges at the border, too.
    #[inline]
    pub fn sample_padded(&self, p: Vec3, padding: Padding, cache: &mut CellCache) -> f32 {
        self.sample_padded_by((self.dims, p), p, padding, cache)
    }

    /// As [`Self::sample_padded`], with padding as wide as parts of voxels: `dims` are their numbers along the axes, and
    /// `part` is the position in them.
    #[inline]
    pub(crate) fn sample_padded_by(
        &self,
        (dims, part): ([usize; 3], Vec3),
        p: Vec3,
        padding: Padding,
        cache: &mut CellCache,
    ) -> f32 {
        sample_padded(self.dims, (dims, part), p, padding, cache, |cell| {
            cell.corners(|index| self.values[index])
        })
    }

    /// Returns the Sobel gradient in intensity per voxel: central differences over two voxels, smoothed by [1 2 1] in
    /// the two other directions and divided by 32, so that the gradient of a linear ramp is its slope. The border is
    /// replicated. Used by the gradient force of the deformable model.
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

    /// Updates `gradient`, the [`Self::sobel`] of this grid, after the values in a region have changed.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn update_sobel(&self, gradient: &mut VectorGrid, changed: Region) -> Result<(), VolumeError> {
        let region = changed.enlarged(1, self.dims);
        let around = region.enlarged(1, self.dims);
        let part = self.part(around)?.sobel()?;
        let inner = Region { min: [0, 1, 2].map(|axis| region.min[axis] - around.min[axis]), ..region };
        let rows = region.rows(self.dims, 0).zip(inner.rows(around.dims, 0));
        rows.for_each(|(row, from)| gradient.values[row].copy_from_slice(&part.values[from]));
        Ok(())
    }

    /// Computes, for every voxel of the row (0.., y, z), the weighted 3 × 3 sums in the y-z plane from which Sobel
    /// gradients are composed.
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

    /// Returns the values of the row of voxels (0.., y, z).
    #[inline]
    pub(super) fn row(&self, y: usize, z: usize) -> &[f32] {
        let start = (z * self.dims[1] + y) * self.dims[0];
        &self.values[start..start + self.dims[0]]
    }
}

impl VectorGrid {
    /// Returns the trilinearly interpolated vector at `p`, in continuous voxel indices; outside the grid the border is
    /// replicated.
    #[inline]
    pub fn sample(&self, p: Vec3) -> Vec3 {
        let cell = Cell::at(self.dims, p);
        cell.blend(&cell.corners(|index| self.values[index]))
    }
}

/// Returns the trilinearly interpolated value at `p` as [`Grid::sample_padded_by`] does, in a grid of `dims` voxels;
/// `corners` returns the values of a cell.
#[inline]
pub(super) fn sample_padded(
    dims: [usize; 3],
    parts: ([usize; 3], Vec3),
    p: Vec3,
    padding: Padding,
    cache: &mut CellCache,
    corners: impl Fn(&Cell) -> [f32; 8],
) -> f32 {
    let share = share_of_values(parts.0, parts.1);
    if share < 1.0 {
        return sample_at_border(dims, parts, share, p, padding, cache, corners);
    }
    padding.background + (cell_at(dims, p, cache, corners).blend(&cache.corners) - padding.background)
}

/// As [`sample_padded`], where the values have a `share` below 1.
#[cold]
fn sample_at_border(
    dims: [usize; 3],
    parts: ([usize; 3], Vec3),
    share: f32,
    p: Vec3,
    padding: Padding,
    cache: &mut CellCache,
    corners: impl Fn(&Cell) -> [f32; 8],
) -> f32 {
    if share <= 0.0 && share_of_padded(parts.0, parts.1) <= 0.0 {
        return padding.background;
    }
    let cell = cell_at(dims, p, cache, corners);
    padding.beyond(parts.0, parts.1, share, &cache.corners, |values| cell.blend(values))
}

/// Returns the cell with a position, whose corners are in `cache` afterwards.
#[inline]
fn cell_at(dims: [usize; 3], p: Vec3, cache: &mut CellCache, corners: impl Fn(&Cell) -> [f32; 8]) -> Cell {
    let cell = Cell::at(dims, p);
    if !cache.is_at(cell.base() as u64) {
        *cache = CellCache::new(cell.base() as u64, corners(&cell));
    }
    cell
}

/// Weighted sums of 3 × 3 voxel values in the y-z plane at one x, from which Sobel gradients are composed: smoothed
/// along y and z, or differenced along one and smoothed along the other.
#[derive(Clone, Copy, Default)]
struct Columns {
    smooth: f32,
    along_y: f32,
    along_z: f32,
}

impl Columns {
    /// Computes the sums of 3 × 3 voxel values given as `at[z][y]`.
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

/// Returns the weight of the values of a grid of `dims` voxels against those of its padding at a point, in voxel indices.
#[inline]
pub(crate) fn share_of_values(dims: [usize; 3], p: Vec3) -> f32 {
    let last = |n: usize| (n - 1) as f32;
    padding_weight(p.x, last(dims[0]))
        * padding_weight(p.y, last(dims[1]))
        * padding_weight(p.z, last(dims[2]))
}

/// Returns the weight of a grid of `dims` voxels and one layer of voxels around it against what is beyond, at a point in
/// voxel indices.
#[inline]
pub(super) fn share_of_padded(dims: [usize; 3], p: Vec3) -> f32 {
    share_of_values(dims.map(|n| n + 2), p + Vec3::ONE)
}

/// Returns the weight of a grid's values against those of its padding at coordinate `x` of one axis, in voxel indices:
/// 1 between the outermost voxel centres (0 and `last`), falling linearly to 0 one voxel beyond.
#[inline]
fn padding_weight(x: f32, last: f32) -> f32 {
    let beyond = if x < 0.0 { -x } else { x - last };
    if beyond <= 0.0 {
        1.0
    } else if beyond < 1.0 {
        1.0 - beyond
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn grid(dims: [usize; 3], f: impl Fn(Vec3) -> f32) -> Grid {
        let mut values = Vec::new();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                values.extend((0..dims[0]).map(|x| f(Vec3::new(x as f32, y as f32, z as f32))));
            }
        }
        Grid::new(dims, values).unwrap()
    }

    /// Padding of zeros: no voxel is object.
    const ZERO: Padding = Padding { background: 0.0, iso: f32::INFINITY };

    fn ramp(p: Vec3) -> f32 {
        1.0 + 2.0 * p.x - 3.0 * p.y + 0.5 * p.z
    }

    /// Random parts of a grid are replaced; the gradient is then that of the whole grid.
    #[test]
    fn the_gradient_is_updated_where_values_have_changed() {
        let mut random = Random::new(4);
        let mut g = grid([9, 7, 6], |p| p.x * p.y - p.z);
        let mut gradient = g.sobel().unwrap();
        for _ in 0..60 {
            let min = g.dims.map(|n| random.below(n as u32) as usize);
            let dims =
                [0, 1, 2].map(|axis| 1 + random.below((g.dims[axis] - min[axis]).min(4) as u32) as usize);
            let region = Region { min, dims };
            let values = (0..region.len()).map(|_| random.unit() as f32).collect();
            g.overwrite(region, &Grid { dims, values });
            let before = gradient.clone();
            g.update_sobel(&mut gradient, region).unwrap();
            assert!(gradient == g.sobel().unwrap() && gradient != before);
        }
    }

    #[test]
    fn a_linear_field_is_sampled_exactly_between_voxels() {
        let g = grid([5, 4, 6], ramp);
        for p in [Vec3::ZERO, Vec3::new(0.25, 2.5, 4.75), Vec3::new(4.0, 3.0, 5.0), Vec3::new(3.5, 0.0, 0.5)]
        {
            assert!((g.sample(p) - ramp(p)).abs() < 1e-5, "at {p}");
        }
    }

    #[test]
    fn outside_the_border_goes_on() {
        let g = grid([5, 4, 6], ramp);
        let held = Vec3::new(0.0, 3.0, 2.5);
        assert_eq!(g.sample(Vec3::new(-7.0, 9.0, 2.5)), g.sample(held));
        assert_eq!(
            g.sample(Vec3::new(f32::INFINITY, f32::NEG_INFINITY, 0.0)),
            g.sample(Vec3::new(4.0, 0.0, 0.0))
        );
        assert_eq!(g.sample(Vec3::new(f32::NAN, 0.0, 0.0)), g.sample(Vec3::ZERO));
    }

    #[test]
    fn padded_sampling_is_sampling_of_a_grid_with_zeros_around() {
        let field = |p: Vec3| 3.0 + p.x * p.y - p.z;
        let g = grid([4, 3, 5], field);
        let padded = grid([8, 7, 9], |p| {
            let q = p - Vec3::splat(2.0);
            let inner = q.min_element() >= 0.0 && q.x <= 3.0 && q.y <= 2.0 && q.z <= 4.0;
            if inner { field(q) } else { 0.0 }
        });
        for i in 0..4000 {
            let p = Vec3::new((i % 17) as f32 * 0.45, (i / 17 % 15) as f32 * 0.43, (i / 255) as f32 * 0.57);
            let p = p - Vec3::splat(1.9);
            let expected = padded.sample(p + Vec3::splat(2.0));
            assert!((g.sample_padded(p, ZERO, &mut CellCache::default()) - expected).abs() < 1e-4, "at {p}");
        }
        assert_eq!(g.sample_padded(Vec3::splat(f32::NAN), ZERO, &mut CellCache::default()), 0.0);
    }

    /// Beside object voxels the padding is their mirror image on the iso value; the padded grid is sampled as it would be
    /// if it had these voxels.
    #[test]
    fn padding_ends_objects_half_a_voxel_beyond_the_border() {
        let mut random = Random::new(6);
        let dims = [4, 3, 5];
        let g = Grid { dims, values: (0..60).map(|_| random.unit() as f32).collect() };
        for padding in [Padding { background: 0.0, iso: 0.3 }, Padding { background: 1.0, iso: 0.6 }] {
            let at = |p: Vec3| g.sample_padded(p, padding, &mut CellCache::default());
            for (k, &value) in g.values.iter().enumerate() {
                let p = Vec3::new((k % 4) as f32, (k / 4 % 3) as f32, (k / 12) as f32);
                let is_object = if padding.background < padding.iso {
                    value >= padding.iso
                } else {
                    value <= padding.iso
                };
                for axis in 0..3 {
                    let out = if p[axis] == 0.0 {
                        -1.0
                    } else if p[axis] == (dims[axis] - 1) as f32 {
                        1.0
                    } else {
                        continue;
                    };
                    let mut step = Vec3::ZERO;
                    step[axis] = out;
                    let beside = if is_object { 2.0 * padding.iso - value } else { padding.background };
                    assert!((at(p + step) - beside).abs() < 1e-5 && (at(p) - value).abs() < 1e-5);
                    assert!((at(p + step * 0.5) - 0.5 * (value + beside)).abs() < 1e-5);
                    assert!((at(p + step * 1.75) - 0.25 * beside - 0.75 * padding.background).abs() < 1e-5);
                    assert_eq!(at(p + step * 2.0), padding.background);
                }
            }
        }
    }

    #[test]
    fn the_cell_cache_has_no_influence() {
        let g = grid([6, 5, 4], |p| (p.x * 7.0 + p.y * p.y * 3.0 + p.z * p.x * 5.0) % 11.0);
        let mut cache = CellCache::default();
        for i in 0..2000 {
            let t = i as f32;
            let p = Vec3::new((t * 0.013) % 8.0, (t * 0.007) % 6.0, (t * 0.011) % 5.0) - 1.0;
            assert_eq!(
                g.sample_padded(p, ZERO, &mut cache).to_bits(),
                g.sample_padded(p, ZERO, &mut CellCache::default()).to_bits(),
                "at {p}"
            );
        }
    }

    #[test]
    fn a_grid_of_one_voxel_is_the_same_everywhere() {
        let g = grid([1, 1, 1], |_| 4.0);
        assert_eq!(g.sample(Vec3::new(0.3, -2.0, 9.0)), 4.0);
        assert_eq!(g.sobel().unwrap().values, [Vec3::ZERO]);
    }

    #[test]
    fn sobel_of_a_ramp_is_its_slope_and_halves_at_the_border() {
        let gradient = grid([6, 5, 4], ramp).sobel().unwrap();
        let inner = gradient.values[1 + 6 * (2 + 5 * 2)];
        assert!(inner.distance(Vec3::new(2.0, -3.0, 0.5)) < 1e-5, "{inner}");
        let border = gradient.values[6 * (2 + 5 * 2)];
        assert!(border.distance(Vec3::new(1.0, -3.0, 0.5)) < 1e-5, "{border}");
        assert!(gradient.sample(Vec3::new(2.5, 2.2, 1.5)).distance(Vec3::new(2.0, -3.0, 0.5)) < 1e-5);
    }

    #[test]
    fn sobel_is_the_sum_over_27_voxels_that_defines_it() {
        let g = grid([4, 5, 3], |p| (p.x * 7.0 + p.y * p.y * 3.0 + p.z * p.x * 5.0) % 11.0);
        let at = |x: i32, y: i32, z: i32| {
            let held = |v: i32, n: usize| v.clamp(0, n as i32 - 1) as usize;
            g.values[held(x, 4) + 4 * (held(y, 5) + 5 * held(z, 3))]
        };
        let gradient = g.sobel().unwrap();
        for (index, found) in gradient.values.iter().enumerate() {
            let [x, y, z] = [index % 4, index / 4 % 5, index / 20].map(|v| v as i32);
            let mut sum = Vec3::ZERO;
            for (dx, dy, dz) in (0..27).map(|k| (k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)) {
                let smooth = |d: i32| (2 - d.abs()) as f32;
                let weight = Vec3::new(
                    dx as f32 * smooth(dy) * smooth(dz),
                    dy as f32 * smooth(dx) * smooth(dz),
                    dz as f32 * smooth(dx) * smooth(dy),
                );
                sum += weight * at(x + dx, y + dy, z + dz);
            }
            assert!(found.distance(sum / 32.0) < 1e-5, "voxel {index}: {found}, not {}", sum / 32.0);
        }
    }

    #[test]
    fn values_and_dimensions_must_match() {
        assert!(Grid::new([2, 2, 2], vec![0.0; 7]).is_err());
        assert!(Grid::new([0, 2, 2], vec![]).is_err());
        assert!(Grid::new([usize::MAX, 2, 2], vec![0.0]).is_err());
    }
}
