//! Smoothing without shrinkage (Taubin, *A signal processing approach to fair surface design*, 1995), with collision
//! handling and constant volume.
//!
//! Each iteration moves every vertex towards the mean of its neighbours, then away from it by slightly more. Noise is
//! damped, while shapes that extend over many edges are kept. What thin parts lose of their volume nevertheless is given
//! back to them ([`super::volume_balance`]).

use super::Embedding;
use super::unit_scale::unit_scale;
use super::volume_balance::VolumeBalance;
use crate::math::Vec3;
use crate::mesh::{Mesh, MeshError, VertexId};
use crate::pauses::{Pauses, finished};

/// Parameters of [`smooth`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Smoothing {
    /// The number of iterations, of two moves each; at most [`Smoothing::MAX_ITERATIONS`].
    pub iterations: usize,
    /// Whether each connected component keeps the volume that it encloses. Volume is given back where it was lost: thin
    /// parts keep their thickness, and lengths stay.
    pub keeps_volume: bool,
}

impl Smoothing {
    /// The largest number of iterations; by then, a shape is lost that extends over a hundred edges.
    pub const MAX_ITERATIONS: usize = 10_000;
}

/// The step towards the mean of the neighbours, as a fraction of the way (λ). Above 0.5, noise of the highest frequency
/// alternates.
const SHRINK: f32 = 0.5;

/// The step away from the mean of the neighbours, as a fraction of the way (−μ). With 1/λ + 1/μ = 0.1, shapes of more
/// than ten edges per period are kept; nearer to λ they are smoothed more slowly, far above it they swell.
const GROW: f32 = 0.526;

/// The largest offset that keeps the volume, in one move and in typical edges, so that components without volume do not
/// burst.
const MAX_OFFSET: f64 = 0.25;

/// The number of iterations after which volume is given back where it was lost. After more, thin parts have collapsed to
/// lines, which have no normals; with fewer, smoothing takes longer.
const BETWEEN: usize = 4;

/// The number of times that volume is given back at the end, to second order where parts are thin.
const BALANCES: usize = 2;

/// The relative error of the volume of a component up to which no further move corrects it.
const VOLUME_ERROR: f64 = 1e-6;

/// The largest number of moves after the last iteration that correct the volume.
const CORRECTIONS: usize = 8;

/// The largest number of vertices held back that are repaired locally.
const MOST_HELD: usize = 12;
/// The number of vertices for each of which one more may be held back, in larger meshes. With a lower number, whole parts
/// would keep their noise.
const VERTICES_PER_HELD: usize = 30;

/// The number of rings around vertices that were held back which are smoothed again with them.
const RINGS: usize = 1;

/// The largest number of iterations of that: 10 with two rings take six times as long, and normals of neighbours differ by
/// 3 to 7 % less.
const AGAIN: usize = 3;

/// Vertices moved per unit of work.
const PER_UNIT: usize = 50;

/// Vertices moved between two counts of the work.
const CHUNK: usize = 64 * PER_UNIT;

/// The length by which the ordinary edge of collision handling exceeds the mean edge, as a factor.
const ORDINARY_EDGE: f64 = 1.5;

/// Smooths a mesh: removes noise, and keeps its topology, and its volume if requested.
///
/// A mesh without self-intersections has none afterwards: vertices of triangles that would intersect are held back, and
/// smoothed again with their neighbours, with displacements shortened where triangles would intersect
/// ([`Embedding::move_some`]). If many have to be held back, all is smoothed like that, which takes about ten times as long.
/// Where a mesh intersects itself already, its vertices are held. Attributes are unchanged.
///
/// # Errors
/// [`MeshError::InvalidArgument`] for more than [`Smoothing::MAX_ITERATIONS`] iterations, or if a position would leave
/// the range of `f32`; [`MeshError::TooCrowded`]. The mesh is then unchanged.
pub fn smooth(mesh: &mut Mesh, smoothing: Smoothing) -> Result<(), MeshError> {
    finished(smooth_in_slices(mesh, smoothing, &Pauses::default()))
}

