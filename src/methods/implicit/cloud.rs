//! Input points of an implicit surface: validation, scaling into the normalised box, in which their longest side is 2,
//! removal of duplicates, and clustering against outliers (Dinh, Turk & Slabaugh, section VI-D).

use crate::math::order::{rank_f32, sort_by_rank, sort_distinct, sort_triples};
use crate::math::{Bounds, DAffine3, DMat3, DVec3, PositionIndex, Vec3, symmetric};
use crate::methods::MethodError;

/// A point cloud near a surface, with optional normals, confidences and colours; the input of an implicit surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Positions of the points near the surface, in world units relative to `origin`; in units of the normalised box after
    /// `mapped`.
    pub points: Vec<Vec3>,
    /// The origin of the points in world space, 0 unless they are far away for their extent; see
    /// [`WorldPositions::relative`](crate::mesh::WorldPositions::relative). All other positions that the surface is given,
    /// and those that it returns, are relative to it; its meshes have it.
    pub origin: DVec3,
    /// Outward normal of each point, of any length, which shows on which side the outside is; estimated where needed if
    /// `None`.
    pub normals: Option<Vec<Vec3>>,
    /// Confidence of each point, in (0, 1]: the regularisation λ of its constraint is divided by it, so that points of
    /// low confidence are fitted loosely. `None` means 1 for all.
    pub confidence: Option<Vec<f32>>,
    /// Red, green and blue of each point, in 0..1, for colouring a surface that no camera sees; `None` if the points
    /// have no colours.
    pub colors: Option<Vec<Vec3>>,
}

/// Minimum number of distinct points in the input cloud: fewer span no volume.
pub const MIN_POINTS: usize = 4;
/// Length of the clusters that are kept, relative to that of all points, below which the others are far outliers: in the
/// paper's figures, it is 0.79.
const FAR: f64 = 0.5;
/// Edge length of the grid cells by which points are grouped into clusters, in mean spacings of the points: the points
/// of touching cells are in one cluster.
pub const CLUSTER_CELL: f64 = 2.0;
/// Share of the points, as its inverse, that may be outliers at either end of an axis.
const ENDS: usize = 100;
/// Length of the other points, relative to that of all, below which there is a warning: at a quarter, the object is 16 to 40
/// cells long.
const SMALL: f32 = 0.25;
/// Mean component of normals away from the middle of the points, relative to the distance from it, below which they point
/// inwards. On twenty closed shapes it is .2 to .7 for outward normals; on an open sheet it may be a little below 0.
const INWARD: f64 = -0.1;
/// Number of points below which none counts as an outlier without being told.
const FEW_POINTS: usize = 20;
/// Ratio of the least to the largest standard deviation of points along their principal axes up to which a cloud counts
/// as flat, and is rejected because it spans no volume.
const FLAT: f64 = 1e-6;
/// The refusal of points that span no volume. An outlier that is far enough away has the same effect as a plane.
const FLAT_CLOUD: &str = "have to span a volume: all lie in one plane, or some are so far away that the others coincide in \
                          comparison; remove such outliers, or add points outside the plane";

impl Cloud {
    /// Checks that each array has one entry per point, that all values are finite, and that confidences are in (0, 1].
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the array, and its first bad entry or its length.
    pub fn validate(&self) -> Result<(), MethodError> {
        let count = self.points.len();
        check_finite("points", &self.points)?;
        for (name, found) in [
            ("normals", self.normals.as_ref().map(Vec::len)),
            ("confidence", self.confidence.as_ref().map(Vec::len)),
            ("colors", self.colors.as_ref().map(Vec::len)),
        ] {
            if let Some(found) = found.filter(|&found| found != count) {
                let problem = format!("must have one entry per point, {count}, got {found}");
                return Err(MethodError::invalid(name, problem));
            }
        }
        check_finite("normals", self.normals.as_deref().unwrap_or_default())?;
        check_finite("colors", self.colors.as_deref().unwrap_or_default())?;
        let confidence = self.confidence.as_deref().unwrap_or_default();
        match confidence.iter().position(|&c| !(c > 0.0 && c <= 1.0)) {
            Some(i) => {
                let problem = format!("must be > 0 and ≤ 1, got {} at point {i}", confidence[i]);
                Err(MethodError::invalid("confidence", problem))
            }
            None => Ok(()),
        }
    }

