//! Interpolation of further slices in volumes with thick slices, so that shapes vary less from slice to slice (dynamic
//! surfaces from 4D cardiac MRI, section 5.2).

use super::derived::Derivation;
use super::error::{VolumeError, reserve};
use super::flow::{Flow, Image, symmetric_flow};
use super::voxels::Voxels;
use super::{Region, Volume, VolumeInit};
use crate::math::{DAffine3, DVec3};
use crate::pauses::{Pauses, finished};

/// Interpolation method of [`Volume::enrich_slices`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Enrichment {
    /// An interpolated slice is the linear interpolation of the two neighbouring slices, both warped along the optical
    /// flow between them.
    #[default]
    Flow,
    /// An interpolated slice is the linear interpolation of the two neighbouring slices, without optical flow.
    Linear,
}

/// Largest factor by which [`Volume::enrich_slices`] multiplies the number of slices: with a larger one, further slices
/// add no information.
const MAX_FACTOR: usize = 16;

/// The most pixels that slices are apart once [`Volume::enrich_slices`] has chosen the factor itself: twice a pixel, and a
/// little more for spacings that are rounded. The tracker's planes bridge that without reaching further than pixels ask.
const MOST_APART: f64 = 2.1;

/// The largest factor that [`Volume::enrich_slices`] chooses itself. An interpolated edge across the slices is a ramp
/// from slice to slice; one longer than the tracker's windows holds a boundary at any level, and balls come out up to a
/// sixth too large, with handles.
const MAX_CHOSEN_FACTOR: f64 = 3.0;

/// The most memory that the result and the images between two slices may take, in bytes. A whole body in slices of 3 mm,
/// enriched to the size of its pixels, takes less; beside a larger one there is no memory to work with it.
const MOST_BYTES: u64 = 1 << 30;

impl Enrichment {
    /// Returns the bytes that the images between two slices take for each pixel, measured.
    fn bytes_per_pixel(self) -> u64 {
        match self {
            Self::Flow => 80,
            Self::Linear => 40,
        }
    }
}

impl Volume {
    /// Returns the volume with `factor` − 1 slices interpolated between each pair of neighbouring slices along the axis
    /// of the largest spacing.
    ///
    /// The original slices are unchanged and keep their world positions; the numeric type is kept. If `factor` is
    /// `None`, it is the smallest that brings slices to about twice as far apart as pixels, at most 3: the one that tracks
    /// best; 1 changes nothing. Each frame is interpolated separately.
    ///
    /// # Errors
    /// `factor` not in 1..=16; a single slice along that axis with a factor above 1; [`VolumeError::TooLarge`], also if that
    /// would take more than 1 GiB.
    pub fn enrich_slices(&self, factor: Option<usize>, method: Enrichment) -> Result<Volume, VolumeError> {
        finished(self.enrich_in_slices(factor, method, None, &Pauses::default()))
    }

    /// As [`Self::enrich_slices`], with pauses, and in less memory if `most` bytes are given.
    ///
    /// # Errors
    /// Those of [`Self::enrich_slices`].
    pub async fn enrich_in_slices(
        &self,
        factor: Option<usize>,
        method: Enrichment,
        most: Option<u64>,
        pauses: &Pauses,
    ) -> Result<Volume, VolumeError> {
        let axis = self.thick_axis();
        let factor = factor.unwrap_or_else(|| self.chosen_factor(axis));
        if !(1..=MAX_FACTOR).contains(&factor) {
            let problem = format!("must be 1 to {MAX_FACTOR}, got {factor}");
            return Err(VolumeError::invalid("factor", problem));
        }
        if factor == 1 {
            return Ok(self.clone());
        }
        let count = self.dims[axis];
        if count < 2 {
            let problem = "must be 1 for a single slice along the axis of the largest spacing";
            return Err(VolumeError::invalid("factor", problem));
        }
        let mut dims = self.dims;
        dims[axis] = (count - 1) * factor + 1;
        let mut voxels = self.voxels.zeros_like(self.checked_size(dims, axis, method, most)?)?;
        for frame in 0..self.frames() {
            self.enrich_frame(frame, axis, factor, method, &mut voxels, pauses).await?;
        }
        let mut ratio = DVec3::ONE;
        ratio[axis] = 1.0 / factor as f64;
        let volume = Volume::new(VolumeInit {
            voxels,
            dims,
            affine: self.affine * DAffine3::from_scale(ratio),
            slope: self.slope,
            intercept: self.intercept,
            frame_seconds: self.frame_seconds,
            space: self.space,
        })?;
        Ok(volume.derived(self, Derivation::Interpolated))
    }

