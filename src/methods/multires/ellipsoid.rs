//! Control ellipsoids: containment, closest points, pushing vertices out, and moving points along with the ellipsoids
//! (Kobbelt, Bareuther & Seidel, section 5).

use crate::math::{DMat3, DVec3, Vec3};
use crate::methods::MethodError;
use serde::{Deserialize, Serialize};

/// A control ellipsoid, a solid that pushes the membrane outwards, as passed by the caller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControlEllipsoid {
    /// The centre, in units of the mesh.
    pub center: [f64; 3],
    /// Three orthogonal semi-axes as vectors, in units of the mesh.
    pub axes: [[f64; 3]; 3],
}

/// Largest absolute cosine between two axes that are accepted as orthogonal: rounding to `f32` stays far below.
const ORTHOGONAL: f64 = 1e-3;

/// Largest accepted ratio of two semi-axes: more slender ellipsoids are thinner than any triangle could follow.
const MAX_AXIS_RATIO: f64 = 1e3;

/// Shortest accepted semi-axis, in units of the mesh: positions stay within the range of `f32`.
const SHORTEST: f64 = 1e-15;
/// Longest accepted semi-axis, in units of the mesh.
const LONGEST: f64 = 1e15;
/// Largest accepted coordinate of a centre, in units of the mesh.
const FURTHEST: f64 = 1e30;

impl ControlEllipsoid {
    /// Checks that the centre is in range, and that the axes span an ellipsoid: their lengths, the ratio of the longest
    /// to the shortest, and the angles between them.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming `ellipsoids`, and the one at fault by its `index`.
    pub(super) fn validate(&self, index: usize) -> Result<(), MethodError> {
        let refuse =
            |problem: String| Err(MethodError::invalid("ellipsoids", format!("number {index}: {problem}")));
        let [x, y, z] = self.axes.map(DVec3::from);
        let lengths = [x, y, z].map(DVec3::length);
        if !DVec3::from(self.center).abs().cmple(DVec3::splat(FURTHEST)).all() {
            return refuse(format!("center must be finite and at most {FURTHEST:e}, got {:?}", self.center));
        }
        if let Some(length) = lengths.into_iter().find(|length| !(SHORTEST..=LONGEST).contains(length)) {
            return refuse(format!("semi-axes must be {SHORTEST:e} to {LONGEST:e} long, got {length}"));
        }
        let (least, most) =
            (lengths.into_iter().fold(f64::MAX, f64::min), lengths.into_iter().fold(0.0, f64::max));
        if most > MAX_AXIS_RATIO * least {
            return refuse(format!(
                "ratio of semi-axes must be at most {MAX_AXIS_RATIO}, got {}",
                most / least
            ));
        }
        for (k, (a, b)) in [(x, y), (y, z), (z, x)].into_iter().enumerate() {
            let cosine = a.dot(b).abs() / (a.length() * b.length());
            if cosine > ORTHOGONAL {
                let angle = libm::acos(cosine).to_degrees();
                return refuse(format!("axes {k} and {} must be orthogonal, got {angle:.1}°", (k + 1) % 3));
            }
        }
        Ok(())
    }
}

/// Checks that there is at least one ellipsoid, and that each passes [`ControlEllipsoid::validate`].
///
/// # Errors
/// As [`ControlEllipsoid::validate`], and for an empty list.
pub(super) fn check_ellipsoids(given: &[ControlEllipsoid]) -> Result<(), MethodError> {
    if given.is_empty() {
        return Err(MethodError::invalid("ellipsoids", "must have at least one, got none"));
    }
    given.iter().enumerate().try_for_each(|(k, e)| e.validate(k))
}

/// An ellipsoid with precomputed values for fast containment tests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Shape", into = "Shape")]
pub(super) struct Ellipsoid {
    shape: Shape,
    /// Maps offsets from the centre to coordinates in which the ellipsoid is the unit ball. Precomputed, because
    /// divisions by the semi-axes took a large part of the time per frame of the model.
    to_unit: DMat3,
    /// The square of the longest semi-axis: points farther from the centre are outside.
    bounding_radius_squared: f64,
}

