//! The sampling distance δ and the three bounds derived from it (section 3.2), uniform or with a size per vertex.

use crate::mesh::{Mesh, ScalarKey, VertexId};

/// The sampling density of a mesh: δ and the bounds on edge length and contact distance derived from it, used by
/// [`Resolver`](super::Resolver).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    delta: f32,
    /// The scalar attribute that stores size − 1, where size is the local factor on δ; 0 for new vertices without a
    /// source.
    sizes: Option<ScalarKey>,
}

/// Upper bound of the edge length in δ, equation (2): above 2, so that the halves of a split edge respect the lower
/// bound.
const LONGEST: f32 = 2.5;

/// Contact distance in δ, 2.5/√3, equation (3): the longest distance between a vertex passing through a triangle and
/// its nearest corner.
const CONTACT: f32 = 1.443_375_7;

impl Sampling {
    /// Creates a uniform sampling with δ = `delta`, a positive length.
    pub fn new(delta: f32) -> Self {
        Self { delta, sizes: None }
    }

    /// Returns this sampling with a local δ at each vertex: δ times 1 + the scalar attribute `sizes`, which must be
    /// above −1. Small components are still measured by δ, and no contacts beyond its contact distance are found, also
    /// where the local δ is larger.
    pub fn with_sizes(self, sizes: ScalarKey) -> Self {
        Self { sizes: Some(sizes), ..self }
    }

    /// Returns the uniform sampling that applies to a pair of vertices: δ scaled by the mean of their sizes.
    #[inline]
    pub(super) fn between(self, mesh: &Mesh, u: VertexId, v: VertexId) -> Self {
        let Some(sizes) = self.sizes else { return self };
        let of = mesh.scalar(sizes);
        Self::new(self.delta * (1.0 + 0.5 * (of[u.index()] + of[v.index()])))
    }

    /// Returns δ, the lower bound of the edge length (1).
    #[inline]
    pub fn shortest(self) -> f32 {
        self.delta
    }

    /// Returns 2.5 δ, the upper bound of the edge length (2).
    #[inline]
    pub fn longest(self) -> f32 {
        LONGEST * self.delta
    }

    /// Returns 2.5/√3 δ, the distance below which two non-adjacent vertices are in contact (3).
    #[inline]
    pub fn contact(self) -> f32 {
        CONTACT * self.delta
    }

    /// Returns δ³, the volume below which a small closed component is removed.
    #[inline]
    pub fn smallest_volume(self) -> f32 {
        self.delta * self.delta * self.delta
    }
}
