//! Descriptions of the parameters of all methods, from which a user interface can build its controls.

use super::MethodError;
use super::params::ParamType;
use serde::Serialize;
use std::ops::RangeInclusive;

/// The description of one parameter: its name, type, default and range, and the texts of its control.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ParamSpec {
    /// The name of the parameter in the public API.
    pub name: &'static str,
    /// A short label for the parameter's control in a user interface.
    pub label: &'static str,
    /// One sentence of help on the parameter that a student understands.
    pub help: &'static str,
    /// The symbol of the parameter in the paper, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symbol: Option<&'static str>,
    /// The type of the parameter's values.
    #[serde(rename = "type")]
    pub kind: ParamKind,
    /// The value of the parameter if the caller gives none.
    pub default: ParamDefault,
    /// The smallest value accepted for the parameter; `None` if there is no bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value accepted for the parameter; `None` if there is no bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// A suitable increment for the parameter's control, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// How values are spread over the parameter's slider; `None` for parameters without a slider.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<ParamScale>,
    /// The unit of the parameter's values, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The words that a parameter of kind [`ParamKind::Choice`] accepts; a number is accepted, too, if `min` is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub choices: Option<&'static [&'static str]>,
}

impl ParamSpec {
    /// Returns the description of a parameter of which only the name, the type and the default are known; the methods
    /// below add the rest.
    pub(super) fn new<T: ParamType>(name: &'static str, default: &T) -> Self {
        Self {
            name,
            label: "",
            help: "",
            symbol: None,
            kind: T::KIND,
            default: default.as_default(),
            min: None,
            max: None,
            step: None,
            scale: if T::KIND == ParamKind::Choice { None } else { Some(ParamScale::Linear) },
            unit: None,
            choices: T::CHOICES,
        }
    }

    /// Returns the description with a label.
    pub(super) fn label(self, label: &'static str) -> Self {
        Self { label, ..self }
    }

    /// Returns the description with a sentence of help.
    pub(super) fn help(self, help: &'static str) -> Self {
        Self { help, ..self }
    }

    /// Returns the description with the symbol of the parameter in the paper.
    pub(super) fn symbol(self, symbol: &'static str) -> Self {
        Self { symbol: Some(symbol), ..self }
    }

    /// Returns the description of a parameter whose default, if the caller gives no value, is derived from the data.
    pub(super) fn default(self, default: ParamDefault) -> Self {
        Self { default, ..self }
    }

    /// Returns the description with the range of accepted numbers, ends included.
    pub(super) fn range(self, range: RangeInclusive<f64>) -> Self {
        Self { min: Some(*range.start()), max: Some(*range.end()), ..self }
    }

    /// Returns the description with an increment of the parameter's control.
    pub(super) fn step(self, step: f64) -> Self {
        Self { step: Some(step), ..self }
    }

    /// Returns the description with another scale of the slider than a linear one; `None` for no slider.
    pub(super) fn scale(self, scale: impl Into<Option<ParamScale>>) -> Self {
        Self { scale: scale.into(), ..self }
    }

    /// Returns the description with the unit of the parameter's values.
    pub(super) fn unit(self, unit: &'static str) -> Self {
        Self { unit: Some(unit), ..self }
    }

    /// Returns the description with the accepted words in another order than that of the type.
    pub(super) fn choices(self, choices: &'static [&'static str]) -> Self {
        Self { choices: Some(choices), ..self }
    }

    /// Returns the type of the parameter's values in words, for messages: "a number", "a number or 'auto'", or the words to choose from.
    pub fn expected(&self) -> String {
        match (self.kind, self.choices) {
            (ParamKind::Number, None) => "a number".into(),
            (ParamKind::Number, Some(words)) => format!("a number or '{}'", words.join("', '")),
            (ParamKind::Integer, _) => "a whole number".into(),
            (ParamKind::Boolean, _) => "true or false".into(),
            (ParamKind::Choice, words) => {
                let number = if self.min.is_some() { ", or a number" } else { "" };
                format!("one of {}{number}", words.unwrap_or_default().join(", "))
            }
        }
    }

    /// Checks that a numerical value of the parameter is finite and within the accepted range, ends included.
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

/// The type of a parameter's values, by which a user interface chooses a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamKind {
    /// Any number from [`ParamSpec::min`] to [`ParamSpec::max`].
    Number,
    /// An integer from [`ParamSpec::min`] to [`ParamSpec::max`].
    Integer,
    /// One of the words in [`choices`](field@ParamSpec::choices), or a number if [`ParamSpec::min`] is set.
    Choice,
    /// On or off, as a Boolean.
    Boolean,
}

/// The default value of a parameter, in a form that suits its type.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParamDefault {
    /// The default of a numerical parameter.
    Number(f64),
    /// The default of a choice, one of the words in [`choices`](field@ParamSpec::choices).
    Choice(&'static str),
    /// The default of a parameter that is on or off.
    Boolean(bool),
    /// The default depends on the data, such as the volume; serialised as `null`.
    FromData,
}

/// How the values of a parameter are spread over its slider in a user interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ParamScale {
    /// Equal steps of the slider add equal amounts to the value.
    Linear,
    /// Equal steps of the slider multiply the value by equal factors.
    Log,
}
