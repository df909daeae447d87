//! When a level is finished, and the way down to the next (section 5.1, figures 12 and 13).

use super::renewal::Renewal;
use super::{DeformableModel, DeformableParams, Integrator, Topology, contact};
use crate::mesh::VertexId;
use crate::methods::{MethodError, Times};
use crate::remesh::{Changes, Sampling};
use serde::{Deserialize, Serialize};

/// Iterations running that must be quiet: one alone may be a turning point of a swing.
const QUIET_ITERATIONS: f64 = 3.0;

/// A long step that damps each vertex by the slope of its forces has none.
const QUIET_LONG_STEPS: f64 = 2.0;

/// They need never be more, however small time step and damping are.
const MOST_QUIET_ITERATIONS: f64 = 500.0;

/// The fastest vertex of a surface at rest, in δ per unit of time. The mean energy hides a few vertices that still travel,
/// such as a front in a hole; with no bound the model stops before it has passed.
const REST_SPEED: f32 = 0.03;

/// Searches of the finest level for what is missing.
const MOST_SEARCHES: u32 = 3;

/// The longest move of a vertex of a surface at rest in one iteration, in δ.
const REST_MOVE: f32 = 0.1;

/// Where the model stands between moving and done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Rest {
    quiet: u32,
    /// Whether all vertices have been woken since the surface first came to rest, or something was seeded.
    woken: bool,
    done: bool,
    /// Searches of the finest level for what is missing; all of them once nothing was found.
    searches: u32,
    /// Whether the sizes of edges fit the surface as it came to rest.
    pub(super) sized: bool,
    /// The iteration at whose end this level began.
    pub(super) began: u32,
}

impl DeformableModel {
    pub(super) fn is_done(&self) -> bool {
        self.rest.done
    }

    /// Levels done, and the way of this one from the energy of a surface at full speed to that of one at rest, as its
    /// logarithm falls. It can go back where the surface finds a way on.
    pub(super) fn progress(&self) -> f64 {
        if self.rest.done {
            return 1.0;
        }
        let DeformableParams { mass, max_move, energy_tolerance, .. } = self.params;
        let speed = max_move / self.params.step_length();
        let full = (0.5 * mass * speed * speed).max(2.0 * energy_tolerance);
        // Where a level begins, the energy is still that of the level before.
        let energy = if self.iteration == self.rest.began { full } else { self.movement.energy };
        let way = libm::log(full / energy.max(energy_tolerance)) / libm::log(full / energy_tolerance);
        let levels = self.pyramid.levels.len();
        ((levels - 1 - self.level) as f64 + way.clamp(0.0, 1.0)) / levels as f64
    }

    /// Wakes all vertices: something changed that may move them.
    pub(super) fn wake_all(&mut self) {
        self.mesh.scalar_mut(self.keys.still).fill(0.0);
        self.rest = Rest { began: self.rest.began, ..Rest::default() };
    }

    /// Counts quiet iterations; after enough of them checks the whole mesh and goes one level down, or ends.
    pub(super) fn come_to_rest(&mut self, times: &mut Times) -> Result<Changes, MethodError> {
        let quiet =
            self.movement.energy < self.params.energy_tolerance && self.movement.fastest < self.rest_speed();
        self.rest.quiet = if quiet { self.rest.quiet + 1 } else { 0 };
        if self.rest.quiet < self.quiet_iterations() {
            return Ok(Changes::default());
        }
        if self.level == 0 {
            let changes = self.complete(times)?;
            if self.rest.quiet == 0 {
                return Ok(changes);
            }
        }
        // What has gone to sleep may be pushed by what came to rest since.
        if !self.rest.woken {
            self.mesh.scalar_mut(self.keys.still).fill(0.0);
            self.rest.quiet = 0;
            self.rest.woken = true;
            return Ok(Changes::default());
        }
        let mut changes = self.check_everything(times);
        if self.level == 0 {
            self.rest.done = true;
            return Ok(changes);
        }
        changes += self.descend(times)?;
        Ok(changes)
    }

