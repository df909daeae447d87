//! Distances of all points of a lattice from a surface.
//!
//! The lattice is halved again and again, down to blocks of some dozens of points; each block inherits the candidates
//! of the one that it is half of, which are nodes of a hierarchy of triangles, and excludes those that are nowhere the
//! closest in it. Let *c* be the centre of a block, *d* the distance of *c* from the closest point *q* of a convex set,
//! and *u* the unit vector from *q* to *c*. The set is beyond the plane through *q* across *u*, so that no point
//! *c* + *v* is nearer to it than *d* + *u*·*v*. This bound is linear in *v*, exact to first order, and holds wherever
//! it was computed, so that not every block has to compute it anew. The closest triangle found so far gives a bound
//! from above.
//!
//! Blocks are halved along the axis that is longest across *u*, since bounds differ most along it.

use super::cylinder_tree::CylinderTree;
use super::four_triangles::{
    Facet, Facets, FourTriangles, Vectors, difference, dot, lane_of, length, scaled, splat, vector_of,
};
use crate::math::order::{combined_rank, rank_f32, sort_ranks};
use crate::math::{DAffine3, DVec3, Vec3};
use crate::mesh::{MeshError, TriangleMesh};
use crate::pauses::Pauses;
use smallvec::SmallVec;
use std::ops::Range;
use wide::f32x4;

/// Writes to `out` the unsigned distance of each point of a lattice from the surface of a mesh, in the length unit of
/// the mesh, x fastest: `map` leads from lattice indices to the space of the mesh, `dims` are the numbers of points,
/// whose product is the length of `out`.
///
/// Exact but for rounding: to a millionth of the distance or of the size of the triangles there. Pauses meanwhile.
///
/// # Errors
/// [`MeshError::InvalidArgument`] (parameter `mesh`) if the mesh has no triangle; as [`TriangleMesh::validate`].
pub async fn lattice_distances(
    mesh: &TriangleMesh,
    map: &DAffine3,
    dims: [usize; 3],
    out: &mut [f32],
    pauses: &Pauses,
) -> Result<(), MeshError> {
    if mesh.triangles.is_empty() {
        let problem = "must have triangles for distances, got none".to_owned();
        return Err(MeshError::InvalidArgument { parameter: "mesh", problem });
    }
    mesh.validate()?;
    let lattice = Block { start: [0; 3], size: dims };
    let [shrink, grow] = scale(mesh, &lattice, map);
    let tree = CylinderTree::new(&facets(mesh, shrink), pauses).await;
    let map = DAffine3 { matrix3: map.matrix3 * shrink, translation: map.translation * shrink };
    let candidates = vec![Candidate { node: 0, distance: 0.0, direction: DVec3::ZERO }];
    let mut search = Search { tree: &tree, map, dims, grow, out, candidates };
    let mut tasks = vec![Task::Search { block: lattice, outer: DVec3::ZERO, candidates: 0..1, near: 0 }];
    while let Some(task) = tasks.pop() {
        match task {
            Task::Search { block, outer, candidates, near } => {
                search.search(block, outer, candidates, near, &mut tasks, pauses).await;
            }
            Task::Forget(begin) => search.candidates.truncate(begin),
        }
    }
    Ok(())
}

/// Returns the triangles of a mesh with their neighbours, scaled.
fn facets(mesh: &TriangleMesh, scale: f64) -> Vec<Facet> {
    let links = mesh.opposite_edges();
    let scaled = |v: u32| (mesh.positions[v as usize].as_dvec3() * scale).as_vec3();
    // Returns the corner of the triangle beyond the edge from `b` to `c`.
    let beyond = |b: u32, c: u32| {
        let [at_b, at_c] = [b, c].map(|v| links.of(v as usize));
        if at_b.len() <= at_c.len() {
            at_b.iter().find(|link| link[1] == c).map(|link| link[0])
        } else {
            at_c.iter().find(|link| link[0] == b).map(|link| link[1])
        }
    };
    let facet = |&[a, b, c]: &[u32; 3]| Facet {
        corners: [a, b, c].map(scaled),
        beyond: [(a, b, c), (b, c, a), (c, a, b)].map(|(a, b, c)| scaled(beyond(b, c).unwrap_or(a))),
    };
    mesh.triangles.iter().map(facet).collect()
}

