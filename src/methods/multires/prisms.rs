//! Lists, for each triangle of a coarser surface, the triangles of the next finer one that the normals of the coarser
//! one can hit. Testing a line against these few replaces a tree query, which took half of the time of a frame with
//! much detail.

use super::correspondence::{BasePoint, normal_at};
use super::detail::Band;
use crate::math::triangle::Line;
use crate::math::{Bounds, DVec3, Vec3};
use crate::spatial::{NearestHit, SurfacePoint};

/// For each triangle of one surface, the triangles of another that may intersect its prism: the points of the triangle
/// moved along its interpolated normals by up to the prism's depth, to either side. Replaces most tree queries for hits
/// along these normals.
#[derive(Clone, Debug)]
pub(super) struct PrismLookup {
    /// By triangle, the start of its list in `candidates`; one more entry is the end of the last list.
    first: Vec<u32>,
    candidates: Vec<u32>,
    depths: Vec<f32>,
}

/// Depth of the prism of a triangle, as a multiple of the largest distance to the other surface along the normals at
/// its corners and centroid. With less, more normals fall back to the tree; with more, the lists of candidates grow
/// long.
const DEPTH: f64 = 1.5;

/// Widening of a prism against rounding, as a share of the largest absolute value of its coordinates.
const ROUNDING: f64 = 1e-5;

/// Smallest cosine between the normals at two corners of a triangle for which a prism is made: with more divergent
/// normals it would be much too wide, and the tree is used.
const MIN_COSINE: f32 = 0.1;

impl PrismLookup {
    /// Builds the lists for the triangles of `from` among those of `to`, with prisms no deeper than `search_distance`,
    /// in units of the mesh.
    pub fn new(from: &Band, to: &Band, search_distance: f64) -> Self {
        let count = from.walker.mesh().triangles.len();
        let mut prisms = Self { first: vec![0], candidates: Vec::new(), depths: Vec::with_capacity(count) };
        for t in 0..count as u32 {
            let depth = depth(from, to, search_distance, t).min(search_distance);
            prisms.depths.push(depth as f32);
            if depth > 0.0 {
                let prism = Prism::new(from, t, depth);
                to.walker.tree().for_each_overlapping(&prism.bounds(), |other| {
                    if prism.may_intersect(to.walker.corners(other)) {
                        prisms.candidates.push(other);
                    }
                });
            }
            prisms.first.push(prisms.candidates.len() as u32);
        }
        prisms
    }

    /// Returns the intersection of the surface `to` with the line through `at` along `normal` that is nearest to `at`,
    /// on either side and no farther away than `search_distance`; `None` if there is none. The result is that of the
    /// tree of `to`, which is queried only if the lists of candidates contain no hit.
    pub fn line_hit(
        &self,
        to: &Band,
        at: &BasePoint,
        normal: Vec3,
        search_distance: f64,
    ) -> Option<SurfacePoint> {
        let t = at.triangle as usize;
        let line = Line::new(at.point.as_dvec3(), normal.as_dvec3().try_normalize()?);
        let mut nearest = NearestHit::within(f64::from(self.depths[t]));
        for &other in &self.candidates[self.first[t] as usize..self.first[t + 1] as usize] {
            nearest.add(other, line.hit(to.walker.corners(other)));
        }
        let found = nearest.point(|other| to.walker.corners(other));
        found.or_else(|| to.walker.tree().line_hit(at.point, normal, search_distance))
    }
}

/// Returns the depth of the prism of triangle `t`, in units of the mesh; 0, for no prism, if the normals at its corners
/// diverge too much, or no normal at its corners and centroid hits `to`.
fn depth(from: &Band, to: &Band, search_distance: f64, t: u32) -> f64 {
    let third = Vec3::splat(1.0 / 3.0);
    let farthest = [Vec3::X, Vec3::Y, Vec3::Z, third].into_iter().filter_map(|weights| {
        let at = BasePoint::at(&from.walker, t, weights);
        let normal = normal_at(&from.walker, &from.normals, &at);
        to.walker.tree().line_hit(at.point, normal, search_distance).map(|hit| hit.distance.abs())
    });
    let normals = corner_normals(from, t);
    let bends = (0..3).any(|k| normals[k].dot(normals[(k + 1) % 3]) < MIN_COSINE);
    if bends { 0.0 } else { DEPTH * farthest.fold(0.0, f64::max) }
}

fn corner_normals(from: &Band, t: u32) -> [Vec3; 3] {
    from.walker.mesh().triangles[t as usize].map(|v| from.normals[v as usize])
}

