//! Fast evaluation of the implicit function at many points, by a fast multipole method with Chebyshev interpolation
//! (Fong & Darve, *The black-box fast multipole method*, 2009).
//!
//! Near terms are summed directly. The sum of all other terms is smooth within a cube, and is interpolated there; in
//! smaller cubes, fewer terms are near. Cubes are computed at the first evaluation in them, so small ones exist only
//! around the surface. The error is about a thousandth of the change of f from one point of the surface to the next;
//! [`Field`] is accurate to rounding. Kernels that grow with the distance are summed directly here, too, as their large
//! values cancel.

mod chebyshev;
mod translate;

use super::field::Field;
use crate::math::DVec3;
use crate::math::order::{sort_distinct, sort_pairs};
use chebyshev::{CUBE, Chebyshev, Nodal};
use translate::{CubeSymmetries, Translations};

/// Maximum mean number of terms of the implicit function in the finest cubes of the octree that contain any. With more,
/// sums of near terms take longer; with fewer, there are more cubes.
const TERMS_A_CUBE: usize = 24;
/// Maximum depth of the octree of cubes: tables of the finest level have 8^this entries.
const MAX_LEVELS: usize = 6;
/// Index that stands for a cube of the octree that contains no terms, or that is not computed yet.
const NONE: u32 = u32::MAX;
/// Coordinates of a cube outside the range of all points, for the cache of the last cube while it is empty.
const NO_CUBE: CubeCoords = [i32::MIN; 3];

/// An implicit function prepared for fast evaluation at many points; used to extract the surface and to sample volumes.
#[derive(Clone, Debug)]
pub struct FastField {
    field: Field,
    chebyshev: Chebyshev,
    turns: CubeSymmetries,
    /// Lowest corner of the octree's root cube, in units of the normalised box; `edge` is the length of its edges.
    origin: DVec3,
    edge: f64,
    levels: Vec<Level>,
    /// The terms of the implicit function (centre and weight); grouped by finest cube, unless all are summed directly.
    terms: Vec<(DVec3, f64)>,
    /// For each finest cube that contains terms, in the order of the finest level's `sources`, the start and the end
    /// (exclusive) of its range in `terms`.
    ranges: Vec<[usize; 2]>,
    /// Whether all terms are summed directly, as kernels that grow with the distance require.
    direct: bool,
    /// The cube of the last evaluation, with its near terms: consecutive points often share a cube.
    cached: CachedCube,
}

/// The cube of the octree in which a point was last evaluated, with its index in the `targets` of its level, and the
/// ranges of `terms` near it.
#[derive(Clone, Debug)]
struct CachedCube {
    level: usize,
    cube: CubeCoords,
    number: usize,
    ranges: Vec<[usize; 2]>,
}

/// One level of the octree: its cubes of one size, with sources (the terms in them) and targets (the far terms' sum in
/// them).
#[derive(Clone, Debug)]
struct Level {
    /// Number of cubes along a side of the root cube.
    side: i32,
    /// Index in `sources` of each cube of the level, or [`NONE`] if it contains no terms.
    source_ids: Vec<u32>,
    sources: Vec<Nodal>,
    /// Index in `targets` of each cube of the level, or [`NONE`] until it is computed.
    target_ids: Vec<u32>,
    targets: Vec<Nodal>,
    translations: Option<Translations>,
}

type CubeCoords = [i32; 3];

impl Level {
    fn new(side: i32) -> Self {
        let empty = vec![NONE; (side * side * side) as usize];
        Self {
            side,
            source_ids: empty.clone(),
            sources: Vec::new(),
            target_ids: empty,
            targets: Vec::new(),
            translations: None,
        }
    }

    fn index(&self, cube: CubeCoords) -> Option<usize> {
        let inside = cube.iter().all(|&k| k >= 0 && k < self.side);
        inside.then(|| ((cube[2] * self.side + cube[1]) * self.side + cube[0]) as usize)
    }

