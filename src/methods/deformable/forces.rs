//! Internal and external forces on the vertices of the deformable model (sections 3.7 and 3.8 of the paper).

use super::contour::ObjectIs;
use super::image::LevelImage;
use super::params::{DeformableParams, Integrator, RestLength};
use crate::math::{Mat3, Vec3, resize};
use crate::mesh::{Ring, VertexId};
use crate::pauses::Pauses;
use crate::volume::{CellCache, Padding};

/// The speed along the normal, in δ per unit of time, above which the tangential parts of rigidity and of the
/// attractors act in full; at lower speeds they fade out.
///
/// The tangential part of the force of rigidity spaces vertices evenly while the surface moves. On a settled surface it
/// would act for ever: vertices slide off ridges, edges there grow and are split, edges beside them shrink and are
/// collapsed, and each edit displaces vertices, so that the energy never falls. Below 0.02 the sampling of slow fronts
/// suffers; from 0.3 on sliding does not fade everywhere.
const FULL_TANGENTIAL_SPEED: f32 = 0.1;

/// The approximate distance from the contour, in voxels of the finest level, up to which rigidity may pull the surface:
/// with more, thin strands shrink; with less, noise is not smoothed.
const MAX_RIGIDITY_OFFSET: f32 = 0.1;

/// The largest distance, in voxels of the finest level, between a vertex and the point on its normal at which the image
/// is sampled for the force on it, see [`Forces::mean_of_triangles`].
const MAX_INSET: f32 = 0.15;

/// An [`Attractor`](super::Attractor), a point that attracts or repels the surface, in model space.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalAttractor {
    pub(super) point: Vec3,
    pub(super) strength: f32,
    /// Maps a displacement in model space to world space, divided by the radius of the attractor: the length of the
    /// result is 1 where the force ends.
    pub(super) in_radii: Mat3,
}

/// The parameters of the forces in model units: lengths in voxels of the finest level, intensities in 0..1.
#[derive(Clone, Debug)]
pub(super) struct ForceScale {
    iso: f32,
    iso_force: f32,
    outside: Padding,
    gradient_across: f32,
    gradient_along: f32,
    gradient_bound: f32,
    rigidity: f32,
    stiffness: f32,
    rest: RestLength,
    voxel: f64,
    delta: f32,
    /// Whether the surface adapts to the image: the image limits rigidity along the normal, and is sampled at the mean
    /// of the triangles at a vertex instead of the vertex.
    adapts_to_image: bool,
    /// Whether [`Forces::slope`] has to be computed, to limit rigidity or for the implicit integrator.
    needs_slope: bool,
}

impl ForceScale {
    /// Converts parameters to model units. `iso` is the level's iso value, normalised to the volume's intensity range,
    /// `gain` the level's factor on α_I, the strength of the image force, `delta` is δ in voxels, and `voxel` is the
    /// length of a model unit in the world.
    pub(super) fn new(params: &DeformableParams, [iso, gain]: [f32; 2], voxel: f64, delta: f32) -> Self {
        let yields = params.adapts_to_image();
        Self {
            adapts_to_image: yields,
            needs_slope: yields || params.integrator == Integrator::Implicit,
            iso,
            iso_force: params.iso_force as f32 * gain,
            outside: ObjectIs::by(params).outside(iso),
            gradient_across: (params.gradient_normal - params.gradient_tangent) as f32,
            gradient_along: params.gradient_tangent as f32,
            gradient_bound: params.gradient_bound as f32,
            rigidity: params.rigidity as f32,
            stiffness: params.stiffness as f32,
            rest: params.rest_length,
            voxel,
            delta,
        }
    }

    /// Returns the image force per unit of difference between the iso value and the intensity: δ |α_I|, times the
    /// level's gain. The implicit integrator and the limit of rigidity need it.
    pub(super) fn iso_stiffness(&self) -> f32 {
        self.delta * self.iso_force.abs()
    }

    fn uses_gradient(&self) -> bool {
        self.gradient_across != 0.0 || self.gradient_along != 0.0
    }
}

