//! Queries on a solved implicit surface: values and gradient of the implicit function f, fitness to the points,
//! sampling to a volume, and colouring.

use super::camera::Camera;
use super::fast::FastField;
use super::measure::Fitness;
use super::{ImplicitSurface, Solved, cameras_at, color};
use crate::math::{Bounds, DAffine3, DVec3, PositionIndex, Vec3};
use crate::methods::MethodError;
use crate::pauses::{Pauses, finished};
use crate::volume::{Volume, VolumeError, VolumeInit, Voxels};

impl ImplicitSurface {
    /// Returns the implicit function f minus the iso-value at `points`, which are in world units (those of the input
    /// points): positive inside, 0 on the surface, negative outside.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system is solved.
    pub fn evaluate(&self, points: &[Vec3]) -> Result<Vec<f64>, MethodError> {
        let solved = self.solved("evaluate")?;
        let level = self.iso_value(solved);
        Ok(points.iter().map(|p| solved.field.value(self.map.in_box_exactly(p.as_dvec3())) - level).collect())
    }

    /// Returns the gradient of the implicit function f at `points`, per world unit (the unit of the input points). On
    /// the surface it points inwards.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system is solved.
    pub fn gradient(&self, points: &[Vec3]) -> Result<Vec<DVec3>, MethodError> {
        let solved = self.solved("gradient")?;
        let at = |p: &Vec3| solved.field.value_and_gradient(self.map.in_box_exactly(p.as_dvec3())).1;
        Ok(points.iter().map(|p| at(p) * self.map.scale()).collect())
    }

    fn solved(&self, what: &'static str) -> Result<&Solved, MethodError> {
        let problem = "the system is not solved yet; step until the phase is 'extract'";
        self.solved.as_ref().ok_or_else(|| MethodError::invalid(what, problem))
    }

    /// Returns the centres of the constraints on the surface, outside and inside, in world units; all lists are empty until
    /// the constraints are made in the first steps.
    pub fn constraints(&self) -> [Vec<Vec3>; 3] {
        let all = self.constraints.centres.iter().zip(&self.constraints.values);
        [0.0, -1.0, 1.0].map(|value| {
            let chosen: Vec<Vec3> =
                all.clone().filter(|&(_, &other)| other == value).map(|(&p, _)| p).collect();
            self.map.all_in_world(&chosen)
        })
    }

    /// Returns the input points with the edits applied: without outliers and those removed, with those added; in world
    /// units.
    fn points(&self) -> Vec<Vec3> {
        let removed = self.edits.removed_positions(&self.original, &self.map);
        let far = self.far_outliers.iter().map(|&p| self.map.in_box(p));
        let outliers = self.samples.iter().flat_map(|samples| samples.outliers.iter().copied());
        let outliers = PositionIndex::new(&far.chain(outliers).collect::<Vec<Vec3>>());
        let stays = |p: &Vec3| {
            let p = self.map.in_box(*p);
            removed.find(p).is_none() && outliers.find(p).is_none()
        };
        let left = self.original.iter().copied().filter(stays);
        left.chain(self.edits.added.iter().copied()).collect()
    }

    /// Measures how well the last finished surface fits all points but outliers, including those not sampled as constraints:
    /// their distances from it, and its mean curvature.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if there is no surface yet.
    pub fn fitness(&self) -> Result<Fitness, MethodError> {
        Fitness::of(&self.points(), &self.mesh)
    }

    /// Samples the implicit function f minus the iso-value on a grid of `dims` voxels that covers points and surface,
    /// as input for methods that work on volumes: positive inside, negative outside.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] before the system is solved, and for fewer than 2 voxels along an axis;
    /// [`MethodError::Volume`] if memory cannot be allocated.
    pub fn to_volume(&self, dims: [usize; 3]) -> Result<Volume, MethodError> {
        finished(self.to_volume_in_slices(dims)?)
    }

    /// Begins to sample the implicit function as [`Self::to_volume`] does, in [slices](crate::pauses); the surface is not
    /// needed any more.
    ///
    /// # Errors
    /// As [`Self::to_volume`]: of the arguments at once.
    pub fn to_volume_in_slices(
        &self,
        dims: [usize; 3],
    ) -> Result<impl Future<Output = Result<Volume, MethodError>> + use<>, MethodError> {
        let solved = self.solved("toVolume")?;
        if dims.iter().any(|&n| n < 2) {
            return Err(MethodError::invalid(
                "dims",
                format!("must be at least 2 along each axis, got {dims:?}"),
            ));
        }
        let (origin, spacing) = self.grid(dims);
        let map = DAffine3::from_translation(origin) * DAffine3::from_scale(spacing);
        let (in_box, level) = (self.map, self.iso_value(solved));
        let affine = DAffine3::from_translation(self.origin) * map;
        let corner = move |p: DVec3| in_box.in_box_exactly(map.transform_point3(p));
        let last = DVec3::from_array(dims.map(|n| (n - 1) as f64));
        let mut fast = FastField::new(solved.field.clone(), corner(DVec3::ZERO), corner(last));
        Ok(async move {
            let row = |points: &[DVec3], row: &mut [f64]| {
                let points: Vec<DVec3> = points.iter().map(|&p| corner(p)).collect();
                fast.values(&points, row);
                row.iter_mut().for_each(|value| *value -= level);
            };
            let values = sampled(dims, row).await?;
            let dims = [dims[0], dims[1], dims[2], 1];
            Ok(Volume::new(VolumeInit { affine, ..VolumeInit::new(Voxels::F32(values), dims) })?)
        })
    }

