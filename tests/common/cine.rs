//! A beating ventricle with known geometry: a cavity with papillary muscles, as in cine MR.

#![allow(clippy::unwrap_used, reason = "the lints spare tests, but not their helpers")]

use super::Random;
use vesicle::math::{DAffine3, DVec3};
use vesicle::mesh::TriangleMesh;
use vesicle::volume::{Grid, Volume, VolumeInit, Voxels, marching_cubes};

/// Intensities before noise.
const BLOOD: f64 = 200.0;
const MUSCLE: f64 = 90.0;
const LUNG: f64 = 45.0;

/// Parameters of the synthetic 4D image.
#[derive(Clone, Copy)]
pub struct Cine {
    pub dims: [usize; 3],
    pub spacing: DVec3,
    pub frames: usize,
    /// Number of heart beats in all frames.
    pub beats: f64,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Half the length of the long axis in mm; all other lengths scale with it.
    pub size: f64,
    pub papillary: bool,
}

impl Cine {
    /// Returns parameters of the paper's size: 25 frames of 156 × 192 × 25 voxels.
    pub fn full() -> Self {
        let spacing = DVec3::new(1.67, 1.67, 5.0);
        Self {
            dims: [156, 192, 25],
            spacing,
            frames: 25,
            beats: 1.0,
            noise: 11.0,
            size: 42.0,
            papillary: true,
        }
    }

    /// Returns the same parameters with the first `frames` frames only.
    pub fn first(self, frames: usize) -> Self {
        Self { frames, beats: self.beats * frames as f64 / self.frames as f64, ..self }
    }

    /// Returns a small heart on few voxels, for fast tests.
    pub fn small() -> Self {
        let spacing = DVec3::new(2.0, 2.0, 2.0);
        Self { dims: [36, 36, 36], spacing, frames: 16, beats: 1.0, noise: 8.0, size: 24.0, papillary: false }
    }

    fn middle(&self) -> DVec3 {
        let [x, y, z] = self.dims.map(|n| (n - 1) as f64 / 2.0);
        DVec3::new(x, y, z) * self.spacing
    }

    /// Returns the contraction at a frame: 0 in diastole, 1 in systole.
    pub fn contraction(&self, frame: f64) -> f64 {
        let phase = frame * self.beats / self.frames as f64;
        let phase = phase - phase.floor();
        let rise = |x: f64| 0.5 - 0.5 * libm::cos(std::f64::consts::PI * x.clamp(0.0, 1.0));
        rise(phase / 0.35) - 0.92 * rise((phase - 0.35) / 0.3) - 0.08 * rise((phase - 0.65) / 0.35)
    }

    /// Returns approximate signed distances from `p`, in world units, to the cavity and to the heart, negative inside.
    fn distances(&self, p: DVec3, contraction: f64) -> (f64, f64) {
        let unit = self.size / 42.0;
        let p = (p - self.middle()) / unit;
        let (wide, long) = (25.0 * (1.0 - 0.34 * contraction), 42.0 * (1.0 - 0.1 * contraction));
        let base = 20.0 - 6.0 * contraction;
        let cavity = smooth_max(ellipsoid(p, DVec3::new(wide, wide, long)), p.z - base, 3.0);
        let (thick, muscle) = (9.0 + 4.0 * contraction, 3.0 * contraction);
        let outside = DVec3::new(wide + thick, wide + thick, long + thick - muscle);
        let heart = smooth_max(ellipsoid(p, outside), p.z - base - 4.0, 3.0);
        let cavity = if self.papillary {
            [0.7, 3.0].iter().fold(cavity, |d, &angle| {
                // Away from the wall except at its base; the gap closes in systole.
                let away = wide - 9.0 + 4.5 * contraction;
                let at = DVec3::new(away * libm::cos(angle), away * libm::sin(angle), -12.0);
                let muscle = ellipsoid(p - at, DVec3::new(5.0, 5.0, 18.0));
                smooth_max(d, -muscle, 2.0)
            })
        } else {
            cavity
        };
        (cavity * unit, heart * unit)
    }

