//! Axis-aligned bounding boxes, and a bounding volume hierarchy for overlap, nearest-box and ray queries.

use super::order::{combined_rank, rank_f32, select_least};
use super::{DVec3, Vec3};
use smallvec::SmallVec;
use std::cell::Cell;
use std::ops::Range;

/// An axis-aligned bounding box; its faces belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Corner with the smallest coordinates.
    pub min: Vec3,
    /// Corner with the largest coordinates.
    pub max: Vec3,
}

/// Returns the corners of a box, given by the lowest and the highest; x alternates fastest.
pub fn box_corners(low: DVec3, high: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|k| {
        DVec3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { low[axis] } else { high[axis] }))
    })
}

impl Bounds {
    /// The empty box, which contains no point and overlaps no box.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Returns the smallest box that contains the points; [`Self::EMPTY`] if there are none.
    #[inline]
    pub fn from_points(points: &[Vec3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| b.union(&Self { min: p, max: p }))
    }

    /// Returns the smallest box that contains both boxes.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        let (mut min, mut max) = (self.min, self.max);
        for axis in 0..3 {
            // Comparisons, since `f32::min` of variables is a call in wasm.
            if other.min[axis] < min[axis] {
                min[axis] = other.min[axis];
            }
            if other.max[axis] > max[axis] {
                max[axis] = other.max[axis];
            }
        }
        Self { min, max }
    }

    /// Returns whether `p` is inside the box or on its border; false for NaN.
    #[inline]
    pub fn contains(&self, p: Vec3) -> bool {
        self.overlaps(&Self { min: p, max: p })
    }

    /// Returns whether `other` is inside the box or touches it from inside.
    pub fn contains_box(&self, other: &Self) -> bool {
        self.contains(other.min) && self.contains(other.max)
    }

    /// Returns whether the boxes share a point; they do even if they only touch.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
            && self.min.z <= other.max.z
            && other.min.z <= self.max.z
    }

    /// Returns the squared distance from `p` to the box, zero inside.
    #[inline]
    pub fn distance_squared(&self, p: Vec3) -> f64 {
        let (low, high) = (self.min.as_dvec3() - p.as_dvec3(), p.as_dvec3() - self.max.as_dvec3());
        low.max(high).max(DVec3::ZERO).length_squared()
    }

    /// Returns the distance along the ray, in lengths of its direction, at which it enters the box: 0 if it starts
    /// inside, `None` if it misses. A small tolerance makes a ray in a face of the box a hit.
    #[inline]
    pub fn ray_entry(&self, ray: &Ray) -> Option<f64> {
        self.clip_line(ray, 0.0).map(|(enter, _)| enter)
    }

    /// Returns the distance from the ray's origin, in lengths of its direction, to the nearest point of the box on the
    /// whole line, ahead or behind: 0 if the origin is inside, `None` if the line misses. The tolerance is that of
    /// [`Self::ray_entry`].
    #[inline]
    pub fn line_entry(&self, ray: &Ray) -> Option<f64> {
        let (enter, leave) = self.clip_line(ray, f64::NEG_INFINITY)?;
        let near = if enter > 0.0 { enter } else { -leave };
        Some(if near > 0.0 { near } else { 0.0 })
    }

    /// Returns the parameters at which the ray's line enters and leaves the box, in lengths of its direction from its
    /// origin, the first at least `start`; `None` if no part of the line beyond `start` is in the box.
    #[inline]
    fn clip_line(&self, ray: &Ray, start: f64) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (start, f64::INFINITY);
        for axis in 0..3 {
            let low = f64::from(self.min[axis]) - ray.origin[axis];
            let high = f64::from(self.max[axis]) - ray.origin[axis];
            if ray.inverse[axis] == 0.0 {
                // Parallel to the slab: on its faces the product would be 0 · ∞.
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low * ray.inverse[axis], high * ray.inverse[axis]);
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            enter = if near > enter { near } else { enter };
            leave = if far < leave { far } else { leave };
        }
        // Behind the origin both are negative, hence the absolute value.
        (enter <= leave + ROUNDING * leave.abs()).then_some((enter, leave))
    }

    /// Returns the axis along which the box is longest: 0, 1 or 2.
    pub fn widest_axis(&self) -> usize {
        let size = self.max - self.min;
        if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        }
    }
}