    fn sources_at(&self, cube: CubeCoords) -> Option<usize> {
        let number = self.source_ids[self.index(cube)?];
        (number != NONE).then_some(number as usize)
    }
}

impl FastField {
    /// Prepares `field` for fast evaluation in a cube around the centres of all terms and the box between the corners
    /// `low` and `high`. Outside it, and everywhere for kernels that grow with the distance, all terms are summed
    /// directly.
    pub fn new(field: Field, low: DVec3, high: DVec3) -> Self {
        let terms = field.terms();
        let low = terms.iter().fold(low, |low, (c, _)| low.min(*c));
        let high = terms.iter().fold(high, |high, (c, _)| high.max(*c));
        let edge = (high - low).max_element() * 1.0001;
        let origin = (low + high) * 0.5 - DVec3::splat(0.5 * edge);
        let mut fast = Self {
            chebyshev: Chebyshev::new(),
            turns: CubeSymmetries::new(),
            origin,
            edge,
            levels: Vec::new(),
            terms: terms.to_vec(),
            ranges: Vec::new(),
            direct: field.table().kernel().is_conditional(),
            cached: CachedCube { level: 0, cube: NO_CUBE, number: 0, ranges: Vec::new() },
            field,
        };
        if !fast.direct {
            fast.choose_levels();
            fast.gather_sources();
        }
        fast
    }

    /// Writes the value of the implicit function f at each of the points `targets`, which are in the normalised box, to
    /// `out`.
    pub fn values(&mut self, targets: &[DVec3], out: &mut [f64]) {
        for (p, value) in targets.iter().zip(out) {
            *value = self.value(*p);
        }
    }

    fn value(&mut self, p: DVec3) -> f64 {
        let Some(at) = self.local(p) else { return self.field.value(p) };
        let mut sum = self.chebyshev.value(self.nodal(), at);
        for &[from, to] in &self.cached.ranges {
            for term in &self.terms[from..to] {
                sum += self.field.term(term, p);
            }
        }
        sum + self.field.polynomial(p)
    }

    /// Returns the implicit function f and its gradient ∇f at `p`, in units of the normalised box.
    pub fn value_and_gradient(&mut self, p: DVec3) -> (f64, DVec3) {
        let Some(at) = self.local(p) else { return self.field.value_and_gradient(p) };
        let (mut sum, slope) = self.chebyshev.value_and_gradient(self.nodal(), at);
        let mut gradient = slope * (2.0 / self.cube_edge(self.cached.level));
        for &[from, to] in &self.cached.ranges {
            for term in &self.terms[from..to] {
                let (value, slope) = self.field.term_and_gradient(term, p);
                sum += value;
                gradient += slope;
            }
        }
        (sum + self.field.polynomial(p), gradient + self.field.slopes())
    }

    /// Returns the sum of all far terms at the Chebyshev nodes of the cube in which a point was last evaluated.
    fn nodal(&self) -> &Nodal {
        &self.levels[self.cached.level].targets[self.cached.number]
    }

    fn cube_edge(&self, level: usize) -> f64 {
        self.edge / f64::from(self.levels[level].side)
    }

    fn cube_of(&self, p: DVec3, level: usize) -> CubeCoords {
        ((p - self.origin) / self.cube_edge(level)).floor().to_array().map(|x| x as i32)
    }

    /// Returns the position of `p` relative to the cube with coordinates `cube` at `level` of the octree, scaled so
    /// that the cube is [−1, 1]³.
    fn within(&self, p: DVec3, cube: CubeCoords, level: usize) -> DVec3 {
        let middle = DVec3::from_array(cube.map(|k| f64::from(k) + 0.5));
        ((p - self.origin) / self.cube_edge(level) - middle) * 2.0
    }

