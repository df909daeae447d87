//! Tangential relaxation: each vertex moves along the surface to the centroid of its triangles, then to the closest
//! point on the input surface (Botsch & Kobbelt, *A remeshing approach to multiresolution modeling*, 2004).

use super::one_ring::{Move, OneRing, min_quality, moved};
use super::session::Session;
use crate::mesh::{Mesh, VertexId};
use crate::pauses::Pauses;
use crate::remesh::restructure::{Work, chunks};
use crate::remesh::{EdgeBounds, EditPolicy};
use std::ops::Range;

/// The squared sine of 35°: relaxation may reduce the smallest angle around a vertex if it stays above this.
const GOOD: f32 = 0.329;

/// The shortest displacement that relaxation gives a vertex, as a fraction of the target edge; with a higher value
/// angles stay smaller.
const SHORTEST_STEP: f32 = 0.02;

/// Relaxes each vertex in a region that may be edited: moves it along the surface to the centroid of its triangles, one
/// vertex after the other, unless the step is too short, is rejected by [`moved`] or makes a poor angle poorer. Returns
/// the number of vertices moved. Pauses meanwhile.
pub(super) async fn relax<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    session: &mut Session<'_, E>,
    pauses: &Pauses,
) -> usize {
    let (mut moves, mut work) = (0, Work::new(session, pauses));
    for slots in chunks(mesh.slots()) {
        moves += relax_at(mesh, bounds, session, slots);
        work.count(session).await;
    }
    moves
}

/// Relaxes the vertices in some slots; returns the number of vertices moved.
fn relax_at<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    session: &mut Session<E>,
    slots: Range<usize>,
) -> usize {
    let mut moves = 0;
    let shortest = SHORTEST_STEP * session.target_edge();
    for slot in slots {
        let v = VertexId::from_index(slot);
        if !mesh.is_live(v) || !session.is_free(v) {
            continue;
        }
        let Some(one_ring) = OneRing::of(mesh, v) else { continue };
        let step = one_ring.along(one_ring.to_centroid);
        if step.length_squared() < shortest * shortest {
            continue;
        }
        let closest = session.closest_point(v, mesh.position(v) + step);
        if let Some(Move { least_quality: after, deviation }) = moved(mesh, v, closest.point, bounds, session)
            && (after >= GOOD || after >= min_quality(mesh, v))
        {
            moves += usize::from(session.move_to(mesh, v, closest, deviation));
        }
    }
    moves
}
