//! Steps in slices, which can be given up in the middle.
//!
//! A copy of the whole state before each step would make steps in which little moves several times as long. So the state is
//! copied now and then, once the steps since the last copy have done much more work than a copy takes. Where a step is given
//! up, the model is set back to the copy, and makes the steps again that had ended since; they have the same bits. That is
//! not interrupted, so it must not be much work.

use super::DeformableModel;
use super::motion::{Motion, SpeedSummary};
use super::schedule::Convergence;
use crate::mesh::Mesh;
use crate::methods::{MethodError, StepReport};
use crate::pauses::{Pauses, finished};
use crate::remesh::{Changes, Pending, Resolver};

/// The work, in units, after which the state is copied again, at least: about ten milliseconds, and per vertex. A copy takes
/// about a hundredth of a unit per vertex. With less work, copies take a larger share of the time; with more, steps that are
/// made again take longer.
const LEAST_WORK: f64 = 4000.0;
const WORK_PER_VERTEX: f64 = 0.2;

/// The state before a step, and what has been done since.
#[derive(Clone, Debug)]
pub(super) struct Checkpoint {
    mesh: Mesh,
    progress: Progress,
    /// The number of steps that have ended since, and their work.
    steps: u32,
    work: u64,
}

/// The state of a run that steps change, without the mesh.
#[derive(Clone, Debug)]
pub(super) struct Progress {
    waiting: Pending,
    level: usize,
    level_iso: f32,
    image_force_factor: f32,
    needs_factor: bool,
    iteration: u32,
    convergence: Convergence,
    speed: SpeedSummary,
    components: u32,
    refreshed: Changes,
}

impl DeformableModel {
    /// Makes one step as [`Self::step`] does, bit for bit, in [slices](crate::pauses). Where the future is dropped in the
    /// middle, the model must not be used before [`Self::discard_step`].
    ///
    /// # Errors
    /// As [`Self::step`].
    pub async fn step_in_slices(&mut self) -> Result<StepReport, MethodError> {
        if self.is_done() {
            return self.step();
        }
        let pauses = Pauses::default();
        if let Some(levels) = self.pyramid.sparse.clone() {
            return self.step_if_loaded_in_slices(&levels, &pauses).await;
        }
        let mut checkpoint = self.next_checkpoint();
        checkpoint.steps += 1;
        self.checkpoint = Some(checkpoint);
        let report = self.iterate(&pauses).await;
        match (&report, &mut self.checkpoint) {
            (Ok(report), Some(checkpoint)) if !report.done => checkpoint.work += pauses.work(),
            _ => self.checkpoint = None,
        }
        report
    }

    /// Sets the model back to the end of the last step, after the future of [`Self::step_in_slices`] was dropped in the
    /// middle.
    pub fn discard_step(&mut self) {
        self.discard_sparse_step();
        let Some(checkpoint) = self.checkpoint.take() else { return };
        let Checkpoint { mesh, progress, steps, .. } = *checkpoint;
        let replaced = std::mem::replace(&mut self.mesh, mesh);
        self.mesh.advance_versions_past(&replaced);
        self.drop_caches();
        self.set_back_progress(progress);
        // The last one is the one that was given up; the others cannot fail, since they did not.
        for _ in 1..steps {
            finished(self.iterate(&Pauses::default())).ok();
        }
    }

    /// Drops the caches of the mesh, whose state is set back.
    pub(super) fn drop_caches(&mut self) {
        self.resolver = Resolver::with_max_vertices(self.resolver.max_vertices());
        self.watch_output();
        self.motion = Motion::default();
    }

    /// Returns the present state, or the last copy if little has been done since.
    fn next_checkpoint(&mut self) -> Box<Checkpoint> {
        let most = LEAST_WORK.max(WORK_PER_VERTEX * self.mesh.vertex_count() as f64);
        match self.checkpoint.take().filter(|last| (last.work as f64) < most) {
            Some(last) => last,
            None => Box::new(Checkpoint {
                mesh: self.mesh.clone(),
                progress: self.progress_so_far(),
                steps: 0,
                work: 0,
            }),
        }
    }

    pub(super) fn progress_so_far(&self) -> Progress {
        Progress {
            waiting: self.resolver.pending(),
            level: self.level,
            level_iso: self.level_iso,
            image_force_factor: self.image_force_factor,
            needs_factor: self.needs_factor,
            iteration: self.iteration,
            convergence: self.convergence,
            speed: self.speed,
            components: self.components,
            refreshed: self.refreshed,
        }
    }

