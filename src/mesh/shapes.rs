//! Simple shapes for tests.

use super::TriangleMesh;
use crate::math::{Random, Vec3};

/// The faces of a box by the indices of their corners, counter-clockwise seen from outside; bits 0 to 2 of an index are
/// the x, y and z coordinates in a unit cube.
const FACES: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

fn cuboid_corner(i: u32, size: Vec3) -> Vec3 {
    Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * size
}

/// Returns the corners of each face of the box from the origin to `size`, counter-clockwise seen from outside.
pub fn cuboid_faces(size: Vec3) -> [[Vec3; 4]; 6] {
    FACES.map(|face| face.map(|i| cuboid_corner(i, size)))
}

/// Returns a mesh of the box from the origin to `size`.
pub fn cuboid(size: Vec3) -> TriangleMesh {
    TriangleMesh {
        positions: (0..8).map(|i| cuboid_corner(i, size)).collect(),
        triangles: FACES.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Default::default()
    }
}

/// Returns a regular icosahedron of edge length 2 centred at the origin.
pub fn icosahedron() -> TriangleMesh {
    let g = 1.618_034_f32;
    let rectangle = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)];
    let in_xy = rectangle.map(|(a, b)| Vec3::new(a, b, 0.0));
    let in_yz = rectangle.map(|(a, b)| Vec3::new(0.0, a, b));
    let in_zx = rectangle.map(|(a, b)| Vec3::new(b, 0.0, a));
    let fans = [
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11]],
        [[1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8]],
        [[3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9]],
        [[4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]],
    ];
    TriangleMesh { positions: [in_xy, in_yz, in_zx].concat(), triangles: fans.concat(), ..Default::default() }
}

/// Returns a torus around the z axis: a tube of radius `minor` around a circle of radius `major`, with `around`
/// vertices along the circle times `along` vertices around the tube.
pub fn torus(major: f64, minor: f64, around: u32, along: u32) -> TriangleMesh {
    let angle = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let point = |i: u32, j: u32| {
        let (u, v) = (angle(i, around), angle(j, along));
        let r = major + minor * libm::cos(v);
        Vec3::new((r * libm::cos(u)) as f32, (r * libm::sin(u)) as f32, (minor * libm::sin(v)) as f32)
    };
    let at = |i: u32, j: u32| (i % around) * along + j % along;
    let cells = || (0..around).flat_map(move |i| (0..along).map(move |j| (i, j)));
    TriangleMesh {
        positions: cells().map(|(i, j)| point(i, j)).collect(),
        triangles: cells()
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect(),
        ..Default::default()
    }
}

/// Returns the disjoint union of meshes; only positions and triangles are kept.
pub fn joined(meshes: &[TriangleMesh]) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    meshes.iter().for_each(|mesh| all.append(mesh));
    all
}

/// Returns `triangles` random triangles over half as many points with integer coordinates from 0 to `range` − 1, for
/// tests of invalid input; if the range is small, they include all kinds of degeneracies.
pub fn soup(seed: u64, triangles: usize, range: u32) -> TriangleMesh {
    let mut random = Random::new(seed);
    let mut next = |limit: u32| random.below(limit);
    let points = triangles as u32 / 2;
    TriangleMesh {
        positions: (0..points).map(|_| Vec3::from_array([(); 3].map(|()| next(range) as f32))).collect(),
        triangles: (0..triangles).map(|_| [(); 3].map(|()| next(points))).collect(),
        ..Default::default()
    }
}
