//! Simplification of a closed surface by clustering its vertices (Rossignac & Borrel, *Multi-resolution 3D approximations for rendering
//! complex scenes*, 1993), here with the topology kept.

use super::{Groups, TriangleMesh};
use crate::math::{IVec3, Vec3};

/// The least cosine of the angle by which a triangle may turn.
const LEAST_TURN: f32 = 0.3;

/// A vertex has at least this many triangles.
const LEAST_VALENCE: u8 = 3;

impl TriangleMesh {
    /// The surface with the vertices of each cell that edges connect within it merged at their mean, where that neither changes the topology nor
    /// turns a triangle over. Normals, colours and the like are left out.
    pub(crate) fn clustered(&self, cell: impl Fn(Vec3) -> IVec3) -> Self {
        let mut clusters = Clusters::new(self, cell);
        clusters.keep_contractible(self);
        loop {
            let merged = clusters.merge(self);
            if !clusters.dissolve_where_wrong(self, &merged) {
                return merged.compact();
            }
        }
    }

    /// Without positions that no triangle has.
    fn compact(mut self) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut names = vec![UNUSED; self.positions.len()];
        let mut positions = Vec::new();
        for corner in self.triangles.iter_mut().flatten() {
            let name = &mut names[*corner as usize];
            if *name == UNUSED {
                *name = positions.len() as u32;
                positions.push(self.positions[*corner as usize]);
            }
            *corner = *name;
        }
        Self { positions, triangles: self.triangles, ..Self::default() }
    }
}

/// The vertex that stands for each vertex: the first of its cluster.
struct Clusters {
    first: Vec<u32>,
}

impl Clusters {
    fn new(mesh: &TriangleMesh, cell: impl Fn(Vec3) -> IVec3) -> Self {
        let cells: Vec<IVec3> = mesh.positions.iter().map(|&p| cell(p)).collect();
        let mut groups = Groups::new(cells.len());
        for [u, v] in edges(mesh) {
            if cells[u] == cells[v] {
                groups.join(u, v);
            }
        }
        Self { first: (0..cells.len()).map(|v| groups.find(v) as u32).collect() }
    }

    /// Dissolves clusters that are no disks, or trees of edges: merging others changes the topology.
    fn keep_contractible(&mut self, mesh: &TriangleMesh) {
        let mut euler = vec![0i32; self.first.len()];
        self.first.iter().for_each(|&c| euler[c as usize] += 1);
        for [u, v] in edges(mesh) {
            euler[self.first[u] as usize] -= i32::from(self.first[u] == self.first[v]);
        }
        for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|v| self.first[v as usize])) {
            euler[a as usize] += i32::from(a == b && b == c);
        }
        self.dissolve(|c| euler[c as usize] != 1);
    }

    fn dissolve(&mut self, goes: impl Fn(u32) -> bool) {
        (0u32..).zip(&mut self.first).filter(|(_, c)| goes(**c)).for_each(|(v, c)| *c = v);
    }

    fn merge(&self, mesh: &TriangleMesh) -> TriangleMesh {
        let mut positions = vec![Vec3::ZERO; mesh.positions.len()];
        let mut members = vec![0u32; mesh.positions.len()];
        for (&p, &c) in mesh.positions.iter().zip(&self.first) {
            positions[c as usize] += p;
            members[c as usize] += 1;
        }
        positions.iter_mut().zip(&members).filter(|(_, n)| **n > 0).for_each(|(p, &n)| *p *= 1.0 / n as f32);
        let triangles = mesh.triangles.iter().map(|t| t.map(|v| self.first[v as usize]));
        let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        TriangleMesh { positions, triangles, ..TriangleMesh::default() }
    }

    /// Dissolves the clusters around edges of more than two triangles, vertices of less than three, and triangles that turned; whether there
    /// were any.
    fn dissolve_where_wrong(&mut self, mesh: &TriangleMesh, merged: &TriangleMesh) -> bool {
        let mut is_wrong = vec![false; self.first.len()];
        let mut valences = vec![0u8; self.first.len()];
        let mut directed: Vec<u64> = Vec::with_capacity(3 * merged.triangles.len());
        for &[a, b, c] in &merged.triangles {
            for (u, v) in [(a, b), (b, c), (c, a)] {
                directed.push(u64::from(u) << 32 | u64::from(v));
                valences[u as usize] = valences[u as usize].saturating_add(1);
            }
        }
        directed.sort_unstable();
        for pair in directed.windows(2).filter(|pair| pair[0] == pair[1]) {
            is_wrong[(pair[0] >> 32) as usize] = true;
            is_wrong[pair[0] as u32 as usize] = true;
        }
        for [a, b, c] in &mesh.triangles {
            let names = [a, b, c].map(|&v| self.first[v as usize]);
            if names[0] == names[1] || names[1] == names[2] || names[2] == names[0] {
                continue;
            }
            let few = names.iter().any(|&v| valences[v as usize] < LEAST_VALENCE);
            let before = normal([a, b, c].map(|&v| mesh.positions[v as usize]));
            let after = normal(names.map(|v| merged.positions[v as usize]));
            if few || before.dot(after) < LEAST_TURN * before.length() * after.length() {
                names.iter().for_each(|&v| is_wrong[v as usize] = true);
            }
        }
        let before = self.first.clone();
        self.dissolve(|c| is_wrong[c as usize]);
        before != self.first
    }
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// The edges of a closed surface.
fn edges(mesh: &TriangleMesh) -> impl Iterator<Item = [usize; 2]> + '_ {
    let around = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    mesh.triangles.iter().flat_map(around).filter(|[u, v]| u < v).map(|e| e.map(|v| v as usize))
}
