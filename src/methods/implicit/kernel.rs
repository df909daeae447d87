//! The radial basis functions (kernels) from which the implicit function is built (Dinh, Turk & Slabaugh, section V and
//! equation 6).
//!
//! The multi-order kernel minimises first, second and third order energy at once: it is the fundamental solution of
//! −δ²Δf + Δ²f − τ²Δ³f = 0. (The paper prints δ and τ without the squares; its own equation 6 has them.)

use super::params::{ImplicitParams, KernelKind};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A radial basis function φ with its parameters, in units of the normalised box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Kernel {
    /// The multi-order kernel of Dinh, Turk & Slabaugh (equation 6). It decays only as 1/(4πδ²r), with the default δ
    /// and τ to about two thousandths of φ(0) at a distance of a hundred units, so it must not be truncated.
    MultiOrder {
        /// δ, an inverse length in units of the normalised box: a larger value makes the surface tighter.
        delta: f64,
        /// τ, a length in units of the normalised box: a larger value makes the surface smoother.
        tau: f64,
    },
    /// |r|³, for comparison: the thin plate of Dinh, Turk & Slabaugh (triharmonic in three dimensions).
    ThinPlate {
        /// Radius of a ball that contains all centres: the kernel is shifted so that it is positive definite there.
        radius: f64,
    },
    /// −|r|, for comparison: the true thin plate of three dimensions (biharmonic).
    Biharmonic {
        /// Radius of a ball that contains all centres: the kernel is shifted so that it is positive definite there.
        radius: f64,
    },
    /// The Gaussian exp(−r²/2σ²), for comparison.
    Gaussian {
        /// σ, the width of the Gaussian: a length in units of the normalised box.
        sigma: f64,
    },
}

impl Kernel {
    /// Creates the kernel that `params` select, with `delta`, δ, as it is given or chosen, for constraints whose centres are
    /// in a ball of `radius`, in units of the normalised box.
    pub fn new(params: &ImplicitParams, delta: f64, radius: f64) -> Self {
        match params.kernel {
            KernelKind::MultiOrder => Self::MultiOrder { delta, tau: params.tau },
            KernelKind::ThinPlate => Self::ThinPlate { radius },
            KernelKind::Biharmonic => Self::Biharmonic { radius },
            KernelKind::Gaussian => Self::Gaussian { sigma: params.sigma },
        }
    }

    /// Returns the number of polynomials that the implicit function f has besides its kernel terms: 1 (the constant),
    /// or 4 for a thin plate (with x, y and z).
    pub fn polynomials(&self) -> usize {
        if matches!(self, Self::ThinPlate { .. }) { 4 } else { 1 }
    }

    /// Returns whether the kernel is only conditionally positive definite, that is, for weights orthogonal to the
    /// polynomials. The absolute value of such a kernel grows with the distance, so that large terms cancel in sums,
    /// which need more precision.
    pub fn is_conditional(&self) -> bool {
        matches!(self, Self::ThinPlate { .. } | Self::Biharmonic { .. })
    }

    /// Returns the kernel φ(r) and its derivative by r², dφ/d(r²) = φ′(r)/2r; at r = 0 the limit of that, or 0 for −r,
    /// which has none.
    ///
    /// r³ and −r are only conditionally positive definite. Both are shifted by terms that make them positive definite
    /// between points of the ball that contains all centres, and that vanish in every sum whose weights are orthogonal
    /// to the polynomials: a constant, and for r³ a multiple of r². Thus one solver serves all kernels. The shifts are
    /// those at which spherical harmonics of degree 0 and 1 get positive eigenvalues on the sphere, with some margin.
    pub fn value_and_slope(&self, r: f64) -> [f64; 2] {
        match *self {
            Self::MultiOrder { delta, tau } => multi_order(delta, tau, r),
            Self::ThinPlate { radius } => {
                let (constant, square) = (8.0 * radius * radius * radius, 3.0 * radius);
                [r * r * r - square * r * r + constant, 1.5 * r - square]
            }
            // A cone has no slope at its tip; 0 is returned there.
            Self::Biharmonic { radius } => [2.0 * radius - r, if r > 0.0 { -0.5 / r } else { 0.0 }],
            Self::Gaussian { sigma } => {
                let half = 0.5 / (sigma * sigma);
                let value = libm::exp(-half * r * r);
                [value, -half * value]
            }
        }
    }
}

