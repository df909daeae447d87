//! Sweep over the rows of a grid with the triangles that may reach each, for scan conversion of surfaces.

use crate::math::{DVec3, Groups};
use crate::pauses::Pauses;

/// Calls `visit` for each row of voxels along x that a triangle may reach, rows in order: with y and z of the row and
/// the indices of the triangles whose bounding boxes come within `reach` voxels of it, in a deterministic order. Pauses
/// meanwhile. `positions` are in voxel indices; `dims` are the dimensions of the grid.
///
/// Memory is linear in the number of triangles and in that of slices and rows of a slice, whatever else the size of the
/// grid.
pub(super) async fn for_each_row(
    (positions, triangles): (&[DVec3], &[[u32; 3]]),
    dims: [usize; 3],
    reach: f64,
    mut visit: impl FnMut(usize, usize, &[u32]),
    pauses: &Pauses,
) {
    let mut slices = slices((positions, triangles), dims[2], reach);
    while let Some((z, in_slice)) = slices.next() {
        let span = |t: u32| span(positions, triangles[t as usize], 1, reach, dims[1]);
        let (mut rows, mut tested) = (Steps::new(in_slice, dims[1], span), 0);
        while let Some((y, in_row)) = rows.next() {
            visit(y, z, in_row);
            tested += in_row.len();
            if tested >= TRIANGLES_AT_ONCE {
                pauses.after(tested / TRIANGLES_PER_UNIT).await;
                tested = 0;
            }
        }
        pauses.after(1 + tested / TRIANGLES_PER_UNIT).await;
    }
}

/// Triangles in rows of voxels that are a unit of work.
pub(super) const TRIANGLES_PER_UNIT: usize = 32;

/// The number of triangles in rows of voxels that are visited between pauses.
pub(super) const TRIANGLES_AT_ONCE: usize = 64 * TRIANGLES_PER_UNIT;

/// Returns those of `count` slices across z that a triangle may reach, in order: z and the indices of the triangles whose
/// bounding boxes come within `reach` voxels of it, in a deterministic order.
pub(super) fn slices((positions, triangles): (&[DVec3], &[[u32; 3]]), count: usize, reach: f64) -> Steps {
    let all: Vec<u32> = (0..triangles.len() as u32).collect();
    Steps::new(&all, count, |t| span(positions, triangles[t as usize], 2, reach, count))
}

/// Returns the first and the last of `count` layers of voxels along `axis` that the bounding box of a triangle comes
/// within `reach` of; `None` if there are none.
#[inline]
pub(super) fn span(
    positions: &[DVec3],
    triangle: [u32; 3],
    axis: usize,
    reach: f64,
    count: usize,
) -> Option<[u32; 2]> {
    let [low, high] = range(triangle.map(|v| positions[v as usize][axis]));
    span_of(low - reach, high + reach, count)
}

/// Returns the lowest and the highest of three numbers.
fn range([a, b, c]: [f64; 3]) -> [f64; 2] {
    // Comparisons, since `f64::min` of variables is a call in wasm.
    let [low, high] = if a < b { [a, b] } else { [b, a] };
    [if c < low { c } else { low }, if c > high { c } else { high }]
}

/// Returns the first and the last integer of 0 to `count` − 1 that are within `low..=high`; `None` if there are none.
fn span_of(low: f64, high: f64, count: usize) -> Option<[u32; 2]> {
    let end = count as f64 - 1.0;
    // Also refuses NaN.
    if !(low <= end && high >= 0.0) {
        return None;
    }
    let first = if low > 0.0 { low.ceil() } else { 0.0 };
    let last = if high < end { high.floor() } else { end };
    (first <= last).then_some([first as u32, last as u32])
}

/// The numbers below a count that some item's span contains, in order, with these items.
pub(super) struct Steps {
    count: usize,
    /// Items and the ends of their spans, by the beginnings of these.
    by_first: Groups<(u32, u32)>,
    /// The next number.
    step: usize,
    /// The items whose spans contain the last number, and the ends of their spans.
    active: Vec<u32>,
    last: Vec<u32>,
}

impl Steps {
    fn new(items: &[u32], count: usize, span: impl Fn(u32) -> Option<[u32; 2]>) -> Self {
        let spans = items.iter().filter_map(|&item| Some((item, span(item)?)));
        let by_first = Groups::new(count, spans.map(|(item, [first, last])| (first, (item, last))));
        Self { count, by_first, step: 0, active: Vec::new(), last: Vec::new() }
    }

    /// Returns the next number, and the items whose spans contain it.
    pub(super) fn next(&mut self) -> Option<(usize, &[u32])> {
        while self.step < self.count {
            let step = self.step;
            self.step += 1;
            drop_ended(&mut self.active, &mut self.last, step as u32);
            for &(item, end) in self.by_first.of(step) {
                self.active.push(item);
                self.last.push(end);
            }
            if !self.active.is_empty() {
                return Some((step, &self.active));
            }
        }
        None
    }
}

/// Removes the items that end before `step`; `last` is the last step of each active item.
fn drop_ended(active: &mut Vec<u32>, last: &mut Vec<u32>, step: u32) {
    let mut kept = 0;
    for k in 0..active.len() {
        if last[k] >= step {
            (active[kept], last[kept]) = (active[k], last[k]);
            kept += 1;
        }
    }
    active.truncate(kept);
    last.truncate(kept);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn sweep(
        surface: (&[DVec3], &[[u32; 3]]),
        dims: [usize; 3],
        reach: f64,
        visit: impl FnMut(usize, usize, &[u32]),
    ) {
        finished(for_each_row(surface, dims, reach, visit, &Pauses::default()));
    }

    #[test]
    fn rows_have_the_triangles_whose_boxes_reach_them() {
        let mut random = Random::new(2);
        let mut next = || random.unit() * 14.0 - 3.0;
        let positions: Vec<DVec3> = (0..90).map(|_| DVec3::new(next(), next(), next())).collect();
        let triangles: Vec<[u32; 3]> = (0..30).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        for reach in [0.0, 0.5] {
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            let add = |y, z, reached: &[u32]| found.extend(reached.iter().map(|t| [z, y, *t as usize]));
            sweep((&positions, &triangles), [5, 8, 7], reach, add);
            for (z, y, t) in (0..7 * 8 * 30).map(|i| (i / 240, i / 30 % 8, i % 30)) {
                let reaches = |at: usize, axis: usize| {
                    let along = triangles[t].map(|v| positions[v as usize][axis] - at as f64);
                    along.iter().any(|d| *d <= reach) && along.iter().any(|d| *d >= -reach)
                };
                if reaches(z, 2) && reaches(y, 1) {
                    expected.push([z, y, t]);
                }
            }
            found.sort_unstable();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn triangles_beyond_the_grid_and_not_finite_ones_reach_nothing() {
        let far = [DVec3::splat(f64::NAN), DVec3::splat(f64::INFINITY), DVec3::splat(-1e60)];
        let triangles = [[0, 0, 0], [2, 2, 2]];
        sweep((&far, &triangles), [4, 4, 4], 0.5, |y, z, _| panic!("{y} {z}"));
        sweep((&[], &[]), [4, 4, 4], 0.5, |y, z, _| panic!("{y} {z}"));
    }
}
