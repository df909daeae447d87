//! NRRD 1 to 5: header and voxels in one file, or apart with the voxels as detached payload.
//!
//! Up to three axes in space come first; one axis after them, if any, is frames. Vectors and colours per voxel are
//! refused. Encodings: raw, text, hex, gzip. A space of left-posterior-superior stays LPS; right-anterior-superior
//! is RAS; left-anterior-superior becomes RAS by the sign of x; spaces without anatomical names, and none, keep
//! their coordinates and count as RAS. Lengths stay in the file's unit, which [`Volume::unit`] names. Without
//! directions, spacings along the axes count, and 1 where they are unknown too. A list of data files is taken as
//! their bytes one after the other.

use super::FormatError;
use super::gzip::gunzip;
use super::raw::{Place, SLACK, Scalar, decode, decode_text, exact, payload_size, refused};
use super::text::{Field, Lines};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::volume::{LengthUnit, Space, Volume, VolumeInit, Voxels};

const FORMAT: &str = "NRRD";
const DATA: Place = Place { format: FORMAT, field: "voxel data" };

/// Fields of the standard, names without blanks; any other is an error, as the standard has it.
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

/// Whether the bytes begin as a NRRD does.
pub(super) fn is_nrrd(bytes: &[u8]) -> bool {
    bytes.starts_with(b"NRRD")
}

/// Reads a volume; `detached` is the payload where the header names a data file.
///
/// # Errors
/// [`FormatError`] naming the header field.
pub(super) fn parse(bytes: &[u8], detached: Option<&[u8]>) -> Result<Volume, FormatError> {
    let mut lines = Lines::new(bytes);
    let fields = Fields::read(&mut lines)?;
    let header = Header::check(&fields)?;
    let source = match (fields.get("datafile"), detached) {
        (None, _) => lines.rest(),
        (Some(_), Some(payload)) => payload,
        (Some(file), None) => {
            return Err(file.invalid("voxels are in another file; give its bytes as the detached payload"));
        }
    };
    header.volume(source)
}

/// The header's fields, names in lower case without blanks.
struct Fields {
    pairs: Vec<(String, String)>,
}

impl Fields {
    /// Reads up to the blank line, or to the end of a detached header.
    fn read(lines: &mut Lines<'_>) -> Result<Self, FormatError> {
        let magic = lines.next_line().unwrap_or_default();
        if !matches!(magic.as_str(), "NRRD0001" | "NRRD0002" | "NRRD0003" | "NRRD0004" | "NRRD0005") {
            let shown: String = magic.chars().take(12).collect();
            return Err(FormatError::unsupported(
                FORMAT,
                "magic",
                format!("'{shown}'"),
                "NRRD0001 to NRRD0005",
            ));
        }
        let mut fields = Self { pairs: Vec::new() };
        while let Some(line) = lines.next_line() {
            if line.is_empty() {
                break;
            }
            if !line.starts_with('#') && fields.add(&line)? {
                break;
            }
        }
        Ok(fields)
    }

    /// Takes in one line. True when a list of files begins, which takes the rest of the header.
    fn add(&mut self, line: &str) -> Result<bool, FormatError> {
        let (name, value) = match (line.find(":="), line.find(": ")) {
            (Some(at), colon) if colon.is_none_or(|colon| at < colon) => return Ok(false),
            (_, Some(at)) => (&line[..at], &line[at + 2..]),
            _ if line.ends_with(':') => (&line[..line.len() - 1], ""),
            _ => {
                let shown: String = line.chars().take(40).collect();
                return Err(FormatError::invalid(
                    FORMAT,
                    "header",
                    format!("'{shown}' is no 'field: value' line"),
                ));
            }
        };
        let key: String = name.chars().filter(|c| !c.is_whitespace()).flat_map(char::to_lowercase).collect();
        if !KNOWN.contains(&key.as_str()) {
            return Err(FormatError::invalid(FORMAT, name, "not a field of the format"));
        }
        let files = key == "datafile" && value.trim_start().starts_with("LIST");
        self.pairs.push((key, value.trim().to_owned()));
        Ok(files)
    }

