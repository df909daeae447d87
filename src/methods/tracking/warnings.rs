//! What a user should know about a tracked sequence: frames in which the object ends or begins, and those in which its
//! surface is uncertain.

use super::SurfaceTracker;
use super::region::Region;
use crate::mesh::TriangleMesh;
use crate::warning::{Place, Warning, WarningCode};

/// Largest accepted ratio of the intensity step at the surface in a frame of the windows to that in their own. The level
/// between bright and dark is that of the window: at this ratio it is at three quarters of the smaller step instead of
/// half, a quarter of a voxel off where the image is blurred by one. Steps in cine sequences differ by a fifth at most.
const MAX_STEP_RATIO: f64 = 1.5;

/// Radius of a ball with the volume of the object, in units of the radius of the plane fits, below which its volume is
/// uncertain: planes fitted to half of a ball and more do not show its curvature. At this radius errors are 5 %.
const SMALL: f64 = 1.4;

impl SurfaceTracker {
    /// Returns what a user should know about the frames tracked so far, in their order.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        for frame in 0..self.meshes.len() {
            let before = match frame.checked_sub(1) {
                Some(before) => self.has_object(before),
                None => self.start.vertex_count() > 0,
            };
            let (is_there, is_lost) = (self.has_object(frame), self.lost.contains(&(frame as u32)));
            if before && (!is_there || is_lost) {
                warnings.push(ends(frame));
            }
            if is_there && frame > 0 && (!before || is_lost) {
                warnings.push(begins(frame));
            }
            if is_there {
                // Steps at the surface of a small object are not those of its boundary.
                warnings.extend(self.small_object(frame).or_else(|| self.uneven_brightness(frame)));
            }
        }
        warnings.extend(self.cycle_warning());
        warnings
    }

    fn has_object(&self, frame: usize) -> bool {
        !self.meshes[frame].triangles.is_empty()
    }

    /// Returns the warning about the first frame of a cyclic sequence, which follows the last, once the run is done.
    fn cycle_warning(&self) -> Option<Warning> {
        self.cycle_closure_error?;
        let last = self.meshes.len().checked_sub(1)?;
        match [self.has_object(last), self.has_object(0)] {
            [true, false] => Some(ends(0)),
            [false, true] => Some(begins(0)),
            _ => None,
        }
    }

    /// Returns a warning if the intensity step at the surface is much smaller than that in another frame of the windows.
    fn uneven_brightness(&self, frame: usize) -> Option<Warning> {
        let step = self.steps_at_surface[frame];
        let near = self.voting.window().frames_around(frame, self.frames());
        let others = near.iter().filter_map(|&t| self.steps_at_surface.get(t));
        let ratio = others.fold(0.0, |most: f64, other| most.max(other / step));
        (step > 0.0 && ratio > MAX_STEP_RATIO).then(|| {
            let text = format!(
                "the intensity step at the surface is {ratio:.1} times as large in a frame nearby, so the surface may be \
                 off; equalise the brightness of the frames, or set windowFrames to 0"
            );
            Warning::at(WarningCode::UnevenBrightness, Place::Frame(frame as u32), text)
        })
    }

    /// Returns a warning if the object is too small for the radius of the plane fits.
    fn small_object(&self, frame: usize) -> Option<Warning> {
        let volume = self.statistics[frame].volume.max(0.0);
        let radius = libm::cbrt(volume * 0.75 / std::f64::consts::PI);
        (radius < SMALL * self.params.radius).then(|| {
            let text = format!(
                "the object is as large as a ball of radius {radius:.3e}, too small for plane fits of radius {:.3e}, so \
                 its volume is uncertain",
                self.params.radius
            );
            Warning::at(WarningCode::SmallObject, Place::Frame(frame as u32), text)
        })
    }

    /// Returns the mean intensity step at the surface of a frame tracked so far, see [`step_at_surface`].
    pub(super) fn measured_step(&self, frame: usize) -> f64 {
        let mut mesh = self.meshes[frame].clone();
        mesh.positions.iter_mut().for_each(|p| *p *= self.region.space.scale as f32);
        step_at_surface(&self.region, frame, &mesh)
    }
}

/// Returns the mean fall of intensity from one voxel inside a surface, given in the working space, to one voxel outside, in
/// steps of the quantised intensities; vertices at which it rises, or beyond the box, are left out. 0 without others.
fn step_at_surface(region: &Region, frame: usize, mesh: &TriangleMesh) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (p, normal) in mesh.positions.iter().zip(mesh.vertex_normals()) {
        let (at, out) = (region.to_local(*p), region.from_space.transform_vector3(normal.as_dvec3()));
        let out = out.normalize_or_zero() * region.spacing.min_element();
        if region.clamp_into_box(at + out).is_some() {
            continue;
        }
        let step = region.sample(frame, at - out) - region.sample(frame, at + out);
        if step > 0.0 {
            (sum, count) = (sum + step, count + 1.0);
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

fn ends(frame: usize) -> Warning {
    let text = "the surface ends: the image has no boundary of the object here; it is gone, too small, or has moved too far";
    Warning::at(WarningCode::EndsInFrame, Place::Frame(frame as u32), text)
}

fn begins(frame: usize) -> Warning {
    let text = "a surface begins: in the frame before, the image had no such object, or one too small";
    Warning::at(WarningCode::BeginsInFrame, Place::Frame(frame as u32), text)
}
