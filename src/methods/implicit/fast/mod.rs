//! The function at very many places: a fast multipole method with Chebyshev interpolation (Fong & Darve, *The black-box
//! fast multipole method*, 2009).
//!
//! Near terms are summed one by one. What all others add up to is smooth within a cube, and is interpolated there: the
//! smaller the cube, the nearer terms are. Cubes are filled when first asked about, so small ones are around the surface
//! only. Off by about a thousandth of what f changes
//! by from one point of the surface to the next; sums that must be right to rounding are [`Field`]'s. Kernels that grow
//! with the distance are summed one by one here, too: what is large in them cancels.

mod chebyshev;
mod translate;

use super::field::Field;
use crate::math::DVec3;
use chebyshev::{CUBE, Chebyshev, Nodal};
use translate::{Translations, Turns};

/// Terms in a finest cube, about. More, and near terms take longer; fewer, and there are more cubes.
const TERMS_A_CUBE: usize = 24;
/// Levels of cubes at most: tables of the finest have 8^this entries.
const MOST_LEVELS: usize = 6;
/// No cube, or none yet.
const NONE: u32 = u32::MAX;
/// No place: those outside of all cubes are nearer.
const NOWHERE: Place = [i32::MIN; 3];

/// A function with a fast way to many of its values.
#[derive(Clone, Debug)]
pub struct FastField {
    field: Field,
    chebyshev: Chebyshev,
    turns: Turns,
    /// The lowest corner and the edge of the cube that holds everything.
    origin: DVec3,
    edge: f64,
    levels: Vec<Level>,
    /// The terms by finest cube, those of one together.
    terms: Vec<(DVec3, f64)>,
    /// For each finest cube with terms, where they begin and end.
    ranges: Vec<[usize; 2]>,
    /// Whether all is summed term by term.
    direct: bool,
    /// The cube that was asked about last, and where the terms near it are: places often come in a row.
    near: Near,
}

/// The terms around a cube.
#[derive(Clone, Debug)]
struct Near {
    level: usize,
    cube: Place,
    number: usize,
    ranges: Vec<[usize; 2]>,
}

/// The cubes of one size.
#[derive(Clone, Debug)]
struct Level {
    /// Cubes along a side.
    side: i32,
    /// By place, the number of a cube with sources.
    with_sources: Vec<u32>,
    sources: Vec<Nodal>,
    /// By place, the number of a cube that was asked about.
    with_places: Vec<u32>,
    places: Vec<Nodal>,
    translations: Option<Translations>,
}

type Place = [i32; 3];

impl Level {
    fn new(side: i32) -> Self {
        let empty = vec![NONE; (side * side * side) as usize];
        Self {
            side,
            with_sources: empty.clone(),
            sources: Vec::new(),
            with_places: empty,
            places: Vec::new(),
            translations: None,
        }
    }

    fn index(&self, place: Place) -> Option<usize> {
        let inside = place.iter().all(|&k| k >= 0 && k < self.side);
        inside.then(|| ((place[2] * self.side + place[1]) * self.side + place[0]) as usize)
    }

    fn sources_at(&self, place: Place) -> Option<usize> {
        let number = self.with_sources[self.index(place)?];
        (number != NONE).then_some(number as usize)
    }
}

impl FastField {
    /// `field`, fast in a box between two corners.
    pub fn new(field: Field, low: DVec3, high: DVec3) -> Self {
        let terms = field.terms();
        let low = terms.iter().fold(low, |low, (c, _)| low.min(*c));
        let high = terms.iter().fold(high, |high, (c, _)| high.max(*c));
        let edge = (high - low).max_element() * 1.0001;
        let origin = (low + high) * 0.5 - DVec3::splat(0.5 * edge);
        let mut fast = Self {
            chebyshev: Chebyshev::new(),
            turns: Turns::new(),
            origin,
            edge,
            levels: Vec::new(),
            terms: terms.to_vec(),
            ranges: Vec::new(),
            direct: field.table().kernel().is_conditional(),
            near: Near { level: 0, cube: NOWHERE, number: 0, ranges: Vec::new() },
            field,
        };
        if !fast.direct {
            fast.choose_levels();
            fast.gather_sources();
        }
        fast
    }

