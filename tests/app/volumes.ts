/** Small volumes made for the tests. */

const SIZE = 32;

/** Intensities of a function of voxel coordinates on a grid of 32³, x fastest. */
function sampled(value: (x: number, y: number, z: number) => number): Uint8Array {
  const voxels = new Uint8Array(SIZE ** 3);
  for (let i = 0; i < voxels.length; i++) {
    const [x, y, z] = [i % SIZE, Math.floor(i / SIZE) % SIZE, Math.floor(i / SIZE ** 2)];
    voxels[i] = Math.max(0, Math.min(255, value(x, y, z)));
  }
  return voxels;
}

/** Bright inside a ball of radius 10 voxels around the middle, with a soft edge; 128 at the radius. */
export function ball(): Uint8Array {
  return sampled((x, y, z) => 128 + 40 * (10 - Math.hypot(x - 15.5, y - 15.5, z - 15.5)));
}

/** Bright inside a ring: radius 9 voxels, thickness 4 to each side; 128 at its surface. */
export function ring(): Uint8Array {
  return sampled((x, y, z) => 128 + 40 * (4 - Math.hypot(Math.hypot(x - 15.5, y - 15.5) - 9, z - 15.5)));
}

/** A MetaImage header for a grid of 32³ bytes with 1 mm voxels whose data lie in another file. */
export function metaImageHeader(dataFile: string): Uint8Array {
  const lines = [
    'ObjectType = Image',
    'NDims = 3',
    `DimSize = ${SIZE} ${SIZE} ${SIZE}`,
    'ElementSpacing = 1 1 1',
    'Offset = 0 0 0',
    'TransformMatrix = 1 0 0 0 1 0 0 0 1',
    'BinaryData = True',
    'BinaryDataByteOrderMSB = False',
    'ElementType = MET_UCHAR',
    `ElementDataFile = ${dataFile}`,
  ];
  return new TextEncoder().encode(`${lines.join('\n')}\n`);
}
