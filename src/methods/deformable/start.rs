//! The surface a run starts from (section 3.6), made in the space of the model and resolved before the first step.

use super::contour::{ObjectIs, contour, placed, simplified};
use super::domain::{Domain, rounded_axes};
use super::image::LevelImage;
use super::{DeformableModel, contact};
use crate::math::{Bounds, DAffine3, DVec3, Vec3};
use crate::mesh::{Mesh, MeshError, TriangleMesh, count_crossings};
use crate::methods::MethodError;
use crate::methods::given::surface;
use crate::remesh::{Resolver, Sampling, TopologyGuide, Unguided, Waiting};
use crate::spatial::CellSet;
use crate::volume::marching_cubes;

/// What a run starts from; lengths and points in world units.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// The iso-surface at π_I of the coarsest level, outer and inner boundaries, less the parts that enclose less than
    /// [`super::DeformableParams::smallest_part`]. Where there is none: nothing, if finer levels are searched for parts, else the
    /// enclosing surface.
    Contour,
    /// A refined icosahedron around all of the image that is brighter than π_I; around the whole image where nothing is, or
    /// where the surface does not look for what is brighter.
    Enclosing,
    /// A grid of n³ small spheres that fills the image.
    Bubbles(u32),
    /// Spheres of one radius around points.
    Seeds {
        /// The centres.
        points: Vec<DVec3>,
        /// Their radius.
        radius: f64,
    },
    /// The iso-surface at an intensity.
    MarchingCubes(f64),
    /// A closed mesh that does not cross itself.
    Mesh(TriangleMesh),
}

/// What a start shape is made for.
pub(super) struct Frame<'a> {
    pub(super) image: &'a LevelImage,
    /// The intensity, normalised, of what an enclosing surface looks for.
    pub(super) brighter_than: Option<f32>,
    /// π_I, normalised, and on which side of it the object is.
    pub(super) iso: f32,
    pub(super) object: ObjectIs,
    /// The least volume of a closed part of the contour, in voxels of the finest level.
    pub(super) smallest_part: f64,
    /// Voxels of the finest level.
    pub(super) dims: [usize; 3],
    pub(super) domain: Domain,
    pub(super) from_world: DAffine3,
    /// World lengths of the voxel edges.
    pub(super) spacing: [f64; 3],
    pub(super) sampling: Sampling,
    /// Whether a contour without parts is the start: parts come with finer levels.
    pub(super) may_be_empty: bool,
}

impl Frame<'_> {
    fn most_vertices(&self) -> usize {
        self.domain.most_vertices(self.sampling.shortest())
    }
}

/// The smallest sphere in δ that has its edges within bounds as an icosahedron, with room for one that is hit.
const SMALLEST_RADIUS: f32 = 1.2;

/// Room between an object and the surface that encloses it, in δ.
const OBJECT_ROOM: f32 = 1.5;

/// Radius of a bubble as a share of its cell: neighbours stay further apart than contact reaches.
const BUBBLE_SHARE: f32 = 0.3;

/// Upper bound of a sphere's edges in δ: below 2.5 with a margin, and above √3 with one, so that one refinement
/// more does not fall below the lower bound.
const SPHERE_EDGE: f32 = 2.2;

/// The most bubbles along an axis and the most seeds: beyond them memory, not the method, is the limit.
const MOST_BUBBLES: u32 = 100;
const MOST_SEEDS: usize = 10_000;

/// Side of the cells around self-intersections of a resolved contour in which edits are tested in full, in longest edges.
const TESTED_CELL: f32 = 2.5;

/// Times that a contour is resolved with edits that are not all tested in full, before all are.
const MOST_RUNS: usize = 2;

/// Calls until the edges of a start mesh are within bounds; each refines a coarse mesh several times.
const MOST_CALLS: usize = 20;

