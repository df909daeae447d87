//! Polygons that surely intersect no other: a test of one polygon by itself, in place of tests of pairs.
//!
//! **One surface.** Let each cell have one vertex, within the cell. The tetrahedra of an edge of the grid and the vertices of
//! two cells around it that share a face then tile space: the segment between these vertices passes through their face,
//! so the tetrahedra of the face's four edges make up its two pyramids, and a cell is made up of six pyramids. The
//! tetrahedra of an edge are its envelope (Ju and Udeshi, "Intersection-free contouring on an octree grid", 2006). A
//! polygon within the envelope of its own edge has nothing in common with that of another one but corners and sides.
//! Its corners are nearer the middle of the edge than its ends, so of its two triangles one crosses the edge; the
//! polygon is in the envelope if the ends are on different sides of the other triangle's plane.
//!
//! **Several labels.** If all labels had the positions of the cells as vertices, polygons would divide a cell into a region
//! for each label, without gaps. A vertex of a label is moved from there by a part of the gap. If, for each triangle, its
//! three vertices are moved to the label's side of its plane, then the region of the label shrinks, on all of the way: no
//! point of its surface stays or comes to be outside the region that it had. So surfaces of two labels, each in its own
//! region, have nothing in common. Vertices that stay where they are have no other label in their cell.
//!
//! Only the edges of a cell matter for the points in it, and for the region of a label only those at its corners. What two
//! polygons have in common is in cells that both pass through, so they need no test if all polygons of both labels around
//! the edges of these cells pass. Corners of a label that are not connected along edges of a cell count as different
//! labels in it, each with a loop of its own.

use super::cells::Cell;
use super::cube_loops::cube_loops;
use super::label_grid::BACKGROUND;
use super::nets::{AROUND, GAP, Nets, halves};
use super::zone::{Polygon, Zone, pair};
use crate::math::Vec3;

/// Largest distance of a returned position from the position of its cell, with room to spare: half a gap and rounding.
const DISPLACED: f32 = 1.3 * GAP / 2.0;

/// How surfaces pass through a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passage {
    /// That of one label, with one vertex, which is not moved from the position of the cell.
    One,
    /// Those of two labels, with one vertex each, which are moved to opposite sides: the corners of the label of lower
    /// number, as bits.
    Two(u8),
    /// Otherwise.
    More,
}

impl Passage {
    /// Returns how surfaces pass through a cell.
    pub fn of(cell: &Cell) -> Self {
        match (cell.simple, pair(cell)) {
            (1, _) => Self::One,
            (2, Some([lower, _])) => Self::Two(cell.case(lower) as u8),
            _ => Self::More,
        }
    }
}

impl Zone {
    /// Returns how surfaces pass through the cells of a polygon; `None` if not all of them move.
    fn passages_of(&self, polygon: &Polygon) -> Option<[Passage; 4]> {
        let mut passages = [Passage::More; 4];
        for (passage, &i) in passages.iter_mut().zip(&polygon.cells) {
            *passage = *self.passages.get(i as usize)?;
        }
        Some(passages)
    }

    /// Returns whether a polygon is in the envelope of its edge, and the vertices of both labels are moved to their sides of it.
    /// If so for all polygons of a label around the edges of a cell, its surface stays in its own region there.
    pub fn is_clear(&self, nets: &Nets, polygon: &Polygon) -> bool {
        if polygon.is_divided || nets.rounding() > DISPLACED - GAP / 2.0 {
            return false;
        }
        let Some(passages) = self.passages_of(polygon) else { return false };
        let frame = Frame::of(polygon);
        // With the rounding of the returned surface: this decides which triangles there are.
        let [half, _] = halves(self.corners(polygon).map(|(middle, offset)| middle + offset));
        let from = usize::from(!half.contains(&2));
        let order = [0, 1, 2, 3].map(|i| (from + i) % 4);
        let corners = order.map(|i| {
            let [b, c] = AROUND[i].map(|n| n as f32 - 0.5);
            frame.turn(self.offsets[polygon.cells[i] as usize]) + Vec3::new(b, c, 0.0)
        });
        if !is_in_envelope(corners) {
            return false;
        }
        let is_moved_inwards = |triangle: [usize; 3]| {
            let [a, b, c] = triangle.map(|i| corners[i]);
            let [u, v] = [b - a, c - a];
            let normal = u.cross(v);
            let least = nets.rounding() * normal.length()
                + DISPLACED * DISPLACED * (u.length_squared() + v.length_squared() + 2.0 + 4.0 * DISPLACED);
            // Normals are towards the label of the higher number.
            let is_inwards =
                |clear: Vec3, side: f32| normal.dot(frame.turn(clear)) * (side * GAP / 2.0) > least;
            triangle.iter().map(|&i| order[i]).all(|i| match passages[i] {
                Passage::One => true,
                Passage::Two(case) => is_inwards(cube_loops()[usize::from(case)].clear[0], -1.0),
                Passage::More => {
                    let cell = nets.cells.get(self.slots[polygon.cells[i] as usize]);
                    let clear = |number| clear_at(cell, number, polygon.edge_of(i));
                    polygon.ordered_labels().iter().zip([-1.0, 1.0]).all(|(&number, side)| {
                        number == BACKGROUND || clear(number).is_some_and(|clear| is_inwards(clear, side))
                    })
                }
            })
        };
        is_moved_inwards([0, 1, 2]) && is_moved_inwards([0, 2, 3])
    }
}

/// Returns the direction in which the vertex of a label at an edge of a cell moves to keep clear of others; `None` if its loop
/// is not around corners of its own.
fn clear_at(cell: &Cell, number: u16, edge: usize) -> Option<Vec3> {
    let loops = &cube_loops()[cell.case(number)];
    loops.is_each_around_own.then(|| loops.clear[usize::from(loops.of_edge[edge])])
}

/// The axes seen from the label of the higher number along the edge of a polygon.
struct Frame {
    axes: [usize; 3],
    sign: f32,
}

impl Frame {
    fn of(polygon: &Polygon) -> Self {
        let [low, high] = polygon.labels;
        let sign = if low < high { 1.0 } else { -1.0 };
        Self { axes: polygon.axes.map(usize::from), sign }
    }

    fn turn(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = self.axes.map(|axis| v[axis]);
        Vec3::new(x, y, z * self.sign)
    }
}

/// Returns whether a polygon divided between its first and third corner is in the envelope of the edge along z, half a voxel
/// to each side of the origin, even with corners a little displaced. Corners are around it counter-clockwise, in the
/// cells in which they are.
fn is_in_envelope([a, b, c, d]: [Vec3; 4]) -> bool {
    let area = |p: Vec3, q: Vec3| p.x * q.y - p.y * q.x;
    // Positive if the diagonal passes the edge on the side of `b`.
    let side = area(a, c);
    // Whether the ends of the edge are surely on different sides of the plane of a triangle with the diagonal.
    let divides = |from: Vec3, tip: Vec3, to: Vec3, side: f32| {
        let [first, second] = [area(from, tip), area(tip, to)];
        let height = second * from.z + first * to.z - side * tip.z;
        let reach = |p: Vec3| p.x * p.x + p.y * p.y + (p.z.abs() + 0.5) * (p.z.abs() + 0.5);
        let least = 2.0 * DISPLACED * (reach(from) + reach(tip) + reach(to) + 6.0 * DISPLACED);
        first + second - side - 2.0 * height.abs() > least
    };
    // The diagonal itself may be displaced from one side to the other.
    (side < -3.0 * DISPLACED || divides(a, b, c, side)) && (side > 3.0 * DISPLACED || divides(c, d, a, -side))
}
