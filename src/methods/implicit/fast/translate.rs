//! Multipole-to-local translations of the fast multipole method: from the sources at the nodes of one cube to the
//! values at the nodes of another, by a low-rank matrix for each relative position.

use super::chebyshev::{CUBE, Chebyshev, NODES, Nodal, node_coords, node_index};
use crate::math::DVec3;
use crate::methods::implicit::kernel::KernelTable;
use crate::methods::implicit::low_rank::{LowRank, cross_approximation};

/// Relative error of the low-rank approximation of a translation matrix: below that of the Chebyshev interpolation.
const TOLERANCE: f64 = 1e-5;

/// Matrices that turn sources at the Chebyshev nodes of one cube into values at the nodes of another of the same size,
/// up to three cubes away along each axis, and at least two along one. Reflections and permutations of the axes leave
/// 16 of them.
#[derive(Clone, Debug)]
pub struct Translations {
    /// Matrices by canonical offset, whose components are non-negative and in descending order; `None` for other
    /// offsets, and where cubes would touch.
    matrices: Vec<Option<LowRank<f32>>>,
}

/// Offset from a target cube to a source cube, in cube edges.
pub type Offset = [i32; 3];

impl Translations {
    /// Computes the translation matrices of a kernel, tabulated in `table`, between cubes with edges of length `edge`,
    /// in units of the normalised box.
    pub fn new(table: &KernelTable, chebyshev: &Chebyshev, edge: f64) -> Self {
        let matrices = (0..4 * 4 * 4).map(|index| {
            let offset = [index / 16, index / 4 % 4, index % 4];
            if offset[0] < 2 || offset[0] < offset[1] || offset[1] < offset[2] {
                return None;
            }
            let away = DVec3::from_array(offset.map(f64::from)) * edge;
            let at = |index: usize| chebyshev.node(index) * (0.5 * edge);
            let entry = |i: usize, j: usize| table.value(at(i).distance_squared(at(j) + away));
            let fill = |out: &mut [f64], entry: &dyn Fn(usize) -> f64| {
                out.iter_mut().enumerate().for_each(|(k, value)| *value = entry(k));
            };
            Some(cross_approximation(
                [CUBE, CUBE],
                TOLERANCE,
                |i, out| fill(out, &|j| entry(i, j)),
                |j, out| fill(out, &|i| entry(i, j)),
            ))
        });
        Self { matrices: matrices.collect() }
    }

    /// Adds to `targets` the values at the nodes of a target cube that are due to `sources`, the sources at the nodes
    /// of the cube at `offset` from it.
    pub fn add(&self, symmetries: &CubeSymmetries, offset: Offset, sources: &Nodal, targets: &mut Nodal) {
        let (symmetry, canonical) = symmetries.find(offset);
        let index = (canonical[0] * 16 + canonical[1] * 4 + canonical[2]) as usize;
        let Some(matrix) = self.matrices.get(index).and_then(Option::as_ref) else { return };
        let (mut turned, mut sums) = ([0.0_f32; CUBE], [0.0_f32; CUBE]);
        for (&to, strength) in symmetry.iter().zip(sources) {
            turned[usize::from(to)] = *strength;
        }
        let (columns, _) = matrix.columns.as_chunks::<CUBE>();
        let (rows, _) = matrix.rows.as_chunks::<CUBE>();
        for (column, row) in columns.iter().zip(rows) {
            let strength = dot(row, &turned);
            sums.iter_mut().zip(column).for_each(|(sum, value)| *sum += value * strength);
        }
        for (&from, target) in symmetry.iter().zip(targets) {
            *target += sums[usize::from(from)];
        }
    }
}

/// Returns the dot product of two nodal vectors, accumulated in eight independent partial sums that the compiler can
/// vectorise.
fn dot(a: &Nodal, b: &Nodal) -> f32 {
    let mut sums = [0.0; 8];
    let (eights, rest) = a.as_chunks::<8>();
    let (other_eights, other_rest) = b.as_chunks::<8>();
    for (a, b) in eights.iter().zip(other_eights) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let tail: f32 = rest.iter().zip(other_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + tail
}

/// Permutations of a cube's Chebyshev nodes under reflections and permutations of the axes; they reduce the number of
/// translation matrices.
#[derive(Clone, Debug)]
pub struct CubeSymmetries {
    /// For each symmetry, the new number of each node. The index of a symmetry is 6 × reflections (three bits) + the
    /// index of the axes' permutation in [`ORDERS`].
    nodes: Vec<[u8; CUBE]>,
}

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

impl CubeSymmetries {
    /// Computes the permutations of a cube's Chebyshev nodes for all 48 symmetries of the cube.
    pub fn new() -> Self {
        let symmetry = |number: usize| {
            let (signs, order) = (number / 6, ORDERS[number % 6]);
            std::array::from_fn(|index| {
                let mut target = node_coords(index);
                for (axis, along) in target.iter_mut().enumerate() {
                    if signs >> axis & 1 == 1 {
                        *along = NODES - 1 - *along;
                    }
                }
                node_index(order.map(|axis| target[axis])) as u8
            })
        };
        Self { nodes: (0..48).map(symmetry).collect() }
    }

    /// Returns the permutation of nodes whose symmetry makes the components of an offset non-negative and descending,
    /// and the offset that results, for which there is a translation matrix.
    fn find(&self, offset: Offset) -> (&[u8; CUBE], Offset) {
        let signs = (0..3).map(|axis| usize::from(offset[axis] < 0) << axis).sum::<usize>();
        let size = offset.map(i32::abs);
        let descends =
            |order: &[usize; 3]| size[order[0]] >= size[order[1]] && size[order[1]] >= size[order[2]];
        let order = ORDERS.iter().position(descends).unwrap_or(0);
        (&self.nodes[signs * 6 + order], ORDERS[order].map(|axis| size[axis]))
    }
}
