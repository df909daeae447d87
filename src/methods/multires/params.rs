//! Parameters of the multiresolution model, their ranges and their labels.

use crate::methods::params::{choices, parameters};
use crate::methods::{MethodError, ParamDefault, ParamScale, Parameters};
use crate::remesh::EdgeBounds;

parameters! {
    /// Parameters of the multiresolution model. All can be changed during a run.
    #[serde(deny_unknown_fields)]
    pub struct MultiresParams {
        /// ε_min, in units of the mesh: shorter edges of the deformed base are collapsed.
        pub edge_min: f64 = 0.0 => {
            name: "edgeMin",
            label: "Shortest edge",
            help: "Shorter edges are collapsed; halving it quadruples the number of triangles.",
            symbol: "ε_min",
            default: ParamDefault::FromData,
            range: 1e-16..=1e16,
            scale: ParamScale::Log,
        },
        /// ε_max, in units of the mesh: longer edges of the deformed base are split; more than twice `edge_min`.
        pub edge_max: f64 = 0.0 => {
            name: "edgeMax",
            label: "Longest edge",
            help: "Longer edges are split; must be more than twice the shortest edge.",
            symbol: "ε_max",
            default: ParamDefault::FromData,
            range: 1e-16..=1e16,
            scale: ParamScale::Log,
        },
        /// Maximum number of coarser meshes on which the membrane is solved first; 0 solves on the target resolution
        /// only.
        pub levels: u32 = 2 => {
            name: "levels",
            label: "Coarse levels",
            help: "Number of coarser meshes on which the membrane is solved first; they speed up large deformations.",
            range: 0.0..=6.0,
            step: 1.0,
        },
        /// q: the factor, below 1, by which the edge bounds shrink from one level of the solver to the next finer one.
        pub refine_factor: f64 = 0.5 => {
            name: "refineFactor",
            label: "Refinement factor",
            help: "Ratio of edge lengths between a level and the next coarser one.",
            symbol: "q",
            range: 0.3..=0.9,
            step: 0.05,
        },
        /// Maximum number of Gauss–Seidel iterations on each level when the membrane is solved; finer levels may end
        /// earlier.
        pub smoothing: u32 = 10 => {
            name: "smoothing",
            label: "Iterations per level",
            help: "Umbrella iterations per level; more make the membrane tighter.",
            range: 1.0..=200.0,
            step: 1.0,
        },
        /// Number of times that the operator D, which evens out the map T from the deformed base to M₀, is applied
        /// after each solve of the membrane.
        pub distribute: u32 = 3 => {
            name: "distribute",
            label: "Distribution passes",
            help: "Passes that even out the map to the base; without them it folds.",
            symbol: "D",
            range: 0.0..=50.0,
            step: 1.0,
        },
        /// How often an edge of the deformed base may be halved, where the detail that is added to it needs more
        /// vertices.
        pub supersample: u32 = 0 => {
            name: "supersample",
            label: "Super-sampling",
            help: "Maximum number of edge halvings where the detail is finer than the base or stretched; the base itself is not changed.",
            range: 0.0..=4.0,
            step: 1.0,
        },
        /// The energy that the deformed base minimises where it spans between the ellipsoids.
        pub energy: Energy = Energy::Membrane => {
            name: "energy",
            label: "Surface energy",
            help: "A membrane minimises area, like a soap film; a thin plate minimises bending, like sheet metal.",
        },
        /// Which topology changes the deformed base may undergo: cuts of thin necks, joins of parts in contact.
        pub topology: Topology = Topology::Split => {
            name: "topology",
            label: "Necks and contacts",
            help: "Whether thin necks are cut, and whether parts in contact are joined.",
        },
    }
}

choices! {
    /// The energy that the deformed base minimises where it spans between the ellipsoids.
    pub enum Energy {
        /// The deformed base minimises its area, like a soap film.
        Membrane = "membrane",
        /// The deformed base minimises its bending, like a thin plate, so that it leaves an ellipsoid smoothly.
        ThinPlate = "thin-plate",
    }
}

