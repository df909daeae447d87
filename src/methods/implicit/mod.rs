//! Implicit surface from sparse noisy points.
//!
//! Dinh, Turk & Slabaugh, *Reconstructing surfaces by volumetric regularization using radial basis functions*. Points near
//! an unknown closed surface are scaled into a box and thinned (`cloud`; section VI-B, VI-D); points outside say which side
//! is out (`exterior`, `camera`, `normals`; section VI-A). A smooth function that is 0 on the surface and negative outside is
//! solved for (`kernel`, `solve`; sections IV and V), the surface where it passes 0 is followed (`extract`, with `field` and
//! `fast` for its values), and coloured from photographs (`color`; section VII-C).
//!
//! # What it guarantees
//! The mesh is closed, oriented and 2-manifold, no two of its triangles cross, whatever the points; every piece of it is
//! kept, and those that no point is near are counted. The residual of the system is computed from the kernel itself. The
//! same input gives the same bits, natively and in wasm.
//!
//! # What it does not
//! Where points say nothing, the surface closes smoothly, which need not be what was there. Detail finer than the points'
//! spacing, and pieces smaller than the lines of the scan are apart, may be missing.
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

pub mod camera;
pub mod cloud;
pub mod color;
mod exterior;
mod extract;
pub mod fast;
pub mod field;
pub mod kernel;
mod low_rank;
mod measure;
pub mod normals;
mod params;
pub mod solve;
mod state;
mod vectors;

pub use camera::Camera;
pub use cloud::Cloud;
pub use measure::Fitness;
pub use params::{ImplicitParams, KernelKind, Level, param_specs};

use super::{MethodError, StepReport, Times};
use crate::math::{Bounds, DAffine3, DVec3, Vec3};
use crate::mesh::{TriangleMesh, measure as measure_mesh};
use crate::remesh::Changes;
use crate::volume::{Space, Volume, VolumeError, VolumeInit, Voxels};
use cloud::{BoxMap, largest_clusters, mean_spacing, subsampled};
use color::Coloring;
use exterior::{exterior_points, sphere_around};
use extract::{Extraction, default_cell};
use fast::FastField;
use field::Field;
use kernel::{Kernel, KernelTable};
use solve::{Constraints, Solution, Solver};

/// How an [`ImplicitSurface`] is set up, beside its points.
#[derive(Clone, Debug)]
pub struct ImplicitOptions {
    /// Points known to be outside, in the units of the others; else they are made from cameras, normals or the points alone.
    pub exterior: Option<Vec<Vec3>>,
    /// The cameras that the points were made from.
    pub cameras: Vec<Camera>,
    /// Points that take part at most; more are thinned.
    pub max_points: usize,
    /// The number of clusters kept, largest first; else all.
    pub keep_components: Option<usize>,
    /// Parameters.
    pub params: ImplicitParams,
}

impl Default for ImplicitOptions {
    fn default() -> Self {
        Self {
            exterior: None,
            cameras: Vec::new(),
            max_points: DEFAULT_POINTS,
            keep_components: None,
            params: ImplicitParams::default(),
        }
    }
}

/// Points that take part where no number is asked for.
const DEFAULT_POINTS: usize = 20_000;
/// The most that can be asked for: their matrix takes about 2 GB.
const MOST_POINTS: usize = 100_000;
/// Edge of the cells that join points to clusters, in mean spacings.
const CLUSTER_CELL: f64 = 2.0;
/// Of all random choices.
const SEED: u64 = 1;

/// An implicit surface on its way from points to a mesh.
pub struct ImplicitSurface {
    /// As they came.
    original: Vec<Vec3>,
    /// Without duplicates, in the box.
    cloud: Cloud,
    map: BoxMap,
    options: ImplicitOptions,
    params: ImplicitParams,
    samples: Option<Samples>,
    constraints: Constraints,
    stage: Stage,
    /// Slices of work that the stage has had.
    slices: u32,
    solved: Option<Solved>,
    mesh: TriangleMesh,
    /// Counts the surfaces so far.
    version: u32,
    components: u32,
    euler: i64,
    strays: usize,
    iteration: u32,
    residual: f64,
    clock: fn() -> f64,
}

