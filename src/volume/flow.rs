//! Symmetric optical flow between two images, for slice interpolation: the displacement that warps both to their
//! midpoint.
//!
//! Local least squares (Lucas and Kanade), coarse to fine. The flow u is defined on the midpoint image, where the
//! intensities of both images agree: a(x − u/2) = b(x + u/2).

use super::error::{VolumeError, reserve};
use super::sampling::locate;
use crate::pauses::Pauses;

/// Radius of the least-squares window of the optical flow, in pixels: one flow vector explains all differences within
/// (2 `RADIUS` + 1)² pixels.
const RADIUS: usize = 5;

/// Number of image rows whose running sums are computed together, which hides the latency of dependent additions.
const ROWS_AT_ONCE: usize = 4;

/// Number of least-squares iterations of the optical flow on each level of the image pyramid; see [`FINEST_ITERATIONS`]
/// for the finest.
const ITERATIONS: usize = 4;

/// Number of least-squares iterations of the optical flow on the finest level of the image pyramid if there are coarser
/// ones: they take most of the time and change least.
const FINEST_ITERATIONS: usize = 2;

/// Largest change of a flow vector per least-squares iteration, in pixels of the pyramid level: image gradients say
/// nothing about intensities further away.
const MAX_STEP: f32 = 1.0;

/// Smallest width and height of a coarser level of the optical flow's image pyramid, in pixels: images are halved only
/// while both are at least twice this.
const MIN_IMAGE_SIZE: usize = 24;

/// Largest number of levels of the optical flow's image pyramid: with three, an iteration on the coarsest moves by up
/// to 4 pixels of the finest.
const MAX_LEVELS: usize = 3;

/// Regularisation added to the diagonal of the optical flow's normal equations, relative to the mean squared gradient
/// of the image: the flow is 0 in regions without contrast.
const REGULARISATION: f32 = 0.2;

/// A 2D image, such as a slice of a volume, stored row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Image {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

/// Optical flow along x and y for each pixel of the midpoint image: the displacement from the first image to the
/// second, in pixels.
pub(super) struct Flow {
    pub x: Image,
    pub y: Image,
}

impl Image {
    /// Returns an image with the same value at every pixel.
    pub fn flat(width: usize, height: usize, value: f32) -> Result<Self, VolumeError> {
        let mut values = reserve(width * height)?;
        values.resize(width * height, value);
        Ok(Self { width, height, values })
    }