choices! {
    /// Which topology changes the deformed base may undergo: cuts of thin necks, joins of parts in contact.
    pub enum Topology {
        /// No topology changes, as in Kobbelt, Bareuther & Seidel: thin necks stay and parts in contact are not joined.
        Never = "never",
        /// Necks too thin for the shortest edge, ε_min, are cut.
        Split = "split",
        /// Necks too thin for the shortest edge, ε_min, are cut, and parts in contact are joined.
        SplitAndJoin = "split-and-join",
    }
}

choices! {
    /// The support of the surface of a multiresolution model.
    #[derive(Default)]
    pub enum Support {
        /// A membrane over the ellipsoids, as in Kobbelt, Bareuther & Seidel.
        #[default]
        Membrane = "membrane",
        /// The surface holds itself: it is as given except where ellipsoids move it.
        Surface = "surface",
    }
}

/// Default ε_min as a share of the target edge. With the default ratio of the two bounds, 2.23, splits of long edges
/// leave no short ones behind.
const MIN_SHARE: f64 = 0.65;
/// Default ε_max as a share of the target edge.
const MAX_SHARE: f64 = 1.45;

impl MultiresParams {
    /// Checks that every parameter is in its range, and that ε_max > 2 ε_min.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] naming the first parameter that is not accepted, and its range.
    pub fn validate(&self) -> Result<(), MethodError> {
        self.check_ranges()?;
        if self.edge_max > 2.0 * self.edge_min {
            return Ok(());
        }
        let problem = format!("must be > 2 × edgeMin ({1}), got {0}", self.edge_max, self.edge_min);
        Err(MethodError::invalid("edgeMax", problem))
    }

    /// Returns the parameters with edge bounds of 0, which mean the default, replaced: one is derived from the other,
    /// or both from the target edge length `edge`, in units of the mesh.
    pub fn with_target(mut self, edge: f64) -> Self {
        match (self.edge_min > 0.0, self.edge_max > 0.0) {
            (true, false) => self.edge_max = self.edge_min * (MAX_SHARE / MIN_SHARE),
            (false, true) => self.edge_min = self.edge_max * (MIN_SHARE / MAX_SHARE),
            (false, false) => (self.edge_min, self.edge_max) = (MIN_SHARE * edge, MAX_SHARE * edge),
            (true, true) => {}
        }
        self
    }

    /// Returns the edge bounds ε_min and ε_max, in units of the mesh, for remeshing.
    pub fn bounds(&self) -> EdgeBounds {
        EdgeBounds { min: self.edge_min as f32, max: self.edge_max as f32 }
    }

    /// Returns the target edge length, in units of the mesh: the mean edge that the edge bounds correspond to.
    pub fn target(&self) -> f64 {
        0.5 * (self.edge_min + self.edge_max) / (0.5 * (MIN_SHARE + MAX_SHARE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn good() -> MultiresParams {
        MultiresParams::default().with_target(1.0)
    }

    #[test]
    fn bounds_of_edges_need_a_ratio_above_two() {
        assert_eq!(good().validate(), Ok(()));
        assert!((good().target() - 1.0).abs() < 1e-12);
        for edge_max in [1.3, 1.0, 0.1, f64::NAN] {
            let error = MultiresParams { edge_max, ..good() }.validate().unwrap_err().to_string();
            assert!(error.starts_with("edgeMax"), "{error}");
        }
    }

    #[test]
    fn one_bound_gives_the_other() {
        let from_min = MultiresParams { edge_min: 2.0, ..Default::default() }.with_target(7.0);
        let from_max = MultiresParams { edge_max: from_min.edge_max, ..Default::default() }.with_target(7.0);
        assert_eq!(from_min.validate(), Ok(()));
        assert!((from_max.edge_min - 2.0).abs() < 1e-12);
    }

    #[test]
    fn every_number_is_checked_by_name() {
        for (name, params) in [
            ("edgeMin", MultiresParams { edge_min: -1.0, ..good() }),
            ("levels", MultiresParams { levels: 7, ..good() }),
            ("refineFactor", MultiresParams { refine_factor: 1.0, ..good() }),
            ("smoothing", MultiresParams { smoothing: 0, ..good() }),
            ("distribute", MultiresParams { distribute: 51, ..good() }),
            ("supersample", MultiresParams { supersample: 5, ..good() }),
        ] {
            assert!(params.validate().unwrap_err().to_string().starts_with(name), "{name}");
        }
    }
}
