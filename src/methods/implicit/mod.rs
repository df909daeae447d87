//! Implicit surface reconstruction from sparse, noisy points.
//!
//! Dinh, Turk & Slabaugh, *Reconstructing surfaces by volumetric regularization using radial basis functions*. Points
//! near an unknown closed surface are scaled into a box, cleaned of outliers and subsampled (`cloud`, `sampling`;
//! sections VI-B, VI-D); points outside fix the orientation (`exterior`, `camera`, `normals`; section VI-A). A smooth
//! function that is 0 on the surface and negative outside is solved for (`kernel`, `solve`; sections IV and V). Its
//! zero set is extracted (`extract`, with `field` and `fast` for its values), and coloured from photographs (`color`;
//! section VII-C).
//!
//! # Guarantees
//! The mesh is closed, oriented, 2-manifold and free of self-intersections, whatever the points; all its connected
//! components are kept, and those that no point is near are counted. The residual of the system is computed from the
//! kernel itself. The same input gives the same bits, natively and in wasm.
//!
//! # Limitations
//! In gaps between the points, the surface closes smoothly, which need not match the true one. Detail finer than the
//! spacing of the points, and components smaller than the distance between scan lines, may be missing.
//!
//! # Example
//! ```
//! use vesicle::math::Vec3;
//! use vesicle::methods::implicit::{Cloud, ImplicitOptions, ImplicitSurface};
//!
//! // A ball, as a spiral of 400 points.
//! let on_ball = |i: usize| {
//!     let (z, angle) = (1.0 - (2 * i + 1) as f32 / 400.0, 2.4 * i as f32);
//!     Vec3::new(angle.cos(), angle.sin(), 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
//! };
//! let points = Cloud { points: (0..400).map(on_ball).collect(), ..Cloud::default() };
//! let mut ball = ImplicitSurface::new(points, ImplicitOptions::default())?;
//! while !ball.step()?.done {}
//! assert!(ball.surface().positions.iter().all(|p| (p.length() - 1.0).abs() < 0.02));
//! # Ok::<(), vesicle::methods::MethodError>(())
//! ```

mod automatic;
mod camera;
mod cloud;
mod color;
mod edits;
mod exterior;
mod extract;
mod fast;
mod field;
mod kernel;
mod low_rank;
mod measure;
mod normals;
mod params;
mod point_colors;
mod queries;
mod sampling;
mod sides_trial;
mod solve;
mod state;
mod warnings;

pub use automatic::Choice;
pub use camera::Camera;
pub use cloud::Cloud;
pub use edits::PointEdits;
pub use measure::Fitness;
pub use params::{ImplicitParams, IsoValue, KernelKind, Sides};
pub use queries::VertexColors;

use super::method::method;
use super::params::Auto;
use super::{LiveSurface, MethodError, StepReport, Times};
use crate::math::order::median;
use crate::math::{DAffine3, DVec3, PositionIndex, Vec3};
use crate::mesh::{TriangleMesh, measure as measure_mesh};
use crate::pauses::{Computation, Pauses, advance, finished};
use crate::remesh::Changes;
use crate::warning::{Place, Warning, WarningCode};
use automatic::OffSurfaceSearch;
use cloud::{BoxMap, MAX_POINTS, MIN_POINTS};
use color::Coloring;
use exterior::{AGREEMENT, Exterior, exterior_from_points, generate_exterior};
use extract::{Extraction, default_cell};
use field::Field;
use kernel::{Kernel, KernelTable};
use point_colors::PointColors;
use sampling::{Samples, Sampling};
use serde::{Deserialize, Serialize};
use sides_trial::SidesTrial;
use solve::{Constraints, Solution, Solver};
use std::future::ready;
use std::task::Poll;
use warnings::{Findings, Fit, Scattered};

/// Options of an [`ImplicitSurface`], given to [`ImplicitSurface::new`] together with its points.
#[derive(Clone, Debug)]
pub struct ImplicitOptions {
    /// Points known to be outside the surface, in world units (those of the input points); if `None`, exterior points
    /// are made from cameras, normals or the points alone. In both cases, points on a sphere around all points are
    /// added.
    pub exterior: Option<Vec<Vec3>>,
    /// Cameras that photographed the object: they show on which side of the points the outside is, and their images
    /// colour the surface.
    pub cameras: Vec<Camera>,
    /// Maximum number of points that become surface constraints; larger clouds are subsampled.
    pub max_points: usize,
    /// Number of clusters of nearby points to keep, largest first, which discards outliers; `None` keeps all clusters. The
    /// normalised box is that of all points, or if the clusters are less than half as long, theirs.
    pub keep_components: Option<usize>,
    /// Largest number of vertices of the surface, about; by default 350,000, or 24 for each point.
    pub max_vertices: Option<usize>,
    /// Initial parameters of kernel, regularisation, solver and extraction.
    pub params: ImplicitParams,
}

impl Default for ImplicitOptions {
    fn default() -> Self {
        Self {
            exterior: None,
            cameras: Vec::new(),
            max_points: DEFAULT_POINTS,
            keep_components: None,
            max_vertices: None,
            params: ImplicitParams::default(),
        }
    }
}

