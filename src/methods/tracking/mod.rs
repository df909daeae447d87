//! A dynamic surface tracked through a 4D image.
//!
//! After the paper on dynamic surfaces from 4D cardiac MRI by weighted points in space-time. Windows of the image vote
//! for the faces between bright and dark voxels (`vote`; section 2). The votes are weighted points in space-time; their
//! extremal surface consists of the positions that lie on the plane fitted to the points around them (`samples`,
//! `extremal`; section 3). The surface of the first frame is meshed (`first`; section 4.1), and tracked from frame to
//! frame by prediction and projection (`project`, `frame_tracker`; sections 3.3, 4.2 and 4.3).
//!
//! # Guarantees
//! After every step the surface is a closed, oriented 2-manifold without self-intersections. The same input gives the
//! same bits, natively and in wasm.
//!
//! # Differences from the paper
//! The first frame uses the distance from oriented points, because the distance from the plane (equation 6) has no sign
//! away from them. The last projection of a frame is onto that frame's points alone, which are shifted from their faces
//! to where intensities put the boundary (`shifts`), and the bias of fitted planes on curved surfaces is corrected.
//! Where two walls meet, the sheet between them has no boundary any more and is collapsed. No move makes the surface
//! intersect itself.

mod boundary_loss;
mod box_sides;
mod cavity;
mod coarse;
mod extremal;
mod first;
mod frame_tracker;
mod labelling;
mod lattice;
mod missing;
mod motion;
mod neighbours;
mod organ;
mod params;
mod presence;
mod project;
mod propose;
mod region;
mod samples;
mod shifts;
mod start;
mod state;
mod vote;
mod warnings;
mod working_space;

pub use frame_tracker::FrameStatistics;
pub use params::TrackingParams;

use super::method::method;

use super::{LiveSurface, MethodError, StepReport, Times};
use crate::math::{DVec3, Vec3};
use crate::mesh::{MAX_VERTICES, Mesh, TriangleMesh, measure};
use crate::pauses::{Pauses, finished};
use crate::remesh::Changes;
use crate::spatial::surface_distance;
use crate::volume::Volume;
use cavity::Filled;
use frame_tracker::FrameTracker;
use labelling::MIN_WEIGHT;
use presence::Tracked;
use project::SpaceTimeSamples;
use region::{Region, too_many_voxels};
use samples::{Falloff, SampleField};
use std::sync::Arc;
use vote::{BoundaryVoting, Faces, TIME, Window, too_much_boundary};
use warnings::SurfaceFacts;

/// Selects which connected surface of the first frame is tracked, if there are several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Component {
    /// The surface that encloses the largest volume.
    #[default]
    Largest,
    /// The surface that encloses a point, given in world coordinates, or has the vertex nearest to it.
    Nearest(DVec3),
}

/// The region of a 4D image in which a surface is tracked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounds {
    /// Two corners of a box, those with the least and the largest world coordinates; voxels whose centres are inside
    /// are processed. If the voxel axes are rotated, the bounding box of this box along the voxel axes is used.
    World([DVec3; 2]),
    /// The first and the last voxel of the region along x, y and z, both inclusive.
    Voxels([[usize; 3]; 2]),
}

/// An object, for [`SurfaceTracker::propose`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Query {
    /// A point in the object, in world coordinates, in a frame.
    Point {
        /// The point.
        at: DVec3,
        /// The index of the frame.
        frame: usize,
    },
    /// Two corners of a box with the object, those with the least and the largest world coordinates: what moves most in it.
    Box([DVec3; 2]),
    /// Nothing: what moves most in the whole sequence.
    #[default]
    Moving,
}

/// Proposed options of a [`SurfaceTracker`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// The first and the last voxel of the box, both inclusive, for [`Bounds::Voxels`].
    pub bounds: [[usize; 3]; 2],
    /// A point in the middle of the object in the first frame that has it, in world coordinates, for
    /// [`Component::Nearest`].
    pub component: DVec3,
    /// The first frame that has the object.
    pub frame: usize,
    /// The edge threshold, in units of intensity.
    pub threshold: f64,
}

/// The inside of a cavity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cavity {
    /// Dark structures within it, such as muscles in a chamber of the heart, and the furrows between those along its wall:
    /// its volume is what clinical measurements give. Convex objects without any are as they are.
    Closed,
    /// Bright voxels only, as in the paper.
    #[default]
    Open,
}