/// Relative tolerance of [`Bounds::ray_entry`] and [`Bounds::line_entry`]: each computed distance of a face is within
/// two ulps, and with less tolerance a ray could pass between two boxes that share a face.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A ray prepared for tests against many boxes.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    origin: DVec3,
    /// Reciprocal of the direction per axis; 0 for an axis that the ray is perpendicular to.
    inverse: DVec3,
}

impl Ray {
    /// Creates the ray from `origin` along `direction`, which may have any length but 0.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let inverse = |x: f64| if x.abs() > MIN_DIRECTION_COMPONENT { 1.0 / x } else { 0.0 };
        Self { origin, inverse: DVec3::from(direction.to_array().map(inverse)) }
    }
}

/// Largest absolute value of a direction's component that is treated as 0: its reciprocal would be close to infinity.
const MIN_DIRECTION_COMPONENT: f64 = 1e-290;

/// Indices of the tree nodes that a query has still to visit, each with the distance of its box; with a tree of a
/// million items, no allocation is needed.
type Stack = SmallVec<[(f64, usize); 24]>;

/// Maximum number of boxes in a leaf of a [`BoxTree`]: 1 doubles the number of nodes, 16 tests many boxes in vain.
const LEAF: usize = 4;

/// A balanced bounding volume hierarchy of boxes, for overlap, nearest-box and ray queries. Its size is linear in the
/// number of boxes whatever their shapes, and equal boxes give an equal tree.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<(Bounds, u32)>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// Inner node: index of the second child (the first child is the next node). Leaf: index of its first item.
    link: u32,
    /// Number of items in a leaf; 0 for an inner node.
    count: u32,
}

impl BoxTree {
    /// Builds the tree over `boxes`; queries pass boxes to their callers as items, indices into `boxes`.
    pub fn new(boxes: &[Bounds]) -> Self {
        let mut builder = BoxTreeBuilder::new(boxes);
        while builder.advance().is_some() {}
        builder.finish()
    }

    /// Calls `visit` once with each pair of items (indices of boxes) whose boxes overlap, the lower index first. The
    /// order of the pairs is deterministic but arbitrary. It stops soon after `visit` returns false.
    pub fn for_each_pair(&self, mut visit: impl FnMut(u32, u32) -> bool) {
        let goes_on = Cell::new(true);
        let mut visit = |a, b| {
            if goes_on.get() {
                goes_on.set(visit(a, b));
            }
        };
        let mut pairs = self.pairs();
        while goes_on.get() && pairs.advance(&mut visit) {}
    }