/// Default value of [`ImplicitOptions::max_vertices`]: as many in all, or for each point if these are more; cells of the default
/// size give less.
const LEAST_MOST: usize = 350_000;
const MOST_OF_POINT: usize = 24;
/// Default value of [`ImplicitOptions::max_points`].
const DEFAULT_POINTS: usize = 20_000;
/// Maximum size, in bytes, of the linear system's matrix that is kept after a solve, so that edits of the points need
/// not rebuild it; a larger one is rebuilt when needed.
const KEPT_BYTES: usize = 256 << 20;
/// Rounding of the points, in their mean distance to the nearest neighbour, above which there is a warning.
const COARSE_SHARE: f64 = 0.1;

const AMBIGUOUS: &str = "inside and outside are ambiguous: walls or gaps are about as thin as the spacing of the points or \
                         their noise; components, handles and volume may be wrong";
const UNCLEAR: &str = "inside and outside are hardly distinguished here: a wall or gap is about as thin as the spacing of the \
                       points or their noise, and may be bridged or broken; components, handles and volume may be wrong";
const UNREACHED: &str = "the surface is far from several points here: a part of the object, or a gap, that has so few points is lost, or \
                         they are outliers; give more points or normals here, or remove them";
const BETWEEN_SHEETS: &str = "the surface lies between two sheets of points here, as if they were one with noise: a wall or gap that is about as thin \
                              as the points are apart, or registered twice, is lost; components, handles and volume may be wrong; \
                              measure more points, or give lambdaSurface";
const INWARD: &str =
    "the normals that were given point inwards on the whole: inside and outside are exchanged; reverse them";
const COARSE: &str = "the points are rounded to single precision, which is coarse beside their spacing so far from the origin: \
                      give them in double precision, or move them to the origin before they are rounded";
/// Seed of all random choices: a constant, so that equal input gives equal results.
const SEED: u64 = 1;

/// Reconstruction of an implicit surface from points, step by step, up to a coloured mesh.
pub struct ImplicitSurface {
    /// The origin of all positions in world space; see [`Cloud::origin`].
    origin: DVec3,
    /// The input points, in world units.
    original: Vec<Vec3>,
    /// The input points without duplicates and far outliers, mapped into the normalised box.
    cloud: Cloud,
    /// The distinct input points that are outliers so far away that the normalised box is without them, in world units.
    far_outliers: Vec<Vec3>,
    map: BoxMap,
    /// The step of single precision in world space, if all points are rounded to it; else 0.
    rounding: f64,
    /// Whether the normals that were given point inwards.
    has_inward_normals: bool,
    options: ImplicitOptions,
    params: ImplicitParams,
    edits: PointEdits,
    samples: Option<Samples>,
    exterior: Option<Exterior>,
    /// The sides in force: those of the parameter, or else those chosen; `None` before there are constraints.
    sides: Option<Sides>,
    /// Whether inside and outside are ambiguous; see [`OffSurface::is_ambiguous`](automatic::OffSurface::is_ambiguous).
    ambiguous_sides: bool,
    /// The current constraints on the implicit function, made from samples, exterior points and edits.
    constraints: Constraints,
    stage: Stage,
    /// Slices of work done in the current stage, so that a saved run can be continued there; 0 in a solve, as the
    /// solver counts its own.
    slices: u32,
    solved: Option<Solved>,
    /// The solution without edits, with the parameters of `solved`. The system of a few edits is revised from it, so that the
    /// result depends on these edits alone; `None` before it, and where there are too many edits.
    unedited: Option<Unedited>,
    /// The solver of `unedited`, possibly revised since, kept for later edits; `None` before it, during a solve, and if its
    /// matrix is too large to keep.
    solver: Option<Box<Solver>>,
    /// Where the last finished surface separates inside and outside least clearly, if hardly.
    unclear: Option<Vec3>,
    /// Findings about the last finished surface, for warnings.
    findings: Findings,
    mesh: TriangleMesh,
    /// Counter of changes of the surface or its colours, so that callers know when to draw it again.
    version: u32,
    components: u32,
    euler: i64,
    spurious_components: usize,
    iteration: u32,
    residual: f64,
    clock: fn() -> f64,
}

/// The implicit function found by the last solve, with its centres and kernel.
#[derive(Clone, Debug)]
struct Solved {
    centres: Vec<Vec3>,
    solution: Solution,
    kernel: Kernel,
    /// Mean of the implicit function over the surface constraints, one of the choices for the iso-value.
    mean: f64,
    field: Field,
}

impl Solved {
    fn new(kernel: Kernel, centres: Vec<Vec3>, solution: Solution, mean: f64) -> Self {
        let field = Field::new(KernelTable::new(kernel), &centres, &solution);
        Self { centres, solution, kernel, mean, field }
    }
}

/// The solution of the system without edits.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Unedited {
    solution: Solution,
    residual: f64,
}

/// A linear system that is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Solving {
    /// That without edits.
    Unedited,
    /// That one, revised for the edits.
    Revised,
    /// That with the edits, from scratch: there are too many, or it has no solution without.
    Edited,
}

/// The stage of the reconstruction that the next call of [`ImplicitSurface::step`] works on, with its data.
enum Stage {
    Subsample(Box<Sampling>),
    /// The choice of points off the surface; `None` before it, or without one.
    Constrain(Option<Constraining>),
    Solve(Box<Solver>, Solving),
    Extract(Box<Extraction>),
    Color(Box<ColoringState>),
    Done,
}

