/** Writes surfaces of labels as one GLB; loaded when it is first needed. */
import { BufferAttribute, BufferGeometry, Group, Mesh, MeshStandardMaterial, Scene } from 'three';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';
import type { Label } from '../../engine/labels';
import type { ExportRequest } from '../../engine/protocol';
import { cellOf, type Warning } from '../../engine/warnings';
import type { Surface } from './protocol';

/** Metres of the units of length. */
const METRES = { m: 1, mm: 1e-3, um: 1e-6 };

/**
 * Returns a GLB with a node for each label that has a surface, in world coordinates; nodes have the labels' names, and
 * `extras` of the scene the warnings. If the space or the unit is known, they are beneath one node that maps them to
 * glTF's space and says so, as that of `Mesh.toBytes`.
 */
export async function toGlb(
  labels: readonly Label[],
  surfaces: ReadonlyMap<number, Surface>,
  warnings: readonly Warning[],
  frame: Pick<ExportRequest, 'space' | 'unit'>,
): Promise<Uint8Array> {
  const scene = new Scene();
  const isStated = frame.space !== undefined || frame.unit !== undefined;
  const parent = isStated ? rootOf(frame) : scene;
  if (isStated) scene.add(parent);
  if (warnings.length > 0) scene.userData.warnings = warnings.map((one) => `${cellOf([one])}: ${one.text}`);
  for (const label of labels) {
    const surface = surfaces.get(label.value);
    if (surface) parent.add(meshOf(label, surface));
  }
  const result = await new GLTFExporter().parseAsync(scene, { binary: true });
  if (!(result instanceof ArrayBuffer)) throw new Error('the exporter returned no binary file');
  return new Uint8Array(result);
}

/** Returns the node that maps positions to metres, with x to the left of the patient, y upwards and z to the front. */
function rootOf({ space, unit }: Pick<ExportRequest, 'space' | 'unit'>): Group {
  const root = new Group();
  const scale = unit ? METRES[unit] : 1;
  const [x, y] = space === 'LPS' ? [scale, -scale] : [-scale, scale];
  if (space) root.matrix.set(x, 0, 0, 0, 0, 0, scale, 0, 0, y, 0, 0, 0, 0, 0, 1);
  else root.matrix.makeScale(scale, scale, scale);
  root.matrix.decompose(root.position, root.quaternion, root.scale);
  root.userData = { ...(space && { space }), ...(unit && { unit }) };
  return root;
}

function meshOf({ name, color }: Label, { positions, normals, indices, vertices, triangles, origin }: Surface): Mesh {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions.slice(0, 3 * vertices), 3));
  geometry.setAttribute('normal', new BufferAttribute(normals.slice(0, 3 * vertices), 3));
  geometry.setIndex(new BufferAttribute(indices.slice(0, 3 * triangles), 1));
  const mesh = new Mesh(geometry, new MeshStandardMaterial({ name, color, roughness: 0.62, metalness: 0 }));
  mesh.name = name;
  mesh.position.set(...origin);
  return mesh;
}
