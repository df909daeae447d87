//! Whether a frame has the tracked object: the surface ends where the image has none, and begins where one appears.
//!
//! The image decides by its boundary votes. A vertex is on the boundary of an object if the frame itself, not only
//! those around it in time, has votes around the vertex, and its intensity falls there from inside to outside. Noise has
//! hardly any votes, a neighbouring object the opposite step. So the surface of an object that is there has such
//! vertices nearly everywhere, and one without an object nearly nowhere, however dim or small the object is. What is
//! smaller than a voxel is none.
//!
//! Where no vertices are on a boundary, the windows may have extended over frames so much brighter that the object's
//! own step does not count. So the frame is tried again with windows of its own, before the surface ends.

use super::frame_tracker::{FIRST_FRAME_PASSES, FrameContext, FrameTracker, Support};
use super::labelling::{MIN_WEIGHT, VoxelBox, label_bright};
use super::project::SpaceTimeSamples;
use super::region::Region;
use super::vote::{BoundaryVoting, Window};
use super::{FrameStatistics, SurfaceTracker};
use crate::math::DAffine3;
use crate::mesh::{Mesh, TriangleMesh, measure};
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::remesh::Changes;
use crate::volume::voxels_inside;
use fixedbitset::FixedBitSet;
use std::sync::Arc;

/// Smallest share of a surface's vertices on a boundary of the frame for an object to be there. Below it, noise and a
/// neighbouring object could hold a surface; above it, one with gaps in its boundary would end. The surface of a whole
/// chest has votes near three quarters of its vertices, and intensity falls at half of them.
const MIN_PRESENT: f64 = 0.1;

/// Share of the vertices without a boundary, or with rejected projections, from which [`MIN_PRESENT`] is tested at all.
/// With lower shares, the object is certainly there.
const UNCERTAIN: f64 = 0.5;

/// Share of a component's voxels that were bright in the frame before, outside of the tracked surface, from which it
/// counts as another object that was there before, not as one that begins. Objects that touch overlap by less, and those
/// that move by half of their size by more.
const KNOWN: f64 = 0.25;

/// Increase, since the surface began, of the share of vertices whose projections fail, from which it is compared with one
/// extracted from the frame. Where windows reach, hardly any fail; of those of a chest, a third fail in all frames.
const MORE_REJECTED: f64 = 0.1;

/// Mean distance between a tracked surface and one extracted from the same frame, in units of the shortest side of a
/// voxel, below which they are the same. A tenth of the surface, see [`MORE_REJECTED`], is further than that apart on
/// average where it is beyond the windows.
const APART: f64 = 0.1;

/// The result of tracking a surface into a frame.
pub(super) struct Tracked {
    pub mesh: Mesh,
    pub tracker: FrameTracker,
    pub samples: Arc<SpaceTimeSamples>,
    pub changes: Changes,
    pub statistics: FrameStatistics,
    /// Whether the frame has an object at the surface.
    pub is_present: bool,
}

impl SurfaceTracker {
    /// Tracks a surface, given in the working space, into a frame; `from` are the boundary points around the frame before,
    /// `None` if the surface begins here. `voting` has the levels of the frame.
    pub(super) async fn tracked(
        &self,
        mut mesh: Mesh,
        mut tracker: FrameTracker,
        from: Option<&SpaceTimeSamples>,
        frame: usize,
        voting: &BoundaryVoting,
        pauses: &Pauses,
    ) -> Tracked {
        let samples = self.samples_around(frame, pauses).await;
        let params = &self.region.space.params(&self.params);
        let context = FrameContext { region: &self.region, params, frame, samples: &samples, voting, pauses };
        let (changes, statistics) = tracker.track_frame(&mut mesh, from, &context).await;
        pauses.now().await;
        let voxel = self.region.spacing.element_product();
        let is_present = statistics.volume >= voxel && context.is_present(&mesh, &statistics);
        let samples = Arc::new(samples);
        Tracked { mesh, tracker, samples, changes, statistics, is_present }
    }

    /// Tracks the surface of the frame before, `mesh` in the working space, into a frame; `None` if the frame has no
    /// object there. If windows over several frames find none, the votes of the frame are replaced by those of windows
    /// within the frame, provided that these find one.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`] if these have too many.
    pub(super) async fn follow(
        &mut self,
        mesh: &Mesh,
        tracker: FrameTracker,
        from: Option<&SpaceTimeSamples>,
        frame: usize,
        pauses: &Pauses,
    ) -> Result<Option<Tracked>, MethodError> {
        if self.region.is_blank(frame) {
            return Ok(None);
        }
        let edge = tracker.edge;
        self.voting.ensure_levels(&self.region, frame, pauses).await;
        let first = self.tracked(mesh.clone(), tracker, from, frame, &self.voting, pauses).await;
        if first.is_present {
            return Ok(Some(first));
        }
        let Some(voting) = self.use_own_windows(frame, pauses).await? else { return Ok(None) };
        let again = self.tracked(mesh.clone(), FrameTracker::new(edge), from, frame, &voting, pauses).await;
        if !again.is_present {
            self.keep_votes(false);
        }
        Ok(again.is_present.then_some(again))
    }

