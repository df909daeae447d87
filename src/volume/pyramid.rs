//! Multiresolution pyramids of a volume, with any reduction factor in (1, 2].
//!
//! Section 4.2 and appendix A of Lachaud & Montanvert, with errors of the appendix corrected: the level index
//! increases, sizes are derived level by level, and all three axes are reduced. Level h + 1 has ⌊M/ρ⌋ voxels where
//! level h has M; the world box is kept. Each voxel of level h + 1 is the [1 4 6 4 1]/16 mean of five samples of level
//! h, U apart along each axis. U is the smallest voxel side at level 0 and grows by ρ per level. Samples between voxels
//! are interpolated linearly; the border is replicated.

use super::derived::Derivation;
use super::error::{VolumeError, filled, reserve};
use super::sampling::locate_f64;
use super::voxels::Voxels;
use super::{Grid, Region, Volume, VolumeInit};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::pauses::{Pauses, finished};
use std::ops::Range;

/// The five weights of the Gaussian-like kernel by which each pyramid level is reduced to the next.
const KERNEL: [f64; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];

/// The ratio of the largest absolute intensity to the span of all above which levels store differences. Those
/// of `f32` between neighbouring numbers are then 1/65536 of the span at most.
const COARSEST_SPAN: f64 = 256.0;

/// The number of voxels that are resampled along an axis in a unit of work.
const VOXELS_PER_UNIT: usize = 512;

/// The number of rows that are resampled between pauses.
const ROWS_AT_ONCE: usize = 64;

impl Volume {
    /// Returns a pyramid of `levels` volumes: the first is this one, each of the others has ⌊n/ρ⌋ voxels along every
    /// axis, where the one before has n and ρ is `factor`.
    ///
    /// All frames are kept; levels after the first store `f32` intensities, or differences from the least one where
    /// these are more exact.
    ///
    /// # Errors
    /// `factor` not in (1, 2]; `levels` is 0, or so large that an axis would have fewer than 2 voxels (the message
    /// gives the largest possible number); [`VolumeError::TooLarge`].
    pub fn pyramid(&self, levels: usize, factor: f64) -> Result<Vec<Volume>, VolumeError> {
        check_factor(factor)?;
        self.check_levels(levels, factor)?;
        let mut spacing = self.spacing();
        let mut unit = smallest(spacing);
        let shift = self.pyramid_shift();
        let mut out = vec![self.clone()];
        while out.len() < levels {
            let finer = &out[out.len() - 1];
            let level = if out.len() == 1 {
                self.level_after(
                    finer,
                    |voxels| self.intensities_above(shift, voxels),
                    spacing,
                    [unit, factor],
                )
            } else {
                self.level_after(finer, |voxels| finer.voxels.as_f32(voxels), spacing, [unit, factor])
            }?;
            spacing = spacing_of(spacing, finer.dims(), level.dims());
            unit *= factor;
            out.push(level);
        }
        Ok(out)
    }

    /// Returns the next coarser level than `finer`, with the same world box as this volume; `values` returns the intensities
    /// of `finer` less the shift of the pyramid. A slice at a time is converted: in single precision, all may take four
    /// times as much memory as the volume.
    fn level_after(
        &self,
        finer: &Volume,
        values: impl Fn(Range<usize>) -> Result<Vec<f32>, VolumeError>,
        spacing: [f64; 3],
        steps: [f64; 2],
    ) -> Result<Volume, VolumeError> {
        let taps = reduction(finer.dims(), [true; 3], spacing, steps)?;
        let dims = [0, 1, 2].map(|axis| taps[axis].spans.len());
        let (size, [nx, ny, nz]) = (dims.iter().product(), finer.dims());
        let mut voxels = filled(self.frames() * size, 0.0)?;
        for (frame, out) in voxels.chunks_exact_mut(size).enumerate() {
            let slice = |z| values((frame * nz + z) * nx * ny..(frame * nz + z + 1) * nx * ny);
            finished(resample(finer.dims(), &taps, slice, out, &Pauses::default()))?;
        }
        let ratio = DVec3::from([0, 1, 2].map(|axis| self.dims[axis] as f64 / dims[axis] as f64));
        let index_map =
            DAffine3 { matrix3: DMat3::from_diagonal(ratio), translation: (ratio - DVec3::ONE) * 0.5 };
        let volume = Volume::new(VolumeInit {
            affine: self.affine * index_map,
            frame_seconds: self.frame_seconds,
            space: self.space,
            intercept: self.pyramid_shift(),
            ..VolumeInit::new(Voxels::F32(voxels), [dims[0], dims[1], dims[2], self.frames()])
        })?;
        Ok(volume.derived(self, Derivation::Averaged))
    }

