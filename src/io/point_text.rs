//! Reader of point clouds in text with a line per point: numbers in columns (XYZ, PTS, CSV and similar), or after a
//! keyword (`p x y z`).

use super::text::{Field, number, numbered_lines};
use super::{FormatError, PointCloud, points::full_channel};
use crate::math::{DVec3, Vec3};
use crate::mesh::WorldPositions;
use std::borrow::Cow;
use std::iter::Peekable;

pub(super) const FORMAT: &str = "point text";
/// Name, in error messages, of the text format with lines `p x y z`, which the data sets of Hoppe's surface
/// reconstruction use.
pub(super) const KEYWORD_FORMAT: &str = "PTS";

/// Maximum number of columns in a text file of points; real files have some dozens. Without a limit, a file of nothing
/// but commas would take forty times its size in memory.
const MAX_COLUMNS: usize = 1000;

/// A line of a text file without surrounding whitespace, and its number in the file.
struct Line<'a> {
    number: usize,
    text: Cow<'a, str>,
}

impl Line<'_> {
    fn field(&self) -> String {
        format!("line {}", self.number)
    }

    /// Returns an error that quotes the line and its number.
    fn invalid(&self, format: &'static str, problem: &str) -> FormatError {
        Field { format, name: &self.field(), text: &self.text }.invalid(problem)
    }

    /// Returns whether all cells of the line are numbers.
    fn is_row(&self) -> bool {
        row(&self.text, separator(&self.text)).iter().all(|cell| number(cell.as_bytes()).is_some())
    }

    /// Parses a cell of the line as a finite number.
    fn number(&self, format: &'static str, cell: &str) -> Result<f64, FormatError> {
        let invalid = |problem| Err(Field { format, name: &self.field(), text: cell }.invalid(problem));
        match number(cell.as_bytes()) {
            Some(number) if (number as f32).is_finite() => Ok(number),
            Some(_) => invalid("must be finite and within ±3.4e38"),
            None => invalid("must be a number with a decimal point, not a comma"),
        }
    }
}

/// Returns the lines of a file that are neither empty nor comments. Invalid UTF-8 is replaced: in comments it does not
/// matter, and elsewhere it is an error, since it is not a number.
fn content(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    lines(bytes).filter(|line| !line.text.is_empty() && comment(&line.text).is_none())
}

/// Returns all lines of a file, without surrounding whitespace.
fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    numbered_lines(bytes)
        .map(|(number, raw)| Line { number, text: String::from_utf8_lossy(raw.trim_ascii()) })
}

/// Returns the text of a comment line after its mark; `None` if the line is not a comment.
fn comment(line: &str) -> Option<&str> {
    ["#", "//", "%"].iter().find_map(|separator| line.strip_prefix(separator))
}

/// Returns the character that separates the cells of a line, semicolon before comma; `None` for whitespace.
fn separator(line: &str) -> Option<char> {
    [';', ','].into_iter().find(|&separator| line.contains(separator))
}

/// Returns the cells of a line without surrounding whitespace and quotes, at most [`MAX_COLUMNS`] + 1 of them, so that
/// too many are noticed.
fn cells(line: &str, separator: Option<char>) -> Vec<&str> {
    let mut quoted = false;
    let ends = |c: char| {
        quoted ^= c == '"';
        !quoted && separator.map_or(c.is_whitespace(), |separator| c == separator)
    };
    // A run of whitespace is one separator.
    let cells = line.split(ends).filter(|cell| separator.is_some() || !cell.is_empty());
    cells.take(MAX_COLUMNS + 1).map(unquoted).collect()
}

/// Returns the cells of a line of numbers, which may end with a separator.
fn row(line: &str, separator: Option<char>) -> Vec<&str> {
    let mut cells = cells(line, separator);
    if cells.last().is_some_and(|last| last.is_empty()) {
        cells.pop();
    }
    cells
}

fn unquoted(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).map_or(cell, str::trim)
}