/// The exponent of two to which coordinates are scaled, so that products of four of them are within the range of
/// single precision.
const EXPONENT: i32 = 20;

/// Returns the power of two by which mesh and lattice are scaled, and its inverse.
fn scale(mesh: &TriangleMesh, lattice: &Block, map: &DAffine3) -> [f64; 2] {
    let corners = (0..8).map(|k| {
        let index = [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { lattice.size[axis] as f64 } else { 0.0 });
        map.transform_point3(DVec3::from(index))
    });
    let points = corners.chain(mesh.positions.iter().map(|p| p.as_dvec3()));
    let largest = points.fold(0.0, |largest, p| f64::max(largest, p.abs().max_element()));
    let (_, exponent) = libm::frexp(largest);
    [EXPONENT - exponent, exponent - EXPONENT].map(|power| libm::ldexp(1.0, power))
}

/// A box of lattice points.
#[derive(Clone, Copy)]
struct Block {
    start: [usize; 3],
    size: [usize; 3],
}

impl Block {
    fn count(&self) -> usize {
        self.size.iter().product()
    }

    /// Returns half of the extent, in lattice indices.
    fn half(&self) -> DVec3 {
        DVec3::from(self.size.map(|n| 0.5 * (n as f64 - 1.0)))
    }

    /// Returns the two halves of the block along an axis.
    fn halved(&self, axis: usize) -> [Self; 2] {
        let [mut low, mut high] = [*self; 2];
        low.size[axis] /= 2;
        high.size[axis] -= low.size[axis];
        high.start[axis] += low.size[axis];
        [low, high]
    }
}

/// A node of the tree that may contain the closest triangle of points in a block.
#[derive(Clone, Copy)]
struct Candidate {
    node: usize,
    /// The distance of the block's centre from a plane behind which the node is.
    distance: f64,
    /// The unit vector across that plane towards the centre; 0 if the centre is in the node or very near to it.
    direction: DVec3,
}

/// An upper bound of the distances of all points of a block from the surface: `distance` + `direction` · *v* + `slack`
/// at *v* from the centre.
struct UpperBound {
    distance: f64,
    direction: DVec3,
    slack: f64,
    /// The vectors from the centre to the middles of three sides.
    half_axes: [DVec3; 3],
}

impl UpperBound {
    /// Returns the bound given the vector to the centre from a point of the surface.
    fn new(half_axes: [DVec3; 3], from: DVec3) -> Self {
        let [a, b, c] = half_axes;
        let diagonals = [a + b + c, a + b - c, a - b + c, a - b - c];
        let highest =
            |values: [f64; 4]| values.into_iter().fold(0.0, |most, x| if x > most { x } else { most });
        let radius = highest(diagonals.map(DVec3::length));
        let distance = from.length();
        let towards = from / distance;
        let along: f64 = half_axes.iter().map(|axis| axis.dot(towards).abs()).sum();
        // The distance of c + v is √((e + w·v)² + |v across w|²), at most e + w·v + |v across w|² / 2 (e + w·v).
        let across = highest(diagonals.map(|v| across_squared(v, towards)));
        let slack = across / (2.0 * (distance - along));
        if distance > along && slack < radius {
            Self { distance, direction: towards, slack, half_axes }
        } else {
            Self { distance, direction: DVec3::ZERO, slack: radius, half_axes }
        }
    }

    /// Returns the distance from the centre below which its direction is not reliable.
    fn touching(&self) -> f64 {
        TOUCHING * self.half_axes.iter().map(|axis| axis.length()).sum::<f64>()
    }

    /// Returns the bound at `v` from the centre.
    fn at(&self, v: DVec3) -> f64 {
        self.distance + self.direction.dot(v) + self.slack
    }

    /// Returns whether no point of the block is nearer to what a plane, `distance` from the centre, has behind it,
    /// times `size`; `distance` and `direction` are also given times `size`.
    #[inline]
    fn excludes(&self, distance: f64, direction: DVec3, size: f64) -> bool {
        let turn = direction - self.direction * size;
        let change: f64 = self.half_axes.iter().map(|axis| axis.dot(turn).abs()).sum();
        distance - size * (self.distance + self.slack) >= change
    }
}

