//! Images: levels of the pyramid, with intensities normalised to 0..1, as forces and topology changes sample them.
//!
//! Model space is the index space of the finest level, where every voxel counts as a cube of side 1 (section 4.4, second
//! way); an affine map leads to world space. Voxels that are too long for that are divided into equal parts along their
//! long sides, and the parts count as cubes. Their intensities are those of trilinear interpolation, and are not stored.

use std::sync::atomic::{AtomicBool, Ordering};

use super::DeformableParams;
use super::contour::ObjectIs;
use crate::math::order::median;
use crate::math::{DAffine3, DMat3, DVec3, Vec3};
use crate::methods::MethodError;
use crate::pauses::{Pauses, finished};
use crate::volume::{
    BrickGrid, CellCache, FrameGrid, Grid, NotFinite, Padding, Region, SparseVolume, Subdivided, VectorGrid,
    Volume,
};
use crate::warning::{Warning, WarningCode};

/// The reduction factor ρ = √3: δ and the shortest side of a voxel grow by it with each level of the pyramid. It is
/// that of √3 refinement, by which the mesh gets finer (15).
pub(super) const REDUCTION: f64 = 1.732_050_807_568_877_2;

/// The largest absolute value of an intensity given by the caller, such as the iso value π_I, once it is normalised;
/// within it no force overflows.
pub(super) const MAX_NORMALISED: f64 = 100.0;

/// The largest ratio of a side of a voxel to the shortest one up to which the voxel is not divided along it. With more,
/// edges of the mesh along the long side bridge what the image shows, and a surface oblique to it is made of steps; with
/// less, the meshes of usual computed tomographies, which are right without it, would have more vertices.
const MAX_RATIO: f64 = 2.0;

/// The largest number of parts into which a voxel is divided along a side; an odd number. With more, a few slices far
/// apart would get meshes as large as those of whole volumes; with less than 21, voxels of 1 × 1 × 20 are not cubes.
const MAX_PARTS: usize = 31;

/// The largest number of parts of all voxels of a level, which the search for missing parts marks in two bits each. On
/// wasm32, indices of four times as many do not fit into a `usize`.
const MOST_PARTS: usize = 1 << 30;

/// Returns the number of parts along each axis into which voxels with the given sides are divided: 1, or the odd number
/// that makes them most nearly as long as the shortest side.
fn parts_of(sides: [f64; 3]) -> [usize; 3] {
    let shortest = sides.into_iter().fold(f64::INFINITY, f64::min);
    sides.map(|side| {
        let ratio = side / shortest;
        if ratio <= MAX_RATIO { 1 } else { (2 * (ratio / 2.0) as usize + 1).min(MAX_PARTS) }
    })
}

/// Returns numbers of parts as [`parts_of`], but smaller ones if `dims` voxels would have more than [`MOST_PARTS`].
fn parts_of_whole(sides: [f64; 3], dims: [usize; 3]) -> [usize; 3] {
    let mut parts = parts_of(sides);
    let count =
        |parts: [usize; 3]| (0..3).map(|axis| dims[axis] as f64 * parts[axis] as f64).product::<f64>();
    while parts != [1; 3] && count(parts) > MOST_PARTS as f64 {
        let most = parts.into_iter().max().unwrap_or(1);
        parts = parts.map(|n| if n == most { n - 2 } else { n });
    }
    parts
}
/// The largest distance of the iso value from the range 0..1 of the normalised intensities where all of them are object.
/// The object then ends half a voxel beyond its voxels whatever it is; with more, the image is so steep there
/// that vertices oscillate, with 0, it is flat where the intensities are those at the end of the range.
const MAX_BEYOND: f32 = 0.5;

/// One level of the image pyramid, sampled at positions in model space.
#[derive(Debug)]
pub(super) struct LevelImage {
    /// The intensities of the level; without values if the level is sparse.
    grid: FrameGrid,
    /// The loaded bricks of a sparse level, while the model computes; between its steps the volume has them.
    bricks: Option<BrickGrid>,
    gradient: Option<VectorGrid>,
    /// Maps positions in model space to this level, together with `offset`: voxel index = position · scale + offset.
    scale: Vec3,
    offset: Vec3,
    /// The numbers of parts into which voxels are divided along each axis.
    parts: [usize; 3],
    /// As `scale` and `offset`, with parts instead of voxels.
    part_scale: Vec3,
    part_offset: Vec3,
}

/// Whether there has been a pyramid of a sparse volume. Only the function that makes one sets this: a module that does not
/// call it, of an entry point with one method, is linked without it; then this is a constant, and the code for bricks is
/// left out as well.
static IS_ANY_SPARSE: AtomicBool = AtomicBool::new(false);

/// Returns whether levels may be sparse; asked before anything that only these need.
#[inline]
pub(super) fn is_any_sparse() -> bool {
    IS_ANY_SPARSE.load(Ordering::Relaxed)
}