/// Reads points from columns of text, as described at [`parse_points`](super::parse_points).
pub(super) fn parse(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    let mut lines = content(bytes).peekable();
    let count_line = lines.next_if(|line| announced(line).is_some());
    let named = take_column_names(&mut lines, count_line.is_some())?;
    let Some(first) = lines.peek() else { return Ok(PointCloud::default()) };
    let separator = separator(&first.text);
    let count = row(&first.text, separator).len();
    let columns = match named.or_else(|| named_in_comment(bytes, count)) {
        Some(columns) => columns,
        None => Columns::unnamed(count, first)?,
    };
    let table = Table::read(columns, separator, lines)?;
    if let Some(line) = count_line {
        check_count(&line, table.rows().len())?;
    }
    table.into_points()
}

/// Returns the number of points that a line announces; `None` unless the line is a single integer.
fn announced(line: &Line) -> Option<u64> {
    line.text.parse().ok()
}

/// Returns an error if the number of points announced by `line` is not `rows`, the number of points read. No memory is
/// reserved by the announced number, so a check at the end suffices.
fn check_count(line: &Line, rows: usize) -> Result<(), FormatError> {
    if announced(line) == Some(rows as u64) {
        return Ok(());
    }
    let problem = format!("announced number of points, but {rows} follow");
    Err(line.invalid(FORMAT, &problem))
}

/// Takes the next line of the file unless it consists of numbers, and returns the columns that it names. A line that
/// names no columns is skipped if the line before it announced the number of points (`counted`), and an error
/// otherwise.
fn take_column_names<'a>(
    lines: &mut Peekable<impl Iterator<Item = Line<'a>>>,
    counted: bool,
) -> Result<Option<Columns>, FormatError> {
    let Some(line) = lines.next_if(|line| !line.is_row()) else { return Ok(None) };
    let named = Columns::named(&line.text);
    if named.is_none() && !counted {
        let problem = "must be columns of numbers, or column names that include x, y and z";
        return Err(line.invalid(FORMAT, problem));
    }
    Ok(named)
}

/// Returns the columns named by a comment at the start of the file. Of several comments that name `count` columns (the
/// number in the first line of numbers), the last one is used.
fn named_in_comment(bytes: &[u8], count: usize) -> Option<Columns> {
    let before = lines(bytes).take_while(|line| line.text.is_empty() || comment(&line.text).is_some());
    let named = before.filter_map(|line| Columns::named(comment(&line.text)?));
    named.filter(|columns| columns.count == count).last()
}

/// The meaning of the columns in a text file of points.
struct Columns {
    /// Number of columns in the file.
    count: usize,
    /// Indices of the columns of the file that are read, those of the position first.
    read: Vec<usize>,
    /// Which of the columns that are read hold normals and colours; `None` in a file without column names, in which
    /// their values decide it.
    extras: Option<Extras>,
}

/// Index of the first column of normals and of colours, counted among the columns that are read; `None` if the file has
/// no normals or no colours.
struct Extras {
    normals: Option<usize>,
    colors: Option<usize>,
}

impl Columns {
    /// Returns the columns that a line names; `None` if it does not name x, y and z (or the axes of napari), or names
    /// too many columns.
    fn named(line: &str) -> Option<Self> {
        let names: Vec<String> =
            cells(line, separator(line)).into_iter().map(str::to_ascii_lowercase).collect();
        let set = |set: [&str; 3]| -> Option<Vec<usize>> {
            set.into_iter().map(|name| names.iter().position(|found| found == name)).collect()
        };
        if names.len() > MAX_COLUMNS {
            return None;
        }
        let points = set(["x", "y", "z"]).or_else(|| napari_axes(&names))?;
        let normals = set(["nx", "ny", "nz"]);
        let colors =
            [["red", "green", "blue"], ["r", "g", "b"], ["rf", "gf", "bf"]].into_iter().find_map(set);
        let extras = Extras {
            normals: normals.as_ref().map(|_| 3),
            colors: colors.as_ref().map(|_| if normals.is_some() { 6 } else { 3 }),
        };
        let read = [Some(points), normals, colors].into_iter().flatten().flatten().collect();
        Some(Self { count: names.len(), read, extras: Some(extras) })
    }

