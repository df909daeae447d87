//! Vertex colours of the reconstructed surface from the images of the cameras (Dinh, Turk & Slabaugh, section VII-C).
//!
//! Each camera that sees a vertex contributes the colour of its image there, weighted by the cosine between the normal
//! and the direction to the camera. The paper subdivides triangles until their footprint in the images is smaller than
//! a pixel, and gives each one colour. Here each vertex has a colour, and triangles interpolate those of their corners:
//! as sharp as the images where edges are no longer than a pixel is wide, and otherwise as sharp as the mesh.
//!
//! A depth buffer for each camera decides visibility. At silhouettes, where the image may show the background, a camera
//! has hardly any weight. Vertices that no camera sees are filled in from their neighbours.

use super::camera::{Camera, ColorMean, Projected};
use crate::math::order::sort_distinct;
use crate::math::{DVec3, Groups, Vec3};
use crate::mesh::TriangleMesh;
use crate::pauses::Pauses;
use std::borrow::Cow;
use std::ops::Range;

/// Largest side of the depth buffer that decides which vertices a camera sees, in pixels; one of this size takes 16 MB.
/// Larger images get a buffer of lower resolution.
const LARGEST_BUFFER: u32 = 2048;

/// Cosine between surface normal and direction to the camera below which the depth tolerance of the visibility test no
/// longer grows. With a smaller value, vertices just behind a silhouette are seen through the surface; with a larger
/// one, vertices of a steep side hide each other. A camera with such an oblique view has next to no weight.
const GRAZING: f64 = 0.1;

/// Width, in image pixels, of the border of the visible part of the surface (the silhouette), where a camera has little
/// weight. The surface is never exact, and where it is slightly too large, the image shows the background at its
/// border: on a painted ball too large by half a pixel, colours are off by 0.14 with a width of 0 and by 0.01 with 3.
/// With 4, small parts in small images are nothing but silhouette, and colours are off by 0.07.
const SILHOUETTE_WIDTH: f64 = 3.0;

/// Factor on the weight of a camera's colour for a vertex at a silhouette: such colours matter only where no camera has
/// a better view.
const SILHOUETTE_WEIGHT: f32 = 0.01;

/// Number of vertices for which a camera counts as a unit of work.
const VERTICES_PER_UNIT: usize = 60;

/// Margin against rounding, in pixels, around the pixels that a triangle may cover in a depth buffer; without it,
/// single pixels on edges are missed.
const PIXEL_MARGIN: f64 = 1e-6;

/// Returns the colour of each vertex, red, green and blue in 0..1, from all cameras that have an image; `None` if no
/// camera sees any of it. See [`Coloring`] for the requirements on the surface.
pub async fn colors(surface: &TriangleMesh, cameras: &[Camera]) -> Option<Vec<Vec3>> {
    let (mut coloring, pauses) = (Coloring::new(surface.positions.len()), Pauses::default());
    for camera in cameras {
        coloring.add(surface, camera);
        pauses.after(1 + surface.positions.len() / VERTICES_PER_UNIT).await;
    }
    coloring.finish(surface)
}

/// Accumulates vertex colours of a surface, camera by camera.
///
/// All calls must be given the same closed surface, with triangles counter-clockwise seen from outside, with valid
/// indices. If it has no normals, those of [`TriangleMesh::vertex_normals`] are computed for each camera.
#[derive(Clone, Debug)]
pub struct Coloring {
    gathered: Vec<WeightedColor>,
    depths: DepthBuffer,
}

#[derive(Clone, Copy, Debug, Default)]
struct WeightedColor {
    /// Sum of the colours given to the vertex, each times its weight.
    color: Vec3,
    weight: f32,
}

impl Coloring {
    /// Creates an accumulator without colours, for a surface of `vertices` vertices.
    pub fn new(vertices: usize) -> Self {
        Self { gathered: vec![WeightedColor::default(); vertices], depths: DepthBuffer::default() }
    }

