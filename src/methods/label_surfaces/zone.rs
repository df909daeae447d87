//! A part of the surfaces that is being smoothed: copies of its cells' positions, with what links them.

use super::cells::{Cell, CellBox};
use super::cube_loops;
use super::envelope::Passage;
use super::label_grid::BACKGROUND;
use super::nets::{Nets, halves};
use crate::math::Vec3;

/// Stands for a cell that does not exist, or is not in the zone.
pub const NONE: u32 = u32::MAX;
/// Largest distance of a position from the centre of its cell along each axis, in voxels; below one half, since
/// surfaces would touch where positions of two cells coincide.
const REACH: f32 = 0.48;

/// Links of a cell to its neighbours, as indices into the zone.
#[derive(Clone, Copy, Debug)]
pub struct Links {
    /// The neighbours along −x, +x, −y, +y, −z and +z that the position moves towards; [`NONE`] if there is none.
    pub towards: [u32; 6],
    /// Those of them that move and in which the same two labels meet as in this cell, if two do; the cell itself in place
    /// of others.
    pub alike: [u32; 6],
}

/// A polygon of which a vertex may move: the cells around an edge, as indices into the zone.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    /// The four cells, counter-clockwise seen from the side of the label with the higher number.
    pub cells: [u32; 4],
    /// Numbers of the two labels, that at the low end of the edge first.
    pub labels: [u16; 2],
    /// Axis of the edge.
    pub axis: u8,
    /// Whether two labels meet in each of them.
    pub pairs: [bool; 4],
}

/// The cells of a box, and those around it, which do not move.
#[derive(Clone, Debug)]
pub struct Zone {
    /// The cells that move.
    pub area: CellBox,
    /// Slots of the cells: those that move first.
    pub slots: Vec<u32>,
    /// Index of each cell along x, y and z.
    pub at: Vec<[u32; 3]>,
    /// Positions relative to the centres of the cells.
    pub offsets: Vec<Vec3>,
    /// How surfaces pass through each cell that moves.
    pub passages: Vec<Passage>,
    /// Links of each cell that moves.
    pub links: Vec<Links>,
    /// The polygons of which a vertex moves.
    pub polygons: Vec<Polygon>,
}

impl Zone {
    /// Copies the cells of a box.
    pub fn new(nets: &Nets, area: CellBox) -> Self {
        let around = area.grown(1, nets.grid.dims());
        let mut slots = nets.cells.within(&area);
        let moving = slots.len();
        let all = nets.cells.within(&around);
        slots.extend(all.iter().filter(|&&slot| !area.contains(nets.cells.get(slot).at)));
        let mut index = vec![NONE; nets.cells.slots().len()];
        (0..).zip(&slots).for_each(|(i, &slot)| index[slot as usize] = i);
        let cells = |slot: u32| nets.cells.get(slot);
        let links = slots[..moving].iter().map(|&slot| Self::links_of(nets, slot, &index, moving)).collect();
        let mut polygons = Vec::new();
        for crossing in all.iter().flat_map(|&slot| nets.crossings(slot)) {
            let mut around = crossing.slots;
            if crossing.ends[0] > crossing.ends[1] {
                around.swap(1, 3);
            }
            let cells = around.map(|slot| index[slot as usize]);
            if cells.iter().any(|&i| (i as usize) < moving) && !cells.contains(&NONE) {
                let pairs = around.map(|slot| pair(nets.cells.get(slot)).is_some());
                polygons.push(Polygon { cells, labels: crossing.ends, axis: crossing.axis as u8, pairs });
            }
        }
        Self {
            area,
            at: slots.iter().map(|&slot| cells(slot).at).collect(),
            offsets: slots.iter().map(|&slot| cells(slot).offset).collect(),
            passages: slots[..moving].iter().map(|&slot| Passage::of(cells(slot))).collect(),
            slots,
            links,
            polygons,
        }
    }

    /// Returns the number of cells that move.
    pub fn moving(&self) -> usize {
        self.links.len()
    }

    /// Returns the numbers of the labels of its polygons, in ascending order.
    pub fn numbers(&self) -> Vec<u16> {
        let mut is_seen = Vec::new();
        for number in self.polygons.iter().flat_map(|polygon| polygon.labels.map(usize::from)) {
            if number >= is_seen.len() {
                is_seen.resize(number + 1, false);
            }
            is_seen[number] = true;
        }
        let numbers = (0..=u16::MAX).zip(is_seen).filter_map(|(number, is_seen)| is_seen.then_some(number));
        numbers.filter(|&number| number != BACKGROUND).collect()
    }

