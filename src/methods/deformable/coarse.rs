//! Adjustments of the iso value π_I and of α_I, the strength of the image force, on coarse levels of the image pyramid,
//! which need a surface near the result quickly, not an exact one; and the amplification of α_I in faint images.

use super::image::Pyramid;
use super::{DeformableParams, Integrator};
use crate::pauses::Pauses;

/// The offset of the iso value from π_I towards the background, on coarse pyramid levels of runs that do not seed
/// missing parts, as a share of the difference between π_I and the mean intensity of the background.
///
/// A wall thinner than the contact distance of a coarse level is pierced and eroded from the hole, and rigidity keeps
/// it from growing back on a finer level. At an iso value nearer to the background the blurred wall is thicker and is
/// kept; the finer level removes the excess, since the surface comes from outside anyway. On computed tomographies the
/// area found through one coarse level was 1.2 % to 15 % too small without the offset, and is up to 0.9 % off with it;
/// with 0.4 and more the finest level takes many iterations.
///
/// The offset is right for images of two classes only: in a computed tomography all soft tissue then counts as bone.
/// The mean intensity next to the boundary was tried instead of that of all background; it loses 1.7 % of the area of a
/// skull. Runs that seed have no offset, since parts lost on a coarse level come back.
const MARGIN: f32 = 0.35;

/// The largest factor by which coarse pyramid levels multiply α_I, the strength of the image force, with
/// [`Integrator::Euler`] and [`Integrator::RungeKutta`].
///
/// Where the image hardly differs from the iso value π_I, as in the soft tissue around bone, the surface creeps: with
/// α_I unchanged it took 2,500 iterations of 3,000 to cross a head. The finest level undoes the effect of the factor in
/// a few iterations; area and volume of the result are the same within 0.1 %.
const MAX_GAIN: f32 = 8.0;

/// The smallest ratio of the rigidity α_c to the factor by which coarse pyramid levels multiply α_I, the strength of
/// the image force, with [`Integrator::Euler`] and [`Integrator::RungeKutta`]; it limits that factor, but not to less
/// than 1. With a smaller ratio, the surface is drawn into holes that a coarse mesh cannot follow, and splits and
/// merges there for ever.
const MIN_RIGIDITY: f32 = 0.025;

/// The largest stiffness of the amplified image force, its change over one voxel of the finest level where the image is
/// steep, in units of m/Δt², with m the mass of a vertex and Δt the time step. With more, the surface oscillates. It
/// limits the factor on α_I, the strength of the image force, on coarse pyramid levels with [`Integrator::Euler`] and
/// [`Integrator::RungeKutta`].
const MAX_STIFFNESS: f32 = 1.0;

/// The least steepness of the image at the iso value π_I: the difference between neighbouring voxels on opposite sides
/// of π_I, as a share of the volume's intensity range, per voxel of the finest level.
///
/// If the median of these differences is smaller, the image is faint, as when a few voxels are much brighter than all
/// others; rigidity would then pull the surface off its contour, slowly. In runs with the implicit integrator that
/// adapt to the image, α_I, the strength of the image force, is therefore amplified by the ratio of this value to the
/// median. Computed tomographies have 0.1 to 0.6.
const MIN_STEEPNESS: f32 = 0.1;
/// The largest factor by which α_I, the strength of the image force, is amplified in images fainter than
/// [`MIN_STEEPNESS`].
const MAX_AMPLIFICATION: f32 = 1e4;

/// The largest factor by which a pyramid level multiplies α_I, the strength of the image force; a bound for saved states.
pub(super) const MAX_FACTOR: f32 = if MAX_AMPLIFICATION > MAX_GAIN { MAX_AMPLIFICATION } else { MAX_GAIN };

/// The number of iterations for which a coarse pyramid level keeps its full factor on α_I, the strength of the image
/// force, with [`Integrator::Euler`] and [`Integrator::RungeKutta`]. A head takes 300. If the factor did not decay
/// after that, a vertex where the image is steeper than usual could oscillate for ever: one on a tooth did, at an iso
/// value at which the model converges with a factor of 4.
const FULL_GAIN_ITERATIONS: u32 = 600;
/// The number of iterations between halvings of the factor by which a coarse pyramid level multiplies α_I, the strength
/// of the image force; the first follows [`FULL_GAIN_ITERATIONS`].
const HALVING_ITERATIONS: u32 = 100;

/// Returns the iso value π_I, normalised to the volume's intensity range, that a pyramid level uses in runs without
/// seeding: on coarse levels it is moved by [`MARGIN`] towards the background. In all runs the enclosing start surface
/// is made around the voxels brighter than this value.
pub(super) fn iso(pyramid: &Pyramid, params: &DeformableParams, level: usize) -> f32 {
    let iso = pyramid.iso(params);
    let outside =
        if level > 0 { pyramid.levels[level].mean_beyond(iso, params.iso_force > 0.0) } else { None };
    outside.map_or(iso, |outside| iso + MARGIN * (outside - iso))
}