/// The choice of points off the surface.
enum Constraining {
    Search(Box<OffSurfaceSearch>),
    /// Makes the points outside, which are tried beside those on both sides, if there are any.
    Outside(Computation<Exterior>, Option<Exterior>),
    /// The choice of the sides where these are ambiguous.
    Trial(Box<SidesTrial>),
}

impl Constraining {
    fn progress(&self) -> f64 {
        match self {
            Self::Search(search) => 0.5 * search.progress(),
            Self::Outside(..) => 0.5,
            Self::Trial(trial) => 0.5 + 0.5 * trial.progress(),
        }
    }
}

/// The extracted mesh while it is being coloured.
struct ColoringState {
    mesh: TriangleMesh,
    coloring: Coloring,
    /// Index of the camera whose image is used next, in [`ImplicitOptions::cameras`].
    camera: usize,
    /// Interpolation of the colours of the input points, used if no camera sees the surface; `None` before that.
    points: Option<PointColors>,
}

method!(ImplicitSurface, ImplicitParams);

impl LiveSurface for ImplicitSurface {
    fn surface(&self) -> TriangleMesh {
        self.surface().clone()
    }

    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn counts(&self) -> [usize; 2] {
        [self.mesh.positions.len(), self.mesh.triangles.len()]
    }

    fn versions(&self) -> [u32; 2] {
        [self.version(); 2]
    }
}

impl ImplicitSurface {
    /// Creates a reconstruction of the surface near `points`, which [`Self::step`] then computes.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the array, option or parameter that cannot be used, and what is
    /// accepted.
    pub fn new(points: Cloud, mut options: ImplicitOptions) -> Result<Self, MethodError> {
        options.params.validate()?;
        check_options(&options)?;
        points.validate()?;
        options.cameras = cameras_at(points.origin, options.cameras);
        let original = points.points.clone();
        let distinct = points.distinct();
        distinct.check_count()?;
        BoxMap::of(&distinct.points).check_precision()?;
        let (cloud, far_outliers) = match options.keep_components {
            Some(keep) => distinct.without_far_outliers(keep),
            None => (distinct, Vec::new()),
        };
        let map = BoxMap::of(&cloud.points);
        map.check_precision()?;
        // Rounding in the box can make distinct points equal.
        let cloud = cloud.mapped(&map).distinct();
        cloud.check_count()?;
        cloud.check_span()?;
        Ok(Self { far_outliers, ..Self::from_parts(original, cloud, map, options) })
    }

    fn from_parts(original: Vec<Vec3>, cloud: Cloud, map: BoxMap, options: ImplicitOptions) -> Self {
        Self {
            origin: cloud.origin,
            rounding: rounding_of(&original, cloud.origin),
            has_inward_normals: cloud.has_inward_normals(),
            original,
            cloud,
            far_outliers: Vec::new(),
            map,
            params: options.params.clone(),
            edits: PointEdits::default(),
            samples: None,
            exterior: None,
            sides: None,
            ambiguous_sides: false,
            constraints: Constraints::default(),
            stage: first_stage(&options),
            options,
            slices: 0,
            solved: None,
            unedited: None,
            solver: None,
            unclear: None,
            findings: Findings::default(),
            mesh: TriangleMesh::default(),
            version: 0,
            components: 0,
            euler: 0,
            spurious_components: 0,
            iteration: 0,
            residual: f64::NAN,
            clock: || 0.0,
        }
    }

