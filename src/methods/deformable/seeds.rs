//! Seeding: adds parts of a pyramid level's contour that are far from the mesh as new components.
//!
//! A surface that only moves does not reach parts that vanished on a coarse level, or that no coarse level shows. So
//! the voxels of a level are compared with the mesh: object outside of it is missing matter, background inside is a
//! missing cavity. The contours of missing voxels further from the mesh than [`CLEARANCE`] are added; they are closed
//! and clear of the mesh by construction. Forces and contact join them with the rest of the mesh.

use super::contour::{ObjectIs, contour, placed};
use super::coverage::Missing;
use super::image::LevelImage;
use super::{DeformableModel, MEAN_EDGE, Topology};
use crate::math::{Vec3, triangle};
use crate::mesh::{DisjointSets, Mesh, TriangleMesh, VertexId};
use crate::methods::{MethodError, StepReport, Times};
use crate::pauses::{Pauses, finished};
use crate::remesh::Changes;
use crate::spatial::{CellSet, TriangleTree};
use crate::volume::{Grid, Subdivided, marching_cubes, voxels_inside_in_slices};
use fixedbitset::FixedBitSet;

/// The distance from the mesh, in voxels of the pyramid level, beyond which voxels on the wrong side of it are missing,
/// so that seeds are added there. With less, seeds would touch the mesh; with more, thin parts beside it are not found.
const CLEARANCE: f64 = 0.9;

/// The least volume of a seed, a missing part added to the mesh, as a share of
/// [`super::DeformableParams::smallest_part`]: pieces of parts that are already in the mesh may be smaller than
/// separate parts.
const SMALLEST_SEED: f64 = 1.0 / 32.0;

/// The number of voxels around a part whose contour is a unit of work.
const VOXELS_PER_UNIT: usize = 16;

/// The volume of the octahedron of the six neighbours of a voxel, in voxels; the contour of a single voxel encloses no
/// more, so single voxels may be too small for a seed.
const MAX_VOLUME_OF_ONE_VOXEL: f64 = 4.0 / 3.0;

impl DeformableModel {
    /// Searches the current pyramid level for parts of its contour that the mesh lacks and adds them, whatever the
    /// parameter `seeding`. A finished run continues if there are any; the report counts them as `seeds`. Nothing is
    /// added if the topology is fixed or the image force is zero.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] on a sparse volume, or for edges too long for the object;
    /// [`MethodError::TooManyVertices`]; [`MethodError::Mesh`] and [`MethodError::Volume`] if memory does not suffice.
    pub fn seed(&mut self) -> Result<StepReport, MethodError> {
        self.checkpoint = None;
        self.check_is_whole()?;
        let mut times = Times::default();
        let changes = finished(self.seed_missing(&mut times, &Pauses::default()))?;
        if changes.seeds > 0 {
            self.wake_all();
            self.count_components(changes);
        }
        Ok(self.report(changes, times))
    }

    /// Adds closed contours of the matter and the cavities on this level that the mesh lacks, and restores edge bounds
    /// and contacts around them. Returns the numbers of edits, with that of the contours as `seeds`.
    pub(super) async fn seed_missing(
        &mut self,
        times: &mut Times,
        pauses: &Pauses,
    ) -> Result<Changes, MethodError> {
        if self.params.iso_force == 0.0 || self.params.topology == Topology::Fixed {
            return Ok(Changes::default());
        }
        let begin = (self.clock)();
        let mut seeds = Mesh::default();
        for kind in self.missing_parts(pauses).await?.iter().filter(|kind| !kind.triangles.is_empty()) {
            seeds.append(&Mesh::from_triangles(kind)?)?;
        }
        let (mut changes, mut added) = (Changes::default(), Vec::new());
        if seeds.vertex_count() > 0 {
            pauses.now().await;
            (changes, added) = self.add_components(&seeds)?;
            pauses.now().await;
        }
        times.add("seeding", (self.clock)() - begin);
        if changes.seeds > 0 {
            if self.convergence.sized {
                self.set_sizes_of(&added, pauses).await;
            }
            changes += self.restore_bounds(&added, times, pauses).await;
        }
        Ok(changes)
    }

