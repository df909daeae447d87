//! A bounding volume hierarchy of triangles, for closest-point, ray and overlap queries.

use crate::math::triangle::{self, Line, LineHit};
use crate::math::{Bounds, BoxTree, BoxTreeBuilder, DVec3, Ray, Vec3};
use crate::mesh::{MeshError, TriangleMesh};
use crate::pauses::{Pauses, finished};

/// The number of triangles of a subtree whose node is a unit of work to build.
const TRIANGLES_PER_UNIT: usize = 32;

/// A bounding volume hierarchy of the triangles of a static mesh, for closest-point, ray and overlap queries.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    boxes: BoxTree,
    corners: Vec<[Vec3; 3]>,
}

/// A point on a surface found by a query, with its distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The index of a triangle that contains the point; a query of [`TriangleTree`] returns the lowest of those found
    /// at the same distance.
    pub triangle: u32,
    /// The barycentric coordinates in the triangle: not negative, with a sum of 1.
    pub barycentric: Vec3,
    /// The position of the point, in the coordinates of the mesh.
    pub point: Vec3,
    /// The distance from the query point, or the signed distance from the origin of the ray or line, negative behind
    /// it, in the length unit of the mesh.
    pub distance: f64,
}

impl TriangleTree {
    /// Creates the tree of the triangles of a mesh.
    ///
    /// # Errors
    /// As [`TriangleMesh::validate`], for example [`MeshError::InvalidArgument`] for an invalid index or a position
    /// that is not finite.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, MeshError> {
        finished(Self::in_slices(mesh, &Pauses::default()))
    }

    /// Creates the tree as [`Self::new`] does, and pauses meanwhile.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub async fn in_slices(mesh: &TriangleMesh, pauses: &Pauses) -> Result<Self, MeshError> {
        mesh.validate()?;
        let corners: Vec<_> = mesh.corners().collect();
        let bounds: Vec<_> = corners.iter().map(|c| Bounds::from_points(c)).collect();
        let mut builder = BoxTreeBuilder::new(&bounds);
        drop(bounds);
        let mut built = 0;
        while let Some(triangles) = builder.advance() {
            built += triangles;
            // Small subtrees are counted together.
            if built >= TRIANGLES_PER_UNIT {
                pauses.after(built / TRIANGLES_PER_UNIT).await;
                built = 0;
            }
        }
        Ok(Self { boxes: builder.finish(), corners })
    }

    /// Creates a tree without triangles, in which queries find nothing.
    pub(super) fn empty() -> Self {
        Self { boxes: BoxTree::default(), corners: Vec::new() }
    }

    /// Returns the closest point of the surface to `p`; `None` if there are no triangles or `p` is not finite.
    pub fn closest(&self, p: Vec3) -> Option<SurfacePoint> {
        self.closest_counting(p, &mut 0)
    }

    /// Returns what [`Self::closest`] returns, and adds the number of triangles visited to `tests`.
    pub(super) fn closest_counting(&self, p: Vec3, tests: &mut usize) -> Option<SurfacePoint> {
        if !p.is_finite() {
            return None;
        }
        let mut best: Option<(f64, u32, DVec3)> = None;
        self.boxes.nearest(p, |item, bound| {
            *tests += 1;
            let corners = self.corners[item as usize];
            let barycentric = triangle::closest_barycentric(corners, p);
            let distance = triangle::point_at(corners, barycentric).distance_squared(p.as_dvec3());
            if best.is_none_or(|(d, t, _)| (distance, item) < (d, t)) {
                best = Some((distance, item, barycentric));
            }
            if distance < bound { distance } else { bound }
        });
        best.map(|(squared, item, barycentric)| {
            SurfacePoint::on(item, self.corners[item as usize], barycentric, squared.sqrt())
        })
    }

    /// Returns whether the distance from `p` to the surface is at most `distance`.
    pub fn is_within(&self, p: Vec3, distance: f64) -> bool {
        let reach = distance * distance;
        let mut found = false;
        self.boxes.within(p, reach, |item| {
            let corners = self.corners[item as usize];
            let closest = triangle::point_at(corners, triangle::closest_barycentric(corners, p));
            found |= closest.distance_squared(p.as_dvec3()) <= reach;
            found
        });
        found
    }

    /// Sets `found` to the distinct labels of all triangles within `distance` of `p`; `label` maps a triangle to its
    /// label, such as the component that it belongs to.
    pub fn labels_within(&self, p: Vec3, distance: f64, label: impl Fn(u32) -> u32, found: &mut Vec<u32>) {
        let reach = distance * distance;
        found.clear();
        self.boxes.within(p, reach, |item| {
            let own = label(item);
            if !found.contains(&own) {
                let corners = self.corners[item as usize];
                let closest = triangle::point_at(corners, triangle::closest_barycentric(corners, p));
                if closest.distance_squared(p.as_dvec3()) <= reach {
                    found.push(own);
                }
            }
            false
        });
    }

    /// Returns the first intersection with the ray from `origin` along `direction`, which need not be normalised.
    /// Triangles are hit from either side. `None` if there is no intersection, if `direction` is zero, or if either is
    /// not finite.
    pub fn ray_hit(&self, origin: Vec3, direction: Vec3) -> Option<SurfacePoint> {
        let (origin, direction) = normalized_ray(origin, direction)?;
        let (line, mut nearest) = (Line::new(origin, direction), NearestHit::within(f64::INFINITY));
        self.boxes.along_ray(&Ray::new(origin, direction), |item| {
            let hit = line.hit(self.corners[item as usize]);
            nearest.add(item, hit.filter(|hit| hit.distance >= 0.0))
        });
        nearest.point(|item| self.corners[item as usize])
    }

    /// Returns the intersection with the line through `origin` along `direction` that is nearest to `origin`, at most
    /// `max_distance` away. Its `distance` is negative behind `origin`. Otherwise as [`Self::ray_hit`].
    pub fn line_hit(&self, origin: Vec3, direction: Vec3, max_distance: f64) -> Option<SurfacePoint> {
        let (origin, direction) = normalized_ray(origin, direction)?;
        let (line, mut nearest) = (Line::new(origin, direction), NearestHit::within(max_distance));
        self.boxes.along_line(&Ray::new(origin, direction), max_distance, |item| {
            nearest.add(item, line.hit(self.corners[item as usize]))
        });
        nearest.point(|item| self.corners[item as usize])
    }

    /// Calls `visit` with the index of every triangle whose bounding box intersects `bounds`.
    pub fn for_each_overlapping(&self, bounds: &Bounds, visit: impl FnMut(u32)) {
        self.boxes.for_each_overlapping(bounds, visit);
    }
}

