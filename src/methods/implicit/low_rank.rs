//! Low-rank approximation of matrix blocks that hold a kernel between the points of two separated clusters, by adaptive
//! cross approximation with partial pivoting (Bebendorf, *Approximation of boundary element matrices*, 2000).

use crate::math::vectors::{MatrixScalar, dot};

/// A matrix block approximated as a sum of outer products, Σ uₖ vₖᵀ, which takes less memory and time than all its
/// entries.
#[derive(Clone, Debug)]
pub struct LowRank<T> {
    /// The vectors uₖ of the sum Σ uₖ vₖᵀ, one after the other, each with one entry per row of the block.
    pub columns: Vec<T>,
    /// The vectors vₖ of the sum Σ uₖ vₖᵀ, one after the other, each with one entry per column of the block.
    pub rows: Vec<T>,
}

/// Maximum rank of the low-rank approximation of a matrix block, whatever its error; blocks between separated clusters
/// stay far below it.
const MAX_RANK: usize = 64;

/// Approximates a matrix block of `height` by `width` entries by a low-rank matrix, to a relative error of about
/// `tolerance` in the Frobenius norm, unless that takes a rank above `MAX_RANK`. `row` and `column` write the entries
/// of a row or column, given its index.
pub fn cross_approximation<T: MatrixScalar>(
    [height, width]: [usize; 2],
    tolerance: f64,
    mut row: impl FnMut(usize, &mut [f64]),
    mut column: impl FnMut(usize, &mut [f64]),
) -> LowRank<T> {
    let (mut us, mut vs): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let mut row_used = vec![false; height];
    let (mut pivot_row, mut norm_squared) = (0, 0.0);
    let limit = MAX_RANK.min(height).min(width);
    while us.len() < limit {
        let mut v = vec![0.0; width];
        row(pivot_row, &mut v);
        subtract(&mut v, &vs, |k| us[k][pivot_row]);
        row_used[pivot_row] = true;
        let pivot_column = largest(&v, |_| true);
        let pivot = v[pivot_column];
        if pivot == 0.0 {
            // The row is already exact, for instance because a Gaussian underflowed; rows of centres nearer to the
            // other cluster may not be.
            match row_used.iter().position(|used| !used) {
                Some(next) => pivot_row = next,
                None => break,
            }
            continue;
        }
        v.iter_mut().for_each(|x| *x /= pivot);
        let mut u = vec![0.0; height];
        column(pivot_column, &mut u);
        subtract(&mut u, &us, |k| vs[k][pivot_column]);
        pivot_row = largest(&u, |i| !row_used[i]);
        let added = dot(&u, &u) * dot(&v, &v);
        let mixed: f64 = us.iter().zip(&vs).map(|(x, y)| dot(x, &u) * dot(y, &v)).sum();
        norm_squared += added + 2.0 * mixed;
        us.push(u);
        vs.push(v);
        if added <= tolerance * tolerance * norm_squared {
            break;
        }
    }
    LowRank { columns: rounded(&us), rows: rounded(&vs) }
}

/// Subtracts the low-rank approximation so far from a row or column of the block: the sum of `parts`, each times its
/// `weight`.
fn subtract(values: &mut [f64], parts: &[Vec<f64>], weight: impl Fn(usize) -> f64) {
    for (k, part) in parts.iter().enumerate() {
        let weight = weight(k);
        values.iter_mut().zip(part).for_each(|(x, y)| *x -= weight * y);
    }
}

fn largest(values: &[f64], allowed: impl Fn(usize) -> bool) -> usize {
    let mut best = (0, -1.0);
    for (i, x) in values.iter().enumerate() {
        if x.abs() > best.1 && allowed(i) {
            best = (i, x.abs());
        }
    }
    best.0
}

fn rounded<T: MatrixScalar>(parts: &[Vec<f64>]) -> Vec<T> {
    parts.iter().flatten().map(|&x| T::from_f64(x)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn error(found: &LowRank<f64>, [height, width]: [usize; 2], entry: impl Fn(usize, usize) -> f64) -> f64 {
        let (mut off, mut size) = (0.0, 0.0);
        for i in 0..height {
            for j in 0..width {
                let parts = found.columns.chunks(height).zip(found.rows.chunks(width));
                let sum: f64 = parts.map(|(u, v)| u[i] * v[j]).sum();
                off += (sum - entry(i, j)) * (sum - entry(i, j));
                size += entry(i, j) * entry(i, j);
            }
        }
        if size > 0.0 { (off / size).sqrt() } else { off }
    }

    #[test]
    fn products_have_the_requested_accuracy() {
        // A kernel between two separate segments of a line, a block of rank 1, a zero block, and a block with a single
        // row.
        let far = |i: usize, j: usize| 1.0 / (3.0 + i as f64 * 0.02 + j as f64 * 0.03);
        let product = |i: usize, j: usize| (1.0 + i as f64) * (j as f64 - 4.5);
        type Block<'a> = ([usize; 2], &'a dyn Fn(usize, usize) -> f64);
        let blocks: [Block; 4] =
            [([60, 40], &far), ([30, 50], &product), ([9, 7], &|_, _| 0.0), ([1, 40], &far)];
        for (size, entry) in blocks {
            for tolerance in [1e-3, 1e-6, 1e-10] {
                let fill = |out: &mut [f64], at: &dyn Fn(usize) -> f64| {
                    out.iter_mut().enumerate().for_each(|(k, x)| *x = at(k));
                };
                let found = cross_approximation::<f64>(
                    size,
                    tolerance,
                    |i, out| fill(out, &|j| entry(i, j)),
                    |j, out| fill(out, &|i| entry(i, j)),
                );
                assert!(error(&found, size, entry) <= 3.0 * tolerance, "{size:?}, {tolerance}");
                assert!(found.columns.len() <= 12 * size[0], "{} numbers", found.columns.len());
            }
        }
    }
}
