// The Menger sponge of depth two, as hashes of the bits of its positions: after 200 steps of the paper's model, and at
// the end of a run at the default settings. The function is self-contained, so that it can be sent to a browser, and
// awaits the results, so that it also runs with the package in a worker.
import type * as Package from '../../pkg/index.js';
import type * as Worker from '../../pkg/worker.js';

/** FNV-1a hashes over all positions that the core gives natively. */
export const SPONGE_BITS = '983ab96c7e195cd7 62e5c83dba6c564f';

export async function spongeBits(library: typeof Package | typeof Worker): Promise<string> {
  const { Volume, DeformableModel } = library as typeof Worker;
  const middle = (n: number, cell: number) => Math.floor(n / cell) % 3 === 1;
  const isSolid = (p: number[]) => [27, 9].every((cell) => p.filter((n) => middle(n, cell)).length < 2);
  const data = Uint8Array.from({ length: 81 ** 3 }, (_, i) =>
    isSolid([i % 81, Math.floor(i / 81) % 81, Math.floor(i / 6561)]) ? 1 : 0,
  );
  const volume = new Volume({ data, dims: [81, 81, 81] });
  const bitsOf = async (model: InstanceType<typeof DeformableModel>) => {
    const { positions } = await model.mesh.arrays();
    let hash = 0xcbf29ce484222325n;
    for (const byte of new Uint8Array(positions.buffer, positions.byteOffset, positions.byteLength)) {
      hash = ((hash ^ BigInt(byte)) * 0x100000001b3n) & 0xffffffffffffffffn;
    }
    return hash.toString(16).padStart(16, '0');
  };
  const params = { iso: 0.4, rigidity: 0.05, stiffness: 0.001, adaptivity: 0, integrator: 'euler' } as const;
  const paper = new DeformableModel({ volume, start: 'enclosing', levels: 3, params });
  await paper.step(200);
  const bits = await bitsOf(paper);
  const model = new DeformableModel({ volume, levels: 2, params: { iso: 0.4 } });
  while (!(await model.step(10)).done);
  return `${bits} ${await bitsOf(model)}`;
}
