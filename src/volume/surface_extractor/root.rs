//! Root finding on a lattice edge, to place mesh vertices: the zero of a function between an inside and an outside
//! node.

use super::super::contour::MARGIN;
use super::blocks::{is_inside, nan_to_outside};

/// Convergence threshold of root finding, as a fraction of the lattice edge: a smaller step is not worth an evaluation.
/// Steps shrink so fast that the next one is far below the resolution of `f32` positions.
const CONVERGED: f64 = 1e-6;

/// Largest curvature of the parabola, relative to the difference of the values at the ends of the bracket, for which
/// root finding interpolates by it instead of linearly. At 1 the parabola is level at one end, as when the surface is
/// tangent to the edge. A jump of the function gives a much larger value, and parabolic steps would converge slowly
/// from one side of it.
const MAX_CURVATURE: f64 = 4.0;

/// A sample on a lattice edge: the position as a fraction of the edge, and the function value.
#[derive(Clone, Copy, Debug)]
struct Sample {
    at: f64,
    value: f64,
}

/// Bracketing root finder on a lattice edge: an inside and an outside sample that converge to the zero.
///
/// The estimate is the zero of the parabola through both samples and the one replaced last: on an edge to which the
/// surface is nearly tangent, curvature is as large as slope, and linear interpolation would take many steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    inside: Sample,
    outside: Sample,
    /// The sample that was last replaced, for the parabola; its value is NaN at first.
    before: Sample,
}

impl Root {
    /// Creates a bracket from the function values at the ends of the lattice edge, one of them inside and the other
    /// outside.
    pub fn between(start: f64, end: f64) -> Self {
        let (start, end) = (Sample { at: 0.0, value: start }, Sample { at: 1.0, value: end });
        let (inside, outside) = if is_inside(start.value) { (start, end) } else { (end, start) };
        Self { inside, outside, before: Sample { at: 0.5, value: f64::NAN } }
    }

    /// Creates a converged root at the middle of the lattice edge, used where the edge leads into the padding.
    pub fn fixed() -> Self {
        let (inside, outside) = (Sample { at: 0.5, value: 1.0 }, Sample { at: 0.5, value: -1.0 });
        Self { inside, outside, before: inside }
    }

    /// Returns the estimated position of the zero, as a fraction of the lattice edge; the function is evaluated there
    /// next.
    pub fn estimate(&self) -> f64 {
        let Self { inside, outside, .. } = self;
        inside.at + self.share() * (outside.at - inside.at)
    }

    /// Returns the zero of the interpolating parabola, or line, as a fraction of the way from the inside to the outside
    /// sample; one half if a value is infinite.
    ///
    /// At fraction s, the parabola divided by the difference of the two values is height − s + curvature s (s − 1).
    fn share(&self) -> f64 {
        let Self { inside, outside, before } = self;
        let fall = inside.value - outside.value;
        if !fall.is_finite() {
            return 0.5;
        }
        let height = inside.value / fall;
        let s = (before.at - inside.at) / (outside.at - inside.at);
        let curvature = ((before.value - inside.value) / fall + s) / (s * (s - 1.0));
        if curvature.is_nan() || curvature.abs() > MAX_CURVATURE {
            return height;
        }
        let slope = 1.0 + curvature;
        let share = 2.0 * height / (slope + (slope * slope - 4.0 * curvature * height).sqrt());
        // Rounding can give a zero outside the bracket, and a zero at its end gives 0 / 0.
        if (0.0..=1.0).contains(&share) { share } else { height }
    }

    /// Adds the function value at [`Self::estimate`] and shrinks the bracket.
    pub fn add_sample(&mut self, value: f64) {
        let sample = Sample { at: self.estimate(), value: nan_to_outside(value) };
        let end = if is_inside(sample.value) { &mut self.inside } else { &mut self.outside };
        self.before = std::mem::replace(end, sample);
    }

    /// Returns whether the root has converged: the estimate is within [`CONVERGED`] of an end of the bracket, so that
    /// another evaluation would hardly move it.
    pub fn has_converged(&self) -> bool {
        [self.inside, self.outside].iter().any(|end| (self.estimate() - end.at).abs() <= CONVERGED)
    }

