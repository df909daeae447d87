import { computed, signal } from '@preact/signals';
import { toCode } from '../engine/edits';
import { shortened } from '../engine/placing';
import type { Edit, ParamSpec, ParamValues, SurfacePoint, Unit, Vec3 } from '../engine/protocol';
import { download } from '../kit/download';
import { figure } from '../kit/format';
import { Params } from '../kit/params';
import { componentRoots } from '../scene/components';
import type { EditedView } from '../scene/edited-view';
import { plural, text } from '../texts';
import { type Finishing, isCancelled } from './finishing';
import type { Edited } from './protocol';

/** Name under which the surface before the edits is saved, and the program for them reads it. */
const INITIAL = 'surface.ply';
/** Ratio of the bounds of edge lengths of remeshing to the length given, and its inverse. */
const SPREAD = 1.5;
export const AXES = ['x', 'y', 'z'];
export const SIDES = [text('finish.below'), text('finish.above')];

/** The settings of an operation. */
export class Form {
  readonly params = new Params();

  constructor(specs: ParamSpec[], values: ParamValues) {
    this.params.specs.value = specs;
    this.params.show(values);
  }

  get values(): ParamValues {
    return this.params.values.peek();
  }
}

/** Use of clicks on the surface: they choose components, or measure distances. */
export type Picking = 'choose' | 'measure';

/** The edits of a surface after a run, and distances on it. */
export class Editing {
  readonly unit = signal<Unit>('');
  readonly edited = signal<Edited | undefined>(undefined);
  readonly status = signal('');
  readonly error = signal('');
  readonly distance = signal('');
  readonly picking = signal<Picking | undefined>(undefined);
  /** Indices of the components that are chosen. */
  readonly chosen = signal<ReadonlySet<number>>(new Set());
  /** The component that was chosen last by a click on the surface. */
  readonly clicked = signal<number | undefined>(undefined);
  readonly #isEnabled = signal(false);
  readonly #isUnfolded = signal(false);
  /** Number of tasks in progress, and of those during which no other may begin. */
  readonly #working = signal(0);
  readonly #blocking = signal(0);
  readonly isWorking = computed(() => this.#working.value > 0);
  /** Whether there is a surface, which can be edited now. */
  readonly isIdle = computed(() => this.#isEnabled.value && this.#blocking.value === 0);
  /** The components, by their indices, from the largest volume on. */
  readonly ranked = computed(() => {
    const parts = this.edited.value?.components ?? [];
    const size = (index: number) => Math.abs(parts[index]?.volume ?? 0);
    return [...parts.keys()].sort((i, j) => size(j) - size(i) || i - j);
  });
  readonly code = computed(() => toCode(this.edited.value?.log ?? [], INITIAL));
  readonly decimation = new Form(
    [spec('targetTriangles', 'integer', text('finish.triangles'), text('finish.decimateHelp'), { min: 1 })],
    { targetTriangles: 1000 },
  );
  readonly bounded = new Form(
    [spec('maxDistance', 'number', text('finish.distance'), text('finish.boundedHelp'), { min: 0 })],
    { maxDistance: 0.1 },
  );
  readonly remeshing = new Form([spec('edge', 'number', text('finish.edge'), text('finish.remeshHelp'))], { edge: 1 });
  readonly smoothing = new Form(
    [
      spec('iterations', 'integer', text('finish.iterations'), text('finish.smoothHelp'), { min: 0 }),
      spec('keepVolume', 'boolean', text('finish.keepVolume'), text('finish.keepVolumeHelp')),
    ],
    { iterations: 10, keepVolume: true },
  );
  readonly cutting = new Form(
    [
      spec('axis', 'choice', text('finish.axis'), text('finish.axisHelp'), { choices: AXES }),
      spec('position', 'number', text('finish.position'), text('finish.positionHelp'), { min: 0, max: 100, unit: '%' }),
      spec('side', 'choice', text('finish.side'), text('finish.sideHelp'), { choices: SIDES }),
    ],
    { axis: 'z', position: 50, side: SIDES[0] },
  );
  readonly #finishing: Finishing;
  readonly #view: EditedView;
  #from: SurfacePoint | undefined;

  constructor(finishing: Finishing, view: EditedView) {
    this.#finishing = finishing;
    this.#view = view;
  }

  /** Whether there is a surface to edit. */
  set enabled(isEnabled: boolean) {
    const begins = isEnabled && !this.#isEnabled.peek();
    this.#isEnabled.value = isEnabled;
    if (begins) void this.#open();
  }

  /** Whether the controls are unfolded: they then show the components of the surface. */
  set unfolded(isUnfolded: boolean) {
    this.#isUnfolded.value = isUnfolded;
    void this.#open();
  }

  /** Takes the surface after an edit; undefined if there is none. */
  take(edited: Edited | undefined): void {
    this.#from = undefined;
    this.distance.value = '';
    this.#view.showLines([]);
    this.chosen.value = new Set();
    this.edited.value = edited;
    if (edited) this.#suggest(edited);
    else this.pick(undefined);
  }

  async #open(): Promise<void> {
    if (!this.#isEnabled.peek() || !this.#isUnfolded.peek() || this.#working.peek() > 0 || this.#finishing.edited)
      return;
    // Controls stay enabled meanwhile: a button that is disabled while it is pressed loses the click.
    await this.attempt(() => this.#finishing.open(), { blocking: false });
  }

  /** Proposes half the triangles, and the present length of edges. */
  #suggest({ measures: { info } }: Edited): void {
    this.decimation.params.show({ targetTriangles: Math.max(4, Math.round(info.triangles / 2)) });
    this.bounded.params.show({ maxDistance: Number((info.edge.mean / 10).toPrecision(2)) });
    this.remeshing.params.show({ edge: Number(info.edge.mean.toPrecision(3)) });
  }

  decimate = () => this.#edit(() => ({ op: 'decimate', ...this.decimation.values }) as Edit);
  decimateWithin = () => this.#edit(() => ({ op: 'decimateWithin', ...this.bounded.values }) as Edit);
  remesh = () => this.#edit(() => this.#remeshing());
  smooth = () => this.#edit(() => ({ op: 'smooth', ...this.smoothing.values }) as Edit);
  keep = () => this.#edit(() => this.#keeping((index) => this.chosen.peek().has(index)));
  remove = () => this.#edit(() => this.#keeping((index) => !this.chosen.peek().has(index)));
  keepLargest = () => this.#edit(() => ({ op: 'keepComponents', indices: this.ranked.value.slice(0, 1) }));
  fill = () => this.#edit(() => ({ op: 'removeCavities' }));
  cut = () => this.#edit(() => ({ op: 'cut', ...this.#plane() }));
  undo = () => this.#change('undo');
  redo = () => this.#change('redo');
  cancel = () => this.#finishing.cancel();

  #keeping(isKept: (index: number) => boolean): Edit {
    const all = this.edited.peek()?.components.keys() ?? [];
    return { op: 'keepComponents', indices: [...all].filter(isKept) };
  }

  #remeshing(): Edit {
    const edge = Number(this.remeshing.values.edge);
    const [min, max] = [edge / SPREAD, edge * SPREAD].map((bound) => Number(bound.toPrecision(4)));
    return { op: 'remesh', min: min ?? 0, max: max ?? 0 };
  }