impl Clone for LevelImage {
    fn clone(&self) -> Self {
        // By `bricks`, so that modules without sparse volumes have no code to copy them.
        Self {
            grid: self.grid.clone(),
            bricks: self.bricks().cloned(),
            gradient: self.gradient.clone(),
            ..*self
        }
    }
}

impl LevelImage {
    /// Makes a level whose voxels are divided into `parts`; `finest` is the number of parts of the finest level along each
    /// axis.
    fn new(grid: impl Into<FrameGrid>, parts: [usize; 3], finest: [usize; 3]) -> Self {
        let grid = grid.into();
        let scale_of =
            |dims: [usize; 3]| Vec3::from([0, 1, 2].map(|axis| dims[axis] as f32 / finest[axis] as f32));
        let [scale, part_scale] =
            [grid.dims(), [0, 1, 2].map(|axis| grid.dims()[axis] * parts[axis])].map(scale_of);
        let [offset, part_offset] = [scale, part_scale].map(|scale| (scale - Vec3::ONE) * 0.5);
        Self { grid, bricks: None, gradient: None, scale, offset, parts, part_scale, part_offset }
    }

    /// Makes a sparse level of the voxels of `bricks`, divided into `parts`; voxel index = position · scale + offset.
    fn of_bricks(bricks: BrickGrid, parts: [usize; 3], [scale, offset]: [Vec3; 2]) -> Self {
        let of_part = |axis: usize| match parts[axis] as f32 {
            1.0 => [scale[axis], offset[axis]],
            parts => [scale[axis] * parts, (offset[axis] + 0.5) * parts - 0.5],
        };
        Self {
            grid: Grid { dims: bricks.dims(), values: Vec::new() }.into(),
            bricks: Some(bricks),
            gradient: None,
            scale,
            offset,
            parts,
            part_scale: Vec3::from([0, 1, 2].map(|axis| of_part(axis)[0])),
            part_offset: Vec3::from([0, 1, 2].map(|axis| of_part(axis)[1])),
        }
    }

    /// Returns the loaded bricks of a sparse level, while the model computes; `None` for a level that is there as a whole.
    #[inline]
    pub(super) fn bricks(&self) -> Option<&BrickGrid> {
        if is_any_sparse() { self.bricks.as_ref() } else { None }
    }

    /// As [`Self::bricks`], to change them.
    pub(super) fn bricks_mut(&mut self) -> Option<&mut BrickGrid> {
        if is_any_sparse() { self.bricks.as_mut() } else { None }
    }

    /// Returns the length of the side of a cube with the volume of a part of a voxel of this level, in model units.
    pub(super) fn side(&self) -> f64 {
        1.0 / libm::cbrt(self.part_scale.as_dvec3().element_product())
    }

    /// Returns the index, in voxels, of a position in model space.
    #[inline]
    pub(super) fn index(&self, p: Vec3) -> Vec3 {
        p * self.scale + self.offset
    }

    /// Returns the index, in parts of voxels, of a position in model space.
    pub(super) fn part_index(&self, p: Vec3) -> Vec3 {
        p * self.part_scale + self.part_offset
    }

    /// Returns the number of parts of voxels of this level per model unit, along each axis.
    pub(super) fn part_scale(&self) -> Vec3 {
        self.part_scale
    }

    /// Returns the grid of the parts of voxels, and a map from its indices to model space.
    pub(super) fn part_grid(&self) -> (Subdivided<'_>, impl Fn(Vec3) -> Vec3) {
        (Subdivided::new(&self.grid, self.parts), |index| (index - self.part_offset) / self.part_scale)
    }

    /// Returns Π, the trilinearly interpolated intensity in 0..1, at a position in model space, in the image with
    /// `outside` around it, so that every object ends at its border. `known` caches the image cell of the last call for
    /// the same vertex.
    #[inline]
    pub(super) fn intensity(&self, p: Vec3, outside: Padding, known: &mut CellCache) -> f32 {
        if self.parts != [1; 3] {
            return self.intensity_by_parts(p, outside, known);
        }
        match self.bricks() {
            None => self.grid.sample_padded(self.index(p), outside, known),
            Some(bricks) => bricks.sample_padded(self.index(p), outside, known),
        }
    }

    /// As [`Self::intensity`], in divided voxels.
    #[inline(never)]
    fn intensity_by_parts(&self, p: Vec3, outside: Padding, known: &mut CellCache) -> f32 {
        // Padding by parts, as the contour has it, which ends half a voxel beyond the centres; padding by long voxels would
        // end more than that beyond the centres where the object is bright.
        let (index, parts) = (self.index(p), (self.part_grid().0.dims(), self.part_index(p)));
        match self.bricks() {
            None => self.grid.sample_padded_by(parts, index, outside, known),
            Some(bricks) => bricks.sample_padded_by(parts, index, outside, known),
        }
    }

