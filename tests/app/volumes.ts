/** Small volumes for the tests. */

const SIZE = 32;

/** Returns the intensities of a function of voxel coordinates on a grid of 32³, x fastest. */
function sampled(value: (x: number, y: number, z: number) => number): Uint8Array {
  const voxels = new Uint8Array(SIZE ** 3);
  for (let i = 0; i < voxels.length; i++) {
    const [x, y, z] = [i % SIZE, Math.floor(i / SIZE) % SIZE, Math.floor(i / SIZE ** 2)];
    voxels[i] = Math.max(0, Math.min(255, value(x, y, z)));
  }
  return voxels;
}

/** Returns a ball of radius 10 voxels around the centre: bright inside, with a soft edge; 128 at the radius. */
export function ball(): Uint8Array {
  return sampled((x, y, z) => 128 + 40 * (10 - Math.hypot(x - 15.5, y - 15.5, z - 15.5)));
}

/** Returns a ring: ring radius 9 voxels, tube radius 4; bright inside, 128 at its surface. */
export function ring(): Uint8Array {
  return sampled((x, y, z) => 128 + 40 * (4 - Math.hypot(Math.hypot(x - 15.5, y - 15.5) - 9, z - 15.5)));
}

/** Returns a MetaImage header for bytes in another file, a grid of 32³ if not said, with 1 mm voxels. */
export function metaImageHeader(dataFile: string, dims = [SIZE, SIZE, SIZE]): Uint8Array {
  const lines = [
    'ObjectType = Image',
    'NDims = 3',
    `DimSize = ${dims.join(' ')}`,
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
