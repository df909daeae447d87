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
//! The first frame's distance is that from oriented points (the plane's own, equation 6, has no sign away from them). Where
//! two walls meet, the sheet between them has no boundary left; it is drawn together. Nothing is moved so that it crosses.

mod extremal;
mod first;
mod follow;
mod params;
mod project;
mod region;
mod samples;
mod vote;

pub use follow::FrameFacts;
pub use params::{TrackingParams, param_specs};

use super::{MethodError, StepReport, Times};
use crate::math::{DVec3, Vec3};
use crate::mesh::{Mesh, MeshError, TriangleMesh, VertexId, count_crossings, measure};
use crate::remesh::{Changes, EdgeBounds, remesh};
use crate::volume::Volume;
use first::bright_surface;
use follow::Follower;
use project::Moment;
use region::Region;
use samples::{Falloff, Field};
use vote::{Faces, Voting, Window};

/// Which surface of the first frame is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Component {
    /// The one with the most vertices.
    #[default]
    Largest,
    /// The one nearest to a point of the world.
    Nearest(DVec3),
}

/// How a [`SurfaceTracker`] is set up.
#[derive(Clone, Debug)]
pub struct TrackingOptions {
    /// Two frames or more.
    pub volume: Volume,
    /// The part that is looked at: opposite corners in the world; all of it without.
    pub bounds: Option<[DVec3; 2]>,
    /// What is followed.
    pub component: Component,
    /// The surface in the first frame; else it is found.
    pub start: Option<TriangleMesh>,
    /// Those that are 0 are taken from the volume.
    pub params: TrackingParams,
}

/// Edges of the first frame's mesh, in the shortest side of a voxel.
const EDGE: f64 = 1.2;

/// Their bounds, in that length.
const EDGE_SPREAD: f32 = 1.5;

/// A step of a projection as short as this is the last, in the shortest side of a voxel.
const STILL: f64 = 0.012;

/// Projections that lead further are rejected, in the same.
const LONGEST: f64 = 4.8;

/// A surface that is followed through the frames of a 4D image.
#[derive(Clone, Debug)]
pub struct SurfaceTracker {
    region: Region,
    component: Component,
    params: TrackingParams,
    noise: f64,
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
    steps: u32,
    clock: fn() -> f64,
}

impl SurfaceTracker {
    /// A tracker before its first step.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`]: parameters, a volume of one frame, or without contrast, or with axes that are not
    /// at right angles, a box outside of it; an empty start or one inside out; [`MethodError::Mesh`] for a start
    /// that is not a closed surface, or crosses itself.
    pub fn new(options: TrackingOptions) -> Result<Self, MethodError> {
        let TrackingOptions { volume, bounds, component, start, params } = options;
        params.validate()?;
        if volume.frames() < 2 {
            let problem = "it has one frame; a 4D volume of two frames or more is needed";
            return Err(MethodError::invalid("volume", problem));
        }
        let spacing = volume.spacing();
        let pixel = spacing.into_iter().fold(f64::INFINITY, f64::min);
        // Room for windows and planes beyond the box.
        let margin = if params.radius > 0.0 { params.radius } else { LONGEST * pixel };
        let mut region = Region::new(&volume, bounds, margin)?;
        let noise = region.noise() * region.step;
        let params = params.with_volume(pixel, noise, volume.span());
        check_radius(&params, spacing)?;
        region.threshold = params.threshold / region.step;
        let mesh = match &start {
            Some(start) => start_mesh(start)?,
            None => Mesh::default(),
        };
        let frames = region.frames.len();
        let window = Window {
            reach: params.window as usize,
            frames: params.window_frames as usize,
            threshold: region.threshold,
            cyclic: params.cyclic,
        };
        Ok(Self {
            voting: Voting::new(window, frames),
            region,
            component,
            params,
            noise,
            faces: Vec::new(),
            follower: None,
            moment: None,
            mesh,
            meshes: Vec::new(),
            facts: Vec::new(),
            steps: 0,
            clock: || 0.0,
        })
    }

