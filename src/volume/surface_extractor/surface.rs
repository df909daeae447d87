//! The extracted surface: mesh vertices and triangles in the cells that the flood found to be crossed, in an order
//! independent of the order of discovery.

use super::super::cube_cases::{Case, EDGES, cases, corner};
use super::super::error::{VolumeError, reserve};
use super::Lattice;
use super::batch::Batch;
use super::blocks::{Blocks, next};
use super::flood::CrossedCell;
use super::root::Root;
use crate::math::DVec3;
use crate::math::order::sort_pairs;
use crate::mesh::TriangleMesh;

const NONE: u32 = u32::MAX;

/// Returns which of the three edges that start at a cell's first node, the one of lowest coordinates, are cut in this
/// marching cubes case: one bit per axis.
fn crossed_near_edges(case: u8) -> u8 {
    let far_ends = [corner([1, 0, 0]), corner([0, 1, 0]), corner([0, 0, 1])];
    (0..3).fold(0, |cuts, axis| cuts | ((case ^ case >> far_ends[axis]) & 1) << axis)
}

/// A mesh vertex: the intersection of the surface with the lattice edge from a node (`slot`) along an axis.
struct Vertex {
    slot: u32,
    axis: usize,
    root: Root,
}

/// The crossed cells and the mesh vertices in them, both sorted by block of the storage, then node.
pub(super) struct Surface {
    cells: Vec<CrossedCell>,
    /// For each cell in `cells`, the index of the first of its own vertices, which are those on cut edges that start at
    /// its first node, in the order of the axes.
    first: Vec<u32>,
    /// For each slot of the storage, the index in `cells` of the cell that starts at its node, or [`NONE`] if that is
    /// not crossed.
    index: Vec<u32>,
    vertices: Vec<Vertex>,
    /// Indices of the vertices whose function values are in the current refinement batch.
    requested: Vec<usize>,
}

impl Surface {
    /// Builds the surface of the given cells, with vertices placed by linear interpolation of the node values.
    pub fn new(crossed: &[CrossedCell], blocks: &Blocks) -> Result<Self, VolumeError> {
        let (mut order, mut cells) = (reserve(crossed.len())?, reserve(crossed.len())?);
        order.extend(crossed.iter().map(|cell| blocks.rank(cell.slot)).zip(0_u32..));
        sort_pairs(&mut order);
        cells.extend(order.iter().map(|&(_, i)| crossed[i as usize]));
        let count = cells.iter().map(|cell| crossed_near_edges(cell.case).count_ones() as usize).sum();
        let (mut vertices, mut first, mut index) =
            (reserve(count)?, reserve(cells.len())?, reserve(blocks.slots())?);
        index.resize(blocks.slots(), NONE);
        for (at, &CrossedCell { slot, case }) in cells.iter().enumerate() {
            index[slot as usize] = at as u32;
            first.push(vertices.len() as u32);
            let axes = (0..3).filter(|axis| crossed_near_edges(case) >> axis & 1 == 1);
            vertices.extend(axes.map(|axis| Vertex { slot, axis, root: root(slot, axis, blocks) }));
        }
        Ok(Self { cells, first, index, vertices, requested: Vec::new() })
    }

    /// Fills `batch` with the estimated positions of all vertices whose root finding has not converged; returns false
    /// if all have.
    pub fn request(&mut self, blocks: &Blocks, lattice: &Lattice, batch: &mut Batch) -> bool {
        let Self { vertices, requested, .. } = self;
        requested.clear();
        requested.extend((0..vertices.len()).filter(|&v| !vertices[v].root.has_converged()));
        batch.extend(requested.iter().map(|&v| {
            let Vertex { slot, axis, root } = &vertices[v];
            lattice.on_edge(blocks.node(*slot), *axis, root.estimate())
        }));
        !requested.is_empty()
    }

    /// Passes the function values of the refinement batch to the root finders of its vertices.
    pub fn store_values(&mut self, values: &[f64]) {
        for (v, &value) in self.requested.drain(..).zip(values) {
            self.vertices[v].root.add_sample(value);
        }
    }

    /// Returns the world positions of the mesh vertices, in the order of their indices.
    pub fn positions(&self, blocks: &Blocks, lattice: &Lattice) -> impl ExactSizeIterator<Item = DVec3> {
        self.vertices.iter().map(|v| lattice.on_edge(blocks.node(v.slot), v.axis, v.root.fraction()))
    }

    /// Builds the mesh of all triangles whose three vertices exist, which are all once the flood is complete.
    pub fn mesh(&self, blocks: &Blocks, lattice: &Lattice) -> Result<TriangleMesh, VolumeError> {
        let cases = cases();
        let case = |cell: &CrossedCell| &cases[usize::from(cell.case)];
        let mut positions = reserve(self.vertices.len())?;
        positions.extend(self.positions(blocks, lattice).map(|p| p.as_vec3()));
        let mut triangles = reserve(self.cells.iter().map(|cell| case(cell).triangles.len()).sum())?;
        for cell in &self.cells {
            triangles.extend(self.triangles(cell, case(cell), blocks));
        }
        Ok(TriangleMesh { positions, triangles, ..Default::default() })
    }

    fn triangles<'a>(
        &'a self,
        cell: &CrossedCell,
        case: &'a Case,
        blocks: &Blocks,
    ) -> impl Iterator<Item = [u32; 3]> + 'a {
        let corners = blocks.corners(cell.slot);
        let on_edge = move |edge: u8| {
            let (axis, offset) = EDGES[usize::from(edge)];
            self.vertex(corners[corner(offset)], axis)
        };
        case.triangles.iter().filter_map(move |&[a, b, c]| Some([on_edge(a)?, on_edge(b)?, on_edge(c)?]))
    }

    /// Returns the index of the vertex on the cut edge from a node along an axis; `None` if the cell that starts at the
    /// node has not been found yet.
    fn vertex(&self, slot: u32, axis: usize) -> Option<u32> {
        let at = *self.index.get(slot as usize)? as usize;
        let before = crossed_near_edges(self.cells.get(at)?.case) & ((1 << axis) - 1);
        Some(self.first[at] + before.count_ones())
    }
}

/// Returns the root finder of the cut edge from a node along an axis; for an edge into the padding, it is converged at
/// the middle.
fn root(slot: u32, axis: usize, blocks: &Blocks) -> Root {
    let from = blocks.node(slot);
    let to = next(from, axis);
    if blocks.is_padding(from) || blocks.is_padding(to) {
        return Root::fixed();
    }
    Root::between(blocks.value(slot), blocks.value(blocks.slot(to)))
}
