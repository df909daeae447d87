//! Labels as thin as a voxel or two. Where such a label is between two others, all three meet in most of its cells, which
//! have one position for both sides: what smoothing takes there cannot be given back there ([`super::balance`]). It is
//! given to the cells nearby in which only two labels meet, as far as these reach, and includes the gaps between labels,
//! which count for half a per cent of a voxel's thickness on each side. What is still missing is measured.

use super::balance::{MOST, POLYGONS, averaged, measure_four};
use super::cube_loops::cube_loops;
use super::label_grid::BACKGROUND;
use super::nets::{GAP, NetVertex, Nets};
use super::zone::{NONE, Polygon, Zone, pair, within_reach};
use crate::math::order::sort_distinct;
use crate::math::{DVec3, Vec3};
use crate::pauses::Pauses;
use smallvec::SmallVec;
use std::collections::{BTreeMap, BTreeSet};

/// The number of voxels per face below which a label is thin; a sheet of four voxels between others has two. Above, what
/// the gaps take is below a quarter of a per cent.
const THIN: f64 = 2.0;
/// The number of voxels per face below which a label is always measured: much of it may be where polygons are divided
/// otherwise than [`Zone::gains`] assumes.
const SHEET: f64 = 0.75;
/// The relative difference of a label's volume from that of its voxels above which it is balanced by itself.
const UNBALANCED: f64 = 5e-3;
/// The relative difference that is left then.
const BALANCED: f64 = 2e-3;
/// The largest number of times that a label is balanced by itself; each leaves about half of the difference.
const ROUNDS: usize = 40;
/// The number of times that volumes are measured for this.
const MEASURES: usize = 5;
/// The share of the difference that has to be left by a round for another one to be made.
const PROGRESS: f64 = 0.99;
/// Number of polygons that are measured, and of cells that volume is given to, in a unit of work.
const POLYGONS_MEASURED: usize = 16;
const CELLS_GIVEN: usize = 8;
/// Least displacement along the normal, in voxels, for which a cell must have room to take part.
const ROOM: f32 = 0.02;

/// A polygon of a thin label.
struct ThinPolygon {
    polygon: Polygon,
    /// 1, or −1 if the label has the higher number.
    side: f32,
    /// Displacement of the label's vertices by half the gap.
    clear: [Vec3; 4],
    /// Indices of the cells among those of the label; [`NONE`] for those that do not move.
    cells: [u32; 4],
}

/// The surface of a thin label in a zone.
struct ThinLabel {
    number: u16,
    voxels: f64,
    /// Whether all of its cells move.
    is_whole: bool,
    /// Volume that is missing beside that of its polygons, which may be divided otherwise.
    bias: f64,
    polygons: Vec<ThinPolygon>,
    /// Indices in the zone of the cells that move and have the label.
    cells: Vec<u32>,
    /// Neighbours of each of `cells` that are among them, too; itself in place of others.
    links: Vec<[u32; 6]>,
    /// Whether two labels meet in each of `cells`.
    is_pair: Vec<bool>,
    /// The last measurement.
    measured: Measured,
    /// The volume of the whole surface, and the time when it was measured.
    volume: Option<(u32, f64)>,
}

/// The gains of the polygons of a label.
#[derive(Default)]
struct Measured {
    /// Time of the measurement; 0 if there was none.
    at: u32,
    /// The volume that the label has gained at each polygon.
    gains: Vec<f32>,
    /// Volume that is missing around each cell, but for the bias.
    missing: Vec<Missing>,
    /// Sum of the amounts of surface.
    size: f32,
}

/// The time when each cell of a zone was last moved. Measures of cells that have not moved since are not taken again.
struct Moves {
    now: u32,
    of_cells: Vec<u32>,
}

impl Moves {
    fn any_since(&self, at: u32, cells: &[u32]) -> bool {
        cells.iter().any(|&i| self.of_cells[i as usize] > at)
    }
}

/// Volume that is missing around a cell.
#[derive(Clone, Copy, Default)]
struct Missing {
    /// The volume that the label lacks, and the amount of surface that can be moved.
    amount: [f32; 2],
    /// Sum of the areas of the polygons, normal to them, outwards.
    area: Vec3,
}

