//! Isotropic remeshing: edge lengths within bounds, valences near six, shape preserved.
//!
//! Rounds of [`restructure`](super::restructure()) alternate with tangential relaxation and projection onto the input
//! surface (Botsch & Kobbelt, *A remeshing approach to multiresolution modeling*, 2004); then the smallest angles are
//! improved one by one (`min_angle`).
//!
//! Guarantees: a closed, oriented manifold stays one, with the same components and χ; no self-intersections are added.
//! Goals, without guarantee: all edges within bounds (shape, topology or a nearby sheet can prevent that for lower
//! bounds), no angle below 33°, and a surface within half an edge of the input.
//!
//! Edits are unchecked at first, since checks take most of the time and intersections are rare; the result is checked
//! as a whole. Sheets that intersect a little are separated, and remeshed nearby with checked edits (`conflicts`). If
//! that fails, another run from the start leaves the region unchanged; it is then remeshed with checked edits.

mod closest_point;
mod conflicts;
mod fan;
mod min_angle;
mod one_ring;
mod relax;
mod session;

use super::restructure::restructure_in_slices;
use super::unit_scale::unit_scale;
use super::{Changes, EdgeBounds, EditPolicy, Embedding, Unchecked};
use crate::mesh::{MAX_VERTICES, Mesh, MeshError};
use crate::pauses::{Pauses, finished};
use conflicts::ConflictMask;
use min_angle::improve_angles;
use relax::relax;
use session::Session;

/// The largest number of rounds of restructuring in a run. One fewer leaves twice as many angles below 33° for the
/// final optimisation; more cost more time than they save there.
const ROUNDS: usize = 5;
/// The largest number of relaxation sweeps after each round of restructuring. One fewer leaves twice as many angles
/// below 33° for the final optimisation; more cost more time than they save there.
const SWEEPS: usize = 2;

/// The ratio of the longest to the shortest edge allowed in rounds of restructuring, by Botsch & Kobbelt: triangles
/// with such edges have no angle below 33°. With a smaller ratio, halves of long edges are too short. To reach it, the
/// requested bounds are narrowed.
const INNER_RATIO: f32 = 5.0 / 3.0;
/// The largest factor by which each of the requested bounds of edge lengths is narrowed in rounds of restructuring.
const MAX_NARROWING: f32 = 1.2;

/// The largest number of runs with unchecked edits. Usually the second one has no intersections; if all have, a last
/// run checks all edits.
const UNCHECKED_RUNS: usize = 4;

/// The index, from 0, of the unchecked run after which, if it failed, the input is tested for self-intersections. The
/// test takes longer than a run to long edges, and only an input that intersects itself fails often.
const INPUT_TEST_RUN: usize = 1;

/// Remeshes isotropically: brings edge lengths within bounds and valences near six, preserving shape, components and χ;
/// returns the changes made. Vertices are renumbered.
///
/// Edges become about √(min max) long. Vertices lie on the input surface, except for midpoints of edges split last, and
/// for vertices moved to separate sheets, by up to a fifth of `max` along their normals or to the mean of their
/// neighbours. No self-intersections are added; if the input has some, edges may stay out of bounds, and a mesh collapsed
/// to one point stays unchanged. Attributes are blended by collapses and splits; moves do not change them.
///
/// # Errors
/// [`MeshError::InvalidArgument`] unless both bounds are finite, `min` is above 0 and `max` more than twice `min`;
/// [`MeshError::Precision`] if `max` is below 64 times the spacing of single-precision numbers at the largest coordinate;
/// [`MeshError::TooManyVertices`] if more than [`MAX_VERTICES`] would be needed; [`MeshError::TooCrowded`]. The mesh is
/// unchanged on error.
pub fn remesh(mesh: &mut Mesh, bounds: EdgeBounds) -> Result<Changes, MeshError> {
    finished(remesh_in_slices(mesh, bounds, &Pauses::default()))
}

/// Does what [`remesh`] does, and pauses meanwhile. The mesh is valid in each pause.
///
/// # Errors
/// As [`remesh`].
pub async fn remesh_in_slices(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    pauses: &Pauses,
) -> Result<Changes, MeshError> {
    bounds.check_for(mesh)?;
    // A mesh collapsed to one point has no surface; every edit would be tested against all its triangles.
    if is_one_point(mesh) {
        return Ok(Changes::default());
    }
    let before = mesh.clone();
    let [shrink, grow] = unit_scale(bounds.max);
    mesh.positions_mut().iter_mut().for_each(|p| *p *= shrink);
    pauses.now().await;
    let changes = remesh_scaled(mesh, bounds.scaled(shrink), pauses).await;
    pauses.now().await;
    let changes = changes.inspect_err(|_| mesh.clone_from(&before))?;
    if mesh.vertex_count() >= MAX_VERTICES {
        let vertices = mesh.vertex_count() as u64;
        mesh.clone_from(&before);
        return Err(MeshError::TooManyVertices { vertices });
    }
    mesh.reorder();
    mesh.positions_mut().iter_mut().for_each(|p| *p *= grow);
    Ok(changes)
}

