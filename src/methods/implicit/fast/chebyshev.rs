//! Chebyshev interpolation on a cube, for the fast multipole method.

use crate::math::DVec3;
use std::f64::consts::PI;

/// Number of Chebyshev nodes along an axis of a cube. With 4, the extracted surface is off by up to a tenth of a cell;
/// with 6, evaluation takes twice as long.
pub const NODES: usize = 5;
/// Number of Chebyshev nodes of a cube; x varies fastest in their order.
pub const CUBE: usize = NODES * NODES * NODES;

/// Values, or strengths of sources, at the Chebyshev nodes of a cube, x fastest.
pub type Nodal = [f32; CUBE];

/// The Chebyshev nodes of [−1, 1], with tables for interpolation between them.
#[derive(Clone, Debug)]
pub struct Chebyshev {
    nodes: [f64; NODES],
    /// Table of the Chebyshev polynomials Tₘ at the nodes: row k, column m holds Tₘ at node k.
    polynomials: [[f64; NODES]; NODES],
    /// Interpolation from a cube to its lower (index 0) and upper half (1) along an axis: row k holds the weights of
    /// the cube's nodes at node k of the half.
    halves: [[[f64; NODES]; NODES]; 2],
}

impl Chebyshev {
    /// Computes the nodes, and the tables for interpolation between them.
    pub fn new() -> Self {
        let angle = |k: usize| PI * (2 * k + 1) as f64 / (2 * NODES) as f64;
        let mut tables = Self {
            nodes: std::array::from_fn(|k| libm::cos(angle(k))),
            polynomials: std::array::from_fn(|k| std::array::from_fn(|m| libm::cos(m as f64 * angle(k)))),
            halves: [[[0.0; NODES]; NODES]; 2],
        };
        for (side, shift) in [-0.5, 0.5].into_iter().enumerate() {
            for k in 0..NODES {
                tables.halves[side][k] = tables.weights(shift + 0.5 * tables.nodes[k]);
            }
        }
        tables
    }

    /// Returns the position of the Chebyshev node with number `index` in the cube [−1, 1]³.
    pub fn node(&self, index: usize) -> DVec3 {
        let [i, j, k] = node_coords(index);
        DVec3::new(self.nodes[i], self.nodes[j], self.nodes[k])
    }

    /// Returns the weight of each Chebyshev node in the interpolation of a value at `x`, all in [−1, 1].
    pub fn weights(&self, x: f64) -> [f64; NODES] {
        let mut t = [1.0; NODES];
        t[1] = x;
        for m in 2..NODES {
            t[m] = 2.0 * x * t[m - 1] - t[m - 2];
        }
        self.combined(&t)
    }

    /// Returns the derivative by `x` of each Chebyshev node's interpolation weight at `x`, all in [−1, 1]; used for
    /// gradients.
    pub fn slopes(&self, x: f64) -> [f64; NODES] {
        // Tₘ′ = m Uₘ₋₁
        let mut u = [1.0; NODES];
        u[1] = 2.0 * x;
        for m in 2..NODES {
            u[m] = 2.0 * x * u[m - 1] - u[m - 2];
        }
        let mut derivatives = [0.0; NODES];
        for m in 1..NODES {
            derivatives[m] = m as f64 * u[m - 1];
        }
        self.combined(&derivatives)
    }

    /// Returns the interpolation weight of each Chebyshev node at a point of [−1, 1] if `t` holds the Chebyshev
    /// polynomials Tₘ there, and the derivative of that weight if `t` holds their derivatives: (1/n)(t₀ + 2 Σ tₘ
    /// Tₘ(node)), with n nodes.
    fn combined(&self, t: &[f64; NODES]) -> [f64; NODES] {
        std::array::from_fn(|k| {
            let sum: f64 = (1..NODES).map(|m| self.polynomials[k][m] * t[m]).sum();
            (t[0] + 2.0 * sum) / NODES as f64
        })
    }

    /// Interpolates the values `whole` at the Chebyshev nodes of a cube, and returns those at the nodes of one of its
    /// octants (the local-to-local translation); `half` is the side of the octant, 0 or 1, along each axis.
    pub fn local_to_local(&self, whole: &Nodal, half: [usize; 3]) -> Nodal {
        let mut values = whole.map(f64::from);
        for (axis, side) in half.into_iter().enumerate() {
            values = apply_along(&values, axis, |to, from| self.halves[side][to][from]);
        }
        values.map(|x| x as f32)
    }

