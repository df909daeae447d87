//! Stores of large volumes whose voxels are computed when they are asked for.

use vesicle::math::{DAffine3, DVec3, Vec3};
use vesicle::volume::{BrickBox, SparseInit, SparseLevel, SparseVolume, Voxels};

/// A cube of voxels with a pyramid by factors of 2, of an object given by its distance function.
pub struct Store {
    pub levels: Vec<SparseLevel>,
    /// The distance of a point outside the object, negative inside, in voxels of the finest level.
    pub distance: Box<dyn Fn(Vec3) -> f32 + Send + Sync>,
}

/// The intensity of the object; that of the background is 0, and its boundary is at half of it.
pub const OBJECT: f32 = 1000.0;

impl Store {
    pub fn new(side: usize, count: u32, distance: impl Fn(Vec3) -> f32 + Send + Sync + 'static) -> Self {
        let level = |k: u32| {
            let voxel = f64::from(1 << k);
            let affine = DAffine3::from_scale(DVec3::splat(voxel));
            let translation = DVec3::splat(0.5 * (voxel - 1.0));
            SparseLevel { dims: [side >> k; 3], affine: DAffine3 { translation, ..affine } }
        };
        Self { levels: (0..count).map(level).collect(), distance: Box::new(distance) }
    }

    /// Returns the volume with its coarsest level loaded.
    pub fn volume(&self) -> SparseVolume {
        let volume = SparseVolume::new(SparseInit {
            levels: self.levels.clone(),
            range: [0.0, f64::from(OBJECT)],
            fill: Voxels::U16(vec![0]),
        })
        .unwrap();
        self.load(&volume, &volume.missing(self.levels.len() - 1).unwrap());
        volume
    }

    /// Inserts the voxels of some boxes.
    pub fn load(&self, volume: &SparseVolume, boxes: &[BrickBox]) {
        boxes.iter().for_each(|&at| volume.insert(at, &self.voxels(at)).unwrap());
    }

    pub fn voxels(&self, at: BrickBox) -> Voxels {
        let to_finest = self.levels[at.level].affine;
        let per_voxel = 0.25 / to_finest.matrix3.x_axis.x as f32;
        let [nx, ny, nz] = at.region.dims;
        let value = |k: usize| {
            let offset = [k % nx, k / nx % ny, k / nx / ny];
            let index = DVec3::from([0, 1, 2].map(|axis| (at.region.min[axis] + offset[axis]) as f64));
            let distance = (self.distance)(to_finest.transform_point3(index).as_vec3());
            (OBJECT * (0.5 - per_voxel * distance).clamp(0.0, 1.0)) as u16
        };
        Voxels::U16((0..nx * ny * nz).map(value).collect())
    }
}

/// Returns the distance from a segment.
fn to_segment(p: Vec3, [a, b]: [Vec3; 2]) -> f32 {
    let (ab, ap) = (b - a, p - a);
    ap.distance(ab * (ap.dot(ab) / ab.length_squared()).clamp(0.0, 1.0))
}

/// Returns the distance function of a ball with a cavity in a cube of voxels, from which branches grow that branch again.
pub fn branching(side: usize) -> impl Fn(Vec3) -> f32 {
    let unit = side as f32;
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * unit;
    let segments = [
        ([at(0.35, 0.4, 0.4), at(0.7, 0.5, 0.45)], 0.030),
        ([at(0.7, 0.5, 0.45), at(0.85, 0.7, 0.6)], 0.020),
        ([at(0.7, 0.5, 0.45), at(0.86, 0.4, 0.3)], 0.020),
        ([at(0.85, 0.7, 0.6), at(0.8, 0.88, 0.75)], 0.014),
        ([at(0.85, 0.7, 0.6), at(0.93, 0.8, 0.5)], 0.014),
        ([at(0.35, 0.4, 0.4), at(0.3, 0.75, 0.7)], 0.025),
        ([at(0.3, 0.75, 0.7), at(0.15, 0.9, 0.85)], 0.016),
        ([at(0.3, 0.75, 0.7), at(0.5, 0.85, 0.9)], 0.016),
    ];
    let centre = at(0.35, 0.4, 0.4);
    move |p| {
        let ball = p.distance(centre) - 0.14 * unit;
        let branches = segments
            .iter()
            .fold(ball, |least, (ends, radius)| least.min(to_segment(p, *ends) - radius * unit));
        branches.max(0.06 * unit - p.distance(centre))
    }
}