/// Returns whether all vertices of a mesh have the same position, or there are none.
fn is_one_point(mesh: &Mesh) -> bool {
    let mut positions = mesh.vertices().map(|v| mesh.position(v));
    let first = positions.next();
    positions.all(|position| Some(position) == first)
}

/// Remeshes a mesh that was scaled to edges of about 1: with unchecked edits, then with checked ones where these caused
/// self-intersections. Returns the changes made.
///
/// # Errors
/// [`MeshError::TooCrowded`].
async fn remesh_scaled(mesh: &mut Mesh, bounds: EdgeBounds, pauses: &Pauses) -> Result<Changes, MeshError> {
    let surface = mesh.clone();
    let target_edge = (bounds.min * bounds.max).sqrt();
    let mut conflicts = ConflictMask::new(&surface);
    for run in 0..UNCHECKED_RUNS {
        let mut session = Session::new(&surface, target_edge, conflicts.complement(), Unchecked);
        pauses.now().await;
        let mut changes = rounds(mesh, bounds, &mut session, pauses).await;
        let mut embedding = embedding_of(mesh, bounds.max);
        embedding.set_limits_pairs(true);
        let intersecting = embedding.intersecting_vertices_in_slices(mesh, pauses).await;
        embedding.check_pairs(mesh)?;
        embedding.set_limits_pairs(false);
        let is_separated = intersecting.is_empty() || embedding.separate(mesh, &intersecting, pauses).await;
        let has_left_out = !conflicts.is_empty();
        pauses.now().await;
        let near = if is_separated {
            intersecting
        } else {
            embedding.intersecting_vertices_in_slices(mesh, pauses).await
        };
        near.into_iter().for_each(|v| conflicts.add(session.anchor(v), mesh.position(v), target_edge));
        if is_separated && conflicts.is_empty() {
            return Ok(changes);
        }
        if is_separated {
            let mut checked = session.with(conflicts.dilated(target_edge), embedding);
            changes += if has_left_out {
                rounds(mesh, bounds, &mut checked, pauses).await
            } else {
                last_round(mesh, bounds, &mut checked, pauses).await
            };
            return Ok(changes);
        }
        mesh.clone_from(&surface);
        if run == INPUT_TEST_RUN {
            let mut embedding = embedding_of(mesh, mesh.longest_edge());
            embedding.set_limits_pairs(true);
            let intersecting = embedding.intersecting_vertices_in_slices(mesh, pauses).await;
            embedding.check_pairs(mesh)?;
            if !intersecting.is_empty() {
                break;
            }
        }
    }
    let embedding = embedding_of(mesh, bounds.max);
    let mut session = Session::new(&surface, target_edge, vec![true; surface.slots()], embedding);
    Ok(rounds(mesh, bounds, &mut session, pauses).await)
}

fn embedding_of(mesh: &Mesh, edge: f32) -> Embedding {
    let mut embedding = Embedding::default();
    embedding.sync_with_edge(mesh, edge);
    embedding
}

async fn rounds<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    session: &mut Session<'_, E>,
    pauses: &Pauses,
) -> Changes {
    let mut changes = Changes::default();
    let inner = inner_bounds(bounds);
    for round in 0..ROUNDS {
        let edits = restructure_in_slices(mesh, inner, session, pauses).await;
        if round == 0 {
            session.reorder(mesh);
            pauses.now().await;
        }
        let has_moved = sweeps(mesh, bounds, session, pauses).await;
        changes += edits;
        if !has_moved && edits == Changes::default() {
            break;
        }
    }
    changes += last_round(mesh, bounds, session, pauses).await;
    changes
}

/// Relaxes the mesh until no vertex moves, at most [`SWEEPS`] times; returns whether any vertex moved.
async fn sweeps<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    session: &mut Session<'_, E>,
    pauses: &Pauses,
) -> bool {
    for sweep in 0..SWEEPS {
        if relax(mesh, bounds, session, pauses).await == 0 {
            return sweep > 0;
        }
    }
    true
}

/// Brings edges that are still out of the requested bounds within them, and improves angles below 33°; returns the
/// changes made.
async fn last_round<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    session: &mut Session<'_, E>,
    pauses: &Pauses,
) -> Changes {
    let mut changes = restructure_in_slices(mesh, bounds, session, pauses).await;
    changes += improve_angles(mesh, bounds, session, pauses).await;
    changes
}

/// Returns the bounds of edge lengths used in rounds of restructuring, a little narrower than the requested ones, so
/// that moves leave few edges out of bounds.
fn inner_bounds(EdgeBounds { min, max }: EdgeBounds) -> EdgeBounds {
    let margin = (max / min / INNER_RATIO).sqrt();
    let margin = if margin < MAX_NARROWING { margin } else { MAX_NARROWING };
    EdgeBounds { min: min * margin, max: max / margin }
}