    /// Returns ∇Π, the gradient of the intensity by the Sobel operator, at a position in model space, for the gradient
    /// force; per part of a voxel of this level and with a length of at most `bound`; zero if [`Self::prepare_gradient_for`] was not
    /// called.
    #[inline]
    pub(super) fn gradient(&self, p: Vec3, bound: f32) -> Vec3 {
        let gradient = if self.parts != [1; 3] {
            self.gradient_by_parts(p)
        } else if let Some(field) = &self.gradient {
            field.sample(self.index(p))
        } else {
            return Vec3::ZERO;
        };
        let length = gradient.length();
        if length > bound { gradient * (bound / length) } else { gradient }
    }

    /// Returns the gradient by the Sobel operator on the parts of voxels, which is not stored: interpolated between parts,
    /// it is the operator applied to the image at distances of whole parts.
    fn gradient_by_parts(&self, p: Vec3) -> Vec3 {
        let at = self.index(p);
        let step = Vec3::from(self.parts.map(|n| 1.0 / n as f32));
        let mut gradient = Vec3::ZERO;
        for k in 0..27 {
            let shift = Vec3::from([k % 3, k / 3 % 3, k / 9].map(|i| f32::from(i as i8) - 1.0));
            let weight = Vec3::splat(2.0) - shift.abs();
            let across = Vec3::new(weight.y * weight.z, weight.z * weight.x, weight.x * weight.y);
            gradient += shift * across * self.grid.sample(at + shift * step);
        }
        gradient * (1.0 / 32.0)
    }

    /// Computes the gradient image that [`Self::gradient`] samples if a gradient force acts, unless that was done before; none if
    /// voxels are divided.
    pub(super) fn prepare_gradient_for(&mut self, params: &DeformableParams) -> Result<(), MethodError> {
        let is_needed = params.gradient_normal != 0.0 || params.gradient_tangent != 0.0;
        if is_needed && self.parts == [1; 3] && self.gradient.is_none() {
            self.gradient = Some(self.grid.sobel()?);
        }
        Ok(())
    }

    /// Returns the mean of all intensities above `iso` if `above` is set, otherwise of all below it; `None` if there
    /// are none. It is used as the mean intensity of the background.
    pub(super) fn mean_beyond(&self, iso: f32, above: bool) -> Option<f32> {
        let (mut sum, mut count) = (0.0, 0);
        for part in self.grid.parts(BLOCK) {
            for &value in part.iter().filter(|&&value| if above { value > iso } else { value < iso }) {
                sum += f64::from(value);
                count += 1;
            }
        }
        (count > 0).then(|| (sum / f64::from(count)) as f32)
    }

    /// Returns, in model space, the first and the last part of a voxel brighter than `iso` of each row along x that has
    /// one; the enclosing start surface is made around them.
    pub(super) fn ends_of_rows(&self, iso: f32) -> Vec<Vec3> {
        let (grid, position) = self.part_grid();
        let [nx, _, nz] = grid.dims();
        let mut ends = Vec::new();
        for z in 0..nz {
            for (y, row) in grid.slice(z).chunks_exact(nx).enumerate() {
                let at = |i: usize| position(Vec3::new(i as f32, y as f32, z as f32));
                let [first, last] = [row.iter().position(|&v| v > iso), row.iter().rposition(|&v| v > iso)];
                ends.extend([first, last].into_iter().flatten().map(at));
            }
        }
        ends
    }

    /// Returns the steepness of the image at `iso`: the root mean square of the differences between neighbouring voxels
    /// on opposite sides of `iso`, per model unit; 0 if there are none. It limits the factor on the image force on
    /// coarse levels. Pauses meanwhile.
    pub(super) async fn steepness(&self, iso: f32, pauses: &Pauses) -> f32 {
        let (mut sum, mut count) = (0.0f64, 0usize);
        let add = |difference| {
            sum += f64::from(difference * difference);
            count += 1;
        };
        self.for_each_iso_crossing(iso, add, pauses).await;
        let mean = if count > 0 { sum / count as f64 } else { 0.0 };
        mean.sqrt() as f32 * self.voxels_per_unit()
    }

    /// Returns the median of the absolute differences between neighbouring voxels on opposite sides of `iso`, per model
    /// unit; 0 if there are none. Unlike [`Self::steepness`], it is not affected by a few edges much steeper than the
    /// others; faint images are recognised by it. Pauses meanwhile.
    pub(super) async fn median_steepness(&self, iso: f32, pauses: &Pauses) -> f32 {
        let mut differences = Vec::new();
        self.for_each_iso_crossing(iso, |difference| differences.push(difference.abs()), pauses).await;
        median(differences.into_iter()).map_or(0.0, |difference| difference * self.voxels_per_unit())
    }

