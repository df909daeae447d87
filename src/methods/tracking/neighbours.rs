//! Objects beside the tracked one: whether one that was apart in the frame before touches it now.
//!
//! Two bodies that touch are one in the image. The surface then follows the outline of both, or grows into a part of the other:
//! every number of it looks like that of one body.

use super::SurfaceTracker;
use super::presence::inside_voxels;
use crate::mesh::TriangleMesh;
use crate::pauses::Pauses;
use fixedbitset::FixedBitSet;

/// Voxels of another object, as a share of those of the tracked one, from which it counts: smaller ones are fragments or noise.
const LARGE: f64 = 0.1;

/// Share of a part's voxels within the surface up to which it is another object: where the surface is off by a voxel, it holds
/// some of its neighbour.
const SHARED: f64 = 0.2;

/// Share of the voxels of another object that are bright in the next frame, too, below which it has moved on, and of these, share
/// that are connected to the tracked one, from which the two touch: with a lower one, an object that moves into the place that
/// another leaves would touch it.
const STILL_THERE: f64 = 0.1;
const CONNECTED: f64 = 0.5;

/// The bright voxels of a frame by parts, and those within the surface.
struct Parts {
    /// The number of each voxel's part, from 1 on; 0 for dark ones.
    of: Vec<u32>,
    sizes: Vec<usize>,
    /// Number of voxels of each part within the surface.
    within: Vec<usize>,
}

impl Parts {
    /// Returns the number of the part with most voxels within the surface; `None` if none has any.
    fn tracked(&self) -> Option<u32> {
        let most = (1..self.within.len())
            .fold(0, |best, i| if self.within[i] > self.within[best] { i } else { best });
        (most > 0).then_some(most as u32)
    }

    /// Returns the numbers of large parts that are other objects than the tracked one.
    fn others(&self) -> Vec<u32> {
        let Some(tracked) = self.tracked() else { return Vec::new() };
        let least = LARGE * self.within[tracked as usize] as f64;
        let is_other = |&i: &usize| {
            self.sizes[i] as f64 > least && self.within[i] as f64 <= SHARED * self.sizes[i] as f64
        };
        (1..self.sizes.len()).filter(is_other).map(|i| i as u32).collect()
    }
}

impl SurfaceTracker {
    /// Returns whether an object that was apart from the tracked one in the frame before is connected to it in a frame, with
    /// the surface `mesh` and the intensities at it.
    pub(super) async fn is_touched(
        &self,
        frame: usize,
        mesh: &TriangleMesh,
        intensities: Option<[f64; 2]>,
        pauses: &Pauses,
    ) -> bool {
        let Some(last) = frame.checked_sub(1) else { return false };
        let Some(before) =
            self.parts_at(last, &self.meshes[last], self.intensities_at_surface[last], pauses).await
        else {
            return false;
        };
        let others = before.others();
        if others.is_empty() {
            return false;
        }
        let Some(now) = self.parts_at(frame, mesh, intensities, pauses).await else { return false };
        let Some(tracked) = now.tracked() else { return false };
        others.into_iter().any(|other| {
            let (mut still, mut connected) = (0u32, 0u32);
            for (_, &part) in before.of.iter().zip(&now.of).filter(|&(&a, &b)| a == other && b > 0) {
                still += 1;
                connected += u32::from(part == tracked);
            }
            f64::from(still) >= STILL_THERE * before.sizes[other as usize] as f64
                && f64::from(connected) >= CONNECTED * f64::from(still)
        })
    }

    /// Returns the parts of a frame's voxels that are brighter than the middle of the intensity step at a surface; `None`
    /// without a surface.
    async fn parts_at(
        &self,
        frame: usize,
        mesh: &TriangleMesh,
        intensities: Option<[f64; 2]>,
        pauses: &Pauses,
    ) -> Option<Parts> {
        let (region, [bright, dark]) = (&self.region, intensities?);
        let level = (bright + dark) / 2.0;
        let inside = self.voxels_within(mesh);
        pauses.now().await;
        let mask: Vec<bool> = region.frames[frame].iter().map(|&value| f64::from(value) > level).collect();
        let (of, count) = region.lattice().parts(&mask, pauses).await;
        let (mut sizes, mut within) = (vec![0; count + 1], vec![0; count + 1]);
        for (i, &part) in of.iter().enumerate().filter(|(_, part)| **part > 0) {
            sizes[part as usize] += 1;
            within[part as usize] += usize::from(inside.contains(i));
        }
        Some(Parts { of, sizes, within })
    }

    /// Returns the voxels of the region whose centres are inside the surface of a frame.
    pub(super) fn voxels_within(&self, mesh: &TriangleMesh) -> FixedBitSet {
        let mut mesh = mesh.clone();
        mesh.positions.iter_mut().for_each(|p| *p *= self.region.space.scale as f32);
        inside_voxels(&self.region, &mesh)
    }
}
