//! Reading of point clouds: detection of the format, and checks common to all formats.

use super::mesh_file::{is_text, known_format};
use super::text::without_byte_order_mark;
use super::{FormatError, MeshFile, obj, ply, point_text, stl};
use crate::math::{DVec3, Vec3};
use crate::warning::{Warning, WarningCode};

/// A point cloud, in the order of the file. Each optional array has one entry per point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Positions, in the file's own units, relative to `origin`.
    pub points: Vec<Vec3>,
    /// The origin of the points in world space; 0 unless they are far away for their extent.
    pub origin: DVec3,
    /// Normals as in the file, expected to be of unit length; zero for a point without one.
    pub normals: Option<Vec<Vec3>>,
    /// Colours, rgb in 0..1.
    pub colors: Option<Vec<Vec3>>,
    /// Warnings about the points: parts that were left out, and assumptions.
    pub warnings: Vec<Warning>,
}

impl PointCloud {
    /// Adds a warning of the reader.
    pub(super) fn warn(&mut self, text: impl Into<String>) {
        self.warnings.push(Warning::new(WarningCode::Reader, text));
    }
}

/// Reads the points of a PLY or OBJ file, or of text with a line per point (XYZ, PTS, CSV, TXT); the format is detected
/// from the content.
///
/// The points of a mesh are its vertices, including those with equal positions. Colours are kept if all are within
/// 0..1, and divided by 255 if all are integers up to 255; in PLY, unsigned channels of 8 and 16 bits are first divided
/// by 255 and 65,535. Memory is linear in the size of the file.
///
/// # Text
/// Columns are separated by semicolons, else by commas, else by spaces and tabs, as in the first line of numbers. Empty
/// lines and lines that start with `#`, `//` or `%` are comments. A first line with a single integer announces the
/// number of points, and the line after it may be a comment without a mark.
///
/// Columns may be named in the first line or in a comment before it: `x`, `y`, `z`, and, in complete sets, `nx`, `ny`,
/// `nz`, and `red`, `green`, `blue`, `r`, `g`, `b` or `rf`, `gf`, `bf`; case and quotes do not matter. Instead of `x`, `y` and `z`,
/// `axis-0` to `axis-2` are z, y, x, and `axis-0` to `axis-3` are time, z, y, x. All other columns are ignored: a file
/// with a column of times gives the points of all times.
///
/// Without names, the number of columns determines their meaning:
///
/// - three columns: x y z;
/// - four: x y z and an intensity, which is ignored;
/// - six: x y z and normals if all are of unit length within 1 %, else colours;
/// - seven: x y z, an intensity, a colour;
/// - nine: x y z, a colour and a normal, or the normal first; normals are again recognised by their unit length.
///
/// Lines `p x y z` are points as well; besides them and comments, only lines that start with `d`, `s` or `g` are
/// allowed, and ignored.
///
/// # Errors
/// [`FormatError`] with the format and the field (in text, the line) for bytes in no such format, for files that are
/// truncated or contradictory, for numbers that are not finite in 32 bits, for colours out of range, and for files
/// without points.
pub fn parse_points(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    let text = without_byte_order_mark(bytes);
    let (format, cloud) = parse(text.as_deref().unwrap_or(bytes))?;
    validated(format, cloud)
}

/// Reads points from a file in the format that its bytes indicate; returns the name of the format and the points.
fn parse(bytes: &[u8]) -> Result<(&'static str, PointCloud), FormatError> {
    if ply::is_ply(bytes) {
        return Ok((ply::FORMAT, vertices(ply::parse_vertices(bytes)?)));
    }
    if let Some(found) = unsupported_format(bytes) {
        const ACCEPTED: &str = "PLY, OBJ and text in columns (XYZ, PTS, CSV, TXT)";
        return Err(FormatError::unsupported("point file", "format", found, ACCEPTED));
    }
    if bytes.is_empty() {
        return Err(FormatError::truncated("point file", "content", 1, 0));
    }
    if obj::is_obj(bytes) {
        return Ok((obj::FORMAT, obj::parse_points(bytes)?));
    }
    if point_text::has_keywords(bytes) {
        return Ok((point_text::KEYWORD_FORMAT, point_text::parse_keyword_lines(bytes)?));
    }
    Ok((point_text::FORMAT, point_text::parse(bytes)?))
}

