//! Parameters of the methods: each is declared once, by [`parameters!`], with its type, default, range and texts.
//!
//! From the declaration come the struct, its default, the descriptions for user interfaces and the check of ranges.

use super::{MethodError, ParamDefault, ParamKind, ParamSpec};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// The parameters of a method. Implemented by the macro that declares them.
pub trait Parameters: Clone + Default + PartialEq + Serialize + DeserializeOwned {
    /// Returns the description of each parameter, in the order of the fields, in which a user interface should show
    /// them.
    fn specs() -> Vec<ParamSpec>;

    /// Returns the value of each parameter as a number, in the order of [`Self::specs`]; `None` for words and Booleans.
    fn numbers(&self) -> Vec<Option<f64>>;

    /// Sets the parameter whose name in JavaScript is `name`, without checking its range; returns whether there is one and
    /// the value has its type.
    fn set(&mut self, name: &str, value: &ParamInput) -> bool;

    /// Checks every numerical parameter against its accepted range.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the first parameter out of range and the accepted range.
    fn check_ranges(&self) -> Result<(), MethodError> {
        self.check_ranges_if(|_, _| true)
    }

    /// Checks against its accepted range every numerical parameter for which `is_checked`, given its description and
    /// value, returns true.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the first parameter out of range and the accepted range.
    fn check_ranges_if(&self, is_checked: impl Fn(&ParamSpec, f64) -> bool) -> Result<(), MethodError> {
        for (spec, value) in Self::specs().iter().zip(self.numbers()) {
            if let Some(value) = value.filter(|&value| is_checked(spec, value)) {
                spec.check(value)?;
            }
        }
        Ok(())
    }
}

/// A value given for a parameter, before it is known whether it has the parameter's type.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum ParamInput {
    /// A number, which an integer is given as, too.
    Number(f64),
    /// A word, for a choice.
    Word(String),
    /// A Boolean.
    Boolean(bool),
    /// A value of a type that no parameter has.
    Other,
}

/// A type of parameters: a number, a Boolean, or an enum declared by [`choices!`].
pub(super) trait ParamType: Sized {
    /// The type as user interfaces know it.
    const KIND: ParamKind;

    /// The words that the type accepts, if it is a choice.
    const CHOICES: Option<&'static [&'static str]> = None;

    /// Converts a given value; `None` if it has another type.
    fn from_input(value: &ParamInput) -> Option<Self>;

    /// Returns the value as the default of a parameter.
    fn as_default(&self) -> ParamDefault;

    /// Returns the value if it is a number, which has to be in the range of its parameter.
    fn number(&self) -> Option<f64> {
        None
    }
}

impl ParamType for f64 {
    const KIND: ParamKind = ParamKind::Number;

    fn from_input(value: &ParamInput) -> Option<Self> {
        if let ParamInput::Number(number) = value { Some(*number) } else { None }
    }

    fn as_default(&self) -> ParamDefault {
        ParamDefault::Number(*self)
    }

    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl ParamType for u32 {
    const KIND: ParamKind = ParamKind::Integer;

    fn from_input(value: &ParamInput) -> Option<Self> {
        let number = f64::from_input(value)?;
        (number.fract() == 0.0 && (0.0..=f64::from(Self::MAX)).contains(&number)).then_some(number as Self)
    }

    fn as_default(&self) -> ParamDefault {
        ParamDefault::Number(f64::from(*self))
    }

    fn number(&self) -> Option<f64> {
        Some(f64::from(*self))
    }
}

impl ParamType for bool {
    const KIND: ParamKind = ParamKind::Boolean;

    fn from_input(value: &ParamInput) -> Option<Self> {
        if let ParamInput::Boolean(on) = value { Some(*on) } else { None }
    }

