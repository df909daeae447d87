//! From the nodes of a cube of sources to the nodes of a cube of places, by a matrix for each way that one can lie from
//! the other, as a product of thin ones.

use super::chebyshev::{CUBE, Chebyshev, NODES, Nodal, joined, split};
use crate::math::DVec3;
use crate::methods::implicit::kernel::KernelTable;
use crate::methods::implicit::low_rank::{LowRank, cross_approximation};

/// Relative error of a matrix: below that of the interpolation.
const TOLERANCE: f64 = 1e-5;

/// Cubes of one size, up to three apart along an axis and at least two along some. Mirroring and swapping axes leave 16 ways.
#[derive(Clone, Debug)]
pub struct Translations {
    /// By what is left of the offset then; `None` where cubes would touch.
    matrices: Vec<Option<LowRank<f32>>>,
}

/// Where a cube of sources lies, in edges of a cube, from the cube of places.
pub type Offset = [i32; 3];

impl Translations {
    /// For cubes of edge `edge`.
    pub fn new(table: &KernelTable, chebyshev: &Chebyshev, edge: f64) -> Self {
        let matrices = (0..4 * 4 * 4).map(|way| {
            let offset = [way / 16, way / 4 % 4, way % 4];
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

    /// Adds to `places` what `sources`, so far away, make there.
    pub fn add(&self, turns: &Turns, offset: Offset, sources: &Nodal, places: &mut Nodal) {
        let (turn, canonical) = turns.find(offset);
        let way = (canonical[0] * 16 + canonical[1] * 4 + canonical[2]) as usize;
        let Some(matrix) = self.matrices.get(way).and_then(Option::as_ref) else { return };
        let (mut turned, mut sums) = ([0.0_f32; CUBE], [0.0_f32; CUBE]);
        for (&to, strength) in turn.iter().zip(sources) {
            turned[usize::from(to)] = *strength;
        }
        let (columns, _) = matrix.columns.as_chunks::<CUBE>();
        let (rows, _) = matrix.rows.as_chunks::<CUBE>();
        for (column, row) in columns.iter().zip(rows) {
            let strength = dot(row, &turned);
            sums.iter_mut().zip(column).for_each(|(sum, value)| *sum += value * strength);
        }
        for (&from, place) in turn.iter().zip(places) {
            *place += sums[usize::from(from)];
        }
    }
}

/// Σ aᵢbᵢ as eight sums side by side.
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

/// How nodes change places when axes are mirrored and swapped.
#[derive(Clone, Debug)]
pub struct Turns {
    /// By signs (three bits) and order of the axes (six): where each node goes.
    nodes: Vec<[u8; CUBE]>,
}

/// The orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

impl Turns {
    /// All 48.
    pub fn new() -> Self {
        let turn = |number: usize| {
            let (signs, order) = (number / 6, ORDERS[number % 6]);
            std::array::from_fn(|index| {
                let mut place = split(index);
                for (axis, along) in place.iter_mut().enumerate() {
                    if signs >> axis & 1 == 1 {
                        *along = NODES - 1 - *along;
                    }
                }
                joined(order.map(|axis| place[axis])) as u8
            })
        };
        Self { nodes: (0..48).map(turn).collect() }
    }

    /// The turn that makes an offset positive and descending, and the offset it becomes.
    fn find(&self, offset: Offset) -> (&[u8; CUBE], Offset) {
        let signs = (0..3).map(|axis| usize::from(offset[axis] < 0) << axis).sum::<usize>();
        let size = offset.map(i32::abs);
        let descends =
            |order: &[usize; 3]| size[order[0]] >= size[order[1]] && size[order[1]] >= size[order[2]];
        let order = ORDERS.iter().position(descends).unwrap_or(0);
        (&self.nodes[signs * 6 + order], ORDERS[order].map(|axis| size[axis]))
    }
}
