//! Mesh and point files as other programs write them: what is unusual in them is read right, or said.

use super::common::Random;
use super::common::files::glb;
use vesicle::io::{MeshFile, MeshOptions, parse_mesh, parse_points, read_mesh};
use vesicle::math::Vec3;
use vesicle::mesh::{Measures, measure, report};
use vesicle::volume::Space;

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// The corners of a tetrahedron of volume 4.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]];
const TRIANGLES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

fn read(bytes: &[u8]) -> MeshFile {
    read_mesh(bytes, MeshOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: &[u8]) -> String {
    parse_mesh(bytes).unwrap_err().to_string()
}

/// Asserts that a file has the tetrahedron, and as many warnings as given, which contain these words.
fn assert_tetrahedron(bytes: &[u8], warnings: &[&str]) {
    let file = read(bytes);
    let found = measure(&file.mesh);
    assert_eq!((found.vertices, found.triangles), (4, 4));
    assert!((found.volume - 4.0).abs() < 1e-6, "{}", found.volume);
    assert!(report(&file.mesh).unwrap().is_healthy());
    assert_warned(&file, warnings);
}

fn assert_warned(file: &MeshFile, warnings: &[&str]) {
    let texts: Vec<&str> = file.warnings.iter().map(|warning| warning.text.as_str()).collect();
    assert_eq!(texts.len(), warnings.len(), "{texts:?}");
    assert!(texts.iter().zip(warnings).all(|(text, words)| text.contains(words)), "{texts:?}");
}

fn stl(header: &str, count: u32) -> Vec<u8> {
    let mut out = format!("{header:80}").into_bytes();
    out.extend(count.to_le_bytes());
    for triangle in TRIANGLES {
        out.extend([0; 12]);
        let numbers = triangle.iter().flat_map(|&v| CORNERS[v]);
        numbers.for_each(|x| out.extend(x.to_le_bytes()));
        out.extend([0, 0]);
    }
    out
}

#[test]
fn bytes_after_the_triangles_of_an_stl() {
    let with = |rest: &[u8]| [stl("made", 4).as_slice(), rest].concat();
    for padding in [&[0; 37][..], &[0; 2000], &[b' '; 60], b"\r\n", b"made by a program"] {
        assert_tetrahedron(&with(padding), &[]);
    }
    let data: Vec<u8> = (0..120).collect();
    assert_tetrahedron(&with(&data), &["120 bytes after the 4 triangles"]);
    // A header may be anything, such as a byte order mark.
    assert_tetrahedron(&[b"\xff\xfe", &stl("made", 4)[2..]].concat(), &[]);
    for (count, message) in [
        (5, "STL: triangles: needs 334 bytes, the file has 284"),
        (900, "STL: triangles: needs"),
        (0, "STL: triangle count: implies 84 bytes"),
        (1_000_000, "mesh file: format: an unknown binary format"),
    ] {
        assert!(refusal(&stl("made", count)).starts_with(message), "{}", refusal(&stl("made", count)));
    }
}

#[test]
fn what_is_no_mesh_is_not_called_a_broken_stl() {
    let noise: Vec<u8> = (0..5000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let wide: Vec<u8> =
        "Dear all, this is a letter. ".repeat(9).encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, message) in [
        (&noise[..], "an unknown binary format"),
        (&wide, "an unknown binary format"),
        (b"\xff\xfeD\0e\0a\0r\0", "text without vertices"),
        (b"<!DOCTYPE html>\n<html>", "HTML"),
        (b"PK\x03\x04\x14\0\0\0", "zip"),
        (b"Kaydara FBX Binary  \0", "FBX"),
        (b"OFF\n4 4 6\n", "OFF"),
        (b"solid 1,5\nvertex 1,5 2,5 3,5\nendsolid", "decimal points"),
    ] {
        assert!(refusal(bytes).contains(message), "{message}: {}", refusal(bytes));
    }
}

const OBJ: &str = "v 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 4\n";

/// Returns an OBJ file of the tetrahedron, whose face corners have `suffix` after their index.
fn obj(before: &str, suffix: &str) -> String {
    let corner = |v: &usize| format!(" {}{suffix}", v + 1);
    let face = |t: &[usize; 3]| format!("f{}\n", t.iter().map(corner).collect::<String>());
    format!("{OBJ}{before}{}", TRIANGLES.iter().map(face).collect::<String>())
}

#[test]
fn obj_files_with_normals_and_texture_coordinates_that_are_missing_or_broken() {
    let (normals, coordinates) = ("Faces refer to normals", "Faces refer to texture coordinates");
    for (text, warnings) in [
        (obj("", "/1/1"), &[coordinates, normals][..]),
        (obj("vn 0 0 1\n", "//0"), &[normals]),
        (obj("vn 0 0 1\n", "//2"), &[normals]),
        (obj("vn 0 0 1\n", "//-2"), &[normals]),
        (obj("vn -nan(ind) -nan(ind) -nan(ind)\nvt 1.#QNAN 0\n", ""), &[]),
        (obj("vn nan 0 1.#IND\n", "//1"), &[]),
        (obj("vt -nan(ind) 0\n", "/1"), &["texture coordinates are not finite"]),
        (obj("f 1 2\nf 3\nf\nl 1 2\n", ""), &["fewer than three corners were left out: 3"]),
        (obj("# left to right \\\n", ""), &[]),
        (obj("usemtl none # \\\n", ""), &[]),
        (obj("cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nend\n", ""), &["Free-form surfaces"]),
    ] {
        assert_tetrahedron(text.as_bytes(), warnings);
    }
    let uvs = read(obj("vt 0.25 0.5\n", "/1").as_bytes()).mesh.uvs;
    assert!(uvs.is_some_and(|uvs| uvs.len() == 4));
}

#[test]
fn colours_of_obj_vertices_may_have_an_opacity() {
    for extra in ["1 0 0", "1 0 0 0.5", "255 0 0", "255 0 0 127"] {
        let text = obj("", "").replacen(
            "v 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 4",
            &CORNERS.map(|[x, y, z]| format!("v {x} {y} {z} {extra}")).join("\n"),
            1,
        );
        assert_eq!(read(text.as_bytes()).mesh.colors.unwrap()[0], Vec3::X, "{extra}");
    }
}

#[test]
fn facets_of_text_stl_with_more_than_three_vertices() {
    let facet = |corners: &[[i32; 3]]| {
        let lines: String = corners.iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\r\n")).collect();
        format!("facet normal 0 0 0\r\nouter loop\r\n{lines}endloop\r\nendfacet\r\n")
    };
    let solid = |facets: &str| format!("solid made\r\n{facets}endsolid\r\n");
    let step = facet(&[[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]]);
    let quad = facet(&[[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]);
    let found = measure(&read(solid(&format!("{step}{quad}")).as_bytes()).mesh);
    assert_eq!((found.triangles, found.area), (6, 4.0));
    let error = refusal(solid(&facet(&[[0, 0, 0], [1, 0, 0]])).as_bytes());
    assert!(error.starts_with("STL: line 6: closes a facet"), "{error}");
    let two_words = solid(&quad).replace("endsolid", "END SOLID made");
    assert_eq!(read(two_words.as_bytes()).mesh.triangles.len(), 2);
    let bare = "solid made\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 0\nvertex 0 1 0\nvertex 0 0 1\nendsolid";
    assert_eq!(read(bare.as_bytes()).mesh.triangles.len(), 2);
}

#[test]
fn obj_files_in_any_order_and_encoding() {
    let whole = obj("", "");
    let faces_first = format!("{}{OBJ}", &whole[OBJ.len()..]);
    let unended = format!("{whole}f 2 3 \\\n 4\\");
    let marked = format!("\u{feff}{whole}");
    for text in [&faces_first, &marked, &whole.replace('\n', "\r"), &whole.replace(' ', "\t")] {
        assert_tetrahedron(text.as_bytes(), &[]);
    }
    assert_eq!(read(unended.as_bytes()).mesh.triangles.len(), 5, "the last line is continued by nothing");
    for to_bytes in [u16::to_le_bytes, u16::to_be_bytes] {
        let wide: Vec<u8> = marked.encode_utf16().flat_map(to_bytes).collect();
        assert_tetrahedron(&wide, &[]);
    }
    // Relative to the vertices before the face.
    let relative =
        "v 9 9 9\nv 0 0 0\nv 2 0 0\nv 0 3 0\nf -3 -1 -2\nv 0 0 4\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n";
    assert_tetrahedron(relative.as_bytes(), &[]);
    for (text, message) in [
        (
            "v 0 0 0\nf 1 2 3\nv 1 0 0\n",
            "OBJ: line 2: v index 3 is out of range; must be 1 to 2, or −1 to −2",
        ),
        ("f 1 2 3\n v 0 0 0\nv 0 1 0\n", "OBJ: line 1: v index 3"),
        ("v 1 2 3\nf 1 1 0\n", "OBJ: line 2: v index 0"),
        ("v 1 2 3\nf 1/x 1 1\n", "OBJ: line 2: index x must be an integer"),
    ] {
        assert!(refusal(text.as_bytes()).starts_with(message), "{}", refusal(text.as_bytes()));
    }
}

/// Returns the measures of the mesh in an OBJ file with one face.
fn face(corners: &[[f64; 3]]) -> Measures {
    let vertex = |[x, y, z]: &[f64; 3]| format!("v {x} {y} {z}\n");
    let vertices: String = corners.iter().map(vertex).collect();
    let indices: String = (1..=corners.len()).map(|k| format!(" {k}")).collect();
    measure(&parse_mesh(format!("{vertices}f{indices}\n").as_bytes()).unwrap())
}

#[test]
fn concave_polygons_are_covered_once() {
    let step =
        [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]].map(|[x, y]| [f64::from(x), f64::from(y), 0.0]);
    assert_eq!(face(&step).area, 3.0);
    // A wall with a notch, in the plane x + y = 8e5, in metres of a survey.
    let notch =
        [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [3.0, 3.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let wall = notch.map(|[u, z]| [4e5 + 0.6 * u, 4e5 + 0.8 * u, z]);
    assert!((face(&wall).area - 8.0).abs() < 1e-3, "{}", face(&wall).area);
    // Not flat: the reflex corner is lifted.
    let lifted = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 0.2], [0.0, 4.0, 0.0]];
    let area = face(&lifted).area;
    assert!((4.0..4.3).contains(&area), "{area}");
}

#[test]
fn prisms_of_concave_polygons_are_closed() {
    let outline = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];
    let vertices: String = [0, 1].map(|z| outline.map(|[x, y]| format!("v {x} {y} {z}\n")).concat()).concat();
    let sides: String =
        (0..6).map(|k| format!("f {} {} {} {}\n", k + 1, (k + 1) % 6 + 1, (k + 1) % 6 + 7, k + 7)).collect();
    let obj = format!("{vertices}f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n{sides}");
    let list = |count: usize, numbers: String| format!("{count} {numbers}\n");
    let ply_sides: String =
        (0..6).map(|k| list(4, format!("{k} {} {} {}", (k + 1) % 6, (k + 1) % 6 + 6, k + 6))).collect();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\n\
         element face 8\nproperty list uchar int vertex_indices\nend_header\n{}6 5 4 3 2 1 0\n6 6 7 8 9 10 11\n{ply_sides}",
        vertices.replace("v ", "")
    );
    for text in [obj, ply] {
        let mesh = parse_mesh(text.as_bytes()).unwrap();
        let found = measure(&mesh);
        assert_eq!((found.triangles, found.volume, found.area), (20, 3.0, 14.0));
        assert!(report(&mesh).unwrap().is_healthy());
    }
}

