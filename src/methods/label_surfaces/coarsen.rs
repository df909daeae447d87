//! Coarsening: surfaces with longer edges than those between the cells.
//!
//! Cells are merged: all vertices in a cell move to those of the same labels in a neighbouring one, which is a collapse
//! of one edge in the surface of each label. Two labels that touch keep the same triangles, so that the gap between them
//! stays. What a merge takes from the volume of a label is given back by a shift of the vertices that remain, within
//! their cell. A merge is rejected if it would change the topology of a surface, fold or intersect one (exactly, between
//! labels, too), or bring a voxel centre to the other side of one.
//!
//! Cells are merged within tiles, of which none depends on another: a cell only if all triangles around it are in its
//! tile. A second pass, whose tiles begin in the middle of those of the first, merges cells at the ends of these. So
//! the result depends on what is nearby only; after a change, the tiles there are coarsened anew.

use super::cells::CellBox;
use super::label_grid::BACKGROUND;
use super::nets::{Crossing, NetVertex, Nets};
use super::untangle::{Piece, surely_apart};
use super::zone::{pair, within_reach};
use crate::math::order::sort_distinct;
use crate::math::predicates::collinear;
use crate::math::{Bounds, DVec3, Vec3};
use crate::mesh::{Facet, facets_intersect};
use crate::pauses::Pauses;
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// Length of a tile's side, in edge lengths.
const TILE: f64 = 8.0;
/// Largest distance of two cells that are merged, in edge lengths.
const MERGED: f32 = 1.0;
/// Work that a tile counts as, whatever is in it.
const TILE_WORK: usize = 50;
/// Work that a cell of a tile counts as, and an attempt to merge one.
const CELL_WORK: usize = 1;
const MERGE_WORK: usize = 3;
/// Length of the longest edge that merges may create, in edge lengths.
const LONGEST: f32 = 1.5;
/// Weight of the squared distance of the remaining vertex from the planes of the triangles that are replaced, relative to
/// that from the removed one, in the order of merges: more keeps creases, less gives more even triangles.
const FLATNESS: f32 = 20.0;
/// The cosine of the largest angle by which a merge may turn a triangle.
const LEAST_COSINE: f32 = 0.3;
/// Least and largest displacement at once of vertices that gives back volume, in voxels.
const LEAST_SHIFT: f32 = 0.003;
const MOST_SHIFT: f32 = 0.25;
/// Largest number of triangles around a vertex.
const MOST_TRIANGLES: usize = 16;
/// Number of times that all pairs of cells in a tile are tried: a merge may be possible after others.
const ROUNDS: u32 = 3;
/// Six times the volume of a tetrahedron below which it counts as flat, in voxels.
const FLAT: f64 = 1e-4;
/// Number of triangles whose boxes have a common box, which is tested first, and of such boxes that have one in turn.
const GROUP: usize = 16;
/// Stands for a vertex that is not in a cell, or a cell that is not in the tile.
const NONE: u32 = u32::MAX;

/// The merges of cells, by slot.
#[derive(Clone, Debug, Default)]
struct Merges {
    /// Slot of the cell that it is merged into; its own if it remains.
    targets: Vec<u32>,
    /// Displacement of its vertices if it remains, in voxels.
    shifts: Vec<Vec3>,
}

impl Merges {
    #[inline]
    fn target(&self, slot: u32) -> u32 {
        self.targets.get(slot as usize).copied().unwrap_or(slot)
    }

    #[inline]
    fn shift(&self, slot: u32) -> Vec3 {
        self.shifts.get(slot as usize).copied().unwrap_or_default()
    }

    fn set(&mut self, slot: u32, target: u32, shift: Vec3) {
        (self.targets[slot as usize], self.shifts[slot as usize]) = (target, shift);
    }

    /// Makes room for as many slots as there are; cells in new ones are not merged.
    fn resize(&mut self, slots: usize) {
        self.targets.extend(self.targets.len() as u32..slots as u32);
        self.shifts.resize(slots, Vec3::ZERO);
    }

