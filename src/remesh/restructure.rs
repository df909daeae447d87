//! Restructuring: edge lengths within bounds and valences near six (Kobbelt, Bareuther & Seidel, *Multiresolution shape
//! deformations for meshes with dynamic vertex connectivity*, section 4).
//!
//! Guarantees: a closed, oriented manifold stays one, with the same components and χ; no triangle turns by more than
//! 78°; no collapse makes an edge longer than the upper bound, or leaves a vertex with fewer than four neighbours. Not
//! guaranteed: that all edges are brought within bounds, and, with [`Unchecked`] edits, that no triangles intersect.

use super::{Changes, Embedding};
use crate::math::order::{combined_rank, rank_f32, sort_by_rank};
use crate::math::{Vec3, triangle};
use crate::mesh::{EditError, MAX_VERTICES, Mesh, MeshError, OppositeVertices, VertexId};
use crate::pauses::{Pauses, finished};
use std::ops::Range;

/// The shortest and the longest edge allowed (ε_min and ε_max of Kobbelt, Bareuther & Seidel), in units of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeBounds {
    /// The lower bound: shorter edges are collapsed.
    pub min: f32,
    /// The upper bound: longer edges are split. More than twice `min`, so that halves stay within bounds.
    pub max: f32,
}

impl EdgeBounds {
    /// Returns both bounds multiplied by `factor`.
    pub fn scaled(self, factor: f32) -> Self {
        Self { min: self.min * factor, max: self.max * factor }
    }
}

/// The shortest upper bound of edge lengths, in spacings of single-precision numbers at the largest coordinate. Below a
/// few spacings, edges cannot become as short as the bound, however often they are split, and triangles degenerate; at
/// 64, positions are rounded by less than 1 % of an edge. With more, a mesh of 100,000 edges in a row is refused.
const SPACINGS: f32 = 64.0;

/// Vertices per area of a mesh of equilateral triangles, in units of 1 / (squared edge length), to estimate the size of
/// a result: 2 / √3.
const VERTICES_PER_AREA: f64 = 1.1547;

impl EdgeBounds {
    /// Checks the bounds, and that a mesh of the shape of `mesh` with edges within them fits into memory, by an
    /// estimate from its area and edge lengths.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] unless both bounds are finite, `min` is above 0 and `max` more than twice `min`;
    /// [`MeshError::Precision`] if `max` is below 64 times the spacing of single-precision numbers at the largest
    /// coordinate; [`MeshError::TooManyVertices`] if more than [`MAX_VERTICES`] would be needed.
    pub fn check_for(self, mesh: &Mesh) -> Result<(), MeshError> {
        let Self { min, max } = self;
        // Also rejects NaN.
        if !(min > 0.0 && max > 2.0 * min && max.is_finite()) {
            let problem = format!("min must be > 0 and max finite and > 2 min, got min {min}, max {max}");
            return Err(MeshError::InvalidArgument { parameter: "edge", problem });
        }
        let area: f64 = mesh.triangles().map(|corners| triangle::area(mesh.facet(corners).points)).sum();
        let [min, max] = [min, max].map(f64::from);
        // The splits account for needles, which have long edges and hardly any area.
        let splits =
            |(u, v)| (mesh.position(u).as_dvec3().distance(mesh.position(v).as_dvec3()) / max).floor();
        let vertices = VERTICES_PER_AREA * area / (min * max) + mesh.edges().map(splits).sum::<f64>();
        if vertices >= MAX_VERTICES as f64 {
            // Saturates beyond the range.
            return Err(MeshError::TooManyVertices { vertices: vertices as u64 });
        }
        self.check_precision(mesh)
    }

    /// Returns an error unless positions of the mesh are much finer than the longest edges allowed.
    fn check_precision(self, mesh: &Mesh) -> Result<(), MeshError> {
        let largest = mesh.vertices().map(|v| mesh.position(v).abs().max_element()).fold(0.0, f32::max);
        let least = SPACINGS * f32::EPSILON * largest;
        if self.max >= least {
            return Ok(());
        }
        let problem = format!(
            "edge: max must be at least {least}, got {}: coordinates of up to {largest} have no finer positions in single \
             precision; move the mesh nearer to the origin, or allow longer edges",
            self.max
        );
        Err(MeshError::Precision { problem })
    }
}

