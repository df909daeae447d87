//! Textures of meshes, in files and after mesh operations; and animations of several meshes.

use super::common::files;
use std::sync::Arc;
use vesicle::io::{FormatError, MeshFormat, parse_mesh, parse_textured_mesh, write_animation, write_mesh};
use vesicle::math::{DAffine3, DVec3, Vec2, Vec3};
use vesicle::mesh::{ImageKind, Mesh, MeshError, Texture, TriangleMesh, report};

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SPOT: &[u8] = include_bytes!("../data/meshes/spot.glb");
const FUZE: &[u8] = include_bytes!("../data/meshes/fuze.obj");

/// Bytes that begin like an image of each format.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n12345";
const JPEG: &[u8] = b"\xff\xd8\xff\xe0123";
const WEBP: &[u8] = b"RIFF\x0c\0\0\0WEBPVP8 12";

fn picture(bytes: &[u8]) -> Arc<Texture> {
    Arc::new(Texture::new(bytes.to_vec()).unwrap())
}

/// Returns a tetrahedron moved along x, with texture coordinates that have a seam.
fn tetrahedron(shift: f32, texture: Option<Arc<Texture>>) -> TriangleMesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let uv = |t: usize, k: usize| Vec2::new(0.1 * t as f32, 0.3 * k as f32);
    TriangleMesh {
        positions: positions.into_iter().map(|p| p + shift * Vec3::X).collect(),
        corner_uvs: Some((0..4).map(|t| [0, 1, 2].map(|k| uv(t, k))).collect()),
        triangles,
        texture,
        ..TriangleMesh::default()
    }
}

fn assert_near(found: &TriangleMesh, expected: &TriangleMesh) {
    assert_eq!((&found.positions, &found.triangles), (&expected.positions, &expected.triangles));
    let uvs = |mesh: &TriangleMesh| mesh.corner_uvs.clone().unwrap().concat();
    assert_eq!(uvs(found).len(), uvs(expected).len());
    for (a, b) in uvs(found).iter().zip(uvs(expected)) {
        assert!((a - b).abs().max_element() < 1e-6, "{a} {b}");
    }
}

#[test]
fn a_real_file_includes_its_texture() {
    let spot = parse_mesh(SPOT).unwrap();
    let texture = spot.texture.clone().unwrap();
    assert_eq!((texture.kind(), texture.bytes().len()), (ImageKind::Png, 80212));
    assert!(report(&spot).unwrap().is_healthy() && spot.corner_uvs.is_some());
    let again = parse_mesh(&write_mesh(&spot, MeshFormat::Glb).unwrap()).unwrap();
    assert_eq!((again.texture, again.corner_uvs), (spot.texture, spot.corner_uvs));
}

#[test]
fn an_independent_reader_finds_the_texture() {
    for bytes in [PNG, JPEG] {
        let mesh = tetrahedron(0.0, Some(picture(bytes)));
        let file = gltf::Gltf::from_slice(&write_mesh(&mesh, MeshFormat::Glb).unwrap()).unwrap();
        let blob = file.blob.clone().unwrap();
        let primitive = file.meshes().next().unwrap().primitives().next().unwrap();
        let looks = primitive.material().pbr_metallic_roughness();
        let texture = looks.base_color_texture().unwrap().texture();
        assert_eq!(texture.sampler().wrap_s(), gltf::texture::WrappingMode::Repeat);
        let gltf::image::Source::View { view, mime_type } = texture.source().source() else { panic!() };
        assert_eq!(&blob[view.offset()..view.offset() + view.length()], bytes);
        assert_eq!(mime_type, mesh.texture.unwrap().kind().media_type());
        let aligned = file.accessors().all(|accessor| accessor.view().unwrap().offset() % 4 == 0);
        assert!(aligned, "as the format wants numbers of four bytes");
        let uvs = primitive.reader(|_| Some(&blob)).read_tex_coords(0).unwrap().into_f32();
        assert_eq!(uvs.count(), 12, "a vertex for each corner, as all differ");
    }
}