    pub(super) fn set_back_progress(&mut self, progress: Progress) {
        self.resolver.set_pending(progress.waiting);
        self.level = progress.level;
        self.level_iso = progress.level_iso;
        self.image_force_factor = progress.image_force_factor;
        self.needs_factor = progress.needs_factor;
        self.iteration = progress.iteration;
        self.convergence = progress.convergence;
        self.speed = progress.speed;
        self.components = progress.components;
        self.refreshed = progress.refreshed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3};
    use crate::methods::deformable::{DeformableOptions, DeformableParams, Seeding};
    use crate::pauses::advance;
    use crate::volume::{Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const SIDE: usize = 20;

    /// Returns a model of a noisy ball on two levels, which is edited and seeded in many steps.
    fn model() -> DeformableModel {
        let mut random = Random::new(3);
        let at = |k: usize| Vec3::new((k % SIDE) as f32, (k / SIDE % SIDE) as f32, (k / SIDE / SIDE) as f32);
        let value = |p: Vec3| 0.5 + 0.15 * (6.0 - (p - 0.5 * (SIDE as f32 - 1.0)).length());
        let noisy = |k: usize| (value(at(k)) + 1.2 * (random.unit() as f32 - 0.5)).clamp(0.0, 1.0);
        let voxels = Voxels::F32((0..SIDE.pow(3)).map(noisy).collect());
        let volume = Volume::new(VolumeInit::new(voxels, [SIDE, SIDE, SIDE, 1])).unwrap();
        let params = DeformableParams {
            iso: 0.5,
            smallest_part: 0.0,
            seeding: Seeding::On,
            ..DeformableParams::for_volume(&volume)
        };
        let options = DeformableOptions { levels: 1, params: Some(params), ..Default::default() };
        DeformableModel::new(&volume, options).unwrap()
    }

    /// Makes slices of a step, at most `most`; returns its report if it ends.
    fn slices(model: &mut DeformableModel, most: usize) -> Option<StepReport> {
        let mut step = Box::pin(model.step_in_slices());
        for _ in 0..most {
            if let std::task::Poll::Ready(report) = advance(&mut step) {
                return Some(report.unwrap());
            }
        }
        None
    }

    #[test]
    fn steps_in_slices_have_the_same_bits_also_after_some_were_given_up() {
        let (mut expected, mut model) = (model(), model());
        let (mut given_up, mut step) = (0, 0);
        loop {
            // Given up after another number of slices at each step, also at the ends of levels.
            let before = model.save();
            for most in [1, 3 + step % 40] {
                if let Some(report) = slices(&mut model, most) {
                    // It was shorter than that: made again from the state before.
                    assert_eq!(report.iteration, expected.iteration + 1);
                    model.restore(&before).unwrap();
                    break;
                }
                model.discard_step();
                given_up += 1;
                assert_eq!(model.mesh.check(), Ok(()));
                assert!(model.save() == before, "step {step}");
            }
            let report = slices(&mut model, usize::MAX).unwrap();
            let same = expected.step().unwrap();
            assert_eq!(
                (report.vertices, report.events, report.done),
                (same.vertices, same.events, same.done)
            );
            assert!(model.save() == expected.save(), "step {step}");
            step += 1;
            if report.done || step == 150 {
                break;
            }
        }
        assert!(given_up > 30, "{given_up} steps were given up");
    }

    /// Giving a step up is not interrupted.
    #[test]
    fn the_steps_since_the_last_copy_are_little_work() {
        let mut model = model();
        let (mut steps, mut made_again) = (0, 0);
        while steps < 60 && slices(&mut model, usize::MAX).is_some_and(|report| !report.done) {
            assert!(slices(&mut model, 1).is_none());
            let Some(checkpoint) = &model.checkpoint else { panic!("a step is under way") };
            let most = 4500.0 + 0.25 * model.mesh.vertex_count() as f64;
            assert!((checkpoint.work as f64) < most, "{} units, {steps} steps", checkpoint.work);
            made_again += checkpoint.steps - 1;
            model.discard_step();
            steps += 1;
        }
        assert!(steps > 20 && made_again > 0, "{steps} steps, {made_again} made again");
    }

    /// Several steps are made again after one was given up, and none of those before a change of the model.
    #[test]
    fn steps_since_the_last_copy_are_made_again() {
        let mut model = model();
        for _ in 0..3 {
            slices(&mut model, usize::MAX).unwrap();
        }
        // As if no step had been much work.
        let mut made_again = 0;
        for _ in 0..4 {
            if let Some(checkpoint) = &mut model.checkpoint {
                checkpoint.work = 0;
            }
            slices(&mut model, usize::MAX).unwrap();
            let before = model.save();
            if let Some(checkpoint) = &mut model.checkpoint {
                checkpoint.work = 0;
            }
            assert!(slices(&mut model, 1).is_none());
            made_again = made_again.max(model.checkpoint.as_ref().map_or(0, |checkpoint| checkpoint.steps));
            model.discard_step();
            assert!(model.save() == before);
        }
        assert!(made_again > 1, "{made_again}");
        model.set_params(DeformableParams { rigidity: 0.3, ..model.params.clone() }).unwrap();
        assert!(model.checkpoint.is_none());
        model.discard_step();
        assert_eq!(model.params.rigidity, 0.3);
    }
}
