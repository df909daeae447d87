//! The surfaces as polygons: one around each edge between two voxels of different labels, for each of the two.
//!
//! Vertices are the positions of the four cells around the edge (surface nets: Gibson, "Constrained elastic surface
//! nets", 1998), one for each loop of the label in a cell, so that the surface is a 2-manifold. All labels share the
//! position of a cell; where several surfaces pass through it, each vertex is moved towards its label's side, which
//! leaves a gap between them. Two corners with the label that are diagonally opposite on a face would give two
//! polygon edges between the same cells; there, each gets a vertex on the face, and polygons are divided around a
//! vertex on the edge of the grid instead of by a diagonal. So they are between two cells in which labels meet like in a
//! saddle, where vertices in the cells alone leave no gap.

use super::cells::{Cell, CellBox, Cells, count_cells};
use super::coarsen::Coarsening;
use super::cube_loops::{FAR, corner_offset, cube_loops, edge_at, face};
use super::label_grid::{BACKGROUND, LabelGrid};
use crate::math::order::sort_distinct;
use crate::math::{DAffine3, DVec3, Vec3, box_corners};
use crate::mesh::grid_origin;
use crate::methods::MethodError;
use crate::pauses::{Pauses, finished};
use crate::volume::VolumeError;
use std::collections::BTreeSet;

/// Largest number of cells through which surfaces pass; more take more than a gigabyte. Labels of noise have as many in 200³
/// voxels.
const MOST_CELLS: usize = 8_000_000;
/// Work that a row of voxels counts as, whatever is in it.
const WORK_OF_ROW: usize = 1;
/// Work that finding and storing a cell counts as.
const WORK_OF_CELL: usize = 2;

/// Width of the gap between surfaces that touch, in voxels.
pub const GAP: f32 = 0.01;

/// A vertex of a label's surface, by which equal ones are recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum NetVertex {
    /// In the cell in a slot, on one of the label's loops.
    Cell {
        /// Slot of the cell.
        slot: u32,
        /// Index of the loop.
        on: u8,
    },
    /// On the face between the cell in a slot and the one before it along an axis, next to one of two corners.
    Face {
        /// Slot of the later cell.
        slot: u32,
        /// Axis that the face is normal to.
        axis: u8,
        /// The corner of the later cell that the vertex is next to.
        corner: u8,
    },
    /// On the edge from the first corner of the cell in a slot along an axis, next to one of its ends.
    Edge {
        /// Slot of the last of the four cells around the edge.
        slot: u32,
        /// Axis of the edge.
        axis: u8,
        /// Whether the vertex is next to the far end.
        far: bool,
    },
}

/// An edge of the grid between two voxels of different labels, and the four cells around it.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Axis of the edge.
    pub axis: usize,
    /// Numbers of the labels at its low and its high end.
    pub ends: [u16; 2],
    /// Slots of the cells around it, counter-clockwise seen from the high end; the third is the one that begins at it.
    pub slots: [u32; 4],
}

/// Position, along the two axes after that of the edge, of the four cells around it: 0 before it, 1 after.
pub const AROUND: [[usize; 2]; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];

/// The polygon of one label around an edge of the grid, as triangles.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    triangles: [[NetVertex; 3]; 8],
    count: usize,
}

impl Patch {
    /// Returns the triangles, counter-clockwise seen from outside of the label in index space.
    pub fn triangles(&self) -> &[[NetVertex; 3]] {
        &self.triangles[..self.count]
    }

    fn add(&mut self, corners: [NetVertex; 3]) {
        self.triangles[self.count] = corners;
        self.count += 1;
    }
}

/// The labels and the cells through which their surfaces pass.
#[derive(Clone, Debug)]
pub struct Nets {
    /// The labels of the voxels.
    pub grid: LabelGrid,
    /// The cells through which surfaces pass.
    pub cells: Cells,
    /// Which cells are merged.
    pub coarse: Coarsening,
    /// Slots of the cells in which each label is, in ascending order; those of the label with number 1 come first.
    of_labels: Vec<Vec<u32>>,
    to_world: DAffine3,
    /// The origin of all surfaces in world space.
    origin: DVec3,
    /// Largest distance, in voxels, of a returned position in single precision from that in index space.
    rounding: f32,
}

