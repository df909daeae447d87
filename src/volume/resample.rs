//! Resampling of a volume to another grid.

use super::derived::Derivation;
use super::error::{VolumeError, reserve};
use super::same_grid::GRID_TOLERANCE;
use super::sampling::trilinear;
use super::voxels::{VoxelNumber, Voxels, map_each};
use super::{LengthUnit, Space, Volume, VolumeInit};
use crate::math::{DAffine3, DMat3, DVec3};

/// Grid to which [`Volume::resample`] resamples a volume.
#[derive(Clone, Copy, Debug)]
pub enum ResampleGrid<'a> {
    /// A grid with these numbers of voxels along x, y and z in the same field of view: its edges stay in place.
    Dims([usize; 3]),
    /// A grid with voxels as near to this size along x, y and z, in world units, as a whole number of them allows in the
    /// same field of view.
    Spacing([f64; 3]),
    /// The grid of another volume, whose space may be another one.
    Like(&'a Volume),
}

/// Interpolation method of [`Volume::resample`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Trilinear interpolation of intensities, as [`Volume::sample`]; integer types are rounded.
    #[default]
    Linear,
    /// Stored value of the nearest voxel. Label maps need it: between two labels lies no third one.
    Nearest,
}

impl Volume {
    /// Returns the volume resampled to another grid, in all frames. The numeric type, slope and intercept stay.
    ///
    /// Nothing is smoothed: for a much coarser grid, bin the volume or take a level of its pyramid first. Between the
    /// centres of the outermost voxels and the edges of the volume the border is replicated. Voxels of the grid of
    /// another volume that lie outside this one have intensity 0, or the one nearest to it that the type can store.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] for dimensions of 0, a spacing that is not positive and finite, or another
    /// volume in another unit of length; [`VolumeError::TooLarge`].
    pub fn resample(&self, grid: ResampleGrid<'_>, how: Interpolation) -> Result<Volume, VolumeError> {
        self.resample_within(grid, how, usize::MAX)
    }

    /// Returns what [`Self::resample`] does, of at most `most` voxels in all frames.
    ///
    /// # Errors
    /// As [`Self::resample`]; [`VolumeError::TooLarge`] for more voxels.
    pub fn resample_within(
        &self,
        grid: ResampleGrid<'_>,
        how: Interpolation,
        most: usize,
    ) -> Result<Volume, VolumeError> {
        let target = match grid {
            ResampleGrid::Dims(dims) => self.target_of_dims(dims)?,
            ResampleGrid::Spacing(spacing) => self.target_of_spacing(spacing)?,
            ResampleGrid::Like(other) => self.target_like(other)?,
        };
        let voxels = target.len().saturating_mul(self.frames());
        if voxels > most {
            let bytes = (voxels as u64).saturating_mul(self.voxels.voxel_bytes() as u64);
            return Err(VolumeError::TooLarge { bytes });
        }
        let voxels = map_each!(self.voxels.as_ref(), stored => self.resampled(stored, &target, how)?);
        let [nx, ny, nz] = target.dims;
        let volume = Volume::new(VolumeInit {
            dims: [nx, ny, nz, self.frames()],
            affine: target.affine,
            space: target.space,
            ..self.init_with(voxels)
        })?;
        Ok(volume.derived(self, Derivation::Interpolated).with_unit(target.unit))
    }

    /// Returns the grid of `dims` voxels in the field of view of this volume.
    fn target_of_dims(&self, dims: [usize; 3]) -> Result<Target, VolumeError> {
        if dims.contains(&0) {
            return Err(VolumeError::invalid("dims", format!("must all be at least 1, got {dims:?}")));
        }
        let ratio = DVec3::from([0, 1, 2].map(|axis| self.dims[axis] as f64 / dims[axis] as f64));
        let to_source =
            DAffine3 { matrix3: DMat3::from_diagonal(ratio), translation: (ratio - DVec3::ONE) * 0.5 };
        Ok(Target {
            dims,
            affine: self.affine * to_source,
            to_source,
            space: self.space,
            unit: self.unit,
            limited: false,
        })
    }

    /// Returns the grid with voxels of about the size `spacing` in the field of view of this volume.
    fn target_of_spacing(&self, spacing: [f64; 3]) -> Result<Target, VolumeError> {
        if spacing.iter().any(|&size| !(size > 0.0 && size.is_finite())) {
            return Err(VolumeError::invalid("spacing", format!("must be > 0 and finite, got {spacing:?}")));
        }
        let present = self.spacing();
        self.target_of_dims([0, 1, 2].map(|axis| {
            let count = (self.dims[axis] as f64 * present[axis] / spacing[axis]).round();
            if count >= 1.0 { count as usize } else { 1 }
        }))
    }

