//! Proposes the options of a tracker, from a point in an object or from nothing but the sequence.
//!
//! Balls around the point grow until the intensities in them, in all frames, are of two kinds. What is brighter than
//! halfway between the point and the darker kind is bright, and the object is the bright region around the point, followed
//! through all frames. Without a point, the object that moves most in the sequence is searched for.

use super::coarse::CoarseSequence;
use super::lattice::Lattice;
use super::motion::most_moving;
use super::organ::{Organ, order};
use super::region::{MAX_LEVEL, voxels_around};
use super::{Proposal, Query, SurfaceTracker};
use crate::math::DVec3;
use crate::methods::MethodError;
use crate::pauses::{Pauses, finished};
use crate::volume::Volume;

/// Radius of the first ball around a point, in units of the shortest side of a voxel, and the ratio of each to the next.
const FIRST_BALL: f64 = 3.0;
const NEXT_BALL: f64 = 1.25;

/// Largest number of balls: the last has 4,000 times the radius of the first.
const BALLS: usize = 38;

/// Shares of the dark voxels of a ball between which there are two kinds of them: fewer are muscles within a cavity, more
/// the surroundings of a small object in those of a ball.
const DARK_SHARE: std::ops::RangeInclusive<f64> = 0.2..=0.9;

/// Smallest difference of the means of the two kinds, in standard deviations of the noise and as a share of the range of
/// intensities: noise alone differs by 1.6 standard deviations, flow in a cavity by a tenth of the range.
const MIN_STEP_IN_NOISE: f64 = 4.0;
const MIN_STEP: f64 = 0.1;

/// Half the side of the box around the point in which the object is searched for, in units of the radius of the ball whose
/// voxels are of two kinds: an object is up to that much longer than it is wide.
const WINDOW: f64 = 5.0;

/// The proposed threshold as a share of the mean step between the object and its surroundings, which partial volumes make
/// smaller. With a smaller share, the steps between muscle and lung count as well, and the surface is that of both muscle and
/// blood.
const THRESHOLD: f64 = 0.6;

/// The proposed threshold in units of the step between two kinds of surroundings, as muscle and lung, whose means lie closer
/// than they do; and most of it as a share of the step between the object and its surroundings, beyond which parts of the
/// object are lost.
const THRESHOLD_AROUND: f64 = 1.05;
const MOST_OF_STEP: f64 = 0.9;

/// Margin between the object and the sides of the box, as a share of the extent of the object, and in voxels. The tracker
/// finds boundaries in windows of five voxels.
const MARGIN: f64 = 0.2;
const MARGIN_IN_VOXELS: usize = 3;

/// Number of the six ends of the image at which an object has gone on into its surroundings.
const LEAK: usize = 4;

/// Distance from the object, in units of the shortest side of a voxel, up to which dark voxels are its surroundings.
const SURROUNDINGS: f32 = 3.0;

impl SurfaceTracker {
    /// Proposes the options of a tracker: the box, the component and the edge threshold, from the whole sequence.
    ///
    /// The object is bright, in dark surroundings. The box is that of the object in all frames, with a margin, so that it
    /// touches no side of the box unless the volume ends there, or the given box. Slices far apart should have others
    /// inserted between them before, as for tracking.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the reason why there is no proposal: a volume of one frame (`volume`); a point
    /// or a box outside of it, a point that is not in a bright object (`point`), a box in which nothing moves (`box`), or a
    /// volume (`volume`); [`MethodError::Volume`] if memory does not suffice.
    pub fn propose(volume: &Volume, query: Query) -> Result<Proposal, MethodError> {
        finished(Self::propose_in_slices(volume.clone(), query))
    }

    /// Proposes options as [`Self::propose`] does, with pauses.
    ///
    /// # Errors
    /// As [`Self::propose`].
    pub async fn propose_in_slices(volume: Volume, query: Query) -> Result<Proposal, MethodError> {
        if volume.frames() < 2 {
            return Err(MethodError::invalid("volume", "must have at least two frames, got one"));
        }
        let pauses = Pauses::default();
        let volume = volume.without_fill_values(&pauses).await?;
        let last = volume.dims().map(|n| n - 1);
        let ends = match query {
            Query::Box(corners) => voxels_around(&volume, corners)?,
            _ => [[0; 3], last],
        };
        let sequence = CoarseSequence::read(&volume, ends, &pauses).await?;
        let (voxel, frame) = match query {
            Query::Point { at, frame } => (given_voxel(&sequence, &volume, at, frame)?, frame),
            Query::Box(_) | Query::Moving => most_moving(&sequence, parameter(query), &pauses).await?,
        };
        let levels = Levels::around(&sequence, voxel, frame, &pauses).await;
        let levels = levels.ok_or_else(|| no_object(query))?;
        let found = Found::searched(&sequence, voxel, frame, &levels, &pauses).await;
        let found = found.ok_or_else(|| no_object(query))?;
        if found.ends_of_image(&sequence) >= LEAK {
            return Err(everywhere(query));
        }
        Ok(Proposal {
            bounds: found.bounds(&sequence, ends),
            component: sequence.point_of(&volume, found.middle),
            frame: found.frame,
            threshold: found.threshold(&sequence),
        })
    }
}

