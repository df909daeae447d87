//! Detail: the signed distance λ from each surface of the decomposition to the next finer one along its normals,
//! positive outwards, and its reconstruction on the deformed base (Kobbelt, Bareuther & Seidel, sections 2 and 3).

use super::correspondence::{BasePoint, Correspondence, UNSET, normal_at};
use super::prisms::PrismLookup;
use crate::math::Vec3;
use crate::math::order::{combined_rank, rank_f32, sort_by_rank};
use crate::mesh::{Mesh, MeshError, TriangleMesh, VertexId};
use crate::pauses::{Pauses, finished};
use crate::remesh::Embedding;
use crate::spatial::SurfaceWalker;
use std::rc::Rc;

/// One surface of the decomposition into base and detail, with its vertex normals.
#[derive(Clone, Debug)]
pub(super) struct Band {
    pub walker: SurfaceWalker,
    /// Unit vertex normals, by vertex index.
    pub normals: Vec<Vec3>,
}

impl Band {
    /// Builds a band from a closed, oriented mesh.
    ///
    /// # Errors
    /// As [`SurfaceWalker::new`].
    pub fn of(mesh: TriangleMesh) -> Result<Rc<Self>, MeshError> {
        let walker = SurfaceWalker::new(mesh)?;
        let normals = walker.mesh().vertex_normals();
        Ok(Rc::new(Self { walker, normals }))
    }
}

/// The surfaces of a decomposition from coarse to fine, with lookups that find where the normals of each hit the next
/// finer one.
#[derive(Clone, Debug)]
pub(super) struct Bands {
    pub all: Vec<Rc<Band>>,
    lookups: Vec<BandLookup>,
}

/// Finds where the normals of one surface of a decomposition hit the next finer one.
#[derive(Clone, Debug)]
struct BandLookup {
    /// The largest distance along a normal at which a hit counts, in units of the mesh; farther hits belong to another
    /// part of the surface.
    search_distance: f64,
    prisms: PrismLookup,
}

impl Bands {
    /// Prepares the surfaces of a decomposition, from coarse to fine with the base first, for [`Self::detail_at`].
    /// Pauses meanwhile.
    pub async fn new(all: Vec<Rc<Band>>, pauses: &Pauses) -> Self {
        let mut lookups = Vec::new();
        for pair in all.windows(2) {
            let search_distance = search_distance(&pair[0], &pair[1], pauses).await;
            let prisms = PrismLookup::new(&pair[0], &pair[1], search_distance);
            lookups.push(BandLookup { search_distance, prisms });
            pauses.now().await;
        }
        Self { lookups, all }
    }

    pub fn base(&self) -> &Band {
        &self.all[0]
    }

    pub fn finest(&self) -> &Band {
        &self.all[self.all.len() - 1]
    }

    /// Returns the detail at a point of the base: for each band above the base, its signed distance from the next
    /// coarser band along the normal of that band, positive outwards.
    pub fn detail_at(&self, at: &BasePoint) -> Detail {
        let mut detail = Detail { last: *at, ..NOTHING };
        for (k, BandLookup { search_distance, prisms }) in self.lookups.iter().enumerate() {
            let (from, to) = (&self.all[k], &self.all[k + 1]);
            let normal = normal_at(&from.walker, &from.normals, &detail.last);
            let hit = prisms.line_hit(to, &detail.last, normal, *search_distance);
            (detail.lambdas[k], detail.last) = hit.map_or_else(
                || to.closest_fallback(detail.last.point, normal),
                |found| (found.distance as f32, found.into()),
            );
            detail.is_missed |= hit.is_none();
        }
        detail
    }
}

/// The number of vertices whose closest points are found between two counts of the work.
const CHUNK: usize = 16;

/// The largest distance along the normals of a band at which a hit on the next finer band counts, as a multiple of the
/// largest distance between the two.
const SEARCH_FACTOR: f64 = 2.0;

/// Returns the largest distance along a normal of `from` at which a hit on `to` counts, in units of the mesh. Pauses
/// meanwhile.
pub(super) async fn search_distance(from: &Band, to: &Band, pauses: &Pauses) -> f64 {
    SEARCH_FACTOR * hausdorff_bound(from, to, pauses).await
}

