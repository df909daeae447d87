//! The law of motion m ẍ + γ ẋ = f (4), integrated over one iteration.

use super::Keys;
use super::domain::Domain;
use super::forces::{ForceScale, Forces, Pull};
use super::image::LevelImage;
use super::params::{DeformableParams, Integrator};
use crate::math::Vec3;
use crate::mesh::Mesh;

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

/// Moves every vertex by one time step. `forces` holds normals and L of the mesh as it is.
pub(super) fn advance(mesh: &mut Mesh, keys: Keys, forces: &mut Forces, world: &World) -> Movement {
    let moves = match world.params.integrator {
        Integrator::Euler => euler(mesh, keys, forces, world),
        Integrator::RungeKutta => runge_kutta(mesh, keys, forces, world),
    };
    apply(mesh, keys, forces, world, moves)
}

/// Semi-implicit Euler: the new velocity moves the vertex. The velocity attribute holds it; no moves are returned.
fn euler(mesh: &mut Mesh, keys: Keys, forces: &mut Forces, world: &World) -> Option<Vec<Vec3>> {
    world.act(forces, mesh, mesh.positions(), mesh.vector(keys.velocity));
    let &DeformableParams { time_step, mass, damping, .. } = world.params;
    let (step, damping) = (time_step as f32 / mass as f32, damping as f32);
    for (v, force) in mesh.vector_mut(keys.velocity).iter_mut().zip(&forces.force) {
        *v += (*force - *v * damping) * step;
    }
    None
}

/// The classical fourth-order method on positions and velocities; returns the way of each vertex.
fn runge_kutta(mesh: &mut Mesh, keys: Keys, forces: &mut Forces, world: &World) -> Option<Vec<Vec3>> {
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
    Some(way)
}

/// Bounds each move, scales the velocity with it, and moves the vertices.
fn apply(mesh: &mut Mesh, keys: Keys, forces: &Forces, world: &World, moves: Option<Vec<Vec3>>) -> Movement {
    let &World { domain, params, delta, .. } = world;
    let (step, limit) = (params.time_step as f32, params.max_move as f32 * delta);
    let live: Vec<bool> = mesh.rings().iter().map(|ring| !ring.is_empty()).collect();
    let count = mesh.vertex_count();
    let calm = mesh.scalar(keys.calm).to_vec();
    mesh.scalar_mut(keys.calm).iter_mut().for_each(|calm| *calm += 1.0);
    let (positions, velocities) = mesh.positions_and_vector_mut(keys.velocity);
    let mut movement = Movement::default();
    for i in (0..live.len()).filter(|&i| live[i]) {
        let mut way = moves.as_ref().map_or(velocities[i] * step, |moves| moves[i]);
        let length = way.length();
        if length > limit {
            way *= limit / length;
            velocities[i] *= limit / length;
        }
        let to = positions[i] + way;
        if !domain.bounds.contains(to) {
            way = domain.hold(to) - positions[i];
            velocities[i] = way * (1.0 / step);
        }
        positions[i] += way;
        let along = (way.dot(forces.normal[i]) / (step * delta)).abs();
        movement.energy += f64::from(along) * f64::from(along);
        if along > movement.fastest && calm[i] >= CALM {
            movement.fastest = along;
        }
    }
    movement.energy *= 0.5 * params.mass / count.max(1) as f64;
    movement
}