    /// Returns the vertex in whose place `vertex` is. Cells are merged only into those with one vertex of each label.
    #[inline]
    fn follow(&self, vertex: NetVertex) -> NetVertex {
        match vertex {
            NetVertex::Cell { slot, .. } if self.target(slot) != slot => {
                NetVertex::Cell { slot: self.target(slot), on: 0 }
            }
            _ => vertex,
        }
    }
}

/// Which cells are merged.
#[derive(Clone, Debug, Default)]
pub struct Coarsening {
    /// The merges of each pass.
    passes: [Merges; 2],
    /// Both passes, one after the other.
    result: Merges,
    /// Box of the cells that have changed since their tiles were coarsened, in which none is merged at present.
    pub pending: Option<CellBox>,
    /// Number of merged cells in which each label is; that of number 1 comes first.
    merged: Vec<usize>,
}

impl Coarsening {
    /// Returns the slot of the cell that the one in a slot is merged into; its own if it remains.
    #[inline]
    pub fn target(&self, slot: u32) -> u32 {
        self.result.target(slot)
    }

    /// Returns the displacement of the vertices in a cell that remains, in voxels.
    #[inline]
    pub fn shift(&self, slot: u32) -> Vec3 {
        self.result.shift(slot)
    }

    /// Returns the vertex that remains where `vertex` was.
    #[inline]
    pub fn follow(&self, vertex: NetVertex) -> NetVertex {
        self.result.follow(vertex)
    }

    /// Returns the number of vertices that the label that `number` stands for has lost; each took two triangles with it.
    pub fn merged(&self, number: u16) -> usize {
        self.merged.get(usize::from(number) - 1).copied().unwrap_or(0)
    }

    /// Coarsens the tiles of a pass that overlap a box, or restores them if they are to be coarsened later; returns the box
    /// of all of them.
    async fn run_pass(
        &mut self,
        pass: usize,
        nets: &Nets,
        edge: f64,
        area: &CellBox,
        later: bool,
        pauses: &Pauses,
    ) -> CellBox {
        let side = 2 * (TILE * edge / 2.0).ceil() as u32;
        let before = side / 2 * pass as u32;
        let mut index = vec![NONE; nets.cells.slots().len()];
        let [first, last] = [area.low, area.high].map(|at| at.map(|n| (n + before) / side));
        let tile = |at: [u32; 3]| CellBox {
            low: at.map(|n| (n * side).saturating_sub(before)),
            high: at.map(|n| (n + 1) * side - 1 - before),
        };
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    let area = tile([x, y, z]);
                    for slot in nets.cells.within(&area) {
                        self.passes[pass].set(slot, slot, Vec3::ZERO);
                    }
                    pauses.after(TILE_WORK).await;
                    if later {
                        continue;
                    }
                    // Triangles reach from one tile of the first pass to the next only as far as they are not changed.
                    let around = area.grown(if pass == 0 { 1 } else { side / 2 }, nets.grid.dims());
                    let before = if pass == 0 { &Merges::default() } else { &self.passes[0] };
                    let mut tile = Tile::new(nets, area, &around, before, &mut index, pauses).await;
                    tile.run(edge as f32, pauses).await;
                    let nodes = std::mem::take(&mut tile.nodes);
                    for node in nodes.iter().filter(|node| area.contains(node.at)) {
                        self.passes[pass].set(node.slot, remaining(&nodes, node).slot, node.shift);
                    }
                }
            }
        }
        CellBox { low: tile(first).low, high: tile(last).high }
    }

    /// Joins both passes, and counts; sets the flag, by number, of each label in cells that are merged otherwise now.
    fn finish(&mut self, nets: &Nets, reconnected: &mut [bool]) {
        self.merged.clear();
        self.merged.resize(nets.grid.values().len(), 0);
        let before = std::mem::take(&mut self.result);
        let [first, second] = &self.passes;
        for slot in 0..first.targets.len() as u32 {
            let target = second.target(first.target(slot));
            let shift = first.shift(slot) + second.shift(slot);
            self.result.targets.push(target);
            self.result.shifts.push(shift);
            if target != slot {
                nets.cells.get(slot).numbers().for_each(|number| self.merged[usize::from(number) - 1] += 1);
            }
            if (before.target(slot), before.shift(slot)) != (target, shift) {
                nets.flag_labels_in([slot], reconnected);
            }
        }
    }
}

