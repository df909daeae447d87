//! The error type of all methods.

use crate::mesh::MeshError;
use crate::volume::{BrickBox, VolumeError};

/// An error from setting up, stepping or restoring a method.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MethodError {
    /// A parameter, option or input is not accepted, such as a number out of its range.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// The name of the parameter, option or input in the public API.
        parameter: &'static str,
        /// The reason why the value is not accepted; if it is out of range, usually with the accepted range and the
        /// invalid value.
        problem: String,
    },
    /// The caller's mesh is unsuitable, a mesh would intersect itself, or one does not fit into memory.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The volume is unsuitable, or data of its size does not fit into memory.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The surface would exceed the largest number of vertices, since its edges are too short for its size or forces
    /// inflate it.
    #[error(
        "the surface would have more than {most} vertices: use longer edges, a smaller object, or forces that do not inflate it"
    )]
    TooManyVertices {
        /// The largest number of vertices accepted for the surface.
        most: usize,
    },
    /// There is more to work with than memory is given for.
    #[error("{problem}")]
    TooLarge {
        /// The limit that would be exceeded, and how to stay below it.
        problem: String,
    },
    /// A linear system, that of the implicit surface's constraints, could not be solved to the requested tolerance.
    #[error("the system of {constraints} constraints cannot be solved to the requested tolerance: {cause}")]
    Singular {
        /// The number of constraints, the equations of the system.
        constraints: usize,
        /// The likely cause of the failure, and how to avoid it.
        cause: &'static str,
    },
    /// Bricks of a sparse volume are missing that the next step may read; nothing has changed.
    #[error("needs voxels that are not loaded, in {} boxes", needs.len())]
    NeedsData {
        /// The boxes to insert into the volume, with a margin, so that this error is rare.
        needs: Vec<BrickBox>,
    },
    /// The bytes from which a run should be restored are not a valid state of this model.
    #[error("saved state, {field}: {problem}")]
    BadState {
        /// The part of the saved state that is invalid.
        field: &'static str,
        /// The defect of the invalid part, with the accepted range if there is one.
        problem: String,
    },
}

impl MethodError {
    /// Makes a [`MethodError::InvalidArgument`] from the name of a parameter and the reason why its value is not
    /// accepted.
    pub fn invalid(parameter: &'static str, problem: impl Into<String>) -> Self {
        Self::InvalidArgument { parameter, problem: problem.into() }
    }
}