    /// Returns the largest number of levels, this volume included, of a pyramid with the reduction factor `factor` in
    /// which every axis has at least 2 voxels; 1 if this volume has an axis with fewer.
    ///
    /// # Errors
    /// `factor` not in (1, 2].
    pub fn max_pyramid_levels(&self, factor: f64) -> Result<usize, VolumeError> {
        check_factor(factor)?;
        let mut dims = self.dims();
        let mut levels = 0;
        while dims.iter().all(|&n| n >= 2) {
            dims = reduced_dims(dims, factor);
            levels += 1;
        }
        Ok(if levels > 0 { levels } else { 1 })
    }

    fn check_levels(&self, levels: usize, factor: f64) -> Result<(), VolumeError> {
        let possible = self.max_pyramid_levels(factor)?;
        if levels >= 1 && levels <= possible {
            return Ok(());
        }
        let problem = format!(
            "must be 1 to {possible} for dims {:?} and factor {factor} (at least 2 voxels per axis), got {levels}",
            self.dims()
        );
        Err(VolumeError::invalid("levels", problem))
    }

    /// Returns what the intensities stored by levels are less than those of this volume, so that `f32` shows them as
    /// finely as integers of 16 bits: its least intensity if they differ little, else 0.
    fn pyramid_shift(&self) -> f64 {
        let [low, high] = self.range;
        if self.span() < low.abs().max(high.abs()) / COARSEST_SPAN { low } else { 0.0 }
    }
}

impl Grid {
    /// Returns the next coarser level of the pyramid and its spacing: ⌊n/factor⌋ voxels per axis (at least 1) in the
    /// same box.
    ///
    /// `spacing` is the spacing of this grid, and `unit` (U) the distance between neighbouring ones of the five samples
    /// of the kernel, in the same length unit. The next level's unit is `unit * factor`.
    ///
    /// # Errors
    /// `factor` not in (1, 2], `spacing` or `unit` not positive and finite; [`VolumeError::TooLarge`].
    pub fn reduce(&self, spacing: [f64; 3], unit: f64, factor: f64) -> Result<(Grid, [f64; 3]), VolumeError> {
        let (slice, pauses) = (|z| Ok(self.slice(z)), Pauses::default());
        finished(reduce_along(self.dims, slice, [true; 3], spacing, [unit, factor], &pauses))
    }

    /// Updates `coarse`, which [`Self::reduce`] returned for this grid and the same `spacing`, `unit` and `factor`,
    /// after the values in the region `changed` have changed; returns the region of `coarse` that was updated, or
    /// `None` if no voxel of it depends on them.
    ///
    /// # Errors
    /// As [`Self::reduce`].
    pub fn update_reduced(
        &self,
        coarse: &mut Grid,
        changed: Region,
        spacing: [f64; 3],
        steps: [f64; 2],
    ) -> Result<Option<Region>, VolumeError> {
        self.update_reduced_along([true; 3], coarse, changed, spacing, steps)
    }

    /// Updates a level that [`reduce_along`] returned, as [`Self::update_reduced`]; `steps` are `unit` and `factor`.
    ///
    /// # Errors
    /// As [`Self::reduce`].
    pub(crate) fn update_reduced_along(
        &self,
        axes: [bool; 3],
        coarse: &mut Grid,
        changed: Region,
        spacing: [f64; 3],
        steps: [f64; 2],
    ) -> Result<Option<Region>, VolumeError> {
        let taps = reduction(self.dims, axes, spacing, steps)?;
        let parts = [0, 1, 2].map(|axis| {
            let first = changed.min[axis];
            taps[axis].part(first..first + changed.dims[axis])
        });
        let [Some(x), Some(y), Some(z)] = parts else { return Ok(None) };
        let (to, from) = ([&x.to, &y.to, &z.to], [&x.from, &y.from, &z.from]);
        let region = |ranges: [&Range<usize>; 3]| Region {
            min: ranges.map(|range| range.start),
            dims: ranges.map(|range| range.len()),
        };
        let (to, from) = (region(to), region(from));
        let (part, taps) = (self.part(from)?, [x.weights, y.weights, z.weights]);
        let part = finished(resampled(from.dims, &taps, |z| Ok(part.slice(z)), &Pauses::default()))?;
        coarse.overwrite(to, &part);
        Ok(Some(to))
    }