/// Returns the name of what a query is about.
fn parameter(query: Query) -> &'static str {
    match query {
        Query::Point { .. } => "point",
        Query::Box(_) => "box",
        Query::Moving => "volume",
    }
}

fn no_object(query: Query) -> MethodError {
    let problem = match query {
        Query::Point { .. } => {
            "is not in a bright object with darker surroundings: give a point in the middle of one, in a frame in \
             which it is bright; dark objects cannot be tracked"
        }
        _ => "has no bright object that moves: give a point in it",
    };
    MethodError::invalid(parameter(query), problem)
}

fn everywhere(query: Query) -> MethodError {
    let problem = "the bright region goes on through most of the image: give a box around the object";
    MethodError::invalid(parameter(query), problem)
}

/// Returns the voxel of a given point, after checking the point and its frame.
fn given_voxel(
    sequence: &CoarseSequence,
    volume: &Volume,
    at: DVec3,
    frame: usize,
) -> Result<usize, MethodError> {
    if frame >= volume.frames() {
        let problem = format!("must be below {}, the number of frames, got {frame}", volume.frames());
        return Err(MethodError::invalid("frame", problem));
    }
    if !at.is_finite() {
        return Err(MethodError::invalid("point", format!("must be three finite numbers, got {at}")));
    }
    sequence.voxel_at(volume, at).ok_or_else(|| {
        let problem = format!("lies outside the volume, got {at}");
        MethodError::invalid("point", problem)
    })
}

/// The quantised intensities that separate an object from its surroundings, and the part of the sequence that it is in.
struct Levels {
    /// Intensities above it are bright.
    level: f32,
    /// The radius of the ball around the point in which there are bright and dark voxels.
    ball: f64,
}

impl Levels {
    /// Finds the levels around a voxel of a frame; `None` if no ball around it has voxels of two kinds, of which its own is
    /// the brighter.
    async fn around(sequence: &CoarseSequence, voxel: usize, frame: usize, pauses: &Pauses) -> Option<Self> {
        let own = median_around(sequence, voxel, frame);
        let least = (MIN_STEP_IN_NOISE * sequence.noise).max(MIN_STEP * MAX_LEVEL);
        let mut ball = FIRST_BALL * sequence.lattice.shortest_side();
        for _ in 0..BALLS {
            let counts = ball_counts(sequence, voxel, ball, pauses).await;
            let found = two_kinds(&counts).filter(|kinds| {
                kinds.bright - kinds.dark >= least
                    && DARK_SHARE.contains(&kinds.dark_share)
                    && own > (kinds.bright + kinds.dark) / 2.0
            });
            if let Some(kinds) = found {
                return Some(Self { level: ((own + kinds.dark) / 2.0) as f32, ball });
            }
            ball *= NEXT_BALL;
        }
        None
    }
}

/// Returns the median of the quantised intensities of a voxel and those around it.
fn median_around(sequence: &CoarseSequence, voxel: usize, frame: usize) -> f64 {
    let lattice = &sequence.lattice;
    let mut values: Vec<u8> =
        lattice.around(lattice.at(voxel), 1).into_iter().map(|i| sequence.frames[frame][i]).collect();
    values.sort_unstable();
    values.get(values.len() / 2).map_or(0.0, |&value| f64::from(value))
}

