//! Points off the surface, on both sides of it, in slices of less than a tenth of a second of work.

use super::FEW_POINTS;
use super::quadric_fit::{QuadricFit, fitting_grid};
use super::winding::Winding;
use crate::math::Vec3;
use crate::methods::implicit::sampling::{Samples, subsampled};
use crate::spatial::PointGrid;

/// Largest number of positions between which normals are made consistent. With fewer, the two sides of walls of a few point
/// spacings are confused; the time grows with the square.
const ORIENTED: usize = 3000;
/// Number of times that normals are made more consistent; with more, hardly any changes.
const ITERATIONS: usize = 10;
/// Width below which distances are smoothed, in distances between the positions; the noise is added. With more, the two
/// sides of thin walls are confused.
const WIDTH: f32 = 0.5;
/// Number of points for each pair of constraints, and the least number of pairs that is tried.
const POINTS: usize = 4;
const MIN_PAIRS: usize = 30;
/// Distance of constraints from the surface in mean spacings of the points, and the largest such distance.
const OFFSET: f64 = 3.0;
const MAX_OFFSET: f64 = 0.2;
/// Distance of constraints from the surface in units of the noise, if that is more.
const NOISE: f64 = 3.0;
/// Least distance of a constraint from all points, as a share of its distance from the surface: a nearer one may be on the
/// other side of another part.
const CLEARANCE: f32 = 0.8;
/// Offsets of pairs of few points whose normals are given, as shares of the usual one.
const SHARES: [f32; 3] = [1.0, 0.5, 0.25];
/// Least difference of the winding numbers of a pair; with less, it is ambiguous which end is inside.
const LEAST_DIFFERENCE: f32 = 0.3;
/// As [`LEAST_DIFFERENCE`] where a normal is given. On eight points of a ball it is about .2.
const LEAST_GIVEN_DIFFERENCE: f32 = 0.15;
/// Number of points where a pair is tried in a slice.
const SLICE: usize = 60;
/// Largest number of points outside that are compared with the winding number.
const TESTED: usize = 500;
/// There is a warning if less than this share of the pairs that were tried have an end on one of the sides.
const FEW: f64 = 0.15;
/// Difference of the winding number from ½ at a position above which normals are inconsistent, and the share of such positions
/// above which there is a warning. Of 36 clouds of 12 shapes it was .11 at most where no wall or branch was as thin as the
/// noise, and .17 to .56 on seven others, four of them with the right topology.
const LARGEST_ERROR: f32 = 0.2;
const INCONSISTENT: f64 = 0.13;

/// Points off the surface, in units of the normalised box.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OffSurface {
    /// Points outside.
    pub outside: Vec<Vec3>,
    /// Points inside.
    pub inside: Vec<Vec3>,
    /// Their distance from the surface.
    pub offset: f32,
    /// Number of pairs that were tried.
    tried: usize,
    /// Share of the positions where the winding number is far from ½, since normals there or elsewhere are inconsistent.
    inconsistent: f64,
}

impl OffSurface {
    /// Whether inside and outside are ambiguous, so that the surface may have another topology than the true one: there is
    /// clearance for few points on one side, or normals are inconsistent.
    pub fn is_ambiguous(&self) -> bool {
        let fewest = self.outside.len().min(self.inside.len()) as f64;
        fewest < FEW * self.tried as f64 || self.inconsistent > INCONSISTENT
    }

    /// Returns the points with inside and outside exchanged.
    pub fn exchanged(self) -> Self {
        Self { outside: self.inside, inside: self.outside, ..self }
    }
}

/// The search for points off the surface.
#[derive(Clone, Debug)]
pub struct OffSurfaceSearch {
    grid: PointGrid,
    /// Positions on the surface where normals are known.
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// Area of the surface for each of these positions.
    area: f32,
    /// Width below which distances are smoothed.
    width: f32,
    winding: Winding,
    iterations: usize,
    /// The normals that were given with the points, if these are too few for the fits to show them.
    given: Option<Vec<Vec3>>,
    /// Indices of the points where pairs are tried.
    at: Vec<u32>,
    found: OffSurface,
}

impl OffSurfaceSearch {
    /// Starts for the points of `samples`; `seed` determines where pairs are tried.
    pub fn new(samples: &Samples, seed: u64) -> Self {
        let Samples { cloud, spacing, choice, .. } = samples;
        let (points, spacing) = (&cloud.points, *spacing);
        let offset = (NOISE * choice.noise).max((OFFSET * spacing).min(MAX_OFFSET));
        let grid = fitting_grid(points, spacing);
        let chosen = subsampled(points, ORIENTED, seed);
        let given = cloud.normals.as_ref().filter(|_| points.len() < FEW_POINTS);
        let fits = chosen.iter().map(|&i| {
            let p = points[i as usize];
            if let Some(normals) = given {
                return (p, normals[i as usize].normalize_or_zero());
            }
            QuadricFit::of_wall(&grid, p).map_or((p, Vec3::ZERO), |fit| (fit.position, fit.normal))
        });
        let (positions, normals): (Vec<Vec3>, Vec<Vec3>) = fits.unzip();
        let area = (points.len() as f64 / choice.density / positions.len() as f64) as f32;
        let width = WIDTH * area.sqrt() + choice.noise as f32;
        let of_chosen = |normals: &Vec<Vec3>| chosen.iter().map(|&i| normals[i as usize]).collect();
        let vectors = cloud.normals.as_ref().map_or_else(|| vec![Vec3::ZERO; positions.len()], of_chosen);
        let winding = Winding::new(&positions, vectors, width);
        let count = (points.len() / POINTS).max(MIN_PAIRS).min(points.len());
        let found = OffSurface { offset: offset as f32, ..OffSurface::default() };
        let at = subsampled(points, count, seed);
        let given = given.cloned();
        let mut search =
            Self { grid, positions, normals, area, width, winding, iterations: 0, given, at, found };
        if cloud.normals.is_some() {
            search.iterations = ITERATIONS;
            search.orient();
        }
        search
    }

