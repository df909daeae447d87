//! The region of a 4D image in which a surface is tracked, with its intensities quantised to one byte.

use super::Bounds;
use super::missing::{self, Beside, Missing};
use super::vote::TIME;
use super::working_space::WorkingSpace;
use crate::math::{DAffine3, DMat3, DVec3};
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::volume::{self, Volume, trilinear};

/// Highest quantised intensity: intensities are quantised to 0 to 254, one byte per voxel.
pub(super) const MAX_LEVEL: f64 = 254.0;

/// Share of the region's voxels, one in a thousand, that may be below the quantised range of intensities, and above it;
/// their intensities are clamped to this range.
const OUTLIERS: f64 = 1e-3;

/// Number of bins of the histogram from which the range of intensities that is quantised is determined.
pub(super) const BINS: usize = 4096;

/// Number of voxels that are added on every side of the processed box, so that windows around its outermost voxels
/// extend beyond it.
const PADDING: usize = 2;

/// Minimum number of voxels that the processed box must have along at least two axes.
const MIN_VOXELS: usize = 5;

/// Minimum number of voxels along every axis: in a single slice, the sides of the box before and behind it are nearer to
/// each other than the radius of plane fits, and planes are fitted to both.
const MIN_SLICES: usize = 2;

/// Minimum thickness of the box along every axis, in units of the shortest side of a voxel, for the same reason: through
/// two isotropic slices a cylinder loses a quarter of its volume, through three it loses 3 %.
const MIN_THICKNESS: f64 = 3.0;

/// Upper bounds of the memory that tracking needs per voxel of the region, in bytes. The first, once: weights of the
/// boundary points around two frames; the second, for each frame: quantised intensity and level between bright and
/// dark.
const BYTES: [u64; 2] = [188, 2];

/// Maximum memory for tracking in a region, in bytes: what a browser gives to one page, less the volume.
const MAX_BYTES: u64 = 3_000_000_000;

/// Largest absolute cosine of the angle between two voxel axes that counts as a right angle: the rounding of axes in
/// file headers stays far below.
const ORTHOGONAL: f64 = 1e-3;

/// A box of voxels of a 4D image, in all frames, with quantised intensities, in which a surface is tracked. Padding
/// around the box lets windows extend beyond it; outside of the image, the border is replicated.
///
/// Positions in the region are in units of the working space (see [`WorkingSpace`]) along the voxel axes, from the centre
/// of the first voxel of the padded box.
#[derive(Clone, Debug)]
pub(super) struct Region {
    pub dims: [usize; 3],
    /// The first and the last voxel of the box without its padding, in coordinates of the padded grid.
    pub inner: [[usize; 3]; 2],
    /// The working space, in which lengths and positions of this region are given.
    pub space: WorkingSpace,
    /// Side lengths of a voxel.
    pub spacing: DVec3,
    /// Maps positions in the region, along the voxel axes, to the working space.
    pub to_space: DAffine3,
    /// Maps positions in the working space to those in the region, along the voxel axes.
    pub from_space: DAffine3,
    /// Quantised intensities of the padded box for each frame, x fastest.
    pub frames: Vec<Vec<u8>>,
    /// The difference in intensity that one step of the quantised intensities stands for.
    pub quantum: f64,
    /// The edge threshold τ, in steps of the quantised intensities.
    pub threshold: f64,
    /// Whether voxels without a value are the background of the objects; they then have the intensity 0, and no others.
    pub has_background: bool,
    /// By frame, whether all of its voxels have the same intensity, or none has a value: such a frame is missing, or has
    /// no objects. It takes no part in the windows of others.
    pub is_blank: Vec<bool>,
}