/// Returns the numbers of voxels in a ball around one, in all frames, by their quantised intensities.
async fn ball_counts(sequence: &CoarseSequence, voxel: usize, radius: f64, pauses: &Pauses) -> Vec<u64> {
    let Lattice { dims: [nx, ny, nz], spacing } = sequence.lattice;
    let middle = sequence.lattice.at(voxel);
    let mut counts = vec![0; 256];
    for z in 0..nz {
        let across_z = z.abs_diff(middle[2]) as f64 * spacing[2];
        for y in 0..ny {
            let across_y = y.abs_diff(middle[1]) as f64 * spacing[1];
            let square = radius * radius - across_y * across_y - across_z * across_z;
            if square < 0.0 {
                continue;
            }
            let reach = (libm::sqrt(square) / spacing[0]) as usize;
            let first = sequence.lattice.index([middle[0].saturating_sub(reach), y, z]);
            let last = sequence.lattice.index([(middle[0] + reach).min(nx - 1), y, z]);
            for frame in &sequence.frames {
                frame[first..=last].iter().for_each(|&value| counts[usize::from(value)] += 1);
            }
            pauses.after(sequence.frames.len() * (last - first + 1) / 128 + 1).await;
        }
    }
    counts
}

/// The two kinds of voxels of a part of a sequence.
pub(super) struct Kinds {
    /// The mean quantised intensity of the darker ones.
    pub dark: f64,
    /// The mean quantised intensity of the brighter ones.
    pub bright: f64,
    /// The share of the darker ones.
    pub dark_share: f64,
}

/// Splits voxels in two kinds by their quantised intensities, so that the variance between the kinds is largest (Otsu
/// 1979); `None` if all are the same.
pub(super) fn two_kinds(counts: &[u64]) -> Option<Kinds> {
    let all: u64 = counts.iter().sum();
    let total: u64 = counts.iter().enumerate().map(|(level, count)| level as u64 * count).sum();
    let (mut count, mut sum) = (0, 0);
    let mut best: Option<(f64, Kinds)> = None;
    for (level, &more) in counts.iter().enumerate() {
        (count, sum) = (count + more, sum + level as u64 * more);
        if count == 0 || count == all {
            continue;
        }
        let (dark, bright) = (sum as f64 / count as f64, (total - sum) as f64 / (all - count) as f64);
        let dark_share = count as f64 / all as f64;
        let between = dark_share * (1.0 - dark_share) * (bright - dark) * (bright - dark);
        if best.as_ref().is_none_or(|(most, _)| between > *most) {
            best = Some((between, Kinds { dark, bright, dark_share }));
        }
    }
    best.map(|(_, kinds)| kinds)
}

/// An object that was followed through a sequence.
struct Found {
    /// The first frame that has the object, and a voxel in its middle there.
    frame: usize,
    middle: usize,
    /// The first and the last voxel of the object in any frame, of the sequence.
    ends: [[usize; 3]; 2],
    /// The mean quantised intensities of the object and of what is dark around it, in all frames.
    inside: f64,
    outside: f64,
    /// The step between the two kinds of what is dark in the box around the object.
    step_around: f64,
    /// Whether it moves out of the window.
    leaves: bool,
}

impl Found {
    /// Follows the object around a voxel of a frame through all others, in a window that grows while it moves out of it;
    /// `None` if there is none.
    async fn searched(
        sequence: &CoarseSequence,
        voxel: usize,
        frame: usize,
        levels: &Levels,
        pauses: &Pauses,
    ) -> Option<Self> {
        let mut reach = WINDOW * levels.ball;
        loop {
            let window = Window::around(sequence, voxel, reach);
            let found = Self::followed(sequence, window, [voxel, frame], levels, pauses).await;
            match found {
                Some(found) if found.leaves => reach *= 2.0,
                found => return found,
            }
        }
    }

    async fn followed(
        sequence: &CoarseSequence,
        window: Window,
        [voxel, frame]: [usize; 2],
        levels: &Levels,
        pauses: &Pauses,
    ) -> Option<Self> {
        let frames = sequence.frames.len();
        let bright = window.bright(sequence, frame, levels.level, pauses).await;
        let (organ, mask) =
            Organ::around(window.lattice, &bright, window.index(sequence, voxel)?, pauses).await?;
        let mut masks = vec![None; frames];
        let mut sums = Sums::default();
        sums.add(&window, sequence, frame, [&bright, &mask], pauses).await;
        masks[frame] = Some(mask);
        for [next, from] in order(frame, frames, false) {
            let Some(before) = &masks[from] else { continue };
            let bright = window.bright(sequence, next, levels.level, pauses).await;
            let mask = organ.next(&bright, before, pauses).await.map(|(mask, _)| mask);
            if let Some(mask) = &mask {
                sums.add(&window, sequence, next, [&bright, mask], pauses).await;
            }
            masks[next] = mask;
        }
        let (first, mask) = masks.iter().enumerate().find_map(|(t, mask)| Some((t, mask.as_ref()?)))?;
        let depth = super::organ::depths(&window.lattice, mask, pauses).await;
        let middle = (0..depth.len()).fold(0, |best, i| if depth[i] > depth[best] { i } else { best });
        let middle = sequence.lattice.index(window.in_sequence(window.lattice.at(middle)));
        let union: Vec<bool> =
            (0..window.lattice.len()).map(|i| masks.iter().flatten().any(|mask| mask[i])).collect();
        let ends = window.lattice.bounds(&union)?;
        let [inside, outside] = sums.means()?;
        let step_around = window.step_around(sequence, &masks, ends, levels.level, pauses).await;
        let leaves = window.is_left(sequence, &masks, frame);
        let ends = ends.map(|at| window.in_sequence(at));
        Some(Self { frame: first, middle, ends, inside, outside, step_around, leaves })
    }

