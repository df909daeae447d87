//! The one-ring of a vertex: its centroid, and the quality of its triangles after a move.

use super::fan::Fan;
use super::session::Session;
use crate::math::{Mat3, Vec3, Vec3Swizzles};
use crate::mesh::{Mesh, VertexId};
use crate::remesh::restructure::faces_alike;
use crate::remesh::{EdgeBounds, EditPolicy};

/// The weight of missing the wanted displacement, relative to leaving the planes of the triangles, when a displacement
/// is made tangential. Higher values wear off sharp edges; with lower ones, vertices on curved regions hardly move.
const SLACK: f32 = 0.04;

/// The one-ring of a vertex as needed for moves along the surface: its centroid and a tangential projection.
pub(super) struct OneRing {
    /// The vector from the vertex to the area-weighted centroid of its triangles.
    pub to_centroid: Vec3,
    /// The matrix that, applied twice, reduces a displacement to its tangential part: onto the plane of a flat
    /// one-ring, onto the line of a sharp edge, and to nearly 0 at a corner.
    along: Mat3,
}

impl OneRing {
    /// Computes centroid and tangential projection of the one-ring of `v`; `None` if it has no area.
    pub fn of(mesh: &Mesh, v: VertexId) -> Option<Self> {
        let p = mesh.position(v);
        let (mut area, mut sum) = (0.0, Vec3::ZERO);
        // The sum of n nᵀ / |n|: its diagonal, and its entries yz, zx, xy.
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

    /// Returns approximately the component of a displacement of the vertex that is tangential to the surface.
    pub fn along(&self, displacement: Vec3) -> Vec3 {
        self.along * (self.along * displacement)
    }
}

/// Returns the squared sine of the smallest angle of a triangle, the quality that minimum-angle optimisation increases;
/// 0 if it has no area.
pub(super) fn angle_quality(corners: [Vec3; 3]) -> f32 {
    let [part, whole] = angle_quality_fraction(corners);
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// Returns whether a triangle has nonzero area and a higher [`angle_quality`] than the given one.
pub(super) fn has_better_angle(corners: [Vec3; 3], angle_quality: f32) -> bool {
    let [part, whole] = angle_quality_fraction(corners);
    part > angle_quality * whole
}

/// Returns [`angle_quality`] as numerator and denominator.
#[inline]
fn angle_quality_fraction([a, b, c]: [Vec3; 3]) -> [f32; 2] {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let (x, y, z) = (ab.length_squared(), bc.length_squared(), ca.length_squared());
    // The sine is twice the area over the product of the two longer sides.
    let least = if x < y {
        if x < z { x } else { z }
    } else if y < z {
        y
    } else {
        z
    };
    [ab.cross(ca).length_squared() * least, x * y * z]
}

/// The result of moving a vertex without making the move, as computed by [`moved`].
pub(super) struct Move {
    /// The lowest [`angle_quality`] of the triangles around the moved vertex.
    pub least_quality: f32,
    /// The deviation of the moved vertex from the input surface, accumulated over all moves.
    pub deviation: f32,
}

/// Returns the angles and the deviation that a move of `v` to `position` would give, without moving it; `None` if a
/// triangle would turn by 78° or more, or face inwards as it did not before, an edge leave its bounds or get further
/// out of them, or the surface deviate too far from the input.
pub(super) fn moved<E: EditPolicy>(
    mesh: &Mesh,
    v: VertexId,
    position: Vec3,
    bounds: EdgeBounds,
    session: &Session<E>,
) -> Option<Move> {
    let p = mesh.position(v);
    let [shortest, longest] = [bounds.min * bounds.min, bounds.max * bounds.max];
    let mut least_quality = 1.0;
    let mut fan = Fan::new(p, position);
    for (u, w) in mesh.ring(v).pairs() {
        let (a, b) = (mesh.position(u), mesh.position(w));
        let new = position.distance_squared(a);
        if (new < shortest || new > longest) && leaves(new, p.distance_squared(a), shortest) {
            return None;
        }
        let (before, after) = ((a - p).cross(b - p), fan.push(a, b));
        if !faces_alike(before, after)
            || !session.faces_outwards([v, u, w], after) && session.faces_outwards([v, u, w], before)
        {
            return None;
        }
        let here = angle_quality([position, a, b]);
        least_quality = if here < least_quality { here } else { least_quality };
    }
    Some(Move { least_quality, deviation: session.deviation_after(v, fan.gap())? })
}

/// Returns whether an edge whose length `new` is out of bounds was within them or nearer to them at its length `old`;
/// lengths are squared, `shortest` is the lower bound.
fn leaves(new: f32, old: f32, shortest: f32) -> bool {
    if new < shortest { new < old } else { new > old }
}

/// Returns the lowest [`angle_quality`] of the triangles around `v`.
pub(super) fn min_quality(mesh: &Mesh, v: VertexId) -> f32 {
    let p = mesh.position(v);
    let of = |(a, b)| angle_quality([p, mesh.position(a), mesh.position(b)]);
    mesh.ring(v).pairs().map(of).fold(1.0, |least, here| if here < least { here } else { least })
}