    fn rows(&self) -> std::slice::ChunksExact<'_, f32> {
        self.values.chunks_exact(self.width)
    }

    /// Returns the bilinearly interpolated value at (x, y) in pixels; beyond the image its border is replicated.
    #[inline]
    fn at(&self, x: f32, y: f32) -> f32 {
        let (x0, x1, fx) = between(x, self.width);
        let (y0, y1, fy) = between(y, self.height);
        let (above, below) = (y0 * self.width, y1 * self.width);
        let along = |row: usize| {
            let (left, right) = (self.values[row + x0], self.values[row + x1]);
            left + (right - left) * fx
        };
        let (top, bottom) = (along(above), along(below));
        top + (bottom - top) * fy
    }

    /// Warps the image: each pixel is sampled at its position displaced by `share` times the flow.
    pub fn warped(&self, flow: &Flow, share: f32) -> Result<Self, VolumeError> {
        let mut values = reserve(self.values.len())?;
        for (y, (us, vs)) in flow.x.rows().zip(flow.y.rows()).enumerate() {
            let displacements = us.iter().zip(vs).enumerate();
            values
                .extend(displacements.map(|(x, (u, v))| self.at(x as f32 + share * u, y as f32 + share * v)));
        }
        Ok(Self { values, ..*self })
    }

    /// Returns the image at half the width and height: means of 2 × 2 pixels; an odd last row or column is dropped.
    fn halved(&self) -> Result<Self, VolumeError> {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut values = reserve(width * height)?;
        for y in 0..height {
            let rows = [2 * y, 2 * y + 1].map(|y| &self.values[y * self.width..][..self.width]);
            let sums = rows[0].chunks_exact(2).zip(rows[1].chunks_exact(2));
            values.extend(sums.map(|(a, b)| 0.25 * (a[0] + a[1] + b[0] + b[1])));
        }
        Ok(Self { width, height, values })
    }

    /// Resamples a flow component of a coarser level to `width` × `height`, about twice the size, and doubles its
    /// values, since the pixels of the coarser level are twice as long.
    fn doubled(&self, width: usize, height: usize) -> Result<Self, VolumeError> {
        let mut values = reserve(width * height)?;
        for y in 0..height {
            values.extend((0..width).map(|x| 2.0 * self.at((x as f32 - 0.5) * 0.5, (y as f32 - 0.5) * 0.5)));
        }
        Ok(Self { width, height, values })
    }

    /// Returns, for each pixel, the mean over the least-squares window around it; smooths the flow.
    fn window_means(&self) -> Result<Self, VolumeError> {
        let mut means = self.window_sums()?;
        let count = |at: usize, n: usize| (at.min(RADIUS) + (n - 1 - at).min(RADIUS) + 1) as f32;
        let along: Vec<f32> = (0..self.width).map(|x| count(x, self.width)).collect();
        for (y, row) in means.values.chunks_exact_mut(self.width).enumerate() {
            let down = count(y, self.height);
            row.iter_mut().zip(&along).for_each(|(mean, along)| *mean /= along * down);
        }
        Ok(means)
    }

    /// Returns, for each pixel, the sum over the window of (2 `RADIUS` + 1)² pixels around it, clipped at the border.
    pub fn window_sums(&self) -> Result<Self, VolumeError> {
        let (width, height) = (self.width, self.height);
        let mut along = Self::flat(width, height, 0.0)?;
        let whole = height / ROWS_AT_ONCE * ROWS_AT_ONCE * width;
        let ((rows, last), (to, last_to)) = (self.values.split_at(whole), along.values.split_at_mut(whole));
        for (rows, to) in
            rows.chunks_exact(ROWS_AT_ONCE * width).zip(to.chunks_exact_mut(ROWS_AT_ONCE * width))
        {
            running_sums::<ROWS_AT_ONCE>(rows, to);
        }
        for (row, to) in last.chunks_exact(width).zip(last_to.chunks_exact_mut(width)) {
            running_sums::<1>(row, to);
        }
        // Sums along columns, a whole row at a time.
        let mut out = Self::flat(width, height, 0.0)?;
        let mut sums = vec![0.0f32; width];
        let row = |y: usize| &along.values[y * width..][..width];
        for y in 0..(RADIUS).min(height) {
            sums.iter_mut().zip(row(y)).for_each(|(sum, v)| *sum += v);
        }
        for y in 0..height {
            if y + RADIUS < height {
                sums.iter_mut().zip(row(y + RADIUS)).for_each(|(sum, v)| *sum += v);
            }
            if y > RADIUS {
                sums.iter_mut().zip(row(y - RADIUS - 1)).for_each(|(sum, v)| *sum -= v);
            }
            out.values[y * width..][..width].copy_from_slice(&sums);
        }
        Ok(out)
    }
}

/// Computes, for each pixel of `R` rows, the sum over the 2 `RADIUS` + 1 pixels around it in its row. Each addition
/// depends on the previous one in the same row, so several rows are processed at once.
fn running_sums<const R: usize>(rows: &[f32], out: &mut [f32]) {
    let width = rows.len() / R;
    let mut sums: [f32; R] = std::array::from_fn(|r| rows[r * width..][..RADIUS.min(width)].iter().sum());
    for x in 0..width {
        for (r, sum) in sums.iter_mut().enumerate() {
            let row = &rows[r * width..][..width];
            *sum += row.get(x + RADIUS).copied().unwrap_or(0.0);
            if x > RADIUS {
                *sum -= row[x - RADIUS - 1];
            }
            out[r * width + x] = *sum;
        }
    }
}

/// Computes the gradient along x of the mean of two images, from a row of their sum: a quarter of the difference
/// between the two neighbours of each pixel, the border replicated.
fn row_gradient(row: &[f32], out: &mut [f32]) {
    let last = row.len() - 1;
    for (slope, pair) in out[1..].iter_mut().zip(row.windows(3)) {
        *slope = 0.25 * (pair[2] - pair[0]);
    }
    out[0] = 0.25 * (row[last.min(1)] - row[0]);
    out[last] = 0.25 * (row[last] - row[last.saturating_sub(1)]);
}

