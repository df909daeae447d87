//! Labels as thin as a voxel or two. Where such a label is between two others, all three meet in most of its cells, which
//! have one position for both sides: what smoothing takes there cannot be given back there ([`super::balance`]). It is
//! given to the cells nearby in which only two labels meet, as far as these reach, and includes the gaps between labels,
//! which count for half a per cent of a voxel's thickness on each side. What is still missing is measured.

use super::balance::{MOST, averaged, gain_of};
use super::cube_loops::cube_loops;
use super::label_grid::BACKGROUND;
use super::nets::{GAP, NetVertex, Nets};
use super::zone::{NONE, Polygon, Zone, pair, step_to, within_reach};
use crate::math::Vec3;
use crate::math::order::sort_distinct;
use crate::pauses::Pauses;
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
    pub fn gains(&self, labels: usize) -> Vec<f64> {
        let mut gains = vec![0.0; labels + 1];
        for polygon in &self.polygons {
            let (gain, area) = self.gain(polygon);
            let [lower, higher] = [0, 1].map(|k| {
                let [a, b] = polygon.labels;
                usize::from(if k == 0 { a.min(b) } else { a.max(b) })
            });
            let gap = if lower == usize::from(BACKGROUND) { 0.0 } else { area.length() * GAP / 2.0 };
            gains[lower] += f64::from(gain - gap);
            gains[higher] -= f64::from(gain + gap);
        }
        gains
    }

    /// Adds the labels that meet the given ones.
    pub fn add_neighbours(&self, labels: &mut BTreeSet<u16>) {
        let mut neighbours = Vec::new();
        for [a, b] in self.polygons.iter().map(|polygon| polygon.labels) {
            neighbours.extend(labels.contains(&a).then_some(b));
            neighbours.extend(labels.contains(&b).then_some(a));
        }
        labels.extend(neighbours.into_iter().filter(|&number| number != BACKGROUND));
    }

    /// Gives volume to the given labels, the thinner ones first, until they have that of their voxels in the zone, or cells
    /// have no more room, and copies the positions to the surfaces.
    pub async fn balance_thin(&mut self, nets: &mut Nets, labels: &[u16], pauses: &Pauses) {
        let mut labels = self.thin_labels(nets, labels);
        for _ in 0..MEASURES {
            self.write(nets);
            for label in &mut labels {
                label.bias = if label.is_whole {
                    let (_, missing) = self.missing(label);
                    label.voxels - nets.volume(label.number) - (missing - label.bias)
                } else {
                    0.0
                };
                pauses.after(label.polygons.len()).await;
            }
            if !self.balance_each(&labels, pauses).await {
                return;
            }
        }
        self.write(nets);
    }

    /// Runs rounds of giving volume to each label; returns whether any cell may have moved.
    async fn balance_each(&mut self, labels: &[ThinLabel], pauses: &Pauses) -> bool {
        let mut before = vec![f64::INFINITY; labels.len()];
        let mut has_moved = false;
        for _ in 0..ROUNDS {
            let mut any = false;
            for (label, before) in labels.iter().zip(&mut before) {
                let (missing, sum) = self.missing(label);
                let most = if before.is_finite() { BALANCED } else { UNBALANCED };
                if sum.abs() > most * label.voxels && sum.abs() < PROGRESS * *before {
                    self.give(label, missing, sum as f32);
                    any = true;
                }
                *before = sum.abs();
                pauses.after(label.polygons.len()).await;
            }
            has_moved |= any;
            if !any {
                break;
            }
        }
        has_moved
    }

    /// Returns the surfaces of labels in the zone, those with fewer voxels per face first.
    fn thin_labels(&self, nets: &Nets, labels: &[u16]) -> Vec<ThinLabel> {
        let mut of_label: BTreeMap<u16, Vec<u32>> =
            labels.iter().map(|&number| (number, Vec::new())).collect();
        for (i, polygon) in (0..).zip(&self.polygons) {
            for number in polygon.labels {
                if let Some(polygons) = of_label.get_mut(&number) {
                    polygons.push(i);
                }
            }
        }
        let all = of_label.iter().map(|(&number, polygons)| self.thin_label(nets, number, polygons));
        let mut labels: Vec<ThinLabel> = all.collect();
        let thickness = |label: &ThinLabel| label.voxels / label.polygons.len().max(1) as f64;
        labels.sort_by(|a, b| thickness(a).total_cmp(&thickness(b)));
        labels
    }

    fn thin_label(&self, nets: &Nets, number: u16, polygons: &[u32]) -> ThinLabel {
        let polygons: Vec<Polygon> = polygons.iter().map(|&i| self.polygons[i as usize]).collect();
        let mut cells: Vec<u32> = polygons.iter().flat_map(|polygon| polygon.cells).collect();
        cells.retain(|&i| (i as usize) < self.moving());
        sort_distinct(&mut cells);
        let local = |i: u32| cells.binary_search(&i).map_or(NONE, |k| k as u32);
        let of_slot: BTreeMap<u32, u32> = cells.iter().map(|&i| self.slots[i as usize]).zip(0..).collect();
        let links = (0..).zip(&cells).map(|(k, &i)| {
            let at = self.at[i as usize];
            [0, 1, 2, 3, 4, 5].map(|face| {
                let step = step_to(face);
                let next = [0, 1, 2].map(|axis| at[axis].wrapping_add_signed(step[axis] as i32));
                nets.cells.find(next).and_then(|slot| of_slot.get(&slot).copied()).unwrap_or(k)
            })
        });
        let clear = |i: u32| {
            let cell = nets.cells.get(self.slots[i as usize]);
            let clear = cube_loops()[cell.case(number)].clear[0];
            if cell.simple == 1 { Vec3::ZERO } else { clear * (GAP / 2.0) }
        };
        let of_polygon = |polygon: &Polygon| {
            // Gains are those of the label of the lower number.
            let side = if polygon.labels.iter().all(|&other| other >= number) { 1.0 } else { -1.0 };
            ThinPolygon {
                polygon: *polygon,
                side,
                clear: polygon.cells.map(clear),
                cells: polygon.cells.map(local),
            }
        };
        ThinLabel {
            number,
            voxels: nets.grid.voxels(number) as f64,
            is_whole: cells.len() == nets.slots_of(number).len(),
            bias: 0.0,
            polygons: polygons.iter().map(of_polygon).collect(),
            links: links.collect(),
            is_pair: cells.iter().map(|&i| pair(nets.cells.get(self.slots[i as usize])).is_some()).collect(),
            cells,
        }
    }

    /// Returns what is missing around each cell of a label, and in sum.
    fn missing(&self, label: &ThinLabel) -> (Vec<Missing>, f64) {
        let mut missing = vec![Missing::default(); label.cells.len()];
        let mut sum = label.bias;
        for ThinPolygon { polygon, side, clear, cells } in &label.polygons {
            let mut corners = self.corners(polygon);
            corners.iter_mut().zip(clear).for_each(|(corner, clear)| corner.1 += *clear);
            let (gain, area) = gain_of(corners);
            sum -= f64::from(gain * side);
            let cells = cells.iter().filter(|&&k| k != NONE);
            let share = side / cells.clone().count().max(1) as f32;
            for &k in cells {
                let found = &mut missing[k as usize];
                found.amount[0] -= gain * share;
                found.amount[1] += area.length() * share.abs();
                found.area += area * share;
            }
        }
        let size: f32 = missing.iter().map(|found| found.amount[1]).sum();
        missing.iter_mut().for_each(|found| found.amount[0] += label.bias as f32 * found.amount[1] / size);
        (missing, sum)
    }

    /// Moves cells in which two labels meet outwards, by what is missing nearby, or inwards.
    fn give(&mut self, label: &ThinLabel, mut missing: Vec<Missing>, sum: f32) {
        let outwards: Vec<Vec3> = missing.iter().map(|found| found.area.normalize_or_zero()).collect();
        for ((found, &i), (outwards, is_pair)) in
            missing.iter_mut().zip(&label.cells).zip(outwards.iter().zip(&label.is_pair))
        {
            let offset = self.offsets[i as usize];
            let moved = within_reach(offset + *outwards * ROOM.copysign(sum)) - offset;
            if !is_pair || moved.length_squared() < ROOM * ROOM / 4.0 {
                found.amount[1] = 0.0;
            }
        }
        let can_move: Vec<bool> = missing.iter().map(|found| found.amount[1] > 0.0).collect();
        let amounts = averaged(missing.iter().map(|found| found.amount).collect(), label.links.iter());
        for (((&i, outwards), [amount, size]), can_move) in
            label.cells.iter().zip(outwards).zip(amounts).zip(can_move)
        {
            if can_move && size > 0.0 {
                let shift = outwards * (amount / size).clamp(-MOST, MOST);
                self.offsets[i as usize] = within_reach(self.offsets[i as usize] + shift);
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
    pub fn volume(&self, number: u16) -> f64 {
        debug_assert_ne!(number, BACKGROUND);
        let slots = self.slots_of(number);
        let Some(&first) = slots.first() else { return 0.0 };
        let origin = self.cells.get(first).at;
        let mut six_volumes = 0.0;
        for crossing in slots.iter().flat_map(|&slot| self.crossings(slot)) {
            let Some(far) = crossing.ends.iter().position(|&end| end == number) else { continue };
            for triangle in self.patch(&crossing, far == 1).triangles() {
                let [a, b, c] = triangle.each_ref().map(|vertex| {
                    let vertex = self.coarse.follow(*vertex);
                    let shift = match vertex {
                        NetVertex::Cell { slot, .. } => self.coarse.shift(slot),
                        _ => Vec3::ZERO,
                    };
                    (self.position(number, vertex, origin) + shift).as_dvec3()
                });
                six_volumes += a.dot(b.cross(c));
            }
        }
        six_volumes / 6.0
    }
}
