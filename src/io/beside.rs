//! Files beside the header of a volume: which ones a header names, and where they are among those that a caller gives.

use super::FormatError;
use std::borrow::Cow;

/// Files beside a header, among which a reader finds those that the header names.
pub trait FileSet {
    /// Returns the names of all files, with or without folders.
    fn names(&self) -> Vec<&str>;

    /// Returns the content of the file with this index among the names.
    ///
    /// # Errors
    /// [`FormatError::TooLarge`] if there is not enough memory for a copy.
    fn read(&self, index: usize) -> Result<Cow<'_, [u8]>, FormatError>;
}

impl FileSet for Vec<(&str, &[u8])> {
    fn names(&self) -> Vec<&str> {
        self.iter().map(|&(name, _)| name).collect()
    }

    fn read(&self, index: usize) -> Result<Cow<'_, [u8]>, FormatError> {
        Ok(Cow::Borrowed(self.get(index).map_or(&[], |&(_, bytes)| bytes)))
    }
}

/// The data files that a header names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum DataFiles {
    /// A single file, or the files of a list, in order.
    Names(Vec<String>),
    /// A numbered series.
    Series(Series),
}

/// The names of a numbered series: `start`, a number, and `end`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Series {
    start: String,
    end: String,
    /// Least number of characters of the number, filled up with zeros or spaces.
    width: usize,
    has_zeros: bool,
    first: i64,
    step: i64,
    count: u64,
}

impl Series {
    /// Parses names like `slice%03d.raw` with the first number, the last one, and the step between them; `None` unless
    /// there is one number in the names, and the step leads from the first to the last.
    pub(super) fn parse(pattern: &str, first: i64, last: i64, step: i64) -> Option<Self> {
        let (start, rest) = pattern.split_once('%')?;
        let letter = rest.find(|c: char| !c.is_ascii_digit())?;
        let (digits, rest) = rest.split_at(letter);
        let end = rest.strip_prefix(['d', 'i', 'u'])?;
        let width = if digits.is_empty() { 0 } else { digits.parse().ok()? };
        let steps = last.checked_sub(first)?.checked_div(step)?;
        let (count, fits) = (u64::try_from(steps).ok()?.checked_add(1)?, width <= MOST_DIGITS);
        let has_zeros = digits.starts_with('0');
        let (start, end) = (start.to_owned(), end.to_owned());
        fits.then_some(Self { start, end, width, has_zeros, first, step, count })
    }

    fn name(&self, index: u64) -> String {
        // Within the first and the last number, so that nothing overflows.
        let number = self.first.saturating_add(self.step.saturating_mul(index as i64));
        let Self { start, end, width, .. } = self;
        if self.has_zeros {
            format!("{start}{number:0width$}{end}")
        } else {
            format!("{start}{number:width$}{end}")
        }
    }
}

/// Splits the description of a numbered series into the pattern of its names, which may have spaces, and the integers
/// after it; `None` if there is no pattern.
pub(super) fn pattern_and_numbers(text: &str) -> Option<(&str, Vec<i64>)> {
    let (mut pattern, mut numbers) = (text.trim(), Vec::new());
    while let Some((before, number)) = pattern.rsplit_once(char::is_whitespace)
        && let Ok(number) = number.parse()
    {
        numbers.insert(0, number);
        pattern = before.trim_end();
    }
    pattern.contains('%').then_some((pattern, numbers))
}

/// Most digits that the names of a series may ask for.
const MOST_DIGITS: usize = 20;
/// Number of missing files that an error names.
const MOST_NAMED: usize = 3;

impl DataFiles {
    /// Returns the number of files.
    pub(super) fn count(&self) -> u64 {
        match self {
            Self::Names(names) => names.len() as u64,
            Self::Series(series) => series.count,
        }
    }

