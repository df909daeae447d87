//! A bound of the distance between a mesh that is decimated and the mesh before.
//!
//! Each vertex of the mesh before has a witness: a triangle of the present mesh within the tolerance of it (Klein,
//! Liebich & Straßer, *Mesh reduction with error control*, 1996). A collapse is possible if all vertices whose witness
//! it removes have another one among the new triangles. The vertex that remains has to be within the tolerance of the
//! mesh before.

use super::decimate::{Condition, MAX_NEIGHBOURS};
use crate::math::{Bounds, Vec3, triangle};
use crate::mesh::{Facet, Mesh, MeshError, VertexId};
use crate::pauses::Pauses;
use crate::spatial::TriangleTree;
use smallvec::SmallVec;

/// The vertices of the mesh before decimation, and their witnesses.
pub(super) struct Deviation {
    tolerance: f64,
    before: TriangleTree,
    points: Vec<Vec3>,
    /// The corners of the witness of each point.
    witnesses: Vec<[u32; 3]>,
    /// The points whose witness has a vertex as its first corner, by its slot.
    at: Vec<Vec<u32>>,
    /// A point for which a collapse at a vertex was not possible, by its slot: mostly, it is the reason the next time, too.
    suspects: Vec<Option<u32>>,
    /// The points whose witnesses the collapse tested last removes, and their new ones.
    found: Vec<(u32, [u32; 3])>,
    /// The number of points tested so far, those whose witness is kept included.
    tests: u64,
}

impl Deviation {
    /// Creates the bound `tolerance`, in the length unit of the mesh, of the distance from the present mesh; pauses meanwhile.
    ///
    /// # Errors
    /// As [`TriangleTree::new`].
    pub async fn new(mesh: &Mesh, tolerance: f64, pauses: &Pauses) -> Result<Self, MeshError> {
        let mut deviation = Self {
            tolerance,
            before: TriangleTree::in_slices(&mesh.to_triangles(), pauses).await?,
            points: Vec::new(),
            witnesses: Vec::new(),
            at: vec![Vec::new(); mesh.slots()],
            suspects: vec![None; mesh.slots()],
            found: Vec::new(),
            tests: 0,
        };
        for v in mesh.vertices() {
            if let Some((a, b)) = mesh.ring(v).pairs().next() {
                deviation.at[v.index()].push(deviation.points.len() as u32);
                deviation.points.push(mesh.position(v));
                deviation.witnesses.push([v.0, a.0, b.0]);
            }
        }
        Ok(deviation)
    }

    /// Returns the corners of the first of some triangles, which are in `boxes`, that can be the witness of a point.
    fn witness(&self, point: u32, fresh: &[Facet], boxes: &[Bounds]) -> Option<[u32; 3]> {
        let p = self.points[point as usize];
        let reach = self.tolerance * self.tolerance;
        let mut near =
            fresh.iter().zip(boxes).filter(|(_, around)| around.contains(p)).map(|(facet, _)| facet);
        let witness = near.find(|facet| triangle::distance_squared(facet.points, p.as_dvec3()) <= reach);
        witness.map(|facet| facet.corners)
    }

    /// Returns a box with all points within the tolerance of a triangle.
    fn around(&self, facet: &Facet) -> Bounds {
        let Bounds { min, max } = Bounds::from_points(&facet.points);
        let reach = self.tolerance as f32;
        let largest = min.abs().max(max.abs()).max_element() + reach;
        // More than the sums are rounded by, and the distances.
        let margin = Vec3::splat(reach + ROUNDING * largest);
        Bounds { min: min - margin, max: max + margin }
    }
}

/// A bound of the rounding errors of sums of coordinates, relative to the largest.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

impl Condition for Deviation {
    fn allows(&mut self, mesh: &Mesh, [u, v]: [VertexId; 2], position: Vec3, fresh: &[Facet]) -> bool {
        let boxes: SmallVec<[Bounds; MAX_NEIGHBOURS]> =
            fresh.iter().map(|facet| self.around(facet)).collect();
        let is_removed = |point: u32| is_removed(&self.witnesses[point as usize], [u, v]);
        for point in [u, v].into_iter().filter_map(|w| self.suspects[w.index()]) {
            self.tests += 1;
            if is_removed(point) && self.witness(point, fresh, &boxes).is_none() {
                return false;
            }
        }
        self.found.clear();
        for w in around(mesh, [u, v]) {
            self.tests += self.at[w.index()].len() as u64;
            for &point in self.at[w.index()].iter().filter(|&&point| is_removed(point)) {
                let Some(witness) = self.witness(point, fresh, &boxes) else {
                    for end in [u, v] {
                        self.suspects[end.index()] = Some(point);
                    }
                    return false;
                };
                self.found.push((point, witness));
            }
        }
        self.before.is_within(position, self.tolerance)
    }

    fn adopt(&mut self, mesh: &Mesh, edge: [VertexId; 2]) {
        for w in around(mesh, edge) {
            let witnesses = &self.witnesses;
            self.at[w.index()].retain(|&point| !is_removed(&witnesses[point as usize], edge));
        }
        for &(point, witness) in &self.found {
            self.witnesses[point as usize] = witness;
            self.at[witness[0] as usize].push(point);
        }
    }

    fn tests(&self) -> u64 {
        self.tests
    }
}

/// Returns the ends of an edge and their neighbours, which are the corners of all triangles that its collapse removes
/// or replaces.
fn around(mesh: &Mesh, edge: [VertexId; 2]) -> Vec<VertexId> {
    let mut vertices = edge.to_vec();
    mesh.add_neighbours(&mut vertices);
    vertices
}

/// Returns whether a collapse of an edge removes or replaces the triangle with the given corners.
fn is_removed(corners: &[u32; 3], edge: [VertexId; 2]) -> bool {
    edge.iter().any(|end| corners.contains(&end.0))
}
