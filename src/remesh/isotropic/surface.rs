//! The nearest point of the surface as it was, found by walking along it.

use crate::math::{DVec3, Vec3, triangle};
use crate::mesh::{Mesh, VertexId};

/// Steps of one walk. A vertex goes less than an edge at a time; this many pass where the surface as it was is a hundred
/// times finer than the bounds, and longer walks would only make hostile meshes slow.
const STEPS: usize = 200;

/// A point inside a triangle that is nearer than this share (squared) of the distance to its corner is taken at once: no
/// other triangle around the corner is much nearer, unless the surface is rough there.
const NEAR: f64 = 0.04;

/// A point of the surface as it was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Where it is.
    pub point: Vec3,
    /// A corner of its triangle.
    pub home: VertexId,
}

/// The nearest point to `p` that is found by going downhill from around `home`: nearest in the same sheet, where a search
/// through space could find another sheet.
pub(super) fn foot(surface: &Mesh, home: VertexId, p: Vec3) -> Foot {
    let mut best = Foot { point: surface.position(home), home };
    let mut least = f64::INFINITY;
    for _ in 0..STEPS {
        let Some((square, found)) = foot_around(surface, best.home, p) else { break };
        if square >= least {
            break;
        }
        let stays = found.home == best.home;
        (least, best) = (square, found);
        if stays {
            break;
        }
    }
    best
}

/// The nearest point of the triangles around `centre`, with its squared distance; its home is its nearest corner.
fn foot_around(surface: &Mesh, centre: VertexId, p: Vec3) -> Option<(f64, Foot)> {
    let near = NEAR * f64::from(surface.position(centre).distance_squared(p));
    let mut best: Option<(f64, [VertexId; 3], DVec3, DVec3)> = None;
    for (a, b) in surface.ring(centre).pairs() {
        let corners = [centre, a, b];
        let points = corners.map(|v| surface.position(v));
        let weights = triangle::closest(points, p);
        let point = triangle::at(points, weights);
        let square = point.distance_squared(p.as_dvec3());
        if best.is_none_or(|(least, ..)| square < least) {
            best = Some((square, corners, weights, point));
            if square < near && weights.cmpgt(DVec3::ZERO).all() {
                break;
            }
        }
    }
    best.map(|(square, corners, weights, point)| {
        (square, Foot { point: point.as_vec3(), home: corners[heaviest(weights)] })
    })
}

fn heaviest(weights: DVec3) -> usize {
    if weights.x >= weights.y && weights.x >= weights.z {
        0
    } else if weights.y >= weights.z {
        1
    } else {
        2
    }
}
