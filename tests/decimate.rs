mod common;
#[path = "common/scenes.rs"]
mod scenes;
use vesicle::math::Vec3;
use vesicle::mesh::{Mesh, TriangleMesh, count_crossings, measure};
use vesicle::remesh::decimate;
#[test]
fn probe() {
    let torus = common::torus_around(Vec3::ZERO, [400, 125], [3.0, 1.0]);
    let ball = Mesh::icosphere(Vec3::ZERO, 1.0, 0.03).unwrap().to_triangles();
    for (name, mesh) in [("torus", torus), ("ball", ball)] {
        for target in [mesh.triangles.len() / 10, 100, 4] {
            let mut m = Mesh::from_triangles(&mesh).unwrap();
            let t = std::time::Instant::now();
            decimate(&mut m, target);
            let t = t.elapsed();
            m.check().unwrap();
            let out = m.to_triangles();
            let (a, b) = (measure(&mesh), measure(&out));
            println!(
                "{name} {} -> {} ({target}) {t:?} crossings {} vol {:.5} area {:.5} euler {} {} minangle {:.3} edges {:.3} {:.3}",
                mesh.triangles.len(),
                out.triangles.len(),
                count_crossings(&out),
                b.volume / a.volume,
                b.area / a.area,
                a.euler,
                b.euler,
                b.min_angle_degrees,
                b.edge_min,
                b.edge_max
            );
        }
    }
}
