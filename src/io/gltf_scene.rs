//! The scene of a glTF document: its nodes, with their meshes, instances, morph weights and skins.

use super::FormatError;
use super::frame::Frame;
use super::glb::FORMAT;
use super::gltf::{Document, Primitive, numbers, unsigned, unsigned_list};
use super::gltf_accessor::Accessor;
use super::gltf_skin::Skin;
use crate::math::{DAffine3, DVec3};
use crate::mesh::{TriangleMesh, WorldPositions};
use glam::{DMat4, DQuat};
use serde_json::Value;
use std::rc::Rc;

/// Maximum total number of triangle corners that are read from a glTF document: nodes may repeat a mesh, so that a
/// small file may stand for any number of triangles. Morphed and instanced ones count several times.
const CORNER_LIMIT: u64 = 3 << 23;

/// Minimum number of corners that a primitive counts towards [`CORNER_LIMIT`], so that empty primitives repeated by
/// many nodes also reach the limit.
const PRIMITIVE_COST: u64 = 64;

/// A triangle primitive of the scene, with the shape and place that its node gives it.
pub(super) struct Part<'a> {
    pub(super) primitive: Primitive<'a>,
    weights: Rc<[f64]>,
    place: Place,
}

/// The place of a primitive: that of its node, or those of the joints of its skin.
#[derive(Clone)]
enum Place {
    Node(DAffine3),
    Skin(Rc<Skin>),
}

impl Part<'_> {
    /// Returns the part in world space, but for positions, which are appended to `positions` in double precision.
    pub(super) fn read(&self, positions: &mut WorldPositions) -> Result<TriangleMesh, FormatError> {
        let read = self.primitive.read(&self.weights)?;
        match &self.place {
            Place::Skin(skin) => skin.pose(&self.primitive, read, positions),
            Place::Node(to_world) => {
                let mesh = read.mesh;
                positions.extend(mesh.positions.iter().map(|p| to_world.transform_point3(p.as_dvec3())));
                Ok(mesh.transformed(to_world))
            }
        }
    }
}

/// A node of the scene, with its transform to world space.
struct Node<'a> {
    index: u64,
    value: &'a Value,
    to_world: DAffine3,
}