/// The points that take part.
#[derive(Clone, Debug)]
struct Samples {
    cloud: Cloud,
    spacing: f64,
}

/// The function, with the values that it was solved for.
#[derive(Clone, Debug)]
struct Solved {
    field: Field,
    solution: Solution,
    kernel: Kernel,
    /// The mean of f over the surface constraints.
    mean: f64,
}

impl Solved {
    fn new(kernel: Kernel, constraints: &Constraints, solution: Solution) -> Self {
        let field = Field::new(KernelTable::new(kernel), &constraints.centres, &solution);
        Self { field, kernel, mean: constraints.mean_on_surface(&solution), solution }
    }
}

/// What is to be done next.
enum Stage {
    Subsample,
    Constrain,
    Solve(Box<Solver>),
    Extract(Box<Extraction>),
    Color(Box<Painting>),
    Done,
}

/// The extracted mesh while it is coloured.
struct Painting {
    mesh: TriangleMesh,
    coloring: Coloring,
    /// The next camera.
    camera: usize,
}

impl ImplicitSurface {
    /// The surface of `points`, before its first step.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the option or parameter that cannot be used, and what is accepted.
    pub fn new(points: Cloud, options: ImplicitOptions) -> Result<Self, MethodError> {
        options.params.validate()?;
        check_options(&options)?;
        points.validate()?;
        let original = points.points.clone();
        let cloud = points.distinct();
        cloud.check_count()?;
        let map = BoxMap::of(&cloud.points);
        // Rounding in the box may make equal what was not.
        let cloud = cloud.mapped(&map).distinct();
        cloud.check_count()?;
        cloud.check_span()?;
        Ok(Self { original, cloud, params: options.params.clone(), options, ..Self::empty(map) })
    }

    fn empty(map: BoxMap) -> Self {
        Self {
            original: Vec::new(),
            cloud: Cloud::default(),
            map,
            params: ImplicitParams::default(),
            options: ImplicitOptions::default(),
            samples: None,
            constraints: Constraints::default(),
            stage: Stage::Subsample,
            slices: 0,
            solved: None,
            mesh: TriangleMesh::default(),
            version: 0,
            components: 0,
            euler: 0,
            strays: 0,
            iteration: 0,
            residual: f64::NAN,
            clock: || 0.0,
        }
    }

