//! Volume that a moving surface has lost or gained since the beginning, and the displacements that give it back where
//! that was: smoothing takes it from what is thin or convex, which is not where the area is.
//!
//! The volume that each vertex has swept since the beginning, and its displacement, are averaged over neighbours. The
//! averages are undone: the volume by an offset along the normal, the displacement along the surface, without which ends of thin
//! parts would grow into needles of hardly any volume. Both count from the beginning, and not from move to move, so that
//! errors do not add up: whatever extends over more than the average stays where it is, however often the surface is
//! smoothed.

use crate::math::{Vec3, Vec4};
use crate::mesh::Mesh;
use crate::pauses::Pauses;

/// The number of times that changes are averaged over neighbours; the width of the average is about its root, in edges.
/// With 8, noise of six edges remains that smoothing alone removes; with 48, a rod of one voxel's thickness grows by 3 %
/// instead of 1 %.
const AVERAGES: usize = 24;

/// Vertices whose changes are averaged, per unit of work.
const PER_UNIT: usize = 200;

/// The volume that a mesh of constant connectivity has gained since the beginning, and where.
pub(super) struct VolumeBalance {
    /// Positions at the beginning, by slot.
    start: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Derivative of the volume by an offset of each vertex along its normal at the beginning, averaged as changes are.
    sizes: Vec<f32>,
    /// The index of the first link of each vertex, by slot, and their number.
    first: Vec<u32>,
    /// The neighbours of all vertices, and the share of the difference that both exchange in one average.
    links: Vec<(u32, f32)>,
    /// Area-weighted normals, by slot.
    normals: Vec<Vec3>,
    /// The displacement of each vertex since the beginning, and the volume that it has swept; the second is the next
    /// average.
    changes: [Vec<Vec4>; 2],
}

impl VolumeBalance {
    /// Begins at the present positions of `mesh`.
    pub async fn new(mesh: &Mesh, pauses: &Pauses) -> Self {
        let (first, links) = links(mesh);
        let mut balance = Self {
            start: mesh.positions().to_vec(),
            triangles: mesh.triangles().map(|corners| corners.map(|v| v.0)).collect(),
            sizes: Vec::new(),
            first,
            links,
            normals: vec![Vec3::ZERO; mesh.slots()],
            changes: [(); 2].map(|()| vec![Vec4::ZERO; mesh.slots()]),
        };
        pauses.after(mesh.slots() / PER_UNIT).await;
        balance.set_normals(mesh.positions());
        balance.changes[0] = balance.normals.iter().map(|&normal| Vec4::splat(size(normal))).collect();
        balance.average(pauses).await;
        balance.sizes = balance.changes[0].iter().map(|size| size.w).collect();
        balance
    }

    /// Sets `displacements` to those that give volume back where it was lost, by offsets of at most `most`.
    pub async fn displacements(
        &mut self,
        positions: &[Vec3],
        most: f32,
        displacements: &mut [Vec3],
        pauses: &Pauses,
    ) {
        self.set_normals(positions);
        pauses.after(positions.len() / PER_UNIT).await;
        self.measure(positions);
        self.average(pauses).await;
        for (i, displacement) in displacements.iter_mut().enumerate() {
            let change = self.changes[0][i];
            // Where neighbours are much smaller, their average would give too large an offset, and then oscillate.
            let offset = change.w / self.sizes[i].max(size(self.normals[i]));
            // NaN without an area.
            let offset = if offset.is_finite() { offset.clamp(-most, most) } else { 0.0 };
            let normal = self.normals[i].normalize_or_zero();
            let drift = change.truncate();
            *displacement = normal * (drift.dot(normal) - offset) - drift;
        }
    }

    /// Sets the normals to those of a mesh, as [`Mesh::area_normal`] returns them.
    fn set_normals(&mut self, positions: &[Vec3]) {
        self.normals.fill(Vec3::ZERO);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| positions[v as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&v| self.normals[v as usize] += normal);
        }
    }

    /// Sets the changes to those since the beginning.
    fn measure(&mut self, positions: &[Vec3]) {
        let changes = &mut self.changes[0];
        for ((change, &start), &now) in changes.iter_mut().zip(&self.start).zip(positions) {
            *change = (now - start).extend(0.0);
        }
        for triangle in &self.triangles {
            let start = triangle.map(|v| self.start[v as usize]);
            let displacements = triangle.map(|v| changes[v as usize].truncate());
            let third = mean_area(start, displacements) / 3.0;
            for (&v, displacement) in triangle.iter().zip(displacements) {
                changes[v as usize].w += displacement.dot(third);
            }
        }
    }

    /// Averages the changes over neighbours. What one vertex gives, another one gets, so that sums are kept.
    async fn average(&mut self, pauses: &Pauses) {
        let [from, to] = &mut self.changes;
        for _ in 0..AVERAGES {
            for ((to, own), ends) in to.iter_mut().zip(from.iter()).zip(self.first.windows(2)) {
                let links = &self.links[ends[0] as usize..ends[1] as usize];
                *to = links.iter().fold(*own, |sum, &(v, share)| sum + (from[v as usize] - *own) * share);
            }
            std::mem::swap(from, to);
            pauses.after(from.len() / PER_UNIT).await;
        }
    }
}

/// Returns the index of the first link of each vertex and the number of all; and the links. Shares are symmetric, and
/// those of a vertex are less than 1 in sum, which keeps averages stable at any valence.
fn links(mesh: &Mesh) -> (Vec<u32>, Vec<(u32, f32)>) {
    let mut first = Vec::with_capacity(mesh.slots() + 1);
    let mut links = Vec::with_capacity(2 * mesh.edge_count());
    first.push(0);
    for ring in mesh.rings() {
        links.extend(ring.as_slice().iter().map(|&v| {
            let valence = ring.valence().max(mesh.ring(v).valence());
            (v.0, 1.0 / (1.0 + valence as f32))
        }));
        first.push(links.len() as u32);
    }
    (first, links)
}

/// Returns the derivative of the volume by an offset of a vertex along its normal, from the area-weighted normal.
fn size(area_normal: Vec3) -> f32 {
    area_normal.length() / 6.0
}

/// Returns the mean area of a triangle while its corners move straight, as a vector along its normal: the volume that it
/// sweeps is the product of this and the mean displacement.
fn mean_area([a, b, c]: [Vec3; 3], [da, db, dc]: [Vec3; 3]) -> Vec3 {
    let (u, v, du, dv) = (b - a, c - a, db - da, dc - da);
    (u.cross(v) + (u.cross(dv) + du.cross(v)) / 2.0 + du.cross(dv) / 3.0) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::measure;
    use crate::mesh::shapes::torus;
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn what_vertices_sweep_is_the_difference_of_the_volumes() {
        let before = torus(3.0, 1.0, 30, 12);
        let mut after = before.clone();
        after.positions.iter_mut().for_each(|p| *p += Vec3::new(0.2 * p.y, 0.1 * p.x * p.z, 0.3 * p.z));
        let mesh = Mesh::from_triangles(&before).unwrap();
        let mut balance = finished(VolumeBalance::new(&mesh, &Pauses::default()));
        balance.measure(&after.positions);
        let swept = |balance: &VolumeBalance| balance.changes[0].iter().map(|c| f64::from(c.w)).sum::<f64>();
        let expected = measure(&after).volume - measure(&before).volume;
        assert!((swept(&balance) / expected - 1.0).abs() < 1e-4, "{} {expected}", swept(&balance));
        finished(balance.average(&Pauses::default()));
        assert!((swept(&balance) / expected - 1.0).abs() < 1e-4, "{} {expected}", swept(&balance));
    }
}
