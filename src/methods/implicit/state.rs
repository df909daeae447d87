//! Saving a run and going on with it, bit for bit.
//!
//! A state holds what took long, the solution, and what cannot be made again, the last surface. The rest is done again from the
//! same points, as many slices of it as had been done.

use super::kernel::Kernel;
use super::solve::Solution;
use super::{ImplicitParams, ImplicitSurface, Solved, Stage};
use crate::math::Vec3;
use crate::mesh::TriangleMesh;
use crate::methods::MethodError;
use crate::methods::saved::{Hash, Mark, opened, sealed};
use serde::{Deserialize, Serialize};

const MARK: Mark = *b"VSCLIMP\x01";

/// How far a run is.
#[derive(Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
enum Reached {
    Subsample,
    Constrain,
    Solve,
    Extract,
    Color,
    Done,
}

/// Everything a run has beside its points.
#[derive(Serialize, Deserialize)]
struct State {
    fingerprint: u64,
    params: ImplicitParams,
    reached: Reached,
    slices: u32,
    iteration: u32,
    residual: f64,
    strays: u32,
    solved: Option<(Kernel, Solution)>,
    surface: Surface,
}

/// A closed surface as a mesh has it.
#[derive(Serialize, Deserialize)]
struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    colors: Option<Vec<Vec3>>,
}

impl ImplicitSurface {
    /// The run as bytes, without its points.
    pub fn save(&self) -> Vec<u8> {
        let mesh = &self.mesh;
        sealed(
            &MARK,
            &State {
                fingerprint: self.fingerprint(),
                params: self.params.clone(),
                reached: self.stage.reached(),
                slices: self.slices,
                iteration: self.iteration,
                residual: self.residual,
                strays: self.strays as u32,
                solved: self.solved.as_ref().map(|solved| (solved.kernel, solved.solution.clone())),
                surface: Surface {
                    positions: mesh.positions.clone(),
                    triangles: mesh.triangles.clone(),
                    normals: mesh.normals.clone(),
                    colors: mesh.colors.clone(),
                },
            },
        )
    }

    /// Goes on from bytes that [`Self::save`] gave, for a surface of the same points and options. Takes as long as the
    /// present stage took so far.
    ///
    /// # Errors
    /// [`MethodError::BadState`] where the bytes are none of those; the run is then as it was.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MethodError> {
        let state: State = opened(&MARK, bytes)?;
        let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
        if state.fingerprint != self.fingerprint() {
            return bad("points", "the state belongs to other points or options");
        }
        state.params.validate()?;
        let Surface { positions, triangles, normals, colors } = state.surface;
        let mesh = TriangleMesh { positions, triangles, normals, colors, ..TriangleMesh::default() };
        mesh.validate()?;
        if state.reached >= Reached::Extract && state.solved.is_none() {
            return bad("solution", "it is missing");
        }
        let mut next = self.begun_anew();
        next.params = state.params;
        next.repeat_constraints(state.reached)?;
        if let Some((kernel, solution)) = state.solved {
            if solution.weights.len() != next.constraints.centres.len()
                || solution.coefficients.len() != kernel.polynomials()
            {
                return bad("solution", "it does not fit the constraints");
            }
            next.solved = Some(Solved::new(kernel, &next.constraints, solution));
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

    /// A number that tells points and options apart.
    fn fingerprint(&self) -> u64 {
        let mut hash = Hash::new();
        let mut mix = |points: &[Vec3]| {
            hash.mix(points.len() as u64);
            points.iter().flat_map(|p| p.to_array()).for_each(|x| hash.mix(u64::from(x.to_bits())));
        };
        mix(&self.original);
        mix(self.cloud.normals.as_deref().unwrap_or_default());
        mix(self.options.exterior.as_deref().unwrap_or_default());
        mix(self.cloud.colors.as_deref().unwrap_or_default());
        self.cloud.confidence.iter().flatten().for_each(|c| hash.mix(u64::from(c.to_bits())));
        hash.mix(self.options.max_points as u64);
        hash.mix(self.options.keep_components.map_or(0, |n| n as u64));
        for camera in &self.options.cameras {
            camera.centre().to_array().into_iter().for_each(|x| hash.mix(x.to_bits()));
            camera.size().into_iter().for_each(|n| hash.mix(u64::from(n)));
        }
        hash.value()
    }

    fn begun_anew(&self) -> Self {
        Self {
            original: self.original.clone(),
            cloud: self.cloud.clone(),
            options: self.options.clone(),
            params: self.params.clone(),
            clock: self.clock,
            ..Self::empty(self.map)
        }
    }

    fn repeat_constraints(&mut self, reached: Reached) -> Result<(), MethodError> {
        if reached > Reached::Subsample {
            self.stage = self.subsample()?;
        }
        if reached > Reached::Constrain {
            self.constrain()?;
        }
        Ok(())
    }

    /// Does the slices of a stage again that had been done.
    fn repeat(&mut self, reached: Reached, slices: u32) -> Result<(), MethodError> {
        self.stage = match reached {
            Reached::Subsample => Stage::Subsample,
            Reached::Constrain => Stage::Constrain,
            Reached::Solve => self.begin_solve(),
            Reached::Extract | Reached::Color => self.begin_extraction()?,
            Reached::Done => Stage::Done,
        };
        self.slices = 0;
        while reached == Reached::Color && self.stage.reached() == Reached::Extract {
            self.advance()?;
        }
        while self.slices < slices && self.stage.reached() == reached && reached != Reached::Done {
            self.advance()?;
        }
        Ok(())
    }
}

impl Stage {
    fn reached(&self) -> Reached {
        match self {
            Self::Subsample => Reached::Subsample,
            Self::Constrain => Reached::Constrain,
            Self::Solve(_) => Reached::Solve,
            Self::Extract(_) => Reached::Extract,
            Self::Color(_) => Reached::Color,
            Self::Done => Reached::Done,
        }
    }
}