/// Decides which edits restructuring makes, and how they are tested for self-intersections.
pub trait EditPolicy {
    /// Makes an edit, or leaves the mesh unchanged on an error.
    ///
    /// # Errors
    /// The error of the edit, or the reason it was rolled back.
    fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError>;

    /// Returns whether the vertex `_gone` may be collapsed into `_kept`, in addition to the tests that restructuring
    /// makes itself; by default always.
    fn may_collapse(&mut self, _mesh: &Mesh, _kept: VertexId, _gone: VertexId) -> bool {
        true
    }

    /// Returns whether the edge between `ends` may be flipped to connect `across`, in addition to the tests that
    /// restructuring makes itself; by default always.
    fn may_flip(&mut self, _mesh: &Mesh, _ends: [VertexId; 2], _across: [VertexId; 2]) -> bool {
        true
    }

    /// Called after the last edge passed to [`Self::may_collapse`] was collapsed into `kept`, to update the data of a
    /// policy.
    fn collapsed(&mut self, _kept: VertexId) {}

    /// Called after an edge at `u` was split by the new vertex `fresh`, to update the data of a policy.
    fn was_split(&mut self, _fresh: VertexId, _u: VertexId) {}

    /// Returns the work of all tests so far, counted in nearby vertices visited; 0 without tests.
    fn effort(&self) -> u64 {
        0
    }
}

/// An [`EditPolicy`] without tests for self-intersections: ten times as fast as with an [`Embedding`]. The caller
/// checks the result.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unchecked;

impl EditPolicy for Unchecked {
    fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        edit(mesh)
    }
}

impl EditPolicy for Embedding {
    fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        Self::attempt(self, mesh, edit)
    }

    fn effort(&self) -> u64 {
        Self::effort(self)
    }
}

/// The cosine of the largest angle by which an edit may turn a triangle, 78°. A larger angle lets folds develop over
/// many edits; with a smaller one, edges on ridges stay out of bounds.
const MIN_COSINE: f32 = 0.2;

/// The lowest valence that a collapse or flip may leave: a vertex of valence three lies inside a triangle.
pub(super) const MIN_VALENCE: usize = 4;

/// The highest valence that a collapse may leave: among many short edges it would grow without bound, and rings are
/// searched linearly.
const MAX_VALENCE: usize = 16;

/// The largest number of passes of splits or flips in one call. Each pass of splits halves the longest edges, so this
/// many reach any bound; flips never needed more than six.
const PASSES: usize = 24;

/// The squared length of each half of an edge to be split, relative to that of the edge, is less than this; it is 0.25
/// unless the edge is as short as the spacing of coordinates.
const HALVED: f32 = 0.5;

/// The number of slots, or edges, that a pass visits between two counts of its work.
const CHUNK: usize = 32;

/// The number of units of work that a chunk counts as, besides its tests for self-intersections.
const CHUNK_WORK: usize = 4;

/// The number of nearby vertices visited that are a unit of work.
const EFFORT_PER_UNIT: u64 = 16;

/// The work of a pass.
pub(super) struct Work<'a> {
    pauses: &'a Pauses,
    /// The effort of the edit policy when work was last counted.
    effort: u64,
}

impl<'a> Work<'a> {
    pub fn new(edits: &impl EditPolicy, pauses: &'a Pauses) -> Self {
        Self { pauses, effort: edits.effort() }
    }

    /// Counts the work of a chunk.
    pub async fn count(&mut self, edits: &impl EditPolicy) {
        let before = std::mem::replace(&mut self.effort, edits.effort());
        let tests = self.effort.saturating_sub(before) / EFFORT_PER_UNIT;
        self.pauses.after(CHUNK_WORK + tests as usize).await;
    }
}

/// Returns the slots up to `end` in chunks.
pub(super) fn chunks(end: usize) -> impl Iterator<Item = Range<usize>> {
    (0..end).step_by(CHUNK).map(move |first| first..end.min(first + CHUNK))
}