    /// Returns the grid of another volume.
    fn target_like(&self, other: &Volume) -> Result<Target, VolumeError> {
        let known = [self.unit, other.unit].iter().all(|&unit| unit != LengthUnit::Unknown);
        if known && self.unit != other.unit {
            let problem = format!("must have the unit of length {:?}, got {:?}", self.unit, other.unit);
            return Err(VolumeError::invalid("like", problem));
        }
        Ok(Target {
            dims: other.dims(),
            affine: other.affine,
            to_source: self.inverse * other.affine_in(self.space),
            space: other.space,
            unit: if known { other.unit } else { self.unit },
            limited: true,
        })
    }

    /// Returns the stored values of all frames on the grid `target`, interpolated from those of this volume.
    fn resampled<T: VoxelNumber>(
        &self,
        stored: &[T],
        target: &Target,
        how: Interpolation,
    ) -> Result<Vec<T>, VolumeError> {
        let mut out = reserve(target.len().saturating_mul(self.frames()))?;
        let dims = self.dims();
        let zero = T::nearest((0.0 - self.intercept) / self.slope);
        for frame in stored.chunks_exact(self.frame_len()) {
            out.extend(target.positions().map(|p| match how {
                _ if target.limited && !covers(dims, p) => zero,
                Interpolation::Linear => T::nearest(self.interpolated(frame, p)),
                Interpolation::Nearest => frame[nearest(dims, p)],
            }));
        }
        Ok(out)
    }

    /// Returns the stored value interpolated at a point, in continuous voxel indices, between the voxels of `frame`.
    #[inline]
    fn interpolated<T: VoxelNumber>(&self, frame: &[T], p: DVec3) -> f64 {
        let value = trilinear(self.dims(), p, |i| frame[i].into());
        // A voxel that is not finite gives a value that is not finite, whatever its weight.
        if value.is_finite() {
            return value;
        }
        trilinear(self.dims(), p, |i| self.finite_stored(frame[i].into()))
    }

    /// Returns a stored value as it is if finite, else the stored value of the intensity that [`Self::finite`] gives.
    fn finite_stored(&self, stored: f64) -> f64 {
        if stored.is_finite() {
            return stored;
        }
        (self.finite(stored * self.slope + self.intercept) - self.intercept) / self.slope
    }
}

/// The grid that a volume is resampled to.
struct Target {
    dims: [usize; 3],
    /// Map from voxel index to world, in the space `space`.
    affine: DAffine3,
    /// Map from voxel index to continuous voxel index of the volume that is resampled.
    to_source: DAffine3,
    space: Space,
    unit: LengthUnit,
    /// Whether voxels outside the volume that is resampled have intensity 0.
    limited: bool,
}

impl Target {
    /// Returns the number of voxels; the largest `usize` if there are more.
    fn len(&self) -> usize {
        self.dims.iter().fold(1, |product, &n| product.saturating_mul(n))
    }

    /// Returns the position of each voxel, x fastest, in continuous voxel indices of the volume that is resampled.
    fn positions(&self) -> impl Iterator<Item = DVec3> {
        let [nx, ny, nz] = self.dims;
        let DAffine3 { matrix3: axes, translation } = self.to_source;
        (0..nz).flat_map(move |z| {
            (0..ny).flat_map(move |y| {
                let start = translation + axes.y_axis * y as f64 + axes.z_axis * z as f64;
                (0..nx).map(move |x| start + axes.x_axis * x as f64)
            })
        })
    }
}

/// Returns whether a point, in continuous voxel indices, lies in a volume of `dims` voxels or within rounding of it.
fn covers(dims: [usize; 3], p: DVec3) -> bool {
    let beyond = 0.5 + GRID_TOLERANCE;
    (0..3).all(|axis| p[axis] >= -beyond && p[axis] <= (dims[axis] - 1) as f64 + beyond)
}

