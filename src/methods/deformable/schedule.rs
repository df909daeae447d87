//! Convergence of a pyramid level, and the descent to the next finer one (section 5.1, figures 12 and 13).

use super::image::REDUCTION;
use super::renewal::Renewal;
use super::{DeformableModel, DeformableParams, Integrator, Topology, image_guide};
use crate::mesh::VertexId;
use crate::methods::{MethodError, Times};
use crate::pauses::Pauses;
use crate::remesh::{Changes, Sampling};
use serde::{Deserialize, Serialize};

/// The least number of quiet iterations in a row, those with energy and speed below their bounds, after which a pyramid
/// level has converged: a single one may be a turning point of an oscillation.
const QUIET_ITERATIONS: f64 = 3.0;

/// The least number of quiet iterations in a row, those with energy and speed below their bounds, after which a pyramid
/// level has converged with the implicit integrator, unless it began on its contour. Few suffice, since the speed of
/// the fastest vertex is bounded, too, and long steps are damped and do not oscillate.
const QUIET_LONG_STEPS: f64 = 2.0;

/// The largest number of quiet iterations in a row, those with energy and speed below their bounds, that convergence
/// requires, whatever the time step and the damping.
const MAX_QUIET_ITERATIONS: f64 = 500.0;

/// The largest speed of a vertex along its normal in a converged surface, in δ per unit of time. The mean energy hides
/// a few moving vertices, such as a front in a hole; without this bound the model would stop before the front has
/// passed.
const SETTLED_SPEED: f32 = 0.03;

/// The largest number of times that the finest level is searched for missing parts to add, so that the run comes to an
/// end.
const MAX_SEARCHES: u32 = 3;

/// The largest displacement of a vertex along its normal in one iteration of a converged surface, in δ; with long time
/// steps it is stricter than [`SETTLED_SPEED`].
const SETTLED_DISPLACEMENT: f32 = 0.1;

/// The number of removed vertices that count as a unit of work.
const REMOVED_PER_UNIT: usize = 64;

/// The state of convergence on the current pyramid level, which decides when the level ends; part of a saved run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Convergence {
    pub(super) quiet: u32,
    /// Whether the forces on all vertices, asleep or not, have been evaluated once since the surface was first quiet on
    /// this level, or since parts were seeded; a level ends only after that.
    pub(super) was_examined: bool,
    /// Whether the next iteration examines all vertices, asleep or not: it evaluates the forces on them, and wakes
    /// those that have not settled.
    pub(super) examine_next: bool,
    done: bool,
    /// The number of searches of the finest level for missing parts to add; [`MAX_SEARCHES`] once a search found none.
    searches: u32,
    /// Whether vertices have been given sizes, local factors on δ, by the curvature of this level's contour.
    pub(super) sized: bool,
    /// Whether the surface was on the contour of this level at its beginning, and neither parameters nor attractors
    /// have changed since; there are no moving fronts then, and the fastest vertex does not delay convergence.
    pub(super) began_on_contour: bool,
    /// The number of iterations of the run done before the current level began.
    pub(super) began: u32,
    /// The number of vertices that refreshes after changes of the volume have added or woken, if the rest of the surface
    /// had settled: only these decide on convergence, and the rest is not examined again. Otherwise 0.
    pub(super) refreshed: u32,
}

impl Convergence {
    /// Returns the state after a refresh of part of the surface. `count` is the number of vertices that it added or woke
    /// if nothing else may have to move; if it is `None`, missing parts are searched for again, and all vertices are
    /// examined before the run ends.
    pub(super) fn continued(self, count: Option<usize>) -> Self {
        let again = Self { quiet: 0, began_on_contour: false, done: false, ..self };
        match count {
            Some(count) => Self { refreshed: self.refreshed.saturating_add(count.max(1) as u32), ..again },
            None => Self { was_examined: false, searches: 0, refreshed: 0, ..again },
        }
    }
}

impl DeformableModel {
    pub(super) fn is_done(&self) -> bool {
        self.convergence.done
    }

    /// Returns the progress of the run from 0 to 1: the share of levels completed, and of the current one by the
    /// logarithm of the energy, from full speed to convergence. It may decrease when the surface starts moving again.
    pub(super) fn progress(&self) -> f64 {
        if self.convergence.done {
            return 1.0;
        }
        let DeformableParams { mass, max_move, energy_tolerance, .. } = self.params;
        let speed = max_move / self.params.step_length();
        let full = (0.5 * mass * speed * speed).max(2.0 * energy_tolerance);
        // At the beginning of a level the energy is still that of the level before.
        let energy = if self.iteration == self.convergence.began { full } else { self.energy() };
        let fraction = libm::log(full / energy.max(energy_tolerance)) / libm::log(full / energy_tolerance);
        let levels = self.pyramid.levels.len();
        ((levels - 1 - self.level) as f64 + fraction.clamp(0.0, 1.0)) / levels as f64
    }