impl Start {
    /// The start mesh with its edges within bounds, and no two parts in contact; for a contour, what replaces an empty one.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] where a sphere is too small for the sampling or two overlap, or the iso-surface
    /// is empty; [`MethodError::Mesh`] where the caller's mesh is open, not manifold or crosses itself.
    pub(super) fn make(
        &self,
        frame: &Frame,
        iso: impl Fn(f64) -> f32,
        guide: &dyn TopologyGuide,
    ) -> Result<Mesh, MethodError> {
        let mut mesh = match self {
            Self::Contour | Self::Enclosing => enclosing(frame)?,
            Self::Bubbles(n) => bubbles(frame, *n)?,
            Self::Seeds { points, radius } => seeds(frame, points, *radius)?,
            Self::MarchingCubes(value) => iso_surface(frame, iso(*value))?,
            Self::Mesh(mesh) => given(frame, mesh)?,
        };
        let mut resolver = resolve_all(&mut mesh, frame.most_vertices(), frame.sampling, guide)?;
        if !resolver.is_embedded(&mesh) {
            return Err(MeshError::SelfIntersecting { pairs: count_crossings(&mesh.to_triangles()) }.into());
        }
        Ok(mesh)
    }
}

impl DeformableModel {
    /// Brings the edges of the contour that the mesh is within bounds, on the finest level by the sizes that they should have. Edits hardly
    /// ever make it intersect itself, so most are not tested for that. All of it is at the end; what intersects is separated, or else
    /// the contour is resolved again with edits that are tested there.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`]; [`MethodError::Mesh`] if it intersects itself after all edits were tested.
    pub(super) fn resolve_contour(&mut self) -> Result<(), MethodError> {
        let contour = self.mesh.clone();
        let mut tested = CellSet::new(TESTED_CELL * self.sampling().longest());
        let mut runs = 0;
        loop {
            self.resolver.test_in((runs < MOST_RUNS).then(|| tested.clone()));
            let resolved = self.resolve_sized();
            // Without a contour to go back to, all edits are tested, also after an error.
            self.resolver.test_in(None);
            resolved?;
            let sampling = self.sampling();
            let guard = self.resolver.guard(&self.mesh, sampling);
            let crossing = guard.crossing(&self.mesh);
            if crossing.is_empty() || guard.separate(&mut self.mesh, &crossing) {
                self.rest.began_on_contour = self.from_contour;
                return Ok(());
            }
            if runs == MOST_RUNS {
                let pairs = count_crossings(&self.mesh.to_triangles());
                return Err(MeshError::SelfIntersecting { pairs }.into());
            }
            runs += 1;
            crossing.into_iter().for_each(|v| tested.add(self.mesh.position(v)));
            let intersecting = std::mem::replace(&mut self.mesh, contour.clone());
            self.mesh.count_on_from(&intersecting);
            self.resolver.set_waiting(Waiting::default());
            self.rest.sized = false;
        }
    }

    fn resolve_sized(&mut self) -> Result<(), MethodError> {
        self.resolve_everywhere()?;
        // A contour of the finest level is close to the result. Other starts are sized once they have settled.
        if self.level == 0 && self.set_sizes() {
            self.resolve_everywhere()?;
        }
        self.reorder();
        Ok(())
    }

    fn resolve_everywhere(&mut self) -> Result<(), MethodError> {
        let sampling = self.sampling();
        let guide = contact::guide(&self.pyramid.levels[self.level], self.level_iso, &self.params);
        resolve_with(&mut self.resolver, &mut self.mesh, sampling, &*guide)
    }
}

/// Brings the edges of a mesh within bounds, and what is in contact together.
fn resolve_all(
    mesh: &mut Mesh,
    most_vertices: usize,
    sampling: Sampling,
    guide: &dyn TopologyGuide,
) -> Result<Resolver, MethodError> {
    let mut resolver = Resolver::with_room_for(most_vertices);
    resolve_with(&mut resolver, mesh, sampling, guide)?;
    Ok(resolver)
}

