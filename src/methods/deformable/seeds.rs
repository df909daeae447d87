//! Seeding: parts of a level's iso-surface that are far from the mesh become new components of it.
//!
//! What vanished on a coarse level, or was never shown by one, is not reached by a surface that only moves. So the voxels of a level
//! are compared with the mesh: object outside of it is missing matter, background inside is a missing hollow. Where that is
//! further from the mesh than [`CLEARANCE`] its contour is added, closed and clear of the mesh by construction; forces and contact
//! do the rest.

use super::contour::{ObjectIs, contour, placed};
use super::coverage::Missing;
use super::image::LevelImage;
use super::{DeformableModel, Topology};
use crate::math::Vec3;
use crate::mesh::{Groups, Mesh, TriangleMesh, VertexId};
use crate::methods::{MethodError, StepReport, Times};
use crate::remesh::Changes;
use crate::spatial::{CellSet, TriangleTree};
use crate::volume::{Grid, marching_cubes, voxels_inside};
use fixedbitset::FixedBitSet;

/// Voxels nearer to the mesh than this, in voxels of the level, are left to it. With less, seeds would touch it; with more, thin
/// parts beside it are not found.
const CLEARANCE: f64 = 0.9;

/// The least volume of a seed, in that of the smallest part of its own: pieces of parts that the mesh has may be smaller.
const SMALLEST_SEED: f64 = 1.0 / 32.0;

/// The volume of the octahedron of the six neighbours of a voxel, in voxels: a contour around it alone encloses no more.
const MOST_OF_ONE_VOXEL: f64 = 4.0 / 3.0;

impl DeformableModel {
    /// Searches the level for parts that the mesh leaves out and adds them, whatever `seeding` says. The run goes on where it had
    /// ended; the report counts the parts as `seeds`.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`]; out of memory.
    pub fn seed(&mut self) -> Result<StepReport, MethodError> {
        let mut times = Times::default();
        let changes = self.seed_missing(&mut times)?;
        if changes.seeds > 0 {
            self.wake_all();
            self.count_components(changes);
        }
        Ok(self.report(changes, times))
    }

    /// Adds to the mesh the closed contours of what this level shows and the mesh leaves out, and returns how many there were.
    pub(super) fn seed_missing(&mut self, times: &mut Times) -> Result<Changes, MethodError> {
        if self.params.iso_force == 0.0 || self.params.topology == Topology::Fixed {
            return Ok(Changes::default());
        }
        let begin = (self.clock)();
        let mut seeds = Mesh::default();
        for kind in self.missing_parts()?.iter().filter(|kind| !kind.triangles.is_empty()) {
            seeds.append(&Mesh::from_triangles(kind)?)?;
        }
        let (mut changes, mut added) = (Changes::default(), Vec::new());
        if seeds.vertex_count() > 0 {
            (changes, added) = self.add_components(&seeds)?;
        }
        times.add("seeding", (self.clock)() - begin);
        if changes.seeds > 0 {
            if self.rest.sized {
                self.set_sizes_of(&added);
            }
            changes += self.restore_bounds(&added, times);
        }
        Ok(changes)
    }

    /// Adds components to the mesh, all but those that would cross something, and returns how many as `seeds`, and their vertices.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`]; nothing is added then.
    pub(super) fn add_components(&mut self, parts: &Mesh) -> Result<(Changes, Vec<VertexId>), MethodError> {
        self.check_vertex_limit(parts)?;
        let sampling = self.sampling();
        let guard = self.resolver.guard(&self.mesh, sampling);
        let (mut added, crossing) = guard.append(&mut self.mesh, parts)?;
        let mut count = parts.component_count();
        let mut is_new = vec![false; self.mesh.slots()];
        added.iter().for_each(|v| is_new[v.index()] = true);
        for v in crossing {
            if is_new[v.index()] && self.mesh.is_live(v) {
                guard.remove_component(&mut self.mesh, v);
                count -= 1;
            }
        }
        self.welcome(&added);
        added.retain(|&v| self.mesh.is_live(v));
        Ok((Changes { seeds: count as u32, ..Changes::default() }, added))
    }

    /// Whether components can be added without exceeding the largest number of vertices.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`].
    pub(super) fn check_vertex_limit(&self, parts: &Mesh) -> Result<(), MethodError> {
        let most = self.resolver.most_vertices();
        let fits = self.mesh.vertex_count() + parts.vertex_count() <= most;
        if fits { Ok(()) } else { Err(MethodError::TooManyVertices { most }) }
    }

    /// Makes new vertices known to the model.
    pub(super) fn welcome(&mut self, added: &[VertexId]) {
        let keys = self.keys;
        for v in added.iter().map(|v| v.index()) {
            self.mesh.vector_mut(keys.velocity)[v] = Vec3::ZERO;
            self.mesh.scalar_mut(keys.still)[v] = 0.0;
            self.mesh.scalar_mut(keys.calm)[v] = 0.0;
            self.mesh.scalar_mut(keys.reversals)[v] = 0.0;
            self.mesh.scalar_mut(keys.size)[v] = 0.0;
            let (positions, checked) = self.mesh.positions_and_vector_mut(keys.checked);
            checked[v] = positions[v];
        }
    }