    /// Calls `visit` with the signed difference of intensity, per part of a voxel, of each pair of voxels that share a face
    /// and are on opposite sides of `iso`, from which the steepness of the image is computed.
    async fn for_each_iso_crossing(&self, iso: f32, mut visit: impl FnMut(f32), pauses: &Pauses) {
        let [nx, ny, nz] = self.grid.dims();
        let parts = self.parts.map(|n| n as f32);
        let mut pass = |a: &[f32], b: &[f32], axis: usize| {
            let iso_crossings = a.iter().zip(b).filter(|&(&a, &b)| (a < iso) != (b < iso));
            iso_crossings.for_each(|(&a, &b)| visit((a - b) / parts[axis]));
        };
        let (rows, block) = (ny * nz, (BLOCK / nx).max(1));
        for first in (0..rows).step_by(block) {
            let end = rows.min(first + block);
            let here = self.grid.values(first * nx..rows.min(end + 1) * nx);
            let above = self.grid.values(rows.min(first + ny) * nx..rows.min(end + ny) * nx);
            for k in first..end {
                let at = |k: usize| (k - first) * nx..(k + 1 - first) * nx;
                let row = &here[at(k)];
                pass(&row[1..], row, 0);
                if k % ny + 1 < ny {
                    pass(&here[at(k + 1)], row, 1);
                }
                if k / ny + 1 < nz {
                    pass(&above[at(k)], row, 2);
                }
            }
            pauses.after(block * nx / VOXELS_PER_UNIT).await;
        }
    }

    /// Updates the gradient image, if there is one, after the intensities in a region have changed.
    fn update_gradient(&mut self, changed: Region) -> Result<(), MethodError> {
        if let Some(gradient) = &mut self.gradient {
            self.grid.stored_mut()?.update_sobel(gradient, changed)?;
        }
        Ok(())
    }

    /// Returns the number of voxels, or of parts of divided ones, of this level per model unit, along the axis on which it
    /// is largest; it converts lengths to voxels of the level.
    pub(super) fn voxels_per_unit(&self) -> f32 {
        self.part_scale.max_element()
    }

    /// Returns the number of voxels of this level per model unit, along each axis.
    pub(super) fn scale(&self) -> Vec3 {
        self.scale
    }

    /// Returns the number of voxels along each axis.
    pub(super) fn dims(&self) -> [usize; 3] {
        self.grid.dims()
    }
}

/// The number of voxels that a pass over the image reads at a time: a whole slice may be as large as the volume.
const BLOCK: usize = 1 << 14;

/// Number of voxels of a pass over the image that count as one unit of work between pauses.
const VOXELS_PER_UNIT: usize = 512;

/// The image pyramid of one frame, finest level first, and the range by which its intensities are normalised.
#[derive(Clone, Debug)]
pub(super) struct Pyramid {
    pub(super) levels: Vec<LevelImage>,
    /// The spacing of the volume, from which those of the levels follow.
    spacing: [f64; 3],
    /// The numbers of parts into which the voxels of the volume are divided along each axis.
    parts: [usize; 3],
    /// The intensity that is normalised to 0, and the range that is normalised to 0..1.
    low: f64,
    range: f64,
    /// The lowest intensity of the volume, and its range: those above, unless differences across the iso value are too
    /// small for that.
    volume_range: [f64; 2],
    /// Whether all voxels of the frame have the same intensity; not known of a sparse volume.
    is_flat: bool,
    /// The volume and the index of its frame, if what is normalised to 0..1 may depend on the iso value.
    source: Option<(Volume, usize)>,
    /// The voxels of the finest level that are not finite. Their values depend on the iso value and the side of it on
    /// which the object is.
    not_finite: Option<NotFinite>,
    /// The iso value of the volume, and the side of it on which the object is, that `source` and `not_finite` were used for.
    made_for: (f64, ObjectIs),
    /// The sum of the hashes of all voxels of the finest level, or of the coarsest of a sparse volume, by which a saved
    /// state is matched to its volume.
    hash: u64,
    pub(super) sparse: Option<SparseLevels>,
}

/// The levels of a sparse volume that a pyramid has: all but the finest ones.
#[derive(Clone, Debug)]
pub(super) struct SparseLevels {
    pub(super) volume: SparseVolume,
    /// The index of the pyramid's finest level in the volume.
    pub(super) finest: usize,
    /// The distance from a vertex, in δ, within which the bricks of a level are loaded before a step.
    pub(super) reach: f32,
}

impl Pyramid {
    /// Builds the image pyramid of a frame, with `above` levels above the volume itself, for the iso value of `params`.
    ///
    /// Intensities are normalised by the range of the volume; if single precision then shows the image near the iso value
    /// too coarsely, since a few voxels are far beyond all others, by a window around it.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for more levels than the volume allows; [`MethodError::Volume`] if there is no
    /// such frame or memory does not suffice.
    pub(super) fn new(
        volume: &Volume,
        frame: usize,
        above: usize,
        params: &DeformableParams,
    ) -> Result<Self, MethodError> {
        finished(Self::in_slices(volume, frame, above, params, &Pauses::default()))
    }

