//! The part of space a surface may be in. Without it a force that points outwards would grow it for ever.

use crate::math::{Bounds, Vec3};

/// How much longer than the enclosing start shape the domain is.
const ROOM: f32 = 1.5;

/// 3^(1/4): the rounded box |x/a|⁴ + |y/b|⁴ + |z/c|⁴ = 1 through the corners of a box is this much longer than it.
const THROUGH_CORNERS: f32 = 1.316_074;

/// The longest axis of the enclosing start shape in its shortest. Around flatter images it leaves more room: the flatter
/// it is, the more its triangles are squashed before they can be resolved; at 33 some of them crossed.
const MOST_ELONGATED: f32 = 6.0;

/// The most vertices of any surface: about 200 bytes each, several copies on the way, and wasm32 has 4 GiB.
const MOST_VERTICES: f64 = 4e6;

/// A box around the image, in the space of the model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Domain {
    pub(super) centre: Vec3,
    /// Half axes of the rounded box that the enclosing start shape is.
    pub(super) axes: Vec3,
    pub(super) bounds: Bounds,
}

/// The half axes of a rounded box that is neither too small for a mesh with the invariant `delta` nor too flat, at least
/// `around`.
pub(super) fn rounded_axes(around: Vec3, delta: f32) -> Vec3 {
    let least = (4.0 * delta).max(around.max_element() / MOST_ELONGATED);
    around.max(Vec3::splat(least))
}

impl Domain {
    /// For an image of `dims` voxels and a surface that starts with the invariant `delta`.
    pub(super) fn new(dims: [usize; 3], delta: f32) -> Self {
        let centre = Vec3::from(dims.map(|n| 0.5 * (n as f32 - 1.0)));
        let axes = rounded_axes(Vec3::from(dims.map(|n| THROUGH_CORNERS * 0.5 * (n as f32 + 1.0))), delta);
        Self { centre, axes, bounds: Bounds { min: centre - axes * ROOM, max: centre + axes * ROOM } }
    }

    /// About the number of vertices of the enclosing start shape: one for 2 δ² of a box of its axes.
    pub(super) fn enclosing_vertices(&self, delta: f32) -> usize {
        let [a, b, c] = (self.axes / delta).as_dvec3().to_array();
        (4.0 * (a * b + b * c + c * a)) as usize
    }

    /// The nearest point of the domain.
    pub(super) fn hold(&self, p: Vec3) -> Vec3 {
        p.clamp(self.bounds.min, self.bounds.max)
    }

    /// The most vertices that a surface with no contact unresolved can have here: one in each cube of side δ.
    pub(super) fn most_vertices(&self, delta: f32) -> usize {
        let cubes = ((self.bounds.max - self.bounds.min) / delta).as_dvec3().element_product();
        if cubes < MOST_VERTICES { cubes as usize } else { MOST_VERTICES as usize }
    }
}
