//! Parameters of the implicit surface, with their ranges, labels and help texts.

use crate::methods::params::{Auto, choices, parameters};
use crate::methods::{MethodError, ParamScale, Parameters};

parameters! {
    /// Parameters of the implicit surface. Lengths other than `cell` are in units of the normalised box, in which the
    /// longest side of the points' bounding box is 2.
    #[serde(deny_unknown_fields)]
    pub struct ImplicitParams {
        /// The radial basis function φ from which the implicit function is built.
        pub kernel: KernelKind = KernelKind::MultiOrder => {
            name: "kernel",
            label: "Kernel",
            help: "Radial basis function of the implicit function: multi-order combines three orders of smoothness, the others are for comparison.",
            symbol: "φ",
        },
        /// δ of the multi-order kernel, its first-order smoothness, in inverse units of the normalised box: larger
        /// values pull the surface tight around the points. [`Auto::Auto`] chooses it by their density; 5 is the paper's.
        pub delta: Auto = Auto::Auto => {
            name: "delta",
            label: "First-order smoothness",
            help: "Larger values pull the surface tight around the points, like a membrane; from 25 on it breaks up at large gaps.",
            symbol: "δ",
            range: 0.1..=100.0,
            step: 0.1,
            scale: ParamScale::Log,
            unit: "1/box",
        },
        /// τ of the multi-order kernel, its third-order smoothness, in units of the normalised box: larger values round
        /// off detail.
        pub tau: f64 = 0.025 => {
            name: "tau",
            label: "Third-order smoothness",
            help: "Larger values round off detail and make curvature change slowly.",
            symbol: "τ",
            range: 0.001..=1.0,
            step: 0.001,
            scale: ParamScale::Log,
            unit: "box",
        },
        /// σ: width of the Gaussian kernel, in units of the normalised box; other kernels do not use it.
        pub sigma: f64 = 0.07 => {
            name: "sigma",
            label: "Gaussian width",
            help: "Width of the Gaussian kernel; other kernels do not use it.",
            symbol: "σ",
            range: 0.005..=1.0,
            step: 0.001,
            scale: ParamScale::Log,
            unit: "box",
        },
        /// Regularisation λ of surface constraints, before confidences and the number of points are taken into account:
        /// the larger, the more the implicit function f may differ from 0 at the points; with 0 the surface
        /// interpolates them. [`Auto::Auto`] chooses it by density and noise; 0.001 is the paper's.
        pub lambda_surface: Auto = Auto::Auto => {
            name: "lambdaSurface",
            label: "Regularization, surface",
            help: "0 interpolates every point; larger values tolerate noise and give a smoother surface.",
            symbol: "λs",
            range: 0.0..=10.0,
            step: 0.0001,
        },
        /// Regularisation λ of constraints off the surface: the larger, the more the implicit function f may differ from −1
        /// at those outside, and from 1 at those inside. [`Auto::Auto`] makes them as soft as the noise demands; 2 is the
        /// paper's.
        pub lambda_exterior: Auto = Auto::Auto => {
            name: "lambdaExterior",
            label: "Regularization, off-surface",
            help: "How much constraints off the surface may be missed: they only fix the orientation, so a large value is right.",
            symbol: "λe",
            range: 0.0..=1000.0,
            step: 0.1,
        },
        /// Relative residual at which the solver of the linear system for the weights of the implicit function stops.
        pub tolerance: f64 = 1e-5 => {
            name: "tolerance",
            label: "Tolerance",
            help: "The solver stops at this relative residual.",
            range: 1e-12..=0.01,
            scale: ParamScale::Log,
        },
        /// Edge length of an extraction cell, in world units; 0 derives it from the spacing of the sampled points.
        pub cell: f64 = 0.0 => {
            name: "cell",
            label: "Cell size",
            help: "Edge length of an extraction cell, in the points' units; 0 derives it from their spacing.",
            range: 0.0..=1e30,
            scale: None,
            unit: "points' units",
        },
        /// The iso-value of the implicit function f at which the surface is extracted.
        pub level: IsoValue = IsoValue::Zero => {
            name: "level",
            label: "Iso-value",
            help: "Value of f at the surface: zero is the paper's; mean is the mean of f at the points, which lie slightly outside the zero set.",
        },
        /// The sides of the surface on which there are constraints besides those on it.
        pub sides: Sides = Sides::Auto => {
            name: "sides",
            label: "Constraints off the surface",
            help: "On both sides, noise does not shrink the surface; outside only is the paper's. Auto: both, unless these are ambiguous and the points fit better with those outside.",
            choices: &["auto", "both", "outside"],
        },
    }
}

choices! {
    /// Choice of the radial basis function from which the implicit function is built.
    pub enum KernelKind {
        /// The multi-order kernel of Dinh, Turk & Slabaugh (equation 6): first, second and third order smoothness at
        /// once.
        MultiOrder = "multi-order",
        /// |r|³, the thin plate of Dinh, Turk & Slabaugh, for comparison with the multi-order kernel.
        ThinPlate = "thin-plate",
        /// −|r|, which is biharmonic in three dimensions, for comparison with the multi-order kernel.
        Biharmonic = "biharmonic",
        /// The Gaussian exp(−r²/2σ²), for comparison with the multi-order kernel.
        Gaussian = "gaussian",
    }
}

choices! {
    /// Choice of the iso-value of the implicit function f at which the surface is extracted.
    pub enum IsoValue {
        /// The iso-value 0, as in Dinh, Turk & Slabaugh.
        Zero = "zero",
        /// The mean of the implicit function f over the surface constraints, usually a little below 0.
        Mean = "mean",
    }
}

choices! {
    /// Choice of the sides of the surface on which there are constraints besides those on it.
    pub enum Sides {
        /// Outside and inside, as far as the points tell these apart; parts of the surface that no point supports are left
        /// out.
        Both = "both",
        /// Outside only, as in Dinh, Turk & Slabaugh.
        Outside = "outside",
        /// Both, unless the points do not tell them apart, and are nearer to the surface with constraints outside only.
        Auto = "auto",
    }
}

impl ImplicitParams {
    /// Returns the parameters of Dinh, Turk & Slabaugh, which do not depend on the points.
    pub fn paper() -> Self {
        Self {
            delta: Auto::Given(5.0),
            lambda_surface: Auto::Given(0.001),
            lambda_exterior: Auto::Given(2.0),
            sides: Sides::Outside,
            ..Self::default()
        }
    }

    /// Checks every numeric parameter against its range.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the first parameter out of range and what it accepts.
    pub fn validate(&self) -> Result<(), MethodError> {
        self.check_ranges()
    }

    /// Returns these parameters, but with `cell` and `level`, which affect only the extraction, taken from `other`;
    /// used to find out whether a change of parameters needs a new solve.
    pub fn with_extraction_of(&self, other: &Self) -> Self {
        Self { cell: other.cell, level: other.level, ..self.clone() }
    }

    /// Returns a warning, to be shown to the user, if δ of the multi-order kernel is so large that the surface may
    /// break up; `None` otherwise.
    pub fn warning(&self) -> Option<&'static str> {
        let is_large = self.delta.given().is_some_and(|delta| delta >= LARGE_DELTA);
        (self.kernel == KernelKind::MultiOrder && is_large).then_some(
            "delta ≥ 25: at large gaps between points the function falls to 0 inside, and the surface breaks up",
        )
    }
}

/// Value of δ, in inverse units of the normalised box, from which surfaces of points with large gaps break up; the user
/// is warned then.
const LARGE_DELTA: f64 = 25.0;
