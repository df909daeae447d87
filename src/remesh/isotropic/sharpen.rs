//! The sharpest corners made blunter, one at a time: by a flip, a move, or a collapse.

use super::session::Session;
use super::star::{Move, Star, is_blunter, moved, sharpest, sharpness};
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
    // What was tried in vain is tried again only where something has changed around it.
    let mut changed = vec![true; mesh.slots()];
    for _ in 0..ROUNDS {
        let may_be_blunted = |&v: &VertexId| session.is_free(v) && is_sharp(mesh, v);
        let sharp: Vec<VertexId> =
            mesh.vertices().filter(|v| changed[v.index()]).filter(may_be_blunted).collect();
        if sharp.is_empty() {
            break;
        }
        changed.fill(false);
        for v in sharp {
            if mesh.is_live(v) && is_sharp(mesh, v) {
                let (ring, place) = (mesh.ring(v).clone(), mesh.position(v));
                let here = blunt_at(mesh, bounds, v, ring.as_slice(), session);
                if here != Changes::default() || mesh.position(v) != place {
                    ring.as_slice().iter().chain([&v]).for_each(|w| changed[w.index()] = true);
                }
                changes += here;
            }
        }
    }
    changes
}

/// `ring` are its neighbours before.
fn blunt_at<E: Edits>(
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
    let now = sharpest(mesh, v);
    if now >= SHARP {
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
    if now >= SHARP {
        return false;
    }
    let then = lesser(sharpness([p, b, a]), sharpness([q, a, b]));
    let valence = |w: VertexId| mesh.ring(w).valence();
    let fits = [u, v].iter().all(|&w| valence(w) > LEAST_VALENCE)
        && [left, right].iter().all(|&w| valence(w) < MOST_VALENCE);
    then > now
        && fits
        && may_flip(mesh, bounds, [u, v], [left, right])
        && session.may_flip(mesh, [u, v], [left, right])
        && session.attempt(mesh, |mesh| mesh.flip(u, v)).is_ok()
}

/// Draws `gone` into `kept` where the smallest angle around it grows from what it is `now`.
fn collapse<E: Edits>(
    mesh: &mut Mesh,
    bounds: EdgeBounds,
    [kept, gone]: [VertexId; 2],
    now: f32,
    session: &mut Session<E>,
) -> bool {
    let place = mesh.position(kept);
    let others = |(a, b): &(VertexId, VertexId)| *a != kept && *b != kept;
    let done = all_blunter(mesh, mesh.ring(gone).pairs().filter(others), place, now)
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
        let place = p + star.along(way.normalize_or(Vec3::ZERO) * reach);
        // The foot is near, and it is no better there than here, most of the time.
        if !all_blunter(mesh, mesh.ring(v).pairs(), place, most) {
            continue;
        }
        let foot = session.foot(v, place);
        if let Some(Move { sharpest: after, lost }) = moved(mesh, v, foot.point, bounds, session)
            && after > most
        {
            (best, most) = (Some((foot, lost)), after);
        }
    }
    best.is_some_and(|(foot, lost)| session.place(mesh, v, foot, lost))
}

fn is_sharp(mesh: &Mesh, v: VertexId) -> bool {
    !all_blunter(mesh, mesh.ring(v).pairs(), mesh.position(v), SHARP)
}

/// Whether all triangles with a corner at `place` and these others are blunter than `now`.
fn all_blunter(
    mesh: &Mesh,
    mut others: impl Iterator<Item = (VertexId, VertexId)>,
    place: Vec3,
    now: f32,
) -> bool {
    others.all(|(a, b)| is_blunter([place, mesh.position(a), mesh.position(b)], now))
}
