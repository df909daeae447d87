// Scripts in processes of their own.
import { execFileSync } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { spongeBits } from './sponge.js';

/** The project's folder. */
export const root = fileURLToPath(new URL('../..', import.meta.url));

/** Runs a script in a separate Node process, in a folder of the project, and returns what it prints. */
export function node(script: string, cwd = root): string {
  const args = ['--input-type=module', '--eval', script];
  return execFileSync(process.execPath, args, { cwd, encoding: 'utf8', timeout: 120_000 }).trim();
}

/** Returns a script that prints the bits of a surface, made by the package at an address. */
export const bits = (address: string, options = '') => `
  const vesicle = await import('${address}');
  await vesicle.default(${options});
  console.log(await (${spongeBits})(vesicle));`;
