//! Vertices spaced evenly: each goes along the surface to the middle of its triangles, and back onto the surface as it
//! was (Botsch & Kobbelt, *A remeshing approach to multiresolution modeling*, 2004).

use super::session::Session;
use super::star::{Move, Star, moved, sharpest};
use crate::mesh::{Mesh, VertexId};
use crate::remesh::{EdgeBounds, Edits};

/// The squared sine of 35°. Moves may make angles smaller as long as they stay above it.
const FINE: f32 = 0.329;

/// Shorter ways, in the aim, are not worth the search. With more, angles stay sharper.
const STILL: f32 = 0.02;

/// Moves every vertex once, one after the other; returns how many went.
pub(super) fn relax<E: Edits>(mesh: &mut Mesh, bounds: EdgeBounds, session: &mut Session<E>) -> usize {
    let mut moves = 0;
    let still = STILL * session.aim();
    for slot in 0..mesh.slots() {
        let v = VertexId::from_index(slot);
        if !mesh.is_live(v) || !session.is_free(v) {
            continue;
        }
        let Some(star) = Star::of(mesh, v) else { continue };
        let way = star.along(star.to_centroid);
        if way.length_squared() < still * still {
            continue;
        }
        let foot = session.foot(v, mesh.position(v) + way);
        if let Some(Move { sharpest: after, lost }) = moved(mesh, v, foot.point, bounds, session)
            && (after >= FINE || after >= sharpest(mesh, v))
        {
            moves += usize::from(session.place(mesh, v, foot, lost));
        }
    }
    moves
}
