// What the page and the worker say to each other, and the names that may be asked for. Nothing else is ever called.
import { VesicleError } from './error.js';
import type { ErrorCode } from './index.js';
import type { StepReport } from './stepper.js';
import type { ClassName, FunctionName, Library } from './worker-types.js';

/** Stands for an object that is in the worker, or for a live mesh of one. */
export interface Reference {
  /** Above 0 where the page chose it, below where the worker did. */
  readonly vesicle: number;
  readonly class: ClassName;
  /** The property of the object that is meant. */
  readonly part?: string;
}

/** A thing to do that has an answer, without its number. */
export type Task =
  | { type: 'init'; module: BufferSource | WebAssembly.Module | string | undefined }
  | { type: 'make'; as: Reference; args: unknown[] }
  /** Of an object, of a class, or one of the functions. */
  | { type: 'call'; on: Reference | ClassName | undefined; name: string; args: unknown[]; reports?: boolean };

/** From the page. */
export type Request = (Task & { id: number }) | { type: 'abort'; id: number } | { type: 'free'; object: number };

/** From the worker: an answer, or one report of a task that goes on. */
export type Reply =
  | { type: 'value'; id: number; value: unknown }
  | { type: 'error'; id: number; failure: Failure }
  | { type: 'report'; id: number; report: Report };

/** What a task tells while it goes on: the report of a step, or the share done. */
export type Report = StepReport | number;

/** Methods that can be aborted from the page, and the option of each that is called with reports. */
export const ABORTABLE = { run: 'onStep', coverage: 'onProgress' } as const;

/** An error, so that it can be made again on the other side. */
export type Failure =
  | { kind: 'error'; code: ErrorCode; message: string }
  | { kind: 'crash'; message: string; cause: Error | undefined }
  | { kind: 'aborted' }
  /** Of other names than JavaScript's own errors, copies of the error have lost theirs. */
  | { kind: 'other'; name: string; error: Error };

type Kind<T> = T extends (...args: never) => unknown
  ? 'method'
  : T extends Library['Mesh']['prototype']
    ? 'live'
    : 'value';
type Members<T> = { readonly [K in keyof T as K extends string ? Exclude<K, 'free'> : never]: Kind<T[K]> };
type Names<T extends PropertyKey> = { readonly [K in T]: 'method' };

const STEPPER = {
  mesh: 'live',
  params: 'value',
  step: 'method',
  run: 'method',
  setParams: 'method',
  save: 'method',
  restore: 'method',
} as const;

/** What may be asked of the objects of each class. Does not compile where a name is missing, or is one too many. */
export const MEMBERS: { readonly [N in ClassName]: Members<Library[N]['prototype']> } = {
  Volume: {
    dims: 'value',
    frames: 'value',
    frameSeconds: 'value',
    spacing: 'value',
    affine: 'value',
    space: 'value',
    range: 'value',
    toNifti: 'method',
    histogram: 'method',
    sample: 'method',
    slice: 'method',
    intensities: 'method',
    pyramid: 'method',
    binned: 'method',
    enrichSlices: 'method',
  },
  Mesh: {
    vertexCount: 'value',
    triangleCount: 'value',
    topologyVersion: 'value',
    geometryVersion: 'value',
    texture: 'value',
    arrays: 'method',
    copyTo: 'method',
    info: 'method',
    check: 'method',
    splitAtSeams: 'method',
    components: 'method',
    refine: 'method',
    restructure: 'method',
    decimate: 'method',
    remesh: 'method',
    curvature: 'method',
    geodesic: 'method',
    distanceTo: 'method',
    pick: 'method',
    crossSection: 'method',
    toBytes: 'method',
    clone: 'method',
  },
  DeformableModel: {
    ...STEPPER,
    level: 'value',
    delta: 'value',
    setAttractors: 'method',
    seed: 'method',
    coverage: 'method',
    speeds: 'method',
  },
  ImplicitSurface: {
    ...STEPPER,
    cell: 'value',
    spacing: 'value',
    duplicates: 'value',
    strays: 'value',
    warning: 'value',
    edits: 'value',
    setEdits: 'method',
    evaluate: 'method',
    gradient: 'method',
    constraints: 'method',
    fitness: 'method',
    preview: 'method',
    toVolume: 'method',
    colorize: 'method',
  },
  SurfaceTracker: {
    ...STEPPER,
    frame: 'value',
    frames: 'value',
    noise: 'value',
    closing: 'value',
    facts: 'value',
    boundary: 'method',
    meshAt: 'method',
    volumes: 'method',
    toGlb: 'method',
  },
  MultiresolutionModel: {
    ...STEPPER,
    baseMesh: 'live',
    linkMesh: 'live',
    ellipsoids: 'value',
    goals: 'value',
    bands: 'value',
    folded: 'value',
    missed: 'value',
    held: 'value',
    setEllipsoids: 'method',
    distortion: 'method',
    levelMeshes: 'method',
  },
};

/** What may be asked of each class itself. */
export const STATICS: { readonly [N in ClassName]: Names<Exclude<keyof Library[N], 'prototype'>> } = {
  Volume: { parse: 'method', fromFrames: 'method' },
  Mesh: { icosphere: 'method', fromArrays: 'method', parse: 'method', marchingCubes: 'method' },
  DeformableModel: {},
  ImplicitSurface: {},
  SurfaceTracker: {},
  MultiresolutionModel: {},
};

/** Functions of no class. */
export const FUNCTIONS: Names<FunctionName> = {
  version: 'method',
  paramSpecs: 'method',
  parsePoints: 'method',
  animationGlb: 'method',
};

/** What a table says of a name. Throws where it is not in the table itself. */
export function lookUp<T>(table: Readonly<Record<string, T>>, name: string): T {
  const found = Object.hasOwn(table, name) ? table[name] : undefined;
  if (found !== undefined) return found;
  throw new VesicleError('invalid-argument', `${name}: there is no such thing in the worker`);
}

/** True for what stands for an object in the worker. */
export function isReference(value: object): value is Reference {
  return Object.hasOwn(value, 'vesicle') && Object.hasOwn(value, 'class');
}

/** True for objects without a class. */
export function isPlain(value: object): boolean {
  const prototype: unknown = Object.getPrototypeOf(value);
  // Objects of other windows have another Object.prototype, but nothing above it.
  return prototype === null || Object.getPrototypeOf(prototype) === null;
}

/** No argument or result of the library has so many objects in each other; what refers to itself has. */
const DEEPEST = 8;

/**
 * A copy with other things in place of some: `swap` gives the thing for an object or a function, or nothing where it has
 * to be looked into. `path` tells it where it is.
 */
export function swapped(
  path: string,
  value: unknown,
  swap: (path: string, value: object) => unknown,
  depth = 0,
): unknown {
  if ((typeof value !== 'object' && typeof value !== 'function') || value === null) return value;
  const other = swap(path, value);
  if (other !== undefined) return other;
  if (depth === DEEPEST) throw new VesicleError('invalid-argument', `${path}: too many objects inside each other`);
  const inside = (at: string, entry: unknown) => swapped(at, entry, swap, depth + 1);
  if (Array.isArray(value))
    return value.map((entry, index) => (isSimple(entry) ? entry : inside(`${path}[${index}]`, entry)));
  const named = (name: string) => (depth === 0 ? name : `${path}.${name}`);
  // As own properties, whatever their names.
  return Object.fromEntries(Object.entries(value).map(([name, entry]) => [name, inside(named(name), entry)]));
}

const isSimple = (value: unknown): boolean => typeof value === 'number' || typeof value === 'string';