/// The geometry of an ellipsoid, from which all other values are computed: centre, orientation and semi-axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Shape {
    pub center: DVec3,
    /// Unit directions of the axes as columns; right-handed.
    pub rotation: DMat3,
    /// The lengths of the semi-axes, in units of the mesh.
    pub lengths: DVec3,
}

impl From<Shape> for Ellipsoid {
    fn from(shape: Shape) -> Self {
        let to_unit = DMat3::from_diagonal(shape.lengths.recip()) * shape.rotation.transpose();
        let longest = shape.lengths.max_element();
        Self { shape, to_unit, bounding_radius_squared: longest * longest }
    }
}

impl From<Ellipsoid> for Shape {
    fn from(ellipsoid: Ellipsoid) -> Self {
        ellipsoid.shape
    }
}

impl std::ops::Deref for Ellipsoid {
    type Target = Shape;

    fn deref(&self) -> &Shape {
        &self.shape
    }
}

/// Maximum number of Newton steps in [`largest_root`], which finds the closest point of an ellipsoid: from a point near
/// its surface two or three are enough, from anywhere 60.
const STEPS: usize = 100;

/// Newton's method in [`largest_root`] stops after a relative step of at most this: convergence is quadratic, so that
/// the result has twice as many correct digits.
const LAST_STEP: f64 = 1e-5;

impl Ellipsoid {
    /// Creates an ellipsoid from axes that passed [`ControlEllipsoid::validate`]. The third of three left-handed axes
    /// is reversed, which gives the same ellipsoid.
    pub fn new(given: &ControlEllipsoid) -> Self {
        let axes = given.axes.map(DVec3::from);
        let x = axes[0].normalize();
        // Orthogonal up to rounding, however the given axes were rounded.
        let y = (axes[1] - x * axes[1].dot(x)).normalize();
        let lengths = DVec3::new(axes[0].length(), axes[1].length(), axes[2].length());
        Shape { center: given.center.into(), rotation: DMat3::from_cols(x, y, x.cross(y)), lengths }.into()
    }

    /// Returns the ellipsoid with all semi-axes multiplied by `factor`, about the same centre.
    pub fn scaled(&self, factor: f64) -> Self {
        Shape { lengths: self.lengths * factor, ..self.shape }.into()
    }

    /// Converts the ellipsoid back to the form in which callers pass and receive it.
    pub fn control(&self) -> ControlEllipsoid {
        let axis = |k: usize| (self.rotation.col(k) * self.lengths[k]).to_array();
        ControlEllipsoid { center: self.center.to_array(), axes: [axis(0), axis(1), axis(2)] }
    }

    /// Returns the coordinates of `p` along the axes of the ellipsoid, relative to its centre, in units of the mesh.
    #[inline]
    fn local(&self, p: DVec3) -> DVec3 {
        self.rotation.transpose() * (p - self.center)
    }

    /// Maps coordinates along the axes of the ellipsoid, relative to its centre, back to the space of the mesh.
    #[inline]
    fn world(&self, local: DVec3) -> DVec3 {
        self.center + self.rotation * local
    }

    /// Maps `p` to the frame in which the ellipsoid is the unit ball: the length of the result is 1 on the surface,
    /// less inside.
    #[inline]
    pub fn unit(&self, p: DVec3) -> DVec3 {
        self.to_unit * (p - self.center)
    }

    /// Returns whether `p` is inside the ellipsoid; false on the surface, and within rounding of it.
    #[inline]
    pub fn contains(&self, p: DVec3) -> bool {
        let seen = p - self.center;
        // Most ellipsoids are far from most points.
        seen.length_squared() < self.bounding_radius_squared
            && (self.to_unit * seen).length_squared() < OUTSIDE * OUTSIDE
    }

