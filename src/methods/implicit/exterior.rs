//! Where the function has to be negative (paper, section VI-A).

use super::camera::Camera;
use super::cloud::Cloud;
use super::normals::{Normals, estimated_normals};
use super::sampling::subsampled;
use crate::math::{Bounds, DVec3, Vec3};
use crate::spatial::PointGrid;

/// Exterior constraints on the sphere around everything, always.
const ON_SPHERE: usize = 16;
/// Radius of that sphere, in half diagonals of the points' bounds: near enough to hold the surface in, and outside of it
/// where it bulges between points.
const SPHERE: f64 = 1.2;
/// Surface points for one of the others.
const SURFACE_POINTS: usize = 10;
/// The least number of the others, where points are few.
const LEAST: usize = 30;
/// Distance of the others from the surface, in mean spacings of the points. At 1 they bind less than noise, at 6 they fall
/// into hollows.
const OFFSET: f32 = 3.0;
/// The same, in standard deviations of the noise.
const NOISE: f32 = 4.0;
/// The least such distance, in units of the box: dense clouds are not less noisy.
const LEAST_OFFSET: f32 = 0.04;
/// One that is nearer to another point of the surface than this share of its own distance may be inside.
const CLEAR: f32 = 0.8;

/// The points outside; all in units of the box.
#[derive(Clone, Debug)]
pub struct Exterior {
    /// Given, or made from the points.
    pub near: Vec<Vec3>,
    /// How far from the surface they were made; 0 for given ones.
    pub offset: f32,
    /// On the sphere around everything.
    pub around: Vec<Vec3>,
}

impl Exterior {
    /// Those of [`Self::near`] that go with points added to and removed from the `surface` that they were made for: not too
    /// near to one added, and with a point left that they may have been made from. Given ones all do.
    pub fn beside<'a>(&'a self, surface: &'a [Vec3], added: &'a [Vec3]) -> impl Iterator<Item = Vec3> + 'a {
        let cell = if self.offset > 0.0 { self.offset } else { 1.0 };
        let [surface, added] = [surface, added].map(|points| PointGrid::of(points, cell));
        self.near.iter().copied().filter(move |&p| {
            self.offset == 0.0
                || surface.has_within(p, LOST * self.offset) && !added.has_within(p, CLEAR * self.offset)
        })
    }
}

/// One that is farther than so many offsets from all points of the surface has lost those that it was made from.
const LOST: f32 = 1.25;

/// Points given as outside, with those on the sphere.
pub fn given_exterior(cloud: &Cloud, given: Vec<Vec3>) -> Exterior {
    Exterior { near: given, offset: 0.0, around: sphere_around(&cloud.points) }
}

/// The points outside, for surface points of mean distance `spacing`.
///
/// Towards each camera that sees the point; where no cameras are given, along the normals, given or estimated.
/// Thinned by Poisson-disc sampling to one for ten surface points. Then those on the sphere.
pub fn made_exterior(cloud: &Cloud, cameras: &[Camera], spacing: f32, seed: u64) -> Exterior {
    let wanted = (cloud.len() / SURFACE_POINTS).max(LEAST);
    // A few more places than points wanted, as some will be refused.
    let places = wanted + wanted / 4;
    let ways = ways_out(cloud, cameras, places, spacing, seed);
    let offset = [OFFSET * spacing, NOISE * ways.noise, LEAST_OFFSET].into_iter().fold(0.0, f32::max);
    let surface = PointGrid::of(&cloud.points, offset);
    let candidates = ways.directions.iter().map(|&(i, way)| cloud.points[i as usize] + way * offset);
    let outside: Vec<Vec3> = candidates.filter(|&p| !surface.has_within(p, CLEAR * offset)).collect();
    let kept = subsampled(&outside, wanted, seed).into_iter().map(|i| outside[i as usize]);
    Exterior { near: kept.collect(), offset, around: sphere_around(&cloud.points) }
}

/// Directions that lead outwards.
struct Ways {
    /// Points with a direction each; a point may have several, or none.
    directions: Vec<(u32, Vec3)>,
    noise: f32,
}

/// From at most so many places.
fn ways_out(cloud: &Cloud, cameras: &[Camera], places: usize, spacing: f32, seed: u64) -> Ways {
    let (oriented, normals) = match &cloud.normals {
        Some(given) => {
            let at = subsampled(&cloud.points, places, seed);
            let directions = at.iter().map(|&i| given[i as usize].normalize_or_zero()).collect();
            (at, Normals { directions, noise: 0.0 })
        }
        None => {
            let at = subsampled(&cloud.points, if places > ORIENTED { places } else { ORIENTED }, seed);
            let normals = estimated_normals(&cloud.points, &at, spacing);
            (at, normals)
        }
    };
    let points: Vec<Vec3> = oriented.iter().map(|&i| cloud.points[i as usize]).collect();
    let chosen = subsampled(&points, places, seed).into_iter().map(|k| k as usize);
    let with_normals = chosen.map(|k| (oriented[k], normals.directions[k]));
    let directions = if cameras.is_empty() {
        with_normals.collect()
    } else {
        towards_cameras(&cloud.points, cameras, with_normals, spacing)
    };
    Ways { directions, noise: normals.noise }
}

