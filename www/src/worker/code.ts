/** Writes the log of a run as JavaScript that repeats the run to the same bits with the package alone. */
import type { ParamValues, Setup } from '../protocol';
import { text } from '../texts';
import { literal } from './literal';
import { startOf } from './models';
import { Refusal } from './refusal';
import type { RunLog } from './run-log';

/** Names, version and defaults that the code of a run depends on besides its log. */
export interface CodeContext {
  /** Name of the file that the volume is read from and, if that is a header, of the file with its voxels. */
  files: readonly string[];
  /** Index of the frame of these files that the run is of; undefined if they have one frame only. */
  frame?: number | undefined;
  /** Version of the library that made the run. */
  version: string;
  /** Default parameters of the method, which the code omits. */
  defaults: ParamValues;
}

/**
 * Returns the code of an ES module for Node and browsers, which exports a function that repeats a run of the deformable
 * model.
 */
export function toCode({ setup, calls }: RunLog<Setup>, { files, frame, version, defaults }: CodeContext): string {
  const { levels, edge, attractors, params } = setup;
  const chosen = Object.entries(params).filter(([name, value]) => !Object.is(defaults[name], value));
  const start = startOf(setup, Number(params.iso));
  const options = { start, levels, ...(edge !== undefined && { edge }), params: Object.fromEntries(chosen) };
  const [given, read] = files.length > 1 ? ['bytes, data', 'bytes, { data }'] : ['bytes', 'bytes'];
  const names = files.map(literal).join(' and ');
  const lines = [
    'await init();',
    `const model = new DeformableModel({ volume: Volume.parse(${read})${frame === undefined ? '' : `.frame(${frame})`}, ${literal(options).slice(2)});`,
    ...(attractors.length > 0 ? [`model.setAttractors(${literal(attractors)});`] : []),
    ...calls.map(lineOf),
    `return model.mesh.toBytes('ply');`,
  ];
  return [
    `// A run of Vesicle ${version}, to be repeated with the same version of the package for the same bits.`,
    `import init, { DeformableModel, Volume } from 'vesicle';`,
    '',
    `/** Returns the surface as a PLY file, given the bytes of ${names.replaceAll('*/', '* /')} as Uint8Array. */`,
    `export async function run(${given}) {`,
    ...lines.map((line) => `  ${line}`),
    '}',
    '',
  ].join('\n');
}

/** Methods in code. A log may come from a file of anyone, who must not choose what the user runs. */
const METHODS = ['step', 'setParams', 'setAttractors', 'seed'];

function lineOf({ call, given }: RunLog<Setup>['calls'][number]): string {
  if (!METHODS.includes(call)) throw new Refusal('bad-file', text('sessions.unknownCall', { call }));
  return `model.${call}(${given === undefined ? '' : literal(given)});`;
}
