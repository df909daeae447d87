/** Writes surfaces of labels as one GLB; loaded when it is first needed. */
import { BufferAttribute, BufferGeometry, Mesh, MeshStandardMaterial, Scene } from 'three';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';
import { cellOf, type Warning } from '../warnings';
import type { Label } from './labels';
import type { Surface } from './protocol';

/**
 * Returns a GLB with a node for each label that has a surface, in world coordinates; nodes have the labels' names, and
 * `extras` of the scene the warnings.
 */
export async function toGlb(
  labels: readonly Label[],
  surfaces: ReadonlyMap<number, Surface>,
  warnings: readonly Warning[],
): Promise<Uint8Array> {
  const scene = new Scene();
  if (warnings.length > 0) scene.userData.warnings = warnings.map((one) => `${cellOf([one])}: ${one.text}`);
  for (const label of labels) {
    const surface = surfaces.get(label.value);
    if (surface) scene.add(meshOf(label, surface));
  }
  const result = await new GLTFExporter().parseAsync(scene, { binary: true });
  if (!(result instanceof ArrayBuffer)) throw new Error('the exporter returned no binary file');
  return new Uint8Array(result);
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
