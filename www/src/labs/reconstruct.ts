import { RequestError, toFailure } from '../channel';
import { ReconstructClient } from '../reconstruct/client';
import { CLOUDS, type CloudExample } from '../reconstruct/examples';
import { type CloudPreset, type CloudVariant, cloudById, isCloudPreset, variantInForce } from '../reconstruct/presets';
import type {
  Cloud,
  Edits,
  MeasuredEvent,
  ParamValues,
  PointShade,
  Setup,
  SurfaceEvent,
  WorkerEvent,
} from '../reconstruct/protocol';
import { type LabState, Observable } from '../state';
import type { CloudChoice } from '../ui/cloud-setup';
import { count, figure, plural } from '../ui/format';
import { History } from '../ui/history';
import { overallProgress } from '../ui/phases';
import { offerShortcuts, type Shortcut } from '../ui/shortcuts';
import type { CloudViewOptions, Hit } from '../view/reconstruction';
import type { Lab, PassOn } from './labs';
import type { Photograph } from './photographs';
import { editedBy, NO_EDITS, shownColors, shownPoints } from './picking';
import { fromExample, fromFiles, type Opened } from './point-files';
import { ADDRESS, fits, fromHash, type LinkedCloud, linkOf, photoFor, toHash, withLink } from './reconstruct-link';
import { fitValues } from './reconstruct-measures';
import { ReconstructParts } from './reconstruct-parts';
import { UndoStack } from './undo';

/** Voxels along the longest side of a volume that is saved or passed on. */
const VOLUME_SIZE = 96;
const UNDO_LIMITS = { entries: 60, bytes: 96e6 };
const TOGETHER = 1500;

/** What the present points were made of, to open them again after a failure of the engine. */
interface Source {
  name: string;
  opened: () => Promise<Opened>;
  example?: CloudExample;
  linked?: LinkedCloud;
}

/** All that undo brings back. */
interface Settings {
  choice: CloudChoice;
  params: ParamValues;
  edits: Edits;
}

