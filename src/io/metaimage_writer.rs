//! Writer of MetaImage with header and voxels in one file (.mha); see [`super::metaimage`] for the reader.

use super::FormatError;
use super::deflate::zlib;
use super::metaimage::FORMAT;
use super::raw::volume_error;
use super::volume_file::{Compression, with_payload, with_voxels, written};
use crate::math::DVec3;
use crate::volume::{LengthUnit, Space, Volume, Voxels};

/// Returns the volume as a MetaImage file, whose world space is LPS. Frames are a fourth axis, whose spacing is the time
/// between frames in seconds, or 1 if it is unknown. The voxels are a zlib stream if `compression` is not `None`.
///
/// # Errors
/// [`FormatError::TooLarge`] if there is not enough memory for the file.
pub(super) fn write(volume: &Volume, compression: Compression) -> Result<Vec<u8>, FormatError> {
    let voxels = volume.unscaled().map_err(|error| volume_error(FORMAT, error))?;
    let name = number_type(&voxels);
    match compression {
        Compression::None => with_voxels(FORMAT, header(volume, name, None), &voxels),
        Compression::Deflate => {
            let plain = with_voxels(FORMAT, String::new(), &voxels)?;
            let payload = zlib(FORMAT, &plain)?;
            with_payload(FORMAT, header(volume, name, Some(payload.len())), &payload)
        }
    }
}

/// Returns the format's name of a voxel type.
fn number_type(voxels: &Voxels) -> &'static str {
    match voxels {
        Voxels::U8(_) => "MET_UCHAR",
        Voxels::I8(_) => "MET_CHAR",
        Voxels::U16(_) => "MET_USHORT",
        Voxels::I16(_) => "MET_SHORT",
        Voxels::U32(_) => "MET_UINT",
        Voxels::I32(_) => "MET_INT",
        Voxels::F32(_) => "MET_FLOAT",
        Voxels::F64(_) => "MET_DOUBLE",
    }
}

/// Returns the header of the volume's file; `compressed` is the size of the voxels in bytes if they are compressed.
fn header(volume: &Volume, number_type: &str, compressed: Option<usize>) -> String {
    let rank = if volume.frames() > 1 { 4 } else { 3 };
    let [nx, ny, nz] = volume.dims();
    let seconds = volume.frame_seconds();
    let geometry = Geometry::of(volume);
    let [dx, dy, dz] = geometry.spacing;
    let spacing = [dx, dy, dz, if seconds > 0.0 { seconds } else { 1.0 }];
    let sizes = [nx, ny, nz, volume.frames()].map(|n| n.to_string());
    let numbers = |values: [f64; 4]| written(values.into_iter().take(rank)).join(" ");
    let mut lines = vec![
        "ObjectType = Image".to_owned(),
        format!("NDims = {rank}"),
        "BinaryData = True".to_owned(),
        "BinaryDataByteOrderMSB = False".to_owned(),
        format!("CompressedData = {}", if compressed.is_some() { "True" } else { "False" }),
    ];
    lines.extend(compressed.map(|size| format!("CompressedDataSize = {size}")));
    lines.push(format!("TransformMatrix = {}", geometry.matrix(rank)));
    lines.push(format!("Offset = {}", numbers(four(geometry.origin, 0.0))));
    lines.push(format!("CenterOfRotation = {}", vec!["0"; rank].join(" ")));
    lines.extend(geometry.orientation().map(|letters| format!("AnatomicalOrientation = {letters}")));
    lines.extend(unit(volume.unit()).map(|name| format!("DistanceUnits = {name}")));
    lines.push(format!("ElementSpacing = {}", numbers(spacing)));
    lines.push(format!("DimSize = {}", sizes[..rank].join(" ")));
    lines.push(format!("ElementType = {number_type}"));
    lines.push("ElementDataFile = LOCAL\n".to_owned());
    lines.join("\n")
}

fn four(v: DVec3, last: f64) -> [f64; 4] {
    [v.x, v.y, v.z, last]
}

/// Returns the format's name of a unit of length; it has none for metres, which our reader accepts as `m`.
fn unit(unit: LengthUnit) -> Option<&'static str> {
    match unit {
        LengthUnit::Unknown => None,
        LengthUnit::Metre => Some("m"),
        LengthUnit::Millimetre => Some("mm"),
        LengthUnit::Micrometre => Some("um"),
    }
}

/// The transform from voxel indices to LPS world space, as the format stores it.
struct Geometry {
    /// Unit vector along each axis.
    directions: [DVec3; 3],
    spacing: [f64; 3],
    origin: DVec3,
}

impl Geometry {
    fn of(volume: &Volume) -> Self {
        let affine = volume.affine_in(Space::Lps);
        let axes = [affine.matrix3.x_axis, affine.matrix3.y_axis, affine.matrix3.z_axis];
        let spacing = axes.map(DVec3::length);
        let directions = [0, 1, 2].map(|axis| axes[axis] / spacing[axis]);
        Self { directions, spacing, origin: affine.translation }
    }

    /// Returns the numbers of `TransformMatrix` for `rank` axes, each row the direction of an axis.
    fn matrix(&self, rank: usize) -> String {
        let [x, y, z] = self.directions.map(|direction| four(direction, 0.0));
        let rows = [x, y, z, four(DVec3::ZERO, 1.0)];
        let numbers = rows.into_iter().take(rank).flat_map(|row| row.into_iter().take(rank));
        written(numbers).join(" ")
    }

    /// Returns the letters of `AnatomicalOrientation`: the side of the patient from which each axis comes, by its largest
    /// component; `None` if two axes would have the same.
    fn orientation(&self) -> Option<String> {
        let main = self.directions.map(|d| {
            let [x, y, z] = d.abs().to_array();
            if x >= y && x >= z { 0 } else { 1 + usize::from(z > y) }
        });
        let distinct = main[0] != main[1] && main[1] != main[2] && main[0] != main[2];
        let letter = |(&axis, direction): (&usize, DVec3)| {
            [["R", "L"], ["A", "P"], ["I", "S"]][axis][usize::from(direction[axis] < 0.0)]
        };
        distinct.then(|| main.iter().zip(self.directions).map(letter).collect())
    }
}