    /// Gives the model a clock for [`StepReport::times`], in milliseconds. The core has none of its own.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// One slice of the next stage: some ten milliseconds of work. At the end it does nothing.
    ///
    /// # Errors
    /// [`MethodError::Singular`] where the system cannot be solved, [`MethodError::InvalidArgument`] where the cell does not
    /// suit the points, [`MethodError::Volume`] where memory ends. The surface is then as it was, and other parameters may be
    /// set.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        let (phase, begun) = (self.stage.phase(), (self.clock)());
        if !matches!(self.stage, Stage::Done) {
            self.iteration += 1;
            self.advance()?;
        }
        let mut times = Times::default();
        times.add(phase, (self.clock)() - begun);
        Ok(self.report(phase, times))
    }

    /// A slice of the stage. One that fails leaves what stood before.
    fn advance(&mut self) -> Result<(), MethodError> {
        let fallback = self.fallback();
        let stage = std::mem::replace(&mut self.stage, fallback);
        let (before, slices) = (stage.phase(), std::mem::take(&mut self.slices));
        self.stage = match stage {
            Stage::Subsample => self.subsample()?,
            Stage::Constrain => self.constrain()?,
            Stage::Solve(solver) => self.solve(solver)?,
            Stage::Extract(extraction) => self.extract(extraction)?,
            Stage::Color(painting) => self.color(*painting),
            Stage::Done => Stage::Done,
        };
        self.slices = if self.stage.phase() == before { slices + 1 } else { 0 };
        Ok(())
    }

    fn report(&self, phase: &str, times: Times) -> StepReport {
        StepReport {
            iteration: self.iteration,
            done: matches!(self.stage, Stage::Done),
            phase: phase.into(),
            progress: self.stage.progress(self.options.cameras.len()),
            residual: if let Stage::Solve(solver) = &self.stage { solver.residual() } else { self.residual },
            tolerance: self.params.tolerance,
            vertices: self.mesh.positions.len() as u32,
            triangles: self.mesh.triangles.len() as u32,
            components: self.components,
            euler: self.euler as i32,
            events: Changes::default(),
            times,
        }
    }

    fn subsample(&mut self) -> Result<Stage, MethodError> {
        let mut cloud = self.cloud.clone();
        if let Some(keep) = self.options.keep_components {
            let cell = CLUSTER_CELL * mean_spacing(&cloud.points);
            cloud = cloud.gathered(&largest_clusters(&cloud.points, cell as f32, keep));
            cloud.check_count()?;
            cloud.check_span()?;
        }
        let cloud = cloud.gathered(&subsampled(&cloud.points, self.options.max_points, SEED));
        cloud.check_span()?;
        let spacing = mean_spacing(&cloud.points);
        self.samples = Some(Samples { cloud, spacing });
        Ok(Stage::Constrain)
    }

    fn constrain(&mut self) -> Result<Stage, MethodError> {
        let Some(samples) = &self.samples else { return Ok(Stage::Subsample) };
        let exterior = match &self.options.exterior {
            Some(given) => {
                let mut points: Vec<Vec3> = given.iter().map(|&p| self.map.to_box(p)).collect();
                points.extend(sphere_around(&samples.cloud.points));
                points
            }
            None => {
                let cameras: Vec<Camera> = self
                    .options
                    .cameras
                    .iter()
                    .map(|camera| camera.clone().moved(&self.map.affine()))
                    .collect();
                exterior_points(&samples.cloud, &cameras, samples.spacing as f32, SEED)
            }
        };
        let exterior = Cloud { points: exterior, ..Cloud::default() }.distinct().points;
        self.constraints = Constraints::new(&samples.cloud, &exterior);
        if let Some(i) = self.constraints.shared_centre() {
            let problem = format!("{} is a surface point, too", self.map.from_box(i.as_dvec3()));
            return Err(MethodError::invalid("exterior", problem));
        }
        Ok(self.begin_solve())
    }

    fn begin_solve(&mut self) -> Stage {
        self.constraints.regularize(self.params.lambda_surface, self.params.lambda_exterior);
        let kernel = Kernel::new(&self.params, self.constraints.radius());
        Stage::Solve(Box::new(Solver::new(&self.constraints, kernel, self.params.tolerance, SEED)))
    }

    fn solve(&mut self, mut solver: Box<Solver>) -> Result<Stage, MethodError> {
        let done = solver.advance().map_err(|_| self.singular())?;
        let Some(solution) = done.then(|| solver.solution()).flatten() else {
            return Ok(Stage::Solve(solver));
        };
        self.residual = solver.residual();
        self.solved = Some(Solved::new(solver.kernel(), &self.constraints, solution));
        self.begin_extraction()
    }

    fn singular(&self) -> MethodError {
        let cause = if self.params.lambda_surface == 0.0 {
            "lambdaSurface is 0 and some points lie too close together; give it a value above 0"
        } else {
            "rounding is larger than the tolerance; take a larger tolerance or lambda, or a narrower kernel"
        };
        MethodError::Singular { constraints: self.constraints.centres.len(), cause }
    }

    fn begin_extraction(&self) -> Result<Stage, MethodError> {
        let (Some(solved), Some(samples)) = (&self.solved, &self.samples) else {
            return Ok(Stage::Subsample);
        };
        let points: Vec<Vec3> =
            samples.cloud.points.iter().map(|p| self.map.from_box(p.as_dvec3()).as_vec3()).collect();
        let level = self.level_of(solved);
        let extraction = Extraction::new(&solved.field, self.map, level, &points, self.cell())?;
        Ok(Stage::Extract(Box::new(extraction)))
    }

    /// The value of the function that counts as 0.
    fn level_of(&self, solved: &Solved) -> f64 {
        match self.params.level {
            Level::Zero => 0.0,
            Level::Mean => solved.mean,
        }
    }

    fn extract(&mut self, mut extraction: Box<Extraction>) -> Result<Stage, MethodError> {
        let Some(mesh) = extraction.advance()? else { return Ok(Stage::Extract(extraction)) };
        self.strays = extraction.strays();
        let coloring = Coloring::new(mesh.positions.len());
        Ok(Stage::Color(Box::new(Painting { mesh, coloring, camera: 0 })))
    }

    fn color(&mut self, mut painting: Painting) -> Stage {
        if let Some(next) = self.options.cameras.get(painting.camera) {
            painting.coloring.add(&painting.mesh, next);
            painting.camera += 1;
            return Stage::Color(Box::new(painting));
        }
        let Painting { mut mesh, coloring, .. } = painting;
        mesh.colors = coloring.finish(&mesh).or_else(|| self.colors_of_points(&mesh));
        self.take_mesh(mesh);
        Stage::Done
    }

    fn take_mesh(&mut self, mesh: TriangleMesh) {
        let measures = measure_mesh(&mesh);
        (self.components, self.euler) = (measures.components as u32, measures.euler);
        self.mesh = mesh;
        self.version = self.version.wrapping_add(1);
    }

    /// The stage to go on from when the present one fails.
    fn fallback(&self) -> Stage {
        if self.mesh.triangles.is_empty() { Stage::Subsample } else { Stage::Done }
    }

    /// The edge of a cell, in the points' units: as asked for, or from the spacing of the points, once that is known.
    pub fn cell(&self) -> f64 {
        match &self.samples {
            Some(samples) if self.params.cell == 0.0 => default_cell(&self.map, samples.spacing),
            _ => self.params.cell,
        }
    }

    /// The parameters.
    pub fn params(&self) -> &ImplicitParams {
        &self.params
    }

    /// Takes other parameters. The surface stays until the new one is there; stages whose result does not change are not
    /// done again.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the parameter; nothing has changed then.
    pub fn set_params(&mut self, params: ImplicitParams) -> Result<(), MethodError> {
        params.validate()?;
        let before = std::mem::replace(&mut self.params, params);
        let (now, only_extraction) = (&self.params, before.with_extraction_of(&self.params));
        if before == *now || matches!(self.stage, Stage::Subsample | Stage::Constrain) {
            return Ok(());
        }
        if only_extraction == *now && !matches!(self.stage, Stage::Solve(_)) {
            match self.begin_extraction() {
                Ok(stage) => (self.stage, self.slices) = (stage, 0),
                Err(error) => {
                    self.params = before;
                    return Err(error);
                }
            }
        } else if only_extraction != *now {
            (self.stage, self.slices) = (self.begin_solve(), 0);
        }
        Ok(())
    }

    /// The surface: empty before the first one is there, then the last that was finished. In the points' units, with normals
    /// from the gradient, and colours where there are photographs or coloured points.
    pub fn surface(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Counts up when the surface becomes another, or gets other colours.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// The surface that is being extracted, as far as it was followed, open where it goes on; empty in other stages.
    ///
    /// # Errors
    /// [`MethodError::Volume`] where memory ends.
    pub fn preview(&self) -> Result<TriangleMesh, MethodError> {
        match &self.stage {
            Stage::Extract(extraction) => extraction.preview(),
            Stage::Color(painting) => Ok(painting.mesh.clone()),
            _ => Ok(TriangleMesh::default()),
        }
    }

    /// Pieces of the last surface that no point is near.
    pub fn strays(&self) -> usize {
        self.strays
    }

    /// Points that were equal to others, and left out.
    pub fn duplicates(&self) -> usize {
        self.original.len() - self.cloud.len()
    }

    /// The mean distance from a point that takes part to the nearest other, in units of the box; 0 before they are chosen.
    pub fn spacing(&self) -> f64 {
        self.samples.as_ref().map_or(0.0, |samples| samples.spacing)
    }

    /// f at points in their own units, less the level: above 0 inside, 0 on the surface, below outside.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system was solved.
    pub fn evaluate(&self, points: &[Vec3]) -> Result<Vec<f64>, MethodError> {
        let solved = self.solved("evaluate")?;
        let level = self.level_of(solved);
        Ok(points.iter().map(|p| solved.field.value(self.map.to_box_exactly(p.as_dvec3())) - level).collect())
    }

    /// ∇f at points in their own units, per unit; it points inwards.
    ///
    /// # Errors
    /// As [`Self::evaluate`].
    pub fn gradient(&self, points: &[Vec3]) -> Result<Vec<DVec3>, MethodError> {
        let solved = self.solved("gradient")?;
        let at = |p: &Vec3| solved.field.value_and_gradient(self.map.to_box_exactly(p.as_dvec3())).1;
        Ok(points.iter().map(|p| at(p) * self.map.scale()).collect())
    }

    fn solved(&self, what: &'static str) -> Result<&Solved, MethodError> {
        let problem = "the system is not solved yet: step until the phase is 'extract'";
        self.solved.as_ref().ok_or_else(|| MethodError::invalid(what, problem))
    }

    /// The points that take part, and those outside, in the points' units; empty before they are chosen.
    pub fn constraints(&self) -> [Vec<Vec3>; 2] {
        let world = |all: &[Vec3]| all.iter().map(|p| self.map.from_box(p.as_dvec3()).as_vec3()).collect();
        let surface = self.samples.as_ref().map_or(&[][..], |samples| &samples.cloud.points[..]);
        let outside = self.constraints.centres.get(self.constraints.surface..).unwrap_or_default();
        [world(surface), world(outside)]
    }

    /// Distances of all original points from the surface, and its mean curvature.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before there is a surface.
    pub fn fitness(&self) -> Result<Fitness, MethodError> {
        Fitness::of(&self.original, &self.mesh)
    }

    /// f, less the level, on a grid of `dims` voxels around the points, so that other methods can take over: above 0 inside.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system was solved, and for fewer than 2 voxels along an axis;
    /// [`MethodError::Volume`] where memory ends.
    pub fn to_volume(&self, dims: [usize; 3]) -> Result<Volume, MethodError> {
        let solved = self.solved("toVolume")?;
        if dims.iter().any(|&n| n < 2) {
            return Err(MethodError::invalid(
                "dims",
                format!("{dims:?}; at least 2 along each axis are needed"),
            ));
        }
        let (origin, spacing) = self.grid(dims);
        let map = DAffine3::from_translation(origin) * DAffine3::from_scale(spacing);
        let corner = |p: DVec3| self.map.to_box_exactly(map.transform_point3(p));
        let last = DVec3::from_array(dims.map(|n| (n - 1) as f64));
        let mut fast = FastField::new(solved.field.clone(), corner(DVec3::ZERO), corner(last));
        let level = self.level_of(solved);
        let values = sampled(dims, |places, row| {
            let places: Vec<DVec3> = places.iter().map(|&p| corner(p)).collect();
            fast.values(&places, row);
            row.iter_mut().for_each(|value| *value -= level);
        })?;
        Ok(Volume::new(VolumeInit {
            voxels: Voxels::F32(values),
            dims: [dims[0], dims[1], dims[2], 1],
            affine: map,
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: 0.0,
            space: Space::Ras,
        })?)
    }

    /// First voxel and voxel size of a grid around the points and the surface.
    fn grid(&self, dims: [usize; 3]) -> (DVec3, DVec3) {
        let bounds = Bounds::of(&self.original).joined(&Bounds::of(&self.mesh.positions));
        let margin = DVec3::splat(GRID_MARGIN * 2.0 / self.map.scale());
        let (low, high) = (bounds.min.as_dvec3() - margin, bounds.max.as_dvec3() + margin);
        (low, (high - low) / DVec3::from_array(dims.map(|n| (n - 1) as f64)))
    }

    /// Colours the surface from photographs.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before there is a surface, and where no camera has a picture.
    pub fn colorize(&mut self, cameras: &[Camera]) -> Result<(), MethodError> {
        if self.mesh.triangles.is_empty() {
            return Err(MethodError::invalid("colorize", "there is no surface yet: step to the end first"));
        }
        if !cameras.iter().any(Camera::has_image) {
            return Err(MethodError::invalid("cameras", "none has an image; at least one is needed"));
        }
        if let Some(colors) = color::colors(&self.mesh, cameras) {
            self.mesh.colors = Some(colors);
            self.version = self.version.wrapping_add(1);
        }
        Ok(())
    }

    fn colors_of_points(&self, mesh: &TriangleMesh) -> Option<Vec<Vec3>> {
        let colors = self.cloud.colors.as_ref()?;
        Some(measure::colors_of_points(&self.cloud.points, colors, self.spacing(), mesh, &self.map))
    }
}

