//! Spaces and units of meshes in files: what is written is at the same place in the world when other programs read it.

use super::common::files::glb;
use super::common::shapes::octahedron;
use vesicle::io::{
    AnimationWriter, MeshFile, MeshFormat, MeshOptions, WriteOptions, read_mesh, write_mesh, write_mesh_with,
};
use vesicle::math::{DVec3, Vec3};
use vesicle::mesh::{TriangleMesh, measure};
use vesicle::volume::{LengthUnit, Space};

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const FORMATS: [MeshFormat; 4] = [MeshFormat::Glb, MeshFormat::Ply, MeshFormat::Stl, MeshFormat::Obj];

/// A head of 160 × 180 × 200 mm in RAS, its middle at (10, −20, 30).
fn head() -> TriangleMesh {
    let mut mesh = octahedron();
    let size = Vec3::new(80.0, 90.0, 100.0) / mesh.positions.iter().copied().reduce(Vec3::max).unwrap();
    mesh.positions.iter_mut().for_each(|p| *p = *p * size + Vec3::new(10.0, -20.0, 30.0));
    mesh.normals = Some(mesh.vertex_normals());
    mesh
}

/// Returns the mesh in the other space.
fn turned(mesh: &TriangleMesh) -> TriangleMesh {
    let mut mesh = mesh.clone();
    let turn = |v: &mut Vec3| *v = Vec3::new(-v.x, -v.y, v.z);
    mesh.positions.iter_mut().chain(mesh.normals.iter_mut().flatten()).for_each(turn);
    mesh.origin = DVec3::new(-mesh.origin.x, -mesh.origin.y, mesh.origin.z);
    mesh
}

fn stated(space: Space, written_as: Option<Space>) -> WriteOptions<'static> {
    WriteOptions { space: Some(space), written_as, unit: LengthUnit::Millimetre, ..WriteOptions::default() }
}

fn read(bytes: &[u8]) -> MeshFile {
    read_mesh(bytes, MeshOptions::default()).unwrap()
}

/// Reads a file as 3D Slicer does: in RAS, if it says so, else from LPS.
fn read_as_slicer(bytes: &[u8]) -> TriangleMesh {
    let file = read(bytes);
    let says = |words: &str| bytes.windows(words.len()).any(|part| part == words.as_bytes());
    assert_eq!(file.space == Some(Space::Ras), says("SPACE=RAS"));
    if says("SPACE=RAS") { file.mesh } else { turned(&file.mesh) }
}

#[test]
fn files_of_a_volume_in_either_space_are_at_the_same_place() {
    let (in_ras, in_lps) = (head(), turned(&head()));
    let expected = measure(&in_ras);
    for format in &FORMATS[1..] {
        for (mesh, space) in [(&in_ras, Space::Ras), (&in_lps, Space::Lps)] {
            for written_as in [None, Some(Space::Ras), Some(Space::Lps)] {
                let bytes = write_mesh_with(mesh, *format, &stated(space, written_as)).unwrap();
                let found = read_as_slicer(&bytes);
                assert_eq!(found.positions, in_ras.welded().positions, "{format:?} {space:?} {written_as:?}");
                assert_eq!(measure(&found).volume, expected.volume);
                let file = read(&bytes);
                assert_eq!(file.space, written_as.or(Some(space)));
                assert_eq!(file.mesh.normals.is_some(), *format != MeshFormat::Stl);
                if let Some(normals) = file.mesh.normals {
                    let towards = |(p, n): (&Vec3, &Vec3)| p.dot(*n) - file.mesh.positions[0].dot(*n) >= 0.0;
                    assert!(
                        file.mesh.positions.iter().zip(&normals).filter(|&pair| towards(pair)).count() > 3
                    );
                }
            }
        }
    }
}

