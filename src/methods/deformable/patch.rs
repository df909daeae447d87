//! Patches: the surface in a box of the finest image is replaced by the contour there.
//!
//! Where the image has changed, the contour of the changed box has the right topology at once: no front has to move, and
//! no parts have to meet or to be cut. The mesh is cut along a slightly larger box, outside which it is near its contour
//! already, and each rim of the hole is joined with a rim of the contour by a strip of triangles. If rims do not
//! correspond, or triangles would intersect, nothing is replaced.

use super::contour::{ContourRule, contour_of_grid, placed, sizes_of_parts};
use super::image::LevelImage;
use crate::math::order::{combined_rank, sort_by_rank, sort_distinct, sort_ranks};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, Patch, PatchCorner, TriangleMesh, VertexId, sort_distinct as sort_vertices};
use crate::methods::MethodError;
use crate::volume::{Region, Subdivided};
use std::collections::BTreeMap;

/// The distance, in voxels, between the box whose contour is inserted and the one along which the mesh is cut. With
/// less, strips have short edges across; with more, they bridge curved parts.
const GAP: f32 = 1.0;

/// The largest distance of a rim's vertices from the rim that it is joined with, in voxels: of rims further apart, one
/// is of a part that the other surface lacks.
const MAX_RIM_DISTANCE: f32 = 4.0;

/// The least distance of a cut from the ends of its edge, as a share of the edge, so that no triangle is a sliver.
const CUT_MARGIN: f32 = 0.15;

/// The largest number of vertices of a bit of the mesh outside the outer box, cut off from the rest by the box, that is
/// removed with the vertices inside.
const MAX_CUT_OFF: usize = 12;

/// The largest number of pairs of vertices that are compared to find the partners of rims: some tenths of a second.
const MAX_COMPARED: usize = 1 << 26;

/// The largest number of pairs of vertices that are compared to join two rims, which bounds the memory for it.
const MAX_PAIRS: usize = 1 << 22;

/// The box of an image whose contour replaces the mesh inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchBox {
    /// The voxels between which the contour is extracted.
    voxels: Region,
    /// The box, in model space, at whose faces the contour is cut; unbounded where `voxels` ends at the image's border.
    inner: Bounds,
    /// The box, in model space, at whose faces the mesh is cut.
    pub(super) outer: Bounds,
}

impl PatchBox {
    /// Returns the box for an image of `dims` voxels in which those in `changed` have changed, enlarged by `margin`
    /// voxels.
    pub(super) fn around(changed: Region, margin: usize, dims: [usize; 3]) -> Self {
        // The image between two voxels changes with either of them. There is no room for a cut beside the border.
        let near = changed.enlarged(1 + margin, dims);
        let near_low = |axis: usize| if near.min[axis] <= 2 { 0 } else { near.min[axis] };
        let min = [0, 1, 2].map(near_low);
        let end = |axis: usize| {
            let end = near.min[axis] + near.dims[axis];
            if end + 2 >= dims[axis] { dims[axis] } else { end }
        };
        let voxels = Region { min, dims: [0, 1, 2].map(|axis| end(axis) - min[axis]) };
        let low = |axis: usize| if min[axis] == 0 { f32::NEG_INFINITY } else { min[axis] as f32 };
        let high = |axis: usize| {
            let end = end(axis);
            if end == dims[axis] { f32::INFINITY } else { (end - 1) as f32 }
        };
        let inner = Bounds { min: Vec3::from([0, 1, 2].map(low)), max: Vec3::from([0, 1, 2].map(high)) };
        let outer = Bounds { min: inner.min - Vec3::splat(GAP), max: inner.max + Vec3::splat(GAP) };
        Self { voxels, inner, outer }
    }
}