    /// Returns the values of the slice with the index `z`, row by row.
    pub(super) fn slice(&self, z: usize) -> &[f32] {
        let size = self.dims[0] * self.dims[1];
        &self.values[z * size..(z + 1) * size]
    }
}

/// Returns the next coarser level and its spacing as [`Grid::reduce`] does, but with fewer voxels only along the axes that
/// `axes` marks; it is smoothed along the others, too. `slice` returns the slices across z of the grid, of `dims` voxels; the
/// last but one argument is `unit` and `factor`. Pauses meanwhile.
pub(super) async fn reduce_along<S: AsRef<[f32]>>(
    dims: [usize; 3],
    slice: impl Fn(usize) -> Result<S, VolumeError>,
    axes: [bool; 3],
    spacing: [f64; 3],
    steps: [f64; 2],
    pauses: &Pauses,
) -> Result<(Grid, [f64; 3]), VolumeError> {
    let coarse = resampled(dims, &reduction(dims, axes, spacing, steps)?, slice, pauses).await?;
    let spacing = spacing_of(spacing, dims, coarse.dims);
    Ok((coarse, spacing))
}

/// Returns the grid that [`resample`] makes of the slices of one of `dims`.
async fn resampled<S: AsRef<[f32]>>(
    dims: [usize; 3],
    taps: &[ResamplingWeights; 3],
    slice: impl Fn(usize) -> Result<S, VolumeError>,
    pauses: &Pauses,
) -> Result<Grid, VolumeError> {
    let coarse = [0, 1, 2].map(|axis| taps[axis].spans.len());
    let mut values = filled(coarse.iter().product(), 0.0)?;
    resample(dims, taps, slice, &mut values, pauses).await?;
    Ok(Grid { dims: coarse, values })
}

/// Resamples a grid of `dims`, whose slices across z `slice` returns, with the weights `taps`, and adds the result to `out`.
/// A slice at a time is resampled along x and y, and added to those of the result that depend on it: all of them at once
/// would take more memory than the grid. Pauses meanwhile.
async fn resample<S: AsRef<[f32]>>(
    dims: [usize; 3],
    [x, y, z]: &[ResamplingWeights; 3],
    slice: impl Fn(usize) -> Result<S, VolumeError>,
    out: &mut [f32],
    pauses: &Pauses,
) -> Result<(), VolumeError> {
    let size = x.spans.len() * y.spans.len();
    let (mut along_x, mut along_xy) = (reserve(x.spans.len() * dims[1])?, reserve(size)?);
    for k in 0..dims[2] {
        along_x.clear();
        for rows in slice(k)?.as_ref().chunks(ROWS_AT_ONCE * dims[0]) {
            resample_rows(rows, dims[0], x, &mut along_x);
            pauses.after(1 + rows.len() / VOXELS_PER_UNIT).await;
        }
        along_xy.clear();
        for i in 0..y.spans.len() {
            blend_rows(&along_x, x.spans.len(), y.of(i), &mut along_xy);
            pauses.after(x.spans.len() / VOXELS_PER_UNIT).await;
        }
        for (i, weight) in z.depending_on(k) {
            add_scaled(&mut out[i * size..], &along_xy, weight);
            pauses.after(size / VOXELS_PER_UNIT).await;
        }
    }
    Ok(())
}

/// Resamples each of the rows of `nx` values with the weights `taps`, and appends the result to `out`.
fn resample_rows(values: &[f32], nx: usize, taps: &ResamplingWeights, out: &mut Vec<f32>) {
    for row in values.chunks_exact(nx) {
        out.extend((0..taps.spans.len()).map(|i| {
            let (first, weights) = taps.of(i);
            weights.iter().zip(&row[first..]).fold(0.0, |sum, (w, v)| sum + w * v)
        }));
    }
}

