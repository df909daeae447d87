//! Voxelisation: which voxels are inside a closed surface.

use super::row_sweep::{TRIANGLES_AT_ONCE, TRIANGLES_PER_UNIT, slices, span};
use crate::math::crossing::{crossing, is_beyond};
use crate::math::order::{combined_rank, sort_ranks};
use crate::math::{DVec2, DVec3};
use crate::mesh::TriangleMesh;
use crate::pauses::{Pauses, finished};
use fixedbitset::FixedBitSet;
use std::ops::Range;

/// Defines the inside of a closed surface by its winding number, the number of times it encloses a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillRule {
    /// Inside is where the winding number is not 0, whether triangles face outwards or inwards.
    NonZero,
    /// Inside is where the winding number is odd: part of what overlapping components enclose is outside.
    EvenOdd,
}

impl FillRule {
    fn is_inside(self, winding: i32) -> bool {
        match self {
            Self::NonZero => winding != 0,
            Self::EvenOdd => winding % 2 != 0,
        }
    }
}

/// Returns, for each voxel of a grid of `dims`, x fastest, whether its centre is inside the closed `surface`, whose
/// positions are voxel indices, by [`FillRule::EvenOdd`]. Used to find regions that a deformable model does not cover.
///
/// Exact, as [`visit_inside`].
pub fn voxels_inside(surface: &TriangleMesh, dims: [usize; 3]) -> FixedBitSet {
    finished(voxels_inside_in_slices(surface, dims, &Pauses::default()))
}

/// Does what [`voxels_inside`] does, and pauses meanwhile.
pub async fn voxels_inside_in_slices(
    surface: &TriangleMesh,
    dims: [usize; 3],
    pauses: &Pauses,
) -> FixedBitSet {
    let positions: Vec<DVec3> = surface.positions.iter().map(|p| p.as_dvec3()).collect();
    let mut inside = FixedBitSet::with_capacity(dims.iter().product());
    let surface = (&positions[..], &surface.triangles[..]);
    visit_inside(surface, dims, FillRule::EvenOdd, |range| inside.insert_range(range), pauses).await;
    inside
}

/// Calls `visit` with each run of voxels along x whose centres are inside a closed surface, as a range of voxel
/// indices, x fastest, in ascending order. The surface is given by positions, in voxel indices, and triangles; `dims`
/// are the dimensions of the grid.
///
/// Exact: a line along each row of voxels is intersected with the triangles by exact predicates. A voxel centre on the
/// surface counts as moved by an infinitesimal amount along x, y and z; see [`crossing`](crate::math::crossing). A
/// surface is closed if its edges have equally many triangles in both directions; it may intersect itself.
/// Pauses meanwhile.
pub async fn visit_inside(
    surface: (&[DVec3], &[[u32; 3]]),
    dims: [usize; 3],
    rule: FillRule,
    mut visit: impl FnMut(Range<usize>),
    pauses: &Pauses,
) {
    let (positions, triangles) = surface;
    let mut crossings = Vec::new();
    let mut slices = slices(surface, dims[2], 0.0);
    while let Some((z, near)) = slices.next() {
        let mut tested = 0;
        for &t in near {
            if tested >= TRIANGLES_AT_ONCE {
                pauses.after(tested / TRIANGLES_PER_UNIT).await;
                tested = 0;
            }
            tested += 1;
            let triangle = triangles[t as usize];
            let Some([first, last]) = span(positions, triangle, 1, 0.0, dims[1]) else { continue };
            let corners = triangle.map(|v| positions[v as usize]);
            tested += (last - first) as usize;
            for y in first..=last {
                let at = DVec2::new(y.into(), z as f64);
                let crossing = crossing(corners, at);
                if crossing != 0 {
                    let voxel = first_beyond(corners, crossing, at, dims[0]);
                    crossings.push(combined_rank(y, voxel as u32) << 1 | u64::from(crossing > 0));
                }
            }
        }
        sort_ranks(&mut crossings);
        for row in crossings.chunk_by(|a, b| row_of(*a) == row_of(*b)) {
            let start = dims[0] * (row_of(row[0]) + dims[1] * z);
            visit_runs(row, dims[0], rule, |run| visit(start + run.start..start + run.end));
        }
        crossings.clear();
        pauses.after(1 + tested / TRIANGLES_PER_UNIT).await;
    }
}

/// Returns the row, within its slice, of a crossing.
fn row_of(crossing: u64) -> usize {
    (crossing >> 33) as usize
}

