//! Writer of VTP, VTK's XML poly data, with its arrays inline as base64.

use super::frame::Frame;
use super::mesh_file::{color_bytes, push_floats};
use super::notes::comments;
use super::{WriteOptions, base64};
use crate::math::{DVec3, Vec3};
use crate::mesh::TriangleMesh;

/// Returns the text of a VTP file of the mesh with points and triangles; normals, texture coordinates and colours are
/// point data, for which vertices on texture seams are duplicated.
pub(super) fn write(mesh: &TriangleMesh, options: &WriteOptions) -> Vec<u8> {
    let split;
    let mesh = if mesh.corner_uvs.is_some() {
        split = mesh.split_at_seams();
        &split
    } else {
        mesh
    };
    let mut xml = String::from("<?xml version=\"1.0\"?>\n");
    xml += &comments(options.notes, "<!-- warning ", " -->\n");
    xml += "<VTKFile type=\"PolyData\" version=\"1.0\" ";
    xml += "byte_order=\"LittleEndian\" header_type=\"UInt32\">\n<PolyData>\n";
    xml += &field_data(options.frame());
    xml += &format!(
        "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
        mesh.positions.len(),
        mesh.triangles.len()
    );
    xml += &point_data(mesh);
    xml += &format!("<Points>\n{}</Points>\n", points(mesh));
    let offsets = (1..=mesh.triangles.len() as u32).flat_map(|t| (3 * t).to_le_bytes()).collect();
    let connectivity = mesh.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    xml += "<Polys>\n";
    xml += &data_array("Int32", "connectivity", 1, connectivity);
    xml += &data_array("Int32", "offsets", 1, offsets);
    xml += "</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";
    xml.into_bytes()
}

/// Returns the VTP element `FieldData` with the name of the space, as character codes; empty if it is not known.
fn field_data(frame: Frame) -> String {
    let Some(name) = frame.space_name() else { return String::new() };
    let codes: Vec<String> = name.bytes().chain([0]).map(|code| code.to_string()).collect();
    format!(
        "<FieldData>\n<Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">\n{}\n</Array>\n</FieldData>\n",
        codes.join(" ")
    )
}

/// Returns the VTP element `PointData`, with the vertex attributes that the mesh has.
fn point_data(mesh: &TriangleMesh) -> String {
    let mut active = String::new();
    let mut arrays = String::new();
    if let Some(normals) = &mesh.normals {
        active += " Normals=\"Normals\"";
        arrays += &vectors("Normals", normals);
    }
    if let Some(uvs) = &mesh.uvs {
        active += " TCoords=\"TCoords\"";
        let mut bytes = Vec::with_capacity(8 * uvs.len());
        uvs.iter().for_each(|uv| push_floats(&mut bytes, &uv.to_array()));
        arrays += &data_array("Float32", "TCoords", 2, bytes);
    }
    if let Some(colors) = &mesh.colors {
        active += " Scalars=\"Colors\"";
        arrays += &data_array("UInt8", "Colors", 3, colors.iter().copied().flat_map(color_bytes).collect());
    }
    format!("<PointData{active}>\n{arrays}</PointData>\n")
}

/// Returns the VTP element of the positions, in double precision if the mesh has an origin.
fn points(mesh: &TriangleMesh) -> String {
    if mesh.origin == DVec3::ZERO {
        return vectors("Points", &mesh.positions);
    }
    let world = (0..mesh.positions.len()).flat_map(|v| mesh.world_position(v).to_array());
    data_array("Float64", "Points", 3, world.flat_map(f64::to_le_bytes).collect())
}

/// Returns the VTP element of an array of 3D vectors.
fn vectors(name: &str, values: &[Vec3]) -> String {
    let mut bytes = Vec::with_capacity(12 * values.len());
    values.iter().for_each(|v| push_floats(&mut bytes, &v.to_array()));
    data_array("Float32", name, 3, bytes)
}

/// Returns the VTP element of a data array; the length of the array in bytes precedes its data inside the base64.
fn data_array(kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> String {
    let mut block = (bytes.len() as u32).to_le_bytes().to_vec();
    block.extend(bytes);
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">\n{}\n</DataArray>\n",
        base64::encode(&block)
    )
}
