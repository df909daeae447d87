//! Triangles alike: edges into bounds, valences towards six, and the shape kept.
//!
//! Rounds of [`restructure`](super::restructure) with vertices spaced evenly along the surface in between and put back
//! onto the surface as it was (Botsch & Kobbelt, *A remeshing approach to multiresolution modeling*, 2004), and at the
//! end the sharpest corners one by one (`sharpen`).
//!
//! Guarantees: closed, oriented and manifold stays so, with the same components and χ; a surface that did not cross
//! itself does not afterwards. Aimed at, not guaranteed: all edges in bounds (upper bounds nearly always are; lower ones
//! give way where the shape, the topology or another sheet is in the way), no angle below 33°, and the surface within
//! half an edge of what it was.
//!
//! Edits are made without a look at what they might cross, as that takes most of the time and hardly anything ever does;
//! then one look is taken at all of it. Where something crosses, those places are left as they were in a second run from
//! the start (`danger`), and then remeshed with edits that look.

mod danger;
mod fan;
mod relax;
mod session;
mod sharpen;
mod star;
mod surface;

use super::restructure::{MOST_VERTICES, bytes, collapse_short, flip_for_valence, split_long};
use super::{Changes, EdgeBounds, Edits, Embedding, Trusting};
use crate::mesh::{Mesh, MeshError};
use danger::Danger;
use relax::relax;
use session::Session;
use sharpen::blunt;

/// Rounds of restructuring, and how often vertices are spaced in each. With one fewer of either there are twice as many
/// sharp corners left for the end; more cost more than they save.
const ROUNDS: usize = 5;
const SWEEPS: usize = 2;

/// The ratio of the bounds that rounds work with, as of Botsch & Kobbelt: triangles of such edges have no angle below 33°.
/// With less, halves of long edges are short; but no further inside than this, or wide bounds would not be made use of.
const INNER_RATIO: f32 = 5.0 / 3.0;
const MOST_INSIDE: f32 = 1.2;

/// Runs with edits that do not look. Mostly the second one is free of crossings; after so many, all edits look.
const TRUSTING_RUNS: usize = 4;

/// Brings the lengths of edges into bounds and the valences of vertices towards six, and keeps the shape, its components
/// and their χ; returns what was done. Ids then mean nothing any more, as the vertices are numbered anew.
///
/// The edges become about √(min max) long, and vertices lie on the surface as it was. A surface that does not cross
/// itself never does afterwards. One that does is taken, too: it crosses itself nowhere else then, but where it does,
/// edges may stay out of bounds. Attributes of a vertex are blended where edges are drawn together or split; moves do not
/// change them.
///
/// # Errors
/// [`MeshError::InvalidArgument`] unless both bounds are finite, `min` is above 0 and `max` more than twice as much;
/// [`MeshError::TooLarge`] where more than eight million vertices would be needed. The mesh is then as it was.
pub fn remesh(mesh: &mut Mesh, bounds: EdgeBounds) -> Result<Changes, MeshError> {
    bounds.check_for(mesh)?;
    let before = mesh.clone();
    // To edges of about 1, whose squares are in range whatever the units; a power of two, so that nothing is rounded.
    let (_, exponent) = libm::frexpf(bounds.max);
    let exponent = exponent.clamp(-EXPONENTS, EXPONENTS);
    let [shrink, grow] = [-exponent, exponent].map(|power| libm::ldexpf(1.0, power));
    mesh.positions_mut().iter_mut().for_each(|p| *p *= shrink);
    let changes = in_bounds(mesh, bounds.scaled(shrink));
    if mesh.vertex_count() >= MOST_VERTICES {
        mesh.clone_from(&before);
        return Err(MeshError::TooLarge { bytes: bytes(MOST_VERTICES as f64) });
    }
    mesh.reorder();
    mesh.positions_mut().iter_mut().for_each(|p| *p *= grow);
    Ok(changes)
}

/// Powers of two by which lengths can be multiplied and divided without leaving the range.
const EXPONENTS: i32 = 120;

/// First without a look, then with one where that is needed.
fn in_bounds(mesh: &mut Mesh, bounds: EdgeBounds) -> Changes {
    let surface = mesh.clone();
    let aim = (bounds.min * bounds.max).sqrt();
    let mut danger = Danger::new(&surface);
    for run in 0..TRUSTING_RUNS {
        let mut session = Session::new(&surface, aim, danger.elsewhere(), Trusting);
        let mut changes = rounds(mesh, bounds, &mut session);
        let mut embedding = followed(mesh, bounds);
        if embedding.is_embedded(mesh) {
            if !danger.is_nowhere() {
                changes += rounds(mesh, bounds, &mut session.with(danger.and_around(aim), embedding));
            }
            return changes;
        }
        danger.add_crossings(mesh, aim, |v| session.home(v));
        mesh.clone_from(&surface);
        if run == 0 && !followed(mesh, bounds).is_embedded(mesh) {
            break;
        }
    }
    let embedding = followed(mesh, bounds);
    rounds(mesh, bounds, &mut Session::new(&surface, aim, vec![true; surface.slots()], embedding))
}

fn followed(mesh: &Mesh, bounds: EdgeBounds) -> Embedding {
    let mut embedding = Embedding::default();
    embedding.follow_with(mesh, bounds.max);
    embedding
}

fn rounds<E: Edits>(mesh: &mut Mesh, bounds: EdgeBounds, session: &mut Session<E>) -> Changes {
    let mut changes = Changes::default();
    let inner = inside(bounds);
    for round in 0..ROUNDS {
        let edits = pass(mesh, inner, session);
        if round == 0 {
            session.reorder(mesh);
        }
        let has_moved = (0..SWEEPS).take_while(|_| relax(mesh, bounds, session) > 0).count() > 0;
        changes += edits;
        if !has_moved && edits == Changes::default() {
            break;
        }
    }
    changes += pass(mesh, bounds, session);
    changes += blunt(mesh, bounds, session);
    changes
}

/// As [`restructure`](super::restructure), for so many vertices at the most.
fn pass<E: Edits>(mesh: &mut Mesh, bounds: EdgeBounds, session: &mut Session<E>) -> Changes {
    let mut changes = collapse_short(mesh, bounds, session);
    changes += split_long(mesh, bounds, MOST_VERTICES, session);
    changes += flip_for_valence(mesh, bounds, session);
    changes
}

/// The bounds that rounds work with, a little within those asked for: moves then leave few edges out of them.
fn inside(EdgeBounds { min, max }: EdgeBounds) -> EdgeBounds {
    let margin = (max / min / INNER_RATIO).sqrt();
    let margin = if margin < MOST_INSIDE { margin } else { MOST_INSIDE };
    EdgeBounds { min: min * margin, max: max / margin }
}