/// Returns the name of an unsupported format that the first bytes indicate; `None` for text that may hold points.
fn unsupported_format(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"glTF") {
        return Some("GLB");
    }
    if stl::is_binary(bytes) || stl::is_text_stl(bytes) {
        return Some("STL");
    }
    known_format(bytes).or(match bytes.trim_ascii_start() {
        [b'{', ..] => Some("JSON"),
        _ if !is_text(bytes) => Some("an unknown binary format"),
        _ => None,
    })
}

fn vertices(MeshFile { mesh, warnings, .. }: MeshFile) -> PointCloud {
    PointCloud {
        points: mesh.positions,
        origin: mesh.origin,
        normals: mesh.normals,
        colors: mesh.colors,
        warnings,
    }
}

/// Returns a point cloud with its colours scaled to 0..1, after checking that it has points, finite numbers, and a
/// normal and colour for each point if for any.
fn validated(format: &'static str, mut cloud: PointCloud) -> Result<PointCloud, FormatError> {
    let count = cloud.points.len();
    if count == 0 {
        return Err(FormatError::invalid(format, "points", "the file has no points"));
    }
    check_finite(format, "points", &cloud.points)?;
    if let Some(normals) = &mut cloud.normals {
        check_count(format, "normals", normals, count)?;
        let broken = without_broken(normals);
        if broken > 0 {
            cloud
                .warn(format!("{broken} of {count} normals are not finite numbers: these points have none."));
        }
    }
    let Some(colors) = cloud.colors.take() else { return Ok(cloud) };
    check_count(format, "colours", &colors, count)?;
    cloud.colors = Some(unit_colors(format, colors)?);
    Ok(cloud)
}

/// Returns an error if one of the vectors, which belong to the points in order, is not finite; `field` names them.
fn check_finite(format: &'static str, field: &str, vectors: &[Vec3]) -> Result<(), FormatError> {
    let Some(i) = vectors.iter().position(|v| !v.is_finite()) else { return Ok(()) };
    let problem = format!("point {i} (zero-based) has {}; numbers must be finite", vectors[i]);
    Err(FormatError::invalid(format, field, problem))
}

/// Replaces vectors that are not finite by 0, and returns their number.
fn without_broken(vectors: &mut [Vec3]) -> usize {
    let broken = vectors.iter_mut().filter(|v| !v.is_finite());
    broken.map(|v| *v = Vec3::ZERO).count()
}

/// Returns an error unless `found`, an array of normals or colours named `field`, has one vector for each of `count`
/// points.
fn check_count(format: &'static str, field: &str, found: &[Vec3], count: usize) -> Result<(), FormatError> {
    if found.len() == count {
        return Ok(());
    }
    let problem = format!("there are {} for {count} points; one per point is needed", found.len());
    Err(FormatError::invalid(format, field, problem))
}

/// Returns the colours scaled to 0..1, from that range or from 0..255; an error if they are out of range.
fn unit_colors(format: &'static str, colors: Vec<Vec3>) -> Result<Vec<Vec3>, FormatError> {
    let full = full_channel(colors.iter().copied()).ok_or_else(|| {
        let problem = "out of range; all must be in 0..1, or integers in 0..255";
        FormatError::invalid(format, "colours", problem)
    })?;
    Ok(colors.into_iter().map(|color| color / full).collect())
}

