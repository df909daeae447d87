//! Sums over vectors, in one order everywhere, so that the bits are the same.

/// A number as a matrix stores it.
pub trait Number: Copy + Into<f64> {
    /// The nearest to `x`.
    fn of(x: f64) -> Self;
}

impl Number for f32 {
    fn of(x: f64) -> Self {
        x as f32
    }
}

impl Number for f64 {
    fn of(x: f64) -> Self {
        x
    }
}

/// Σ aᵢbᵢ, as four sums side by side that a processor can do at once.
pub fn dot<T: Number>(a: &[T], b: &[f64]) -> f64 {
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

/// `to` plus `weight` times `from`.
pub fn add<T: Number>(weight: f64, from: &[T], to: &mut [f64]) {
    to.iter_mut().zip(from).for_each(|(x, &y)| *x += weight * y.into());
}

/// The length of a vector.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
