//! A dynamic surface through a 4D image.
//!
//! Dynamic surfaces from 4D cardiac MRI by weighted points in space-time. Windows of the image vote for the faces between
//! bright and dark voxels (`vote`; section 2). The votes are weighted points in space-time, whose extremal surface is where a
//! place lies on the plane that fits the points around it (`samples`, `extremal`; section 3). The first frame's surface is
//! meshed (`first`; section 4.1), and taken from frame to frame by prediction and projection (`project`, `follow`; sections
//! 3.3, 4.2 and 4.3).
//!
//! # What it guarantees
//! After every step the surface is closed, oriented and 2-manifold, and no two triangles cross. The same input gives the same
//! bits, natively and in wasm.
//!
//! # What is not the paper's
//! The first frame's distance is that from oriented points (the plane's own, equation 6, has no sign away from them). A frame's
//! last projection is onto its own points alone, and what planes take from bends is given back. Where two walls meet, the sheet
//! between them has no boundary left; it is drawn together. Nothing is moved so that it crosses.

mod crevice;
mod cut;
mod extremal;
mod first;
mod follow;
mod params;
mod project;
mod region;
mod samples;
mod sides;
mod start;
mod state;
mod vote;

pub use follow::FrameFacts;
pub use params::{TrackingParams, param_specs};

use super::{MethodError, StepReport, Times};
use crate::math::{DVec3, Vec3};
use crate::mesh::{Mesh, TriangleMesh, measure};
use crate::remesh::Changes;
use crate::spatial::surface_distance;
use crate::volume::Volume;
use follow::{Follower, Going};
use project::Moment;
use region::Region;
use samples::{Falloff, Field};
use vote::{Faces, Voting, Window};

/// Which surface of the first frame is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Component {
    /// The one that encloses most.
    #[default]
    Largest,
    /// The one around a point of the world, or nearest to it.
    Nearest(DVec3),
}

/// A part of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bounds {
    /// Opposite corners in the world. Where voxel axes are not those of the world, the box along voxel axes around that one is
    /// taken.
    World([DVec3; 2]),
    /// The first and the last voxel.
    Voxels([[usize; 3]; 2]),
}

/// How a [`SurfaceTracker`] is set up.
#[derive(Clone, Debug)]
pub struct TrackingOptions {
    /// Two frames or more.
    pub volume: Volume,
    /// The part that is looked at; all of it without. What is bright where it ends is closed there.
    pub bounds: Option<Bounds>,
    /// What is followed.
    pub component: Component,
    /// The surface in the first frame; else it is found.
    pub start: Option<TriangleMesh>,
    /// Those that are 0 are taken from the volume.
    pub params: TrackingParams,
}

/// A step of a projection as short as this is the last, in the shortest side of a voxel.
const STILL: f64 = 0.012;

/// Projections that lead further are rejected, in the same.
const LONGEST: f64 = 4.8;

/// A surface that is followed through the frames of a 4D image.
#[derive(Clone, Debug)]
pub struct SurfaceTracker {
    region: Region,
    component: Component,
    /// The caller's mesh; empty without.
    start: Mesh,
    params: TrackingParams,
    /// Of the volume: the shortest side of a voxel, the noise and the range of intensities.
    image: ImageFacts,
    voting: Voting,
    /// By frame, as far as they are found.
    faces: Vec<Faces>,
    follower: Option<Follower>,
    /// Around the newest frame.
    moment: Option<Moment>,
    mesh: Mesh,
    /// By frame, in the world.
    meshes: Vec<TriangleMesh>,
    facts: Vec<FrameFacts>,
    closing: Option<f64>,
    steps: u32,
    clock: fn() -> f64,
}

/// What parameters are taken from where none are given.
#[derive(Clone, Copy, Debug)]
struct ImageFacts {
    /// The shortest side of a voxel.
    pixel: f64,
    /// The longest along which there are several.
    thickest: f64,
    /// The standard deviation of the noise, in intensity.
    noise: f64,
    /// The range of intensities.
    range: f64,
}

impl SurfaceTracker {
    /// A tracker before its first step.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`]: parameters, a volume of one frame, or without contrast, or with axes that are not
    /// at right angles, a box outside of it; a start that is empty, inside out, or with edges shorter than a tenth of a voxel;
    /// [`MethodError::Mesh`] for a start that is not a closed surface, or crosses itself.
    pub fn new(options: TrackingOptions) -> Result<Self, MethodError> {
        let TrackingOptions { volume, bounds, component, start, params } = options;
        params.validate()?;
        if volume.frames() < 2 {
            let problem = "it has one frame; a 4D volume of two frames or more is needed";
            return Err(MethodError::invalid("volume", problem));
        }
        let pixel = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let region = Region::new(&volume, bounds)?;
        let noise = region.noise() * region.step;
        let image = ImageFacts { pixel, thickest: region.thickest(), noise, range: region.span() };
        let start = start.as_ref().map_or(Ok(Mesh::default()), |mesh| start::checked(mesh, &region))?;
        let mut tracker = Self {
            voting: Voting::new(Window::default(), 0),
            mesh: start.clone(),
            region,
            component,
            start,
            params: TrackingParams::default(),
            image,
            faces: Vec::new(),
            follower: None,
            moment: None,
            meshes: Vec::new(),
            facts: Vec::new(),
            closing: None,
            steps: 0,
            clock: || 0.0,
        };
        tracker.params = tracker.completed(params)?;
        tracker.begin();
        Ok(tracker)
    }