    /// Adds the colours of all vertices that `camera` sees, weighted by how well it sees them; does nothing if the
    /// camera has no image.
    pub fn add(&mut self, surface: &TriangleMesh, camera: &Camera) {
        if !camera.has_image() {
            return;
        }
        self.depths.draw(surface, camera);
        let normals = match &surface.normals {
            Some(normals) => Cow::Borrowed(normals),
            None => Cow::Owned(surface.vertex_normals()),
        };
        for ((gathered, p), normal) in self.gathered.iter_mut().zip(&surface.positions).zip(normals.iter()) {
            if let Some((color, weight)) = self.depths.sample_view(camera, p.as_dvec3(), normal.as_dvec3()) {
                gathered.color += color * weight;
                gathered.weight += weight;
            }
        }
    }

    /// Adds one weighted colour to a vertex, for example that of a nearby point.
    pub fn add_color(&mut self, vertex: usize, color: Vec3, weight: f32) {
        self.gathered[vertex].color += color * weight;
        self.gathered[vertex].weight += weight;
    }

    /// Returns whether no vertex has been given a colour so far; colours of the input points are used then.
    pub fn is_empty(&self) -> bool {
        self.gathered.iter().all(|gathered| gathered.weight == 0.0)
    }

    /// Returns the colour of each vertex: the weighted mean of the colours added. Unseen vertices take the mean of
    /// their neighbours, ring by ring outwards from the seen ones; connected components of which nothing is seen take
    /// the mean of all seen vertices. `None` if no vertex is seen.
    pub fn finish(self, surface: &TriangleMesh) -> Option<Vec<Vec3>> {
        let mean = |g: &WeightedColor| (g.weight > 0.0).then(|| g.color / g.weight);
        let mut colors: Vec<Option<Vec3>> = self.gathered.iter().map(mean).collect();
        let overall = mean_of(colors.iter().flatten().copied())?;
        fill_unseen(&mut colors, &neighbours(surface));
        Some(colors.into_iter().map(|color| color.unwrap_or(overall)).collect())
    }
}

fn mean_of(colors: impl Iterator<Item = Vec3>) -> Option<Vec3> {
    let (sum, count) = colors.fold((DVec3::ZERO, 0.0), |(sum, count), c| (sum + c.as_dvec3(), count + 1.0));
    (count > 0.0).then(|| (sum / count).as_vec3())
}

/// Fills in vertices without a colour that are connected to coloured ones, ring by ring, with the mean of their
/// neighbours.
fn fill_unseen(colors: &mut [Option<Vec3>], neighbours: &Groups<u32>) {
    let mut front: Vec<u32> = (0..colors.len() as u32).filter(|&v| colors[v as usize].is_some()).collect();
    while !front.is_empty() {
        let around = front.iter().flat_map(|&v| neighbours.of(v as usize));
        let mut ring: Vec<u32> = around.copied().filter(|&v| colors[v as usize].is_none()).collect();
        sort_distinct(&mut ring);
        let mean = |&v: &u32| mean_of(neighbours.of(v as usize).iter().filter_map(|&n| colors[n as usize]));
        let means: Vec<Option<Vec3>> = ring.iter().map(mean).collect();
        ring.iter().zip(means).for_each(|(&v, mean)| colors[v as usize] = mean);
        front = ring;
    }
}

/// Returns the neighbours of each vertex, from which unseen vertices take their colours. Each neighbour is listed once
/// for every triangle that has both vertices: on a closed surface, all equally often, so that means are not biased.
fn neighbours(surface: &TriangleMesh) -> Groups<u32> {
    let sides = |&[a, b, c]: &[u32; 3]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)];
    Groups::new(surface.positions.len(), surface.triangles.iter().flat_map(sides))
}

/// Depth buffer of one camera, to decide which vertices of the surface the camera sees.
#[derive(Clone, Debug, Default)]
struct DepthBuffer {
    width: usize,
    height: usize,
    /// Pixels of the depth buffer per image pixel along an axis, at most 1.
    scale: f64,
    /// 1/depth of the nearest surface at the centres of the buffer's pixels, row by row: unlike depth, it is linear
    /// over a triangle in the image. 0 where there is no surface.
    inverse_depth: Vec<f32>,
    /// The vertices of the surface as (x·depth, y·depth, depth), with x and y in buffer pixels; kept only to reuse the
    /// memory.
    view: Vec<DVec3>,
}