/// Performs one round of restructuring: collapses short edges, splits long ones, and flips edges to bring valences near
/// six. Rejected edits are skipped, and there are no splits beyond [`MAX_VERTICES`]. Returns the numbers of edits.
pub fn restructure(mesh: &mut Mesh, bounds: EdgeBounds, edits: &mut impl EditPolicy) -> Changes {
    finished(restructure_in_slices(mesh, bounds, edits, &Pauses::default()))
}

/// Does what [`restructure()`] does, and pauses meanwhile.
pub async fn restructure_in_slices(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    edits: &mut impl EditPolicy,
    pauses: &Pauses,
) -> Changes {
    let mut changes = collapse_short(mesh, bounds, edits, pauses).await;
    changes += split_long(mesh, bounds, MAX_VERTICES, edits, pauses).await;
    changes += flip_for_valence(mesh, bounds, edits, pauses).await;
    changes
}

/// A pass of restructuring, for [`restructure_in_passes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestructurePass {
    /// Collapses edges shorter than the lower bound, see [`collapse_short`].
    Collapse,
    /// Splits edges longer than the upper bound, see [`split_long`].
    Split,
    /// Flips edges to bring valences near six, see [`flip_for_valence`].
    Flip,
}

/// Runs passes of restructuring in the given order, without tests for self-intersections; returns the numbers of edits.
///
/// # Errors
/// Those of [`EdgeBounds::check_for`]; [`MeshError::TooManyVertices`] also where splits need more than [`MAX_VERTICES`], of
/// which the estimate in advance may be half. The mesh is unchanged on error.
pub fn restructure_in_passes(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    passes: &[RestructurePass],
) -> Result<Changes, MeshError> {
    finished(passes_in_slices(mesh, bounds, passes, &Pauses::default()))
}

/// Does what [`restructure_in_passes`] does, and pauses meanwhile.
///
/// # Errors
/// As [`restructure_in_passes`].
pub async fn passes_in_slices(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    passes: &[RestructurePass],
    pauses: &Pauses,
) -> Result<Changes, MeshError> {
    bounds.check_for(mesh)?;
    pauses.now().await;
    run_passes(mesh, bounds, passes, MAX_VERTICES, pauses).await
}

/// Does what [`restructure_in_passes`] does, with at most `most` vertices, and unchecked bounds.
async fn run_passes(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    passes: &[RestructurePass],
    most: usize,
    pauses: &Pauses,
) -> Result<Changes, MeshError> {
    let before = passes.contains(&RestructurePass::Split).then(|| mesh.clone());
    let mut changes = Changes::default();
    let edits = &mut Unchecked;
    for pass in passes {
        changes += match pass {
            RestructurePass::Collapse => collapse_short(mesh, bounds, edits, pauses).await,
            RestructurePass::Split => split_long(mesh, bounds, most, edits, pauses).await,
            RestructurePass::Flip => flip_for_valence(mesh, bounds, edits, pauses).await,
        };
        pauses.now().await;
        let left = if mesh.vertex_count() >= most { long_edges(mesh, bounds).count() } else { 0 };
        if let Some(before) = before.as_ref().filter(|_| left > 0 && *pass == RestructurePass::Split) {
            let vertices = (mesh.vertex_count() + left) as u64;
            mesh.clone_from(before);
            return Err(MeshError::TooManyVertices { vertices });
        }
    }
    Ok(changes)
}

/// Iterates over the edges longer than the upper bound, with their squared lengths.
fn long_edges(mesh: &Mesh, bounds: EdgeBounds) -> impl Iterator<Item = (f32, (VertexId, VertexId))> + '_ {
    let longest = bounds.max * bounds.max;
    let square = |(u, v): (VertexId, VertexId)| mesh.position(u).distance_squared(mesh.position(v));
    mesh.edges().map(move |edge| (square(edge), edge)).filter(move |&(square, _)| square > longest)
}

/// Collapses edges shorter than the lower bound into the end of higher valence, or into the other if that is rejected
/// (Kobbelt, Bareuther & Seidel, figure 4), and pauses meanwhile; returns the number of collapses.
pub async fn collapse_short(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    edits: &mut impl EditPolicy,
    pauses: &Pauses,
) -> Changes {
    let (mut changes, mut work) = (Changes::default(), Work::new(edits, pauses));
    for slots in chunks(mesh.slots()) {
        changes += collapse_short_at(mesh, bounds, edits, slots);
        work.count(edits).await;
    }
    changes
}

