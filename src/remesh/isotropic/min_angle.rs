//! Minimum-angle optimisation: increases the smallest angles one by one, by a flip, a collapse or a move.

use super::one_ring::{Move, OneRing, angle_quality, has_better_angle, min_quality, moved};
use super::session::Session;
use crate::math::Vec3;
use crate::mesh::{Mesh, OppositeVertices, VertexId};
use crate::pauses::Pauses;
use crate::remesh::restructure::{MIN_VALENCE, Work, may_collapse, may_flip};
use crate::remesh::{Changes, EdgeBounds, EditPolicy};

/// The squared sine of 33°: triangles with a smaller angle are improved.
const POOR: f32 = 0.2966;

/// The largest number of passes over all vertices with an angle below 33°; most improvements are made in three.
const ROUNDS: usize = 6;

/// Lengths of the steps by which a vertex is moved, tried in turn, as fractions of the target edge.
const STEPS: [f32; 3] = [0.2, 0.1, 0.05];
/// The largest number of steps by which a vertex is moved in one attempt to improve its angles.
const MOVES: usize = 4;

/// The highest valence after a flip: with eleven neighbours one angle must be below 33°.
const MAX_VALENCE: usize = 10;

/// The highest valence of a vertex that is collapsed or moved: with more neighbours its angles are small wherever it is, and
/// each attempt visits all of them for each of them.
const MOST_NEIGHBOURS: usize = 64;

/// Improves triangle angles below 33° by flips, collapses and moves that keep edge lengths within bounds or bring them
/// nearer to them; returns the numbers of edits. Pauses meanwhile.
pub(super) async fn improve_angles<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    session: &mut Session<'_, E>,
    pauses: &Pauses,
) -> Changes {
    let (mut changes, mut work) = (Changes::default(), Work::new(session, pauses));
    // Failed attempts are repeated only around vertices where something has changed.
    let mut changed = vec![true; mesh.slots()];
    for _ in 0..ROUNDS {
        let may_be_improved = |&v: &VertexId| session.is_free(v) && is_poor(mesh, v);
        let poor: Vec<VertexId> =
            mesh.vertices().filter(|v| changed[v.index()]).filter(may_be_improved).collect();
        if poor.is_empty() {
            break;
        }
        changed.fill(false);
        for v in poor {
            if mesh.is_live(v) && is_poor(mesh, v) {
                let (ring, position) = (mesh.ring(v).clone(), mesh.position(v));
                let here = improve_around(mesh, bounds, v, ring.as_slice(), session);
                if here != Changes::default() || mesh.position(v) != position {
                    ring.as_slice().iter().chain([&v]).for_each(|w| changed[w.index()] = true);
                }
                changes += here;
                work.count(session).await;
            }
        }
    }
    changes
}

/// Tries to improve the angles at `v` below 33°: by flips, then by a collapse of `v`, then by moves of it, if it has at most
/// [`MOST_NEIGHBOURS`]; `ring` contains its neighbours before the edits. Returns the numbers of edits; moves are not counted.
fn improve_around<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    v: VertexId,
    ring: &[VertexId],
    session: &mut Session<E>,
) -> Changes {
    let mut changes = Changes::default();
    for &w in ring {
        changes.inversions += u32::from(flip(mesh, bounds, [v, w], session));
    }
    let now = min_quality(mesh, v);
    if now >= POOR || mesh.ring(v).valence() > MOST_NEIGHBOURS {
        return changes;
    }
    for &w in ring {
        if collapse(mesh, bounds, [w, v], now, session) {
            changes.deletions += 1;
            return changes;
        }
    }
    shift(mesh, bounds, v, session);
    changes
}

