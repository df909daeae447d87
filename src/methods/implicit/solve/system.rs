//! The matrix of a system and its approximate inverse, and what a few other constraints change in them.

use super::clusters::ClusterTree;
use super::constraints::{ByPlace, Constraints};
use super::hierarchical::HierarchicalMatrix;
use super::precondition::SparseInverse;
use crate::math::{DVec3, Random, Vec3};
use crate::methods::implicit::kernel::{Kernel, KernelTable};
use crate::methods::implicit::vectors::{add, dot};

/// Values of the kernel, or as much work of another kind, in a slice: about ten milliseconds.
pub const WORK: usize = 2_000_000;
/// Values of the kernel that take as long as one row of the sparse inverse.
const ROW_WORK: usize = 4_000;
/// Error of far blocks, of the tolerance: with it the residual found at the end is seldom above the tolerance.
const FAR_ERROR: f64 = 0.1;
/// Constraints from which on far blocks are the more exact the more of them there are: errors add up, and a residual that is
/// too large is paid for with one from all pairs of constraints.
const USUAL_CONSTRAINTS: f64 = 25_000.0;
/// Error of far blocks where kernels are only conditionally positive definite: what is large in them cancels.
const CONDITIONAL_ERROR: f64 = 1e-11;
/// Constraints up to which the matrix is stored in double precision; beyond, memory matters more.
const DOUBLE_BELOW: usize = 6000;
/// Constraints that may be added, and as many taken away, without making all anew. Each costs a row of the full matrix.
const MOST_CHANGES: usize = 256;
/// The constraint of a place that has none any more.
const GONE: u32 = u32::MAX;

/// Φ + Λ of some constraints, with B and y: [Φ+Λ B; Bᵀ 0] [w; p] = [y; 0].
///
/// Each constraint has a place in all vectors: first those that the matrix was made for, in the order of its cluster tree,
/// then those added since. Places of constraints that were taken away stay; nothing but 0 ever stands there.
#[derive(Clone, Debug)]
pub struct System {
    table: KernelTable,
    centres: Vec<DVec3>,
    values: Vec<f64>,
    lambda: Vec<f64>,
    /// For each place, the constraint.
    order: Vec<u32>,
    matrix: Matrix,
    inverse: SparseInverse,
    revision: Option<Revision>,
}

/// What differs from the constraints that the matrix was made for.
#[derive(Clone, Debug)]
struct Revision {
    /// Of the matrix's places, those whose constraint was taken away.
    gone: Vec<bool>,
    /// For each place added, Φ between it and all places up to itself.
    rows: Vec<Vec<f64>>,
    inverse: SparseInverse,
}

#[derive(Clone, Debug)]
enum Matrix {
    Single(HierarchicalMatrix<f32>),
    Double(HierarchicalMatrix<f64>),
}

impl System {
    /// The system of `constraints`; nothing is made yet. Far parts of the matrix will be as exact as residuals of `tolerance`
    /// need it.
    pub fn new(constraints: &Constraints, kernel: Kernel, tolerance: f64, seed: u64) -> Self {
        let tree = ClusterTree::new(&constraints.centres);
        let order = tree.order.clone();
        let places: Vec<Vec3> = order.iter().map(|&i| constraints.centres[i as usize]).collect();
        let centres: Vec<DVec3> = places.iter().map(|p| p.as_dvec3()).collect();
        let values = at_places(&order, &constraints.values);
        let shuffled = Random::new(seed).order(places.len());
        let (surface, outside): (Vec<u32>, Vec<u32>) =
            shuffled.iter().partition(|&&i| values[i as usize] == 0.0);
        Self {
            table: KernelTable::new(kernel),
            matrix: Matrix::new(tree, &centres, kernel, tolerance),
            inverse: SparseInverse::new(&places, surface, outside),
            centres,
            values,
            lambda: at_places(&order, &constraints.lambda),
            order,
            revision: None,
        }
    }

    /// A slice of making matrix and inverse. Returns whether both are there.
    pub fn build(&mut self) -> bool {
        if self.revision.is_some() || self.matrix.progress() == 1.0 {
            return true;
        }
        if self.inverse.progress() < 1.0 {
            self.inverse.build(&self.centres, &self.lambda, &self.table, WORK / ROW_WORK);
            return false;
        }
        self.matrix.build(&self.table)
    }

    /// The share of [`Self::build`] that is done.
    pub fn progress(&self) -> f64 {
        if self.revision.is_some() {
            1.0
        } else {
            0.4 * self.inverse.progress() + 0.6 * self.matrix.progress()
        }
    }

    /// Whether [`Self::revise`] is worth while: few of the constraints differ from those the matrix was made for.
    pub fn is_near(&self, constraints: &Constraints) -> bool {
        let known = ByPlace::new(&constraints.centres);
        let own = self.own_centres();
        let kept = own.iter().filter(|c| known.find(c.as_vec3()).is_some()).count();
        own.len() - kept <= MOST_CHANGES && constraints.centres.len() - kept <= MOST_CHANGES
    }