    /// Adds levels to the octree, three at least, until the finest cubes that contain terms contain [`TERMS_A_CUBE`] or
    /// fewer on average, or the depth is [`MAX_LEVELS`].
    fn choose_levels(&mut self) {
        for depth in 0..=MAX_LEVELS {
            self.levels.push(Level::new(1 << depth));
            let index = |c: DVec3| self.levels[depth].index(self.cube_of(c, depth)).unwrap_or(0) as u32;
            let mut cubes: Vec<u32> = self.terms.iter().map(|(c, _)| index(*c)).collect();
            sort_distinct(&mut cubes);
            if depth >= 2 && self.terms.len() <= TERMS_A_CUBE * cubes.len() {
                break;
            }
        }
    }

    /// Upward pass of the fast multipole method: sorts the terms into the finest cubes, spreads them to the Chebyshev
    /// nodes, and moves these sources to the larger cubes. Also computes the translations of all levels that have cubes
    /// which do not touch.
    fn gather_sources(&mut self) {
        let finest = self.levels.len() - 1;
        let index =
            |i: u32| self.levels[finest].index(self.cube_of(self.terms[i as usize].0, finest)).unwrap_or(0);
        let mut keyed: Vec<(u64, u32)> = (0..self.terms.len() as u32).map(|i| (index(i) as u64, i)).collect();
        sort_pairs(&mut keyed);
        self.terms = keyed.iter().map(|&(_, i)| self.terms[i as usize]).collect();
        let mut start = 0;
        for same in keyed.chunk_by(|a, b| a.0 == b.0) {
            let range = [start, start + same.len()];
            let cube = self.cube_of(self.terms[start].0, finest);
            let mut nodal = [0.0; CUBE];
            for &(c, w) in &self.terms[range[0]..range[1]] {
                self.chebyshev.spread_source(&mut nodal, self.within(c, cube, finest), w);
            }
            self.levels[finest].source_ids[same[0].0 as usize] = self.ranges.len() as u32;
            self.levels[finest].sources.push(nodal);
            self.ranges.push(range);
            start = range[1];
        }
        for level in (2..finest).rev() {
            self.gather_from_below(level);
        }
        for level in 2..=finest {
            let edge = self.cube_edge(level);
            self.levels[level].translations =
                Some(Translations::new(self.field.table(), &self.chebyshev, edge));
        }
    }

    fn gather_from_below(&mut self, level: usize) {
        let (upper, lower) = self.levels.split_at_mut(level + 1);
        let (here, below) = (&mut upper[level], &lower[0]);
        for (at, &number) in below.source_ids.iter().enumerate().filter(|(_, number)| **number != NONE) {
            let side = below.side as usize;
            let cube = [at % side, at / side % side, at / (side * side)];
            let moved =
                self.chebyshev.multipole_to_multipole(&below.sources[number as usize], cube.map(|k| k % 2));
            let Some(slot) = here.index(cube.map(|k| (k / 2) as i32)) else { continue };
            if here.source_ids[slot] == NONE {
                here.source_ids[slot] = here.sources.len() as u32;
                here.sources.push([0.0; CUBE]);
            }
            let sum = &mut here.sources[here.source_ids[slot] as usize];
            sum.iter_mut().zip(moved).for_each(|(x, y)| *x += y);
        }
    }

    /// Finds the cube in which `p` is evaluated, the largest one around `p` with no terms near it, or else its finest
    /// cube, and caches it. Returns the position of `p` in it, scaled to [−1, 1]³; `None` outside the root cube and if
    /// all terms are summed directly.
    fn local(&mut self, p: DVec3) -> Option<DVec3> {
        if self.direct {
            return None;
        }
        let finest = self.levels.len() - 1;
        self.levels[finest].index(self.cube_of(p, finest))?;
        if self.cube_of(p, self.cached.level) != self.cached.cube {
            let is_far = |&level: &usize| {
                around(self.cube_of(p, level)).all(|near| self.levels[level].sources_at(near).is_none())
            };
            let level = (2..finest).find(is_far).unwrap_or(finest);
            let cube = self.cube_of(p, level);
            let number = self.target(level, cube);
            // In cubes larger than the finest, this finds none.
            let sources = around(cube).filter_map(|cube| self.levels[level].sources_at(cube));
            let ranges = sources.map(|source| self.ranges[source]).collect();
            self.cached = CachedCube { level, cube, number, ranges };
        }
        Some(self.within(p, self.cached.cube, self.cached.level))
    }