#[test]
fn polygons_with_too_many_corners_are_said() {
    let corner = |k: u32| format!("v {} {} 0\n", (k * 7919) % 10_007, (k * k) % 9973);
    let count = 9000;
    let text: String = (0..count).map(corner).collect();
    let faces: String = (1..=count).map(|k| format!(" {k}")).collect();
    let file = read(format!("{text}f{faces}\n").as_bytes());
    assert_warned(&file, &["Concave polygons with too many corners"]);
}

/// Returns what the reader says about an OBJ file with one face.
fn warnings_about_face(corners: &[[f64; 3]]) -> Vec<String> {
    let vertices: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let indices: String = (1..=corners.len()).map(|k| format!(" {k}")).collect();
    read(format!("{vertices}f{indices}\n").as_bytes())
        .warnings
        .into_iter()
        .map(|warning| warning.text)
        .collect()
}

#[test]
fn polygons_that_intersect_themselves_are_said() {
    let bow_tie = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let uneven = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.3], [1.0, 0.0, 0.3], [0.0, 0.5, 0.0]];
    let star = [0, 2, 4, 1, 3].map(|k| {
        let (y, x) = libm::sincos(f64::from(k) * std::f64::consts::TAU / 5.0);
        [x, y, 0.5 * x]
    });
    let zigzag: Vec<[f64; 3]> = (0..50).map(|k| [f64::from(k) + 0.5, f64::from(k % 2) * 9.0, 0.0]).collect();
    let back = (0..50).rev().map(|k| [f64::from(k) + 0.5, f64::from((k + 1) % 2) * 9.0, 0.0]);
    let zigzag: Vec<[f64; 3]> = zigzag.into_iter().chain(back).collect();
    for face in [&bow_tie[..], &uneven, &star, &zigzag] {
        let found = warnings_about_face(face);
        assert!(found.len() == 1 && found[0].starts_with("Polygons that intersect themselves"), "{found:?}");
        assert!(found[0].contains(": 1."), "{found:?}");
    }
}

