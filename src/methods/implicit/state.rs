//! Saving and restoring a run, bit for bit.
//!
//! A state stores what is expensive to compute, the solution, and what cannot be recomputed, the last surface. The rest
//! is recomputed from the same points, up to the same slice of work. The linear system that edits revise is rebuilt at
//! the first edit.

use super::kernel::Kernel;
use super::solve::{Position, Solution};
use super::{Edits, ImplicitParams, ImplicitSurface, Solved, Stage};
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Magic, decode, encode};
use serde::{Deserialize, Serialize};

const MAGIC: Magic = *b"VSCLIMP\x02";

/// The stage a saved run had reached, without the data of [`Stage`].
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Reached {
    Subsample,
    Constrain,
    /// Position of the solver, and whether it revises the system of the last full solve.
    Solve(Position, bool),
    Extract,
    Color,
    Done,
}

/// The saved form of an [`ImplicitSurface`], without its points and options.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: ImplicitParams,
    edits: Edits,
    base: Option<Edits>,
    reached: Reached,
    slices: u32,
    iteration: u32,
    residual: f64,
    strays: u32,
    solved: Option<Function>,
    surface: Surface,
}

/// The saved form of the last solution: the implicit function f.
#[derive(Serialize, Deserialize)]
struct Function {
    kernel: Kernel,
    centres: Vec<Vec3>,
    solution: Solution,
    mean: f64,
}

/// The saved form of the last extracted mesh.
#[derive(Serialize, Deserialize)]
struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    colors: Option<Vec<Vec3>>,
}

impl ImplicitSurface {
    /// Returns the run as bytes for [`Self::restore`], without points and options.
    pub fn save(&self) -> Vec<u8> {
        let mesh = &self.mesh;
        encode(
            &MAGIC,
            &State {
                fingerprint: self.fingerprint(),
                params: self.params.clone(),
                edits: self.edits.clone(),
                base: self.base.clone(),
                reached: self.stage.reached(),
                slices: self.slices,
                iteration: self.iteration,
                residual: self.residual,
                strays: self.strays as u32,
                solved: self.solved.as_ref().map(|solved| Function {
                    kernel: solved.kernel,
                    centres: solved.centres.clone(),
                    solution: solved.solution.clone(),
                    mean: solved.mean,
                }),
                surface: Surface {
                    positions: mesh.positions.clone(),
                    triangles: mesh.triangles.clone(),
                    normals: mesh.normals.clone(),
                    colors: mesh.colors.clone(),
                },
            },
        )
    }

