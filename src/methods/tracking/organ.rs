//! A bright object as voxels, followed from frame to frame.
//!
//! Objects leak: a chamber of the heart is connected to the next one, and noise makes holes in thin walls. So an object is
//! what a ball of half its own radius reaches, rolled about in the bright voxels from its middle, and the bright voxels
//! connected to that within its radius.

use super::lattice::Lattice;
use crate::pauses::Pauses;

/// Radius of the ball that an object is cut at necks by, as a share of the radius of the largest ball around its middle.
/// With a larger one, ends that taper are cut off; with a smaller one, wide necks are no longer cut.
const NECK: f32 = 0.5;

/// Distance from what the centre of the ball reaches up to which bright voxels belong to the object, in units of its radius,
/// and in addition in units of the shortest side of a voxel. With half of it, what is behind the muscles of a contracted
/// ventricle is left out, a tenth of its volume.
const REACH: f32 = 1.0;
const RIM: f64 = 1.5;

/// Follows an object through the bright voxels of frames.
#[derive(Clone, Debug)]
pub(super) struct Organ {
    pub lattice: Lattice,
    /// The radius of the largest ball in the object's bright voxels, around its middle, in the frame where it was found.
    pub radius: f32,
}

impl Organ {
    /// Returns the object around a bright voxel of a frame, and the search that follows it; `None` if the voxel is dark.
    pub async fn around(
        lattice: Lattice,
        bright: &[bool],
        voxel: usize,
        pauses: &Pauses,
    ) -> Option<(Self, Vec<bool>)> {
        if !bright[voxel] {
            return None;
        }
        let depth = depths(&lattice, bright, pauses).await;
        let middle = climb(&lattice, &depth, voxel);
        let organ = Self { lattice, radius: depth[middle] };
        let mut seed = vec![false; bright.len()];
        seed[middle] = true;
        let mask = organ.reached(bright, &depth, &seed, organ.radius, pauses).await?;
        Some((organ, mask))
    }

    /// Returns the object in a frame, given that of the frame before or after it, and the radius of the largest ball in what
    /// the two have in common; `None` if it is not there.
    pub async fn next(&self, bright: &[bool], before: &[bool], pauses: &Pauses) -> Option<(Vec<bool>, f32)> {
        let depth = depths(&self.lattice, bright, pauses).await;
        let shared: Vec<bool> = bright.iter().zip(before).map(|(a, b)| *a && *b).collect();
        let deepest = depth.iter().zip(&shared).filter(|(_, is_in)| **is_in).map(|(depth, _)| *depth);
        let deepest = deepest.fold(0.0, f32::max);
        let mask = self.reached(bright, &depth, &shared, deepest.min(self.radius), pauses).await?;
        Some((mask, deepest))
    }

    /// Returns the bright voxels that a ball reaches from those of `seed`, and those nearby. `radius` is that of the object.
    async fn reached(
        &self,
        bright: &[bool],
        depth: &[f32],
        seed: &[bool],
        radius: f32,
        pauses: &Pauses,
    ) -> Option<Vec<bool>> {
        let neck = NECK * radius;
        let wide: Vec<bool> = depth.iter().map(|&depth| depth >= neck && depth > 0.0).collect();
        let (parts, count) = self.lattice.parts(&wide, pauses).await;
        let core = mask_of(&parts, most_shared(&parts, count, seed)?);
        let away = self.lattice.distances(&core, pauses).await;
        let reach = REACH * self.radius + (RIM * self.lattice.shortest_side()) as f32;
        let near: Vec<bool> =
            bright.iter().zip(&away).map(|(bright, away)| *bright && *away <= reach).collect();
        let (parts, count) = self.lattice.parts(&near, pauses).await;
        Some(mask_of(&parts, most_shared(&parts, count, &core)?))
    }
}

/// Returns for each voxel its distance from the nearest dark one; 0 for all if all are bright, which shows no object.
pub(super) async fn depths(lattice: &Lattice, bright: &[bool], pauses: &Pauses) -> Vec<f32> {
    let dark: Vec<bool> = bright.iter().map(|bright| !bright).collect();
    let mut depths = lattice.distances(&dark, pauses).await;
    depths.iter_mut().filter(|depth| depth.is_infinite()).for_each(|depth| *depth = 0.0);
    depths
}

/// Returns the voxel where an ascent to ever greater depths ends.
fn climb(lattice: &Lattice, depth: &[f32], voxel: usize) -> usize {
    let mut at = voxel;
    loop {
        let near = lattice.around(lattice.at(at), 1);
        let next = near.into_iter().fold(at, |best, i| if depth[i] > depth[best] { i } else { best });
        if next == at {
            return at;
        }
        at = next;
    }
}

/// Returns the number of the part with the most voxels in `seed`; `None` if none has any.
fn most_shared(parts: &[u32], count: usize, seed: &[bool]) -> Option<u32> {
    let mut shared = vec![0usize; count + 1];
    parts.iter().zip(seed).filter(|(_, is_in)| **is_in).for_each(|(&part, _)| shared[part as usize] += 1);
    shared[0] = 0;
    let best = (1..=count).fold(0, |best, part| if shared[part] > shared[best] { part } else { best });
    (best > 0).then_some(best as u32)
}

fn mask_of(parts: &[u32], part: u32) -> Vec<bool> {
    parts.iter().map(|&other| other == part).collect()
}

/// Returns the frames in the order in which an object of frame `first` is followed through them, each with the frame that
/// it is followed from: forwards, then backwards. In a cycle, each is reached the shorter way.
pub(super) fn order(first: usize, frames: usize, cyclic: bool) -> Vec<[usize; 2]> {
    let (forwards, backwards) =
        if cyclic { (frames / 2, (frames - 1) / 2) } else { (frames - 1 - first, first) };
    let at = |offset: usize| offset % frames;
    let ahead = (1..=forwards).map(|k| [at(first + k), at(first + k - 1)]);
    let behind = (1..=backwards).map(|k| [at(first + frames - k), at(first + frames - k + 1)]);
    ahead.chain(behind).collect()
}
