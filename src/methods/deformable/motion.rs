//! Integration of the law of motion of the vertices, m ẍ + γ ẋ = f (4), over one iteration.

use super::Keys;
use super::awake::{Awake, ITERATIONS_TO_SLEEP, stillness};
use super::domain::Domain;
use super::forces::{Field, Forces};
use super::params::{DeformableParams, Integrator};
use crate::math::{Bounds, Vec3, higher, resize};
use crate::mesh::{Mesh, VertexId};
use crate::pauses::Pauses;

/// The speed of the mesh in one iteration, by which convergence is judged.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpeedSummary {
    /// The mean kinetic energy of the vertices along their normals, ½ m (v·n)² / δ²: the criterion of convergence of
    /// section 5.1.
    pub(super) energy: f64,
    /// The largest speed along a normal, in δ per unit of time, of vertices that no edit displaced recently. Edits
    /// displace single vertices of a settled surface, which return in a few iterations.
    pub(super) fastest: f32,
}

/// The number of iterations after an edit in which the vertices displaced by it return to the surface; until then their
/// speeds do not delay convergence.
pub(super) const ITERATIONS_AFTER_EDIT: f32 = 6.0;

/// The number of still iterations added for a vertex that could not move at all without a self-intersection, so that it
/// falls asleep sooner: it is pressed against others and will not move in the next iteration either.
const STILL_IF_STUCK: f32 = 2.0;

/// The number of still iterations, towards [`ITERATIONS_TO_SLEEP`], that a single one with the implicit integrator
/// counts as, since its steps are long.
const STILL_PER_IMPLICIT_STEP: f32 = 2.0;

/// The speed along its normal above which a vertex wakes its sleeping neighbours, in multiples of the largest speed of
/// a still vertex. A neighbour of valence six moves by at most a sixth of the displacement.
const WAKING_SPEED: f32 = 4.0;

/// The stiffness of the force of rigidity, f_c, against displacing a vertex of valence 6 from its neighbours: force per
/// displacement, as a multiple of α_c. The implicit integrator uses it.
const BENDING_STIFFNESS: f32 = 1.3;
/// The stiffness of the force of the edges as springs, f_e, against displacing a vertex of valence 6 from its
/// neighbours: force per displacement, as a multiple of α_e. The implicit integrator uses it.
const STRETCHING_STIFFNESS: f32 = 6.0;

/// The share of its speed that a vertex must keep after a reversal of its velocity for the implicit integrator to count
/// the reversal, and so to shorten steps; weaker oscillations decay by themselves.
const MIN_KEPT_SPEED: f32 = 0.5;

/// The decrease of a vertex's count of velocity reversals, by which the implicit integrator shortens steps, in an
/// iteration without a reversal; with it, oscillations with periods of up to eight iterations accumulate.
const REVERSAL_DECAY: f32 = 0.25;

/// The image, parameters and constraints that act on the mesh in one iteration.
pub(super) struct MotionContext<'a> {
    pub(super) field: Field<'a>,
    /// The region in which vertices must stay.
    pub(super) domain: Domain,
    pub(super) params: &'a DeformableParams,
    pub(super) delta: f32,
    /// Whether this iteration examines all vertices before the level ends: the forces on all are evaluated, and only
    /// those that have not settled move.
    pub(super) examine_all: bool,
    pub(super) clock: fn() -> f64,
}

/// Moves the vertices by the law of motion; buffers are kept between iterations.
#[derive(Clone, Debug, Default)]
pub(super) struct Motion {
    pub(super) awake: Awake,
    pub(super) forces: Forces,
    /// The displacements of the vertices in this iteration, by slot; zero between iterations.
    displacements: Vec<Vec3>,
}