    /// f at each place.
    pub fn values(&mut self, places: &[DVec3], out: &mut [f64]) {
        for (p, value) in places.iter().zip(out) {
            *value = self.value(*p);
        }
    }

    fn value(&mut self, p: DVec3) -> f64 {
        let Some(at) = self.local(p) else { return self.field.value(p) };
        let mut sum = self.chebyshev.value(self.nodal(), at);
        for &[from, to] in &self.near.ranges {
            for term in &self.terms[from..to] {
                sum += self.field.term(term, p);
            }
        }
        sum + self.field.polynomial(p)
    }

    /// f and ∇f at `p`.
    pub fn value_and_gradient(&mut self, p: DVec3) -> (f64, DVec3) {
        let Some(at) = self.local(p) else { return self.field.value_and_gradient(p) };
        let (mut sum, slope) = self.chebyshev.value_and_gradient(self.nodal(), at);
        let mut gradient = slope * (2.0 / self.cube_edge(self.near.level));
        for &[from, to] in &self.near.ranges {
            for term in &self.terms[from..to] {
                let (value, slope) = self.field.term_and_gradient(term, p);
                sum += value;
                gradient += slope;
            }
        }
        (sum + self.field.polynomial(p), gradient + self.field.slopes())
    }

    /// What all far terms add up to in the near cube.
    fn nodal(&self) -> &Nodal {
        &self.levels[self.near.level].places[self.near.number]
    }

    fn cube_edge(&self, level: usize) -> f64 {
        self.edge / f64::from(self.levels[level].side)
    }

    fn place_of(&self, p: DVec3, level: usize) -> Place {
        ((p - self.origin) / self.cube_edge(level)).floor().to_array().map(|x| x as i32)
    }

    /// A place within a cube as [−1, 1]³.
    fn within(&self, p: DVec3, place: Place, level: usize) -> DVec3 {
        let middle = DVec3::from_array(place.map(|k| f64::from(k) + 0.5));
        ((p - self.origin) / self.cube_edge(level) - middle) * 2.0
    }

    /// Deep enough that the cubes with terms hold few each.
    fn choose_levels(&mut self) {
        for depth in 0..=MOST_LEVELS {
            self.levels.push(Level::new(1 << depth));
            let mut places: Vec<Place> = self.terms.iter().map(|(c, _)| self.place_of(*c, depth)).collect();
            places.sort_unstable();
            places.dedup();
            if depth >= 2 && self.terms.len() <= TERMS_A_CUBE * places.len() {
                break;
            }
        }
    }

