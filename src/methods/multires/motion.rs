//! Moves the control ellipsoids towards their targets, in each step only as far as the membrane can follow.

use super::ellipsoid::{ControlEllipsoid, Ellipsoid, Shape};
use crate::math::{DMat3, DVec3};
use glam::DQuat;
use serde::{Deserialize, Serialize};

/// Largest displacement of an ellipsoid's centre in one step, as a share of its shortest semi-axis or that of its
/// target, whichever is longer. With more, the membranes before and after are too far apart for closest points to
/// correspond; with less, drags take more steps.
const MAX_SHIFT: f64 = 0.5;

/// Largest rotation of an ellipsoid in one step, in radians. It applies to spheres, too, as the membrane turns along
/// with them.
const MAX_TURN: f64 = 0.35;

/// Size at which a new ellipsoid starts, as a share of its target. An ellipsoid that is being removed disappears when
/// its shortest semi-axis is at most this share of the longest of the targets' shortest semi-axes.
const START_SIZE: f64 = 0.05;

/// Largest factor by which a semi-axis grows or shrinks in one step.
const MAX_GROWTH: f64 = 1.5;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct MovingEllipsoid {
    now: Ellipsoid,
    /// The target; `None` for an ellipsoid that is being removed.
    target: Option<Ellipsoid>,
}

/// All control ellipsoids of a model with their targets; those that are being removed have none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct MovingEllipsoids(Vec<MovingEllipsoid>);

impl MovingEllipsoids {
    /// Creates ellipsoids that are at their targets.
    pub fn new(given: &[ControlEllipsoid]) -> Self {
        let at_target = |given| {
            let now = Ellipsoid::new(given);
            MovingEllipsoid { now, target: Some(now) }
        };
        Self(given.iter().map(at_target).collect())
    }

    /// Sets new targets, matched by index. A new ellipsoid starts at a twentieth of its size if the membrane `holds`
    /// the centre of its target, else inside the nearest ellipsoid; an ellipsoid without a target in `given` shrinks
    /// until it is removed.
    pub fn set_targets(&mut self, given: &[ControlEllipsoid], holds: impl Fn(&Ellipsoid) -> bool) {
        let kept = self.0.len().min(given.len());
        let mut moving: Vec<MovingEllipsoid> = Vec::with_capacity(given.len().max(self.0.len()));
        for (k, given) in given.iter().enumerate() {
            let target = Ellipsoid::new(given);
            let known = self.0.get(k).filter(|ellipsoid| ellipsoid.target.is_some());
            let now = known.map_or_else(|| self.initial_state(&target, &holds), |ellipsoid| ellipsoid.now);
            moving.push(MovingEllipsoid { now, target: Some(target) });
        }
        // Includes those that were being removed before.
        let vanishing = |(k, moving): (usize, &MovingEllipsoid)| {
            (k >= kept || moving.target.is_none()).then_some(moving.now)
        };
        let vanishing: Vec<Ellipsoid> = self.0.iter().enumerate().filter_map(vanishing).collect();
        moving.extend(vanishing.into_iter().map(|now| MovingEllipsoid { now, target: None }));
        self.0 = moving;
    }

    /// Sets new targets, matched by index, of ellipsoids that support no membrane: a new one is at its target, and one
    /// without a target in `given` is removed, both at once.
    pub fn set_poses(&mut self, given: &[ControlEllipsoid]) {
        let pose = |(k, given): (usize, &ControlEllipsoid)| {
            let target = Ellipsoid::new(given);
            MovingEllipsoid { now: self.0.get(k).map_or(target, |known| known.now), target: Some(target) }
        };
        self.0 = given.iter().enumerate().map(pose).collect();
    }

    /// Makes the present poses the targets.
    pub fn stop(&mut self) {
        self.0.iter_mut().for_each(|moving| moving.target = Some(moving.now));
    }

    /// Returns the state in which a new ellipsoid starts: small at its target, or inside the nearest ellipsoid if the
    /// centre of its target is outside of the membrane. An ellipsoid that grew outside would push the membrane away
    /// instead of being covered by it.
    fn initial_state(&self, target: &Ellipsoid, holds: impl Fn(&Ellipsoid) -> bool) -> Ellipsoid {
        let away = |ellipsoid: &MovingEllipsoid| ellipsoid.now.ray_distance(target.center);
        let nearest = self.0.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        match nearest {
            Some(MovingEllipsoid { now: host, .. }) if !holds(target) => {
                let fits = (host.shortest_axis() / target.lengths.max_element()).min(1.0);
                Shape { center: host.center, ..Shape::from(target.scaled(fits)) }.into()
            }
            _ => target.scaled(START_SIZE),
        }
    }

