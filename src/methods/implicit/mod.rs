//! Implicit surface from points: volumetric regularization.
//!
//! Dinh, Turk & Slabaugh, *Reconstructing surfaces by volumetric regularization using radial basis functions*.

pub mod camera;
pub mod color;
