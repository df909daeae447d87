//! The sides of the box in which a surface is tracked are a boundary where they cut a bright region. Blood continues
//! from one chamber into the next without a step in intensity, so the box ends the region: its sides get faces of full
//! weight there, and the surface is closed.

use super::labelling::{FACES_PER_UNIT, VoxelBox, label_bright, label_bright_by_level};
use super::region::Region;
use super::vote::{Face, Faces, TIME, X, Y, Z};
use crate::math::DVec3;
use crate::math::order::sort_distinct;
use crate::pauses::Pauses;

impl Region {
    fn is_inside(&self, at: [usize; 3]) -> bool {
        let [first, last] = self.inner;
        (0..3).all(|axis| (first[axis]..=last[axis]).contains(&at[axis]))
    }

    /// Returns the coordinates of the voxels before and after the face in `direction` after `voxel`; the same voxel
    /// twice for a face along time.
    pub fn voxels_at_face(&self, direction: usize, voxel: u32) -> [[usize; 3]; 2] {
        let before = self.voxel(voxel);
        let mut after = before;
        if direction != TIME {
            after[direction] += 1;
        }
        [before, after]
    }

    /// Returns the direction out of the box through the face in `direction` after `voxel`, if the face is in a side of
    /// the box; `None` for all other faces.
    pub fn outward_at_box_side(&self, direction: usize, voxel: u32) -> Option<DVec3> {
        match self.voxels_at_face(direction, voxel).map(|at| self.is_inside(at)) {
            [true, false] => Some(DVec3::AXES[direction]),
            [false, true] => Some(-DVec3::AXES[direction]),
            _ => None,
        }
    }

    /// Returns the distance from a voxel's centre to the box in which a surface is tracked, along the axis where it is
    /// largest, in world units; negative infinity for voxels of the box. Used to put everything beyond the box outside
    /// of the surface.
    pub fn distance_outside_box(&self, at: [usize; 3]) -> f64 {
        let [first, last] = self.inner;
        let beyond = |axis: usize| {
            let voxels = (first[axis] as f64 - at[axis] as f64).max(at[axis] as f64 - last[axis] as f64);
            if voxels > 0.0 { (voxels - 0.5) * self.spacing[axis] } else { f64::NEG_INFINITY }
        };
        (0..3).map(beyond).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the index of the voxel of the box that is nearest to `position` if that is outside the box; `None` if it
    /// is inside. Shows whether a surface point is at a side of the box.
    pub fn clamp_into_box(&self, position: DVec3) -> Option<u32> {
        let [first, last] = self.inner.map(|at| DVec3::from(at.map(|i| i as f64)));
        let at = position / self.spacing;
        let is_inside = at.cmpge(first - 0.5).all() && at.cmple(last + 0.5).all();
        let [x, y, z] = at.clamp(first, last).round().to_array().map(|i| i as u32);
        let [nx, ny, _] = self.dims.map(|n| n as u32);
        (!is_inside).then_some((z * ny + y) * nx + x)
    }

    /// Returns whether a position is beyond the sides of the box, or up to `near` voxels before one of them.
    pub fn is_near_side(&self, position: DVec3, near: f64) -> bool {
        let [first, last] = self.inner.map(|at| DVec3::from(at.map(|i| i as f64)));
        let at = position / self.spacing;
        at.cmplt(first - 0.5 + near).any() || at.cmpgt(last + 0.5 - near).any()
    }

    /// Removes the faces beyond the box from `faces`, and adds faces of weight 1 in the sides of the box where the
    /// frame is bright, so that the surface is closed there.
    pub async fn clip_to_box(&self, frame: usize, faces: &mut Faces, pauses: &Pauses) {
        for (direction, list) in faces.iter_mut().enumerate() {
            let mut kept = 0;
            for i in 0..list.len() {
                if self.voxels_at_face(direction, list[i].voxel).iter().all(|&at| self.is_inside(at)) {
                    list[kept] = list[i];
                    kept += 1;
                }
                if i % FACES_PER_UNIT == 0 {
                    pauses.after(1).await;
                }
            }
            list.truncate(kept);
        }
        let mut added: [Vec<Face>; 3] = Default::default();
        let mut by_level = None;
        for (direction, list) in added.iter_mut().enumerate() {
            let [first, last] = self.inner.map(|at| at[direction]);
            // A face is indexed by the voxel before it.
            if let Some(before) = first.checked_sub(1) {
                let layers = [first, before];
                list.extend(
                    self.box_side_faces(frame, faces, direction, layers, &mut by_level, pauses).await,
                );
            }
            if last + 1 < self.dims[direction] {
                let layers = [last; 2];
                list.extend(
                    self.box_side_faces(frame, faces, direction, layers, &mut by_level, pauses).await,
                );
            }
        }
        faces.iter_mut().zip(added).for_each(|(list, added)| list.extend(added));
    }

    /// Returns faces of weight 1 in a side of the box where the adjacent `layer` of voxels is bright; `at` is the layer
    /// of the voxels before the faces. Both are indices along `direction`. If no boundary crosses the side, the nearest wall
    /// in the box decides: `by_level` are the bright voxels of the box by that, for all sides, once they are known.
    async fn box_side_faces(
        &self,
        frame: usize,
        faces: &Faces,
        direction: usize,
        [layer, at]: [usize; 2],
        by_level: &mut Option<Option<Vec<bool>>>,
        pauses: &Pauses,
    ) -> Vec<Face> {
        let mut side = VoxelBox { ends: self.inner };
        side.ends.iter_mut().for_each(|end| end[direction] = layer);
        let inner = VoxelBox { ends: self.inner };
        let own = label_bright(self, frame, faces, side, pauses).await;
        if own.is_none() && by_level.is_none() {
            *by_level = Some(label_bright_by_level(self, frame, faces, inner, pauses).await);
        }
        let is_bright = |i: &usize| match (&own, &*by_level) {
            (Some(own), _) => own[*i],
            (None, Some(Some(fallback))) => inner.index(side.at(*i)).is_some_and(|i| fallback[i]),
            (None, _) => false,
        };
        let [nx, ny, _] = self.dims;
        let bright = (0..side.len()).filter(is_bright);
        let voxel = |i: usize| {
            let mut voxel = side.at(i);
            voxel[direction] = at;
            ((voxel[2] * ny + voxel[1]) * nx + voxel[0]) as u32
        };
        bright.map(|i| Face { voxel: voxel(i), weight: 1.0 }).collect()
    }

    /// Returns the indices, sorted, of the voxels of the box that are adjacent to faces in its sides: there, the image
    /// is bright up to the side, which is a boundary of the surface.
    pub async fn bright_box_side_voxels(&self, faces: &Faces, pauses: &Pauses) -> Vec<u32> {
        let [nx, ny, _] = self.dims;
        let mut voxels = Vec::new();
        for direction in [X, Y, Z] {
            let step = [1, nx, nx * ny][direction] as u32;
            for (i, face) in faces[direction].iter().enumerate() {
                if i % FACES_PER_UNIT == 0 {
                    pauses.after(1).await;
                }
                match self.outward_at_box_side(direction, face.voxel) {
                    Some(outward) if outward[direction] > 0.0 => voxels.push(face.voxel),
                    Some(_) => voxels.push(face.voxel + step),
                    None => {}
                }
            }
        }
        sort_distinct(&mut voxels);
        voxels
    }
}