#[test]
fn nothing_is_stated_that_is_not_known() {
    for format in MeshFormat::ALL {
        let plain = write_mesh(&head(), format).unwrap();
        let same = WriteOptions { written_as: Some(Space::Lps), ..WriteOptions::default() };
        assert_eq!(write_mesh_with(&head(), format, &same).unwrap(), plain);
        let text = String::from_utf8_lossy(&plain).into_owned();
        assert!(!text.contains("SPACE") && !text.contains("\"matrix\""));
        // A unit alone scales a GLB, and changes no other file.
        let metric = WriteOptions { unit: LengthUnit::Millimetre, ..WriteOptions::default() };
        assert_eq!(write_mesh_with(&head(), format, &metric).unwrap() == plain, format != MeshFormat::Glb);
    }
}

#[test]
fn headers_and_comments_are_those_that_slicer_reads() {
    let notes = "anisotropic: 1×1×6 mm³";
    let options = WriteOptions { notes, ..stated(Space::Ras, None) };
    let start = |format| {
        let bytes = write_mesh_with(&head(), format, &options).unwrap();
        String::from_utf8_lossy(&bytes[..bytes.len().min(400)]).into_owned()
    };
    assert!(start(MeshFormat::Stl).starts_with("binary STL, SPACE=RAS, warnings: anisotropic "));
    let ply = start(MeshFormat::Ply);
    assert!(ply.contains("1.0\ncomment SPACE=RAS\ncomment warning anisotropic: 1x1x6 mm3\nelement"), "{ply}");
    assert!(start(MeshFormat::Obj).starts_with("# SPACE=RAS\n# warning anisotropic"));
    let field = "<FieldData>\n<Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">\n82 65 83 0\n";
    assert!(start(MeshFormat::Vtp).contains(field));
    let many = [notes; 9].join("\n");
    let stl = write_mesh_with(&head(), MeshFormat::Stl, &WriteOptions { notes: &many, ..options }).unwrap();
    assert_eq!(read(&stl).mesh.triangles.len(), head().triangles.len());
}

/// Returns the positions of a GLB as a viewer shows them, without animation.
fn shown(bytes: &[u8]) -> TriangleMesh {
    let at = bytes.windows(8).position(|part| part == b"\"extras\"").unwrap();
    read(&[&bytes[..at], b"\"extraz\"", &bytes[at + 8..]].concat()).mesh
}

#[test]
fn a_glb_is_in_metres_with_y_upwards_and_read_as_it_was() {
    let nose = Vec3::new(10.0, 70.0, 30.0);
    for (unit, scale) in [
        (LengthUnit::Metre, 1.0),
        (LengthUnit::Millimetre, 1e-3),
        (LengthUnit::Micrometre, 1e-6),
        (LengthUnit::Unknown, 1.0),
    ] {
        for (space, mesh) in [(Space::Ras, head()), (Space::Lps, turned(&head()))] {
            for written_as in [None, Some(Space::Ras), Some(Space::Lps)] {
                let options = WriteOptions { unit, ..stated(space, written_as) };
                let bytes = write_mesh_with(&mesh, MeshFormat::Glb, &options).unwrap();
                let seen = shown(&bytes);
                let found = measure(&seen);
                let [width, height, depth] =
                    (found.bounds[1] - found.bounds[0]).to_array().map(|x| x / scale);
                assert!((width - 160.0).abs() + (height - 200.0).abs() + (depth - 180.0).abs() < 1e-3);
                let expected = measure(&mesh).volume * scale * scale * scale;
                assert!((found.volume - expected).abs() < 1e-5 * expected, "not mirrored");
                // To the patient's left, which is -x in RAS, is x in glTF; upwards is y, to the front is z.
                let front = DVec3::new(-f64::from(nose.x), f64::from(nose.z), f64::from(nose.y)) * scale;
                let mut corners = (0..seen.positions.len()).map(|v| seen.world_position(v));
                assert!(corners.any(|p| (p - front).length() < 1e-4 * scale), "{front}");

                let file = read(&bytes);
                assert_eq!((file.space, file.unit), (written_as.or(Some(space)), unit));
                let back = if file.space == Some(space) { file.mesh } else { turned(&file.mesh) };
                assert_eq!(back.positions, mesh.welded().positions);
                assert!(file.warnings.is_empty());
            }
        }
    }
}