/// Blends rows of `nx` values, from the row `first` on, with `weights`, and appends the resulting row to `out`.
fn blend_rows(values: &[f32], nx: usize, (first, weights): (usize, &[f32]), out: &mut Vec<f32>) {
    let start = out.len();
    out.resize(start + nx, 0.0);
    for (row, &weight) in values.chunks_exact(nx).skip(first).zip(weights) {
        add_scaled(&mut out[start..], row, weight);
    }
}

/// Returns the weights along each axis that reduce a grid of `dims` as [`reduce_along`] does; the last argument is
/// `unit` and `factor`.
fn reduction(
    dims: [usize; 3],
    axes: [bool; 3],
    spacing: [f64; 3],
    [unit, factor]: [f64; 2],
) -> Result<[ResamplingWeights; 3], VolumeError> {
    check_factor(factor)?;
    let positive = |v: f64| v > 0.0 && v.is_finite();
    if !spacing.iter().all(|&s| positive(s)) || !positive(unit) {
        return Err(VolumeError::invalid("spacing", "spacing and unit must be positive and finite"));
    }
    let reduced = reduced_dims(dims, factor);
    Ok([0, 1, 2].map(|axis| {
        let (from, unit) = (dims[axis], unit / spacing[axis]);
        ResamplingWeights::new(from, if axes[axis] { reduced[axis] } else { from }, unit)
    }))
}

/// Returns the spacing of a grid of `to` voxels in the box of one of `from` voxels with the given spacing.
fn spacing_of(spacing: [f64; 3], from: [usize; 3], to: [usize; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| spacing[axis] * from[axis] as f64 / to[axis] as f64)
}

#[inline]
fn add_scaled(to: &mut [f32], from: &[f32], weight: f32) {
    for (t, f) in to.iter_mut().zip(from) {
        *t += weight * f;
    }
}

/// Weights that reduce a grid along one axis to the next pyramid level: for each output voxel, the range of source
/// voxels and their weights, which sum to 1.
struct ResamplingWeights {
    /// Per output voxel: the index of the first source voxel, and start and end of its weights in `weights`.
    spans: Vec<(usize, usize, usize)>,
    weights: Vec<f32>,
}

impl ResamplingWeights {
    /// Computes the weights that reduce `source` voxels to `count`; `unit` is the distance between neighbouring samples
    /// of the kernel, in source voxels.
    fn new(source: usize, count: usize, unit: f64) -> Self {
        let mut taps = Self { spans: Vec::with_capacity(count), weights: Vec::new() };
        let mut dense = vec![0.0f64; source];
        for i in 0..count {
            let centre = (i as f64 + 0.5) * source as f64 / count as f64 - 0.5;
            taps.push(&mut dense, centre, unit);
        }
        taps
    }

    /// Adds the weights of the next output voxel: those of the kernel centred at source coordinate `centre`, with its
    /// samples `unit` apart. `dense` is a buffer of zeros, one per source voxel, and is zeroed again.
    fn push(&mut self, dense: &mut [f64], centre: f64, unit: f64) {
        let (mut low, mut high) = (usize::MAX, 0);
        for (k, weight) in KERNEL.iter().enumerate() {
            let ([a, b], fraction) = locate_f64(centre + (k as f64 - 2.0) * unit, dense.len());
            dense[a] += weight * (1.0 - fraction);
            dense[b] += weight * fraction;
            low = if a < low { a } else { low };
            high = if b > high { b } else { high };
        }
        let start = self.weights.len();
        self.weights.extend(dense[low..=high].iter().map(|&w| w as f32));
        dense[low..=high].fill(0.0);
        self.spans.push((low, start, self.weights.len()));
    }

    fn of(&self, i: usize) -> (usize, &[f32]) {
        let (first, start, end) = self.spans[i];
        (first, &self.weights[start..end])
    }

    /// Returns the output voxels that depend on source voxel `k`, each with the weight of that.
    fn depending_on(&self, k: usize) -> impl Iterator<Item = (usize, f32)> {
        // Both ends of the spans increase with the output voxel.
        let first = self.spans.partition_point(|&(first, start, end)| first + (end - start) <= k);
        let spans = self.spans[first..].iter().take_while(move |&&(first, ..)| first <= k);
        spans.enumerate().map(move |(i, &(from, start, _))| (first + i, self.weights[start + k - from]))
    }