impl Nets {
    /// Creates the surfaces of a label map, with all vertices in the middle of their cells; `to_world` maps the index
    /// space of the volume to world space.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`]; [`MethodError::InvalidArgument`] for surfaces through more than `most` cells, by default
    /// [`MOST_CELLS`].
    pub async fn new(
        grid: LabelGrid,
        to_world: DAffine3,
        most: Option<usize>,
        pauses: &Pauses,
    ) -> Result<Self, MethodError> {
        let most = most.map_or(MOST_CELLS, |most| most.min(MOST_CELLS));
        let (cells, coarse, of_labels) = (Cells::new(grid.dims())?, Coarsening::default(), Vec::new());
        let origin = grid_origin(&to_world, grid.dims());
        let rounding = rounding(&to_world, grid.dims(), origin);
        let mut nets = Self { cells, coarse, of_labels, grid, to_world, origin, rounding };
        let everywhere = nets.everywhere();
        let mut changed = nets.no_labels();
        // Counted first, so that what is refused needs no memory.
        nets.cells.reserve(nets.counted(most, pauses).await?)?;
        for row in everywhere.rows() {
            let before = nets.cells.slots().len();
            nets.cells.update(&nets.grid, row, &mut changed)?;
            pauses.after(WORK_OF_CELL * (nets.cells.slots().len() - before) + WORK_OF_ROW).await;
        }
        nets.list(everywhere, &changed, pauses).await;
        Ok(nets)
    }

    /// Returns the numbers of the labels in the cells of a box, in ascending order.
    pub fn numbers_within(&self, area: &CellBox) -> Vec<u16> {
        let slots = self.cells.within(area);
        let numbers: BTreeSet<u16> =
            slots.into_iter().flat_map(|slot| self.cells.get(slot).numbers()).collect();
        numbers.into_iter().collect()
    }

    /// Returns the number of cells through which surfaces pass; an error if there are more than `most`.
    async fn counted(&self, most: usize, pauses: &Pauses) -> Result<usize, MethodError> {
        let mut cells = 0;
        for row in self.everywhere().rows() {
            cells += count_cells(&self.grid, &row);
            if cells > most {
                let problem = format!(
                    "the surfaces of its labels pass through more than {most} cells of its grid: choose some labels, or \
                     crop or resample it"
                );
                return Err(MethodError::invalid("volume", problem));
            }
            pauses.after(WORK_OF_ROW).await;
        }
        Ok(cells)
    }

