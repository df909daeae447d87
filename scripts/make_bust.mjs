// Makes the bust of the Sculpt lab and its base in www/public/data: node scripts/make_bust.mjs <nefertiti-lowres.obj>
// Both are written without normals, which readers compute again. Needs pkg/.
import { readFile, writeFile } from 'node:fs/promises';
import init, { Mesh, MultiresolutionModel } from '../pkg/index.js';
import { at, say, script } from './shell.mjs';

/** Ellipsoids of crown, head, neck and chest, as in www/src/labs/sculpt/examples. */
const ELLIPSOIDS = [
  {
    center: [0, 125, 0],
    axes: [
      [95, 0, 0],
      [0, 60.75, -44.25],
      [0, 64.9, 89.1],
    ],
  },
  upright([0, 0, 60], [58, 75, 72]),
  upright([0, -110, 40], [42, 70, 42]),
  upright([0, -205, 5], [92, 42, 60]),
];

function upright(center, [a, b, c]) {
  return {
    center,
    axes: [
      [a, 0, 0],
      [0, b, 0],
      [0, 0, c],
    ],
  };
}

/** Returns a mesh as binary PLY with positions and triangles only. */
function asPly({ positions, indices }) {
  const [vertices, faces] = [positions.length / 3, indices.length / 3];
  const head = [
    ...['ply', 'format binary_little_endian 1.0', `element vertex ${vertices}`],
    ...['x', 'y', 'z'].map((axis) => `property float ${axis}`),
    ...[`element face ${faces}`, 'property list uchar int vertex_indices', 'end_header', ''],
  ].join('\n');
  const body = Buffer.alloc(12 * vertices + 13 * faces);
  for (const [i, value] of positions.entries()) body.writeFloatLE(value, 4 * i);
  for (let face = 0; face < faces; face++) {
    const start = 12 * vertices + 13 * face;
    body.writeUInt8(3, start);
    for (let k = 0; k < 3; k++) body.writeInt32LE(indices[3 * face + k], start + 1 + 4 * k);
  }
  return Buffer.concat([Buffer.from(head), body]);
}

async function write(name, mesh) {
  await writeFile(at('www/public/data', name), asPly(mesh.arrays()));
  say(name, `${mesh.triangleCount} triangles`);
}

await script(async () => {
  await init();
  const bust = Mesh.parse(new Uint8Array(await readFile(process.argv[2])));
  const model = new MultiresolutionModel({ detail: bust, ellipsoids: ELLIPSOIDS, support: 'membrane' });
  await write('nefertiti.ply', bust);
  await write('nefertiti-base.ply', model.baseMesh);
});