#[cfg(test)]
impl Kernel {
    /// Returns the kernel φ at the distance `r`, for tests.
    pub fn value(&self, r: f64) -> f64 {
        self.value_and_slope(r)[0]
    }
}

/// Distance r, in decay lengths 1/a (see [`multi_order`]), below which the closed form of the multi-order kernel
/// suffers from cancellation, and its power series is used; there the series has converged in [`TERMS`] terms.
const SERIES_BELOW: f64 = 0.5;
/// Number of terms of the power series of the multi-order kernel: 0.5²⁰/20! is below rounding for all parameters, as
/// |b| is below 2a.
const TERMS: usize = 20;

/// Returns φ(r) and dφ/d(r²) of the multi-order kernel, by equation 6 in real numbers: φ(r) = (1 − g(r)) / (4πδ²r),
/// g(r) = e^(−ar) (C(br) + κ r S(br)), where a = √(1+2δτ)/2τ, b² = (1−2δτ)/4τ², κ = 1/4aτ², and C(x) and S(x) are cosh
/// x and (sinh x)/x, or where b² < 0, with |b| for b, cos x and (sin x)/x.
///
/// g solves g″ + 2a g′ + (δ/τ) g = 0, from which its power series follows.
fn multi_order(delta: f64, tau: f64, r: f64) -> [f64; 2] {
    let product = 2.0 * delta * tau;
    let a = (1.0 + product).sqrt() / (2.0 * tau);
    let kappa = 1.0 / (4.0 * a * tau * tau);
    let scale = 1.0 / (4.0 * PI * delta * delta);
    if a * r < SERIES_BELOW {
        return near_centre(a, delta / tau, kappa, scale, r);
    }
    let b_squared = (1.0 - product) / (4.0 * tau * tau);
    let [cosine, sine] = damped_terms(a, b_squared, delta / tau, r);
    let g = cosine + kappa * sine;
    let g_slope = b_squared * sine + kappa * cosine - a * g;
    let value = scale * (1.0 - g) / r;
    [value, -(scale * g_slope + value) / (2.0 * r * r)]
}

/// Returns e^(−ar) C(br) and e^(−ar) r S(br) of [`multi_order`], without overflow and for b² of either sign or 0;
/// `product` is a² − b².
fn damped_terms(a: f64, b_squared: f64, product: f64, r: f64) -> [f64; 2] {
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
    // a − b as (a² − b²)/(a + b): the difference cancels for small τ.
    let (slow, fast) = (libm::exp(-product / (a + b) * r), libm::exp(-(a + b) * r));
    [0.5 * (slow + fast), 0.5 * (slow - fast) / b]
}

/// Returns φ(r) and dφ/d(r²) of the multi-order kernel near its centre, from the power series φ = −scale Σ gₖ rᵏ⁻¹, k
/// from 1; `product` is a² − b², `scale` is 1/(4πδ²), and φ(0) = 1/(4πδ√(1+2δτ)).
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
    // g₂ = 0: φ has no linear term.
    [-scale * (value * r + g[1]), -0.5 * scale * slope]
}

/// A kernel tabulated over s = r², for sums with millions of terms: a cubic on each of 32 equal intervals of every
/// octave, so that the resolution follows the distance. The error is less than 1e-7 of φ(0).
#[derive(Clone, Debug)]
pub struct KernelTable {
    kernel: Kernel,
    /// The kernel φ and its derivative dφ/ds, where s = r², at r = 0, for distances below the table.
    centre: [f64; 2],
    cubics: Vec<[f64; 4]>,
}

/// Base-2 logarithm of the number of intervals into which the table divides an octave of r². With a quarter of the
/// intervals, the table's error exceeds 1e-6.
const PART_BITS: u32 = 5;
/// Number of low bits of a squared distance, as an `f64`, that do not affect the choice of its interval in the table.
const SHIFT: u32 = 52 - PART_BITS;
/// Lower end of a [`KernelTable`], as a squared distance r² (r is about 1e-6); below it, φ is extrapolated linearly in
/// r² from 0.
const TABLE_START: f64 = 1.0 / (1_u64 << 40) as f64;
/// Upper end of a [`KernelTable`], as a squared distance r²: r = 16 units of the normalised box, beyond the distances
/// between any points in the box and around it. Farther away, the kernel itself is evaluated.
const TABLE_END: f64 = 256.0;

