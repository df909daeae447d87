//! Positions far from the origin of world space: an origin in double precision, and positions in single precision
//! relative to it.
//!
//! Single precision has 24 bits. Surveyed coordinates of metres take most of them to say where a thing is, and leave few
//! for its shape. So a mesh or cloud that is far away for its size has an origin of its own.

use super::{Mesh, MeshError, TriangleMesh};
use crate::math::order::{rank_f32, sort_by_rank};
use crate::math::{DAffine3, DVec3, Vec3, box_corners};
use std::collections::TryReserveError;

/// The largest coordinate, in sizes of the box, up to which positions are relative to the origin of world space: a
/// thousand edges across the box, each keeps its length to a thousandth. With more, short edges would be rounded; with
/// less, everyday volumes beside their origin would get an origin of their own without need.
const FAR: f64 = 16.0;

/// The part of an edge that it may lose when positions are rounded to single precision in world space.
const LOSS: f64 = 1e-3;

/// The length of the shortest edges that [`LOSS`] is asked of, as a part of the mean edge: shorter ones, which marching
/// cubes leaves anywhere, count as that long.
const SHORT: f64 = 0.1;

/// As [`LOSS`], for meshes that are read or given: more is refused. A thousandth would refuse large terrains.
const LARGEST_LOSS: f64 = 1.0 / 64.0;

/// The number of positions from which it is seen where most of them are.
const SAMPLE: usize = 4096;

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
    let last = DVec3::from(dims.map(|n| n as f64 - 0.5));
    let corners = box_corners(DVec3::splat(-0.5), last).map(|p| affine.transform_point3(p));
    let (min, max) =
        corners.into_iter().fold((corners[0], corners[0]), |(min, max), p| (min.min(p), max.max(p)));
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

    /// Returns position `v` in world space.
    pub fn at(&self, v: usize) -> DVec3 {
        self.nearest[v].as_dvec3() + self.left.get(v).copied().unwrap_or_default().as_dvec3()
    }

    /// Returns whether there is no position.
    pub fn is_empty(&self) -> bool {
        self.nearest.is_empty()
    }

    /// Reserves memory for more positions.
    ///
    /// # Errors
    /// If there is not enough.
    pub fn try_reserve(&mut self, additional: usize) -> Result<(), TryReserveError> {
        self.nearest.try_reserve_exact(additional)
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
    /// finite in single precision, which callers refuse. If a few are so far from the others that single precision cannot
    /// show all, the origin is among the others.
    pub fn relative(self) -> (Vec<Vec3>, DVec3) {
        let Self { mut nearest, left } = self;
        let origin = match origin_of(&nearest) {
            // One point has no size for which it could be far away.
            _ if nearest.len() == 1 && left.is_empty() => DVec3::ZERO,
            DVec3::ZERO if !left.is_empty() => origin_of_most(&nearest),
            origin => origin,
        };
        if origin != DVec3::ZERO {
            for (k, p) in nearest.iter_mut().enumerate() {
                let rest = left.get(k).copied().unwrap_or_default();
                *p = (p.as_dvec3() - origin + rest.as_dvec3()).as_vec3();
            }
        }
        (nearest, origin)
    }
}

