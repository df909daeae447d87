//! What can go wrong when a method is set up or restored.

use crate::mesh::MeshError;
use crate::volume::VolumeError;

/// Why a method refuses its input.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MethodError {
    /// A parameter or option outside what is accepted.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// The parameter's name, as in the public contract.
        parameter: &'static str,
        /// What was wrong and what is accepted.
        problem: String,
    },
    /// The mesh to start from cannot be used.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The volume cannot be used.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The surface has grown beyond what this image and sampling can need.
    #[error(
        "the surface would have more than {most} vertices: take longer edges, a smaller volume or ellipsoids, or forces that do not inflate it"
    )]
    TooManyVertices {
        /// The number accepted.
        most: usize,
    },
    /// A linear system without a usable solution.
    #[error("the system of {constraints} constraints cannot be solved to the tolerance asked for: {cause}")]
    Singular {
        /// Its size.
        constraints: usize,
        /// The likely cause, and what to do about it.
        cause: &'static str,
    },
    /// Bytes that are not a saved state of this model.
    #[error("saved state, {field}: {problem}")]
    BadState {
        /// The part of the state.
        field: &'static str,
        /// What was wrong and what is accepted.
        problem: String,
    },
}

impl MethodError {
    /// An [`MethodError::InvalidArgument`].
    pub fn invalid(parameter: &'static str, problem: impl Into<String>) -> Self {
        Self::InvalidArgument { parameter, problem: problem.into() }
    }
}
