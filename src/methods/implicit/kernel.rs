//! The radial functions (paper, section V and equation 6).
//!
//! The multi-order function minimises first, second and third order energy at once: it is the fundamental solution of
//! −δ²Δf + Δ²f − τ²Δ³f = 0. (The paper prints δ and τ without the squares; its own equation 6 has them.)

use super::params::{ImplicitParams, KernelKind};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A radial function and its parameters, in units of the box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Kernel {
    /// Equation 6. 1/(4πδ²r) far away, which is not small: it falls to a thousandth only a hundred units off.
    MultiOrder {
        /// δ, an inverse length: more of it, a tighter surface.
        delta: f64,
        /// τ, a length: more of it, a smoother surface.
        tau: f64,
    },
    /// |r|³, for comparison: the paper's thin plate (triharmonic in three dimensions).
    ThinPlate {
        /// Radius of a ball that holds all centres.
        radius: f64,
    },
    /// −|r|, for comparison: what a thin plate is in three dimensions.
    Biharmonic {
        /// Radius of a ball that holds all centres.
        radius: f64,
    },
    /// exp(−r²/2σ²), for comparison.
    Gaussian {
        /// σ, a length.
        sigma: f64,
    },
}

impl Kernel {
    /// The function that `params` ask for, over centres in a ball of `radius`.
    pub fn new(params: &ImplicitParams, radius: f64) -> Self {
        match params.kernel {
            KernelKind::MultiOrder => Self::MultiOrder { delta: params.delta, tau: params.tau },
            KernelKind::ThinPlate => Self::ThinPlate { radius },
            KernelKind::Biharmonic => Self::Biharmonic { radius },
            KernelKind::Gaussian => Self::Gaussian { sigma: params.sigma },
        }
    }

    /// How many polynomials it needs beside it: 1 for the constant, 4 with x, y and z.
    pub fn polynomials(&self) -> usize {
        if matches!(self, Self::ThinPlate { .. }) { 4 } else { 1 }
    }

    /// Whether it is positive definite only between weights that are orthogonal to the polynomials; it then grows with the
    /// distance.
    pub fn is_conditional(&self) -> bool {
        matches!(self, Self::ThinPlate { .. } | Self::Biharmonic { .. })
    }

    /// φ(r).
    ///
    /// r³ and −r are only conditionally positive definite. To both is added what makes them positive definite between
    /// points of the ball and vanishes in every sum whose weights are orthogonal to the polynomials: a constant, and for r³
    /// a multiple of r². So one solver does for all kernels. The amounts are those at which spherical harmonics of degree 0
    /// and 1 get positive eigenvalues on the sphere, with some room.
    pub fn value(&self, r: f64) -> f64 {
        self.value_and_slope(r)[0]
    }

    /// φ(r), and dφ/d(r²) = φ′(r)/2r, which has a limit at 0.
    pub fn value_and_slope(&self, r: f64) -> [f64; 2] {
        match *self {
            Self::MultiOrder { delta, tau } => multi_order(delta, tau, r),
            Self::ThinPlate { radius } => {
                let (constant, square) = (8.0 * radius * radius * radius, 3.0 * radius);
                [r * r * r - square * r * r + constant, 1.5 * r - square]
            }
            // The slope of a cone has no limit at its tip.
            Self::Biharmonic { radius } => [2.0 * radius - r, if r > 0.0 { -0.5 / r } else { 0.0 }],
            Self::Gaussian { sigma } => {
                let half = 0.5 / (sigma * sigma);
                let value = libm::exp(-half * r * r);
                [value, -half * value]
            }
        }
    }
}

/// Below this many decay lengths the closed form cancels, and the series has converged in [`TERMS`].
const SERIES_BELOW: f64 = 0.5;
/// Terms of the series: 0.5²⁰/20! is below rounding in every regime, as |b| is below 2a.
const TERMS: usize = 20;

/// Equation 6 in real numbers: φ(r) = (1 − g(r)) / (4πδ²r), g(r) = e^(−ar) (C(br) + κ r S(br)), where
/// a = √(1+2δτ)/2τ, b² = (1−2δτ)/4τ², κ = 1/4aτ², and C, S are cosh and sinh x/x, or cos and sin x/x where b² < 0.
///
/// g solves g″ + 2a g′ + (δ/τ) g = 0, which gives its series.
fn multi_order(delta: f64, tau: f64, r: f64) -> [f64; 2] {
    let product = 2.0 * delta * tau;
    let a = (1.0 + product).sqrt() / (2.0 * tau);
    let kappa = 1.0 / (4.0 * a * tau * tau);
    let scale = 1.0 / (4.0 * PI * delta * delta);
    if a * r < SERIES_BELOW {
        return near_centre(a, delta / tau, kappa, scale, r);
    }
    let b_squared = (1.0 - product) / (4.0 * tau * tau);
    let [cosine, sine] = damped(a, b_squared, delta / tau, r);
    let g = cosine + kappa * sine;
    let g_slope = b_squared * sine + kappa * cosine - a * g;
    let value = scale * (1.0 - g) / r;
    [value, -(scale * g_slope + value) / (2.0 * r * r)]
}

