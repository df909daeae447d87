/** Writes volumes as NRRD, which the library's entry points with one method do not. */
import type { Volume } from 'vesicle';

const SPACES = { RAS: 'right-anterior-superior', LPS: 'left-posterior-superior' };

/** Returns the intensities of a volume's first frame as NRRD, in single precision, with a geometry in double precision. */
export function toNrrd(volume: Volume): Uint8Array {
  const { dims, affine, space } = volume;
  const column = (index: number) => `(${affine.slice(4 * index, 4 * index + 3).join(',')})`;
  const head = [
    'NRRD0004',
    'type: float',
    'dimension: 3',
    `space: ${SPACES[space]}`,
    `sizes: ${dims.join(' ')}`,
    `space directions: ${[0, 1, 2].map(column).join(' ')}`,
    'kinds: domain domain domain',
    'endian: little',
    'encoding: raw',
    `space origin: ${column(3)}`,
    '',
    '',
  ];
  const header = new TextEncoder().encode(head.join('\n'));
  const size = dims[0] * dims[1];
  const bytes = new Uint8Array(header.length + 4 * size * dims[2]);
  bytes.set(header);
  const view = new DataView(bytes.buffer, header.length);
  for (let z = 0; z < dims[2]; z++)
    for (const [i, value] of volume.slice(2, z).entries()) view.setFloat32(4 * (z * size + i), value, true);
  return bytes;
}
