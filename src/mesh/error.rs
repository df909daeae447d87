//! What can go wrong with a mesh as a whole, and why an edit was refused.

use super::VertexId;

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

/// Why an edit was refused; the mesh is then as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// The two vertices are not neighbours.
    #[error("{0:?} and {1:?} are not joined by an edge")]
    NotAnEdge(VertexId, VertexId),
    /// The two vertices are neighbours, or one vertex.
    #[error("{0:?} and {1:?} are joined already")]
    Adjacent(VertexId, VertexId),
    /// A vertex would be left with fewer than three neighbours.
    #[error("{0:?} would be left with fewer than three neighbours")]
    ValenceTooLow(VertexId),
    /// The ends of the edge share a neighbour beyond the two opposite ones: a neck is in the way.
    #[error("{0:?} closes a ring of three edges that is no triangle")]
    NeckInTheWay(VertexId),
    /// The three edges bound a triangle.
    #[error("the ring of three edges is a triangle of the surface")]
    IsTriangle,
    /// The four vertices are not a component of their own.
    #[error("{0:?} is not a corner of a lone tetrahedron")]
    NotATetrahedron(VertexId),
    /// Triangles would cross.
    #[error("triangles would cross")]
    WouldCross,
    /// No ids are left.
    #[error("the mesh holds as many vertices as it can name")]
    Full,
}
