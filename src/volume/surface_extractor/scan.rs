//! The scan of the surface extractor: a coarse search of the whole lattice for components of the surface without a
//! seed.
//!
//! Every `stride`-th node along each axis is evaluated. Two neighbouring coarse nodes are joined by a straight line of
//! lattice edges, which the surface crosses an odd number of times if exactly one end is inside, and an even number of
//! times otherwise. If the surface found so far crosses it with the other parity, a component is missing. Bisection
//! keeps a half of the line to which this applies, down to a cut lattice edge that was not found; the flood continues
//! from there.

use super::super::error::{VolumeError, reserve};
use super::Lattice;
use super::batch::Batch;
use super::blocks::{Blocks, Node, is_inside};
use super::flood::Flood;

/// Largest number of coarse nodes that the scan evaluates in one batch: limits memory, and is large enough for
/// functions that are faster when evaluated for many points at a time.
const BATCH: usize = 4096;

/// A straight line of lattice edges between two nodes, and whether its ends are inside, by which the scan finds missing
/// components of the surface.
#[derive(Clone, Copy)]
struct Line {
    from: Node,
    axis: usize,
    /// Coordinate along `axis` of the end of the line; it starts at `from`.
    to: usize,
    inside: [bool; 2],
}

impl Line {
    /// Returns whether a component of the surface that crosses the line has not been found: whether the surface found
    /// so far crosses the line an odd number of times although both ends are inside or both outside, or an even number
    /// of times although only one is inside.
    fn has_missing_component(&self, blocks: &Blocks) -> bool {
        (self.inside[0] != self.inside[1]) != blocks.crosses_oddly(self.from, self.axis, self.to)
    }

    fn middle(&self) -> Node {
        let mut node = self.from;
        node[self.axis] = usize::midpoint(self.from[self.axis], self.to);
        node
    }

    fn is_edge(&self) -> bool {
        self.to == self.from[self.axis] + 1
    }

    /// Returns a half of the line that a component not found yet crosses; one half is crossed if the line is.
    fn halved(&self, middle_inside: bool, blocks: &Blocks) -> Line {
        let middle = self.middle();
        let first = Line { to: middle[self.axis], inside: [self.inside[0], middle_inside], ..*self };
        let second = Line { from: middle, inside: [middle_inside, self.inside[1]], ..*self };
        if first.has_missing_component(blocks) { first } else { second }
    }
}

/// State of the scan: the coarse nodes (every `stride`-th one of the lattice), whether they are inside, and the line
/// between two of them that is being processed.
pub(super) struct Scan {
    /// Coordinates of the coarse nodes (those that the scan evaluates) along each axis, in the padded lattice,
    /// including both ends.
    axes: [Vec<usize>; 3],
    /// For each coarse node of the scan, whether it is inside the surface; x fastest, then y, z.
    inside: Vec<bool>,
    /// Number of coarse nodes of the scan that were evaluated or requested so far, in the order of `inside`.
    known: usize,
    /// Indices in `inside` of the coarse nodes in the current batch.
    requested: Vec<usize>,
    /// Number of the next line to test: axis + 3 × index of the coarse node where it starts.
    next_line: usize,
    /// The line that is being bisected, down to the edge at which a missing component crosses it; `None` between
    /// searches.
    line: Option<Line>,
    /// Whether a component was found in the current pass over all lines, so that another pass is needed.
    found_in_pass: bool,
    /// Number of components of the surface found by the scan so far.
    pub components_found: usize,
}

impl Scan {
    /// Creates a scan of every `stride`-th node of the lattice, including the first and last along each axis and the
    /// padding.
    pub fn new(stride: usize, blocks: &Blocks) -> Result<Self, VolumeError> {
        let axes = blocks.cells().map(|end| {
            let mut axis: Vec<usize> = [0].into_iter().chain((1..end).step_by(stride)).collect();
            axis.extend([end - 1, end]);
            axis.dedup();
            axis
        });
        let count = axes.iter().map(Vec::len).product();
        let mut inside = reserve(count)?;
        inside.resize(count, false);
        let requested = Vec::new();
        Ok(Self {
            axes,
            inside,
            known: 0,
            requested,
            next_line: 0,
            line: None,
            found_in_pass: false,
            components_found: 0,
        })
    }

