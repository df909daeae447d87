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
    /// Whether its label's surface may intersect any in each of the cells around the edge.
    in_doubt: [bool; 4],
    /// Its triangles, as a range of the pieces.
    pieces: Range<usize>,
    /// Indices of its vertices, if it is divided by a diagonal.
    corners: Option<[u32; 4]>,
    /// Positions of these vertices.
    points: [Vec3; 4],
    /// Mean of these positions.
    mean: Vec3,
    /// A vector normal to it.
    normal: Vec3,
}

/// An edge of a cell that is crossed.
struct Edge {
    /// Slots of the four cells around it.
    slots: [u32; 4],
    /// Its polygons, one or two, as a range of those of the neighbourhood.
    polygons: Range<usize>,
    /// Whether the surface of the label of any may intersect any in one of the cells.
    in_doubt: bool,
}

/// The polygons around the edges of one cell, to be tested against each other.
#[derive(Default)]
struct Neighbourhood {
    /// Slot of the cell.
    slot: u32,
    edges: Vec<Edge>,
    polygons: Vec<Polygon>,
    pieces: Vec<Piece>,
    /// Label and identity of each vertex.
    vertices: Vec<(u16, NetVertex)>,
    /// Positions of the vertices in index space, relative to the cell.
    positions: Vec<Vec3>,
}

/// For the cells in all slots, which pairs of polygons are to be tested.
struct Search {
    /// The corners of the cell, as bits, of labels whose surfaces may intersect themselves or others in it.
    in_doubt: Vec<u8>,
    /// Whether pairs of which it is the first common cell are tested.
    is_wanted: Vec<bool>,
    /// Whether each polygon of the zone surely intersects no other.
    is_clear: Vec<bool>,
}