/// Part of the mesh, and the surface that replaces it.
#[derive(Clone, Debug, Default)]
pub(super) struct Replacement {
    /// The vertices to remove, sorted by id.
    pub(super) removed: Vec<VertexId>,
    pub(super) patch: Patch,
    /// The change of the number of connected components of the mesh; `None` if it is not known, since the patch
    /// connects other rims than the part that it replaces.
    pub(super) components: Option<i32>,
}

/// Returns the replacement of the mesh in a box by the contour there. `near` are the vertices in the outer box, sorted by
/// id. `None` if rims of the mesh and of the contour do not correspond.
///
/// # Errors
/// If memory does not suffice.
pub(super) fn replacement(
    image: &LevelImage,
    mesh: &Mesh,
    near: &[VertexId],
    at: PatchBox,
    rule: ContourRule,
) -> Result<Option<Replacement>, MethodError> {
    let hole = Hole::new(mesh, near, &at.inner);
    let cut = CutMesh::new(mesh, &hole, &at.outer);
    let piece = Piece::new(image, at, rule)?;
    Ok(stitched(hole, cut, piece))
}

/// Joins the rims of the cut mesh and of the contour; `None` if they do not correspond.
fn stitched(hole: Hole, cut: CutMesh, mut piece: Piece) -> Option<Replacement> {
    let (rims, contour_rims) = (rims(&cut.next)?, piece.rims()?);
    let points = |rim: &Vec<u32>, of: &[Vec3]| rim.iter().map(|&v| of[v as usize]).collect::<Vec<_>>();
    let here: Vec<Vec<Vec3>> = rims.iter().map(|rim| points(rim, &cut.patch.positions)).collect();
    let there: Vec<Vec<Vec3>> =
        contour_rims.iter().map(|rim| points(rim, &piece.surface.positions)).collect();
    let count = |rims: &[Vec<Vec3>]| rims.iter().map(Vec::len).sum::<usize>();
    if count(&here).saturating_mul(count(&there)) > MAX_COMPARED {
        return None;
    }
    let partners = partners(&there, &here);
    piece.leave_out_noise(&contour_rims, &partners)?;
    if partners.iter().flatten().count() != rims.len() {
        return None;
    }
    let first = cut.patch.positions.len() as u32;
    let mut patch = cut.patch;
    let mut pairs = Vec::new();
    for (k, partner) in partners.into_iter().enumerate() {
        let Some(other) = partner else { continue };
        let corner = |(is_contour, i): StripCorner| {
            PatchCorner::New(if is_contour { first + contour_rims[k][i] } else { rims[other][i] })
        };
        let strip = strip(&here[other], &there[k])?;
        patch.triangles.extend(strip.into_iter().map(|corners| corners.map(corner)));
        pairs.push((cut.part[rims[other][0] as usize], piece.part[contour_rims[k][0] as usize]));
    }
    let components = change_of_components(pairs, hole.parts, piece.part_count());
    patch.positions.extend_from_slice(&piece.surface.positions);
    let inserted = piece.surface.triangles.iter();
    patch.triangles.extend(inserted.map(|corners| corners.map(|v| PatchCorner::New(first + v))));
    Some(Replacement { removed: hole.removed, patch: without_unused_positions(patch), components })
}

/// Returns by how much the number of components of the mesh changes if `before` connected parts of it are replaced by
/// `after`; `pairs` are the parts at each rim, before and after. `None` if a part is replaced by others than one.
fn change_of_components(mut pairs: Vec<(u32, u32)>, before: usize, after: usize) -> Option<i32> {
    let distinct = |parts: &mut Vec<u32>| {
        sort_distinct(parts);
        parts.len()
    };
    sort_by_rank(&mut pairs, |&(before, after)| combined_rank(before, after));
    pairs.dedup();
    let open_before = distinct(&mut pairs.iter().map(|pair| pair.0).collect());
    let open_after = distinct(&mut pairs.iter().map(|pair| pair.1).collect());
    let is_one_to_one = open_before == pairs.len() && open_after == pairs.len();
    is_one_to_one.then_some((after - open_after) as i32 - (before - open_before) as i32)
}

