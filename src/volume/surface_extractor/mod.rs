//! Surface-following marching cubes: extracts the zero set of an implicit function, evaluated only near the surface.
//!
//! Meant for functions that are expensive and best evaluated for many points at a time. A [`SurfaceExtractor`] starts
//! in the cells of its seeds and continues from cell to cell through the faces that the surface crosses (`flood`); a
//! coarse scan of the rest of the lattice finds components without a seed (`scan`); a few root-finding iterations along
//! its lattice edge move each vertex onto the surface (`root`). Work is done in slices of a given number of
//! evaluations, and the mesh found so far is available after each slice.
//!
//! Guarantees: cubes are triangulated as by [`marching_cubes`](super::marching_cubes), values of 0 and above are
//! inside, NaN and everything beyond the lattice are outside. So the mesh is closed, oriented, 2-manifold and free of
//! self-intersections for any function that always returns the same value at the same point. The mesh depends neither
//! on the slices nor on the order in which the surface was found. Every node evaluated by the flood is a corner of a
//! cell that the surface crosses, except for those around seeds off the surface.
//!
//! Limitation: a component that contains no seed and passes between the nodes of the scan is not found.

mod batch;
mod blocks;
mod flood;
mod root;
mod scan;
mod surface;
#[cfg(test)]
mod tests;

use super::VolumeError;
use crate::math::DVec3;
use crate::mesh::TriangleMesh;
use batch::Batch;
use blocks::{Blocks, Node};
use flood::Flood;
use scan::Scan;
use surface::Surface;

/// Largest number of lattice nodes along an axis: the table of blocks of a cubic lattice of this size takes 68 MB, and
/// of one twice as wide more than half a gigabyte.
pub const MAX_NODES: usize = 2048;
/// Largest distance of the lattice from the world's origin, in edge lengths of its cells: there, rounding to `f32`
/// moves a vertex by 1/2048 of an edge at most, and vertices keep 1/256 of an edge away from nodes. Much further away,
/// vertices coincide.
const MAX_EDGES_AWAY: f64 = 8192.0;
/// Smallest accepted edge length of the cells of a lattice, in world units: far below it, `f32` cannot distinguish
/// vertices.
const MIN_EDGE: f64 = 1e-30;

/// A regular lattice of cubes in world space on which [`SurfaceExtractor`] extracts a surface. Node (i, j, k) is at
/// origin + edge × (i, j, k).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// World position of node (0, 0, 0).
    pub origin: DVec3,
    /// Edge length of the cubes, in world units, at least 1e-30.
    pub edge: f64,
    /// Number of nodes along x, y and z, 1 to 2048 each.
    pub dims: [usize; 3],
}

impl Lattice {
    fn check(&self) -> Result<(), VolumeError> {
        let Self { origin, edge, dims } = self;
        if dims.iter().any(|n| !(1..=MAX_NODES).contains(n)) {
            let problem = format!("must be 1 to {MAX_NODES} nodes per axis, got {dims:?}");
            return Err(VolumeError::invalid("dims", problem));
        }
        if !(edge.is_finite() && *edge >= MIN_EDGE) {
            return Err(VolumeError::invalid(
                "edge",
                format!("must be finite and at least {MIN_EDGE}, got {edge}"),
            ));
        }
        let last = self.position(*dims);
        let furthest = origin.abs().max(last.abs()).max_element();
        if origin.is_finite() && furthest <= MAX_EDGES_AWAY * edge && furthest <= f64::from(f32::MAX) {
            return Ok(());
        }
        let problem =
            format!("the lattice must lie within {MAX_EDGES_AWAY} edges of the world origin, got {origin}");
        Err(VolumeError::invalid("origin", problem))
    }

    /// Returns the world position of a node of the padded lattice, whose node (1, 1, 1) is at the origin of the
    /// lattice.
    fn position(&self, node: Node) -> DVec3 {
        DVec3::from(std::array::from_fn(|k| self.coordinate(k, node[k] as f64 - 1.0)))
    }

    /// Returns the world position at a fraction of the way from a node of the padded lattice to the next along an axis.
    fn on_edge(&self, node: Node, axis: usize, fraction: f64) -> DVec3 {
        let mut p = self.position(node);
        p[axis] = self.coordinate(axis, node[axis] as f64 - 1.0 + fraction);
        p
    }

    fn coordinate(&self, axis: usize, steps: f64) -> f64 {
        self.origin[axis] + self.edge * steps
    }

    /// Returns the cell of the padded lattice that contains a world position; `None` if it is outside or not finite.
    fn cell(&self, p: DVec3) -> Option<Node> {
        let mut cell = [0; 3];
        for k in 0..3 {
            let at = ((p[k] - self.origin[k]) / self.edge).floor() + 1.0;
            if !(at >= 0.0 && at <= self.dims[k] as f64) {
                return None;
            }
            cell[k] = at as usize;
        }
        Some(cell)
    }
}