    /// Parameters, checked, with what is taken from the volume.
    fn completed(&self, params: TrackingParams) -> Result<TrackingParams, MethodError> {
        params.validate()?;
        let pixel = self.image.pixel;
        let params = params.with_volume(&self.image);
        let most = samples::MOST / 2 - 1;
        let longest = pixel * most as f64;
        if params.radius < pixel || params.radius > longest {
            let problem =
                format!("{} given, {pixel} to {longest} (1 to {most} voxels) accepted", params.radius);
            return Err(MethodError::invalid("radius", problem));
        }
        Ok(params)
    }

    /// Back before the first step, with the parameters as they are.
    fn begin(&mut self) {
        self.region.threshold = self.params.threshold / self.region.step;
        let window = Window {
            reach: self.params.window as usize,
            frames: self.params.window_frames as usize,
            threshold: self.region.threshold,
            cyclic: self.params.cyclic,
        };
        self.voting = Voting::new(window, self.frames());
        self.faces.clear();
        (self.follower, self.moment, self.closing) = (None, None, None);
        self.meshes.clear();
        self.facts.clear();
        let replaced = std::mem::replace(&mut self.mesh, self.start.clone());
        self.mesh.count_on_from(&replaced);
    }

    /// Live parameters. Those of the boundary (`threshold`, `window`, `windowFrames`, `cyclic`) begin everything again; the
    /// others hold from the next frame on.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`], and nothing has changed.
    pub fn set_params(&mut self, params: TrackingParams) -> Result<(), MethodError> {
        let params = self.completed(params)?;
        let stands = params.same_boundary(&self.params);
        self.params = params;
        if stands {
            self.moment = self.newest_moment();
        } else {
            self.begin();
        }
        Ok(())
    }

    /// Times are told by this clock, in milliseconds.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// Parameters, with what was taken from the volume.
    pub fn params(&self) -> &TrackingParams {
        &self.params
    }

    /// The standard deviation of the noise, in intensity.
    pub fn noise(&self) -> f64 {
        self.image.noise
    }

    /// The surface in the newest frame, in the world.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The surfaces of the frames so far, in the world: positions and triangles.
    pub fn meshes(&self) -> &[TriangleMesh] {
        &self.meshes
    }

    /// What happened in the frames so far.
    pub fn facts(&self) -> &[FrameFacts] {
        &self.facts
    }

    /// The frame that the mesh is of: 0 before the first, too.
    pub fn frame(&self) -> usize {
        self.meshes.len().saturating_sub(1)
    }

    /// The volumes that the surfaces of the frames so far enclose, in cubed world units.
    pub fn volumes(&self) -> Vec<f64> {
        self.facts.iter().map(|facts| facts.volume).collect()
    }

    /// Of a cyclic sequence: how far the surface of the last frame, taken on to the first, is from the first frame's in the
    /// mean, world units; once it is known.
    pub fn closing(&self) -> Option<f64> {
        self.closing
    }

    /// So many frames, from the first on, have their boundary.
    pub fn bounded(&self) -> usize {
        self.faces.len()
    }

    /// The boundary's points in a frame, as far as they are found: x, y, z in the world, t in frames, and the weight.
    pub fn boundary(&self, frame: usize) -> Vec<[f32; 5]> {
        let Some(faces) = self.faces.get(frame) else { return Vec::new() };
        let mut points = Vec::new();
        for (direction, list) in faces.iter().enumerate() {
            for face in list {
                let (place, later) = self.region.face(direction, face.voxel);
                let [x, y, z] = self.region.world(place).to_array();
                points.push([x, y, z, frame as f32 + later, face.weight]);
            }
        }
        points
    }

    /// Whether all frames are done, and a cycle is closed.
    pub fn is_done(&self) -> bool {
        self.meshes.len() == self.frames() && (self.closing.is_some() || !self.params.cyclic)
    }