/// The vertices to remove from the mesh.
struct Hole {
    /// The vertices, sorted by id.
    removed: Vec<VertexId>,
    /// By vertex of `removed`, the index of its connected part.
    part: Vec<u32>,
    /// The number of connected parts.
    parts: usize,
}

impl Hole {
    /// Selects the connected parts of the vertices `near` that reach into the box `inner`, and bits of the mesh that they
    /// cut off: beside the faces of the box, the surface may wind in and out without the contour doing so, too.
    fn new(mesh: &Mesh, near: &[VertexId], inner: &Bounds) -> Self {
        let mut removed = Vec::new();
        for part in connected_parts(mesh, near) {
            if part.iter().any(|&v| inner.contains(mesh.position(v))) {
                removed.extend(part);
            }
        }
        sort_vertices(&mut removed);
        let mut rim = removed.clone();
        mesh.add_neighbours(&mut rim);
        rim.retain(|v| removed.binary_search(v).is_err());
        let mut cut_off = Vec::new();
        for v in rim {
            cut_off.extend(cut_off_at(mesh, v, &removed).unwrap_or_default());
        }
        removed.extend(cut_off);
        sort_vertices(&mut removed);
        let mut part = vec![0; removed.len()];
        let parts = connected_parts(mesh, &removed);
        for (k, members) in parts.iter().enumerate() {
            for index in members.iter().filter_map(|v| removed.binary_search(v).ok()) {
                part[index] = k as u32;
            }
        }
        Self { removed, part, parts: parts.len() }
    }

    fn index(&self, v: VertexId) -> Option<usize> {
        self.removed.binary_search(&v).ok()
    }
}

/// Returns the connected parts of some vertices, sorted by id, of the mesh.
fn connected_parts(mesh: &Mesh, vertices: &[VertexId]) -> Vec<Vec<VertexId>> {
    let mut is_found = vec![false; vertices.len()];
    let mut parts = Vec::new();
    for (first, &v) in vertices.iter().enumerate() {
        if std::mem::replace(&mut is_found[first], true) {
            continue;
        }
        let (mut part, mut next) = (vec![v], 0);
        while next < part.len() {
            for w in mesh.ring(part[next]).as_slice() {
                if let Ok(index) = vertices.binary_search(w)
                    && !std::mem::replace(&mut is_found[index], true)
                {
                    part.push(*w);
                }
            }
            next += 1;
        }
        parts.push(part);
    }
    parts
}

/// Returns the vertices that are connected with `v` without passing through `removed`, if these are at most
/// [`MAX_CUT_OFF`].
fn cut_off_at(mesh: &Mesh, v: VertexId, removed: &[VertexId]) -> Option<Vec<VertexId>> {
    let (mut found, mut next) = (vec![v], 0);
    while next < found.len() {
        for w in mesh.ring(found[next]).as_slice() {
            if removed.binary_search(w).is_err() && !found.contains(w) {
                found.push(*w);
            }
        }
        if found.len() > MAX_CUT_OFF {
            return None;
        }
        next += 1;
    }
    Some(found)
}

/// The mesh outside a box: what remains of the triangles that the faces of the box cut, and the rims there.
struct CutMesh {
    /// The vertices on cut edges, and the remains of the cut triangles.
    patch: Patch,
    /// By vertex on a cut edge, the connected part of the removed vertices at its other end.
    part: Vec<u32>,
    /// By vertex on a cut edge, the next one along its rim; a strip that closes the hole has triangles on this edge.
    next: BTreeMap<u32, u32>,
}