    /// Begins a search for the pairs of items whose boxes overlap, as [`Self::for_each_pair`] makes it.
    pub fn pairs(&self) -> OverlappingPairs<'_> {
        OverlappingPairs { tree: self, stack: if self.nodes.is_empty() { Vec::new() } else { vec![(0, 0)] } }
    }

    /// Calls `visit` with items (indices of boxes) whose boxes are near `p`, roughly from near to far. `visit` also
    /// receives the current bound, a squared distance that is infinite at first, and returns the new bound; items whose
    /// boxes are farther are skipped, those exactly at the bound are visited.
    pub fn nearest(&self, p: Vec3, mut visit: impl FnMut(u32, f64) -> f64) {
        let mut bound = f64::INFINITY;
        self.descend(
            f64::INFINITY,
            |bounds| Some(bounds.distance_squared(p)),
            |item| {
                bound = visit(item, bound);
                bound
            },
        );
    }

    /// Calls `visit` with the items (indices of boxes) whose boxes have a squared distance of at most `squared` from
    /// `p`, until it returns true.
    pub fn within(&self, p: Vec3, squared: f64, mut visit: impl FnMut(u32) -> bool) {
        let entry = |bounds: &Bounds| Some(bounds.distance_squared(p));
        self.descend(squared, entry, |item| if visit(item) { -1.0 } else { squared });
    }

    /// Calls `visit` with items (indices of boxes) whose boxes the ray enters, roughly nearest entry first. `visit`
    /// returns the new bound, a distance in lengths of the ray's direction that is infinite at first; items whose boxes
    /// are entered beyond the bound are skipped.
    pub fn along_ray(&self, ray: &Ray, visit: impl FnMut(u32) -> f64) {
        self.descend(f64::INFINITY, |bounds| bounds.ray_entry(ray), visit);
    }

    /// Calls `visit` with items (indices of boxes) whose boxes the whole line of a ray meets, ahead of the ray's origin
    /// or behind, roughly nearest first. The bound is `max_distance` at first, then the last value that `visit`
    /// returned: a distance from the origin, in lengths of the ray's direction. Items whose boxes are beyond the bound
    /// are skipped.
    pub fn along_line(&self, ray: &Ray, max_distance: f64, visit: impl FnMut(u32) -> f64) {
        self.descend(max_distance, |bounds| bounds.line_entry(ray), visit);
    }

    /// Calls `visit` with the items (indices of boxes) whose boxes overlap `bounds`.
    pub fn for_each_overlapping(&self, bounds: &Bounds, mut visit: impl FnMut(u32)) {
        let entry = |other: &Bounds| other.overlaps(bounds).then_some(0.0);
        self.descend(0.0, entry, |item| {
            visit(item);
            0.0
        });
    }

    /// Returns the number of nodes of the tree, for data kept per node.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the box of a node.
    #[inline]
    pub fn node_bounds(&self, node: usize) -> &Bounds {
        &self.nodes[node].bounds
    }

    /// Returns the children of a node; `None` for a leaf.
    #[inline]
    pub fn children(&self, node: usize) -> Option<[usize; 2]> {
        let Node { link, count, .. } = self.nodes[node];
        (count == 0).then_some([node + 1, link as usize])
    }

    /// Returns all items (indices of boxes), those below each node next to each other; see [`Self::node_range`].
    pub fn order(&self) -> impl Iterator<Item = u32> {
        self.items.iter().map(|(_, item)| *item)
    }

    /// Returns the range of the items below a node in [`Self::order`].
    #[inline]
    pub fn node_range(&self, node: usize) -> Range<usize> {
        let [mut first, mut last] = [node; 2];
        while self.nodes[first].count == 0 {
            first += 1;
        }
        while self.nodes[last].count == 0 {
            last = self.nodes[last].link as usize;
        }
        let [first, last] = [&self.nodes[first], &self.nodes[last]];
        first.link as usize..(last.link + last.count) as usize
    }

    /// The traversal that all queries share: visits items for whose boxes `entry` returns a distance within the bound,
    /// which is `bound` at first, then the last value that `visit` returned. Boxes for which `entry` returns `None` are
    /// skipped. Of two sibling nodes, the nearer is visited first.
    fn descend(
        &self,
        mut bound: f64,
        entry: impl Fn(&Bounds) -> Option<f64>,
        mut visit: impl FnMut(u32) -> f64,
    ) {
        let Some(start) = self.nodes.first().and_then(|root| entry(&root.bounds)) else { return };
        let mut stack = Stack::new();
        stack.push((start, 0));
        while let Some((distance, i)) = stack.pop() {
            if distance > bound {
                continue;
            }
            let node = &self.nodes[i];
            for (bounds, item) in self.items_of(node) {
                if entry(bounds).is_some_and(|d| d <= bound) {
                    bound = visit(*item);
                }
            }
            if node.count == 0 {
                self.push_children(i, &entry, &mut stack);
            }
        }
    }

    /// Pushes those children of node `i` for whose boxes `entry` returns a distance onto the stack, the nearer one on
    /// top.
    fn push_children(&self, i: usize, entry: &impl Fn(&Bounds) -> Option<f64>, stack: &mut Stack) {
        let children = [i + 1, self.nodes[i].link as usize];
        let [a, b] = children.map(|c| entry(&self.nodes[c].bounds).map(|distance| (distance, c)));
        match (a, b) {
            (Some(a), Some(b)) => {
                let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
                stack.push(far);
                stack.push(near);
            }
            (Some(only), None) | (None, Some(only)) => stack.push(only),
            (None, None) => {}
        }
    }

    /// Returns the items of a leaf; none for an inner node.
    fn items_of(&self, node: &Node) -> &[(Bounds, u32)] {
        if node.count == 0 { &[] } else { &self.items[node.link as usize..(node.link + node.count) as usize] }
    }

    /// Calls `visit` with the pairs of items of one leaf whose boxes overlap, the lower index first.
    fn pairs_within(&self, leaf: &Node, visit: &mut impl FnMut(u32, u32)) {
        let items = self.items_of(leaf);
        for (k, (bounds, item)) in items.iter().enumerate() {
            for (other_bounds, other) in &items[k + 1..] {
                if bounds.overlaps(other_bounds) {
                    visit(*item.min(other), *item.max(other));
                }
            }
        }
    }

    /// Calls `visit` with the pairs of an item of leaf `a` and an item of leaf `b` whose boxes overlap, the lower index
    /// first.
    fn pairs_between(&self, a: &Node, b: &Node, visit: &mut impl FnMut(u32, u32)) {
        for (bounds, item) in self.items_of(a) {
            if !bounds.overlaps(&b.bounds) {
                continue;
            }
            for (other_bounds, other) in self.items_of(b) {
                if bounds.overlaps(other_bounds) {
                    visit(*item.min(other), *item.max(other));
                }
            }
        }
    }
}