impl Nets {
    /// Coarsens the surfaces around a box of cells that have changed, and where that was put off before, to edges of about
    /// `edge` voxels; or puts that off until `later`, with no cells merged there. Sets the flag, by number, of each label
    /// whose triangles have changed by that.
    pub async fn coarsen(
        &mut self,
        edge: f64,
        area: &CellBox,
        later: bool,
        reconnected: &mut [bool],
        pauses: &Pauses,
    ) {
        let mut coarse = std::mem::take(&mut self.coarse);
        if edge > 1.0 {
            let area = coarse.pending.map_or(*area, |pending| pending.union(area));
            coarse.pending = later.then_some(area);
            coarse.passes.iter_mut().for_each(|pass| pass.resize(self.cells.slots().len()));
            let first = coarse.run_pass(0, self, edge, &area.grown(1, self.grid.dims()), later, pauses).await;
            coarse.run_pass(1, self, edge, &first, later, pauses).await;
            coarse.finish(self, reconnected);
            self.coarse = coarse;
        } else {
            coarse.pending = None;
            coarse.passes = Default::default();
            coarse.passes[0].resize(coarse.result.targets.len());
            coarse.finish(self, reconnected);
        }
    }
}

/// A cell of a tile.
struct Node {
    slot: u32,
    /// Index of the cell along x, y and z.
    at: [u32; 3],
    /// Position of the cell's vertices but for the gap, relative to the tile.
    position: Vec3,
    /// Displacement in this pass.
    shift: Vec3,
    /// Whether the cell may be merged into another one, or its vertices may move.
    may_merge: bool,
    /// Whether just two labels meet in the cell, one of which may be the background.
    is_pair: bool,
    /// Its vertices, as indices into those of the tile.
    vertices: SmallVec<[u32; 4]>,
    /// The cell that it is merged into; [`NONE`] if it remains.
    target: u32,
    /// Number of merges here, by which outdated candidates are recognised.
    stamp: u32,
}

/// A vertex of a label's surface.
struct Vertex {
    number: u16,
    on: u8,
    /// The cell that it is in; [`NONE`] if it is on a face or an edge.
    node: u32,
    /// Position in index space, relative to the tile.
    position: Vec3,
    world: Vec3,
    triangles: SmallVec<[u32; 8]>,
}

/// The merge of one cell into another, in the order of costs.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// The bits of the cost, which is not negative.
    cost: u32,
    from: u32,
    to: u32,
    /// Sum of the stamps of both when the cost was computed.
    stamp: u32,
}

/// The surfaces in a box of cells.
struct Tile<'a> {
    nets: &'a Nets,
    /// The merges of the pass before.
    before: &'a Merges,
    area: CellBox,
    nodes: Vec<Node>,
    vertices: Vec<Vertex>,
    triangles: Vec<Piece>,
    /// Box of each triangle; empty if it has been removed.
    bounds: Vec<Bounds>,
    /// Boxes around those of each [`GROUP`] triangles, then around these, and so on, up to a few.
    groups: Vec<Vec<Bounds>>,
    queue: BinaryHeap<Reverse<Candidate>>,
}

impl<'a> Tile<'a> {
    /// Collects what is in and around the tile `area`, from the polygons that begin at the cells of `around`, after the
    /// merges `before`. `index` has [`NONE`] for each slot, and has so again afterwards.
    async fn new(
        nets: &'a Nets,
        area: CellBox,
        around: &CellBox,
        before: &'a Merges,
        index: &mut [u32],
        pauses: &Pauses,
    ) -> Self {
        let (nodes, vertices, triangles, bounds, groups, queue) = Default::default();
        let mut tile = Self { nets, before, area, nodes, vertices, triangles, bounds, groups, queue };
        let mut others = BTreeMap::new();
        for slot in nets.cells.within(around) {
            pauses.after(CELL_WORK).await;
            for crossing in nets.crossings(slot) {
                tile.add_polygons(&crossing, index, &mut others);
            }
        }
        tile.nodes.iter().for_each(|node| index[node.slot as usize] = NONE);
        tile.group();
        tile
    }