impl Motion {
    /// Selects the vertices that [`Self::advance`] will process, those awake or all if `examine_all`, only those in the
    /// box `within` if there is one, and computes normals and Laplacians of these and of their neighbours.
    pub(super) fn prepare(&mut self, mesh: &Mesh, keys: Keys, examine_all: bool, within: Option<Bounds>) {
        self.awake.find(mesh, keys.still_iterations, examine_all, within);
        self.forces.update_normals(mesh.rings(), mesh.positions(), &self.awake.with_neighbours);
        resize(&mut self.displacements, mesh.slots(), Vec3::ZERO);
    }

    /// Frees the buffers of forces and displacements, which the next iteration fills anew.
    pub(super) fn free_buffers(&mut self) {
        self.forces = Forces::default();
        self.displacements = Vec::new();
    }

    /// Moves the vertices by one iteration as far as `displace` allows, and returns their mean energy and largest
    /// speed, by which convergence is judged; needs [`Self::prepare`] for the current mesh.
    ///
    /// `displace` moves vertices by displacements, given by slot, and replaces these by the ones applied. It returns
    /// the vertices held back, each with the share, from 0 to 1, of its displacement that it moved by.
    /// Pauses meanwhile.
    pub(super) async fn advance(
        &mut self,
        mesh: &mut Mesh,
        keys: Keys,
        context: &MotionContext<'_>,
        displace: impl AsyncFnOnce(&mut Mesh, &[VertexId], &mut [Vec3]) -> Vec<(VertexId, f32)>,
        pauses: &Pauses,
    ) -> SpeedSummary {
        match context.params.integrator {
            Integrator::Euler => self.euler(mesh, keys, context, pauses).await,
            Integrator::RungeKutta => self.runge_kutta(mesh, keys, context, pauses).await,
            Integrator::Implicit => self.implicit(mesh, keys, context, pauses).await,
        }
        if context.examine_all {
            self.wake_unsettled(mesh, keys, context);
        }
        self.clamp_displacements(mesh, keys, context);
        if context.field.image.bricks().is_some() {
            self.forces.keep_normals();
            self.awake.keep_moving();
        }
        let held = displace(mesh, &self.awake.moving, &mut self.displacements).await;
        let velocities = mesh.vector_mut(keys.velocity);
        held.iter().for_each(|&(v, share)| velocities[v.index()] *= share);
        let stuck = held.iter().filter(|(_, share)| *share == 0.0);
        let still = mesh.scalar_mut(keys.still_iterations);
        stuck.for_each(|(v, _)| still[v.index()] += STILL_IF_STUCK);
        let summary = self.measure(mesh, keys, context);
        self.awake.moving.iter().for_each(|v| self.displacements[v.index()] = Vec3::ZERO);
        summary
    }

    /// Computes velocities and displacements by semi-implicit Euler: the new velocity moves the vertex.
    async fn euler(&mut self, mesh: &mut Mesh, keys: Keys, context: &MotionContext<'_>, pauses: &Pauses) {
        self.evaluate_forces(mesh, [mesh.positions(), mesh.vector(keys.velocity)], context, pauses).await;
        let &DeformableParams { time_step, mass, damping, .. } = context.params;
        let (step, damping) = (time_step as f32 / mass as f32, damping as f32);
        let velocities = mesh.vector_mut(keys.velocity);
        for i in self.awake.moving.iter().map(|v| v.index()) {
            velocities[i] += (self.forces.force[i] - velocities[i] * damping) * step;
            self.displacements[i] = velocities[i] * time_step as f32;
        }
    }