#[test]
fn polygons_that_are_bent_or_rounded_are_not_said_to_intersect_themselves() {
    // Four corners of a regular tetrahedron, the most that a square can be bent without a fold.
    let skew = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0]];
    let dart = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 1.5], [0.0, 4.0, 0.0]];
    // A sliver of five corners in a row, rounded to six digits.
    let sliver = [[0.0, 0.0], [1.0, 1e-6], [2.0, 0.0], [1.2, -1e-6], [0.7, 1e-6]].map(|[x, y]| [x, y, 0.5]);
    // There and back.
    let line = [0.0, 1.0, 2.0, 1.0].map(|x| [x, 0.3 * x, 0.7 * x]);
    for face in [&skew[..], &dart, &sliver, &line] {
        assert_eq!(warnings_about_face(face), [""; 0]);
    }
}

fn ply(header: &str, body: &[u8]) -> Vec<u8> {
    let mut out = format!("{header}end_header\n").into_bytes();
    CORNERS.as_flattened().iter().for_each(|x| out.extend(x.to_le_bytes()));
    out.extend(body);
    out
}

const VERTICES: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";

#[test]
fn strips_of_triangles_in_ply() {
    let strips = "element tristrips 2\nproperty list int int vertex_indices\n";
    let body = |records: &[&[i32]]| {
        let record = |strip: &&[i32]| [&[strip.len() as i32], *strip].concat();
        records.iter().flat_map(record).flat_map(i32::to_le_bytes).collect::<Vec<u8>>()
    };
    let header = format!("ply\nformat binary_little_endian 1.0\n{VERTICES}{strips}");
    assert_tetrahedron(&ply(&header, &body(&[&[0, 2, 1, 3, 0, 2], &[]])), &[]);
    assert_tetrahedron(
        &ply(&header, &body(&[&[0, 2, 1, -1, 0, 1, 3, -1, -1], &[1, 2, 3, -1, 2, 0, 3]])),
        &[],
    );
    let error = refusal(&ply(&header, &body(&[&[0, 1, 2], &[0, 1, 4]])));
    assert!(error.starts_with("PLY: tristrips 1: vertex index 4 is out of range"), "{error}");
}

