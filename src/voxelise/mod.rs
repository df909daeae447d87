//! Voxelisation: volumes from closed meshes, on the grid of a given volume.
//!
//! ```
//! use vesicle::math::Vec3;
//! use vesicle::mesh::Mesh;
//! use vesicle::volume::{Volume, VolumeInit, Voxels};
//! use vesicle::voxelise::{VoxelKind, voxelise};
//!
//! let grid = Volume::new(VolumeInit::new(Voxels::U8(vec![0; 1000]), [10, 10, 10, 1]))?;
//! let ball = Mesh::icosphere(Vec3::splat(4.5), 3.0, 0.5)?.to_triangles();
//! let mask = voxelise(&ball, &grid, VoxelKind::Mask { value: 7 })?;
//! assert_eq!(mask.range(), [0.0, 7.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::math::{DAffine3, DVec3};
use crate::mesh::{MeshError, TriangleMesh};
use crate::pauses::{Pauses, finished};
use crate::spatial::lattice_distances;
use crate::volume::{FillRule, Volume, VolumeError, Voxels, coverage, filled, visit_inside};
use std::ops::Range;

/// Quantity that [`voxelise`] computes per voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelKind {
    /// `value` where the voxel centre is inside the mesh, 0 elsewhere, in the smallest unsigned type that holds it.
    Mask {
        /// Intensity of voxels inside; at least 1.
        value: u32,
    },
    /// Fraction of the voxel inside the mesh, 0 to 1.
    Coverage,
    /// Signed distance of the voxel centre from the surface in world units, negative inside.
    Distance,
}

/// Error of [`voxelise`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VoxeliseError {
    /// The mesh is not closed or not valid, or has no triangles for distances.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// An argument is out of range, or there is not enough memory.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

/// Returns a volume on the grid of `like`, in one frame, with the given quantity of a closed mesh in world space.
///
/// Inside is where the winding number, the number of times the surface encloses a point, is not 0, whether triangles
/// face outwards or inwards. For [`VoxelKind::Mask`] and the sign of distances this is decided exactly
/// ([`visit_inside`]), for vertices mapped to voxel indices in double precision. See [`coverage`] and
/// [`lattice_distances`] for the accuracy of the others.
///
/// # Errors
/// [`MeshError::NotClosed`] as [`TriangleMesh::check_closed`]; [`MeshError::InvalidArgument`] for distances from a mesh
/// without triangles; [`VolumeError::InvalidArgument`] for a mask of value 0; [`VolumeError::TooLarge`].
pub fn voxelise(mesh: &TriangleMesh, like: &Volume, kind: VoxelKind) -> Result<Volume, VoxeliseError> {
    finished(voxelise_in_slices(mesh, like, kind, &Pauses::default()))
}

/// Does what [`voxelise`] does, and pauses meanwhile.
///
/// # Errors
/// As [`voxelise`].
pub async fn voxelise_in_slices(
    mesh: &TriangleMesh,
    like: &Volume,
    kind: VoxelKind,
    pauses: &Pauses,
) -> Result<Volume, VoxeliseError> {
    mesh.check_closed()?;
    pauses.now().await;
    let dims = like.dims();
    let positions = in_voxels(mesh, like);
    let surface = (&positions[..], &mesh.triangles[..]);
    let voxels = match kind {
        VoxelKind::Mask { value } => mask(surface, dims, value, pauses).await?,
        VoxelKind::Coverage => Voxels::F32(coverage(surface, dims, pauses).await?),
        VoxelKind::Distance => Voxels::F32(signed_distances(mesh, surface, like, pauses).await?),
    };
    Ok(like.with_voxels(voxels)?)
}

/// Returns the positions of a mesh in continuous voxel indices.
fn in_voxels(mesh: &TriangleMesh, like: &Volume) -> Vec<DVec3> {
    let map = like.inverse_affine();
    (0..mesh.positions.len()).map(|v| map.transform_point3(mesh.world_position(v))).collect()
}

/// Returns voxels of intensity `value` inside a surface, and 0 outside, in the smallest unsigned type that holds
/// `value`.
async fn mask(
    surface: (&[DVec3], &[[u32; 3]]),
    dims: [usize; 3],
    value: u32,
    pauses: &Pauses,
) -> Result<Voxels, VolumeError> {
    macro_rules! filled {
        ($value:expr) => {{
            let mut voxels = filled(dims.iter().product(), 0)?;
            let fill = |run: Range<usize>| voxels[run].fill($value);
            visit_inside(surface, dims, FillRule::NonZero, fill, pauses).await;
            voxels
        }};
    }
    if value == 0 {
        return Err(VolumeError::invalid(
            "value",
            format!("must be an integer from 1 to {}, got 0", u32::MAX),
        ));
    }
    Ok(match (u8::try_from(value), u16::try_from(value)) {
        (Ok(value), _) => Voxels::U8(filled!(value)),
        (_, Ok(value)) => Voxels::U16(filled!(value)),
        _ => Voxels::U32(filled!(value)),
    })
}