    /// Downward pass of the fast multipole method: computes the sum of all far terms at the Chebyshev nodes of a cube,
    /// unless that was done before. Returns the cube's index in `targets`.
    fn target(&mut self, level: usize, cube: CubeCoords) -> usize {
        let Some(slot) = self.levels[level].index(cube) else { return 0 };
        let number = self.levels[level].target_ids[slot];
        if number != NONE {
            return number as usize;
        }
        let mut nodal = [0.0; CUBE];
        if level > 2 {
            let parent = self.target(level - 1, cube.map(|k| k / 2));
            nodal = self
                .chebyshev
                .local_to_local(&self.levels[level - 1].targets[parent], cube.map(|k| (k % 2) as usize));
        }
        let here = &self.levels[level];
        for offset in far_offsets(cube) {
            let from = [0, 1, 2].map(|axis| cube[axis] + offset[axis]);
            if let (Some(sources), Some(translations)) = (here.sources_at(from), &here.translations) {
                translations.add(&self.turns, offset, &here.sources[sources], &mut nodal);
            }
        }
        let number = here.targets.len();
        self.levels[level].target_ids[slot] = number as u32;
        self.levels[level].targets.push(nodal);
        number
    }
}

/// Returns the coordinates of a cube of the octree and of its 26 neighbours, whose terms are near.
fn around(cube: CubeCoords) -> impl Iterator<Item = CubeCoords> {
    (0..27).map(move |k| [cube[0] + k % 3 - 1, cube[1] + k / 3 % 3 - 1, cube[2] + k / 9 - 1])
}

