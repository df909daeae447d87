//! Cholesky factorisation of small dense matrices, in one array row by row, and the solution of triangular systems.

/// Smallest pivot of a factorisation, as a share of the matrix's diagonal entry: a lower pivot is due to rounding, and is
/// raised to this.
pub const MIN_PIVOT: f64 = 1e-12;

/// Replaces the lower triangle of a symmetric positive definite `n` by `n` matrix by its Cholesky factor; pivots are at
/// least [`MIN_PIVOT`] of their diagonal entry.
pub fn factorise(a: &mut [f64], n: usize) {
    for i in 0..n {
        let (done, rest) = a.split_at_mut(i * n);
        let row = &mut rest[..=i];
        for j in 0..i {
            let other = &done[j * n..j * n + j + 1];
            let sum: f64 = row[..j].iter().zip(other).map(|(x, y)| x * y).sum();
            row[j] = (row[j] - sum) / other[j];
        }
        let squares: f64 = row[..i].iter().map(|x| x * x).sum();
        row[i] = max(row[i] - squares, MIN_PIVOT * row[i]).sqrt();
    }
}

/// Solves L x = b for the factor L; `b` becomes x.
pub fn forward(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let row = &factor[i * n..i * n + i + 1];
        let sum: f64 = row[..i].iter().zip(&b[..i]).map(|(x, y)| x * y).sum();
        b[i] = (b[i] - sum) / row[i];
    }
}

/// Solves Lᵀ x = b for the factor L; `b` becomes x.
pub fn backward(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in (0..n).rev() {
        let row = &factor[i * n..i * n + i + 1];
        b[i] /= row[i];
        let value = b[i];
        b[..i].iter_mut().zip(row).for_each(|(x, y)| *x -= value * y);
    }
}

/// Returns the larger number, by a comparison: `f64::max` is a function call in wasm.
pub fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn a_system_is_solved() {
        let matrix = [4.0, 2.0, 1.0, 2.0, 5.0, 3.0, 1.0, 3.0, 6.0];
        let expected = [1.0, -2.0, 3.0];
        let row = |i: usize| (0..3).map(|j| matrix[3 * i + j] * expected[j]).sum::<f64>();
        let (mut factor, mut x) = (matrix, [row(0), row(1), row(2)]);
        factorise(&mut factor, 3);
        forward(&factor, &mut x);
        backward(&factor, &mut x);
        assert!(x.iter().zip(expected).all(|(found, x)| (found - x).abs() < 1e-12), "{x:?}");
    }
}
