//! The labels of all voxels, as small numbers in the order in which the labels were first seen.

use crate::math::order::{rank_f64, sort_by_rank};
use crate::methods::MethodError;
use crate::methods::saved::Hash;
use crate::pauses::Pauses;
use crate::volume::{Region, Volume, VolumeError};
use std::collections::BTreeMap;

/// The number that stands for the background, and for labels that have no surface.
pub const BACKGROUND: u16 = 0;
/// Largest number of labels with surfaces.
const MOST_LABELS: usize = u16::MAX as usize;

/// The number of voxels that are read in a unit of work.
const VOXELS_PER_UNIT: usize = 500;

/// A label map with a layer of background around it.
#[derive(Clone, Debug)]
pub struct LabelGrid {
    dims: [usize; 3],
    /// Number of each voxel's label, x fastest, including the layer around the volume.
    numbers: Vec<u16>,
    /// The label that each number stands for; that of number 1 comes first.
    values: Vec<f64>,
    /// The number of each label, by the rank of the label.
    by_rank: BTreeMap<u64, u16>,
    /// Number of voxels of each label, in the same order.
    voxels: Vec<usize>,
    /// The labels that have surfaces, in ascending order, if not all have.
    wanted: Option<Vec<f64>>,
}

impl LabelGrid {
    /// Reads the first frame of a label map, and pauses meanwhile; `wanted` are the labels that get surfaces, all if not
    /// given.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if `wanted` has a value that is not a label of the volume; an error about the
    /// volume if it is no label map, or too large.
    pub async fn new(
        volume: &Volume,
        wanted: Option<Vec<f64>>,
        pauses: &Pauses,
    ) -> Result<Self, MethodError> {
        if let Some(wanted) = &wanted {
            check_wanted(wanted, &volume.labels(0)?.iter().map(|label| label.value).collect::<Vec<_>>())?;
            pauses.now().await;
        }
        let dims = volume.dims();
        let mut numbers = reserved(dims.map(|n| n + 2))?;
        numbers.resize(dims.iter().map(|n| n + 2).product(), BACKGROUND);
        let (values, by_rank, voxels) = Default::default();
        let mut grid = Self { dims, numbers, values, by_rank, voxels, wanted: wanted.map(sorted) };
        // By layers, as reading needs memory for a copy.
        for z in 0..dims[2] {
            grid.read(volume, Region { min: [0, 0, z], dims: [dims[0], dims[1], 1] })?;
            pauses.after(dims[0] * dims[1] / VOXELS_PER_UNIT).await;
        }
        Ok(grid)
    }

    /// Returns the number of voxels along each axis.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Returns the label that `number`, which is not [`BACKGROUND`], stands for.
    pub fn value(&self, number: u16) -> f64 {
        self.values[usize::from(number) - 1]
    }

    /// Returns the number of voxels of the label that `number`, which is not [`BACKGROUND`], stands for.
    pub fn voxels(&self, number: u16) -> usize {
        self.voxels.get(usize::from(number) - 1).copied().unwrap_or(0)
    }

    /// Returns the number that stands for a label, if the volume has, or had, voxels of it that get a surface.
    pub fn number(&self, value: f64) -> Option<u16> {
        self.by_rank.get(&rank_f64(value)).copied()
    }

    /// Returns the labels that have voxels and a surface, in ascending order.
    pub fn labels(&self) -> Vec<f64> {
        let present = self.values.iter().zip(&self.voxels).filter(|&(_, &voxels)| voxels > 0);
        sorted(present.map(|(&value, _)| value).collect())
    }

    /// Returns the numbers of the labels of all voxels, with the layer around them, x fastest.
    pub fn numbers(&self) -> &[u16] {
        &self.numbers
    }

    /// Returns the numbers at the corners of a cell, which lies between the voxels `at` − 1 and `at`, numbered as in
    /// marching cubes.
    pub fn corners(&self, at: [u32; 3]) -> [u16; 8] {
        let [x, y, z] = at.map(|n| n as usize);
        let [width, height] = [self.dims[0] + 2, self.dims[1] + 2];
        let start = x + width * (y + height * z);
        let (up, back) = (width, width * height);
        [0, up, back, back + up, 1, up + 1, back + 1, back + up + 1]
            .map(|offset| self.numbers[start + offset])
    }