    /// Turns to other constraints, once the matrix is there.
    pub fn revise(&mut self, constraints: &Constraints) {
        let own = self.own_centres().len();
        self.centres.truncate(own);
        let known = ByPlace::new(&constraints.centres);
        let mut is_new = vec![true; constraints.centres.len()];
        let mut find = |centre: &DVec3| {
            let found = known.find(centre.as_vec3())?;
            is_new[found] = false;
            Some(found as u32)
        };
        self.order = self.centres.iter().map(|centre| find(centre).unwrap_or(GONE)).collect();
        let gone: Vec<bool> = self.order.iter().map(|&i| i == GONE).collect();
        for i in (0..is_new.len()).filter(|&i| is_new[i]) {
            self.order.push(i as u32);
            self.centres.push(constraints.centres[i].as_dvec3());
        }
        self.values = at_places(&self.order, &constraints.values);
        self.lambda = at_places(&self.order, &constraints.lambda);
        let rows = (own..self.centres.len()).map(|i| self.row(i, i + 1).collect()).collect();
        let inverse = self.inverse.revised(&gone, &self.centres, &self.lambda, &self.table);
        self.revision = Some(Revision { gone, rows, inverse });
    }

    /// Whether it was.
    pub fn is_revised(&self) -> bool {
        self.revision.is_some()
    }

    /// Centres of the matrix.
    fn own_centres(&self) -> &[DVec3] {
        &self.centres[..self.revision.as_ref().map_or(self.centres.len(), |revision| revision.gone.len())]
    }

    /// Φ between a place and the first `count` places.
    fn row(&self, i: usize, count: usize) -> impl Iterator<Item = f64> {
        self.centres[..count].iter().map(move |c| self.table.value(self.centres[i].distance_squared(*c)))
    }

    /// The radial function.
    pub fn kernel(&self) -> Kernel {
        self.table.kernel()
    }

    /// The number of places.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Bytes of the matrix.
    pub fn matrix_bytes(&self) -> usize {
        match &self.matrix {
            Matrix::Single(matrix) => matrix.bytes(),
            Matrix::Double(matrix) => matrix.bytes(),
        }
    }

    /// y.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The approximate inverse of Φ + Λ.
    pub fn inverse(&self) -> &SparseInverse {
        self.revision.as_ref().map_or(&self.inverse, |revision| &revision.inverse)
    }

    /// What belongs to the constraints, by place.
    pub fn by_place(&self, of_constraints: &[f64]) -> Vec<f64> {
        at_places(&self.order, of_constraints)
    }

    /// What belongs to the places, by constraint.
    pub fn by_constraint(&self, of_places: &[f64]) -> Vec<f64> {
        let present = || self.order.iter().zip(of_places).filter(|(i, _)| **i != GONE);
        let mut all = vec![0.0; present().count()];
        present().for_each(|(&i, &x)| all[i as usize] = x);
        all
    }

    /// The columns of B: 1, and with a thin plate x, y and z.
    pub fn polynomials(&self) -> Vec<Vec<f64>> {
        let column = |power: usize| {
            let entry = |(centre, &i): (&DVec3, &u32)| match power {
                _ if i == GONE => 0.0,
                0 => 1.0,
                axis => centre[axis - 1],
            };
            self.centres.iter().zip(&self.order).map(entry).collect()
        };
        (0..self.kernel().polynomials()).map(column).collect()
    }

    /// (Φ+Λ)x with the approximated Φ.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let own = self.own_centres().len();
        let mut out = match &self.matrix {
            Matrix::Single(matrix) => matrix.product(&x[..own]),
            Matrix::Double(matrix) => matrix.product(&x[..own]),
        };
        out.resize(x.len(), 0.0);
        if let Some(Revision { gone, rows, .. }) = &self.revision {
            for (at, row) in (own..).zip(rows) {
                out[at] += dot(row, &x[..=at]);
                add(x[at], &row[..at], &mut out[..at]);
            }
            out.iter_mut().zip(gone).filter(|(_, gone)| **gone).for_each(|(y, _)| *y = 0.0);
        }
        out.iter_mut().zip(&self.lambda).zip(x).for_each(|((y, l), x)| *y += l * x);
        out
    }

    /// yᵢ − ((Φ+Λ)w)ᵢ from the kernel itself.
    pub fn row_residual(&self, i: usize, weights: &[f64]) -> f64 {
        if self.order[i] == GONE {
            return 0.0;
        }
        let sum: f64 = self.row(i, self.len()).zip(weights).map(|(phi, w)| phi * w).sum();
        self.values[i] - sum - self.lambda[i] * weights[i]
    }
}

fn at_places(order: &[u32], all: &[f64]) -> Vec<f64> {
    order.iter().map(|&i| if i == GONE { 0.0 } else { all[i as usize] }).collect()
}

impl Matrix {
    fn new(tree: ClusterTree, centres: &[DVec3], kernel: Kernel, tolerance: f64) -> Self {
        let conditional = kernel.is_conditional();
        let crowd = centres.len() as f64 / USUAL_CONSTRAINTS;
        let far = FAR_ERROR * tolerance / if crowd > 1.0 { crowd } else { 1.0 };
        let error = if conditional { CONDITIONAL_ERROR } else { far };
        if conditional || centres.len() <= DOUBLE_BELOW {
            Self::Double(HierarchicalMatrix::new(tree, centres.to_vec(), error))
        } else {
            Self::Single(HierarchicalMatrix::new(tree, centres.to_vec(), error))
        }
    }

    fn build(&mut self, table: &KernelTable) -> bool {
        let share = match self {
            Self::Single(matrix) => matrix.build(table, WORK),
            Self::Double(matrix) => matrix.build(table, WORK),
        };
        share == 1.0
    }

    fn progress(&self) -> f64 {
        match self {
            Self::Single(matrix) => matrix.progress(),
            Self::Double(matrix) => matrix.progress(),
        }
    }
}
