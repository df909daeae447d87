//! Deformable model with automatic topology changes, coarse to fine.
//!
//! Lachaud & Montanvert, *Deformable meshes with automated topology changes for coarse-to-fine 3D surface extraction*.
//! A closed mesh moves under internal forces and forces of the image (`forces`, `motion`; sections 3.5–3.8). After each
//! move its edges are brought within bounds derived from δ, parts in contact are joined and necks are cut (the `remesh`
//! layer; sections 3.2–3.3). The mesh converges on a coarse level of an image pyramid first (`image`; section 4), is
//! refined by √3, and continues one level down (`schedule`; section 5.1).
//!
//! # Guarantees
//! After every step the mesh is a closed, oriented 2-manifold without self-intersections, and χ is as predicted by the
//! edits. The same input gives the same bits, natively and in wasm, also after [`DeformableModel::save`] and
//! [`DeformableModel::restore`].
//!
//! # Elongated voxels
//! The surface has the topology of the trilinearly interpolated image, also where voxels are up to 20 times as long as
//! wide: voxels more than twice as long are divided into nearly cubic parts, which are computed when they are needed.
//! Where voxels remain elongated, beyond 62 times as long, reports carry [`crate::warning::WarningCode::Anisotropic`].
//!
//! # Limits
//! With `adaptivity: 0`, sheets nearer to each other than the contact distance, 2.5/√3 δ, merge: holes and walls thinner
//! than that are lost, on coarse levels those thinner than the contact distance there.
//!
//! Features of less than four voxels are rounded off: the volume of thin sheets and strands, and of what is left of an
//! object that the border of the image or a mask cuts off, may differ by some percent from that of the contour, and
//! that of single voxels by a tenth. The topology is that of linear interpolation between voxels: voxels of the object
//! are connected through faces, those of the background also through edges and corners.
//!
//! Neither the outside of the image nor NaN is ever object. An object ends half a voxel beyond its outermost voxels
//! there.
//!
//! # Example
//! ```
//! use vesicle::math::{DAffine3, DVec3};
//! use vesicle::methods::deformable::{DeformableModel, DeformableOptions};
//! use vesicle::volume::{Space, Volume, VolumeInit, Voxels};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let ball = |i: usize| {
//!     let p = DVec3::new((i % 32) as f64, (i / 32 % 32) as f64, (i / 1024) as f64) - 15.5;
//!     (100.0 - 8.0 * (p.length() - 8.0)).clamp(0.0, 200.0) as f32
//! };
//! let volume = Volume::new(VolumeInit {
//!     voxels: Voxels::F32((0..32 * 32 * 32).map(ball).collect()),
//!     dims: [32, 32, 32, 1],
//!     affine: DAffine3::IDENTITY,
//!     slope: 1.0,
//!     intercept: 0.0,
//!     frame_seconds: 0.0,
//!     space: Space::Ras,
//! })?;
//! let mut model = DeformableModel::new(&volume, DeformableOptions { levels: 1, ..Default::default() })?;
//! while !model.step()?.done {}
//! assert_eq!(model.mesh().euler(), 2);
//! # Ok(())
//! # }
//! ```

mod awake;
mod balance;
mod checkpoint;
mod coarse;
mod contour;
mod coverage;
mod domain;
mod forces;
mod image;
mod image_guide;
mod jump;
mod motion;
mod params;
mod patch;
mod refresh;
mod renewal;
mod schedule;
mod seeds;
mod sizes;
mod sparse;
mod start;
mod state;

pub use coverage::{Coverage, CoverageSurvey, Missing, UncoveredRegion};
pub use params::{DeformableParams, Integrator, RestLength, Seeding, Topology};
pub use sparse::{SparseOptions, WorldBox};
pub use start::Start;

use super::method::method;
use super::{LiveSurface, MethodError, StepReport, Times};
use crate::math::{DAffine3, DVec3, Vec3};
use crate::mesh::{Mesh, ScalarKey, TriangleMesh, VectorKey, VertexId, grid_origin};
use crate::pauses::{Pauses, finished};
use crate::remesh::{Changes, Resolver, Sampling};
use crate::volume::Volume;
use checkpoint::{Checkpoint, Progress};
use contour::{ContourRule, ObjectIs};
use domain::Domain;
use forces::{Field, ForceScale, LocalAttractor};
use image::Pyramid;
use motion::{Motion, MotionContext, SpeedSummary};
use schedule::Convergence;
use sparse::{Before, Follow};
use start::{StartContext, contour_mesh};
use std::ops::RangeInclusive;

