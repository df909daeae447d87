//! The model on a volume that is larger than memory, of which only the bricks around the surface are loaded.
//!
//! A step asks for the bricks that it may read before it begins ([`MethodError::NeedsData`]). If it reads a missing one
//! after all, it is undone and asks for that. So no missing voxel is ever replaced by a number, and the surface has the
//! same bits in whatever order bricks arrive, as if all were there.
//!
//! Quantities that depend on a whole level of other volumes come from the coarsest level, which is loaded whole (the start,
//! the range), or are sampled at the vertices (the steepness of the image). Parts that the coarsest level does not show
//! are not found: finer levels are not searched.

use super::awake::ITERATIONS_TO_SLEEP;
use super::contour::ObjectIs;
use super::image::{LevelImage, Pyramid, REDUCTION, SparseLevels};
use super::sizes::LARGEST;
use super::{DeformableModel, DeformableParams, Keys, Origin, Progress, Seeding, Start, Topology, coarse};
use crate::math::order::{median, sort_ranks};
use crate::math::{Bounds, DAffine3, DVec3, Vec3};
use crate::mesh::{Connectivity, Mesh, ScalarKey, VertexId};
use crate::methods::saved::Hash;
use crate::methods::{MethodError, StepReport};
use crate::pauses::{Pauses, finished};
use crate::volume::{BrickBox, BrickGrid, BrickId, CellCache, SparseVolume, merged};
use fixedbitset::FixedBitSet;

/// The distance from a vertex, in δ, within which the bricks of a level are loaded before a step: the vertex moves by at
/// most half a δ, and thin walls are searched for up to 2.3 δ away. A step that reads beyond it is undone and repeated,
/// which costs time only.
pub(super) const REACH: f32 = 2.5;

/// The distance beyond [`REACH`], in δ, up to which missing bricks are asked for when one within it is missing, so that
/// asking is rare. With more, more bricks are loaded that the surface never reaches.
const MARGIN: f32 = 0.5;

/// The largest ratio of the loaded bricks of a level to those near the surface; above it the others are dropped.
const MOST_SPARE: usize = 2;

/// Options for creating a [`DeformableModel`] on a sparse volume.
#[derive(Clone, Debug)]
pub struct SparseOptions {
    /// The surface from which the run starts, on the coarsest level.
    pub start: Start,
    /// The level of the volume at which the run ends; its voxel indices are the model's space.
    pub finest: usize,
    /// The mean edge length on level `finest`, as in [`super::DeformableOptions::edge`].
    pub edge: Option<f64>,
    /// The parameters of the model; by default [`DeformableParams::for_range`] of the volume's range.
    pub params: Option<DeformableParams>,
    /// The box in which finer levels are followed; outside of it the surface is that of level
    /// [`Self::whole`]. By default they are followed everywhere.
    pub within: Option<WorldBox>,
    /// The finest level that is followed everywhere if there is a box; by default the coarsest.
    pub whole: Option<usize>,
    /// The largest number of vertices, as in [`super::DeformableOptions::max_vertices`].
    pub max_vertices: Option<usize>,
}

impl Default for SparseOptions {
    fn default() -> Self {
        Self {
            start: Start::Contour,
            finest: 0,
            edge: None,
            params: None,
            within: None,
            whole: None,
            max_vertices: None,
        }
    }
}

/// A box in world space, along its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldBox {
    /// Corner with the smallest coordinates.
    pub min: DVec3,
    /// Corner with the largest coordinates.
    pub max: DVec3,
}

/// The part of the surface that finer levels follow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follow {
    /// The box, in model space.
    bounds: Bounds,
    /// The finest level of the pyramid that is followed everywhere.
    whole: usize,
}

/// The state before a step, to which it is undone if a brick was missing. Meshes take most of the memory, so each part of
/// this one is copied before the phase of the step that changes it, in compact form.
#[derive(Clone, Debug)]
pub(super) struct Before {
    /// The vertices that the motion may change; all of them once there are edits.
    vertices: VertexStates,
    /// The part that only edits change; `None` while vertices are moved.
    edited: Option<BeforeEdits>,
    progress: Progress,
}

