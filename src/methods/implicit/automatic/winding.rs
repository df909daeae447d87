//! Global orientation of normals: they are made consistent with the winding number that they define, which is 1 inside, 0
//! outside and ½ at the surface, and falls along the normal (Lin, Shi & Liu, *Fast and globally consistent normal
//! orientation based on the winding number normal consistency*, 2024).

use crate::math::order::{sort_by_rank, sort_distinct};
use crate::math::{DVec3, Vec3};
use std::f64::consts::PI;

/// Largest number of parts that are flipped.
const MOST_PARTS: usize = 64;

/// The winding number of a surface that is known at some positions: a sum over vectors, the normals there, each as long as
/// the area that it stands for.
#[derive(Clone, Debug)]
pub struct Winding {
    positions: Vec<DVec3>,
    vectors: Vec<DVec3>,
    /// The square of the length below which distances are smoothed.
    smoothing: f64,
}

impl Winding {
    /// Creates that of a surface with unit `normals`, which stand for `area` each; distances are smoothed below `width`.
    pub fn new(positions: &[Vec3], normals: impl Iterator<Item = Vec3>, area: f64, width: f64) -> Self {
        Self {
            positions: positions.iter().map(|p| p.as_dvec3()).collect(),
            vectors: normals.map(|n| n.as_dvec3() * area).collect(),
            smoothing: width * width,
        }
    }

    /// Makes the vectors more consistent: a step of steepest descent of the squared differences of the winding number from
    /// ½, after which each vector is turned along the negative gradient of the winding number. Distances are smoothed below `width`. Takes
    /// time in proportion to the square of the number of positions.
    pub fn improve(&mut self, width: f64) {
        self.smoothing = width * width;
        let errors: Vec<f64> =
            self.positions.iter().map(|&x| 0.5 - self.sum(x, self.with(&self.vectors))).collect();
        let direction: Vec<DVec3> = self.positions.iter().map(|&x| self.transposed(x, &errors)).collect();
        let change: Vec<f64> = self.positions.iter().map(|&x| self.sum(x, self.with(&direction))).collect();
        let squared: f64 = change.iter().map(|c| c * c).sum();
        if squared > 0.0 {
            let step = direction.iter().map(|d| d.length_squared()).sum::<f64>() / squared;
            self.vectors.iter_mut().zip(&direction).for_each(|(v, d)| *v += *d * step);
        }
        let outwards: Vec<DVec3> = self.positions.iter().map(|&x| self.negative_gradient(x)).collect();
        self.vectors.iter_mut().zip(outwards).for_each(|(v, n)| *v = n.normalize_or_zero() * v.length());
    }

    /// Flips all vectors of one of `parts`, given as indices of the positions, as long as that brings the winding number at
    /// all positions nearer to ½. Within a part, vectors are consistent already; those of a cavity have to point into it.
    pub fn flip_parts(&mut self, parts: &[Vec<u32>]) {
        if parts.is_empty() {
            return;
        }
        let mut by_size: Vec<&Vec<u32>> = parts.iter().collect();
        sort_by_rank(&mut by_size, |part| u64::MAX - part.len() as u64);
        let mut largest: Vec<Vec<u32>> = by_size.into_iter().take(MOST_PARTS).cloned().collect();
        largest.iter_mut().for_each(sort_distinct);
        let of_part = |part: &Vec<u32>| -> Vec<f64> {
            let own = || part.iter().map(|&i| (self.positions[i as usize], self.vectors[i as usize]));
            self.positions.iter().map(|&x| self.sum(x, own())).collect()
        };
        let mut found: Vec<Vec<f64>> = largest.iter().map(of_part).collect();
        let mut errors: Vec<f64> =
            self.positions.iter().map(|&x| self.sum(x, self.with(&self.vectors)) - 0.5).collect();
        for _ in 0..MOST_PARTS {
            // The change of the sum of squared errors by a flip of a part.
            let change = |own: &Vec<f64>| {
                4.0 * errors.iter().zip(own).map(|(error, own)| own * (own - error)).sum::<f64>()
            };
            let changes: Vec<f64> = found.iter().map(change).collect();
            let best =
                (0..changes.len()).fold(0, |best, k| if changes[k] < changes[best] { k } else { best });
            if changes.get(best).is_none_or(|&change| change >= 0.0) {
                break;
            }
            errors.iter_mut().zip(&mut found[best]).for_each(|(error, own)| {
                *error -= 2.0 * *own;
                *own = -*own;
            });
            largest[best].iter().for_each(|&i| self.vectors[i as usize] = -self.vectors[i as usize]);
        }
    }