    /// Times are told by this clock, in milliseconds.
    #[must_use]
    pub fn with_clock(mut self, clock: fn() -> f64) -> Self {
        self.clock = clock;
        self
    }

    /// Parameters, with what was taken from the volume.
    pub fn params(&self) -> &TrackingParams {
        &self.params
    }

    /// The standard deviation of the noise, in intensity.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// The surface in the newest frame, in the world.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The surfaces of the frames so far, in the world.
    pub fn meshes(&self) -> &[TriangleMesh] {
        &self.meshes
    }

    /// What happened in the frames so far.
    pub fn facts(&self) -> &[FrameFacts] {
        &self.facts
    }

    /// The volumes that the surfaces of the frames so far enclose, in cubed world units.
    pub fn volumes(&self) -> Vec<f64> {
        self.meshes.iter().map(|mesh| measure(mesh).volume).collect()
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

    /// Whether all frames are done.
    pub fn is_done(&self) -> bool {
        self.meshes.len() == self.frames()
    }

    /// Finds the boundary in one more frame; then follows the surface into one more frame.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] where there is no boundary at all, or no surface; [`MethodError::TooManyVertices`].
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        let began = (self.clock)();
        let mut times = Times::default();
        let mut changes = Changes::default();
        if self.faces.len() < self.frames() {
            let frame = self.faces.len();
            let faces = self.voting.faces(&self.region, frame);
            self.faces.push(faces);
            times.add("boundary", (self.clock)() - began);
        } else if !self.is_done() {
            changes = self.next_frame()?;
            times.add("surface", (self.clock)() - began);
        }
        self.steps += 1;
        Ok(self.report(changes, times))
    }

    fn frames(&self) -> usize {
        self.region.frames.len()
    }

    /// The surface in the next frame; where it fails, nothing has changed.
    fn next_frame(&mut self) -> Result<Changes, MethodError> {
        let frame = self.meshes.len();
        let mut facts = FrameFacts::default();
        let mut follower = match self.follower.take() {
            Some(follower) => follower,
            None => {
                self.find_first_mesh()?;
                let mean = measure(&self.mesh.to_triangles()).edge_mean;
                let [min, max] =
                    [self.params.edge_min, self.params.edge_max].map(|share| (share * mean) as f32);
                Follower::new(EdgeBounds { min, max })
            }
        };
        // There is one around every frame that was done.
        if let Some(moment) = self.moment.take() {
            follower.predict(&mut self.mesh, &self.region, &moment, &mut facts);
        }
        let moment = self.moment_of(frame);
        let changes = follower.settle(&mut self.mesh, &self.region, frame, &moment, &mut facts);
        (self.follower, self.moment) = (Some(follower), Some(moment));
        self.meshes.push(self.mesh.to_triangles());
        self.facts.push(facts);
        Ok(changes)
    }

    /// What is around a frame.
    fn moment_of(&self, frame: usize) -> Moment {
        let (count, falloff) = (self.frames() as i64, self.falloff());
        let mut field = Field::new(&self.region, falloff);
        // No frame twice.
        let may_wrap = self.params.cyclic && (falloff.offsets().count() as i64) < count;
        for offset in falloff.offsets() {
            let at = frame as i64 + offset;
            if may_wrap || (0..count).contains(&at) {
                field.add(&self.faces[at.rem_euclid(count) as usize], offset);
            }
        }
        let pixel = self.region.spacing.min_element();
        let (damping, time_scale) = (self.params.damping, self.params.time_scale);
        Moment { field, time_scale, damping, still: STILL * pixel, longest: LONGEST * pixel }
    }

    fn falloff(&self) -> Falloff {
        Falloff { radius: self.params.radius, time_scale: self.params.time_scale }
    }

