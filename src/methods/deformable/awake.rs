//! Sleeping vertices: settled parts of the surface are skipped, which saves computation.
//!
//! A vertex falls asleep after several iterations in a row with hardly any motion, and wakes when a neighbour moves or
//! an edit reaches it. Before a pyramid level ends, the forces on all vertices are evaluated once, and vertices that
//! have not settled wake.

use super::image::is_any_sparse;
use crate::math::Bounds;
use crate::mesh::{Mesh, ScalarKey, VertexId};

/// The number of still iterations in a row, those in which a vertex is slower than [`stillness`], after which the
/// vertex sleeps: it is skipped, except when all vertices are processed, until a neighbour moves fast or an edit
/// reaches it. An implicit step counts twice.
pub(super) const ITERATIONS_TO_SLEEP: f32 = 6.0;

/// The speed below which a vertex is still and may fall asleep, as a share of the common speed of all vertices at which
/// their mean kinetic energy would equal the tolerance of convergence.
const STILLNESS: f64 = 0.5;

/// The share of sleeping vertices below which all vertices are processed, asleep or not; this takes no longer than
/// skipping so few.
const FEW_ASLEEP: f64 = 0.25;

/// The vertices that one iteration of the deformable model processes; sleeping ones are skipped. Buffers are kept
/// between iterations.
#[derive(Clone, Debug, Default)]
pub(super) struct Awake {
    /// The vertices processed in this iteration: those awake, or all if few sleep or all are to be examined.
    pub(super) moving: Vec<VertexId>,
    /// The vertices in `moving` and their neighbours, whose normals and Laplacians L(x) the forces need.
    pub(super) with_neighbours: Vec<VertexId>,
    is_included: Vec<bool>,
}

impl Awake {
    /// Selects the vertices to process: those with fewer than [`ITERATIONS_TO_SLEEP`] still iterations, counted by the
    /// attribute `still`, or all vertices if `all` is set or the share of sleeping ones is below [`FEW_ASLEEP`]. With
    /// `within`, vertices outside that box sleep in any case.
    pub(super) fn find(&mut self, mesh: &Mesh, still: ScalarKey, all: bool, within: Option<Bounds>) {
        let still = mesh.scalar(still);
        let within = if is_any_sparse() { within } else { None };
        self.moving.clear();
        let is_awake = |v: &VertexId| {
            (still[v.index()] < ITERATIONS_TO_SLEEP || all && within.is_some())
                && within.is_none_or(|bounds| bounds.contains(mesh.position(*v)))
        };
        self.moving.extend(mesh.vertices().filter(is_awake));
        self.with_neighbours.clear();
        let asleep = mesh.vertex_count() - self.moving.len();
        if within.is_none() && (all || (asleep as f64) < FEW_ASLEEP * mesh.vertex_count() as f64) {
            self.moving.clear();
            self.moving.extend(mesh.vertices());
            self.with_neighbours.extend_from_slice(&self.moving);
            return;
        }
        self.is_included.clear();
        self.is_included.resize(mesh.slots(), false);
        for &v in &self.moving {
            for &w in mesh.ring(v).as_slice().iter().chain([&v]) {
                if !std::mem::replace(&mut self.is_included[w.index()], true) {
                    self.with_neighbours.push(w);
                }
            }
        }
    }

    /// Frees all but [`Self::moving`], so that less memory is taken while vertices move on a sparse level.
    pub(super) fn keep_moving(&mut self) {
        *self = Self { moving: std::mem::take(&mut self.moving), ..Self::default() };
    }
}

/// Returns the speed along the normal, in δ per unit of time, below which a vertex is still and may fall asleep; δ is
/// the lower bound of the edge length.
pub(super) fn stillness(mass: f64, energy_tolerance: f64) -> f32 {
    (STILLNESS * (2.0 * energy_tolerance / mass).sqrt()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn those_that_move_and_their_neighbours_are_found() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 8.0, 1.0).unwrap();
        let still = mesh.add_scalar();
        mesh.scalar_mut(still).fill(ITERATIONS_TO_SLEEP);
        let tip = mesh.vertices().last().unwrap();
        mesh.scalar_mut(still)[tip.index()] = ITERATIONS_TO_SLEEP - 1.0;
        let mut awake = Awake::default();
        awake.find(&mesh, still, false, None);
        assert_eq!(awake.moving, [tip]);
        let mut expected = mesh.ring(tip).as_slice().to_vec();
        expected.push(tip);
        expected.sort_unstable();
        awake.with_neighbours.sort_unstable();
        assert_eq!(awake.with_neighbours, expected);
    }

    #[test]
    fn all_vertices_are_processed_if_few_sleep() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 8.0, 1.0).unwrap();
        let still = mesh.add_scalar();
        let few = mesh.vertex_count() / 5;
        mesh.scalar_mut(still)[..few].fill(ITERATIONS_TO_SLEEP);
        let mut awake = Awake::default();
        awake.find(&mesh, still, false, None);
        assert_eq!(
            (awake.moving.len(), awake.with_neighbours.len()),
            (mesh.vertex_count(), mesh.vertex_count())
        );
        mesh.scalar_mut(still)[..2 * few].fill(ITERATIONS_TO_SLEEP);
        awake.find(&mesh, still, false, None);
        assert_eq!(awake.moving.len(), mesh.vertex_count() - 2 * few);
        awake.find(&mesh, still, true, None);
        assert_eq!(
            (awake.moving.len(), awake.with_neighbours.len()),
            (mesh.vertex_count(), mesh.vertex_count())
        );
    }
}