/// Returns the number that stands for full intensity of a colour channel: 1 if all values are within 0..1, 255 if all
/// are integers up to 255; `None` if they cannot be colours.
pub(super) fn full_channel(colors: impl Iterator<Item = Vec3> + Clone) -> Option<f32> {
    let all = |fits: fn(f32) -> bool| colors.clone().all(|color| color.to_array().into_iter().all(fits));
    if all(|c| (0.0..=1.0).contains(&c)) {
        return Some(1.0);
    }
    all(|c| (0.0..=255.0).contains(&c) && c.fract() == 0.0).then_some(255.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns three points with normals and colours, two of them with equal positions.
    fn sample_cloud() -> PointCloud {
        let p = Vec3::new(0.1, -2.5, 1e10);
        PointCloud {
            origin: DVec3::ZERO,
            points: vec![p, Vec3::new(4.0, 5.0, 6.0), p],
            normals: Some(vec![Vec3::X, Vec3::NEG_Z, Vec3::new(0.6, 0.0, 0.8)]),
            colors: Some(vec![Vec3::new(1.0, 0.0, 0.2), Vec3::ZERO, Vec3::new(0.4, 0.6, 0.8)]),
            warnings: Vec::new(),
        }
    }

    /// Returns one row of numbers per point, x y z, normal and colour, with colours scaled to `full`.
    fn rows(cloud: &PointCloud, full: f32) -> Vec<Vec<f32>> {
        let extras = cloud.normals.iter().flatten().zip(cloud.colors.iter().flatten());
        let row = |(p, (n, c)): (&Vec3, (&Vec3, &Vec3))| {
            [p.to_array(), n.to_array(), (*c * full).to_array()].concat()
        };
        cloud.points.iter().zip(extras).map(row).collect()
    }

    fn text(rows: &[Vec<f32>], before: &str, between: &str) -> String {
        let line = |row: &Vec<f32>| row.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(between);
        rows.iter().map(|row| format!("{before}{}\n", line(row))).collect()
    }

    fn ply_header(encoding: &str, coordinate: &str, color: &str, names: [&str; 3]) -> String {
        let coordinates = ["x", "y", "z", "nx", "ny", "nz"].map(|n| format!("property {coordinate} {n}\n"));
        let colors = names.map(|n| format!("property {color} {n}\n"));
        format!(
            "ply\nformat {encoding} 1.0\ncomment made\nelement camera 1\nproperty list uchar short view\n\
             element vertex 3\nproperty uchar quality\n{}{}element face 1\nproperty uchar flags\n\
             property list uchar int corners\nend_header\n",
            coordinates.concat(),
            colors.concat(),
        )
    }

    fn ply_text(color: &str, full: f32) -> Vec<u8> {
        let header = ply_header("ascii", "float", color, ["red", "green", "blue"]);
        format!("{header}2 7 8\n{}0 2 9 9\n", text(&rows(&sample_cloud(), full), "77 ", " ")).into_bytes()
    }

    /// Returns a binary PLY file of the sample points, with doubles and 16-bit colours.
    fn ply_binary(little: bool) -> Vec<u8> {
        let encoding = if little { "binary_little_endian" } else { "binary_big_endian" };
        let mut out = ply_header(encoding, "double", "ushort", ["r", "g", "b"]).into_bytes();
        let mut put = |mut bytes: Vec<u8>| {
            if little {
                bytes.reverse();
            }
            out.extend(bytes);
        };
        [vec![2], vec![0, 7], vec![0, 8]].into_iter().for_each(&mut put);
        for row in rows(&sample_cloud(), 65535.0) {
            put(vec![77]);
            row[..6].iter().for_each(|&x| put(f64::from(x).to_be_bytes().into()));
            row[6..].iter().for_each(|&x| put((x.round() as u16).to_be_bytes().into()));
        }
        [vec![0], vec![2], vec![0, 0, 0, 9], vec![0, 0, 0, 9]].into_iter().for_each(put);
        out
    }

    fn obj(faces: &str) -> Vec<u8> {
        let (mut vertices, mut normals) = (rows(&sample_cloud(), 1.0), Vec::new());
        for row in &mut vertices {
            normals.push(row.drain(3..6).collect());
        }
        format!("o made\n{}{}{faces}", text(&vertices, "v ", " "), text(&normals, "vn ", " ")).into_bytes()
    }

    fn columns(head: &str, between: &str, full: f32) -> Vec<u8> {
        format!("{head}{}", text(&rows(&sample_cloud(), full), "", between)).into_bytes()
    }

    /// Returns one file of each supported kind of point cloud, all with the same points.
    fn files() -> Vec<(&'static str, Vec<u8>)> {
        vec![
            ("PLY text", ply_text("uchar", 255.0)),
            ("PLY text, floats", ply_text("float", 1.0)),
            ("PLY text, floats of 255", ply_text("float", 255.0)),
            ("PLY little-endian", ply_binary(true)),
            ("PLY big-endian", ply_binary(false)),
            ("OBJ", obj("")),
            ("OBJ, faces without normals", obj("f 1 2 3\n")),
            ("OBJ, faces with normals", obj("f 1//1 2//2 3//3\n")),
            ("XYZ", columns("", " ", 255.0)),
            ("PTS", columns("3\n", " ", 1.0)),
            ("CSV", columns("x,y,z,nx,ny,nz,red,green,blue\n", ",", 255.0)),
        ]
    }

    fn keyed() -> Vec<u8> {
        let rows: Vec<Vec<f32>> = sample_cloud().points.iter().map(|p| p.to_array().into()).collect();
        format!("# made\nd 1 1 1\ns 1 1 1\ng 1 0 0\n{}", text(&rows, "p ", " ")).into_bytes()
    }

    #[test]
    fn every_format_gives_the_same_points() {
        for (name, bytes) in files() {
            let cloud = parse_points(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(
                (&cloud.points, &cloud.normals),
                (&sample_cloud().points, &sample_cloud().normals),
                "{name}"
            );
            for (found, expected) in cloud.colors.unwrap().iter().zip(sample_cloud().colors.unwrap()) {
                assert!((*found - expected).abs().max_element() < 1e-6, "{name}: {found} {expected}");
            }
        }
        let expected = PointCloud { points: sample_cloud().points, ..PointCloud::default() };
        assert_eq!(parse_points(&keyed()).unwrap(), expected);
    }

    #[test]
    fn extras_are_there_only_where_the_file_has_them() {
        let bare = PointCloud { points: vec![Vec3::X, Vec3::Y], ..PointCloud::default() };
        for text in [
            "v 1 0 0\nv 0 1 0\n",
            "v 1 0 \\\r\n0\r\nv 0 1 0\r\n",
            "v 1 0 0 1 1 1\nv 0 1 0\nvn 0 0 1\n",
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
             end_header\n1 0 0\n0 1 0\n",
        ] {
            assert_eq!(parse_points(text.as_bytes()).unwrap(), bare, "{text}");
        }
        let part = "v 1 0 0\nv 0 1 0\nv 0 0 1\nv 9 9 9\nvn 0 0 2\nf 1//1 2//1 3//1\n";
        let normals = parse_points(part.as_bytes()).unwrap().normals.unwrap();
        assert_eq!(normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::ZERO]);
    }

    #[test]
    fn errors_name_the_format_and_field() {
        let ply = |vertices: &str, color: &str| {
            let properties = "property float x\nproperty float y\nproperty double z\n";
            let colors = ["red", "green", "blue"].map(|name| format!("property {color} {name}\n")).concat();
            format!("ply\nformat ascii 1.0\nelement vertex 2\n{properties}{colors}end_header\n{vertices}")
        };
        for (bytes, said) in [
            (
                ply("1 2 3 0 0 0\n4 nan 6 0 0 0\n", "uchar"),
                "PLY: points: point 1 (zero-based) has [4, NaN, 6]",
            ),
            (
                ply("1 2 3 0 0 0\n4 5 1e39 0 0 0\n", "uchar"),
                "PLY: points: point 1 (zero-based) has [4, 5, inf]",
            ),
            (ply("1 2 3 0 0 0\n4 5 6 0 0 256\n", "uchar"), "PLY: colours: out of range"),
            (ply("1 2 3 0 0 0\n4 5 6 0 0 1.5\n", "float"), "PLY: colours: out of range"),
            (ply("1 2 3 0 0 0\n4 5 6 0\n", "float"), "PLY: green: needs 1 bytes"),
            (ply("1 2 3 0 0 0\n4 5 six 0 0 0\n", "float"), "PLY: z: \"six\" is not a number"),
            (ply("", "float").replace("vertex 2", "vertex 4000000000"), "PLY: element vertex: needs"),
            (ply("", "float").replace("vertex 2", "vertex 0"), "PLY: points: the file has no points"),
            ("v 1 2 3\r\nv 1 2\r\n".into(), "OBJ: line 2: must have at least 3 numbers"),
            (String::new(), "point file: content: needs 1 bytes"),
            (
                "solid made\nendsolid\n".into(),
                "point file: format: STL is not supported; accepted: PLY, OBJ and",
            ),
            ("<?xml version=\"1.0\"?>".into(), "point file: format: XML"),
            ("{\"points\": []}".into(), "point file: format: JSON"),
            ("# .PCD v0.7\nVERSION 0.7\n".into(), "point file: format: PCD"),
            ("OFF\n1 0 0\n1 2 3\n".into(), "point file: format: OFF"),
            ("glTF\u{2}\0\0\0".into(), "point file: format: GLB"),
            ("1 2 3\n\0\u{1}".into(), "point file: format: an unknown binary format"),
        ] {
            let error = parse_points(bytes.as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(said), "{bytes:?}: {error}");
        }
        let mut stl = vec![b' '; 80];
        stl.extend([1, 0, 0, 0]);
        stl.extend([0; 50]);
        let error = parse_points(&stl).unwrap_err().to_string();
        assert!(error.starts_with("point file: format: STL"), "{error}");
    }

    /// Asserts that the point cloud in a file, if the bytes are read without an error, has points, one entry per point
    /// in each array, finite numbers, and colours in 0..1. Returns whether the bytes are read.
    fn assert_sound(bytes: &[u8], context: &str) -> bool {
        let Ok(cloud) = parse_points(bytes) else { return false };
        let count = cloud.points.len();
        assert!((1..=bytes.len()).contains(&count), "{context}");
        let normals = cloud.normals.unwrap_or(cloud.points.clone());
        let colors = cloud.colors.unwrap_or(vec![Vec3::ZERO; count]);
        assert_eq!((normals.len(), colors.len()), (count, count), "{context}");
        assert!(cloud.points.iter().chain(&normals).all(|v| v.is_finite()), "{context}");
        assert_eq!(full_channel(colors.into_iter()), Some(1.0), "{context}");
        true
    }

    #[test]
    fn cut_files_are_refused_or_sound() {
        let mut counts = [0; 2];
        for (name, bytes) in files().into_iter().chain([("keyed", keyed())]) {
            for end in 0..bytes.len() {
                counts[usize::from(assert_sound(&bytes[..end], &format!("{name} cut at {end}")))] += 1;
            }
        }
        assert!(counts.iter().all(|&count| count > 100), "{counts:?} refused and read");
        for (name, bytes) in [("little", ply_binary(true)), ("big", ply_binary(false))] {
            (0..bytes.len()).for_each(|end| assert!(parse_points(&bytes[..end]).is_err(), "{name} at {end}"));
        }
    }

    #[test]
    fn files_with_a_wrong_byte_are_refused_or_sound() {
        let mut random = Random::new(1);
        for (name, bytes) in files().into_iter().chain([("keyed", keyed())]) {
            let mut counts = [0; 2];
            for turn in 0..3000 {
                let (at, byte) = (random.below(bytes.len() as u32) as usize, random.below(256) as u8);
                let mut broken = bytes.clone();
                broken[at] = byte;
                let is_read = assert_sound(&broken, &format!("{name}, turn {turn}: byte {at} is {byte}"));
                counts[usize::from(is_read)] += 1;
            }
            assert!(counts.iter().all(|&count| count > 50), "{name}: {counts:?} refused and read");
        }
    }
}