/// Places whose normals are estimated, at least: with fewer, neighbours on thin things are on different sides.
const ORIENTED: usize = 3000;

/// The way from each place to each camera on the outer side of its normal from which nothing hides it.
///
/// The normal has a say, too, since rays slip through gaps in the far side of a thing.
fn towards_cameras(
    points: &[Vec3],
    cameras: &[Camera],
    places: impl Iterator<Item = (u32, Vec3)>,
    spacing: f32,
) -> Vec<(u32, Vec3)> {
    let voxels = Voxels::new(points, VOXEL * spacing);
    let centres: Vec<Vec3> = cameras.iter().map(|camera| camera.centre().as_vec3()).collect();
    let mut ways = Vec::new();
    for (i, normal) in places {
        let p = points[i as usize];
        let all = centres.iter().map(|&centre| (centre, (centre - p).normalize_or_zero()));
        let seen = all.filter(|&(centre, way)| way.dot(normal) > GRAZING && voxels.is_free(p, centre));
        ways.extend(seen.map(|(_, way)| (i, way)));
    }
    ways
}

/// Cosine between normal and way to a camera below which the camera sees the point too flat to tell.
const GRAZING: f32 = 0.2;

/// Points spread evenly on a sphere around the bounds of `points`, on a spiral.
fn sphere_around(points: &[Vec3]) -> Vec<Vec3> {
    let bounds = Bounds::of(points);
    let [min, max] = [bounds.min, bounds.max].map(|corner| corner.as_dvec3());
    let radius = 0.5 * SPHERE * max.distance(min);
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let place = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / ON_SPHERE as f64;
        let (across, angle) = ((1.0 - z * z).sqrt(), golden * i as f64);
        let unit = DVec3::new(across * libm::cos(angle), across * libm::sin(angle), z);
        (0.5 * (min + max) + unit * radius).as_vec3()
    };
    (0..ON_SPHERE).map(place).collect()
}

/// Edge of a voxel in mean spacings: with 1.5 rays pass through the gaps of stereo data, with 6 legs grow together.
const VOXEL: f32 = 3.5;
/// Voxels of a ray that belong to the neighbourhood of its own point.
const OWN: f32 = 1.5;
/// Voxels along a side at most.
const MOST_VOXELS: f32 = 256.0;

/// Which cells hold points.
struct Voxels {
    origin: Vec3,
    edge: f32,
    dims: [usize; 3],
    occupied: Vec<bool>,
}

impl Voxels {
    fn new(points: &[Vec3], edge: f32) -> Self {
        let bounds = Bounds::of(points);
        let size = bounds.max - bounds.min;
        let least = size.max_element() / MOST_VOXELS;
        let edge = if edge > least { edge } else { least };
        let dims = size.to_array().map(|side| (side / edge) as usize + 1);
        let mut voxels =
            Self { origin: bounds.min, edge, dims, occupied: vec![false; dims.iter().product()] };
        for &p in points {
            if let Some(at) = voxels.index(p) {
                voxels.occupied[at] = true;
            }
        }
        voxels
    }

    fn index(&self, p: Vec3) -> Option<usize> {
        let [x, y, z] = ((p - self.origin) / self.edge).floor().to_array();
        let inside = x >= 0.0 && y >= 0.0 && z >= 0.0;
        let [x, y, z] = [x, y, z].map(|k| k as usize);
        (inside && x < self.dims[0] && y < self.dims[1] && z < self.dims[2])
            .then(|| (z * self.dims[1] + y) * self.dims[0] + x)
    }

