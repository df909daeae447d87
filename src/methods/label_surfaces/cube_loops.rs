//! How the surface of one label passes through a cell, for each of the 256 sets of a cell's corners that can have the
//! label.
//!
//! The surface crosses the edges of the cell between a corner with the label and one without. On its faces, the points
//! where it does so are connected to closed loops, as in marching cubes; there is one vertex per loop. Two
//! corners with the label that are diagonally opposite on a face are separated, so the label's voxels are connected
//! across their faces only.

use crate::math::Vec3;
use crate::volume::cube_cases::{EDGES, corner, loops};
use std::sync::OnceLock;

/// The loops of one set of corners.
#[derive(Clone, Copy, Debug, Default)]
pub struct CubeLoops {
    /// Number of loops, at most four.
    pub count: u8,
    /// The loop on which each edge of the cell is crossed; meaningless for edges that are not.
    pub of_edge: [u8; 12],
    /// For each loop, the direction in which its vertex moves to keep clear of other surfaces in the cell: towards the
    /// side with the label, 1 long where the surface is flat.
    pub clear: [Vec3; 4],
    /// Whether each loop is around corners of its own, which are connected along edges of the cell.
    pub is_each_around_own: bool,
}

/// Returns the loops for all sets of corners; bit c of the index is set if corner c has the label, numbered as in
/// marching cubes: dx = bit 2, dz = bit 1, dy = bit 0.
pub fn cube_loops() -> &'static [CubeLoops; 256] {
    static TABLE: OnceLock<[CubeLoops; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(derive))
}

/// Returns the index of the edge of a cell along `axis` at the offsets `b` and `c` (0 or 1) along the next two axes.
pub fn edge_at(axis: usize, b: usize, c: usize) -> usize {
    static TABLE: OnceLock<[[[usize; 2]; 2]; 3]> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut table = [[[0; 2]; 2]; 3];
        for (edge, (axis, offset)) in EDGES.iter().enumerate() {
            table[*axis][offset[(axis + 1) % 3]][offset[(axis + 2) % 3]] = edge;
        }
        table
    })[axis][b][c]
}

/// For each axis, the bit of a corner's number that is set if the corner is on the far side of its cell.
pub const FAR: [usize; 3] = [4, 1, 2];

/// Returns the corners of the near or the far face of a cell along an axis, around the face: the third one is opposite
/// the first.
pub fn face(axis: usize, far: bool) -> [usize; 4] {
    let (b, c) = (FAR[(axis + 1) % 3], FAR[(axis + 2) % 3]);
    [0, b, b | c, c].map(|corner| corner | if far { FAR[axis] } else { 0 })
}

/// Returns the edges of the near or the far face of a cell along an axis: each from a corner in the order of [`face`] to
/// the next one.
pub fn edges_across(axis: usize, far: bool) -> [usize; 4] {
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    // The other two coordinates of an edge along the next axis are the last one and `axis`, and so on.
    let at = usize::from(far);
    [edge_at(next, 0, at), edge_at(last, at, 1), edge_at(next, 1, at), edge_at(last, at, 0)]
}

/// Returns the offset of a corner from the origin of its cell.
pub fn corner_offset(corner: usize) -> [usize; 3] {
    FAR.map(|bit| usize::from(corner & bit != 0))
}

/// Returns the number of parts of a set of corners that are connected along edges of the cell.
fn connected(case: usize) -> usize {
    let (mut left, mut parts) = (case, 0);
    while left != 0 {
        let mut part = left & left.wrapping_neg();
        while let Some(next) = (0..8).find(|corner| {
            let is_beside = FAR.iter().any(|bit| part >> (corner ^ bit) & 1 == 1);
            is_beside && left & !part & (1 << corner) != 0
        }) {
            part |= 1 << next;
        }
        (left, parts) = (left & !part, parts + 1);
    }
    parts
}

fn derive(case: usize) -> CubeLoops {
    let mut found = CubeLoops::default();
    for (index, contour) in loops(case).iter().enumerate() {
        let mut clear = Vec3::ZERO;
        for &edge in contour {
            found.of_edge[edge] = index as u8;
            let (axis, offset) = EDGES[edge];
            let side = if case >> corner(offset) & 1 == 1 { -1.0 } else { 1.0 };
            clear[axis] += side / contour.len() as f32;
        }
        found.clear[index] = clear;
        found.count += 1;
    }
    found.is_each_around_own = usize::from(found.count) == connected(case);
    if case.count_ones() == 6 && found.count == 2 {
        // Around two opposite corners without the label, which each vertex must not approach: it moves towards its own
        // corner instead, less far than the vertices of that corner's label.
        found.clear.iter_mut().for_each(|clear| *clear *= -1.0 / 3.0);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn vertices_of_two_labels_and_of_all_loops_are_apart() {
        for case in 1..255 {
            let vertices: Vec<Vec3> = [case, 255 - case]
                .iter()
                .flat_map(|&case| {
                    let loops = &cube_loops()[case];
                    loops.clear[..usize::from(loops.count)].to_vec()
                })
                .collect();
            assert!((2..=8).contains(&vertices.len()), "case {case}: {vertices:?}");
            for (i, one) in vertices.iter().enumerate() {
                for other in &vertices[..i] {
                    assert!(one.distance(*other) > 0.2, "case {case}: {vertices:?}");
                }
            }
        }
    }

    #[test]
    fn offsets_of_corners_are_those_of_marching_cubes() {
        for number in 0..8 {
            assert_eq!(corner(corner_offset(number)), number);
        }
        for axis in 0..3 {
            for (b, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (found, offset) = EDGES[edge_at(axis, b, c)];
                assert_eq!(
                    (found, offset[axis], offset[(axis + 1) % 3], offset[(axis + 2) % 3]),
                    (axis, 0, b, c)
                );
            }
        }
    }
}