/// Returns a text PLY file of the tetrahedron, with a colour per vertex.
fn ply_text(comment: &str, vertex: &str, faces: &str) -> String {
    let corners = CORNERS.map(|[x, y, z]| format!("{x} {y} {z} {vertex}\n")).concat();
    let triangles = TRIANGLES.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat();
    let count = 4 + faces.lines().count();
    format!(
        "ply\nformat ascii 1.0\n{comment}{VERTICES}property float red\nproperty float green\nproperty float blue\n\
         element face {count}\nproperty list uchar int vertex_indices\nend_header\n{corners}{triangles}{faces}"
    )
}

#[test]
fn ply_files_of_careless_writers() {
    let color = "0 51 255";
    assert_tetrahedron(ply_text("comment café\nobj_info\n", color, "").as_bytes(), &[]);
    assert_tetrahedron(
        ply_text("made by a program\n", color, "").as_bytes(),
        &["\"made by a program\" of the header"],
    );
    assert_tetrahedron(
        ply_text("", color, "2 0 1\n1 0\n0\n").as_bytes(),
        &["fewer than three corners were left out: 3"],
    );
    assert_tetrahedron(ply_text("", "-nan(ind) 0 0", "").as_bytes(), &["colours are not finite"]);
    assert_tetrahedron(ply_text("", color, "").replacen("ply\n", "ply \n", 1).as_bytes(), &[]);
    assert_tetrahedron(format!("{}\n\n\u{1a}", ply_text("", color, "")).as_bytes(), &[]);
    assert_tetrahedron(format!("{}made by a program", ply_text("", color, "")).as_bytes(), &["What follows"]);
    let colors = read(ply_text("", color, "").as_bytes()).mesh.colors.unwrap();
    assert_eq!(colors[0], Vec3::new(0.0, 0.2, 1.0), "of 255");
    for (text, message) in [
        (ply_text("", "0 51 255 7", ""), "PLY: "),
        (
            ply_text("", color, "").replace("3 0 2 1\n", "3 0 2 1 3 0 2 1\n"),
            "PLY: body: has more numbers in a line",
        ),
        (ply_text("", color, "").replace("element face", "elemnt face"), "PLY: header: \"elemnt face 4\""),
        (
            ply_text("elemnt strange 4\nproperty float x\n", color, ""),
            "PLY: property: must follow an element",
        ),
    ] {
        assert!(refusal(text.as_bytes()).starts_with(message), "{}", refusal(text.as_bytes()));
    }
}

#[test]
fn the_space_of_a_file_is_that_of_its_comment() {
    let comment = |text: &str| ply_text(&format!("comment {text}\n"), "0 0 0", "").into_bytes();
    let solid =
        "solid 3D Slicer output. SPACE=RAS\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendsolid";
    for (bytes, space) in [
        (stl("3D Slicer output. SPACE=RAS", 4), Some(Space::Ras)),
        (stl("SPACE=LPS", 4), Some(Space::Lps)),
        (stl("SPACE=left", 4), None),
        (solid.as_bytes().to_vec(), Some(Space::Ras)),
        (comment("SPACE=LPS"), Some(Space::Lps)),
        (comment("in space"), None),
        (format!("# SPACE=RAS\n{}", obj("", "")).into_bytes(), Some(Space::Ras)),
        (obj("", "").into_bytes(), None),
    ] {
        assert_eq!(read(&bytes).space, space);
    }
}

