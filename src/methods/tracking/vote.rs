//! Boundary votes (section 2 of the paper that `tracking` follows): each window of the image is split into two clusters
//! by intensity, and votes for the faces between voxels of different clusters.

use super::region::Region;
use crate::methods::MethodError;
use crate::pauses::Pauses;
use serde::{Deserialize, Serialize};
use wide::u8x16;

/// Stands for the level between bright and dark in a window without a boundary; quantised intensities are lower.
const NONE: u8 = u8::MAX;

/// Number of faces between voxels whose votes are counted at once in one SIMD vector.
const LANES: usize = u8x16::LANES as usize;

/// Share of the voxels of a window that each of its two clusters, bright and dark, must exceed for a boundary.
const MIN_SHARE: f64 = 0.1;

/// Number of voxels that count as one unit of work between pauses.
const VOXELS_PER_UNIT: usize = 8;

/// Maximum number of Lloyd iterations that split a window into two clusters; two to five are usual.
const ITERATIONS: usize = 50;

/// Returns the error about a box with more boundaries than can be worked with.
pub(super) fn too_much_boundary() -> MethodError {
    let problem = "the objects in the box have more boundary than there is memory for here: use a smaller box, a higher \
                   edge threshold, or an image with fewer voxels";
    MethodError::TooLarge { problem: problem.into() }
}

/// The extent of the windows that vote for boundaries, and the criterion for their two clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Window {
    /// Number k of voxels to either side of the central voxel along each axis.
    pub half_width: usize,
    /// Number of frames to either side of the central frame; 0 processes each frame on its own.
    pub frames: usize,
    /// Edge threshold τ, in steps of the quantised intensities: the difference of a window's cluster means must exceed
    /// this.
    pub threshold: f64,
    /// Whether the last frame is followed by the first, so that windows extend from one to the other.
    pub cyclic: bool,
}

/// The direction of the faces between voxels next to each other along x: an index into [`Faces`].
pub(super) const X: usize = 0;
/// The direction of faces between voxels next to each other along y: an index into [`Faces`].
pub(super) const Y: usize = 1;
/// The direction of faces between voxels next to each other along z: an index into [`Faces`].
pub(super) const Z: usize = 2;
/// The direction of faces between a voxel and itself in the next frame: an index into [`Faces`].
pub(super) const TIME: usize = 3;

/// A face between two voxels that has boundary votes: a boundary point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Face {
    /// Index of the voxel before the face; the other voxel is next to it along the direction of the face.
    pub voxel: u32,
    /// Share of the windows containing both voxels that vote for the face, above 0; 1 in the sides of the processed
    /// box.
    pub weight: f32,
}

/// Faces with boundary votes of one frame, by direction; those along time are between this frame and the next.
pub(super) type Faces = [Vec<Face>; 4];

/// Finds, frame by frame, the level between bright and dark in each window of a sequence, and the boundary votes of the
/// faces between voxels.
#[derive(Clone, Debug)]
pub(super) struct BoundaryVoting {
    window: Window,
    /// By frame, the level between the clusters of the window around each voxel, in padded rows (see [`Rows`]);
    /// computed when first needed.
    levels: Vec<Option<Vec<u8>>>,
    /// The largest difference of the two cluster means in a window so far, in steps of the quantised intensities.
    largest: f64,
}

impl BoundaryVoting {
    pub fn new(window: Window, frames: usize) -> Self {
        Self { window, levels: vec![None; frames], largest: 0.0 }
    }

    /// Returns the extent of the windows.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Returns the faces between voxels of a frame that have boundary votes, within the processed box, and those in its
    /// sides where they cut bright regions.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`] if there are more than `most`.
    pub async fn faces(
        &mut self,
        region: &Region,
        frame: usize,
        most: usize,
        pauses: &Pauses,
    ) -> Result<Faces, MethodError> {
        let mut faces = Faces::default();
        if region.is_blank(frame) {
            return Ok(faces);
        }
        let frames = self.window.frames_with_contrast(region, frame);
        for &t in &frames {
            self.ensure_levels(region, t, pauses).await;
        }
        let mut room = most;
        for direction in [X, Y, Z] {
            faces[direction] = self.votes(region, [frame; 2], direction, &frames, room, pauses).await?;
            room -= faces[direction].len();
        }
        let count = region.frames.len();
        let next = if frame + 1 < count { Some(frame + 1) } else { self.window.cyclic.then_some(0) };
        let next = next.filter(|&next| !region.is_blank(next));
        if let (Some(next), true) = (next, self.window.frames > 0) {
            // Windows that contain both frames.
            let both: Vec<usize> =
                self.window.frames_around(next, count).into_iter().filter(|t| frames.contains(t)).collect();
            faces[TIME] = self.votes(region, [frame, next], TIME, &both, room, pauses).await?;
        }
        region.clip_to_box(frame, &mut faces, pauses).await;
        faces.iter_mut().for_each(Vec::shrink_to_fit);
        Ok(faces)
    }

