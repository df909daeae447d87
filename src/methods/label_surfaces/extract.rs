//! The surfaces as meshes in world space.

use super::label_grid::BACKGROUND;
use super::nets::{NetVertex, Nets};
use crate::mesh::TriangleMesh;
use std::collections::BTreeMap;

/// Collects the surface of one label after another in one mesh.
struct Extraction<'a> {
    nets: &'a Nets,
    mesh: TriangleMesh,
    /// Index in the mesh of the first vertex in each cell, from the first one in which the label is to the last one; those
    /// of its other loops follow.
    first: Vec<u32>,
    /// Slot of the first cell in which the label is.
    start: u32,
    /// Index in the mesh of each vertex on a face.
    on_faces: BTreeMap<NetVertex, u32>,
}

impl Nets {
    /// Returns the surface of the label that `number` stands for, in world space; empty if it has no voxels.
    pub fn mesh(&self, number: u16) -> TriangleMesh {
        let mut extraction = Extraction::new(self);
        extraction.add(number);
        extraction.mesh
    }

    /// Returns the surfaces of all labels in one mesh, in world space, label by label.
    pub fn all_meshes(&self) -> TriangleMesh {
        let mut extraction = Extraction::new(self);
        let numbers = self.grid.values().len() as u16;
        (1..=numbers).for_each(|number| extraction.add(number));
        extraction.mesh
    }
}

impl<'a> Extraction<'a> {
    fn new(nets: &'a Nets) -> Self {
        let mesh = TriangleMesh { origin: nets.origin(), ..TriangleMesh::default() };
        Self { nets, mesh, first: Vec::new(), start: 0, on_faces: BTreeMap::new() }
    }

    fn add(&mut self, number: u16) {
        debug_assert_ne!(number, BACKGROUND);
        let nets = self.nets;
        let reflected = nets.to_world().matrix3.determinant() < 0.0;
        let slots = nets.slots_of(number);
        let [Some(&start), Some(&last)] = [slots.first(), slots.last()] else { return };
        self.on_faces.clear();
        self.start = start;
        self.first.clear();
        self.first.resize((last - start) as usize + 1, 0);
        for &slot in slots {
            if nets.coarse.target(slot) != slot {
                continue;
            }
            self.first[(slot - start) as usize] = self.mesh.positions.len() as u32;
            for on in 0..nets.cells.get(slot).vertices_of(number) as u8 {
                let vertex = NetVertex::Cell { slot, on };
                self.mesh.positions.push(nets.shifted_position(number, vertex, nets.coarse.shift(slot)));
            }
        }
        for &slot in slots {
            for crossing in nets.crossings(slot) {
                let Some(far) = crossing.ends.iter().position(|&end| end == number) else { continue };
                let mut on_edge = None;
                for triangle in nets.patch(&crossing, far == 1).triangles() {
                    let index = |vertex| self.index(number, nets.coarse.follow(vertex), &mut on_edge);
                    let mut corners = triangle.map(index);
                    if reflected {
                        corners.swap(1, 2);
                    }
                    let [a, b, c] = corners;
                    // Between merged cells, nothing is left.
                    if a != b && b != c && c != a {
                        self.mesh.triangles.push(corners);
                    }
                }
            }
        }
    }

    /// Returns the index of a vertex in the mesh; `on_edge` is that of the vertex on the edge around which the present
    /// polygon lies.
    fn index(&mut self, number: u16, vertex: NetVertex, on_edge: &mut Option<u32>) -> u32 {
        let next = self.mesh.positions.len() as u32;
        let index = match vertex {
            NetVertex::Cell { slot, on } => self.first[(slot - self.start) as usize] + u32::from(on),
            NetVertex::Face { .. } => *self.on_faces.entry(vertex).or_insert(next),
            NetVertex::Edge { .. } => *on_edge.get_or_insert(next),
        };
        if index == next {
            self.mesh.positions.push(self.nets.world_position(number, vertex));
        }
        index
    }
}
