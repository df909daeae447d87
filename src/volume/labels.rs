//! Label maps: volumes whose intensities are integers that name regions, with 0 for the background.

use super::error::{VolumeError, reserve};
use super::voxels::Voxels;
use super::{Region, Volume};
use crate::math::order::{rank_f64, sort_ranks};
use std::collections::BTreeMap;
use std::ops::Range;

/// Largest number of labels in a label map; volumes with more different integers are images.
const MAX_LABELS: usize = 65_536;
/// Largest span of stored values that are counted in a table with one entry per value (of 8 MB); values of a larger
/// span are counted in a map.
const TABLE_SPAN: u64 = 1 << 20;
/// Number of labels that an error message lists.
const SHOWN_LABELS: usize = 10;

/// A label of a label map and its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelCount {
    /// The label: an intensity, which is an integer other than 0.
    pub value: f64,
    /// Number of voxels that have the label.
    pub voxels: usize,
}

/// A label with one of the stored values that mean it, and the number of voxels with that value.
#[derive(Clone, Copy)]
struct StoredLabel {
    label: f64,
    stored: i64,
    voxels: usize,
}

/// Evaluates an expression with `$values` bound to the typed vector inside `$voxels` if these are integers, else returns
/// the error about a volume that is no label map.
macro_rules! each_integer {
    ($voxels:expr, $values:ident => $body:expr) => {
        match $voxels {
            Voxels::U8($values) => $body,
            Voxels::I8($values) => $body,
            Voxels::U16($values) => $body,
            Voxels::I16($values) => $body,
            Voxels::U32($values) => $body,
            Voxels::I32($values) => $body,
            floats @ (Voxels::F32(_) | Voxels::F64(_)) => return Err(not_integers(floats)),
        }
    };
}

impl Volume {
    /// Returns the labels in one frame of a label map, in ascending order: all intensities that occur but 0, the
    /// background.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if the voxels are floats, an intensity is not an integer, there are more than
    /// 65,536 labels, or `frame` is out of range.
    pub fn labels(&self, frame: usize) -> Result<Vec<LabelCount>, VolumeError> {
        let start = self.frame_start(frame)?;
        let mut labels: Vec<LabelCount> = Vec::new();
        for StoredLabel { label, voxels, .. } in self.stored_labels(start..start + self.frame_len())? {
            match labels.last_mut().filter(|last| last.value == label) {
                Some(last) => last.voxels += voxels,
                None => labels.push(LabelCount { value: label, voxels }),
            }
        }
        Ok(labels)
    }

    /// Returns the mask of the voxels of a label map that have one of the labels `values`: 1 there, 0 elsewhere, in all
    /// frames.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if `values` is empty or a value is not a label of any frame, and for volumes
    /// that are no label map, as [`labels`](Self::labels); [`VolumeError::TooLarge`].
    pub fn label(&self, values: &[f64]) -> Result<Volume, VolumeError> {
        let labels = self.stored_labels(0..self.voxels.len())?;
        check_wanted(values, &labels)?;
        let mut wanted: Vec<u64> = values.iter().map(|&value| rank_f64(value)).collect();
        sort_ranks(&mut wanted);
        let is_wanted = |l: &&StoredLabel| wanted.binary_search(&rank_f64(l.label)).is_ok();
        let mut stored: Vec<i64> = labels.iter().filter(is_wanted).map(|l| l.stored).collect();
        if self.slope < 0.0 {
            stored.reverse();
        }
        let mask = each_integer!(self.voxels.as_ref(), values => mask_of(values, &stored))?;
        self.mask(mask)
    }

    /// Calls `visit` with the label, 0 for the background, and the length of each run of voxels with equal stored values
    /// in the rows of a region of one frame of a label map, in the order of the voxels.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if the region is empty or not within the volume, `frame` is out of range, the
    /// voxels are floats, or an intensity is not an integer; `visit` may have been called then.
    pub fn label_runs(
        &self,
        region: Region,
        frame: usize,
        visit: &mut dyn FnMut(f64, usize),
    ) -> Result<(), VolumeError> {
        let start = self.frame_start(frame)?;
        region.check("region", self.dims())?;
        for row in region.rows(self.dims(), start) {
            each_integer!(self.voxels.as_ref(), values => {
                for (stored, times) in runs(&values[row]) {
                    visit(self.intensity_of(stored)?, times);
                }
            });
        }
        Ok(())
    }