/** The Reconstruct lab: an implicit surface through points. */
export class ReconstructLab implements Lab {
  readonly #root: HTMLElement;
  readonly #passOn: PassOn;
  readonly #state = new Observable<LabState>('loading');
  readonly #closing = new AbortController();
  readonly #client = new ReconstructClient((event) => this.#onEvent(event));
  readonly #history = new History();
  readonly #undo = new UndoStack<Settings>(UNDO_LIMITS);
  readonly #ui: ReconstructParts;
  readonly #shortcuts: Shortcut[] = [
    { key: ' ', shown: 'Space', text: 'play or pause', act: () => this.#toggle() },
    { key: 's', shown: 's', text: 'one step', act: () => this.#step(1) },
    { key: 'd', shown: 'd', text: 'ten steps', act: () => this.#step(10) },
    { key: 'r', shown: 'r', text: 'reset', act: () => void this.#reset() },
    { key: 'z', ctrl: true, shown: 'Ctrl Z', text: 'undo', act: () => void this.#travel('undo') },
    { key: 'shift+z', ctrl: true, shown: 'Ctrl ⇧ Z', text: 'redo', act: () => void this.#travel('redo') },
    { key: 'y', ctrl: true, shown: 'Ctrl Y', text: 'redo', act: () => void this.#travel('redo') },
  ];
  #defaults: ParamValues = {};
  #params: ParamValues = {};
  #edits: Edits = NO_EDITS;
  #cloud: Cloud | undefined;
  #source: Source | undefined;
  #shade: PointShade | undefined;
  #awaiting: LinkedCloud | undefined;
  /** Counts what was asked to be opened: what is asked for last counts. */
  #turn = 0;
  /** The state to return to when an error has been read. */
  #calm: 'loading' | 'paused' | 'done' = 'loading';
  #engineBroken = false;
  /** A complete surface is shown: what is being extracted must not replace it. */
  #whole = false;
  #surface: SurfaceEvent | undefined;
  #framePending = 0;
  #lastChange = { together: '', at: 0 };

  constructor(root: HTMLElement, help: HTMLElement, passOn: PassOn) {
    this.#root = root;
    this.#passOn = passOn;
    this.#ui = new ReconstructParts(root, this.#history, this.#client, this.#closing.signal, {
      onFiles: (files) => void this.#openFiles(files),
      onExample: (example) => void this.#openExample(example),
      onExampleId: (id) => this.#openById(id),
      onVariant: (preset, variant) => this.#openVariant(preset, variant),
      onChoice: (choice, what) => void this.#change({ choice }, `change of ${what}`),
      onParam: (name, value) => void this.#setParam(name, value),
      onPick: (hit) => this.#pick(hit),
      onTakeBack: () => void this.#change({ edits: NO_EDITS }, 'taking all back'),
      onOptions: (options) => this.#setOptions(options),
      onPhotograph: () => this.#updateAddress(),
      onToggle: () => this.#toggle(),
      onStep: (steps) => this.#step(steps),
      onReset: () => void this.#reset(),
      onUndo: () => void this.#travel('undo'),
      onRedo: () => void this.#travel('redo'),
      onDismiss: () => this.#dismiss(),
      onSaveVolume: () => this.#tryTo('The volume could not be made.', () => this.#saveVolume()),
      onPassOn: () => this.#tryTo('The volume could not be made.', () => this.#toExtract()),
      onCopyLink: () => void this.#copyLink(),
      onError: (title, error) => this.#fail(title, error),
    });
    this.#state.follow((state) => this.#showState(state));
    offerShortcuts(this.#shortcuts, help, this.#closing.signal);
  }

  /** Opens what the address says, or else the built-in example, and runs it. */
  async start(): Promise<void> {
    try {
      await this.#greet();
    } catch (error) {
      this.#fail('Vesicle could not start.', error);
      return;
    }
    const { signal } = this.#closing;
    if (signal.aborted) return;
    window.addEventListener('hashchange', () => void this.#openLink(), { signal });
    await this.#openLink(CLOUDS[0]);
  }

  close(): void {
    this.#closing.abort();
    this.#turn += 1;
    this.#client.close();
    cancelAnimationFrame(this.#framePending);
    this.#ui.dispose();
    this.#root.replaceChildren();
  }

  async #greet(): Promise<void> {
    const { specs } = await this.#client.request('hello', undefined);
    this.#defaults = Object.fromEntries(specs.map(({ name, default: value }) => [name, value]));
    this.#ui.makeParams(specs);
  }

  // ── opening ───────────────────────────────────────────────────────────────────────────────────

  #openExample(example: CloudExample, linked?: LinkedCloud): Promise<void> {
    const name = 'file' in example.source ? example.source.file : example.source.shape;
    return this.#open({ name, opened: () => fromExample(example), example, ...(linked && { linked }) });
  }

  #openFiles(files: File[]): Promise<void> {
    const name = files.find((file) => !/\.(json|png|jpe?g|webp)$/i.test(file.name))?.name;
    const linked = this.#awaiting;
    return this.#open({
      name: name ?? files.map((file) => file.name).join(' + '),
      opened: () => fromFiles(files),
      ...(linked && { linked }),
    });
  }

  #openById(id: string): void {
    const example = cloudById(id);
    if (example) void this.#openExample(example);
  }

  /** Opens what the page's address asks for; says why where that cannot be. `otherwise` is opened then. */
  async #openLink(otherwise?: CloudExample): Promise<void> {
    const linked = fromHash(location.hash);
    const id = linked?.example ?? (linked && !linked.file ? CLOUDS[0].id : '');
    const example = cloudById(id);
    if (linked && example) return this.#openExample(example, linked);
    if (otherwise) await this.#openExample(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#ui.banner.show('This link needs a file.', `Open ${linked.file} from your disk: its settings will follow.`);
    else this.#ui.banner.show('This link cannot be followed.', `There is no example “${linked.example ?? ''}”.`);
  }

