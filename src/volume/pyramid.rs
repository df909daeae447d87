//! Coarser and coarser versions of a volume, by any factor.
//!
//! Section 4.2 and appendix A of Lachaud & Montanvert, with the appendix's slips put right: the level counts up, the
//! sizes carry on from level to level, and all three axes shrink. Level h + 1 has ⌊M/ρ⌋ voxels where level h has M;
//! the world box stays. Each of its voxels is the [1 4 6 4 1]/16 mean of five samples of level h, one unit apart
//! along each axis, where the unit U is the smallest voxel side at level 0 and grows by ρ a level. Samples between
//! voxels are interpolated linearly, the border is replicated.

use super::error::{VolumeError, reserve};
use super::sampling::locate_f64;
use super::voxels::Voxels;
use super::{Grid, Volume, VolumeInit};
use crate::math::{DAffine3, DMat3, DVec3};

/// The five weights of the Gaussian-like kernel.
const KERNEL: [f64; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];

impl Volume {
    /// `levels` volumes in all: [0] is this one, each next is coarser by `factor` (ρ) along every axis.
    ///
    /// All frames are kept; levels after the first are `f32` intensities.
    ///
    /// # Errors
    /// `factor` not in (1, 2]; `levels` 0, or so many that an axis would have fewer than 2 voxels (the message
    /// says how many are possible); [`VolumeError::TooLarge`].
    pub fn pyramid(&self, levels: usize, factor: f64) -> Result<Vec<Volume>, VolumeError> {
        check_factor(factor)?;
        self.check_levels(levels, factor)?;
        let spacing = self.spacing();
        let mut unit = smallest(spacing);
        let mut here = (0..self.frames()).map(|t| self.grid(t)).collect::<Result<Vec<_>, _>>()?;
        let mut here_spacing = spacing;
        let mut out = vec![self.clone()];
        while out.len() < levels {
            let mut next = Vec::with_capacity(here.len());
            let mut next_spacing = here_spacing;
            for grid in &here {
                let (coarse, coarse_spacing) = grid.reduce(here_spacing, unit, factor)?;
                next.push(coarse);
                next_spacing = coarse_spacing;
            }
            out.push(self.level(&next)?);
            (here, here_spacing, unit) = (next, next_spacing, unit * factor);
        }
        Ok(out)
    }

    /// How many levels, this volume included, a pyramid of this factor can have before an axis falls below 2 voxels.
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
            "{levels} given; 1 to {possible} are possible with dims {:?} and factor {factor} (every axis keeps 2 voxels)",
            self.dims()
        );
        Err(VolumeError::invalid("levels", problem))
    }

    /// A volume out of the frames of one level, filling the same world box as this one.
    fn level(&self, frames: &[Grid]) -> Result<Volume, VolumeError> {
        let dims = frames[0].dims;
        let ratio = DVec3::from([0, 1, 2].map(|axis| self.dims[axis] as f64 / dims[axis] as f64));
        let index_map =
            DAffine3 { matrix3: DMat3::from_diagonal(ratio), translation: (ratio - DVec3::ONE) * 0.5 };
        let mut values = reserve(frames.len() * frames[0].values.len())?;
        for frame in frames {
            values.extend_from_slice(&frame.values);
        }
        let volume = Volume::new(VolumeInit {
            voxels: Voxels::F32(values),
            dims: [dims[0], dims[1], dims[2], frames.len()],
            affine: self.affine * index_map,
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: self.frame_seconds,
            space: self.space,
        })?;
        Ok(volume.with_unit(self.unit))
    }
}

