//! Start surfaces (section 3.6): made in model space, with their edges brought within bounds before the first step.

use super::contour::{ContourRule, ObjectIs, contour, contour_in_slices, placed, simplified};
use super::domain::{Domain, rounded_axes};
use super::image::{LevelImage, Pyramid};
use super::{DeformableModel, DeformableParams, Seeding, coarse, image_guide};
use crate::math::{Bounds, DAffine3, DVec3, Vec3};
use crate::mesh::{Mesh, MeshError, TriangleMesh, count_self_intersections};
use crate::methods::MethodError;
use crate::methods::caller_mesh::checked_mesh;
use crate::pauses::Pauses;
use crate::remesh::{Pending, Resolver, Sampling, TopologyGuide, Unguided};
use crate::spatial::CellSet;

/// The start surface of a run; lengths and points are in world space.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// The iso-surface at π_I on the coarsest level, outer and inner boundaries, without parts that enclose less than
    /// [`super::DeformableParams::smallest_part`]. If it is empty, the mesh is empty, too, if the model adapts to the
    /// image and seeds missing parts; otherwise the enclosing surface is used.
    Contour,
    /// A rounded box around all voxels of the coarsest level brighter than π_I, or an intensity a little below it if
    /// that level is not the volume itself; around the whole image if there are none, or if α_I is not negative.
    Enclosing,
    /// A grid of n³ small spheres that fills the image.
    Bubbles(u32),
    /// Spheres of equal radius around given points.
    Seeds {
        /// The centres of the spheres in world space.
        points: Vec<DVec3>,
        /// The radius of all spheres in world units.
        radius: f64,
    },
    /// The iso-surface of the coarsest level at this intensity, in the volume's units, with the brighter side inside.
    MarchingCubes(f64),
    /// A closed mesh of the caller in world space, without self-intersections, its triangles counter-clockwise seen
    /// from outside.
    Mesh(TriangleMesh),
}

/// The image and the sampling that a start surface is made for.
pub(super) struct StartContext<'a> {
    pub(super) image: &'a LevelImage,
    /// The normalised intensity above which voxels are enclosed by [`Start::Enclosing`]; `None` if α_I, the strength of
    /// the image force, is not negative.
    pub(super) brighter_than: Option<f32>,
    /// The iso value π_I, normalised to the range of the volume.
    pub(super) iso: f32,
    /// The side of the iso value π_I on which the object is.
    pub(super) object: ObjectIs,
    /// The least volume, in model units, of a closed part of the contour; smaller ones are left out.
    pub(super) smallest_part: f64,
    /// The dimensions of the finest level in model units.
    pub(super) dims: [usize; 3],
    pub(super) domain: Domain,
    pub(super) from_world: DAffine3,
    /// The lengths of a model unit along the axes, in world units.
    pub(super) spacing: [f64; 3],
    pub(super) sampling: Sampling,
    /// Whether an empty contour gives an empty start mesh, since missing parts are seeded later, instead of the
    /// enclosing surface.
    pub(super) may_be_empty: bool,
}

impl<'a> StartContext<'a> {
    /// Returns the context of a start on the coarsest level of a pyramid, where the lower edge bound is `delta`.
    pub(super) fn of(
        pyramid: &'a Pyramid,
        params: &DeformableParams,
        domain: Domain,
        delta: f32,
        to_world: &DAffine3,
    ) -> Self {
        let level = pyramid.levels.len() - 1;
        let seeds = !pyramid.is_sparse() && params.seeding != Seeding::Off;
        Self {
            image: &pyramid.levels[level],
            brighter_than: (params.iso_force < 0.0).then(|| coarse::iso(pyramid, params, level)),
            iso: pyramid.iso(params),
            object: ObjectIs::by(params),
            smallest_part: params.smallest_part * pyramid.voxel(),
            dims: pyramid.dims(),
            domain,
            from_world: to_world.inverse(),
            spacing: pyramid.spacing(),
            sampling: Sampling::new(delta),
            may_be_empty: params.adapts_to_image() && seeds,
        }
    }

    fn rule(&self) -> ContourRule {
        let most = self.domain.most_triangles();
        ContourRule { iso: self.iso, object: self.object, smallest_part: self.smallest_part, most }
    }

