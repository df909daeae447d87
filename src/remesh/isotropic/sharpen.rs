//! The sharpest corners made blunter, one at a time: by a flip, a move, or a collapse.

use super::session::Session;
use super::star::{Move, Star, moved, sharpest, sharpness};
use crate::math::Vec3;
use crate::mesh::{Mesh, Opposite, VertexId};
use crate::remesh::restructure::{LEAST_VALENCE, may_collapse, may_flip};
use crate::remesh::{Changes, EdgeBounds, Edits};

/// The squared sine of 33°: triangles with a smaller angle are looked at.
const SHARP: f32 = 0.2966;

/// Times that all sharp triangles are looked at; most of what can be done is done in three.
const ROUNDS: usize = 6;

/// Ways tried, in the aim, from the longest; and how often a vertex may go on.
const STEPS: [f32; 3] = [0.2, 0.1, 0.05];
const MOVES: usize = 4;

/// A vertex gets no more neighbours by a flip: with eleven, one angle has to be below 33°.
const MOST_VALENCE: usize = 10;

/// Makes sharp corners blunter where edges stay in bounds or get nearer to them.
pub(super) fn blunt<E: Edits>(mesh: &mut Mesh, bounds: EdgeBounds, session: &mut Session<E>) -> Changes {
    let mut changes = Changes::default();
    for _ in 0..ROUNDS {
        let sharp: Vec<VertexId> =
            mesh.vertices().filter(|&v| session.is_free(v) && sharpest(mesh, v) < SHARP).collect();
        if sharp.is_empty() {
            break;
        }
        for v in sharp {
            if mesh.is_live(v) && sharpest(mesh, v) < SHARP {
                changes += blunt_at(mesh, bounds, v, session);
            }
        }
    }
    changes
}

fn blunt_at<E: Edits>(mesh: &mut Mesh, bounds: EdgeBounds, v: VertexId, session: &mut Session<E>) -> Changes {
    let mut changes = Changes::default();
    let ring = mesh.ring(v).clone();
    for &w in ring.as_slice() {
        changes.inversions += u32::from(flip(mesh, bounds, [v, w], session));
    }
    for &w in ring.as_slice() {
        if sharpest(mesh, v) >= SHARP {
            return changes;
        }
        if collapse(mesh, bounds, w, v, session) {
            changes.deletions += 1;
            return changes;
        }
    }
    shift(mesh, bounds, v, session);
    changes
}

/// Flips an edge where the smallest angle of its two triangles grows.
fn flip<E: Edits>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    [u, v]: [VertexId; 2],
    session: &mut Session<E>,
) -> bool {
    let Ok(Opposite { left, right }) = mesh.opposite(u, v) else { return false };
    let [p, q, a, b] = [u, v, left, right].map(|w| mesh.position(w));
    let lesser = |s: f32, t: f32| if s < t { s } else { t };
    let now = lesser(sharpness([p, q, a]), sharpness([q, p, b]));
    let then = lesser(sharpness([p, b, a]), sharpness([q, a, b]));
    let valence = |w: VertexId| mesh.ring(w).valence();
    let fits = [u, v].iter().all(|&w| valence(w) > LEAST_VALENCE)
        && [left, right].iter().all(|&w| valence(w) < MOST_VALENCE);
    now < SHARP
        && then > now
        && fits
        && may_flip(mesh, bounds, [u, v], [left, right])
        && session.may_flip(mesh, [u, v], [left, right])
        && session.attempt(mesh, |mesh| mesh.flip(u, v)).is_ok()
}

/// Draws `gone` into `kept` where the smallest angle around it grows.
fn collapse<E: Edits>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    kept: VertexId,
    gone: VertexId,
    session: &mut Session<E>,
) -> bool {
    let place = mesh.position(kept);
    let others = mesh.ring(gone).pairs().filter(|&(a, b)| a != kept && b != kept);
    let then =
        others.map(|(a, b)| sharpness([place, mesh.position(a), mesh.position(b)])).fold(1.0, f32::min);
    let done = then > sharpest(mesh, gone)
        && may_collapse(mesh, bounds, kept, gone)
        && session.may_collapse(mesh, kept, gone)
        && session.attempt(mesh, |mesh| mesh.collapse(kept, gone, place)).is_ok();
    if done {
        session.collapsed(kept);
    }
    done
}

/// Moves `v` along the surface to where the smallest angle around it is larger.
fn shift<E: Edits>(mesh: &mut Mesh, bounds: EdgeBounds, v: VertexId, session: &mut Session<E>) {
    let mut step = 0;
    for _ in 0..MOVES {
        let Some(star) = Star::of(mesh, v) else { return };
        while step < STEPS.len() {
            let reach = STEPS[step] * session.aim();
            if best_way(mesh, bounds, v, &star, reach, session) {
                break;
            }
            step += 1;
        }
    }
}

/// Takes the best of the ways of one length, if it is better than none.
fn best_way<E: Edits>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    v: VertexId,
    star: &Star,
    reach: f32,
    session: &mut Session<E>,
) -> bool {
    let p = mesh.position(v);
    let mut best = None;
    let mut most = sharpest(mesh, v);
    let ring = mesh.ring(v).as_slice();
    let towards = ring.iter().map(|&w| mesh.position(w) - p).flat_map(|way| [way, -way]);
    for way in towards {
        let along = star.along(way.normalize_or(Vec3::ZERO) * reach);
        let foot = session.foot(v, p + along);
        if let Some(Move { sharpest: after, lost }) = moved(mesh, v, foot.point, bounds, session)
            && after > most
        {
            (best, most) = (Some((foot, lost)), after);
        }
    }
    best.is_some_and(|(foot, lost)| session.place(mesh, v, foot, lost))
}