  /** Opens points and runs the model on them. When it fails, everything stays as it was. */
  async #open(source: Source): Promise<void> {
    const turn = ++this.#turn;
    this.#enterLoading(`Opening ${source.name}.`);
    try {
      if (this.#engineBroken) await this.#restartEngine();
      const { source: points, photographs } = await source.opened();
      if (turn !== this.#turn) return;
      const from = points ?? (await this.#presentPoints());
      const setup = this.#setupFor(source);
      const cameras = photographs.map(({ view }) => view);
      const { cloud, params } = await this.#client.request('load', { source: from, cameras, setup });
      if (turn !== this.#turn) return;
      this.#source = points ? source : { ...source, name: this.#source?.name ?? source.name };
      this.#awaiting = undefined;
      this.#adopt(cloud, photographs, setup, source);
      this.#showParams(params);
      await this.#play();
    } catch (error) {
      if (turn !== this.#turn) return;
      this.#ui.data.choose(this.#source?.example);
      this.#fail(`${source.name} could not be opened.`, error);
    }
  }

  /** For cameras that come after their points. */
  async #presentPoints() {
    if (!this.#source) throw new Error('Open points first, or together with their cameras.');
    const { source } = await this.#source.opened();
    if (!source) throw new Error('Open points together with their cameras.');
    return source;
  }

  #setupFor({ example, linked }: Source): Setup {
    const { cell: _, ...params } = this.#params;
    // A cell is a length in the units of other points.
    const usual = example ? { ...this.#defaults, ...example.params } : params;
    const first = example ? variantOf(example) : undefined;
    const choice = example
      ? { maxPoints: first?.maxPoints ?? example.maxPoints, keepComponents: example.keepComponents }
      : this.#ui.setup.value;
    const { maxPoints, keepComponents } = withLink(choice, linked ?? {});
    return {
      params: { ...usual, ...(linked ? {} : first?.params), ...linked?.params },
      maxPoints,
      keepComponents,
      edits: linked?.edits ?? NO_EDITS,
    };
  }

  #adopt(cloud: Cloud, photographs: Photograph[], setup: Setup, { name, example, linked }: Source): void {
    const pictured = photographs.some(({ picture }) => picture);
    this.#cloud = cloud;
    this.#edits = setup.edits;
    this.#undo.clear();
    this.#tellUndo();
    this.#clearSurface();
    this.#ui.adopt(cloud, photographs, example, name);
    this.#ui.setup.show(setup);
    this.#showEdits();
    const color = (linked?.color ??
      example?.color ??
      (pictured || cloud.colors ? 'own' : 'plain')) as CloudViewOptions['color'];
    this.#ui.options.set({ color, points: true, constraints: false, ...(isCloudPreset(example) && example.view) });
    this.#ui.photos.choose(photoFor(example, linked?.photo));
  }

  #openVariant(preset: CloudPreset, { name, params, maxPoints }: CloudVariant): void {
    const choice = { ...this.#ui.setup.value, maxPoints: maxPoints ?? preset.maxPoints };
    void this.#change({ choice, params: { ...this.#defaults, ...preset.params, ...params } }, `figure ${name}`);
  }

  async #restartEngine(): Promise<void> {
    this.#client.restart({ code: 'internal', message: 'the engine was started again' });
    await this.#client.request('hello', undefined);
    this.#engineBroken = false;
  }

  // ── changing ──────────────────────────────────────────────────────────────────────────────────

  get #settings(): Settings {
    return { choice: this.#ui.setup.value, params: this.#params, edits: this.#edits };
  }

  /** A new model with other settings; the surface stays until the new one is there. When it is refused, all stays. */
  async #change(changed: Partial<Settings>, label: string): Promise<boolean> {
    if (!this.#cloud || this.#engineBroken || this.#state.value === 'loading') return false;
    const before = this.#settings;
    const done = await this.#apply({ ...before, ...changed });
    if (done) this.#remember(before, label);
    return done;
  }

  async #apply(settings: Settings): Promise<boolean> {
    const { choice, params, edits } = settings;
    this.#ui.banner.hide();
    try {
      const ready = await this.#client.request('rebuild', { ...choice, params, edits });
      this.#edits = edits;
      this.#ui.setup.show(choice);
      this.#showEdits();
      this.#history.clear();
      this.#showParams(ready.params);
      await this.#play();
      return true;
    } catch (error) {
      this.#ui.setup.show(this.#settings.choice);
      this.#fail('That cannot be.', error);
      return false;
    }
  }

  /** Live: the run goes on, or is taken up again, with the new value. */
  async #setParam(name: string, value: unknown): Promise<void> {
    if (!this.#cloud) return;
    const before = this.#settings;
    try {
      const params = await this.#client.request('setParams', { [name]: value });
      this.#remember(before, `change of ${name}`, name);
      this.#showParams(params);
      if (this.#modelState === 'done') {
        this.#history.clear();
        this.#ask(this.#play());
      }
    } catch (error) {
      const { code, message } = toFailure(error);
      this.#ui.refuseParam(name, message, this.#params);
      if (code === 'internal') this.#fail('That did not work.', error);
    }
  }

  #remember(state: Settings, label: string, together = ''): void {
    const now = performance.now();
    const isOne = together !== '' && together === this.#lastChange.together && now - this.#lastChange.at < TOGETHER;
    this.#lastChange = { together, at: now };
    if (!isOne) this.#undo.push({ label, bytes: sizeOf(state), state });
    this.#tellUndo();
  }