/// Options for creating a [`DeformableModel`].
#[derive(Clone, Debug)]
pub struct DeformableOptions {
    /// The index of the frame of a 4D volume that the surface is fitted to.
    pub frame: usize,
    /// The surface from which the run starts.
    pub start: Start,
    /// The number of pyramid levels above the volume itself; 0 evolves on the volume directly. In runs that do not seed
    /// missing parts, the surface settles a little outside the iso-surface on coarse levels, so that thin walls are not
    /// lost there.
    pub levels: usize,
    /// The mean edge length on the finest level in world units, averaged over directions if voxels are not cubes. By
    /// default 1.53 times the side of a cube with the volume of a voxel, or 0.85 times in images of less than four voxels
    /// along an axis. Voxels more than twice as long as wide are divided into nearly cubic parts, whose volume counts
    /// instead. At most 0.28 times the longest side of the image, or twice the default if that is more.
    pub edge: Option<f64>,
    /// The parameters of the model; by default [`DeformableParams::for_volume`].
    pub params: Option<DeformableParams>,
    /// The largest number of vertices of the surface, by default four million. Contours that it starts from, or is compared
    /// with, have at most eight times as many triangles.
    pub max_vertices: Option<usize>,
}

impl Default for DeformableOptions {
    fn default() -> Self {
        Self { frame: 0, start: Start::Contour, levels: 0, edge: None, params: None, max_vertices: None }
    }
}

/// A point set by the user that attracts, or repels, the surface within `radius`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Attractor {
    /// The position of the attractor in world space.
    pub point: DVec3,
    /// The spring constant of the force towards the attractor, which fades to 0 at its radius; negative values repel.
    pub strength: f64,
    /// The distance from the attractor, in world units, beyond which its force is zero.
    pub radius: f64,
}

/// The mean edge length of a mesh within its edge bounds, in δ, measured on converged spheres and skulls; it converts
/// the option `edge` to δ.
const MEAN_EDGE: f64 = 1.7;

/// The default δ on the finest level in voxels. It is near the upper end of the range that the paper gives, 0.693 to 1
/// voxels (14), since the number of vertices grows as 1/δ².
const DEFAULT_DELTA: f64 = 0.9;

/// The number of voxels along an axis below which an image is thin: all of its objects are.
const FEW_SLICES: usize = 4;

/// The default δ in thin images, in voxels. With [`DEFAULT_DELTA`], the rim of a disc in a single slice is rounded off, and
/// the disc loses a seventh of its volume; with less, there are more vertices, but the same volume.
const DELTA_OF_THIN: f64 = 0.5;

/// The accepted range of δ, the lower edge bound, on the finest level in voxels: with less, a mesh of the whole image
/// does not fit into memory; with more, the mesh misses the object, as it does in small images with more than
/// [`Domain::longest_delta`].
const DELTA_RANGE: RangeInclusive<f64> = 0.2..=20.0;

/// The largest number of voxels along an axis: with more, positions in single precision are a hundredth of a voxel apart.
const LONGEST_SIDE: usize = 1 << 17;

/// The largest absolute strength of an attractor; beyond it, forces overflow.
const MAX_STRENGTH: f64 = 1e3;
/// The largest radius and absolute coordinate of an attractor, in voxels of the volume; beyond it, forces overflow.
const MAX_ATTRACTOR_DISTANCE: f64 = 1e6;

/// The distance, in units of the lower edge bound δ, that a vertex travels before its edge bounds and contacts are
/// checked again.
const CHECK_TRAVEL: f32 = 0.1;

/// The number of iterations in which the edge bounds and contacts of each vertex that has moved at all are checked at
/// least once. A criterion on speed would miss slow vertices that travel far.
const CHECK_PERIOD: usize = 50;

/// The share of live vertex slots below which the mesh is renumbered, which removes free slots.
const MIN_OCCUPANCY: f32 = 0.7;

