import { checkProperties, denseCopy, integer, number, shallowCopy, typedArray } from './check.js';
import type { Bytes, Vec3 } from './data.js';
import { type Mesh, wrapMesh } from './mesh.js';
import { frameOf, type MeshFrame } from './mesh-file.js';
import { Handle } from './runtime.js';
import { isOfSmall, limitOf, MOST_LABEL_VERTICES_OF_SMALL } from './small-files.js';
import {
  checkedSlices,
  finishInSlices,
  Runner,
  type RunOptions,
  type SliceOptions,
  type Stepper,
  type StepReport,
} from './stepper.js';
import { RawLabelCreation, RawLabelSurfaces } from './vesicle.js';
import { checkedRegion, type Volume, volumeHandle } from './volume.js';
import { ModelWarnings } from './warnings.js';

/** Parameters of {@link LabelSurfaces}; `paramSpecs('labels')` has their ranges, defaults and descriptions. */
export interface LabelParams {
  /** Number of smoothing iterations; 0 leaves the faces of the voxels. */
  smoothing?: number;
  /**
   * Edge length wanted of the triangles, in voxels, from 1, which leaves a vertex in each cell between voxels. With longer
   * edges the surfaces of all labels lose the same vertices: the centre of each voxel stays on its side of every surface,
   * so edges stay short where that needs them, and labels that touch stay as near each other. {@link LabelSurfaces.refresh}
   * coarsens what has changed again.
   */
  edge?: number;
}

/** Constructor options of {@link LabelSurfaces}. */
export interface LabelOptions extends LabelParams {
  /**
   * Label map: a volume of integers, 0 for the background. Its voxels are copied, and read again by
   * {@link LabelSurfaces.refresh}. Of a sequence, the first frame is used.
   */
  volume: Volume;
  /** Labels that get a surface; all others count as background. Default all, including those that are added later. */
  labels?: number[];
  /**
   * Largest number of vertices of all surfaces when they are created, one for each cell of the grid through which they pass;
   * label maps with more are refused. By default, and at most, 8 million, or 1 million by default if the files of the
   * volume have at most 128 KiB, all together: these may come from anyone.
   */
  maxVertices?: number;
}

const OPTIONS = ['volume', 'labels', 'maxVertices', 'smoothing', 'edge'];

/** Surfaces that are created already, for the constructor. */
class Created {
  readonly volume: Volume;
  readonly handle: Handle<RawLabelSurfaces>;

  constructor(volume: Volume, handle: Handle<RawLabelSurfaces>) {
    this.volume = volume;
    this.handle = handle;
  }
}

/** Returns the volume, and the arguments for the raw object of surfaces or of their creation. */
function checked(given: LabelOptions) {
  const { volume, labels, maxVertices, ...params } = checkProperties('options', given, OPTIONS) as LabelOptions;
  if (maxVertices !== undefined) integer('maxVertices', maxVertices, { min: 1 });
  const image = volumeHandle('volume', volume);
  const wanted = labels && Float64Array.from(denseCopy('labels', labels), (label) => number('labels', label));
  const most = limitOf(maxVertices, isOfSmall(volume), MOST_LABEL_VERTICES_OF_SMALL);
  return { volume, image, wanted, params, most };
}

/**
 * Surfaces of a label map: one closed surface for each label, none of which intersects itself or another, and which
 * follow changes of the label map.
 *
 * The surfaces are surface nets (after Gibson, "Constrained elastic surface nets", 1998), smoothed within the voxels,
 * so that the centre of each voxel is inside of the surface of its label, however thin that is; volumes are those of
 * the voxels. Voxels of a label are connected across their faces. Labels that touch are a hundredth of a voxel apart.
 * Surfaces are in the volume's world space.
 *
 * @throws All methods: {@link VesicleError} `freed` after {@link LabelSurfaces.free}.
 */
export class LabelSurfaces implements Omit<Stepper, 'mesh'> {
  readonly #handle: Handle<RawLabelSurfaces>;
  readonly #volume: Volume;
  readonly #meshes = new Map<number, { mesh: Mesh; handle: Handle<import('./vesicle.js').RawMesh> }>();
  readonly #runner = new Runner();
  readonly #warnings: ModelWarnings;
  readonly #frame: MeshFrame;

  /**
   * Creates the surfaces along the faces of the voxels; the first steps smooth them.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the option: a volume that is no label map, a label that it
   *   does not have, too many labels, surfaces through more than 8 million cells of its grid; `too-large`.
   */
  constructor(given: LabelOptions) {
    const { volume, handle } = given instanceof Created ? given : create(given);
    this.#volume = volume;
    this.#frame = frameOf(volume);
    this.#warnings = new ModelWarnings(volume.warnings);
    this.#handle = handle;
  }

  /**
   * Creates the surfaces as the constructor does, bit for bit, yielding to the event loop between slices of work: those of a
   * large label map take seconds. The volume must not be freed before.
   *
   * @param options - `signal`: aborts the creation; `budgetMs`: duration of a slice, milliseconds, default 12.
   * @throws As the constructor; `signal.reason` when aborted.
   */
  static async create(given: LabelOptions, options?: SliceOptions): Promise<LabelSurfaces> {
    const slices = checkedSlices(options);
    slices.signal?.throwIfAborted();
    const { volume, image, wanted, params, most } = checked(given);
    const begin = () => image.use((raw) => new RawLabelCreation(raw, wanted, params, most));
    const creation = new Handle('LabelSurfaces', begin);
    const raw = await finishInSlices(creation, (one) => one.advance(), slices);
    return new LabelSurfaces(new Created(volume, new Handle('LabelSurfaces', () => raw)) as unknown as LabelOptions);
  }

