//! Handles: ellipsoids that move, turn and stretch the surface around them, ever less with the distance along the surface.

use super::ellipsoid::Ellipsoid;
use crate::math::{DMat3, DVec3};
use glam::DQuat;
use serde::{Deserialize, Serialize};

/// Deviation from the pose at rest that is mere rounding, relative to the shortest semi-axis.
const ROUNDING: f64 = 1e-9;

/// Distances from a handle below this share of its reach count as none, so that votes are finite.
const NEAREST: f64 = 1e-3;

/// An ellipsoid with the pose in which it leaves the surface unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Handle {
    pub rest: Ellipsoid,
    pub now: Ellipsoid,
    /// The rotation from the one to the other, by the way that it went: up to 360° either way.
    turn: DQuat,
    /// The distance along the surface at which its effect ends, in units of the mesh.
    reach: f64,
}

impl Handle {
    pub fn at_rest(rest: Ellipsoid, reach: f64) -> Self {
        Self { rest, now: rest, turn: DQuat::IDENTITY, reach }
    }

    /// Moves on to another pose, near the present one.
    pub fn move_to(&mut self, now: Ellipsoid) {
        self.now = now;
        let turn = DQuat::from_mat3(&(now.rotation * self.rest.rotation.transpose()));
        self.turn = if turn.dot(self.turn) < 0.0 { -turn } else { turn };
    }

    /// Returns whether the pose is that at rest, but for rounding.
    pub fn is_at_rest(&self) -> bool {
        self.deviation() <= ROUNDING
    }

    /// Returns how far the pose is from that at rest: the largest of the shift, in shortest semi-axes, the turn and the
    /// stretch; only for comparison.
    pub fn deviation(&self) -> f64 {
        let (now, rest) = (&self.now, &self.rest);
        let shift = now.center.distance(rest.center) / rest.shortest_axis();
        let turn = (0..3).map(|k| now.rotation.col(k).distance(rest.rotation.col(k))).fold(shift, f64::max);
        let stretch = (now.lengths / rest.lengths - 1.0).abs().max_element();
        turn.max(stretch)
    }

    pub fn is_valid(&self) -> bool {
        self.turn.is_finite()
            && self.reach >= 0.0
            && [self.rest, self.now].iter().all(|e| e.control().validate(0).is_ok())
    }

    fn stretch(&self) -> DMat3 {
        let rotation = self.rest.rotation;
        rotation * DMat3::from_diagonal(self.now.lengths / self.rest.lengths) * rotation.transpose()
    }

    fn moved(&self, p: DVec3) -> DVec3 {
        self.now.center + DMat3::from_quat(self.turn) * self.stretch() * (p - self.rest.center)
    }
}

/// How a place of the surface moves: p → pivot + shift + linear (p − pivot).
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pivot: DVec3,
    shift: DVec3,
    /// The rotation alone, without the stretch.
    pub turn: DMat3,
    linear: DMat3,
}

impl Motion {
    pub fn of(&self, p: DVec3) -> DVec3 {
        self.pivot + self.shift + self.linear * (p - self.pivot)
    }

    /// Returns the point that is moved to `p`.
    pub fn inverse_of(&self, p: DVec3) -> DVec3 {
        self.pivot + self.linear.inverse() * (p - self.pivot - self.shift)
    }
}

