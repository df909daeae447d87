import { History } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { Lab, LabPlace } from '../../lab/lab';
import { Opening } from '../../lab/opening';
import { type RunningLab, Runs } from '../../lab/runs';
import { contentOf } from '../../lab/session/content';
import { LabShell } from '../../lab/shell';
import { LabStates } from '../../lab/states';
import { text } from '../../texts';
import { completed } from './before';
import { connectReconstruct } from './client';
import { type CloudOrigin, type OpenedCloud, ReconstructData, type ReconstructOpening } from './data';
import { type CloudExample, viewOf } from './examples';
import { fits, linkOf, photoFor, toHash } from './link';
import { type PartEvents, ReconstructParts } from './parts';
import { type CloudPreset, type CloudVariant, isCloudPreset, variantInForce } from './presets';
import type { ParamValues, PointQuantity, WorkerEvent } from './protocol';
import { ReconstructResults } from './results';
import type { ReconstructContent } from './schema';
import { ReconstructSettings } from './settings';
import type { CloudViewOptions } from './view';

/**
 * Number of voxels along the longest side of the volume in which the implicit function f is saved, or passed on to the
 * Extract lab.
 */
const VOLUME_SIZE = 96;

/** The Reconstruct lab: an implicit surface is fitted to points. Data, settings and results are in files of their own. */
class ReconstructLab implements RunningLab<CloudExample> {
  readonly shell: LabShell<CloudExample>;
  readonly #runs: Runs<CloudExample>;

