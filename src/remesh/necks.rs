//! Necks that are thinner than edges may be short: the annular change of figure 5.

use super::{Resolver, Sampling, TopologyGuide};
use crate::math::Vec3;
use crate::math::order::{rank, sort_by_rank};
use crate::mesh::{Cut, EditError, Mesh, VertexId};

/// How far the two sides of a cut neck are moved apart, in δ: the first that makes nothing cross. With less they are soon
/// in contact again.
const CUT_PUSHES: [f32; 4] = [0.75, 0.4, 0.2, 0.05];

/// The share of the way to its own side's neighbours that a side is pushed at most, so that no triangle turns over.
const CUT_PUSH_LIMIT: f32 = 0.6;

/// Rings around a cut that are drawn together at the most.
const MOST_RINGS_BACK: usize = 3;

impl Resolver {
    /// Annular change through the edge `uv` and a common neighbour: the one that makes the shortest ring, where nothing
    /// crosses then.
    pub(super) fn cut_neck(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        [u, v]: [VertexId; 2],
    ) -> Result<bool, EditError> {
        let opposite = mesh.opposite(u, v)?;
        let around = |o: &VertexId| {
            let p = mesh.position(*o);
            p.distance(mesh.position(u)) + p.distance(mesh.position(v))
        };
        let mut thirds = mesh.common_neighbours(u, v);
        thirds.retain(|&mut o| o != opposite.left && o != opposite.right && guide.may_cut(mesh, [u, v, o]));
        sort_by_rank(&mut thirds, |o| rank(around(o)).into());
        if thirds.is_empty() {
            return Ok(false);
        }
        let cut_along = |o: VertexId| {
            let ring = [u, v, o];
            self.cut_apart(mesh, sampling, ring).or_else(|| self.cut_back(mesh, guide, ring))
        };
        let cut = thirds.into_iter().find_map(cut_along).ok_or(EditError::WouldCross)?;
        self.changes.annular += 1;
        for side in [cut.kept, cut.copies] {
            if !self.remove_speck(mesh, sampling, guide, side[0]) {
                side.into_iter().filter(|&w| mesh.is_live(w)).for_each(|w| self.touch_edited(w));
            }
        }
        Ok(true)
    }

    /// Cuts the mesh along a ring and moves the two sides apart as far as nothing crosses.
    fn cut_apart(&mut self, mesh: &mut Mesh, sampling: Sampling, [u, v, o]: [VertexId; 3]) -> Option<Cut> {
        let mut apart = |push: f32| {
            self.embedding.attempt(mesh, |mesh| {
                let cut = mesh.cut(u, v, o)?;
                part(mesh, cut, push * sampling.shortest());
                Ok(cut)
            })
        };
        CUT_PUSHES.into_iter().find_map(|push| apart(push).ok())
    }

    /// Cuts the mesh along a ring and draws each side together, with what is around it, into one vertex: the sides of a neck that is
    /// pressed on itself cannot be moved apart. Not where `guide` knows of a strand or a tunnel around there.
    fn cut_back(&mut self, mesh: &mut Mesh, guide: &dyn TopologyGuide, neck: [VertexId; 3]) -> Option<Cut> {
        let around: Vec<VertexId> = neck.iter().flat_map(|&w| mesh.ring(w).as_slice()).copied().collect();
        if guide.has_content(mesh, &around, is_strand(mesh, neck)) {
            return None;
        }
        let [u, v, o] = neck;
        let mut back = |rings: usize| {
            self.embedding.attempt(mesh, |mesh| {
                let cut = mesh.cut(u, v, o)?;
                let deleted = draw_together(mesh, cut.kept, rings)? + draw_together(mesh, cut.copies, rings)?;
                Ok((cut, deleted))
            })
        };
        let (cut, deleted) = (0..=MOST_RINGS_BACK).find_map(|rings| back(rings).ok())?;
        self.changes.deletions += deleted;
        Some(cut)
    }

    /// Cuts necks through vertices that could not move: pressed together until its vertices are held, a neck would stay
    /// for ever where no edge gets short.
    pub(super) fn cut_crushed(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        stuck: &[VertexId],
    ) {
        for &u in stuck {
            if !mesh.is_live(u) || self.embedding.effort() >= self.most_effort {
                continue;
            }
            let ring = mesh.ring(u).as_slice().to_vec();
            ring.into_iter().any(|v| self.cut_neck(mesh, sampling, guide, [u, v]) == Ok(true));
        }
    }
}

/// Whether a ring of three edges goes around a strand; else it is around a tunnel.
pub fn is_strand(mesh: &Mesh, ring: [VertexId; 3]) -> bool {
    let corners = ring.map(|w| mesh.position(w));
    let middle = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
    let outwards: f32 =
        (0..3).map(|k| mesh.area_normal(ring[k]).normalize_or_zero().dot(corners[k] - middle)).sum();
    outwards > 0.0
}

/// Moves the two sides of a cut apart along the axis of the neck.
fn part(mesh: &mut Mesh, cut: Cut, push: f32) {
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

/// Draws the triangle that closes a side of a cut together into its first corner, then some rings around that, and moves it to the mean
/// of its neighbours. Returns how many vertices are gone.
fn draw_together(mesh: &mut Mesh, [centre, a, b]: [VertexId; 3], rings: usize) -> Result<u32, EditError> {
    let mut deleted = 2;
    for v in [a, b] {
        mesh.collapse(centre, v, mesh.position(centre))?;
    }
    for _ in 0..rings {
        for v in mesh.ring(centre).as_slice().to_vec() {
            // Edges that cannot be drawn together stay.
            deleted += u32::from(mesh.collapse(centre, v, mesh.position(centre)).is_ok());
        }
    }
    let ring = mesh.ring(centre).as_slice();
    let sum = ring.iter().fold(Vec3::ZERO, |sum, &w| sum + mesh.position(w));
    let mean = sum * (1.0 / ring.len() as f32);
    mesh.set_position(centre, mean);
    Ok(deleted)
}

/// The mean of the neighbours of a cut's side, its own corners left out.
fn side_centre(mesh: &Mesh, side: [VertexId; 3]) -> Vec3 {
    let outer = side.iter().flat_map(|&v| mesh.ring(v).as_slice()).filter(|w| !side.contains(w));
    let (sum, count) =
        outer.fold((Vec3::ZERO, 0.0), |(sum, count), &w| (sum + mesh.position(w), count + 1.0));
    sum * (1.0 / count)
}
