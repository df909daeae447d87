//! Hierarchical matrix of the linear system: Φ, the kernel between the centres of all constraints, with near blocks
//! stored in full and far ones as low-rank products. Its size and the time of a product grow as n log n.

use super::clusters::{Cluster, ClusterTree};
use crate::math::DVec3;
use crate::math::vectors::{MatrixScalar, add, dot};
use crate::methods::implicit::kernel::KernelTable;
use crate::methods::implicit::low_rank::{LowRank, cross_approximation};
use std::ops::Range;

/// Admissibility: two clusters count as far, and their block of the matrix is approximated by low rank, if they do not
/// touch, and the smaller one's diameter is at most this many times their distance. With a larger number ranks grow,
/// with a smaller one more blocks are stored in full.
const ADMISSIBILITY: f32 = 3.0;

/// A block of the hierarchical matrix on or above the diagonal, which also represents its mirror image.
#[derive(Clone, Debug)]
struct Block {
    rows: usize,
    columns: usize,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    /// A near block: its entries, row by row.
    Full(Span),
    /// A far block: the columns, then the rows of its low-rank approximation ([`LowRank`]).
    Far(Span, Span),
}

/// Location of a block's numbers in a [`Store`].
#[derive(Clone, Debug)]
struct Span {
    chunk: usize,
    range: Range<usize>,
}

/// Storage for the entries of all blocks of a matrix, in a few large chunks. With thousands of small allocations, the
/// memory of a wasm module grows page by page, which took longer than all the computation.
#[derive(Clone, Debug)]
struct Store<T> {
    chunk_size: usize,
    chunks: Vec<Vec<T>>,
}

/// Maximum number of entries in a chunk of a [`Store`]; a longer span gets a chunk of its own.
const CHUNK: usize = 1 << 20;

impl<T: Copy> Store<T> {
    /// Creates an empty store of entries for a matrix between `count` centres.
    fn new(count: usize) -> Self {
        let all = count.saturating_mul(count);
        Self { chunk_size: if all < CHUNK { all } else { CHUNK }, chunks: Vec::new() }
    }

    fn push(&mut self, numbers: &[T]) -> Span {
        let full = |chunk: &Vec<T>| chunk.capacity() - chunk.len() < numbers.len();
        if self.chunks.last().is_none_or(full) {
            self.chunks.push(Vec::with_capacity(self.chunk_size.max(numbers.len())));
        }
        let chunk = self.chunks.len() - 1;
        let start = self.chunks[chunk].len();
        self.chunks[chunk].extend_from_slice(numbers);
        Span { chunk, range: start..start + numbers.len() }
    }

    fn get(&self, span: &Span) -> &[T] {
        &self.chunks[span.chunk][span.range.clone()]
    }
}

/// A symmetric matrix Φ of the kernel between all pairs of centres, as a hierarchical matrix, with rows and columns in
/// the order of its cluster tree, and entries stored as `T`.
#[derive(Clone, Debug)]
pub struct HierarchicalMatrix<T> {
    centres: Vec<DVec3>,
    tree: ClusterTree,
    tolerance: f64,
    /// Pairs of clusters (of rows, of columns) whose blocks are still to be computed, and whether they are far; the
    /// next pair is last.
    pending: Vec<(usize, usize, bool)>,
    blocks: Vec<Block>,
    store: Store<T>,
}

impl<T: MatrixScalar> HierarchicalMatrix<T> {
    /// Creates the matrix of the kernel between `centres`, which are in the order of `tree`. It is empty until
    /// [`Self::build`] has computed all blocks, far ones to a relative error of `tolerance`.
    pub fn new(tree: ClusterTree, centres: Vec<DVec3>, tolerance: f64) -> Self {
        let mut pending = Vec::new();
        divide(&tree.clusters, 0, 0, &mut pending);
        pending.reverse();
        Self { store: Store::new(centres.len()), centres, tree, tolerance, pending, blocks: Vec::new() }
    }

    /// Computes further blocks of the matrix until about `work` values of the kernel, tabulated in `table`, have been
    /// evaluated. Returns the share of blocks computed, 1 at the end.
    pub fn build(&mut self, table: &KernelTable, work: usize) -> f64 {
        let mut done = 0;
        while done < work
            && let Some((rows, columns, far)) = self.pending.pop()
        {
            let [a, b] = [rows, columns].map(|c| &self.tree.clusters[c]);
            let content = if far {
                let block = self.far_block(a, b, table);
                done += 2 * (block.columns.len() + block.rows.len());
                Content::Far(self.store.push(&block.columns), self.store.push(&block.rows))
            } else {
                done += a.len() * b.len();
                let block = self.full_block(a, b, table);
                Content::Full(self.store.push(&block))
            };
            self.blocks.push(Block { rows, columns, content });
        }
        self.progress()
    }