    /// Returns the largest difference of the two cluster means in a window of any frame, whatever the threshold, in
    /// steps of the quantised intensities; for the error message when no boundary is found.
    pub async fn largest_step(&self, region: &Region, pauses: &Pauses) -> f64 {
        let mut all = Self::new(Window { threshold: 0.0, ..self.window }, region.frames.len());
        for frame in 0..region.frames.len() {
            all.levels_of(region, frame, pauses).await;
        }
        all.largest
    }

    /// Computes the levels between bright and dark in all windows centred in a frame, unless they are known.
    pub async fn ensure_levels(&mut self, region: &Region, frame: usize, pauses: &Pauses) {
        if self.levels[frame].is_none() {
            self.levels[frame] = Some(self.levels_of(region, frame, pauses).await);
        }
    }

    /// Returns the level between the clusters of the window around a voxel, in a frame whose levels are known; `None`
    /// if the window has no boundary.
    pub fn level_at(&self, region: &Region, frame: usize, [x, y, z]: [usize; 3]) -> Option<u8> {
        let level = self.levels[frame].as_ref()?[Rows::new(region.dims, self.window.half_width).at(y, z) + x];
        (level != NONE).then_some(level)
    }

    /// Computes the level between bright and dark in each window with its centre in a frame, in padded rows (see
    /// [`Rows`]).
    async fn levels_of(&mut self, region: &Region, frame: usize, pauses: &Pauses) -> Vec<u8> {
        let [nx, ny, nz] = region.dims;
        let frames: Vec<&[u8]> =
            self.window.frames_with_contrast(region, frame).iter().map(|&t| &region.frames[t][..]).collect();
        let rows = Rows::new(region.dims, self.window.half_width);
        let mut out = vec![NONE; rows.len()];
        let mut slabs = Slabs::new(region.dims, self.window.half_width, &frames);
        for z in 0..nz {
            for y in 0..ny {
                slabs.move_to_row(y, z);
                let row = rows.at(y, z);
                let mut counts = Histogram::default();
                for x in 0..nx + self.window.half_width {
                    slabs.slide(&mut counts, x);
                    if x >= self.window.half_width {
                        out[row + x - self.window.half_width] = self.level(&counts);
                    }
                }
                pauses.after(nx / VOXELS_PER_UNIT + 1).await;
            }
        }
        out
    }

    /// Returns the level that separates the clusters of a window: voxels with intensities up to it are in the lower
    /// cluster. [`NONE`] if a cluster is too small, or the means of the two differ by no more than the threshold.
    fn level(&mut self, counts: &Histogram) -> u8 {
        let Some((low, high)) = counts.two_means(self.window.threshold) else { return NONE };
        let enough = MIN_SHARE * f64::from(low.count + high.count);
        if f64::from(low.count) <= enough || f64::from(high.count) <= enough {
            return NONE;
        }
        let difference = high.mean() - low.mean();
        self.largest = self.largest.max(difference);
        if difference <= self.window.threshold {
            return NONE;
        }
        ((low.mean() + high.mean()) / 2.0) as u8
    }

