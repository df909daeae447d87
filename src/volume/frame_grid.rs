//! One frame of a volume as a grid of normalised intensities, without a copy of voxels that are integers.

use super::error::{VolumeError, reserve};
use super::grid::{self, CellCache, Grid, Padding, VectorGrid};
use super::pyramid;
use super::sampling::Cell;
use super::voxels::{VoxelNumber, Voxels, each};
use super::{Normalisation, Region, Volume};
use crate::math::Vec3;
use crate::pauses::Pauses;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// One frame of a volume as a grid of intensities, scaled from a range to [0, 1].
///
/// Those of many integers are computed from the voxels of the volume each time they are read: in single precision, they would
/// take up to four times as much memory as the volume beside it.
#[derive(Clone, Debug)]
pub(crate) enum FrameGrid {
    /// Intensities in single precision, shared by clones until they are changed.
    Stored(Arc<Grid>),
    /// The voxels of a volume, all of them finite.
    Shared(SharedVoxels),
}

/// The voxels of a frame, which belong to a volume, and the map from them to intensities.
#[derive(Clone, Debug)]
pub(crate) struct SharedVoxels {
    dims: [usize; 3],
    voxels: Arc<Voxels>,
    /// The index of the first voxel of the frame.
    start: usize,
    normalisation: Normalisation,
}

impl SharedVoxels {
    fn value(&self, index: usize) -> f32 {
        each!(&*self.voxels, values => self.normalised(values[self.start + index]))
    }

    #[inline]
    fn corners(&self, cell: &Cell) -> [f32; 8] {
        each!(&*self.voxels, values => {
            cell.corners(|index| self.normalised(values[self.start + index]))
        })
    }

    #[inline]
    fn normalised<T: VoxelNumber>(&self, stored: T) -> f32 {
        self.normalisation.of(stored.into()) as f32
    }

    /// Appends the values of consecutive voxels to `out`.
    fn append(&self, voxels: Range<usize>, out: &mut Vec<f32>) {
        let voxels = self.start + voxels.start..self.start + voxels.end;
        each!(&*self.voxels, values => out.extend(values[voxels].iter().map(|&value| self.normalised(value))));
    }

    fn part(&self, region: Region) -> Result<Grid, VolumeError> {
        let mut values = reserve(region.len())?;
        region.rows(self.dims, 0).for_each(|row| self.append(row, &mut values));
        Ok(Grid { dims: region.dims, values })
    }

    fn stored(&self) -> Result<Grid, VolumeError> {
        self.part(Region { min: [0; 3], dims: self.dims })
    }
}

/// The largest number of integers that are copied in single precision, 64 MiB. A run on fewer voxels would take a
/// twentieth longer if they were shared.
const COPIED: usize = 1 << 24;

impl From<Grid> for FrameGrid {
    fn from(grid: Grid) -> Self {
        Self::Stored(Arc::new(grid))
    }
}

impl FrameGrid {
    /// Returns the number of voxels along x, y and z.
    #[inline]
    pub(crate) fn dims(&self) -> [usize; 3] {
        match self {
            Self::Stored(grid) => grid.dims,
            Self::Shared(shared) => shared.dims,
        }
    }

    /// Returns the intensity of a voxel, given by its index.
    #[inline]
    pub(crate) fn value(&self, index: usize) -> f32 {
        match self {
            Self::Stored(grid) => grid.values[index],
            Self::Shared(shared) => shared.value(index),
        }
    }