    /// Whether no voxel with points is on the way from `p` to `camera`, beyond the neighbourhood of `p`.
    fn is_free(&self, p: Vec3, camera: Vec3) -> bool {
        let length = p.distance(camera);
        let step = (camera - p) / length * (0.5 * self.edge);
        let mut at = p + step * (2.0 * OWN);
        let steps = 2.0 * (length / self.edge - OWN);
        let most = 4.0 * MOST_VOXELS;
        for _ in 0..(if steps < most { steps } else { most }) as usize {
            if self.index(at).is_some_and(|i| self.occupied[i]) {
                return false;
            }
            at += step;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::methods::implicit::cloud::mean_spacing;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn torus(count: usize) -> Cloud {
        let mut random = Random::new(12);
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        while points.len() < count {
            let (a, b) = (std::f64::consts::TAU * random.unit(), std::f64::consts::TAU * random.unit());
            let out = DVec3::new(libm::cos(a), libm::sin(a), 0.0);
            if 0.3 * libm::cos(b) + 0.7 > random.unit() {
                let n = out * libm::cos(b) + DVec3::Z * libm::sin(b);
                points.push((out * 0.7 + n * 0.3).as_vec3());
                normals.push(n.as_vec3());
            }
        }
        Cloud { points, normals: Some(normals), ..Cloud::default() }
    }

    fn distance(p: Vec3) -> f32 {
        let ring = (p.x * p.x + p.y * p.y).sqrt() - 0.7;
        (ring * ring + p.z * p.z).sqrt() - 0.3
    }

    /// Looks at the origin from `from`, which is not on the y axis.
    fn camera(from: DVec3) -> Camera {
        let ahead = -from.normalize();
        let right = ahead.cross(DVec3::Y).normalize();
        let rows = [right * 50.0 + ahead * 50.0, ahead.cross(right) * 50.0 + ahead * 50.0, ahead];
        let row = |r: DVec3| [r.x, r.y, r.z, -r.dot(from)];
        Camera::new(rows.map(row).concat().try_into().unwrap(), 100, 100, None).unwrap()
    }

    #[test]
    fn outside_with_cameras_normals_and_without() {
        let known = torus(2000);
        let unknown = Cloud { normals: None, ..known.clone() };
        let spacing = mean_spacing(&known.points) as f32;
        let around: Vec<Camera> =
            [DVec3::X, DVec3::Z, -DVec3::X, -DVec3::Z, DVec3::new(0.3, 1.0, 0.0), DVec3::new(0.3, -1.0, 0.0)]
                .map(|d| camera(d * 6.0))
                .to_vec();
        for (name, cloud, cameras) in [
            ("normals", &known, &[][..]),
            ("cameras", &unknown, &around),
            ("both", &known, &around),
            ("none", &unknown, &[]),
        ] {
            let Exterior { near, offset, around } = made_exterior(cloud, cameras, spacing, 1);
            println!(
                "{name}: {} points, nearest {}",
                near.len(),
                near.iter().map(|&p| distance(p)).fold(9.0, f32::min)
            );
            assert!((100..=200).contains(&near.len()), "{name}: {}", near.len());
            for &p in &near {
                assert!(distance(p) > 0.02 && distance(p) < 0.3, "{name}: {p} is {} outside", distance(p));
            }
            assert!(around.len() == ON_SPHERE && around.iter().all(|p| p.length() > 1.05));
            let again = made_exterior(cloud, cameras, spacing, 1);
            assert_eq!((&near, &around, offset), (&again.near, &again.around, again.offset));
            // Each goes with its own points, and not with a point of the surface in its place.
            assert_eq!(again.beside(&cloud.points, &[]).count(), near.len());
            assert_eq!(again.beside(&cloud.points, &near[..1]).count(), near.len() - 1);
            assert_eq!(again.beside(&[], &[]).count(), 0);
        }
    }

    #[test]
    fn around_everything_evenly() {
        let points = [Vec3::new(-1.0, -0.2, 3.0), Vec3::new(1.0, 0.1, 3.4)];
        let sphere = sphere_around(&points);
        let middle = 0.5 * (points[0] + points[1]);
        let radius = 0.6 * points[0].distance(points[1]);
        assert_eq!(sphere.len(), ON_SPHERE);
        assert!(sphere.iter().all(|p| (p.distance(middle) - radius).abs() < 1e-5));
        let nearest =
            |p: &Vec3| sphere.iter().filter(|q| *q != p).map(|q| q.distance(*p)).fold(9.0, f32::min);
        assert!(sphere.iter().all(|p| nearest(p) > 0.5 * radius));
        assert!(((sphere.iter().copied().sum::<Vec3>() / 16.0) - middle).length() < 0.05 * radius);
    }

    #[test]
    fn voxels_hide_what_is_behind_them() {
        let cloud = torus(4000);
        let voxels = Voxels::new(&cloud.points, 3.5 * mean_spacing(&cloud.points) as f32);
        let right = Vec3::X;
        assert!(voxels.is_free(right, Vec3::X * 9.0));
        assert!(!voxels.is_free(right, Vec3::X * -9.0));
        // Through the hole.
        assert!(voxels.is_free(Vec3::new(0.0, 0.0, -2.0), Vec3::Z * 9.0));
        assert!(voxels.is_free(right, right));
    }
}
