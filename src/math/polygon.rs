//! Triangulation of polygons with holes in the plane: holes are connected with their surroundings by bridges, then ears
//! are clipped. All decisions are exact, so the triangles cover the polygon without overlap, and none is degenerate.
//!
//! Faces of meshes are triangulated by the same means, but whatever their shape: files have faces that are not flat, or
//! that touch or intersect themselves.

use super::order::sort_pairs;
use super::predicates::orient2d;
use super::{DVec2, DVec3};
use crate::pauses::{Pauses, finished};

/// The part of a face's area by which a triangle of its fan may face backwards, by rounding.
const FOLD: f64 = 1e-6;

/// Numbers of corners that are sorted, and of those tested, in a unit of work.
const SORTED_PER_UNIT: usize = 32;
const TESTED_PER_UNIT: usize = 512;

/// Returns triangles that cover the interior of polygons, which is on the left of their edges: outer loops are
/// counter-clockwise, holes clockwise, and a hole may contain further polygons. Each loop lists indices into `points`;
/// all of them become corners, and no others. Triangles are counter-clockwise.
///
/// Returns `None` if a loop has fewer than three points or intersects itself or another one. The time is quadratic in
/// the number of points. Pauses meanwhile.
pub async fn triangulate(points: &[DVec2], loops: &[Vec<u32>], pauses: &Pauses) -> Option<Vec<[u32; 3]>> {
    let mut polygon = Polygon::new(points, loops)?;
    pauses.now().await;
    polygon.bridge_holes(pauses).await?;
    polygon.clip_ears(pauses).await
}

/// Returns triangles of a face with the given corners, as indices into them; `None` if the fan of the first corner is
/// right, as it is for convex faces, or if the face has no area.
///
/// There are always two triangles fewer than corners, and each edge of the face is an edge of one of them, so that faces
/// that share edges are still closed. The face is triangulated as it is seen along its mean normal. Where it intersects
/// itself there, or after `effort` tests, of which those made are subtracted, triangles may overlap.
pub fn triangulate_face(corners: &[DVec3], effort: &mut u64) -> Option<Vec<[u32; 3]>> {
    let normal = fan(corners).sum::<DVec3>();
    let fold = -FOLD * normal.length_squared();
    if !fold.is_finite() || fan(corners).all(|area| area.dot(normal) >= fold) {
        return None;
    }
    let points = seen_along(normal, corners);
    Some(Polygon::face(&points).clip_whatever(effort))
}

/// Iterates over the area vectors, twice as long as the areas, of the fan of the first corner.
fn fan(corners: &[DVec3]) -> impl Iterator<Item = DVec3> {
    let first = corners.first().copied().unwrap_or_default();
    corners.windows(2).skip(1).map(move |pair| (pair[0] - first).cross(pair[1] - first))
}

/// Returns points as seen against a direction, without the coordinate along which it is longest.
fn seen_along(direction: DVec3, points: &[DVec3]) -> Vec<DVec2> {
    let size = direction.abs();
    let axis = if size.z >= size.x && size.z >= size.y { 2 } else { usize::from(size.y >= size.x) };
    let (mut right, mut up) = ((axis + 1) % 3, (axis + 2) % 3);
    if direction[axis] < 0.0 {
        std::mem::swap(&mut right, &mut up);
    }
    points.iter().map(|p| DVec2::new(p[right], p[up])).collect()
}

/// Returns a number that is the same for equal points.
fn hash(point: DVec2) -> u64 {
    // Added to 0, negative zero is positive.
    let [x, y] = [point.x + 0.0, point.y + 0.0].map(f64::to_bits);
    x.rotate_left(32).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y
}

/// Corners of loops, doubly linked. A point has several corners once bridges end in it.
struct Polygon<'a> {
    points: &'a [DVec2],
    /// The point of each corner.
    point: Vec<u32>,
    next: Vec<usize>,
    previous: Vec<usize>,
    /// The lowest corner of each loop, by x, then y. The loop turns there in the direction in which it is oriented.
    loops: Vec<usize>,
}

impl<'a> Polygon<'a> {
    fn new(points: &'a [DVec2], loops: &[Vec<u32>]) -> Option<Self> {
        let mut polygon =
            Self { points, point: Vec::new(), next: Vec::new(), previous: Vec::new(), loops: Vec::new() };
        for corners in loops {
            let (first, count) = (polygon.point.len(), corners.len());
            if count < 3 {
                return None;
            }
            polygon.point.extend(corners);
            polygon.next.extend((0..count).map(|k| first + (k + 1) % count));
            polygon.previous.extend((0..count).map(|k| first + (k + count - 1) % count));
            let lowest = (first..first + count).min_by(|&i, &j| polygon.compare(i, j))?;
            polygon.loops.push(lowest);
        }
        Some(polygon)
    }

