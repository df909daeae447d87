//! Multiresolution deformation with dynamic connectivity.
//!
//! Kobbelt, Bareuther & Seidel, *Multiresolution shape deformations for meshes with dynamic vertex connectivity*. A detailed
//! surface is split into a smooth base and the distance to it along the base's normals (`base`, `detail`; section 2). The base
//! is a skin over control ellipsoids (`ellipsoid`, `motion`) that is solved for from coarse to fine and remeshes itself
//! (`membrane`; sections 4 and 5). A map leads from the deformed base back to the undeformed one (`link`; section 3), where
//! the detail is looked up and put back (section 6). Without detail it is a lava lamp.
//!
//! # What it guarantees
//! After every step the base and the detailed surface are closed, oriented and 2-manifold, and no two triangles of either
//! cross. The same input gives the same bits, natively and in wasm.
//!
//! # What it does not
//! Detail is put back along normals: where it is longer than the base is round it is held back before it crosses itself.

mod base;
mod detail;
mod distortion;
mod ellipsoid;
mod frame;
mod holding;
mod link;
mod membrane;
mod motion;
mod params;
mod parting;
mod prisms;
mod setup;
mod state;
mod texture;

pub use distortion::Distortion;
pub use ellipsoid::ControlEllipsoid;
pub use params::{Energy, MultiresParams, Topology, param_specs};

use super::{MethodError, StepReport, Times};
use crate::math::triangle;
use crate::mesh::{Mesh, TriangleMesh, measure};
use crate::remesh::{Changes, Embedding, restructure};
use detail::{Bands, Detailed, Fineness, detailed};
use ellipsoid::{Ellipsoid, check_ellipsoids, check_sizes};
use holding::held;
use link::{Before, Link, folded, project};
use membrane::{hold, settle_seen};
use motion::Movers;
use parting::ways_to;
use setup::{check_size, on_itself, set_up};

/// How a [`MultiresolutionModel`] is set up.
#[derive(Clone, Debug, Default)]
pub struct MultiresOptions {
    /// The detailed surface; without, a bare skin.
    pub detail: Option<TriangleMesh>,
    /// Its low-frequency approximation; else made from it, or around the ellipsoids.
    pub base: Option<TriangleMesh>,
    /// What the skin is spanned over.
    pub ellipsoids: Vec<ControlEllipsoid>,
    /// Parameters; bounds of edges that are 0 are taken from the base.
    pub params: MultiresParams,
}

/// One more iteration may move the surface by this share of the target edge in the mean square when it is at rest.
const REST: f64 = 0.01;

/// Vertices that a model may have.
const MOST_VERTICES: usize = 200_000;

/// A surface deformed by ellipsoids, with its detail.
pub struct MultiresolutionModel {
    bands: Bands,
    movers: Movers,
    params: MultiresParams,
    /// The deformed base.
    surface: Mesh,
    /// Where its vertices lie on the base, by slot.
    link: Link,
    shown: Detailed,
    /// Keeps surfaces from crossing themselves; nothing in it is kept from one frame to the next but memory.
    guard: Embedding,
    components: u32,
    iteration: u32,
    /// Frames since the skin was last solved for on all levels.
    passing: u32,
    residual: f64,
    clock: fn() -> f64,
}

impl MultiresolutionModel {
    /// A model before its first step: its surface is the base with the detail.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the option or parameter that cannot be used, and what is accepted;
    /// [`MethodError::Mesh`] for a detail or a base that is open, not manifold, or (the base) crosses itself.
    pub fn new(options: MultiresOptions) -> Result<Self, MethodError> {
        let MultiresOptions { detail, base, ellipsoids: given, params } = options;
        check_ellipsoids(&given)?;
        let movers = Movers::new(&given);
        let ellipsoids = movers.now();
        let (bands, params) = set_up(detail, base, &ellipsoids, params)?;
        let bands = Bands::new(bands);
        let surface = Mesh::from_triangles(bands.base().walker.mesh())?;
        Self::started(bands, movers, params, surface)
    }