    /// Sorts the terms into the finest cubes, and carries them up to the larger ones.
    fn gather_sources(&mut self) {
        let finest = self.levels.len() - 1;
        let index =
            |i: u32| self.levels[finest].index(self.place_of(self.terms[i as usize].0, finest)).unwrap_or(0);
        let mut keyed: Vec<(u64, u32)> = (0..self.terms.len() as u32).map(|i| (index(i) as u64, i)).collect();
        keyed.sort_unstable();
        self.terms = keyed.iter().map(|&(_, i)| self.terms[i as usize]).collect();
        let mut start = 0;
        for same in keyed.chunk_by(|a, b| a.0 == b.0) {
            let range = [start, start + same.len()];
            let place = self.place_of(self.terms[start].0, finest);
            let mut nodal = [0.0; CUBE];
            for &(c, w) in &self.terms[range[0]..range[1]] {
                self.chebyshev.spread(&mut nodal, self.within(c, place, finest), w);
            }
            self.levels[finest].with_sources[same[0].0 as usize] = self.ranges.len() as u32;
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
        for (at, &number) in below.with_sources.iter().enumerate().filter(|(_, number)| **number != NONE) {
            let side = below.side as usize;
            let place = [at % side, at / side % side, at / (side * side)];
            let moved = self.chebyshev.to_whole(&below.sources[number as usize], place.map(|k| k % 2));
            let Some(slot) = here.index(place.map(|k| (k / 2) as i32)) else { continue };
            if here.with_sources[slot] == NONE {
                here.with_sources[slot] = here.sources.len() as u32;
                here.sources.push([0.0; CUBE]);
            }
            let sum = &mut here.sources[here.with_sources[slot] as usize];
            sum.iter_mut().zip(moved).for_each(|(x, y)| *x += y);
        }
    }

    /// Where `p` is in the largest cube with no terms near it, or else in its finest one, which becomes the near one; `None`
    /// outside of all.
    fn local(&mut self, p: DVec3) -> Option<DVec3> {
        if self.direct {
            return None;
        }
        let finest = self.levels.len() - 1;
        self.levels[finest].index(self.place_of(p, finest))?;
        if self.place_of(p, self.near.level) != self.near.cube {
            let is_far = |&level: &usize| {
                around(self.place_of(p, level)).all(|near| self.levels[level].sources_at(near).is_none())
            };
            let level = (2..finest).find(is_far).unwrap_or(finest);
            let cube = self.place_of(p, level);
            let number = self.fill(level, cube);
            // The sources of larger cubes are none.
            let sources = around(cube).filter_map(|place| self.levels[level].sources_at(place));
            let ranges = sources.map(|source| self.ranges[source]).collect();
            self.near = Near { level, cube, number, ranges };
        }
        Some(self.within(p, self.near.cube, self.near.level))
    }

    /// Makes what all far terms add up to in a cube, if it is not there yet. Returns its number.
    fn fill(&mut self, level: usize, place: Place) -> usize {
        let Some(slot) = self.levels[level].index(place) else { return 0 };
        let number = self.levels[level].with_places[slot];
        if number != NONE {
            return number as usize;
        }
        let mut nodal = [0.0; CUBE];
        if level > 2 {
            let parent = self.fill(level - 1, place.map(|k| k / 2));
            nodal = self
                .chebyshev
                .to_half(&self.levels[level - 1].places[parent], place.map(|k| (k % 2) as usize));
        }
        let here = &self.levels[level];
        for offset in far_offsets(place) {
            let from = [0, 1, 2].map(|axis| place[axis] + offset[axis]);
            if let (Some(sources), Some(translations)) = (here.sources_at(from), &here.translations) {
                translations.add(&self.turns, offset, &here.sources[sources], &mut nodal);
            }
        }
        let number = here.places.len();
        self.levels[level].with_places[slot] = number as u32;
        self.levels[level].places.push(nodal);
        number
    }
}

/// The cube and the 26 that touch it.
fn around(cube: Place) -> impl Iterator<Item = Place> {
    (0..27).map(move |k| [cube[0] + k % 3 - 1, cube[1] + k / 3 % 3 - 1, cube[2] + k / 9 - 1])
}

/// Where cubes lie that do not touch this one while those they are part of do.
fn far_offsets(place: Place) -> impl Iterator<Item = Place> {
    // Those next to the cube this one is part of span two cubes on its far sides and three on the others.
    let lowest = place.map(|k| -2 - k.rem_euclid(2));
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
        f64::from(random.bits()) / 2_147_483_648.0 - 1.0
    }

    fn direction(random: &mut Random) -> DVec3 {
        DVec3::new(unit(random), unit(random), unit(random)).normalize_or(DVec3::X)
    }

    /// Terms around a ball, of both signs, that cancel as those of a solution do.
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

    /// On the surface, near it, within, at the rim, and beyond the box.
    fn places(count: usize) -> Vec<DVec3> {
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
            // What grows with the distance cancels far away.
            let rounding = if kernel.is_conditional() { 1e-6 } else { 1e-12 };
            let mut fast = FastField::new(exact.clone(), DVec3::splat(-1.5), DVec3::splat(1.5));
            let at = places(700);
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
        let at = places(300);
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
    fn few_terms_and_terms_in_one_place() {
        let kernel = Kernel::MultiOrder { delta: 5.0, tau: 0.025 };
        for centres in [vec![Vec3::ZERO], (0..200).map(|k| Vec3::X + Vec3::Y * (k as f32 * 1e-6)).collect()] {
            let weights = vec![1.0; centres.len()];
            let solution = Solution { weights, coefficients: vec![0.0] };
            let exact = Field::new(KernelTable::new(kernel), &centres, &solution);
            let mut fast = FastField::new(exact.clone(), DVec3::splat(-1.0), DVec3::splat(1.0));
            let at = places(70);
            let mut values = vec![0.0; at.len()];
            fast.values(&at, &mut values);
            for (p, value) in at.iter().zip(&values) {
                assert!((value / exact.value(*p) - 1.0).abs() < 1e-3, "{p}: {value}, {}", exact.value(*p));
            }
        }
    }
}
