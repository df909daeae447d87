//! Closes a cavity: muscles within it, and the furrows between those along its wall, count as blood, as in clinical
//! measurements.
//!
//! The voxels of the cavity, by the levels of the windows, are closed by a ball: of what a ball rolled about outside of them
//! cannot reach, the dark voxels are filled with the intensity of the blood around them, before the votes. A convex cavity
//! has none, whatever the radius of the ball.

use super::labelling::{UNKNOWN, VoxelBox, extend_to_all};
use super::lattice::Lattice;
use super::organ::{Organ, depths, order};
use super::presence::inside_voxels;
use super::region::{MAX_LEVEL, Region};
use super::vote::BoundaryVoting;
use super::{Component, SurfaceTracker};
use crate::pauses::Pauses;
use serde::{Deserialize, Serialize};

/// Radius of the ball, as a share of the radius of the largest ball within the cavity in any frame: muscles up to twice as
/// thick are filled. With a smaller one, some are left; with a larger one, bends of an object are filled that are no
/// muscles.
const BALL: f32 = 0.7;

/// Depth below the closed surface, in units of the shortest side of a voxel, that filled voxels reach somewhere: others are
/// the roughness that noise leaves on the surface, and filling all of them would inflate it.
const MIN_DEPTH: f32 = 1.25;

/// Distance from filled voxels, in units of the shortest side of a voxel, up to which voxels of the cavity are filled too:
/// their intensities are partly those of muscle.
const RIM: f32 = 1.5;

/// Edge threshold, in standard deviations of the noise, below which intensities are smoothed, along axes with sides of voxels
/// up to this multiple of the shortest.
const MANY_NOISES: f64 = 6.0;
const LONGEST: f64 = 1.5;

/// Highest quantised intensity of a filled voxel, which is the highest of all.
pub(super) const MAX_FILLED: u8 = MAX_LEVEL as u8;

/// The quantised intensity of a voxel that was filled, and of the voxel before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Filled {
    /// Index of the voxel in the region.
    pub voxel: u32,
    /// The intensity that it has now.
    pub level: u8,
    /// The intensity that it had.
    pub before: u8,
}

impl Region {
    /// Gives filled voxels of each frame their intensities.
    pub fn fill(&mut self, filled: &[Vec<Filled>]) {
        for (frame, list) in self.frames.iter_mut().zip(filled) {
            list.iter().for_each(|one| frame[one.voxel as usize] = one.level);
        }
    }

    /// Gives filled voxels of each frame back the intensities that they had.
    pub fn unfill(&mut self, filled: &[Vec<Filled>]) {
        for (frame, list) in self.frames.iter_mut().zip(filled) {
            list.iter().for_each(|one| frame[one.voxel as usize] = one.before);
        }
    }

    /// Returns the voxels of the region as a lattice.
    pub fn lattice(&self) -> Lattice {
        Lattice { dims: self.dims, spacing: self.spacing.to_array() }
    }
}

impl SurfaceTracker {
    /// Finds the voxels that have to be filled for the cavity to be closed, by frame. `voting` has the parameters of the
    /// votes; it finds the levels.
    pub(super) async fn voxels_to_fill(
        &self,
        voting: &mut BoundaryVoting,
        pauses: &Pauses,
    ) -> Vec<Vec<Filled>> {
        let frames = self.frames();
        let mut filled = vec![Vec::new(); frames];
        let Some((first, organ, mask)) = self.first_cavity(voting, pauses).await else { return filled };
        let mut radius = organ.radius;
        let mut masks = vec![None; frames];
        masks[first] = Some(mask);
        for [next, from] in order(first, frames, self.params.cyclic) {
            let Some(before) = &masks[from] else { continue };
            let bright = self.bright_voxels(voting, next, pauses).await;
            masks[next] = organ.next(&bright, before, pauses).await.map(|(mask, deepest)| {
                radius = radius.max(deepest);
                mask
            });
        }
        let ball = BALL * radius;
        for (frame, mask) in masks.iter().enumerate() {
            if let Some(mask) = mask {
                filled[frame] = closed(&self.region, frame, mask, ball, pauses).await;
            }
        }
        filled
    }

