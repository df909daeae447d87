import { signal } from '@preact/signals';
import { RequestError, toFailure } from '../../engine/failure';
import { rgbOf } from '../../engine/labels';
import { release } from '../../engine/release';
import { nameOf, readFiles } from '../../importers/files';

import type { Shortcut } from '../../kit/shortcuts';
import type { LabState } from '../../kit/state';
import { initialOptions } from '../../kit/view';
import type { Lab, LabPlace } from '../../lab/lab';
import { Opening } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import { LabShell, type ShelledLab } from '../../lab/shell';
import { LabStates } from '../../lab/states';
import { spaceOf, unitOf } from '../../lab/surface-space';
import { plural, text } from '../../texts';
import { connectSegment } from './client';
import { SegmentData, type SegmentOpening, type SegmentSource } from './data';
import { SegmentEditing } from './editing';
import type { SegmentExample } from './examples';
import type { Overlays } from './label-overlay';
import { linkOf, toHash } from './link';
import { factsOf, MAP_FACT } from './page';
import type { LabelMeasures, MeasuresShown } from './panels/measures';
import { type PartEvents, SegmentParts, type SurfaceFormat } from './parts';
import type { OpenedImage, OpenedLabels, ParamValues, SurfaceUpdate, VolumeView, WorkerEvent } from './protocol';
import { saveMap, saveSurfaces } from './saving';
import type { SegmentContent } from './schema';
import { hasBrush, type Tool, type ToolSettings, Tools, usesRange } from './tools';
import { SEGMENT_VIEW } from './view';

/** Milliseconds after the last change of an intensity range until the worker is asked which voxels are in it. */
const MASK_DELAY = 120;

/** Milliseconds that a step may still take after *Cancel*, before the worker is ended. */
const CANCEL_AFTER = 400;

/** Milliseconds after which the surfaces are said to follow a change: mostly they have then. */
const SAID_AFTER = 500;

/** Overlays before there are labels. */
const NO_OVERLAYS: Pick<Overlays, 'colors' | 'names' | 'paint' | 'mask'> = {
  colors: new Map(),
  names: new Map(),
  paint: [255, 255, 255],
  mask: undefined,
};

/**
 * The Segment lab: labels are painted on slices, and their surfaces follow. Data, editing and saving are in files of
 * their own.
 */
class SegmentLab implements ShelledLab<SegmentExample> {
  readonly shell: LabShell<SegmentExample>;