    /// Computes velocities and displacements by linearly implicit Euler with a long time step, v ← (m v + Δt f) / (m +
    /// Δt γ + Δt² k), for each vertex separately; k is the stiffness of the forces against a displacement along the
    /// normal.
    ///
    /// Near steps of the image, or where edits displace them repeatedly, vertices would oscillate for ever. After n
    /// recent reversals a vertex moves by 1/(n + 1) of its displacement, so it settles at the mean (Kesten,
    /// *Accelerated stochastic approximation*, 1958).
    async fn implicit(&mut self, mesh: &mut Mesh, keys: Keys, context: &MotionContext<'_>, pauses: &Pauses) {
        self.evaluate_forces(mesh, [mesh.positions(), mesh.vector(keys.velocity)], context, pauses).await;
        let &DeformableParams { mass, damping, rigidity, stiffness, .. } = context.params;
        let (step, mass, damping) = (context.params.step_length() as f32, mass as f32, damping as f32);
        let internal = BENDING_STIFFNESS * rigidity as f32 + STRETCHING_STIFFNESS * stiffness as f32;
        let pull = context.field.scale.iso_stiffness();
        let (velocities, reversals) = mesh.vector_and_scalar_mut(keys.velocity, keys.reversals);
        for i in self.awake.moving.iter().map(|v| v.index()) {
            let k = pull * self.forces.slope[i] + internal;
            let before = velocities[i];
            let velocity = (before * mass + self.forces.force[i] * step)
                * (1.0 / (mass + step * damping + step * step * k));
            let normal = self.forces.normal[i];
            reversals[i] = count_reversals(reversals[i], before.dot(normal), velocity.dot(normal));
            velocities[i] = velocity * (1.0 / (1.0 + reversals[i]));
            self.displacements[i] = velocities[i] * step;
        }
    }

    /// Computes velocities and displacements by the classical fourth-order Runge–Kutta method.
    async fn runge_kutta(
        &mut self,
        mesh: &mut Mesh,
        keys: Keys,
        context: &MotionContext<'_>,
        pauses: &Pauses,
    ) {
        let &DeformableParams { time_step, mass, damping, .. } = context.params;
        let (step, mass, damping) = (time_step as f32, mass as f32, damping as f32);
        let (x0, v0) = (mesh.positions().to_vec(), mesh.vector(keys.velocity).to_vec());
        let normals = self.forces.normal.clone();
        let (mut x, mut v) = (x0.clone(), v0.clone());
        let mut velocity_change = vec![Vec3::ZERO; x.len()];
        for (stage, (weight, share)) in
            [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)].into_iter().enumerate()
        {
            if stage > 0 {
                self.forces.update_normals(mesh.rings(), &x, &self.awake.with_neighbours);
            }
            self.evaluate_forces(mesh, [&x, &v], context, pauses).await;
            for i in self.awake.moving.iter().map(|v| v.index()) {
                let acceleration = (self.forces.force[i] - v[i] * damping) * (1.0 / mass);
                self.displacements[i] += v[i] * (weight * step / 6.0);
                velocity_change[i] += acceleration * (weight * step / 6.0);
                x[i] = x0[i] + v[i] * (share * step);
                v[i] = v0[i] + acceleration * (share * step);
            }
        }
        self.forces.normal = normals;
        let velocities = mesh.vector_mut(keys.velocity);
        self.awake.moving.iter().map(|v| v.index()).for_each(|i| velocities[i] += velocity_change[i]);
    }

    /// Evaluates the forces on the moving vertices at given positions and velocities, with the normals last computed,
    /// and adds up the time that this takes.
    async fn evaluate_forces(
        &mut self,
        mesh: &Mesh,
        state: [&[Vec3]; 2],
        context: &MotionContext<'_>,
        pauses: &Pauses,
    ) {
        let begin = (context.clock)();
        self.forces.evaluate(mesh.rings(), state, &context.field, &self.awake.moving, pauses).await;
        self.forces.milliseconds += (context.clock)() - begin;
    }

    /// Shortens displacements longer than the parameter `max_move` or out of the domain, and sets the velocities
    /// accordingly.
    fn clamp_displacements(&mut self, mesh: &mut Mesh, keys: Keys, context: &MotionContext) {
        let &MotionContext { domain, params, delta, .. } = context;
        let limit = params.max_move as f32 * delta;
        for i in self.awake.moving.iter().map(|v| v.index()) {
            let displacement = &mut self.displacements[i];
            let length = displacement.length();
            if length > limit {
                *displacement *= limit / length;
                mesh.vector_mut(keys.velocity)[i] *= limit / length;
            }
            let from = mesh.positions()[i];
            if !domain.bounds.contains(from + *displacement) {
                *displacement = domain.clamp(from + *displacement) - from;
                mesh.vector_mut(keys.velocity)[i] = *displacement * (1.0 / params.step_length() as f32);
            }
        }
    }

    /// Ends an examination of all vertices: wakes those whose displacement along the normal exceeds that of a still
    /// vertex, and keeps them as moving; stops the others.
    fn wake_unsettled(&mut self, mesh: &mut Mesh, keys: Keys, context: &MotionContext) {
        let stillness = stillness(context.params.mass, context.params.energy_tolerance);
        let least = stillness * context.params.step_length() as f32 * context.delta;
        let Self { awake, forces, displacements, .. } = self;
        awake.moving.retain(|v| {
            let i = v.index();
            let is_about_to_move = displacements[i].dot(forces.normal[i]).abs() > least;
            if !is_about_to_move {
                displacements[i] = Vec3::ZERO;
                mesh.vector_mut(keys.velocity)[i] = Vec3::ZERO;
            }
            is_about_to_move
        });
        let still = mesh.scalar_mut(keys.still_iterations);
        awake.moving.iter().for_each(|v| still[v.index()] = 0.0);
    }

    /// Measures the mean energy and the largest speed of the vertices along their normals, counts still iterations, and
    /// wakes fast vertices with their neighbours.
    fn measure(&self, mesh: &mut Mesh, keys: Keys, context: &MotionContext) -> SpeedSummary {
        let per_time = 1.0 / (context.params.step_length() as f32 * context.delta);
        let stillness = stillness(context.params.mass, context.params.energy_tolerance);
        let counted =
            if context.params.integrator == Integrator::Implicit { STILL_PER_IMPLICIT_STEP } else { 1.0 };
        let mut summary = SpeedSummary::default();
        for &v in &self.awake.moving {
            let i = v.index();
            let along = (self.displacements[i].dot(self.forces.normal[i]) * per_time).abs();
            summary.energy += f64::from(along) * f64::from(along);
            let since_edit = &mut mesh.scalar_mut(keys.since_edit)[i];
            if along > summary.fastest && *since_edit >= ITERATIONS_AFTER_EDIT {
                summary.fastest = along;
            }
            *since_edit += 1.0;
            if along > WAKING_SPEED * stillness {
                wake(mesh, keys, v);
            } else if along > stillness {
                mesh.scalar_mut(keys.still_iterations)[i] = 0.0;
            } else {
                count_still(mesh, keys, v, counted);
            }
        }
        summary.energy *= 0.5 * context.params.mass / mesh.vertex_count().max(1) as f64;
        summary
    }
}

