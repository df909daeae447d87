//! Global orientation of normals by the winding number that they define, which is 1 inside, 0 outside and ½ at the surface,
//! and falls along the normal (Lin, Shi & Liu, *Fast and globally consistent normal orientation based on the winding number
//! normal consistency*, 2024).

use crate::math::Vec3;
use std::f32::consts::PI;
use wide::f32x4;

/// The winding number of a surface that is known at some positions: a sum over vectors, the normals there, each as long as
/// the area that it stands for.
#[derive(Clone, Debug)]
pub struct Winding {
    positions: Vec<Vec3>,
    vectors: Vec<Vec3>,
    fours: Fours,
    /// The square of the length below which distances are smoothed.
    smoothing: f32,
}

impl Winding {
    /// Creates that of a surface with `vectors` at `positions`; distances are smoothed below `width`.
    pub fn new(positions: &[Vec3], vectors: Vec<Vec3>, width: f32) -> Self {
        let fours = Fours { positions: in_fours(positions), vectors: in_fours(&vectors) };
        Self { positions: positions.to_vec(), vectors, fours, smoothing: width * width }
    }

    /// Makes the vectors more consistent: a step of steepest descent of the squared differences of the winding number from
    /// ½, after which each vector is turned along the negative gradient of the winding number. Takes time in proportion to
    /// the square of the number of positions.
    ///
    /// From vectors of 0, the first step lets each point away from the positions around it: outwards, also where walls are
    /// thin or thin parts are near each other, and propagation from neighbour to neighbour goes wrong.
    pub fn improve(&mut self) {
        let (values, gradients) = self.fours.winding_numbers(&self.positions, self.smoothing);
        let errors: Vec<f32> = values.iter().map(|value| 0.5 - value).collect();
        let direction = self.transposed(&errors);
        let along = Fours { positions: self.fours.positions.clone(), vectors: in_fours(&direction) };
        let (changes, turns) = along.winding_numbers(&self.positions, self.smoothing);
        let squared: f32 = changes.iter().map(|change| change * change).sum();
        if squared > 0.0 {
            let step = direction.iter().map(|d| d.length_squared()).sum::<f32>() / squared;
            let gradients = gradients.iter().zip(turns).map(|(&before, turn)| before + turn * step);
            let vectors = self.vectors.iter().zip(direction).map(|(&before, d)| before + d * step);
            let turned = vectors.zip(gradients).map(|(v, gradient)| self.turned(v, gradient)).collect();
            self.vectors = turned;
            self.fours.vectors = in_fours(&self.vectors);
        }
    }

    /// Turns the vector of a position along the negative gradient of the winding number there, without the term of the
    /// vector itself, which points along it, whichever its side.
    fn turned(&self, v: Vec3, gradient: Vec3) -> Vec3 {
        let others = gradient - v / (self.smoothing * self.smoothing.sqrt());
        others.normalize_or_zero() * v.length()
    }

    /// Returns the winding number at `x`.
    pub fn at(&self, x: Vec3) -> f32 {
        self.fours.winding_number(x, self.smoothing).0
    }

    /// Returns the vector at each position.
    pub fn vectors(&self) -> &[Vec3] {
        &self.vectors
    }

    /// Returns the product of `values` at the positions with the transposed matrix of the winding numbers there.
    fn transposed(&self, values: &[f32]) -> Vec<Vec3> {
        let smoothing = f32x4::splat(self.smoothing);
        let values: Vec<f32x4> = values.chunks(4).map(|some| four_of(|k| some.get(k).copied())).collect();
        let at = |x: &Vec3| {
            let (x, mut sum) = (x.to_array().map(f32x4::splat), [f32x4::ZERO; 3]);
            for (&p, &value) in self.fours.positions.iter().zip(&values) {
                let offset = difference(x, p);
                let inverse = f32x4::ONE / (dot(offset, offset) + smoothing);
                add(&mut sum, offset, inverse * inverse.sqrt() * value);
            }
            total(sum) / (4.0 * PI)
        };
        self.positions.iter().map(at).collect()
    }
}

/// Four vectors.
type Four = [f32x4; 3];