/// Collapses short edges at the vertices in some slots, as [`collapse_short`].
fn collapse_short_at(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    edits: &mut impl EditPolicy,
    slots: Range<usize>,
) -> Changes {
    let mut changes = Changes::default();
    let shortest = bounds.min * bounds.min;
    for slot in slots {
        let u = VertexId::from_index(slot);
        // The remaining vertex is processed again until none of its edges can be collapsed.
        while let Some((kept, removed)) = short_edge(mesh, u, shortest, |kept, removed| {
            may_collapse(mesh, bounds, kept, removed) && edits.may_collapse(mesh, kept, removed)
        }) {
            let position = mesh.position(kept);
            if edits.attempt(mesh, |mesh| mesh.collapse(kept, removed, position)).is_err() {
                break;
            }
            edits.collapsed(kept);
            changes.deletions += 1;
        }
    }
    changes
}

/// Returns the first edge at `u` that is shorter than the square root of `shortest` and may be collapsed according to
/// `may`: the vertex to keep and the one to remove; `None` if there is no such edge.
fn short_edge(
    mesh: &Mesh,
    u: VertexId,
    shortest: f32,
    mut may: impl FnMut(VertexId, VertexId) -> bool,
) -> Option<(VertexId, VertexId)> {
    if !mesh.is_live(u) {
        return None;
    }
    let from = mesh.position(u);
    let short = |v: &&VertexId| from.distance_squared(mesh.position(**v)) < shortest;
    mesh.ring(u).as_slice().iter().filter(short).find_map(|&v| {
        let u_stays = mesh.ring(u).valence() >= mesh.ring(v).valence();
        let (kept, removed) = if u_stays { (u, v) } else { (v, u) };
        [(kept, removed), (removed, kept)].into_iter().find(|&(kept, removed)| may(kept, removed))
    })
}

/// Returns whether `removed` may be collapsed into `kept` within the bounds on edge lengths, angles and valences.
pub(super) fn may_collapse(mesh: &Mesh, bounds: EdgeBounds, kept: VertexId, removed: VertexId) -> bool {
    // The most frequent reasons for rejection first.
    if !may_move(mesh, bounds, kept, removed) {
        return false;
    }
    let Ok(OppositeVertices { left, right }) = mesh.can_collapse(kept, removed) else { return false };
    let valences = mesh.ring(kept).valence() + mesh.ring(removed).valence() - 4;
    (MIN_VALENCE..=MAX_VALENCE).contains(&valences)
        && [left, right].iter().all(|&w| mesh.ring(w).valence() > MIN_VALENCE)
}

/// Returns whether collapsing `removed` into `kept` makes no edge too long and turns no triangle by more than 78°.
fn may_move(mesh: &Mesh, bounds: EdgeBounds, kept: VertexId, removed: VertexId) -> bool {
    let (to, from) = (mesh.position(kept), mesh.position(removed));
    let longest = bounds.max * bounds.max;
    mesh.ring(removed).pairs().all(|(a, b)| {
        if a == kept || b == kept {
            return true;
        }
        let (p, q) = (mesh.position(a), mesh.position(b));
        let fits = p.distance_squared(to) <= longest && q.distance_squared(to) <= longest;
        fits && faces_alike((p - from).cross(q - from), (p - to).cross(q - to))
    })
}

/// Returns whether two triangle normals, of any positive length, differ by less than 78°, the largest angle by which an
/// edit may turn a triangle.
pub(super) fn faces_alike(before: Vec3, after: Vec3) -> bool {
    let cosine = before.dot(after);
    // Squares avoid square roots; the comparison is false for NaN.
    let least = MIN_COSINE * MIN_COSINE * before.length_squared() * after.length_squared();
    if least.is_normal() && cosine.is_normal() {
        return cosine > 0.0 && cosine * cosine > least;
    }
    // Fourth powers of edges below 10⁻⁹ or above 10⁹ are beyond the range of single precision.
    let [before, after] = [before, after].map(Vec3::as_dvec3);
    let (cosine, least) = (before.dot(after), f64::from(MIN_COSINE));
    cosine > 0.0 && cosine * cosine > least * least * before.length_squared() * after.length_squared()
}