    /// Whether the normals that were given point to the middle of the points more than away from it.
    pub fn has_inward_normals(&self) -> bool {
        let Some(normals) = &self.normals else { return false };
        let middle = self.points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / self.len() as f64;
        let (mut along, mut all) = (0.0, 0.0);
        for (p, normal) in self.points.iter().zip(normals) {
            let offset = p.as_dvec3() - middle;
            along += offset.dot(normal.as_dvec3().normalize_or_zero());
            all += offset.length();
        }
        along < INWARD * all
    }

    /// Returns the number of points in the cloud.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns whether the cloud has no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Returns the cloud of the points with the given indices, in the order of the indices, with their attributes.
    pub fn select(&self, indices: &[u32]) -> Self {
        fn gather<T: Copy>(all: &[T], indices: &[u32]) -> Vec<T> {
            indices.iter().map(|&i| all[i as usize]).collect()
        }
        Self {
            points: gather(&self.points, indices),
            origin: self.origin,
            normals: self.normals.as_ref().map(|all| gather(all, indices)),
            confidence: self.confidence.as_ref().map(|all| gather(all, indices)),
            colors: self.colors.as_ref().map(|all| gather(all, indices)),
        }
    }

    /// Returns the cloud without duplicates: of each set of points with equal positions, the first is kept with its
    /// attributes; the order is unchanged.
    pub fn distinct(&self) -> Self {
        let index = PositionIndex::new(&self.points);
        let mut first: Vec<u32> = index.distinct().filter_map(|mut equal| equal.next()).collect();
        sort_distinct(&mut first);
        if first.len() == self.len() { self.clone() } else { self.select(&first) }
    }

    /// Checks that the cloud has at least `MIN_POINTS` points, the fewest that span a volume.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for fewer points.
    pub fn check_count(&self) -> Result<(), MethodError> {
        if self.len() >= MIN_POINTS {
            return Ok(());
        }
        let problem = format!("must have at least {MIN_POINTS} distinct points, got {}", self.len());
        Err(MethodError::invalid("points", problem))
    }

    /// Checks that the points span a volume, as a closed surface near them requires.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for points in one plane, or so near to one that their least standard deviation
    /// is at most 1e-6 of their largest.
    pub fn check_span(&self) -> Result<(), MethodError> {
        let mean = self.points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / self.len() as f64;
        let (spread, _) = symmetric::eigen(self.points.iter().fold(DMat3::ZERO, |sum, p| {
            let d = p.as_dvec3() - mean;
            sum + symmetric::outer(d)
        }));
        if spread.x <= FLAT * FLAT * spread.z {
            return Err(MethodError::invalid("points", FLAT_CLOUD));
        }
        Ok(())
    }

    /// Returns the cloud without far outliers, and their positions: points in none of the `keep` largest clusters, if these
    /// clusters are less than half as long as the cloud. Where they are longer, outliers hardly matter for the box, and that of
    /// the paper is around all points.
    pub fn without_far_outliers(self, keep: usize) -> (Self, Vec<Vec3>) {
        let kept = self.largest_clusters(keep);
        let inner = self.select(&kept);
        if inner.len() < MIN_POINTS || inner.length() >= FAR * self.length() {
            return (self, Vec::new());
        }
        // Beside outliers at other scales, cells of clusters were too large.
        let outside = self.points_outside(&inner);
        let (near, far) = inner.without_far_outliers(keep);
        (near, [far, outside].concat())
    }