impl Region {
    /// Extracts the voxels of `volume` within `bounds`, by default all, with padding from the volume around them, and
    /// quantises their intensities to one byte.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for voxel axes that are not at right angles, a box outside the volume, too few
    /// voxels, too many, or no contrast; [`MethodError::Volume`] if a frame does not fit into memory.
    pub async fn new(volume: &Volume, bounds: Option<Bounds>, pauses: &Pauses) -> Result<Self, MethodError> {
        let spacing = DVec3::from(volume.spacing());
        let axes = volume.affine().matrix3;
        let directions =
            DMat3::from_cols(axes.x_axis / spacing.x, axes.y_axis / spacing.y, axes.z_axis / spacing.z);
        let [x, y, z] = [directions.x_axis, directions.y_axis, directions.z_axis];
        if x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()) > ORTHOGONAL {
            let problem =
                "its voxel axes must be orthogonal; resample it, or set an affine with orthogonal axes";
            return Err(MethodError::invalid("volume", problem));
        }
        let [low, high] = voxel_bounds(volume, bounds)?;
        let inner = [[PADDING; 3], [0, 1, 2].map(|k| high[k] - low[k] + PADDING)];
        let dims = inner[1].map(|last| last + PADDING + 1);
        check_size(dims, volume.frames())?;
        let first = volume.affine().transform_point3(DVec3::from(low.map(|i| i as f64 - PADDING as f64)));
        let space = WorkingSpace::of(volume);
        let to_space = DAffine3::from_mat3_translation(directions, space.point(first));
        let mut region = Self {
            dims,
            inner,
            space,
            spacing: spacing * space.scale,
            to_space,
            from_space: to_space.inverse(),
            frames: Vec::new(),
            quantum: 0.0,
            threshold: 0.0,
            has_background: false,
            is_blank: Vec::new(),
        };
        region.read(volume, low, pauses).await?;
        Ok(region)
    }

    /// Quantises the intensities of all frames, between the quantiles found by [`intensity_quantiles`], to one byte.
    async fn read(&mut self, volume: &Volume, low: [usize; 3], pauses: &Pauses) -> Result<(), MethodError> {
        let (mut counts, mut lacks_values) = (vec![0u64; BINS], false);
        for frame in 0..volume.frames() {
            pauses.now().await;
            self.for_each_row(volume, low, frame, |row| lacks_values |= count_values(row, &mut counts))?;
        }
        let range = intensity_quantiles(&counts);
        let mut beside = Beside::new(range);
        let read_again = if lacks_values { 0..volume.frames() } else { 0..0 };
        for frame in read_again {
            pauses.now().await;
            let mut values = Vec::with_capacity(self.dims.iter().product());
            self.for_each_row(volume, low, frame, |row| values.extend(row))?;
            beside.add(&values, self.dims);
        }
        let missing = beside.missing();
        self.has_background = missing == Missing::Background;
        let ([missing, from], to) = (missing.intensity(range), range[1]);
        if from >= to {
            let problem = "all voxels in the box have the same intensity";
            return Err(MethodError::invalid("volume", problem));
        }
        let scale = MAX_LEVEL / (to - from);
        let level = |v: f32| {
            let v = if v.is_nan() { missing } else { f64::from(v) };
            ((v - from) * scale + 0.5).clamp(0.0, MAX_LEVEL) as u8
        };
        for frame in 0..volume.frames() {
            pauses.now().await;
            let mut levels = Vec::with_capacity(self.dims.iter().product());
            self.for_each_row(volume, low, frame, |row| levels.extend(row.iter().map(|&v| level(v))))?;
            self.is_blank.push(levels.windows(2).all(|pair| pair[0] == pair[1]));
            self.frames.push(levels);
        }
        self.quantum = volume.span() / scale;
        Ok(())
    }

    /// Calls `visit` with each row of the region along x in a frame, as intensities in 0..1, the range of the volume; NaN
    /// for those without a value.
    fn for_each_row(
        &self,
        volume: &Volume,
        low: [usize; 3],
        frame: usize,
        mut visit: impl FnMut(&[f32]),
    ) -> Result<(), MethodError> {
        let all = volume::Region { min: [0; 3], dims: volume.dims() };
        let grid = missing::read(volume, all, frame)?;
        // Indices into the volume, clamped to its border.
        let along = |axis: usize| -> Vec<usize> {
            let (from, last) = (low[axis], grid.dims[axis] - 1);
            (0..self.dims[axis]).map(|i| (from + i).saturating_sub(self.inner[0][axis]).min(last)).collect()
        };
        let [xs, ys, zs] = [along(0), along(1), along(2)];
        let mut row = vec![0.0; xs.len()];
        for z in zs {
            for &y in &ys {
                let start = (z * grid.dims[1] + y) * grid.dims[0];
                row.iter_mut().zip(&xs).for_each(|(value, x)| *value = grid.values[start + x]);
                visit(&row);
            }
        }
        Ok(())
    }

    /// Returns the longest side of a voxel among axes along which the box has more than one voxel; the default radius of
    /// plane fits depends on it.
    pub fn longest_side(&self) -> f64 {
        let [first, last] = self.inner;
        (0..3).filter(|&axis| last[axis] > first[axis]).map(|axis| self.spacing[axis]).fold(0.0, f64::max)
    }

    /// Returns whether all voxels of a frame have the same intensity.
    pub fn is_blank(&self, frame: usize) -> bool {
        self.is_blank.get(frame).copied().unwrap_or(false)
    }

    /// Returns the shortest side of a voxel, in world units.
    pub fn shortest_side(&self) -> f64 {
        self.spacing.min_element() / self.space.scale
    }

    /// Returns the difference between the largest and the smallest intensity in the region, without outliers, in the
    /// intensity units of the image.
    pub fn span(&self) -> f64 {
        MAX_LEVEL * self.quantum
    }

    /// Returns the coordinates, in the region's grid, of the voxel with the given index.
    pub fn voxel(&self, index: u32) -> [usize; 3] {
        let ([nx, ny, _], i) = (self.dims, index as usize);
        [i % nx, i / nx % ny, i / (nx * ny)]
    }

    /// Returns the index of the voxel with the given coordinates in the region's grid.
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.dims;
        (z * ny + y) * nx + x
    }

    /// Returns the coordinates, in the region's grid, of the voxel nearest to a position.
    pub fn nearest(&self, position: DVec3) -> [usize; 3] {
        let last = DVec3::from(self.dims.map(|n| (n - 1) as f64));
        (position / self.spacing).clamp(DVec3::ZERO, last).round().to_array().map(|i| i as usize)
    }

    /// Returns the centre of the face after a voxel in `direction`, as a position in the region, and the time of the
    /// face after the frame of the voxel, in frames: 0.5 for faces along time.
    pub fn face(&self, direction: usize, voxel: u32) -> (DVec3, f32) {
        let mut at = DVec3::from(self.voxel(voxel).map(|i| i as f64));
        if direction == TIME {
            return (at * self.spacing, 0.5);
        }
        at[direction] += 0.5;
        (at * self.spacing, 0.0)
    }

    /// Interpolates the quantised intensity of a frame trilinearly at a position, with the border of the region
    /// replicated.
    pub fn sample(&self, frame: usize, position: DVec3) -> f64 {
        trilinear(self.dims, position / self.spacing, |i| f64::from(self.frames[frame][i]))
    }

    /// Estimates the standard deviation of the noise, see [`noise_of`], in all frames but blank ones.
    pub fn noise(&self) -> f64 {
        let frames = self.frames.iter().zip(&self.is_blank).filter(|(_, is_blank)| !**is_blank);
        noise_of(frames.flat_map(|(frame, _)| frame.chunks_exact(self.dims[0])), self.has_background)
    }
}

