//! One stepping contract for every method.

use crate::remesh::Changes;
use serde::Serialize;

/// What one step did, and how far the method is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct StepReport {
    /// Steps taken since the beginning.
    pub iteration: u32,
    /// Whether the method has come to its end.
    pub done: bool,
    /// What the method is doing now, in words.
    pub phase: String,
    /// 0..1 where it can be known, else NaN.
    pub progress: f64,
    /// The method's own convergence figure.
    pub residual: f64,
    /// What the residual is compared with.
    pub tolerance: f64,
    /// Vertices of the mesh.
    pub vertices: u32,
    /// Triangles of the mesh.
    pub triangles: u32,
    /// Connected components of the mesh.
    pub components: u32,
    /// χ of the mesh, summed over its components.
    pub euler: i32,
    /// Edits since the last report.
    pub events: Changes,
    /// Milliseconds by part of the step; all 0 where no clock was given.
    pub times: Times,
}

/// Milliseconds by named part, in the order the parts ran.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times(pub Vec<(&'static str, f64)>);

impl Serialize for Times {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

impl Times {
    /// Adds `milliseconds` to `part`.
    pub fn add(&mut self, part: &'static str, milliseconds: f64) {
        match self.0.iter_mut().find(|(name, _)| *name == part) {
            Some((_, sum)) => *sum += milliseconds,
            None => self.0.push((part, milliseconds)),
        }
    }
}