    /// Returns the first frame with bright voxels where the tracked component is, and the cavity there.
    async fn first_cavity(
        &self,
        voting: &mut BoundaryVoting,
        pauses: &Pauses,
    ) -> Option<(usize, Organ, Vec<bool>)> {
        let lattice = self.region.lattice();
        for frame in 0..self.frames() {
            let bright = self.bright_voxels(voting, frame, pauses).await;
            let Some(seed) = self.seed(&lattice, &bright, pauses).await else { continue };
            if let Some((organ, mask)) = Organ::around(lattice, &bright, seed, pauses).await {
                return Some((frame, organ, mask));
            }
        }
        None
    }

    /// Returns a bright voxel in the component that is tracked; `None` if there are no bright ones.
    async fn seed(&self, lattice: &Lattice, bright: &[bool], pauses: &Pauses) -> Option<usize> {
        let depth = depths(lattice, bright, pauses).await;
        let deepest = |is_in: &dyn Fn(usize) -> bool| {
            let voxels = (0..depth.len()).filter(|&i| bright[i] && is_in(i));
            voxels.reduce(|best, i| if depth[i] > depth[best] { i } else { best })
        };
        if self.start.vertex_count() > 0 {
            let mut surface = self.start.clone();
            self.region.space.enter(&mut surface);
            let inside = inside_voxels(&self.region, &surface.to_triangles());
            return deepest(&|i| inside.contains(i));
        }
        match self.component {
            Component::Nearest(p) => {
                let at = self.region.to_local(self.region.space.point(p).as_vec3());
                let mut point = vec![false; bright.len()];
                point[self.region.index(self.region.nearest(at))] = true;
                let away = lattice.distances(&point, pauses).await;
                let voxels = (0..bright.len()).filter(|&i| bright[i]);
                voxels.reduce(|best, i| if away[i] < away[best] { i } else { best })
            }
            Component::Largest => {
                let (parts, count) = lattice.parts(bright, pauses).await;
                let mut sizes = vec![0usize; count + 1];
                parts.iter().filter(|&&part| part > 0).for_each(|&part| sizes[part as usize] += 1);
                let largest =
                    (1..=count).fold(0, |best, part| if sizes[part] > sizes[best] { part } else { best });
                deepest(&|i| parts[i] as usize == largest)
            }
        }
    }

    /// Returns the voxels of the box that are brighter than the level between bright and dark of the nearest window with a
    /// boundary.
    async fn bright_voxels(&self, voting: &mut BoundaryVoting, frame: usize, pauses: &Pauses) -> Vec<bool> {
        let region = &self.region;
        let mut bright = vec![false; region.frames[frame].len()];
        if region.is_blank(frame) {
            return bright;
        }
        voting.ensure_levels(region, frame, pauses).await;
        let voxels = VoxelBox { ends: region.inner };
        let known = |i: usize| voting.level_at(region, frame, voxels.at(i)).map_or(UNKNOWN, f64::from);
        let known = (0..voxels.len()).map(known).collect();
        pauses.now().await;
        let Some(levels) = extend_to_all(known, voxels.dims(), pauses).await else { return bright };
        pauses.now().await;
        let lattice = region.lattice();
        // Where noise is weak, smoothing would only make narrow parts darker.
        let is_noisy = self.image.noise * MANY_NOISES > self.params.threshold;
        let longest = if is_noisy { LONGEST * lattice.shortest_side() } else { 0.0 };
        let blurred = lattice.blurred(&region.frames[frame], longest, pauses).await;
        for (i, level) in levels.into_iter().enumerate() {
            let voxel = region.index(voxels.at(i));
            bright[voxel] = f64::from(blurred[voxel]) > level;
        }
        pauses.now().await;
        bright
    }
}

/// Returns the voxels to be filled for `mask`, the voxels of a cavity in a frame, to be closed by a ball of the given
/// radius.
async fn closed(region: &Region, frame: usize, mask: &[bool], ball: f32, pauses: &Pauses) -> Vec<Filled> {
    let Some(window) = Window::around(region, frame, mask, ball) else { return Vec::new() };
    let (lattice, side) = (&window.lattice, window.lattice.shortest_side() as f32);
    let depth = window.depths_below_closed(ball, pauses).await;
    let muscle = window.muscle(&depth, pauses).await;
    let from_muscle = lattice.distances(&muscle, pauses).await;
    let blood = window.blood(ball, pauses).await;
    let mut filled = Vec::new();
    for i in (0..lattice.len()).filter(|&i| depth[i] > -0.5 * side && from_muscle[i] <= RIM * side) {
        let Some(voxel) = window.in_region(region, i) else { continue };
        let before = window.levels[i];
        // The closed surface is blurred over one voxel, as boundaries of the image are.
        let share = (0.5 + depth[i] / side).clamp(0.0, 1.0);
        let level = f32::from(before) + share * (blood[i] - f32::from(before));
        let level = (level + 0.5).clamp(f32::from(before), f32::from(MAX_FILLED)) as u8;
        if level > before {
            filled.push(Filled { voxel: voxel as u32, level, before });
        }
    }
    filled
}

