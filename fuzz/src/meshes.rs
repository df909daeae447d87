//! Fuzz targets of the readers of meshes and points; meshes that are read are written in every format and read again.

use super::edits::assert_measurable;
use std::sync::Arc;
use vesicle::io::{MeshFormat, parse_mesh, parse_points, parse_textured_mesh, write_animation, write_mesh};
use vesicle::mesh::{Mesh, Texture, TriangleMesh, count_self_intersections, measure, report};
use vesicle::remesh::decimate;

/// Largest number of triangles of a mesh that [`check`] also measures, edits and writes.
const FULL_CHECK_LIMIT: usize = 60;

/// Reads a whole file as a mesh and as points; the seeds are PLY files.
pub fn ply(data: &[u8]) {
    use_mesh(data);
    use_points(data);
}

/// Reads a whole file as a mesh; the seeds are STL files.
pub fn stl(data: &[u8]) {
    use_mesh(data);
}

/// Reads a whole file as a mesh and as points; the seeds are OBJ files.
pub fn obj(data: &[u8]) {
    use_mesh(data);
    use_points(data);
}

/// Reads a whole file as a mesh; the seeds are GLB files.
pub fn glb(data: &[u8]) {
    use_mesh(data);
}

/// Reads a GLB with valid chunk lengths: its JSON is the input up to the first byte 0, its binary chunk the rest.
pub fn gltf(data: &[u8]) {
    let end = data.iter().position(|&b| b == 0).unwrap_or(data.len());
    let (text, binary) = (&data[..end], data.get(end + 1..).unwrap_or_default());
    use_mesh(&container(text, binary));
}

/// Returns a GLB with these JSON and binary chunks.
pub fn container(text: &[u8], binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (text, binary) = (padded(text, b' '), padded(binary, 0));
    let chunk =
        |name: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), &name[..], bytes].concat();
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &binary)].concat();
    let length = (12 + chunks.len() as u32).to_le_bytes();
    [&b"glTF\x02\0\0\0"[..], &length, &chunks].concat()
}

/// Reads a whole file as points.
pub fn points(data: &[u8]) {
    use_points(data);
}

fn use_points(data: &[u8]) {
    match parse_points(data) {
        Ok(cloud) => {
            let count = cloud.points.len();
            assert!(count > 0 && cloud.points.iter().all(|p| p.is_finite()));
            assert!(cloud.normals.is_none_or(|all| all.len() == count && all.iter().all(|n| n.is_finite())));
            let within = |c: &vesicle::math::Vec3| c.min_element() >= 0.0 && c.max_element() <= 1.0;
            assert!(cloud.colors.is_none_or(|all| all.len() == count && all.iter().all(within)));
        }
        Err(error) => is_short(&error.to_string()),
    }
}

/// Asserts that an error message has fewer than 2000 bytes, whatever the file contains.
fn is_short(message: &str) {
    assert!(message.len() < 2000, "a message of {} bytes", message.len());
}

/// Reads a file as a mesh, and again with a texture if its length is a multiple of 4; checks each mesh.
fn use_mesh(data: &[u8]) {
    match parse_mesh(data) {
        Ok(mesh) => check(&mesh, data.len()),
        Err(error) => is_short(&error.to_string()),
    }
    if !data.len().is_multiple_of(4) {
        return;
    }
    let picture = Texture::new(b"\x89PNG\r\n\x1a\n".to_vec()).map(Arc::new);
    if let Ok(mesh) = parse_textured_mesh(data, picture.unwrap()) {
        check(&mesh, data.len() + 1);
    }
}

/// Asserts that a mesh that was read is valid and, if small, that it can be measured, edited and written; `choice`
/// selects the format.
fn check(mesh: &TriangleMesh, choice: usize) {
    assert!(mesh.validate().is_ok() && !mesh.triangles.is_empty());
    if mesh.triangles.len() > FULL_CHECK_LIMIT {
        return;
    }
    let found = report(mesh).unwrap();
    let counted = measure(mesh);
    assert_eq!(counted.triangles, mesh.triangles.len());
    if let Ok(mut dynamic) = Mesh::from_triangles(mesh) {
        assert_eq!(dynamic.check(), Ok(()));
        decimate(&mut dynamic, mesh.triangles.len() / 2);
        assert_eq!(dynamic.check(), Ok(()));
        assert!(found.closed && found.oriented);
    }
    assert_eq!(count_self_intersections(mesh) > 0, found.self_intersections > 0);
    assert_measurable(mesh);
    write(mesh, choice);
}

/// Writes the mesh in format number `choice` mod 7, or as an animation for number 6, and reads it again, except in VTP
/// and MZ3.
fn write(mesh: &TriangleMesh, choice: usize) {
    let Some(&format) = MeshFormat::ALL.get(choice % 7) else { return animate(mesh) };
    let file = write_mesh(mesh, format).unwrap();
    if !matches!(format, MeshFormat::Vtp | MeshFormat::Mz3) {
        let again = parse_mesh(&file).unwrap_or_else(|error| panic!("{format:?}: {error}"));
        assert_eq!(again.triangles.len(), mesh.triangles.len(), "{format:?}");
    }
}

fn animate(mesh: &TriangleMesh) {
    let part = mesh.components().swap_remove(0);
    let movie = write_animation([mesh, mesh, &part], 0.1).unwrap();
    assert!(parse_mesh(&movie).is_ok());
}