  async #travel(way: 'undo' | 'redo'): Promise<void> {
    if (!this.#cloud || this.#engineBroken || this.#state.value === 'loading') return;
    const state = this.#settings;
    const back = this.#undo[way]({ bytes: sizeOf(state), state });
    this.#lastChange.together = '';
    this.#tellUndo();
    if (back) await this.#apply(back);
  }

  #tellUndo(): void {
    this.#ui.transport.showUndo(this.#undo.undoable, this.#undo.redoable);
  }

  #pick(hit: Hit): void {
    const { tool, distance } = this.#ui.tools;
    if (!this.#cloud || this.#state.value === 'loading') return;
    const edits = editedBy(tool, hit, distance * this.#ui.view.size, this.#edits, this.#cloud.points);
    if (edits) void this.#change({ edits }, 'points by hand');
    else if (tool === 'remove') this.#ui.status.say('No point is so near to that place.');
  }

  #showEdits(): void {
    this.#ui.tools.show(this.#edits);
    if (this.#cloud)
      this.#ui.view.showPoints(
        shownPoints(this.#cloud.points, this.#edits),
        shownColors(this.#cloud.colors, this.#edits),
      );
  }

  #showParams(params: ParamValues): void {
    this.#params = params;
    const example = this.#source?.example;
    const preset = isCloudPreset(example) ? example : undefined;
    const variant = preset && variantInForce(preset, params, this.#ui.setup.value.maxPoints);
    this.#ui.showParams(params, preset, variant);
    this.#updateAddress();
  }

  #setOptions(options: CloudViewOptions): void {
    const { color } = options;
    const shade = color === 'mean curvature' || color === 'distance' ? color : undefined;
    if (shade !== this.#shade) this.#ask(this.#client.request('shade', shade));
    this.#shade = shade;
    this.#updateAddress();
  }

  // ── running ───────────────────────────────────────────────────────────────────────────────────

  async #play(): Promise<void> {
    await this.#client.request('play', undefined);
  }

  #toggle(): void {
    const running = this.#state.value === 'running';
    if (!running && !this.#canRun()) return;
    this.#ui.banner.hide();
    this.#ask(running ? this.#client.request('pause', undefined) : this.#play());
  }

  #step(steps: number): void {
    if (!this.#canRun()) return;
    this.#ui.banner.hide();
    this.#ask(this.#client.request('step', { count: steps }));
  }

  /** Starts over, with nothing on the screen but the points. */
  async #reset(): Promise<void> {
    if (!this.#cloud || this.#state.value === 'loading') return;
    if (this.#engineBroken && this.#source) return this.#open(this.#source);
    this.#enterLoading('Starting over.');
    try {
      const { choice, params, edits } = this.#settings;
      this.#showParams((await this.#client.request('rebuild', { ...choice, params, edits })).params);
      this.#clearSurface();
      this.#state.value = 'paused';
      this.#ui.status.say('Ready to start.');
    } catch (error) {
      this.#fail('The model could not be built.', error);
    }
  }

  #clearSurface(): void {
    this.#whole = false;
    this.#surface = undefined;
    this.#history.clear();
    this.#ui.clearSurface();
    this.#showHistory();
  }

  #canRun(): boolean {
    return this.#cloud !== undefined && !this.#engineBroken && this.#modelState === 'paused';
  }

  /** The state beneath an error that is being shown. */
  get #modelState(): LabState {
    return this.#state.value === 'error' ? this.#calm : this.#state.value;
  }

  #ask(request: Promise<unknown>): void {
    request.catch((error) => this.#fail('That did not work.', error));
  }

  // ── what the worker tells ─────────────────────────────────────────────────────────────────────

  #onEvent(event: WorkerEvent): void {
    switch (event.event) {
      case 'progress':
        this.#history.add(event.reports);
        this.#showHistory();
        break;
      case 'surface':
        this.#onSurface(event);
        break;
      case 'constraints':
        this.#ui.view.showConstraints(event.surface, event.exterior);
        break;
      case 'measured':
        this.#onMeasured(event);
        break;
      case 'timed':
        this.#ui.timing.tell(event.timing);
        break;
      case 'state':
        this.#enter(event.state);
        break;
      case 'failure':
        this.#fail('The run has stopped.', new RequestError(event.failure));
    }
  }

  /** Shows a surface at the next animation frame; only then the worker may send another. */
  #onSurface(event: SurfaceEvent): void {
    if (event.preview && this.#whole) {
      this.#client.shown();
      return;
    }
    this.#surface = event;
    this.#whole = !event.preview;
    this.#framePending ||= requestAnimationFrame(() => {
      this.#framePending = 0;
      if (this.#surface) this.#ui.view.showSurface(this.#surface.surface);
      this.#surface = undefined;
      this.#client.shown();
    });
  }

  #onMeasured({ measures, fit }: MeasuredEvent): void {
    if (measures) this.#ui.measures.showMeasures(measures);
    this.#ui.measures.showMore(fitValues(fit));
    this.#ui.warning.textContent = fit.warning ?? '';
  }

  #showHistory(): void {
    const last = this.#history.reports.at(-1);
    this.#ui.transport.showReport(last && { ...last, progress: overallProgress(last) });
    this.#ui.phases.update(this.#history, this.#state.value === 'running');
    this.#ui.plots.update();
    this.#ui.csv.disabled = this.#history.reports.length === 0;
  }

  // ── states ────────────────────────────────────────────────────────────────────────────────────

  #enterLoading(text: string): void {
    this.#ui.banner.hide();
    this.#state.value = 'loading';
    this.#ui.status.say(text);
  }

  #enter(state: 'running' | 'paused' | 'done'): void {
    if (this.#state.value === 'loading' && state !== 'running') {
      this.#calm = state;
      return;
    }
    this.#state.value = state;
    this.#showHistory();
    this.#ui.status.say(this.#describe(state));
    if (state === 'done' && this.#history.reports.at(-1)?.vertices === 0) this.#showNothing();
  }

  /** What was shown belongs to other settings. */
  #showNothing(): void {
    this.#whole = false;
    this.#ui.clearSurface();
    this.#ui.banner.show(
      'There is no surface.',
      'f is below 0 everywhere: try a smaller λs, a smaller δ, or the level “mean”.',
    );
  }

  #describe(state: LabState): string {
    const last = this.#history.reports.at(-1);
    if (state === 'running') return 'Running.';
    if (!last) return 'Ready to start.';
    if (state !== 'done') return `Paused at iteration ${count(last.iteration)}, in the phase ${last.phase}.`;
    if (last.vertices === 0) return 'Done, but there is no surface: f is nowhere 0.';
    return `Done: ${count(last.vertices)} vertices in ${plural(last.components, 'component')}, residual ${figure(last.residual)}.`;
  }

  #showState(state: LabState): void {
    this.#root.dataset.state = state;
    if (state === 'paused' || state === 'done') this.#calm = state;
    this.#ui.showState(this.#modelState, this.#cloud !== undefined, state !== 'loading' && this.#whole);
  }

  #fail(title: string, error: unknown): void {
    if (this.#closing.signal.aborted) return;
    const failure = toFailure(error);
    if (failure.code === 'internal') this.#engineBroken = true;
    const hint =
      failure.code === 'internal' && this.#cloud
        ? 'What you see is the last result; Reset starts the engine again. It said: '
        : '';
    this.#ui.banner.show(title, hint + failure.message);
    this.#ui.status.say('');
    if (this.#state.value === 'running') this.#calm = 'paused';
    this.#state.value = 'error';
  }

  #dismiss(): void {
    this.#ui.banner.hide();
    if (this.#state.value !== 'error' || !this.#cloud) return;
    this.#state.value = this.#calm;
    this.#ui.status.say(this.#describe(this.#calm));
  }

  // ── address, saving, passing on ───────────────────────────────────────────────────────────────

  #updateAddress(): void {
    if (!this.#source || (this.#state.value === 'loading' && !this.#cloud)) return;
    const { example, name } = this.#source;
    const linked = linkOf({
      example,
      file: name,
      choice: this.#ui.setup.value,
      params: this.#params,
      defaults: this.#defaults,
      edits: this.#edits,
      color: this.#ui.options.value.color,
      photo: this.#ui.photos.chosen,
    });
    const hash = toHash(linked);
    if (hash !== (location.hash || ADDRESS)) window.history.replaceState(null, '', hash);
  }

  async #copyLink(): Promise<void> {
    this.#updateAddress();
    const lacks = [
      ...(this.#source?.example ? [] : ['Your file is not in it: whoever opens it needs the file too.']),
      ...(fits(this.#edits) ? [] : ['So many points by hand are not in it.']),
    ];
    try {
      await navigator.clipboard.writeText(location.href);
      this.#ui.status.say(['Link copied.', ...lacks].join(' '));
    } catch {
      this.#ui.status.say(['The link is in the address bar.', ...lacks].join(' '));
    }
  }

  #tryTo(title: string, work: () => Promise<void>): void {
    work().catch((error) => this.#fail(title, error));
  }

  async #saveVolume(): Promise<void> {
    const { bytes } = await this.#client.request('volume', { size: VOLUME_SIZE });
    this.#ui.saving.bytes('nii', bytes, 'application/octet-stream');
  }

  /** The function as a volume that the deformable model follows: inside is above the level. */
  async #toExtract(): Promise<void> {
    this.#ui.status.say('Making a volume.');
    const { bytes, level } = await this.#client.request('volume', { size: VOLUME_SIZE });
    this.#passOn({ name: `${this.#ui.saving.name} (volume)`, bytes, params: { iso: level, isoForce: -1 } });
  }
}

function variantOf(example: CloudExample): CloudVariant | undefined {
  return isCloudPreset(example) ? example.variants[0] : undefined;
}

function sizeOf({ edits: { added, removed, outside } }: Settings): number {
  return 100 + 8 * (3 * added.length + removed.length + 3 * outside.length);
}