impl Nets {
    /// Moves cells towards their middle until no surfaces intersect in and around the cells of a box, those of a zone that
    /// has their positions and those around it, or any others. Returns the slots of the cells moved.
    pub async fn untangle(
        &mut self,
        area: CellBox,
        mut zone: Option<&mut Zone>,
        pauses: &Pauses,
    ) -> Vec<u32> {
        let mut halved: BTreeMap<u32, u32> = BTreeMap::new();
        let mut search = Search::new(self, zone.as_deref(), pauses).await;
        let mut to_test = self.cells.within(&area);
        pauses.after(to_test.len()).await;
        // Without a zone, the first common cell of a pair is one of those to be tested.
        let around = if zone.is_some() { area.grown(1, self.grid.dims()) } else { area };
        let mut candidates = self.cells.within(&around);
        pauses.after(candidates.len()).await;
        let mut neighbourhood = Neighbourhood::default();
        while !to_test.is_empty() {
            to_test.iter().for_each(|&slot| search.is_wanted[slot as usize] = true);
            let mut tangled = Vec::new();
            candidates.retain(|&slot| search.in_doubt[slot as usize] != 0);
            for &slot in &candidates {
                neighbourhood.fill(self, &search, slot);
                neighbourhood.find_intersections(self, &search, &mut tangled);
                pauses.after(WORK_OF_CELL).await;
            }
            to_test.iter().for_each(|&slot| search.is_wanted[slot as usize] = false);
            sort_distinct(&mut tangled);
            tangled.retain(|slot| halved.get(slot).is_none_or(|&times| times <= HALVINGS));
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
            candidates = if zone.is_some() { self.with_neighbours(&to_test) } else { to_test.clone() };
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
        let mut search =
            Self { in_doubt: vec![u8::MAX; slots], is_wanted: vec![false; slots], is_clear: Vec::new() };
        if let Some(zone) = zone {
            for polygons in zone.polygons.chunks(POLYGONS) {
                search.is_clear.extend(polygons.iter().map(|polygon| zone.is_clear(nets, polygon)));
                pauses.after(WORK_OF_POLYGONS).await;
            }
            search.spread(nets, zone);
            pauses.after(zone.polygons.len() / POLYGONS).await;
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
        self.spread(nets, zone);
    }

    /// Notes in which cells of a zone surfaces may intersect: those of labels with polygons that may.
    fn spread(&mut self, nets: &Nets, zone: &Zone) {
        zone.slots[..zone.moving()].iter().for_each(|&slot| self.in_doubt[slot as usize] = 0);
        for (_, polygon) in self.is_clear.iter().zip(&zone.polygons).filter(|&(&is_clear, _)| !is_clear) {
            for slot in polygon.cells.map(|i| zone.slots[i as usize]) {
                let labels = polygon.labels.into_iter().filter(|&number| number != BACKGROUND);
                let corners = labels.fold(0, |corners, number| corners | nets.cells.get(slot).case(number));
                self.in_doubt[slot as usize] |= corners as u8;
            }
        }
    }
}

impl Neighbourhood {
    /// Collects the polygons around the edges of the cell in a slot.
    fn fill(&mut self, nets: &Nets, search: &Search, slot: u32) {
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
                    if crossing.ends[usize::from(far)] != BACKGROUND {
                        self.add(nets, search, at, &crossing, far);
                    }
                }
                let polygons = first..self.polygons.len();
                let in_doubt = self.polygons[first..].iter().any(|polygon| polygon.in_doubt.contains(&true));
                self.edges.push(Edge { slots: crossing.slots, polygons, in_doubt });
            }
        }
    }

    fn add(&mut self, nets: &Nets, search: &Search, at: [u32; 3], crossing: &Crossing, far: bool) {
        let number = crossing.ends[usize::from(far)];
        let patch = nets.patch(crossing, far);
        let first = self.pieces.len();
        for &triangle in patch.triangles() {
            let corners = triangle.map(|vertex| self.index_of(nets, at, (number, vertex)));
            let points = corners.map(|corner| self.positions[corner as usize]);
            self.pieces.push(Piece::new(corners, points));
        }
        let in_doubt = |slot: u32| {
            let corners = search.in_doubt[slot as usize];
            corners == u8::MAX || usize::from(corners) & nets.cells.get(slot).case(number) != 0
        };
        let mut polygon = Polygon {
            in_doubt: crossing.slots.map(in_doubt),
            pieces: first..self.pieces.len(),
            corners: None,
            points: [Vec3::ZERO; 4],
            mean: Vec3::ZERO,
            normal: Vec3::ZERO,
        };
        if let [s, t] = &self.pieces[first..]
            && let Some(k) = (0..3).find(|&k| !s.corners.contains(&t.corners[k]))
        {
            let [a, b, c] = s.corners;
            polygon.corners = Some([a, b, c, t.corners[k]]);
            polygon.points = [s.points[0], s.points[1], s.points[2], t.points[k]];
            let [a, b, c, d] = polygon.points;
            polygon.mean = polygon.points.iter().sum::<Vec3>() / 4.0;
            polygon.normal = (c - a).cross(d - b);
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

    /// Appends the slots of the cells of all polygons that intersect. A pair is tested in the first of the cells that both
    /// have in common and in which the surface of the label of either may intersect any.
    fn find_intersections(&self, nets: &Nets, search: &Search, tangled: &mut Vec<u32>) {
        for (i, one) in self.edges.iter().enumerate() {
            for other in &self.edges[..=i] {
                if (one.in_doubt || other.in_doubt) && self.any_intersect(nets, search, one, other) {
                    tangled.extend(one.slots);
                    tangled.extend(other.slots);
                }
            }
        }
    }

    /// Returns whether a polygon of one edge intersects one of the other, as far as such a pair is tested in this cell.
    fn any_intersect(&self, nets: &Nets, search: &Search, one: &Edge, other: &Edge) -> bool {
        let places = one.slots.map(|slot| other.slots.iter().position(|&other| other == slot));
        let common = || (0..4).filter_map(|i| Some((one.slots[i], i, places[i]?)));
        let first = common().map(|(slot, ..)| slot).min();
        if first.is_none_or(|first| !search.is_wanted[first as usize]) {
            return false;
        }
        let is_tested_here = |one: &Polygon, other: &Polygon| {
            let in_doubt = common().filter(|&(_, i, j)| one.in_doubt[i] || other.in_doubt[j]);
            in_doubt.map(|(slot, ..)| slot).min() == Some(self.slot)
        };
        one.polygons.clone().any(|i| {
            // Those of one edge once.
            other.polygons.clone().take_while(|&j| j < i).any(|j| {
                let (one, other) = (&self.polygons[i], &self.polygons[j]);
                is_tested_here(one, other)
                    && !are_sides_of_a_plane(one, other)
                    && self.intersect(nets, one, other)
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
    let along = second.zip(first).map(|(second, first)| (second - first).normalize_or_zero());
    [one.normal, other.normal, one.mean - other.mean].into_iter().any(|direction| {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DVec3, Random};
    use crate::methods::label_surfaces::{LabelGrid, zone::within_reach};
    use crate::pauses::finished;
    use crate::volume::{Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Labels of balls around random points, with some voxels of other labels.
    fn labels(random: &mut Random, n: usize) -> Vec<u8> {
        let count = 1 + random.below(6);
        let mut coordinate = || random.unit() * n as f64;
        let centres: Vec<DVec3> =
            (0..count).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
        let noise = [0, 20, 300, 1000][random.below(4) as usize];
        let voxel = |i: usize| {
            let p = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
            let squared = |k: &usize| centres[*k].distance_squared(p);
            let nearest = (0..centres.len()).min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap();
            if random.below(1000) < noise {
                random.below(count + 1) as u8
            } else if squared(&nearest).sqrt() < 0.45 * n as f64 {
                nearest as u8 + 1
            } else {
                0
            }
        };
        (0..n * n * n).map(voxel).collect()
    }

    fn nets(random: &mut Random) -> Nets {
        let n = 6 + random.below(6) as usize;
        let init = VolumeInit::new(Voxels::U8(labels(random, n)), [n, n, n, 1]);
        let scale = DVec3::new(0.5 + random.unit(), 0.5 + random.unit(), 0.5 + 4.0 * random.unit());
        let affine = DAffine3::from_scale(scale);
        let volume = Volume::new(VolumeInit { affine, ..init }).unwrap();
        let grid = finished(LabelGrid::new(&volume, None, &Pauses::default())).unwrap();
        finished(Nets::new(grid, affine, None, &Pauses::default())).unwrap()
    }

    /// Returns the cells of all pairs that are tested in a search and intersect, and the number of cells with such pairs.
    fn tangled(nets: &Nets, search: &mut Search) -> (Vec<u32>, usize) {
        search.is_wanted.fill(true);
        let (mut tangled, mut tested) = (Vec::new(), 0);
        let mut neighbourhood = Neighbourhood::default();
        for slot in nets.cells.within(&nets.everywhere()) {
            if search.in_doubt[slot as usize] != 0 {
                neighbourhood.fill(nets, search, slot);
                neighbourhood.find_intersections(nets, search, &mut tangled);
                tested += 1;
            }
        }
        sort_distinct(&mut tangled);
        (tangled, tested)
    }

    /// Compares the search that tests polygons by themselves first with the one that tests all pairs, for random positions:
    /// anywhere in the cells, near their middle, and smoothed and then displaced.
    fn check(seeds: std::ops::Range<u64>) {
        let (mut cells, mut tested, mut found) = (0, 0, 0);
        for seed in seeds {
            let mut random = Random::new(seed);
            let mut nets = nets(&mut random);
            let mut zone = finished(Zone::new(&nets, nets.everywhere(), &Pauses::default()));
            let smoothing = random.below(12);
            (0..smoothing).for_each(|_| _ = zone.smooth());
            if random.below(2) == 0 {
                finished(zone.balance(&Pauses::default()));
            }
            let most = [0.0, 0.05, 0.2, 0.48][random.below(4) as usize];
            for offset in &mut zone.offsets {
                let mut signed = || (2.0 * random.unit() as f32 - 1.0) * most;
                *offset = within_reach(*offset + Vec3::new(signed(), signed(), signed()));
            }
            zone.write(&mut nets);
            let mut all = finished(Search::new(&nets, None, &Pauses::default()));
            let mut quick = finished(Search::new(&nets, Some(&zone), &Pauses::default()));
            let ((wanted, count), (tangled, count_tested)) =
                (tangled(&nets, &mut all), tangled(&nets, &mut quick));
            assert!(tangled == wanted, "seed {seed}: {} cells, {} wanted", tangled.len(), wanted.len());
            (cells, tested, found) = (cells + count, tested + count_tested, found + wanted.len());
        }
        println!("{tested} of {cells} cells tested, {found} with intersections");
        assert!(found > 0 && tested < cells);
    }

    #[test]
    fn polygons_tested_by_themselves_intersect_no_other() {
        check(0..40);
    }

    #[test]
    #[ignore = "long: npm run test:all"]
    fn many_polygons_tested_by_themselves_intersect_no_other() {
        check(40..2000);
    }
}
