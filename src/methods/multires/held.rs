//! A surface that holds itself: it is unchanged except where ellipsoids move it as handles.
//!
//! Other than the membrane of the paper, which only the ellipsoids support, it needs no base over which the whole surface
//! is a graph. Each point keeps its place on the given surface (the map T), from which its position follows: what the
//! handles do, they can undo.

use super::correspondence::{BasePoint, Correspondence, UNSET, to_base_point};
use super::crossings::Crossings;
use super::detail::{Band, Detailed};
use super::ellipsoid::Ellipsoid;
use super::frame::Lap;
use super::grip::gripped;
use super::handles::{Handle, Motion, motion_at};
use super::motion::MovingEllipsoids;
use super::setup::identity;
use super::topology::displacements_to;
use super::{ControlEllipsoid, MAX_VERTICES, MultiresolutionModel, typical_edge};
use crate::math::order::{combined_rank, rank_f32, sort_by_rank};
use crate::math::{Bounds, Vec3, triangle};
use crate::mesh::{EditError, Mesh, MeshError, TriangleMesh, VertexId, geodesic_distances_from};
use crate::methods::Times;
use crate::pauses::Pauses;
use crate::remesh::{Changes, Embedding};
use crate::spatial::SurfaceWalker;
use crate::warning::{Warning, WarningCode};
use serde::{Deserialize, Serialize};

/// Largest distance along the surface at which the effect of a handle ends, as a share of the diagonal of the bounding box.
const REACH: f64 = 0.35;
/// Largest shares of the area of the surface that move with a handle as if they were rigid, and that it has an effect on.
const AREAS: [f64; 2] = [0.1, 0.45];
/// Distance from a handle's nearest part of the surface up to which the surface moves with it as if it were rigid, as a
/// share of its shortest semi-axis.
const RIGID: f64 = 0.4;

/// Factor by which an edge is stretched before it is halved.
const STRETCH: f32 = 1.5;

/// Share of the vertices, and their number, up to which some may be held back in a frame, so that the surface does not
/// intersect itself. With more, it is folding up, and the handles stop.
const MOST_BLOCKED: f64 = 0.002;
const LEAST_BLOCKED: usize = 20;

/// Length of a step of the smallest handles, as a share of their largest reach: nothing has to follow them from outside.
const STEP: f64 = 0.15;

/// Largest number of times that the step of the handles is halved where the surface cannot follow, before they stop: within a
/// hundredth of the largest step of where they have to. With few, a far target stopped them where a near one did not.
const MOST_HALVINGS: u32 = 6;

/// Distance of a vertex from where the handles move it, in typical edges, above which it is held back, and not only rounded.
const MISSED: f32 = 1e-3;

/// Largest distance of the middle of an edge from the given surface by rounding, as a share of the edge.
const ON_SURFACE: f64 = 1e-5;

/// Number of vertices added to the given surface after which no more edges are halved: needles take many.
const MOST_ADDED: usize = 15_000;

/// Maximum number of passes in which edges of the given surface are halved: each halves the longest.
const PASSES: usize = 40;

/// Number of edges that are halved between two pauses: around a vertex of thousands of edges, each takes a millisecond.
const EDGES_AT_ONCE: usize = 64;

/// A surface with the point of the given one for each vertex.
#[derive(Clone, Debug, Default)]
pub(super) struct Placed {
    pub mesh: Mesh,
    /// The map T: the point of the given surface for each vertex, by slot.
    pub points: Correspondence,
    /// The distance of each vertex from each handle along the given surface, by slot, handle by handle.
    pub distances: Vec<f32>,
}

/// The handles of a surface: their poses, and the surface without their effect.
#[derive(Clone, Debug)]
pub(super) struct Held {
    pub handles: Vec<Handle>,
    /// The largest reach of a handle, in units of the mesh.
    reach: f64,
    /// An edge length that most edges are shorter than.
    edge: f32,
    /// The surface as given.
    given: Mesh,
    /// That surface with its long edges halved; every other one has its vertices first.
    start: Placed,
    /// The distances of the present surface from the handles, as [`Placed::distances`].
    pub distances: Vec<f32>,
    /// Whether the surface may not be where the handles move it: edges were halved in the last frame, or something else
    /// has changed.
    pub is_unsettled: bool,
    /// Whether handles stopped before the targets that were set last.
    has_stopped: bool,
    /// Number of times that the next step of the handles is halved: one attempt a frame, so that none takes long.
    halvings: u32,
    crossings: Crossings,
}

