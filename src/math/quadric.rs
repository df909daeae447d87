//! Quadric error metrics: sums of squared distances to planes and points, as functions of a position (Garland &
//! Heckbert, *Surface simplification using quadric error metrics*, 1997).

use super::{DMat3, DVec3};
use std::ops::{Add, AddAssign};

/// A quadratic function of a position x, xᵀ A x − 2 b·x + c, with A symmetric and positive semidefinite: the form of a
/// weighted sum of squared distances to planes and points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadric {
    /// Diagonal entries of A: xx, yy, zz. The entries xy, yz and zx are in `mixed`.
    diagonal: DVec3,
    mixed: DVec3,
    linear: DVec3,
    constant: f64,
}

impl Quadric {
    /// Returns the quadric of `weight` times the squared distance to the plane through `point` with unit normal
    /// `normal`.
    pub fn of_plane(point: DVec3, normal: DVec3, weight: f64) -> Self {
        let height = normal.dot(point);
        Self {
            diagonal: normal * normal * weight,
            mixed: normal * DVec3::new(normal.y, normal.z, normal.x) * weight,
            linear: normal * (height * weight),
            constant: height * height * weight,
        }
    }

    /// Returns the quadric of `weight` times the squared distance to `point`.
    pub fn of_point(point: DVec3, weight: f64) -> Self {
        Self {
            diagonal: DVec3::splat(weight),
            mixed: DVec3::ZERO,
            linear: point * weight,
            constant: point.length_squared() * weight,
        }
    }

    /// Returns the value of the quadratic function at `p`, a weighted sum of squared distances; rounding never makes it
    /// negative.
    pub fn evaluate(&self, p: DVec3) -> f64 {
        let value = (self.matrix() * p - 2.0 * self.linear).dot(p) + self.constant;
        // Rounding can make the difference negative.
        value.max(0.0)
    }

    /// Returns the position at which the quadratic function is least; `None` if it is not a unique finite point.
    pub fn minimizer(&self) -> Option<DVec3> {
        let matrix = self.matrix();
        let minimum = matrix.inverse() * self.linear;
        (matrix.determinant() > 0.0 && minimum.is_finite()).then_some(minimum)
    }

    fn matrix(&self) -> DMat3 {
        let ([xx, yy, zz], [xy, yz, zx]) = (self.diagonal.to_array(), self.mixed.to_array());
        DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
    }
}

impl Add for Quadric {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            diagonal: self.diagonal + other.diagonal,
            mixed: self.mixed + other.mixed,
            linear: self.linear + other.linear,
            constant: self.constant + other.constant,
        }
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const P: DVec3 = DVec3::new(1.0, -2.0, 0.5);

    #[test]
    fn distances_to_a_plane_and_a_point() {
        let normal = DVec3::new(2.0, 1.0, -2.0) / 3.0;
        let plane = Quadric::of_plane(P, normal, 3.0);
        let along = DVec3::new(1.0, 0.0, 1.0);
        assert!((plane.evaluate(P + 2.0 * normal + 7.0 * along) - 12.0).abs() < 1e-12);
        assert!((Quadric::of_point(P, 0.5).evaluate(P + along) - 1.0).abs() < 1e-15);
        assert!(plane.minimizer().is_none() || plane.evaluate(plane.minimizer().unwrap()) < 1e-12);
        assert_eq!(Quadric::default().minimizer(), None);
    }

    #[test]
    fn the_minimizer_of_three_planes_is_their_intersection() {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, 0.8)];
        let corner =
            Quadric::of_plane(P, x, 1.0) + Quadric::of_plane(P, y, 2.0) + Quadric::of_plane(P, z, 5.0);
        assert!((corner.minimizer().unwrap() - P).length() < 1e-14);
    }

    /// On a flat region, quadrics of planes do not determine the position of the minimum, and quadrics of points with a
    /// small weight do.
    #[test]
    fn points_settle_what_planes_leave_open() {
        let mut flat = Quadric::default();
        for shift in [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y] {
            flat += Quadric::of_plane(P + shift, DVec3::Z, 1.0) + Quadric::of_point(P + shift, 1e-6);
        }
        assert!((flat.minimizer().unwrap() - P).length() < 1e-9);
    }
}