/// Maximum number of bands above the base: the number of distances that a [`Detail`] has space for.
pub(super) const MAX_BANDS: usize = 8;

/// The detail at a point of the base: for each band above the base, its signed distance from the next coarser band
/// along the normal of that band, in units of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detail {
    lambdas: [f32; MAX_BANDS],
    /// Whether the normal of some band did not hit the next finer one, so that the closest point was used instead.
    pub is_missed: bool,
    /// The corresponding point on the finest surface of the decomposition, from which texture coordinates are taken.
    pub last: BasePoint,
}

impl Band {
    /// Returns the signed distance along `normal` from `origin` to the closest point of this surface, and that point:
    /// the fallback where the normal of the next coarser band hits nothing.
    fn closest_fallback(&self, origin: Vec3, normal: Vec3) -> (f32, BasePoint) {
        match self.walker.closest(origin) {
            Some(found) => ((found.point - origin).dot(normal), found.into()),
            None => (0.0, UNSET),
        }
    }
}

/// Returns the largest distance from a vertex of either surface to the other surface, for [`search_distance`].
async fn hausdorff_bound(a: &Band, b: &Band, pauses: &Pauses) -> f64 {
    let mut largest: f64 = 0.0;
    for (from, to) in [(a, b), (b, a)] {
        for some in from.walker.mesh().positions.chunks(CHUNK) {
            let distances = some.iter().filter_map(|&p| to.walker.closest(p));
            largest = distances.map(|found| found.distance).fold(largest, f64::max);
            pauses.after(CHUNK).await;
        }
    }
    largest
}

/// The deformed base with its detail, as reconstructed by [`detailed`].
pub(super) struct Detailed {
    pub mesh: Mesh,
    /// The corresponding point on the finest surface for each vertex of `mesh`, by slot; for texture coordinates.
    pub points: Correspondence,
    /// Number of vertices at which a normal missed the next finer surface, so that the closest point was used instead.
    pub unmatched_vertices: usize,
    /// Number of vertices whose displacement was shortened to avoid self-intersections, summed over the bands.
    pub held_vertices: usize,
}

/// How finely [`detailed`] subdivides the deformed base before it adds the detail.
#[derive(Clone, Copy, Debug)]
pub(super) struct DetailSampling {
    /// Length, in units of the mesh, above which an edge is split, measured between its ends displaced by the detail.
    /// Shorter edges are split if the detail at their midpoint deviates, see [`MAX_DEVIATION`].
    pub longest: f32,
    /// How often an edge of the deformed base may be halved; 0 adds no vertices.
    pub rounds: u32,
}

/// Reconstructs the detail on the deformed base `surface`, subdivided according to `sampling`: band by band, along the
/// normals of the surface displaced so far. `guard` shortens displacements that would make triangles intersect. If the
/// subdivision itself causes intersections, it is left out.
pub(super) fn detailed(
    surface: &Mesh,
    correspondence: &Correspondence,
    bands: &Bands,
    guard: &mut Embedding,
    sampling: DetailSampling,
) -> Detailed {
    finished(detailed_in_slices(surface, correspondence, bands, guard, sampling, &Pauses::default()))
}

/// Does what [`detailed`] does, and pauses meanwhile.
pub(super) async fn detailed_in_slices(
    surface: &Mesh,
    correspondence: &Correspondence,
    bands: &Bands,
    guard: &mut Embedding,
    sampling: DetailSampling,
    pauses: &Pauses,
) -> Detailed {
    let mut fine = DetailSamples::new(surface, correspondence, bands);
    for _ in 0..sampling.rounds {
        pauses.now().await;
        fine.refine(bands, sampling.longest);
    }
    let detailed = displace(fine, bands, guard, pauses).await;
    if sampling.rounds > 0 && guard.still_intersects(&detailed.mesh) {
        // A part of the membrane is so small that rounding dominates: edge midpoints then cause intersections.
        return displace(DetailSamples::new(surface, correspondence, bands), bands, guard, pauses).await;
    }
    detailed
}

