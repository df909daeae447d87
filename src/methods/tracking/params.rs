//! Parameters of the tracker, their ranges, defaults and labels.

use super::ImageStatistics;
use crate::methods::{MethodError, ParamDefault, ParamKind, ParamScale, ParamSpec};
use serde::{Deserialize, Serialize};

/// Parameters of a [`SurfaceTracker`](super::SurfaceTracker). `threshold`, `radius` and `time_scale` are derived from
/// the volume if they are 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", default, deny_unknown_fields)]
pub struct TrackingParams {
    /// Edge threshold τ: the means of the two clusters of a window must differ by more than this, in units of
    /// intensity, to count as a boundary.
    pub threshold: f64,
    /// Half-width k of the windows in which the image is split into bright and dark: a window is (2k + 1) voxels wide
    /// along each axis.
    pub window: u32,
    /// Number of frames to either side that a window, which is split into bright and dark, includes; with 0 each frame
    /// is processed on its own.
    pub window_frames: u32,
    /// Radius of the plane fits, in world units: the weight θ(r) = exp(−r²/h²) of a boundary point ends at this
    /// distance, 2h.
    pub radius: f64,
    /// Time scale c: the distance in space, in world units, that a difference of one frame counts as in plane fits.
    pub time_scale: f64,
    /// Damping β: step number i of the projection of a vertex onto the boundary, from 0 on, is scaled by βⁱ, but by at
    /// least 0.2.
    pub damping: f64,
    /// c_min: shorter edges of the mesh are collapsed; given as a multiple of the mean edge length in the first frame.
    pub edge_min: f64,
    /// c_max: longer edges of the mesh are split; given as a multiple of the mean edge length in the first frame.
    pub edge_max: f64,
    /// Whether tracking in a frame starts from the predicted surface; otherwise it starts from the surface of the frame
    /// before.
    pub prediction: bool,
    /// Whether the last frame is followed by the first, as in a heartbeat.
    pub cyclic: bool,
}

impl Default for TrackingParams {
    fn default() -> Self {
        Self {
            threshold: 0.0,
            window: 2,
            window_frames: 2,
            radius: 0.0,
            time_scale: 0.0,
            damping: 0.9,
            edge_min: 0.25,
            edge_max: 1.5,
            prediction: true,
            cyclic: false,
        }
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
        for (spec, value) in SPECS.iter().zip(self.numbers()) {
            if spec.default != ParamDefault::FromData || value != 0.0 {
                spec.check(value)?;
            }
        }
        if self.edge_max > 2.0 * self.edge_min {
            return Ok(());
        }
        let (min, max) = (self.edge_min, self.edge_max);
        let problem =
            format!("must be > 2 × edgeMin ({min}), got {max}: halves of split edges would be too short");
        Err(MethodError::invalid("edgeMax", problem))
    }

    fn numbers(&self) -> [f64; 8] {
        let (window, frames) = (f64::from(self.window), f64::from(self.window_frames));
        let Self { threshold, radius, time_scale, damping, edge_min, edge_max, .. } = *self;
        [threshold, window, frames, radius, time_scale, damping, edge_min, edge_max]
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

/// Returns the specification of each parameter (range, default, label, help), in the order in which a user interface
/// should show them.
pub fn param_specs() -> Vec<ParamSpec> {
    SPECS.to_vec()
}

const FROM_DATA: ParamSpec = ParamSpec {
    default: ParamDefault::FromData,
    min: Some(1e-9),
    max: Some(1e9),
    scale: Some(ParamScale::Log),
    ..ParamSpec::NUMBER
};

const COUNT: ParamSpec = ParamSpec {
    kind: ParamKind::Integer,
    default: ParamDefault::Number(2.0),
    max: Some(4.0),
    step: Some(1.0),
    ..ParamSpec::NUMBER
};

const SWITCH: ParamSpec = ParamSpec { kind: ParamKind::Boolean, ..ParamSpec::NUMBER };

const SPECS: [ParamSpec; 10] = [
    ParamSpec {
        name: "threshold",
        label: "Edge threshold",
        help: "Smallest intensity step that counts as a boundary; below 2.5 times the noise, noise is detected too.",
        symbol: Some("τ"),
        unit: Some("intensity"),
        ..FROM_DATA
    },
    ParamSpec {
        name: "window",
        label: "Window",
        help: "Half-width of the window that is split into bright and dark voxels; larger windows suppress noise and detail.",
        symbol: Some("k"),
        min: Some(1.0),
        unit: Some("voxels"),
        ..COUNT
    },
    ParamSpec {
        name: "windowFrames",
        label: "Temporal window",
        help: "Number of frames before and after that the window includes; 0 processes each frame on its own.",
        min: Some(0.0),
        unit: Some("frames"),
        ..COUNT
    },
    ParamSpec {
        name: "radius",
        label: "Radius",
        help: "Radius of the plane fit to boundary points: a larger one gives a smoother surface.",
        symbol: Some("2h"),
        unit: Some("world"),
        ..FROM_DATA
    },
    ParamSpec {
        name: "timeScale",
        label: "Time scale",
        help: "Distance that one frame counts as: small values smooth over time, large ones fit each frame on its own.",
        symbol: Some("c"),
        unit: Some("world"),
        ..FROM_DATA
    },
    ParamSpec {
        name: "damping",
        label: "Damping",
        help: "Each projection step is scaled by this factor relative to the one before, so that the projection converges.",
        symbol: Some("β"),
        default: ParamDefault::Number(0.9),
        min: Some(0.5),
        max: Some(1.0),
        step: Some(0.01),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "edgeMin",
        label: "Shortest edge",
        help: "Shorter edges are collapsed; relative to the mean edge of the first frame.",
        symbol: Some("c_min"),
        default: ParamDefault::Number(0.25),
        min: Some(0.05),
        max: Some(1.0),
        step: Some(0.05),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "edgeMax",
        label: "Longest edge",
        help: "Longer edges are split; relative to the mean edge of the first frame, more than twice the shortest.",
        symbol: Some("c_max"),
        default: ParamDefault::Number(1.5),
        min: Some(0.5),
        max: Some(10.0),
        step: Some(0.1),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "prediction",
        label: "Prediction",
        help: "Starts each frame from the predicted surface instead of the previous one.",
        default: ParamDefault::Boolean(true),
        ..SWITCH
    },
    ParamSpec {
        name: "cyclic",
        label: "Cyclic",
        help: "The first frame follows the last, as in a heartbeat; at the end the surface is tracked back to it, to measure the closure error.",
        default: ParamDefault::Boolean(false),
        ..SWITCH
    },
];