    /// Finds the boundary in one more frame; then follows the surface into one more frame; at last, in a cyclic sequence,
    /// from the last to the first.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] where there is no boundary at all, or no surface; [`MethodError::Mesh`] and
    /// [`MethodError::Volume`] where there is no memory for it.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        let began = (self.clock)();
        let mut times = Times::default();
        let mut changes = Changes::default();
        if self.is_done() {
            return Ok(self.report(changes, times));
        }
        if self.faces.len() < self.frames() {
            let frame = self.faces.len();
            let faces = self.voting.faces(&self.region, frame);
            self.faces.push(faces);
            times.add("boundary", (self.clock)() - began);
        } else if self.meshes.len() < self.frames() {
            changes = self.next_frame()?;
            times.add("surface", (self.clock)() - began);
        } else {
            self.close();
            times.add("closing", (self.clock)() - began);
        }
        self.steps = self.steps.saturating_add(1);
        Ok(self.report(changes, times))
    }

    /// Frames of the volume.
    pub fn frames(&self) -> usize {
        self.region.frames.len()
    }

    /// The surface in the next frame; where it fails, nothing has changed.
    fn next_frame(&mut self) -> Result<Changes, MethodError> {
        let frame = self.meshes.len();
        let mut follower = match self.follower.take() {
            Some(follower) => follower,
            None => {
                self.find_first_mesh()?;
                Follower::new(measure(&self.mesh.to_triangles()).edge_mean)
            }
        };
        // There is one around every frame that was done.
        let from = self.moment.take();
        let into = self.moment_of(frame);
        self.voting.know_levels(&self.region, frame);
        let going =
            Going { region: &self.region, params: &self.params, frame, into: &into, voting: &self.voting };
        let (changes, facts) = follower.go(&mut self.mesh, from.as_ref(), &going);
        (self.follower, self.moment) = (Some(follower), Some(into));
        self.meshes.push(TriangleMesh { normals: None, ..self.mesh.to_triangles() });
        self.facts.push(facts);
        Ok(changes)
    }

    /// From the last frame on to the first: a cycle's surface should come back to where it began.
    fn close(&mut self) {
        let (Some(mut follower), Some(first)) = (self.follower.clone(), self.meshes.first()) else { return };
        let mut mesh = self.mesh.clone();
        let into = self.moment_of(0);
        self.voting.know_levels(&self.region, 0);
        let going =
            Going { region: &self.region, params: &self.params, frame: 0, into: &into, voting: &self.voting };
        follower.go(&mut mesh, self.moment.as_ref(), &going);
        let apart = surface_distance(&mesh.to_triangles(), first);
        self.closing = Some(apart.map_or(f64::INFINITY, |distance| distance.mean));
    }

    /// What is around the newest frame that is done.
    fn newest_moment(&self) -> Option<Moment> {
        self.meshes.len().checked_sub(1).map(|frame| self.moment_of(frame))
    }

    /// What is around a frame.
    fn moment_of(&self, frame: usize) -> Moment {
        let (count, falloff) = (self.frames(), self.falloff());
        let mut field = Field::new(&self.region, falloff);
        // No frame twice.
        let most = if self.params.cyclic { (count - 1) / 2 } else { count - 1 };
        for offset in falloff.offsets(most) {
            let at = frame as i64 + offset;
            if self.params.cyclic || (0..count as i64).contains(&at) {
                field.add(&self.faces[at.rem_euclid(count as i64) as usize], offset);
            }
        }
        let pixel = self.region.spacing.min_element();
        let (damping, time_scale) = (self.params.damping, self.params.time_scale);
        let cut = self.region.cut_voxels(&self.faces[frame]);
        let own = Field::still(&self.region, falloff, &self.faces[frame]);
        Moment { field, own, cut, time_scale, damping, still: STILL * pixel, longest: LONGEST * pixel }
    }

    fn falloff(&self) -> Falloff {
        Falloff { radius: self.params.radius, time_scale: self.params.time_scale }
    }

    fn report(&self, events: Changes, times: Times) -> StepReport {
        let frames = self.frames();
        let (found, done) = (self.faces.len(), self.meshes.len());
        let phase = if self.closing.is_some() {
            "surface, back in the first frame".into()
        } else if done > 0 {
            format!("surface, frame {done} of {frames}")
        } else {
            format!("boundary, frame {found} of {frames}")
        };
        let closing = usize::from(self.params.cyclic);
        let steps_done = found + done + usize::from(self.closing.is_some());
        StepReport {
            iteration: self.steps,
            done: self.is_done(),
            phase,
            progress: steps_done as f64 / (2 * frames + closing) as f64,
            residual: self.facts.last().map_or(f64::NAN, |facts| facts.correction),
            tolerance: STILL * self.region.spacing.min_element(),
            vertices: self.mesh.vertex_count() as u32,
            triangles: self.mesh.triangle_count() as u32,
            components: self.mesh.component_count() as u32,
            euler: self.mesh.euler() as i32,
            events,
            times,
        }
    }
}

impl Region {
    fn place(&self, p: Vec3) -> DVec3 {
        self.from_world.transform_point3(p.as_dvec3())
    }

    fn world(&self, place: DVec3) -> Vec3 {
        self.to_world.transform_point3(place).as_vec3()
    }

    fn direction(&self, way: DVec3) -> Vec3 {
        self.to_world.transform_vector3(way).as_vec3()
    }
}