  readonly id = 'segment';
  readonly client = connectSegment((event) => this.#onEvent(event));
  readonly ui: SegmentParts;
  readonly states: LabStates;
  readonly opening: SegmentOpening;
  readonly #data: SegmentData;
  readonly #editing: SegmentEditing;
  readonly #tools = new Tools();
  readonly #measures = new Map<number, LabelMeasures>();
  readonly #shown = signal<MeasuresShown>({
    ...{ labels: [], measures: new Map(), unit: '', more: { latency: {}, updates: 0 } },
  });
  readonly #noRoom = signal('');
  #volume: VolumeView | undefined;
  /** Parameters of the surfaces in force. */
  #params: ParamValues = {};
  /** Range of intensities of the mask that the editing has, as text; undefined if it has none. */
  #maskRange: string | undefined;
  #maskTimer = 0;
  #busyTimer = 0;
  /** Ends the worker if it does not answer after *Cancel*. */
  #cancelTimer = 0;
  /** Whether surfaces do not follow what was opened again, since that was cancelled. */
  #isCancelled = false;
  /** Time in milliseconds at which the last stroke ended; undefined once its surfaces are drawn. */
  #released: number | undefined;
  /** Whether the last fill has reached no voxel. */
  #isUnfilled = false;
  /** Milliseconds from the end of the last stroke until surfaces with it were drawn, and smooth ones. */
  #latency: { first?: number; smooth?: number } = {};
  /** Number of times that surfaces were shown. */
  #updates = 0;

  constructor(place: LabPlace) {
    const shell = new LabShell(place, this);
    this.shell = shell;
    const { root } = shell;
    const editing = this.#newEditing();
    this.#editing = editing;
    const { list, undo } = editing;
    const shown = { tools: this.#tools, list, undo, refusal: this.#noRoom, measures: this.#shown };
    const ui = new SegmentParts(root, shell.signal, shown, this.#events());
    const states = new LabStates(ui.page.banner, ui.page.status, shell.signal);
    this.ui = ui;
    this.states = states;
    list.subscribe(() => this.#showLabels());
    undo.subscribe(({ undoable }) => (undoable ? shell.work.did('painted') : shell.work.settled('painted')));
    this.#tools.settings.subscribe((settings) => this.#applyTool(settings));
    this.#data = new SegmentData(this.client, {
      adopt: (opened, source, reopening) => this.#adopt(opened, source, reopening),
      labels: () => this.#editing.voxels?.slice(),
    });
    this.opening = new Opening(this.client, ui.page, states, this.#data);
    shell.begin(this.#shortcuts());
  }

  #newEditing(): SegmentEditing {
    return new SegmentEditing(this.client, {
      onVoxels: () => this.ui.view.showLabels(),
      onUpdate: (update, smooth) => {
        this.ui.page.warnings.showReport(update);
        this.#take(update, smooth);
      },
      onBusy: () => {
        this.states.setModelState('running');
        this.#sayLater(text('segment.following'));
      },
      onStopped: () => this.#stopped(),
      onNothing: (reason) => {
        this.#isUnfilled = true;
        this.#released = undefined;
        this.ui.page.status.say(reason);
      },
      onError: (title, error) => {
        clearTimeout(this.#busyTimer);
        clearTimeout(this.#cancelTimer);
        this.ui.page.offerCancel(false);
        this.states.fail(title, error);
      },
    });
  }

  closed(): void {
    clearTimeout(this.#maskTimer);
    clearTimeout(this.#busyTimer);
    clearTimeout(this.#cancelTimer);
    delete this.shell.root.dataset.tool;
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      ...this.shell.events(),
      onCancel: () => this.#cancel(),
      onMapFiles: (files) => void this.#openLabels(files),
      onParam: (name, value) => void this.#setParam(name, value),
      onOptions: () => this.#optionsChanged(),
      onSaveMap: (format) => this.shell.ask(this.#saveMap(format), text('segment.saveFailed')),
      onSaveSurfaces: (format) => this.#saveSurfaces(format),
      onReset: () => void this.#reset(),
      labels: {
        activate: (value) => this.#editing.setActive(value),
        rename: (value, name) => this.#editing.rename(value, name),
        recolor: (value, color) => this.#editing.recolor(value, color),
        setVisible: (value, visible) => this.#editing.setVisible(value, visible),
        add: () => this.#addLabel(),
        remove: (value) => this.#editing.remove(value),
      },
      onApply: () => this.#apply(),
      onTravel: (direction) => this.#travel(direction),
      press: (at, axis) => this.#press(at, axis),
      onPick: (label) => this.#editing.setActive(label),
    };
  }

  #shortcuts(): Shortcut[] {
    const tool = (key: string, one: Tool, what: string): Shortcut => ({
      key,
      shown: key,
      text: what,
      act: () => this.#tools.set({ tool: one }),
    });
    const travel = (direction: 'undo' | 'redo') => () => this.#travel(direction);
    return [
      tool('b', 'brush', text('segment.brush')),
      tool('t', 'threshold', text('segment.threshold')),
      tool('e', 'eraser', text('segment.eraser')),
      tool('f', 'fill', text('segment.fill')),
      tool('v', 'navigate', text('segment.navigate')),
      { key: '[', shown: '[', text: text('segment.smallerKey'), act: () => this.#tools.changeRadius(-1) },
      { key: ']', shown: ']', text: text('segment.largerKey'), act: () => this.#tools.changeRadius(1) },
      { key: ',', shown: ',', text: text('segment.previousSliceKey'), act: () => this.ui.view.goAlong(-1) },
      { key: '.', shown: '.', text: text('segment.nextSliceKey'), act: () => this.ui.view.goAlong(1) },
      { key: 'p', shown: 'p', text: text('segment.applyKey'), act: () => this.#apply() },
      { key: 'n', shown: 'n', text: text('segment.addKey'), act: () => this.#addLabel() },
      { key: 'u', shown: 'u', text: text('labs.undo'), act: travel('undo') },
      { key: 'z', ctrl: true, shown: text('labs.keyUndo'), text: text('labs.undo'), act: travel('undo') },
      { key: 'shift+z', ctrl: true, shown: text('labs.keyRedo'), text: text('labs.redo'), act: travel('redo') },
      { key: 'y', ctrl: true, shown: text('labs.keyRedoToo'), text: text('labs.redo'), act: travel('redo') },
    ];
  }

  /** Displays a newly opened volume and its labels; after a failure of the engine, with the list of labels as before. */
  #adopt(opened: OpenedImage, { name, example, linked, session }: SegmentSource, reopening: boolean): void {
    const { volume, voxels, params } = opened;
    const before = [this.#volume?.voxels, this.#editing.voxels];
    this.states.ready = true;
    this.#volume = volume;
    this.ui.page.saving.name = example?.id ?? name;
    this.#params = params;
    this.ui.page.data.show(factsOf(opened, example), example);
    this.ui.page.unit = example?.unit ?? unitOf(volume);
    this.ui.showParams(params);
    this.#forgetMask();
    this.ui.view.setVolume(volume, { dims: volume.dims, voxels, ...NO_OVERLAYS });
    if (reopening) this.#editing.readopt(volume, opened);
    else if (session) this.#resume(opened, contentOf<SegmentContent>(session, 'segment'));
    else {
      this.#editing.adopt(volume, opened, example?.labels ?? []);
      this.#tools.set({ range: example?.range ?? [...volume.window] });
      this.ui.options.set({ ...initialOptions(SEGMENT_VIEW), ...linked?.view });
    }
    before.forEach(release);
    this.#applyTool(this.#tools.value);
    this.#showAll(opened);
  }

  /** Continues a session: its list of labels, tools and view. */
  #resume(opened: OpenedImage, { tools, view, ...list }: SegmentContent): void {
    this.#editing.resume(opened.volume, opened, list);
    if (tools) this.#tools.set(tools);
    this.ui.page.data.setFact(MAP_FACT, text('segment.sessionMap'));
    if (!view) return;
    this.ui.options.set(view.options);
    this.ui.view.pose = view;
  }

  async sessionContent(): Promise<Record<string, unknown>> {
    while (this.#editing.isBusy) await this.#editing.followed;
    const { labels, active, hidden, voxels } = this.#editing;
    const copy = voxels?.slice();
    const state = await this.client.request('save', undefined);
    const view = { ...this.ui.view.pose, options: this.ui.options.value };
    const list = { labels, active, hidden: [...hidden] };
    return { voxels: copy, state, ...list, params: this.#params, tools: this.#tools.value, view };
  }

  /** Opens a label map of the open volume in place of the present one. */
  async #openLabels(files: File[]): Promise<void> {
    const volume = this.#volume;
    if (!volume || !this.states.canChange || !(await this.shell.mayReplace())) return;
    const name = nameOf(files);
    this.states.load(text('labs.opening', { name }));
    try {
      const opened = await this.client.request('openLabels', { files: await readFiles(files) });
      const before = this.#editing.voxels;
      this.ui.view.setVolume(volume, { dims: volume.dims, voxels: opened.voxels, ...NO_OVERLAYS });
      this.#forgetMask();
      this.#editing.adopt(volume, opened, []);
      release(before);
      this.#applyTool(this.#tools.value);
      this.ui.page.data.setFact(MAP_FACT, opened.labelFile ?? name);
      this.#showAll(opened);
    } catch (error) {
      this.states.fail(text('labs.openFailed', { name }), error);
    }
  }

  #showAll(opened: OpenedLabels): void {
    this.ui.page.warnings.showData(opened.warnings);
    this.#measures.clear();
    this.#released = undefined;
    this.#latency = {};
    this.#show(opened);
    if (this.#isCancelled) this.#stopped();
    else this.#editing.follow();
    this.#isCancelled = false;
  }

  /** Cancels the opening of data, or has the surfaces remain unchanged until the next change. */
  #cancel(): void {
    if (this.states.value !== 'running') return void this.opening.cancel();
    this.#editing.stop();
    this.#cancelTimer = window.setTimeout(() => {
      // A single step takes too long: the labels are opened again, in another worker.
      this.#isCancelled = true;
      this.states.load(text('labs.cancelling'));
      void this.opening.cancel().then(() => {
        if (this.states.value === 'done') this.ui.page.status.say(text('segment.stopped'));
      });
    }, CANCEL_AFTER);
  }

  #stopped(): void {
    clearTimeout(this.#busyTimer);
    clearTimeout(this.#cancelTimer);
    this.ui.page.offerCancel(false);
    this.#showMeasures();
    const { value } = this.states;
    if (value === 'running' || value === 'loading') this.states.idle(text('segment.stopped'), 'done');
  }

  /** Shows surfaces that have followed a change; when they are smooth, the lab is done. */
  #take(update: SurfaceUpdate, smooth: boolean): void {
    this.#show(update);
    const released = this.#released;
    if (smooth) this.ui.view.afterDrawing(() => this.#settle());
    else if (update.surfaces.length > 0 && released !== undefined)
      this.ui.view.afterDrawing(() => {
        this.#latency = { first: performance.now() - released };
      });
  }

  /** Says what is under way, unless it is over soon, as after a stroke. */
  #sayLater(what: string): void {
    clearTimeout(this.#busyTimer);
    this.#busyTimer = window.setTimeout(() => {
      if (this.states.value !== 'running') return;
      this.ui.page.status.say(what);
      this.ui.page.offerCancel(true);
    }, SAID_AFTER);
  }

  /** Ends a change, when its smooth surfaces are drawn, unless another one has begun. */
  #settle(): void {
    if (this.#editing.isBusy) return;
    clearTimeout(this.#busyTimer);
    clearTimeout(this.#cancelTimer);
    this.ui.page.offerCancel(false);
    if (this.#released !== undefined) this.#latency = { ...this.#latency, smooth: performance.now() - this.#released };
    this.#released = undefined;
    this.#showMeasures();
    if (this.states.setModelState('done')) this.ui.page.status.say(this.describe());
  }

  #show({ surfaces }: SurfaceUpdate): void {
    if (surfaces.length > 0) this.#updates += 1;
    this.ui.view.showSurfaces(surfaces);
    for (const { value, voxels, volume, area, surface } of surfaces) {
      const { vertices = 0, triangles = 0 } = surface ?? {};
      const version = (this.#measures.get(value)?.version ?? 0) + 1;
      this.#measures.set(value, { value, voxels, volume, area, vertices, triangles, version });
    }
    this.#showMeasures();
  }

  #showMeasures(): void {
    const more = { latency: this.#latency, updates: this.#updates };
    const { labels } = this.#editing;
    this.#shown.value = { labels, measures: this.#measures, unit: this.ui.page.unit, more };
  }

  /** Shows the list of labels and their colours everywhere. */
  #showLabels(): void {
    const { labels, active, hidden } = this.#editing;
    const visible = labels.filter(({ value }) => !hidden.has(value));
    this.#noRoom.value = '';
    this.ui.view.setAppearance(new Map(labels.map(({ value, color }) => [value, color])), hidden);
    const painted = labels.find(({ value }) => value === active);
    this.ui.view.showLabels({
      colors: new Map(visible.map((label) => [label.value, rgbOf(label)])),
      names: new Map(labels.map(({ value, name }) => [value, name])),
      ...(painted && { paint: rgbOf(painted) }),
    });
    this.#showMeasures();
  }

  #press(at: Parameters<PartEvents['press']>[0], axis: Parameters<PartEvents['press']>[1]) {
    if (!this.states.canChange) return undefined;
    this.#isUnfilled = false;
    const grip = this.#editing.press(at, axis, this.#tools.value);
    if (!grip || this.#isUnfilled) return grip;
    this.#released = undefined;
    this.#latency = {};
    const drop = () => {
      this.#released = performance.now();
      grip.drop();
      // The surfaces may have followed before the pointer was released.
      if (!this.#editing.isBusy) this.ui.view.afterDrawing(() => this.#settle());
    };
    return { move: grip.move, drop };
  }

  /** Applies the tool in use at the crosshair: the alternative to the pointer for the keyboard. */
  #apply(): void {
    const { view } = this.ui;
    const settings = this.#tools.value;
    if (!this.states.canChange) return;
    if (settings.tool === 'navigate') this.ui.page.status.say(text('segment.applyNothing'));
    else {
      this.#latency = {};
      this.#released = performance.now();
      this.#editing.apply(view.crosshair, view.axial, settings);
    }
  }

  #addLabel(): void {
    if (this.states.canChange && !this.#editing.add()) this.#noRoom.value = text('segment.noRoom');
  }

  #travel(direction: 'undo' | 'redo'): void {
    if (!this.states.canChange) return;
    this.#latency = {};
    this.#released = performance.now();
    this.#editing.travel(direction);
  }

  #applyTool(settings: ToolSettings): void {
    const { tool, radius, shape } = settings;
    const voxel = Math.min(...(this.#volume?.spacing ?? [1]));
    // Half a voxel more, as the brush covers.
    this.ui.view.setBrush(hasBrush(tool) ? { radius: (radius + 0.5) * voxel, disc: shape === 'disc' } : undefined);
    this.shell.root.dataset.tool = tool;
    this.#followRange(settings);
  }

  /** Asks the worker which voxels are in the range of intensities, if the tool in use needs that, and it is another one. */
  #followRange(settings: ToolSettings): void {
    if (!this.states.ready) return;
    const { range } = settings;
    const wanted = range.join(' ');
    const isKnown = wanted === this.#maskRange;
    const isUsed = usesRange(settings);
    this.ui.view.showLabels({ mask: isUsed && isKnown ? this.#editing.mask : undefined });
    if (!isUsed || isKnown) return;
    this.#forgetMask();
    this.#maskTimer = window.setTimeout(() => void this.#requestMask(range, wanted), MASK_DELAY);
  }

  async #requestMask([low, high]: [number, number], wanted: string): Promise<void> {
    try {
      const mask = await this.client.request('mask', { low, high });
      if (mask.length !== this.#editing.voxels?.length) return;
      this.#maskRange = wanted;
      this.#editing.mask = mask;
      this.#followRange(this.#tools.value);
    } catch (error) {
      this.states.fail(text('labs.requestFailed'), error);
    }
  }

  #forgetMask(): void {
    this.#maskRange = undefined;
    this.#editing.mask = undefined;
    clearTimeout(this.#maskTimer);
  }

  #setParam(name: string, value: unknown): Promise<void> {
    return this.states.enqueue(async () => {
      if (!this.states.canChange) return this.ui.showParams(this.#params);
      try {
        const params = await this.client.request('setParams', { [name]: value });
        this.#params = params;
        this.ui.showParams(params);
        this.#released = undefined;
        this.#latency = {};
        this.#editing.follow();
      } catch (error) {
        const { code, message } = toFailure(error);
        if (code === 'internal') this.states.fail(text('labs.requestFailed'), error);
        this.ui.showParams(this.#params);
        this.ui.page.refuseParam(name, message);
      }
    });
  }

  #optionsChanged(): void {
    if (this.states.ready) this.shell.updateAddress();
  }

  describe(): string {
    const present = [...this.#measures.values()].filter(({ voxels }) => voxels > 0);
    if (present.length === 0) return text('segment.nothingLabelled');
    const labels = plural('segment.surfaces', present.length);
    const { smooth } = this.#latency;
    if (smooth === undefined) return text('segment.ready', { labels });
    return text('segment.followed', { labels, milliseconds: Math.round(smooth) });
  }

  #onEvent({ failure }: WorkerEvent): void {
    this.states.fail(text('labs.requestFailed'), new RequestError(failure));
  }

  showControls(state: LabState): void {
    this.ui.showState(state, this.states.ready);
  }

  address({ example, name: file }: SegmentSource): string {
    const { defaults } = this.#data;
    return toHash(linkOf({ example, file, params: this.#params, defaults, view: this.ui.options.value }));
  }

  linkLacks(): string[] {
    return [text('segment.linkLacksLabels')];
  }

  async #saveMap(format: Parameters<typeof saveMap>[0]): Promise<void> {
    await saveMap(format, this.client, this.ui.page.saving, this.#editing.labels);
    this.shell.work.settled('painted');
  }

  #saveSurfaces(format: SurfaceFormat, recentre = false): void {
    this.ui.offer.value = undefined;
    const surfaces = this.ui.view.surfaces();
    const space = this.#volume ? spaceOf(this.#volume, this.ui.page.unit) : {};
    const saving = saveSurfaces(
      { format, recentre, ...space },
      this.client,
      this.ui.page,
      this.#editing.labels,
      surfaces,
    );
    const offering = saving.catch((error) => {
      const [first] = surfaces.values();
      if (toFailure(error).code !== 'precision' || !first) throw error;
      this.ui.offer.value = { format, origin: first.origin, save: () => this.#saveSurfaces(format, true) };
    });
    this.shell.ask(offering, text('segment.saveFailed'));
  }

  /** Opens volume and label map again; after a failure of the engine, with the present labels. */
  async #reset(): Promise<void> {
    const { source } = this.opening;
    if (this.states.engineBroken) await this.opening.reopen();
    else if (this.states.canChange && source && (await this.shell.mayReplace())) await this.opening.open(source);
  }
}

/** Makes the Segment lab. */
export const makeSegment = (place: LabPlace): Lab => new SegmentLab(place).shell;
