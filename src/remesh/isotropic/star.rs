//! The triangles around a vertex: where it wants to go, and how sharp they would be there.

use super::fan::Fan;
use super::session::Session;
use crate::math::{Mat3, Vec3, Vec3Swizzles};
use crate::mesh::{Mesh, VertexId};
use crate::remesh::restructure::faces_alike;
use crate::remesh::{EdgeBounds, Edits};

/// What moving off the surface costs beside moving along it. With more, sharp edges are worn off; with less, vertices on
/// curved parts hardly move.
const SLACK: f32 = 0.04;

/// The triangles around a vertex in sums.
pub(super) struct Star {
    /// From the vertex to the centroid of the triangles.
    pub to_centroid: Vec3,
    /// Takes out of a way what leads off the planes of the triangles: leaves ways in a plane, along a sharp edge, and at a
    /// corner none.
    along: Mat3,
}

impl Star {
    /// That of `v`; `None` where it has no area.
    pub fn of(mesh: &Mesh, v: VertexId) -> Option<Self> {
        let p = mesh.position(v);
        let (mut area, mut sum) = (0.0, Vec3::ZERO);
        // Of n nᵀ / |n|, summed: what is on the diagonal, and yz, zx, xy.
        let (mut diagonal, mut beside) = (Vec3::ZERO, Vec3::ZERO);
        for (a, b) in mesh.ring(v).pairs() {
            let (a, b) = (mesh.position(a) - p, mesh.position(b) - p);
            let normal = a.cross(b);
            let size = normal.length();
            if size > 0.0 {
                area += size;
                sum += (a + b) * size;
                let share = normal / size;
                diagonal += normal * share;
                beside += normal.yzx() * share.zxy();
            }
        }
        if area <= 0.0 || !area.is_finite() {
            return None;
        }
        let stiffness = 1.0 / (SLACK * area);
        let (Vec3 { x, y, z }, d) = (beside * stiffness, diagonal * stiffness + Vec3::ONE);
        let stiff = Mat3::from_cols(Vec3::new(d.x, z, y), Vec3::new(z, d.y, x), Vec3::new(y, x, d.z));
        Some(Self { to_centroid: sum / (3.0 * area), along: stiff.inverse() })
    }

    /// What is left of a way along the surface.
    pub fn along(&self, way: Vec3) -> Vec3 {
        self.along * (self.along * way)
    }
}

/// The squared sine of the smallest angle of a triangle that is not obtuse there; 0 without area.
pub(super) fn sharpness(corners: [Vec3; 3]) -> f32 {
    let [part, whole] = sharpness_parts(corners);
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// Whether a triangle has area and its [`sharpness`] is more than that.
pub(super) fn is_blunter(corners: [Vec3; 3], sharpness: f32) -> bool {
    let [part, whole] = sharpness_parts(corners);
    part > sharpness * whole
}

/// [`sharpness`] as a fraction.
#[inline]
fn sharpness_parts([a, b, c]: [Vec3; 3]) -> [f32; 2] {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let (x, y, z) = (ab.length_squared(), bc.length_squared(), ca.length_squared());
    // Twice the area over the two longer sides.
    let least = if x < y {
        if x < z { x } else { z }
    } else if y < z {
        y
    } else {
        z
    };
    [ab.cross(ca).length_squared() * least, x * y * z]
}

/// What a move would make of the triangles around a vertex.
pub(super) struct Move {
    /// The least of [`sharpness`] then.
    pub sharpest: f32,
    /// How far the surface would have moved here, all in all.
    pub lost: f32,
}

/// What comes of `v` at `place`; `None` where a triangle turned over, an edge left its bounds, or too much of the shape
/// were lost.
pub(super) fn moved<E: Edits>(
    mesh: &Mesh,
    v: VertexId,
    place: Vec3,
    bounds: EdgeBounds,
    session: &Session<E>,
) -> Option<Move> {
    let p = mesh.position(v);
    let [shortest, longest] = [bounds.min * bounds.min, bounds.max * bounds.max];
    let mut sharpest = 1.0;
    let mut fan = Fan::new(p, place);
    for (u, w) in mesh.ring(v).pairs() {
        let (a, b) = (mesh.position(u), mesh.position(w));
        let new = place.distance_squared(a);
        if (new < shortest || new > longest) && leaves(new, p.distance_squared(a), shortest) {
            return None;
        }
        let (before, after) = ((a - p).cross(b - p), fan.push(a, b));
        if !faces_alike(before, after)
            || !session.looks_out([v, u, w], after) && session.looks_out([v, u, w], before)
        {
            return None;
        }
        let here = sharpness([place, a, b]);
        sharpest = if here < sharpest { here } else { sharpest };
    }
    Some(Move { sharpest, lost: session.after_losing(v, fan.gap())? })
}

/// Whether an edge that is out of bounds was nearer to them before; all squared.
fn leaves(new: f32, old: f32, shortest: f32) -> bool {
    if new < shortest { new < old } else { new > old }
}

/// The least of [`sharpness`] around `v`.
pub(super) fn sharpest(mesh: &Mesh, v: VertexId) -> f32 {
    let p = mesh.position(v);
    let of = |(a, b)| sharpness([p, mesh.position(a), mesh.position(b)]);
    mesh.ring(v).pairs().map(of).fold(1.0, |least, here| if here < least { here } else { least })
}