    /// The contours of what is missing, closed surfaces in the space of the model: of matter, and of hollows.
    fn missing_parts(&self) -> Result<[TriangleMesh; 2], MethodError> {
        let image = &self.pyramid.levels[self.level];
        let object = ObjectIs::by(&self.params);
        let dims = image.grid().0.dims;
        let indexed = |mesh| placed(mesh, |p| image.index(p));
        // The contour of a large image is the larger of the two, and is gone before the other is made.
        let contour = contour(image, self.level_iso, object, self.params.smallest_part)?;
        let in_contour = voxels_inside(&indexed(contour), dims);
        let surface = indexed(self.mesh.to_triangles());
        let in_mesh = voxels_inside(&surface, dims);
        let comparison = Comparison { image, iso: self.level_iso, object, in_contour, in_mesh, surface };
        let smallest = SMALLEST_SEED * self.params.smallest_part;
        Ok([comparison.parts(Missing::Matter, smallest)?, comparison.parts(Missing::Hollow, smallest)?])
    }
}

/// The contour of a level and the mesh, voxel by voxel.
struct Comparison<'a> {
    image: &'a LevelImage,
    iso: f32,
    object: ObjectIs,
    /// Whether each voxel is inside the contour; closed parts that are too small are no part of that.
    in_contour: FixedBitSet,
    /// Whether each voxel is inside the mesh.
    in_mesh: FixedBitSet,
    /// The mesh in voxels of the level.
    surface: TriangleMesh,
}

impl Comparison<'_> {
    /// Closed surfaces around what is missing of one kind, each of at least a volume.
    fn parts(&self, kind: Missing, smallest: f64) -> Result<TriangleMesh, MethodError> {
        let (grid, position) = self.image.grid();
        let missing = self.missing_voxels(kind)?;
        let voxel = 1.0 / f64::from(self.image.voxels_per_unit());
        let mut clusters = clusters(&missing, grid.dims);
        clusters.retain(|cluster| cluster.len() > 1 || MOST_OF_ONE_VOXEL * voxel * voxel * voxel >= smallest);
        let mut parts = TriangleMesh::default();
        for cluster in clusters {
            let (low, high) = bounding_box(&cluster, grid.dims);
            let field = self.field(kind, &cluster, [low, high]);
            let offset = Vec3::from(low.map(|k| k as f32));
            parts.append(&placed(marching_cubes(&field, 0.0)?, |p| position(p + offset)));
        }
        if kind == Missing::Hollow {
            parts.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Ok(parts.without_parts_below(smallest))
    }

    /// Whether the contour has a voxel on the side where something of this kind is.
    fn is_of(&self, kind: Missing, voxel: usize) -> bool {
        self.in_contour.contains(voxel) == (kind == Missing::Matter)
    }

    /// Voxels on the wrong side of the mesh and clear of it, in order.
    fn missing_voxels(&self, kind: Missing) -> Result<Vec<usize>, MethodError> {
        let mut missing = self.misplaced_voxels(kind);
        if missing.is_empty() {
            return Ok(missing);
        }
        let dims = self.image.grid().0.dims;
        let mut places = CellSet::new(CLEARANCE as f32 + longest_edge(&self.surface));
        missing.iter().for_each(|&voxel| places.add(coordinates(dims, voxel)));
        let tree = TriangleTree::new(&self.surface_near(&places))?;
        missing.retain(|&voxel| !tree.is_within(coordinates(dims, voxel), CLEARANCE));
        Ok(missing)
    }

    /// Voxels on the wrong side of the mesh, whose neighbours are on that side, too; in order.
    fn misplaced_voxels(&self, kind: Missing) -> Vec<usize> {
        let is_inside = kind == Missing::Hollow;
        let dims = self.image.grid().0.dims;
        let is_misplaced = |&voxel: &usize| {
            self.is_of(kind, voxel)
                && faces(dims, voxel).all(|w| w.map_or(!is_inside, |w| self.in_mesh.contains(w) == is_inside))
        };
        let mut differing = self.in_mesh.clone();
        differing.symmetric_difference_with(&self.in_contour);
        differing.ones().filter(is_misplaced).collect()
    }

    /// The triangles that may be within [`CLEARANCE`] of some places.
    fn surface_near(&self, places: &CellSet) -> TriangleMesh {
        let is_near: Vec<bool> = self.surface.positions.iter().map(|&p| places.contains(p)).collect();
        let near =
            self.surface.triangles.iter().filter(|corners| corners.iter().any(|&v| is_near[v as usize]));
        TriangleMesh {
            positions: self.surface.positions.clone(),
            triangles: near.copied().collect(),
            ..TriangleMesh::default()
        }
    }

    /// How far the intensity of a voxel is on the side where something of this kind is.
    fn depth(&self, kind: Missing, voxel: usize) -> f32 {
        let depth = self.object.depth(self.image.grid().0.values[voxel], self.iso);
        if kind == Missing::Matter { depth } else { -depth }
    }

    /// How steep the image is at the contour of some voxels: the root mean square of the differences between those that are on that side
    /// and their neighbours that are not; without any, of their depths. Above 0.
    fn steepness(&self, kind: Missing, voxels: &[usize]) -> f32 {
        let dims = self.image.grid().0.dims;
        let (mut differences, mut depths) = (Mean::default(), Mean::default());
        for &voxel in voxels {
            let depth = self.depth(kind, voxel);
            if depth <= 0.0 {
                continue;
            }
            depths.add(depth * depth);
            for beyond in
                faces(dims, voxel).flatten().map(|w| self.depth(kind, w)).filter(|&beyond| beyond < 0.0)
            {
                differences.add((depth - beyond) * (depth - beyond));
            }
        }
        differences.value().or(depths.value()).map_or(1.0, |square| square.sqrt() as f32)
    }

    /// A field around a cluster of missing voxels, 0 on their contour: the iso-surface where they end at it, else halfway to the next voxel.
    fn field(&self, kind: Missing, missing: &[usize], [low, high]: [[usize; 3]; 2]) -> Grid {
        let grid = self.image.grid().0;
        let steep = self.steepness(kind, missing);
        let size = [0, 1, 2].map(|k| high[k] - low[k]);
        let mut values = Vec::with_capacity(size.iter().product());
        let mut ahead = missing.iter().peekable();
        let mut is_missing = |voxel: usize| {
            while ahead.next_if(|&&next| next < voxel).is_some() {}
            ahead.peek() == Some(&&voxel)
        };
        let mut value = |voxel: usize| {
            let depth = self.depth(kind, voxel);
            match is_missing(voxel) {
                // What belongs to a part that is too small has the other sign.
                true if depth < 0.0 => 0.5 * steep,
                true => depth.min(steep),
                false if self.is_of(kind, voxel) || depth >= 0.0 => -steep,
                false => depth,
            }
        };
        for z in low[2]..high[2] {
            for y in low[1]..high[1] {
                let row = grid.dims[0] * (y + grid.dims[1] * z);
                values.extend((row + low[0]..row + high[0]).map(&mut value));
            }
        }
        Grid { dims: size, values }
    }
}