#[test]
fn every_image_format_reads_back() {
    for bytes in [PNG, JPEG, WEBP] {
        let mesh = tetrahedron(0.0, Some(picture(bytes)));
        let file = write_mesh(&mesh, MeshFormat::Glb).unwrap();
        let found = parse_mesh(&file).unwrap();
        assert!(report(&found).unwrap().closed);
        assert_eq!(found.texture.as_deref().unwrap().bytes(), bytes);
        assert_eq!(found.texture, mesh.texture);
        let required =
            String::from_utf8_lossy(&file).contains(r#""extensionsRequired":["EXT_texture_webp"]"#);
        assert_eq!(required, bytes == WEBP);
    }
}

#[test]
fn the_texture_is_kept_with_the_mesh_and_dropped_by_edits() {
    let mesh = tetrahedron(0.0, Some(picture(PNG)));
    let parts = mesh.components();
    let moved = mesh.transformed(&DAffine3::from_scale(DVec3::NEG_ONE));
    for follower in [&mesh.welded(), &mesh.split_at_seams(), &parts[0], &moved] {
        assert!(Arc::ptr_eq(follower.texture.as_ref().unwrap(), mesh.texture.as_ref().unwrap()));
        assert_eq!(follower.validate(), Ok(()));
    }
    assert_eq!(Mesh::from_triangles(&mesh).unwrap().to_triangles().texture, None);
    let bare = TriangleMesh { corner_uvs: None, ..mesh };
    assert!(matches!(bare.validate(), Err(MeshError::InvalidArgument { parameter: "texture", .. })));
}

#[test]
fn an_image_can_be_given_for_a_file_without_it() {
    let (texture, raw) = (picture(JPEG), parse_mesh(FUZE).unwrap());
    let mesh = parse_textured_mesh(FUZE, texture.clone()).unwrap();
    let v = |mesh: &TriangleMesh| mesh.corner_uvs.as_ref().unwrap()[7][1].y;
    assert_eq!(v(&mesh), 1.0 - v(&raw));
    // Written with a known texture, v is counted from below again.
    for format in [MeshFormat::Obj, MeshFormat::Ply] {
        let file = write_mesh(&mesh, format).unwrap();
        assert_near(&parse_mesh(&file).unwrap(), &raw);
        assert_near(&parse_textured_mesh(&file, texture.clone()).unwrap(), &mesh);
    }
    let glb = write_mesh(&mesh, MeshFormat::Glb).unwrap();
    let found = parse_mesh(&glb).unwrap();
    assert_near(&found, &mesh);
    assert_eq!((&found.corner_uvs, &found.texture), (&mesh.corner_uvs, &mesh.texture));
    let other = parse_textured_mesh(&glb, picture(PNG)).unwrap();
    assert_eq!((other.corner_uvs, other.texture), (mesh.corner_uvs, Some(picture(PNG))));
    let bare = write_mesh(&raw, MeshFormat::Stl).unwrap();
    let error = parse_textured_mesh(&bare, texture.clone()).unwrap_err();
    assert!(matches!(error, FormatError::Invalid { format: "STL", .. }), "{error}");
}

/// Returns a GLB of one triangle with an image and two sets of texture coordinates: (0, 0), (1, 0), (0, 1), and the
/// same from (5, 5) on.
fn glb(material: &str, image: &str) -> Vec<u8> {
    let mut binary = Vec::new();
    let mut push = |numbers: &[f32]| numbers.iter().for_each(|x| binary.extend(x.to_le_bytes()));
    push(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    push(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    push(&[5.0, 5.0, 6.0, 5.0, 5.0, 6.0]);
    binary.extend(PNG);
    binary.resize(binary.len().next_multiple_of(4), 0);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"material":0,
        "attributes":{{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}},
        {{"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}},
        {{"buffer":0,"byteOffset":60,"byteLength":24}},{{"buffer":0,"byteOffset":84,"byteLength":13}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{material}}}}}],"images":[{image}],
        "textures":[{{"source":0}},{{"source":7}},{{}}],"buffers":[{{"byteLength":{}}}]}}"#,
        binary.len()
    );
    files::glb(&json, &binary)
}

const IN_VIEW: &str = r#"{"bufferView":3}"#;