impl KernelTable {
    /// Tabulates `kernel` over the squared distance, for fast evaluation.
    pub fn new(kernel: Kernel) -> Self {
        let cubics = (interval(TABLE_START)..=interval(TABLE_END)).map(|index| {
            let [from, to] = [index, index + 1].map(|bits| f64::from_bits(bits << SHIFT));
            cubic(kernel.value_and_slope(from.sqrt()), kernel.value_and_slope(to.sqrt()), to - from)
        });
        Self { kernel, centre: kernel.value_and_slope(0.0), cubics: cubics.collect() }
    }

    /// Returns the kernel that is tabulated.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Returns the kernel φ at the squared distance `s`, from the table, or beyond its upper end from the kernel
    /// itself.
    #[inline]
    pub fn value(&self, s: f64) -> f64 {
        match self.cubics.get(interval(s).wrapping_sub(interval(TABLE_START)) as usize) {
            Some(&[c0, c1, c2, c3]) => {
                let d = s - interval_start(s);
                c0 + d * (c1 + d * (c2 + d * c3))
            }
            None => self.outside_table(s)[0],
        }
    }

    /// Returns the kernel φ and its derivative dφ/ds at the squared distance `s`, from the table, or beyond its upper
    /// end from the kernel itself.
    #[inline]
    pub fn value_and_slope(&self, s: f64) -> [f64; 2] {
        match self.cubics.get(interval(s).wrapping_sub(interval(TABLE_START)) as usize) {
            Some(&[c0, c1, c2, c3]) => {
                let d = s - interval_start(s);
                [c0 + d * (c1 + d * (c2 + d * c3)), c1 + d * (2.0 * c2 + d * 3.0 * c3)]
            }
            None => self.outside_table(s),
        }
    }

    #[cold]
    fn outside_table(&self, s: f64) -> [f64; 2] {
        if s < TABLE_START {
            [self.centre[0] + s * self.centre[1], self.centre[1]]
        } else {
            self.kernel.value_and_slope(s.sqrt())
        }
    }
}

/// Returns the number of the interval of a [`KernelTable`] that contains the squared distance `s`, counted from the one
/// that contains 0: the leading bits of `s`. It may be outside the table.
#[inline]
fn interval(s: f64) -> u64 {
    s.to_bits() >> SHIFT
}

/// Returns the lower end of the interval of a [`KernelTable`] that contains the squared distance `s`.
#[inline]
fn interval_start(s: f64) -> f64 {
    f64::from_bits(s.to_bits() >> SHIFT << SHIFT)
}

