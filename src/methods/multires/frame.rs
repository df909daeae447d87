//! One frame of the model: moves the ellipsoids, updates the membrane and its map T, and reconstructs the detail.

use super::ellipsoid::{Ellipsoid, carried};
use super::holding::held;
use super::link::{Before, Linked, distribute, project, unfold};
use super::membrane::{freshen, hold, settle, unrest};
use super::parting::{cut_threads, follow, ways_to};
use super::setup::check_size;
use super::{MOST_VERTICES, MultiresParams, MultiresolutionModel, REST, area, mean_edge, usual_edge};
use crate::mesh::{Mesh, VertexId, measure};
use crate::methods::{MethodError, Times};
use crate::remesh::{Changes, EdgeBounds, Resolver};
use crate::spatial::SurfaceWalker;

/// Largest factor by which the mean edge changes in one frame: a mesh much finer or coarser than its bounds can neither
/// be guarded nor solved in bounded time.
const MOST_CHANGE: f64 = 2.0;

/// While ellipsoids move, a membrane with at most this residual is only refreshed on one level: three times as fast as
/// a solve on all levels.
const NEARLY_AT_REST: f64 = 3.0 * REST;

/// Depth by which rounding may put vertices inside an ellipsoid, as a share of the target edge; a rigid motion stays
/// below.
const ROUNDING: f64 = 1e-3;

/// Maximum number of frames in a row that only refresh the membrane, so that wide saddles do not lag far behind.
const MOST_PASSING: u32 = 3;

impl MultiresolutionModel {
    /// Returns the parameters with edge bounds that one frame can reach: within a factor of 2 of the current mean edge.
    pub(super) fn params_now(&self) -> MultiresParams {
        let ratio = self.params.target() / mean_edge(&self.surface);
        let factor = if ratio > MOST_CHANGE {
            MOST_CHANGE / ratio
        } else if ratio * MOST_CHANGE < 1.0 {
            1.0 / (ratio * MOST_CHANGE)
        } else {
            1.0
        };
        let (edge_min, edge_max) = (factor * self.params.edge_min, factor * self.params.edge_max);
        MultiresParams { edge_min, edge_max, ..self.params.clone() }
    }

    /// Advances the model by one frame. If it fails, nothing has changed.
    pub(super) fn frame(&mut self, times: &mut Times) -> Result<Changes, MethodError> {
        let mut lap = Lap::new(self.clock, times);
        let mut movers = self.movers.clone();
        movers.advance();
        let ahead = self.ahead(movers.now())?;
        lap.ends("motion");
        let changes = match self.followed(&ahead) {
            Some(next) => {
                self.surface = next;
                lap.ends("membrane");
                Changes::default()
            }
            None => self.solve(&ahead, &mut lap)?,
        };
        movers.drop_vanished();
        self.movers = movers;
        self.residual = self.unrest(&self.surface, &self.movers.now());
        lap.ends("rest");
        self.show();
        lap.ends("detail");
        Ok(changes)
    }

    fn unrest(&self, mesh: &Mesh, ellipsoids: &[Ellipsoid]) -> f64 {
        unrest(mesh, ellipsoids, self.params.energy) / self.params.target()
    }

    /// Predicts the membrane for the next positions `are` of the ellipsoids.
    fn ahead(&self, are: Vec<Ellipsoid>) -> Result<Ahead, MethodError> {
        let were = self.movers.now();
        let mut carried_along = self.surface.clone();
        if were != are {
            carried_along.positions_mut().iter_mut().for_each(|p| *p = carried(&were, &are, *p));
        }
        let params = self.params_now();
        check_size(area(&carried_along), &params)?;
        let unrest = self.unrest(&carried_along, &are);
        Ok(Ahead { were, are, carried: carried_along, unrest, params })
    }

    /// Returns the membrane moved along with the ellipsoids, if nothing else has to be done: its residual is small
    /// and its edges are within bounds. This makes rigid motions exact. `None` if the membrane has to be solved.
    fn followed(&mut self, ahead: &Ahead) -> Option<Mesh> {
        // A membrane that was only refreshed is solved when the ellipsoids stop, even if its residual is small.
        let is_due = !ahead.moves() && self.passing > 0;
        if is_due || ahead.unrest > REST || !fits(&ahead.carried, ahead.params.bounds()) {
            return None;
        }
        let places = hold(&ahead.carried, &ahead.are);
        let depth = |v: VertexId| ahead.carried.position(v).distance(places[v.index()]);
        let deepest =
            f64::from(ahead.carried.vertices().map(depth).fold(0.0, f32::max)) / self.params.target();
        if deepest > REST {
            return None;
        }
        let mut next = self.surface.clone();
        let mut ways = ways_to(&next, ahead.carried.positions());
        self.guard.sync_with_edge(&next, usual_edge(&next));
        if !self.guard.move_all(&mut next, &mut ways).is_empty() {
            return None;
        }
        if deepest > ROUNDING {
            self.passing = self.passing.max(1);
        }
        Some(next)
    }

