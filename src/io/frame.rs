//! Frames of positions in mesh files: the directions of the axes, and the length of a unit.
//!
//! 3D Slicer reads `SPACE=RAS` or `SPACE=LPS` in a comment or header of STL, PLY and OBJ and in field data of VTP, and takes
//! files without for LPS. glTF is in metres with y upwards: a root node maps positions to that, and its `extras` say from
//! what, so that they can be read back as they were.

use crate::math::{DAffine3, DMat3, DVec3};
use crate::mesh::TriangleMesh;
use crate::volume::{LengthUnit, Space};
use serde_json::Value;

/// How a mesh is written to a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WriteOptions<'a> {
    /// Notes for the reader of the file, a line `code: text` each, which programs ignore.
    pub notes: &'a str,
    /// The directions of the axes of the mesh, if they are to be stated.
    pub space: Option<Space>,
    /// The directions of the axes in the file, if they are to be others: x and y are then negated. Not without `space`.
    pub written_as: Option<Space>,
    /// The length of a unit of positions, if it is known; only GLB can state it.
    pub unit: LengthUnit,
}

impl WriteOptions<'_> {
    /// Returns the frame of positions in the file.
    pub(super) fn frame(&self) -> Frame {
        Frame { space: self.space.and(self.written_as).or(self.space), unit: self.unit }
    }

    /// Returns whether the axes are to have other directions in the file, for which [`half_turn`] is needed.
    pub(super) fn turns(&self) -> bool {
        self.space.is_some() && self.space != self.frame().space
    }
}

/// Returns the mesh rotated by 180° about z, which is exact.
pub(super) fn half_turn(mut mesh: TriangleMesh) -> TriangleMesh {
    // Subtractions, so that there is no negative zero.
    let vectors = mesh.positions.iter_mut().chain(mesh.normals.iter_mut().flatten());
    vectors.for_each(|v| (v.x, v.y) = (0.0 - v.x, 0.0 - v.y));
    mesh.origin = DVec3::new(0.0 - mesh.origin.x, 0.0 - mesh.origin.y, mesh.origin.z);
    mesh
}

/// The directions of the axes of positions in a file, and the length of a unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Frame {
    pub(super) space: Option<Space>,
    pub(super) unit: LengthUnit,
}

/// The names of the spaces and units in files.
const SPACES: [(Space, &str); 2] = [(Space::Ras, "RAS"), (Space::Lps, "LPS")];
const UNITS: [(LengthUnit, &str); 3] =
    [(LengthUnit::Metre, "m"), (LengthUnit::Millimetre, "mm"), (LengthUnit::Micrometre, "um")];

impl Frame {
    /// Returns the name of the space, if it is known.
    pub(super) fn space_name(self) -> Option<&'static str> {
        SPACES.iter().find(|(space, _)| Some(*space) == self.space).map(|&(_, name)| name)
    }

    /// Returns a line that states the space in the way of 3D Slicer, after `start`; empty if it is not known.
    pub(super) fn comment(self, start: &str) -> String {
        self.space_name().map_or(String::new(), |name| format!("{start}SPACE={name}"))
    }

    /// Returns the transform from positions to glTF's space, in metres, with x to the left of the patient, y upwards and z to
    /// the front, which viewers show. Without a space, axes are kept; without a unit, lengths.
    fn to_gltf(self) -> DAffine3 {
        let scale = match self.unit {
            LengthUnit::Metre | LengthUnit::Unknown => 1.0,
            LengthUnit::Millimetre => 1e-3,
            LengthUnit::Micrometre => 1e-6,
        };
        let axes = match self.space {
            None => DMat3::IDENTITY,
            Some(Space::Ras) => DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::Y),
            Some(Space::Lps) => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
        };
        DAffine3::from_mat3(axes * scale)
    }

    /// Returns a glTF node in JSON that maps its children to glTF's space; `None` if neither space nor unit is known.
    pub(super) fn root(self, children: &str) -> Option<String> {
        let unit = UNITS.iter().find(|(unit, _)| *unit == self.unit).map(|&(_, name)| name);
        let members = [("space", self.space_name()), ("unit", unit)];
        let known: Vec<String> =
            members.iter().filter_map(|(key, name)| Some(format!(r#""{key}":"{}""#, (*name)?))).collect();
        if known.is_empty() {
            return None;
        }
        let [x, y, z] = self.to_gltf().matrix3.to_cols_array_2d();
        let matrix: Vec<String> = [x, y, z, [0.0; 3]]
            .iter()
            .enumerate()
            .flat_map(|(column, [a, b, c])| [*a, *b, *c, f64::from(u8::from(column == 3))])
            // No negative zero.
            .map(|number| (number + 0.0).to_string())
            .collect();
        let (matrix, extras) = (matrix.join(","), known.join(","));
        Some(format!(r#"{{"matrix":[{matrix}],"children":[{children}],"extras":{{{extras}}}}}"#))
    }

    /// Returns the frame that the node of a glTF document states that [`Self::root`] gave, with the transform `to_world`;
    /// `None` for any other node, or if it was moved since.
    pub(super) fn of_root(node: &Value, to_world: &DAffine3) -> Option<Self> {
        let extras = &node["extras"];
        let known = |key: &str| extras[key].as_str();
        let space = SPACES.iter().find(|(_, name)| known("space") == Some(name)).map(|&(space, _)| space);
        let unit = UNITS.iter().find(|(_, name)| known("unit") == Some(name)).map(|&(unit, _)| unit);
        let frame = Self { space, unit: unit.unwrap_or_default() };
        let expected = frame.to_gltf();
        // Other programs may have rounded the numbers to single precision.
        let tolerance = 1e-6 * expected.matrix3.x_axis.length();
        let is_stated = space.is_some() || unit.is_some();
        (is_stated && expected.abs_diff_eq(*to_world, tolerance)).then_some(frame)
    }
}