    /// Has the cells of a box follow the labels; returns a flag for each label, by number, whether it is in a cell that
    /// has changed, or was.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn update(&mut self, area: CellBox) -> Result<Vec<bool>, VolumeError> {
        let mut changed = self.no_labels();
        self.cells.update(&self.grid, area, &mut changed)?;
        finished(self.list(area, &changed, &Pauses::default()));
        Ok(changed)
    }

    /// Lists the cells in which labels are that have `changed` in a box.
    async fn list(&mut self, area: CellBox, changed: &[bool], pauses: &Pauses) {
        self.of_labels.resize(changed.len() - 1, Vec::new());
        let within = self.cells.within(&area);
        pauses.after(within.len()).await;
        for slot in within {
            pauses.after(1).await;
            for number in self.cells.get(slot).numbers().filter(|&number| changed[usize::from(number)]) {
                self.of_labels[usize::from(number) - 1].push(slot);
            }
        }
        let Self { cells, of_labels, .. } = self;
        for (number, slots) in
            (1..=u16::MAX).zip(of_labels).filter(|&(number, _)| changed[usize::from(number)])
        {
            slots.retain(|&slot| cells.get(slot).corners.contains(&number));
            sort_distinct(slots);
            pauses.after(slots.len()).await;
        }
    }

    /// Replaces labels and cells.
    pub fn restore(&mut self, grid: LabelGrid, cells: Cells) {
        let mut of_labels = vec![Vec::new(); grid.values().len()];
        for (slot, cell) in (0..).zip(cells.slots()) {
            cell.numbers().for_each(|number| of_labels[usize::from(number) - 1].push(slot));
        }
        let coarse = Coarsening::default();
        *self = Self { grid, cells, coarse, of_labels, ..*self };
    }

    /// Returns the slots of the cells in which a label is, in ascending order.
    pub fn slots_of(&self, number: u16) -> &[u32] {
        self.of_labels.get(usize::from(number) - 1).map_or(&[], Vec::as_slice)
    }

    /// Returns a flag for each label, by number, and the background, that is not set.
    pub fn no_labels(&self) -> Vec<bool> {
        vec![false; self.grid.values().len() + 1]
    }

    /// Sets the flag, by number, of each label that is in the cell in one of the given slots.
    pub fn flag_labels_in(&self, slots: impl IntoIterator<Item = u32>, flags: &mut [bool]) {
        for number in slots.into_iter().flat_map(|slot| self.cells.get(slot).corners) {
            if let Some(flag) = flags.get_mut(usize::from(number)) {
                *flag = true;
            }
        }
    }

    /// Returns the map from the index space of the volume to world space.
    pub fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Returns the origin of all surfaces in world space, see [`TriangleMesh::origin`](crate::mesh::TriangleMesh::origin).
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the largest distance, in voxels, of a returned position in single precision from that in index space.
    pub fn rounding(&self) -> f32 {
        self.rounding
    }

    /// Returns the box of all cells.
    pub fn everywhere(&self) -> CellBox {
        CellBox { low: [0; 3], high: self.grid.dims().map(|n| n as u32) }
    }

    /// Returns the edges of the grid that begin at the first corner of the cell in a slot and end at a voxel of another
    /// label.
    #[inline]
    pub fn crossings(&self, slot: u32) -> impl Iterator<Item = Crossing> + '_ {
        let corners = &self.cells.get(slot).corners;
        (0..3).filter_map(move |axis| {
            let ends = [corners[0], corners[FAR[axis]]];
            if ends[0] == ends[1] {
                return None;
            }
            Some(Crossing { axis, ends, slots: self.cells.around(slot, axis)? })
        })
    }

    /// Returns the polygon of the label at the `far` or near end of a crossed edge.
    pub fn patch(&self, crossing: &Crossing, far: bool) -> Patch {
        let Crossing { ends, slots, .. } = *crossing;
        let number = ends[usize::from(far)];
        let loops = self.loops(crossing, number);
        let corners = [0, 1, 2, 3].map(|i| NetVertex::Cell { slot: slots[i], on: loops[i] });
        let mut patch = Patch { triangles: [[corners[0]; 3]; 8], count: 0 };
        if self.has_face_vertices(crossing) {
            self.divide_around_edge(crossing, far, corners, &mut patch);
        } else {
            let origin = self.cells.get(slots[0]).at;
            let cell_position = |slot| steps(origin, self.cells.get(slot).at) + self.cells.get(slot).offset;
            for half in halves(slots.map(cell_position)) {
                patch.add(half.map(|i| corners[i]));
            }
        }
        if far {
            patch.triangles[..patch.count].iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        patch
    }

    /// Returns the loops of the label `number`, at one end of an edge, on which the edge is crossed in the cells around it.
    pub fn loops(&self, crossing: &Crossing, number: u16) -> [u8; 4] {
        let mut loops = [0; 4];
        for ((on, &slot), [b, c]) in loops.iter_mut().zip(&crossing.slots).zip(AROUND) {
            let edge = edge_at(crossing.axis, 1 - b, 1 - c);
            *on = cube_loops()[self.cells.get(slot).case(number)].of_edge[edge];
        }
        loops
    }

    /// Returns, for each of the four faces around an edge, from each of the cells to the next one, whether the surfaces of
    /// the labels at the near and at the far end of the edge have vertices on it.
    fn face_vertices(&self, Crossing { axis, ends, slots }: &Crossing) -> [[bool; 2]; 4] {
        let [a, b, c] = [0, 1, 2].map(|k| FAR[(axis + k) % 3]);
        let mut found = [[false; 2]; 4];
        for (i, on_face) in found.iter_mut().enumerate() {
            let cell = self.cells.get(slots[i]);
            // The face towards the next cell lies beyond the edge along the axis in which both cells agree.
            let [here, next] = [AROUND[i], AROUND[(i + 1) % 4]];
            let start = ((1 - here[0]) * b) | ((1 - here[1]) * c);
            let across = if here[0] == next[0] { b } else { c };
            let other = start ^ across;
            let (near, far) = (cell.corners[other], cell.corners[other | a]);
            let is_between_saddles =
                self.cells.get(slots[i]).is_saddle && self.cells.get(slots[(i + 1) % 4]).is_saddle;
            *on_face = [far == ends[0] && near != ends[0], near == ends[1] && far != ends[1]]
                .map(|is_diagonal| is_diagonal || is_between_saddles);
            // The background has no surface of its own.
            (0..2).for_each(|end| on_face[end] &= ends[end] != BACKGROUND);
        }
        found
    }

    /// Returns whether surfaces have vertices on the faces around an edge; the polygon is then divided around the edge.
    pub fn has_face_vertices(&self, crossing: &Crossing) -> bool {
        crossing.slots.map(|slot| self.cells.get(slot)).iter().any(|cell| cell.has_diagonal || cell.is_saddle)
            && self.face_vertices(crossing).iter().flatten().any(|&is_on_face| is_on_face)
    }

    fn divide_around_edge(&self, crossing: &Crossing, far: bool, corners: [NetVertex; 4], patch: &mut Patch) {
        let middle = NetVertex::Edge { slot: crossing.slots[2], axis: crossing.axis as u8, far };
        let on_faces = self.face_vertices(crossing);
        for i in 0..4 {
            let (from, to) = (corners[i], corners[(i + 1) % 4]);
            if on_faces[i][usize::from(far)] {
                let face = self.face_vertex(crossing, i, far);
                patch.add([middle, from, face]);
                patch.add([middle, face, to]);
            } else {
                patch.add([middle, from, to]);
            }
        }
    }

    /// Returns the vertex on the face between two of the cells around an edge, `i` and the next one, next to one of the
    /// ends of the edge.
    fn face_vertex(&self, Crossing { axis, slots, .. }: &Crossing, i: usize, far: bool) -> NetVertex {
        let [here, next] = [AROUND[i], AROUND[(i + 1) % 4]];
        let changes = usize::from(here[0] == next[0]);
        let (later, place) = if next[changes] == 1 { (slots[(i + 1) % 4], next) } else { (slots[i], here) };
        let corner = (usize::from(far) * FAR[*axis])
            | ((1 - place[0]) * FAR[(axis + 1) % 3])
            | ((1 - place[1]) * FAR[(axis + 2) % 3]);
        let axis = (axis + 1 + changes) % 3;
        let cell = self.cells.get(later);
        // Two diagonally opposite corners have a vertex each; otherwise, there is one, called after the first corner.
        let same = face(axis, false).into_iter().find(|&other| cell.corners[other] == cell.corners[corner]);
        let corner = if is_diagonal(cell, axis, corner) { corner } else { same.unwrap_or(corner) };
        NetVertex::Face { slot: later, axis: axis as u8, corner: corner as u8 }
    }

    /// Returns the position of a vertex of a label in the volume's index space, relative to the centre of cell `from`.
    pub fn position(&self, number: u16, vertex: NetVertex, from: [u32; 3]) -> Vec3 {
        match vertex {
            NetVertex::Cell { slot, on } => self.cell_position(number, slot, on, from),
            NetVertex::Face { slot, axis, corner } => self.face_position(slot, axis.into(), corner, from),
            NetVertex::Edge { slot, axis, far } => self.edge_position(slot, axis.into(), far, from),
        }
    }

    /// Returns the position of a vertex of a label in world space.
    pub fn world_position(&self, number: u16, vertex: NetVertex) -> Vec3 {
        self.shifted_position(number, vertex, Vec3::ZERO)
    }

    /// Returns the position in world space of a vertex of a label that is displaced by `shift` in index space.
    pub fn shifted_position(&self, number: u16, vertex: NetVertex, shift: Vec3) -> Vec3 {
        let slot = match vertex {
            NetVertex::Cell { slot, .. } | NetVertex::Face { slot, .. } | NetVertex::Edge { slot, .. } => {
                slot
            }
        };
        let at = self.cells.get(slot).at;
        let centre = DVec3::from(at.map(|n| f64::from(n) - 0.5));
        let local = (self.position(number, vertex, at) + shift).as_dvec3();
        (self.to_world.transform_point3(centre + local) - self.origin).as_vec3()
    }

    fn cell_position(&self, number: u16, slot: u32, on: u8, from: [u32; 3]) -> Vec3 {
        let cell = self.cells.get(slot);
        let loops = &cube_loops()[cell.case(number)];
        let shift = if cell.simple == 1 { Vec3::ZERO } else { loops.clear[usize::from(on)] * (GAP / 2.0) };
        steps(from, cell.at) + cell.offset + shift
    }

    /// The point of a face lies on the line between the positions of both cells.
    fn face_position(&self, slot: u32, axis: usize, corner: u8, from: [u32; 3]) -> Vec3 {
        let later = self.cells.get(slot);
        let mut at = later.at;
        at[axis] -= 1;
        let earlier = self.cells.find(at).map_or(Vec3::ZERO, |slot| self.cells.get(slot).offset);
        let mut across = Vec3::ZERO;
        across[axis] = 1.0;
        let way = later.offset + across - earlier;
        let point = earlier - across + way * ((0.5 - earlier[axis]) / way[axis]);
        steps(from, later.at) + point + face_clear(later, axis, corner.into()) * GAP
    }

    /// The point of an edge lies at the mean height of the four cells around it.
    fn edge_position(&self, slot: u32, axis: usize, far: bool, from: [u32; 3]) -> Vec3 {
        let cell = self.cells.get(slot);
        let around = self.cells.around(slot, axis).unwrap_or([slot; 4]);
        let height: f32 = around.iter().map(|&slot| self.cells.get(slot).offset[axis] / 4.0).sum();
        let mut point = Vec3::splat(-0.5);
        point[axis] = height + if far { GAP / 2.0 } else { -GAP / 2.0 };
        steps(from, cell.at) + point
    }
}