    /// Maps a point from the unit-ball frame of [`Self::unit`] back to the space of the mesh.
    pub fn at_unit(&self, unit: DVec3) -> DVec3 {
        self.world(unit * self.lengths)
    }

    /// Returns the length of the shortest semi-axis.
    pub fn shortest_axis(&self) -> f64 {
        self.lengths.min_element()
    }

    /// Returns the smallest radius of curvature, that of the sharpest tip, which limits the edge length of the
    /// membrane.
    pub fn min_radius(&self) -> f64 {
        self.shortest_axis() * self.shortest_axis() / self.lengths.max_element()
    }

    /// Returns the distance from `p` to the surface of the ellipsoid along the ray from `p` to the centre, an upper
    /// bound of the distance to the ellipsoid; 0 inside.
    pub fn ray_distance(&self, p: DVec3) -> f64 {
        let size = self.unit(p).length();
        if size > 1.0 { p.distance(self.center) * (1.0 - 1.0 / size) } else { 0.0 }
    }

    /// Returns the point of the surface closest to `p`, which may be inside or outside. For the centre, it is an end of
    /// the shortest axis.
    ///
    /// The surface normal at this point passes through p. With local coordinates y of p and semi-axes a, the point is
    /// a²y/(a² + t) for the largest root t of Σ (a y/(a² + t))² = 1.
    pub fn nearest(&self, p: DVec3) -> DVec3 {
        if self.lengths.min_element() == self.lengths.max_element() {
            return self.center + self.shortest_axis() * (p - self.center).normalize_or(self.rotation.x_axis);
        }
        let squares = self.lengths * self.lengths;
        let least = squares.min_element();
        let mut local = self.local(p);
        // In the plane perpendicular to the shortest axis the root may vanish; slightly off it, it does not.
        for k in 0..3 {
            if squares[k] == least && local[k].abs() < 1e-9 * self.lengths[k] {
                local[k] = 1e-9 * self.lengths[k];
                break;
            }
        }
        let t = largest_root(local * self.lengths, squares, least);
        let on = squares * local / (squares + DVec3::splat(t));
        // Rounding leaves the point slightly off the surface.
        let scaled = on / self.lengths;
        self.world(on / scaled.length())
    }
}

/// Returns the largest t with Σ (w / (s + t))² = 1, for the weights w and squares s, by Newton's method, for
/// [`Ellipsoid::nearest`]; the sum is decreasing and convex from −`least` on, `least` being the smallest s.
fn largest_root(weights: DVec3, squares: DVec3, least: f64) -> f64 {
    // A lower bound of the root: no single term may exceed 1.
    let floor = (0..3).map(|k| weights[k].abs() - squares[k]).fold(-least, f64::max);
    let mut t = if floor > 0.0 { floor } else { 0.0 };
    for _ in 0..STEPS {
        let reciprocals = (squares + DVec3::splat(t)).recip();
        let ratios = weights * reciprocals;
        let terms = ratios * ratios;
        let slope = -2.0 * terms.dot(reciprocals);
        let next = (t - (terms.element_sum() - 1.0) / slope).max(floor);
        let settled = (next - t).abs() <= LAST_STEP * (least + t.abs());
        t = next;
        if settled {
            break;
        }
    }
    t
}

/// Checks that a membrane with edges up to `longest`, in units of the mesh, stays on the tips of all ellipsoids, see
/// [`MAX_EDGE_PER_RADIUS`].
///
/// # Errors
/// [`MethodError::InvalidArgument`] naming the first ellipsoid that the membrane would slip off.
pub(super) fn check_tips(ellipsoids: &[Ellipsoid], longest: f64) -> Result<(), MethodError> {
    let slips = |(k, e): (usize, &Ellipsoid)| {
        (longest > MAX_EDGE_PER_RADIUS * e.min_radius()).then_some((k, e.min_radius()))
    };
    let Some((k, radius)) = ellipsoids.iter().enumerate().find_map(slips) else { return Ok(()) };
    let problem = format!(
        "number {k} has tips of radius {radius:.3}, where a membrane with edges up to {longest:.3} would slip off: use edgeMax \
         ≤ {:.3}, or a rounder ellipsoid",
        MAX_EDGE_PER_RADIUS * radius
    );
    Err(MethodError::invalid("ellipsoids", problem))
}

