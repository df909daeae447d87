//! Headers that are lines of text, and lines of whole files of text.

use super::FormatError;
use std::iter;

/// The lines of a file with their numbers from 1, without their ends (\n, \r\n or \r).
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

/// Longest line and longest header taken; real ones have a few kilobytes.
const MAX_HEADER: usize = 1 << 20;

/// The lines of a header one by one, and what follows them.
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// The next line without its end (\n or \r\n), or `None` at the end of the file or of what a header may hold.
    pub(super) fn next_line(&mut self) -> Option<String> {
        let end = if self.bytes.len() < MAX_HEADER { self.bytes.len() } else { MAX_HEADER };
        let rest = self.bytes.get(self.at..end).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += length + 1;
        Some(String::from_utf8_lossy(&rest[..length]).trim_end_matches('\r').to_owned())
    }

    /// Everything after the lines read so far.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or(&[])
    }
}

/// One field's text, with its place for messages.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub(super) format: &'static str,
    pub(super) name: &'a str,
    pub(super) text: &'a str,
}

impl Field<'_> {
    /// An error about this field that quotes it.
    pub(super) fn invalid(&self, problem: &str) -> FormatError {
        let shown: String = self.text.chars().take(60).collect();
        FormatError::invalid(self.format, self.name, format!("'{shown}': {problem}"))
    }

    /// Numbers set apart by blanks, NaN included.
    ///
    /// # Errors
    /// A word that is no number; another count than `count`.
    pub(super) fn numbers(&self, count: usize) -> Result<Vec<f64>, FormatError> {
        let words: Result<Vec<f64>, _> = self.text.split_whitespace().map(str::parse).collect();
        words
            .ok()
            .filter(|v| v.len() == count)
            .ok_or_else(|| self.invalid(&format!("{count} numbers are needed")))
    }

    /// Numbers, all of them finite.
    ///
    /// # Errors
    /// As [`numbers`](Self::numbers).
    pub(super) fn finite(&self, count: usize) -> Result<Vec<f64>, FormatError> {
        let values = self.numbers(count)?;
        if values.iter().all(|v| v.is_finite()) {
            Ok(values)
        } else {
            Err(self.invalid("finite numbers are needed"))
        }
    }

    /// Whole numbers of at least 1.
    ///
    /// # Errors
    /// Another count than `count`, a 0, something else than digits, or more than can be addressed.
    pub(super) fn sizes(&self, count: usize) -> Result<Vec<usize>, FormatError> {
        let words: Result<Vec<u64>, _> = self.text.split_whitespace().map(str::parse).collect();
        let fits = |v: &Vec<u64>| v.len() == count && !v.contains(&0);
        let sizes = words.ok().filter(fits);
        let sizes =
            sizes.ok_or_else(|| self.invalid(&format!("{count} whole numbers of at least 1 are needed")))?;
        let needed = sizes.iter().fold(1u64, |product, &n| product.saturating_mul(n));
        let counted: Result<Vec<usize>, _> = sizes.into_iter().map(usize::try_from).collect();
        counted.map_err(|_| FormatError::too_large(self.format, self.name, needed))
    }

    /// One whole number of at least `least`.
    ///
    /// # Errors
    /// Anything else.
    pub(super) fn integer(&self, least: i64) -> Result<i64, FormatError> {
        let value = self.text.trim().parse().ok().filter(|&v| v >= least);
        value.ok_or_else(|| self.invalid(&format!("a whole number of at least {least} is needed")))
    }

    /// One whole number of at least 0, as an offset; one that cannot be addressed becomes the largest that can, past
    /// the end of any file.
    ///
    /// # Errors
    /// Anything else.
    pub(super) fn offset(&self) -> Result<usize, FormatError> {
        Ok(usize::try_from(self.integer(0)?).unwrap_or(usize::MAX))
    }
}