impl CutMesh {
    /// Cuts the triangles at removed vertices where they enter the box `bounds`.
    fn new(mesh: &Mesh, hole: &Hole, bounds: &Bounds) -> Self {
        let mut cut = Self { patch: Patch::default(), part: Vec::new(), next: BTreeMap::new() };
        let mut ends = BTreeMap::new();
        for corners in mesh.triangles_at(&hole.removed) {
            let inside = corners.map(|v| hole.index(v).is_some());
            let Some(k) = odd_one_out(inside) else { continue };
            let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
            let mut end = |kept: VertexId, gone: VertexId| {
                *ends.entry(combined_rank(kept.0, gone.0)).or_insert_with(|| {
                    cut.patch.positions.push(cut_point(bounds, mesh.position(kept), mesh.position(gone)));
                    cut.part.push(hole.index(gone).map_or(0, |index| hole.part[index]));
                    cut.patch.positions.len() as u32 - 1
                })
            };
            if inside[k] {
                let (from, to) = (end(b, a), end(c, a));
                cut.next.insert(from, to);
                cut.keep_quad(mesh, [from, to], [b, c]);
            } else {
                let (from, to) = (end(a, c), end(a, b));
                cut.next.insert(from, to);
                cut.patch.triangles.push([
                    PatchCorner::Kept(a),
                    PatchCorner::New(to),
                    PatchCorner::New(from),
                ]);
            }
        }
        cut
    }

    /// Keeps the part of a triangle between two cut points, `from` and `to`, and the edge of two kept vertices, `b` and
    /// `c`, which are on the same edges as `from` and `to`, in this order.
    fn keep_quad(&mut self, mesh: &Mesh, [from, to]: [u32; 2], [b, c]: [VertexId; 2]) {
        let point = |k: u32| self.patch.positions[k as usize];
        let [first, second] =
            [point(from).distance_squared(mesh.position(c)), point(to).distance_squared(mesh.position(b))];
        let [p, q, b, c] =
            [PatchCorner::New(from), PatchCorner::New(to), PatchCorner::Kept(b), PatchCorner::Kept(c)];
        self.patch.triangles.extend(if first < second {
            [[p, b, c], [p, c, q]]
        } else {
            [[p, b, q], [b, c, q]]
        });
    }
}

/// Returns the index of the value that differs from the two others; `None` if all are equal.
fn odd_one_out(values: [bool; 3]) -> Option<usize> {
    (0..3).find(|&k| values[k] != values[(k + 1) % 3] && values[k] != values[(k + 2) % 3])
}

/// Returns the point at which the edge from a vertex outside a box to one inside enters the box, at least
/// [`CUT_MARGIN`] of the edge from its ends.
fn cut_point(bounds: &Bounds, outside: Vec3, inside: Vec3) -> Vec3 {
    let mut share = 0.0f32;
    for axis in 0..3 {
        let (from, to) = (outside[axis], inside[axis]);
        let face = if from < bounds.min[axis] { bounds.min[axis] } else { bounds.max[axis] };
        if from < bounds.min[axis] || from > bounds.max[axis] {
            let entry = (face - from) / (to - from);
            share = if entry > share { entry } else { share };
        }
    }
    outside + (inside - outside) * share.clamp(CUT_MARGIN, 1.0 - CUT_MARGIN)
}

/// The contour in a box, open at those faces of the box that are not at the border of the image.
struct Piece {
    surface: TriangleMesh,
    /// By vertex, the lowest vertex of its connected part.
    part: Vec<u32>,
    /// By vertex, for those named in `part`: whether the part may be left out if no rim of it has a partner in the mesh.
    /// It belongs to a component that encloses less than the smallest part, or is near the faces of the box only.
    is_negligible: Vec<bool>,
}

