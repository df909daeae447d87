//! The region in which a surface may move, a box around the image. Without it a force that points outwards would
//! inflate the surface for ever.

use crate::math::{Bounds, Vec3};

/// The size of the domain, the box in which vertices must stay, as a multiple of the rounded box around the whole
/// image.
const DOMAIN_SCALE: f32 = 1.5;

/// 3^(1/4), the ratio of the half axes of the rounded box |x/a|⁴ + |y/b|⁴ + |z/c|⁴ = 1 to the half sides of a box
/// through whose corners it passes; with it, a rounded box encloses the whole image.
const THROUGH_CORNERS: f32 = 1.316_074;

/// The largest ratio of the longest to the shortest half axis of the enclosing start surface; around flatter images and
/// objects the short axes are lengthened. The flatter the surface, the more its triangles are squashed before edits
/// repair them; at 33 some of them intersected.
const MAX_ELONGATION: f32 = 6.0;

/// The largest number of vertices of the surface of a deformable model, whatever its image. A vertex takes about 200
/// bytes, meshes are copied several times, and wasm32 has 4 GiB.
const MAX_VERTICES: usize = 4_000_000;

/// The largest number of triangles of a contour: a model of more would need more memory than a page has. Noise without
/// an object has as many.
const MOST_TRIANGLES: usize = 6_000_000;

/// The largest number of triangles of a contour for each vertex that the surface may have; spheres, whose edges become
/// long, need 6.
const TRIANGLES_PER_VERTEX: usize = 8;

/// A box around the image in model space, in which all vertices must stay, with the rounded box that it is made from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Domain {
    pub(super) centre: Vec3,
    /// The half axes, in model space, of the rounded box around the whole image, which is the enclosing start surface
    /// if no object is found to enclose.
    pub(super) axes: Vec3,
    pub(super) bounds: Bounds,
    /// The largest number of vertices of the surface, whatever its edges.
    pub(super) max_vertices: usize,
}

/// The least half axis of a rounded box, in δ, the lower edge bound: a smaller one is not round with these edges.
const LEAST_AXIS: f32 = 4.0;

/// Returns the half axes of a rounded box that encloses an image or object: those in `around`, lengthened where they
/// are too short for a mesh with the lower edge bound `delta`, or below the longest divided by [`MAX_ELONGATION`].
pub(super) fn rounded_axes(around: Vec3, delta: f32) -> Vec3 {
    let least = (LEAST_AXIS * delta).max(around.max_element() / MAX_ELONGATION);
    around.max(Vec3::splat(least))
}

/// Returns the half axes of the rounded box around an image of `dims` voxels and their border.
fn axes_around(dims: [usize; 3]) -> Vec3 {
    Vec3::from(dims.map(|n| THROUGH_CORNERS * 0.5 * (n as f32 + 1.0)))
}

impl Domain {
    /// Returns the largest δ, the lower edge bound, in voxels, for objects in an image of `dims` voxels: with longer
    /// edges the surface of a ball that fills a third of the image along each axis had half of its volume or less.
    pub(super) fn longest_delta(dims: [usize; 3]) -> f64 {
        f64::from(axes_around(dims).max_element() / LEAST_AXIS)
    }

    /// Makes the domain of an image of `dims` voxels, for a surface that starts with δ, the lower edge bound, equal to
    /// `delta` voxels.
    pub(super) fn new(dims: [usize; 3], delta: f32) -> Self {
        let centre = Vec3::from(dims.map(|n| 0.5 * (n as f32 - 1.0)));
        let axes = rounded_axes(axes_around(dims), delta);
        Self {
            centre,
            axes,
            bounds: Bounds { min: centre - axes * DOMAIN_SCALE, max: centre + axes * DOMAIN_SCALE },
            max_vertices: MAX_VERTICES,
        }
    }

    /// Returns the domain with at most `most` vertices of a surface in it, by default [`MAX_VERTICES`].
    pub(super) fn with_at_most(self, most: Option<usize>) -> Self {
        Self { max_vertices: most.map_or(MAX_VERTICES, |most| most.min(MAX_VERTICES)), ..self }
    }

    /// Returns the largest number of triangles of a contour.
    pub(super) fn most_triangles(&self) -> usize {
        self.max_vertices.saturating_mul(TRIANGLES_PER_VERTEX).min(MOST_TRIANGLES)
    }

    /// Returns the approximate number of vertices of the enclosing start surface for the lower edge bound `delta`, δ,
    /// so that a start with too many is rejected: one per 2 δ² of the surface of a box with the same half axes.
    pub(super) fn enclosing_vertices(&self, delta: f32) -> usize {
        let [a, b, c] = (self.axes / delta).as_dvec3().to_array();
        (4.0 * (a * b + b * c + c * a)) as usize
    }

    /// Returns the point of the domain nearest to `p`, in model space; vertices that would leave the domain move there.
    pub(super) fn clamp(&self, p: Vec3) -> Vec3 {
        p.clamp(self.bounds.min, self.bounds.max)
    }

    /// Returns the largest number of vertices, for the lower edge bound `delta`, δ, of a surface in the domain without
    /// unresolved contacts: one per cube of side δ, but at most [`Self::max_vertices`].
    pub(super) fn most_vertices(&self, delta: f32) -> usize {
        let cubes = ((self.bounds.max - self.bounds.min) / delta).as_dvec3().element_product();
        (cubes as usize).min(self.max_vertices)
    }
}