    /// Returns the number of ends of the image that the object reaches, along axes with more than one voxel.
    fn ends_of_image(&self, sequence: &CoarseSequence) -> usize {
        let [first, last] = self.ends;
        let dims = sequence.lattice.dims;
        let reached = |k: usize| usize::from(first[k] == 0) + usize::from(last[k] + 1 == dims[k]);
        (0..3).filter(|&k| dims[k] > 1).map(reached).sum()
    }

    /// Returns the first and the last voxel of the volume in the box with the object and a margin, within `within`.
    fn bounds(&self, sequence: &CoarseSequence, within: [[usize; 3]; 2]) -> [[usize; 3]; 2] {
        let [first, last] = self.ends.map(|at| sequence.in_volume(at));
        // Beyond the last voxel that was kept are those that were left out.
        let next = sequence.in_volume(self.ends[1].map(|i| i + 1));
        let margin = |k: usize| margin(last[k] - first[k] + 1) + next[k] - last[k] - 1;
        let low = [0, 1, 2].map(|k| first[k].saturating_sub(margin(k)).max(within[0][k]));
        [low, [0, 1, 2].map(|k| (last[k] + margin(k)).min(within[1][k]))]
    }

    /// Returns the edge threshold, in units of intensity.
    fn threshold(&self, sequence: &CoarseSequence) -> f64 {
        let step = self.inside - self.outside;
        let around = THRESHOLD_AROUND * self.step_around;
        // No threshold excludes higher steps and keeps the object.
        let around = if around <= MOST_OF_STEP * step { around } else { 0.0 };
        (THRESHOLD * step).max(around).max(2.5 * sequence.noise) * sequence.quantum
    }
}

/// Returns the margin between an object of an extent and a side of the box, in voxels.
fn margin(extent: usize) -> usize {
    (libm::ceil(MARGIN * extent as f64) as usize).max(MARGIN_IN_VOXELS)
}

/// Sums of the quantised intensities of an object and of its surroundings.
#[derive(Default)]
struct Sums {
    inside: [f64; 2],
    outside: [f64; 2],
}

impl Sums {
    /// Adds those of a frame, with its bright voxels and those of the object.
    async fn add(
        &mut self,
        window: &Window,
        sequence: &CoarseSequence,
        frame: usize,
        [bright, mask]: [&[bool]; 2],
        pauses: &Pauses,
    ) {
        let away = window.lattice.distances(mask, pauses).await;
        let reach = SURROUNDINGS * window.lattice.shortest_side() as f32;
        for (i, value) in window.values(sequence, frame).enumerate() {
            let sum = match (mask[i], bright[i]) {
                (true, _) => &mut self.inside,
                (false, false) if away[i] <= reach => &mut self.outside,
                _ => continue,
            };
            *sum = [sum[0] + f64::from(value), sum[1] + 1.0];
        }
    }

    /// Returns the mean intensities inside and outside; `None` if one of them has no voxels.
    fn means(&self) -> Option<[f64; 2]> {
        let mean = |[sum, count]: [f64; 2]| (count > 0.0).then(|| sum / count);
        Some([mean(self.inside)?, mean(self.outside)?])
    }
}

/// The part of a sequence in which an object is searched for.
struct Window {
    lattice: Lattice,
    first: [usize; 3],
}