/// Returns the largest distance, in voxels, of positions in world space that are rounded to single precision from those in
/// index space, with room to spare.
fn rounding(to_world: &DAffine3, dims: [usize; 3], origin: DVec3) -> f32 {
    let corners = box_corners(DVec3::splat(-1.0), DVec3::from(dims.map(|n| n as f64)));
    let far = corners.into_iter().map(|p| (to_world.transform_point3(p) - origin).abs().max_element());
    let farthest = far.fold(0.0, f64::max);
    let to_index = to_world.matrix3.inverse();
    let scale = [to_index.x_axis, to_index.y_axis, to_index.z_axis]
        .iter()
        .map(|axis| axis.length_squared())
        .sum::<f64>();
    // The half of the last place, along three axes; and of positions within a cell.
    (2.0 * f64::from(f32::EPSILON) * (farthest * scale.sqrt() + 1.0)) as f32
}

/// Returns the triangles into which the shorter diagonal divides a quadrilateral, as indices of its corners.
pub fn halves([a, b, c, d]: [Vec3; 4]) -> [[usize; 3]; 2] {
    if b.distance_squared(d) < a.distance_squared(c) {
        [[0, 1, 3], [1, 2, 3]]
    } else {
        [[0, 1, 2], [0, 2, 3]]
    }
}