fn resolve_with(
    resolver: &mut Resolver,
    mesh: &mut Mesh,
    sampling: Sampling,
    guide: &dyn TopologyGuide,
) -> Result<(), MethodError> {
    resolver.resolve_guided(mesh, sampling, &mesh.vertices().collect::<Vec<_>>(), guide);
    for _ in 0..MOST_CALLS {
        if !resolver.is_waiting() {
            break;
        }
        resolver.resolve_guided(mesh, sampling, &[], guide);
    }
    if let Some(most) = resolver.take_overflow() {
        return Err(MethodError::TooManyVertices { most });
    }
    resolver.sweep(mesh, sampling, guide);
    Ok(())
}

/// A rounded box around the object, |x/a|⁴ + |y/b|⁴ + |z/c|⁴ = 1, or around the whole image.
///
/// It is refined from an icosahedron, each level pulled onto the shape and resolved: a fine icosahedron squashed onto
/// a flat box would have triangles that no edit can mend.
fn enclosing(frame: &Frame) -> Result<Mesh, MethodError> {
    let delta = frame.sampling.shortest();
    let most = frame.most_vertices();
    if frame.domain.enclosing_vertices(delta) > most {
        return Err(MethodError::TooManyVertices { most });
    }
    let (centre, axes) = around_object(frame).unwrap_or((frame.domain.centre, frame.domain.axes));
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
            _ = resolve_all(&mut mesh, most, Sampling::new(delta), &Unguided)?;
        }
    }
    Ok(mesh)
}

/// Centre and half axes of a rounded box around all of the object, in the proportions of the box around it. `None` where
/// there is no object.
fn around_object(frame: &Frame) -> Option<(Vec3, Vec3)> {
    let ends = frame.image.ends_of_rows(frame.brighter_than?);
    let Bounds { min, max } = Bounds::of(&ends);
    if ends.is_empty() {
        return None;
    }
    let delta = frame.sampling.shortest();
    let centre = (min + max) * 0.5;
    let axes = rounded_axes((max - min) * 0.5 + OBJECT_ROOM * delta, delta);
    let furthest = ends.iter().fold(1.0f32, |furthest, &p| {
        let far = rounded_distance((p - centre) / (axes - OBJECT_ROOM * delta));
        if far > furthest { far } else { furthest }
    });
    Some((centre, axes * furthest))
}

/// The fourth root of x⁴ + y⁴ + z⁴.
fn rounded_distance(p: Vec3) -> f32 {
    let square = p * p;
    (square * square).element_sum().sqrt().sqrt()
}

fn sphere(frame: &Frame, centre: Vec3, radius: f32) -> Result<Mesh, MeshError> {
    Mesh::icosphere(centre, radius, SPHERE_EDGE * frame.sampling.shortest())
}

fn bubbles(frame: &Frame, n: u32) -> Result<Mesh, MethodError> {
    let smallest_axis = frame.dims.into_iter().min().unwrap_or(1) as f32;
    let fitting = (smallest_axis * BUBBLE_SHARE / (SMALLEST_RADIUS * frame.sampling.shortest())) as u32;
    let most = fitting.min(MOST_BUBBLES);
    if n == 0 || n > most {
        let hint = if most == 0 {
            "none fits: take fewer pyramid levels or shorter edges".into()
        } else {
            format!("1 to {most} fit this image and sampling")
        };
        return Err(MethodError::invalid("start.bubbles", format!("{n} given, {hint}")));
    }
    let cell = Vec3::from(frame.dims.map(|m| m as f32 / n as f32));
    let radius = BUBBLE_SHARE * cell.min_element();
    let mut mesh = Mesh::default();
    for k in 0..n * n * n {
        let at = Vec3::new((k % n) as f32, (k / n % n) as f32, (k / n / n) as f32);
        mesh.append(&sphere(frame, (at + 0.5) * cell - 0.5, radius)?)?;
    }
    Ok(mesh)
}