/// The number of vertices whose forces are evaluated between two counts of the work.
const CHUNK: usize = 256;

/// The number of vertices whose forces are a unit of work.
const VERTICES_PER_UNIT: usize = 4;

/// The image and the attractors that exert external forces, with the parameters of all forces.
pub(super) struct Field<'a> {
    pub(super) image: &'a LevelImage,
    pub(super) scale: ForceScale,
    pub(super) attractors: &'a [LocalAttractor],
}

/// The forces on the vertices and the quantities they depend on, by vertex slot; buffers are kept between iterations.
#[derive(Clone, Debug, Default)]
pub(super) struct Forces {
    /// L(x), the vector from a vertex to the mean of its neighbours.
    laplacian: Vec<Vec3>,
    /// Unit normals of the vertices, outwards.
    pub(super) normal: Vec<Vec3>,
    /// The absolute difference of the intensity Π, in 0..1, over one voxel of the finest level along the normal of each
    /// vertex; the stiffness of the image force is proportional to it.
    pub(super) slope: Vec<f32>,
    /// The image cell around each vertex at its last sample, cached because the next sample often reuses it; empty on
    /// sparse levels, where they would take more memory than they save time.
    cells: Vec<CellCache>,
    /// The sum of all forces on each vertex, in model units.
    pub(super) force: Vec<Vec3>,
    /// The time spent on force evaluation and not yet added to a step report, in milliseconds.
    pub(super) milliseconds: f64,
}

impl Forces {
    /// Discards the cached image cells of all vertices, which is necessary when the pyramid level changes.
    pub(super) fn forget_image(&mut self) {
        self.cells = Vec::new();
    }

    /// Frees all buffers but the normals, so that less memory is taken while vertices move on a sparse level.
    pub(super) fn keep_normals(&mut self) {
        *self = Self {
            normal: std::mem::take(&mut self.normal),
            milliseconds: self.milliseconds,
            ..Self::default()
        };
    }

    /// Computes the normals of `vertices` and their Laplacians, the vectors to the means of their neighbours, from
    /// which the forces are evaluated.
    pub(super) fn update_normals(&mut self, rings: &[Ring], positions: &[Vec3], vertices: &[VertexId]) {
        resize(&mut self.laplacian, rings.len(), Vec3::ZERO);
        resize(&mut self.normal, rings.len(), Vec3::ZERO);
        resize(&mut self.force, rings.len(), Vec3::ZERO);
        resize(&mut self.slope, rings.len(), 0.0);
        for v in vertices.iter().map(|v| v.index()) {
            let ring = &rings[v];
            let Some(&last) = ring.as_slice().last() else { continue };
            let centre = positions[v];
            let mut previous = positions[last.index()] - centre;
            let (mut sum, mut normal) = (Vec3::ZERO, Vec3::ZERO);
            for w in ring.as_slice() {
                let spoke = positions[w.index()] - centre;
                sum += spoke;
                normal += previous.cross(spoke);
                previous = spoke;
            }
            self.laplacian[v] = sum * (1.0 / ring.valence() as f32);
            self.normal[v] = normal.normalize_or_zero();
        }
    }

    /// Computes the forces on `vertices` and stores them in [`Self::force`]; needs [`Self::update_normals`] of them and
    /// their neighbours at the same positions. Pauses meanwhile.
    pub(super) async fn evaluate(
        &mut self,
        rings: &[Ring],
        [positions, velocities]: [&[Vec3]; 2],
        field: &Field<'_>,
        vertices: &[VertexId],
        pauses: &Pauses,
    ) {
        let rest = rest_length(rings, positions, &field.scale);
        if field.image.bricks().is_none() {
            resize(&mut self.cells, rings.len(), CellCache::default());
        }
        for some in vertices.chunks(CHUNK) {
            self.evaluate_some(rings, [positions, velocities], field, some, rest);
            pauses.after(some.len() / VERTICES_PER_UNIT).await;
        }
    }