    /// Returns the corners of one loop, of which those in the same place have the same point.
    fn face(points: &'a [DVec2]) -> Self {
        let count = points.len();
        let mut pairs: Vec<(u64, u32)> = points.iter().map(|&p| hash(p)).zip(0..).collect();
        sort_pairs(&mut pairs);
        let mut point = vec![0; count];
        for same_hash in pairs.chunk_by(|a, b| a.0 == b.0) {
            let first = same_hash[0].1;
            for &(_, corner) in same_hash {
                let is_same = points[corner as usize] == points[first as usize];
                point[corner as usize] = if is_same { first } else { corner };
            }
        }
        let next = (1..count).chain([0]).collect();
        let previous = (0..count).map(|k| (k + count - 1) % count).collect();
        Self { points, point, next, previous, loops: Vec::new() }
    }

    fn at(&self, corner: usize) -> DVec2 {
        self.points[self.point[corner] as usize]
    }

    fn compare(&self, i: usize, j: usize) -> std::cmp::Ordering {
        let (p, q) = (self.at(i), self.at(j));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
    }

    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        orient2d([self.at(a), self.at(b), self.at(c)])
    }

    /// Returns the corners of a loop, from `first` on.
    fn corners(&self, first: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(first), move |&corner| {
            Some(self.next[corner]).filter(|&next| next != first)
        })
    }

    /// Connects each hole with a loop of lower corners, from the lowest hole on, so that only outer loops are left.
    async fn bridge_holes(&mut self, pauses: &Pauses) -> Option<()> {
        let mut holes = Vec::new();
        for &first in &self.loops {
            let turn = self.turn(self.previous[first], first, self.next[first]);
            if turn == 0.0 {
                return None;
            }
            if turn < 0.0 {
                holes.push(first);
            }
        }
        pauses.now().await;
        self.loops.retain(|first| !holes.contains(first));
        holes.sort_by(|&i, &j| self.compare(i, j));
        for hole in holes {
            let end = self.bridge_end(hole, pauses).await?;
            self.bridge(hole, end);
        }
        Some(())
    }

    /// Returns the nearest corner that is visible from the lowest corner of a hole, among those that are lower: such a
    /// corner always exists, and is of an outer loop, or of a lower hole.
    async fn bridge_end(&self, hole: usize, pauses: &Pauses) -> Option<usize> {
        let mut lower: Vec<usize> =
            (0..self.point.len()).filter(|&corner| self.compare(corner, hole).is_lt()).collect();
        let square = |corner: usize| self.at(corner).distance_squared(self.at(hole));
        lower.sort_by(|&i, &j| square(i).total_cmp(&square(j)).then(i.cmp(&j)));
        pauses.after(self.point.len() / SORTED_PER_UNIT).await;
        for end in lower {
            if self.sees(hole, end) && self.sees(end, hole) {
                pauses.after(self.point.len() / TESTED_PER_UNIT).await;
                if self.is_free(hole, end) {
                    return Some(end);
                }
            }
        }
        None
    }

    /// Returns whether the direction from one corner to another points into the interior of the polygon.
    fn sees(&self, from: usize, to: usize) -> bool {
        let (previous, next) = (self.previous[from], self.next[from]);
        let (in_turn, out_turn) = (self.turn(previous, from, to), self.turn(from, next, to));
        if self.turn(previous, from, next) > 0.0 {
            in_turn > 0.0 && out_turn > 0.0
        } else {
            in_turn > 0.0 || out_turn > 0.0
        }
    }

    /// Returns whether the segment between two corners touches no edge but those at its ends.
    fn is_free(&self, from: usize, to: usize) -> bool {
        let [p, q] = [self.point[from], self.point[to]];
        (0..self.point.len()).all(|start| {
            let end = self.next[start];
            let has_end = |point| self.point[start] == point || self.point[end] == point;
            has_end(p) || has_end(q) || !self.segments_touch([from, to], [start, end])
        })
    }

    fn segments_touch(&self, [a, b]: [usize; 2], [c, d]: [usize; 2]) -> bool {
        let (p, q, r, s) = (self.at(a), self.at(b), self.at(c), self.at(d));
        let are_apart = |low: DVec2, high: DVec2| low.x > high.x || low.y > high.y;
        if are_apart(p.min(q), r.max(s)) || are_apart(r.min(s), p.max(q)) {
            return false;
        }
        let is_one_side = |x: f64, y: f64| (x > 0.0 && y > 0.0) || (x < 0.0 && y < 0.0);
        !is_one_side(self.turn(a, b, c), self.turn(a, b, d))
            && !is_one_side(self.turn(c, d, a), self.turn(c, d, b))
    }

    /// Joins two loops by two opposite edges between their corners `a` and `b`, each of which gets a copy.
    fn bridge(&mut self, a: usize, b: usize) {
        let copy_of_a = self.point.len();
        let copy_of_b = copy_of_a + 1;
        self.point.extend([self.point[a], self.point[b]]);
        let (after_a, after_b) = (self.next[a], self.next[b]);
        self.next.extend([after_a, after_b]);
        self.previous.extend([copy_of_b, copy_of_a]);
        // a -> b's copy -> after b … b -> a's copy -> after a …
        self.next[a] = copy_of_b;
        self.previous[copy_of_b] = a;
        self.next[copy_of_b] = after_b;
        self.previous[after_b] = copy_of_b;
        self.next[b] = copy_of_a;
        self.previous[copy_of_a] = b;
        self.previous[after_a] = copy_of_a;
    }

    async fn clip_ears(&mut self, pauses: &Pauses) -> Option<Vec<[u32; 3]>> {
        let (mut triangles, mut effort) = (Vec::with_capacity(self.point.len()), u64::MAX);
        for first in self.loops.clone() {
            self.clip_ears_of(first, &mut triangles, &mut effort, |_, _| None, pauses).await?;
        }
        Some(triangles.into_iter().map(|corners| corners.map(|corner| self.point[corner as usize])).collect())
    }

    /// Returns the triangles of a face; where there is no ear, the flattest corner is clipped.
    fn clip_whatever(&mut self, effort: &mut u64) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.point.len());
        let flattest = |polygon: &Self, first: usize| {
            let size =
                |&corner: &usize| polygon.turn(polygon.previous[corner], corner, polygon.next[corner]).abs();
            polygon.corners(first).min_by(|a, b| size(a).total_cmp(&size(b)))
        };
        finished(self.clip_ears_of(0, &mut triangles, effort, flattest, &Pauses::default()));
        triangles
    }

    /// Clips the ears of the loop of a corner, and appends the triangles, as corners. Where there is no ear, `instead`
    /// chooses the corner to clip; `None` if it doesn't. After `effort` tests of points, the rest becomes a fan.
    async fn clip_ears_of(
        &mut self,
        first: usize,
        triangles: &mut Vec<[u32; 3]>,
        effort: &mut u64,
        instead: impl Fn(&Self, usize) -> Option<usize>,
        pauses: &Pauses,
    ) -> Option<()> {
        let mut left = self.corners(first).count();
        let (mut corner, mut misses) = (first, 0);
        while left > 3 {
            *effort = effort.saturating_sub(left as u64);
            pauses.after(left / TESTED_PER_UNIT).await;
            if misses > left {
                corner = instead(self, corner)?;
            } else if *effort > 0 && !self.is_ear(corner) {
                (corner, misses) = (self.next[corner], misses + 1);
                continue;
            }
            let (previous, next) = (self.previous[corner], self.next[corner]);
            triangles.push([previous, corner, next].map(|corner| corner as u32));
            self.next[previous] = next;
            self.previous[next] = previous;
            (left, misses) = (left - 1, 0);
            // Not the neighbour: fans of needles would develop. If there is no effort left, they may.
            corner = if *effort > 0 { self.next[next] } else { next };
        }
        let last = [self.previous[corner], corner, self.next[corner]];
        triangles.push(last.map(|corner| corner as u32));
        if self.turn(last[0], last[1], last[2]) > 0.0 { Some(()) } else { instead(self, corner).map(|_| ()) }
    }

    /// Returns whether the triangle of a corner and its neighbours is inside the polygon and touches none of its other
    /// points.
    fn is_ear(&self, corner: usize) -> bool {
        let (a, c) = (self.previous[corner], self.next[corner]);
        if self.turn(a, corner, c) <= 0.0 || !self.sees(a, c) || !self.sees(c, a) {
            return false;
        }
        let points = [a, corner, c].map(|corner| self.point[corner]);
        let [p, q, r] = [a, corner, c].map(|corner| self.at(corner));
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        let is_inside = |other: usize| {
            let at = self.at(other);
            let is_near = at.x >= low.x && at.x <= high.x && at.y >= low.y && at.y <= high.y;
            is_near
                && !points.contains(&self.point[other])
                && [[p, q], [q, r], [r, p]].iter().all(|&[from, to]| orient2d([from, to, at]) >= 0.0)
        };
        !self.corners(self.next[c]).take_while(|&other| other != a).any(is_inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn area(points: &[DVec2], corners: &[u32]) -> f64 {
        let at = |k: usize| points[corners[k % corners.len()] as usize];
        0.5 * (0..corners.len()).map(|k| at(k).perp_dot(at(k + 1))).sum::<f64>()
    }

    /// Triangulates, and checks that the triangles face upwards, use all points, and cover the polygon's area.
    fn assert_covers(points: &[DVec2], loops: &[Vec<u32>]) {
        let triangles =
            finished(triangulate(points, loops, &Pauses::default())).expect("the polygon is simple");
        assert!(triangles.iter().all(|t| area(points, t) > 0.0));
        let covered: f64 = triangles.iter().map(|t| area(points, t)).sum();
        let enclosed: f64 = loops.iter().map(|corners| area(points, corners)).sum();
        assert!((covered - enclosed).abs() < 1e-9 * enclosed, "{covered} of {enclosed}");
        let mut used: Vec<u32> = triangles.into_iter().flatten().collect();
        used.sort_unstable();
        used.dedup();
        assert_eq!(used.len(), loops.iter().map(Vec::len).sum::<usize>());
    }

    /// Appends a square with `per_side` points a side, counter-clockwise or clockwise, and returns its loop.
    fn square(points: &mut Vec<DVec2>, corner: DVec2, side: f64, per_side: u32, is_hole: bool) -> Vec<u32> {
        let first = points.len() as u32;
        for (from, to) in [([0, 0], [1, 0]), ([1, 0], [1, 1]), ([1, 1], [0, 1]), ([0, 1], [0, 0])] {
            let [from, to] = [from, to].map(|[x, y]: [i32; 2]| DVec2::new(x.into(), y.into()));
            let along = |k: u32| corner + side * from.lerp(to, f64::from(k) / f64::from(per_side));
            points.extend((0..per_side).map(along));
        }
        let corners = first..points.len() as u32;
        if is_hole { corners.rev().collect() } else { corners.collect() }
    }

    #[test]
    fn squares_with_points_on_their_sides_and_nested_holes() {
        let mut points = Vec::new();
        let mut loops = vec![square(&mut points, DVec2::ZERO, 12.0, 3, false)];
        for (x, y) in [(1.0, 1.0), (5.0, 1.0), (1.0, 5.0), (9.0, 9.0)] {
            loops.push(square(&mut points, DVec2::new(x, y), 2.0, 2, true));
        }
        loops.push(square(&mut points, DVec2::new(5.0, 5.0), 3.0, 4, true));
        loops.push(square(&mut points, DVec2::new(6.0, 6.0), 1.0, 1, false));
        assert_covers(&points, &loops);
    }

    #[test]
    fn random_stars_with_random_holes() {
        for seed in 0..300 {
            let mut random = Random::new(seed);
            let mut points = Vec::new();
            let mut star = |centre: DVec2, least: f64, most: f64, is_hole: bool| {
                let (first, count) = (points.len() as u32, 3 + random.below(40));
                for k in 0..count {
                    let angle = std::f64::consts::TAU * f64::from(k) / f64::from(count);
                    let (sine, cosine) = libm::sincos(angle);
                    let radius = least + (most - least) * random.unit();
                    points.push(centre + radius * DVec2::new(cosine, sine));
                }
                let corners = first..first + count;
                if is_hole { corners.rev().collect() } else { corners.collect() }
            };
            let mut loops: Vec<Vec<u32>> = vec![star(DVec2::ZERO, 20.0, 40.0, false)];
            for (x, y) in [(0.0, 0.0), (4.5, 0.0), (0.0, -4.5), (-3.0, 3.0)] {
                loops.push(star(DVec2::new(x, y), 0.3, 2.0, true));
            }
            let outer = loops[0].len();
            // A triangle's inner circle has half its radius: holes near its corner would not be inside.
            if outer > 4 {
                assert_covers(&points, &loops);
            }
        }
    }

    /// Triangulates a face, checks that each of its edges is one of a triangle's and all others are shared by two, and
    /// returns the area of all triangles.
    fn face_area(corners: &[DVec3]) -> f64 {
        let count = corners.len() as u32;
        let fan = || (1..count - 1).map(|k| [0, k, k + 1]).collect();
        let triangles = triangulate_face(corners, &mut 100_000).unwrap_or_else(fan);
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut open: Vec<[u32; 2]> =
            edges.clone().filter(|&[a, b]| !edges.clone().any(|e| e == [b, a])).collect();
        open.sort_unstable();
        assert_eq!(open, (0..count).map(|k| [k, (k + 1) % count]).collect::<Vec<_>>());
        let area = |&[a, b, c]: &[u32; 3]| {
            let [p, q, r] = [a, b, c].map(|k| corners[k as usize]);
            (q - p).cross(r - p).length() / 2.0
        };
        triangles.iter().map(area).sum()
    }

    /// Returns corners in a plane that is tilted and far away; lengths are kept.
    fn tilted(corners: &[[f64; 2]]) -> Vec<DVec3> {
        let (right, up) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.64, 0.6, -0.48));
        corners.iter().map(|&[x, y]| DVec3::new(8e3, -2e3, 7.0) + right * x + up * y).collect()
    }

    #[test]
    fn concave_faces_are_covered_once() {
        let dart = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
        let step = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        // The outline with a hole in it, along a slit there and back.
        let keyhole = [
            [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]],
            [[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0], [1.0, 1.0]],
        ];
        let twice = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 4.0]];
        for (face, expected) in
            [(&dart[..], 4.0), (&step, 3.0), (keyhole.as_flattened(), 12.0), (&twice, 4.0)]
        {
            for turn in 0..face.len() {
                let mut face = face.to_vec();
                face.rotate_left(turn);
                let area = face_area(&tilted(&face));
                assert!((area - expected).abs() < 1e-9, "{area} {expected} {turn}");
                face.reverse();
                assert!((face_area(&tilted(&face)) - expected).abs() < 1e-9, "{expected} {turn}");
            }
        }
    }

    #[test]
    fn convex_faces_are_fans() {
        let corners: Vec<[f64; 2]> = (0..9)
            .map(|k| libm::sincos(f64::from(k) * std::f64::consts::TAU / 9.0))
            .map(|(y, x)| [x, y])
            .collect();
        assert_eq!(triangulate_face(&tilted(&corners), &mut 1000), None);
        let bent = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.5), DVec3::Y];
        assert_eq!(triangulate_face(&bent, &mut 1000), None);
        let flat = [0.0, 1.0, 2.0, 1.0, 2.0].map(|x| DVec3::X * x);
        assert_eq!(triangulate_face(&flat, &mut 1000), None);
        assert_eq!(triangulate_face(&[DVec3::NAN; 5], &mut 1000), None);
    }

    #[test]
    fn faces_of_any_shape_keep_their_edges() {
        for seed in 0..200 {
            let mut random = Random::new(seed);
            let count = 4 + random.below(20);
            let corners: Vec<DVec3> = (0..count)
                .map(|_| {
                    DVec3::new(random.unit(), random.unit(), 0.1 * random.unit()).map(|x| (x * 6.0).round())
                })
                .collect();
            face_area(&corners);
        }
    }

    #[test]
    fn the_effort_for_a_face_is_bounded() {
        let mut random = Random::new(5);
        let corners: Vec<DVec3> =
            (0..20_000).map(|_| DVec3::new(random.unit(), random.unit(), 0.0)).collect();
        let mut effort = 1_000_000;
        assert_eq!(triangulate_face(&corners, &mut effort).map(|found| found.len()), Some(19_998));
        assert_eq!(effort, 0);
    }

    #[test]
    fn loops_that_intersect_are_rejected() {
        let points = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]].map(DVec2::from);
        let covered =
            |points: &[DVec2], loops: &[Vec<u32>]| finished(triangulate(points, loops, &Pauses::default()));
        assert_eq!(covered(&points, &[vec![0, 1, 2, 3]]), None);
        assert_eq!(covered(&points, &[vec![0, 1]]), None);
        let mut points = Vec::new();
        let outer = square(&mut points, DVec2::ZERO, 4.0, 1, false);
        let beside = square(&mut points, DVec2::new(5.0, 0.0), 1.0, 1, true);
        assert_eq!(covered(&points, &[outer, beside]), None);
    }
}
