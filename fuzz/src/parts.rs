//! Fuzz target of the scene of a GLB: a few primitives that share accessors, repeated by nodes, instances, morph targets and
//! skins.

use super::bytes::Choices;
use super::memory;
use super::meshes::container;
use vesicle::io::parse_mesh;

/// Number of vertices in each accessor of positions.
const VERTICES: usize = 6;

/// Most bytes that a scene may need for each of its triangles, for each of its parts, and besides them.
const MEMORY: [usize; 3] = [600, 1500, 4 << 20];

/// Reads a GLB of a scene that the input chooses; it has at most as many triangles as its parts have together, and takes
/// memory for those only.
pub fn glb_parts(data: &[u8]) {
    let mut choices = Choices::new(data);
    let scene = Scene::choose(&mut choices);
    let (json, binary, parts) = scene.document(&mut choices);
    let triangles = parts * scene.triangles();
    let file = container(json.as_bytes(), &binary);
    let (mut read, most) = (0, MEMORY[0] * triangles + MEMORY[1] * parts + MEMORY[2]);
    let peak = memory::peak_of(|| read = read_triangles(&file, triangles));
    assert!(peak <= most, "{peak} bytes for {triangles} triangles, of which {read} were read");
}

fn read_triangles(file: &[u8], most: usize) -> usize {
    match parse_mesh(file) {
        Ok(mesh) => {
            assert!(mesh.validate().is_ok() && mesh.triangles.len() <= most);
            assert!(mesh.positions.len() <= 3 * mesh.triangles.len());
            mesh.triangles.len()
        }
        Err(error) => {
            assert!(error.to_string().len() < 2000);
            0
        }
    }
}

/// The numbers of a scene, which mostly fit together.
struct Scene {
    /// Number of primitives of each mesh.
    primitives: Vec<usize>,
    nodes: usize,
    /// Number of instances; 0 for nodes without instances.
    instances: usize,
    targets: usize,
    skinned: bool,
    /// How many corners the indices have; 0 for primitives without indices.
    corners: usize,
    mode: usize,
    sparse: bool,
}

impl Scene {
    fn choose(choices: &mut Choices) -> Self {
        let meshes = 1 + choices.below(3);
        let most_nodes = if choices.chance(32) { 100 } else { 5 };
        Self {
            primitives: (0..meshes).map(|_| choices.below(3)).collect(),
            nodes: 1 + choices.below(most_nodes),
            instances: if choices.chance(4) { choices.below(9) } else { 0 },
            targets: choices.below(3),
            skinned: choices.chance(4),
            corners: choices.below(16),
            mode: choices.one_of(&[4, 4, 5, 6, 0, 7]),
            sparse: choices.chance(3),
        }
    }

    /// Returns the JSON and the buffer of the scene, and how many parts it has: primitives in their places.
    fn document(&self, choices: &mut Choices) -> (String, Vec<u8>, usize) {
        let sparse = if self.sparse {
            r#","sparse":{"count":2,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0}}"#
        } else {
            ""
        };
        let view = if self.sparse && choices.chance(2) { "" } else { r#""bufferView":0,"# };
        let accessor = |view: &str, kind: u32, count: usize, width: &str, more: &str| {
            format!(r#"{{{view}"componentType":{kind},"count":{count},"type":"{width}"{more}}}"#)
        };
        let accessors = [
            accessor(view, 5126, VERTICES, "VEC3", sparse),
            accessor(r#""bufferView":1,"#, 5121, self.corners, "SCALAR", ""),
            accessor(r#""bufferView":0,"#, 5126, self.instances, "VEC3", ""),
            accessor(r#""bufferView":2,"#, 5121, VERTICES, "VEC4", ""),
            accessor(r#""bufferView":0,"#, 5126, VERTICES, "VEC4", ""),
        ];
        let (nodes, parts) = self.nodes(choices);
        let meshes: Vec<String> = self.primitives.iter().map(|&count| self.mesh(count)).collect();
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{}],"accessors":[{}],
            "skins":[{{"joints":[0,0]}}],"bufferViews":[{{"buffer":0,"byteLength":480}},
            {{"buffer":0,"byteOffset":480,"byteLength":16}},{{"buffer":0,"byteOffset":496,"byteLength":24}}],
            "buffers":[{{"byteLength":520}}]}}"#,
            meshes.join(","),
            accessors.join(",")
        );
        (json, buffer(choices), parts)
    }

    /// Returns the nodes, each the child of an earlier one or of none, and their number of parts.
    fn nodes(&self, choices: &mut Choices) -> (String, usize) {
        let mut children = vec![Vec::new(); self.nodes];
        for node in 1..self.nodes {
            let parent = choices.below(node);
            // Now and then a cycle, or two parents.
            let child = if choices.chance(60) { choices.below(self.nodes) } else { node };
            if choices.chance(2) {
                children[parent].push(child.to_string());
            }
        }
        let (mut nodes, mut parts) = (Vec::new(), 0);
        for children in children {
            let mesh = choices.below(self.primitives.len());
            parts += self.primitives[mesh] * self.instances.max(1);
            nodes.push(format!(r#"{{"mesh":{mesh}{}{}}}"#, list("children", &children), self.members()));
        }
        (nodes.join(","), parts)
    }

    fn members(&self) -> String {
        let instancing = r#","extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2}}}"#;
        let weights = vec!["0.5".to_string(); self.targets];
        let parts = [
            if self.instances > 0 { instancing } else { "" },
            if self.skinned { r#","skin":0"# } else { "" },
            &list("weights", &weights),
        ];
        parts.concat()
    }

    fn mesh(&self, primitives: usize) -> String {
        let indices = if self.corners > 0 { r#","indices":1"# } else { "" };
        let joints = if self.skinned { r#","JOINTS_0":3,"WEIGHTS_0":4"# } else { "" };
        let targets = vec![r#"{"POSITION":0,"NORMAL":0}"#.to_string(); self.targets];
        let (mode, targets) = (self.mode, list("targets", &targets));
        let primitive = format!(
            r#"{{"attributes":{{"POSITION":0,"NORMAL":0{joints}}},"mode":{mode}{indices}{targets}}}"#
        );
        format!(r#"{{"primitives":[{}]}}"#, vec![primitive; primitives].join(","))
    }

    /// Returns the number of triangles of a primitive.
    fn triangles(&self) -> usize {
        let corners = if self.corners > 0 { self.corners } else { VERTICES };
        match self.mode {
            4 => corners / 3,
            5 | 6 => corners.saturating_sub(2),
            _ => 0,
        }
    }
}

/// Returns a member of an object with a list; nothing for an empty one.
fn list(name: &str, entries: &[String]) -> String {
    if entries.is_empty() { String::new() } else { format!(r#","{name}":[{}]"#, entries.join(",")) }
}

/// Returns numbers for positions and instances, indices that ascend at first, and joints.
fn buffer(choices: &mut Choices) -> Vec<u8> {
    let mut out = Vec::new();
    (0..120).for_each(|_| out.extend((choices.within(-4.0, 4.0) as f32).to_le_bytes()));
    (0..16).for_each(|k| out.push(if k < 2 { k } else { choices.below(VERTICES) as u8 }));
    (0..24).for_each(|_| out.push(choices.below(2) as u8));
    out
}