/// Splits edges longer than the upper bound at their midpoint, longest first, until there are none (Kobbelt, Bareuther
/// & Seidel, figure 5) or the mesh has `most` vertices; rejected splits are skipped. Pauses meanwhile. Returns the number
/// of splits.
pub async fn split_long(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    most: usize,
    edits: &mut impl EditPolicy,
    pauses: &Pauses,
) -> Changes {
    let (mut changes, mut work) = (Changes::default(), Work::new(edits, pauses));
    for _ in 0..PASSES {
        let before = changes.creations;
        let mut long: Vec<_> = long_edges(mesh, bounds).collect();
        pauses.now().await;
        sort_by_rank(&mut long, |&(_, (u, v))| combined_rank(u.0, v.0));
        pauses.now().await;
        sort_by_rank(&mut long, |&(square, _)| (!rank_f32(square)).into());
        pauses.now().await;
        for some in long.chunks(CHUNK) {
            changes += split_edges(mesh, some, most, edits);
            work.count(edits).await;
        }
        if changes.creations == before {
            break;
        }
    }
    changes
}

/// Splits edges, given with their squared lengths, at their midpoints until the mesh has `most` vertices.
fn split_edges(
    mesh: &mut Mesh,
    long: &[(f32, (VertexId, VertexId))],
    most: usize,
    edits: &mut impl EditPolicy,
) -> Changes {
    let mut changes = Changes::default();
    for &(square, (u, v)) in long {
        if mesh.vertex_count() >= most {
            return changes;
        }
        let ends = [u, v].map(|end| mesh.position(end));
        let middle = (ends[0] + ends[1]) * 0.5;
        // Rounded towards one end, it makes no progress. Also rejects NaN.
        let is_halved = |end: Vec3| end.distance_squared(middle) < HALVED * square;
        if !ends.into_iter().all(is_halved) {
            continue;
        }
        if let Ok(fresh) = edits.attempt(mesh, |mesh| mesh.split(u, v, middle)) {
            edits.was_split(fresh, u);
            changes.creations += 1;
        }
    }
    changes
}

/// Flips edges where that is allowed and lowers the sum of (valence − 6)² over the four corners around them (Kobbelt,
/// Bareuther & Seidel, figure 6). Allowed are flips that `may_flip` and `edits` permit. Ends when a pass flips none, or
/// after `PASSES` passes. Pauses meanwhile. Returns the number of flips.
pub async fn flip_for_valence(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    edits: &mut impl EditPolicy,
    pauses: &Pauses,
) -> Changes {
    let (mut changes, mut work) = (Changes::default(), Work::new(edits, pauses));
    // Vertices whose edges have to be tested again since a flip changed valences near them.
    let mut stale = vec![true; mesh.slots()];
    for _ in 0..PASSES {
        let before = changes.inversions;
        for slots in chunks(mesh.slots()) {
            if stale[slots.clone()].contains(&true) {
                changes += flip_for_valence_at(mesh, bounds, edits, &mut stale, slots);
                work.count(edits).await;
            }
        }
        if changes.inversions == before {
            break;
        }
    }
    changes
}

/// Flips edges at the vertices in some slots that are `stale`, as [`flip_for_valence`].
fn flip_for_valence_at(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    edits: &mut impl EditPolicy,
    stale: &mut [bool],
    slots: Range<usize>,
) -> Changes {
    let mut changes = Changes::default();
    for slot in slots {
        if !std::mem::replace(&mut stale[slot], false) {
            continue;
        }
        let u = VertexId::from_index(slot);
        let mut k = 0;
        while let Some(&v) = mesh.ring(u).as_slice().get(k) {
            k += 1;
            if u < v && flip_if_wanted(mesh, bounds, [u, v], edits, stale) {
                changes.inversions += 1;
                k -= 1;
            }
        }
    }
    changes
}

