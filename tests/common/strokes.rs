//! Strokes of a brush on a volume whose object has a wall, bars and room for more parts.

use super::Random;
use super::scenes;
use vesicle::math::Vec3;
use vesicle::volume::{Region, Volume, VolumeInit, Voxels};

/// A capsule of voxels that a brush adds to the object or erases.
#[derive(Clone, Copy, Debug)]
pub struct Stroke {
    pub ends: [Vec3; 2],
    pub radius: f32,
    pub adds: bool,
}

/// The effect of a stroke on the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrokeKind {
    Add,
    Erase,
    Bridge,
    Cut,
    Drill,
    Island,
    EraseIsland,
}

impl StrokeKind {
    pub const ALL: [Self; 7] =
        [Self::Add, Self::Erase, Self::Bridge, Self::Cut, Self::Drill, Self::Island, Self::EraseIsland];
}

/// A hollow ball with bars across its cavity, in a volume of 8-bit voxels, and the islands that strokes added.
///
/// Lengths are in units of the radius of the brush: the wall is 2 thick, bars have a radius of 0.8 and are 6 apart.
#[derive(Clone, Debug)]
pub struct Scene {
    pub volume: Volume,
    side: usize,
    brush: f32,
    /// Whether voxels have intermediate values at the boundary of the object.
    is_smooth: bool,
    islands: Vec<Vec3>,
}

/// The intensity at which the surface of a [`Scene`] is.
pub const ISO: f64 = 100.0;

/// The intensity of the object.
const FULL: f32 = 200.0;

impl Scene {
    pub fn new(side: usize, brush: f32, is_smooth: bool) -> Self {
        let empty = scenes::volume([1; 3], |_| 0.0);
        let mut scene = Self { volume: empty, side, brush, is_smooth, islands: Vec::new() };
        let all = Region { min: [0; 3], dims: [side; 3] };
        let voxels = Voxels::U8(values(all, |p| scene.value(-scene.distance(p))));
        scene.volume = Volume::new(VolumeInit::new(voxels, [side, side, side, 1])).unwrap();
        scene
    }

    fn centre(&self) -> Vec3 {
        Vec3::splat(0.5 * (self.side as f32 - 1.0))
    }

    fn outer_radius(&self) -> f32 {
        0.43 * self.side as f32
    }

    /// Returns the value of a voxel at a depth inside the object, in voxels.
    fn value(&self, depth: f32) -> u8 {
        let share = if self.is_smooth {
            (0.5 + 0.5 * depth).clamp(0.0, 1.0)
        } else {
            f32::from(u8::from(depth >= 0.0))
        };
        (FULL * share) as u8
    }

    /// Returns the signed distance from the surface of the ball with its bars, negative inside.
    fn distance(&self, p: Vec3) -> f32 {
        let (b, r, q) = (self.brush, self.outer_radius(), p - self.centre());
        let from_centre = q.length();
        let wall = (from_centre - r).max(r - 2.0 * b - from_centre);
        let to_line = |x: f32| x - 6.0 * b * (x / (6.0 * b)).round_ties_even();
        let bar = Vec3::new(0.0, to_line(q.y), to_line(q.z)).length() - 0.8 * b;
        wall.min(bar.max(from_centre - r + b))
    }

    /// Returns a point on the axis of a bar, and the same point on the next bar, both in the cavity.
    fn on_bar(&self, random: &mut Random) -> [Vec3; 2] {
        let (step, room) = (6.0 * self.brush, self.outer_radius() - 4.0 * self.brush);
        loop {
            let mut within = || random.within(f64::from(-room), f64::from(room)) as f32;
            let (x, y, z) = (within(), within(), within());
            let on = Vec3::new(x, step * (y / step).round_ties_even(), step * (z / step).round_ties_even());
            let next = on + Vec3::Y * step;
            if on.length() < room && next.length() < room {
                return [on, next].map(|p| self.centre() + p);
            }
        }
    }

    fn direction(random: &mut Random) -> Vec3 {
        loop {
            let p = Vec3::from([(); 3].map(|()| random.within(-1.0, 1.0) as f32));
            if (0.1..1.0).contains(&p.length()) {
                return p.normalize_or_zero();
            }
        }
    }

    /// Returns a stroke of a kind at a random position; `None` for an island to be erased if there is none.
    pub fn stroke(&mut self, kind: StrokeKind, random: &mut Random) -> Option<Stroke> {
        let (b, r) = (self.brush, self.outer_radius());
        let radial = |random: &mut Random, [from, to]: [f32; 2]| {
            let direction = Self::direction(random);
            [self.centre() + direction * from, self.centre() + direction * to]
        };
        let one = |p| [p, p];
        let (ends, radius, adds) = match kind {
            StrokeKind::Add => (radial(random, [r, r]), b, true),
            StrokeKind::Erase => (radial(random, [r, r]), b, false),
            StrokeKind::Bridge => (self.on_bar(random), b, true),
            StrokeKind::Cut => (one(self.on_bar(random)[0]), b, false),
            StrokeKind::Drill => (radial(random, [r - 2.5 * b, r + b]), b, false),
            StrokeKind::Island => {
                let [on, next] = self.on_bar(random);
                let middle = (on + next) * 0.5 + Vec3::Z * 3.0 * b;
                self.islands.push(middle);
                (one(middle), b, true)
            }
            StrokeKind::EraseIsland => (one(self.islands.pop()?), b + 2.0, false),
        };
        Some(Stroke { ends, radius, adds })
    }

    /// Paints a stroke into the volume, and returns the region that it may have changed.
    pub fn paint(&mut self, stroke: Stroke) -> Region {
        let [a, b] = stroke.ends;
        let reach = Vec3::splat(stroke.radius + 1.0);
        let last = Vec3::splat(self.side as f32 - 1.0);
        let low = (a.min(b) - reach).floor().clamp(Vec3::ZERO, last).to_array().map(|x| x as usize);
        let high = (a.max(b) + reach).ceil().clamp(Vec3::ZERO, last).to_array().map(|x| x as usize);
        let region = Region { min: low, dims: [0, 1, 2].map(|axis| high[axis] + 1 - low[axis]) };
        let Voxels::U8(before) = self.volume.voxels() else { return region };
        let painted = values(region, |p| {
            let [x, y, z] = p.to_array().map(|x| x as usize);
            let before = before[x + self.side * (y + self.side * z)];
            let distance = if a == b { p.distance(a) } else { scenes::to_segment(p, a, b) };
            let brush = self.value(stroke.radius - distance);
            if stroke.adds { before.max(brush) } else { before.min(FULL as u8 - brush) }
        });
        self.volume.write(region, &Voxels::U8(painted), 0).unwrap();
        region
    }
}

/// Returns a value per voxel of a region, x fastest.
fn values(region: Region, mut value: impl FnMut(Vec3) -> u8) -> Vec<u8> {
    let [nx, ny, _] = region.dims;
    let at = |i: usize| Vec3::from([i % nx, i / nx % ny, i / nx / ny].map(|k| k as f32));
    let first = Vec3::from(region.min.map(|k| k as f32));
    (0..region.dims.iter().product()).map(|i| value(first + at(i))).collect()
}