/// The part of the state of some vertices that motion changes, in the order of their slots.
#[derive(Clone, Debug, Default)]
struct VertexStates {
    slots: FixedBitSet,
    vectors: [Vec<Vec3>; 2],
    scalars: [Vec<f32>; 3],
}

#[derive(Clone, Debug)]
struct BeforeEdits {
    connectivity: Connectivity,
    checked_positions: Vec<Vec3>,
    sizes: Vec<f32>,
}

impl Before {
    /// Copies what motion may change, of the given vertices.
    pub(super) fn keep(&mut self, mesh: &Mesh, keys: Keys, vertices: &[VertexId]) {
        let mut slots = FixedBitSet::with_capacity(mesh.slots());
        vertices.iter().for_each(|v| slots.insert(v.index()));
        self.vertices = VertexStates::of(mesh, keys, slots);
    }
}

impl VertexStates {
    fn of(mesh: &Mesh, keys: Keys, slots: FixedBitSet) -> Self {
        let vectors = [mesh.positions(), mesh.vector(keys.velocity)].map(|from| gathered(from, &slots));
        let scalars = moved_scalars(keys).map(|key| gathered(mesh.scalar(key), &slots));
        Self { slots, vectors, scalars }
    }

    /// Returns these states, and of all other vertices those that they have now.
    fn completed(self, mesh: &Mesh, keys: Keys) -> Self {
        let mut slots = FixedBitSet::with_capacity(mesh.slots());
        slots.insert_range(..);
        let mut all = Self::of(mesh, keys, slots);
        all.vectors.iter_mut().zip(&self.vectors).for_each(|(to, from)| scatter(from, &self.slots, to));
        all.scalars.iter_mut().zip(&self.scalars).for_each(|(to, from)| scatter(from, &self.slots, to));
        all
    }

    fn put_back(&self, mesh: &mut Mesh, keys: Keys) {
        let [positions, velocities] = &self.vectors;
        scatter(positions, &self.slots, mesh.positions_mut());
        scatter(velocities, &self.slots, mesh.vector_mut(keys.velocity));
        for (key, from) in moved_scalars(keys).into_iter().zip(&self.scalars) {
            scatter(from, &self.slots, mesh.scalar_mut(key));
        }
    }
}

fn moved_scalars(keys: Keys) -> [ScalarKey; 3] {
    [keys.still_iterations, keys.since_edit, keys.reversals]
}

/// Returns the values of some slots, one after the other.
fn gathered<T: Copy>(values: &[T], slots: &FixedBitSet) -> Vec<T> {
    let mut some = Vec::with_capacity(slots.count_ones(..));
    some.extend(slots.ones().map(|slot| values[slot]));
    some
}

/// Sets the values of some slots to those that [`gathered`] has returned.
fn scatter<T: Copy>(some: &[T], slots: &FixedBitSet, values: &mut [T]) {
    slots.ones().zip(some).for_each(|(slot, &value)| values[slot] = value);
}

impl DeformableModel {
    /// Creates the model of a sparse volume on its coarsest level. The model and the volume share bricks: insert those
    /// that a step needs into the volume, and step again. Bricks that no vertex is near are dropped.
    ///
    /// # Errors
    /// [`MethodError::NeedsData`] unless the coarsest level is loaded whole; [`MethodError::InvalidArgument`] for an
    /// option or parameter that is not accepted, also for gradient forces and the parameter `seeding` on, which sparse
    /// volumes do not have; otherwise as [`Self::new`].
    pub fn on_sparse(volume: &SparseVolume, options: SparseOptions) -> Result<Self, MethodError> {
        finished(Self::begin_on_sparse(volume, options)?)
    }