/// The stage of the extraction that requested the current batch of function values.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Task {
    Nothing,
    Wave,
    Scan,
    Refine,
}

/// Extractor of the zero set of an implicit function by surface-following marching cubes on a large lattice.
///
/// ```
/// use vesicle::math::DVec3;
/// use vesicle::volume::{Lattice, SurfaceExtractor};
///
/// let mut ball = |points: &[DVec3], values: &mut [f64]| {
///     values.iter_mut().zip(points).for_each(|(value, p)| *value = 1.0 - p.length());
/// };
/// let lattice = Lattice { origin: DVec3::splat(-1.5), edge: 0.1, dims: [31; 3] };
/// let mut extractor = SurfaceExtractor::new(lattice)?;
/// extractor.seed(DVec3::X);
/// extractor.scan(4)?;
/// extractor.refine(3);
/// while !extractor.advance(1000, &mut ball)? {}
/// assert_eq!(extractor.components_found_by_scan(), 0);
/// assert!(extractor.mesh()?.positions.iter().all(|p| (p.length() - 1.0).abs() < 4e-4));
/// # Ok::<(), vesicle::volume::VolumeError>(())
/// ```
pub struct SurfaceExtractor {
    lattice: Lattice,
    blocks: Blocks,
    flood: Flood,
    scan: Option<Scan>,
    /// Largest number of refinement steps, each of which evaluates the function once per vertex to move it onto the
    /// surface.
    refine_steps: usize,
    /// Number of refinement steps performed so far.
    refine_steps_done: usize,
    /// The surface during and after refinement; `None` before, when it is built from the crossed cells on demand.
    surface: Option<Surface>,
    batch: Batch,
    task: Task,
    waves: u32,
    evaluations: usize,
}

impl SurfaceExtractor {
    /// Creates an extractor without seeds.
    ///
    /// # Errors
    /// A lattice outside the ranges given for [`Lattice`], or further than 8192 edges from the world's origin, where
    /// `f32` positions are too coarse; [`VolumeError::TooLarge`].
    pub fn new(lattice: Lattice) -> Result<Self, VolumeError> {
        lattice.check()?;
        Ok(Self {
            lattice,
            blocks: Blocks::new(lattice.dims)?,
            flood: Flood::default(),
            scan: None,
            refine_steps: 0,
            refine_steps_done: 0,
            surface: None,
            batch: Batch::default(),
            task: Task::Nothing,
            waves: 0,
            evaluations: 0,
        })
    }

    /// Adds a seed, a point on or near the surface: extraction starts in the cell that contains `p`. If the surface is
    /// then found neither in that cell nor in one of its 26 neighbours, it starts in these neighbours, too.
    ///
    /// Returns false, and adds nothing, if `p` is more than one edge outside the lattice or not finite.
    pub fn seed(&mut self, p: DVec3) -> bool {
        let cell = self.lattice.cell(p);
        cell.into_iter().for_each(|cell| self.flood.seed(cell));
        cell.is_some()
    }

    /// Requests a scan of the whole lattice, after the surface around all seeds is extracted, for components that
    /// contain no seed. It tests the lattice lines between every `stride`-th node along each axis: components that
    /// cross a line an odd number of times are found and extracted, too.
    ///
    /// # Errors
    /// A stride of 0; [`VolumeError::TooLarge`].
    pub fn scan(&mut self, stride: usize) -> Result<(), VolumeError> {
        if stride == 0 {
            return Err(VolumeError::invalid("stride", "must be at least 1, got 0"));
        }
        let mut scan = Scan::new(stride, &self.blocks)?;
        scan.components_found = self.components_found_by_scan();
        self.scan = Some(scan);
        self.discard_batch_of(Task::Scan);
        Ok(())
    }

    /// Requests refinement of every vertex towards the zero of the function, by at most `steps` evaluations each, after
    /// all components are extracted. Without it, a vertex is placed by linear interpolation between the values at the
    /// ends of its edge.
    ///
    /// On a sphere of 45 edges radius the position error falls from 3e-3 edges to 2e-7 by one step, which is the
    /// resolution of `f32`, and to 4e-12 by two. A vertex takes no more steps once they would not move it, and stays
    /// 1/256 of an edge away from nodes.
    pub fn refine(&mut self, steps: usize) {
        self.refine_steps = steps;
    }

