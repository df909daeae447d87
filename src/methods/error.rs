//! The error type of all methods.

use crate::mesh::MeshError;
use crate::volume::VolumeError;

/// An error from setting up, stepping or restoring a method.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MethodError {
    /// A parameter, option or input is not accepted, such as a number out of its range.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// The name of the parameter in the public API.
        parameter: &'static str,
        /// The reason; if it is a range, usually with the accepted range and the invalid value.
        problem: String,
    },
    /// The caller's mesh is unsuitable, a mesh would intersect itself, or one does not fit into memory.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The volume is unsuitable, or data of its size does not fit into memory.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The surface exceeds the largest number of vertices that the image and the sampling allow.
    #[error(
        "the surface would have more than {most} vertices: use longer edges, a smaller volume or smaller ellipsoids, or forces that do not inflate it"
    )]
    TooManyVertices {
        /// The largest number of vertices accepted.
        most: usize,
    },
    /// A linear system could not be solved to the requested tolerance.
    #[error("the system of {constraints} constraints cannot be solved to the requested tolerance: {cause}")]
    Singular {
        /// The number of equations in the system.
        constraints: usize,
        /// The likely cause, and how to avoid it.
        cause: &'static str,
    },
    /// The bytes from which a run should be restored are not a valid state of this model.
    #[error("saved state, {field}: {problem}")]
    BadState {
        /// The invalid part of the state.
        field: &'static str,
        /// The defect, with the accepted range if there is one.
        problem: String,
    },
}

impl MethodError {
    /// Makes a [`MethodError::InvalidArgument`].
    pub fn invalid(parameter: &'static str, problem: impl Into<String>) -> Self {
        Self::InvalidArgument { parameter, problem: problem.into() }
    }
}