impl<'a> Document<'a> {
    /// Returns all triangle primitives of the default scene, in the order of its nodes. An error if the nodes are not a
    /// tree, or the primitives exceed [`CORNER_LIMIT`].
    pub(super) fn parts(&self) -> Result<Vec<Part<'a>>, FormatError> {
        let nodes = self.nodes()?;
        let mut skins = Skins::new(self, &nodes);
        let (mut parts, mut corners) = (Vec::new(), 0_u64);
        // Sparse accessors are checked as a whole for each primitive.
        let is_sparse = self.has_sparse_accessors();
        for node in &nodes {
            let Some(mesh) = unsigned(node.value, "mesh")? else { continue };
            let mesh = self.entry("meshes", mesh)?;
            let primitives = mesh["primitives"].as_array().map_or(&[][..], Vec::as_slice);
            if primitives.is_empty() {
                continue;
            }
            let weights: Rc<[f64]> = weights(node.value, mesh)?.into();
            let morphs = 1 + weights.iter().filter(|&&weight| weight != 0.0).count() as u64;
            for place in self.places(node, &mut skins)? {
                for value in primitives {
                    let primitive = Primitive::new(self, value)?;
                    let checked = |p: &Primitive| if is_sparse { p.positions.count as u64 } else { 0 };
                    let cost =
                        primitive.as_ref().map_or(0, |p| p.corners.max(checked(p)).saturating_mul(morphs));
                    corners = corners.saturating_add(cost.max(PRIMITIVE_COST + weights.len() as u64));
                    if corners > CORNER_LIMIT {
                        return Err(FormatError::too_large(FORMAT, "accessors", corners.saturating_mul(12)));
                    }
                    let (weights, place) = (Rc::clone(&weights), place.clone());
                    parts.extend(primitive.map(|primitive| Part { primitive, weights, place }));
                }
            }
        }
        Ok(parts)
    }

    fn has_sparse_accessors(&self) -> bool {
        let accessors = self.root["accessors"].as_array();
        accessors.into_iter().flatten().any(|accessor| !accessor["sparse"].is_null())
    }

    /// Returns the frame that the only root of the scene states, if it maps positions from that to glTF's space.
    pub(super) fn frame(&self) -> Result<Option<Frame>, FormatError> {
        let [root] = self.roots()?[..] else { return Ok(None) };
        let node = self.entry("nodes", root)?;
        if node["extras"].is_null() {
            return Ok(None);
        }
        Ok(Frame::of_root(node, &transform(node, root)?))
    }

    /// Returns the visible nodes of the default scene, parents before children. An error if they are not a tree.
    fn nodes(&self) -> Result<Vec<Node<'a>>, FormatError> {
        let mut seen = vec![false; self.root["nodes"].as_array().map_or(0, Vec::len)];
        let (roots, is_framed) = (self.roots()?, self.frame()?.is_some());
        let mut stack: Vec<(u64, DAffine3)> = roots.into_iter().map(|n| (n, DAffine3::IDENTITY)).collect();
        stack.reverse();
        let mut nodes = Vec::new();
        while let Some((index, parent)) = stack.pop() {
            let value = self.entry("nodes", index)?;
            if std::mem::replace(&mut seen[index as usize], true) {
                let problem = "is reached twice; nodes must form a tree";
                return Err(FormatError::invalid(FORMAT, format!("nodes[{index}]"), problem));
            }
            if value["extensions"]["KHR_node_visibility"]["visible"] == false {
                continue;
            }
            // Nodes beneath a root that maps positions to glTF's space are read as they were before.
            let is_frame = is_framed && nodes.is_empty();
            let to_world = if is_frame { DAffine3::IDENTITY } else { parent * transform(value, index)? };
            nodes.push(Node { index, value, to_world });
            let children = unsigned_list(&value["children"], "children")?;
            stack.extend(children.into_iter().rev().map(|child| (child, to_world)));
        }
        Ok(nodes)
    }

    /// Returns the indices of the root nodes of the default scene; without a default, of the first scene; without
    /// scenes, of the document.
    fn roots(&self) -> Result<Vec<u64>, FormatError> {
        if self.root["scenes"].as_array().is_some_and(|scenes| !scenes.is_empty()) {
            let scene = unsigned(self.root, "scene")?.unwrap_or(0);
            return unsigned_list(&self.entry("scenes", scene)?["nodes"], "nodes");
        }
        let nodes = self.root["nodes"].as_array().map_or(&[][..], Vec::as_slice);
        let mut is_child = vec![false; nodes.len()];
        for node in nodes {
            for child in unsigned_list(&node["children"], "children")? {
                self.entry("nodes", child)?;
                is_child[child as usize] = true;
            }
        }
        Ok((0..).zip(is_child).filter_map(|(n, is)| (!is).then_some(n)).collect())
    }

    /// Returns where the mesh of a node is: once, or as often as the node has instances.
    fn places(&self, node: &Node, skins: &mut Skins) -> Result<Vec<Place>, FormatError> {
        if let Some(index) = unsigned(node.value, "skin")? {
            return Ok(vec![Place::Skin(skins.get(self, index)?)]);
        }
        let instancing = &node.value["extensions"]["EXT_mesh_gpu_instancing"];
        if instancing.is_null() {
            return Ok(vec![Place::Node(node.to_world)]);
        }
        let instances = self.instances(&instancing["attributes"])?;
        Ok(instances.into_iter().map(|instance| Place::Node(node.to_world * instance)).collect())
    }

    /// Returns the transforms of the instances of a mesh (`EXT_mesh_gpu_instancing`) relative to its node.
    fn instances(&self, attributes: &Value) -> Result<Vec<DAffine3>, FormatError> {
        let read = |name: &str, width: usize| {
            unsigned(attributes, name)?.map(|index| self.accessor(index, &[width])).transpose()
        };
        let (moves, turns, scales) = (read("TRANSLATION", 3)?, read("ROTATION", 4)?, read("SCALE", 3)?);
        let counts: Vec<usize> = [&moves, &turns, &scales].into_iter().flatten().map(|a| a.count).collect();
        let count = counts.first().copied().unwrap_or(0);
        const MOST: usize = (CORNER_LIMIT / PRIMITIVE_COST) as usize;
        if counts.iter().any(|&other| other != count) || count > MOST {
            let problem = format!("attributes must be equally many, at most {MOST}, got {counts:?}");
            return Err(FormatError::invalid(FORMAT, "EXT_mesh_gpu_instancing", problem));
        }
        let vector = |a: &Option<Accessor>, i, default| a.as_ref().map_or(default, |a| a.numbers(i));
        let instance = |i: usize| {
            let turn = turns.as_ref().map_or(NO_ROTATION, |a| a.numbers(i));
            composed(vector(&scales, i, [1.0; 3]), turn, vector(&moves, i, [0.0; 3]))
        };
        Ok((0..count).map(instance).collect())
    }
}