fn steps(from: [u32; 3], to: [u32; 3]) -> Vec3 {
    let step = |axis: usize| to[axis] as f32 - from[axis] as f32;
    Vec3::new(step(0), step(1), step(2))
}

/// Returns whether, of the corners of the face before a cell along an axis, only the one opposite `corner` has the same
/// label.
fn is_diagonal(cell: &Cell, axis: usize, corner: usize) -> bool {
    let face = face(axis, false);
    let opposite = face[2] ^ corner;
    face.into_iter().all(|other| {
        let expected = other == corner || other == opposite;
        (cell.corners[other] == cell.corners[corner]) == expected
    })
}

/// Returns the direction, in half gaps, in which a vertex on the face before a cell along an axis moves to keep clear of
/// other labels: towards the corners with the label of `corner`, or towards that corner only if they are two, diagonally
/// opposite.
fn face_clear(cell: &Cell, axis: usize, corner: usize) -> Vec3 {
    let diagonal = is_diagonal(cell, axis, corner);
    let has_label = |other: usize| {
        if diagonal { other == corner } else { cell.corners[other] == cell.corners[corner] }
    };
    let mean = |wanted: bool| {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for other in face(axis, false).into_iter().filter(|&other| has_label(other) == wanted) {
            (sum, count) = (sum + corner_position(other), count + 1.0);
        }
        sum / count
    };
    (mean(true) - mean(false)) / 2.0
}

/// Returns the position of a corner relative to the centre of its cell.
fn corner_position(corner: usize) -> Vec3 {
    Vec3::from(corner_offset(corner).map(|n| n as f32 - 0.5))
}