/// Longest edge of a membrane that stays on the tip of an ellipsoid, as a multiple of the tip's radius of curvature.
/// Only vertices are pushed out, not triangles: with much longer edges the tip pierces a triangle, and the membrane
/// retracts from it.
const MAX_EDGE_PER_RADIUS: f64 = 1.6;

/// Returns `p` moved out of all ellipsoids, by repeated pushes out of the one that it is deepest in; `p` itself if it
/// is outside of all.
///
/// Leaving the first ellipsoid that contains it would not be enough, as that may lead into another. In the crease
/// between two, pushes alternate by ever shorter distances; a point still inside after [`PUSHES`] is moved out along a
/// straight line.
pub(super) fn pushed_out(ellipsoids: &[Ellipsoid], p: DVec3) -> DVec3 {
    let mut at = p;
    for _ in 0..PUSHES {
        match deepest(ellipsoids, at) {
            None => return at,
            Some((_, nearest)) => at = nearest,
        }
    }
    push_straight(ellipsoids, at)
}

/// Maximum number of pushes in [`pushed_out`], each out of one ellipsoid; in a crease of 90° between two, each further
/// correct digit takes some three pushes.
const PUSHES: usize = 12;

/// Distance from the centre, in the unit-ball frame of an ellipsoid, from which on a point counts as outside: rounding
/// puts surface points slightly off 1.
const OUTSIDE: f64 = 1.0 - 1e-7;

/// Returns the index of the ellipsoid that `p` is deepest in, and the point of its surface closest to `p`; `None`
/// outside of all.
fn deepest(ellipsoids: &[Ellipsoid], p: DVec3) -> Option<(usize, DVec3)> {
    let inside = ellipsoids.iter().enumerate().filter(|(_, e)| e.contains(p));
    let nearest = inside.map(|(k, e)| (k, e.nearest(p)));
    nearest.max_by(|a, b| a.1.distance_squared(p).total_cmp(&b.1.distance_squared(p)))
}

/// Moves `p` along the sum of the normals of all ellipsoids that contain it until it is outside of every one: the last
/// resort of [`pushed_out`].
fn push_straight(ellipsoids: &[Ellipsoid], p: DVec3) -> DVec3 {
    let containing = ellipsoids.iter().filter(|e| e.contains(p));
    let away = |e: &Ellipsoid| (e.rotation * (e.unit(p) / e.lengths)).normalize_or_zero();
    let direction = containing.map(away).sum::<DVec3>().normalize_or(DVec3::Z);
    let mut distance = 0.0;
    // An ellipsoid is convex, so each is left once: the loop ends.
    while let Some(exit) = ellipsoids.iter().find_map(|e| exit_beyond(e, p, direction, distance)) {
        distance = exit;
    }
    p + direction * distance
}

/// Returns the distance from `p` at which the ray along the unit vector `direction` leaves the ellipsoid `e`; `None` if
/// the point of the ray at `distance` from `p` is not inside `e`.
fn exit_beyond(e: &Ellipsoid, p: DVec3, direction: DVec3, distance: f64) -> Option<f64> {
    if e.unit(p + direction * distance).length_squared() >= OUTSIDE * OUTSIDE {
        return None;
    }
    let (from, step) = (e.unit(p), e.rotation.transpose() * direction / e.lengths);
    let (a, b, c) = (step.length_squared(), from.dot(step), from.length_squared() - 1.0);
    let exit = (-b + (b * b - a * c).max(0.0).sqrt()) / a;
    (exit > distance).then_some(exit)
}

