//! Saving an implicit surface at any step, and restoring it so that it continues bit for bit.
//!
//! The saved state stores what is expensive to compute, the solution, and what cannot be recomputed, the last surface.
//! The rest is recomputed from the same points, up to the same slice of work. The linear system that edits revise is
//! rebuilt at the first edit.

use super::kernel::Kernel;
use super::solve::{Solution, SolverPosition};
use super::{
    ImplicitParams, ImplicitSurface, IsoValue, KernelKind, PointEdits, Sides, Solved, Solving, Stage,
    Unedited,
};
use crate::math::{DVec3, Vec3};
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::methods::params::Auto;
use crate::methods::saved::{Hash, Magic, decode, encode};
use serde::{Deserialize, Serialize};

const MAGIC: Magic = *b"VSCLIMP\x04";
/// States from when edits revised the last system.
const MAGIC_WITH_BASE: Magic = *b"VSCLIMP\x03";
/// States before there were `sides`.
const MAGIC_WITHOUT_SIDES: Magic = *b"VSCLIMP\x02";

/// The stage of the reconstruction that a saved run had reached: a [`Stage`] without its data.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
enum SavedStage {
    Subsample,
    Constrain,
    /// A solve: the position of the solver, and its system.
    Solve(SolverPosition, Solving),
    Extract,
    Color,
    Done,
}

/// A stage of a state from when edits revised the last system: a solve tells whether it did so.
#[derive(Clone, Copy, Deserialize)]
enum StageWithBase {
    Subsample,
    Constrain,
    Solve(SolverPosition, bool),
    Extract,
    Color,
    Done,
}

/// The saved form of an [`ImplicitSurface`], with its parameters and edits, but without its points and other options.
#[derive(Serialize, Deserialize)]
struct State<Params = ImplicitParams, Rest = self::Rest> {
    fingerprint: u64,
    params: Params,
    rest: Rest,
}

/// The rest of a [`State`].
#[derive(Serialize, Deserialize)]
struct Rest {
    edits: PointEdits,
    unedited: SavedUnedited,
    saved_stage: SavedStage,
    slices: u32,
    iteration: u32,
    residual: f64,
    spurious_components: u32,
    unclear: Option<Vec3>,
    solved: Option<Function>,
    surface: Surface,
}

/// The saved form of the solution without edits.
#[derive(Serialize, Deserialize)]
enum SavedUnedited {
    None,
    /// It is the last solution.
    Last,
    Other(Unedited),
}

/// The rest of a [`State`] from when edits revised the last system.
#[derive(Deserialize)]
struct RestWithBase {
    edits: PointEdits,
    #[expect(dead_code, reason = "read for its length")]
    base: Option<PointEdits>,
    saved_stage: StageWithBase,
    slices: u32,
    iteration: u32,
    residual: f64,
    spurious_components: u32,
    solved: Option<Function>,
    surface: Surface,
}

impl From<RestWithBase> for Rest {
    /// The solution without edits is found again for the next edit. A revision that was under way begins from scratch.
    fn from(rest: RestWithBase) -> Self {
        let system = if rest.edits == PointEdits::default() { Solving::Unedited } else { Solving::Edited };
        let saved_stage = match rest.saved_stage {
            StageWithBase::Subsample => SavedStage::Subsample,
            StageWithBase::Constrain => SavedStage::Constrain,
            StageWithBase::Solve(_, true) => SavedStage::Solve(SolverPosition::default(), system),
            StageWithBase::Solve(position, false) => SavedStage::Solve(position, system),
            StageWithBase::Extract => SavedStage::Extract,
            StageWithBase::Color => SavedStage::Color,
            StageWithBase::Done => SavedStage::Done,
        };
        Self {
            edits: rest.edits,
            unedited: SavedUnedited::None,
            saved_stage,
            slices: rest.slices,
            iteration: rest.iteration,
            residual: rest.residual,
            spurious_components: rest.spurious_components,
            unclear: None,
            solved: rest.solved,
            surface: rest.surface,
        }
    }
}

impl From<State<ImplicitParams, RestWithBase>> for State {
    fn from(state: State<ImplicitParams, RestWithBase>) -> Self {
        Self { fingerprint: state.fingerprint, params: state.params, rest: state.rest.into() }
    }
}

/// The parameters of a state from before there were `sides`, in the order of that time.
#[derive(Deserialize)]
struct ParamsWithoutSides(KernelKind, Auto, f64, f64, Auto, Auto, f64, f64, IsoValue);