    fn get(&self, key: &'static str) -> Option<Field<'_>> {
        let (_, text) = self.pairs.iter().find(|(name, _)| name == key)?;
        Some(Field { format: FORMAT, name: key, text })
    }

    fn need(&self, key: &'static str) -> Result<Field<'_>, FormatError> {
        self.get(key).ok_or_else(|| FormatError::invalid(FORMAT, key, "missing"))
    }
}

/// How numbers are written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Raw,
    Text,
    Hex,
    Gzip,
}

/// A header found consistent.
struct Header {
    scalar: Scalar,
    dims: [usize; 4],
    encoding: Encoding,
    big: bool,
    line_skip: usize,
    /// `None` (-1 in the file): voxels are the last bytes.
    byte_skip: Option<usize>,
    affine: DAffine3,
    space: Space,
    unit: LengthUnit,
    frame_seconds: f64,
}

impl Header {
    fn check(fields: &Fields) -> Result<Self, FormatError> {
        let scalar = scalar(&fields.need("type")?)?;
        let encoding = encoding(&fields.need("encoding")?)?;
        let rank = rank(&fields.need("dimension")?)?;
        let axes = Axes::read(fields, rank)?;
        let (space, flip_x) = space(fields)?;
        let mut affine = axes.affine(fields)?;
        if flip_x {
            affine = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * affine;
        }
        Ok(Self {
            scalar,
            dims: axes.dims,
            encoding,
            big: big_endian(fields, scalar, encoding)?,
            line_skip: fields.get("lineskip").map_or(Ok(0), |f| f.offset())?,
            byte_skip: byte_skip(fields, encoding)?,
            affine,
            space,
            unit: unit(fields, axes.in_space),
            frame_seconds: axes.frame_seconds(fields)?,
        })
    }

    fn volume(&self, source: &[u8]) -> Result<Volume, FormatError> {
        let volume = Volume::new(VolumeInit {
            voxels: self.voxels(self.after_lines(source)?)?,
            dims: self.dims,
            affine: self.affine,
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: self.frame_seconds,
            space: self.space,
        });
        Ok(volume.map_err(|error| refused(FORMAT, error))?.with_unit(self.unit))
    }

    fn after_lines<'a>(&self, source: &'a [u8]) -> Result<&'a [u8], FormatError> {
        let mut rest = source;
        for _ in 0..self.line_skip {
            let end = rest.iter().position(|&b| b == b'\n');
            let end =
                end.ok_or_else(|| FormatError::invalid(FORMAT, "line skip", "fewer lines than that"))?;
            rest = &rest[end + 1..];
        }
        Ok(rest)
    }

    fn voxels(&self, source: &[u8]) -> Result<Voxels, FormatError> {
        let size = payload_size(DATA, self.dims, self.scalar)?;
        let count = size / self.scalar.size();
        match self.encoding {
            Encoding::Raw => self.binary(source, size),
            Encoding::Gzip => {
                let limit = size.saturating_add(self.byte_skip.unwrap_or(0)).saturating_add(SLACK);
                self.binary(&gunzip(FORMAT, source, limit)?, size)
            }
            Encoding::Hex => self.binary(&unhex(self.after_bytes(source, size)?, size)?, size),
            Encoding::Text => decode_text(DATA, self.after_bytes(source, size)?, self.scalar, count),
        }
    }

    fn binary(&self, bytes: &[u8], size: usize) -> Result<Voxels, FormatError> {
        let skipped = if self.encoding == Encoding::Hex { bytes } else { self.after_bytes(bytes, size)? };
        decode(DATA, exact(DATA, skipped, size)?, self.scalar, self.big)
    }

    /// What is left after the byte skip.
    fn after_bytes<'a>(&self, bytes: &'a [u8], size: usize) -> Result<&'a [u8], FormatError> {
        let skip = self.byte_skip.unwrap_or_else(|| bytes.len().saturating_sub(size));
        bytes.get(skip..).ok_or_else(|| FormatError::truncated(FORMAT, "byte skip", skip, bytes.len()))
    }
}