/// How much a [`SurfaceTracker`] may work with; by default, as much as fits into memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackingLimits {
    /// The largest number of vertices of the surface, at most and by default four million. The contour of all bright
    /// objects of the box, which the surface is chosen from, has at most eight times as many triangles.
    pub max_vertices: Option<usize>,
    /// The largest number of voxels of the box in one frame, with two more on every side, for steps; all frames together
    /// have at most eight times as many. The boundary of all frames together has at most as many points.
    pub max_voxels: Option<usize>,
}

/// The largest number of triangles of a contour for each vertex that a surface may have, and of all: as much as there is
/// memory to work with.
const TRIANGLES_PER_VERTEX: usize = 8;
const MOST_TRIANGLES: usize = 8_000_000;

/// The largest number of voxels of all frames, as a multiple of that of one: each takes a byte for its intensity, and one
/// for its level.
const ALL_FRAMES: usize = 8;

impl TrackingLimits {
    fn vertices(&self) -> usize {
        self.max_vertices.map_or(MAX_VERTICES, |most| most.min(MAX_VERTICES))
    }

    /// Returns the largest number of triangles of a contour.
    fn triangles(&self) -> usize {
        self.vertices().saturating_mul(TRIANGLES_PER_VERTEX).min(MOST_TRIANGLES)
    }

    /// Checks the number of voxels of a box with padding, and of all frames.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`].
    fn check_voxels(&self, dims: [usize; 3], frames: usize) -> Result<(), MethodError> {
        let voxels: usize = dims.iter().product();
        let fits = |most: usize| voxels <= most && voxels.saturating_mul(frames) / ALL_FRAMES <= most;
        if self.max_voxels.is_none_or(fits) { Ok(()) } else { Err(too_many_voxels(dims, frames)) }
    }

    fn points(&self) -> usize {
        self.max_voxels.unwrap_or(usize::MAX)
    }

    /// Checks the boundary of a frame before its contour is made, which takes long. A contour has two triangles for each
    /// face between bright and dark voxels, or fewer where it is smoother: with a third fewer it is certainly too large.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`].
    fn check_faces(&self, faces: &Faces) -> Result<(), MethodError> {
        let walls = faces[..TIME].iter().flatten().filter(|face| face.weight >= MIN_WEIGHT).count();
        if walls <= self.triangles() / 4 * 3 {
            return Ok(());
        }
        Err(too_much_boundary())
    }

    /// Checks the number of vertices of a tracked surface.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`].
    fn check_vertices(&self, count: usize) -> Result<(), MethodError> {
        if count <= self.vertices() {
            return Ok(());
        }
        let problem = format!(
            "the surface would have more than {} vertices: use a smaller box, a higher edge threshold, or an image with \
             fewer voxels",
            self.vertices()
        );
        Err(MethodError::TooLarge { problem })
    }
}

/// Options to create a [`SurfaceTracker`].
#[derive(Clone, Debug)]
pub struct TrackingOptions {
    /// The 4D image in which a surface is tracked, of two frames or more.
    pub volume: Volume,
    /// The region of the image that is processed; by default the whole volume. The surface is closed where the sides of
    /// the region cut a bright region.
    pub bounds: Option<Bounds>,
    /// Which surface of the first frame is tracked, if it has several; ignored if there is a `start`.
    pub component: Component,
    /// The surface in the first frame, from which tracking starts, in world coordinates; by default it is extracted
    /// from the image.
    pub start: Option<TriangleMesh>,
    /// The inside of the tracked surface.
    pub cavity: Cavity,
    /// How much the tracker may work with.
    pub limits: TrackingLimits,
    /// The initial parameters; `threshold`, `radius` and `time_scale` are derived from the volume if they are 0.
    pub params: TrackingParams,
}

/// The projection of a vertex onto the boundary has converged after a step shorter than this, in units of the shortest
/// side of a voxel.
const CONVERGED_STEP: f64 = 0.012;

/// Projections onto the boundary that move a vertex by more than this are rejected, in units of the shortest side of a
/// voxel.
const MAX_DISPLACEMENT: f64 = 4.8;