/// Calls `visit` with the voxels of a row of `count` that are inside, given where its line meets the surface, in order: in the lowest bit
/// whether the surface is entered, and above it, in 32 bits, the first voxel beyond.
fn visit_runs(crossings: &[u64], count: usize, rule: FillRule, mut visit: impl FnMut(Range<usize>)) {
    let (mut winding, mut start) = (0, 0);
    for at_voxel in crossings.chunk_by(|a, b| a >> 1 == b >> 1) {
        let voxel = (at_voxel[0] >> 1) as u32 as usize;
        let before = rule.is_inside(winding);
        winding += at_voxel.iter().map(|crossing| 2 * (crossing & 1) as i32 - 1).sum::<i32>();
        if before && !rule.is_inside(winding) {
            visit(start..voxel);
        } else if !before {
            start = voxel;
        }
    }
    if rule.is_inside(winding) && start < count {
        visit(start..count);
    }
}

/// Returns the first voxel of a row of `count` at or beyond a triangle that the line through the row, at (y, z) = `at`,
/// crosses; `count` if there is none.
fn first_beyond(corners: [DVec3; 3], crossing: i32, at: DVec2, count: usize) -> usize {
    let beyond = |x: usize| is_beyond(corners, crossing, DVec3::new(x as f64, at.x, at.y));
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let x = a.x - (normal.y * (at.x - a.y) + normal.z * (at.y - a.z)) / normal.x;
    // Rounded; the predicate decides. Casts saturate, and NaN becomes 0.
    let guess = (x.ceil() as usize).min(count);
    if guess > 0 && beyond(guess - 1) {
        first_where(0..guess - 1, beyond)
    } else if guess < count && !beyond(guess) {
        first_where(guess + 1..count, beyond)
    } else {
        guess
    }
}

