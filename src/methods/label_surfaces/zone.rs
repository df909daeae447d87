//! A part of the surfaces that is being smoothed: copies of its cells' positions, with what links them.

use super::cells::{Cell, CellBox};
use super::cube_loops::{self, edge_at};
use super::envelope::Passage;
use super::label_grid::BACKGROUND;
use super::nets::{AROUND, Nets, halves};
use crate::math::Vec3;
use crate::pauses::Pauses;

/// Number of cells that are handled between two pauses.
const CHUNK: usize = 128;
/// Work that the links of a cell, and the polygons that begin at it, count as.
const WORK_OF_LINKS: usize = 3;
const WORK_OF_POLYGONS: usize = 2;
/// Stands for a cell that does not exist, or is not in the zone.
pub const NONE: u32 = u32::MAX;
/// Largest distance of a position from the centre of its cell along each axis, in voxels; below one half, since
/// surfaces would touch where positions of two cells coincide.
const REACH: f32 = 0.48;

/// A polygon of which a vertex may move: the cells around an edge, as indices into the zone.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    /// The four cells, counter-clockwise seen from the side of the label with the higher number; the first is before the
    /// edge along both other axes.
    pub cells: [u32; 4],
    /// Numbers of the two labels, that at the low end of the edge first.
    pub labels: [u16; 2],
    /// The axes seen from the side of the label with the higher number: across the edge to the second and to the last cell,
    /// and along it.
    pub axes: [u8; 3],
    /// Whether two labels meet in each of the cells, as bits.
    pub pairs: u8,
    /// Whether it is divided around a vertex on the edge, instead of by a diagonal.
    pub is_divided: bool,
}

impl Polygon {
    /// Creates the polygon around an edge along an axis; `cells` are in the order of those of a crossing.
    fn new(axis: usize, labels: [u16; 2], cells: [u32; 4], pairs: [bool; 4], is_divided: bool) -> Self {
        let [axis, next, last] = [0, 1, 2].map(|k| ((axis + k) % 3) as u8);
        let is_turned = labels[0] > labels[1];
        let order = if is_turned { [0, 3, 2, 1] } else { [0, 1, 2, 3] };
        Self {
            cells: order.map(|i| cells[i]),
            labels,
            axes: if is_turned { [last, next, axis] } else { [next, last, axis] },
            pairs: (0..4).fold(0, |bits, i| bits | u8::from(pairs[order[i]]) << i),
            is_divided,
        }
    }

    /// Returns the numbers of the two labels, the lower one first.
    pub fn ordered_labels(&self) -> [u16; 2] {
        let [low, high] = self.labels;
        [low.min(high), low.max(high)]
    }

    /// Returns the number of its edge in the cell `i` of it.
    pub fn edge_of(&self, i: usize) -> usize {
        let axis = usize::from(self.axes[2]);
        let [b, c] = AROUND[i].map(|after| 1 - after);
        if usize::from(self.axes[0]) == (axis + 1) % 3 { edge_at(axis, b, c) } else { edge_at(axis, c, b) }
    }

    /// Returns the middle of each cell, relative to that of the first.
    #[inline]
    pub fn middles(&self) -> [Vec3; 4] {
        let [next, last, _] = self.axes.map(usize::from);
        AROUND.map(|[b, c]| {
            let mut middle = [0.0; 3];
            (middle[next], middle[last]) = (b as f32, c as f32);
            Vec3::from(middle)
        })
    }
}

/// The cells of a box, and those around it, which do not move.
#[derive(Clone, Debug)]
pub struct Zone {
    /// The cells that move.
    pub area: CellBox,
    /// Number of the cells that move.
    moving: usize,
    /// Slots of the cells: those that move first.
    pub slots: Vec<u32>,
    /// Positions relative to the centres of the cells.
    pub offsets: Vec<Vec3>,
    /// How surfaces pass through each cell that moves.
    pub passages: Vec<Passage>,
    /// The neighbours of each cell that moves, along −x, +x, −y, +y, −z and +z, that its position moves towards; [`NONE`] if
    /// there is none.
    pub towards: Vec<[u32; 6]>,
    /// Those of them that move and in which the same two labels meet as in the cell, if two do; the cell itself in place of
    /// others.
    pub alike: Vec<[u32; 6]>,
    /// The polygons of which a vertex moves.
    pub polygons: Vec<Polygon>,
}