/// A mean of numbers.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, number: f32) {
        self.sum += f64::from(number);
        self.count += 1;
    }

    fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / f64::from(self.count))
    }
}

/// The longest edge of a surface.
fn longest_edge(surface: &TriangleMesh) -> f32 {
    let longest = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| surface.positions[v as usize]);
        a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
    };
    surface.triangles.iter().map(longest).fold(0.0, f32::max).sqrt()
}

/// The indices of a voxel along the axes.
fn indices(dims: [usize; 3], voxel: usize) -> [usize; 3] {
    [voxel % dims[0], voxel / dims[0] % dims[1], voxel / dims[0] / dims[1]]
}

fn coordinates(dims: [usize; 3], voxel: usize) -> Vec3 {
    Vec3::from(indices(dims, voxel).map(|k| k as f32))
}

/// The six voxels that share a face with one; `None` beyond the image.
fn faces(dims: [usize; 3], voxel: usize) -> impl Iterator<Item = Option<usize>> {
    let at = indices(dims, voxel);
    let step = [1, dims[0], dims[0] * dims[1]];
    (0..3).flat_map(move |axis| {
        [(at[axis] > 0).then(|| voxel - step[axis]), (at[axis] + 1 < dims[axis]).then(|| voxel + step[axis])]
    })
}

/// The lowest voxel of a box around some and the one beyond its highest, with a voxel to spare where there is one.
fn bounding_box(voxels: &[usize], dims: [usize; 3]) -> ([usize; 3], [usize; 3]) {
    let (mut low, mut high) = (dims, [0; 3]);
    for &voxel in voxels {
        let at = indices(dims, voxel);
        for axis in 0..3 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    (low.map(|k| k.saturating_sub(1)), [0, 1, 2].map(|axis| (high[axis] + 2).min(dims[axis])))
}

/// The voxels in groups of those connected over faces, edges or corners; all in order.
fn clusters(voxels: &[usize], dims: [usize; 3]) -> Vec<Vec<usize>> {
    let mut groups = Groups::new(voxels.len());
    for (i, &voxel) in voxels.iter().enumerate() {
        let at = indices(dims, voxel);
        // The 13 neighbours that come before it.
        for k in 0..13 {
            let shift = [k % 3, k / 3 % 3, k / 9];
            let neighbour = [0, 1, 2].map(|axis| (at[axis] + shift[axis]).wrapping_sub(1));
            if (0..3).all(|axis| neighbour[axis] < dims[axis]) {
                let other = neighbour[0] + dims[0] * (neighbour[1] + dims[1] * neighbour[2]);
                if let Ok(j) = voxels[..i].binary_search(&other) {
                    groups.join(i, j);
                }
            }
        }
    }
    let mut clusters = vec![Vec::new(); voxels.len()];
    voxels.iter().enumerate().for_each(|(i, &voxel)| clusters[groups.find(i)].push(voxel));
    clusters.retain(|cluster| !cluster.is_empty());
    clusters
}
