//! Saves the surfaces and restores them bit for bit. The saved state holds the cells in the order of their slots, since
//! vertices are numbered in that order, and no labels: they come from the same volume.

use super::cells::{Cell, Cells};
use super::label_grid::LabelGrid;
use super::{CellBox, LabelParams, LabelSurfaces};
use crate::math::Vec3;
use crate::methods::saved::{Hash, Magic, decode, encode};
use crate::methods::{MethodError, Parameters};
use crate::pauses::{Pauses, finished};
use serde::{Deserialize, Serialize};

const MAGIC: Magic = *b"VSCLLAB\x02";

/// The saved state of [`LabelSurfaces`].
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: LabelParams,
    /// The labels in the order of their numbers.
    labels: Vec<f64>,
    /// Index and offset of the cell in each slot; `None` for free slots.
    cells: Vec<Option<([u32; 3], Vec3)>>,
    /// The free slots, in the order in which they became free.
    free: Vec<u32>,
    /// First and last cell of the box that is being smoothed.
    area: Option<[[u32; 3]; 2]>,
    /// First and last cell of the box that is to be coarsened then.
    pending: Option<[[u32; 3]; 2]>,
    iterations: u32,
    steps: u32,
    residual: f64,
}

impl LabelSurfaces {
    /// Returns the state as bytes for [`Self::restore`], without the label map.
    pub fn save(&self) -> Vec<u8> {
        let cells = self.nets.cells.slots().iter();
        encode(
            &MAGIC,
            &State {
                fingerprint: self.fingerprint(),
                params: self.params.clone(),
                labels: self.nets.grid.values().to_vec(),
                cells: cells.map(|cell| cell.is_live().then_some((cell.at, cell.offset))).collect(),
                free: self.nets.cells.free().to_vec(),
                pending: self.nets.coarse.pending.map(|area| [area.low, area.high]),
                area: self.zone.as_ref().map(|zone| [zone.area.low, zone.area.high]),
                iterations: self.iterations,
                steps: self.steps,
                residual: self.residual,
            },
        )
    }

    /// Restores a state from the bytes of [`Self::save`], for surfaces of the same label map as it is now.
    ///
    /// # Errors
    /// [`MethodError::BadState`] for any other bytes; nothing has changed then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let state: State = decode(&MAGIC, bytes)?;
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        if state.fingerprint != self.fingerprint() {
            return bad("volume", "the state belongs to another label map, or other labels of it");
        }
        if state.params.check_ranges().is_err() {
            return bad("parameters", "out of range");
        }
        let last = self.nets.everywhere().high;
        let is_box = |[low, high]: &[[u32; 3]; 2]| (0..3).all(|i| low[i] <= high[i] && high[i] <= last[i]);
        if !state.area.iter().chain(&state.pending).all(is_box) || state.iterations > state.params.smoothing {
            return bad("progress", "inconsistent");
        }
        let Some(grid) = self.nets.grid.renumbered(&state.labels) else {
            return bad("labels", "inconsistent");
        };
        let Some(cells) = self.restored(&grid, &state)? else { return bad("cells", "inconsistent") };
        self.nets.restore(grid, cells);
        let pauses = Pauses::default();
        finished(self.recount(&pauses));
        self.params = state.params;
        self.zone = None;
        finished(self.coarsen(self.nets.everywhere(), &[], &mut [], &pauses));
        if let Some([low, high]) = state.area {
            finished(self.wake(CellBox { low, high }, &pauses));
        }
        if let Some([low, high]) = state.pending {
            let (edge, area) = (self.params.edge, CellBox { low, high });
            finished(self.nets.coarsen(edge, &area, true, &mut [], &pauses));
        }
        (self.iterations, self.steps, self.residual) = (state.iterations, state.steps, state.residual);
        self.off.clear();
        if self.is_settled() {
            self.measure_all();
        }
        self.versions.record_all(self.nets.grid.values().len());
        Ok(())
    }

    /// Returns the cells of a saved state, if they are those through which the surfaces of the label map pass.
    fn restored(&self, grid: &LabelGrid, state: &State) -> Result<Option<Cells>, MethodError> {
        let count = |cells: &[Cell]| cells.iter().filter(|cell| cell.is_live()).count();
        let wanted = count(self.nets.cells.slots());
        let list = (state.cells.iter()).map(|saved| {
            let Some((at, offset)) = *saved else {
                return Some(Cell::new([0; 3], [0; 8]));
            };
            self.nets.cells.find(at)?;
            let is_within = offset.is_finite() && super::zone::within_reach(offset) == offset;
            is_within.then(|| Cell { offset, ..Cell::new(at, grid.corners(at)) })
        });
        let Some(list) = list.collect::<Option<Vec<Cell>>>() else { return Ok(None) };
        if count(&list) != wanted {
            return Ok(None);
        }
        Ok(Cells::restored(grid.dims(), list, state.free.clone())?)
    }

    /// Returns a hash of the labels of all voxels and of the grid.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        self.nets.to_world().to_cols_array().iter().for_each(|value| hash.mix(value.to_bits()));
        self.nets.grid.dims().iter().for_each(|&n| hash.mix(n as u64));
        self.nets.grid.hash(&mut hash);
        hash.value()
    }
}
