//! Exterior points, known to be outside the surface, at which the implicit function f has to be −1: they fix which side
//! of the input points is outside (Dinh, Turk & Slabaugh, section VI-A).

use super::automatic::OffSurface;
use super::camera::Camera;
use super::cloud::Cloud;
use super::normals::{Normals, estimated_normals};
use super::sampling::subsampled;
use crate::math::{Bounds, Vec3, spread_directions};
use crate::pauses::Pauses;
use crate::spatial::PointGrid;

/// Number of exterior points on a sphere around all input points; they are always added.
const SPHERE_POINTS: usize = 16;
/// Radius of the sphere of exterior points around the input points, in half diagonals of their bounding box: small
/// enough to confine the surface, and large enough that the surface does not bulge beyond it between points.
const SPHERE: f64 = 1.2;
/// Number of surface points for which one exterior point near the surface is made.
const SURFACE_POINTS: usize = 10;
/// Largest number of exterior points kept near the surface if one for [`SURFACE_POINTS`] surface points would be fewer,
/// as in clouds of less than 300 points.
const MIN_POINTS: usize = 30;
/// Distance at which exterior points are made from surface points, in mean spacings of the points, unless [`NOISE`] or
/// [`MIN_OFFSET`] requires more. At a distance of 1 they constrain less than noise does, at 6 they fall into cavities.
const OFFSET: f32 = 3.0;
/// Minimum distance at which exterior points are made from surface points, in standard deviations of the noise of the
/// surface points.
const NOISE: f32 = 4.0;
/// Minimum distance at which exterior points are made from surface points, in units of the normalised box (longest side
/// 2): dense clouds are not less noisy.
const MIN_OFFSET: f32 = 0.04;
/// Minimum distance of an exterior point from all surface points, as a share of its distance from the one from which it
/// was made: a nearer one may be inside the surface, and is dropped.
const MIN_CLEARANCE: f32 = 0.8;

/// The points outside the surface that become exterior constraints, in units of the normalised box.
#[derive(Clone, Debug)]
pub struct Exterior {
    /// Exterior points near the surface, given by the caller or made from the surface points.
    pub near: Vec<Vec3>,
    /// Points on both sides of the surface; none if there are to be constraints outside only.
    pub off_surface: OffSurface,
    /// Distance of the points in `near` from the surface points from which they were made, in units of the normalised
    /// box; 0 if the caller gave them.
    pub offset: f32,
    /// Exterior points on a sphere around all surface points, which confine the surface.
    pub on_sphere: Vec<Vec3>,
}

impl Exterior {
    /// Returns the points outside and inside that remain valid after edits of the surface points: they are near a point of
    /// `surface`, the edited points, from which they may have been made, and not too near to a point of `added`; those inside
    /// are not near a point of `marked`, which the user knows to be outside. Points given by the caller are all kept.
    pub fn valid_after_edits(&self, surface: &[Vec3], added: &[Vec3], marked: &[Vec3]) -> [Vec<Vec3>; 2] {
        let valid = |points: &[Vec3], offset: f32| {
            if offset == 0.0 {
                return points.to_vec();
            }
            let [surface, added] = [surface, added].map(|points| PointGrid::of(points, offset));
            let is_valid = |p: &&Vec3| {
                surface.has_within(**p, MAX_OFFSETS * offset)
                    && !added.has_within(**p, MIN_CLEARANCE * offset)
            };
            points.iter().filter(is_valid).copied().collect()
        };
        let OffSurface { outside, inside, offset, .. } = &self.off_surface;
        let [outside, inside] = [outside, inside].map(|points| valid(points, *offset));
        [[valid(&self.near, self.offset), outside].concat(), clear_of(marked, inside, *offset)]
    }

    /// Returns these points, which are known to be outside, with points on both sides that were `found`; `outside_share` is
    /// the share of these points that are outside by what was found. Where they contradict each other, which side is outside
    /// is ambiguous, and there are no points inside.
    pub fn with_both_sides(self, found: OffSurface, outside_share: f64) -> Self {
        let mut off_surface = if outside_share >= AGREEMENT {
            found
        } else if outside_share <= 1.0 - AGREEMENT {
            found.exchanged()
        } else {
            OffSurface::default()
        };
        off_surface.inside = clear_of(&self.near, off_surface.inside, off_surface.offset);
        Self { off_surface, ..self }
    }
}