    /// Returns the columns of a file without column names; an error unless there are 3, 4, 6, 7 or 9. `first` is its
    /// first line of numbers.
    fn unnamed(count: usize, first: &Line) -> Result<Self, FormatError> {
        if ![3, 4, 6, 7, 9].contains(&count) {
            let accepted = "3, 4, 6, 7 or 9 columns, or a first line with column names";
            return Err(FormatError::unsupported(FORMAT, first.field(), columns(count), accepted));
        }
        // An intensity is not read.
        let read = (0..count).filter(|&column| column != 3 || ![4, 7].contains(&count)).collect();
        Ok(Self { count, read, extras: None })
    }
}

/// Returns the indices of the columns of x, y and z under the names that napari gives: `axis-0`, `axis-1` and so on for
/// z, y and x, after time if there are four; `None` for any other number of such names.
fn napari_axes(names: &[String]) -> Option<Vec<usize>> {
    let column_of_axis = |axis: usize| names.iter().position(|name| *name == format!("axis-{axis}"));
    let all: Vec<usize> = (0..5).map_while(column_of_axis).collect();
    match all.as_slice() {
        [z, y, x] | [_, z, y, x] => Some(vec![*x, *y, *z]),
        _ => None,
    }
}

fn columns(count: usize) -> String {
    if count == 1 { "1 column".into() } else { format!("{count} columns") }
}

/// The numbers of a text file of points in the columns that are read, line by line.
struct Table {
    columns: Columns,
    numbers: Vec<f64>,
}

impl Table {
    fn read<'a>(
        columns: Columns,
        separator: Option<char>,
        mut lines: impl Iterator<Item = Line<'a>>,
    ) -> Result<Self, FormatError> {
        let mut table = Self { columns, numbers: Vec::new() };
        lines.try_for_each(|line| table.push(&line, separator))?;
        Ok(table)
    }

    /// Appends the numbers of a line in the columns that are read; an error if the line has too few or too many
    /// columns.
    fn push(&mut self, line: &Line, separator: Option<char>) -> Result<(), FormatError> {
        let mut cells = cells(&line.text, separator);
        if cells.len() == self.columns.count + 1 && cells.last().is_some_and(|last| last.is_empty()) {
            cells.pop();
        }
        if cells.len() != self.columns.count {
            let (found, accepted) = (columns(cells.len()), columns(self.columns.count));
            let problem =
                format!("must have {accepted}, as named or as in the first line of numbers, got {found}");
            return Err(line.invalid(FORMAT, &problem));
        }
        for &column in &self.columns.read {
            self.numbers.push(line.number(FORMAT, cells[column])?);
        }
        Ok(())
    }

    fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> + Clone {
        self.numbers.chunks_exact(self.columns.read.len())
    }

    /// Returns the vector in three columns from `at`, counted among those that are read, for every line.
    fn vectors(&self, at: usize) -> impl Iterator<Item = Vec3> + Clone {
        self.rows().map(move |row| DVec3::from_slice(&row[at..]).as_vec3())
    }

    fn into_points(self) -> Result<PointCloud, FormatError> {
        let extras = match &self.columns.extras {
            Some(known) => known,
            None => &self.guessed_extras()?,
        };
        let all = |at: usize| self.vectors(at).collect();
        let world = self.rows().map(DVec3::from_slice).collect::<WorldPositions>();
        let (points, origin) = world.relative();
        let (normals, colors) = (extras.normals.map(all), extras.colors.map(all));
        Ok(PointCloud { points, origin, normals, colors, ..PointCloud::default() })
    }

    /// Returns which columns of a file without column names hold normals and colours. Normals are recognised by their
    /// unit length; an error if the values fit neither.
    fn guessed_extras(&self) -> Result<Extras, FormatError> {
        let (normals, colors) = match self.columns.count {
            6 if self.are_normals(3) => (Some(3), None),
            6 => (None, Some(3)),
            7 => (None, Some(3)),
            9 if self.are_normals(6) && self.are_colors(3) => (Some(6), Some(3)),
            9 => (Some(3), Some(6)),
            _ => (None, None),
        };
        if normals.is_none_or(|at| self.are_normals(at)) && colors.is_none_or(|at| self.are_colors(at)) {
            return Ok(Extras { normals, colors });
        }
        let problem = "without column names, these must be normals (lengths within 1 % of 1) or colours (all in 0..1, or \
             integers in 0..255)";
        Err(FormatError::invalid(FORMAT, format!("columns 4 to {}", self.columns.count), problem))
    }

    /// Returns whether the vectors in three columns from `at` (counted among those that are read) have unit length
    /// within 1 % in all lines.
    fn are_normals(&self, at: usize) -> bool {
        self.vectors(at).all(|v| (v.length() - 1.0).abs() <= 0.01)
    }

    /// Returns whether the triples in three columns from `at` (counted among those that are read) can be colours in all
    /// lines: all numbers in 0..1, or all integers in 0..255.
    fn are_colors(&self, at: usize) -> bool {
        full_channel(self.vectors(at)).is_some()
    }
}

