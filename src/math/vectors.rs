//! Operations on vectors of numbers with a fixed order of summation, so that results are bit-identical natively and in
//! wasm.

/// A floating-point type for matrix entries, `f32` or `f64`; sums over them are taken in `f64`.
pub trait MatrixScalar: Copy + Into<f64> {
    /// Rounds `x` to this type.
    fn from_f64(x: f64) -> Self;
}

impl MatrixScalar for f32 {
    fn from_f64(x: f64) -> Self {
        x as f32
    }
}

impl MatrixScalar for f64 {
    fn from_f64(x: f64) -> Self {
        x
    }
}

/// Returns the dot product of `a` and `b`, accumulated in four independent partial sums that the compiler can
/// vectorise.
pub fn dot<T: MatrixScalar>(a: &[T], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (fours, rest) = a.as_chunks::<4>();
    let (other_fours, other_rest) = b.as_chunks::<4>();
    for (a, b) in fours.iter().zip(other_fours) {
        for k in 0..4 {
            sums[k] += a[k].into() * b[k];
        }
    }
    let tail: f64 = rest.iter().zip(other_rest).map(|(&a, b)| a.into() * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

/// Adds the vector `from`, multiplied by `weight`, to the vector `to`.
pub fn add<T: MatrixScalar>(weight: f64, from: &[T], to: &mut [f64]) {
    to.iter_mut().zip(from).for_each(|(x, &y)| *x += weight * y.into());
}

/// Returns the Euclidean norm of `a`.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
