//! Mesh files: real ones, hand-made ones of every kind, round trips, and broken ones.

use super::common::Random;
use super::common::files::glb;
use super::common::shapes::{octahedron, octahedron_with_seam};
use std::sync::Arc;
use vesicle::io::{
    FormatError, MeshFile, MeshFormat, MeshOptions, parse_mesh, read_mesh, write_animation, write_mesh,
};
use vesicle::math::{Vec2, Vec3};
use vesicle::mesh::{MeshError, Texture, TriangleMesh, measure, report};

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const KNOT: &[u8] = include_bytes!("../data/meshes/knot.ply");
const FUZE: &[u8] = include_bytes!("../data/meshes/fuze.obj");
const SPOT: &[u8] = include_bytes!("../data/meshes/spot.glb");
const DRACO: &[u8] = include_bytes!("../data/meshes/suzi_draco.glb");

fn describe(mesh: &TriangleMesh) -> (usize, usize, usize, i64) {
    let m = measure(mesh);
    (m.vertices, m.triangles, m.components, m.genus)
}

#[test]
fn real_files_are_closed() {
    for (bytes, expected, self_intersections) in
        [(KNOT, (1440, 2880, 1, 1), 0), (FUZE, (502, 1000, 1, 0), 0), (SPOT, (2930, 5856, 1, 0), 0)]
    {
        let mesh = parse_mesh(bytes).unwrap();
        assert_eq!(describe(&mesh), expected);
        let found = report(&mesh).unwrap();
        assert!(found.closed && found.oriented && found.non_manifold_edges == 0, "{found:?}");
        assert_eq!(
            (found.non_manifold_vertices, found.self_intersections),
            (0, self_intersections),
            "{found:?}"
        );
        assert!(measure(&mesh).volume > 0.0);
    }
}

#[test]
fn real_files_have_texture_coordinates() {
    let spot = parse_mesh(SPOT).unwrap();
    assert!(spot.corner_uvs.is_some() && spot.uvs.is_none(), "spot has seams");
    assert_eq!(spot.split_at_seams().positions.len(), 3225);
    let fuze = parse_mesh(FUZE).unwrap();
    assert_eq!(fuze.split_at_seams().positions.len(), 664);
    assert!(fuze.normals.unwrap().iter().all(|n| n.is_normalized()));
}

#[test]
fn required_compression_is_refused_by_name() {
    let error = parse_mesh(DRACO).unwrap_err();
    assert!(matches!(error, FormatError::Unsupported { format: "GLB", .. }), "{error}");
    assert!(error.to_string().contains("KHR_draco_mesh_compression"), "{error}");
}

/// Returns the file with one piece of text replaced, padded with blanks to the same length.
fn patched(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = file.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
    let mut file = file.to_vec();
    file[at..at + from.len()].copy_from_slice(format!("{to:<0$}", from.len()).as_bytes());
    file
}

