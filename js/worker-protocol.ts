// Messages between the page and the worker, and tables of the members that may be accessed. Nothing outside these
// tables is ever called.
import type { Channel } from './channel.js';
import { VesicleError } from './error.js';
import type { ImplicitInSlices, MeshInSlices, VolumeInSlices } from './index.js';
import type { SliceOptions, StepReport } from './stepper.js';
import type { ClassName, FunctionName, Library } from './worker-types.js';

/** A reference in a message to an object in the worker, or to one of its live meshes. */
export interface Reference {
  /** Id of the object: above 0 if assigned by the page, below 0 if assigned by the worker. */
  readonly vesicle: number;
  readonly class: ClassName;
  /** In a reference to a live mesh, the name of the model's property that holds it. */
  readonly part?: string;
}

/**
 * Call of the method or property `name` of an object or class, or of a free function if `on` is undefined. With
 * `slices`, the options, `name` is one of the operations of `inSlices`.
 */
export interface Call {
  on: Reference | ClassName | undefined;
  name: string;
  args: unknown[];
  slices?: SliceOptions;
}

/** Requests of the page to the worker. */
export interface Requests {
  init: { body: BufferSource | WebAssembly.Module | string | undefined; reply: undefined };
  make: { body: { as: Reference; args: unknown[] }; reply: undefined };
  call: { body: Call; reply: unknown; report: Report };
}

/** Message to free an object, by its id. */
export interface Free {
  free: number;
}

/** The page's connection to the worker. */
export type Connection = Channel<Requests, never, Free>;

/** Content of a report: the state after a step of a run, or the fraction done, 0..1, of a coverage measurement. */
export type Report = StepReport | number;

/**
 * Methods that the page can abort, whose last argument is their options, with the name of the listener option that receives
 * their reports; empty if they have none.
 */
export const ABORTABLE = { run: 'onStep', coverage: 'onProgress', create: '', propose: '' } as const;

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

/**
 * Kind of each member of an object in the worker that the page may access, by class: method, value or live mesh.
 * Compilation fails if a name is missing or superfluous.
 */
export const MEMBERS: { readonly [N in ClassName]: Members<Library[N]['prototype']> } = {
  Volume: {
    dims: 'value',
    frames: 'value',
    frameSeconds: 'value',
    spacing: 'value',
    affine: 'value',
    space: 'value',
    unit: 'value',
    range: 'value',
    warnings: 'value',
    toNifti: 'method',
    toBytes: 'method',
    histogram: 'method',
    sample: 'method',
    slice: 'method',
    intensities: 'method',
    pyramid: 'method',
    binned: 'method',
    enrichSlices: 'method',
    inSlices: 'method',
    labels: 'method',
    label: 'method',
    threshold: 'method',
    dice: 'method',
    crop: 'method',
    resample: 'method',
    frame: 'method',
    write: 'method',
  },
  Mesh: {
    vertexCount: 'value',
    triangleCount: 'value',
    topologyVersion: 'value',
    geometryVersion: 'value',
    texture: 'value',
    origin: 'value',
    space: 'value',
    unit: 'value',
    warnings: 'value',
    arrays: 'method',
    copyTo: 'method',
    snapshot: 'method',
    info: 'method',
    check: 'method',
    splitAtSeams: 'method',
    components: 'method',
    refine: 'method',
    restructure: 'method',
    decimate: 'method',
    decimateWithin: 'method',
    remesh: 'method',
    smooth: 'method',
    transform: 'method',
    cut: 'method',
    keepComponents: 'method',
    removeCavities: 'method',
    contains: 'method',
    toVolume: 'method',
    curvature: 'method',
    geodesic: 'method',
    distanceTo: 'method',
    pick: 'method',
    crossSection: 'method',
    toBytes: 'method',
    clone: 'method',
    inSlices: 'method',
  },
  DeformableModel: {
    ...STEPPER,
    level: 'value',
    delta: 'value',
    setAttractors: 'method',
    seed: 'method',
    refresh: 'method',
    coverage: 'method',
    speeds: 'method',
  },
  ImplicitSurface: {
    ...STEPPER,
    cell: 'value',
    spacing: 'value',
    duplicates: 'value',
    outliers: 'value',
    choice: 'value',
    spuriousComponents: 'value',
    warning: 'value',
    edits: 'value',
    setEdits: 'method',
    evaluate: 'method',
    gradient: 'method',
    constraints: 'method',
    fitness: 'method',
    preview: 'method',
    toVolume: 'method',
    inSlices: 'method',
    colorize: 'method',
  },
  SurfaceTracker: {
    ...STEPPER,
    frame: 'value',
    frames: 'value',
    origin: 'value',
    noise: 'value',
    cycleClosureError: 'value',
    statistics: 'value',
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
    targets: 'value',
    bandCount: 'value',
    folded: 'value',
    unmatchedVertices: 'value',
    heldVertices: 'value',
    setEllipsoids: 'method',
    distortion: 'method',
    levelMeshes: 'method',
  },
  LabelSurfaces: {
    ...STEPPER,
    mesh: 'method',
    labels: 'value',
    refresh: 'method',
  },
};