    /// Adds the components `parts` to the mesh, except for those that would intersect it or each other. Returns the
    /// number of components added, as `seeds`, and their vertices.
    ///
    /// # Errors
    /// As [`Self::check_vertex_limit`]; nothing is added then.
    pub(super) fn add_components(&mut self, parts: &Mesh) -> Result<(Changes, Vec<VertexId>), MethodError> {
        self.check_vertex_limit(parts)?;
        let sampling = self.sampling();
        let guard = self.resolver.embedding(&self.mesh, sampling);
        let (mut added, intersecting) = guard.append(&mut self.mesh, parts)?;
        let mut count = parts.component_count();
        let mut is_new = vec![false; self.mesh.slots()];
        added.iter().for_each(|v| is_new[v.index()] = true);
        for v in intersecting {
            if is_new[v.index()] && self.mesh.is_live(v) {
                guard.remove_component(&mut self.mesh, v);
                count -= 1;
            }
        }
        self.initialise_attributes(&added);
        added.retain(|&v| self.mesh.is_live(v));
        Ok((Changes { seeds: count as u32, ..Changes::default() }, added))
    }

    /// Checks that the components `parts` can be added to the mesh without exceeding the largest number of vertices.
    ///
    /// # Errors
    /// [`MethodError::TooManyVertices`]; [`MethodError::InvalidArgument`] if only edges much longer than a voxel make that
    /// number so small: a mesh with them misses most of the object.
    pub(super) fn check_vertex_limit(&self, parts: &Mesh) -> Result<(), MethodError> {
        let most = self.resolver.max_vertices();
        let count = self.mesh.vertex_count() + parts.vertex_count();
        if count <= most {
            return Ok(());
        }
        if count > self.domain.most_vertices(1.0) {
            return Err(MethodError::TooManyVertices { most });
        }
        let edge = self.finest_delta * MEAN_EDGE * self.voxel;
        let problem = format!("must be < {edge:.3} for this object: the surface lacks large parts of it");
        Err(MethodError::invalid("edge", problem))
    }

    /// Initialises the attributes of vertices added to the mesh: at rest, awake, checked for edge bounds and contacts
    /// at their positions, and with size 1, the uniform δ.
    pub(super) fn initialise_attributes(&mut self, added: &[VertexId]) {
        let keys = self.keys;
        for v in added.iter().map(|v| v.index()) {
            self.mesh.vector_mut(keys.velocity)[v] = Vec3::ZERO;
            self.mesh.scalar_mut(keys.still_iterations)[v] = 0.0;
            self.mesh.scalar_mut(keys.since_edit)[v] = 0.0;
            self.mesh.scalar_mut(keys.reversals)[v] = 0.0;
            self.mesh.scalar_mut(keys.size)[v] = 0.0;
            let (positions, checked) = self.mesh.positions_and_vector_mut(keys.checked_position);
            checked[v] = positions[v];
        }
    }

    /// Returns the contours of matter and of cavities, in this order, that the mesh lacks on the current level; closed
    /// surfaces in model space.
    async fn missing_parts(&self, pauses: &Pauses) -> Result<[TriangleMesh; 2], MethodError> {
        let image = &self.pyramid.levels[self.level];
        let object = ObjectIs::by(&self.params);
        let dims = image.part_grid().0.dims();
        let indexed = |mesh| placed(mesh, |p| image.part_index(p));
        // The contour, in a large image the larger of the two meshes, is freed before the other is made.
        let contour = contour(image, self.contour_rule(self.level_iso), pauses).await?;
        pauses.now().await;
        let in_contour = voxels_inside_in_slices(&indexed(contour), dims, pauses).await;
        pauses.now().await;
        let surface = indexed(self.mesh.to_triangles());
        pauses.now().await;
        let in_mesh = voxels_inside_in_slices(&surface, dims, pauses).await;
        let comparison = Comparison { image, iso: self.level_iso, object, in_contour, in_mesh, surface };
        let smallest = SMALLEST_SEED * self.smallest_part();
        pauses.now().await;
        let matter = comparison.parts(Missing::Matter, smallest, pauses).await?;
        Ok([matter, comparison.parts(Missing::Cavity, smallest, pauses).await?])
    }
}

/// A comparison of a level's contour with the mesh, voxel by voxel, which finds missing parts.
struct Comparison<'a> {
    image: &'a LevelImage,
    iso: f32,
    object: ObjectIs,
    /// Whether each voxel is inside the level's contour, which has no closed parts that are too small.
    in_contour: FixedBitSet,
    /// Whether each voxel is inside the mesh.
    in_mesh: FixedBitSet,
    /// The mesh in voxel indices of the pyramid level.
    surface: TriangleMesh,
}