/// Positions with vectors in fours, for sums over four at a time; the last one is filled up with zeros.
#[derive(Clone, Debug)]
struct Fours {
    positions: Vec<Four>,
    vectors: Vec<Four>,
}

impl Fours {
    /// Returns the winding number at positions, and its negative gradients, times 4π.
    fn winding_numbers(&self, at: &[Vec3], smoothing: f32) -> (Vec<f32>, Vec<Vec3>) {
        at.iter().map(|&x| self.winding_number(x, smoothing)).unzip()
    }

    #[inline]
    fn winding_number(&self, x: Vec3, smoothing: f32) -> (f32, Vec3) {
        let (x, smoothing) = (x.to_array().map(f32x4::splat), f32x4::splat(smoothing));
        let (mut value, mut gradient) = (f32x4::ZERO, [f32x4::ZERO; 3]);
        for (&p, &v) in self.positions.iter().zip(&self.vectors) {
            let offset = difference(p, x);
            let inverse = f32x4::ONE / (dot(offset, offset) + smoothing);
            let weight = inverse * inverse.sqrt();
            let term = dot(v, offset) * weight;
            value += term;
            add(&mut gradient, v, weight);
            add(&mut gradient, offset, f32x4::splat(-3.0) * term * inverse);
        }
        (value.reduce_add() / (4.0 * PI), total(gradient))
    }
}

fn in_fours(vectors: &[Vec3]) -> Vec<Four> {
    let four = |some: &[Vec3]| [0, 1, 2].map(|axis| four_of(|k| some.get(k).map(|v| v[axis])));
    vectors.chunks(4).map(four).collect()
}

fn four_of(get: impl Fn(usize) -> Option<f32>) -> f32x4 {
    f32x4::new(std::array::from_fn(|k| get(k).unwrap_or(0.0)))
}

#[inline]
fn difference(a: Four, b: Four) -> Four {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn dot(a: Four, b: Four) -> f32x4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn add(sum: &mut Four, v: Four, factor: f32x4) {
    sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += v * factor);
}

/// Returns the sum of four vectors.
fn total(v: Four) -> Vec3 {
    Vec3::from_array(v.map(|lanes| lanes.reduce_add()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::implicit::cloud::tests::on_ball;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn the_winding_number_of_a_ball() {
        let positions = on_ball(301);
        let area = 4.0 * PI / 301.0;
        let winding = Winding::new(&positions, positions.iter().map(|p| *p * area).collect(), 0.05);
        for (x, expected) in [(0.0, 1.0), (0.7, 1.0), (1.4, 0.0), (5.0, 0.0)] {
            let found = winding.at(Vec3::X * x);
            assert!((found - expected).abs() < 0.1, "{x}: {found}");
        }
    }

    /// From vectors of 0, and from wrong ones.
    #[test]
    fn vectors_come_to_point_outwards() {
        let positions = on_ball(301);
        for sides in [[0.0, 0.0, 0.0], [1.0, 1.0, -1.0]] {
            let wrong = positions.iter().zip(0..).map(|(&p, i)| p * (0.04 * sides[i % 3])).collect();
            let mut winding = Winding::new(&positions, wrong, 0.1);
            for _ in 0..10 {
                winding.improve();
            }
            let outwards = winding.vectors().iter().zip(&positions).filter(|(v, p)| v.dot(**p) > 0.0);
            assert_eq!(outwards.count(), 301);
        }
    }

    #[test]
    fn vectors_come_to_point_into_a_cavity() {
        for radius in [0.3_f32, 0.8] {
            let inner = on_ball((600.0 * radius * radius) as usize);
            let positions: Vec<Vec3> =
                on_ball(600).into_iter().chain(inner.iter().map(|&p| p * radius)).collect();
            let mut winding = Winding::new(&positions, vec![Vec3::ZERO; positions.len()], 0.08);
            for _ in 0..10 {
                winding.improve();
            }
            let mut sides = winding.vectors().iter().zip(&positions).map(|(v, p)| v.dot(*p));
            assert!(sides.by_ref().take(600).all(|side| side > 0.0), "{radius}");
            assert!(sides.all(|side| side < 0.0), "{radius}");
        }
    }
}