impl Zone {
    /// Returns the volume that each label has gained in the zone, by number, about: with what the gaps take.
    pub async fn gains(&self, labels: usize, pauses: &Pauses) -> Vec<f64> {
        let mut gains = vec![0.0; labels + 1];
        for polygons in self.polygons.chunks(POLYGONS) {
            for four in polygons.chunks(4) {
                let measures = measure_four(four.iter().map(|polygon| self.corners(polygon)));
                for (polygon, (gain, _, size)) in four.iter().zip(measures) {
                    let [lower, higher] = polygon.ordered_labels().map(usize::from);
                    let gap = if lower == usize::from(BACKGROUND) { 0.0 } else { size * GAP / 2.0 };
                    gains[lower] += f64::from(gain - gap);
                    gains[higher] -= f64::from(gain + gap);
                }
            }
            pauses.after(POLYGONS / POLYGONS_MEASURED).await;
        }
        gains
    }

    /// Adds the labels that meet the given ones.
    pub fn add_neighbours(&self, labels: &mut BTreeSet<u16>) {
        let mut is_given = vec![false; usize::from(u16::MAX) + 1];
        labels.iter().for_each(|&number| is_given[usize::from(number)] = true);
        let mut is_met = is_given.clone();
        for [a, b] in self.polygons.iter().map(|polygon| polygon.labels.map(usize::from)) {
            is_met[a] |= is_given[b];
            is_met[b] |= is_given[a];
        }
        let met = (0..=u16::MAX).zip(is_met).filter_map(|(number, is_met)| is_met.then_some(number));
        labels.extend(met.filter(|&number| number != BACKGROUND));
    }

    /// Gives volume to the given labels, the thinner ones first, until they have that of their voxels in the zone, or cells
    /// have no more room, and copies the positions to the surfaces.
    pub async fn balance_thin(&mut self, nets: &mut Nets, labels: &[u16], pauses: &Pauses) {
        let mut labels = self.thin_labels(nets, labels, pauses).await;
        let mut moves = Moves { now: 1, of_cells: vec![1; self.moving()] };
        for _ in 0..MEASURES {
            self.write(nets);
            for label in &mut labels {
                label.bias = if label.is_whole {
                    let missing = self.missing(label, &moves, pauses).await;
                    let volume = label.volume(nets, &moves, pauses).await;
                    label.voxels - volume - (missing - label.bias)
                } else {
                    0.0
                };
            }
            if !self.balance_each(&mut labels, &mut moves, pauses).await {
                return;
            }
        }
        self.write(nets);
    }

    /// Runs rounds of giving volume to each label; returns whether any cell may have moved.
    async fn balance_each(&mut self, labels: &mut [ThinLabel], moves: &mut Moves, pauses: &Pauses) -> bool {
        let mut before = vec![f64::INFINITY; labels.len()];
        let mut has_moved = false;
        for _ in 0..ROUNDS {
            let mut any = false;
            for (label, before) in labels.iter_mut().zip(&mut before) {
                let sum = self.missing(label, moves, pauses).await;
                let most = if before.is_finite() { BALANCED } else { UNBALANCED };
                if sum.abs() > most * label.voxels && sum.abs() < PROGRESS * *before {
                    self.give(label, sum as f32, moves);
                    any = true;
                }
                *before = sum.abs();
                pauses.after(label.cells.len() / CELLS_GIVEN).await;
            }
            has_moved |= any;
            if !any {
                break;
            }
        }
        has_moved
    }

    /// Returns the surfaces of labels in the zone, those with fewer voxels per face first.
    async fn thin_labels(&self, nets: &Nets, labels: &[u16], pauses: &Pauses) -> Vec<ThinLabel> {
        let mut of_label: BTreeMap<u16, Vec<u32>> =
            labels.iter().map(|&number| (number, Vec::new())).collect();
        for (i, polygon) in (0..).zip(&self.polygons) {
            for number in polygon.labels {
                if let Some(polygons) = of_label.get_mut(&number) {
                    polygons.push(i);
                }
            }
        }
        let mut local = vec![NONE; nets.cells.slots().len()];
        let mut labels = Vec::new();
        for (&number, polygons) in &of_label {
            pauses.after(polygons.len()).await;
            labels.push(self.thin_label(nets, number, polygons, &mut local));
        }
        let thickness = |label: &ThinLabel| label.voxels / label.polygons.len().max(1) as f64;
        labels.sort_by(|a, b| thickness(a).total_cmp(&thickness(b)));
        labels
    }