    /// Returns the mesh of a contour whose edges are still to be brought within bounds.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`] if it has more than twice the vertices that a surface may have: edits remove half
    /// of those of a contour, or more. [`MethodError::Mesh`].
    fn mesh_of(&self, contour: &TriangleMesh) -> Result<Mesh, MethodError> {
        let most = self.domain.max_vertices;
        if contour.positions.len() > 2 * most {
            return Err(MethodError::TooManyVertices { most });
        }
        Ok(Mesh::from_triangles(contour)?)
    }

    fn most_vertices(&self) -> usize {
        self.domain.most_vertices(self.sampling.shortest())
    }
}

/// The smallest radius of a start sphere, in δ: an icosahedron of this radius has its edges within the edge bounds,
/// with a margin.
const SMALLEST_RADIUS: f32 = 1.2;

/// The distance between an object and the enclosing start surface around it, in δ.
const OBJECT_MARGIN: f32 = 1.5;

/// The radius of a bubble, a sphere of [`Start::Bubbles`], as a share of the smallest side of its grid cell; with it,
/// neighbours are further apart than the contact distance.
const BUBBLE_SHARE: f32 = 0.3;

/// The longest edge of a start sphere in δ: well below the upper edge bound 2.5, and well above √3, so that one more
/// refinement does not make edges shorter than the lower bound.
const SPHERE_EDGE: f32 = 2.2;

/// The largest number of bubbles, spheres of [`Start::Bubbles`], along an axis: with more, memory, not the method, is
/// the limit.
const MAX_BUBBLES: u32 = 100;
/// The largest number of start spheres at given points: with more, memory, not the method, is the limit.
const MAX_SEEDS: usize = 10_000;

/// The side, as a multiple of the longest edge allowed, of the cells that mark where a contour intersects itself after
/// its edges were brought within bounds; when that is repeated, edits in these cells are tested in full.
const TESTED_CELL: f32 = 2.5;

/// The number of attempts to bring a contour within edge bounds with some edits not tested in full for
/// self-intersections; in the attempt after these, all edits are.
const MAX_RUNS: usize = 2;

/// The largest number of resolver calls, after the first, that bring the edges of a start mesh within bounds; each
/// refines a coarse mesh several times.
const MAX_CALLS: usize = 20;

impl Start {
    /// Makes the start mesh on the coarsest level, with its edges within bounds and its contacts resolved. For
    /// [`Start::Contour`] that is the enclosing surface, the replacement for an empty contour.
    ///
    /// `iso` normalises an intensity of the volume; `guide` decides which topology changes are allowed.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if a number is out of range, spheres or the caller's mesh are out of the
    /// domain, spheres in contact, the caller's mesh empty or inside out, or the iso-surface is empty;
    /// [`MethodError::TooManyVertices`]; [`MethodError::Mesh`] if the caller's mesh is open, not manifold or intersects
    /// itself, or the result does; [`MethodError::Volume`] if memory does not suffice.
    pub(super) async fn make(
        &self,
        context: &StartContext<'_>,
        iso: impl Fn(f64) -> f32,
        guide: &dyn TopologyGuide,
        pauses: &Pauses,
    ) -> Result<Mesh, MethodError> {
        let mut mesh = match self {
            Self::Contour | Self::Enclosing => enclosing(context, pauses).await?,
            Self::Bubbles(n) => bubble_grid(context, *n)?,
            Self::Seeds { points, radius } => spheres_at(context, points, *radius)?,
            Self::MarchingCubes(value) => iso_surface(context, iso(*value), pauses).await?,
            Self::Mesh(mesh) => caller_mesh(context, mesh, pauses).await?,
        };
        let most = context.most_vertices();
        let mut resolver = resolve_all(&mut mesh, most, context.sampling, guide, pauses).await?;
        if !resolver.is_embedded(&mesh) {
            return Err(MeshError::SelfIntersecting {
                pairs: count_self_intersections(&mesh.to_triangles()),
            }
            .into());
        }
        Ok(mesh)
    }
}

