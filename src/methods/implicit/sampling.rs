//! Selection of the input points that become surface constraints, by Poisson-disc sampling in slices of about ten
//! milliseconds of work (Dinh, Turk & Slabaugh, section VI-B).

use super::automatic::Choice;
use super::cloud::{CLUSTER_CELL, Cloud, largest_clusters, mean_spacing};
use crate::math::{Random, Vec3};
use crate::methods::MethodError;
use crate::spatial::PointGrid;

/// Number of points visited in one call of [`Sampling::advance`], which then takes about ten milliseconds.
const SLICE: usize = 50_000;
/// Maximum number of radii that are tried in Poisson-disc sampling, to find one that leaves the wanted number of
/// points.
const MAX_RADII: u32 = 16;
/// Smallest share of the maximum number of samples for which the radius of Poisson-disc sampling is accepted: fewer
/// samples mean that it is too large.
const ACCEPTED_SHARE: f64 = 0.97;

/// The input points that were selected to become surface constraints.
#[derive(Clone, Debug)]
pub struct Samples {
    /// The selected points with their attributes, in random order, in units of the normalised box.
    pub cloud: Cloud,
    /// Mean distance of a selected point from its nearest neighbour, estimated from at most 4000 samples, in units of
    /// the normalised box (longest side 2).
    pub spacing: f64,
    /// Measures of the selected points, and the values chosen by them.
    pub choice: Choice,
    /// The points in none of the clusters that are kept, in units of the normalised box.
    pub outliers: Vec<Vec3>,
    /// Whether there are far outliers among the points that are kept.
    pub has_far_outliers: bool,
}

/// Selection of the points of a cloud that become surface constraints, in slices of about ten milliseconds of work.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// Number of clusters of points to keep, largest first, to discard outliers; `None` keeps all points.
    keep: Option<usize>,
    most: usize,
    seed: u64,
    poisson_disc: Option<(Cloud, PoissonDisc)>,
}

impl Sampling {
    /// Starts the selection of at most `most` points from the `keep` largest clusters of points, or from all points if
    /// `keep` is `None`; `seed` determines the random order.
    pub fn new(keep: Option<usize>, most: usize, seed: u64) -> Self {
        Self { keep, most, seed, poisson_disc: None }
    }

    /// Continues the selection from `cloud` by one slice of work; it must be the same cloud in all calls. Returns the
    /// samples once they are selected, `None` before.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if too few points are left, or all of them lie in one plane.
    pub fn advance(&mut self, cloud: &Cloud) -> Result<Option<Samples>, MethodError> {
        let Some((kept, poisson_disc)) = &mut self.poisson_disc else {
            let kept = match self.keep {
                Some(keep) => Self::largest(cloud, keep)?,
                None => cloud.clone(),
            };
            let poisson_disc = PoissonDisc::new(&kept.points, self.most, self.seed);
            self.poisson_disc = Some((kept, poisson_disc));
            return Ok(None);
        };
        let Some(chosen) = poisson_disc.advance(&kept.points, SLICE) else { return Ok(None) };
        let samples = kept.select(&chosen);
        samples.check_span()?;
        let spacing = mean_spacing(&samples.points);
        Ok(Some(Samples {
            spacing,
            choice: Choice::of(&samples.points, spacing),
            cloud: samples,
            outliers: cloud.points_outside(kept),
            has_far_outliers: kept.has_far_outliers(),
        }))
    }

    fn largest(cloud: &Cloud, keep: usize) -> Result<Cloud, MethodError> {
        let cell = CLUSTER_CELL * mean_spacing(&cloud.points);
        let kept = cloud.select(&largest_clusters(&cloud.points, cell as f32, keep));
        kept.check_count()?;
        kept.check_span()?;
        Ok(kept)
    }

    /// Returns the approximate share of the selection that is done, 0 to 1, for progress bars.
    pub fn progress(&self) -> f64 {
        self.poisson_disc.as_ref().map_or(0.0, |(_, poisson_disc)| poisson_disc.progress())
    }
}

/// Poisson-disc sampling of at most `most` points: visits the points in random order, and keeps each that is farther
/// than a radius from all kept before. The radius is searched, round by round, such that nearly `most` points are kept.
/// If there are at most `most` points, all are kept.
#[derive(Clone, Debug)]
struct PoissonDisc {
    order: Vec<u32>,
    most: usize,
    round: u32,
    radius: f32,
    /// Largest sampling radius known to leave more than `most` points; 0 if none is known.
    lower: f32,
    /// Smallest sampling radius known to leave at most `most` points; 0 if none is known.
    upper: f32,
    /// Indices of the points kept with the radius `upper`, the result so far.
    best: Vec<u32>,
    /// Number of points visited with the current radius.
    visited: usize,
    /// Indices of the points kept with the current radius; `grid` holds their positions.
    kept: Vec<u32>,
    grid: PointGrid,
}