/// Returns the updated count of recent velocity reversals of a vertex, by which the implicit integrator shortens its
/// steps, given its speeds along the normal before and after a step.
fn count_reversals(reversals: f32, before: f32, after: f32) -> f32 {
    if before * after >= 0.0 {
        return higher(reversals - REVERSAL_DECAY, 0.0);
    }
    let is_undamped = after.abs() > MIN_KEPT_SPEED * before.abs();
    if is_undamped { reversals + 1.0 } else { reversals }
}

/// Wakes a vertex and its neighbours: they are processed again from the next iteration on.
fn wake(mesh: &mut Mesh, keys: Keys, v: VertexId) {
    let (rings, still) = mesh.rings_and_scalar_mut(keys.still_iterations);
    still[v.index()] = 0.0;
    rings[v.index()].as_slice().iter().for_each(|w| still[w.index()] = 0.0);
}

/// Adds `iterations` to the still iterations of a vertex; once there are enough it sleeps, and its velocity is set to
/// zero.
fn count_still(mesh: &mut Mesh, keys: Keys, v: VertexId, iterations: f32) {
    let still = &mut mesh.scalar_mut(keys.still_iterations)[v.index()];
    *still += iterations;
    if *still >= ITERATIONS_TO_SLEEP {
        mesh.vector_mut(keys.velocity)[v.index()] = Vec3::ZERO;
    }
}
