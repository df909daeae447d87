//! Triangles in a hierarchy of flat cylinders.

use super::four_triangles::{Facet, FourTriangles};
use crate::math::{Bounds, BoxTree, BoxTreeBuilder, DVec3, Vec3, triangle};
use crate::pauses::Pauses;
use std::ops::Range;

/// Triangles that are sorted, or enclosed in a cylinder, in a unit of work.
const TRIANGLES_PER_UNIT: usize = 64;

/// A bounding volume hierarchy of triangles whose nodes are flat cylinders, along the mean normal of their triangles.
///
/// Boxes do not tell which of many triangles at nearly the same distance is the closest, as in the middle of a ball,
/// where searches would visit hundreds of triangles. Cylinders around flat pieces of a surface are thin.
pub(super) struct CylinderTree {
    boxes: BoxTree,
    /// The cylinder of each node.
    cylinders: Vec<Cylinder>,
    /// The triangles in the order of the leaves.
    corners: Vec<[Vec3; 3]>,
    /// For each node, the number of leaves before it.
    leaves_before: Vec<u32>,
    /// The triangles of each leaf; none if one of them is thin.
    leaves: Vec<Option<FourTriangles>>,
}

impl CylinderTree {
    /// Builds the tree, and pauses meanwhile.
    pub(super) async fn new(triangles: &[Facet], pauses: &Pauses) -> Self {
        let bounds: Vec<_> = triangles.iter().map(|facet| Bounds::from_points(&facet.corners)).collect();
        let mut builder = BoxTreeBuilder::new(&bounds);
        let mut built = 0;
        while let Some(triangles) = builder.advance() {
            built += triangles;
            // Small subtrees are counted together.
            if built >= TRIANGLES_PER_UNIT {
                pauses.after(built / TRIANGLES_PER_UNIT).await;
                built = 0;
            }
        }
        let boxes = builder.finish();
        let facets: Vec<_> = boxes.order().map(|t| triangles[t as usize]).collect();
        let corners: Vec<_> = facets.iter().map(|facet| facet.corners).collect();
        let (mut cylinders, mut leaves_before, mut leaves) = (Vec::new(), Vec::new(), Vec::new());
        let mut enclosed = 0;
        for node in 0..boxes.node_count() {
            let own = &corners[boxes.node_range(node)];
            cylinders.push(Cylinder::around(boxes.node_bounds(node), own));
            leaves_before.push(leaves.len() as u32);
            if boxes.children(node).is_none() {
                leaves.push(FourTriangles::new(&facets[boxes.node_range(node)]));
            }
            enclosed += own.len();
            if enclosed >= TRIANGLES_PER_UNIT {
                pauses.after(enclosed / TRIANGLES_PER_UNIT).await;
                enclosed = 0;
            }
        }
        Self { boxes, cylinders, corners, leaves_before, leaves }
    }

    /// Returns the children of a node; `None` for a leaf.
    #[inline]
    pub(super) fn children(&self, node: usize) -> Option<[usize; 2]> {
        self.boxes.children(node)
    }

    #[inline]
    pub(super) fn cylinder(&self, node: usize) -> &Cylinder {
        &self.cylinders[node]
    }

    /// Returns the triangles below a node, as indices for [`Self::offset_from`].
    #[inline]
    pub(super) fn triangles_of(&self, node: usize) -> Range<usize> {
        self.boxes.node_range(node)
    }

    /// Returns the triangles of a leaf; `None` if one of them is thin.
    #[inline]
    pub(super) fn packed(&self, leaf: usize) -> Option<&FourTriangles> {
        self.leaves[self.leaves_before[leaf] as usize].as_ref()
    }

    /// Returns the leaf below `node` that is probably the closest to `p`.
    pub(super) fn leaf_near(&self, mut node: usize, p: DVec3) -> usize {
        while let Some([a, b]) = self.children(node) {
            let [to_a, to_b] = [a, b].map(|child| self.cylinders[child].offset(p).length_squared());
            node = if to_a <= to_b { a } else { b };
        }
        node
    }

    /// Returns the vector to `p` from the closest point of a triangle.
    #[inline]
    pub(super) fn offset_from(&self, t: usize, p: DVec3) -> DVec3 {
        triangle::from_closest(self.corners[t], p)
    }
}