    /// Continues the extraction with at most `budget` function evaluations (0 counts as 1); returns true when the
    /// extraction is complete.
    ///
    /// `f` receives world positions and writes a value for each: 0 and above is inside, NaN outside. It must return the
    /// same value at the same point, whatever the other points of the call.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`]; the surface extracted so far is kept.
    pub fn advance(
        &mut self,
        budget: usize,
        f: &mut dyn FnMut(&[DVec3], &mut [f64]),
    ) -> Result<bool, VolumeError> {
        let mut left = budget.max(1);
        loop {
            let count = self.batch.evaluate(left, f);
            left -= count;
            self.evaluations += count;
            if !self.store_values()? {
                return Ok(false);
            }
            self.discard_batch_of(self.task);
            self.task = self.next_task()?;
            if self.task == Task::Nothing {
                return Ok(true);
            }
        }
    }

    /// Passes the function values of the batch to the stage that requested them; returns false if some are missing.
    fn store_values(&mut self) -> Result<bool, VolumeError> {
        let Some(values) = self.batch.values() else { return Ok(false) };
        match self.task {
            Task::Nothing => {}
            Task::Wave => {
                (self.surface, self.refine_steps_done, self.waves) = (None, 0, self.waves + 1);
                self.flood.store_values(values, &mut self.blocks)?;
            }
            Task::Scan => self.scan.iter_mut().for_each(|scan| scan.store_values(values, &self.blocks)),
            Task::Refine => {
                self.surface.iter_mut().for_each(|surface| surface.store_values(values));
                self.refine_steps_done += 1;
            }
        }
        Ok(true)
    }

    /// Selects the next stage and fills the batch with the points that it needs: first the flood, then the scan, then
    /// refinement.
    fn next_task(&mut self) -> Result<Task, VolumeError> {
        let Self { lattice, blocks, flood, batch, .. } = self;
        if flood.request(blocks, lattice, batch)? {
            return Ok(Task::Wave);
        }
        if let Some(scan) = &mut self.scan
            && scan.request(blocks, flood, lattice, batch)?
        {
            return Ok(Task::Scan);
        }
        if self.refine_steps_done >= self.refine_steps {
            return Ok(Task::Nothing);
        }
        let surface = match &mut self.surface {
            Some(surface) => surface,
            none => none.insert(Surface::new(&flood.crossed, blocks)?),
        };
        Ok(if surface.request(blocks, lattice, batch) { Task::Refine } else { Task::Nothing })
    }

    /// Discards the current batch of points if it was requested by `task`.
    fn discard_batch_of(&mut self, task: Task) {
        if self.task == task {
            self.batch.clear();
            self.task = Task::Nothing;
        }
    }

    /// Returns the surface extracted so far, in world space, triangles counter-clockwise seen from outside; vertices
    /// and triangles are in spatial order. The mesh is closed half an edge beyond the lattice, as by
    /// [`marching_cubes`](super::marching_cubes), and open where the extraction has to continue; a vertex there may
    /// belong to no triangle.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn mesh(&self) -> Result<TriangleMesh, VolumeError> {
        self.with_surface(|surface| surface.mesh(&self.blocks, &self.lattice))
    }

    /// Returns the vertex positions of [`Self::mesh`] in world space, before they are rounded to `f32`.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn vertices(&self) -> Result<Vec<DVec3>, VolumeError> {
        self.with_surface(|surface| {
            let positions = surface.positions(&self.blocks, &self.lattice);
            let mut vertices = super::error::reserve(positions.len())?;
            vertices.extend(positions);
            Ok(vertices)
        })
    }

    fn with_surface<T>(&self, read: impl Fn(&Surface) -> Result<T, VolumeError>) -> Result<T, VolumeError> {
        match &self.surface {
            Some(surface) => read(surface),
            None => read(&Surface::new(&self.flood.crossed, &self.blocks)?),
        }
    }

    /// Returns an estimate of the completed share of the work, from 0 to 1, for a progress bar; it is rough, since the
    /// extent of the surface is unknown until all of it is found. 0 before the first call of [`Self::advance`] and
    /// after the last.
    pub fn progress(&self) -> f64 {
        let share = self.batch.progress();
        let waves = f64::from(self.waves) + share;
        match self.task {
            Task::Nothing => 0.0,
            Task::Wave => 0.6 * waves / (waves + 2.0),
            Task::Scan => 0.6,
            Task::Refine => 0.6 + 0.4 * (self.refine_steps_done as f64 + share) / self.refine_steps as f64,
        }
    }

    /// Returns the number of components of the surface without a seed that the scan found; components that share a cell
    /// count as one.
    pub fn components_found_by_scan(&self) -> usize {
        self.scan.as_ref().map_or(0, |scan| scan.components_found)
    }

    /// Returns the number of lattice cells found so far that the surface crosses.
    pub fn crossed_cells(&self) -> usize {
        self.flood.crossed.len()
    }

    /// Returns the number of function evaluations so far, the main cost of the extraction.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Returns the memory of the function values at lattice nodes, in bytes: in proportion to the surface area, plus 4
    /// bytes for each block of 8³ nodes of the lattice.
    pub fn bytes(&self) -> usize {
        self.blocks.bytes()
    }
}