  #edit(make: () => Edit): Promise<void> {
    return this.#change('edit', make);
  }

  /** Changes the surface; `make` is called when it is open, as most edits depend on it. */
  async #change(kind: 'edit' | 'undo' | 'redo', make: () => Edit | undefined = () => undefined): Promise<void> {
    await this.attempt(async () => {
      await this.#finishing.open();
      const edit = make();
      await this.#finishing.change(kind, (edit && { edit }) as never);
      const { info } = this.#finishing.edited?.measures ?? {};
      if (info) this.status.value = text('finish.done', { triangles: plural('counts.triangle', info.triangles) });
    });
  }

  /**
   * Does some work; controls are disabled meanwhile if it is `blocking`. An error is shown, with what `state` says of the
   * surface then: by default, nothing has changed. Returns whether the work was done.
   */
  async attempt(
    work: () => Promise<unknown>,
    { blocking = true, state = () => text('finish.unchanged') } = {},
  ): Promise<boolean> {
    this.error.value = '';
    this.status.value = text('finish.working');
    const focused = document.activeElement;
    this.#count(1, blocking);
    try {
      await work();
      if (this.#working.peek() === 1 && this.status.peek() === text('finish.working')) this.status.value = '';
      return true;
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      this.status.value = isCancelled(error) ? text('finish.cancelled', { state: state() }) : '';
      this.error.value = isCancelled(error) ? '' : text('finish.refused', { state: state(), reason });
      return false;
    } finally {
      this.#count(-1, blocking);
      // After the buttons are enabled again.
      queueMicrotask(() => this.#focusAgain(focused));
    }
  }

  /** Gives back the focus, which buttons lose when they are disabled, as *Cancel* is at the end. */
  #focusAgain(focused: Element | null): void {
    const { activeElement } = document;
    const isOnCancel = activeElement instanceof HTMLElement && activeElement.dataset.finish === 'cancel';
    const isLost = activeElement === document.body || isOnCancel;
    if (isLost && this.#blocking.peek() === 0 && focused instanceof HTMLElement) focused.focus();
  }

  #count(change: 1 | -1, blocking: boolean): void {
    this.#working.value += change;
    if (blocking) this.#blocking.value += change;
  }

  /** Begins to pass clicks on the surface on, or ends it. */
  async pick(picking: Picking | undefined): Promise<void> {
    this.picking.value = picking;
    this.#view.pick(undefined);
    this.#view.showLines([]);
    if (!picking || !(await this.attempt(() => this.#finishing.open())) || this.picking.peek() !== picking) return;
    this.#view.pick((at) => (picking === 'choose' ? this.#chooseAt(at.triangle) : void this.#measure(at)));
  }

  /** Chooses a component, or no longer chooses it. */
  choose(index: number, isChosen: boolean): void {
    const others = [...this.chosen.peek()].filter((one) => one !== index);
    this.chosen.value = new Set(isChosen ? [...others, index] : others);
  }

  #chooseAt(triangle: number): void {
    const index = componentOf(this.edited.peek(), triangle);
    this.choose(index, !this.chosen.peek().has(index));
    this.clicked.value = index;
  }

  /** Returns the plane of the cut, whose normal points to the side to be removed. */
  #plane(): { origin: Vec3; normal: Vec3 } {
    const { axis: along, position, side } = this.cutting.values;
    const axis = AXES.indexOf(String(along));
    const { min, max } = this.#finishing.edited?.measures.info.bounds ?? { min: [0, 0, 0], max: [0, 0, 0] };
    const size = Math.max(...min.map((low, k) => (max[k] ?? 0) - low));
    const at = (k: number, part: number) => {
      const low = min[k] ?? 0;
      return shortened(low + part * ((max[k] ?? 0) - low), 6, size);
    };
    const origin = min.map((_, k) => at(k, k === axis ? 0.01 * Number(position) : 0.5)) as Vec3;
    const normal: Vec3 = [0, 0, 0];
    normal[axis] = side === SIDES[0] ? 1 : -1;
    return { origin, normal };
  }

  preview = async (): Promise<void> => {
    if (!this.isIdle.peek()) return;
    await this.attempt(async () => {
      await this.#finishing.open();
      this.#view.showLines(await this.#finishing.request('section', this.#plane()));
    });
  };

  async #measure(at: SurfacePoint): Promise<void> {
    const from = this.#from;
    this.#from = from ? undefined : at;
    if (!from) {
      this.distance.value = text('finish.secondPoint');
      return;
    }
    this.#view.showLines([...from.point, ...at.point]);
    await this.attempt(async () => {
      const { straight, geodesic } = await this.#finishing.request('measure', [from, at]);
      const [a, b] = [straight, geodesic].map((length) => `${figure(length)} ${this.unit.peek()}`.trim());
      this.distance.value = Number.isFinite(geodesic)
        ? text('finish.distances', { straight: a ?? '', geodesic: b ?? '' })
        : text('finish.apart', { straight: a ?? '' });
    });
  }

  saveInitial = async (): Promise<void> => {
    if (this.#finishing.initial) download(INITIAL, this.#finishing.initial, 'application/octet-stream');
  };

  copy = async (): Promise<void> => {
    await this.attempt(async () => {
      await navigator.clipboard.writeText(this.code.peek());
      this.status.value = text('finish.copied');
    });
  };
}

/** Returns the index of a triangle's component; components are numbered by their first triangles. */
function componentOf(edited: Edited | undefined, triangle: number): number {
  const { indices, triangles, vertices } = edited?.surface ?? {};
  if (!indices || !triangles || !vertices) return 0;
  const roots = componentRoots(indices, 3 * triangles, vertices);
  const rootOf = (index: number) => roots[indices[3 * index] ?? 0] ?? 0;
  const order = new Set(Array.from({ length: triangles }, (_, index) => rootOf(index)));
  return [...order].indexOf(rootOf(triangle));
}

function spec(
  name: string,
  type: ParamSpec['type'],
  label: string,
  help: string,
  more: Partial<ParamSpec> = {},
): ParamSpec {
  return { name, type, label, help, default: undefined, ...more };
}