/// The keys of the vertex attributes in which the model's mesh stores the state of its vertices.
#[derive(Clone, Copy, Debug)]
struct Keys {
    velocity: VectorKey,
    /// The position of the vertex when its edge bounds and contacts were last checked.
    checked_position: VectorKey,
    /// The number of still iterations of the vertex in a row; from [`awake::ITERATIONS_TO_SLEEP`] on it sleeps.
    still_iterations: ScalarKey,
    /// The number of iterations since an edit made or displaced the vertex, without those in which it slept; while it
    /// is small, the speed of the vertex does not delay convergence.
    since_edit: ScalarKey,
    /// The decaying count of recent reversals of the vertex's velocity along its normal, by which the implicit
    /// integrator shortens steps.
    reversals: ScalarKey,
    /// The size of the vertex, its factor on δ, less 1: the local δ is δ · (1 + this).
    size: ScalarKey,
}

impl Keys {
    /// Adds the attributes to a start mesh.
    fn added_to(mesh: &mut Mesh) -> Self {
        Self {
            velocity: mesh.add_vector(),
            checked_position: mesh.add_vector(),
            still_iterations: mesh.add_scalar(),
            since_edit: mesh.add_scalar(),
            reversals: mesh.add_scalar(),
            size: mesh.add_scalar(),
        }
    }
}

/// The options of a model, whatever its image.
struct Origin {
    frame: usize,
    start: Start,
    edge: Option<f64>,
    params: DeformableParams,
    max_vertices: Option<usize>,
}

/// A closed mesh that evolves in an image under internal and external forces and changes its topology automatically.
#[derive(Clone, Debug)]
pub struct DeformableModel {
    pyramid: Pyramid,
    domain: Domain,
    to_world: DAffine3,
    voxel: f64,
    /// The index of the frame of the volume.
    frame: usize,
    params: DeformableParams,
    attractors: Vec<Attractor>,
    /// Whether the start was [`Start::Contour`], even if that contour was empty; [`Seeding::Auto`] depends on it.
    from_contour: bool,
    finest_delta: f64,
    level: usize,
    /// The iso value π_I on the current pyramid level, normalised to the range of the volume; moved towards the
    /// background on coarse levels of runs that do not seed missing parts.
    level_iso: f32,
    /// The factor by which α_I, the strength of the image force, is multiplied at the beginning of the current pyramid
    /// level; it decays with the explicit integrators.
    image_force_factor: f32,
    /// Whether [`Self::image_force_factor`] is still to be measured at the vertices, on a sparse level that has just begun.
    needs_factor: bool,
    /// Whether bricks of a sparse volume were asked for since the last iteration.
    has_asked: bool,
    /// The part of the surface that finer levels of a sparse volume follow; all of it if `None`.
    follow: Option<Follow>,
    mesh: Mesh,
    keys: Keys,
    resolver: Resolver,
    motion: Motion,
    iteration: u32,
    /// The number of iterations before the run began on its contour again, for another iso value.
    began: u32,
    convergence: Convergence,
    speed: SpeedSummary,
    components: u32,
    /// The numbers of edits made by [`Self::refresh`] since the last step, which the next one reports.
    refreshed: Changes,
    /// The state some steps ago, from which a step that is given up is undone.
    checkpoint: Option<Box<Checkpoint>>,
    /// The state before the step of a sparse volume that is under way.
    before: Option<Box<Before>>,
    clock: fn() -> f64,
}

method!(DeformableModel, DeformableParams);

impl LiveSurface for DeformableModel {
    fn surface(&self) -> TriangleMesh {
        self.surface()
    }

    fn origin(&self) -> DVec3 {
        self.world_origin()
    }

    fn counts(&self) -> [usize; 2] {
        self.mesh().counts()
    }

    fn versions(&self) -> [u32; 2] {
        self.mesh().versions()
    }
}

impl DeformableModel {
    /// Creates the model of one frame of `volume` on the coarsest pyramid level, with the edges of its start surface
    /// within bounds.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for an option or parameter that is not accepted; [`MethodError::Mesh`] for a
    /// start mesh that is not closed or intersects itself; [`MethodError::TooManyVertices`]; [`MethodError::Volume`] if
    /// there is no such frame or memory does not suffice.
    pub fn new(volume: &Volume, options: DeformableOptions) -> Result<Self, MethodError> {
        finished(Self::begin(volume, options)?)
    }

