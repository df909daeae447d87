//! The points in the box: scaled, without duplicates, without outliers (paper, section VI-D).

use crate::math::order::sort_by_rank;
use crate::math::{Bounds, DAffine3, DMat3, DVec3, Vec3, symmetric};
use crate::methods::MethodError;

/// Points near a surface, with what is known of each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Where they are.
    pub points: Vec<Vec3>,
    /// Unit normals that point outwards.
    pub normals: Option<Vec<Vec3>>,
    /// How sure each is, in (0, 1].
    pub confidence: Option<Vec<f32>>,
    /// rgb, 0..1.
    pub colors: Option<Vec<Vec3>>,
}

/// Fewer different points span no volume.
pub const LEAST_POINTS: usize = 4;
/// A cloud is flat where its thickness is at most this share of its length.
const FLAT: f64 = 1e-6;

impl Cloud {
    /// Tests the lengths and the values.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the array and the first bad entry, or what is wrong with the whole.
    pub fn validate(&self) -> Result<(), MethodError> {
        let count = self.points.len();
        check_finite("points", &self.points)?;
        for (name, found) in [
            ("normals", self.normals.as_ref().map(Vec::len)),
            ("confidence", self.confidence.as_ref().map(Vec::len)),
            ("colors", self.colors.as_ref().map(Vec::len)),
        ] {
            if let Some(found) = found.filter(|&found| found != count) {
                let problem = format!("{found} entries for {count} points; one a point is needed");
                return Err(MethodError::invalid(name, problem));
            }
        }
        check_finite("normals", self.normals.as_deref().unwrap_or_default())?;
        check_finite("colors", self.colors.as_deref().unwrap_or_default())?;
        let confidence = self.confidence.as_deref().unwrap_or_default();
        match confidence.iter().position(|&c| !(c > 0.0 && c <= 1.0)) {
            Some(i) => {
                let problem = format!("{} at point {i}; above 0, and at most 1, is accepted", confidence[i]);
                Err(MethodError::invalid("confidence", problem))
            }
            None => Ok(()),
        }
    }

    /// The number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points of the given indices, in that order.
    pub fn gathered(&self, indices: &[u32]) -> Self {
        fn gather<T: Copy>(all: &[T], indices: &[u32]) -> Vec<T> {
            indices.iter().map(|&i| all[i as usize]).collect()
        }
        Self {
            points: gather(&self.points, indices),
            normals: self.normals.as_ref().map(|all| gather(all, indices)),
            confidence: self.confidence.as_ref().map(|all| gather(all, indices)),
            colors: self.colors.as_ref().map(|all| gather(all, indices)),
        }
    }

    /// The first of each set of equal points, in order.
    pub fn distinct(&self) -> Self {
        let bits = |i: u32| self.points[i as usize].to_array().map(|x| (x + 0.0).to_bits());
        let mut order: Vec<([u32; 3], u32)> = (0..self.len() as u32).map(|i| (bits(i), i)).collect();
        order.sort_unstable();
        let mut first: Vec<u32> = order.chunk_by(|a, b| a.0 == b.0).map(|same| same[0].1).collect();
        first.sort_unstable();
        if first.len() == self.len() { self.clone() } else { self.gathered(&first) }
    }

    /// Nothing, where there are points enough.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for fewer than four.
    pub fn check_count(&self) -> Result<(), MethodError> {
        if self.len() >= LEAST_POINTS {
            return Ok(());
        }
        let problem = format!("{} different ones; at least {LEAST_POINTS} are needed", self.len());
        Err(MethodError::invalid("points", problem))
    }

    /// Nothing, where the points, in the box, span a volume.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for points in one plane.
    pub fn check_span(&self) -> Result<(), MethodError> {
        let mean = self.points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / self.len() as f64;
        let (spread, _) = symmetric::eigen(self.points.iter().fold(DMat3::ZERO, |sum, p| {
            let d = p.as_dvec3() - mean;
            sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
        }));
        if spread.x <= FLAT * FLAT * spread.z {
            return Err(MethodError::invalid("points", "all lie in one plane; they have to span a volume"));
        }
        Ok(())
    }

    /// Everything moved and scaled by `map`, which does not turn or mirror.
    pub fn mapped(&self, map: &BoxMap) -> Self {
        Self { points: self.points.iter().map(|&p| map.in_box(p)).collect(), ..self.clone() }
    }
}

/// The most points that take part: their matrix takes about 2 GB.
pub const MOST_POINTS: usize = 100_000;

/// Tests that there are no more points than can take part.
///
/// # Errors
/// [`MethodError::InvalidArgument`] with both numbers.
pub fn check_number(name: &'static str, count: usize) -> Result<(), MethodError> {
    if count <= MOST_POINTS {
        return Ok(());
    }
    Err(MethodError::invalid(name, format!("{count} points; at most {MOST_POINTS} are accepted")))
}