/// Returns the squared length of the part of `v` across a unit vector.
fn across_squared(v: DVec3, direction: DVec3) -> f64 {
    let along = v.dot(direction);
    v.length_squared() - along * along
}

/// The largest number of points in blocks that are not halved further: lower, and more candidates are tested; higher,
/// and more distances are computed in vain. The time is nearly the same from 16 on.
const SMALLEST: usize = 64;

/// The radius of nodes that are replaced by their children, relative to half of the block across the direction to the
/// surface. The time is nearly the same from 0.3 to 1.
const COARSE: f64 = 0.5;

/// By how much less the length of a block counts along the direction to the surface than across it.
const ALONG: f64 = 0.05;

/// Distance below which its direction is not reliable, relative to the size of a block.
const TOUCHING: f64 = 1e-6;

/// Candidates, nodes and leaves that are examined in a unit of work.
const CANDIDATES_PER_UNIT: usize = 64;
const NODES_PER_UNIT: usize = 64;
const LEAVES_PER_UNIT: usize = 16;

/// The number of candidates that are examined between pauses, if there are that many.
const CANDIDATES_AT_ONCE: usize = 1024;

/// A part of the work, on a stack.
enum Task {
    /// Compute the distances of all points of a block: `candidates` are those of the block that it is half of, whose centre
    /// is `outer`, and `near` is the closest triangle to it.
    Search { block: Block, outer: DVec3, candidates: Range<usize>, near: usize },
    /// Remove the candidates of a block, from this one on.
    Forget(usize),
}

struct Search<'a> {
    tree: &'a CylinderTree,
    map: DAffine3,
    dims: [usize; 3],
    /// The factor by which distances are scaled for `out`.
    grow: f64,
    out: &'a mut [f32],
    /// The candidates of the present block and of those it is a part of, one after the other.
    candidates: Vec<Candidate>,
}