/// A glTF document of the tetrahedron: positions and 16-bit indices in the buffer that `DATA` is; `node`, `primitive` and
/// `more` are members of its node, its primitive and the document, each with a comma.
fn gltf(node: &str, primitive: &str, more: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0{node}}},{{"translation":[1,0,0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1{primitive}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}},
        {{"bufferView":2,"componentType":5126,"count":2,"type":"VEC3"}},
        {{"componentType":5126,"count":4,"type":"VEC3","sparse":{{"count":1,
        "indices":{{"bufferView":1,"componentType":5123,"byteOffset":2}},"values":{{"bufferView":2,"byteOffset":12}}}}}},
        {{"bufferView":3,"componentType":5121,"count":4,"type":"VEC4"}},
        {{"bufferView":4,"componentType":5126,"count":4,"type":"VEC4"}},
        {{"bufferView":5,"componentType":5126,"count":2,"type":"MAT4"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}},
        {{"buffer":0,"byteOffset":72,"byteLength":24}},{{"buffer":0,"byteOffset":96,"byteLength":16}},
        {{"buffer":0,"byteOffset":112,"byteLength":64}},{{"buffer":0,"byteOffset":176,"byteLength":128}}],
        "buffers":[{{"byteLength":304}}]{more}}}"#
    )
}

/// The buffer of [`gltf`]: positions, indices, two displacements, joints 0, 0, 0, 1 of the vertices, their weights, and two
/// inverse bind matrices, of which the second moves by −1 along z.
fn buffer() -> Vec<u8> {
    let mut out = Vec::new();
    let mut floats = |numbers: &[f32]| out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    floats(CORNERS.as_flattened());
    out.extend(TRIANGLES.as_flattened().iter().flat_map(|&v| (v as u16).to_le_bytes()));
    let mut floats = |numbers: &[f32]| out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    floats(&[10.0, 0.0, 0.0, 0.0, 20.0, 2.0]);
    [0, 0, 0, 1_u8].iter().for_each(|&joint| out.extend([joint, 0, 0, 0]));
    let mut floats = |numbers: &[f32]| out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    (0..4).for_each(|_| floats(&[0.5, 0.0, 0.0, 0.0]));
    for shift in [0.0, -1.0] {
        floats(&[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, shift, 1.0]);
    }
    out
}

fn glb_measures(node: &str, primitive: &str, more: &str) -> Measures {
    let file = read(&glb(&gltf(node, primitive, more), &buffer()));
    assert!(report(&file.mesh).unwrap().is_healthy());
    assert_warned(&file, &[]);
    measure(&file.mesh)
}

#[test]
fn instances_of_a_gltf_mesh() {
    let instancing =
        r#","extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2}}},"scale":[1,-1,1]"#;
    for required in ["", r#","extensionsRequired":["EXT_mesh_gpu_instancing"]"#] {
        let found = glb_measures(instancing, "", required);
        assert_eq!((found.vertices, found.components), (8, 2));
        assert!((found.volume - 8.0).abs() < 1e-6);
        assert_eq!(found.bounds.map(|p| p.to_array()), [[0.0, -23.0, 0.0], [12.0, 0.0, 6.0]]);
    }
    let uneven = instancing.replace(r#""TRANSLATION":2"#, r#""TRANSLATION":2,"SCALE":0"#);
    let error = refusal(&glb(&gltf(&uneven, "", ""), &buffer()));
    assert!(error.starts_with("GLB: EXT_mesh_gpu_instancing: attributes must be equally many"), "{error}");
}

/// Returns a GLB whose nodes share one mesh of `count` triangles with normals, all with the same accessors.
fn shared_mesh(nodes: usize, count: usize) -> Vec<u8> {
    let nodes = vec![r#"{"mesh":0}"#; nodes].join(",");
    let vector = format!(r#"{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}}"#, 3 * count);
    let size = 36 * count;
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":0}}}}]}}],
        "accessors":[{vector}],"bufferViews":[{{"buffer":0,"byteLength":{size}}}],"buffers":[{{"byteLength":{size}}}]}}"#
    );
    let mut random = Random(7);
    let numbers = (0..9 * count).flat_map(|_| random.unit().to_le_bytes());
    glb(&json, &numbers.collect::<Vec<_>>())
}

#[test]
fn a_small_file_does_not_become_a_huge_mesh() {
    // 20 million triangle corners in 75 kB: fewer than the largest number, but with attributes more than a gigabyte.
    let file = shared_mesh(5000, 560);
    assert!(file.len() < 100_000);
    let error = refusal(&file);
    assert!(error.starts_with("GLB: nodes") && error.contains("needs 235200000 bytes"), "{error}");
    // As much as a scene with repeated parts may need.
    let mesh = parse_mesh(&shared_mesh(40, 560)).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (1680, 40 * 560));
}