/// Smooths a mesh as [`smooth`] does, with pauses. If it is dropped at one of them, positions are neither the old nor the new
/// ones.
///
/// # Errors
/// As [`smooth`].
pub async fn smooth_in_slices(
    mesh: &mut Mesh,
    smoothing: Smoothing,
    pauses: &Pauses,
) -> Result<(), MeshError> {
    let Smoothing { iterations, keeps_volume } = smoothing;
    if iterations > Smoothing::MAX_ITERATIONS {
        let problem = format!("must be at most {}, got {iterations}", Smoothing::MAX_ITERATIONS);
        return Err(MeshError::InvalidArgument { parameter: "iterations", problem });
    }
    let edge = mean_edge(mesh);
    // A mesh collapsed to one point has nothing to smooth.
    if iterations == 0 || edge == 0.0 {
        return Ok(());
    }
    // The mean edge may be longer than the largest number.
    let [shrink, grow] = unit_scale(edge.min(f64::from(f32::MAX)) as f32);
    mesh.positions_mut().iter_mut().for_each(|p| *p *= shrink);
    let before = mesh.positions().to_vec();
    let mut smoother = Smoother::new(mesh, keeps_volume, pauses).await;
    smoother.run(mesh, iterations, pauses).await;
    let ordinary_edge = (edge * f64::from(shrink) * ORDINARY_EDGE) as f32;
    let smoothed = mesh.positions().to_vec();
    mesh.positions_mut().copy_from_slice(&before);
    smoother.guard = Some(embedding_of(mesh, ordinary_edge));
    if !smoother.move_to(mesh, &smoothed, iterations, pauses).await && smoother.check_pairs(mesh).is_ok() {
        smoother.run(mesh, iterations, pauses).await;
    }
    if let Err(error) = smoother.check_pairs(mesh) {
        mesh.positions_mut().iter_mut().zip(before).for_each(|(p, before)| *p = before * grow);
        return Err(error);
    }
    mesh.positions_mut().iter_mut().for_each(|p| *p *= grow);
    if mesh.positions().iter().all(|p| p.is_finite()) {
        return Ok(());
    }
    mesh.positions_mut().iter_mut().zip(before).for_each(|(p, before)| *p = before * grow);
    let problem = "smoothing would move a vertex beyond the range of f32 (3.4e38)".to_owned();
    Err(MeshError::InvalidArgument { parameter: "mesh", problem })
}

/// Returns the mean edge length, 0 without edges.
fn mean_edge(mesh: &Mesh) -> f64 {
    let length = |(u, v)| mesh.position(u).as_dvec3().distance(mesh.position(v).as_dvec3());
    let sum: f64 = mesh.edges().map(length).sum();
    if sum > 0.0 { sum / mesh.edge_count() as f64 } else { 0.0 }
}

fn embedding_of(mesh: &Mesh, ordinary_edge: f32) -> Embedding {
    let mut embedding = Embedding::default();
    embedding.set_limits_pairs(true);
    embedding.sync_with_edge(mesh, ordinary_edge);
    embedding
}

/// The state of smoothing a mesh.
struct Smoother {
    /// The collision guard that shortens displacements, if there is one.
    guard: Option<Embedding>,
    /// The components whose volumes are kept; none if they are not.
    components: Vec<Component>,
    /// Where volume was lost; `None` if it is not kept.
    balance: Option<VolumeBalance>,
    displacements: Vec<Vec3>,
}

/// A connected component whose volume is kept.
struct Component {
    vertices: Vec<VertexId>,
    triangles: Vec<[VertexId; 3]>,
    volume: f64,
}

impl Component {
    fn new(mesh: &Mesh, vertices: Vec<VertexId>) -> Self {
        let at = |&u: &VertexId| {
            let is_first = move |&(v, w): &(VertexId, VertexId)| u < v && u < w;
            mesh.ring(u).pairs().filter(is_first).map(move |(v, w)| [u, v, w])
        };
        let triangles: Vec<_> = vertices.iter().flat_map(at).collect();
        Self { volume: volume(mesh, &triangles), vertices, triangles }
    }

    /// Returns the volume that the component has lost, if it is noticeable.
    fn lost_volume(&self, mesh: &Mesh) -> Option<f64> {
        let lost = self.volume - volume(mesh, &self.triangles);
        (lost.abs() > VOLUME_ERROR * self.volume.abs()).then_some(lost)
    }