impl Comparison<'_> {
    fn grid(&self) -> Subdivided<'_> {
        self.image.part_grid().0
    }

    /// Returns closed surfaces, in model space, around the voxels of missing matter or of missing cavities, as `kind`
    /// tells; each encloses at least `smallest` voxels of the finest level.
    async fn parts(
        &self,
        kind: Missing,
        smallest: f64,
        pauses: &Pauses,
    ) -> Result<TriangleMesh, MethodError> {
        let (dims, position) = (self.grid().dims(), self.image.part_grid().1);
        let missing = self.missing_voxels(kind, pauses).await?;
        let voxel = 1.0 / f64::from(self.image.voxels_per_unit());
        let mut clusters = clusters(&missing, dims);
        clusters.retain(|cluster| {
            cluster.len() > 1 || MAX_VOLUME_OF_ONE_VOXEL * voxel * voxel * voxel >= smallest
        });
        let mut parts = TriangleMesh::default();
        for cluster in clusters {
            let (low, high) = bounding_box(&cluster, dims);
            let field = self.field(kind, &cluster, [low, high]);
            pauses.after(1 + field.values.len() / VOXELS_PER_UNIT).await;
            let offset = Vec3::from(low.map(|k| k as f32));
            parts.append(&placed(marching_cubes(&field, 0.0)?, |p| position(p + offset)));
        }
        if kind == Missing::Cavity {
            parts.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Ok(parts.without_components_below(smallest))
    }

    /// Returns whether the contour assigns a voxel, given by its index in the grid, to the object if matter is missing,
    /// or to the background if cavities are.
    fn is_in_missing_phase(&self, kind: Missing, voxel: usize) -> bool {
        self.in_contour.contains(voxel) == (kind == Missing::Matter)
    }

    /// Returns the grid indices of missing voxels, in ascending order: those on the wrong side of the mesh, see
    /// [`Self::misplaced_voxels`], that are further from it than [`CLEARANCE`].
    async fn missing_voxels(&self, kind: Missing, pauses: &Pauses) -> Result<Vec<usize>, MethodError> {
        let missing = self.misplaced_voxels(kind);
        if missing.is_empty() {
            return Ok(missing);
        }
        let dims = self.grid().dims();
        let mut cells = CellSet::new(CLEARANCE as f32 + longest_edge(&self.surface));
        missing.iter().for_each(|&voxel| cells.insert_around(coordinates(dims, voxel)));
        pauses.now().await;
        let surface = self.surface_near(&cells);
        pauses.now().await;
        let tree = TriangleTree::in_slices(&surface, pauses).await?;
        let mut far = Vec::new();
        for voxel in missing {
            pauses.after(1).await;
            if !tree.is_within(coordinates(dims, voxel), CLEARANCE) {
                far.push(voxel);
            }
        }
        Ok(far)
    }

    /// Returns the grid indices, in ascending order, of the voxels on the wrong side of the mesh, such as object
    /// outside it, whose six neighbours are on that side of the mesh, too.
    fn misplaced_voxels(&self, kind: Missing) -> Vec<usize> {
        let is_inside = kind == Missing::Cavity;
        let dims = self.grid().dims();
        let is_misplaced = |&voxel: &usize| {
            self.is_in_missing_phase(kind, voxel)
                && faces(dims, voxel).all(|w| w.map_or(!is_inside, |w| self.in_mesh.contains(w) == is_inside))
        };
        let mut differing = self.in_mesh.clone();
        differing.symmetric_difference_with(&self.in_contour);
        differing.ones().filter(is_misplaced).collect()
    }

    /// Returns the part of the mesh with the triangles that may be within [`CLEARANCE`] of the positions around which
    /// `cells` were inserted, so that distances are measured to few triangles.
    fn surface_near(&self, cells: &CellSet) -> TriangleMesh {
        let is_near: Vec<bool> = self.surface.positions.iter().map(|&p| cells.contains(p)).collect();
        let near =
            self.surface.triangles.iter().filter(|corners| corners.iter().any(|&v| is_near[v as usize]));
        TriangleMesh {
            positions: self.surface.positions.clone(),
            triangles: near.copied().collect(),
            ..TriangleMesh::default()
        }
    }

    /// Returns the difference between the intensity of a voxel and the iso value, positive in the object if matter is
    /// missing, or in the background if cavities are, as `kind` tells.
    fn depth(&self, kind: Missing, voxel: usize) -> f32 {
        let depth = self.object.depth(self.grid().value(voxel), self.iso);
        if kind == Missing::Matter { depth } else { -depth }
    }

    /// Returns the steepness of the image at the contour of some voxels, which bounds the values of [`Self::field`]:
    /// the root mean square of the differences between those with positive [`Self::depth`] and their neighbours with
    /// negative depth; if there are none, of the positive depths alone; 1 if there are none, either.
    fn steepness(&self, kind: Missing, voxels: &[usize]) -> f32 {
        let dims = self.grid().dims();
        let (mut differences, mut depths) = (Mean::default(), Mean::default());
        for &voxel in voxels {
            let depth = self.depth(kind, voxel);
            if depth <= 0.0 {
                continue;
            }
            depths.add(depth * depth);
            for neighbour in
                faces(dims, voxel).flatten().map(|w| self.depth(kind, w)).filter(|&neighbour| neighbour < 0.0)
            {
                differences.add((depth - neighbour) * (depth - neighbour));
            }
        }
        differences.value().or(depths.value()).map_or(1.0, |square| square.sqrt() as f32)
    }

    /// Returns a field, for marching cubes, on the box of voxels from `low` to `high` around a cluster of missing
    /// voxels, positive inside their contour and negative outside: it is 0 on the iso-surface where that bounds the
    /// cluster, else at most halfway to the next voxel.
    fn field(&self, kind: Missing, missing: &[usize], [low, high]: [[usize; 3]; 2]) -> Grid {
        let dims = self.grid().dims();
        let steepness = self.steepness(kind, missing);
        let size = [0, 1, 2].map(|k| high[k] - low[k]);
        let mut values = Vec::with_capacity(size.iter().product());
        let mut remaining = missing.iter().peekable();
        let mut is_missing = |voxel: usize| {
            while remaining.next_if(|&&next| next < voxel).is_some() {}
            remaining.peek() == Some(&&voxel)
        };
        let mut value = |voxel: usize| {
            let depth = self.depth(kind, voxel);
            match is_missing(voxel) {
                // Voxels of a part that is too small for the contour have the other sign.
                true if depth < 0.0 => 0.5 * steepness,
                true => depth.min(steepness),
                false if self.is_in_missing_phase(kind, voxel) || depth >= 0.0 => -steepness,
                false => depth,
            }
        };
        for z in low[2]..high[2] {
            for y in low[1]..high[1] {
                let row = dims[0] * (y + dims[1] * z);
                values.extend((row + low[0]..row + high[0]).map(&mut value));
            }
        }
        Grid { dims: size, values }
    }
}

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

