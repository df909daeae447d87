/** The worker: the only file that uses the vesicle package. It holds one volume and one model, and does what the page asks. */
import init, { DeformableModel, type Mesh, paramSpecs, type StepReport, VesicleError, Volume, version } from 'vesicle';
import type {
  Failure,
  Loaded,
  Measures,
  NamedBytes,
  ParamValues,
  Plane,
  Ready,
  RequestKind,
  RequestMessage,
  Requests,
  Setup,
  SurfaceBuffers,
  ToWorker,
  VolumeSource,
  VolumeView,
  WorkerEvent,
} from './protocol';
import { quantize } from './quantize';
import { shapeVoxels } from './shapes';
import { otsu, quantiles } from './threshold';

const HISTOGRAM_BINS = 256;
/** Two sets: one being shown while the next is filled. With one the run waits for the page; more only add delay. */
const BUFFER_SETS = 2;
/** Milliseconds between two looks at area and volume while running; they cost as much as a step on small meshes. */
const MEASURE_EVERY = 400;

type Handlers = {
  [K in RequestKind]: (body: Requests[K]['body']) => Promise<Requests[K]['reply']> | Requests[K]['reply'];
};

/** A request that makes no sense now; the library was not even asked. */
class Refusal extends Error {
  readonly code: string;

  constructor(code: string, message: string) {
    super(message);
    this.code = code;
  }
}

/** What was wrong, for the page. Any other error means that the engine itself broke. */
function toFailure(error: unknown): Failure {
  if (error instanceof VesicleError || error instanceof Refusal) return { code: error.code, message: error.message };
  return { code: 'internal', message: error instanceof Error ? error.message : String(error) };
}

function send(event: WorkerEvent, transfer: Transferable[] = []): void {
  self.postMessage(event, { transfer });
}

function emptyBuffers(): SurfaceBuffers {
  return { positions: new Float32Array(0), normals: new Float32Array(0), indices: new Uint32Array(0) };
}

function isHeader({ name }: NamedBytes): boolean {
  return /\.(nhdr|mhd)$/i.test(name);
}

/** A volume from one file; a header whose data is missing asks for it. */
function parseFile(file: NamedBytes): Volume {
  try {
    return Volume.parse(file.bytes);
  } catch (error) {
    if (!(error instanceof VesicleError) || !isHeader(file)) throw error;
    throw new Refusal(error.code, `${error.message}. Choose or drop a header together with the file of its voxels.`);
  }
}

/** A volume from one file, or from a header and its data in either order. */
function parseFiles(files: NamedBytes[]): Volume {
  const [first, second] = files;
  if (!first) throw new Refusal('bad-file', 'no file was given');
  if (!second) return parseFile(first);
  const [header, data] = isHeader(second) && !isHeader(first) ? [second, first] : [first, second];
  return Volume.parse(header.bytes, { data: data.bytes });
}

function volumeFrom(source: VolumeSource): Volume {
  return 'files' in source ? parseFiles(source.files) : new Volume(shapeVoxels(source.shape));
}

/** The volume reduced to what the page shows; slice by slice, so that no second full copy in floats is made. */
function viewOf(volume: Volume, name: string): VolumeView {
  const { dims, range } = volume;
  const histogram = volume.histogram(HISTOGRAM_BINS);
  // A few extreme voxels (metal, noise) must not make everything else grey.
  const [low = range[0], high = range[1]] = quantiles(histogram, range, [0.001, 0.999]);
  const window: [number, number] = high > low ? [low, high] : range;
  const voxels = new Uint8Array(dims[0] * dims[1] * dims[2]);
  for (let z = 0; z < dims[2]; z++) quantize(volume.slice(2, z), window, voxels, z * dims[0] * dims[1]);
  const { frames, spacing, affine, space } = volume;
  return { name, dims, frames, spacing, affine, space, range, histogram, window, voxels };
}

function startOf(setup: Setup, iso: number): ConstructorParameters<typeof DeformableModel>[0]['start'] {
  const { start } = setup;
  switch (start.kind) {
    case 'enclosing':
      return 'enclosing';
    case 'bubbles':
      return { bubbles: start.count };
    case 'isosurface':
      return { marchingCubes: iso };
    case 'sphere':
      return { seeds: new Float32Array(start.center), radius: start.radius };
  }
}

function buildModel(volume: Volume, setup: Setup): DeformableModel {
  const chosen = setup.params.iso;
  const iso = typeof chosen === 'number' ? chosen : otsu(volume.histogram(HISTOGRAM_BINS), volume.range);
  return new DeformableModel({
    volume,
    start: startOf(setup, iso),
    levels: setup.levels,
    ...(setup.edge === undefined ? {} : { edge: setup.edge }),
    params: { ...setup.params, iso },
  });
}

class Session {
  #volume: Volume | undefined;
  #model: DeformableModel | undefined;
  #planes: Plane[] = [];
  #free: SurfaceBuffers[] = Array.from({ length: BUFFER_SETS }, emptyBuffers);
  /** Steps the page has not heard of yet. */
  #reports: StepReport[] = [];
  #done = false;
  #measuredAt = 0;
  #run: { abort: AbortController; ended: Promise<void> } | undefined;