impl PoissonDisc {
    fn new(points: &[Vec3], most: usize, seed: u64) -> Self {
        let mut poisson_disc = Self {
            order: Random::new(seed).permutation(points.len()),
            most,
            round: 0,
            // First guess: n points at a distance r cover an area of about nr², here a square of side 2.
            radius: 2.0 / (most as f32).sqrt(),
            lower: 0.0,
            upper: 0.0,
            best: Vec::new(),
            visited: 0,
            kept: Vec::new(),
            grid: PointGrid::default(),
        };
        poisson_disc.begin_round();
        poisson_disc
    }

    fn begin_round(&mut self) {
        let expected = if self.most < self.order.len() { self.most } else { self.order.len() };
        (self.visited, self.grid) = (0, PointGrid::new(self.radius, expected));
        self.kept.clear();
    }

    /// Visits up to `count` points. Returns the indices of the samples, in random order, once the search for a radius
    /// ends, `None` before.
    fn advance(&mut self, points: &[Vec3], count: usize) -> Option<Vec<u32>> {
        if self.order.len() <= self.most {
            return Some(self.order.clone());
        }
        for &i in self.order.iter().skip(self.visited).take(count) {
            let p = points[i as usize];
            if !self.grid.has_within(p, self.radius) {
                self.grid.insert(p);
                self.kept.push(i);
            }
            self.visited += 1;
        }
        if self.visited < self.order.len() { None } else { self.end_round() }
    }

    fn end_round(&mut self) -> Option<Vec<u32>> {
        let count = self.kept.len();
        if count > self.most {
            self.lower = self.radius;
        } else {
            self.upper = self.radius;
            self.best = std::mem::take(&mut self.kept);
        }
        self.round += 1;
        let is_accepted = count <= self.most && count as f64 >= ACCEPTED_SHARE * self.most as f64;
        if is_accepted || self.round == MAX_RADII {
            let none = self.best.is_empty();
            return Some(if none {
                self.order[..self.most].to_vec()
            } else {
                std::mem::take(&mut self.best)
            });
        }
        self.radius = self.next_radius(count);
        self.begin_round();
        None
    }

    /// Returns the next radius to try; `count` points were kept with the last radius. On a surface the number of
    /// samples falls with the square of the radius; if the radius predicted by that is outside the bounds, their
    /// midpoint is used, or twice the lower one if there is no upper.
    fn next_radius(&self, count: usize) -> f32 {
        let target_count = 0.5 * (1.0 + ACCEPTED_SHARE as f32) * self.most as f32;
        let guess = self.radius * (count as f32 / target_count).sqrt();
        if guess > self.lower && (self.upper == 0.0 || guess < self.upper) {
            guess
        } else if self.upper > 0.0 {
            0.5 * (self.lower + self.upper)
        } else {
            2.0 * self.lower
        }
    }

    /// Returns the approximate share of the work that is done, below 1, for progress bars. How many rounds are needed
    /// is not known; a handful is assumed.
    fn progress(&self) -> f64 {
        let rounds = f64::from(self.round) + self.visited as f64 / self.order.len() as f64;
        rounds / (rounds + 2.0)
    }
}

/// Returns the indices of at most `most` points that are spread evenly over `points`, by Poisson-disc sampling, as
/// [`Sampling`] selects them, in one call.
pub fn subsampled(points: &[Vec3], most: usize, seed: u64) -> Vec<u32> {
    let mut poisson_disc = PoissonDisc::new(points, most, seed);
    loop {
        if let Some(chosen) = poisson_disc.advance(points, points.len()) {
            return chosen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::implicit::cloud::tests::on_ball;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn thinned_points_keep_their_distance_and_leave_no_gap() {
        let points = on_ball(4000);
        for most in [10, 200, 3000] {
            let mut poisson_disc = PoissonDisc::new(&points, most, 1);
            let kept = loop {
                if let Some(kept) = poisson_disc.advance(&points, 777) {
                    break kept;
                }
                assert!((0.0..1.0).contains(&poisson_disc.progress()));
            };
            assert_eq!(kept, subsampled(&points, most, 1));
            let radius = poisson_disc.upper;
            for (k, &i) in kept.iter().enumerate() {
                assert!(kept[..k].iter().all(|&j| points[i as usize].distance(points[j as usize]) > radius));
            }
            let reached =
                |p: &Vec3| kept.iter().any(|&j| points[j as usize].distance_squared(*p) <= radius * radius);
            assert!(points.iter().all(reached));
        }
    }

    #[test]
    fn subsamples_have_nearly_the_requested_size() {
        let mut uneven = on_ball(3000);
        // Most of them are on a fifth of the sphere.
        uneven.extend(on_ball(30_000).into_iter().filter(|p| p.z > 0.6));
        for points in [on_ball(5000), uneven] {
            for most in [4, 30, 300, 2000, 4999] {
                let kept = subsampled(&points, most, 1);
                let least = if most < 100 { 0.6 } else { 0.9 };
                assert!(
                    kept.len() <= most && kept.len() as f64 >= least * most as f64,
                    "{} of {most}",
                    kept.len()
                );
                let mut sorted = kept.clone();
                sorted.sort_unstable();
                sorted.dedup();
                assert_eq!(sorted.len(), kept.len());
                assert_eq!(kept, subsampled(&points, most, 1));
            }
            assert_eq!(subsampled(&points, points.len(), 1).len(), points.len());
        }
    }
}