    /// Begins to create a model as [`Self::on_sparse`] does, in [slices](crate::pauses).
    ///
    /// # Errors
    /// As [`Self::on_sparse`], now or at the end.
    pub fn begin_on_sparse(
        volume: &SparseVolume,
        options: SparseOptions,
    ) -> Result<impl Future<Output = Result<Self, MethodError>> + use<>, MethodError> {
        let params = options.params.clone().unwrap_or_else(|| DeformableParams::for_range(volume.range()));
        params.validate()?;
        check_params(&params)?;
        let volume = volume.clone();
        Ok(async move {
            let pauses = Pauses::default();
            pauses.now().await;
            let pyramid = Pyramid::of_sparse(&volume, options.finest, &pauses).await?;
            pauses.now().await;
            let affine = volume.levels()[options.finest].affine;
            let follow = follow(&volume, &options, &pyramid.to_world(&affine))?;
            let SparseOptions { start, edge, max_vertices, .. } = options;
            let origin = Origin { frame: 0, start, edge, params, max_vertices };
            let mut model = Self::from_pyramid(pyramid, affine, origin, &pauses).await?;
            model.follow = follow;
            Ok(model)
        })
    }

    /// Returns an error if the volume is sparse, so that no level but the coarsest can be read whole.
    pub(super) fn check_is_whole(&self) -> Result<(), MethodError> {
        if !self.pyramid.is_sparse() {
            return Ok(());
        }
        Err(MethodError::invalid("volume", "must not be sparse: this needs all voxels of a level"))
    }

    /// Makes one iteration if all bricks that it reads are loaded.
    pub(super) fn step_if_loaded(&mut self, levels: &SparseLevels) -> Result<StepReport, MethodError> {
        // Locked all the time, so that other models of the volume wait.
        let mut bricks = levels.volume.bricks();
        self.exchange_bricks(&mut bricks[levels.finest..]);
        let result = finished(self.try_to_iterate(&Pauses::default()));
        self.exchange_bricks(&mut bricks[levels.finest..]);
        result
    }

    /// Does what [`Self::step_if_loaded`] does, in slices. Meanwhile other models of the volume use bricks of their own.
    pub(super) async fn step_if_loaded_in_slices(
        &mut self,
        levels: &SparseLevels,
        pauses: &Pauses,
    ) -> Result<StepReport, MethodError> {
        self.exchange_bricks(&mut levels.volume.bricks()[levels.finest..]);
        let result = self.try_to_iterate(pauses).await;
        self.exchange_bricks(&mut levels.volume.bricks()[levels.finest..]);
        result
    }

    /// Undoes a step that was given up between two slices, if there was one.
    pub(super) fn discard_sparse_step(&mut self) {
        let (Some(before), Some(levels)) = (self.before.take(), self.pyramid.sparse.clone()) else { return };
        // Nobody waits for the bricks that it has missed.
        self.check_missed().ok();
        self.exchange_bricks(&mut levels.volume.bricks()[levels.finest..]);
        self.drop_caches();
        self.undo(*before);
    }

    /// Takes the bricks of all levels from the volume, or gives them back.
    fn exchange_bricks(&mut self, bricks: &mut [BrickGrid]) {
        for (level, bricks) in self.pyramid.levels.iter_mut().zip(bricks) {
            if let Some(own) = level.bricks_mut() {
                std::mem::swap(own, bricks);
            }
        }
    }

    async fn try_to_iterate(&mut self, pauses: &Pauses) -> Result<StepReport, MethodError> {
        if let Err(needs) = self.check_loaded() {
            self.has_asked = true;
            return Err(needs);
        }
        let level = self.level;
        self.before = Some(Box::new(self.state_before()));
        let result = self.iterate(pauses).await;
        let result = self.check_missed().and(result);
        let before = self.before.take();
        if let (Err(MethodError::NeedsData { .. }), Some(before)) = (&result, before) {
            self.undo(*before);
            return result;
        }
        // Only a model that goes on drops bricks, so that of two models of one volume one always does.
        if self.level < level {
            self.drop_level(level);
        }
        if std::mem::take(&mut self.has_asked) {
            self.drop_spare();
        }
        result
    }

