//! Parameters of the tracker, their ranges, defaults and labels.

use super::ImageStatistics;
use crate::methods::params::parameters;
use crate::methods::{MethodError, ParamDefault, ParamScale, Parameters};

parameters! {
    /// Parameters of a [`SurfaceTracker`](super::SurfaceTracker). `threshold`, `radius` and `time_scale` are derived
    /// from the volume if they are 0.
    #[serde(default, deny_unknown_fields)]
    pub struct TrackingParams {
        /// Edge threshold τ: the means of the two clusters of a window must differ by more than this, in units of
        /// intensity, to count as a boundary.
        pub threshold: f64 = 0.0 => {
            name: "threshold",
            label: "Edge threshold",
            help: "Smallest intensity step that counts as a boundary; below 2.5 times the noise, noise is detected too.",
            symbol: "τ",
            default: ParamDefault::FromData,
            range: 1e-50..=1e50,
            scale: ParamScale::Log,
            unit: "intensity",
        },
        /// Half-width k of the windows in which the image is split into bright and dark: a window is (2k + 1) voxels
        /// wide along each axis.
        pub window: u32 = 2 => {
            name: "window",
            label: "Window",
            help: "Half-width of the window that is split into bright and dark voxels; larger windows suppress noise and detail.",
            symbol: "k",
            range: 1.0..=4.0,
            step: 1.0,
            unit: "voxels",
        },
        /// Number of frames to either side that a window, which is split into bright and dark, includes; with 0 each
        /// frame is processed on its own.
        pub window_frames: u32 = 2 => {
            name: "windowFrames",
            label: "Temporal window",
            help: "Number of frames before and after that the window includes; 0 processes each frame on its own.",
            range: 0.0..=4.0,
            step: 1.0,
            unit: "frames",
        },
        /// Radius of the plane fits, in world units: the weight θ(r) = exp(−r²/h²) of a boundary point ends at this
        /// distance, 2h.
        pub radius: f64 = 0.0 => {
            name: "radius",
            label: "Radius",
            help: "Radius of the plane fit to boundary points: a larger one gives a smoother surface.",
            symbol: "2h",
            default: ParamDefault::FromData,
            range: 1e-15..=1e15,
            scale: ParamScale::Log,
            unit: "world",
        },
        /// Time scale c: the distance in space, in world units, that a difference of one frame counts as in plane fits.
        pub time_scale: f64 = 0.0 => {
            name: "timeScale",
            label: "Time scale",
            help: "Distance that one frame counts as: small values smooth over time, large ones fit each frame on its own.",
            symbol: "c",
            default: ParamDefault::FromData,
            range: 1e-15..=1e15,
            scale: ParamScale::Log,
            unit: "world",
        },
        /// Damping β: step number i of the projection of a vertex onto the boundary, from 0 on, is scaled by βⁱ, but by
        /// at least 0.2.
        pub damping: f64 = 0.9 => {
            name: "damping",
            label: "Damping",
            help: "Each projection step is scaled by this factor relative to the one before, so that the projection converges.",
            symbol: "β",
            range: 0.5..=1.0,
            step: 0.01,
        },
        /// c_min: shorter edges of the mesh are collapsed; given as a multiple of the mean edge length in the first
        /// frame.
        pub edge_min: f64 = 0.25 => {
            name: "edgeMin",
            label: "Shortest edge",
            help: "Shorter edges are collapsed; relative to the mean edge of the first frame.",
            symbol: "c_min",
            range: 0.05..=1.0,
            step: 0.05,
        },
        /// c_max: longer edges of the mesh are split; given as a multiple of the mean edge length in the first frame.
        pub edge_max: f64 = 1.5 => {
            name: "edgeMax",
            label: "Longest edge",
            help: "Longer edges are split; relative to the mean edge of the first frame, more than twice the shortest.",
            symbol: "c_max",
            range: 0.5..=10.0,
            step: 0.1,
        },
        /// Whether tracking in a frame starts from the predicted surface; otherwise it starts from the surface of the
        /// frame before.
        pub prediction: bool = true => {
            name: "prediction",
            label: "Prediction",
            help: "Starts each frame from the predicted surface instead of the previous one.",
        },
        /// Whether the last frame is followed by the first, as in a heartbeat.
        pub cyclic: bool = false => {
            name: "cyclic",
            label: "Cyclic",
            help: "The first frame follows the last, as in a heartbeat; at the end the surface is tracked back to it, to measure the closure error.",
        },
    }
}

/// Default edge threshold τ, in standard deviations of the noise: in windows of noise alone the cluster means differ by
/// 1.6 standard deviations, so hardly any such window passes.
const THRESHOLD_IN_NOISE: f64 = 4.0;

/// Smallest default edge threshold τ, as a share of the image's intensity range: images without noise need a threshold
/// as well.
const MIN_THRESHOLD: f64 = 0.05;

/// Default radius of the plane fits, in units of the shortest side of a voxel, about two voxels and a half: a smaller
/// one follows noise, a larger one rounds off details of that thickness.
const RADIUS_IN_PIXELS: f64 = 2.4;

/// Smallest default radius of the plane fits, in units of the longest side of a voxel: with a radius below the slice
/// distance, all points would be of one slice and the plane fitted to them would be the slice itself.
const RADIUS_IN_SLICES: f64 = 1.2;

/// Default time scale c, as a share of the radius of the plane fits: neighbouring frames then have next to no weight,
/// unlike the faces between frames, half a frame away, so fast motion is followed.
const TIME_SCALE_IN_RADIUS: f64 = 0.9;

impl TrackingParams {
    /// Checks all parameters against their ranges, but accepts 0 for `threshold`, `radius` and `time_scale`, which are
    /// then derived from the volume.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the first parameter that is not accepted.
    pub fn validate(&self) -> Result<(), MethodError> {
        self.check_ranges_if(|spec, value| spec.default != ParamDefault::FromData || value != 0.0)?;
        if self.edge_max > 2.0 * self.edge_min {
            return Ok(());
        }
        let (min, max) = (self.edge_min, self.edge_max);
        let problem =
            format!("must be > 2 × edgeMin ({min}), got {max}: halves of split edges would be too short");
        Err(MethodError::invalid("edgeMax", problem))
    }

    /// Returns whether these parameters give the same boundary votes as `others`, so that votes already found are kept.
    pub(super) fn same_boundary(&self, others: &Self) -> bool {
        let key = |p: &Self| (p.threshold.to_bits(), p.window, p.window_frames, p.cyclic);
        key(self) == key(others)
    }

    /// Replaces `threshold`, `radius` and `time_scale`, if they are 0, by values derived from the volume.
    pub(super) fn with_volume(mut self, image: &ImageStatistics) -> Self {
        let ImageStatistics { shortest_side, longest_side, noise, range } = *image;
        let or = |value: f64, usual: f64| if value == 0.0 { usual } else { value };
        self.threshold = or(self.threshold, (THRESHOLD_IN_NOISE * noise).max(MIN_THRESHOLD * range));
        self.radius =
            or(self.radius, (RADIUS_IN_PIXELS * shortest_side).max(RADIUS_IN_SLICES * longest_side));
        self.time_scale = or(self.time_scale, TIME_SCALE_IN_RADIUS * self.radius);
        self
    }
}
