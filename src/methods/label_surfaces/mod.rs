//! Surfaces of a label map: one closed surface for each label, none of which intersects itself or another, and which
//! follow changes of the label map.
//!
//! The surfaces are surface nets: polygons around the edges of the voxel grid that cross from one label to another
//! (`nets`), whose vertices are smoothed within the grid's cells (`smooth`), so that each voxel stays on its side of
//! every surface. What smoothing takes from the volume of a label is given back (`balance`; `thin` for labels of a voxel
//! or two), and intersections are resolved (`untangle`; `envelope` tells where there are none). A label whose volume is
//! still more than 1 % off is named in a warning. All of this is local: after a change of some voxels, only cells nearby
//! are touched.
//!
//! Voxels of a label are connected across their faces. Labels that touch are a hundredth of a voxel apart.

mod balance;
mod cells;
mod coarsen;
mod components;
mod counts;
mod cube_loops;
mod envelope;
mod extract;
mod label_grid;
mod nets;
mod params;
mod smooth;
mod state;
mod thin;
mod untangle;
mod versions;
mod zone;

pub use params::LabelParams;

use crate::math::{DAffine3, DVec3, box_corners};
use crate::mesh::{TriangleMesh, grid_origin};
use crate::methods::method::method;
use crate::methods::{LiveSurface, MethodError, Parameters, StepReport, Times};
use crate::pauses::{Pauses, finished};
use crate::remesh::Changes;
use crate::volume::{Region, Volume, listed};
use crate::warning::{Place, Warning, WarningCode};
use cells::CellBox;
use components::Components;
use counts::Counts;
use label_grid::LabelGrid;
use nets::Nets;
use std::collections::{BTreeMap, BTreeSet};
use versions::Versions;
use zone::Zone;

/// Least number of smoothing iterations in a step.
const ITERATIONS: u32 = 10;
/// Number of times that a cell is smoothed in a step, if the part to be smoothed is so small that this needs more
/// iterations: after a change of some voxels, one step settles the surfaces.
const WORK: usize = 200_000;
/// Number of smoothing iterations after which volumes are balanced.
const BETWEEN: u32 = 4;
/// Number of times that volumes are balanced at the end.
const BALANCES: u32 = 3;
/// The relative error of a label's volume above which there is a warning.
const WARNED: f64 = 0.01;
/// The relative error of a thin label's volume, as far as it is quickly seen, above which it is balanced by itself, and
/// measured. With half of it, labels are changed that are right; with twice as much, errors of 1 % may be missed.
const NOTED: f64 = 0.004;
/// The number of times that a label may be as large as all thin ones beside it for it to be balanced and measured with them.
const MOST_TIMES: usize = 32;
/// Distance from a change, in cells, up to which surfaces are smoothed again.
const HALO: u32 = 6;
/// Largest distance of the volume from the origin of world space, in voxels: positions in single precision are then as
/// exact as tests of intersections assume.
const MOST_VOXELS_AWAY: f64 = 10_000.0;

/// The surfaces of all labels of a label map, or of some.
pub struct LabelSurfaces {
    nets: Nets,
    params: LabelParams,
    /// The part that is being smoothed; `None` when all is done.
    zone: Option<Zone>,
    /// Number of iterations made in the zone.
    iterations: u32,
    steps: u32,
    residual: f64,
    /// The counts of all surfaces together.
    counts: Counts,
    /// Those of each label; that of number 1 comes first.
    label_counts: Vec<Counts>,
    components: Components,
    versions: Versions,
    /// The relative error of the volume of each label for which it is above [`WARNED`], by number.
    off: BTreeMap<u16, f64>,
    clock: fn() -> f64,
}

method!(LabelSurfaces, LabelParams);

impl LiveSurface for LabelSurfaces {
    fn surface(&self) -> TriangleMesh {
        self.nets.all_meshes()
    }

    fn origin(&self) -> DVec3 {
        self.nets.origin()
    }

    fn counts(&self) -> [usize; 2] {
        let merged = (1..=self.label_counts.len() as u16).map(|number| self.nets.coarse.merged(number)).sum();
        self.counts.without(merged)
    }

    fn versions(&self) -> [u32; 2] {
        self.versions.all()
    }
}

impl LabelSurfaces {
    /// Returns the origin of all surfaces in world space, see [`TriangleMesh::origin`].
    pub fn origin(&self) -> DVec3 {
        self.nets.origin()
    }

