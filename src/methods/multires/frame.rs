//! One frame of the multiresolution model: moves the ellipsoids, updates the membrane and its map T to the base, and
//! reconstructs the detail.

use super::containment::contains_centres;
use super::correspondence::{BasePoint, Current, distribute, project, unfold};
use super::ellipsoid::{Ellipsoid, move_with};
use super::membrane::{pushed_positions, refresh, residual, solve};
use super::setup::check_size;
use super::topology::{cut_threads, displacements_to, move_guarded};
use super::{MAX_VERTICES, MultiresParams, MultiresolutionModel, TOLERANCE, area, mean_edge, typical_edge};
use crate::mesh::{Mesh, VertexId, measure};
use crate::methods::{MethodError, Times};
use crate::remesh::{Changes, EdgeBounds, Resolver};
use crate::spatial::SurfaceWalker;

/// Largest factor by which the mean edge of the deformed base changes in one frame: a mesh much finer or coarser than
/// its edge bounds can neither be guarded against self-intersections nor solved in bounded time.
const MAX_CHANGE: f64 = 2.0;

/// Largest residual, as a share of the target edge, at which a membrane may be refreshed, on the finest level only,
/// while ellipsoids move: three times as fast as a solve on all levels.
const REFRESH_TOLERANCE: f64 = 3.0 * TOLERANCE;

/// Depth, as a share of the target edge, up to which vertices may be inside an ellipsoid by rounding; a rigid motion
/// stays below. After a frame with a deeper vertex, the membrane is solved once the ellipsoids stop.
const ROUNDING: f64 = 1e-3;

/// Maximum number of frames in a row that only refresh the membrane, on the finest level, so that wide saddles between
/// ellipsoids do not lag far behind.
const MAX_REFRESHED_FRAMES: u32 = 3;

impl MultiresolutionModel {
    /// Returns the parameters for the next frame: edge bounds scaled so that one frame can reach them, to a target edge
    /// within a factor of 2 of the current mean edge of the deformed base.
    pub(super) fn params_now(&self) -> MultiresParams {
        let ratio = self.model_params.target() / mean_edge(&self.surface);
        let factor = if ratio > MAX_CHANGE {
            MAX_CHANGE / ratio
        } else if ratio * MAX_CHANGE < 1.0 {
            1.0 / (ratio * MAX_CHANGE)
        } else {
            1.0
        };
        let (edge_min, edge_max) = (factor * self.model_params.edge_min, factor * self.model_params.edge_max);
        MultiresParams { edge_min, edge_max, ..self.model_params.clone() }
    }

    /// Returns whether no further frame would remesh the membrane towards the edge bounds. Wide bounds may be met by
    /// edges far from the target edge.
    pub(super) fn has_edges_as_wanted(&self) -> bool {
        let now = self.params_now();
        now == self.model_params || edges_within_bounds(&self.surface, now.bounds())
    }

    /// Advances the model by one frame, adds the duration of each part to `times`, and returns the edits made. If it
    /// fails, nothing has changed.
    pub(super) fn frame(&mut self, times: &mut Times) -> Result<Changes, MethodError> {
        let mut lap = Lap::new(self.clock, times);
        let mut moving = self.ellipsoids.clone();
        moving.advance();
        let prediction = self.predict(moving.now())?;
        lap.end("motion");
        let changes = match self.predict_only(&prediction) {
            Some(next) => {
                self.surface = next;
                lap.end("membrane");
                Changes::default()
            }
            None => self.solve(&prediction, &mut lap)?,
        };
        moving.drop_vanished();
        self.frames_at_rest = if prediction.moves() { 0 } else { self.frames_at_rest.saturating_add(1) };
        self.ellipsoids = moving;
        self.residual = self.residual_of(&self.surface, &self.ellipsoids.now());
        lap.end("residual");
        self.reconstruct_detail();
        lap.end("detail");
        Ok(changes)
    }

    fn residual_of(&self, mesh: &Mesh, ellipsoids: &[Ellipsoid]) -> f64 {
        residual(mesh, ellipsoids, self.model_params.energy) / self.model_params.target()
    }