    /// Computes a new membrane over the ellipsoids, and its map T.
    fn solve(&mut self, ahead: &Ahead, lap: &mut Lap) -> Result<Changes, MethodError> {
        let walker = SurfaceWalker::new(ahead.carried.to_triangles())?;
        let (next, changes) = self.solved(ahead);
        lap.ends("membrane");
        let linked: Vec<Linked> = self.surface.vertices().map(|v| self.link[v.index()]).collect();
        let before = Before { walker: &walker, link: &linked };
        let base = self.bands.base();
        let mut link = project(&next, &before, &base.walker, f64::MAX);
        lap.ends("project");
        for _ in 0..self.params.distribute {
            distribute(&next, &base.walker, &mut link);
        }
        unfold(&next, &base.walker, &base.normals, &mut link);
        lap.ends("distribute");
        (self.surface, self.link) = (next, link);
        Ok(changes)
    }

    /// Returns the membrane for the next positions of the ellipsoids: refreshed if that is sufficient, else solved on
    /// all levels, else moved under the collision guard.
    fn solved(&mut self, ahead: &Ahead) -> (Mesh, Changes) {
        let (next, changes) = self
            .freshened(ahead)
            .or_else(|| self.settled(ahead))
            .unwrap_or_else(|| self.followed_with_care(ahead));
        if changes.changed_topology() {
            self.components = measure(&next.to_triangles()).components as u32;
        }
        (next, changes)
    }

    /// Returns the predicted membrane refreshed on one level; `None` unless the ellipsoids move and its residual is
    /// small.
    fn freshened(&mut self, ahead: &Ahead) -> Option<(Mesh, Changes)> {
        let may_pass = ahead.moves() && ahead.params.levels > 0 && ahead.unrest <= NEARLY_AT_REST;
        if !may_pass || self.passing >= MOST_PASSING {
            return None;
        }
        let mut next = ahead.carried.clone();
        let changes = freshen(&mut next, &ahead.are, &ahead.params);
        let passed = self.with_threads_cut(next, changes, ahead)?;
        self.passing += 1;
        Some(passed)
    }

    fn settled(&mut self, ahead: &Ahead) -> Option<(Mesh, Changes)> {
        self.passing = 0;
        let mut next = ahead.carried.clone();
        let changes = settle(&mut next, &ahead.are, &ahead.params, ahead.params.levels);
        self.with_threads_cut(next, changes, ahead)
    }

    fn followed_with_care(&self, ahead: &Ahead) -> (Mesh, Changes) {
        let mut next = self.surface.clone();
        let resolver = &mut Resolver::with_max_vertices(MOST_VERTICES);
        let changes = follow(&mut next, ahead.carried.positions(), &ahead.are, &ahead.params, resolver);
        (next, changes)
    }

    /// Cuts thin necks of a membrane that was made without collision tests. `None` if it intersects itself, or if an
    /// ellipsoid is no longer inside.
    fn with_threads_cut(
        &mut self,
        mut mesh: Mesh,
        mut changes: Changes,
        ahead: &Ahead,
    ) -> Option<(Mesh, Changes)> {
        let loses = |(before, now): (bool, bool)| before && !now;
        if held(&self.surface, &ahead.were).into_iter().zip(held(&mesh, &ahead.are)).any(loses) {
            return None;
        }
        self.guard.sync_with_edge(&mesh, usual_edge(&mesh));
        if !self.guard.is_embedded(&mesh) {
            return None;
        }
        changes += cut_threads(&mut mesh, &ahead.params, MOST_VERTICES);
        Some((mesh, changes))
    }
}

/// The prediction that a frame starts from.
struct Ahead {
    /// The ellipsoids before the frame.
    were: Vec<Ellipsoid>,
    /// The ellipsoids after the frame.
    are: Vec<Ellipsoid>,
    /// The membrane moved along with the ellipsoids.
    carried: Mesh,
    /// Its residual, as a share of the target edge.
    unrest: f64,
    /// The parameters, with edge bounds that one frame can reach.
    params: MultiresParams,
}

impl Ahead {
    fn moves(&self) -> bool {
        self.were != self.are
    }
}

/// Measures the time of each part of a frame, for [`StepReport::times`](crate::methods::StepReport::times).
struct Lap<'a> {
    clock: fn() -> f64,
    begun: f64,
    times: &'a mut Times,
}

impl<'a> Lap<'a> {
    fn new(clock: fn() -> f64, times: &'a mut Times) -> Self {
        Self { clock, begun: clock(), times }
    }

    /// Adds the time since the last call to `part`.
    fn ends(&mut self, part: &'static str) {
        let now = (self.clock)();
        self.times.add(part, now - self.begun);
        self.begun = now;
    }
}

/// Whether at most [`MISFITS`] of the edges are out of bounds.
fn fits(mesh: &Mesh, bounds: EdgeBounds) -> bool {
    let (shortest, longest) = (bounds.min * bounds.min, bounds.max * bounds.max);
    let outside = mesh.edges().filter(|&(u, v)| {
        let square = mesh.position(u).distance_squared(mesh.position(v));
        square < shortest || square > longest
    });
    outside.count() as f64 <= MISFITS * mesh.edge_count() as f64
}

/// Share of edges that may be out of bounds without remeshing. Restructuring leaves some thousandths.
const MISFITS: f64 = 0.02;
