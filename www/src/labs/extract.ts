import { Client, RequestError, toFailure } from '../client';
import { EXAMPLES, type Example, exampleUrl, type Unit } from '../examples';
import { GUIDES } from '../guides';
import { exampleById, isPreset, PRESETS, type Preset, startOf, type Variant, variantOf } from '../presets';
import type {
  MeshFormat,
  ParamValues,
  Plane,
  Ready,
  SavedRun,
  Setup,
  Shade,
  SnapshotEvent,
  StartShape,
  StepReport,
  SurfaceBuffers,
  VolumeSource,
  VolumeView,
  WorkerEvent,
} from '../protocol';
import { type LabState, Observable } from '../state';
import { ComparePanel } from '../ui/compare';
import { h } from '../ui/dom';
import { EXTRACT_EXERCISES, exercises } from '../ui/exercises';
import { ExportButtons } from '../ui/exports';
import { FigurePanel } from '../ui/figure';
import { acceptDrops, fileChooser, nameOf, readFiles } from '../ui/files';
import { count, plural } from '../ui/format';
import { Histogram } from '../ui/histogram';
import { History, underWay } from '../ui/history';
import { EventLog } from '../ui/log';
import { MeasurePanel } from '../ui/measures';
import { ParamControls } from '../ui/params';
import { ENERGY_PLOTS, Plots } from '../ui/plots';
import { PyramidPanel } from '../ui/pyramid';
import { offerShortcuts, type Shortcut } from '../ui/shortcuts';
import { type StartChoice, StartControls } from '../ui/start';
import { ErrorBanner, StatusLine } from '../ui/status';
import { TimeTable } from '../ui/times';
import { Transport } from '../ui/transport';
import { ViewOptionControls, type ViewOptions } from '../ui/view-options';
import { Stage } from '../view/stage';
import { showAddress } from './address';
import { Attracting } from './attracting';
import { fetchAhead, fetchBytes } from './downloads';
import { DataPanel, folded, layOut } from './extract-page';
import type { PassedOn, PassOn } from './labs';
import { ADDRESS, fromHash, type Linked, linkOf, toHash, withLink } from './link';
import { type Moment, type PageState, Rewinder } from './rewinder';
import { Saving } from './saving';

const INITIAL_VIEW: ViewOptions = { surface: true, edges: false, color: 'plain', slices: 'walls' };
/** Radius of the sphere placed at the crosshair, as a part of the volume's smallest side. */
const SPHERE_PART = 0.1;
/** Reach of a new attractor in the same measure. */
const ATTRACTOR_PART = 0.15;

const VANISHED =
  'It found nothing to hold it: try fewer pyramid levels (thin parts blur away on coarse ones), another iso value or start shape, or less rigidity.';

const BROKEN = 'The engine has stopped; Reset starts it again.';

/** What the present volume was made of, to open it again after a failure of the engine. */
interface Source {
  name: string;
  volume: () => Promise<VolumeSource>;
  example?: Example;
  /** What a link asks for beyond the example. */
  linked?: Linked;
  /** Of lengths, where no example says. */
  unit?: Unit;
}