impl DeformableModel {
    /// Brings the edges of the mesh, a contour, within bounds, with sizes by curvature on the finest level; used for
    /// the start and for renewed components.
    ///
    /// Edits hardly ever cause self-intersections, so most are tested in one-rings only, and the whole mesh is tested
    /// at the end. Intersecting parts are separated; if that fails, the contour is resolved again with edits near them
    /// tested in full.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`]; [`MethodError::Mesh`] if it intersects itself after all edits were tested.
    pub(super) async fn resolve_contour(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        let contour = self.mesh.clone();
        let mut tested = CellSet::new(TESTED_CELL * self.sampling().longest());
        let mut runs = 0;
        loop {
            self.resolver.set_tested_cells((runs < MAX_RUNS).then(|| tested.clone()));
            let resolved = self.resolve_sized(pauses).await;
            // Later calls have no contour to return to, so all their edits are tested, also after an error.
            self.resolver.set_tested_cells(None);
            resolved?;
            // A contour has more before its edits, which add none.
            let most = self.domain.max_vertices;
            if self.mesh.vertex_count() > most {
                return Err(MethodError::TooManyVertices { most });
            }
            let sampling = self.sampling();
            let guard = self.resolver.embedding(&self.mesh, sampling);
            let intersecting = guard.intersecting_vertices_in_slices(&self.mesh, pauses).await;
            if intersecting.is_empty() || guard.separate(&mut self.mesh, &intersecting, pauses).await {
                self.convergence.began_on_contour = self.from_contour;
                return Ok(());
            }
            if runs == MAX_RUNS {
                let pairs = count_self_intersections(&self.mesh.to_triangles());
                return Err(MeshError::SelfIntersecting { pairs }.into());
            }
            runs += 1;
            intersecting.into_iter().for_each(|v| tested.insert_around(self.mesh.position(v)));
            let failed = std::mem::replace(&mut self.mesh, contour.clone());
            self.mesh.advance_versions_past(&failed);
            self.resolver.set_pending(Pending::default());
            self.convergence.sized = false;
        }
    }

    async fn resolve_sized(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        let all: Vec<_> = self.mesh.vertices().collect();
        self.set_sizes_of_small_parts(&all, pauses).await;
        self.resolve_everywhere(pauses).await?;
        // A contour of the finest level is close to the result. Other starts are sized once they have settled.
        if self.level == 0 && self.set_sizes(pauses).await {
            self.resolve_everywhere(pauses).await?;
        }
        self.reorder();
        Ok(())
    }

    async fn resolve_everywhere(&mut self, pauses: &Pauses) -> Result<(), MethodError> {
        let sampling = self.sampling();
        let guide = image_guide::guide(&self.pyramid.levels[self.level], self.level_iso, &self.params);
        resolve_with(&mut self.resolver, &mut self.mesh, sampling, &*guide, pauses).await
    }
}

/// Brings the edges of a mesh within bounds and resolves its contacts, with a new resolver, which is returned.
async fn resolve_all(
    mesh: &mut Mesh,
    most_vertices: usize,
    sampling: Sampling,
    guide: &dyn TopologyGuide,
    pauses: &Pauses,
) -> Result<Resolver, MethodError> {
    let mut resolver = Resolver::with_max_vertices(most_vertices);
    resolve_with(&mut resolver, mesh, sampling, guide, pauses).await?;
    Ok(resolver)
}

async fn resolve_with(
    resolver: &mut Resolver,
    mesh: &mut Mesh,
    sampling: Sampling,
    guide: &dyn TopologyGuide,
    pauses: &Pauses,
) -> Result<(), MethodError> {
    let all: Vec<_> = mesh.vertices().collect();
    resolver.resolve_in_slices(mesh, sampling, &all, guide, pauses).await;
    for _ in 0..MAX_CALLS {
        if !resolver.has_pending_edges() {
            break;
        }
        resolver.resolve_in_slices(mesh, sampling, &[], guide, pauses).await;
    }
    if let Some(most) = resolver.take_overflow() {
        return Err(MethodError::TooManyVertices { most });
    }
    resolver.remove_negligible(mesh, sampling, guide, pauses).await;
    Ok(())
}