    /// Returns the mean kinetic energy of the vertices along their normals, by which convergence is judged: of all
    /// vertices, or of those that refreshes have added or woken if the others had settled.
    pub(super) fn energy(&self) -> f64 {
        let (all, refreshed) = (self.mesh.vertex_count() as f64, f64::from(self.convergence.refreshed));
        let some =
            if self.followed_bounds().is_some() { self.followed_vertices().len() as f64 } else { refreshed };
        let is_local = some > 0.0 && some < all;
        if is_local { self.speed.energy * (all / some) } else { self.speed.energy }
    }

    /// Wakes all sleeping vertices and restarts convergence on the current level, after a change that may move any
    /// vertex, such as that of a parameter.
    pub(super) fn wake_all(&mut self) {
        self.mesh.scalar_mut(self.keys.still_iterations).fill(0.0);
        self.mesh.scalar_mut(self.keys.reversals).fill(0.0);
        self.convergence = Convergence { began: self.convergence.began, ..Convergence::default() };
    }

    /// Counts quiet iterations, those with energy and speed below their bounds. After enough of them it sets sizes and
    /// seeds missing parts on the finest level, examines all vertices, checks the whole mesh, and descends one level or
    /// ends the run. Returns the numbers of edits.
    pub(super) async fn update_convergence(
        &mut self,
        times: &mut Times,
        pauses: &Pauses,
    ) -> Result<Changes, MethodError> {
        let may_move = self.convergence.began_on_contour || self.leaves_fronts();
        let is_slow = may_move || self.speed.fastest < self.settled_speed();
        let quiet = is_slow && self.energy() < self.params.energy_tolerance;
        self.convergence.quiet = if quiet { self.convergence.quiet + 1 } else { 0 };
        if self.convergence.quiet < self.quiet_iterations() {
            return Ok(Changes::default());
        }
        if self.convergence.refreshed > 0 {
            self.convergence.refreshed = 0;
            self.convergence.done = true;
            return Ok(self.check_moved(times, pauses).await);
        }
        if self.level == 0 {
            let changes = self.size_and_seed(times, pauses).await?;
            if self.convergence.quiet == 0 {
                return Ok(changes);
            }
        }
        // Sleeping vertices may be pushed by others that have settled since.
        if !self.convergence.was_examined {
            self.convergence.quiet = 0;
            self.convergence.examine_next = true;
            self.convergence.was_examined = true;
            return Ok(Changes::default());
        }
        if self.level == 0 {
            self.balance_volumes(pauses).await?;
        }
        let mut changes = self.check_everything(times, pauses).await;
        if self.level == 0 {
            self.convergence.done = true;
            return Ok(changes);
        }
        changes += self.descend(times, pauses).await?;
        Ok(changes)
    }

    /// Sets the sizes of vertices, local factors on δ, on the finest level; if they are set already, seeds missing
    /// parts instead. If that changed anything, quiet iterations are counted anew. Edits wake only the vertices around
    /// them. Returns the numbers of edits.
    async fn size_and_seed(&mut self, times: &mut Times, pauses: &Pauses) -> Result<Changes, MethodError> {
        if self.set_sizes(pauses).await {
            self.convergence.quiet = 0;
            pauses.now().await;
            return Ok(self.check_everything(times, pauses).await);
        }
        if !self.seeds_levels() || self.convergence.searches == MAX_SEARCHES {
            return Ok(Changes::default());
        }
        let found = self.seed_missing(times, pauses).await?;
        self.convergence.searches += 1;
        if found.seeds > 0 {
            self.convergence.quiet = 0;
            self.convergence.was_examined = false;
        } else {
            self.convergence.searches = MAX_SEARCHES;
        }
        Ok(found)
    }

    /// Returns the speed along the normal, in δ per unit of time, below which the fastest vertex must be for
    /// convergence: [`SETTLED_SPEED`], or [`SETTLED_DISPLACEMENT`] per iteration if that is less.
    fn settled_speed(&self) -> f32 {
        let longest = SETTLED_DISPLACEMENT / self.params.step_length() as f32;
        if longest < SETTLED_SPEED { longest } else { SETTLED_SPEED }
    }

