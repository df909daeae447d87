//! Parameters of the implicit surface, with their ranges, labels and help texts.

use crate::methods::{MethodError, ParamDefault, ParamKind, ParamScale, ParamSpec};
use serde::{Deserialize, Serialize};

/// Parameters of the implicit surface. Lengths other than `cell` are in units of the normalised box, in which the
/// longest side of the points' bounding box is 2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ImplicitParams {
    /// The radial basis function φ from which the implicit function is built.
    pub kernel: KernelKind,
    /// δ of the multi-order kernel, its first-order smoothness, in inverse units of the normalised box: larger values
    /// pull the surface tight around the points.
    pub delta: f64,
    /// τ of the multi-order kernel, its third-order smoothness, in units of the normalised box: larger values round off
    /// detail.
    pub tau: f64,
    /// σ: width of the Gaussian kernel, in units of the normalised box; other kernels do not use it.
    pub sigma: f64,
    /// Regularisation λ of surface constraints, before confidences and the number of points are taken into account: the
    /// larger, the more the implicit function f may differ from 0 at the points; with 0 the surface interpolates them.
    pub lambda_surface: f64,
    /// Regularisation λ of exterior constraints: the larger, the more the implicit function f may differ from −1 at
    /// them.
    pub lambda_exterior: f64,
    /// Relative residual at which the solver of the linear system for the weights of the implicit function stops.
    pub tolerance: f64,
    /// Edge length of an extraction cell, in world units; 0 derives it from the spacing of the sampled points.
    pub cell: f64,
    /// The iso-value of the implicit function f at which the surface is extracted.
    pub level: IsoValue,
}

/// Choice of the radial basis function from which the implicit function is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KernelKind {
    /// The multi-order kernel of Dinh, Turk & Slabaugh (equation 6): first, second and third order smoothness at once.
    MultiOrder,
    /// |r|³, the thin plate of Dinh, Turk & Slabaugh, for comparison with the multi-order kernel.
    ThinPlate,
    /// −|r|, which is biharmonic in three dimensions, for comparison with the multi-order kernel.
    Biharmonic,
    /// The Gaussian exp(−r²/2σ²), for comparison with the multi-order kernel.
    Gaussian,
}

/// Choice of the iso-value of the implicit function f at which the surface is extracted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IsoValue {
    /// The iso-value 0, as in Dinh, Turk & Slabaugh.
    Zero,
    /// The mean of the implicit function f over the surface constraints, usually a little below 0.
    Mean,
}

impl Default for ImplicitParams {
    fn default() -> Self {
        Self {
            kernel: KernelKind::MultiOrder,
            delta: 5.0,
            tau: 0.025,
            sigma: 0.07,
            lambda_surface: 0.001,
            lambda_exterior: 2.0,
            tolerance: 1e-5,
            cell: 0.0,
            level: IsoValue::Zero,
        }
    }
}

impl ImplicitParams {
    /// Checks every numeric parameter against its range.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the first parameter out of range and what it accepts.
    pub fn validate(&self) -> Result<(), MethodError> {
        let numbers = [
            self.delta,
            self.tau,
            self.sigma,
            self.lambda_surface,
            self.lambda_exterior,
            self.tolerance,
            self.cell,
        ];
        let specs = SPECS.iter().filter(|spec| spec.kind == ParamKind::Number);
        specs.zip(numbers).try_for_each(|(spec, value)| spec.check(value))
    }

    /// Returns these parameters, but with `cell` and `level`, which affect only the extraction, taken from `other`;
    /// used to find out whether a change of parameters needs a new solve.
    pub fn with_extraction_of(&self, other: &Self) -> Self {
        Self { cell: other.cell, level: other.level, ..self.clone() }
    }

    /// Returns a warning, to be shown to the user, if δ of the multi-order kernel is so large that the surface may
    /// break up; `None` otherwise.
    pub fn warning(&self) -> Option<&'static str> {
        (self.kernel == KernelKind::MultiOrder && self.delta >= LARGE_DELTA).then_some(
            "delta ≥ 25: at large gaps between points the function falls to 0 inside, and the surface breaks up",
        )
    }
}

/// Value of δ, in inverse units of the normalised box, from which surfaces of points with large gaps break up; the user
/// is warned then.
const LARGE_DELTA: f64 = 25.0;

/// Returns the specification of each parameter (range, default, label, help), in the order in which a user interface
/// should show them.
pub fn param_specs() -> Vec<ParamSpec> {
    SPECS.to_vec()
}

const SPECS: [ParamSpec; 9] = [
    ParamSpec {
        name: "kernel",
        label: "Kernel",
        help: "Radial basis function of the implicit function: multi-order combines three orders of smoothness, the others are for comparison.",
        symbol: Some("φ"),
        kind: ParamKind::Choice,
        default: ParamDefault::Choice("multi-order"),
        scale: None,
        choices: Some(&["multi-order", "thin-plate", "biharmonic", "gaussian"]),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "delta",
        label: "First-order smoothness",
        help: "Larger values pull the surface tight around the points, like a membrane; from 25 on it breaks up at large gaps.",
        symbol: Some("δ"),
        default: ParamDefault::Number(5.0),
        min: Some(0.1),
        max: Some(100.0),
        step: Some(0.1),
        scale: Some(ParamScale::Log),
        unit: Some("1/box"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "tau",
        label: "Third-order smoothness",
        help: "Larger values round off detail and make curvature change slowly.",
        symbol: Some("τ"),
        default: ParamDefault::Number(0.025),
        min: Some(0.001),
        max: Some(1.0),
        step: Some(0.001),
        scale: Some(ParamScale::Log),
        unit: Some("box"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "sigma",
        label: "Gaussian width",
        help: "Width of the Gaussian kernel; other kernels do not use it.",
        symbol: Some("σ"),
        default: ParamDefault::Number(0.07),
        min: Some(0.005),
        max: Some(1.0),
        step: Some(0.001),
        scale: Some(ParamScale::Log),
        unit: Some("box"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "lambdaSurface",
        label: "Regularization, surface",
        help: "0 interpolates every point; larger values tolerate noise and give a smoother surface.",
        symbol: Some("λs"),
        default: ParamDefault::Number(0.001),
        min: Some(0.0),
        max: Some(10.0),
        step: Some(0.0001),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "lambdaExterior",
        label: "Regularization, exterior",
        help: "How much exterior constraints may be missed: they only fix the orientation, so a large value is right.",
        symbol: Some("λe"),
        default: ParamDefault::Number(2.0),
        min: Some(0.0),
        max: Some(1000.0),
        step: Some(0.1),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "tolerance",
        label: "Tolerance",
        help: "The solver stops at this relative residual.",
        default: ParamDefault::Number(1e-5),
        min: Some(1e-12),
        max: Some(0.01),
        scale: Some(ParamScale::Log),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "cell",
        label: "Cell size",
        help: "Edge length of an extraction cell, in the points' units; 0 derives it from their spacing.",
        min: Some(0.0),
        max: Some(1e30),
        scale: None,
        unit: Some("points' units"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "level",
        label: "Iso-value",
        help: "Value of f at the surface: zero is the paper's; mean is the mean of f at the points, which lie slightly outside the zero set.",
        kind: ParamKind::Choice,
        default: ParamDefault::Choice("zero"),
        scale: None,
        choices: Some(&["zero", "mean"]),
        ..ParamSpec::NUMBER
    },
];