/// The skins of a document that were read so far.
struct Skins {
    /// The transform of each visible node to world space; empty in a document without skins.
    to_world: Vec<Option<DAffine3>>,
    skins: Vec<Option<Rc<Skin>>>,
}

impl Skins {
    fn new(document: &Document, nodes: &[Node]) -> Self {
        let count = |table: &str| document.root[table].as_array().map_or(0, Vec::len);
        let skins = vec![None; count("skins")];
        let mut to_world = vec![None; if skins.is_empty() { 0 } else { count("nodes") }];
        for node in nodes {
            if let Some(place) = to_world.get_mut(node.index as usize) {
                *place = Some(node.to_world);
            }
        }
        Self { to_world, skins }
    }

    fn get(&mut self, document: &Document, index: u64) -> Result<Rc<Skin>, FormatError> {
        document.entry("skins", index)?;
        let known = &mut self.skins[index as usize];
        if let Some(skin) = known {
            return Ok(Rc::clone(skin));
        }
        Ok(Rc::clone(known.insert(Rc::new(Skin::new(document, index, &self.to_world)?))))
    }
}

/// Returns the default weights of morph targets: those of the node, else of its mesh; empty if there are none.
fn weights(node: &Value, mesh: &Value) -> Result<Vec<f64>, FormatError> {
    let given = if node["weights"].is_null() { &mesh["weights"] } else { &node["weights"] };
    let Some(list) = given.as_array() else { return Ok(Vec::new()) };
    let found: Option<Vec<f64>> = list.iter().map(Value::as_f64).collect();
    found.ok_or_else(|| FormatError::invalid(FORMAT, "weights", "must be an array of numbers"))
}

/// Returns the transform of a glTF node relative to its parent, from its matrix or from scale, rotation and
/// translation.
fn transform(node: &Value, index: u64) -> Result<DAffine3, FormatError> {
    let field = |name: &str| format!("nodes[{index}].{name}");
    if let Some(m) = numbers::<16>(&node["matrix"], || field("matrix"))? {
        let matrix = DMat4::from_cols_array(&m);
        return Ok(DAffine3::from_mat4(matrix));
    }
    let scale = numbers(&node["scale"], || field("scale"))?.unwrap_or([1.0; 3]);
    let rotation = numbers(&node["rotation"], || field("rotation"))?.unwrap_or(NO_ROTATION);
    let translation = numbers(&node["translation"], || field("translation"))?.unwrap_or([0.0; 3]);
    if rotation.iter().all(|&x| x == 0.0) {
        return Err(FormatError::invalid(FORMAT, field("rotation"), "must be a unit quaternion, got 0"));
    }
    Ok(composed(scale, rotation, translation))
}

/// The quaternion of no rotation.
const NO_ROTATION: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Returns the transform that scales, then rotates, then moves. Never inlined, as it is long.
#[inline(never)]
fn composed(scale: [f64; 3], rotation: [f64; 4], translation: [f64; 3]) -> DAffine3 {
    let [scale, translation] = [scale, translation].map(DVec3::from_array);
    DAffine3::from_scale_rotation_translation(scale, DQuat::from_array(rotation).normalize(), translation)
}