#[test]
fn primitives_that_share_their_vertices_have_those_that_they_use() {
    // 400 materials of one mesh of 30,000 vertices: as one mesh these would be 12 million.
    let count = 10_000;
    let primitive = |k: usize| format!(r#"{{"attributes":{{"POSITION":0,"NORMAL":0}},"indices":{}}}"#, k + 1);
    let accessor = |k: usize| {
        let at = 36 * count + 12 * 25 * k;
        format!(r#"{{"bufferView":1,"byteOffset":{at},"componentType":5125,"count":75,"type":"SCALAR"}}"#)
    };
    let size = 36 * count + 12 * count;
    let list = |entry: &dyn Fn(usize) -> String| (0..400).map(entry).collect::<Vec<_>>().join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}},{}],
        "bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteLength":{size}}}],
        "buffers":[{{"byteLength":{size}}}]}}"#,
        list(&primitive),
        3 * count,
        list(&accessor),
        36 * count
    );
    let mut random = Random(8);
    let mut bytes: Vec<u8> = (0..9 * count).flat_map(|_| random.unit().to_le_bytes()).collect();
    // From last to first, so that what is left out is not the end.
    bytes.extend((0..3 * count as u32).rev().flat_map(u32::to_le_bytes));
    let mesh = parse_mesh(&glb(&json, &bytes)).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3 * count, count));
    let number = |k: usize| f32::from_le_bytes(bytes[4 * k..4 * k + 4].try_into().unwrap());
    let corner = mesh.positions[mesh.triangles[0][0] as usize];
    let last = 9 * count - 3;
    assert_eq!(corner.to_array(), [number(last), number(last + 1), number(last + 2)]);
}

