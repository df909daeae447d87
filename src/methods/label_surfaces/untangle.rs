//! Self-intersections: polygons that intersect, of one label or of two, are found exactly, and their cells move back
//! towards their middle, where nothing intersects.
//!
//! A polygon lies within the four cells around its edge of the grid, so two polygons can only intersect if they share a
//! cell: tests are local to each cell. They use the positions in world space in single precision, as they are returned.

use super::cells::CellBox;
use super::cube_loops::corner_offset;
use super::label_grid::BACKGROUND;
use super::nets::{Crossing, NetVertex, Nets};
use super::zone::Zone;
use crate::math::Vec3;
use crate::math::order::sort_distinct;
use crate::mesh::{Facet, facets_intersect};
use crate::pauses::Pauses;
use std::collections::BTreeMap;
use std::ops::Range;

/// Number of times that a cell's distance from its middle is halved before it becomes zero.
const HALVINGS: u32 = 3;

/// Sine-like measure below which a triangle counts as a needle, whose normal is not relied on: twice its area, in
/// square voxels.
const NEEDLE: f32 = 1e-3;
/// Units of work of the test of a cell.
const WORK_OF_CELL: usize = 8;
/// Number of polygons that are tested by themselves at once, and units of work of that.
const POLYGONS: usize = 256;
const WORK_OF_POLYGONS: usize = 20;
/// Distance, in voxels, by which positions may differ between index space and world space in single precision, with
/// room to spare.
const MARGIN: f32 = 1e-3;

/// A triangle of a polygon around one of the edges of a cell.
pub struct Piece {
    /// Indices of its vertices.
    pub corners: [u32; 3],
    /// Positions in index space, relative to a cell.
    pub points: [Vec3; 3],
    /// Unit normal; zero for needles.
    pub normal: Vec3,
}

impl Piece {
    /// Creates a triangle.
    pub fn new(corners: [u32; 3], points: [Vec3; 3]) -> Self {
        let area = (points[1] - points[0]).cross(points[2] - points[0]);
        let length = area.length();
        let normal = if length > NEEDLE { area / length } else { Vec3::ZERO };
        Self { corners, points, normal }
    }
}

/// A polygon around one of the edges of a cell.
struct Polygon {
    /// Its triangles, as a range of the pieces.
    pieces: Range<usize>,
    /// Indices of its vertices, if it is divided by a diagonal.
    corners: Option<[u32; 4]>,
    /// Positions of these vertices.
    points: [Vec3; 4],
}

/// The polygons around the edges of one cell, to be tested against each other.
#[derive(Default)]
struct Neighbourhood {
    /// Slot of the cell.
    slot: u32,
    /// Slots of the four cells around each edge that is crossed, and the range of its polygons, one or two.
    edges: Vec<([u32; 4], Range<usize>)>,
    polygons: Vec<Polygon>,
    pieces: Vec<Piece>,
    /// Label and identity of each vertex.
    vertices: Vec<(u16, NetVertex)>,
    /// Positions of the vertices in index space, relative to the cell.
    positions: Vec<Vec3>,
}

/// For the cells in all slots, which pairs of polygons are to be tested.
struct Search {
    /// Whether surfaces may intersect in the cell.
    in_doubt: Vec<bool>,
    /// Whether pairs of which it is the first common cell are tested.
    is_wanted: Vec<bool>,
    /// Whether each polygon of the zone surely intersects no other.
    is_clear: Vec<bool>,
}

