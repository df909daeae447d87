//! Ellipsoids on their way: a step takes each only so far that the skin can follow.

use super::ellipsoid::{ControlEllipsoid, Ellipsoid, Shape};
use crate::math::{DMat3, DVec3};
use glam::DQuat;
use serde::{Deserialize, Serialize};

/// How far any point of an ellipsoid goes in one step at most, in its shortest semi-axis. With more, the surface before and
/// after are too far apart for their nearest points to be the same places; with less, drags take more steps.
const REACH: f64 = 0.5;

/// How far it turns in one step at most: the same for a ball, whose points on the axis of rotation do not move at all.
const TURN: f64 = 0.35;

/// The share of its size that an ellipsoid begins with, or ends at.
const SEED: f64 = 0.05;

/// By how much an ellipsoid grows at most in one step, or shrinks.
const GROWTH: f64 = 1.5;

/// One ellipsoid, where it is and where it is to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Mover {
    now: Ellipsoid,
    /// Where it is to be, or that it is to vanish.
    goal: Option<Ellipsoid>,
}

/// All ellipsoids.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Movers(Vec<Mover>);

impl Movers {
    /// Ellipsoids that are where they are to be.
    pub fn new(given: &[ControlEllipsoid]) -> Self {
        let still = |given| {
            let now = Ellipsoid::new(given);
            Mover { now, goal: Some(now) }
        };
        Self(given.iter().map(still).collect())
    }

    /// Sends each to its new place, by its index. New ones grow from a twentieth of their size where the skin `holds` their
    /// place, else they come out of the nearest one; those left out shrink to a twentieth and vanish.
    pub fn send(&mut self, given: &[ControlEllipsoid], holds: impl Fn(&Ellipsoid) -> bool) {
        let leaving = self.0.len().min(given.len());
        let mut movers: Vec<Mover> = Vec::with_capacity(given.len().max(self.0.len()));
        for (k, given) in given.iter().enumerate() {
            let goal = Ellipsoid::new(given);
            let known = self.0.get(k).filter(|mover| mover.goal.is_some());
            let now = known.map_or_else(|| self.seed(&goal, &holds), |mover| mover.now);
            movers.push(Mover { now, goal: Some(goal) });
        }
        // Those that were vanishing already go on.
        let vanishing =
            |(k, mover): (usize, &Mover)| (k >= leaving || mover.goal.is_none()).then_some(mover.now);
        let vanishing: Vec<Ellipsoid> = self.0.iter().enumerate().filter_map(vanishing).collect();
        movers.extend(vanishing.into_iter().map(|now| Mover { now, goal: None }));
        self.0 = movers;
    }

    /// Where a new one begins. What grew outside would push the skin away instead of being covered by it.
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

    /// Whether all are ellipsoids, as those of a state may not be.
    pub fn are_sound(&self) -> bool {
        let all = self.0.iter().flat_map(|mover| std::iter::once(mover.now).chain(mover.goal));
        !self.0.is_empty() && all.into_iter().all(|e| e.given().validate(0).is_ok())
    }

    /// All as they are now.
    pub fn now(&self) -> Vec<Ellipsoid> {
        self.0.iter().map(|mover| mover.now).collect()
    }

    /// Where those are to be that do not vanish.
    pub fn goals(&self) -> Vec<Ellipsoid> {
        self.0.iter().filter_map(|mover| mover.goal).collect()
    }

    /// Whether all are where they are to be.
    pub fn have_arrived(&self) -> bool {
        self.0.iter().all(|mover| mover.goal == Some(mover.now))
    }

    /// How much of the way is left for the one that is furthest, in steps.
    pub fn steps_left(&self) -> f64 {
        self.0.iter().map(|mover| mover.goal.map_or(1.0, |goal| way(&mover.now, &goal))).fold(0.0, f64::max)
    }

    /// Takes each one step on its way: all by the same share, so that what moves together stays together.
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

    /// Forgets those that were to vanish and have become small.
    pub fn drop_vanished(&mut self) {
        let smallest = |mover: &Mover, all: f64| mover.goal.is_some() || mover.now.thinnest() > SEED * all;
        let usual = self.0.iter().filter_map(|m| m.goal).map(|goal| goal.thinnest()).fold(0.0, f64::max);
        self.0.retain(|mover| smallest(mover, usual));
    }
}

/// The way from one to another in steps: the largest of what each bound asks for.
fn way(from: &Ellipsoid, to: &Ellipsoid) -> f64 {
    let reach = REACH * from.thinnest().max(to.thinnest());
    let shift = from.center.distance(to.center) / reach;
    let turn = 2.0 * libm::acos(quaternion(from).dot(quaternion(to)).abs().min(1.0)) / TURN;
    let ratios = to.lengths / from.lengths;
    let growth = ratios.max(ratios.recip()).max_element();
    shift.max(turn).max(libm::log(growth) / libm::log(GROWTH))
}

/// A share of the way: straight, turned about one axis, lengths in proportion.
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

/// The shorter way round; written out, as the platform's sine is not the same everywhere.
fn slerp(a: DQuat, b: DQuat, share: f64) -> DQuat {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let angle = libm::acos(a.dot(b).min(1.0));
    if angle < 1e-9 {
        return b;
    }
    let (before, after) = (libm::sin((1.0 - share) * angle), libm::sin(share * angle));
    (a * before + b * after).normalize()
}
