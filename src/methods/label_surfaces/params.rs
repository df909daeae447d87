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

        /// Edge length wanted of the triangles, in voxels; 1 leaves a vertex for each cell between voxels.
        pub edge: f64 = 1.0 => {
            name: "edge",
            label: "Edge length",
            help: "Edge length wanted of the triangles: longer gives fewer, as far as no voxel changes sides; 1 keeps all.",
            range: 1.0..=10.0,
            step: 0.5,
            unit: "voxels",
        },
    }
}