fn seeds(frame: &Frame, points: &[DVec3], radius: f64) -> Result<Mesh, MethodError> {
    if points.is_empty() || points.len() > MOST_SEEDS {
        let problem = format!("{} points given, 1 to {MOST_SEEDS} accepted", points.len());
        return Err(MethodError::invalid("start.seeds", problem));
    }
    let ball = world_ball(frame, radius)?;
    let reach = Bounds::of(ball.positions());
    let room = frame.domain.bounds;
    let centres: Vec<Vec3> = points.iter().map(|p| frame.from_world.transform_point3(*p).as_vec3()).collect();
    let fits = |&c: &Vec3| room.contains(reach.min + c) && room.contains(reach.max + c);
    if let Some(i) = centres.iter().position(|c| !fits(c)) {
        let problem = format!("the sphere at point {i}, {}, is not in or near the image", points[i]);
        return Err(MethodError::invalid("start.seeds", problem));
    }
    let apart = 2.0 * radius + f64::from(frame.sampling.contact()) * largest(frame.spacing);
    let mut mesh = Mesh::default();
    for (i, point) in points.iter().enumerate() {
        if let Some(j) = points[..i].iter().position(|other| other.distance(*point) < apart) {
            let problem = format!("points {j} and {i} are too near: spheres of radius {radius} would touch");
            return Err(MethodError::invalid("start.seeds", problem));
        }
        let mut there = ball.clone();
        there.positions_mut().iter_mut().for_each(|p| *p += centres[i]);
        mesh.append(&there)?;
    }
    Ok(mesh)
}

/// A sphere around the origin of the world, in the space of the model without its translation: an ellipsoid where
/// voxels are not cubes.
fn world_ball(frame: &Frame, radius: f64) -> Result<Mesh, MethodError> {
    let least = f64::from(SMALLEST_RADIUS * frame.sampling.shortest()) * largest(frame.spacing);
    let most =
        f64::from((frame.domain.bounds.max - frame.domain.bounds.min).max_element()) * largest(frame.spacing);
    if !(radius >= least && radius <= most) {
        let problem = format!(
            "{radius} given, {least:.3} to {most:.3} accepted (smaller ones with fewer pyramid levels or shorter edges)"
        );
        return Err(MethodError::invalid("start.radius", problem));
    }
    let shortest = frame.spacing.into_iter().fold(f64::INFINITY, f64::min);
    let edge = f64::from(SPHERE_EDGE * frame.sampling.shortest()) * shortest / radius;
    let mut ball = Mesh::icosphere(Vec3::ZERO, 1.0, edge as f32)?.to_triangles();
    let turned = |p: Vec3| frame.from_world.transform_vector3(p.as_dvec3() * radius).as_vec3();
    ball.positions.iter_mut().for_each(|p| *p = turned(*p));
    if frame.from_world.matrix3.determinant() < 0.0 {
        ball.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Ok(Mesh::from_triangles(&ball)?)
}

fn largest(spacing: [f64; 3]) -> f64 {
    spacing.into_iter().fold(0.0, f64::max)
}

/// The contour that the model looks for, of the level it starts on; `None` where there is none, and finer levels are not searched.
pub(super) fn on_contour(frame: &Frame) -> Result<Option<Mesh>, MethodError> {
    let surface = contour(frame.image, frame.iso, frame.object, frame.smallest_part)?;
    if surface.triangles.is_empty() {
        return Ok(frame.may_be_empty.then(Mesh::default));
    }
    let surface = simplified(surface, frame.image, frame.sampling.shortest());
    Ok(Some(Mesh::from_triangles(&surface)?))
}

fn iso_surface(frame: &Frame, iso: f32) -> Result<Mesh, MethodError> {
    let (grid, position) = frame.image.grid();
    let surface = marching_cubes(grid, iso)?;
    if surface.triangles.is_empty() {
        return Err(MethodError::invalid(
            "start.marchingCubes",
            "the image has no surface at this intensity",
        ));
    }
    Ok(Mesh::from_triangles(&placed(surface, position))?)
}

fn given(frame: &Frame, mesh: &TriangleMesh) -> Result<Mesh, MethodError> {
    let local = mesh.transformed(&frame.from_world);
    if let Some(far) = local.positions.iter().position(|&p| !frame.domain.bounds.contains(p)) {
        let problem = format!("vertex {far} at {} is not in or near the image", mesh.positions[far]);
        return Err(MethodError::invalid("start.mesh", problem));
    }
    surface("start.mesh", &local)
}
