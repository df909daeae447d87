//! Finds what moves most in a sequence: where intensities vary with time.

use super::coarse::CoarseSequence;
use super::organ::depths;
use super::propose::{BLUR, two_kinds};
use super::region::MAX_LEVEL;
use crate::methods::MethodError;
use crate::pauses::Pauses;

/// Smallest variation with time, as a share of the range of intensities and in standard deviations of the noise, that
/// shows motion.
const MIN_MOTION: f32 = 0.05;
const MIN_MOTION_IN_NOISE: f32 = 1.0;

/// Share of the strongest variation from which voxels move.
const MOVING: f32 = 0.4;

/// Share of the voxels whose variation is stronger than the strongest that counts.
const OUTLIERS: f64 = 1e-3;

/// Returns a voxel in the middle of the bright object that moves most, and a frame in which it is bright there.
///
/// # Errors
/// [`MethodError::InvalidArgument`] naming `parameter` if nothing moves, or what moves is dark.
pub(super) async fn most_moving(
    sequence: &CoarseSequence,
    parameter: &'static str,
    pauses: &Pauses,
) -> Result<(usize, usize), MethodError> {
    let variation = variation(sequence, pauses).await;
    let strongest = strongest(&variation);
    let least = (MIN_MOTION * MAX_LEVEL as f32).max(MIN_MOTION_IN_NOISE * sequence.noise as f32);
    let problem = "has nothing that moves enough to be found: give a point in the object";
    if strongest < least {
        return Err(MethodError::invalid(parameter, problem));
    }
    let lattice = &sequence.lattice;
    let moving: Vec<bool> = variation.iter().map(|&value| value >= MOVING * strongest).collect();
    // The walls of an object are moved in parts, with gaps between them.
    let reach = (2.0 * lattice.shortest_side()) as f32;
    let near: Vec<bool> =
        lattice.distances(&moving, pauses).await.into_iter().map(|away| away <= reach).collect();
    let (parts, count) = lattice.parts(&near, pauses).await;
    let mut weights = vec![0.0; count + 1];
    parts.iter().zip(&variation).for_each(|(&part, &value)| weights[part as usize] += f64::from(value));
    weights[0] = 0.0;
    let heaviest = (1..=count).fold(0, |best, part| if weights[part] > weights[best] { part } else { best });
    let part: Vec<bool> = parts.iter().map(|&part| part > 0 && part as usize == heaviest).collect();
    let found = middle(sequence, &part, pauses).await;
    found.ok_or_else(|| MethodError::invalid(parameter, problem))
}

/// Returns the voxel deepest in the bright ones of a frame, within the box around a part of the sequence that moves; `None`
/// if there are no bright ones.
async fn middle(sequence: &CoarseSequence, part: &[bool], pauses: &Pauses) -> Option<(usize, usize)> {
    let lattice = &sequence.lattice;
    let [low, high] = lattice.bounds(part)?;
    let is_inside: Vec<bool> =
        (0..lattice.len()).map(|i| (0..3).all(|k| (low[k]..=high[k]).contains(&lattice.at(i)[k]))).collect();
    let mut counts = vec![0; 256];
    for frame in &sequence.frames {
        let inside = frame.iter().zip(&is_inside).filter(|(_, is_inside)| **is_inside);
        inside.for_each(|(&value, _)| counts[usize::from(value)] += 1);
        pauses.after(frame.len() / 256).await;
    }
    let kinds = two_kinds(&counts)?;
    let level = ((kinds.bright + kinds.dark) / 2.0) as f32;
    for (t, frame) in sequence.frames.iter().enumerate() {
        let blurred = lattice.blurred(frame, BLUR * lattice.shortest_side(), pauses).await;
        let bright: Vec<bool> = blurred.into_iter().map(|value| value > level).collect();
        let depth = depths(lattice, &bright, pauses).await;
        let inside = (0..lattice.len()).filter(|&i| is_inside[i] && depth[i] > 0.0);
        if let Some(deepest) = inside.reduce(|best, i| if depth[i] > depth[best] { i } else { best }) {
            return Some((deepest, t));
        }
    }
    None
}

/// Returns the standard deviation over the frames of each voxel's smoothed intensity.
async fn variation(sequence: &CoarseSequence, pauses: &Pauses) -> Vec<f32> {
    let lattice = &sequence.lattice;
    let mut sums = vec![[0.0f32; 2]; lattice.len()];
    for frame in &sequence.frames {
        let blurred = lattice.blurred(frame, BLUR * lattice.shortest_side(), pauses).await;
        sums.iter_mut().zip(blurred).for_each(|(sum, value)| {
            *sum = [sum[0] + value, sum[1] + value * value];
        });
    }
    let count = sequence.frames.len() as f32;
    let deviation = |[sum, squares]: [f32; 2]| {
        let mean = sum / count;
        libm::sqrtf((squares / count - mean * mean).max(0.0))
    };
    sums.into_iter().map(deviation).collect()
}

/// Returns the strongest variation without outliers.
fn strongest(variation: &[f32]) -> f32 {
    let mut counts = vec![0u64; 256];
    variation.iter().for_each(|&value| counts[(value as usize).min(255)] += 1);
    let few = (OUTLIERS * variation.len() as f64) as u64;
    let mut above = 0;
    for (level, count) in counts.into_iter().enumerate().rev() {
        above += count;
        if above > few {
            return level as f32;
        }
    }
    0.0
}
