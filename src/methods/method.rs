//! The interface common to all methods, by which bindings and tests treat them alike.

use super::{MethodError, Parameters, StepReport};
use crate::math::DVec3;
use crate::mesh::TriangleMesh;

/// A surface that changes while a method runs.
pub trait LiveSurface {
    /// Returns a copy of the current surface, in world coordinates.
    fn surface(&self) -> TriangleMesh;

    /// Returns the origin of the surface in world space, see [`TriangleMesh::origin`].
    fn origin(&self) -> DVec3;

    /// Returns the numbers of vertices and triangles of the current surface.
    fn counts(&self) -> [usize; 2];

    /// Returns the topology version, which increases when connectivity changes, and the geometry version, which
    /// increases when a vertex moves or connectivity changes. Those of an implicit surface are one number, which
    /// increases with every new surface.
    fn versions(&self) -> [u32; 2];
}

/// A method that fits a surface to data in steps, and can be changed, saved and restored between them.
pub trait Method: LiveSurface {
    /// The parameters of the method.
    type Params: Parameters;

    /// Returns the current parameters.
    fn params(&self) -> &Self::Params;

    /// Replaces the parameters, with which the run continues.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the first parameter that is not accepted; nothing has changed
    /// then.
    fn set_params(&mut self, params: Self::Params) -> Result<(), MethodError>;

    /// Sets the clock, a function that returns the time in milliseconds, for [`StepReport::times`]. By default all
    /// times are 0.
    fn set_clock(&mut self, clock: fn() -> f64);

    /// Makes one step; once the method is done, calls change nothing and report `done`.
    ///
    /// # Errors
    /// A [`MethodError`] that tells why the step is impossible, such as a lack of memory.
    fn step(&mut self) -> Result<StepReport, MethodError>;

    /// Returns the state of the run as bytes, without the input, for [`Self::restore`].
    fn save(&self) -> Vec<u8>;

    /// Replaces the run by one that [`Self::save`] returned, if this one has the same input; it continues with the same
    /// results, bit for bit.
    ///
    /// # Errors
    /// [`MethodError::BadState`] for bytes that are not a state of a run with this input; the run is then unchanged.
    fn restore(&mut self, state: &[u8]) -> Result<(), MethodError>;

    /// Makes `most` steps, at least one, or fewer if the method is done before; returns the report of the last one,
    /// with the events of all. Fewer steps are made, too, if one after the first needs voxels that are not loaded.
    ///
    /// # Errors
    /// That of the first step that is impossible; those before it are made.
    fn steps(&mut self, most: u32) -> Result<StepReport, MethodError> {
        let mut report = self.step()?;
        for _ in 1..most {
            if report.done {
                break;
            }
            let events = report.events;
            report = match self.step() {
                Err(MethodError::NeedsData { .. }) => break,
                next => next?,
            };
            report.events += events;
        }
        Ok(report)
    }
}

/// Makes a model with a [`LiveSurface`] a [`Method`]: each function of the trait calls the model's own one of the same
/// name, so that a caller who has but this one method needs no trait.
macro_rules! method {
    ($Model:ident, $Params:ident) => {
        impl $crate::methods::Method for $Model {
            type Params = $Params;

            fn params(&self) -> &$Params {
                self.params()
            }

            fn set_params(&mut self, params: $Params) -> Result<(), $crate::methods::MethodError> {
                self.set_params(params)
            }

            fn set_clock(&mut self, clock: fn() -> f64) {
                self.set_clock(clock);
            }

            fn step(&mut self) -> Result<$crate::methods::StepReport, $crate::methods::MethodError> {
                self.step()
            }

            fn save(&self) -> Vec<u8> {
                self.save()
            }

            fn restore(&mut self, state: &[u8]) -> Result<(), $crate::methods::MethodError> {
                self.restore(state)
            }
        }
    };
}

pub(super) use method;