    /// Puts boxes around the boxes of the triangles, and around these.
    fn group(&mut self) {
        let union = |group: &[Bounds]| group.iter().fold(Bounds::EMPTY, |all, one| all.union(one));
        let mut last = &self.bounds;
        while last.len() > GROUP {
            self.groups.push(last.chunks(GROUP).map(union).collect());
            last = &self.groups[self.groups.len() - 1];
        }
    }

    /// Adds the triangles of the polygons around an edge of the grid, as far as they may reach into the tile.
    fn add_polygons(
        &mut self,
        crossing: &Crossing,
        index: &mut [u32],
        others: &mut BTreeMap<(u16, NetVertex), u32>,
    ) {
        if !self.may_reach(crossing) {
            return;
        }
        let is_divided = self.nets.has_face_vertices(crossing);
        for far in [false, true] {
            let number = crossing.ends[usize::from(far)];
            if number == BACKGROUND {
                continue;
            }
            for triangle in self.nets.patch(crossing, far).triangles() {
                let corners = triangle.map(|vertex| self.before.follow(vertex));
                let [a, b, c] = corners;
                if a == b || b == c || c == a {
                    continue;
                }
                let indices = corners.map(|vertex| self.index_of(number, vertex, index, others));
                let is_within = corners.iter().all(|&vertex| self.area.contains(self.cell_of(vertex)));
                self.add(indices, is_within && !is_divided);
            }
        }
    }

    fn cell_of(&self, vertex: NetVertex) -> [u32; 3] {
        let (NetVertex::Cell { slot, .. } | NetVertex::Face { slot, .. } | NetVertex::Edge { slot, .. }) =
            vertex;
        self.nets.cells.get(slot).at
    }

    /// Returns whether the polygons around an edge are more than lines, and may be partly in the tile.
    fn may_reach(&self, crossing: &Crossing) -> bool {
        let slots = crossing.slots.map(|slot| self.before.target(slot));
        let different = (0..4).filter(|&i| !slots[..i].contains(&slots[i])).count();
        let cells = slots.map(|slot| self.nets.cells.get(slot).at);
        different > 2
            && (0..3).all(|axis| {
                cells.iter().any(|cell| cell[axis] >= self.area.low[axis])
                    && cells.iter().any(|cell| cell[axis] <= self.area.high[axis])
            })
    }

    fn index_of(
        &mut self,
        number: u16,
        vertex: NetVertex,
        index: &mut [u32],
        others: &mut BTreeMap<(u16, NetVertex), u32>,
    ) -> u32 {
        let NetVertex::Cell { slot, on } = vertex else {
            let next = self.vertices.len() as u32;
            let found = *others.entry((number, vertex)).or_insert(next);
            if found == next {
                self.add_vertex(number, vertex, 0, NONE);
            }
            return found;
        };
        if index[slot as usize] == NONE {
            index[slot as usize] = self.nodes.len() as u32;
            self.add_node(slot);
        }
        let node = index[slot as usize];
        let known = &self.nodes[node as usize].vertices;
        let is_same = |&&i: &&u32| {
            let vertex = &self.vertices[i as usize];
            (vertex.number, vertex.on) == (number, on)
        };
        if let Some(&found) = known.iter().find(is_same) {
            return found;
        }
        let found = self.add_vertex(number, vertex, on, node);
        self.nodes[node as usize].vertices.push(found);
        found
    }

    fn add_node(&mut self, slot: u32) {
        let cell = self.nets.cells.get(slot);
        let is_once = |number| cell.vertices_of(number) == 1;
        let steps = [0, 1, 2].map(|axis| cell.at[axis] as f32 - self.area.low[axis] as f32);
        self.nodes.push(Node {
            slot,
            at: cell.at,
            position: Vec3::from(steps) + cell.offset + self.before.shift(slot),
            shift: Vec3::ZERO,
            is_pair: pair(cell).is_some(),
            may_merge: self.area.contains(cell.at) && cell.numbers().all(is_once),
            vertices: SmallVec::new(),
            target: NONE,
            stamp: 0,
        });
    }