/** The Extract lab: a deformable surface grows onto a volume. */
export class ExtractLab {
  readonly #root: HTMLElement;
  readonly #state = new Observable<LabState>('loading');
  /** Takes every listener of the page back when the lab is closed. */
  readonly #closing = new AbortController();
  readonly #client = new Client((event) => this.#onEvent(event));
  readonly #history = new History();
  readonly #status = new StatusLine();
  readonly #banner = new ErrorBanner(() => this.#dismiss());
  readonly #canvas = h('canvas', {
    tabindex: 0,
    role: 'application',
    'aria-label':
      '3D view of the surface and the slices. Arrow keys turn it, plus and minus zoom; while attractors are placed, Enter is a click in its middle.',
  });
  readonly #slices = h('div', { class: 'slices' });
  readonly #drop = h('div', { class: 'drop', hidden: true }, 'Drop a volume to open it');
  readonly #stage = new Stage(this.#canvas, this.#slices, INITIAL_VIEW, (planes) => this.#setPlanes(planes));
  readonly #histogram = new Histogram((iso) => this.#setParam('iso', iso));
  readonly #start = new StartControls(() => void this.#restart());
  readonly #options = new ViewOptionControls(INITIAL_VIEW, (options) => this.#setView(options));
  readonly #pyramid = new PyramidPanel(
    (level) => this.#stage.thumbnail(level),
    (level) => this.#stage.showLevel(level),
  );
  readonly #attracting = new Attracting(this.#client, this.#stage, () => this.#rewinder, {
    ready: () => this.#volume !== undefined && !this.#engineBroken,
    onTaken: () => {
      this.#updateAddress();
      this.#goOn();
    },
    onPlacing: (placing) => this.#setPlacing(placing),
  });
  readonly #saving = new Saving(
    (format) => this.#client.request('export', { format }),
    (text) => this.#status.say(text),
  );
  readonly #figure = new FigurePanel<Variant, Preset>((preset, variant) => void this.#openVariant(preset, variant));
  readonly #compare = new ComparePanel({
    onStart: () => void this.#runComparison(),
    onCancel: () => this.#ask(this.#client.request('cancelCompare', undefined)),
  });
  readonly #compareHolder = folded('Direct against coarse to fine', this.#compare.element);
  readonly #csv = h(
    'button',
    { type: 'button', onclick: () => this.#saving.plots(this.#history), disabled: true },
    'Plot data (CSV)',
  );
  readonly #rewinder = new Rewinder<PageState, SavedRun>(
    this.#client,
    () => this.#pageState(),
    (undoable, redoable) => this.#transport.showUndo(undoable, redoable),
  );
  readonly #paramsHolder = h('div');
  readonly #measures = new MeasurePanel();
  readonly #sculpt = h(
    'button',
    { type: 'button', class: 'wide', 'data-action': 'sculpt', onclick: () => void this.#toSculpt() },
    'Open in Sculpt',
  );
  readonly #exports = new ExportButtons((format, type) => void this.#export(format, type));
  readonly #plots = new Plots(this.#history, ENERGY_PLOTS, true);
  readonly #times = new TimeTable();
  readonly #log = new EventLog();
  readonly #transport = new Transport({
    onToggle: () => this.#toggle(),
    onStep: (steps) => this.#step(steps),
    onReset: () => void this.#reset(),
    onUndo: () => void this.#travel('undo'),
    onRedo: () => void this.#travel('redo'),
  });
  readonly #data: DataPanel;
  readonly #shortcuts: Shortcut[] = [
    { key: ' ', shown: 'Space', text: 'play or pause', act: () => this.#toggle() },
    { key: 's', shown: 's', text: 'one step', act: () => this.#step(1) },
    { key: 'd', shown: 'd', text: 'ten steps', act: () => this.#step(10) },
    { key: 'r', shown: 'r', text: 'reset', act: () => void this.#reset() },
    {
      key: 'a',
      shown: 'a',
      text: 'attractor at the crosshair',
      act: () => this.#attracting.add(this.#stage.crosshair),
    },
    { key: 'z', ctrl: true, shown: 'Ctrl Z', text: 'undo', act: () => void this.#travel('undo') },
    {
      key: 'shift+z',
      ctrl: true,
      shown: 'Ctrl ⇧ Z',
      text: 'redo',
      act: () => void this.#travel('redo'),
    },
    { key: 'y', ctrl: true, shown: 'Ctrl Y', text: 'redo', act: () => void this.#travel('redo') },
  ];
  #paramControls: ParamControls | undefined;
  /** The defaults of the parameters that have one. */
  #defaults: ParamValues = {};
  /** The parameters in force; they outlive a reset. */
  #params: ParamValues = {};
  #volume: VolumeView | undefined;
  #source: Source | undefined;
  /** What the surface's vertices are asked for. */
  #shade: Shade | undefined;
  /** Settled when all that the model was to be changed by is. */
  #changes: Promise<void> = Promise.resolve();
  /** The level the model is on. */
  #level = 0;
  /** A link to a file of the user's, until the file is opened. */
  #awaiting: Linked | undefined;
  /** Counts what was asked to be opened, so that a slow download does not replace what came after it. */
  #turn = 0;
  /** The state to return to when an error has been read. */
  #calm: 'loading' | 'paused' | 'done' = 'loading';
  #engineBroken = false;
  /** The newest, until it is shown. */
  #snapshot: SnapshotEvent | undefined;
  /** The surface on the screen, in the worker's buffers. */
  #shown: SurfaceBuffers | undefined;
  #framePending = 0;
  readonly #passOn: PassOn;

  constructor(root: HTMLElement, help: HTMLElement, passOn: PassOn) {
    this.#root = root;
    this.#passOn = passOn;
    const chooser = fileChooser((files) => void this.#openFiles(files));
    this.#data = new DataPanel(EXAMPLES, PRESETS, chooser, (example) => void this.#openExample(example));
    this.#stage.onMoved = () => this.#pyramid.redraw();
    this.#layOut(chooser);
    this.#state.follow((state) => this.#showState(state));
    const { signal } = this.#closing;
    acceptDrops(this.#drop, (files) => void this.#openFiles(files), signal);
    offerShortcuts(this.#shortcuts, help, GUIDES.extract, signal);
  }

  /** Gives everything back: the lab is not used again. */
  close(): void {
    this.#closing.abort();
    // What is still being downloaded finds that something else was asked for.
    this.#turn += 1;
    this.#client.close();
    cancelAnimationFrame(this.#framePending);
    this.#stage.dispose();
    this.#root.replaceChildren();
  }

  /** Opens what another lab passes on, or what the address says, or else the built-in example, and runs it. */
  async start(passedOn?: PassedOn): Promise<void> {
    if (!passedOn) fetchLinked();
    try {
      await this.#greet();
    } catch (error) {
      this.#fail('Vesicle could not start.', error);
      return;
    }
    const { signal } = this.#closing;
    if (signal.aborted) return;
    window.addEventListener('hashchange', () => void this.#openLink(), { signal });
    if (passedOn) await this.#openPassedOn(passedOn);
    else await this.#openLink(EXAMPLES[0]);
  }

  #layOut(chooser: HTMLElement): void {
    layOut(this.#root, {
      chooser,
      data: this.#data,
      histogram: this.#histogram.element,
      start: this.#start.element,
      params: this.#paramsHolder,
      transport: this.#transport.element,
      figure: this.#figure.element,
      pyramid: this.#pyramid.element,
      attractors: this.#attracting.element,
      options: this.#options.element,
      legend: this.#stage.legend.element,
      banner: this.#banner.element,
      status: this.#status.element,
      canvas: this.#canvas,
      slices: this.#slices,
      drop: this.#drop,
      measures: this.#measures.element,
      exports: this.#exports.element,
      sculpt: this.#sculpt,
      link: h(
        'button',
        { type: 'button', class: 'wide', onclick: () => void this.#copyLink() },
        'Copy link to these settings',
      ),
      plots: this.#plots.element,
      csv: this.#csv,
      times: this.#times.element,
      log: this.#log.element,
      compare: this.#compareHolder,
      exercises: exercises(EXTRACT_EXERCISES, (id) => this.#openById(id)),
    });
  }

  async #greet(): Promise<void> {
    const { specs } = await this.#client.request('hello', undefined);
    if (this.#paramControls) return;
    this.#defaults = Object.fromEntries(
      specs.flatMap(({ name, default: value }) => (name === 'iso' ? [] : [[name, value]])),
    );
    this.#paramControls = new ParamControls(specs, ['iso'], (name, value) => this.#setParam(name, value));
    this.#paramsHolder.replaceWith(this.#paramControls.element);
  }

  // ── opening ───────────────────────────────────────────────────────────────────────────────────

  #openExample(example: Example, linked?: Linked): Promise<void> {
    const { source } = example;
    const more = { example, ...(linked && { linked }) };
    if ('shape' in source) return this.#open({ name: source.shape, volume: async () => source, ...more });
    const { file } = source;
    const volume = async () => ({ files: [{ name: file, bytes: await fetchBytes(exampleUrl(file)) }] });
    return this.#open({ name: file, volume, ...more });
  }

  #openFiles(files: File[]): Promise<void> {
    const name = nameOf(files);
    const linked = this.#awaiting;
    return this.#open({ name, volume: async () => ({ files: await readFiles(files) }), ...(linked && { linked }) });
  }

  #openPassedOn({ name, bytes, params }: PassedOn): Promise<void> {
    const linked = { params, attractors: [] };
    return this.#open({ name, volume: async () => ({ files: [{ name, bytes: bytes.slice() }] }), linked, unit: '' });
  }

  #openById(id: string): void {
    const example = exampleById(id);
    if (example) void this.#openExample(example);
  }

  /** Opens what the page's address asks for; says why where that cannot be. `otherwise` is opened then. */
  async #openLink(otherwise?: Example): Promise<void> {
    const linked = fromHash(location.hash);
    const id = linked?.example ?? (linked && !linked.file ? EXAMPLES[0]?.id : '');
    const example = exampleById(id ?? '');
    if (linked && example) return this.#openExample(example, linked);
    if (otherwise) await this.#openExample(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#banner.show('This link needs a file.', `Open ${linked.file} from your disk: its settings will follow.`);
    else this.#banner.show('This link cannot be followed.', `There is no example “${linked.example ?? ''}”.`);
  }

  /** Another picture of the figure that is open: other parameters, from the same start or from where the surface is. */
  async #openVariant(preset: Preset, variant: Variant): Promise<void> {
    if (!this.#volume || this.#state.value === 'loading' || this.#engineBroken) return;
    await this.#inTurn(() => this.#changeTo(preset, variant));
  }

  async #changeTo(preset: Preset, variant: Variant): Promise<void> {
    const params = { ...preset.params, ...variant.params };
    const forget = this.#rewinder.remember(`figure ${variant.id}`);
    try {
      if (preset.startsOver) {
        this.#enterLoading('Starting over.');
        this.#adoptModel(await this.#client.request('rebuild', this.#setup(this.#start.value, params)));
      } else {
        this.#showParams(await this.#client.request('setParams', params));
      }
      await this.#play();
    } catch (error) {
      forget();
      this.#fail('That did not work.', error);
    }
  }

  /** Opens a volume and runs the model on it. What is asked for last counts. When it fails, everything stays as it was. */
  async #open(source: Source): Promise<void> {
    const turn = ++this.#turn;
    this.#enterLoading(`Opening ${source.name}.`);
    try {
      if (this.#engineBroken) await this.#restartEngine();
      const choice = this.#startFor(source);
      const volume = await source.volume();
      if (turn !== this.#turn) return;
      await this.#inTurn(() => this.#load(source, volume, choice));
    } catch (error) {
      if (turn !== this.#turn) return;
      this.#data.choose(this.#source?.example);
      this.#fail(`${source.name} could not be opened.`, error);
    }
  }

  async #load(source: Source, volume: VolumeSource, choice: StartChoice): Promise<void> {
    // What was under way may have ended with the model ready to run.
    if (this.#state.value !== 'loading') this.#enterLoading(`Opening ${source.name}.`);
    const body = { name: source.name, source: volume, setup: this.#setupFor(source, choice) };
    const loaded = await this.#client.request('load', body, transferable(body.source));
    this.#source = source;
    this.#awaiting = undefined;
    this.#start.show(choice);
    this.#rewinder.clear();
    this.#compare.clear();
    this.#adoptVolume(loaded.volume, source);
    this.#attracting.show(body.setup.attractors);
    this.#attracting.radius = ATTRACTOR_PART * this.#smallestSide();
    if (source.linked?.color) this.#options.color = source.linked.color;
    this.#adoptModel(loaded);
    this.#rewinder.remember('Play');
    await this.#play();
  }

  /** One change after the other; what was asked on the volume before is not done to this one. */
  #inTurn(work: () => Promise<void>): Promise<void> {
    const turn = this.#turn;
    const done = this.#changes.then(() => (turn === this.#turn ? work() : undefined));
    this.#changes = done.catch(() => undefined);
    return done;
  }

  #adoptVolume(volume: VolumeView, { example, unit = 'mm' }: Source): void {
    this.#volume = volume;
    this.#saving.name = volume.name;
    this.#measures.unit = example?.unit ?? unit;
    this.#stage.unit = example?.unit ?? unit;
    this.#histogram.setVolume(volume);
    this.#data.show(volume, example);
    this.#stage.setVolume(volume);
    if (isPreset(example) && example.compares) this.#compareHolder.open = true;
  }

  /** Asks for the coarser copies the model works on, to show them. */
  async #showPyramid(): Promise<void> {
    const turn = this.#turn;
    const volume = this.#volume;
    const { levels } = this.#start.value;
    try {
      const coarser = await this.#client.request('pyramid', { levels });
      if (volume && turn === this.#turn && levels === this.#start.value.levels)
        this.#pyramid.setLevels(volume.dims, coarser, this.#level);
    } catch (error) {
      this.#fail('The pyramid cannot be shown.', error);
    }
  }

  #adoptModel({ params }: Ready): void {
    this.#showParams(params);
    this.#history.clear();
    this.#log.clear();
    this.#transport.showReport(undefined);
    this.#showHistory();
    this.#state.value = 'paused';
    void this.#showPyramid();
    this.#updateAddress();
  }

  /** Starts the model over, with the parameters as they are. */
  async #reset(): Promise<void> {
    if (!this.#volume || this.#state.value === 'loading') return;
    if (this.#engineBroken && this.#source) return this.#recover(this.#source);
    await this.#inTurn(() => this.#startOver());
  }

  async #startOver(): Promise<void> {
    const forget = this.#rewinder.remember('Reset');
    this.#enterLoading('Starting over.');
    try {
      this.#adoptModel(await this.#client.request('rebuild', this.#setup(this.#start.value, this.#params)));
      this.#status.say('Ready to start.');
    } catch (error) {
      forget();
      this.#fail('The model could not be built.', error);
    }
  }

  /** Starts over from another start and plays. When that start is refused, the model that was there goes on. */
  async #restart(): Promise<void> {
    if (!this.#volume || this.#state.value === 'loading') return this.#start.refuse('Not while a volume is opened.');
    if (this.#engineBroken) return this.#start.refuse(BROKEN);
    await this.#inTurn(() => this.#startFrom(this.#start.value));
  }

  async #startFrom(choice: StartChoice): Promise<void> {
    const running = this.#state.value === 'running';
    const forget = this.#rewinder.remember('another start');
    this.#enterLoading('Starting over.');
    try {
      const ready = await this.#client.request('rebuild', this.#setup(choice, this.#params));
      this.#start.show(choice);
      this.#adoptModel(ready);
      await this.#play();
    } catch (error) {
      forget();
      const failure = toFailure(error);
      this.#start.refuse(failure.message);
      if (failure.code === 'internal') return this.#fail('The model could not be built.', error);
      this.#calmDown();
      if (running) this.#ask(this.#play());
    }
  }

  #setup(choice: StartChoice, params: ParamValues, attractors = this.#attracting.inForce): Setup {
    const { levels, edge } = choice;
    return { start: this.#startShape(choice), levels, edge, params, attractors };
  }

  /** What suits an example; for a file, the settings as they are, except the iso value, which no other volume shares. */
  #setupFor({ example, linked }: Source, choice: StartChoice): Setup {
    const { iso: _, ...params } = this.#params;
    const setup = this.#setup(choice, { ...(example?.params ?? params), ...linked?.params }, linked?.attractors ?? []);
    if (linked?.sphere && choice.kind === 'sphere') setup.start = { kind: 'sphere', ...linked.sphere };
    return setup;
  }

  /** What suits an example; for a file, the start as it is, except lengths and places of another volume's world. */
  #startFor({ example, linked }: Source): StartChoice {
    const choice = this.#start.value;
    const suits: StartChoice = example
      ? { ...choice, ...startOf(example), levels: example.levels, edge: example.edge }
      : { ...choice, kind: choice.kind === 'sphere' ? 'enclosing' : choice.kind, edge: undefined };
    return linked ? withLink(suits, linked) : suits;
  }

  #startShape({ kind, bubbles }: StartChoice): StartShape {
    switch (kind) {
      case 'bubbles':
        return { kind, count: bubbles };
      case 'sphere':
        return { kind, center: this.#stage.crosshair, radius: this.#sphereRadius() };
      default:
        return { kind };
    }
  }

  #sphereRadius(): number {
    return SPHERE_PART * this.#smallestSide();
  }

  /** Of the volume, in world units. */
  #smallestSide(): number {
    const { dims = [1, 1, 1], spacing = [1, 1, 1] } = this.#volume ?? {};
    return Math.min(...dims.map((n, axis) => n * (spacing[axis] ?? 1)));
  }

  async #restartEngine(): Promise<void> {
    this.#client.restart({ code: 'internal', message: 'the engine was started again' });
    // The new one has buffers of its own.
    this.#shown = undefined;
    await this.#greet();
    this.#engineBroken = false;
    await this.#client.request('shade', this.#shade);
  }

  /** Another engine, with the volume and the settings as they were, in the last state that was kept. */
  async #recover(source: Source): Promise<void> {
    const turn = ++this.#turn;
    this.#enterLoading('Starting the engine again.');
    try {
      await this.#restartEngine();
      const volume = await source.volume();
      if (turn !== this.#turn) return;
      const setup = this.#setup(this.#start.inForce, this.#params);
      const ready = await this.#client.request(
        'load',
        { name: source.name, source: volume, setup },
        transferable(volume),
      );
      // The new engine does not know the slices yet.
      this.#stage.goTo(this.#stage.crosshair);
      const { last } = this.#rewinder;
      if (last) await this.#client.request('restore', last.saved);
      if (last) this.#adoptMoment(last);
      else this.#adoptModel(ready);
      this.#status.say(
        `Started again ${last ? `from iteration ${count(last.saved.iteration)}` : 'from the beginning'}.`,
      );
    } catch (error) {
      if (turn === this.#turn) this.#fail('The engine could not be started again.', error);
    }
  }

  // ── running ───────────────────────────────────────────────────────────────────────────────────

  async #play(): Promise<void> {
    await this.#client.request('play', undefined);
  }

  #toggle(): void {
    const running = this.#state.value === 'running';
    if (!running && !this.#canRun()) return;
    this.#banner.hide();
    if (!running) this.#rewinder.remember('Play');
    this.#ask(running ? this.#client.request('pause', undefined) : this.#play());
  }

  #step(steps: number): void {
    if (!this.#canRun()) return;
    this.#banner.hide();
    this.#rewinder.remember(plural(steps, 'step'));
    this.#ask(this.#client.request('step', { count: steps }));
  }

  /** Whether a model stands still and has further to go. */
  #canRun(): boolean {
    return this.#volume !== undefined && !this.#engineBroken && this.#modelState === 'paused';
  }

  /** The state beneath an error that is being shown. */
  get #modelState(): LabState {
    return this.#state.value === 'error' ? this.#calm : this.#state.value;
  }

  #ask(request: Promise<unknown>): void {
    request.catch((error) => this.#fail('That did not work.', error));
  }

  #setPlanes(planes: Plane[]): void {
    if (!this.#engineBroken) this.#ask(this.#client.request('planes', planes));
  }

  async #setParam(name: string, value: unknown): Promise<void> {
    if (!this.#volume) return;
    const forget = this.#rewinder.remember(`change of ${this.#paramControls?.labelOf(name) ?? name}`, name);
    try {
      this.#showParams(await this.#client.request('setParams', { [name]: value }));
      this.#goOn();
    } catch (error) {
      forget();
      this.#refuseParam(name, error);
    }
  }

  #refuseParam(name: string, error: unknown): void {
    const { code, message: reason } = toFailure(error);
    if (code === 'internal' && !this.#engineBroken) this.#fail('That did not work.', error);
    const message = this.#engineBroken ? BROKEN : reason;
    this.#showParams(this.#params);
    if (name === 'iso') this.#histogram.complain(message);
    else this.#paramControls?.complain(name, message);
  }

  #showParams(params: ParamValues): void {
    this.#params = params;
    this.#paramControls?.show(params);
    if (typeof params.iso === 'number') this.#histogram.setIso(params.iso);
    const example = this.#source?.example;
    if (isPreset(example)) this.#figure.show(example, variantOf(example, params));
    else this.#figure.show(undefined);
    this.#updateAddress();
  }

  /** A model that had settled has further to go under other forces. */
  #goOn(): void {
    if (this.#modelState === 'done') this.#ask(this.#play());
  }

  // ── attractors, colours, comparison ───────────────────────────────────────────────────────────

  #setPlacing(placing: boolean): void {
    this.#root.toggleAttribute('data-placing', placing);
    this.#status.say(placing ? 'Click in a slice or on the surface to place attractors.' : '');
  }

  #setView(options: ViewOptions): void {
    this.#stage.setOptions(options);
    const { color } = options;
    const shade = color === 'plain' || color === 'component' ? undefined : color;
    if (shade !== this.#shade) this.#ask(this.#client.request('shade', shade));
    this.#shade = shade;
    this.#updateAddress();
  }

  async #runComparison(): Promise<void> {
    if (!this.#volume || this.#engineBroken || this.#state.value === 'loading') return;
    const { levels } = this.#start.value;
    if (levels === 0) return this.#compare.refuse('Choose one pyramid level or more under Start first.');
    this.#compare.begin();
    try {
      const setup = this.#setup(this.#start.value, this.#params, []);
      this.#compare.finish(await this.#client.request('compare', setup));
    } catch (error) {
      this.#compare.refuse(`The comparison stopped: ${toFailure(error).message}`);
    }
  }

  // ── back and forth ────────────────────────────────────────────────────────────────────────────

  #pageState(): PageState {
    const mark = this.#history.marker();
    return { choice: this.#start.inForce, params: this.#params, attractors: this.#attracting.inForce, mark };
  }

  #travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#inTurn(() => this.#travelOnce(way));
  }

  async #travelOnce(way: 'undo' | 'redo'): Promise<void> {
    if (!this.#volume || this.#engineBroken || this.#state.value === 'loading') return;
    this.#calm = this.#modelState === 'done' ? 'done' : 'paused';
    this.#enterLoading(way === 'undo' ? 'Going back.' : 'Going forth again.');
    try {
      const moment = await this.#rewinder.travel(way);
      if (moment) this.#adoptMoment(moment);
      else this.#calmDown();
    } catch (error) {
      this.#fail('That did not work.', error);
    }
  }

  #adoptMoment({ saved, page }: Moment): void {
    this.#start.show(page.choice);
    this.#attracting.show(page.attractors);
    this.#showParams(page.params);
    this.#history.rewind(page.mark(saved.iteration));
    this.#log.clear();
    this.#transport.showReport(this.#history.reports.at(-1));
    this.#showHistory();
    this.#calm = saved.done ? 'done' : 'paused';
    this.#calmDown();
    void this.#showPyramid();
  }

  // ── the address ───────────────────────────────────────────────────────────────────────────────

  /** Keeps the page's address a link to what is open and how it is set. */
  #updateAddress(): void {
    if (!this.#source || this.#state.value === 'loading') return;
    const { example, name } = this.#source;
    const choice = this.#start.inForce;
    const hash = toHash(
      linkOf({
        example,
        file: name,
        choice,
        sphere: { center: this.#stage.crosshair, radius: this.#sphereRadius() },
        params: this.#params,
        defaults: this.#defaults,
        attractors: this.#attracting.inForce,
        color: this.#options.value.color,
      }),
    );
    // The lab without an address is this one, as it opens by itself.
    if (hash !== ADDRESS || location.hash) showAddress(hash);
  }

  async #copyLink(): Promise<void> {
    this.#updateAddress();
    try {
      await navigator.clipboard.writeText(location.href);
      this.#status.say('Link copied.');
    } catch {
      this.#status.say('The link is in the address bar.');
    }
    if (!this.#source?.example)
      this.#status.say('Link copied. Your file is not in it: whoever opens it needs the file too.');
  }

  // ── what the worker tells ─────────────────────────────────────────────────────────────────────

  #onEvent(event: WorkerEvent): void {
    switch (event.event) {
      case 'snapshot':
        this.#onSnapshot(event);
        break;
      case 'progress':
        this.#onReports(event.reports);
        break;
      case 'sections':
        this.#stage.showSections(event.sections);
        break;
      case 'state':
        this.#enter(event.state);
        break;
      case 'comparing':
        this.#compare.tell(event);
        break;
      case 'failure':
        this.#fail('The run has stopped.', new RequestError(event.failure));
    }
  }

  /** Shows a snapshot at the next animation frame; only then the worker may send another. */
  #onSnapshot(event: SnapshotEvent): void {
    this.#onReports(event.reports);
    if (this.#snapshot) this.#client.giveBack(this.#snapshot.surface);
    this.#snapshot = event;
    this.#level = event.level;
    this.#pyramid.setInUse(event.level);
    this.#showMeasures(event);
    this.#framePending ||= requestAnimationFrame(() => this.#showSnapshot());
  }

  #showSnapshot(): void {
    this.#framePending = 0;
    const snapshot = this.#snapshot;
    if (!snapshot) return;
    this.#snapshot = undefined;
    this.#stage.showSurface(snapshot.surface);
    this.#stage.showSections(snapshot.sections);
    // The one before is not drawn any more.
    if (this.#shown) this.#client.giveBack(this.#shown);
    this.#shown = snapshot.surface;
    this.#showHistory();
  }

  #onReports(reports: StepReport[]): void {
    if (!this.#history.add(reports)) return;
    this.#transport.showReport(reports.at(-1));
    if (this.#state.value === 'running') this.#status.report(() => underWay(this.#history));
  }

  #showMeasures({ measures }: SnapshotEvent): void {
    const last = this.#history.reports.at(-1);
    if (measures) this.#measures.showMeasures(measures);
    else if (last) this.#measures.showReport(last);
  }

  #showHistory(): void {
    this.#plots.update();
    this.#times.update(this.#history);
    this.#csv.disabled = this.#history.reports.length === 0;
    this.#log.update(this.#history);
  }

  // ── states ────────────────────────────────────────────────────────────────────────────────────

  #enterLoading(text: string): void {
    this.#banner.hide();
    this.#state.value = 'loading';
    this.#status.say(text);
  }

  #enter(state: 'running' | 'paused' | 'done'): void {
    // While something is being opened, the model it may replace has nothing to say.
    if (this.#state.value === 'loading') {
      this.#calm = state === 'done' ? 'done' : 'paused';
      return;
    }
    this.#state.value = state;
    const last = this.#history.reports.at(-1);
    this.#status.say(describe(state, last));
    if (last?.vertices === 0) this.#banner.show('The surface has vanished.', VANISHED);
  }

  #showState(state: LabState): void {
    this.#root.dataset.state = state;
    if (state === 'paused' || state === 'done') this.#calm = state;
    const ready = this.#volume !== undefined;
    this.#transport.showState(this.#modelState, ready);
    this.#exports.enabled = ready && state !== 'loading';
    this.#sculpt.disabled = !ready || state === 'loading';
    this.#compare.enabled = ready && state !== 'loading';
  }

  #fail(title: string, error: unknown): void {
    const failure = toFailure(error);
    if (failure.code === 'internal') this.#engineBroken = true;
    const hint =
      failure.code === 'internal' && this.#volume
        ? 'What you see is the last result; Reset starts the engine again. It said: '
        : '';
    this.#banner.show(title, hint + failure.message);
    this.#status.say('');
    this.#state.value = 'error';
  }

  #dismiss(): void {
    this.#banner.hide();
    if (this.#state.value === 'error' && this.#volume) this.#calmDown();
  }

  /** Back to what the model was before an error or a refusal, in words too. */
  #calmDown(): void {
    this.#state.value = this.#calm;
    if (this.#calm !== 'loading') this.#status.say(describe(this.#calm, this.#history.reports.at(-1)));
  }

  async #toSculpt(): Promise<void> {
    try {
      const bytes = await this.#client.request('export', { format: 'ply' });
      this.#passOn({ lab: 'sculpt', name: `${this.#saving.name} (surface)`, bytes, params: {} });
    } catch (error) {
      this.#fail('The surface could not be passed on.', error);
    }
  }

  async #export(format: MeshFormat, type: string): Promise<void> {
    try {
      await this.#saving.mesh(format, type);
    } catch (error) {
      this.#fail('The surface could not be saved.', error);
    }
  }
}

/** The volume that the address asks for comes while the engine starts. */
function fetchLinked(): void {
  const linked = fromHash(location.hash);
  const example = linked?.example ? exampleById(linked.example) : EXAMPLES[0];
  if (example && !linked?.file && 'file' in example.source) fetchAhead(exampleUrl(example.source.file));
}

function transferable(source: VolumeSource): Transferable[] {
  return 'files' in source ? source.files.map(({ bytes }) => bytes.buffer as ArrayBuffer) : [];
}

function describe(state: 'running' | 'paused' | 'done', last: StepReport | undefined): string {
  if (!last) return state === 'running' ? 'Running.' : 'Ready to start.';
  if (last.vertices === 0) return `The surface vanished at iteration ${count(last.iteration)}.`;
  const where = `${count(last.vertices)} vertices in ${plural(last.components, 'component')}`;
  if (state === 'done') return `Settled after ${count(last.iteration)} iterations: ${where}.`;
  return state === 'running' ? 'Running.' : `Paused at iteration ${count(last.iteration)}: ${where}.`;
}