/// Returns those of `points` that are not near one of `others`; `offset` is their distance from the surface.
fn clear_of(others: &[Vec3], mut points: Vec<Vec3>, offset: f32) -> Vec<Vec3> {
    if offset > 0.0 && !others.is_empty() {
        let others = PointGrid::of(others, offset);
        points.retain(|&p| !others.has_within(p, MIN_CLEARANCE * offset));
    }
    points
}

/// Share of points known to be outside that have to be on the same side of a surface that was found; cameras see some points
/// wrongly.
pub const AGREEMENT: f64 = 0.9;

/// Maximum distance of an exterior point from the nearest surface point, in units of [`Exterior::offset`]: a farther
/// one is dropped, since the points from which it was made were removed.
const MAX_OFFSETS: f32 = 1.25;

/// Returns the exterior points `given` by the caller, in units of the normalised box, with points on a sphere around
/// `cloud`.
pub fn exterior_from_points(cloud: &Cloud, given: Vec<Vec3>) -> Exterior {
    let on_sphere = sphere_around(&cloud.points);
    Exterior { near: given, off_surface: OffSurface::default(), offset: 0.0, on_sphere }
}

/// Makes exterior points for the surface points `cloud`, whose mean distance to the nearest neighbour is `spacing`.
///
/// They are made from an even sample of the surface points, by an offset towards each camera that sees the point, or
/// without cameras along the normal, given or estimated. Exterior points too near to the surface are dropped, and
/// Poisson-disc sampling leaves at most one for ten surface points, or 30 if that is more. Points on a sphere around
/// the cloud are added. Pauses meanwhile.
pub async fn generate_exterior(
    cloud: &Cloud,
    cameras: &[Camera],
    spacing: f32,
    seed: u64,
    pauses: &Pauses,
) -> Exterior {
    let target_count = (cloud.len() / SURFACE_POINTS).max(MIN_POINTS);
    // A few more than wanted, as some will be rejected.
    let positions = target_count + target_count / 4;
    let directions = outward_directions(cloud, cameras, positions, spacing, seed, pauses).await;
    let offset = [OFFSET * spacing, NOISE * directions.noise, MIN_OFFSET].into_iter().fold(0.0, f32::max);
    let surface = PointGrid::of(&cloud.points, offset);
    let candidates =
        directions.directions.iter().map(|&(i, direction)| cloud.points[i as usize] + direction * offset);
    let outside: Vec<Vec3> = candidates.filter(|&p| !surface.has_within(p, MIN_CLEARANCE * offset)).collect();
    let kept = subsampled(&outside, target_count, seed).into_iter().map(|i| outside[i as usize]);
    let on_sphere = sphere_around(&cloud.points);
    Exterior { near: kept.collect(), off_surface: OffSurface::default(), offset, on_sphere }
}

/// Directions that lead outwards from surface points, for making exterior points, and the noise of the surface points.
struct OutwardDirections {
    /// Pairs of the index of a surface point and a unit direction; a point may have several, or none.
    directions: Vec<(u32, Vec3)>,
    noise: f32,
}

/// Returns outward directions at an even sample of no more than `positions` surface points: towards the cameras that
/// see them, or without cameras along their normals.
async fn outward_directions(
    cloud: &Cloud,
    cameras: &[Camera],
    positions: usize,
    spacing: f32,
    seed: u64,
    pauses: &Pauses,
) -> OutwardDirections {
    let (oriented, normals) = match &cloud.normals {
        Some(given) => {
            let at = subsampled(&cloud.points, positions, seed);
            let directions = at.iter().map(|&i| given[i as usize].normalize_or_zero()).collect();
            (at, Normals { directions, noise: 0.0 })
        }
        None => {
            let at = subsampled(&cloud.points, if positions > ORIENTED { positions } else { ORIENTED }, seed);
            let normals = estimated_normals(&cloud.points, &at, spacing, pauses).await;
            (at, normals)
        }
    };
    let points: Vec<Vec3> = oriented.iter().map(|&i| cloud.points[i as usize]).collect();
    let chosen = subsampled(&points, positions, seed).into_iter().map(|k| k as usize);
    let with_normals = chosen.map(|k| (oriented[k], normals.directions[k]));
    let directions = if cameras.is_empty() {
        with_normals.collect()
    } else {
        towards_cameras(&cloud.points, cameras, with_normals, spacing)
    };
    OutwardDirections { directions, noise: normals.noise }
}