/// A solid cylinder.
#[derive(Clone, Copy)]
pub(super) struct Cylinder {
    centre: DVec3,
    /// Unit vector along the axis.
    axis: DVec3,
    pub(super) radius: f64,
    /// Half of the length along the axis.
    half_height: f64,
}

impl Cylinder {
    /// Returns a cylinder along the mean normal of triangles that contains these; `bounds` is their bounding box.
    fn around(bounds: &Bounds, triangles: &[[Vec3; 3]]) -> Self {
        let sum = triangles.iter().fold(DVec3::ZERO, |sum, corners| sum + triangle::area_vector(*corners));
        // Without a mean normal any direction will do.
        let axis = sum.try_normalize().unwrap_or(DVec3::X);
        let middle = 0.5 * (bounds.min.as_dvec3() + bounds.max.as_dvec3());
        let (mut low, mut high, mut radius) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for q in triangles.as_flattened().iter().map(|p| p.as_dvec3() - middle) {
            let along = axis.dot(q);
            let across = (q - axis * along).length();
            low = if along < low { along } else { low };
            high = if along > high { along } else { high };
            radius = if across > radius { across } else { radius };
        }
        Self { centre: middle + axis * (0.5 * (low + high)), axis, radius, half_height: 0.5 * (high - low) }
    }

    /// Returns the vector to `p` from the closest point of the cylinder, zero inside.
    #[inline]
    pub(super) fn offset(&self, p: DVec3) -> DVec3 {
        let q = p - self.centre;
        let along = self.axis.dot(q);
        let across = q - self.axis * along;
        let beyond = along.abs() - self.half_height;
        let mut from = DVec3::ZERO;
        if beyond > 0.0 {
            from = self.axis * if along > 0.0 { beyond } else { -beyond };
        }
        let squared = across.length_squared();
        if squared > self.radius * self.radius {
            from += across * (1.0 - self.radius / squared.sqrt());
        }
        from
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::mesh::shapes::{soup, torus};
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Of each node, the closest point of the cylinder is at most as far as any triangle, and all of these are beyond
    /// the plane through it.
    #[test]
    fn cylinders_bound_their_triangles() {
        let mut random = Random::new(2);
        for mesh in [torus(3.0, 1.0, 14, 8), soup(4, 60, 5)] {
            let triangles: Vec<_> = mesh.corners().map(Facet::alone).collect();
            let tree = finished(CylinderTree::new(&triangles, &Pauses::default()));
            assert_eq!(tree.triangles_of(0).len(), triangles.len());
            for node in 0..tree.cylinders.len() {
                let p = DVec3::from([(); 3].map(|()| 10.0 * random.unit() - 5.0));
                let from = tree.cylinder(node).offset(p);
                for t in tree.triangles_of(node) {
                    assert!(tree.offset_from(t, p).length() >= from.length() - 1e-9);
                    let plane = p - from;
                    assert!(tree.corners[t].iter().all(|q| (q.as_dvec3() - plane).dot(from) < 1e-9));
                }
                match tree.children(node) {
                    Some([a, b]) => {
                        let [a, b] = [a, b].map(|child| tree.triangles_of(child));
                        assert_eq!((a.start, a.end, b.end), {
                            let own = tree.triangles_of(node);
                            (own.start, b.start, own.end)
                        });
                    }
                    None => assert!(tree.triangles_of(node).len() <= 4),
                }
            }
        }
    }

    #[test]
    fn the_middle_of_a_ball_is_far_from_all_cylinders() {
        let ball = crate::mesh::Mesh::icosphere(Vec3::ZERO, 1.0, 0.04).unwrap().to_triangles();
        let facets: Vec<_> = ball.corners().map(Facet::alone).collect();
        let tree = finished(CylinderTree::new(&facets, &Pauses::default()));
        let small = (0..tree.cylinders.len()).filter(|node| tree.triangles_of(*node).len() <= 32);
        for distance in small.map(|node| tree.cylinder(node).offset(DVec3::ZERO).length()) {
            assert!(distance > 0.97, "{distance}");
        }
    }
}