/// Displaces the vertices of `samples` by their detail, band by band; `guard` shortens displacements that would cause
/// self-intersections.
async fn displace(samples: DetailSamples, bands: &Bands, guard: &mut Embedding, pauses: &Pauses) -> Detailed {
    let DetailSamples { mut mesh, normals, details: detail, .. } = samples;
    let mut held_vertices = 0;
    for k in 0..bands.lookups.len() {
        let mut displacements = vec![Vec3::ZERO; mesh.slots()];
        for v in mesh.vertices() {
            let normal = if k == 0 { normals[v.index()] } else { mesh.unit_normal(v) };
            displacements[v.index()] = normal * detail[v.index()].lambdas[k];
        }
        guard.sync_with_edge(&mesh, super::typical_edge(&mesh));
        let intended = displacements.clone();
        let all: Vec<VertexId> = mesh.vertices().collect();
        pauses.now().await;
        let back = guard.move_some_in_slices(&mut mesh, &all, &mut displacements, pauses).await;
        held_vertices += back.len();
        if !back.is_empty() {
            let mut displacements = spread_hold_back(&mesh, &intended, &back);
            guard.move_some_in_slices(&mut mesh, &all, &mut displacements, pauses).await;
        }
    }
    let missed = mesh.vertices().filter(|v| detail[v.index()].is_missed).count();
    Detailed {
        mesh,
        points: detail.into_iter().map(|detail| detail.last).collect(),
        unmatched_vertices: missed,
        held_vertices,
    }
}

/// Number of rings of neighbours around a held vertex (one whose displacement was shortened to avoid
/// self-intersections) that [`spread_hold_back`] moves back partly as well; without them, the surface has a crease
/// around it.
const SOFT_RINGS: usize = 4;

/// Returns corrections, by slot, that move the neighbours of held vertices back as well, less with every ring. Held are
/// the vertices whose displacement was shortened to avoid self-intersections: `held_back` lists them, each with the
/// share of its displacement by which it moved. `displacements` are the intended displacements of all vertices, by
/// slot.
fn spread_hold_back(mesh: &Mesh, displacements: &[Vec3], held_back: &[(VertexId, f32)]) -> Vec<Vec3> {
    let mut missing = vec![0.0_f32; mesh.slots()];
    held_back.iter().for_each(|&(v, share)| missing[v.index()] = 1.0 - share);
    let went = missing.clone();
    let mut neighbourhood: Vec<VertexId> = held_back.iter().map(|&(v, _)| v).collect();
    for _ in 0..SOFT_RINGS {
        mesh.add_neighbours(&mut neighbourhood);
        let mean = |v: VertexId| {
            let ring = mesh.ring(v).as_slice();
            ring.iter().map(|w| missing[w.index()]).sum::<f32>() / ring.len() as f32
        };
        let spread: Vec<f32> = neighbourhood.iter().map(|&v| mean(v).max(missing[v.index()])).collect();
        neighbourhood.iter().zip(spread).for_each(|(v, share)| missing[v.index()] = share);
    }
    let back = |(displacement, (before, after)): (&Vec3, (&f32, &f32))| *displacement * (before - after);
    displacements.iter().zip(went.iter().zip(&missing)).map(back).collect()
}

/// The vertices of the deformed base, with those that [`DetailSamples::refine`] adds by edge splits, and the detail at
/// each; by slot.
struct DetailSamples {
    mesh: Mesh,
    correspondence: Correspondence,
    normals: Vec<Vec3>,
    details: Vec<Detail>,
}

/// An edge is halved if its midpoint, displaced by the detail there, is farther than this share of
/// [`DetailSampling::longest`] from the middle between its displaced ends. With a larger value, noses and eyelids stay
/// blunt; with a smaller one, every edge is split.
const MAX_DEVIATION: f32 = 0.04;

impl DetailSamples {
    fn new(surface: &Mesh, correspondence: &Correspondence, bands: &Bands) -> Self {
        let ids = (0..surface.slots()).map(VertexId::from_index);
        let normals = surface.unit_normals();
        let detail = ids.map(|v| match surface.is_live(v) {
            true => bands.detail_at(&correspondence[v.index()]),
            false => NOTHING,
        });
        Self {
            details: detail.collect(),
            mesh: surface.clone(),
            correspondence: correspondence.clone(),
            normals,
        }
    }