#[test]
fn texture_coordinates_follow_set_and_transform() {
    let with = |extension: &str| {
        format!(r#"{{"index":0,"extensions":{{"KHR_texture_transform":{{{extension}}}}}}}"#)
    };
    for (material, expected) in [
        (r#"{"index":0}"#.into(), [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        (r#"{"index":0,"texCoord":1}"#.into(), [[5.0, 5.0], [6.0, 5.0], [5.0, 6.0]]),
        (with(r#""texCoord":1"#), [[5.0, 5.0], [6.0, 5.0], [5.0, 6.0]]),
        (with(r#""offset":[3,4],"scale":[2,-1]"#), [[3.0, 4.0], [5.0, 4.0], [3.0, 3.0]]),
        // The first example of the extension: the lower left quarter of the image, rotated.
        (
            with(r#""offset":[0,1],"rotation":1.57079632679,"scale":[0.5,0.5]"#),
            [[0.0, 1.0], [0.0, 0.5], [0.5, 1.0]],
        ),
    ] {
        let mesh = parse_mesh(&glb(&material, IN_VIEW)).unwrap();
        assert_eq!(mesh.texture, Some(picture(PNG)));
        for (found, expected) in mesh.uvs.unwrap().iter().zip(expected) {
            assert!((*found - Vec2::from_array(expected)).length() < 1e-6, "{material}: {found}");
        }
    }
}

#[test]
fn external_invalid_and_inline_images() {
    let inline = r#"{"uri":"data:image/jpeg;base64,/9j/4DEyMw=="}"#;
    let of = |material: &str, image: &str| parse_mesh(&glb(material, image)).map(|mesh| mesh.texture);
    assert_eq!(of(r#"{"index":0}"#, inline).unwrap(), Some(picture(JPEG)));
    // An external file, an unknown format, and a texture of another extension: the mesh is read without a texture.
    for (material, image) in [
        (r#"{"index":0}"#, r#"{"uri":"a.png"}"#),
        (r#"{"index":0}"#, r#"{"bufferView":1}"#),
        (r#"{"index":2}"#, IN_VIEW),
        ("null", IN_VIEW),
    ] {
        assert_eq!(of(material, image).unwrap(), None, "{material} {image}");
    }
    for (material, image, field) in [
        (r#"{"index":3}"#, IN_VIEW, "textures"),
        (r#"{"index":1}"#, IN_VIEW, "images"),
        (r#"{"index":-1}"#, IN_VIEW, "index"),
        (r#"{}"#, IN_VIEW, "baseColorTexture.index"),
        (r#"{"index":0}"#, r#"{"bufferView":4}"#, "bufferViews"),
        (r#"{"index":0}"#, r#"{"uri":"data:image/png;base64,/9j/4D!"}"#, "images[0].uri"),
        (r#"{"index":0}"#, r#"{"uri":"data:image/png,raw"}"#, "images[0].uri"),
        (
            r#"{"index":0,"extensions":{"KHR_texture_transform":{"scale":[1]}}}"#,
            IN_VIEW,
            "KHR_texture_transform.scale",
        ),
    ] {
        let error = of(material, image).unwrap_err().to_string();
        assert!(error.starts_with(&format!("GLB: {field}")), "{field}: {error}");
    }
}

/// Returns, for each mesh of an animated GLB, the times at which its scale changes and the new scale; steps without
/// interpolation.
fn tracks(file: &gltf::Gltf, blob: &[u8]) -> Vec<Vec<(f32, f32)>> {
    let animation = file.animations().next().unwrap();
    let mut tracks = vec![Vec::new(); file.nodes().count()];
    for channel in animation.channels() {
        assert_eq!(channel.sampler().interpolation(), gltf::animation::Interpolation::Step);
        let reader = channel.reader(|_| Some(blob));
        let Some(gltf::animation::util::ReadOutputs::Scales(sizes)) = reader.read_outputs() else { panic!() };
        let sizes: Vec<f32> =
            sizes.inspect(|s| assert!(s[0] == s[1] && s[1] == s[2])).map(|s| s[0]).collect();
        let times: Vec<f32> = reader.read_inputs().unwrap().collect();
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]) && times.len() == sizes.len());
        tracks[channel.target().node().index()] = times.into_iter().zip(sizes).collect();
    }
    tracks
}

fn size_at(track: &[(f32, f32)], time: f32) -> f32 {
    track.iter().rev().find(|(start, _)| *start <= time).map_or(track[0].1, |&(_, size)| size)
}

#[test]
fn an_animation_shows_one_mesh_at_a_time() {
    let ball = Mesh::icosphere(Vec3::ZERO, 1.0, 0.7).unwrap().to_triangles();
    let texture = Some(picture(PNG));
    let [first, last] = [0.0, 3.0].map(|shift| tetrahedron(shift, texture.clone()));
    let twin = tetrahedron(0.0, Some(picture(PNG)));
    let frames = [&first, &twin, &ball, &last, &last];
    let bytes = write_animation(frames, 0.25).unwrap();
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = file.blob.clone().unwrap();
    assert_eq!((file.meshes().count(), file.images().count()), (3, 1), "equal ones are stored once");
    let tracks = tracks(&file, &blob);
    let end = tracks.iter().flatten().fold(0.0, |end: f32, &(time, _)| end.max(time));
    assert_eq!(end, 1.25, "the last frame has its time, too");
    for (frame, mesh) in frames.into_iter().enumerate() {
        for within in [0.0, 0.1, 0.249] {
            let time = 0.25 * frame as f32 + within;
            let seen: Vec<usize> = (0..3).filter(|&node| size_at(&tracks[node], time) == 1.0).collect();
            assert_eq!(tracks.iter().map(|track| size_at(track, time)).sum::<f32>(), 1.0, "at {time} s");
            let node = file.nodes().nth(seen[0]).unwrap();
            let primitive = node.mesh().unwrap().primitives().next().unwrap();
            let positions = primitive.reader(|_| Some(&blob)).read_positions().unwrap().map(Vec3::from_array);
            assert_eq!(positions.collect::<Vec<_>>(), mesh.split_at_seams().positions);
            let looks = primitive.material().pbr_metallic_roughness();
            assert_eq!(looks.base_color_texture().is_some(), mesh.texture.is_some());
        }
    }
}

#[test]
fn the_first_frame_of_an_animation_is_its_static_pose() {
    let frames = [tetrahedron(0.0, None), tetrahedron(2.0, None), tetrahedron(5.0, None)];
    let seen = parse_mesh(&write_animation(&frames, 0.1).unwrap()).unwrap();
    assert_near(&seen, &frames[0].welded());
    let alone = write_animation(&frames[..1], 2.0).unwrap();
    let file = gltf::Gltf::from_slice(&alone).unwrap();
    assert_eq!(tracks(&file, &file.blob.clone().unwrap()), [[(0.0, 1.0), (2.0, 1.0)]]);
}

#[test]
fn an_animation_shows_nothing_in_frames_without_triangles() {
    let (a, b, none) = (tetrahedron(0.0, None), tetrahedron(2.0, None), TriangleMesh::default());
    for frames in [
        vec![&none, &none, &a, &b],
        vec![&a, &none, &b, &b],
        vec![&a, &b, &none, &none],
        vec![&a, &none, &a, &none],
    ] {
        let bytes = write_animation(frames.iter().copied(), 0.5).unwrap();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let tracks = tracks(&file, &file.blob.clone().unwrap());
        let end = tracks.iter().flatten().fold(0.0, |end: f32, &(time, _)| end.max(time));
        assert_eq!(end, 2.0, "{tracks:?}");
        for (frame, mesh) in frames.iter().enumerate() {
            let shown: f32 = tracks.iter().map(|track| size_at(track, 0.5 * frame as f32 + 0.1)).sum();
            assert_eq!(shown, if mesh.triangles.is_empty() { 0.0 } else { 1.0 }, "{frame} {tracks:?}");
        }
    }
}

#[test]
fn invalid_animations_are_refused() {
    let frame = tetrahedron(0.0, None);
    let mut broken = frame.clone();
    broken.triangles[0][0] = 9;
    let none: [&TriangleMesh; 0] = [];
    for (frames, seconds, named) in [
        (&none[..], 0.1, "frames"),
        (&[&TriangleMesh::default()], 0.1, "frames"),
        (&[&frame, &broken], 0.1, "indices"),
        (&[&frame], 0.0, "frameSeconds"),
        (&[&frame], f64::NAN, "frameSeconds"),
        (&[&frame], 1001.0, "frameSeconds"),
    ] {
        let error = write_animation(frames.iter().copied(), seconds).unwrap_err();
        let MeshError::InvalidArgument { parameter, .. } = error else { panic!("{error}") };
        assert_eq!(parameter, named);
    }
}
