//! Moves the ellipsoids towards their targets, in each step only as far as the membrane can follow.

use super::ellipsoid::{ControlEllipsoid, Ellipsoid, Shape};
use crate::math::{DMat3, DVec3};
use glam::DQuat;
use serde::{Deserialize, Serialize};

/// Largest displacement of an ellipsoid's centre in one step, as a share of the larger of its shortest semi-axes before
/// and after. With more, the surfaces before and after are too far apart for closest points to correspond; with less,
/// drags take more steps.
const REACH: f64 = 0.5;

/// Largest rotation of an ellipsoid in one step, in radians. It also applies to a sphere, whose points on the axis of
/// rotation do not move at all.
const TURN: f64 = 0.35;

/// Size at which a new ellipsoid starts, as a share of its own, and at which a removed one disappears, as a share of
/// the thickest target's shortest semi-axis.
const SEED: f64 = 0.05;

/// Largest factor by which a semi-axis grows or shrinks in one step.
const GROWTH: f64 = 1.5;

/// One ellipsoid with its current state and its target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Mover {
    now: Ellipsoid,
    /// The target; `None` for an ellipsoid that is being removed.
    goal: Option<Ellipsoid>,
}

/// All ellipsoids of a model, with their targets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Movers(Vec<Mover>);

impl Movers {
    /// Creates ellipsoids that are at their targets.
    pub fn new(given: &[ControlEllipsoid]) -> Self {
        let still = |given| {
            let now = Ellipsoid::new(given);
            Mover { now, goal: Some(now) }
        };
        Self(given.iter().map(still).collect())
    }

    /// Sets new targets, matched by index. A new ellipsoid starts at a twentieth of its size if the membrane `holds`
    /// the centre of its target, else inside the nearest ellipsoid; one that is left out shrinks until it is removed.
    pub fn send(&mut self, given: &[ControlEllipsoid], holds: impl Fn(&Ellipsoid) -> bool) {
        let leaving = self.0.len().min(given.len());
        let mut movers: Vec<Mover> = Vec::with_capacity(given.len().max(self.0.len()));
        for (k, given) in given.iter().enumerate() {
            let goal = Ellipsoid::new(given);
            let known = self.0.get(k).filter(|mover| mover.goal.is_some());
            let now = known.map_or_else(|| self.seed(&goal, &holds), |mover| mover.now);
            movers.push(Mover { now, goal: Some(goal) });
        }
        // Includes those that were being removed before.
        let vanishing =
            |(k, mover): (usize, &Mover)| (k >= leaving || mover.goal.is_none()).then_some(mover.now);
        let vanishing: Vec<Ellipsoid> = self.0.iter().enumerate().filter_map(vanishing).collect();
        movers.extend(vanishing.into_iter().map(|now| Mover { now, goal: None }));
        self.0 = movers;
    }

    /// Returns the state in which a new ellipsoid starts. Growing outside of the membrane, it would push the membrane
    /// away instead of being covered by it.
    fn seed(&self, goal: &Ellipsoid, holds: impl Fn(&Ellipsoid) -> bool) -> Ellipsoid {
        let away = |mover: &Mover| mover.now.clearance(goal.center);
        let nearest = self.0.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        match nearest {
            Some(Mover { now: host, .. }) if !holds(goal) => {
                let fits = (host.thinnest() / goal.lengths.max_element()).min(1.0);
                Shape { center: host.center, ..Shape::from(goal.scaled(fits)) }.into()
            }
            _ => goal.scaled(SEED),
        }
    }

    /// Whether all are valid ellipsoids; those of a saved state may not be.
    pub fn are_sound(&self) -> bool {
        let all = self.0.iter().flat_map(|mover| std::iter::once(mover.now).chain(mover.goal));
        !self.0.is_empty() && all.into_iter().all(|e| e.given().validate(0).is_ok())
    }

    /// Returns all ellipsoids in their current state.
    pub fn now(&self) -> Vec<Ellipsoid> {
        self.0.iter().map(|mover| mover.now).collect()
    }

    /// Returns the targets, without the ellipsoids that are being removed.
    pub fn goals(&self) -> Vec<Ellipsoid> {
        self.0.iter().filter_map(|mover| mover.goal).collect()
    }

    /// Whether all ellipsoids are at their targets, and none is being removed.
    pub fn have_arrived(&self) -> bool {
        self.0.iter().all(|mover| mover.goal == Some(mover.now))
    }

    /// Returns the number of steps, possibly fractional, that the slowest ellipsoid needs to reach its target.
    pub fn steps_left(&self) -> f64 {
        self.0.iter().map(|mover| mover.goal.map_or(1.0, |goal| way(&mover.now, &goal))).fold(0.0, f64::max)
    }

    /// Moves all ellipsoids by one step, by the same share of their remaining motion, so that those that move together
    /// stay together.
    pub fn advance(&mut self) {
        let share = 1.0 / self.steps_left().max(1.0);
        for mover in &mut self.0 {
            match mover.goal {
                Some(goal) if share == 1.0 => mover.now = goal,
                Some(goal) => mover.now = between(&mover.now, &goal, share),
                None => mover.now = mover.now.scaled(1.0 / GROWTH),
            }
        }
    }

    /// Removes ellipsoids that were being removed and have become small.
    pub fn drop_vanished(&mut self) {
        let smallest = |mover: &Mover, all: f64| mover.goal.is_some() || mover.now.thinnest() > SEED * all;
        let usual = self.0.iter().filter_map(|m| m.goal).map(|goal| goal.thinnest()).fold(0.0, f64::max);
        self.0.retain(|mover| smallest(mover, usual));
    }
}

/// Returns the number of steps, possibly fractional, from one ellipsoid to another: the maximum over translation,
/// rotation and growth.
fn way(from: &Ellipsoid, to: &Ellipsoid) -> f64 {
    let reach = REACH * from.thinnest().max(to.thinnest());
    let shift = from.center.distance(to.center) / reach;
    let turn = 2.0 * libm::acos(quaternion(from).dot(quaternion(to)).abs().min(1.0)) / TURN;
    let ratios = to.lengths / from.lengths;
    let growth = ratios.max(ratios.recip()).max_element();
    shift.max(turn).max(libm::log(growth) / libm::log(GROWTH))
}

/// Interpolates between two ellipsoids: centres linearly, orientations about one axis, lengths geometrically.
fn between(from: &Ellipsoid, to: &Ellipsoid, share: f64) -> Ellipsoid {
    let turn = slerp(quaternion(from), quaternion(to), share);
    let lengths = [0, 1, 2].map(|k| from.lengths[k] * libm::pow(to.lengths[k] / from.lengths[k], share));
    Ellipsoid::from(Shape {
        center: from.center.lerp(to.center, share),
        rotation: DMat3::from_quat(turn),
        lengths: DVec3::from_array(lengths),
    })
}

fn quaternion(e: &Ellipsoid) -> DQuat {
    DQuat::from_mat3(&e.rotation)
}

/// Interpolates rotations along the shorter arc. Written out because the platform's sine differs between machines.
fn slerp(a: DQuat, b: DQuat, share: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let angle = libm::acos(a.dot(b).min(1.0));
    if angle < 1e-9 {
        return b;
    }
    let (before, after) = (libm::sin((1.0 - share) * angle), libm::sin(share * angle));
    (a * before + b * after).normalize()
}