impl Search<'_> {
    /// Computes the distances of all points of a block, given as in [`Task::Search`], or has that done by `tasks`. Pauses
    /// meanwhile.
    async fn search(
        &mut self,
        block: Block,
        outer: DVec3,
        candidates: Range<usize>,
        near: usize,
        tasks: &mut Vec<Task>,
        pauses: &Pauses,
    ) {
        let half = block.half();
        let centre = self.map.transform_point3(DVec3::from(block.start.map(|i| i as f64)) + half);
        let matrix = self.map.matrix3;
        let half_axes = [matrix.x_axis * half.x, matrix.y_axis * half.y, matrix.z_axis * half.z];
        let (near, from) = self.nearest(centre, centre - outer, candidates.clone(), near);
        let bound = UpperBound::new(half_axes, from);
        let begin = self.candidates.len();
        pauses.after(1 + candidates.len() / CANDIDATES_PER_UNIT).await;
        for first in candidates.clone().step_by(CANDIDATES_AT_ONCE) {
            let some = first..candidates.end.min(first + CANDIDATES_AT_ONCE);
            let work = some.len() / CANDIDATES_PER_UNIT;
            let nodes = self.select(&block, centre, centre - outer, some, &bound);
            pauses.after(work + nodes / NODES_PER_UNIT).await;
        }
        if block.count() <= SMALLEST {
            Points::new(&block, self, centre, &bound).search(self, begin, &bound, pauses).await;
            self.candidates.truncate(begin);
        } else {
            tasks.push(Task::Forget(begin));
            let [low, high] = block.halved(longest_axis(&block, &bound));
            tasks.extend([high, low].map(|block| Task::Search {
                block,
                outer: centre,
                candidates: begin..self.candidates.len(),
                near,
            }));
        }
    }

    /// Returns a triangle near `centre`, `near` or one of the nearest candidate, and the vector to `centre` from its
    /// closest point; `moved` is how far the centre is from that for which the bounds of the candidates were computed.
    fn nearest(&self, centre: DVec3, moved: DVec3, candidates: Range<usize>, near: usize) -> (usize, DVec3) {
        let mut best = (near, self.tree.offset_from(near, centre));
        let (mut lowest, mut nearest) = (best.1.length(), None);
        for candidate in &self.candidates[candidates] {
            let bound = candidate.distance + moved.dot(candidate.direction);
            if bound < lowest {
                (lowest, nearest) = (bound, Some(candidate.node));
            }
        }
        let Some(node) = nearest else { return best };
        for t in self.tree.triangles_of(self.tree.leaf_near(node, centre)) {
            let from = self.tree.offset_from(t, centre);
            if from.length_squared() < best.1.length_squared() {
                best = (t, from);
            }
        }
        best
    }

    /// Appends those of `candidates` that may contain the closest triangle of a point of the block; large ones are
    /// replaced by their children, down to leaves if the block is not halved further. Returns the number of nodes whose
    /// cylinders were examined.
    fn select(
        &mut self,
        block: &Block,
        centre: DVec3,
        moved: DVec3,
        candidates: Range<usize>,
        bound: &UpperBound,
    ) -> usize {
        let count = block.count();
        let is_last = count <= SMALLEST;
        // Every second block keeps the bounds of the one it is half of.
        let is_moved_only = !is_last && count.ilog2() % 2 == SMALLEST.ilog2() % 2;
        let across = bound.half_axes.iter().map(|axis| across_squared(*axis, bound.direction));
        let coarse = COARSE * COARSE * across.sum::<f64>();
        let touching = bound.touching();
        let mut nodes = SmallVec::<[usize; 32]>::new();
        let mut examined = 0;
        for k in candidates {
            let Candidate { node, distance, direction } = self.candidates[k];
            let distance = distance + moved.dot(direction);
            if bound.excludes(distance, direction, 1.0) {
                continue;
            }
            if is_moved_only || is_last && self.tree.children(node).is_none() {
                self.candidates.push(Candidate { node, distance, direction });
                continue;
            }
            nodes.push(node);
            while let Some(node) = nodes.pop() {
                examined += 1;
                let cylinder = self.tree.cylinder(node);
                let from = cylinder.offset(centre);
                let distance = from.length();
                let is_apart = distance > touching;
                // Times the distance, without a division.
                if is_apart && bound.excludes(distance * distance, from, distance) {
                    continue;
                }
                match self.tree.children(node) {
                    Some(children) if is_last || cylinder.radius * cylinder.radius > coarse => {
                        nodes.extend(children);
                    }
                    _ if is_apart => {
                        self.candidates.push(Candidate {
                            node,
                            distance,
                            direction: from * (1.0 / distance),
                        });
                    }
                    _ => self.candidates.push(Candidate { node, distance: 0.0, direction: DVec3::ZERO }),
                }
            }
        }
        examined
    }
}

/// Returns the axis along which a block is halved.
fn longest_axis(block: &Block, bound: &UpperBound) -> usize {
    let length = |axis: usize| {
        let v = bound.half_axes[axis];
        let (whole, along) = (v.length_squared(), v.dot(bound.direction));
        if block.size[axis] > 1 { whole - (1.0 - ALONG) * along * along } else { -1.0 }
    };
    (1..3).fold(0, |longest, axis| if length(axis) > length(longest) { axis } else { longest })
}

/// Rounding errors in single precision, relative to the numbers that were added; a few units in the last place.
const ROUNDING: f32 = 1e-6;

/// The points of a block that is not halved further, and their distances as found so far.
struct Points {
    block: Block,
    centre: DVec3,
    /// The same in single precision, and the rest.
    origin: [Vectors; 2],
    /// The points relative to the centre, in fours; the last four are filled up with the centre.
    at: [Vectors; SMALLEST / 4],
    distances: [f32x4; SMALLEST / 4],
    /// The number of fours.
    fours: usize,
}

impl Points {
    /// Returns the points of a block, with `bound` as their distances.
    fn new(block: &Block, search: &Search, centre: DVec3, bound: &UpperBound) -> Self {
        let (mut at, mut distances) = ([[[0.0; 4]; 3]; SMALLEST / 4], [[0.0; 4]; SMALLEST / 4]);
        for (k, index) in indices(block).enumerate() {
            let inside = DVec3::from(index.map(|i| i as f64)) - block.half();
            let v = search.map.transform_vector3(inside);
            for (lanes, x) in at[k / 4].iter_mut().zip(v.as_vec3().to_array()) {
                lanes[k % 4] = x;
            }
            distances[k / 4][k % 4] = bound.at(v) as f32;
        }
        let rounded = centre.as_vec3();
        let origin = [rounded, (centre - rounded.as_dvec3()).as_vec3()].map(splat);
        let (at, distances) = (at.map(|v| v.map(f32x4::new)), distances.map(f32x4::new));
        Self { block: *block, centre, origin, at, distances, fours: block.count().div_ceil(4) }
    }