/// Makes the surface of [`Start::Enclosing`]: a rounded box, |x/a|⁴ + |y/b|⁴ + |z/c|⁴ = 1, around the object or the
/// whole image.
///
/// An icosahedron is refined, and after each refinement projected onto the box and its edges brought within bounds: a
/// fine icosahedron squashed onto a flat box would have triangles that no edit can repair.
async fn enclosing(context: &StartContext<'_>, pauses: &Pauses) -> Result<Mesh, MethodError> {
    let delta = context.sampling.shortest();
    let most = context.most_vertices();
    if context.domain.enclosing_vertices(delta) > most {
        return Err(MethodError::TooManyVertices { most });
    }
    let (centre, axes) = around_object(context).unwrap_or((context.domain.centre, context.domain.axes));
    let onto_box = |p: Vec3| {
        let unit = (p - centre) / axes;
        centre + unit / rounded_distance(unit) * axes
    };
    let mut mesh = Mesh::icosahedron(Vec3::ZERO, 1.0);
    mesh.positions_mut().iter_mut().for_each(|p| *p = onto_box(centre + *p * axes));
    let mut coarse = vec![delta];
    while Sampling::new(coarse[coarse.len() - 1]).longest() < mesh.longest_edge() {
        coarse.push(coarse[coarse.len() - 1] * super::image::REDUCTION as f32);
    }
    for &delta in coarse.iter().rev().skip(1) {
        mesh.refine()?;
        let slots: Vec<_> = mesh.vertices().collect();
        slots.into_iter().for_each(|v| mesh.set_position(v, onto_box(mesh.position(v))));
        if 3.0 * delta < axes.min_element() {
            _ = resolve_all(&mut mesh, most, Sampling::new(delta), &Unguided, pauses).await?;
        }
    }
    Ok(mesh)
}

/// Returns the centre and the half axes, in model space, of a rounded box around all of the object, with the
/// proportions of its bounding box and a margin of [`OBJECT_MARGIN`], for the enclosing start surface; `None` if there
/// is no object.
fn around_object(context: &StartContext) -> Option<(Vec3, Vec3)> {
    let ends = context.image.ends_of_rows(context.brighter_than?);
    let Bounds { min, max } = Bounds::from_points(&ends);
    if ends.is_empty() {
        return None;
    }
    let delta = context.sampling.shortest();
    let centre = (min + max) * 0.5;
    let axes = rounded_axes((max - min) * 0.5 + OBJECT_MARGIN * delta, delta);
    let scale = ends.iter().fold(1.0f32, |scale, &p| {
        let far = rounded_distance((p - centre) / (axes - OBJECT_MARGIN * delta));
        if far > scale { far } else { scale }
    });
    Some((centre, axes * scale))
}

/// Returns the fourth root of x⁴ + y⁴ + z⁴: 1 on the unit rounded box, less inside and more outside; points divided by
/// it are projected onto the box.
fn rounded_distance(p: Vec3) -> f32 {
    let square = p * p;
    (square * square).element_sum().sqrt().sqrt()
}

fn sphere(context: &StartContext, centre: Vec3, radius: f32) -> Result<Mesh, MeshError> {
    Mesh::icosphere(centre, radius, SPHERE_EDGE * context.sampling.shortest())
}

fn bubble_grid(context: &StartContext, n: u32) -> Result<Mesh, MethodError> {
    let smallest_axis = context.dims.into_iter().min().unwrap_or(1) as f32;
    let fitting = (smallest_axis * BUBBLE_SHARE / (SMALLEST_RADIUS * context.sampling.shortest())) as u32;
    let most = fitting.min(MAX_BUBBLES);
    if n == 0 || n > most {
        let problem = if most == 0 {
            "no bubble fits: reduce pyramid levels or edge length".into()
        } else {
            format!("must be from 1 to {most} for this image and sampling, got {n}")
        };
        return Err(MethodError::invalid("start.bubbles", problem));
    }
    let cell = Vec3::from(context.dims.map(|m| m as f32 / n as f32));
    let radius = BUBBLE_SHARE * cell.min_element();
    let mut mesh = Mesh::default();
    for k in 0..n * n * n {
        let at = Vec3::new((k % n) as f32, (k / n % n) as f32, (k / n / n) as f32);
        mesh.append(&sphere(context, (at + 0.5) * cell - 0.5, radius)?)?;
    }
    Ok(mesh)
}