    /// Returns an error unless the bricks are loaded that the next iteration is expected to read.
    fn check_loaded(&mut self) -> Result<(), MethodError> {
        if self.is_done() {
            return Ok(());
        }
        let may_end = self.convergence.quiet + 1 >= self.quiet_iterations();
        let mut needs = Vec::new();
        if self.pyramid.levels[self.level].bricks().is_some() {
            let reads_all = may_end || self.needs_factor || self.convergence.examine_next;
            let vertices = if reads_all { self.followed_vertices() } else { self.awake_vertices() };
            needs.extend(self.needs_around(self.level, &vertices));
        }
        if may_end && self.convergence.was_examined && self.level > 0 {
            let below = self.vertices_followed_on(self.level - 1);
            needs.extend(self.needs_around(self.level - 1, &below));
        }
        if needs.is_empty() { Ok(()) } else { Err(MethodError::NeedsData { needs }) }
    }

    /// Returns the boxes of missing bricks around some vertices, with a margin, if any is missing without it.
    fn needs_around(&self, level: usize, vertices: &[VertexId]) -> Vec<BrickBox> {
        let Some(SparseLevels { finest, reach: needed, .. }) = self.pyramid.sparse else { return Vec::new() };
        let delta = self.pyramid.delta_at(self.finest_delta, level);
        let image = &self.pyramid.levels[level];
        let Some(bricks) = image.bricks() else { return Vec::new() };
        let near = |reach: f32, vertices: &[VertexId]| {
            ranks_around(image, bricks, &self.mesh, vertices, reach * delta)
        };
        let is_missing = |rank: &u64| !bricks.has(BrickId::ranked(*rank));
        if !near(needed, vertices).iter().any(is_missing) {
            return Vec::new();
        }
        let needs: Vec<u64> = near(needed + MARGIN, vertices).into_iter().filter(is_missing).collect();
        merged(bricks, finest + level, &needs)
    }

    /// Returns an error with the boxes of the bricks that were read since the last call but are missing, if there are any.
    fn check_missed(&self) -> Result<(), MethodError> {
        let Some(SparseLevels { finest, .. }) = self.pyramid.sparse else { return Ok(()) };
        let mut needs = Vec::new();
        for (k, level) in self.pyramid.levels.iter().enumerate() {
            if let Some(bricks) = level.bricks() {
                needs.extend(merged(bricks, finest + k, &bricks.take_missed()));
            }
        }
        if needs.is_empty() { Ok(()) } else { Err(MethodError::NeedsData { needs }) }
    }

    /// Copies what the edits of a step may change, once vertices have moved; the buffers of the motion are freed.
    ///
    /// # Errors
    /// [`MethodError::NeedsData`] if bricks were missing so far.
    pub(super) fn prepare_edits(&mut self) -> Result<(), MethodError> {
        self.check_missed()?;
        self.motion.free_buffers();
        let Self { mesh, keys, before: Some(before), .. } = self else { return Ok(()) };
        before.vertices = std::mem::take(&mut before.vertices).completed(mesh, *keys);
        before.edited = Some(BeforeEdits {
            connectivity: mesh.connectivity(),
            checked_positions: mesh.vector(keys.checked_position).to_vec(),
            sizes: mesh.scalar(keys.size).to_vec(),
        });
        Ok(())
    }

    /// Drops the bricks of a level that the run has left.
    fn drop_level(&mut self, level: usize) {
        if let Some(bricks) = self.pyramid.levels[level].bricks_mut() {
            bricks.retain(|_| false);
        }
    }

    /// Drops the bricks of the current level that no vertex is near, if there are many.
    fn drop_spare(&mut self) {
        let image = &self.pyramid.levels[self.level];
        let Some(bricks) = image.bricks() else { return };
        let reach = (REACH + MARGIN) * self.model_delta();
        let near = ranks_around(image, bricks, &self.mesh, &self.followed_vertices(), reach);
        if bricks.len() > MOST_SPARE * near.len()
            && let Some(bricks) = self.pyramid.levels[self.level].bricks_mut()
        {
            bricks.retain(|brick| near.binary_search(&brick.rank()).is_ok());
        }
    }