    /// Computes the distances from the leaves that are candidates from `begin` on, and writes them to the output. Pauses
    /// meanwhile.
    async fn search(mut self, search: &mut Search<'_>, begin: usize, bound: &UpperBound, pauses: &Pauses) {
        let packed_bound = PackedBound::new(bound);
        // The nearest first, so that most others are excluded.
        let rank = |(candidate, k): (&Candidate, u32)| combined_rank(rank_f32(candidate.distance as f32), k);
        let mut ranks: Vec<_> = search.candidates[begin..].iter().zip(0..).map(rank).collect();
        sort_ranks(&mut ranks);
        for some in ranks.chunks(CANDIDATES_AT_ONCE) {
            for rank in some {
                let leaf = search.candidates[begin + *rank as u32 as usize].node;
                match search.tree.packed(leaf) {
                    Some(triangles) => {
                        let count = search.tree.triangles_of(leaf).len();
                        self.search_packed(triangles, count, &packed_bound);
                    }
                    None => self.search_thin(search.tree, leaf, bound),
                }
            }
            pauses.after(some.len() / LEAVES_PER_UNIT).await;
        }
        for (k, index) in indices(&self.block).enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis| self.block.start[axis] + index[axis]);
            let distance = f64::from(self.distances[k / 4].to_array()[k % 4]) * search.grow;
            search.out[x + search.dims[0] * (y + search.dims[1] * z)] = (distance as f32).min(f32::MAX);
        }
    }

    /// Computes the distances from the first `count` of four triangles.
    fn search_packed(&mut self, triangles: &FourTriangles, count: usize, bound: &PackedBound) {
        let facets = triangles.around(self.origin);
        let from = facets.offsets([f32x4::ZERO; 3]);
        let distances = length(from);
        let inverse = f32x4::ONE / distances;
        let directions = scaled(from, inverse);
        // Errors of the direction count more, the farther the points are from the centre.
        let rounding = facets.reach() * (f32x4::ONE + bound.radius * inverse) * f32x4::splat(ROUNDING);
        let lowest = distances - rounding;
        let mut excluded = bound.excludes(lowest, directions);
        if excluded != 0b1111 {
            excluded |= facets.beyond_edges(triangles, &bound.half_axes, bound.direction);
        }
        for lane in (0..count).filter(|lane| excluded >> lane & 1 == 0) {
            let bound = (lane_of(lowest, lane), vector_of(directions, lane));
            let near = self.nearer_than(bound);
            if near != 0 {
                self.measure(near, &facets.copies_of(lane), bound, lane_of(rounding, lane));
            }
        }
    }

    /// Returns a mask of the fours with a point that may be nearer to a triangle than to those so far: no distance at *v*
    /// from the centre is less than `lowest` + `direction` · *v*.
    #[inline]
    fn nearer_than(&self, (lowest, direction): (f32x4, Vectors)) -> u32 {
        let mut near = 0;
        for (k, (&at, &distances)) in self.at.iter().zip(&self.distances).enumerate() {
            // NaN is not excluded.
            let excluded = (lowest + dot(at, direction)).simd_ge(distances);
            near |= u32::from(!excluded.all()) << k;
        }
        near & ((1 << self.fours) - 1)
    }

    /// Computes the distances of the fours in a mask from one triangle, given in four copies, and its bound, as for
    /// [`Self::nearer_than`].
    #[inline]
    fn measure(
        &mut self,
        mut near: u32,
        triangle: &Facets,
        (lowest, direction): (f32x4, Vectors),
        rounding: f32x4,
    ) {
        let (normal, height) = triangle.planes();
        while near != 0 {
            let k = near.trailing_zeros() as usize;
            near &= near - 1;
            let (at, distances) = (self.at[k], self.distances[k]);
            // No point of the triangle is nearer than its plane, either.
            let excluded = (lowest + dot(at, direction)).simd_ge(distances)
                | ((height + dot(at, normal)).abs() - rounding).simd_ge(distances);
            if !excluded.all() {
                self.distances[k] = length(triangle.offsets(at)).fast_min(distances);
            }
        }
    }

    /// Computes the distances from the triangles of a leaf in double precision.
    fn search_thin(&mut self, tree: &CylinderTree, leaf: usize, bound: &UpperBound) {
        for t in tree.triangles_of(leaf) {
            let from = tree.offset_from(t, self.centre);
            let distance = from.length();
            let is_apart = distance > bound.touching();
            if is_apart && bound.excludes(distance * distance, from, distance) {
                continue;
            }
            let direction = if is_apart { from * (1.0 / distance) } else { DVec3::ZERO };
            let direction = splat(direction.as_vec3());
            let lowest = f32x4::splat(distance as f32 * (1.0 - ROUNDING));
            for k in 0..self.fours {
                let excluded = (lowest + dot(self.at[k], direction)).simd_ge(self.distances[k]);
                if is_apart && excluded.all() {
                    continue;
                }
                let [x, y, z] = self.at[k].map(|x| x.to_array());
                let mut distances = self.distances[k].to_array();
                for (lane, distance) in distances.iter_mut().enumerate() {
                    let p = self.centre + Vec3::new(x[lane], y[lane], z[lane]).as_dvec3();
                    *distance = distance.min(tree.offset_from(t, p).length() as f32);
                }
                self.distances[k] = f32x4::new(distances);
            }
        }
    }
}

