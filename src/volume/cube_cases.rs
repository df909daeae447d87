//! The triangles of marching cubes for each of the 256 cases (sets of inside corners of a cube), derived from the
//! geometry of the cube.
//!
//! Corner c of a cube lies at dx = bit 2, dz = bit 1, dy = bit 0 of c, and bit c of a case is set if corner c is
//! inside. On each face the surface separates every connected run of inside corners from the rest; two inside corners
//! that are diagonally opposite on a face are separated. The rule depends on one face only, so the two cubes that share
//! a face always agree, and every cut edge of a cube (with one end inside) lies on exactly one closed loop.
//!
//! Each loop is filled by the triangulation of least area (vertices at the edges' midpoints) among those in which no
//! diagonal joins two edges of one face. A diagonal within a face could be used by the neighbouring cube, too, and the
//! edge would then have four triangles. For loops of up to six, any such triangulation is free of self-intersections
//! wherever the vertices lie on their edges. Some of the sixteen triangulations of a loop of seven are not, but the one
//! of least area is; `tests::no_case_intersects_itself` verifies this.

use std::sync::OnceLock;

/// The twelve edges of a marching cubes cube: the axis of each (0 = x, 1 = y, 2 = z) and the offset [dx, dy, dz] of its
/// start from the cube's origin.
pub(crate) const EDGES: [(usize, [usize; 3]); 12] = [
    (0, [0, 0, 0]),
    (0, [0, 1, 0]),
    (0, [0, 0, 1]),
    (0, [0, 1, 1]),
    (1, [0, 0, 0]),
    (1, [1, 0, 0]),
    (1, [0, 0, 1]),
    (1, [1, 0, 1]),
    (2, [0, 0, 0]),
    (2, [1, 0, 0]),
    (2, [0, 1, 0]),
    (2, [1, 1, 0]),
];

/// The edges along x, y and z that end in the cube's far corner, as indices into [`EDGES`]. When cubes are processed in
/// index order, no earlier cube contains them, so their vertices are created with this cube.
pub(super) const FAR_EDGES: [usize; 3] = [3, 7, 11];

/// The part of the surface in a cube of one marching cubes case (set of inside corners).
pub(super) struct Case {
    /// For each triangle, the three cube edges on which its vertices lie, as indices into [`EDGES`]; counter-clockwise
    /// seen from outside.
    pub(super) triangles: Vec<[u8; 3]>,
    /// Bit k is set if edge `FAR_EDGES[k]` is cut by the surface, so that this cube creates the vertex on it.
    pub(super) far_cuts: u8,
}

/// Returns the table of all 256 marching cubes cases, indexed by the inside corners of a cube as bits; computed at the
/// first call.
pub(super) fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| (0..256).map(derive).collect())
}

fn derive(case: usize) -> Case {
    let mut triangles = Vec::new();
    let mut far_cuts = 0;
    for contour in loops(case) {
        triangulate(&contour, &mut triangles);
        for (bit, edge) in FAR_EDGES.iter().enumerate() {
            far_cuts |= u8::from(contour.contains(edge)) << bit;
        }
    }
    Case { triangles, far_cuts }
}

/// Returns the number of a cube's corner, 0 to 7, from its offset from the cube's origin. In a marching cubes case, bit
/// `corner` is set if the corner is inside.
pub(crate) fn corner([dx, dy, dz]: [usize; 3]) -> usize {
    dy | dz << 1 | dx << 2
}

/// Returns a table of the edge (index into [`EDGES`]) between each pair of adjacent corners of a cube; entries of other
/// pairs are meaningless.
fn edges_between() -> [[usize; 8]; 8] {
    let mut table = [[0; 8]; 8];
    for (edge, &(axis, offset)) in EDGES.iter().enumerate() {
        let mut far = offset;
        far[axis] += 1;
        let (a, b) = (corner(offset), corner(far));
        (table[a][b], table[b][a]) = (edge, edge);
    }
    table
}

/// Returns the numbers of the four corners of each face of a cube, counter-clockwise seen from outside the cube.
fn faces() -> [[usize; 4]; 6] {
    [0, 1, 2, 3, 4, 5].map(|face| {
        let (axis, side) = (face / 2, face % 2);
        let round = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
            let mut offset = [0; 3];
            (offset[axis], offset[(axis + 1) % 3], offset[(axis + 2) % 3]) = (side, u, v);
            corner(offset)
        });
        if side == 1 { round } else { [round[3], round[2], round[1], round[0]] }
    })
}

/// Returns the closed loops of cut edges (indices into [`EDGES`]) of a marching cubes case, oriented so that the
/// triangles that fill them face outwards.
pub(crate) fn loops(case: usize) -> Vec<Vec<usize>> {
    let mut next = next_on_loop(case);
    let mut out = Vec::new();
    for start in 0..EDGES.len() {
        let mut contour = Vec::new();
        let mut edge = start;
        while let Some(after) = next[edge].take() {
            contour.push(edge);
            edge = after;
        }
        if !contour.is_empty() {
            out.push(contour);
        }
    }
    out
}

/// Returns, for each of the twelve edges of a cube that is cut in this case, the next cut edge on its loop; `None` for
/// edges that are not cut.
fn next_on_loop(case: usize) -> [Option<usize>; 12] {
    let inside = |corner: usize| case >> corner & 1 == 1;
    let between = edges_between();
    let mut next = [None; 12];
    for face in faces() {
        for k in 0..4 {
            if inside(face[k]) || !inside(face[(k + 1) % 4]) {
                continue;
            }
            let mut last = (k + 1) % 4;
            while inside(face[(last + 1) % 4]) {
                last = (last + 1) % 4;
            }
            let leave = between[face[last]][face[(last + 1) % 4]];
            let enter = between[face[k]][face[(k + 1) % 4]];
            next[enter] = Some(leave);
        }
    }
    next
}