    /// Begins to create a model as [`Self::new`] does, in [slices](crate::pauses).
    ///
    /// # Errors
    /// As [`Self::new`], now or at the end.
    pub fn begin(
        volume: &Volume,
        options: DeformableOptions,
    ) -> Result<impl Future<Output = Result<Self, MethodError>> + use<>, MethodError> {
        let longest = volume.dims().into_iter().fold(0, usize::max);
        if longest > LONGEST_SIDE {
            let problem =
                format!("has {longest} voxels along an axis; at most {LONGEST_SIDE} can be fitted: crop it");
            return Err(MethodError::invalid("volume", problem));
        }
        let params = options.params.unwrap_or_else(|| DeformableParams::for_volume(volume));
        params.validate()?;
        let DeformableOptions { frame, start, levels, edge, max_vertices, .. } = options;
        let volume = volume.clone();
        Ok(async move {
            let pauses = Pauses::default();
            let pyramid = Pyramid::in_slices(&volume, frame, levels, &params, &pauses).await?;
            let affine = volume.affine();
            let origin = Origin { frame, start, edge, params, max_vertices };
            Self::from_pyramid(pyramid, affine, origin, &pauses).await
        })
    }

    /// Sets the largest number of vertices of the surface, see [`DeformableOptions::max_vertices`].
    pub fn set_max_vertices(&mut self, most: Option<usize>) {
        self.domain = self.domain.with_at_most(most);
        let finest = self.pyramid.delta_at(self.finest_delta, 0);
        self.resolver.set_max_vertices(self.domain.most_vertices(finest));
    }

    /// Returns the largest [`DeformableOptions::levels`] for a volume: each level has at least two voxels along every
    /// axis.
    pub fn max_levels(volume: &Volume) -> usize {
        image::max_levels(volume)
    }

    async fn from_pyramid(
        pyramid: Pyramid,
        affine: DAffine3,
        origin: Origin,
        pauses: &Pauses,
    ) -> Result<Self, MethodError> {
        let Origin { frame, start, edge, params, max_vertices } = origin;
        let to_world = pyramid.to_world(&affine);
        let voxel = libm::cbrt(to_world.matrix3.determinant().abs());
        let finest_delta = finest_delta(edge, voxel, pyramid.dims())?;
        let level = pyramid.levels.len() - 1;
        let delta = pyramid.delta_at(finest_delta, level);
        let domain = Domain::new(pyramid.dims(), delta).with_at_most(max_vertices);
        let context = StartContext::of(&pyramid, &params, domain, delta, &to_world);
        let from_contour = start == Start::Contour;
        let contour = if from_contour { contour_mesh(&context, pauses).await? } else { None };
        pauses.now().await;
        let begins_on_contour = contour.is_some();
        let mut mesh = match contour {
            Some(mesh) => mesh,
            None => {
                let guide = image_guide::guide(context.image, context.iso, &params);
                start.make(&context, |value| pyramid.normalised(value), &*guide, pauses).await?
            }
        };
        let keys = Keys::added_to(&mut mesh);
        let mut model = Self {
            to_world,
            frame,
            domain,
            voxel,
            params,
            attractors: Vec::new(),
            from_contour,
            finest_delta,
            level,
            level_iso: 0.0,
            image_force_factor: 1.0,
            needs_factor: false,
            has_asked: false,
            mesh,
            keys,
            resolver: Resolver::with_max_vertices(domain.most_vertices(pyramid.delta_at(finest_delta, 0))),
            pyramid,
            follow: None,
            motion: Motion::default(),
            iteration: 0,
            began: 0,
            convergence: Convergence::default(),
            speed: SpeedSummary::default(),
            components: 0,
            refreshed: Changes::default(),
            checkpoint: None,
            before: None,
            clock: || 0.0,
        };
        model.begin_on(begins_on_contour, pauses).await?;
        Ok(model)
    }