    /// Returns the slots of the cells whose positions are not those in `offsets` any more.
    pub fn moved_from(&self, offsets: &[Vec3]) -> impl Iterator<Item = u32> {
        let moved = |((before, now), &slot): ((&Vec3, &Vec3), &u32)| (before != now).then_some(slot);
        offsets.iter().zip(&self.offsets).zip(&self.slots).filter_map(moved)
    }

    /// Returns for each polygon whether the diagonal from its first corner divides it.
    pub fn diagonals(&self) -> Vec<bool> {
        let is_first = |polygon| {
            let divided = halves(self.corners(polygon).map(|(middle, offset)| middle + offset));
            divided[0].contains(&2)
        };
        self.polygons.iter().map(is_first).collect()
    }

    /// Returns the middle of each cell of a polygon, relative to that of the first, and the position relative to it.
    pub fn corners(&self, polygon: &Polygon) -> [(Vec3, Vec3); 4] {
        let origin = self.at[polygon.cells[0] as usize];
        polygon.cells.map(|i| {
            let at = self.at[i as usize];
            let middle = Vec3::from([0, 1, 2].map(|axis| at[axis] as f32 - origin[axis] as f32));
            (middle, self.offsets[i as usize])
        })
    }

    /// Sets the flag, by number, of each label of which a polygon is not divided as in `diagonals` any more.
    pub fn flag_reconnected(&self, diagonals: &[bool], flags: &mut [bool]) {
        for ((before, now), polygon) in diagonals.iter().zip(self.diagonals()).zip(&self.polygons) {
            if *before != now {
                polygon.labels.iter().for_each(|&number| flags[usize::from(number)] = true);
            }
        }
    }

    /// Copies the positions of the cells that move from the surfaces.
    pub fn read(&mut self, nets: &Nets) {
        for (offset, &slot) in self.offsets.iter_mut().zip(&self.slots) {
            *offset = nets.cells.get(slot).offset;
        }
    }

    /// Copies the positions of the cells that move to the surfaces.
    pub fn write(&self, nets: &mut Nets) {
        for (&offset, &slot) in self.offsets[..self.moving()].iter().zip(&self.slots) {
            *nets.cells.offset_mut(slot) = offset;
        }
    }

    /// Along a line where three or more labels meet, a cell has only neighbours on that line, if there are two at
    /// least: the line is smoothed by itself, and surfaces do not pull it to one side.
    fn links_of(nets: &Nets, slot: u32, index: &[u32], moving: usize) -> Links {
        let cell = nets.cells.get(slot);
        let labels = [0, 1, 2, 3, 4, 5].map(|face| labels_on_face(cell, face));
        let is_on_line = labels.iter().filter(|&&labels| labels >= 3).count() >= 2;
        let least = if is_on_line { 3 } else { 2 };
        let mut links = Links { towards: [NONE; 6], alike: [index[slot as usize]; 6] };
        let own = pair(cell);
        for (face, _) in labels.iter().enumerate().filter(|&(_, &labels)| labels >= least) {
            let Some(slot) = nets.cells.find(beyond(cell.at, face)) else { continue };
            let neighbour = index[slot as usize];
            links.towards[face] = neighbour;
            if (neighbour as usize) < moving && own.is_some() && pair(nets.cells.get(slot)) == own {
                links.alike[face] = neighbour;
            }
        }
        links
    }
}

/// Returns the position nearest to `offset` that is within reach of the centre of the cell.
pub fn within_reach(offset: Vec3) -> Vec3 {
    offset.clamp(Vec3::splat(-REACH), Vec3::splat(REACH))
}

/// Returns the step from a cell to its neighbour beyond a face, numbered as in [`Links`].
pub fn step_to(face: usize) -> Vec3 {
    let mut step = Vec3::ZERO;
    step[face / 2] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
    step
}

fn beyond(at: [u32; 3], face: usize) -> [u32; 3] {
    let mut next = at;
    let n = &mut next[face / 2];
    *n = if face.is_multiple_of(2) { n.wrapping_sub(1) } else { *n + 1 };
    next
}

/// Returns the two labels that meet in a cell, the lower number first, if there are not more.
pub fn pair(cell: &Cell) -> Option<[u16; 2]> {
    let first = cell.corners[0];
    let second = cell.corners.iter().copied().find(|&other| other != first)?;
    let only = cell.corners.iter().all(|&other| other == first || other == second);
    only.then(|| [first.min(second), first.max(second)])
}

/// Returns the number of different labels at the corners of a face of a cell.
fn labels_on_face(cell: &Cell, face: usize) -> usize {
    let corners = cube_loops::face(face / 2, !face.is_multiple_of(2)).map(|corner| cell.corners[corner]);
    (0..4).filter(|&i| !corners[..i].contains(&corners[i])).count()
}
