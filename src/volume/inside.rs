//! Voxelisation: which voxels are inside a closed surface.

use crate::math::predicates::orient2d;
use crate::math::{DVec2, Vec3};
use crate::mesh::TriangleMesh;
use fixedbitset::FixedBitSet;

/// Returns, for each voxel of a grid of `dims`, x fastest, whether its centre is inside the closed `surface`, whose
/// positions are voxel indices: whether a ray along x has crossed the surface an odd number of times before it. Used to
/// find regions that a deformable model does not cover.
///
/// Exact except for centres within rounding of the surface: exact predicates decide rays through edges and vertices.
pub fn voxels_inside(surface: &TriangleMesh, dims: [usize; 3]) -> FixedBitSet {
    let count = dims.iter().product();
    let mut crossings_parity = FixedBitSet::with_capacity(count);
    for [a, b, c] in &surface.triangles {
        cross_triangle(&surface.positions, [*a, *b, *c], dims, &mut crossings_parity);
    }
    let mut inside = FixedBitSet::with_capacity(count);
    let mut ahead = crossings_parity.ones().peekable();
    while let Some(first) = ahead.next() {
        let end_of_row = (first / dims[0] + 1) * dims[0];
        let end = ahead.next_if(|next| *next < end_of_row).unwrap_or(end_of_row);
        inside.insert_range(first..end);
    }
    inside
}

/// Processes one triangle of the surface: for each row of voxels along x that it crosses, toggles the bit in
/// `crossings_parity` of the first voxel at or beyond the triangle.
fn cross_triangle(
    positions: &[Vec3],
    corners: [u32; 3],
    dims: [usize; 3],
    crossings_parity: &mut FixedBitSet,
) {
    let [a, b, c] = corners.map(|v| positions[v as usize].as_dvec3());
    let normal = (b - a).cross(c - a);
    let span = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).ceil().max(0.0);
        let high = a[axis].max(b[axis]).max(c[axis]).floor();
        // Casting a negative number to `usize` gives 0, so empty ranges are handled first.
        if high < low { 0..0 } else { low as usize..(high as usize + 1).min(dims[axis]) }
    };
    for z in span(2) {
        for y in span(1) {
            let at = DVec2::new(y as f64, z as f64);
            if normal.x == 0.0 || !projection_contains(positions, corners, at) {
                continue;
            }
            let x = a.x - (normal.y * (at.x - a.y) + normal.z * (at.y - a.z)) / normal.x;
            let first = x.ceil().max(0.0) as usize;
            if first < dims[0] {
                crossings_parity.toggle(first + dims[0] * (y + dims[1] * z));
            }
        }
    }
}

/// Returns whether the projection of the triangle along x contains the point `at`, (y, z). The point is perturbed
/// symbolically by an infinitesimal amount along y and a smaller one along z, so that it lies on no edge.
fn projection_contains(positions: &[Vec3], [a, b, c]: [u32; 3], at: DVec2) -> bool {
    let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|edge| is_left(positions, edge, at));
    ab.is_some() && ab == bc && bc == ca
}

/// Returns whether the point `at` is to the left of an edge projected along x; `None` if the edge projects to a point.
/// Consistent for the two triangles that share the edge, so that a ray through it counts once.
fn is_left(positions: &[Vec3], [from, to]: [u32; 2], at: DVec2) -> Option<bool> {
    let (low, high) = if from < to { (from, to) } else { (to, from) };
    let [p, q] = [low, high].map(|v| {
        let p = positions[v as usize].as_dvec3();
        DVec2::new(p.y, p.z)
    });
    // The first nonzero value decides: the predicate, then the perturbations along y and z.
    let signs = [orient2d([p, q, at]), p.y - q.y, q.x - p.x];
    let sign = signs.into_iter().find(|sign| *sign != 0.0)?;
    Some((sign > 0.0) == (from < to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, joined, torus};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Compares each voxel with the expected value, if there is one.
    fn check(surface: &TriangleMesh, dims: [usize; 3], expected: impl Fn(Vec3) -> Option<bool>) {
        let (inside, mut checked) = (voxels_inside(surface, dims), [0; 2]);
        for (i, inside) in (0..dims.iter().product()).map(|i| (i, inside.contains(i))) {
            let p = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]].map(|k| k as f32);
            if let Some(expected) = expected(Vec3::from(p)) {
                assert_eq!(inside, expected, "at {p:?}");
                checked[usize::from(inside)] += 1;
            }
        }
        assert!(checked[0] > 100 && checked[1] >= 27, "{checked:?} checked");
    }

    fn moved(mut surface: TriangleMesh, by: Vec3) -> TriangleMesh {
        surface.positions.iter_mut().for_each(|p| *p += by);
        surface
    }

    #[test]
    fn voxels_of_a_ball_and_its_hollow() {
        let at = Vec3::new(9.3, 8.1, 10.4);
        let outer = Mesh::icosphere(at, 7.0, 0.8).unwrap().to_triangles();
        let mut inner = Mesh::icosphere(at, 3.0, 0.8).unwrap().to_triangles();
        inner.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        check(&joined(&[outer, inner]), [20, 19, 21], |p| match p.distance(at) {
            d if (d - 3.0).abs() < 0.1 || (d - 7.0).abs() < 0.1 => None,
            d => Some(d > 3.0 && d < 7.0),
        });
    }

    /// Tests a cuboid placed so that all rays of the voxelisation pass through its edges or vertices.
    #[test]
    fn rays_along_edges_count_once() {
        let surface = moved(cuboid(Vec3::splat(4.0)), Vec3::splat(3.0));
        let bounds = surface
            .positions
            .iter()
            .fold((Vec3::MAX, Vec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
        check(&surface, [12, 12, 12], |p| {
            let beyond = (bounds.0 - p).max(p - bounds.1).max_element();
            (beyond != 0.0).then_some(beyond < 0.0)
        });
    }

    #[test]
    fn a_surface_beyond_the_grid_is_cut_off() {
        let surface = moved(torus(6.0, 2.0, 24, 12), Vec3::new(0.1, 0.2, 3.1));
        let inside = voxels_inside(&surface, [5, 7, 6]);
        let turned = voxels_inside(&moved(surface, Vec3::new(20.0, 20.0, 20.0)), [40, 40, 40]);
        for i in 0..5 * 7 * 6 {
            let [x, y, z] = [i % 5, i / 5 % 7, i / 35];
            assert_eq!(inside.contains(i), turned.contains(x + 20 + 40 * (y + 20 + 40 * (z + 20))));
        }
        assert!(voxels_inside(&TriangleMesh::default(), [2, 2, 2]).is_clear());
    }
}
