//! The output space, in which the mesh must not intersect itself either.
//!
//! Sheets in contact are nearer than the rounding of positions in world space, so that a mesh without
//! self-intersections may have some after it was mapped to world space. Triangles that rounding can bring together are
//! tested there, too, after rounding.

use super::MIN_LENGTH;
use crate::math::{Bounds, DAffine3, DVec3, Vec3, higher};
use crate::mesh::{Facet, facets_intersect};

/// Bound on the rounding of a position to single precision, relative to its largest coordinate: half a unit in the last
/// place, times √3 for three axes and a safety factor of 2.
const ROUNDING: f64 = 2.1e-7;

/// The coarsest rounding of positions in the output space, in units of the mesh, that is taken into account. Beyond
/// that, the output space cannot represent the surface, and testing it would stop all motion.
const COARSEST: f64 = 0.01;

/// The map from the mesh to the output space, and the largest displacement of a vertex by rounding there, in units of
/// the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutputSpace {
    map: DAffine3,
    rounding: f32,
}

impl OutputSpace {
    /// Creates the output space to which `map` leads, for meshes within `bounds`; `None` if single precision is too
    /// coarse for it.
    pub(super) fn new(map: DAffine3, bounds: &Bounds) -> Option<Self> {
        let corner = |k: usize| {
            let pick =
                |axis: usize| f64::from(if k >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] });
            map.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        };
        let furthest = (0..8).map(|k| corner(k).abs().max_element()).fold(0.0, f64::max);
        let back = map.matrix3.inverse();
        let shrinks = [back.x_axis, back.y_axis, back.z_axis]
            .map(|axis| axis.length_squared())
            .iter()
            .sum::<f64>()
            .sqrt();
        let rounding = ROUNDING * furthest * shrinks;
        (rounding < COARSEST).then_some(Self { map, rounding: rounding as f32 })
    }

    /// Returns the largest displacement of a vertex by rounding in the output space, in units of the mesh.
    pub(super) fn rounding(&self) -> f32 {
        self.rounding
    }

    fn facet(&self, facet: &Facet) -> Facet {
        let out = |p: Vec3| self.map.transform_point3(p.as_dvec3()).as_vec3();
        Facet { points: facet.points.map(out), ..*facet }
    }
}

/// Returns the clearance below which triangles are tested by exact predicates: the rounding of the output space, if
/// there is one, but at least [`MIN_LENGTH`].
pub(super) fn exact_below(output: Option<&OutputSpace>) -> f32 {
    output.map_or(MIN_LENGTH, |space| higher(MIN_LENGTH, space.rounding()))
}

/// Returns whether two triangles intersect, in the space of the mesh or, if there is one, in its output space.
pub(super) fn intersect(s: &Facet, t: &Facet, output: Option<&OutputSpace>) -> bool {
    facets_intersect(s, t) || output.is_some_and(|space| facets_intersect(&space.facet(s), &space.facet(t)))
}

/// Returns the bounding box of a triangle, enlarged by the rounding of the output space if there is one.
pub(super) fn bounds(facet: &Facet, output: Option<&OutputSpace>) -> Bounds {
    let Bounds { min, max } = Bounds::from_points(&facet.points);
    let margin = Vec3::splat(output.map_or(0.0, OutputSpace::rounding));
    Bounds { min: min - margin, max: max + margin }
}