/// Tracks a closed surface through the frames of a 4D image.
#[derive(Clone, Debug)]
pub struct SurfaceTracker {
    region: Region,
    component: Component,
    /// The caller's mesh for the first frame; empty without one.
    start: Mesh,
    cavity: Cavity,
    limits: TrackingLimits,
    /// By frame, the voxels of the region that are filled, since the cavity is closed; none before the boundary is found.
    filled: Vec<Vec<Filled>>,
    /// Identifies the input in saved states.
    fingerprint: u64,
    params: TrackingParams,
    image: ImageStatistics,
    voting: BoundaryVoting,
    /// By frame, the faces between voxels that have boundary votes, for the frames in which they have been found so
    /// far.
    faces: Vec<Faces>,
    frame_tracker: Option<FrameTracker>,
    /// The boundary points around the newest tracked frame in time, `None` before the first.
    samples: Option<Arc<SpaceTimeSamples>>,
    mesh: Mesh,
    /// The surface of each frame tracked so far.
    meshes: Vec<TriangleMesh>,
    statistics: Vec<FrameStatistics>,
    /// The votes of windows over several frames, of the frame whose votes are those of windows within it for an attempt.
    replaced_faces: Option<(usize, Faces)>,
    /// By frame, the mean intensities inside and outside of its surface, in steps of the quantised intensities.
    intensities_at_surface: Vec<Option<[f64; 2]>>,
    /// Facts for warnings about the surface in each frame tracked so far.
    facts: Vec<SurfaceFacts>,
    /// `None` until it is known, NaN where it is not defined.
    cycle_closure_error: Option<f64>,
    /// The frames in which the surface of the frame before ended and another one began.
    lost: Vec<u32>,
    steps: u32,
    clock: fn() -> f64,
}

/// Properties of the image from which default tracking parameters are derived.
#[derive(Clone, Copy, Debug)]
struct ImageStatistics {
    /// The shortest side of a voxel, in world units.
    shortest_side: f64,
    /// The longest side of a voxel among axes along which the processed box has more than one voxel, in world units.
    longest_side: f64,
    /// The standard deviation of the noise in the image, in units of intensity.
    noise: f64,
    /// The difference between the largest and the smallest intensity in the processed box, without outliers.
    range: f64,
}

method!(SurfaceTracker, TrackingParams);

impl LiveSurface for SurfaceTracker {
    fn surface(&self) -> TriangleMesh {
        self.mesh().to_triangles()
    }

    fn origin(&self) -> DVec3 {
        self.region.space.origin
    }

    fn counts(&self) -> [usize; 2] {
        self.mesh().counts()
    }

    fn versions(&self) -> [u32; 2] {
        self.mesh().versions()
    }
}

impl SurfaceTracker {
    /// Creates a tracker, which [`Self::step`] then takes through the frames.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for parameters that are not accepted, for a volume with one frame, without
    /// contrast or with axes that are not at right angles, for a box outside of the volume, with too few voxels or with
    /// too many for memory, and for a start that is empty, inside out, without a vertex in the box, or has a mean edge
    /// below a tenth of a voxel; [`MethodError::Mesh`] for a start that is not a closed surface, or intersects itself;
    /// [`MethodError::Volume`] if a frame does not fit into memory.
    pub fn new(options: TrackingOptions) -> Result<Self, MethodError> {
        finished(Self::new_in_slices(options))
    }

