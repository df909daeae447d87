//! The law of motion m ẍ + γ ẋ = f (4), integrated over one iteration.

use super::Keys;
use super::domain::Domain;
use super::forces::{ForceScale, Forces, Pull};
use super::image::LevelImage;
use super::params::{DeformableParams, Integrator};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};

/// How much the mesh moved in one iteration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Movement {
    /// Mean of ½ m (v·n)² / δ², the criterion of section 5.1.
    pub(super) energy: f64,
    /// Largest speed along a normal, in δ per unit of time, of a vertex that no edit displaced lately. Edits of a
    /// surface at rest throw single vertices off it; they come back in a few iterations and are no sign that the surface
    /// still travels.
    pub(super) fastest: f32,
}

/// Iterations after which a vertex has come back from an edit.
const CALM: f32 = 6.0;

/// What pushes and what holds the vertices.
pub(super) struct World<'a> {
    pub(super) image: &'a LevelImage,
    pub(super) scale: ForceScale,
    pub(super) pulls: &'a [Pull],
    /// Where vertices are held back.
    pub(super) domain: Domain,
    pub(super) params: &'a DeformableParams,
    pub(super) delta: f32,
    pub(super) clock: fn() -> f64,
}

impl World<'_> {
    /// The forces at given positions, with the normals there.
    fn act(&self, forces: &mut Forces, mesh: &Mesh, positions: &[Vec3], velocities: &[Vec3]) {
        let begin = (self.clock)();
        forces.evaluate(mesh.rings(), positions, velocities, self.image, &self.scale, self.pulls);
        forces.spent += (self.clock)() - begin;
    }
}

/// Moves every vertex by one time step, as far as `carry` can. `forces` holds normals and L of the mesh as it is.
///
/// `carry` moves vertices by ways, by slot; it leaves there what they went, and tells which share of its way each of the
/// vertices went that it held back.
pub(super) fn advance(
    mesh: &mut Mesh,
    keys: Keys,
    forces: &mut Forces,
    world: &World,
    carry: impl FnOnce(&mut Mesh, &mut [Vec3]) -> Vec<(VertexId, f32)>,
) -> Movement {
    let mut ways = match world.params.integrator {
        Integrator::Euler => euler(mesh, keys, forces, world),
        Integrator::RungeKutta => runge_kutta(mesh, keys, forces, world),
    };
    bound(mesh, keys, world, &mut ways);
    let held = carry(mesh, &mut ways);
    let velocities = mesh.vector_mut(keys.velocity);
    held.into_iter().for_each(|(v, share)| velocities[v.index()] *= share);
    measure(mesh, keys, forces, world, &ways)
}

/// Semi-implicit Euler: the new velocity moves the vertex. Returns the way of each vertex.
fn euler(mesh: &mut Mesh, keys: Keys, forces: &mut Forces, world: &World) -> Vec<Vec3> {
    world.act(forces, mesh, mesh.positions(), mesh.vector(keys.velocity));
    let &DeformableParams { time_step, mass, damping, .. } = world.params;
    let (step, damping) = (time_step as f32 / mass as f32, damping as f32);
    for (v, force) in mesh.vector_mut(keys.velocity).iter_mut().zip(&forces.force) {
        *v += (*force - *v * damping) * step;
    }
    mesh.vector(keys.velocity).iter().map(|v| *v * time_step as f32).collect()
}

/// The classical fourth-order method on positions and velocities; returns the way of each vertex.
fn runge_kutta(mesh: &mut Mesh, keys: Keys, forces: &mut Forces, world: &World) -> Vec<Vec3> {
    let &DeformableParams { time_step, mass, damping, .. } = world.params;
    let (step, mass, damping) = (time_step as f32, mass as f32, damping as f32);
    let (x0, v0) = (mesh.positions().to_vec(), mesh.vector(keys.velocity).to_vec());
    let normals = forces.normal.clone();
    let (mut x, mut v) = (x0.clone(), v0.clone());
    let (mut way, mut gain) = (vec![Vec3::ZERO; x.len()], vec![Vec3::ZERO; x.len()]);
    for (stage, (weight, ahead)) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)].into_iter().enumerate() {
        if stage > 0 {
            forces.look_around(mesh.rings(), &x);
        }
        world.act(forces, mesh, &x, &v);
        for i in 0..x.len() {
            let acceleration = (forces.force[i] - v[i] * damping) * (1.0 / mass);
            way[i] += v[i] * (weight * step / 6.0);
            gain[i] += acceleration * (weight * step / 6.0);
            x[i] = x0[i] + v[i] * (ahead * step);
            v[i] = v0[i] + acceleration * (ahead * step);
        }
    }
    forces.normal = normals;
    for (v, gain) in mesh.vector_mut(keys.velocity).iter_mut().zip(gain) {
        *v += gain;
    }
    way
}

/// Shortens ways that are too long or lead out of the domain, and the velocities with them. Free slots stay where they
/// are.
fn bound(mesh: &mut Mesh, keys: Keys, world: &World, ways: &mut [Vec3]) {
    let &World { domain, params, delta, .. } = world;
    let limit = params.max_move as f32 * delta;
    for (i, way) in ways.iter_mut().enumerate() {
        if mesh.rings()[i].is_empty() {
            *way = Vec3::ZERO;
            continue;
        }
        let length = way.length();
        if length > limit {
            *way *= limit / length;
            mesh.vector_mut(keys.velocity)[i] *= limit / length;
        }
        let from = mesh.positions()[i];
        if !domain.bounds.contains(from + *way) {
            *way = domain.hold(from + *way) - from;
            mesh.vector_mut(keys.velocity)[i] = *way * (1.0 / params.time_step as f32);
        }
    }
}

/// How much the mesh moved by `ways`.
fn measure(mesh: &mut Mesh, keys: Keys, forces: &Forces, world: &World, ways: &[Vec3]) -> Movement {
    let per_time = 1.0 / (world.params.time_step as f32 * world.delta);
    let mut movement = Movement::default();
    for (i, calm) in mesh.scalar_mut(keys.calm).iter_mut().enumerate() {
        // Free slots have no way.
        let along = (ways[i].dot(forces.normal[i]) * per_time).abs();
        movement.energy += f64::from(along) * f64::from(along);
        if along > movement.fastest && *calm >= CALM {
            movement.fastest = along;
        }
        *calm += 1.0;
    }
    movement.energy *= 0.5 * world.params.mass / mesh.vertex_count().max(1) as f64;
    movement
}