    /// Returns an error unless the voxels are integers, as those of label maps.
    pub(super) fn check_integers(&self) -> Result<(), VolumeError> {
        each_integer!(self.voxels.as_ref(), _values => Ok(()))
    }

    /// Returns the labels of the voxels with indices in `range`, in ascending order, with the stored values that mean
    /// them. There are several for one label only where a large intercept absorbs the differences.
    fn stored_labels(&self, range: Range<usize>) -> Result<Vec<StoredLabel>, VolumeError> {
        let counts = each_integer!(self.voxels.as_ref(), values => count(&values[range]))?;
        let mut labels = Vec::new();
        for (stored, voxels) in counts {
            let label = self.intensity_of(stored)?;
            if label != 0.0 {
                labels.push(StoredLabel { label, stored, voxels });
            }
        }
        if labels.len() > MAX_LABELS {
            return Err(too_many());
        }
        if self.slope < 0.0 {
            labels.reverse();
        }
        Ok(labels)
    }

    /// Returns the intensity of a stored value; an error if it is not an integer.
    fn intensity_of(&self, stored: i64) -> Result<f64, VolumeError> {
        let intensity = stored as f64 * self.slope + self.intercept;
        if intensity == libm::trunc(intensity) {
            return Ok(intensity);
        }
        let problem = format!(
            "must have integer intensities to be a label map, got {intensity} (stored {stored}, slope {}, intercept {})",
            self.slope, self.intercept
        );
        Err(VolumeError::invalid("volume", problem))
    }
}

fn not_integers(voxels: &Voxels) -> VolumeError {
    let problem =
        format!("must have voxels of an integer type to be a label map, got {}", voxels.type_name());
    VolumeError::invalid("volume", problem)
}

fn too_many() -> VolumeError {
    VolumeError::invalid(
        "volume",
        format!("must have at most {MAX_LABELS} different labels to be a label map"),
    )
}

/// Returns an error unless there is at least one value, and each is one of the labels, which are in ascending order.
fn check_wanted(values: &[f64], labels: &[StoredLabel]) -> Result<(), VolumeError> {
    if values.is_empty() {
        return Err(VolumeError::invalid("value", "must be at least one label"));
    }
    let is_label = |value: f64| labels.binary_search_by(|l| l.label.total_cmp(&value)).is_ok();
    let Some(missing) = values.iter().find(|&&value| !is_label(value)) else { return Ok(()) };
    Err(VolumeError::invalid(
        "value",
        format!(
            "must be a label of the volume ({}), got {missing}",
            listed(labels.iter().map(|l| l.label).collect())
        ),
    ))
}

/// Returns the first labels as text, for an error message.
pub(crate) fn listed(mut values: Vec<f64>) -> String {
    values.dedup();
    let shown: Vec<String> = values.iter().take(SHOWN_LABELS).map(f64::to_string).collect();
    match values.len() {
        0 => "it has none".to_owned(),
        n if n > SHOWN_LABELS => format!("{}, … {n} in all", shown.join(", ")),
        _ => shown.join(", "),
    }
}

/// Returns the different values in ascending order, each with the number of times it occurs.
fn count<T: Copy + Ord + Into<i64>>(values: &[T]) -> Result<Vec<(i64, usize)>, VolumeError> {
    let (Some(&low), Some(&high)) = (values.iter().min(), values.iter().max()) else { return Ok(Vec::new()) };
    let (low, high): (i64, i64) = (low.into(), high.into());
    if low.abs_diff(high) < TABLE_SPAN { count_in_table(values, low, high) } else { count_in_map(values) }
}