impl WorldPositions {
    /// Returns the positions of a mesh of `triangles` as [`Self::relative`].
    ///
    /// # Errors
    /// [`MeshError::Precision`] if single precision changes an edge by more than 1/64: parts of the mesh are too far from
    /// each other. Edges of less than a tenth of the mean count as that long.
    pub fn relative_in(self, triangles: &[[u32; 3]]) -> Result<(Vec<Vec3>, DVec3), MeshError> {
        if self.left.is_empty() {
            return Ok(self.relative());
        }
        let given = self.clone();
        let (positions, origin) = self.relative();
        // Indices are validated later.
        let at = |all: &[Vec3], v: usize| all.get(v).copied().unwrap_or_default().as_dvec3();
        let edges = Edges { triangles, position: |v: usize| at(&given.nearest, v) + at(&given.left, v) };
        let mean = edges.mean_length();
        if edges.any_loses(LARGEST_LOSS, mean, |v| at(&positions, v) + origin) {
            let problem = format!(
                "single precision is too coarse for edges of {mean:.3e} on average so far from each other: give the \
                 parts of the mesh one by one"
            );
            return Err(MeshError::Precision { problem });
        }
        Ok((positions, origin))
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

/// Returns the origin, see [`world_origin`], for the box of most positions: half of them, and half their size around
/// those.
fn origin_of_most(positions: &[Vec3]) -> DVec3 {
    let step = positions.len() / SAMPLE + 1;
    let mut ends = [DVec3::ZERO; 2];
    for axis in 0..3 {
        let mut sample: Vec<f32> = positions.iter().step_by(step).map(|p| p[axis]).collect();
        sort_by_rank(&mut sample, |&x| rank_f32(x).into());
        let [low, high] = [1, 3].map(|k| f64::from(sample[sample.len() * k / 4]));
        (ends[0][axis], ends[1][axis]) = (1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low);
    }
    if positions.iter().all(|p| p.is_finite()) { world_origin(ends[0], ends[1]) } else { DVec3::ZERO }
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
        let edges = Edges {
            triangles: &self.triangles,
            position: |v: usize| self.positions[v].as_dvec3() + self.origin,
        };
        let mean = edges.mean_length();
        if rounded.iter().all(|p| p.is_finite()) && !edges.any_loses(LOSS, mean, |v| rounded[v].as_dvec3()) {
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

/// The edges of triangles whose vertices have positions.
struct Edges<'a, P> {
    triangles: &'a [[u32; 3]],
    position: P,
}

impl<P: Fn(usize) -> DVec3> Edges<'_, P> {
    fn ends(&self) -> impl Iterator<Item = [usize; 2]> {
        let ends = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        self.triangles.iter().flat_map(ends).map(|edge| edge.map(|v| v as usize))
    }

    fn length(&self, [a, b]: [usize; 2]) -> f64 {
        (self.position)(a).distance((self.position)(b))
    }

    fn mean_length(&self) -> f64 {
        self.ends().map(|edge| self.length(edge)).sum::<f64>() / (3 * self.triangles.len()).max(1) as f64
    }

    /// Returns whether an edge differs between its ends as they are and as they are `rounded` by more than a part `loss` of
    /// its length; the shortest edges count as long as a part of the `mean`.
    fn any_loses(&self, loss: f64, mean: f64, rounded: impl Fn(usize) -> DVec3) -> bool {
        self.ends().any(|edge| {
            let [a, b] = edge.map(|v| rounded(v) - (self.position)(v));
            (a - b).length() > loss * self.length(edge).max(SHORT * mean)
        })
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
    fn a_stray_position_does_not_take_the_precision_of_the_others() {
        let ball = torus(2.0, 0.7, 12, 9);
        let far = DVec3::new(512_345.5, 5_401_234.25, 230.0);
        let mut all: Vec<DVec3> = ball.positions.iter().map(|p| p.as_dvec3() + far).collect();
        all.push(DVec3::ZERO);
        let given = || all.iter().copied().collect::<WorldPositions>();
        let (positions, origin) = given().relative_in(&ball.triangles).unwrap();
        for (p, q) in positions.iter().zip(&all).take(ball.positions.len()) {
            assert!((p.as_dvec3() + origin - q).length() < 1e-6, "{origin}");
        }
        // A triangle that reaches from the one to the other does not mind.
        let long = [ball.triangles.clone(), vec![[0, 1, ball.positions.len() as u32]]].concat();
        assert_eq!(given().relative_in(&long).unwrap().1, origin);
    }

    #[test]
    fn parts_too_far_from_each_other_are_refused() {
        let ball = torus(1.0, 0.4, 24, 12);
        let count = ball.positions.len() as u32;
        let two =
            [ball.triangles.clone(), ball.triangles.iter().map(|t| t.map(|v| v + count)).collect()].concat();
        let apart = |by: f64| {
            let at =
                |shift: f64| ball.positions.iter().map(move |p| p.as_dvec3() + DVec3::splat(shift / 3.0));
            at(0.0).chain(at(by)).collect::<WorldPositions>().relative_in(&two)
        };
        assert_eq!(apart(1e3).unwrap().1, DVec3::ZERO);
        for by in [1e7, -1e9] {
            assert!(matches!(apart(by), Err(MeshError::Precision { .. })));
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