    /// Returns the intensities of consecutive voxels, given by their indices.
    pub(crate) fn values(&self, voxels: Range<usize>) -> Cow<'_, [f32]> {
        match self {
            Self::Stored(grid) => Cow::Borrowed(&grid.values[voxels]),
            Self::Shared(shared) => {
                let mut values = Vec::with_capacity(voxels.len());
                shared.append(voxels, &mut values);
                Cow::Owned(values)
            }
        }
    }

    /// As [`Self::values`], in a buffer where they are not stored.
    pub(crate) fn values_in<'a>(&'a self, voxels: Range<usize>, buffer: &'a mut Vec<f32>) -> &'a [f32] {
        match self {
            Self::Stored(grid) => &grid.values[voxels],
            Self::Shared(shared) => {
                buffer.clear();
                shared.append(voxels, buffer);
                buffer
            }
        }
    }

    /// Returns all intensities in parts of at most `size` voxels.
    pub(crate) fn parts(&self, size: usize) -> impl Iterator<Item = Cow<'_, [f32]>> {
        let count = self.dims().iter().product::<usize>();
        (0..count).step_by(size).map(move |first| self.values(first..count.min(first + size)))
    }

    /// Returns the intensities of the slice with the index `z`, row by row.
    pub(crate) fn slice(&self, z: usize) -> Cow<'_, [f32]> {
        let [nx, ny, _] = self.dims();
        self.values(z * nx * ny..(z + 1) * nx * ny)
    }

    /// Returns the part in a region, which must lie within the grid.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn part(&self, region: Region) -> Result<Grid, VolumeError> {
        match self {
            Self::Stored(grid) => grid.part(region),
            Self::Shared(shared) => shared.part(region),
        }
    }

    /// Returns the grid in single precision, to be changed. The voxels of a volume are copied.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn stored_mut(&mut self) -> Result<&mut Grid, VolumeError> {
        if let Self::Shared(shared) = self {
            *self = shared.stored()?.into();
        }
        match self {
            Self::Stored(grid) => Ok(Arc::make_mut(grid)),
            Self::Shared(_) => unreachable!("has just been replaced"),
        }
    }

    /// Returns the trilinearly interpolated intensity, as [`Grid::sample`].
    pub(crate) fn sample(&self, p: Vec3) -> f32 {
        let cell = Cell::at(self.dims(), p);
        cell.blend(&self.corners(&cell))
    }

    /// Returns the trilinearly interpolated intensity, as [`Grid::sample_padded`].
    #[inline]
    pub(crate) fn sample_padded(&self, p: Vec3, padding: Padding, cache: &mut CellCache) -> f32 {
        self.sample_padded_by((self.dims(), p), p, padding, cache)
    }

    /// Returns the trilinearly interpolated intensity, as [`Grid::sample_padded_by`].
    #[inline]
    pub(crate) fn sample_padded_by(
        &self,
        parts: ([usize; 3], Vec3),
        p: Vec3,
        padding: Padding,
        cache: &mut CellCache,
    ) -> f32 {
        grid::sample_padded(self.dims(), parts, p, padding, cache, |cell| self.corners(cell))
    }

    #[inline]
    pub(super) fn corners(&self, cell: &Cell) -> [f32; 8] {
        match self {
            Self::Stored(grid) => cell.corners(|index| grid.values[index]),
            Self::Shared(shared) => shared.corners(cell),
        }
    }

    /// Returns the gradient image, as [`Grid::sobel`].
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn sobel(&self) -> Result<VectorGrid, VolumeError> {
        match self {
            Self::Stored(grid) => grid.sobel(),
            Self::Shared(shared) => shared.stored()?.sobel(),
        }
    }

    /// Returns the next coarser level of the pyramid, as [`pyramid::reduce_along`].
    ///
    /// # Errors
    /// As [`Grid::reduce`].
    pub(crate) async fn reduce_along(
        &self,
        axes: [bool; 3],
        spacing: [f64; 3],
        steps: [f64; 2],
        pauses: &Pauses,
    ) -> Result<(Grid, [f64; 3]), VolumeError> {
        pyramid::reduce_along(self.dims(), |z| Ok(self.slice(z)), axes, spacing, steps, pauses).await
    }
}

impl Volume {
    /// Returns one frame as a grid with intensities scaled from `range` to [0, 1], with the values of
    /// [`Self::grid_in`].
    ///
    /// # Errors
    /// As [`Self::grid_in`].
    pub(crate) fn frame_grid(&self, range: [f64; 2], frame: usize) -> Result<FrameGrid, VolumeError> {
        let are_many = self.dims().iter().product::<usize>() > COPIED;
        let shared = if are_many { self.shared_voxels(range, frame)? } else { None };
        shared.map_or_else(
            || self.grid_in(range, frame).map(FrameGrid::from),
            |shared| Ok(FrameGrid::Shared(shared)),
        )
    }