/// Returns whether at least one line starts with the keyword `p` and a number, as in `p x y z`.
pub(super) fn has_keywords(bytes: &[u8]) -> bool {
    content(bytes).any(|line| {
        let mut words = line.text.split_whitespace();
        words.next() == Some("p") && words.next().is_some_and(|word| number(word.as_bytes()).is_some())
    })
}

/// Reads points from lines `p x y z`. Colours (`d`, `s`) and gloss (`g`), which apply to all points that follow, are
/// ignored.
pub(super) fn parse_keyword_lines(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    let mut points = WorldPositions::default();
    for line in content(bytes) {
        // One word more than a point has is enough to detect too many.
        let words: Vec<&str> = line.text.split_whitespace().take(5).collect();
        match words.as_slice() {
            ["p", x, y, z] => {
                let number = |word| line.number(KEYWORD_FORMAT, word);
                points.push(DVec3::new(number(x)?, number(y)?, number(z)?));
            }
            ["d" | "s" | "g", ..] => {}
            _ => return Err(line.invalid(KEYWORD_FORMAT, "must be p and three numbers, or d, s or g")),
        }
    }
    let (points, origin) = points.relative();
    Ok(PointCloud { points, origin, ..PointCloud::default() })
}

#[cfg(test)]
mod tests {
    use super::super::parse_points;
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn read(text: &str) -> PointCloud {
        parse_points(text.as_bytes()).unwrap_or_else(|error| panic!("{error} in {text:?}"))
    }

    fn refusal(text: &str) -> String {
        parse_points(text.as_bytes()).unwrap_err().to_string()
    }

    fn two() -> Vec<Vec3> {
        vec![Vec3::new(1.0, -2.5, 3e-2), Vec3::new(4.0, 5.0, 6.0)]
    }

    #[test]
    fn three_columns_however_they_are_set_apart() {
        for text in [
            "1 -2.5 3e-2\n4 5 6\n",
            "1\t-2.5\t0.03\r\n4\t5\t6",
            "  1  -2.50\t +.03  \n\n 4. 5 6 \n\n",
            "1,-2.5,0.03\n4,5,6\n",
            "1, -2.5, 0.03\r4, 5, 6\r",
            "1;-2.5;0.03\n4; 5; 6\n",
            "\"1\",\"-2.5\",\"0.03\"\n4,5,6\n",
            "\u{feff}1 -2.5 0.03\n4 5 6\n",
        ] {
            assert_eq!(read(text), PointCloud { points: two(), ..PointCloud::default() }, "{text:?}");
        }
    }

    #[test]
    fn comments_and_counts_are_passed_over() {
        for text in [
            "# one\n// two\n  % three\n1 -2.5 0.03\n# four\n4 5 6\n",
            "2\n1 -2.5 0.03\n4 5 6\n",
            "2\nany words, or 3 numbers\n1 -2.5 0.03\n4 5 6\n",
            "2\n\n1 -2.5 0.03\n4 5 6\n",
            "# marked\n 2 \n# again\n1;-2.5;0.03\n4;5;6\n",
            "2\nz y x\n0.03 -2.5 1\n6 5 4\n",
        ] {
            assert_eq!(read(text).points, two(), "{text:?}");
        }
        let latin = b"# gr\xfc\xdfe\n1 -2.5 0.03\n4 5 6";
        assert_eq!(parse_points(latin).unwrap().points, two());
    }