    /// Returns the number of voxels of the result, which has the given dimensions; an error if it would take too much
    /// memory to make.
    fn checked_size(
        &self,
        dims: [usize; 4],
        axis: usize,
        method: Enrichment,
        most: Option<u64>,
    ) -> Result<usize, VolumeError> {
        let product = |of: &[usize]| of.iter().fold(1u64, |product, &n| product.saturating_mul(n as u64));
        let count = product(&dims);
        let pixels = product(&dims[..3]) / dims[axis] as u64;
        let bytes = count
            .saturating_mul(self.voxels.number_size() as u64)
            .saturating_add(pixels.saturating_mul(method.bytes_per_pixel()));
        let most = most.map_or(MOST_BYTES, |most| most.min(MOST_BYTES));
        if bytes > most { Err(VolumeError::TooLarge { bytes }) } else { Ok(count as usize) }
    }

    /// Returns the axis of the largest spacing, across which slices are interpolated; of equal ones z if it is among
    /// them, else the lowest.
    fn thick_axis(&self) -> usize {
        let spacing = self.spacing();
        (0..3).fold(2, |axis, other| if spacing[other] > spacing[axis] { other } else { axis })
    }

    fn chosen_factor(&self, axis: usize) -> usize {
        let spacing = self.spacing();
        let pixel = (spacing[(axis + 1) % 3] + spacing[(axis + 2) % 3]) / 2.0;
        let factor = (spacing[axis] / (MOST_APART * pixel)).ceil();
        if self.dims[axis] < 2 { 1 } else { factor.clamp(1.0, MAX_CHOSEN_FACTOR) as usize }
    }

    /// Stores one frame in `voxels`, those of the result, with `factor` − 1 slices interpolated between each pair of
    /// neighbouring slices along `axis`.
    async fn enrich_frame(
        &self,
        frame: usize,
        axis: usize,
        factor: usize,
        method: Enrichment,
        voxels: &mut Voxels,
        pauses: &Pauses,
    ) -> Result<(), VolumeError> {
        let dims = self.dims();
        let start = self.frame_start(frame)?;
        let mut longer = dims;
        longer[axis] = (dims[axis] - 1) * factor + 1;
        let first = frame * longer.iter().product::<usize>();
        let mut put = |slice, made: &Voxels| {
            voxels.overwrite(slice_at(longer, axis, slice).rows(longer, first), made);
        };
        let mut before = self.normalised_slice(frame, axis, 0)?;
        for slice in 0..dims[axis] {
            pauses.now().await;
            let given = slice_at(dims, axis, slice);
            put(slice * factor, &self.voxels.gathered(given.len(), given.rows(dims, start))?);
            if slice + 1 == dims[axis] {
                break;
            }
            let after = self.normalised_slice(frame, axis, slice + 1)?;
            pauses.now().await;
            let flow = match method {
                Enrichment::Flow => {
                    let flow = symmetric_flow(&before, &after, pauses).await?;
                    Some(weighted_by_confidence(&before, &after, flow, pauses).await?)
                }
                Enrichment::Linear => None,
            };
            for step in 1..factor {
                pauses.now().await;
                let image = in_between(&before, &after, flow.as_ref(), step as f32 / factor as f32)?;
                pauses.now().await;
                let mut made = reserve(given.len())?;
                made.extend(image.values.iter().map(|&value| self.stored(f64::from(value))));
                put(slice * factor + step, &self.voxels.like(&made)?);
            }
            before = after;
        }
        Ok(())
    }

    /// Returns a slice as an image. The flow is computed on normalised intensities, which are finite even for NaN voxels.
    fn normalised_slice(&self, frame: usize, axis: usize, slice: usize) -> Result<Image, VolumeError> {
        let region = slice_at(self.dims(), axis, slice);
        let [width, height] = [[1, 2], [0, 2], [0, 1]][axis].map(|side| region.dims[side]);
        Ok(Image { width, height, values: self.normalised_region(region, frame)?.values })
    }

    /// Converts an intensity on the scale of [`Self::normalised_grid`] (0 to 1) to a stored value.
    fn stored(&self, normalised: f64) -> f64 {
        (self.range[0] + normalised * self.span() - self.intercept) / self.slope
    }
}

/// Returns a slice across an axis of a volume of `dims` voxels.
fn slice_at(mut dims: [usize; 3], axis: usize, slice: usize) -> Region {
    let mut min = [0; 3];
    (min[axis], dims[axis]) = (slice, 1);
    Region { min, dims }
}

