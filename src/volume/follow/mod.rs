//! Marching cubes that follows a surface: the zero set of a function, evaluated only near it.
//!
//! For functions that are dear and best evaluated many points at a time. A [`Follower`] starts in the cells of its
//! seeds and goes from cell to cell through the faces that the surface crosses (`flood`); a coarse look at the rest of
//! the lattice finds pieces without a seed (`scan`); a few steps along its lattice edge bring each vertex onto the
//! surface (`root`). It goes on in slices of as many evaluations as the caller likes, with a mesh of what there is so
//! far after each.
//!
//! What holds: cubes are filled as by [`marching_cubes`](super::marching_cubes), values of 0 and above are inside,
//! NaN and all beyond the lattice outside. So the mesh is closed, oriented, 2-manifold and free of crossings
//! whatever the function, provided that it always gives the same value at the same point. The mesh depends neither on
//! the slices nor on the order in which the surface was found. Every node evaluated by the flood, but for those
//! around seeds that lie off the surface, is a corner of a cell that the surface crosses.
//!
//! What does not: a piece that no seed leads to, and that passes between the nodes of the scan, is not found.

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

/// Nodes along an axis: the table of blocks of such a cube takes 68 MB, and of one twice as wide more than half a
/// gigabyte.
const MAX_NODES: usize = 2048;
/// Edges from the world's origin: there rounding to `f32` moves a vertex by 1/2048 of an edge at most, and vertices keep
/// 1/256 away from nodes. Much further, and vertices fall together.
const MAX_EDGES_AWAY: f64 = 8192.0;
/// Far below it, `f32` has too few digits left to tell vertices apart.
const MIN_EDGE: f64 = 1e-30;

/// A lattice of cubes in the world. Node (i, j, k) stands at origin + edge × (i, j, k).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Where node (0, 0, 0) stands.
    pub origin: DVec3,
    /// From a node to the next, in world units.
    pub edge: f64,
    /// Nodes along x, y and z, 1 to 2048 each.
    pub dims: [usize; 3],
}

impl Lattice {
    fn check(&self) -> Result<(), VolumeError> {
        let Self { origin, edge, dims } = self;
        if dims.iter().any(|n| !(1..=MAX_NODES).contains(n)) {
            let problem = format!("{dims:?} given; 1 to {MAX_NODES} nodes along each axis are accepted");
            return Err(VolumeError::invalid("dims", problem));
        }
        if !(edge.is_finite() && *edge >= MIN_EDGE) {
            return Err(VolumeError::invalid(
                "edge",
                format!("{edge} given; a length of at least {MIN_EDGE} is needed"),
            ));
        }
        let last = self.position(*dims);
        let furthest = origin.abs().max(last.abs()).max_element();
        if origin.is_finite() && furthest <= MAX_EDGES_AWAY * edge && furthest <= f64::from(f32::MAX) {
            return Ok(());
        }
        let problem = format!(
            "{origin} given; the lattice must lie within {MAX_EDGES_AWAY} edges of the world's origin"
        );
        Err(VolumeError::invalid("origin", problem))
    }

    /// Where a node of the padded lattice stands.
    fn position(&self, node: Node) -> DVec3 {
        DVec3::from(std::array::from_fn(|k| self.coordinate(k, node[k] as f64 - 1.0)))
    }

    /// The point at a fraction of the way from a node of the padded lattice to the next along an axis.
    fn on_edge(&self, node: Node, axis: usize, fraction: f64) -> DVec3 {
        let mut p = self.position(node);
        p[axis] = self.coordinate(axis, node[axis] as f64 - 1.0 + fraction);
        p
    }

    fn coordinate(&self, axis: usize, steps: f64) -> f64 {
        self.origin[axis] + self.edge * steps
    }

    /// The padded lattice's cell with a point in it.
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

/// What the present batch of values is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Task {
    Nothing,
    Wave,
    Scan,
    Refine,
}

/// The surface where a function passes 0, followed cell by cell over a large lattice.
///
/// ```
/// use vesicle::math::DVec3;
/// use vesicle::volume::{Follower, Lattice};
///
/// let mut ball = |points: &[DVec3], values: &mut [f64]| {
///     values.iter_mut().zip(points).for_each(|(value, p)| *value = 1.0 - p.length());
/// };
/// let lattice = Lattice { origin: DVec3::splat(-1.5), edge: 0.1, dims: [31; 3] };
/// let mut follower = Follower::new(lattice)?;
/// follower.seed(DVec3::X);
/// follower.scan(4)?;
/// follower.refine(3);
/// while !follower.advance(1000, &mut ball)? {}
/// assert_eq!(follower.found_by_scan(), 0);
/// assert!(follower.mesh()?.positions.iter().all(|p| (p.length() - 1.0).abs() < 4e-4));
/// # Ok::<(), vesicle::volume::VolumeError>(())
/// ```
pub struct Follower {
    lattice: Lattice,
    blocks: Blocks,
    flood: Flood,
    scan: Option<Scan>,
    /// Steps for each vertex, and how many have been taken.
    steps: usize,
    taken: usize,
    /// The surface while it is refined, and after.
    surface: Option<Surface>,
    batch: Batch,
    task: Task,
    waves: u32,
    evaluations: usize,
}

impl Follower {
    /// Nothing followed yet.
    ///
    /// # Errors
    /// A lattice out of the ranges given there, or that lies further than 8192 edges from the world's origin, where
    /// `f32` positions would not do; [`VolumeError::TooLarge`].
    pub fn new(lattice: Lattice) -> Result<Self, VolumeError> {
        lattice.check()?;
        Ok(Self {
            lattice,
            blocks: Blocks::new(lattice.dims)?,
            flood: Flood::default(),
            scan: None,
            steps: 0,
            taken: 0,
            surface: None,
            batch: Batch::default(),
            task: Task::Nothing,
            waves: 0,
            evaluations: 0,
        })
    }

