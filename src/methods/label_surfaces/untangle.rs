//! Self-intersections: polygons that intersect, of one label or of two, are found exactly, and their cells move back
//! towards their middle, where nothing intersects.
//!
//! A polygon lies within the four cells around its edge of the grid, so two polygons can only intersect if they share a
//! cell: tests are local to each cell. They use the positions in world space in single precision, as they are returned.

use super::cells::CellBox;
use super::nets::{NetVertex, Nets};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Facet, facets_intersect};
use std::collections::BTreeMap;

/// Number of times that a cell's distance from its middle is halved before it becomes zero.
const HALVINGS: u32 = 3;

/// A triangle of a polygon around one of the edges of a cell.
struct Piece {
    facet: Facet,
    bounds: Bounds,
    /// Index of the polygon.
    patch: usize,
}

/// The polygons around the edges of one cell, to be tested against each other.
#[derive(Default)]
struct Neighbourhood {
    pieces: Vec<Piece>,
    /// Label and identity of each vertex, in the order of their numbers in the facets.
    vertices: Vec<(u16, NetVertex)>,
    positions: Vec<Vec3>,
    /// Slots of the four cells of each polygon.
    slots: Vec<[u32; 4]>,
}

impl Nets {
    /// Moves cells towards their middle until no surfaces intersect in and around the cells of a box. Returns the number
    /// of cells moved.
    pub fn untangle(&mut self, area: CellBox) -> usize {
        let mut halved: BTreeMap<u32, u32> = BTreeMap::new();
        let slots = (0..).zip(self.cells.slots());
        let mut to_test: Vec<u32> = slots
            .filter(|(_, cell)| cell.is_live() && area.contains(cell.at))
            .map(|(slot, _)| slot)
            .collect();
        let mut neighbourhood = Neighbourhood::default();
        while !to_test.is_empty() {
            let mut tangled = Vec::new();
            for &slot in &to_test {
                neighbourhood.fill(self, slot);
                neighbourhood.find_intersections(&mut tangled);
            }
            crate::math::order::sort_distinct(&mut tangled);
            tangled.retain(|slot| halved.get(slot).is_none_or(|&times| times <= HALVINGS));
            for &slot in &tangled {
                let times = halved.entry(slot).or_default();
                *times += 1;
                let factor = if *times <= HALVINGS { 0.5 } else { 0.0 };
                *self.cells.offset_mut(slot) *= factor;
            }
            to_test = self.with_neighbours(&tangled);
        }
        halved.len()
    }

    /// Returns the given cells and all that share polygons with them.
    fn with_neighbours(&self, slots: &[u32]) -> Vec<u32> {
        let mut found = Vec::new();
        for &slot in slots {
            let at = self.cells.get(slot).at;
            let area = CellBox { low: at, high: at }.grown(1, self.grid.dims());
            for z in area.low[2]..=area.high[2] {
                for y in area.low[1]..=area.high[1] {
                    found.extend((area.low[0]..=area.high[0]).filter_map(|x| self.cells.find([x, y, z])));
                }
            }
        }
        crate::math::order::sort_distinct(&mut found);
        found
    }
}

impl Neighbourhood {
    /// Collects the polygons around the edges of the cell in a slot.
    fn fill(&mut self, nets: &Nets, slot: u32) {
        self.pieces.clear();
        self.vertices.clear();
        self.positions.clear();
        self.slots.clear();
        let at = nets.cells.get(slot).at;
        for owner in 0..7 {
            let last = super::cube_loops::corner_offset(owner);
            let mut cell = at;
            (0..3).for_each(|axis| cell[axis] += last[axis] as u32);
            let Some(owner) = nets.cells.find(cell) else { continue };
            // Edges along an axis in which the owner is beyond this cell are not edges of this cell.
            for crossing in nets.crossings(owner).filter(|crossing| last[crossing.axis] == 0) {
                for far in [false, true] {
                    let number = crossing.ends[usize::from(far)];
                    if number != super::label_grid::BACKGROUND {
                        self.add(nets, number, nets.patch(&crossing, far).triangles());
                        self.slots.push(crossing.slots);
                    }
                }
            }
        }
    }

    fn add(&mut self, nets: &Nets, number: u16, triangles: &[[NetVertex; 3]]) {
        for &triangle in triangles {
            let corners = triangle.map(|vertex| self.number_of(nets, (number, vertex)));
            let points = corners.map(|corner| self.positions[corner as usize]);
            let bounds = Bounds::from_points(&points);
            self.pieces.push(Piece { facet: Facet { corners, points }, bounds, patch: self.slots.len() });
        }
    }

    fn number_of(&mut self, nets: &Nets, vertex: (u16, NetVertex)) -> u32 {
        if let Some(known) = self.vertices.iter().position(|&known| known == vertex) {
            return known as u32;
        }
        self.vertices.push(vertex);
        self.positions.push(nets.world_position(vertex.0, vertex.1));
        self.vertices.len() as u32 - 1
    }

    /// Appends the slots of the cells of all polygons that intersect.
    fn find_intersections(&self, tangled: &mut Vec<u32>) {
        for (i, one) in self.pieces.iter().enumerate() {
            for other in &self.pieces[..i] {
                if one.bounds.overlaps(&other.bounds) && facets_intersect(&one.facet, &other.facet) {
                    tangled.extend(self.slots[one.patch]);
                    tangled.extend(self.slots[other.patch]);
                }
            }
        }
    }
}
