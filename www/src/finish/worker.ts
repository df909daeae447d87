/** Worker that edits a surface after a run, and compares it with a reference. */
import init, { Mesh, Volume } from 'vesicle';
import { VesicleError, withTransfer } from 'vesicle/channel';
import { apply } from '../engine/edits';
import { withoutCompression } from '../engine/gltf';
import { relativeTo } from '../engine/placing';
import type { Edit, NamedBytes, SurfacePoint } from '../engine/protocol';
import { type Handlers, serveWhenReady } from '../engine/serving';
import { sectionOf, snapshotOf } from '../engine/surface';
import { readFiles } from '../engine/volumes';
import { text } from '../texts';
import { distancesBetween, gridAround } from './distances';
import type { Comparison, Edited, Requests } from './protocol';
import { checkSize } from './size';

/** Number of triangles in all surfaces that are kept for undo. */
const KEPT_TRIANGLES = 5_000_000;

/** The surfaces after each edit, as far as they are kept, from the oldest to the newest, those undone included. */
let states: { mesh: Mesh; log: Edit[] }[] = [];
/** Index of the surface shown. */
let present = 0;
/** The reference of comparisons: a mesh, or a label map, whose surface is compared. */
let reference: Mesh | Volume | undefined;

function current(): { mesh: Mesh; log: Edit[] } {
  const state = states[present];
  if (!state) throw new VesicleError('invalid-argument', text('finish.noSurface'));
  return state;
}

function edited(): Edited {
  const { mesh, log } = current();
  const components = mesh.components().map((part) => {
    const { vertices, volume, area } = part.info();
    part.free();
    return { vertices, volume, area };
  });
  const surface = snapshotOf(mesh);
  const measures = { info: mesh.info(), report: mesh.check() };
  const undone = states.at(-1)?.log.slice(log.length) ?? [];
  const rest = { undoable: present > 0, undone };
  return withTransfer({ surface, measures, components, log, ...rest }, arraysOf(surface));
}

const arraysOf = ({ positions, normals, indices }: Edited['surface']) => [positions, normals, indices];

function open(bytes: Uint8Array): Edited {
  const mesh = Mesh.parse(bytes);
  for (const state of states) state.mesh.free();
  states = [{ mesh, log: [] }];
  present = 0;
  return edited();
}

function edit({ edit: change, most }: Requests['edit']['body']): Edited {
  const { mesh, log } = current();
  if (most !== undefined) checkSize(mesh, change, most);
  const changed = mesh.clone();
  try {
    apply(changed, change);
  } catch (error) {
    changed.free();
    throw error;
  }
  for (const undone of states.splice(present + 1)) undone.mesh.free();
  states.push({ mesh: changed, log: [...log, change] });
  dropOldest();
  present = states.length - 1;
  return edited();
}

/** Frees the oldest surfaces beyond the limit, but the one before the last edit. */
function dropOldest(): void {
  let kept = states.reduce((sum, { mesh }) => sum + mesh.triangleCount, 0);
  while (kept > KEPT_TRIANGLES && states.length > 2) {
    const mesh = states.shift()?.mesh;
    kept -= mesh?.triangleCount ?? 0;
    mesh?.free();
  }
}

function travel(step: 1 | -1): Edited {
  present = Math.min(states.length - 1, Math.max(0, present + step));
  return edited();
}

/**
 * Returns the distances between two points on the surface. They are made vertices of a copy, each dividing its triangle
 * into three, so that paths begin and end in them.
 */
function measure([from, to]: [SurfacePoint, SurfacePoint]): { straight: number; geodesic: number } {
  const { mesh } = current();
  const { positions, indices } = mesh.arrays({ relative: true });
  const corners = [...indices];
  const first = positions.length / 3;
  const insert = (triangle: number, vertex: number) => {
    const [a = 0, b = 0, c = 0] = corners.slice(3 * triangle, 3 * triangle + 3);
    corners.splice(3 * triangle, 3, a, b, vertex);
    corners.push(b, c, vertex, c, a, vertex);
  };
  insert(from.triangle, first);
  // In the same triangle, the straight line is on the surface.
  if (from.triangle !== to.triangle) insert(to.triangle, first + 1);
  const points = Float32Array.from([...positions, ...relativeTo(mesh.origin, [...from.point, ...to.point])]);
  const straight = Math.hypot(...from.point.map((x, axis) => x - (to.point[axis] ?? 0)));
  if (from.triangle === to.triangle) return { straight, geodesic: straight };
  const refined = Mesh.fromArrays(points, Uint32Array.from(corners));
  try {
    return { straight, geodesic: refined.geodesic(first)[first + 1] ?? Number.POSITIVE_INFINITY };
  } finally {
    refined.free();
  }
}

async function readReference(files: NamedBytes[]): Promise<undefined> {
  const [file] = files;
  const isMesh = file && files.length === 1 && /\.(ply|stl|obj|glb)$/i.test(file.name);
  const read = isMesh ? Mesh.parse(await withoutCompression(file.bytes)) : new Volume(await readFiles(files));
  reference?.free();
  reference = read;
}

function compare({ label }: { label?: number }): Comparison {
  if (!reference) throw new VesicleError('invalid-argument', text('finish.noReference'));
  const { mesh } = current();
  if (reference instanceof Mesh) {
    const grid = reference.check().closed ? gridAround(mesh, reference) : undefined;
    try {
      return compareWith(reference, mesh, grid && reference.toVolume(grid), []);
    } finally {
      grid?.free();
    }
  }
  const labels = reference.labels().map(({ value }) => value);
  const mask = label === undefined ? reference.label(labels) : reference.label(label);
  const surface = Mesh.marchingCubes(mask, 0.5);
  try {
    return compareWith(surface, mesh, mask, labels);
  } finally {
    surface.free();
  }
}

/** Compares with a surface and, if it is given, the mask of its voxels, which is freed. */
function compareWith(surface: Mesh, mesh: Mesh, mask: Volume | undefined, labels: number[]): Comparison {
  let own: Volume | undefined;
  try {
    own = mask && mesh.toVolume(mask);
    const found = { ...distancesBetween(mesh, surface), dice: own?.dice(mask as Volume), labels };
    return withTransfer(found, [found.values]);
  } finally {
    own?.free();
    mask?.free();
  }
}

const handlers: Handlers<Requests> = {
  open,
  edit,
  undo: () => travel(-1),
  redo: () => travel(1),
  export: ({ format, ...options }) => current().mesh.toBytes(format, options),
  section: (plane) => sectionOf(current().mesh, plane),
  measure,
  reference: readReference,
  compare,
};

serveWhenReady<Requests>(init(), handlers);