    /// Returns the surface extracted from a frame where one was tracked into it, if many of the projections of that one fail,
    /// since it moved further than the windows reach, far fewer of those of the extracted one, and the two are apart.
    ///
    /// # Errors
    /// [`MethodError::Mesh`] and [`MethodError::Volume`] if memory does not suffice.
    pub(super) async fn extracted_instead(
        &self,
        tracked: &Tracked,
        frame: usize,
        pauses: &Pauses,
    ) -> Result<Option<Tracked>, MethodError> {
        let Some(began) = self.frame_of_begin(frame) else { return Ok(None) };
        let passes = FIRST_FRAME_PASSES as f64;
        let usual = rejected_share(&self.statistics[began], passes);
        let now = rejected_share(&tracked.statistics, 1.0);
        if now < usual + MORE_REJECTED {
            return Ok(None);
        }
        let inside = inside_voxels(&self.region, &tracked.mesh.to_triangles());
        let mut best: Option<(usize, TriangleMesh)> = None;
        for part in self.surfaces_in(frame, pauses).await? {
            let shared = inside_voxels(&self.region, &part).intersection(&inside).count();
            pauses.now().await;
            if shared > 0 && best.as_ref().is_none_or(|(most, _)| shared >= *most) {
                best = Some((shared, part));
            }
        }
        let Some((_, part)) = best else { return Ok(None) };
        let found = self.begun_at(&part, frame, &self.voting, pauses).await?;
        let is_better = found.is_present && rejected_share(&found.statistics, passes) < 0.5 * now;
        if !is_better {
            return Ok(None);
        }
        pauses.now().await;
        // Predicted to the right place, but held there by nothing, a surface could leave it in the next frame.
        let is_held = now < UNCERTAIN && mean_distance(&self.region, &inside, &found) < APART;
        Ok((!is_held).then_some(found))
    }

    /// Returns the frame before `frame` in which the surface began that was tracked up to `frame`; `None` if there is none.
    fn frame_of_begin(&self, frame: usize) -> Option<usize> {
        (0..frame)
            .rev()
            .take_while(|&t| !self.meshes[t].triangles.is_empty())
            .find(|&t| t == 0 || self.lost.contains(&(t as u32)) || self.meshes[t - 1].triangles.is_empty())
    }

    /// Finds an object that begins in a frame, and extracts and tracks its surface; `None` if no object begins there.
    /// `last` is the surface of the frame before, in the working space, which has ended; empty if there was none.
    ///
    /// # Errors
    /// [`MethodError::Mesh`] and [`MethodError::Volume`] if memory does not suffice.
    pub(super) async fn begin(
        &mut self,
        last: &Mesh,
        frame: usize,
        pauses: &Pauses,
    ) -> Result<Option<Tracked>, MethodError> {
        if self.region.is_blank(frame) {
            return Ok(None);
        }
        self.voting.ensure_levels(&self.region, frame, pauses).await;
        if let Some(found) = self.begin_with(last, frame, &self.voting, pauses).await? {
            return Ok(Some(found));
        }
        let Some(voting) = self.use_own_windows(frame, pauses).await? else { return Ok(None) };
        let found = self.begin_with(last, frame, &voting, pauses).await;
        if !matches!(found, Ok(Some(_))) {
            self.keep_votes(false);
        }
        found
    }

    async fn begin_with(
        &self,
        last: &Mesh,
        frame: usize,
        voting: &BoundaryVoting,
        pauses: &Pauses,
    ) -> Result<Option<Tracked>, MethodError> {
        let parts = self.surfaces_in(frame, pauses).await?;
        if parts.is_empty() {
            return Ok(None);
        }
        let known = self.known_before(last, frame, pauses).await;
        let mut new = Vec::new();
        for part in parts {
            if !self.is_known(&part, &known) {
                new.push(part);
            }
            if frame > 0 {
                pauses.now().await;
            }
        }
        let Some(part) = self.tracked_component(new, pauses).await else { return Ok(None) };
        let found = self.begun_at(&part, frame, voting, pauses).await?;
        // In the first frame there is nothing to compare with, and what was extracted is given.
        Ok((found.is_present || frame == 0).then_some(found))
    }

    /// Tracks an extracted surface into its frame.
    async fn begun_at(
        &self,
        part: &TriangleMesh,
        frame: usize,
        voting: &BoundaryVoting,
        pauses: &Pauses,
    ) -> Result<Tracked, MethodError> {
        let mesh = self.remeshed(part, pauses).await?;
        pauses.after(mesh.triangle_count()).await;
        let edge = match &self.frame_tracker {
            Some(tracker) => tracker.edge,
            None => measure(&mesh.to_triangles()).edge_mean,
        };
        Ok(self.tracked(mesh, FrameTracker::new(edge), None, frame, voting, pauses).await)
    }