fn longest_edge(surface: &TriangleMesh) -> f32 {
    surface.corners().map(triangle::longest_edge_squared).fold(0.0, f32::max).sqrt()
}

/// Converts the index of a voxel in a grid of `dims` voxels to its indices along the three axes.
fn indices(dims: [usize; 3], voxel: usize) -> [usize; 3] {
    [voxel % dims[0], voxel / dims[0] % dims[1], voxel / dims[0] / dims[1]]
}

fn coordinates(dims: [usize; 3], voxel: usize) -> Vec3 {
    Vec3::from(indices(dims, voxel).map(|k| k as f32))
}

/// Returns the grid indices of the six voxels that share a face with a voxel; `None` for those outside the image.
fn faces(dims: [usize; 3], voxel: usize) -> impl Iterator<Item = Option<usize>> {
    let at = indices(dims, voxel);
    let step = [1, dims[0], dims[0] * dims[1]];
    (0..3).flat_map(move |axis| {
        [(at[axis] > 0).then(|| voxel - step[axis]), (at[axis] + 1 < dims[axis]).then(|| voxel + step[axis])]
    })
}

/// Returns the bounding box of voxels given by grid indices, enlarged by one voxel within the image: its first voxel,
/// and the one past its last, along each axis.
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

/// Groups voxels, given by ascending grid indices, into clusters connected over faces, edges or corners; the indices of
/// each cluster are ascending, too.
fn clusters(voxels: &[usize], dims: [usize; 3]) -> Vec<Vec<usize>> {
    let mut groups = DisjointSets::new(voxels.len());
    for (i, &voxel) in voxels.iter().enumerate() {
        let at = indices(dims, voxel);
        // The 13 neighbours that come before it.
        for k in 0..13 {
            let shift = [k % 3, k / 3 % 3, k / 9];
            let neighbour = [0, 1, 2].map(|axis| (at[axis] + shift[axis]).wrapping_sub(1));
            if (0..3).all(|axis| neighbour[axis] < dims[axis]) {
                let other = neighbour[0] + dims[0] * (neighbour[1] + dims[1] * neighbour[2]);
                if let Ok(j) = voxels[..i].binary_search(&other) {
                    groups.union(i, j);
                }
            }
        }
    }
    let mut clusters = vec![Vec::new(); voxels.len()];
    voxels.iter().enumerate().for_each(|(i, &voxel)| clusters[groups.find(i)].push(voxel));
    clusters.retain(|cluster| !cluster.is_empty());
    clusters
}
