/** Writes the log of a run as JavaScript that repeats the run to the same bits with the package alone. */
import { paramSpecs, type Volume, version } from 'vesicle';
import { VesicleError } from 'vesicle/channel';
import { text } from '../texts';
import { callOf } from './edits';
import { literal } from './literal';
import type { CodeRequest, NamedBytes, ParamValues, RunCode } from './protocol';
import type { Call, RunLog } from './run-log';

/** Code of a run, as far as it differs between the labs. */
export interface Program {
  /** Names that the code imports from the package. */
  names: string[];
  /** Lines that import from other modules. */
  imports?: string[];
  /** Parameters of the code's function. */
  parameters?: string[];
  /** Says what these are. */
  given?: string;
  /** Names of the files or the folder that the function is given; none by default. */
  files?: readonly string[];
  needs?: RunCode['needs'];
  /** Statements that make `model`. */
  begin: string[];
  /** Statements for the calls that a log may have. A log may come from a file of anyone, who must not choose what the user runs. */
  calls: Record<string, (given: never) => string>;
  /** The surface of the model. */
  mesh?: string;
  /** Part of the run that the code lacks, in a sentence. */
  note?: string | undefined;
  /** Facts that a reader of the code may want to know, in a sentence. */
  remark?: string | undefined;
}

/** Returns statements for calls of methods that take the logged value as it is. */
export function callsOf(...methods: string[]): Program['calls'] {
  const statement = (method: string) => (given: unknown) =>
    `model.${method}(${given === undefined ? '' : literal(given)});`;
  return Object.fromEntries(methods.map((method) => [method, statement(method)]));
}

/** Returns the parameters that differ from the defaults of the method, which the code omits. */
export function chosen(method: Parameters<typeof paramSpecs>[0], params: ParamValues): ParamValues {
  const defaults = new Map<string, unknown>(paramSpecs(method).map((spec) => [spec.name, spec.default]));
  return Object.fromEntries(
    Object.entries(params).filter(([name, value]) => value !== undefined && !Object.is(defaults.get(name), value)),
  );
}

/** Returns the part of a program that takes the bytes of files. */
export function bytesOf(files: readonly string[], parameters: string[], needs: RunCode['needs'] = 'files') {
  return { needs, files, parameters, given: `the bytes of ${files.map(literal).join(' and ')} as Uint8Array` };
}

/** Files of volumes that the package reads by itself. */
const VOLUME_FILES = /\.(nii|nii\.gz|nrrd|nhdr|mha|mhd)$/i;

/**
 * Returns the part of a program that reads a volume, and the expression of that volume: from the files that were opened
 * if the package reads them, else from one that the lab saves, with the geometry of `saved` where that file rounds it.
 */
export function volumeOf(files: readonly Pick<NamedBytes, 'name' | 'notes'>[], saved: Volume, stem: string) {
  const names = files.map(({ name }) => name);
  // The user has no files that the app has written of others.
  const own = files.filter(({ name, notes }) => VOLUME_FILES.test(name) && !notes);
  const heads = own.map(({ name }) => name);
  // A header before its voxels.
  const all = [...heads, ...names.filter((name) => !heads.includes(name))];
  if (heads.length === 1 && all.length === 2)
    return { ...bytesOf(all, ['bytes', 'data']), volume: 'Volume.parse(bytes, { data })' };
  if (heads.length === 1 && all.length === 1) return { ...bytesOf(all, ['bytes']), volume: 'Volume.parse(bytes)' };
  const read = bytesOf([`${stem}.nii`], ['bytes'], 'saved');
  const { affine, space } = saved;
  if (space === 'RAS' && affine.every((x) => Math.fround(x) === x)) return { ...read, volume: 'Volume.parse(bytes)' };
  const imports = [`import startReaders, { parseVolume } from 'vesicle/import';`];
  const geometry = literal({ affine: [...affine], space }).slice(2, -2);
  return { ...read, imports, volume: `new Volume({ ...parseVolume(bytes), ${geometry} })` };
}

/** Returns the code of an ES module for Node and browsers, which exports a function that repeats a run. */
export function toCode<Setup>(
  log: RunLog<Setup> | undefined,
  programOf: (setup: Setup) => Program,
  edits: CodeRequest['edits'],
): RunCode {
  if (!log) throw new VesicleError('invalid-argument', text('sessions.unknownBeginning'));
  const { names, imports = [], parameters = [], given, mesh = 'model.mesh', ...program } = programOf(log.setup);
  const bytes = `${mesh}.toBytes('ply')`;
  const statements = [
    'await init();',
    ...(imports.some((line) => line.includes('startReaders')) ? ['await startReaders();'] : []),
    ...program.begin,
    ...log.calls.map((call) => statementOf(program, call)),
    ...(edits.length > 0 ? [`const mesh = Mesh.parse(${bytes});`] : []),
    ...edits.map((edit) => `mesh.${callOf(edit)};`),
    `return ${edits.length > 0 ? `mesh.toBytes('ply')` : bytes};`,
  ];
  const imported = [...new Set([...names, ...(edits.length > 0 ? ['Mesh'] : [])])].sort().join(', ');
  const code = [
    `// A run of Vesicle ${version()}, to be repeated with the same version of the package for the same bits.`,
    ...[program.note, program.remark].filter(Boolean).map((line) => `// ${line}`),
    `import init, { ${imported} } from 'vesicle';`,
    ...imports,
    '',
    `/** Returns the surface as a PLY file${given ? `, given ${given.replaceAll('*/', '* /')}` : ''}. */`,
    `export async function run(${parameters.join(', ')}) {`,
    ...statements.map((line) => `  ${line}`),
    '}',
    '',
  ].join('\n');
  const { needs = 'nothing', files = [], note } = program;
  return { code, needs, name: files.join(' + '), note };
}

function statementOf({ calls }: Pick<Program, 'calls'>, { call, given }: Call): string {
  const statement = Object.hasOwn(calls, call) && calls[call];
  if (!statement) throw new VesicleError('bad-file', text('sessions.unknownCall', { call }));
  return statement(given as never);
}