    fn as_default(&self) -> ParamDefault {
        ParamDefault::Boolean(*self)
    }
}

/// Declares the parameters of a method as a struct that implements [`Default`], [`Parameters`] and serde's traits.
///
/// ```ignore
/// parameters! {
///     /// The parameters of the method.
///     pub struct ExampleParams {
///         /// m: the mass of a vertex.
///         pub vertex_mass: f64 = 1.0 => {
///             name: "vertexMass",
///             label: "Mass",
///             help: "Inertia of a vertex.",
///             range: 0.1..=100.0,
///         },
///     }
/// }
/// ```
///
/// After the type, which implements [`ParamType`], comes the default; in braces `name`, the field's name in JavaScript
/// and in JSON, and what else describes it: each other key is a method of [`ParamSpec`], called with the value after it.
/// The order of the fields is that of user interfaces and of saved states.
macro_rules! parameters {
    (
        $(#[$attribute:meta])*
        pub struct $Params:ident {$(
            $(#[$field_attribute:meta])*
            pub $field:ident: $Type:ty = $default:expr => {
                name: $name:literal,
                $($key:ident: $value:expr,)*
            },
        )*}
    ) => {
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        $(#[$attribute])*
        pub struct $Params {$(
            $(#[$field_attribute])*
            #[serde(rename = $name)]
            pub $field: $Type,
        )*}

        impl Default for $Params {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $crate::methods::Parameters for $Params {
            fn specs() -> Vec<$crate::methods::ParamSpec> {
                let defaults = Self::default();
                vec![$($crate::methods::ParamSpec::new($name, &defaults.$field)$(.$key($value))*,)*]
            }

            fn numbers(&self) -> Vec<Option<f64>> {
                vec![$($crate::methods::params::ParamType::number(&self.$field),)*]
            }

            fn set(&mut self, name: &str, value: &$crate::methods::ParamInput) -> bool {
                match name {
                    $($name => $crate::methods::params::ParamType::from_input(value)
                        .map(|value| self.$field = value)
                        .is_some(),)*
                    _ => false,
                }
            }
        }
    };
}

/// Declares an enum of which a parameter is a value: each variant with the word that stands for it in JavaScript and in
/// JSON.
///
/// The order of the variants is that of user interfaces, if the parameter has no other `choices`, and must not change,
/// since saved states hold the index of the variant.
macro_rules! choices {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $Choice:ident {$(
            $(#[$variant_attribute:meta])*
            $Variant:ident = $word:literal,
        )*}
    ) => {
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        $(#[$attribute])*
        $visibility enum $Choice {$(
            $(#[$variant_attribute])*
            #[serde(rename = $word)]
            $Variant,
        )*}

        impl $crate::methods::params::ParamType for $Choice {
            const KIND: $crate::methods::ParamKind = $crate::methods::ParamKind::Choice;

            const CHOICES: Option<&'static [&'static str]> = Some(&[$($word),*]);

            fn from_input(value: &$crate::methods::ParamInput) -> Option<Self> {
                match value {
                    $($crate::methods::ParamInput::Word(word) if word == $word => Some(Self::$Variant),)*
                    _ => None,
                }
            }

            fn as_default(&self) -> $crate::methods::ParamDefault {
                $crate::methods::ParamDefault::Choice(match self {
                    $(Self::$Variant => $word,)*
                })
            }
        }
    };
}

/// Declares an enum of which a parameter is a value that is a number or a word, as [`choices!`] does; after the name comes
/// its [`ParamKind`]. Saved states hold a number: after each word come the one that stands for it, and the test of one.
macro_rules! words_or_number {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $Type:ident: $kind:expr => {
            $(#[$number_attribute:meta])*
            Given,
            $(
                $(#[$variant_attribute:meta])*
                $Variant:ident = $word:literal => ($code:expr, $is_code:expr),
            )*
        }
    ) => {
        #[derive(Clone, Copy, Debug, PartialEq)]
        $(#[$attribute])*
        $visibility enum $Type {
            $($(#[$variant_attribute])* $Variant,)*
            $(#[$number_attribute])*
            Given(f64),
        }

        impl $crate::methods::params::ParamType for $Type {
            const KIND: $crate::methods::ParamKind = $kind;

            const CHOICES: Option<&'static [&'static str]> = Some(&[$($word),*]);

            fn from_input(value: &$crate::methods::ParamInput) -> Option<Self> {
                match value {
                    $($crate::methods::ParamInput::Word(word) if word == $word => Some(Self::$Variant),)*
                    _ => <f64 as $crate::methods::params::ParamType>::from_input(value).map(Self::Given),
                }
            }

            fn as_default(&self) -> $crate::methods::ParamDefault {
                match self {
                    $(Self::$Variant => $crate::methods::ParamDefault::Choice($word),)*
                    Self::Given(number) => $crate::methods::params::ParamType::as_default(number),
                }
            }

            fn number(&self) -> Option<f64> {
                if let Self::Given(number) = self { Some(*number) } else { None }
            }
        }

        impl serde::Serialize for $Type {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                match self {
                    $(Self::$Variant if serializer.is_human_readable() => serializer.serialize_str($word),)*
                    $(Self::$Variant => serializer.serialize_f64($code),)*
                    Self::Given(number) => serializer.serialize_f64(*number),
                }
            }
        }

        impl<'de> serde::Deserialize<'de> for $Type {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                if deserializer.is_human_readable() {
                    let value = $crate::methods::ParamInput::deserialize(deserializer)?;
                    let wrong = || serde::de::Error::custom("neither a number nor a word that is accepted");
                    return $crate::methods::params::ParamType::from_input(&value).ok_or_else(wrong);
                }
                let number = f64::deserialize(deserializer)?;
                $(if ($is_code)(number) {
                    return Ok(Self::$Variant);
                })*
                Ok(Self::Given(number))
            }
        }
    };
}

pub(super) use {choices, parameters, words_or_number};

words_or_number! {
    /// A number, or the word `auto`: the method then chooses it from its data.
    pub enum Auto: ParamKind::Number => {
        /// Given by the caller.
        Given,
        /// Chosen by the method.
        Auto = "auto" => (f64::NAN, f64::is_nan),
    }
}

impl Auto {
    /// Returns the number if it is given.
    pub fn given(self) -> Option<f64> {
        self.number()
    }
}

impl From<f64> for Auto {
    fn from(number: f64) -> Self {
        Self::Given(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a value of the type that `spec` describes, which is in its range, and is not the default if there is
    /// another.
    fn another(spec: &ParamSpec) -> ParamInput {
        match (spec.kind, spec.choices, spec.default) {
            (ParamKind::Choice, Some(words), _) => ParamInput::Word(words[words.len() - 1].into()),
            (ParamKind::Boolean, _, ParamDefault::Boolean(on)) => ParamInput::Boolean(!on),
            _ => ParamInput::Number(spec.max.unwrap_or(7.0)),
        }
    }

    /// Returns whether the JSON of parameters has the given value under the given name.
    fn has(params: &impl Serialize, name: &str, value: &ParamInput) -> bool {
        let json = serde_json::to_value(params).unwrap();
        let found = &json[name];
        match value {
            ParamInput::Number(number) => found.as_f64() == Some(*number),
            ParamInput::Word(word) => found.as_str() == Some(word.as_str()),
            ParamInput::Boolean(on) => found.as_bool() == Some(*on),
            ParamInput::Other => false,
        }
    }

    /// Asserts that descriptions, defaults, names, words and ranges of the parameters agree with each other.
    fn check<P: Parameters + std::fmt::Debug>() {
        let defaults = P::default();
        let json = serde_json::to_value(&defaults).unwrap();
        assert_eq!(json.as_object().unwrap().len(), P::specs().len());
        for spec in P::specs() {
            let name = spec.name;
            let default = match spec.default {
                ParamDefault::Number(number) => ParamInput::Number(number),
                ParamDefault::Choice(word) => ParamInput::Word(word.into()),
                ParamDefault::Boolean(on) => ParamInput::Boolean(on),
                ParamDefault::FromData => ParamInput::Number(0.0),
            };
            assert!(has(&defaults, name, &default), "{name}: {default:?}");
            let words = spec.choices.unwrap_or_default().iter().map(|&word| ParamInput::Word(word.into()));
            for value in words.chain([another(&spec), default]) {
                let mut params = defaults.clone();
                assert!(params.set(name, &value), "{name}: {value:?}");
                assert!(has(&params, name, &value), "{name}: {value:?}");
                let read: P = serde_json::from_value(serde_json::to_value(&params).unwrap()).unwrap();
                assert_eq!(read, params, "{name}");
                let is_from_data = |spec: &ParamSpec| spec.default == ParamDefault::FromData;
                assert_eq!(
                    params.check_ranges_if(|spec, _| !is_from_data(spec)),
                    Ok(()),
                    "{name}: {value:?}"
                );
            }
            for beyond in [spec.min.map(|min| min - 1.0), spec.max.map(|max| 2.0 * max + 1.0)] {
                let mut params = defaults.clone();
                if beyond.is_some_and(|number| params.set(name, &ParamInput::Number(number))) {
                    let error = params.check_ranges_if(|checked, _| checked.name == name).unwrap_err();
                    assert!(
                        error.to_string().starts_with(&format!("{name}: must be a number from ")),
                        "{error}"
                    );
                }
            }
            let mut params = defaults.clone();
            for wrong in [ParamInput::Word("colour".into()), ParamInput::Other] {
                assert!(!params.set(name, &wrong), "{name}: {wrong:?}");
            }
            assert_eq!(params, defaults, "{name}");
        }
        assert!(!P::default().set("colour", &ParamInput::Number(1.0)));
    }

    #[test]
    fn those_of_the_deformable_model_agree_with_their_descriptions() {
        check::<crate::methods::deformable::DeformableParams>();
    }

    #[test]
    fn those_of_the_implicit_surface_agree_with_their_descriptions() {
        check::<crate::methods::implicit::ImplicitParams>();
    }

    #[test]
    fn those_of_the_tracker_agree_with_their_descriptions() {
        check::<crate::methods::tracking::TrackingParams>();
    }

    #[test]
    fn those_of_the_label_surfaces_agree_with_their_descriptions() {
        check::<crate::methods::label_surfaces::LabelParams>();
    }

    #[test]
    fn those_of_the_multiresolution_model_agree_with_their_descriptions() {
        check::<crate::methods::multires::MultiresParams>();
    }

    #[test]
    fn integers_have_no_fraction_and_no_sign() {
        for (number, expected) in [(3.0, Some(3)), (2.5, None), (-1.0, None), (5e9, None), (f64::NAN, None)] {
            assert_eq!(u32::from_input(&ParamInput::Number(number)), expected, "{number}");
        }
    }
}