    fn add_vertex(&mut self, number: u16, vertex: NetVertex, on: u8, node: u32) -> u32 {
        let shift =
            if let NetVertex::Cell { slot, .. } = vertex { self.before.shift(slot) } else { Vec3::ZERO };
        self.vertices.push(Vertex {
            number,
            on,
            node,
            position: self.nets.position(number, vertex, self.area.low) + shift,
            world: self.nets.shifted_position(number, vertex, shift),
            triangles: SmallVec::new(),
        });
        self.vertices.len() as u32 - 1
    }

    fn add(&mut self, corners: [u32; 3], may_change: bool) {
        for corner in corners {
            let vertex = &mut self.vertices[corner as usize];
            vertex.triangles.push(self.triangles.len() as u32);
            if let Some(node) = self.nodes.get_mut(vertex.node as usize) {
                node.may_merge &= may_change;
            }
        }
        let piece = self.piece(corners);
        self.bounds.push(Bounds::from_points(&piece.points));
        self.triangles.push(piece);
    }

    fn piece(&self, corners: [u32; 3]) -> Piece {
        Piece::new(corners, corners.map(|corner| self.vertices[corner as usize].position))
    }

    /// Merges cells in the order of their costs, as far as edges are shorter than `edge`.
    async fn run(&mut self, edge: f32, pauses: &Pauses) {
        for _ in 0..ROUNDS {
            for node in 0..self.nodes.len() as u32 {
                pauses.after(CELL_WORK).await;
                for other in self.neighbours(node) {
                    self.enqueue(node, other, edge);
                }
            }
            let mut merges = 0;
            while let Some(Reverse(candidate)) = self.queue.pop() {
                let Candidate { from, to, .. } = candidate;
                let pair = [from, to].map(|node| &self.nodes[node as usize]);
                let is_current = pair.iter().all(|node| node.target == NONE);
                if is_current && pair[0].stamp + pair[1].stamp == candidate.stamp {
                    pauses.after(MERGE_WORK).await;
                    merges += u32::from(self.merge(from, to, edge));
                }
            }
            if merges == 0 {
                return;
            }
        }
    }

    /// Returns the cells that share an edge with one, in ascending order.
    fn neighbours(&self, node: u32) -> Vec<u32> {
        let mut found = Vec::new();
        for &vertex in &self.nodes[node as usize].vertices {
            let around = self.vertices[vertex as usize].triangles.iter();
            let corners = around.flat_map(|&triangle| self.triangles[triangle as usize].corners);
            found.extend(corners.map(|corner| self.vertices[corner as usize].node));
        }
        found.retain(|&other| other != node && other != NONE);
        sort_distinct(&mut found);
        found
    }

    fn enqueue(&mut self, from: u32, to: u32, edge: f32) {
        let pair = [from, to].map(|node| &self.nodes[node as usize]);
        let step = pair[1].position - pair[0].position;
        let squared = step.length_squared();
        let longest = MERGED * edge;
        if !pair[0].may_merge || pair[0].target != NONE || squared > longest * longest {
            return;
        }
        let around = pair[0].vertices.iter().flat_map(|&vertex| &self.vertices[vertex as usize].triangles);
        let heights = around.map(|&triangle| self.triangles[triangle as usize].normal.dot(step));
        let height = heights.fold(0.0, |most: f32, height| most.max(height.abs()));
        let cost = (squared + FLATNESS * height * height).to_bits();
        let stamp = pair[0].stamp + pair[1].stamp;
        self.queue.push(Reverse(Candidate { cost, from, to, stamp }));
    }

    /// Merges a cell into another if that is possible; returns whether it was.
    fn merge(&mut self, from: u32, to: u32, edge: f32) -> bool {
        let Some(pairs) = self.pairs(from, to) else { return false };
        if pairs.iter().any(|pair| self.passes_voxel_centre(pair)) {
            return false;
        }
        let shift = self.shift_for_volume(&pairs, to);
        let is_done = shift != Vec3::ZERO && self.merge_shifted(&pairs, to, shift, edge)
            || self.merge_shifted(&pairs, to, Vec3::ZERO, edge);
        if is_done {
            pairs.iter().for_each(|&[removed, kept]| self.collapse(removed, kept));
            self.nodes[from as usize].target = to;
            self.nodes[to as usize].stamp += 1;
            for other in self.neighbours(to) {
                self.enqueue(to, other, edge);
                self.enqueue(other, to, edge);
            }
        }
        is_done
    }