/// Returns the coefficients, constant first, of the cubic with the given values and slopes at both ends of an interval
/// of the table (Hermite interpolation), as a function of the distance from its lower end.
fn cubic([a, slope_a]: [f64; 2], [b, slope_b]: [f64; 2], width: f64) -> [f64; 4] {
    let rise = (b - a) / width;
    [
        a,
        slope_a,
        (3.0 * rise - 2.0 * slope_a - slope_b) / width,
        (slope_a + slope_b - 2.0 * rise) / (width * width),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Random};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Reference values of the multi-order kernel, rows of δ, τ, r and φ(r): equation 6 in complex arithmetic of 60
    /// digits, by mpmath, with v, w = (1 ± √(1 − 4δ²τ²)) / 2τ² and at 2δτ = 1 the limit: (1 + (w e^(−r√v) − v e^(−r√w))
    /// / (v − w)) / 4πδ²r.
    const REFERENCE: &[(f64, f64, f64, f64)] = &[
        (5.0, 0.025, 1e-06, 0.014235250867869038),
        (5.0, 0.025, 0.001, 0.014234781622721626),
        (5.0, 0.025, 0.01, 0.014192704905484573),
        (5.0, 0.025, 0.1, 0.012296475544339361),
        (5.0, 0.025, 1.0, 0.0031621579746089054),
        (5.0, 0.025, 4.0, 0.0007957747140398347),
        (5.0, 0.005, 1e-06, 0.015531932054761508),
        (5.0, 0.005, 0.001, 0.01552947089629428),
        (5.0, 0.005, 0.01, 0.01536629038998537),
        (5.0, 0.005, 0.1, 0.012515450471339057),
        (5.0, 0.005, 1.0, 0.003161671423780735),
        (5.0, 0.005, 4.0, 0.0007957747138284726),
        (40.0, 0.025, 1e-06, 0.0011486018651557781),
        (40.0, 0.025, 0.001, 0.0011483008280710424),
        (40.0, 0.025, 0.01, 0.0011228149397052543),
        (40.0, 0.025, 0.1, 0.0004956648452511336),
        (40.0, 0.025, 1.0, 4.973591971621725e-05),
        (40.0, 0.025, 4.0, 1.2433979929054323e-05),
        (40.0, 0.005, 1e-06, 0.0016813809641981698),
        (40.0, 0.005, 0.001, 0.00167926654585554),
        (40.0, 0.005, 0.01, 0.0015497448114608575),
        (40.0, 0.005, 0.1, 0.000488621404237994),
        (40.0, 0.005, 1.0, 4.973591971621729e-05),
        (40.0, 0.005, 4.0, 1.2433979929054323e-05),
        (10.0, 0.01, 1e-06, 0.00726439603794614),
        (10.0, 0.01, 0.001, 0.00726321780875774),
        (10.0, 0.01, 0.01, 0.007170786733685529),
        (10.0, 0.01, 0.1, 0.0050150911948760556),
        (10.0, 0.01, 1.0, 0.0007957400261076077),
        (10.0, 0.01, 4.0, 0.00019894367886486917),
        (20.0, 0.025, 1e-06, 0.00281348848761583),
        (20.0, 0.025, 0.001, 0.0028131186166230307),
        (20.0, 0.025, 0.01, 0.0027808572383786),
        (20.0, 0.025, 0.1, 0.001705556304491615),
        (20.0, 0.025, 1.0, 0.00019894367886330166),
        (20.0, 0.025, 4.0, 4.973591971621729e-05),
        (20.0000001, 0.025, 1e-06, 0.002813488470031527),
        (20.0000001, 0.025, 0.001, 0.0028131185990391966),
        (20.0000001, 0.025, 0.01, 0.0027808572208410025),
        (20.0000001, 0.025, 0.1, 0.0017055562903777704),
        (20.0000001, 0.025, 1.0, 0.00019894367687386488),
        (20.0000001, 0.025, 4.0, 4.97359192188581e-05),
        (19.9999, 0.025, 1e-06, 0.0028135060720133956),
        (19.9999, 0.025, 0.001, 0.0028131362005516997),
        (19.9999, 0.025, 0.01, 0.0027808747760705715),
        (19.9999, 0.025, 0.1, 0.0017055704184219694),
        (19.9999, 0.025, 1.0, 0.0001989456683150105),
        (19.9999, 0.025, 4.0, 4.973641707914467e-05),
        (20.001, 0.025, 1e-06, 0.002813312654036412),
        (20.001, 0.025, 0.001, 0.00281294278773248),
        (20.001, 0.025, 0.01, 0.002780681871845437),
        (20.001, 0.025, 0.1, 0.0017054151746090254),
        (20.001, 0.025, 1.0, 0.0001989237859873999),
        (20.001, 0.025, 4.0, 4.97309464972402e-05),
        (0.1, 1.0, 1e-06, 0.726439603915672),
        (0.1, 1.0, 0.001, 0.7264395918116724),
        (0.1, 1.0, 0.01, 0.7264383964920909),
        (0.1, 1.0, 0.1, 0.726321780875774),
        (0.1, 1.0, 1.0, 0.7170786733685529),
        (0.1, 1.0, 4.0, 0.6452514478455629),
        (100.0, 1.0, 1e-06, 5.612962067511105e-05),
        (100.0, 1.0, 0.001, 5.6128688493372464e-05),
        (100.0, 1.0, 0.01, 5.603933981568448e-05),
        (100.0, 1.0, 0.1, 4.9628299807175105e-05),
        (100.0, 1.0, 1.0, 7.952957640704265e-06),
        (100.0, 1.0, 4.0, 1.9894367886496544e-06),
        (0.1, 0.001, 1e-06, 0.7956951499093041),
        (0.1, 0.001, 0.001, 0.7956846374286406),
        (0.1, 0.001, 0.01, 0.79536901524027),
        (0.1, 0.001, 0.1, 0.7918082877856628),
        (0.1, 0.001, 1.0, 0.7572796974437918),
        (0.1, 0.001, 4.0, 0.6558774182282311),
    ];

    fn multi(delta: f64, tau: f64) -> Kernel {
        Kernel::MultiOrder { delta, tau }
    }

    fn at_centre(delta: f64, tau: f64) -> f64 {
        1.0 / (4.0 * PI * delta * (1.0 + 2.0 * delta * tau).sqrt())
    }

    /// Returns random points in the unit ball, each with another close to it, as ill-conditioned input for tests.
    fn points(count: usize, seed: u64) -> Vec<DVec3> {
        let mut random = Random::new(seed);
        let mut found = Vec::new();
        while found.len() < count {
            let p = DVec3::from([0; 3].map(|_| 2.0 * random.unit() - 1.0));
            if p.length() < 0.95 {
                found.push(p);
                found.push(p + DVec3::new(random.unit(), 0.5, random.unit()) * 0.01);
            }
        }
        found
    }

    #[test]
    fn sixty_digits_agree() {
        let mut worst: f64 = 0.0;
        for &(delta, tau, r, expected) in REFERENCE {
            let found = multi(delta, tau).value(r);
            let off = (found / expected - 1.0).abs();
            worst = if off > worst { off } else { worst };
            assert!(off < 1e-10, "δ {delta}, τ {tau}, r {r}: {found} for {expected}");
        }
        println!("{worst:e}");
    }

    #[derive(Clone, Copy)]
    struct Complex(f64, f64);

    impl Complex {
        fn times(self, other: Self) -> Self {
            Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
        }
        fn minus(self, other: Self) -> Self {
            Self(self.0 - other.0, self.1 - other.1)
        }
        fn over(self, other: Self) -> Self {
            let size = other.0 * other.0 + other.1 * other.1;
            let product = self.times(Self(other.0, -other.1));
            Self(product.0 / size, product.1 / size)
        }
        fn sqrt(self) -> Self {
            let size = (self.0 * self.0 + self.1 * self.1).sqrt();
            let (real, imaginary) = ((0.5 * (size + self.0)).sqrt(), (0.5 * (size - self.0)).max(0.0).sqrt());
            Self(real, if self.1 < 0.0 { -imaginary } else { imaginary })
        }
        fn exp(self) -> Self {
            let size = libm::exp(self.0);
            Self(size * libm::cos(self.1), size * libm::sin(self.1))
        }
        fn scaled(self, by: f64) -> Self {
            Self(self.0 * by, self.1 * by)
        }
    }

    fn equation_six(delta: f64, tau: f64, r: f64) -> f64 {
        let root = Complex(1.0 - 4.0 * delta * delta * tau * tau, 0.0).sqrt();
        let half = 0.5 / (tau * tau);
        let v = Complex(1.0 + root.0, root.1).scaled(half);
        let w = Complex(1.0 - root.0, -root.1).scaled(half);
        let [of_v, of_w] = [v, w].map(|k| k.sqrt().scaled(-r).exp());
        let sum = w.times(of_v).minus(v.times(of_w)).over(v.minus(w));
        (1.0 + sum.0) / (4.0 * PI * delta * delta * r)
    }

    #[test]
    fn equation_six_in_complex_numbers_agrees() {
        let mut random = Random::new(1);
        for _ in 0..20_000 {
            let (delta, tau) = (5.0 + 35.0 * random.unit(), 0.005 + 0.02 * random.unit());
            let r = 0.02 + 3.98 * random.unit();
            // Near b = 0 equation 6 itself suffers from cancellation; `sixty_digits_agree` covers that.
            if (2.0 * delta * tau - 1.0).abs() > 1e-3 {
                let (found, expected) = (multi(delta, tau).value(r), equation_six(delta, tau, r));
                let off = (found / expected - 1.0).abs();
                assert!(off < 1e-6, "δ {delta}, τ {tau}, r {r}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn flat_at_the_centre_then_cubic() {
        for (delta, tau) in [(5.0, 0.025), (10.0, 0.01), (20.0, 0.025), (40.0, 0.025), (40.0, 0.005)] {
            let kernel = multi(delta, tau);
            let top = kernel.value(0.0);
            assert!((top / at_centre(delta, tau) - 1.0).abs() < 1e-14);
            // φ(0) − φ(r) = q r² − r³/96πτ² + …, where q is minus the slope at 0.
            let q = -kernel.value_and_slope(0.0)[1];
            assert!(q > 0.0);
            let cubic = |r: f64| (q * r * r - (top - kernel.value(r))) / (r * r * r);
            // The next term is r⁴, so the error doubles with the radius, and extrapolation removes it.
            let r = 0.02 * tau;
            let (near, far) = (cubic(r), cubic(2.0 * r));
            let found = 2.0 * near - far;
            let expected = 1.0 / (96.0 * PI * tau * tau);
            assert!((found / expected - 1.0).abs() < 0.01, "δ {delta}, τ {tau}: {found} for {expected}");
        }
    }

    #[test]
    fn falls_without_end_and_stays_above_zero() {
        for (delta, tau) in
            [(0.1, 0.001), (5.0, 0.025), (20.0, 0.025), (19.99, 0.025), (40.0, 0.025), (10.0, 0.01)]
        {
            let mut before = multi(delta, tau).value(0.0);
            for k in 1..4000 {
                let r = 1e-3 * f64::from(k);
                let [value, slope] = multi(delta, tau).value_and_slope(r);
                assert!(value > 0.0 && value < before && slope < 0.0, "δ {delta}, τ {tau}, r {r}");
                before = value;
            }
            for r in [30.0, 1e3, 1e8] {
                let value = multi(delta, tau).value(r * delta.max(1.0 / delta));
                let tail = 1.0 / (4.0 * PI * delta * delta * r * delta.max(1.0 / delta));
                assert!((value / tail - 1.0).abs() < 1e-2, "δ {delta}, r {r}: {value} for {tail}");
            }
        }
        // The tail is within 0.7 % of the kernel from r = 0.5 on.
        let (value, tail) = (multi(10.0, 0.01).value(0.5), 1.0 / (200.0 * PI));
        assert!((value / tail - 1.0).abs() < 0.007);
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        let radius = 1.5;
        for kernel in [
            multi(5.0, 0.025),
            multi(20.0, 0.025),
            multi(20.000_001, 0.025),
            multi(40.0, 0.025),
            multi(0.1, 0.001),
            multi(100.0, 1.0),
            Kernel::ThinPlate { radius },
            Kernel::Biharmonic { radius },
            Kernel::Gaussian { sigma: 0.07 },
        ] {
            for k in 1..400 {
                let r = 0.005 * f64::from(k);
                let h = 1e-3 * r;
                let [value, slope] = kernel.value_and_slope(r);
                let rise = (kernel.value(r + h) - kernel.value(r - h)) / (2.0 * h);
                let rounding = 1e-12 * kernel.value(0.0) / h;
                let off = (2.0 * r * slope - rise).abs();
                assert!(off < 1e-4 * rise.abs() + rounding, "{kernel:?} at {r}: {slope}, {rise}, {value}");
            }
        }
    }

    #[test]
    fn the_table_is_the_function() {
        let mut random = Random::new(2);
        for kernel in [
            multi(5.0, 0.025),
            multi(20.0, 0.025),
            multi(40.0, 0.005),
            multi(40.0, 0.025),
            multi(0.1, 0.001),
            multi(100.0, 1.0),
            multi(100.0, 0.001),
            Kernel::ThinPlate { radius: 2.0 },
            Kernel::Biharmonic { radius: 2.0 },
            Kernel::Gaussian { sigma: 0.07 },
            Kernel::Gaussian { sigma: 0.005 },
        ] {
            let table = KernelTable::new(kernel);
            let top = kernel.value(0.0);
            let (mut worst, mut steepest, mut off_slope): (f64, f64, f64) = (0.0, 0.0, 0.0);
            for k in 0..200_000 {
                // Distances from below the start of the table to beyond its end.
                let s = match kernel {
                    // Within the ball, and not nearer than 1e-6, where the table is flat but a cone is not.
                    Kernel::ThinPlate { .. } | Kernel::Biharmonic { .. } => {
                        libm::exp2(-39.9 + 43.9 * random.unit())
                    }
                    _ if k < 100 => 0.0,
                    _ => libm::exp2(-44.0 + 53.0 * random.unit()),
                };
                let (expected, found) = (kernel.value_and_slope(s.sqrt()), table.value_and_slope(s));
                assert_eq!(found[0].to_bits(), table.value(s).to_bits(), "{kernel:?} at {s}");
                let off = (found[0] - expected[0]).abs() / top;
                worst = if off > worst { off } else { worst };
                // As used for gradients: dφ/dr = 2 r dφ/ds.
                let [slope, other] = [expected[1], found[1]].map(|slope| 2.0 * s.sqrt() * slope);
                steepest = if slope.abs() > steepest { slope.abs() } else { steepest };
                off_slope = if (slope - other).abs() > off_slope { (slope - other).abs() } else { off_slope };
            }
            println!("{kernel:?}: values {worst:e}, slopes {:e}", off_slope / steepest);
            assert!(worst < TABLE_ERROR, "{kernel:?}: {worst:e}");
            assert!(off_slope < 1e-5 * steepest, "{kernel:?}: {off_slope:e} of {steepest:e}");
        }
    }

    /// Bound for the error of the table of every kernel in the tests, relative to φ(0). The multi-order kernel is off
    /// by 2.6e-9 at its defaults and 4e-9 at most.
    const TABLE_ERROR: f64 = 1e-7;

    /// Returns whether a symmetric matrix is positive definite, by trying a Cholesky factorisation.
    fn is_positive(n: usize, entry: impl Fn(usize, usize) -> f64) -> bool {
        let mut factor = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| factor[i * n + k] * factor[j * n + k]).sum();
                let rest = entry(i, j) - sum;
                if i == j && rest <= 0.0 {
                    return false;
                }
                factor[i * n + j] = if i == j { rest.sqrt() } else { rest / factor[j * n + j] };
            }
        }
        true
    }

    #[test]
    fn every_kernel_is_positive_definite() {
        for seed in 0..4 {
            let points = points(200, seed);
            for kernel in [
                multi(5.0, 0.025),
                multi(20.0, 0.025),
                multi(40.0, 0.025),
                multi(0.1, 0.001),
                // The circumscribed ball of the bounding box of a unit ball, as for constraints.
                Kernel::ThinPlate { radius: 3.0_f64.sqrt() },
                Kernel::Biharmonic { radius: 1.0 },
                Kernel::Gaussian { sigma: 0.07 },
            ] {
                let entry = |i: usize, j: usize| {
                    let lambda = if i == j { 1e-9 } else { 0.0 };
                    kernel.value(points[i].distance(points[j])) + lambda
                };
                assert!(is_positive(points.len(), entry), "{kernel:?}");
            }
        }
        // On the whole sphere, where the shifts are necessary.
        let sphere: Vec<DVec3> = points(300, 9).into_iter().map(|p| p.normalize()).collect();
        for kernel in [Kernel::ThinPlate { radius: 1.0 }, Kernel::Biharmonic { radius: 1.0 }] {
            let entry = |i: usize, j: usize| kernel.value(sphere[i].distance(sphere[j]));
            assert!(is_positive(sphere.len(), entry), "{kernel:?}");
            // Without nine tenths of its shift, neither kernel is.
            let shift = kernel.value(0.0);
            assert!(!is_positive(sphere.len(), |i, j| entry(i, j) - 0.9 * shift), "{kernel:?}");
        }
    }

    #[test]
    fn parameters_choose_the_kernel() {
        let of = |kernel| Kernel::new(&ImplicitParams { kernel, ..ImplicitParams::default() }, 5.0, 1.5);
        assert_eq!(of(KernelKind::MultiOrder), multi(5.0, 0.025));
        assert_eq!(of(KernelKind::ThinPlate), Kernel::ThinPlate { radius: 1.5 });
        assert_eq!(of(KernelKind::Biharmonic), Kernel::Biharmonic { radius: 1.5 });
        assert_eq!(of(KernelKind::Gaussian), Kernel::Gaussian { sigma: 0.07 });
    }
}
