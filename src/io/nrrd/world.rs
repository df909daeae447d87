//! The world space of an NRRD: its name, and the vectors in the header, with as many components as the space has
//! dimensions.

use super::FORMAT;
use super::fields::Fields;
use crate::io::FormatError;
use crate::io::text::Field;
use crate::math::DVec3;
use crate::volume::Space;

const SPACES: &str = "right-anterior-superior, left-anterior-superior, left-posterior-superior, scanner-xyz, \
                      3D-right-handed, 3D-left-handed, each also with -time";

/// The world space of an NRRD: named in the header, or RAS if the header only gives its dimension or nothing.
pub(super) struct World {
    pub(super) space: Space,
    /// Whether the sign of x must be flipped to convert the file's coordinates to `space`.
    pub(super) flip_x: bool,
    /// Whether the name of the space declares time as its fourth dimension.
    pub(super) has_time: bool,
    /// Number of components that each vector in the header must have, if the header tells.
    dimension: Option<usize>,
}

/// A vector of an NRRD header in world space and time; components that the file does not give are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vector {
    pub(super) space: DVec3,
    pub(super) time: f64,
}

impl World {
    /// Reads the world space of an NRRD from the header; RAS if the header names none.
    pub(super) fn read(fields: &Fields) -> Result<Self, FormatError> {
        match fields.get("space") {
            Some(field) => parse_space(&field),
            None => {
                let dimension = fields.get("spacedimension").map(|field| dimension(&field)).transpose()?;
                Ok(Self { space: Space::Ras, flip_x: false, has_time: false, dimension })
            }
        }
    }

    /// Parses a vector of two to four numbers such as `(x,y,z)` or `(x,y,z,t)`; `None` for the word `none`, which
    /// stands for a missing vector.
    pub(super) fn vector(&self, field: &Field<'_>, text: &str) -> Result<Option<Vector>, FormatError> {
        let text = text.trim();
        if text == "none" {
            return Ok(None);
        }
        let inner = text.strip_prefix('(').and_then(|t| t.strip_suffix(')'));
        let numbers: Option<Vec<f64>> =
            inner.and_then(|t| t.split(',').map(|word| word.trim().parse().ok()).collect());
        let numbers = numbers.ok_or_else(|| field.invalid("must be vectors such as (1,0,0)"))?;
        if self.dimension.is_some_and(|n| n != numbers.len()) {
            return Err(field.invalid("vectors must have as many numbers as the space has dimensions"));
        }
        match numbers[..] {
            [x, y] => Ok(Some(Vector { space: DVec3::new(x, y, 0.0), time: 0.0 })),
            [x, y, z] => Ok(Some(Vector { space: DVec3::new(x, y, z), time: 0.0 })),
            [x, y, z, time] => Ok(Some(Vector { space: DVec3::new(x, y, z), time })),
            _ => {
                let found = format!("'{text}'");
                Err(FormatError::unsupported(FORMAT, field.name, found, "vectors of two to four numbers"))
            }
        }
    }
}

impl Vector {
    /// Returns whether the spatial components are all NaN, which means the same as the word `none`: a missing vector.
    pub(super) fn is_unknown(&self) -> bool {
        self.space.is_nan_mask().all()
    }

    pub(super) fn is_zero(&self) -> bool {
        self.space == DVec3::ZERO && self.time == 0.0
    }
}

/// Parses the name of an NRRD world space. It may have spaces or nothing in place of hyphens, or be abbreviated, as
/// RAST for right-anterior-superior-time.
fn parse_space(field: &Field<'_>) -> Result<World, FormatError> {
    let letters = field.text.chars().filter(|&c| c != '-' && !c.is_whitespace());
    let name: String = letters.flat_map(char::to_lowercase).collect();
    let untimed = name.strip_suffix("time").or_else(|| name.strip_suffix('t'));
    let (space, flip_x) = match untimed.unwrap_or(&name) {
        "rightanteriorsuperior" | "ras" => (Space::Ras, false),
        "leftanteriorsuperior" | "las" => (Space::Ras, true),
        "leftposteriorsuperior" | "lps" => (Space::Lps, false),
        "scannerxyz" | "3drighthanded" | "3dlefthanded" => (Space::Ras, false),
        _ => {
            let found = format!("'{}'", field.text);
            return Err(FormatError::unsupported(FORMAT, "space", found, SPACES));
        }
    };
    let has_time = untimed.is_some();
    Ok(World { space, flip_x, has_time, dimension: Some(if has_time { 4 } else { 3 }) })
}

/// Returns the dimension of the world space from the field `space dimension`; an error unless it is 2 to 4.
fn dimension(field: &Field<'_>) -> Result<usize, FormatError> {
    match field.integer(1)? {
        n @ 2..=4 => Ok(n as usize),
        n => Err(FormatError::unsupported(FORMAT, "space dimension", n.to_string(), "2 to 4")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn field<'a>(name: &'a str, text: &'a str) -> Field<'a> {
        Field { format: FORMAT, name, text }
    }

    #[test]
    fn names_in_all_their_spellings() {
        let facts =
            |text| parse_space(&field("space", text)).map(|w| (w.space, w.flip_x, w.has_time)).unwrap();
        for text in ["right-anterior-superior", "Right Anterior Superior", "rightanteriorsuperior", "RAS"] {
            assert_eq!(facts(text), (Space::Ras, false, false), "{text}");
        }
        for text in ["left-anterior-superior-time", "leftanteriorsuperiortime", "LAST"] {
            assert_eq!(facts(text), (Space::Ras, true, true), "{text}");
        }
        assert_eq!(facts("left-posterior-superior-time"), (Space::Lps, false, true));
        for text in ["scanner-xyz-time", "scanner-xyzt", "3D-right-handed-time", "3D-left-handed-time"] {
            assert_eq!(facts(text), (Space::Ras, false, true), "{text}");
        }
        for text in ["", "time", "t", "left", "superior-anterior-right"] {
            assert!(parse_space(&field("space", text)).is_err(), "{text}");
        }
    }

    #[test]
    fn vectors_have_the_dimension_of_the_space() {
        let read = |world: &World, text| world.vector(&field("space origin", text), text);
        let has_time = parse_space(&field("space", "RAST")).unwrap();
        let found = Vector { space: DVec3::new(1.0, 2.0, -3.0), time: 0.5 };
        assert_eq!(read(&has_time, "( 1, 2,-3e0, .5 )"), Ok(Some(found)));
        assert_eq!(read(&has_time, "none"), Ok(None));
        let still = parse_space(&field("space", "RAS")).unwrap();
        for (world, text) in
            [(&has_time, "(1,2,3)"), (&still, "(1,2,3,4)"), (&still, "(1,2)"), (&still, "(1,,3)")]
        {
            assert!(read(world, text).is_err(), "{text}");
        }
        let unknown = World { space: Space::Ras, flip_x: false, has_time: false, dimension: None };
        for (text, fits) in [("(1)", false), ("(1,2)", true), ("(1,2,3,4)", true), ("(1,2,3,4,5)", false)] {
            assert_eq!(read(&unknown, text).is_ok(), fits, "{text}");
        }
    }
}
