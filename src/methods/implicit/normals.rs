//! Normals for points that have none: planes fitted to neighbourhoods, oriented consistently by propagation along a
//! minimum spanning tree (Hoppe, DeRose, Duchamp, McDonald & Stuetzle, *Surface reconstruction from unorganized
//! points*, 1992).

use crate::math::order::{rank_f64, sort_by_rank, sort_distinct};
use crate::math::{DMat3, DVec3, Vec3, symmetric};
use crate::pauses::Pauses;
use crate::spatial::PointGrid;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Radii of the neighbourhoods to which planes are fitted, in mean spacings of the points; the smallest with planar
/// neighbourhoods is chosen.
const RADII: [f32; 7] = [3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0];
/// Ratio of the standard deviations of a neighbourhood's points across their fitted plane and within it, below which
/// the neighbourhood counts as planar; noise is then a tenth of its radius.
const FLAT: f64 = 0.2;
/// Maximum number of points whose neighbourhoods are tested to choose one of [`RADII`].
const TRIALS: usize = 200;
/// Number of nearest points to which each point is linked in the graph along which normals are oriented, unless they
/// are on another sheet of the surface.
const NEIGHBOURS: usize = 10;

/// Number of points in neighbourhoods that are a unit of work.
const POINTS_PER_UNIT: usize = 100;

/// Unit normals of the surface at some points of a cloud, and the noise of the cloud, for making exterior points.
pub struct Normals {
    /// Unit normals, one for each point at which they were requested, pointing outwards as far as can be determined.
    pub directions: Vec<Vec3>,
    /// Noise of the points: their standard deviation from the planes fitted to them, in units of their coordinates; 0
    /// if normals were given.
    pub noise: f32,
}

/// Estimates normals of the surface near `points`, whose mean distance to the nearest neighbour is `spacing`, at the
/// points with indices `at`.
///
/// Within each connected component of the graph that links neighbouring points, normals are oriented like an already
/// oriented neighbour, the pair with the smallest angle first; then each component is oriented such that it encloses a
/// positive volume. Pauses meanwhile.
pub async fn estimated_normals(points: &[Vec3], at: &[u32], spacing: f32, pauses: &Pauses) -> Normals {
    let grid = PointGrid::of(points, RADII[0] * spacing);
    let positions: Vec<Vec3> = at.iter().map(|&i| points[i as usize]).collect();
    let (radius, noise) = flattest_radius(&grid, &positions, spacing, pauses).await;
    let mut directions = Vec::with_capacity(positions.len());
    for &p in &positions {
        directions.push(Plane::around(&grid, p, radius, pauses).await.normal);
    }
    let graph = neighbour_graph(&positions, &directions, radius);
    let mut oriented = vec![false; positions.len()];
    for part in connected_components(&graph) {
        propagate(part[0], &graph, &mut directions, &mut oriented);
        if outward_flux(&positions, &directions, &part) < 0.0 {
            part.iter().for_each(|&i| directions[i as usize] = -directions[i as usize]);
        }
    }
    Normals { directions, noise: noise as f32 }
}

/// The least-squares plane of the points around a position, whose normal is an estimate of the surface normal.
struct Plane {
    normal: Vec3,
    /// Standard deviation of the points across the plane, in units of their coordinates.
    thickness: f64,
    /// Standard deviation of the points within the plane, along the direction in which it is least, in units of their
    /// coordinates.
    width: f64,
}

impl Plane {
    async fn around(grid: &PointGrid, p: Vec3, radius: f32, pauses: &Pauses) -> Self {
        let (mut count, mut sum, mut squares) = (0.0, DVec3::ZERO, DMat3::ZERO);
        grid.within(p, radius, |i, _| {
            let d = (grid.points()[i as usize] - p).as_dvec3();
            count += 1.0;
            sum += d;
            squares += symmetric::outer(d);
            true
        });
        pauses.after(1 + count as usize / POINTS_PER_UNIT).await;
        let mean = sum / count;
        let spread = squares * (1.0 / count) - symmetric::outer(mean);
        let (values, vectors) = symmetric::eigen(spread);
        let deviation = |x: f64| if x > 0.0 { x.sqrt() } else { 0.0 };
        Self { normal: vectors.x_axis.as_vec3(), thickness: deviation(values.x), width: deviation(values.y) }
    }

    fn flatness(&self) -> f64 {
        if self.width > 0.0 { self.thickness / self.width } else { 1.0 }
    }
}