    fn evaluate_some(
        &mut self,
        rings: &[Ring],
        [positions, velocities]: [&[Vec3]; 2],
        field: &Field,
        vertices: &[VertexId],
        rest: f32,
    ) {
        let &Field { image, ref scale, attractors } = field;
        for v in vertices.iter().map(|v| v.index()) {
            let ring = &rings[v];
            let x = positions[v];
            if scale.needs_slope {
                self.slope[v] = self.slope_along_normal(v, x, image, scale);
            }
            let iso_difference = self.iso_difference(v, x, image, scale);
            let rigidity_limit = if scale.adapts_to_image {
                self.rigidity_limit(v, iso_difference, scale)
            } else {
                f32::INFINITY
            };
            let mut force = self.curvature(v, ring, velocities[v], scale, rigidity_limit);
            if scale.stiffness != 0.0 {
                force += springs(ring, positions, x, rest) * scale.stiffness;
            }
            force += self.iso_force(v, iso_difference, scale);
            if scale.uses_gradient() {
                force += self.gradient_force(v, x, image, scale);
            }
            if !attractors.is_empty() {
                let force_of_attractors = attractors.iter().map(|attractor| attraction(attractor, x)).sum();
                force += self.fade_tangential(v, force_of_attractors, velocities[v], scale.delta);
            }
            self.force[v] = force;
        }
    }

    /// Returns the force of rigidity, which resists changes of curvature: f_c = α_c (L(x) − mean of L over the
    /// neighbours) (5), with L(x) the vector from a vertex to the mean of its neighbours. Its tangential part fades out
    /// as the surface settles; the length of its normal part is at most `limit`.
    #[inline]
    fn curvature(&self, v: usize, ring: &Ring, velocity: Vec3, scale: &ForceScale, limit: f32) -> Vec3 {
        let bending = self.laplacian[v] - ring.mean(&self.laplacian);
        let normal = self.normal[v];
        let along_normal = bending.dot(normal);
        let across = normal * along_normal;
        let speed = velocity.dot(normal).abs() / (FULL_TANGENTIAL_SPEED * scale.delta);
        let along = (bending - across) * if speed < 1.0 { speed } else { 1.0 };
        let strength = along_normal.abs() * scale.rigidity;
        let normal_part = if strength > limit { across * (limit / strength) } else { across };
        (normal_part + along) * scale.rigidity
    }

    /// Returns the approximate mean position of the triangles at a vertex. The image is sampled there, so that the
    /// surface encloses the volume of the contour; with vertices on the contour the volume would be too small. With
    /// corners on a sphere of radius r, triangles of edge l lie l²/8r inside it, a quarter of the distance between a
    /// vertex and the mean of its neighbours.
    #[inline]
    fn mean_of_triangles(&self, v: usize, x: Vec3) -> Vec3 {
        let normal = self.normal[v];
        let inset = 0.25 * self.laplacian[v].dot(normal);
        x + normal * inset.clamp(-MAX_INSET, MAX_INSET)
    }

    /// Returns the absolute difference of the intensity Π, in 0..1, over one voxel of the finest level along the normal
    /// of a vertex: how steep the image is there.
    #[inline]
    fn slope_along_normal(&self, v: usize, x: Vec3, image: &LevelImage, scale: &ForceScale) -> f32 {
        let half = self.normal[v] * 0.5;
        let at = |p| image.intensity(p, scale.outside, &mut CellCache::default());
        (at(x + half) - at(x - half)).abs()
    }

    /// Returns the largest force of rigidity along the normal of a vertex that the image force balances, so that no
    /// settled vertex is further than 4/3 [`MAX_RIGIDITY_OFFSET`] from the contour.
    #[inline]
    fn rigidity_limit(&self, v: usize, iso_difference: f32, scale: &ForceScale) -> f32 {
        scale.iso_stiffness() * (MAX_RIGIDITY_OFFSET * self.slope[v] + 0.25 * iso_difference.abs())
    }

