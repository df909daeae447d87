//! Detail: the signed distance λ from each surface of the decomposition to the next finer one along its normals, and
//! its reconstruction on the deformed base (sections 2 and 3).

use super::link::{Link, Linked, NOWHERE, normal_at};
use super::prisms::Prisms;
use crate::math::Vec3;
use crate::mesh::{Mesh, MeshError, TriangleMesh, VertexId};
use crate::remesh::Embedding;
use crate::spatial::SurfaceWalker;
use std::rc::Rc;

/// One surface of the decomposition, with its vertex normals.
#[derive(Clone, Debug)]
pub(super) struct Band {
    pub walker: SurfaceWalker,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
}

impl Band {
    /// Builds a band from a closed mesh.
    pub fn of(mesh: TriangleMesh) -> Result<Rc<Self>, MeshError> {
        let walker = SurfaceWalker::new(mesh)?;
        let normals = walker.mesh().vertex_normals();
        Ok(Rc::new(Self { walker, normals }))
    }
}

/// The surfaces of a decomposition from coarse to fine, with lookups from each to the next.
#[derive(Clone, Debug)]
pub(super) struct Bands {
    pub all: Vec<Rc<Band>>,
    leaps: Vec<Leap>,
}

/// The lookup of normals from one surface of a decomposition to the next finer one.
#[derive(Clone, Debug)]
struct Leap {
    /// The largest distance of a hit; farther ones belong to another part of the surface.
    reach: f64,
    prisms: Prisms,
}

impl Bands {
    /// Prepares the surfaces of a decomposition, from coarse to fine; the first is the base.
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

    /// Returns the detail at a point of the base: for each band but the first, its signed distance from the band before
    /// along the normal.
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

/// The search distance along a normal, as a multiple of the largest distance between the two surfaces.
const REACH: f64 = 2.0;

/// Returns the search distance for hits along the normals of `from` on `to`.
pub(super) fn reach(from: &Band, to: &Band) -> f64 {
    REACH * farthest(from, to)
}

/// Maximum number of bands above the base.
pub(super) const MOST_BANDS: usize = 8;

/// The detail at a point of the base: the signed distances of all bands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Offsets {
    lambdas: [f32; MOST_BANDS],
    /// Whether a normal did not hit its surface and the closest point was used instead.
    pub missed: bool,
    /// The corresponding point on the finest surface.
    pub last: Linked,
}

impl Band {
    /// Returns the closest point to `origin`, and its signed distance along `normal`: the fallback where the normal
    /// hits nothing.
    fn beside(&self, origin: Vec3, normal: Vec3) -> (f32, Linked) {
        match self.walker.closest(origin) {
            Some(found) => ((found.point - origin).dot(normal), found.into()),
            None => (0.0, NOWHERE),
        }
    }
}

/// Returns the largest distance from a vertex of one surface to the other surface.
fn farthest(a: &Band, b: &Band) -> f64 {
    let one_way = |from: &Band, to: &Band| {
        let distances = from.walker.mesh().positions.iter().filter_map(|&p| to.walker.closest(p));
        distances.map(|found| found.distance).fold(0.0, f64::max)
    };
    one_way(a, b).max(one_way(b, a))
}

/// The deformed base with its detail.
pub(super) struct Detailed {
    pub mesh: Mesh,
    /// The corresponding point on the finest surface for each vertex, by slot; for texture coordinates.
    pub places: Link,
    /// Number of vertices whose normal hit no surface.
    pub missed: usize,
    /// Number of vertices that moved by less than their displacement, to avoid self-intersections.
    pub held: usize,
}

/// How finely the deformed base is sampled for the detail.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// Longer edges of the detailed surface are split.
    pub longest: f32,
    /// How often an edge of the deformed base may be halved.
    pub rounds: u32,
}

/// Reconstructs the detail on the deformed base `surface`, band by band, along the normals of the result so far.
/// Vertices move only as far as no triangles intersect.
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
    if fineness.rounds > 0 && guard.still_intersects(&shown.mesh) {
        // A part of the membrane is so small that rounding dominates: edge midpoints then cause intersections.
        return carried(Samples::new(surface, link, bands), bands, guard);
    }
    shown
}

/// Displaces the samples by their detail, band by band, guarded against self-intersections.
fn carried(samples: Samples, bands: &Bands, guard: &mut Embedding) -> Detailed {
    let Samples { mut mesh, normals, offsets, .. } = samples;
    let mut held = 0;
    for k in 0..bands.leaps.len() {
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        for v in mesh.vertices() {
            let normal = if k == 0 { normals[v.index()] } else { mesh.area_normal(v).normalize_or_zero() };
            ways[v.index()] = normal * offsets[v.index()].lambdas[k];
        }
        guard.sync_with_edge(&mesh, super::usual_edge(&mesh));
        let wanted = ways.clone();
        let back = guard.move_all(&mut mesh, &mut ways);
        held += back.len();
        if !back.is_empty() {
            let mut ways = softened(&mesh, &wanted, &back);
            guard.move_all(&mut mesh, &mut ways);
        }
    }
    let missed = mesh.vertices().filter(|v| offsets[v.index()].missed).count();
    Detailed { mesh, places: offsets.into_iter().map(|offsets| offsets.last).collect(), missed, held }
}

/// Number of one-rings around a held-back vertex that are moved back partly as well; without them, the surface has a
/// crease around it.
const SOFT_RINGS: usize = 4;

/// Returns corrections, by slot, that move the neighbours of held-back vertices back as well, less with every ring.
/// `ways` are the intended displacements of all vertices, and `held` the share of it that each held-back vertex moved
/// by.
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

/// The vertices of the deformed base, with those added by edge splits, and the detail at each; by slot.
struct Samples {
    mesh: Mesh,
    link: Link,
    normals: Vec<Vec3>,
    offsets: Vec<Offsets>,
}

/// An edge is halved if the detail at its midpoint is off the straight line by more than this share of the longest
/// edge. With a larger value, noses and eyelids stay blunt; with a smaller one, every edge is split.
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

    /// Returns the approximate position of a vertex with its detail: all bands along the normal of the deformed base.
    fn place(&self, v: VertexId) -> Vec3 {
        self.placed(self.mesh.position(v), self.normals[v.index()], &self.offsets[v.index()])
    }

    fn placed(&self, p: Vec3, normal: Vec3, offsets: &Offsets) -> Vec3 {
        p + normal * offsets.lambdas.iter().sum::<f32>()
    }

    /// Halves edges that are too long with their detail, or off it at their midpoint, longest first.
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

    /// Returns the midpoint of an edge, with its detail.
    fn middle(&self, bands: &Bands, u: VertexId, v: VertexId) -> Sample {
        let (from, to) = (&self.link[u.index()], &self.link[v.index()]);
        let on_base = bands.base().walker.walk(from.triangle, (from.point + to.point) * 0.5);
        let link: Linked = on_base.into();
        Sample {
            position: (self.mesh.position(u) + self.mesh.position(v)) * 0.5,
            normal: (self.normals[u.index()] + self.normals[v.index()]).normalize_or_zero(),
            offsets: bands.offsets(&link),
            link,
        }
    }
}

/// A point of the deformed base, with its detail.
struct Sample {
    position: Vec3,
    normal: Vec3,
    link: Linked,
    offsets: Offsets,
}

/// The entry of a free slot.
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
