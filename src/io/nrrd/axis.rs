//! Reading of the fields of an NRRD header that describe its axes.

use super::FORMAT;
use super::fields::Fields;
use super::world::{Vector, World};
use crate::io::FormatError;
use crate::io::text::Field;

/// Supported kinds of axes of an NRRD, listed in error messages.
pub(super) const KINDS: &str =
    "domain or space for axes in space, list or time for the frame axis, RGB-color of 3 or RGBA-color of 4";

/// One axis of an NRRD, as described by the header.
pub(super) struct Axis {
    pub(super) size: usize,
    pub(super) kind: AxisKind,
    /// Distance between samples along the axis, from `spacings`, in `unit`; NaN if it is unknown.
    pub(super) spacing: f64,
    /// Positions of the ends of the axis, from `axis mins` and `axis maxs`; NaN if they are unknown.
    pub(super) ends: [f64; 2],
    /// Whether samples are at the ends of the axis, and not in the middle of cells between them; `None` if it is unknown.
    pub(super) is_node: Option<bool>,
    /// Unit of the spacing, such as `mm` or `s`; empty if the header gives none.
    pub(super) unit: String,
    pub(super) direction: Option<Vector>,
}

impl Axis {
    /// Returns whether the axis has a single slice, and the file gives it no thickness.
    pub(super) fn is_thin(&self) -> bool {
        let length = self.direction.map_or(self.spacing, |direction| direction.space.length());
        self.size == 1 && length == 0.0
    }
}

/// Kind of an NRRD axis; the later a kind is in this order, the less likely is the axis to be spatial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum AxisKind {
    Space,
    Domain,
    Unknown,
    List,
    Time,
    /// The numbers of a colour, side by side or not.
    Colour,
}

impl AxisKind {
    /// Returns whether an axis of this kind counts frames.
    pub(super) fn counts_frames(self) -> bool {
        matches!(self, AxisKind::List | AxisKind::Time)
    }
}

/// Reads all axes of an NRRD from its header, in the order of the file.
pub(super) fn axes(fields: &Fields, world: &World) -> Result<Vec<Axis>, FormatError> {
    let rank = rank(&fields.need("dimension")?)?;
    let sizes = fields.need("sizes")?.sizes(rank)?;
    let kinds = kinds(fields, &sizes)?;
    let spacings = numbers(fields, "spacings", rank)?;
    let (mins, maxs) = (numbers(fields, "axismins", rank)?, numbers(fields, "axismaxs", rank)?);
    let centers = fields.get("centers").or_else(|| fields.get("centerings"));
    let mut centers = centers.map_or("", |field| field.text).split_whitespace();
    let mut units = words(fields, "units").into_iter();
    let mut directions = directions(fields, world, &kinds)?.into_iter();
    let axis = |(i, size)| Axis {
        size,
        kind: kinds[i],
        spacing: spacings[i],
        ends: [mins[i], maxs[i]],
        is_node: is_node(centers.next().unwrap_or_default()),
        unit: units.next().unwrap_or_default(),
        direction: directions.next().flatten(),
    };
    Ok(sizes.into_iter().enumerate().map(axis).collect())
}

/// Returns the number of each axis in a field; NaN if the header lacks the field.
fn numbers(fields: &Fields, key: &'static str, rank: usize) -> Result<Vec<f64>, FormatError> {
    fields.get(key).map_or_else(|| Ok(vec![f64::NAN; rank]), |field| field.numbers(rank))
}

/// Returns whether a word of the field `centers` says that samples are at the ends of an axis; `None` if it says nothing.
fn is_node(word: &str) -> Option<bool> {
    match word.to_ascii_lowercase().as_str() {
        "node" => Some(true),
        "cell" => Some(false),
        _ => None,
    }
}

/// Returns the number of axes of an NRRD from the field `dimension`; an error unless it is 1 to 4.
fn rank(field: &Field<'_>) -> Result<usize, FormatError> {
    match field.integer(1)? {
        n @ 1..=4 => Ok(n as usize),
        n => Err(FormatError::unsupported(FORMAT, "dimension", n.to_string(), "1 to 4")),
    }
}

