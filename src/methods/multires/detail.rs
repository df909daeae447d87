//! Detail: how far the next finer surface is along the normals of the coarser one (sections 2 and 3).

use super::link::{Link, Linked, NOWHERE, normal_at};
use super::prisms::Prisms;
use crate::math::Vec3;
use crate::mesh::{Mesh, MeshError, TriangleMesh, VertexId};
use crate::remesh::Embedding;
use crate::spatial::SurfaceWalker;
use std::rc::Rc;

/// One surface of the decomposition.
#[derive(Clone, Debug)]
pub(super) struct Band {
    pub walker: SurfaceWalker,
    /// Of its vertices, of length 1.
    pub normals: Vec<Vec3>,
}

impl Band {
    /// Of a closed mesh.
    pub fn of(mesh: TriangleMesh) -> Result<Rc<Self>, MeshError> {
        let walker = SurfaceWalker::new(mesh)?;
        let normals = walker.mesh().vertex_normals();
        Ok(Rc::new(Self { walker, normals }))
    }
}

/// The surfaces of a decomposition from coarse to fine, and how to get from each to the next.
#[derive(Clone, Debug)]
pub(super) struct Bands {
    pub all: Vec<Rc<Band>>,
    leaps: Vec<Leap>,
}

/// From one surface of a decomposition to the next.
#[derive(Clone, Debug)]
struct Leap {
    /// A hit further away belongs to another part of the surface.
    reach: f64,
    prisms: Prisms,
}

impl Bands {
    /// From coarse to fine; the first is the base.
    pub fn new(all: Vec<Rc<Band>>) -> Self {
        let leap = |pair: &[Rc<Band>]| {
            let reach = reach(&pair[0], &pair[1]);
            Leap { reach, prisms: Prisms::new(&pair[0], &pair[1], reach) }
        };
        Self { leaps: all.windows(2).map(leap).collect(), all }
    }

    pub fn base(&self) -> &Band {
        &self.all[0]
    }

    pub fn finest(&self) -> &Band {
        &self.all[self.all.len() - 1]
    }

    /// For each band but the first, how far it is from the one before along the normal at a place of the base: its share of
    /// the detail there.
    pub fn offsets(&self, at: &Linked) -> Offsets {
        let mut offsets = Offsets { last: *at, ..NOTHING };
        for (k, Leap { reach, prisms }) in self.leaps.iter().enumerate() {
            let (from, to) = (&self.all[k], &self.all[k + 1]);
            let normal = normal_at(&from.walker, &from.normals, &offsets.last);
            let met = prisms.line_hit(to, &offsets.last, normal, *reach);
            (offsets.lambdas[k], offsets.last) = met.map_or_else(
                || to.beside(offsets.last.point, normal),
                |found| (found.distance as f32, found.into()),
            );
            offsets.missed |= met.is_none();
        }
        offsets
    }
}

/// How far along a normal the next surface may be, in the largest distance between both.
const REACH: f64 = 2.0;

/// How far along a normal of one surface the other may be.
pub(super) fn reach(from: &Band, to: &Band) -> f64 {
    REACH * farthest(from, to)
}

/// Bands above the base that a decomposition can have.
pub(super) const MOST_BANDS: usize = 8;

/// The detail at a place of the base.
#[derive(Clone, Copy, Debug)]
pub(super) struct Offsets {
    lambdas: [f32; MOST_BANDS],
    /// Whether a normal did not meet its surface; the nearest point stands in.
    pub missed: bool,
    /// The place on the finest surface.
    pub last: Linked,
}

impl Band {
    /// The nearest point, and how far it is along the normal.
    fn beside(&self, origin: Vec3, normal: Vec3) -> (f32, Linked) {
        match self.walker.closest(origin) {
            Some(found) => ((found.point - origin).dot(normal), found.into()),
            None => (0.0, NOWHERE),
        }
    }
}

/// The largest distance from a vertex of either to the other.
fn farthest(a: &Band, b: &Band) -> f64 {
    let one_way = |from: &Band, to: &Band| {
        let distances = from.walker.mesh().positions.iter().filter_map(|&p| to.walker.closest(p));
        distances.map(|found| found.distance).fold(0.0, f64::max)
    };
    one_way(a, b).max(one_way(b, a))
}