/// Returns the signed distance of each voxel centre of `like` from the surface of `mesh`, which is also given in voxel
/// indices.
async fn signed_distances(
    mesh: &TriangleMesh,
    surface: (&[DVec3], &[[u32; 3]]),
    like: &Volume,
    pauses: &Pauses,
) -> Result<Vec<f32>, VoxeliseError> {
    let dims = like.dims();
    let mut distances = filled(dims.iter().product(), 0.0)?;
    let to_mesh = DAffine3::from_translation(-mesh.origin) * like.affine();
    lattice_distances(mesh, &to_mesh, dims, &mut distances, pauses).await?;
    pauses.now().await;
    let negate = |run: Range<usize>| {
        // A difference, so that a distance of 0 does not become −0.
        distances[run].iter_mut().for_each(|d| *d = 0.0 - *d);
    };
    visit_inside(surface, dims, FillRule::NonZero, negate, pauses).await;
    Ok(distances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core_tests::common::seeds;
    use crate::math::{DMat3, Random, Vec3, triangle};
    use crate::mesh::shapes::{cuboid, joined, torus};
    use crate::mesh::{Mesh, measure};
    use crate::spatial::contains;
    use crate::volume::{LengthUnit, Space, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn grid(dims: [usize; 3], affine: DAffine3) -> Volume {
        let volume = Volume::new(VolumeInit {
            voxels: Voxels::I16(vec![5; 2 * dims.iter().product::<usize>()]),
            dims: [dims[0], dims[1], dims[2], 2],
            affine,
            slope: 3.0,
            intercept: -1.0,
            frame_seconds: 0.5,
            space: Space::Lps,
        });
        volume.unwrap().with_unit(LengthUnit::Millimetre)
    }

    /// Returns the world positions of the voxel centres.
    fn centres(volume: &Volume) -> Vec<DVec3> {
        let [nx, ny, nz] = volume.dims();
        let index = |i: usize| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
        (0..nx * ny * nz).map(|i| volume.affine().transform_point3(index(i))).collect()
    }

    /// Returns an affine map with oblique, sheared axes of different lengths.
    fn oblique(random: &mut Random) -> DAffine3 {
        let mut vector = |size: f64| DVec3::from([(); 3].map(|()| size * (2.0 * random.unit() - 1.0)));
        let axes = [DVec3::X * 0.7, DVec3::Y * -0.9, DVec3::Z * 1.3].map(|axis| axis + vector(0.3));
        let matrix = DMat3::from_cols(axes[0], axes[1], axes[2]);
        DAffine3 { matrix3: matrix, translation: vector(1.0) - matrix * DVec3::splat(4.0) }
    }

    fn random_mesh(seed: u64) -> TriangleMesh {
        let mut random = Random::new(seed);
        let mut vector = |size: f32| Vec3::from([(); 3].map(|()| size * (2.0 * random.unit() as f32 - 1.0)));
        let ball = Mesh::icosphere(vector(1.0), 2.5, 1.2).unwrap().to_triangles();
        let mut mesh = match seed % 3 {
            0 => ball,
            1 => torus(2.0, 0.8, 12, 8),
            _ => joined(&[ball, torus(3.0, 0.6, 15, 6)]),
        };
        let noise = [0.0, 0.2, 1.0][seed as usize / 3 % 3];
        mesh.positions.iter_mut().for_each(|p| *p += vector(noise));
        mesh
    }

    #[test]
    fn the_grid_is_that_of_the_given_volume() {
        let like = grid([9, 8, 7], oblique(&mut Random::new(1)));
        for (value, kind) in
            [(1, Voxels::U8(vec![])), (256, Voxels::U16(vec![])), (70_000, Voxels::U32(vec![]))]
        {
            let mask = voxelise(&random_mesh(0), &like, VoxelKind::Mask { value }).unwrap();
            assert_eq!((mask.dims(), mask.frames(), mask.affine()), ([9, 8, 7], 1, like.affine()));
            assert_eq!((mask.space(), mask.unit()), (Space::Lps, LengthUnit::Millimetre));
            assert_eq!(mask.range(), [0.0, f64::from(value)]);
            assert_eq!(std::mem::discriminant(mask.voxels()), std::mem::discriminant(&kind));
        }
    }

    #[test]
    fn masks_of_random_meshes_contain_the_centres_with_a_winding_number() {
        let mut inside = 0;
        for seed in seeds(30) {
            let (mesh, like) = (random_mesh(seed), grid([9, 8, 7], oblique(&mut Random::new(seed))));
            let mask = voxelise(&mesh, &like, VoxelKind::Mask { value: 1 }).unwrap().intensities(0).unwrap();
            for (p, found) in centres(&like).into_iter().zip(mask) {
                let angle: f64 =
                    mesh.corners().map(|corners| triangle::solid_angle(corners, p.as_vec3())).sum();
                assert_eq!(found == 1.0, angle.abs() > std::f64::consts::TAU, "seed {seed}, {p}");
                inside += usize::from(found == 1.0);
            }
        }
        assert!(inside > 1000, "{inside}");
    }

    /// On a grid whose map is exact in single precision, points and voxels are decided alike, also on the surface.
    #[test]
    fn masks_are_what_contains_says() {
        let like = grid(
            [16, 15, 14],
            DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(0.5)), translation: DVec3::splat(-3.5) },
        );
        let mut cubes = cuboid(Vec3::new(2.0, 3.0, 1.5));
        cubes.append(&cuboid(Vec3::splat(-2.5)));
        for mesh in [cubes, random_mesh(1), random_mesh(2), random_mesh(5), random_mesh(8)] {
            let mask = voxelise(&mesh, &like, VoxelKind::Mask { value: 1 }).unwrap().intensities(0).unwrap();
            let found = contains(&mesh, centres(&like)).unwrap();
            assert!(mask.iter().zip(&found).all(|(a, b)| (*a == 1.0) == *b));
            assert!(found.iter().filter(|inside| **inside).count() > 100);
        }
    }

    #[test]
    fn coverage_sums_to_the_volume_in_world_units() {
        let ball = Mesh::icosphere(Vec3::new(0.1, 0.2, -0.1), 2.0, 0.3).unwrap().to_triangles();
        for seed in 0..5 {
            let like = grid([14, 13, 12], {
                let mut affine = oblique(&mut Random::new(seed));
                affine.translation = -(affine.matrix3 * DVec3::new(6.5, 6.0, 5.5));
                affine
            });
            let fractions = voxelise(&ball, &like, VoxelKind::Coverage).unwrap().intensities(0).unwrap();
            let sum: f64 = fractions.iter().map(|&f| f64::from(f)).sum();
            let found = sum * like.affine().matrix3.determinant().abs();
            let expected = measure(&ball).volume;
            assert!((found / expected - 1.0).abs() < 1e-5, "{found}, not {expected}");
        }
    }

    #[test]
    fn distances_to_random_meshes_are_those_of_brute_force() {
        for seed in seeds(9) {
            let (mesh, like) = (random_mesh(seed), grid([9, 8, 7], oblique(&mut Random::new(seed))));
            let found = voxelise(&mesh, &like, VoxelKind::Distance).unwrap().intensities(0).unwrap();
            let inside = contains(&mesh, centres(&like)).unwrap();
            for ((p, inside), found) in centres(&like).into_iter().zip(inside).zip(found) {
                let all = mesh.corners().map(|corners| triangle::distance_squared(corners, p));
                let distance = all.fold(f64::INFINITY, f64::min).sqrt();
                let expected = if inside { -distance } else { distance };
                assert!(
                    (f64::from(found) - expected).abs() < 1e-5,
                    "seed {seed}, {p}: {found}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_voxelised() {
        let like = grid([4, 4, 4], DAffine3::IDENTITY);
        let mut open = cuboid(Vec3::ONE);
        open.triangles.pop();
        for kind in [VoxelKind::Mask { value: 1 }, VoxelKind::Coverage, VoxelKind::Distance] {
            let found = voxelise(&open, &like, kind);
            assert!(matches!(found, Err(VoxeliseError::Mesh(MeshError::NotClosed { .. }))));
        }
        let found = voxelise(&cuboid(Vec3::ONE), &like, VoxelKind::Mask { value: 0 });
        assert!(matches!(
            found,
            Err(VoxeliseError::Volume(VolumeError::InvalidArgument { parameter: "value", .. }))
        ));
        let empty = TriangleMesh::default();
        assert!(matches!(voxelise(&empty, &like, VoxelKind::Distance), Err(VoxeliseError::Mesh(_))));
        let nothing = voxelise(&empty, &like, VoxelKind::Coverage).unwrap();
        assert_eq!(nothing.range(), [0.0, 0.0]);
        // Far beyond the grid, and as large as numbers get.
        let huge = cuboid(Vec3::splat(f32::MAX));
        for kind in [VoxelKind::Mask { value: 1 }, VoxelKind::Coverage, VoxelKind::Distance] {
            assert!(voxelise(&huge, &like, kind).is_ok());
        }
    }
}