fn spheres_at(context: &StartContext, points: &[DVec3], radius: f64) -> Result<Mesh, MethodError> {
    if points.is_empty() || points.len() > MAX_SEEDS {
        let problem = format!("must be from 1 to {MAX_SEEDS} points, got {}", points.len());
        return Err(MethodError::invalid("start.seeds", problem));
    }
    let ball = world_ball(context, radius)?;
    let ball_bounds = Bounds::from_points(ball.positions());
    let domain_bounds = context.domain.bounds;
    let centres: Vec<Vec3> =
        points.iter().map(|p| context.from_world.transform_point3(*p).as_vec3()).collect();
    let fits = |&c: &Vec3| {
        domain_bounds.contains(ball_bounds.min + c) && domain_bounds.contains(ball_bounds.max + c)
    };
    if let Some(i) = centres.iter().position(|c| !fits(c)) {
        let problem = format!("the sphere at point {i}, {}, is outside the image's domain", points[i]);
        return Err(MethodError::invalid("start.seeds", problem));
    }
    let min_distance = 2.0 * radius + f64::from(context.sampling.contact()) * largest(context.spacing);
    let mut mesh = Mesh::default();
    for (i, point) in points.iter().enumerate() {
        if let Some(j) = points[..i].iter().position(|other| other.distance(*point) < min_distance) {
            let problem =
                format!("points {j} and {i} are too close: spheres of radius {radius} would be in contact");
            return Err(MethodError::invalid("start.seeds", problem));
        }
        let mut copy = ball.clone();
        copy.positions_mut().iter_mut().for_each(|p| *p += centres[i]);
        mesh.append(&copy)?;
    }
    Ok(mesh)
}

/// Makes a sphere of a radius in world units around the origin, to be copied to the points of [`Start::Seeds`], and
/// maps it to model space without translation; it is an ellipsoid there if voxels are not cubes.
fn world_ball(context: &StartContext, radius: f64) -> Result<Mesh, MethodError> {
    let least = f64::from(SMALLEST_RADIUS * context.sampling.shortest()) * largest(context.spacing);
    let most = f64::from((context.domain.bounds.max - context.domain.bounds.min).max_element())
        * largest(context.spacing);
    if !(radius >= least && radius <= most) {
        let problem = format!(
            "must be from {least:.3} to {most:.3}, got {radius} (use fewer pyramid levels or shorter edges for smaller spheres)"
        );
        return Err(MethodError::invalid("start.radius", problem));
    }
    let shortest = context.spacing.into_iter().fold(f64::INFINITY, f64::min);
    let edge = f64::from(SPHERE_EDGE * context.sampling.shortest()) * shortest / radius;
    let mut ball = Mesh::icosphere(Vec3::ZERO, 1.0, edge as f32)?.to_triangles();
    let to_model = |p: Vec3| context.from_world.transform_vector3(p.as_dvec3() * radius).as_vec3();
    ball.positions.iter_mut().for_each(|p| *p = to_model(*p));
    if context.from_world.matrix3.determinant() < 0.0 {
        ball.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Ok(Mesh::from_triangles(&ball)?)
}

fn largest(spacing: [f64; 3]) -> f64 {
    spacing.into_iter().fold(0.0, f64::max)
}

/// Makes the simplified contour at the iso value π_I of the start level, for [`DeformableModel::resolve_contour`]. If
/// it is empty: an empty mesh if [`StartContext::may_be_empty`], else `None`.
pub(super) async fn contour_mesh(
    context: &StartContext<'_>,
    pauses: &Pauses,
) -> Result<Option<Mesh>, MethodError> {
    let surface = contour(context.image, context.rule(), pauses).await?;
    pauses.now().await;
    if surface.triangles.is_empty() {
        return Ok(context.may_be_empty.then(Mesh::default));
    }
    let surface = simplified(surface, context.image, context.sampling.shortest(), pauses).await;
    pauses.now().await;
    Ok(Some(context.mesh_of(&surface)?))
}

async fn iso_surface(context: &StartContext<'_>, iso: f32, pauses: &Pauses) -> Result<Mesh, MethodError> {
    let (grid, position) = context.image.part_grid();
    let rule = ContourRule { iso, object: ObjectIs::Brighter, ..context.rule() };
    let surface = contour_in_slices(&grid, rule, pauses).await?;
    if surface.triangles.is_empty() {
        return Err(MethodError::invalid(
            "start.marchingCubes",
            "the image has no surface at this intensity",
        ));
    }
    context.mesh_of(&placed(surface, position))
}

async fn caller_mesh(
    context: &StartContext<'_>,
    mesh: &TriangleMesh,
    pauses: &Pauses,
) -> Result<Mesh, MethodError> {
    let local = mesh.transformed(&context.from_world);
    if let Some(far) = local.positions.iter().position(|&p| !context.domain.bounds.contains(p)) {
        let problem = format!("vertex {far} at {} is outside the image's domain", mesh.positions[far]);
        return Err(MethodError::invalid("start.mesh", problem));
    }
    checked_mesh("start.mesh", &local, pauses).await
}
