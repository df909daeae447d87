//! The stepping interface common to all methods: the report that each step returns.

use crate::remesh::Changes;
use crate::warning::Warning;
use serde::Serialize;

/// The result of one step: the state of convergence, the size and topology of the mesh, and the edits made.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct StepReport {
    /// The number of steps since the start of the run; calls after its end are not counted.
    pub iteration: u32,
    /// Whether the method has finished, so that no further step is necessary.
    pub done: bool,
    /// The current phase as text for the user, such as "level 1".
    pub phase: String,
    /// The progress of the method from 0 to 1, NaN if unknown.
    pub progress: f64,
    /// The convergence measure of the method, such as the mean energy of a deformable model; NaN if unknown.
    pub residual: f64,
    /// The value of `residual` below which the method counts as converged.
    pub tolerance: f64,
    /// The number of vertices of the mesh.
    pub vertices: u32,
    /// The number of triangles of the mesh.
    pub triangles: u32,
    /// The number of connected components of the mesh.
    pub components: u32,
    /// The Euler characteristic χ of the mesh, summed over its components.
    pub euler: i32,
    /// The numbers of edits of the mesh since the last report, by kind of edit.
    pub events: Changes,
    /// The time spent in each part of the step, in milliseconds; all 0 if the model has no clock.
    pub times: Times,
    /// Notes to read before relying on the result so far; empty if there is nothing to note.
    pub warnings: Vec<Warning>,
}

/// Durations in milliseconds of named parts of a step, for its report, in the order in which they first ran.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times(pub Vec<(&'static str, f64)>);

impl Serialize for Times {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

impl Times {
    /// Adds `milliseconds` to the duration of the part of the step named `part`.
    pub fn add(&mut self, part: &'static str, milliseconds: f64) {
        match self.0.iter_mut().find(|(name, _)| *name == part) {
            Some((_, sum)) => *sum += milliseconds,
            None => self.0.push((part, milliseconds)),
        }
    }
}