    fn state_before(&self) -> Before {
        Before { vertices: VertexStates::default(), edited: None, progress: self.progress_so_far() }
    }

    fn undo(&mut self, before: Before) {
        let Self { mesh, keys, .. } = self;
        if let Some(BeforeEdits { connectivity, checked_positions, sizes }) = before.edited {
            mesh.set_back(&connectivity, &before.vertices.vectors[0]);
            mesh.vector_mut(keys.checked_position).copy_from_slice(&checked_positions);
            mesh.scalar_mut(keys.size).copy_from_slice(&sizes);
        }
        before.vertices.put_back(mesh, *keys);
        self.resolver.take_overflow();
        self.motion.free_buffers();
        self.set_back_progress(before.progress);
    }

    /// Returns the factor on α_I, the strength of the image force, of a sparse level, by the steepness of the image at the
    /// vertices.
    pub(super) fn measured_factor(&self) -> f32 {
        let image = &self.pyramid.levels[self.level];
        let outside = ObjectIs::by(&self.params).outside(self.level_iso);
        let half = 0.5 / image.voxels_per_unit();
        let mut steepness = Vec::new();
        for v in self.followed_vertices() {
            let (p, offset) = (self.mesh.position(v), self.mesh.unit_normal(v) * half);
            let at = |p: Vec3| image.intensity(p, outside, &mut CellCache::default());
            let [inside, outside] = [at(p - offset), at(p + offset)];
            if (inside < self.level_iso) != (outside < self.level_iso) {
                steepness.push((inside - outside).abs() / (2.0 * half));
            }
        }
        coarse::factor(&self.params, self.level, self.model_delta(), &|| {
            median(steepness.iter().copied()).unwrap_or(0.0)
        })
    }

    /// Returns the box in model space that the current level follows; `None` if it follows the whole surface.
    pub(super) fn followed_bounds(&self) -> Option<Bounds> {
        self.bounds_on(self.level)
    }

    fn bounds_on(&self, level: usize) -> Option<Bounds> {
        if !self.pyramid.is_sparse() {
            return None;
        }
        self.follow.filter(|follow| level < follow.whole).map(|follow| follow.bounds)
    }

    /// Adds the box that a sparse volume is followed in to the fingerprint of saved states, if there is one.
    pub(super) fn mix_box_into(&self, hash: &mut Hash) {
        if !self.pyramid.is_sparse() {
            return;
        }
        if let Some(Follow { bounds, whole }) = self.follow {
            let corners = [bounds.min, bounds.max].into_iter().flat_map(|corner| corner.to_array());
            corners.for_each(|x| hash.mix(u64::from(x.to_bits())));
            hash.mix(whole as u64);
        }
        let levels = self.pyramid.levels.iter().flat_map(|level| level.dims());
        levels.for_each(|n| hash.mix(n as u64));
    }

    /// Returns whether single vertices may still move when the current phase of a run on a sparse volume ends: not in the last
    /// one. Finer levels do not begin on their contour, and in a noisy image fronts creep for hundreds of iterations; those
    /// of a start on the contour are small, and go on later.
    pub(super) fn leaves_fronts(&self) -> bool {
        let is_last = self.level == 0 && (self.convergence.sized || !self.params.adapts_to_image());
        self.pyramid.is_sparse() && self.from_contour && !is_last
    }

    /// Returns whether the current level follows the surface at a vertex.
    pub(super) fn follows(&self, v: VertexId) -> bool {
        self.followed_bounds().is_none_or(|bounds| bounds.contains(self.mesh.position(v)))
    }

    /// Returns the vertices at which the current level follows the surface.
    pub(super) fn followed_vertices(&self) -> Vec<VertexId> {
        self.vertices_followed_on(self.level)
    }

    fn vertices_followed_on(&self, level: usize) -> Vec<VertexId> {
        let bounds = self.bounds_on(level);
        let is_in = |v: &VertexId| bounds.is_none_or(|bounds| bounds.contains(self.mesh.position(*v)));
        let followed = self.mesh.vertices().filter(is_in);
        let mut vertices = Vec::with_capacity(followed.clone().count());
        vertices.extend(followed);
        vertices
    }