/// The state before a frame that is under way.
#[derive(Debug)]
pub(super) struct Before {
    surface: Mesh,
    correspondence: Correspondence,
    handles: SavedHandles,
    ellipsoids: MovingEllipsoids,
    iteration: u32,
    residual: f64,
}

/// Handles as they are saved.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct SavedHandles {
    handles: Vec<Handle>,
    distances: Vec<f32>,
    is_unsettled: bool,
    has_stopped: bool,
    halvings: u32,
}

impl Held {
    /// Prepares a closed surface and its handles; edges longer than `longest` are halved before anything moves. Pauses
    /// meanwhile.
    ///
    /// # Errors
    /// [`MeshError`] for a surface that is not closed.
    pub async fn in_slices(
        surface: &Band,
        ellipsoids: &[ControlEllipsoid],
        longest: f64,
        pauses: &Pauses,
    ) -> Result<Self, MeshError> {
        let walker = &surface.walker;
        let given = Mesh::from_triangles(walker.mesh())?;
        let bounds = Bounds::from_points(&walker.mesh().positions);
        let mut start = Placed { mesh: given.clone(), points: identity(walker), distances: Vec::new() };
        let most = given.vertex_count() + MOST_ADDED;
        for _ in 0..PASSES {
            pauses.now().await;
            let length = |u, v| f64::from(start.mesh.position(u).distance(start.mesh.position(v)));
            let before = start.mesh.vertex_count();
            for some in long_edges(&start.mesh, |u, v| length(u, v) > longest).chunks(EDGES_AT_ONCE) {
                pauses.now().await;
                halve_edges(&mut start, walker, some, Mesh::split);
            }
            let count = start.mesh.vertex_count();
            if count == before || count >= most {
                break;
            }
        }
        let reach = REACH * f64::from(bounds.min.distance(bounds.max));
        let mut now = start.clone();
        pauses.now().await;
        let crossings = Crossings::of(walker.mesh(), pauses).await;
        let mut held = Self {
            handles: Vec::new(),
            reach,
            edge: typical_edge(&start.mesh),
            given,
            start,
            distances: Vec::new(),
            is_unsettled: false,
            has_stopped: false,
            halvings: 0,
            crossings,
        };
        let whole = SurfaceWalker::new(now.mesh.to_triangles())?;
        whole.build_tree(pauses).await;
        for ellipsoid in ellipsoids {
            pauses.now().await;
            held.add(Ellipsoid::new(ellipsoid), &mut now, &whole);
        }
        held.distances = now.distances;
        Ok(held)
    }

    /// Returns the surface that the handles leave as it is, with its long edges halved.
    pub fn start(&self) -> &Placed {
        &self.start
    }

    /// Returns what is to be known about the surface.
    pub fn warnings(&self) -> Vec<Warning> {
        let stopped = self.has_stopped.then(|| {
            let what = "An ellipsoid stopped before its target: the surface around it would have folded up. It moved as far as it \
                        goes this way: undo the move, or use a smaller one, or one further from others.";
            Warning::new(WarningCode::HandleStopped, what)
        });
        self.crossings.warning().into_iter().chain(stopped).collect()
    }

    pub fn is_at_rest(&self) -> bool {
        self.handles.iter().all(Handle::is_at_rest)
    }

    /// Moves the handles on to poses near the present ones.
    pub fn move_to(&mut self, poses: &[Ellipsoid]) {
        self.handles.iter_mut().zip(poses).for_each(|(handle, &pose)| handle.move_to(pose));
    }

    /// Adds a handle with a pose in which it leaves the surface `now` unchanged, of which `walker` has the vertices in the same
    /// order; distances from it are added to `now`.
    pub fn add(&mut self, pose: Ellipsoid, now: &mut Placed, walker: &SurfaceWalker) {
        let gripped = gripped(&pose, walker);
        let ids: Vec<VertexId> = now.mesh.vertices().collect();
        let at_grip = gripped.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let motion = at_grip.and_then(|&(v, _)| self.motion_of(&now.distances, ids[v as usize]));
        let rest = motion.map_or(pose, |motion| pose_before(&pose, &motion));
        let (reach, found) = self.effect_of(&rest, distances_from(&gripped, now), now);
        let mut handle = Handle::at_rest(rest, reach);
        handle.move_to(pose);
        let before = self.handles.len();
        self.handles.push(handle);
        now.distances = with_column(&now.distances, before, &found);
        self.start.distances = with_column(&self.start.distances, before, &found[..self.start.mesh.slots()]);
    }

