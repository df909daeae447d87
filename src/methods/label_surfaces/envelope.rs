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
//! Only the edges of a cell matter for the points in it: what two polygons have in common is in cells that both are
//! around, so it is enough if all polygons around the edges of these pass.

use super::cells::Cell;
use super::cube_loops::cube_loops;
use super::label_grid::BACKGROUND;
use super::nets::{AROUND, GAP, Nets};
use super::zone::{Polygon, Zone, pair};
use crate::math::Vec3;

/// Largest distance, in voxels, of a returned position in single precision from that in index space.
const ROUNDING: f32 = 1.1e-3;
/// Largest distance of a returned position from the position of its cell, with room to spare: half a gap and rounding.
const DISPLACED: f32 = GAP / 2.0 + 1.5 * ROUNDING;

/// How surfaces pass through a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passage {
    /// That of one label, with one vertex, which is not moved from the position of the cell.
    One,
    /// Those of two labels, with one vertex each, which are moved to opposite sides: the corners of the label of lower
    /// number, as bits.
    Two(u8),
    /// Those of several labels, with one vertex each.
    More,
    /// Otherwise: no test of one polygon is made.
    Other,
}

impl Passage {
    /// Returns how surfaces pass through a cell.
    pub fn of(cell: &Cell) -> Self {
        if !cell.is_single || cell.is_saddle || cell.has_diagonal {
            return Self::Other;
        }
        match pair(cell) {
            Some([BACKGROUND, _]) => Self::One,
            Some([lower, _]) => Self::Two(cell.case(lower) as u8),
            None => Self::More,
        }
    }
}

impl Zone {
    /// Returns whether a polygon is in the envelope of its edge, and both labels' vertices are moved to their sides of it: if
    /// all around the edges of a cell are, no surfaces intersect in it.
    pub fn is_clear(&self, nets: &Nets, polygon: &Polygon) -> bool {
        let passages = polygon.cells.map(|i| self.passages.get(i as usize).copied().unwrap_or(Passage::Other));
        if passages.contains(&Passage::Other) {
            return false;
        }
        let frame = Frame::of(polygon);
        let offsets = polygon.cells.map(|i| self.offsets[i as usize]);
        let corner = |i: usize| {
            let [b, c] = AROUND[i].map(|n| n as f32);
            frame.turn(offsets[i]) + Vec3::new(b, c, 0.0)
        };
        let corners = [0, 1, 2, 3].map(corner);
        // Divided as in `halves`, with the same rounding: this decides which triangles there are.
        let from = usize::from(corners[1].distance_squared(corners[3]) < corners[0].distance_squared(corners[2]));
        let order = [0, 1, 2, 3].map(|i| (from + i) % 4);
        let corners = order.map(|i| corners[i] - Vec3::new(0.5, 0.5, 0.0));
        if !is_in_envelope(corners) {
            return false;
        }
        let is_moved_inwards = |triangle: [usize; 3]| {
            let [a, b, c] = triangle.map(|i| corners[i]);
            let [u, v] = [b - a, c - a];
            let normal = u.cross(v);
            let least = ROUNDING * normal.length()
                + DISPLACED * DISPLACED * (u.length_squared() + v.length_squared() + 2.0 + 4.0 * DISPLACED);
            triangle.iter().all(|&i| {
                let i = order[i];
                let inwards = |number: u16, case: usize| {
                    let clear = frame.turn(cube_loops()[case].clear[0]) * (GAP / 2.0);
                    let height = normal.dot(clear);
                    // Normals are towards the label of the higher number.
                    (if number == frame.lower { -height } else { height }) > least
                };
                match passages[i] {
                    Passage::One => true,
                    Passage::Two(case) => inwards(frame.lower, case.into()),
                    _ => {
                        let cell = nets.cells.get(self.slots[polygon.cells[i] as usize]);
                        let mut labels = polygon.labels.iter().filter(|&&number| number != BACKGROUND);
                        labels.all(|&number| inwards(number, cell.case(number)))
                    }
                }
            })
        };
        is_moved_inwards([0, 1, 2]) && is_moved_inwards([0, 2, 3])
    }
}

/// The axes seen from the label of the higher number along the edge of a polygon, with the number of the other one.
struct Frame {
    axes: [usize; 3],
    sign: f32,
    lower: u16,
}

impl Frame {
    fn of(polygon: &Polygon) -> Self {
        let [low, high] = polygon.labels;
        let axis = usize::from(polygon.axis);
        let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
        if low < high {
            Self { axes: [next, last, axis], sign: 1.0, lower: low }
        } else {
            Self { axes: [last, next, axis], sign: -1.0, lower: high }
        }
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