    /// Returns the weights of the output voxels that depend on a source voxel in `changed`, which is not empty; `None`
    /// if there are none.
    fn part(&self, changed: Range<usize>) -> Option<PartialWeights> {
        let sources = |&(first, start, end): &(usize, usize, usize)| first..first + (end - start);
        let depends = |span| {
            let span = sources(span);
            span.start < changed.end && changed.start < span.end
        };
        // Both ends of the spans increase with the output voxel.
        let to = self.spans.iter().position(depends)?..self.spans.iter().rposition(depends)? + 1;
        let of_part = &self.spans[to.clone()];
        let from = of_part.first().map(sources)?.start..of_part.last().map(sources)?.end;
        let spans = of_part.iter().map(|&(first, start, end)| (first - from.start, start, end)).collect();
        let weights = Self { spans, weights: self.weights.clone() };
        Some(PartialWeights { to, from, weights })
    }
}

/// The weights of consecutive output voxels along one axis, for updating part of a pyramid level.
struct PartialWeights {
    /// The output voxels.
    to: Range<usize>,
    /// The source voxels that they depend on.
    from: Range<usize>,
    /// The weights, with source voxels counted from the first of `from`.
    weights: ResamplingWeights,
}

fn check_factor(factor: f64) -> Result<(), VolumeError> {
    if factor > 1.0 && factor <= 2.0 {
        return Ok(());
    }
    Err(VolumeError::invalid("factor", format!("must be > 1 and <= 2, got {factor}")))
}

/// Returns the number of voxels of the next pyramid level along each axis: ⌊n/factor⌋, at least 1.
fn reduced_dims(dims: [usize; 3], factor: f64) -> [usize; 3] {
    dims.map(|n| {
        let reduced = (n as f64 / factor) as usize;
        if reduced > 0 { reduced } else { 1 }
    })
}