    /// Returns the labels that the numbers 1, 2 and so on stand for.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the same label map with other numbers, which stand for `values` from 1 on; `None` if these are not
    /// different, or a label with voxels is not among them.
    pub fn renumbered(&self, values: &[f64]) -> Option<Self> {
        let ranks = values.iter().map(|&value| rank_f64(value));
        let by_rank: BTreeMap<u64, u16> = ranks.zip(1..=u16::MAX).collect();
        if values.len() > MOST_LABELS || by_rank.len() < values.len() {
            return None;
        }
        let mut grid =
            Self { values: values.to_vec(), by_rank, voxels: vec![0; values.len()], ..self.clone() };
        let mut numbers = vec![BACKGROUND];
        for (&value, &voxels) in self.values.iter().zip(&self.voxels) {
            let number = grid.number(value);
            if voxels > 0 {
                grid.voxels[usize::from(number?) - 1] = voxels;
            }
            numbers.push(number.unwrap_or(BACKGROUND));
        }
        grid.numbers.iter_mut().for_each(|number| *number = numbers[usize::from(*number)]);
        Some(grid)
    }

    /// Adds the labels of all voxels to a hash; it does not depend on the order in which labels were first seen.
    pub fn hash(&self, hash: &mut Hash) {
        for run in self.numbers.chunk_by(|a, b| a == b) {
            let label = if run[0] == BACKGROUND { 0.0 } else { self.value(run[0]) };
            hash.mix(label.to_bits());
            hash.mix(run.len() as u64);
        }
    }

    /// Reads the labels in a region of the volume's first frame again, and returns the numbers before, for
    /// [`Self::replace`]. Labels that are met for the first time get the next numbers.
    ///
    /// # Errors
    /// An error about the region if it is not within the volume, or about the volume if it is no label map or has too
    /// many labels; nothing has changed then.
    pub fn read(&mut self, volume: &Volume, region: Region) -> Result<Vec<u16>, MethodError> {
        let known = self.values.len();
        let mut numbers = reserved(region.dims)?;
        let read = volume.label_runs(region, 0, &mut |label, voxels| {
            let number = self.number_or_new(label);
            numbers.resize(numbers.len() + voxels, number);
        });
        if read.is_err() || self.values.len() > MOST_LABELS {
            self.values.truncate(known);
            self.by_rank.retain(|_, &mut number| usize::from(number) <= known);
            read?;
            let problem = format!("must have at most {MOST_LABELS} labels with surfaces");
            return Err(MethodError::invalid("volume", problem));
        }
        self.voxels.resize(self.values.len(), 0);
        self.replace(region, &mut numbers);
        Ok(numbers)
    }

    fn number_or_new(&mut self, label: f64) -> u16 {
        let has_surface = self.wanted.as_ref().is_none_or(|wanted| contains(wanted, label));
        if label == 0.0 || !has_surface {
            return BACKGROUND;
        }
        if let Some(number) = self.number(label) {
            return number;
        }
        // One label too many is remembered, so that this is noticed; the numbers are then not used.
        if self.values.len() <= MOST_LABELS {
            self.values.push(label);
        }
        let Ok(number) = u16::try_from(self.values.len()) else { return BACKGROUND };
        self.by_rank.insert(rank_f64(label), number);
        number
    }

    /// Exchanges the numbers in a region, x fastest, with those in `numbers`.
    pub fn replace(&mut self, region: Region, numbers: &mut [u16]) {
        let [width, height] = [self.dims[0] + 2, self.dims[1] + 2];
        let [nx, ny, _] = region.dims;
        for (row, new) in numbers.chunks_exact_mut(nx).enumerate() {
            let [y, z] = [region.min[1] + row % ny + 1, region.min[2] + row / ny + 1];
            let start = region.min[0] + 1 + width * (y + height * z);
            for (old, number) in self.numbers[start..start + nx].iter_mut().zip(new) {
                for (label, change) in [(*old, -1), (*number, 1)] {
                    if label != BACKGROUND {
                        let count = &mut self.voxels[usize::from(label) - 1];
                        *count = count.wrapping_add_signed(change);
                    }
                }
                std::mem::swap(old, number);
            }
        }
    }
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    sort_by_rank(&mut values, |&value| rank_f64(value));
    values
}

/// Returns whether values in ascending order contain one.
fn contains(values: &[f64], value: f64) -> bool {
    values.binary_search_by(|other| other.total_cmp(&value)).is_ok()
}

/// Returns an empty array with room for the numbers of `dims` voxels.
fn reserved(dims: [usize; 3]) -> Result<Vec<u16>, VolumeError> {
    let size = dims.iter().try_fold(1usize, |size, &n| size.checked_mul(n));
    let mut numbers = Vec::new();
    let size = size.ok_or(VolumeError::TooLarge { bytes: u64::MAX })?;
    numbers.try_reserve_exact(size).map_err(|_| VolumeError::TooLarge { bytes: 2 * size as u64 })?;
    Ok(numbers)
}

fn check_wanted(wanted: &[f64], present: &[f64]) -> Result<(), MethodError> {
    if wanted.is_empty() {
        return Err(MethodError::invalid("labels", "must be at least one label"));
    }
    let Some(missing) = wanted.iter().find(|&&value| !contains(present, value)) else { return Ok(()) };
    Err(MethodError::invalid("labels", format!("must be labels of the volume, got {missing}")))
}
