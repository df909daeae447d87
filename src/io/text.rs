//! Lines of text files, and headers that consist of lines of text.

use super::FormatError;
use super::beside::DataFiles;
use std::borrow::Cow;
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

/// Parses a word as a number, as all programs write it: NaN and infinities also as those of Windows do, `-nan(ind)` and
/// `1.#QNAN`. `None` for other words.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| windows_number(text))
}

/// Parses a number that is not finite in the notations of Windows.
fn windows_number(text: &str) -> Option<f64> {
    let (sign, size) = match text.strip_prefix('-') {
        Some(size) => (-1.0, size),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let starts = |name: &str| size.get(..name.len()).is_some_and(|start| start.eq_ignore_ascii_case(name));
    if starts("1.#INF") {
        return Some(sign * f64::INFINITY);
    }
    ["nan(", "1.#QNAN", "1.#SNAN", "1.#IND", "1.#NAN"].into_iter().any(starts).then_some(f64::NAN)
}

/// Returns text in UTF-16 as UTF-8, and text in UTF-8 without the byte order mark; `None` for bytes without one.
pub(super) fn without_byte_order_mark(bytes: &[u8]) -> Option<Cow<'_, [u8]>> {
    let wide = |text: &[u8], number: fn([u8; 2]) -> u16| {
        let units = text.chunks_exact(2).map(|pair| number([pair[0], pair[1]]));
        let decoded = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
        Cow::Owned(decoded.collect::<String>().into_bytes())
    };
    match bytes {
        [0xef, 0xbb, 0xbf, text @ ..] => Some(Cow::Borrowed(text)),
        [0xff, 0xfe, text @ ..] => Some(wide(text, u16::from_le_bytes)),
        [0xfe, 0xff, text @ ..] => Some(wide(text, u16::from_be_bytes)),
        _ => None,
    }
}

/// Maximum length of the text header of a volume file, in bytes; most have a few kilobytes, and those of segmentations some
/// 200 bytes for each segment.
const MAX_HEADER: usize = 16 << 20;

/// Maximum length of the names of the files beside a header, in bytes.
const MAX_NAMES: usize = 1 << 20;

/// Iterator over the lines of a volume file's text header, which then gives access to the bytes after it.
pub(super) struct Lines<'a> {
    format: &'static str,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(format: &'static str, bytes: &'a [u8]) -> Self {
        Self { format, bytes, at: 0 }
    }

    /// Returns the next line without its ending (\n or \r\n); `None` at the end of the file.
    ///
    /// # Errors
    /// The line goes beyond the maximum length of a header.
    pub(super) fn next_line(&mut self) -> Result<Option<String>, FormatError> {
        let Some(rest) = self.bytes.get(self.at..).filter(|rest| !rest.is_empty()) else { return Ok(None) };
        let within = &rest[..rest.len().min(MAX_HEADER.saturating_sub(self.at))];
        let length = match within.iter().position(|&b| b == b'\n') {
            Some(length) => length,
            None if within.len() == rest.len() => rest.len(),
            None => {
                let problem = format!("must have at most {} MiB", MAX_HEADER >> 20);
                return Err(FormatError::invalid(self.format, "header", problem));
            }
        };
        self.at += length + 1;
        Ok(Some(String::from_utf8_lossy(&rest[..length]).trim_end_matches('\r').to_owned()))
    }

    /// Returns the names of data files on the lines that follow, one on each; `field` starts the list.
    ///
    /// # Errors
    /// No names, or too many.
    pub(super) fn names(&mut self, field: &Field<'_>) -> Result<DataFiles, FormatError> {
        if self.bytes.len().saturating_sub(self.at) > MAX_NAMES {
            return Err(field.invalid("has too many files"));
        }
        let mut names = Vec::new();
        while let Some(line) = self.next_line()? {
            let name = line.trim();
            if !name.is_empty() {
                names.push(name.to_owned());
            }
        }
        if names.is_empty() {
            return Err(field.invalid("must be followed by the names of files"));
        }
        Ok(DataFiles::Names(names))
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

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn numbers_of_every_program() {
        for word in
            ["nan", "NaN", "-nan", "-nan(ind)", "nan(snan)", "+NAN(0x1)", "1.#QNAN", "-1.#IND", "1.#SNAN0"]
        {
            assert!(number(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        for (word, expected) in [("1.#INF", f64::INFINITY), ("-1.#INF00", f64::NEG_INFINITY), ("+.5e1", 5.0)]
        {
            assert_eq!(number(word.as_bytes()), Some(expected));
        }
        for word in ["", "-", "nanometre", "1.#", "0x10", "1,5", "\u{e9}"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn byte_order_marks() {
        let text = "v 1 \u{e9}\u{1f600}";
        let wide: Vec<u16> = "\u{feff}".encode_utf16().chain(text.encode_utf16()).collect();
        let bytes = |to: fn(u16) -> [u8; 2]| wide.iter().flat_map(|&unit| to(unit)).collect::<Vec<u8>>();
        for file in [bytes(u16::to_le_bytes), bytes(u16::to_be_bytes), format!("\u{feff}{text}").into_bytes()]
        {
            assert_eq!(without_byte_order_mark(&file).as_deref(), Some(text.as_bytes()));
        }
        assert_eq!(without_byte_order_mark(text.as_bytes()), None);
    }
}