/// Returns the first number of a range for which `holds`, which also holds for all numbers after it; the end of the
/// range if there is none.
fn first_where(Range { mut start, mut end }: Range<usize>, holds: impl Fn(usize) -> bool) -> usize {
    while start < end {
        let middle = start + (end - start) / 2;
        if holds(middle) {
            end = middle;
        } else {
            start = middle + 1;
        }
    }
    start
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3, triangle};
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, icosahedron, joined, torus};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Compares each voxel with the expected value, if there is one.
    fn check(surface: &TriangleMesh, dims: [usize; 3], expected: impl Fn(Vec3) -> Option<bool>) {
        let (inside, mut checked) = (voxels_inside(surface, dims), [0; 2]);
        for (i, inside) in (0..dims.iter().product()).map(|i| (i, inside.contains(i))) {
            let p = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]].map(|k| k as f32);
            if let Some(expected) = expected(Vec3::from(p)) {
                assert_eq!(inside, expected, "at {p:?}");
                checked[usize::from(inside)] += 1;
            }
        }
        assert!(checked[0] > 100 && checked[1] >= 27, "{checked:?} checked");
    }

    fn moved(mut surface: TriangleMesh, by: Vec3) -> TriangleMesh {
        surface.positions.iter_mut().for_each(|p| *p += by);
        surface
    }

    /// Does what [`visit_inside`] does, without pauses.
    fn for_each_inside(
        surface: (&[DVec3], &[[u32; 3]]),
        dims: [usize; 3],
        rule: FillRule,
        visit: impl FnMut(Range<usize>),
    ) {
        finished(visit_inside(surface, dims, rule, visit, &Pauses::default()));
    }

    #[test]
    fn voxels_of_a_ball_and_its_hollow() {
        let at = Vec3::new(9.3, 8.1, 10.4);
        let outer = Mesh::icosphere(at, 7.0, 0.8).unwrap().to_triangles();
        let mut inner = Mesh::icosphere(at, 3.0, 0.8).unwrap().to_triangles();
        inner.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        check(&joined(&[outer, inner]), [20, 19, 21], |p| match p.distance(at) {
            d if (d - 3.0).abs() < 0.1 || (d - 7.0).abs() < 0.1 => None,
            d => Some(d > 3.0 && d < 7.0),
        });
    }

    /// Tests a cuboid placed so that all rays of the voxelisation pass through its edges or vertices.
    #[test]
    fn rays_along_edges_count_once() {
        let surface = moved(cuboid(Vec3::splat(4.0)), Vec3::splat(3.0));
        let bounds = surface
            .positions
            .iter()
            .fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
        check(&surface, [12, 12, 12], |p| {
            let beyond = (bounds.0 - p).max(p - bounds.1).max_element();
            (beyond != 0.0).then_some(beyond < 0.0)
        });
    }

    #[test]
    fn a_surface_beyond_the_grid_is_cut_off() {
        let surface = moved(torus(6.0, 2.0, 24, 12), Vec3::new(0.1, 0.2, 3.1));
        let inside = voxels_inside(&surface, [5, 7, 6]);
        let turned = voxels_inside(&moved(surface, Vec3::new(20.0, 20.0, 20.0)), [40, 40, 40]);
        for i in 0..5 * 7 * 6 {
            let [x, y, z] = [i % 5, i / 5 % 7, i / 35];
            assert_eq!(inside.contains(i), turned.contains(x + 20 + 40 * (y + 20 + 40 * (z + 20))));
        }
        assert!(voxels_inside(&TriangleMesh::default(), [2, 2, 2]).is_clear());
    }

    /// Returns the winding numbers of all voxel centres, each moved by `shift`, by solid angles.
    fn winding_numbers(surface: &TriangleMesh, dims: [usize; 3], shift: Vec3) -> Vec<i32> {
        let centre = |i: usize| {
            Vec3::new((i % dims[0]) as f32, (i / dims[0] % dims[1]) as f32, (i / dims[0] / dims[1]) as f32)
        };
        let angle = |p: Vec3| surface.corners().map(|corners| triangle::solid_angle(corners, p)).sum::<f64>();
        let count = dims.iter().product();
        (0..count).map(|i| (angle(centre(i) + shift) / (4.0 * std::f64::consts::PI)).round() as i32).collect()
    }

    /// Compares both rules with winding numbers by solid angles; returns the number of voxels inside.
    fn compare(surface: &TriangleMesh, dims: [usize; 3], shift: Vec3, case: &str) -> usize {
        let positions: Vec<DVec3> = surface.positions.iter().map(|p| p.as_dvec3()).collect();
        let mut inside = [0, 0];
        for (rule, count) in [FillRule::NonZero, FillRule::EvenOdd].into_iter().zip(&mut inside) {
            let mut found = vec![false; dims.iter().product()];
            let mut end = 0;
            for_each_inside((&positions, &surface.triangles), dims, rule, |run| {
                assert!(run.start >= end && run.end > run.start, "{case}");
                end = run.end;
                found[run].fill(true);
            });
            let winding = winding_numbers(surface, dims, shift);
            for (i, (found, winding)) in found.iter().zip(winding).enumerate() {
                assert_eq!(*found, rule.is_inside(winding), "{case}, {rule:?}, voxel {i}: {winding}");
            }
            *count = found.iter().filter(|inside| **inside).count();
        }
        inside[0]
    }

    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn voxels_inside_are_those_of_winding_numbers() {
        let mut inside = 0;
        for seed in 0..60 {
            let mut random = Random::new(seed);
            let mut vector = |size: f32| Vec3::from([(); 3].map(|()| size * random.unit() as f32));
            let ball = Mesh::icosphere(vector(8.0), 3.0, 2.0).unwrap().to_triangles();
            let mut surface = match seed % 3 {
                0 => ball,
                1 => moved(torus(3.0, 1.3, 11, 6), Vec3::new(4.0, 4.0, 3.0)),
                _ => joined(&[ball, moved(icosahedron(), vector(7.0)), torus(4.0, 1.5, 9, 5)]),
            };
            // Up to beyond recognition: surfaces then intersect themselves.
            let noise = [0.0, 0.3, 2.0, 6.0][seed as usize / 3 % 4];
            surface.positions.iter_mut().for_each(|p| *p += vector(noise));
            inside += compare(&surface, [9, 8, 7], Vec3::ZERO, &format!("seed {seed}"));
        }
        assert!(inside > 3000, "{inside}");
    }

    /// Vertices at voxel centres: most rows run through vertices, edges and triangles, many of which have no area.
    #[test]
    fn voxels_on_the_surface_are_moved_symbolically() {
        let mut inside = 0;
        for seed in 0..160 {
            let mut random = Random::new(seed);
            let mut surface = if seed % 2 == 0 { icosahedron() } else { torus(1.0, 0.5, 4, 3) };
            for p in &mut surface.positions {
                *p = Vec3::from([(); 3].map(|()| random.below(4) as f32));
            }
            // Each so much smaller than the one before that no determinant of these integers outweighs it.
            let shift = Vec3::new(1.0 / 64.0, 1.0 / 4096.0, 1.0 / 262_144.0);
            inside += compare(&surface, [4, 4, 4], shift, &format!("seed {seed}"));
        }
        assert!(inside > 400, "{inside}");
    }

    #[test]
    fn far_and_flat_triangles_do_not_mislead() {
        let positions = [[-1e30, -1e30, -1e30], [1e30, -1e30, -1e30], [0.0, 1e30, -1e30], [0.0, 0.0, 1e30]];
        let positions = positions.map(DVec3::from);
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mut count = 0;
        for_each_inside((&positions, &triangles), [5, 4, 3], FillRule::NonZero, |run| count += run.len());
        assert_eq!(count, 60);
        // Planes at so small an angle to the rows that x by division has no correct digit.
        let thin = [[-1e17, 0.5, 0.5], [1e17, 0.5, 0.5], [0.0, 1.0 + 1e-15, 2.0], [0.0, 2.0, 1.0 - 1e-15]];
        let thin = thin.map(DVec3::from);
        let mut found = Vec::new();
        for_each_inside((&thin, &triangles), [3, 3, 3], FillRule::NonZero, |run| found.extend(run));
        assert_eq!(found, [12, 13, 14]);
    }
}
