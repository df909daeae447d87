//! Synthetic volumes with a known answer.
#![allow(dead_code, reason = "each test file uses a part of it")]

use vesicle::math::{DAffine3, Vec3};
use vesicle::volume::{Space, Volume, VolumeInit, Voxels};

/// A volume whose intensity at voxel index `p` is `value(p)`.
pub fn volume(dims: [usize; 3], value: impl Fn(Vec3) -> f32) -> Volume {
    let at = |i: usize| {
        value(Vec3::new((i % dims[0]) as f32, (i / dims[0] % dims[1]) as f32, (i / dims[0] / dims[1]) as f32))
    };
    placed(Voxels::F32((0..dims[0] * dims[1] * dims[2]).map(at).collect()), dims, DAffine3::IDENTITY)
}

/// Voxels as they are, placed in the world by `affine`.
pub fn placed(voxels: Voxels, [nx, ny, nz]: [usize; 3], affine: DAffine3) -> Volume {
    Volume::new(VolumeInit {
        voxels,
        dims: [nx, ny, nz, 1],
        affine,
        slope: 1.0,
        intercept: 0.0,
        frame_seconds: 0.0,
        space: Space::Ras,
    })
    .unwrap()
}

/// Falls with the distance from the skeleton of a shape: 1 up to half of `radius`, 0.5 at `radius`, 0 from 1.5 on.
pub fn potential(distance: f32, radius: f32) -> f32 {
    (1.5 - distance / radius).clamp(0.0, 1.0)
}

/// Distance from `p` to a circle around the origin in the xy plane.
pub fn to_circle(p: Vec3, radius: f32) -> f32 {
    let ring = (p.x * p.x + p.y * p.y).sqrt() - radius;
    (ring * ring + p.z * p.z).sqrt()
}

/// Figure 7: two linked tori of major radius 16 and tube radius 4.5 as a potential, surface at 0.5.
pub fn chain() -> Volume {
    chain_of(16.0, 4.5, 2.0)
}

/// Two linked tori with `margin` voxels of empty space around them.
pub fn chain_of(major: f32, tube: f32, margin: f32) -> Volume {
    let reach = major + tube + margin;
    let dims = [(2.0 * reach + major) as usize, (2.0 * reach) as usize, (2.0 * reach) as usize];
    let centre = Vec3::from(dims.map(|n| 0.5 * (n as f32 - 1.0)));
    let half = Vec3::X * 0.5 * major;
    volume(dims, |p| {
        let (a, b) = (p - centre + half, p - centre - half);
        let distance = to_circle(a, major).min(to_circle(Vec3::new(b.x, b.z, b.y), major));
        potential(distance, tube)
    })
}

/// Figure 14: the Menger sponge of a depth in 81³ voxels, 1 inside and 0 outside.
pub fn menger(depth: u32) -> Volume {
    let solid = |mut x: u32, mut y: u32, mut z: u32| {
        // The coarsest holes are cut first.
        let mut cell = 27;
        for _ in 0..depth {
            let middle = [x, y, z].iter().filter(|&&c| c / cell % 3 == 1).count();
            if middle >= 2 {
                return 0.0;
            }
            (x, y, z) = (x % cell, y % cell, z % cell);
            cell /= 3;
        }
        1.0
    };
    volume([81, 81, 81], |p| solid(p.x as u32, p.y as u32, p.z as u32))
}