/// Minimum number of surface points whose normals are estimated, even if fewer are needed: with fewer, neighbours may
/// lie on different sides of a thin part.
const ORIENTED: usize = 3000;

/// Returns the directions from each surface point in `positions`, a list of indices and normals, to the cameras that
/// see it: cameras in a direction whose cosine with the normal is above [`GRAZING`], and not occluded.
///
/// Occlusion alone does not suffice, since rays slip through gaps in the far side of an object.
fn towards_cameras(
    points: &[Vec3],
    cameras: &[Camera],
    positions: impl Iterator<Item = (u32, Vec3)>,
    spacing: f32,
) -> Vec<(u32, Vec3)> {
    let occupancy = OccupancyGrid::new(points, VOXEL * spacing);
    let centres: Vec<Vec3> = cameras.iter().map(|camera| camera.centre().as_vec3()).collect();
    let mut directions = Vec::new();
    for (i, normal) in positions {
        let p = points[i as usize];
        let all = centres.iter().map(|&centre| (centre, (centre - p).normalize_or_zero()));
        let seen = all.filter(|&(centre, direction)| {
            direction.dot(normal) > GRAZING && occupancy.is_unoccluded(p, centre)
        });
        directions.extend(seen.map(|(_, direction)| (i, direction)));
    }
    directions
}

/// Cosine between the normal of a surface point and the direction to a camera below which the view is too oblique to
/// show which side of the point is outside.
const GRAZING: f32 = 0.2;

/// Returns [`SPHERE_POINTS`] points spread evenly along a spiral on a sphere around the bounding box of `points`; its
/// radius is [`SPHERE`] half diagonals of that box. They become exterior constraints.
fn sphere_around(points: &[Vec3]) -> Vec<Vec3> {
    let bounds = Bounds::from_points(points);
    let [min, max] = [bounds.min, bounds.max].map(|corner| corner.as_dvec3());
    let radius = 0.5 * SPHERE * max.distance(min);
    let centre = 0.5 * (min + max);
    spread_directions(SPHERE_POINTS).map(|unit| (centre + unit * radius).as_vec3()).collect()
}

/// Edge length of the voxels that decide whether something hides a surface point from a camera, in mean spacings of the
/// points: with 1.5, rays pass through the gaps of stereo data; with 6, the legs of an object merge.
const VOXEL: f32 = 3.5;
/// Length of the start of a ray from a surface point to a camera, in occlusion voxels, where the ray is not tested for
/// occlusion, as the voxels there contain the neighbourhood of the point itself.
const UNTESTED_VOXELS: f32 = 1.5;
/// Maximum number of occlusion voxels along the longest side of the points' bounding box, to limit memory; smaller
/// voxels are enlarged.
const MAX_VOXELS: f32 = 256.0;

/// Grid of voxels, each marked if it contains surface points, to decide whether a camera sees a point.
struct OccupancyGrid {
    origin: Vec3,
    edge: f32,
    dims: [usize; 3],
    occupied: Vec<bool>,
}

impl OccupancyGrid {
    fn new(points: &[Vec3], edge: f32) -> Self {
        let bounds = Bounds::from_points(points);
        let size = bounds.max - bounds.min;
        let least = size.max_element() / MAX_VOXELS;
        let edge = if edge > least { edge } else { least };
        let dims = size.to_array().map(|side| (side / edge) as usize + 1);
        let mut occupancy =
            Self { origin: bounds.min, edge, dims, occupied: vec![false; dims.iter().product()] };
        for &p in points {
            if let Some(at) = occupancy.index(p) {
                occupancy.occupied[at] = true;
            }
        }
        occupancy
    }

    fn index(&self, p: Vec3) -> Option<usize> {
        let [x, y, z] = ((p - self.origin) / self.edge).floor().to_array();
        let inside = x >= 0.0 && y >= 0.0 && z >= 0.0;
        let [x, y, z] = [x, y, z].map(|k| k as usize);
        (inside && x < self.dims[0] && y < self.dims[1] && z < self.dims[2])
            .then(|| (z * self.dims[1] + y) * self.dims[0] + x)
    }