/// Returns the radius of the neighbourhoods to which planes are fitted, the smallest of [`RADII`] whose median
/// neighbourhood is planar, or else the one whose median neighbourhood is flattest; and the thickness of that
/// neighbourhood. Both are in units of the points' coordinates.
async fn flattest_radius(grid: &PointGrid, positions: &[Vec3], spacing: f32, pauses: &Pauses) -> (f32, f64) {
    let step = positions.len().div_ceil(TRIALS);
    let mut best = (f64::INFINITY, RADII[0] * spacing, 0.0);
    for radius in RADII.map(|r| r * spacing) {
        let mut found: Vec<(f64, f64)> = Vec::new();
        for &p in positions.iter().step_by(step) {
            let plane = Plane::around(grid, p, radius, pauses).await;
            found.push((plane.flatness(), plane.thickness));
        }
        sort_by_rank(&mut found, |&(flatness, _)| rank_f64(flatness));
        let (flatness, thickness) = found[found.len() / 2];
        if flatness < best.0 {
            best = (flatness, radius, thickness);
        }
        if flatness < FLAT {
            break;
        }
    }
    (best.1, best.2)
}

/// Returns the graph along which normals are oriented, as lists of neighbours: each of `positions` is linked to its
/// [`NEIGHBOURS`] nearest ones, except those on another sheet of the surface, across a gap or a thin wall. `radius` is
/// the initial search radius.
fn neighbour_graph(positions: &[Vec3], normals: &[Vec3], radius: f32) -> Vec<Vec<u32>> {
    let grid = PointGrid::of(positions, radius);
    let near = |&p: &Vec3| grid.nearest(p, NEIGHBOURS + 1, radius).into_iter().map(|(_, i)| i as usize);
    let mut graph: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
    for (i, p) in positions.iter().enumerate() {
        for j in near(p).filter(|&j| j != i) {
            let offset = (positions[j] - *p).normalize_or_zero();
            if offset.dot(normals[i]).abs() < SAME_SHEET_COSINE
                || offset.dot(normals[j]).abs() < SAME_SHEET_COSINE
            {
                graph[i].push(j as u32);
                graph[j].push(i as u32);
            }
        }
    }
    for ids in &mut graph {
        sort_distinct(ids);
    }
    graph
}

/// Absolute cosine between a normal and the direction to a neighbour: if it is at least this for the normals of both,
/// point and neighbour count as parts of different sheets of the surface.
const SAME_SHEET_COSINE: f32 = 0.7;

fn connected_components(graph: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut seen = vec![false; graph.len()];
    let mut found = Vec::new();
    for start in 0..graph.len() as u32 {
        let (mut part, mut stack) = (Vec::new(), vec![start]);
        while let Some(i) = stack.pop() {
            if !std::mem::replace(&mut seen[i as usize], true) {
                part.push(i);
                stack.extend(&graph[i as usize]);
            }
        }
        if !part.is_empty() {
            found.push(part);
        }
    }
    found
}

/// Returns the flux of the offsets from the mean position through the points of a connected component, Σ (p − mean)·n
/// over the positions p with normals n. If the points are spread evenly over a closed surface with outward normals, it
/// is proportional to the enclosed volume (Gauss's theorem); a negative flux shows that all normals point inwards.
fn outward_flux(positions: &[Vec3], normals: &[Vec3], part: &[u32]) -> f64 {
    let position = |i: u32| positions[i as usize].as_dvec3();
    let middle = part.iter().map(|&i| position(i)).sum::<DVec3>() / part.len() as f64;
    part.iter().map(|&i| (position(i) - middle).dot(normals[i as usize].as_dvec3())).sum()
}