impl DepthBuffer {
    /// Renders the depths of `surface` as `camera` sees it, replacing the previous contents of the buffer.
    fn draw(&mut self, surface: &TriangleMesh, camera: &Camera) {
        let [width, height] = camera.size();
        self.scale = (f64::from(LARGEST_BUFFER) / f64::from(width.max(height))).min(1.0);
        [self.width, self.height] =
            [width, height].map(|side| (f64::from(side) * self.scale).ceil() as usize);
        self.inverse_depth.clear();
        self.inverse_depth.resize(self.width * self.height, 0.0);
        let mut view = std::mem::take(&mut self.view);
        view.clear();
        view.extend(surface.positions.iter().map(|p| {
            let v = camera.view(p.as_dvec3());
            DVec3::new(v.x * self.scale + v.z * self.shift(), v.y * self.scale + v.z * self.shift(), v.z)
        }));
        surface.triangles.iter().for_each(|t| self.draw_triangle(t.map(|v| view[v as usize])));
        self.view = view;
    }

    /// Returns the position in the buffer, along either axis and in buffer pixels, of the centre of the first image
    /// pixel: image and buffer start at the same border, but their pixels differ in size.
    fn shift(&self) -> f64 {
        0.5 * self.scale - 0.5
    }

    /// Rasterises a triangle into the depth buffer, whichever side faces the camera. It covers a pixel if the ray
    /// through the pixel's centre is a combination of the corners with non-negative factors, which also holds for
    /// corners behind the camera (Olano & Greer, *Triangle scan conversion using 2D homogeneous coordinates*, 1997).
    /// The three factors are linear over the image and sum to 1/depth.
    fn draw_triangle(&mut self, corners: [DVec3; 3]) {
        let [a, b, c] = corners;
        let volume = a.dot(b.cross(c));
        if volume == 0.0 {
            return;
        }
        let factors = [b.cross(c), c.cross(a), a.cross(b)].map(|edge| edge * volume.signum());
        let sum = (factors[0] + factors[1] + factors[2]) / volume.abs();
        let (columns, rows) = self.pixel_bounds(corners);
        let limits = nearness_limits(corners);
        for row in rows {
            for column in columns.clone() {
                let pixel = DVec3::new(column as f64, row as f64, 1.0);
                // Triangles that share an edge leave no gap: on it, their factors are exact opposites.
                if factors.iter().all(|factor| factor.dot(pixel) >= 0.0) {
                    let inverse_depth = sum.dot(pixel).max(limits.start).min(limits.end) as f32;
                    let stored = &mut self.inverse_depth[row * self.width + column];
                    *stored = stored.max(inverse_depth);
                }
            }
        }
    }