fn smallest([x, y, z]: [f64; 3]) -> f64 {
    let xy = if x < y { x } else { y };
    if xy < z { xy } else { z }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn volume(dims: [usize; 3], affine: DAffine3, f: impl Fn(DVec3) -> f64) -> Volume {
        let mut values = Vec::new();
        for i in 0..dims.iter().product::<usize>() {
            let index =
                DVec3::from([i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])].map(|v| v as f64));
            values.push(f(affine.transform_point3(index)) as f32);
        }
        Volume::new(VolumeInit {
            affine,
            space: crate::volume::Space::Ras,
            ..VolumeInit::new(Voxels::F32(values), [dims[0], dims[1], dims[2], 1])
        })
        .unwrap()
    }

    fn oblique() -> DAffine3 {
        let axes = DMat3::from_cols(
            DVec3::new(0.8, 0.6, 0.0),
            DVec3::new(-0.9, 1.2, 0.0),
            DVec3::new(0.0, 0.0, 2.5),
        );
        DAffine3::from_mat3_translation(axes, DVec3::new(-20.0, 5.0, 7.0))
    }

    #[test]
    fn sizes_carry_on_and_the_box_stays() {
        let v = volume([40, 31, 17], oblique(), |p| p.x);
        for factor in [1.3, 3f64.sqrt(), 2.0] {
            let levels = v.pyramid(3, factor).unwrap();
            assert_eq!(levels.len(), 3);
            let mut dims = v.dims();
            for level in &levels[1..] {
                dims = dims.map(|n| (n as f64 / factor).floor() as usize);
                assert_eq!(level.dims(), dims);
                let ends = |v: &Volume| {
                    let far = DVec3::from(v.dims().map(|n| n as f64 - 0.5));
                    [DVec3::splat(-0.5), far].map(|p| v.affine().transform_point3(p))
                };
                for (a, b) in ends(&v).iter().zip(ends(level)) {
                    assert!(a.distance(b) < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_constant_stays_and_a_ramp_stays_away_from_the_border() {
        let ramp = |p: DVec3| 0.7 * p.x - 0.4 * p.y + 0.2 * p.z;
        let v = volume([40, 36, 30], oblique(), ramp);
        for level in &v.pyramid(3, 3f64.sqrt()).unwrap()[1..] {
            let middle = DVec3::from(level.dims().map(|n| (n / 2) as f64));
            let p = level.affine().transform_point3(middle);
            assert!((level.sample(p, 0).unwrap() - ramp(p)).abs() < 1e-4, "{:?}", level.dims());
        }
        let flat = volume([13, 9, 11], oblique(), |_| 5.0);
        for level in flat.pyramid(3, 1.7).unwrap() {
            assert!(level.range().iter().all(|v| (v - 5.0).abs() < 1e-5));
        }
    }

    #[test]
    fn one_level_is_the_kernel_of_the_paper() {
        // One axis by hand: 6 voxels to 3, unit 1, centres at 0.5, 2.5, 4.5, each tap halfway between two voxels.
        let row = [3.0f32, 8.0, 1.0, 4.0, 9.0, 2.0];
        let grid = Grid { dims: [6, 1, 1], values: row.to_vec() };
        let (coarse, spacing) = grid.reduce([1.0; 3], 1.0, 2.0).unwrap();
        assert_eq!((coarse.dims, spacing), ([3, 1, 1], [2.0, 1.0, 1.0]));
        let at = |i: i32| row[i.clamp(0, 5) as usize];
        let tap = |i: i32| 0.5 * (at(i) + at(i + 1));
        for (i, found) in coarse.values.iter().enumerate() {
            let c = 2 * i as i32;
            // A tap outside the border reads the border value itself, not a mean across it.
            let held = |i: i32| {
                if i < 0 {
                    at(0)
                } else if i > 4 {
                    at(5)
                } else {
                    tap(i)
                }
            };
            let expected =
                (held(c - 2) + 4.0 * held(c - 1) + 6.0 * held(c) + 4.0 * held(c + 1) + held(c + 2)) / 16.0;
            assert!((found - expected).abs() < 1e-6, "voxel {i}: {found}, not {expected}");
        }
    }

    #[test]
    fn an_updated_level_is_the_level_computed_anew() {
        let mut random = Random::new(3);
        let mut grid = volume([40, 31, 17], oblique(), |p| libm::sin(p.x + 0.3 * p.y) + p.z).grid(0).unwrap();
        for factor in [1.3, 3f64.sqrt(), 2.0] {
            let spacing = [1.0, 1.5, 2.5];
            let mut coarse = grid.reduce(spacing, 1.0, factor).unwrap().0;
            for _ in 0..40 {
                let min = grid.dims.map(|n| random.below(n as u32) as usize);
                let dims = [0, 1, 2]
                    .map(|axis| 1 + random.below((grid.dims[axis] - min[axis]).min(6) as u32) as usize);
                let changed = Region { min, dims };
                let part = (0..changed.len()).map(|_| random.unit() as f32).collect();
                grid.overwrite(changed, &Grid { dims, values: part });
                let before = coarse.clone();
                let updated =
                    grid.update_reduced(&mut coarse, changed, spacing, [1.0, factor]).unwrap().unwrap();
                assert_eq!(coarse, grid.reduce(spacing, 1.0, factor).unwrap().0);
                assert_eq!(updated.enlarged(0, coarse.dims), updated);
                assert_ne!(coarse, before);
            }
        }
    }

    #[test]
    fn every_frame_is_reduced() {
        let a = volume([8, 8, 8], DAffine3::IDENTITY, |_| 1.0);
        let b = volume([8, 8, 8], DAffine3::IDENTITY, |_| 2.0);
        let both = Volume::from_frames(&[a, b], Some(0.5)).unwrap();
        let coarse = &both.pyramid(2, 2.0).unwrap()[1];
        assert_eq!((coarse.frames(), coarse.frame_seconds()), (2, 0.5));
        assert_eq!(coarse.intensities(1).unwrap(), vec![2.0; 64]);
    }

    #[test]
    fn what_cannot_be_built_is_refused_with_what_can() {
        let v = volume([20, 16, 9], DAffine3::IDENTITY, |p| p.x);
        for factor in [1.0, 2.1, 0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(v.pyramid(2, factor).is_err(), "{factor}");
        }
        assert!(v.pyramid(0, 2.0).is_err());
        assert_eq!(v.pyramid(3, 2.0).unwrap()[2].dims(), [5, 4, 2]);
        let message = v.pyramid(4, 2.0).unwrap_err().to_string();
        assert!(message.contains("must be 1 to 3"), "{message}");
        assert!(v.pyramid(usize::MAX, 1.000_001).is_err());
        let flat = volume([20, 16, 1], DAffine3::IDENTITY, |p| p.x);
        assert_eq!(flat.pyramid(1, 2.0).unwrap().len(), 1);
        assert!(flat.pyramid(2, 2.0).is_err());
    }
}