    /// Makes a pyramid as [`Self::new`] does, with pauses between passes over the voxels.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) async fn in_slices(
        volume: &Volume,
        frame: usize,
        above: usize,
        params: &DeformableParams,
        pauses: &Pauses,
    ) -> Result<Self, MethodError> {
        let parts = parts_of_whole(volume.spacing(), volume.dims());
        let possible = max_levels(volume);
        if above > possible {
            let [nx, ny, nz] = volume.dims();
            let problem = format!("must be from 0 to {possible} for {nx} × {ny} × {nz} voxels, got {above}");
            return Err(MethodError::invalid("levels", problem));
        }
        let pass = volume.dims().iter().product::<usize>() / VOXELS_PER_UNIT + 1;
        let grid = volume.frame_grid(volume.range(), frame)?;
        pauses.after(pass).await;
        let (hash, is_flat) = hash_and_flatness(&grid, pauses).await;
        let volume_range = [volume.range()[0], volume.span()];
        let divided = [0, 1, 2].map(|axis| grid.dims()[axis] * parts[axis]);
        let mut pyramid = Self {
            levels: vec![LevelImage::new(grid, parts, divided)],
            spacing: volume.spacing(),
            parts,
            low: volume_range[0],
            range: volume_range[1],
            volume_range,
            is_flat,
            source: None,
            not_finite: volume.not_finite(frame)?,
            made_for: (params.iso, ObjectIs::by(params)),
            hash,
            sparse: None,
        };
        pauses.after(pass).await;
        if let Some([low, high]) = volume.window_at(params.iso, frame)? {
            [pyramid.low, pyramid.range] = [low, high - low];
            pyramid.levels = vec![LevelImage::new(volume.frame_grid([low, high], frame)?, parts, divided)];
        }
        if pyramid.is_windowed() || volume.is_wide(frame)? {
            pyramid.source = Some((volume.clone(), frame));
        }
        pauses.after(pass).await;
        pyramid.set_not_finite(params)?;
        pyramid.build_levels(above, pauses).await?;
        Ok(pyramid)
    }

    /// Returns the pyramid for other parameters, if its voxels depend on them and differ; otherwise `None`.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory does not suffice.
    pub(super) fn adapted(&self, params: &DeformableParams) -> Result<Option<Self>, MethodError> {
        if self.made_for == (params.iso, ObjectIs::by(params)) {
            return Ok(None);
        }
        let above = self.levels.len() - 1;
        if let Some((volume, frame)) = &self.source
            && (self.is_windowed() || volume.window_at(params.iso, *frame)?.is_some())
        {
            return Self::new(volume, *frame, above, params).map(Some);
        }
        if self.not_finite.is_none() {
            return Ok(None);
        }
        let finest = LevelImage::new(self.levels[0].grid.clone(), self.parts, self.dims());
        let mut adapted = Self {
            levels: vec![finest],
            source: self.source.clone(),
            not_finite: self.not_finite.clone(),
            made_for: (params.iso, ObjectIs::by(params)),
            sparse: None,
            ..*self
        };
        adapted.set_not_finite(params)?;
        finished(adapted.build_levels(above, &Pauses::default()))?;
        Ok(Some(adapted))
    }

    /// Returns whether the finest level has the values of [`Volume::normalised_grid`], each of which depends on its voxel
    /// and the range of the volume only.
    pub(super) fn is_as_normalised(&self) -> bool {
        !self.is_windowed() && self.not_finite.is_none()
    }

    /// Returns whether a window around the iso value is normalised to 0..1, not the range of the volume.
    fn is_windowed(&self) -> bool {
        [self.low, self.range] != self.volume_range
    }

    /// Replaces the volume that other windows may be taken from.
    pub(super) fn set_source(&mut self, volume: &Volume, frame: usize) {
        if self.source.is_some() {
            self.source = Some((volume.clone(), frame));
        }
    }

    /// Gives values to the voxels of the finest level that are not finite: NaN is never object, infinite voxels are on
    /// their side of the iso value.
    fn set_not_finite(&mut self, params: &DeformableParams) -> Result<(), MethodError> {
        let Some(not_finite) = &self.not_finite else { return Ok(()) };
        let (iso, object) = (self.iso(params), ObjectIs::by(params));
        let grid = self.levels[0].grid.stored_mut()?;
        let far = [ObjectIs::Brighter, ObjectIs::Darker].map(|object| object.background(iso));
        not_finite.replace(grid, iso, object.is_above(), far);
        Ok(())
    }

    /// Makes `above` levels from the finest, the only one. Pauses meanwhile.
    async fn build_levels(&mut self, above: usize, pauses: &Pauses) -> Result<(), MethodError> {
        let mut spacing = self.spacing;
        let mut unit = spacing.into_iter().fold(f64::INFINITY, f64::min);
        let finest = self.dims();
        let mut level_parts = self.parts;
        for level in 0..above {
            let grid = &self.levels[level].grid;
            let along = level_parts.map(|n| n == 1);
            let (coarse, coarse_spacing) =
                grid.reduce_along(along, spacing, [unit, REDUCTION], pauses).await?;
            level_parts = parts_on_coarse_level(self.parts, coarse_spacing, coarse.dims);
            self.levels.push(LevelImage::new(coarse, level_parts, finest));
            spacing = coarse_spacing;
            unit *= REDUCTION;
        }
        Ok(())
    }

    /// Makes the pyramid of a sparse volume from its level `finest` on, the coarsest level whole.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if there is no such level; [`MethodError::NeedsData`] unless the coarsest level
    /// is loaded whole; [`MethodError::Volume`] if memory does not suffice.
    pub(super) async fn of_sparse(
        volume: &SparseVolume,
        finest: usize,
        pauses: &Pauses,
    ) -> Result<Self, MethodError> {
        let all = volume.levels();
        let Some(&first) = all.get(finest) else {
            return Err(MethodError::invalid("finest", format!("must be below {}, got {finest}", all.len())));
        };
        let last = all.len() - 1;
        let Some(coarsest) = volume.whole(last)? else {
            return Err(MethodError::NeedsData { needs: volume.missing(last)? });
        };
        let coarsest = FrameGrid::from(coarsest);
        pauses.now().await;
        let hash = hash_of(&coarsest, Region { min: [0; 3], dims: coarsest.dims() });
        let spacing = spacing_of(&first.affine);
        let parts = parts_of(spacing);
        let to_world = model_to_world(&first.affine, parts);
        let mut levels = Vec::with_capacity(all.len() - finest);
        // Those of the model itself, of which others of the volume use some while it has those of the volume.
        let own: Vec<_> = volume.bricks()[finest..].iter().map(BrickGrid::emptied).collect();
        for ((k, level), own) in all[finest..].iter().enumerate().zip(own) {
            let map = level.affine.inverse() * to_world;
            let [x, y, z] = [map.matrix3.x_axis.x, map.matrix3.y_axis.y, map.matrix3.z_axis.z];
            let of_level = match k {
                0 => parts,
                _ if k + finest < last => parts_of_coarse_voxels(parts, spacing_of(&level.affine)),
                _ => parts_on_coarse_level(parts, spacing_of(&level.affine), level.dims),
            };
            let [scale, offset] = [Vec3::new(x as f32, y as f32, z as f32), map.translation.as_vec3()];
            levels.push(LevelImage::of_bricks(own, of_level, [scale, offset]));
        }
        if let Some(level) = levels.last_mut() {
            *level = LevelImage { grid: coarsest, bricks: None, ..level.clone() };
        }
        IS_ANY_SPARSE.store(true, Ordering::Relaxed);
        let sparse = Some(SparseLevels { volume: volume.clone(), finest, reach: super::sparse::REACH });
        let volume_range = [volume.range()[0], volume.span()];
        Ok(Self {
            levels,
            spacing,
            parts,
            low: volume_range[0],
            range: volume_range[1],
            volume_range,
            is_flat: false,
            source: None,
            not_finite: None,
            made_for: (0.0, ObjectIs::Brighter),
            hash,
            sparse,
        })
    }

    /// Returns whether this is the pyramid of a sparse volume.
    #[inline]
    pub(super) fn is_sparse(&self) -> bool {
        is_any_sparse() && self.sparse.is_some()
    }

    /// Returns δ, the lower bound of the edge length, on a level in voxels of the finest level; it grows by
    /// [`REDUCTION`] with each level (15), or, in a sparse volume, with the size of the level's voxels.
    pub(super) fn delta_at(&self, finest: f64, level: usize) -> f32 {
        if self.is_sparse() {
            return (finest * self.levels[level].side()) as f32;
        }
        (0..level).fold(finest, |delta, _| delta * REDUCTION) as f32
    }

    /// Returns the smallest box around the voxels of a region at which `new`, intensities for the region, differs from
    /// the finest level, and the part of `new` in that box; `None` if there are none.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory does not suffice.
    pub(super) fn changes(&self, region: Region, new: &Grid) -> Result<Option<(Region, Grid)>, MethodError> {
        let old = self.levels[0].grid.part(region)?;
        let (mut low, mut high) = (region.dims, [0; 3]);
        for (i, _) in new.values.iter().zip(&old.values).enumerate().filter(|(_, (new, old))| new != old) {
            let [nx, ny, _] = region.dims;
            for (axis, k) in [i % nx, i / nx % ny, i / nx / ny].into_iter().enumerate() {
                low[axis] = low[axis].min(k);
                high[axis] = high[axis].max(k + 1);
            }
        }
        if high == [0; 3] {
            return Ok(None);
        }
        let part = Region { min: low, dims: [0, 1, 2].map(|axis| high[axis] - low[axis]) };
        let changed = Region { min: [0, 1, 2].map(|axis| region.min[axis] + low[axis]), ..part };
        Ok(Some((changed, new.part(part)?)))
    }

    /// Replaces the intensities of the finest level in a region by those of `new`, and updates all that depends on them
    /// on all levels, and only that.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory does not suffice; part of the levels is out of date then.
    pub(super) fn update(&mut self, region: Region, new: &Grid) -> Result<(), MethodError> {
        let before = hash_of(&self.levels[0].grid, region);
        self.levels[0].grid.stored_mut()?.overwrite(region, new);
        self.hash = self.hash.wrapping_sub(before).wrapping_add(hash_of(&self.levels[0].grid, region));
        self.levels[0].update_gradient(region)?;
        let (mut changed, mut spacing) = (region, self.spacing);
        let mut unit = spacing.into_iter().fold(f64::INFINITY, f64::min);
        for level in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(level);
            let axes = finer[level - 1].parts.map(|n| n == 1);
            let (from, to) = (finer[level - 1].grid.stored_mut()?, &mut coarser[0]);
            let steps = [unit, REDUCTION];
            let updated = from.update_reduced_along(axes, to.grid.stored_mut()?, changed, spacing, steps)?;
            let Some(updated) = updated else { return Ok(()) };
            to.update_gradient(updated)?;
            spacing = [0, 1, 2].map(|axis| spacing[axis] * from.dims[axis] as f64 / to.dims()[axis] as f64);
            (changed, unit) = (updated, unit * REDUCTION);
        }
        Ok(())
    }

    /// Returns the sum of the hashes of all voxels of the finest level, or of the coarsest of a sparse volume, for the
    /// fingerprint of a saved state.
    pub(super) fn hash(&self) -> u64 {
        self.hash
    }

    /// Returns whether the range of `volume` is that of the volume of the pyramid.
    pub(super) fn has_range_of(&self, volume: &Volume) -> bool {
        self.volume_range == [volume.range()[0], volume.span()]
    }

    /// Returns the iso value π_I, normalised as intensities are. If all of these are object, it is [`MAX_BEYOND`] from them
    /// at most.
    pub(super) fn iso(&self, params: &DeformableParams) -> f32 {
        let iso = self.normalised(params.iso);
        match ObjectIs::by(params) {
            ObjectIs::Brighter if iso < -MAX_BEYOND => -MAX_BEYOND,
            ObjectIs::Darker if iso > 1.0 + MAX_BEYOND => 1.0 + MAX_BEYOND,
            _ => iso,
        }
    }

    /// Maps an intensity in the volume's units such that the range of the pyramid becomes 0..1. Results are clamped to
    /// ±[`MAX_NORMALISED`].
    pub(super) fn normalised(&self, intensity: f64) -> f32 {
        ((intensity - self.low) / self.range).clamp(-MAX_NORMALISED, MAX_NORMALISED) as f32
    }

    /// Returns the lowest intensity of the volume, and its range.
    pub(super) fn volume_range(&self) -> [f64; 2] {
        self.volume_range
    }

    /// Returns the lengths of a model unit along the axes, in world units.
    pub(super) fn spacing(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.spacing[axis] / self.parts[axis] as f64)
    }

    /// Returns the dimensions of the finest level in model units: in voxels, or in parts of divided ones.
    pub(super) fn dims(&self) -> [usize; 3] {
        self.levels[0].part_grid().0.dims()
    }

    /// Returns the dimensions of the finest level in voxels.
    pub(super) fn voxel_dims(&self) -> [usize; 3] {
        self.levels[0].dims()
    }

    /// Returns the volume of a voxel of the finest level in model units: the number of its parts.
    pub(super) fn voxel(&self) -> f64 {
        self.parts.iter().product::<usize>() as f64
    }

    /// Returns the warnings about results on this image with the parameters `params`.
    pub(super) fn warnings(&self, params: &DeformableParams) -> Vec<Warning> {
        let boundary = self.flat().or_else(|| self.beyond_range(params));
        self.elongated().into_iter().chain(boundary).collect()
    }

    fn elongated(&self) -> Option<Warning> {
        let spacing = self.spacing();
        let [shortest, longest] =
            [f64::min, f64::max].map(|of| spacing.into_iter().reduce(of).unwrap_or(1.0));
        let ratio = self.spacing.into_iter().fold(0.0, f64::max) / shortest;
        let text = format!(
            "voxels are {ratio:.0} times as long as wide: between their centres the shape is a guess, and the surface has \
             steps; interpolate slices (enrichSlices) or resample the volume first"
        );
        (longest / shortest > MAX_RATIO).then(|| Warning::new(WarningCode::Anisotropic, text))
    }

    fn flat(&self) -> Option<Warning> {
        let text = "all voxels have the same intensity: the image shows no boundary, and a surface in it means nothing";
        self.is_flat.then(|| Warning::new(WarningCode::NoBoundary, text))
    }

    /// Warns of an iso value that no surface has. Of a sparse volume, the intensities are not known.
    fn beyond_range(&self, &DeformableParams { iso, iso_force, .. }: &DeformableParams) -> Option<Warning> {
        let [low, span] = self.volume_range;
        let is_beyond = iso < low || iso > low + span;
        let text = || {
            let high = low + span;
            format!(
                "no surface has the iso value {iso}: the intensities of the volume are from {low} to {high}"
            )
        };
        (is_beyond && iso_force != 0.0 && self.sparse.is_none())
            .then(|| Warning::new(WarningCode::NoBoundary, text()))
    }

    /// Returns the map from model space to world space for a volume with the affine transform `affine`.
    pub(super) fn to_world(&self, affine: &DAffine3) -> DAffine3 {
        model_to_world(affine, self.parts)
    }

    /// Returns the parts of voxels, as a region in model units, whose intensities change with those of the voxels in
    /// `region`.
    pub(super) fn parts_around(&self, region: Region) -> Region {
        let dims = self.dims();
        let [min, end] = [0, 1].map(|k| {
            [0, 1, 2].map(|axis| {
                let parts = self.parts[axis];
                // Beyond the centres of the next voxels nothing changes.
                let (middle, beyond) = (parts * region.min[axis] + parts / 2, parts - 1);
                match k {
                    0 => middle.saturating_sub(beyond),
                    _ => (middle + parts * (region.dims[axis] - 1) + beyond + 1).min(dims[axis]),
                }
            })
        });
        Region { min, dims: [0, 1, 2].map(|axis| end[axis] - min[axis]) }
    }
}