    /// Sets the clock for [`StepReport::times`]: a function that returns the time in milliseconds. The core has no
    /// clock of its own.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// Continues the reconstruction by one slice of its current stage: some ten milliseconds of work with some ten
    /// thousand points. Does nothing once the surface is complete.
    ///
    /// # Errors
    /// [`MethodError::Singular`] if the system cannot be solved; [`MethodError::InvalidArgument`] if too few sampled
    /// points are left, if they lie in one plane or coincide with exterior points, or if the cell does not suit them;
    /// [`MethodError::Volume`] if memory cannot be allocated. The surface is then unchanged, and the run can continue
    /// with other parameters.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        let (phase, start) = (self.stage.phase(), (self.clock)());
        if !matches!(self.stage, Stage::Done) {
            self.iteration = self.iteration.wrapping_add(1);
            self.advance()?;
        }
        let mut times = Times::default();
        times.add(phase, (self.clock)() - start);
        Ok(self.report(phase, times))
    }

    /// Continues the reconstruction by one slice of its current stage. On an error the last finished surface is kept,
    /// and [`Self::fallback`] is the next stage.
    fn advance(&mut self) -> Result<(), MethodError> {
        let fallback = self.fallback();
        let stage = std::mem::replace(&mut self.stage, fallback);
        let (before, slices) = (stage.phase(), std::mem::take(&mut self.slices));
        self.stage = match stage {
            Stage::Subsample(sampling) => self.subsample(sampling)?,
            Stage::Constrain(state) => self.constrain(state)?,
            Stage::Solve(solver, system) => self.solve(solver, system)?,
            Stage::Extract(extraction) => self.extract(extraction)?,
            Stage::Color(state) => self.color(*state),
            Stage::Done => Stage::Done,
        };
        // The solver counts its own slices, and there are none at the end.
        let counts = self.stage.phase() == before && !matches!(self.stage, Stage::Solve(..) | Stage::Done);
        self.slices = if counts { slices + 1 } else { 0 };
        Ok(())
    }

    fn report(&self, phase: &str, times: Times) -> StepReport {
        StepReport {
            iteration: self.iteration,
            done: matches!(self.stage, Stage::Done),
            phase: phase.into(),
            progress: self.stage.progress(self.options.cameras.len()),
            residual: if let Stage::Solve(solver, _) = &self.stage {
                solver.residual()
            } else {
                self.residual
            },
            tolerance: self.params.tolerance,
            vertices: self.mesh.positions.len() as u32,
            triangles: self.mesh.triangles.len() as u32,
            components: self.components,
            euler: self.euler as i32,
            events: Changes::default(),
            times,
            warnings: self.warnings(),
        }
    }

    fn warnings(&self) -> Vec<Warning> {
        let outliers = "a few points are so far away that the others are a small part of the box: cells are too large for the \
                        object, and there may be no surface; keep only the largest cluster of points, or remove those points";
        // Nothing is coarse before the spacing is known.
        let is_coarse =
            self.spacing() > 0.0 && self.rounding * self.map.scale() > COARSE_SHARE * self.spacing();
        let found = [
            (self.has_far_outliers(), WarningCode::Outliers, outliers),
            (self.has_inward_normals, WarningCode::InwardNormals, INWARD),
            (is_coarse, WarningCode::Precision, COARSE),
        ];
        let found = found.into_iter().filter(|one| one.0).map(|(_, code, text)| Warning::new(code, text));
        // The points that are so far away are among the scattered ones.
        let scattered = self.scattered_points().filter(|_| !self.has_far_outliers());
        found.chain(scattered).chain(self.thin_parts()).collect()
    }

    fn thin_parts(&self) -> Option<Warning> {
        if self.ambiguous_sides && self.params.sides != Sides::Outside {
            return Some(Warning::new(WarningCode::ThinParts, AMBIGUOUS));
        }
        let Findings { unreached, between_sheets, .. } = self.findings;
        let found = [(between_sheets, BETWEEN_SHEETS), (self.unclear, UNCLEAR), (unreached, UNREACHED)];
        let (point, text) = found.into_iter().find_map(|(point, text)| Some((point?, text)))?;
        Some(Warning::at(WarningCode::ThinParts, self.place(point), text))
    }

    /// Returns a point relative to the origin as the place of a warning.
    fn place(&self, point: Vec3) -> Place {
        Place::Point((point.as_dvec3() + self.origin).to_array())
    }

    /// Returns the warning about points far from all others that the surface follows.
    fn scattered_points(&self) -> Option<Warning> {
        let Scattered { count, point } = self.findings.scattered?;
        let many = if count == 1 { "a point is".to_string() } else { format!("{count} points are") };
        let text = format!(
            "{many} far from all others, and the surface follows: it may have parts, bulges or a volume that the object has \
             not; keep only the largest cluster of points (keepComponents: 1), or remove the points, of which one is here"
        );
        Some(Warning::at(WarningCode::Outliers, self.place(point), text))
    }

    /// Returns findings about a finished surface.
    fn findings_of(&self, mesh: &TriangleMesh) -> Findings {
        let Choice { density, noise, .. } = self.in_force();
        let scale = self.map.scale();
        let points = self.map.all_in_world(&self.constraints.centres[..self.constraints.surface]);
        let fit = Fit {
            mesh,
            points: &points,
            apart: 1.0 / density.sqrt() / scale,
            noise: noise / scale,
            cell: self.cell(),
        };
        let scattered = fit.scattered();
        // With a λ that was given, a surface is as far from the points as λ says.
        if self.params.lambda_surface.given().is_some() {
            return Findings { scattered, ..Findings::default() };
        }
        Findings { unreached: fit.unreached(), between_sheets: fit.between_sheets(), scattered }
    }

    fn has_far_outliers(&self) -> bool {
        self.samples.as_ref().is_some_and(|samples| samples.has_far_outliers)
    }

    fn subsample(&mut self, mut sampling: Box<Sampling>) -> Result<Stage, MethodError> {
        self.samples = sampling.advance(&self.cloud)?;
        Ok(if self.samples.is_some() { Stage::Constrain(None) } else { Stage::Subsample(sampling) })
    }

    /// Makes the constraints, of which those off the surface take several slices.
    fn constrain(&mut self, state: Option<Constraining>) -> Result<Stage, MethodError> {
        Ok(match self.make_constraints(state)? {
            None if self.exterior.is_none() => first_stage(&self.options),
            None => self.begin_solve(),
            unfinished => Stage::Constrain(unfinished),
        })
    }

    /// Does a slice of making the exterior points and, at the end, the constraints on the implicit function from these, the
    /// samples and the edits; returns its state if it is unfinished. Does nothing before the samples are selected.
    fn make_constraints(&mut self, state: Option<Constraining>) -> Result<Option<Constraining>, MethodError> {
        let Some(samples) = &self.samples else { return Ok(None) };
        let state = match state {
            Some(state @ Constraining::Outside(_, None)) => state,
            _ if self.params.sides == Sides::Outside => {
                Constraining::Outside(self.exterior_points(samples), None)
            }
            None => {
                let search = OffSurfaceSearch::new(samples, SEED);
                return Ok(Some(Constraining::Search(Box::new(search))));
            }
            Some(state) => state,
        };
        let (sides, exterior) = match state {
            Constraining::Search(mut search) => {
                let Some(found) = search.advance() else { return Ok(Some(Constraining::Search(search))) };
                let known = self.known_outside(samples);
                let share = search.outside_share(&known.near);
                let contradict = share < AGREEMENT && share > 1.0 - AGREEMENT;
                self.ambiguous_sides = found.is_ambiguous() || contradict;
                let both = known.with_both_sides(found, share);
                if self.ambiguous_sides && self.params.sides == Sides::Auto {
                    return Ok(Some(Constraining::Outside(self.exterior_points(samples), Some(both))));
                }
                (Sides::Both, both)
            }
            Constraining::Outside(mut work, both) => match (advance(&mut work), both) {
                (Poll::Pending, both) => return Ok(Some(Constraining::Outside(work, both))),
                (Poll::Ready(outside), Some(both)) => {
                    let trial = SidesTrial::new(samples, self.map, both, outside);
                    return Ok(Some(Constraining::Trial(Box::new(trial))));
                }
                (Poll::Ready(outside), None) => (Sides::Outside, outside),
            },
            Constraining::Trial(mut trial) => {
                let Some(chosen) = trial.advance(samples) else {
                    return Ok(Some(Constraining::Trial(trial)));
                };
                chosen
            }
        };
        let constraints = self.edits.constraints(samples, &exterior, &self.original, &self.map)?;
        self.constraints = self.regularized(constraints);
        (self.sides, self.exterior) = (Some(sides), Some(exterior));
        Ok(None)
    }

    /// Returns the points outside that the caller gave or that cameras show, if there are any.
    fn known_outside(&self, samples: &Samples) -> Exterior {
        if self.options.exterior.is_none() && self.options.cameras.is_empty() {
            exterior_from_points(&samples.cloud, Vec::new())
        } else {
            finished(self.exterior_points(samples))
        }
    }

    /// Computes the points outside that the caller gave, or that are made from cameras, normals or the points.
    fn exterior_points(&self, samples: &Samples) -> Computation<Exterior> {
        if let Some(given) = &self.options.exterior {
            let given = given.iter().map(|&p| self.map.in_box(p)).collect();
            return Box::pin(ready(exterior_from_points(&samples.cloud, given)));
        }
        let cameras = self.options.cameras.iter();
        let cameras: Vec<Camera> =
            cameras.map(|camera| camera.clone().transformed(&self.map.affine())).collect();
        let (cloud, spacing) = (samples.cloud.clone(), samples.spacing as f32);
        Box::pin(async move { generate_exterior(&cloud, &cameras, spacing, SEED, &Pauses::default()).await })
    }

    /// Returns measures of the sampled points, and the values chosen by them for parameters that are `auto`; `None` before
    /// they are sampled.
    pub fn choice(&self) -> Option<Choice> {
        self.samples.as_ref().map(|samples| Choice { sides: self.sides, ..samples.choice })
    }

    /// Returns the values in force: those given, or else those chosen; 0 before the samples are selected, when nothing is
    /// made with them.
    fn in_force(&self) -> Choice {
        let chosen = self.choice().unwrap_or_default();
        let ImplicitParams { delta, lambda_surface, lambda_exterior, .. } = self.params;
        Choice {
            delta: delta.given().unwrap_or(chosen.delta),
            lambda_surface: lambda_surface.given().unwrap_or(chosen.lambda_surface),
            lambda_exterior: lambda_exterior.given().unwrap_or(chosen.lambda_exterior),
            ..chosen
        }
    }

    fn kernel(&self, constraints: &Constraints) -> Kernel {
        Kernel::new(&self.params, self.in_force().delta, constraints.radius())
    }

    fn regularized(&self, mut constraints: Constraints) -> Constraints {
        let Choice { lambda_surface, lambda_exterior, .. } = self.in_force();
        constraints.regularize(lambda_surface, lambda_exterior);
        constraints
    }

    /// Starts to solve the linear system of the current constraints from scratch: without edits first, if it can be revised for
    /// these. Returns the stage in which [`Self::advance`] continues.
    fn begin_solve(&mut self) -> Stage {
        (self.unedited, self.solver) = (None, None);
        let unedited = self.unedited_constraints().map(|constraints| self.new_solver(&constraints));
        match unedited.filter(|solver| self.is_revisable(solver)) {
            Some(solver) => Stage::Solve(solver, Solving::Unedited),
            None => self.begin_edited(),
        }
    }

    fn begin_edited(&self) -> Stage {
        Stage::Solve(self.new_solver(&self.constraints), Solving::Edited)
    }

    fn new_solver(&self, constraints: &Constraints) -> Box<Solver> {
        Box::new(Solver::new(constraints, self.kernel(constraints), self.params.tolerance, SEED))
    }

    /// Returns whether a solver of the system without edits can be revised for the current constraints.
    fn is_revisable(&self, solver: &Solver) -> bool {
        solver.kernel() == self.kernel(&self.constraints) && solver.can_revise(&self.constraints)
    }

    /// Returns the constraints without edits; `None` before there are any.
    fn unedited_constraints(&self) -> Option<Constraints> {
        let (samples, exterior) = (self.samples.as_ref()?, self.exterior.as_ref()?);
        let constraints =
            PointEdits::default().constraints(samples, exterior, &self.original, &self.map).ok()?;
        Some(self.regularized(constraints))
    }

    /// Starts to solve the system after an edit: `solver` is that of the solve that was under way, if there was one.
    ///
    /// # Errors
    /// Those of [`Self::begin_extraction`].
    fn begin_revision(&mut self, solver: Option<(Box<Solver>, Solving)>) -> Result<Stage, MethodError> {
        if self.unedited.is_some() && self.edits == PointEdits::default() {
            self.solver = solver.map(|(solver, _)| solver).or(self.solver.take());
            self.take_unedited();
            return self.begin_extraction();
        }
        match solver {
            Some((solver, Solving::Unedited)) if self.is_revisable(&solver) => {
                Ok(Stage::Solve(solver, Solving::Unedited))
            }
            Some((solver, Solving::Revised)) => Ok(self.revision(Some(solver))),
            _ => {
                let kept = self.solver.take();
                Ok(self.revision(kept))
            }
        }
    }

    /// Starts to revise the system without edits, from its solution; where that is impossible, starts from scratch.
    fn revision(&mut self, kept: Option<Box<Solver>>) -> Stage {
        self.revised_solver(kept)
            .map_or_else(|| self.begin_solve(), |solver| Stage::Solve(solver, Solving::Revised))
    }

    fn revised_solver(&self, kept: Option<Box<Solver>>) -> Option<Box<Solver>> {
        let (Unedited { solution, .. }, constraints) =
            (self.unedited.as_ref()?, self.unedited_constraints()?);
        let mut solver = kept.unwrap_or_else(|| self.new_solver(&constraints));
        let known = PositionIndex::new(&constraints.centres);
        let weight = |&centre: &Vec3| known.find(centre).map_or(0.0, |i| solution.weights[i]);
        let weights = self.constraints.centres.iter().map(weight).collect();
        (self.is_revisable(&solver) && solver.revise(&self.constraints, weights)).then_some(solver)
    }

    /// Makes the solution without edits the current one; there must be one.
    fn take_unedited(&mut self) {
        if let Some(Unedited { solution, residual }) = self.unedited.clone() {
            self.residual = residual;
            self.take_solution(solution);
        }
    }

    fn take_solution(&mut self, solution: Solution) {
        let mean = self.constraints.mean_on_surface(&solution);
        let kernel = self.kernel(&self.constraints);
        self.solved = Some(Solved::new(kernel, self.constraints.centres.clone(), solution, mean));
    }

    fn solve(&mut self, mut solver: Box<Solver>, system: Solving) -> Result<Stage, MethodError> {
        let has_edits = self.edits != PointEdits::default();
        let done = match solver.advance() {
            Err(_) if system == Solving::Unedited && has_edits => return Ok(self.begin_edited()),
            result => result.map_err(|_| self.singular())?,
        };
        let Some(solution) = done.then(|| solver.solution()).flatten() else {
            return Ok(Stage::Solve(solver, system));
        };
        if system == Solving::Unedited {
            self.unedited = Some(Unedited { solution: solution.clone(), residual: solver.residual() });
            if has_edits {
                return Ok(self.revision(Some(solver)));
            }
        }
        self.residual = solver.residual();
        self.take_solution(solution);
        let keeps = system != Solving::Edited && solver.matrix_bytes() <= KEPT_BYTES;
        self.solver = keeps.then_some(solver);
        self.begin_extraction()
    }

    /// Returns the error of a failed solve, and discards the system without edits, so that later edits do not revise it.
    fn singular(&mut self) -> MethodError {
        (self.unedited, self.solver) = (None, None);
        let cause = if self.has_far_outliers() {
            "a few points are so far away that the others nearly coincide in the box; discard outliers with keepComponents, \
             or remove them"
        } else if self.params.lambda_surface == Auto::Given(0.0) {
            "lambdaSurface is 0 and some points are too close together; set it above 0"
        } else {
            "rounding errors exceed the tolerance; use a larger tolerance or lambda, or a narrower kernel"
        };
        MethodError::Singular { constraints: self.constraints.centres.len(), cause }
    }

    fn begin_extraction(&self) -> Result<Stage, MethodError> {
        let Some(solved) = &self.solved else { return Ok(first_stage(&self.options)) };
        let points = self.map.all_in_world(&self.constraints.centres[..self.constraints.surface]);
        let level = self.iso_value(solved);
        let extraction = Extraction::new(
            &solved.field,
            self.map,
            level,
            &points,
            self.cell(),
            self.sides == Some(Sides::Outside),
            self.most_vertices(),
        )?;
        Ok(Stage::Extract(Box::new(extraction)))
    }

    fn most_vertices(&self) -> usize {
        self.options.max_vertices.unwrap_or_else(|| LEAST_MOST.max(MOST_OF_POINT * self.original.len()))
    }

    /// Returns the iso-value of the implicit function f, chosen by the parameter `level`, at which the surface is
    /// extracted.
    fn iso_value(&self, solved: &Solved) -> f64 {
        match self.params.level {
            IsoValue::Zero => 0.0,
            IsoValue::Mean => solved.mean,
        }
    }

    fn extract(&mut self, mut extraction: Box<Extraction>) -> Result<Stage, MethodError> {
        let Some(mesh) = extraction.advance()? else { return Ok(Stage::Extract(extraction)) };
        self.spurious_components = extraction.spurious_components();
        let apart = 1.0 / self.in_force().density.sqrt() / self.map.scale();
        // With constraints outside only, f is flat in many places inside.
        let is_steep = self.sides == Some(Sides::Both);
        self.unclear = is_steep.then(|| extraction.unclear(&mesh, apart as f32)).flatten();
        let coloring = Coloring::new(mesh.positions.len());
        Ok(Stage::Color(Box::new(ColoringState { mesh, coloring, camera: 0, points: None })))
    }

    fn color(&mut self, mut state: ColoringState) -> Stage {
        if let Some(next) = self.options.cameras.get(state.camera) {
            state.coloring.add(&state.mesh, next);
            state.camera += 1;
            return Stage::Color(Box::new(state));
        }
        if state.points.is_none() && state.coloring.is_empty() {
            let cloud = self.edits.without_removed(&self.cloud, &self.original, &self.map);
            state.points = PointColors::new(cloud, self.spacing());
        }
        if let Some(points) = &mut state.points
            && !points.advance(&state.mesh, &self.map, &mut state.coloring)
        {
            return Stage::Color(Box::new(state));
        }
        let ColoringState { mut mesh, coloring, .. } = state;
        mesh.colors = coloring.finish(&mesh);
        self.take_mesh(mesh);
        Stage::Done
    }

    fn take_mesh(&mut self, mesh: TriangleMesh) {
        self.findings = self.findings_of(&mesh);
        let measures = measure_mesh(&mesh);
        (self.components, self.euler) = (measures.components as u32, measures.euler);
        self.mesh = TriangleMesh { origin: self.origin, ..mesh };
        self.version = self.version.wrapping_add(1);
    }

    /// Returns the stage to continue with if the current one fails: the first one if there is no finished surface yet,
    /// else [`Stage::Done`].
    fn fallback(&self) -> Stage {
        if self.mesh.triangles.is_empty() { first_stage(&self.options) } else { Stage::Done }
    }

    /// Returns the edge length of an extraction cell, in world units: the parameter `cell`, or if that is 0, a length
    /// derived from the mean spacing of the sampled points; 0 until these are selected.
    pub fn cell(&self) -> f64 {
        match &self.samples {
            Some(samples) if self.params.cell == 0.0 => default_cell(&self.map, samples.spacing),
            _ => self.params.cell,
        }
    }

    /// Returns the current parameters of the reconstruction.
    pub fn params(&self) -> &ImplicitParams {
        &self.params
    }

    /// Sets the parameters, with which the reconstruction continues. The last finished surface stays until the new one
    /// is complete. If only cell or iso-value change, the system is not solved again.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the parameter that is out of range, or [`MethodError::Volume`] if memory
    /// cannot be allocated; nothing has changed then.
    pub fn set_params(&mut self, params: ImplicitParams) -> Result<(), MethodError> {
        params.validate()?;
        let before = std::mem::replace(&mut self.params, params);
        let (now, only_extraction) = (&self.params, before.with_extraction_of(&self.params));
        if before.sides != now.sides && !matches!(self.stage, Stage::Subsample(_)) {
            // Without them, edits in the meantime wait for the new ones.
            (self.sides, self.exterior, self.unedited) = (None, None, None);
            (self.stage, self.slices) = (Stage::Constrain(None), 0);
        }
        if before == *now || matches!(self.stage, Stage::Subsample(_) | Stage::Constrain(_)) {
            return Ok(());
        }
        if only_extraction == *now && !matches!(self.stage, Stage::Solve(..)) {
            match self.begin_extraction() {
                Ok(stage) => (self.stage, self.slices) = (stage, 0),
                Err(error) => {
                    self.params = before;
                    return Err(error);
                }
            }
        } else if only_extraction != *now {
            let constraints = std::mem::take(&mut self.constraints);
            self.constraints = self.regularized(constraints);
            (self.stage, self.slices) = (self.begin_solve(), 0);
        }
        Ok(())
    }

    /// Returns the current edits of the input points, as set by [`Self::set_edits`].
    pub fn edits(&self) -> &PointEdits {
        &self.edits
    }

    /// Replaces all edits of the input points: points added, removed and marked as outside. The last finished surface
    /// stays until the new one is complete. If only a few constraints differ from those without edits, the system of these is
    /// revised: its solution is reused, and its matrix, unless that was too large to keep. The surface depends on `edits`, not
    /// on those before them, nor on when they are made.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the list and the bad entry, or if too few points are left, or all lie in
    /// one plane; nothing has changed then.
    pub fn set_edits(&mut self, edits: PointEdits) -> Result<(), MethodError> {
        edits.validate(&self.original, &self.map)?;
        let remaining = edits.apply_to(&self.cloud, &self.original, &self.map);
        remaining.check_count()?;
        remaining.check_span()?;
        edits.check_exterior(&remaining, &self.map)?;
        if edits == self.edits {
            return Ok(());
        }
        if let (Some(samples), Some(exterior)) = (&self.samples, &self.exterior) {
            let constraints = edits.constraints(samples, exterior, &self.original, &self.map)?;
            let constraints = self.regularized(constraints);
            let before = (
                std::mem::replace(&mut self.constraints, constraints),
                std::mem::replace(&mut self.edits, edits),
            );
            let under_way = match std::mem::replace(&mut self.stage, Stage::Done) {
                Stage::Solve(solver, system) => Some((solver, system)),
                _ => None,
            };
            match self.begin_revision(under_way) {
                Ok(stage) => (self.stage, self.slices) = (stage, 0),
                Err(error) => {
                    (self.constraints, self.edits) = before;
                    return Err(error);
                }
            }
        } else {
            self.edits = edits;
        }
        Ok(())
    }

    /// Returns the last finished surface; empty before the first is finished. It is in world units, with outward
    /// normals from the gradient of f, and colours if an image shows it or points with colours are near.
    pub fn surface(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Returns a counter that increases when the surface or its colours change, so that a caller knows when to draw it
    /// again.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// Returns, for display, the surface that is being extracted, in world units, as far as it is complete, with
    /// boundaries where it continues; while it is being coloured, all of it. Empty in other stages.
    ///
    /// # Errors
    /// [`MethodError::Volume`] if memory cannot be allocated.
    pub fn preview(&self) -> Result<TriangleMesh, MethodError> {
        let mesh = match &self.stage {
            Stage::Extract(extraction) => extraction.preview()?,
            Stage::Color(state) => state.mesh.clone(),
            _ => TriangleMesh::default(),
        };
        Ok(TriangleMesh { origin: self.origin, ..mesh })
    }

    /// Returns the origin of all positions in world space; see [`Cloud::origin`].
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the number of connected components of the last finished surface that no surface constraint is near, and
    /// that the points therefore do not support.
    pub fn spurious_components(&self) -> usize {
        self.spurious_components
    }

    /// Returns the number of input points that are ignored because they equal another one, exactly or after rounding to
    /// single precision in the normalised box.
    pub fn duplicates(&self) -> usize {
        self.original.len() - self.cloud.len() - self.far_outliers.len()
    }

    /// Returns the number of distinct input points that are discarded, since they are in none of the clusters that
    /// [`ImplicitOptions::keep_components`] keeps; 0 until the samples are selected.
    pub fn outliers(&self) -> usize {
        self.samples.as_ref().map_or(0, |samples| self.far_outliers.len() + samples.outliers.len())
    }

    /// Returns the mean distance from a sampled point to its nearest neighbour, estimated from at most 4000 samples, in
    /// units of the normalised box (longest side 2); 0 before the samples are selected.
    pub fn spacing(&self) -> f64 {
        self.samples.as_ref().map_or(0.0, |samples| samples.spacing)
    }
}