    /// Returns the share of the matrix's blocks that are computed, 0 to 1.
    pub fn progress(&self) -> f64 {
        let done = self.blocks.len();
        done as f64 / (done + self.pending.len()) as f64
    }

    /// Returns the size of all blocks of the matrix computed so far, in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<T>() * self.store.chunks.iter().map(Vec::len).sum::<usize>()
    }

    fn full_block(&self, a: &Cluster, b: &Cluster, table: &KernelTable) -> Vec<T> {
        let columns = &self.centres[b.start..b.end];
        let rows = self.centres[a.start..a.end].iter();
        rows.flat_map(|x| columns.iter().map(|y| T::from_f64(table.value(x.distance_squared(*y))))).collect()
    }

    fn far_block(&self, a: &Cluster, b: &Cluster, table: &KernelTable) -> LowRank<T> {
        let [rows, columns] = [a, b].map(|c| &self.centres[c.start..c.end]);
        let fill = |from: DVec3, to: &[DVec3], out: &mut [f64]| {
            out.iter_mut().zip(to).for_each(|(value, x)| *value = table.value(from.distance_squared(*x)));
        };
        cross_approximation(
            [rows.len(), columns.len()],
            self.tolerance,
            |i, out| fill(rows[i], columns, out),
            |j, out| fill(columns[j], rows, out),
        )
    }

    /// Returns the product Φx of the kernel matrix and a vector `x`; both vectors are in the order of the cluster tree.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        for block in &self.blocks {
            let [a, b] = [block.rows, block.columns].map(|c| &self.tree.clusters[c]);
            match &block.content {
                Content::Full(values) => full_product(self.store.get(values), [a, b], x, &mut out),
                Content::Far(columns, rows) => {
                    let low_rank = [columns, rows].map(|span| self.store.get(span));
                    far_product(low_rank, [a, b], x, &mut out);
                }
            }
        }
        out
    }
}

/// Divides the matrix block between clusters `a` and `b` into far blocks and full blocks between leaves, and appends
/// these to `out`: the clusters of rows and of columns, and whether they are far. The cluster of the lower index has
/// the rows.
fn divide(clusters: &[Cluster], a: usize, b: usize, out: &mut Vec<(usize, usize, bool)>) {
    let [first, second] = [a, b].map(|c| &clusters[c]);
    let [size, other] = [first, second].map(Cluster::diameter);
    let smaller = if size < other { size } else { other };
    let distance = first.distance(second);
    if distance > 0.0 && smaller <= ADMISSIBILITY * distance {
        out.push((a, b, true));
        return;
    }
    match (first.halves, second.halves) {
        (None, None) => out.push((a, b, false)),
        (Some([low, high]), _) if a == b => {
            divide(clusters, low, low, out);
            divide(clusters, low, high, out);
            divide(clusters, high, high, out);
        }
        (Some(halves), None) => halves.into_iter().for_each(|half| divide(clusters, half, b, out)),
        (Some(halves), Some(_)) if size >= other => {
            halves.into_iter().for_each(|half| divide(clusters, half, b, out));
        }
        (_, Some(halves)) => halves.into_iter().for_each(|half| divide(clusters, a, half, out)),
    }
}

fn full_product<T: MatrixScalar>(values: &[T], [a, b]: [&Cluster; 2], x: &[f64], out: &mut [f64]) {
    let own = a.start == b.start;
    for (i, row) in (a.start..a.end).zip(values.chunks_exact(b.len())) {
        out[i] += dot(row, &x[b.start..b.end]);
        if !own {
            add(x[i], row, &mut out[b.start..b.end]);
        }
    }
}

fn far_product<T: MatrixScalar>(
    [columns, rows]: [&[T]; 2],
    [a, b]: [&Cluster; 2],
    x: &[f64],
    out: &mut [f64],
) {
    for (u, v) in columns.chunks_exact(a.len()).zip(rows.chunks_exact(b.len())) {
        let (from_rows, from_columns) = (dot(u, &x[a.start..a.end]), dot(v, &x[b.start..b.end]));
        add(from_columns, u, &mut out[a.start..a.end]);
        add(from_rows, v, &mut out[b.start..b.end]);
    }
}