    #[test]
    fn named_columns_are_found_in_any_order() {
        for text in [
            "x,y,z\n1,-2.5,0.03\n4,5,6\n",
            ",t,z,y,x\n0,0.0,0.03,-2.5,1\n1,7.0,6,5,4\n",
            "index;Z;label;Y;X\n0;0.03;ground;-2.5;1\n1;6;;5;4\n",
            "\"X\" \"Y\" \"Z\"\n1 -2.5 0.03\n4 5 6\n",
            "name,x,y,z\n\"a, b\",1,-2.5,0.03\nc,4,5,6\n",
            "index,axis-0,axis-1,axis-2\n0,0.03,-2.5,1\n1,6,5,4\n",
            "axis-0,axis-1,axis-2,axis-3\n0,0.03,-2.5,1\n1,6,5,4\n",
            "# z y x\n0.03 -2.5 1\n6 5 4\n",
        ] {
            assert_eq!(read(text), PointCloud { points: two(), ..PointCloud::default() }, "{text:?}");
        }
    }

    #[test]
    fn named_columns_bring_normals_and_colours() {
        let cloud = read("Red,Green,Blue,nz,ny,nx,x,y,z\n255,0,51,3,2,1,1,-2.5,0.03\n0,0,0,6,5,4,4,5,6\n");
        let normals = Some(vec![Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
        let colors = Some(vec![Vec3::new(1.0, 0.0, 0.2), Vec3::ZERO]);
        assert_eq!(
            cloud,
            PointCloud { points: two(), normals, colors: colors.clone(), ..PointCloud::default() }
        );
        // As CloudCompare writes it; without the names, the column of the intensity would be ambiguous.
        let cloud = read("//X Y Z R G B Intensity\n2\n1 -2.5 0.03 255 0 51 9\n4 5 6 0 0 0 7\n");
        assert_eq!(cloud, PointCloud { points: two(), colors, ..PointCloud::default() });
        let partial = read("x,y,z,nx,ny,r,red\n1,-2.5,0.03,0,1,8,9\n4,5,6,0,1,8,9\n");
        assert_eq!(partial, PointCloud { points: two(), ..PointCloud::default() });
    }

    #[test]
    fn columns_without_names_are_known_by_their_number() {
        let (p, q) = ("1 -2.5 0.03", "4 5 6");
        let (n, m) = ("0.6 -0.8 0", "0 0 1.005");
        let (c, d) = ("255 0 51", "0 0 0");
        let normals = Some(vec![Vec3::new(0.6, -0.8, 0.0), Vec3::new(0.0, 0.0, 1.005)]);
        let colors = Some(vec![Vec3::new(1.0, 0.0, 0.2), Vec3::ZERO]);
        for (text, has_normals, has_colors) in [
            (format!("{p} 0.5\n{q} 100"), false, false),
            (format!("{p} {n}\n{q} {m}"), true, false),
            (format!("{p} {c}\n{q} {d}"), false, true),
            (format!("{p} 1 0 0.2\n{q} {d}"), false, true),
            (format!("{p} -500 {c}\n{q} 40 {d}"), false, true),
            (format!("{p} {c} {n}\n{q} {d} {m}"), true, true),
            (format!("{p} {n} {c}\n{q} {m} {d}"), true, true),
        ] {
            let cloud = read(&text);
            assert_eq!(cloud.points, two(), "{text:?}");
            assert_eq!(cloud.normals, normals.clone().filter(|_| has_normals), "{text:?}");
            assert_eq!(cloud.colors, colors.clone().filter(|_| has_colors), "{text:?}");
        }
    }

    #[test]
    fn points_behind_a_keyword() {
        let text = "# made\nd 1 1 1\ns 1 1 1\ng 1 0 0\np 1 -2.5 0.03\nd\np 4 5 6\n#\n";
        assert_eq!(read(text), PointCloud { points: two(), ..PointCloud::default() });
        for (text, said) in [
            ("p 1 2 3\np 1 2\n", "PTS: line 2: 'p 1 2'"),
            ("p 1 2 3\nq 1 2 3\n", "PTS: line 2: 'q 1 2 3'"),
            ("# a\r\np 1 2 x\r\n", "PTS: line 2: 'x': must be a number"),
            ("p 1 2 inf\n", "PTS: line 1: 'inf': must be finite"),
        ] {
            assert!(refusal(text).starts_with(said), "{}", refusal(text));
        }
        // A column named `p` is not a keyword.
        assert_eq!(read("p x y z\n7 1 -2.5 0.03\n8 4 5 6\n").points, two());
    }

    #[test]
    fn errors_name_their_line() {
        for (text, said) in [
            ("1 2 3\r\n4 5\r\n", "point text: line 2: '4 5': must have 3 columns"),
            ("1,2,3\n4,5,6,7\n", "point text: line 2: '4,5,6,7': must have 3 columns"),
            ("x,y,z\n1,2,3,4\n", "point text: line 2: '1,2,3,4': must have 3 columns"),
            ("1 2 3\n4 five 6\n", "point text: line 2: 'five': must be a number"),
            ("1;2;3\n1,5;2;3\n", "point text: line 2: '1,5': must be a number"),
            ("x,y,z\n1,,3\n", "point text: line 2: '': must be a number"),
            ("1 2 3\n\n4 nan 6\n", "point text: line 3: 'nan': must be finite"),
            ("1 2 -inf\n", "point text: line 1: '-inf': must be finite"),
            ("1 2 3\n1e39 2 3\n", "point text: line 2: '1e39': must be finite"),
            ("3\n1 2 3\n4 5 6\n", "point text: line 1: '3': announced number of points, but 2 follow"),
            ("1\n1 2 3\n4 5 6\n", "point text: line 1: '1': announced number of points, but 2 follow"),
            ("99999999999999999999\n1 2 3\n", "point text: line 1: 1 column"),
            ("1 2\n3 4\n", "point text: line 1: 2 columns is not supported; accepted: 3, 4"),
            ("1 2 3 4 5\n", "point text: line 1: 5 columns"),
            ("1 2 3 4 5 -6\n", "point text: columns 4 to 6: without column names"),
            ("1 2 3 0.5 0.5 200\n", "point text: columns 4 to 6"),
            ("1 2 3 9 256 0 0\n", "point text: columns 4 to 7"),
            ("1 2 3 0 0 1 -1 0 0.5\n", "point text: columns 4 to 9"),
            ("x,y,z,r,g,b\n1,2,3,300,0,0\n", "point text: colours: out of range"),
            ("a,b,c\n1,2,3\n", "point text: line 1: 'a,b,c': must be columns of numbers, or column names"),
            ("axis-0,axis-1\n1,2\n", "point text: line 1: 'axis-0,axis-1'"),
            ("p 1 2 3\np 1 2 3 4 5 6\n", "PTS: line 2: 'p 1 2 3 4 5 6'"),
            ("Dear all,\n", "point text: line 1: 'Dear all,'"),
            ("x,y,z\n", "point text: points: the file has no points"),
            ("0\n", "point text: points: the file has no points"),
            ("# nothing\n\n", "point text: points: the file has no points"),
        ] {
            assert!(refusal(text).starts_with(said), "{text:?}: {}", refusal(text));
        }
    }

    #[test]
    fn a_file_may_have_a_thousand_columns() {
        let wide =
            |columns: usize| format!("x,y,z{}\n1,2,3{}\n", ",".repeat(columns - 3), ",".repeat(columns - 3));
        assert_eq!(read(&wide(1000)).points, [Vec3::new(1.0, 2.0, 3.0)]);
        assert!(refusal(&wide(1001)).starts_with("point text: line 1: 'x,y,z,"));
    }

    #[test]
    fn long_words_are_cut_in_messages() {
        let long = "1".repeat(100_000);
        assert!(refusal(&format!("1 2 {long}")).len() < 200);
        assert!(refusal(&"ä".repeat(100_000)).len() < 400);
    }
}