    /// Returns the faces that have boundary votes between the voxels of `frame` and the next ones along a direction,
    /// which are in the frame `other`, another one for faces along time. The windows with centres in the frames `frames` are the
    /// ones that vote.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`] if there are more than `most`.
    async fn votes(
        &self,
        region: &Region,
        [frame, other]: [usize; 2],
        direction: usize,
        frames: &[usize],
        most: usize,
        pauses: &Pauses,
    ) -> Result<Vec<Face>, MethodError> {
        let windows = VotingWindows {
            levels: frames.iter().filter_map(|&t| self.levels[t].as_deref()).collect(),
            rows: Rows::new(region.dims, self.window.half_width),
            dims: region.dims,
            direction,
        };
        let [nx, ny, nz] = region.dims;
        let next = [1, nx, nx * ny, 0][direction];
        let end = |axis: usize, n: usize| n - usize::from(direction == axis);
        let (here, there) = (&region.frames[frame], &region.frames[other]);
        let mut faces = Vec::new();
        for (z, y) in (0..end(Z, nz)).flat_map(|z| (0..end(Y, ny)).map(move |y| (z, y))) {
            let start = (z * ny + y) * nx;
            for x in (0..end(X, nx)).step_by(LANES) {
                let lanes = start + x..start + (x + LANES).min(end(X, nx));
                let pairs = Pairs::new(&here[lanes.clone()], &there[lanes.start + next..lanes.end + next]);
                let votes = windows.votes([x, y, z], &pairs);
                for (i, voxel) in lanes.enumerate().filter(|&(i, _)| votes[i] > 0) {
                    let weight = f32::from(votes[i]) / windows.window_count([x + i, y, z]) as f32;
                    faces.push(Face { voxel: voxel as u32, weight });
                }
            }
            if faces.len() > most {
                return Err(too_much_boundary());
            }
            pauses.after(nx / VOXELS_PER_UNIT + 1).await;
        }
        Ok(faces)
    }
}

/// Pairs of neighbouring voxels whose faces are counted at once: the lower quantised intensity of each pair, and the
/// absolute difference.
struct Pairs {
    low: [u8; LANES],
    span: [u8; LANES],
}

impl Pairs {
    fn new(here: &[u8], there: &[u8]) -> Self {
        let mut pairs = Self { low: [0; LANES], span: [0; LANES] };
        for (i, (a, b)) in here.iter().zip(there).enumerate() {
            (pairs.low[i], pairs.span[i]) = (*a.min(b), a.abs_diff(*b));
        }
        pairs
    }
}

/// The windows that vote for the faces between voxels along one direction in one frame.
struct VotingWindows<'a> {
    /// For each frame with centres of windows, the levels between bright and dark in these windows.
    levels: Vec<&'a [u8]>,
    rows: Rows,
    dims: [usize; 3],
    direction: usize,
}

impl VotingWindows<'_> {
    /// Returns the coordinates, along `axis`, of the centres of the windows that contain both voxels at a face, of
    /// which the first has the coordinate `at`.
    fn centres(&self, at: usize, axis: usize) -> std::ops::Range<usize> {
        let first = at + usize::from(self.direction == axis);
        first.saturating_sub(self.rows.half_width)..(at + self.rows.half_width + 1).min(self.dims[axis])
    }

    /// Returns the maximum number of votes for a face: the number of windows that contain both of its voxels.
    fn window_count(&self, at: [usize; 3]) -> usize {
        [X, Y, Z].map(|axis| self.centres(at[axis], axis).len()).iter().product::<usize>() * self.levels.len()
    }

    /// Returns the number of votes for each of the faces after [`LANES`] consecutive voxels along x, from the given one
    /// on.
    fn votes(&self, [x, y, z]: [usize; 3], pairs: &Pairs) -> [u16; LANES] {
        let mut votes = [0u16; LANES];
        if pairs.span == [0; LANES] {
            return votes;
        }
        let half_width = self.rows.half_width;
        let windows = 2 * half_width + usize::from(self.direction != X);
        for level in &self.levels {
            for z in self.centres(z, Z) {
                for y in self.centres(y, Y) {
                    // A row has padding for `half_width` windows before its first voxel.
                    let from = self.rows.at(y, z) + x + usize::from(self.direction == X) - half_width;
                    count(&level[from..from + windows + LANES], windows, pairs, &mut votes);
                }
            }
        }
        votes
    }
}

impl Window {
    /// Returns the frames of a window around a frame, without those that are blank.
    fn frames_with_contrast(&self, region: &Region, frame: usize) -> Vec<usize> {
        let mut frames = self.frames_around(frame, region.frames.len());
        frames.retain(|&t| !region.is_blank(t));
        frames
    }

    /// Returns the indices of the frames within a window's extent in time around `frame`, in a sequence of `count`
    /// frames that may be cyclic.
    pub fn frames_around(&self, frame: usize, count: usize) -> Vec<usize> {
        let half_width = self.frames.min(if self.cyclic { (count - 1) / 2 } else { count });
        let at = |offset: usize| {
            let t = (frame + count + offset).checked_sub(half_width)?;
            if self.cyclic { Some(t % count) } else { t.checked_sub(count).filter(|&t| t < count) }
        };
        (0..=2 * half_width).filter_map(at).collect()
    }
}