impl Zone {
    /// Copies the cells of a box.
    pub async fn new(nets: &Nets, area: CellBox, pauses: &Pauses) -> Self {
        let around = area.grown(1, nets.grid.dims());
        let mut slots = nets.cells.within(&area);
        let moving = slots.len();
        let all = nets.cells.within(&around);
        slots.extend(all.iter().filter(|&&slot| !area.contains(nets.cells.get(slot).at)));
        pauses.after(slots.len()).await;
        let mut index = vec![NONE; nets.cells.slots().len()];
        (0..).zip(&slots).for_each(|(i, &slot)| index[slot as usize] = i);
        let mut zone = Self {
            area,
            moving,
            offsets: Vec::with_capacity(slots.len()),
            passages: Vec::with_capacity(moving),
            towards: Vec::with_capacity(moving),
            alike: Vec::with_capacity(moving),
            polygons: Vec::with_capacity(slots.len() + slots.len() / 4),
            slots,
        };
        let mut neighbours = Neighbours { beyond: vec![[NONE; 6]; zone.slots.len()], pairs: Vec::new() };
        for slots in zone.slots.chunks(CHUNK) {
            for &slot in slots {
                let before =
                    nets.cells.before(slot).map(|slot| index.get(slot as usize).copied().unwrap_or(NONE));
                neighbours.add(nets.cells.get(slot), before);
                zone.offsets.push(nets.cells.get(slot).offset);
            }
            pauses.after(slots.len()).await;
        }
        for (i, &slot) in zone.slots[..moving].iter().enumerate() {
            let cell = nets.cells.get(slot);
            zone.passages.push(Passage::of(cell));
            let [towards, alike] = neighbours.links(i, cell, moving);
            zone.towards.push(towards);
            zone.alike.push(alike);
            pauses.after(WORK_OF_LINKS).await;
        }
        for slots in all.chunks(CHUNK) {
            for &slot in slots {
                zone.add_polygons(nets, slot, index[slot as usize], &neighbours);
            }
            pauses.after(WORK_OF_POLYGONS * slots.len()).await;
        }
        zone
    }

    /// Adds the polygons around the crossed edges from the first corner of a cell, of which a vertex may move.
    fn add_polygons(&mut self, nets: &Nets, slot: u32, i: u32, neighbours: &Neighbours) {
        for crossing in nets.crossings(slot) {
            let cells = neighbours.around(i, crossing.axis);
            if cells.iter().any(|&i| (i as usize) < self.moving()) && !cells.contains(&NONE) {
                let pairs = cells.map(|i| neighbours.pairs[i as usize].is_some());
                let is_divided = nets.has_face_vertices(&crossing);
                self.polygons.push(Polygon::new(crossing.axis, crossing.ends, cells, pairs, is_divided));
            }
        }
    }

    /// Returns the number of cells that move.
    pub fn moving(&self) -> usize {
        self.moving
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
    #[inline]
    pub fn corners(&self, polygon: &Polygon) -> [(Vec3, Vec3); 4] {
        let middles = polygon.middles();
        [0, 1, 2, 3].map(|i| (middles[i], self.offsets[polygon.cells[i] as usize]))
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
}

/// The neighbours of the cells of a zone, while it is created.
#[derive(Default)]
struct Neighbours {
    /// The neighbours of each cell along −x, +x, −y, +y, −z and +z; [`NONE`] if there is none in the zone.
    beyond: Vec<[u32; 6]>,
    /// The two labels that meet in each cell, if two do.
    pairs: Vec<Option<[u16; 2]>>,
}

impl Neighbours {
    /// Adds the next cell of the zone, with the neighbours before it.
    fn add(&mut self, cell: &Cell, before: [u32; 3]) {
        let i = self.pairs.len() as u32;
        self.pairs.push(pair(cell));
        for (axis, other) in before.into_iter().enumerate().filter(|&(_, other)| other != NONE) {
            self.beyond[i as usize][2 * axis] = other;
            self.beyond[other as usize][2 * axis + 1] = i;
        }
    }

    /// Returns the cells around the edge that begins at the first corner of a cell, along an axis, in the order of those of a
    /// crossing.
    fn around(&self, i: u32, axis: usize) -> [u32; 4] {
        let before =
            |i: u32, axis: usize| self.beyond.get(i as usize).map_or(NONE, |beyond| beyond[2 * (axis % 3)]);
        let [next, last] = [axis + 1, axis + 2].map(|axis| before(i, axis));
        [before(next, axis + 2), last, i, next]
    }

    /// Along a line where three or more labels meet, a cell has only neighbours on that line, if there are two at
    /// least: the line is smoothed by itself, and surfaces do not pull it to one side.
    fn links(&self, i: usize, cell: &Cell, moving: usize) -> [[u32; 6]; 2] {
        let own = self.pairs[i];
        let labels = [0, 1, 2, 3, 4, 5].map(|face| labels_on_face(cell, face));
        let is_on_line = labels.iter().filter(|&&labels| labels >= 3).count() >= 2;
        let least = if is_on_line { 3 } else { 2 };
        let [mut towards, mut alike] = [[NONE; 6], [i as u32; 6]];
        for (face, &neighbour) in self.beyond[i].iter().enumerate() {
            if labels[face] < least || neighbour == NONE {
                continue;
            }
            towards[face] = neighbour;
            if (neighbour as usize) < moving && own.is_some() && self.pairs[neighbour as usize] == own {
                alike[face] = neighbour;
            }
        }
        [towards, alike]
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