/// Estimates the standard deviation of the noise, in quantisation steps, from differences between neighbours along the rows
/// of an image: most of them are noise. With `has_background`, pairs with a 0 are left out.
pub(super) fn noise_of<'a>(rows: impl Iterator<Item = &'a [u8]>, has_background: bool) -> f64 {
    let mut counts = [0u64; 256];
    for row in rows {
        let pairs = row.windows(2).filter(|pair| !has_background || pair[0] > 0 && pair[1] > 0);
        pairs.for_each(|pair| counts[usize::from(pair[0].abs_diff(pair[1]))] += 1);
    }
    let all: u64 = counts.iter().sum();
    let (mut below, mut median) = (0, 0.0);
    for (size, &count) in counts.iter().enumerate() {
        if 2 * (below + count) >= all && count > 0 {
            // Interpolates linearly within the bin.
            median = size as f64 - 0.5 + (all as f64 / 2.0 - below as f64) / count as f64;
            break;
        }
        below += count;
    }
    // For two normally distributed values, the median of |a − b| is 0.6745·√2 standard deviations.
    median.max(0.0) / (0.674_49 * std::f64::consts::SQRT_2)
}

fn check_size(dims: [usize; 3], frames: usize) -> Result<(), MethodError> {
    let voxels = dims.iter().fold(1u64, |product, &n| product.saturating_mul(n as u64));
    let bytes = voxels.saturating_mul(BYTES[0] + BYTES[1] * frames as u64);
    if bytes <= MAX_BYTES {
        return Ok(());
    }
    let problem = format!(
        "{dims:?} voxels with padding in {frames} frames need {} MB, more than {}; use a smaller box, or an image with \
         fewer voxels",
        bytes / 1_000_000,
        MAX_BYTES / 1_000_000
    );
    Err(MethodError::invalid("box", problem))
}

/// Returns the error about a box with more voxels, with padding, than a tracker may work with.
pub(super) fn too_many_voxels([x, y, z]: [usize; 3], frames: usize) -> MethodError {
    let problem = format!(
        "the box has {x} × {y} × {z} voxels, with two more on every side, in {frames} frames, more than there is memory for \
         here: use a smaller box, or an image with fewer voxels"
    );
    MethodError::TooLarge { problem }
}

/// Counts intensities, normalised to 0..1, in [`BINS`], and returns whether any is missing.
pub(super) fn count_values(values: &[f32], counts: &mut [u64]) -> bool {
    let mut lacks_values = false;
    for &value in values {
        if value.is_nan() {
            lacks_values = true;
        } else {
            counts[(value * (BINS - 1) as f32 + 0.5) as usize] += 1;
        }
    }
    lacks_values
}

