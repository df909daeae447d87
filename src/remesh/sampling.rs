//! The sampling distance δ and the three bounds derived from it (section 3.2), uniform or with a size per vertex.

use crate::mesh::{Mesh, ScalarKey, VertexId};

/// The sampling density of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    delta: f32,
    /// The scalar attribute size − 1; 0 for new vertices without a source.
    sizes: Option<ScalarKey>,
}

/// Upper bound of an edge in δ, equation (2): above 2, so that halves of a split edge respect the lower bound.
const LONGEST: f32 = 2.5;

/// Contact distance in δ, 2.5/√3, equation (3): the longest distance between a vertex passing through a triangle and the nearest corner.
const CONTACT: f32 = 1.443_375_7;

impl Sampling {
    /// Uniform sampling with δ, a positive length.
    pub fn new(delta: f32) -> Self {
        Self { delta, sizes: None }
    }

    /// The same with δ · (1 + scalar) at each vertex, by a scalar attribute above −1. Small parts are still measured by δ.
    pub fn with_sizes(self, sizes: ScalarKey) -> Self {
        Self { sizes: Some(sizes), ..self }
    }

    /// The sampling between two vertices.
    #[inline]
    pub(super) fn between(self, mesh: &Mesh, u: VertexId, v: VertexId) -> Self {
        let Some(sizes) = self.sizes else { return self };
        let of = mesh.scalar(sizes);
        Self::new(self.delta * (1.0 + 0.5 * (of[u.index()] + of[v.index()])))
    }

    /// δ, the lower bound of an edge (1).
    #[inline]
    pub fn shortest(self) -> f32 {
        self.delta
    }

    /// 2.5 δ, the upper bound of an edge (2).
    #[inline]
    pub fn longest(self) -> f32 {
        LONGEST * self.delta
    }

    /// 2.5/√3 δ, the distance below which two non-adjacent vertices are in contact (3).
    #[inline]
    pub fn contact(self) -> f32 {
        CONTACT * self.delta
    }

    /// δ³, the volume below which a small closed part is a speck.
    #[inline]
    pub fn smallest_volume(self) -> f32 {
        self.delta * self.delta * self.delta
    }
}
