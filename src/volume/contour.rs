//! Iso-surfaces of a grid by marching cubes: closed, oriented, 2-manifold and free of self-intersections for any grid.
//!
//! Each edge between neighbouring voxels of which exactly one is inside (at or above the iso value) has one vertex;
//! [`super::cube_cases`] connects the vertices within a cube of eight voxels. The grid is treated as if padded by one
//! layer of outside voxels; at its border the surface is half a voxel beyond the outermost voxel centres.

use super::cube_cases::{Case, EDGES, FAR_EDGES, cases};
use super::error::VolumeError;
use super::{Grid, Region, Volume};
use crate::math::{DAffine3, Vec3};
use crate::mesh::{TriangleMesh, grid_origin};
use crate::pauses::{Pauses, finished};
use std::borrow::Cow;
use std::collections::TryReserveError;

/// Smallest distance of an iso-surface vertex from the ends of the grid edge on which it lies, in voxels: vertices that
/// would be nearer are moved by at most this distance. At 0, triangles around a voxel that equals the iso value would
/// have no area; much smaller, and vertices of a large volume coincide in `f32`.
pub(super) const MARGIN: f32 = 1.0 / 256.0;

/// Extracts the iso-surface of one frame at intensity `iso` by marching cubes, in world space.
///
/// The mesh is closed, at the volume's border half a voxel beyond the outermost voxel centres; its triangles are
/// counter-clockwise seen from the side where intensities are below `iso`.
///
/// NaN counts as outside the volume, whatever `iso` is; +∞ is inside and −∞ outside. The surface is halfway between such a
/// voxel and a neighbour on the other side. Intensities are compared with `iso` in double precision where `f32` would round them too coarsely.
///
/// # Errors
/// `iso` not finite, `frame` out of range, [`VolumeError::TooLarge`].
pub fn marching_cubes_world(volume: &Volume, iso: f64, frame: usize) -> Result<TriangleMesh, VolumeError> {
    marching_cubes_bounded(volume, iso, frame, MOST_TRIANGLES)
}

/// Extracts the iso-surface as [`marching_cubes_world`], with about `most` triangles at most.
///
/// # Errors
/// As [`marching_cubes_world`]; [`VolumeError::TooManyTriangles`].
pub fn marching_cubes_bounded(
    volume: &Volume,
    iso: f64,
    frame: usize,
    most: usize,
) -> Result<TriangleMesh, VolumeError> {
    if !iso.is_finite() {
        return Err(VolumeError::invalid("iso", format!("must be finite, got {iso}")));
    }
    let (grid, iso) = volume.grid_at(iso, frame)?;
    let most = most.min(MOST_TRIANGLES);
    let mut mesh = finished(marching_cubes_in_slices(&grid, iso, most, &Pauses::default()))?;
    to_world(&mut mesh, &volume.affine(), volume.dims());
    Ok(mesh)
}

/// Extracts the iso-surface of a grid at `iso` by marching cubes, in index coordinates (voxel centres at integers). The
/// mesh is empty if no value reaches `iso`.
///
/// Values of `iso` and above are inside (NaN is outside, and the surface halfway to it); triangles are counter-clockwise seen from outside and have
/// nonzero area. Inside voxels that share only an edge or a corner are not connected by the surface.
///
/// # Errors
/// `iso` not finite, a grid whose values do not match its dimensions, [`VolumeError::TooLarge`].
pub fn marching_cubes(grid: &Grid, iso: f32) -> Result<TriangleMesh, VolumeError> {
    grid.check()?;
    finished(marching_cubes_in_slices(grid, iso, MOST_TRIANGLES, &Pauses::default()))
}

/// The largest number of triangles of an iso-surface: meshes of four million vertices are as large as there is memory to work
/// with.
const MOST_TRIANGLES: usize = 8_000_000;

/// The number of voxels of a slice above which slices across another axis are taken if they are smaller: the state of
/// marching cubes takes 30 bytes for each voxel of a slice.
const LARGE_SLICE: usize = 1 << 23;

