//! Eigenvalues and eigenvectors of symmetric matrices by Jacobi rotations: all of a 3×3 matrix, and the eigenvector of
//! the least eigenvalue of a matrix of any size.

use super::{DMat3, DVec3};

/// Returns p pᵀ, the outer product of a vector with itself: sums of it are covariances.
pub fn outer(p: DVec3) -> DMat3 {
    DMat3::from_cols(p * p.x, p * p.y, p * p.z)
}

/// Maximum number of Jacobi sweeps over all off-diagonal entries. Jacobi converges quadratically, and 6 sweeps were the
/// most observed.
const SWEEPS: usize = 16;

/// Returns the eigenvalues of a symmetric matrix in ascending order, and their orthonormal eigenvectors in the same
/// order as the columns of a rotation.
///
/// Only the symmetric part of `matrix` is used. Every eigenvalue is accurate to rounding relative to the one with the
/// largest absolute value. If an entry is not finite, some of the results are not.
pub fn eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let (mut a, mut vectors) = ((matrix + matrix.transpose()) * 0.5, DMat3::IDENTITY);
    for _ in 0..SWEEPS {
        if a.y_axis.x == 0.0 && a.z_axis.x == 0.0 && a.z_axis.y == 0.0 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let rotation = jacobi_rotation(&a, p, q);
            a = rotation.transpose() * a * rotation;
            vectors *= rotation;
        }
    }
    sorted(DVec3::new(a.x_axis.x, a.y_axis.y, a.z_axis.z), vectors)
}

/// Returns the Jacobi rotation R in the plane of axes `p` and `q`, for which RᵀaR has a zero at `(p, q)`; the identity
/// if the entry of `a` there is negligible.
fn jacobi_rotation(a: &DMat3, p: usize, q: usize) -> DMat3 {
    let off = a.col(q)[p];
    let gap = a.col(q)[q] - a.col(p)[p];
    if off == 0.0 || off.abs() <= f64::EPSILON * 1e-3 * (a.col(p)[p].abs() + a.col(q)[q].abs()) && gap != 0.0
    {
        return DMat3::IDENTITY;
    }
    let [_, cosine, sine] = jacobi_angle(off, gap);
    let mut rotation = DMat3::IDENTITY;
    rotation.col_mut(p)[p] = cosine;
    rotation.col_mut(q)[q] = cosine;
    rotation.col_mut(q)[p] = sine;
    rotation.col_mut(p)[q] = -sine;
    rotation
}

/// Returns tangent, cosine and sine of the angle of the Jacobi rotation that zeroes the entry `off` at (p, q) of a
/// symmetric matrix a; `gap` is a(q, q) − a(p, p).
fn jacobi_angle(off: f64, gap: f64) -> [f64; 3] {
    let ratio = gap / (2.0 * off);
    let sign = if ratio < 0.0 { -1.0 } else { 1.0 };
    let tangent = sign / (ratio.abs() + (ratio * ratio + 1.0).sqrt());
    let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
    [tangent, cosine, tangent * cosine]
}

/// Returns eigenvalues in ascending order, and their eigenvectors, the columns of `vectors`, in the same order as the
/// columns of a right-handed basis.
fn sorted(values: DVec3, vectors: DMat3) -> (DVec3, DMat3) {
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let [x, y, _] = order.map(|i| vectors.col(i));
    (DVec3::from_array(order.map(|i| values[i])), DMat3::from_cols(x, y, x.cross(y)))
}

/// Returns the unit eigenvector of the least eigenvalue of a symmetric matrix; its sign is arbitrary. With NaN in the
/// matrix the result is meaningless.
pub fn least_eigenvector<const N: usize>(mut a: [[f64; N]; N]) -> [f64; N] {
    let mut vectors = [[0.0; N]; N];
    (0..N).for_each(|k| vectors[k][k] = 1.0);
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for p in 0..N - 1 {
            for q in p + 1..N {
                is_diagonal &= !rotate(&mut a, &mut vectors, p, q);
            }
        }
        if is_diagonal {
            break;
        }
    }
    let least = (0..N).fold(0, |least, k| if a[k][k] < a[least][least] { k } else { least });
    vectors[least]
}