impl Window {
    fn around(sequence: &CoarseSequence, voxel: usize, reach: f64) -> Self {
        let Lattice { dims, spacing } = sequence.lattice;
        let middle = sequence.lattice.at(voxel);
        let voxels = |k: usize| (reach / spacing[k]) as usize + 1;
        let first = [0, 1, 2].map(|k| middle[k].saturating_sub(voxels(k)));
        let last = [0, 1, 2].map(|k| middle[k].saturating_add(voxels(k)).min(dims[k] - 1));
        Self { lattice: Lattice { dims: [0, 1, 2].map(|k| last[k] - first[k] + 1), spacing }, first }
    }

    /// Whether the object reaches a side of the window that it does not reach in frame `first`, and beyond which the sequence
    /// goes on: it moves out of the window. Where it reaches the side in that frame, it goes on into its surroundings.
    fn is_left(&self, sequence: &CoarseSequence, masks: &[Option<Vec<bool>>], first: usize) -> bool {
        let reached = |mask: &Option<Vec<bool>>| {
            let ends = mask.as_ref().and_then(|mask| self.lattice.bounds(mask));
            [0, 1, 2].map(|k| {
                let (n, from) = (self.lattice.dims[k], self.first[k]);
                let goes_on = [from > 0, from + n < sequence.lattice.dims[k]];
                ends.map_or([false; 2], |[low, high]| {
                    [low[k] == 0 && goes_on[0], high[k] + 1 == n && goes_on[1]]
                })
            })
        };
        let before = reached(&masks[first]);
        masks.iter().map(reached).any(|now| (0..3).any(|k| (0..2).any(|end| now[k][end] && !before[k][end])))
    }

    fn in_sequence(&self, at: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|k| self.first[k] + at[k])
    }

    /// Returns the index in the window of a voxel of the sequence; `None` if it is outside.
    fn index(&self, sequence: &CoarseSequence, voxel: usize) -> Option<usize> {
        let at = sequence.lattice.at(voxel);
        let is_inside =
            (0..3).all(|k| at[k] >= self.first[k] && at[k] < self.first[k] + self.lattice.dims[k]);
        is_inside.then(|| self.lattice.index([0, 1, 2].map(|k| at[k] - self.first[k])))
    }

    /// Returns the quantised intensities of a frame in the window.
    fn values<'a>(&'a self, sequence: &'a CoarseSequence, frame: usize) -> impl Iterator<Item = u8> + 'a {
        let [nx, ny, nz] = self.lattice.dims;
        let rows = (0..nz).flat_map(move |z| (0..ny).map(move |y| [0, y, z]));
        rows.flat_map(move |at| {
            let start = sequence.lattice.index(self.in_sequence(at));
            sequence.frames[frame][start..start + nx].iter().copied()
        })
    }

    /// Returns the difference of the means of the two kinds of dark voxels, in the box around the object between the voxels
    /// `ends` in all frames; 0 if there is one kind only.
    async fn step_around(
        &self,
        sequence: &CoarseSequence,
        masks: &[Option<Vec<bool>>],
        ends: [[usize; 3]; 2],
        level: f32,
        pauses: &Pauses,
    ) -> f64 {
        let [first, last] = ends;
        let is_near = |at: [usize; 3]| {
            (0..3).all(|k| {
                let margin = margin(last[k] - first[k] + 1);
                (first[k].saturating_sub(margin)..=last[k] + margin).contains(&at[k])
            })
        };
        let near: Vec<bool> = (0..self.lattice.len()).map(|i| is_near(self.lattice.at(i))).collect();
        let mut counts = vec![0; 256];
        for (frame, mask) in masks.iter().enumerate().filter_map(|(t, mask)| Some((t, mask.as_ref()?))) {
            for (i, value) in self.values(sequence, frame).enumerate() {
                if near[i] && !mask[i] && f32::from(value) <= level {
                    counts[usize::from(value)] += 1;
                }
            }
            pauses.after(near.len() / 128 + 1).await;
        }
        two_kinds(&counts).map_or(0.0, |kinds| kinds.bright - kinds.dark)
    }

    /// Returns the voxels of a frame that are brighter than a level, smoothed.
    async fn bright(
        &self,
        sequence: &CoarseSequence,
        frame: usize,
        level: f32,
        pauses: &Pauses,
    ) -> Vec<bool> {
        let values: Vec<u8> = self.values(sequence, frame).collect();
        let longest = BLUR * self.lattice.shortest_side();
        let blurred = self.lattice.blurred(&values, longest, pauses).await;
        blurred.into_iter().map(|value| value > level).collect()
    }
}

/// Longest side of voxels along axes along which intensities are smoothed, in units of the shortest side.
pub(super) const BLUR: f64 = 1.5;
