//! Warnings: results that are given, but that a user should know something about before relying on them.
//!
//! A result is right, or it is refused with an error, or it carries a [`Warning`]. Volumes and reports hold theirs, and
//! user interfaces show them beside the result.

use serde::{Serialize, Serializer};

/// Something that a user should know about a volume or a result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Warning {
    /// The kind of warning, by which programs can distinguish them.
    pub code: WarningCode,
    /// The warning in words: what was found, what was done, and what can be done about it.
    pub text: String,
    /// The part of the data that is concerned, if it is not all of it.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}

impl Warning {
    /// Creates a warning about all of the data.
    pub fn new(code: WarningCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into(), place: None }
    }

    /// Creates a warning about a part of the data.
    pub fn at(code: WarningCode, place: Place, text: impl Into<String>) -> Self {
        Self { place: Some(place), ..Self::new(code, text) }
    }
}

/// The part of the data that a warning concerns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub enum Place {
    /// A frame of a sequence, the first being 0.
    Frame(u32),
    /// A label of a label map, by its value.
    Label(f64),
    /// A point in world coordinates.
    Point([f64; 3]),
}

/// Declares the kinds of warnings, each with the name that programs know it by.
macro_rules! codes {
    ($($(#[$doc:meta])* $Code:ident = $name:literal,)*) => {
        /// The kinds of warnings.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum WarningCode {
            $($(#[$doc])* $Code,)*
        }

        impl WarningCode {
            /// All kinds of warnings.
            pub const ALL: &[Self] = &[$(Self::$Code),*];

            /// Returns the name that programs know the kind by.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Code => $name,)*
                }
            }
        }
    };
}

codes! {
    /// A part of the surface ends in this frame: there is no object in the image from here on.
    EndsInFrame = "ends-in-frame",
    /// A part of the surface begins in this frame: there was no object in the image before.
    BeginsInFrame = "begins-in-frame",
    /// The intensity step at the surface differs so much from that in other frames that the surface may be off.
    UnevenBrightness = "uneven-brightness",
    /// The object is so small or thin, or extends over so few thick slices, that its volume is uncertain.
    SmallObject = "small-object",
    /// The box in which the surface is tracked cuts the object.
    TouchesBox = "touches-box",
    /// The surface has handles, which most objects do not have.
    Handles = "handles",
    /// The image shows no boundary at much of the surface.
    NoBoundary = "no-boundary",
    /// A handle stopped before its target, since the surface around it would have folded up.
    HandleStopped = "handle-stopped",
    /// The given surface intersects itself, and goes on to.
    SelfIntersecting = "self-intersecting",
    /// The volume in this frame differs too much from those of the frames beside it.
    VolumeJump = "volume-jump",
    /// A label is so thin that the volume of its surface is not that of its voxels.
    ThinLabel = "thin-label",
    /// Parts of the surface, or gaps between them, are so thin that the points hardly tell them apart: topology and volume
    /// may be wrong.
    ThinParts = "thin-parts",
    /// The surface has not as many parts as the object.
    Parts = "parts",
    /// The normals that were given point inwards: inside and outside are exchanged.
    InwardNormals = "inward-normals",
    /// A few points are so far from the others that these are a small part of the box: cells are too large for the object.
    Outliers = "outliers",
    /// Positions or intensities are rounded more than the result should suffer.
    Precision = "precision",
    /// The surface was moved towards the origin, since where it is it could not be represented.
    Recentred = "recentred",
    /// Voxels of the volume are far longer along one axis than along the others: the shape between the slices is a guess.
    Anisotropic = "anisotropic",
    /// Something that the reader of the file noticed: an assumption that it made, or a part that it left out.
    Reader = "reader",
}

impl WarningCode {
    /// Returns the kind of this name; `None` if there is none.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|code| code.name() == name)
    }
}

impl Serialize for WarningCode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn each_kind_of_warning_has_a_name_of_its_own() {
        for &code in WarningCode::ALL {
            assert_eq!(WarningCode::named(code.name()), Some(code));
        }
        assert_eq!(WarningCode::named("Reader"), None);
    }
}