    /// Removes the handles from a number on; also their distances in `now`.
    pub fn keep(&mut self, count: usize, now: &mut Placed) {
        let before = self.handles.len();
        for distances in [&mut now.distances, &mut self.start.distances] {
            let kept = distances.chunks_exact(before.max(1)).flat_map(|of| &of[..count.min(of.len())]);
            *distances = kept.copied().collect();
        }
        self.handles.truncate(count);
    }

    /// Returns where the handles move a vertex, given its place on the surface and the distances of all from the handles.
    fn target(&self, points: &Correspondence, distances: &[f32], v: VertexId) -> Vec3 {
        let p = points[v.index()].point;
        self.motion_of(distances, v).map_or(p, |motion| motion.of(p.as_dvec3()).as_vec3())
    }

    fn motion_of(&self, distances: &[f32], v: VertexId) -> Option<Motion> {
        let count = self.handles.len();
        motion_at(&self.handles, &distances[v.index() * count..][..count])
    }

    /// Returns the number of vertices of a surface with the given places that are not where the handles move them: they would
    /// have intersected others.
    pub fn held_vertices(&self, surface: &Mesh, points: &Correspondence) -> usize {
        let is_held = |&v: &VertexId| {
            surface.position(v).distance(self.target(points, &self.distances, v)) > MISSED * self.edge
        };
        surface.vertices().filter(is_held).count()
    }

    /// Returns the reach of a handle, and the distance of each vertex from it, by slot: along the given surface, but at
    /// least as large, relative to the reach, as in a straight line. The rigid part around the handle has none.
    fn effect_of(&self, rest: &Ellipsoid, along: Vec<f32>, now: &Placed) -> (f64, Vec<f32>) {
        let straight: Vec<f32> =
            now.points.iter().map(|at| rest.ray_distance(at.point.as_dvec3()) as f32).collect();
        let least = along.iter().copied().fold(f32::INFINITY, f32::min);
        let [[along_from, along_to], [from, to]] =
            [&along, &straight].map(|of| self.ends_of(of, f64::from(least) + RIGID * rest.shortest_axis()));
        let share = |d: f32, from: f64, to: f64| ((f64::from(d) - from) / (to - from)).max(0.0);
        let reach = along_to - along_from;
        let distance =
            |(&a, &s): (&f32, &f32)| (share(a, along_from, along_to).max(share(s, from, to)) * reach) as f32;
        (reach, along.iter().zip(&straight).map(distance).collect())
    }

    /// Returns the distances at which the rigid part around a handle ends, at most `rigid`, and at which its effect does,
    /// from those of the vertices, of which those of the start are first.
    fn ends_of(&self, distances: &[f32], rigid: f64) -> [f64; 2] {
        let mesh = &self.start.mesh;
        let farthest = |corners: [VertexId; 3]| {
            corners.iter().map(|v| distances[v.index()]).fold(0.0, |far, d| if d > far { d } else { far })
        };
        let mut parts: Vec<(f32, f64)> = mesh
            .triangles()
            .map(|corners| (farthest(corners), triangle::area(mesh.facet(corners).points)))
            .collect();
        sort_by_rank(&mut parts, |&(far, _)| rank_f32(far).into());
        let all: f64 = parts.iter().map(|(_, area)| area).sum();
        let [rigid_area, area] = AREAS.map(|share| {
            let mut within = 0.0;
            let end = parts.iter().find(|(_, area)| {
                within += area;
                within >= share * all
            });
            end.map_or(f64::INFINITY, |&(far, _)| f64::from(far))
        });
        let from = rigid.min(rigid_area);
        [from, area.min(from + self.reach).max(from + 1e-6 * self.reach)]
    }