/// Returns the offsets to the cubes in the interaction list of the cube at `cube`: cubes that do not touch it, but
/// whose parents touch its parent; their sources are translated to it.
fn far_offsets(cube: CubeCoords) -> impl Iterator<Item = CubeCoords> {
    // The children of the parent's neighbours extend two cubes to one side, and three to the other.
    let lowest = cube.map(|k| -2 - k.rem_euclid(2));
    let all = (0..216).map(move |k| [lowest[0] + k % 6, lowest[1] + k / 6 % 6, lowest[2] + k / 36]);
    all.filter(|offset| offset.iter().any(|d| d.abs() > 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3};
    use crate::methods::implicit::kernel::{Kernel, KernelTable};
    use crate::methods::implicit::solve::Solution;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn unit(random: &mut Random) -> f64 {
        f64::from(random.next_u32()) / 2_147_483_648.0 - 1.0
    }

    fn direction(random: &mut Random) -> DVec3 {
        DVec3::new(unit(random), unit(random), unit(random)).normalize_or(DVec3::X)
    }

    /// Returns an implicit function for tests with terms of both signs around a sphere, which cancel as those of a
    /// solution do.
    fn field(kernel: Kernel) -> Field {
        let mut random = Random::new(1);
        let mut centres: Vec<Vec3> = (0..2000).map(|_| direction(&mut random).as_vec3()).collect();
        centres.extend((0..16).map(|_| (direction(&mut random) * 2.0).as_vec3()));
        let mut weights: Vec<f64> = centres.iter().map(|_| unit(&mut random)).collect();
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        weights.iter_mut().for_each(|w| *w -= mean);
        let coefficients = if kernel.polynomials() == 4 { vec![0.3, 0.1, -0.2, 0.4] } else { vec![0.3] };
        Field::new(KernelTable::new(kernel), &centres, &Solution { weights, coefficients })
    }

    /// Returns test points on the unit sphere, near it, inside, at the rim of the root cube, and beyond it.
    fn random_points(count: usize) -> Vec<DVec3> {
        let mut random = Random::new(2);
        (0..count)
            .map(|k| direction(&mut random) * [1.0, 1.001, 1.1, 0.3, 1.9, 6.0, 60.0][k % 7])
            .chain([DVec3::ZERO, DVec3::splat(2.0), DVec3::splat(-2.0)])
            .collect()
    }

    #[test]
    fn it_is_the_function_and_its_gradient() {
        for kernel in [
            Kernel::MultiOrder { delta: 5.0, tau: 0.025 },
            Kernel::MultiOrder { delta: 40.0, tau: 0.025 },
            Kernel::MultiOrder { delta: 10.0, tau: 0.01 },
            Kernel::Gaussian { sigma: 0.07 },
            Kernel::ThinPlate { radius: 2.0 },
            Kernel::Biharmonic { radius: 2.0 },
        ] {
            let exact = field(kernel);
            // Kernels that grow with the distance cancel far away.
            let rounding = if kernel.is_conditional() { 1e-6 } else { 1e-12 };
            let mut fast = FastField::new(exact.clone(), DVec3::splat(-1.5), DVec3::splat(1.5));
            let at = random_points(700);
            let mut values = vec![0.0; at.len()];
            fast.values(&at, &mut values);
            let expected: Vec<(f64, DVec3)> = at.iter().map(|&p| exact.value_and_gradient(p)).collect();
            let size = expected.iter().map(|(f, _)| (f - 0.3).abs()).fold(0.0, f64::max);
            let steep = expected.iter().map(|(_, g)| g.length()).fold(0.0, f64::max);
            let (mut worst, mut worst_slope): (f64, f64) = (0.0, 0.0);
            for ((p, value), (f, g)) in at.iter().zip(&values).zip(&expected) {
                assert!((exact.value(*p) - f).abs() <= rounding * size);
                let (same, slope) = fast.value_and_gradient(*p);
                assert!((same - value).abs() <= rounding * size, "{kernel:?} at {p}: {same}, {value}");
                worst = worst.max((value - f).abs() / size);
                worst_slope = worst_slope.max(slope.distance(*g) / steep);
            }
            println!("{kernel:?}: {worst:e}, gradients {worst_slope:e}");
            assert!(worst < 2e-3 && worst_slope < 1e-2, "{kernel:?}: {worst:e}, gradients {worst_slope:e}");
            assert!(!kernel.is_conditional() || worst < rounding);
        }
    }

    #[test]
    fn the_same_bits_in_any_order_of_asking() {
        let exact = field(Kernel::MultiOrder { delta: 5.0, tau: 0.025 });
        let new = || FastField::new(exact.clone(), DVec3::splat(-1.5), DVec3::splat(1.5));
        let at = random_points(300);
        let (mut values, mut backwards) = (vec![0.0; at.len()], vec![0.0; at.len()]);
        new().values(&at, &mut values);
        let mut other = new();
        for i in (0..at.len()).rev() {
            other.value_and_gradient(at[i]);
            other.values(&at[i..=i], &mut backwards[i..=i]);
        }
        assert!(values.iter().zip(&backwards).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn few_terms_and_coincident_terms() {
        let kernel = Kernel::MultiOrder { delta: 5.0, tau: 0.025 };
        for centres in [vec![Vec3::ZERO], (0..200).map(|k| Vec3::X + Vec3::Y * (k as f32 * 1e-6)).collect()] {
            let weights = vec![1.0; centres.len()];
            let solution = Solution { weights, coefficients: vec![0.0] };
            let exact = Field::new(KernelTable::new(kernel), &centres, &solution);
            let mut fast = FastField::new(exact.clone(), DVec3::splat(-1.0), DVec3::splat(1.0));
            let at = random_points(70);
            let mut values = vec![0.0; at.len()];
            fast.values(&at, &mut values);
            for (p, value) in at.iter().zip(&values) {
                assert!((value / exact.value(*p) - 1.0).abs() < 1e-3, "{p}: {value}, {}", exact.value(*p));
            }
        }
    }
}
