//! Calibrated cameras that photographed the object whose points are reconstructed: they show which side of the points
//! is outside, and their images colour the surface (Dinh, Turk & Slabaugh, sections VI-A and VII-C).

use crate::math::{DAffine3, DMat3, DVec3, Vec3};
use crate::methods::MethodError;
use crate::methods::saved::Hash;

/// Largest accepted width and height of a camera's image, in pixels: more than any photograph has, and the image still
/// fits in memory.
const MAX_PIXELS: u32 = 16384;

/// Smallest accepted volume that the rows of the left 3×3 block of a projection matrix span, each scaled to length 1;
/// with less, the camera has no centre and is rejected.
///
/// Rows of a parallel projection span 1e-16 or so by rounding; with a focal length of one pixel in an image of 16384 it
/// is still 1e-8.
const MIN_SPAN: f64 = 1e-12;

/// A calibrated perspective camera, with its image if there is one. Cameras show which side of the input points is
/// outside, and their images colour the reconstructed surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Maps a world point p to (x·depth, y·depth, depth), where (x, y) is the position of p in the image, in pixels.
    to_view: DAffine3,
    /// Maps (x·depth, y·depth, depth) to the world point that is projected to (x, y), and the origin to the camera's
    /// centre: the inverse of `to_view`.
    from_view: DAffine3,
    width: u32,
    height: u32,
    image: Option<Vec<u8>>,
}

/// The projection of a world point into the image of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Horizontal position in the image, in pixels to the right of the centre of the upper left pixel.
    pub x: f64,
    /// Vertical position in the image, in pixels down from the centre of the upper left pixel.
    pub y: f64,
    /// Distance of the world point from the camera along the camera's axis, in world units; positive.
    pub depth: f64,
}

impl Camera {
    /// Creates a camera that projects a world point p to the pixel (x, y) with (x·s, y·s, s) = P (p, 1), where
    /// `projection` is the 3×4 matrix P row by row.
    ///
    /// The convention is that of OpenCV: x to the right, y down, the centre of the first pixel at (0, 0), that of the
    /// last at (width − 1, height − 1). P may be scaled by any factor, also a negative one: points in front of the
    /// camera are those whose s has the sign of the determinant of the left 3×3 block; that is, the axes right, down
    /// and ahead are taken as right-handed.
    ///
    /// `image` holds red, green, blue and alpha of each pixel, row by row from the top. Pixels with an alpha of 0 are
    /// ignored, which masks the background of an object.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] for entries that are not finite, a projection that has no centre, a side of 0
    /// or more than 16384 pixels, or an image of another length than 4·width·height.
    pub fn new(
        projection: [f64; 12],
        width: u32,
        height: u32,
        image: Option<Vec<u8>>,
    ) -> Result<Self, MethodError> {
        let length = image.as_ref().map(Vec::len);
        if let Some(problem) = problem(&projection, width, height, length) {
            return Err(MethodError::invalid("cameras", problem));
        }
        let to_view = normalized_projection(projection).ok_or_else(|| {
            let problem = "the left 3×3 block of the projection is singular; it must be that of a perspective camera, \
                           which has a centre";
            MethodError::invalid("cameras", problem)
        })?;
        Ok(Self { to_view, from_view: to_view.inverse(), width, height, image })
    }

    /// Adds the projection and the image of the camera to `hash`, the fingerprint of the input by which a saved state
    /// is checked when it is restored.
    pub fn hash_into(&self, hash: &mut Hash) {
        self.to_view.to_cols_array().into_iter().for_each(|x| hash.mix(x.to_bits()));
        [self.width, self.height].into_iter().for_each(|n| hash.mix(u64::from(n)));
        let (words, _) = self.image.as_deref().unwrap_or_default().as_chunks::<4>();
        hash.mix(words.len() as u64);
        words.iter().for_each(|&pixel| hash.mix(u32::from_le_bytes(pixel).into()));
    }

    /// Returns the camera for a world transformed by `map`, which must be invertible: it projects `map`(p) to the pixel
    /// to which this camera projects p. Moves cameras into the normalised box of the points.
    #[must_use]
    pub fn transformed(self, map: &DAffine3) -> Self {
        let to_view = scaled_to_depth(self.to_view * map.inverse());
        Self { to_view, from_view: to_view.inverse(), ..self }
    }

