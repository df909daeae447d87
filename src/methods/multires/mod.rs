//! Multiresolution deformation with dynamic connectivity.
//!
//! Kobbelt, Bareuther & Seidel, *Multiresolution shape deformations for meshes with dynamic vertex connectivity*. A
//! detailed surface M₁ is split into a smooth base M₀ and the signed distance λ to M₁ along the normals of M₀ (`base`,
//! `detail`; section 2). The deformed base S is a membrane over control ellipsoids (`ellipsoid`, `motion`), solved from
//! coarse to fine and remeshed on the way (`membrane`; sections 4 and 5). A map T leads from S back to M₀
//! (`correspondence`; section 3), where λ is sampled to reconstruct the detail on S (section 6). Without detail the
//! model is a lava lamp.
//!
//! Instead, a surface can hold itself (`held`): it is unchanged except where ellipsoids (`grip`, `handles`;
//! proposed by `proposal`) move it. The membrane has no part in it.
//!
//! # Guarantees
//! After every step the deformed base and the detailed surface are closed, oriented 2-manifolds without
//! self-intersections, but for components of a surface that holds itself that intersect as given. The same input gives
//! the same bits, natively and in wasm.
//!
//! # Limits
//! Detail is a displacement along normals: where it is longer than the radius of curvature of the base, it is shortened
//! so that the surface does not intersect itself.

mod base;
mod containment;
mod correspondence;
mod crossings;
mod detail;
mod distortion;
mod ellipsoid;
mod frame;
mod grip;
mod handles;
mod held;
mod membrane;
mod motion;
mod params;
mod prisms;
mod proposal;
mod setup;
mod space;
mod state;
mod texture;
mod topology;

pub use distortion::Distortion;
pub use ellipsoid::ControlEllipsoid;
pub use params::{Energy, MultiresParams, Support, Topology};

use super::method::method;
use super::{LiveSurface, MethodError, StepReport, Times};
use crate::math::{DVec3, triangle};
use crate::mesh::{Mesh, TriangleMesh, VertexId, measure};
use crate::pauses::{Pauses, finished};
use crate::remesh::{Changes, Embedding, restructure_in_slices};
use crate::warning::{Warning, WarningCode};
use containment::contains_centres;
use correspondence::{Correspondence, Current, folded, project};
use detail::{Bands, DetailSampling, Detailed, detailed, detailed_in_slices};
use ellipsoid::{Ellipsoid, check_ellipsoids, check_tips};
use held::{Before, Held, Placed};
use membrane::{pushed_positions, solve_with};
use motion::MovingEllipsoids;
use proposal::proposed;
use setup::{cannot_hold_itself, check_size, has_no_inside, identity, set_up, set_up_surface};
use space::ModelSpace;
use topology::displacements_to;

/// Options to create a [`MultiresolutionModel`].
#[derive(Clone, Debug, Default)]
pub struct MultiresOptions {
    /// The detailed surface M₁, which is deformed. Without it the model is a membrane without detail.
    pub detail: Option<TriangleMesh>,
    /// The base M₀, a low-frequency approximation of the detailed surface. By default it is made from the detailed
    /// surface, or around the ellipsoids if there is none.
    pub base: Option<TriangleMesh>,
    /// The control ellipsoids, at their initial positions: those that the membrane is spanned over, at least one, or those
    /// that leave a surface that holds itself as it is. If there are none for the latter, balls inside it are proposed.
    pub ellipsoids: Vec<ControlEllipsoid>,
    /// The support of the surface.
    pub support: Support,
    /// The parameters. If both edge bounds are 0, they are derived from the area of the base, else of the detail, else
    /// of the ellipsoids; a single one that is 0 is derived from the other.
    pub params: MultiresParams,
}

/// Convergence threshold: the model has converged when one more iteration moves the surface along its normals by at
/// most this share of the target edge, as a root mean square.
const TOLERANCE: f64 = 0.01;

