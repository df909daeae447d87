//! The sampling distance δ of a mesh and the three bounds derived from it (Lachaud & Montanvert, section 3.2), uniform
//! or with a size per vertex.

use crate::mesh::{Mesh, ScalarKey, VertexId};

/// The sampling density of a mesh: δ and the bounds on edge length and contact distance derived from it, used by
/// [`Resolver`](super::Resolver).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    delta: f32,
    /// The scalar attribute that stores the size of each vertex minus 1, where size is the local factor on δ; without
    /// it, all sizes are 1.
    sizes: Option<ScalarKey>,
}

/// Upper bound of the edge length in units of δ, equation (2): above 2, so that the halves of a split edge respect the
/// lower bound δ.
const LONGEST: f32 = 2.5;

/// Contact distance in units of δ, 2.5/√3, equation (3): the longest distance between a vertex passing through a
/// triangle and its nearest corner.
const CONTACT: f32 = 1.443_375_7;

/// The size less 1 below which the local δ at a vertex is that of a small component: sizes by curvature are 0.7 at least.
const MEANT_SMALL: f32 = -0.31;

impl Sampling {
    /// Creates a uniform sampling with δ = `delta`, a positive length.
    pub fn new(delta: f32) -> Self {
        Self { delta, sizes: None }
    }

    /// Creates a uniform sampling whose upper bound of the edge length is `longest`, a positive length.
    pub fn up_to(longest: f32) -> Self {
        Self::new(longest / LONGEST)
    }

    /// Returns this sampling with a local δ at each vertex: δ times 1 + the scalar attribute `sizes`, which must be
    /// above −1. Unless sizes are below 0.69, small components are measured by δ itself, and where they are above 1, contacts are found
    /// only up to the contact distance of δ itself.
    pub fn with_sizes(self, sizes: ScalarKey) -> Self {
        Self { sizes: Some(sizes), ..self }
    }

    /// Returns the uniform sampling that applies between two vertices: δ scaled by the mean of their sizes (local
    /// factors).
    #[inline]
    pub(super) fn between(self, mesh: &Mesh, u: VertexId, v: VertexId) -> Self {
        let Some(sizes) = self.sizes else { return self };
        let of = mesh.scalar(sizes);
        Self::new(self.delta * (1.0 + 0.5 * (of[u.index()] + of[v.index()])))
    }

    /// Returns δ, the lower bound of the edge length, equation (1) of Lachaud & Montanvert.
    #[inline]
    pub fn shortest(self) -> f32 {
        self.delta
    }

    /// Returns 2.5 δ, the upper bound of the edge length, equation (2) of Lachaud & Montanvert.
    #[inline]
    pub fn longest(self) -> f32 {
        LONGEST * self.delta
    }

    /// Returns 2.5/√3 δ, the distance below which two non-adjacent vertices are in contact, equation (3) of Lachaud &
    /// Montanvert.
    #[inline]
    pub fn contact(self) -> f32 {
        CONTACT * self.delta
    }

    /// Returns δ³, the volume below which a small closed component is removed.
    #[inline]
    pub fn smallest_volume(self) -> f32 {
        self.delta * self.delta * self.delta
    }

    /// Returns the volume below which the small closed component of a vertex is removed: δ³, or that of the local δ if it
    /// is so short that the component is meant to be small.
    pub(super) fn smallest_volume_at(self, mesh: &Mesh, v: VertexId) -> f32 {
        let size = self.sizes.map_or(0.0, |sizes| mesh.scalar(sizes)[v.index()]);
        if size < MEANT_SMALL {
            Self::new(self.delta * (1.0 + size)).smallest_volume()
        } else {
            self.smallest_volume()
        }
    }
}