/// Room around the points in a volume made of them, of their longest side: enough for the surface to close in.
const GRID_MARGIN: f64 = 0.1;

impl Stage {
    fn phase(&self) -> &'static str {
        match self {
            Self::Subsample => "subsample",
            Self::Constrain => "constraints",
            Self::Solve(_) => "solve",
            Self::Extract(_) => "extract",
            Self::Color(_) | Self::Done => "colour",
        }
    }

    fn progress(&self, cameras: usize) -> f64 {
        match self {
            Self::Subsample | Self::Constrain => 0.0,
            Self::Solve(solver) => solver.progress(),
            Self::Extract(_) => f64::NAN,
            Self::Color(painting) => painting.camera as f64 / (cameras + 1) as f64,
            Self::Done => 1.0,
        }
    }
}

/// Numbers at all nodes of a grid, x fastest, a row at a time.
fn sampled(dims: [usize; 3], mut row: impl FnMut(&[DVec3], &mut [f64])) -> Result<Vec<f32>, VolumeError> {
    let count = dims.iter().try_fold(1_usize, |product, &n| product.checked_mul(n)).unwrap_or(usize::MAX);
    let mut values: Vec<f32> = Vec::new();
    let bytes = 4 * count as u64;
    values.try_reserve_exact(count).map_err(|_| VolumeError::TooLarge { bytes })?;
    let (mut places, mut line) = (vec![DVec3::ZERO; dims[0]], vec![0.0; dims[0]]);
    for at in 0..dims[1] * dims[2] {
        let [y, z] = [at % dims[1], at / dims[1]].map(|k| k as f64);
        places.iter_mut().enumerate().for_each(|(x, p)| *p = DVec3::new(x as f64, y, z));
        row(&places, &mut line);
        values.extend(line.iter().map(|&value| value as f32));
    }
    Ok(values)
}

fn check_options(options: &ImplicitOptions) -> Result<(), MethodError> {
    if !(LEAST_POINTS..=MOST_POINTS).contains(&options.max_points) {
        let problem = format!("{} given, {LEAST_POINTS} to {MOST_POINTS} accepted", options.max_points);
        return Err(MethodError::invalid("maxPoints", problem));
    }
    if options.keep_components == Some(0) {
        return Err(MethodError::invalid("keepComponents", "0 given, at least 1 is needed"));
    }
    cloud::check_finite("exterior", options.exterior.as_deref().unwrap_or_default())
}

/// Fewer points span no volume.
const LEAST_POINTS: usize = 4;