impl SurfacePoint {
    fn on(triangle: u32, corners: [Vec3; 3], barycentric: DVec3, distance: f64) -> Self {
        let point = triangle::point_at(corners, barycentric).as_vec3();
        Self { triangle, barycentric: barycentric.as_vec3(), point, distance }
    }
}

/// Returns the origin and unit direction of a ray in double precision; `None` if one of them is not finite or the
/// direction is zero.
fn normalized_ray(origin: Vec3, direction: Vec3) -> Option<(DVec3, DVec3)> {
    let direction = direction.as_dvec3().try_normalize()?;
    origin.is_finite().then(|| (origin.as_dvec3(), direction))
}

/// The nearest intersection of a ray or line with triangles found so far in a query; among equally near ones, that of
/// the triangle with the lowest index.
pub struct NearestHit {
    max_distance: f64,
    found: Option<(u32, LineHit)>,
}

impl NearestHit {
    /// Starts a query for intersections at most `max_distance` from the origin of the line, in lengths of its
    /// direction.
    pub fn within(max_distance: f64) -> Self {
        Self { max_distance, found: None }
    }

    /// Records `hit`, the intersection of the line with the triangle of index `item`, if there is one and it is nearer
    /// than the nearest so far; returns the distance from the line's origin beyond which the query may skip triangles.
    #[inline]
    pub fn add(&mut self, item: u32, hit: Option<LineHit>) -> f64 {
        let Some(hit) = hit else { return self.max_distance };
        let distance = hit.distance.abs();
        if distance < self.max_distance
            || distance == self.max_distance && self.found.is_none_or(|(nearest, _)| item < nearest)
        {
            (self.max_distance, self.found) = (distance, Some((item, hit)));
        }
        self.max_distance
    }