fn scalar(field: &Field<'_>) -> Result<Scalar, FormatError> {
    let words: Vec<&str> = field.text.split_whitespace().collect();
    Ok(match words.join(" ").as_str() {
        "signed char" | "int8" | "int8_t" => Scalar::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
        "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => Scalar::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        other => {
            return Err(FormatError::unsupported(
                FORMAT,
                "type",
                format!("'{other}'"),
                "integers of 8 to 64 bits, float, double",
            ));
        }
    })
}

fn encoding(field: &Field<'_>) -> Result<Encoding, FormatError> {
    match field.text.to_ascii_lowercase().as_str() {
        "raw" => Ok(Encoding::Raw),
        "txt" | "text" | "ascii" => Ok(Encoding::Text),
        "hex" => Ok(Encoding::Hex),
        "gz" | "gzip" => Ok(Encoding::Gzip),
        other => {
            Err(FormatError::unsupported(FORMAT, "encoding", format!("'{other}'"), "raw, text, hex, gzip"))
        }
    }
}

fn rank(field: &Field<'_>) -> Result<usize, FormatError> {
    match field.integer(1)? {
        n @ 1..=4 => Ok(n as usize),
        n => Err(FormatError::unsupported(FORMAT, "dimension", n.to_string(), "1 to 4")),
    }
}

fn big_endian(fields: &Fields, scalar: Scalar, encoding: Encoding) -> Result<bool, FormatError> {
    if scalar.size() == 1 || encoding == Encoding::Text {
        return Ok(false);
    }
    let field = fields.need("endian")?;
    match field.text.to_ascii_lowercase().as_str() {
        "big" => Ok(true),
        "little" => Ok(false),
        _ => Err(field.invalid("'big' or 'little' is needed")),
    }
}

fn byte_skip(fields: &Fields, encoding: Encoding) -> Result<Option<usize>, FormatError> {
    let Some(field) = fields.get("byteskip") else { return Ok(Some(0)) };
    match field.integer(-1)? {
        -1 if encoding == Encoding::Raw => Ok(None),
        -1 => Err(field.invalid("-1 goes with encoding raw only")),
        _ => Ok(Some(field.offset()?)),
    }
}

/// The space, and whether x must change sign to get there.
fn space(fields: &Fields) -> Result<(Space, bool), FormatError> {
    let Some(field) = fields.get("space") else { return Ok((Space::Ras, false)) };
    match field.text.to_ascii_lowercase().as_str() {
        "right-anterior-superior" | "ras" => Ok((Space::Ras, false)),
        "left-anterior-superior" | "las" => Ok((Space::Ras, true)),
        "left-posterior-superior" | "lps" => Ok((Space::Lps, false)),
        "scanner-xyz" | "3d-right-handed" | "3d-left-handed" => Ok((Space::Ras, false)),
        other => {
            let accepted = "right-anterior-superior, left-anterior-superior, left-posterior-superior, scanner-xyz, \
                            3D-right-handed, 3D-left-handed";
            Err(FormatError::unsupported(FORMAT, "space", format!("'{other}'"), accepted))
        }
    }
}

fn unit(fields: &Fields, in_space: usize) -> LengthUnit {
    let field = fields.get("spaceunits").or_else(|| fields.get("units"));
    let words: Vec<String> = field.map(|f| quoted(f.text)).unwrap_or_default();
    let all = |unit: &str| !words.is_empty() && words.iter().take(in_space).all(|word| word == unit);
    match () {
        () if all("mm") => LengthUnit::Millimetre,
        () if all("um") || all("\u{b5}m") || all("\u{3bc}m") => LengthUnit::Micrometre,
        () if all("m") => LengthUnit::Metre,
        () => LengthUnit::Unknown,
    }
}