    /// Returns the surface of one label; `local` has [`NONE`] for each slot, and has so again afterwards.
    fn thin_label(&self, nets: &Nets, number: u16, polygons: &[u32], local: &mut [u32]) -> ThinLabel {
        let polygons: Vec<Polygon> = polygons.iter().map(|&i| self.polygons[i as usize]).collect();
        let mut cells: Vec<u32> = polygons.iter().flat_map(|polygon| polygon.cells).collect();
        cells.retain(|&i| (i as usize) < self.moving());
        sort_distinct(&mut cells);
        let slots: Vec<u32> = cells.iter().map(|&i| self.slots[i as usize]).collect();
        (0..).zip(&slots).for_each(|(k, &slot)| local[slot as usize] = k);
        let mut links: Vec<[u32; 6]> = (0..cells.len() as u32).map(|k| [k; 6]).collect();
        for (k, &slot) in (0..).zip(&slots) {
            for (axis, before) in nets.cells.before(slot).into_iter().enumerate() {
                let before = local.get(before as usize).copied().unwrap_or(NONE);
                if before != NONE {
                    links[k as usize][2 * axis] = before;
                    links[before as usize][2 * axis + 1] = k;
                }
            }
        }
        let clear = |i: u32| {
            let cell = nets.cells.get(self.slots[i as usize]);
            let clear = cube_loops()[cell.case(number)].clear[0];
            if cell.simple == 1 { Vec3::ZERO } else { clear * (GAP / 2.0) }
        };
        let of_polygon = |polygon: &Polygon| {
            // Gains are those of the label of the lower number.
            let side = if polygon.ordered_labels()[0] == number { 1.0 } else { -1.0 };
            let cells = polygon.cells.map(|i| local[self.slots[i as usize] as usize]);
            ThinPolygon { polygon: *polygon, side, clear: polygon.cells.map(clear), cells }
        };
        let polygons: Vec<ThinPolygon> = polygons.iter().map(of_polygon).collect();
        slots.iter().for_each(|&slot| local[slot as usize] = NONE);
        ThinLabel {
            number,
            voxels: nets.grid.voxels(number) as f64,
            is_whole: cells.len() == nets.slots_of(number).len(),
            bias: 0.0,
            polygons,
            links,
            is_pair: slots.iter().map(|&slot| pair(nets.cells.get(slot)).is_some()).collect(),
            cells,
            measured: Measured::default(),
            volume: None,
        }
    }

    /// Returns the volume that a label is missing, and measures what is missing around each of its cells, if they have moved.
    async fn missing(&self, label: &mut ThinLabel, moves: &Moves, pauses: &Pauses) -> f64 {
        if moves.any_since(label.measured.at, &label.cells) {
            label.measured = self.measured(label, moves.now, pauses).await;
        }
        label.measured.gains.iter().fold(label.bias, |sum, &gain| sum - f64::from(gain))
    }

    async fn measured(&self, label: &ThinLabel, now: u32, pauses: &Pauses) -> Measured {
        let mut gains = Vec::with_capacity(label.polygons.len());
        let mut missing = vec![Missing::default(); label.cells.len()];
        for polygons in label.polygons.chunks(POLYGONS) {
            for four in polygons.chunks(4) {
                let corners = |thin: &ThinPolygon| {
                    let mut corners = self.corners(&thin.polygon);
                    corners.iter_mut().zip(&thin.clear).for_each(|(corner, clear)| corner.1 += *clear);
                    corners
                };
                for (thin, (gain, area, size)) in four.iter().zip(measure_four(four.iter().map(corners))) {
                    gains.push(gain * thin.side);
                    let cells = thin.cells.iter().filter(|&&k| k != NONE);
                    let share = thin.side / cells.clone().count().max(1) as f32;
                    for &k in cells {
                        let found = &mut missing[k as usize];
                        found.amount[0] -= gain * share;
                        found.amount[1] += size * share.abs();
                        found.area += area * share;
                    }
                }
            }
            pauses.after(POLYGONS / POLYGONS_MEASURED).await;
        }
        let size = missing.iter().map(|found| found.amount[1]).sum();
        Measured { at: now, gains, missing, size }
    }

