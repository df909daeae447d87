//! Writing of NRRD files with header and voxels in one file.

use super::FORMAT;
use crate::io::FormatError;
use crate::io::deflate::gzip;
use crate::io::raw::volume_error;
use crate::io::volume_file::{Compression, with_payload, with_voxels, written};
use crate::math::DVec3;
use crate::volume::{LengthUnit, Space, Volume, Voxels};

/// Returns the volume as an NRRD file in its own space. Frames are a fourth axis of kind list, the slowest one, whose
/// spacing is the time between frames in seconds. The voxels are gzipped if `compression` is not `None`.
///
/// # Errors
/// [`FormatError::TooLarge`] if there is not enough memory for the file.
pub(in crate::io) fn write(volume: &Volume, compression: Compression) -> Result<Vec<u8>, FormatError> {
    let voxels = volume.unscaled().map_err(|error| volume_error(FORMAT, error))?;
    let name = number_type(&voxels);
    let header = |encoding: &str| header(volume, name, encoding);
    match compression {
        Compression::None => with_voxels(FORMAT, header("raw"), &voxels),
        Compression::Deflate => {
            let plain = with_voxels(FORMAT, String::new(), &voxels)?;
            with_payload(FORMAT, header("gzip"), &gzip(FORMAT, &plain)?)
        }
    }
}

/// Returns the format's name of a voxel type.
fn number_type(voxels: &Voxels) -> &'static str {
    match voxels {
        Voxels::U8(_) => "uint8",
        Voxels::I8(_) => "int8",
        Voxels::U16(_) => "uint16",
        Voxels::I16(_) => "int16",
        Voxels::U32(_) => "uint32",
        Voxels::I32(_) => "int32",
        Voxels::F32(_) => "float",
        Voxels::F64(_) => "double",
    }
}

/// Returns the header of the volume's file, with the blank line that ends it.
fn header(volume: &Volume, number_type: &str, encoding: &str) -> String {
    let [nx, ny, nz] = volume.dims();
    let space = match volume.space() {
        Space::Ras => "right-anterior-superior",
        Space::Lps => "left-posterior-superior",
    };
    let axes = volume.affine().matrix3;
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis].map(vector);
    let frames = volume.frames();
    let (dimension, size, none, list) =
        if frames > 1 { (4, format!(" {frames}"), " none", " list") } else { (3, String::new(), "", "") };
    let lines = [
        "NRRD0004".to_owned(),
        format!("type: {number_type}"),
        format!("dimension: {dimension}"),
        format!("space: {space}"),
        format!("sizes: {nx} {ny} {nz}{size}"),
        format!("space directions: {x} {y} {z}{none}"),
        format!("kinds: domain domain domain{list}"),
        "endian: little".to_owned(),
        format!("encoding: {encoding}"),
        format!("space origin: {}", vector(volume.affine().translation)),
    ];
    let optional = [unit_line(volume.unit()), time_lines(volume)];
    let lines: Vec<String> = lines.into_iter().chain(optional.into_iter().flatten()).collect();
    lines.join("\n") + "\n\n"
}

fn vector(v: DVec3) -> String {
    format!("({})", written(v.to_array()).join(","))
}

fn unit_line(unit: LengthUnit) -> Option<String> {
    let name = match unit {
        LengthUnit::Unknown => return None,
        LengthUnit::Metre => "m",
        LengthUnit::Millimetre => "mm",
        LengthUnit::Micrometre => "um",
    };
    Some(format!("space units: \"{name}\" \"{name}\" \"{name}\""))
}

/// Returns the fields that give the time between frames, if the volume has one. Axes with a direction have neither
/// spacing nor unit.
fn time_lines(volume: &Volume) -> Option<String> {
    let seconds = volume.frame_seconds();
    let known = volume.frames() > 1 && seconds > 0.0;
    known.then(|| format!("spacings: nan nan nan {seconds:?}\nunits: \"\" \"\" \"\" \"s\""))
}