/// The largest number of frames in which ellipsoids at rest wait for the membrane to converge. It takes fewer than ten,
/// seldom up to forty; where components that must not join press on each other, it may never do so.
const MAX_FRAMES_AT_REST: u32 = 100;

/// The largest number of vertices of the deformed base; a larger one is rejected with [`MethodError::TooManyVertices`].
const MAX_VERTICES: usize = 200_000;

/// A surface that is deformed by control ellipsoids and keeps its detail.
pub struct MultiresolutionModel {
    /// The space that everything below is in, and the model computes in.
    space: ModelSpace,
    bands: Bands,
    ellipsoids: MovingEllipsoids,
    /// The parameters with lengths in units of the model.
    model_params: MultiresParams,
    /// The parameters with lengths in world units, as the caller knows them.
    params: MultiresParams,
    /// The deformed base S, a membrane over the ellipsoids.
    surface: Mesh,
    /// The map T: the point of the base M₀ that belongs to each vertex of `surface`, by slot.
    correspondence: Correspondence,
    detailed: Detailed,
    /// The handles of a surface that holds itself; `None` for a membrane.
    held: Option<Held>,
    /// The state before a step in slices that is under way.
    before: Option<Box<Before>>,
    /// The collision guard, which shortens displacements so that no triangles intersect. Only its memory is reused
    /// between frames, not its state.
    guard: Embedding,
    components: u32,
    /// The number of components of the detail that a membrane is to keep; `None` for others.
    detail_components: Option<u32>,
    iteration: u32,
    /// Number of frames in a row that refreshed the membrane on the finest level only, 0 after a solve on all levels;
    /// at least 1 if such a solve is due once the ellipsoids stop.
    refreshed_frames: u32,
    /// Number of frames since the ellipsoids arrived or the parameters changed; see [`MAX_FRAMES_AT_REST`].
    frames_at_rest: u32,
    residual: f64,
    clock: fn() -> f64,
}

method!(MultiresolutionModel, MultiresParams);

impl LiveSurface for MultiresolutionModel {
    fn surface(&self) -> TriangleMesh {
        self.surface()
    }

    fn origin(&self) -> DVec3 {
        self.space.origin
    }

    fn counts(&self) -> [usize; 2] {
        self.mesh().counts()
    }

    fn versions(&self) -> [u32; 2] {
        self.mesh().versions()
    }
}

impl MultiresolutionModel {
    /// Creates a model before its first step: its surface is the base, remeshed and moved out of the ellipsoids, with
    /// the detail.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the option or parameter that cannot be used, and what is accepted;
    /// [`MethodError::Mesh`] for a detail or a base that is invalid, open or not manifold, or for a base that
    /// intersects itself; [`MethodError::TooManyVertices`] if the edge bounds are too short for the area of the base.
    pub fn new(options: MultiresOptions) -> Result<Self, MethodError> {
        finished(Self::begin(options))
    }