    /// Returns the approximate position of vertex `v` with its detail, for decisions on edge splits: all bands are
    /// added along the normal of the deformed base.
    fn detailed_position(&self, v: VertexId) -> Vec3 {
        self.position_with(self.mesh.position(v), self.normals[v.index()], &self.details[v.index()])
    }

    fn position_with(&self, p: Vec3, normal: Vec3, detail: &Detail) -> Vec3 {
        p + normal * detail.lambdas.iter().sum::<f32>()
    }

    /// Splits edges at their midpoint, longest first: those that are longer than `longest` once displaced by their
    /// detail, and those whose displaced midpoint deviates as described at [`MAX_DEVIATION`].
    fn refine(&mut self, bands: &Bands, longest: f32) {
        let (mut splits, mut middles) = (Vec::new(), Vec::new());
        for (u, v) in self.mesh.edges() {
            let (p, q) = (self.detailed_position(u), self.detailed_position(v));
            let middle = self.middle(bands, u, v);
            let deviation =
                self.position_with(middle.position, middle.normal, &middle.detail).distance((p + q) * 0.5);
            if p.distance(q) > longest || deviation > MAX_DEVIATION * longest {
                splits.push((p.distance_squared(q), (u, v), middles.len()));
                middles.push(middle);
            }
        }
        sort_by_rank(&mut splits, |&(_, (u, v), _)| combined_rank(u.0, v.0));
        sort_by_rank(&mut splits, |&(square, ..)| (!rank_f32(square)).into());
        for (_, (u, v), k) in splits {
            let middle: &Sample = &middles[k];
            let Ok(w) = self.mesh.split(u, v, middle.position) else { continue };
            self.correspondence.resize(self.mesh.slots(), UNSET);
            self.normals.resize(self.mesh.slots(), Vec3::ZERO);
            self.details.resize(self.mesh.slots(), NOTHING);
            self.correspondence[w.index()] = middle.base_point;
            self.normals[w.index()] = middle.normal;
            self.details[w.index()] = middle.detail;
        }
    }

    /// Returns the midpoint of the edge `uv` of the deformed base, with the detail there.
    fn middle(&self, bands: &Bands, u: VertexId, v: VertexId) -> Sample {
        let (from, to) = (&self.correspondence[u.index()], &self.correspondence[v.index()]);
        let on_base = bands.base().walker.walk(from.triangle, (from.point + to.point) * 0.5);
        let base_point: BasePoint = on_base.into();
        Sample {
            position: (self.mesh.position(u) + self.mesh.position(v)) * 0.5,
            normal: (self.normals[u.index()] + self.normals[v.index()]).normalize_or_zero(),
            detail: bands.detail_at(&base_point),
            base_point,
        }
    }
}

/// The midpoint of an edge of the deformed base, with the detail there: a new vertex if the edge is split.
struct Sample {
    position: Vec3,
    normal: Vec3,
    base_point: BasePoint,
    detail: Detail,
}

/// No detail: the value at vertex slots that are free.
const NOTHING: Detail = Detail { lambdas: [0.0; MAX_BANDS], is_missed: false, last: UNSET };

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn a_vertex_held_back_holds_back_its_neighbourhood() {
        let mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.1).unwrap();
        let displacements: Vec<Vec3> = mesh.positions().iter().map(|&p| p * 0.1).collect();
        let held = VertexId::from_index(100);
        let back = spread_hold_back(&mesh, &displacements, &[(held, 0.0)]);
        assert_eq!(back[held.index()], Vec3::ZERO, "it has not gone");
        for &v in mesh.ring(held).as_slice() {
            let share =
                -back[v.index()].dot(displacements[v.index()]) / displacements[v.index()].length_squared();
            assert!(share > 0.1 && share < 0.5, "{share}");
        }
        let far = (0..mesh.slots()).filter(|&i| mesh.position(held).distance(mesh.positions()[i]) > 0.6);
        assert!(far.clone().count() > 100 && far.into_iter().all(|i| back[i] == Vec3::ZERO));
        assert!(
            spread_hold_back(&mesh, &displacements, &[])
                .iter()
                .all(|&displacement| displacement == Vec3::ZERO)
        );
    }
}
