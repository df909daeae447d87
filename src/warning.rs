//! Warnings: results that are given, but that a user should know something about before relying on them.
//!
//! A result is right, or it is refused with an error, or it carries a [`Warning`]. Volumes and reports hold theirs, and
//! user interfaces show them beside the result.

use serde::Serialize;

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

/// The kinds of warnings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WarningCode {
    /// A part of the surface ends in this frame: there is no object in the image from here on.
    EndsInFrame,
    /// A part of the surface begins in this frame: there was no object in the image before.
    BeginsInFrame,
    /// The intensity step at the surface differs so much from that in the frames around it that the surface may be off.
    UnevenBrightness,
    /// The object is so small that its volume is uncertain.
    SmallObject,
    /// A label is so thin that the volume of its surface is not that of its voxels.
    ThinLabel,
    /// Positions or intensities are rounded more than the result should suffer.
    Precision,
    /// The surface was moved towards the origin, since where it is it could not be represented.
    Recentred,
    /// Voxels of the volume are far longer along one axis than along the others, so that the shape between the slices is a
    /// guess.
    Anisotropic,
}
