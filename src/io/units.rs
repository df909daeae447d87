//! Lengths in volume files: names of units, and those that are missing.

use crate::volume::LengthUnit;
use crate::warning::{Warning, WarningCode};

/// Returns the metres in a unit of length, by its name or symbol; `None` if `name` is no known unit of length.
pub(super) fn metres(name: &str) -> Option<f64> {
    let symbol = match name.trim() {
        "m" => 1.0,
        "cm" => 1e-2,
        "mm" | "MM" => 1e-3,
        "um" | "\u{b5}m" | "\u{3bc}m" => 1e-6,
        "nm" => 1e-9,
        word => return metres_of_word(word),
    };
    Some(symbol)
}

/// Returns the metres in a unit of length by its name, in British or American spelling, singular or plural.
fn metres_of_word(word: &str) -> Option<f64> {
    let word = word.to_ascii_lowercase();
    let word = word.strip_suffix('s').unwrap_or(&word);
    if word == "micron" {
        return Some(1e-6);
    }
    match word.strip_suffix("meter").or_else(|| word.strip_suffix("metre"))? {
        "" => Some(1.0),
        "centi" => Some(1e-2),
        "milli" => Some(1e-3),
        "micro" => Some(1e-6),
        "nano" => Some(1e-9),
        _ => None,
    }
}

/// Returns the unit of this many metres; unknown if volumes do not have it.
pub(super) fn unit_of(metres: f64) -> LengthUnit {
    match metres {
        1.0 => LengthUnit::Metre,
        1e-3 => LengthUnit::Millimetre,
        1e-6 => LengthUnit::Micrometre,
        _ => LengthUnit::Unknown,
    }
}

/// Returns the warning that a single slice along an axis, to which the file gives no thickness, has one of 1.
pub(super) fn thickness_warning(axis: usize) -> Warning {
    let name = ["x", "y", "z"].get(axis).unwrap_or(&"time");
    let text = format!("The file gives no thickness of the single slice along {name}; 1 was assumed.");
    Warning::new(WarningCode::Reader, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn names_and_symbols_in_their_spellings() {
        let unit = |name| metres(name).map(unit_of);
        for name in ["mm", "MM", "millimeter", "Millimetres"] {
            assert_eq!(unit(name), Some(LengthUnit::Millimetre), "{name}");
        }
        for name in ["um", "\u{b5}m", "\u{3bc}m", "micron", "microns", "Micrometer", "micrometres"] {
            assert_eq!(unit(name), Some(LengthUnit::Micrometre), "{name}");
        }
        for name in ["m", "metre", "Meters"] {
            assert_eq!(unit(name), Some(LengthUnit::Metre), "{name}");
        }
        assert_eq!((unit("cm"), unit("nm")), (Some(LengthUnit::Unknown), Some(LengthUnit::Unknown)));
        for name in ["", "M", "s", "ms", "pixel", "?"] {
            assert_eq!(unit(name), None, "{name}");
        }
    }
}