    /// Returns the indices of the points in the `keep` largest clusters, in ascending order, to discard outliers.
    pub fn largest_clusters(&self, keep: usize) -> Vec<u32> {
        // Scaled, but not moved: between far outliers, rounding would move the others together.
        let scale = BoxMap::of(&self.points).scale();
        let points: Vec<Vec3> = self.points.iter().map(|p| (p.as_dvec3() * scale).as_vec3()).collect();
        largest_clusters(&points, (CLUSTER_CELL * mean_spacing(&points)) as f32, keep)
    }

    /// Returns half the longest side of the bounding box of the points, which must not all be equal.
    fn length(&self) -> f64 {
        1.0 / BoxMap::of(&self.points).scale()
    }

    /// Returns the points that are not in `other`.
    pub fn points_outside(&self, other: &Self) -> Vec<Vec3> {
        if other.len() == self.len() {
            return Vec::new();
        }
        let known = PositionIndex::new(&other.points);
        self.points.iter().copied().filter(|&p| known.find(p).is_none()).collect()
    }

    /// Whether nearly all points are in a small part of the bounding box of all: without a hundredth at either end of each
    /// axis, its longest side is less than a quarter as long.
    pub fn has_far_outliers(&self) -> bool {
        let ends = self.len().div_ceil(ENDS);
        let ranges = |left_out: usize| {
            let range = |axis: usize| {
                let mut values: Vec<f32> = self.points.iter().map(|p| p[axis]).collect();
                sort_by_rank(&mut values, |&x| u64::from(rank_f32(x)));
                values[values.len() - 1 - left_out] - values[left_out]
            };
            (0..3).map(range).fold(0.0, f32::max)
        };
        self.len() >= FEW_POINTS && ranges(ends) < SMALL * ranges(0)
    }

    /// Returns the cloud with its points mapped by `map` from world units into the normalised box. Normals are
    /// unchanged, as `map` neither rotates nor mirrors.
    pub fn mapped(&self, map: &BoxMap) -> Self {
        Self { points: self.points.iter().map(|&p| map.in_box(p)).collect(), ..self.clone() }
    }
}

/// Maximum number of points in each list that becomes constraints (samples, exterior and added points): the matrix of
/// the linear system for that many takes about 2 GB.
pub const MAX_POINTS: usize = 100_000;

/// Checks that a list of `count` points has at most [`MAX_POINTS`].
///
/// # Errors
/// [`MethodError::InvalidArgument`] with the name of the list, `name`, and both numbers, if it has more.
pub fn check_max_count(name: &'static str, count: usize) -> Result<(), MethodError> {
    if count <= MAX_POINTS {
        return Ok(());
    }
    Err(MethodError::invalid(name, format!("must have at most {MAX_POINTS} points, got {count}")))
}

/// Checks that all vectors of a list of points, normals or colours are finite.
///
/// # Errors
/// [`MethodError::InvalidArgument`] with the name of the list, `name`, and its first vector that is not.
pub fn check_finite(name: &'static str, values: &[Vec3]) -> Result<(), MethodError> {
    match values.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(MethodError::invalid(name, format!("point {i} must be finite, got {}", values[i]))),
        None => Ok(()),
    }
}

/// Smallest accepted size of a point cloud, which is the longest side of its bounding box in world units; limited by
/// single precision.
const MIN_SIZE: f64 = 1e-27;
/// Largest accepted size of a point cloud, which is the longest side of its bounding box in world units; limited by
/// single precision.
const MAX_SIZE: f64 = 1e38;
/// Maximum distance of the points of a cloud from the origin along an axis, in units of the longest side of their
/// bounding box: at this distance, the smallest extraction cell that single precision resolves is already 1/30 of that
/// side.
const MAX_SIZES_FROM_ORIGIN: f64 = 240.0;