/// A search for the pairs of items of a [`BoxTree`] whose boxes overlap, from one pair of nodes to the next.
#[derive(Debug)]
pub struct OverlappingPairs<'a> {
    tree: &'a BoxTree,
    /// Pairs of nodes below which pairs are yet to be searched for.
    stack: Vec<(usize, usize)>,
}

impl OverlappingPairs<'_> {
    /// Does the next part, and calls `visit` with the pairs that it finds; returns whether there was any left to do.
    #[inline]
    pub fn advance(&mut self, visit: &mut impl FnMut(u32, u32)) -> bool {
        let Some((i, j)) = self.stack.pop() else { return false };
        let (a, b) = (&self.tree.nodes[i], &self.tree.nodes[j]);
        match (a.count > 0, b.count > 0) {
            _ if !a.bounds.overlaps(&b.bounds) => {}
            (true, _) if i == j => self.tree.pairs_within(a, visit),
            (false, _) if i == j => {
                let (left, right) = (i + 1, a.link as usize);
                self.stack.extend([(left, left), (right, right), (left, right)]);
            }
            (true, true) => self.tree.pairs_between(a, b, visit),
            (false, true) => self.stack.extend([(i + 1, j), (a.link as usize, j)]),
            // The pair is swapped, so that both nodes are split in turn.
            (_, false) => self.stack.extend([(j + 1, i), (b.link as usize, i)]),
        }
        true
    }
}

/// A [`BoxTree`] that is being built, node by node.
#[derive(Debug)]
pub struct BoxTreeBuilder {
    tree: BoxTree,
    /// Subtrees to be built, the next one last.
    pending: Vec<Subtree>,
}

/// A subtree to be built.
#[derive(Debug)]
struct Subtree {
    /// The range of its items among all items of the tree.
    items: Range<usize>,
    /// The node of which it is the second child, if it is one.
    second_of: Option<usize>,
}

impl BoxTreeBuilder {
    /// Begins to build the tree over `boxes`.
    pub fn new(boxes: &[Bounds]) -> Self {
        let items: Vec<(Bounds, u32)> = boxes.iter().copied().zip(0..).collect();
        let whole = Subtree { items: 0..items.len(), second_of: None };
        let pending = if items.is_empty() { Vec::new() } else { vec![whole] };
        Self { tree: BoxTree { nodes: Vec::with_capacity(items.len()), items }, pending }
    }

