//! The mesh of the first frame, or of one in which an object begins (section 4.1 of the paper that `tracking` follows): a signed distance from the boundary
//! points, and its zero level by marching cubes.

use super::extremal::plane;
use super::labelling::{MIN_WEIGHT, VoxelBox, label_bright};
use super::region::Region;
use super::samples::{Falloff, SampleField};
use super::shifts::Shifts;
use super::vote::{Faces, X, Y, Z, too_much_boundary};
use crate::math::{DAffine3, DVec3};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::volume::{Grid, VolumeError, marching_cubes_in_slices};

/// Half-width of the band around the boundary points in which the distance from the planes fitted to them is used, as a
/// share of the radius of the plane fits; elsewhere only the inside/outside labelling counts.
const BAND: f64 = 0.8;

/// Number of voxels to either side of a voxel over which the intensity gradient is estimated, to orient normals.
const SLOPE_RADIUS: usize = 2;

/// Number of voxels between two pauses, and of those that count as one unit of work.
const VOXELS_PER_CHUNK: usize = 1 << 16;
const VOXELS_PER_UNIT: usize = 64;

/// A boundary point with its unit normal, which points from bright to dark.
struct Oriented {
    at: DVec3,
    normal: DVec3,
    weight: f64,
}

/// Extracts the closed surfaces around all bright regions of a frame, in the working space; an empty mesh if
/// the image has no boundary.
///
/// # Errors
/// [`MethodError::TooLarge`] if they have more than about `most` triangles, [`MethodError::Volume`] if memory does not
/// suffice.
pub(super) async fn extract_bright_surface(
    region: &Region,
    frame: usize,
    faces: &Faces,
    falloff: Falloff,
    most: usize,
    pauses: &Pauses,
) -> Result<TriangleMesh, MethodError> {
    let part = VoxelBox { ends: region.inner };
    let Some(is_bright) = label_bright(region, frame, faces, part, pauses).await else {
        return Ok(TriangleMesh::default());
    };
    let points = oriented(region, frame, faces, falloff, pauses).await;
    let band = BAND * falloff.radius;
    let distance = signed_distances(region, &points, band, pauses).await;
    drop(points);
    let value = |i: usize| {
        let at = region.voxel(i as u32);
        let side = if part.index(at).is_some_and(|i| is_bright[i]) { band } else { -band };
        // Beyond the box everything is outside.
        let inside = -region.distance_outside_box(at);
        let distance = if distance[i].is_nan() { side } else { distance[i] };
        distance.clamp(-band, band).min(inside) as f32
    };
    let mut values = Vec::with_capacity(distance.len());
    while values.len() < distance.len() {
        let first = values.len();
        let end = distance.len().min(first + VOXELS_PER_CHUNK);
        values.extend((first..end).map(value));
        pauses.after((end - first) / VOXELS_PER_UNIT).await;
    }
    drop(distance);
    let grid = Grid::new(region.dims, values)?;
    let mesh = marching_cubes_in_slices(&grid, 0.0, most, pauses).await.map_err(|error| match error {
        VolumeError::TooManyTriangles { .. } => too_much_boundary(),
        other => other.into(),
    })?;
    drop(grid);
    let map = region.to_space * DAffine3::from_scale(region.spacing);
    let mesh = mesh.transformed(&map);
    pauses.after(mesh.positions.len() / VOXELS_PER_UNIT).await;
    Ok(mesh.relative_to(DVec3::ZERO))
}

/// Returns the centres of the faces that separate bright from dark in a frame, those with a weight of at least
/// [`MIN_WEIGHT`], with the normals of the planes fitted around them, oriented towards falling intensity, or outwards
/// in the sides of the box.
async fn oriented(
    region: &Region,
    frame: usize,
    faces: &Faces,
    falloff: Falloff,
    pauses: &Pauses,
) -> Vec<Oriented> {
    // Faces keep objects apart with less than a voxel between them.
    let field = SampleField::single_frame(region, falloff, faces, &Shifts::default(), pauses).await;
    let mut points = Vec::new();
    for direction in [X, Y, Z] {
        for face in faces[direction].iter().filter(|face| face.weight >= MIN_WEIGHT) {
            let (at, _) = region.face(direction, face.voxel);
            let Some(fit) = plane(&field.sums(at)) else { continue };
            let out = region
                .outward_at_box_side(direction, face.voxel)
                .unwrap_or_else(|| -rising_direction(region, frame, region.voxel(face.voxel)));
            let normal = if fit.normal.dot(out) < 0.0 { -fit.normal } else { fit.normal };
            points.push(Oriented { at, normal, weight: f64::from(face.weight) });
            pauses.after(1).await;
        }
    }
    points
}

/// Returns the direction, not normalised, in which intensity rises around a voxel of a frame, to orient
/// normals: a multiple of the covariance of intensity and position.
fn rising_direction(region: &Region, frame: usize, voxel: [usize; 3]) -> DVec3 {
    let [nx, ny, _] = region.dims;
    let range =
        |k: usize| voxel[k].saturating_sub(SLOPE_RADIUS)..(voxel[k] + SLOPE_RADIUS + 1).min(region.dims[k]);
    let (mut sum, mut first, mut count, mut mean) = (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0);
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                let value = f64::from(region.frames[frame][(z * ny + y) * nx + x]);
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

/// Returns for each voxel within `band` of boundary points the weighted mean of its signed distances to the planes
/// through these points, positive inside; NaN for other voxels. The surface of the frame is
/// the zero level of these distances.
async fn signed_distances(region: &Region, points: &[Oriented], band: f64, pauses: &Pauses) -> Vec<f64> {
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
        pauses.after(1).await;
    }
    pauses.now().await;
    sums.into_iter().map(|(sum, total)| if total > 0.0 { sum / total } else { f64::NAN }).collect()
}
