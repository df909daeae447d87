//! What several test files need.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::f32::consts::TAU;
use vesicle::math::Vec3;
use vesicle::mesh::TriangleMesh;

/// A small seeded generator (SplitMix64), the same numbers natively and in wasm.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`, which is not 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// A torus of `n` × `m` vertices around the z axis through `centre`; the radii are those of the ring and of the tube.
pub fn torus_around(centre: Vec3, [n, m]: [u32; 2], [ring, tube]: [f32; 2]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..n {
        for j in 0..m {
            let (a, b) = (TAU * i as f32 / n as f32, TAU * j as f32 / m as f32);
            let r = ring + tube * libm::cosf(b);
            mesh.positions
                .push(centre + Vec3::new(r * libm::cosf(a), r * libm::sinf(a), tube * libm::sinf(b)));
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}
