/** Runs the code that labs write of their runs, in a Node of its own. */
import { mkdir, mkdtemp, readFile, rm, symlink, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, expect } from 'vitest';
import { at, must } from '../../scripts/shell.mjs';
import type { NamedBytes, RunCode } from '../../www/src/engine/protocol';

/** Returns a folder of programs, in which the package is installed, until the end of the test file. */
export async function programsIn(name: string) {
  const folder = await mkdtemp(join(tmpdir(), `run-code-${name}-`));
  afterAll(() => rm(folder, { recursive: true }));
  await mkdir(join(folder, 'node_modules'));
  await symlink(at('pkg'), join(folder, 'node_modules/vesicle'));
  await symlink(at('node_modules/@zarrita'), join(folder, 'node_modules/@zarrita'));
  const programs = new Map<number, RunCode>();
  return {
    folder,
    add: async (seed: number, program: RunCode) => {
      programs.set(seed, program);
      await writeFile(join(folder, `${seed}.mjs`), program.code);
    },
    /**
     * Runs all programs, and expects these surfaces of them, or the same of what `partOf` returns of both. `given` are the
     * files, or what else they are given.
     */
    expectSame: async (
      surfaces: Uint8Array[],
      given: (NamedBytes | string)[],
      partOf: (surface: Uint8Array) => Uint8Array = (surface) => surface,
    ) => {
      for (const one of given) if (typeof one !== 'string') await writeFile(join(folder, one.name), one.bytes);
      const read = given.map((one) =>
        typeof one === 'string' ? JSON.stringify(one) : `new Uint8Array(await readFile(${JSON.stringify(one.name)}))`,
      );
      const seeds = [...programs.keys()];
      const all = `import { readFile, writeFile } from 'node:fs/promises';
        for (const seed of ${JSON.stringify(seeds)}) {
          const { run } = await import('./' + seed + '.mjs');
          await writeFile(seed + '.ply', await run(${read.join(', ')}));
        }`;
      await writeFile(join(folder, 'all.mjs'), all);
      await must(process.execPath, ['all.mjs'], { cwd: folder });
      for (const [index, seed] of seeds.entries()) {
        const again = await readFile(join(folder, `${seed}.ply`));
        expect(Buffer.compare(partOf(again), partOf(surfaces[index] ?? new Uint8Array())), `seed ${seed}`).toBe(0);
      }
      expect(seeds.length).toBe(surfaces.length);
      programs.clear();
    },
  };
}

/** Returns one element of a list. */
export const pickFrom = (random: () => number) => {
  return <T>(list: readonly T[]): T => list[Math.floor(random() * list.length)] as T;
};