    /// Has the surface followed from a place on or near it: from the cell with `p` in it, or, where the surface
    /// crosses neither that cell nor one of the 26 around that was reached from elsewhere, from those 26.
    ///
    /// False, and nothing else, for a place more than one edge outside the lattice or not finite.
    pub fn seed(&mut self, p: DVec3) -> bool {
        let cell = self.lattice.cell(p);
        cell.into_iter().for_each(|cell| self.flood.seed(cell));
        cell.is_some()
    }

    /// Has pieces looked for that no seed leads to, once all seeds are followed: on the lines between every
    /// `stride`-th node along each axis. Those that cross a line an odd number of times are found and followed, too.
    ///
    /// # Errors
    /// A stride of 0; [`VolumeError::TooLarge`].
    pub fn scan(&mut self, stride: usize) -> Result<(), VolumeError> {
        if stride == 0 {
            return Err(VolumeError::invalid("stride", "0 given; at least 1 is needed"));
        }
        let mut scan = Scan::new(stride, &self.blocks)?;
        scan.found = self.found_by_scan();
        self.scan = Some(scan);
        self.drop_batch_of(Task::Scan);
        Ok(())
    }

    /// Has every vertex brought nearer to where the function is 0, by at most `steps` evaluations each, once all is
    /// followed. Without, a vertex stands where the line through the values at the ends of its edge passes 0.
    ///
    /// On a sphere of 45 edges radius the error falls from 3e-3 edges to 2e-7 by one step, which is what `f32` holds,
    /// and to 4e-12 by two. A vertex takes no more steps once they would not move it, and stays 1/256 of an edge away
    /// from nodes.
    pub fn refine(&mut self, steps: usize) {
        self.steps = steps;
    }

    /// Goes on with at most `budget` evaluations, but at least one; true when all is done.
    ///
    /// `f` is given points of the world and fills in a value for each: 0 and above is inside, NaN outside. It must
    /// give the same value at the same point whatever stands beside it.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`]; what was followed stays.
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
            if !self.take()? {
                return Ok(false);
            }
            self.drop_batch_of(self.task);
            self.task = self.ask()?;
            if self.task == Task::Nothing {
                return Ok(true);
            }
        }
    }

    /// Hands the values of the batch to where they are needed; false while some are missing.
    fn take(&mut self) -> Result<bool, VolumeError> {
        let Some(values) = self.batch.values() else { return Ok(false) };
        match self.task {
            Task::Nothing => {}
            Task::Wave => {
                (self.surface, self.taken, self.waves) = (None, 0, self.waves + 1);
                self.flood.take(values, &mut self.blocks)?;
            }
            Task::Scan => self.scan.iter_mut().for_each(|scan| scan.take(values, &self.blocks)),
            Task::Refine => {
                self.surface.iter_mut().for_each(|surface| surface.take(values));
                self.taken += 1;
            }
        }
        Ok(true)
    }

    /// Chooses what is next and fills the batch for it: first the flood, then the scan, then refinement.
    fn ask(&mut self) -> Result<Task, VolumeError> {
        let Self { lattice, blocks, flood, batch, .. } = self;
        if flood.ask(blocks, lattice, batch)? {
            return Ok(Task::Wave);
        }
        if let Some(scan) = &mut self.scan
            && scan.ask(blocks, flood, lattice, batch)?
        {
            return Ok(Task::Scan);
        }
        if self.taken >= self.steps {
            return Ok(Task::Nothing);
        }
        let surface = match &mut self.surface {
            Some(surface) => surface,
            none => none.insert(Surface::new(&flood.cut, blocks)?),
        };
        Ok(if surface.ask(blocks, lattice, batch) { Task::Refine } else { Task::Nothing })
    }

    /// Forgets the present batch where it is for `task`.
    fn drop_batch_of(&mut self, task: Task) {
        if self.task == task {
            self.batch.clear();
            self.task = Task::Nothing;
        }
    }

    /// The surface followed so far, in world space, triangles counter-clockwise seen from outside; vertices and
    /// triangles in the order of where they are. Closed half an edge beyond the lattice, as by
    /// [`marching_cubes`](super::marching_cubes); open where the flood has still to go on, where a vertex may belong to
    /// no triangle.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub fn mesh(&self) -> Result<TriangleMesh, VolumeError> {
        self.with_surface(|surface| surface.mesh(&self.blocks, &self.lattice))
    }

    /// The vertices of [`Self::mesh`] before they are rounded to `f32`.
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
            None => read(&Surface::new(&self.flood.cut, &self.blocks)?),
        }
    }

    /// About how much of the work is done: how many waves are still to come is not known before the last.
    pub fn progress(&self) -> f64 {
        let share = self.batch.progress();
        let waves = f64::from(self.waves) + share;
        match self.task {
            Task::Nothing => 0.0,
            Task::Wave => 0.6 * waves / (waves + 2.0),
            Task::Scan => 0.6,
            Task::Refine => 0.6 + 0.4 * (self.taken as f64 + share) / self.steps as f64,
        }
    }

    /// Pieces of the surface that no seed led to and a scan found, as far as they are apart: pieces that share a cell
    /// are one.
    pub fn found_by_scan(&self) -> usize {
        self.scan.as_ref().map_or(0, |scan| scan.found)
    }

    /// Cells that the surface crosses, so far.
    pub fn crossed_cells(&self) -> usize {
        self.flood.cut.len()
    }

    /// Values asked for so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Bytes held for the lattice's values: in proportion to the area, beside 4 for each block of 8³ nodes.
    pub fn bytes(&self) -> usize {
        self.blocks.bytes()
    }
}