    /// Returns the sources at the Chebyshev nodes of a whole cube that replace the sources `part` at the nodes of one
    /// of its octants (the multipole-to-multipole translation), by the transpose of [`Self::local_to_local`]; `half` is
    /// the side of the octant, 0 or 1, along each axis.
    pub fn multipole_to_multipole(&self, part: &Nodal, half: [usize; 3]) -> Nodal {
        let mut values = part.map(f64::from);
        for (axis, side) in half.into_iter().enumerate() {
            values = apply_along(&values, axis, |to, from| self.halves[side][from][to]);
        }
        values.map(|x| x as f32)
    }

    /// Returns the value at the point `at` of the cube [−1, 1]³, interpolated from the values `nodal` at its Chebyshev
    /// nodes.
    pub fn value(&self, nodal: &Nodal, at: DVec3) -> f64 {
        let [x, y, z] = at.to_array().map(|t| self.weights(t));
        contracted(nodal, &x, &y, &z)
    }

    /// Returns the value at the point `at` of the cube [−1, 1]³, interpolated from the values `nodal` at its Chebyshev
    /// nodes, and its gradient in the coordinates of that cube.
    pub fn value_and_gradient(&self, nodal: &Nodal, at: DVec3) -> (f64, DVec3) {
        let [x, y, z] = at.to_array().map(|t| self.weights(t));
        let [dx, dy, dz] = at.to_array().map(|t| self.slopes(t));
        let gradient = DVec3::new(
            contracted(nodal, &dx, &y, &z),
            contracted(nodal, &x, &dy, &z),
            contracted(nodal, &x, &y, &dz),
        );
        (contracted(nodal, &x, &y, &z), gradient)
    }

    /// Replaces a source of strength `weight` at the point `at` of the cube [−1, 1]³ by sources at the Chebyshev nodes
    /// of the cube, in proportion to their interpolation weights there, and adds these to `nodal`.
    pub fn spread_source(&self, nodal: &mut Nodal, at: DVec3, weight: f64) {
        let [x, y, z] = at.to_array().map(|t| self.weights(t));
        for (index, value) in nodal.iter_mut().enumerate() {
            let [i, j, k] = node_coords(index);
            *value += (weight * x[i] * y[j] * z[k]) as f32;
        }
    }
}

/// Returns the index along x, y and z of the Chebyshev node with number `index` of a cube; the inverse of
/// [`node_index`].
pub fn node_coords(index: usize) -> [usize; 3] {
    [index % NODES, index / NODES % NODES, index / (NODES * NODES)]
}

/// Returns the number of the Chebyshev node of a cube with the given indices along x, y and z; x varies fastest.
pub fn node_index([i, j, k]: [usize; 3]) -> usize {
    (k * NODES + j) * NODES + i
}

/// Multiplies the values at a cube's Chebyshev nodes, on each line of nodes along `axis`, by a matrix, which
/// interpolates along one axis; `entry` returns its entry, given row and column.
fn apply_along(values: &[f64; CUBE], axis: usize, entry: impl Fn(usize, usize) -> f64) -> [f64; CUBE] {
    std::array::from_fn(|index| {
        let node = node_coords(index);
        let mut from = node;
        let mut sum = 0.0;
        for k in 0..NODES {
            from[axis] = k;
            sum += entry(node[axis], k) * values[node_index(from)];
        }
        sum
    })
}

fn contracted(nodal: &Nodal, x: &[f64; NODES], y: &[f64; NODES], z: &[f64; NODES]) -> f64 {
    let (rows, _) = nodal.as_chunks::<NODES>();
    let (planes, _) = rows.as_chunks::<NODES>();
    let mut sum = 0.0;
    for (plane, z) in planes.iter().zip(z) {
        let mut across = 0.0;
        for (row, y) in plane.iter().zip(y) {
            let mut along = 0.0;
            for (value, x) in row.iter().zip(x) {
                along += f64::from(*value) * x;
            }
            across += along * y;
        }
        sum += across * z;
    }
    sum
}