/// Returns the indices of the two pixels around coordinate `x` on an axis of `n` pixels, and the fractional position
/// between them; `x` is clamped to the image.
#[inline]
fn between(x: f32, n: usize) -> (usize, usize, f32) {
    let (index, share) = locate(x, n);
    (index, if index + 1 < n { index + 1 } else { index }, share)
}

/// Returns the symmetric optical flow between two images of one size; used for interpolated slices. Pauses between
/// passes over the images.
///
/// # Errors
/// [`VolumeError::TooLarge`].
pub(super) async fn symmetric_flow(a: &Image, b: &Image, pauses: &Pauses) -> Result<Flow, VolumeError> {
    let mut levels = vec![(a.clone(), b.clone())];
    while let Some((a, b)) = levels.last()
        && levels.len() < MAX_LEVELS
        && a.width.min(a.height) >= 2 * MIN_IMAGE_SIZE
    {
        levels.push((a.halved()?, b.halved()?));
    }
    let (coarsest, _) = &levels[levels.len() - 1];
    let still = Image::flat(coarsest.width, coarsest.height, 0.0)?;
    let mut flow = Flow { x: still.clone(), y: still };
    for (level, (a, b)) in levels.iter().enumerate().rev() {
        if flow.x.width != a.width || flow.x.height != a.height {
            flow = Flow { x: flow.x.doubled(a.width, a.height)?, y: flow.y.doubled(a.width, a.height)? };
        }
        for _ in 0..if level == 0 && levels.len() > 1 { FINEST_ITERATIONS } else { ITERATIONS } {
            pauses.now().await;
            iterate(a, b, &mut flow, pauses).await?;
        }
    }
    Ok(flow)
}

/// Improves the flow between `a` and `b` by one least-squares iteration and smooths it by window means.
async fn iterate(a: &Image, b: &Image, flow: &mut Flow, pauses: &Pauses) -> Result<(), VolumeError> {
    let (before, after) = (a.warped(flow, -0.5)?, b.warped(flow, 0.5)?);
    pauses.now().await;
    let equations = NormalEquations::of(&before, &after, pauses).await?;
    for i in 0..before.values.len() {
        let (x, y) = equations.step(i);
        flow.x.values[i] += x;
        flow.y.values[i] += y;
    }
    pauses.now().await;
    // Without smoothing, the flow follows the noise: interpolated slices of a heart were then no better than means.
    flow.x = flow.x.window_means()?;
    pauses.now().await;
    flow.y = flow.y.window_means()?;
    Ok(())
}

/// Normal equations of the optical flow at each pixel, summed over its window: products of image gradients (`xx`, `xy`,
/// `yy`), and of gradients with differences of the two images (`xd`, `yd`).
struct NormalEquations {
    xx: Image,
    xy: Image,
    yy: Image,
    xd: Image,
    yd: Image,
    regularisation: f32,
}

impl NormalEquations {
    async fn of(before: &Image, after: &Image, pauses: &Pauses) -> Result<Self, VolumeError> {
        let (width, height) = (before.width, before.height);
        let empty = || Image::flat(width, height, 0.0);
        let [mut xx, mut xy, mut yy, mut xd, mut yd] = [empty()?, empty()?, empty()?, empty()?, empty()?];
        let mut both = reserve(before.values.len())?;
        both.extend(before.values.iter().zip(&after.values).map(|(a, b)| a + b));
        let row = |y: usize| &both[y * width..][..width];
        let mut slopes = vec![0.0; width];
        for y in 0..height {
            // Gradient of the mean of both images, by central differences over two pixels.
            let (above, below) = (row(y.saturating_sub(1)), row((y + 1).min(height - 1)));
            row_gradient(row(y), &mut slopes);
            let [before, after] = [before, after].map(|image| &image.values[y * width..][..width]);
            let [xx, xy, yy, xd, yd] = [&mut xx, &mut xy, &mut yy, &mut xd, &mut yd]
                .map(|image| &mut image.values[y * width..][..width]);
            for x in 0..width {
                let (gx, gy) = (slopes[x], 0.25 * (below[x] - above[x]));
                let difference = after[x] - before[x];
                xx[x] = gx * gx;
                xy[x] = gx * gy;
                yy[x] = gy * gy;
                xd[x] = gx * difference;
                yd[x] = gy * difference;
            }
        }
        pauses.now().await;
        let squares: f32 = xx.values.iter().zip(&yy.values).map(|(a, b)| a + b).sum();
        let window = ((2 * RADIUS + 1) * (2 * RADIUS + 1)) as f32;
        let regularisation = REGULARISATION * window * squares / (width * height) as f32;
        for products in [&mut xx, &mut xy, &mut yy, &mut xd, &mut yd] {
            *products = products.window_sums()?;
            pauses.now().await;
        }
        Ok(Self { xx, xy, yy, xd, yd, regularisation })
    }