/// Uniform map from world units (those of the input points) into the normalised box, which is centred at the origin and
/// has a longest side of 2, and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxMap {
    centre: DVec3,
    /// Units of the normalised box per world unit.
    scale: f64,
}

impl BoxMap {
    /// Returns the map that puts the bounding box of `points`, which must not all be equal, into the normalised box.
    pub fn of(points: &[Vec3]) -> Self {
        let bounds = Bounds::from_points(points);
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        Self { centre: min * 0.5 + max * 0.5, scale: 1.0 / (max * 0.5 - min * 0.5).max_element() }
    }

    /// Returns an upper bound of the absolute coordinates of the points from which the map was made, in world units.
    /// The larger it is, the coarser is single precision at the points.
    pub fn max_coordinate(&self) -> f64 {
        self.centre.abs().max_element() + 1.0 / self.scale
    }

    /// Checks that single precision resolves the vertices of a surface near the points from which the map was made.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for points whose bounding box is too small or too large, or too far from the
    /// origin for its size.
    pub fn check_precision(&self) -> Result<(), MethodError> {
        let size = 2.0 / self.scale;
        let largest = self.max_coordinate() + size;
        let bad = |problem| Err(MethodError::invalid("points", problem));
        if !(MIN_SIZE..=MAX_SIZE).contains(&size) {
            return bad(format!("the longest side must be from {MIN_SIZE:e} to {MAX_SIZE:e}, got {size:e}"));
        }
        let away = self.max_coordinate() / size;
        if largest > f64::from(f32::MAX) {
            return bad(format!("coordinates with margin reach {largest:e}, beyond single precision"));
        }
        if away <= MAX_SIZES_FROM_ORIGIN {
            return Ok(());
        }
        bad(format!(
            "they lie {away:.0} times their size from the origin, but single precision is sufficient for at most \
             {MAX_SIZES_FROM_ORIGIN} times: translate them"
        ))
    }

    /// Returns the number of units of the normalised box per world unit.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Maps a world point into the normalised box, rounded to single precision.
    pub fn in_box(&self, p: Vec3) -> Vec3 {
        self.in_box_exactly(p.as_dvec3()).as_vec3()
    }

    /// Maps a world point into the normalised box, in double precision.
    pub fn in_box_exactly(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale
    }

    /// Maps a point of the normalised box to world units.
    pub fn in_world(&self, p: DVec3) -> DVec3 {
        p / self.scale + self.centre
    }

    /// Returns positions in world units, from those in the normalised box.
    pub fn all_in_world<'a>(&self, points: impl IntoIterator<Item = &'a Vec3>) -> Vec<Vec3> {
        points.into_iter().map(|p| self.in_world(p.as_dvec3()).as_vec3()).collect()
    }

    /// Returns the map from world units into the normalised box as an affine transformation, for cameras.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.centre)
    }
}

/// Returns the mean distance from a point to its nearest neighbour, in the units of `points`, estimated from at most
/// 4000 of them. There must be at least two points. It is the unit of search radii and cell sizes.
pub fn mean_spacing(points: &[Vec3]) -> f64 {
    let tree =
        crate::math::BoxTree::new(&points.iter().map(|&p| Bounds { min: p, max: p }).collect::<Vec<_>>());
    let step = points.len().div_ceil(SPACING_SAMPLE);
    let sampled = (0..points.len()).step_by(step);
    let distance = |i: usize| {
        let mut best = f64::INFINITY;
        tree.nearest(points[i], |j, bound| {
            let squared = points[j as usize].as_dvec3().distance_squared(points[i].as_dvec3());
            best = if j as usize != i && squared < best { squared } else { best };
            if best < bound { best } else { bound }
        });
        best.sqrt()
    };
    let count = sampled.len();
    sampled.map(distance).sum::<f64>() / count as f64
}

/// Maximum number of points from which [`mean_spacing`] is estimated: enough for an error of a hundredth.
const SPACING_SAMPLE: usize = 4000;