    /// Has the surface follow the handles, as [`Self::advance`] does, or back to what it is without them.
    async fn follow(
        &mut self,
        now: &mut Placed,
        surface: &SurfaceWalker,
        guard: &mut Embedding,
        longest: f32,
        returns: bool,
        pauses: &Pauses,
    ) -> Option<(usize, f64)> {
        if !self.is_at_rest() {
            let most = (MOST_BLOCKED * now.mesh.vertex_count() as f64) as usize;
            let most = if returns { usize::MAX } else { most.max(LEAST_BLOCKED) };
            return self.advance(now, surface, guard, longest, most, pauses).await;
        }
        let mesh = replacement(self.start.mesh.clone(), &now.mesh);
        *now = Placed { mesh, ..self.start.clone() };
        self.is_unsettled = false;
        Some((0, 0.0))
    }

    /// Moves the surface to where the handles move it, as far as it does not intersect itself, and halves edges longer than
    /// `longest` where they have stretched it. Returns the number of halved edges, and the root mean square of the
    /// displacements, in units of the mesh; `None`, with nothing moved, if more than `most` vertices cannot follow. Pauses
    /// meanwhile.
    async fn advance(
        &mut self,
        now: &mut Placed,
        surface: &SurfaceWalker,
        guard: &mut Embedding,
        longest: f32,
        most: usize,
        pauses: &Pauses,
    ) -> Option<(usize, f64)> {
        let targets: Vec<Vec3> = (0..now.mesh.slots())
            .map(|i| self.target(&now.points, &now.distances, VertexId::from_index(i)))
            .collect();
        let mut displacements = displacements_to(&now.mesh, &targets);
        guard.sync_with_edge(&now.mesh, self.edge);
        self.crossings.exempt_from(guard, &now.points);
        let moving: Vec<VertexId> =
            now.mesh.vertices().filter(|v| displacements[v.index()] != Vec3::ZERO).collect();
        guard.move_some_unless(&mut now.mesh, &moving, &mut displacements, most, pauses).await?;
        let is_stretched = |u: VertexId, v: VertexId| {
            let [p, q] = [u, v].map(|end| now.points[end.index()].point);
            let length = targets[u.index()].distance(targets[v.index()]);
            length > longest && length > STRETCH * p.distance(q)
        };
        let stretched = long_edges(&now.mesh, is_stretched);
        let mut split = 0;
        for edge in stretched {
            let tested = guard.tested_around();
            split += halve_edges(now, surface, &[edge], |mesh, u, v, at| {
                guard.attempt(mesh, |mesh| mesh.split(u, v, at))
            });
            pauses.after(1 + guard.units_around_since(tested)).await;
        }
        // The new vertices are moved in the next frame.
        self.is_unsettled = split > 0;
        let sum: f64 = displacements.iter().map(|d| f64::from(d.length_squared())).sum();
        Some((split, (sum / now.mesh.vertex_count().max(1) as f64).sqrt()))
    }

    /// After a step that the surface could not follow, has the next be half as long, or if it is short already, stops the
    /// handles.
    fn halve_or_stop(&mut self, ellipsoids: &mut MovingEllipsoids) {
        let have_arrived = ellipsoids.have_arrived();
        if !have_arrived && self.halvings < MOST_HALVINGS {
            self.halvings += 1;
            return;
        }
        self.is_unsettled = false;
        self.has_stopped |= !have_arrived;
        ellipsoids.stop();
    }

    fn set_back(&mut self, before: SavedHandles) {
        let SavedHandles { handles, distances, is_unsettled, has_stopped, halvings } = before;
        (self.handles, self.distances) = (handles, distances);
        (self.is_unsettled, self.has_stopped, self.halvings) = (is_unsettled, has_stopped, halvings);
    }

    /// Returns what is to be saved.
    pub fn save(&self) -> SavedHandles {
        SavedHandles {
            handles: self.handles.clone(),
            distances: self.distances.clone(),
            is_unsettled: self.is_unsettled,
            has_stopped: self.has_stopped,
            halvings: self.halvings,
        }
    }

    /// Returns a copy with saved handles, and their distances from a surface with `slots`; `None` if they do not fit.
    pub fn restored(&self, saved: SavedHandles, slots: usize) -> Option<Self> {
        let SavedHandles { handles, distances, is_unsettled, has_stopped, halvings } = saved;
        let (count, before) = (handles.len(), self.start.mesh.slots());
        let is_valid = count > 0
            && handles.iter().all(Handle::is_valid)
            && slots >= before
            && halvings <= MOST_HALVINGS
            && distances.len() == slots * count
            && distances.iter().all(|&d| d >= 0.0);
        is_valid.then(|| {
            let start = Placed { distances: distances[..before * count].to_vec(), ..self.start.clone() };
            Self { handles, start, distances, is_unsettled, has_stopped, halvings, ..self.clone() }
        })
    }
}

