//! Proposes ellipsoids for a surface: balls inside that touch it on two sides, the largest first, spread over its parts.

use super::ControlEllipsoid;
use super::detail::Band;
use crate::math::{Bounds, DVec3, Vec3, triangle};
use crate::pauses::Pauses;

/// Number of points of the surface at which a ball inside is searched for.
const PLACES: usize = 1500;
/// Largest number of ellipsoids that are proposed.
const MOST: usize = 6;
/// Radius of an ellipsoid as a share of that of the ball that touches the surface.
const FILL: f64 = 0.85;
/// Least radius of a ball as a share of that of the largest, or of the diagonal of the surface, whichever is less: others
/// are in its corners.
const LEAST: [f64; 2] = [0.2, 0.02];
/// Least distance between two balls as a share of the diagonal of the surface: the surface between them has to follow both.
const APART: f64 = 0.12;
/// Largest distance of a point from a ball that touches the surface there, as a share of its radius.
const TOUCH: f64 = 0.01;
/// Maximum number of steps in which a ball shrinks.
const STEPS: usize = 30;

/// Proposes balls inside a closed surface as handles, at least one unless it is flat everywhere.
/// Pauses meanwhile.
pub(super) async fn proposed(surface: &Band, pauses: &Pauses) -> Vec<ControlEllipsoid> {
    let bounds = Bounds::from_points(&surface.walker.mesh().positions);
    let diagonal = f64::from(bounds.min.distance(bounds.max));
    let apart = APART * diagonal;
    let mut balls: Vec<Ball> = Vec::new();
    let component = surface.walker.mesh().component_of_each_vertex();
    for (t, at) in places(surface) {
        // Closest points are hard to tell in the middle of a sphere: one of its balls is enough.
        if !balls.iter().any(|ball| ball.touches(at[0])) {
            let component = component[surface.walker.mesh().triangles[t][0] as usize];
            let ball = inner_ball(surface, at, diagonal, pauses).await;
            balls.extend(ball.map(|ball| Ball { component, ..ball }));
        }
    }
    let largest = balls.iter().map(|ball| ball.radius).fold(0.0, f64::max);
    let least = (LEAST[0] * largest).min(LEAST[1] * diagonal);
    balls.retain(|ball| ball.radius >= least);
    let mut chosen = largest_of_each(&balls);
    while chosen.len() < MOST {
        let best = balls.iter().filter_map(|ball| Some((ball.merit(&chosen, apart)?, ball)));
        // Of equal ones the first, on every machine.
        let Some((_, best)) = best.reduce(|best, other| if other.0 > best.0 { other } else { best }) else {
            break;
        };
        chosen.push(*best);
    }
    chosen.iter().map(Ball::ellipsoid).collect()
}

/// Returns the largest ball of each component, or of the [`MOST`] components with the largest: what has none cannot be moved.
fn largest_of_each(balls: &[Ball]) -> Vec<Ball> {
    let mut chosen: Vec<Ball> = Vec::new();
    for ball in balls {
        match chosen.iter_mut().find(|other| other.component == ball.component) {
            Some(other) if other.radius < ball.radius => *other = *ball,
            Some(_) => {}
            None => chosen.push(*ball),
        }
    }
    chosen.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    // The walls of a cavity are two components around one body.
    let mut apart: Vec<Ball> = Vec::new();
    for ball in chosen {
        if apart.len() < MOST && apart.iter().all(|other| other.gap(&ball) > 0.0) {
            apart.push(ball);
        }
    }
    apart
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    center: DVec3,
    radius: f64,
    /// The component of the surface that it touches.
    component: u32,
}

impl Ball {
    /// Returns how much this ball adds to others: the larger and the further from them, the more; `None` if it is not
    /// `apart` from them.
    fn merit(&self, others: &[Self], apart: f64) -> Option<f64> {
        let gap = others.iter().map(|other| self.gap(other)).fold(f64::INFINITY, f64::min);
        if gap < apart {
            return None;
        }
        Some(if others.is_empty() { self.radius } else { self.radius * gap })
    }

    fn gap(&self, other: &Self) -> f64 {
        other.center.distance(self.center) - other.radius - self.radius
    }

    /// Returns whether a point of the surface is where this ball touches it, or nearly.
    fn touches(&self, at: Vec3) -> bool {
        (at.as_dvec3().distance(self.center) / self.radius - 1.0).abs() < TOUCH
    }

    fn ellipsoid(&self) -> ControlEllipsoid {
        let r = FILL * self.radius;
        ControlEllipsoid {
            center: self.center.to_array(),
            axes: [[r, 0.0, 0.0], [0.0, r, 0.0], [0.0, 0.0, r]],
        }
    }
}

/// Returns points of the surface, spread evenly over its area, with its normals there, each with its triangle.
fn places(surface: &Band) -> impl Iterator<Item = (usize, [Vec3; 2])> {
    let corners = |t: usize| surface.walker.corners(t as u32);
    let count = surface.walker.mesh().triangles.len();
    let area: f64 = (0..count).map(|t| triangle::area(corners(t))).sum();
    let mut passed = 0.0;
    (0..count).filter_map(move |t| {
        let [a, b, c] = corners(t);
        let before = passed;
        passed += triangle::area([a, b, c]) * PLACES as f64 / area;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        (before.floor() < passed.floor() && normal != Vec3::ZERO).then(|| (t, [(a + b + c) / 3.0, normal]))
    })
}

/// Returns the largest ball inside the surface that touches it at a point with a normal (shrinking ball; Ma, Bae & Choi,
/// *3D medial axis point approximation using nearest neighbors and the normal field*, 2012). Pauses meanwhile.
async fn inner_ball(surface: &Band, [at, normal]: [Vec3; 2], diagonal: f64, pauses: &Pauses) -> Option<Ball> {
    let (p, inwards) = (at.as_dvec3(), -normal.as_dvec3());
    let lifted = (p + inwards * (1e-5 * diagonal)).as_vec3();
    let across = surface.walker.tree().ray_hit(lifted, -normal)?;
    let mut ball = Ball { center: p, radius: 0.5 * across.distance, component: 0 };
    for _ in 0..STEPS {
        ball.center = p + inwards * ball.radius;
        // A search takes long where many triangles are about as near.
        pauses.now().await;
        let nearest = surface.walker.closest(ball.center.as_vec3())?;
        if nearest.distance >= ball.radius * (1.0 - 1e-3) {
            return Some(ball);
        }
        let chord = nearest.point.as_dvec3() - p;
        let radius = 0.5 * chord.length_squared() / chord.dot(inwards);
        if !(radius > 0.0 && radius < ball.radius) {
            return None;
        }
        ball.radius = radius;
    }
    None
}