    /// Returns the first names, `most` of them if there are as many.
    fn first(&self, most: usize) -> Vec<Cow<'_, str>> {
        match self {
            Self::Names(names) => names.iter().take(most).map(|name| name.as_str().into()).collect(),
            Self::Series(series) => {
                (0..series.count.min(most as u64)).map(|k| series.name(k).into()).collect()
            }
        }
    }

    /// Finds the files among those beside the header by their names without folders: first as they are written, then
    /// in upper or lower case.
    ///
    /// # Errors
    /// Files that are missing, or a name that several files have.
    pub(super) fn find(&self, format: &'static str, files: &dyn FileSet) -> Result<Vec<Found>, FormatError> {
        let given = files.names();
        let (mut found, mut missing) = (Vec::new(), Vec::new());
        for name in self.first(given.len().saturating_add(MOST_NAMED)) {
            match matching(&given, &name)[..] {
                [at] => found.push(Found { at, name: base(&name).to_owned() }),
                [] => missing.push(name),
                _ => {
                    return Err(FormatError::invalid(
                        format,
                        "files",
                        format!("several are named '{}'", base(&name)),
                    ));
                }
            }
        }
        if found.len() as u64 == self.count() {
            Ok(found)
        } else {
            Err(self.missing(format, &missing, found.len()))
        }
    }

    fn missing(&self, format: &'static str, missing: &[Cow<'_, str>], found: usize) -> FormatError {
        let shown: Vec<String> =
            missing.iter().take(MOST_NAMED).map(|name| format!("'{}'", short(base(name)))).collect();
        let count = self.count() - found as u64;
        let more = if count > shown.len() as u64 { ", …" } else { "" };
        let problem = format!(
            "{count} of the {} that the header names {} missing: {}{more}",
            self.count(),
            if count == 1 { "is" } else { "are" },
            shown.join(", ")
        );
        FormatError::invalid(format, "files", problem)
    }
}

/// A file that a header names, among those beside it.
pub(super) struct Found {
    at: usize,
    name: String,
}

/// Returns the files of a name: those that are written like it, else those in upper or lower case; of several ones, that
/// whose folders are those of the name, if there is one.
fn matching(names: &[&str], wanted: &str) -> Vec<usize> {
    let all = |fits: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..names.len()).filter(|&at| fits(names[at])).collect()
    };
    let wanted_base = base(wanted);
    let mut found = all(&|name| base(name) == wanted_base);
    if found.is_empty() {
        found = all(&|name| base(name).eq_ignore_ascii_case(wanted_base));
    }
    let whole = all(&|name| is_same_path(name, wanted));
    if found.len() > 1 && whole.len() == 1 { whole } else { found }
}

/// Returns whether two names are the same with their folders, whatever separates these.
fn is_same_path(one: &str, other: &str) -> bool {
    let [mut one, mut other] = [one, other].map(|name| name.strip_prefix("./").unwrap_or(name).bytes());
    loop {
        match (one.next(), other.next()) {
            (Some(b'/' | b'\\'), Some(b'/' | b'\\')) => {}
            (a, b) if a != b => return false,
            (None, _) => return true,
            _ => {}
        }
    }
}