impl MultiresolutionModel {
    /// Advances a surface that holds itself by one frame; returns the edits made. Where the future is dropped in the middle,
    /// the model must not be used before it is [set back](Self::discard_step).
    pub(super) async fn held_frame(&mut self, times: &mut Times, pauses: &Pauses) -> Changes {
        let mut lap = Lap::new(self.clock, times);
        let longest = self.model_params.edge_max as f32;
        let mut now = self.take_placed();
        let Some(held) = &mut self.held else {
            self.put_placed(now);
            return Changes::default();
        };
        let before = (self.ellipsoids.clone(), held.handles.clone());
        self.ellipsoids.advance_by(libm::pow(0.5, f64::from(held.halvings)), STEP * held.reach);
        held.move_to(&self.ellipsoids.now());
        // Back to where they came from, nothing stops them.
        let closer =
            held.handles.iter().zip(&before.1).map(|(now, before)| before.deviation() - now.deviation());
        let returns = closer.clone().all(|by| by >= 0.0) && closer.clone().any(|by| by > 0.0);
        lap.end("motion");
        let walker = &self.bands.base().walker;
        let done = held.follow(&mut now, walker, &mut self.guard, longest, returns, pauses).await;
        lap.end("surface");
        let (splits, moved) = done.unwrap_or_default();
        if done.is_some() {
            held.halvings = held.halvings.saturating_sub(1);
        } else {
            (self.ellipsoids, held.handles) = before;
            held.halve_or_stop(&mut self.ellipsoids);
        }
        self.residual = moved / self.model_params.target();
        self.put_placed(now);
        self.show_held();
        lap.end("detail");
        Changes { creations: splits as u32, ..Changes::default() }
    }

    /// Keeps a copy of what a frame of a surface that holds itself changes.
    pub(super) fn keep_state_before(&mut self) {
        self.before = self.held.as_ref().map(|held| {
            Box::new(Before {
                surface: self.surface.clone(),
                correspondence: self.correspondence.clone(),
                handles: held.save(),
                ellipsoids: self.ellipsoids.clone(),
                iteration: self.iteration,
                residual: self.residual,
            })
        });
    }

    /// Sets the model back to the end of the last step, after the future of [`Self::step_in_slices`] was dropped in the middle.
    pub fn discard_step(&mut self) {
        let (Some(before), Some(held)) = (self.before.take(), &mut self.held) else { return };
        let Before { surface, correspondence, handles, ellipsoids, iteration, residual } = *before;
        held.set_back(handles);
        (self.surface, self.correspondence, self.ellipsoids) = (surface, correspondence, ellipsoids);
        (self.iteration, self.residual) = (iteration, residual);
        self.guard = Embedding::default();
    }

    /// Shows the surface as given if all handles have their poses at rest, else as they have moved it.
    pub(super) fn show_held(&mut self) {
        let Some(held) = &self.held else { return };
        let (mesh, points) = if held.is_at_rest() {
            (held.given.clone(), identity(&self.bands.base().walker))
        } else {
            (self.surface.clone(), self.correspondence.clone())
        };
        let mesh = replacement(mesh, &self.detailed.mesh);
        self.detailed =
            Detailed { mesh, points, unmatched_vertices: 0, held_vertices: self.detailed.held_vertices };
    }

    /// Sets the target ellipsoids of a surface that holds itself: those that are new leave it unchanged, and it returns
    /// where one is removed.
    ///
    /// # Errors
    /// [`MeshError`] if memory does not suffice; nothing has changed then.
    pub(super) fn set_handles(&mut self, given: &[ControlEllipsoid]) -> Result<(), MeshError> {
        if self.held.as_ref().is_some_and(|held| held.handles.len() != given.len()) {
            self.change_handles(given)?;
        }
        if let Some(held) = &mut self.held {
            (held.is_unsettled, held.has_stopped) = (true, false);
        }
        self.ellipsoids.set_poses(given);
        Ok(())
    }