    /// Appends the next node, whose items are split at the median of their boxes' centres along the widest axis; returns
    /// the number of its items, `None` if the tree is complete.
    pub fn advance(&mut self) -> Option<usize> {
        let Subtree { items: range, second_of } = self.pending.pop()?;
        let (nodes, items) = (&mut self.tree.nodes, &mut self.tree.items[range.clone()]);
        let at = nodes.len();
        if let Some(parent) = second_of {
            nodes[parent].link = at as u32;
        }
        let bounds = items.iter().fold(Bounds::EMPTY, |b, (item, _)| b.union(item));
        if items.len() <= LEAF {
            nodes.push(Node { bounds, link: range.start as u32, count: items.len() as u32 });
            return Some(items.len());
        }
        nodes.push(Node { bounds, link: 0, count: 0 });
        let axis = bounds.widest_axis();
        let mut ranked: Vec<(u64, u32)> = items
            .iter()
            .map(|(b, i)| combined_rank(rank_f32(b.min[axis] + b.max[axis]), *i))
            .zip(0..)
            .collect();
        select_least(&mut ranked, items.len() / 2);
        let before = items.to_vec();
        items.iter_mut().zip(ranked).for_each(|(item, (_, i))| *item = before[i as usize]);
        let middle = range.start + items.len() / 2;
        self.pending.push(Subtree { items: middle..range.end, second_of: Some(at) });
        self.pending.push(Subtree { items: range.start..middle, second_of: None });
        Some(range.len())
    }

    /// Returns the tree, once it is complete.
    pub fn finish(self) -> BoxTree {
        self.tree
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn boxes(count: u32) -> Vec<Bounds> {
        let mut random = Random::new(3);
        let mut next = || random.unit() as f32;
        (0..count)
            .map(|i| {
                let min = Vec3::new(next(), next(), next()) * 10.0;
                // One in sixteen is long along an axis.
                let long = if i % 16 == 0 { 10.0 } else { 0.3 };
                Bounds { min, max: min + Vec3::new(next() * long, next(), next() * 0.1) }
            })
            .collect()
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        for count in [0, 1, 2, 5, 9, 300] {
            let boxes = boxes(count);
            let mut found = Vec::new();
            BoxTree::new(&boxes).for_each_pair(|i, j| {
                found.push((i, j));
                true
            });
            found.sort_unstable();
            let all = (0..count).flat_map(|j| (0..j).map(move |i| (i, j)));
            let mut expected: Vec<_> =
                all.filter(|&(i, j)| boxes[i as usize].overlaps(&boxes[j as usize])).collect();
            expected.sort_unstable();
            assert_eq!(found, expected, "{count} boxes");
        }
    }

    #[test]
    fn a_ray_in_a_face_enters() {
        let unit = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let entry = |x, y, z| unit.ray_entry(&Ray::new(DVec3::new(x, y, z), DVec3::X));
        assert_eq!(entry(-2.0, 0.0, 1.0), Some(2.0));
        assert_eq!(entry(0.5, 0.5, 0.5), Some(0.0));
        assert_eq!(entry(-2.0, 1.5, 0.5), None);
        assert_eq!(entry(2.0, 0.5, 0.5), None);
        let nearly = Ray::new(DVec3::new(-2.0, 0.0, 1.0), DVec3::new(1.0, 1e-300, 0.0));
        assert_eq!(unit.ray_entry(&nearly), Some(2.0));
    }

    #[test]
    fn nearest_visits_little_and_finds_the_nearest() {
        let boxes = boxes(500);
        let (tree, p) = (BoxTree::new(&boxes), Vec3::splat(5.0));
        let (mut best, mut visited) = (f64::INFINITY, 0);
        tree.nearest(p, |item, bound| {
            visited += 1;
            best = bound.min(boxes[item as usize].distance_squared(p));
            best
        });
        let expected = boxes.iter().map(|b| b.distance_squared(p)).fold(f64::INFINITY, f64::min);
        assert_eq!(best, expected);
        assert!(visited < 100, "{visited} of 500 visited");
    }
}