    /// Returns the centre of the camera, in world space.
    pub fn centre(&self) -> DVec3 {
        self.from_view.translation
    }

    /// Returns the width and the height of the image, in pixels, also for a camera without an image.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Returns whether the camera has an image.
    pub fn has_image(&self) -> bool {
        self.image.is_some()
    }

    /// Projects a world point `p` into the image plane, also beyond the border of the image; `None` if `p` is behind
    /// the camera or in the plane through its centre.
    pub fn project(&self, p: DVec3) -> Option<Projected> {
        let view = self.view(p);
        let (x, y, depth) = (view.x / view.z, view.y / view.z, view.z);
        (depth > 0.0 && x.is_finite() && y.is_finite()).then_some(Projected { x, y, depth })
    }

    /// Returns whether the position (x, y), in pixels, is in the image, whose pixels are squares around their centres.
    pub fn covers(&self, x: f64, y: f64) -> bool {
        let within = |at: f64, side: u32| at >= -0.5 && at <= f64::from(side) - 0.5;
        within(x, self.width) && within(y, self.height)
    }

    /// Returns red, green and blue of the image at the position (x, y), in pixels, in 0..1, and alpha, above 0 and at
    /// most 1. `None` if alpha is 0, outside the image, and without an image.
    ///
    /// Bilinear between the centres of pixels; colours are weighted by alpha, so that masked pixels do not bleed in.
    pub fn color_at(&self, x: f64, y: f64) -> Option<(Vec3, f32)> {
        let mut mean = ColorMean::default();
        for (pixel, share) in self.bilinear_pixels(x, y)? {
            mean.add(self.pixel(pixel)?, share);
        }
        mean.color()
    }

    /// Returns column and row of the four pixels whose centres surround the position (x, y), in pixels, each with its
    /// bilinear weight, for blending their colours; `None` if (x, y) is outside the image.
    pub(super) fn bilinear_pixels(&self, x: f64, y: f64) -> Option<[([usize; 2], f32); 4]> {
        let [columns, rows] = [linear_weights(x, self.width), linear_weights(y, self.height)];
        let pixel = |i: usize, j: usize| ([columns[i].0, rows[j].0], columns[i].1 * rows[j].1);
        self.covers(x, y).then(|| [pixel(0, 0), pixel(1, 0), pixel(0, 1), pixel(1, 1)])
    }

    /// Returns red, green, blue and alpha, 0..=255, of the pixel in `column` and `row`, which must be in the image;
    /// `None` if the camera has no image.
    pub(super) fn pixel(&self, [column, row]: [usize; 2]) -> Option<[u8; 4]> {
        let image = self.image.as_ref()?;
        image.as_chunks().0.get(row * self.width as usize + column).copied()
    }

    /// Returns (x·depth, y·depth, depth) of a world point `p`, where (x, y) is its position in the image, in pixels;
    /// unlike [`Self::project`], this is defined behind the camera, too.
    pub(super) fn view(&self, p: DVec3) -> DVec3 {
        self.to_view.transform_point3(p)
    }

    /// Returns the two displacements of a world point at depth 1 that move its projection by one pixel to the right and
    /// by one pixel down. Multiplied by a depth, they are the size of a pixel there.
    pub(super) fn pixel_axes(&self) -> [DVec3; 2] {
        [self.from_view.matrix3.x_axis, self.from_view.matrix3.y_axis]
    }
}

/// Accumulates the mean colour of several pixels, each weighted by its alpha times a given share, as in bilinear
/// interpolation, so that masked pixels (alpha 0) do not count.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ColorMean {
    sum: Vec3,
    alpha: f32,
}

impl ColorMean {
    pub(super) fn add(&mut self, pixel: [u8; 4], share: f32) {
        let [r, g, b, a] = pixel.map(|c| f32::from(c) / 255.0);
        self.sum += Vec3::new(r, g, b) * (share * a);
        self.alpha += share * a;
    }

    /// Returns the mean colour of the pixels, red, green and blue in 0..1, and the sum of their weights (alpha times
    /// share), above 0; `None` if that sum is 0, as there is no colour then.
    pub(super) fn color(self) -> Option<(Vec3, f32)> {
        (self.alpha > 0.0).then(|| (self.sum / self.alpha, self.alpha))
    }
}

