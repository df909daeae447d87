//! What can be asked of a surface, and of the function behind it.

use super::camera::Camera;
use super::fast::FastField;
use super::measure::Fitness;
use super::{ImplicitSurface, Solved, color};
use crate::math::{Bounds, DAffine3, DVec3, Vec3};
use crate::methods::MethodError;
use crate::volume::{Space, Volume, VolumeError, VolumeInit, Voxels};

impl ImplicitSurface {
    /// f at points in their own units, less the level: above 0 inside, 0 on the surface, below outside.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system was solved.
    pub fn evaluate(&self, points: &[Vec3]) -> Result<Vec<f64>, MethodError> {
        let solved = self.solved("evaluate")?;
        let level = self.level_of(solved);
        Ok(points.iter().map(|p| solved.field.value(self.map.in_box_exactly(p.as_dvec3())) - level).collect())
    }

    /// ∇f at points in their own units, per unit; it points inwards.
    ///
    /// # Errors
    /// As [`Self::evaluate`].
    pub fn gradient(&self, points: &[Vec3]) -> Result<Vec<DVec3>, MethodError> {
        let solved = self.solved("gradient")?;
        let at = |p: &Vec3| solved.field.value_and_gradient(self.map.in_box_exactly(p.as_dvec3())).1;
        Ok(points.iter().map(|p| at(p) * self.map.scale()).collect())
    }

    fn solved(&self, what: &'static str) -> Result<&Solved, MethodError> {
        let problem = "the system is not solved yet: step until the phase is 'extract'";
        self.solved.as_ref().ok_or_else(|| MethodError::invalid(what, problem))
    }

    /// The points that take part, and those outside, in the points' units; empty before they are chosen.
    pub fn constraints(&self) -> [Vec<Vec3>; 2] {
        let (surface, outside) = self.constraints.centres.split_at(self.constraints.surface);
        [self.in_world(surface), self.in_world(outside)]
    }

    /// All points as given, without those removed and with those added.
    fn points(&self) -> Vec<Vec3> {
        let removed = self.edits.removed_places(&self.original, &self.map);
        let stays = |p: &Vec3| removed.find(self.map.in_box(*p)).is_none();
        let left = self.original.iter().copied().filter(stays);
        left.chain(self.edits.added.iter().copied()).collect()
    }

    /// Distances of all points, also of those that take no part, from the surface, and its mean curvature.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before there is a surface.
    pub fn fitness(&self) -> Result<Fitness, MethodError> {
        Fitness::of(&self.points(), &self.mesh)
    }

    /// f, less the level, on a grid of `dims` voxels around the points, so that other methods can take over: above 0 inside.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system was solved, and for fewer than 2 voxels along an axis;
    /// [`MethodError::Volume`] where memory ends.
    pub fn to_volume(&self, dims: [usize; 3]) -> Result<Volume, MethodError> {
        let solved = self.solved("toVolume")?;
        if dims.iter().any(|&n| n < 2) {
            return Err(MethodError::invalid(
                "dims",
                format!("{dims:?}; at least 2 along each axis are needed"),
            ));
        }
        let (origin, spacing) = self.grid(dims);
        let map = DAffine3::from_translation(origin) * DAffine3::from_scale(spacing);
        let corner = |p: DVec3| self.map.in_box_exactly(map.transform_point3(p));
        let last = DVec3::from_array(dims.map(|n| (n - 1) as f64));
        let mut fast = FastField::new(solved.field.clone(), corner(DVec3::ZERO), corner(last));
        let level = self.level_of(solved);
        let values = sampled(dims, |places, row| {
            let places: Vec<DVec3> = places.iter().map(|&p| corner(p)).collect();
            fast.values(&places, row);
            row.iter_mut().for_each(|value| *value -= level);
        })?;
        Ok(Volume::new(VolumeInit {
            voxels: Voxels::F32(values),
            dims: [dims[0], dims[1], dims[2], 1],
            affine: map,
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: 0.0,
            space: Space::Ras,
        })?)
    }

    /// First voxel and voxel size of a grid around the points and the surface.
    fn grid(&self, dims: [usize; 3]) -> (DVec3, DVec3) {
        let bounds = Bounds::of(&self.points()).joined(&Bounds::of(&self.mesh.positions));
        let margin = DVec3::splat(GRID_MARGIN * 2.0 / self.map.scale());
        let (low, high) = (bounds.min.as_dvec3() - margin, bounds.max.as_dvec3() + margin);
        (low, (high - low) / DVec3::from_array(dims.map(|n| (n - 1) as f64)))
    }

    /// Colours the surface from photographs.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before there is a surface, and where no camera has a picture.
    pub fn colorize(&mut self, cameras: &[Camera]) -> Result<(), MethodError> {
        if self.mesh.triangles.is_empty() {
            return Err(MethodError::invalid("colorize", "there is no surface yet: step to the end first"));
        }
        if !cameras.iter().any(Camera::has_image) {
            return Err(MethodError::invalid("cameras", "none has an image; at least one is needed"));
        }
        if let Some(colors) = color::colors(&self.mesh, cameras) {
            self.mesh.colors = Some(colors);
            self.version = self.version.wrapping_add(1);
        }
        Ok(())
    }
}

/// Room around the points in a volume made of them, of their longest side: enough for the surface to close in.
const GRID_MARGIN: f64 = 0.1;

/// Numbers at all nodes of a grid, x fastest, a row at a time.
fn sampled(dims: [usize; 3], mut row: impl FnMut(&[DVec3], &mut [f64])) -> Result<Vec<f32>, VolumeError> {
    let count = dims.iter().try_fold(1_usize, |product, &n| product.checked_mul(n)).unwrap_or(usize::MAX);
    let mut values: Vec<f32> = Vec::new();
    let bytes = (count as u64).saturating_mul(4);
    values.try_reserve_exact(count).map_err(|_| VolumeError::TooLarge { bytes })?;
    let (mut places, mut line) = (vec![DVec3::ZERO; dims[0]], vec![0.0; dims[0]]);
    for at in 0..dims[1] * dims[2] {
        let [y, z] = [at % dims[1], at / dims[1]].map(|k| k as f64);
        places.iter_mut().enumerate().for_each(|(x, p)| *p = DVec3::new(x as f64, y, z));
        row(&places, &mut line);
        values.extend(line.iter().map(|&value| value as f32));
    }
    Ok(values)
}
