//! Parameters of the methods: each is declared once, by [`parameters!`], with its type, default, range and texts.
//!
//! From the declaration come the struct, its default, the descriptions for user interfaces and the check of ranges.

use super::{MethodError, ParamDefault, ParamKind, ParamSpec};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The parameters of a method. Implemented by the macro that declares them.
pub trait Parameters: Clone + Default + PartialEq + Serialize + DeserializeOwned {
    /// Returns the description of each parameter, in the order of the fields, in which a user interface should show
    /// them.
    fn specs() -> Vec<ParamSpec>;

    /// Returns the value of each parameter as a number, in the order of [`Self::specs`]; `None` for words and Booleans.
    fn numbers(&self) -> Vec<Option<f64>>;

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

/// A type of parameters: a number, a Boolean, or an enum declared by [`choices!`].
pub(super) trait ParamType {
    /// The type as user interfaces know it.
    const KIND: ParamKind;

    /// The words that the type accepts, if it is a choice.
    const CHOICES: Option<&'static [&'static str]> = None;

    /// Returns the value as the default of a parameter.
    fn as_default(&self) -> ParamDefault;

    /// Returns the value if it is a number, which has to be in the range of its parameter.
    fn number(&self) -> Option<f64> {
        None
    }
}

impl ParamType for f64 {
    const KIND: ParamKind = ParamKind::Number;

    fn as_default(&self) -> ParamDefault {
        ParamDefault::Number(*self)
    }

    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl ParamType for u32 {
    const KIND: ParamKind = ParamKind::Integer;

    fn as_default(&self) -> ParamDefault {
        ParamDefault::Number(f64::from(*self))
    }

    fn number(&self) -> Option<f64> {
        Some(f64::from(*self))
    }
}

impl ParamType for bool {
    const KIND: ParamKind = ParamKind::Boolean;

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

            fn as_default(&self) -> $crate::methods::ParamDefault {
                $crate::methods::ParamDefault::Choice(match self {
                    $(Self::$Variant => $word,)*
                })
            }
        }
    };
}

pub(super) use {choices, parameters};