/// Returns the name of a file without its folders.
fn base(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

fn short(name: &str) -> String {
    name.chars().take(60).collect()
}

/// Returns the content of a data file; errors about it name the file.
pub(super) fn with_file<T>(
    files: &dyn FileSet,
    found: &Found,
    use_bytes: impl FnOnce(&[u8]) -> Result<T, FormatError>,
) -> Result<T, FormatError> {
    files
        .read(found.at)
        .and_then(|bytes| use_bytes(&bytes))
        .map_err(|error| error.in_file(&short(&found.name)))
}

/// Returns what `use_bytes` makes of the only file whose name `fits`; `kind` says which are sought.
///
/// # Errors
/// No such file, or several.
pub(super) fn with_single<T>(
    format: &'static str,
    files: &dyn FileSet,
    fits: impl Fn(&str) -> bool,
    kind: &str,
    use_bytes: impl FnOnce(&[u8]) -> Result<T, FormatError>,
) -> Result<T, FormatError> {
    let names = files.names();
    let found: Vec<usize> = (0..names.len()).filter(|&at| fits(names[at])).collect();
    match found[..] {
        [at] => with_file(files, &Found { at, name: base(names[at]).to_owned() }, use_bytes),
        [] => {
            Err(FormatError::invalid(format, "files", format!("the file {kind} of this header is missing")))
        }
        _ => Err(FormatError::invalid(format, "files", format!("several are {kind}; must be one"))),
    }
}

/// Returns the voxels of several data files, joined in order: `size` bytes, of which each file has an equal part, which
/// `part` takes from the content of the file.
///
/// # Errors
/// A number of files that does not divide the voxels, those of `part`, or not enough memory.
pub(super) fn joined(
    format: &'static str,
    files: &dyn FileSet,
    found: &[Found],
    size: usize,
    part: impl for<'b> Fn(&'b [u8], usize) -> Result<Cow<'b, [u8]>, FormatError>,
) -> Result<Vec<u8>, FormatError> {
    if found.is_empty() || !size.is_multiple_of(found.len()) {
        let problem = format!("{} files cannot have equal parts of {size} bytes of voxels", found.len());
        return Err(FormatError::invalid(format, "files", problem));
    }
    let mut out = Vec::new();
    out.try_reserve_exact(size).map_err(|_| FormatError::too_large(format, "voxel data", size as u64))?;
    for file in found {
        with_file(files, file, |bytes| {
            let wanted = size / found.len();
            let bytes = part(bytes, wanted)?;
            if bytes.len() != wanted {
                let problem =
                    format!("has {} bytes of voxels, the header accounts for {wanted}", bytes.len());
                return Err(FormatError::invalid(format, "voxel data", problem));
            }
            out.extend_from_slice(&bytes);
            Ok(())
        })?;
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn names_of(series: Option<Series>) -> Vec<String> {
        let files = DataFiles::Series(series.unwrap());
        files.first(9).into_iter().map(Cow::into_owned).collect()
    }

    #[test]
    fn names_of_numbered_series() {
        assert_eq!(names_of(Series::parse("s%03d.raw", 9, 11, 1)), ["s009.raw", "s010.raw", "s011.raw"]);
        assert_eq!(names_of(Series::parse("a/b%d", 3, -1, -2)), ["a/b3", "a/b1", "a/b-1"]);
        assert_eq!(names_of(Series::parse("%3i.%", 8, 13, 5)), ["  8.%", " 13.%"]);
        assert_eq!(names_of(Series::parse("%03u", -5, -5, 1)), ["-05"]);
        let least = i64::MIN;
        for (pattern, first, last, step) in [
            ("s.raw", 1, 2, 1),
            ("s%s", 1, 2, 1),
            ("s%", 1, 2, 1),
            ("s%99d", 1, 2, 1),
            ("s%d", 1, 2, 0),
            ("s%d", 2, 1, 1),
            ("s%d", least, i64::MAX, 1),
            ("s%d", 0, least, -1),
        ] {
            let found = Series::parse(pattern, first, last, step);
            let count = found.as_ref().map_or(0, |series| series.count);
            assert!(found.is_none() || count == 1 << 63 || count == (1 << 63) + 1, "{pattern}: {found:?}");
        }
    }

    fn found(wanted: &[&str], given: &[&str]) -> Result<Vec<usize>, String> {
        let files = DataFiles::Names(wanted.iter().map(|&name| name.to_owned()).collect());
        let given: Vec<(&str, &[u8])> = given.iter().map(|&name| (name, &b""[..])).collect();
        let found = files.find("test", &given).map_err(|error| error.to_string())?;
        Ok(found.iter().map(|one| one.at).collect())
    }

    #[test]
    fn files_are_found_by_their_names_without_folders() {
        assert_eq!(found(&["b.raw", "./a.raw"], &["x/a.raw", "b.raw", "c"]), Ok(vec![1, 0]));
        assert_eq!(found(&["C:\\scans\\A.raw"], &["a.raw", "A.raw"]), Ok(vec![1]));
        assert_eq!(found(&["A.RAW"], &["a.raw"]), Ok(vec![0]));
        assert_eq!(found(&["y/a.raw"], &["x/a.raw", "y/a.raw"]), Ok(vec![1]));
        let several = found(&["a.raw"], &["x/a.raw", "y/a.raw"]);
        assert_eq!(several, Err("test: files: several are named 'a.raw'".to_owned()));
    }

    #[test]
    fn missing_files_are_named() {
        let one = found(&["a", "b"], &["a"]).unwrap_err();
        assert_eq!(one, "test: files: 1 of the 2 that the header names is missing: 'b'");
        let series = DataFiles::Series(Series::parse("s%d", 1, 1 << 40, 1).unwrap());
        let files = vec![("s2", &b""[..])];
        let many = series.find("test", &files).err().unwrap().to_string();
        assert!(many.contains(&format!("{} of the {}", (1u64 << 40) - 1, 1u64 << 40)), "{many}");
        assert!(many.ends_with("are missing: 's1', 's3', 's4', …"), "{many}");
    }
}