impl From<State<ParamsWithoutSides, RestWithBase>> for State {
    /// There were constraints on both sides if λ of those outside was `auto`.
    fn from(state: State<ParamsWithoutSides, RestWithBase>) -> Self {
        let ParamsWithoutSides(kernel, delta, tau, sigma, lambda_surface, lambda_exterior, ..) = state.params;
        let ParamsWithoutSides(.., tolerance, cell, level) = state.params;
        let sides = if lambda_exterior == Auto::Auto { Sides::Both } else { Sides::Outside };
        Self {
            params: ImplicitParams {
                kernel,
                delta,
                tau,
                sigma,
                lambda_surface,
                lambda_exterior,
                tolerance,
                cell,
                level,
                sides,
            },
            fingerprint: state.fingerprint,
            rest: state.rest.into(),
        }
    }
}

/// The saved form of the last solution: the implicit function f.
#[derive(Serialize, Deserialize)]
struct Function {
    kernel: Kernel,
    centres: Vec<Vec3>,
    solution: Solution,
    mean: f64,
}

/// The saved form of the last finished surface.
#[derive(Serialize, Deserialize)]
struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    colors: Option<Vec<Vec3>>,
}

impl ImplicitSurface {
    /// Returns the state of the reconstruction as bytes for [`Self::restore`], with its parameters and edits, but
    /// without points and other options.
    pub fn save(&self) -> Vec<u8> {
        let mesh = &self.mesh;
        encode(
            &MAGIC,
            &State {
                fingerprint: self.fingerprint(),
                params: self.params.clone(),
                rest: Rest {
                    edits: self.edits.clone(),
                    unedited: self.saved_unedited(),
                    saved_stage: self.stage.reached(),
                    slices: self.slices,
                    iteration: self.iteration,
                    residual: self.residual,
                    spurious_components: self.spurious_components as u32,
                    unclear: self.unclear,
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
            },
        )
    }

    /// Returns the solution without edits to be saved, unless it is the last one, which is saved anyway.
    fn saved_unedited(&self) -> SavedUnedited {
        let is_last = self.edits == PointEdits::default() && !matches!(self.stage, Stage::Solve(..));
        match &self.unedited {
            // After an error the run may begin again; its constraints are not known in a restored one.
            _ if matches!(self.stage, Stage::Subsample(_) | Stage::Constrain(_)) => SavedUnedited::None,
            Some(_) if is_last => SavedUnedited::Last,
            Some(unedited) => SavedUnedited::Other(unedited.clone()),
            None => SavedUnedited::None,
        }
    }

    /// Restores a run from the bytes of [`Self::save`]; `self` must be made from the same points and options, except
    /// parameters. Takes as long as the run had spent on choosing constraints and on its current stage; if it was
    /// colouring, on the extraction, too; if it was revising a system, on that system's matrix, too.
    ///
    /// # Errors
    /// [`MethodError::BadState`] if the bytes are not such a state; the run is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let state = if bytes.starts_with(&MAGIC_WITHOUT_SIDES) {
            decode::<State<ParamsWithoutSides, RestWithBase>>(&MAGIC_WITHOUT_SIDES, bytes)?.into()
        } else if bytes.starts_with(&MAGIC_WITH_BASE) {
            decode::<State<ImplicitParams, RestWithBase>>(&MAGIC_WITH_BASE, bytes)?.into()
        } else {
            decode::<State>(&MAGIC, bytes)?
        };
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
        let rest = state.rest;
        let Surface { positions, triangles, normals, colors } = rest.surface;
        let origin = self.origin;
        let mesh = TriangleMesh { positions, origin, triangles, normals, colors, ..TriangleMesh::default() };
        mesh.validate()?;
        if rest.saved_stage.needs_solution() && rest.solved.is_none() {
            return bad("solution", "missing");
        }
        rest.edits.validate(&self.original, &self.map)?;
        let mut next = self.restarted();
        (next.params, next.edits) = (state.params, rest.edits);
        let last = rest.solved.as_ref().map(|function| &function.solution);
        next.unedited = match (rest.unedited, last) {
            (SavedUnedited::Other(unedited), _) => Some(unedited),
            (SavedUnedited::Last, Some(solution)) => {
                Some(Unedited { solution: solution.clone(), residual: rest.residual })
            }
            _ => None,
        };
        if let Some(Function { kernel, centres, solution, mean }) = rest.solved {
            if solution.weights.len() != centres.len() || solution.coefficients.len() != kernel.polynomials()
            {
                return bad("solution", "inconsistent");
            }
            next.solved = Some(Solved::new(kernel, centres, solution, mean));
        }
        next.replay(rest.saved_stage, rest.slices)?;
        if !next.fits_unedited() {
            return bad("unedited", "inconsistent");
        }
        next.unclear = rest.unclear;
        next.spurious_components = rest.spurious_components as usize;
        next.iteration = rest.iteration;
        next.residual = rest.residual;
        next.version = self.version;
        next.take_mesh(mesh);
        *self = next;
        Ok(())
    }

    /// Returns whether the solution without edits, if there is one, has the numbers of weights and coefficients of its system.
    fn fits_unedited(&self) -> bool {
        let Some(Unedited { solution, .. }) = &self.unedited else { return true };
        self.unedited_constraints().is_some_and(|constraints| {
            let numbers = (constraints.centres.len(), self.kernel(&constraints).polynomials());
            numbers == (solution.weights.len(), solution.coefficients.len())
        })
    }

    /// Returns a hash of the input points and of all options but the parameters; [`Self::restore`] rejects a state with
    /// another hash.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        if self.origin != DVec3::ZERO {
            self.origin.to_array().iter().for_each(|x| hash.mix(x.to_bits()));
        }
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
        self.options.cameras.iter().for_each(|camera| camera.hash_into(&mut hash));
        hash.value()
    }

    fn restarted(&self) -> Self {
        let (original, cloud) = (self.original.clone(), self.cloud.clone());
        Self {
            clock: self.clock,
            far_outliers: self.far_outliers.clone(),
            ..Self::from_parts(original, cloud, self.map, self.options.clone())
        }
    }

    /// Recomputes what a saved state does not store: everything up to the stage `saved_stage`, and that stage up to the
    /// slice of work at which the run was saved: its position in a solve, the first `slices` in other stages.
    fn replay(&mut self, saved_stage: SavedStage, slices: u32) -> Result<(), MethodError> {
        while saved_stage != SavedStage::Subsample && matches!(self.stage, Stage::Subsample(_)) {
            self.advance()?;
        }
        if !matches!(saved_stage, SavedStage::Subsample | SavedStage::Constrain) {
            let mut search = self.make_constraints(None)?;
            while search.is_some() {
                search = self.make_constraints(search)?;
            }
        }
        self.stage = match saved_stage {
            SavedStage::Solve(position, system) => {
                let solver = match system {
                    Solving::Unedited => self.unedited_constraints().map(|all| self.new_solver(&all)),
                    Solving::Revised => self.revised_solver(None),
                    Solving::Edited => Some(self.new_solver(&self.constraints)),
                };
                let Some(mut solver) = solver else {
                    let problem = "does not belong to its solution".into();
                    return Err(MethodError::BadState { field: "stage", problem });
                };
                solver.advance_to(position).map_err(|_| self.singular())?;
                Stage::Solve(solver, system)
            }
            SavedStage::Extract | SavedStage::Color => self.begin_extraction()?,
            SavedStage::Done => Stage::Done,
            SavedStage::Subsample | SavedStage::Constrain => return self.replay_slices(saved_stage, slices),
        };
        while saved_stage == SavedStage::Color && matches!(self.stage, Stage::Extract(_)) {
            self.advance()?;
        }
        self.replay_slices(saved_stage, slices)
    }

    fn replay_slices(&mut self, saved_stage: SavedStage, slices: u32) -> Result<(), MethodError> {
        self.slices = 0;
        if matches!(saved_stage, SavedStage::Solve(..) | SavedStage::Done) {
            return Ok(());
        }
        while self.slices < slices {
            self.advance()?;
            if self.stage.reached() != saved_stage {
                let problem = format!("{slices} given; the stage has fewer");
                return Err(MethodError::BadState { field: "slices", problem });
            }
        }
        Ok(())
    }
}

impl SavedStage {
    fn needs_solution(self) -> bool {
        matches!(self, Self::Extract | Self::Color | Self::Done)
    }
}

impl Stage {
    fn reached(&self) -> SavedStage {
        match self {
            Self::Subsample(_) => SavedStage::Subsample,
            Self::Constrain(_) => SavedStage::Constrain,
            Self::Solve(solver, system) => SavedStage::Solve(solver.position(), *system),
            Self::Extract(_) => SavedStage::Extract,
            Self::Color(_) => SavedStage::Color,
            Self::Done => SavedStage::Done,
        }
    }
}