#[test]
fn a_unit_without_a_space_is_a_scale() {
    let options = WriteOptions { unit: LengthUnit::Millimetre, ..WriteOptions::default() };
    let bytes = write_mesh_with(&head(), MeshFormat::Glb, &options).unwrap();
    let size = measure(&shown(&bytes)).bounds;
    assert!((size[1] - size[0] - DVec3::new(0.16, 0.18, 0.2)).length() < 1e-6);
    let file = read(&bytes);
    assert_eq!((file.space, file.unit), (None, LengthUnit::Millimetre));
    assert_eq!(file.mesh.positions, head().welded().positions);
}

#[test]
fn far_meshes_keep_their_precision_beneath_the_root() {
    let mut mesh = head();
    mesh.origin = DVec3::new(5e8, -4.25e9, 1e8);
    for written_as in [None, Some(Space::Lps)] {
        let options = stated(Space::Ras, written_as);
        let bytes = write_mesh_with(&mesh, MeshFormat::Glb, &options).unwrap();
        let file = read(&bytes);
        let back = if written_as.is_some() { turned(&file.mesh) } else { file.mesh };
        let expected = mesh.welded();
        for v in 0..expected.positions.len() {
            assert!(back.world_position(v).distance(expected.world_position(v)) < 1e-3);
        }
        let seen = shown(&bytes);
        let middle = measure(&seen).centroid;
        assert!((middle - DVec3::new(-5e5 - 0.01, 1e5 + 0.03, -4.25e6 - 0.02)).length() < 1e-3, "{middle}");
    }
}

#[test]
fn animations_follow_the_same_rule() {
    let small = TriangleMesh { positions: head().positions.iter().map(|p| *p * 0.5).collect(), ..head() };
    for written_as in [None, Some(Space::Lps)] {
        let mut writer = AnimationWriter::new(&stated(Space::Ras, written_as));
        [head(), small.clone(), small.clone()].iter().for_each(|mesh| writer.add(mesh).unwrap());
        let bytes = writer.finish(0.5).unwrap();
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let roots: Vec<_> = document.default_scene().unwrap().nodes().collect();
        assert_eq!((roots.len(), roots[0].children().count()), (1, 2));
        let targets: Vec<_> = document
            .animations()
            .flat_map(|animation| animation.channels().map(|c| c.target().node().index()).collect::<Vec<_>>())
            .collect();
        assert_eq!(targets, [0, 1]);
        // The second mesh has no size before its frame.
        let bounds = measure(&shown(&bytes)).bounds;
        assert!((bounds[1].y - bounds[0].y - 0.2).abs() < 1e-6, "{bounds:?}");
        let file = read(&bytes);
        assert_eq!(file.space, written_as.or(Some(Space::Ras)));
    }
}

#[test]
fn a_root_that_was_moved_is_a_node_like_any_other() {
    let bytes = write_mesh_with(&head(), MeshFormat::Glb, &stated(Space::Ras, None)).unwrap();
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json = String::from_utf8(bytes[20..20 + json_length].to_vec()).unwrap();
    let binary = &bytes[28 + json_length..];
    let matrix = r#""matrix":[-0.001,0,0,0,0,0,0.001,0,0,0.001,0,0,0,0,0,1]"#;
    assert!(json.contains(matrix), "{json}");
    let with = |to: &str| read(&glb(&json.replace(matrix, to), binary));
    // As another program may write the same.
    let same = r#""rotation":[0,0.7071068,0.7071068,0],"scale":[0.001,0.0010000000474974513,0.001]"#;
    assert_eq!(with(same).space, Some(Space::Ras));
    assert_eq!(with(same).mesh.positions, head().welded().positions);
    let moved = with(&matrix.replace("0,0,0,1]", "0,2,0,1]"));
    assert_eq!((moved.space, moved.unit), (None, LengthUnit::Unknown));
    assert!((measure(&moved.mesh).centroid - DVec3::new(-0.01, 2.03, -0.02)).length() < 1e-6);
}