/// What the detail put back makes of a surface.
pub(super) struct Detailed {
    pub mesh: Mesh,
    /// Where each vertex lies on the finest surface, by slot.
    pub places: Link,
    /// Vertices whose normal met no surface.
    pub missed: usize,
    /// Vertices that went less than their way, so that nothing crosses.
    pub held: usize,
}

/// How finely the detail is put back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// Longer edges of the detailed surface are split.
    pub longest: f32,
    /// How often an edge of the deformed base may be halved.
    pub rounds: u32,
}

/// Puts the detail on the deformed base, band by band, along the normals of what there is so far; only so far that
/// nothing crosses.
pub(super) fn detailed(
    surface: &Mesh,
    link: &Link,
    bands: &Bands,
    guard: &mut Embedding,
    fineness: Fineness,
) -> Detailed {
    let mut fine = Samples::new(surface, link, bands);
    for _ in 0..fineness.rounds {
        fine.refine(bands, fineness.longest);
    }
    let shown = carried(fine, bands, guard);
    if fineness.rounds > 0 && guard.left_crossing(&shown.mesh) {
        // A part of the skin is as small as rounding: there, the middles of edges cross what is beside them.
        return carried(Samples::new(surface, link, bands), bands, guard);
    }
    shown
}

/// The samples with their detail.
fn carried(samples: Samples, bands: &Bands, guard: &mut Embedding) -> Detailed {
    let Samples { mut mesh, normals, offsets, .. } = samples;
    let mut held = 0;
    for k in 0..bands.leaps.len() {
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        for v in mesh.vertices() {
            let normal = if k == 0 { normals[v.index()] } else { mesh.area_normal(v).normalize_or_zero() };
            ways[v.index()] = normal * offsets[v.index()].lambdas[k];
        }
        guard.follow_with(&mesh, super::usual_edge(&mesh));
        let wanted = ways.clone();
        let back = guard.carry(&mut mesh, &mut ways);
        held += back.len();
        if !back.is_empty() {
            let mut ways = softened(&mesh, &wanted, &back);
            guard.carry(&mut mesh, &mut ways);
        }
    }
    let missed = mesh.vertices().filter(|v| offsets[v.index()].missed).count();
    Detailed { mesh, places: offsets.into_iter().map(|offsets| offsets.last).collect(), missed, held }
}

/// How many rings around what was held back are drawn back a little, too: else it ends in a crack.
const SOFT_RINGS: usize = 4;

/// The ways back, by slot, that spread what some vertices were held back by among those around them; `ways` are what all were
/// to go, and the shares in `held` what these went of it.
fn softened(mesh: &Mesh, ways: &[Vec3], held: &[(VertexId, f32)]) -> Vec<Vec3> {
    let mut missing = vec![0.0_f32; mesh.slots()];
    held.iter().for_each(|&(v, share)| missing[v.index()] = 1.0 - share);
    let went = missing.clone();
    let mut around: Vec<VertexId> = held.iter().map(|&(v, _)| v).collect();
    for _ in 0..SOFT_RINGS {
        around.extend(around.clone().iter().flat_map(|&v| mesh.ring(v).as_slice()));
        around.sort_unstable();
        around.dedup();
        let mean = |v: VertexId| {
            let ring = mesh.ring(v).as_slice();
            ring.iter().map(|w| missing[w.index()]).sum::<f32>() / ring.len() as f32
        };
        let spread: Vec<f32> = around.iter().map(|&v| mean(v).max(missing[v.index()])).collect();
        around.iter().zip(spread).for_each(|(v, share)| missing[v.index()] = share);
    }
    let back = |(way, (before, after)): (&Vec3, (&f32, &f32))| *way * (before - after);
    ways.iter().zip(went.iter().zip(&missing)).map(back).collect()
}

/// The deformed base, perhaps with more vertices in its edges, and the detail at each; by slot.
struct Samples {
    mesh: Mesh,
    link: Link,
    normals: Vec<Vec3>,
    offsets: Vec<Offsets>,
}