/// Returns `p` moved along with the ellipsoids from `before` to `after`, which are in the same order: by the weighted
/// mean of the affine maps that take each to its new state, with larger weights for nearer ones. Used to predict the
/// membrane of the next frame.
///
/// If all ellipsoids move alike, so does every point. Otherwise, points nearer to an ellipsoid than its shortest
/// semi-axis mostly move with it, and the space between two is stretched evenly.
pub(super) fn move_with(before: &[Ellipsoid], after: &[Ellipsoid], p: Vec3) -> Vec3 {
    let p = p.as_dvec3();
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for (from, to) in before.iter().zip(after) {
        let distance = from.ray_distance(p) / from.shortest_axis();
        let weight = 1.0 / (SOFTNESS + distance * distance);
        sum += weight * (to.at_unit(from.unit(p)) - p);
        total += weight;
    }
    if total > 0.0 { (p + sum / total).as_vec3() } else { p.as_vec3() }
}
/// Constant in the weights of [`move_with`]: an ellipsoid weighs 1 / (`SOFTNESS` + d²), with its distance d from the
/// point in units of its shortest semi-axis. So an ellipsoid that contains the point weighs eleven times as much as one
/// with d = 1. With a larger ratio, all stretching falls on the crease between two ellipsoids that separate, and the
/// map folds there; with a smaller one, detail slides on the ellipsoids.
const SOFTNESS: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn vector(random: &mut Random) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * random.unit() - 1.0))
    }

    fn random_ellipsoid(random: &mut Random) -> Ellipsoid {
        let x = vector(random).normalize();
        let y = vector(random).cross(x).normalize();
        let lengths = DVec3::from_array(std::array::from_fn(|_| 0.2 + 2.0 * random.unit()));
        Shape { center: vector(random), rotation: DMat3::from_cols(x, y, x.cross(y)), lengths }.into()
    }

    /// Returns `count` points spread evenly over the surface of an ellipsoid.
    fn spread(e: &Ellipsoid, count: usize) -> Vec<DVec3> {
        let on = |i: usize| {
            let (z, angle) = (1.0 - (2 * i + 1) as f64 / count as f64, 2.4 * i as f64);
            let ring = (1.0 - z * z).sqrt();
            e.at_unit(DVec3::new(ring * libm::cos(angle), ring * libm::sin(angle), z))
        };
        (0..count).map(on).collect()
    }

    #[test]
    fn the_nearest_point_is_on_the_surface_and_nearer_than_any_other() {
        let mut random = Random::new(11);
        for _ in 0..200 {
            let e = random_ellipsoid(&mut random);
            let p = e.center + vector(&mut random) * 3.0 * random.unit();
            let nearest = e.nearest(p);
            assert!((e.unit(nearest).length() - 1.0).abs() < 1e-12);
            let least = spread(&e, 2000).iter().map(|q| q.distance(p)).fold(f64::MAX, f64::min);
            assert!(nearest.distance(p) <= least + 1e-9, "{} {least}", nearest.distance(p));
            // The normal there passes through p.
            let normal = (e.rotation * (e.unit(nearest) / e.lengths)).normalize();
            let distance = p - nearest;
            assert!((distance - normal * distance.dot(normal)).length() < 1e-7, "{:?} {p}", e);
        }
    }

    #[test]
    fn from_the_middle_and_from_a_plane_of_symmetry() {
        let lengths = DVec3::new(3.0, 2.0, 1.0);
        let e = Ellipsoid::from(Shape { center: DVec3::ONE, rotation: DMat3::IDENTITY, lengths });
        assert!((e.nearest(DVec3::ONE).distance(DVec3::ONE) - 1.0).abs() < 1e-6);
        // Far out along the longest axis the closest point is its end, near the centre it is to the side.
        assert!(e.nearest(DVec3::new(3.9, 1.0, 1.0)).distance(DVec3::new(4.0, 1.0, 1.0)) < 1e-6);
        let beside = e.nearest(DVec3::new(1.5, 1.0, 1.0));
        assert!(beside.z > 1.9 && beside.distance(DVec3::new(1.5, 1.0, 1.0)) < 1.0);
    }

    #[test]
    fn pushed_out_is_outside_all_and_not_far() {
        let mut random = Random::new(12);
        for seed in 0..300 {
            let some: Vec<_> = (0..1 + seed % 5).map(|_| random_ellipsoid(&mut random)).collect();
            let p = vector(&mut random) * 2.0;
            let out = pushed_out(&some, p);
            assert!(some.iter().all(|e| e.unit(out).length() > 1.0 - 1e-6), "{seed}");
            if some.iter().all(|e| e.unit(p).length() >= 1.0) {
                assert_eq!(out, p);
            }
        }
    }

    /// Tests [`pushed_out`] with nested and overlapping ellipsoids: stopping outside the first one that contains a
    /// point would leave it inside the second.
    #[test]
    fn nested_and_crossing_ones_are_left_together() {
        let ball = |x: f64, r: f64| {
            let center = DVec3::new(x, 0.0, 0.0);
            Ellipsoid::from(Shape { center, rotation: DMat3::IDENTITY, lengths: DVec3::splat(r) })
        };
        let nested = pushed_out(&[ball(0.0, 1.0), ball(0.1, 2.0)], DVec3::new(0.3, 0.2, 0.0));
        assert!((nested.distance(DVec3::new(0.1, 0.0, 0.0)) - 2.0).abs() < 1e-6);
        let both = [ball(-0.5, 1.0), ball(0.5, 1.0)];
        let crease = pushed_out(&both, DVec3::new(0.01, 0.6, 0.0));
        assert!(both.iter().all(|e| e.unit(crease).length() > 1.0 - 1e-6));
        assert!(crease.distance(DVec3::new(0.0, 0.75_f64.sqrt(), 0.0)) < 0.15, "{crease}");
    }

    #[test]
    fn points_follow_ellipsoids_that_move_alike() {
        let mut random = Random::new(13);
        let before: Vec<_> = (0..4).map(|_| random_ellipsoid(&mut random)).collect();
        let turn = DMat3::from_rotation_y(0.7);
        let moved = |e: &Ellipsoid| {
            let (center, rotation) = (turn * e.center + DVec3::X, turn * e.rotation);
            Ellipsoid::from(Shape { center, rotation, lengths: e.lengths })
        };
        let after: Vec<_> = before.iter().map(moved).collect();
        let p = (vector(&mut random) * 3.0).as_vec3();
        let expected = (turn * p.as_dvec3() + DVec3::X).as_vec3();
        assert!(move_with(&before, &after, p).distance(expected) < 1e-6);

        assert_eq!(move_with(&[], &[], Vec3::X), Vec3::X);
    }

    #[test]
    fn invalid_ellipsoids_are_refused() {
        let good =
            ControlEllipsoid { center: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]] };
        assert_eq!(good.validate(0), Ok(()));
        assert_eq!(Ellipsoid::new(&good).control(), good);
        let spoilt = |change: fn(&mut ControlEllipsoid)| {
            let mut bad = good;
            change(&mut bad);
            bad.validate(4).unwrap_err().to_string()
        };
        assert!(
            spoilt(|e| e.axes[1] = [0.0; 3])
                .contains("number 4: semi-axes must be 1e-15 to 1e15 long, got 0")
        );
        assert!(
            spoilt(|e| e.axes[1] = [1.0, 1.0, 0.0]).contains("axes 0 and 1 must be orthogonal, got 45.0°")
        );
        assert!(spoilt(|e| e.axes[0][0] = f64::NAN).contains("NaN"));
        assert!(spoilt(|e| e.axes[0][0] = 1e8).contains("ratio of semi-axes"));
        assert!(spoilt(|e| e.center[2] = f64::INFINITY).contains("center must be finite"));
    }
}