    /// Replaces the triangles that change if the first of each pair of vertices moves to the second, and that by `shift`;
    /// returns false, with nothing changed, if that is not possible.
    fn merge_shifted(&mut self, pairs: &[[u32; 2]], to: u32, shift: Vec3, edge: f32) -> bool {
        let is_shifted = shift != Vec3::ZERO;
        let before = self.nodes[to as usize].shift;
        if is_shifted {
            self.displace(to, before + shift);
        }
        let fresh = self.replacements(pairs, shift, LONGEST * edge);
        let Some(fresh) = fresh.filter(|fresh| !self.intersects(fresh, pairs, is_shifted)) else {
            if is_shifted {
                self.displace(to, before);
            }
            return false;
        };
        for (triangle, piece) in fresh {
            let (i, bounds) = (triangle as usize, Bounds::from_points(&piece.points));
            let mut group = i;
            for level in &mut self.groups {
                group /= GROUP;
                level[group] = level[group].union(&bounds);
            }
            (self.bounds[i], self.triangles[i]) = (bounds, piece);
        }
        true
    }

    /// Moves all vertices of a cell to where a displacement in this pass brings them.
    fn displace(&mut self, node: u32, shift: Vec3) {
        let Node { slot, vertices, position, shift: present, .. } = &mut self.nodes[node as usize];
        let sum = self.before.shift(*slot) + shift;
        *position += shift - *present;
        *present = shift;
        for &vertex in &*vertices {
            let Vertex { number, on, position, world, .. } = &mut self.vertices[vertex as usize];
            let vertex = NetVertex::Cell { slot: *slot, on: *on };
            *position = self.nets.position(*number, vertex, self.area.low) + sum;
            *world = self.nets.shifted_position(*number, vertex, sum);
        }
    }

    /// Returns the displacement of a cell that gives back what the merge of another one into it takes from the volumes of
    /// labels; zero if these are more than two.
    fn shift_for_volume(&self, pairs: &[[u32; 2]], to: u32) -> Vec3 {
        let node = &self.nodes[to as usize];
        let [removed, kept] = pairs[0];
        if !node.may_merge || !node.is_pair || pairs.len() != node.vertices.len() {
            return Vec3::ZERO;
        }
        let [from, end] = [removed, kept].map(|vertex| self.vertices[vertex as usize].position);
        let double_area = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
        let (mut gain, mut area) = (0.0, Vec3::ZERO);
        for &triangle in &self.vertices[removed as usize].triangles {
            let Piece { corners, points, .. } = &self.triangles[triangle as usize];
            gain += double_area(*points).dot(end - from);
            area += double_area([0, 1, 2].map(|i| if corners[i] == removed { end } else { points[i] }));
        }
        for &triangle in &self.vertices[kept as usize].triangles {
            let Piece { corners, points, .. } = &self.triangles[triangle as usize];
            if !corners.contains(&removed) {
                area += double_area(*points);
            }
        }
        let squared = area.length_squared();
        if squared == 0.0 {
            return Vec3::ZERO;
        }
        let shift = (area * (-gain / squared)).clamp_length_max(MOST_SHIFT);
        let centre = Vec3::from([0, 1, 2].map(|axis| node.at[axis] as f32 - self.area.low[axis] as f32));
        let shift = within_reach(node.position + shift - centre) + centre - node.position;
        if shift.length() > LEAST_SHIFT { shift } else { Vec3::ZERO }
    }

