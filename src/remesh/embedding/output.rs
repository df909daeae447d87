//! The space a surface is handed out in: it must not cross itself there, either.
//!
//! A mesh that does not cross itself where it moves may do so after its positions are mapped to world space and rounded to single
//! precision: sheets pressed on each other are nearer than that. So triangles that rounding could bring together are tested there,
//! too, as they come out rounded.

use crate::math::{Bounds, DAffine3, DVec3, Vec3};
use crate::mesh::{Facet, facets_cross};

/// Half a unit in the last place of single precision, relative to the number, times √3 for three axes and 2 to be safe.
const ROUNDING: f64 = 2.1e-7;

/// Coarser rounding than this, in lengths where the mesh moves, is no rounding: the space is too far away to hold the surface, and
/// holding it back there would stop it.
const COARSEST: f64 = 0.01;

/// A map to the output space, and how far rounding may move a vertex there.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutputSpace {
    map: DAffine3,
    rounding: f32,
}

impl OutputSpace {
    /// The space that `map` leads to, for meshes within `bounds`. `None` where single precision is too coarse for it.
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

    /// How far rounding in the output space may move a vertex, in lengths where the mesh moves.
    pub(super) fn rounding(&self) -> f32 {
        self.rounding
    }

    fn facet(&self, facet: &Facet) -> Facet {
        let out = |p: Vec3| self.map.transform_point3(p.as_dvec3()).as_vec3();
        Facet { points: facet.points.map(out), ..*facet }
    }
}

/// Whether two triangles cross, where the mesh moves or in its output space.
pub(super) fn cross(s: &Facet, t: &Facet, output: Option<&OutputSpace>) -> bool {
    facets_cross(s, t) || output.is_some_and(|space| facets_cross(&space.facet(s), &space.facet(t)))
}

/// The box around a triangle and what rounding may add to it.
pub(super) fn bounds(facet: &Facet, output: Option<&OutputSpace>) -> Bounds {
    let Bounds { min, max } = Bounds::of(&facet.points);
    let margin = Vec3::splat(output.map_or(0.0, OutputSpace::rounding));
    Bounds { min: min - margin, max: max + margin }
}