    /// Returns the voxels of one frame, to be shared; `None` if some may not be finite.
    fn shared_voxels(&self, range: [f64; 2], frame: usize) -> Result<Option<SharedVoxels>, VolumeError> {
        if self.may_lack_values() {
            return Ok(None);
        }
        Ok(Some(SharedVoxels {
            dims: self.dims(),
            voxels: self.voxels.clone(),
            start: self.frame_start(frame)?,
            normalisation: Normalisation::new([self.slope, self.intercept], range),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::pauses::finished;
    use crate::volume::VolumeInit;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const DIMS: [usize; 3] = [7, 5, 4];

    /// Returns volumes of two frames of random voxels of each type.
    fn volumes(random: &mut Random) -> Vec<Volume> {
        let count = 2 * DIMS.iter().product::<usize>();
        let mut numbers = |span: f64| (0..count).map(|_| span * (random.unit() - 0.5)).collect::<Vec<f64>>();
        macro_rules! of {
            ($($kind:ident: $number:ty),*) => {
                [$(Voxels::$kind(numbers(100.0).iter().map(|&v| v as $number).collect())),*]
            };
        }
        let all = of!(U8: u8, I8: i8, U16: u16, I16: i16, U32: u32, I32: i32, F32: f32, F64: f64);
        let [nx, ny, nz] = DIMS;
        let volume =
            |voxels| VolumeInit { slope: -0.37, intercept: 11.0, ..VolumeInit::new(voxels, [nx, ny, nz, 2]) };
        all.into_iter().map(|voxels| Volume::new(volume(voxels)).unwrap()).collect()
    }

    #[test]
    fn whatever_is_read_of_a_shared_grid_has_the_bits_of_a_stored_one() {
        let mut random = Random::new(1);
        for volume in volumes(&mut random) {
            let [low, high] = volume.range();
            for (frame, range) in [(0, [low, high]), (1, [low, high]), (1, [0.25 * low, 0.25 * high])] {
                let stored = volume.grid_in(range, frame).unwrap();
                let shared = volume.shared_voxels(range, frame).unwrap();
                let mut grid =
                    shared.map_or_else(|| volume.frame_grid(range, frame).unwrap(), FrameGrid::Shared);
                assert_eq!(grid.dims(), stored.dims);
                assert_eq!(grid.values(3..29)[..], stored.values[3..29]);
                assert_eq!(grid.values_in(3..29, &mut Vec::new()), &stored.values[3..29]);
                assert_eq!(grid.parts(9).collect::<Vec<_>>().concat(), stored.values);
                assert!(stored.values.iter().enumerate().all(|(k, &value)| grid.value(k) == value));
                let region = Region { min: [2, 0, 1], dims: [4, 5, 2] };
                assert_eq!(grid.part(region).unwrap(), stored.part(region).unwrap());
                assert_eq!(grid.sobel().unwrap(), stored.sobel().unwrap());
                let axes = [true, true, false];
                let reduced = |grid: &FrameGrid| {
                    finished(grid.reduce_along(axes, [1.0; 3], [1.0, 1.7], &Pauses::default())).unwrap()
                };
                assert_eq!(reduced(&grid), reduced(&stored.clone().into()));
                let padding = Padding { background: 0.1, iso: 0.4 };
                for _ in 0..200 {
                    let p = Vec3::from(DIMS.map(|n| ((n as f64 + 4.0) * random.unit() - 2.5) as f32));
                    assert_eq!(grid.sample(p), stored.sample(p));
                    let [mut cache, mut other] = [CellCache::default(); 2];
                    let sample = grid.sample_padded(p, padding, &mut cache);
                    assert_eq!(sample, stored.sample_padded(p, padding, &mut other), "at {p}");
                }
                assert_eq!(*grid.stored_mut().unwrap(), stored);
            }
        }
    }

    #[test]
    fn only_integers_are_shared() {
        for volume in volumes(&mut Random::new(2)) {
            let is_shared = volume.shared_voxels(volume.range(), 0).unwrap().is_some();
            assert_eq!(is_shared, !matches!(volume.voxels(), Voxels::F32(_) | Voxels::F64(_)));
        }
    }

    #[test]
    fn few_voxels_are_copied_and_many_shared() {
        const SIDE: usize = 1 << 12;
        let volume = |rows: usize| {
            let values = (0..SIDE * rows).map(|k| k as u8).collect();
            Volume::new(VolumeInit::new(Voxels::U8(values), [SIDE, rows, 1, 1])).unwrap()
        };
        let few = volume(COPIED / SIDE).frame_grid([0.0, 255.0], 0).unwrap();
        let many = volume(COPIED / SIDE + 1).frame_grid([0.0, 255.0], 0).unwrap();
        assert!(matches!((&few, &many), (FrameGrid::Stored(_), FrameGrid::Shared(_))));
        assert_eq!(few.values(COPIED - 300..COPIED), many.values(COPIED - 300..COPIED));
    }
}