    /// Moves cells in which two labels meet outwards, by what is missing nearby, or inwards.
    fn give(&mut self, label: &ThinLabel, sum: f32, moves: &mut Moves) {
        let Measured { missing, size, .. } = &label.measured;
        let outwards: Vec<Vec3> = missing.iter().map(|found| found.area.normalize_or_zero()).collect();
        let mut amounts: Vec<[f32; 2]> = missing.iter().map(|found| found.amount).collect();
        amounts.iter_mut().for_each(|amount| amount[0] += label.bias as f32 * amount[1] / size);
        for ((amount, &i), (outwards, is_pair)) in
            amounts.iter_mut().zip(&label.cells).zip(outwards.iter().zip(&label.is_pair))
        {
            let offset = self.offsets[i as usize];
            let moved = within_reach(offset + *outwards * ROOM.copysign(sum)) - offset;
            if !is_pair || moved.length_squared() < ROOM * ROOM / 4.0 {
                amount[1] = 0.0;
            }
        }
        let can_move: Vec<bool> = amounts.iter().map(|amount| amount[1] > 0.0).collect();
        if !can_move.contains(&true) {
            return;
        }
        moves.now += 1;
        let amounts = averaged(amounts, &label.links);
        for (((&i, outwards), [amount, size]), can_move) in
            label.cells.iter().zip(outwards).zip(amounts).zip(can_move)
        {
            if can_move && size > 0.0 {
                let shift = outwards * (amount / size).clamp(-MOST, MOST);
                self.offsets[i as usize] = within_reach(self.offsets[i as usize] + shift);
                moves.of_cells[i as usize] = moves.now;
            }
        }
    }
}

impl ThinLabel {
    /// Returns the volume of the whole surface, measured again if its cells have moved since.
    async fn volume(&mut self, nets: &Nets, moves: &Moves, pauses: &Pauses) -> f64 {
        match self.volume {
            Some((at, volume)) if !moves.any_since(at, &self.cells) => volume,
            _ => {
                let volume = nets.volume(self.number, pauses).await;
                self.volume = Some((moves.now, volume));
                volume
            }
        }
    }
}

impl Nets {
    /// Returns whether a label is thin, from the numbers of its voxels and of the triangles of its surface.
    pub fn is_thin(voxels: usize, triangles: usize) -> bool {
        (voxels as f64) < THIN * triangles as f64 / 2.0
    }

    /// Returns whether a label is hardly more than a sheet or a thread, from the numbers of its voxels and of the triangles
    /// of its surface.
    pub fn is_sheet(voxels: usize, triangles: usize) -> bool {
        (voxels as f64) < SHEET * triangles as f64 / 2.0
    }

    /// Returns the volume of a label's surface, in voxels.
    pub async fn volume(&self, number: u16, pauses: &Pauses) -> f64 {
        debug_assert_ne!(number, BACKGROUND);
        let slots = self.slots_of(number);
        let Some(&first) = slots.first() else { return 0.0 };
        let origin = self.cells.get(first).at;
        let mut six_volumes = 0.0;
        for &slot in slots {
            pauses.after(1).await;
            for crossing in self.crossings(slot) {
                let Some(far) = crossing.ends.iter().position(|&end| end == number) else { continue };
                let position = |vertex: NetVertex| {
                    let shift = match vertex {
                        NetVertex::Cell { slot, .. } => self.coarse.shift(slot),
                        _ => Vec3::ZERO,
                    };
                    (self.position(number, vertex, origin) + shift).as_dvec3()
                };
                let mut known: SmallVec<[(NetVertex, DVec3); 9]> = SmallVec::new();
                for triangle in self.patch(&crossing, far == 1).triangles() {
                    let [a, b, c] = triangle.map(|vertex| {
                        let vertex = self.coarse.follow(vertex);
                        if let Some(&(_, position)) = known.iter().find(|&&(other, _)| other == vertex) {
                            return position;
                        }
                        let position = position(vertex);
                        known.push((vertex, position));
                        position
                    });
                    six_volumes += a.dot(b.cross(c));
                }
            }
        }
        six_volumes / 6.0
    }
}