    /// Fills `batch` with the points at which the scan needs the function next, or queues a cell of a missing component
    /// in the flood; returns false when the scan is complete.
    pub fn request(
        &mut self,
        blocks: &mut Blocks,
        flood: &mut Flood,
        lattice: &Lattice,
        batch: &mut Batch,
    ) -> Result<bool, VolumeError> {
        if self.known < self.inside.len() {
            self.request_nodes(blocks);
            batch.extend(self.requested.iter().map(|&coarse| lattice.position(self.node(coarse))));
            return Ok(true);
        }
        self.line = self.line.or_else(|| self.find_line(blocks));
        let Some(line) = self.line else { return Ok(false) };
        if line.is_edge() {
            // The cell was visited before only if the function is inconsistent: such a line would be found for ever.
            let is_new = flood.visit(line.from, blocks)?;
            self.line = None;
            self.components_found += usize::from(is_new);
            self.found_in_pass |= is_new;
        } else {
            batch.extend([lattice.position(line.middle())]);
        }
        Ok(true)
    }

    /// Stores the function values of the batch: those of coarse nodes, or the one at the middle of the line being
    /// bisected.
    pub fn store_values(&mut self, values: &[f64], blocks: &Blocks) {
        for (coarse, &value) in self.requested.drain(..).zip(values) {
            self.inside[coarse] = is_inside(value);
        }
        // There is no line until all coarse nodes are evaluated.
        if let (Some(line), Some(&value)) = (self.line, values.first()) {
            self.line = Some(line.halved(is_inside(value), blocks));
        }
    }

    /// Selects the next coarse nodes to evaluate; values that the flood has evaluated are reused.
    fn request_nodes(&mut self, blocks: &Blocks) {
        self.requested.clear();
        while self.known < self.inside.len() && self.requested.len() < BATCH {
            let node = self.node(self.known);
            let value = blocks.value(blocks.slot(node));
            if !value.is_nan() {
                self.inside[self.known] = is_inside(value);
            } else if !blocks.is_padding(node) {
                self.requested.push(self.known);
            }
            self.known += 1;
        }
    }

    /// Returns the next line that crosses a component not found yet; `None` when the scan is complete. A component just
    /// found can reveal another one on a line already tested, so the passes over all lines are repeated until nothing
    /// is found.
    fn find_line(&mut self, blocks: &Blocks) -> Option<Line> {
        loop {
            while self.next_line < 3 * self.inside.len() {
                let line = self.line(self.next_line);
                self.next_line += 1;
                if let Some(line) = line.filter(|line| line.has_missing_component(blocks)) {
                    return Some(line);
                }
            }
            if !std::mem::take(&mut self.found_in_pass) {
                return None;
            }
            self.next_line = 0;
        }
    }

    /// Returns line number `number`: axis + 3 × the coarse node from which it leads to the next one along that axis.
    /// `None` if there is no next one.
    fn line(&self, number: usize) -> Option<Line> {
        let (axis, coarse) = (number % 3, number / 3);
        let to = *self.axes[axis].get(self.index(coarse)[axis] + 1)?;
        let stride = self.axes[..axis].iter().map(Vec::len).product::<usize>();
        let inside = [self.inside[coarse], self.inside[coarse + stride]];
        Some(Line { from: self.node(coarse), axis, to, inside })
    }

    fn index(&self, coarse: usize) -> [usize; 3] {
        let [nx, ny] = [self.axes[0].len(), self.axes[1].len()];
        [coarse % nx, coarse / nx % ny, coarse / (nx * ny)]
    }

    fn node(&self, coarse: usize) -> Node {
        let index = self.index(coarse);
        std::array::from_fn(|k| self.axes[k][index[k]])
    }
}