/// Returns whether two edges of the cube lie on a common face, so that no diagonal of a triangulation may join them.
fn share_face(a: usize, b: usize) -> bool {
    let on = |edge: usize, axis: usize, side: usize| EDGES[edge].0 != axis && EDGES[edge].1[axis] == side;
    (0..3).any(|axis| (0..2).any(|side| on(a, axis, side) && on(b, axis, side)))
}

/// Appends the triangulation of least area of a loop of cut edges (`contour`) to `out`. It is found by dynamic
/// programming over the ranges i..=j of the loop: `best[i][j]` is the least area of a triangulation of the range,
/// closed by the diagonal from i to j, and the vertex k that achieves it.
fn triangulate(contour: &[usize], out: &mut Vec<[u8; 3]>) {
    let n = contour.len();
    let mut best = vec![vec![(0.0, 0); n]; n];
    for length in 2..n {
        for i in 0..n - length {
            let j = i + length;
            let closes = length == n - 1 || !share_face(contour[i], contour[j]);
            best[i][j] = (f64::INFINITY, i + 1);
            for k in i + 1..j {
                let area = best[i][k].0 + best[k][j].0 + midpoint_area([contour[i], contour[k], contour[j]]);
                if closes && area < best[i][j].0 {
                    best[i][j] = (area, k);
                }
            }
        }
    }
    collect(contour, &best, 0, n - 1, out);
}

fn collect(contour: &[usize], best: &[Vec<(f64, usize)>], i: usize, j: usize, out: &mut Vec<[u8; 3]>) {
    if j < i + 2 {
        return;
    }
    let k = best[i][j].1;
    collect(contour, best, i, k, out);
    collect(contour, best, k, j, out);
    out.push([contour[i], contour[k], contour[j]].map(|edge| edge as u8));
}

/// Returns twice the area of the triangle between the midpoints of three edges of the unit cube, to compare
/// triangulations.
fn midpoint_area(edges: [usize; 3]) -> f64 {
    let [a, b, c] = edges.map(|edge| point_on(edge, 0.5));
    (b - a).cross(c - a).length()
}

/// Returns the point at fraction `t` of edge number `edge` of the unit cube.
fn point_on(edge: usize, t: f64) -> crate::math::DVec3 {
    let (axis, offset) = EDGES[edge];
    let mut p = offset.map(|o| o as f64);
    p[axis] += t;
    p.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Random};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a random position of a vertex on its cube edge, as a fraction in [1/256, 255/256], concentrated at both
    /// ends, where self-intersections are likeliest.
    fn random_fraction(random: &mut Random) -> f64 {
        let t = match random.below(3) {
            0 => random.unit(),
            1 => random.unit() * 0.02,
            _ => 1.0 - random.unit() * 0.02,
        };
        t.clamp(1.0 / 256.0, 255.0 / 256.0)
    }

    fn volume6(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
        (b - a).cross(c - a).dot(d - a)
    }

    /// Returns whether the open segment p-q intersects the open triangle.
    fn pierces(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
        let ends = volume6(a, b, c, p) * volume6(a, b, c, q);
        let around = [volume6(p, q, a, b), volume6(p, q, b, c), volume6(p, q, c, a)];
        ends < -1e-24 && (around.iter().all(|&v| v > 1e-12) || around.iter().all(|&v| v < -1e-12))
    }

    fn sides(t: [u8; 3]) -> [[u8; 2]; 3] {
        [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]
    }

    fn one_pierces(a: [u8; 3], b: [u8; 3], points: &[DVec3; 12]) -> bool {
        let at = |edge: u8| points[usize::from(edge)];
        sides(a).iter().any(|[p, q]| !b.contains(p) && !b.contains(q) && pierces(at(*p), at(*q), b.map(at)))
    }

    #[test]
    fn no_case_intersects_itself() {
        let mut random = Random::new(7);
        for (number, case) in cases().iter().enumerate() {
            for _ in 0..200 {
                let points: [DVec3; 12] = std::array::from_fn(|e| point_on(e, random_fraction(&mut random)));
                for (i, &a) in case.triangles.iter().enumerate() {
                    for &b in &case.triangles[..i] {
                        let intersect = one_pierces(a, b, &points) || one_pierces(b, a, &points);
                        assert!(!intersect, "case {number}: {a:?} and {b:?} intersect at {points:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn no_diagonal_lies_in_a_face() {
        for case in cases() {
            for t in &case.triangles {
                for [a, b] in sides(*t) {
                    let uses =
                        |p, q| case.triangles.iter().flat_map(|t| sides(*t)).filter(|s| *s == [p, q]).count();
                    assert_eq!(uses(a, b), 1);
                    let is_diagonal = uses(b, a) == 1;
                    assert_eq!(is_diagonal, !share_face(usize::from(a), usize::from(b)));
                }
            }
        }
    }

    #[test]
    fn every_cut_edge_has_a_vertex() {
        for (number, case) in cases().iter().enumerate() {
            for (edge, &(axis, offset)) in EDGES.iter().enumerate() {
                let mut far = offset;
                far[axis] += 1;
                let cut = (number >> corner(offset) ^ number >> corner(far)) & 1 == 1;
                let used = case.triangles.iter().flatten().any(|&e| usize::from(e) == edge);
                assert_eq!(cut, used, "case {number}, edge {edge}");
            }
            assert!(case.triangles.len() <= 5);
        }
    }
}