/** Operations of `inSlices` that the page may call in the worker, by class. */
export const SLICED: {
  Mesh: Names<keyof MeshInSlices>;
  Volume: Names<keyof VolumeInSlices>;
  ImplicitSurface: Names<keyof ImplicitInSlices>;
} = {
  Mesh: {
    remesh: 'method',
    restructure: 'method',
    decimate: 'method',
    decimateWithin: 'method',
    smooth: 'method',
    cut: 'method',
    removeCavities: 'method',
    contains: 'method',
    toVolume: 'method',
    check: 'method',
    distanceTo: 'method',
  },
  Volume: { enrichSlices: 'method' },
  ImplicitSurface: { toVolume: 'method', colorize: 'method' },
};

/** Static methods that the page may call in the worker, by class. */
export const STATICS: { readonly [N in ClassName]: Names<Exclude<keyof Library[N], 'prototype'>> } = {
  Volume: { parse: 'method', fromFrames: 'method' },
  Mesh: { icosphere: 'method', fromArrays: 'method', parse: 'method', marchingCubes: 'method' },
  DeformableModel: { maxLevels: 'method', create: 'method' },
  ImplicitSurface: {},
  SurfaceTracker: { propose: 'method', create: 'method' },
  MultiresolutionModel: { create: 'method' },
  LabelSurfaces: { create: 'method' },
};

/** Free functions that the page may call in the worker. */
export const FUNCTIONS: Names<FunctionName> = {
  version: 'method',
  paramSpecs: 'method',
  parsePoints: 'method',
  animationGlb: 'method',
};

/**
 * Returns the entry `name` of a table of the members that the page may access. Throws `invalid-argument` if the table
 * has no own entry of that name.
 */
export function lookUp<T>(table: Readonly<Record<string, T>>, name: string): T {
  const found = Object.hasOwn(table, name) ? table[name] : undefined;
  if (found !== undefined) return found;
  throw new VesicleError('invalid-argument', `${name}: no such member`);
}

/** Whether a value is a reference to an object in the worker. */
export function isReference(value: object): value is Reference {
  return Object.hasOwn(value, 'vesicle') && Object.hasOwn(value, 'class');
}

/** Whether an object is plain: an instance of no class. */
export function isPlain(value: object): boolean {
  const prototype: unknown = Object.getPrototypeOf(value);
  // Objects of other windows have another Object.prototype, but it, too, has no prototype.
  return prototype === null || Object.getPrototypeOf(prototype) === null;
}

/**
 * Greatest depth of nested objects in a message. Arguments and results of the library are shallower; cyclic values
 * exceed it.
 */
const MAX_DEPTH = 8;

/**
 * Copies nested arrays and objects with replacements: `swap` returns the replacement of an object or function, or
 * undefined to descend into it. `path` is the location of the value, for error messages.
 */
export function mapObjects(
  path: string,
  value: unknown,
  swap: (path: string, value: object) => unknown,
  depth = 0,
): unknown {
  if ((typeof value !== 'object' && typeof value !== 'function') || value === null) return value;
  const other = swap(path, value);
  if (other !== undefined) return other;
  if (depth === MAX_DEPTH) throw new VesicleError('invalid-argument', `${path}: objects are nested too deeply`);
  const inside = (at: string, entry: unknown) => mapObjects(at, entry, swap, depth + 1);
  if (Array.isArray(value))
    return value.map((entry, index) => (isSimple(entry) ? entry : inside(`${path}[${index}]`, entry)));
  const named = (name: string) => (depth === 0 ? name : `${path}.${name}`);
  // Creates own properties whatever their names, `__proto__` included.
  return Object.fromEntries(Object.entries(value).map(([name, entry]) => [name, inside(named(name), entry)]));
}

const isSimple = (value: unknown): boolean => typeof value === 'number' || typeof value === 'string';