    /// Returns a force with its tangential part faded out as the surface settles, faster than that of rigidity; used
    /// for attractors. Their tangential part would otherwise draw the surrounding vertices to a point, where edges are
    /// collapsed again and again.
    fn fade_tangential(&self, v: usize, force: Vec3, velocity: Vec3, delta: f32) -> Vec3 {
        let normal = self.normal[v];
        let across = normal * force.dot(normal);
        let speed = velocity.dot(normal) / (FULL_TANGENTIAL_SPEED * delta);
        across + (force - across) * (speed * speed).min(1.0)
    }

    /// Returns the difference π_I − Π(x) between the iso value and the intensity at a vertex, both normalised, for the
    /// image force; sampled at the mean position of the triangles at the vertex if the surface adapts to the image.
    #[inline]
    fn iso_difference(&mut self, v: usize, x: Vec3, image: &LevelImage, scale: &ForceScale) -> f32 {
        let p = if scale.adapts_to_image { self.mean_of_triangles(v, x) } else { x };
        let known = match image.bricks() {
            None => &mut self.cells[v],
            Some(_) => &mut CellCache::default(),
        };
        scale.iso - image.intensity(p, scale.outside, known)
    }

    /// Returns the image force, which moves a vertex along its normal n towards the iso-surface: f_I = δ α_I (π_I −
    /// Π(x)) n (7), with α_I multiplied by the level's gain, π_I the iso value and Π the intensity.
    #[inline]
    fn iso_force(&self, v: usize, iso_difference: f32, scale: &ForceScale) -> Vec3 {
        self.normal[v] * (scale.delta * scale.iso_force * iso_difference)
    }

    /// Returns the gradient force, which attracts a vertex to bright ridges: f_∇I = δ ((α_g − β_g)(∇Π·n) n + β_g ∇Π)
    /// (8), with n the normal and ∇Π the gradient of the intensity, bounded.
    fn gradient_force(&self, v: usize, x: Vec3, image: &LevelImage, scale: &ForceScale) -> Vec3 {
        let gradient = image.gradient(x, scale.gradient_bound);
        let normal = self.normal[v];
        (normal * (scale.gradient_across * gradient.dot(normal)) + gradient * scale.gradient_along)
            * scale.delta
    }
}

/// Returns the rest length d, in model units, of the edges as springs. [`RestLength::Mean`] gives 0 if the springs have
/// no stiffness, which saves computing the mean.
fn rest_length(rings: &[Ring], positions: &[Vec3], scale: &ForceScale) -> f32 {
    match scale.rest {
        RestLength::Zero => 0.0,
        RestLength::Given(length) => (length / scale.voxel) as f32,
        RestLength::Mean if scale.stiffness == 0.0 => 0.0,
        RestLength::Mean => {
            let (mut sum, mut count) = (0.0f64, 0usize);
            for (v, ring) in rings.iter().enumerate() {
                for w in ring.as_slice() {
                    sum += f64::from(positions[v].distance(positions[w.index()]));
                }
                count += ring.valence();
            }
            (sum / count.max(1) as f64) as f32
        }
    }
}

/// Returns the force of the edges of a vertex at x as springs, per unit of stiffness, f_e / α_e: the sum over its
/// neighbours y of (|y − x| − d)(y − x)/|y − x|, with the rest length d (6).
fn springs(ring: &Ring, positions: &[Vec3], x: Vec3, rest: f32) -> Vec3 {
    ring.as_slice().iter().fold(Vec3::ZERO, |sum, w| {
        let edge = positions[w.index()] - x;
        let length = edge.length();
        if length > 0.0 { sum + edge * ((length - rest) / length) } else { sum }
    })
}

/// Returns the force of an attractor at a position x in model space: a spring to the attractor's point that fades out
/// smoothly at its radius.
fn attraction(attractor: &LocalAttractor, x: Vec3) -> Vec3 {
    let offset = attractor.point - x;
    let far = (attractor.in_radii * offset).length_squared();
    if far >= 1.0 { Vec3::ZERO } else { offset * (attractor.strength * (1.0 - far) * (1.0 - far)) }
}