    /// Replaces the votes of a frame by those of windows within it, until [`Self::keep_votes`] is called, and returns
    /// their levels; `None` if windows are of single frames anyway.
    ///
    /// # Errors
    /// [`MethodError::TooLarge`] if there are too many.
    async fn use_own_windows(
        &mut self,
        frame: usize,
        pauses: &Pauses,
    ) -> Result<Option<BoundaryVoting>, MethodError> {
        if self.params.window_frames == 0 {
            return Ok(None);
        }
        let window = Window { frames: 0, ..self.voting.window() };
        let mut voting = BoundaryVoting::new(window, self.frames());
        let mut faces = voting.faces(&self.region, frame, self.limits.points(), pauses).await?;
        self.limits.check_faces(&faces)?;
        // Faces along time have no windows within one frame.
        faces[super::vote::TIME].clone_from(&self.faces[frame][super::vote::TIME]);
        let several = std::mem::replace(&mut self.faces[frame], faces);
        self.replaced_faces = Some((frame, several));
        Ok(Some(voting))
    }

    /// Keeps the votes of windows within a frame if there are any, or takes those that they replaced again.
    pub(super) fn keep_votes(&mut self, keeps: bool) {
        if let (Some((frame, several)), false) = (self.replaced_faces.take(), keeps) {
            self.faces[frame] = several;
        }
    }

    /// Returns the voxels of the region that were bright in the frame before, outside of the tracked surface `last`;
    /// empty for the first frame.
    async fn known_before(&self, last: &Mesh, frame: usize, pauses: &Pauses) -> FixedBitSet {
        let region = &self.region;
        let mut known = FixedBitSet::with_capacity(region.dims.iter().product());
        let Some(before) = frame.checked_sub(1) else { return known };
        let voxels = VoxelBox { ends: region.inner };
        let bright = label_bright(region, before, &self.faces[before], voxels, pauses).await;
        let Some(bright) = bright else { return known };
        for (i, _) in bright.iter().enumerate().filter(|(_, is_bright)| **is_bright) {
            known.insert(region.index(voxels.at(i)));
        }
        if last.vertex_count() > 0 {
            known.difference_with(&inside_voxels(region, &last.to_triangles()));
        }
        known
    }

    /// Returns whether the component of a frame's surface is that of an object whose voxels were bright in the frame
    /// before.
    fn is_known(&self, part: &TriangleMesh, known: &FixedBitSet) -> bool {
        if known.is_clear() {
            return false;
        }
        let inside = inside_voxels(&self.region, part);
        let overlap = inside.intersection(known).count();
        overlap as f64 >= KNOWN * (inside.count_ones(..).max(1)) as f64
    }
}

/// Returns the share of vertices whose projections failed, which are counted in each of `passes`.
fn rejected_share(statistics: &FrameStatistics, passes: f64) -> f64 {
    // Closed meshes have about twice as many triangles as vertices.
    2.0 * statistics.rejected as f64 / (passes * statistics.triangles.max(1) as f64)
}

/// Returns the mean distance between `surface` and one that encloses the voxels `inside`, in units of the shortest side of
/// a voxel: the volume between them by area.
fn mean_distance(region: &Region, inside: &FixedBitSet, surface: &Tracked) -> f64 {
    let differing = inside.symmetric_difference(&inside_voxels(region, &surface.mesh.to_triangles())).count();
    differing as f64 * region.spacing.element_product()
        / (surface.statistics.area * region.spacing.min_element())
}

/// Returns the voxels of the region whose centres are inside a surface, given in the working space.
pub(super) fn inside_voxels(region: &Region, surface: &TriangleMesh) -> FixedBitSet {
    let to_voxels = DAffine3::from_scale(region.spacing.recip()) * region.from_space;
    voxels_inside(
        &TriangleMesh { origin: Default::default(), ..surface.clone() }.transformed(&to_voxels),
        region.dims,
    )
}

impl FrameContext<'_> {
    /// Returns whether the frame has an object at a surface that was tracked into it, see the module's documentation.
    fn is_present(&self, mesh: &Mesh, statistics: &FrameStatistics) -> bool {
        let uncertain = UNCERTAIN * mesh.vertex_count() as f64;
        let is_certain =
            (statistics.without_boundary as f64) < uncertain && (statistics.rejected as f64) < uncertain;
        is_certain || self.share_on_boundary(mesh) >= MIN_PRESENT
    }

    /// Returns the share of vertices on a boundary of the frame.
    fn share_on_boundary(&self, mesh: &Mesh) -> f64 {
        let on_boundary = mesh.vertices().filter(|&v| {
            let at = self.region.to_local(mesh.position(v));
            self.classify(mesh.position(v), mesh.area_normal(v)) == Support::Boundary
                && self.samples.own.sums(at).weight >= f64::from(MIN_WEIGHT)
        });
        on_boundary.count() as f64 / mesh.vertex_count().max(1) as f64
    }
}