/// Returns the index of the voxel of a frame of `dims` voxels that is nearest to a point, in continuous voxel indices.
fn nearest(dims: [usize; 3], p: DVec3) -> usize {
    let [x, y, z] = [0, 1, 2].map(|axis| {
        // The cast of a negative number or NaN gives 0.
        let index = (p[axis] + 0.5) as usize;
        if index < dims[axis] { index } else { dims[axis] - 1 }
    });
    x + dims[0] * (y + dims[1] * z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn oblique() -> DAffine3 {
        let axes = DMat3::from_cols(
            DVec3::new(0.8, 0.6, 0.0),
            DVec3::new(-0.9, 1.2, 0.2),
            DVec3::new(0.1, 0.0, 2.5),
        );
        DAffine3::from_mat3_translation(axes, DVec3::new(-20.0, 5.0, 7.0))
    }

    fn volume(voxels: Voxels, [nx, ny, nz]: [usize; 3]) -> Volume {
        let init = VolumeInit {
            dims: [nx, ny, nz, voxels.len() / (nx * ny * nz)],
            voxels,
            affine: oblique(),
            slope: 0.5,
            intercept: -3.0,
            frame_seconds: 0.25,
            space: Space::Lps,
        };
        Volume::new(init).unwrap().with_unit(LengthUnit::Millimetre)
    }

    /// Returns two frames of random floats, or of bytes.
    fn random(dims: [usize; 3], bytes: bool) -> Volume {
        let mut random = Random::new(3);
        let count = 2 * dims.iter().product::<usize>();
        let values: Vec<f64> = (0..count).map(|_| f64::from(random.below(200))).collect();
        let like = if bytes { Voxels::U8(Vec::new()) } else { Voxels::F64(Vec::new()) };
        volume(like.like(&values).unwrap(), dims)
    }

    /// Returns the index along each axis of the voxels of a frame, with the index of the voxel in it.
    fn indices([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = (usize, DVec3)> {
        (0..nx * ny * nz)
            .map(move |i| (i, DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|k| k as f64))))
    }

    fn corners(volume: &Volume) -> [DVec3; 2] {
        let far = DVec3::from(volume.dims().map(|n| n as f64 - 0.5));
        [DVec3::splat(-0.5), far].map(|p| volume.affine().transform_point3(p))
    }

    fn assert_same_view(a: &Volume, b: &Volume) {
        assert!(corners(a).iter().zip(corners(b)).all(|(a, b)| a.distance(b) < 1e-9));
        assert_eq!((a.frames(), a.frame_seconds(), a.space()), (b.frames(), b.frame_seconds(), b.space()));
        assert_eq!((a.slope(), a.intercept(), a.unit()), (b.slope(), b.intercept(), b.unit()));
    }

    #[test]
    fn linear_agrees_with_sampling_in_the_world() {
        let v = random([6, 5, 4], false);
        for dims in [[9, 4, 4], [2, 11, 7], [1, 1, 1]] {
            let result = v.resample(ResampleGrid::Dims(dims), Interpolation::Linear).unwrap();
            assert_eq!(result.dims(), dims);
            assert_same_view(&result, &v);
            for frame in 0..2 {
                let found = result.intensities(frame).unwrap();
                for (i, index) in indices(dims) {
                    let expected = v.sample(result.affine().transform_point3(index), frame).unwrap();
                    assert!((f64::from(found[i]) - expected).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn nearest_gives_stored_values_of_the_nearest_voxel() {
        let v = random([6, 5, 4], true);
        let dims = [13, 3, 9];
        let result = v.resample(ResampleGrid::Dims(dims), Interpolation::Nearest).unwrap();
        assert_same_view(&result, &v);
        for (i, index) in indices(dims) {
            let p = v.inverse_affine().transform_point3(result.affine().transform_point3(index));
            // By distance along each axis; ties, which rounding decides, are left out.
            let distance = |q: DVec3| (p - q).abs().max_element();
            let (at, near) =
                indices(v.dims()).min_by(|a, b| (p - a.1).length().total_cmp(&(p - b.1).length())).unwrap();
            if distance(near) < 0.499 {
                for t in 0..2 {
                    assert_eq!(result.voxels().get(i + t * 351), v.voxels().get(at + t * 120));
                }
            }
        }
    }

    #[test]
    fn the_same_grid_gives_the_same_voxels() {
        let v = random([6, 5, 4], true);
        for how in [Interpolation::Linear, Interpolation::Nearest] {
            for grid in
                [ResampleGrid::Dims(v.dims()), ResampleGrid::Spacing(v.spacing()), ResampleGrid::Like(&v)]
            {
                let result = v.resample(grid, how).unwrap();
                assert_eq!(result.voxels(), v.voxels());
                assert_same_view(&result, &v);
            }
        }
    }

    #[test]
    fn spacing_is_as_near_as_the_field_of_view_allows() {
        let v = random([6, 5, 4], true);
        let spacing = v.spacing();
        let wanted = [spacing[0] * 0.5, spacing[1] * 1.3, 1e9];
        let result = v.resample(ResampleGrid::Spacing(wanted), Interpolation::Linear).unwrap();
        assert_eq!(result.dims(), [12, 4, 1]);
        assert_same_view(&result, &v);
    }

    /// Compares with a volume on another grid, in the other space, that overlaps in part.
    #[test]
    fn like_another_volume_in_another_space_with_zero_outside() {
        let v = random([6, 5, 4], false);
        let mirror = DAffine3::from_scale(DVec3::new(-1.0, -1.0, 1.0));
        let turned = DAffine3::from_scale_rotation_translation(
            DVec3::new(0.5, 0.7, 0.9),
            glam::DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9).normalize(),
            DVec3::new(-2.0, -1.0, 0.3),
        );
        let like = Volume::new(VolumeInit {
            affine: mirror * v.affine() * turned,
            ..VolumeInit::new(Voxels::U8(vec![0; 14 * 12 * 10]), [14, 12, 10, 1])
        })
        .unwrap();
        let result = v.resample(ResampleGrid::Like(&like), Interpolation::Linear).unwrap();
        assert_eq!((result.dims(), result.frames(), result.affine()), (like.dims(), 2, like.affine()));
        assert_eq!(
            (result.space(), result.unit(), result.slope()),
            (Space::Ras, LengthUnit::Millimetre, 0.5)
        );
        let (found, mut counts) = (result.intensities(1).unwrap(), [0; 2]);
        for (i, index) in indices(like.dims()) {
            let world = mirror.transform_point3(like.affine().transform_point3(index));
            let p = v.inverse_affine().transform_point3(world);
            let inside = p.min_element() >= -0.5 && p.x <= 5.5 && p.y <= 4.5 && p.z <= 3.5;
            let expected = if inside { v.sample(world, 1).unwrap() } else { 0.0 };
            assert!((f64::from(found[i]) - expected).abs() < 1e-4, "{p}");
            counts[usize::from(inside)] += 1;
        }
        assert!(counts.iter().all(|&n| n > 100), "{counts:?}");
    }

    #[test]
    fn integers_are_rounded_and_outside_is_the_nearest_to_zero() {
        let v = volume(Voxels::U8(vec![10, 13]), [2, 1, 1]);
        let four = v.resample(ResampleGrid::Dims([4, 1, 1]), Interpolation::Linear).unwrap();
        assert_eq!(four.voxels(), &Voxels::U8(vec![10, 11, 12, 13]));
        let beyond = Volume::new(VolumeInit {
            affine: v.affine() * DAffine3::from_translation(DVec3::X),
            ..v.init_with(Voxels::I16(vec![7, 7]))
        });
        let like = beyond.unwrap();
        let moved = v.resample(ResampleGrid::Like(&like), Interpolation::Nearest).unwrap();
        assert_eq!(moved.voxels(), &Voxels::U8(vec![13, 6]), "6 has intensity 0");
        let positive = VolumeInit { intercept: 9.0, ..v.init_with(v.voxels().clone()) };
        let moved = Volume::new(positive).unwrap().resample(ResampleGrid::Like(&like), Interpolation::Linear);
        assert_eq!(moved.unwrap().voxels(), &Voxels::U8(vec![13, 0]), "0 has intensity 9");
    }

    #[test]
    fn nan_is_kept_by_nearest_and_read_as_by_sampling_by_linear() {
        let v = volume(Voxels::F32(vec![f32::NAN, 4.0, f32::INFINITY, 8.0]), [4, 1, 1]);
        let nearest = v.resample(ResampleGrid::Dims([4, 1, 1]), Interpolation::Nearest).unwrap();
        assert!(matches!(nearest.voxels(), Voxels::F32(v) if v[0].is_nan() && v[2] == f32::INFINITY));
        let linear = v.resample(ResampleGrid::Dims([4, 1, 1]), Interpolation::Linear).unwrap();
        assert_eq!(linear.voxels(), &Voxels::F32(vec![4.0, 4.0, 8.0, 8.0]));
    }

    #[test]
    fn grids_that_make_no_sense_are_named() {
        let v = random([6, 5, 4], true);
        let refusal = |grid| v.resample(grid, Interpolation::Linear).unwrap_err().to_string();
        assert!(refusal(ResampleGrid::Dims([0, 1, 1])).starts_with("dims: must all be at least 1"));
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(refusal(ResampleGrid::Spacing([1.0, size, 1.0])).starts_with("spacing: must be > 0"));
        }
        let huge = [ResampleGrid::Dims([usize::MAX; 3]), ResampleGrid::Spacing([1e-300; 3])];
        assert!(huge.iter().all(|&grid| refusal(grid).contains("left of the 4 GiB of WebAssembly")));
        let metres = v.clone().with_unit(LengthUnit::Metre);
        assert!(
            refusal(ResampleGrid::Like(&metres)).starts_with("like: must have the unit of length Millimetre")
        );
    }
}