/// Returns the indices of the points in the `keep` largest clusters, in ascending order, to discard outliers. Points
/// belong to one cluster if their grid cells, with edges of length `cell`, are linked by a chain of cells with points
/// that touch, even at a corner.
pub fn largest_clusters(points: &[Vec3], cell: f32, keep: usize) -> Vec<u32> {
    let clusters = clusters(points, cell);
    let mut largest: Vec<&[u32]> = clusters.iter().map(Vec::as_slice).collect();
    sort_by_rank(&mut largest, |cluster| (points.len() - cluster.len()) as u64);
    let mut kept = largest[..keep.min(largest.len())].concat();
    sort_distinct(&mut kept);
    kept
}

/// Returns the indices of the points, grouped into clusters: those of grid cells, with edges of length `cell`, that are
/// linked by a chain of cells with points that touch, even at a corner. Clusters are ordered by their lowest index.
fn clusters(points: &[Vec3], cell: f32) -> Vec<Vec<u32>> {
    let cell_of = |p: &Vec3| (*p / cell).floor().to_array().map(|x| x as i32 as u32);
    let mut by_cell: Vec<([u32; 3], u32)> = points.iter().map(cell_of).zip(0..).collect();
    sort_triples(&mut by_cell);
    let occupied: Vec<&[([u32; 3], u32)]> = by_cell.chunk_by(|a, b| a.0 == b.0).collect();
    let find = |cell: [u32; 3]| occupied.binary_search_by_key(&cell, |points| points[0].0).ok();
    let mut seen = vec![false; occupied.len()];
    let mut found = Vec::new();
    for start in points.iter().filter_map(|p| find(cell_of(p))) {
        let (mut cluster, mut stack) = (Vec::new(), vec![start]);
        while let Some(at) = stack.pop() {
            if std::mem::replace(&mut seen[at], true) {
                continue;
            }
            cluster.extend(occupied[at].iter().map(|&(_, i)| i));
            stack.extend(neighbours(occupied[at][0].0).filter_map(find));
        }
        if !cluster.is_empty() {
            found.push(cluster);
        }
    }
    found
}