/// Counts, for each pair of neighbouring voxels, the windows of a row whose level between bright and dark separates the
/// two voxels, and adds them to `votes`.
#[inline]
fn count(levels: &[u8], windows: usize, pairs: &Pairs, votes: &mut [u16; LANES]) {
    let (low, span) = (u8x16::new(pairs.low), u8x16::new(pairs.span));
    let mut few = u8x16::ZERO;
    // Vectorised by hand: compilers do not do it for wasm, and this is most of the work of the votes.
    for row in levels.windows(LANES).take(windows).filter_map(<[u8]>::first_chunk) {
        few += span.saturating_sub(u8x16::new(*row) - low).min(u8x16::ONE);
    }
    votes.iter_mut().zip(few.to_array()).for_each(|(all, few)| *all += u16::from(few));
}

/// The layout in memory of the windows' levels between bright and dark: rows along x, with padding for windows beyond
/// both ends.
struct Rows {
    ny: usize,
    nz: usize,
    row: usize,
    half_width: usize,
}

impl Rows {
    fn new([nx, ny, nz]: [usize; 3], half_width: usize) -> Self {
        Self { ny, nz, row: nx + 2 * half_width + 2 * LANES, half_width }
    }

    fn len(&self) -> usize {
        self.row * self.ny * self.nz
    }

    /// Returns the index of the level at the first voxel of the row (y, z).
    fn at(&self, y: usize, z: usize) -> usize {
        (z * self.ny + y) * self.row + self.half_width
    }
}

/// A histogram of the quantised intensities of voxels, by which a window is split into clusters.
#[derive(Clone)]
pub(super) struct Histogram([u16; 256]);

impl Default for Histogram {
    fn default() -> Self {
        Self([0; 256])
    }
}

/// The number of voxels in one of the two clusters of a window, and the sum of their quantised intensities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cluster {
    pub count: u32,
    sum: u32,
}

impl Cluster {
    /// Returns the mean of the intensities.
    pub fn mean(self) -> f64 {
        f64::from(self.sum) / f64::from(self.count)
    }
}

impl Histogram {
    /// Adds a voxel with a quantised intensity.
    pub fn count(&mut self, level: u8) {
        self.0[usize::from(level)] += 1;
    }

    fn add(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += b);
    }

    fn subtract(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a -= b);
    }

    /// Returns the quantised intensity of the voxel at a rank, by intensity, from 0 on.
    pub fn at_rank(&self, rank: u32) -> f64 {
        let below = self.0.iter().scan(0u32, |sum, &count| {
            *sum += u32::from(count);
            Some(*sum)
        });
        below.take_while(|&sum| sum <= rank).count() as f64
    }

    /// Returns the number of voxels with quantised intensities in a range, and the sum of these intensities.
    fn within(&self, levels: std::ops::Range<usize>) -> Cluster {
        let mut cluster = Cluster::default();
        for level in levels {
            let count = u32::from(self.0[level]);
            cluster.count += count;
            cluster.sum += count * level as u32;
        }
        cluster
    }

    /// Splits the histogram of a window into two clusters, the lower first, by Lloyd iterations from its lowest and
    /// highest intensity; `None` if these two differ by no more than `threshold`.
    pub fn two_means(&self, threshold: f64) -> Option<(Cluster, Cluster)> {
        let least = self.0.iter().position(|&count| count > 0)?;
        let greatest = self.0.iter().rposition(|&count| count > 0)?;
        if (greatest - least) as f64 <= threshold {
            return None;
        }
        let all = self.within(least..greatest + 1);
        // Intensities up to `end` are nearer to the lower mean.
        let mut end = (least + greatest) / 2;
        let mut low = self.within(least..end + 1);
        for _ in 0..ITERATIONS {
            let high = Cluster { count: all.count - low.count, sum: all.sum - low.sum };
            let middle = ((low.mean() + high.mean()) / 2.0) as usize;
            if middle == end {
                return Some((low, high));
            }
            // Only voxels that change clusters are counted again.
            let changing = self.within(end.min(middle) + 1..end.max(middle) + 1);
            if middle > end {
                low = Cluster { count: low.count + changing.count, sum: low.sum + changing.sum };
            } else {
                low = Cluster { count: low.count - changing.count, sum: low.sum - changing.sum };
            }
            end = middle;
        }
        Some((low, Cluster { count: all.count - low.count, sum: all.sum - low.sum }))
    }
}

