//! Reading of an NRRD header into fields, each a name and a text.

use super::FORMAT;
use crate::io::FormatError;
use crate::io::text::{Field, Lines};

/// Names of the fields of the NRRD standard, in lower case without spaces. A header with any other is an error, as the
/// standard requires.
const KNOWN: [&str; 31] = [
    "content",
    "number",
    "type",
    "blocksize",
    "dimension",
    "space",
    "spacedimension",
    "sizes",
    "spacings",
    "thicknesses",
    "axismins",
    "axismaxs",
    "centers",
    "centerings",
    "labels",
    "units",
    "kinds",
    "min",
    "max",
    "oldmin",
    "oldmax",
    "endian",
    "encoding",
    "lineskip",
    "byteskip",
    "datafile",
    "sampleunits",
    "spaceunits",
    "spaceorigin",
    "spacedirections",
    "measurementframe",
];

/// The fields of an NRRD header, with names in lower case without spaces.
pub(super) struct Fields {
    pairs: Vec<(String, String)>,
    /// First comment, which tells the program that wrote the file.
    comment: String,
    /// Whether there is a key that only ITK writes.
    has_itk_key: bool,
}

impl Fields {
    /// Reads the header fields up to the blank line, or to the end of a detached header.
    pub(super) fn read(lines: &mut Lines<'_>) -> Result<Self, FormatError> {
        let magic = lines.next_line()?.unwrap_or_default();
        if !matches!(magic.as_str(), "NRRD0001" | "NRRD0002" | "NRRD0003" | "NRRD0004" | "NRRD0005") {
            let shown: String = magic.chars().take(12).collect();
            return Err(FormatError::unsupported(
                FORMAT,
                "magic",
                format!("'{shown}'"),
                "NRRD0001 to NRRD0005",
            ));
        }
        let mut fields = Self { pairs: Vec::new(), comment: String::new(), has_itk_key: false };
        while let Some(line) = lines.next_line()? {
            if line.is_empty() {
                break;
            }
            if let Some(comment) = line.strip_prefix('#') {
                if fields.comment.is_empty() {
                    fields.comment = comment.trim().to_owned();
                }
            } else if fields.add(&line)? {
                break;
            }
        }
        Ok(fields)
    }

    /// Adds the field on one line; a `key:=value` line is ignored. Returns true if the field starts a list of data
    /// files, which takes up the rest of the header.
    fn add(&mut self, line: &str) -> Result<bool, FormatError> {
        let (name, value) = match (line.find(":="), line.find(": ")) {
            (Some(at), colon) if colon.is_none_or(|colon| at < colon) => {
                self.has_itk_key |= line.starts_with("ITK_");
                return Ok(false);
            }
            (_, Some(at)) => (&line[..at], &line[at + 2..]),
            _ if line.ends_with(':') => (&line[..line.len() - 1], ""),
            _ => {
                let shown: String = line.chars().take(40).collect();
                return Err(FormatError::invalid(
                    FORMAT,
                    "header",
                    format!("'{shown}' is not a 'field: value' line"),
                ));
            }
        };
        let key: String =
            name.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_ascii_lowercase()).collect();
        if !KNOWN.contains(&key.as_str()) {
            return Err(FormatError::invalid(FORMAT, name, "not a field of the format"));
        }
        if self.pairs.iter().any(|(known, _)| *known == key) {
            return Err(FormatError::invalid(FORMAT, name, "is given twice"));
        }
        let files = key == "datafile" && value.split_whitespace().next() == Some("LIST");
        self.pairs.push((key, value.trim().to_owned()));
        Ok(files)
    }

    /// Returns whether the file looks like one that a program of ITK wrote: by its keys, or by the comment of the library
    /// that ITK writes with, of an image of two or four dimensions, all of them in space and none of them named.
    pub(super) fn is_of_itk(&self) -> bool {
        let has = |key, text: &str| self.get(key).is_some_and(|field| field.text == text);
        let kinds = |rank| ["domain"; 4][..rank].join(" ");
        let is_plain = [(2, "2"), (4, "4")].into_iter().any(|(rank, text)| {
            has("dimension", text) && has("spacedimension", text) && has("kinds", &kinds(rank))
        });
        let of_teem = self.comment.starts_with("Complete NRRD file format specification");
        self.has_itk_key || is_plain && of_teem && self.get("spaceorigin").is_some()
    }

    /// Returns the header field with the name `key`; `None` if it is missing.
    pub(super) fn get(&self, key: &'static str) -> Option<Field<'_>> {
        let (_, text) = self.pairs.iter().find(|(name, _)| name == key)?;
        Some(Field { format: FORMAT, name: key, text })
    }

    /// Returns the header field with the name `key`; an error if it is missing.
    pub(super) fn need(&self, key: &'static str) -> Result<Field<'_>, FormatError> {
        self.get(key).ok_or_else(|| FormatError::invalid(FORMAT, key, "missing"))
    }
}