impl Nets {
    /// Moves cells towards their middle until no surfaces intersect in and around the cells of a box, those of a zone that
    /// has their positions and those around it, or any others. Returns the slots of the cells moved.
    pub async fn untangle(&mut self, area: CellBox, mut zone: Option<&mut Zone>, pauses: &Pauses) -> Vec<u32> {
        let mut halved: BTreeMap<u32, u32> = BTreeMap::new();
        let mut search = Search::new(self, zone.as_deref(), pauses).await;
        let mut to_test = self.cells.within(&area);
        let mut candidates = self.cells.within(&area.grown(1, self.grid.dims()));
        let mut neighbourhood = Neighbourhood::default();
        while !to_test.is_empty() {
            to_test.iter().for_each(|&slot| search.is_wanted[slot as usize] = true);
            let mut tangled = Vec::new();
            candidates.retain(|&slot| search.in_doubt[slot as usize]);
            if std::env::var("STATS").is_ok() { eprintln!("to_test {} candidates {} polygons clear {}/{}", to_test.len(), candidates.len(), search.is_clear.iter().filter(|&&x| x).count(), search.is_clear.len()); }
            for &slot in &candidates {
                neighbourhood.fill(self, slot);
                neighbourhood.find_intersections(self, &search, &mut tangled);
                pauses.after(WORK_OF_CELL).await;
            }
            to_test.iter().for_each(|&slot| search.is_wanted[slot as usize] = false);
            sort_distinct(&mut tangled);
            tangled.retain(|slot| halved.get(slot).is_none_or(|&times| times <= HALVINGS));
            if std::env::var("STATS").is_ok() { eprintln!("  tangled {}", tangled.len()); }
            for &slot in &tangled {
                let times = halved.entry(slot).or_default();
                *times += 1;
                let factor = if *times <= HALVINGS { 0.5 } else { 0.0 };
                *self.cells.offset_mut(slot) *= factor;
            }
            if let Some(zone) = &mut zone {
                zone.read(self);
                search.update(self, zone, &tangled, pauses).await;
            }
            to_test = self.with_neighbours(&tangled);
            candidates = self.with_neighbours(&to_test);
        }
        halved.into_keys().collect()
    }

    /// Returns the given cells and all that share polygons with them.
    fn with_neighbours(&self, slots: &[u32]) -> Vec<u32> {
        let mut found = Vec::new();
        for &slot in slots {
            let at = self.cells.get(slot).at;
            let area = CellBox { low: at, high: at }.grown(1, self.grid.dims());
            found.extend(self.cells.within(&area));
        }
        sort_distinct(&mut found);
        found
    }
}

impl Search {
    /// Tests the polygons of a zone; outside of it, and without one, surfaces may intersect in all cells.
    async fn new(nets: &Nets, zone: Option<&Zone>, pauses: &Pauses) -> Self {
        let slots = nets.cells.slots().len();
        let mut search = Self { in_doubt: vec![true; slots], is_wanted: vec![false; slots], is_clear: Vec::new() };
        if let Some(zone) = zone {
            for polygons in zone.polygons.chunks(POLYGONS) {
                search.is_clear.extend(polygons.iter().map(|polygon| zone.is_clear(nets, polygon)));
                pauses.after(WORK_OF_POLYGONS).await;
            }
            search.spread(zone);
        }
        search
    }

    /// Tests the polygons around cells in given slots again, which have moved.
    async fn update(&mut self, nets: &Nets, zone: &Zone, slots: &[u32], pauses: &Pauses) {
        let mut has_moved = vec![false; self.in_doubt.len()];
        slots.iter().for_each(|&slot| has_moved[slot as usize] = true);
        let has_moved: Vec<bool> = zone.slots.iter().map(|&slot| has_moved[slot as usize]).collect();
        for (is_clear, polygon) in self.is_clear.iter_mut().zip(&zone.polygons) {
            if polygon.cells.iter().any(|&i| has_moved[i as usize]) {
                *is_clear = zone.is_clear(nets, polygon);
            }
        }
        pauses.after(zone.polygons.len() / POLYGONS).await;
        self.spread(zone);
    }

    /// Notes in which cells of a zone surfaces may intersect: those of polygons that may.
    fn spread(&mut self, zone: &Zone) {
        zone.slots[..zone.moving()].iter().for_each(|&slot| self.in_doubt[slot as usize] = false);
        for (_, polygon) in self.is_clear.iter().zip(&zone.polygons).filter(|&(&is_clear, _)| !is_clear) {
            polygon.cells.iter().for_each(|&i| self.in_doubt[zone.slots[i as usize] as usize] = true);
        }
    }

    /// Returns whether a pair of polygons, given by the cells around the edge of each, is tested in the cell in a slot: in
    /// the first one that both have in common and in which surfaces may intersect.
    fn is_tested_in(&self, slot: u32, one: &[u32; 4], other: &[u32; 4]) -> bool {
        let common = || one.iter().copied().filter(|slot| other.contains(slot));
        common().min().is_some_and(|first| self.is_wanted[first as usize])
            && common().filter(|&slot| self.in_doubt[slot as usize]).min() == Some(slot)
    }
}

