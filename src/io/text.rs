//! Lines of text files, and headers that consist of lines of text.

use super::FormatError;
use super::beside::DataFiles;
use std::iter;

/// Returns the lines of a file with their numbers from 1, without line endings (\n, \r\n or \r).
pub(super) fn numbered_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut rest = bytes;
    let lines = iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
        let (line, after) = rest.split_at(end);
        let ended = if after.starts_with(b"\r\n") { 2 } else { after.len().min(1) };
        rest = &after[ended..];
        Some(line)
    });
    (1..).zip(lines)
}

/// Maximum length of the text header of a volume file, in bytes; real ones have a few kilobytes.
const MAX_HEADER: usize = 1 << 20;

/// Iterator over the lines of a volume file's text header, which then gives access to the bytes after it.
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Returns the next line without its ending (\n or \r\n); `None` at the end of the file or at the maximum length of
    /// a header.
    pub(super) fn next_line(&mut self) -> Option<String> {
        let end = if self.bytes.len() < MAX_HEADER { self.bytes.len() } else { MAX_HEADER };
        let rest = self.bytes.get(self.at..end).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += length + 1;
        Some(String::from_utf8_lossy(&rest[..length]).trim_end_matches('\r').to_owned())
    }

    /// Returns the names of data files on the lines that follow, one on each; `field` starts the list.
    ///
    /// # Errors
    /// No names, or a list beyond the maximum length of a header.
    pub(super) fn names(&mut self, field: &Field<'_>) -> Result<DataFiles, FormatError> {
        let mut names = Vec::new();
        while let Some(line) = self.next_line() {
            let name = line.trim();
            if !name.is_empty() {
                names.push(name.to_owned());
            }
        }
        let problem = match names.is_empty() {
            true => "must be followed by the names of files",
            false if self.at < self.bytes.len() => "has too many files",
            false => return Ok(DataFiles::Names(names)),
        };
        Err(field.invalid(problem))
    }

    /// Returns the bytes after the header lines read so far, where the voxels start.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or(&[])
    }
}

/// The text of a header field, with its format and name for error messages.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub(super) format: &'static str,
    pub(super) name: &'a str,
    pub(super) text: &'a str,
}

impl Field<'_> {
    /// Returns an error about this field that quotes its text.
    pub(super) fn invalid(&self, problem: &str) -> FormatError {
        let shown: String = self.text.chars().take(60).collect();
        FormatError::invalid(self.format, self.name, format!("'{shown}': {problem}"))
    }

    /// Parses the field as `count` numbers separated by whitespace; NaN and infinities are accepted.
    ///
    /// # Errors
    /// A word that is not a number; a number of words other than `count`.
    pub(super) fn numbers(&self, count: usize) -> Result<Vec<f64>, FormatError> {
        let words: Result<Vec<f64>, _> = self.text.split_whitespace().map(str::parse).collect();
        words
            .ok()
            .filter(|v| v.len() == count)
            .ok_or_else(|| self.invalid(&format!("must be {count} numbers")))
    }

    /// Parses the field as `count` finite numbers separated by whitespace.
    ///
    /// # Errors
    /// As [`numbers`](Self::numbers), and numbers that are not finite.
    pub(super) fn finite(&self, count: usize) -> Result<Vec<f64>, FormatError> {
        let values = self.numbers(count)?;
        if values.iter().all(|v| v.is_finite()) { Ok(values) } else { Err(self.invalid("must be finite")) }
    }

    /// Parses the first `count` of the field's numbers, which must all be finite.
    ///
    /// # Errors
    /// Fewer numbers; a word that is not a finite number.
    pub(super) fn finite_first(&self, count: usize) -> Result<Vec<f64>, FormatError> {
        let found = self.text.split_whitespace().count();
        let mut values = self.finite(count.max(found))?;
        values.truncate(count);
        Ok(values)
    }

    /// Parses the field as `count` positive integers separated by whitespace.
    ///
    /// # Errors
    /// A number of words other than `count`, a 0, a word that is not an integer, or a size that cannot be addressed.
    pub(super) fn sizes(&self, count: usize) -> Result<Vec<usize>, FormatError> {
        let words: Result<Vec<u64>, _> = self.text.split_whitespace().map(str::parse).collect();
        let fits = |v: &Vec<u64>| v.len() == count && !v.contains(&0);
        let sizes = words.ok().filter(fits);
        let sizes = sizes.ok_or_else(|| self.invalid(&format!("must be {count} integers of at least 1")))?;
        let needed = sizes.iter().fold(1u64, |product, &n| product.saturating_mul(n));
        let counted: Result<Vec<usize>, _> = sizes.into_iter().map(usize::try_from).collect();
        counted.map_err(|_| FormatError::too_large(self.format, self.name, needed))
    }

    /// Parses the field as a single integer of at least `least`.
    ///
    /// # Errors
    /// Any other text.
    pub(super) fn integer(&self, least: i64) -> Result<i64, FormatError> {
        let value = self.text.trim().parse().ok().filter(|&v| v >= least);
        value.ok_or_else(|| self.invalid(&format!("must be an integer of at least {least}")))
    }

    /// Parses the field as a single non-negative integer, an offset into a file; an offset beyond `usize` becomes the
    /// largest `usize`, which is past the end of any file.
    ///
    /// # Errors
    /// Any other text.
    pub(super) fn offset(&self) -> Result<usize, FormatError> {
        Ok(usize::try_from(self.integer(0)?).unwrap_or(usize::MAX))
    }
}
