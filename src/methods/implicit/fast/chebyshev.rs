//! Interpolation on the Chebyshev nodes of a cube.

use crate::math::DVec3;
use std::f64::consts::PI;

/// Nodes along an axis. 4 leave errors of a tenth of a cell, 6 take twice as long.
pub const NODES: usize = 5;
/// Nodes of a cube, x fastest.
pub const CUBE: usize = NODES * NODES * NODES;

/// Numbers at the nodes of a cube.
pub type Nodal = [f32; CUBE];

/// The nodes of [−1, 1], and what interpolation between them needs.
#[derive(Clone, Debug)]
pub struct Chebyshev {
    nodes: [f64; NODES],
    /// Tₘ at node k, row by row of k.
    polynomials: [[f64; NODES]; NODES],
    /// Weights of a cube's nodes, along an axis, at the nodes of its lower and its upper half.
    halves: [[[f64; NODES]; NODES]; 2],
}

impl Chebyshev {
    /// The tables.
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

    /// Where node `index` of the cube [−1, 1]³ is.
    pub fn node(&self, index: usize) -> DVec3 {
        let [i, j, k] = split(index);
        DVec3::new(self.nodes[i], self.nodes[j], self.nodes[k])
    }

    /// The weight of each node at `x` in [−1, 1].
    pub fn weights(&self, x: f64) -> [f64; NODES] {
        let mut t = [1.0; NODES];
        t[1] = x;
        for m in 2..NODES {
            t[m] = 2.0 * x * t[m - 1] - t[m - 2];
        }
        self.combined(&t)
    }

    /// The derivative of each weight at `x`.
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

    /// (1/n)(t₀ + 2 Σ Tₘ(node) tₘ) for each node.
    fn combined(&self, t: &[f64; NODES]) -> [f64; NODES] {
        std::array::from_fn(|k| {
            let sum: f64 = (1..NODES).map(|m| self.polynomials[k][m] * t[m]).sum();
            (t[0] + 2.0 * sum) / NODES as f64
        })
    }

    /// What the nodes of the half on side `half` of each axis take from those of the whole cube: its values there.
    pub fn to_half(&self, whole: &Nodal, half: [usize; 3]) -> Nodal {
        let mut values = whole.map(f64::from);
        for (axis, side) in half.into_iter().enumerate() {
            values = along(&values, axis, |to, from| self.halves[side][to][from]);
        }
        values.map(|x| x as f32)
    }

    /// What the nodes of the whole cube take from those of a half: sources at the half's nodes, moved.
    pub fn to_whole(&self, part: &Nodal, half: [usize; 3]) -> Nodal {
        let mut values = part.map(f64::from);
        for (axis, side) in half.into_iter().enumerate() {
            values = along(&values, axis, |to, from| self.halves[side][from][to]);
        }
        values.map(|x| x as f32)
    }

    /// The interpolated value at a place in [−1, 1]³.
    pub fn value(&self, nodal: &Nodal, at: DVec3) -> f64 {
        let [x, y, z] = at.to_array().map(|t| self.weights(t));
        contracted(nodal, &x, &y, &z)
    }

    /// The interpolated value and its gradient.
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

    /// Adds a source of strength `weight` at a place in [−1, 1]³ to the nodes.
    pub fn spread(&self, nodal: &mut Nodal, at: DVec3, weight: f64) {
        let [x, y, z] = at.to_array().map(|t| self.weights(t));
        for (index, value) in nodal.iter_mut().enumerate() {
            let [i, j, k] = split(index);
            *value += (weight * x[i] * y[j] * z[k]) as f32;
        }
    }
}

/// The place of a node along each axis.
pub fn split(index: usize) -> [usize; 3] {
    [index % NODES, index / NODES % NODES, index / (NODES * NODES)]
}

/// The node at a place along each axis.
pub fn joined([i, j, k]: [usize; 3]) -> usize {
    (k * NODES + j) * NODES + i
}

/// A matrix applied along one axis.
fn along(values: &[f64; CUBE], axis: usize, entry: impl Fn(usize, usize) -> f64) -> [f64; CUBE] {
    std::array::from_fn(|index| {
        let place = split(index);
        let mut from = place;
        let mut sum = 0.0;
        for k in 0..NODES {
            from[axis] = k;
            sum += entry(place[axis], k) * values[joined(from)];
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