impl Neighbourhood {
    /// Collects the polygons around the edges of the cell in a slot.
    fn fill(&mut self, nets: &Nets, slot: u32) {
        self.slot = slot;
        self.edges.clear();
        self.polygons.clear();
        self.pieces.clear();
        self.vertices.clear();
        self.positions.clear();
        let at = nets.cells.get(slot).at;
        for owner in 0..7 {
            let last = corner_offset(owner);
            let mut cell = at;
            (0..3).for_each(|axis| cell[axis] += last[axis] as u32);
            let Some(owner) = nets.cells.find(cell) else { continue };
            // Edges along an axis in which the owner is beyond this cell are not edges of this cell.
            for crossing in nets.crossings(owner).filter(|crossing| last[crossing.axis] == 0) {
                let first = self.polygons.len();
                for far in [false, true] {
                    let number = crossing.ends[usize::from(far)];
                    if number != BACKGROUND {
                        self.add(nets, at, number, &crossing, far);
                    }
                }
                self.edges.push((crossing.slots, first..self.polygons.len()));
            }
        }
    }

    fn add(&mut self, nets: &Nets, at: [u32; 3], number: u16, crossing: &Crossing, far: bool) {
        let patch = nets.patch(crossing, far);
        let first = self.pieces.len();
        for &triangle in patch.triangles() {
            let corners = triangle.map(|vertex| self.index_of(nets, at, (number, vertex)));
            let points = corners.map(|corner| self.positions[corner as usize]);
            self.pieces.push(Piece::new(corners, points));
        }
        let mut polygon =
            Polygon { pieces: first..self.pieces.len(), corners: None, points: [Vec3::ZERO; 4] };
        if let [s, t] = &self.pieces[first..]
            && let Some(k) = (0..3).find(|&k| !s.corners.contains(&t.corners[k]))
        {
            let [a, b, c] = s.corners;
            polygon.corners = Some([a, b, c, t.corners[k]]);
            polygon.points = [s.points[0], s.points[1], s.points[2], t.points[k]];
        }
        self.polygons.push(polygon);
    }

    fn index_of(&mut self, nets: &Nets, at: [u32; 3], vertex: (u16, NetVertex)) -> u32 {
        if let Some(known) = self.vertices.iter().position(|&known| known == vertex) {
            return known as u32;
        }
        self.vertices.push(vertex);
        self.positions.push(nets.position(vertex.0, vertex.1, at));
        self.vertices.len() as u32 - 1
    }

    /// Appends the slots of the cells of all polygons that intersect.
    fn find_intersections(&self, nets: &Nets, search: &Search, tangled: &mut Vec<u32>) {
        for (i, (slots, polygons)) in self.edges.iter().enumerate() {
            for (others, other_polygons) in &self.edges[..=i] {
                if search.is_tested_in(self.slot, slots, others)
                    && self.any_intersect(nets, polygons, other_polygons)
                {
                    tangled.extend(slots);
                    tangled.extend(others);
                }
            }
        }
    }

    /// Returns whether a polygon of one range intersects a later one of the other, or of the same.
    fn any_intersect(&self, nets: &Nets, of_one: &Range<usize>, of_other: &Range<usize>) -> bool {
        of_one.clone().any(|i| {
            of_other.clone().take_while(|&j| j < i).any(|j| {
                let (one, other) = (&self.polygons[i], &self.polygons[j]);
                !are_sides_of_a_plane(one, other) && self.intersect(nets, one, other)
            })
        })
    }

    fn intersect(&self, nets: &Nets, one: &Polygon, other: &Polygon) -> bool {
        let [one, other] = [one, other].map(|polygon| &self.pieces[polygon.pieces.clone()]);
        one.iter().any(|s| {
            let facet = |piece| self.facet(nets, piece);
            other.iter().any(|t| !surely_apart(s, t) && facets_intersect(&facet(s), &facet(t)))
        })
    }