/// The numbers of voxels and of triangles that are a unit of work between pauses.
const VOXELS_PER_UNIT: usize = 512;
const TRIANGLES_PER_UNIT: usize = 64;

/// A field that is read slice by slice.
pub(crate) trait Slices {
    /// Returns the number of voxels along x, y and z.
    fn dims(&self) -> [usize; 3];

    /// Returns the values of the slice with an index z, row by row.
    fn slice(&self, z: usize) -> Result<Cow<'_, [f32]>, VolumeError>;

    /// Returns the values in a region within the field.
    fn region(&self, region: Region) -> Result<Grid, VolumeError>;
}

impl Slices for Grid {
    fn dims(&self) -> [usize; 3] {
        self.dims
    }

    fn slice(&self, z: usize) -> Result<Cow<'_, [f32]>, VolumeError> {
        Ok(self.slice(z).into())
    }

    fn region(&self, region: Region) -> Result<Grid, VolumeError> {
        self.part(region)
    }
}

/// A field whose axes are x, z and y of another.
struct Turned<'a>(&'a dyn Slices);

impl Slices for Turned<'_> {
    fn dims(&self) -> [usize; 3] {
        let [nx, ny, nz] = self.0.dims();
        [nx, nz, ny]
    }

    fn slice(&self, y: usize) -> Result<Cow<'_, [f32]>, VolumeError> {
        let [nx, _, nz] = self.0.dims();
        Ok(self.0.region(Region { min: [0, y, 0], dims: [nx, 1, nz] })?.values.into())
    }

    fn region(&self, Region { min: [x, z, y], dims: [nx, nz, ny] }: Region) -> Result<Grid, VolumeError> {
        self.0.region(Region { min: [x, y, z], dims: [nx, ny, nz] })
    }
}

/// Extracts the iso-surface as [`marching_cubes`], with about `most` triangles at most; pauses after slices, each of which
/// is read once.
///
/// # Errors
/// `iso` not finite; [`VolumeError::TooManyTriangles`], [`VolumeError::TooLarge`].
pub(crate) async fn marching_cubes_in_slices(
    field: &dyn Slices,
    iso: f32,
    most: usize,
    pauses: &Pauses,
) -> Result<TriangleMesh, VolumeError> {
    if !iso.is_finite() {
        return Err(VolumeError::invalid("iso", format!("must be finite, got {iso}")));
    }
    let [nx, ny, nz] = field.dims();
    if nx * ny <= LARGE_SLICE || ny <= nz {
        return slice_by_slice(field, iso, most, pauses).await;
    }
    turned(field, iso, most, pauses).await
}

/// Extracts the iso-surface with slices across y.
async fn turned(
    field: &dyn Slices,
    iso: f32,
    most: usize,
    pauses: &Pauses,
) -> Result<TriangleMesh, VolumeError> {
    let mut mesh = slice_by_slice(&Turned(field), iso, most, pauses).await?;
    mesh.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, p.z, p.y));
    // Exchanging two axes is a reflection.
    mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    Ok(mesh)
}

async fn slice_by_slice(
    field: &dyn Slices,
    iso: f32,
    most: usize,
    pauses: &Pauses,
) -> Result<TriangleMesh, VolumeError> {
    let dims = field.dims();
    let mut marching = MarchingCubes::new(dims, iso)?;
    for z in 0..=dims[2] {
        let next = if z < dims[2] { field.slice(z)? } else { Cow::default() };
        let before = marching.mesh.triangles.len();
        marching.layer(z, next)?;
        let count = marching.mesh.triangles.len();
        if count > most {
            return Err(VolumeError::TooManyTriangles { most });
        }
        let work = dims[0] * dims[1] / VOXELS_PER_UNIT + (count - before) / TRIANGLES_PER_UNIT;
        pauses.after(1 + work).await;
    }
    Ok(marching.mesh)
}