/// Zeroes the entry `(p, q)` of `a` by a Jacobi rotation, and applies the rotation to the rows of `vectors`, which
/// become the eigenvectors. Returns false, and changes nothing, if the entry is negligible.
#[inline]
fn rotate<const N: usize>(a: &mut [[f64; N]; N], vectors: &mut [[f64; N]; N], p: usize, q: usize) -> bool {
    let (off, gap) = (a[p][q], a[q][q] - a[p][p]);
    // Written so that NaN is left alone.
    let is_significant = off.abs() > f64::EPSILON * 1e-3 * (a[p][p].abs() + a[q][q].abs());
    if !is_significant {
        return false;
    }
    let [tangent, cosine, sine] = jacobi_angle(off, gap);
    let diagonal = [a[p][p] - tangent * off, a[q][q] + tangent * off];
    for rows in [&mut *a, vectors] {
        let (before, after) = (rows[p], rows[q]);
        for k in 0..N {
            rows[p][k] = cosine * before[k] - sine * after[k];
            rows[q][k] = sine * before[k] + cosine * after[k];
        }
    }
    let (along_p, along_q) = (a[p], a[q]);
    for (k, row) in a.iter_mut().enumerate() {
        (row[p], row[q]) = (along_p[k], along_q[k]);
    }
    (a[p][p], a[q][q], a[p][q], a[q][p]) = (diagonal[0], diagonal[1], 0.0, 0.0);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn check(matrix: DMat3) {
        let (values, vectors) = eigen(matrix);
        let scale = matrix.to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for i in 0..3 {
            let residual = matrix * vectors.col(i) - values[i] * vectors.col(i);
            assert!(residual.length() <= 1e-14 * scale, "{matrix} {values} {residual}");
        }
        assert!((vectors.determinant() - 1.0).abs() < 1e-14);
        assert!(values.x <= values.y && values.y <= values.z);
    }

    #[test]
    fn known_values() {
        let matrix = DMat3::from_cols_array(&[2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, -5.0]);
        assert!((eigen(matrix).0 - DVec3::new(-5.0, 1.0, 3.0)).length() < 1e-14);
        check(matrix);
    }

    #[test]
    fn repeated_zero_and_tiny_values() {
        check(DMat3::ZERO);
        check(DMat3::IDENTITY);
        let n = DVec3::new(1.0, -2.0, 0.5);
        check(outer(n));
        check(DMat3::IDENTITY + 1e-12 * outer(n));
        check(1e-300 * outer(n));
    }

    #[test]
    fn seeded_matrices() {
        let mut random = crate::math::Random::new(11);
        let mut next = || 2.0 * random.unit() - 1.0;
        for _ in 0..1000 {
            let [a, b, c, d, e, f] = [(); 6].map(|()| next());
            check(DMat3::from_cols_array(&[a, b, c, b, d, e, c, e, f]));
        }
    }

    #[test]
    fn the_least_is_an_eigenvector_and_none_is_less() {
        let mut random = crate::math::Random::new(3);
        for round in 0..500 {
            let mut a = [[0.0; 4]; 4];
            for (p, q) in (0..4).flat_map(|p| (p..4).map(move |q| (p, q))) {
                let value = 2.0 * random.unit() - 1.0;
                // Some are diagonal, or nearly so.
                let size = if p == q { 1.0 } else { [1.0, 1e-9, 0.0][round % 3] };
                (a[p][q], a[q][p]) = (size * value, size * value);
            }
            let v = least_eigenvector(a);
            let times = |x: &[f64; 4]| a.map(|row| (0..4).map(|k| row[k] * x[k]).sum::<f64>());
            let dot = |x: &[f64; 4], y: &[f64; 4]| (0..4).map(|k| x[k] * y[k]).sum::<f64>();
            let value = dot(&v, &times(&v));
            assert!((dot(&v, &v) - 1.0).abs() < 1e-13);
            for (k, product) in times(&v).into_iter().enumerate() {
                assert!((product - value * v[k]).abs() < 1e-13, "{a:?} {v:?}");
            }
            for _ in 0..20 {
                let x = [(); 4].map(|()| 2.0 * random.unit() - 1.0);
                assert!(dot(&x, &times(&x)) >= (value - 1e-12) * dot(&x, &x));
            }
        }
        assert_eq!(least_eigenvector([[0.0; 4]; 4]), [1.0, 0.0, 0.0, 0.0]);
        // With NaN in the matrix the iteration ends, here with an axis.
        assert_eq!(least_eigenvector([[f64::NAN; 3]; 3]), [1.0, 0.0, 0.0]);
    }
}