    /// Returns each vertex of a cell with that of the same label in another one, if each has just one, and an edge is
    /// between them that can be collapsed.
    fn pairs(&self, from: u32, to: u32) -> Option<SmallVec<[[u32; 2]; 4]>> {
        let pair = |&vertex: &u32| {
            let number = self.vertices[vertex as usize].number;
            let mut same = self.nodes[to as usize].vertices.iter().copied();
            let mut same = same.by_ref().filter(|&other| self.vertices[other as usize].number == number);
            let (kept, more) = (same.next()?, same.next());
            (more.is_none() && self.can_collapse(vertex, kept)).then_some([vertex, kept])
        };
        self.nodes[from as usize].vertices.iter().map(pair).collect()
    }

    /// Returns whether the surface of a label stays a manifold of the same topology if an edge is collapsed: the ends have
    /// just two neighbours in common, and these have others.
    fn can_collapse(&self, removed: u32, kept: u32) -> bool {
        let [one, other] = [removed, kept].map(|vertex| self.ring(vertex));
        let common: SmallVec<[u32; 4]> = one.iter().copied().filter(|v| other.contains(v)).collect();
        let triangles = |v: u32| self.vertices[v as usize].triangles.len();
        one.contains(&kept)
            && common.len() == 2
            && common.iter().all(|&v| triangles(v) > 3)
            && one.len() + other.len() - 4 <= MOST_TRIANGLES
    }

    fn ring(&self, vertex: u32) -> SmallVec<[u32; 16]> {
        let mut ring = SmallVec::new();
        for &triangle in &self.vertices[vertex as usize].triangles {
            for corner in self.triangles[triangle as usize].corners {
                if corner != vertex && !ring.contains(&corner) {
                    ring.push(corner);
                }
            }
        }
        ring
    }

    /// Returns the triangles that change, and what each becomes; `None` if one would be folded, too long, or on the other
    /// side of a voxel centre by the shift of the vertices that remain.
    fn replacements(&self, pairs: &[[u32; 2]], shift: Vec3, longest: f32) -> Option<Vec<(u32, Piece)>> {
        let is_shifted = shift != Vec3::ZERO;
        let mut fresh = Vec::new();
        for &[removed, kept] in pairs {
            let moved = &self.vertices[removed as usize].triangles;
            let own: &[u32] = if is_shifted { &self.vertices[kept as usize].triangles } else { &[] };
            for &index in moved.iter().chain(own) {
                let old = &self.triangles[index as usize];
                if old.corners.contains(&kept) && old.corners.contains(&removed) {
                    continue;
                }
                let new = self.piece(old.corners.map(|v| if v == removed { kept } else { v }));
                let centre = self.vertices[kept as usize].position;
                let is_long = |p: &Vec3| p.distance_squared(centre) > longest * longest;
                if new.points.iter().any(is_long) && old.corners.contains(&removed)
                    || new.normal.dot(old.normal) < LEAST_COSINE
                    || is_shifted
                        && contains_voxel_centre([
                            new.points[0],
                            new.points[1],
                            new.points[2],
                            centre - shift,
                        ])
                    || collinear(self.facet(&new).points)
                {
                    return None;
                }
                fresh.push((index, new));
            }
        }
        Some(fresh)
    }

    /// Returns whether the surface passes the centre of a voxel if the first vertex moves to the second: each triangle
    /// around it sweeps a tetrahedron.
    fn passes_voxel_centre(&self, &[removed, kept]: &[u32; 2]) -> bool {
        let position = |vertex: u32| self.vertices[vertex as usize].position;
        self.vertices[removed as usize].triangles.iter().any(|&triangle| {
            let corners = self.triangles[triangle as usize].corners;
            let [a, b, c] = corners.map(position);
            !corners.contains(&kept) && contains_voxel_centre([a, b, c, position(kept)])
        })
    }