/// Tests that all values are finite.
///
/// # Errors
/// [`MethodError::InvalidArgument`] naming the first that is not.
pub fn check_finite(name: &'static str, values: &[Vec3]) -> Result<(), MethodError> {
    match values.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(MethodError::invalid(
            name,
            format!("point {i} is {}; finite numbers are accepted", values[i]),
        )),
        None => Ok(()),
    }
}

/// Longest side of points that single precision has room around for.
const LEAST_SIZE: f64 = 1e-27;
const MOST_SIZE: f64 = 1e38;
/// Distance from the origin, in longest sides, at which a cell of 1/30 of a side is still as exact as it has to be.
const MOST_AWAY: f64 = 240.0;

/// From the points' own units into the box, whose longest side is 2, and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxMap {
    centre: DVec3,
    /// Box units a unit of the points.
    scale: f64,
}

impl BoxMap {
    /// The map that puts the bounds of `points`, not all equal, into the box.
    pub fn of(points: &[Vec3]) -> Self {
        let bounds = Bounds::of(points);
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        // Halves first: the sum of two large coordinates can overflow.
        Self { centre: min * 0.5 + max * 0.5, scale: 1.0 / (max * 0.5 - min * 0.5).max_element() }
    }

    /// How far from the origin of the points' units anything in the box is, at most; in those units.
    pub fn reach(&self) -> f64 {
        self.centre.abs().max_element() + 1.0 / self.scale
    }

    /// Tests that vertices on a surface of such points can be told apart in single precision.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for points too small or too large, or too far from the origin for their size.
    pub fn check_place(&self) -> Result<(), MethodError> {
        let size = 2.0 / self.scale;
        let largest = self.reach() + size;
        let bad = |problem| Err(MethodError::invalid("points", problem));
        if !(LEAST_SIZE..=MOST_SIZE).contains(&size) {
            return bad(format!(
                "their longest side is {size:e}; {LEAST_SIZE:e} to {MOST_SIZE:e} is accepted"
            ));
        }
        let away = self.reach() / size;
        if largest > f64::from(f32::MAX) {
            return bad(format!("they reach to {largest:e} with some room, beyond single precision"));
        }
        if away <= MOST_AWAY {
            return Ok(());
        }
        bad(format!(
            "they lie {away:.0} times their size from the origin, where single precision has too few digits left; \
             {MOST_AWAY} times is accepted: move them nearer"
        ))
    }

    /// Box units a unit of the points.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// A point in the box.
    pub fn in_box(&self, p: Vec3) -> Vec3 {
        self.in_box_exactly(p.as_dvec3()).as_vec3()
    }

    /// A point in the box, not rounded.
    pub fn in_box_exactly(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale
    }

    /// A point of the box in the points' units.
    pub fn in_world(&self, p: DVec3) -> DVec3 {
        p / self.scale + self.centre
    }

    /// The map into the box.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.centre)
    }
}

/// The mean distance from a point to the one nearest to it, over at most 4000 of them.
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

/// Points that the mean spacing is taken from: enough for a hundredth of it.
const SPACING_SAMPLE: usize = 4000;

/// The points of the `keep` largest clusters, in order; `cell` is the edge of the cells whose 26 neighbours join them.
pub fn largest_clusters(points: &[Vec3], cell: f32, keep: usize) -> Vec<u32> {
    let clusters = clusters(points, cell);
    let mut largest: Vec<&[u32]> = clusters.iter().map(Vec::as_slice).collect();
    sort_by_rank(&mut largest, |cluster| (points.len() - cluster.len()) as u64);
    let mut kept = largest[..keep.min(largest.len())].concat();
    kept.sort_unstable();
    kept
}

/// Points whose cells touch, even at a corner, by the lowest index of each cluster.
fn clusters(points: &[Vec3], cell: f32) -> Vec<Vec<u32>> {
    let cell_of = |p: &Vec3| (*p / cell).floor().to_array().map(|x| x as i32 as u32);
    let mut by_cell: Vec<([u32; 3], u32)> = points.iter().map(cell_of).zip(0..).collect();
    by_cell.sort_unstable();
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

/// Cells by the bits of their places.
fn neighbours(cell: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [x, y, z] = cell.map(|k| k as i32);
    let steps = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
    let places =
        steps.map(move |[dx, dy, dz]| [x.saturating_add(dx), y.saturating_add(dy), z.saturating_add(dz)]);
    places.map(|place| place.map(|k| k as u32))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn unit(random: &mut Random) -> f32 {
        random.bits() as f32 / 2_147_483_648.0 - 1.0
    }

    /// Points spread over the unit ball.
    pub fn on_ball(count: usize) -> Vec<Vec3> {
        let mut random = Random::new(7);
        let mut place =
            || Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)).normalize_or(Vec3::X);
        (0..count).map(|_| place()).collect()
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
            let bounds = Bounds::of(&inside);
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
    }
}