    /// Returns the ranges of the buffer's columns and rows that the part of a triangle in front of the camera can
    /// cover.
    fn pixel_bounds(&self, corners: [DVec3; 3]) -> (Range<usize>, Range<usize>) {
        // Near plane, relative to the deepest corner: the image of an edge through the camera's plane is unbounded.
        let near = 1e-6 * corners.iter().fold(0.0, |deepest: f64, p| deepest.max(p.z));
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut take = |p: DVec3| {
            low = low.min(p / p.z);
            high = high.max(p / p.z);
        };
        for (p, q) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])) {
            if p.z > near {
                take(p);
            }
            if near > 0.0 && (p.z > near) != (q.z > near) {
                take(p.lerp(q, (near - p.z) / (q.z - p.z)));
            }
        }
        // Casts from float saturate: negative values become 0.
        let pixels = |low: f64, high: f64, count: usize| {
            (low - PIXEL_MARGIN).ceil() as usize
                ..((high + PIXEL_MARGIN).floor() + 1.0).min(count as f64) as usize
        };
        (pixels(low.x, high.x, self.width), pixels(low.y, high.y, self.height))
    }

    /// Returns the colour of a surface point in the camera's image, and its weight: the cosine between normal and
    /// direction to the camera, times alpha, at a silhouette times [`SILHOUETTE_WEIGHT`]. `None` if the camera does not
    /// see the point, or the pixels that show it are masked.
    ///
    /// Only those of the four surrounding pixels that show the surface near the point are blended. If one shows
    /// something nearer, the point counts as hidden.
    fn sample_view(&self, camera: &Camera, p: DVec3, normal: DVec3) -> Option<(Vec3, f32)> {
        let to_camera = camera.centre() - p;
        let distance = to_camera.length();
        let cosine = normal.dot(to_camera) / distance;
        if cosine.is_nan() || cosine <= 0.0 {
            return None;
        }
        let at = camera.project(p)?;
        let slope = normal / (cosine.max(GRAZING) * distance);
        let tolerance = self.depth_tolerance(camera, at.depth, slope);
        let mut mix = ColorMean::default();
        for (pixel, share) in camera.bilinear_pixels(at.x, at.y)? {
            let [nearest, farthest] = self.depths_at(pixel);
            if nearest < at.depth - tolerance {
                return None;
            }
            if farthest <= at.depth + tolerance {
                mix.add(camera.pixel(pixel)?, share);
            }
        }
        let (color, alpha) = mix.color()?;
        let worth = if self.at_silhouette(camera, at, tolerance) { SILHOUETTE_WEIGHT } else { 1.0 };
        Some((color, cosine as f32 * alpha * worth))
    }

    /// Returns whether a surface point is at a silhouette, where the camera gets little weight: something farther away
    /// by several times `tolerance`, or nothing, is [`SILHOUETTE_WIDTH`] pixels to the left or right of it, above or
    /// below, in the image.
    fn at_silhouette(&self, camera: &Camera, at: Projected, tolerance: f64) -> bool {
        let [width, height] = camera.size().map(|side| side as usize);
        let beyond = at.depth + (SILHOUETTE_WIDTH + 1.0) * tolerance;
        [(-SILHOUETTE_WIDTH, 0.0), (SILHOUETTE_WIDTH, 0.0), (0.0, -SILHOUETTE_WIDTH), (0.0, SILHOUETTE_WIDTH)]
            .into_iter()
            .any(|(x, y)| {
                let [column, row] = [at.x + x, at.y + y].map(|at| at.round() as usize);
                let [_, farthest] = self.depths_at([column.min(width - 1), row.min(height - 1)]);
                farthest > beyond
            })
    }

    /// Returns the depth tolerance of the visibility test: a bound on the difference between a surface point at `depth`
    /// and the depths in the buffer's pixels around it. It is the change of depth in the tangent plane, plus the
    /// distance spanned by these pixels for deviations from that plane. `slope` is the normal divided by its dot
    /// product with the vector to the camera.
    fn depth_tolerance(&self, camera: &Camera, depth: f64, slope: DVec3) -> f64 {
        // One image pixel along each axis, and one buffer pixel more if those are larger.
        let pixels = if self.scale < 1.0 { 1.0 + 1.0 / self.scale } else { 1.0 };
        let change = |axis: DVec3| depth * slope.dot(axis).abs() + 0.5 * axis.length();
        pixels * depth * camera.pixel_axes().map(change).iter().sum::<f64>()
    }

    /// Returns the least and the greatest depth, in world units, in the buffer pixels around the centre of an image
    /// pixel, or those of a single pixel if buffer and image have the same size. Infinite where there is no surface.
    fn depths_at(&self, pixel: [usize; 2]) -> [f64; 2] {
        let [column, row] = pixel.map(|at| at as f64 * self.scale + self.shift());
        let (mut nearest, mut farthest) = (0.0, f32::INFINITY);
        for row in [row.floor(), row.ceil()].map(|row| (row as usize).min(self.height - 1)) {
            for column in [column.floor(), column.ceil()].map(|at| (at as usize).min(self.width - 1)) {
                let inverse_depth = self.inverse_depth[row * self.width + column];
                nearest = inverse_depth.max(nearest);
                farthest = inverse_depth.min(farthest);
            }
        }
        [nearest, farthest].map(|inverse_depth| f64::from(inverse_depth).recip())
    }
}