/// Returns a grid cell and its 26 neighbours, for joining the points of touching cells to clusters. Coordinates are
/// `i32`, stored as the `u32` with the same bits.
fn neighbours(cell: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [x, y, z] = cell.map(|k| k as i32);
    let steps = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
    let cells =
        steps.map(move |[dx, dy, dz]| [x.saturating_add(dx), y.saturating_add(dy), z.saturating_add(dz)]);
    cells.map(|cell| cell.map(|k| k as u32))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn unit(random: &mut Random) -> f32 {
        random.next_u32() as f32 / 2_147_483_648.0 - 1.0
    }

    /// Returns `count` random points on the unit sphere, a cloud for tests.
    pub fn on_ball(count: usize) -> Vec<Vec3> {
        let mut random = Random::new(7);
        let mut point =
            || Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)).normalize_or(Vec3::X);
        (0..count).map(|_| point()).collect()
    }

    #[test]
    fn into_the_box_and_back() {
        for (scale, shift) in
            [(1.0_f32, 0.0_f32), (1e-6, 0.0), (1e6, 3e6), (1e-30, 0.0), (1e38, 0.0), (1.0, 1000.0)]
        {
            let points: Vec<Vec3> = on_ball(100)
                .iter()
                .map(|p| *p * Vec3::new(1.0, 0.5, 0.2) * scale + Vec3::splat(shift))
                .collect();
            let map = BoxMap::of(&points);
            let inside: Vec<Vec3> = points.iter().map(|&p| map.in_box(p)).collect();
            let bounds = Bounds::from_points(&inside);
            assert!((bounds.max - bounds.min).max_element() <= 2.0 + 1e-6 && bounds.max.x >= 1.0 - 1e-6);
            for (p, q) in points.iter().zip(&inside) {
                let back = map.in_world(map.in_box_exactly(p.as_dvec3()));
                assert!(back.distance(p.as_dvec3()) <= 1e-12 / map.scale() + 1e-14 * f64::from(shift));
                assert!(map.affine().transform_point3(p.as_dvec3()).distance(q.as_dvec3()) < 1e-6);
            }
        }
        let widest = BoxMap::of(&[Vec3::splat(f32::MIN), Vec3::splat(f32::MAX)]);
        assert_eq!(widest.in_box(Vec3::splat(f32::MAX)), Vec3::ONE);
    }

    #[test]
    fn of_equal_points_the_first_stays_with_all_that_belongs_to_it() {
        let (a, b, c) = (Vec3::X, Vec3::Y, Vec3::Z);
        let cloud = Cloud {
            origin: DVec3::ZERO,
            points: vec![a, b, Vec3::ZERO, a, c, -Vec3::ZERO, b],
            normals: Some((0..7).map(|i| Vec3::splat(i as f32)).collect()),
            confidence: Some(vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]),
            colors: None,
        };
        let found = cloud.distinct();
        assert_eq!(found.points, [a, b, Vec3::ZERO, c]);
        assert_eq!(found.normals.as_deref().unwrap()[3], Vec3::splat(4.0));
        assert_eq!(found.confidence.as_deref().unwrap(), [0.1, 0.2, 0.3, 0.5]);
        assert_eq!(found.distinct(), found);
    }

    #[test]
    fn clusters_by_size() {
        let ball = on_ball(500);
        let mut points: Vec<Vec3> = ball[..100].iter().map(|p| *p * 0.1 + Vec3::X * 3.0).collect();
        points.extend(&ball);
        points.push(Vec3::Y * 5.0);
        let cell = (2.0 * mean_spacing(&points)) as f32 * 3.0;
        let ball_alone: Vec<u32> = (100..600).collect();
        assert_eq!(largest_clusters(&points, cell, 1), ball_alone);
        assert_eq!(largest_clusters(&points, cell, 2), (0..600).collect::<Vec<u32>>());
        assert_eq!(largest_clusters(&points, cell, 9).len(), 601);
        assert_eq!(largest_clusters(&points, 100.0, 1).len(), 601);
    }

    #[test]
    fn the_mean_spacing_of_a_grid() {
        let grid: Vec<Vec3> = (0..5000)
            .map(|k| Vec3::new((k % 10) as f32, (k / 10 % 10) as f32, (k / 100) as f32) * 0.1)
            .collect();
        assert!((mean_spacing(&grid) - 0.1).abs() < 1e-5);
        assert!((mean_spacing(&grid[..2]) - 0.1).abs() < 1e-5);
    }

    #[test]
    fn planes_and_lines_span_nothing() {
        let ball = on_ball(100);
        let of = |f: fn(&Vec3) -> Vec3| {
            Cloud { points: ball.iter().map(f).collect(), ..Cloud::default() }.check_span()
        };
        assert!(of(|p| *p).is_ok());
        assert!(of(|p| *p * Vec3::new(1.0, 1.0, 1e-4)).is_ok());
        for flat in [
            of(|p| *p * Vec3::new(1.0, 1.0, 0.0)),
            of(|p| Vec3::new(p.x, p.y, 0.3 * p.x - 0.7 * p.y)),
            of(|p| Vec3::new(1.0, 0.2, -0.5) * p.x),
            of(|_| Vec3::ONE),
        ] {
            assert!(matches!(flat, Err(MethodError::InvalidArgument { parameter: "points", .. })));
        }
        // In comparison with a distance of 10³⁰, a ball is one point.
        let points = ball.iter().copied().chain([Vec3::X * 1e30]).collect();
        let refused = Cloud { points, ..Cloud::default() }.check_span().unwrap_err().to_string();
        assert!(refused.contains("so far away") && refused.contains("outliers"), "{refused}");
    }
}
