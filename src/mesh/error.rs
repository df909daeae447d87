//! Errors of building a mesh and of editing it.

use super::{MAX_VERTICES, VertexId};

/// An error of building or validating a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// An argument of a function is outside its accepted range.
    #[error("{parameter}: {problem}")]
    InvalidArgument {
        /// The name of the argument.
        parameter: &'static str,
        /// The invalid value and the accepted range, as text for the user.
        problem: String,
    },
    /// The surface has a boundary, a non-manifold edge or vertex, inconsistently oriented triangles, a triangle with
    /// two equal corners, or a vertex with too few or too many triangles.
    #[error("the mesh is not a closed surface: {problem}")]
    NotClosed {
        /// The defect and its location, as text for the user.
        problem: String,
    },
    /// The mesh intersects itself, but an embedded surface is required.
    #[error("the mesh intersects itself ({pairs} pairs of triangles); an embedded mesh is required")]
    SelfIntersecting {
        /// The number of pairs of triangles that intersect.
        pairs: usize,
    },
    /// A cut that would make the mesh intersect itself; the mesh is unmodified.
    #[error(
        "the mesh cannot be cut there: it intersects itself at the plane, parts of it are too near each other, or one is inside \
         another that faces the same way"
    )]
    CannotCut,
    /// Coordinates are so large, or lengths so small, that single precision can't represent the result.
    #[error("{problem}")]
    Precision {
        /// The lengths concerned, as text for the user.
        problem: String,
    },
    /// A loop that has to make progress in every round made none; the mesh is unmodified.
    #[error("no progress: {problem}")]
    NoProgress {
        /// The work that did not progress, and what may help, as text for the user.
        problem: String,
    },
    /// The mesh would have more vertices than [`MAX_VERTICES`].
    #[error(
        "the mesh would have about {vertices} vertices, and at most {MAX_VERTICES} are possible, so that there is memory left to work with it"
    )]
    TooManyVertices {
        /// The number of vertices that would be needed, estimated where it is not known in advance.
        vertices: u64,
    },
    /// More vertices are near each other than there is memory to test their triangles for intersections.
    #[error(
        "too many vertices of the mesh are near each other (over {pairs} pairs): it intersects itself in many places, or its edges \
         differ too much in length"
    )]
    TooCrowded {
        /// The number of pairs for which there is memory.
        pairs: usize,
    },
    /// A file of the mesh needs more memory than is left, or would exceed 4 GiB.
    #[error(
        "the mesh needs {bytes} bytes, more than is left of the 4 GiB of WebAssembly: free() what is no longer needed"
    )]
    TooLarge {
        /// The memory required, in bytes.
        bytes: u64,
    },
}

/// The reason why an edit of a mesh was rejected; the mesh is then unmodified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// The two vertices are not adjacent, or one of them is not live.
    #[error("{0:?} and {1:?} are not adjacent")]
    NotAnEdge(VertexId, VertexId),
    /// The two vertices, which the edit would connect, are already adjacent, or are the same vertex.
    #[error("{0:?} and {1:?} are already adjacent")]
    Adjacent(VertexId, VertexId),
    /// The edit would leave this vertex with fewer than three neighbours.
    #[error("{0:?} would be left with fewer than three neighbours")]
    ValenceTooLow(VertexId),
    /// The ends of the edge to be collapsed have this common neighbour besides the two vertices opposite the edge, so
    /// that a collapse would pinch a neck (link condition).
    #[error("link condition violated: {0:?} is a common neighbour but not opposite the edge")]
    LinkCondition(VertexId),
    /// The three edges passed to [`Mesh::cut`](super::Mesh::cut) bound a triangle of the surface.
    #[error("the three edges bound a triangle of the surface")]
    IsTriangle,
    /// This vertex is not a corner of an isolated tetrahedron, a connected component of four vertices.
    #[error("{0:?} is not a corner of an isolated tetrahedron")]
    NotATetrahedron(VertexId),
    /// The edit would make the mesh intersect itself; only edits through a collision guard are tested for it.
    #[error("the edit would make the mesh intersect itself")]
    WouldSelfIntersect,
    /// With the patch to be inserted, the surface would not be closed, or not be a manifold, at this vertex.
    #[error("the patch does not close the surface at {0:?}")]
    OpenPatch(VertexId),
    /// The edit needs a new vertex, but no vertex ids are left.
    #[error("no vertex ids are left")]
    Full,
}