    /// Adds or removes handles, so that there is one for each of `given`. On an error nothing changes.
    fn change_handles(&mut self, given: &[ControlEllipsoid]) -> Result<(), MeshError> {
        let Some(mut held) = self.held.clone() else { return Ok(()) };
        let mut now = Placed {
            mesh: self.surface.clone(),
            points: self.correspondence.clone(),
            distances: std::mem::take(&mut held.distances),
        };
        held.keep(given.len(), &mut now);
        let added = &given[held.handles.len()..];
        if !added.is_empty() {
            let walker = SurfaceWalker::new(now.mesh.to_triangles())?;
            added.iter().for_each(|added| held.add(Ellipsoid::new(added), &mut now, &walker));
        }
        self.held = Some(held);
        self.put_placed(now);
        Ok(())
    }

    fn take_placed(&mut self) -> Placed {
        Placed {
            mesh: std::mem::take(&mut self.surface),
            points: std::mem::take(&mut self.correspondence),
            distances: self.held.as_mut().map(|held| std::mem::take(&mut held.distances)).unwrap_or_default(),
        }
    }

    fn put_placed(&mut self, now: Placed) {
        (self.surface, self.correspondence) = (now.mesh, now.points);
        if let Some(held) = &mut self.held {
            held.distances = now.distances;
        }
    }
}

/// Returns a mesh that takes the place of another, with versions beyond those of that one.
fn replacement(mut mesh: Mesh, replaced: &Mesh) -> Mesh {
    mesh.advance_versions_past(replaced);
    mesh
}

/// Returns the pose in which a handle had no effect before a motion, if it has none now.
fn pose_before(now: &Ellipsoid, motion: &Motion) -> Ellipsoid {
    let rotation = motion.turn.transpose() * now.rotation;
    super::ellipsoid::Shape { center: motion.inverse_of(now.center), rotation, lengths: now.lengths }.into()
}

/// Returns the distance of each vertex from an ellipsoid along the given surface, by slot; `gripped` are the vertices around
/// it.
fn distances_from(gripped: &[(u32, f64)], now: &Placed) -> Vec<f32> {
    let mesh = now.mesh.to_triangles();
    let positions = now.mesh.vertices().map(|v| now.points[v.index()].point).collect();
    let on_given = TriangleMesh { positions, ..mesh };
    let found = geodesic_distances_from(&on_given, gripped);
    let mut distances = vec![f32::INFINITY; now.mesh.slots()];
    now.mesh.vertices().zip(found).for_each(|(v, distance)| distances[v.index()] = distance as f32);
    distances
}

/// Returns rows of `count` numbers with one more each.
fn with_column(rows: &[f32], count: usize, column: &[f32]) -> Vec<f32> {
    let row = |(i, &one): (usize, &f32)| {
        rows[i * count..][..count].iter().copied().chain(std::iter::once(one)).collect::<Vec<_>>()
    };
    column.iter().enumerate().flat_map(row).collect()
}

/// Returns the middle of an edge between two points of a surface, on the same component: others may touch it there.
fn middle_of(ends: [BasePoint; 2], surface: &SurfaceWalker) -> BasePoint {
    let [p, q] = ends.map(|end| end.point);
    let middle = (p + q) * 0.5;
    let [one, other] = ends.map(|end| surface.walk(end.triangle, middle));
    let mut found = if other.distance < one.distance { other } else { one };
    // A walk may end elsewhere, at a point that is nearer than all around it.
    if found.distance > ON_SURFACE * f64::from(p.distance(q))
        && let Some(closest) = surface.closest(middle)
    {
        found = closest;
    }
    to_base_point(surface, &found)
}

/// Returns the edges that are long, longest first.
fn long_edges(mesh: &Mesh, is_long: impl Fn(VertexId, VertexId) -> bool) -> Vec<(VertexId, VertexId)> {
    let square = |(u, v): (VertexId, VertexId)| mesh.position(u).distance_squared(mesh.position(v));
    let long = mesh.edges().filter(|&(u, v)| is_long(u, v));
    let mut long: Vec<_> = long.map(|edge| (square(edge), edge)).collect();
    sort_by_rank(&mut long, |&(_, (u, v))| combined_rank(u.0, v.0));
    sort_by_rank(&mut long, |&(square, _)| (!rank_f32(square)).into());
    long.into_iter().map(|(_, edge)| edge).collect()
}