    /// Fits sizes to the finest level's surface, and adds what it leaves out; the surface is no longer quiet where that changed it.
    /// Edits wake what they reach, and nothing else.
    fn complete(&mut self, times: &mut Times) -> Result<Changes, MethodError> {
        if self.set_sizes() {
            self.rest.quiet = 0;
            return Ok(self.check_everything(times));
        }
        if !self.seeds_levels() || self.rest.searches == MOST_SEARCHES {
            return Ok(Changes::default());
        }
        let found = self.seed_missing(times)?;
        self.rest.searches += 1;
        if found.seeds > 0 {
            self.rest.quiet = 0;
            self.rest.woken = false;
        } else {
            self.rest.searches = MOST_SEARCHES;
        }
        Ok(found)
    }

    /// The speed below which the fastest vertex has settled. A long step is an iteration, too: no vertex goes far in one.
    fn rest_speed(&self) -> f32 {
        let longest = REST_MOVE / self.params.step_length() as f32;
        if longest < REST_SPEED { longest } else { REST_SPEED }
    }

    /// Iterations a surface takes to follow a force, m/γ: one that has just begun to move is slow too, and not at rest.
    fn quiet_iterations(&self) -> u32 {
        let DeformableParams { mass, damping, integrator, .. } = self.params;
        let least = if integrator == Integrator::Implicit { QUIET_LONG_STEPS } else { QUIET_ITERATIONS };
        libm::ceil(mass / (damping * self.params.step_length())).clamp(least, MOST_QUIET_ITERATIONS) as u32
    }

    /// Looks at every vertex whether it has moved or not, and removes specks.
    pub(super) fn check_everything(&mut self, times: &mut Times) -> Changes {
        if self.params.topology == Topology::Fixed {
            return Changes::default();
        }
        let all: Vec<VertexId> = self.mesh.vertices().collect();
        let mut changes = self.restore_bounds(&all, times);
        let sampling = self.sampling();
        let guide = contact::guide(&self.pyramid.levels[self.level], self.level_iso, &self.params);
        changes.vanished += self.resolver.sweep(&mut self.mesh, sampling, &*guide);
        drop(guide);
        self.settle_in();
        changes
    }

    /// Refines the mesh and takes the next finer image (figure 13); renews what leaves out part of that.
    fn descend(&mut self, times: &mut Times) -> Result<Changes, MethodError> {
        let begin = (self.clock)();
        let renewal = if self.seeds_levels() { self.renewal()? } else { Renewal::default() };
        let whole = self.mesh.clone();
        renewal.stale.iter().for_each(|&v| _ = self.mesh.remove_component(v));
        self.refine()?;
        let (mut changes, _) = self.add_components(&renewal.fresh)?;
        let fits = changes.seeds == renewal.fresh.component_count() as u32;
        if !fits {
            let partly = std::mem::replace(&mut self.mesh, whole);
            self.mesh.count_on_from(&partly);
            self.refine()?;
            changes = Changes::default();
        }
        times.add("renewal", (self.clock)() - begin);
        self.level -= 1;
        self.rest = Rest { began: self.iteration, ..Rest::default() };
        self.reorder();
        self.settle_in();
        self.wake_all();
        self.prepare_level()?;
        changes += self.check_everything(times);
        if self.seeds_levels() && !fits {
            changes += self.seed_missing(times)?;
        }
        Ok(changes)
    }

    fn refine(&mut self) -> Result<(), MethodError> {
        if self.params.topology == Topology::Adaptive {
            let most = self.resolver.most_vertices();
            if self.mesh.vertex_count() + self.mesh.triangle_count() > most {
                return Err(MethodError::TooManyVertices { most });
            }
            // Where it cannot be refined, edges that are now too long are split.
            let sampling = Sampling::new(self.model_delta());
            self.resolver.refine(&mut self.mesh, sampling)?;
        }
        Ok(())
    }
}