impl Piece {
    fn new(image: &LevelImage, at: PatchBox, rule: ContourRule) -> Result<Self, MethodError> {
        let part = image.part_grid().0.region(at.voxels)?.into();
        let offset = Vec3::from(at.voxels.min.map(|k| k as f32));
        let mut surface = placed(contour_of_grid(&Subdivided::whole(&part), rule)?, |p| p + offset);
        let component = surface.component_of_each_vertex();
        let sizes = sizes_of_parts(&surface, &component, rule.smallest_part);
        let is_inside: Vec<bool> = surface.positions.iter().map(|&p| at.inner.contains(p)).collect();
        surface.triangles.retain(|corners| corners.iter().all(|&v| is_inside[v as usize]));
        let part = surface.component_of_each_vertex();
        let deep = Bounds { min: at.inner.min + Vec3::splat(GAP), max: at.inner.max - Vec3::splat(GAP) };
        let mut is_negligible = vec![true; part.len()];
        for (v, &p) in surface.positions.iter().enumerate().filter(|&(v, _)| is_inside[v]) {
            let is_small = sizes[component[v] as usize] < rule.smallest_part;
            is_negligible[part[v] as usize] &= is_small || !deep.contains(p);
        }
        Ok(Self { surface, part, is_negligible })
    }

    /// Returns the number of connected parts of the contour.
    fn part_count(&self) -> usize {
        let mut parts = self.surface.triangles.iter().map(|corners| self.part[corners[0] as usize]).collect();
        sort_distinct(&mut parts);
        parts.len()
    }

    /// Returns the rims of the contour, cycles of vertices along which strips are to be added.
    fn rims(&self) -> Option<Vec<Vec<u32>>> {
        let sides = |corners: &[u32; 3]| [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]);
        let mut edges: Vec<u64> =
            self.surface.triangles.iter().flat_map(sides).map(|[a, b]| combined_rank(a, b)).collect();
        sort_ranks(&mut edges);
        let is_open = |edge: &&u64| edges.binary_search(&edge.rotate_left(32)).is_err();
        let open: Vec<u64> = edges.iter().filter(is_open).copied().collect();
        let next: BTreeMap<u32, u32> = open.iter().map(|edge| ((edge >> 32) as u32, *edge as u32)).collect();
        if next.len() == open.len() { rims(&next) } else { None }
    }

    /// Removes negligible parts without a partner in the mesh. Returns `None` if another one has a rim without a partner.
    fn leave_out_noise(&mut self, rims: &[Vec<u32>], partners: &[Option<usize>]) -> Option<()> {
        let mut is_left_out = std::mem::take(&mut self.is_negligible);
        let part = |rim: &Vec<u32>| self.part[rim[0] as usize] as usize;
        let rims = || rims.iter().zip(partners);
        rims().for_each(|(rim, partner)| is_left_out[part(rim)] &= partner.is_none());
        if rims().any(|(rim, partner)| partner.is_none() && !is_left_out[part(rim)]) {
            return None;
        }
        self.surface.triangles.retain(|corners| !is_left_out[self.part[corners[0] as usize] as usize]);
        Some(())
    }
}

/// Returns the cycles of a permutation of vertices, each from its lowest vertex on; `None` if it is none.
fn rims(next: &BTreeMap<u32, u32>) -> Option<Vec<Vec<u32>>> {
    let mut rest = next.clone();
    let mut rims = Vec::new();
    while let Some((first, mut here)) = rest.pop_first() {
        let mut rim = vec![first];
        while here != first {
            rim.push(here);
            here = rest.remove(&here)?;
        }
        rims.push(rim);
    }
    Some(rims)
}

/// Returns for each of `rims` the one of `others` that all its vertices are nearest to, if all vertices of that one are
/// nearest to it, too.
fn partners(rims: &[Vec<Vec3>], others: &[Vec<Vec3>]) -> Vec<Option<usize>> {
    let back: Vec<Option<usize>> = others.iter().map(|rim| nearest_rim(rim, rims)).collect();
    let there = rims.iter().map(|rim| nearest_rim(rim, others));
    there.enumerate().map(|(k, other)| other.filter(|&other| back[other] == Some(k))).collect()
}

