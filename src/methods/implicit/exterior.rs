//! Where the function has to be negative (paper, section VI-A).

use super::camera::Camera;
use super::cloud::{Cloud, subsampled};
use super::normals::{Normals, estimated_normals};
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

/// The points outside, for surface points of mean distance `spacing`; all in units of the box.
///
/// Towards each camera that sees the point; where no cameras are given, along the normals, given or estimated.
/// Thinned by Poisson-disc sampling to one for ten surface points. Then those on the sphere.
pub fn exterior_points(cloud: &Cloud, cameras: &[Camera], spacing: f32, seed: u64) -> Vec<Vec3> {
    let wanted = (cloud.len() / SURFACE_POINTS).max(LEAST);
    // A few more places than points wanted, as some will be refused.
    let places = subsampled(&cloud.points, wanted + wanted / 4, seed);
    let ways = ways_out(cloud, cameras, &places, spacing);
    let offset = [OFFSET * spacing, NOISE * ways.noise, LEAST_OFFSET].into_iter().fold(0.0, f32::max);
    let surface = PointGrid::of(&cloud.points, offset);
    let candidates = ways.directions.iter().map(|&(i, way)| cloud.points[i as usize] + way * offset);
    let outside: Vec<Vec3> = candidates.filter(|&p| !surface.has_within(p, CLEAR * offset)).collect();
    let kept = subsampled(&outside, wanted, seed).into_iter().map(|i| outside[i as usize]);
    kept.chain(sphere_around(&cloud.points)).collect()
}

/// Directions that lead outwards.
struct Ways {
    /// Points with a direction each; a point may have several, or none.
    directions: Vec<(u32, Vec3)>,
    noise: f32,
}

fn ways_out(cloud: &Cloud, cameras: &[Camera], places: &[u32], spacing: f32) -> Ways {
    let normals = match &cloud.normals {
        Some(given) => Normals {
            directions: places.iter().map(|&i| given[i as usize].normalize_or_zero()).collect(),
            noise: 0.0,
        },
        None => estimated_normals(&cloud.points, places, spacing),
    };
    let with_normals = places.iter().copied().zip(normals.directions);
    let directions = if cameras.is_empty() {
        with_normals.collect()
    } else {
        towards_cameras(&cloud.points, cameras, with_normals, spacing)
    };
    Ways { directions, noise: normals.noise }
}

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
pub fn sphere_around(points: &[Vec3]) -> Vec<Vec3> {
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