    /// The mesh to begin with, in the world, where none was given.
    fn find_first_mesh(&mut self) -> Result<(), MethodError> {
        if self.mesh.vertex_count() > 0 {
            return Ok(());
        }
        if self.faces.iter().flatten().all(Vec::is_empty) {
            let largest = self.voting.largest_refused * self.region.step;
            let problem = format!(
                "{} given, no boundary found: the largest step in the box is {largest:.4}; less than that is needed",
                self.params.threshold
            );
            return Err(MethodError::invalid("threshold", problem));
        }
        let levels = self.voting.levels(&self.region, 0);
        let surface = bright_surface(&self.region, &self.faces[0], &levels, self.falloff())?;
        if surface.triangles.is_empty() {
            let problem = "no surface is in the first frame; choose a larger box, or a lower threshold";
            return Err(MethodError::invalid("box", problem));
        }
        let mut mesh = Mesh::from_triangles(&surface)?;
        self.keep_component(&mut mesh);
        let edge = (EDGE * self.region.spacing.min_element()) as f32;
        remesh(&mut mesh, EdgeBounds { min: edge / EDGE_SPREAD, max: edge * EDGE_SPREAD })?;
        self.mesh = mesh;
        Ok(())
    }

    /// Removes all components but the one that is followed.
    fn keep_component(&self, mesh: &mut Mesh) {
        let mut left: Vec<VertexId> = mesh.vertices().collect();
        let mut parts: Vec<(VertexId, f64)> = Vec::new();
        while let Some(&first) = left.first() {
            let members = mesh.component_of(first, usize::MAX);
            let score = match self.component {
                Component::Largest => -(members.len() as f64),
                Component::Nearest(p) => {
                    let away = |v: &VertexId| mesh.position(*v).as_dvec3().distance(p);
                    members.iter().map(away).fold(f64::INFINITY, f64::min)
                }
            };
            parts.push((first, score));
            let mut is_member = vec![false; mesh.slots()];
            members.iter().for_each(|v| is_member[v.index()] = true);
            left.retain(|v| !is_member[v.index()]);
        }
        let best = parts.iter().map(|part| part.1).fold(f64::INFINITY, f64::min);
        let kept = parts.iter().position(|part| part.1 == best);
        for (k, (v, _)) in parts.iter().enumerate() {
            if Some(k) != kept {
                mesh.remove_component(*v);
            }
        }
    }

    fn report(&self, events: Changes, times: Times) -> StepReport {
        let frames = self.frames();
        let (found, done) = (self.faces.len(), self.meshes.len());
        let phase = if found < frames {
            format!("boundary, frame {} of {frames}", found)
        } else {
            format!("surface, frame {done} of {frames}")
        };
        let measured = measure(&self.mesh.to_triangles());
        StepReport {
            iteration: self.steps,
            done: self.is_done(),
            phase,
            progress: (found + done) as f64 / (2 * frames) as f64,
            residual: self.facts.last().map_or(f64::NAN, |facts| facts.correction),
            tolerance: STILL * self.region.spacing.min_element(),
            vertices: self.mesh.vertex_count() as u32,
            triangles: self.mesh.triangle_count() as u32,
            components: measured.components as u32,
            euler: measured.euler as i32,
            events,
            times,
        }
    }
}

/// A mesh of the caller's, as it is.
fn start_mesh(start: &TriangleMesh) -> Result<Mesh, MethodError> {
    if start.triangles.is_empty() {
        return Err(MethodError::invalid("start", "the mesh is empty; a closed surface is needed"));
    }
    let mesh = Mesh::from_triangles(start)?;
    if measure(start).volume <= 0.0 {
        let problem = "the triangles face inwards; counter-clockwise seen from outside is needed";
        return Err(MethodError::invalid("start", problem));
    }
    match count_crossings(start) {
        0 => Ok(mesh),
        pairs => Err(MeshError::SelfIntersecting { pairs }.into()),
    }
}

/// Sums run over so many voxels along an axis at the most.
fn check_radius(params: &TrackingParams, spacing: [f64; 3]) -> Result<(), MethodError> {
    let least = spacing.into_iter().fold(f64::INFINITY, f64::min);
    let most = least * (samples::MOST / 2 - 1) as f64;
    if params.radius >= least && params.radius <= most {
        return Ok(());
    }
    let problem = format!(
        "{} given, {least} to {most} (1 to {} voxels) accepted",
        params.radius,
        samples::MOST / 2 - 1
    );
    Err(MethodError::invalid("radius", problem))
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
