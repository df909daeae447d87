//! Smoothing within the voxels: the positions of cells move towards those of their neighbours, as far as their own cell
//! reaches, so that every voxel stays on its side of every surface.
//!
//! Each iteration moves the positions towards the mean of their neighbours, then by a little more away from it (Taubin,
//! "A signal processing approach to fair surface design", 1995), which smooths steps without shrinking what is larger.

use super::cells::{Cell, CellBox};
use super::nets::Nets;
use crate::math::Vec3;

/// Fraction of the way to the mean of the neighbours, in the first and in the second half of an iteration.
const STEPS: [f32; 2] = [0.5, -0.52];
/// Largest distance of a position from the centre of its cell along each axis, in voxels; below one half, since
/// surfaces would touch where positions of two cells coincide.
pub const REACH: f32 = 0.48;
const NONE: u32 = u32::MAX;

/// The neighbours of a cell that its position moves towards.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// Slot of the cell.
    pub slot: u32,
    /// Slots of the neighbours along −x, +x, −y, +y, −z and +z; [`NONE`] if there is none.
    neighbours: [u32; 6],
}

impl Nets {
    /// Returns the stencils of all cells in a box, in the order of their slots.
    pub fn stencils(&self, area: CellBox) -> Vec<Stencil> {
        let slots = (0..).zip(self.cells.slots());
        let inside = slots.filter(|(_, cell)| cell.is_live() && area.contains(cell.at));
        inside.map(|(slot, cell)| self.stencil(slot, cell)).collect()
    }

    /// Along a line where three or more labels meet, a cell has only neighbours on that line, if there are two at
    /// least: the line is smoothed by itself, and surfaces do not pull it to one side.
    fn stencil(&self, slot: u32, cell: &Cell) -> Stencil {
        let labels = [0, 1, 2, 3, 4, 5].map(|face| labels_on_face(cell, face));
        let is_on_line = labels.iter().filter(|&&labels| labels >= 3).count() >= 2;
        let least = if is_on_line { 3 } else { 2 };
        let mut neighbours = [NONE; 6];
        for (face, neighbour) in neighbours.iter_mut().enumerate() {
            if labels[face] >= least {
                *neighbour = self.cells.find(beyond(cell.at, face)).unwrap_or(NONE);
            }
        }
        Stencil { slot, neighbours }
    }

    /// Runs one iteration on the cells of `stencils`; returns the root mean square of their displacements, in voxels.
    pub fn smooth(&mut self, stencils: &[Stencil]) -> f64 {
        let before: Vec<Vec3> = stencils.iter().map(|s| self.cells.get(s.slot).offset).collect();
        let mut moved = Vec::with_capacity(stencils.len());
        for fraction in STEPS {
            moved.clear();
            moved.extend(stencils.iter().map(|stencil| {
                let offset = self.cells.get(stencil.slot).offset;
                within_reach(offset + (self.mean(stencil) - offset) * fraction)
            }));
            for (stencil, &offset) in stencils.iter().zip(&moved) {
                *self.cells.offset_mut(stencil.slot) = offset;
            }
        }
        let squares = before.iter().zip(&moved).map(|(a, b)| f64::from(a.distance_squared(*b)));
        (squares.sum::<f64>() / stencils.len().max(1) as f64).sqrt()
    }

    /// Returns the mean position of the neighbours, relative to the centre of the cell.
    fn mean(&self, stencil: &Stencil) -> Vec3 {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for (face, &slot) in stencil.neighbours.iter().enumerate() {
            if slot != NONE {
                let mut point = self.cells.get(slot).offset;
                point[face / 2] += if face % 2 == 0 { -1.0 } else { 1.0 };
                sum += point;
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { self.cells.get(stencil.slot).offset }
    }
}

impl Stencil {
    /// Returns the slots of the neighbours.
    pub fn neighbours(&self) -> impl Iterator<Item = u32> + '_ {
        self.neighbours.iter().copied().filter(|&slot| slot != NONE)
    }
}

/// Returns the position nearest to `offset` that is within reach of the centre of the cell.
pub fn within_reach(offset: Vec3) -> Vec3 {
    offset.clamp(Vec3::splat(-REACH), Vec3::splat(REACH))
}

/// Returns the cell beyond a face of a cell, numbered as in [`Stencil`].
fn beyond(at: [u32; 3], face: usize) -> [u32; 3] {
    let mut next = at;
    let n = &mut next[face / 2];
    *n = if face % 2 == 0 { n.wrapping_sub(1) } else { *n + 1 };
    next
}

/// Returns the number of different labels at the corners of a face of a cell.
fn labels_on_face(cell: &Cell, face: usize) -> usize {
    let bits = [4usize, 1, 2];
    let axis = face / 2;
    let (b, c) = (bits[(axis + 1) % 3], bits[(axis + 2) % 3]);
    let start = if face % 2 == 0 { 0 } else { bits[axis] };
    let corners = [start, start | b, start | c, start | b | c].map(|corner| cell.corners[corner]);
    (0..4).filter(|&i| !corners[..i].contains(&corners[i])).count()
}
