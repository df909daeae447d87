//! Parameters of the label surfaces.

use crate::methods::params::parameters;

parameters! {
    /// Parameters of [`LabelSurfaces`](super::LabelSurfaces).
    #[serde(default, deny_unknown_fields)]
    pub struct LabelParams {
        /// Number of smoothing iterations; 0 leaves the faces of the voxels.
        pub smoothing: u32 = 20 => {
            name: "smoothing",
            label: "Smoothing",
            help: "Number of smoothing iterations: more remove longer steps of slanted surfaces; 0 shows the voxels.",
            range: 0.0..=200.0,
            step: 1.0,
            unit: "iterations",
        },
    }
}