/// Returns how a place moves that has `distances` from the handles along the surface; `None` if it stays.
///
/// Each handle has a vote, the inverse square of its distance (Shepard): at a handle, its own counts alone. With the
/// distance, each handle gives a growing share of its vote to staying, at its reach all of it. Rotations and stretches are
/// averaged, and applied about the mean centre of the handles, so that a motion that all have in common is exact.
pub(super) fn motion_at(handles: &[Handle], distances: &[f32]) -> Option<Motion> {
    let vote = |(handle, &d): (&Handle, &f32)| {
        let d = f64::from(d).max(NEAREST * handle.reach);
        1.0 / (d * d)
    };
    let total: f64 = handles.iter().zip(distances).map(vote).sum();
    let share =
        |(handle, d): (&Handle, &f32)| fading(f64::from(*d) / handle.reach) * vote((handle, d)) / total;
    let all = handles.iter().zip(distances).map(|of| (of.0, share(of)));
    let moving: Vec<(&Handle, f64)> = all.filter(|&(_, share)| share > 0.0).collect();
    if moving.iter().all(|(handle, _)| handle.is_at_rest()) {
        return None;
    }
    let all: f64 = moving.iter().map(|(_, share)| share).sum();
    let pivot = moving.iter().map(|(handle, share)| handle.rest.center * *share).sum::<DVec3>() / all;
    let shift = moving.iter().map(|(handle, share)| (handle.moved(pivot) - pivot) * *share).sum();
    let stays = 1.0 - all;
    let turn = moving.iter().fold(DQuat::IDENTITY * stays, |sum, (handle, share)| sum + handle.turn * *share);
    let stretch =
        moving.iter().fold(DMat3::IDENTITY * stays, |sum, (handle, share)| sum + handle.stretch() * *share);
    // Half of the surface between two that have turned by 360° against each other may turn either way.
    let turn = if turn.length_squared() > 1e-12 { turn.normalize() } else { DQuat::IDENTITY };
    let turn = DMat3::from_quat(turn);
    Some(Motion { pivot, shift, turn, linear: turn * stretch })
}

/// Returns the share of its vote that a handle keeps at a distance given as a share of its reach: 1 at 0, 0 from 1 on,
/// smooth at both ends.
fn fading(x: f64) -> f64 {
    if x < 1.0 { 1.0 - x * x * (3.0 - 2.0 * x) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::ControlEllipsoid;
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn ball(center: [f64; 3]) -> Handle {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Handle::at_rest(Ellipsoid::new(&ControlEllipsoid { center, axes }), 1.0)
    }

    fn turned(angle: f64) -> Handle {
        let mut handle = ball([3.0, 0.0, 0.0]);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let axes = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
        let center = [3.0 * cos + 1.0, 3.0 * sin, 0.0];
        handle.move_to(Ellipsoid::new(&ControlEllipsoid { center, axes }));
        handle
    }

    #[test]
    fn a_motion_that_all_handles_have_in_common_is_exact() {
        let mut other = ball([0.0, 0.0, 0.0]);
        let same = turned(1.0);
        other.move_to(Ellipsoid::new(&ControlEllipsoid { center: [1.0, 0.0, 0.0], ..same.now.control() }));
        let motion = motion_at(&[same, other], &[1e-9, 2e-9]).unwrap();
        let (sin, cos) = (libm::sin(1.0), libm::cos(1.0));
        let expected = DVec3::new(1.0 + 2.0 * cos - 5.0 * sin, 2.0 * sin + 5.0 * cos, 7.0);
        assert!(motion.of(DVec3::new(2.0, 5.0, 7.0)).distance(expected) < 1e-9);
        assert!(motion.inverse_of(expected).distance(DVec3::new(2.0, 5.0, 7.0)) < 1e-9);
    }

    #[test]
    fn motions_fade_and_end() {
        let moved = turned(0.5);
        let share = |d: f32| motion_at(&[moved], &[d]).map(|motion| motion.shift.length());
        assert!(share(0.0).unwrap() > share(0.4).unwrap() && share(0.4).unwrap() > share(0.9).unwrap());
        assert!(share(1.0).is_none() && share(f32::INFINITY).is_none());
        // At a handle that has not moved, nothing does.
        let near = motion_at(&[moved, ball([0.0; 3])], &[0.5, 0.0]).unwrap();
        assert!(near.of(DVec3::ONE).distance(DVec3::ONE) < 1e-4);
    }

    #[test]
    fn a_handle_turns_on_beyond_half_a_turn() {
        let mut handle = ball([0.0; 3]);
        for k in 1..=10 {
            let angle = 0.4 * f64::from(k);
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            let axes = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
            handle.move_to(Ellipsoid::new(&ControlEllipsoid { center: [0.0; 3], axes }));
        }
        // A little way off, the surface has turned a little less, not the other way.
        let turn = motion_at(&[handle], &[0.2]).unwrap().turn * DVec3::X;
        let angle = libm::atan2(turn.y, turn.x) + 2.0 * std::f64::consts::PI;
        assert!(angle > 3.2 && angle < 4.0, "{angle}");
    }
}