/// Flips the edge `uv` if that lowers the sum of (valence − 6)² over its four corners and is allowed. Then marks as
/// stale, to be tested again, the vertices of all edges that have one of these corners. Returns whether the edge was
/// flipped.
fn flip_if_wanted(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    [u, v]: [VertexId; 2],
    edits: &mut impl EditPolicy,
    stale: &mut [bool],
) -> bool {
    let Ok(OppositeVertices { left, right }) = mesh.opposite_vertices(u, v) else { return false };
    if !wants_flip(mesh, bounds, [u, v], [left, right], edits)
        || edits.attempt(mesh, |mesh| mesh.flip(u, v)).is_err()
    {
        return false;
    }
    for corner in [u, v, left, right] {
        stale[corner.index()] = true;
        mesh.ring(corner).as_slice().iter().for_each(|w| stale[w.index()] = true);
    }
    true
}

fn wants_flip(
    mesh: &Mesh,
    bounds: EdgeBounds,
    [u, v]: [VertexId; 2],
    [left, right]: [VertexId; 2],
    edits: &mut impl EditPolicy,
) -> bool {
    let excess = |w: VertexId, change: i32| {
        let over = mesh.ring(w).valence() as i32 + change - 6;
        over * over
    };
    let now = excess(u, 0) + excess(v, 0) + excess(left, 0) + excess(right, 0);
    let then = excess(u, -1) + excess(v, -1) + excess(left, 1) + excess(right, 1);
    then < now
        && mesh.ring(u).valence() > MIN_VALENCE
        && mesh.ring(v).valence() > MIN_VALENCE
        && may_flip(mesh, bounds, [u, v], [left, right])
        && edits.may_flip(mesh, [u, v], [left, right])
}

/// Returns whether the edge between `ends` may be flipped to connect `across`: the new edge is within bounds, or nearer
/// to them than the old one, and the new triangles face as the old ones, within 78°.
pub(super) fn may_flip(mesh: &Mesh, bounds: EdgeBounds, ends: [VertexId; 2], across: [VertexId; 2]) -> bool {
    let [[p, q], [a, b]] = [ends, across].map(|pair| pair.map(|v| mesh.position(v)));
    let (old, new) = (p.distance_squared(q), a.distance_squared(b));
    let (shortest, longest) = (bounds.min * bounds.min, bounds.max * bounds.max);
    if new > longest && new >= old || new < shortest && new <= old {
        return false;
    }
    // Triangles p q a and q p b become p b a and q a b.
    let before = [(q - p).cross(a - p), (b - p).cross(q - p)];
    let after = [(b - p).cross(a - p), (a - q).cross(b - q)];
    before.into_iter().all(|old| after.into_iter().all(|new| faces_alike(old, new)))
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn a_large_mesh_that_keeps_its_edges_is_not_refused() {
        let mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.004).unwrap();
        let edge = mesh.longest_edge();
        assert_eq!(EdgeBounds { min: 0.5 * edge, max: 1.2 * edge }.check_for(&mesh), Ok(()));
        let refused = EdgeBounds { min: 0.2 * edge, max: 0.5 * edge }.check_for(&mesh);
        assert!(matches!(refused, Err(MeshError::TooManyVertices { .. })));
    }

    #[test]
    fn passes_that_need_too_many_vertices_change_nothing() {
        let before = Mesh::icosphere(Vec3::ZERO, 1.0, 0.3).unwrap();
        let bounds = EdgeBounds { min: 0.01, max: 0.05 };
        let split = [RestructurePass::Collapse, RestructurePass::Split, RestructurePass::Flip];
        let mut mesh = before.clone();
        let pauses = &Pauses::default();
        finished(run_passes(&mut mesh, bounds, &split, usize::MAX, pauses)).unwrap();
        let needed = mesh.vertex_count();
        let mut mesh = before.clone();
        let refused = finished(run_passes(&mut mesh, bounds, &split, needed - 1, pauses));
        assert_eq!(refused, Err(MeshError::TooManyVertices { vertices: needed as u64 }));
        assert!(mesh == before);
        // Those that add none, or no more than that, are not refused.
        finished(run_passes(&mut mesh, bounds, &split, needed, pauses)).unwrap();
        assert_eq!(mesh.vertex_count(), needed);
        let mut mesh = before.clone();
        let no_split = [RestructurePass::Collapse, RestructurePass::Flip];
        finished(run_passes(&mut mesh, bounds, &no_split, 1, pauses)).unwrap();
    }
}