  /** The labels that have voxels and a surface, in ascending order. */
  get labels(): readonly number[] {
    return this.#handle.use((raw) => Array.from(raw.labels()));
  }

  /** Current values of all parameters; a copy. */
  get params(): Required<LabelParams> {
    return this.#handle.use((raw) => raw.params() as Required<LabelParams>);
  }

  /**
   * Returns the surface of a label in world space: the same live {@link Mesh} at every call. It shows the current state,
   * is empty while the label has no voxels, and is freed with the surfaces. Its versions increase only when this surface
   * changes.
   *
   * @throws {@link VesicleError} `invalid-argument`: a label that never had a surface.
   */
  mesh(label: number): Mesh {
    number('label', label);
    let known = this.#meshes.get(label);
    if (!known) {
      const handle = new Handle('Mesh', () => this.#handle.use((raw) => raw.mesh(label)));
      known = { handle, mesh: wrapMesh(handle, true, () => this.#warnings.of({ label }), this.#frame) };
      this.#meshes.set(label, known);
    }
    return known.mesh;
  }

  /**
   * Adopts voxels that have changed, such as by {@link Volume.write}: the surfaces there follow at once, along the faces
   * of the changed voxels, and the next steps smooth them. The rest of the surfaces is unchanged.
   *
   * @param region - `min`: index of the first voxel along x, y and z; `dims`: numbers of voxels.
   * @throws {@link VesicleError} `invalid-argument`: an empty region or one beyond the volume, or too many labels;
   *   `freed` if the volume was freed; `too-large`. Nothing has changed then.
   */
  refresh(region: { min: Vec3; dims: Vec3 }): void {
    const [min, dims] = checkedRegion(region);
    this.#handle.use((raw) => volumeHandle('volume', this.#volume).use((volume) => raw.refresh(volume, min, dims)));
  }

  /**
   * Makes up to `iterations` steps, synchronous and deterministic; fewer if the surfaces are settled earlier. A step is
   * ten smoothing iterations, or more where few voxels have changed.
   *
   * @returns The last report; counts are those of all surfaces together.
   * @throws {@link VesicleError} `invalid-argument` while a {@link LabelSurfaces.run} is in progress.
   */
  step(iterations = 1): StepReport {
    integer('iterations', iterations, { min: 1 });
    this.#runner.refuseWhileRunning('step');
    return this.#step(iterations);
  }

  /**
   * Runs until the surfaces are settled, yielding to the event loop between slices of work, also within a step.
   * {@link LabelSurfaces.refresh} may be called meanwhile; like all that looks at the surfaces, it ends a step that is under
   * way first.
   *
   * @returns The last report.
   * @throws `signal.reason` when aborted, and the surfaces stay usable; any error thrown by `onStep`;
   *   {@link VesicleError} `invalid-argument` while another run is in progress, `freed` when freed meanwhile.
   */
  run(given?: RunOptions): Promise<StepReport> {
    return this.#runner.run(() => this.#advance(), given);
  }

  /** Does a slice of a step; returns its report at its end. */
  #advance(): StepReport | undefined {
    const report = this.#handle.use((raw) => raw.advance() as StepReport | undefined);
    return report && this.#warnings.take(report);
  }

  #step(iterations: number): StepReport {
    return this.#warnings.take(this.#handle.use((raw) => raw.step(iterations) as StepReport));
  }

  /**
   * Changes any subset of the parameters. If the smoothing changes, all surfaces are smoothed again, from where they are; edges
   * longer than a voxel are made by the last step.
   *
   * @throws {@link VesicleError} `invalid-argument` naming the parameter that is misspelled, of the wrong type or out of
   *   range. Nothing has changed then.
   */
  setParams(params: LabelParams): void {
    const values = shallowCopy('params', params);
    this.#handle.use((raw) => raw.setParams(values));
  }

  /** Saves the whole state but the label map, for {@link LabelSurfaces.restore} with the same label map and labels. */
  save(): Bytes {
    return this.#handle.use((raw) => raw.save() as Bytes);
  }

  /**
   * Restores a saved state, bit for bit.
   *
   * @throws {@link VesicleError} `bad-file` for bytes that are not a saved state of surfaces of the label map as it is
   *   now; nothing has changed then; `invalid-argument` while a run is in progress.
   */
  restore(state: Uint8Array): void {
    typedArray('state', state, Uint8Array);
    this.#runner.refuseWhileRunning('restore');
    this.#handle.use((raw) => raw.restore(state));
    this.#warnings.forget();
  }

  /** Frees the memory; the surfaces and their live meshes cannot be used afterwards. */
  free(): void {
    for (const { handle } of this.#meshes.values()) handle.free();
    this.#handle.free();
  }

  /** The same as {@link LabelSurfaces.free}, for `using`. */
  [Symbol.dispose](): void {
    this.free();
  }
}

function create(given: LabelOptions): Created {
  const { volume, image, wanted, params, most } = checked(given);
  const make = () => image.use((raw) => new RawLabelSurfaces(raw, wanted, params, most));
  return new Created(volume, new Handle('LabelSurfaces', make));
}