/// Multiplies the flow between two images at each pixel by its confidence: the share of the squared difference of the
/// images, summed over a window, that warping removes (1 if the warped images agree, 0 if warping does not reduce the
/// difference). Where the flow does not fit, slices are then interpolated without it.
async fn weighted_by_confidence(
    before: &Image,
    after: &Image,
    mut flow: Flow,
    pauses: &Pauses,
) -> Result<Flow, VolumeError> {
    pauses.now().await;
    let (left, right) = (before.warped(&flow, -0.5)?, after.warped(&flow, 0.5)?);
    pauses.now().await;
    let moved = squared_differences(&left, &right)?;
    pauses.now().await;
    let still = squared_differences(before, after)?;
    pauses.now().await;
    for i in 0..moved.values.len() {
        let left = if still.values[i] > 0.0 { moved.values[i] / still.values[i] } else { 1.0 };
        let share = if left < 1.0 { 1.0 - left } else { 0.0 };
        flow.x.values[i] *= share;
        flow.y.values[i] *= share;
    }
    Ok(flow)
}

/// Returns, for each pixel, the squared differences of two images, summed over the least-squares window of the optical
/// flow around it.
fn squared_differences(one: &Image, other: &Image) -> Result<Image, VolumeError> {
    let mut values = reserve(one.values.len())?;
    values.extend(one.values.iter().zip(&other.values).map(|(a, b)| (a - b) * (a - b)));
    Image { values, ..*one }.window_sums()
}