/// Implements [`count`] for values from `low` to `high`.
fn count_in_table<T: Copy + Ord + Into<i64>>(
    values: &[T],
    low: i64,
    high: i64,
) -> Result<Vec<(i64, usize)>, VolumeError> {
    let span = (high - low) as usize + 1;
    let mut counts = reserve(span)?;
    counts.resize(span, 0usize);
    for (value, times) in runs(values) {
        counts[(value - low) as usize] += times;
    }
    Ok((low..).zip(counts).filter(|&(_, times)| times > 0).collect())
}

/// Implements [`count`] for values of any span; an error if there are too many different ones.
fn count_in_map<T: Copy + Ord + Into<i64>>(values: &[T]) -> Result<Vec<(i64, usize)>, VolumeError> {
    let mut counts = BTreeMap::new();
    for (value, times) in runs(values) {
        *counts.entry(value).or_insert(0) += times;
        // One of the values may be the background.
        if counts.len() > MAX_LABELS + 1 {
            return Err(too_many());
        }
    }
    Ok(counts.into_iter().collect())
}

/// Returns the runs of equal values: the value and the length of each.
fn runs<T: Copy + Ord + Into<i64>>(values: &[T]) -> impl Iterator<Item = (i64, usize)> {
    values.chunk_by(|a, b| a == b).map(|run| (run[0].into(), run.len()))
}