    fn awake_vertices(&self) -> Vec<VertexId> {
        let still = self.mesh.scalar(self.keys.still_iterations);
        let mut vertices = self.followed_vertices();
        vertices.retain(|v| still[v.index()] < ITERATIONS_TO_SLEEP);
        vertices
    }

    /// Returns how often the mesh is refined by √3 for the next finer level: once per factor √3 by which edges become
    /// shorter; not if only part of the surface is followed there, whose edges are split instead.
    pub(super) fn refinements(&self) -> u32 {
        if self.params.topology == Topology::Fixed || self.bounds_on(self.level - 1).is_some() {
            return 0;
        }
        if !self.pyramid.is_sparse() {
            return 1;
        }
        let shortest = self.pyramid.delta_at(self.finest_delta, self.level - 1)
            * (1.0 + self.first_size(self.level - 1));
        let ratio = f64::from(self.model_delta() / shortest);
        (libm::log(ratio) / libm::log(REDUCTION) + ROUNDING) as u32
    }

    /// Returns the number of vertices that the next finer level will have when it begins, by the ratio of edge lengths: about
    /// a tenth off.
    pub(super) fn expected_below(&self) -> usize {
        let edge =
            |level: usize| self.pyramid.delta_at(self.finest_delta, level) * (1.0 + self.first_size(level));
        let ratio = f64::from(edge(self.level) / edge(self.level - 1));
        let followed = self.vertices_followed_on(self.level - 1).len();
        let others = self.mesh.vertex_count() - followed;
        let expected = others.saturating_add((followed as f64 * ratio * ratio) as usize);
        expected.min(self.resolver.max_vertices())
    }

    /// Returns the size, less 1, of the vertices of a sparse level when it begins: the largest on the finest level if it
    /// will be sized by curvature, so that vertices are not made only to be removed.
    fn first_size(&self, level: usize) -> f32 {
        let is_sized = level == 0 && self.params.adapts_to_image();
        if is_sized { self.params.adaptivity as f32 * (LARGEST - 1.0) } else { 0.0 }
    }

    /// Sets the sizes of the vertices on a sparse level just begun. The part of the surface that it does not follow keeps
    /// its edge lengths: δ was larger there by the factor `ratio`.
    pub(super) fn begin_sizes(&mut self, ratio: f32) {
        if !self.pyramid.is_sparse() {
            return;
        }
        let first = self.first_size(self.level);
        let vertices: Vec<VertexId> = self.mesh.vertices().collect();
        for v in vertices {
            let is_followed = self.follows(v);
            let size = &mut self.mesh.scalar_mut(self.keys.size)[v.index()];
            *size = if is_followed { first } else { (1.0 + *size) * ratio - 1.0 };
        }
    }
}

/// The part of a refinement that counts as a whole one, since factors between levels are rounded.
const ROUNDING: f64 = 0.1;

/// Returns the ranks of the bricks within `reach` of some vertices, in model units, in ascending order.
fn ranks_around(
    image: &LevelImage,
    bricks: &BrickGrid,
    mesh: &Mesh,
    vertices: &[VertexId],
    reach: f32,
) -> Vec<u64> {
    let half = image.scale() * reach + Vec3::ONE;
    let (mut ranks, mut most) = (Vec::new(), 1 << 16);
    for &v in vertices {
        // Most are there several times.
        if ranks.len() > most {
            sort_distinct_ranks(&mut ranks);
            most = most.max(2 * ranks.len());
        }
        let at = image.index(mesh.position(v));
        bricks.for_each_around(at - half, at + half, |rank| {
            if ranks.last() != Some(&rank) {
                ranks.push(rank);
            }
        });
    }
    sort_distinct_ranks(&mut ranks);
    ranks
}

fn sort_distinct_ranks(ranks: &mut Vec<u64>) {
    sort_ranks(ranks);
    ranks.dedup();
}

