//! Synthetic volumes with known surfaces.

use vesicle::math::{DAffine3, Vec3};
use vesicle::volume::{Volume, VolumeInit, Voxels};

/// Returns a volume whose intensity at voxel index `p` is `value(p)`.
pub fn volume(dims: [usize; 3], value: impl Fn(Vec3) -> f32) -> Volume {
    let at = |i: usize| {
        value(Vec3::new((i % dims[0]) as f32, (i / dims[0] % dims[1]) as f32, (i / dims[0] / dims[1]) as f32))
    };
    placed(Voxels::F32((0..dims[0] * dims[1] * dims[2]).map(at).collect()), dims, DAffine3::IDENTITY)
}

/// Returns a volume of unscaled voxels, placed in the world by `affine`.
pub fn placed(voxels: Voxels, [nx, ny, nz]: [usize; 3], affine: DAffine3) -> Volume {
    Volume::new(VolumeInit { affine, ..VolumeInit::new(voxels, [nx, ny, nz, 1]) }).unwrap()
}

/// Returns an intensity that falls with the distance from a skeleton: 1 up to half of `radius`, 0.5 at `radius`, 0
/// beyond 1.5 times `radius`.
pub fn potential(distance: f32, radius: f32) -> f32 {
    (1.5 - distance / radius).clamp(0.0, 1.0)
}

/// Returns the distance from `p` to a circle around the origin in the xy plane.
pub fn to_circle(p: Vec3, radius: f32) -> f32 {
    let ring = (p.x * p.x + p.y * p.y).sqrt() - radius;
    (ring * ring + p.z * p.z).sqrt()
}

/// Returns the distance from `p` to the segment from `a` to `b`.
pub fn to_segment(p: Vec3, a: Vec3, b: Vec3) -> f32 {
    let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a + (b - a) * along)
}

/// Figure 7: two linked tori of major radius 16 and tube radius 4.5 as a potential; the surface is at 0.5.
pub fn chain() -> Volume {
    chain_of(16.0, 4.5, 2.0)
}

fn chain_dims(major: f32, tube: f32, margin: f32) -> [usize; 3] {
    let reach = major + tube + margin;
    [(2.0 * reach + major) as usize, (2.0 * reach) as usize, (2.0 * reach) as usize]
}

/// Returns the distance from `p` to two linked circles about the origin.
fn to_linked_circles(p: Vec3, major: f32) -> f32 {
    let half = Vec3::X * 0.5 * major;
    let (a, b) = (p + half, p - half);
    to_circle(a, major).min(to_circle(Vec3::new(b.x, b.z, b.y), major))
}

/// Returns a volume of two linked tori with `margin` voxels of empty space around them.
pub fn chain_of(major: f32, tube: f32, margin: f32) -> Volume {
    let dims = chain_dims(major, tube, margin);
    let centre = Vec3::from(dims.map(|n| 0.5 * (n as f32 - 1.0)));
    volume(dims, |p| potential(to_linked_circles(p - centre, major), tube))
}

/// Figure 14: the Menger sponge of the given depth in 81³ voxels, 1 inside and 0 outside; it fills the volume.
pub fn menger(depth: u32) -> Volume {
    menger_within(depth, 0)
}

/// Returns [`menger`] with a `margin` of voxels outside around it.
pub fn menger_within(depth: u32, margin: u32) -> Volume {
    let solid = |mut x: u32, mut y: u32, mut z: u32| {
        // The largest holes are cut first.
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
    volume([81 + 2 * margin as usize; 3], |p| {
        let [x, y, z] = [p.x, p.y, p.z].map(|c| (c as u32).wrapping_sub(margin));
        if [x, y, z].iter().all(|&c| c < 81) { solid(x, y, z) } else { 0.0 }
    })
}

/// Returns the distance from `p` to the skeleton of [`chain`].
pub fn to_chain(p: Vec3) -> f32 {
    let centre = Vec3::from(chain_dims(16.0, 4.5, 2.0).map(|n| 0.5 * (n as f32 - 1.0)));
    to_linked_circles(p - centre, 16.0)
}

/// A vessel that branches into two, three times; in a volume of 64 × 64 × 72 voxels.
pub struct VesselTree {
    /// End points and radius of each branch.
    branches: Vec<(Vec3, Vec3, f32)>,
}

impl VesselTree {
    pub fn new() -> Self {
        let mut branches = vec![(Vec3::new(31.5, 31.5, 6.0), Vec3::new(31.5, 31.5, 22.0), 4.5)];
        let mut tips = branches.clone();
        for k in 0..3 {
            let sideways = if k % 2 == 0 { Vec3::X } else { Vec3::Y };
            let (spread, rise, radius) = ([13.0, 12.0, 6.5][k], [15.0, 14.0, 11.0][k], [3.6, 2.9, 2.3][k]);
            let grow = |&(_, tip, _): &(Vec3, Vec3, f32)| {
                [-1.0, 1.0].map(|side| (tip, tip + sideways * (side * spread) + Vec3::Z * rise, radius))
            };
            tips = tips.iter().flat_map(grow).collect();
            branches.extend(&tips);
        }
        Self { branches }
    }

    /// Returns the signed distance from `p` to the surface, negative inside.
    pub fn distance(&self, p: Vec3) -> f32 {
        let to_branch = |&(a, b, radius): &(Vec3, Vec3, f32)| to_segment(p, a, b) - radius;
        self.branches.iter().map(to_branch).fold(f32::INFINITY, f32::min)
    }

    /// Returns a volume whose intensity falls from 1 to 0 over four voxels across the surface, which is at 0.5.
    pub fn volume(&self) -> Volume {
        volume([64, 64, 72], |p| (0.5 - 0.25 * self.distance(p)).clamp(0.0, 1.0))
    }
}

/// Returns a head of 256 × 256 × 68 voxels: two nested shells six voxels thick, with holes through them, in noise of
/// standard deviation 0.02. The surface is at 0.5.
pub fn head_phantom() -> Volume {
    let centre = Vec3::new(127.5, 127.5, 33.5);
    // The approximate distance to an ellipsoid.
    let to_ellipsoid = |q: Vec3, axes: Vec3| {
        let steepness = (q / (axes * axes)).length().max(1e-6);
        (q / axes).length() * ((q / axes).length() - 1.0) / steepness
    };
    let to_hole = |q: Vec3, x: f32, y: f32, radius: f32| Vec3::new(q.x - x, q.y - y, 0.0).length() - radius;
    let mut random = super::Random(1);
    let noise: Vec<f32> =
        (0..256 * 256 * 68).map(|_| (0..12).map(|_| random.unit()).sum::<f32>() - 6.0).collect();
    volume([256, 256, 68], |p| {
        let q = p - centre;
        let shell = |axes: Vec3| to_ellipsoid(q, axes).abs() - 3.0;
        let shells = shell(Vec3::new(112.0, 120.0, 29.0)).min(shell(Vec3::new(84.0, 92.0, 14.5)));
        let holes = [(40.0, 20.0, 9.0), (-50.0, -30.0, 7.0), (10.0, -60.0, 12.0)];
        let above = holes.into_iter().map(|(x, y, radius)| to_hole(q, x, y, radius));
        let hole = if q.z > 0.0 { above.fold(f32::INFINITY, f32::min) } else { f32::INFINITY };
        let at = p.x as usize + 256 * (p.y as usize + 256 * p.z as usize);
        (0.5 - 0.25 * shells.max(-hole)).clamp(0.0, 1.0) + 0.02 * noise[at]
    })
}