    /// Creates the surfaces of the first frame of a label map, along the faces of the voxels at first; `labels` are those
    /// that get surfaces, by default all.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for a volume that is no label map, labels it does not have, or parameters out of
    /// range; an error about memory.
    pub fn new(volume: &Volume, labels: Option<Vec<f64>>, params: LabelParams) -> Result<Self, MethodError> {
        finished(Self::begin(volume, labels, params, None)?)
    }

    /// Begins to create surfaces as [`Self::new`] does, in [slices](crate::pauses); the volume is not needed any
    /// more then. They have at most `max_vertices` vertices, by default eight million: one for each cell of the grid
    /// through which they pass.
    ///
    /// # Errors
    /// As [`Self::new`]; some only at the end.
    pub fn begin(
        volume: &Volume,
        labels: Option<Vec<f64>>,
        params: LabelParams,
        max_vertices: Option<usize>,
    ) -> Result<impl Future<Output = Result<Self, MethodError>> + use<>, MethodError> {
        params.check_ranges()?;
        check_precision(volume)?;
        Ok(Self::create(volume.clone(), labels, params, max_vertices))
    }

    async fn create(
        volume: Volume,
        labels: Option<Vec<f64>>,
        params: LabelParams,
        max_vertices: Option<usize>,
    ) -> Result<Self, MethodError> {
        let pauses = Pauses::default();
        let (to_world, grid) = (volume.affine(), LabelGrid::new(&volume, labels, &pauses).await?);
        drop(volume);
        let nets = Nets::new(grid, to_world, max_vertices, &pauses).await?;
        let everywhere = nets.everywhere();
        let mut surfaces = Self {
            counts: Counts::default(),
            label_counts: Vec::new(),
            components: Components::default(),
            nets,
            params,
            zone: None,
            iterations: 0,
            steps: 0,
            residual: f64::NAN,
            versions: Versions::default(),
            off: BTreeMap::new(),
            clock: || 0.0,
        };
        let cells = surfaces.nets.cells.slots().len();
        surfaces.recount(&pauses).await;
        pauses.after(cells).await;
        // All positions are in the middle, where nothing intersects.
        surfaces.wake(everywhere, &pauses).await;
        pauses.after(cells).await;
        surfaces.coarsen(everywhere, &[], &mut [], &pauses).await;
        Ok(surfaces)
    }

    /// Returns the labels that have voxels and a surface, in ascending order.
    pub fn labels(&self) -> Vec<f64> {
        self.nets.grid.labels()
    }

    /// Returns the surface of one label in world space.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the label has no surface.
    pub fn mesh(&self, label: f64) -> Result<TriangleMesh, MethodError> {
        Ok(self.nets.mesh(self.number_of(label)?))
    }

    /// Returns the numbers of vertices and triangles of the surface of one label.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the label has no surface.
    pub fn mesh_counts(&self, label: f64) -> Result<[usize; 2], MethodError> {
        let number = self.number_of(label)?;
        let counts = self.label_counts.get(usize::from(number) - 1).copied().unwrap_or_default();
        Ok(counts.without(self.nets.coarse.merged(number)))
    }

    /// Returns the topology and the geometry version of the surface of one label, as [`LiveSurface::versions`] does for
    /// all together: they increase only when that surface changes.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the label has no surface.
    pub fn mesh_versions(&self, label: f64) -> Result<[u32; 2], MethodError> {
        Ok(self.versions.of(self.number_of(label)?))
    }

    /// Returns the number of a label that has, or had, a surface.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if it never had one.
    pub fn number_of(&self, label: f64) -> Result<u16, MethodError> {
        self.nets.grid.number(label).ok_or_else(|| {
            let problem =
                format!("must be a label that has a surface ({}), got {label}", listed(self.labels()));
            MethodError::invalid("label", problem)
        })
    }