/// Returns 1 for each value that is one of `wanted`, which ascend, and 0 for the others.
fn mask_of<T: Copy + Ord + Into<i64>>(values: &[T], wanted: &[i64]) -> Result<Vec<u8>, VolumeError> {
    let mut mask = reserve(values.len())?;
    for (value, times) in runs(values) {
        let inside = wanted.binary_search(&value).is_ok();
        mask.resize(mask.len() + times, u8::from(inside));
    }
    Ok(mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, Random};
    use crate::volume::{Space, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn scaled(voxels: Voxels, frames: usize, slope: f64, intercept: f64) -> Volume {
        Volume::new(VolumeInit {
            dims: [voxels.len() / frames, 1, 1, frames],
            voxels,
            affine: DAffine3::IDENTITY,
            slope,
            intercept,
            frame_seconds: 0.5,
            space: Space::Lps,
        })
        .unwrap()
    }

    fn plain(voxels: Voxels) -> Volume {
        scaled(voxels, 1, 1.0, 0.0)
    }

    fn pairs(volume: &Volume, frame: usize) -> Vec<(f64, usize)> {
        volume.labels(frame).unwrap().iter().map(|l| (l.value, l.voxels)).collect()
    }

    fn refusal<T: std::fmt::Debug>(result: Result<T, VolumeError>) -> String {
        result.unwrap_err().to_string()
    }

    #[test]
    fn labels_ascend_without_the_background_in_every_integer_type() {
        let expected = [(1.0, 1), (2.0, 2), (9.0, 1)];
        for voxels in [
            Voxels::U8(vec![2, 0, 9, 2, 1]),
            Voxels::I8(vec![2, 0, 9, 2, 1]),
            Voxels::U16(vec![2, 0, 9, 2, 1]),
            Voxels::I16(vec![2, 0, 9, 2, 1]),
            Voxels::U32(vec![2, 0, 9, 2, 1]),
            Voxels::I32(vec![2, 0, 9, 2, 1]),
        ] {
            assert_eq!(pairs(&plain(voxels), 0), expected);
        }
        let far = plain(Voxels::I32(vec![i32::MAX, -7, 0, i32::MIN, -7]));
        assert_eq!(pairs(&far, 0), [(-2_147_483_648.0, 1), (-7.0, 2), (2_147_483_647.0, 1)]);
        assert!(pairs(&plain(Voxels::U8(vec![0; 4])), 0).is_empty());
    }

    #[test]
    fn labels_are_intensities_of_one_frame() {
        let v = scaled(Voxels::U8(vec![4, 4, 2, 2, 0, 6]), 2, -0.5, 2.0);
        assert_eq!(pairs(&v, 0), [(1.0, 1)]);
        assert_eq!(pairs(&v, 1), [(-1.0, 1), (1.0, 1), (2.0, 1)]);
        assert!(refusal(v.labels(2)).starts_with("frame: "));
        // Both stored values mean the same label.
        let absorbed = scaled(Voxels::U8(vec![1, 2]), 1, 1e-20, 3.0);
        assert_eq!(pairs(&absorbed, 0), [(3.0, 2)]);
        assert_eq!(absorbed.label(&[3.0]).unwrap().voxels(), &Voxels::U8(vec![1, 1]));
    }

    #[test]
    fn counts_and_masks_agree_with_brute_force() {
        let mut random = Random::new(5);
        for spread in [1, 3_000_000] {
            let stored: Vec<i32> = (0..3000).map(|_| (random.below(40) as i32 - 20) * spread).collect();
            let v = scaled(Voxels::I32(stored.clone()), 1, 2.0, 6.0);
            let labels = v.labels(0).unwrap();
            let of = |value: f64| stored.iter().filter(|&&s| f64::from(s) * 2.0 + 6.0 == value).count();
            assert!(labels.iter().all(|l| of(l.value) == l.voxels && l.voxels > 0));
            let zeros = of(0.0);
            assert_eq!(labels.iter().map(|l| l.voxels).sum::<usize>() + zeros, 3000);
            assert!(labels.is_sorted_by(|a, b| a.value < b.value));
            let wanted = [labels[7].value, labels[0].value, labels[31].value, labels[7].value];
            let mask = v.label(&wanted).unwrap();
            let expected = stored.iter().map(|&s| u8::from(wanted.contains(&(f64::from(s) * 2.0 + 6.0))));
            assert_eq!(mask.voxels(), &Voxels::U8(expected.collect()));
        }
    }

    #[test]
    fn masks_cover_all_frames_on_the_same_grid() {
        let v = scaled(Voxels::U16(vec![300, 0, 5, 5, 300, 5]), 2, 1.0, 0.0);
        let mask = v.label(&[300.0]).unwrap();
        assert_eq!(mask.voxels(), &Voxels::U8(vec![1, 0, 0, 0, 1, 0]));
        assert_eq!(
            (mask.dims(), mask.frames(), mask.space(), mask.frame_seconds()),
            ([3, 1, 1], 2, Space::Lps, 0.5)
        );
        assert_eq!(v.label(&[5.0, 300.0]).unwrap().voxels(), &Voxels::U8(vec![1, 0, 1, 1, 1, 1]));
    }

    #[test]
    fn missing_labels_are_named_with_those_there_are() {
        let v = plain(Voxels::U8((0..=14).collect()));
        let found = refusal(v.label(&[3.0, 77.0]));
        assert_eq!(
            found,
            "value: must be a label of the volume (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, … 14 in all), got 77"
        );
        assert!(refusal(plain(Voxels::U8(vec![2, 0, 4])).label(&[0.0])).ends_with("(2, 4), got 0"));
        assert!(refusal(plain(Voxels::U8(vec![0])).label(&[1.0])).contains("it has none"));
        assert!(refusal(v.label(&[])).starts_with("value: must be at least one"));
        assert!(refusal(v.label(&[f64::NAN])).starts_with("value: "));
    }

    #[test]
    fn images_are_no_label_maps() {
        let floats = plain(Voxels::F32(vec![1.0, 2.0]));
        for found in [refusal(floats.labels(0)), refusal(floats.label(&[1.0]))] {
            assert_eq!(
                found,
                "volume: must have voxels of an integer type to be a label map, got 32-bit floats"
            );
        }
        let halves = scaled(Voxels::U8(vec![2, 3]), 1, 0.5, 0.0);
        assert!(refusal(halves.labels(0)).contains("got 1.5 (stored 3, slope 0.5, intercept 0)"));
        for step in [1, 40_000] {
            let many = plain(Voxels::U32((0..=65_537).map(|i| i * step).collect()));
            assert!(refusal(many.labels(0)).contains("at most 65536"));
            let just = plain(Voxels::U32((0..=65_536).map(|i| i * step).collect()));
            assert_eq!(just.labels(0).unwrap().len(), 65_536);
        }
    }
}