    /// Sets the displacements of the component's vertices to the offset along their normals that gives back a lost volume, to
    /// first order.
    fn set_offsets(&self, mesh: &Mesh, lost: f64, displacements: &mut [Vec3]) {
        let offset = (lost / area(mesh, &self.vertices)).clamp(-MAX_OFFSET, MAX_OFFSET);
        // NaN without an area.
        let offset = if offset.is_finite() { offset as f32 } else { 0.0 };
        self.vertices.iter().for_each(|&v| displacements[v.index()] = mesh.unit_normal(v) * offset);
    }
}

impl Smoother {
    /// Prepares to smooth `mesh` without a guard.
    async fn new(mesh: &Mesh, keeps_volume: bool, pauses: &Pauses) -> Self {
        let displacements = vec![Vec3::ZERO; mesh.slots()];
        if !keeps_volume {
            return Self { guard: None, balance: None, components: Vec::new(), displacements };
        }
        let balance = Some(VolumeBalance::new(mesh, pauses).await);
        let members = mesh.component_members();
        pauses.after(mesh.slots() / PER_UNIT).await;
        let components = members.into_iter().map(|vertices| Component::new(mesh, vertices)).collect();
        pauses.after(mesh.slots() / PER_UNIT).await;
        Self { guard: None, balance, components, displacements }
    }

    async fn run(&mut self, mesh: &mut Mesh, iterations: usize, pauses: &Pauses) {
        let all: Vec<VertexId> = mesh.vertices().collect();
        for i in 1..=iterations {
            self.step(mesh, &all, SHRINK, pauses).await;
            self.step(mesh, &all, -GROW, pauses).await;
            if i % BETWEEN == 0 {
                self.balance(mesh, &all, pauses).await;
            }
        }
        for _ in 0..BALANCES {
            self.balance(mesh, &all, pauses).await;
        }
        self.correct_volumes(mesh, pauses).await;
    }

    /// Moves all vertices to where they were smoothed, except where triangles would intersect: vertices there are held
    /// back, and smoothed again under the guard. Returns false, with nothing moved, if these are too many.
    async fn move_to(
        &mut self,
        mesh: &mut Mesh,
        smoothed: &[Vec3],
        iterations: usize,
        pauses: &Pauses,
    ) -> bool {
        let Some(guard) = &mut self.guard else { return false };
        let most = MOST_HELD.max(mesh.vertex_count() / VERTICES_PER_HELD);
        let Some(held) = guard.move_to_unless(mesh, smoothed, most, pauses).await else { return false };
        if held.is_empty() {
            return true;
        }
        let mut around: Vec<VertexId> = held.into_iter().map(|(v, _)| v).collect();
        (0..RINGS).for_each(|_| mesh.add_neighbours(&mut around));
        for _ in 0..iterations.min(AGAIN) {
            self.step(mesh, &around, SHRINK, pauses).await;
            self.step(mesh, &around, -GROW, pauses).await;
        }
        self.correct_volumes(mesh, pauses).await;
        true
    }

    /// Returns an error if the guard could not test all triangles.
    fn check_pairs(&self, mesh: &Mesh) -> Result<(), MeshError> {
        self.guard.as_ref().map_or(Ok(()), |guard| guard.check_pairs(mesh))
    }

    /// Gives volume back where it was lost, if it is to be kept.
    async fn balance(&mut self, mesh: &mut Mesh, all: &[VertexId], pauses: &Pauses) {
        let Some(balance) = &mut self.balance else { return };
        balance.displacements(mesh.positions(), MAX_OFFSET as f32, &mut self.displacements, pauses).await;
        self.apply(mesh, all, pauses).await;
    }

    /// Moves vertices, sorted by id, by their displacements, as far as the guard permits.
    async fn apply(&mut self, mesh: &mut Mesh, moving: &[VertexId], pauses: &Pauses) {
        if self.check_pairs(mesh).is_err() {
            return;
        }
        if let Some(guard) = &mut self.guard {
            guard.move_some_in_slices(mesh, moving, &mut self.displacements, pauses).await;
            return;
        }
        let positions = mesh.positions_mut();
        moving.iter().map(|v| v.index()).for_each(|i| positions[i] += self.displacements[i]);
    }