    /// Returns the nearest intersection as a point on the surface, `None` if none was found; `corners` returns the
    /// corner positions of a triangle.
    pub fn point(&self, corners: impl FnOnce(u32) -> [Vec3; 3]) -> Option<SurfacePoint> {
        let (item, hit) = self.found?;
        Some(SurfacePoint::on(item, corners(item), hit.barycentric, hit.distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns triangles of various sizes around the origin, and query points.
    fn scattered() -> (TriangleMesh, Vec<Vec3>) {
        let mut random = Random::new(9);
        let mut next = || 2.0 * random.unit() as f32 - 1.0;
        let mut point = |scale: f32| Vec3::new(next(), next(), next()) * scale;
        let mut mesh = TriangleMesh::default();
        for i in 0..400 {
            let centre = point(10.0);
            let size = if i % 20 == 0 { 5.0 } else { 0.5 };
            mesh.positions.extend([centre + point(size), centre + point(size), centre + point(size)]);
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        (mesh, (0..300).map(|_| point(15.0)).collect())
    }

    #[test]
    fn closest_is_that_of_brute_force() {
        let (mesh, points) = scattered();
        let tree = TriangleTree::new(&mesh).unwrap();
        for p in points {
            let found = tree.closest(p).unwrap();
            let distance = |c: [Vec3; 3]| {
                triangle::point_at(c, triangle::closest_barycentric(c, p)).distance(p.as_dvec3())
            };
            let expected = mesh.corners().map(distance).fold(f64::INFINITY, f64::min);
            assert_eq!(found.distance, expected);
            assert!((found.point.distance(p) - expected as f32).abs() < 1e-5);
        }
    }

    #[test]
    fn rays_hit_what_brute_force_hits() {
        let (mesh, points) = scattered();
        let tree = TriangleTree::new(&mesh).unwrap();
        let mut hits = 0;
        for pair in points.windows(2) {
            let (origin, direction) = (pair[0], pair[1] - pair[0]);
            let unit = direction.as_dvec3().normalize();
            let line = Line::new(origin.as_dvec3(), unit);
            let distances = mesh.corners().filter_map(|c| line.hit(c)).map(|hit| hit.distance);
            let expected = distances.filter(|&distance| distance >= 0.0).min_by(f64::total_cmp);
            let found = tree.ray_hit(origin, direction);
            assert_eq!(found.map(|hit| hit.distance), expected);
            hits += usize::from(found.is_some());

            let behind = tree.ray_hit(origin, -direction);
            let nearest =
                [found, behind].into_iter().flatten().map(|hit| hit.distance).min_by(f64::total_cmp);
            let on_line = tree.line_hit(origin, direction, f64::INFINITY);
            assert_eq!(on_line.map(|hit| hit.distance.abs()), nearest);
            let is_ahead = found.is_some() && found.map(|hit| hit.distance) == nearest;
            assert!(on_line.is_none_or(|hit| (hit.distance > 0.0) == is_ahead));
            let half = nearest.unwrap_or(1.0) * 0.5;
            assert_eq!(tree.line_hit(origin, direction, half), None);
        }
        assert!(hits > 30, "{hits}");
    }

    #[test]
    fn a_ray_along_the_axes_meets_a_flat_square() {
        let square = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        };
        let tree = TriangleTree::new(&square).unwrap();
        for p in [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.5, 0.0), Vec3::new(1.0, 0.25, 0.0)] {
            let hit = tree.ray_hit(p + Vec3::Z * 3.0, -Vec3::Z * 7.0).unwrap();
            assert_eq!((hit.point, hit.distance), (p, 3.0));
        }
        assert_eq!(tree.ray_hit(Vec3::new(0.5, 0.5, 3.0), Vec3::Z), None);
    }

    #[test]
    fn all_overlapping_boxes_are_found() {
        let (mesh, points) = scattered();
        let tree = TriangleTree::new(&mesh).unwrap();
        for pair in points.windows(2) {
            let bounds = Bounds::from_points(pair);
            let mut found = Vec::new();
            tree.for_each_overlapping(&bounds, |t| found.push(t));
            found.sort_unstable();
            let meets =
                |t: &u32| Bounds::from_points(&mesh.corners().nth(*t as usize).unwrap()).overlaps(&bounds);
            assert_eq!(found, (0..mesh.triangles.len() as u32).filter(meets).collect::<Vec<_>>());
        }
    }

    #[test]
    fn nothing_to_find() {
        let empty = TriangleTree::new(&TriangleMesh::default()).unwrap();
        assert_eq!(empty.closest(Vec3::ZERO), None);
        assert_eq!(empty.ray_hit(Vec3::ZERO, Vec3::X), None);
        let (mesh, _) = scattered();
        let tree = TriangleTree::new(&mesh).unwrap();
        assert_eq!(tree.ray_hit(Vec3::ZERO, Vec3::ZERO), None);
        assert_eq!(tree.ray_hit(Vec3::NAN, Vec3::X), None);
        assert_eq!(tree.line_hit(Vec3::NAN, Vec3::X, 1.0), None);
        assert_eq!(tree.closest(Vec3::INFINITY), None);
    }
}
