//! Smoothing within the voxels: the positions of cells move towards those of their neighbours, as far as their own cell
//! reaches, so that every voxel stays on its side of every surface.
//!
//! This alone would make what is convex shrink; [`super::balance`] gives the volume back every few iterations.

use super::zone::{NONE, Zone, step_to, within_reach};
use crate::math::Vec3;

/// Fraction of the way to the mean of the neighbours that a position moves in one iteration.
const FRACTION: f32 = 0.5;

impl Zone {
    /// Runs one iteration; returns the root mean square of the displacements, in voxels.
    pub fn smooth(&mut self) -> f64 {
        let moved: Vec<Vec3> = (0..self.moving())
            .map(|i| within_reach(self.offsets[i] + (self.mean(i) - self.offsets[i]) * FRACTION))
            .collect();
        let squares = moved.iter().zip(&self.offsets).map(|(a, b)| f64::from(a.distance_squared(*b)));
        let residual = (squares.sum::<f64>() / moved.len().max(1) as f64).sqrt();
        self.offsets[..moved.len()].copy_from_slice(&moved);
        residual
    }

    /// Returns the mean position of the neighbours of a cell, relative to its centre.
    fn mean(&self, i: usize) -> Vec3 {
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for (face, &neighbour) in self.towards[i].iter().enumerate() {
            if neighbour != NONE {
                sum += self.offsets[neighbour as usize] + step_to(face);
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { self.offsets[i] }
    }
}
