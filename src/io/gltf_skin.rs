//! Skins of glTF meshes: vertices that move with joints, in the pose that the nodes of the document have.

use super::FormatError;
use super::glb::FORMAT;
use super::gltf::{Document, Primitive, PrimitiveMesh, unsigned, unsigned_list};
use super::gltf_accessor::Accessor;
use crate::math::DAffine3;
use crate::mesh::{TriangleMesh, WorldPositions};
use glam::{DMat3, DMat4, DVec3};

/// Largest number of sets of four joints that vertices move with.
const MOST_SETS: usize = 4;

/// A skin: for each joint, the transform of vertices from the bind pose to world space.
pub(super) struct Skin(Vec<DAffine3>);

impl Skin {
    /// Reads skin `index` of a document, whose visible nodes have the transforms `to_world`.
    pub(super) fn new(
        document: &Document,
        index: u64,
        to_world: &[Option<DAffine3>],
    ) -> Result<Self, FormatError> {
        let value = document.entry("skins", index)?;
        let invalid = |problem| FormatError::invalid(FORMAT, format!("skins[{index}]"), problem);
        let joints = unsigned_list(&value["joints"], "joints")?;
        let inverses = unsigned(value, "inverseBindMatrices")?;
        let inverses = inverses.map(|accessor| document.accessor(accessor, &[16])).transpose()?;
        if inverses.as_ref().is_some_and(|inverses| inverses.count < joints.len()) {
            return Err(invalid("has fewer inverseBindMatrices than joints".into()));
        }
        let mut maps = Vec::with_capacity(joints.len());
        for (k, node) in joints.into_iter().enumerate() {
            let to_world = usize::try_from(node).ok().and_then(|node| to_world.get(node).copied().flatten());
            let to_world =
                to_world.ok_or_else(|| invalid(format!("joint {node} is no node of the scene")))?;
            let inverse = inverses.as_ref().map(|inverses| inverses.numbers::<16>(k));
            let inverse = inverse.map(|columns| DAffine3::from_mat4(DMat4::from_cols_array(&columns)));
            maps.push(to_world * inverse.unwrap_or(DAffine3::IDENTITY));
        }
        Ok(Self(maps))
    }

    /// Returns a primitive of the skin in its pose, but for positions, which are appended to `positions`.
    pub(super) fn pose(
        &self,
        primitive: &Primitive,
        PrimitiveMesh { mut mesh, vertices }: PrimitiveMesh,
        positions: &mut WorldPositions,
    ) -> Result<TriangleMesh, FormatError> {
        let influences = Influences::new(primitive)?;
        let mut maps = Vec::with_capacity(vertices.len());
        for v in vertices {
            maps.push(influences.blend(v as usize, &self.0)?);
        }
        let first = mesh.triangles.first().map_or(0, |triangle| triangle[0] as usize);
        if maps.get(first).is_some_and(|map| map.matrix3.determinant() < 0.0) {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        for (normal, map) in mesh.normals.iter_mut().flatten().zip(&maps) {
            *normal = turned(map.matrix3, normal.as_dvec3()).as_vec3();
        }
        positions.extend(mesh.positions.iter().zip(&maps).map(|(p, map)| map.transform_point3(p.as_dvec3())));
        Ok(mesh)
    }
}

/// Returns a normal transformed by a map of positions, of unit length or 0.
fn turned(map: DMat3, normal: DVec3) -> DVec3 {
    let [x, y, z] = [map.x_axis, map.y_axis, map.z_axis];
    let sign = map.determinant().signum();
    ((y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z) * sign).normalize_or_zero()
}

/// The joints that each vertex of a primitive moves with, in sets of four, and their weights.
struct Influences<'a>(Vec<[Accessor<'a>; 2]>);

impl<'a> Influences<'a> {
    fn new(primitive: &Primitive<'a>) -> Result<Self, FormatError> {
        let mut sets = Vec::new();
        loop {
            let [joints, weights] = ["JOINTS", "WEIGHTS"]
                .map(|name| primitive.attribute(&format!("{name}_{}", sets.len()), &[4]));
            match (joints?, weights?) {
                (Some(_), Some(_)) if sets.len() == MOST_SETS => {
                    let found = format!("more than {MOST_SETS} sets of JOINTS");
                    return Err(FormatError::unsupported(
                        FORMAT,
                        "attributes",
                        found,
                        "sixteen joints a vertex",
                    ));
                }
                (Some(joints), Some(weights)) => sets.push([joints, weights]),
                _ if sets.is_empty() => {
                    let problem = "a mesh with a skin must have JOINTS_0 and WEIGHTS_0";
                    return Err(FormatError::invalid(FORMAT, "attributes", problem));
                }
                _ => return Ok(Self(sets)),
            }
        }
    }

    /// Returns the mean of the maps of a vertex's joints by its weights; the first joint's if all weights are 0.
    fn blend(&self, vertex: usize, joints: &[DAffine3]) -> Result<DAffine3, FormatError> {
        let (mut matrix, mut shift, mut total) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for [indices, weights] in &self.0 {
            for k in 0..4 {
                let weight = weights.number(vertex, k);
                if weight != 0.0 {
                    let map = joint(joints, indices.number(vertex, k))?;
                    matrix += map.matrix3 * weight;
                    shift += map.translation * weight;
                    total += weight;
                }
            }
        }
        if total == 0.0 {
            return joint(joints, self.0.first().map_or(0.0, |[indices, _]| indices.number(vertex, 0)));
        }
        Ok(DAffine3 { matrix3: matrix * (1.0 / total), translation: shift / total })
    }
}

fn joint(joints: &[DAffine3], index: f64) -> Result<DAffine3, FormatError> {
    joints.get(index as usize).copied().ok_or_else(|| {
        let problem = format!("joint {index} is out of range; the skin has {}", joints.len());
        FormatError::invalid(FORMAT, "JOINTS", problem)
    })
}
