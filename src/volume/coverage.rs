//! Coverage of voxels by a solid: the fraction of each voxel inside a closed surface, by exact clipping.

use super::VolumeError;
use super::error::filled;
use super::row_sweep::for_each_row;
use crate::math::DVec3;
use crate::pauses::Pauses;
use smallvec::SmallVec;

/// Coverage below which a voxel counts as outside: rounding of sums along a row stays below it.
const NOTHING: f64 = 1e-9;

/// A convex polygon: a triangle cut by up to six planes.
type Polygon = SmallVec<[DVec3; 9]>;

/// Returns the fraction of each voxel of a grid of `dims`, x fastest, that is inside a closed surface, given by
/// positions, in voxel indices, and triangles.
///
/// The integral of the winding number over each voxel is computed by clipping the triangles to the voxels, exact but
/// for rounding: coverage is exact where the surface does not intersect itself. Elsewhere the absolute value of the
/// integral is limited to 1, so that voxels on overlapping components may be too high. Pauses between slices.
///
/// # Errors
/// [`VolumeError::TooLarge`].
pub async fn coverage(
    surface: (&[DVec3], &[[u32; 3]]),
    dims: [usize; 3],
    pauses: &Pauses,
) -> Result<Vec<f32>, VolumeError> {
    let (positions, triangles) = surface;
    let mut fractions = filled(dims.iter().product(), 0.0)?;
    let mut row = Row::new(dims[0])?;
    let add = |y: usize, z: usize, near: &[u32]| {
        for &t in near {
            let triangle = triangles[t as usize].map(|v| positions[v as usize]);
            let slab = between(&Polygon::from_slice(&triangle), 2, z);
            row.add(&between(&slab, 1, y));
        }
        let start = dims[0] * (y + dims[1] * z);
        row.finish(&mut fractions[start..start + dims[0]]);
    };
    for_each_row(surface, dims, 0.5, add, pauses).await;
    Ok(fractions)
}

/// Sums over the parts of triangles in one row of voxels, along x.
///
/// The part of the solid in the row is a sum of signed prisms, from each part of a triangle on to infinite x. A prism
/// adds to the voxels in which it begins, and the area of its cross-section to all voxels beyond.
struct Row {
    /// By how much each voxel's coverage exceeds `change`, summed up to the voxel.
    beginning: Vec<f64>,
    /// The change of coverage from each voxel to the next.
    change: Vec<f64>,
}

impl Row {
    fn new(count: usize) -> Result<Self, VolumeError> {
        Ok(Self { beginning: filled(count, 0.0)?, change: filled(count + 1, 0.0)? })
    }

    /// Adds the prism from `polygon`, a part of a triangle, to infinite x.
    fn add(&mut self, polygon: &Polygon) {
        let [before, mut rest] = split(polygon, 0, -0.5);
        self.change[0] += area_and_volume(&before, 0.0)[0];
        while !rest.is_empty() {
            let least = rest.iter().fold(f64::INFINITY, |least, p| if p.x < least { p.x } else { least });
            let voxel = (least + 0.5) as usize;
            if voxel >= self.beginning.len() {
                return;
            }
            let end = voxel as f64 + 0.5;
            let [part, beyond] = split(&rest, 0, end);
            let [area, volume] = area_and_volume(&part, end);
            self.beginning[voxel] += volume;
            self.change[voxel + 1] += area;
            rest = beyond;
        }
    }

    /// Writes the coverage of the voxels to `fractions`, and clears the sums.
    fn finish(&mut self, fractions: &mut [f32]) {
        let mut sum = 0.0;
        for (k, fraction) in fractions.iter_mut().enumerate() {
            sum += self.change[k];
            let covered = (sum + self.beginning[k]).abs();
            *fraction = if covered < NOTHING {
                0.0
            } else if covered < 1.0 {
                covered as f32
            } else {
                1.0
            };
        }
        self.beginning.fill(0.0);
        self.change.fill(0.0);
    }
}

/// Returns the area of a polygon projected along x, positive if it faces low x, and the volume between the polygon and
/// the plane at x = `end`.
fn area_and_volume(polygon: &Polygon, end: f64) -> [f64; 2] {
    let mut sums = [0.0, 0.0];
    for k in 2..polygon.len() {
        let [a, b, c] = [polygon[0], polygon[k - 1], polygon[k]];
        let (u, v) = (b - a, c - a);
        let area = 0.5 * (u.z * v.y - u.y * v.z);
        sums[0] += area;
        sums[1] += area * (end - (a.x + b.x + c.x) / 3.0);
    }
    sums
}

/// Returns the part of a polygon in the layer of voxels of index `layer` along `axis`.
fn between(polygon: &Polygon, axis: usize, layer: usize) -> Polygon {
    let [_, above] = split(polygon, axis, layer as f64 - 0.5);
    let [part, _] = split(&above, axis, layer as f64 + 0.5);
    part
}

