//! The numbers of vertices and triangles of the surfaces.

use super::cells::CellBox;
use super::label_grid::BACKGROUND;
use super::nets::{NetVertex, Nets};
use crate::pauses::Pauses;
use std::collections::BTreeSet;

/// The numbers of vertices and triangles of all surfaces together, or of a part of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
}

impl Counts {
    /// Returns the Euler characteristic, V − E + F; each edge has two triangles.
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - self.triangles as i64 / 2
    }

    /// Returns the numbers of vertices and triangles after collapses of `edges` edges.
    pub fn without(&self, edges: usize) -> [usize; 2] {
        [self.vertices - edges, self.triangles - 2 * edges]
    }

    /// Adds those of a part.
    pub fn add(&mut self, part: Self) {
        self.vertices += part.vertices;
        self.triangles += part.triangles;
    }

    /// Subtracts those of a part.
    pub fn remove(&mut self, part: Self) {
        self.vertices -= part.vertices;
        self.triangles -= part.triangles;
    }
}

impl Nets {
    /// Counts the vertices in and the polygons that begin at the cells of a box: calls `add` with parts of the counts of
    /// each label, by number.
    pub async fn count(&self, area: &CellBox, pauses: &Pauses, mut add: impl FnMut(u16, Counts)) {
        let mut on_faces = BTreeSet::new();
        for slot in self.cells.within(area) {
            pauses.after(1).await;
            let cell = self.cells.get(slot);
            cell.numbers()
                .for_each(|number| add(number, Counts { vertices: cell.vertices_of(number), triangles: 0 }));
            for crossing in self.crossings(slot) {
                let is_divided = self.has_face_vertices(&crossing);
                for far in [false, true] {
                    let number = crossing.ends[usize::from(far)];
                    if number == BACKGROUND {
                        continue;
                    }
                    if !is_divided {
                        add(number, Counts { vertices: 0, triangles: 2 });
                        continue;
                    }
                    let patch = self.patch(&crossing, far);
                    // Divided around a vertex of its own.
                    add(number, Counts { vertices: 1, triangles: patch.triangles().len() });
                    let faces = patch.triangles().iter().flatten();
                    on_faces.extend(faces.filter(|vertex| matches!(vertex, NetVertex::Face { .. })));
                }
            }
        }
        for vertex in on_faces {
            let NetVertex::Face { slot, corner, .. } = vertex else { continue };
            let cell = self.cells.get(slot);
            if area.contains(cell.at) {
                add(cell.corners[usize::from(corner)], Counts { vertices: 1, triangles: 0 });
            }
        }
    }
}