/// A convex body that contains all points of a triangle moved along its interpolated normals by up to a given depth.
///
/// A normal is n = Σ wᵢ nᵢ / s with the barycentric weights w, the normals nᵢ at the corners cᵢ, and s² = |Σ wᵢ nᵢ|² ≥
/// min nᵢ·nⱼ. Moved by d, a point is at Σ wᵢ (cᵢ + (d/s) nᵢ): between the corners, each moved along its own normal by
/// no more than d/s.
struct Prism {
    /// The three corners of the triangle moved outwards along their normals, then the three moved inwards.
    points: [DVec3; 6],
    /// For each edge of the triangle, the outward unit vector at right angles to it and to the mean normal:
    /// approximately the normal of the lateral face of the prism.
    axes: [DVec3; 3],
    margin: f64,
}

impl Prism {
    fn new(from: &Band, t: u32, depth: f64) -> Self {
        let corners = from.walker.corners(t).map(Vec3::as_dvec3);
        let normals = corner_normals(from, t).map(Vec3::as_dvec3);
        let square = (0..3).map(|k| normals[k].dot(normals[(k + 1) % 3])).fold(1.0, f64::min);
        let length = depth / square.sqrt();
        let points = std::array::from_fn(|i| {
            let side = if i < 3 { length } else { -length };
            corners[i % 3] + normals[i % 3] * side
        });
        let normal = normals[0] + normals[1] + normals[2];
        let axes =
            std::array::from_fn(|k| (corners[(k + 1) % 3] - corners[k]).cross(normal).normalize_or_zero());
        let size = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max) + length;
        Self { points, axes, margin: ROUNDING * size }
    }

    fn bounds(&self) -> Bounds {
        let (mut min, mut max) = (self.points[0], self.points[0]);
        self.points.iter().for_each(|&p| (min, max) = (min.min(p), max.max(p)));
        let margin = DVec3::splat(self.margin);
        Bounds { min: (min - margin).as_vec3(), max: (max + margin).as_vec3() }
    }

    /// Returns whether a triangle may intersect the prism: false if a plane at right angles to one of `axes`, about
    /// parallel to a lateral face, separates the two. The caller has tested the bounding boxes.
    fn may_intersect(&self, corners: [Vec3; 3]) -> bool {
        self.axes.iter().all(|axis| {
            let (least, most) = extent(axis, &self.points);
            let (low, high) = extent(axis, &corners.map(Vec3::as_dvec3));
            low <= most + self.margin && least - self.margin <= high
        })
    }
}

fn extent(axis: &DVec3, points: &[DVec3]) -> (f64, f64) {
    points.iter().map(|p| axis.dot(*p)).fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::mesh::Mesh;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns two bands with the same centre: a smooth sphere, and one with waves.
    fn pair() -> (Band, Band) {
        let ball = |edge: f32| Mesh::icosphere(Vec3::new(3.0, 0.0, 0.0), 1.0, edge).unwrap().to_triangles();
        let mut wavy = ball(0.07);
        let wave = |p: &Vec3| 1.0 + 0.1 * libm::sin(f64::from(p.x * 9.0)) * libm::cos(f64::from(p.y * 7.0));
        let middle = Vec3::new(3.0, 0.0, 0.0);
        wavy.positions.iter_mut().for_each(|p| *p = middle + (*p - middle) * wave(p) as f32);
        let band = |mesh| std::rc::Rc::try_unwrap(Band::of(mesh).unwrap()).unwrap();
        (band(ball(0.12)), band(wavy))
    }

    #[test]
    fn lookups_hit_the_same_triangles_as_the_tree() {
        let (from, to) = pair();
        let prisms = PrismLookup::new(&from, &to, 0.5);
        let count = from.walker.mesh().triangles.len();
        let mut random = Random::new(8);
        for k in 0..20_000 {
            let (u, v) = (random.unit() as f32, random.unit() as f32);
            let weights = if u + v < 1.0 {
                Vec3::new(1.0 - u - v, u, v)
            } else {
                Vec3::new(u + v - 1.0, 1.0 - u, 1.0 - v)
            };
            let triangle = (k % count) as u32;
            let at = BasePoint::at(&from.walker, triangle, weights);
            let normal = normal_at(&from.walker, &from.normals, &at);
            let expected = to.walker.tree().line_hit(at.point, normal, 0.5);
            assert_eq!(prisms.line_hit(&to, &at, normal, 0.5), expected, "{triangle} {weights}");
            assert!(expected.is_some());
        }
        // The lists are short, so few triangles are tested in vain.
        let mean = prisms.candidates.len() as f64 / count as f64;
        assert!(mean < 20.0, "{mean}");
        assert!(prisms.depths.iter().all(|&depth| depth > 0.0));
    }
}