/// Returns the lower and upper quantile of the intensities, normalised to 0..1, beyond which voxels are outliers, from
/// `counts`, the number of voxels in each of the [`BINS`].
pub(super) fn intensity_quantiles(counts: &[u64]) -> [f64; 2] {
    let few = OUTLIERS * counts.iter().sum::<u64>() as f64;
    let beyond = |from_top: bool| {
        let mut sum = 0;
        let bins = (0..BINS).map(|k| if from_top { BINS - 1 - k } else { k });
        let found = bins.into_iter().find(|&bin| {
            sum += counts[bin];
            sum as f64 > few
        });
        found.unwrap_or(0) as f64 / (BINS - 1) as f64
    };
    [false, true].map(beyond)
}

/// Returns the first and the last voxel within `bounds`, by default those of the whole volume, after checking that the
/// bounds are inside the volume and large enough.
fn voxel_bounds(volume: &Volume, bounds: Option<Bounds>) -> Result<[[usize; 3]; 2], MethodError> {
    let last = volume.dims().map(|n| n - 1);
    let (parameter, [low, high]) = match bounds {
        None => ("volume", [[0; 3], last]),
        Some(Bounds::World(corners)) => ("box", voxels_around(volume, corners)?),
        Some(Bounds::Voxels([low, high])) if (0..3).all(|k| low[k] <= high[k] && high[k] <= last[k]) => {
            ("voxels", [low, high])
        }
        Some(Bounds::Voxels([low, high])) => {
            let problem = format!("must satisfy min ≤ max ≤ {last:?}, got min {low:?} and max {high:?}");
            return Err(MethodError::invalid("voxels", problem));
        }
    };
    check_extent(parameter, [0, 1, 2].map(|k| high[k] - low[k] + 1), volume.spacing())?;
    Ok([low, high])
}

/// Checks that a box with these numbers of voxels is large enough along all axes; `parameter` is the one that gave the box.
fn check_extent(parameter: &'static str, counts: [usize; 3], spacing: [f64; 3]) -> Result<(), MethodError> {
    let shortest = spacing.into_iter().fold(f64::INFINITY, f64::min);
    let is_thick = |k: usize| {
        // A rounding error must not decide about three isotropic slices.
        counts[k] >= MIN_SLICES && counts[k] as f64 * spacing[k] >= 0.999 * MIN_THICKNESS * shortest
    };
    let wide = counts.iter().filter(|&&count| count >= MIN_VOXELS).count();
    if wide >= 2 && (0..3).all(is_thick) {
        return Ok(());
    }
    let problem = format!(
        "must have at least {MIN_VOXELS} voxels along two axes, and {MIN_SLICES} along the third, {MIN_THICKNESS} times \
         the shortest side of a voxel thick, got {counts:?}: a surface encloses a volume, not a part of a slice"
    );
    Err(MethodError::invalid(parameter, problem))
}

/// Returns the first and the last voxel whose centres are inside the bounding box, along the voxel axes, of a box in
/// the world, clamped to the volume; at least one voxel along each axis.
pub(super) fn voxels_around(
    volume: &Volume,
    [low, high]: [DVec3; 2],
) -> Result<[[usize; 3]; 2], MethodError> {
    let last = volume.dims().map(|n| n - 1);
    if !low.is_finite() || !high.is_finite() || low.cmpge(high).any() {
        let problem = format!("must be finite with min < max along every axis, got min {low} and max {high}");
        return Err(MethodError::invalid("box", problem));
    }
    // The corners of the box in voxel coordinates, because its axes are those of the world.
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        volume.inverse_affine().transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let from = (0..8).map(corner).fold(DVec3::INFINITY, DVec3::min);
    let to = (0..8).map(corner).fold(DVec3::NEG_INFINITY, DVec3::max);
    if (0..3).any(|axis| to[axis] < 0.0 || from[axis] > last[axis] as f64) {
        let affine = volume.affine();
        let ends = [[0; 3], last].map(|at| affine.transform_point3(DVec3::from(at.map(|i| i as f64))));
        let problem = format!("lies outside the volume, which reaches from {} to {}", ends[0], ends[1]);
        return Err(MethodError::invalid("box", problem));
    }
    let inside = |value: f64, axis: usize| value.clamp(0.0, last[axis] as f64) as usize;
    let first = [0, 1, 2].map(|axis| inside(from[axis].ceil(), axis));
    // A box between two voxel centres contains at least the second voxel.
    let end = [0, 1, 2].map(|axis| inside(to[axis].floor(), axis).max(first[axis]));
    Ok([first, end])
}