/// Returns the rim that all points are nearest to, within [`MAX_RIM_DISTANCE`].
fn nearest_rim(points: &[Vec3], rims: &[Vec<Vec3>]) -> Option<usize> {
    let nearest = |p: Vec3| {
        let mut least = (MAX_RIM_DISTANCE * MAX_RIM_DISTANCE, None);
        for (k, rim) in rims.iter().enumerate() {
            for (i, &a) in rim.iter().enumerate() {
                let square = squared_distance_to_segment(p, a, rim[(i + 1) % rim.len()]);
                least = if square < least.0 { (square, Some(k)) } else { least };
            }
        }
        least.1
    };
    let first = nearest(*points.first()?)?;
    points.iter().all(|&p| nearest(p) == Some(first)).then_some(first)
}

fn squared_distance_to_segment(p: Vec3, a: Vec3, b: Vec3) -> f32 {
    let (ab, ap) = (b - a, p - a);
    let length = ab.length_squared();
    let share = if length > 0.0 { (ap.dot(ab) / length).clamp(0.0, 1.0) } else { 0.0 };
    ap.distance_squared(ab * share)
}

/// A corner of a strip's triangle: whether it is on the contour's rim, and its index along the rim.
type StripCorner = (bool, usize);

/// Returns the triangles between the rims of the mesh and of the contour, which have the same direction, such that the
/// sum of squared lengths of the edges across is least among those strips that begin at the shortest of these edges.
fn strip(here: &[Vec3], there: &[Vec3]) -> Option<Vec<[StripCorner; 3]>> {
    let (n, m) = (here.len(), there.len());
    if n * m > MAX_PAIRS {
        return None;
    }
    let mut begin = (f32::INFINITY, 0, 0);
    for (i, p) in here.iter().enumerate() {
        for (j, q) in there.iter().enumerate() {
            let square = p.distance_squared(*q);
            begin = if square < begin.0 { (square, i, j) } else { begin };
        }
    }
    let at = |i: usize, j: usize| ((begin.1 + i) % n, (begin.2 + j) % m);
    let cost = |i: usize, j: usize| {
        let (i, j) = at(i, j);
        here[i].distance_squared(there[j])
    };
    let mut total = vec![f32::INFINITY; (n + 1) * (m + 1)];
    let mut is_step_there = vec![false; (n + 1) * (m + 1)];
    total[0] = 0.0;
    for i in 0..=n {
        for j in 0..=m {
            let k = i * (m + 1) + j;
            let by_here = if i > 0 { total[k - m - 1] } else { f32::INFINITY };
            let by_there = if j > 0 { total[k - 1] } else { f32::INFINITY };
            if k > 0 {
                is_step_there[k] = by_there < by_here;
                total[k] = if by_there < by_here { by_there } else { by_here } + cost(i, j);
            }
        }
    }
    let mut triangles = Vec::with_capacity(n + m);
    let (mut i, mut j) = (n, m);
    while i + j > 0 {
        let end = at(i, j);
        if is_step_there[i * (m + 1) + j] {
            j -= 1;
            triangles.push([(true, end.1), (true, at(i, j).1), (false, end.0)]);
        } else {
            i -= 1;
            triangles.push([(false, at(i, j).0), (false, end.0), (true, end.1)]);
        }
    }
    Some(triangles)
}

fn without_unused_positions(patch: Patch) -> Patch {
    let mut index = vec![u32::MAX; patch.positions.len()];
    let mut positions = Vec::with_capacity(patch.positions.len());
    let mut renumbered = |corner| match corner {
        PatchCorner::New(k) => {
            let new = &mut index[k as usize];
            if *new == u32::MAX {
                *new = positions.len() as u32;
                positions.push(patch.positions[k as usize]);
            }
            PatchCorner::New(*new)
        }
        kept => kept,
    };
    let triangles = patch.triangles.iter().map(|corners| corners.map(&mut renumbered)).collect();
    Patch { positions, triangles }
}