/// An edge is halved where the detail in its middle is off the straight line by this share of the longest edge. With more,
/// noses and lids stay blunt; with less, all is split.
const BEND: f32 = 0.04;

impl Samples {
    fn new(surface: &Mesh, link: &Link, bands: &Bands) -> Self {
        let ids = (0..surface.slots()).map(VertexId::from_index);
        let normals = ids.clone().map(|v| surface.area_normal(v).normalize_or_zero()).collect();
        let offsets = ids.map(|v| match surface.is_live(v) {
            true => bands.offsets(&link[v.index()]),
            false => NOTHING,
        });
        Self { offsets: offsets.collect(), mesh: surface.clone(), link: link.clone(), normals }
    }

    /// Where a vertex comes to lie, about: along the normal of the base for all bands.
    fn place(&self, v: VertexId) -> Vec3 {
        self.placed(self.mesh.position(v), self.normals[v.index()], &self.offsets[v.index()])
    }

    fn placed(&self, p: Vec3, normal: Vec3, offsets: &Offsets) -> Vec3 {
        p + normal * offsets.lambdas.iter().sum::<f32>()
    }

    /// Halves edges that are too long with their detail, or do not follow it, longest first.
    fn refine(&mut self, bands: &Bands, longest: f32) {
        let mut wanted: Vec<(f32, VertexId, VertexId, Sample)> = Vec::new();
        for (u, v) in self.mesh.edges() {
            let (p, q) = (self.place(u), self.place(v));
            let middle = self.middle(bands, u, v);
            let bend = self.placed(middle.position, middle.normal, &middle.offsets).distance((p + q) * 0.5);
            if p.distance(q) > longest || bend > BEND * longest {
                wanted.push((p.distance_squared(q), u, v, middle));
            }
        }
        wanted.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, u, v, middle) in wanted {
            let Ok(w) = self.mesh.split(u, v, middle.position) else { continue };
            self.link.resize(self.mesh.slots(), NOWHERE);
            self.normals.resize(self.mesh.slots(), Vec3::ZERO);
            self.offsets.resize(self.mesh.slots(), NOTHING);
            self.link[w.index()] = middle.link;
            self.normals[w.index()] = middle.normal;
            self.offsets[w.index()] = middle.offsets;
        }
    }

    /// The middle of an edge, with its detail.
    fn middle(&self, bands: &Bands, u: VertexId, v: VertexId) -> Sample {
        let (from, to) = (&self.link[u.index()], &self.link[v.index()]);
        let on_base = bands.base().walker.march(from.triangle, (from.point + to.point) * 0.5);
        let link: Linked = on_base.into();
        Sample {
            position: (self.mesh.position(u) + self.mesh.position(v)) * 0.5,
            normal: (self.normals[u.index()] + self.normals[v.index()]).normalize_or_zero(),
            offsets: bands.offsets(&link),
            link,
        }
    }
}

/// One place of the deformed base, with its detail.
struct Sample {
    position: Vec3,
    normal: Vec3,
    link: Linked,
    offsets: Offsets,
}

/// At a free slot.
const NOTHING: Offsets = Offsets { lambdas: [0.0; MOST_BANDS], missed: false, last: NOWHERE };

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn what_is_held_back_draws_back_what_is_around_it() {
        let mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.1).unwrap();
        let ways: Vec<Vec3> = mesh.positions().iter().map(|&p| p * 0.1).collect();
        let held = VertexId::from_index(100);
        let back = softened(&mesh, &ways, &[(held, 0.0)]);
        assert_eq!(back[held.index()], Vec3::ZERO, "it has not gone");
        for &v in mesh.ring(held).as_slice() {
            let share = -back[v.index()].dot(ways[v.index()]) / ways[v.index()].length_squared();
            assert!(share > 0.1 && share < 0.5, "{share}");
        }
        let far = (0..mesh.slots()).filter(|&i| mesh.position(held).distance(mesh.positions()[i]) > 0.6);
        assert!(far.clone().count() > 100 && far.into_iter().all(|i| back[i] == Vec3::ZERO));
        assert!(softened(&mesh, &ways, &[]).iter().all(|&way| way == Vec3::ZERO));
    }
}