    /// Returns whether there is at least one ellipsoid, and all current states and targets pass
    /// [`ControlEllipsoid::validate`]; those of a saved state may not.
    pub fn are_valid(&self) -> bool {
        let all = self.0.iter().flat_map(|ellipsoid| std::iter::once(ellipsoid.now).chain(ellipsoid.target));
        !self.0.is_empty() && all.into_iter().all(|e| e.control().validate(0).is_ok())
    }

    /// Returns all ellipsoids in their current state, including those that are being removed.
    pub fn now(&self) -> Vec<Ellipsoid> {
        self.0.iter().map(|ellipsoid| ellipsoid.now).collect()
    }

    /// Returns the target ellipsoids; those that are being removed have none.
    pub fn targets(&self) -> Vec<Ellipsoid> {
        self.0.iter().filter_map(|ellipsoid| ellipsoid.target).collect()
    }

    /// Returns whether all ellipsoids are at their targets, and none is being removed: only then can the model
    /// converge.
    pub fn have_arrived(&self) -> bool {
        self.0.iter().all(|ellipsoid| ellipsoid.target == Some(ellipsoid.now))
    }

    /// Returns the number of steps, possibly fractional, that the slowest ellipsoid needs to reach its target; at least
    /// 1 if one is being removed. A step may be as long as `shift`, in units of the mesh, however small the ellipsoid.
    fn steps_left(&self, shift: f64) -> f64 {
        self.0
            .iter()
            .map(|moving| moving.target.map_or(1.0, |target| steps_between(&moving.now, &target, shift)))
            .fold(0.0, f64::max)
    }

    /// Moves all ellipsoids by one step, each by the same share of its remaining motion, so that ellipsoids that move
    /// together stay together. Those that are being removed shrink by the factor [`MAX_GROWTH`].
    pub fn advance(&mut self) {
        self.advance_by(1.0, 0.0);
    }

    /// Moves all ellipsoids as [`Self::advance`] does, by a part of a step, which may be as long as `shift`, in units of the
    /// mesh, however small the ellipsoid.
    pub fn advance_by(&mut self, part: f64, shift: f64) {
        let share = part / self.steps_left(shift).max(1.0);
        for moving in &mut self.0 {
            match moving.target {
                Some(target) if share == 1.0 => moving.now = target,
                Some(target) => moving.now = between(&moving.now, &target, share),
                None => moving.now = moving.now.scaled(1.0 / MAX_GROWTH),
            }
        }
    }

    /// Drops the ellipsoids that are being removed and are small enough, see [`START_SIZE`].
    pub fn drop_vanished(&mut self) {
        let is_kept = |ellipsoid: &MovingEllipsoid, all: f64| {
            ellipsoid.target.is_some() || ellipsoid.now.shortest_axis() > START_SIZE * all
        };
        let usual =
            self.0.iter().filter_map(|m| m.target).map(|target| target.shortest_axis()).fold(0.0, f64::max);
        self.0.retain(|ellipsoid| is_kept(ellipsoid, usual));
    }
}

/// Returns the number of steps, possibly fractional, that an ellipsoid takes from one state to another: the maximum
/// over translation, rotation and growth. A translation as long as `shift` is always one step.
fn steps_between(from: &Ellipsoid, to: &Ellipsoid, shift: f64) -> f64 {
    let max_shift = (MAX_SHIFT * from.shortest_axis().max(to.shortest_axis())).max(shift);
    let shift = from.center.distance(to.center) / max_shift;
    let turns = 2.0 * libm::acos(quaternion(from).dot(quaternion(to)).abs().min(1.0)) / MAX_TURN;
    let ratios = to.lengths / from.lengths;
    let growth = ratios.max(ratios.recip()).max_element();
    shift.max(turns).max(libm::log(growth) / libm::log(MAX_GROWTH))
}

/// Returns the state of an ellipsoid after a `share` (0..1) of the motion from one state to another: centres are
/// interpolated linearly, orientations about one axis, lengths geometrically.
fn between(from: &Ellipsoid, to: &Ellipsoid, share: f64) -> Ellipsoid {
    let rotation = slerp(quaternion(from), quaternion(to), share);
    let lengths = [0, 1, 2].map(|k| from.lengths[k] * libm::pow(to.lengths[k] / from.lengths[k], share));
    Ellipsoid::from(Shape {
        center: from.center.lerp(to.center, share),
        rotation: DMat3::from_quat(rotation),
        lengths: DVec3::from_array(lengths),
    })
}

fn quaternion(e: &Ellipsoid) -> DQuat {
    DQuat::from_mat3(&e.rotation)
}

/// Interpolates between two rotations along the shorter arc, from `a` at 0 to `b` at 1. Written out because the
/// platform's sine differs between machines.
fn slerp(a: DQuat, b: DQuat, share: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let angle = libm::acos(a.dot(b).min(1.0));
    if angle < 1e-9 {
        return b;
    }
    let (before, after) = (libm::sin((1.0 - share) * angle), libm::sin(share * angle));
    (a * before + b * after).normalize()
}