    /// Returns whether new triangles intersect each other, or any that stays.
    fn intersects(&self, fresh: &[(u32, Piece)], pairs: &[[u32; 2]], is_shifted: bool) -> bool {
        let meet =
            |s: &Piece, t: &Piece| !surely_apart(s, t) && facets_intersect(&self.facet(s), &self.facet(t));
        let boxes: Vec<Bounds> = fresh.iter().map(|(_, piece)| Bounds::from_points(&piece.points)).collect();
        let around = boxes.iter().fold(Bounds::EMPTY, |all, one| all.union(one));
        let near = |bounds: &Bounds| {
            let near = fresh.iter().zip(&boxes).filter(|(_, other)| other.overlaps(bounds));
            near.map(|((_, piece), _)| piece).collect::<SmallVec<[&Piece; 8]>>()
        };
        let changes = |&[removed, kept]: &[u32; 2], corners: &[u32; 3]| {
            corners.contains(&removed) || is_shifted && corners.contains(&kept)
        };
        let stays = |piece: &Piece| !pairs.iter().any(|pair| changes(pair, &piece.corners));
        let meets_others = |triangle: usize| {
            let (bounds, other) = (&self.bounds[triangle], &self.triangles[triangle]);
            stays(other) && near(bounds).into_iter().any(|piece| meet(piece, other))
        };
        self.any_overlapping(&around, meets_others)
            || fresh.iter().enumerate().any(|(i, (_, s))| fresh[..i].iter().any(|(_, t)| meet(s, t)))
    }

    /// Returns whether any triangle whose box overlaps another one is as asked.
    fn any_overlapping(&self, around: &Bounds, is_wanted: impl Fn(usize) -> bool) -> bool {
        let mut waiting: SmallVec<[(usize, usize); 64]> = SmallVec::new();
        // Level 0 is that of the triangles.
        let boxes = |level: usize| if level == 0 { &self.bounds } else { &self.groups[level - 1] };
        let top = self.groups.len();
        waiting.extend((0..boxes(top).len()).map(|index| (top, index)));
        while let Some((level, index)) = waiting.pop() {
            if !boxes(level)[index].overlaps(around) {
                continue;
            }
            if level == 0 {
                if is_wanted(index) {
                    return true;
                }
                continue;
            }
            let end = boxes(level - 1).len().min((index + 1) * GROUP);
            waiting.extend((index * GROUP..end).map(|below| (level - 1, below)));
        }
        false
    }

    fn facet(&self, piece: &Piece) -> Facet {
        let points = piece.corners.map(|corner| self.vertices[corner as usize].world);
        Facet { corners: piece.corners, points }
    }

    /// Hands the triangles of a removed vertex over to the kept one; both share two, which vanish.
    fn collapse(&mut self, removed: u32, kept: u32) {
        for triangle in std::mem::take(&mut self.vertices[removed as usize].triangles) {
            let corners = self.triangles[triangle as usize].corners;
            if !corners.contains(&removed) {
                self.vertices[kept as usize].triangles.push(triangle);
                continue;
            }
            self.bounds[triangle as usize] = Bounds::EMPTY;
            for corner in corners {
                self.vertices[corner as usize].triangles.retain(|&mut other| other != triangle);
            }
        }
    }
}

/// Returns the cell that remains where one was merged.
fn remaining<'a>(nodes: &'a [Node], mut node: &'a Node) -> &'a Node {
    while node.target != NONE {
        node = &nodes[node.target as usize];
    }
    node
}

/// Returns whether the centre of a voxel is in a tetrahedron, or about on its surface. Positions are relative to the
/// centre of a cell.
fn contains_voxel_centre(corners: [Vec3; 4]) -> bool {
    let corners = corners.map(|p| p.as_dvec3() - DVec3::splat(0.5));
    let low = corners.iter().fold(corners[0], |low, p| low.min(*p)).ceil();
    let high = corners.iter().fold(corners[0], |high, p| high.max(*p)).floor();
    let range = |axis: usize| low[axis] as i32..=high[axis] as i32;
    range(2).any(|z| {
        range(1).any(|y| range(0).any(|x| is_inside(&corners, DVec3::new(x.into(), y.into(), z.into()))))
    })
}

fn is_inside(corners: &[DVec3; 4], p: DVec3) -> bool {
    let volumes = [0, 1, 2, 3].map(|i| {
        let mut corners = *corners;
        corners[i] = p;
        let [a, b, c, d] = corners;
        (b - a).cross(c - a).dot(d - a)
    });
    volumes.iter().all(|&volume| volume > -FLAT) || volumes.iter().all(|&volume| volume < FLAT)
}