/// e^(−ar) C(br) and e^(−ar) r S(br), without overflow and through b = 0. `product` is a² − b².
fn damped(a: f64, b_squared: f64, product: f64, r: f64) -> [f64; 2] {
    let b = b_squared.abs().sqrt();
    let x = b * r;
    if x < 0.1 {
        // Both C and S are power series in b²r².
        let (y, envelope) = (b_squared * r * r, libm::exp(-a * r));
        let cosine = 1.0 + y / 2.0 * (1.0 + y / 12.0 * (1.0 + y / 30.0 * (1.0 + y / 56.0)));
        let sine = 1.0 + y / 6.0 * (1.0 + y / 20.0 * (1.0 + y / 42.0 * (1.0 + y / 72.0)));
        return [envelope * cosine, envelope * r * sine];
    }
    if b_squared < 0.0 {
        let envelope = libm::exp(-a * r);
        return [envelope * libm::cos(x), envelope * libm::sin(x) / b];
    }
    // a − b as a quotient: the difference cancels where τ is small.
    let (slow, fast) = (libm::exp(-product / (a + b) * r), libm::exp(-(a + b) * r));
    [0.5 * (slow + fast), 0.5 * (slow - fast) / b]
}

/// φ = −scale Σ gₖ rᵏ⁻¹, k from 1; φ(0) = 1/(4πδ√(1+2δτ)).
fn near_centre(a: f64, product: f64, kappa: f64, scale: f64, r: f64) -> [f64; 2] {
    let mut g = [0.0; TERMS + 2];
    (g[0], g[1]) = (1.0, kappa - a);
    for k in 0..TERMS {
        let order = k as f64;
        g[k + 2] = -(2.0 * a * (order + 1.0) * g[k + 1] + product * g[k]) / ((order + 1.0) * (order + 2.0));
    }
    let (mut value, mut slope) = (0.0, 0.0);
    for k in (3..TERMS + 2).rev() {
        value = (value + g[k]) * r;
        slope = slope * r + g[k] * (k - 1) as f64;
    }
    // g₂ = 0: the function is flat at its centre.
    [-scale * (value * r + g[1]), -0.5 * scale * slope]
}

/// A kernel as a table over r², for sums with millions of terms: a cubic on each of 32 equal parts of every octave, so
/// that resolution follows the distance. Off by less than 1e-9 of φ(0).
#[derive(Clone, Debug)]
pub struct KernelTable {
    kernel: Kernel,
    /// Value and slope at the centre.
    centre: [f64; 2],
    pieces: Vec<[f64; 4]>,
}

/// Parts of an octave of r², as bits. Four less and the error passes 1e-6.
const PART_BITS: u32 = 5;
/// The bits of a number below those that choose its piece.
const SHIFT: u32 = 52 - PART_BITS;
/// r² from which on the table holds; nearer, value and slope at the centre do. √LEAST is 1e-6.
const LEAST: f64 = 1.0 / (1_u64 << 40) as f64;
/// r² up to which the table holds; the box and all that is placed around it are within it.
const MOST: f64 = 256.0;

impl KernelTable {
    /// The table of `kernel`.
    pub fn new(kernel: Kernel) -> Self {
        let pieces = (piece(LEAST)..=piece(MOST)).map(|index| {
            let [from, to] = [index, index + 1].map(|bits| f64::from_bits(bits << SHIFT));
            cubic(kernel.value_and_slope(from.sqrt()), kernel.value_and_slope(to.sqrt()), to - from)
        });
        Self { kernel, centre: kernel.value_and_slope(0.0), pieces: pieces.collect() }
    }

    /// The function that is tabled.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// φ at the squared distance `s`.
    #[inline]
    pub fn value(&self, s: f64) -> f64 {
        match self.pieces.get(piece(s).wrapping_sub(piece(LEAST)) as usize) {
            Some(&[c0, c1, c2, c3]) => {
                let d = s - knot(s);
                c0 + d * (c1 + d * (c2 + d * c3))
            }
            None => self.beyond(s)[0],
        }
    }

    /// φ and dφ/ds at the squared distance `s`.
    #[inline]
    pub fn value_and_slope(&self, s: f64) -> [f64; 2] {
        match self.pieces.get(piece(s).wrapping_sub(piece(LEAST)) as usize) {
            Some(&[c0, c1, c2, c3]) => {
                let d = s - knot(s);
                [c0 + d * (c1 + d * (c2 + d * c3)), c1 + d * (2.0 * c2 + d * 3.0 * c3)]
            }
            None => self.beyond(s),
        }
    }

    #[cold]
    fn beyond(&self, s: f64) -> [f64; 2] {
        if s < LEAST {
            [self.centre[0] + s * self.centre[1], self.centre[1]]
        } else {
            self.kernel.value_and_slope(s.sqrt())
        }
    }
}

/// The piece of the table that a number falls in, counted from that of 0.
#[inline]
fn piece(s: f64) -> u64 {
    s.to_bits() >> SHIFT
}

/// Where the piece of `s` begins.
#[inline]
fn knot(s: f64) -> f64 {
    f64::from_bits(s.to_bits() >> SHIFT << SHIFT)
}

/// Coefficients of the cubic with these values and slopes at both ends of a stretch.
fn cubic([a, slope_a]: [f64; 2], [b, slope_b]: [f64; 2], width: f64) -> [f64; 4] {
    let rise = (b - a) / width;
    [
        a,
        slope_a,
        (3.0 * rise - 2.0 * slope_a - slope_b) / width,
        (slope_a + slope_b - 2.0 * rise) / (width * width),
    ]
}