    /// Predicts the membrane for the next positions of the ellipsoids, `ellipsoids_after`, at the start of a frame.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`] if the predicted membrane is too large for its edge bounds.
    fn predict(&self, ellipsoids_after: Vec<Ellipsoid>) -> Result<Prediction, MethodError> {
        let before = self.ellipsoids.now();
        let mut predicted = self.surface.clone();
        if before != ellipsoids_after {
            predicted.positions_mut().iter_mut().for_each(|p| *p = move_with(&before, &ellipsoids_after, *p));
        }
        let params = self.params_now();
        check_size(area(&predicted), &params)?;
        let residual = self.residual_of(&predicted, &ellipsoids_after);
        Ok(Prediction { ellipsoids_before: before, ellipsoids_after, predicted, residual, params })
    }

    /// Returns the membrane moved along with the ellipsoids, if the frame needs no more than that: its residual is
    /// small, nearly all edges are within bounds, no vertex is deep inside an ellipsoid, no displacement is shortened
    /// to avoid self-intersections, and no solve is due because the ellipsoids have stopped. This makes rigid motions
    /// exact. `None` if the membrane has to be solved.
    fn predict_only(&mut self, prediction: &Prediction) -> Option<Mesh> {
        // A membrane that was only refreshed is solved when the ellipsoids stop, even if its residual is small.
        let is_due = !prediction.moves() && self.refreshed_frames > 0;
        if is_due
            || prediction.residual > TOLERANCE
            || !edges_within_bounds(&prediction.predicted, prediction.params.bounds())
        {
            return None;
        }
        let positions = pushed_positions(&prediction.predicted, &prediction.ellipsoids_after);
        let depth = |v: VertexId| prediction.predicted.position(v).distance(positions[v.index()]);
        let deepest = f64::from(prediction.predicted.vertices().map(depth).fold(0.0, f32::max))
            / self.model_params.target();
        if deepest > TOLERANCE {
            return None;
        }
        let mut next = self.surface.clone();
        let mut displacements = displacements_to(&next, prediction.predicted.positions());
        self.guard.sync_with_edge(&next, typical_edge(&next));
        if !self.guard.move_all(&mut next, &mut displacements).is_empty() {
            return None;
        }
        if deepest > ROUNDING {
            self.refreshed_frames = self.refreshed_frames.max(1);
        }
        Some(next)
    }

    /// Computes a new membrane over the ellipsoids, and its map T, in a frame for which [`Self::predict_only`] returns
    /// `None`. Returns the edits made.
    fn solve(&mut self, prediction: &Prediction, lap: &mut Lap) -> Result<Changes, MethodError> {
        let walker = SurfaceWalker::new(prediction.predicted.to_triangles())?;
        let (next, changes) = self.solved(prediction);
        lap.end("membrane");
        let points: Vec<BasePoint> =
            self.surface.vertices().map(|v| self.correspondence[v.index()]).collect();
        let before = Current { walker: &walker, correspondence: &points };
        let base = self.bands.base();
        let mut correspondence = project(&next, &before, &base.walker, f64::MAX);
        lap.end("project");
        for _ in 0..self.model_params.distribute {
            distribute(&next, &base.walker, &mut correspondence);
        }
        unfold(&next, &base.walker, &base.normals, &mut correspondence);
        lap.end("distribute");
        (self.surface, self.correspondence) = (next, correspondence);
        Ok(changes)
    }

    /// Returns the membrane for the next positions of the ellipsoids, and the edits made: refreshed on the finest level
    /// if that is sufficient, else solved on all levels. If the result intersects itself or slips off an ellipsoid, the
    /// current membrane is moved instead, with displacements shortened to avoid self-intersections.
    fn solved(&mut self, prediction: &Prediction) -> (Mesh, Changes) {
        let (next, changes) = self
            .refresh(prediction)
            .or_else(|| self.solve_levels(prediction))
            .unwrap_or_else(|| self.move_guarded(prediction));
        if changes.changed_topology() {
            self.components = measure(&next.to_triangles()).components as u32;
        }
        (next, changes)
    }

    /// Returns the predicted membrane refreshed on the finest level only, and the edits made. `None` unless the
    /// ellipsoids move, the parameters have coarse levels, the residual is at most [`REFRESH_TOLERANCE`] and
    /// [`Self::with_threads_cut`] accepts the result, and after [`MAX_REFRESHED_FRAMES`] such frames in a row.
    fn refresh(&mut self, prediction: &Prediction) -> Option<(Mesh, Changes)> {
        let may_refresh =
            prediction.moves() && prediction.params.levels > 0 && prediction.residual <= REFRESH_TOLERANCE;
        if !may_refresh || self.refreshed_frames >= MAX_REFRESHED_FRAMES {
            return None;
        }
        let mut next = prediction.predicted.clone();
        let changes = refresh(&mut next, &prediction.ellipsoids_after, &prediction.params);
        let refreshed = self.with_threads_cut(next, changes, prediction)?;
        self.refreshed_frames += 1;
        Some(refreshed)
    }