    fn started(
        bands: Bands,
        movers: Movers,
        params: MultiresParams,
        base: Mesh,
    ) -> Result<Self, MethodError> {
        let mut surface = base;
        check_size(area(&surface), &params)?;
        let mut guard = Embedding::default();
        guard.follow_with(&surface, usual_edge(&surface));
        restructure(&mut surface, params.bounds(), &mut guard);
        let places = hold(&surface, &movers.now());
        let mut ways = ways_to(&surface, &places);
        guard.carry(&mut surface, &mut ways);
        let walker = &bands.base().walker;
        let itself = on_itself(walker);
        let before = Before { walker, link: &itself };
        let link = project(&surface, &before, walker, f64::MAX);
        let shown = detailed(&surface, &link, &bands, &mut guard, fineness(&params));
        let mut model = Self {
            components: 0,
            bands,
            movers,
            params,
            surface,
            link,
            shown,
            guard,
            iteration: 0,
            passing: 0,
            residual: f64::NAN,
            clock: || 0.0,
        };
        model.components = measure(&model.surface.to_triangles()).components as u32;
        Ok(model)
    }

    /// Gives the model a clock for [`StepReport::times`], in milliseconds. The core has none of its own.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.clock = clock;
    }

    /// The surface with its detail.
    pub fn mesh(&self) -> &Mesh {
        &self.shown.mesh
    }

    /// The surface with its detail as triangles, with texture coordinates where the finest surface has them.
    pub fn surface(&self) -> TriangleMesh {
        let mut mesh = self.shown.mesh.to_triangles();
        let finest = &self.bands.finest().walker;
        mesh.corner_uvs = texture::corner_uvs(&self.shown.mesh, &self.shown.places, finest);
        mesh.texture = finest.mesh().texture.clone();
        mesh
    }

    /// The meshes that the skin is solved on for the ellipsoids as they are, from coarse to fine (figure 8).
    pub fn levels(&self) -> Vec<TriangleMesh> {
        let mut levels = Vec::new();
        let ellipsoids = self.movers.now();
        let mut mesh = self.surface.clone();
        settle_seen(&mut mesh, &ellipsoids, &self.params, self.params.levels, |mesh| {
            levels.push(mesh.to_triangles());
        });
        levels
    }

    /// How much the map from the deformed base to the base distorts.
    pub fn distortion(&self) -> Distortion {
        distortion::distortion(&self.surface, &self.link)
    }

    /// The deformed base.
    pub fn base_mesh(&self) -> &Mesh {
        &self.surface
    }

    /// The vertices of [`Self::base_mesh`] where they lie on the undeformed base.
    pub fn link_mesh(&self) -> TriangleMesh {
        let mut mesh = self.surface.to_triangles();
        mesh.positions = self.surface.vertices().map(|v| self.link[v.index()].point).collect();
        mesh.normals = None;
        mesh
    }

    /// Parameters as they are now.
    pub fn params(&self) -> &MultiresParams {
        &self.params
    }

    /// Takes other parameters.
    ///
    /// # Errors
    /// As [`MultiresParams::validate`]; nothing has changed then.
    pub fn set_params(&mut self, params: MultiresParams) -> Result<(), MethodError> {
        params.validate()?;
        check_sizes(&self.movers.goals(), params.edge_max)?;
        check_size(area(&self.surface), &params)?;
        let before = std::mem::replace(&mut self.params, params);
        if self.params != before {
            self.take_effect(&before);
        }
        Ok(())
    }

    /// How finely the detail is put back shows at once; all else wakes the skin.
    fn take_effect(&mut self, before: &MultiresParams) {
        let supersample = self.params.supersample;
        if self.params == (MultiresParams { supersample, ..before.clone() }) {
            self.show();
        } else {
            self.residual = f64::NAN;
        }
    }

    /// Sends the ellipsoids to new places, each by its index. Further ones grow where they are to be, or come out of the
    /// nearest one if that is outside of the skin; those left out shrink and vanish.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for none, and for one that is not an ellipsoid; nothing has changed then.
    pub fn set_ellipsoids(&mut self, given: &[ControlEllipsoid]) -> Result<(), MethodError> {
        check_ellipsoids(given)?;
        check_sizes(&given.iter().map(Ellipsoid::new).collect::<Vec<_>>(), self.params.edge_max)?;
        let surface = &self.surface;
        self.movers.send(given, |goal| held(surface, std::slice::from_ref(goal))[0]);
        self.residual = f64::NAN;
        Ok(())
    }

    /// The ellipsoids where they are now.
    pub fn ellipsoids(&self) -> Vec<ControlEllipsoid> {
        self.movers.now().iter().map(Ellipsoid::given).collect()
    }

    /// Where they are to be.
    pub fn goals(&self) -> Vec<ControlEllipsoid> {
        self.movers.goals().iter().map(Ellipsoid::given).collect()
    }

    /// Triangles of the surface whose image on the base is turned over.
    pub fn folded(&self) -> usize {
        let base = self.bands.base();
        folded(&self.surface, &base.walker, &base.normals, &self.link)
    }

    /// Surfaces of the decomposition, the base among them.
    pub fn bands(&self) -> usize {
        self.bands.all.len()
    }

    /// Vertices whose normal met no detail, and those held back so that nothing crosses.
    pub fn misses(&self) -> [usize; 2] {
        [self.shown.missed, self.shown.held]
    }

    /// One frame: the ellipsoids go on by as much as the skin can follow, and the skin with its detail follows.
    pub fn step(&mut self) -> Result<StepReport, MethodError> {
        let mut times = Times::default();
        let mut changes = Changes::default();
        if !self.is_done() {
            self.iteration = self.iteration.wrapping_add(1);
            changes = self.frame(&mut times)?;
        }
        Ok(self.report(changes, times))
    }

    fn is_done(&self) -> bool {
        let at_rest = self.residual <= REST && self.passing == 0 && self.params == self.params_now();
        // A skin that holds nothing shrinks until nothing is left of it.
        self.surface.vertex_count() == 0 || self.movers.have_arrived() && at_rest
    }

    /// Puts the detail back.
    fn show(&mut self) {
        let shown = detailed(&self.surface, &self.link, &self.bands, &mut self.guard, fineness(&self.params));
        let replaced = std::mem::replace(&mut self.shown, shown);
        self.shown.mesh.count_on_from(&replaced.mesh);
    }

    fn report(&self, events: Changes, times: Times) -> StepReport {
        let mesh = &self.shown.mesh;
        StepReport {
            iteration: self.iteration,
            done: self.is_done(),
            phase: "frame".into(),
            progress: f64::NAN,
            residual: self.residual,
            tolerance: REST,
            vertices: mesh.vertex_count() as u32,
            triangles: mesh.triangle_count() as u32,
            components: self.components,
            euler: mesh.euler() as i32,
            events,
            times,
        }
    }
}

fn fineness(params: &MultiresParams) -> Fineness {
    Fineness { longest: params.edge_max as f32, rounds: params.supersample }
}

fn mean_edge(mesh: &Mesh) -> f64 {
    let length = |(u, v)| f64::from(mesh.position(u).distance(mesh.position(v)));
    mesh.edges().map(length).sum::<f64>() / mesh.edge_count().max(1) as f64
}

/// An edge that is longer than most, for the guard.
fn usual_edge(mesh: &Mesh) -> f32 {
    (1.5 * mean_edge(mesh)) as f32
}

fn area(mesh: &Mesh) -> f64 {
    mesh.triangles().map(|corners| triangle::area(mesh.facet(corners).points)).sum()
}
