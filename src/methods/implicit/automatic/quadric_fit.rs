//! Quadrics fitted to neighbourhoods of points: noise, positions and normals of the surface that do not follow the noise.
//! Unlike planes, they do not take curvature for noise.

use crate::math::{DMat3, DVec3, Vec3, cholesky, symmetric};
use crate::spatial::PointGrid;

/// Number of coefficients of a quadric height field, a + bu + cv + du² + euv + fv².
const COEFFICIENTS: usize = 6;

/// A quadric height field over the plane of a neighbourhood.
pub struct QuadricFit {
    /// The point of the quadric next to the centre of the neighbourhood, along the normal of the plane.
    pub position: Vec3,
    /// Unit normal there, on either side.
    pub normal: Vec3,
    /// Standard deviation of the points from it.
    pub deviation: f32,
    /// Distance from the centre to the farthest point.
    pub radius: f32,
}

/// Returns a grid for fits to points whose mean distance to the nearest neighbour is `spacing`.
pub fn fitting_grid(points: &[Vec3], spacing: f64) -> PointGrid {
    PointGrid::of(points, CELL * spacing as f32)
}

/// Side of a cell in mean spacings: about as far as the nearest points reach that are fitted.
const CELL: f32 = 3.0;
/// Numbers of nearest points to which quadrics are fitted: with few, they follow noise; with many, they reach other walls.
pub const NEIGHBOURS: [usize; 2] = [24, 12];
/// Deviation of the fit to few points, relative to that to many, below which these are not on one surface.
const OTHER_WALL: f32 = 0.6;

impl QuadricFit {
    /// Fits one to the surface next to a point `p` of a [`fitting_grid`]: to many points, or to few where these fit far better,
    /// as beside a thin wall or an edge.
    pub fn of_wall(grid: &PointGrid, p: Vec3) -> Option<Self> {
        let [many, few] = NEIGHBOURS.map(|count| Self::around(grid, p, count));
        match (many, few) {
            (Some(many), Some(few)) if few.deviation < OTHER_WALL * many.deviation => Some(few),
            (many, _) => many,
        }
    }

    /// Fits one to the `count` points of a [`fitting_grid`] that are nearest to `p`; `None` if these do not determine it.
    pub fn around(grid: &PointGrid, p: Vec3, count: usize) -> Option<Self> {
        let near = grid.nearest(p, count, grid.cell());
        let offsets: Vec<DVec3> =
            near.iter().map(|&(_, i)| (grid.points()[i as usize] - p).as_dvec3()).collect();
        let reach = f64::from(near.last()?.0).sqrt();
        if offsets.len() <= COEFFICIENTS || reach == 0.0 {
            return None;
        }
        let mean = offsets.iter().sum::<DVec3>() / offsets.len() as f64;
        let spread = offsets.iter().fold(DMat3::ZERO, |sum, d| {
            let d = *d - mean;
            sum + symmetric::outer(d)
        });
        let (_, axes) = symmetric::eigen(spread);
        let [normal, u, v] = [axes.x_axis, axes.y_axis, axes.z_axis];
        let rows = offsets.iter().map(|d| {
            let (a, b) = (d.dot(u) / reach, d.dot(v) / reach);
            ([1.0, a, b, a * a, a * b, b * b], d.dot(normal) / reach)
        });
        let rows: Vec<([f64; COEFFICIENTS], f64)> = rows.collect();
        let c = least_squares(&rows)?;
        let residuals = rows.iter().map(|(row, height)| height - dot(row, &c));
        let squares: f64 = residuals.map(|r| r * r).sum();
        Some(Self {
            position: p + (normal * (c[0] * reach)).as_vec3(),
            normal: (normal - u * c[1] - v * c[2]).normalize().as_vec3(),
            deviation: ((squares / (rows.len() - COEFFICIENTS) as f64).sqrt() * reach) as f32,
            radius: reach as f32,
        })
    }
}

fn dot(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Returns the coefficients for which the sum of squared errors is least, from the normal equations; `None` if the rows do
/// not determine them.
fn least_squares(rows: &[([f64; COEFFICIENTS], f64)]) -> Option<[f64; COEFFICIENTS]> {
    let (mut matrix, mut solution) = ([0.0; COEFFICIENTS * COEFFICIENTS], [0.0; COEFFICIENTS]);
    for (row, height) in rows {
        for i in 0..COEFFICIENTS {
            solution[i] += row[i] * height;
            for j in 0..COEFFICIENTS {
                matrix[i * COEFFICIENTS + j] += row[i] * row[j];
            }
        }
    }
    cholesky::factorise(&mut matrix, COEFFICIENTS);
    let mut pivots = matrix.iter().step_by(COEFFICIENTS + 1).map(|root| root * root);
    if !pivots.all(|pivot| pivot > LEAST_PIVOT * rows.len() as f64) {
        return None;
    }
    cholesky::forward(&matrix, &mut solution);
    cholesky::backward(&matrix, &mut solution);
    Some(solution)
}

/// Least pivot, for each point, below which points do not determine a quadric: those on a line, say.
const LEAST_PIVOT: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::implicit::cloud::tests::on_ball;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn curvature_is_not_measured_as_noise() {
        for noise in [0.0, 0.03] {
            let points: Vec<Vec3> =
                on_ball(800).iter().zip(0..).map(|(&p, i)| p * (1.0 + [noise, -noise][i % 2])).collect();
            let grid = fitting_grid(&points, 0.04);
            for &p in points.iter().step_by(50) {
                let fit = QuadricFit::around(&grid, p, 24).unwrap();
                assert!((fit.deviation - noise).abs() < 0.2 * noise + 1e-3, "{noise}: {}", fit.deviation);
                assert!((fit.position.length() - 1.0).abs() < noise + 1e-3, "{noise}: {}", fit.position);
                assert!(
                    fit.normal.dot(p.normalize()).abs() > 1.0 - 4.0 * noise - 1e-3,
                    "{noise}: {}",
                    fit.normal
                );
            }
        }
    }

    #[test]
    fn points_on_a_line_determine_no_quadric() {
        let line: Vec<Vec3> = (0..40).map(|i| Vec3::X * i as f32 * 0.01).collect();
        assert!(QuadricFit::around(&fitting_grid(&line, 0.01), line[20], 24).is_none());
        assert!(QuadricFit::around(&fitting_grid(&line[..5], 0.01), line[2], 24).is_none());
    }
}