impl Stage {
    fn phase(&self) -> &'static str {
        match self {
            Self::Subsample(_) => "subsample",
            Self::Constrain(_) => "constraints",
            Self::Solve(..) => "solve",
            Self::Extract(_) => "extract",
            Self::Color(_) | Self::Done => "colour",
        }
    }

    fn progress(&self, cameras: usize) -> f64 {
        match self {
            Self::Subsample(sampling) => sampling.progress(),
            Self::Constrain(state) => state.as_ref().map_or(0.0, Constraining::progress),
            Self::Solve(solver, _) => solver.progress(),
            Self::Extract(extraction) => extraction.progress(),
            Self::Color(state) => state.camera as f64 / (cameras + 1) as f64,
            Self::Done => 1.0,
        }
    }
}

/// Returns the step of single precision at most points in world space if all of them, relative to `origin`, are rounded to it,
/// else 0.
fn rounding_of(points: &[Vec3], origin: DVec3) -> f64 {
    let in_world = || points.iter().map(|p| p.as_dvec3() + origin);
    if in_world().any(|p| p.as_vec3().as_dvec3() != p) {
        return 0.0;
    }
    let usual = median(in_world().map(|p| p.abs().max_element() as f32)).unwrap_or(0.0);
    f64::from(usual.next_up() - usual)
}

/// Returns the cameras for positions relative to `origin`.
fn cameras_at(origin: DVec3, cameras: Vec<Camera>) -> Vec<Camera> {
    if origin == DVec3::ZERO {
        return cameras;
    }
    let to_relative = DAffine3::from_translation(-origin);
    cameras.into_iter().map(|camera| camera.transformed(&to_relative)).collect()
}

fn first_stage(options: &ImplicitOptions) -> Stage {
    Stage::Subsample(Box::new(Sampling::new(options.keep_components, options.max_points, SEED)))
}

fn check_options(options: &ImplicitOptions) -> Result<(), MethodError> {
    if !(MIN_POINTS..=MAX_POINTS).contains(&options.max_points) {
        let problem = format!("must be from {MIN_POINTS} to {MAX_POINTS}, got {}", options.max_points);
        return Err(MethodError::invalid("maxPoints", problem));
    }
    if options.keep_components == Some(0) {
        return Err(MethodError::invalid("keepComponents", "must be at least 1, got 0"));
    }
    let exterior = options.exterior.as_deref().unwrap_or_default();
    cloud::check_max_count("exterior", exterior.len())?;
    cloud::check_finite("exterior", exterior)
}
