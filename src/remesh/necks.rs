//! Cuts necks thinner than the lower bound of edge lengths: the annular change of figure 5 (Lachaud & Montanvert).

use super::{Resolver, Sampling, TopologyGuide};
use crate::math::Vec3;
use crate::math::order::{rank_f32, sort_by_rank};
use crate::mesh::{Cut, EditError, Mesh, VertexId};

/// Distances in units of δ by which each side of a cut is moved away from the other; the first that causes no
/// self-intersection is used. At shorter ones the sides are soon in contact again.
const CUT_PUSHES: [f32; 4] = [0.75, 0.4, 0.2, 0.05];

/// The largest displacement of one side of a cut, as a share of its distance from the mean of its neighbours along the
/// axis of the neck, so that no triangle turns over.
const CUT_PUSH_LIMIT: f32 = 0.6;

impl Resolver {
    /// Cuts a neck (annular change) along a cycle of three edges, formed by the edge `uv` and a common neighbour of its
    /// ends: the shortest such cycle that `guide` allows and whose cut causes no self-intersection. Returns `Ok(true)`
    /// after a cut, `Ok(false)` if `guide` allows none.
    pub(super) fn cut_neck(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        [u, v]: [VertexId; 2],
    ) -> Result<bool, EditError> {
        let opposite = mesh.opposite_vertices(u, v)?;
        let around = |o: &VertexId| {
            let p = mesh.position(*o);
            p.distance(mesh.position(u)) + p.distance(mesh.position(v))
        };
        let mut thirds = mesh.common_neighbours(u, v);
        thirds.retain(|&mut o| o != opposite.left && o != opposite.right && guide.may_cut(mesh, [u, v, o]));
        sort_by_rank(&mut thirds, |o| rank_f32(around(o)).into());
        if thirds.is_empty() {
            return Ok(false);
        }
        let cut = thirds.into_iter().find_map(|o| self.cut_apart(mesh, sampling, [u, v, o]));
        let cut = cut.ok_or(EditError::WouldSelfIntersect)?;
        self.changes.annular += 1;
        for side in [cut.kept, cut.copies] {
            if !self.remove_if_negligible(mesh, sampling, guide, side[0]) {
                side.into_iter().for_each(|w| self.touch_edited(w));
            }
        }
        Ok(true)
    }

    /// Cuts along the cycle of the three edges between `u`, `v` and `o`, and moves the two sides apart by the largest
    /// of [`CUT_PUSHES`] that causes no self-intersection; `None`, with the mesh unchanged, if each causes one.
    fn cut_apart(&mut self, mesh: &mut Mesh, sampling: Sampling, [u, v, o]: [VertexId; 3]) -> Option<Cut> {
        let mut apart = |push: f32| {
            self.embedding.attempt(mesh, |mesh| {
                let cut = mesh.cut(u, v, o)?;
                move_apart(mesh, cut, push * sampling.shortest());
                Ok(cut)
            })
        };
        CUT_PUSHES.into_iter().find_map(|push| apart(push).ok())
    }

    /// Cuts necks at the vertices `stuck`, which could not move at all: in a neck compressed until its vertices are
    /// held, no edge becomes short, and it would never be cut otherwise.
    pub(super) fn cut_stuck_necks(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        stuck: &[VertexId],
    ) {
        for &u in stuck {
            if !mesh.is_live(u) || self.embedding.effort() >= self.max_effort {
                continue;
            }
            let ring = mesh.ring(u).as_slice().to_vec();
            ring.into_iter().any(|v| self.cut_neck(mesh, sampling, guide, [u, v]) == Ok(true));
        }
    }
}

/// Moves the two sides of a cut apart along the axis of the neck, each by `push` or less, in units of the mesh (see
/// [`CUT_PUSH_LIMIT`]).
fn move_apart(mesh: &mut Mesh, cut: Cut, push: f32) {
    let [a, b, c] = cut.kept.map(|v| mesh.position(v));
    let centre = (a + b + c) * (1.0 / 3.0);
    let axis = (b - a).cross(c - a).normalize_or_zero();
    for side in [cut.kept, cut.copies] {
        let away = (side_centre(mesh, side) - centre).dot(axis);
        let limit = CUT_PUSH_LIMIT * away.abs();
        let shift = axis * (if limit < push { limit } else { push }).copysign(away);
        for v in side {
            mesh.set_position(v, mesh.position(v) + shift);
        }
    }
}

/// Returns the mean position of the neighbours of one side of a cut, excluding its own three vertices.
fn side_centre(mesh: &Mesh, side: [VertexId; 3]) -> Vec3 {
    let outer = side.iter().flat_map(|&v| mesh.ring(v).as_slice()).filter(|w| !side.contains(w));
    let (sum, count) =
        outer.fold((Vec3::ZERO, 0.0), |(sum, count), &w| (sum + mesh.position(w), count + 1.0));
    sum * (1.0 / count)
}
