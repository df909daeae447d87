//! Smoothing within the voxels: the positions of cells move towards those of their neighbours, as far as their own cell
//! reaches, so that every voxel stays on its side of every surface.
//!
//! Each iteration moves the positions towards the mean of their neighbours, then by a little more away from it (Taubin,
//! "A signal processing approach to fair surface design", 1995), which smooths steps without shrinking what is larger.

use super::zone::{NONE, Zone, step_to, within_reach};
use crate::math::Vec3;

/// Fraction of the way to the mean of the neighbours, in the first and in the second half of an iteration.
const STEPS: [f32; 2] = [0.5, -0.52];

impl Zone {
    /// Runs one iteration; returns the root mean square of the displacements, in voxels.
    pub fn smooth(&mut self) -> f64 {
        let moving = self.moving();
        let before = self.offsets[..moving].to_vec();
        let mut moved = Vec::with_capacity(moving);
        for fraction in STEPS {
            moved.clear();
            moved.extend((0..moving).map(|i| {
                let offset = self.offsets[i];
                within_reach(offset + (self.mean(i) - offset) * fraction)
            }));
            self.offsets[..moving].copy_from_slice(&moved);
        }
        let squares = before.iter().zip(&moved).map(|(a, b)| f64::from(a.distance_squared(*b)));
        (squares.sum::<f64>() / moving.max(1) as f64).sqrt()
    }

    /// Returns the mean position of the neighbours of a cell, relative to its centre.
    fn mean(&self, i: usize) -> Vec3 {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for (face, &neighbour) in self.links[i].towards.iter().enumerate() {
            if neighbour != NONE {
                sum += self.offsets[neighbour as usize] + step_to(face);
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { self.offsets[i] }
    }
}