    /// Returns the centre of the first voxel and the voxel size, in world units, of a grid of `dims` voxels around the
    /// points and the surface, for [`Self::to_volume`].
    fn grid(&self, dims: [usize; 3]) -> (DVec3, DVec3) {
        let bounds = Bounds::from_points(&self.points()).union(&Bounds::from_points(&self.mesh.positions));
        let margin = DVec3::splat(GRID_MARGIN * 2.0 / self.map.scale());
        let (low, high) = (bounds.min.as_dvec3() - margin, bounds.max.as_dvec3() + margin);
        (low, (high - low) / DVec3::from_array(dims.map(|n| (n - 1) as f64)))
    }

    /// Colours the finished surface from the images of `cameras`. The colours stay unchanged if no camera sees any of
    /// it.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if there is no surface yet, or no camera has an image.
    pub fn colorize(&mut self, cameras: &[Camera]) -> Result<(), MethodError> {
        let coloring = finished(self.begin_coloring(cameras)?);
        self.take_colors(coloring)
    }

    /// Begins to compute colours for [`Self::take_colors`] as [`Self::colorize`] does, in [slices](crate::pauses).
    ///
    /// # Errors
    /// As [`Self::colorize`].
    pub fn begin_coloring(
        &self,
        cameras: &[Camera],
    ) -> Result<impl Future<Output = VertexColors> + use<>, MethodError> {
        if self.mesh.triangles.is_empty() {
            return Err(MethodError::invalid(
                "colorize",
                "there is no surface yet; step until the run is done",
            ));
        }
        if !cameras.iter().any(Camera::has_image) {
            return Err(MethodError::invalid("cameras", "at least one must have an image"));
        }
        let (mesh, version) = (self.mesh.clone(), self.version);
        let cameras = cameras_at(self.origin, cameras.to_vec());
        Ok(async move { VertexColors { colors: color::colors(&mesh, &cameras).await, version } })
    }

    /// Takes the colours of [`Self::begin_coloring`].
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if the surface has changed meanwhile.
    pub fn take_colors(&mut self, found: VertexColors) -> Result<(), MethodError> {
        if found.version != self.version {
            return Err(MethodError::invalid("colorize", "the surface has changed meanwhile"));
        }
        if let Some(colors) = found.colors {
            self.mesh.colors = Some(colors);
            self.version = self.version.wrapping_add(1);
        }
        Ok(())
    }
}

/// Colours of the vertices of an implicit surface.
pub struct VertexColors {
    /// `None` if no camera sees any vertex.
    colors: Option<Vec<Vec3>>,
    /// The version of the surface.
    version: u32,
}

/// Margin around points and surface in [`ImplicitSurface::to_volume`], as a share of the longest side of the points'
/// bounding box: enough for the surface to close.
const GRID_MARGIN: f64 = 0.1;
/// Number of nodes of a grid that count as a unit of work.
const NODES_PER_UNIT: usize = 16;

/// Returns the values of a function at all nodes of a grid of `dims` nodes, x fastest. `row` writes the values of a row
/// of nodes along x, given their positions in voxels. Fails with [`VolumeError::TooLarge`] if memory cannot be
/// allocated.
async fn sampled(
    dims: [usize; 3],
    mut row: impl FnMut(&[DVec3], &mut [f64]),
) -> Result<Vec<f32>, VolumeError> {
    let bytes = dims.iter().fold(4, |product: u64, &n| product.saturating_mul(n as u64));
    let count = usize::try_from(bytes / 4).unwrap_or(usize::MAX);
    let mut values: Vec<f32> = Vec::new();
    values.try_reserve_exact(count).map_err(|_| VolumeError::TooLarge { bytes })?;
    let pauses = Pauses::default();
    let (mut points, mut line) = (vec![DVec3::ZERO; dims[0]], vec![0.0; dims[0]]);
    for at in 0..dims[1] * dims[2] {
        pauses.after(1 + dims[0] / NODES_PER_UNIT).await;
        let [y, z] = [at % dims[1], at / dims[1]].map(|k| k as f64);
        points.iter_mut().enumerate().for_each(|(x, p)| *p = DVec3::new(x as f64, y, z));
        row(&points, &mut line);
        values.extend(line.iter().map(|&value| value as f32));
    }
    Ok(values)
}