    /// Returns the number of quiet iterations in a row, those with energy and speed below their bounds, after which a
    /// level has converged: at least as many as the response time m/γ takes, but at most [`MAX_QUIET_ITERATIONS`]. A
    /// surface that has just begun to move is slow, too, without having converged.
    pub(super) fn quiet_iterations(&self) -> u32 {
        let DeformableParams { mass, damping, integrator, .. } = self.params;
        let is_settled = integrator == Integrator::Implicit && !self.convergence.began_on_contour;
        let least = if is_settled { QUIET_LONG_STEPS } else { QUIET_ITERATIONS };
        libm::ceil(mass / (damping * self.params.step_length())).clamp(least, MAX_QUIET_ITERATIONS) as u32
    }

    /// Restores edge bounds and resolves contacts around all vertices, and removes negligibly small components; does
    /// nothing if the topology is fixed. Returns the numbers of edits.
    pub(super) async fn check_everything(&mut self, times: &mut Times, pauses: &Pauses) -> Changes {
        if self.params.topology == Topology::Fixed {
            return Changes::default();
        }
        let all = self.followed_vertices();
        let mut changes = self.restore_bounds(&all, times, pauses).await;
        let sampling = self.sampling();
        let image = &self.pyramid.levels[self.level];
        let guide = image_guide::guide_within(image, self.level_iso, &self.params, self.followed_bounds());
        changes.vanished += self.resolver.remove_negligible(&mut self.mesh, sampling, &*guide, pauses).await;
        drop(guide);
        self.mark_checked();
        changes
    }

    /// Restores edge bounds and resolves contacts around the vertices that have moved since they were last checked, and
    /// removes negligibly small components; does nothing if the topology is fixed. Returns the numbers of edits.
    async fn check_moved(&mut self, times: &mut Times, pauses: &Pauses) -> Changes {
        if self.params.topology == Topology::Fixed {
            return Changes::default();
        }
        let checked = self.mesh.vector(self.keys.checked_position);
        let has_moved = |v: &VertexId| checked[v.index()] != self.mesh.position(*v);
        let moved: Vec<VertexId> = self.mesh.vertices().filter(has_moved).collect();
        let changes = self.restore_bounds(&moved, times, pauses).await;
        let (positions, checked) = self.mesh.positions_and_vector_mut(self.keys.checked_position);
        moved.iter().for_each(|v| checked[v.index()] = positions[v.index()]);
        changes
    }

    /// Refines the mesh and descends to the next finer level of the image pyramid (figure 13). In runs that seed,
    /// components that lack part of the finer contour are replaced by it; if that fails, missing parts are seeded
    /// instead. Returns the numbers of edits.
    async fn descend(&mut self, times: &mut Times, pauses: &Pauses) -> Result<Changes, MethodError> {
        let begin = (self.clock)();
        let renewal = if self.seeds_levels() { self.renewal(pauses).await? } else { Renewal::default() };
        pauses.now().await;
        let seeds = renewal.added.component_count() as u32;
        let is_renewed = seeds > 0 && self.try_to_renew(&renewal, pauses).await;
        times.add("renewal", (self.clock)() - begin);
        if is_renewed {
            return Ok(Changes { seeds, ..Changes::default() });
        }
        let room = if self.pyramid.is_sparse() { self.expected_below() } else { 0 };
        self.descend_refined(pauses).await?;
        pauses.now().await;
        self.resolver.reorder(&mut self.mesh, room);
        pauses.now().await;
        self.mark_checked();
        pauses.now().await;
        let mut changes = self.check_everything(times, pauses).await;
        if seeds > 0 {
            changes += self.seed_missing(times, pauses).await?;
        }
        Ok(changes)
    }

    /// Tries to descend one level by [`Self::descend_renewed`], and returns whether that succeeded; if not, mesh, level
    /// and pending vertices are restored.
    async fn try_to_renew(&mut self, renewal: &Renewal, pauses: &Pauses) -> bool {
        let (level, coarse, waiting) = (self.level, self.mesh.clone(), self.resolver.pending());
        let is_renewed = self.descend_renewed(renewal, pauses).await.is_ok();
        if !is_renewed {
            let failed = std::mem::replace(&mut self.mesh, coarse);
            self.mesh.advance_versions_past(&failed);
            self.resolver.set_pending(waiting);
            self.level = level;
        }
        is_renewed
    }

