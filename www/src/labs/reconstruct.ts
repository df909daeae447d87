import { RequestError } from '../channel';
import { GUIDES } from '../guides';
import { ReconstructClient } from '../reconstruct/client';
import { type CloudPreset, type CloudVariant, isCloudPreset, variantInForce } from '../reconstruct/presets';
import type { ParamValues, PointQuantity, WorkerEvent } from '../reconstruct/protocol';
import type { LabState } from '../state';
import { text } from '../texts';
import { History } from '../ui/history';
import { labShortcuts, offerShortcuts, type Shortcut } from '../ui/shortcuts';
import type { CloudViewOptions } from '../view/reconstruction';
import { LabStates } from './lab-states';
import type { Lab, OpenInLab } from './labs';
import { photoFor } from './reconstruct-link';
import { type CloudOrigin, type OpenedCloud, ReconstructOpening } from './reconstruct-opening';
import { type PartEvents, ReconstructParts } from './reconstruct-parts';
import { ReconstructResults } from './reconstruct-results';
import { RunControl } from './reconstruct-running';
import { ReconstructSettings } from './reconstruct-settings';
import { ReconstructSharing } from './reconstruct-sharing';

/**
 * The Reconstruct lab: an implicit surface is fitted to points. This class connects the lab's parts; opening, settings,
 * running, results and sharing are in files of their own.
 */
export class ReconstructLab implements Lab {
  readonly #root: HTMLElement;
  readonly #passOn: OpenInLab;
  readonly #closing = new AbortController();
  readonly #client = new ReconstructClient((event) => this.#onEvent(event));
  readonly #ui: ReconstructParts;
  readonly #states: LabStates;
  readonly #running: RunControl;
  readonly #results: ReconstructResults;
  readonly #settings: ReconstructSettings;
  readonly #opening: ReconstructOpening;
  readonly #sharing: ReconstructSharing;
  #quantity: PointQuantity | undefined;

  constructor(root: HTMLElement, help: HTMLElement, passOn: OpenInLab) {
    this.#root = root;
    this.#passOn = passOn;
    const { signal } = this.#closing;
    const client = this.#client;
    const history = new History();
    const ui = new ReconstructParts(root, history, client, signal, this.#events());
    const states = new LabStates(ui.banner, ui.status, signal);
    this.#ui = ui;
    this.#states = states;
    this.#running = new RunControl(client, ui, states);
    this.#results = new ReconstructResults(client, ui, states, history);
    this.#settings = new ReconstructSettings(client, ui, states, this.#results, this.#running, (params) =>
      this.#showParams(params),
    );
    this.#opening = new ReconstructOpening(client, ui, states, this.#settings, (opened, origin) =>
      this.#adopt(opened, origin),
    );
    this.#sharing = new ReconstructSharing(client, ui, states, this.#settings, this.#opening);
    states.subscribe((state) => this.#showState(state));
    offerShortcuts(this.#shortcuts(), help, GUIDES.reconstruct, signal);
  }

  /** Opens what the address asks for, or else the first example, and runs it. */
  async start(): Promise<void> {
    await this.#opening.start(this.#closing.signal, () => this.#sharing.updateAddress());
  }

  close(): void {
    this.#closing.abort();
    this.#opening.close();
    this.#client.close();
    this.#results.close();
    this.#ui.dispose();
    this.#root.replaceChildren();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      onFiles: (files) => void this.#opening.files(files),
      onExample: (example) => void this.#opening.example(example),
      onExampleId: (id) => this.#opening.byId(id),
      onVariant: (preset, variant) => this.#openVariant(preset, variant),
      onChoice: (choice, what) => void this.#settings.change({ choice }, text('labs.changeOf', { name: what })),
      onParam: (name, value) => void this.#settings.setParam(name, value),
      onPick: (hit) => void this.#settings.pick(hit),
      onTakeBack: () => void this.#settings.takeBackEdits(),
      onOptions: (options) => this.#setOptions(options),
      onPhotograph: () => this.#sharing.updateAddress(),
      onToggle: () => this.#running.toggle(),
      onStep: (steps) => this.#running.step(steps),
      onReset: () => void this.#reset(),
      onUndo: () => void this.#settings.travel('undo'),
      onRedo: () => void this.#settings.travel('redo'),
      onDismiss: () => this.#dismiss(),
      onSaveVolume: () => this.#sharing.saveVolume(),
      onPassOn: () => this.#sharing.toExtract(this.#passOn),
      onSculpt: () => this.#sharing.toSculpt(this.#passOn),
      onCopyLink: () => void this.#sharing.copyLink(),
      onError: (title, error) => this.#states.fail(title, error),
    };
  }