    /// Returns whether the segment from the surface point `p` to the centre of a camera, `camera`, passes no voxel with
    /// points beyond the neighbourhood of `p`; it is tested every half voxel.
    fn is_unoccluded(&self, p: Vec3, camera: Vec3) -> bool {
        let length = p.distance(camera);
        let step = (camera - p) / length * (0.5 * self.edge);
        let mut at = p + step * (2.0 * UNTESTED_VOXELS);
        let steps = 2.0 * (length / self.edge - UNTESTED_VOXELS);
        let most = 4.0 * MAX_VOXELS;
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
    use crate::math::{DVec3, Random};
    use crate::methods::implicit::cloud::mean_spacing;
    use crate::pauses::finished;
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

    /// Returns a test camera at `from`, which is not on the y axis, that looks at the origin.
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
        let cameras: Vec<Camera> =
            [DVec3::X, DVec3::Z, -DVec3::X, -DVec3::Z, DVec3::new(0.3, 1.0, 0.0), DVec3::new(0.3, -1.0, 0.0)]
                .map(|d| camera(d * 6.0))
                .to_vec();
        for (name, cloud, cameras) in [
            ("normals", &known, &[][..]),
            ("cameras", &unknown, &cameras),
            ("both", &known, &cameras),
            ("none", &unknown, &[]),
        ] {
            let Exterior { near, offset, on_sphere, .. } =
                finished(generate_exterior(cloud, cameras, spacing, 1, &Pauses::default()));
            println!(
                "{name}: {} points, nearest {}",
                near.len(),
                near.iter().map(|&p| distance(p)).fold(9.0, f32::min)
            );
            assert!((100..=200).contains(&near.len()), "{name}: {}", near.len());
            for &p in &near {
                assert!(distance(p) > 0.02 && distance(p) < 0.3, "{name}: {p} is {} outside", distance(p));
            }
            assert!(on_sphere.len() == SPHERE_POINTS && on_sphere.iter().all(|p| p.length() > 1.05));
            let again = finished(generate_exterior(cloud, cameras, spacing, 1, &Pauses::default()));
            assert_eq!((&near, &on_sphere, offset), (&again.near, &again.on_sphere, again.offset));
            // Each is kept with the points it was made from, and dropped if a surface point is added in its position.
            assert_eq!(again.valid_after_edits(&cloud.points, &[], &[])[0].len(), near.len());
            assert_eq!(again.valid_after_edits(&cloud.points, &near[..1], &[])[0].len(), near.len() - 1);
            assert_eq!(again.valid_after_edits(&[], &[], &[])[0].len(), 0);
        }
    }

    #[test]
    fn the_bounding_sphere_is_sampled_evenly() {
        let points = [Vec3::new(-1.0, -0.2, 3.0), Vec3::new(1.0, 0.1, 3.4)];
        let sphere = sphere_around(&points);
        let middle = 0.5 * (points[0] + points[1]);
        let radius = 0.6 * points[0].distance(points[1]);
        assert_eq!(sphere.len(), SPHERE_POINTS);
        assert!(sphere.iter().all(|p| (p.distance(middle) - radius).abs() < 1e-5));
        let nearest =
            |p: &Vec3| sphere.iter().filter(|q| *q != p).map(|q| q.distance(*p)).fold(9.0, f32::min);
        assert!(sphere.iter().all(|p| nearest(p) > 0.5 * radius));
        assert!(((sphere.iter().copied().sum::<Vec3>() / 16.0) - middle).length() < 0.05 * radius);
    }

    #[test]
    fn voxels_hide_what_is_behind_them() {
        let cloud = torus(4000);
        let occupancy = OccupancyGrid::new(&cloud.points, 3.5 * mean_spacing(&cloud.points) as f32);
        let right = Vec3::X;
        assert!(occupancy.is_unoccluded(right, Vec3::X * 9.0));
        assert!(!occupancy.is_unoccluded(right, Vec3::X * -9.0));
        // Through the hole of the torus.
        assert!(occupancy.is_unoccluded(Vec3::new(0.0, 0.0, -2.0), Vec3::Z * 9.0));
        assert!(occupancy.is_unoccluded(right, right));
    }
}