/// Returns the double-quoted words of the field `key`; none if the header lacks the field.
pub(super) fn words(fields: &Fields, key: &'static str) -> Vec<String> {
    let text = fields.get(key).map_or("", |field| field.text);
    text.split('"').skip(1).step_by(2).map(|word| word.trim().to_owned()).collect()
}

/// Returns the kind of each axis; an error if one holds the components of a voxel other than colours, or if two count
/// frames or hold colours.
fn kinds(fields: &Fields, sizes: &[usize]) -> Result<Vec<AxisKind>, FormatError> {
    let Some(field) = fields.get("kinds") else { return Ok(vec![AxisKind::Unknown; sizes.len()]) };
    let words: Vec<&str> = field.text.split_whitespace().collect();
    if words.len() != sizes.len() {
        return Err(field.invalid(&format!("must have {} kinds", sizes.len())));
    }
    let kinds: Result<Vec<AxisKind>, _> =
        words.iter().zip(sizes).enumerate().map(|(axis, (word, &size))| kind(axis, word, size)).collect();
    let kinds = kinds?;
    if kinds.iter().filter(|kind| kind.counts_frames()).count() > 1 {
        return Err(field.invalid("at most one axis may count frames"));
    }
    if kinds.iter().filter(|&&kind| kind == AxisKind::Colour).count() > 1 {
        return Err(field.invalid("at most one axis may hold colours"));
    }
    Ok(kinds)
}

/// Returns the kind of an axis that a word of the header names; an error for kinds that hold the components of a voxel other
/// than colours.
fn kind(axis: usize, word: &str, size: usize) -> Result<AxisKind, FormatError> {
    match word.to_ascii_lowercase().as_str() {
        "space" => Ok(AxisKind::Space),
        "domain" => Ok(AxisKind::Domain),
        "none" | "???" | "unknown" => Ok(AxisKind::Unknown),
        "list" => Ok(AxisKind::List),
        // A placeholder for an axis with a single frame.
        "stub" | "scalar" if size == 1 => Ok(AxisKind::List),
        "time" => Ok(AxisKind::Time),
        "rgb-color" | "3-color" if size == 3 => Ok(AxisKind::Colour),
        "rgba-color" | "4-color" if size == 4 => Ok(AxisKind::Colour),
        _ => {
            let found = format!("'{word}' for axis {axis}, more than one number per voxel,");
            Err(FormatError::unsupported(FORMAT, "kinds", found, KINDS))
        }
    }
}

/// Returns the direction of each axis, `None` for an axis without one; an empty list if the file has no directions.
fn directions(
    fields: &Fields,
    world: &World,
    kinds: &[AxisKind],
) -> Result<Vec<Option<Vector>>, FormatError> {
    let Some(field) = fields.get("spacedirections") else { return Ok(Vec::new()) };
    let vectors = vectors(&field, world)?;
    if vectors.len() != kinds.len() {
        return Err(field.invalid(&format!("must have {} entries", kinds.len())));
    }
    let stated = |(vector, &kind): (Option<Vector>, &AxisKind)| {
        let none = |v: &Vector| v.is_unknown() || v.is_zero() && zero_means_none(kind, kinds.len());
        vector.filter(|v| !none(v))
    };
    Ok(vectors.into_iter().zip(kinds).map(stated).collect())
}

/// Returns whether a zero direction marks an axis of this kind as not spatial, in a file of `rank` axes. With three
/// axes, zero may also mean that the distance of the slices was unknown; such a file has no position in world space.
fn zero_means_none(kind: AxisKind, rank: usize) -> bool {
    kind >= AxisKind::List || rank == 4 && kind != AxisKind::Space
}

/// Reads the vectors of a header field, one per axis; `None` for an axis with the word `none`.
fn vectors(field: &Field<'_>, world: &World) -> Result<Vec<Option<Vector>>, FormatError> {
    // Spaces inside the parentheses are allowed: a vector ends at its ')'.
    let mut entries = Vec::new();
    let mut rest = field.text.trim();
    while !rest.is_empty() {
        let end = if rest.starts_with('(') {
            rest.find(')').map(|at| at + 1).ok_or_else(|| field.invalid("a ')' is missing"))?
        } else {
            rest.find(char::is_whitespace).unwrap_or(rest.len())
        };
        entries.push(world.vector(field, &rest[..end])?);
        rest = rest[end..].trim_start();
    }
    Ok(entries)
}