    /// Returns the change of the flow along x and y at pixel number `i`: the solution of its normal equations, limited
    /// to a length of [`MAX_STEP`].
    #[inline]
    fn step(&self, i: usize) -> (f32, f32) {
        let (xx, yy) = (self.xx.values[i] + self.regularisation, self.yy.values[i] + self.regularisation);
        let xy = self.xy.values[i];
        let determinant = xx * yy - xy * xy;
        if determinant <= 0.0 {
            return (0.0, 0.0);
        }
        let (xd, yd) = (self.xd.values[i], self.yd.values[i]);
        let x = (xy * yd - yy * xd) / determinant;
        let y = (xy * xd - xx * yd) / determinant;
        let length = (x * x + y * y).sqrt();
        let scale = if length > MAX_STEP { MAX_STEP / length } else { 1.0 };
        (x * scale, y * scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn flow_of(a: &Image, b: &Image) -> Flow {
        finished(symmetric_flow(a, b, &Pauses::default())).unwrap()
    }

    /// Returns an image of a disc with a smooth edge.
    fn disc(center: [f32; 2], radius: f32) -> Image {
        let (width, height) = (64, 48);
        let value = |i: usize| {
            let (x, y) = ((i % width) as f32 - center[0], (i / width) as f32 - center[1]);
            100.0 / (1.0 + libm::expf(libm::hypotf(x, y) - radius))
        };
        Image { width, height, values: (0..width * height).map(value).collect() }
    }

    #[test]
    fn what_has_moved_is_followed_halfway_from_both_sides() {
        let (a, b) = (disc([28.0, 24.0], 9.0), disc([34.0, 21.0], 9.0));
        let flow = flow_of(&a, &b);
        // Pixels on the rim of the midpoint disc.
        for (x, y) in [(31 + 9, 22), (31 - 9, 23), (31, 22 + 9), (31, 23 - 9)] {
            let (u, v) = (flow.x.values[y * 64 + x], flow.y.values[y * 64 + x]);
            assert!((u - 6.0).abs() < 0.6 && (v + 3.0).abs() < 0.6, "{u} {v}");
        }
        let middle = disc([31.0, 22.5], 9.0);
        let met = a.warped(&flow, -0.5).unwrap();
        let worst = met.values.iter().zip(&middle.values).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 12.0, "{worst}");
    }

    #[test]
    fn equal_or_constant_images_have_no_flow() {
        for image in [disc([30.0, 20.0], 8.0), Image::flat(64, 48, 3.0).unwrap()] {
            let flow = flow_of(&image, &image);
            assert!(flow.x.values.iter().chain(&flow.y.values).all(|u| *u == 0.0));
        }
    }

    #[test]
    fn images_of_one_pixel_have_a_flow() {
        for (width, height) in [(1, 1), (1, 9), (200, 1)] {
            let image = Image::flat(width, height, 1.0).unwrap();
            let other = Image::flat(width, height, 2.0).unwrap();
            assert_eq!(flow_of(&image, &other).x.values, vec![0.0; width * height]);
        }
    }

    #[test]
    fn sums_over_windows_are_those_of_their_pixels() {
        let mut random = crate::math::Random::new(5);
        let values = (0..13 * 17).map(|_| random.unit() as f32).collect();
        let image = Image { width: 13, height: 17, values };
        let sums = image.window_sums().unwrap();
        for (x, y) in [(0, 0), (6, 8), (12, 16), (3, 15)] {
            let near = |a: usize, b: usize| a.abs_diff(b) <= RADIUS;
            let cells = (0..13 * 17).filter(|i| near(i % 13, x) && near(i / 13, y));
            let sum: f32 = cells.map(|i| image.values[i]).sum();
            assert!((sums.values[y * 13 + x] - sum).abs() < 1e-3);
        }
    }
}