    /// Prepares a start mesh for the first iteration.
    async fn begin_on(&mut self, contour: bool, pauses: &Pauses) -> Result<(), MethodError> {
        self.watch_output();
        self.prepare_level(pauses).await?;
        pauses.now().await;
        if contour {
            self.resolve_contour(pauses).await?
        } else {
            self.reorder()
        }
        self.mark_checked();
        // No edit has displaced vertices recently.
        self.mesh.scalar_mut(self.keys.since_edit).fill(motion::ITERATIONS_AFTER_EDIT);
        Ok(())
    }

    /// Runs one iteration of the paper's figure 9: moves the vertices, then restores edge bounds and resolves contacts
    /// around those that travelled; descends one pyramid level if the surface has converged.
    ///
    /// Once the finest level has converged, calls change nothing and report `done`.
    ///
    /// # Errors
    /// [`MethodError::NeedsData`] if bricks of a sparse volume are missing; nothing has changed then, so that the results
    /// do not depend on when bricks arrive. [`MethodError::TooManyVertices`] if the surface grows without bound. It remains
    /// valid, but some edges are too long; other parameters may reduce it again. [`MethodError::InvalidArgument`] if the
    /// option `edge` is too long for the object. [`MethodError::Mesh`] and [`MethodError::Volume`] if memory does not
    /// suffice.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        self.checkpoint = None;
        match self.pyramid.sparse.clone() {
            Some(levels) => self.step_if_loaded(&levels),
            None => finished(self.iterate(&Pauses::default())),
        }
    }

    /// Makes one iteration, with pauses meanwhile; on a sparse volume [`Self::before`] is completed, by which it can be
    /// undone.
    async fn iterate(&mut self, pauses: &Pauses) -> Result<StepReport, MethodError> {
        let mut times = Times::default();
        let mut changes = std::mem::take(&mut self.refreshed);
        if !self.is_done() {
            self.move_vertices(&mut times, pauses).await;
            if self.pyramid.is_sparse() {
                self.prepare_edits()?;
            }
            if self.params.topology == Topology::Adaptive {
                let active = self.vertices_to_check();
                changes += self.restore_bounds(&active, &mut times, pauses).await;
            }
            self.iteration += 1;
            changes += self.update_convergence(&mut times, pauses).await?;
            self.count_components(changes);
            if let Some(most) = self.resolver.take_overflow() {
                return Err(MethodError::TooManyVertices { most });
            }
        }
        Ok(self.report(changes, times))
    }

    async fn move_vertices(&mut self, times: &mut Times, pauses: &Pauses) {
        let begin = (self.clock)();
        if self.pyramid.is_sparse() && std::mem::take(&mut self.needs_factor) {
            self.image_force_factor = self.measured_factor();
        }
        let examine_all = std::mem::take(&mut self.convergence.examine_next);
        self.motion.prepare(&self.mesh, self.keys, examine_all, self.followed_bounds());
        if let Some(before) = &mut self.before {
            before.keep(&self.mesh, self.keys, &self.motion.awake.with_neighbours);
        }
        let normals = (self.clock)();
        let delta = self.model_delta();
        let attractors = self.local_attractors();
        let image_force_factor = match self.params.integrator {
            Integrator::Implicit => self.image_force_factor,
            _ => coarse::decayed(
                self.image_force_factor,
                self.iteration.saturating_sub(self.convergence.began),
            ),
        };
        let context = MotionContext {
            field: Field {
                image: &self.pyramid.levels[self.level],
                scale: ForceScale::new(&self.params, [self.level_iso, image_force_factor], self.voxel, delta),
                attractors: &attractors,
            },
            domain: self.domain,
            params: &self.params,
            delta,
            examine_all,
            clock: self.clock,
        };
        let (clock, mut embedding) = (self.clock, 0.0);
        let (resolver, sampling) = (&mut self.resolver, Sampling::new(delta));
        let displace = async |mesh: &mut Mesh, moving: &[VertexId], displacements: &mut [Vec3]| {
            let begin = clock();
            let held = resolver.move_some_in_slices(mesh, sampling, moving, displacements, pauses).await;
            embedding = clock() - begin;
            held
        };
        self.speed = self.motion.advance(&mut self.mesh, self.keys, &context, displace, pauses).await;
        let forces = std::mem::take(&mut self.motion.forces.milliseconds);
        times.add("normals", normals - begin);
        times.add("forces", forces);
        times.add("embedding", embedding);
        times.add("motion", (self.clock)() - normals - forces - embedding);
    }

    /// Returns the vertices whose edge bounds and contacts have to be checked, and marks them as checked: moving ones
    /// that have travelled [`CHECK_TRAVEL`] since their last check, and in turn one of every [`CHECK_PERIOD`] vertices
    /// if it has moved at all.
    fn vertices_to_check(&mut self) -> Vec<VertexId> {
        let limit = CHECK_TRAVEL * self.model_delta();
        let turn = (self.iteration - self.began) as usize % CHECK_PERIOD;
        let checked = self.mesh.vector(self.keys.checked_position);
        let travelled = |v: VertexId| checked[v.index()].distance_squared(self.mesh.position(v));
        let moving = self.motion.awake.moving.iter().copied();
        let mut active: Vec<VertexId> = moving.filter(|&v| travelled(v) > limit * limit).collect();
        let in_turn = (turn..self.mesh.slots()).step_by(CHECK_PERIOD).map(VertexId::from_index);
        active.extend(in_turn.filter(|&v| self.mesh.is_live(v) && travelled(v) > 0.0 && self.follows(v)));
        let (positions, checked) = self.mesh.positions_and_vector_mut(self.keys.checked_position);
        active.iter().for_each(|v| checked[v.index()] = positions[v.index()]);
        active
    }

    /// Restores edge bounds and resolves contacts around the vertices `active`, wakes the edited vertices and their
    /// neighbours, and renumbers the mesh if too few of its slots are live. Returns the numbers of edits.
    async fn restore_bounds(&mut self, active: &[VertexId], times: &mut Times, pauses: &Pauses) -> Changes {
        let begin = (self.clock)();
        let sampling = self.sampling();
        let changes = {
            let image = &self.pyramid.levels[self.level];
            let guide =
                image_guide::guide_within(image, self.level_iso, &self.params, self.followed_bounds());
            self.resolver.resolve_in_slices(&mut self.mesh, sampling, active, &*guide, pauses).await
        };
        let since_edit = self.mesh.scalar_mut(self.keys.since_edit);
        self.resolver.edited().iter().for_each(|v| since_edit[v.index()] = 0.0);
        let (rings, still) = self.mesh.rings_and_scalar_mut(self.keys.still_iterations);
        for v in self.resolver.edited().iter().map(|v| v.index()) {
            still[v] = 0.0;
            rings[v].as_slice().iter().for_each(|w| still[w.index()] = 0.0);
        }
        if self.mesh.occupancy() < MIN_OCCUPANCY {
            self.reorder();
        }
        times.add("topology", (self.clock)() - begin);
        changes
    }

    /// Returns the least volume of a part in model units.
    fn smallest_part(&self) -> f64 {
        self.params.smallest_part * self.pyramid.voxel()
    }

    /// Returns what contours of the model's image at a normalised intensity are extracted by.
    fn contour_rule(&self, iso: f32) -> ContourRule {
        ContourRule {
            iso,
            object: ObjectIs::by(&self.params),
            smallest_part: self.smallest_part(),
            most: self.domain.most_triangles(),
        }
    }

    fn sampling(&self) -> Sampling {
        Sampling::new(self.model_delta()).with_sizes(self.keys.size)
    }

    /// Returns whether each pyramid level is searched for parts of its contour that the mesh lacks, which are then
    /// added; the parameter `seeding` decides.
    fn seeds_levels(&self) -> bool {
        match self.params.seeding {
            _ if self.pyramid.is_sparse() => false,
            Seeding::Auto => self.from_contour,
            Seeding::On => true,
            Seeding::Off => false,
        }
    }

    /// Makes collision handling also prevent self-intersections that arise when the surface is mapped to world space
    /// and rounded to single precision, except where rounding is too coarse for that.
    fn watch_output(&mut self) {
        self.resolver.watch_output(self.to_surface(), &self.domain.bounds);
    }

    fn reorder(&mut self) {
        self.resolver.reorder(&mut self.mesh, 0);
    }

    fn count_components(&mut self, changes: Changes) {
        if changes.changed_topology() {
            self.components = self.mesh.component_count() as u32;
        }
    }

    /// Marks the edge bounds and contacts of every vertex as checked at its current position, and counts the connected
    /// components.
    fn mark_checked(&mut self) {
        let (positions, checked) = self.mesh.positions_and_vector_mut(self.keys.checked_position);
        checked.copy_from_slice(positions);
        self.components = self.mesh.component_count() as u32;
    }

    fn report(&self, events: Changes, times: Times) -> StepReport {
        let done = self.is_done();
        StepReport {
            iteration: self.iteration,
            done,
            phase: if done { "done".into() } else { format!("level {}", self.level) },
            progress: self.progress(),
            residual: self.energy(),
            tolerance: self.params.energy_tolerance,
            vertices: self.mesh.vertex_count() as u32,
            triangles: self.mesh.triangle_count() as u32,
            components: self.components,
            euler: self.mesh.euler() as i32,
            events,
            times,
            warnings: self.pyramid.warnings(&self.params),
        }
    }

    /// Replaces all parameters from the next step on, and wakes all sleeping vertices; a finished run continues. A run that
    /// began on the contour begins again on that of a new iso value, if the surface of that is more than four voxels away
    /// from a tenth of the vertices.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for values out of range, [`MethodError::Volume`] if the gradient image does not
    /// fit into memory, those of [`Self::new`] if the run begins again; nothing is changed then.
    pub fn set_params(&mut self, params: DeformableParams) -> Result<(), MethodError> {
        self.checkpoint = None;
        self.check_params(&params)?;
        if self.jumps_with(&params) {
            return self.begin_again(params);
        }
        let adapted = self.pyramid.adapted(&params)?;
        let image = adapted.map(|adapted| std::mem::replace(&mut self.pyramid, adapted));
        let before = std::mem::replace(&mut self.params, params);
        if let Err(error) = finished(self.prepare_level(&Pauses::default())) {
            self.params = before;
            if let Some(image) = image {
                self.pyramid = image;
            }
            return Err(error);
        }
        self.wake_all();
        Ok(())
    }

    fn check_params(&self, params: &DeformableParams) -> Result<(), MethodError> {
        params.validate()?;
        if self.pyramid.is_sparse() { sparse::check_params(params) } else { Ok(()) }
    }

    /// The current parameters of the model.
    pub fn params(&self) -> &DeformableParams {
        &self.params
    }

    /// Replaces the attractors from the next step on, and wakes all sleeping vertices; a finished run continues.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if a number is not finite or too large, or a radius is not positive.
    pub fn set_attractors(&mut self, attractors: Vec<Attractor>) -> Result<(), MethodError> {
        self.checkpoint = None;
        self.check_attractors(&attractors)?;
        self.attractors = attractors;
        self.wake_all();
        Ok(())
    }

    fn check_attractors(&self, attractors: &[Attractor]) -> Result<(), MethodError> {
        let from_world = self.to_world.inverse();
        for (i, a) in attractors.iter().enumerate() {
            let local = from_world.transform_point3(a.point) / MAX_ATTRACTOR_DISTANCE;
            let radius = a.radius / (MAX_ATTRACTOR_DISTANCE * self.voxel);
            let fits = local.abs().max_element() <= 1.0 && a.strength.abs() <= MAX_STRENGTH;
            if !(fits && local.is_finite() && radius > 0.0 && radius <= 1.0) {
                let problem = format!(
                    "attractor {i}: |strength| must be ≤ {MAX_STRENGTH}, the radius > 0, and point and radius within \
                     {MAX_ATTRACTOR_DISTANCE} voxels"
                );
                return Err(MethodError::invalid("attractors", problem));
            }
        }
        Ok(())
    }

    fn local_attractors(&self) -> Vec<LocalAttractor> {
        let from_world = self.to_world.inverse();
        let local = |a: &Attractor| LocalAttractor {
            point: from_world.transform_point3(a.point).as_vec3(),
            strength: a.strength as f32,
            in_radii: (self.to_world.matrix3 * (1.0 / a.radius)).as_mat3(),
        };
        self.attractors.iter().map(local).collect()
    }

    /// Computes the quantities that depend on the pyramid level and the parameters: the gradient image if a gradient
    /// force acts, the iso value π_I and the factor on α_I, the strength of the image force.
    async fn prepare_level(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        self.pyramid.levels[self.level].prepare_gradient_for(&self.params)?;
        self.motion.forces.forget_image();
        self.needs_factor = self.pyramid.levels[self.level].bricks().is_some();
        if self.needs_factor {
            self.level_iso = self.pyramid.iso(&self.params);
            return Ok(());
        }
        self.level_iso = if self.seeds_levels() || self.pyramid.is_sparse() {
            self.pyramid.iso(&self.params)
        } else {
            coarse::iso(&self.pyramid, &self.params, self.level)
        };
        let here = [self.level_iso, self.model_delta()];
        self.image_force_factor = coarse::gain(&self.pyramid, &self.params, self.level, here, pauses).await;
        Ok(())
    }

    /// The current pyramid level; 0 is the volume itself.
    pub fn level(&self) -> usize {
        self.level
    }

    /// δ, the lower bound of the edge length, on the current pyramid level in world units, averaged over directions if
    /// voxels are not cubes.
    pub fn delta(&self) -> f64 {
        f64::from(self.model_delta()) * self.voxel
    }

    fn model_delta(&self) -> f32 {
        self.pyramid.delta_at(self.finest_delta, self.level)
    }

    /// The mesh in model space: the index space of the volume, or of the parts into which elongated voxels are divided,
    /// where these are unit cubes.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the surface in world space with normals, its triangles counter-clockwise seen from outside.
    pub fn surface(&self) -> TriangleMesh {
        let surface = self.mesh.to_triangles().transformed(&self.to_surface());
        TriangleMesh { origin: self.world_origin(), ..surface }
    }

    /// Returns the origin of the surface in world space, see [`TriangleMesh::origin`].
    fn world_origin(&self) -> DVec3 {
        grid_origin(&self.to_world, self.pyramid.dims())
    }

    /// Returns the map from model space to positions of the surface, relative to its origin.
    fn to_surface(&self) -> DAffine3 {
        DAffine3::from_translation(-self.world_origin()) * self.to_world
    }

    /// Returns the speed of each vertex of [`Self::surface`] along its outward normal, negative inwards, in world units
    /// per unit of time. An iteration counts as Δt also with the implicit integrator, whose steps are longer. Vertices
    /// made by edits have speeds interpolated between their neighbours; sleeping vertices and new seeds have 0.
    pub fn speeds(&self) -> Vec<f32> {
        let normals = self.surface().normals.unwrap_or_default();
        let velocities = self.mesh.vector(self.keys.velocity);
        let steps = self.params.step_length() / self.params.time_step;
        let along = |(v, normal): (VertexId, Vec3)| {
            let velocity = self.to_world.matrix3 * velocities[v.index()].as_dvec3();
            (steps * velocity.dot(normal.as_dvec3())) as f32
        };
        self.mesh.vertices().zip(normals).map(along).collect()
    }

    /// Sets the clock, in milliseconds, with which steps measure the durations in their reports. By default all
    /// durations are 0.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }
}

/// Converts the option `edge`, the mean edge length in world units, to δ on the finest level in voxels; `None` gives
/// [`DEFAULT_DELTA`], or less in an image of few slices. `voxel` is the side, in world units, of a cube with the volume of
/// a voxel.
fn finest_delta(edge: Option<f64>, voxel: f64, dims: [usize; 3]) -> Result<f64, MethodError> {
    let Some(edge) = edge else {
        let is_thin = dims.into_iter().any(|n| n < FEW_SLICES);
        return Ok(if is_thin { DELTA_OF_THIN } else { DEFAULT_DELTA });
    };
    let delta = edge / voxel / MEAN_EDGE;
    let most = Domain::longest_delta(dims).max(2.0 * DEFAULT_DELTA).min(*DELTA_RANGE.end());
    if (*DELTA_RANGE.start()..=most).contains(&delta) {
        return Ok(delta);
    }
    let [low, high] = [*DELTA_RANGE.start(), most].map(|d| d * MEAN_EDGE * voxel);
    Err(MethodError::invalid(
        "edge",
        format!("must be from {low:.3} to {high:.3} for a volume of this size, got {edge}"),
    ))
}