    /// Descends one level with some components of the mesh replaced by parts of the finer contour, and brings all edges
    /// within bounds like those of a start mesh.
    ///
    /// # Errors
    /// If there would be too many vertices, the result intersects itself, or memory does not suffice.
    async fn descend_renewed(&mut self, renewal: &Renewal, pauses: &Pauses) -> Result<(), MethodError> {
        for &v in &renewal.removed {
            let vertices = self.mesh.remove_component(v);
            pauses.after(1 + vertices / REMOVED_PER_UNIT).await;
        }
        pauses.now().await;
        self.descend_refined(pauses).await?;
        self.check_vertex_limit(&renewal.added)?;
        let added = self.mesh.append(&renewal.added)?;
        self.initialise_attributes(&added);
        pauses.now().await;
        self.resolve_contour(pauses).await?;
        self.mark_checked();
        Ok(())
    }

    async fn descend_refined(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        let before = self.model_delta();
        self.refine(pauses).await?;
        self.level -= 1;
        self.begin_sizes(before / self.model_delta());
        self.convergence.began = self.iteration;
        self.wake_all();
        self.prepare_level(pauses).await
    }

    async fn refine(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        let (times, most) = (self.refinements(), self.resolver.max_vertices());
        // Each adds a vertex to every triangle, and makes three of it.
        let new = (3u64.saturating_pow(times) - 1) / 2;
        let vertices = (self.mesh.vertex_count() as u64)
            .saturating_add(new.saturating_mul(self.mesh.triangle_count() as u64));
        if times > 0 && vertices > most as u64 {
            return Err(MethodError::TooManyVertices { most });
        }
        for round in 0..times {
            // If the mesh cannot be refined, edges that are too long on the finer level are split. The sampling affects the
            // speed and the memory of searches only.
            let shorter = libm::pow(REDUCTION, f64::from(round)) as f32;
            let sampling = Sampling::new(self.model_delta() / shorter);
            self.resolver.refine_in_slices(&mut self.mesh, sampling, pauses).await?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3};
    use crate::methods::deformable::DeformableOptions;
    use crate::volume::{Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn volume(n: usize, mut value: impl FnMut(Vec3) -> f32) -> Volume {
        let at = |k: usize| Vec3::new((k % n) as f32, (k / n % n) as f32, (k / n / n) as f32);
        Volume::new(VolumeInit::new(
            Voxels::F32((0..n * n * n).map(|k| value(at(k))).collect()),
            [n, n, n, 1],
        ))
        .unwrap()
    }

    /// Makes a model of a noisy ball on which single vertices keep moving long after the others have settled.
    fn model() -> DeformableModel {
        let mut random = Random::new(1);
        let volume = volume(32, |p| {
            let ball = 0.5 + 0.2 * (11.0 - (p - 15.5).length());
            (ball + 0.8 * (random.unit() as f32 - 0.5)).clamp(0.0, 1.0)
        });
        let params = DeformableParams { iso: 0.5, ..DeformableParams::for_volume(&volume) };
        let options = DeformableOptions { params: Some(params), ..Default::default() };
        DeformableModel::new(&volume, options).unwrap()
    }

    /// Without a contour a run starts from the enclosing surface, whose fronts have far to move, so its fastest vertex
    /// must delay convergence.
    #[test]
    fn only_a_start_on_the_contour_begins_on_it() {
        let speck = volume(32, |p| if (p - 15.5).length() < 2.0 { 1.0 } else { 0.0 });
        for (iso, on_contour) in [(0.9, false), (0.05, true)] {
            let params =
                DeformableParams { iso, smallest_part: 0.0, ..DeformableParams::as_published(&speck) };
            let options = DeformableOptions { levels: 2, params: Some(params), ..Default::default() };
            let model = DeformableModel::new(&speck, options).unwrap();
            assert_eq!(model.convergence.began_on_contour, on_contour, "iso {iso}");
        }
    }

    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn the_fastest_vertex_counts_again_once_a_parameter_was_set() {
        let mut model = model();
        while !model.step().unwrap().done {}
        assert!(model.speed.energy < model.params.energy_tolerance);
        assert!(model.speed.fastest > model.settled_speed(), "nothing moved on: {}", model.speed.fastest);
        model.set_params(DeformableParams { iso: 0.3, ..model.params.clone() }).unwrap();
        while !model.step().unwrap().done {}
        assert!(model.speed.fastest < model.settled_speed(), "{} at the end", model.speed.fastest);
    }
}
