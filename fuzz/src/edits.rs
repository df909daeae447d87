//! Fuzz targets of single mesh edits, decimation and remeshing.

use super::bytes::Choices;
use super::steppers::shape;
use vesicle::math::Vec3;
use vesicle::mesh::{
    EditError, Mesh, TriangleMesh, count_self_intersections, curvature, geodesic_distances, measure,
};
use vesicle::remesh::{EdgeBounds, Unchecked, decimate, remesh, restructure};
use vesicle::spatial::{cross_section, surface_distance};

/// Number of vertices beyond which [`edits`] makes no more edits.
const MAX_VERTICES: usize = 200;

/// Makes up to 60 random edits of a random mesh. After a failed edit, and after one in four successful ones, the mesh
/// is rolled back and must equal the one before. It must be valid after each.
pub fn edits(data: &[u8]) {
    let bytes = &mut Choices::new(data);
    let Ok(mut mesh) = Mesh::from_triangles(&shape(bytes)) else { return };
    for _ in 0..60 {
        let before = mesh.clone();
        mesh.begin();
        let edited = edit(&mut mesh, bytes);
        if edited.is_err() || bytes.chance(4) {
            mesh.roll_back();
            assert!(mesh.to_triangles() == before.to_triangles(), "taken back, and not as it was");
        } else {
            mesh.commit();
        }
        assert_eq!(mesh.check(), Ok(()));
        if mesh.vertex_count() > MAX_VERTICES || mesh.vertex_count() == 0 {
            return;
        }
    }
}

/// Makes one random edit of the mesh; an error if that edit is impossible.
fn edit(mesh: &mut Mesh, bytes: &mut Choices) -> Result<(), EditError> {
    let live: Vec<_> = mesh.vertices().collect();
    let u = live[bytes.below(live.len())];
    let ring = mesh.ring(u).as_slice().to_vec();
    let w = if bytes.chance(9) { live[bytes.below(live.len())] } else { ring[bytes.below(ring.len())] };
    let middle = (mesh.position(u) + mesh.position(w)) * 0.5;
    match bytes.below(16) {
        0..3 => mesh.split(u, w, middle).map(drop),
        3..6 => mesh.flip(u, w),
        6..11 => mesh.collapse(u, w, middle),
        11 => mesh.join(u, live[bytes.below(live.len())], 0.5 + 0.4 * bytes.unit() as f32).map(drop),
        12 => mesh.remove_tetrahedron(u),
        13 => {
            mesh.set_position(u, bytes.point(2.0).as_vec3());
            Ok(())
        }
        _ => {
            let common = mesh.common_neighbours(u, w);
            let o = *common.get(bytes.below(common.len().max(1))).ok_or(EditError::IsTriangle)?;
            mesh.cut(u, w, o).map(drop)
        }
    }
}

/// Decimates, remeshes or restructures a random mesh one to three times: it stays valid and keeps χ, no
/// self-intersections appear in a mesh without any, and its measures are finite.
pub fn remeshing(data: &[u8]) {
    let bytes = &mut Choices::new(data);
    let given = shape(bytes);
    let Ok(mut mesh) = Mesh::from_triangles(&given) else { return };
    let edge = mesh.longest_edge();
    let (self_intersections, euler) = (count_self_intersections(&given), mesh.euler());
    for _ in 0..1 + bytes.below(3) {
        pass(&mut mesh, edge, bytes);
        assert_eq!(mesh.check(), Ok(()));
        assert_eq!(mesh.euler(), euler);
        let now = mesh.to_triangles();
        assert!(self_intersections > 0 || count_self_intersections(&now) == 0, "the mesh intersects itself");
        assert_measurable(&now);
    }
}

/// Decimates the mesh, remeshes it, or restructures a copy, with random parameters; `edge` is the longest edge at the
/// start.
fn pass(mesh: &mut Mesh, edge: f32, bytes: &mut Choices) {
    let min = edge * bytes.within(0.2, 1.5) as f32;
    let bounds = EdgeBounds { min, max: min * bytes.within(1.9, 5.0) as f32 };
    match bytes.below(3) {
        0 => _ = decimate(mesh, bytes.below(mesh.triangle_count().min(60_000))),
        1 => _ = remesh(mesh, bounds),
        _ => {
            let mut copy = mesh.clone();
            if bounds.check_for(&copy).is_ok() {
                restructure(&mut copy, bounds, &mut Unchecked);
            }
            assert_eq!(copy.check(), Ok(()));
        }
    }
}

/// Asserts that volume, area and a cross-section of a mesh are finite, that curvature and geodesic distances have one
/// value per vertex, and that the distance of the mesh from itself can be computed.
pub fn assert_measurable(mesh: &TriangleMesh) {
    let found = measure(mesh);
    assert!(found.volume.is_finite() && found.area.is_finite());
    assert_eq!(curvature(mesh).mean.len(), mesh.positions.len());
    assert_eq!(geodesic_distances(mesh, 0).map_or(0, |all| all.len()), mesh.positions.len());
    let at = mesh.positions[0];
    let section = cross_section(mesh, at, Vec3::new(0.6, -0.5, 0.7));
    assert!(section.iter().flatten().all(|p| p.is_finite()), "a section at {at}");
    assert!(surface_distance(mesh, mesh).is_ok_and(|found| found.hausdorff >= 0.0));
}
