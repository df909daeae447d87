//! Parameters that describe themselves, so that a page can build its controls from them.

use super::MethodError;
use serde::Serialize;

/// One parameter of a method.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ParamSpec {
    /// The name in the public contract.
    pub name: &'static str,
    /// A short label.
    pub label: &'static str,
    /// One sentence a student understands.
    pub help: &'static str,
    /// The letter in the paper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symbol: Option<&'static str>,
    /// What values it takes.
    #[serde(rename = "type")]
    pub kind: ParamKind,
    /// The value when none is given.
    pub default: ParamDefault,
    /// The least value accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// A sensible step of a control.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// How a slider should run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<ParamScale>,
    /// The unit, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The words a choice accepts; a number is accepted too where `min` is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choices: Option<&'static [&'static str]>,
}

impl ParamSpec {
    /// A number of any size, for the specs to differ from.
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

    /// Tests a number against the range.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] that names the parameter and what it accepts.
    pub fn check(&self, value: f64) -> Result<(), MethodError> {
        let (low, high) = (self.min.unwrap_or(f64::MIN), self.max.unwrap_or(f64::MAX));
        if value >= low && value <= high {
            return Ok(());
        }
        let range = match (self.min, self.max) {
            (Some(low), Some(high)) => format!("a number from {low} to {high}"),
            _ => "a finite number".into(),
        };
        Err(MethodError::invalid(self.name, format!("{value} given, {range} accepted")))
    }
}

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamKind {
    /// Any number in the range.
    Number,
    /// A whole number in the range.
    Integer,
    /// One of the choices.
    Choice,
    /// On or off.
    Boolean,
}

/// The default of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParamDefault {
    /// A number.
    Number(f64),
    /// One of the choices.
    Choice(&'static str),
    /// On or off.
    Boolean(bool),
    /// Taken from the data; `null` for the reader.
    FromData,
}

/// How values are spread over a slider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamScale {
    /// Evenly.
    Linear,
    /// By factors.
    Log,
}