/// Returns the factor, at least 1, by which a pyramid level multiplies α_I, the strength of the image force; `iso` is
/// the normalised π_I of the level, `delta` its δ in voxels of the finest level. With the implicit integrator the
/// factor makes up for faint images on all levels if the model adapts to the image, and is 1 otherwise; with the others
/// it speeds up coarse levels, and is 1 on the finest. Pauses meanwhile.
pub(super) async fn gain(
    pyramid: &Pyramid,
    params: &DeformableParams,
    level: usize,
    [iso, delta]: [f32; 2],
    pauses: &Pauses,
) -> f32 {
    let image = &pyramid.levels[level];
    let steepness = if is_measured_by_median(params) {
        image.median_steepness(iso, pauses).await
    } else if is_sped_up(params, level) {
        image.steepness(iso, pauses).await
    } else {
        return 1.0;
    };
    factor(params, level, delta, &|| steepness)
}

/// Returns whether a level has a factor on α_I that speeds it up.
fn is_sped_up(params: &DeformableParams, level: usize) -> bool {
    level > 0 && params.iso_force != 0.0 && params.integrator != Integrator::Implicit
}

/// Returns whether the factor on α_I depends on the median of the steepness of the image, not on its root mean square.
fn is_measured_by_median(params: &DeformableParams) -> bool {
    params.adapts_to_image() && params.integrator == Integrator::Implicit
}

/// Returns the factor of [`gain`] for an image of the given steepness, which is measured only if it matters.
pub(super) fn factor(
    params: &DeformableParams,
    level: usize,
    delta: f32,
    steepness: &dyn Fn() -> f32,
) -> f32 {
    if is_measured_by_median(params) {
        let steepness = steepness();
        return if steepness > 0.0 { (MIN_STEEPNESS / steepness).clamp(1.0, MAX_AMPLIFICATION) } else { 1.0 };
    }
    if !is_sped_up(params, level) {
        return 1.0;
    }
    let stiffness = params.iso_force.abs() as f32 * delta * steepness();
    let by_stiffness = MAX_STIFFNESS * (params.mass / (params.time_step * params.time_step)) as f32;
    let by_rigidity = params.rigidity as f32 / MIN_RIGIDITY;
    [by_stiffness / stiffness, by_rigidity].into_iter().fold(MAX_GAIN, f32::min).max(1.0)
}

/// Returns the factor on α_I, the strength of the image force, that is left of a level's initial factor `gain` after a
/// number of iterations on that level, at least 1. It decays so that no vertex oscillates for ever; used with
/// [`Integrator::Euler`] and [`Integrator::RungeKutta`].
pub(super) fn decayed(gain: f32, iterations: u32) -> f32 {
    let times = iterations.saturating_sub(FULL_GAIN_ITERATIONS).div_ceil(HALVING_ITERATIONS);
    // Eight halvings reduce any gain up to 256 to 1.
    (0..times.min(8)).fold(gain, |gain, _| 0.5 * gain).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::pauses::finished;
    use crate::volume::{Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Makes the pyramid of a test image whose intensity rises along x from 0 to 1 in `steps` equal steps.
    fn ramp(steps: f32) -> Pyramid {
        let value = |i: usize| ((i % 40) as f32 / 39.0 * steps).round_ties_even() / steps;
        let volume = Volume::new(VolumeInit::new(
            Voxels::F32((0..40 * 40 * 40).map(value).collect()),
            [40, 40, 40, 1],
        ));
        Pyramid::new(&volume.unwrap(), 0, 1, &params(-1.0, 0.2)).unwrap()
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
    fn coarse_levels_settle_outside_and_the_finest_at_the_iso_value() {
        let pyramid = ramp(39.0);
        for (force, sign) in [(-1.0, -1.0), (1.0, 1.0)] {
            let [finest, coarse] = [0, 1].map(|level| iso(&pyramid, &params(force, 0.2), level));
            assert_eq!(finest, 0.5);
            assert!((coarse - 0.5 - sign * 0.25 * MARGIN).abs() < 0.01, "{coarse}");
        }
    }

    #[test]
    fn a_level_that_takes_long_loses_its_gain() {
        let left = |iterations| decayed(MAX_GAIN, iterations);
        assert_eq!(
            [
                0,
                FULL_GAIN_ITERATIONS,
                FULL_GAIN_ITERATIONS + 1,
                FULL_GAIN_ITERATIONS + HALVING_ITERATIONS + 1
            ]
            .map(left),
            [8.0, 8.0, 4.0, 2.0]
        );
        assert_eq!([FULL_GAIN_ITERATIONS + 10 * HALVING_ITERATIONS, u32::MAX].map(left), [1.0, 1.0]);
        assert_eq!(decayed(1.0, u32::MAX), 1.0);
    }

    #[test]
    fn the_gain_is_for_coarse_levels_faint_images_and_rigid_surfaces() {
        let (faint, steep) = (ramp(39.0), ramp(1.0));
        let of = |pyramid, force, rigidity, level| {
            let params = params(force, rigidity);
            finished(gain(pyramid, &params, level, [0.5, 1.5], &Pauses::default()))
        };
        assert_eq!(of(&faint, -1.0, 0.2, 1), MAX_GAIN);
        assert_eq!(of(&faint, -1.0, 0.2, 0), 1.0);
        assert_eq!(of(&faint, 0.0, 0.2, 1), 1.0);
        assert!((of(&faint, -1.0, 0.1, 1) - 4.0).abs() < 1e-5);
        assert_eq!(of(&faint, -1.0, 0.0, 1), 1.0);
        let held = of(&steep, -1.0, 0.4, 1);
        assert!((1.0..0.6 * MAX_GAIN).contains(&held), "{held}");
        assert!(of(&steep, -5.0, 0.4, 1) < 0.3 * held.max(4.0));
    }
}