#[test]
fn optional_compression_is_refused_if_there_is_no_uncompressed_data() {
    let draco = patched(DRACO, r#","extensionsRequired":["KHR_draco_mesh_compression"]"#, "");
    // Refused when the primitives are read, since the list of required extensions is gone.
    let error = parse_mesh(&draco).unwrap_err().to_string();
    assert!(error.starts_with("GLB: primitives: KHR_draco_mesh_compression is not supported"), "{error}");

    let good = strip_document(r#"{"mesh":0}"#);
    let draco = r#"{"mode":5,"extensions":{"KHR_draco_mesh_compression":{}},"attributes""#;
    let beside = good.replace(r#"{"mode":5,"attributes""#, draco);
    assert!(parse_mesh(&glb(&beside, &STRIP)).is_ok(), "plain data stands beside the compressed");
    let without = |document: &str, what: &str| {
        let error = parse_mesh(&glb(&document.replace(what, ""), &STRIP)).unwrap_err().to_string();
        assert!(error.contains("KHR_draco_mesh_compression is not supported"), "{error}");
    };
    without(&beside, r#""bufferView":0,"#);
    without(&beside, r#""bufferView":1,"#);
    without(&beside, r#""POSITION":0"#);

    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let packed = format!(r#"{{"extensions":{{"{name}":{{"buffer":0}}}},"buffer":0,"byteLength":16"#);
        let beside = good.replace(r#"{"buffer":0,"byteLength":16"#, &packed);
        assert!(parse_mesh(&glb(&beside, &STRIP)).is_ok());
        let stand_in = format!(r#""buffers":[{{"extensions":{{"{name}":{{"fallback":true}}}},"#);
        for document in [
            beside.replace(r#""buffers":[{"#, &stand_in),
            beside.replace(r#"}},"buffer":0"#, r#"}},"buffer":1"#),
        ] {
            let error = parse_mesh(&glb(&document, &STRIP)).unwrap_err().to_string();
            let expected = format!("GLB: bufferViews[0]: {name} is not supported");
            assert!(error.starts_with(&expected), "{error}");
        }
    }
}

/// Returns the mesh with triangles and vertices numbered by first use, and with the selected attributes only.
fn only(mesh: &TriangleMesh, normals: bool, uvs: bool, colors: bool) -> TriangleMesh {
    let mut mesh = mesh.welded();
    mesh.normals = mesh.normals.filter(|_| normals);
    mesh.uvs = mesh.uvs.filter(|_| uvs);
    mesh.corner_uvs = mesh.corner_uvs.filter(|_| uvs);
    mesh.colors = mesh.colors.filter(|_| colors);
    mesh
}

#[test]
fn written_meshes_read_back_the_same() {
    for mesh in [octahedron(), octahedron_with_seam()] {
        for (format, normals, uvs, colors) in [
            (MeshFormat::Glb, true, true, true),
            (MeshFormat::Ply, true, true, true),
            (MeshFormat::Obj, true, true, true),
            (MeshFormat::Stl, false, false, false),
        ] {
            let mut found = parse_mesh(&write_mesh(&mesh, format).unwrap()).unwrap();
            let expected = only(&mesh, normals, uvs, colors);
            assert_eq!(
                found.colors.as_ref().map(Vec::len),
                expected.colors.as_ref().map(Vec::len),
                "{format:?}"
            );
            for (a, b) in found.colors.iter().flatten().zip(expected.colors.iter().flatten()) {
                assert!((*a - *b).abs().max_element() <= 0.51 / 255.0, "{format:?} {a} {b}");
            }
            found.colors = expected.colors.clone();
            assert_eq!(found, expected, "{format:?}");
        }
    }
}

#[test]
fn real_meshes_are_preserved_by_every_format() {
    for bytes in [KNOT, FUZE, SPOT] {
        // Without a texture, since OBJ and PLY count its coordinates from the opposite edge.
        let mesh = TriangleMesh { texture: None, ..parse_mesh(bytes).unwrap() };
        for format in [MeshFormat::Glb, MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Stl] {
            let found = parse_mesh(&write_mesh(&mesh, format).unwrap()).unwrap();
            assert_eq!(found.positions, mesh.positions, "{format:?}");
            assert_eq!(found.triangles, mesh.triangles, "{format:?}");
            if format != MeshFormat::Stl {
                assert_eq!((&found.uvs, &found.corner_uvs), (&mesh.uvs, &mesh.corner_uvs), "{format:?}");
            }
        }
    }
}

#[test]
fn unusual_numbers_are_preserved() {
    let odd = [1e-45, -3.4e38, 0.1, 1.0 / 3.0, 123_456_790.0, -0.0, 5e-324_f64 as f32];
    let positions: Vec<Vec3> = odd
        .iter()
        .flat_map(|&x| [Vec3::new(x, 0.0, 1.0), Vec3::new(x, 1.0, 2.0), Vec3::new(1.0, x, 3.0)])
        .collect();
    let triangles = (0..odd.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = TriangleMesh { positions, triangles, ..Default::default() }.welded();
    for format in [MeshFormat::Glb, MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Stl] {
        let found = parse_mesh(&write_mesh(&mesh, format).unwrap()).unwrap();
        assert_eq!(found.positions, mesh.positions, "{format:?}");
    }
}

#[test]
fn an_independent_reader_accepts_written_glb() {
    for mesh in [octahedron(), octahedron_with_seam(), parse_mesh(KNOT).unwrap(), TriangleMesh::default()] {
        let bytes = write_mesh(&mesh, MeshFormat::Glb).unwrap();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = file.blob.clone().unwrap_or_default();
        let expected = mesh.split_at_seams();
        let Some(node) = file.default_scene().unwrap().nodes().next().unwrap().mesh() else {
            assert!(mesh.triangles.is_empty());
            continue;
        };
        let primitive = node.primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(&blob));
        let positions: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from_array).collect();
        assert_eq!(positions, expected.positions);
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
        assert_eq!(indices, expected.triangles.as_flattened());
        assert!(reader.read_normals().unwrap().all(|n| Vec3::from_array(n).is_normalized()));
        let uvs = reader.read_tex_coords(0).map(|uvs| uvs.into_f32().map(Vec2::from_array).collect());
        assert_eq!(uvs, expected.uvs);
        let bounds = primitive.bounding_box();
        let low = positions.iter().fold(Vec3::INFINITY, |low, p| low.min(*p));
        assert_eq!(Vec3::from_array(bounds.min), low);
    }
}

#[test]
fn vtp_contains_the_arrays() {
    let mesh = octahedron();
    let text = String::from_utf8(write_mesh(&mesh, MeshFormat::Vtp).unwrap()).unwrap();
    assert!(text.contains("NumberOfPoints=\"6\"") && text.contains("NumberOfPolys=\"8\""));
    let array = |name: &str| {
        let tag = text.split(&format!("Name=\"{name}\"")).nth(1).unwrap();
        let bytes = from_base64(tag.split_once('>').unwrap().1.split_once('<').unwrap().0.trim());
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        assert_eq!(length, bytes.len() - 4, "{name}");
        bytes[4..].chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect::<Vec<u32>>()
    };
    let bits: Vec<u32> = mesh.positions.iter().flat_map(|p| p.to_array().map(f32::to_bits)).collect();
    assert_eq!(array("Points"), bits);
    assert_eq!(array("Normals"), bits);
    assert_eq!(array("connectivity"), mesh.triangles.as_flattened());
    assert_eq!(array("offsets"), (1..=8).map(|t| 3 * t).collect::<Vec<u32>>());
}

fn from_base64(text: &str) -> Vec<u8> {
    let digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = Vec::new();
    for four in text.as_bytes().chunks(4) {
        let word = four.iter().fold(0, |word, &c| word << 6 | digits.find(char::from(c)).unwrap_or(0) as u32);
        let padding = four.iter().filter(|&&c| c == b'=').count();
        bytes.extend(&word.to_be_bytes()[1..4 - padding]);
    }
    bytes
}

#[test]
fn mz3_contains_the_arrays() {
    let mesh = octahedron();
    let bytes = write_mesh(&mesh, MeshFormat::Mz3).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!((&bytes[..2], bytes[2], word(4), word(8), word(12)), (&b"MZ"[..], 7, 8, 6, 0));
    assert_eq!(bytes.len(), 16 + 12 * 8 + 12 * 6 + 4 * 6);
    assert_eq!([word(16), word(20), word(24)], mesh.triangles[0]);
    assert_eq!(f32::from_bits(word(16 + 96)), mesh.positions[0].x);
    assert_eq!(bytes[16 + 96 + 72..][..4], [255, 128, 128, 255]);
}

#[test]
fn an_invalid_mesh_is_not_written() {
    let mut mesh = octahedron();
    mesh.triangles[1][2] = 6;
    for format in MeshFormat::ALL {
        assert!(matches!(
            write_mesh(&mesh, format),
            Err(MeshError::InvalidArgument { parameter: "indices", .. })
        ));
        assert_eq!(MeshFormat::from_extension(format.extension()), Some(format));
    }
}

/// A cube of quads as text PLY, with elements and properties that readers must skip.
const CUBE_PLY: &str = "ply\r\nformat ascii 1.0\r\ncomment caf\u{e9}\r\nelement strange 2\r\nproperty list uint8 short odd\r\n\
element nothing 4000000000\r\nelement vertex 8\r\nproperty double x\r\nproperty double quality\r\nproperty int y\r\nproperty float z\r\n\
property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\nelement face 6\r\nproperty uchar flags\r\n\
property list uchar int vertex_index\r\nend_header\r\n2 7 -8\r\n0\r\n\
0 .5 0 0 255 0 51\n1 .5 0 0 255 0 51\n0 .5 1 0 255 0 51\n1 .5 1 0 255 0 51\n\
0 .5 0 1 255 0 51\n1 .5 0 1 255 0 51\n0 .5 1 1 255 0 51\n1 .5 1 1 255 0 51\n\
0 4 0 2 3 1\n0 4 4 5 7 6\n0 4 0 1 5 4\n0 4 2 6 7 3\n0 4 0 4 6 2\n0 4 1 3 7 5\n";

fn assert_cube(mesh: &TriangleMesh) {
    let m = measure(mesh);
    assert_eq!((m.vertices, m.triangles, m.volume), (8, 12, 1.0));
    assert!(report(mesh).unwrap().is_healthy());
}

#[test]
fn ply_text_with_quads_and_unknown_elements() {
    let mesh = parse_mesh(CUBE_PLY.as_bytes()).unwrap();
    assert_cube(&mesh);
    assert_eq!(mesh.colors.unwrap()[0], Vec3::new(1.0, 0.0, 0.2));
}

#[test]
fn ply_of_both_byte_orders() {
    for (name, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = format!(
            "ply\nformat {name} 1.0\nelement vertex 8\nproperty short x\nproperty double y\nproperty float z\n\
             element face 6\nproperty list ushort uint vertex_indices\nend_header\n"
        )
        .into_bytes();
        let mut push = |mut number: Vec<u8>| {
            if big {
                number.reverse();
            }
            bytes.extend(number);
        };
        for i in 0..8_i16 {
            push((i & 1).to_le_bytes().to_vec());
            push(f64::from(i >> 1 & 1).to_le_bytes().to_vec());
            push(f32::from(i >> 2).to_le_bytes().to_vec());
        }
        for quad in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5_u32]] {
            push(4_u16.to_le_bytes().to_vec());
            quad.iter().for_each(|v| push(v.to_le_bytes().to_vec()));
        }
        assert_cube(&parse_mesh(&bytes).unwrap());
    }
}

#[test]
fn obj_in_every_notation() {
    let text = "# a cube\nmtllib none.mtl\no caf\u{e9}\nv 0 0 0\nv 1 0 0\nv 0 1 0 1.0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\n\
                v 1.0e0 1 +1 # last\nvt 0 0\nvt 1\nvn 0 0 1\ng side\ns off\nf 1 3 4 2 # a face\nf 5/1 6/2 8/1 7/2\nf 1//1 2//1 \\\n6//1 5//1\n\
                f -6/-1/-1 -2/1/1 -1/2/1 -5/1/1\rf 1 5 7 3\r\nf 2 4 8 6\nl 1 2\n";
    let mesh = parse_mesh(text.as_bytes()).unwrap();
    assert_cube(&mesh);
    assert_eq!((mesh.uvs, mesh.corner_uvs, mesh.normals, mesh.colors), (None, None, None, None));
}

#[test]
fn stl_text() {
    let mut text = String::from("solid a name\n");
    for corners in octahedron().corners() {
        text += " facet normal 0 0 0\n  outer loop\n";
        corners.iter().for_each(|p| text += &format!("   VERTEX {:e} {} {}\n", p.x, p.y, p.z));
        text += "  endloop\n endfacet\n";
    }
    let whole = text.clone() + "endsolid a name\n";
    assert_eq!(describe(&parse_mesh(whole.as_bytes()).unwrap()), (6, 8, 1, 0));
    for (broken, field) in [
        (text.clone(), "endsolid"),
        (whole.replacen("VERTEX 1e0 0 0", "VERTEX 1e0 0", 1), "line 4"),
        (whole.replacen("VERTEX 1e0 0 0\n", "\n", 1), "line 7"),
        ("solid nothing\nendsolid".into(), "faces"),
    ] {
        let error = parse_mesh(broken.as_bytes()).unwrap_err().to_string();
        assert!(error.starts_with(&format!("STL: {field}")), "{error}");
    }
}

#[test]
fn binary_stl_that_begins_with_solid() {
    let mut bytes = write_mesh(&octahedron(), MeshFormat::Stl).unwrap();
    bytes[..6].copy_from_slice(b"solid ");
    assert_eq!(describe(&parse_mesh(&bytes).unwrap()), (6, 8, 1, 0));
}

/// A tetrahedron with byte coordinates, its vertices four bytes apart, and a strip of four triangles over it.
const STRIP: [u8; 22] = [0, 0, 0, 9, 127, 0, 0, 9, 0, 127, 0, 9, 0, 0, 127, 9, 0, 2, 1, 3, 0, 2];

fn strip_document(nodes: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["KHR_mesh_quantization"],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"mode":5,"attributes":{{"POSITION":0}},"indices":1}},{{"mode":0,"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5120,"normalized":true,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":16,"byteStride":4}},{{"buffer":0,"byteOffset":16,"byteLength":6}}],
        "buffers":[{{"byteLength":22}}]}}"#
    )
}

#[test]
fn glb_with_strips_and_quantised_or_mirrored_nodes() {
    let nodes = r#"{"children":[1,2],"translation":[0,0,10]},{"mesh":0,"scale":[2,2,2]},
        {"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, -5,0,0,1]}"#;
    let mesh = parse_mesh(&glb(&strip_document(nodes), &STRIP)).unwrap();
    let found = report(&mesh).unwrap();
    assert!(found.is_healthy(), "{found:?}");
    let m = measure(&mesh);
    assert_eq!((m.vertices, m.triangles, m.components), (8, 8, 2));
    assert!((m.volume - (8.0 + 1.0) / 6.0).abs() < 1e-6, "{}", m.volume);
    assert_eq!((m.bounds[0].to_array(), m.bounds[1].to_array()), ([-6.0, 0.0, 10.0], [2.0, 2.0, 12.0]));
}

#[test]
fn glb_with_contradictions_is_refused() {
    let good = strip_document(r#"{"mesh":0}"#);
    assert!(parse_mesh(&glb(&good, &STRIP)).is_ok());
    let loop_of_nodes = strip_document(r#"{"mesh":0},{"children":[2]},{"children":[1,0]}"#);
    let in_scene = loop_of_nodes.replace(r#""nodes":[{"#, r#""scenes":[{"nodes":[1]}],"nodes":[{"#);
    for (json, field) in [
        (in_scene, "nodes[1]"),
        (good.replace(r#"{"mesh":0}"#, r#"{"mesh":1}"#), "meshes"),
        (good.replace(r#"{"mesh":0}"#, r#"{"mesh":0,"matrix":[1,2]}"#), "nodes[0].matrix"),
        (good.replace(r#"{"mesh":0}"#, r#"{"mesh":0,"scale":[1e300,1,1]}"#), "positions"),
        (good.replace(r#""count":4"#, r#""count":5"#), "accessors[0]"),
        (good.replace(r#""count":4"#, r#""count":18446744073709551615"#), "accessors[0]"),
        (good.replace(r#""count":4"#, r#""count":-4"#), "count"),
        (good.replace(r#""count":4"#, r#""count":3"#), "indices"),
        (good.replace(r#""byteStride":4"#, r#""byteStride":2"#), "accessors[0]"),
        (good.replace(r#""byteLength":16"#, r#""byteLength":99"#), "bufferViews[0]"),
        (good.replace(r#""byteOffset":16"#, r#""byteOffset":18446744073709551615"#), "bufferViews[1]"),
        (
            good.replace(r#""buffers":[{"#, r#""buffers":[{"uri":"a.bin","#),
            "buffers[0]: is in the file 'a.bin'",
        ),
        (good.replace("5120", "5130"), "accessors[0].componentType"),
        (good.replace("VEC3", "MAT4"), "accessors[0].type"),
        (good.replace(r#""normalized""#, r#""sparse":{},"normalized""#), "accessors[0]"),
        (good.replace("KHR_mesh_quantization", "EXT_meshopt_compression"), "extensionsRequired"),
        (good.replace(r#""mode":5"#, r#""mode":1"#), "meshes"),
        (good[..100].into(), "JSON chunk"),
        ("[".repeat(100_000), "JSON chunk"),
    ] {
        let error = parse_mesh(&glb(&json, &STRIP)).unwrap_err().to_string();
        assert!(error.starts_with(&format!("GLB: {field}")), "{field}: {error}");
    }
}

#[test]
fn a_mesh_instanced_too_often_is_refused() {
    let nodes = vec![r#"{"mesh":0}"#; 500].join(",");
    let many = r#"{"mode":4,"attributes":{"POSITION":0},"indices":1},"#.repeat(1000);
    let json = strip_document(&nodes).replace(r#""primitives":["#, &format!(r#""primitives":[{many}"#));
    let error = parse_mesh(&glb(&json, &STRIP)).unwrap_err();
    assert!(matches!(error, FormatError::TooLarge { format: "GLB", .. }), "{error}");
}

#[test]
fn a_small_file_repeats_a_mesh_to_8_mib() {
    let parsed = |nodes: usize, padding: usize| {
        let many = r#"{"mode":4,"attributes":{"POSITION":0},"indices":1},"#.repeat(1000);
        let nodes = vec![r#"{"mesh":0}"#; nodes].join(",");
        let json = strip_document(&nodes).replace(r#""primitives":["#, &format!(r#""primitives":[{many}"#));
        let extras = format!(r#"{{"extras":"{}","asset""#, " ".repeat(padding));
        parse_mesh(&glb(&json.replacen(r#"{"asset""#, &extras, 1), &STRIP)).map(|file| file.triangles.len())
    };
    // Each node has 1001 parts of 72 bytes, but for the last, which is a strip.
    assert!(parsed(110, 0).is_ok());
    let error = parsed(125, 0).unwrap_err().to_string();
    assert!(error.contains("128 KiB, they may repeat meshes up to 8 MiB: needs"), "{error}");
    assert!(parsed(125, 1 << 17).is_ok());
}

#[test]
fn bytes_that_are_no_mesh_are_refused() {
    for (bytes, message) in [
        (&b""[..], "mesh file: content"),
        (b"hello, world\n", "text without vertices"),
        (b"\x1f\x8b\x08\0\0", "gzip"),
        (b"{\"asset\":{}}", "JSON"),
        (b"<?xml version=\"1.0\"?>", "XML"),
        (b"\0\x01\x02", "unknown binary format"),
        (&[1; 200], "unknown binary format"),
        (&[0; 200], "STL: triangle count"),
        (b"ply\n", "PLY: header: has no end_header"),
        (b"ply\nend_header\n", "PLY: format"),
        (b"ply\nformat ascii 2.0\nend_header\n", "PLY: format: ascii 2.0"),
        (b"ply\nformat ascii 1.0\nend_header\n", "PLY: faces"),
        (b"ply\nformat ascii 1.0\nproperty float x\n", "PLY: property"),
        (b"ply\nformat ascii 1.0\nelement vertex -1\n", "PLY: element vertex: count must be"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n1 2\n",
            "PLY: element vertex: needs",
        ),
        (b"v 1 2 3\n", "OBJ: faces"),
        (b"v 1 2\nf 1 1 1\n", "OBJ: line 1"),
        (b"v 1 2 x\n", "OBJ: line 1"),
        (b"v 1 2 3\nv 1 2 4\nv 1 2 5\nf 1 2 4\n", "OBJ: line 4: v index 4 is out of range"),
        (b"v 1 2 3\nf 0 0 0\n", "OBJ: line 2"),
        (b"v 1 2 3\nf 1 1\n", "OBJ: faces"),
        (b"v nan 2 3\nv 1 2 4\nv 1 3 5\nf 1 2 3\n", "OBJ: positions: vertex 0"),
        (b"glTF\x01\0\0\0", "GLB: version: 1"),
        (b"glTF\x02\0\0\0\x04\0\0\0", "GLB: JSON chunk: is missing"),
        (b"glTF\x02\0\0\0\xff\xff\xff\xff", "GLB: length"),
        (b"glTF", "GLB: version"),
    ] {
        let error = parse_mesh(bytes).unwrap_err().to_string();
        assert!(error.contains(message), "{message}: {error}");
    }
}

#[test]
fn ply_bodies_that_contradict_the_header_are_refused() {
    for (from, to, field) in [
        ("0 4 0 2 3 1", "0 4 0 2 3 8", "face 0: vertex index 8"),
        ("0 4 0 2 3 1", "0 4 0 2 3 -1", "face 0"),
        ("0 4 0 2 3 1", "0 4 0 2 3 1.5", "face 0"),
        ("0 4 0 2 3 1", "0 4000 0 2 3 1", "vertex_index: a list of 4000"),
        ("0 4 0 2 3 1", "0 x 0 2 3 1", "vertex_index: \"x\""),
        ("0 4 1 3 7 5\n", "", "flags"),
        ("1 .5 1 1 255", "inf .5 1 1 255", "positions: vertex 7"),
        ("property int y", "property int v", "element vertex: has no properties"),
        ("vertex_index", "vertices", "element face: has no property"),
        ("list uint8 short", "list float short", "property odd"),
        ("property int y", "property long y", "property type"),
    ] {
        let error = parse_mesh(CUBE_PLY.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(error.starts_with("PLY: ") && error.contains(field), "{field}: {error}");
    }
}

/// Returns a small file of every format.
fn samples() -> Vec<Vec<u8>> {
    let written = [MeshFormat::Glb, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Obj]
        .map(|format| write_mesh(&octahedron_with_seam(), format).unwrap());
    let mut all = written.to_vec();
    let texture = Texture::new(b"\xff\xd8\xff picture".to_vec()).ok().map(Arc::new);
    let textured = TriangleMesh { texture, ..octahedron_with_seam() };
    all.push(write_mesh(&textured, MeshFormat::Glb).unwrap());
    all.push(write_animation([octahedron(), textured], 0.5).unwrap());
    all.push(CUBE_PLY.as_bytes().to_vec());
    all.push(glb(&strip_document(r#"{"mesh":0,"rotation":[0,0,0,1]}"#), &STRIP));
    all.push(b"solid\nfacet\nvertex 1 2 3\nvertex 2 2 3\nvertex 1 4 3\nendloop\nendsolid".to_vec());
    all
}

/// Asserts that parsing gives a valid mesh or an error, and returns whether it gives a mesh without a warning; a panic
/// names the input.
fn survives(bytes: &[u8], what: &str) -> bool {
    let outcome = std::panic::catch_unwind(|| read_mesh(bytes, MeshOptions::default()));
    match outcome {
        Ok(Ok(MeshFile { mesh, warnings, .. })) => {
            assert_eq!(mesh.validate(), Ok(()), "{what}");
            // The mesh is no larger than the file.
            assert!(mesh.positions.len() <= bytes.len() && mesh.triangles.len() <= bytes.len(), "{what}");
            warnings.is_empty()
        }
        Ok(Err(error)) => {
            assert!(!error.to_string().is_empty());
            false
        }
        Err(_) => panic!("{what} panics"),
    }
}

#[test]
fn truncated_files_give_a_mesh_or_an_error() {
    for (n, sample) in samples().iter().enumerate() {
        let read = (0..sample.len())
            .filter(|&length| survives(&sample[..length], &format!("sample {n} cut to {length}")));
        assert!(10 * read.count() < sample.len(), "many truncations of sample {n} are read");
    }
    for (n, file) in [KNOT, FUZE, SPOT, DRACO].into_iter().enumerate() {
        for k in 0..40 {
            survives(&file[..file.len() * k / 40], &format!("file {n} cut to {k}/40"));
        }
        assert!(n == 1 || parse_mesh(&file[..file.len() / 2]).is_err());
    }
}

#[test]
fn files_with_changed_bytes_give_a_mesh_or_an_error() {
    for (n, sample) in samples().iter().enumerate() {
        let mut read = 0;
        for seed in 0..4000_u64 {
            let mut random = Random(4000 * n as u64 + seed);
            let mut bytes = sample.clone();
            for _ in 0..1 + random.below(3) {
                let at = random.below(bytes.len());
                // Digits in text get further into the parser than random bytes.
                bytes[at] =
                    if random.below(2) == 0 { b'0' + random.below(10) as u8 } else { random.next() as u8 };
            }
            read += usize::from(survives(&bytes, &format!("sample {n}, seed {seed}")));
        }
        assert!((200..4000).contains(&read), "sample {n}: {read} of 4000 are read");
    }
}
