//! Points on shapes with known signed distance functions.

use super::Random;
use vesicle::math::{DVec3, Vec3};

/// A solid as a function that is its signed distance near the surface, negative inside. All shapes fit a box of side 2.
pub type Shape = fn(DVec3) -> f64;

pub fn sphere(p: DVec3) -> f64 {
    p.length() - 1.0
}

pub fn torus(p: DVec3) -> f64 {
    let ring = (p.x * p.x + p.y * p.y).sqrt() - 0.7;
    (ring * ring + p.z * p.z).sqrt() - 0.3
}

/// A torus blended with two balls: genus 1.
pub fn blend(p: DVec3) -> f64 {
    let ring = {
        let across = (p.x * p.x + p.y * p.y).sqrt() - 0.62;
        (across * across + p.z * p.z).sqrt() - 0.18
    };
    let first = p.distance(DVec3::new(0.62, 0.0, 0.0)) - 0.36;
    let second = p.distance(DVec3::new(-0.44, 0.44, 0.1)) - 0.32;
    merged(merged(ring, first), second)
}

/// Two disjoint balls of different size.
pub fn pair(p: DVec3) -> f64 {
    let (near, far) =
        (p.distance(DVec3::new(-0.5, 0.0, 0.0)) - 0.5, p.distance(DVec3::new(0.65, 0.2, 0.0)) - 0.35);
    if near < far { near } else { far }
}

/// Returns the union of two solids, blended where they meet.
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

/// Returns the signed distance from `p` to the surface, accurate to second order.
pub fn distance(shape: Shape, p: DVec3) -> f64 {
    shape(p) / gradient(shape, p).length()
}

/// Returns a random number from the standard normal distribution.
pub fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - f64::from(random.unit()))).sqrt();
    radius * libm::cos(std::f64::consts::TAU * f64::from(random.unit()))
}

pub fn direction(random: &mut Random) -> DVec3 {
    let all = [normal(random), normal(random), normal(random)];
    DVec3::from_array(all).normalize_or(DVec3::X)
}

/// Returns uniformly distributed points of a surface, and the outward normals there.
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

/// Returns points of a surface, displaced by Gaussian noise of the given standard deviation along each axis.
pub fn noisy(shape: Shape, count: usize, noise: f64, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    let (points, _) = surface_points(shape, count, &mut random);
    let mut moved = |p: DVec3| {
        let noise_at = DVec3::new(normal(&mut random), normal(&mut random), normal(&mut random));
        (p + noise_at * noise).as_vec3()
    };
    points.into_iter().map(&mut moved).collect()
}