/// Returns the image interpolated at fraction `share` of the way from slice `before` to slice `after`, along the
/// optical flow if there is one, else pixel by pixel.
fn in_between(before: &Image, after: &Image, flow: Option<&Flow>, share: f32) -> Result<Image, VolumeError> {
    let mix = |left: &Image, right: &Image| {
        let mut values = reserve(left.values.len())?;
        values.extend(left.values.iter().zip(&right.values).map(|(a, b)| a + (b - a) * share));
        Ok(Image { values, ..*left })
    };
    match flow {
        Some(flow) => mix(&before.warped(flow, -share)?, &after.warped(flow, 1.0 - share)?),
        None => mix(before, after),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Space;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn volume(dims: [usize; 4], spacing: [f64; 3], voxels: Voxels) -> Volume {
        Volume::new(VolumeInit {
            voxels,
            dims,
            affine: DAffine3::from_scale_rotation_translation(
                DVec3::from(spacing),
                glam::DQuat::from_rotation_x(0.3),
                DVec3::new(5.0, -2.0, 1.0),
            ),
            slope: 0.5,
            intercept: 10.0,
            frame_seconds: 0.04,
            space: Space::Lps,
        })
        .unwrap()
    }

    /// Returns the intensity of a slanted cone, from 0 to 200; x, y in pixels, z in slices.
    fn cone(x: f64, y: f64, z: f64) -> u8 {
        let radius = 12.0 - 0.7 * z;
        let away = libm::hypot(x - 20.0 - 2.0 * z, y - 24.0 + 1.2 * z) - radius;
        (200.0 / (1.0 + libm::exp(away))).round() as u8
    }

    /// Returns a volume of the slanted [`cone`], with `steps` slices per unit of z.
    fn cone_volume(steps: usize) -> Volume {
        let (nx, ny, nz) = (56, 48, 6 * steps + 1);
        let at = |i: usize| {
            let z = (i / (nx * ny)) as f64 / steps as f64;
            cone((i % nx) as f64, (i / nx % ny) as f64, z)
        };
        let voxels = Voxels::U8((0..nx * ny * nz).map(at).collect());
        volume([nx, ny, nz, 1], [1.5, 1.5, 6.0 / steps as f64], voxels)
    }

    fn error(one: &Volume, truth: &Volume) -> f64 {
        let (a, b) = (one.intensities(0).unwrap(), truth.intensities(0).unwrap());
        let squares: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(a - b) * f64::from(a - b)).sum();
        (squares / a.len() as f64).sqrt()
    }

    #[test]
    fn slices_that_were_there_stay_and_those_between_are_nearer_the_truth_than_means() {
        let (given, truth) = (cone_volume(1), cone_volume(3));
        let [flow, linear] = [Enrichment::Flow, Enrichment::Linear]
            .map(|method| given.enrich_slices(Some(3), method).unwrap());
        assert_eq!(flow.dims(), truth.dims());
        for slice in 0..7 {
            assert_eq!(flow.slice(2, 3 * slice, 0).unwrap(), given.slice(2, slice, 0).unwrap());
        }
        let last = DVec3::new(55.0, 47.0, 6.0);
        let end = flow.affine().transform_point3(last * DVec3::new(1.0, 1.0, 3.0));
        assert!(end.distance(given.affine().transform_point3(last)) < 1e-12);
        assert!(matches!(flow.voxels(), Voxels::U8(_)));
        assert_eq!((flow.frame_seconds(), flow.space(), flow.slope()), (0.04, Space::Lps, 0.5));
        let (by_flow, by_means) = (error(&flow, &truth), error(&linear, &truth));
        assert!(by_flow < 0.4 * by_means, "{by_flow} {by_means}");
    }

    #[test]
    fn the_factor_left_out_brings_slices_to_twice_a_pixel_apart_and_is_at_most_three() {
        assert_eq!(cone_volume(1).enrich_slices(None, Enrichment::Flow).unwrap().dims()[2], 13);
        for (spacing, slices) in
            [(1.2, 4), (2.0 + 1e-7, 4), (2.2, 7), (4.0, 7), (4.3, 10), (8.0, 10), (30.0, 10)]
        {
            let given = volume([4, 4, 4, 1], [1.0, 1.0, spacing], Voxels::I16((0..64).collect()));
            assert_eq!(given.enrich_slices(None, Enrichment::Flow).unwrap().dims()[2], slices, "{spacing}");
        }
    }

    #[test]
    fn any_axis_any_frame_and_any_type_is_enriched() {
        let values: Vec<f64> = (0..3 * 4 * 5 * 2).map(|i| f64::from(i % 7) - 3.0).collect();
        for voxels in [
            Voxels::I8(values.iter().map(|&v| v as i8).collect()),
            Voxels::F32(values.iter().map(|&v| v as f32).collect()),
            Voxels::F64(values.clone()),
        ] {
            let given = volume([3, 4, 5, 2], [9.0, 2.0, 3.0], voxels);
            for method in [Enrichment::Flow, Enrichment::Linear] {
                let made = given.enrich_slices(Some(2), method).unwrap();
                assert_eq!((made.dims(), made.frames()), ([5, 4, 5], 2));
                for frame in 0..2 {
                    for x in 0..3 {
                        assert_eq!(made.slice(0, 2 * x, frame).unwrap(), given.slice(0, x, frame).unwrap());
                    }
                }
            }
        }
        let ramp = volume([1, 1, 3, 1], [1.0, 1.0, 4.0], Voxels::F32(vec![0.0, 8.0, 4.0]));
        let made = ramp.enrich_slices(Some(4), Enrichment::Linear).unwrap();
        assert_eq!(made.voxels(), &Voxels::F32(vec![0.0, 2.0, 4.0, 6.0, 8.0, 7.0, 6.0, 5.0, 4.0]));
    }

    #[test]
    fn what_is_not_a_number_is_none_between_either() {
        let values = vec![1.0, f32::NAN, 3.0, 5.0, f32::INFINITY, 2.0];
        let made = volume([1, 3, 2, 1], [1.0, 1.0, 2.0], Voxels::F32(values))
            .enrich_slices(Some(2), Enrichment::Flow)
            .unwrap();
        let Voxels::F32(values) = made.voxels() else { panic!() };
        assert!(values[1].is_nan() && values[7].is_infinite());
        assert!(values[3..6].iter().all(|v| (1.0..=5.0).contains(v)), "{values:?}");
    }

    #[test]
    fn results_without_memory_to_work_with_them_are_refused_at_once() {
        let volume = volume([300, 300, 1200, 1], [1.0, 1.0, 16.0], Voxels::U8(vec![1; 300 * 300 * 1200]));
        let bytes = 300 * 300 * (1199 * 16 + 1 + 40);
        let error = volume.enrich_slices(Some(16), Enrichment::Linear).map(drop).unwrap_err();
        assert_eq!(error, VolumeError::TooLarge { bytes });
    }

    #[test]
    fn the_images_between_slices_count_too() {
        let volume = volume([4000, 4000, 2, 1], [1.0, 1.0, 2.0], Voxels::U8(vec![1; 32_000_000]));
        let error = volume.enrich_slices(Some(2), Enrichment::Flow).unwrap_err();
        assert_eq!(error, VolumeError::TooLarge { bytes: 16_000_000 * (3 + 80) });
        let few = 16_000_000 * (3 + 40) - 1;
        let pauses = Pauses::default();
        let made = volume.enrich_in_slices(Some(2), Enrichment::Linear, Some(few), &pauses);
        assert!(matches!(finished(made), Err(VolumeError::TooLarge { .. })));
    }

    #[test]
    fn a_wrong_factor_and_a_single_slice_are_refused() {
        let one = volume([4, 4, 1, 1], [1.0, 1.0, 5.0], Voxels::U8(vec![0; 16]));
        for (volume, factor) in [(cone_volume(1), 0), (cone_volume(1), 17), (one.clone(), 2)] {
            let refusal = volume.enrich_slices(Some(factor), Enrichment::Flow).unwrap_err();
            assert!(matches!(refusal, VolumeError::InvalidArgument { parameter: "factor", .. }));
        }
        assert_eq!(one.enrich_slices(None, Enrichment::Flow).unwrap().dims(), [4, 4, 1]);
    }
}