    /// As [`Self::new`], with a pause after each frame that is read.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub async fn new_in_slices(options: TrackingOptions) -> Result<Self, MethodError> {
        let pauses = Pauses::default();
        let TrackingOptions { volume, bounds, component, start, cavity, limits, params } = options;
        params.validate()?;
        if volume.frames() < 2 {
            let problem = "must have at least two frames, got one";
            return Err(MethodError::invalid("volume", problem));
        }
        let shortest_side = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let volume = volume.without_fill_values(&pauses).await?;
        let region = Region::new(&volume, bounds, &pauses).await?;
        let noise = region.noise() * region.quantum;
        let image = ImageStatistics {
            shortest_side,
            longest_side: region.longest_side() / region.space.scale,
            noise,
            range: region.span(),
        };
        let start = match &start {
            Some(mesh) => start::validate_start(mesh, &region, &pauses).await?,
            None => region.space.empty_mesh(),
        };
        limits.check_vertices(start.vertex_count())?;
        pauses.now().await;
        let mut tracker = Self {
            voting: BoundaryVoting::new(Window::default(), 0),
            mesh: start.clone(),
            region,
            component,
            start,
            cavity,
            limits,
            filled: Vec::new(),
            fingerprint: 0,
            params: TrackingParams::default(),
            image,
            faces: Vec::new(),
            frame_tracker: None,
            samples: None,
            meshes: Vec::new(),
            statistics: Vec::new(),
            replaced_faces: None,
            intensities_at_surface: Vec::new(),
            facts: Vec::new(),
            cycle_closure_error: None,
            lost: Vec::new(),
            steps: 0,
            clock: || 0.0,
        };
        tracker.params = tracker.with_defaults(params)?;
        tracker.fingerprint = tracker.input_hash();
        pauses.now().await;
        tracker.restart();
        Ok(tracker)
    }

    /// Returns `params` with `threshold`, `radius` and `time_scale` derived from the volume if they are 0.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for parameters that are not accepted, among them a radius outside the range for
    /// these voxels.
    fn with_defaults(&self, params: TrackingParams) -> Result<TrackingParams, MethodError> {
        params.validate()?;
        let shortest_side = self.image.shortest_side;
        let is_given = params.radius != 0.0;
        let params = params.with_volume(&self.image);
        let most = samples::MAX_FACES / 2 - 1;
        let longest = shortest_side * most as f64;
        // With the longest radius instead, surfaces had almost three times their volume.
        if params.radius > longest && !is_given {
            let ratio = self.image.longest_side / shortest_side;
            let problem = format!(
                "its slices are {ratio:.1} pixels apart, too far for a fit of planes: insert slices between them first (enrichSlices)"
            );
            return Err(MethodError::invalid("volume", problem));
        }
        if params.radius < shortest_side || params.radius > longest {
            let problem = format!(
                "must be from {shortest_side} to {longest} (1 to {most} voxels), got {}",
                params.radius
            );
            return Err(MethodError::invalid("radius", problem));
        }
        Ok(params)
    }

    /// Resets the run to before its first step, with the current parameters; only the number of steps is kept.
    fn restart(&mut self) {
        self.region.unfill(&self.filled);
        self.filled.clear();
        self.region.threshold = self.params.threshold / self.region.quantum;
        let window = Window {
            half_width: self.params.window as usize,
            frames: self.params.window_frames as usize,
            threshold: self.region.threshold,
            cyclic: self.params.cyclic,
        };
        self.voting = BoundaryVoting::new(window, self.frames());
        self.faces.clear();
        self.replaced_faces = None;
        (self.frame_tracker, self.samples, self.cycle_closure_error) = (None, None, None);
        self.meshes.clear();
        self.statistics.clear();
        self.intensities_at_surface.clear();
        self.facts.clear();
        self.lost.clear();
        let replaced = std::mem::replace(&mut self.mesh, self.start.clone());
        self.mesh.advance_versions_past(&replaced);
    }

    /// Sets the parameters during a run. A change of parameters that affect the boundary in the image (`threshold`,
    /// `window`, `window_frames`, `cyclic`) restarts the run; other changes apply from the next frame on.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for parameters that are not accepted; nothing has changed then.
    pub fn set_params(&mut self, params: TrackingParams) -> Result<(), MethodError> {
        let params = self.with_defaults(params)?;
        let keeps_boundary = params.same_boundary(&self.params);
        self.params = params;
        if keeps_boundary {
            self.samples = self.newest_samples();
        } else {
            self.restart();
        }
        Ok(())
    }

    /// Sets the clock, a function that returns the time in milliseconds, for [`StepReport::times`]. By default all
    /// times are 0.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// Returns the current parameters, including those derived from the volume.
    pub fn params(&self) -> &TrackingParams {
        &self.params
    }

    /// Returns the estimated standard deviation of the noise in the image, in units of intensity; for choosing the
    /// parameter `threshold`.
    pub fn noise(&self) -> f64 {
        self.image.noise
    }

    /// Returns the origin in world space of all meshes and boundary points that the tracker gives: their coordinates plus
    /// this are those in the world. It is 0 unless the volume is far from the world's origin for its size, where single
    /// precision would be too coarse.
    pub fn origin(&self) -> DVec3 {
        self.region.space.origin
    }

    /// Returns the surface in the newest frame, relative to [`Self::origin`]; before the first frame is done, the caller's
    /// start, or an empty mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the surface of each frame tracked so far, relative to [`Self::origin`]; positions and triangles only.
    pub fn meshes(&self) -> &[TriangleMesh] {
        &self.meshes
    }

    /// Returns the measurements of the surface and the counts of what tracking did, for each frame tracked so far.
    pub fn statistics(&self) -> &[FrameStatistics] {
        &self.statistics
    }

    /// Returns the index of the frame that [`Self::mesh`] belongs to; 0 before the first frame is done, too.
    pub fn frame(&self) -> usize {
        self.meshes.len().saturating_sub(1)
    }

    /// Returns the volume enclosed by the surface in each frame tracked so far, in cubed world units.
    pub fn volumes(&self) -> Vec<f64> {
        self.statistics.iter().map(|statistics| statistics.volume).collect()
    }

    /// Returns the cycle closure error: the mean distance of the last frame's surface, tracked on to the first frame,
    /// from the surface there, in world units. `None` until it is known, for sequences that are not cyclic, and if the
    /// first or the last frame has no surface.
    pub fn cycle_closure_error(&self) -> Option<f64> {
        self.cycle_closure_error.filter(|error| !error.is_nan())
    }

    /// Returns the number of frames, from the first on, whose boundary in the image has been found, for progress
    /// displays.
    pub fn frames_with_boundary(&self) -> usize {
        self.faces.len()
    }

    /// Returns the boundary points of a frame: x, y, z relative to [`Self::origin`], t in frames, and the weight (share
    /// of votes, up to 1), for display. Empty until the boundary of the frame has been found.
    pub fn boundary(&self, frame: usize) -> Vec<[f32; 5]> {
        let Some(faces) = self.faces.get(frame) else { return Vec::new() };
        let mut points = Vec::new();
        for (direction, list) in faces.iter().enumerate() {
            for face in list {
                let (position, later) = self.region.face(direction, face.voxel);
                let at = self.region.to_space(position);
                let [x, y, z] = self.region.space.relative(at).to_array();
                points.push([x, y, z, frame as f32 + later, face.weight]);
            }
        }
        points
    }

    /// Returns whether all frames are tracked, and the closure error of a cyclic sequence is known.
    pub fn is_done(&self) -> bool {
        self.meshes.len() == self.frames() && (self.cycle_closure_error.is_some() || !self.params.cyclic)
    }

    /// Runs one step of tracking: finds the boundary in the next frame, until it is known in all frames; then tracks
    /// the surface into the next frame; and finally, in a cyclic sequence, from the last frame to the first. Once that
    /// is done, calls change nothing and report `done`.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if there is no boundary or no closed surface; [`MethodError::TooLarge`] beyond
    /// [`TrackingOptions::limits`]; [`MethodError::Mesh`] and
    /// [`MethodError::Volume`] if memory does not suffice.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        finished(self.step_in_slices())
    }

    /// Runs one step as [`Self::step`] does, with pauses. If the future is dropped at one, [`Self::discard_step`] must be
    /// called, and the run is as it was before the step.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub async fn step_in_slices(&mut self) -> Result<StepReport, MethodError> {
        let pauses = Pauses::default();
        let began = (self.clock)();
        let mut times = Times::default();
        let mut changes = Changes::default();
        if self.is_done() {
            return Ok(self.report(changes, times));
        }
        self.limits.check_voxels(self.region.dims, self.frames())?;
        if self.faces.len() < self.frames() {
            let frame = self.faces.len();
            if self.cavity == Cavity::Closed && self.filled.is_empty() {
                self.close_cavity(&pauses).await;
            }
            let found: usize = self.faces.iter().flatten().map(Vec::len).sum();
            let most = self.limits.points().saturating_sub(found);
            let faces = self.voting.faces(&self.region, frame, most, &pauses).await?;
            self.limits.check_faces(&faces)?;
            self.faces.push(faces);
            times.add("boundary", (self.clock)() - began);
        } else if self.meshes.len() < self.frames() {
            let result = self.next_frame(&pauses).await;
            self.keep_votes(result.is_ok());
            changes = result?;
            times.add("surface", (self.clock)() - began);
        } else {
            self.close_cycle(&pauses).await;
            times.add("closure", (self.clock)() - began);
        }
        self.steps = self.steps.saturating_add(1);
        Ok(self.report(changes, times))
    }

    /// Fills dark voxels within the cavity, so that they count as blood.
    async fn close_cavity(&mut self, pauses: &Pauses) {
        let mut voting = BoundaryVoting::new(self.voting.window(), self.frames());
        self.filled = self.voxels_to_fill(&mut voting, pauses).await;
        self.region.fill(&self.filled);
    }

    /// Undoes what a step has changed that was dropped at a pause; see [`Self::step_in_slices`].
    pub fn discard_step(&mut self) {
        self.keep_votes(false);
    }

    /// Returns the number of frames of the volume.
    pub fn frames(&self) -> usize {
        self.region.frames.len()
    }

    /// Tracks the surface into the next frame, or extracts it where an object begins; returns the edits of the mesh. The
    /// surface is empty in frames without an object. If this fails, nothing has changed.
    async fn next_frame(&mut self, pauses: &Pauses) -> Result<Changes, MethodError> {
        let (frame, space) = (self.meshes.len(), self.region.space);
        if frame == 0 {
            self.check_boundary(pauses).await?;
        }
        let mut last = self.mesh.clone();
        space.enter(&mut last);
        let has_surface = last.vertex_count() > 0;
        if has_surface {
            let tracker = self.frame_tracker.clone();
            let tracker =
                tracker.unwrap_or_else(|| FrameTracker::new(measure(&last.to_triangles()).edge_mean));
            let (edge, from) = (tracker.edge, self.samples.clone());
            let found = self.follow(&last, tracker, from.as_deref(), frame, pauses).await?;
            self.frame_tracker = Some(FrameTracker::new(edge));
            if let Some(found) = found {
                return match self.extracted_instead(&found, frame, pauses).await? {
                    Some(instead) => self.set_begun_frame(instead, pauses).await,
                    None => Ok(self.set_frame(found, pauses).await?.0),
                };
            }
        }
        // Nothing else begins where a caller's start ends.
        let may_begin = frame > 0 || !has_surface;
        match if may_begin { self.begin(&last, frame, pauses).await? } else { None } {
            Some(found) => self.set_begun_frame(found, pauses).await,
            None => {
                self.set_empty_frame();
                Ok(Changes::default())
            }
        }
    }

    /// Adds the next frame with the surface that begins there, in place of the one before, if there is one; returns the edits
    /// of the mesh.
    ///
    /// # Errors
    /// Those of [`Self::set_frame`].
    async fn set_begun_frame(&mut self, found: Tracked, pauses: &Pauses) -> Result<Changes, MethodError> {
        let frame = self.meshes.len() as u32;
        let (changes, replaced) = self.set_frame(found, pauses).await?;
        if replaced.vertex_count() > 0 {
            self.lost.push(frame);
        }
        self.mesh.advance_versions_past(&replaced);
        Ok(changes)
    }

    /// Adds the next frame with the surface tracked into it, after the last pause; returns the edits of the mesh, and the
    /// mesh before.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`] if it has more vertices than allowed; nothing has changed then.
    async fn set_frame(&mut self, found: Tracked, pauses: &Pauses) -> Result<(Changes, Mesh), MethodError> {
        self.limits.check_vertices(found.mesh.vertex_count())?;
        let (frame, space) = (self.meshes.len(), self.region.space);
        let mut mesh = found.mesh;
        space.leave(&mut mesh);
        let surface = TriangleMesh { normals: None, ..mesh.to_triangles() };
        pauses.after(mesh.slots()).await;
        let intensities = self.measured_intensities(frame, &surface);
        pauses.after(mesh.slots()).await;
        let facts = self.measured_facts(frame, &surface, intensities, pauses).await;
        let replaced = std::mem::replace(&mut self.mesh, mesh);
        (self.frame_tracker, self.samples) = (Some(found.tracker), Some(found.samples));
        self.meshes.push(surface);
        self.statistics.push(space.statistics(found.statistics));
        self.intensities_at_surface.push(intensities);
        self.facts.push(facts);
        Ok((found.changes, replaced))
    }

    /// Adds the next frame without a surface.
    fn set_empty_frame(&mut self) {
        let replaced = std::mem::replace(&mut self.mesh, self.region.space.empty_mesh());
        self.mesh.advance_versions_past(&replaced);
        self.samples = None;
        self.meshes.push(TriangleMesh { normals: None, ..self.mesh.to_triangles() });
        self.statistics.push(FrameStatistics::default());
        self.intensities_at_surface.push(None);
        self.facts.push(SurfaceFacts::default());
    }

    /// Tracks a copy of the last frame's surface on to the first frame, and sets the cycle closure error to its mean
    /// distance from the surface there; to NaN if one of the two is empty, or the first frame has no object there.
    async fn close_cycle(&mut self, pauses: &Pauses) {
        self.cycle_closure_error = Some(self.measured_closure(pauses).await.unwrap_or(f64::NAN));
    }

    /// Returns the cycle closure error; `None` where it is not defined.
    async fn measured_closure(&mut self, pauses: &Pauses) -> Option<f64> {
        let (tracker, first) = (self.frame_tracker.clone()?, self.meshes.first()?);
        if first.triangles.is_empty() || self.mesh.vertex_count() == 0 {
            return None;
        }
        let space = self.region.space;
        let mut mesh = self.mesh.clone();
        space.enter(&mut mesh);
        self.voting.ensure_levels(&self.region, 0, pauses).await;
        let samples = self.samples.as_deref();
        let mut closed = self.tracked(mesh, tracker, samples, 0, &self.voting, pauses).await;
        if !closed.is_present {
            return None;
        }
        space.leave(&mut closed.mesh);
        surface_distance(&closed.mesh.to_triangles(), first).ok().map(|distance| distance.mean)
    }

    /// Collects the boundary points around the newest tracked frame in time; `None` before the first frame is tracked.
    fn newest_samples(&self) -> Option<Arc<SpaceTimeSamples>> {
        self.meshes
            .len()
            .checked_sub(1)
            .map(|frame| Arc::new(finished(self.samples_around(frame, &Pauses::default()))))
    }

    /// Collects the boundary points of a frame and of those around it in time, for plane fits in that frame.
    async fn samples_around(&self, frame: usize, pauses: &Pauses) -> SpaceTimeSamples {
        let (count, falloff) = (self.frames(), self.falloff());
        // In a cycle, no frame is added twice.
        let most = if self.params.cyclic { (count - 1) / 2 } else { count - 1 };
        let offsets = falloff.offsets(most).map(|offset| (offset, frame as i64 + offset));
        let near = offsets.filter(|(_, at)| self.params.cyclic || (0..count as i64).contains(at));
        let frames: Vec<_> =
            near.map(|(offset, at)| (offset, &self.faces[at.rem_euclid(count as i64) as usize])).collect();
        let field = SampleField::of(&self.region, falloff, &frames, pauses).await;
        let shortest_side = self.region.spacing.min_element();
        let (damping, time_scale) = (self.params.damping, falloff.time_scale);
        let box_side_voxels = self.region.bright_box_side_voxels(&self.faces[frame], pauses).await;
        let faces = &self.faces[frame];
        let shifts = self.region.shifts(frame, faces, self.voting.window().half_width, pauses).await;
        let own = SampleField::single_frame(&self.region, falloff, faces, &shifts, pauses).await;
        SpaceTimeSamples {
            field,
            own,
            box_side_voxels,
            time_scale,
            damping,
            tolerance: CONVERGED_STEP * shortest_side,
            max_displacement: MAX_DISPLACEMENT * shortest_side,
        }
    }

    fn falloff(&self) -> Falloff {
        let params = self.region.space.params(&self.params);
        Falloff { radius: params.radius, time_scale: params.time_scale }
    }

    fn report(&self, events: Changes, times: Times) -> StepReport {
        let frames = self.frames();
        let (found, done) = (self.faces.len(), self.meshes.len());
        let phase = if self.cycle_closure_error.is_some() {
            "closing the cycle".into()
        } else if done > 0 {
            format!("tracking surface, frame {done} of {frames}")
        } else {
            format!("finding boundary, frame {found} of {frames}")
        };
        let closing_steps = usize::from(self.params.cyclic);
        let steps_done = found + done + usize::from(self.cycle_closure_error.is_some());
        StepReport {
            iteration: self.steps,
            done: self.is_done(),
            phase,
            progress: steps_done as f64 / (2 * frames + closing_steps) as f64,
            residual: self.statistics.last().map_or(f64::NAN, |statistics| statistics.mean_final_correction),
            tolerance: CONVERGED_STEP * self.region.shortest_side(),
            vertices: self.mesh.vertex_count() as u32,
            triangles: self.mesh.triangle_count() as u32,
            components: self.mesh.component_count() as u32,
            euler: self.mesh.euler() as i32,
            events,
            times,
            warnings: self.warnings(),
        }
    }
}

impl Region {
    fn to_local(&self, p: Vec3) -> DVec3 {
        self.from_space.transform_point3(p.as_dvec3())
    }

    fn to_space(&self, position: DVec3) -> Vec3 {
        self.to_space.transform_point3(position).as_vec3()
    }

    fn direction_to_space(&self, displacement: DVec3) -> Vec3 {
        self.to_space.transform_vector3(displacement).as_vec3()
    }
}