    /// Returns the winding number at `x`.
    pub fn at(&self, x: Vec3) -> f64 {
        self.sum(x.as_dvec3(), self.with(&self.vectors))
    }

    /// Returns the vector at each position.
    pub fn vectors(&self) -> &[DVec3] {
        &self.vectors
    }

    /// Returns the positions with other vectors.
    fn with<'a>(&'a self, vectors: &'a [DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> + 'a {
        self.positions.iter().copied().zip(vectors.iter().copied())
    }

    /// Returns the winding number at `x` that some positions with their vectors define.
    fn sum(&self, x: DVec3, some: impl Iterator<Item = (DVec3, DVec3)>) -> f64 {
        some.map(|(p, v)| v.dot(self.influence(p - x))).sum::<f64>() / (4.0 * PI)
    }

    /// Returns, of the product of `values` at the positions with the transposed matrix of [`Self::sum`], the entry at `x`.
    fn transposed(&self, x: DVec3, values: &[f64]) -> DVec3 {
        let terms = self.positions.iter().zip(values).map(|(p, &value)| self.influence(x - *p) * value);
        terms.sum::<DVec3>() / (4.0 * PI)
    }

    fn influence(&self, offset: DVec3) -> DVec3 {
        let squared = offset.length_squared() + self.smoothing;
        offset / (squared * squared.sqrt())
    }

    /// Returns the negative gradient of the winding number at a position, times 4π, without the term of the vector there,
    /// which points along itself, whichever its side.
    fn negative_gradient(&self, x: DVec3) -> DVec3 {
        let others = self.positions.iter().zip(&self.vectors).filter(|&(p, _)| *p != x);
        let terms = others.map(|(p, v)| {
            let offset = *p - x;
            let squared = offset.length_squared() + self.smoothing;
            (*v - offset * (3.0 * v.dot(offset) / squared)) / (squared * squared.sqrt())
        });
        terms.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::implicit::cloud::tests::on_ball;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn normals_become_consistent_and_the_winding_number_that_of_a_ball() {
        let positions = on_ball(300);
        let wrong = positions.iter().zip(0..).map(|(&p, i)| p * [1.0, 1.0, -1.0][i % 3]);
        let area = 4.0 * PI / 300.0;
        let mut winding = Winding::new(&positions, wrong, area, 0.2);
        for _ in 0..15 {
            winding.improve(0.2);
        }
        let outwards = winding.vectors().iter().zip(&positions).filter(|(v, p)| v.dot(p.as_dvec3()) > 0.0);
        assert_eq!(outwards.count(), 300);
        let exact = Winding::new(&positions, positions.iter().copied(), area, 0.05);
        for (x, expected) in [(0.0, 1.0), (0.7, 1.0), (1.4, 0.0), (5.0, 0.0)] {
            for (winding, error) in [(&winding, 0.25), (&exact, 0.1)] {
                let found = winding.at(Vec3::X * x);
                assert!((found - expected).abs() < error, "{x}: {found}");
            }
        }
    }

    #[test]
    fn parts_are_flipped_to_what_they_bound() {
        let sphere = |count: usize, radius: f32| {
            let area = 4.0 * PI * f64::from(radius * radius) / count as f64;
            on_ball(count).into_iter().map(move |n| ((n * radius).as_dvec3(), n.as_dvec3() * area))
        };
        let (positions, vectors) = sphere(300, 1.0).chain(sphere(100, 0.5)).unzip();
        let mut winding = Winding { positions, vectors, smoothing: 0.01 };
        // Both outwards: the inner one bounds a ball in the ball, not a cavity.
        winding.flip_parts(&[(300..400).collect(), (0..300).collect()]);
        for (x, expected) in [(0.0, 0.0), (0.75, 1.0), (2.0, 0.0)] {
            let found = winding.at(Vec3::X * x);
            assert!((found - expected).abs() < 0.2, "{x}: {found}");
        }
    }
}
