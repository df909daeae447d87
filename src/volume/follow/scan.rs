//! The scan: a coarse look at the whole lattice for pieces of the surface that no seed led to.
//!
//! Every so many nodes one is evaluated. Between two neighbouring ones runs a straight line of lattice edges, which the
//! surface crosses an odd number of times if one end is inside and the other outside, and an even number of times
//! otherwise. Where what was followed crosses it otherwise, a piece is missing. Halving the line keeps a half of
//! which the same is true, down to a lattice edge that is cut and was not followed; the flood goes on from there.

use super::super::error::{VolumeError, reserve};
use super::Lattice;
use super::batch::Batch;
use super::blocks::{Blocks, Node, is_inside};
use super::flood::Flood;

/// Coarse nodes evaluated in one batch: bounds memory, and is plenty for a sum that works in batches.
const BATCH: usize = 4096;

/// A straight line of lattice edges, and whether its ends are inside.
#[derive(Clone, Copy)]
struct Line {
    from: Node,
    axis: usize,
    /// Coordinate of the other end.
    to: usize,
    inside: [bool; 2],
}

impl Line {
    /// Whether the surface crosses the line where it was not followed.
    fn misses_a_piece(&self, blocks: &Blocks) -> bool {
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

    /// The half that misses a piece, as one of them does if the line does.
    fn halved(&self, middle_inside: bool, blocks: &Blocks) -> Line {
        let middle = self.middle();
        let first = Line { to: middle[self.axis], inside: [self.inside[0], middle_inside], ..*self };
        let second = Line { from: middle, inside: [middle_inside, self.inside[1]], ..*self };
        if first.misses_a_piece(blocks) { first } else { second }
    }
}

/// Coarse nodes, what is known of them, and how far the scan has come.
pub(super) struct Scan {
    /// Coordinates of the coarse nodes along each axis, in the padded lattice with both its ends.
    axes: [Vec<usize>; 3],
    /// Whether each coarse node is inside, x fastest, then y, z.
    inside: Vec<bool>,
    /// Coarse nodes that have been asked for.
    known: usize,
    /// Those of the present batch.
    asked: Vec<usize>,
    /// Number of the next line: axis + 3 × the coarse node where it starts.
    next_line: usize,
    /// The line that is being halved.
    line: Option<Line>,
    /// Whether a piece was found since the first line.
    found_some: bool,
    /// Pieces found so far.
    pub found: usize,
}

impl Scan {
    /// A look at every `stride`-th node of the lattice, the first and the last along each axis among them.
    pub fn new(stride: usize, blocks: &Blocks) -> Result<Self, VolumeError> {
        let axes = blocks.cells().map(|end| {
            let mut axis: Vec<usize> = (1..end).step_by(stride).collect();
            axis.extend([0, end - 1, end]);
            axis.sort_unstable();
            axis.dedup();
            axis
        });
        let count = axes.iter().map(Vec::len).product();
        let mut inside = reserve(count)?;
        inside.resize(count, false);
        let asked = Vec::new();
        Ok(Self { axes, inside, known: 0, asked, next_line: 0, line: None, found_some: false, found: 0 })
    }

    /// Fills `batch` with what the scan needs next, or queues a cell in the flood; false when it is done.
    pub fn ask(
        &mut self,
        blocks: &mut Blocks,
        flood: &mut Flood,
        lattice: &Lattice,
        batch: &mut Batch,
    ) -> Result<bool, VolumeError> {
        if self.known < self.inside.len() {
            self.ask_nodes(blocks);
            batch.extend(self.asked.iter().map(|&coarse| lattice.position(self.node(coarse))));
            return Ok(true);
        }
        self.line = self.line.or_else(|| self.find_line(blocks));
        let Some(line) = self.line else { return Ok(false) };
        if line.is_edge() {
            // Seen before only where the function changes its mind: such a line would be found for ever.
            let is_new = flood.look_at(line.from, blocks)?;
            self.line = None;
            self.found += usize::from(is_new);
            self.found_some |= is_new;
        } else {
            batch.extend([lattice.position(line.middle())]);
        }
        Ok(true)
    }

    /// Takes the values that were asked for.
    pub fn take(&mut self, values: &[f64], blocks: &Blocks) {
        for (coarse, &value) in self.asked.drain(..).zip(values) {
            self.inside[coarse] = is_inside(value);
        }
        // While coarse nodes are asked for there is no line yet.
        if let (Some(line), Some(&value)) = (self.line, values.first()) {
            self.line = Some(line.halved(is_inside(value), blocks));
        }
    }

    /// Chooses the next coarse nodes to be evaluated, and fills in those that the flood evaluated.
    fn ask_nodes(&mut self, blocks: &Blocks) {
        self.asked.clear();
        while self.known < self.inside.len() && self.asked.len() < BATCH {
            let node = self.node(self.known);
            let value = blocks.value(blocks.slot(node));
            if !value.is_nan() {
                self.inside[self.known] = is_inside(value);
            } else if !blocks.is_padding(node) {
                self.asked.push(self.known);
            }
            self.known += 1;
        }
    }

    /// The next line on which a piece is missing. A piece that was followed can show that a line has another one, so
    /// the lines are gone through until nothing is found.
    fn find_line(&mut self, blocks: &Blocks) -> Option<Line> {
        loop {
            while self.next_line < 3 * self.inside.len() {
                let line = self.line(self.next_line);
                self.next_line += 1;
                if let Some(line) = line.filter(|line| line.misses_a_piece(blocks)) {
                    return Some(line);
                }
            }
            if !std::mem::take(&mut self.found_some) {
                return None;
            }
            self.next_line = 0;
        }
    }

    /// The line from a coarse node to its next neighbour along an axis, where there is one.
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