/// Returns the parts of a polygon below and above the plane at `at` along `axis`; empty ones have no corners.
fn split(polygon: &Polygon, axis: usize, at: f64) -> [Polygon; 2] {
    if polygon.iter().all(|p| p[axis] <= at) {
        return [polygon.clone(), Polygon::new()];
    }
    if polygon.iter().all(|p| p[axis] >= at) {
        return [Polygon::new(), polygon.clone()];
    }
    let mut parts = [Polygon::new(), Polygon::new()];
    for (k, &p) in polygon.iter().enumerate() {
        let q = polygon[if k + 1 < polygon.len() { k + 1 } else { 0 }];
        let is_above = p[axis] > at;
        parts[usize::from(is_above)].push(p);
        if is_above != (q[axis] > at) {
            let mut cut = p + (q - p) * ((at - p[axis]) / (q[axis] - p[axis]));
            cut[axis] = at;
            parts.iter_mut().for_each(|part| part.push(cut));
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3};
    use crate::mesh::shapes::{cuboid, joined, torus};
    use crate::mesh::{Mesh, TriangleMesh, measure};
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn covered(mesh: &TriangleMesh, dims: [usize; 3]) -> Vec<f32> {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        finished(coverage((&positions, &mesh.triangles), dims, &Pauses::default())).unwrap()
    }

    fn sum(fractions: &[f32]) -> f64 {
        fractions.iter().map(|&f| f64::from(f)).sum()
    }

    fn moved(mut mesh: TriangleMesh, by: Vec3) -> TriangleMesh {
        mesh.positions.iter_mut().for_each(|p| *p += by);
        mesh
    }

    #[test]
    fn the_sum_is_the_enclosed_volume() {
        let mut random = Random::new(3);
        for edge in [4.0, 1.0, 0.3] {
            let mut vector = |size: f32| Vec3::from([(); 3].map(|()| size * random.unit() as f32));
            let centre = Vec3::splat(8.0) + vector(1.0);
            let mut ball = Mesh::icosphere(centre, 6.0, edge).unwrap().to_triangles();
            let shaken = 0.2 * edge;
            ball.positions.iter_mut().for_each(|p| *p += vector(shaken));
            let ring = moved(torus(5.0, 1.5, 17, 9), Vec3::new(8.0, 7.5, 20.0));
            for mesh in [&ball, &ring, &joined(&[ball.clone(), ring.clone()])] {
                let (found, expected) = (sum(&covered(mesh, [17, 16, 24])), measure(mesh).volume);
                assert!((found / expected - 1.0).abs() < 1e-6, "{found}, not {expected}");
            }
        }
    }

    #[test]
    fn a_box_covers_each_voxel_by_a_product() {
        let (low, size) = (Vec3::new(1.2, -3.0, 2.5), Vec3::new(3.0, 6.75, 2.25));
        let part = |k: usize, low: f32, size: f32| {
            let (first, last) = (low.max(k as f32 - 0.5), (low + size).min(k as f32 + 0.5));
            (last - first).max(0.0)
        };
        for outward in [true, false] {
            let mut mesh = moved(cuboid(size), low);
            if !outward {
                mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            }
            for (i, found) in covered(&mesh, [6, 5, 7]).into_iter().enumerate() {
                let [x, y, z] = [i % 6, i / 6 % 5, i / 30];
                let expected = part(x, low.x, size.x) * part(y, low.y, size.y) * part(z, low.z, size.z);
                assert!((found - expected).abs() < 1e-6, "{x} {y} {z}: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn a_solid_beyond_the_grid_is_cut_off() {
        let mesh = moved(torus(6.0, 2.0, 24, 12), Vec3::new(0.1, 0.2, 3.1));
        let part = covered(&mesh, [5, 7, 6]);
        let whole = covered(&moved(mesh, Vec3::splat(20.0)), [40, 40, 40]);
        for (i, found) in part.into_iter().enumerate() {
            let [x, y, z] = [i % 5, i / 5 % 7, i / 35];
            let expected = whole[x + 20 + 40 * (y + 20 + 40 * (z + 20))];
            assert!((found - expected).abs() < 1e-5, "{x} {y} {z}: {found}, not {expected}");
        }
    }

    /// Voxels that the surface does not reach are exactly 0 or 1.
    #[test]
    fn no_rounding_is_left_far_from_the_surface() {
        let ball = Mesh::icosphere(Vec3::new(15.3, 14.8, 16.1), 13.0, 0.9).unwrap().to_triangles();
        let fractions = covered(&ball, [32, 32, 32]);
        for (i, &fraction) in fractions.iter().enumerate() {
            let p = Vec3::new((i % 32) as f32, (i / 32 % 32) as f32, (i / 1024) as f32);
            let beyond = p.distance(Vec3::new(15.3, 14.8, 16.1)) - 13.0;
            if beyond.abs() > 1.0 {
                assert_eq!(fraction, if beyond < 0.0 { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn overlapping_components_cover_at_most_all() {
        let cube = moved(cuboid(Vec3::splat(4.0)), Vec3::splat(1.5));
        let fractions = covered(&joined(&[cube.clone(), moved(cube.clone(), Vec3::X)]), [9, 8, 8]);
        assert_eq!((sum(&fractions), fractions.iter().any(|f| *f > 1.0)), (80.0, false));
    }
}
