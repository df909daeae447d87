//! Closed surfaces that are each difficult in one respect, and one with every attribute that a mesh file can hold.

use super::scenes::{chain, potential, volume};
use super::{Random, torus_around};
use vesicle::math::{Vec2, Vec3};
use vesicle::mesh::{Mesh, TriangleMesh};
use vesicle::volume::marching_cubes_world;

/// Scale factors that flatten a mesh to a plane, a line or a point, make squares underflow or overflow in single
/// precision, or stretch it to a thread.
pub const HOSTILE_SCALES: [Vec3; 6] = [
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(1.0, 0.0, 0.0),
    Vec3::ZERO,
    Vec3::splat(1e-30),
    Vec3::splat(1e30),
    Vec3::new(100.0, 1e-3, 1e-3),
];

/// Returns a unit sphere about the origin, scaled by `stretch`.
pub fn ellipsoid(edge: f32, stretch: Vec3) -> TriangleMesh {
    let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, edge).unwrap().to_triangles();
    mesh.positions.iter_mut().for_each(|p| *p *= stretch);
    TriangleMesh { normals: None, ..mesh }
}

/// Returns the octahedron |x| + |y| + |z| = 1, with normals, texture coordinates and colours at its vertices.
pub fn octahedron() -> TriangleMesh {
    let quarter = |[x, y]: [u32; 2]| [[x, y, 4], [y, x, 5]];
    let positions = vec![Vec3::X, Vec3::Y, -Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::Z];
    TriangleMesh {
        triangles: [[0, 1], [1, 2], [2, 3], [3, 0]].into_iter().flat_map(quarter).collect(),
        normals: Some(positions.clone()),
        uvs: Some(positions.iter().map(|p| Vec2::new(0.1 + p.x / 3.0, p.y)).collect()),
        colors: Some(positions.iter().map(|p| (*p + 1.0) / 2.0).collect()),
        positions,
        ..TriangleMesh::default()
    }
}

/// Returns the octahedron without any attributes.
pub fn bare_octahedron() -> TriangleMesh {
    let TriangleMesh { positions, triangles, .. } = octahedron();
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

/// Returns the octahedron with a seam: one triangle has texture coordinates of its own.
pub fn octahedron_with_seam() -> TriangleMesh {
    let mesh = octahedron();
    let uvs = mesh.uvs.clone().unwrap_or_default();
    let mut corner_uvs: Vec<[Vec2; 3]> = mesh.triangles.iter().map(|t| t.map(|v| uvs[v as usize])).collect();
    corner_uvs[3] = [Vec2::new(7.0, 7.5), Vec2::new(8.0, 7.5), Vec2::new(7.0, 8.5)];
    TriangleMesh { uvs: None, corner_uvs: Some(corner_uvs), ..mesh }
}

/// Joins several meshes into one.
pub fn joined(parts: &[TriangleMesh]) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    for part in parts {
        let first = all.positions.len() as u32;
        all.positions.extend(&part.positions);
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

fn moved(mut mesh: TriangleMesh, scale: f32, shift: Vec3) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p = *p * scale + shift);
    mesh
}

fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh
}

/// Returns a box whose faces are grids of squares, two triangles each, with `n` squares along each axis; `size` is that
/// of the box.
pub fn cuboid(n: [u32; 3], size: Vec3) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut names = std::collections::BTreeMap::new();
    let cells = Vec3::new(n[0] as f32, n[1] as f32, n[2] as f32);
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0, n[axis]] {
            for (i, j) in (0..n[u]).flat_map(|i| (0..n[v]).map(move |j| (i, j))) {
                let mut corner = |i: u32, j: u32| {
                    let mut at = [0; 3];
                    (at[axis], at[u], at[v]) = (side, i, j);
                    *names.entry(at).or_insert_with(|| {
                        mesh.positions.push(Vec3::from(at.map(|c| c as f32)) / cells * size);
                        mesh.positions.len() as u32 - 1
                    })
                };
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                let pair = if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
                mesh.triangles.extend(pair);
            }
        }
    }
    mesh
}

/// Returns the contour of a ball with noise: rough, with small components and handles.
pub fn noisy_ball() -> TriangleMesh {
    let noise = |p: Vec3| Random((p.x + 32.0 * (p.y + 32.0 * p.z)) as u64).unit();
    let centre = Vec3::splat(15.5);
    let noisy = volume([32; 3], |p| potential(p.distance(centre), 10.0) + 0.3 * noise(p));
    marching_cubes_world(&noisy, 0.65, 0).unwrap()
}

/// Returns the marching-cubes surface of a gyroid in a ball: one component with many handles.
pub fn gyroid() -> TriangleMesh {
    let centre = Vec3::splat(23.5);
    let solid = volume([48; 3], |p| {
        let wave = |k: usize| libm::sincosf((p[k] - centre[k]) * 0.27);
        let [(sx, cx), (sy, cy), (sz, cz)] = [wave(0), wave(1), wave(2)];
        (sx * cy + sy * cz + sz * cx).min(0.2 * (21.0 - p.distance(centre)))
    });
    marching_cubes_world(&solid, 0.0, 0).unwrap()
}

/// Returns a ball with twelve spikes.
pub fn thorny() -> TriangleMesh {
    let thorns = Mesh::icosahedron(Vec3::ZERO, 1.0).to_triangles().positions;
    let mut mesh = ellipsoid(0.05, Vec3::ONE);
    for p in &mut mesh.positions {
        let nearest = thorns.iter().map(|t| t.normalize().dot(p.normalize())).fold(-1.0, f32::max);
        *p *= 1.0 + libm::expf(-60.0 * (1.0 - nearest));
    }
    mesh
}

/// Returns a spindle: ten long triangles between its two tips.
pub fn spindle() -> TriangleMesh {
    let around = |k: u32| {
        let (sine, cosine) = libm::sincosf(k as f32 * std::f32::consts::TAU / 5.0);
        Vec3::new(cosine, sine, 0.0)
    };
    let mut positions: Vec<Vec3> = (0..5).map(around).collect();
    positions.extend([Vec3::Z * 4.0, -Vec3::Z * 4.0]);
    let triangles = (0..5).flat_map(|k| [[k, (k + 1) % 5, 5], [(k + 1) % 5, k, 6]]).collect();
    TriangleMesh { positions, triangles, ..Default::default() }
}

/// Returns all shapes with their names.
pub fn all() -> Vec<(&'static str, TriangleMesh)> {
    let ball = ellipsoid(0.1, Vec3::ONE);
    vec![
        ("torus", torus_around(Vec3::ZERO, [120, 40], [3.0, 1.0])),
        ("uneven torus", torus_around(Vec3::ZERO, [300, 12], [3.0, 1.0])),
        ("cube of twelve", cuboid([1; 3], Vec3::ONE)),
        ("cube", cuboid([16; 3], Vec3::ONE)),
        ("thin slab", cuboid([40, 40, 1], Vec3::new(1.0, 1.0, 0.004))),
        ("thin shell", joined(&[ball.clone(), inside_out(moved(ball.clone(), 0.99, Vec3::ZERO))])),
        ("needle", ellipsoid(0.05, Vec3::new(0.03, 0.03, 3.0))),
        ("balls 0.002 apart", joined(&[ball.clone(), moved(ball.clone(), 1.0, Vec3::X * 2.002)])),
        ("linked rings", marching_cubes_world(&chain(), 0.5, 0).unwrap()),
        ("noisy ball", noisy_ball()),
        ("gyroid", gyroid()),
        ("thorny ball", thorny()),
        ("spindle", spindle()),
    ]
}