/// Flips the edge `uv` if the smallest angle of its two triangles is below 33° and increases, and the flip is allowed;
/// returns whether it was flipped.
fn flip<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    [u, v]: [VertexId; 2],
    session: &mut Session<E>,
) -> bool {
    let Ok(OppositeVertices { left, right }) = mesh.opposite_vertices(u, v) else { return false };
    let [p, q, a, b] = [u, v, left, right].map(|w| mesh.position(w));
    let lesser = |s: f32, t: f32| if s < t { s } else { t };
    let now = lesser(angle_quality([p, q, a]), angle_quality([q, p, b]));
    if now >= POOR {
        return false;
    }
    let then = lesser(angle_quality([p, b, a]), angle_quality([q, a, b]));
    let valence = |w: VertexId| mesh.ring(w).valence();
    let fits = [u, v].iter().all(|&w| valence(w) > MIN_VALENCE)
        && [left, right].iter().all(|&w| valence(w) < MAX_VALENCE);
    then > now
        && fits
        && may_flip(mesh, bounds, [u, v], [left, right])
        && session.may_flip(mesh, [u, v], [left, right])
        && session.attempt(mesh, |mesh| mesh.flip(u, v)).is_ok()
}

/// Collapses `removed` into `kept` if that is allowed and gives all remaining triangles of `removed` a better
/// [`angle_quality`] than `now`, the lowest around `removed`; returns whether it was collapsed.
fn collapse<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    [kept, removed]: [VertexId; 2],
    now: f32,
    session: &mut Session<E>,
) -> bool {
    let position = mesh.position(kept);
    let others = |(a, b): &(VertexId, VertexId)| *a != kept && *b != kept;
    let done = all_better(mesh, mesh.ring(removed).pairs().filter(others), position, now)
        && may_collapse(mesh, bounds, kept, removed)
        && session.may_collapse(mesh, kept, removed)
        && session.attempt(mesh, |mesh| mesh.collapse(kept, removed, position)).is_ok();
    if done {
        session.collapsed(kept);
    }
    done
}

/// Moves `v` along the surface in up to four steps, each of which increases the smallest angle around it.
fn shift<E: EditPolicy>(mesh: &mut Mesh, bounds: EdgeBounds, v: VertexId, session: &mut Session<E>) {
    let mut step = 0;
    for _ in 0..MOVES {
        let Some(one_ring) = OneRing::of(mesh, v) else { return };
        while step < STEPS.len() {
            let reach = STEPS[step] * session.target_edge();
            if best_step(mesh, bounds, v, &one_ring, reach, session) {
                break;
            }
            step += 1;
        }
    }
}

/// Moves `v` by the best step of length `reach` parallel to one of its edges, then to the closest point on the input
/// surface, if that increases the smallest angle around it; returns whether it moved.
fn best_step<E: EditPolicy>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    v: VertexId,
    one_ring: &OneRing,
    reach: f32,
    session: &mut Session<E>,
) -> bool {
    let p = mesh.position(v);
    let mut best = None;
    let mut most = min_quality(mesh, v);
    let ring = mesh.ring(v).as_slice();
    let towards = ring.iter().map(|&w| mesh.position(w) - p).flat_map(|direction| [direction, -direction]);
    for direction in towards {
        let position = p + one_ring.along(direction.normalize_or(Vec3::ZERO) * reach);
        // The closest point is near `position`, so most steps can be rejected without computing it.
        if !all_better(mesh, mesh.ring(v).pairs(), position, most) {
            continue;
        }
        let closest = session.closest_point(v, position);
        if let Some(Move { least_quality: after, deviation }) = moved(mesh, v, closest.point, bounds, session)
            && after > most
        {
            (best, most) = (Some((closest, deviation)), after);
        }
    }
    best.is_some_and(|(closest, deviation)| session.move_to(mesh, v, closest, deviation))
}

fn is_poor(mesh: &Mesh, v: VertexId) -> bool {
    !all_better(mesh, mesh.ring(v).pairs(), mesh.position(v), POOR)
}

/// Returns whether all triangles formed by `position` and the given vertex pairs have a better [`angle_quality`] than
/// `now`.
fn all_better(
    mesh: &Mesh,
    mut others: impl Iterator<Item = (VertexId, VertexId)>,
    position: Vec3,
    now: f32,
) -> bool {
    others.all(|(a, b)| has_better_angle([position, mesh.position(a), mesh.position(b)], now))
}