/// Orients the normals of the connected component of `start` along a minimum spanning tree over the angle between
/// normals (Prim's algorithm): each is flipped to agree with the normal of the point from which it is reached.
fn propagate(start: u32, graph: &[Vec<u32>], normals: &mut [Vec3], oriented: &mut [bool]) {
    let mut pending = BinaryHeap::from([Reverse((0_u32, start, start))]);
    while let Some(Reverse((_, i, from))) = pending.pop() {
        if std::mem::replace(&mut oriented[i as usize], true) {
            continue;
        }
        if normals[i as usize].dot(normals[from as usize]) < 0.0 {
            normals[i as usize] = -normals[i as usize];
        }
        let normal = normals[i as usize];
        for &j in graph[i as usize].iter().filter(|&&j| !oriented[j as usize]) {
            // Floats of at least 0 have the order of their bits.
            let turn = 1.0 - normal.dot(normals[j as usize]).abs();
            pending.push(Reverse(((if turn > 0.0 { turn } else { 0.0 }).to_bits(), j, i)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::methods::implicit::cloud::mean_spacing;
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a roughly normally distributed number with mean 0 and standard deviation 1, to disturb test points.
    fn noise(random: &mut Random) -> f64 {
        2.0 * ((0..3).map(|_| random.unit()).sum::<f64>() - 1.5)
    }

    type Surface = fn(&mut Random) -> (DVec3, DVec3);

    fn ball(random: &mut Random) -> (DVec3, DVec3) {
        let n = DVec3::new(noise(random), noise(random), noise(random)).normalize_or(DVec3::X);
        (n, n)
    }

    fn torus(random: &mut Random) -> (DVec3, DVec3) {
        loop {
            let [a, b] = [0; 2].map(|_| std::f64::consts::TAU * random.unit());
            let out = DVec3::new(libm::cos(a), libm::sin(a), 0.0);
            // Rejection makes the density uniform over the surface.
            if 0.3 * libm::cos(b) + 0.7 > random.unit() {
                let n = out * libm::cos(b) + DVec3::Z * libm::sin(b);
                return (out * 0.7 + n * 0.3, n);
            }
        }
    }

    fn two_balls(random: &mut Random) -> (DVec3, DVec3) {
        let (_, n) = ball(random);
        if random.unit() < 0.7 { (n * 0.5 - DVec3::X * 0.5, n) } else { (n * 0.3 + DVec3::X * 0.7, n) }
    }

    #[test]
    fn nearly_all_point_outwards() {
        let shapes: [(&str, Surface); 3] = [("ball", ball), ("torus", torus), ("two balls", two_balls)];
        for (name, shape) in shapes {
            for deviation in [0.0, 0.01] {
                for count in [1500, 3000] {
                    let mut random = Random::new(11);
                    let (exact, outwards): (Vec<DVec3>, Vec<DVec3>) =
                        (0..count).map(|_| shape(&mut random)).unzip();
                    let mut moved = |p: &DVec3| {
                        let by = DVec3::new(noise(&mut random), noise(&mut random), noise(&mut random));
                        (*p + by * deviation).as_vec3()
                    };
                    let points: Vec<Vec3> = exact.iter().map(&mut moved).collect();
                    let at: Vec<u32> = (0..count).step_by(8).collect();
                    let spacing = mean_spacing(&points) as f32;
                    let found = finished(estimated_normals(&points, &at, spacing, &Pauses::default()));
                    let right = |(i, n): &(&u32, &Vec3)| outwards[**i as usize].dot(n.as_dvec3()) > 0.5;
                    let share =
                        at.iter().zip(&found.directions).filter(right).count() as f64 / at.len() as f64;
                    println!(
                        "{name}, noise {deviation}, {count}: {:.2} %, noise found {:.4}",
                        100.0 * share,
                        found.noise
                    );
                    assert!(share >= 0.98, "{name}, noise {deviation}, {count} points: {share}");
                    if deviation > 0.0 {
                        assert!(
                            (0.5..2.0).contains(&(f64::from(found.noise) / deviation)),
                            "{name}: {}",
                            found.noise
                        );
                    }
                }
            }
        }
    }

    /// If the normal from which all others are oriented points inwards, so do all of its connected component, and the
    /// negative volume that they enclose shows it.
    #[test]
    fn orientation_does_not_depend_on_the_start() {
        let mut random = Random::new(5);
        let positions: Vec<Vec3> = (0..400).map(|_| ball(&mut random).0.as_vec3()).collect();
        let graph = neighbour_graph(&positions, &positions, 0.3);
        let all = connected_components(&graph);
        assert_eq!(all.len(), 1);
        for start in [0, 7, 399] {
            // Half of them are wrong, and so is the start.
            let mut normals: Vec<Vec3> =
                positions.iter().zip(0..).map(|(p, i)| *p * [1.0, -1.0][i % 2]).collect();
            normals[start as usize] = -positions[start as usize];
            propagate(start, &graph, &mut normals, &mut vec![false; positions.len()]);
            assert!(positions.iter().zip(&normals).all(|(p, n)| p.dot(*n) < 0.0));
            assert!(outward_flux(&positions, &normals, &all[0]) < 0.0);
        }
    }
}