    /// Continues by a slice; returns the points once all are found.
    pub fn advance(&mut self) -> Option<OffSurface> {
        if self.iterations < ITERATIONS {
            self.winding.improve();
            self.iterations += 1;
            if self.iterations == ITERATIONS {
                self.orient();
            }
            return None;
        }
        let tried = self.found.tried;
        for k in tried..self.at.len().min(tried + SLICE) {
            self.try_pair(self.at[k]);
        }
        (self.found.tried == self.at.len()).then(|| std::mem::take(&mut self.found))
    }

    /// Returns the share of `points` that are outside by the winding number, of at most [`TESTED`] of them; 1 without points.
    pub fn outside_share(&self, points: &[Vec3]) -> f64 {
        let tested = points.iter().step_by(points.len().div_ceil(TESTED).max(1));
        let (outside, all) = tested
            .fold((0, 0), |(outside, all), &p| (outside + i32::from(self.winding.at(p) < 0.5), all + 1));
        if all == 0 { 1.0 } else { f64::from(outside) / f64::from(all) }
    }

    /// Returns the share that is done.
    pub fn progress(&self) -> f64 {
        let oriented = self.iterations as f64 / ITERATIONS as f64;
        0.7 * oriented + 0.3 * self.found.tried as f64 / self.at.len() as f64
    }

    /// Turns the normals of the fits to the side of the vectors, and measures how consistent they are.
    fn orient(&mut self) {
        let sides = self.normals.iter().zip(self.winding.vectors());
        let vectors = sides.map(|(&n, v)| if n.dot(*v) < 0.0 { -n * self.area } else { n * self.area });
        self.winding = Winding::new(&self.positions, vectors.collect(), self.width);
        let off = self.positions.iter().filter(|&&p| (self.winding.at(p) - 0.5).abs() > LARGEST_ERROR);
        self.found.inconsistent = off.count() as f64 / self.positions.len() as f64;
    }

    /// Tries a pair at a point.
    fn try_pair(&mut self, i: u32) {
        self.found.tried += 1;
        let p = self.grid.points()[i as usize];
        let [outside, inside] = match &self.given {
            Some(normals) => self.given_pair(p, normals[i as usize]),
            None => self.fitted_pair(p),
        };
        self.found.outside.extend(outside);
        self.found.inside.extend(inside);
    }

    /// Returns the ends of the pair at a point, outside and inside: each where its side is unambiguous, and no point is near.
    fn fitted_pair(&self, p: Vec3) -> [Option<Vec3>; 2] {
        let Some(fit) = QuadricFit::of_wall(&self.grid, p) else { return [None; 2] };
        let step = fit.normal * self.found.offset;
        let ends = [fit.position + step, fit.position - step];
        let [a, b] = ends.map(|end| self.winding.at(end));
        if (a - b).abs() < LEAST_DIFFERENCE {
            return [None; 2];
        }
        let ends = if a < b { ends } else { [ends[1], ends[0]] };
        ends.map(|end| self.is_clear(end, self.found.offset).then_some(end))
    }

    /// Returns the ends of the pair along a given normal, as far from the point as both are clear and on their sides.
    fn given_pair(&self, p: Vec3, normal: Vec3) -> [Option<Vec3>; 2] {
        let pair = SHARES.into_iter().find_map(|share| {
            let offset = share * self.found.offset;
            let step = normal.normalize_or_zero() * offset;
            let ends = [p + step, p - step];
            let [outside, inside] = ends.map(|end| self.winding.at(end));
            let is_right = inside - outside >= LEAST_GIVEN_DIFFERENCE;
            (is_right && ends.iter().all(|&end| self.is_clear(end, offset))).then_some(ends)
        });
        pair.map_or([None; 2], |ends| ends.map(Some))
    }

    fn is_clear(&self, end: Vec3, offset: f32) -> bool {
        !self.grid.has_within(end, CLEARANCE * offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Normals can be consistent where there is no room for pairs, as in branches as thin as the noise.
    #[test]
    fn few_pairs_or_inconsistent_normals_are_ambiguous() {
        let found = |outside: usize, inside: usize, inconsistent: f64| {
            let [outside, inside] = [outside, inside].map(|count| vec![Vec3::ZERO; count]);
            OffSurface { outside, inside, offset: 0.1, tried: 100, inconsistent }
        };
        assert!(!found(20, 20, 0.1).is_ambiguous());
        for ambiguous in [found(20, 10, 0.0), found(10, 20, 0.0), found(20, 20, 0.2)] {
            assert!(ambiguous.is_ambiguous());
        }
    }
}