/// Halves edges in turn by `split`, which may refuse; returns their number. New vertices are in the middle of the edges, and
/// on the given surface in the middle of the places of their ends: an edge is always on one of its triangles.
fn halve_edges(
    now: &mut Placed,
    surface: &SurfaceWalker,
    edges: &[(VertexId, VertexId)],
    mut split: impl FnMut(&mut Mesh, VertexId, VertexId, Vec3) -> Result<VertexId, EditError>,
) -> usize {
    let before = now.mesh.vertex_count();
    for &(u, v) in edges {
        if now.mesh.vertex_count() >= MAX_VERTICES {
            break;
        }
        let middle = (now.mesh.position(u) + now.mesh.position(v)) * 0.5;
        let Ok(w) = split(&mut now.mesh, u, v, middle) else { continue };
        let ends = [u, v].map(|end| now.points[end.index()]);
        now.points.resize(now.mesh.slots(), UNSET);
        now.points[w.index()] = middle_of(ends, surface);
        let count = now.distances.len() / (now.mesh.slots() - 1).max(1);
        let mean =
            |k: usize| 0.5 * (now.distances[u.index() * count + k] + now.distances[v.index() * count + k]);
        let mean: Vec<f32> = (0..count).map(mean).collect();
        now.distances.extend(mean);
    }
    now.mesh.vertex_count() - before
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::methods::multires::{MultiresOptions, Support};
    use crate::pauses::{advance, finished};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a model of a sphere whose first handle moves.
    fn moving() -> MultiresolutionModel {
        let ball = Mesh::icosphere(Vec3::ZERO, 1.0, 0.2).unwrap().to_triangles();
        let handle = |x: f64| ControlEllipsoid {
            center: [x, 0.0, 0.0],
            axes: [[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.3]],
        };
        let options = MultiresOptions {
            detail: Some(ball),
            ellipsoids: vec![handle(0.5), handle(-0.5)],
            support: Support::Surface,
            ..MultiresOptions::default()
        };
        let mut model = MultiresolutionModel::new(options).unwrap();
        model.set_ellipsoids(&[handle(1.6), handle(-0.5)]).unwrap();
        model
    }

    #[test]
    fn frames_in_slices_have_the_same_bits_and_leave_nothing_if_given_up() {
        let (mut whole, mut sliced) = (moving(), moving());
        let (mut most, mut given_up, mut frames) = (0, 0, 0);
        loop {
            for slices in [1, 2, 5] {
                let mut step = Box::pin(sliced.step_in_slices());
                let ended = (0..slices).any(|_| advance(&mut step).is_ready());
                drop(step);
                if ended {
                    break;
                }
                given_up += 1;
                sliced.discard_step();
                assert_eq!(
                    (sliced.save(), sliced.mesh().versions()),
                    (whole.save(), whole.mesh().versions())
                );
            }
            // Where a frame has ended before it could be given up, the other makes it, too.
            if sliced.iteration > whole.iteration {
                whole.step().unwrap();
            }
            let mut slices = 0;
            let mut step = Box::pin(sliced.step_in_slices());
            while advance(&mut step).is_pending() {
                slices += 1;
            }
            drop(step);
            most = slices.max(most);
            let report = whole.step().unwrap();
            assert_eq!(sliced.save(), whole.save());
            frames += 1;
            if report.done || frames == 40 {
                break;
            }
        }
        assert!(most > 3 && given_up > 10, "{most} {given_up}");
    }

    /// On some of these, the walk from a triangle to the middle of an edge ends elsewhere.
    #[test]
    fn edges_are_halved_on_the_surface() {
        for seed in 0..20 {
            let random = &mut Random::new(seed);
            let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.7).unwrap().to_triangles();
            mesh.positions.iter_mut().for_each(|p| *p *= 0.2 + 3.0 * random.unit() as f32);
            mesh.normals = None;
            let band = Band::of(mesh).unwrap();
            let held = finished(Held::in_slices(&band, &[], 0.1, &Pauses::default())).unwrap();
            let Placed { mesh, points, .. } = held.start();
            assert!(mesh.vertex_count() > 1000, "seed {seed}");
            let off = |v: VertexId| mesh.position(v).distance(points[v.index()].point);
            let furthest = mesh.vertices().map(off).fold(0.0, f32::max);
            assert!(furthest < 1e-4, "seed {seed}: {furthest}");
        }
    }
}