/// Returns 1/depth of the farthest and of the nearest corner of a triangle, limits that 1/depth interpolated over the
/// triangle must not exceed by rounding. The upper one is infinite if a corner is not in front of the camera.
fn nearness_limits(corners: [DVec3; 3]) -> Range<f64> {
    let depths = corners.map(|p| p.z);
    let [low, high] =
        [depths.into_iter().fold(f64::INFINITY, f64::min), depths.into_iter().fold(0.0, f64::max)];
    high.recip()..if low > 0.0 { low.recip() } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// A painted ball of a test scene. Rays that hit it take a colour that depends on the direction from its centre.
    struct Ball {
        centre: DVec3,
        radius: f64,
        paint: fn(DVec3) -> [u8; 4],
    }

    impl Ball {
        fn mesh(&self, edge: f32) -> TriangleMesh {
            let mesh = Mesh::icosphere(self.centre.as_vec3(), self.radius as f32, edge).unwrap();
            mesh.to_triangles()
        }

        /// Returns the distance at which the ray from `from` in the unit direction `ray` hits the ball, and the colour
        /// there; `None` if it misses.
        fn hit(&self, from: DVec3, ray: DVec3) -> Option<(f64, [u8; 4])> {
            let (along, off) = ((self.centre - from).dot(ray), from - self.centre);
            let root = along * along - off.length_squared() + self.radius * self.radius;
            let distance = along - root.max(0.0).sqrt();
            let outward = (off + ray * distance) / self.radius;
            (root >= 0.0 && distance > 0.0).then(|| (distance, (self.paint)(outward)))
        }
    }

    const UNIT: Ball = Ball { centre: DVec3::ZERO, radius: 1.0, paint: by_direction };
    const TEAL: [u8; 4] = [0, 128, 128, 255];
    const RED: [u8; 4] = [255, 0, 0, 255];
    const BLUE: [u8; 4] = [0, 0, 255, 255];
    const BLACK: [u8; 4] = [0, 0, 0, 255];

    fn by_direction(d: DVec3) -> [u8; 4] {
        let [r, g, b] = (d * 102.0 + 127.5).to_array().map(|c| c.round() as u8);
        [r, g, b, 255]
    }

    /// Returns a test camera at `from` that looks at `to`, with an image of the balls in front of `background`.
    fn camera(balls: &[&Ball], from: DVec3, to: DVec3, size: [u32; 2], background: [u8; 4]) -> Camera {
        let ahead = (to - from).normalize();
        let right = ahead.any_orthonormal_vector();
        let down = ahead.cross(right);
        let [width, height] = size.map(f64::from);
        let (x, y, focal) = (0.5 * (width - 1.0), 0.5 * (height - 1.0), 1.6 * width.min(height));
        let mut image = Vec::new();
        for pixel in 0..size[0] * size[1] {
            let (across, along) = (f64::from(pixel % size[0]) - x, f64::from(pixel / size[0]) - y);
            let ray = (ahead * focal + right * across + down * along).normalize();
            let hits = balls.iter().filter_map(|ball| ball.hit(from, ray));
            let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
            image.extend(nearest.map_or(background, |(_, color)| color));
        }
        let rows = [right * focal + ahead * x, down * focal + ahead * y, ahead];
        let projection = rows.map(|row| [row.x, row.y, row.z, -row.dot(from)]).concat();
        Camera::new(projection.try_into().unwrap(), size[0], size[1], Some(image)).unwrap()
    }

    fn six_sides(size: impl Fn(usize) -> [u32; 2]) -> Vec<Camera> {
        let from = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
        let views = from.into_iter().enumerate();
        views.map(|(i, from)| camera(&[&UNIT], from * 4.0, DVec3::ZERO, size(i), BLACK)).collect()
    }

    fn joined(meshes: [TriangleMesh; 2]) -> TriangleMesh {
        let [mut all, other] = meshes;
        let first = all.positions.len() as u32;
        all.positions.extend(other.positions);
        all.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        all.normals = Some(all.vertex_normals());
        all
    }

    fn weights(surface: &TriangleMesh, camera: &Camera) -> Vec<f32> {
        let mut coloring = Coloring::new(surface.positions.len());
        coloring.add(surface, camera);
        coloring.gathered.iter().map(|gathered| gathered.weight).collect()
    }

    /// Returns the largest difference, over all vertices and channels, between `colors` and the colour with which the
    /// unit ball is painted at a vertex; the error measure of the tests.
    fn worst(surface: &TriangleMesh, colors: &[Vec3]) -> f32 {
        let off = |(p, color): (&Vec3, &Vec3)| (*p * 0.4 + 0.5 - *color).abs().max_element();
        surface.positions.iter().zip(colors).map(off).fold(0.0, f32::max)
    }

    fn finished_colors(surface: &TriangleMesh, cameras: &[Camera]) -> Option<Vec<Vec3>> {
        finished(colors(surface, cameras))
    }

    #[test]
    fn a_painted_ball_comes_back() {
        let ball = UNIT.mesh(0.06);
        let cameras = six_sides(|_| [200, 200]);
        let found = worst(&ball, &finished_colors(&ball, &cameras).unwrap());
        assert!(found < 0.01, "{found}");
        let bare = TriangleMesh { normals: None, ..ball };
        let found = worst(&bare, &finished_colors(&bare, &cameras).unwrap());
        assert!(found < 0.01, "{found} without normals");
    }

    #[test]
    fn background_behind_a_surface_too_large_hardly_counts() {
        for (radius, size) in [(1.005, 50), (1.01, 50), (1.01, 100), (1.02, 100), (1.01, 200)] {
            let ball = Ball { radius, ..UNIT }.mesh(0.06);
            let found = worst(&ball, &finished_colors(&ball, &six_sides(|_| [size; 2])).unwrap());
            assert!(found < 0.02, "{found} with radius {radius} and {size} pixels");
        }
    }

    #[test]
    fn pictures_of_any_size() {
        let ball = UNIT.mesh(0.06);
        let sizes = [[300, 200], [64, 48], [3000, 90], [80, 2500], [200, 100], [101, 103]];
        let found = worst(&ball, &finished_colors(&ball, &six_sides(|i| sizes[i])).unwrap());
        assert!(found < 0.02, "{found}");
    }

    #[test]
    fn hidden_vertices_take_no_colors_of_occluders() {
        let big = Ball { paint: |_| TEAL, ..UNIT };
        for (gap, size) in [(0.05, 250), (0.05, 1000), (0.3, 100), (1.0, 250)] {
            let small = Ball { centre: DVec3::Z * (1.25 + gap), radius: 0.25, paint: |_| RED };
            let surface = joined([big.mesh(0.05), small.mesh(0.03)]);
            let camera = camera(&[&big, &small], DVec3::Z * 5.0, DVec3::ZERO, [size; 2], BLACK);
            let colors = finished_colors(&surface, &[camera]).unwrap();
            let split = big.mesh(0.05).positions.len();
            for (p, color) in surface.positions.iter().zip(&colors).take(split) {
                assert!(color.x < 0.01, "gap {gap}, {size} pixels: {p} is {color}");
            }
            let front = |p: &Vec3| p.z - small.centre.z as f32 > 0.1;
            for (p, color) in surface.positions.iter().zip(&colors).skip(split).filter(|(p, _)| front(p)) {
                assert!(color.x > 0.99, "gap {gap}, {size} pixels: {p} is {color}");
            }
        }
    }

    #[test]
    fn front_faces_are_seen_and_back_faces_not() {
        for (edge, size) in [(0.04, 30), (0.04, 200), (0.04, 1000), (0.3, 200), (2.0, 1000)] {
            let ball = UNIT.mesh(edge);
            let from = DVec3::new(2.0, 1.0, 3.0);
            let camera = camera(&[&UNIT], from, DVec3::ZERO, [size; 2], BLACK);
            for (p, weight) in ball.positions.iter().zip(weights(&ball, &camera)) {
                let cosine = p.dot((from.as_vec3() - *p).normalize());
                let right = if cosine > 0.15 { weight > 0.0 } else { cosine > 0.0 || weight == 0.0 };
                assert!(right, "edge {edge}, {size} pixels: cosine {cosine}, weight {weight}");
            }
        }
    }

    #[test]
    fn a_plate_hides_with_corners_behind_the_camera() {
        let ball = Ball { centre: DVec3::new(4.0, 0.0, -2.0), ..UNIT }.mesh(0.2);
        let corner = |x, y| Vec3::new(x, y, 0.0);
        let plate = TriangleMesh {
            positions: vec![
                corner(-60.0, -50.0),
                corner(60.0, -50.0),
                corner(60.0, 50.0),
                corner(-60.0, 50.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        };
        let view = || {
            let (from, to) = (DVec3::new(0.0, 0.0, 1.0), DVec3::new(4.0, 0.0, -2.0));
            camera(&[], from, to, [60, 60], TEAL)
        };
        assert!(weights(&ball, &view()).iter().any(|&weight| weight > 0.0));
        let below = ball.positions.len();
        let seen = weights(&joined([ball, plate]), &view());
        assert!(seen[..below].iter().all(|&weight| weight == 0.0));
    }

    #[test]
    fn unseen_vertices_take_the_colors_of_their_neighbours() {
        let halves = Ball { paint: |d| if d.x < 0.0 { RED } else { BLUE }, ..UNIT };
        let aside = Ball { centre: DVec3::Z * 9.0, ..UNIT };
        let surface = joined([halves.mesh(0.1), aside.mesh(0.3)]);
        let camera = camera(&[&halves], DVec3::Z * 5.0, DVec3::ZERO, [300; 2], BLACK);
        let seen = weights(&surface, &camera);
        let colors = finished_colors(&surface, &[camera]).unwrap();
        let split = halves.mesh(0.1).positions.len();
        for (p, color) in surface.positions.iter().zip(&colors).take(split).filter(|(p, _)| p.x.abs() > 0.5) {
            let expected = if p.x < 0.0 { Vec3::X } else { Vec3::Z };
            assert!((*color - expected).length() < 0.1, "{p} is {color}");
        }
        let overall = mean_of(colors.iter().zip(&seen).filter(|(_, w)| **w > 0.0).map(|(c, _)| *c)).unwrap();
        assert!((overall - Vec3::new(0.5, 0.0, 0.5)).length() < 0.05, "{overall}");
        assert!(colors[split..].iter().all(|color| *color == overall), "the ball behind the camera");
    }

    #[test]
    fn masked_pixels_are_not_seen() {
        let masked = Ball { paint: |d| if d.x < 0.0 { [255, 0, 0, 0] } else { BLUE }, ..UNIT };
        let surface = masked.mesh(0.1);
        let camera = camera(&[&masked], DVec3::Z * 5.0, DVec3::ZERO, [300; 2], [255, 0, 0, 0]);
        for (p, weight) in surface.positions.iter().zip(weights(&surface, &camera)) {
            assert!(p.x > -0.02 || weight == 0.0, "{p}");
        }
        assert!(
            finished_colors(&surface, &[camera])
                .unwrap()
                .iter()
                .all(|color| (*color - Vec3::Z).length() < 1e-6)
        );
    }

    #[test]
    fn unseen_surfaces_have_no_colors() {
        let ball = UNIT.mesh(0.5);
        let [front, ..] = &six_sides(|_| [20, 20])[..] else { panic!() };
        let away = camera(&[&UNIT], DVec3::X * 4.0, DVec3::X * 9.0, [20, 20], TEAL);
        let blank = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 9.0];
        let blank = Camera::new(blank, 20, 20, None).unwrap();
        assert_eq!(finished_colors(&ball, &[]), None);
        assert_eq!(finished_colors(&ball, &[blank, away]), None);
        assert_eq!(finished_colors(&TriangleMesh::default(), std::slice::from_ref(front)), None);
    }

    #[test]
    fn the_same_every_time() {
        let ball = UNIT.mesh(0.1);
        let cameras = six_sides(|_| [90, 90]);
        let mut coloring = Coloring::new(ball.positions.len());
        cameras[..2].iter().for_each(|camera| coloring.add(&ball, camera));
        let mut resumed = coloring.clone();
        cameras[2..].iter().for_each(|camera| resumed.add(&ball, camera));
        let found = resumed.finish(&ball);
        assert_eq!(found, finished_colors(&ball, &cameras));
        assert_eq!(found, finished_colors(&ball, &cameras));
    }
}