#[test]
fn default_weights_of_morph_targets() {
    // Vertex 2, by the sparse indices, is moved by (0, 20, 2).
    let target = r#","targets":[{"POSITION":3},{"POSITION":0}]"#;
    let found = glb_measures(r#","weights":[0.5,0]"#, target, "");
    assert_eq!(found.bounds[1].to_array(), [2.0, 13.0, 4.0]);
    let of_mesh = gltf("", target, "").replace(r#""meshes":[{"#, r#""meshes":[{"weights":[0,1],"#);
    assert_eq!(measure(&parse_mesh(&glb(&of_mesh, &buffer())).unwrap()).volume, 32.0);
    let of_node = of_mesh.replace(r#"{"mesh":0"#, r#"{"mesh":0,"weights":[0,0]"#);
    assert_eq!(measure(&parse_mesh(&glb(&of_node, &buffer())).unwrap()).volume, 4.0);
    let negative = gltf(r#","weights":["x"]"#, target, "");
    assert!(refusal(&glb(&negative, &buffer())).starts_with("GLB: weights"));
}

#[test]
fn sparse_accessors() {
    let sparse = gltf("", "", "").replace(r#""bufferView":0,"componentType":5126,"count":4,"type":"VEC3""#,
        r#""bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,
        "indices":{"bufferView":1,"componentType":5123,"byteOffset":2},"values":{"bufferView":2,"byteOffset":12}}"#);
    let mesh = parse_mesh(&glb(&sparse, &buffer())).unwrap();
    assert_eq!(measure(&mesh).bounds[1].to_array(), [2.0, 20.0, 4.0]);
    for (from, to) in [
        (r#""sparse":{"count":1"#, r#""sparse":{"count":2"#),
        (r#""componentType":5123,"byteOffset":2"#, r#""componentType":5123,"byteOffset":99"#),
        (r#""componentType":5123,"byteOffset":2"#, r#""componentType":5125,"byteOffset":0"#),
    ] {
        assert!(sparse.contains(from));
        let error = refusal(&glb(&sparse.replacen(from, to, 1), &buffer()));
        assert!(error.starts_with("GLB: accessors[0].sparse"), "{error}");
    }
}

#[test]
fn skins_have_the_pose_of_their_joints() {
    let attributes = |document: String| {
        document.replace(r#""POSITION":0}"#, r#""POSITION":0,"JOINTS_0":4,"WEIGHTS_0":5}"#)
    };
    let skins = r#","skins":[{"joints":[0,1],"inverseBindMatrices":6}]"#;
    // The transform of the node does not count, as a skinned mesh is where its joints are; here the node is joint 0, too.
    let document = attributes(gltf(r#","skin":0,"scale":[2,2,2]"#, "", skins));
    let mesh = parse_mesh(&glb(&document, &buffer())).unwrap();
    let found = measure(&mesh);
    // Vertices 0 to 2 are doubled, and vertex 3 is moved by (1, 0, −1).
    assert_eq!(found.bounds.map(|p| p.to_array()), [[0.0; 3], [4.0, 6.0, 3.0]]);
    assert_eq!(found.volume, 12.0);
    let mirrored = document.replace(r#""scale":[2,2,2]"#, r#""scale":[-2,2,2]"#);
    assert!(measure(&parse_mesh(&glb(&mirrored, &buffer())).unwrap()).volume > 0.0);
    for (from, to, message) in [
        (r#""joints":[0,1]"#, r#""joints":[0]"#, "GLB: JOINTS: joint 1 is out of range"),
        (r#""joints":[0,1]"#, r#""joints":[0,7]"#, "GLB: skins[0]: joint 7 is no node"),
        (r#""joints":[0,1]"#, r#""joints":[0,1,0]"#, "GLB: skins[0]: has fewer"),
        (r#","JOINTS_0":4"#, "", "GLB: attributes: a mesh with a skin"),
        (r#""skin":0"#, r#""skin":1"#, "GLB: skins: index 1"),
    ] {
        let error = refusal(&glb(&document.replace(from, to), &buffer()));
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn gltf_with_its_buffer_in_a_data_uri_or_beside_it() {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let coded: String = buffer()
        .chunks(3)
        .flat_map(|b| {
            let word = b.iter().fold(0, |word, &b| word << 8 | u32::from(b)) << (8 * (3 - b.len()));
            (0..=b.len()).map(move |k| char::from(DIGITS[(word >> (18 - 6 * k) & 63) as usize]))
        })
        .collect();
    let with = |uri: &str| {
        gltf("", "", "").replace(r#""byteLength":304"#, &format!(r#""byteLength":304,"uri":"{uri}""#))
    };
    let inside = with(&format!("data:application/octet-stream;base64,{coded}"));
    assert_tetrahedron(&glb(&inside, &[]), &[]);
    assert_tetrahedron(inside.as_bytes(), &[]);
    assert_tetrahedron(format!("\u{feff}\n{inside}").as_bytes(), &[]);

    let beside = with("parts/a%20tetra.bin");
    let bytes = buffer();
    for name in ["parts/a tetra.bin", "a tetra.bin", "./parts/a tetra.bin", "other\\a tetra.bin"] {
        let files: &[(&str, &[u8])] = &[("other.bin", &[]), (name, &bytes)];
        let options = || MeshOptions { files, texture: None };
        assert_eq!(measure(&read_mesh(beside.as_bytes(), options()).unwrap().mesh).volume, 4.0, "{name}");
        assert_eq!(measure(&read_mesh(&glb(&beside, &[]), options()).unwrap().mesh).volume, 4.0, "{name}");
    }
    for (document, message) in [
        (beside, "glTF: buffers[0]: is in the file 'parts/a tetra.bin', which is needed as well"),
        (gltf("", "", ""), "glTF: buffers[0]: has no data"),
        (with("data:,abc"), "glTF: buffers[0].uri: must be a base64 data URI"),
        (inside.replace("\"2.0\"", "\"1.0\""), "glTF: asset: 1.0 is not supported; accepted: 2.0"),
        ("{\"points\": []}".into(), "glTF: asset: JSON text without a version"),
        ("{ no".into(), "glTF: JSON: "),
    ] {
        assert!(refusal(document.as_bytes()).starts_with(message), "{}", refusal(document.as_bytes()));
    }
}

#[test]
fn images_of_gltf_beside_it() {
    let uvs = gltf(
        "",
        r#","material":0"#,
        r#","materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
        "textures":[{"source":0}],"images":[{"uri":"skin.jpg"}]"#,
    )
    .replace(r#""POSITION":0}"#, r#""POSITION":0,"TEXCOORD_0":7}"#)
    .replace(
        r#""type":"MAT4"}"#,
        r#""type":"MAT4"},{"bufferView":0,"byteOffset":0,"componentType":5126,"count":4,"type":"VEC2"}"#,
    );
    let file = read(&glb(&uvs, &buffer()));
    assert_warned(&file, &["The texture is in the file 'skin.jpg', which is not there"]);
    assert!(file.mesh.uvs.is_some() && file.mesh.texture.is_none());
    let options = MeshOptions { files: &[("skin.jpg", &b"\xff\xd8\xff picture"[..])], texture: None };
    let file = read_mesh(&glb(&uvs, &buffer()), options).unwrap();
    assert!(file.mesh.texture.is_some() && file.warnings.is_empty());
}

#[test]
fn unusual_gltf_documents() {
    let required = |name: &str| format!(r#","extensionsRequired":["{name}"]"#);
    for name in
        ["KHR_materials_unlit", "KHR_techniques_webgl", "KHR_lights_punctual", "KHR_texture_transform"]
    {
        assert_eq!(glb_measures("", "", &required(name)).volume, 4.0);
    }
    for (name, accepted) in [
        ("MPEG_mesh_linking", "accepted: files that do not require it"),
        ("KHR_draco_mesh_compression", "accepted: files without compression"),
        ("EXT_meshopt_compression", "accepted: files without compression"),
    ] {
        let error = refusal(&glb(&gltf("", "", &required(name)), &buffer()));
        assert!(error.contains(&format!("{name} is not supported; {accepted}")), "{error}");
    }
    let padded = format!("\u{feff}{}\0\0\0", gltf("", "", ""));
    assert_tetrahedron(&glb(&padded, &buffer()), &[]);
    let stride = gltf("", "", "").replace(r#""byteLength":48}"#, r#""byteLength":48,"byteStride":0}"#);
    assert_tetrahedron(&glb(&stride, &buffer()), &[]);
    // A chunk of JSON whose length does not count its padding.
    let (json, used) = (
        format!("{:<1$}", gltf("", "", ""), gltf("", "", "").len().next_multiple_of(4)),
        gltf("", "", "").len(),
    );
    assert!(used < json.len());
    let mut uncounted = glb(&json, &buffer());
    uncounted[12..16].copy_from_slice(&(used as u32).to_le_bytes());
    assert_tetrahedron(&uncounted, &[]);
    let hidden = gltf(r#","children":[1]"#, "", "").replace(
        r#"{"translation":[1,0,0]}"#,
        r#"{"mesh":0,"translation":[9,0,0],"extensions":{"KHR_node_visibility":{"visible":false}}}"#,
    );
    assert_tetrahedron(&glb(&hidden, &buffer()), &[]);
}

#[test]
fn point_files_as_other_programs_write_them() {
    for (text, count, colors) in [
        // CloudCompare, with a line for the number of points.
        ("//X;Y;Z;Rf;Gf;Bf;Scalar;Nx;Ny;Nz\n2\n1;2;3;1;0.5;0;7;0;0;1\n4;5;6;1;0.5;0;nan;0;0;1\n", 2, true),
        ("1,2,3,\n4,5,6,\n", 2, false),
        ("x;y;z;name\n1;2;3;\n4;5;6;b\n", 2, false),
        ("1 2 3 nan\n4 5 6 -nan(ind)\n", 2, false),
        ("1 2 3 -1.#IND 255 0 0\n4 5 6 0 0 0 255\n", 2, true),
        ("\u{feff}\"X\",\"Y\",\"Z\"\n1,2,3\n", 1, false),
    ] {
        let cloud = parse_points(text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!((cloud.points.len(), cloud.colors.is_some()), (count, colors), "{text}");
        assert!(cloud.warnings.is_empty());
    }
    let wide: Vec<u8> = "\u{feff}1 2 3\r\n4 5 6\r\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(parse_points(&wide).unwrap().points[1], Vec3::new(4.0, 5.0, 6.0));
    let nan = parse_points(b"x y z nx ny nz\n1 2 3 0 0 1\n").unwrap();
    assert!(nan.warnings.is_empty());
}

#[test]
fn points_without_a_normal_are_said() {
    let header = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n\
                  property float nx\nproperty float ny\nproperty float nz\nend_header\n";
    let text =
        format!("{header}500000.123 4500000.25 101.5 nan nan nan\n500000.373 4500000.75 101.625 0 0 1\n");
    let cloud = parse_points(text.as_bytes()).unwrap();
    assert_eq!(cloud.normals, Some(vec![Vec3::ZERO, Vec3::Z]));
    assert!(cloud.warnings[0].text.starts_with("1 of 2 normals are not finite"), "{:?}", cloud.warnings);
    let apart = (cloud.points[1] - cloud.points[0]).as_dvec3();
    assert!((apart.x - 0.25).abs() < 1e-6 && (apart.y - 0.5).abs() < 1e-6, "{apart}");
}

#[test]
fn many_byte_order_marks_are_no_deep_recursion() {
    for mark in [&b"\xef\xbb\xbf"[..], b"\xff\xfe", b"\xfe\xff"] {
        let bytes = mark.repeat(400_000);
        assert!(refusal(&bytes).starts_with("mesh file: format"));
        assert!(parse_points(&bytes).is_err());
    }
}

/// Returns small files with what this module is about.
fn samples() -> Vec<Vec<u8>> {
    let skins = r#","skins":[{"joints":[0,1],"inverseBindMatrices":6}]"#;
    let skinned = gltf(r#","skin":0,"weights":[0.5]"#, r#","targets":[{"POSITION":3}]"#, skins)
        .replace(r#""POSITION":0},"indices""#, r#""POSITION":0,"JOINTS_0":4,"WEIGHTS_0":5},"indices""#);
    let instanced =
        gltf(r#","extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2}}}"#, "", "");
    let strips = "element tristrips 2\nproperty list int int vertex_indices\n";
    let header = format!("ply\nformat binary_little_endian 1.0\n{VERTICES}{strips}");
    let records = [6, 0, 2, 1, 3, 0, 2, 3, 0, 1, -1_i32].map(i32::to_le_bytes).concat();
    let prism = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\nf 1/1/1 2//1 3 4 5 6\nf 7 1 2\n";
    vec![
        glb(&skinned, &buffer()),
        glb(&instanced, &buffer()),
        ply(&header, &records),
        prism.into(),
        ply_text("made by a program\n", "0 51 255", "6 0 1 2 3 0 1\n2 0 1\n").into_bytes(),
        [stl("SPACE=RAS", 4), (0..120).collect()].concat(),
    ]
}

#[test]
fn unusual_files_with_changed_bytes_give_a_mesh_or_an_error() {
    for (n, sample) in samples().iter().enumerate() {
        let mut read = 0;
        for seed in 0..3000_u64 {
            let mut random = Random(3000 * n as u64 + seed);
            let mut bytes = sample.clone();
            for _ in 0..1 + random.below(3) {
                let at = random.below(bytes.len());
                bytes[at] =
                    if random.below(2) == 0 { b'0' + random.below(10) as u8 } else { random.next() as u8 };
            }
            let found = read_mesh(&bytes, MeshOptions::default());
            read += usize::from(found.is_ok_and(|file| file.mesh.validate().is_ok()));
        }
        assert!((100..3000).contains(&read), "sample {n}: {read} of 3000 are read");
    }
}