/// Words in double quotes.
fn quoted(text: &str) -> Vec<String> {
    text.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The axes, sorted into space and frames.
struct Axes {
    rank: usize,
    dims: [usize; 4],
    /// How many axes, from the first, are in space.
    in_space: usize,
    /// The direction of each axis in space, where the file has directions.
    directions: Option<Vec<DVec3>>,
}

impl Axes {
    fn read(fields: &Fields, rank: usize) -> Result<Self, FormatError> {
        let sizes = fields.need("sizes")?.sizes(rank)?;
        let directions = fields.get("spacedirections").map(|field| directions(&field, rank)).transpose()?;
        let in_space = match &directions {
            Some(directions) => directions.iter().filter(|d| d.is_some()).count(),
            None => rank.min(3),
        };
        if let Some(directions) = &directions {
            check_order(directions, in_space, &sizes)?;
        }
        check_kinds(fields, rank, in_space)?;
        let mut dims = [1; 4];
        dims[..in_space].copy_from_slice(&sizes[..in_space]);
        if in_space < rank {
            dims[3] = sizes[in_space];
        }
        let directions = directions.map(|list| list.into_iter().flatten().collect());
        Ok(Self { rank, dims, in_space, directions })
    }

    fn affine(&self, fields: &Fields) -> Result<DAffine3, FormatError> {
        let origin = fields.get("spaceorigin").map(|field| vector(&field, field.text)).transpose()?;
        let origin = origin.flatten().filter(|v| !v.is_nan()).unwrap_or(DVec3::ZERO);
        let columns = match &self.directions {
            Some(directions) => with_normals(directions),
            None => self.spacings(fields)?,
        };
        Ok(DAffine3::from_mat3_translation(DMat3::from_cols(columns[0], columns[1], columns[2]), origin))
    }

    /// Axes along the world's, as long as `spacings` says; 1 where it is missing or NaN.
    fn spacings(&self, fields: &Fields) -> Result<[DVec3; 3], FormatError> {
        if let Some(field) = fields.get("axismaxs").filter(|_| fields.get("spacings").is_none()) {
            return Err(FormatError::unsupported(
                FORMAT,
                field.name,
                "positions by axis ends",
                "spacings or space directions",
            ));
        }
        let mut lengths = [1.0; 3];
        if let Some(field) = fields.get("spacings") {
            let given = field.numbers(self.rank)?;
            for (length, &value) in
                lengths.iter_mut().zip(&given[..self.in_space]).filter(|(_, v)| !v.is_nan())
            {
                *length = value;
            }
            if lengths.iter().any(|&l| l == 0.0 || !l.is_finite()) {
                return Err(field.invalid("finite numbers other than 0 are needed"));
            }
        }
        Ok([DVec3::X * lengths[0], DVec3::Y * lengths[1], DVec3::Z * lengths[2]])
    }

    /// The step of the frame axis where the file gives it in a unit of time.
    fn frame_seconds(&self, fields: &Fields) -> Result<f64, FormatError> {
        let (Some(spacings), Some(units)) = (fields.get("spacings"), fields.get("units")) else {
            return Ok(0.0);
        };
        if self.dims[3] == 1 {
            return Ok(0.0);
        }
        let step = spacings.numbers(self.rank)?[self.rank - 1];
        let second = match quoted(units.text).get(self.rank - 1).map(String::as_str) {
            Some("s" | "sec" | "second" | "seconds") => 1.0,
            Some("ms" | "msec") => 1e-3,
            Some("us" | "usec") => 1e-6,
            _ => 0.0,
        };
        Ok(if step > 0.0 && step.is_finite() { step * second } else { 0.0 })
    }
}

/// One entry an axis: a vector, or `none`.
fn directions(field: &Field<'_>, rank: usize) -> Result<Vec<Option<DVec3>>, FormatError> {
    // Blanks inside the parentheses are allowed: a vector ends at its ')'.
    let mut entries = Vec::new();
    let mut rest = field.text.trim();
    while !rest.is_empty() {
        let end = if rest.starts_with('(') {
            rest.find(')').map(|at| at + 1).ok_or_else(|| field.invalid("a ')' is missing"))?
        } else {
            rest.find(char::is_whitespace).unwrap_or(rest.len())
        };
        entries.push(vector(field, &rest[..end])?);
        rest = rest[end..].trim_start();
    }
    let count = entries.iter().flatten().count();
    if entries.len() == rank && (1..=3).contains(&count) {
        return Ok(entries);
    }
    Err(field.invalid(&format!("{rank} entries, one to three of them vectors, are needed")))
}

/// `(x,y,z)`, or `None` for `none`.
fn vector(field: &Field<'_>, text: &str) -> Result<Option<DVec3>, FormatError> {
    let text = text.trim();
    if text == "none" {
        return Ok(None);
    }
    let inner = text.strip_prefix('(').and_then(|t| t.strip_suffix(')'));
    let numbers: Option<Vec<f64>> =
        inner.and_then(|t| t.split(',').map(|word| word.trim().parse().ok()).collect());
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(Some(DVec3::new(x, y, z))),
        Some(_) => {
            Err(FormatError::unsupported(FORMAT, field.name, format!("'{text}'"), "vectors of three numbers"))
        }
        None => Err(field.invalid("vectors like (1,0,0) are needed")),
    }
}