impl Grid {
    /// The next coarser level and its spacing: ⌊n/factor⌋ voxels an axis (at least 1) in the same box.
    ///
    /// `spacing` is this grid's, `unit` (U) the distance between the five samples of the kernel, both in the same
    /// length. The next level's unit is `unit * factor`.
    ///
    /// # Errors
    /// `factor` not in (1, 2], `spacing` or `unit` not positive and finite; [`VolumeError::TooLarge`].
    pub fn reduce(&self, spacing: [f64; 3], unit: f64, factor: f64) -> Result<(Grid, [f64; 3]), VolumeError> {
        check_factor(factor)?;
        let positive = |v: f64| v > 0.0 && v.is_finite();
        if !spacing.iter().all(|&s| positive(s)) || !positive(unit) {
            return Err(VolumeError::invalid("spacing", "spacing and unit must be positive and finite"));
        }
        let dims = reduced_dims(self.dims, factor);
        let taps = [0, 1, 2].map(|axis| Taps::new(self.dims[axis], dims[axis], unit / spacing[axis]));
        let along_x = self.resample_x(&taps[0], dims[0])?;
        let along_xy = along_x.resample_rows(&taps[1], dims[1], 1)?;
        let coarse = along_xy.resample_rows(&taps[2], dims[2], 2)?;
        let next = [0, 1, 2].map(|axis| spacing[axis] * self.dims[axis] as f64 / dims[axis] as f64);
        Ok((coarse, next))
    }

    fn resample_x(&self, taps: &Taps, nx: usize) -> Result<Grid, VolumeError> {
        let mut values = reserve(nx * self.dims[1] * self.dims[2])?;
        for row in self.values.chunks_exact(self.dims[0]) {
            values.extend((0..nx).map(|i| {
                let (first, weights) = taps.of(i);
                weights.iter().zip(&row[first..]).fold(0.0, |sum, (w, v)| sum + w * v)
            }));
        }
        Ok(Grid { dims: [nx, self.dims[1], self.dims[2]], values })
    }

    /// Resamples along y (`axis` 1) or z (`axis` 2): whole runs of contiguous values are blended at once.
    fn resample_rows(&self, taps: &Taps, count: usize, axis: usize) -> Result<Grid, VolumeError> {
        let run = if axis == 1 { self.dims[0] } else { self.dims[0] * self.dims[1] };
        let mut dims = self.dims;
        dims[axis] = count;
        let mut values = reserve(dims[0] * dims[1] * dims[2])?;
        for block in self.values.chunks_exact(run * self.dims[axis]) {
            for i in 0..count {
                let start = values.len();
                values.resize(start + run, 0.0);
                let (first, weights) = taps.of(i);
                for (k, &weight) in weights.iter().enumerate() {
                    let source = &block[(first + k) * run..(first + k + 1) * run];
                    add_scaled(&mut values[start..], source, weight);
                }
            }
        }
        Ok(Grid { dims, values })
    }
}

#[inline]
fn add_scaled(to: &mut [f32], from: &[f32], weight: f32) {
    for (t, f) in to.iter_mut().zip(from) {
        *t += weight * f;
    }
}

/// For each output voxel of one axis, the source voxels it draws from and their weights, which sum to 1.
struct Taps {
    /// First source voxel and the span of its weights.
    spans: Vec<(usize, usize, usize)>,
    weights: Vec<f32>,
}

impl Taps {
    /// `unit` is the kernel's step in source voxels.
    fn new(source: usize, count: usize, unit: f64) -> Self {
        let mut taps = Self { spans: Vec::with_capacity(count), weights: Vec::new() };
        let mut dense = vec![0.0f64; source];
        for i in 0..count {
            let centre = (i as f64 + 0.5) * source as f64 / count as f64 - 0.5;
            taps.push(&mut dense, centre, unit);
        }
        taps
    }

    /// Spreads the kernel at `centre` over `dense`, stores what it touched, and clears it again.
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
}

fn check_factor(factor: f64) -> Result<(), VolumeError> {
    if factor > 1.0 && factor <= 2.0 {
        return Ok(());
    }
    Err(VolumeError::invalid("factor", format!("{factor} given; more than 1 and at most 2 is accepted")))
}

/// ⌊n/factor⌋, at least 1.
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
