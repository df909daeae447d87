//! Names of units of length in volume files.

use crate::volume::LengthUnit;

/// Returns the metres in a unit of length, by its name or symbol; `None` if `name` is no known unit of length.
pub(super) fn metres(name: &str) -> Option<f64> {
    let name = name.trim();
    if name == "m" {
        return Some(1.0);
    }
    let lower = name.to_lowercase();
    // British and American spelling, singular and plural.
    let lower = lower.strip_suffix('s').unwrap_or(&lower).replace("metre", "meter");
    match lower.as_str() {
        "meter" => Some(1.0),
        "cm" | "centimeter" => Some(1e-2),
        "mm" | "millimeter" => Some(1e-3),
        "um" | "\u{b5}m" | "\u{3bc}m" | "micron" | "micrometer" => Some(1e-6),
        "nm" | "nanometer" => Some(1e-9),
        "\u{e5}" | "angstrom" | "\u{e5}ngstr\u{f6}m" => Some(1e-10),
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
