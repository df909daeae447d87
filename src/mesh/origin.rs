//! Positions far from the origin of world space: an origin in double precision, and positions in single precision
//! relative to it.
//!
//! Single precision has 24 bits. Surveyed coordinates of metres take most of them to say where a thing is, and leave few
//! for its shape. So a mesh or cloud that is far away for its size has an origin of its own.

use super::{Mesh, MeshError, TriangleMesh};
use crate::math::{DAffine3, DVec3, Vec3};

/// The largest coordinate, in sizes of the box, up to which positions are relative to the origin of world space: a
/// thousand edges across the box, each keeps its length to a thousandth. With more, short edges would be rounded; with
/// less, everyday volumes beside their origin would get an origin of their own without need.
const FAR: f64 = 16.0;

/// The part of an edge that it may lose when positions are rounded to single precision in world space.
const LOSS: f64 = 1e-3;

/// The length of the shortest edges that [`LOSS`] is asked of, as a part of the mean edge: shorter ones, which marching
/// cubes leaves anywhere, count as that long.
const SHORT: f64 = 0.1;

/// Returns the origin for positions in a box of world space, given by its corners: 0 unless the box is farther away than
/// 16 times its longest side, else a point near its centre, with so few bits that differences from it are exact.
pub fn world_origin(min: DVec3, max: DVec3) -> DVec3 {
    let furthest = min.abs().max(max.abs()).max_element();
    let size = (max - min).max_element();
    if !(furthest > FAR * size && furthest.is_finite()) {
        return DVec3::ZERO;
    }
    // A box without size, such as that of one point, gets that point.
    let step = power_above(if size > 0.0 { size } else { furthest * 1e-9 });
    ((min * 0.5 + max * 0.5) / step).round() * step
}

/// Returns the least power of two above a positive number.
fn power_above(x: f64) -> f64 {
    f64::from_bits(((x.to_bits() >> 52) + 1) << 52)
}

/// Returns the origin, see [`world_origin`], for the voxels of a grid of `dims` voxels which `affine` maps to world space.
pub fn grid_origin(affine: &DAffine3, dims: [usize; 3]) -> DVec3 {
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { -0.5 } else { dims[axis] as f64 - 0.5 };
        affine.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let first = corner(0);
    let (min, max) = (1..8).map(corner).fold((first, first), |(min, max), p| (min.min(p), max.max(p)));
    world_origin(min, max)
}

/// Positions in world space as they are read, which become an origin and positions relative to it.
///
/// Each is stored as the nearest number in single precision and, from the first on that needs it, what is left.
#[derive(Clone, Debug, Default)]
pub struct WorldPositions {
    nearest: Vec<Vec3>,
    left: Vec<Vec3>,
}

impl WorldPositions {
    /// Returns the number of positions.
    pub fn len(&self) -> usize {
        self.nearest.len()
    }

    /// Returns whether there is no position.
    pub fn is_empty(&self) -> bool {
        self.nearest.is_empty()
    }

    /// Appends a position.
    pub fn push(&mut self, position: DVec3) {
        let nearest = position.as_vec3();
        let left = (position - nearest.as_dvec3()).as_vec3();
        if left != Vec3::ZERO && nearest.is_finite() {
            self.left.resize(self.nearest.len(), Vec3::ZERO);
            self.left.push(left);
        }
        self.nearest.push(nearest);
    }

    /// Returns positions and the origin that they are relative to: 0 if it need not be another, or if a position is not
    /// finite in single precision, which callers refuse.
    pub fn relative(self) -> (Vec<Vec3>, DVec3) {
        let Self { mut nearest, left } = self;
        // One point has no size for which it could be far away.
        let origin = if nearest.len() == 1 && left.is_empty() { DVec3::ZERO } else { origin_of(&nearest) };
        if origin != DVec3::ZERO {
            for (k, p) in nearest.iter_mut().enumerate() {
                let rest = left.get(k).copied().unwrap_or_default();
                *p = (p.as_dvec3() - origin + rest.as_dvec3()).as_vec3();
            }
        }
        (nearest, origin)
    }
}

impl FromIterator<DVec3> for WorldPositions {
    fn from_iter<I: IntoIterator<Item = DVec3>>(positions: I) -> Self {
        let mut all = Self::default();
        positions.into_iter().for_each(|p| all.push(p));
        all
    }
}

impl Extend<DVec3> for WorldPositions {
    fn extend<I: IntoIterator<Item = DVec3>>(&mut self, positions: I) {
        positions.into_iter().for_each(|p| self.push(p));
    }
}

/// Returns the origin, see [`world_origin`], for positions in world space; 0 if one is not finite.
fn origin_of(positions: &[Vec3]) -> DVec3 {
    let Some(&first) = positions.first() else { return DVec3::ZERO };
    if positions.iter().any(|p| !p.is_finite()) {
        return DVec3::ZERO;
    }
    let (min, max) = positions.iter().fold((first, first), |(min, max), &p| (min.min(p), max.max(p)));
    world_origin(min.as_dvec3(), max.as_dvec3())
}

impl TriangleMesh {
    /// Returns the position of vertex `v` in world space.
    pub fn world_position(&self, v: usize) -> DVec3 {
        self.positions[v].as_dvec3() + self.origin
    }

    /// Returns the mesh, whose positions are in world space, with the origin that suits it: 0 unless it is far away.
    #[must_use]
    pub fn located(mut self) -> Self {
        let origin = origin_of(&self.positions);
        self.move_origin(origin);
        self
    }