    /// Continues a run from the bytes of [`Self::save`]; `self` must be made from the same points and options. Takes as
    /// long as the run had spent on choosing constraints and on its current stage; if it was colouring, on the
    /// extraction, too.
    ///
    /// # Errors
    /// [`MethodError::BadState`] if the bytes are not such a state; the run is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let state: State = decode(&MAGIC, bytes)?;
        self.restore_state(state).map_err(|error| match error {
            MethodError::BadState { .. } => error,
            other => MethodError::BadState { field: "contents", problem: other.to_string() },
        })
    }

    fn restore_state(&mut self, state: State) -> Result<(), MethodError> {
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        if state.fingerprint != self.fingerprint() {
            return bad("points", "the state belongs to other points or options");
        }
        state.params.validate()?;
        let Surface { positions, triangles, normals, colors } = state.surface;
        let mesh = TriangleMesh { positions, triangles, normals, colors, ..TriangleMesh::default() };
        mesh.validate()?;
        if state.reached.needs_solution() && state.solved.is_none() {
            return bad("solution", "it is missing");
        }
        for edits in std::iter::once(&state.edits).chain(&state.base) {
            edits.validate(&self.original, &self.map)?;
        }
        let mut next = self.begun_anew();
        (next.params, next.edits, next.base) = (state.params, state.edits, state.base);
        if let Some(Function { kernel, centres, solution, mean }) = state.solved {
            if solution.weights.len() != centres.len() || solution.coefficients.len() != kernel.polynomials()
            {
                return bad("solution", "its parts do not fit each other");
            }
            next.solved = Some(Solved::new(kernel, centres, solution, mean));
        }
        next.repeat(state.reached, state.slices)?;
        next.strays = state.strays as usize;
        next.iteration = state.iteration;
        next.residual = state.residual;
        next.version = self.version;
        next.take_mesh(mesh);
        *self = next;
        Ok(())
    }

    /// Returns a hash of points and options, by which [`Self::restore`] rejects a state of other input.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        let mut mix = |points: &[Vec3]| {
            hash.mix(points.len() as u64);
            points.iter().flat_map(|p| p.to_array()).for_each(|x| hash.mix(u64::from(x.to_bits())));
        };
        mix(&self.original);
        mix(self.cloud.normals.as_deref().unwrap_or_default());
        mix(self.options.exterior.as_deref().unwrap_or(&[Vec3::NAN]));
        mix(self.cloud.colors.as_deref().unwrap_or_default());
        hash.mix(self.cloud.confidence.is_some().into());
        self.cloud.confidence.iter().flatten().for_each(|c| hash.mix(u64::from(c.to_bits())));
        hash.mix(self.options.max_points as u64);
        hash.mix(self.options.keep_components.map_or(0, |n| n as u64));
        self.options.cameras.iter().for_each(|camera| camera.mix_into(&mut hash));
        hash.value()
    }

    fn begun_anew(&self) -> Self {
        let (original, cloud) = (self.original.clone(), self.cloud.clone());
        Self { clock: self.clock, ..Self::begun(original, cloud, self.map, self.options.clone()) }
    }

    /// Recomputes everything up to the stage `reached`, and its first `slices` slices of work.
    fn repeat(&mut self, reached: Reached, slices: u32) -> Result<(), MethodError> {
        while reached != Reached::Subsample && matches!(self.stage, Stage::Subsample(_)) {
            self.advance()?;
        }
        if !matches!(reached, Reached::Subsample | Reached::Constrain) {
            self.make_constraints()?;
        }
        self.stage = match reached {
            Reached::Solve(position, revised) => {
                let mut solver = if revised { self.revised_solver() } else { None }
                    .unwrap_or_else(|| self.new_solver(&self.constraints));
                solver.advance_to(position).map_err(|_| self.singular())?;
                Stage::Solve(solver)
            }
            Reached::Extract | Reached::Color => self.begin_extraction()?,
            Reached::Done => Stage::Done,
            Reached::Subsample | Reached::Constrain => return self.repeat_slices(reached, slices),
        };
        while reached == Reached::Color && matches!(self.stage, Stage::Extract(_)) {
            self.advance()?;
        }
        self.repeat_slices(reached, slices)
    }

    fn repeat_slices(&mut self, reached: Reached, slices: u32) -> Result<(), MethodError> {
        self.slices = 0;
        if matches!(reached, Reached::Solve(..) | Reached::Done) {
            return Ok(());
        }
        while self.slices < slices {
            self.advance()?;
            if self.stage.reached() != reached {
                let problem = format!("{slices} given; the stage is over before");
                return Err(MethodError::BadState { field: "slices", problem });
            }
        }
        Ok(())
    }
}

impl Reached {
    fn needs_solution(self) -> bool {
        matches!(self, Self::Extract | Self::Color | Self::Done | Self::Solve(_, true))
    }
}

impl Stage {
    fn reached(&self) -> Reached {
        match self {
            Self::Subsample(_) => Reached::Subsample,
            Self::Constrain => Reached::Constrain,
            Self::Solve(solver) => Reached::Solve(solver.position(), solver.is_revised()),
            Self::Extract(_) => Reached::Extract,
            Self::Color(_) => Reached::Color,
            Self::Done => Reached::Done,
        }
    }
}