    /// Adopts the voxels of `volume`, which has the grid of the volume that the surfaces were made of, in a region, where
    /// they have changed. Surfaces are along the faces of changed voxels at first, and are smoothed by the next steps.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the volume has another grid or is no label map, or the region is not within it;
    /// nothing has changed then.
    pub fn refresh(&mut self, volume: &Volume, region: Region) -> Result<(), MethodError> {
        if volume.dims() != self.nets.grid.dims() || volume.affine() != *self.nets.to_world() {
            return Err(MethodError::invalid(
                "volume",
                "must have the grid of the volume that the surfaces are of",
            ));
        }
        let dims = self.nets.grid.dims();
        let changed = CellBox {
            low: region.min.map(|n| n as u32),
            high: [0, 1, 2].map(|axis| (region.min[axis] + region.dims[axis]) as u32),
        };
        let touched = changed.grown(1, dims);
        let mut old = self.nets.grid.read(volume, region)?;
        let pauses = Pauses::default();
        finished(self.count(&touched, Counts::remove, &pauses));
        let updated = self.nets.update(changed);
        if updated.is_err() {
            // The cells as they were need no memory that they did not have.
            self.nets.grid.replace(region, &mut old);
            self.nets.update(changed)?;
        }
        finished(self.count(&touched, Counts::add, &pauses));
        finished(self.components.update(&self.nets.cells, &changed, &pauses));
        let untangle = async |nets: &mut Nets| nets.untangle(touched, None, &pauses).await;
        let untangled = if updated.is_ok() { finished(untangle(&mut self.nets)) } else { Vec::new() };
        let area = changed.grown(HALO, dims);
        let area = self.zone.as_ref().map_or(area, |unfinished| unfinished.area.union(&area));
        finished(self.wake(area, &pauses));
        let mut reconnected = updated.as_ref().map_or_else(|_| self.nets.no_labels(), Clone::clone);
        finished(self.coarsen(touched, &untangled, &mut reconnected, &pauses));
        updated?;
        self.nets.flag_labels_in(untangled, &mut reconnected);
        self.versions.record(&[], &reconnected);
        Ok(())
    }

    /// Coarsens the surfaces around a box, and cells in slots, that have changed, or prepares that while surfaces are yet to
    /// be smoothed; sets the flag, by number, of each label whose triangles have changed by that.
    async fn coarsen(&mut self, area: CellBox, slots: &[u32], reconnected: &mut [bool], pauses: &Pauses) {
        let cells = slots.iter().map(|&slot| self.nets.cells.get(slot).at);
        let area = cells.fold(area, |area, at| area.union(&CellBox { low: at, high: at }));
        self.nets.coarsen(self.params.edge, &area, self.zone.is_some(), reconnected, pauses).await;
    }

    /// Counts again from the beginning, when labels may have other numbers, and cells other places.
    async fn recount(&mut self, pauses: &Pauses) {
        let everywhere = self.nets.everywhere();
        self.counts = Counts::default();
        self.label_counts.clear();
        self.count(&everywhere, Counts::add, pauses).await;
        self.components = Components::default();
        self.components.update(&self.nets.cells, &everywhere, pauses).await;
    }

    /// Adds the counts of the part in a box to those of its labels and of all, or removes them.
    async fn count(&mut self, area: &CellBox, change: fn(&mut Counts, Counts), pauses: &Pauses) {
        let labels = self.nets.grid.values().len();
        if self.label_counts.len() < labels {
            self.label_counts.resize(labels, Counts::default());
        }
        let add = |number, part| {
            change(&mut self.counts, part);
            change(&mut self.label_counts[usize::from(number) - 1], part);
        };
        self.nets.count(area, pauses, add).await;
    }

    /// Returns the current parameters.
    pub fn params(&self) -> &LabelParams {
        &self.params
    }

    /// Replaces the parameters. If the smoothing changes, all surfaces are smoothed again, from where they are; longer
    /// edges are made by the last step.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`]; nothing has changed then.
    pub fn set_params(&mut self, params: LabelParams) -> Result<(), MethodError> {
        params.check_ranges()?;
        let before = std::mem::replace(&mut self.params, params);
        if self.params.smoothing != before.smoothing {
            finished(self.wake(self.nets.everywhere(), &Pauses::default()));
        }
        if self.params.edge != before.edge {
            let mut reconnected = self.nets.no_labels();
            let everywhere = self.nets.everywhere();
            finished(self.nets.coarsen(
                self.params.edge,
                &everywhere,
                true,
                &mut reconnected,
                &Pauses::default(),
            ));
            self.versions.record(&[], &reconnected);
            self.off.clear();
            if self.is_settled() {
                self.measure_all();
            }
        }
        Ok(())
    }