  readonly id = 'reconstruct';
  readonly client = connectReconstruct((event) => this.#onEvent(event));
  readonly ui: ReconstructParts;
  readonly states: LabStates;
  readonly opening: ReconstructOpening;
  readonly #data: ReconstructData;
  readonly #results: ReconstructResults;
  readonly #settings: ReconstructSettings;
  readonly #history = new History();
  #quantity: PointQuantity | undefined;

  readonly escape = {
    text: text('reconstruct.dismissKey'),
    act: () => {
      const { page, tools, photos } = this.ui;
      if (page.banner.shown) this.shell.dismiss();
      else if (tools.tool.peek() !== 'none') tools.choose('none');
      else photos.choose(undefined);
    },
  };

  constructor(place: LabPlace) {
    const shell = new LabShell(place, this);
    const runs = new Runs(shell, this);
    this.shell = shell;
    this.#runs = runs;
    const { client } = this;
    const { root, signal } = shell;
    const history = this.#history;
    const ui = new ReconstructParts(root, history, client, signal, this.#events());
    const states = new LabStates(ui.page.banner, ui.page.status, signal);
    this.ui = ui;
    this.states = states;
    this.#results = new ReconstructResults(client, ui, states, history);
    this.#settings = new ReconstructSettings(client, ui, states, this.#results, (params) => this.#showParams(params));
    this.#data = new ReconstructData(client, this.#settings, (opened, origin) => this.#adopt(opened, origin));
    this.opening = new Opening(client, ui.page, states, this.#data);
    runs.begin();
  }

  closed(): void {
    this.#results.close();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      ...this.#runs.events(),
      onVariant: (preset, variant) => this.#openVariant(preset, variant),
      onChoice: (choice, what) => void this.#settings.change({ choice }, text('labs.changeOf', { name: what })),
      onParam: (name, value) => void this.#settings.setParam(name, value),
      onPick: (hit) => void this.#settings.pick(hit),
      onTakeBack: () => void this.#settings.takeBackEdits(),
      onOptions: (options) => this.#setOptions(options),
      onPhotograph: () => this.shell.updateAddress(),
      onSaveVolume: () => this.#saveVolume(),
      onPassOn: () => this.#toExtract(),
      onSculpt: () => this.#runs.toSculpt(this.ui.run.surfaceFile({ format: 'ply' })),
    };
  }

  /** Displays newly opened points, with the settings of their example or link, and runs the model. */
  async #adopt(opened: OpenedCloud, { name, example, linked, session }: CloudOrigin): Promise<void> {
    const { cloud, params, photographs, setup } = opened;
    const pictured = photographs.some(({ picture }) => picture);
    this.states.ready = true;
    this.#results.clear();
    this.ui.adopt(cloud, photographs, example, name);
    this.#settings.adopt(cloud, setup);
    const colored = !example && (pictured || cloud.colors) ? ({ color: 'own' } as const) : {};
    this.ui.options.set({ ...viewOf(example), ...colored, ...linked?.view });
    this.ui.photos.choose(photoFor(example, linked?.photo));
    this.#settings.showParams(params);
    if (session) return this.#resume(completed(contentOf<ReconstructContent>(session, 'reconstruct')));
    await this.client.request('play', undefined);
  }

  /** Continues a session, whose model has been restored: shows its state and view, and does not run it. */
  async #resume({ undo, redo, reports, view }: ReconstructContent): Promise<void> {
    this.#settings.entries = { undo, redo };
    const [list = []] = reports;
    this.#history.rewind({ reports: list, iteration: Number.POSITIVE_INFINITY });
    if (view) {
      this.ui.options.set(view.options);
      this.ui.view.pose = view.camera;
    }
    // Sends the surface, its measures and the state.
    await this.client.request('step', { count: 0 });
    const state = list.at(-1)?.done ? 'done' : 'paused';
    this.states.idle(this.#results.describe(state), state);
    this.#results.showState(state);
  }

  async sessionContent(): Promise<Record<string, unknown>> {
    const { state, ...model } = await this.#runs.paused(() => this.client.request('save', undefined));
    const view = { camera: this.ui.view.pose, options: this.ui.options.value };
    return { state, model, ...this.#settings.entries, reports: [this.#history.reports], view };
  }

  #openVariant(preset: CloudPreset, { name, params, maxPoints }: CloudVariant): void {
    const choice = { ...this.#settings.choice, maxPoints: maxPoints ?? preset.maxPoints };
    const changed = { choice, params: { ...this.#data.defaults, ...preset.params, ...params } };
    void this.#settings.change(changed, text('labs.figureChange', { name }));
  }

  #showParams(params: ParamValues): void {
    const { defaults } = this.#data;
    const example = this.opening.source?.example;
    const preset = isCloudPreset(example) ? example : undefined;
    const variant = preset && variantInForce(preset, params, this.#settings.choice.maxPoints, defaults);
    this.ui.showParams(params, preset, variant);
    this.shell.updateAddress();
  }

  #setOptions({ color }: CloudViewOptions): void {
    const quantity = color === 'mean curvature' || color === 'distance' ? color : undefined;
    if (quantity !== this.#quantity) this.shell.ask(this.client.request('quantity', quantity));
    this.#quantity = quantity;
    this.shell.updateAddress();
  }

  address({ example, name: file }: CloudOrigin): string {
    const { choice, params, edits } = this.#settings;
    const { defaults } = this.#data;
    const { value: view } = this.ui.options;
    const photo = this.ui.photos.chosen.peek();
    const { size } = this.ui.view;
    return toHash(linkOf({ example, file, choice, params, defaults, edits, size, view, photo }));
  }

  linkLacks(): (string | false)[] {
    return [!fits(this.#settings.edits) && text('reconstruct.linkLacksEdits')];
  }

  #saveVolume(): void {
    const volume = this.client.request('volume', { size: VOLUME_SIZE });
    const saved = volume.then(({ extension, bytes }) => {
      this.ui.page.saving.bytes(extension, bytes, 'application/octet-stream');
      if (extension === 'nrrd')
        this.ui.page.status.say(text('reconstruct.savedAsNrrd', { stem: this.ui.page.saving.stem }));
    });
    this.shell.ask(saved, text('reconstruct.volumeFailed'));
  }

  /**
   * Opens the implicit function f in the Extract lab as a volume, with the value of f at the surface as iso value;
   * inside the surface, f is above it.
   */
  #toExtract(): void {
    this.ui.page.status.say(text('reconstruct.samplingVolume'));
    const name = text('reconstruct.volumeName', { name: this.ui.page.saving.name });
    const { surfaceWarnings: warnings } = this.ui.run;
    const volume = this.client.request('volume', { size: VOLUME_SIZE });
    const passed = volume.then(({ bytes, level }) =>
      this.shell.passOn({ lab: 'extract', name, bytes, params: { iso: level, isoForce: -1 }, warnings }),
    );
    this.shell.ask(passed, text('reconstruct.volumeFailed'));
  }

  /** Rebuilds the model with the same settings and clears the surface; only the points stay. */
  startOver(): Promise<void> {
    return this.#runs.building(async () => {
      await this.#settings.rebuild();
      this.#results.clear();
    });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#settings.travel(way);
  }

  #onEvent(event: WorkerEvent): void {
    if (!this.#runs.takes(event)) this.#results.take(event);
  }

  settled(state: LabState): void {
    this.#results.showState(state);
  }

  showControls(state: LabState): void {
    const { modelState, ready } = this.states;
    this.ui.showState(state, modelState, ready, state !== 'loading' && this.#results.complete);
  }

  describe(): string {
    return this.#results.describe(this.states.value);
  }
}

/** Makes the Reconstruct lab. */
export const makeReconstruct = (place: LabPlace): Lab => new ReconstructLab(place).shell;