    /// Sets the origin, and the positions so that vertices stay where they are in world space.
    pub fn move_origin(&mut self, origin: DVec3) {
        let shift = self.origin - origin;
        if shift != DVec3::ZERO {
            self.positions.iter_mut().for_each(|p| *p = (p.as_dvec3() + shift).as_vec3());
        }
        self.origin = origin;
    }

    /// Returns the mesh with positions relative to `origin`.
    #[must_use]
    pub fn relative_to(&self, origin: DVec3) -> Self {
        let mut moved = self.clone();
        moved.move_origin(origin);
        moved
    }

    /// Returns the mesh transformed by `map`, see [`Self::transformed`], with the origin that suits the result.
    pub(super) fn mapped(&self, map: &DAffine3) -> Self {
        let all = (0..self.positions.len()).map(|v| map.transform_point3(self.world_position(v)));
        let (positions, origin) = all.collect::<WorldPositions>().relative();
        let moved = Self { positions: Vec::new(), ..self.clone() };
        Self { positions, origin, ..moved.transformed(map) }
    }

    /// Returns the positions in world space, rounded to single precision.
    ///
    /// # Errors
    /// [`MeshError::Precision`] if rounding changes an edge by more than a thousandth, counting edges of less than a tenth
    /// of the mean as that long.
    pub fn world_positions(&self) -> Result<Vec<Vec3>, MeshError> {
        let rounded: Vec<Vec3> =
            (0..self.positions.len()).map(|v| self.world_position(v).as_vec3()).collect();
        if self.origin == DVec3::ZERO {
            return Ok(rounded);
        }
        let edges = || {
            let ends = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
            self.triangles.iter().flat_map(ends).map(|edge| edge.map(|v| v as usize))
        };
        let length = |[a, b]: [usize; 2]| self.positions[a].as_dvec3().distance(self.positions[b].as_dvec3());
        let mean = edges().map(length).sum::<f64>() / (3 * self.triangles.len()).max(1) as f64;
        let loses = |edge: [usize; 2]| {
            let [a, b] = edge.map(|v| rounded[v].as_dvec3() - self.positions[v].as_dvec3() - self.origin);
            (a - b).length() > LOSS * length(edge).max(SHORT * mean)
        };
        if rounded.iter().all(|p| p.is_finite()) && !edges().any(loses) {
            return Ok(rounded);
        }
        let problem = format!(
            "single precision is too coarse at {} for edges of {mean:.3e} on average: use positions relative to the \
             origin of the mesh, or move it towards that of the world",
            self.origin
        );
        Err(MeshError::Precision { problem })
    }
}

impl Mesh {
    /// Creates a mesh of positions in world space from one relative to `origin`.
    #[must_use]
    pub fn with_origin(mut self, origin: DVec3) -> Self {
        self.origin = origin;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::torus;
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn what_is_near_for_its_size_has_no_origin_of_its_own() {
        let of = |min: f64, max: f64| world_origin(DVec3::splat(min), DVec3::splat(max));
        for scale in [1e-30, 1e-9, 1.0, 1e9, 1e30] {
            assert_eq!(of(-scale, scale), DVec3::ZERO);
            assert_eq!(of(14.0 * scale, 15.0 * scale), DVec3::ZERO);
            let far = of(1e6 * scale, (1e6 + 1.0) * scale);
            assert!((far / scale - 1e6).abs().max_element() < 2.0, "{far}");
        }
        assert_eq!(of(5.0, 5.0), DVec3::splat(5.0).round());
        assert_eq!(of(f64::INFINITY, f64::INFINITY), DVec3::ZERO);
    }

    #[test]
    fn positions_come_back_to_a_millionth_of_their_spread() {
        let mut random = Random::new(4);
        let mut near = || DVec3::new(random.unit(), random.unit(), random.unit());
        for offset in [0.0, 1.0, 40.0, 5.4e6, 1e9] {
            let all: Vec<DVec3> = (0..50).map(|_| near() + DVec3::new(offset, -offset, 1.0)).collect();
            let (positions, origin) = all.iter().copied().collect::<WorldPositions>().relative();
            assert_eq!(origin == DVec3::ZERO, offset < 20.0);
            for (p, q) in positions.iter().zip(&all) {
                assert!((p.as_dvec3() + origin - q).length() < 2e-6, "{offset}");
            }
        }
    }

    #[test]
    fn single_precision_survives_the_way_to_an_origin_and_back() {
        let mut mesh = torus(2.0, 0.7, 12, 9);
        mesh.positions.iter_mut().for_each(|p| *p += Vec3::new(5.4e6, 5e5, -3.0));
        let far = mesh.clone().located();
        assert!(far.origin.length() > 5e6);
        assert_eq!(far.world_positions().unwrap(), mesh.positions);
        assert_eq!(torus(2.0, 0.7, 12, 9).located(), torus(2.0, 0.7, 12, 9));
    }

    #[test]
    fn what_rounding_would_bend_is_refused() {
        for (offset, is_fine) in [(3e2, true), (2e3, true), (5e4, false), (5.4e6, false)] {
            let mut mesh = torus(2.0, 0.7, 12, 9);
            mesh.origin = DVec3::new(offset, offset, 0.0);
            assert_eq!(mesh.world_positions().is_ok(), is_fine, "{offset}");
        }
    }
}
