//! What is different on the coarse levels of the pyramid: they need not be right, they need to be near, and soon.

use super::image::Pyramid;
use super::{DeformableParams, Integrator};

/// How far outside π_I the surface settles on coarse levels of runs that do not seed, as a share of the way to the mean intensity out
/// there.
///
/// Right for images of two classes only: in a computed tomography all soft tissue then counts as bone. The mean next to the
/// boundary was tried instead; it loses 1.7 % of the area of a skull. Runs that seed have no margin: what a coarse level
/// loses comes back.
///
/// A wall thinner than the contact distance of a coarse level is pierced and eaten up, and rigidity keeps it from growing
/// back on a finer one. A little outside, where the blurred wall is thicker, it is kept; the finer level takes back what
/// is too much, since the surface comes from outside anyway. On computed tomographies the area found through one coarse
/// level was 1.2 % to 15 % too small with 0, and is up to 0.9 % off; with 0.4 and more the finest level has much to do.
const MARGIN: f32 = 0.35;

/// The most by which α_I is larger on coarse levels.
///
/// Where the image is hardly different from π_I, as in the soft tissue around bone, the surface creeps: with α_I as it is
/// it took 2,500 iterations of 3,000 to cross a head. What is stiffer at the end than the finest level wants is let go
/// there in a few iterations; area and volume come out the same within 0.1 %.
const MOST_GAIN: f32 = 8.0;

/// The rigidity that is left on coarse levels, in α_I there. With less, the surface is drawn into holes that a coarse mesh
/// cannot follow, and splits and merges there for ever.
const LEAST_RIGIDITY: f32 = 0.025;

/// The most that the image's force may grow by in δ over δ where the image is steep, in what one step of time takes to
/// turn round. With more it swings.
const MOST_STIFFNESS: f32 = 1.0;

/// How steep the image is at least where it passes π_I, in its range a voxel. A few voxels that are brighter than all others by far
/// make the object faint; rigidity would then pull the surface off its contour, slowly. Computed tomographies have 0.1 to 0.6.
const LEAST_STEEPNESS: f32 = 0.1;
const MOST_AMPLIFIED: f32 = 1e4;

/// Iterations of a level with the full gain, and those after which half of it is taken each time from then on. A head takes
/// 300. Where a vertex lies on an edge that is steeper than most, it swings for ever: a tooth did, at an intensity where the
/// model takes it to rest with a gain of 4.
const FULL: u32 = 600;
const HALVED: u32 = 100;

/// π_I as the surface meets it on this level, normalised.
pub(super) fn iso(pyramid: &Pyramid, params: &DeformableParams, level: usize) -> f32 {
    let iso = pyramid.normalised(params.iso);
    let outside =
        if level > 0 { pyramid.levels[level].mean_beyond(iso, params.iso_force > 0.0) } else { None };
    outside.map_or(iso, |outside| iso + MARGIN * (outside - iso))
}

/// By how much α_I is larger on this level, where π_I is `iso` and δ is `delta`.
pub(super) fn gain(
    pyramid: &Pyramid,
    params: &DeformableParams,
    level: usize,
    [iso, delta]: [f32; 2],
) -> f32 {
    if params.yields_to_image() && params.integrator == Integrator::Implicit {
        let steepness = pyramid.levels[level].ordinary_steepness(iso);
        return if steepness > 0.0 { (LEAST_STEEPNESS / steepness).clamp(1.0, MOST_AMPLIFIED) } else { 1.0 };
    }
    if level == 0 || params.iso_force == 0.0 || params.integrator == Integrator::Implicit {
        return 1.0;
    }
    let stiffness = params.iso_force.abs() as f32 * delta * pyramid.levels[level].steepness(iso);
    let turned = MOST_STIFFNESS * (params.mass / (params.time_step * params.time_step)) as f32;
    let rigid = params.rigidity as f32 / LEAST_RIGIDITY;
    [turned / stiffness, rigid].into_iter().fold(MOST_GAIN, f32::min).max(1.0)
}

/// What is left of the gain of a level after so many iterations there.
pub(super) fn left_of(gain: f32, iterations: u32) -> f32 {
    let times = iterations.saturating_sub(FULL).div_ceil(HALVED);
    // None is left long before numbers end.
    (0..times.min(8)).fold(gain, |gain, _| 0.5 * gain).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::volume::{Space, Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// A ramp along x from 0 to 1, in `steps`.
    fn ramp(steps: f32) -> Pyramid {
        let value = |i: usize| ((i % 40) as f32 / 39.0 * steps).round_ties_even() / steps;
        let volume = Volume::new(VolumeInit {
            voxels: Voxels::F32((0..40 * 40 * 40).map(value).collect()),
            dims: [40, 40, 40, 1],
            affine: DAffine3::IDENTITY,
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: 0.0,
            space: Space::Ras,
        });
        Pyramid::new(&volume.unwrap(), 0, 1).unwrap()
    }

    fn params(iso_force: f64, rigidity: f64) -> DeformableParams {
        DeformableParams {
            iso: 0.5,
            iso_force,
            rigidity,
            integrator: Integrator::Euler,
            ..DeformableParams::default()
        }
    }

    #[test]
    fn coarse_levels_rest_outside_and_the_finest_where_it_is_told() {
        let pyramid = ramp(39.0);
        for (force, sign) in [(-1.0, -1.0), (1.0, 1.0)] {
            let [finest, coarse] = [0, 1].map(|level| iso(&pyramid, &params(force, 0.2), level));
            assert_eq!(finest, 0.5);
            assert!((coarse - 0.5 - sign * 0.25 * MARGIN).abs() < 0.01, "{coarse}");
        }
    }

    #[test]
    fn a_level_that_takes_long_loses_its_gain() {
        let left = |iterations| left_of(MOST_GAIN, iterations);
        assert_eq!([0, FULL, FULL + 1, FULL + HALVED + 1].map(left), [8.0, 8.0, 4.0, 2.0]);
        assert_eq!([FULL + 10 * HALVED, u32::MAX].map(left), [1.0, 1.0]);
        assert_eq!(left_of(1.0, u32::MAX), 1.0);
    }

    #[test]
    fn the_gain_is_for_coarse_levels_faint_images_and_rigid_surfaces() {
        let (faint, steep) = (ramp(39.0), ramp(1.0));
        let of = |pyramid, force, rigidity, level| gain(pyramid, &params(force, rigidity), level, [0.5, 1.5]);
        assert_eq!(of(&faint, -1.0, 0.2, 1), MOST_GAIN);
        assert_eq!(of(&faint, -1.0, 0.2, 0), 1.0);
        assert_eq!(of(&faint, 0.0, 0.2, 1), 1.0);
        assert!((of(&faint, -1.0, 0.1, 1) - 4.0).abs() < 1e-5);
        assert_eq!(of(&faint, -1.0, 0.0, 1), 1.0);
        let held = of(&steep, -1.0, 0.4, 1);
        assert!((1.0..0.6 * MOST_GAIN).contains(&held), "{held}");
        assert!(of(&steep, -5.0, 0.4, 1) < 0.3 * held.max(4.0));
    }
}
