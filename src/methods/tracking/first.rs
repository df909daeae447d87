//! The mesh of the first frame (section 4.1): a signed distance from the boundary's points, and its zero.

use super::extremal::plane;
use super::region::Region;
use super::samples::{Falloff, Field};
use super::vote::{Faces, X, Y, Z};
use crate::math::DVec3;
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::volume::{Grid, marching_cubes};

/// Faces with fewer votes are not what the first surface is made of.
const LEAST_WEIGHT: f32 = 0.1;

/// The distance is that from points within this share of the radius; further off only the side counts.
const BAND: f64 = 0.8;

/// Voxels to either side that the slope of intensity is taken over.
const SLOPE: usize = 2;

/// A point of the boundary, with the direction out of what is bright.
struct Oriented {
    at: DVec3,
    normal: DVec3,
    weight: f64,
}

/// The surface of all that is bright in the first frame, in the world. `levels`: the level between bright and dark
/// around each voxel, where there is one.
pub(super) fn bright_surface(
    region: &Region,
    faces: &Faces,
    levels: &[Option<u8>],
    falloff: Falloff,
) -> Result<TriangleMesh, MethodError> {
    let points = oriented(region, faces, falloff);
    let band = BAND * falloff.radius;
    let distance = distances(region, &points, band);
    let levels = spread(levels, region.dims);
    let image = &region.frames[0];
    let side = |i: usize| if image[i] > levels[i] { band } else { -band };
    let values =
        (0..image.len()).map(|i| distance[i].map_or(side(i), |d| d.clamp(-band, band)) as f32).collect();
    let mut mesh = marching_cubes(&Grid::new(region.dims, values)?, 0.0)?;
    for p in &mut mesh.positions {
        *p = region.to_world.transform_point3(p.as_dvec3() * region.spacing).as_vec3();
    }
    Ok(mesh)
}

/// The faces' middles, each with the normal of the plane through what is around it, turned to where intensity falls.
fn oriented(region: &Region, faces: &Faces, falloff: Falloff) -> Vec<Oriented> {
    let field = Field::still(region, falloff, faces);
    let mut points = Vec::new();
    for direction in [X, Y, Z] {
        for face in faces[direction].iter().filter(|face| face.weight >= LEAST_WEIGHT) {
            let (at, _) = region.face(direction, face.voxel);
            let Some(fit) = plane(&field.sums(at)) else { continue };
            let slope = slope(region, region.voxel(face.voxel));
            let normal = if fit.normal.dot(slope) > 0.0 { -fit.normal } else { fit.normal };
            points.push(Oriented { at, normal, weight: f64::from(face.weight) });
        }
    }
    points
}

/// The direction in which intensity rises around a voxel: the slope of the line that fits it over each axis.
fn slope(region: &Region, voxel: [usize; 3]) -> DVec3 {
    let [nx, ny, _] = region.dims;
    let range = |k: usize| voxel[k].saturating_sub(SLOPE)..(voxel[k] + SLOPE + 1).min(region.dims[k]);
    let (mut sum, mut first, mut count, mut mean) = (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0);
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                let value = f64::from(region.frames[0][(z * ny + y) * nx + x]);
                let at = DVec3::new(x as f64, y as f64, z as f64) * region.spacing;
                sum += value * at;
                first += at;
                mean += value;
                count += 1.0;
            }
        }
    }
    sum - first * (mean / count)
}

/// At each voxel near points, the weighted mean of its distances from their planes, positive inside.
fn distances(region: &Region, points: &[Oriented], band: f64) -> Vec<Option<f64>> {
    let [nx, ny, nz] = region.dims;
    let mut sums = vec![(0.0f64, 0.0f64); nx * ny * nz];
    for point in points {
        let range = |k: usize| {
            let first = ((point.at[k] - band) / region.spacing[k]).ceil().max(0.0) as usize;
            let last = ((point.at[k] + band) / region.spacing[k]).floor() as usize;
            first..(last + 1).min(region.dims[k])
        };
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let away = DVec3::new(x as f64, y as f64, z as f64) * region.spacing - point.at;
                    let square = away.length_squared();
                    if square < band * band {
                        let weight = point.weight * libm::exp(-4.0 * square / (band * band));
                        let (sum, total) = &mut sums[(z * ny + y) * nx + x];
                        *sum -= weight * point.normal.dot(away);
                        *total += weight;
                    }
                }
            }
        }
    }
    sums.into_iter().map(|(sum, total)| (total > 0.0).then(|| sum / total)).collect()
}

/// Levels for all voxels: those without one take that of the nearest with one, along the axes.
fn spread(levels: &[Option<u8>], [nx, ny, nz]: [usize; 3]) -> Vec<u8> {
    let mut all: Vec<u8> = levels.iter().map(|level| level.unwrap_or(0)).collect();
    let mut known: Vec<bool> = levels.iter().map(Option::is_some).collect();
    let mut front: Vec<usize> = (0..all.len()).filter(|&i| known[i]).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for i in front {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
            let neighbours = [
                (x > 0).then(|| i - 1),
                (x + 1 < nx).then_some(i + 1),
                (y > 0).then(|| i - nx),
                (y + 1 < ny).then_some(i + nx),
                (z > 0).then(|| i - nx * ny),
                (z + 1 < nz).then_some(i + nx * ny),
            ];
            for j in neighbours.into_iter().flatten() {
                if !known[j] {
                    (known[j], all[j]) = (true, all[i]);
                    next.push(j);
                }
            }
        }
        front = next;
    }
    all
}
