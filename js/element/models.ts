// Creates a model of each method from the attributes of the element.
import { invalid } from '../check.js';
import { VesicleError } from '../error.js';
import {
  type ControlEllipsoid,
  DeformableModel,
  ImplicitSurface,
  Mesh,
  MultiresolutionModel,
  parsePoints,
  type Stepper,
  SurfaceTracker,
  type Vec3,
  Volume,
} from '../worker.js';

/** Named initial surfaces of the deformable model that the attribute `start` accepts. */
const STARTS = ['contour', 'enclosing'] as const;
type StartName = (typeof STARTS)[number];

/** The parsed attributes of a `<vesicle-lab>`, and the bytes of its file. */
export interface Settings {
  bytes: Uint8Array;
  start: StartName;
  levels: number;
  params: Record<string, unknown>;
  cavity: string;
  ellipsoids: ControlEllipsoid[];
}

/** A model, and the direction `from` the model to the initial position of the camera. */
export interface ModelWithView {
  model: Stepper;
  from: Vec3;
}

/** Direction from man-made objects, which usually face −y, to the initial position of the camera in front of them. */
const FRONT: Vec3 = [-0.5, -1, 0.35];

/**
 * Functions that create the model of each method from the settings of a `<vesicle-lab>`; they free the volume or mesh
 * once the model is made of it.
 */
export const MODELS = {
  deformable: ({ bytes, start, levels, params }: Settings): Promise<ModelWithView> =>
    ofVolume(bytes, (volume) => DeformableModel.create({ volume, start, levels, params })),
  implicit: async ({ bytes, params }: Settings): Promise<ModelWithView> => {
    const { points, normals } = await parsePoints(bytes);
    return { model: await ImplicitSurface.create({ points, ...(normals && { normals }), params }), from: FRONT };
  },
  // The tracker checks `cavity`.
  tracking: ({ bytes, params, cavity }: Settings): Promise<ModelWithView> =>
    ofVolume(bytes, (volume) => SurfaceTracker.create({ volume, params, cavity: cavity as 'open' })),
  multires: async ({ bytes, ellipsoids, params }: Settings): Promise<ModelWithView> => {
    // Ellipsoids that do not move show something with a membrane alone.
    const support = ellipsoids.length > 0 ? 'membrane' : 'surface';
    const make = (detail: Mesh) => MultiresolutionModel.create({ detail, ellipsoids, support, params });
    return { model: await withResource(await Mesh.parse(bytes), make), from: FRONT };
  },
};

/** Creates a model from a volume file, viewed with the camera in front of a patient, a little to their left. */
function ofVolume(bytes: Uint8Array, make: (volume: Volume) => Promise<Stepper>): Promise<ModelWithView> {
  const made = async (volume: Volume): Promise<ModelWithView> => {
    const [model, space] = await Promise.all([make(volume), volume.space]);
    return { model, from: space === 'RAS' ? [-0.6, 1, 0.35] : [0.6, -1, 0.35] };
  };
  return Volume.parse(bytes).then((volume) => withResource(volume, made));
}

async function withResource<T extends { free(): void }, Made>(
  thing: T,
  make: (thing: T) => Promise<Made>,
): Promise<Made> {
  try {
    return await make(thing);
  } finally {
    thing.free();
  }
}

/** Downloads the file at an address; throws `bad-file` for an HTTP error. */
export async function fetched(address: string): Promise<Uint8Array> {
  const response = await fetch(address);
  if (!response.ok) throw new VesicleError('bad-file', `src: ${address}: ${response.status} ${response.statusText}`);
  return new Uint8Array(await response.arrayBuffer());
}

/**
 * Returns the initial surface that the attribute `start` names, `'contour'` if it is missing; throws `invalid-argument`
 * for other names.
 */
export function parseStart(name: string | null): StartName {
  const start = STARTS.find((one) => one === (name ?? 'contour'));
  if (!start) throw invalid('start', `'${name}'; accepted: ${STARTS.join(', ')}`);
  return start;
}

/**
 * Parses the attribute `name` as JSON; returns `otherwise` if it is empty or missing, and throws `invalid-argument` if
 * it is not JSON.
 */
export function json<T>(name: string, text: string | null, otherwise: T): T {
  if (text === null || text.trim() === '') return otherwise;
  try {
    return JSON.parse(text) as T;
  } catch {
    throw invalid(name, `'${text}' is not JSON, such as '{ "iso": 95 }'`);
  }
}
