//! What can go wrong with a mesh as a whole.

/// Why a mesh cannot be built or used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// An argument outside what is accepted.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// The argument's name.
        parameter: &'static str,
        /// What was wrong and what is accepted.
        problem: String,
    },
    /// A boundary, a non-manifold edge or vertex, or triangles of opposite orientation.
    #[error("the mesh is not a closed surface: {problem}")]
    NotClosed {
        /// Where and how.
        problem: String,
    },
    /// Triangles cross where an embedded surface is needed.
    #[error("the mesh crosses itself: {pairs} pairs of triangles; an embedded one is needed")]
    SelfIntersecting {
        /// The number of crossing pairs of triangles.
        pairs: usize,
    },
    /// More memory than there is.
    #[error("the mesh needs {bytes} bytes, more than there is")]
    TooLarge {
        /// The memory asked for.
        bytes: u64,
    },
}
