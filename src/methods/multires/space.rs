//! The space that a model computes in: relative to an origin, and in a unit, with which positions and areas fit into single
//! precision wherever and however large the input is.

use super::{ControlEllipsoid, MultiresParams};
use crate::math::DVec3;
use crate::mesh::{TriangleMesh, world_origin};

/// The sizes of the input, in world units, for which these are the units of the model. Products of four lengths, such as
/// squares of areas, stay far within the range of `f32` for edges of a millionth of them.
const ORDINARY: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// The sizes that are scaled. Positions of smaller input have lost digits already, and what is larger is refused.
const SCALED: std::ops::RangeInclusive<f64> = 1e-20..=1e20;

/// The map between world space and that of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ModelSpace {
    pub(super) origin: DVec3,
    /// The length of a unit of the model in world units, a power of two, so that scaling is exact.
    pub(super) unit: f64,
}

impl ModelSpace {
    /// Returns the space for a model that starts with `mesh`, or with ellipsoids alone.
    pub(super) fn of(mesh: Option<&TriangleMesh>, ellipsoids: &[ControlEllipsoid]) -> Self {
        let (min, max) = match mesh {
            Some(mesh) => bounds(mesh.positions.iter().map(|p| p.as_dvec3())),
            None => bounds(ellipsoids.iter().flat_map(ends)),
        };
        let origin = mesh.map_or_else(|| world_origin(min, max), |mesh| mesh.origin);
        let size = (max - min).max_element();
        let unit = if ORDINARY.contains(&size) || !SCALED.contains(&size) {
            1.0
        } else {
            f64::from_bits(size.to_bits() >> 52 << 52)
        };
        Self { origin, unit }
    }

    /// Returns a mesh of world space in that of the model.
    pub(super) fn mesh(&self, mut mesh: TriangleMesh) -> TriangleMesh {
        mesh.move_origin(self.origin);
        mesh.origin = DVec3::ZERO;
        self.scale(&mut mesh, 1.0 / self.unit);
        mesh
    }

    /// Returns a mesh of the model's space in world space.
    pub(super) fn in_world(&self, mut mesh: TriangleMesh) -> TriangleMesh {
        self.scale(&mut mesh, self.unit);
        TriangleMesh { origin: self.origin, ..mesh }
    }

    fn scale(&self, mesh: &mut TriangleMesh, factor: f64) {
        if self.unit != 1.0 {
            mesh.positions.iter_mut().for_each(|p| *p = (p.as_dvec3() * factor).as_vec3());
        }
    }

    /// Returns ellipsoids of world space in that of the model.
    pub(super) fn ellipsoids(&self, all: &[ControlEllipsoid]) -> Vec<ControlEllipsoid> {
        self.mapped(all, |p| (p - self.origin) / self.unit, 1.0 / self.unit)
    }

    /// Returns ellipsoids of the model's space in world space.
    pub(super) fn ellipsoids_in_world(&self, all: &[ControlEllipsoid]) -> Vec<ControlEllipsoid> {
        self.mapped(all, |p| p * self.unit + self.origin, self.unit)
    }

    fn mapped(
        &self,
        all: &[ControlEllipsoid],
        center: impl Fn(DVec3) -> DVec3,
        factor: f64,
    ) -> Vec<ControlEllipsoid> {
        let mut all = all.to_vec();
        if *self != (Self { origin: DVec3::ZERO, unit: 1.0 }) {
            for e in &mut all {
                e.center = center(e.center.into()).to_array();
                e.axes.as_flattened_mut().iter_mut().for_each(|x| *x *= factor);
            }
        }
        all
    }

    /// Returns parameters with lengths in world units with those of the model.
    pub(super) fn params(&self, params: &MultiresParams) -> MultiresParams {
        scaled(params, 1.0 / self.unit)
    }

    /// Returns parameters with lengths in units of the model with those of the world.
    pub(super) fn params_in_world(&self, params: &MultiresParams) -> MultiresParams {
        scaled(params, self.unit)
    }
}

fn scaled(params: &MultiresParams, factor: f64) -> MultiresParams {
    let (edge_min, edge_max) = (params.edge_min * factor, params.edge_max * factor);
    MultiresParams { edge_min, edge_max, ..params.clone() }
}

fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points
        .map(|p| (p, p))
        .reduce(|(min, max), (p, _)| (min.min(p), max.max(p)))
        .unwrap_or((DVec3::ZERO, DVec3::ZERO))
}

/// Returns two corners of a box around an ellipsoid.
fn ends(e: &ControlEllipsoid) -> [DVec3; 2] {
    let reach = e.axes.iter().fold(DVec3::ZERO, |reach, &axis| reach + DVec3::from(axis).abs());
    [DVec3::from(e.center) - reach, DVec3::from(e.center) + reach]
}