    /// Moves vertices, sorted by id, by `factor` of the way to the mean of their neighbours.
    async fn step(&mut self, mesh: &mut Mesh, moving: &[VertexId], factor: f32, pauses: &Pauses) {
        for chunk in moving.chunks(CHUNK) {
            for &v in chunk {
                let to_mean = mesh.ring(v).mean(mesh.positions()) - mesh.position(v);
                self.displacements[v.index()] = to_mean * factor;
            }
            pauses.after(chunk.len() / PER_UNIT).await;
        }
        self.apply(mesh, moving, pauses).await;
    }

    /// Restores the volumes after the last iteration, up to rounding.
    async fn correct_volumes(&mut self, mesh: &mut Mesh, pauses: &Pauses) {
        let mut differing: Vec<usize> = (0..self.components.len()).collect();
        for _ in 0..CORRECTIONS {
            let mut moving = Vec::new();
            differing.retain(|&k| {
                let component = &self.components[k];
                let lost = component.lost_volume(mesh);
                if let Some(lost) = lost {
                    component.set_offsets(mesh, lost, &mut self.displacements);
                    moving.extend_from_slice(&component.vertices);
                }
                lost.is_some()
            });
            if moving.is_empty() {
                return;
            }
            moving.sort_unstable();
            self.apply(mesh, &moving, pauses).await;
        }
    }
}

/// Returns the signed volume that the triangles of a connected component enclose.
fn volume(mesh: &Mesh, triangles: &[[VertexId; 3]]) -> f64 {
    let Some(&[first, ..]) = triangles.first() else { return 0.0 };
    let origin = mesh.position(first).as_dvec3();
    let six_volumes = triangles.iter().fold(0.0, |sum, corners| {
        let [u, v, w] = corners.map(|v| mesh.position(v).as_dvec3() - origin);
        sum + u.dot(v.cross(w))
    });
    six_volumes / 6.0
}

