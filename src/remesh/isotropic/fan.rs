//! The distance of a vertex from the triangles that replace its one-ring after a move or collapse, by which remeshing
//! limits its deviation from the input surface.

use crate::math::{Vec3, triangle};
use smallvec::SmallVec;

/// The squared cosine of the largest angle to the mean normal at which the triangles of a fan count as flat. They then
/// cover the old ones, and the largest distance of `from` from their planes is at least its distance from the
/// triangles.
const FLAT: f32 = 0.5;

/// The triangles around `to` that replace those around `from` when a vertex is moved or collapsed, for measuring the
/// distance of `from` from them.
pub(super) struct Fan {
    from: Vec3,
    to: Vec3,
    /// The two corners of each triangle other than `to`, and its normal, whose length is twice the area.
    sides: SmallVec<[(Vec3, Vec3, Vec3); 12]>,
    sum: Vec3,
}

impl Fan {
    pub fn new(from: Vec3, to: Vec3) -> Self {
        Self { from, to, sides: SmallVec::new(), sum: Vec3::ZERO }
    }

    /// Adds the triangle of the fan's centre `to` with `a` and `b`, for [`Self::gap`]; returns its normal, whose length
    /// is twice the area, by which callers detect triangles that turn over.
    pub fn push(&mut self, a: Vec3, b: Vec3) -> Vec3 {
        let normal = (a - self.to).cross(b - self.to);
        self.sides.push((a, b, normal));
        self.sum += normal;
        normal
    }

    /// Returns the distance of `from` from the triangles, or an upper bound of it if they are nearly flat.
    pub fn gap(&self) -> f32 {
        let (sum, squared) = (self.sum, self.sum.length_squared());
        let mut most = 0.0;
        for &(_, _, normal) in &self.sides {
            let (cosine, size) = (normal.dot(sum), normal.length_squared());
            if cosine <= 0.0 || cosine * cosine < FLAT * size * squared {
                return self.exact_gap();
            }
            let height = normal.dot(self.from - self.to);
            let square = height * height / size;
            most = if square > most { square } else { most };
        }
        most.sqrt()
    }

    fn exact_gap(&self) -> f32 {
        let distance = |&(a, b, _): &(Vec3, Vec3, Vec3)| {
            let corners = [self.to, a, b];
            triangle::point_at(corners, triangle::closest_barycentric(corners, self.from))
                .distance_squared(self.from.as_dvec3())
        };
        self.sides.iter().map(distance).fold(f64::INFINITY, f64::min).sqrt() as f32
    }
}