/// Returns the indices of the points of a block relative to its first, x fastest.
fn indices(block: &Block) -> impl Iterator<Item = [usize; 3]> + use<> {
    let [nx, ny, nz] = block.size;
    (0..nx * ny * nz).map(move |k| [k % nx, k / nx % ny, k / (nx * ny)])
}

/// An [`UpperBound`] in single precision, for four triangles at a time.
struct PackedBound {
    limit: f32x4,
    direction: Vectors,
    half_axes: [Vectors; 3],
    /// The sum of the half axes' lengths.
    radius: f32x4,
}

impl PackedBound {
    fn new(bound: &UpperBound) -> Self {
        let radius: f64 = bound.half_axes.iter().map(|axis| axis.length()).sum();
        Self {
            limit: f32x4::splat((bound.distance + bound.slack) as f32),
            direction: splat(bound.direction.as_vec3()),
            half_axes: bound.half_axes.map(|axis| splat(axis.as_vec3())),
            radius: f32x4::splat(radius as f32),
        }
    }

    /// Returns a mask of the planes that [`UpperBound::excludes`]. NaN is not excluded.
    #[inline]
    fn excludes(&self, distances: f32x4, directions: Vectors) -> u32 {
        let turn = difference(directions, self.direction);
        let [a, b, c] = &self.half_axes;
        let change = dot(*a, turn).abs() + dot(*b, turn).abs() + dot(*c, turn).abs();
        (distances - self.limit).simd_ge(change).to_bitmask()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DMat3, Random, triangle};
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, joined, soup, torus};
    use crate::pauses::{advance, finished};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Compares the distances of a lattice with those of all triangles, at each `step`-th point.
    fn check(mesh: &TriangleMesh, map: &DAffine3, dims: [usize; 3], step: usize, accuracy: f64) {
        let mut found = vec![f32::NAN; dims.iter().product()];
        finished(lattice_distances(mesh, map, dims, &mut found, &Pauses::default())).unwrap();
        assert!(found.iter().all(|distance| *distance >= 0.0));
        for (i, found) in found.into_iter().enumerate().step_by(step) {
            let index = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let p = map.transform_point3(DVec3::from(index.map(|k| k as f64)));
            let all = mesh.corners().map(|corners| triangle::distance_squared(corners, p));
            let expected = all.fold(f64::INFINITY, f64::min).sqrt();
            let error = (f64::from(found) - expected).abs();
            assert!(error <= accuracy, "voxel {index:?}: {found}, not {expected}");
        }
    }

    /// Returns a lattice map with random, oblique columns of length `size` or so, that takes `centre` to near 0.
    fn oblique(random: &mut Random, size: f64, centre: DVec3) -> DAffine3 {
        let mut vector = || DVec3::from([(); 3].map(|()| size * (2.0 * random.unit() - 1.0)));
        let matrix3 = DMat3::from_cols(vector(), vector(), vector());
        DAffine3 { matrix3, translation: vector() - matrix3 * centre }
    }

    #[test]
    fn distances_are_those_of_brute_force() {
        let mut random = Random::new(6);
        let ball = Mesh::icosphere(Vec3::splat(1.0), 3.0, 1.0).unwrap().to_triangles();
        // Flat, with triangles that have no area and with two layers.
        let flat = joined(&[cuboid(Vec3::new(2.0, 3.0, 0.0)), cuboid(Vec3::ZERO), cuboid(Vec3::X)]);
        for mesh in [ball, torus(3.0, 1.0, 14, 8), soup(4, 60, 5), flat] {
            for size in [1.0, 0.3, 3.0] {
                let map = oblique(&mut random, size, DVec3::splat(3.0));
                check(&mesh, &map, [7, 6, 5], 1, 1e-6 * (3.0 + 10.0 * size));
            }
        }
    }

    /// Checks distances to many triangles with noise, with several levels of blocks, and blocks on the medial axis.
    fn check_far_points(noise: f32) {
        let mut random = Random::new(9);
        let ball = Mesh::icosphere(Vec3::splat(0.1), 2.0, 0.12).unwrap().to_triangles();
        let mut mesh = joined(&[ball, torus(1.2, 0.3, 40, 20)]);
        for p in &mut mesh.positions {
            *p *= 1.0 + noise * (random.unit() as f32 - 0.5);
        }
        let map =
            DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(0.18)), translation: DVec3::splat(-3.0) };
        check(&mesh, &map, [33, 34, 35], 37, 3e-6);
        check(&mesh, &oblique(&mut random, 0.2, DVec3::splat(16.0)), [33, 32, 31], 41, 5e-6);
    }

    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn far_points_have_the_distance_of_the_closest_of_many_triangles() {
        check_far_points(0.02);
    }

    #[test]
    #[ignore = "long: npm run test:all"]
    fn far_points_have_the_distance_of_the_closest_of_even_and_of_uneven_triangles() {
        check_far_points(0.0);
        check_far_points(0.4);
    }

    /// Without the triangles that are no closer than their neighbours, distances are the same, at all corners of random
    /// blocks.
    #[test]
    fn no_closest_triangle_is_excluded_for_one_beyond_its_edges() {
        let mut random = Random::new(12);
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 2.0, 0.4).unwrap().to_triangles();
        // Flat and steep, with acute and obtuse angles.
        for p in &mut mesh.positions {
            *p += Vec3::from([(); 3].map(|()| 0.3 * random.unit() as f32));
        }
        let facets = facets(&mesh, 1.0);
        let (mut excluded, mut all) = (0, 0);
        for _ in 0..200 {
            let centre = DVec3::from([(); 3].map(|()| 8.0 * random.unit() - 4.0));
            let half_axes = [(); 3].map(|()| DVec3::from([(); 3].map(|()| 0.2 * random.unit() - 0.1)));
            let inner = DVec3::from([(); 3].map(|()| 2.0 * random.unit() - 1.0));
            let bound = PackedBound::new(&UpperBound::new(half_axes, centre - inner));
            let is_left = |facet: &&Facet| {
                let four = FourTriangles::new(&[**facet]);
                four.is_none_or(|four| {
                    let around = four.around([splat(centre.as_vec3()), splat(Vec3::ZERO)]);
                    around.beyond_edges(&four, &bound.half_axes, bound.direction) & 1 == 0
                })
            };
            let left: Vec<_> = facets.iter().filter(is_left).collect();
            excluded += facets.len() - left.len();
            all += facets.len();
            for k in 0..8 {
                let signs = [1, 2, 4].map(|bit| if k & bit == 0 { 1.0 } else { -1.0 });
                let p = centre + (0..3).map(|axis| half_axes[axis] * signs[axis]).sum::<DVec3>();
                let nearest = |of: &[&Facet]| {
                    of.iter()
                        .map(|facet| triangle::distance_squared(facet.corners, p))
                        .fold(f64::INFINITY, f64::min)
                };
                let [whole, rest] = [&facets.iter().collect::<Vec<_>>()[..], &left].map(nearest);
                assert!(rest.sqrt() <= whole.sqrt() + 1e-6, "{rest} {whole} at {p}");
            }
        }
        assert!(2 * excluded > all, "{excluded} of {all}");
    }

    /// Where thousands of triangles are nearly the closest, a block takes as long as thousands do elsewhere.
    #[test]
    fn pauses_are_frequent_where_many_triangles_are_equally_far() {
        let pauses_with = |copies: usize| {
            let ball = Mesh::icosphere(Vec3::splat(8.0), 6.0, 0.6).unwrap().to_triangles();
            let moved = |k: usize| {
                let mut copy = ball.clone();
                copy.positions.iter_mut().for_each(|p| *p += Vec3::splat(1e-4 * k as f32));
                copy
            };
            let mesh = joined(&(0..copies).map(moved).collect::<Vec<_>>());
            let pauses_on = |dims: [usize; 3]| {
                let mut out = vec![0.0; dims.iter().product()];
                let pauses = Pauses::default();
                let mut distances =
                    Box::pin(lattice_distances(&mesh, &DAffine3::IDENTITY, dims, &mut out, &pauses));
                (0..).take_while(|_| advance(&mut distances).is_pending()).count()
            };
            // The hierarchy of triangles is made in slices, too.
            pauses_on([16; 3]) - pauses_on([1; 3])
        };
        let [one, many] = [1, 60].map(pauses_with);
        assert!(many > 15 * one.max(1), "{many} pauses with many, {one} with one");
    }

    /// Triangles thousands of times as long as the lattice, and as wide as a ten-thousandth of their length.
    #[test]
    fn long_and_thin_triangles_are_as_near_as_others() {
        let mut random = Random::new(3);
        for width in [1.0, 1e-1, 1e-2, 1e-3, 1e-4] {
            let mut mesh = soup(11, 30, 2);
            for corners in &mesh.triangles {
                let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
                let off = c - a.midpoint(b);
                mesh.positions[corners[2] as usize] = a.lerp(b, 0.3) + off * width;
            }
            for (size, long) in [(0.1, 1.0), (1e-3, 1.0), (0.1, 100.0)] {
                let mut long_mesh = mesh.clone();
                long_mesh.positions.iter_mut().for_each(|p| *p *= long);
                check(
                    &long_mesh,
                    &oblique(&mut random, size, DVec3::splat(5.0)),
                    [11, 12, 10],
                    7,
                    3e-6 * f64::from(long),
                );
            }
        }
    }

    #[test]
    fn scale_and_position_do_not_matter() {
        let mut random = Random::new(4);
        let ball = Mesh::icosphere(Vec3::ZERO, 2.0, 0.4).unwrap().to_triangles();
        for size in [1e-30, 1e-12, 1e12, 1e30] {
            let mut mesh = ball.clone();
            mesh.positions.iter_mut().for_each(|p| *p *= size as f32);
            check(&mesh, &oblique(&mut random, 0.3 * size, DVec3::splat(5.0)), [11, 10, 9], 5, 5e-6 * size);
        }
        // A surface that is a point seen from the lattice, and a lattice within a voxel of the surface.
        check(&ball, &oblique(&mut random, 1e20, DVec3::splat(5.0)), [9, 8, 7], 1, 1e15);
        let mut map = oblique(&mut random, 1e-6, DVec3::ZERO);
        map.translation += DVec3::X * 2.0;
        check(&ball, &map, [9, 8, 7], 1, 1e-6);
        check(&ball, &map, [1, 1, 1], 1, 1e-6);
    }

    #[test]
    fn a_mesh_without_triangles_is_refused() {
        let (none, pauses) = (TriangleMesh::default(), Pauses::default());
        let found = finished(lattice_distances(&none, &DAffine3::IDENTITY, [1; 3], &mut [0.0], &pauses));
        assert!(matches!(found, Err(MeshError::InvalidArgument { parameter: "mesh", .. })));
    }
}
