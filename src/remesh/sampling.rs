//! The invariant δ and the three bounds derived from it (section 3.2).

/// How densely a mesh is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    delta: f32,
}

/// Upper bound of an edge in δ, equation (2): above 2, so that halves of a split edge respect the lower bound.
const LONGEST: f32 = 2.5;

/// Contact distance in δ, 2.5/√3, equation (3): the longest distance between a vertex that goes through a triangle and
/// the nearest corner of that triangle.
const CONTACT: f32 = 1.443_375_7;

impl Sampling {
    /// The bounds that belong to δ, a positive length.
    pub fn new(delta: f32) -> Self {
        Self { delta }
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

    /// 2.5/√3 δ, the distance below which two vertices that are no neighbours touch (3).
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