/// Returns the number of parts into which the voxels of a coarse level are divided, given those of the finest: none if
/// these are not, although rounding may have made them a little longer.
fn parts_on_coarse_level(finest: [usize; 3], sides: [f64; 3], dims: [usize; 3]) -> [usize; 3] {
    if finest == [1; 3] { finest } else { parts_of_whole(sides, dims) }
}

/// Returns numbers of parts as [`parts_on_coarse_level`], of a level that is never there as a whole.
fn parts_of_coarse_voxels(finest: [usize; 3], sides: [f64; 3]) -> [usize; 3] {
    if finest == [1; 3] { finest } else { parts_of(sides) }
}

/// Returns the largest number of levels above a volume: each must have at least two voxels along every axis. Axes along
/// which voxels are divided keep their voxels until the others are as long.
pub(super) fn max_levels(volume: &Volume) -> usize {
    let parts = parts_of_whole(volume.spacing(), volume.dims());
    let (mut dims, mut spacing, mut level_parts) = (volume.dims(), volume.spacing(), parts);
    let mut above = 0;
    while dims.iter().all(|&n| n >= 2) {
        let next = [0, 1, 2].map(|axis| {
            if level_parts[axis] == 1 { (dims[axis] as f64 / REDUCTION) as usize } else { dims[axis] }
        });
        spacing = [0, 1, 2].map(|axis| spacing[axis] * dims[axis] as f64 / next[axis].max(1) as f64);
        dims = next;
        level_parts = parts_on_coarse_level(parts, spacing, dims);
        above += 1;
    }
    usize::max(above, 1) - 1
}