    /// Returns the intensity of a voxel before noise; edges are blurred over one voxel.
    fn clean(&self, at: [usize; 3], contraction: f64) -> f64 {
        let p = DVec3::from(at.map(|i| i as f64)) * self.spacing;
        let shade = |p: DVec3| {
            let (cavity, heart) = self.distances(p, contraction);
            let share = |d: f64| (0.5 - d / self.spacing.x).clamp(0.0, 1.0);
            let around = LUNG + (MUSCLE - LUNG) * share(heart);
            around + (BLOOD - around) * share(cavity)
        };
        let (cavity, heart) = self.distances(p, contraction);
        if cavity.abs().min(heart.abs()) > self.spacing.max_element() {
            return shade(p);
        }
        // Slices are thick, so the intensity is averaged over their height.
        let steps = 5;
        let along = |k: usize| DVec3::Z * self.spacing.z * ((k as f64 + 0.5) / f64::from(steps) - 0.5);
        (0..steps as usize).map(|k| shade(p + along(k))).sum::<f64>() / f64::from(steps)
    }

    /// Returns the volume; noise-free if `noise` is 0.
    pub fn volume(&self) -> Volume {
        let mut random = Random(17);
        let [nx, ny, nz] = self.dims;
        let mut values = Vec::with_capacity(nx * ny * nz * self.frames);
        for frame in 0..self.frames {
            let contraction = self.contraction(frame as f64);
            for i in 0..nx * ny * nz {
                let clean = self.clean([i % nx, i / nx % ny, i / (nx * ny)], contraction);
                // Rician noise, as in MR magnitude images.
                let (a, b) = (clean + self.noise * normal(&mut random), self.noise * normal(&mut random));
                values.push(libm::hypot(a, b).round().clamp(0.0, 255.0) as u8);
            }
        }
        Volume::new(VolumeInit {
            affine: DAffine3::from_scale(self.spacing),
            frame_seconds: 0.04,
            ..VolumeInit::new(Voxels::U8(values), [nx, ny, nz, self.frames])
        })
        .unwrap()
    }

    /// Returns a box around the cavity in all frames, in world units.
    pub fn cavity_box(&self) -> [DVec3; 2] {
        let unit = self.size / 42.0;
        let reach = DVec3::new(33.0, 33.0, 50.0) * unit;
        [self.middle() - reach, self.middle() + DVec3::new(reach.x, reach.y, 30.0 * unit)]
    }

    /// Returns the true surface of the cavity at a frame, with edges of about `step` mm.
    pub fn truth(&self, frame: f64, step: f64) -> TriangleMesh {
        let [low, high] = self.cavity_box();
        let dims = [0, 1, 2].map(|k| ((high[k] - low[k]) / step) as usize + 2);
        let contraction = self.contraction(frame);
        let at = |i: usize| {
            let index = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            low + DVec3::from(index.map(|i| i as f64)) * step
        };
        let values =
            (0..dims.iter().product()).map(|i| -self.distances(at(i), contraction).0 as f32).collect();
        let mut mesh = marching_cubes(&Grid::new(dims, values).unwrap(), 0.0).unwrap();
        for p in &mut mesh.positions {
            *p = (low + p.as_dvec3() * step).as_vec3();
        }
        mesh
    }
}

fn ellipsoid(p: DVec3, axes: DVec3) -> f64 {
    let (unit, gradient) = ((p / axes).length(), (p / (axes * axes)).length());
    if gradient > 0.0 { unit * (unit - 1.0) / gradient } else { -axes.min_element() }
}

/// Returns the maximum of two values, smoothed where they are nearly equal.
fn smooth_max(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.max(b) + h * h * width * 0.25
}

fn normal(random: &mut Random) -> f64 {
    let (a, b) = (f64::from(random.unit()).max(1e-9), f64::from(random.unit()));
    libm::sqrt(-2.0 * libm::log(a)) * libm::cos(2.0 * std::f64::consts::PI * b)
}
