//! Points on shapes whose distance is known.

use crate::common::Random;
use vesicle::math::{DVec3, Vec3};

/// A body by a function that is its distance near the surface, negative inside. All fit a box of side 2.
pub type Shape = fn(DVec3) -> f64;

pub fn sphere(p: DVec3) -> f64 {
    p.length() - 1.0
}

pub fn torus(p: DVec3) -> f64 {
    let ring = (p.x * p.x + p.y * p.y).sqrt() - 0.7;
    (ring * ring + p.z * p.z).sqrt() - 0.3
}

/// A ring with two balls grown into it: genus 1.
pub fn blend(p: DVec3) -> f64 {
    let ring = {
        let across = (p.x * p.x + p.y * p.y).sqrt() - 0.62;
        (across * across + p.z * p.z).sqrt() - 0.18
    };
    let first = p.distance(DVec3::new(0.62, 0.0, 0.0)) - 0.36;
    let second = p.distance(DVec3::new(-0.44, 0.44, 0.1)) - 0.32;
    merged(merged(ring, first), second)
}

/// Two balls of different size, apart.
pub fn pair(p: DVec3) -> f64 {
    let (near, far) =
        (p.distance(DVec3::new(-0.5, 0.0, 0.0)) - 0.5, p.distance(DVec3::new(0.65, 0.2, 0.0)) - 0.35);
    if near < far { near } else { far }
}

/// The union of two bodies, rounded where they meet.
fn merged(a: f64, b: f64) -> f64 {
    let width = 0.15;
    let overlap = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - overlap * overlap * width * 0.25
}

pub fn gradient(shape: Shape, p: DVec3) -> DVec3 {
    let h = 1e-5;
    let along = |d: DVec3| (shape(p + d * h) - shape(p - d * h)) / (2.0 * h);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

/// Distance from `p` to the surface, signed; right to second order.
pub fn distance(shape: Shape, p: DVec3) -> f64 {
    shape(p) / gradient(shape, p).length()
}

/// A number of normal distribution.
pub fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - f64::from(random.unit()))).sqrt();
    radius * libm::cos(std::f64::consts::TAU * f64::from(random.unit()))
}

pub fn direction(random: &mut Random) -> DVec3 {
    let all = [normal(random), normal(random), normal(random)];
    DVec3::from_array(all).normalize_or(DVec3::X)
}

/// Points spread evenly over a surface, and the outward normals there.
pub fn surface_points(shape: Shape, count: usize, random: &mut Random) -> (Vec<DVec3>, Vec<DVec3>) {
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    while points.len() < count {
        let mut p = DVec3::from([0; 3].map(|_| random.within(-1.05, 1.05)));
        if shape(p).abs() > 0.03 {
            continue;
        }
        for _ in 0..4 {
            let slope = gradient(shape, p);
            p -= slope * (shape(p) / slope.length_squared());
        }
        points.push(p);
        normals.push(gradient(shape, p).normalize());
    }
    (points, normals)
}

/// Points of a surface, displaced by noise of a standard deviation.
pub fn noisy(shape: Shape, count: usize, noise: f64, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    let (points, _) = surface_points(shape, count, &mut random);
    let mut moved = |p: DVec3| {
        let noise_at = DVec3::new(normal(&mut random), normal(&mut random), normal(&mut random));
        (p + noise_at * noise).as_vec3()
    };
    points.into_iter().map(&mut moved).collect()
}