    /// Returns the position of the mesh vertex on the lattice edge, as a fraction of the edge: the estimate, kept
    /// [`MARGIN`] away from both ends.
    pub fn fraction(&self) -> f64 {
        let margin = f64::from(MARGIN);
        self.estimate().clamp(margin, 1.0 - margin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the root of `f` in [0, 1] and the number of evaluations until it converges, at most `most`.
    fn solved(f: impl Fn(f64) -> f64, most: usize) -> (Root, usize) {
        let mut root = Root::between(f(0.0), f(1.0));
        let mut steps = 0;
        while steps < most && !root.has_converged() {
            root.add_sample(f(root.estimate()));
            steps += 1;
        }
        (root, steps)
    }

    #[test]
    fn smooth_functions_take_a_few_steps() {
        for k in 1..100 {
            let zero = f64::from(k) / 100.0;
            for (curvature, most) in [(0.0, 1), (0.01, 2), (0.1, 2), (-0.9, 3)] {
                let f = |t: f64| (t - zero) * (1.0 + curvature * t);
                for sign in [1.0, -1.0] {
                    let (root, steps) = solved(|t| sign * f(t), 10);
                    let error = (root.fraction() - zero).abs();
                    assert!(error < 1e-8 && steps <= most, "{zero}, {curvature}: {error}, {steps}");
                }
            }
        }
    }

    #[test]
    fn steep_and_flat_zeros_take_a_few_more() {
        for k in 1..100 {
            let zero = f64::from(k) / 100.0;
            let (root, steps) = solved(|t| libm::exp(2.0 * t) - libm::exp(2.0 * zero), 10);
            assert!((root.fraction() - zero).abs() < 1e-8 && steps <= 5, "{zero}: {steps}");
            let (root, steps) = solved(|t| t * t * (1.0 + 0.05 * t) - zero * zero * (1.0 + 0.05 * zero), 10);
            assert!((root.fraction() - zero).abs() < 1e-8 && steps <= 4, "{zero}: {steps}");
        }
    }

    #[test]
    fn jumps_are_closed_in_on() {
        let (root, _) = solved(|t| if t < 0.3 { 1.0 } else { -1.0 }, 12);
        assert!((root.estimate() - 0.3).abs() < 0.01);
        let (root, _) = solved(|t| if t < 0.3 { 1.0 } else { -1e9 * t }, 12);
        assert!(root.estimate() <= 0.3);
        let (root, _) = solved(|t| if t < 0.7 { f64::NEG_INFINITY } else { 1.0 }, 12);
        assert!((root.estimate() - 0.7).abs() <= 1.0 / 4096.0);
    }

    #[test]
    fn every_estimate_stays_between_values_of_different_sign() {
        let f = |t: f64| (t - 0.2) * (t - 0.5) * (t - 0.55) * if t > 0.9 { 1e9 } else { 1.0 };
        let mut root = Root::between(f(0.0), f(1.0));
        for _ in 0..20 {
            let ends = [root.inside.at, root.outside.at];
            assert!(is_inside(f(ends[0])) && !is_inside(f(ends[1])));
            assert!((root.estimate() - ends[0]) * (root.estimate() - ends[1]) <= 0.0);
            root.add_sample(f(root.estimate()));
        }
    }

    #[test]
    fn an_exact_zero_stays_one_whatever_the_bend() {
        for (start, middle, end) in
            [(1.0, 0.0, -3.0), (0.0, 1.0, -1.0), (-1e-320, 4.0, 1.0), (1.0, -1e-320, -1.0)]
        {
            for [start, end] in [[start, end], [end, start]] {
                let mut root = Root::between(start, end);
                for value in [middle, 0.0, middle, -1.0, 0.0] {
                    root.add_sample(value);
                    assert!((0.0..=1.0).contains(&root.estimate()), "{root:?}");
                }
            }
        }
        let zero = Sample { at: 0.5, value: 0.0 };
        let bent = Root {
            inside: zero,
            outside: Sample { at: 1.0, value: -1.0 },
            before: Sample { at: 0.0, value: -3.0 },
        };
        assert!(bent.estimate() == 0.5 && bent.has_converged());
    }

    #[test]
    fn vertices_keep_off_the_ends() {
        assert_eq!(Root::between(0.0, -1.0).fraction(), 1.0 / 256.0);
        assert_eq!(Root::between(-1.0, 0.0).fraction(), 255.0 / 256.0);
        assert_eq!(Root::between(3.0, -1.0).fraction(), 0.75);
        assert!(Root::between(0.0, -1.0).has_converged());
        assert!(Root::fixed().has_converged() && Root::fixed().fraction() == 0.5);
    }
}