/// Returns the derivative of a component's volume by an offset of its vertices along their normals; this is about the
/// area.
fn area(mesh: &Mesh, vertices: &[VertexId]) -> f64 {
    vertices.iter().map(|&v| f64::from(mesh.area_normal(v).length())).sum::<f64>() / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Random};
    use crate::mesh::shapes::{cuboid, joined, torus};
    use crate::mesh::{TriangleMesh, count_self_intersections, measure};
    use crate::spatial::surface_distance;
    use crate::volume::{Grid, marching_cubes};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const TEN: Smoothing = Smoothing { iterations: 10, keeps_volume: true };

    /// Moves each vertex by a random displacement of at most `size`, as far as nothing intersects.
    fn shake(mesh: &mut Mesh, random: &mut Random, size: f32) {
        let mut guard = Embedding::default();
        guard.sync_with_edge(mesh, mean_edge(mesh) as f32 * 1.5);
        let mut displacements: Vec<Vec3> = (0..mesh.slots())
            .map(|_| Vec3::from([(); 3].map(|()| size * (2.0 * random.unit() as f32 - 1.0))))
            .collect();
        guard.move_all(mesh, &mut displacements);
    }

    fn deviation(mesh: &Mesh, radius: f32) -> f32 {
        let beyond = mesh.vertices().map(|v| mesh.position(v).length() - radius);
        (beyond.map(|d| d * d).sum::<f32>() / mesh.vertex_count() as f32).sqrt()
    }

    #[test]
    fn noise_is_removed_and_volume_kept() {
        let smooth_ball = Mesh::icosphere(Vec3::ZERO, 5.0, 0.5).unwrap();
        let mut mesh = smooth_ball.clone();
        shake(&mut mesh, &mut Random::new(3), 0.12);
        let (noise, volume) = (deviation(&mesh, 5.0), measure(&mesh.to_triangles()).volume);
        smooth(&mut mesh, TEN).unwrap();
        mesh.check().unwrap();
        let left = deviation(&mesh, 5.0);
        assert!(noise > 0.05 && left < 0.4 * noise, "{noise} {left}");
        assert!((measure(&mesh.to_triangles()).volume / volume - 1.0).abs() < 2e-6);
    }

    #[test]
    fn a_sphere_stays_a_sphere() {
        for (radius, edge) in [(5.0, 0.4), (1e-20, 1e-21), (3e30, 4e29)] {
            let mut mesh = Mesh::icosphere(Vec3::ZERO, radius, edge).unwrap();
            smooth(&mut mesh, Smoothing { iterations: 50, ..TEN }).unwrap();
            let off = mesh.vertices().map(|v| (mesh.position(v) / radius).length() - 1.0);
            let off = off.fold(0.0f32, |most, off| most.max(off.abs()));
            assert!(off < 2e-3, "{radius}: {off}");
        }
    }

    #[test]
    fn without_kept_volume_shapes_hardly_shrink() {
        let mut mesh = Mesh::from_triangles(&torus(3.0, 1.0, 60, 24)).unwrap();
        let before = measure(&mesh.to_triangles()).volume;
        smooth(&mut mesh, Smoothing { iterations: 20, keeps_volume: false }).unwrap();
        let after = measure(&mesh.to_triangles()).volume;
        assert!((after / before - 1.0).abs() < 0.03, "{before} {after}");
    }

    /// Sheets that nearly touch, needles and flat parts: nothing intersects, and the volume of each component is kept.
    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn nothing_intersects() {
        let mut held_volumes = 0;
        for seed in 0..24 {
            let mut random = Random::new(seed);
            let gap = [0.3, 0.05, 0.01][seed as usize % 3];
            let moved = |mut mesh: TriangleMesh, by: Vec3| {
                mesh.positions.iter_mut().for_each(|p| *p += by);
                mesh
            };
            let ball = |at, radius| Mesh::icosphere(at, radius, 0.5).unwrap().to_triangles();
            let mut hollow = ball(Vec3::ZERO, 1.0 - gap);
            hollow.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            let parts = [
                ball(Vec3::ZERO, 1.0),
                hollow,
                moved(torus((1.0 + gap).into(), 0.6, 9, 5), Vec3::X * (2.61 + 3.0 * gap)),
                moved(cuboid(Vec3::new(2.0, gap, 1.0)), Vec3::new(-1.0, -1.0 - 3.0 * gap, -0.5)),
            ];
            let mut mesh = Mesh::from_triangles(&joined(&parts)).unwrap();
            if count_self_intersections(&mesh.to_triangles()) > 0 {
                continue;
            }
            shake(&mut mesh, &mut random, 0.1);
            let before = mesh.to_triangles().components();
            smooth(&mut mesh, TEN).unwrap();
            mesh.check().unwrap();
            let after = mesh.to_triangles();
            assert_eq!(count_self_intersections(&after), 0, "seed {seed}");
            for (a, b) in before.iter().zip(after.components()) {
                let [a, b] = [a, &b].map(|part| measure(part).volume);
                held_volumes += usize::from((b / a - 1.0).abs() < 1e-3);
            }
        }
        assert!(held_volumes > 60, "{held_volumes}");
    }

    /// Regression: a mesh of a hundred spheres in one place took gigabytes.
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    #[test]
    fn meshes_in_one_place_are_refused_unchanged() {
        let ball = Mesh::icosahedron(Vec3::ZERO, 1.0);
        let mut mesh = ball.clone();
        while mesh.vertex_count() < 9000 {
            let mut other = ball.clone();
            let turn = mesh.vertex_count() as f32 * 1e-4;
            let (sin, cos) = (libm::sinf(turn), libm::cosf(turn));
            for p in other.positions_mut() {
                *p = Vec3::new(p.x * cos - p.y * sin, p.x * sin + p.y * cos, p.z);
            }
            mesh.append(&other).unwrap();
        }
        let before = mesh.positions().to_vec();
        let error = smooth(&mut mesh, Smoothing { iterations: 1, keeps_volume: false }).unwrap_err();
        assert!(matches!(error, MeshError::TooCrowded { .. }), "{error}");
        let moved = mesh.positions().iter().zip(&before).map(|(p, q)| p.distance(*q)).fold(0.0, f32::max);
        assert!(moved < 1e-6, "{moved}");
    }

    /// Returns the mesh smoothed without a guard, and the vertices that are held back on the way there; `None` if they are too
    /// many.
    fn unguarded(mesh: &Mesh, smoothing: Smoothing) -> (Mesh, Option<Vec<VertexId>>) {
        let mut smoothed = mesh.clone();
        let mut smoother = finished(Smoother::new(mesh, smoothing.keeps_volume, &Pauses::default()));
        finished(smoother.run(&mut smoothed, smoothing.iterations, &Pauses::default()));
        let mut guard = embedding_of(mesh, mean_edge(mesh) as f32 * 1.5);
        let most = MOST_HELD.max(mesh.vertex_count() / VERTICES_PER_HELD);
        let held =
            finished(guard.move_to_unless(&mut mesh.clone(), smoothed.positions(), most, &Pauses::default()));
        (smoothed, held.map(|held| held.into_iter().map(|(v, _)| v).collect()))
    }

    /// Returns the contour of `level`, positive inside, in 44 × 44 × 44 voxels, with noise of up to `noise` voxels. It has no
    /// self-intersections, but when it is smoothed, some triangles intersect.
    fn with_noise(seed: u64, noise: f64, level: impl Fn(DVec3) -> f64) -> Mesh {
        let mut random = Random::new(seed);
        let mut value = |i: usize| {
            let p = DVec3::from([i % 44, i / 44 % 44, i / 44 / 44].map(|k| k as f64 - 21.5));
            let inside = level(p).min(20.0 - p.abs().max_element());
            (inside + noise * (2.0 * random.unit() - 1.0)) as f32
        };
        let grid = Grid::new([44; 3], (0..44 * 44 * 44).map(&mut value).collect()).unwrap();
        Mesh::from_triangles(&marching_cubes(&grid, 0.0).unwrap()).unwrap()
    }

    /// Where few triangles would intersect, nothing else differs from what is smoothed without a guard, and every component
    /// keeps its volume.
    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn only_what_would_intersect_is_repaired() {
        let balls = |p: DVec3| (14.0 - p.length()).max(3.0 - (p - DVec3::splat(17.0)).length());
        // About as thick as the noise.
        let plate = |p: DVec3| 1.0 - p.z.abs();
        let plates = |p: DVec3| plate(p - DVec3::Z * 7.0 * (p.z / 7.0).round().clamp(-1.0, 1.0));
        let shapes = [
            (with_noise(0, 1.3, balls), 2),
            (with_noise(2, 1.3, balls), 2),
            (with_noise(3, 0.9, plate), 1),
            (with_noise(5, 0.9, plates), 1),
        ];
        for (k, (rough, components)) in shapes.into_iter().enumerate() {
            assert_eq!(count_self_intersections(&rough.to_triangles()), 0);
            let (expected, held) = unguarded(&rough, TEN);
            let mut around = held.unwrap();
            assert!(around.len() > 3, "shape {k}: {}", around.len());
            rough.add_neighbours(&mut around);
            let mut mesh = rough.clone();
            smooth(&mut mesh, TEN).unwrap();
            mesh.check().unwrap();
            assert_eq!(count_self_intersections(&mesh.to_triangles()), 0, "shape {k}");
            for v in mesh.vertices().filter(|v| around.binary_search(v).is_err()) {
                // Offsets that keep the volume are small.
                let off = mesh.position(v).distance(expected.position(v));
                assert!(off < 0.01, "shape {k}: {off}");
            }
            let [before, after] = [&rough, &mesh].map(|mesh| mesh.to_triangles().components());
            let volumes =
                before.iter().zip(&after).map(|pair| [pair.0, pair.1].map(|part| measure(part).volume));
            // Specks of noise collapse.
            let large: Vec<_> = volumes.filter(|[before, _]| *before > 50.0).collect();
            assert!(large.len() >= components, "shape {k}");
            assert!(
                large.iter().all(|[before, after]| (after / before - 1.0).abs() < 3e-6),
                "shape {k}: {large:?}"
            );
        }
    }

    /// With more noise than that, more vertices would have to be held back than can be repaired: all is smoothed under the
    /// guard.
    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn where_much_would_intersect_all_is_smoothed_under_the_guard() {
        let mut mesh = with_noise(1, 3.0, |p| 8.0 - p.length());
        let (_, held) = unguarded(&mesh, TEN);
        assert_eq!(held, None);
        let bend = |mesh: &Mesh| {
            let bends = mesh.edges().map(|(u, v)| 1.0 - mesh.unit_normal(u).dot(mesh.unit_normal(v)));
            bends.sum::<f32>() / mesh.edge_count() as f32
        };
        let before = bend(&mesh);
        smooth(&mut mesh, TEN).unwrap();
        assert_eq!(count_self_intersections(&mesh.to_triangles()), 0);
        assert!(bend(&mesh) < 0.95 * before, "{before} {}", bend(&mesh));
    }

    /// Vertices of triangles that intersect already are held; all others are smoothed.
    #[test]
    fn where_a_mesh_intersects_itself_already_it_is_held() {
        let ball = |at: Vec3| Mesh::icosphere(at, 3.0, 0.3).unwrap();
        let mut mesh = ball(Vec3::ZERO);
        mesh.append(&ball(Vec3::X * 5.96)).unwrap();
        let mut random = Random::new(4);
        for p in mesh.positions_mut() {
            *p += Vec3::from([(); 3].map(|()| 0.03 * (2.0 * random.unit() as f32 - 1.0)));
        }
        let before = mesh.clone();
        let held = embedding_of(&mesh, 0.45).intersecting_vertices(&mesh);
        let count = count_self_intersections(&mesh.to_triangles());
        assert!(count > 0 && held.len() < mesh.vertex_count() / 30, "{count} {}", held.len());
        smooth(&mut mesh, TEN).unwrap();
        let after = count_self_intersections(&mesh.to_triangles());
        assert!(after <= count && after > 0, "{count} {after}");
        let moved = mesh.vertices().filter(|&v| mesh.position(v) != before.position(v)).count();
        assert!(moved > mesh.vertex_count() - 2 * held.len(), "{moved}");
    }

    /// Returns the contour of the voxels of a box of `dims` for which `is_inside`, one voxel apart.
    fn voxelised(dims: [usize; 3], is_inside: impl Fn(DVec3) -> bool) -> TriangleMesh {
        let mut values = Vec::new();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                values.extend(
                    (0..dims[0]).map(|x| f32::from(is_inside(DVec3::from([x, y, z].map(|n| n as f64))))),
                );
            }
        }
        marching_cubes(&Grid::new(dims, values).unwrap(), 0.5).unwrap()
    }

    fn is_in_rod(p: DVec3, length: f64, half: f64, at: f64) -> bool {
        p.x > 1.0 && p.x < 2.0 + length && (p.y - at).abs() <= half && (p.z - at).abs() <= half
    }

    /// Returns thin shapes, and the axes along which their extents are to be kept.
    fn thin_shapes() -> Vec<(&'static str, TriangleMesh, &'static [usize])> {
        let rod = |half: f64| voxelised([40, 9, 9], move |p| is_in_rod(p, 36.0, half, 4.0));
        let tube = |p: DVec3, a: [f64; 3], b: [f64; 3], radius: f64| {
            let [a, b] = [a, b].map(DVec3::from);
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            p.distance(a.lerp(b, t)) < radius
        };
        let two_balls = |p: DVec3| [9.0, 40.0].iter().any(|&x| p.distance(DVec3::new(x, 9.0, 9.0)) < 7.0);
        vec![
            ("rod of one voxel", rod(0.0), &[0]),
            ("rod of three voxels", rod(1.0), &[0]),
            ("rod at the border", voxelised([30, 9, 9], |p| is_in_rod(p, 36.0, 1.0, 4.0)), &[0]),
            (
                "plate",
                voxelised([30, 30, 5], |p| p.z == 2.0 && (p.x - 14.5).abs().max((p.y - 14.5).abs()) < 12.0),
                &[0, 1],
            ),
            (
                "dumbbell",
                voxelised([50, 19, 19], |p| two_balls(p) || is_in_rod(p, 36.0, 0.0, 9.0) && p.x > 9.0),
                &[0],
            ),
            (
                "vessels",
                voxelised([60, 60, 20], |p| {
                    tube(p, [3.0, 30.0, 10.0], [25.0, 30.0, 10.0], 3.2)
                        || tube(p, [25.0, 30.0, 10.0], [56.0, 55.0, 8.0], 1.2)
                        || tube(p, [25.0, 30.0, 10.0], [57.0, 5.0, 12.0], 0.9)
                }),
                &[0, 1],
            ),
        ]
    }

    /// Returns the extents of a mesh along x, y and z.
    fn extents(mesh: &TriangleMesh) -> [f64; 3] {
        let [low, high] = measure(mesh).bounds;
        (high - low).to_array()
    }

    /// Volume that thin parts lose is given back to them, not to their ends, which would grow into needles: with an offset
    /// of all vertices by the same distance, the first rod is 1.7 times as long after 1,000 iterations.
    #[test]
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    fn lengths_stay_however_often_thin_parts_are_smoothed() {
        for (name, before, axes) in thin_shapes() {
            for iterations in [0, 1, 30, 100, 300, 1000] {
                let mut mesh = Mesh::from_triangles(&before).unwrap();
                smooth(&mut mesh, Smoothing { iterations, ..TEN }).unwrap();
                let after = mesh.to_triangles();
                assert_eq!(count_self_intersections(&after), 0, "{name} {iterations}");
                let ratio = measure(&after).volume / measure(&before).volume;
                assert!((ratio - 1.0).abs() < 1e-4, "{name} {iterations}: volume {ratio}");
                for &axis in axes {
                    let ratio = extents(&after)[axis] / extents(&before)[axis];
                    assert!((ratio - 1.0).abs() < 0.02, "{name} {iterations}: {ratio} along {axis}");
                }
                let distance = surface_distance(&after, &before).unwrap().hausdorff;
                assert!(distance < 1.0, "{name} {iterations}: {distance}");
            }
        }
    }

    /// A cone of needles, whose tip has 60 neighbours: the averages neither oscillate nor swell it.
    #[test]
    fn needles_and_high_valences_stay_bounded() {
        let rim = (0..60u32).map(|i| {
            let (sin, cos) = libm::sincosf(i as f32 * std::f32::consts::TAU / 60.0);
            Vec3::new(2.0 * cos, 2.0 * sin, 0.0)
        });
        let positions: Vec<Vec3> = [Vec3::Z * 10.0, Vec3::ZERO].into_iter().chain(rim).collect();
        let sides = (0..60u32).map(|i| [2 + i, 2 + (i + 1) % 60]);
        let triangles = sides.flat_map(|[a, b]| [[0, a, b], [1, b, a]]).collect();
        let cone = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
        for iterations in [10, 1000] {
            let mut mesh = Mesh::from_triangles(&cone).unwrap();
            smooth(&mut mesh, Smoothing { iterations, ..TEN }).unwrap();
            let after = mesh.to_triangles();
            assert!((measure(&after).volume / measure(&cone).volume - 1.0).abs() < 1e-4);
            assert!(extents(&after).into_iter().all(|extent| extent < 12.5), "{:?}", extents(&after));
        }
    }

    #[test]
    fn the_largest_meshes_stay_finite() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 0.9 * f32::MAX, 0.4 * f32::MAX).unwrap();
        smooth(&mut mesh, TEN).unwrap();
        assert!(mesh.vertices().all(|v| mesh.position(v).is_finite()));
        // Longer edges than the largest number.
        let mut largest = cuboid(Vec3::splat(2.0));
        largest.positions.iter_mut().for_each(|p| *p = (*p - Vec3::ONE) * f32::MAX);
        let mut mesh = Mesh::from_triangles(&largest).unwrap();
        let before = mesh.positions().to_vec();
        assert!(smooth(&mut mesh, Smoothing { iterations: 1, keeps_volume: true }).is_err());
        assert_eq!(mesh.positions(), before);
    }

    #[test]
    fn nothing_to_smooth_and_too_many_iterations() {
        let mut mesh = Mesh::from_triangles(&torus(3.0, 1.0, 8, 6)).unwrap();
        let before = mesh.clone();
        smooth(&mut mesh, Smoothing { iterations: 0, ..TEN }).unwrap();
        assert!(smooth(&mut mesh, Smoothing { iterations: 10_001, ..TEN }).is_err() && mesh == before);
        let mut point = Mesh::from_triangles(&cuboid(Vec3::ZERO)).unwrap();
        smooth(&mut point, TEN).unwrap();
        let mut flat = Mesh::from_triangles(&cuboid(Vec3::new(1.0, 1.0, 0.0))).unwrap();
        smooth(&mut flat, TEN).unwrap();
        assert!(flat.vertices().all(|v| flat.position(v).is_finite()));
    }
}
