//! The world space of an NRRD: its name, and the vectors in the header, with as many components as the space has
//! dimensions.

use super::FORMAT;
use super::fields::Fields;
use crate::io::FormatError;
use crate::io::text::Field;
use crate::math::DVec3;
use crate::volume::Space;
use crate::warning::{Warning, WarningCode};

const SPACES: &str = "right-anterior-superior, left-anterior-superior, left-posterior-superior, scanner-xyz, \
                      3D-right-handed, 3D-left-handed, each also with -time";

/// The world space of an NRRD: that which the header names, which the caller has chosen, or which was assumed.
pub(super) struct World {
    pub(super) space: Space,
    /// Name that the file gives to a space that does not tell how its axes lie; empty without one. `None` if the space is
    /// known, or is of no consequence.
    pub(super) assumed: Option<String>,
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
    /// Reads the world space of an NRRD from the header; if that does not tell how its axes lie, they are those of
    /// `chosen`, or of LPS, as in ITK. Files without a position in space are in RAS.
    pub(super) fn read(fields: &Fields, chosen: Option<Space>) -> Result<Self, FormatError> {
        let field = fields.get("space");
        let (oriented, has_time) = match &field {
            Some(field) => parse_space(field)?,
            None => (None, false),
        };
        let dimension = match &field {
            Some(_) => Some(if has_time { 4 } else { 3 }),
            None => fields.get("spacedimension").map(|field| dimension(&field)).transpose()?,
        };
        let is_placed = fields.get("spacedirections").is_some() || fields.get("spaceorigin").is_some();
        let (space, flip_x) = match oriented {
            Some(known) => known,
            None => (chosen.unwrap_or(if is_placed { Space::Lps } else { Space::Ras }), false),
        };
        let is_assumed = oriented.is_none() && chosen.is_none() && is_placed && !fields.is_of_itk();
        let assumed = is_assumed.then(|| field.map_or("", |field| field.text).to_owned());
        Ok(Self { space, assumed, flip_x, has_time, dimension })
    }

    /// Returns a warning if the file does not tell how the axes of the world lie.
    pub(super) fn warning(&self) -> Option<Warning> {
        let named = match self.assumed.as_deref()? {
            "" => "The file does not name the space of its coordinates".to_owned(),
            name => format!(
                "The space '{}' does not tell how its axes lie in a body",
                name.chars().take(40).collect::<String>()
            ),
        };
        let text = format!(
            "{named}. They were taken as left-posterior-superior (LPS), as ITK does; if they are RAS, the volume is turned by 180°. \
             Choose the space when the file is read."
        );
        Some(Warning::new(WarningCode::Reader, text))
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

/// An orientation of the world axes, and whether the sign of x must be flipped to convert to it.
type Oriented = (Space, bool);

/// Parses the name of an NRRD world space: its orientation, if the name tells it, and whether it has time. It may have
/// spaces or nothing in place of hyphens, or be abbreviated, as RAST for right-anterior-superior-time.
fn parse_space(field: &Field<'_>) -> Result<(Option<Oriented>, bool), FormatError> {
    let letters = field.text.chars().filter(|&c| c != '-' && !c.is_whitespace());
    let name: String = letters.map(|c| c.to_ascii_lowercase()).collect();
    let untimed = name.strip_suffix("time").or_else(|| name.strip_suffix('t'));
    let oriented = match untimed.unwrap_or(&name) {
        "rightanteriorsuperior" | "ras" => Some((Space::Ras, false)),
        "leftanteriorsuperior" | "las" => Some((Space::Ras, true)),
        "leftposteriorsuperior" | "lps" => Some((Space::Lps, false)),
        "scannerxyz" | "3drighthanded" | "3dlefthanded" => None,
        _ => {
            let found = format!("'{}'", field.text);
            return Err(FormatError::unsupported(FORMAT, "space", found, SPACES));
        }
    };
    Ok((oriented, untimed.is_some()))
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
        let facts = |text| parse_space(&field("space", text)).unwrap();
        for text in ["right-anterior-superior", "Right Anterior Superior", "rightanteriorsuperior", "RAS"] {
            assert_eq!(facts(text), (Some((Space::Ras, false)), false), "{text}");
        }
        for text in ["left-anterior-superior-time", "leftanteriorsuperiortime", "LAST"] {
            assert_eq!(facts(text), (Some((Space::Ras, true)), true), "{text}");
        }
        assert_eq!(facts("left-posterior-superior-time"), (Some((Space::Lps, false)), true));
        for text in ["scanner-xyz-time", "scanner-xyzt", "3D-right-handed-time", "3D-left-handed-time"] {
            assert_eq!(facts(text), (None, true), "{text}");
        }
        for text in ["", "time", "t", "left", "superior-anterior-right"] {
            assert!(parse_space(&field("space", text)).is_err(), "{text}");
        }
    }

    #[test]
    fn vectors_have_the_dimension_of_the_space() {
        let read = |world: &World, text| world.vector(&field("space origin", text), text);
        let world =
            |dimension| World { space: Space::Ras, assumed: None, flip_x: false, has_time: false, dimension };
        let has_time = world(Some(4));
        let found = Vector { space: DVec3::new(1.0, 2.0, -3.0), time: 0.5 };
        assert_eq!(read(&has_time, "( 1, 2,-3e0, .5 )"), Ok(Some(found)));
        assert_eq!(read(&has_time, "none"), Ok(None));
        let still = world(Some(3));
        for (world, text) in
            [(&has_time, "(1,2,3)"), (&still, "(1,2,3,4)"), (&still, "(1,2)"), (&still, "(1,,3)")]
        {
            assert!(read(world, text).is_err(), "{text}");
        }
        let unknown = world(None);
        for (text, fits) in [("(1)", false), ("(1,2)", true), ("(1,2,3,4)", true), ("(1,2,3,4,5)", false)] {
            assert_eq!(read(&unknown, text).is_ok(), fits, "{text}");
        }
    }
}
