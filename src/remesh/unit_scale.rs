//! Scaling of a mesh to edges of about 1.

/// The largest exponent of two by which lengths are scaled and scaled back, so that both factors are in the range of
/// `f32`.
const EXPONENTS: i32 = 120;

/// Returns the factor that scales edges of length `edge` to about 1, so that their squares neither overflow nor
/// underflow, and its inverse. Both are powers of two, so that scaling is exact.
pub(super) fn unit_scale(edge: f32) -> [f32; 2] {
    let (_, exponent) = libm::frexpf(edge);
    let exponent = exponent.clamp(-EXPONENTS, EXPONENTS);
    [-exponent, exponent].map(|power| libm::ldexpf(1.0, power))
}