/// Histograms of quantised intensities around a row (y, z), one for each x: of the voxels at this x, in all given
/// frames, that are at most a window's half-width from the row along y and along z. The histogram of a window is the
/// sum of those at consecutive x.
struct Slabs<'a> {
    dims: [usize; 3],
    half_width: usize,
    frames: &'a [&'a [u8]],
    at: Option<(usize, usize)>,
    counts: Vec<Histogram>,
}

impl<'a> Slabs<'a> {
    fn new(dims: [usize; 3], half_width: usize, frames: &'a [&'a [u8]]) -> Self {
        Self { dims, half_width, frames, at: None, counts: vec![Histogram::default(); dims[0]] }
    }

    /// Moves the histograms to the row (y, z); incrementally if it follows the current row.
    fn move_to_row(&mut self, y: usize, z: usize) {
        let ny = self.dims[1];
        if y > 0 && self.at == Some((y - 1, z)) {
            if y + self.half_width < ny {
                self.update_row(y + self.half_width, z, |count| *count += 1);
            }
            if y > self.half_width {
                self.update_row(y - self.half_width - 1, z, |count| *count -= 1);
            }
        } else {
            self.counts.iter_mut().for_each(|counts| *counts = Histogram::default());
            for y in y.saturating_sub(self.half_width)..(y + self.half_width + 1).min(ny) {
                self.update_row(y, z, |count| *count += 1);
            }
        }
        self.at = Some((y, z));
    }

    /// Applies `change` to the counts of the intensities of all voxels in row y of the slices within the half-width of
    /// z.
    fn update_row(&mut self, y: usize, z: usize, change: impl Fn(&mut u16)) {
        let [nx, ny, nz] = self.dims;
        for z in z.saturating_sub(self.half_width)..(z + self.half_width + 1).min(nz) {
            let start = (z * ny + y) * nx;
            for frame in self.frames {
                for (counts, &level) in self.counts.iter_mut().zip(&frame[start..start + nx]) {
                    change(&mut counts.0[usize::from(level)]);
                }
            }
        }
    }

    /// Moves the window along x by one voxel: adds the histogram at `x` to that of the window, and subtracts the one
    /// that leaves it.
    fn slide(&self, window: &mut Histogram, x: usize) {
        if let Some(counts) = self.counts.get(x) {
            window.add(counts);
        }
        if x > 2 * self.half_width {
            window.subtract(&self.counts[x - 2 * self.half_width - 1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::working_space::WorkingSpace;
    use super::*;
    use crate::math::{DAffine3, DVec3, Random};
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a test image of two intensities with noise.
    fn region(dims: [usize; 3], frames: usize) -> Region {
        let mut random = Random::new(8);
        let [nx, ny, nz] = dims;
        let value = |i: usize, t: usize, noise: u32| {
            let bright = i % nx + (i / nx % ny) + i / (nx * ny) > 8 + t;
            (if bright { 120 } else { 40 }) + noise as u8
        };
        let frame = |t: usize, random: &mut Random| {
            (0..nx * ny * nz).map(|i| value(i, t, random.below(60))).collect()
        };
        Region {
            dims,
            inner: [[0; 3], dims.map(|n| n - 1)],
            spacing: DVec3::ONE,
            space: WorkingSpace::default(),
            to_space: DAffine3::IDENTITY,
            from_space: DAffine3::IDENTITY,
            frames: (0..frames).map(|t| frame(t, &mut random)).collect(),
            quantum: 1.0,
            threshold: 50.0,
            has_background: false,
            is_blank: Vec::new(),
        }
    }

    /// Returns the voxels of one window that are in the image, as pairs of voxel index and frame, for checking the
    /// votes.
    fn window_at(region: &Region, window: &Window, at: [usize; 3], frame: usize) -> Vec<(usize, usize)> {
        let [nx, ny, nz] = region.dims;
        let near = |a: usize, b: usize| a.abs_diff(b) <= window.half_width;
        let cells = (0..nx * ny * nz)
            .filter(|i| near(i % nx, at[0]) && near(i / nx % ny, at[1]) && near(i / (nx * ny), at[2]));
        cells
            .flat_map(|i| {
                window
                    .frames_around(frame, region.frames.len())
                    .into_iter()
                    .map(move |t| (i, t))
                    .collect::<Vec<_>>()
            })
            .collect()
    }

    /// Computes the level between the clusters in a window with the given intensities, directly as in section 2 of the
    /// paper; `None` if it has no boundary.
    fn level_of(values: &[u8], threshold: f64) -> Option<f64> {
        let (mut low, mut high) = (f64::from(*values.iter().min()?), f64::from(*values.iter().max()?));
        if high - low <= threshold {
            return None;
        }
        loop {
            let middle = (low + high) / 2.0;
            let (a, b): (Vec<f64>, Vec<f64>) =
                values.iter().map(|&v| f64::from(v)).partition(|v| *v <= middle);
            let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
            let next = (mean(&a), mean(&b));
            if next == (low, high) {
                let few = 0.1 * values.len() as f64;
                let passes = a.len() as f64 > few && b.len() as f64 > few && high - low > threshold;
                return passes.then_some(middle);
            }
            (low, high) = next;
        }
    }

    /// The voxels of a window, as pairs of index and frame, and its level between bright and dark, `None` without a
    /// boundary.
    type Checked = (Vec<(usize, usize)>, Option<f64>);

    #[test]
    fn all_windows_that_contain_both_voxels_vote() {
        for (frames, frames_each_way, cyclic) in [(1, 0, false), (4, 1, false), (5, 2, true), (2, 2, true)] {
            let region = region([7, 6, 5], frames);
            let window = Window { half_width: 1, frames: frames_each_way, threshold: 50.0, cyclic };
            let mut voting = BoundaryVoting::new(window, frames);
            let [nx, ny, nz] = region.dims;
            let count = nx * ny * nz;
            let at = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
            let windows: Vec<Vec<Checked>> = (0..frames)
                .map(|t| {
                    let of = |i: usize| {
                        let cells = window_at(&region, &window, at(i), t);
                        let values: Vec<u8> = cells.iter().map(|&(i, t)| region.frames[t][i]).collect();
                        let level = level_of(&values, 50.0);
                        (cells, level)
                    };
                    (0..count).map(of).collect()
                })
                .collect();
            let mut voted = 0;
            for t in 0..frames {
                let faces = finished(voting.faces(&region, t, usize::MAX, &Pauses::default())).unwrap();
                for direction in [X, Y, Z, TIME] {
                    let next = [1, nx, nx * ny, 0][direction];
                    for i in 0..count {
                        if direction != TIME && at(i)[direction] + 1 == region.dims[direction] {
                            continue;
                        }
                        let later = if direction == TIME { t + 1 } else { t };
                        if later == frames && (!cyclic || frames_each_way == 0)
                            || direction == TIME && frames_each_way == 0
                        {
                            continue;
                        }
                        let ends = [(i, t), (i + next, later % frames)];
                        let (mut votes, mut all) = (0, 0);
                        for (cells, level) in windows.iter().flatten() {
                            if ends.iter().all(|end| cells.contains(end)) {
                                all += 1;
                                let [a, b] = ends.map(|(i, t)| f64::from(region.frames[t][i]));
                                votes += usize::from(level.is_some_and(|level| (a <= level) != (b <= level)));
                            }
                        }
                        let found = faces[direction].iter().find(|face| face.voxel as usize == i);
                        let weight = found.map_or(0.0, |face| face.weight);
                        // Two frames of a cyclic sequence have no window in common.
                        let expected = votes as f32 / all.max(1) as f32;
                        assert!((weight - expected).abs() < 1e-6, "{direction} {i} {t}: {weight} {expected}");
                        voted += usize::from(votes > 0);
                    }
                }
            }
            assert!(voted > 50, "{voted}");
        }
    }

    #[test]
    fn a_threshold_above_all_steps_tells_how_large_they_are() {
        let region = region([9, 9, 9], 2);
        let mut voting =
            BoundaryVoting::new(Window { half_width: 2, frames: 1, threshold: 100.0, cyclic: false }, 2);
        let faces = finished(voting.faces(&region, 0, usize::MAX, &Pauses::default())).unwrap();
        assert!(faces.iter().all(Vec::is_empty));
        for threshold in [100.0, 1e6] {
            voting.window.threshold = threshold;
            let largest = finished(voting.largest_step(&region, &Pauses::default()));
            assert!(largest > 60.0 && largest <= 100.0, "{largest}");
        }
    }
}