/// Checks the arguments of [`Camera::new`]: returns an error message that says what is accepted, or `None` if they are
/// valid. `length` is the size of the image in bytes, if there is an image.
fn problem(projection: &[f64; 12], width: u32, height: u32, length: Option<usize>) -> Option<String> {
    if let Some(i) = projection.iter().position(|entry| !entry.is_finite()) {
        let (row, column, entry) = (i / 4 + 1, i % 4 + 1, projection[i]);
        return Some(format!("row {row}, column {column} of the projection must be finite, got {entry}"));
    }
    if [width, height].iter().any(|side| !(1..=MAX_PIXELS).contains(side)) {
        return Some(format!("must have 1 to {MAX_PIXELS} pixels per side, got {width} × {height}"));
    }
    let expected = 4 * width as usize * height as usize;
    let found = length.filter(|&found| found != expected)?;
    Some(format!("the image must have {expected} bytes, four per pixel of {width} × {height}, got {found}"))
}

/// Converts a 3×4 projection matrix, row by row, to the map from world points to (x·depth, y·depth, depth), where depth
/// is in world units and positive in front of the camera. `None` if the left 3×3 block is singular, so that the camera
/// has no centre.
fn normalized_projection(projection: [f64; 12]) -> Option<DAffine3> {
    // Normalised first, as products of extreme entries overflow or underflow.
    let size = projection.iter().fold(0.0, |size: f64, entry| size.max(entry.abs()));
    let p = projection.map(|entry| entry / size);
    let rows = [0, 4, 8].map(|i| DVec3::new(p[i], p[i + 1], p[i + 2]));
    let [a, b, c] = rows.map(DVec3::normalize_or_zero);
    if a.dot(b.cross(c)).abs() < MIN_SPAN {
        return None;
    }
    let matrix = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
    let ahead = matrix.determinant().signum();
    let offset = DVec3::new(p[3], p[7], p[11]);
    let to_view = scaled_to_depth(DAffine3 { matrix3: matrix * ahead, translation: offset * ahead });
    to_view.inverse().is_finite().then_some(to_view)
}

/// Returns the projection `to_view` scaled by the positive factor that makes its last row a unit vector, so that depths
/// are in world units (Hartley & Zisserman, *Multiple view geometry*, section 6.2.3).
fn scaled_to_depth(to_view: DAffine3) -> DAffine3 {
    let factor = to_view.matrix3.row(2).length().recip();
    DAffine3 { matrix3: to_view.matrix3 * factor, translation: to_view.translation * factor }
}