  #shortcuts(): Shortcut[] {
    return [
      ...labShortcuts(this.#events()),
      {
        key: 'Escape',
        shown: text('labs.keyEscape'),
        text: text('reconstruct.dismissKey'),
        act: () => this.#escape(),
      },
    ];
  }

  /** Displays newly opened points, with the settings of their example or link, and runs the model. */
  async #adopt(opened: OpenedCloud, { name, example, linked }: CloudOrigin): Promise<void> {
    const { cloud, params, photographs, setup } = opened;
    const pictured = photographs.some(({ picture }) => picture);
    this.#states.ready = true;
    this.#results.clear();
    this.#ui.adopt(cloud, photographs, example, name);
    this.#settings.adopt(cloud, setup);
    const color = (linked?.color ??
      example?.color ??
      (pictured || cloud.colors ? 'own' : 'plain')) as CloudViewOptions['color'];
    this.#ui.options.set({ color, points: true, constraints: false, ...(isCloudPreset(example) && example.view) });
    this.#ui.photos.choose(photoFor(example, linked?.photo));
    this.#settings.showParams(params);
    await this.#running.play();
  }

  #openVariant(preset: CloudPreset, { name, params, maxPoints }: CloudVariant): void {
    const choice = { ...this.#settings.choice, maxPoints: maxPoints ?? preset.maxPoints };
    const changed = { choice, params: { ...this.#opening.defaults, ...preset.params, ...params } };
    void this.#settings.change(changed, text('labs.figureChange', { name }));
  }

  #showParams(params: ParamValues): void {
    const { source, defaults } = this.#opening;
    const example = source?.example;
    const preset = isCloudPreset(example) ? example : undefined;
    const variant = preset && variantInForce(preset, params, this.#settings.choice.maxPoints, defaults);
    this.#ui.showParams(params, preset, variant);
    this.#sharing.updateAddress();
  }

  #setOptions({ color }: CloudViewOptions): void {
    const quantity = color === 'mean curvature' || color === 'distance' ? color : undefined;
    if (quantity !== this.#quantity) this.#running.ask(this.#client.request('quantity', quantity));
    this.#quantity = quantity;
    this.#sharing.updateAddress();
  }

  /** Rebuilds the model with the same settings and clears the surface; only the points stay. */
  async #reset(): Promise<void> {
    const { ready, value, engineBroken } = this.#states;
    if (!ready || value === 'loading') return;
    if (engineBroken) return this.#opening.reopen();
    this.#states.load(text('labs.resetting'));
    try {
      await this.#settings.rebuild();
      this.#results.clear();
      this.#states.idle(text('labs.readyToStart'));
    } catch (error) {
      this.#states.fail(text('labs.buildFailed'), error);
    }
  }

  #onEvent(event: WorkerEvent): void {
    if (event.event === 'failure') this.#states.fail(text('labs.runFailed'), new RequestError(event.failure));
    else if (event.event !== 'state') this.#results.take(event);
    else if (this.#states.setModelState(event.state)) this.#results.showState(event.state);
  }

  #showState(state: LabState): void {
    const { modelState, ready } = this.#states;
    this.#root.dataset.state = state;
    this.#ui.showState(modelState, ready, state !== 'loading' && this.#results.complete);
  }

  /**
   * Handles the Escape key: dismisses the error message, else deselects the edit tool, else leaves the camera of a
   * photograph.
   */
  #escape(): void {
    const { banner, tools, photos } = this.#ui;
    if (banner.shown) this.#dismiss();
    else if (tools.tool !== 'none') tools.deselect();
    else photos.choose(undefined);
  }

  #dismiss(): void {
    if (this.#states.dismiss()) this.#ui.status.say(this.#results.describe(this.#states.value));
  }
}