    fn solve_levels(&mut self, prediction: &Prediction) -> Option<(Mesh, Changes)> {
        self.refreshed_frames = 0;
        let mut next = prediction.predicted.clone();
        let changes =
            solve(&mut next, &prediction.ellipsoids_after, &prediction.params, prediction.params.levels);
        self.with_threads_cut(next, changes, prediction)
    }

    fn move_guarded(&self, prediction: &Prediction) -> (Mesh, Changes) {
        let mut next = self.surface.clone();
        let resolver = &mut Resolver::with_max_vertices(MAX_VERTICES);
        let changes = move_guarded(
            &mut next,
            prediction.predicted.positions(),
            &prediction.ellipsoids_after,
            &prediction.params,
            resolver,
        );
        (next, changes)
    }

    /// Cuts thin necks of a new membrane that was made without collision tests, if the parameters allow it; returns the
    /// membrane and all edits. `None` if the membrane intersects itself, or does not contain the centre of an ellipsoid
    /// that the current membrane contains.
    fn with_threads_cut(
        &mut self,
        mut mesh: Mesh,
        mut changes: Changes,
        prediction: &Prediction,
    ) -> Option<(Mesh, Changes)> {
        let loses = |(before, now): (bool, bool)| before && !now;
        if contains_centres(&self.surface, &prediction.ellipsoids_before)
            .into_iter()
            .zip(contains_centres(&mesh, &prediction.ellipsoids_after))
            .any(loses)
        {
            return None;
        }
        self.guard.sync_with_edge(&mesh, typical_edge(&mesh));
        if !self.guard.is_embedded(&mesh) {
            return None;
        }
        changes += cut_threads(&mut mesh, &prediction.params, MAX_VERTICES);
        Some((mesh, changes))
    }
}

/// The predicted membrane that a frame starts from, with the ellipsoids and parameters of the frame.
struct Prediction {
    ellipsoids_before: Vec<Ellipsoid>,
    ellipsoids_after: Vec<Ellipsoid>,
    /// The current membrane moved along with the ellipsoids, by [`move_with`].
    predicted: Mesh,
    /// The residual of `predicted`, as a share of the target edge.
    residual: f64,
    /// The parameters of the model, with edge bounds that one frame can reach.
    params: MultiresParams,
}

impl Prediction {
    fn moves(&self) -> bool {
        self.ellipsoids_before != self.ellipsoids_after
    }
}

/// Measures the time of each part of a frame, for [`StepReport::times`](crate::methods::StepReport::times).
pub(super) struct Lap<'a> {
    clock: fn() -> f64,
    start: f64,
    times: &'a mut Times,
}

impl<'a> Lap<'a> {
    pub fn new(clock: fn() -> f64, times: &'a mut Times) -> Self {
        Self { clock, start: clock(), times }
    }

    /// Adds the time since the last call, or since the lap was created, to the time of `part`, in milliseconds.
    pub fn end(&mut self, part: &'static str) {
        let now = (self.clock)();
        self.times.add(part, now - self.start);
        self.start = now;
    }
}

/// Returns whether a share of at most [`MAX_OUT_OF_BOUNDS`] of the edges is shorter or longer than `bounds`, so that
/// the mesh needs no remeshing.
fn edges_within_bounds(mesh: &Mesh, bounds: EdgeBounds) -> bool {
    let (shortest, longest) = (bounds.min * bounds.min, bounds.max * bounds.max);
    let outside = mesh.edges().filter(|&(u, v)| {
        let square = mesh.position(u).distance_squared(mesh.position(v));
        square < shortest || square > longest
    });
    outside.count() as f64 <= MAX_OUT_OF_BOUNDS * mesh.edge_count() as f64
}

/// Largest share of edges out of bounds with which the membrane is kept without remeshing. Restructuring itself leaves
/// some thousandths.
const MAX_OUT_OF_BOUNDS: f64 = 0.02;