/// Returns the indices of the two pixels whose centres surround the position `at`, along an axis of an image with
/// `side` pixels, each with its weight for linear interpolation; beyond the outermost centres, `at` is clamped.
fn linear_weights(at: f64, side: u32) -> [(usize, f32); 2] {
    let at = at.clamp(0.0, f64::from(side - 1));
    let low = at as usize;
    let share = (at - at.floor()) as f32;
    [(low, 1.0 - share), ((low + 1).min(side as usize - 1), share)]
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Projection matrix of a test camera at (1, 2, −5) that looks along z, with right along x and down along y: focal
    /// length 100, principal point (40, 30).
    const AHEAD: [f64; 12] = [100.0, 0.0, 40.0, 100.0, 0.0, 100.0, 30.0, -50.0, 0.0, 0.0, 1.0, 5.0];

    fn camera(projection: [f64; 12]) -> Camera {
        Camera::new(projection, 81, 61, None).unwrap()
    }

    fn problem(projection: [f64; 12], width: u32, height: u32, image: Option<Vec<u8>>) -> String {
        match Camera::new(projection, width, height, image).unwrap_err() {
            MethodError::InvalidArgument { parameter: "cameras", problem } => problem,
            other => panic!("{other}"),
        }
    }

    fn near(found: Option<Projected>, [x, y, depth]: [f64; 3]) {
        let found = found.unwrap();
        let off = (DVec3::new(found.x, found.y, found.depth) - DVec3::new(x, y, depth)).length();
        assert!(off < 1e-9, "{found:?} instead of {x}, {y}, {depth}");
    }

    #[test]
    fn a_factor_changes_nothing() {
        for factor in [1.0, -1.0, 1e-3, -250.0, 1e-200, -1e200] {
            let camera = camera(AHEAD.map(|entry| entry * factor));
            assert!((camera.centre() - DVec3::new(1.0, 2.0, -5.0)).length() < 1e-12);
            near(camera.project(DVec3::new(1.0, 2.0, 0.0)), [40.0, 30.0, 5.0]);
            near(camera.project(DVec3::new(1.5, 1.9, 5.0)), [45.0, 29.0, 10.0]);
            assert_eq!(camera.project(DVec3::new(1.0, 2.0, -6.0)), None, "behind");
            assert_eq!(camera.project(DVec3::new(3.0, 2.0, -5.0)), None, "beside");
        }
    }

    #[test]
    fn points_out_of_the_picture() {
        let camera = camera(AHEAD);
        let far = camera.project(DVec3::new(-4.0, 2.0, 0.0)).unwrap();
        assert!((far.x + 60.0).abs() < 1e-9 && !camera.covers(far.x, far.y));
        for (x, y, inside) in [(-0.5, 0.0, true), (-0.6, 0.0, false), (80.5, 60.5, true), (0.0, 60.6, false)]
        {
            assert_eq!(camera.covers(x, y), inside, "{x}, {y}");
        }
        assert!(!camera.covers(f64::NAN, 0.0));
    }

    #[test]
    fn moved_sees_the_same() {
        let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.0);
        let scaled = DAffine3::from_mat3_translation(turn * 0.01, DVec3::new(7.0, 8.0, 9.0));
        let mirrored = DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
        for (map, size) in [(scaled, 0.01), (mirrored, 2.0)] {
            let (before, after) = (camera(AHEAD), camera(AHEAD).transformed(&map));
            assert!((map.transform_point3(before.centre()) - after.centre()).length() < 1e-9);
            for p in [DVec3::new(1.2, 2.3, 0.4), DVec3::new(0.0, 3.0, 4.0)] {
                let Projected { x, y, depth } = before.project(p).unwrap();
                near(after.project(map.transform_point3(p)), [x, y, depth * size]);
            }
            assert_eq!(after.project(map.transform_point3(DVec3::new(1.0, 2.0, -6.0))), None);
        }
    }

    #[test]
    fn colors_between_pixels() {
        let image = vec![255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 0, 255, 255, 255, 51];
        let camera = Camera::new(AHEAD, 2, 2, Some(image)).unwrap();
        let (red, green, white) = (Vec3::X, Vec3::Y, Vec3::ONE);
        for (x, y, expected) in [
            (0.0, 0.0, Some((red, 1.0))),
            (-0.5, -0.5, Some((red, 1.0))),
            (0.75, 0.0, Some((red * 0.25 + green * 0.75, 1.0))),
            (1.5, 1.5, Some((white, 0.2))),
            (0.0, 0.5, Some((red, 0.5))),
            (1.0, 0.5, Some(((green + white * 0.2) / 1.2, 0.6))),
            (0.0, 1.0, None),
            (1.6, 0.0, None),
        ] {
            let found = camera.color_at(x, y);
            let close = match (found, expected) {
                (Some((color, alpha)), Some((c, a))) => {
                    (color - c).length() < 1e-6 && f32::abs(alpha - a) < 1e-6
                }
                (found, expected) => found == expected,
            };
            assert!(close, "{x}, {y}: {found:?}");
        }
        assert_eq!(self::camera(AHEAD).color_at(0.0, 0.0), None, "no picture");
    }

    #[test]
    fn invalid_cameras() {
        let mut missing = AHEAD;
        missing[6] = f64::NAN;
        assert!(
            problem(missing, 9, 9, None)
                .starts_with("row 2, column 3 of the projection must be finite, got NaN")
        );
        let parallel = [100.0, 0.0, 0.0, 40.0, 0.0, 100.0, 0.0, 30.0, 0.0, 0.0, 0.0, 1.0];
        let mut shifted = parallel;
        // A third of each of the other rows: rounding leaves a small determinant.
        (0..4).for_each(|i| shifted[8 + i] += (parallel[i] + parallel[4 + i]) / 3.0);
        for flat in [parallel, shifted, [0.0; 12], [1.0; 12]] {
            assert!(problem(flat, 9, 9, None).contains("perspective camera"));
        }
        for [width, height] in [[0, 9], [9, 0], [16385, 9]] {
            assert!(problem(AHEAD, width, height, None).contains("1 to 16384"));
        }
        let message = problem(AHEAD, 4, 3, Some(vec![0; 47]));
        assert!(
            message.starts_with("the image must have 48 bytes, four per pixel of 4 × 3, got 47"),
            "{message}"
        );
    }
}