/// Returns an error for parameters that a sparse volume does not support.
pub(super) fn check_params(params: &DeformableParams) -> Result<(), MethodError> {
    for (name, force) in
        [("gradientNormal", params.gradient_normal), ("gradientTangent", params.gradient_tangent)]
    {
        if force != 0.0 {
            return Err(MethodError::invalid(name, format!("must be 0 for a sparse volume, got {force}")));
        }
    }
    if params.seeding == Seeding::On {
        return Err(MethodError::invalid(
            "seeding",
            "a sparse volume cannot be searched: must be auto or off",
        ));
    }
    Ok(())
}

fn follow(
    volume: &SparseVolume,
    options: &SparseOptions,
    to_world: &DAffine3,
) -> Result<Option<Follow>, MethodError> {
    let last = volume.levels().len() - 1;
    let whole = options.whole.unwrap_or(last);
    if whole < options.finest || whole > last {
        let problem = format!("must be from {} to {last}, got {whole}", options.finest);
        return Err(MethodError::invalid("whole", problem));
    }
    let Some(WorldBox { min, max }) = options.within else { return Ok(None) };
    if !(min.is_finite() && max.is_finite() && min.cmple(max).all()) {
        let problem = format!("must be two finite corners, the lower one first, got {min} and {max}");
        return Err(MethodError::invalid("box", problem));
    }
    let to_model = to_world.inverse();
    let corner = |k: usize| DVec3::from([0, 1, 2].map(|axis| [min, max][k >> axis & 1][axis]));
    let corners: Vec<Vec3> = (0..8).map(|k| to_model.transform_point3(corner(k)).as_vec3()).collect();
    Ok(Some(Follow { bounds: Bounds::from_points(&corners), whole: whole - options.finest }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pauses::advance;
    use crate::volume::{SparseInit, SparseLevel, Voxels};
    use std::task::Poll;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a volume of two levels, with the coarser one loaded, and a function for the voxels of its boxes: a ball with
    /// a cavity, and eight specks that only the coarser level has.
    fn volume() -> (SparseVolume, impl Fn(&BrickBox) -> Voxels) {
        let level = |n: usize, voxel: f64| {
            let translation = DVec3::splat(0.5 * (voxel - 1.0));
            let affine = DAffine3 { translation, ..DAffine3::from_scale(DVec3::splat(voxel)) };
            SparseLevel { dims: [n; 3], affine }
        };
        let levels = vec![level(64, 1.0), level(32, 2.0)];
        let init = SparseInit { levels: levels.clone(), range: [0.0, 200.0], fill: Voxels::U8(vec![0]) };
        let voxels = move |at: &BrickBox| {
            let [nx, ny, _] = at.region.dims;
            let value = |k: usize| {
                let offset = [k % nx, k / nx % ny, k / nx / ny];
                let index = [0, 1, 2].map(|axis| (at.region.min[axis] + offset[axis]) as f64);
                let p = levels[at.level].affine.transform_point3(DVec3::from(index)) - 31.3;
                let shell = (20.0 - p.length()).min(p.length() - 8.0);
                let speck = 4.0 * at.level as f64 - (p.abs() - 27.0).length();
                (100.0 + 60.0 * shell.max(speck)).clamp(0.0, 200.0) as u8
            };
            Voxels::U8((0..at.region.len()).map(value).collect())
        };
        let volume = SparseVolume::new(init).unwrap();
        volume.missing(1).unwrap().iter().for_each(|at| volume.insert(*at, &voxels(at)).unwrap());
        (volume, voxels)
    }

    /// With a negative reach nothing is asked for in advance: steps read missing bricks while vertices move, and then in
    /// edits, and are undone. In a box only some vertices move.
    #[test]
    fn a_step_that_reads_a_missing_brick_is_undone() {
        let half = WorldBox { min: DVec3::ZERO, max: DVec3::new(30.0, 64.0, 64.0) };
        for within in [None, Some(half)] {
            let options = SparseOptions { within, ..SparseOptions::default() };
            let [while_moving, in_edits] = undone_steps(&options);
            assert!(while_moving > 0 && in_edits > 0, "{while_moving} and {in_edits} with {within:?}");
        }
    }

    /// Runs a model that gets bricks when it has missed them beside one that has all, and asserts that they are the same
    /// and that an undone step changes nothing. Returns the numbers of steps undone while vertices moved, and in edits.
    fn undone_steps(options: &SparseOptions) -> [u32; 2] {
        let (whole, voxels) = volume();
        whole.missing(0).unwrap().iter().for_each(|at| whole.insert(*at, &voxels(at)).unwrap());
        let mut expected = DeformableModel::on_sparse(&whole, options.clone()).unwrap();
        let (volume, voxels) = volume();
        let mut model = DeformableModel::on_sparse(&volume, options.clone()).unwrap();
        if let Some(sparse) = &mut model.pyramid.sparse {
            sparse.reach = -100.0;
        }
        let [mut while_moving, mut in_edits] = [0, 0];
        loop {
            let (before, versions) = (model.save(), model.mesh.versions());
            match model.step() {
                Ok(report) => {
                    expected.step().unwrap();
                    assert_eq!(model.mesh.positions(), expected.mesh.positions());
                    assert!(model.save() == expected.save(), "iteration {}", report.iteration);
                    if report.done {
                        return [while_moving, in_edits];
                    }
                }
                Err(MethodError::NeedsData { needs }) => {
                    assert!(model.save() == before);
                    assert_eq!(model.mesh.check(), Ok(()));
                    let changed = [0, 1].map(|k| model.mesh.versions()[k] != versions[k]);
                    while_moving += u32::from(changed == [false, true]);
                    in_edits += u32::from(changed[0]);
                    needs.iter().for_each(|at| volume.insert(*at, &voxels(at)).unwrap());
                }
                Err(error) => panic!("{error}"),
            }
        }
    }

    /// Steps in slices that are given up now and then, and meanwhile another model of the same volume makes steps; both get
    /// bricks when they need them.
    #[test]
    fn steps_in_slices_can_be_given_up_beside_another_model() {
        let (whole, voxels) = volume();
        whole.missing(0).unwrap().iter().for_each(|at| whole.insert(*at, &voxels(at)).unwrap());
        let options = SparseOptions::default();
        let mut expected = DeformableModel::on_sparse(&whole, options.clone()).unwrap();
        let (volume, voxels) = volume();
        let [mut model, mut other] =
            [(); 2].map(|()| DeformableModel::on_sparse(&volume, options.clone()).unwrap());
        let supply = |result: Result<StepReport, MethodError>| match result {
            Err(MethodError::NeedsData { needs }) => {
                needs.iter().for_each(|at| volume.insert(*at, &voxels(at)).unwrap());
                None
            }
            result => Some(result.unwrap()),
        };
        let (mut given_up, mut asked, mut steps) = (0, 0, 0);
        loop {
            let before = model.save();
            for most in [1, 2 + steps % 60] {
                let mut step = Box::pin(model.step_in_slices());
                let is_over = (0..most).any(|_| advance(&mut step).is_ready());
                drop(step);
                if is_over {
                    model.restore(&before).unwrap();
                    break;
                }
                model.discard_step();
                given_up += 1;
                assert_eq!(model.mesh.check(), Ok(()));
                assert!(model.save() == before, "step {steps}");
            }
            let mut step = Box::pin(model.step_in_slices());
            let result = loop {
                if let Poll::Ready(result) = advance(&mut step) {
                    break result;
                }
                supply(other.step());
            };
            drop(step);
            let Some(report) = supply(result) else {
                asked += 1;
                continue;
            };
            expected.step().unwrap();
            assert!(model.save() == expected.save(), "step {steps}");
            steps += 1;
            if report.done {
                break;
            }
        }
        assert!(given_up > 20 && asked > 0, "{given_up} given up, {asked} waited for bricks");
        while supply(other.step()).is_none_or(|report| !report.done) {}
        assert!(other.save() == expected.save());
    }
}