    fn facet(&self, nets: &Nets, piece: &Piece) -> Facet {
        let points = piece.corners.map(|corner| {
            let (number, vertex) = self.vertices[corner as usize];
            nets.world_position(number, vertex)
        });
        Facet { corners: piece.corners, points }
    }
}

/// Returns whether two polygons lie on different sides of a plane, which meets both at most in their common corners, as
/// far as that is quickly seen: planes along either polygon, and between them.
fn are_sides_of_a_plane(one: &Polygon, other: &Polygon) -> bool {
    let (Some(of_one), Some(of_other)) = (one.corners, other.corners) else { return false };
    let in_other = of_one.map(|corner| of_other.contains(&corner));
    let in_one = of_other.map(|corner| of_one.contains(&corner));
    let mut common = (0..4).filter(|&i| in_other[i]).map(|i| one.points[i]);
    let (first, second, more) = (common.next(), common.next(), common.next());
    if more.is_some() {
        return false;
    }
    let mean = |polygon: &Polygon| polygon.points.iter().sum::<Vec3>() / 4.0;
    let normal = |polygon: &Polygon| {
        let [a, b, c, d] = polygon.points;
        (c - a).cross(d - b)
    };
    let along = second.zip(first).map(|(second, first)| (second - first).normalize_or_zero());
    [normal(one), normal(other), mean(one) - mean(other)].into_iter().any(|direction| {
        let across =
            along.map_or(direction, |along| direction - along * direction.dot(along)).normalize_or_zero();
        let range = |polygon: &Polygon, shared: [bool; 4]| {
            let mut range = [f32::INFINITY, f32::NEG_INFINITY];
            for (point, _) in polygon.points.iter().zip(shared).filter(|&(_, shared)| !shared) {
                let height = across.dot(*point);
                range = [range[0].min(height), range[1].max(height)];
            }
            range
        };
        let ([low, high], [other_low, other_high]) = (range(one, in_other), range(other, in_one));
        // Between the ranges lie the common corners, if there are any, else any height does.
        match first.map(|corner| across.dot(corner)) {
            Some(height) => {
                low > height + MARGIN && other_high < height - MARGIN
                    || high < height - MARGIN && other_low > height + MARGIN
            }
            None => low > other_high + MARGIN || other_low > high + MARGIN,
        }
    })
}

/// Returns whether two triangles have nothing in common but their common corners, as far as that is quickly seen.
pub fn surely_apart(s: &Piece, t: &Piece) -> bool {
    let common = s.corners.iter().filter(|corner| t.corners.contains(corner)).count();
    match common {
        0 => is_beside(s, t) || is_beside(t, s),
        1 => is_beside(s, t) || is_beside(t, s) || are_divided(s, t),
        // They would have to be folded onto each other.
        2 => s.normal.dot(t.normal) > -0.9,
        _ => false,
    }
}

/// Returns whether the corners of `t` that are not corners of `s`, too, are all on one side of the plane of `s`.
fn is_beside(s: &Piece, t: &Piece) -> bool {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for (corner, point) in t.corners.iter().zip(t.points) {
        if !s.corners.contains(corner) {
            let height = s.normal.dot(point - s.points[0]);
            (low, high) = (low.min(height), high.max(height));
        }
    }
    low > MARGIN || high < -MARGIN
}

/// Returns whether a plane through the common corner, across the directions to the other ones, divides two triangles.
fn are_divided(s: &Piece, t: &Piece) -> bool {
    let Some(shared) = s.corners.iter().position(|corner| t.corners.contains(corner)) else { return false };
    let Some(same) = t.corners.iter().position(|&corner| corner == s.corners[shared]) else { return false };
    let ways = |piece: &Piece, k: usize| [1, 2].map(|step| piece.points[(k + step) % 3] - piece.points[k]);
    let (of_s, of_t) = (ways(s, shared), ways(t, same));
    let mean = |[a, b]: [Vec3; 2]| a.normalize_or_zero() + b.normalize_or_zero();
    let across = (mean(of_s) - mean(of_t)).normalize_or_zero();
    of_s.iter().all(|way| way.dot(across) > MARGIN) && of_t.iter().all(|way| way.dot(across) < -MARGIN)
}