  readonly handlers: Handlers = {
    hello: async () => {
      await init();
      return { version: version(), specs: paramSpecs('deformable') };
    },
    load: ({ name, source, setup }) => this.#load(name, source, setup),
    rebuild: (setup) => this.#rebuild(setup),
    play: () => this.#play(),
    pause: () => this.#pause(),
    step: ({ count }) => this.#step(count),
    setParams: (params) => this.#setParams(params),
    planes: (planes) => this.#setPlanes(planes),
    export: ({ format }) => this.#current().mesh.toBytes(format),
  };

  takeBack(buffers: SurfaceBuffers): void {
    if (this.#free.length < BUFFER_SETS) this.#free.push(buffers);
  }

  async #load(name: string, source: VolumeSource, setup: Setup): Promise<Loaded> {
    await this.#pause();
    const volume = volumeFrom(source);
    try {
      const view = viewOf(volume, name);
      const ready = this.#adopt(buildModel(volume, setup));
      this.#volume?.free();
      this.#volume = volume;
      return { ...ready, volume: view };
    } catch (error) {
      volume.free();
      throw error;
    }
  }

  async #rebuild(setup: Setup): Promise<Ready> {
    await this.#pause();
    if (!this.#volume) throw new Refusal('invalid-argument', 'no volume is loaded: open one first');
    return this.#adopt(buildModel(this.#volume, setup));
  }

  #adopt(model: DeformableModel): Ready {
    this.#model?.free();
    this.#model = model;
    this.#reports = [];
    this.#done = false;
    this.#snapshot('checked');
    return { params: { ...model.params }, delta: model.delta };
  }

  #current(): DeformableModel {
    if (!this.#model) throw new Refusal('invalid-argument', 'no volume is loaded: open one first');
    return this.#model;
  }

  #play(): undefined {
    const model = this.#current();
    if (this.#run) return;
    const abort = new AbortController();
    this.#run = { abort, ended: this.#runToEnd(model, abort.signal) };
    send({ event: 'state', state: 'running' });
  }

  async #runToEnd(model: DeformableModel, signal: AbortSignal): Promise<void> {
    try {
      await model.run({ signal, onStep: (report) => this.#stepped(report) });
    } catch (error) {
      if (!signal.aborted) send({ event: 'failure', failure: toFailure(error) });
    }
    this.#run = undefined;
    this.#standStill();
  }

  #stepped(report: StepReport): void {
    this.#reports.push(report);
    this.#done = report.done;
    if (this.#free.length === 0) return;
    const due = performance.now() - this.#measuredAt > MEASURE_EVERY;
    this.#snapshot(due ? 'measured' : 'plain');
  }

  async #pause(): Promise<undefined> {
    const run = this.#run;
    if (!run) return;
    run.abort.abort();
    await run.ended;
  }

  async #step(count: number): Promise<undefined> {
    await this.#pause();
    const model = this.#current();
    for (let i = 0; i < count && !this.#done; i++) this.#stepped(model.step(1));
    this.#standStill();
  }

  #standStill(): void {
    this.#snapshot('checked');
    send({ event: 'state', state: this.#done ? 'done' : 'paused' });
  }

  #setParams(params: ParamValues): ParamValues {
    const model = this.#current();
    model.setParams(params);
    this.#done = false;
    return { ...model.params };
  }

  #setPlanes(planes: Plane[]): undefined {
    this.#planes = planes;
    if (this.#model && !this.#run) {
      const sections = this.#sections(this.#model.mesh);
      send({ event: 'sections', sections }, buffersOf(sections));
    }
  }

  #sections(mesh: Mesh): Float32Array[] {
    return this.#planes.map(({ origin, normal }) => mesh.crossSection(origin, normal));
  }

  #snapshot(detail: 'plain' | 'measured' | 'checked'): void {
    const { mesh } = this.#current();
    const buffers = this.#free.pop() ?? emptyBuffers();
    const counts = mesh.copyTo(buffers);
    const sections = this.#sections(mesh);
    const measures = detail === 'plain' ? undefined : this.#measure(mesh, detail === 'checked');
    const reports = this.#reports;
    this.#reports = [];
    const { positions, normals, indices } = buffers;
    send({ event: 'snapshot', surface: { ...buffers, ...counts }, sections, reports, ...(measures && { measures }) }, [
      ...buffersOf([positions, normals, indices]),
      ...buffersOf(sections),
    ]);
  }

  #measure(mesh: Mesh, thorough: boolean): Measures {
    const measures: Measures = thorough ? { info: mesh.info(), report: mesh.check() } : { info: mesh.info() };
    this.#measuredAt = performance.now();
    return measures;
  }
}

function buffersOf(arrays: (Float32Array | Uint32Array)[]): Transferable[] {
  return arrays.map((array) => array.buffer as ArrayBuffer);
}

const session = new Session();

async function answer({ id, kind, body }: RequestMessage): Promise<void> {
  const handler = session.handlers[kind] as (body: unknown) => unknown;
  try {
    self.postMessage({ id, ok: true, body: await handler(body) });
  } catch (error) {
    self.postMessage({ id, ok: false, failure: toFailure(error) });
  }
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.kind === 'return') session.takeBack(data.buffers);
  else void answer(data);
};
