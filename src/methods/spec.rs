//! Descriptions of parameters, from which a user interface can build its controls.

use super::MethodError;
use serde::Serialize;

/// The description of one parameter: its name, type, default and range, and the texts of its control.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ParamSpec {
    /// The name in the public API.
    pub name: &'static str,
    /// A short label for the control.
    pub label: &'static str,
    /// One sentence of help that a student understands.
    pub help: &'static str,
    /// The symbol in the paper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symbol: Option<&'static str>,
    /// The type of the values.
    #[serde(rename = "type")]
    pub kind: ParamKind,
    /// The default value.
    pub default: ParamDefault,
    /// The smallest value accepted, if there is a bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value accepted, if there is a bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// A suitable increment for the control.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// How values are spread over a slider; `None` for parameters without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<ParamScale>,
    /// The unit, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The words that a parameter of kind [`ParamKind::Choice`] accepts; a number is accepted, too, if `min` is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choices: Option<&'static [&'static str]>,
}

impl ParamSpec {
    /// An unbounded number with default 0; specifications override the fields in which they differ.
    pub(super) const NUMBER: Self = Self {
        name: "",
        label: "",
        help: "",
        symbol: None,
        kind: ParamKind::Number,
        default: ParamDefault::Number(0.0),
        min: None,
        max: None,
        step: None,
        scale: Some(ParamScale::Linear),
        unit: None,
        choices: None,
    };

    /// Checks that a number is finite and within the accepted range, ends included.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the parameter and the accepted range.
    pub fn check(&self, value: f64) -> Result<(), MethodError> {
        let (low, high) = (self.min.unwrap_or(f64::MIN), self.max.unwrap_or(f64::MAX));
        if value >= low && value <= high {
            return Ok(());
        }
        let range = match (self.min, self.max) {
            (Some(low), Some(high)) => format!("a number from {low} to {high}"),
            _ => "a finite number".into(),
        };
        Err(MethodError::invalid(self.name, format!("must be {range}, got {value}")))
    }
}

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamKind {
    /// Any number in the range.
    Number,
    /// An integer in the range.
    Integer,
    /// One of the words in [`ParamSpec::choices`], or a number if [`ParamSpec::min`] is set.
    Choice,
    /// On or off.
    Boolean,
}

/// The default value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParamDefault {
    /// A number.
    Number(f64),
    /// One of the words in [`ParamSpec::choices`].
    Choice(&'static str),
    /// On or off.
    Boolean(bool),
    /// Derived from the data; serialised as `null`.
    FromData,
}

/// How values are spread over a slider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamScale {
    /// Equal steps of the slider add equal amounts to the value.
    Linear,
    /// Equal steps of the slider multiply the value by equal factors.
    Log,
}