    /// Begins to create a model as [`Self::new`] does, in [slices](crate::pauses).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub async fn begin(options: MultiresOptions) -> Result<Self, MethodError> {
        let pauses = &Pauses::default();
        if options.support == Support::Surface {
            return Self::holding_itself(options, pauses).await;
        }
        let MultiresOptions { detail, base, ellipsoids: given, params, .. } = options;
        check_ellipsoids(&given)?;
        let has_detail = detail.is_some();
        let space = ModelSpace::of(detail.as_ref().or(base.as_ref()), &given);
        let [detail, base] = [detail, base].map(|mesh| mesh.map(|mesh| space.mesh(mesh)));
        let moving = MovingEllipsoids::new(&space.ellipsoids(&given));
        let ellipsoids = moving.now();
        pauses.now().await;
        let (bands, params) = set_up(detail, base, &ellipsoids, space.params(&params), pauses).await?;
        let bands = Bands::new(bands, pauses).await;
        let surface = Mesh::from_triangles(bands.base().walker.mesh())?;
        let finest = has_detail.then(|| measure(bands.finest().walker.mesh()).components as u32);
        let model = Self::from_parts(space, bands, moving, params, surface, pauses).await?;
        Ok(Self { detail_components: finest, ..model })
    }

    async fn from_parts(
        space: ModelSpace,
        bands: Bands,
        moving: MovingEllipsoids,
        params: MultiresParams,
        base: Mesh,
        pauses: &Pauses,
    ) -> Result<Self, MethodError> {
        let mut surface = base;
        check_size(area(&surface), &params)?;
        let mut guard = Embedding::default();
        guard.sync_with_edge(&surface, typical_edge(&surface));
        restructure_in_slices(&mut surface, params.bounds(), &mut guard, pauses).await;
        let positions = pushed_positions(&surface, &moving.now());
        let mut displacements = displacements_to(&surface, &positions);
        let all: Vec<VertexId> = surface.vertices().collect();
        guard.move_some_in_slices(&mut surface, &all, &mut displacements, pauses).await;
        pauses.now().await;
        let walker = &bands.base().walker;
        let identity = identity(walker);
        let before = Current { walker, correspondence: &identity };
        let correspondence = project(&surface, &before, walker, f64::MAX);
        pauses.now().await;
        let sampling = detail_sampling(&params);
        let detailed =
            detailed_in_slices(&surface, &correspondence, &bands, &mut guard, sampling, pauses).await;
        pauses.now().await;
        let mut model = Self {
            params: space.params_in_world(&params),
            space,
            components: 0,
            detail_components: None,
            bands,
            ellipsoids: moving,
            model_params: params,
            surface,
            correspondence,
            detailed,
            held: None,
            before: None,
            guard,
            iteration: 0,
            refreshed_frames: 0,
            frames_at_rest: 0,
            residual: f64::NAN,
            clock: || 0.0,
        };
        model.components = measure(&model.surface.to_triangles()).components as u32;
        Ok(model)
    }

    /// Creates a model of a surface that holds itself.
    async fn holding_itself(options: MultiresOptions, pauses: &Pauses) -> Result<Self, MethodError> {
        let MultiresOptions { detail, base, ellipsoids: given, params, .. } = options;
        let Some(detail) = detail.filter(|_| base.is_none()) else {
            return Err(cannot_hold_itself(base.is_some()));
        };
        if !given.is_empty() {
            check_ellipsoids(&given)?;
        }
        let space = ModelSpace::of(Some(&detail), &given);
        pauses.now().await;
        let (surface, params) = set_up_surface(space.mesh(detail), space.params(&params), pauses).await?;
        pauses.now().await;
        let mut ellipsoids = space.ellipsoids(&given);
        if ellipsoids.is_empty() {
            ellipsoids = proposed(&surface, pauses).await;
            if ellipsoids.is_empty() {
                return Err(has_no_inside(&surface));
            }
        }
        let held = Held::in_slices(&surface, &ellipsoids, params.edge_max, pauses).await?;
        pauses.now().await;
        let Placed { mesh, points, .. } = held.start().clone();
        pauses.now().await;
        let shown = identity(&surface.walker);
        let detailed = Detailed {
            mesh: Mesh::from_triangles(surface.walker.mesh())?,
            points: shown,
            unmatched_vertices: 0,
            held_vertices: 0,
        };
        pauses.now().await;
        let components = measure(surface.walker.mesh()).components as u32;
        pauses.now().await;
        Ok(Self {
            params: space.params_in_world(&params),
            space,
            components,
            detail_components: None,
            bands: Bands::new(vec![surface], pauses).await,
            ellipsoids: MovingEllipsoids::new(&ellipsoids),
            model_params: params,
            surface: mesh,
            correspondence: points,
            detailed,
            held: Some(held),
            before: None,
            guard: Embedding::default(),
            iteration: 0,
            refreshed_frames: 0,
            frames_at_rest: 0,
            residual: 0.0,
            clock: || 0.0,
        })
    }

    /// Returns what supports the surface.
    pub fn support(&self) -> Support {
        if self.held.is_some() { Support::Surface } else { Support::Membrane }
    }

    /// Sets the clock, in milliseconds, for [`StepReport::times`]. By default all times are 0: the core has no clock of
    /// its own.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// Returns the deformed surface with its detail, the result of the model, in the model's space: that of the world,
    /// unless what it was made from is very large, very small or far from the origin; see [`Self::surface`].
    pub fn mesh(&self) -> &Mesh {
        &self.detailed.mesh
    }

    /// Returns the deformed surface with its detail as triangles, with texture coordinates if the finest input surface
    /// has them.
    pub fn surface(&self) -> TriangleMesh {
        let mut mesh = self.detailed.mesh.to_triangles();
        let finest = &self.bands.finest().walker;
        mesh.corner_uvs = texture::corner_uvs(&self.detailed.mesh, &self.detailed.points, finest);
        mesh.texture = finest.mesh().texture.clone();
        self.space.in_world(mesh)
    }

    /// Solves a copy of the membrane for the current ellipsoids, and returns its mesh on each level of the solver, from
    /// coarse to fine, to show how the solver works (figure 8 of Kobbelt, Bareuther & Seidel).
    pub fn levels(&self) -> Vec<TriangleMesh> {
        let mut levels = Vec::new();
        if self.held.is_some() {
            return vec![self.base_surface()];
        }
        let ellipsoids = self.ellipsoids.now();
        let mut mesh = self.surface.clone();
        solve_with(&mut mesh, &ellipsoids, &self.model_params, self.model_params.levels, |mesh| {
            levels.push(self.space.in_world(mesh.to_triangles()));
        });
        levels
    }

    /// Returns how much the map T from the deformed base to the base M₀ distorts area and angles, per vertex.
    pub fn distortion(&self) -> Distortion {
        distortion::distortion(&self.surface, &self.correspondence)
    }

    /// Returns the deformed base S, without detail, in the model's space, as [`Self::mesh`].
    pub fn base_mesh(&self) -> &Mesh {
        &self.surface
    }

    /// Returns the deformed base S, without detail, as triangles.
    pub fn base_surface(&self) -> TriangleMesh {
        self.space.in_world(self.surface.to_triangles())
    }

    /// Returns the image of the deformed base under the map T, to show the correspondence: the triangles of
    /// [`Self::base_mesh`] with each vertex at its corresponding point on the undeformed base M₀.
    pub fn link_mesh(&self) -> TriangleMesh {
        let mut mesh = self.surface.to_triangles();
        mesh.positions = self.surface.vertices().map(|v| self.correspondence[v.index()].point).collect();
        mesh.normals = None;
        self.space.in_world(mesh)
    }

    /// Returns the current parameters.
    pub fn params(&self) -> &MultiresParams {
        &self.params
    }

    /// Sets the parameters, also during a run. On an error they are unchanged.
    ///
    /// # Errors
    /// As [`MultiresParams::validate`]; [`MethodError::InvalidArgument`] if the edges are too long for the membrane to
    /// hold on to the tips of an ellipsoid, and [`MethodError::TooManyVertices`] if they are too short for the area of
    /// the deformed base.
    pub fn set_params(&mut self, params: MultiresParams) -> Result<(), MethodError> {
        params.validate()?;
        let inner = self.space.params(&params);
        if self.held.is_none() {
            check_tips(&self.ellipsoids.targets(), inner.edge_max)?;
        }
        check_size(area(&self.surface), &inner)?;
        self.params = params;
        let before = std::mem::replace(&mut self.model_params, inner);
        if self.model_params != before {
            self.apply_params(&before);
        }
        Ok(())
    }

    /// Applies parameters that differ from those `before`: a change of `supersample` alone only reconstructs the
    /// detail, after any other the next steps solve the membrane again.
    fn apply_params(&mut self, before: &MultiresParams) {
        if let Some(held) = &mut self.held {
            held.is_unsettled = true;
            return;
        }
        let supersample = self.model_params.supersample;
        if self.model_params == (MultiresParams { supersample, ..before.clone() }) {
            self.reconstruct_detail();
        } else {
            self.solve_again();
        }
    }

    /// Ends convergence: the next steps solve the membrane again.
    fn solve_again(&mut self) {
        self.residual = f64::NAN;
        self.frames_at_rest = 0;
    }

    /// Sets new target ellipsoids, matched by index to the current ones, which move towards them step by step. An
    /// additional ellipsoid grows at its target, or emerges from the nearest ellipsoid if the centre of its target is
    /// outside the membrane; an ellipsoid without a target in `given` shrinks and is removed. On an error nothing
    /// changes.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for an empty list, for a centre out of range, for axes that span no ellipsoid,
    /// and for tips too sharp for the edges of the membrane.
    pub fn set_ellipsoids(&mut self, given: &[ControlEllipsoid]) -> Result<(), MethodError> {
        check_ellipsoids(given)?;
        let given = &self.space.ellipsoids(given);
        if self.held.is_some() {
            return Ok(self.set_handles(given)?);
        }
        check_tips(&given.iter().map(Ellipsoid::new).collect::<Vec<_>>(), self.model_params.edge_max)?;
        let surface = &self.surface;
        self.ellipsoids
            .set_targets(given, |target| contains_centres(surface, std::slice::from_ref(target))[0]);
        self.solve_again();
        Ok(())
    }

    /// Returns the ellipsoids in their current state, which steps move towards the targets, including those that are
    /// being removed.
    pub fn ellipsoids(&self) -> Vec<ControlEllipsoid> {
        let now: Vec<_> = self.ellipsoids.now().iter().map(Ellipsoid::control).collect();
        self.space.ellipsoids_in_world(&now)
    }

    /// Returns the target ellipsoids, without those that are being removed.
    pub fn targets(&self) -> Vec<ControlEllipsoid> {
        let targets: Vec<_> = self.ellipsoids.targets().iter().map(Ellipsoid::control).collect();
        self.space.ellipsoids_in_world(&targets)
    }

    /// Counts the triangles of the deformed base whose image on the base M₀ under T is flipped or has no area; 0 if the
    /// map is free of folds.
    pub fn folded(&self) -> usize {
        let base = self.bands.base();
        folded(&self.surface, &base.walker, &base.normals, &self.correspondence)
    }

    /// Returns the number of surfaces in the decomposition of the input, including the base and the detailed surface.
    pub fn band_count(&self) -> usize {
        self.bands.all.len()
    }

    /// Returns two counts of vertices from the last reconstruction of the detail: those where a normal did not hit the
    /// next finer surface, and those whose displacement was shortened to avoid self-intersections, summed over the
    /// bands; of a surface that holds itself, none, and the vertices that are not where the ellipsoids move them.
    pub fn detail_counts(&self) -> [usize; 2] {
        if let Some(held) = &self.held {
            return [0, held.held_vertices(&self.surface, &self.correspondence)];
        }
        [self.detailed.unmatched_vertices, self.detailed.held_vertices]
    }

    /// Advances the model by one frame: moves the ellipsoids towards their targets as far as the membrane can follow,
    /// and updates the membrane and its detail. Does nothing once the model is done: it has converged, or has not done so
    /// in 100 frames of ellipsoids at rest, as where components that must not join press on each other.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`] if the membrane would grow too large for its edge bounds; [`MethodError::Mesh`]
    /// if a position is not finite. The surface is then unchanged.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        finished(self.one_step(&Pauses::default()))
    }

    /// Makes one step as [`Self::step`] does, bit for bit, in [slices](crate::pauses) if the surface holds itself. Where the
    /// future is dropped in the middle, the model must not be used before [`Self::discard_step`].
    ///
    /// # Errors
    /// As [`Self::step`].
    pub async fn step_in_slices(&mut self) -> Result<StepReport, MethodError> {
        if !self.is_done() {
            self.keep_state_before();
        }
        let report = self.one_step(&Pauses::default()).await;
        self.before = None;
        report
    }

    async fn one_step(&mut self, pauses: &Pauses) -> Result<StepReport, MethodError> {
        let mut times = Times::default();
        let mut changes = Changes::default();
        if !self.is_done() {
            self.iteration = self.iteration.wrapping_add(1);
            changes = match self.held {
                Some(_) => self.held_frame(&mut times, pauses).await,
                None => self.frame(&mut times)?,
            };
        }
        Ok(self.report(changes, times))
    }

    fn is_done(&self) -> bool {
        if let Some(held) = &self.held {
            return self.ellipsoids.have_arrived() && !held.is_unsettled && self.residual <= TOLERANCE;
        }
        let has_converged =
            self.residual <= TOLERANCE && self.refreshed_frames == 0 && self.has_edges_as_wanted();
        let has_settled = has_converged || self.frames_at_rest >= MAX_FRAMES_AT_REST;
        // A membrane that encloses no ellipsoid shrinks until it has no vertices.
        self.surface.vertex_count() == 0 || self.ellipsoids.have_arrived() && has_settled
    }

    /// Reconstructs the detail on the deformed base, after a change of the base or of the parameters for the detail.
    fn reconstruct_detail(&mut self) {
        if self.held.is_some() {
            return self.show_held();
        }
        let detailed = detailed(
            &self.surface,
            &self.correspondence,
            &self.bands,
            &mut self.guard,
            detail_sampling(&self.model_params),
        );
        let replaced = std::mem::replace(&mut self.detailed, detailed);
        self.detailed.mesh.advance_versions_past(&replaced.mesh);
    }

    fn report(&self, events: Changes, times: Times) -> StepReport {
        let mesh = &self.detailed.mesh;
        StepReport {
            iteration: self.iteration,
            done: self.is_done(),
            phase: "frame".into(),
            progress: f64::NAN,
            residual: self.residual,
            tolerance: TOLERANCE,
            vertices: mesh.vertex_count() as u32,
            triangles: mesh.triangle_count() as u32,
            components: self.components,
            euler: mesh.euler() as i32,
            events,
            times,
            warnings: self.warnings(),
        }
    }

    fn warnings(&self) -> Vec<Warning> {
        if let Some(held) = &self.held {
            return held.warnings();
        }
        let apart = self.detail_components.filter(|&all| self.components > all).map(|all| {
            let text = format!(
                "The surface has come apart: it has {} parts, and the detail {all}. Where no ellipsoid is inside, nothing holds \
                 a membrane: place ellipsoids along all of it, near enough to overlap, or use support \"surface\".",
                self.components
            );
            Warning::new(WarningCode::Parts, text)
        });
        apart.into_iter().collect()
    }
}

fn detail_sampling(params: &MultiresParams) -> DetailSampling {
    DetailSampling { longest: params.edge_max as f32, rounds: params.supersample }
}

fn mean_edge(mesh: &Mesh) -> f64 {
    let length = |(u, v)| f64::from(mesh.position(u).distance(mesh.position(v)));
    mesh.edges().map(length).sum::<f64>() / mesh.edge_count().max(1) as f64
}

/// Returns an edge length that most edges are shorter than, for the grid of the collision guard.
fn typical_edge(mesh: &Mesh) -> f32 {
    (1.5 * mean_edge(mesh)) as f32
}

fn area(mesh: &Mesh) -> f64 {
    mesh.triangles().map(|corners| triangle::area(mesh.facet(corners).points)).sum()
}