    /// Sets the clock, a function that returns the time in milliseconds, for [`StepReport::times`].
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// Makes one step: some iterations of smoothing, after which volumes are balanced and nothing intersects.
    ///
    /// # Errors
    /// None at present.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        finished(self.step_in_slices())
    }

    /// Makes one step as [`Self::step`] does, in [slices](crate::pauses).
    ///
    /// # Errors
    /// As [`Self::step`].
    pub async fn step_in_slices(&mut self) -> Result<StepReport, MethodError> {
        let pauses = Pauses::default();
        let mut times = Times::default();
        if let Some(mut zone) = self.zone.take() {
            self.steps += 1;
            let most = ITERATIONS.max((WORK / zone.moving().max(1)) as u32);
            let wanted = self.params.smoothing.saturating_sub(self.iterations).min(most);
            self.iterations += wanted;
            let is_last = self.iterations >= self.params.smoothing;
            let (offsets, diagonals) = (zone.offsets.clone(), zone.diagonals());
            let start = (self.clock)();
            pauses.after(zone.moving()).await;
            for i in 1..=wanted {
                self.residual = zone.smooth();
                if i % BETWEEN == 0 {
                    pauses.after(zone.moving()).await;
                    zone.balance(&pauses).await;
                }
                pauses.after(zone.moving()).await;
            }
            let start = self.note("smoothing", &mut times, start);
            let balances = if is_last && wanted > 0 { BALANCES } else { 0 };
            for _ in 0..balances {
                zone.balance(&pauses).await;
                pauses.after(zone.moving()).await;
            }
            let noted = if is_last { self.noted(&zone, &pauses).await } else { Vec::new() };
            zone.write(&mut self.nets);
            if balances > 0 && !noted.is_empty() {
                zone.balance_thin(&mut self.nets, &noted, &pauses).await;
            }
            let start = self.note("volumes", &mut times, start);
            let area = zone.area.grown(1, self.nets.grid.dims());
            let [mut moved, mut reconnected] = [(); 2].map(|()| self.nets.no_labels());
            pauses.after(zone.moving()).await;
            let untangled = self.nets.untangle(area, Some(&mut zone), &pauses).await;
            zone.read(&self.nets);
            pauses.after(zone.moving()).await;
            self.nets.flag_labels_in(zone.moved_from(&offsets), &mut moved);
            pauses.after(zone.moving()).await;
            zone.flag_reconnected(&diagonals, &mut reconnected);
            // Diagonals around these are not known, as far as they are outside the zone.
            self.nets.flag_labels_in(untangled.iter().copied(), &mut reconnected);
            let start = self.note("intersections", &mut times, start);
            pauses.after(zone.moving()).await;
            let mut seen = if is_last { zone.numbers() } else { Vec::new() };
            if is_last && let Some(area) = self.nets.coarse.pending {
                seen.extend(self.nets.numbers_within(&area));
                seen.sort_unstable();
                seen.dedup();
            }
            self.zone = (!is_last).then_some(zone);
            self.coarsen(area, &untangled, &mut reconnected, &pauses).await;
            let start = self.note("coarsening", &mut times, start);
            pauses.after(self.nets.cells.slots().len()).await;
            if is_last {
                self.measure(&seen, &noted, &pauses).await;
                self.note("volumes", &mut times, start);
            }
            self.versions.record(&moved, &reconnected);
        } else if let Some(area) = self.nets.coarse.pending {
            self.steps += 1;
            let start = (self.clock)();
            self.coarsen_alone(area, &pauses).await;
            self.note("coarsening", &mut times, start);
        }
        Ok(self.report(times))
    }

    /// Coarsens smooth surfaces in a box, where edges are to be longer.
    async fn coarsen_alone(&mut self, area: CellBox, pauses: &Pauses) {
        let mut reconnected = self.nets.no_labels();
        self.coarsen(area, &[], &mut reconnected, pauses).await;
        let seen = self.nets.numbers_within(&area);
        self.measure(&seen, &[], pauses).await;
        self.versions.record(&[], &reconnected);
    }

    /// Returns whether the next step would change nothing.
    fn is_settled(&self) -> bool {
        self.zone.is_none() && self.nets.coarse.pending.is_none()
    }

    /// Returns the labels in a zone that are thin and whose volumes may be off, and those that meet them, in ascending
    /// order.
    async fn noted(&self, zone: &Zone, pauses: &Pauses) -> Vec<u16> {
        let gains = zone.gains(self.label_counts.len(), pauses).await;
        let is_off = |number: &u16| {
            let voxels = self.nets.grid.voxels(*number);
            let triangles = self.label_counts[usize::from(*number) - 1].triangles;
            let gain = gains[usize::from(*number)].abs();
            Nets::is_sheet(voxels, triangles)
                || Nets::is_thin(voxels, triangles) && gain > NOTED * voxels as f64
        };
        let numbers = zone.numbers().into_iter().filter(is_off);
        let mut noted: BTreeSet<u16> = numbers.collect();
        if !noted.is_empty() {
            let own: usize = noted.iter().map(|&number| self.nets.grid.voxels(number)).sum();
            zone.add_neighbours(&mut noted);
            // A neighbour many times as large gives no noticeable part of its volume, and takes long to measure.
            noted.retain(|&number| self.nets.grid.voxels(number) < MOST_TIMES * own);
        }
        noted.into_iter().collect()
    }

    /// Measures the labels in a zone whose volumes may be off: those noted, and with longer edges all that were seen.
    async fn measure(&mut self, seen: &[u16], noted: &[u16], pauses: &Pauses) {
        let measured = if self.params.edge > 1.0 { seen } else { noted };
        for number in seen {
            self.off.remove(number);
        }
        for &number in measured {
            let voxels = self.nets.grid.voxels(number) as f64;
            let error = self.nets.volume(number, pauses).await / voxels - 1.0;
            if voxels > 0.0 && error.abs() > WARNED {
                self.off.insert(number, error);
            }
        }
    }

    /// Measures all labels, when nothing is to be smoothed any more.
    fn measure_all(&mut self) {
        let all: Vec<u16> = (1..=self.label_counts.len() as u16).collect();
        finished(self.measure(&all, &all, &Pauses::default()));
    }

    fn warnings(&self) -> Vec<Warning> {
        let off = self.off.iter().filter(|&(&number, _)| self.nets.grid.voxels(number) > 0);
        let warning = |(&number, error): (&u16, &f64)| {
            let label = self.nets.grid.value(number);
            let text = format!(
                "label {label}: the volume of its surface is {:.1} % {} than that of its voxels; parts of it are as thin as a \
                 voxel, or its edges are long",
                error.abs() * 100.0,
                if *error < 0.0 { "less" } else { "more" }
            );
            Warning::at(WarningCode::ThinLabel, Place::Label(label), text)
        };
        off.map(warning).collect()
    }

    /// Adds the time since `start` to that of a part; returns the time now.
    fn note(&self, part: &'static str, times: &mut Times, start: f64) -> f64 {
        let now = (self.clock)();
        times.add(part, now - start);
        now
    }

    async fn wake(&mut self, area: CellBox, pauses: &Pauses) {
        self.zone = Some(Zone::new(&self.nets, area, pauses).await);
        self.iterations = 0;
    }

    fn report(&self, times: Times) -> StepReport {
        let done = self.is_settled();
        let [vertices, triangles] = LiveSurface::counts(self);
        let share = f64::from(self.iterations) / f64::from(self.params.smoothing.max(1));
        let phase = if self.zone.is_some() { "smoothing" } else { "coarsening" };
        StepReport {
            iteration: self.steps,
            done,
            phase: if done { "done" } else { phase }.into(),
            progress: if done { 1.0 } else { share.min(1.0) },
            residual: self.residual,
            tolerance: 0.0,
            vertices: vertices as u32,
            triangles: triangles as u32,
            components: self.components.count() as u32,
            euler: self.counts.euler() as i32,
            events: Changes::default(),
            times,
            warnings: if done { self.warnings() } else { Vec::new() },
        }
    }
}

/// Returns an error unless positions in single precision are much finer than the gaps between surfaces.
fn check_precision(volume: &Volume) -> Result<(), MethodError> {
    let affine = DAffine3::from_translation(-grid_origin(&volume.affine(), volume.dims())) * volume.affine();
    let corners = box_corners(DVec3::ZERO, DVec3::from(volume.dims().map(|n| n as f64)));
    let farthest =
        corners.into_iter().map(|p| affine.transform_point3(p).abs().max_element()).fold(0.0, f64::max);
    let axes = [affine.matrix3.x_axis, affine.matrix3.y_axis, affine.matrix3.z_axis];
    let voxel = axes.iter().map(|axis| axis.length()).fold(f64::INFINITY, f64::min);
    if farthest < MOST_VOXELS_AWAY * voxel {
        return Ok(());
    }
    let problem = format!(
        "must be less than {MOST_VOXELS_AWAY} voxels wide, for positions in single precision, got {farthest} at a voxel \
         size of {voxel}"
    );
    Err(MethodError::invalid("volume", problem))
}

#[cfg(test)]
mod tests;
