// Stand-in for your own reader: reads the first frame of a gzipped, little-endian NIfTI-1 file of 8- or 16-bit integers
// that has an affine matrix (sform).

export interface Scan {
  voxels: Uint8Array | Int16Array;
  size: number[];
  spacing: number[];
  /** Unit direction vectors of the grid's x, y and z axes in world space, LPS. */
  directions: number[][];
  /** Centre of the first voxel in world space, LPS. */
  origin: number[];
}

export async function loadScan(address: string): Promise<Scan> {
  const { body } = await fetch(address);
  if (!body) throw new Error(`${address} is empty`);
  const file = await new Response(body.pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
  const header = new DataView(file);
  const size = [42, 44, 46].map((at) => header.getInt16(at, true));
  // Rows of the matrix, with x and y negated: the file is RAS.
  const row = (k: number) => [0, 4, 8, 12].map((at) => (k < 2 ? -1 : 1) * header.getFloat32(280 + 16 * k + at, true));
  const matrix = [row(0), row(1), row(2)];
  const column = (k: number) => matrix.map((values) => values[k] ?? 0);
  const spacing = [0, 1, 2].map((k) => Math.hypot(...column(k)));
  const directions = spacing.map((length, k) => column(k).map((value) => value / length));
  const count = size.reduce((product, n) => product * n, 1);
  const start = header.getFloat32(108, true);
  const voxels =
    header.getInt16(70, true) === 4 ? new Int16Array(file, start, count) : new Uint8Array(file, start, count);
  return { voxels, size, spacing, directions, origin: column(3) };
}