/// Axes in space must come first, then at most one of frames.
fn check_order(directions: &[Option<DVec3>], in_space: usize, sizes: &[usize]) -> Result<(), FormatError> {
    let first = directions.iter().take_while(|d| d.is_some()).count();
    if first == in_space && directions.len() - in_space <= 1 {
        return Ok(());
    }
    let found = format!("sizes {sizes:?} with a value per voxel of more than one number");
    Err(FormatError::unsupported(
        FORMAT,
        "space directions",
        found,
        "axes in space first, then at most one of frames",
    ))
}

/// No axis in space may be one of vector components, nor may the last.
fn check_kinds(fields: &Fields, rank: usize, in_space: usize) -> Result<(), FormatError> {
    let Some(field) = fields.get("kinds") else { return Ok(()) };
    let kinds: Vec<&str> = field.text.split_whitespace().collect();
    if kinds.len() != rank {
        return Err(field.invalid(&format!("{rank} kinds are needed")));
    }
    for (axis, kind) in kinds.iter().enumerate() {
        let kind = kind.to_ascii_lowercase();
        let plain = matches!(kind.as_str(), "domain" | "space" | "none" | "???" | "unknown");
        let frames = axis >= in_space && matches!(kind.as_str(), "list" | "time");
        if !plain && !frames {
            let found = format!("'{kind}' for axis {axis}");
            return Err(FormatError::unsupported(
                FORMAT,
                "kinds",
                found,
                "domain or space, and list or time for a last axis",
            ));
        }
    }
    Ok(())
}

/// Three columns out of one to three: missing axes stand across the others, one unit long.
fn with_normals(directions: &[DVec3]) -> [DVec3; 3] {
    match *directions {
        [x, y, z] => [x, y, z],
        [x, y] => [x, y, x.cross(y).normalize_or_zero()],
        [x] => {
            let (y, z) = x.normalize_or_zero().any_orthonormal_pair();
            [x, y, z]
        }
        _ => [DVec3::ZERO; 3],
    }
}

/// Bytes from pairs of hexadecimal digits, blanks skipped; at most `size` and a little more.
fn unhex(text: &[u8], size: usize) -> Result<Vec<u8>, FormatError> {
    let digits = text.iter().filter(|b| !b.is_ascii_whitespace());
    let mut out = Vec::new();
    let mut high = None;
    for &digit in digits {
        let Some(value) = char::from(digit).to_digit(16) else {
            return Err(FormatError::invalid(
                FORMAT,
                "voxel data",
                "a character that is no hexadecimal digit",
            ));
        };
        match high.take() {
            None => high = Some(value as u8),
            Some(first) => out.push(first << 4 | value as u8),
        }
        if out.len() > size.saturating_add(SLACK) {
            return Err(FormatError::invalid(
                FORMAT,
                "voxel data",
                format!("more than the {size} bytes the header accounts for"),
            ));
        }
    }
    Ok(out)
}