/// Returns the map from the indices of parts of voxels to world space, given that from voxel indices.
fn model_to_world(affine: &DAffine3, parts: [usize; 3]) -> DAffine3 {
    if parts == [1; 3] {
        return *affine;
    }
    let side = DVec3::from(parts.map(|n| 1.0 / n as f64));
    *affine * DAffine3 { matrix3: DMat3::from_diagonal(side), translation: (side - DVec3::ONE) * 0.5 }
}

fn spacing_of(affine: &DAffine3) -> [f64; 3] {
    let axes = affine.matrix3;
    [axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()]
}

/// Returns the sum of the hashes of the voxels of a grid in a region.
fn hash_of(grid: &FrameGrid, region: Region) -> u64 {
    let mut buffer = Vec::new();
    region.rows(grid.dims(), 0).fold(0, |sum, row| {
        let values = grid.values_in(row.clone(), &mut buffer);
        row.zip(values).fold(sum, |sum: u64, (k, &value)| sum.wrapping_add(hash_of_voxel(k, value)))
    })
}

/// Returns the hash of all voxels of a grid, as [`hash_of`], and whether they have the same intensity. Pauses meanwhile.
async fn hash_and_flatness(grid: &FrameGrid, pauses: &Pauses) -> (u64, bool) {
    let (first, mut hash, mut is_flat) = (grid.value(0), 0u64, true);
    for (k, part) in grid.parts(BLOCK).enumerate() {
        is_flat &= part.iter().all(|&value| value == first);
        for (k, &value) in (k * BLOCK..).zip(part.iter()) {
            hash = hash.wrapping_add(hash_of_voxel(k, value));
        }
        pauses.after(1 + part.len() / VOXELS_PER_UNIT).await;
    }
    (hash, is_flat)
}

/// Returns the hash of one voxel, given its index in the grid and its intensity. The hashes of an image are added up, so
/// that a change of one voxel changes the sum without reading the others.
fn hash_of_voxel(index: usize, value: f32) -> u64 {
    // The finaliser of SplitMix64 (Steele, Lea and Flood, *Fast splittable pseudorandom number generators*, 2014).
    let mut x = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(value.to_bits());
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