/// The part of a frame around a cavity, which may extend beyond the region.
struct Window {
    lattice: Lattice,
    /// Number of voxels by which the first voxel of the window is before that of the region, negative if it is after it.
    before: [isize; 3],
    mask: Vec<bool>,
    /// Quantised intensities, 0 beyond the region.
    levels: Vec<u8>,
}

impl Window {
    /// Copies the part within the radius of a ball of a mask; `None` if that is empty.
    fn around(region: &Region, frame: usize, mask: &[bool], ball: f32) -> Option<Self> {
        let whole = region.lattice();
        let [low, high] = whole.bounds(mask)?;
        let margin = [0, 1, 2].map(|k| (f64::from(ball) / whole.spacing[k]) as usize + 2);
        let dims = [0, 1, 2].map(|k| high[k] - low[k] + 1 + 2 * margin[k]);
        let before = [0, 1, 2].map(|k| margin[k] as isize - low[k] as isize);
        let lattice = Lattice { dims, spacing: whole.spacing };
        let mut window =
            Self { lattice, before, mask: vec![false; lattice.len()], levels: vec![0; lattice.len()] };
        for i in 0..lattice.len() {
            if let Some(voxel) = window.in_region(region, i) {
                (window.mask[i], window.levels[i]) = (mask[voxel], region.frames[frame][voxel]);
            }
        }
        Some(window)
    }

    /// Returns the index in the region of a voxel; `None` beyond it.
    fn in_region(&self, region: &Region, index: usize) -> Option<usize> {
        let at = self.lattice.at(index);
        let at = [0, 1, 2].map(|k| at[k] as isize - self.before[k]);
        let is_inside = (0..3).all(|k| at[k] >= 0 && (at[k] as usize) < region.dims[k]);
        is_inside.then(|| region.index(at.map(|i| i as usize)))
    }

    /// Returns the depth of each voxel's centre below the surface of the cavity closed by a ball, negative outside of it.
    async fn depths_below_closed(&self, ball: f32, pauses: &Pauses) -> Vec<f32> {
        let away = self.lattice.distances(&self.mask, pauses).await;
        // Where the centre of a ball cannot be that touches no voxel of the cavity.
        let blocked: Vec<bool> = away.iter().map(|&away| away <= ball).collect();
        let mut depth = depths(&self.lattice, &blocked, pauses).await;
        depth.iter_mut().for_each(|depth| *depth -= ball);
        depth
    }

    /// Returns the dark voxels within the closed cavity, but for the roughness of its surface; `depth` are those below the
    /// closed surface.
    async fn muscle(&self, depth: &[f32], pauses: &Pauses) -> Vec<bool> {
        let side = self.lattice.shortest_side() as f32;
        let is_dark = |i: usize| !self.mask[i] && depth[i] > 0.0;
        let deep: Vec<bool> = (0..depth.len()).map(|i| is_dark(i) && depth[i] >= MIN_DEPTH * side).collect();
        let away = self.lattice.distances(&deep, pauses).await;
        (0..depth.len()).map(|i| is_dark(i) && away[i] <= RIM * side).collect()
    }

    /// Returns the mean intensity of the cavity within a ball's radius along each axis of each voxel; 0 without any.
    async fn blood(&self, ball: f32, pauses: &Pauses) -> Vec<f32> {
        let bright = |i: usize| if self.mask[i] { f32::from(self.levels[i]) } else { 0.0 };
        let mut sums: Vec<f32> = (0..self.mask.len()).map(bright).collect();
        let mut counts: Vec<f32> = self.mask.iter().map(|&is_in| f32::from(u8::from(is_in))).collect();
        let reach = self.lattice.spacing.map(|side| (f64::from(ball) / side) as usize + 2);
        for values in [&mut sums, &mut counts] {
            self.lattice.sum_boxes(values, reach, pauses).await;
        }
        sums.iter().zip(&counts).map(|(sum, count)| if *count > 0.5 { sum / count } else { 0.0 }).collect()
    }
}