/// Reserves memory for `additional` elements of a mesh array, growing it by at least a quarter of its length: doubling
/// the arrays of a large surface would take more memory than everything else.
fn grow<T>(vector: &mut Vec<T>, additional: usize) -> Result<(), TryReserveError> {
    if vector.capacity() - vector.len() >= additional {
        return Ok(());
    }
    let quarter = vector.len() / 4;
    vector.try_reserve_exact(if additional > quarter { additional } else { quarter })
}

/// Maps a mesh from the index coordinates of a grid of `dims` voxels to world coordinates, relative to the origin for that
/// grid, and reverses its triangles if the map is a reflection, so that they still face outwards.
fn to_world(mesh: &mut TriangleMesh, affine: &DAffine3, dims: [usize; 3]) {
    mesh.origin = grid_origin(affine, dims);
    for p in &mut mesh.positions {
        *p = (affine.transform_point3(p.as_dvec3()) - mesh.origin).as_vec3();
    }
    if affine.matrix3.determinant() < 0.0 {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
}

/// State of marching cubes over one grid, processed layer by layer along z. Nodes are voxels of the padded grid: node
/// (x, y, z) is voxel (x-1, y-1, z-1).
struct MarchingCubes<'a> {
    dims: [usize; 3],
    /// The values of the voxels in the two slices of nodes around the current layer of cubes, node slice z at index z % 2;
    /// empty in the padding.
    slices: [Cow<'a, [f32]>; 2],
    iso: f32,
    cases: &'static [Case],
    /// Number of nodes (voxels of the padded grid) along x and along y.
    size: [usize; 2],
    /// For each node of the two z slices around the current layer of cubes, whether it (bit 0) and the next node along
    /// y (bit 1) are inside. Slice z is at index z % 2.
    pairs: [Vec<u8>; 2],
    /// Marching cubes case (one bit per inside corner) of each cube in the current row along x.
    row: Vec<u8>,
    /// Index in the mesh of the vertex on each grid edge of the current layer of cubes, by the node where the edge
    /// starts, in five tables: x edges of the layer's even and odd slice, y edges of these, and z edges between the
    /// two.
    vertices: Vec<u32>,
    mesh: TriangleMesh,
}

impl<'a> MarchingCubes<'a> {
    fn new(dims: [usize; 3], iso: f32) -> Result<Self, VolumeError> {
        let size = [dims[0] + 2, dims[1] + 2];
        let plane = size[0] * size[1];
        Ok(Self {
            dims,
            slices: [Cow::default(), Cow::default()],
            iso,
            cases: cases(),
            size,
            pairs: [filled(0, plane)?, filled(0, plane)?],
            row: filled(0, size[0] - 1)?,
            vertices: filled(0, 5 * plane)?,
            mesh: TriangleMesh::default(),
        })
    }

    /// Adds the surface in all cubes between the node slices `z` and `z + 1` to the mesh; `next` are the values of the
    /// voxels in the latter.
    fn layer(&mut self, z: usize, next: Cow<'a, [f32]>) -> Result<(), VolumeError> {
        self.slices[(z + 1) % 2] = next;
        self.classify(z + 1);
        let offsets = self.edge_offsets(z);
        for y in 0..self.size[1] - 1 {
            self.find_cases(y, z);
            self.reserve_row()?;
            self.emit_row(y, z, &offsets);
        }
        Ok(())
    }

    /// Classifies the nodes of slice `z` as inside or outside, and stores the result in `pairs`.
    fn classify(&mut self, z: usize) {
        let [width, height] = self.size;
        let pairs = &mut self.pairs[z % 2];
        pairs.fill(0);
        let (slice, nx, iso) = (&self.slices[z % 2][..], self.dims[0], self.iso);
        if slice.is_empty() {
            return;
        }
        for y in 1..height - 1 {
            let values = &slice[(y - 1) * nx..y * nx];
            let (before, here) = pairs[(y - 1) * width..(y + 1) * width].split_at_mut(width);
            let nodes = before[1..].iter_mut().zip(&mut here[1..]);
            for ((before, here), &value) in nodes.zip(values) {
                let inside = u8::from(value >= iso);
                *before |= inside << 1;
                *here = inside;
            }
        }
    }

    /// Fills `row` with the marching cubes cases of the cubes that start at the nodes (.., y, z).
    fn find_cases(&mut self, y: usize, z: usize) {
        let width = self.size[0];
        let low = &self.pairs[z % 2][y * width..(y + 1) * width];
        let high = &self.pairs[(z + 1) % 2][y * width..(y + 1) * width];
        let near = low.iter().zip(high);
        let far = low[1..].iter().zip(&high[1..]);
        for (case, (near, far)) in self.row.iter_mut().zip(near.zip(far)) {
            *case = near.0 | near.1 << 2 | far.0 << 4 | far.1 << 6;
        }
    }

    /// Reserves memory for the most that one row of cubes can add to the mesh: three vertices and five triangles per
    /// cube.
    fn reserve_row(&mut self) -> Result<(), VolumeError> {
        let (vertices, triangles) = (3 * self.row.len(), 5 * self.row.len());
        let mesh = &mut self.mesh;
        let bytes = 12 * (mesh.positions.len() + mesh.triangles.len() + vertices + triangles) as u64;
        let too_large = VolumeError::TooLarge { bytes };
        if mesh.positions.len() + vertices > u32::MAX as usize {
            return Err(too_large);
        }
        let grown = grow(&mut mesh.positions, vertices).and_then(|()| grow(&mut mesh.triangles, triangles));
        grown.map_err(|_| too_large)
    }

    /// Appends the vertices and triangles of the row of cubes that start at the nodes (.., y, z) to the mesh; `offsets`
    /// are those of [`Self::edge_offsets`].
    fn emit_row(&mut self, y: usize, z: usize, offsets: &[usize; 12]) {
        let row = std::mem::take(&mut self.row);
        for (chunk, cubes) in row.chunks(16).enumerate() {
            let (all_out, all_in) = cubes.iter().fold((0, 255), |(or, and), &case| (or | case, and & case));
            if all_out == 0 || all_in == 255 {
                continue;
            }
            for (i, &case) in cubes.iter().enumerate() {
                if case != 0 && case != 255 {
                    self.emit_cube([chunk * 16 + i, y, z], case, offsets);
                }
            }
        }
        self.row = row;
    }

    fn emit_cube(&mut self, origin: [usize; 3], case: u8, offsets: &[usize; 12]) {
        let case = &self.cases[usize::from(case)];
        let node = origin[1] * self.size[0] + origin[0];
        for (bit, &edge) in FAR_EDGES.iter().enumerate() {
            if case.far_cuts >> bit & 1 == 1 {
                self.vertices[node + offsets[edge]] = self.mesh.positions.len() as u32;
                self.mesh.positions.push(self.vertex(origin, edge));
            }
        }
        for triangle in &case.triangles {
            let corners = triangle.map(|edge| self.vertices[node + offsets[usize::from(edge)]]);
            self.mesh.triangles.push(corners);
        }
    }

    /// Returns the position, in index coordinates, of the vertex on edge number `edge` of the cube that starts at node
    /// `origin`.
    fn vertex(&self, origin: [usize; 3], edge: usize) -> Vec3 {
        let (axis, offset) = EDGES[edge];
        let from = [0, 1, 2].map(|k| origin[k] + offset[k]);
        let mut to = from;
        to[axis] += 1;
        let mut p = Vec3::from(from.map(|k| k as f32 - 1.0));
        p[axis] += match (self.value(from), self.value(to)) {
            (Some(a), Some(b)) => fraction(a, b, self.iso),
            _ => 0.5,
        };
        p
    }

    /// Returns the grid's value at a node, or `None` in the padding.
    fn value(&self, node: [usize; 3]) -> Option<f32> {
        let [nx, ny, _] = self.dims;
        let [x, y] = [node[0], node[1]].map(|k| k.wrapping_sub(1));
        if x < nx && y < ny { self.slices[node[2] % 2].get(y * nx + x).copied() } else { None }
    }

    /// Returns, for each of the twelve edges of a cube between the slices `z` and `z + 1`, its index in `vertices`
    /// relative to the index of the node where the cube starts.
    fn edge_offsets(&self, z: usize) -> [usize; 12] {
        let plane = self.size[0] * self.size[1];
        EDGES.map(|(axis, [dx, dy, dz])| {
            let table = if axis == 2 { 4 } else { axis * 2 + (z + dz) % 2 };
            table * plane + dy * self.size[0] + dx
        })
    }
}

/// Returns the fraction of the way from a node of value `a` to one of value `b` at which linear interpolation reaches
/// `iso`, kept [`MARGIN`] away from both ends; a half if one of them is not finite.
fn fraction(a: f32, b: f32, iso: f32) -> f32 {
    let difference = b - a;
    let t = if difference.is_finite() {
        (iso - a) / difference
    } else if a.is_finite() && b.is_finite() {
        // Their difference overflows.
        (0.5 * iso - 0.5 * a) / (0.5 * b - 0.5 * a)
    } else {
        0.5
    };
    if t > 1.0 - MARGIN {
        1.0 - MARGIN
    } else if t > MARGIN {
        t
    } else {
        MARGIN
    }
}

fn filled<T: Clone>(value: T, count: usize) -> Result<Vec<T>, VolumeError> {
    let mut out = super::error::reserve(count)?;
    out.resize(count, value);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DMat3, DVec3, Random};
    use crate::mesh::{Mesh, count_self_intersections, measure};
    use crate::volume::{VolumeInit, Voxels};
    use std::collections::BTreeMap;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn slices_across_another_axis_give_the_same_surface() {
        let field = noise([9, 7, 3], 5, 4);
        let none = Pauses::default();
        let usual = finished(slice_by_slice(&field, 0.4, usize::MAX, &none)).unwrap();
        let twice = Turned(&Turned(&field)).slice(1).unwrap().into_owned();
        assert_eq!(twice, field.slice(1));
        let turned = finished(turned(&field, 0.4, usize::MAX, &none)).unwrap();
        let sorted = |mesh: &TriangleMesh| {
            let mut bits: Vec<_> = mesh.positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
            bits.sort_unstable();
            bits
        };
        assert_eq!(sorted(&turned), sorted(&usual));
        assert_eq!(count_self_intersections(&turned), 0);
        let volume = |mesh: &TriangleMesh| measure(mesh).volume;
        assert!(volume(&turned) > 0.0 && (volume(&turned) / volume(&usual) - 1.0).abs() < 0.05);
        Mesh::from_triangles(&turned).unwrap();
    }

    #[test]
    fn too_many_triangles_are_refused_by_their_number() {
        let ball = ball(20, 8.0);
        let bounded = |most| finished(marching_cubes_in_slices(&ball, 0.0, most, &Pauses::default()));
        let count = bounded(usize::MAX).unwrap().triangles.len();
        assert!(bounded(count).is_ok());
        let error = bounded(count - 1).unwrap_err();
        assert_eq!(error, VolumeError::TooManyTriangles { most: count - 1 });
        assert!(error.to_string().starts_with("the contour has more than"), "{error}");
    }

    fn field(dims: [usize; 3], f: impl Fn(Vec3) -> f32) -> Grid {
        let mut values = Vec::new();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                values.extend((0..dims[0]).map(|x| f(Vec3::new(x as f32, y as f32, z as f32))));
            }
        }
        Grid { dims, values }
    }

    fn noise(dims: [usize; 3], seed: u64, levels: u32) -> Grid {
        let mut random = Random::new(seed);
        let mut grid = field(dims, |_| 0.0);
        grid.values.iter_mut().for_each(|v| *v = random.below(levels) as f32);
        grid
    }

    /// Returns the Euler characteristic V − E + F, after asserting that the mesh is closed, oriented, 2-manifold and
    /// without degenerate triangles.
    fn euler(mesh: &TriangleMesh) -> i64 {
        let mut edges = BTreeMap::new();
        let mut links: Vec<BTreeMap<u32, u32>> = vec![BTreeMap::new(); mesh.positions.len()];
        for &[a, b, c] in &mesh.triangles {
            for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
                assert!(edges.insert((p, q), r).is_none(), "edge {p}-{q} is used twice the same way");
                assert!(links[p as usize].insert(q, r).is_none());
            }
            let [pa, pb, pc] = [a, b, c].map(|v| mesh.positions[v as usize]);
            assert!((pb - pa).cross(pc - pa).length() > 0.0, "triangle {a} {b} {c} has no area");
        }
        assert!(edges.keys().all(|&(p, q)| edges.contains_key(&(q, p))), "an edge is open");
        for (vertex, link) in links.iter().enumerate() {
            let start = *link.keys().next().expect("a vertex in no triangle");
            let (mut at, mut steps) = (link[&start], 1);
            while at != start {
                (at, steps) = (link[&at], steps + 1);
            }
            assert_eq!(steps, link.len(), "vertex {vertex} joins two fans");
        }
        mesh.positions.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64
    }

    fn enclosed(mesh: &TriangleMesh) -> f64 {
        let corner = |v: u32| mesh.positions[v as usize].as_dvec3();
        let six = |t: &[u32; 3]| corner(t[0]).cross(corner(t[1])).dot(corner(t[2]));
        mesh.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    fn ball(n: usize, radius: f32) -> Grid {
        let centre = Vec3::splat((n - 1) as f32 / 2.0);
        field([n; 3], |p| radius - p.distance(centre))
    }

    #[test]
    fn a_ball_is_a_sphere_of_the_right_volume_turned_outwards() {
        let mesh = marching_cubes(&ball(40, 14.0), 0.0).unwrap();
        assert_eq!(euler(&mesh), 2);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 14.0f64 * 14.0 * 14.0;
        assert!((enclosed(&mesh) / exact - 1.0).abs() < 0.005, "{} against {exact}", enclosed(&mesh));
        let centre = Vec3::splat(19.5);
        assert!(mesh.positions.iter().all(|p| (p.distance(centre) - 14.0).abs() < 0.02));
    }

    #[test]
    fn a_ball_cut_by_the_border_is_closed_flat_there() {
        let grid = field([24, 24, 10], |p| 8.0 - p.distance(Vec3::new(11.5, 11.5, 1.0)));
        let mesh = marching_cubes(&grid, 0.0).unwrap();
        assert_eq!(euler(&mesh), 2);
        let lowest = mesh.positions.iter().map(|p| p.z).fold(f32::MAX, f32::min);
        assert_eq!(lowest, -0.5);
    }

    #[test]
    fn a_torus_has_a_hole() {
        let grid = field([48, 48, 20], |p| {
            let (dx, dy, dz) = (p.x - 23.5, p.y - 23.5, p.z - 9.5);
            let from_ring = (dx * dx + dy * dy).sqrt() - 15.0;
            5.0 - (from_ring * from_ring + dz * dz).sqrt()
        });
        let mesh = marching_cubes(&grid, 0.0).unwrap();
        assert_eq!(euler(&mesh), 0);
        let exact = 2.0 * std::f64::consts::PI * std::f64::consts::PI * 15.0 * 25.0;
        assert!((enclosed(&mesh) / exact - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_full_grid_is_its_box() {
        let mesh = marching_cubes(&field([3, 4, 5], |_| 1.0), 0.5).unwrap();
        assert_eq!(euler(&mesh), 2);
        // The corners and edges of the box are cut off by the cubes outside them.
        let outer = 3.0 * 4.0 * 5.0;
        let rims = 0.125 * 4.0 * (2.0 + 3.0 + 4.0);
        let corners = 8.0 * (0.125 - 1.0 / 48.0);
        assert!((enclosed(&mesh) - (outer - rims - corners)).abs() < 1e-5, "{}", enclosed(&mesh));
    }

    #[test]
    fn an_empty_grid_gives_nothing_and_one_voxel_an_octahedron() {
        assert_eq!(marching_cubes(&field([5; 3], |_| 0.0), 0.5).unwrap(), TriangleMesh::default());
        let one = marching_cubes(&field([1; 3], |_| 1.0), 1.0).unwrap();
        assert_eq!((one.positions.len(), one.triangles.len(), euler(&one)), (6, 8, 2));
    }

    #[test]
    fn noise_of_every_density_is_a_closed_manifold() {
        for seed in 0..40 {
            for iso in [0.5, 3.0, 5.0, 7.5, 9.0] {
                let mesh = marching_cubes(&noise([9, 8, 10], seed, 10), iso).unwrap();
                let chi = euler(&mesh);
                assert!(chi % 2 == 0 && enclosed(&mesh) > 0.0, "seed {seed}, iso {iso}: chi {chi}");
            }
        }
    }

    #[test]
    fn noise_has_no_self_intersections_in_index_or_world_coordinates() {
        for seed in 0..12 {
            let grid = noise([14, 12, 13], seed, 7);
            let mut mesh = marching_cubes(&grid, 2.0 + (seed % 3) as f32 * 0.75).unwrap();
            assert_eq!(count_self_intersections(&mesh), 0, "seed {seed}, in index coordinates");
            let axes = DMat3::from_cols(
                DVec3::new(0.54, 0.72, 1.2),
                DVec3::new(-1.6, 1.2, 0.0),
                DVec3::new(-1.44, -1.92, 1.8),
            );
            to_world(
                &mut mesh,
                &DAffine3::from_mat3_translation(axes, DVec3::new(-120.0, 90.0, 300.0)),
                grid.dims,
            );
            assert_eq!(count_self_intersections(&mesh), 0, "seed {seed}, in world coordinates");
        }
    }

    #[test]
    fn values_that_equal_iso_or_are_not_numbers_leave_no_empty_triangle() {
        let mut grid = noise([8, 8, 8], 3, 3);
        for (i, v) in grid.values.iter_mut().enumerate() {
            *v = match i % 17 {
                3 => f32::NAN,
                5 => f32::INFINITY,
                11 => f32::NEG_INFINITY,
                _ => *v,
            };
        }
        let mesh = marching_cubes(&grid, 1.0).unwrap();
        assert_eq!(euler(&mesh) % 2, 0);
    }

    #[test]
    fn world_positions_follow_the_affine_and_a_reflection_keeps_triangles_outward() {
        let grid = ball(16, 5.0);
        let volume = |x: f64| {
            Volume::new(VolumeInit {
                affine: DAffine3::from_scale(DVec3::new(x, 2.0, 1.0)),
                ..VolumeInit::new(Voxels::F32(grid.values.clone()), [16, 16, 16, 1])
            })
            .unwrap()
        };
        let straight = marching_cubes_world(&volume(3.0), 0.0, 0).unwrap();
        let mirrored = marching_cubes_world(&volume(-3.0), 0.0, 0).unwrap();
        assert!((enclosed(&straight) - enclosed(&mirrored)).abs() < 1e-3);
        let inner = enclosed(&marching_cubes(&grid, 0.0).unwrap());
        assert!((enclosed(&straight) / (6.0 * inner) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn bad_arguments_are_named() {
        let grid = ball(4, 1.0);
        let named = |result: Result<TriangleMesh, VolumeError>| match result {
            Err(VolumeError::InvalidArgument { parameter, .. }) => parameter,
            other => panic!("{other:?}"),
        };
        assert_eq!(named(marching_cubes(&grid, f32::NAN)), "iso");
        assert_eq!(named(marching_cubes(&Grid { dims: [4, 4, 5], ..grid }, 0.0)), "values");
    }
}
